"""The compiled loop of `chain`: steps on matrices of small bandwidth, factorised as joints open."""

import numba
import numpy as np

from archfem.compiled.kernel import (
    ITERATIONS,
    SETTLED,
    facet_product,
    finish,
    integrals,
    open_part,
)
from archfem.compiled.products import times


@numba.njit(cache=True)
def advance(series, gaps, resultants, iterations, loads, matrices, numbers, law):  # type: ignore
    """Take steps until the end, or until one does not settle; return how many were taken.

    A step solves (A + s Oᵀ D O) Δ = p - c - Oᵀ D g, with A the linear part of the effective
    stiffness, O the openings, D the stiffness of the closed part of the joints and g the gaps if
    nothing moved; D follows from the gaps that come out. The factor is kept until D changes.

    Args:
        series: q, its velocity and acceleration at the start in [0]; filled (steps + 1, 3, n).
        gaps: openings that the law sees, those at the start in [0]; filled (steps + 1, p).
        resultants: N, V, M; filled (steps, n_joints, 3).
        iterations: passes over the joints; filled (steps,).
        loads: forces where each step's equation is written (steps, n).
        matrices: of the model, as `chain.Matrices`.
        numbers: β, γ, share 1 + α, lag β_c, dt.
        law: exact facets?, stiffness (p,), arm (p,) and joint (p,) of the points.
    """
    beta, gamma, share, lag, dt = numbers
    seen = share * (1.0 + lag * gamma / (beta * dt))
    size, points = series.shape[2], gaps.shape[1]
    stiffness, new = np.zeros((points, 2)), np.zeros((points, 2))
    base, constant, change = np.empty(points), np.empty(size), np.empty(size)
    assembled, factor = matrices.linear.copy(), np.empty_like(matrices.linear)
    contact = np.empty(size)
    _closed(gaps[0], law, new)
    changed = True
    for step in range(len(loads)):
        _constants(series[step], matrices, numbers, constant, contact)
        times(matrices.opening, contact, base)
        gap, passes = gaps[step + 1], 0
        while True:
            passes += 1
            changed = _update(assembled, stiffness, new, matrices.opening, seen) or changed
            if changed and not _factorise(assembled, factor):
                return step
            changed = False
            _right(change, loads[step], constant, (stiffness, base), matrices.opening, law)
            _solve(factor, change)
            times(matrices.opening, change, gap)
            for row in range(points):
                gap[row] = base[row] + seen * gap[row]
            _closed(gap, law, new)
            if _settled(gap, stiffness, new, law[0]):
                break
            if passes == ITERATIONS:
                return step
        iterations[step] = passes
        finish(series[step], series[step + 1], change, (beta, gamma, dt, lag), contact)
        if share != 1.0:
            times(matrices.opening, contact, gap)
            _closed(gap, law, new)
        _resultants(resultants[step], gap, new, matrices.shear, contact, law)
    return len(loads)


@numba.njit(cache=True)
def _constants(state, matrices, numbers, constant, contact):  # type: ignore
    """What the linear forces are if q does not change, and the contact then."""
    beta, gamma, share, lag, dt = numbers
    size = len(constant)
    rate, acceleration = np.empty(size), np.empty(size)
    for k in range(size):
        v, a = state[1, k], state[2, k]
        velocity = (1.0 - gamma / beta) * v + dt * (1.0 - 0.5 * gamma / beta) * a
        acceleration[k] = -v / (beta * dt) - (0.5 / beta - 1.0) * a
        rate[k] = v + share * (velocity - v)
        contact[k] = state[0, k] + lag * rate[k]
    for i in range(size):
        total = 0.0
        for entry in range(matrices.indptr[i], matrices.indptr[i + 1]):
            j = matrices.indices[entry]
            total += (
                matrices.mass[entry] * acceleration[j]
                + matrices.damping[entry] * rate[j]
                + matrices.always[entry] * contact[j]
            )
        constant[i] = total


@numba.njit(cache=True)
def _closed(gap, law, stiffness):  # type: ignore
    """Stiffness of the closed part of the joint at each row: its own, and with its partner."""
    facets, whole = law[0], law[1]
    if not facets:
        for row in range(len(gap)):
            stiffness[row, 0] = whole[row] if gap[row] <= 0.0 else 0.0
        return
    for row in range(0, len(gap), 2):
        a, b, low, high = gap[row], gap[row + 1], 0.0, 1.0
        if a > 0.0 or b > 0.0:
            opens, ends = open_part(a, b)
            low, high = (ends, 1.0) if a > 0.0 else (0.0, opens)
        first, mixed, second = integrals(low, high)
        stiffness[row, 0] = whole[row] * first
        stiffness[row, 1] = stiffness[row + 1, 1] = whole[row] * mixed
        stiffness[row + 1, 0] = whole[row] * second


@numba.njit(cache=True)
def _settled(gap, old, new, facets):  # type: ignore
    """Whether the gaps ask for the stiffness they were found with."""
    largest, off = 0.0, 0.0
    for row in range(len(gap)):
        force = facet_product(new, gap, row, facets)
        largest = max(largest, abs(force))
        off = max(off, abs(force - facet_product(old, gap, row, facets)))
    return off <= SETTLED * largest


