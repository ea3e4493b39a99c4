"""Names of mechanisms, by motions whose form is known: hinges, sliding, overturning, wedges."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from bonded import bonded_wall

import archfem as af
from archfem.limit.linear_programme import RigidBlocks
from archfem.limit.mechanism_names import NamedMotion, name_mechanism

PUSH = af.BodyForce(1.0)


def semicircle(voussoirs=16, thickness=0.2, **options):
    """Build a semicircular ring of mean radius 1 m, with a joint at the crown."""
    sizes = {"radius": 1.0 - thickness / 2.0, "thickness": thickness, "embrace": 180.0}
    return af.circular_arch(**sizes, voussoirs=voussoirs, **options)


def test_a_pushed_ring_has_four_hinges():
    for embrace, voussoirs, thickness in ((159.0, 17, 0.55), (120.0, 11, 0.4), (180.0, 24, 0.7)):
        sizes = {"radius": 2.95, "thickness": thickness, "embrace": embrace}
        ring = af.circular_arch(**sizes, voussoirs=voussoirs)
        found = af.collapse_factor(ring, live=PUSH, friction=None)
        assert len(found.hinges) == 4  # Heyman: one degree of freedom
        assert found.mechanism_name == "four-hinge mechanism"
        assert found.sentence.startswith("four-hinge mechanism, at ")
        assert str(found).startswith("four-hinge mechanism: factor ")


def test_a_mechanism_and_its_mirror_image_have_five_hinges():
    ring = semicircle()
    found = af.collapse_factor(ring, live=af.PointLoad(0.0, (0.0, -1e3)), friction=None)
    assert {joint for joint, _ in found.hinges} in ({4, 8, 12, 16}, {0, 4, 8, 12})
    assert found.mechanism_name == "four-hinge mechanism"
    # the load is symmetric: the mirror image of the motion is one too, and so is their sum
    stones, image = list(ring.free), np.zeros_like(found.motion)
    image[stones] = found.motion[stones[::-1]] * [-1.0, 1.0, -1.0]
    assert name_mechanism(ring, image) == "four-hinge mechanism"
    assert name_mechanism(ring, found.motion + image) == "five-hinge symmetric mechanism"


def test_a_thin_semicircle_falls_by_a_symmetric_mechanism():
    found = af.collapse_factor(semicircle(thickness=0.1), live=PUSH, friction=None)
    assert found.outcome is af.limit.Outcome.INFEASIBLE
    start = "it does not stand under its own weight: "
    assert found.sentence.startswith(start)
    assert found.sentence.endswith("-hinge symmetric mechanism")


@pytest.mark.parametrize("friction", ["coulomb", "nonassociated"])
def test_blocks_slide_where_friction_is_least(friction):
    stack = af.column(breadth=1.0, heights=[0.3, 0.3, 0.3])
    joints = list(stack.joints)
    weak = replace(joints[1], contact=replace(joints[1].contact, friction=0.3))
    stack = replace(stack, joints=(joints[0], weak, joints[2]))
    found = af.collapse_factor(stack, live=PUSH, friction=friction)
    assert found.factor == pytest.approx(0.3)  # μ
    assert found.mechanism_name == "sliding of all above block 1"


def test_blocks_of_equal_friction_slide_at_one_joint_of_many():
    stack = af.column(breadth=1.0, heights=[0.3, 0.3, 0.3])
    found = af.collapse_factor(stack, live=PUSH, friction="nonassociated")
    assert found.factor == pytest.approx(0.6)  # μ
    assert found.mechanism_name.startswith("sliding of all ")
    assert found.mechanism_name.endswith(" (one of many: all bed joints reach μ)")


def test_a_stack_and_a_wall_overturn_about_the_toe():
    stack = af.column(breadth=1.0, heights=[1.0, 1.0, 1.0, 1.0])
    found = af.collapse_factor(stack, live=PUSH)
    assert found.factor == pytest.approx(0.25)  # B / H
    assert found.mechanism_name == "overturning about the toe of block 1"
    wall = bonded_wall(courses=12)
    found = af.collapse_factor(wall, live=PUSH, friction=None)
    assert found.factor == pytest.approx(4.0 / 3.0)  # B / H
    assert found.mechanism_name == "overturning about the toe of course 1"


def test_the_upper_part_of_a_stack_rocks_where_it_is_slender():
    base = af.Block([(-2.0, -0.5), (2.0, -0.5), (2.0, 0.0), (-2.0, 0.0)], af.STONE, "base", True)
    plinth = af.Block([(-1.0, 0.0), (1.0, 0.0), (1.0, 0.5), (-1.0, 0.5)], af.STONE, "plinth")
    shaft = af.Block([(-0.1, 0.5), (0.1, 0.5), (0.1, 1.5), (-0.1, 1.5)], af.STONE, "shaft")
    stack = af.masonry.assembled([base, plinth, shaft], af.Contact(1e9, 1e9, friction=0.6))
    found = af.collapse_factor(stack, live=PUSH)
    assert found.factor == pytest.approx(0.2)  # B / H of the shaft
    assert found.mechanism_name == "rocking of all above plinth about the toe of shaft"


@pytest.mark.parametrize(
    "friction", ["coulomb", pytest.param("nonassociated", marks=pytest.mark.slow)]
)
def test_a_wall_in_bond_loses_a_wedge_at_its_toe(friction):
    found = af.collapse_factor(bonded_wall(courses=12), live=PUSH, friction=friction)
    assert found.factor == pytest.approx(0.5, rel=0.06)  # length / (4 course) of a high wall
    # its stones turn about the toe, and slide on each other
    assert len(found.sliding) > 30
    assert re.fullmatch(r"toe wedge of 4\d stones, turning and sliding", found.mechanism_name)


def test_a_wedge_that_turns_as_one_body_does_not_slide():
    """All right of a line from the toe up to the left, turning clockwise about the toe."""
    wall = bonded_wall(courses=12)
    x, y = (wall.centroids - [2.0, 0.0]).T
    moves = (x > -1.2 * y - 0.3) & np.isin(np.arange(len(x)), wall.free)
    motion = np.where(moves[:, None], np.column_stack([y, -x, -np.ones(len(x))]), 0.0)
    assert name_mechanism(wall, motion) == "toe wedge overturning about the toe of course 1"


def test_one_motion_may_slide_and_turn():
    block = af.column(breadth=1.0, heights=[1.0])
    motion = np.zeros((2, 3))
    motion[1] = 1.0, 0.5, -1.0  # about the toe, and the same again of sliding
    assert name_mechanism(block, motion) == "combined overturning and sliding of all on base"
    motion[1] = 0.0, 0.0, 0.0
    assert name_mechanism(block, motion) == ""


def test_piers_that_rock_together_sway_and_do_not_slide():
    def box(name, left, right, low, high, fixed=False):
        corners = [(left, low), (right, low), (right, high), (left, high)]
        return af.Block(corners, af.STONE, name, fixed, part="wall", role="pier")

    stones = {
        "one": (0.0, 0.5, 0.0, 2.0),
        "two": (1.5, 2.0, 0.0, 2.0),
        "slab": (0.0, 2.0, 2.0, 2.2),
    }
    blocks = [box("ground", -1.0, 3.0, -0.5, 0.0, fixed=True)]
    blocks += [box(name, *sizes) for name, sizes in stones.items()]
    frame = af.masonry.assembled(blocks, af.Contact(1e9, 1e9, friction=0.6))
    motion = np.zeros((4, 3))
    turn = -1.0  # both piers turn about their right toes, and the slab moves with their left tops
    for k, toe in ((1, 0.5), (2, 2.0)):
        x, y = frame.centroids[k] - [toe, 0.0]
        motion[k] = -turn * y, turn * x, turn
    motion[3] = 2.0, 0.5, 0.0
    assert name_mechanism(frame, motion) == "four-hinge mechanism"
    # the stones of a course rock under a wall that they carry
    wall = bonded_wall(courses=6, half=1.0)
    motion = np.zeros((len(wall.blocks), 3))
    for k in wall.free:
        points = wall.blocks[k].points
        motion[k] = 0.25, 0.5, 0.0  # as the left top of a stone of course 1
        if points[:, 1].min() == 0.0:
            x, y = wall.centroids[k] - [points[:, 0].max(), 0.0]
            motion[k] = -turn * y, turn * x, turn
    assert name_mechanism(wall, motion) == "sway of all on ground"


@pytest.mark.parametrize("friction", [None, 0.6])
def test_a_joint_that_comes_apart_does_not_slide(friction):
    """The upper of two blocks moves up by 1 and sideways by 0.2, less than μ allows at a touch."""
    contact = af.Contact(1e9, 4e8, friction)
    stack = af.column(breadth=1.0, heights=[1.0, 1.0], contact=contact)
    motion = np.zeros((len(stack.blocks), 3))
    motion[-1] = 0.2, 1.0, 0.0
    found = NamedMotion(RigidBlocks(stack), motion)
    assert not found.touching.any()
    motion[-1] = 0.2, 0.0, 0.0
    assert NamedMotion(RigidBlocks(stack), motion).sliding.sum() == 1


def test_one_stone_has_its_name():
    wall = bonded_wall(courses=3)
    motion = np.zeros((len(wall.blocks), 3))
    motion[-1, 0] = 1.0
    assert name_mechanism(wall, motion) == f"sliding of {wall.blocks[-1].name} above course 2"


def test_hinges_and_sliding_joints_of_a_ring_are_combined():
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    found = af.collapse_factor(ring, live=af.PointLoad(0.0, (0.0, -1e4)))
    counts = len(found.hinges), len(found.sliding)
    assert counts == (3, 1)
    said = "combined hinge-slide mechanism, three hinges and one sliding joint"
    assert found.mechanism_name == said


def test_a_mechanism_of_some_parts_names_them():
    sizes = {"radius": 1.5, "thickness": 0.35, "voussoirs": 9, "pier_breadth": 0.7}
    portal = af.arch_on_piers(**sizes, courses=[0.5, 0.5, 0.5])
    found = af.collapse_factor(portal, live=PUSH)
    assert {portal.blocks[k].part for k in np.flatnonzero(found.motion.any(axis=1))} == {
        "arch",
        "right pier",
    }
    assert found.mechanism_name == "four-hinge mechanism of arch and right pier"


def test_an_arch_in_a_wall_is_named_by_its_hinges_and_no_toe_wedge():
    """A semicircle on two piers in bond, with wall stones beside it, pushed to the right.

    The factor is that of a linear programme of forces at both ends of each facet, written apart.
    """
    count, inner, outer, spring, edge = 11, 1.4, 1.8, 1.6, 2.3
    angles = np.pi * np.arange(count + 1) / count

    def at(radius, k):
        return radius * np.cos(angles[k]), spring + radius * np.sin(angles[k])

    blocks = [af.Block(((-3, -1), (3, -1), (3, 0), (-3, 0)), af.STONE, "ground", fixed=True)]
    for k in range(count):
        outline = (at(inner, k), at(outer, k), at(outer, k + 1), at(inner, k + 1))
        blocks.append(af.Block(outline, af.STONE, f"v{k}", part="arch", role="ring"))
    for sign in (1, -1):
        stones = []
        for k in range(4):
            cuts = (inner, (inner + edge) / 2, edge) if k % 2 else (inner, edge)
            for a, b in pairwise(cuts):
                y, top = 0.4 * k, 0.4 * (k + 1)
                stones.append(("pier", [(a, y), (b, y), (b, top), (a, top)]))
        for k in range(3):
            low, high = at(outer, k), at(outer, k + 1)
            stones.append(("wall", [low, (edge, low[1]), (edge, high[1]), high]))
        for number, (part, points) in enumerate(stones):
            outline = tuple((sign * x, y) for x, y in points)[::sign]
            name = f"{sign} {part} {number}"
            blocks.append(af.Block(outline, af.STONE, name, part=f"{part} {sign}", role="pier"))
    contact = af.Contact(1e9, 4e8, friction=0.6)
    portal = af.masonry.assembled(blocks, contact, width=0.6)
    found = af.collapse_factor(portal, live=af.BodyForce(1.0))
    words = r"mechanism of \d+ stones, turning and sliding, with hinges at arch, joints 2, 5 and 8"
    assert found.factor == pytest.approx(0.25602317, rel=1e-6)
    assert re.fullmatch(f"{words}; pier 1 overturns about its toe", found.mechanism_name)
