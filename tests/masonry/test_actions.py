"""Actions: places of loads, supports that settle, and refused actions."""

import numpy as np
import pytest

import archfem as af
from archfem.masonry.loads import list_loads


@pytest.mark.parametrize("x", [-2.9, -1.4, 0.0, 0.4, 2.2])
def test_a_point_load_stands_on_the_arc_of_the_extrados(ring, x):
    number, point = af.PointLoad(x, (0.0, -1.0)).place(ring)
    outer = 2.95 + 0.55 / 2.0
    assert point == pytest.approx([x, np.sqrt(outer**2 - x**2)], abs=1e-12)
    toward = np.arctan2(*(ring.blocks[number].centroid[::-1]))
    assert abs(np.arctan2(point[1], point[0]) - toward) <= np.radians(159.0 / 17.0) / 2.0 + 1e-9


def test_a_point_load_on_a_corner_stands_there(ring):
    for joint in ring.joints:
        assert af.PointLoad(joint.extrados[0], (0.0, -1.0)).place(ring)[1] == pytest.approx(
            joint.extrados, abs=1e-9
        )


def test_an_arc_below_is_met_too():
    """A sector that hangs: its third side is the lower face of what a vertical passes."""
    across = np.radians([250.0, 290.0])
    inner, outer = (r * np.column_stack([np.cos(across), np.sin(across)]) for r in (2.0, 3.0))
    hung = af.Block((*map(tuple, outer), *map(tuple, inner[::-1])), af.STONE, "hung", centre=(0, 0))
    assert hung.top(0.1) == pytest.approx(-np.sqrt(4.0 - 0.01), abs=1e-12)
    assert hung.top(1.5) is None
    beside = 0.95  # passes the straight side, and the outer arc below
    assert hung.top(beside) == pytest.approx(-beside / np.tan(np.radians(20.0)), abs=1e-12)


def test_arcs_are_met_where_they_are_upright():
    """Quarters of a ring about (3, 1): one that is upright at its end, and one within."""
    for begin, height in ((0.0, 1.0), (-45.0, 1.0)):
        angles = np.radians([begin, begin + 90.0])
        outer, inner = (r * np.column_stack([np.cos(angles), np.sin(angles)]) for r in (2.0, 1.0))
        corners = np.vstack([outer, inner[::-1]]) + np.array([3.0, 1.0])
        quarter = af.Block(tuple(map(tuple, corners.tolist())), af.STONE, "quarter", centre=(3, 1))
        assert quarter.top(5.0) == pytest.approx(height, abs=1e-6)
        x = 3.0 + 2.0 * np.cos(np.radians(40.0))
        assert quarter.top(x) == pytest.approx(1.0 + 2.0 * np.sin(np.radians(40.0)))


def test_a_point_load_beside_the_structure_is_refused(stack):
    with pytest.raises(af.errors.InvalidInput, match=r"x = 0.6 m misses .* from -0.5 to 0.5 m"):
        af.PointLoad(0.6, (0.0, -1.0)).place(stack)


def test_a_point_load_at_a_height_acts_on_the_block_there(stack):
    """Two square blocks: at the joint between them the upper one carries the load."""
    places = [af.PointLoad(0.5, (-1.0, 0.0), y=y).place(stack) for y in (0.4, 1.0, 1.7)]
    assert [number for number, _ in places] == [1, 2, 2]
    assert [point.tolist() for _, point in places] == [[0.5, 0.4], [0.5, 1.0], [0.5, 1.7]]
    with pytest.raises(af.InvalidInput, match=r"\(0.6, 0.4\) m is 0.1 m away .* 'block 1'"):
        af.PointLoad(0.6, (-1.0, 0.0), y=0.4).place(stack)


@pytest.mark.parametrize("fidelity", ["rigid", pytest.param("full", marks=pytest.mark.slow)])
def test_a_push_below_mid_height_tips_a_stack_by_half_its_breadth_over_its_lever_arm(
    stack, fidelity
):
    """W b/2 = λ W y: limit analysis exactly, the pushover within its uncertainty."""
    push, tips = af.PointLoad(-0.5, (stack.weight, 0.0), y=0.9), 0.5 / 0.9
    assert af.collapse_factor(stack, live=push).factor == pytest.approx(tips, rel=1e-9)
    model = af.build(stack, fidelity=fidelity, cells=(2, 2))
    found = af.pushover(model, push)
    assert abs(found.limit - tips) <= found.uncertainty
    assert found.limit == pytest.approx(tips, rel=0.01)


