"""Outlines cut into convex pieces."""

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import archfem as af
from archfem.dynamics.falling.pieces import convex_pieces, corners_of


def covered(points, pieces):
    """Area of the pieces, each convex."""
    polygons = [shapely.Polygon(points[list(piece)]) for piece in pieces]
    for polygon in polygons:
        assert polygon.exterior.is_ccw
        assert polygon.convex_hull.area == pytest.approx(polygon.area, rel=1e-12)
    return sum(polygon.area for polygon in polygons), shapely.union_all(polygons).area


def test_a_convex_outline_stays_whole():
    assert convex_pieces(np.array([(0.0, 0.0), (2.0, 0.0), (3.0, 1.0), (0.0, 2.0)])) == [
        (0, 1, 2, 3)
    ]


def test_an_angle_becomes_two_pieces():
    points = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)], dtype=float)
    pieces = convex_pieces(points)
    assert len(pieces) == 2
    assert covered(points, pieces) == pytest.approx((5.0, 5.0), rel=1e-12)


def test_a_voussoir_of_chords_is_cut_along_its_depth():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=90.0, voussoirs=2, chords=4)
    points = corners_of(ring.blocks[1].points)
    pieces = convex_pieces(points)
    assert len(pieces) == 4
    area = ring.blocks[1].area
    assert covered(points, pieces) == pytest.approx((area, area), rel=1e-9)


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.lists(st.floats(0.2, 1.0), min_size=4, max_size=12))
def test_any_star_is_covered_once(radii):
    angles = 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    points = corners_of(
        np.array(radii)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    )
    area = shapely.Polygon(points).area
    assert covered(points, convex_pieces(points)) == pytest.approx((area, area), rel=1e-9)


def test_vertices_on_a_straight_edge_are_left_out():
    points = np.array([(0, 0), (1, 0), (2, 0), (2, 2), (1, 2), (0, 2), (0, 1)], dtype=float)
    assert corners_of(points).tolist() == [[0, 0], [2, 0], [2, 2], [0, 2]]


def test_an_outline_that_crosses_itself_is_refused():
    points = np.array([(0, 0), (3, 0), (0, 3), (3, 3)], dtype=float)
    with pytest.raises(af.errors.InvalidStructure, match="crosses itself"):
        convex_pieces(points)
