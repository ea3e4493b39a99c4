"""Volumes 1 and 2 of accelerograms after Caltech: CSMIP/CDMG, USC, RENADIC, BHRC and GeoNet."""

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from archfem._typing import Array
from archfem.motion.records.record_file import COUNT_PATTERN, NUMBER_PATTERN, Channel, RecordText
from archfem.units import STANDARD_GRAVITY

# Volume 2, and volume 1 of digital instruments: a line announces equally spaced samples.
SPACED_PATTERN = (
    rf"^\s*({COUNT_PATTERN})\s+(?:POINTS OF ACC\w* DATA EQUALLY SPACED AT|ACCELEROGRAM POINTS AT)"
    rf"\s+({NUMBER_PATTERN})\s*(SEC|PTS/SEC)(.*)$"
)
VOLUME_1_PATTERN = (
    rf"^\s*NO\. OF POINTS\s*=\s*({COUNT_PATTERN})\s+(?:RECORD LENGTH|DURATION)\s*="
    rf"\s*({NUMBER_PATTERN})"
)
SPECTRA_PATTERN = r"^\s*RESPONSE AND FOURIER AMPLITUDE SPECTRA"
CSMIP_PATTERN = f"{SPACED_PATTERN}|{SPECTRA_PATTERN}"
_PEAK_PATTERN = (
    rf"(?:PEAK ACCELERATION\s*=|(?<!UNCOR )MAX\s*=|^ACCELERATION:\s+PEAK)\s*({NUMBER_PATTERN})"
    r"\s*(G|MM/S/S|CMS?/SEC/SEC)\b"
)


def read_spaced(text: RecordText) -> list[Channel]:
    """Read the acceleration of every channel that a line announces."""
    if text.search(SPECTRA_PATTERN, stop=1):
        raise text.error("response spectra (volume 3), no accelerogram: use volume 2", 0)
    return [_read_spaced_channel(text, *bounds) for bounds in _find_bounds(text)]


def _find_bounds(
    text: RecordText, first: str = r"\s*(UN)?CORRECTED ACCELEROGRAM|FILE\s+\d+ OF UNCORRECTED"
) -> Iterator[tuple[int, int]]:
    """Yield the first line of each channel and the line after its last, by end marks if any."""
    end_pattern, start, last = r"END OF DATA FOR CHAN", 0, len(text.lines)
    if text.search(end_pattern):
        # a channel without its end mark is refused, since the file is truncated
        while text.search(r"\S", start):
            end = text.find(end_pattern, start)[0]
            yield start, end
            start = end + 1
        return
    matches = [bool(re.match(first, line, re.IGNORECASE)) for line in text.lines]
    # volume 2 begins with two such lines: its own and that of volume 1
    starts = [line for line in range(last) if matches[line] and not (line and matches[line - 1])]
    yield from zip(starts or [0], [*starts[1:], last], strict=False)


def _read_spaced_channel(text: RecordText, start: int, end: int) -> Channel:
    """Read the equally spaced channel between two lines."""
    line, block = _find_once(text, SPACED_PATTERN, start, end)
    spacing = float(block[2])
    by_rate = block[3].upper().startswith("PTS")
    dt = text.check_step(1.0 / max(spacing, 1e-9) if by_rate else spacing, line)
    # USC states the unit at the peak only
    words = block[4]
    if not text.find_units(words) and (peak := text.search(_PEAK_PATTERN, start, line)):
        words = f"in {peak[1][2]}"
    unit = text.find_unit(words, "no single unit of acceleration such as CM/SEC/SEC", line)
    numbers, after = text.read_block(line + 1, int(block[1]), text.find_column_width(block[4]))
    _check_end(text, after, end, int(block[1]))
    return _create_channel(text, numbers * unit, dt, (start, line))


def _find_once(text: RecordText, pattern: str, start: int, end: int) -> tuple[int, re.Match[str]]:
    """Return the only line of a channel with a pattern, and the match."""
    line, found = text.find(pattern, start, end)
    if text.search(pattern, line + 1, end):
        raise text.error("a second channel begins before the end of the first", line)
    return line, found


def _check_end(text: RecordText, after: int, end: int, count: int) -> None:
    """Refuse numbers after the samples of a channel."""
    if after < end and text.is_numeric(after):
        raise text.error(f"more numbers follow after the {count} samples stated", after)


def read_volume_1(text: RecordText) -> list[Channel]:
    """Read every channel of an uncorrected file of pairs of a time and a sample."""
    return [_read_pairs(text, *bounds) for bounds in _find_bounds(text)]


