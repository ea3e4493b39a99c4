"""Outlines in the plane: measures in closed form, and sides of a line."""

import numpy as np
import pytest

from archfem.masonry.block import find_side_of_line, measure_polygon, measure_sector

BOX = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]])


def test_measures_of_a_triangle_far_from_the_origin():
    area, centroid, polar = measure_polygon(np.array([[0, 0], [3, 0], [0, 4]]) + 1e3)
    assert area == pytest.approx(6.0)
    assert centroid == pytest.approx([1001.0, 1000.0 + 4.0 / 3.0])
    assert polar == pytest.approx(3.0 * 4.0 * (3.0**2 + 4.0**2) / 36.0)


def test_a_polygon_the_wrong_way_round_has_a_negative_area():
    assert measure_polygon(BOX[::-1])[0] == pytest.approx(-6.0)


def test_measures_of_a_quarter_of_a_ring():
    points = np.array([[2.0, 0.0], [0.0, 2.0], [0.0, 1.0], [1.0, 0.0]])
    area, centroid, polar = measure_sector(points, np.zeros(2))
    assert area == pytest.approx(np.pi * 3.0 / 4.0)
    reach = 7.0 / 3.0 / area  # ∫ r² dr ∫ cos φ dφ, of a quarter
    assert centroid == pytest.approx([reach, reach])
    assert polar == pytest.approx(np.pi / 2.0 * 15.0 / 4.0 - area * 2.0 * reach**2)


@pytest.mark.parametrize(
    ("line", "side"),
    [
        ([[0.5, 0.0], [2.5, 0.0]], 1),
        ([[2.5, 0.0], [0.5, 0.0]], -1),
        ([[0.5, 0.0], [3.5, 0.0]], 0),
        ([[0.5, 0.1], [2.5, 0.1]], 0),
        ([[3.0, 2.0], [3.0, 0.0]], -1),
    ],
    ids=["along", "against", "longer", "inside", "upright"],
)
def test_on_which_side_of_a_line_a_box_lies(line, side):
    assert find_side_of_line(BOX, np.array(line), 1e-6) == side


def test_arcs_cover_no_line():
    assert find_side_of_line(BOX, BOX[:2], 1e-6, arcs=(0, 2)) == 0
