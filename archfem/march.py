"""The compiled loop of `compliance`: sparse solves with one factor, and the open points alone."""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.factor import Factor, backward, forward
from archfem.kernel import ITERATIONS, SETTLED, finish, joint_resultants
from archfem.products import Rows, add_rows, row_times, times, two_times
from archfem.release import gaps, pull, release
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


class Numbers(NamedTuple):
    """Numbers of a time step.

    Attributes:
        dt: its length [s].
        beta: Newmark's.
        gamma: Newmark's.
        share: where the equation is written, 1 + α.
        lag: of the contact behind the displacement [s].
        drag: coefficient of damping by mass [1/s].
        seen: change of contact per change of displacement.
        inertia: μ, change of acceleration and drag per change of contact [1/s²].
        rate: ν, change of velocity where the equation is written per change of contact [1/s].
    """

    dt: float
    beta: float
    gamma: float
    share: float
    lag: float
    drag: float
    seen: float
    inertia: float
    rate: float


def numbers_of(dt: float, scheme: tuple[float, float, float], lag: float, drag: float) -> Numbers:
    """Work out the numbers of a time step from the scheme's (β, γ, α)."""
    beta, gamma, alpha = scheme
    share, to_velocity = 1.0 + alpha, gamma / (beta * dt)
    seen = share * (1.0 + lag * to_velocity)
    inertia = (1.0 / (beta * dt**2) + drag * share * to_velocity) / seen
    return Numbers(dt, beta, gamma, share, lag, drag, seen, inertia, share * to_velocity / seen)


