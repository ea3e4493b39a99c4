"""The compiled loop of `compliance`: sparse solves with one factor, and the open points alone."""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.compiled.factor import Factor, backward, forward
from archfem.compiled.kernel import ITERATIONS, SETTLED, joint_resultants
from archfem.compiled.newmark import add_mixed, follow, mix
from archfem.compiled.products import Rows, add_rows, row_times, times
from archfem.compiled.release import pull, pulls, release
from archfem.structure import Array

EXACT = 1e-11
"""Error of a contact force that is left to rounding, relative to the largest of all joints as if
closed."""

AHEAD = 2.0
"""Steps ahead for which it is foreseen which points may open."""


class Matrices(NamedTuple):
    """A model's matrices in the order of the factor.

    Attributes:
        mass: M.
        damping: what of C is not proportional to M.
        closed: K, with all joints closed.
        opening: G (p, n).
        shear: shear resultants of the joints (n_joints, n).
        weight: forces of gravity (n,).
        body: forces per unit ground acceleration (2, n).
        factor: of K + μ M + ν C.
        group: of the factor to which each coordinate belongs (n,).
        compliance: F = G (K + μ M + ν C)⁻¹ Gᵀ (p, p), of which the known rows are filled.
        known: which they are (p,).
    """

    mass: Rows
    damping: Rows
    closed: Rows
    opening: Rows
    shear: Rows
    weight: Array
    body: Array
    factor: Factor
    group: Any
    compliance: Array
    known: Any


@numba.njit(cache=True)
def advance(series, gap, results, ground, matrices, numbers, law):  # type: ignore
    """Take steps until the end, or until one does not settle; return how many were taken.

    A step solves (K + μ M + ν C) w = p + M y + C x + Gᵀ λ for the contact w = u + β v where its
    equation is written; y and x come from the state before, λ from `release`.

    Args:
        series: q, its velocity and acceleration at the start in [0]; filled (steps + 1, 3, n).
        gap: openings that the law sees at the start (p,); overwritten.
        results: N, V, M (steps, n_joints, 3), passes over the joints (steps,) and energies as by
            `energy.Meter.step` (steps, 4), all filled.
        ground: acceleration where the equation is written, and its mean over the step
            (2, steps, 2).
        matrices: `Matrices`.
        numbers: `Numbers`.
        law: exact facets?, stiffness (p,), arm (p,) and joint (p,) of the points.
    """
    resultants, passes, energies = results
    size, points = series.shape[2], len(gap)
    images, gaps = np.zeros((2, 3, 3, size)), np.zeros((2, 5, points))
    contact, right = np.empty(size), np.empty(size)
    force, before, shear = np.empty(points), gap.copy(), np.empty(resultants.shape[1])
    _start(series[0], images[0], gaps[0], matrices)
    pulls(gap, law, force)
    _late(gaps[0], numbers.lag, law)
    for step in range(len(resultants)):
        old, new = images[step % 2], images[(step + 1) % 2]
        _load(right, ground[0, step], matrices)
        add_mixed(right, old[0], numbers.pushed)
        if len(matrices.damping[2]) > 0:
            add_mixed(right, old[2], numbers.dragged)
        contact[:] = right
        near = _near(gap, before, force, law[0])
        before[:] = gap
        passes[step] = _contact(contact, gap, (force, near), matrices, law)
        if passes[step] < 0:
            return step
        add_rows(matrices.opening, np.flatnonzero(near), force, right)
        _follow(contact, right, (old, new), matrices, numbers)
        follow(contact, series[step], series[step + 1], numbers)
        follow(gap, gaps[step % 2], gaps[(step + 1) % 2], numbers)
        _late(gaps[(step + 1) % 2], numbers.lag, law)
        if numbers.share != 1.0:
            mix(gap, gaps[(step + 1) % 2], (1.0, numbers.lag, 0.0))
            mix(contact, series[step + 1], (1.0, numbers.lag, 0.0))
            pulls(gap, law, force)
        times(matrices.shear, contact, shear)
        joint_resultants(resultants[step], gap, shear, law)
        row = energies[step]
        _energies(series[step : step + 2], (old, new), (matrices, numbers), ground[1, step], row)
        _joint_energies(gaps[step % 2], gaps[(step + 1) % 2], row)
    return len(resultants)


