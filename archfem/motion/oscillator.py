"""A damped oscillator under a ground acceleration that runs straight from sample to sample."""

import numpy as np
import scipy  # loads scipy.signal, which is slow, when it is first used
from scipy import linalg

from archfem.arguments import real
from archfem.arrays import Array
from archfem.errors import InvalidInput

SAMPLES_PER_PERIOD = 40
"""The record is interpolated until an oscillation has this many samples."""

RIGID = 1e-9
"""Period, in steps of the record, up to which an oscillator has the acceleration of the ground."""

_FINEST = 1000  # parts of a step; an oscillator still stiffer follows the ground


def peak_responses(
    samples: Array, dt: float, periods: Array, damping: float
) -> tuple[Array, Array]:
    """Find the largest pseudo-acceleration of oscillators at rest at first, and when it occurs.

    u'' + 2 ζ ω u' + ω² u = -a is solved exactly from sample to sample (Nigam and Jennings). The
    record is interpolated to 40 samples a period, and the peak is that of a parabola through the
    largest sample and its neighbours. What follows the end of the record is not looked at.

    Args:
        samples: ground accelerations (n,) [m/s²].
        dt: time between samples [s].
        periods: natural periods (m,) [s]; zero is a rigid oscillator.
        damping: ratio to the critical [-], from 0 to below 1.

    Returns:
        -ω² u at the largest |u|, with its sign (m,) [m/s²], and its times (m,) [s].

    Raises:
        InvalidInput: a period is negative, or the damping is out of range.

    References:
        Nigam, Jennings, Calculation of response spectra from strong-motion earthquake records,
        BSSA 59 (1969).
    """
    check(periods, damping)
    values, times = np.empty(len(periods)), np.empty(len(periods))
    finer: dict[int, Array] = {1: samples}
    for index, period in enumerate(periods):
        if period <= RIGID * dt:
            largest = int(np.argmax(np.abs(samples)))
            values[index], times[index] = samples[largest], largest * dt
            continue
        parts = min(int(np.ceil(SAMPLES_PER_PERIOD * dt / period - 1e-9)), _FINEST)
        parts = max(parts, 1)
        if parts not in finer:
            finer[parts] = interpolated(samples, parts)
        moved = displacement(finer[parts], dt / parts, period, damping)
        peak, at = _parabola_peak(moved)
        values[index], times[index] = -((2.0 * np.pi / period) ** 2) * peak, at * dt / parts
    return values, times


def displacement(samples: Array, dt: float, period: float, damping: float) -> Array:
    """Return the relative displacement of one oscillator (n,) [m], exact for straight samples.

    The step from (u, v) to the next is a matrix exponential; without v it is the recurrence
    u₂ - tr A u₁ + det A u₀ = b₀ a₂ + b₁ a₁ + b₂ a₀, a digital filter.

    Args:
        samples: ground accelerations (n,) [m/s²].
        dt: time between samples [s].
        period: natural period [s], not zero.
        damping: ratio to the critical [-].
    """
    omega = 2.0 * np.pi / period
    # States u, v, and the input with its slope: a' = s, s' = 0.
    rates = np.zeros((4, 4))
    rates[0, 1], rates[2, 3] = 1.0, 1.0
    rates[1, :3] = -(omega**2), -2.0 * damping * omega, -1.0
    step = linalg.expm(rates * dt)
    later = step[:2, 3] / dt
    now = step[:2, 2] - later
    numerator = np.array(
        [
            later[0],
            now[0] - step[1, 1] * later[0] + step[0, 1] * later[1],
            step[0, 1] * now[1] - step[1, 1] * now[0],
        ]
    )
    trace = step[0, 0] + step[1, 1]
    determinant = step[0, 0] * step[1, 1] - step[0, 1] * step[1, 0]
    # At rest at the first sample, whatever the acceleration there.
    rest = samples[0] * np.array([-numerator[0], now[0] - numerator[1]])
    denominator = [1.0, -trace, determinant]
    moved: Array = scipy.signal.lfilter(numerator, denominator, samples, zi=rest)[0]
    return moved


def interpolated(samples: Array, parts: int) -> Array:
    """Return the samples with every step divided into parts, by straight lines.

    Args:
        samples: values (n,).
        parts: how many parts a step gets.
    """
    fine = np.arange((len(samples) - 1) * parts + 1) / parts
    return np.interp(fine, np.arange(len(samples)), samples)


def check(periods: Array, damping: float) -> None:
    """Refuse periods and damping ratios no oscillator has.

    Args:
        periods: natural periods, of any shape [s].
        damping: ratio to the critical [-].

    Raises:
        InvalidInput: a period is negative or not finite, or the damping not from 0 to below 1.
    """
    if not (np.all(np.isfinite(periods)) and np.all(np.asarray(periods) >= 0.0)):
        raise InvalidInput("periods of a spectrum: expected finite values from 0 s upwards")
    if not 0.0 <= real(damping, "damping ratio [-]") < 1.0:
        raise InvalidInput(f"damping ratio {damping!r}: expected from 0 to below 1 (5 % is 0.05)")


def _parabola_peak(row: Array) -> tuple[float, float]:
    """Return the extreme value of a smooth row and its place, between the samples."""
    top = int(np.argmax(np.abs(row)))
    if top in (0, len(row) - 1):
        return float(row[top]), float(top)
    before, here, after = row[top - 1 : top + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend else 0.0
    return float(here - 0.25 * (before - after) * shift), top + float(shift)
