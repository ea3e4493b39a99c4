"""Text files with named values above the samples: AFAD, CWB, ESM, K-NET, PEER and UNAM."""

import re

import numpy as np

from archfem._typing import Array
from archfem.motion.records.record_file import (
    COUNT_PATTERN,
    NUMBER_PATTERN,
    TIME_UNIT_PATTERN,
    Channel,
    RecordText,
    parse_time_unit,
)


def read_afad(text: RecordText) -> list[Channel]:
    """Read the three components of a file of AFAD (Turkish national network)."""
    count_line, count = text.find(rf"^\s*NUMBER OF DATA\s*:\s*({COUNT_PATTERN})\s*$")
    step_line, step = text.find(rf"SAMPLING INTERVAL\s*\(sec\)\s*:\s*({NUMBER_PATTERN})\s*$")
    peak_line, peaks = text.find(r"^\s*(?:RAW )?PGA VALUES\s*(\(.*?\))\s*:(.*)$")
    titles = r"^\s*" + r"\s+".join(["([NSEWUD]-[NSEWUD])"] * 3) + r"\s*$"
    names_line, names = text.find(titles, max(count_line, step_line, peak_line))
    unit = text.find_unit(peaks[1], "the header does not state the unit of the peaks", peak_line)
    table = _read_table(text, names_line + 1, int(count[1]), 3) * unit
    stated = [float(peak) * unit for peak in re.findall(rf"\)\s*({NUMBER_PATTERN})", peaks[2])]
    # the header has the peaks before the correction of the offset
    _check_peaks(text, table, stated, tolerance=0.5)
    dt = text.check_step(float(step[1]), step_line)
    start_time = text.find_start(r"^\s*RECORD TIME\s*:")
    return Channel.from_table(table, dt, names.groups(), start_time)


def read_unam(text: RecordText) -> list[Channel]:
    """Read the components of a standard acceleration file of UNAM (Mexico)."""
    count = _list_unam_values(text, r"NUM\. TOTAL DE MUESTRAS")
    steps = _list_unam_values(text, r"INTERVALO DE MUESTREO")
    peaks = _list_unam_values(text, r"ACEL\. MAX\.\(Gal\)")
    names = _list_unam_values(text, "ORIENTACION")
    if len(set(count)) != 1 or len(set(steps)) != 1 or len(names) != len(peaks):
        raise text.error("the components differ in number of samples or step, or in the header")
    unit_line, words = text.find(r"^UNIDADES DE LOS DATOS\s*:(.*)$")
    unit = text.find_unit(words[1], "the header does not state one unit", unit_line)
    # the header has lines of numbers too: the samples follow their own title
    start, _ = text.find("^DATOS DE ACELERACION")
    table = _read_table(text, text.header_length(start), _parse_count(text, count[0]), len(names))
    # the unit of the peaks is part of their key; they are printed with two decimals at least
    stated = [_parse_number(text, peak) for peak in peaks]
    _check_peaks(text, table * (unit / 0.01), stated, rounding=0.005)
    dt = text.check_step(_parse_number(text, steps[0]))
    return Channel.from_table(table * unit, dt, names)


def _list_unam_values(text: RecordText, key: str) -> list[str]:
    """Return the values of the first six channels after a key, which slashes separate."""
    _, found = text.find(rf"^{key}[^:]*C1-C6[^:]*:\s*/(.*)$")
    return [value.strip() for value in found[1].split("/")]


