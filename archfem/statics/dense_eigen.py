"""The lowest vibrations of small matrices, by LAPACK, for where SLEPc is not installed."""

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from archfem.arrays import Array
from archfem.errors import DidNotConverge, NotInstalled
from archfem.packages import lacking

ROUNDING = 1e-13
"""Of the largest ω² of a coordinate by itself: what rounding makes of a zero stays well below."""

MOST = 3000
"""Coordinates, of which dense matrices take 300 MB and LAPACK a quarter of a minute."""


def lowest(
    stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, count: int
) -> tuple[Array, Array]:
    """Find the lowest ω² and their shapes, so that φᵀ M φ = 1.

    Args:
        stiffness: K (n, n), symmetric.
        mass: M (n, n), symmetric and positive.
        count: how many, from 1 to n.

    Returns:
        ω² in ascending order (count,) [1/s²], shapes (n, count).

    Raises:
        DidNotConverge: K is singular or negative.
        NotInstalled: there are more coordinates than dense matrices are good for.
    """
    size = mass.shape[0]
    if size > MOST:
        raise NotInstalled(lacking("SLEPc", f"{size} coordinates are too many for LAPACK"))
    dense = stiffness.toarray()
    squares, shapes = eigh(0.5 * (dense + dense.T), mass.toarray(), subset_by_index=(0, count - 1))
    zero = nothing(stiffness, mass)
    if squares[0] <= zero:
        raise DidNotConverge(mechanism(float(squares[0]), zero))
    return squares, shapes


def nothing(stiffness: sparse.csr_matrix, mass: sparse.csr_matrix) -> float:
    """Return what an ω² may be by rounding alone [1/s²].

    Args:
        stiffness: K (n, n).
        mass: M (n, n).
    """
    return ROUNDING * float(np.max(stiffness.diagonal() / mass.diagonal()))


def mechanism(square: float, zero: float) -> str:
    """Return what to say of a structure that something holds by no stiffness.

    Args:
        square: its lowest ω² [1/s²].
        zero: what rounding may make of a zero [1/s²].
    """
    return (
        f"the stiffness is singular or negative, with ω² = {square:.1e} 1/s² where rounding makes "
        f"up to {zero:.0e}: a mechanism; check supports and joints, or take another state"
    )
