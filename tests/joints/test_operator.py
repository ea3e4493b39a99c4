"""The joint operator: forces and their tangent, and the same joints in other coordinates."""

import numpy as np
import pytest
from glued import glued
from scipy import sparse

import archfem as af
from archfem.joints.contact_law import is_closed


@pytest.fixture(params=["lobatto", "exact"])
def model(request, ring):
    """The ring's rigid stones: nothing is elastic but the joints."""
    return af.build(ring, fidelity="rigid", cells=(2, 2), quadrature=request.param)


@pytest.fixture
def operator(model):
    return model.operator


@pytest.fixture
def q(operator):
    """Small motions of the stones, by which some points are open and some closed."""
    q = 1e-4 * np.random.default_rng(5).standard_normal(operator.opening.shape[1])
    assert (
        0 < is_closed(operator.effective_gaps(q)).sum() < len(is_closed(operator.effective_gaps(q)))
    )
    return q


def test_matrices_sum_up_to_the_tangent(model, operator, q):
    """Away from a change of status, forces are linear by springs, smooth by exact integrals."""
    step = 1e-9 * np.random.default_rng(6).standard_normal(len(q))
    change = operator.force(q + step) - operator.force(q - step)
    expected = 2.0 * model.tangent(q) @ step
    assert change == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("rule", ["lobatto", "exact"])
def test_force_is_the_slope_of_the_energy_where_nothing_slides(ring, rule, q):
    operator = af.build(glued(ring), fidelity="rigid", cells=(2, 2), quadrature=rule).operator
    step = 1e-9 * np.random.default_rng(6).standard_normal(len(q))
    change = operator.energy(q + step) - operator.energy(q - step)
    assert change == pytest.approx(2.0 * operator.force(q) @ step, rel=1e-5)


def test_a_basis_gives_the_same_joints(operator, q):
    basis = sparse.csr_matrix(np.random.default_rng(7).standard_normal((len(q), 4)))
    z = 1e-5 * np.arange(1.0, 5.0)
    same = operator.projected(basis)
    assert same.openings(z) == pytest.approx(operator.openings(basis @ z))
    assert same.resultants(z) == pytest.approx(operator.resultants(basis @ z))
    assert same.force(z) == pytest.approx(basis.T @ operator.force(basis @ z))


def test_supports_that_have_moved_open_joints_at_rest(ring):
    model = af.build(ring, fidelity="rigid", cells=(2, 2))
    sunk = model.settled(af.Settlement("right abutment", (1e-3, 0.0, 0.0))).operator
    at_rest = np.zeros(model.size)
    assert model.operator.openings(at_rest).max() == 0.0
    last = sunk.points.joint == len(ring.joints) - 1
    normal, tangent = ring.normals[-1], ring.tangents[-1]
    assert sunk.openings(at_rest)[last] == pytest.approx(1e-3 * normal[0])
    assert sunk.slips(at_rest)[last] == pytest.approx(1e-3 * tangent[0])
    assert np.all(sunk.openings(at_rest)[~last] == 0.0)
