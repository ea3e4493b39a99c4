"""What is done to one sampled acceleration: integrals, filters, base line, resampling, energy."""

import numpy as np
import scipy  # loads scipy.signal, which is slow, when it is first used
from scipy import integrate

from archfem.arguments import pieces, said, unmasked
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.units import STANDARD_GRAVITY

LARGEST_PEAK = 5.0 * STANDARD_GRAVITY
"""No record reaches this acceleration [m/s²]: beyond it the unit must be wrong."""

MOST_SAMPLES = 10_000_000
"""Samples of a motion, beyond which there is no room for them: a day at 100 Hz."""


def checked(samples: Array | None, component: str) -> Array:
    """Return a component as its own read-only row of finite numbers below 5 g.

    Args:
        samples: accelerations (n,) [m/s²], or what was given for them.
        component: its name, for errors.

    Raises:
        InvalidInput: it is not one row of finite numbers, or exceeds 5 g.
    """
    unmasked(samples, f"{component} acceleration")
    try:
        row = np.array(samples, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"{component} acceleration is not a row of numbers: {error}") from error
    if row.ndim != 1 or row.size == 0 or not np.all(np.isfinite(row)):
        raise InvalidInput(
            f"{component} acceleration of shape {row.shape}: expected one row of finite numbers"
        )
    peak = np.abs(row).max()
    if peak > LARGEST_PEAK:
        raise InvalidInput(
            f"{component} acceleration reaches {peak / STANDARD_GRAVITY:.3g} g, more than 5 g: "
            "that can only be a wrong unit (m/s² expected)"
        )
    row.setflags(write=False)
    return row


def velocity(samples: Array, dt: float) -> Array:
    """Integrate an acceleration that runs straight from sample to sample; at rest at first.

    Args:
        samples: accelerations (n,) [m/s²].
        dt: time between samples [s].

    Returns:
        Velocities (n,) [m/s].
    """
    integral: Array = integrate.cumulative_trapezoid(samples, dx=dt, initial=0.0)
    return integral


def displacement(samples: Array, dt: float) -> Array:
    """Integrate an acceleration that runs straight from sample to sample twice; at rest at first.

    In a step d₁ = d₀ + v₀ Δt + (2 a₀ + a₁) Δt²/6, which is exact.

    Args:
        samples: accelerations (n,) [m/s²].
        dt: time between samples [s].

    Returns:
        Displacements (n,) [m].
    """
    steps = velocity(samples, dt)[:-1] * dt + (2.0 * samples[:-1] + samples[1:]) * dt**2 / 6.0
    return np.concatenate(([0.0], np.cumsum(steps)))


def baseline_corrected(samples: Array, dt: float, degree: int = 6) -> Array:
    """Take the drift out of an acceleration: it ends with no velocity and no displacement.

    The polynomial p(t) = c₂ t² + ... of least squares distance to the displacement, among those
    that share its last value and slope, is subtracted as p'' from the acceleration. (Fitting the
    displacement is PEER's way; the two conditions at the end are added.)

    Args:
        samples: accelerations (n,) [m/s²], n > degree.
        dt: time between samples [s].
        degree: degree of the polynomial, at least 3.

    Returns:
        Accelerations (n,) [m/s²].

    Raises:
        InvalidInput: the degree is below 3, or not below the number of samples.

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
    moved = displacement(samples, dt)
    # Each p'' is integrated as the samples are, so that the end comes out zero to round-off.
    bends = powers * (powers - 1) * time ** (powers - 2) / length**2
    shapes = np.column_stack([displacement(bend, dt) for bend in bends.T])
    ends = np.array([[velocity(bend, dt)[-1] for bend in bends.T], shapes[-1]])
    goal = np.array([velocity(samples, dt)[-1], moved[-1]])
    # Equality constraints by null space: c = c_end + Z y.
    least = np.linalg.lstsq(ends, goal, rcond=None)[0]
    null = np.linalg.svd(ends)[2][2:].T
    free = np.linalg.lstsq(shapes @ null, moved - shapes @ least, rcond=None)[0]
    drift: Array = bends @ (least + null @ free)
    return samples - drift


def band_passed(samples: Array, dt: float, low: float, high: float, *, order: int = 4) -> Array:
    """Keep the frequencies between two corners, without shift in time.

    A Butterworth filter run forwards and backwards over the record with 1.5 order/low seconds of
    zeros at both ends.

    Args:
        samples: accelerations (n,) [m/s²].
        dt: time between samples [s].
        low: lower corner [Hz].
        high: upper corner [Hz].
        order: order of the filter in each direction, at least 1.

    Returns:
        Accelerations (n,) [m/s²].

    Raises:
        InvalidInput: not 0 < low < high < half the sampling frequency, or the order is below 1.

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
    pad = int(np.ceil(1.5 * order / low / dt))
    filter_ = scipy.signal.butter(order, (low, high), "bandpass", fs=1.0 / dt, output="sos")
    passed: Array = scipy.signal.sosfiltfilt(filter_, np.pad(samples, pad), padlen=0)
    return passed[pad:-pad]


