"""Joints found from touching edges: their number, their names and their directions."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.masonry import assembled
from archfem.masonry.assembly import _orient_line, by_materials, touching

EXACT = 1e-12
"""Ends are corners of the blocks, to round-off of coordinates of a few metres."""


def box(x0, y0, x1, y1, name, **more):
    return af.Block(((x0, y0), (x1, y0), (x1, y1), (x0, y1)), af.STONE, name, **more)


def by_pair(structure):
    return {frozenset(joint.blocks): joint for joint in structure.joints}


@pytest.mark.parametrize("chords", [None, 1, 3])
def test_joints_of_a_ring_are_found(chords):
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=chords)
    found = assembled(ring.blocks, af.masonry.STONE_TO_STONE)
    assert [joint.name for joint in found.joints] == [f"arch, joint {k}" for k in range(18)]
    for joint, given in zip(found.joints, ring.joints, strict=True):
        assert set(joint.blocks) == set(given.blocks)
        assert joint.ends == pytest.approx(given.ends, abs=EXACT)
        assert joint.part == "arch"


def test_joints_of_a_column_are_found():
    stack = af.column(breadth=0.8, heights=[1.0, 0.5, 2.0])
    found = assembled(stack.blocks, af.masonry.STONE_TO_STONE)
    names = ["column, base", "column, joint 1", "column, joint 2"]
    assert [joint.name for joint in found.joints] == names
    for joint, given in zip(found.joints, stack.joints, strict=True):
        assert joint.ends == pytest.approx(given.ends, abs=EXACT)


def test_springings_on_piers_belong_to_the_ring():
    given = af.arch_on_piers(
        radius=2.0, thickness=0.4, voussoirs=9, pier_breadth=0.8, courses=[0.5, 0.5]
    )
    found = by_pair(assembled(given.blocks, af.masonry.STONE_TO_STONE))
    for joint in given.joints:
        mine = found[frozenset(joint.blocks)]
        assert mine.part == joint.part
        if joint.part == "arch":
            assert mine.ends == pytest.approx(joint.ends, abs=EXACT)


@pytest.mark.parametrize("turn", [0.0, 25.0, -25.0])
@pytest.mark.parametrize("embrace", ["5 degree", 60.0, 159.0, 250.0])
def test_the_outer_end_is_found_for_shallow_and_skew_rings(turn, embrace):
    ring = af.circular_arch(radius=3.0, thickness=0.4, embrace=embrace, voussoirs=7, chords=1)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    spin = np.array([[c, -s], [s, c]])
    blocks = [
        replace(block, outline=tuple(map(tuple, (block.points @ spin.T + [3.0, 9.0]).tolist())))
        for block in ring.blocks
    ]
    found = assembled(blocks, af.masonry.STONE_TO_STONE).joints
    ends = np.array([joint.ends for joint in ring.joints]) @ spin.T + [3.0, 9.0]
    assert np.array([joint.ends for joint in found]) == pytest.approx(ends, abs=1e-9)


def test_a_pointed_arch_is_counted_from_the_left_and_points_outwards():
    """Two arcs of radius 4 about (±1, 0), whose joints are radial to two centres."""
    inner, outer, blocks = 3.8, 4.2, []
    stop = np.arccos(1.0 / 4.0)
    angles = np.linspace(0.0, stop, 6)
    for sign, name in ((-1.0, "left"), (1.0, "right")):
        rim = [
            [(sign * (r * np.cos(a) - 1.0), r * np.sin(a)) for a in angles] for r in (inner, outer)
        ]
        for r, face in zip((inner, outer), rim, strict=True):
            face[-1] = (0.0, float(np.sqrt(r**2 - 1.0)))
        for k in range(5):
            points = [rim[0][k], rim[1][k], rim[1][k + 1], rim[0][k + 1]]
            points = points if sign > 0 else points[::-1]
            blocks.append(af.Block(tuple(points), af.STONE, f"{name} {k}", part="arch"))
    blocks.append(box(-3.3, -1.0, -2.7, 0.0, "left foot", fixed=True))
    blocks.append(box(2.7, -1.0, 3.3, 0.0, "right foot", fixed=True))
    joints = assembled(blocks, af.masonry.STONE_TO_STONE).joints
    assert [joint.name for joint in joints] == [f"arch, joint {k}" for k in range(11)]
    assert np.all(np.diff([joint.middle[0] for joint in joints]) > 0.0)
    assert all(joint.tangent @ (joint.middle - [0.0, 0.0]) > 0.0 for joint in joints)


def test_a_flat_arch_points_upwards():
    tops, bottoms = np.linspace(-1.2, 1.2, 6), np.linspace(-0.8, 0.8, 6)
    stones = [
        af.Block(
            ((bottoms[k], 0.0), (bottoms[k + 1], 0.0), (tops[k + 1], 0.5), (tops[k], 0.5)),
            af.STONE,
            f"stone {k + 1}",
            part="flat arch",
        )
        for k in range(5)
    ]
    ends = [
        af.Block(
            ((-2.0, 0.0), (-0.8, 0.0), (-1.2, 0.5), (-2.0, 0.5)), af.STONE, "left", fixed=True
        ),
        af.Block(((0.8, 0.0), (2.0, 0.0), (2.0, 0.5), (1.2, 0.5)), af.STONE, "right", fixed=True),
    ]
    joints = assembled([*reversed(stones), *ends], af.masonry.STONE_TO_STONE).joints
    assert [joint.name for joint in joints] == [f"flat arch, joint {k}" for k in range(6)]
    assert all(joint.extrados[1] > joint.intrados[1] for joint in joints)
    assert np.all(np.diff([joint.middle[0] for joint in joints]) > 0.0)


def test_one_course_on_two_stones_has_two_joints():
    ground = box(0.0, -1.0, 4.0, 0.0, "ground", fixed=True)
    left, right = box(0.0, 0.0, 1.5, 1.0, "left"), box(1.5, 0.0, 4.0, 1.0, "right")
    joints = assembled(
        [ground, left, right, box(0.5, 1.0, 3.5, 2.0, "lintel")], af.masonry.STONE_TO_STONE
    )
    spans = {joint.name: sorted(joint.ends[:, 0].tolist()) for joint in joints.joints}
    assert spans == {
        "ground to left": [0.0, 1.5],
        "ground to right": [1.5, 4.0],
        "left to right": [1.5, 1.5],
        "left to lintel": [0.5, 1.5],
        "right to lintel": [1.5, 3.5],
    }


@pytest.mark.parametrize("upright", [False, True])
def test_edges_that_continue_each_other_are_one_joint(upright):
    """Both blocks have vertices in the middle of the common line, at different places."""

    def turned(points):
        return tuple((-y, x) if upright else (x, y) for x, y in points)

    low = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (2.2, 1.0), (1.0, 1.0), (0.0, 1.0)]
    high = [(0.0, 1.0), (1.6, 1.0), (2.7, 1.0), (3.0, 1.0), (3.0, 2.0), (0.0, 2.0)]
    blocks = [
        af.Block(turned(low), af.STONE, "a", fixed=True),
        af.Block(turned(high), af.STONE, "b"),
    ]
    (touch,) = touching(blocks)
    assert touch[2] == pytest.approx(np.array(turned([(0.0, 1.0), (3.0, 1.0)])), abs=EXACT)


def test_a_bent_face_has_a_joint_for_each_straight_piece():
    low = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.3), (0.0, 1.0))
    high = ((0.0, 1.0), (1.0, 1.3), (2.0, 1.0), (2.0, 2.0), (0.0, 2.0))
    found = assembled(
        [af.Block(low, af.STONE, "a", fixed=True), af.Block(high, af.STONE, "b")],
        af.masonry.STONE_TO_STONE,
    )
    assert [joint.name for joint in found.joints] == ["a to b, 1", "a to b, 2"]
    assert found.joints[0].middle[0] < found.joints[1].middle[0]


def test_blocks_that_share_a_corner_do_not_touch():
    blocks = [box(0.0, 0.0, 1.0, 1.0, "a"), box(1.0, 1.0, 2.0, 2.0, "b")]
    assert touching(blocks) == []
    with pytest.raises(af.errors.InvalidStructure, match=r"'b' rest on nothing"):
        assembled([replace(blocks[0], fixed=True), blocks[1]], af.masonry.STONE_TO_STONE)
    with pytest.raises(af.errors.InvalidStructure, match="no blocks to assemble"):
        assembled([], af.masonry.STONE_TO_STONE)


@pytest.mark.parametrize(
    ("level", "says"),
    [
        (1.0001, r"'b' rest on nothing.* 0\.1 mm from 'a', which a larger"),
        (0.9999, "overlap by 1 cm²"),
    ],
)
def test_faces_that_nearly_meet_are_refused_by_their_distance(level, says):
    blocks = [box(0.0, 0.0, 1.0, 1.0, "a"), box(0.0, level, 1.0, 2.0, "b")]
    with pytest.raises(af.errors.InvalidStructure, match=says):
        assembled([replace(blocks[0], fixed=True), blocks[1]], af.masonry.STONE_TO_STONE)


def test_joints_given_are_left_alone(stack):
    given = replace(stack.joints[0], name="mine")
    found = assembled(stack.blocks, af.masonry.STONE_TO_STONE, joints=[given])
    assert [joint.name for joint in found.joints] == ["mine", "block 1 to block 2"]


def test_soil_on_a_ring_is_no_part_of_it():
    ring = af.bridge(
        arches=[
            af.shapes.Arch(measured="centre line", span=4.0, rise=1.6, thickness=0.4, voussoirs=9)
        ]
    )
    top = [point for block in ring.blocks for point in block.outline if point[1] > 0.5]
    crown = max(y for _, y in top)
    key = next(block for block in ring.blocks if block.name == "arch, voussoir 5")
    face = sorted(point for point in key.outline if point[1] > crown - 1e-6)
    soil = ((face[0]), (face[1]), (face[1][0], crown + 1.0), (face[0][0], crown + 1.0))
    found = assembled(
        [*ring.blocks, af.Block(soil, af.masonry.BACKFILL, "soil", part="soil")],
        af.masonry.STONE_TO_STONE,
    )
    assert [joint.part for joint in found.joints] == ["arch"] * 10 + ["soil"]


def test_a_pier_of_several_stones_a_course():
    ground = box(0.0, -1.0, 4.0, 0.0, "ground", fixed=True)
    stones = [
        box(1.0, 0.0, 1.8, 1.0, "a", part="pier"),
        box(1.8, 0.0, 3.0, 1.0, "b", part="pier"),
        box(1.0, 1.0, 3.0, 2.0, "c", part="pier"),
    ]
    found = assembled([ground, *stones], af.masonry.STONE_TO_STONE)
    names = ["ground to a", "ground to b", "a to c", "b to c", "a to b"]
    assert [joint.name for joint in found.joints] == names


def test_a_pier_on_a_loose_footing_has_its_base():
    ground = box(0.0, -1.0, 4.0, 0.0, "ground", fixed=True)
    footing = box(0.5, 0.0, 3.5, 0.4, "footing", part="footing")
    stones = [box(1.0, y, 3.0, y + 1.0, f"stone at {y}", part="pier") for y in (0.4, 1.4)]
    found = assembled([ground, footing, *stones], af.masonry.STONE_TO_STONE)
    assert [joint.name for joint in found.joints] == [
        "pier, base",
        "pier, joint 1",
        "ground to footing",
    ]
    assert [joint.part for joint in found.joints] == ["pier", "pier", "footing"]


def test_contacts_by_materials():
    of = by_materials(af.masonry.STONE_TO_STONE, {"backfill / stone": af.masonry.SOIL_TO_STONE})
    stone, other = box(0.0, 0.0, 1.0, 1.0, "a"), box(0.0, 1.0, 1.0, 2.0, "b")
    soil = replace(other, material=af.masonry.BACKFILL)
    assert of(stone, other) == af.masonry.STONE_TO_STONE
    assert of(stone, soil) == of(soil, stone) == af.masonry.SOIL_TO_STONE
    brick = replace(other, material=replace(af.STONE, name="brick"))
    with pytest.raises(af.errors.InvalidInput, match='give one for "brick/stone"'):
        of(stone, brick)
    with pytest.raises(af.errors.InvalidInput, match="'stone' is no pair"):
        by_materials(af.masonry.STONE_TO_STONE, {"stone": af.masonry.STONE_TO_STONE})


@pytest.mark.parametrize(
    ("step", "first"),
    [((0.09, -1.0), 1), ((0.11, -1.0), 0), ((-0.09, 1.0), 0), ((-0.11, 1.0), 1), ((1.0, 0.0), 0)],
)
def test_a_line_begins_on_the_left_or_where_it_stands_at_its_foot(step, first):
    """It stands up to a tenth off the vertical."""
    line = np.array([[2.0, 3.0], [2.0 + step[0], 3.0 + step[1]]])
    assert _orient_line(line)[0].tolist() == line[first].tolist()
    assert _orient_line(line[::-1])[0].tolist() == line[first].tolist()


@pytest.mark.parametrize(("share", "touch"), [(0.98, True), (1.02, False)])
@pytest.mark.parametrize("upright", [False, True])
def test_blocks_touch_within_a_millionth_of_all_blocks(share, touch, upright):
    """The length is the diagonal of the corners, which span two metres by one at any place."""
    gap = share * 1e-6 * np.hypot(2.0, 1.0)
    if upright:
        blocks = [box(50, 70, 51, 71, "a"), box(50, 71 + gap, 51, 72, "b")]
    else:
        blocks = [box(50, 70, 51, 71, "a"), box(51 + gap, 70, 52, 71, "b")]
    assert len(touching(blocks)) == touch


def stones(upper, *, lower=None):
    """A slab below a line from left to right, 1 m above its foot, and a stone above that line."""
    low = ((0.0, 0.0), (12.0, 0.0), *reversed(lower or upper))
    return [
        af.Block(low, af.STONE, "a", fixed=True),
        af.Block((*upper, (12.0, 5.0), (0.0, 5.0)), af.STONE, "b"),
    ]


NEAR = 13e-6
"""Within which blocks of 12 m by 5 m touch: a millionth of their diagonal [m]."""


@pytest.mark.parametrize(("share", "pieces"), [(1.9, 1), (2.1, 2)])
def test_a_face_is_straight_where_it_bends_by_twice_the_distance_of_touching(share, pieces):
    """A short piece, which ends so far off the line of the long one beside it."""
    face = ((0.0, 1.0 + share * NEAR), (1.0, 1.0), (12.0, 1.0))
    assert len(touching(stones(face))) == pieces


@pytest.mark.parametrize(("share", "pieces"), [(1.9, 1), (2.1, 2)])
def test_a_line_continues_over_a_notch_up_to_twice_the_distance_of_touching(share, pieces):
    notch = share * NEAR
    face = ((0.0, 1.0), (5.0, 1.0), (5.0, 0.9), (5.0 + notch, 0.9), (5.0 + notch, 1.0), (12.0, 1.0))
    touch = touching(stones(((0.0, 1.0), (12.0, 1.0)), lower=face))
    assert len(touch) == pieces


@pytest.mark.parametrize(("share", "touch"), [(3.9, 0), (4.1, 1)])
def test_a_line_is_longer_than_four_times_the_distance_of_touching(share, touch):
    """The stone begins so far from the end of the slab, and stands out beyond it."""
    begin = 11.0 - share * NEAR
    blocks = [box(0.0, 0.0, 11.0, 1.0, "a"), box(begin, 1.0, 12.0, 5.0, "b")]
    assert len(touching(blocks)) == touch


def test_joints_along_a_toothed_face_are_counted_from_the_left():
    face = ((0.0, 1.0), (4.0, 1.0), (4.4, 4.5), (4.8, 1.2), (12.0, 1.0))
    joints = assembled(stones(face), af.masonry.STONE_TO_STONE).joints
    assert [joint.name for joint in joints] == [f"a to b, {k}" for k in range(1, 5)]
    assert np.all(np.diff([joint.middle[0] for joint in joints]) > 0.0)


@pytest.mark.parametrize("step", [(0.05, 0.0), (0.0, 0.05)])
def test_the_ends_of_a_short_joint_have_the_order_of_a_long_one(step):
    line = np.array([[2.0, 3.0], [2.0 + step[0], 3.0 + step[1]]])
    assert _orient_line(line).tolist() == _orient_line(line[::-1]).tolist() == line.tolist()


@pytest.mark.parametrize(
    ("one", "other", "owner"),
    [("ring", "other", "other"), ("ring", "pier", "ring"), ("other", "pier", "other")],
)
def test_a_joint_along_two_parts_belongs_to_fill_or_else_to_a_ring(one, other, owner):
    """Two upright stacks beside one another on a rock, whichever comes first."""
    for roles in ((one, other), (other, one)):
        blocks = [box(0.0, -1.0, 2.0, 0.0, "rock", fixed=True, part="rock", role="other")]
        blocks += [
            box(x, y, x + 1.0, y + 1.0, f"{part} {y}", part=part, role=role)
            for x, part, role in zip((0.0, 1.0), ("left", "right"), roles, strict=True)
            for y in (0.0, 1.0)
        ]
        joints = assembled(blocks, af.masonry.STONE_TO_STONE).joints
        between = [each.role for each in joints if abs(each.middle[0] - 1.0) < 0.1]
        assert between == [owner, owner]
