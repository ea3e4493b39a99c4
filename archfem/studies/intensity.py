"""Intensity measures of a motion as incremental dynamic analysis scales it."""

from collections.abc import Mapping

import numpy as np

from archfem.arrays import Array
from archfem.motion import signals
from archfem.motion.motion import Motion
from archfem.motion.spectra import response_spectrum

MEASURES: Mapping[str, tuple[str, str, int]] = {
    "pga": ("peak ground acceleration", "m/s²", 1),
    "pgv": ("peak ground velocity", "m/s", 1),
    "sa": ("spectral acceleration at the first mode, 5 %", "m/s²", 1),
    "arias": ("Arias intensity", "m/s", 2),
}
"""By name what each is, its unit, and the power of a scale on the motion with which it grows."""


def intensities(motion: Motion, period: float) -> dict[str, float]:
    """Return the measures of the horizontal component of a motion.

    Args:
        motion: of the ground.
        period: of the first mode [s].

    Returns:
        By name of `MEASURES`.
    """
    samples = motion.component("horizontal")
    return {
        "pga": float(np.abs(samples).max()),
        "pgv": float(np.abs(motion.velocity("horizontal")).max()),
        "sa": float(response_spectrum(motion, np.array([period]))[0]),
        "arias": float(signals.arias(samples, motion.dt)[-1]),
    }


def scaled_intensity(measure: str, whole: Array, scale: Array) -> Array:
    """Return a measure of motions that are multiplied by scales.

    Args:
        measure: one of `MEASURES`.
        whole: of the motions as they are.
        scale: factors on them [-].
    """
    power = MEASURES[measure][2]
    found: Array = whole * scale**power
    return found
