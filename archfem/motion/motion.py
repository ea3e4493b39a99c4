"""`Motion`: a ground acceleration, read, cut, filtered, rotated and scaled."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from archfem._display import ResultDisplay
from archfem._typing import Angle, Array, MetresPerSecondSquared, Seconds
from archfem._validation import (
    check_between,
    check_number,
    check_words,
    count_pieces,
    is_number,
    short_repr,
    validate_methods,
)
from archfem.errors import InvalidInput
from archfem.motion import signal_processing
from archfem.motion.records.reader import join_channels, read_components
from archfem.units import STANDARD_GRAVITY, in_degrees, warn_if_in_g

COMPONENTS = "horizontal", "vertical", "transverse"

# Share of its peak velocity with which a record may end, as ground that comes to rest [-]
MAX_DRIFT = 0.1


@validate_methods
@dataclass(frozen=True, eq=False, repr=False)
class Motion(ResultDisplay):
    """The acceleration of the ground in up to three directions, which begin together.

    Components keep their own lengths, zero before and after; a method that changes one returns a
    new motion. Components of one file or several that state when they begin are shifted, by whole
    steps.

    Args:
        horizontal: accelerations along the arch (n,) [m/s²]; of the ground to the right above 0,
            which pushes stones to the left.
        dt: time between samples [s].
        vertical: accelerations upwards (m,) [m/s²], or None.
        name: name of the motion.
        transverse: the other horizontal (k,) [m/s²], or None; only `rotated` makes use of it.
        start_time: time of the first sample on the clock of its file [s], since 1970 where that has
            a date; None where nothing states it, and components added begin with this motion.
        recorded: whether it is a record of a file, whose runs are doubted if it drifts.

    Raises:
        InvalidInput: a component is no row of finite numbers up to 5 g; or dt is no positive
            number, or above 2 s for more than ten samples.
    """

    horizontal: Array
    dt: float
    vertical: Array | None = None
    name: str = ""
    transverse: Array | None = field(default=None, kw_only=True)
    start_time: float | None = field(default=None, kw_only=True)
    recorded: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        if not (is_number(self.dt) and self.dt >= 1e-6):
            raise InvalidInput(f"dt {short_repr(self.dt)} s is no positive number from 1e-6 on")
        if self.start_time is not None:
            check_number(self.start_time, "start_time of a motion [s]")
        check_words(self.name, "name of a motion")
        for component in COMPONENTS:
            samples = getattr(self, component)
            if samples is not None or component == "horizontal":
                samples = signal_processing.validate_samples(samples, component)
                object.__setattr__(self, component, samples)
        # a few samples may be a constant acceleration; records have steps below 0.1 s
        if self.dt > 2.0 and self.horizontal.size > 10:
            raise InvalidInput(f"dt {self.dt:g} s of {self.horizontal.size} samples: give seconds")

    def _summary(self) -> str:
        """Describe the motion in one line."""
        return f"Motion '{self.name}': {self.duration:.4g} s, peak {self.pga:.3g} m/s²"

    @classmethod
    def read(
        cls,
        path: str | PathLike[str],
        *,
        vertical: str | PathLike[str] | None = None,
        transverse: str | PathLike[str] | None = None,
        column: int | None = None,
        units: str | None = None,
        dt: Seconds | None = None,
        response: str | PathLike[str] | None = None,
    ) -> "Motion":
        """Return the motion of a record; the format is found by the content of the file.

        A single component is the horizontal, whatever its direction. If there are several, the
        first level one is the horizontal, the second the transverse; the vertical is turned up.

        Args:
            path: PEER AT2, AFAD, ESM/ITACA, COSMOS, CSMIP/CDMG, USC, RENADIC, BHRC, GeoNet, USGS
                SMC, K-NET, UNAM, CWB, miniSEED, SAC, or columns.
            vertical: second file, with the vertical component and its own unit and step; one that
                states neither is read by itself, and added by `with_vertical`.
            transverse: another file, that holds the other horizontal, likewise.
            column: take this component or plain column of `path` only, counted from 1.
            units: units of the plain columns, miniSEED or SAC of `path`: g, m/s2, cm/s2 or gal.
            dt: time between samples of the plain columns of `path` [s].
            response: StationXML of the instrument whose counts `path` has, in miniSEED or SAC.

        Raises:
            InvalidInput: part of the file cannot be read without doubt; with file and line.
            NotInstalled: miniSEED and SAC need ObsPy.
        """
        channels = read_components(path, column=column, units=units, dt=dt, response=response)
        try:
            motion = cls(**join_channels(channels), name=Path(path).stem, recorded=True)
        except InvalidInput as error:
            raise InvalidInput(f"{path}: {error}") from error
        if vertical is not None:
            motion = motion.with_vertical(cls.read(vertical))
        if transverse is not None:
            motion = motion.with_transverse(cls.read(transverse))
        return motion

    @classmethod
    def synthetic(
        cls,
        *,
        duration: Seconds = 20.0,
        pga: MetresPerSecondSquared = 0.3 * STANDARD_GRAVITY,
        seed: int = 0,
        dt: Seconds = 0.005,
        vertical_ratio: float = 2.0 / 3.0,
    ) -> "Motion":
        """Return an artificial accelerogram without drift, generated from noise with an envelope.

        The noise has the spectrum of Kanai and Tajimi for firm ground: horizontal 2.4 Hz, vertical
        4 Hz, damping ratio 0.6, with Clough and Penzien's high-pass at a tenth of the frequency.

        Args:
            duration: time of the last sample [s].
            pga: horizontal peak [m/s²].
            seed: the same seed gives the same motion.
            dt: time between samples [s].
            vertical_ratio: vertical peak by horizontal peak [-]; 0 leaves the vertical out.

        Raises:
            InvalidInput: fewer than 50 samples, or pga, ratio or seed out of range.
        """
        level, upright = signal_processing.generate_accelerogram(
            duration, dt, pga=pga, ratio=vertical_ratio, seed=seed
        )
        return cls(level, dt, upright, name=f"synthetic {seed}")

    @classmethod
    def held(
        cls,
        *,
        push: MetresPerSecondSquared,
        rise: Seconds = 1.0,
        duration: Seconds = 10.0,
        dt: Seconds = 0.005,
    ) -> "Motion":
        """Return a push that rises linearly, and is held: the ground accelerates by its opposite.

        Args:
            push: horizontal force per mass, positive to the right, as by `BodyForce` [m/s²].
            rise: time until it is reached [s].
            duration: time of the last sample [s].
            dt: time between samples [s].

        Raises:
            InvalidInput: a value is out of range.
        """
        for name, value, most in (("rise", rise, duration), ("dt", dt, rise)):
            check_between(value, f"{name} of a held push [s]", 0.0, most, ends="(]")
        warn_if_in_g(abs(push), "a held push")
        most = signal_processing.MAX_SAMPLES
        count = count_pieces(duration, dt, "samples of a held push", most)
        share = np.minimum(dt * np.arange(count + 1) / rise, 1.0)
        return cls(-push * share, dt, name=f"{push / STANDARD_GRAVITY:.3g} g held")

    @property
    def duration(self) -> float:
        """Time of the last sample of the longest component [s]."""
        return (max(len(self.component(name)) for name in self.components) - 1) * self.dt

    @property
    def pga(self) -> float:
        """Peak of the horizontal acceleration [m/s²]."""
        return float(np.abs(self.horizontal).max())

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components there are."""
        return tuple(name for name in COMPONENTS if getattr(self, name) is not None)

    def component(self, name: str) -> Array:
        """Return the accelerations of one component (n,) [m/s²].

        Args:
            name: horizontal, vertical or transverse.

        Raises:
            InvalidInput: the motion has no such component.
        """
        if name not in self.components:
            raise InvalidInput(
                f"motion {self.name!r} has no component {name!r}, only {', '.join(self.components)}"
            )
        return getattr(self, name)

    def times(self, component: str = "horizontal") -> Array:
        """Return the times of the samples of one component (n,) [s].

        Args:
            component: horizontal, vertical or transverse.
        """
        return np.arange(len(self.component(component))) * self.dt

    def velocity(self, component: str = "horizontal") -> Array:
        """Return the ground velocity (n,) [m/s], at rest at first.

        Args:
            component: horizontal, vertical or transverse.
        """
        return signal_processing.integrate_velocity(self.component(component), self.dt)

    def displacement(self, component: str = "horizontal") -> Array:
        """Return the ground displacement (n,) [m], at rest at first.

        Args:
            component: horizontal, vertical or transverse.
        """
        return signal_processing.integrate_displacement(self.component(component), self.dt)

    def at(self, times: float | Array) -> Array:
        """Return the horizontal and vertical acceleration at any times (n, 2) [m/s²].

        Args:
            times: times of any shape (n in all) [s], `InvalidInput` where one is nan; straight
                between samples, zero outside the record.
        """
        moments, up = signal_processing.count_in_samples(times, self.dt), self.vertical
        rows = self.horizontal, np.zeros(1) if up is None else up
        values = [signal_processing.interpolate_samples(row, moments) for row in rows]
        return np.column_stack(values)

    def scaled(self, factor: float) -> "Motion":
        """Return the motion with all components multiplied by a factor.

        Args:
            factor: multiple [-]; a negative one turns the motion round.
        """
        return self._map_components(lambda samples: factor * samples)

    def reversed(self) -> "Motion":
        """Return the motion with its horizontals turned: as if the structure faced backwards."""
        return replace(self.scaled(-1.0), vertical=self.vertical)

    def scaled_to_pga(self, pga: float) -> "Motion":
        """Return the motion with all components scaled by one factor, to a horizontal peak.

        Args:
            pga: peak of the horizontal to reach [m/s²].

        Raises:
            InvalidInput: the horizontal is at rest, or pga is not positive.
        """
        if self.pga > 0.0 and pga > 0.0:
            return self.scaled(pga / self.pga)
        raise InvalidInput(f"scaling a peak of {self.pga:g} to {pga:g} m/s²: both must be > 0")

    def cut(self, start: Seconds, end: Seconds | None = None) -> "Motion":
        """Return the samples from start to end; a component that ended before keeps one zero.

        Args:
            start: time of the first sample kept [s].
            end: time of the last [s]; None keeps all to the end.

        Raises:
            InvalidInput: the start is negative, or no sample of the horizontal is left.
        """
        stop = self.duration if end is None else end
        first = np.ceil(round(start / self.dt, 6))
        last = np.floor(round(min(stop, self.duration) / self.dt, 6))
        if not (start >= 0.0 and first < len(self.horizontal) and first <= last):
            raise InvalidInput(
                f"cut from {start:g} to {stop:g} s: nothing of the {self.duration:g} s is left"
            )
        kept = slice(int(first), int(last) + 1)
        begin = None if self.start_time is None else self.start_time + float(first) * self.dt
        part = self._map_components(lambda row: row[kept] if len(row[kept]) else np.zeros(1))
        return replace(part, start_time=begin)

    def with_rest(self, rest: Seconds) -> "Motion":
        """Return the motion followed by ground at rest, on which blocks come to rest.

        Args:
            rest: length of the rest [s].

        Raises:
            InvalidInput: rest is negative or infinite.
        """
        zeros = np.zeros(round(check_number(rest, "rest [s]", minimum=0.0) / self.dt))
        return self._map_components(np.append, zeros)

    def significant(self, low: float = 0.05, high: float = 0.95) -> "Motion":
        """Return the part of significant duration, after Trifunac and Brady (1975).

        Args:
            low: fraction of the horizontal's Arias intensity at which it begins [-].
            high: fraction at which it ends [-].

        Raises:
            InvalidInput: not 0 <= low < high <= 1, or the horizontal is at rest.
        """
        window = signal_processing.find_significant_window(self.horizontal, self.dt, low, high)
        return self.cut(*window)

    def resampled(self, dt: float) -> "Motion":
        """Return the motion sampled anew, with its largest peaks and its ground displacement.

        Of synthetic motions sampled up to four times more coarsely spectra change by 2 % at most
        from periods of eight new steps on, and by up to 15 % at shorter ones; of white noise,
        sampled up to 2.7 times, by 8 %. Of two steps take the shorter.

        Args:
            dt: the new time between samples [s].

        Raises:
            InvalidInput: dt is not positive and finite.
        """
        return replace(self._map_components(signal_processing.resample, self.dt, dt), dt=dt)

    def baseline_corrected(self, degree: int = 6) -> "Motion":
        """Return the motion without drift, as by `signal_processing.correct_baseline`.

        Args:
            degree: degree of the polynomial taken out of the displacement, at least 3.

        Raises:
            InvalidInput: the degree is below 3, or not below the number of samples.
        """
        return self._map_components(signal_processing.correct_baseline, self.dt, degree)

    def band_passed(self, low: float, high: float, *, order: int = 4) -> "Motion":
        """Return the motion with its frequencies in a band, as by `signal_processing.filter_band`.

        Args:
            low: lowest frequency kept [Hz].
            high: highest frequency kept [Hz].
            order: order of the filter, which runs forwards and backwards.

        Raises:
            InvalidInput: not 0 < low < high < half the sampling frequency, or the order below 1.
        """
        return self._map_components(signal_processing.filter_band, self.dt, low, high, order=order)

    def rotated(self, angle: Angle) -> "Motion":
        """Return the motion in horizontal axes rotated by an angle, from horizontal to transverse.

        Args:
            angle: angle by which the axes turn [degrees]; a small one with its unit, "5 degree".

        Raises:
            InvalidInput: there is no transverse, or the angle looks like radians.
        """
        pair = self.horizontal, self.component("transverse")
        turn = np.radians(in_degrees(angle, "angle"))
        level, across = signal_processing.rotate_components(*pair, turn)
        return replace(self, horizontal=level, transverse=across)

    def with_vertical(self, other: "Motion | None") -> "Motion":
        """Return the motion with the vertical of another one, at its time where both state one.

        Args:
            other: gives its vertical, or without one its horizontal; None leaves the vertical out.

        Raises:
            InvalidInput: the steps of the two differ, or they have no time in common.
        """
        if other is None:
            return replace(self, vertical=None)
        return self._add_component("vertical", other)

    def with_transverse(self, other: "Motion") -> "Motion":
        """Return the motion with the horizontal of another one as its transverse, at its time.

        Args:
            other: gives its horizontal.

        Raises:
            InvalidInput: the steps of the two differ, or they have no time in common.
        """
        return self._add_component("transverse", other)

    def _add_component(self, name: str, other: "Motion") -> "Motion":
        if not np.isclose(other.dt, self.dt, rtol=1e-6, atol=0.0):
            steps = f"a step of {other.dt:g} s ({other.name!r}) and one of {self.dt:g} s"
            finer = min(self.dt, other.dt)
            raise InvalidInput(f"{steps}: bring the coarser to the finer by .resampled({finer:g})")
        row = other.vertical if name == "vertical" else None
        rows = {each: (self.component(each), self.start_time) for each in self.components}
        rows[name] = (other.horizontal if row is None else row), other.start_time
        aligned = signal_processing.align_starts(rows, self.dt)
        return replace(self, **aligned, recorded=self.recorded or other.recorded)

    def _map_components(self, change: Callable[..., Array], *args: Any, **options: Any) -> "Motion":
        rows: dict[str, Any] = {
            name: change(self.component(name), *args, **options) for name in self.components
        }
        return replace(self, **rows)


def find_drift(motion: Motion, component: str) -> tuple[float, float]:
    """Return the velocity with which the ground drifts on [m/s], and its share of the peak [-].

    The second is the mean acceleration to that velocity over the peak acceleration. Both are zero
    of ground that comes to rest.
    """
    velocity = np.abs(motion.velocity(component))
    if velocity[-1] <= MAX_DRIFT * velocity.max():
        return 0.0, 0.0
    samples = np.trim_zeros(motion.component(component), "b")  # without rest behind the record
    left = float(velocity[-1])
    return left, left / (motion.dt * len(samples) * float(np.abs(samples).max()))


def admissible_range(between: Sequence[float], motion: Motion) -> tuple[float, float]:
    """Return a range of scales cut off at the scale at which a motion has a peak of 5 g."""
    smallest, largest = between
    peak = max(float(np.abs(motion.component(name)).max()) for name in motion.components)
    if peak == 0.0:
        raise InvalidInput(f"motion '{motion.name}' is at rest: no factor on it moves anything")
    return smallest, max(smallest, min(largest, signal_processing.MAX_PEAK_ACCELERATION / peak))
