"""Which format a record file has, told by its content."""

from numbers import Real
from os import PathLike
from typing import Protocol

from archfem.errors import InvalidInput
from archfem.motion import signals
from archfem.motion.records import afad, columns, cosmos, csmip, esm, knet, peer, smc
from archfem.motion.records.channel import Channel
from archfem.motion.records.text import RecordText
from archfem.motion.records.units import unit_named


class Format(Protocol):
    """What the module of a format offers."""

    def recognises(self, text: RecordText) -> bool:
        """Return whether a file is of this format.

        Args:
            text: the file.
        """

    def read(self, text: RecordText) -> list[Channel]:
        """Return the components of a file of this format, in its order.

        Args:
            text: the file.

        Raises:
            InvalidInput: the file contradicts itself or lacks what it needs.
        """


_FORMATS: tuple[Format, ...] = (smc, cosmos, csmip, afad, esm, knet, peer)


def read_components(
    path: str | PathLike[str],
    *,
    column: int | None = None,
    units: str | None = None,
    dt: float | None = None,
) -> dict[str, Channel]:
    """Return the components of one motion: its horizontal, and its vertical and transverse if any.

    A single component is the horizontal, whatever its direction.

    Args:
        path: a file of any format that `read_channels` reads.
        column: which component or plain column, counted from 1; None takes all.
        units: unit of plain columns: g, m/s2, cm/s2 or gal.
        dt: time between samples of plain columns [s].

    Raises:
        InvalidInput: what `read_channels` refuses, or channels that are not of one instrument.
    """
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
    """Return all channels of a record, or one of them.

    Args:
        path: a file in PEER AT2, AFAD, ESM/ITACA (DYNA), COSMOS V2, CSMIP/CDMG V2, USGS SMC or
            K-NET format, or plain columns.
        column: which component or plain column, counted from 1; None takes all.
        units: unit of plain columns: g, m/s2, cm/s2 or gal; other formats state theirs.
        dt: time between samples of plain columns [s]; other formats state theirs.

    Returns:
        The channels in the order of the file, accelerations in m/s², verticals upwards.

    Raises:
        InvalidInput: the file cannot be read as an accelerogram without doubt, or a channel is none
            that `signals.checked` lets pass, such as one beyond 5 g; names file and line.
    """
    text = RecordText.opened(path)
    if units is not None:
        unit_named(units)
    if not (dt is None or isinstance(dt, Real)) or not (column is None or isinstance(column, int)):
        raise InvalidInput(f"dt {dt!r} is a number in seconds and column {column!r} a whole number")
    form = next((form for form in _FORMATS if form.recognises(text)), None)
    if form is None:
        return _sound(text, columns.read(text, column=column, units=units, dt=dt))
    channels = form.read(text)
    if units is not None or dt is not None:
        raise text.error(
            "this format states its units and its step itself: leave out units= and dt="
        )
    if column is None:
        return _sound(text, channels)
    if not 1 <= column <= len(channels):
        raise InvalidInput(f"{text.path} has {len(channels)} components: column {column} is none")
    return _sound(text, [channels[column - 1]])


def _sound(text: RecordText, channels: list[Channel]) -> list[Channel]:
    """The channels, once each is such as any motion must be."""
    for channel in channels:
        try:
            signals.checked(channel.samples, channel.direction or "recorded")
        except InvalidInput as error:
            raise InvalidInput(f"{text.path}: {error}") from error
    return channels
