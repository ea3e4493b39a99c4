"""Opening and slip of rigid blocks: against corners of the blocks that are moved by hand."""

import numpy as np
import pytest

import archfem as af
from archfem.joints.rigid_kinematics import block_motion_gaps, facet_ends, rigid_joint_operator

SMALL = 1e-6
"""A turn [rad]; small motions neglect its square."""


def gap_by_hand(structure, points, motion, k):
    """Jump across a point of a joint, after both blocks have been turned and moved."""
    joint = structure.joints[points.joint[k]]
    place = joint.middle + points.offset[k] * joint.tangent
    moved = []
    for number in (joint.lower, joint.higher):
        (x, y, turn), centroid = motion[number], structure.blocks[number].centroid
        arm = (place - centroid) @ [1, 1j] * np.exp(1j * turn)
        moved.append(centroid + np.array([x + arm.real, y + arm.imag]))
    jump = moved[1] - moved[0]
    return jump @ structure.normals[points.joint[k]], jump @ joint.tangent


@pytest.mark.parametrize("rule", ["lobatto", "exact", "gauss"])
def test_gaps_follow_motions_of_both_blocks(ring, rule):
    """All blocks move, or by the operator the free ones alone."""
    operator = rigid_joint_operator(ring, 3, af.joints.Quadrature(rule))
    points, rng = operator.points, np.random.default_rng(4)
    motion = SMALL * rng.normal(size=(len(ring.blocks), 3))
    found = block_motion_gaps(ring, points, motion)
    known = np.array([gap_by_hand(ring, points, motion, k) for k in range(len(points.offset))]).T
    assert found == pytest.approx(known, abs=10.0 * SMALL**2)
    motion[[b.fixed for b in ring.blocks]] = 0.0
    q = motion[list(ring.free)].ravel()
    still = block_motion_gaps(ring, points, motion)
    assert operator.openings(q) == pytest.approx(still[0], abs=1e-18)
    assert operator.slips(q) == pytest.approx(still[1], abs=1e-18)


def test_points_cover_their_joints():
    assert facet_ends(0.6, 3) == pytest.approx([-0.3, -0.1, 0.1, 0.3])
    stack = af.column(breadth=0.6, heights=[1.0, 1.0])
    points = rigid_joint_operator(stack, 3, af.joints.Quadrature("lobatto")).points
    assert points.weight.sum() == pytest.approx(2 * 0.6)
    assert points.offset[points.joint == 1] == pytest.approx(np.linspace(-0.3, 0.3, 7))
