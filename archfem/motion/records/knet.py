"""K-NET and KiK-net text files: counts with a scale factor, offset included."""

from functools import partial

from archfem.motion.records.record_file import NUMBER_PATTERN, Channel, RecordText

_HEADER_LINES = 20  # lines


def recognises(text: RecordText) -> bool:
    """Return whether the header has the scale factor or the sampling frequency of K-NET."""
    return text.contains(r"^\s*Scale Factor\s", _HEADER_LINES) or text.contains(
        r"^\s*Sampling Freq\(Hz\)", _HEADER_LINES
    )


def read(text: RecordText) -> list[Channel]:
    """Read the single component of the file and subtract its mean."""
    # kiK-net numbers its components: 1 to 3 in the borehole, 4 to 6 at the surface
    vertical_codes = {"3": "U-D", "6": "U-D"}
    # the number of samples is the product of frequency and duration in the header
    find = partial(text.find, stop=_HEADER_LINES)
    rate_line, rate = find(rf"^\s*Sampling Freq\(Hz\)\s+({NUMBER_PATTERN})\s*Hz")
    duration = find(rf"^\s*Duration Time\(s\)\s+({NUMBER_PATTERN})\s*$")[1]
    scale_factor = rf"^\s*Scale Factor\s+({NUMBER_PATTERN})\s*\(gal\)\s*/\s*({NUMBER_PATTERN})\s*$"
    scale = find(scale_factor)[1]
    memo = find(r"^\s*Memo")[0]
    direction = find(r"^\s*Dir\.\s+(\S+)")[1][1]
    frequency = float(rate[1])
    count = frequency * float(duration[1])
    if not 0.0 < count < 1e9 or float(scale[2]) == 0.0:
        raise text.error("frequency, duration and scale factor are positive numbers", rate_line)
    counts = text.read_last_block(memo + 1, round(count))
    samples = (counts - counts.mean()) * (0.01 * float(scale[1]) / float(scale[2]))
    peak = find(rf"^\s*Max\. Acc\. \(gal\)\s+({NUMBER_PATTERN})\s*$")[1]
    # the peak of the header relies on another estimate of the offset
    text.check_peak(samples, 0.01 * float(peak[1]), tolerance=0.02)
    dt = text.check_step(1.0 / frequency, rate_line)
    return [Channel.from_direction(samples, dt, vertical_codes.get(direction, direction))]
