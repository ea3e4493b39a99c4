"""A step of the conserving scheme, of a structure that is linear but for its joints.

The midpoint rule is the step of `linear` with its equation written in the middle, and λ what joints
that open, close or slide do not carry on the mean of the step. So all of `linear` serves but what
the joints do, which here has a memory: the gaps at the start of the step and the shear there.
"""

from typing import NamedTuple

import numba
import numpy as np
from numba.extending import overload

from archfem.arrays import Array
from archfem.dynamics.stepping import sliding_points  # noqa: F401  (solves the small problem)
from archfem.dynamics.stepping.joint_law import pulls
from archfem.dynamics.stepping.linear import (
    add_load,
    closed_energies,
    follow_images,
    law_type,
    solve,
)
from archfem.dynamics.stepping.loop import begin, measure, settle
from archfem.dynamics.stepping.newmark import add_mixed, follow
from archfem.dynamics.stepping.path_law import facet_means, point_means
from archfem.dynamics.stepping.sliding_points import is_path_law
from archfem.dynamics.stepping.sparse_rows import add_rows, stored, times


class Passed(NamedTuple):
    """What is carried from step to step; of the two ends of a step, each is the old one in turn.

    Attributes:
        images: of u, v and a under M, K and R (2, 3, 3, n).
        gap: z, that the law sees (r,).
        before: the same a step earlier (r,).
        force: λ (r,).
        slid: what joints hold back of what they would carry had nothing slid before (r,).
        contact: w (n,).
        right: right side of a step (n,).
        pulled: tension taken out at the end of the step (p,).
    """

    images: Array
    gap: Array
    before: Array
    force: Array
    slid: Array
    contact: Array
    right: Array
    pulled: Array


@overload(begin)
def _begin(system, state, memory):  # type: ignore
    return _started if is_path_law(law_type(system)) else None


@overload(settle)
def _settle(system, kept, step, states, ground):  # type: ignore
    return _settled if is_path_law(law_type(system)) else None


@overload(measure)
def _measure(system, kept, step, states, ground, results, memory):  # type: ignore
    return _measured if is_path_law(law_type(system)) else None


def _started(system, state, memory):  # type: ignore
    """Images of a state under M, K and R, its gaps, and the shear that its joints remember."""
    linear, law = system.linear, system.linear.law
    size, rows, points = state.shape[1], len(law.start), len(law.group)
    images, gap, rate = np.zeros((2, 3, 3, size)), np.empty(rows), np.empty(rows)
    for k in range(3):
        times(linear.mass, state[k], images[0, 0, k])
        times(linear.closed, state[k], images[0, 1, k])
        if stored(linear.rest) > 0:
            times(linear.rest, state[k], images[0, 2, k])
    times(linear.opening, state[0], gap)
    times(linear.opening, state[1], rate)
    gap += law.offset
    law.start[:], law.speed[:] = gap, rate * (2.0 / linear.numbers.velocity[1])
    law.slid[: len(memory)] = memory
    before = gap - law.speed
    return Passed(
        images,
        gap,
        before,
        np.zeros(rows),
        np.zeros(rows),
        np.empty(size),
        np.empty(size),
        np.empty(points),
    )


def _settled(system, kept, step, states, ground):  # type: ignore
    """Take a step, and let the images follow."""
    linear, right, contact = system.linear, kept.right, kept.contact
    old, new = kept.images[step % 2], kept.images[(step + 1) % 2]
    add_load(right, ground, linear.weight, linear.body)
    add_mixed(right, old[0], linear.numbers.pushed)
    if stored(linear.rest) > 0:
        add_mixed(right, old[2], linear.numbers.dragged)
    _hold(linear.law, kept.slid)
    add_rows(linear.opening, np.flatnonzero(kept.slid), kept.slid, right)
    contact[:] = right
    passes = solve(system, contact, kept.gap, kept.before, kept.force)
    if passes > 0:
        add_rows(linear.opening, np.flatnonzero(kept.force), kept.force, right)
        follow_images(contact, right, (old, new), linear)
        follow(contact, states[0], states[1], linear.numbers)
    return passes


