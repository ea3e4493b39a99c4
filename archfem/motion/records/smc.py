"""USGS SMC files: eleven lines of text, integer and real headers, comments, samples in cm/s²."""

import re
from enum import IntEnum

from archfem._typing import Array
from archfem.motion.records.record_file import Channel, RecordFormat, RecordText, space_evenly

_UNKNOWN_VALUE = 1.0e38  # and above


class _Line(IntEnum):
    """First lines of the headers and of the comments, counted from 0."""

    INTEGERS = 11
    REALS = 17
    COMMENTS = 27


class _Integer(IntEnum):
    """Positions in the integer header, counted from 0."""

    TILT = 12
    COMMENT_COUNT = 15
    SAMPLE_COUNT = 16


class _Real(IntEnum):
    """Positions in the real header, counted from 0."""

    RATE = 1
    MAXIMUM = 29
    MINIMUM = 31


def _read(text: RecordText) -> list[Channel]:
    """Read the single component of the file."""
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
        abs(reals[at]) for at in (_Real.MAXIMUM, _Real.MINIMUM) if abs(reals[at]) < _UNKNOWN_VALUE
    ]
    if peaks:
        text.check_peak(samples, max(peaks))
    written = re.search(r"component\s*=\s*(\S+)", " ".join(text.lines[: _Line.INTEGERS]))
    direction = vertical_codes.get(int(integers[_Integer.TILT]), written[1] if written else "")
    return [Channel.from_direction(0.01 * samples, dt, direction)]


def _read_samples(text: RecordText, start: int, count: int, rate: float) -> tuple[Array, float]:
    """Return the samples [cm/s²] and their step [s]."""
    if 0.0 < rate < _UNKNOWN_VALUE:
        return text.read_last_block(start, count), text.check_step(1.0 / rate, _Line.REALS)
    if "UNCORRECTED" not in text.lines[0]:
        raise text.error("the real header does not state the sampling rate", _Line.REALS)
    # a digitised film has pairs of a time and a sample, of which the count is that of numbers
    numbers, after = text.read_block(start, count + count % 2)
    if sum(bool(line.strip()) for line in text.lines[after:]) > 1:
        # one line may be left over in the last block of a tape
        raise text.error(f"more follows after the {count} numbers of the header", after)
    return space_evenly(text, numbers, start)


SMC = RecordFormat("SMC", ((r"^\s*\d\s+[A-Z ]+$", 1), (r"^\s*\*\s*$", _Line.INTEGERS)), _read)
