"""AFAD (Turkish national network) text files: three components in three columns, in gal."""

import re

import numpy as np

from archfem.motion.records.channel import Channel
from archfem.motion.records.text import COUNT, NUMBER, RecordText
from archfem.motion.records.units import units_written

_HEADER = 40  # lines, at most
_DIRECTION = r"[NSEWUD]-[NSEWUD]"
_RAW_PEAK = 0.5  # the header's peaks are those before AFAD took the offset out


def recognises(text: RecordText) -> bool:
    """Return whether the header counts data the way AFAD does.

    Args:
        text: the file.
    """
    return text.holds(r"^\s*NUMBER OF DATA\s*:", _HEADER) and text.holds(
        r"SAMPLING INTERVAL", _HEADER
    )


def read(text: RecordText) -> list[Channel]:
    """Return the three components.

    Args:
        text: the file.

    Raises:
        InvalidInput: count, step, unit or directions are missing, or the samples contradict them.
    """
    count_line, count = text.find(rf"^\s*NUMBER OF DATA\s*:\s*({COUNT})\s*$", stop=_HEADER)
    step_line, step = text.find(rf"SAMPLING INTERVAL\s*\(sec\)\s*:\s*({NUMBER})\s*$", stop=_HEADER)
    peak_line, peaks = text.find(r"^\s*(?:RAW )?PGA VALUES\s*(\(.*?\))\s*:(.*)$", stop=_HEADER)
    names_line, names = text.find(
        rf"^\s*({_DIRECTION})\s+({_DIRECTION})\s+({_DIRECTION})\s*$",
        start=max(count_line, step_line, peak_line),
        stop=_HEADER,
    )
    units = units_written(peaks[1])
    if len(units) != 1:
        raise text.error("the header does not tell the unit of the peaks", peak_line)
    unit = units.pop()
    numbers = text.last_block(names_line + 1, 3 * int(count[1]))
    if len(text.row(names_line + 1)) != 3:
        raise text.error("expected one sample of each of three components", names_line + 1)
    samples = np.reshape(numbers, (-1, 3)) * unit
    stated = [float(peak) * unit for peak in re.findall(rf"\)\s*({NUMBER})", peaks[2])]
    for column, peak in zip(samples.T, stated, strict=False):
        text.check_peak(column, peak, tolerance=_RAW_PEAK)
    dt = text.step(float(step[1]), step_line)
    return [
        Channel.directed(column, dt, name)
        for column, name in zip(samples.T, names.groups(), strict=True)
    ]
