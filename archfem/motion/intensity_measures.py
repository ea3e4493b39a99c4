"""Intensity measures of a motion."""

from dataclasses import dataclass

import numpy as np
from scipy import integrate

from archfem.motion import signal_processing
from archfem.motion.motion import Motion
from archfem.motion.response_spectra import response_spectrum


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
    moves = bool(np.any(samples))
    start, end = (
        signal_processing.find_significant_window(samples, motion.dt) if moves else (0.0, 0.0)
    )
    return IntensityMeasures(
        pga=float(np.abs(samples).max()),
        pgv=float(np.abs(motion.velocity(component)).max()),
        pgd=float(np.abs(motion.displacement(component)).max()),
        arias=float(signal_processing.integrate_arias(samples, motion.dt)[-1]),
        cav=float(integrate.trapezoid(np.abs(samples), dx=motion.dt)),
        housner=float(integrate.trapezoid(spectrum * periods / (2.0 * np.pi), periods)),
        significant_duration=end - start,
        duration=(len(samples) - 1) * motion.dt,
    )