@numba.njit(cache=True)
def _hold(law, slid):  # type: ignore
    """What rows of slips would carry more had nothing slid before the step."""
    slid[:] = 0.0
    for point in range(len(law.group)):
        row = law.group[point]
        if row >= 0:
            slid[row] += law.shear[point] * law.slid[point]


def _measured(system, kept, step, states, ground, results, memory):  # type: ignore
    """Mean resultants and energies of a step, and what joints remember at its end."""
    linear, law, (resultants, energy) = system.linear, system.linear.law, results
    turn, next_turn = step % 2, (step + 1) % 2
    if stored(linear.shear) > 0:
        shear = np.empty(len(resultants))
        times(linear.shear, kept.contact, shear)
        resultants[:, 1] = shear
    else:
        resultants[:, 1] = 0.0
    _sum_up(law, resultants)
    images, numbers = (kept.images[turn], kept.images[next_turn]), linear.numbers
    damping = (numbers.drag, numbers.lag)
    closed_energies(states, images, (linear.weight, linear.body), ground, damping, energy)
    _go_on(law, kept, energy, memory)


@numba.njit(cache=True)
def _sum_up(law, resultants):  # type: ignore
    """N, V, M of every joint over the step, V added to what is there."""
    work, arm, joint = law.work, law.still.arm, law.still.joint
    resultants[:, 0] = resultants[:, 2] = 0.0
    for point in range(len(arm)):
        number = joint[point]
        resultants[number, 0] -= work.normal[point]
        resultants[number, 2] -= work.normal[point] * arm[point]
        if law.group[point] >= 0:
            resultants[number, 1] += work.shear[point]


@numba.njit(cache=True)
def _go_on(law, kept, energy, memory):  # type: ignore
    """Take what joints do to the energies of closed ones, and go on to the start of the next step.

    Energies are as if joints held tension and did not slide: what open ones do not store or damp
    is taken off, and what friction takes is added.
    """
    work, late, points, start = law.work, law.late, len(law.group), law.start
    for row in range(0, points, 2 if law.still.facets else 1):
        energy[3] += _lagged(law, kept.gap, row)
    for point in range(points):
        row = law.group[point]
        if row >= 0:
            stiffness, slip = law.shear[point], law.gain * (kept.gap[row] - start[row])
            energy[3] += work.lost[point] - late * stiffness * slip**2
    for row in range(len(start)):
        moved = law.gain * (kept.gap[row] - start[row])
        start[row] += moved
        law.speed[row] = 2.0 * moved - law.speed[row]
    pulls(start[:points], law.still, kept.pulled)
    for point in range(points):
        energy[1] -= 0.5 * start[point] * kept.pulled[point]
        row = law.group[point]
        if row >= 0:
            law.slid[point] += work.slid[point]
            memory[point] = law.slid[point]
            elastic = start[row] - law.slid[point]
            energy[1] += 0.5 * law.shear[point] * (elastic**2 - start[row] ** 2)
    energy[1] += law.stored


@numba.njit(cache=True)
def _lagged(law, gap, row):  # type: ignore
    """What the lag of damping takes at a point, or on its facet, less that if it were closed."""
    start, gain, work, stiffness = law.start, law.gain, law.work, law.still.stiffness[row]
    if law.late == 0.0:
        return 0.0
    moved = gain * (gap[row] - start[row])
    a, b = start[row], start[row] + moved
    if not law.still.facets:
        taken = point_means(a, b, 0.0, 0.0)[1]
        return moved * (stiffness * taken - work.taken[row])
    far = row + 1
    other = gain * (gap[far] - start[far])
    c, d = start[far], start[far] + other
    near, beyond = 0.0, 0.0
    if a > 0.0 or b > 0.0 or c > 0.0 or d > 0.0:
        near, beyond = facet_means((a, c, b, d), 0.0, 0.0)[1]
    lost = moved * (stiffness * near - work.taken[row])
    return lost + other * (stiffness * beyond - work.taken[far])
