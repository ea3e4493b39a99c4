"""The compiled loop of `contact`: steps in modal coordinates, open points by an active set."""

from typing import NamedTuple

import numba
import numpy as np

from archfem.structure import Array

ITERATIONS = 40
"""Passes over the open points in a step before it is given up."""

SETTLED = 1e-12
"""Change of a contact force, relative to the largest, that ends the passes."""


class Coefficients(NamedTuple):
    """Numbers of a time step.

    Attributes:
        dt: its length [s].
        beta: Newmark's.
        gamma: Newmark's.
        share: where the equation is written, 1 + α.
        lag: of the contact behind the displacement [s].
        seen: change of contact per change of displacement.
        squares: ω² (n,).
        rates: modal damping (n,).
        gain: H (n,).
    """

    dt: float
    beta: float
    gamma: float
    share: float
    lag: float
    seen: float
    squares: Array
    rates: Array
    gain: Array


def coefficients(
    dt: float, scheme: tuple[float, float, float], lag: float, modes: tuple[Array, Array]
) -> Coefficients:
    """Work out the numbers of a time step from the scheme's (β, γ, α) and the modes' (ω², d)."""
    beta, gamma, alpha = scheme
    squares, rates = modes
    share = 1.0 + alpha
    to_velocity, to_acceleration = gamma / (beta * dt), 1.0 / (beta * dt**2)
    gain = 1.0 / (to_acceleration + share * (rates * to_velocity + squares))
    seen = share * (1.0 + lag * to_velocity)
    return Coefficients(dt, beta, gamma, share, lag, seen, squares, rates, gain)


@numba.njit(cache=True)
def advance(series, gaps, resultants, iterations, loads, matrices, numbers, law):  # type: ignore
    """Take steps until the end, or until one does not settle; return how many were taken.

    Args:
        series: η, its velocity and acceleration at the start in [0]; filled (steps + 1, 3, n).
        gaps: openings that the law sees, those at the start in [0]; filled (steps + 1, p).
        resultants: N, V, M; filled (steps, n_joints, 3).
        iterations: passes over the open points; filled (steps,).
        loads: modal forces where each step's equation is written (steps, n).
        matrices: opening B (p, n), shear resultants (n_joints, n), compliance F (p, p).
        numbers: `Coefficients`.
        law: exact facets?, stiffness (p,), arm (p,) and joint (p,) of the points.
    """
    scheme = (numbers.beta, numbers.gamma, numbers.dt, numbers.lag)
    opening, shear, compliance = matrices
    size, points = opening.shape[1], opening.shape[0]
    jacobian = np.zeros((points, 2))
    other = np.zeros((points, 2))
    contact = np.empty(size)
    change = np.empty(size)
    force = np.zeros(points)
    for step in range(len(loads)):
        _free(series[step], loads[step], numbers, change, contact)
        start = opening @ contact
        passes, gap = _settle(start, compliance, law, jacobian, other, force)
        if passes < 0:
            return step
        for row in range(points):
            if force[row] != 0.0:
                for k in range(size):
                    change[k] += numbers.gain[k] * opening[row, k] * force[row]
        iterations[step] = passes
        finish(series[step], series[step + 1], change, scheme, contact)
        if numbers.share != 1.0:
            gap = opening @ contact
        gaps[step + 1] = gap
        joint_resultants(resultants[step], gap, shear @ contact, law)
    return len(loads)


@numba.njit(cache=True)
def _free(state, load, numbers, change, contact):  # type: ignore
    """Change of η, and contact where the equation is written, if all joints stayed closed."""
    beta, gamma, dt, share = numbers.beta, numbers.gamma, numbers.dt, numbers.share
    for k in range(len(load)):
        q, v, a = state[0, k], state[1, k], state[2, k]
        velocity = (1.0 - gamma / beta) * v + dt * (1.0 - 0.5 * gamma / beta) * a
        acceleration = -v / (beta * dt) - (0.5 / beta - 1.0) * a
        rate = v + share * (velocity - v)
        rest = load[k] - acceleration - numbers.rates[k] * rate - numbers.squares[k] * q
        change[k] = numbers.gain[k] * rest
        contact[k] = q + numbers.lag * rate + numbers.seen * change[k]


@numba.njit(cache=True)
def finish(state, new, change, scheme, contact):  # type: ignore
    """State at the end of a step by Newmark's formulas, and the contact there."""
    beta, gamma, dt, lag = scheme
    for k in range(len(change)):
        v, a = state[1, k], state[2, k]
        new[0, k] = state[0, k] + change[k]
        new[1, k] = (
            gamma / (beta * dt) * change[k]
            + (1.0 - gamma / beta) * v
            + dt * (1.0 - 0.5 * gamma / beta) * a
        )
        new[2, k] = change[k] / (beta * dt**2) - v / (beta * dt) - (0.5 / beta - 1.0) * a
        contact[k] = new[0, k] + lag * new[1, k]


