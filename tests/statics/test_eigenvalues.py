"""The lowest pairs of two matrices: all of them, and no others."""

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh

import archfem as af
from archfem.statics import modes
from archfem.statics.modes import count_modes_below, find_lowest_modes, zero_threshold

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
    for count in (4, 7):  # by ARPACK, and by LAPACK
        squares, _ = find_lowest_modes(*thrice, count)
        assert squares == pytest.approx(np.repeat(once, 3)[:count], rel=SAME)


def test_negative_pivots_count_modes(ring):
    model = af.build(ring, fidelity="rigid")
    squares = eigh(model.closed_tangent().toarray(), model.mass.toarray(), eigvals_only=True)
    for count in (0, 1, 20, 50):
        assert (
            count_modes_below(model.closed_tangent(), model.mass, 0.999 * squares[count]) == count
        )


def test_a_mode_that_was_stepped_over_is_noticed(ring, monkeypatch):
    model = af.build(ring, fidelity="rigid")
    monkeypatch.setattr(modes, "count_modes_below", lambda *_: 2)
    with pytest.raises(af.DidNotConverge, match=r"1 modes below .* where there are 2"):
        find_lowest_modes(model.closed_tangent(), model.mass, 2)


def test_pivots_off_the_diagonal_count_nothing():
    """The matrix of zeros and ones has ω² of 1 and -1, and no pivot on its diagonal."""
    swap = sparse.csr_matrix([[0.0, 1.0], [1.0, 0.0]])
    with pytest.raises(af.DidNotConverge, match="a pivot vanishes"):
        count_modes_below(swap, sparse.identity(2, format="csr"), 0.0)


def test_modes_that_are_not_found():
    """Squares that lie within 5e-4 of each other: one restart does not separate them."""
    stiffness = sparse.diags(1.0 + 1e-6 * np.arange(500.0)).tocsr()
    with pytest.raises(af.DidNotConverge, match="of 3 modes in 1 restarts"):
        find_lowest_modes(stiffness, sparse.identity(500, format="csr"), 3, max_restarts=1)


@pytest.mark.parametrize("size", [3, 30])
@pytest.mark.parametrize("least", [-1e6, 1e-9])
def test_a_mechanism_has_no_modes(size, least):
    """A stiffness below the rounding of the stiffest coordinate, 1e-7 here, counts as zero."""
    stiff = sparse.diags([least, *np.linspace(2.0, 1e6, size - 1)]).tocsr()
    with pytest.raises(af.DidNotConverge, match="singular or negative"):
        find_lowest_modes(stiff, sparse.identity(size, format="csr"), 2)


def test_rounding_is_that_of_the_highest_square_of_one_coordinate():
    """K / M of each by itself: 4, 3 and 2 per second squared."""
    stiff, mass = (sparse.diags(each).tocsr() for each in ([4.0, 6.0, 6.0], [1.0, 2.0, 3.0]))
    one = sparse.identity(3, format="csr")
    least = zero_threshold(one, one)
    assert zero_threshold(stiff, mass) == pytest.approx(4.0 * least, rel=1e-12)


def test_a_negative_stiffness_far_from_all_modes_that_are_sought_is_no_frequency_either():
    """The search finds the nearest modes alone, and the factor shows the others."""
    stiffness = sparse.diags([-1e6, *np.linspace(1.0, 1e3, 500)]).tocsr()
    with pytest.raises(af.DidNotConverge, match="singular or negative, with 1 ω² below 0: "):
        find_lowest_modes(stiffness, sparse.identity(501, format="csr"), 2)
