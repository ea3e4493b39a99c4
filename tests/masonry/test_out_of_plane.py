"""Walls across their plane: columns of them, and the push that overturns a body."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import archfem as af
from archfem.masonry.out_of_plane import (
    describe_lengths,
    describe_transverse_push,
    find_openings,
    find_transverse_push,
)
from archfem.masonry.standing import describe_carried
from archfem.masonry.structure import merge_levels


def test_a_push_across_the_plane_overturns_all_from_the_ground_on():
    """A wall on two columns, 0.5 m wide: its own height is no measure of what overturns."""
    ground = ((-1, -1), (4, -1), (4, 0), (-1, 0))

    def stand(height, **plinth):
        corners = [(0, 0, 0.4, height), (2, 0, 2.4, height), (0, height, 2.4, height + 1)]
        outlines = [((a, b), (c, b), (c, d), (a, d)) for a, b, c, d in corners]
        blocks = [af.Block(ground, af.STONE, "ground", fixed=True)]
        blocks += [af.Block(outline, af.STONE, f"b{k}") for k, outline in enumerate(outlines)]
        blocks[1:3] = (replace(b, material=replace(af.STONE, **plinth)) for b in blocks[1:3])
        return af.masonry.assembled(blocks, af.Contact(1e9, 4e8), width=0.5)

    areas, heights = np.array([0.8, 0.8, 2.4]), np.array([1.0, 1.0, 2.5])
    middle = (areas @ heights) / areas.sum()
    assert find_transverse_push(stand(2)) == (pytest.approx(0.25 / middle), "all of it")
    # on low and heavy columns the wall overturns alone
    heavy = stand(0.2, unit_weight=1e6, stands_for="ballast")
    assert find_transverse_push(heavy) == (
        pytest.approx(0.25 / 0.5),
        "all above 200 mm from the base",
    )
    assert "begins to overturn at 0.5 g or less, by the width" in describe_transverse_push(heavy)
    # of a strip of a wall in bond the height counts, of a single stack nothing is known
    column = af.column(breadth=0.5, heights=[2.0, 1.0])
    assert np.isnan(find_transverse_push(column)[0])
    assert describe_transverse_push(column) == (
        "nothing is checked across the plane of the drawing; if that is the section of a wall, it "
        "is checked across its own plane here, and in it by a case of its own"
    )


def test_a_strip_of_a_gable_overturns_before_the_gable_does():
    """Three courses of stones in bond, the upper ones shorter."""
    rows = [(0, (0, 1, 2, 3, 4)), (1, (0.5, 1.5, 2.5, 3.5)), (2, (1, 2, 3))]
    blocks = [af.Block(((0, -1), (4, -1), (4, 0), (0, 0)), af.STONE, "ground", fixed=True)]
    for level, cuts in rows:
        for a, b in pairwise(cuts):
            outline = ((a, level), (b, level), (b, level + 1), (a, level + 1))
            blocks.append(af.Block(outline, af.STONE, f"{level} {a}", part="wall", role="pier"))
    gable = af.masonry.assembled(blocks, af.Contact(1e9, 4e8), width=0.6)
    assert find_transverse_push(gable) == (pytest.approx(0.6 / 3.0), "a strip from bottom to top")


def test_a_wall_across_its_plane_is_a_strip_and_the_whole_less_its_openings():
    """A door of 1 m in two courses of three, with one stone as high as both at its left."""
    rows = [(0, 2, (0, 1)), (0, 1, (2, 3, 4)), (1, 2, (2, 2.5, 4)), (2, 3, (0, 1.5, 3, 4))]
    blocks = [af.Block(((0, -1), (4, -1), (4, 0), (0, 0)), af.STONE, "ground", fixed=True)]
    for low, high, cuts in rows:
        for a, b in pairwise(cuts):
            outline = ((a, low), (b, low), (b, high), (a, high))
            blocks.append(af.Block(outline, af.STONE, f"{low} {a}", part="wall", role="pier"))
    wall = af.masonry.assembled(blocks, af.Contact(1e9, 4e8, friction=0.7), width=0.6)
    assert find_openings(wall) == [pytest.approx((1.0, 0.0, 2.0, 2.0))]
    columns = af.masonry.columns_across(wall)
    strip, whole = columns["strip"], columns["whole"]
    assert [len(each.free) for each in columns.values()] == [3, 3, 3]
    assert {joint.contact for joint in whole.joints} == {wall.joints[0].contact}
    assert strip.weight == pytest.approx(0.6 * 3.0 * 20e3)
    # the stones of the lowest course, beside the door, bear all of it
    assert (whole.weight, whole.width) == (pytest.approx(wall.weight), pytest.approx(3.0))
    weights = [block.area * block.material.unit_weight * 3.0 for block in whole.blocks[1:]]
    assert weights == pytest.approx([0.6 * 20e3 * area for area in (3.0, 3.0, 4.0)])
    pushes = [
        af.collapse_factor(each, live=af.BodyForce(1.0), friction=None).factor
        for each in columns.values()
    ]
    # thickness over height, and over twice the height of the centre: of the pier at the left end
    # with half of the wall above the door
    whole, end = (3 * 0.5 + 3 * 1.5 + 4 * 2.5) / 10, (0.5 + 1.5 + 1.5 * 2.5) / 3.5
    assert pushes == pytest.approx([0.6 / 3.0, 0.3 / whole, 0.3 / end], rel=2e-3)
    body = "the pier at x = 0.5 m, with what it carries,"
    assert find_transverse_push(wall) == (pytest.approx(min(pushes), rel=2e-3), body)


@pytest.mark.parametrize("upper", [False, True])
def test_a_pier_between_openings_overturns_before_the_wall_does(upper):
    """A door and a window: half of the wall above each, and none of that below the window."""
    given = {"head": 2.0, "breadth": 1.0}
    openings = [af.shapes.Opening(left=-1.5, **given, name="door")]
    openings.append(af.shapes.Opening(left=0.5, sill=1.0, **given, name="window"))
    # pier 1 m broad and 3 m high, and half a metre at both sides above 2 m
    areas, heights = np.array([3.0, 1.0]), np.array([1.5, 2.5])
    if upper:  # on the same axis, half of 0.6 m is of this pier
        high = {"left": 0.7, "breadth": 0.6, "sill": 2.5, "head": 2.75}
        openings.append(af.shapes.Opening(**high, name="upper window"))
        areas, heights = np.append(areas, -0.3 * 0.25), np.append(heights, 2.625)
    wall = af.shapes.wall(breadth=6.0, height=3.0, width=0.5, course=0.25, openings=openings)
    push, body = find_transverse_push(wall)
    assert body == "the pier at x = 0 m, with what it carries,"
    assert push == pytest.approx(0.25 / (areas @ heights / areas.sum()))
    whole = af.masonry.columns_across(wall)["whole"]
    assert push < af.collapse_factor(whole, live=af.BodyForce(1.0), friction=None).factor


@pytest.mark.parametrize(
    ("breadths", "levels"),
    [((3.0, 1.0), [0.0, 1.0, 2.0, 3.0]), ((2.0, 2.0), [0.0, 1.0, 1.4, 2.0, 2.6, 3.0])],
)
def test_courses_across_the_plane_are_between_beds_over_most_of_the_length(breadths, levels):
    """Two stacks side by side, with beds at 1 and 2 m, and at 1.4 and 2.6 m."""
    blocks = [af.Block(((0, -1), (4, -1), (4, 0), (0, 0)), af.STONE, "ground", fixed=True)]
    for left, breadth, beds in ((0.0, breadths[0], (1, 2)), (breadths[0], breadths[1], (1.4, 2.6))):
        for a, b in pairwise((0, *beds, 3)):
            outline = ((left, a), (left + breadth, a), (left + breadth, b), (left, b))
            blocks.append(af.Block(outline, af.STONE, f"{left} {a}", part="wall", role="pier"))
    wall = af.masonry.assembled(blocks, af.Contact(1e9, 4e8, friction=0.7), width=0.6)
    for each in af.masonry.columns_across(wall).values():
        tops = [0.0, *(block.points[:, 1].max() for block in each.blocks[1:])]
        assert tops == pytest.approx(levels)
        assert each.weight / each.width == pytest.approx(0.6 * 3.0 * 20e3)


def test_the_tip_of_a_gable_and_the_course_below_it_have_their_centre_across_the_plane(verified):
    """A triangle of eight courses: the upper ones weigh 1, 3, 5 and 7, the lower ones 9 to 15."""
    half, height, thick = 2.0, 4.0, 0.5
    blocks = [af.Block(((-3, -1), (3, -1), (3, 0), (-3, 0)), af.STONE, "ground", fixed=True)]
    for low in np.arange(0.0, height, 0.5):
        a, b = (half * (1.0 - y / height) for y in (low, low + 0.5))
        for left, right in (((-a, 0), (-b, 0)), ((0, a), (0, b))):
            (p, q), (r, s) = left, right
            outline = [*dict.fromkeys([(p, low), (q, low), (s, low + 0.5), (r, low + 0.5)])]
            name = f"{low} {p}"
            blocks.append(af.Block(outline, af.STONE, name, part="wall", role="pier"))
    gable = af.masonry.assembled(blocks, af.Contact(1e9, 4e8, friction=0.7), width=thick)
    columns = af.masonry.columns_across(gable)
    # a fifth of the median, 8, is more than 1, and less than 3 + 1
    assert [len(each.free) for each in columns.values()] == [7, 8]
    whole = columns["whole"]
    weights = np.array([x.area * x.material.unit_weight for x in whole.blocks[1:]])
    parts = np.array([15, 13, 11, 9, 7, 5, 8 / 3, 4 / 3])
    assert weights / weights.sum() == pytest.approx(parts / 64, rel=1e-5)
    # the two are cut at the centre of their triangle
    assert np.ptp(whole.blocks[-1].points[:, 1]) == pytest.approx(2.0 / 3.0)
    # half the thickness over the height of the centre, less than a hundredth below the triangle's
    found = af.collapse_factor(whole, live=af.BodyForce(1.0), friction=None).factor
    middles = np.array([0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 19 / 6, 11 / 3])
    centre = middles @ parts / 64
    assert found == pytest.approx(0.5 * thick / centre, rel=2e-3)
    exact = 1.5 * thick / height
    verified("gable across its plane: factor", exact, "centre of a triangle", found)
    assert 0.99 < found / exact < 1.0
    # its weight is no load, which would act higher
    assert not describe_carried(whole)
    # the lowest course is 4 m long at its foot, and 3.5 m at its top
    assert whole.width == pytest.approx(3.75)
    assert describe_lengths(whole) == ", as its lowest course on average"
    assert not describe_lengths(columns["strip"])


def test_a_wall_across_its_plane_may_begin_at_its_eaves():
    """A triangle 3 m high on a rectangle of 2.5 m: the triangle, from the next bed on."""
    wall = af.shapes.wall(breadth=4.0, height=5.5, eaves=2.5, width=0.4, course=0.25)
    for above, height in ((2.5, 3.0), (2.6, 2.75)):
        columns = af.masonry.columns_across(wall, above=above)
        strip, whole = columns["strip"], columns["whole"]
        assert strip.weight == pytest.approx(height * 0.4 * 20e3)
        area = 0.5 * (4.0 * height / 3.0) * height
        assert whole.weight == pytest.approx(area * 0.4 * 20e3)
        push = af.collapse_factor(strip, live=af.BodyForce(1.0), friction=None).factor
        assert push == pytest.approx(0.4 / height)
    with pytest.raises(af.InvalidInput, match=r"up to the last bed, = 5.4 is not between"):
        af.masonry.columns_across(wall, above=5.4)


def test_floor_and_roof_weigh_on_a_wall_across_its_plane(tmp_path):
    """A wall of 4 m with a door of 1 m: a floor on course 3, a roof on 5, a statue on all."""
    thick, floor, roof = 0.5, 4e3, 6e3  # [m, N/m, N/m]
    names = {2: ("floor", floor), 4: ("roof", roof)}
    blocks = [af.Block(((0, -1), (4, -1), (4, 0), (0, 0)), af.STONE, "ground", fixed=True)]
    for low in range(5):
        cuts = [(0, 1), (2, 3), (3, 4)] if low < 2 else [(0, 1.5), (1.5, 4)]
        cuts = [(0, 2), (2, 4)] if low == 3 else cuts
        word, load = names.get(low, (None, 0.0))
        # course 3 has a window of 1 m, so that 3 m of stones bear the floor of 4 m
        cuts = [(0, 1.5), (2.5, 4)] if low == 2 else cuts
        length = sum(b - a for a, b in cuts)
        unit_weight = 20e3 + 4.0 * load / (length * thick)
        stone = replace(af.STONE, unit_weight=unit_weight, stands_for=word)
        for a, b in cuts:
            outline = ((a, low), (b, low), (b, low + 1), (a, low + 1))
            blocks.append(af.Block(outline, stone, f"{low} {a}", part="wall", role="pier"))
    wall = af.masonry.assembled(blocks, af.Contact(1e9, 4e8, friction=0.7), width=thick)
    statue = af.masonry.StandingBody(
        x=3.0, length=0.5, weight=40e3, centre_of_gravity=0.5, name="statue"
    )
    carrying = af.masonry.carrying(wall, [statue])
    heights = np.array([0.5, 1.5, 2.5, 3.5, 4.5, 5.5])
    per_metre = thick * 20e3 + np.array([0.0, 0.0, floor, 0.0, roof, 0.0])
    per_metre[5] = 10e3
    of_whole = 4.0 * per_metre - thick * 20e3 * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    for structure, count in ((wall, 5), (carrying, 6)):
        columns = af.masonry.columns_across(structure)
        for name, weights in {"strip": per_metre, "whole": of_whole}.items():
            column = columns[name]
            found = [x.area * x.material.unit_weight * column.width for x in column.blocks[1:]]
            assert found == pytest.approx(weights[:count], rel=1e-6)
            push = af.collapse_factor(column, live=af.BodyForce(1.0), friction=None).factor
            arm = weights[:count] @ heights[:count] / weights[:count].sum()
            assert push == pytest.approx(0.5 * thick / arm, rel=2e-3)
            written = af.Analysis(column, fidelity="rigid").write(tmp_path / f"{name}.toml")
            kept = "floor, roof and statue" if count == 6 else "floor and roof"
            note = describe_carried(af.Case.read(written).structure)
            assert note.startswith(f"the mass of {kept.replace(' and', ',')} counts at the middle")


def test_a_portal_on_feet_of_uneven_height_turns_across_the_plane_from_the_ground():
    """Two piers in bond 0.5 mm apart in height, below a lintel, as snapped surveys have them."""
    blocks = [af.Block(((0, -1), (4, -1), (4, 0.0005), (3, 0.0005), (3, 0), (0, 0)), af.STONE, "g")]
    blocks[0] = replace(blocks[0], fixed=True)
    for x, low in ((0, 0.0), (3, 0.0005)):
        rows = [(low, 1.0, (0, 1)), (1.0, 2.0, (0, 0.5, 1)), (2.0, 3.0, (0, 1))]
        for y, top, cuts in rows:
            for a, b in pairwise(cuts):
                outline = ((x + a, y), (x + b, y), (x + b, top), (x + a, top))
                blocks.append(af.Block(outline, af.STONE, f"{x} {y} {a}", part="p", role="pier"))
    lintel = ((0, 3), (4, 3), (4, 4), (0, 4))
    blocks.append(af.Block(lintel, af.STONE, "lintel", part="p", role="pier"))
    portal = af.masonry.assembled(blocks, af.Contact(1e9, 4e8), width=0.6)
    # areas 6 and 4 m², centres at 1.5 and 3.5 m
    centre = (6 * 1.5 + 4 * 3.5) / 10
    assert find_transverse_push(portal) == (pytest.approx(0.3 / centre, rel=1e-3), "all of it")
    columns = af.masonry.columns_across(portal)
    assert [len(each.free) for each in columns.values()] == [4, 4, 4]
    assert columns["whole"].weight == pytest.approx(portal.weight)
    # the beds of thin stones are as far apart as these are high, and remain
    stones = [(5.0, 0.01), (5.01, 0.02)]
    ends = np.array([(0.0, 5.0), *((y, y + h) for y, h in stones)])
    assert merge_levels(ends).tolist() == ends.tolist()


def test_a_ring_on_piers_has_its_own_centre_across_the_plane():
    """Of a half ring of radius 2 m, 0.5 m thick, on piers 3 m high and 0.8 m broad."""
    given = {"radius": 2.0, "thickness": 0.5, "voussoirs": 41, "width": 0.6}
    ring = af.arch_on_piers(**given, pier_breadth=0.8, courses=[1.0, 1.0, 1.0])
    outer, inner = 2.25, 1.75
    area = 0.5 * np.pi * (outer**2 - inner**2)
    centre = 4.0 / 3.0 / np.pi * (outer**3 - inner**3) / (outer**2 - inner**2)
    centre = (2.0 * 0.8 * 3.0 * 1.5 + area * (3.0 + centre)) / (2.0 * 0.8 * 3.0 + area)
    by_hand = 0.3 / centre
    assert find_transverse_push(ring)[0] == pytest.approx(by_hand, rel=2e-3)
    whole = af.masonry.columns_across(ring)["whole"]
    assert (whole.weight, whole.width) == (pytest.approx(ring.weight), pytest.approx(1.6))
    push = af.collapse_factor(whole, live=af.BodyForce(1.0), friction=None).factor
    assert push == pytest.approx(find_transverse_push(ring)[0], rel=1e-6)


def gable_with_a_roof(roof):
    """A front 4 m broad with its ridge at 4 m, eaves at 3 m, a door of 1 m, and a roof [N/m]."""
    door = af.shapes.Opening(left=-0.5, breadth=1.0, head=2.0, name="door")
    given = {"breadth": 4.0, "height": 4.0, "eaves": 3.0, "width": 0.5, "openings": [door]}
    wall = af.shapes.wall(**given, course=0.25, stone=0.5)
    blocks = []
    for block in wall.blocks:
        points = block.points
        slopes = [  # ends of its edges along the slopes, where y = 4 - |x| / 2
            abs(b[0] - a[0])
            for a, b in zip(points, np.roll(points, -1, axis=0), strict=True)
            if abs(a[1] - b[1]) > 1e-9
            and np.allclose([a[1], b[1]], [4.0 - abs(a[0]) / 2, 4.0 - abs(b[0]) / 2])
        ]
        if slopes and not block.fixed:
            unit_weight = 20e3 + roof * sum(slopes) / (block.area * wall.width)
            stone = replace(af.STONE, unit_weight=unit_weight, stands_for="roof")
            block = replace(block, material=stone)
        blocks.append(block)
    return replace(wall, blocks=tuple(blocks), name="front", origin=None)


def test_a_roof_is_on_the_ridge_of_a_strip_and_weighs_on_the_piers(tmp_path):
    """Virtual work of weights by hand: per metre a roof of 4 kN on 10 kN/m² of stone."""
    roof, stone, half = 4e3, 0.5 * 20e3, 0.25
    wall = gable_with_a_roof(roof)
    written = af.Analysis(wall, fidelity="rigid").write(tmp_path / "front.toml")
    wall = af.Case.read(written).structure  # its openings are holes between its stones
    assert wall.weight == pytest.approx(stone * (12 + 2 - 2) + 4 * roof)

    def push(column):
        return af.collapse_factor(column, live=af.BodyForce(1.0), friction=None).factor

    for above, high in ((None, 4.0), (3.0, 1.0)):
        columns = af.masonry.columns_across(wall, above=above)
        strip = columns["strip"]
        assert strip.weight == pytest.approx(stone * high + roof)
        by_hand = half * (stone * high + roof) / (stone * high**2 / 2 + roof * high)
        assert push(strip) == pytest.approx(by_hand, rel=3e-3)
        title = "front" + " above 3 m" * (above is not None)  # each has its own
        assert (strip.above, strip.name) == (4.0 - high, f"{title}, strip")
        assert {x.material.stands_for for x in strip.blocks[-2:]} == {None, "roof"}
    # a pier of 1.5 m beside the door, with 0.5 m above it: up to 3 m, below the slope, and roof
    parts = [(4.5, 1.5), (0.5, 2.5), (0.5 * 2.0 * 1.0, 3.0 + 1.0 / 3.0)]
    weight = stone * sum(area for area, _ in parts) + 2.0 * roof
    moment = stone * sum(area * y for area, y in parts) + 2.0 * roof * 3.5
    columns = af.masonry.columns_across(wall)
    pier = columns["pier"]
    assert (pier.weight, pier.width) == (pytest.approx(weight), pytest.approx(1.5))
    # courses' middles are higher than the centres of those below a slope, and the roof is lower
    assert push(pier) == pytest.approx(half * weight / moment, rel=5e-3)
    pushes = {key: push(each) for key, each in columns.items()}
    least, body = find_transverse_push(wall)
    assert body == "a strip from bottom to top"
    assert least == pytest.approx(min(pushes.values()), rel=2e-3)


def test_a_roof_of_a_gable_is_that_laid_stone_by_stone():
    door = af.shapes.Opening(left=-0.5, breadth=1.0, head=2.0, name="door")
    roof = af.shapes.Floor(level=4.0, load=4e3, name="roof")
    given = {"breadth": 4.0, "height": 4.0, "eaves": 3.0, "width": 0.5, "openings": [door]}
    wall, by_hand = af.shapes.wall(**given, floors=[roof]), gable_with_a_roof(4e3)
    for own, other in zip(wall.blocks, by_hand.blocks, strict=True):
        assert own.material.stands_for == other.material.stands_for
        assert own.material.unit_weight == pytest.approx(other.material.unit_weight)


def test_floor_and_roof_of_a_front_weigh_on_its_columns_by_hand():
    """A front of 6 x 5 m, 0.5 m thick: a door, a window, a floor at 2.75 m and a roof at 5 m."""
    openings = [
        af.shapes.Opening(left=-1.5, breadth=1.0, head=2.25, name="door"),
        af.shapes.Opening(left=0.5, breadth=1.0, sill=3.0, head=4.25, name="window"),
    ]
    stone, floor, roof, half = 0.5 * 20e3, 12e3, 8e3, 0.25  # [N/m², N/m, N/m, m]
    floors = [
        af.shapes.Floor(level=2.75, load=floor),
        af.shapes.Floor(level=5.0, load=roof, name="roof"),
    ]
    wall = af.shapes.wall(breadth=6.0, height=5.0, width=0.5, openings=openings, floors=floors)

    def by_hand(areas, floor_length, roof_length):
        """Return weight, and push: masses of floors are at the middle of the course below them."""
        parts = [(stone * area, y) for area, y in areas]
        parts += [(floor * floor_length, 2.625), (roof * roof_length, 4.875)]
        weight = sum(each for each, _ in parts)
        return weight, half * weight / sum(each * y for each, y in parts)

    door, window = (-1.0 * 2.25, 2.25 / 2.0), (-1.0 * 1.25, 3.625)
    above_door, above_window = (0.5 * 2.75, 3.625), (0.5 * 0.75, 4.625)
    # piers carry up to the middles of the openings beside them, but nothing below a window
    piers = [
        by_hand([(7.5, 2.5), above_door], 2.0, 2.0),
        by_hand([(5.0, 2.5), above_door, above_window], 1.5, 2.0),
        by_hand([(7.5, 2.5), above_window], 1.5, 2.0),
    ]
    expected = {
        "strip": by_hand([(5.0, 2.5)], 1.0, 1.0),
        "whole": by_hand([(30.0, 2.5), door, window], 6.0, 6.0),
        "pier": min(piers, key=lambda each: each[1]),
    }
    for name, column in af.masonry.columns_across(wall).items():
        weight, push = expected[name]
        assert column.weight == pytest.approx(weight, rel=1e-6)
        found = af.collapse_factor(column, live=af.BodyForce(1.0), friction=None).factor
        assert found == pytest.approx(push, rel=2e-3)
        carrying = {x.points[:, 1].max(): x.material.stands_for for x in column.blocks}
        assert (carrying[2.75], carrying[5.0]) == ("floor", "roof")
        assert describe_carried(column).startswith("the mass of floor, roof counts at the middle")
    # above the floor its weight is left out
    upper = af.masonry.columns_across(wall, above=2.75)["strip"]
    assert upper.weight == pytest.approx(stone * 2.25 + roof)


def test_a_column_above_a_level_doubts_the_spectrum_of_the_ground(tmp_path):
    wall = gable_with_a_roof(4e3)
    for above, doubted in ((None, False), (3.0, True)):
        column = af.masonry.columns_across(wall, above=above)["strip"]
        path = af.Analysis(column, fidelity="rigid").write(tmp_path / "strip.toml")
        read = af.Case.read(path)
        assert read.structure == column
        assert (read.title, read.structure.above) == (column.name, above or 0.0)
        assert describe_transverse_push(read.structure) == ""  # it is across the plane
        found = af.kinematic_assessment(read.structure, af.Eurocode8(ag=0.1, ground="A"), q=1.5)
        said = [str(doubt) for doubt in found.doubts if "that of the ground" in str(doubt)]
        assert len(said) == doubted
        assert [check.bounded for check in found.checks] == [doubted] * len(found.checks)
        assert all(
            "and 3 m above it, at the foot of what moves, it is larger" in x for x in said
        ), said
        table = af.motion.TableSpectrum(periods=[0.0, 1.0, 4.0], values=[0.1, 0.2, 0.1])
        found = af.kinematic_assessment(read.structure, table)
        assert not any("that of the ground" in str(doubt) for doubt in found.doubts)
