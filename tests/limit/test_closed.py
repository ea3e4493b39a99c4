"""Cohesion of joints that open, in limit analysis and in a pushover."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.limit.closed import closed_cohesion

SIDEWAYS = af.BodyForce(1.0)

FRICTION, HELD = 0.3, 0.3
"""Of the bed: μ, and c A over the weight of the block."""

SLIDES = (FRICTION + 1.5 * HELD) / (1.0 + 1.5 * HELD)
"""Of a square block: λ = μ + c A / W · 3 (1/2 - λ/2), whose thrust is at λ/2 of the breadth."""


def block(held=HELD, friction=FRICTION):
    """A square block on a bed with cohesion."""
    contact = replace(af.masonry.STONE_TO_STONE, friction=friction)
    plain = af.column(breadth=1.0, heights=[1.0], contact=contact)
    cohesion = held * plain.weight / (plain.width * 1.0)
    glued = replace(contact, cohesion=cohesion)
    return af.column(breadth=1.0, heights=[1.0], contact=glued)


@pytest.mark.parametrize("friction", ["coulomb", "nonassociated"])
def test_a_block_slides_on_what_is_closed_of_its_bed(friction, verified, caplog):
    """A pushover loses cohesion where the bed opens; limit analysis has it whole, and says so."""
    push = af.pushover(af.build(block(), fidelity="rigid"), SIDEWAYS)
    verified("block on a bed with cohesion, part of it open: limit", SLIDES, "statics", push.factor)
    assert push.factor == pytest.approx(SLIDES, rel=1e-9)
    whole = af.collapse_factor(block(), live=SIDEWAYS, friction=friction)
    assert whole.factor == pytest.approx(FRICTION + HELD, rel=1e-7)
    assert "1 joints such as 'joint 0' fail partly open" in caplog.text
    caplog.clear()
    less = closed_cohesion(block(), push.joints.isel(step=-1))
    found = af.collapse_factor(less, live=SIDEWAYS, friction=friction)
    assert found.factor == pytest.approx(push.factor, rel=1e-7)


@pytest.mark.parametrize(("held", "friction"), [(0.1, 0.1), (0.0, 0.3), (5.0, 0.3)])
def test_nothing_is_told_where_no_cohesion_is_lost(held, friction, caplog):
    """The bed stays closed; it has no cohesion; it turns on its edge, which does not slide."""
    af.collapse_factor(block(held, friction), live=SIDEWAYS, friction="nonassociated")
    lost = held == 5.0  # at the edge nothing is closed, and friction alone is too little
    assert ("fail partly open" in caplog.text) == lost


def test_what_is_closed_is_three_times_from_the_thrust_to_the_edge():
    structure = af.column(breadth=0.5, heights=[1.0] * 5, contact=block().joints[0].contact)
    joints = af.dead_load(af.build(structure, fidelity="rigid")).joints.copy(deep=True)
    joints["N"][:] = [1.0, 1.0, 1.0, 0.0, 0.06]
    joints["M"][:] = [0.05, -0.15, 0.25, 0.0, 0.005]
    less = closed_cohesion(structure, joints)
    np.testing.assert_allclose(
        less.cohesion / structure.cohesion, [1.0, 0.6, 0.0, 0.0, 1.0], atol=1e-12
    )
    assert [joint.name for joint in less.joints] == [joint.name for joint in structure.joints]


def test_joints_of_another_structure_are_refused():
    joints = af.dead_load(af.build(block(), fidelity="rigid")).joints
    with pytest.raises(af.InvalidInput):
        closed_cohesion(af.column(breadth=1.0, heights=[1.0, 1.0]), joints)
