"""Response spectra of motions, and scaling to them."""

import numpy as np

from archfem.arguments import instance, said, unmasked
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.motion import oscillator
from archfem.motion.motion import Motion


def response_spectrum(
    motion: Motion,
    periods: float | Array,
    damping: float = 0.05,
    *,
    component: str = "horizontal",
) -> Array:
    """Return the pseudo-acceleration spectrum of one component: ω² times the largest displacement.

    Solved exactly for an acceleration that runs straight between samples; the record is
    interpolated until period / step >= 40, and peaks between the samples are found by a parabola.
    The oscillators are followed to the end of the record.

    Args:
        motion: the ground motion.
        periods: natural periods (n,) [s]; at zero the spectrum is the peak ground acceleration.
        damping: ratio to the critical [-].
        component: horizontal, vertical or transverse.

    Returns:
        Pseudo-accelerations in the shape of the periods [m/s²].

    Raises:
        InvalidInput: a negative period, a damping out of range, or a component there is not.

    References:
        Nigam, Jennings, Calculation of response spectra from strong-motion earthquake records,
        BSSA 59 (1969). Chopra, Dynamics of structures, section 6.6.

    Example:
        >>> motion = af.Motion.synthetic(duration=4.0, pga=3.0, seed=1)
        >>> round(float(af.response_spectrum(motion, 0.0)), 6)
        3.0
    """
    instance(motion, Motion, "motion", "give a Motion, e.g. Motion.read(path)")
    unmasked(periods, "periods [s]")
    try:
        natural = np.asarray(periods, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"periods {said(periods)} s are no numbers") from error
    samples = motion.component(component)
    peaks = oscillator.peak_responses(samples, motion.dt, natural.ravel(), damping)[0]
    spectrum: Array = np.abs(peaks)
    return spectrum.reshape(natural.shape)


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
