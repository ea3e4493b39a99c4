"""Arches in a row and between buttresses, by one call: lengths, areas, names."""

import numpy as np
import pytest
import shapely

import archfem as af
from archfem.masonry import shapes


def test_two_spans_on_piers_of_different_height():
    heights, breadths = [2.0, 3.0, 2.5], [1.4, 1.8, 1.5]
    arcade = shapes.arcade(
        measured="centre line",
        spans=[4.0, 5.0],
        embraces=170.0,
        thicknesses=0.6,
        voussoirs=[9, 11],
        heights=heights,
        breadths=breadths,
    )
    for k, (high, broad) in enumerate(zip(heights, breadths, strict=True), 1):
        base = arcade.joints[arcade.joint_number(f"pier {k}, base")]
        assert base.depth == pytest.approx(broad, rel=1e-12)
        assert base.middle[1] == pytest.approx(-high, rel=1e-12)
    assert {joint.part for joint in arcade.joints} == {
        "arch 1", "arch 2", "pier 1", "pier 2", "pier 3",
    }  # fmt: skip
    feet = [arcade.joints[arcade.joint_number(f"arch 2, joint {k}")].middle for k in (0, 11)]
    assert feet[1] - feet[0] == pytest.approx((5.0, 0.0), abs=1e-12)
    polygons = [shapely.Polygon(block.points) for block in arcade.blocks]
    assert sum(p.area for p in polygons) == pytest.approx(shapely.union_all(polygons).area)
    assert np.all(arcade.judged)
    assert af.stands(arcade)


def test_clear_spans_are_between_the_faces_of_piers():
    arcade = shapes.arcade(
        spans=[4.0, 5.0],
        embraces=170.0,
        thicknesses=0.6,
        voussoirs=[9, 11],
        heights=2.0,
        breadths=[1.4, 1.8, 1.5],
    )
    names = ["arch 1, joint 0", "arch 1, joint 9", "arch 2, joint 0", "arch 2, joint 11"]
    feet = [arcade.joints[arcade.joint_number(name)].intrados[0] for name in names]
    assert np.diff(feet) == pytest.approx([4.0, 1.8, 5.0], rel=1e-12)
    polygons = [shapely.Polygon(block.points) for block in arcade.blocks]
    assert sum(p.area for p in polygons) == pytest.approx(shapely.union_all(polygons).area)


def test_an_arch_between_buttresses():
    """Its buttresses hold the thrust from some breadth on, and overturn below."""
    given = {"span": 5.0, "embrace": 150.0, "thickness": 0.5, "voussoirs": 15, "height": 3.0}
    narrow, broad = (
        shapes.buttressed_arch(measured="centre line", breadth=b, **given) for b in (0.7, 2.0)
    )
    assert not af.stands(narrow)
    assert af.stands(broad)
    top = next(block for block in broad.blocks if block.name == "pier 1, skewback")
    spring = broad.joints[broad.joint_number("arch 1, joint 0")]
    assert np.ptp(top.points[:, 0]) == pytest.approx(2.0, rel=1e-12)
    assert any(np.allclose(point, spring.extrados) for point in top.points)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"heights": [2.0, 2.0]}, "2 heights: give one for all, or 3"),
        ({"breadths": [0.3, 1.5, 0.3]}, "a ring does not stand on a breadth of 0.3 m"),
        ({"rises": 1.5}, "either embrace or rise"),
    ],
)
def test_inconsistent_numbers_are_refused(change, says):
    given = {"spans": [4.0, 4.0], "embraces": 150.0, "thicknesses": 0.5, "voussoirs": 9}
    given |= {"heights": 2.0, "breadths": 1.5, **change}
    with pytest.raises(af.InvalidStructure, match=says):
        shapes.arcade(measured="centre line", **given)


def test_piers_under_the_ends_of_a_bridge_leave_no_place_for_sidewalls():
    arch = shapes.Arch(measured="centre line", span=4.0, rise=1.6, thickness=0.45, voussoirs=9)
    piers = [shapes.Pier(gap=1.0, height=2.0, name=name) for name in ("left", "right")]
    wall = shapes.Sidewall(length=1.5, height=2.0)
    with pytest.raises(af.InvalidStructure, match="none where piers stand under the ends"):
        af.bridge(arches=[arch], piers=piers, sidewalls=[wall, wall])
    with pytest.raises(af.InvalidStructure, match="a ring does not stand on a gap"):
        af.bridge(arches=[arch], piers=[shapes.Pier(gap=0.1, height=2.0, name="l"), piers[1]])


@pytest.mark.parametrize(("breadth", "taken"), [(0.82, 0), (0.8, 1), (0.7, 2), (0.5, 3)])
def test_a_slender_pier_has_one_stone_below_where_the_rings_part(breadth, taken):
    """Semicircles of radii 1.6 m and 2 m in 19 voussoirs, whose extrados cross at cos φ."""
    given = {"spans": [3.2, 3.2], "rises": 1.6, "thicknesses": 0.4, "voussoirs": 19, "heights": 2.0}
    arcade = shapes.arcade(breadths=[1.0, breadth, 1.0], **given)
    skewback = next(block for block in arcade.blocks if block.name == "pier 2, skewback")
    turns = np.pi / 19 * np.arange(taken + 1)
    corners = [(side * 0.5 * breadth, -0.4) for side in (-1.0, 1.0)]
    for side in (-1.0, 1.0):
        centre, radii = side * (0.5 * breadth + 1.6), [*np.full(taken + 1, 1.6), 2.0]
        for radius, turn in zip(radii, [*turns, turns[-1]], strict=True):
            corners.append((centre - side * radius * np.cos(turn), radius * np.sin(turn)))
    found = skewback.points - [
        3.4 + 0.5 * breadth,
        0.0,
    ]  # x begins in the middle of a springing joint
    found, expected = (sorted(map(tuple, np.round(each, 9) + 0.0)) for each in (found, corners))
    assert np.array(found) == pytest.approx(np.array(expected), abs=1e-8)
    rings = [block.name for block in arcade.blocks if block.role == "ring"]
    assert rings[-1] == "arch 2, voussoir 19"
    assert rings[19 - taken] == f"arch 2, voussoir {1 + taken}"
    # the joints of its lower voussoirs are missing, and those above keep their numbers
    faces = [joint.name for joint in arcade.joints]
    assert f"arch 2, joint {taken}" in faces
    assert f"arch 2, joint {taken - 1}" not in faces
    polygons = [shapely.Polygon(block.points) for block in arcade.blocks]
    assert sum(p.area for p in polygons) == pytest.approx(shapely.union_all(polygons).area)
    assert af.stands(arcade)


def test_rings_on_a_pier_that_one_stone_would_not_part_are_refused():
    given = {"spans": [3.2, 3.2], "rises": 1.6, "thicknesses": 0.4, "voussoirs": 5, "heights": 2.0}
    with pytest.raises(af.errors.InvalidStructure, match=r"'pier 2'.* on a breadth of 0.7 m, and"):
        shapes.arcade(breadths=[1.0, 0.7, 1.0], **given)


@pytest.mark.parametrize("course", [1e-320, 1e-5])
def test_more_courses_than_there_is_room_for_are_refused(course):
    given = {"span": 4.0, "rise": 1.0, "thickness": 0.3, "voussoirs": 9, "breadth": 1.5}
    with pytest.raises(af.InvalidInput, match=r"courses of 'pier 1': 3 by .* room for 10000"):
        shapes.buttressed_arch(height=3.0, course=course, **given)
