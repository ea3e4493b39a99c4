"""`Motion`: a ground acceleration, read, cut, filtered, rotated and scaled."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from archfem import signals
from archfem.arguments import instance, real
from archfem.errors import InvalidInput
from archfem.records.channel import Channel
from archfem.records.read import read_channels
from archfem.synthetic import enveloped_noise
from archfem.units import STANDARD_GRAVITY

COMPONENTS = ("horizontal", "vertical", "transverse")

LARGEST_PEAK = 5.0 * STANDARD_GRAVITY
"""No record reaches this acceleration [m/s²]: beyond it the unit must be wrong."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The acceleration of the ground in up to three directions, which begin together.

    Each component keeps its own length and is zero before and after. What changes a motion returns
    a new one and does the same to every component.

    Args:
        horizontal: accelerations along the arch (n,) [m/s²].
        dt: time between samples [s].
        vertical: accelerations upwards (m,) [m/s²], or None.
        name: what to call it.
        transverse: the other horizontal (k,) [m/s²], or None; only `rotated` makes use of it.

    Raises:
        InvalidInput: a component is not a row of finite numbers or exceeds 5 g, or dt is not
            positive.
    """

    horizontal: np.ndarray
    dt: float
    vertical: np.ndarray | None = None
    name: str = ""
    transverse: np.ndarray | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if not (isinstance(self.dt, Real) and 0.0 < self.dt < np.inf):
            raise InvalidInput(f"dt {self.dt!r} s: the time between samples is a positive number")
        instance(self.name, str, "name of a motion", "give words")
        for component in COMPONENTS:
            samples = getattr(self, component)
            if samples is not None or component == "horizontal":
                object.__setattr__(self, component, _checked(samples, component))

    @classmethod
    def read(
        cls,
        path: str | PathLike[str],
        *,
        vertical: str | PathLike[str] | None = None,
        transverse: str | PathLike[str] | None = None,
        column: int | None = None,
        units: str | None = None,
        dt: float | None = None,
    ) -> "Motion":
        """Read a record; the format is found by the content of the file.

        A file with one component gives it as the horizontal, whatever its direction. One with
        several gives its first horizontal, its vertical (turned up), and its second horizontal as
        the transverse.

        Args:
            path: PEER AT2, AFAD, ESM/ITACA, COSMOS V2, CSMIP/CDMG V2, USGS SMC, K-NET, or columns.
            vertical: second file, with the vertical component and its own unit and step; one that
                states neither is read by itself, and added by `with_vertical`.
            transverse: another file, that holds the other horizontal, likewise.
            column: take this component or plain column of `path` only, counted from 1.
            units: unit of the plain columns of `path`: g, m/s2, cm/s2 or gal.
            dt: time between samples of the plain columns of `path` [s].

        Raises:
            InvalidInput: what cannot be read without doubt, with file and line.
        """
        channels = read_channels(path, column=column, units=units, dt=dt)
        motion = cls._from_channels(channels, Path(path))
        if vertical is not None:
            motion = motion.with_vertical(cls.read(vertical))
        if transverse is not None:
            motion = motion.with_transverse(cls.read(transverse))
        return motion

    @classmethod
    def _from_channels(cls, channels: list[Channel], path: Path) -> "Motion":
        steps = {channel.dt for channel in channels}
        level = [channel for channel in channels if not channel.is_vertical]
        upright = [channel for channel in channels if channel.is_vertical]
        if len(channels) == 1:
            level, upright = channels, []
        if len(steps) > 1 or len(upright) > 1 or not 1 <= len(level) <= 2:
            names = ", ".join(channel.direction or "?" for channel in channels)
            raise InvalidInput(
                f"{path}: components {names} are not those of one instrument: choose with column="
            )
        try:
            return cls(
                level[0].samples,
                steps.pop(),
                vertical=upright[0].samples if upright else None,
                transverse=level[1].samples if len(level) == 2 else None,
                name=path.stem,
            )
        except InvalidInput as error:
            raise InvalidInput(f"{path}: {error}") from error

    @classmethod
    def synthetic(
        cls,
        *,
        duration: float = 20.0,
        pga: float = 0.3 * STANDARD_GRAVITY,
        seed: int = 0,
        dt: float = 0.005,
        vertical_ratio: float = 2.0 / 3.0,
    ) -> "Motion":
        """Make an artificial accelerogram without drift: Kanai-Tajimi noise under an envelope.

        Args:
            duration: time of the last sample [s].
            pga: horizontal peak [m/s²].
            seed: the same seed gives the same motion.
            dt: time between samples [s].
            vertical_ratio: vertical peak by horizontal peak; 0 leaves the vertical out.
        """
        given = {"duration [s]": duration, "pga [m/s²]": pga, "dt [s]": dt}
        for key, value in (given | {"vertical_ratio [-]": vertical_ratio}).items():
            real(value, f"synthetic motion, {key}")
        if not (duration >= 50 * dt > 0.0 and pga > 0.0 and vertical_ratio >= 0.0):
            raise InvalidInput(
                f"synthetic motion of {duration:g} s at {dt:g} s, pga {pga:g} m/s², vertical ratio "
                f"{vertical_ratio:g}: expected 50 samples or more, pga > 0 and ratio >= 0"
            )
        instance(seed, Integral, "seed", "give a whole number")
        if seed < 0:
            raise InvalidInput(f"synthetic motion of seed {seed}: seeds are 0, 1, 2, …")
        random = np.random.default_rng(seed)
        count = round(duration / dt) + 1
        level = pga * enveloped_noise(count, dt, random=random)
        upright = (
            vertical_ratio * pga * enveloped_noise(count, dt, random=random, component="vertical")
        )
        return cls(level, dt, upright if vertical_ratio else None, name=f"synthetic {seed}")

    @property
    def duration(self) -> float:
        """Time of the last sample of the longest component [s]."""
        longest = max(len(self.component(name)) for name in self.components)
        return (longest - 1) * self.dt

    @property
    def pga(self) -> float:
        """Peak of the horizontal acceleration [m/s²]."""
        return float(np.abs(self.horizontal).max())

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components there are."""
        return tuple(name for name in COMPONENTS if getattr(self, name) is not None)

    def component(self, name: str) -> np.ndarray:
        """Return the accelerations of one component (n,) [m/s²]."""
        if name not in self.components:
            raise InvalidInput(
                f"motion {self.name!r} has no component {name!r}, only {', '.join(self.components)}"
            )
        return getattr(self, name)

    def times(self, component: str = "horizontal") -> np.ndarray:
        """Return the times of the samples of one component (n,) [s]."""
        return np.arange(len(self.component(component))) * self.dt

    def velocity(self, component: str = "horizontal") -> np.ndarray:
        """Return the ground velocity (n,) [m/s]."""
        return signals.velocity(self.component(component), self.dt)

    def displacement(self, component: str = "horizontal") -> np.ndarray:
        """Return the ground displacement (n,) [m]."""
        return signals.displacement(self.component(component), self.dt)

    def at(self, times: float | np.ndarray) -> np.ndarray:
        """Return the acceleration at any times, straight between samples, zero outside the record.

        Args:
            times: times (n,) [s].

        Returns:
            Horizontal and vertical acceleration (n, 2) [m/s²].
        """
        moments = np.atleast_1d(np.asarray(times, dtype=float))
        both = np.zeros((len(moments), 2))
        for axis, name in enumerate(COMPONENTS[:2]):
            if name in self.components:
                both[:, axis] = signals.between(self.component(name), moments / self.dt)
        return both

    def scaled(self, factor: float) -> "Motion":
        """Multiply all components by a factor [-]; a negative one turns them round."""
        return self._each(lambda samples: factor * samples)

    def reversed(self) -> "Motion":
        """Turn the horizontal components round, as if the structure faced the other way."""
        turned = {name: -self.component(name) for name in self.components if name != "vertical"}
        return replace(self, **turned)  # type: ignore[arg-type]

    def scaled_to_pga(self, pga: float) -> "Motion":
        """Scale all components by the one factor that gives the horizontal this peak [m/s²]."""
        if self.pga == 0.0 or not pga > 0.0:
            raise InvalidInput(f"scaling a peak of {self.pga:g} to {pga:g} m/s²: both must be > 0")
        return self.scaled(pga / self.pga)

    def cut(self, start: float, end: float | None = None) -> "Motion":
        """Keep the samples from start to end [s]; a component that ended before keeps one zero."""
        stop = self.duration if end is None else end
        first = int(np.ceil(round(start / self.dt, 6)))
        last = int(np.floor(round(stop / self.dt, 6))) + 1
        if start < 0.0 or first >= len(self.horizontal) or last <= first:
            raise InvalidInput(
                f"cut from {start:g} to {stop:g} s: nothing of the {self.duration:g} s is left"
            )
        return self._each(
            lambda samples: samples[first:last] if first < len(samples) else np.zeros(1)
        )

    def significant(self, low: float = 0.05, high: float = 0.95) -> "Motion":
        """Cut to where the horizontal's Arias intensity is between two fractions of its end."""
        return self.cut(*signals.significant_window(self.horizontal, self.dt, low, high))

    def resampled(self, dt: float) -> "Motion":
        """Sample anew at a step dt [s] by straight lines, keeping all peaks; it does not filter."""
        if not dt > 0.0:
            raise InvalidInput(f"dt {dt!r} s: the time between samples is a positive number")
        return replace(self._each(lambda samples: signals.resampled(samples, self.dt, dt)), dt=dt)

    def baseline_corrected(self, degree: int = 6) -> "Motion":
        """Take out the drift with a polynomial: velocity and displacement end at zero."""
        return self._each(lambda samples: signals.baseline_corrected(samples, self.dt, degree))

    def band_passed(self, low: float, high: float, *, order: int = 4) -> "Motion":
        """Keep the frequencies from low to high [Hz], without shift in time (Butterworth)."""
        return self._each(
            lambda samples: signals.band_passed(samples, self.dt, low, high, order=order)
        )

    def rotated(self, angle: float) -> "Motion":
        """Turn the horizontal axes by an angle [rad] from the horizontal towards the transverse."""
        level, across = self.horizontal, self.component("transverse")
        count = max(len(level), len(across))
        level, across = (np.pad(part, (0, count - len(part))) for part in (level, across))
        cosine, sine = np.cos(angle), np.sin(angle)
        return replace(
            self,
            horizontal=cosine * level + sine * across,
            transverse=cosine * across - sine * level,
        )

    def with_vertical(self, other: "Motion | None") -> "Motion":
        """Take the vertical of another motion, or the only component it has; None leaves it out."""
        if other is None:
            return replace(self, vertical=None)
        self._check_step(other)
        upright = other.horizontal if other.vertical is None else other.vertical
        return replace(self, vertical=upright)

    def with_transverse(self, other: "Motion") -> "Motion":
        """Take the horizontal of another motion as the transverse."""
        self._check_step(other)
        return replace(self, transverse=other.horizontal)

    def _check_step(self, other: "Motion") -> None:
        if not np.isclose(other.dt, self.dt, rtol=1e-6):
            raise InvalidInput(
                f"{other.name!r} has a step of {other.dt:g} s and {self.name!r} of {self.dt:g} s: "
                "bring one to the other's with resampled"
            )

    def _each(self, change: Callable[[np.ndarray], np.ndarray]) -> "Motion":
        changed: dict[str, Any] = {name: change(self.component(name)) for name in self.components}
        return replace(self, **changed)


def _checked(samples: np.ndarray | None, component: str) -> np.ndarray:
    """Return a component as its own read-only row of finite numbers below 5 g."""
    try:
        row = np.array(samples, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"{component} acceleration is not a row of numbers: {error}") from error
    if row.ndim != 1 or row.size == 0 or not np.all(np.isfinite(row)):
        raise InvalidInput(
            f"{component} acceleration of shape {row.shape}: expected one row of finite numbers"
        )
    peak = np.abs(row).max()
    if peak > LARGEST_PEAK:
        raise InvalidInput(
            f"{component} acceleration reaches {peak / STANDARD_GRAVITY:.3g} g, more than 5 g: "
            "that can only be a wrong unit (m/s² expected)"
        )
    row.setflags(write=False)
    return row
