"""Spectral matching of a motion by wavelets in the time domain."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.errors import DidNotConverge, InvalidInput, logger
from archfem.motion import response_spectra, signal_processing
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.response_spectra import IntensityMeasures, measure_intensity, response_spectrum
from archfem.units import STANDARD_GRAVITY

Target = Callable[[Array], Array]


# A wavelet has decayed to 2e-9 after this many of its widths.
WAVELET_HALF_LENGTH = 4.5

# Default of the shortest and longest period that is matched [s]
DEFAULT_BAND = 0.05, 2.0


@dataclass(frozen=True, eq=False)
class Match:
    """A motion matched to a spectrum, with its misfit and intensity measures.

    Args:
        motion: the matched motion.
        misfit: root mean square of spectrum/target - 1 over the band, by component [-].
        before: intensity measures of the original motion, by component.
        after: intensity measures of the matched motion, by component.
        band: shortest and longest period that was matched [s].
    """

    motion: Motion
    misfit: dict[str, float]
    before: dict[str, IntensityMeasures]
    after: dict[str, IntensityMeasures]
    band: tuple[float, float] = DEFAULT_BAND


@validate_arguments
def matched(
    motion: Motion,
    spectrum: DesignSpectrum,
    *,
    band: tuple[float, float] = DEFAULT_BAND,
    damping: float = 0.05,
    tolerance: float = 0.05,
) -> Match:
    """Match every component of a motion to its design spectrum, without drift.

    The component is corrected for its baseline, scaled, then corrected by iteration. In each
    iteration, oscillator i of 100 reaches its peak R_i at the time t_i. Wavelet j is placed so that
    its response of oscillator j peaks at t_j. C_ij is its response of oscillator i at t_i, and S_i
    is the target. The amplitudes b solve

        min  Σ_i ((Σ_j C_ij b_j + R_i - S_i sign R_i) / S_i)²  +  λ² |b|².

    The wavelets have the width of Al Atik and Abrahamson. They are second
    differences of a displacement, a cosine under a Gauss bell that vanishes at the ends of the
    record: the final velocity and displacement are unchanged to round-off. Where the spectrum
    starts at period zero, the peak acceleration is corrected as well. Horizontal components are
    matched to the horizontal spectrum, the vertical one to the vertical. A permanent displacement
    of the ground is taken out as drift; a warning has its size, and PGV and PGD before and after.

    Args:
        motion: motion of at least twice the longest period.
        spectrum: the target; its values are in g.
        band: shortest and longest period to match [s].
        damping: damping of the target spectrum [-].
        tolerance: accepted root mean square of the relative misfit [-]; the iteration stops at
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
        target = _target_spectrum(spectrum, component)
        goal = _TargetAccelerations(target, band, damping, 0.5 * tolerance)
        fine = response_spectra.interpolate_steps(samples, parts)
        changed[component] = _fit_spectrum(fine, motion.dt / parts, goal)
    result = replace(motion, dt=motion.dt / parts, **changed)
    names = result.components
    misfit = {
        name: spectral_misfit(result, spectrum, component=name, band=band, damping=damping)
        for name in names
    }
    before, after = ({name: measure_intensity(m, name) for name in names} for m in (motion, result))
    match = Match(result, misfit, before, after, band)
    _warn_of_lost_displacement(motion, match)
    worst = max(misfit.values())
    if worst > tolerance:
        raise DidNotConverge(
            f"matching {motion.name!r} ended at a misfit of {worst:.1%}, above the tolerance of "
            f"{tolerance:.1%}: choose a record with energy in the band, or a narrower band; "
            "error.last has the best",
            last=match,
        )
    return match


def _warn_of_lost_displacement(motion: Motion, match: Match) -> None:
    """Warn of a final displacement that the correction of the baseline has taken out."""
    for name, before in match.before.items():
        lost, after = motion.displacement(name)[-1], match.after[name]
        if abs(lost) > 0.1 * before.pgd:  # less is no fling
            logger.warning(
                "motion %r, %s: matching took out a displacement of %.3g m at the end, as drift; "
                "PGD was %.3g and is %.3g m, PGV %.3g and %.3g m/s: do not use it for a fling",
                *(motion.name, name, lost, before.pgd, after.pgd, before.pgv, after.pgv),
            )


def spectral_misfit(
    motion: Motion,
    spectrum: DesignSpectrum,
    *,
    component: str = "horizontal",
    band: tuple[float, float] = DEFAULT_BAND,
    damping: float = 0.05,
) -> float:
    """Compute the root mean square of spectrum/target - 1 over a band, even in log period [-]."""
    _check_band(band)
    periods = _misfit_periods(band)
    response = response_spectrum(motion, periods, damping, component=component)
    target = _target_spectrum(spectrum, component)(periods) * STANDARD_GRAVITY
    return _relative_misfit(response, target)


def _misfit_periods(band: tuple[float, float]) -> Array:
    """Return the periods, evenly spaced in log period, at which the misfit is measured [s]."""
    return np.geomspace(*band, 150)


def _check_band(band: tuple[float, float]) -> None:
    """Refuse a band of periods that is empty or begins at zero."""
    if not 0.0 < band[0] < band[1] < np.inf:
        raise InvalidInput(f"band from {band[0]:g} to {band[1]:g} s: expected 0 < first < second")


def _target_spectrum(spectrum: DesignSpectrum, component: str) -> Target:
    """Return the spectrum a component is matched to."""
    return spectrum.vertical if component == "vertical" else spectrum.horizontal


