"""Response spectra and intensity measures of motions.

Spectra are those of damped oscillators under a piecewise linear ground acceleration.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy  # loads scipy.signal and scipy.spatial, which are slow, when first used
from scipy import integrate, linalg

from archfem._typing import Array
from archfem._validation import (
    check_between,
    check_number,
    check_type,
    check_unmasked,
    short_repr,
    validate_arguments,
)
from archfem.errors import InvalidInput
from archfem.motion import signal_processing
from archfem.motion.motion import Motion


def find_peak_responses(
    samples: Array, dt: float, periods: Array, damping: float
) -> tuple[Array, Array]:
    """Find the largest pseudo-acceleration of oscillators at rest at first, and when it occurs."""
    # u'' + 2 ζ ω u' + ω² u = -a is solved exactly from sample to sample. The record is interpolated
    # to 40 samples a period. The peak is that of a parabola through the largest sample and its
    # neighbours, or of the free vibration after the last sample.
    check_oscillators(periods, damping)
    values, times = np.empty(len(periods)), np.empty(len(periods))
    finer: dict[int, Array] = {1: samples}
    for index, period in enumerate(periods):
        if period <= 1e-9 * dt:  # such an oscillator has the acceleration of the ground
            largest = int(np.argmax(np.abs(samples)))
            values[index], times[index] = samples[largest], largest * dt
            continue
        parts = _count_parts(dt, period)
        if parts not in finer:
            finer[parts] = interpolate_steps(samples, parts)
        ground, step = finer[parts], dt / parts
        moved = oscillator_displacement(ground, step, period, damping)
        peak, at = _find_parabola_peak(moved)
        later, delay = _find_free_peak(moved[-2:], ground[-2:], step, period, damping)
        if abs(later) > abs(peak):
            peak, at = float(later), len(moved) - 1 + float(delay) / step
        values[index], times[index] = -((2.0 * np.pi / period) ** 2) * peak, at * step
    return values, times


def _find_free_peak(
    moved: Array, ground: Array, dt: float, period: float, damping: float
) -> tuple[Array, Array]:
    """Find the first extreme of free vibrations after the last two samples, and its delay [s]."""
    now, step = moved[..., -1], 2.0 * np.pi / period * dt
    # the filter needs a state of two samples; a stiff oscillator follows the ground to its end
    if moved.shape[-1] < 2 or step > 1.0:
        return now, np.zeros_like(now)
    numerator, (_, trace, determinant), at_rest = _oscillator_filter(dt, period, damping)
    # the next sample of the recurrence, where the ground jumps to rest at the last one
    after = numerator[2] * ground[..., 0] - at_rest[1] * ground[..., 1]
    after -= trace * now + determinant * moved[..., 0]
    # u = exp(-ζ ω t) (u₀ cos ω_d t + s sin ω_d t)
    fade, turn = damping * step, np.sqrt(1.0 - damping**2) * step
    sine = (after * np.exp(fade) - now * np.cos(turn)) / np.sin(turn)
    steps = np.arctan2(turn * sine - fade * now, turn * now + fade * sine) % np.pi / turn
    peak = now * np.cos(turn * steps) + sine * np.sin(turn * steps)
    return np.exp(-fade * steps) * peak, steps * dt


def _count_parts(dt: float, period: float) -> int:
    """Return the parts of a step that make 40 samples a period."""
    # above 1000 parts of a step the oscillator follows the ground
    return min(max(int(np.ceil(40 * dt / period - 1e-9)), 1), 1000)


def oscillator_displacement(samples: Array, dt: float, period: float, damping: float) -> Array:
    """Return the relative displacement of one oscillator (n,) [m], exact for straight samples."""
    numerator, denominator, at_rest = _oscillator_filter(float(dt), float(period), float(damping))
    return scipy.signal.lfilter(numerator, denominator, samples, zi=samples[0] * at_rest)[0]


@lru_cache(maxsize=4096)  # records of a folder share their steps
def _oscillator_filter(dt: float, period: float, damping: float) -> tuple[Array, Array, Array]:
    """Return numerator, denominator and initial state of the digital filter of an oscillator."""
    # The step from (u, v) to the next is a matrix exponential; without v it is the recurrence
    # u₂ - tr A u₁ + det A u₀ = b₀ a₂ + b₁ a₁ + b₂ a₀.
    omega = 2.0 * np.pi / period
    # States u, v, and the input with its slope: a' = s, s' = 0.
    rates = np.zeros((4, 4))
    rates[0, 1], rates[2, 3] = 1.0, 1.0
    rates[1, :3] = -(omega**2), -2.0 * damping * omega, -1.0
    step = linalg.expm(rates * dt)
    later = step[:2, 3] / dt
    now = step[:2, 2] - later
    middle = now[0] - step[1, 1] * later[0] + step[0, 1] * later[1]
    numerator = np.array([later[0], middle, step[0, 1] * now[1] - step[1, 1] * now[0]])
    trace = step[0, 0] + step[1, 1]
    determinant = step[0, 0] * step[1, 1] - step[0, 1] * step[1, 0]
    # the oscillator is at rest at the first sample, at any acceleration there
    at_rest = np.array([-numerator[0], now[0] - numerator[1]])
    return numerator, np.array([1.0, -trace, determinant]), at_rest


def interpolate_steps(samples: Array, parts: int) -> Array:
    """Divide every step into parts by linear interpolation."""
    fine = np.arange((len(samples) - 1) * parts + 1) / parts
    return np.interp(fine, np.arange(len(samples)), samples)


def as_periods(periods: float | Array) -> Array:
    """Return natural periods as an array of numbers."""
    try:
        return np.asarray(periods, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"periods {short_repr(periods)} s are no numbers") from error


def check_oscillators(periods: Array, damping: float) -> None:
    """Refuse negative periods, and damping ratios outside 0 to 1."""
    if not (np.all(np.isfinite(periods)) and np.all(np.asarray(periods) >= 0.0)):
        raise InvalidInput("periods of a spectrum: expected finite values from 0 s upwards")
    check_between(damping, "damping ratio [-]", 0.0, 1.0, ends="[)", remedy="5 % is 0.05")


def _find_parabola_peak(row: Array) -> tuple[float, float]:
    """Return the extreme value of a smooth row and its place, between the samples."""
    top = int(np.argmax(np.abs(row)))
    if top in (0, len(row) - 1):
        return float(row[top]), float(top)
    before, here, after = row[top - 1 : top + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend else 0.0
    return float(here - 0.25 * (before - after) * shift), top + float(shift)


def response_spectrum(
    motion: Motion, periods: float | Array, damping: float = 0.05, *, component: str = "horizontal"
) -> Array:
    """Return the pseudo-acceleration spectrum of one component: ω² times the largest displacement.

    Solved exactly for an acceleration that runs straight between samples; the record is
    interpolated until period / step >= 40, and peaks between the samples are found by a parabola.
    After the last sample the ground is at rest, and the free vibration counts.

    Args:
        motion: the ground motion.
        periods: natural periods (n,) [s]; at zero the spectrum is the peak ground acceleration.
        damping: ratio to the critical [-].
        component: horizontal, vertical or transverse.

    Returns:
        Pseudo-accelerations in the shape of the periods [m/s²].

    Raises:
        InvalidInput: a negative period, a damping out of range, or a missing component.

    References:
        Nigam, Jennings, Calculation of response spectra from strong-motion earthquake records,
        BSSA 59 (1969). Chopra, Dynamics of structures, section 6.6.

    Example:
        >>> motion = af.Motion.synthetic(duration=4.0, pga=3.0, seed=1)
        >>> round(float(af.response_spectrum(motion, 0.0)), 6)
        3.0
    """
    check_type(
        motion, Motion, "motion", "give a Motion, e.g. Motion.read(path), or .motion of a Match"
    )
    check_unmasked(periods, "periods [s]")
    natural = as_periods(periods)
    samples = motion.component(component)
    peaks = find_peak_responses(samples, motion.dt, natural.ravel(), damping)[0]
    return np.abs(peaks).reshape(natural.shape)


@validate_arguments
def rotated_spectrum(
    motion: Motion, periods: float | Array, percentile: float = 50.0, damping: float = 0.05
) -> Array:
    """Return a percentile of the pseudo-acceleration spectra over all horizontal directions.

    The response of a pair of components is u(θ) = cos θ u₁ + sin θ u₂. Its largest value over time
    is that of `response_spectrum`, for θ = 0, 1, … 179°. The percentile is that over the
    directions, at each period by itself.

    Args:
        motion: ground motion with a transverse component.
        periods: natural periods (n,) [s]; at zero the values are peak ground accelerations.
        percentile: 50 for RotD50, 100 for RotD100.
        damping: ratio to the critical [-].

    Returns:
        Pseudo-accelerations in the shape of the periods [m/s²].

    Raises:
        InvalidInput: there is no transverse, a percentile outside 0 to 100, a negative period, or a
            damping out of range.

    References:
        Boore, Orientation-independent, nongeometric-mean measures of seismic intensity from two
        horizontal components of motion, BSSA 100 (2010).
    """
    check_number(percentile, "percentile of directions", minimum=0.0, maximum=100.0)
    natural = as_periods(periods)
    check_oscillators(natural, damping)
    # an angle of zero fills the shorter component with zeros
    across = motion.component("transverse")
    pair = signal_processing.rotate_components(motion.horizontal, across, 0.0)
    values = [
        np.percentile(_peaks_by_direction(pair, motion.dt, period, damping), percentile)
        for period in natural.ravel()
    ]
    return np.reshape(values, natural.shape)


def _peaks_by_direction(
    pair: tuple[Array, Array], dt: float, period: float, damping: float
) -> Array:
    """Return the largest pseudo-accelerations of a pair in directions 1° apart (180,) [m/s²]."""
    angles = np.radians(np.arange(180.0))
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    if period <= 1e-9 * dt:  # such an oscillator has the acceleration of the ground
        return np.abs(directions @ np.array(pair)).max(axis=1)
    parts = _count_parts(dt, period)
    fine = [interpolate_steps(samples, parts) for samples in pair]
    moved = np.array([oscillator_displacement(row, dt / parts, period, damping) for row in fine])
    try:
        extreme = scipy.spatial.ConvexHull(moved.T).vertices
    except scipy.spatial.QhullError:  # a path along a line, or of less than three samples
        extreme = np.arange(moved.shape[1])
    tops = extreme[np.argmax(np.abs(directions @ moved[:, extreme]), axis=1)]
    # the parabola through the largest sample and its neighbours, for all directions at once
    around = np.clip(tops[:, None] + np.array([-1, 0, 1]), 0, moved.shape[1] - 1)
    before, here, after = np.einsum("dc,cdk->kd", directions, moved[:, around])
    bend = before - 2.0 * here + after
    inside = (bend != 0.0) & (tops > 0) & (tops < moved.shape[1] - 1)
    peaks = here - np.divide((before - after) ** 2, 8.0 * bend, out=0.0 * here, where=inside)
    ends = (directions @ moved[:, -2:], directions @ np.array(fine)[:, -2:])
    later = _find_free_peak(*ends, dt / parts, period, damping)[0]
    return (2.0 * np.pi / period) ** 2 * np.maximum(np.abs(peaks), np.abs(later))


@validate_arguments
def scaled_to_spectrum(
    motion: Motion, value: float, period: float, *, damping: float = 0.05
) -> Motion:
    """Return the motion scaled so that its horizontal spectrum has a value at a period.

    Args:
        motion: the motion; the one factor acts on all its components.
        value: pseudo-acceleration to reach [m/s²].
        period: natural period at which it is reached [s].
        damping: ratio to the critical [-].

    Raises:
        InvalidInput: the motion is at rest, the value is not positive, or no oscillator has such a
            period or damping.
    """
    now = float(response_spectrum(motion, period, damping))
    if now == 0.0 or not value > 0.0:
        raise InvalidInput(
            f"scaling a spectral acceleration of {now:g} to {value:g} m/s²: both must be > 0"
        )
    return motion.scaled(value / now)


@dataclass(frozen=True)
class IntensityMeasures:
    """Intensity measures of one component of a motion."""

    pga: float  # peak ground acceleration [m/s²]
    pgv: float  # peak ground velocity [m/s]
    pgd: float  # peak ground displacement [m]
    arias: float  # Arias intensity π/(2 g) ∫ a² dt [m/s]
    cav: float  # cumulative absolute velocity ∫ |a| dt [m/s]
    # Housner intensity, the pseudo-velocity spectrum (5 %) summed from 0.1 to 2.5 s [m]
    housner: float
    significant_duration: float  # from 5 to 95 % of Arias intensity [s]
    duration: float  # of the component [s]


def measure_intensity(motion: Motion, component: str = "horizontal") -> IntensityMeasures:
    """Compute the intensity measures of a component; velocity and displacement include drift.

    References:
        Arias, A measure of earthquake intensity (1970). Housner, Spectrum intensities of
        strong-motion earthquakes (1952). EPRI NP-5930 (1988) for the cumulative absolute velocity.
    """
    samples = motion.component(component)
    periods = np.linspace(0.1, 2.5, 97)
    spectrum = response_spectrum(motion, periods, component=component)
    # ground that rests behind the record does not drift on
    moved = motion.displacement(component)[: len(np.trim_zeros(samples, "b"))]
    start = end = 0.0
    if np.any(samples):
        start, end = signal_processing.find_significant_window(samples, motion.dt)
    return IntensityMeasures(
        pga=float(np.abs(samples).max()),
        pgv=float(np.abs(motion.velocity(component)).max()),
        pgd=float(np.abs(moved).max(initial=0.0)),
        arias=float(signal_processing.integrate_arias(samples, motion.dt)[-1]),
        cav=float(integrate.trapezoid(np.abs(samples), dx=motion.dt)),
        housner=float(integrate.trapezoid(spectrum * periods / (2.0 * np.pi), periods)),
        significant_duration=end - start,
        duration=(len(samples) - 1) * motion.dt,
    )
