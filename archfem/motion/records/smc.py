"""USGS SMC files: eleven lines of text, integer and real headers, comments, samples in cm/s²."""

import re
from enum import IntEnum

from archfem.motion.records.record_file import Channel, RecordText


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


def recognises(text: RecordText) -> bool:
    """Return whether the file starts with a type number and name, and has a line with a star."""
    first = re.match(r"\s*\d\s+[A-Z ]+$", text.lines[0].rstrip())
    starred = any(line.strip() == "*" for line in text.lines[1 : _Line.INTEGERS])
    return bool(first) and starred


def read(text: RecordText) -> list[Channel]:
    """Read the single component of the file."""
    unknown_value = 1.0e38
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
    numbers = text.read_last_block(start, int(integers[_Integer.SAMPLE_COUNT]))
    peaks = [
        abs(reals[at]) for at in (_Real.MAXIMUM, _Real.MINIMUM) if abs(reals[at]) < unknown_value
    ]
    if peaks:
        text.check_peak(numbers, max(peaks))
    if not 0.0 < reals[_Real.RATE] < unknown_value:
        raise text.error("the real header does not state the sampling rate", _Line.REALS)
    written = re.search(r"component\s*=\s*(\S+)", " ".join(text.lines[: _Line.INTEGERS]))
    direction = vertical_codes.get(int(integers[_Integer.TILT]), written[1] if written else "")
    return [
        Channel.from_direction(
            0.01 * numbers, text.check_step(1.0 / reals[_Real.RATE], _Line.REALS), direction
        )
    ]
