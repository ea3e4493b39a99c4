"""ESM, ITACA and AFAD-TADAS files (DYNA 1.x): a header of `KEY: value`, one sample a line."""

from functools import partial

from archfem.motion.records.record_file import COUNT_PATTERN, NUMBER_PATTERN, Channel, RecordText

_HEADER_LINES = 80  # lines


def recognises(text: RecordText) -> bool:
    """Return whether the header has the keys of DYNA for count and step."""
    return text.contains(r"^\s*NDATA\s*:", _HEADER_LINES) or text.contains(
        r"^\s*SAMPLING_INTERVAL_S\s*:", _HEADER_LINES
    )


def read(text: RecordText) -> list[Channel]:
    """Read the single component of the file."""
    kind = _find_value(text, "DATA_TYPE")
    if kind.upper() != "ACCELERATION":
        raise text.error(f"DATA_TYPE is {kind!r}, expected ACCELERATION")
    find = partial(text.find, stop=_HEADER_LINES)
    line, count = find(rf"^\s*NDATA\s*:\s*({COUNT_PATTERN})\s*$")
    step_line, step = find(rf"^\s*SAMPLING_INTERVAL_S\s*:\s*({NUMBER_PATTERN})\s*$")
    dt = text.check_step(float(step[1]), step_line)
    duration = _find_value(text, "DURATION_S")
    if duration and abs(_parse_number(text, duration) - int(count[1]) * dt) > 2.0 * dt + 1e-3:
        raise text.error(f"{count[1]} samples at {dt:g} s do not last {duration} s", line)
    unit = text.find_unit(_find_value(text, "UNITS"), "UNITS is not a unit of acceleration")
    samples = text.read_last_block(text.header_length(), int(count[1])) * unit
    peak = _find_value(text, r"PGA_CM/S\^2")
    if peak:
        text.check_peak(samples, 0.01 * _parse_number(text, peak))
    direction = _find_value(text, "STREAM") or _find_value(text, "COMPONENT")
    return [Channel.from_direction(samples, dt, direction)]


def _find_value(text: RecordText, key: str) -> str:
    """Return the text after a key, empty where the key is missing."""
    if not text.contains(rf"^\s*{key}\s*:", _HEADER_LINES):
        return ""
    return text.find(rf"^\s*{key}\s*:\s*(.*?)\s*$", stop=_HEADER_LINES)[1][1]


def _parse_number(text: RecordText, value: str) -> float:
    """Convert the value of a key to a number."""
    try:
        return float(value)
    except ValueError as error:
        raise text.error(f"the header gives {value!r} where a number is expected") from error
