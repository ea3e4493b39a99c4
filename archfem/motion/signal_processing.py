"""Sampled accelerations: integration, filters, baseline, resampling, energy, synthetic noise."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy  # loads its modules, which are slow, when they are first used
from scipy import integrate

from archfem._typing import Array
from archfem._validation import (
    check_integer,
    check_number,
    check_unmasked,
    count_pieces,
    short_repr,
)
from archfem.errors import InvalidInput
from archfem.units import STANDARD_GRAVITY, warn_if_in_g

# No record exceeds this acceleration [m/s²]: the unit must be wrong.
MAX_PEAK_ACCELERATION = 5.0 * STANDARD_GRAVITY

# Memory limit: a day at 100 Hz
MAX_SAMPLES = 10_000_000

# Shares of its duration between which an artificial motion keeps its intensity [-]
PLATEAU = 0.15, 0.5


def validate_samples(samples: Array | None, component: str) -> Array:
    """Copy a component into a read-only array of finite numbers below 5 g."""
    check_unmasked(samples, f"{component} acceleration")
    try:
        is_complex = np.iscomplexobj(np.asarray(samples))
        row = np.array([] if is_complex else samples, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"{component} acceleration is not a row of numbers: {error}") from error
    if is_complex:  # a conversion would drop the imaginary part
        raise InvalidInput(f"{component} acceleration is complex: give its real samples")
    remedy = "give one row of finite numbers"
    if row.ndim != 1 or row.size == 0:
        raise InvalidInput(f"{component} acceleration of shape {row.shape}: {remedy}")
    if len(bad := np.flatnonzero(~np.isfinite(row))):
        raise InvalidInput(
            f"{component} acceleration has {len(bad)} of {row.size} samples that are not finite, "
            f"the first {row[bad[0]]} in place {bad[0]}: {remedy}"
        )
    peak = np.abs(row).max()
    if peak > MAX_PEAK_ACCELERATION:
        raise InvalidInput(
            f"{component} acceleration reaches {peak / STANDARD_GRAVITY:.3g} g, more than 5 g: "
            "that can only be a wrong unit (m/s² expected)"
        )
    row.setflags(write=False)
    return row


def integrate_velocity(samples: Array, dt: float) -> Array:
    """Integrate a piecewise linear acceleration, from rest (n,) [m/s]."""
    return integrate.cumulative_trapezoid(samples, dx=dt, initial=0.0)


def integrate_displacement(samples: Array, dt: float) -> Array:
    """Integrate a piecewise linear acceleration twice, from rest (n,) [m]."""
    # exact in each step: d₁ = d₀ + v₀ Δt + (2 a₀ + a₁) Δt²/6
    velocity = integrate_velocity(samples, dt)[:-1]
    steps = velocity * dt + (2.0 * samples[:-1] + samples[1:]) * dt**2 / 6.0
    return np.append(0.0, np.cumsum(steps))


def correct_baseline(samples: Array, dt: float, degree: int = 6) -> Array:
    """Correct the baseline of an acceleration: velocity and displacement end at zero.

    The polynomial p(t) = c₂ t² + ... of least squares distance to the displacement, among those
    that share its last value and slope, is subtracted as p'' from the acceleration. (Fitting the
    displacement is PEER's way; the two conditions at the end are added.)

    References:
        Chiou, Darragh, Gregor, Silva, NGA project strong-motion database, Earthquake Spectra 24
        (2008).
    """
    if degree < 3 or len(samples) <= degree:
        raise InvalidInput(
            f"base line of degree {degree} for {len(samples)} samples: the degree is at least 3 "
            "and less than the number of samples"
        )
    powers = np.arange(2, degree + 1)
    time = np.linspace(0.0, 1.0, len(samples))[:, None]
    length = (len(samples) - 1) * dt
    moved = integrate_displacement(samples, dt)
    # p'' is integrated by the same rule as the samples: the end is zero to round-off
    bends = powers * (powers - 1) * time ** (powers - 2) / length**2
    shapes = np.column_stack([integrate_displacement(bend, dt) for bend in bends.T])
    ends = np.array([[integrate_velocity(bend, dt)[-1] for bend in bends.T], shapes[-1]])
    goal = np.array([integrate_velocity(samples, dt)[-1], moved[-1]])
    # Equality constraints by null space: c = c_end + Z y.
    least = np.linalg.lstsq(ends, goal, rcond=None)[0]
    null = np.linalg.svd(ends)[2][2:].T
    free = np.linalg.lstsq(shapes @ null, moved - shapes @ least, rcond=None)[0]
    return samples - bends @ (least + null @ free)


def filter_band(samples: Array, dt: float, low: float, high: float, *, order: int = 4) -> Array:
    """Apply a zero-phase band-pass filter between two corner frequencies [Hz].

    A Butterworth filter runs forwards and backwards over the record, which is padded at both ends
    by 1.5 order/low seconds of zeros.

    References:
        Converse, Brady, BAP: basic strong-motion accelerogram processing, USGS OFR 92-296A (1992).
    """
    if not 0.0 < low < high < 0.5 / dt:
        raise InvalidInput(
            f"band from {low:g} to {high:g} Hz at a step of {dt:g} s: expected "
            f"0 < low < high < {0.5 / dt:g} Hz"
        )
    if order < 1:
        raise InvalidInput(f"filter of order {order!r}: expected 1 or more")
    count_pieces(1.5 * order / low, dt, "samples beside a filtered motion", MAX_SAMPLES)
    pad = int(np.ceil(1.5 * order / low / dt))
    filter_ = scipy.signal.butter(order, (low, high), "bandpass", fs=1.0 / dt, output="sos")
    return scipy.signal.sosfiltfilt(filter_, np.pad(samples, pad), padlen=0)[pad:-pad]


def resample(samples: Array, dt: float, new_dt: float) -> Array:
    """Resample so that the ground has the same displacement at every new sample, and its peaks.

    Straight lines between the new samples are the second derivative of a cubic spline through these
    displacements: the nearest of such lines by least squares, without the aliases of samples alone.
    """
    if not 0.0 < new_dt < np.inf:
        raise InvalidInput(f"dt {new_dt!r} s: the time between samples is a positive number")
    end = (len(samples) - 1) * dt
    count_pieces(end, new_dt, "samples of a motion", MAX_SAMPLES)
    if len(samples) == 1:
        return samples
    places = np.arange(max(int(np.ceil(end / new_dt - 1e-9)), 1) + 1) * float(new_dt)
    lines = scipy.interpolate.make_interp_spline(np.arange(len(samples)) * dt, samples, k=1)
    velocity = lines.antiderivative()
    # the ground moves on evenly from the last sample to the first new one behind it
    within, last = np.minimum(places, end), float(velocity(end))
    moved = velocity.antiderivative()(within) + last * (places - within)
    new = scipy.interpolate.CubicSpline(places, moved, bc_type=((1, 0.0), (1, last)))(places, 2)
    # the largest peak both ways, the larger one last, is kept at the nearest new sample, and no
    # other exceeds it; halves taken from both neighbours keep velocity and displacement behind it
    peaks = np.array(sorted((samples.argmin(), samples.argmax()), key=lambda k: abs(samples[k])))
    nearest = np.minimum(np.rint(peaks * dt / new_dt).astype(int), len(new) - 1)
    for _ in range(30):  # what two neighbours exchange halves in each
        kept = np.clip(new, min(samples.min(), 0.0), max(samples.max(), 0.0))
        kept[nearest] = samples[peaks]
        new += np.convolve(kept - new, [-0.5, 1.0, -0.5])[1:-1]
    return kept


def align_starts(rows: Mapping[str, tuple[Array, float | None]], dt: float) -> dict[str, Any]:
    """Return components, given with their starts [s], with zeros in front: they begin together.

    Components whose start is not stated (None) begin with the earliest of the others.
    """
    known = {name: start for name, (_, start) in rows.items() if start is not None}
    first, last = min(known.values(), default=None), max(known.values(), default=0.0)
    if any(last > start + dt * len(rows[name][0]) for name, start in known.items()):
        stated = ", ".join(f"{name} from {_describe_time(start)}" for name, start in known.items())
        raise InvalidInput(
            f"the components have no time in common ({stated}): their times contradict; correct "
            "those of the files, or leave the times out where components begin together"
        )
    lead = {name: round((start - (first or 0.0)) / dt) for name, start in known.items()}
    padded = {name: np.pad(row, (lead.get(name, 0), 0)) for name, (row, _) in rows.items()}
    return {**padded, "start_time": first}


def _describe_time(seconds: float) -> str:
    """Describe a time on the clock of a file, which counts from 1970 where it has a date [s]."""
    dated = 1e8 <= abs(seconds) < 1e11
    return f"{np.datetime64(round(1e3 * seconds), 'ms')}" if dated else f"{seconds:g} s"


def count_in_samples(times: float | Array, dt: float) -> Array:
    """Convert times [s] to fractional sample numbers (m,) [-]."""
    places: Array = np.asarray(times, dtype=float).ravel() / dt
    if np.isnan(places).any():
        raise InvalidInput(f"times = {short_repr(times)}: one is not a number; give seconds")
    return places


def interpolate_samples(samples: Array, places: Array) -> Array:
    """Interpolate linearly at fractional sample numbers (m,), zero outside the record."""
    # by index instead of a search, since every time step calls this
    last = len(samples) - 1
    lower = np.clip(np.floor(places), 0, max(last - 1, 0)).astype(int)
    part = np.minimum(places - lower, 1.0)
    values = (1.0 - part) * samples[lower] + part * samples[np.minimum(lower + 1, last)]
    # the last instant, as a sum of time steps, may exceed the duration by round-off
    return np.where((places >= 0.0) & (places <= last + 1e-6), values, 0.0)


def rotate_components(level: Array, across: Array, angle: float) -> tuple[Array, Array]:
    """Rotate two horizontal components by an angle [rad] from the first towards the second."""
    count = max(len(level), len(across))
    level, across = (np.pad(part, (0, count - len(part))) for part in (level, across))
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * level + sine * across, cosine * across - sine * level


def integrate_arias(samples: Array, dt: float) -> Array:
    """Integrate the Arias intensity π/(2 g) ∫ a² dt over the record (n,) [m/s].

    References:
        Arias, A measure of earthquake intensity (1970).
    """
    energy = integrate.cumulative_trapezoid(samples**2, dx=dt, initial=0.0)
    return np.pi / (2.0 * STANDARD_GRAVITY) * energy


def find_significant_window(
    samples: Array, dt: float, low: float = 0.05, high: float = 0.95
) -> tuple[float, float]:
    """Return when Arias intensity passes two fractions of its end [s].

    References:
        Trifunac, Brady, A study on the duration of strong earthquake ground motion, BSSA 65 (1975).
    """
    growth = integrate_arias(samples, dt)
    if growth[-1] == 0.0 or not 0.0 <= low < high <= 1.0:
        raise InvalidInput(
            f"significant duration from {low:g} to {high:g}: expected fractions from 0 to 1 in "
            "order, and a motion that moves"
        )
    start, end = np.searchsorted(growth, np.array([low, high]) * growth[-1])
    return float(start * dt), float(end * dt)


def generate_accelerogram(
    duration: float, dt: float, *, pga: float, ratio: float, seed: int
) -> tuple[Array, Array | None]:
    """Generate a horizontal and a vertical component (n,) [m/s²] of an artificial accelerogram."""
    values = (duration, "duration [s]"), (dt, "dt [s]"), (pga, "pga [m/s²]")
    for value, name in (*values, (ratio, "vertical_ratio [-]")):
        check_number(value, f"synthetic motion, {name}")
    if not (duration >= 50 * dt > 0.0 and pga > 0.0 and ratio >= 0.0):
        raise InvalidInput(
            f"synthetic motion of {duration:g} s at {dt:g} s, pga {pga:g} m/s², vertical ratio "
            f"{ratio:g}: expected 50 samples or more, pga > 0 and ratio >= 0"
        )
    warn_if_in_g(pga, "the pga of a synthetic motion")
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
    the ground's frequency. It grows over 15 % of the duration, stays for 35 % and fades
    exponentially (Jennings, Housner and Tsai). The corrected baseline ends at zero velocity and
    displacement.

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
    begin, end = PLATEAU
    return np.minimum(time / begin, 1.0) ** 2 * np.exp(-5.0 * np.maximum(time - end, 0.0))
