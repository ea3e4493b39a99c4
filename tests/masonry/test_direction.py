"""Which way rings and piers run."""

import numpy as np
import pytest

import archfem as af
from archfem.masonry.parts import Direction, _fit_direction, find_directions


def lines(structure):
    return [(joint.lower, joint.higher, joint.ends) for joint in structure.joints]


def test_the_centre_of_a_ring_is_found(ring):
    directions = find_directions(ring.blocks, lines(ring))
    assert directions["arch"].centre == pytest.approx([0.0, 0.0], abs=1e-9)


def test_joints_of_a_ring_lie_across_it_and_follow_one_another(ring):
    way = find_directions(ring.blocks, lines(ring))["arch"]
    assert all(way.separates(joint.ends) for joint in ring.joints)
    assert not way.separates(np.array([[-0.1, 2.7], [0.1, 2.7]]))
    assert np.all(np.diff([way.along(joint.middle) for joint in ring.joints]) > 0.0)
    for joint in ring.joints:
        assert way.outward(joint.middle) == pytest.approx(joint.tangent)


def test_a_pier_stands_whatever_its_stones(stack):
    way = find_directions(stack.blocks, lines(stack))["column"]
    assert (way.centre, way.upright) == (None, True)
    flat = af.column(breadth=5.0, heights=[0.1, 0.1])
    assert find_directions(flat.blocks, lines(flat))["column"].upright


def test_a_straight_part_runs_to_the_right_and_points_upwards():
    way = Direction(np.zeros(2), None, upright=False)
    assert way.outward(np.array([3.0, 1.0])).tolist() == [0.0, 1.0]
    pier = Direction(np.zeros(2), None, upright=True)
    assert pier.outward(np.array([3.0, 1.0])).tolist() == [1.0, 0.0]
    assert way.along(np.array([3.0, 1.0])) == 3.0
    assert way.separates(np.array([[1.0, 0.0], [1.2, 0.5]]))


@pytest.mark.parametrize(("spread", "straight"), [(0.0049, True), (0.0051, False)])
@pytest.mark.parametrize("upright", [False, True])
def test_a_row_is_straight_up_to_a_spread_of_five_thousandths(spread, straight, upright):
    """Four stones on a cross, whose spread is that of its arms; a pier is always straight."""
    places = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, spread], [0.0, -spread]])
    places = places[:, ::-1] if upright else places
    way = _fit_direction(places, "ring")
    assert (way.centre is None) is straight
    assert way.upright is (upright and straight)
    assert _fit_direction(places, "pier").centre is None


def test_a_ring_of_few_stones_is_found_from_them_too():
    """Two stones and their joint: a circle through its middle and both centroids."""
    ring = af.circular_arch(radius=2.0, thickness=0.4, embrace=90.0, voussoirs=2)
    way = find_directions(ring.blocks, lines(ring))["arch"]
    x, y = max((block.centroid for block in ring.blocks if not block.fixed), key=lambda c: c[0])
    assert way.centre == pytest.approx([0.0, 0.5 * (4.0 - y**2 - x**2) / (2.0 - y)], abs=1e-9)
    assert way.middle == pytest.approx([0.0, (2.0 + 2.0 * y) / 3.0])
