"""Compiled products of sparse matrices, by rows, with vectors."""

from typing import Any

import numpy as np
from scipy import sparse

from archfem._numba import inlined_kernel, kernel
from archfem._typing import Array

# A sparse matrix by rows: indptr, indices, data
SparseRows = tuple[Any, Any, Array]


def sparse_rows(matrix: sparse.csr_matrix) -> SparseRows:
    """Return the rows of a sparse matrix as compiled loops take them."""
    # compiled indices without a sign need no check of it, and products take a third of the time
    return matrix.indptr.astype(np.uint32), matrix.indices.astype(np.uint32), matrix.data


def without_round_off(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """Return a matrix without the entries that cancellation left at the size of rounding."""
    result = matrix.tocsr(copy=True)
    # 1e-16 of the largest entry: half a unit in its last place
    result.data[np.abs(result.data) <= 1e-16 * np.abs(result.data).max(initial=0.0)] = 0.0
    result.eliminate_zeros()
    return result


@inlined_kernel
def row_times(matrix, row, vector):  # type: ignore
    """Return one row of a matrix times a vector."""
    indptr, indices, data = matrix
    total = 0.0
    for entry in range(indptr[row], indptr[row + 1]):
        total += data[entry] * vector[indices[entry]]
    return total


@kernel
def multiply(matrix, vector, result):  # type: ignore
    """Multiply a matrix by a vector (n,) into a result (m,)."""
    for row in range(len(result)):
        result[row] = row_times(matrix, row, vector)


@kernel
def add_rows(matrix, factors, result):  # type: ignore
    """Add all rows of a matrix, each times its factor (m,), to a vector (n,)."""
    indptr, indices, data = matrix
    for row in range(len(factors)):
        # most factors are zero: forces that joints release
        if factors[row] != 0.0:
            for entry in range(indptr[row], indptr[row + 1]):
                result[indices[entry]] += data[entry] * factors[row]
