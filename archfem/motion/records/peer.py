"""PEER and PEER NGA `.AT2` files: a header with NPTS and DT, then samples in g."""

import re

from archfem.motion.records.record_file import (
    COUNT_PATTERN,
    NUMBER_PATTERN,
    Channel,
    RecordFormat,
    RecordText,
)

# Files in the wild begin with blank lines or lack one of the four lines of the header.
_HEADER_LINES = 12


def _read(text: RecordText) -> list[Channel]:
    """Read the single component of the file."""
    # Count and step follow their names (`NPTS= 5437, DT= .0050 SEC`), in either order, on one line
    # or two, or both precede or follow the names (`4096 0.0100 NPTS, DT`). The rest of the header
    # is free: a unit of acceleration identifies one, unless a velocity or displacement is named.
    count, dt, line = _find_count_and_step(text)
    header = " ".join(text.lines[:line])
    other = re.search(r"\b(?:VELOC|DISPL)", header, re.IGNORECASE)
    if other and not re.search(r"\bACC", header, re.IGNORECASE):
        raise text.error("the header does not state an acceleration, but another quantity")
    unit = text.find_unit(header, "the header does not state one unit, such as UNITS OF G")
    samples = text.read_last_block(line + 1, count) * unit
    return [Channel.from_direction(samples, text.check_step(dt, line), _find_direction(text, line))]


def _find_count_and_step(text: RecordText) -> tuple[int, float, int]:
    """Return NPTS, DT [s] and the index of the last header line."""
    pair = rf"({COUNT_PATTERN})[\s,]+({NUMBER_PATTERN})"
    values_before_names = rf"^\s*{pair}[\s,]+NPTS[\s,]*DT\b"
    values_after_names = rf"\bNPTS[\s,]+DT\s*[=:]?\s*{pair}"
    together = text.search(values_before_names, stop=_HEADER_LINES)
    together = together or text.search(values_after_names, stop=_HEADER_LINES)
    if together:
        line, values = together
        return int(values[1]), float(values[2]), line
    count_pattern = rf"\bNPTS\s*[=:]?\s*({COUNT_PATTERN})\b(?!\.)"
    count_line, count = text.find(count_pattern, stop=_HEADER_LINES)
    step_line, step = text.find(rf"\bDT\s*[=:]?\s*({NUMBER_PATTERN})", stop=_HEADER_LINES)
    return int(count[1]), float(step[1]), max(count_line, step_line)


def _find_direction(text: RecordText, line: int) -> str:
    """Return the component: the text after the last comma of the line with the station."""
    title = next((content for content in text.lines[1:line] if content.count(",") >= 2), "")
    direction = re.sub(r"\([^()]*\)?", "", title).rpartition(",")[2].strip()
    return direction if len(direction) <= 12 else ""


PEER = RecordFormat("PEER", ((r"\bNPTS\b", _HEADER_LINES), (r"\bDT\b", _HEADER_LINES)), _read)
