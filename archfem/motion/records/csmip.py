"""CSMIP/CDMG volume 2 files: channels of corrected acceleration, velocity and displacement."""

from archfem.motion.records.record_file import (
    COUNT_PATTERN,
    NUMBER_PATTERN,
    Channel,
    RecordText,
    find_column_width,
)


def recognises(text: RecordText) -> bool:
    """Return whether a line announces equally spaced points of accelerations."""
    return text.contains(r"POINTS OF ACCEL DATA EQUALLY SPACED", 120)


def read(text: RecordText) -> list[Channel]:
    """Read the acceleration of every channel."""
    channels = []
    start = 0
    while any(line.strip() for line in text.lines[start:]):
        # a channel without its end mark is refused, since the file is truncated
        end = text.find(r"END OF DATA FOR CHAN", start)[0]
        channels.append(_read_channel(text, start, end))
        start = end + 1
    return channels


def _read_channel(text: RecordText, start: int, end: int) -> Channel:
    """Read the channel between two lines."""
    block_pattern = (
        rf"^\s*({COUNT_PATTERN})\s+POINTS OF ACCEL DATA EQUALLY SPACED AT\s+"
        rf"({NUMBER_PATTERN})\s*SEC(.*)$"
    )
    channel_pattern = r"\bCHAN\s+\d+:\s*(\S+(?: DEG)?)"
    peak_pattern = rf"PEAK ACCELERATION\s*=\s*({NUMBER_PATTERN})"
    line, block = text.find(block_pattern, start, end)
    if text.contains(block_pattern, end, line + 1):
        raise text.error("a second channel begins before the end of the first", line)
    unit = text.find_unit(block[3], "no single unit of acceleration such as CM/SEC/SEC", line)
    numbers, after = text.read_block(line + 1, int(block[1]), find_column_width(block[3]))
    if after < end and text.is_numeric(after):
        raise text.error(f"more numbers follow after the {block[1]} samples stated", after)
    if text.contains(peak_pattern, line, start):
        text.check_peak(numbers, float(text.find(peak_pattern, start, line)[1][1]))
    direction = text.find(channel_pattern, start, line)[1][1]
    dt = text.check_step(float(block[2]), line)
    return Channel.from_direction(numbers * unit, dt, direction)
