"""Rigid blocks: their masses by closed forms, and how many facets their joints need."""

import numpy as np
import pytest

import archfem as af
from archfem.joints import Quadrature
from archfem.models.linear_blocks import build_rigid_model


@pytest.mark.parametrize(
    ("contact", "rule", "points"),
    [
        ((None, 0.0), None, 2),  # gaps between rigid faces are linear: one facet is exact
        ((0.6, 0.0), None, 8),
        ((None, 5e4), None, 8),
        ((None, 0.0), Quadrature("lobatto"), 9),
        ((None, 0.0), Quadrature("gauss", 2), 8),
        ((0.6, 0.0), Quadrature("trapezoidal"), 5),
        ((0.6, 0.0), Quadrature("trapezoidal", 3), 3),  # of the whole joint
    ],
)
def test_joints_have_as_many_points_as_their_law_needs(contact, rule, points):
    friction, tension = contact
    law = af.Contact(1e9, 4e8, friction, cohesion=1e5, tension=tension)
    model = build_rigid_model(af.column(breadth=0.6, heights=[2.4], contact=law), 4, rule)
    assert len(model.operator.points.offset) == points


def test_masses_are_those_of_boxes():
    """m = γ w b h / g, and m (b² + h²) / 12 about the centroid."""
    tower = af.column(breadth=0.6, heights=[2.4, 1.2], width=2.5, gravity=5.0)
    model, mass = build_rigid_model(tower), 20e3 / 5.0 * 2.5 * 0.6 * np.array([2.4, 1.2])
    inertia = mass * (0.6**2 + np.array([2.4, 1.2]) ** 2) / 12.0
    known = np.column_stack([mass, mass, inertia]).ravel()
    assert model.mass.toarray() == pytest.approx(np.diag(known))
    body = np.zeros((6, 2))
    body[[0, 3], 0] = body[[1, 4], 1] = mass
    assert model.mass_influence == pytest.approx(body)
    assert model.block_stiffness.nnz == 0 or not model.block_stiffness.data.any()
