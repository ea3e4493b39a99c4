"""The skeleton of stone below a fill: what is left out, and what can move."""

from dataclasses import replace

import numpy as np
import pytest

from archfem.dynamics.probe import peaks
from archfem.dynamics.time_history import time_history
from archfem.errors import InvalidInput
from archfem.joints.resultants import joint_dataset
from archfem.limit.collapse import BodyForce, collapse_factor, stands
from archfem.limit.skeleton import skeleton_of
from archfem.limit.verified import Verifier, first_verified_mechanism, verified_mechanism
from archfem.masonry.assembly import assembled
from archfem.masonry.block import Block
from archfem.masonry.materials import BACKFILL, SOIL_TO_STONE, STONE, STONE_TO_STONE
from archfem.masonry.shapes import arch_on_piers, circular_arch
from archfem.masonry.softness import yielding_blocks
from archfem.models.rigid import rigid
from archfem.motion.motion import Motion

WEIGHT = 1e4
FOUR = {3: -0.5, 8: 0.5, 13: -0.5, 19: 0.5}  # of the ring and the foot of the right pier


def piers():
    return arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=15, pier_breadth=1.2, courses=[0.5] * 2, chords=1
    )


def filled(material=BACKFILL, part="backfill"):
    """The ring on piers with a body on its five upper voussoirs, and two pavers on that."""
    bare = piers()
    stones = [block for block in bare.blocks if block.part == "arch"][5:10]
    back = [stones[0].outline[3], *(stone.outline[2] for stone in stones)]  # from left to right
    (left, _), (right, _), top = back[0], back[-1], 4.0
    contact = replace(SOIL_TO_STONE, name="soil")
    body = Block((*back, (right, top), (left, top)), material, "fill", part=part)
    pavers = [
        Block(((a, top), (b, top), (b, 4.2), (a, 4.2)), STONE, name, part="paving")
        for name, a, b in (("left paver", left, 0.0), ("right paver", 0.0, right))
    ]

    def touch(a, b):
        return contact if "fill" in (a.name, b.name) else STONE_TO_STONE

    return assembled([*bare.blocks, body, *pavers], touch, joints=bare.joints)


def failing(structure, hinges, sliding=()):
    """Joints in compression, some hinging {joint: e} or sliding {joint: V/N}."""
    resultants = np.zeros((len(structure.joints), 3))
    resultants[:, 0] = WEIGHT
    for joint, e in dict(hinges).items():
        resultants[joint, 2] = e * WEIGHT * structure.joints[joint].depth
    for joint, ratio in dict(sliding).items():
        resultants[joint, 1] = ratio * WEIGHT
    return joint_dataset(structure, resultants)


def test_fill_and_what_rests_on_it_are_left_out():
    whole, bare = filled(), piers()
    assert len(whole.joints) == len(bare.joints) + 5 + 2 + 1  # under, on, and between the pavers
    found = skeleton_of(whole)
    assert [whole.blocks[number].name for number in yielding_blocks(whole)] == ["fill"]
    assert found.structure.blocks == bare.blocks
    assert found.structure.joints == bare.joints
    assert found.blocks == tuple(range(len(bare.blocks)))
    assert found.joints == tuple(range(len(bare.joints)))


def test_numbers_are_those_of_the_whole_structure():
    """Blocks and joints in another order: the skeleton keeps count."""
    whole = filled()
    last = len(whole.blocks) - 1
    turned = replace(
        whole,
        blocks=whole.blocks[::-1],
        joints=tuple(
            replace(joint, blocks=(last - joint.blocks[0], last - joint.blocks[1]))
            for joint in whole.joints[::-1]
        ),
    )
    found = skeleton_of(turned)
    assert found.blocks == tuple(range(3, last + 1))
    for inner, outer in zip(found.structure.joints, found.joints, strict=True):
        assert inner.name == turned.joints[outer].name
        names = [found.structure.blocks[block].name for block in inner.blocks]
        assert names == [turned.blocks[block].name for block in turned.joints[outer].blocks]


def test_the_mechanism_is_that_without_the_fill():
    whole, bare = filled(), piers()
    soil = dict.fromkeys(range(len(bare.joints), len(whole.joints)), 0.7)
    found = verified_mechanism(whole, failing(whole, FOUR, soil))
    alone = verified_mechanism(bare, failing(bare, FOUR))
    assert alone.kind == "semi-global"
    assert found.moved == alone.moved
    assert found.counted == alone.counted
    assert found.motion.shape == (len(whole.blocks), 3)
    assert found.motion[: len(bare.blocks)] == pytest.approx(alone.motion, abs=1e-9)
    assert not found.motion[len(bare.blocks) :].any()


def test_a_stiff_body_of_the_same_shape_holds_the_ring():
    whole = filled(STONE, "spandrel")
    assert yielding_blocks(whole) == ()
    assert skeleton_of(whole).structure.blocks == whole.blocks
    assert verified_mechanism(whole, failing(whole, FOUR)).kind == "none"


