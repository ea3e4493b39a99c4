"""Artificial accelerograms: filtered white noise under an intensity envelope."""

import numpy as np

from archfem._typing import Array
from archfem._validation import check_integer, check_number, count_pieces
from archfem.errors import InvalidInput
from archfem.motion.signal_processing import MAX_SAMPLES, correct_baseline


def generate_accelerogram(
    duration: float, dt: float, *, pga: float, ratio: float, seed: int
) -> tuple[Array, Array | None]:
    """Generate a horizontal and a vertical component (n,) [m/s²] of an artificial accelerogram."""
    settings = {
        "duration [s]": duration,
        "dt [s]": dt,
        "pga [m/s²]": pga,
        "vertical_ratio [-]": ratio,
    }
    for key, value in settings.items():
        check_number(value, f"synthetic motion, {key}")
    if not (duration >= 50 * dt > 0.0 and pga > 0.0 and ratio >= 0.0):
        raise InvalidInput(
            f"synthetic motion of {duration:g} s at {dt:g} s, pga {pga:g} m/s², vertical ratio "
            f"{ratio:g}: expected 50 samples or more, pga > 0 and ratio >= 0"
        )
    count_pieces(duration, dt, "samples of a synthetic motion", MAX_SAMPLES)
    random = np.random.default_rng(check_integer(seed, "seed of a synthetic motion", minimum=0))
    count = round(duration / dt) + 1
    level = pga * generate_enveloped_noise(count, dt, random=random)
    if not ratio:
        return level, None
    upright = generate_enveloped_noise(count, dt, random=random, component="vertical")
    return level, ratio * pga * upright


def generate_enveloped_noise(
    count: int, dt: float, *, random: np.random.Generator, component: str = "horizontal"
) -> Array:
    """Generate one component of an artificial accelerogram with a peak of 1.

    White noise is given the Kanai-Tajimi spectrum with Clough and Penzien's high-pass at a tenth of
    the ground's frequency, grows over 15 % of the duration, stays for 35 % and fades exponentially
    (Jennings, Housner and Tsai). The corrected baseline ends at zero velocity and displacement.

    References:
        Clough, Penzien, Dynamics of structures (1993). Jennings, Housner, Tsai, Simulated
        earthquake motions, EERL (1968).
    """
    # frequency [rad/s] and damping ratio of firm ground (Clough, Penzien, section 28-5)
    ground, damping = (25.0 if component == "vertical" else 15.0), 0.6
    omega = 2.0 * np.pi * np.fft.rfftfreq(2 * count, dt)
    # transfer function of the ground, and a filter that leaves no energy at frequency zero
    low, high = omega / ground, omega / (0.1 * ground)
    kanai_tajimi = (1.0 + 2.0j * damping * low) / (1.0 - low**2 + 2.0j * damping * low)
    shape = kanai_tajimi * (-(high**2) / (1.0 - high**2 + 2.0j * damping * high))
    noise = np.fft.irfft(np.fft.rfft(random.standard_normal(2 * count)) * shape)[:count]
    samples = correct_baseline(noise * intensity_envelope(count), dt)
    return samples / np.abs(samples).max()


def intensity_envelope(count: int) -> Array:
    """Return the intensity in time (count,) [-]: parabolic rise, plateau of 1, exponential fade."""
    time = np.linspace(0.0, 1.0, count)
    return np.minimum(time / 0.15, 1.0) ** 2 * np.exp(-5.0 * np.maximum(time - 0.5, 0.0))
