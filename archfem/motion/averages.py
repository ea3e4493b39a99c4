"""Mean accelerations of the ground between instants, whatever lies between them."""

from weakref import WeakKeyDictionary

import numpy as np

from archfem.arrays import Array
from archfem.motion.motion import COMPONENTS, Motion

_known: WeakKeyDictionary[Motion, dict[str, Array]] = WeakKeyDictionary()


def mean_accelerations(motion: Motion, times: Array) -> Array:
    """Return the mean acceleration of the ground between each time and the next.

    The record is straight between its samples and zero outside, and is integrated exactly.

    Args:
        motion: of the ground.
        times: ascending (n + 1,) [s].

    Returns:
        Horizontal and vertical (n, 2) [m/s²].
    """
    means = np.zeros((len(times) - 1, 2))
    for axis, name in enumerate(COMPONENTS[:2]):
        if name in motion.components:
            speeds = motion.dt * _integral(motion, name, times / motion.dt)
            means[:, axis] = np.diff(speeds) / np.diff(times)
    return means


def _integral(motion: Motion, name: str, places: Array) -> Array:
    """Integral of a component from its first sample to places counted in samples (m,)."""
    samples, sums = motion.component(name), _sums(motion, name)
    last = len(samples) - 1
    inside = np.clip(places, 0.0, last)
    lower = np.minimum(inside.astype(int), max(last - 1, 0))
    part = inside - lower
    rise = samples[np.minimum(lower + 1, last)] - samples[lower]
    found: Array = sums[lower] + part * (samples[lower] + 0.5 * part * rise)
    return found


def _sums(motion: Motion, name: str) -> Array:
    """Integral of a component up to each of its samples, found once a motion (n,)."""
    own = _known.setdefault(motion, {})
    if name not in own:
        samples = motion.component(name)
        own[name] = np.append(0.0, np.cumsum(0.5 * (samples[1:] + samples[:-1])))
    return own[name]
