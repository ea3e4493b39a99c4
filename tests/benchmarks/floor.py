"""The floor: a compiled loop with nothing but the arithmetic of a step.

    python tests/benchmarks/floor.py

Newmark's average acceleration, damping on the initial stiffness, springs at joint points. The
equation of a step is linear for a given set of open points:

    A q = p - b a_g + M x₁ + β K₀ x₂,     A = c_M M + c_K K₀ - Σ_open k g gᵀ.

A step is a product with two band matrices, a back-substitution in the factors of A, and a check of
which openings G q are positive. A is factorised again only when those change. Nothing is recorded
or checked. Matrices are bands, because along a ring every matrix is one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from scenes import DT, ring, with_friction
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import spsolve
from setting import DAMPING, ground_motion, largest_eccentricity, options
from stepping import SteppedRun
from timing import least, table, watched

import archfem as af

CASES = [("rigid", "lobatto"), ("faces", "nodal"), ("condensed", "nodal"), ("full", "nodal")]
CASES += [("faces", "lobatto")]
"""Fidelity and quadrature."""

compiled = numba.njit(cache=True, fastmath=True, error_model="numpy")


@compiled
def _factorise(matrix, factor, first):
    """Factorise a band by Cholesky from a row on; `matrix[i, b + j - i]` is entry (i, j), j <= i.

    The diagonal of the factor holds its inverse.
    """
    size, width = matrix.shape
    band = width - 1
    for i in range(first, size):
        row = factor[i]
        for m in range(max(0, band - i), band):
            other, own = factor[i - band + m, band - m : band], row[:m]
            total = matrix[i, m]
            for k in range(m):
                total -= own[k] * other[k]
            row[m] = total * factor[i - band + m, band]
        total = matrix[i, band]
        for m in range(band):
            total -= row[m] * row[m]
        row[band] = 1.0 / np.sqrt(total)


@compiled
def _substitute(factor, x):
    """Solve in place; x begins with as many zeros as the band is wide."""
    size, width = factor.shape
    band = width - 1
    for i in range(size):
        row, before = factor[i], x[i : i + band]
        total = x[i + band]
        for m in range(band):
            total -= row[m] * before[m]
        x[i + band] = total * row[band]
    for i in range(size - 1, -1, -1):
        row, before = factor[i], x[i : i + band]
        value = x[i + band] * row[band]
        x[i + band] = value
        for m in range(band):
            before[m] -= row[m] * value


@compiled
def _add_products(mass, x1, stiffness, x2, y):
    """Add M x₁ + β K₀ x₂ of symmetric bands; vectors begin with zeros as in `_substitute`."""
    size, width = mass.shape
    band = width - 1
    for i in range(size):
        m, s = mass[i], stiffness[i]
        before1, before2, before = x1[i : i + band], x2[i : i + band], y[i : i + band]
        own1, own2 = x1[i + band], x2[i + band]
        total = m[band] * own1 + s[band] * own2
        for k in range(band):
            total += m[k] * before1[k] + s[k] * before2[k]
            before[k] += m[k] * own1 + s[k] * own2
        y[i + band] += total


@compiled
def _changed(rows, columns, values, q, opened):
    """Update which points are open; return the first row of the matrix that changes."""
    first = len(q)
    for point in range(len(opened)):
        gap = 0.0
        for k in range(rows[point], rows[point + 1]):
            gap += values[k] * q[columns[k]]
        if (gap > 0.0) != opened[point]:
            opened[point] = not opened[point]
            for k in range(rows[point], rows[point + 1]):
                first = min(first, columns[k])
    return first


@compiled
def _assemble(closed, joints, opened, matrix, first):
    """Assemble rows of A from one on: all joints closed, minus the springs of open points."""
    rows, columns, values, stiffness = joints
    band = closed.shape[1] - 1
    matrix[first:] = closed[first:]
    for point in range(len(opened)):
        if opened[point]:
            for a in range(rows[point], rows[point + 1]):
                i = columns[a]
                if i >= first:
                    for b in range(rows[point], rows[point + 1]):
                        j = columns[b]
                        if j <= i:
                            share = stiffness[point] * values[a] * values[b]
                            matrix[i, band + j - i] -= share


@compiled
def _history_terms(state, dt, rate, x1, x2):
    """Compute x₁ and x₂, which mass and damping multiply on the right-hand side of a step."""
    q, v, a = state
    for k in range(len(q)):
        x2[k] = 2.0 / dt * q[k] + v[k]
        x1[k] = 4.0 / dt**2 * q[k] + 4.0 / dt * v[k] + a[k] + rate * x2[k]


@compiled
def _finish(state, new, dt):
    """Update velocity and acceleration to the end of the step."""
    q, v, a = state
    for k in range(len(q)):
        moved = new[k] - q[k]
        a[k] = 4.0 / dt**2 * moved - 4.0 / dt * v[k] - a[k]
        v[k] = 2.0 / dt * moved - v[k]
        q[k] = new[k]


@compiled
def shake(bands, joints, loads, ground, state, dt):
    """Take all steps of dt; return how often A was factorised.

    Args:
        bands: M, β K₀ and A with all joints closed.
        joints: rows of the openings (start, column, value) and stiffness of each point.
        loads: self-weight, force per ground acceleration, damping by mass.
        ground: horizontal acceleration at the end of each step.
        state: q, velocity and acceleration, overwritten (3, n).
    """
    mass, damping, closed = bands
    rows, columns, values, _ = joints
    weight, body, rate = loads
    q = state[0]
    opened = np.zeros(len(rows) - 1, dtype=np.bool_)
    factor, matrix = np.zeros_like(closed), closed.copy()
    _changed(rows, columns, values, q, opened)
    _assemble(closed, joints, opened, matrix, 0)
    _factorise(matrix, factor, 0)
    count = 1
    # Vectors begin with a band of zeros, so that loops over rows need no special start.
    band = closed.shape[1] - 1
    padded = np.zeros((4, band + len(q)))
    x1, x2, right, new = padded[0, band:], padded[1, band:], padded[2, band:], padded[3, band:]
    for step in range(len(ground)):
        _history_terms(state, dt, rate, x1, x2)
        for k in range(len(q)):
            right[k] = weight[k] - body[k] * ground[step]
        _add_products(mass, padded[0], damping, padded[1], padded[2])
        for _ in range(60):  # more passes over the open points are never needed
            padded[3] = padded[2]
            padded[3, :band] = 0.0
            _substitute(factor, padded[3])
            # Only rows from the first changed spring on are assembled and factorised again.
            first = _changed(rows, columns, values, new, opened)
            if first == len(q):
                break
            _assemble(closed, joints, opened, matrix, first)
            _factorise(matrix, factor, first)
            count += 1
        _finish(state, new, dt)
    return count


@dataclass(frozen=True)
class Floor:
    """Arrays of the loop, with coordinates in an order that makes bands narrow."""

    model: af.models.Model
    start: np.ndarray
    order: np.ndarray
    bands: tuple
    joints: tuple
    loads: tuple
    ground: np.ndarray

    @classmethod
    def of(cls, model: af.models.Model, rest: np.ndarray, motion: af.Motion) -> "Floor":
        """Take the matrices of a model."""
        points = model.operator.points
        closed = model.tangent(np.zeros(model.size)).tocsr()
        closed.eliminate_zeros()
        order = reverse_cuthill_mckee(closed, symmetric_mode=True)
        mass, stiffness = (each[order][:, order].tocoo() for each in (model.mass, closed))
        width = max(_width(mass), _width(stiffness))
        m, k = (_band(each, width) for each in (mass, stiffness))
        effective = (4.0 / DT**2 + 2.0 / DT * DAMPING.mass) * m
        effective += (1.0 + 2.0 / DT * DAMPING.stiffness) * k
        opening = model.operator.opening[:, order].tocsr()
        opening.sort_indices()
        springs = points.weight * points.contact.normal_stiffness
        # Inertia forces of the first sample of the ground motion act on the structure at rest.
        inertia = -model.mass_influence[:, 0] * motion.at(0.0)[0, 0]
        start = np.stack([rest, np.zeros_like(rest), spsolve(model.mass.tocsc(), inertia)])
        times = DT * np.arange(1, round(motion.duration / DT) + 1)
        return cls(
            model,
            start[:, order],
            order,
            (m, DAMPING.stiffness * k, effective),
            (opening.indptr, opening.indices, opening.data, springs),
            (
                af.statics.self_weight(model)[order],
                model.mass_influence[order, 0].copy(),
                DAMPING.mass,
            ),
            motion.at(times)[:, 0].copy(),
        )

    def initial_state(self) -> np.ndarray:
        """Return q, velocity and acceleration at rest (3, n), which the loop overwrites."""
        return self.start.copy()

    def take_steps(self, state: np.ndarray, steps: slice = slice(None)) -> int:
        """Take steps from a state; return how often A was factorised."""
        return shake(self.bands, self.joints, self.loads, self.ground[steps], state, DT)

    def resultants(self) -> np.ndarray:
        """Return N, V, M after every step (steps, joints, 3); steps are taken one by one."""
        state, resultants = self.initial_state(), []
        for k in range(len(self.ground)):
            self.take_steps(state, slice(k, k + 1))
            q = np.empty(self.model.size)
            q[self.order] = state[0]
            resultants.append(self.model.resultants(q))
        return np.array(resultants)


def _width(matrix: sparse.coo_matrix) -> int:
    """Return the half band width of a matrix."""
    return int(np.abs(matrix.row - matrix.col)[matrix.data != 0.0].max())


def _band(matrix: sparse.coo_matrix, width: int) -> np.ndarray:
    """Store the lower part of a symmetric matrix, a row of the band for each of its rows."""
    band = np.zeros((matrix.shape[0], width + 1))
    lower = (matrix.col <= matrix.row) & (matrix.data != 0.0)
    row, column = matrix.row[lower], matrix.col[lower]
    band[row, width + column - row] = matrix.data[lower]
    return band


def case_row(case: tuple[str, str], motion: af.Motion, repeat: int) -> list[object]:
    """Run the floor and archfem's own choice, with one fidelity and quadrature."""
    fidelity, rule = case
    structure = with_friction(ring(), None)
    model = af.build(structure, fidelity=fidelity, cells=(4, 4), quadrature=rule)
    dead = af.dead_load(model)
    settings = {"dt": DT, "damping": DAMPING, "scheme": af.dynamics.Newmark()}
    run = SteppedRun(lambda: af.time_history(model, motion, start=dead, **settings))
    floor = Floor.of(model, dead.q, motion)
    factorisations = floor.take_steps(floor.initial_state()) / run.steps
    action = watched(lambda: floor.take_steps(floor.initial_state()))
    lowest = least(action, run.steps, repeat).cpu
    own = run.time_steps(repeat).cpu
    difference = largest_eccentricity(structure, floor.resultants()) - run.largest_eccentricity
    return [
        f"{fidelity}, {rule}, {run.method}",
        model.size,
        floor.bands[0].shape[1] - 1,
        f"{factorisations:.2f}",
        f"{lowest:.4f}",
        f"{own:.4f}",
        f"{own / lowest:.1f}",
        f"{difference:+.1e}",
    ]


def report(motion: af.Motion, repeat: int, cases: Sequence[tuple[str, str]] = CASES) -> str:
    """Run every case and write the table."""
    head = ["", "unknowns", "band", "factors/step", "floor ms/step", "archfem ms/step", "ratio"]
    rows = [case_row(case, motion, repeat) for case in cases]
    return table([*head, "max|e| apart"], rows)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    chosen = options(__doc__).parse_args(arguments)
    cases = CASES[:1] if chosen.quick else CASES
    print(report(ground_motion(chosen), 1 if chosen.quick else chosen.repeat, cases))


if __name__ == "__main__":
    main()
