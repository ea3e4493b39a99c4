"""Structures with a fill for tests of limit analysis, and the weight of the fill by other means."""

from dataclasses import replace
from functools import cache

import numpy as np
from shapely import Polygon, box

import archfem as af

SOIL = af.masonry.BACKFILL


@cache
def arch_bridge(cover=0.3, material=SOIL, width=1.0, **ring):
    """A ring of five metres between fixed sidewalls, under a level fill."""
    given = {"span": 5.0, "rise": 1.25, "thickness": 0.4, "voussoirs": 20} | ring
    walls = [
        af.shapes.Sidewall(length=2.0, height=1.0, state="fixed", name=f"{side} wall")
        for side in ("left", "right")
    ]
    fill = None if cover is None else af.shapes.Backfill(cover=cover, material=material)
    return af.bridge(
        arches=[af.shapes.Arch(measured="centre line", **given)],
        sidewalls=walls,
        backfill=fill,
        width=width,
    )


def slender_bridge(**rings):
    """Rings of some span and rise on piers of 0.9 m by 6 m, under a level fill."""
    return af.bridge(
        arches=[
            af.shapes.Arch(span=span, rise=rise, thickness=0.6, voussoirs=9, name=name)
            for name, (span, rise) in rings.items()
        ],
        piers=[
            af.shapes.Pier(gap=0.9, height=6.0, course=2.0, name=f"pier {name}")
            for name in [*rings][1:]
        ],
        sidewalls=[
            af.shapes.Sidewall(length=3.0, height=2.0, state="fixed", name=f"{side} wall")
            for side in ("left", "right")
        ],
        backfill=af.shapes.Backfill(cover=0.5),
    )


def rectangle(left, bottom, right, top, name, material=af.STONE, **given):
    outline = ((left, bottom), (right, bottom), (right, top), (left, top))
    return af.Block(outline, material, name, **{"part": name, "role": "other"} | given)


def retaining_wall(breadth=1.0, height=2.0, friction=0.6, material=SOIL, width=1.0):
    """A stone on rock with a fill behind it, to its right, up to its top."""
    rough = replace(af.masonry.STONE_TO_STONE, friction=friction)
    return af.masonry.assembled(
        [
            rectangle(-breadth - 2.0, -1.0, 6.0, 0.0, "rock", fixed=True),
            rectangle(-breadth, 0.0, 0.0, height, "wall"),
            rectangle(0.0, 0.0, 6.0, height, "soil", material),
        ],
        lambda a, b: af.masonry.SOIL_TO_STONE if "soil" in (a.name, b.name) else rough,
        width=width,
    )


def two_walls():
    """A wall of 1 m and one of 2 m, both 2 m high, on rock, with a fill between them."""
    blocks = [
        rectangle(-2.0, -1.0, 6.0, 0.0, "rock", fixed=True),
        rectangle(-1.0, 0.0, 0.0, 2.0, "slender"),
        rectangle(0.0, 0.0, 2.0, 2.0, "soil", SOIL),
        rectangle(2.0, 0.0, 4.0, 2.0, "thick"),
    ]
    return af.masonry.assembled(
        blocks,
        lambda a, b: (
            af.masonry.SOIL_TO_STONE if "soil" in (a.name, b.name) else af.masonry.STONE_TO_STONE
        ),
    )


def row_of_stones(cover=1.0, stones=12, paving=0.0):
    """Stones of 0.5 m side by side on rock, under a level fill and, on request, a pavement."""
    side = 0.5
    blocks = [rectangle(0.0, -1.0, side * stones, 0.0, "rock", fixed=True)]
    blocks += [
        rectangle(side * k, 0.0, side * (k + 1), side, f"stone {k}", part="row", role="pier")
        for k in range(stones)
    ]
    top = side + cover
    blocks.append(rectangle(0.0, side, side * stones, top, "soil", SOIL))
    if paving:
        blocks.append(rectangle(0.0, top, side * stones, top + paving, "paving"))
    return af.masonry.assembled(
        blocks,
        lambda a, b: (
            af.masonry.SOIL_TO_STONE if "soil" in (a.name, b.name) else af.masonry.STONE_TO_STONE
        ),
    )


def fill_of(structure):
    return next(block for block in structure.blocks if block.name in ("backfill", "soil"))


def faces_of(structure, number):
    """Both ends of each face of a block that touches the fill, from left to right."""
    soil = structure.blocks.index(fill_of(structure))
    ends = [j.ends for j in structure.joints if set(j.blocks) == {number, soil}]
    return [face[np.argsort(face[:, 0])] for face in ends]


def column_above(structure, number):
    """Weight of the fill above a block and x of its centroid, from polygons [N, m]."""
    x = np.concatenate(faces_of(structure, number))[:, 0]
    soil = fill_of(structure)
    piece = Polygon(soil.points).intersection(box(x.min(), -99.0, x.max(), 99.0))
    weight = piece.area * soil.material.unit_weight * structure.width
    return weight, piece.centroid.x if piece.area else np.nan
