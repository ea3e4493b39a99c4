"""Matrices on one pattern are the matrices themselves."""

import numpy as np
import pytest
from scipy import sparse

from archfem.joints.operator import Pattern


@pytest.fixture
def pair():
    """Two sparse matrices with different entries."""
    return [sparse.random(7, 7, 0.3, "csr", random_state=seed) for seed in (1, 2)]


def test_sums_are_sums_of_data(pair):
    pattern = Pattern.of(*pair)
    first, second = (pattern.spread(matrix) for matrix in pair)
    assert (first - pair[0]).nnz == 0
    both = pattern.with_data(2.0 * first.data + second.data)
    assert both.toarray() == pytest.approx((2.0 * pair[0] + pair[1]).toarray())


def test_outer_products_are_summed_by_a_map(pair):
    left, right = pair[0][:4], pair[1][:4]
    pattern = Pattern.of((left.T @ right + sparse.identity(7)).tocsr())
    factors = np.array([2.0, -1.0, 0.5, 3.0])
    found = pattern.with_data(pattern.outer_product_map(left, right) @ factors)
    expected = (left.T @ sparse.diags(factors) @ right).toarray()
    assert found.toarray() == pytest.approx(expected)


def test_entries_outside_are_an_error_of_ours(pair):
    with pytest.raises(AssertionError, match="outside the pattern"):
        Pattern.of(pair[0]).spread(pair[1])
