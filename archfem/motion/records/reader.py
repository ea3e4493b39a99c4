"""Detection of the format of a record file, by its content."""

from numbers import Real
from os import PathLike
from typing import Protocol

from archfem.errors import InvalidInput
from archfem.motion import signal_processing
from archfem.motion.records import afad, columns, cosmos, csmip, esm, knet, peer, smc
from archfem.motion.records.record_file import Channel, RecordText, parse_unit


class RecordFormat(Protocol):
    """Functions of the module of a format."""

    def recognises(self, text: RecordText) -> bool:
        """Return whether a file is of this format."""

    def read(self, text: RecordText) -> list[Channel]:
        """Return the components of a file of this format, in its order."""


_RECORD_FORMATS: tuple[RecordFormat, ...] = (smc, cosmos, csmip, afad, esm, knet, peer)


def read_components(
    path: str | PathLike[str],
    *,
    column: int | None = None,
    units: str | None = None,
    dt: float | None = None,
) -> dict[str, Channel]:
    """Read the horizontal component of one motion, and vertical and transverse if present."""
    # a single component counts as horizontal, in any direction
    channels = read_channels(path, column=column, units=units, dt=dt)
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


def read_channels(
    path: str | PathLike[str],
    *,
    column: int | None = None,
    units: str | None = None,
    dt: float | None = None,
) -> list[Channel]:
    """Read all channels of a record, or one of them."""
    text = RecordText.from_file(path)
    if units is not None:
        parse_unit(units)
    if not (dt is None or isinstance(dt, Real)) or not (column is None or isinstance(column, int)):
        raise InvalidInput(f"dt {dt!r} is a number in seconds and column {column!r} a whole number")
    form = next((form for form in _RECORD_FORMATS if form.recognises(text)), None)
    if form is None:
        return _validate_channels(text, columns.read(text, column=column, units=units, dt=dt))
    channels = form.read(text)
    if units is not None or dt is not None:
        raise text.error(
            "this format states its units and its step itself: leave out units= and dt="
        )
    if column is None:
        return _validate_channels(text, channels)
    if not 1 <= column <= len(channels):
        raise InvalidInput(f"{text.path} has {len(channels)} components: column {column} is none")
    return _validate_channels(text, [channels[column - 1]])


def _validate_channels(text: RecordText, channels: list[Channel]) -> list[Channel]:
    """Return the channels after the checks of any motion."""
    for channel in channels:
        try:
            signal_processing.validate_samples(channel.samples, channel.direction or "recorded")
        except InvalidInput as error:
            raise InvalidInput(f"{text.path}: {error}") from error
    return channels
