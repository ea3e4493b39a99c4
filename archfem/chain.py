"""Time stepping for chains of blocks: time and memory grow with their number, not its square.

Where blocks follow one another the matrices have a small bandwidth, and a step is one solve with
a banded factor that is made anew only when a joint point changes status. It gives the history of
the equilibrium solves of `dynamics`, to rounding, like `contact`, and is the faster of the two for
long structures; it also takes any damping.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from archfem import band
from archfem.batches import compiled_law, in_batches
from archfem.dynamics import Batch, State, Stepper
from archfem.models.jointed import Jointed
from archfem.motion import Motion
from archfem.newton import Newton
from archfem.schemes import Rayleigh, Scheme
from archfem.structure import Array


class Matrices(NamedTuple):
    """A model's matrices on one pattern, in an order of small bandwidth.

    Attributes:
        indptr: of the pattern.
        indices: of the pattern.
        mass: entries of M.
        damping: entries of C.
        always: entries of the stiffness that never changes, of blocks and slips.
        linear: A as a band, rows from the diagonal leftwards (n, width).
        opening: openings at the points as sparse rows (indptr, indices, data).
        shear: shear resultants of the joints, likewise.
    """

    indptr: Any
    indices: Any
    mass: Array
    damping: Array
    always: Array
    linear: Array
    opening: tuple[Any, Any, Any]
    shear: tuple[Any, Any, Any]


WIDEST = 64
"""Bandwidth up to which a factor is made anew whenever a joint opens."""


def applies(model: Jointed, width: int) -> bool:
    """Whether the blocks follow one another closely enough, their bandwidth being this."""
    return model.joints.offset is None and width <= WIDEST


def work(model: Jointed, width: int) -> float:
    """About how many multiplications of `contact` a step is worth, with joints that open often."""
    return model.size * (0.5 * width**2 + 20.0 * width) + 6.0 * model.joints.opening.nnz


def order(model: Jointed) -> tuple[Array, int]:
    """An order of the coordinates that brings couplings near the diagonal, and the bandwidth."""
    found = reverse_cuthill_mckee(model.mass, symmetric_mode=True)
    natural = np.arange(model.size)
    best = min((found, natural), key=lambda each: _bandwidth(model.mass, each))
    return best, _bandwidth(model.mass, best)


def _bandwidth(matrix: sparse.csr_matrix, permutation: Array) -> int:
    place = np.argsort(permutation)
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    return int(np.abs(place[rows] - place[matrix.indices]).max(initial=0))


class ChainStepper:
    """Advances a model of small bandwidth under a ground motion.

    A step whose joints do not settle is taken by SNES instead.
    """

    name = "chain"

    def __init__(
        self,
        model: Jointed,
        motion: Motion,
        *,
        damping: Rayleigh | None = None,
        scheme: Scheme | None = None,
        newton: Newton | None = None,
    ) -> None:
        self.model = model
        self.motion = motion
        self.exact = Stepper(model, motion, damping=damping, scheme=scheme, newton=newton)
        self.lag = self.exact.lag
        self._order, self._width = order(model)
        self._weight = self.exact.weight[self._order]
        self._body = model.body[self._order]
        self._law = compiled_law(model)
        self._step: tuple[float, Matrices, tuple[float, ...]] | None = None

    def at_rest(self, q: Array, time: float = 0.0) -> State:
        """The state of a structure at rest as the ground begins to move."""
        return self.exact.at_rest(q, time)

    def energy(self, state: State) -> Array:
        """Kinetic and potential energy of a state, and two zeros (4,) [J]."""
        return self.exact.energy(state)

    def batches(self, start: State, dt: float, end: float) -> Iterator[Batch]:
        """Yield the steps to the end, many at a time.

        Args:
            start: state from which to go.
            dt: time step [s].
            end: time of the last step [s].

        Raises:
            DidNotConverge: SNES failed as well; `last` is the state before.
        """
        return in_batches(self._batch, self.exact, start, dt=dt, end=end)

    def _batch(self, state: State, dt: float, times: Array) -> tuple[Batch, bool]:
        """Take steps up to these times, or up to one whose joints do not settle."""
        matrices, numbers = self._prepared(dt)
        place = np.argsort(self._order)
        series = np.empty((len(times) + 1, 3, self.model.size))
        series[0] = np.stack([state.q, state.velocity, state.acceleration])[:, self._order]
        gaps = np.empty((len(series), len(self._law[1])))
        gaps[0] = self.model.joints.opening @ (state.q + self.lag * state.velocity)
        resultants = np.empty((len(times), self.model.joints.points.count, 3))
        iterations = np.zeros(len(times), dtype=np.int64)
        loads = self._weight + self._ground(times + self.exact.scheme.alpha * dt)
        count = band.advance(
            series, gaps, resultants, iterations, loads, matrices, numbers, self._law
        )
        ground = self._ground(np.append(times[0] - dt, times[:count]))
        batch = Batch(
            times[:count],
            resultants[:count],
            iterations[:count],
            np.full(count, dt),
            band.energies(
                series[: count + 1],
                (self._weight, 0.5 * (ground[:-1] + ground[1:])),
                matrices,
                self.lag,
                self._law,
            ),
            lambda k: State(float(times[k]), *(row[place] for row in series[k + 1])),
        )
        return batch, count == len(times)

    def _ground(self, times: Array) -> Array:
        """Forces of the ground (steps, n)."""
        return -self.motion.at(times) @ self._body.T

    def _prepared(self, dt: float) -> tuple[Matrices, tuple[float, ...]]:
        """What a step of this length needs."""
        if self._step is None or self._step[0] != dt:
            scheme = self.exact.scheme
            share = 1.0 + scheme.alpha
            rate = scheme.gamma / (scheme.beta * dt)
            numbers = (scheme.beta, scheme.gamma, share, self.lag, dt)
            self._step = (dt, self._matrices(dt, share, rate), numbers)
        return self._step[1], self._step[2]

    def _matrices(self, dt: float, share: float, rate: float) -> Matrices:
        model, joints = self.model, self.model.joints
        always = model.blocks + joints.shear_stiffness()
        parts = [self._ordered(part) for part in (model.mass, self.exact.damping, always)]
        mass, damping, stiffness = parts
        linear = (
            mass / (self.exact.scheme.beta * dt**2)
            + share * rate * damping
            + share * (1.0 + self.lag * rate) * stiffness
        )
        pattern = (abs(mass) + abs(damping) + abs(stiffness)).tocsr()
        pattern.sort_indices()
        zero = pattern * 0.0
        opening = joints.opening[:, self._order].tocsr()
        shear = (joints.sums[0] @ joints.law.shear @ joints.slip)[:, self._order].tocsr()
        entries = [_entries(part, zero) for part in parts]
        return Matrices(
            pattern.indptr,
            pattern.indices,
            entries[0],
            entries[1],
            entries[2],
            _banded(linear, self._width),
            (opening.indptr, opening.indices, opening.data),
            (shear.indptr, shear.indices, shear.data),
        )

    def _ordered(self, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
        return matrix.tocsr()[self._order][:, self._order]


def _entries(matrix: sparse.csr_matrix, zero: sparse.csr_matrix) -> Array:
    """Entries of a matrix on a larger pattern."""
    rows = np.repeat(np.arange(zero.shape[0], dtype=np.int64), np.diff(zero.indptr))
    keys = rows * zero.shape[1] + zero.indices
    own = matrix.tocoo()
    data = np.zeros(len(keys))
    found = np.searchsorted(keys, own.row.astype(np.int64) * zero.shape[1] + own.col)
    keep = own.data != 0.0
    data[found[keep]] = own.data[keep]
    return data


def _banded(matrix: sparse.csr_matrix, width: int) -> Array:
    """Lower band of a symmetric matrix, rows from the diagonal leftwards (n, width + 1)."""
    entries = matrix.tocoo()
    left = entries.row - entries.col
    lower = (left >= 0) & (left <= width)
    result = np.zeros((matrix.shape[0], width + 1))
    result[entries.row[lower], left[lower]] = entries.data[lower]
    return result
