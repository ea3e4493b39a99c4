"""Artificial accelerograms from a seed: filtered white noise under an envelope."""

import numpy as np

from archfem.signals import baseline_corrected

# Firm ground; the vertical is richer in high frequencies (Clough, Penzien, section 28-5).
_GROUND = {"horizontal": (15.0, 0.6), "vertical": (25.0, 0.6)}  # rad/s, damping ratio


def enveloped_noise(
    count: int, dt: float, *, random: np.random.Generator, component: str = "horizontal"
) -> np.ndarray:
    """Make one component of an artificial accelerogram, with a peak of 1.

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
    return samples / np.abs(samples).max()


def envelope(count: int) -> np.ndarray:
    """Return the intensity in time (count,) [-]: parabolic rise, plateau of 1, exponential fade."""
    time = np.linspace(0.0, 1.0, count)
    fade = np.exp(-5.0 * np.maximum(time - 0.5, 0.0))
    return np.minimum(time / 0.15, 1.0) ** 2 * fade


def _kanai_tajimi(ratio: np.ndarray, damping: float) -> np.ndarray:
    """Return the transfer function of the ground, over frequency by the ground's."""
    return (1.0 + 2.0j * damping * ratio) / (1.0 - ratio**2 + 2.0j * damping * ratio)


def _high_pass(ratio: np.ndarray, damping: float) -> np.ndarray:
    """Return Clough and Penzien's second filter, which leaves no energy at frequency zero."""
    return -(ratio**2) / (1.0 - ratio**2 + 2.0j * damping * ratio)