def read_cwb(text: RecordText) -> list[Channel]:
    """Read the three components of a file of CWB (Taiwan), whose first column is time."""
    rate_line, rate = text.find(rf"^#SampleRate\(Hz\):\s*({NUMBER_PATTERN})")
    duration = float(text.find(rf"^#RecordLength\(sec\):\s*({NUMBER_PATTERN})")[1][1])
    unit_line, words = text.find(r"^#AmplitudeUnit:\s*(.*)$")
    order_line, order = text.find(r"^#DataSequence:\s*Time((?:\s*\w+\(\+\);?)+)\s*$")
    # a component with a minus is another sense, of which no file is known: the pattern refuses it
    names = re.findall(r"(\w+)\(", order[1])
    frequency = max(float(rate[1]), 1e-9)
    dt = text.check_step(1.0 / frequency, rate_line)
    start = text.header_length(order_line)
    table = _read_table(text, start, round(min(frequency * duration, 1e9)), 1 + len(names))
    if np.abs(np.diff(table[:, 0]) - dt).max(initial=0.0) > 0.25 * dt:
        raise text.error(f"the column of times does not grow by {dt:g} s", start)
    unit = text.find_unit(words[1], "the header does not state one unit", unit_line)
    extremes = rf"^#AmplitudeMAX\.\s*%s:\s*({NUMBER_PATTERN})\s*~\s*({NUMBER_PATTERN})"
    stated = [max(map(float, text.find(extremes % name)[1].groups()), key=abs) for name in names]
    _check_peaks(text, table[:, 1:], stated, rounding=0.0005)
    return Channel.from_table(table[:, 1:] * unit, dt, names, text.find_start("^#StartTime"))


def _read_table(text: RecordText, first: int, count: int, width: int) -> Array:
    """Read the table of samples at the end of a file (count, width)."""
    numbers = text.read_last_block(first, width * count)
    if len(text.parse_row(first)) != width:
        raise text.error(f"expected {width} numbers: one sample of each component", first)
    return np.reshape(numbers, (-1, width))


def _check_peaks(text: RecordText, table: Array, stated: list[float], **limits: float) -> None:
    """Compare the columns of a table with the peaks of the header."""
    for column, peak in zip(table.T, stated, strict=False):
        text.check_peak(column, peak, **limits)


def read_esm(text: RecordText) -> list[Channel]:
    """Read the single component of a file of ESM, ITACA or AFAD-TADAS (DYNA 1.x)."""
    kind = _find_value(text, "DATA_TYPE")
    if kind.upper() != "ACCELERATION":
        raise text.error(f"DATA_TYPE is {kind!r}, expected ACCELERATION")
    line, count = text.find(rf"^\s*NDATA\s*:\s*({COUNT_PATTERN})\s*$")
    step_line, step = text.find(rf"^\s*SAMPLING_INTERVAL_S\s*:\s*({NUMBER_PATTERN})\s*$")
    dt = text.check_step(float(step[1]), step_line)
    duration = _find_value(text, "DURATION_S")
    if duration and abs(_parse_number(text, duration) - int(count[1]) * dt) > 2.0 * dt + 1e-3:
        raise text.error(f"{count[1]} samples at {dt:g} s do not last {duration} s", line)
    unit = text.find_unit(_find_value(text, "UNITS"), "UNITS is not a unit of acceleration")
    samples = text.read_last_block(text.header_length(), int(count[1])) * unit
    if peak := _find_value(text, r"PGA_CM/S\^2"):
        text.check_peak(samples, 0.01 * _parse_number(text, peak))
    direction = _find_value(text, "STREAM") or _find_value(text, "COMPONENT")
    start = text.find_start(r"^\s*DATE_TIME_FIRST_SAMPLE_YYYY")
    return [Channel.from_direction(samples, dt, direction, start)]


def _find_value(text: RecordText, key: str) -> str:
    """Return the text after a key of ESM, empty where the key is missing."""
    found = text.search(rf"^\s*{key}\s*:\s*(.*?)\s*$")
    return found[1][1] if found else ""


def _parse_number(text: RecordText, value: str) -> float:
    """Convert the value of a key to a number."""
    try:
        return float(value)
    except ValueError as error:
        raise text.error(f"the header gives {value!r} where a number is expected") from error


def _parse_count(text: RecordText, value: str) -> int:
    """Convert the value of a key to a number of samples."""
    if not re.fullmatch(COUNT_PATTERN, value):
        raise text.error(f"the header gives {value!r} where a number of samples is expected")
    return int(value)


