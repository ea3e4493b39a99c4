"""The lowest pairs of two matrices: all of them, and no others."""

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh

import archfem as af
from archfem.statics.slepc_eigensolver import count_modes_below, find_lowest_modes

SAME = 1e-9
"""Two ways to the same numbers: rounding of a stiffness whose ω² span eight decades."""


def block():
    """A stone on a joint, rigid: three coordinates."""
    material = af.Material(30e9, 0.2, 19620.0)
    shape = af.column(
        breadth=0.6, heights=[2.4], contact=af.Contact(1e9, 4e8, 0.6), material=material
    )
    return af.build(shape, fidelity="rigid")


def test_equal_frequencies_are_all_found():
    model = block()
    thrice = [
        sparse.block_diag([each] * 3, format="csr") for each in (model.closed_tangent(), model.mass)
    ]
    once = eigh(model.closed_tangent().toarray(), model.mass.toarray(), eigvals_only=True)
    squares, _ = find_lowest_modes(*thrice, 7)
    assert squares == pytest.approx(np.repeat(once, 3)[:7], rel=SAME)


def test_negative_pivots_count_modes(ring):
    model = af.build(ring, fidelity="rigid")
    squares = eigh(model.closed_tangent().toarray(), model.mass.toarray(), eigvals_only=True)
    for count in (0, 1, 20, 50):
        assert (
            count_modes_below(model.closed_tangent(), model.mass, 0.999 * squares[count]) == count
        )


def test_a_mode_that_was_stepped_over_is_noticed():
    model = block()
    with pytest.raises(af.DidNotConverge, match=r"1 modes below .* where there are 2"):
        find_lowest_modes(model.closed_tangent(), model.mass, 2, check=lambda *_: 2)


def test_modes_that_are_not_found(ring):
    model = af.build(ring, fidelity="full", cells=(2, 2))
    with pytest.raises(af.DidNotConverge, match="of 3 modes in 1 iterations"):
        find_lowest_modes(model.closed_tangent(), model.mass, 3, accuracy=1e-40, iterations=1)


def test_negative_stiffness_is_no_frequency():
    stiffness = sparse.diags([-1e6, 2.0, 3.0]).tocsr()
    with pytest.raises(af.DidNotConverge, match="singular or negative"):
        find_lowest_modes(stiffness, sparse.identity(3, format="csr"), 2)


def test_a_negative_stiffness_far_from_all_modes_that_are_sought_is_no_frequency_either():
    """The search comes to the nearest modes alone, and the factor tells of the others."""
    stiffness = sparse.diags([-1e6, *np.linspace(1.0, 1e3, 500)]).tocsr()
    with pytest.raises(af.DidNotConverge, match=r"singular or negative, with ω² = 1\.0e"):
        find_lowest_modes(stiffness, sparse.identity(501, format="csr"), 2)
