"""USGS SMC files: eleven lines of text, integer and real headers, comments, samples in cm/s²."""

import re

from archfem.motion.records.channel import Channel
from archfem.motion.records.text import RecordText

# Lines and positions, counted from 0.
_INTEGERS, _REALS, _COMMENTS = 11, 17, 27
_TILT, _COMMENT_COUNT, _COUNT = 12, 15, 16
_RATE, _MAXIMUM, _MINIMUM = 1, 29, 31
_UNKNOWN = 1.0e38
_UPRIGHT = {0: "UP", 180: "DOWN"}  # degrees from the upward vertical


def recognises(text: RecordText) -> bool:
    """Return whether the file begins with a type number and name, and a starred line after.

    Args:
        text: the file.
    """
    first = re.match(r"\s*\d\s+[A-Z ]+$", text.lines[0].rstrip())
    starred = any(line.strip() == "*" for line in text.lines[1:_INTEGERS])
    return bool(first) and starred


def read(text: RecordText) -> list[Channel]:
    """Return the one component of the file.

    Args:
        text: the file.

    Raises:
        InvalidInput: the file holds no acceleration or contradicts its header.
    """
    if "ACCELEROGRAM" not in text.lines[0]:
        raise text.error(f"{text.lines[0].strip()!r} is not an accelerogram", 0)
    integers, line = text.block(_INTEGERS, 48)
    reals, end = text.block(_REALS, 50)
    if (line, end) != (_REALS, _COMMENTS):
        raise text.error("the headers do not take 6 and 10 lines: the file is damaged", line - 1)
    start = _COMMENTS + int(integers[_COMMENT_COUNT])
    comments = text.lines[_COMMENTS:start]
    if start < _COMMENTS or not all(comment.lstrip().startswith("|") for comment in comments):
        raise text.error(f"{len(comments)} comment lines expected", _COMMENTS)
    numbers = text.last_block(start, int(integers[_COUNT]))
    peaks = [abs(reals[at]) for at in (_MAXIMUM, _MINIMUM) if abs(reals[at]) < _UNKNOWN]
    if peaks:
        text.check_peak(numbers, max(peaks))
    if not 0.0 < reals[_RATE] < _UNKNOWN:
        raise text.error("the real header does not tell the sampling rate", _REALS)
    written = re.search(r"component\s*=\s*(\S+)", " ".join(text.lines[:_INTEGERS]))
    direction = _UPRIGHT.get(int(integers[_TILT]), written[1] if written else "")
    return [Channel.directed(0.01 * numbers, text.step(1.0 / reals[_RATE], _REALS), direction)]