def read_knet(text: RecordText) -> list[Channel]:
    """Read the single component of a file of K-NET or KiK-net, and subtract its mean."""
    # the number of samples is the product of frequency and duration in the header
    rate_line, rate = text.find(rf"^\s*Sampling Freq\(Hz\)\s+({NUMBER_PATTERN})\s*Hz")
    duration = text.find(rf"^\s*Duration Time\(s\)\s+({NUMBER_PATTERN})\s*$")[1]
    scale_factor = rf"^\s*Scale Factor\s+({NUMBER_PATTERN})\s*\(gal\)\s*/\s*({NUMBER_PATTERN})\s*$"
    scale = text.find(scale_factor)[1]
    memo = text.find(r"^\s*Memo")[0]
    direction = text.find(r"^\s*Dir\.\s+(\S+)")[1][1]
    frequency = float(rate[1])
    count = frequency * float(duration[1])
    if not 0.0 < count < 1e9 or float(scale[2]) == 0.0:
        raise text.error("frequency, duration and scale factor are positive numbers", rate_line)
    counts = text.read_last_block(memo + 1, round(count))
    samples = (counts - counts.mean()) * (0.01 * float(scale[1]) / float(scale[2]))
    peak = text.find(rf"^\s*Max\. Acc\. \(gal\)\s+({NUMBER_PATTERN})\s*$")[1]
    # the peak of the header relies on another estimate of the offset
    text.check_peak(samples, 0.01 * float(peak[1]), tolerance=0.02)
    dt = text.check_step(1.0 / frequency, rate_line)
    # kiK-net numbers its components: 1 to 3 in the borehole, 4 to 6 at the surface
    name = "U-D" if direction in ("3", "6") else direction
    start = text.find_start(r"^\s*Record Time\s")
    return [Channel.from_direction(samples, dt, name, start)]


def read_peer(text: RecordText) -> list[Channel]:
    """Read the single component of a file of PEER or PEER NGA (`.AT2`), in g."""
    # Count and step follow their names (`NPTS= 5437, DT= .0050 SEC`), in either order, on one line
    # or two. Or both precede or follow the names (`4096 0.0100 NPTS, DT`). The rest of the header
    # is free: a unit of acceleration identifies one, unless a velocity or displacement is named.
    count, dt, line = _find_count_and_step(text)
    header = " ; ".join(text.lines[:line])
    other = re.search(r"\b(?:VELOC|DISPL)", header, re.IGNORECASE)
    if other and not re.search(r"\bACC", header, re.IGNORECASE):
        raise text.error("the header does not state an acceleration, but another quantity")
    unit = text.find_unit(header, "the header does not state one unit, such as UNITS OF G")
    samples = text.read_last_block(line + 1, count) * unit
    direction = _find_peer_direction(text, line)
    return [Channel.from_direction(samples, text.check_step(dt, line), direction)]


def _find_count_and_step(text: RecordText, max_lines: int = 12) -> tuple[int, float, int]:
    """Return NPTS, DT [s] and the index of the last header line."""
    # files in the wild begin with blank lines or lack one of the four lines of the header
    pair = rf"({COUNT_PATTERN})[\s,]+({NUMBER_PATTERN})"
    unit = rf"[\s(]*({TIME_UNIT_PATTERN})?"
    values_before_names = rf"^\s*{pair}[\s,]+NPTS[\s,]*DT\b{unit}"
    values_after_names = rf"\bNPTS[\s,]+DT\s*[=:]?\s*{pair}{unit}"
    together = text.search(values_before_names, stop=max_lines)
    together = together or text.search(values_after_names, stop=max_lines)
    if together:
        line, values = together
        return int(values[1]), float(values[2]) * parse_time_unit(values[3]), line
    count_pattern = rf"\bNPTS\s*[=:]?\s*({COUNT_PATTERN})\b(?!\.)"
    count_line, count = text.find(count_pattern, stop=max_lines)
    step_line, step = text.find(rf"\bDT\s*[=:]?\s*({NUMBER_PATTERN}){unit}", stop=max_lines)
    dt = float(step[1]) * parse_time_unit(step[2])
    return int(count[1]), dt, max(count_line, step_line)


def _find_peer_direction(text: RecordText, line: int) -> str:
    """Return the component: the text after the last comma of the line with the station."""
    title = next((content for content in text.lines[1:line] if content.count(",") >= 2), "")
    direction = re.sub(r"\([^()]*\)?", "", title).rpartition(",")[2].strip()
    return direction if len(direction) <= 12 else ""
