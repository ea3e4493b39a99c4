"""AFAD (Turkish national network) text files: three components in three columns, in gal."""

import re
from functools import partial

import numpy as np

from archfem.motion.records.record_file import COUNT_PATTERN, NUMBER_PATTERN, Channel, RecordText

_HEADER_LINES = 40  # lines, at most


def recognises(text: RecordText) -> bool:
    """Return whether the header has the keys of AFAD for count and step."""
    return text.contains(r"^\s*NUMBER OF DATA\s*:", _HEADER_LINES) and text.contains(
        r"SAMPLING INTERVAL", _HEADER_LINES
    )


def read(text: RecordText) -> list[Channel]:
    """Read the three components."""
    direction_pattern = r"[NSEWUD]-[NSEWUD]"
    find = partial(text.find, stop=_HEADER_LINES)
    count_line, count = find(rf"^\s*NUMBER OF DATA\s*:\s*({COUNT_PATTERN})\s*$")
    step_line, step = find(rf"SAMPLING INTERVAL\s*\(sec\)\s*:\s*({NUMBER_PATTERN})\s*$")
    peak_line, peaks = find(r"^\s*(?:RAW )?PGA VALUES\s*(\(.*?\))\s*:(.*)$")
    names_line, names = find(
        rf"^\s*({direction_pattern})\s+({direction_pattern})\s+({direction_pattern})\s*$",
        start=max(count_line, step_line, peak_line),
    )
    unit = text.find_unit(peaks[1], "the header does not state the unit of the peaks", peak_line)
    numbers = text.read_last_block(names_line + 1, 3 * int(count[1]))
    if len(text.parse_row(names_line + 1)) != 3:
        raise text.error("expected one sample of each of three components", names_line + 1)
    samples = np.reshape(numbers, (-1, 3)) * unit
    stated = [float(peak) * unit for peak in re.findall(rf"\)\s*({NUMBER_PATTERN})", peaks[2])]
    for column, peak in zip(samples.T, stated, strict=False):
        # the header has the peaks before the correction of the offset
        text.check_peak(column, peak, tolerance=0.5)
    dt = text.check_step(float(step[1]), step_line)
    return [
        Channel.from_direction(column, dt, name)
        for column, name in zip(samples.T, names.groups(), strict=True)
    ]