class _TargetAccelerations:
    """Target accelerations [m/s²] of one component at control periods and at check periods."""

    def __init__(
        self, target: Target, band: tuple[float, float], damping: float, tolerance: float
    ) -> None:
        self.damping, self.tolerance = damping, tolerance
        self.periods = np.geomspace(*band, 100)
        with suppress(InvalidInput):  # where the spectrum is not defined at period zero
            target(np.zeros(1))
            self.periods = np.append(0.0, self.periods)
        self.values = target(self.periods) * STANDARD_GRAVITY
        self.checks = _misfit_periods(band)
        self.check_values = target(self.checks) * STANDARD_GRAVITY
        self.lags = np.array([_peak_lag(period, damping) for period in self.periods])
        # the peak ground acceleration is corrected with the shortest wavelet of the band
        self.wave_periods = np.maximum(self.periods, band[0])

    def distance(self, samples: Array, dt: float, peaks: Array) -> float:
        """Compute the misfit of the spectrum of samples, and of their peak acceleration [-]."""
        response = response_spectra.find_peak_responses(samples, dt, self.checks, self.damping)[0]
        apart = _relative_misfit(np.abs(response), self.check_values)
        if self.periods[0] > 0.0:
            return apart
        peak = float(peaks[0] / self.values[0])
        # 10 % of the peak acceleration count as 2.5 % of the band
        return max(apart, 0.25 * abs(abs(peak) - 1.0))


def _fit_spectrum(samples: Array, dt: float, goal: _TargetAccelerations) -> Array:
    """Correct samples until their spectrum matches, and return the best ones."""
    current = signal_processing.correct_baseline(samples, dt)
    best, smallest = current, np.inf
    for iteration in range(30):
        peaks, times = response_spectra.find_peak_responses(current, dt, goal.periods, goal.damping)
        if iteration == 0:
            factor = np.exp(np.mean(np.log(goal.values / np.abs(peaks))))
            current, peaks = factor * current, factor * peaks
        now = goal.distance(current, dt, peaks)
        if now < smallest:
            best, smallest = current, now
        if smallest < goal.tolerance:
            break
        current = current + _compute_correction(peaks, times, goal, dt=dt, count=len(current))
    return best


def _compute_correction(
    peaks: Array, times: Array, goal: _TargetAccelerations, *, dt: float, count: int
) -> Array:
    """Compute the sum of wavelets (count,) [m/s²] that corrects the peaks."""
    waves, gains = np.empty((2, len(times), count))
    for k, (period, time) in enumerate(zip(goal.periods, times, strict=True)):
        waves[k] = _build_wavelet(goal.wave_periods[k], time - goal.lags[k], dt, count)
        gains[k] = _impulse_response(period, time, goal.damping, dt=dt, count=count)
    effect = (gains @ waves.T) / goal.values[:, None]
    correction = np.sign(peaks) - peaks / goal.values
    left, scales, right = np.linalg.svd(effect)
    small = 0.003 * scales[0]  # λ: damps corrections of small effect
    amplitudes = right.T @ (scales / (scales**2 + small**2) * (left.T @ correction))
    return amplitudes @ waves


def _build_wavelet(period: float, centre: float, dt: float, count: int) -> Array:
    """Return a wavelet (count,) [-] with peak 1 whose displacement starts and ends at zero."""
    # The displacement is exp(-(t/γ)²) cos(2 π t/T), γ = 1.178 T^0.93. Where it reaches the ends of
    # the record it is brought to zero within a period of them.
    width = 1.178 * period**0.93
    first = max(int((centre - WAVELET_HALF_LENGTH * width) / dt), 0)
    last = min(int((centre + WAVELET_HALF_LENGTH * width) / dt) + 2, count)
    time = np.arange(first, last) * dt - centre
    moved = np.exp(-((time / width) ** 2)) * np.cos(2.0 * np.pi * time / period)
    ramp = np.clip((np.arange(last - first) - 1.0) / max(period / dt, 2.0), 0.0, 1.0)
    ramp = ramp**2 * (3.0 - 2.0 * ramp)
    wave = np.zeros(count)
    wave[first + 1 : last - 1] = np.diff(moved * ramp * ramp[::-1], 2)
    return wave / np.abs(wave).max()


def _impulse_response(
    period: float, time: float, damping: float, *, dt: float, count: int
) -> Array:
    """Return the response of an oscillator at a time to a unit acceleration at each sample."""
    if period == 0.0:
        return np.equal(np.arange(count), round(time / dt)).astype(float)
    omega = 2.0 * np.pi / period
    damped = omega * np.sqrt(1.0 - damping**2)
    ago = time - np.arange(min(int(time / dt) + 1, count)) * dt
    memory = np.zeros(count)
    fading = np.exp(-damping * omega * ago) * np.sin(damped * ago)
    memory[: len(ago)] = omega**2 / damped * dt * fading
    return memory


def _peak_lag(period: float, damping: float) -> float:
    """Return the time from a wavelet's centre to the peak of its oscillator [s]."""
    if period == 0.0:
        return 0.0
    dt = period / 100.0
    centre = WAVELET_HALF_LENGTH * 1.178 * period**0.93
    count = int(2.0 * centre / dt)
    wave = _build_wavelet(period, centre, dt, count)
    response = response_spectra.oscillator_displacement(wave, dt, period, damping)
    return float(np.argmax(np.abs(response)) * dt - centre)


def _relative_misfit(spectrum: Array, target: Array) -> float:
    """Compute the root mean square of spectrum/target - 1 [-]."""
    return float(np.sqrt(np.mean((spectrum / target - 1.0) ** 2)))
