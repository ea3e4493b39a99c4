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
from archfem.joints.moving.compiled import computing
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
    size, rows, points = state.shape[1], len(law.start), len(law.points)
    gap, rate = np.empty(rows), np.empty(rows)
    times(linear.opening, state[0], gap)
    times(linear.opening, state[1], rate)
    gap += law.offset
    law.start[:], law.speed[:] = gap, rate * (2.0 / linear.numbers.velocity[1])
    for point in range(len(memory)):
        law.points[point].slid = memory[point]
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
    pressed, arm, joint, points = law.work.points, law.still.arm, law.still.joint, law.points
    resultants[:, 0] = resultants[:, 2] = 0.0
    for point in range(len(arm)):
        number = joint[point]
        resultants[number, 0] -= pressed[point].normal
        resultants[number, 2] -= pressed[point].normal * arm[point]
        if points[point].group >= 0:
            resultants[number, 1] += pressed[point].shear


@computing
def _go_on(law, kept, energy, memory):  # type: ignore
    """Take what joints do to the energies of closed ones, and go on to the start of the next step.

    Energies are as if joints held tension and did not slide: what open ones do not store or damp
    is taken off, and what friction takes is added.
    """
    late, start, points, (opened, pulled) = law.late, law.start, law.points, kept.room
    pressed, stretches, gap, speed = law.work.points, law.stretches, kept.gap, law.speed
    if late > 0.0:
        energy[3] += _lagged(law, gap)
    for k in range(len(points)):
        row = points[k].group
        if row >= 0:
            slip = law.gain * (gap[row] - start[row])
            energy[3] += pressed[k].lost - late * points[k].elastic * slip**2
    for row in range(len(start)):
        moved = law.gain * (gap[row] - start[row])
        start[row] += moved
        speed[row] = 2.0 * moved - speed[row]
    for k in range(len(points)):
        stretch = stretches[points[k].stretch]
        opened[k] = between((start[stretch.near], start[stretch.far]), points[k].share)
    pulls(opened, law.still, pulled)
    for k in range(len(points)):
        energy[1] -= 0.5 * opened[k] * pulled[k]
        point, row = points[k], points[k].group
        if row >= 0:
            point.slid += pressed[k].slides
            memory[k] = point.slid
            elastic = start[row] - point.slid
            energy[1] += 0.5 * point.elastic * (elastic**2 - start[row] ** 2)
    energy[1] += law.stored


@computing
def _lagged(law, gap):  # type: ignore
    """What the lag of damping takes on openings, less that if joints were closed."""
    start, points, carried, lost = law.start, law.points, law.work.stretches, 0.0
    stretches = law.stretches
    for number in range(len(stretches)):
        part = stretches[number]
        first = start[part.near], start[part.far]
        moved = law.gain * (gap[part.near] - first[0]), law.gain * (gap[part.far] - first[1])
        last = first[0] + moved[0], first[1] + moved[1]
        lost -= moved[0] * carried[number].near + moved[1] * carried[number].far
        if max(first[0], first[1], last[0], last[1]) <= 0.0:
            continue
        for point in range(part.begin, part.end):
            stiffness, share = points[point].stiffness, points[point].share
            a, b, way = between(first, share), between(last, share), between(moved, share)
            if not law.still.facets:
                lost += way * stiffness * point_means(a, b, 0.0, 0.0)[1]
            elif point % 2 == 0:
                other = points[point + 1].share
                ends = (a, between(first, other), b, between(last, other))
                taken = facet_means(ends, 0.0, 0.0)[1]
                lost += stiffness * (way * taken[0] + between(moved, other) * taken[1])
    return lost
