"""Matching a motion to a design spectrum by adding wavelets in time."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from archfem.annotated import as_annotated
from archfem.arrays import Array
from archfem.errors import DidNotConverge, InvalidInput
from archfem.motion import oscillator, signals
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.measures import Measures, measures
from archfem.motion.motion import Motion
from archfem.motion.spectra import response_spectrum
from archfem.units import STANDARD_GRAVITY

Target = Callable[[Array], Array]

_CONTROLS = 100  # oscillators whose peaks are corrected, evenly spaced in log period
_CHECKS = 150  # periods at which the misfit is taken, between the others
_ROUNDS = 30  # of correction at most
_DAMPED = 0.003  # weight of small corrections, relative to the largest singular value
_PEAK = 0.25  # weight of the misfit of the peak acceleration: 10 % count as 2.5 % of the band
_REACH = 4.5  # widths after which a wavelet has faded to 2e-9


BAND = 0.05, 2.0
"""Shortest and longest period that is matched where nothing else is asked for [s]."""


@dataclass(frozen=True, eq=False)
class Match:
    """A motion matched to a spectrum, and what that did to it.

    Args:
        motion: the matched motion.
        misfit: root mean square of spectrum/target - 1 over the band, by component [-].
        before: measures of the motion as it came, by component.
        after: measures of the matched motion, by component.
        band: shortest and longest period that was matched [s].
    """

    motion: Motion
    misfit: dict[str, float]
    before: dict[str, Measures]
    after: dict[str, Measures]
    band: tuple[float, float] = BAND


@as_annotated
def matched(
    motion: Motion,
    spectrum: DesignSpectrum,
    *,
    band: tuple[float, float] = BAND,
    damping: float = 0.05,
    tolerance: float = 0.05,
) -> Match:
    """Match every component of a motion to its design spectrum, and leave no drift.

    The component is freed of its drift and scaled, then corrected in rounds. In each, oscillator i
    of 100 reaches its peak R_i at the time t_i; wavelet j is placed so that oscillator j peaks at
    t_j from it, and with C_ij what it gives oscillator i at t_i the amplitudes b solve

        min  Σ_i ((Σ_j C_ij b_j + R_i - S_i sign R_i) / S_i)²  +  λ² |b|²,

    with the target S_i. The wavelets are those of Al Atik and Abrahamson in width, but made as
    second differences of a displacement, a cosine under a Gauss bell that vanishes at the ends of
    the record: velocity and displacement end where they did, to round-off. Where the spectrum
    begins at period zero, the peak acceleration is corrected with them. Horizontals go to the
    horizontal spectrum, the vertical to the vertical one.

    Args:
        motion: of at least twice the longest period.
        spectrum: the target; its values are in g.
        band: shortest and longest period to match [s].
        damping: of the target spectrum [-].
        tolerance: root mean square of the relative misfit that is accepted [-]. The rounds stop at
            half of it.

    Returns:
        The matched motion with its misfits, and the measures before and after.

    Raises:
        InvalidInput: the band is empty, or the motion is too short or does not move.
        DidNotConverge: the tolerance was not reached; `last` is the best `Match`.

    References:
        Al Atik, Abrahamson, An improved method for nonstationary spectral matching, Earthquake
        Spectra 26 (2010). Lilhanand, Tseng, 9th WCEE (1988).
    """
    _check_band(band)
    parts = max(int(np.ceil(motion.dt * 10.0 / band[0] - 1e-9)), 1)
    changed: dict[str, Any] = {}
    for component in motion.components:
        samples = motion.component(component)
        if (len(samples) - 1) * motion.dt < 2.0 * band[1] or not np.any(samples):
            raise InvalidInput(
                f"{component} of motion {motion.name!r} is at rest or shorter than "
                f"{2 * band[1]:g} s, twice the longest period: it cannot be matched"
            )
        goal = _Goal(_target(spectrum, component), band, damping, 0.5 * tolerance)
        fine = oscillator.interpolated(samples, parts)
        changed[component] = _fitted(fine, motion.dt / parts, goal)
    result = replace(motion, dt=motion.dt / parts, **changed)
    match = _compared(motion, result, spectrum, band=band, damping=damping)
    worst = max(match.misfit.values())
    if worst > tolerance:
        raise DidNotConverge(
            f"matching {motion.name!r} ended at a misfit of {worst:.1%}, wanted {tolerance:.1%}: "
            "choose a record with energy in the band, or a narrower band; error.last has the best",
            last=match,
        )
    return match


def misfit(
    motion: Motion,
    spectrum: DesignSpectrum,
    *,
    component: str = "horizontal",
    band: tuple[float, float] = BAND,
    damping: float = 0.05,
) -> float:
    """Return the root mean square of spectrum/target - 1 over a band, evenly in log period [-].

    Args:
        motion: the ground motion.
        spectrum: the target; its values are in g.
        component: horizontal, vertical or transverse.
        band: shortest and longest period [s].
        damping: of the target spectrum [-].

    Raises:
        InvalidInput: the band is empty, or there is no such component or target.
    """
    _check_band(band)
    periods = np.geomspace(*band, _CHECKS)
    found = response_spectrum(motion, periods, damping, component=component)
    return _apart(found, _target(spectrum, component)(periods) * STANDARD_GRAVITY)


def _check_band(band: tuple[float, float]) -> None:
    """Refuse a band of periods that is empty or begins at zero.

    Raises:
        InvalidInput: it is so.
    """
    if not 0.0 < band[0] < band[1] < np.inf:
        raise InvalidInput(f"band from {band[0]:g} to {band[1]:g} s: expected 0 < first < second")


def _target(spectrum: DesignSpectrum, component: str) -> Target:
    """Return the spectrum a component is matched to."""
    return spectrum.vertical if component == "vertical" else spectrum.horizontal


def _compared(
    before: Motion,
    after: Motion,
    spectrum: DesignSpectrum,
    *,
    band: tuple[float, float],
    damping: float,
) -> Match:
    """Return the motion after matching, measured and compared with the one before."""
    names = after.components
    return Match(
        after,
        {
            name: misfit(after, spectrum, component=name, band=band, damping=damping)
            for name in names
        },
        {name: measures(before, name) for name in names},
        {name: measures(after, name) for name in names},
        band,
    )


class _Goal:
    """What one component is matched to: accelerations in m/s² at control and at check periods."""

    def __init__(
        self, target: Target, band: tuple[float, float], damping: float, enough: float
    ) -> None:
        self.damping = damping
        self.enough = enough
        controls = np.geomspace(*band, _CONTROLS)
        self.periods = np.concatenate((_rigid(target), controls))
        self.values = target(self.periods) * STANDARD_GRAVITY
        self.checks = np.geomspace(*band, _CHECKS)
        self.check_values = target(self.checks) * STANDARD_GRAVITY
        self.lags = np.array([_lag(period, damping) for period in self.periods])
        # The ground's own peak is corrected with the shortest wavelet of the band.
        self.wave_periods = np.maximum(self.periods, band[0])

    def distance(self, samples: Array, dt: float, peaks: Array) -> float:
        """Return how far samples with these peaks are from the goal [-]."""
        found = oscillator.peak_responses(samples, dt, self.checks, self.damping)[0]
        apart = _apart(np.abs(found), self.check_values)
        if self.periods[0] > 0.0:
            return apart
        peak = float(peaks[0] / self.values[0])
        return max(apart, _PEAK * abs(abs(peak) - 1.0))


def _rigid(target: Target) -> Array:
    """Return period zero, or nothing where a spectrum is not defined there."""
    try:
        target(np.zeros(1))
    except InvalidInput:
        return np.zeros(0)
    return np.zeros(1)


def _fitted(samples: Array, dt: float, goal: _Goal) -> Array:
    """Return samples whose spectrum is near the goal."""
    current = signals.baseline_corrected(samples, dt)
    best, least = current, np.inf
    for round_ in range(_ROUNDS):
        peaks, times = oscillator.peak_responses(current, dt, goal.periods, goal.damping)
        if round_ == 0:
            factor = np.exp(np.mean(np.log(goal.values / np.abs(peaks))))
            current, peaks = factor * current, factor * peaks
        now = goal.distance(current, dt, peaks)
        if now < least:
            best, least = current, now
        if least < goal.enough:
            break
        current = current + _correction(peaks, times, goal, dt=dt, count=len(current))
    return best


def _correction(peaks: Array, times: Array, goal: _Goal, *, dt: float, count: int) -> Array:
    """Return the sum of wavelets (count,) [m/s²] that brings the peaks to the goal."""
    waves = np.stack(
        [
            _wavelet(period, centre, dt, count)
            for period, centre in zip(goal.wave_periods, times - goal.lags, strict=True)
        ]
    )
    gains = np.stack(
        [
            _memory(period, time, goal.damping, dt=dt, count=count)
            for period, time in zip(goal.periods, times, strict=True)
        ]
    )
    effect = (gains @ waves.T) / goal.values[:, None]
    wanted = np.sign(peaks) - peaks / goal.values
    left, scales, right = np.linalg.svd(effect)
    small = _DAMPED * scales[0]
    amplitudes = right.T @ (scales / (scales**2 + small**2) * (left.T @ wanted))
    added: Array = amplitudes @ waves
    return added


def _wavelet(period: float, centre: float, dt: float, count: int) -> Array:
    """Return a wavelet (count,) [-] of size 1 whose displacement begins and ends at zero.

    The displacement exp(-(t/γ)²) cos(2 π t/T), γ = 1.178 T^0.93, is brought to zero within a period
    of the ends of the record where it reaches them.
    """
    width = 1.178 * period**0.93
    first = max(int((centre - _REACH * width) / dt), 0)
    last = min(int((centre + _REACH * width) / dt) + 2, count)
    time = np.arange(first, last) * dt - centre
    moved = np.exp(-((time / width) ** 2)) * np.cos(2.0 * np.pi * time / period)
    ramp = np.clip((np.arange(last - first) - 1.0) / max(period / dt, 2.0), 0.0, 1.0)
    ramp = ramp**2 * (3.0 - 2.0 * ramp)
    wave = np.zeros(count)
    wave[first + 1 : last - 1] = np.diff(moved * ramp * ramp[::-1], 2)
    largest: float = np.abs(wave).max()
    return wave / largest


def _memory(period: float, time: float, damping: float, *, dt: float, count: int) -> Array:
    """Return what the acceleration at each sample adds to an oscillator's response at a time."""
    if period == 0.0:
        return np.equal(np.arange(count), round(time / dt)).astype(float)
    omega = 2.0 * np.pi / period
    damped = omega * np.sqrt(1.0 - damping**2)
    ago = time - np.arange(min(int(time / dt) + 1, count)) * dt
    memory = np.zeros(count)
    fading = np.exp(-damping * omega * ago) * np.sin(damped * ago)
    memory[: len(ago)] = omega**2 / damped * dt * fading
    return memory


def _lag(period: float, damping: float) -> float:
    """Return the time from a wavelet's centre to the peak of its oscillator [s]."""
    if period == 0.0:
        return 0.0
    dt = period / 100.0
    centre = _REACH * 1.178 * period**0.93
    count = int(2.0 * centre / dt)
    response = oscillator.displacement(_wavelet(period, centre, dt, count), dt, period, damping)
    return float(np.argmax(np.abs(response)) * dt - centre)


def _apart(found: Array, target: Array) -> float:
    return float(np.sqrt(np.mean((found / target - 1.0) ** 2)))
