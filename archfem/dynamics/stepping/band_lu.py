"""Gauss's elimination in a band, with row exchanges, compiled.

Row i of a band of half-width b holds columns i - b … i + 2 b of a matrix: exchanges fill b more to
the right. The matrix need not be symmetric.
"""

import numba
import numpy as np

SMALL = 1e-6
"""Pivot, relative to the rest of its row, below which rows must be exchanged."""


@numba.njit(cache=True)
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


@numba.njit(cache=True)
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


@numba.njit(cache=True)
def factorised(band):  # type: ignore
    """Split a matrix into triangles in place, without exchanges.

    Args:
        band: the matrix, then its factors (n, 3 b + 1).

    Returns:
        Whether no pivot has become small, by which exchanges would be needed.
    """
    size, half = band.shape[0], (band.shape[1] - 1) // 3
    for k in range(size):
        pivot, width = band[k, half], min(half, size - 1 - k)
        if not abs(pivot) > SMALL * np.max(np.abs(band[k, half : 2 * half + 1])):
            return False
        upper = band[k, half + 1 : half + 1 + width]
        for i in range(k + 1, k + width + 1):
            place = half + k - i
            factor = band[i, place] / pivot
            if factor != 0.0:
                band[i, place] = factor
                lower = band[i, place + 1 : place + 1 + width]
                for j in range(width):
                    lower[j] -= factor * upper[j]
    return True


@numba.njit(cache=True)
def solved(band, vector):  # type: ignore
    """Solve a system in place by its factors.

    Args:
        band: as `factorised` leaves it (n, 3 b + 1).
        vector: right side, then solution (n,).
    """
    size, half = len(vector), (band.shape[1] - 1) // 3
    for k in range(size):
        width = min(half, k)
        vector[k] -= np.dot(band[k, half - width : half], vector[k - width : k])
    for k in range(size - 1, -1, -1):
        width = min(half, size - 1 - k)
        later = np.dot(band[k, half + 1 : half + 1 + width], vector[k + 1 : k + 1 + width])
        vector[k] = (vector[k] - later) / band[k, half]


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