@numba.njit(cache=True)
def _settle(start, compliance, law, jacobian, other, force):  # type: ignore
    """Find z = z₀ + F J(z) z; leaves λ in `force` and J in `jacobian`.

    Begins with the J of the last step. Returns the number of passes (-1: they do not settle) and z.
    """
    facets = law[0]
    gap = start.copy()
    for passes in range(1, ITERATIONS + 1):
        active = np.flatnonzero(_acts(jacobian, facets))
        force[:] = 0.0
        gap[:] = start
        if len(active):
            _active(active, start, compliance, jacobian, facets, force)
            for row in active:
                if force[row] != 0.0:
                    gap += compliance[row] * force[row]
        _jacobians(gap, law, other)
        largest, off = 0.0, 0.0
        for row in range(len(gap)):
            new = facet_product(other, gap, row, facets)
            largest = max(largest, abs(new))
            off = max(off, abs(new - force[row]))
        jacobian[:] = other
        if off <= SETTLED * largest:
            return passes, gap
    jacobian[:] = 0.0
    return -1, gap


@numba.njit(cache=True)
def _acts(jacobian, facets):  # type: ignore
    """Rows whose J is not zero; both rows of a facet together."""
    acts = np.zeros(len(jacobian), dtype=np.bool_)
    for row in range(len(jacobian)):
        if jacobian[row, 0] != 0.0 or jacobian[row, 1] != 0.0:
            acts[row] = True
            if facets:
                acts[row ^ 1] = True
    return acts


@numba.njit(cache=True)
def facet_product(jacobian, gap, row, facets):  # type: ignore
    """One entry of J z; a facet's row holds its own entry and that of its partner."""
    if facets:
        return jacobian[row, 0] * gap[row] + jacobian[row, 1] * gap[row ^ 1]
    return jacobian[row, 0] * gap[row]


@numba.njit(cache=True)
def _active(active, start, compliance, jacobian, facets, force):  # type: ignore
    """Solve (1 - F J) z = z₀ on the active rows and set λ = J z there."""
    size = len(active)
    matrix = np.empty((size, size))
    right = np.empty((size, 1))
    for i in range(size):
        row = compliance[active[i]]
        right[i, 0] = start[active[i]]
        for j in range(size):
            column = active[j]
            value = row[column] * jacobian[column, 0]
            if facets:
                value += row[column ^ 1] * jacobian[column ^ 1, 1]
            matrix[i, j] = -value
        matrix[i, i] += 1.0
    solution = np.linalg.solve(matrix, right)
    for i in range(size):
        row = active[i]
        force[row] = jacobian[row, 0] * solution[i, 0]
        if facets:
            partner = i + 1 if row % 2 == 0 else i - 1
            force[row] += jacobian[row, 1] * solution[partner, 0]


@numba.njit(cache=True)
def _jacobians(gap, law, jacobian):  # type: ignore
    """J(z): what must be taken off the closed stiffness for the joint to carry no tension."""
    facets, stiffness = law[0], law[1]
    if not facets:
        for row in range(len(gap)):
            jacobian[row, 0] = stiffness[row] if gap[row] > 0.0 else 0.0
        return
    for row in range(0, len(gap), 2):
        low, high = open_part(gap[row], gap[row + 1])
        first, mixed, second = integrals(low, high)
        jacobian[row, 0] = stiffness[row] * first
        jacobian[row, 1] = jacobian[row + 1, 1] = stiffness[row] * mixed
        jacobian[row + 1, 0] = stiffness[row] * second


@numba.njit(cache=True)
def open_part(a, b):  # type: ignore
    """Where a facet of unit length with end gaps a and b is open."""
    if a > 0.0:
        return 0.0, (1.0 if b > 0.0 else a / (a - b))
    return (a / (a - b) if b > 0.0 else 1.0), 1.0


@numba.njit(cache=True)
def integrals(low, high):  # type: ignore
    """∫ φ_i φ_j of the two linear functions, for (1, 1), (1, 2) and (2, 2)."""
    squares, cubes = 0.5 * (high**2 - low**2), (high**3 - low**3) / 3.0
    return high - low - 2.0 * squares + cubes, squares - cubes, cubes


@numba.njit(cache=True)
def joint_resultants(result, gap, shear, law):  # type: ignore
    """N, V, M of every joint from the gaps at its points."""
    facets, stiffness, arm, joint = law
    result[:] = 0.0
    result[:, 1] = shear
    for row in range(len(gap)):
        pull = 0.0  # from the closed part alone, so that an open joint carries exactly nothing
        if not facets:
            pull = stiffness[row] * min(gap[row], 0.0)
        elif gap[row] <= 0.0 or gap[row ^ 1] <= 0.0:
            low, high = open_part(gap[row], gap[row ^ 1])
            first, mixed, _ = integrals(high, 1.0) if low == 0.0 else integrals(0.0, low)
            pull = stiffness[row] * (first * gap[row] + mixed * gap[row ^ 1])
        result[joint[row], 0] -= pull
        result[joint[row], 2] -= pull * arm[row]
