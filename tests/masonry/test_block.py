"""Blocks: area, centroid and polar moment."""

import pytest

import archfem as af

SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))


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
