"""COSMOS volume 1 and 2 files: channels with integer and real headers, comments and samples."""

import re
from enum import IntEnum

from archfem.motion.records.record_file import (
    COUNT_PATTERN,
    Channel,
    RecordFormat,
    RecordText,
    find_column_width,
)

_HEADER_PATTERN = rf"^\s*({COUNT_PATTERN})\s+%s-header values follow"


class _Position(IntEnum):
    """Positions in the headers, counted from 0."""

    AZIMUTH = 53
    STEP = 61
    PEAK = 63


def _read(text: RecordText) -> list[Channel]:
    """Read the acceleration of every channel."""
    channels: list[Channel] = []
    start = 0
    while not channels or text.contains(_HEADER_PATTERN % "Integer", len(text.lines), start):
        channel, start = _read_channel(text, start)
        channels.append(channel)
    return channels


def _read_channel(text: RecordText, start: int) -> tuple[Channel, int]:
    """Read the next channel after a line; return it and the line after its samples."""
    block_pattern = rf"^\s*({COUNT_PATTERN})\s+acceleration\s+pts\b(.*)$"
    end_pattern = r"End[- ]of[- ]data for\s+Chan(?:nel)?\s*(\S*)(?:\s+acceleration|\s+-)"
    counts_pattern = rf"^\s*{COUNT_PATTERN}\s+raw accel\.?\s+pts\b.*counts"
    # codes of the direction of a vertical sensor
    vertical_codes = {400: "Up", 401: "Down", 402: "Vertical"}
    unknown_value = -999.0
    codes, line = _read_header(text, "Integer", start)
    values, line = _read_header(text, "Real", line)
    if text.contains(counts_pattern, len(text.lines), line):
        counts_line, _ = text.find(counts_pattern, line)
        raise text.error("counts of an instrument (volume 0): use volume 1 or 2", counts_line)
    line, block = text.find(block_pattern, line)
    count, rest = int(block[1]), block[2]
    unit = text.find_unit(
        rest, "no single unit of acceleration such as cm/sec2: not volume 2", line
    )
    dt = text.check_step(1e-3 * values[_Position.STEP], line)
    length = re.search(r"approx\s+(\d+)\s+secs", rest)
    if length and abs(count * dt - float(length[1])) > 1.0 + dt:
        raise text.error(f"{count} samples at {dt:g} s do not last {length[1]} s", line)
    numbers, after = text.read_block(line + 1, count, find_column_width(rest))
    if values[_Position.PEAK] != unknown_value:
        text.check_peak(numbers, values[_Position.PEAK])
    end, code = text.find(end_pattern, after)
    if any(content.strip() for content in text.lines[after:end]):
        raise text.error(f"more follows after the {count} samples stated", after)
    direction = vertical_codes.get(int(codes[_Position.AZIMUTH]), code[1])
    return Channel.from_direction(numbers * unit, dt, direction), end + 1


def _read_header(text: RecordText, kind: str, start: int) -> tuple[list[float], int]:
    """Read the numbers of a header; return them and the line after it."""
    line, stated = text.find(_HEADER_PATTERN % kind, start)
    numbers, after = text.read_block(line + 1, int(stated[1]))
    if len(numbers) <= max(_Position):
        raise text.error(f"{len(numbers)} values in a header of 100", line)
    return numbers.tolist(), after


COSMOS = RecordFormat(
    "COSMOS", ((r"\(Format v\d|^\s*\d+\s+Integer-header values follow", 40),), _read
)
