"""The floor: a compiled loop that does nothing but the arithmetic of a step.

    python tests/benchmarks/floor.py

Newmark's average acceleration, damping on the initial stiffness, springs at joint points. The
equation of a step is linear once the open points are known, so a step is

    A q = p - b a_g + M x₁ + β K₀ x₂,     A = c_M M + c_K K₀ - Σ_open k g gᵀ,

a product with two band matrices, a back-substitution in the factors of A, and a look at which
openings G q are positive; A is factorised again only when those change. Nothing is recorded, and
nothing is checked. Written for bands, because along a ring every matrix is one.
"""

from dataclasses import dataclass

import numba
import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee
from setting import DAMPING, DT, ground_motion, largest, options, ring
from stepping import Run, warm_up
from timing import least, table, watched

import archfem as af

CASES = [("rigid", "nodal"), ("faces", "nodal"), ("condensed", "nodal"), ("full", "nodal")]
CASES += [("rigid", "lobatto"), ("faces", "lobatto")]
"""Fidelity and quadrature."""

PASSES = 60
"""Over the open points in a step, more than which are never needed."""

compiled = numba.njit(cache=True, fastmath=True, error_model="numpy")


@compiled
def _factorise(matrix, factor, first):
    """Cholesky factor of a band from a row on; `matrix[i, b + j - i]` is entry (i, j), j <= i.

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
    """Solve with a factor in place; x begins with as many zeros as the band is wide."""
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
    """Add M x₁ + β K₀ x₂, both symmetric bands; vectors begin with zeros as in `_substitute`."""
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
    """Update which points are open; return the first row of the matrix that this touches."""
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
    """Rows of A from one on: all closed, less the springs of the open points."""
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
def _known(state, dt, rate, x1, x2):
    """What mass and damping multiply on the right of a step."""
    q, v, a = state
    for k in range(len(q)):
        x2[k] = 2.0 / dt * q[k] + v[k]
        x1[k] = 4.0 / dt**2 * q[k] + 4.0 / dt * v[k] + a[k] + rate * x2[k]


@compiled
def _finish(state, new, dt):
    """Make a state the one at the end of its step."""
    q, v, a = state
    for k in range(len(q)):
        moved = new[k] - q[k]
        a[k] = 4.0 / dt**2 * moved - 4.0 / dt * v[k] - a[k]
        v[k] = 2.0 / dt * moved - v[k]
        q[k] = new[k]


@compiled
def shake(bands, joints, loads, ground, state, dt):
    """Take all steps of dt; returns how often A was factorised.

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
    band = closed.shape[1] - 1
    padded = np.zeros((4, band + len(q)))
    x1, x2, right, new = padded[0, band:], padded[1, band:], padded[2, band:], padded[3, band:]
    for step in range(len(ground)):
        _known(state, dt, rate, x1, x2)
        for k in range(len(q)):
            right[k] = weight[k] - body[k] * ground[step]
        _add_products(mass, padded[0], damping, padded[1], padded[2])
        for _ in range(PASSES):
            padded[3] = padded[2]
            padded[3, :band] = 0.0
            _substitute(factor, padded[3])
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
    """What the loop needs of a run, its coordinates numbered so that bands are narrow."""

    run: Run
    order: np.ndarray
    bands: tuple
    joints: tuple
    loads: tuple
    ground: np.ndarray

    @classmethod
    def of(cls, run: Run) -> "Floor":
        """Take the matrices of the model of a run."""
        model, points = run.model, run.model.operator.points
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
        springs = points.weight * points.normal_stiffness
        times = DT * np.arange(1, run.steps + 1)
        return cls(
            run,
            order,
            (m, DAMPING.stiffness * k, effective),
            (opening.indptr, opening.indices, opening.data, springs),
            (af.statics.self_weight(model)[order], model.body[order, 0].copy(), DAMPING.mass),
            run.motion.at(times)[:, 0].copy(),
        )

    def state(self) -> np.ndarray:
        """The start, of which the loop makes the end (3, n)."""
        start = self.run.start
        rows = [start.q, start.velocity, start.acceleration]
        return np.ascontiguousarray(np.array(rows)[:, self.order])

    def go(self, state: np.ndarray, steps: slice = slice(None)) -> int:
        """Take steps from a state."""
        return shake(self.bands, self.joints, self.loads, self.ground[steps], state, DT)

    def resultants(self) -> np.ndarray:
        """N, V, M after every step, to compare; takes steps one by one."""
        state, found = self.state(), []
        for k in range(len(self.ground)):
            self.go(state, slice(k, k + 1))
            q = np.empty(self.run.model.size)
            q[self.order] = state[0]
            found.append(self.run.model.resultants(q))
        return np.array(found)


def _width(matrix: sparse.coo_matrix) -> int:
    return int(np.abs(matrix.row - matrix.col)[matrix.data != 0.0].max())


def _band(matrix: sparse.coo_matrix, width: int) -> np.ndarray:
    """The lower part of a symmetric matrix, a row of the band for each of its rows."""
    band = np.zeros((matrix.shape[0], width + 1))
    lower = (matrix.col <= matrix.row) & (matrix.data != 0.0)
    row, column = matrix.row[lower], matrix.col[lower]
    band[row, width + column - row] = matrix.data[lower]
    return band


def row_of(case: tuple[str, str], motion: af.Motion, repeat: int) -> list[object]:
    """Run the floor and the stepper archfem takes by itself, on one fidelity and quadrature."""
    fidelity, rule = case
    model = af.build(ring(), fidelity=fidelity, cells=(4, 4), quadrature=rule)
    run = Run(model, motion, "auto")
    chosen = run.stepper.name
    floor = Floor.of(run)
    factorised = floor.go(floor.state()) / run.steps
    lowest = least(watched(lambda: floor.go(floor.state())), run.steps, repeat).cpu
    own = run.clock(repeat).cpu
    off = largest(model.structure, floor.resultants()) - largest(model.structure, run.resultants())
    width = floor.bands[0].shape[1] - 1
    return [
        f"{fidelity}, {rule}, {chosen}",
        model.size,
        width,
        f"{factorised:.2f}",
        f"{lowest:.4f}",
        f"{own:.4f}",
        f"{own / lowest:.1f}",
        f"{off:+.1e}",
    ]


def report(motion: af.Motion, repeat: int) -> str:
    """Run every case and write the table."""
    warm_up(motion)
    head = ["", "unknowns", "band", "factors/step", "floor ms/step", "archfem ms/step", "ratio"]
    rows = [row_of(case, motion, repeat) for case in CASES]
    return table([*head, "max|e| apart"], rows)


if __name__ == "__main__":
    chosen = options(__doc__.splitlines()[0]).parse_args()
    print(report(ground_motion(chosen), chosen.repeat))
