"""Time stepping for chains of blocks: time and memory grow with their number, not its square.

Where blocks follow one another the matrices have a small bandwidth, and a step is one solve with
a banded factor that is made anew only when a joint point changes status. It gives the history of
the equilibrium solves of `dynamics`, to rounding, like `contact`, and is the faster of the two for
long structures; it also takes any damping.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from archfem.compiled import band
from archfem.compiled.batches import Reordered, Room, compiled_law, shear_resultants
from archfem.dynamics import Stepper
from archfem.models.jointed import Jointed
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
    return model.operator.offset is None and width <= WIDEST


def work(model: Jointed, width: int) -> float:
    """About how long a step takes with joints that open often [µs]."""
    return model.size * (0.3 + 0.015 * width + 0.45e-3 * width**2)


def order(model: Jointed) -> tuple[NDArray[np.int64], int]:
    """An order of the coordinates that brings couplings near the diagonal, and the bandwidth."""
    found = reverse_cuthill_mckee(model.mass, symmetric_mode=True)
    natural = np.arange(model.size)
    best = min((found, natural), key=lambda each: _bandwidth(model.mass, each))
    return best, _bandwidth(model.mass, best)


def _bandwidth(matrix: sparse.csr_matrix, permutation: Array) -> int:
    place = np.argsort(permutation)
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    return int(np.abs(place[rows] - place[matrix.indices]).max(initial=0))


class ChainMethod(Reordered):
    """Steps on a model's matrices of small bandwidth.

    Args:
        exact: the same steps, and what they are made of.
    """

    name = "chain"

    def __init__(self, exact: Stepper) -> None:
        assert isinstance(exact.model, Jointed)
        self._exact = exact
        self._model = exact.model
        places, self._width = order(self._model)
        super().__init__(places)
        self._weight = exact.weight[self._order]
        self._body = self._model.body[self._order]
        self._law = compiled_law(self._model)
        self._step: tuple[float, Matrices, tuple[float, ...]] | None = None

    def take(self, dt: float, room: Room) -> int:
        """Take steps up to the last, or up to one whose joints do not settle."""
        matrices, numbers = self._prepared(dt)
        gaps = np.empty((len(room.series), len(room.gap)))
        gaps[0] = room.gap
        count = band.advance(
            room.series,
            gaps,
            room.resultants,
            room.iterations,
            self._weight - room.seen @ self._body.T,
            matrices,
            numbers,
            self._law,
        )
        room.energy[:count] = band.energies(
            room.series[: count + 1],
            (self._weight, -room.mean[:count] @ self._body.T),
            matrices,
            self._exact.lag,
            self._law,
        )
        return int(count)

    def _prepared(self, dt: float) -> tuple[Matrices, tuple[float, ...]]:
        """What a step of this length needs."""
        if self._step is None or self._step[0] != dt:
            scheme = self._exact.scheme
            share = 1.0 + scheme.alpha
            rate = scheme.gamma / (scheme.beta * dt)
            numbers = (scheme.beta, scheme.gamma, share, self._exact.lag, dt)
            self._step = (dt, self._matrices(dt, share, rate), numbers)
        return self._step[1:]

    def _matrices(self, dt: float, share: float, rate: float) -> Matrices:
        model, joints = self._model, self._model.operator
        always = model.blocks + joints.shear_stiffness()
        parts = [self._ordered(part) for part in (model.mass, self._exact.damping, always)]
        mass, damping, stiffness = parts
        linear = (
            mass / (self._exact.scheme.beta * dt**2)
            + share * rate * damping
            + share * (1.0 + self._exact.lag * rate) * stiffness
        )
        pattern = (abs(mass) + abs(damping) + abs(stiffness)).tocsr()
        pattern.sort_indices()
        zero = pattern * 0.0
        opening = joints.opening[:, self._order].tocsr()
        shear = shear_resultants(model)[:, self._order].tocsr()
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
