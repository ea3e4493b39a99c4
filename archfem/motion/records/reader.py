"""Detection of the format of a record file, by its content."""

import re
from collections.abc import Callable, Mapping
from numbers import Real
from os import PathLike
from typing import Any, NamedTuple

from archfem._files import read_bytes
from archfem._validation import report_user_errors, validate_arguments
from archfem.errors import InvalidInput
from archfem.motion import signal_processing
from archfem.motion.records import columns, keyed, numeric_headers, volumes, waveforms
from archfem.motion.records.record_file import Channel, RecordText, parse_unit


class RecordFormat(NamedTuple):
    """A format of record files: how it is recognised, and its reader."""

    name: str
    read: Callable[[RecordText], list[Channel]]  # components in the order of the file
    marks: Mapping[str, int]  # patterns, each with the number of lines it may stand in

    def recognises(self, text: RecordText) -> bool:
        """Return whether a file has all marks of the format."""
        return all(text.contains(pattern, lines) for pattern, lines in self.marks.items())


# Each format with patterns, and the number of lines from the first in which they must be found.
# Old formats with unspecific headers come last.
_RECORD_FORMATS = tuple(
    RecordFormat(*form)
    for form in (
        ("SMC", numeric_headers.read_smc, {r"^\s*\d\s+[A-Z ]+$": 1, r"^\s*\*\s*$": 11}),
        ("COSMOS", numeric_headers.read_cosmos, {numeric_headers.COSMOS_PATTERN: 40}),
        ("GeoNet", volumes.read_geonet, {r"CORRECTED ACCELEROGRAM .*GNS Science": 1}),
        ("BHRC", volumes.read_bhrc, {r"^\W*VOL1DS FILE": 3}),
        ("CSMIP", volumes.read_spaced, {volumes.CSMIP_PATTERN: 120}),
        ("volume 1 (CDMG, USC, RENADIC)", volumes.read_volume_1, {volumes.VOLUME_1_PATTERN: 120}),
        ("AFAD", keyed.read_afad, {r"^\s*NUMBER OF DATA\s*:": 40, r"SAMPLING INTERVAL": 40}),
        ("UNAM", keyed.read_unam, {"^ARCHIVO ESTANDAR DE ACELERACION": 20}),
        ("CWB", keyed.read_cwb, {r"^#DataSequence:\s*Time": 30}),
        ("ESM", keyed.read_esm, {r"^\s*NDATA\s*:|^\s*SAMPLING_INTERVAL_S\s*:": 80}),
        ("K-NET", keyed.read_knet, {r"^\s*Scale Factor\s|^\s*Sampling Freq\(Hz\)": 20}),
        ("PEER", keyed.read_peer, {r"\bNPTS\b": 12, r"\bDT\b": 12}),
    )
)

_registered_formats: dict[str, RecordFormat] = {}


@validate_arguments
def register_record_format(
    name: str, marks: Mapping[str, int], read: Callable[[RecordText], list[Channel]]
) -> None:
    """Add a format of record files, which is tried before those of archfem.

    Args:
        name: name of the format.
        marks: regular expressions that all files of the format contain, each with the number of
            lines, from the first, among which it must be found.
        read: function from the text of a file to its components. `text.lines` are the lines;
            `text.error(message, line)` is the error to raise for a file that cannot be read.

    Raises:
        InvalidInput: there is no mark, or one is no regular expression.
    """
    for pattern in marks:
        with report_user_errors(f"record format '{name}', mark {pattern!r}"):
            re.compile(pattern)
    if not marks:
        raise InvalidInput(f"record format '{name}' has no marks: it would read every file")

    def read_checked(text: RecordText) -> list[Channel]:
        with report_user_errors(f"record format '{name}', {text.path},"):
            channels = read(text)
        if not isinstance(channels, list) or not channels:
            raise text.error(f"record format '{name}' returned {channels!r}: return [Channel(…)]")
        if any(not isinstance(channel, Channel) for channel in channels):
            raise text.error(f"record format '{name}' returned another thing than a Channel")
        for channel in channels:
            text.check_step(channel.dt)
        return channels

    _registered_formats[name] = RecordFormat(name, read_checked, marks)


def read_components(path: str | PathLike[str], **options: Any) -> dict[str, Channel]:
    """Read the components of one motion by name; options are those of `read_channels`."""
    # a single component counts as horizontal, in any direction
    channels = read_channels(path, **options)
    if len(channels) == 1:
        return {"horizontal": channels[0]}
    level = [channel for channel in channels if not channel.is_vertical]
    upright = [channel for channel in channels if channel.is_vertical]
    steps = {channel.dt for channel in channels}
    if len(steps) > 1 or len(upright) > 1 or not 1 <= len(level) <= 2:
        names = ", ".join(channel.direction or "?" for channel in channels)
        raise InvalidInput(
            f"{path}: components {names} are not those of one instrument: choose with column="
        )
    named = dict(zip(("horizontal", "transverse"), level, strict=False))
    return named | ({"vertical": upright[0]} if upright else {})


def join_channels(channels: Mapping[str, Channel]) -> dict[str, Any]:
    """Return the fields of a motion, with each component at its time."""
    rows = {name: (channel.samples, channel.start_time) for name, channel in channels.items()}
    dt = channels["horizontal"].dt
    return {"dt": dt} | signal_processing.align_starts(rows, dt)


def read_channels(
    path: str | PathLike[str],
    *,
    column: int | None = None,
    units: str | None = None,
    dt: float | None = None,
    response: str | PathLike[str] | None = None,
) -> list[Channel]:
    """Read all channels of a record, or one of them."""
    if units is not None:
        parse_unit(units)
    if not isinstance(dt, Real | None):
        raise InvalidInput(f"dt = {dt!r} is no number: give it in seconds, as in 0.01")
    if not isinstance(column, int | None):
        raise InvalidInput(f"column = {column!r} is no whole number: the first is 1")
    content = read_bytes(path, "record")
    if waveform := waveforms.find_waveform_format(content):
        if dt is not None:
            raise InvalidInput(f"{path}: {waveform} states its step itself: leave out dt=")
        channels = waveforms.read(path, form=waveform, units=units, response=response)
    else:
        text = RecordText.decode(path, content)
        if response is not None:
            raise text.error("response= belongs to miniSEED and SAC: leave it out")
        form = find_format(text)
        if form is None:
            channels = columns.read(text, column=column, units=units, dt=dt)
            column = None  # the only one that was read
        else:
            channels = form.read(text)
            if units is not None or dt is not None:
                raise text.error(
                    f"{form.name} states its units and its step itself: leave out units= and dt="
                )
    return _select_channels(path, channels, column)


def _select_channels(
    path: str | PathLike[str], channels: list[Channel], column: int | None
) -> list[Channel]:
    """Return the channels, or the one of a number from 1, after the checks of any motion."""
    if column is not None:
        if not 1 <= column <= len(channels):
            raise InvalidInput(f"{path} has {len(channels)} components: column {column} is none")
        channels = [channels[column - 1]]
    for channel in channels:
        try:
            signal_processing.validate_samples(channel.samples, channel.direction or "recorded")
        except InvalidInput as error:
            raise InvalidInput(f"{path}: {error}") from error
    return channels


def find_format(text: RecordText) -> RecordFormat | None:
    """Return the format of a text, None for plain columns."""
    known = (*_registered_formats.values(), *_RECORD_FORMATS)
    return next((form for form in known if form.recognises(text)), None)
