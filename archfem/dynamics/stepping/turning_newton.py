"""Newton's method for a step of blocks that turn, compiled: passes, and how far each of them goes.

Points that the first pass takes from sliding one way to sliding the other are held in the second:
without it two thirds more passes are needed where much slides. A pass after that which leaves more
out of balance than there was is shortened. Where the factor is sparse it is kept from pass to pass
while it serves.
"""

import numba
import numpy as np

from archfem.dynamics.stepping.band_lu import eliminate
from archfem.dynamics.stepping.panel_lu import renewed
from archfem.dynamics.stepping.panel_solution import back
from archfem.dynamics.stepping.sparse_rows import row_times
from archfem.joints.moving.compiled import computing
from archfem.joints.moving.moved import pass_joints

TURNS, LOOKS, SHORTEST = 60, 150, 1.0 / 64.0
"""Passes at most, looks at what is out of balance, and the shortest part of a pass."""

SLOWLY = 0.03
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
    enough, rounded = system.enough
    last, ahead, looks, served = np.inf, 0.0, 1, False
    left, held = _left(system, kept, (before, after), True)
    for turn in range(TURNS):
        if left <= enough or (last <= rounded and left <= 1e4 * enough):
            return looks, True
        serve, served = left <= SLOWLY * ahead and served and not held, not held
        if looks > LOOKS or not _corrected(system, kept, serve):
            return looks, False
        last, share = _went(kept.move, kept.rest, kept.along), 1.0
        if not last < np.inf:
            kept.known[0] = False
            return looks, False
        while True:
            found, holds = _left(system, kept, (before, after), turn > 0)
            looks += 1
            if found < left or held or turn < whole or share <= SHORTEST:
                break
            share *= 0.5
            for k in range(len(kept.move)):
                kept.move[k] -= share * kept.along[k]
        ahead, left, last, held = left, found, share * last, holds
    return looks, False


@computing
def _went(move, rest, along):  # type: ignore
    """Go by a correction, and keep it; returns the largest part of it."""
    largest = 0.0
    for k in range(len(move)):
        along[k] = rest[k]
        move[k] += along[k]
        if not abs(along[k]) <= largest:
            largest = abs(along[k])
    return largest


@computing
def _corrected(system, kept, serve):  # type: ignore
    """Find the correction, by a factor that serves if there is one; whether there is one."""
    if len(system.band) > 0:
        _assemble(system, kept)
        return eliminate(kept.band, kept.rest)
    if not (serve and kept.known[0]):
        rate = system.room.rate
        kept.known[0] = renewed(system.panels, rate, kept.entries, kept.image)
    if kept.known[0]:
        back(system.panels, kept.entries, kept.rest, kept.image)
    return kept.known[0]


@numba.njit(cache=True)
def _left(system, kept, states, afresh):  # type: ignore
    """Find the forces out of balance; their norm, and whether points are held that slide."""
    before, after = states
    for k in range(len(after)):
        after[k] = before[k] + kept.move[k]
    if afresh:
        system.room.ways[:] = 0.0
    pass_joints(system.turning, before, after, system.step[1], system.slid, system.room)
    norm = _balance(system, kept)
    return norm, _held(system.room.held, system.turning.sides, kept.rest)


@computing
def _balance(system, kept):  # type: ignore
    """Write down the forces out of balance; returns their norm."""
    rest, sides, force, total = kept.rest, system.turning.sides, system.room.force, 0.0
    for k in range(len(rest)):
        rest[k] = kept.constant[k] - row_times(system.effective, k, kept.move)
    for joint in range(len(force)):
        for side in range(2):
            for k in range(sides.size[joint, side]):
                rest[sides.index[joint, side, k]] -= force[joint, side, k]
    for k in range(len(rest)):
        total += rest[k] * rest[k]
    return np.sqrt(total)


@computing
def _held(missing, sides, rest):  # type: ignore
    """Have the next pass hold points that went past where they hold; whether there are any."""
    found = False
    for joint in range(len(missing)):
        for side in range(2):
            for k in range(sides.size[joint, side]):
                more = missing[joint, side, k]
                if more != 0.0:
                    rest[sides.index[joint, side, k]] -= more
                    found = True
    return found


@computing
def _assemble(system, kept):  # type: ignore
    """The derivative of the forces by the end of the step."""
    band, rate = kept.band, system.room.rate
    index, sizes = system.turning.sides.index, system.turning.sides.size
    half = (band.shape[1] - 1) // 3
    for row in range(len(band)):
        for k in range(band.shape[1]):
            band[row, k] = system.band[row, k]
    for joint in range(len(index)):
        for side in range(2):
            for k in range(sizes[joint, side]):
                row = index[joint, side, k]
                for other in range(2):
                    for m in range(sizes[joint, other]):
                        column = half + index[joint, other, m] - row
                        band[row, column] += rate[joint, side, k, other, m]
