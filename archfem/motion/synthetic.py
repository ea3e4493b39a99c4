"""Artificial accelerograms from a seed: filtered white noise under an envelope."""

import numpy as np
from numpy.typing import NDArray

from archfem.arguments import pieces, real, whole
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.motion.signals import MOST_SAMPLES, baseline_corrected

# Firm ground; the vertical is richer in high frequencies (Clough, Penzien, section 28-5).
_GROUND = {"horizontal": (15.0, 0.6), "vertical": (25.0, 0.6)}  # rad/s, damping ratio


def accelerogram(
    duration: float, dt: float, *, pga: float, ratio: float, seed: int
) -> tuple[Array, Array | None]:
    """Return a horizontal and a vertical component (n,) [m/s²] of one artificial accelerogram.

    Args:
        duration: time of the last sample [s].
        dt: time between samples [s].
        pga: horizontal peak [m/s²].
        ratio: vertical peak by horizontal peak [-]; 0 gives None for the vertical.
        seed: the same seed gives the same components.

    Raises:
        InvalidInput: fewer than 50 samples, or pga, ratio or seed out of range.
    """
    given = {"duration [s]": duration, "dt [s]": dt, "pga [m/s²]": pga, "vertical_ratio [-]": ratio}
    for key, value in given.items():
        real(value, f"synthetic motion, {key}")
    if not (duration >= 50 * dt > 0.0 and pga > 0.0 and ratio >= 0.0):
        raise InvalidInput(
            f"synthetic motion of {duration:g} s at {dt:g} s, pga {pga:g} m/s², vertical ratio "
            f"{ratio:g}: expected 50 samples or more, pga > 0 and ratio >= 0"
        )
    pieces(duration, dt, "samples of a synthetic motion", MOST_SAMPLES)
    random = np.random.default_rng(whole(seed, "seed of a synthetic motion", least=0))
    count = round(duration / dt) + 1
    level = pga * enveloped_noise(count, dt, random=random)
    if not ratio:
        return level, None
    upright = enveloped_noise(count, dt, random=random, component="vertical")
    return level, ratio * pga * upright


def enveloped_noise(
    count: int, dt: float, *, random: np.random.Generator, component: str = "horizontal"
) -> Array:
    """Return one component of an artificial accelerogram, with a peak of 1.

    White noise is given the Kanai-Tajimi spectrum with Clough and Penzien's high-pass at a tenth of
    the ground's frequency, grows over 15 % of the duration, stays for 35 % and fades exponentially
    (Jennings, Housner and Tsai). The base line is corrected: it ends at rest where it began.

    Args:
        count: number of samples.
        dt: time between samples [s].
        random: generator of the noise.
        component: horizontal or vertical.

    Returns:
        Accelerations (count,) [-], the largest of which is 1 in size.

    References:
        Clough, Penzien, Dynamics of structures (1993). Jennings, Housner, Tsai, Simulated
        earthquake motions, EERL (1968).
    """
    ground, damping = _GROUND[component]
    omega = 2.0 * np.pi * np.fft.rfftfreq(2 * count, dt)
    shape = _kanai_tajimi(omega / ground, damping) * _high_pass(omega / (0.1 * ground), damping)
    noise = np.fft.irfft(np.fft.rfft(random.standard_normal(2 * count)) * shape)[:count]
    samples = baseline_corrected(noise * envelope(count), dt)
    largest: float = np.abs(samples).max()
    return samples / largest


def envelope(count: int) -> Array:
    """Return the intensity in time (count,) [-]: parabolic rise, plateau of 1, exponential fade.

    Args:
        count: number of samples.
    """
    time = np.linspace(0.0, 1.0, count)
    fade: Array = np.exp(-5.0 * np.maximum(time - 0.5, 0.0))
    return np.minimum(time / 0.15, 1.0) ** 2 * fade


def _kanai_tajimi(ratio: Array, damping: float) -> NDArray[np.complex128]:
    """Return the transfer function of the ground, over frequency by the ground's."""
    return (1.0 + 2.0j * damping * ratio) / (1.0 - ratio**2 + 2.0j * damping * ratio)


def _high_pass(ratio: Array, damping: float) -> NDArray[np.complex128]:
    """Return Clough and Penzien's second filter, which leaves no energy at frequency zero."""
    below: NDArray[np.complex128] = 1.0 - ratio**2 + 2.0j * damping * ratio
    return -(ratio**2) / below
