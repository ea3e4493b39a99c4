"""Mean accelerations of the ground over time intervals, integrated exactly."""

from weakref import WeakKeyDictionary

import numpy as np

from archfem._typing import Array
from archfem.motion.motion import COMPONENTS, Motion

_cached_integrals: WeakKeyDictionary[Motion, dict[str, Array]] = WeakKeyDictionary()


def mean_accelerations(motion: Motion, times: Array) -> Array:
    """Return the mean acceleration of the ground between each time and the next.

    The record is straight between its samples and zero outside, and is integrated exactly.
    """
    means = np.zeros((len(times) - 1, 2))
    for axis, name in enumerate(COMPONENTS[:2]):
        if name in motion.components:
            speeds = motion.dt * _integrate_to(motion, name, times / motion.dt)
            means[:, axis] = np.diff(speeds) / np.diff(times)
    return means


def _integrate_to(motion: Motion, name: str, places: Array) -> Array:
    """Integrate a component from its first sample to fractional sample numbers (m,)."""
    samples, sums = motion.component(name), _integrate_samples(motion, name)
    last = len(samples) - 1
    inside = np.clip(places, 0.0, last)
    lower = np.minimum(inside.astype(int), max(last - 1, 0))
    part = inside - lower
    rise = samples[np.minimum(lower + 1, last)] - samples[lower]
    return sums[lower] + part * (samples[lower] + 0.5 * part * rise)


def _integrate_samples(motion: Motion, name: str) -> Array:
    """Integrate a component up to each of its samples, once for each motion (n,)."""
    integrals = _cached_integrals.setdefault(motion, {})
    if name not in integrals:
        samples = motion.component(name)
        integrals[name] = np.append(0.0, np.cumsum(0.5 * (samples[1:] + samples[:-1])))
    return integrals[name]
