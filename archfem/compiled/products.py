"""Compiled products of sparse matrices, given by rows, and vectors."""

from typing import Any

import numba

from archfem.structure import Array

Rows = tuple[Any, Any, Array]
"""A sparse matrix by rows: indptr, indices, data."""


@numba.njit(cache=True)
def row_times(matrix, row, vector):  # type: ignore
    """One entry of a sparse matrix times a vector."""
    indptr, indices, data = matrix
    total = 0.0
    for entry in range(indptr[row], indptr[row + 1]):
        total += data[entry] * vector[indices[entry]]
    return total


@numba.njit(cache=True)
def add_rows(matrix, rows, force, result):  # type: ignore
    """Add rows of a sparse matrix, each times its force."""
    indptr, indices, data = matrix
    for row in rows:
        if force[row] != 0.0:
            for entry in range(indptr[row], indptr[row + 1]):
                result[indices[entry]] += data[entry] * force[row]


@numba.njit(cache=True)
def times(matrix, vector, result):  # type: ignore
    """Product of sparse rows (indptr, indices, data) and a vector."""
    for row in range(len(result)):
        result[row] = row_times(matrix, row, vector)
