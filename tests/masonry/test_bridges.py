"""Bridges from their parts: closed forms of lengths and areas, names, and refused parts."""

from dataclasses import replace
from math import radians, sin, tan
from pathlib import Path

import numpy as np
import pytest
import shapely
from repeats import each_once

import archfem as af
from archfem.masonry.structure import describe_spans

MESHES = Path(__file__).parents[2] / "meshes"
EXACT = 1e-9
"""Areas of tens of m² from sums of products of coordinates, in double precision."""
RING = {"span": 4.0, "rise": 1.6, "thickness": 0.45, "voussoirs": 13}
WALL = {"length": 2.0, "height": 2.3, "above": 0.8}
ARCH = af.shapes.Arch(measured="centre line", **RING)
PAIR = {
    "arches": (
        af.shapes.Arch(measured="centre line", name="west arch", **RING),
        af.shapes.Arch(measured="centre line", name="east arch", **RING),
    ),
    "piers": (af.shapes.Pier(name="pier", gap=0.9, height=2.4),),
}
FEW = [replace(arch, voussoirs=3) for arch in PAIR["arches"]]


def walls(**change):
    return tuple(
        af.shapes.Sidewall(name=f"{side} sidewall", **WALL | change) for side in ("west", "east")
    )


@pytest.fixture(scope="module")
def prusias():
    return af.Case.read(MESHES / "prusias.toml").structure


def polygons(structure):
    return [shapely.Polygon(block.points) for block in structure.blocks]


def named(structure, name):
    return structure.joints[structure.joint_number(name)]


def block(structure, name):
    return next(each for each in structure.blocks if each.name == name)


def assert_apart(structure):
    areas = [polygon.area for polygon in polygons(structure)]
    assert all(polygon.is_valid for polygon in polygons(structure))
    assert sum(areas) == pytest.approx(shapely.union_all(polygons(structure)).area, abs=EXACT)


