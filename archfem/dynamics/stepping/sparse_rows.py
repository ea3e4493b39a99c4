"""Compiled products of matrices and vectors: sparse rows, dense, or a diagonal.

`times`, `add_rows` and `stored` are told apart by the type of the matrix as numba compiles them.
"""

from typing import Any

import numpy as np
from numba.core import types
from numba.extending import overload
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.moving.compiled import inlined

Rows = tuple[Any, Any, Array]
"""A sparse matrix by rows: indptr, indices, data."""

NOTHING = 1e-16
"""Entries of a matrix, relative to its largest, that are rounding left by cancellation."""


def rows_of(matrix: sparse.csr_matrix) -> Rows:
    """Return the rows of a sparse matrix as compiled loops take them.

    Args:
        matrix: by rows (m, n).
    """
    return matrix.indptr, matrix.indices, matrix.data


def trimmed(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """Return a matrix without entries that are nothing but rounding.

    Args:
        matrix: by rows; left as it is.
    """
    kept = matrix.tocsr(copy=True)
    kept.data[np.abs(kept.data) <= NOTHING * np.abs(kept.data).max(initial=0.0)] = 0.0
    kept.eliminate_zeros()
    return kept


def times(matrix: Any, vector: Any, result: Any) -> Any:
    """Multiply a matrix by a vector.

    Args:
        matrix: `Rows` or dense (m, n), or a diagonal (n,).
        vector: by which to multiply (n,).
        result: filled (m,).
    """
    raise NotImplementedError


def add_rows(matrix: Any, rows: Any, force: Any, result: Any) -> Any:
    """Add rows of a matrix, each times its force.

    Args:
        matrix: `Rows` or dense (p, n).
        rows: numbers of those to add.
        force: factors of all rows (p,).
        result: to which they are added (n,).
    """
    raise NotImplementedError


def stored(matrix: Any) -> Any:
    """Return how many entries are stored; none of a matrix that is nothing.

    Args:
        matrix: `Rows`, dense, or a diagonal.
    """
    raise NotImplementedError


@inlined
def row_times(matrix, row, vector):  # type: ignore
    """Return one row of a matrix times a vector.

    Args:
        matrix: `Rows` (m, n).
        row: its number.
        vector: by which to multiply (n,).
    """
    indptr, indices, data = matrix
    total = 0.0
    for entry in range(indptr[row], indptr[row + 1]):
        total += data[entry] * vector[indices[entry]]
    return total


@overload(times)
def _times(matrix, vector, result):  # type: ignore
    if not isinstance(matrix, types.Array):
        return _times_sparse
    return _times_diagonal if matrix.ndim == 1 else _times_dense


def _times_sparse(matrix, vector, result):  # type: ignore
    for row in range(len(result)):
        result[row] = row_times(matrix, row, vector)


def _times_diagonal(matrix, vector, result):  # type: ignore
    for row in range(len(result)):
        result[row] = matrix[row] * vector[row]


def _times_dense(matrix, vector, result):  # type: ignore
    np.dot(matrix, vector, result)


@overload(add_rows)
def _add_rows(matrix, rows, force, result):  # type: ignore
    return _add_dense if isinstance(matrix, types.Array) else _add_sparse


def _add_sparse(matrix, rows, force, result):  # type: ignore
    indptr, indices, data = matrix
    for row in rows:
        if force[row] != 0.0:
            for entry in range(indptr[row], indptr[row + 1]):
                result[indices[entry]] += data[entry] * force[row]


def _add_dense(matrix, rows, force, result):  # type: ignore
    for row in rows:
        if force[row] != 0.0:
            for k in range(len(result)):
                result[k] += matrix[row, k] * force[row]


@overload(stored)
def _stored(matrix):  # type: ignore
    if isinstance(matrix, types.Array):
        return lambda matrix: matrix.size
    return lambda matrix: len(matrix[2])
