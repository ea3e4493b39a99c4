"""ESM, ITACA and AFAD-TADAS files (DYNA 1.x): a header of `KEY: value`, one sample a line."""

from archfem.motion.records.channel import Channel
from archfem.motion.records.text import COUNT, NUMBER, RecordText
from archfem.motion.records.units import units_written

_HEADER = 80  # lines


def recognises(text: RecordText) -> bool:
    """Return whether the header has the keys of DYNA for count and step.

    Args:
        text: the file.
    """
    return text.holds(r"^\s*NDATA\s*:", _HEADER) or text.holds(
        r"^\s*SAMPLING_INTERVAL_S\s*:", _HEADER
    )


def read(text: RecordText) -> list[Channel]:
    """Return the one component of the file.

    Args:
        text: the file.

    Raises:
        InvalidInput: the file holds no acceleration, lacks a key, or contradicts its header.
    """
    kind = _value(text, "DATA_TYPE")
    if kind.upper() != "ACCELERATION":
        raise text.error(f"DATA_TYPE is {kind!r}, expected ACCELERATION")
    line, count = text.find(rf"^\s*NDATA\s*:\s*({COUNT})\s*$", stop=_HEADER)
    step_line, step = text.find(rf"^\s*SAMPLING_INTERVAL_S\s*:\s*({NUMBER})\s*$", stop=_HEADER)
    dt = text.step(float(step[1]), step_line)
    duration = _value(text, "DURATION_S")
    if duration and abs(_number(text, duration) - int(count[1]) * dt) > 2.0 * dt + 1e-3:
        raise text.error(f"{count[1]} samples at {dt:g} s do not last {duration} s", line)
    units = units_written(_value(text, "UNITS"))
    if len(units) != 1:
        raise text.error("UNITS is not a unit of acceleration")
    samples = text.last_block(text.header_length(), int(count[1])) * units.pop()
    peak = _value(text, r"PGA_CM/S\^2")
    if peak:
        text.check_peak(samples, 0.01 * _number(text, peak))
    return [Channel.directed(samples, dt, _value(text, "STREAM") or _value(text, "COMPONENT"))]


def _value(text: RecordText, key: str) -> str:
    """Return what stands behind a key, or nothing where the key is missing."""
    if not text.holds(rf"^\s*{key}\s*:", _HEADER):
        return ""
    return text.find(rf"^\s*{key}\s*:\s*(.*?)\s*$", stop=_HEADER)[1][1]


def _number(text: RecordText, value: str) -> float:
    """Return the number a key gives.

    Raises:
        InvalidInput: it is not a number.
    """
    try:
        return float(value)
    except ValueError as error:
        raise text.error(f"the header gives {value!r} where a number is expected") from error