def _read_pairs(text: RecordText, start: int, end: int) -> Channel:
    """Read the channel of pairs between two lines."""
    line, count, duration, unit = _find_volume_1_header(text, start, end)
    # 100 integers in lines of 16 and 50 reals in lines of 8 precede the samples
    first = text.header_length(line) + 14
    numbers, after = text.read_block(first, 2 * count, 7)
    _check_end(text, after, end, count)
    if abs(numbers[-2] - numbers[0] - duration) > 0.02 * duration:
        raise text.error(f"the points do not last {duration:g} s, as the header states", line)
    samples, dt, begin = text.space_evenly(numbers, first)
    rms_pattern = rf"^\s*RMS ACC\w*\.? OF COMPLETE RECORD\s*=\s*({NUMBER_PATTERN})\s*G/10"
    if stated := text.search(rms_pattern, line, first):
        rms = float(np.sqrt(np.mean(numbers[1::2] ** 2)))
        # USC states no peak but the rms, of later files to 1 %, of earlier ones up to 1.9 times
        if not 0.4 * rms < float(stated[1][1]) + 0.001 < 2.5 * rms + 0.002:
            raise text.error(f"the rms of the points is {rms:.3f} G/10: damaged", stated[0])
    return replace(_create_channel(text, samples * unit, dt, (start, first)), start_time=begin)


def _find_volume_1_header(text: RecordText, start: int, end: int) -> tuple[int, int, float, float]:
    """Return the line of the unit, the number of points, the duration [s] and the unit [m/s²]."""
    line, found = _find_once(text, VOLUME_1_PATTERN, start, end)
    unit_line, unit = text.find(r"^\s*UNITS\b.* ARE SEC\w* AND G\s*(/10)?", line, end)
    return unit_line, int(found[1]), float(found[2]), STANDARD_GRAVITY / (10.0 if unit[1] else 1.0)


def read_bhrc(text: RecordText) -> list[Channel]:
    """Read the three uncorrected channels of a file of BHRC (Iran), evenly spaced."""
    channels = []
    for start, end in _find_bounds(text, r"COMP [LVT]\d"):
        line, count, duration, unit = _find_volume_1_header(text, start, end)
        first = text.header_length(line) + 14
        numbers, _ = text.read_block(first, count)
        dt = text.check_step(duration / count, line)
        channels.append(_create_channel(text, numbers * unit, dt, (start, line)))
    return channels


def read_geonet(text: RecordText) -> list[Channel]:
    """Read the three channels of a file of GeoNet (New Zealand), volume 1 or 2."""
    channels = []
    for start, end in _find_bounds(text):
        line, count = _find_once(text, rf"^Number of points\s+({COUNT_PATTERN})\s", start, end)
        step_pattern = rf"({NUMBER_PATTERN}) s(?:ec)?(?: intervals|\s*$)"
        step_line, step = text.find(step_pattern, line + 1, end)
        # "Raw readings in units of 1.00 mm/s/s"; corrected ones have none but mm/s/s
        scale = re.search(r"units of\s+(\d{1,3}\.\d+)\s+mm/s/s", text.lines[step_line])
        peak_line, _ = text.find(_PEAK_PATTERN, step_line, end)
        # 40 integers and 60 reals in lines of 10 precede the samples
        first = text.header_length(peak_line) + 10
        numbers, after = text.read_block(first, int(count[1]))
        # velocities follow at once; they and the header have other numbers of decimals
        tails = [text.lines[at].rstrip().rpartition(".")[2] for at in (first, after - 1)]
        if len(tails[0]) != len(tails[1]):
            raise text.error("the samples begin or end at another line: a line is lost", first)
        dt = text.check_step(float(step[1]), step_line)
        samples = numbers * (1e-3 * (float(scale[1]) if scale else 1.0))
        channels.append(_create_channel(text, samples, dt, (start, first)))
    return channels


def _create_channel(
    text: RecordText, samples: Array, dt: float, header: tuple[int, int]
) -> Channel:
    """Create a channel of samples [m/s²] after a comparison with the peak of its header."""
    if found := text.search(_PEAK_PATTERN, *header):
        peak, unit = found[1][1], text.find_units(f"in {found[1][2]}").pop()
        decimals = len(peak.partition(".")[2])
        text.check_peak(samples, float(peak) * unit, rounding=0.5 * unit * 10.0**-decimals)
    name_pattern = r"(?:\bCHAN\s+\d+:|^COMP(?:ONENT)?)\s+(\S+(?: DEG)?)"
    direction = text.find(name_pattern, *header)[1][1]
    # BHRC numbers its components: L1, V2 and T3
    return Channel.from_direction(samples, dt, re.sub(r"^([LVT])\d$", r"\1", direction))