@pytest.mark.parametrize(
    ("part", "span", "embrace", "rise", "stones"),
    [
        ("north arch", 4.71, 157.0, 1.92, 14),
        ("main arch", 5.81, 159.0, 2.42, 17),
        ("south arch", 4.89, 150.0, 1.88, 15),
    ],
)
def test_span_and_embrace_make_the_rise(prusias, part, span, embrace, rise, stones):
    middles = [joint.middle for joint in prusias.joints if joint.part == part]
    assert len(middles) == stones + 1
    left, right = np.array(middles[0]), np.array(middles[-1])
    assert right - left == pytest.approx([span, 0.0], abs=EXACT)
    assert left[1] == pytest.approx(0.0, abs=EXACT)
    # The circle through both springings and one more joint; its crown is one radius above.
    x, y = middles[stones // 2] - 0.5 * (left + right)
    centre = (x * x + y * y - span**2 / 4.0) / (2.0 * y)
    crown = centre + np.hypot(span / 2.0, centre)
    assert crown == pytest.approx(0.5 * span * tan(radians(embrace) / 4.0), abs=EXACT)
    assert crown == pytest.approx(rise, abs=0.005)  # as rounded in the case's remark
    radii = np.linalg.norm(np.array(middles) - [0.5 * (left + right)[0], centre], axis=1)
    assert radii == pytest.approx(crown - centre, abs=EXACT)


def test_piers_are_flush_with_the_intrados(prusias):
    joint = named(prusias, "north pier, base")
    half = [0.527 * sin(radians(157.0) / 2.0) / 2.0, 0.577 * sin(radians(159.0) / 2.0) / 2.0]
    assert joint.depth == pytest.approx(1.02 + sum(half), abs=EXACT)
    assert joint.depth == pytest.approx(1.562, abs=5e-4)
    assert joint.middle[1] == pytest.approx(-2.0)
    feet = [named(prusias, "north arch, joint 14"), named(prusias, "main arch, joint 0")]
    assert joint.intrados[0] == pytest.approx(feet[0].intrados[0], abs=EXACT)
    assert joint.extrados[0] == pytest.approx(feet[1].intrados[0], abs=EXACT)


def test_the_deck_is_as_long_as_its_parts(prusias):
    x = block(prusias, "backfill").points[:, 0]
    assert (x.min(), x.max()) == pytest.approx((0.0, 2.8 + 4.71 + 5.81 + 4.89 + 2 * 1.02 + 10.0))
    assert x.max() == pytest.approx(30.25)


@pytest.mark.parametrize(
    "name",
    [
        "prusias",
        pytest.param("prusias_piers", marks=pytest.mark.slow),
        pytest.param("prusias_wall", marks=pytest.mark.slow),
        "prusias_fill",
        pytest.param("prusias_restored", marks=pytest.mark.slow),
    ],
)
def test_blocks_of_the_shipped_bridges_do_not_overlap(name):
    assert_apart(af.Case.read(MESHES / f"{name}.toml").structure)


def test_fill_is_the_deck_less_rings_and_openings():
    """Uneroded fill: what a rectangle from springing level to deck leaves around the stones."""
    made = af.bridge(**PAIR, sidewalls=walls(), backfill=af.shapes.Backfill(cover=0.5))
    fill = block(made, "backfill")
    (x0, _), (x1, top) = fill.points.min(axis=0), fill.points.max(axis=0)
    crown = max(y for each in made.blocks if "voussoir" in each.name for _, y in each.outline)
    assert top == pytest.approx(crown + 0.5, abs=EXACT)
    stones = shapely.union_all(
        [p for p, each in zip(polygons(made), made.blocks, strict=True) if each is not fill]
    )
    rest = shapely.difference(shapely.box(x0, 0.0, x1, top), stones)
    above = [
        each for each in rest.geoms if each.contains(shapely.Point(0.5 * (x0 + x1), top - 0.1))
    ]
    assert [each.area for each in above] == pytest.approx([fill.area], abs=EXACT)
    assert_apart(made)


@pytest.mark.parametrize("hump", [0.0, 0.7, 50.0])
def test_erosion_takes_all_but_a_hump(hump):
    """Between slopes of 1 to 2 beside the hump the fill sinks by the erosion."""
    full = af.bridge(**PAIR, sidewalls=walls(), backfill=af.shapes.Backfill(cover=0.8))
    sunk = af.bridge(
        **PAIR, sidewalls=walls(), backfill=af.shapes.Backfill(cover=0.8, erosion=0.4, hump=hump)
    )
    length = np.ptp(block(full, "backfill").points[:, 0])
    crown = 2.0 + 2.0  # the west crown: half the first span behind its sidewall
    left, right = (max(0.0, side - hump) for side in (crown, length - crown))

    def lost(side):  # 0.4 deep from 0.8 m off, less by a half before
        ramp = min(side, 0.8)
        return 0.4 * (side - ramp) + ramp**2 / 4.0

    points = block(sunk, "backfill").points
    high = points[points[:, 1] > points[:, 1].max() - 1e-9, 0]
    assert (high.min(), high.max()) == pytest.approx(
        (crown - min(hump, crown), crown + min(hump, length - crown))
    )
    gone = block(full, "backfill").area - block(sunk, "backfill").area
    assert gone == pytest.approx(lost(left) + lost(right), abs=EXACT)


def test_spandrels_weigh_in_place_of_fill():
    fill = af.shapes.Backfill(cover=0.5, spandrels=0.8)
    made = af.bridge(arches=[ARCH], backfill=fill, width=4.0)
    plain = af.bridge(arches=[ARCH], backfill=replace(fill, spandrels=0.0), width=4.0)
    soil = block(made, "backfill")
    extra = 0.8 * soil.area * (af.STONE.unit_weight - af.masonry.BACKFILL.unit_weight)
    assert made.weight - plain.weight == pytest.approx(extra, rel=1e-9)
    assert soil.material.young == af.masonry.BACKFILL.young


def test_names_and_parts(prusias):
    names = [joint.name for joint in prusias.joints]
    for part, stones in (("north arch", 14), ("main arch", 17), ("south arch", 15)):
        own = [name for name in names if name.startswith(f"{part}, joint")]
        assert own == [f"{part}, joint {k}" for k in range(stones + 1)]
    for part in ("north pier", "south pier"):
        own = [joint for joint in prusias.joints if joint.part == part]
        assert [joint.name for joint in own] == [
            f"{part}, {word}" for word in ("base", "joint 1", "joint 2", "joint 3", "joint 4")
        ]
        assert [joint.middle[1] for joint in own] == pytest.approx([-2.0, -1.6, -1.2, -0.8, -0.4])
    soil = named(prusias, "main arch, voussoir 5 to backfill")
    assert (soil.part, soil.contact) == ("backfill", af.masonry.SOIL_TO_STONE)
    assert {joint.role for joint in prusias.joints if "backfill" in joint.name} == {"other"}
    for joint in prusias.joints:
        if joint.role == "ring":
            assert joint.contact == af.masonry.STONE_TO_STONE
            assert joint.extrados[1] >= joint.intrados[1]


def test_two_spans_without_fill():
    made = af.bridge(**PAIR)
    assert {each.part for each in made.blocks} == {
        "left abutment",
        "west arch",
        "pier",
        "east arch",
        "right abutment",
    }
    fixed = [each.name for each in made.blocks if each.fixed]
    assert fixed == ["left abutment", "pier, foundation", "right abutment"]
    # Every voussoir has two faces, every course a bed below; nothing else touches.
    assert len(made.joints) == 2 * (13 + 1) + 6
    assert_apart(made)
    half = 2.0 * np.arctan(1.6 / 2.0)
    turn, radius = 2.0 * half / 13, 2.0 / sin(half)
    voussoirs = [each for each in made.blocks if "voussoir" in each.name]
    area = 26 * 0.45 * radius * sin(turn)  # chorded sectors of the ring
    assert sum(each.area for each in voussoirs) == pytest.approx(area, abs=EXACT)
    breadth = 0.9 + 0.45 * sin(half)
    courses = [each for each in made.blocks if each.name.startswith("pier, course")]
    assert sum(each.area for each in courses) == pytest.approx(breadth * 2.0, abs=EXACT)
    assert {round(each.area / breadth, 9) for each in courses} == {0.4}


def test_one_arch_with_fill_and_no_sidewalls():
    made = af.bridge(arches=[ARCH], backfill=af.shapes.Backfill(cover=0.4))
    assert [each.name for each in made.blocks if each.fixed] == ["left abutment", "right abutment"]
    fill = block(made, "backfill")
    feet = [named(made, f"arch, joint {k}").extrados[0] for k in (0, 13)]
    assert fill.points[:, 0].min() == pytest.approx(feet[0], abs=EXACT)
    assert fill.points[:, 0].max() == pytest.approx(feet[1], abs=EXACT)
    soil = [joint.name for joint in made.joints if joint.part == "backfill"]
    assert soil == [f"arch, voussoir {k} to backfill" for k in range(1, 14)]
    assert_apart(made)


@pytest.mark.parametrize(
    ("above", "filled", "state"),
    each_once((0.0, 0.8), (True, False), ("free", "retained", "fixed")),
)
def test_states_of_sidewalls(state, filled, above):
    fill = af.shapes.Backfill(cover=0.4) if filled else None
    made = af.bridge(arches=[ARCH], sidewalls=walls(state=state, above=above), backfill=fill)
    own = [each for each in made.blocks if each.part == "west sidewall"]
    fixed = {
        "free": ["west sidewall, foundation"],
        "retained": ["west sidewall, foundation", "west sidewall, retaining wall"],
        "fixed": ["west sidewall"],
    }
    assert [each.name for each in own if each.fixed] == fixed[state]
    # From the end of the deck to the intrados up to the springing joint, and on to the setback.
    wall = shapely.union_all([shapely.Polygon(e.points) for e in own if "foundation" not in e.name])
    wall = wall.intersection(shapely.box(0.0, -2.3, 4.0, 4.0))
    foot = named(made, "arch, joint 0")
    rise = foot.extrados[1] - foot.intrados[1]
    run = foot.intrados[0] - foot.extrados[0]
    area = foot.intrados[0] * (2.3 + foot.intrados[1])
    area += rise * (foot.extrados[0] + 0.5 * run) + above * (foot.extrados[0] - 0.4)
    assert wall.area == pytest.approx(area, abs=EXACT)
    if state == "retained":
        behind = [joint for joint in made.joints if "west sidewall, retaining" in joint.name]
        high = 2.3 + foot.extrados[1] + above
        assert sum(joint.depth for joint in behind) == pytest.approx(high, abs=EXACT)
        assert {round(float(x), 9) for joint in behind for x in joint.ends[:, 0]} == {0.0}
    assert_apart(made)


@pytest.mark.parametrize("stones", [1, 2, 3])
def test_the_hump_is_over_the_crown_of_rings_of_few_thick_stones(stones):
    """The highest points of one stone are the outer ends of its springings."""
    arch = af.shapes.Arch(
        measured="centre line", span=0.8, rise=0.2, thickness=0.7, voussoirs=stones
    )
    sides = walls(above=0.0, setback=0.1, length=4.0)
    fill = af.shapes.Backfill(cover=0.5, erosion=0.1, hump=0.6)
    made = af.bridge(arches=[arch], sidewalls=sides, backfill=fill)
    points = block(made, "backfill").points
    high = points[points[:, 1] > points[:, 1].max() - 1e-9, 0]
    crown = 4.0 + 0.4
    assert (high.min(), high.max()) == pytest.approx((crown - 0.6, crown + 0.6))


@pytest.mark.parametrize("spot", ["west", "east"])
def test_a_sidewall_without_setback(spot):
    change = {"setback": 0.0}
    both = [replace(wall, **change) if spot in wall.name else wall for wall in walls()]
    assert_apart(af.bridge(arches=[ARCH], sidewalls=both, backfill=af.shapes.Backfill(cover=0.4)))


def test_paving_follows_an_eroded_surface():
    fill = af.shapes.Backfill(cover=0.8, erosion=0.4, hump=0.5)
    paving = af.shapes.Paving(thickness=0.2, length=1.0)
    made = af.bridge(**PAIR, sidewalls=walls(), backfill=fill, paving=paving)
    stones = [each for each in made.blocks if each.part == "paving"]
    length = np.ptp(block(made, "backfill").points[:, 0])
    assert sum(each.area for each in stones) == pytest.approx(0.2 * length, abs=EXACT)
    # Surface of 2 m slopes counted by stones: each lies on the fill over its whole length.
    beds = [joint for joint in made.joints if joint.name.startswith("backfill to paving")]
    assert len(beds) == len(stones)
    slope = 2.0 * (np.hypot(0.8, 0.4) - 0.8)
    assert sum(joint.depth for joint in beds) == pytest.approx(length + slope, abs=EXACT)
    assert {joint.contact for joint in beds} == {af.masonry.SOIL_TO_STONE}
    between = [joint for joint in made.joints if joint.name.startswith("paving stone")]
    assert [joint.depth for joint in between] == pytest.approx([0.2] * (len(stones) - 1))
    assert {joint.contact for joint in between} == {af.masonry.STONE_TO_STONE}
    assert_apart(made)


def test_rings_in_chords_lie_on_the_circle():
    one, three = (
        af.bridge(arches=[ARCH], backfill=af.shapes.Backfill(cover=0.4), chords=n) for n in (1, 3)
    )
    half = 2.0 * np.arctan(1.6 / 2.0)
    turn, radius = 2.0 * half / 13, 2.0 / sin(half)
    for made, n in ((one, 1), (three, 3)):
        assert block(made, "arch, voussoir 7").area == pytest.approx(
            0.45 * radius * n * sin(turn / n), abs=EXACT
        )
        assert_apart(made)
    assert len(three.joints) - len(one.joints) == 2 * 13


def test_gravity_width_and_material_are_passed_on():
    stone = af.Material(20e9, 0.2, 24e3, name="basalt")
    made = af.bridge(arches=[ARCH], width=3.0, gravity=1.62, material=stone)
    assert (made.width, made.gravity) == (3.0, 1.62)
    assert {each.material for each in made.blocks} == {stone}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"arches": ()}, "0 arches and 1 piers: give at least one arch"),
        ({"piers": ()}, "2 arches and 0 piers: .* a pier between each two"),
        ({"sidewalls": walls()[:1]}, "1 sidewalls: give a left and a right one, or none"),
        ({"paving": af.shapes.Paving(thickness=0.2)}, "paving lies on backfill"),
        (
            {"backfill": af.shapes.Backfill(cover=0.01)},
            r"the fill is -0.002 m above the stones at x = ",
        ),
        (
            {"backfill": af.shapes.Backfill(cover=0.5, erosion=0.6, hump=0.0)},
            r"the fill is -0.\d+ m above .* less erosion, or less of `above`",
        ),
        (
            {"backfill": af.shapes.Backfill(cover=0.5), "sidewalls": walls(above=3.0)},
            "the fill is -0.7.* or less of `above`, the height of sidewalls over the springing",
        ),
        (
            {"backfill": af.shapes.Backfill(cover=0.5, spandrels=1.0)},
            "spandrels of 1 m do not fit into",
        ),
        (
            {"arches": FEW, "piers": (af.shapes.Pier(gap=0.3, height=2.0),)},
            "rings do not stand side by side on a gap of 0.3",
        ),
        (
            {"arches": FEW, "piers": (af.shapes.Pier(breadth=0.4, height=2.0),)},
            r"on a breadth of 0.4 m, and one stone would take over 1/6 of .*: give a wider one",
        ),
        ({"sidewalls": walls(setback=1.9)}, "nothing is left of its length 2 m behind the ring"),
        ({"sidewalls": walls(length=0.2)}, "nothing is left of its length 0.2 m"),
        ({"chords": 0}, "chords 0 is not a whole number"),
        ({"arches": (ARCH, ARCH)}, r"block names \['arch, voussoir 1', .* are used twice"),
        (
            {
                "arches": [
                    replace(arch, rise=None, embrace=230.0, thickness=0.6)
                    for arch in PAIR["arches"]
                ],
                "piers": (af.shapes.Pier(gap=0.6, height=2.0),),
            },
            "'west arch, voussoir .*' and 'east arch, voussoir .*' overlap by",
        ),
        (
            {
                "arches": [replace(arch, rise=None, embrace=220.0) for arch in PAIR["arches"]],
                "piers": (af.shapes.Pier(gap=2.5, height=2.0),),
                "backfill": af.shapes.Backfill(cover=0.5),
            },
            "the outline of 'backfill' crosses or touches itself",
        ),
    ],
)
def test_inconsistent_parts_are_refused(change, says):
    with pytest.raises(af.errors.InvalidStructure, match=says):
        af.bridge(**PAIR | change)


