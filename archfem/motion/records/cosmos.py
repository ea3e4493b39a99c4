"""COSMOS volume 2 files: channels with integer and real headers, comments and samples."""

import re

from archfem.motion.records.channel import Channel
from archfem.motion.records.text import COUNT, RecordText, stated_width
from archfem.motion.records.units import units_written

_BLOCK = rf"^\s*({COUNT})\s+acceleration\s+pts\b(.*)$"
_HEADER = rf"^\s*({COUNT})\s+%s-header values follow"
_END = r"^\s*End-of-data for\s+Chan\s*(\S*)\s+acceleration"

# Positions in the headers, counted from 0, and the codes of the sensor's direction.
_AZIMUTH, _STEP, _PEAK = 53, 61, 63
_UPRIGHT = {400: "Up", 401: "Down", 402: "Vertical"}
_UNKNOWN = -999.0


def recognises(text: RecordText) -> bool:
    """Return whether the file states a COSMOS format, or has one of its headers.

    Args:
        text: the file.
    """
    return text.holds(r"\(Format v\d", 3) or text.holds(r"Integer-header values follow", 40)


def read(text: RecordText) -> list[Channel]:
    """Return the acceleration of every channel.

    Args:
        text: the file.

    Raises:
        InvalidInput: a channel is incomplete, holds no acceleration, or contradicts its header.
    """
    channels: list[Channel] = []
    start = 0
    while not channels or text.holds(_HEADER % "Integer", len(text.lines), start):
        channel, start = _channel(text, start)
        channels.append(channel)
    return channels


def _channel(text: RecordText, start: int) -> tuple[Channel, int]:
    """Return the first channel that begins after a line, and the line after its samples."""
    codes, line = _header(text, "Integer", start)
    values, line = _header(text, "Real", line)
    line, block = text.find(_BLOCK, line)
    count, rest = int(block[1]), block[2]
    units = units_written(rest)
    if len(units) != 1:
        raise text.error("no single unit of acceleration such as cm/sec2: not volume 2", line)
    dt = text.step(1e-3 * values[_STEP], line)
    length = re.search(r"approx\s+(\d+)\s+secs", rest)
    if length and abs(count * dt - float(length[1])) > 1.0 + dt:
        raise text.error(f"{count} samples at {dt:g} s do not last {length[1]} s", line)
    numbers, after = text.block(line + 1, count, stated_width(rest))
    if values[_PEAK] != _UNKNOWN:
        text.check_peak(numbers, values[_PEAK])
    end, code = text.find(_END, after)
    if any(content.strip() for content in text.lines[after:end]):
        raise text.error(f"more follows after the {count} samples stated", after)
    direction = _UPRIGHT.get(int(codes[_AZIMUTH]), code[1])
    return Channel.directed(numbers * units.pop(), dt, direction), end + 1


def _header(text: RecordText, kind: str, start: int) -> tuple[list[float], int]:
    """Return the numbers of a header and the line after it."""
    line, stated = text.find(_HEADER % kind, start)
    numbers, after = text.block(line + 1, int(stated[1]))
    if len(numbers) <= max(_AZIMUTH, _PEAK):
        raise text.error(f"{len(numbers)} values in a header of 100", line)
    return numbers.tolist(), after
