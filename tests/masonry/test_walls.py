"""Walls in bond by a few lengths, against areas by hand, stones laid one by one, closed forms."""

from itertools import pairwise

import numpy as np
import pytest
from bonded import bonded_wall

import archfem as af

CONTACT = af.Contact(1.48e9, 0.3e9, friction=0.6)
DOOR = af.shapes.Opening(left=-0.75, breadth=1.0, head=2.0, name="door")
WINDOW = af.shapes.Opening(left=-0.6, breadth=1.2, sill=1.8, head=4.2, name="window")

# Lengths of walls, and their areas by hand [m²]
WALLS = {
    "rectangle": ({"breadth": 4.0, "height": 3.0}, 12.0),
    "triangle": ({"breadth": 3.0, "height": 2.0, "eaves": 0.0}, 3.0),
    "barn": ({"breadth": 4.0, "height": 4.0, "eaves": 2.5, "openings": [DOOR]}, 10.0 + 3.0 - 2.0),
    "gable": (
        {"breadth": 6.4, "height": 6.8, "eaves": 4.0, "openings": [WINDOW], "course": 0.4},
        6.4 * 4.0 + 6.4 * 2.8 / 2.0 - 1.2 * 2.4,
    ),
    "two heads": (
        {
            **{"breadth": 6.4, "height": 6.8, "eaves": 4.0, "course": 0.4, "stone": 0.7},
            "openings": [WINDOW, af.shapes.Opening(left=-2.6, breadth=1.0, head=2.2, name="door")],
        },
        6.4 * 4.0 + 6.4 * 2.8 / 2.0 - 1.2 * 2.4 - 2.2,
    ),
    "window above a door": (
        {
            **{"breadth": 4.0, "height": 5.0},
            "openings": [DOOR, af.shapes.Opening(left=-0.75, breadth=1.0, sill=3.0, head=4.0)],
        },
        20.0 - 2.0 - 1.0,
    ),
}


def build(name):
    lengths, area = WALLS[name]
    return af.shapes.wall(width=0.4, contact=CONTACT, **lengths), lengths, area


def head_joints(wall):
    """Return the places of the head joints of each course, by its level."""
    found = {}
    for joint in wall.joints:
        (x, y), (u, v) = joint.intrados, joint.extrados
        if x == u and y != v:
            found.setdefault(min(y, v), []).append(x)
    return found


@pytest.mark.parametrize("name", WALLS)
def test_stones_fill_the_wall(name):
    wall, _, area = build(name)
    assert sum(wall.blocks[number].area for number in wall.free) == pytest.approx(area, rel=1e-12)
    assert wall.weight == pytest.approx(area * 0.4 * af.STONE.unit_weight, rel=1e-12)


@pytest.mark.parametrize("name", WALLS)
def test_no_head_joint_stands_above_another(name):
    wall, lengths, _ = build(name)
    courses = [joints for _, joints in sorted(head_joints(wall).items())]
    for below, above in pairwise(courses):
        distance = np.abs(np.subtract.outer(below, above)).min()
        assert distance > 0.3 * lengths.get("stone", 0.5)


@pytest.mark.parametrize("name", ["barn", "gable", "two heads", "window above a door"])
def test_one_stone_spans_each_opening(name):
    wall, lengths, _ = build(name)
    for each in lengths["openings"]:
        lintels = []
        for number in wall.free:
            (low_x, low_y), (high_x, _) = wall.blocks[number].points[[0, 2]]
            if low_y == each.head and low_x < each.left and high_x > each.right:
                lintels.append(number)
            inside = low_x < each.right - 1e-9 and high_x > each.left + 1e-9
            assert not (inside and each.sill - 1e-9 < low_y < each.head - 1e-9)
        assert len(lintels) == 1


def test_wall_equals_stones_laid_one_by_one():
    laid = bonded_wall(12)
    wall = af.shapes.wall(breadth=4.0, height=3.0, width=0.4, contact=CONTACT)
    outlines = [
        sorted(tuple(np.round(block.points, 12).ravel()) for block in each.blocks)
        for each in (laid, wall)
    ]
    assert outlines[0] == outlines[1]
    assert len(wall.joints) == len(laid.joints)


def test_triangle_slides_at_its_friction():
    # all bed joints reach μ at once, and a triangle overturns at 1.5 B / H = 2.25 g only
    wall, *_ = build("triangle")
    found = af.collapse_factor(wall, live=af.BodyForce(1.0), friction="nonassociated")
    assert found.factor == pytest.approx(0.6, rel=1e-6)


def test_case_file_has_openings_by_name(tmp_path):
    wall, *_ = build("two heads")
    af.Analysis(wall, fidelity="rigid").write(tmp_path / "wall.toml")
    text = (tmp_path / "wall.toml").read_text()
    assert 'shape = "wall"' in text
    assert "[structure.openings.window]" in text
    assert af.Case.read(tmp_path / "wall.toml").structure == wall
    varied = af.Case.read(tmp_path / "wall.toml", ["structure.openings.window.sill=2.2"])
    area = sum(varied.structure.blocks[number].area for number in varied.structure.free)
    assert area == pytest.approx(WALLS["two heads"][1] + 1.2 * 0.4, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"eaves": 4.5}, "eaves"),
        ({"breadth": 0.0}, "breadth"),
        ({"stone": -0.5}, "stone"),
        ({"course": 0.0}, "course"),
        ({"course": 1e-3, "stone": 1e-3}, "courses times stones"),
        ({"openings": [af.shapes.Opening(left=-2.0, breadth=1.0, head=2.0)]}, "room for it"),
        ({"openings": [af.shapes.Opening(left=0.0, breadth=1.0, head=4.0)]}, "room for it"),
        ({"openings": [af.shapes.Opening(left=0.0, breadth=1.0, head=1.0, sill=1.5)]}, "room"),
        ({"openings": [DOOR, af.shapes.Opening(left=0.0, breadth=0.5, head=1.0)]}, "overlap"),
        (
            {"openings": [DOOR, af.shapes.Opening(left=-0.5, breadth=0.5, sill=2.0, head=2.2)]},
            "lintel",
        ),
    ],
)
def test_walls_that_cannot_be_built(changes, words):
    lengths = {"breadth": 4.0, "height": 4.0, "eaves": 2.5, "width": 0.4} | changes
    with pytest.raises(af.ArchfemError, match=words):
        af.shapes.wall(**lengths)