def resampled(samples: Array, dt: float, new_dt: float) -> Array:
    """Return samples taken anew by straight lines, with every peak kept.

    Each turning point of the old samples, and either end, is put on the nearest new one; where
    several meet, the largest stays. Peaks move by half a new step at most and keep their values.

    Args:
        samples: accelerations (n,) [m/s²].
        dt: time between samples [s].
        new_dt: time between the new samples [s].

    Returns:
        Accelerations (m,) [m/s²] that last at least as long.

    Raises:
        InvalidInput: the new step is not positive and finite.
    """
    if not 0.0 < new_dt < np.inf:
        raise InvalidInput(f"dt {new_dt!r} s: the time between samples is a positive number")
    pieces((len(samples) - 1) * dt, new_dt, "samples of a motion", MOST_SAMPLES)
    new_dt = float(new_dt)
    count = int(np.ceil((len(samples) - 1) * dt / new_dt - 1e-9)) + 1
    new = np.interp(np.arange(count) * new_dt, np.arange(len(samples)) * dt, samples, right=0.0)
    rises = np.diff(samples) > 0.0
    turned = np.concatenate(([True], rises[1:] != rises[:-1], [True]))[: len(samples)]
    turns = np.flatnonzero(turned & (samples != 0.0))
    turns = turns[np.argsort(np.abs(samples[turns]), kind="stable")]
    new[np.minimum(np.rint(turns * dt / new_dt).astype(int), count - 1)] = samples[turns]
    return new


def counted(times: float | Array, dt: float) -> Array:
    """Return times in samples from the first (m,) [-].

    Args:
        times: of any shape (m in all) [s].
        dt: time between samples [s].

    Raises:
        InvalidInput: one is not a number.
    """
    places: Array = np.asarray(times, dtype=float).ravel() / dt
    if np.isnan(places).any():
        raise InvalidInput(f"times = {said(times)}: one is not a number; give seconds")
    return places


def between(samples: Array, places: Array) -> Array:
    """Return values at places counted in samples (m,), straight in between and zero outside.

    There is no search in it: a time stepper asks often.

    Args:
        samples: values (n,).
        places: where, in samples from the first (m,) [-].
    """
    last = len(samples) - 1
    lower = np.clip(np.floor(places), 0, max(last - 1, 0)).astype(int)
    part = np.minimum(places - lower, 1.0)
    values = (1.0 - part) * samples[lower] + part * samples[np.minimum(lower + 1, last)]
    # The last instant of a record may come out of a sum of steps a little late.
    return np.where((places >= 0.0) & (places <= last + 1e-6), values, 0.0)


def rotated(level: Array, across: Array, angle: float) -> tuple[Array, Array]:
    """Return two horizontals along axes turned from the first towards the second.

    Args:
        level: accelerations along the first axis (n,) [m/s²].
        across: accelerations along the second axis (m,) [m/s²].
        angle: by which the axes turn [rad].

    Returns:
        Both as long as the longer one [m/s²], the shorter followed by zeros.
    """
    count = max(len(level), len(across))
    level, across = (np.pad(part, (0, count - len(part))) for part in (level, across))
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * level + sine * across, cosine * across - sine * level


def arias(samples: Array, dt: float) -> Array:
    """Return how Arias intensity grows: π/(2 g) ∫ a² dt (n,) [m/s].

    Args:
        samples: accelerations (n,) [m/s²].
        dt: time between samples [s].

    References:
        Arias, A measure of earthquake intensity (1970).
    """
    energy: Array = integrate.cumulative_trapezoid(samples**2, dx=dt, initial=0.0)
    return np.pi / (2.0 * STANDARD_GRAVITY) * energy


def significant_window(
    samples: Array, dt: float, low: float = 0.05, high: float = 0.95
) -> tuple[float, float]:
    """Return when Arias intensity passes two fractions of its end [s].

    Args:
        samples: accelerations (n,) [m/s²].
        dt: time between samples [s].
        low: fraction at which the window begins [-].
        high: fraction at which it ends [-].

    Raises:
        InvalidInput: not 0 <= low < high <= 1, or the samples are all zero.

    References:
        Trifunac, Brady, A study on the duration of strong earthquake ground motion, BSSA 65 (1975).
    """
    growth = arias(samples, dt)
    if growth[-1] == 0.0 or not 0.0 <= low < high <= 1.0:
        raise InvalidInput(
            f"significant duration from {low:g} to {high:g}: expected fractions from 0 to 1 in "
            "order, and a motion that moves"
        )
    start, end = np.searchsorted(growth, np.array([low, high]) * growth[-1])
    return float(start * dt), float(end * dt)
