"""Lowest modes of small dense matrices by LAPACK, where SLEPc is not installed."""

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from archfem._optional import missing_package_message
from archfem._typing import Array
from archfem.errors import DidNotConverge, NotInstalled


def find_lowest_modes(
    stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, count: int
) -> tuple[Array, Array]:
    """Find the lowest ω² and their shapes, with φᵀ M φ = 1."""
    size = mass.shape[0]
    if size > 3000:  # dense matrices take 300 MB there, and LAPACK a quarter of a minute
        message = f"{size} coordinates are too many for LAPACK"
        raise NotInstalled(missing_package_message("SLEPc", message))
    dense = stiffness.toarray()
    squares, shapes = eigh(0.5 * (dense + dense.T), mass.toarray(), subset_by_index=(0, count - 1))
    check_lowest(float(squares[0]), zero_threshold(stiffness, mass))
    return squares, shapes


def zero_threshold(stiffness: sparse.csr_matrix, mass: sparse.csr_matrix) -> float:
    """Return the largest ω² that may be round-off of zero [1/s²]."""
    # relative to the largest ω² of a single coordinate; round-off stays well below 1e-13 of it
    return 1e-13 * float(np.max(stiffness.diagonal() / mass.diagonal()))


def check_lowest(square: float, zero: float) -> None:
    """Refuse a structure with a motion of no stiffness, by its lowest ω² [1/s²]."""
    if square <= zero:
        raise DidNotConverge(
            f"the stiffness is singular or negative, with ω² = {square:.1e} 1/s² where rounding "
            f"makes up to {zero:.0e}: a mechanism; check supports and joints, or take another state"
        )
