"""COSMOS and USGS SMC files: integers and reals at fixed positions of headers, then samples."""

import re
from enum import IntEnum

from archfem._typing import Array
from archfem.motion.records.record_file import (
    COUNT_PATTERN,
    Channel,
    RecordFormat,
    RecordText,
    find_column_width,
    space_evenly,
)

_HEADER_PATTERN = rf"^\s*({COUNT_PATTERN})\s+%s-header values follow"


class _Position(IntEnum):
    """Positions in the headers of COSMOS, counted from 0."""

    AZIMUTH = 53
    STEP = 61
    PEAK = 63


def _read_cosmos(text: RecordText) -> list[Channel]:
    """Read the acceleration of every channel of a COSMOS file."""
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
    "COSMOS", ((r"\(Format v\d|^\s*\d+\s+Integer-header values follow", 40),), _read_cosmos
)


_SMC_UNKNOWN = 1.0e38  # and above


class _Line(IntEnum):
    """First lines of the headers and of the comments of SMC, counted from 0."""

    INTEGERS = 11
    REALS = 17
    COMMENTS = 27


class _Integer(IntEnum):
    """Positions in the integer header of SMC, counted from 0."""

    TILT = 12
    COMMENT_COUNT = 15
    SAMPLE_COUNT = 16


class _Real(IntEnum):
    """Positions in the real header of SMC, counted from 0."""

    RATE = 1
    MAXIMUM = 29
    MINIMUM = 31


def _read_smc(text: RecordText) -> list[Channel]:
    """Read the single component of an SMC file, with samples in cm/s²."""
    vertical_codes = {0: "UP", 180: "DOWN"}  # degrees from the upward vertical
    if "ACCELEROGRAM" not in text.lines[0]:
        raise text.error(f"{text.lines[0].strip()!r} is not an accelerogram", 0)
    integers, line = text.read_block(_Line.INTEGERS, 48)
    reals, end = text.read_block(_Line.REALS, 50)
    if (line, end) != (_Line.REALS, _Line.COMMENTS):
        raise text.error("the headers do not take 6 and 10 lines: the file is damaged", line - 1)
    start = _Line.COMMENTS + int(integers[_Integer.COMMENT_COUNT])
    comments = text.lines[_Line.COMMENTS : start]
    if start < _Line.COMMENTS or not all(comment.lstrip().startswith("|") for comment in comments):
        raise text.error(f"{len(comments)} comment lines expected", _Line.COMMENTS)
    samples, dt = _read_samples(
        text, start, int(integers[_Integer.SAMPLE_COUNT]), reals[_Real.RATE]
    )
    peaks = [
        abs(reals[at]) for at in (_Real.MAXIMUM, _Real.MINIMUM) if abs(reals[at]) < _SMC_UNKNOWN
    ]
    if peaks:
        text.check_peak(samples, max(peaks))
    written = re.search(r"component\s*=\s*(\S+)", " ".join(text.lines[: _Line.INTEGERS]))
    direction = vertical_codes.get(int(integers[_Integer.TILT]), written[1] if written else "")
    return [Channel.from_direction(0.01 * samples, dt, direction)]


def _read_samples(text: RecordText, start: int, count: int, rate: float) -> tuple[Array, float]:
    """Return the samples [cm/s²] and their step [s]."""
    if 0.0 < rate < _SMC_UNKNOWN:
        return text.read_last_block(start, count), text.check_step(1.0 / rate, _Line.REALS)
    if "UNCORRECTED" not in text.lines[0]:
        raise text.error("the real header does not state the sampling rate", _Line.REALS)
    # a digitised film has pairs of a time and a sample, of which the count is that of numbers
    numbers, after = text.read_block(start, count + count % 2)
    if sum(bool(line.strip()) for line in text.lines[after:]) > 1:
        # one line may be left over in the last block of a tape
        raise text.error(f"more follows after the {count} numbers of the header", after)
    return space_evenly(text, numbers, start)


SMC = RecordFormat("SMC", ((r"^\s*\d\s+[A-Z ]+$", 1), (r"^\s*\*\s*$", _Line.INTEGERS)), _read_smc)
