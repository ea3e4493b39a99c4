"""Outlines in the plane: measures in closed form, and sides of a line."""

import numpy as np
import pytest

from archfem.masonry.block import (
    find_side_of_line,
    measure_polygon,
    measure_sector,
    triangulate_polygon,
)

BOX = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]])


def test_measures_of_a_triangle_far_from_the_origin():
    area, centroid, polar = measure_polygon(np.array([[0, 0], [3, 0], [0, 4]]) + 1e3)
    assert area == pytest.approx(6.0)
    assert centroid == pytest.approx([1001.0, 1000.0 + 4.0 / 3.0])
    assert polar == pytest.approx(3.0 * 4.0 * (3.0**2 + 4.0**2) / 36.0)


def test_a_polygon_the_wrong_way_round_has_a_negative_area():
    area, _, polar = measure_polygon(BOX[::-1])
    assert (area, polar) == (pytest.approx(-6.0), 0.0)


def test_triangles_of_a_polygon_fill_it():
    """An angle, whose inner corner no triangle may cross."""
    shift = np.array([10.0, -5.0])
    angle = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2]]) + shift
    corners = angle[triangulate_polygon(angle)]
    (a, b), inner = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 0), [11.0, -4.0]
    areas = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    assert len(areas) == 4
    assert np.all(areas > 0.0)
    assert areas.sum() == pytest.approx(4.0)
    middles = corners.mean(axis=1)
    assert not np.any(np.all(middles > inner, axis=1))


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


def test_sides_of_a_line_are_those_of_the_edge_on_it():
    """Two boxes, one above the line y = 0 and one below, joined over a part of it."""
    outline = [(0, 0), (2, 0), (2, -2), (5, -2), (5, 0), (3, 0), (3, 2), (0, 2)]
    for line, side in (((0.5, 1.5), 1), ((1.5, 0.5), -1), ((4.5, 3.5), 1), ((3.5, 4.5), -1)):
        ends = np.array([[x, 0.0] for x in line])
        for first in range(len(outline)):
            points = np.array(outline[first:] + outline[:first], float)
            assert find_side_of_line(points, ends, 1e-6) == side


def test_arcs_cover_no_line():
    assert find_side_of_line(BOX, BOX[:2], 1e-6, arcs=(0, 2)) == 0
