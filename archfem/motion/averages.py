"""Mean accelerations of the ground between instants, whatever lies between them."""

import numpy as np

from archfem.arrays import Array
from archfem.motion.motion import COMPONENTS, Motion


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
            speeds = motion.dt * _integral(motion.component(name), times / motion.dt)
            means[:, axis] = np.diff(speeds) / np.diff(times)
    return means


def _integral(samples: Array, places: Array) -> Array:
    """Integral from the first sample to places counted in samples (m,)."""
    last = len(samples) - 1
    inside = np.clip(places, 0.0, last)
    lower = np.minimum(inside.astype(int), max(last - 1, 0))
    part, sums = inside - lower, np.append(0.0, np.cumsum(0.5 * (samples[1:] + samples[:-1])))
    rise = samples[np.minimum(lower + 1, last)] - samples[lower]
    found: Array = sums[lower] + part * (samples[lower] + 0.5 * part * rise)
    return found