@numba.njit(cache=True)
def advance(series, gap, results, ground, matrices, numbers, law):  # type: ignore
    """Take steps until the end, or until one does not settle; return how many were taken.

    A step solves (K + μ M + ν C) w = p + M y + C x + Gᵀ λ for the contact w = u + β v where its
    equation is written; y and x come from the state before, λ from `release`.

    Args:
        series: q, its velocity and acceleration at the start in [0]; filled (steps + 1, 3, n).
        gap: openings that the law sees at the start (p,); left as at the end.
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
    products, contact, change = np.zeros((8, size)), np.empty(size), np.empty(size)
    force, before, shear = np.empty(points), gap.copy(), np.empty(resultants.shape[1])
    losses = (np.zeros((2, size)), np.zeros((2, 2, points)))
    _products(series[0], matrices, numbers, products)
    _energy(series[0], products, (matrices, numbers, law), losses, energies[0])
    for row in range(points):
        force[row] = pull(gap[row], gap[row ^ 1] if law[0] else 0.0, law[1][row], law[0])
    for step in range(len(resultants)):
        _right(ground[0, step], matrices, products, contact)
        near = _near(gap, before, force, law[0])
        before[:] = gap
        taken = _contact(contact, gap, (force, near), matrices, law)
        if taken < 0:
            return step
        passes[step] = taken
        _change(series[step], contact, numbers, change)
        scheme = (numbers.beta, numbers.gamma, numbers.dt, numbers.lag)
        finish(series[step], series[step + 1], change, scheme, contact)
        if numbers.share != 1.0:
            times(matrices.opening, contact, gap)
        times(matrices.shear, contact, shear)
        joint_resultants(resultants[step], gap, shear, law)
        _products(series[step + 1], matrices, numbers, products)
        _energy(series[step + 1], products, (matrices, numbers, law), losses, energies[step])
        _work(change, ground[1, step], matrices.body, losses, energies[step])
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
                held = np.empty(len(rows))
                gaps(held, gap, rows, matrices.compliance, -force)
                start[rows] = held
            taken = release(start, rows, matrices.compliance, law, force, enough)
            if taken < 0:
                return -1
            passes += taken - 1
            vector[:] = 0.0
            add_rows(matrices.opening, rows, force, vector)
            forward(factor, vector, room)
            vector += half
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
def _know(rows, matrices, room):  # type: ignore
    """Find the rows of F that are not known yet."""
    everywhere = np.ones(len(matrices.factor.parent), dtype=np.bool_)
    for row in rows:
        if not matrices.known[row]:
            vector = np.zeros(len(matrices.weight))
            add_rows(matrices.opening, np.array([row]), np.ones(len(matrices.known)), vector)
            forward(matrices.factor, vector, room)
            backward(matrices.factor, vector, room, everywhere)
            times(matrices.opening, vector, matrices.compliance[row])
            matrices.known[row] = True


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
def _products(state, matrices, numbers, products):  # type: ignore
    """M y, M v, C x, C v, K q, K v of a state, then y and x."""
    beta, gamma, dt = numbers.beta, numbers.gamma, numbers.dt
    y, x = products[6], products[7]
    for k in range(state.shape[1]):
        v, a = state[1, k], state[2, k]
        velocity = (1.0 - gamma / beta) * v + dt * (1.0 - 0.5 * gamma / beta) * a
        rate = v + numbers.share * (velocity - v)
        base = state[0, k] + numbers.lag * rate
        acceleration = -v / (beta * dt) - (0.5 / beta - 1.0) * a
        y[k] = numbers.inertia * base - acceleration - numbers.drag * rate
        x[k] = numbers.rate * base - rate
    two_times(matrices.mass, y, state[1], products[0:2])
    if len(matrices.damping[2]) > 0:
        two_times(matrices.damping, x, state[1], products[2:4])
    two_times(matrices.closed, state[0], state[1], products[4:6])


@numba.njit(cache=True)
def _right(ground, matrices, products, result):  # type: ignore
    """Right side of a step, p + M y + C x."""
    weight, body = matrices.weight, matrices.body
    for k in range(len(result)):
        load = weight[k] - body[0, k] * ground[0] - body[1, k] * ground[1]
        result[k] = load + products[0, k] + products[2, k]


@numba.njit(cache=True)
def _change(state, contact, numbers, change):  # type: ignore
    """Change of q over a step from the contact where its equation is written."""
    beta, gamma, dt = numbers.beta, numbers.gamma, numbers.dt
    for k in range(len(change)):
        v, a = state[1, k], state[2, k]
        velocity = (1.0 - gamma / beta) * v + dt * (1.0 - 0.5 * gamma / beta) * a
        base = state[0, k] + numbers.lag * (v + numbers.share * (velocity - v))
        change[k] = (contact[k] - base) / numbers.seen


@numba.njit(cache=True)
def _energy(state, products, system, losses, energy):  # type: ignore
    """Kinetic and potential energy of a state; leaves its damping forces, after the last ones."""
    matrices, numbers, law = system
    forces, points = losses
    forces[0], points[0] = forces[1], points[1]
    kinetic, potential = 0.0, 0.0
    for k in range(state.shape[1]):
        kinetic += 0.5 * state[1, k] * products[1, k]
        potential += (0.5 * products[4, k] - matrices.weight[k]) * state[0, k]
        forces[1, k] = numbers.drag * products[1, k] + products[3, k]
        forces[1, k] += numbers.lag * products[5, k]
    gap = points[1, 0]
    times(matrices.opening, state[0], gap)
    seen = gap
    if numbers.lag > 0.0:
        seen = np.empty(len(gap))
        times(matrices.opening, state[0] + numbers.lag * state[1], seen)
    for row in range(len(gap)):
        stiffness, other = law[1][row], row ^ 1 if law[0] else row
        stored = pull(gap[row], gap[other], stiffness, law[0])
        potential -= 0.5 * gap[row] * stored
        points[1, 1, row] = stored - pull(seen[row], seen[other], stiffness, law[0])
    energy[0], energy[1] = kinetic, potential


@numba.njit(cache=True)
def _work(change, ground, body, losses, energy):  # type: ignore
    """Work of the ground and what is lost over a step."""
    forces, points = losses
    work, lost = 0.0, 0.0
    for k in range(len(change)):
        work -= change[k] * (body[0, k] * ground[0] + body[1, k] * ground[1])
        lost += 0.5 * change[k] * (forces[0, k] + forces[1, k])
    for row in range(points.shape[2]):
        moved = points[1, 0, row] - points[0, 0, row]
        lost += 0.5 * moved * (points[0, 1, row] + points[1, 1, row])
    energy[2], energy[3] = work, lost