@numba.njit(cache=True)
def _update(assembled, stiffness, new, opening, seen):  # type: ignore
    """Bring the assembled band from one stiffness of the joints to another; whether it changed."""
    indptr, indices, data = opening
    changed = False
    for row in range(len(stiffness)):
        for which in range(2):
            difference = new[row, which] - stiffness[row, which]
            if difference == 0.0:
                continue
            changed = True
            stiffness[row, which] = new[row, which]
            other = row if which == 0 else row ^ 1
            for first in range(indptr[row], indptr[row + 1]):
                i, left = indices[first], seen * difference * data[first]
                for second in range(indptr[other], indptr[other + 1]):
                    j = indices[second]
                    if j <= i:
                        assembled[i, i - j] += left * data[second]
    return changed


@numba.njit(cache=True)
def _factorise(band, factor):  # type: ignore
    """Cholesky's factor of a band, its rows from the diagonal leftwards; false if indefinite."""
    size, width = band.shape
    for i in range(size):
        for d in range(min(width - 1, i), -1, -1):
            j = i - d
            total = band[i, d]
            for m in range(1, min(width - d, j + 1)):
                total -= factor[i, d + m] * factor[j, m]
            if d > 0:
                factor[i, d] = total / factor[j, 0]
            elif total > 0.0:
                factor[i, 0] = np.sqrt(total)
            else:
                return False
    return True


@numba.njit(cache=True)
def _solve(factor, vector):  # type: ignore
    """Solve with the factor, in place."""
    size, width = factor.shape
    for i in range(size):
        total = vector[i]
        for d in range(1, min(width, i + 1)):
            total -= factor[i, d] * vector[i - d]
        vector[i] = total / factor[i, 0]
    for i in range(size - 1, -1, -1):
        value = vector[i] / factor[i, 0]
        vector[i] = value
        for d in range(1, min(width, i + 1)):
            vector[i - d] -= factor[i, d] * value


@numba.njit(cache=True)
def _right(result, load, constant, joints, opening, law):  # type: ignore
    """Right side of a step: p - c - Oᵀ D g."""
    stiffness, gap = joints
    indptr, indices, data = opening
    for k in range(len(result)):
        result[k] = load[k] - constant[k]
    for row in range(len(gap)):
        force = facet_product(stiffness, gap, row, law[0])
        if force != 0.0:
            for entry in range(indptr[row], indptr[row + 1]):
                result[indices[entry]] -= data[entry] * force


@numba.njit(cache=True)
def _resultants(result, gap, stiffness, shear, contact, law):  # type: ignore
    """N, V, M of every joint from the gaps at its points and the stiffness that belongs to them."""
    facets, _, arm, joint = law
    result[:] = 0.0
    times(shear, contact, result[:, 1])
    for row in range(len(gap)):
        if gap[row] > 0.0 and (not facets or gap[row ^ 1] > 0.0):
            continue  # open: it carries exactly nothing
        pull = facet_product(stiffness, gap, row, facets)
        result[joint[row], 0] -= pull
        result[joint[row], 2] -= pull * arm[row]


@numba.njit(cache=True)
def energies(series, forces, matrices, lag, law):  # type: ignore
    """Energies of the steps between states, as by `energy.Meter.step` (steps, 4) [J].

    Args:
        series: q, its velocity and acceleration (steps + 1, 3, n).
        forces: of the weight (n,), and of the ground, mean over each step (steps, n).
        matrices: of the model, as `chain.Matrices`.
        lag: of the contact behind the displacement [s].
        law: as for `advance`.
    """
    weight, ground = forces
    result = np.empty((len(ground), 4))
    size = series.shape[2]
    old, new = np.empty(size), np.empty(size)
    _loss(series[0], matrices, lag, law, old)
    for step in range(len(ground)):
        state, before = series[step + 1], series[step]
        kinetic, potential = _loss(state, matrices, lag, law, new)
        work, lost = 0.0, 0.0
        for k in range(size):
            moved = state[0, k] - before[0, k]
            potential -= weight[k] * state[0, k]
            work += moved * ground[step, k]
            lost += 0.5 * moved * (old[k] + new[k])
        result[step, 0], result[step, 1], result[step, 2], result[step, 3] = (
            kinetic,
            potential,
            work,
            lost,
        )
        old[:] = new
    return result


@numba.njit(cache=True)
def _loss(state, matrices, lag, law, damping):  # type: ignore
    """Kinetic energy, and that stored in blocks and joints; leaves the damping forces."""
    indptr, indices = matrices.indptr, matrices.indices
    kinetic, potential = 0.0, 0.0
    for i in range(len(damping)):
        inertia, rate, elastic, late = 0.0, 0.0, 0.0, 0.0
        for entry in range(indptr[i], indptr[i + 1]):
            j = indices[entry]
            inertia += matrices.mass[entry] * state[1, j]
            rate += matrices.damping[entry] * state[1, j]
            elastic += matrices.always[entry] * state[0, j]
            late += matrices.always[entry] * state[1, j]
        kinetic += 0.5 * state[1, i] * inertia
        potential += 0.5 * state[0, i] * elastic
        damping[i] = rate + lag * late
    gap, seen = np.empty(len(law[1])), np.empty(len(law[1]))
    times(matrices.opening, state[0], gap)
    times(matrices.opening, state[0] + lag * state[1], seen)
    stored, acting = np.zeros((len(gap), 2)), np.zeros((len(gap), 2))
    _closed(gap, law, stored)
    _closed(seen, law, acting)
    rows, columns, data = matrices.opening
    for row in range(len(gap)):
        force = facet_product(stored, gap, row, law[0])
        potential += 0.5 * gap[row] * force
        extra = facet_product(acting, seen, row, law[0]) - force
        for entry in range(rows[row], rows[row + 1]):
            damping[columns[entry]] += data[entry] * extra
    return kinetic, potential
