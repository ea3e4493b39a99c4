"""The quick look at failed joints against the programme that decides."""

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import WEIGHT, beside, filled, piers

import archfem as af
from archfem.limit.blocks import RigidBlocks
from archfem.limit.screen import Screen


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
    return af.joints.joint_dataset(structure, resultants)


@pytest.mark.parametrize("structure", [piers(chords=1), filled(), beside("side wall")], ids="abc")
def test_loops_rule_out_only_what_the_programme_rules_out(structure):
    """Two formulations: the cone of gaps that close every loop, and the programme in motions."""
    verifier, rng = af.limit.Verifier(structure), np.random.default_rng(1)
    agreed = {True: 0, False: 0}
    for _ in range(60):
        joints = random_state(structure, rng)
        moves = verifier.verified(joints).kind != "none"
        permitted = verifier.screen.permit(verifier.freedoms(joints))
        assert permitted or not moves
        agreed[moves] += permitted == moves
    assert agreed[True] > 10
    assert agreed[False] > 10
    assert sum(agreed.values()) >= 59  # hinges almost in a line are left to the programme


def test_self_stresses_do_no_work_and_joints_in_no_loop_have_none():
    """A column beside a ring, on the same ground: Gᵀ R = 0, three to the ring's one loop."""
    ring = af.circular_arch(radius=2.0, thickness=0.5, embrace=120.0, voussoirs=3, chords=1)
    column = af.column(breadth=1.0, heights=[1.0, 1.0])
    first = len(ring.blocks)
    away = np.array([10.0, 0.0])
    blocks = tuple(
        replace(block, outline=tuple(map(tuple, block.points + away)), name=f"far {block.name}")
        for block in column.blocks
    )
    joints = tuple(
        replace(
            joint,
            blocks=(joint.lower + first, joint.higher + first),
            intrados=tuple(joint.intrados + away),
            extrados=tuple(joint.extrados + away),
            name=f"far {joint.name}",
        )
        for joint in column.joints
    )
    both = replace(ring, blocks=ring.blocks + blocks, joints=ring.joints + joints)
    rigid = RigidBlocks(both)
    stresses = Screen(rigid, ("arch",)).stresses
    assert stresses.shape == (3 * len(both.joints), 3)
    assert rigid.kinematics.T @ stresses == pytest.approx(0.0, abs=1e-12)
    in_column = np.tile(np.arange(len(both.joints)) >= len(ring.joints), 3)
    assert not stresses[in_column].any()


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("wall", "moves"), [((1.0, 1.0), True), ((0.0, 0.0), False)])
def test_a_block_on_ice_slides_away_from_a_wall(side, wall, moves):
    """Its bed lets it slide either way, and a wall beside it open: it goes away from the wall."""

    def box(x, y, name, fixed=False):
        corners = ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))
        return af.Block(corners, af.STONE, name, fixed, part="pier", role="pier")

    beside = (1.0, 1.5) if side > 0.0 else (-1.5, -1.0)
    blocks = (
        box((-1.5, 1.5), (-0.5, 0.0), "ground", True),
        box((-1.0, 1.0), (0.0, 1.0), "block"),
        box(beside, (0.0, 1.0), "wall", True),
    )
    contact, x = af.masonry.STONE_TO_STONE, side * 1.0
    joints = (
        af.Joint((0, 1), (-1.0, 0.0), (1.0, 0.0), contact, "bed", "pier", "pier"),
        af.Joint((1, 2), (x, 0.0), (x, 1.0), contact, "side", "pier", "pier"),
    )
    screen = Screen(RigidBlocks(af.Structure(blocks, joints)), ("pier",))
    freedoms = np.array([0.0, wall[0], 0.0, wall[1], 2.0, 0.0])  # openings at both ends, slips
    assert screen.permit(freedoms) is moves
