"""Rules along a joint: polynomials that they integrate exactly, and their points."""

import numpy as np
import pytest

import archfem as af
from archfem.joints import Quadrature

BREAKS = np.array([-0.3, -0.1, 0.05, 0.3])


@pytest.mark.parametrize(
    ("rule", "points", "exact"),
    [
        ("lobatto", 2, 1),
        ("lobatto", 3, 3),
        ("lobatto", 4, 5),
        ("gauss", 1, 1),
        ("gauss", 2, 3),
        ("gauss", 3, 5),
    ],
)
def test_polynomials_are_integrated_exactly_up_to_the_degree(rule, points, exact):
    x, w = Quadrature(rule, points).on_joint(BREAKS)
    for degree in range(exact + 2):
        integral = (0.3 ** (degree + 1) - (-0.3) ** (degree + 1)) / (degree + 1)
        error = abs(w @ x**degree - integral)
        assert (error < 1e-15) == (degree <= exact or (degree % 2 == 1 and error < 1e-15))


def test_shared_points_are_given_once():
    assert len(Quadrature("lobatto", 64).on_joint(BREAKS)[0]) == 3 * 63 + 1
    assert len(Quadrature().on_joint(BREAKS)[0]) == 7
    assert len(Quadrature("nodal").on_joint(np.linspace(0, 1, 5))[0]) == 5  # the paper's springs
    assert len(Quadrature("gauss").on_joint(BREAKS)[0]) == 9


@pytest.mark.parametrize(
    ("points", "weights"),
    [
        (None, [0.5, 0.5]),
        (3, [0.25, 0.5, 0.25]),  # of 3DEC
        (5, [0.125, 0.25, 0.25, 0.25, 0.125]),  # of Demirel and Aldemir (2021)
    ],
)
def test_weights_of_the_trapezoidal_rule(points, weights):
    x, w = Quadrature("trapezoidal", points).on_joint(np.array([0.0, 1.0]))
    assert x == pytest.approx(np.linspace(0.0, 1.0, len(weights)))
    assert w == pytest.approx(weights, rel=1e-15)
    x, w = Quadrature("trapezoidal", points).on_joint(BREAKS)
    # Euler-Maclaurin: the error for x² on each facet is l³ / 6 n², n intervals.
    intervals, lengths = len(weights) - 1, np.diff(BREAKS)
    integral = 2.0 * 0.3**3 / 3.0 + np.sum(lengths**3) / (6.0 * intervals**2)
    assert len(x) == 3 * intervals + 1
    assert (w.sum(), w @ x**2) == pytest.approx((0.6, integral), rel=1e-14)


def test_springs_at_nodes_are_the_trapezoidal_rule_of_degree_1():
    for springs, composite in zip(
        Quadrature("nodal").on_joint(BREAKS),
        Quadrature("trapezoidal").on_joint(BREAKS),
        strict=True,
    ):
        assert springs == pytest.approx(composite, rel=1e-15)


def test_lobatto_has_points_at_the_ends_and_gauss_has_not():
    assert Quadrature("lobatto", 5).on_joint(BREAKS)[0][[0, -1]] == pytest.approx([-0.3, 0.3])
    assert Quadrature("gauss").on_joint(BREAKS)[0][0] > -0.3


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("simpson",), "'simpson' is not known"),
        (("nodal", 4), "leave points out"),
        (("lobatto", 1), "lobatto points on a facet = 1 is not"),
        (("trapezoidal", 1), "trapezoidal points on a facet = 1 is not"),
        (("gauss", 65), "gauss points on a facet = 65 is above 64"),
    ],
)
def test_refusals(arguments, says):
    with pytest.raises(af.errors.InvalidInput, match=says):
        Quadrature(*arguments)


@pytest.mark.parametrize("rule", ["exact", "trapezoidal", "nodal", "lobatto", "gauss"])
def test_shear_stiffness_of_a_bed_is_that_of_its_area(rule):
    """A block that slips by u is held by k_s A u; on exact facets a half at each of their ends."""
    contact = af.Contact(2e9, 3e8, 0.6)
    column = af.column(breadth=0.8, heights=[1.0], width=2.5, contact=contact)
    operator = af.build(column, fidelity="rigid", cells=(2, 1), quadrature=rule).operator
    shear = operator.trial_shear(np.array([1e-4, 0.0, 0.0]))
    assert abs(shear.sum()) == pytest.approx(3e8 * 0.8 * 2.5 * 1e-4, rel=1e-12)
    if rule == "exact":
        assert np.abs(shear) == pytest.approx(np.full(4, 3e8 * 0.2 * 2.5 * 1e-4), rel=1e-12)
        assert np.sort(operator.points.offset) == pytest.approx([-0.4, 0.0, 0.0, 0.4])
