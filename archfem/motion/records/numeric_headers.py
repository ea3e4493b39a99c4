"""COSMOS and USGS SMC files: integers and reals at fixed positions of headers, then samples."""

import re

import numpy as np

from archfem._typing import Array
from archfem.motion.records.record_file import COUNT_PATTERN, Channel, RecordText

COSMOS_PATTERN = r"\(Format v\d|^\s*\d+\s+Integer-header values follow"
_HEADER_PATTERN = rf"^\s*({COUNT_PATTERN})\s+%s-header values follow"


def read_cosmos(text: RecordText) -> list[Channel]:
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
    codes, line = _read_header(text, "Integer", start)
    values, line = _read_header(text, "Real", line)
    # positions in the headers, counted from 0
    azimuth, step, peak = int(codes[53]), values[61], values[63]
    if found := text.search(counts_pattern, line):
        raise text.error("counts of an instrument (volume 0): use volume 1 or 2", found[0])
    line, block = text.find(block_pattern, line)
    count, rest = int(block[1]), block[2]
    problem = "no single unit of acceleration such as cm/sec2: not volume 2"
    unit = text.find_unit(rest, problem, line)
    dt = text.check_step(1e-3 * step, line)
    length = re.search(r"approx\s+(\d+)\s+secs", rest)
    if length and abs(count * dt - float(length[1])) > 1.0 + dt:
        raise text.error(f"{count} samples at {dt:g} s do not last {length[1]} s", line)
    numbers, after = text.read_block(line + 1, count, text.find_column_width(rest))
    if peak != -999.0:  # unknown
        text.check_peak(numbers, peak)
    end, code = text.find(end_pattern, after)
    if any(content.strip() for content in text.lines[after:end]):
        raise text.error(f"more follows after the {count} samples stated", after)
    # codes of the azimuth of a vertical sensor
    direction = {400: "Up", 401: "Down", 402: "Vertical"}.get(azimuth, code[1])
    start_time = text.find_start(r"\bRcrd start time", start, line)
    return Channel.from_direction(numbers * unit, dt, direction, start_time), end + 1


def _read_header(text: RecordText, kind: str, start: int) -> tuple[list[float], int]:
    """Read the numbers of a header; return them and the line after it."""
    line, stated = text.find(_HEADER_PATTERN % kind, start)
    numbers, after = text.read_block(line + 1, int(stated[1]))
    if len(numbers) <= 63:  # the last position that is read
        raise text.error(f"{len(numbers)} values in a header of 100", line)
    return numbers.tolist(), after


def read_smc(text: RecordText) -> list[Channel]:
    """Read the single component of an SMC file, with samples in cm/s²."""
    # first lines of the headers and of the comments, counted from 0
    integer_line, real_line, comment_line = 11, 17, 27
    if "ACCELEROGRAM" not in text.lines[0]:
        raise text.error(f"{text.lines[0].strip()!r} is not an accelerogram", 0)
    integers, line = text.read_block(integer_line, 48)
    reals, end = text.read_block(real_line, 50)
    if (line, end) != (real_line, comment_line):
        raise text.error("the headers do not take 6 and 10 lines: the file is damaged", line - 1)
    # positions in the headers, counted from 0
    tilt, comment_count, sample_count = (int(integers[at]) for at in (12, 15, 16))
    rate, maximum, minimum = np.where(np.abs(reals) < 1e38, reals, np.nan)[[1, 29, 31]]
    start = comment_line + comment_count
    comments = text.lines[comment_line:start]
    if comment_count < 0 or not all(comment.lstrip().startswith("|") for comment in comments):
        raise text.error(f"{len(comments)} comment lines expected", comment_line)
    samples, dt, begin = _read_samples(text, start, sample_count, rate, real_line)
    if not np.isnan([maximum, minimum]).all():
        text.check_peak(samples, np.nanmax(np.abs([maximum, minimum])))
    written = re.search(r"component\s*=\s*(\S+)", " ".join(text.lines[:integer_line]))
    # degrees from the upward vertical
    direction = {0: "UP", 180: "DOWN"}.get(tilt, written[1] if written else "")
    return [Channel.from_direction(0.01 * samples, dt, direction, begin)]


def _read_samples(
    text: RecordText, start: int, count: int, rate: float, line: int
) -> tuple[Array, float, float | None]:
    """Return samples [cm/s²], step and start [s], of which rate (NaN) and start may be unknown."""
    if rate > 0.0:
        return text.read_last_block(start, count), text.check_step(1.0 / rate, line), None
    if "UNCORRECTED" not in text.lines[0]:
        raise text.error("the real header does not state the sampling rate", line)
    # a digitised film has pairs of a time and a sample, of which the count is that of numbers
    numbers, after = text.read_block(start, count + count % 2)
    if sum(bool(line.strip()) for line in text.lines[after:]) > 1:
        # one line may be left over in the last block of a tape
        raise text.error(f"more follows after the {count} numbers of the header", after)
    return text.space_evenly(numbers, start)
