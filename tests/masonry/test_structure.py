"""Structures: orientation of joints, arrays of them, names, and refused structures."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.masonry.structure import describe_spans, find_clear_spans

SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))


def test_normals_point_from_lower_to_higher_block(ring):
    ahead = [ring.blocks[j.higher].centroid - ring.blocks[j.lower].centroid for j in ring.joints]
    assert np.all(np.sum(ring.normals * ahead, axis=1) > 0.0)
    assert np.sum(ring.normals * [j.tangent for j in ring.joints], axis=1) == pytest.approx(0.0)


def test_joints_must_lie_between_their_blocks(stack):
    moved = replace(stack.joints[0], intrados=(-0.5, 0.1), extrados=(0.5, 0.1))
    with pytest.raises(af.errors.InvalidStructure, match="share no face"):
        replace(stack, joints=(moved, stack.joints[1]))
    wrong = replace(stack.joints[1], blocks=(0, 2))
    with pytest.raises(af.errors.InvalidStructure, match="share no face"):
        replace(stack, joints=(stack.joints[0], wrong))
    with pytest.raises(af.errors.InvalidStructure, match="two different numbers"):
        replace(stack, joints=(stack.joints[0], replace(stack.joints[1], blocks=(1, 7))))


@pytest.mark.parametrize(("share", "found"), [(0.98, True), (1.02, False)])
def test_joints_lie_on_faces_to_a_millionth_of_the_size(share, found):
    tower = af.column(breadth=2.0, heights=[4.0, 4.0])
    (x, y), (end, _) = tower.joints[1].intrados, tower.joints[1].extrados
    y += share * 1e-6 * tower.size
    raised = replace(tower.joints[1], intrados=(x, y), extrados=(end, y))
    if found:
        assert replace(tower, joints=(tower.joints[0], raised)).normals[1] @ [0.0, 1.0] == 1.0
    else:
        with pytest.raises(af.errors.InvalidStructure, match="share no face"):
            replace(tower, joints=(tower.joints[0], raised))


def test_a_loose_block_is_named(stack):
    with pytest.raises(af.errors.InvalidStructure, match=r"'block 2' rest on nothing"):
        replace(stack, joints=stack.joints[:1])


@pytest.mark.parametrize("fixed", [True, False])
def test_where_nothing_is_fixed_the_ground_must_be_drawn(stack, fixed):
    """As of a drawing whose ground is a line, which has been ignored."""
    blocks = [replace(block, fixed=block.fixed and fixed) for block in stack.blocks]
    with pytest.raises(af.errors.InvalidStructure) as refused:
        replace(stack, blocks=tuple(blocks), joints=stack.joints[:1])
    drawn = "no block is fixed; add the ground, a closed outline and no line, as a fixed block, "
    assert (f"rest on nothing: {drawn}which has fixed = true" in str(refused.value)) != fixed
    level = "its level, as ground = '0 m' in [structure], or as the argument ground"
    assert (level in str(refused.value)) != fixed


def test_millimetres_are_refused():
    with pytest.raises(af.errors.InvalidStructure, match="smallest stone is 300 m large"):
        af.column(breadth=200.0, heights=[300.0, 400.0])
    assert len(af.column(breadth=50.0, heights=[90.0]).joints) == 1


def test_other_refusals(stack):
    with pytest.raises(af.errors.InvalidStructure, match="anticlockwise"):
        af.Block(SQUARE[::-1], af.STONE, "turned")
    with pytest.raises(af.errors.InvalidStructure, match="used twice"):
        replace(stack, blocks=(*stack.blocks[:2], replace(stack.blocks[2], name="block 1")))
    with pytest.raises(af.errors.InvalidStructure, match="no block is free"):
        af.Structure((replace(stack.blocks[0]),), ())
    with pytest.raises(af.errors.InvalidInput, match="no joint 'key'"):
        stack.joint_number("key")
    bad = af.Joint((0, 1), (0.0, 0.0), (0.0, 0.0), af.masonry.STONE_TO_STONE, "point")
    with pytest.raises(af.errors.InvalidStructure, match="one point"):
        replace(stack, joints=(bad, stack.joints[1]))
    with pytest.raises(af.errors.InvalidStructure, match="lengths above 0"):
        af.column(breadth=1.0, heights=[])


def test_arrays_of_joints_are_those_of_each_joint(stack):
    for number, joint in enumerate(stack.joints):
        assert stack.ends[number].tolist() == joint.ends.tolist()
        assert stack.middles[number].tolist() == joint.middle.tolist()
        assert stack.tangents[number].tolist() == joint.tangent.tolist()
        assert stack.depths[number] == joint.depth
        assert stack.friction[number] == joint.contact.friction
        assert tuple(stack.pairs[number]) == (joint.lower, joint.higher)


def test_blocks_and_joints_by_name_or_number(stack):
    assert stack.block_number("block 2") == stack.block_number(2) == 2
    assert stack.joint_number(stack.joints[1].name) == stack.joint_number(1) == 1
    with pytest.raises(af.errors.InvalidInput, match="no block 'blok 2': did you mean 'block 2'"):
        stack.block_number("blok 2")


def test_blocks_that_overlap_or_cross_themselves_are_refused():
    """At any fidelity: rigid blocks have no mesh that would fail."""
    column = af.column(breadth=1.0, heights=[1.0, 1.0])
    reaching = [(-0.5, 2.0), (-0.5, 0.6), (0.0, 0.6), (0.0, 1.0), (0.5, 1.0), (0.5, 2.0)]
    crossing = [(-0.5, 2.0), (-0.5, 1.0), (0.5, 1.0), (0.3, 2.2), (0.9, 2.2), (-0.1, 1.6)]
    for outline, says in (
        (reaching, r"'block 1' and 'block 2' overlap by 2e\+03 cm²"),
        (crossing, "outline of 'block 2' crosses or touches itself"),
    ):
        top = replace(column.blocks[2], outline=tuple(outline), corners=None)
        with pytest.raises(af.errors.InvalidStructure, match=says):
            replace(
                column,
                blocks=(*column.blocks[:2], top),
                joints=(
                    column.joints[0],
                    replace(column.joints[1], intrados=(0.0, 1.0)),
                ),
            )


def test_a_ring_may_be_nearly_closed():
    """Its abutments then have little room, and may overlap: both are fixed."""
    assert af.circular_arch(radius=1.0, thickness=0.4, embrace=350.0, voussoirs=9).blocks[0].fixed


def test_a_material_or_contact_by_name_is_refused():
    with pytest.raises(af.InvalidInput, match="material = 'stone' is a str: give Material"):
        af.column(breadth=1.0, heights=[1.0], material="stone")
    with pytest.raises(af.InvalidInput, match="contact = 'stone to stone' is a str: give Contact"):
        af.column(breadth=1.0, heights=[1.0], contact="stone to stone")


def test_a_structure_in_a_line():
    """Its diagonal is that of 1 m by 3.2 m, its support included; 3 m³ weigh 60 kN."""
    tower = af.column(breadth=1.0, heights=[1.0, 1.0, 1.0])
    assert repr(tower) == (
        "Structure 'column': 3 blocks that move, 1 fixed, 3 joints; "
        f"size {np.hypot(1.0, 3.2):.3g} m, width 1 m, weight 60 kN"
    )


def test_a_fingerprint_resolves_geometry_to_a_billionth_of_its_size():
    """The height of the lower of two blocks changes; loads and names do not matter."""

    def pair(height, zero=0.0, **more):
        boxes = {"base": (zero, 3.0, -1.0, zero), "tall": (0, 1, 0, 3), "low": (2, 3, 0, height)}
        blocks = [
            af.Block(((x, y), (r, y), (r, top), (x, top)), af.STONE, name, name == "base")
            for name, (x, r, y, top) in boxes.items()
        ]
        return af.masonry.assembled(blocks, af.masonry.STONE_TO_STONE, **more)

    fingerprint, size = pair(1.0).fingerprint, 5.0
    assert pair(1.0).size == size
    assert pair(1.0 + 3e-10 * size).fingerprint == fingerprint
    assert pair(1.0 + 1e-9 * size).fingerprint != fingerprint
    assert pair(1.0, name="another", gravity=5.0).fingerprint == fingerprint
    assert pair(1.0, zero=-0.0).fingerprint == fingerprint
    assert pair(1.0, width=1.0 + 2e-9).fingerprint == fingerprint
    assert pair(1.0, width=1.0 + 2e-8).fingerprint != fingerprint
    # files that are written already are still of their structures
    assert af.column(breadth=1.0, heights=[1.0, 1.0]).fingerprint == "f33242d1fb0986b7"


def on_two_bases(*vertices):
    """A stone from 0 to 1 m on bases from -1 to 0.4 and to 3 m, with vertices on its lower face."""
    bases = [
        af.Block(((a, -1.0), (b, -1.0), (b, 0.0), (a, 0.0)), af.STONE, f"base {a}", fixed=True)
        for a, b in ((-1.0, 0.4), (0.4, 3.0))
    ]
    outline = ((0.0, 0.0), *vertices, (1.0, 0.0), (1.0, 0.5), (0.0, 0.5))
    contact = af.Contact(1e9, 1e9, 0.6)
    joints = (
        af.Joint((0, 2), (0.0, 0.0), (0.4, 0.0), contact, "first"),
        af.Joint((1, 2), (1.0, 0.0), (0.4, 0.0), contact, "second"),
    )
    return af.Structure((*bases, af.Block(outline, af.STONE, "stone")), joints)


@pytest.mark.parametrize("vertices", [(), ((0.4, 0.0),), ((0.2, 0.0), (0.4, 0.0), (0.9, 0.0))])
def test_a_face_is_all_of_its_straight_edge(vertices):
    """Whether or not vertices divide it, from the intrados of each joint."""
    structure = on_two_bases(*vertices)
    lower, higher = structure.face_spans
    assert lower == pytest.approx(np.array([[-1.0, 0.4], [-2.0, 0.6]]))
    assert higher == pytest.approx(np.array([[0.0, 1.0], [0.0, 1.0]]))


def test_overlaps_are_the_common_part_of_both_faces():
    """Of the stone from s to 1 + s and bases from -1 to 0.4 and from there to 3 m.

    The second joint has its extrados on the left, so that its slip is -s.
    """
    structure = on_two_bases()
    for s in (-2.1, -1.2, -0.7, 0.0, 0.3, 0.5, 1.9, 2.2, 3.1):
        length, middle = structure.overlaps(np.array([s, -s]))
        for joint, (a, b) in enumerate(((-1.0, 0.4), (0.4, 3.0))):
            low, high = max(a, s), min(b, 1.0 + s)
            assert length[joint] == pytest.approx(max(high - low, 0.0), abs=1e-12)
            if high > low:
                place = structure.middles[joint, 0] + 0.5 * s + (1.0, -1.0)[joint] * middle[joint]
                assert place == pytest.approx(0.5 * (low + high), abs=1e-12)


def test_faces_that_both_extend_beyond_a_joint_end_with_it():
    contact = af.Contact(1e9, 1e9, 0.6)
    blocks = on_two_bases().blocks
    joint = af.Joint((1, 2), (0.5, 0.0), (0.8, 0.0), contact, "short")
    short = af.Structure(blocks[1:], (replace(joint, blocks=(0, 1)),))
    assert short.end_slips.tolist() == [[0.0, 0.0]]
    assert short.overlaps(np.array([0.1]))[0] == pytest.approx([0.2])


@pytest.mark.parametrize(("breadth", "said"), [(0.65, ""), (65.0, ", more than 6.8 m high")])
def test_a_column_broader_than_high_is_said_to_be_so(breadth, said):
    strip = af.column(breadth=breadth, heights=[3.4, 3.4])
    assert describe_spans(strip) == f"no ring; 'column' {breadth:g} m broad{said}"


def test_a_column_that_hangs_from_its_top_is_as_high_as_its_stones():
    outlines = {"low": (0.0, 0.0, 65.0), "high": (0.0, 3.4, 65.0), "rock": (0.0, 6.8, 65.0)}
    blocks = [
        af.Block(
            ((left, low), (right, low), (right, low + 3.4), (left, low + 3.4)),
            af.STONE,
            name,
            fixed=name == "rock",
            part="rock" if name == "rock" else "column",
            role="other" if name == "rock" else "pier",
        )
        for name, (left, low, right) in outlines.items()
    ]
    made = af.masonry.assembled(blocks, af.Contact(1e9, 4e8))
    assert "'column' 65 m broad, more than 6.8 m high" in describe_spans(made)


def test_chords_of_one_face_have_one_name():
    """A stone on a back of two chords, and one beside it on a bed."""
    ring = af.Block(((0, 0), (2, 0), (2, 1), (1, 1.5), (0, 1)), af.STONE, "ring", fixed=True)
    wall = af.Block(((0, 1), (1, 1.5), (2, 1), (2, 2), (0, 2)), af.STONE, "wall")
    top = af.Block(((0, 2), (2, 2), (2, 3), (0, 3)), af.STONE, "top, 1")
    made = af.masonry.assembled([ring, wall, top], af.Contact(1e9, 4e8))
    assert [joint.name for joint in made.joints] != made.face_names
    assert made.face_names == ["ring to wall", "ring to wall", "wall to top, 1"]


def test_a_clear_span_ends_at_the_piers_below_springers():
    """An arch of three stones between springers of its piers, whose faces are 3 m apart."""
    corners = {
        "ground": (((-1, -1), (5, -1), (5, 0), (-1, 0)), "other"),
        "left": (((0, 0), (0.5, 0), (0.5, 2), (0, 2)), "pier"),
        "left springer": (((0, 2), (0.5, 2), (1, 3), (0.5, 3.5), (0, 3.5)), "pier"),
        "crown": (((1, 3), (3, 3), (3.5, 3.5), (0.5, 3.5)), "ring"),
        "right": (((3.5, 0), (4, 0), (4, 2), (3.5, 2)), "pier"),
        "right springer": (((3.5, 2), (4, 2), (4, 3.5), (3.5, 3.5), (3, 3)), "pier"),
    }
    blocks = [
        af.Block(
            outline,
            af.STONE,
            name,
            fixed=name == "ground",
            part="arch" if role == "ring" else name.split()[0],
            role=role,
        )
        for name, (outline, role) in corners.items()
    ]
    arch = af.masonry.assembled(blocks, af.Contact(1e9, 4e8))
    assert find_clear_spans(arch) == {"arch": (0.5, 3.5)}


@pytest.mark.parametrize("flush", [False, True])
@pytest.mark.parametrize("loose", ["pier", "corner"])
def test_loose_stones_beside_a_springing_are_no_part_of_breadth_and_clear_span(loose, flush):
    """Two on each pier, as broad as the ring is deep, below its foot since the top slopes.

    Flush, the lower one lies on the back of the first voussoir, which is as long as deep.
    """
    top = {x: -0.01 * (x - 1.0) for x in (1.0, 1.4, 1.6, 1.8, 2.0)}  # by x from the middle [m]
    outlines = {
        "pier 1": [(1.0, -2.0), (2.0, -2.0), (2.0, -1.0), (1.0, -1.0)],
        "pier 2": [(1.0, -1.0), (2.0, -1.0), (2.0, top[2.0]), (1.0, 0.0)],
        f"{loose} 3": [(1.6, top[1.6]), (2.0, top[2.0]), (2.0, 0.3), (1.6, 0.3)],
        f"{loose} 4": [(1.6, 0.3), (2.0, 0.3), (2.0, 0.6), (1.6, 0.6)],
    }
    inner, outer = (
        [(r * np.cos(a), r * np.sin(a)) for a in np.linspace(np.pi, 0.0, 12)] for r in (1.0, 1.4)
    )
    outer[0], outer[-1] = (-1.4, top[1.4]), (1.4, top[1.4])
    if flush:
        (x, y), level = outer[-2], {1.4: top[1.4], 1.8: top[1.8]}
        outlines[f"{loose} 3"] = [*level.items(), (1.8, y), (x, y)]
        outlines[f"{loose} 4"] = [(x, y), (1.8, y), (1.8, 0.8), (x, 0.8)]
    stones = [[inner[k], inner[k + 1], outer[k + 1], outer[k]] for k in range(11)]
    blocks = [af.Block(tuple(own), af.STONE, f"{k}", part="arch") for k, own in enumerate(stones)]
    for side, sign in (("west", -1), ("east", 1)):
        for name, points in outlines.items():
            corners = tuple((sign * x, y) for x, y in points[::sign])
            part = f"{side} {name[:-2]}"
            blocks.append(af.Block(corners, af.STONE, f"{side} {name}", part=part, role="pier"))
    post = ((3.0, -2.0), (3.5, -2.0), (3.5, 0.0), (3.0, 0.0))
    blocks.append(af.Block(post, af.STONE, "post", part="post"))
    rock = ((-2.0, -3.0), (4.0, -3.0), (4.0, -2.0), (-2.0, -2.0))
    blocks.append(af.Block(rock, af.STONE, "rock", fixed=True, part="rock"))
    made = af.masonry.assembled(blocks, af.masonry.STONE_TO_STONE)
    assert describe_spans(made) == (
        "clear span from -1.00 to 1.00 m; 'west pier' 1 m broad and 2 m high to the ring; "
        "'east pier' 1 m broad and 2 m high to the ring; 'post' 0.5 m broad"
    )
    assert not made.misplaced


@pytest.mark.parametrize(("gable", "joints"), [("pier", 6), ("ring", 8)])
def test_the_clear_span_below_a_gable_is_that_of_the_intrados(gable, joints):
    """Two joints of the extrados begin at the springing too, where the gable is a ring."""
    inner, outer = (
        [(r * np.cos(a), r * np.sin(a)) for a in np.linspace(np.pi, 0.0, 6)] for r in (1.0, 1.3)
    )
    stones = [[inner[k], inner[k + 1], outer[k + 1], outer[k]] for k in range(5)]
    blocks = [
        af.Block(tuple(points), af.STONE, f"stone {k}", part="arch", role="ring")
        for k, points in enumerate(stones)
    ]
    for name, sign in (("west", -1.0), ("east", 1.0)):
        x, y = outer[1]
        edges = {
            "pier": [(1.0, -1.0), (1.6, -1.0), (1.6, 0.0), (1.3, 0.0), (1.0, 0.0)],
            "gable": [(1.3, 0.0), (1.6, 0.0), (1.6, y), (-x, y)],
        }
        for part, points in edges.items():
            corners = [(sign * x, y) for x, y in points][:: int(sign)]
            given = {"part": f"{name} {part}", "role": "pier" if part == "pier" else gable}
            blocks.insert(0, af.Block(tuple(corners), af.STONE, f"{name} {part}", **given))
    rock = ((-2.0, -2.0), (2.0, -2.0), (2.0, -1.0), (-2.0, -1.0))
    blocks.append(af.Block(rock, af.STONE, "rock", fixed=True, part="rock"))
    made = af.masonry.assembled(blocks, af.masonry.STONE_TO_STONE)
    assert sum(joint.part == "arch" for joint in made.joints) == joints
    assert find_clear_spans(made)["arch"] == pytest.approx((-1.0, 1.0))
