"""Which way rings and piers run."""

import numpy as np
import pytest

import archfem as af
from archfem.masonry.direction import Direction, directions_of


def lines(structure):
    return [(joint.lower, joint.higher, joint.ends) for joint in structure.joints]


def test_the_centre_of_a_ring_is_found(ring):
    directions = directions_of(ring.blocks, lines(ring))
    assert directions["arch"].centre == pytest.approx([0.0, 0.0], abs=1e-9)


def test_joints_of_a_ring_lie_across_it_and_follow_one_another(ring):
    way = directions_of(ring.blocks, lines(ring))["arch"]
    assert all(way.separates(joint.ends) for joint in ring.joints)
    assert not way.separates(np.array([[-0.1, 2.7], [0.1, 2.7]]))
    assert np.all(np.diff([way.along(joint.middle) for joint in ring.joints]) > 0.0)
    for joint in ring.joints:
        assert way.outward(joint.middle) == pytest.approx(joint.tangent)


def test_a_pier_stands_whatever_its_stones(stack):
    way = directions_of(stack.blocks, lines(stack))["column"]
    assert (way.centre, way.upright) == (None, True)
    flat = af.column(breadth=5.0, heights=[0.1, 0.1])
    assert directions_of(flat.blocks, lines(flat))["column"].upright


def test_what_lies_straight_runs_to_the_right_and_points_upwards():
    way = Direction(np.zeros(2), None, upright=False)
    assert way.outward(np.array([3.0, 1.0])).tolist() == [0.0, 1.0]
    assert way.along(np.array([3.0, 1.0])) == 3.0
    assert way.separates(np.array([[1.0, 0.0], [1.2, 0.5]]))
