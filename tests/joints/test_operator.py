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


def test_forces_are_those_of_the_tangent_where_nothing_is_offset(operator, q):
    """Without cohesion they are homogeneous: so are springs, facets and Coulomb's limit."""
    gaps = np.stack([operator.openings(q), operator.slips(q)])
    normal, shear = operator.linear_forces(operator.stiffness(q), gaps)
    expected = operator.point_forces(q)
    near = {"abs": 1e-7 * np.abs(expected[0]).max()}  # a sliding point keeps 1e-9 of its stiffness
    assert normal == pytest.approx(expected[0], **near)
    assert shear == pytest.approx(expected[1], **near)


def along_joints(operator, q):
    """Stiffness of slips at the points, relative to the elastic one."""
    stiffness, count = operator.stiffness(q), len(operator.points.offset)
    first = (len(stiffness) - count) // 2
    return stiffness[first : first + count] / operator.points.shear_spring


@pytest.mark.parametrize("size", [1.0, 1e-9])
def test_points_hold_slide_or_are_open(ring, q, size):
    """A sliding point keeps a billionth of its stiffness, however small forces are."""
    operator = af.build(ring, fidelity="rigid", cells=(2, 2), quadrature="lobatto").operator
    normal, _ = operator.point_forces(size * q)
    limit = 0.6 * np.abs(normal)
    held = np.abs(operator.trial_shear(size * q)) <= limit
    expected = np.where(held, 1.0, np.where(limit > 0.0, 1e-9, 0.0))
    assert set(expected) == {0.0, 1e-9, 1.0}
    assert along_joints(operator, size * q) == pytest.approx(expected, rel=1e-12)


@pytest.fixture(scope="module")
def block():
    """A block on a joint of 0.8 m²."""
    contact = af.Contact(2e9, 1e9, 0.5)
    column = af.column(breadth=0.8, heights=[1.0], contact=contact)
    return af.build(column, fidelity="rigid", cells=(2, 1), quadrature="lobatto").operator


@pytest.mark.parametrize(
    ("beyond", "along"), [(-1e-12, 1.0), (0.95e-9, 1.0), (1.05e-9, 1e-9), (1.0, 1e-9)]
)
def test_shear_beyond_friction_by_rounding_still_holds(block, beyond, along):
    """By a billionth of the limit, µ k_n v; what slips less than µ k_n v / k_s holds."""
    pressed = np.array([0.5 * 2e9 * 1e-4 / 1e9 * (1.0 + beyond), -1e-4, 0.0])
    assert along_joints(block, pressed) == pytest.approx(along, rel=1e-9)


def test_an_open_point_resists_nothing(block):
    """Nor does it where it has not slipped at all."""
    assert not block.stiffness(np.array([0.0, 1e-4, 0.0])).any()


def test_elastic_joints_pull_as_they_press(block):
    """k_n A g and k_s A s, whatever is open."""
    gaps = np.array([1e-4, 3e-4])[:, None] * np.ones(len(block.points.offset))
    for side in (1.0, -1.0):
        normal, shear = block.elastic_forces(side * gaps)
        assert normal.sum() == pytest.approx(side * 2e9 * 0.8 * 1e-4)
        assert shear.sum() == pytest.approx(side * 1e9 * 0.8 * 3e-4)


def test_energy_is_that_of_closed_springs(block):
    assert block.energy(np.array([0.0, 1e-4, 0.0])) == 0.0
    stored = 0.5 * 0.8 * (2e9 * 1e-4**2 + 1e9 * 3e-5**2)
    assert block.energy(np.array([3e-5, -1e-4, 0.0])) == pytest.approx(stored)