def test_rings_and_piers_are_never_left_out():
    soft = circular_arch(
        radius=3.0, thickness=0.6, embrace=160.0, voussoirs=7, material=replace(STONE, young=1e6)
    )
    assert yielding_blocks(soft) == ()


def test_a_structure_of_soil_alone_is_its_own_skeleton():
    base = Block(((0.0, -0.5), (1.0, -0.5), (1.0, 0.0), (0.0, 0.0)), STONE, "base", fixed=True)
    body = Block(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), BACKFILL, "fill", part="fill")
    structure = assembled([base, body], SOIL_TO_STONE)
    assert yielding_blocks(structure) == (1,)
    assert skeleton_of(structure).blocks == (0, 1)
    assert verified_mechanism(structure, failing(structure, {0: 0.5})).kind == "local"


def beside(part):
    """The ring on piers and, apart from it, a pile of two stones."""
    bare = piers()
    low = min(point[1] for block in bare.blocks for point in block.outline)

    def stone(level, name, fixed=False):
        outline = ((9.0, level), (9.5, level), (9.5, level + 0.5), (9.0, level + 0.5))
        return Block(outline, STONE, name, fixed, part=part)

    pile = [stone(low, "ground", True), stone(low + 0.5, "first"), stone(low + 1.0, "second")]
    return assembled([*bare.blocks, *pile], STONE_TO_STONE, joints=bare.joints)


def test_a_motion_of_other_parts_alone_is_no_mechanism():
    structure = beside("side wall")
    wall = len(structure.joints) - 1
    joints = failing(structure, {wall: 0.5})
    found = verified_mechanism(structure, joints)
    assert (found.kind, found.moved.part, found.agrees) == ("none", "", True)
    assert found.moved.blocks == (len(structure.blocks) - 1,)
    assert found.moved.joints == (wall,)
    steps = joints.expand_dims(time=[0.0, 1.0])
    assert first_verified_mechanism(structure, steps) is None
    both = verified_mechanism(structure, failing(structure, FOUR | {wall: 0.5}))
    assert (both.kind, both.moved.part) == ("semi-global", "arch + right pier")
    assert both.moved.blocks[-1] == len(structure.blocks) - 1


def test_the_same_pile_is_judged_where_it_is_a_pier():
    structure = beside("pier 2")
    found = verified_mechanism(structure, failing(structure, {len(structure.joints) - 1: 0.5}))
    assert (found.kind, found.moved.part) == ("local", "pier 2")


def random_state(structure, rng):
    """A few joints that hinge, slide or come apart."""
    resultants = np.zeros((len(structure.joints), 3))
    resultants[:, 0] = WEIGHT
    for joint in rng.choice(len(structure.joints), rng.integers(2, 9), replace=False):
        what = rng.choice(5, p=[0.4, 0.4, 0.08, 0.08, 0.04])
        arm = 0.5 * WEIGHT * structure.joints[joint].depth
        resultants[joint] = [
            (WEIGHT, 0.0, arm),
            (WEIGHT, 0.0, -arm),
            (WEIGHT, 0.7 * WEIGHT, 0.0),
            (WEIGHT, -0.7 * WEIGHT, 0.0),
            (0.0, 0.0, 0.0),
        ][what]
    return joint_dataset(structure, resultants)


@pytest.mark.parametrize("structure", [piers(), filled(), beside("side wall")], ids="abc")
def test_loops_rule_out_only_what_the_programme_rules_out(structure):
    """Two formulations: the cone of gaps that close every loop, and the programme in motions."""
    verifier, rng, agreed = Verifier(structure), np.random.default_rng(1), {True: 0, False: 0}
    for _ in range(60):
        joints = random_state(structure, rng)
        moves = verifier.verified(joints).kind != "none"
        permitted = verifier.screen.permit(verifier.freedoms(joints))
        assert permitted or not moves
        agreed[moves] += permitted == moves
    assert agreed[True] > 10
    assert agreed[False] > 10
    assert sum(agreed.values()) >= 59  # hinges almost in a line are left to the programme


def test_limit_analysis_refuses_a_fill():
    whole = filled()
    for analysis in (stands, lambda each: collapse_factor(each, live=BodyForce(1.0))):
        with pytest.raises(InvalidInput, match=r"blocks \['fill'\] are softer than the joints"):
            analysis(whole)
    assert stands(skeleton_of(whole).structure)


def test_the_error_of_a_model_is_measured_on_rings_and_piers():
    model, motion = rigid(filled()), Motion(np.array([0.0, 1.0, 0.0]), dt=0.05)
    run = time_history(model, motion, dt=0.01)
    own = abs(run.joints["eccentricity"]).max("time").values
    found = peaks(model, motion, None, 0.01)
    assert found == pytest.approx(own[: len(piers().joints)])