@numba.njit(cache=True)
def _contact(vector, gap, joints, matrices, law):  # type: ignore
    """Solve a step: from its right side to the contact, in place; leaves gaps and λ.

    Returns:
        Passes over the joints; -1 if they do not settle.
    """
    force, near = joints
    factor, start = matrices.factor, np.empty(len(gap))
    everywhere, room = np.ones(len(factor.parent), dtype=np.bool_), np.empty(len(vector))
    enough = SETTLED * np.max(law[1] * np.abs(gap))
    forward(factor, vector, room)
    half = vector.copy()
    passes, fresh = 1, True
    while passes < ITERATIONS:
        rows = np.flatnonzero(near)
        if len(rows) > 0:
            _know(rows, matrices, room)
            if fresh:
                backward(factor, vector, room, _branches(rows, matrices))
                for row in rows:
                    start[row] = row_times(matrices.opening, row, vector)
            else:
                _unload(start, gap, rows, matrices.compliance, force)
            taken = release(start, rows, matrices.compliance, law, force, enough)
            if taken < 0:
                return -1
            passes += taken - 1
            vector[:] = 0.0
            add_rows(matrices.opening, rows, force, vector)
            forward(factor, vector, room)
            for k in range(len(half)):
                vector[k] += half[k]
        backward(factor, vector, room, everywhere)
        times(matrices.opening, vector, gap)
        if _exact(gap, force, near, law):
            return passes
        passes, fresh = passes + 1, False
    return -1


@numba.njit(cache=True)
def _near(gap, before, force, facets):  # type: ignore
    """Points that are open, or will be soon if they go on as they did (p,)."""
    near = np.empty(len(gap), dtype=np.bool_)
    for row in range(len(gap)):
        near[row] = force[row] != 0.0 or gap[row] + AHEAD * (gap[row] - before[row]) > 0.0
    if facets:
        for row in range(0, len(gap), 2):
            near[row] = near[row + 1] = near[row] or near[row + 1]
    return near


@numba.njit(cache=True)
def _exact(gap, force, near, law):  # type: ignore
    """Whether the gaps ask for the λ they were found with; points that open count as near."""
    facets, stiffness = law[0], law[1]
    largest, off = 0.0, 0.0
    for row in range(len(gap)):
        wanted = pull(gap[row], gap[row ^ 1] if facets else 0.0, stiffness[row], facets)
        largest = max(largest, stiffness[row] * abs(gap[row]))
        off = max(off, abs(wanted - force[row]))
        if wanted > 0.0:
            near[row] = True
            if facets:
                near[row ^ 1] = True
    return off <= EXACT * largest


@numba.njit(cache=True)
def _unload(start, gap, rows, compliance, force):  # type: ignore
    """Gaps at the rows without the forces that act, z₀ = z - F λ."""
    for row in rows:
        start[row] = gap[row]
    for row in rows:
        if force[row] != 0.0:
            line = compliance[row]
            for other in rows:
                start[other] -= line[other] * force[row]


@numba.njit(cache=True)
def _know(rows, matrices, room):  # type: ignore
    """Find the rows of F that are not known yet, as far as they meet those that are."""
    known, compliance = matrices.known, matrices.compliance
    force = np.ones(len(known))
    for row in rows:
        if not known[row]:
            known[row] = True
            held = np.flatnonzero(known)
            vector = np.zeros(len(matrices.weight))
            add_rows(matrices.opening, np.array([row]), force, vector)
            forward(matrices.factor, vector, room)
            backward(matrices.factor, vector, room, _branches(held, matrices))
            for other in held:
                compliance[row, other] = row_times(matrices.opening, other, vector)
                compliance[other, row] = compliance[row, other]


