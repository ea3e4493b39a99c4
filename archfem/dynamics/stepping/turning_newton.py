"""Newton's method for a step of blocks that turn, compiled: passes, and how far each of them goes.

A pass that leaves more out of balance than there was is shortened. Where the factor is sparse it is
kept from pass to pass while it serves.
"""

import numba
import numpy as np

from archfem.dynamics.stepping.band_lu import eliminate
from archfem.dynamics.stepping.panel_lu import back, renewed
from archfem.dynamics.stepping.sparse_rows import times
from archfem.joints.moving.moved import pass_joints

TURNS, LOOKS, SHORTEST = 60, 150, 1.0 / 64.0
"""Passes at most, looks at what is out of balance, and the shortest part of a pass."""

SLOWLY = 0.05
"""Part of what is out of balance that a pass by kept factors may leave; else they are renewed."""


@numba.njit(cache=True)
def sought(system, kept, before, after, whole):  # type: ignore
    """Find the end of a step.

    Args:
        system: `TurningSystem`.
        kept: `Turned`, whose `move` is the first guess; it becomes what is found.
        before: coordinates at the start (n,).
        after: coordinates at the end, filled (n,).
        whole: passes that go all the way, before those that must leave less out of balance.

    Returns:
        Looks at what is out of balance, and whether the end was found.
    """
    move, rest, along, (enough, rounded) = kept.move, kept.rest, kept.along, system.enough
    last, ahead, looks = np.inf, 0.0, 1
    after[:] = before + move
    left = _left(system, kept, before, after)
    for turn in range(TURNS):
        if left <= enough or (last <= rounded and left <= 1e4 * enough):
            return looks, True
        if looks > LOOKS or not _corrected(system, kept, left <= SLOWLY * ahead):
            return looks, False
        along[:] = rest
        last, share = np.max(np.abs(along)), 1.0
        if not last < np.inf:
            kept.known[0] = False
            return looks, False
        move += along
        while True:
            after[:] = before + move
            found = _left(system, kept, before, after)
            looks += 1
            if found < left or turn < whole or share <= SHORTEST:
                break
            share *= 0.5
            move -= share * along
        ahead, left, last = left, found, share * last
    return looks, False


@numba.njit(cache=True)
def _corrected(system, kept, serve):  # type: ignore
    """Find the correction, by a factor that serves if there is one; whether there is one."""
    if len(system.band) > 0:
        _assemble(system, kept)
        return eliminate(kept.band, kept.rest)
    if not (serve and kept.known[0]):
        kept.known[0] = renewed(system.panels, system.room.rate.reshape(-1), kept.entries)
    if kept.known[0]:
        back(system.panels, kept.entries, kept.rest, kept.image)
    return kept.known[0]


@numba.njit(cache=True)
def _left(system, kept, before, after):  # type: ignore
    """Find the forces out of balance; returns their norm."""
    rest, image, joints = kept.rest, kept.image, system.turning
    pass_joints(joints, before, after, system.step[1], system.slid, system.room)
    times(system.effective, kept.move, image)
    rest[:] = kept.constant - image
    index, sizes, force = joints.sides.index, joints.sides.size, system.room.force
    for joint in range(len(index)):
        for side in range(2):
            for k in range(sizes[joint, side]):
                rest[index[joint, side, k]] -= force[joint, side, k]
    return np.sqrt(np.sum(rest * rest))


@numba.njit(cache=True)
def _assemble(system, kept):  # type: ignore
    """The derivative of the forces by the end of the step."""
    band, rate = kept.band, system.room.rate
    index, sizes = system.turning.sides.index, system.turning.sides.size
    half = (band.shape[1] - 1) // 3
    band[:] = system.band
    for joint in range(len(index)):
        for side in range(2):
            for k in range(sizes[joint, side]):
                row = index[joint, side, k]
                for other in range(2):
                    for m in range(sizes[joint, other]):
                        column = half + index[joint, other, m] - row
                        band[row, column] += rate[joint, side, k, other, m]
