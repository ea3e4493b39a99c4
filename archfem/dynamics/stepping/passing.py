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
from archfem.dynamics.stepping.linear import closed_energies, images_of, law_type
from archfem.dynamics.stepping.loop import begin, measure
from archfem.dynamics.stepping.path_forces import between
from archfem.dynamics.stepping.path_law import PathLaw
from archfem.dynamics.stepping.small_problem import is_of
from archfem.dynamics.stepping.sparse_rows import stored, times
from archfem.joints.moving.means import facet_means, point_means


class Passed(NamedTuple):
    """What is carried from step to step; of the two ends of a step, each is the old one in turn.

    Attributes:
        images: of u, v and a under M, K and R (2, 3, 3, n).
        gap: z, that the law sees (r,).
        before: the same a step earlier (r,).
        force: λ (r,).
        contact: w (n,).
        right: right side of a step (n,).
        room: for openings at the end of the step, and for the tension taken out there (2, p).
    """

    images: Array
    gap: Array
    before: Array
    force: Array
    contact: Array
    right: Array
    room: Array


@overload(begin)
def _begin(system, state, memory):  # type: ignore
    return _started if is_of(law_type(system), PathLaw) else None


@overload(measure)
def _measure(system, kept, step, states, ground, results, memory):  # type: ignore
    return _measured if is_of(law_type(system), PathLaw) else None


def _started(system, state, memory):  # type: ignore
    """Images of a state under M, K and R, its gaps, and the shear that its joints remember."""
    linear, law = system.linear, system.linear.law
    size, rows, points = state.shape[1], len(law.start), len(law.group)
    gap, rate = np.empty(rows), np.empty(rows)
    times(linear.opening, state[0], gap)
    times(linear.opening, state[1], rate)
    gap += law.offset
    law.start[:], law.speed[:] = gap, rate * (2.0 / linear.numbers.velocity[1])
    law.slid[: len(memory)] = memory
    images, room = images_of(linear, state), np.empty((2, points))
    before, force = gap - law.speed, np.zeros(rows)
    return Passed(images, gap, before, force, np.empty(size), np.empty(size), room)


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
    work, late, start, (opened, pulled) = law.work, law.late, law.start, kept.room
    if late > 0.0:
        energy[3] += _lagged(law, kept.gap)
    for point in range(len(law.group)):
        row = law.group[point]
        if row >= 0:
            stiffness, slip = law.shear[point], law.gain * (kept.gap[row] - start[row])
            energy[3] += work.lost[point] - late * stiffness * slip**2
    for row in range(len(start)):
        moved = law.gain * (kept.gap[row] - start[row])
        start[row] += moved
        law.speed[row] = 2.0 * moved - law.speed[row]
    for point in range(len(law.group)):
        stretch = law.stretch[point]
        ends = start[law.near[stretch]], start[law.far[stretch]]
        opened[point] = between(ends, law.share[point])
    pulls(opened, law.still, pulled)
    for point in range(len(law.group)):
        energy[1] -= 0.5 * opened[point] * pulled[point]
        row = law.group[point]
        if row >= 0:
            law.slid[point] += work.slid[point]
            memory[point] = law.slid[point]
            elastic = start[row] - law.slid[point]
            energy[1] += 0.5 * law.shear[point] * (elastic**2 - start[row] ** 2)
    energy[1] += law.stored


@numba.njit(cache=True)
def _lagged(law, gap):  # type: ignore
    """What the lag of damping takes on openings, less that if joints were closed."""
    work, start, lost = law.work, law.start, 0.0
    for stretch in range(len(law.near)):
        near, far = law.near[stretch], law.far[stretch]
        first = start[near], start[far]
        moved = law.gain * (gap[near] - first[0]), law.gain * (gap[far] - first[1])
        last = first[0] + moved[0], first[1] + moved[1]
        lost -= moved[0] * work.ends[stretch, 0] + moved[1] * work.ends[stretch, 1]
        if max(first[0], first[1], last[0], last[1]) <= 0.0:
            continue
        for point in range(law.begin[stretch], law.begin[stretch + 1]):
            stiffness, share = law.still.stiffness[point], law.share[point]
            a, b, way = between(first, share), between(last, share), between(moved, share)
            if not law.still.facets:
                lost += way * stiffness * point_means(a, b, 0.0, 0.0)[1]
            elif point % 2 == 0:
                other = law.share[point + 1]
                ends = (a, between(first, other), b, between(last, other))
                taken = facet_means(ends, 0.0, 0.0)[1]
                lost += stiffness * (way * taken[0] + between(moved, other) * taken[1])
    return lost
