"""Points of a block that moves as a rigid body."""

import numpy as np
import pytest

from archfem.masonry.structure import rigid_motion_matrix


def test_a_small_turn_moves_points_as_a_rotation_does():
    points, centroid = np.array([[2.0, 1.0], [0.0, 3.0]]), np.array([1.0, 1.0])
    turn = 1e-4
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = (points - centroid) @ rotation.T + centroid + [0.2, 0.3] - points
    found = rigid_motion_matrix(points, centroid) @ [0.2, 0.3, turn]
    assert found == pytest.approx(moved, abs=2.0 * turn**2)  # terms that small motions neglect


def test_each_point_may_have_a_centroid_of_its_own():
    points, centroids = np.array([[2.0, 1.0], [0.0, 3.0]]), np.array([[1.0, 1.0], [0.0, 0.0]])
    found = rigid_motion_matrix(points, centroids)
    for k in range(2):
        assert found[k].tolist() == rigid_motion_matrix(points[[k]], centroids[k])[0].tolist()


def test_blocks_that_move_have_three_coordinates_each(stack, ring):
    assert stack.first_coordinates.tolist() == [-1, 0, 3]
    assert ring.first_coordinates.max() == 3 * 16
