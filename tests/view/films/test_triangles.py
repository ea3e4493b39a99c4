"""Polygons cut into triangles: nothing is left out, nothing covered twice."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import sparse

from archfem.models import Cells
from archfem.view.stress import Triangles


def cells_of(*outlines):
    """Cells of polygons that are given by their corners."""
    places = np.concatenate(outlines)
    starts = np.cumsum([0, *map(len, outlines)])
    polygons = [np.arange(a, b) for a, b in pairwise(starts)]
    lift = sparse.csr_matrix((2 * len(places), 3))
    return Cells(places, np.zeros(len(places), dtype=int), tuple(polygons), lift)


def area(corners):
    """Areas of triangles, positive where they run anticlockwise."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


TURN = np.linspace(0.0, np.pi, 20)[:, None]
CIRCLE = np.hstack([np.cos(TURN), np.sin(TURN)])
SECTOR = np.concatenate([CIRCLE, 0.8 * CIRCLE[::-1]])
COMB = np.array([[0, 0], [5, 0], [5, 3], [4, 3], [4, 1], [3, 1], [3, 3], [2, 3], [2, 1], [0, 1]])


@pytest.mark.parametrize("outline", [SECTOR, SECTOR[::-1], COMB.astype(float)])
def test_triangles_cover_a_concave_polygon_once(outline):
    """All run one way and their areas add up to the shoelace formula's: none lies over another."""
    x, y = outline.T
    whole = abs(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    found = area(Triangles(cells_of(outline)).corners(outline))
    assert (found > -1e-12).all()
    assert found.sum() == pytest.approx(whole, rel=1e-9)


def test_values_run_straight_over_a_cell_and_cells_are_known():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    cells = cells_of(square, square + np.array([3.0, 0.0]))
    cut = Triangles(cells)
    corners = cut.corners(cells.places)
    values = cut.corners(2.0 * cells.places[:, 0] - cells.places[:, 1])
    assert values == pytest.approx(2.0 * corners[..., 0] - corners[..., 1])
    assert (corners[cut.cell == 1, :, 0] >= 3.0).all()
    assert len(corners) > 4  # two would do, but colours between are not straight
