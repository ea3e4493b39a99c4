"""Forces at points of the joints: springs, and exact integrals over facets partly open."""

import numpy as np
import pytest

import archfem as af
from archfem.joints.normal_law import choose_law
from archfem.joints.quadrature import JointPoints


def facet(rule, cells=1):
    """One joint 1 m deep and 2 m wide, k_n = 3 and k_s = 2 Pa/m in units of 1e9."""
    contact = af.Contact(3e9, 2e9)
    block = af.column(breadth=1.0, heights=[1.0], width=2.0, contact=contact)
    rule = af.joints.Quadrature(rule)
    return choose_law(
        rule, JointPoints.on(block, [rule.on_joint(np.linspace(-0.5, 0.5, cells + 1))])
    )


def test_a_facet_partly_open_bears_as_a_triangle():
    """Closed by 1 mm at one end, open by 3 mm at the other: a quarter of the depth bears."""
    law = facet("exact")
    forces = law.forces(np.array([-1e-3, 3e-3]))
    total = -0.5 * 3e9 * 2.0 * 0.25 * 1e-3
    assert forces.sum() == pytest.approx(total)
    assert forces[1] == pytest.approx(total * 0.25 / 3.0)  # at a third of the closed quarter


@pytest.mark.parametrize("opening", [[-1e-3, -2e-3], [1e-3, 2e-3], [0.0, 0.0]])
def test_facets_that_do_not_change_are_springs_of_their_whole_depth(opening):
    law = facet("exact")
    closed = np.clip(opening, None, 0.0).sum() / 2.0
    assert law.forces(np.array(opening)).sum() == pytest.approx(6e9 * closed)


@pytest.mark.parametrize("rule", ["lobatto", "gauss", "nodal", "exact"])
def test_a_joint_closed_and_slipped_evenly_bears_on_its_whole_area(rule):
    law = facet(rule, cells=3)
    count = len(law.points.offset)
    assert law.forces(np.full(count, -1e-3)).sum() == pytest.approx(-6e9 * 1e-3)
    assert law.points.shear_spring @ np.full(count, 1e-3) == pytest.approx(4e9 * 1e-3)
    assert np.all(law.forces(np.full(count, 1e-3)) == 0.0)


def test_springs_that_just_touch_are_stiff():
    law = facet("lobatto")
    assert np.all(law.stiffness(np.zeros(3)) > 0.0)
    assert np.all(law.stiffness(np.full(3, 1e-12)) == 0.0)
