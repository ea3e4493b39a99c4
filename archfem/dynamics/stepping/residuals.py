"""Solution of many equations of a pass by generalised minimal residuals, in single precision.

The method of Saad and Schultz (SIAM J. Sci. Stat. Comput. 7 (1986) 856), without restarts: of all
sums of r, A r, A² r ... the one of which least is left. It ends as soon as that is little, or gives
up once a factor takes no longer.
"""

import numpy as np

from archfem.dynamics.stepping.compliance import DEEP, broad, products
from archfem.joints.moving.compiled import computing, summing

ROUGH = 3e-4
"""Residual that many rows are left with, relative to the first: the next pass takes it up."""


@summing
def minimised(compliance, right):  # type: ignore
    """Solve a system in place by generalised minimal residuals; not if it takes too many products.

    Args:
        compliance: `Compliance`, in the room of which the matrix is, in single precision.
        right: its right side, then the solution (c,).

    Returns:
        Whether it is solved.
    """
    size, square_of, basis, (rotations, left) = len(right), 0.0, compliance.basis, compliance.turned
    upper, wide = compliance.upper, broad(size)
    for k in range(size):
        square_of += right[k] ** 2
    left[0] = first = np.sqrt(square_of)
    if first == 0.0:
        return True
    for k in range(size):
        basis[0, k] = right[k] / first
    for k in range(size, wide):
        basis[0, k] = 0.0
    for step in range(DEEP):
        products(compliance.rough, wide, basis[step][:wide], basis[step + 1][:size])
        for k in range(size, wide):
            basis[step + 1, k] = 0.0
        norm = _made_orthogonal(basis, step + 1, wide, upper[step])
        _rotate(upper[step], step, norm, rotations, left)
        if abs(left[step + 1]) <= ROUGH * first:
            _combined(basis, step + 1, compliance, right)
            return True
    return False


@summing
def _made_orthogonal(basis, number, size, shares):  # type: ignore
    """Take from a vector its shares of those before it, and scale it; what it was as large as."""
    own, square_of, zero = basis[number], 0.0, np.float32(0.0)
    for j in range(number):
        other, share = basis[j], zero
        for k in range(size):
            share += other[k] * own[k]
        shares[j] = share
        for k in range(size):
            own[k] -= share * other[k]
    for k in range(size):
        square_of += own[k] * own[k]
    norm = np.sqrt(square_of)
    inverse = np.float32(1.0 / norm if norm > 0.0 else 0.0)
    for k in range(size):
        own[k] *= inverse
    return norm


@computing
def _rotate(column, step, norm, rotations, left):  # type: ignore
    """Bring a column of shares, and the norm below, into a triangle; what is left follows."""
    for j in range(step):
        above, (cosine, sine) = column[j], rotations[j]
        column[j] = cosine * above + sine * column[j + 1]
        column[j + 1] = cosine * column[j + 1] - sine * above
    length = np.sqrt(column[step] ** 2 + norm**2)
    cosine, sine = column[step] / length, norm / length
    rotations[step, 0], rotations[step, 1], column[step] = cosine, sine, length
    left[step + 1], left[step] = -sine * left[step], cosine * left[step]


@summing
def _combined(basis, count, compliance, right):  # type: ignore
    """Combine vectors so that least is left."""
    upper, left = compliance.upper, compliance.turned[1]
    for k in range(len(right)):
        right[k] = 0.0
    for step in range(count - 1, -1, -1):
        left[step] /= upper[step, step]
        for j in range(step):
            left[j] -= left[step] * upper[step, j]
        own = basis[step]
        for k in range(len(right)):
            right[k] += left[step] * own[k]
