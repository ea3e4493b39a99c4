"""Intensity measures of a motion."""

from dataclasses import dataclass

import numpy as np
from scipy import integrate

from archfem.motion import signals
from archfem.motion.motion import Motion
from archfem.motion.spectra import response_spectrum


@dataclass(frozen=True)
class Measures:
    """How strong one component of a motion is.

    Args:
        pga: peak ground acceleration [m/s²].
        pgv: peak ground velocity [m/s].
        pgd: peak ground displacement [m].
        arias: Arias intensity π/(2 g) ∫ a² dt [m/s].
        cav: cumulative absolute velocity ∫ |a| dt [m/s].
        housner: Housner intensity, the pseudo-velocity spectrum (5 %) summed from 0.1 to 2.5 s [m].
        significant_duration: from 5 to 95 % of Arias intensity [s].
        duration: of the component [s].
    """

    pga: float
    pgv: float
    pgd: float
    arias: float
    cav: float
    housner: float
    significant_duration: float
    duration: float


def measures(motion: Motion, component: str = "horizontal") -> Measures:
    """Return how strong a component is; velocity and displacement as integrated, drift included.

    Args:
        motion: the ground motion.
        component: horizontal, vertical or transverse.

    Raises:
        InvalidInput: there is no such component.

    References:
        Arias, A measure of earthquake intensity (1970). Housner, Spectrum intensities of
        strong-motion earthquakes (1952). EPRI NP-5930 (1988) for the cumulative absolute velocity.
    """
    samples = motion.component(component)
    periods = np.linspace(0.1, 2.5, 97)
    spectrum = response_spectrum(motion, periods, component=component)
    moves = bool(np.any(samples))
    start, end = signals.significant_window(samples, motion.dt) if moves else (0.0, 0.0)
    return Measures(
        pga=float(np.abs(samples).max()),
        pgv=float(np.abs(motion.velocity(component)).max()),
        pgd=float(np.abs(motion.displacement(component)).max()),
        arias=float(signals.arias(samples, motion.dt)[-1]),
        cav=float(integrate.trapezoid(np.abs(samples), dx=motion.dt)),
        housner=float(integrate.trapezoid(spectrum * periods / (2.0 * np.pi), periods)),
        significant_duration=end - start,
        duration=(len(samples) - 1) * motion.dt,
    )
