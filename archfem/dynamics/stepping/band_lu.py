"""Gauss's elimination in a band, with row exchanges, compiled.

Row i of a band of half-width b holds columns i - b … i + 2 b of a matrix: exchanges fill b more to
the right. The matrix need not be symmetric.
"""

import numpy as np

from archfem.joints.moving.compiled import computing


@computing
def eliminate(band, vector):  # type: ignore
    """Solve a system in place.

    Args:
        band: the matrix, destroyed (n, 3 b + 1).
        vector: right side, then solution (n,).

    Returns:
        Whether the matrix is regular.
    """
    size, half = len(vector), (band.shape[1] - 1) // 3
    far = min(half, size - 1)  # last column that any row so far has an entry in
    for k in range(size):
        pivot = _exchange(band, vector, k, half)
        if pivot < 0:
            return False
        far = min(max(far, pivot + half), size - 1)
        upper = band[k, half + 1 : half + 1 + far - k]
        for i in range(k + 1, min(k + half, size - 1) + 1):
            place = half + k - i
            factor = band[i, place] / band[k, half]
            if factor != 0.0:
                lower = band[i, place + 1 : place + 1 + far - k]
                for j in range(len(upper)):
                    lower[j] -= factor * upper[j]
                vector[i] -= factor * vector[k]
    for k in range(size - 1, -1, -1):
        total = vector[k]
        for j in range(k + 1, min(k + 2 * half, size - 1) + 1):
            total -= band[k, half + j - k] * vector[j]
        vector[k] = total / band[k, half]
    return True


@computing
def _exchange(band, vector, k, half):  # type: ignore
    """Bring the largest entry of a column into row k; returns the row it was in, -1 if none is."""
    size, pivot, largest = len(vector), k, abs(band[k, half])
    for i in range(k + 1, min(k + half, size - 1) + 1):
        if abs(band[i, half + k - i]) > largest:
            pivot, largest = i, abs(band[i, half + k - i])
    if pivot != k:
        shift = k - pivot
        for j in range(k, min(k + 2 * half, size - 1) + 1):
            upper = band[k, half + j - k]
            band[k, half + j - k] = band[pivot, half + j - k + shift]
            band[pivot, half + j - k + shift] = upper
        vector[k], vector[pivot] = vector[pivot], vector[k]
    return pivot if largest > 0.0 else -1


def banded(matrix, half: int):  # type: ignore
    """Return a sparse matrix as a band with room for its elimination (n, 3 b + 1).

    Args:
        matrix: in its order (n, n).
        half: half-width b of the band, at least its own.
    """
    entries = matrix.tocoo()
    band = np.zeros((matrix.shape[0], 3 * half + 1))
    band[entries.row, half + entries.col - entries.row] = entries.data
    return band


def half_width(matrix) -> int:  # type: ignore
    """Return the half-width of a sparse matrix.

    Args:
        matrix: in its order (n, n).
    """
    entries = matrix.tocoo()
    return int(np.abs(entries.row - entries.col).max(initial=0))
