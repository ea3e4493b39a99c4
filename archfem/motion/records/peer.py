"""PEER and PEER NGA `.AT2` files: a header with NPTS and DT, then samples in g."""

import re

from archfem.motion.records.channel import Channel
from archfem.motion.records.text import COUNT, NUMBER, RecordText
from archfem.motion.records.units import units_written

_HEADER = 12  # lines; files in the wild begin with blank lines or lack one of the four

_BEFORE = re.compile(rf"\s*({COUNT})[\s,]+({NUMBER})[\s,]+NPTS[\s,]*DT\b", re.IGNORECASE)
_OTHERS = re.compile(r"\b(?:VELOC|DISPL)", re.IGNORECASE)
_AFTER = re.compile(rf"\bNPTS[\s,]+DT\s*[=:]?\s*({COUNT})[\s,]+({NUMBER})", re.IGNORECASE)


def recognises(text: RecordText) -> bool:
    """Return whether the header names both NPTS and DT.

    Args:
        text: the file.
    """
    return text.holds(r"\bNPTS\b", _HEADER) and text.holds(r"\bDT\b", _HEADER)


def read(text: RecordText) -> list[Channel]:
    """Return the one component of the file.

    The count and the step stand behind their names (`NPTS= 5437, DT= .0050 SEC`), in either order,
    on one line or two, or both before or after the names (`4096 0.0100 NPTS, DT`). What else stands
    in the header is free, as in the El Centro record that OpenSees ships: a unit of acceleration
    tells that it is one, unless a velocity or a displacement is named.

    Args:
        text: the file.

    Raises:
        InvalidInput: the header cannot be read, tells of another quantity, or the count is wrong.
    """
    count, dt, line = _count_and_step(text)
    header = " ".join(text.lines[:line])
    if _OTHERS.search(header) and not re.search(r"\bACC", header, re.IGNORECASE):
        raise text.error("the header does not tell of an acceleration, but of another quantity")
    units = units_written(header)
    if len(units) != 1:
        raise text.error("the header does not tell one unit, such as UNITS OF G")
    samples = text.last_block(line + 1, count) * units.pop()
    return [Channel.directed(samples, text.step(dt, line), _direction(text, line))]


def _count_and_step(text: RecordText) -> tuple[int, float, int]:
    """Return NPTS, DT [s] and the index of the last header line."""
    for line, content in enumerate(text.lines[:_HEADER]):
        together = _BEFORE.match(content) or _AFTER.search(content)
        if together:
            return int(together[1]), float(together[2]), line
    count_line, count = text.find(rf"\bNPTS\s*[=:]?\s*({COUNT})\b(?!\.)", stop=_HEADER)
    step_line, step = text.find(rf"\bDT\s*[=:]?\s*({NUMBER})", stop=_HEADER)
    return int(count[1]), float(step[1]), max(count_line, step_line)


def _direction(text: RecordText, line: int) -> str:
    """Return the component: what follows the last comma of the line that names the station."""
    title = next((content for content in text.lines[1:line] if content.count(",") >= 2), "")
    direction = re.sub(r"\([^()]*\)?", "", title).rpartition(",")[2].strip()
    return direction if len(direction) <= 12 else ""