@pytest.mark.parametrize("thickness", [0.35, pytest.param(0.45, marks=pytest.mark.slow)])
@pytest.mark.parametrize("measured", ["intrados", "centre line"])
def test_a_pier_by_its_breadth_keeps_it_between_the_clear_spans(measured, thickness):
    """Whatever the thickness of the rings; a gap is thickness × sin(embrace / 2) narrower."""
    rings = [replace(arch, measured=measured, thickness=thickness) for arch in PAIR["arches"]]
    made = af.bridge(
        arches=rings, piers=[af.shapes.Pier(breadth=0.9, height=2.4)], sidewalls=walls()
    )
    beds = [joint for joint in made.joints if joint.part == "pier"]
    assert [joint.depth for joint in beds] == pytest.approx([0.9] * len(beds), rel=EXACT)
    ends = [
        np.array([joint.intrados for joint in made.joints if joint.part == arch.name])
        for arch in rings
    ]
    assert ends[1][:, 0].min() - ends[0][:, 0].max() == pytest.approx(0.9, rel=EXACT)
    low = 2.4 + ends[0][:, 1].min()  # the springing level is above the clear springing
    words = describe_spans(made)
    assert words.endswith(f"; 'pier' 0.9 m broad and {low:.3g} m high to the ring")
    if measured == "intrados":
        assert np.ptp(ends[0][:, 0]) == pytest.approx(4.0, rel=EXACT)
        assert f"{ends[0][:, 0].max() + 0.9:.2f} to " in words
        assert low == pytest.approx(2.4 - 0.5 * thickness * (2.0**2 - 1.6**2) / (2.0**2 + 1.6**2))
    gap = 0.9 - thickness * sin(rings[0].half)
    other = af.bridge(arches=rings, piers=[af.shapes.Pier(gap=gap, height=2.4)], sidewalls=walls())
    for one, two in zip(made.blocks, other.blocks, strict=True):
        np.testing.assert_allclose(one.points, two.points, atol=EXACT)


