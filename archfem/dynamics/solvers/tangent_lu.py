"""The tangent of Newton's method and its factor: in a narrow band, else in panels.

Panels are those of `supernodal_lu`. A band is factorised with row exchanges: row i of a band of
half-width b holds columns i - b … i + 2 b of a matrix, as row exchanges fill b more to the right.
Rows overlap in memory by their shift, so that column j of row i lies at b + i (w - 1) + j, w
entries a row: loops then run over columns of the matrix itself.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from archfem._numba import kernel, summing_kernel, view_kernel
from archfem._typing import Array
from archfem.dynamics.solvers.base import is_system
from archfem.dynamics.solvers.supernodal_lu import (
    Elimination,
    Indices,
    add_ancestors,
    eliminate,
    panel_places,
    panels_of,
    solve_panels,
)


class Band(NamedTuple):
    """A matrix of which some entries change, as a band, and its factor."""

    half_width: int  # b
    base: Array  # entries without changes (n w,)
    entries: Array  # of the matrix, then of its triangles, pivots inverted (n w,)
    pivots: Indices  # row with which each was exchanged, and entries right of it (2, n)
    group_of: Indices  # as of panels: one group of all coordinates (n,)
    changed: Any  # whether it has changed (1,)


def band_of(matrix: sparse.csr_matrix, half: int) -> Band:
    """Return a matrix as a band of at least its own half-width."""
    entries, size = matrix.tocoo(), matrix.shape[0]
    base = np.zeros(size * (3 * half + 1))
    pivots, group_of = np.zeros((2, size), np.int64), np.zeros(size, np.int64)
    band = Band(half, base, np.zeros_like(base), pivots, group_of, np.ones(1, bool))
    base[band_places(band, entries.row, entries.col)] = entries.data
    band.entries[:] = base
    return band


def band_places(band: Band, rows: Any, columns: Any) -> Indices:
    """Return the positions in `entries` of the matrix entries at some rows and columns (k,)."""
    return np.asarray(band.half_width + 3 * band.half_width * rows + columns)


def half_width(matrix: sparse.csr_matrix) -> int:
    """Return the half-width of a sparse matrix in its order."""
    entries = matrix.tocoo()
    return int(np.abs(entries.row - entries.col).max(initial=0))


def narrow_order(pattern: sparse.csr_matrix) -> tuple[Any, int]:
    """Return the order of coordinates with the narrower band, and its half-width."""
    natural = np.arange(pattern.shape[0])
    orders = natural, reverse_cuthill_mckee(pattern, symmetric_mode=True)
    widths = [half_width(pattern[order][:, order]) for order in orders]
    best = int(np.argmin(widths))
    return orders[best], widths[best]


@dataclass(frozen=True, eq=False)
class TangentStorage:
    """Order of the coordinates in which tangents of one pattern are stored, as bands or panels."""

    order: Any  # coordinates (n,)
    half_width: int  # of a band in its narrowest order
    elimination: Elimination | None  # of panels; None for a band

    @classmethod
    def of(cls, pattern: sparse.csr_matrix, max_half_width: int) -> "TangentStorage":
        """Return the storage for a pattern: in panels where its band is wider than a maximum."""
        order, width = narrow_order(pattern)
        if width <= max_half_width:
            return cls(order, width, None)
        elimination = Elimination.of(pattern)
        return cls(elimination.order, width, elimination)

    def store(self, matrix: sparse.csr_matrix, rows: Any, columns: Any) -> tuple[Any, Any]:
        """Store a matrix; returns also the places of its entries that change (row, column)."""
        if self.elimination is None:
            band = band_of(matrix, self.half_width)
            return band, band_places(band, rows, columns).astype(np.uint32)
        panels = panels_of(matrix, self.elimination, rows, columns)
        return panels, panel_places(panels, rows, columns).astype(np.uint32)


def factorise(tangent: Any) -> Any:
    """Factorise a tangent, in panels only what has changed; returns its regularity; overloaded."""
    raise NotImplementedError


def solve(tangent: Any, vector: Any) -> Any:
    """Solve in place by the factor of a tangent; overloaded."""
    raise NotImplementedError


@overload(factorise, inline="always")
def _factorise(tangent):  # type: ignore
    if is_system(tangent, Band):
        return lambda tangent: factorise_band(tangent)
    return lambda tangent: eliminate(add_ancestors(tangent))


@overload(solve, inline="always")
def _solve(tangent, vector):  # type: ignore
    if is_system(tangent, Band):
        return lambda tangent, vector: solve_band(tangent, vector)
    return lambda tangent, vector: solve_panels(tangent, vector)


@view_kernel
def _rows(band):  # type: ignore
    """Return a view of the band whose indices are row and column of the full matrix."""
    half, size = band.half_width, band.pivots.shape[1]
    return band.entries[half : half + 3 * half * size].reshape((size, 3 * half))


@summing_kernel
def factorise_band(band):  # type: ignore
    """Factorise the matrix in `entries` in place; returns whether it is regular."""
    matrix, half, size = _rows(band), band.half_width, band.pivots.shape[1]
    far = 0  # last column in which any row so far has an entry
    for k in range(size):
        last = min(k + half, size - 1)
        pivot = _choose_pivot(matrix, k, last)
        if pivot < 0:
            return False
        if pivot != k:
            for j in range(k, min(k + 2 * half, size - 1) + 1):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        far = min(max(far, pivot + half), size - 1)
        band.pivots[0, k], band.pivots[1, k] = pivot, far
        # elimination of the column below the pivot, which is stored as its inverse
        inverse = 1.0 / matrix[k, k]
        matrix[k, k] = inverse
        for i in range(k + 1, last + 1):
            multiplier = matrix[i, k] * inverse
            matrix[i, k] = multiplier
            if multiplier != 0.0:
                for j in range(k + 1, far + 1):
                    matrix[i, j] -= multiplier * matrix[k, j]
    return True


@kernel
def _choose_pivot(matrix, k, last):  # type: ignore
    """Return the row to become row k, -1 if its column is zero.

    Threshold pivoting: the diagonal serves unless it is below a tenth of the largest entry, as
    exchanges widen the band and inertia makes the diagonal large.
    """
    pivot, own = k, abs(matrix[k, k])
    largest = own
    for i in range(k + 1, last + 1):
        if abs(matrix[i, k]) > largest:
            pivot, largest = i, abs(matrix[i, k])
    if not 0.0 < largest < np.inf:
        return -1
    return k if own >= 0.1 * largest else pivot


@summing_kernel
def solve_band(band, vector):  # type: ignore
    """Solve in place by the factor."""
    matrix, half, size = _rows(band), band.half_width, len(vector)
    for k in range(size):
        # row exchanges are interleaved with the elimination, as they were in the factor
        pivot = band.pivots[0, k]
        if pivot != k:
            vector[k], vector[pivot] = vector[pivot], vector[k]
        value = vector[k]
        for i in range(k + 1, min(k + half, size - 1) + 1):
            vector[i] -= matrix[i, k] * value
    # back substitution, up to the last column that fill reaches in each row
    for k in range(size - 1, -1, -1):
        value = vector[k]
        for j in range(k + 1, band.pivots[1, k] + 1):
            value -= matrix[k, j] * vector[j]
        vector[k] = value * matrix[k, k]