@numba.njit(cache=True)
def _branches(rows, matrices):  # type: ignore
    """Groups of the factor on which the gaps at these points depend."""
    indptr, indices, _ = matrices.opening
    parent = matrices.factor.parent
    wanted = np.zeros(len(parent), dtype=np.bool_)
    for row in rows:
        for entry in range(indptr[row], indptr[row + 1]):
            group = matrices.group[indices[entry]]
            while group >= 0 and not wanted[group]:
                wanted[group] = True
                group = parent[group]
    return wanted


@numba.njit(cache=True)
def _start(state, images, gaps, matrices):  # type: ignore
    """Images of a state under M, K and C, and its gaps."""
    for k in range(3):
        times(matrices.mass, state[k], images[0, k])
        times(matrices.closed, state[k], images[1, k])
        if len(matrices.damping[2]) > 0:
            times(matrices.damping, state[k], images[2, k])
        times(matrices.opening, state[k], gaps[k])


@numba.njit(cache=True)
def _load(result, ground, matrices):  # type: ignore
    """Forces of gravity and of the ground."""
    weight, across, up = matrices.weight, matrices.body[0], matrices.body[1]
    x, y = ground[0], ground[1]
    for k in range(len(result)):
        result[k] = weight[k] - x * across[k] - y * up[k]


@numba.njit(cache=True)
def _follow(contact, right, images, matrices, numbers):  # type: ignore
    """Images of the state under M, K and C after a step; overwrites its right side."""
    old, new = images
    image = np.empty(len(contact))
    times(matrices.mass, contact, image)
    follow(image, old[0], new[0], numbers)
    for k in range(len(right)):
        right[k] -= numbers.inertia * image[k]
    if len(matrices.damping[2]) > 0:
        times(matrices.damping, contact, image)
        follow(image, old[2], new[2], numbers)
        for k in range(len(right)):
            right[k] -= numbers.rate * image[k]
    follow(right, old[1], new[1], numbers)


@numba.njit(cache=True)
def _late(gaps, lag, law):  # type: ignore
    """Tension taken out at the gaps as they are, and how much less than where the law sees them."""
    pulls(gaps[0], law, gaps[3])
    if lag > 0.0:
        seen, stored, late = np.empty(gaps.shape[1]), gaps[3], gaps[4]
        mix(seen, gaps, (1.0, lag, 0.0))
        pulls(seen, law, late)
        for row in range(len(late)):
            late[row] -= stored[row]


@numba.njit(cache=True, fastmath={"contract", "reassoc"})
def _energies(states, images, system, ground, energy):  # type: ignore
    """Energies of a step as if all joints were closed and held tension."""
    (old, new), (matrices, numbers) = images, system
    weight, across, up = matrices.weight, matrices.body[0], matrices.body[1]
    before, u, v = states[0, 0], states[1, 0], states[1, 1]
    inertia, late, rate = (old[0, 1], new[0, 1]), (old[1, 1], new[1, 1]), (old[2, 1], new[2, 1])
    elastic, drag, lag = new[1, 0], numbers.drag, numbers.lag
    kinetic, potential, work, lost = 0.0, 0.0, 0.0, 0.0
    for k in range(len(u)):
        moved = u[k] - before[k]
        kinetic += 0.5 * v[k] * inertia[1][k]
        potential += u[k] * (0.5 * elastic[k] - weight[k])
        work -= moved * (ground[0] * across[k] + ground[1] * up[k])
        damping = drag * (inertia[0][k] + inertia[1][k]) + lag * (late[0][k] + late[1][k])
        lost += 0.5 * moved * (damping + rate[0][k] + rate[1][k])
    energy[0], energy[1], energy[2], energy[3] = kinetic, potential, work, lost


@numba.njit(cache=True)
def _joint_energies(old, new, energy):  # type: ignore
    """Take off what open joints do not store or damp."""
    for row in range(old.shape[1]):
        energy[1] -= 0.5 * new[0, row] * new[3, row]
        energy[3] -= 0.5 * (new[0, row] - old[0, row]) * (old[4, row] + new[4, row])
