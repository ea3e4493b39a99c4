"""Blocks: area, centroid and polar moment."""

import numpy as np
import pytest

import archfem as af

SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))


@pytest.mark.parametrize(
    ("outline", "remedy"),
    [
        (SQUARE[::-1], "anticlockwise"),
        ((*SQUARE[:1], SQUARE[2], SQUARE[1], SQUARE[3]), "without edges that cross"),
    ],
)
def test_an_outline_without_a_positive_area_is_refused_with_its_remedy(outline, remedy):
    with pytest.raises(af.errors.InvalidStructure, match=f"m²: give its outline {remedy}"):
        af.Block(outline, af.STONE, "b")


def test_polygon_measures():
    block = af.Block(SQUARE, af.STONE, "square")
    assert block.area == pytest.approx(2.0)
    assert block.centroid == pytest.approx([1.0, 0.5])
    assert block.polar_moment == pytest.approx(2.0 * (4.0 + 1.0) / 12.0)


def test_sector_measures_are_the_limit_of_its_polygons(ring):
    sector = ring.blocks[4]
    fine = af.Block(tuple(map(tuple, sector.drawn(2000))), af.STONE, "fine")
    # A polygon of k chords misses φ²/(6 k²) of the area: 1e-9 here.
    assert sector.area == pytest.approx(fine.area, rel=1e-8)
    assert sector.centroid == pytest.approx(fine.centroid, rel=1e-7)
    assert sector.polar_moment == pytest.approx(fine.polar_moment, rel=1e-6)


def test_arcs_are_about_their_own_centre():
    """A sector of 90° about (3, 1), between radii of 2 and 1: its arcs, and all its outline."""
    corners = ((5.0, 1.0), (3.0, 3.0), (3.0, 2.0), (4.0, 1.0))
    sector = af.Block(corners, af.STONE, "quarter", centre=(3.0, 1.0))
    for side, radius in ((0, 2.0), (2, 1.0)):
        points = sector.arc(side, 6)
        assert points[[0, -1]] == pytest.approx(sector.points[[side, side + 1]])
        assert np.hypot(*(points - [3.0, 1.0]).T) == pytest.approx(radius)
    assert sector.area == pytest.approx(0.75 * np.pi)


def test_a_repeated_corner_is_refused():
    """A side without length has no direction, along which loose blocks would touch."""
    for place in range(4):
        outline = [*SQUARE[: place + 1], SQUARE[place], *SQUARE[place + 1 :]]
        said = (
            rf"'gable' has two corners beside each other .*, points {place + 1} and {place + 2} of"
        )
        with pytest.raises(af.InvalidStructure, match=said):
            af.Block(outline, af.STONE, "gable")
    with pytest.raises(
        af.InvalidStructure, match=r"at \(0\.0, 0\.0\), points 5 and 1 of its 5: leave one out"
    ):
        af.Block((*SQUARE, SQUARE[0]), af.STONE, "gable")