@pytest.mark.parametrize(("cover", "fits"), [(0.0205, True), (0.0195, False)])
@pytest.mark.parametrize("voussoirs", [7, 8])
def test_fill_is_two_centimetres_thick_at_least(cover, fits, voussoirs):
    """Above the crown, which is in the middle of a stone where their number is odd."""
    arch = replace(ARCH, voussoirs=voussoirs)
    extrados, step = arch.radius + 0.5 * arch.thickness, 2.0 * arch.half / voussoirs
    above = extrados * (1.0 - np.cos(0.5 * step)) if voussoirs % 2 else 0.0  # the chord
    fill = {"arches": [arch], "backfill": af.shapes.Backfill(cover=above + cover)}
    if fits:
        assert "backfill" in [block.name for block in af.bridge(**fill).blocks]
    else:
        with pytest.raises(af.errors.InvalidStructure, match=r"the fill is 0\.0[12]\d m above"):
            af.bridge(**fill)


def test_foundations_are_twenty_centimetres_deep():
    pier = af.shapes.Pier(name="pier", gap=0.9, height=2.4)
    made = af.bridge(**PAIR | {"piers": [pier]}, sidewalls=walls())
    low = [b.points[:, 1] for b in made.blocks if b.fixed and "foundation" in b.name]
    assert len(low) >= 3
    assert [float(np.ptp(y)) for y in low] == pytest.approx([0.2] * len(low))