def test_settlements_add_up_on_their_support(stack):
    sunk = af.Settlement("base", (0.0, -0.01, 0.0))
    at_rest = np.zeros((3, 3))
    once = sunk.added(stack, at_rest)
    assert sunk.added(stack, once).tolist() == [[0.0, -0.02, 0.0], [0.0] * 3, [0.0] * 3]
    assert not at_rest.any()
    assert af.Settlement(0, (0.0, 0.0, 0.1)).place(stack) == 0


@pytest.mark.parametrize("block", ["block 1", 1, "abutment", 7])
def test_only_supports_settle(stack, block):
    with pytest.raises(
        af.errors.InvalidInput, match=r"cannot settle: the supports are {'base': 0}"
    ):
        af.Settlement(block, (0.0, 0.0, 0.0)).place(stack)


def test_an_attached_load_stays_with_any_block_and_weighs_nothing_or_more():
    assert af.masonry.AttachedLoad(0, (0.0, 1.0), weight=0.0).block == 0
    for given, says in (
        ({"block": -1}, "block = -1 is not a whole"),
        ({"weight": -0.1}, "below 0"),
        ({"free_length": 0.0, "passive": True}, "free_length .* is not above 0"),
        ({"free_length": np.inf, "passive": True}, "free_length .* is not a finite number"),
        ({"free_length": 2.0}, "free_length of 0 is of a tie: give passive = true"),
    ):
        with pytest.raises(af.errors.InvalidInput, match=says):
            af.masonry.AttachedLoad(**{"block": 0, "point": (0.0, 1.0)} | given)


def test_one_load_or_several():
    push, weight = af.BodyForce(0.1), af.PointLoad(0.0, (0.0, -1.0))
    assert list_loads(push) == [push]
    assert list_loads((push, weight)) == [push, weight]
    with pytest.raises(af.errors.InvalidInput, match="a Settlement comes alone"):
        list_loads([push, af.Settlement(0, (0.0, 0.0, 0.0))])


@pytest.mark.parametrize("chords", [None, 1])
def test_loads_at_joints_stand_as_in_a_mirror(chords):
    """On the higher stone of two: rounding of coordinates decided where 1e-6 m changed a factor.

    Two loads at the edges of the keystone of seven stones have 152 or 396 times 1 kN.
    """
    given = {"chords": chords} if chords else {}
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7, **given)
    edges = [joint.extrados[0] for joint in ring.joints]
    carrying = [af.PointLoad(x, (0.0, -1e3)).place(ring)[0] for x in edges[1:-1]]
    assert carrying == [2, 3, 4, 4, 5, 6]
    exact, inside = (
        af.collapse_factor(
            ring,
            live=[
                af.PointLoad(edges[3] + by, (0.0, -1e3)),
                af.PointLoad(edges[4] - by, (0.0, -1e3)),
            ],
            friction=None,
        ).factor
        for by in (0.0, 1e-6)
    )
    assert exact == pytest.approx(inside, rel=1e-5)


def test_of_two_stones_at_one_height_the_first_carries():
    stones = [
        af.Block(((x, 0.0), (x + 0.3, 0.0), (x + 0.3, 0.7), (x, 0.7)), af.STONE, f"stone {x}")
        for x in (0.1, 0.4, 0.7)
    ]
    ground = af.Block(((0, -1), (2, -1), (2, 0), (0, 0)), af.STONE, "ground", fixed=True)
    row = af.masonry.assembled([ground, *stones], af.Contact(1e9, 4e8))
    for y in (None, 0.7):
        assert af.PointLoad(0.4, (0.0, -1.0), y=y).place(row)[0] == 1
        assert af.PointLoad(0.7, (0.0, -1.0), y=y).place(row)[0] == 2


def test_a_load_beside_a_joint_acts_on_the_stone_that_has_it(stack):
    """Half a millimetre below a joint it acts on the block below, not on that above."""
    joint = stack.joints[1]
    below, above = (
        af.PointLoad(0.5, (-1.0, 0.0), y=joint.middle[1] + by).place(stack)[0]
        for by in (-5e-4, 5e-4)
    )
    assert (below, above) == (joint.lower, joint.higher)
