"""K-NET and KiK-net text files: counts with a scale factor, offset left in."""

from archfem.motion.records.channel import Channel
from archfem.motion.records.text import NUMBER, RecordText

_HEADER = 20  # lines
_SCALE = rf"^\s*Scale Factor\s+({NUMBER})\s*\(gal\)\s*/\s*({NUMBER})\s*$"
_UPRIGHT = {"3": "U-D", "6": "U-D"}  # KiK-net numbers its components: 1-3 borehole, 4-6 surface
_OFFSET = 0.02  # the header's peak was taken after another estimate of the offset


def recognises(text: RecordText) -> bool:
    """Return whether the header has the scale factor or the sampling frequency of K-NET.

    Args:
        text: the file.
    """
    return text.holds(r"^\s*Scale Factor\s", _HEADER) or text.holds(
        r"^\s*Sampling Freq\(Hz\)", _HEADER
    )


def read(text: RecordText) -> list[Channel]:
    """Return the one component of the file, with its mean taken out.

    The number of samples is the frequency by the duration of the header.

    Args:
        text: the file.

    Raises:
        InvalidInput: a key is missing, or the samples contradict the header.
    """
    rate_line, rate = text.find(rf"^\s*Sampling Freq\(Hz\)\s+({NUMBER})\s*Hz", stop=_HEADER)
    duration = text.find(rf"^\s*Duration Time\(s\)\s+({NUMBER})\s*$", stop=_HEADER)[1]
    scale = text.find(_SCALE, stop=_HEADER)[1]
    memo = text.find(r"^\s*Memo", stop=_HEADER)[0]
    direction = text.find(r"^\s*Dir\.\s+(\S+)", stop=_HEADER)[1][1]
    frequency = float(rate[1])
    count = frequency * float(duration[1])
    if not 0.0 < count < 1e9 or float(scale[2]) == 0.0:
        raise text.error("frequency, duration and scale factor are positive numbers", rate_line)
    counts = text.last_block(memo + 1, round(count))
    samples = (counts - counts.mean()) * (0.01 * float(scale[1]) / float(scale[2]))
    peak = text.find(rf"^\s*Max\. Acc\. \(gal\)\s+({NUMBER})\s*$", stop=_HEADER)[1]
    text.check_peak(samples, 0.01 * float(peak[1]), tolerance=_OFFSET)
    dt = text.step(1.0 / frequency, rate_line)
    return [Channel.directed(samples, dt, _UPRIGHT.get(direction, direction))]
