"""CSMIP/CDMG volume 2 files: channels of corrected acceleration, velocity and displacement."""

from archfem.motion.records.channel import Channel
from archfem.motion.records.text import COUNT, NUMBER, RecordText, stated_width
from archfem.motion.records.units import units_written

_BLOCK = rf"^\s*({COUNT})\s+POINTS OF ACCEL DATA EQUALLY SPACED AT\s+({NUMBER})\s*SEC(.*)$"
_CHANNEL = r"\bCHAN\s+\d+:\s*(\S+(?: DEG)?)"
_PEAK = rf"PEAK ACCELERATION\s*=\s*({NUMBER})"
_END = r"END OF DATA FOR CHAN"


def recognises(text: RecordText) -> bool:
    """Return whether a line announces equally spaced points of accelerations.

    Args:
        text: the file.
    """
    return text.holds(r"POINTS OF ACCEL DATA EQUALLY SPACED", 120)


def read(text: RecordText) -> list[Channel]:
    """Return the acceleration of every channel.

    Args:
        text: the file.

    Raises:
        InvalidInput: a channel is incomplete or contradicts its header.
    """
    channels = []
    start = 0
    while any(line.strip() for line in text.lines[start:]):
        # A channel without its end mark is refused: the file is cut short.
        end = text.find(_END, start)[0]
        channels.append(_channel(text, start, end))
        start = end + 1
    return channels


def _channel(text: RecordText, start: int, end: int) -> Channel:
    """Return the channel that stands between two lines."""
    line, block = text.find(_BLOCK, start, end)
    if text.holds(_BLOCK, end, line + 1):
        raise text.error("a second channel begins before the end of the first", line)
    units = units_written(block[3])
    if len(units) != 1:
        raise text.error("no single unit of acceleration such as CM/SEC/SEC", line)
    numbers, after = text.block(line + 1, int(block[1]), stated_width(block[3]))
    if after < end and text.is_numeric(after):
        raise text.error(f"more numbers follow after the {block[1]} samples stated", after)
    if text.holds(_PEAK, line, start):
        text.check_peak(numbers, float(text.find(_PEAK, start, line)[1][1]))
    direction = text.find(_CHANNEL, start, line)[1][1]
    return Channel.directed(numbers * units.pop(), text.step(float(block[2]), line), direction)
