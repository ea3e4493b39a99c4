"""Cholesky's factor of a band, whose rows run from the diagonal leftwards, compiled."""

import numba
import numpy as np


@numba.njit(cache=True)
def factorise(band, factor):  # type: ignore
    """Factorise a band.

    Args:
        band: lower band of a symmetric matrix, rows from the diagonal leftwards (n, width).
        factor: filled in the same form (n, width).

    Returns:
        Whether the matrix is positive definite; where it is not, the factor is half done.
    """
    size, width = band.shape
    for i in range(size):
        for d in range(min(width - 1, i), -1, -1):
            j = i - d
            total = band[i, d]
            for m in range(1, min(width - d, j + 1)):
                total -= factor[i, d + m] * factor[j, m]
            if d > 0:
                factor[i, d] = total / factor[j, 0]
            elif total > 0.0:
                factor[i, 0] = np.sqrt(total)
            else:
                return False
    return True


@numba.njit(cache=True)
def substitute(factor, vector):  # type: ignore
    """Solve with the factor, in place.

    Args:
        factor: as made by `factorise` (n, width).
        vector: right side, then solution (n,).
    """
    size, width = factor.shape
    for i in range(size):
        total = vector[i]
        for d in range(1, min(width, i + 1)):
            total -= factor[i, d] * vector[i - d]
        vector[i] = total / factor[i, 0]
    for i in range(size - 1, -1, -1):
        value = vector[i] / factor[i, 0]
        vector[i] = value
        for d in range(1, min(width, i + 1)):
            vector[i - d] -= factor[i, d] * value
