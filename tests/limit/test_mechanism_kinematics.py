"""Mechanisms by motion: the programme, and the first one of a history."""

import kinematics
import numpy as np
import pytest
from mechanisms import (
    ALTERNATING,
    FOUR,
    arch,
    beside,
    failing,
    history,
    piers,
    twitching,
)

import archfem as af
from archfem.limit import first_verified_mechanism, verified_mechanism
from archfem.limit.linear_programme import RigidBlocks
from archfem.limit.mechanism_kinematics import Verifier, get_verifier, largest_motion


def test_four_alternating_hinges_are_a_mechanism():
    structure = arch()
    found = verified_mechanism(structure, failing(structure, ALTERNATING))
    assert (found.kind, found.moved.part, found.agrees) == ("local", "arch", True)
    assert found.moved.blocks == tuple(range(1, 18))
    assert found.moved.joints == (0, 6, 12, 17)
    assert "agree" in str(found)


def test_motion_turns_about_the_face_in_contact():
    structure = arch()
    found = verified_mechanism(structure, failing(structure, ALTERNATING))
    jumps = kinematics.jumps(structure, found.motion)
    for number, (joint, jump) in enumerate(zip(structure.joints, jumps, strict=True)):
        opening = jump @ structure.normals[number]
        assert jump @ joint.tangent == pytest.approx([0.0, 0.0], abs=1e-7)
        contact = 0 if ALTERNATING.get(number, -0.5) < 0.0 else 1
        assert opening[contact] == pytest.approx(0.0, abs=1e-7)
        if number in ALTERNATING:
            assert opening[1 - contact] > 1e-3
        else:
            assert opening[1 - contact] == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize(
    "hinges",
    [
        {0: 0.5, 6: 0.5, 12: 0.5, 17: 0.5},
        {0: -0.5, 6: -0.5, 12: 0.5, 17: 0.5},
        {4: 0.5, 5: 0.5, 6: 0.5, 7: 0.5},
    ],
    ids=["one face", "in pairs", "neighbours"],
)
def test_four_hinges_in_the_wrong_places_are_counted_but_do_not_move(hinges):
    structure = arch()
    found = verified_mechanism(structure, failing(structure, hinges))
    assert found.kind == "none"
    assert found.counted.kind == "local"
    assert not found.agrees
    assert "disagree" in str(found)
    assert found.moved.blocks == ()
    assert not found.motion.any()


def test_joints_of_a_motion_are_those_that_work_in_it():
    """A fifth hinge, on the wrong face, fails and stays shut."""
    structure = arch()
    joints = failing(structure, ALTERNATING | {1: -0.5, 2: 0.5})
    found = verified_mechanism(structure, joints)
    assert found.counted.joints == (0, 1, 2, 6, 12, 17)
    gaps = np.abs(kinematics.gaps(structure, found.motion)).max(axis=1)
    assert found.moved.joints == tuple(np.flatnonzero(gaps > 1e-6))
    assert set(found.moved.joints) < set(found.counted.joints)


def test_three_hinges_do_not_move_and_are_not_counted():
    structure = arch()
    found = verified_mechanism(structure, failing(structure, {0: -0.5, 8: 0.5, 17: -0.5}))
    assert (found.kind, found.counted, found.agrees) == ("none", None, True)


def test_a_hinge_short_of_the_edge_counts_from_the_limit_on():
    structure = arch()
    hinges = {joint: 0.93 * e for joint, e in ALTERNATING.items()}  # |e| = 0.465
    joints = failing(structure, hinges)
    assert verified_mechanism(structure, joints).kind == "local"
    assert verified_mechanism(structure, joints, af.Criteria(hinge=0.48)).kind == "none"


def test_a_sliding_block_moves_without_a_counted_mechanism():
    structure = af.column(breadth=0.6, heights=[1.0, 1.0])
    found = verified_mechanism(structure, failing(structure, sliding={1: 0.61}))
    assert (found.kind, found.moved.blocks, found.counted) == ("local", (2,), None)
    slip = found.motion[2] - found.motion[1]
    assert slip[0] == pytest.approx(1.0)  # toward the extrados, as V > 0 says: right
    assert slip[1:] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_block_that_came_apart_may_lift():
    structure = af.column(breadth=0.6, heights=[1.0])
    found = verified_mechanism(structure, failing(structure, apart=[0]))
    assert found.motion[1, 1] > 0.5


@pytest.mark.parametrize(
    ("courses", "kind", "part"),
    [
        (1, "local", "arch"),
        (4, "semi-global", "arch + right pier"),
        (12, "semi-global", "arch + right pier"),
    ],
)
def test_taller_piers_join_the_mechanism(courses, kind, part):
    """The mechanism of limit analysis, read back from its eccentricities alone."""
    structure = piers(courses)
    collapse = af.collapse_factor(structure, live=af.BodyForce(1.0), friction=None)
    found = verified_mechanism(structure, collapse.joints)
    assert (found.kind, found.moved.part) == (kind, part)
    assert found.agrees
    own_hinges_alone = af.Criteria(hinge=0.4999)
    sharp = verified_mechanism(structure, collapse.joints, own_hinges_alone)
    moving = [k for k, own in enumerate(collapse.motion) if np.abs(own).max() > 1e-6]
    assert list(sharp.moved.blocks) == moving


def test_piers_moving_both_are_global():
    structure = piers(2)
    bases = {0: 0.5, 19: 0.5}
    crown = {9: 0.5, 10: 0.5}
    haunches = {5: -0.5, 14: -0.5}
    found = verified_mechanism(structure, failing(structure, bases | crown | haunches))
    assert found.kind == "global"
    assert found.moved.part == "left pier + arch + right pier"
    assert found.counted.kind == "global"


def test_first_motion_and_first_count_in_a_history():
    structure = arch()
    wrong = dict.fromkeys(ALTERNATING, 0.5)
    joints = history(structure, [{}, {0: -0.5}, wrong, wrong, ALTERNATING, {}])
    assert af.limit.counted_mechanism(joints).time == 2.0
    found = first_verified_mechanism(structure, joints)
    assert (found.moved.time, found.kind) == (4.0, "local")
    assert found.counted.time == 4.0
    assert first_verified_mechanism(structure, joints.isel(time=slice(0, 4))) is None


def test_the_first_mechanism_that_moves_farther_is_that_without_the_loose_stones():
    found = {}
    for part in ("pier 2", "side wall"):  # the second counts in no mechanism
        structure, joints = twitching(part)
        found[part] = [
            first_verified_mechanism(structure, joints, beyond=each) for each in (0.0, 2e-3, 4e-3)
        ]
    (first, larger, none), (alone, *_) = found.values()
    assert (first.moved.part, first.moved.time, first.moved.displacement) == ("pier 2", 1.0, 1e-5)
    assert larger.moved == alone.moved
    assert (alone.moved.time, alone.moved.opening, alone.moved.duration) == (3.0, 3e-3, 2.0)
    assert none is None
    with pytest.raises(af.InvalidInput, match=r"beyond = 0\.002 needs opening and slip"):
        first_verified_mechanism(structure, joints.drop_vars("slip"), beyond=2e-3)


def test_patterns_that_one_search_answers_are_known_to_the_next(monkeypatch):
    """Those of a run, of its summary and of its file are the same; another structure has none."""
    get_verifier.cache_clear()
    structure, joints = twitching("pier 2")
    first = first_verified_mechanism(structure, joints, beyond=2e-3)
    monkeypatch.setattr(Verifier, "verify_if_moving", lambda *_: pytest.fail("asked again"))
    assert first_verified_mechanism(structure, joints, beyond=2e-3).moved == first.moved
    with pytest.raises(pytest.fail.Exception, match="asked again"):
        first_verified_mechanism(*twitching("side wall"), beyond=2e-3)


def test_a_stone_that_slides_moves_by_its_slip():
    structure = beside("pier 2")
    pile = len(structure.joints) - 1
    slides = failing(structure, sliding={pile: 1.0})
    joints = slides.expand_dims(time=[0.0, 1.0])
    slip = np.zeros(joints["N"].shape)
    slip[:, pile] = 0.5e-3, -1.5e-3
    joints = joints.assign(opening=(joints["N"].dims, 0.0 * slip), slip=(joints["N"].dims, slip))
    found = first_verified_mechanism(structure, joints, beyond=1.9e-3).moved
    assert (found.part, found.time) == ("pier 2", 0.0)
    assert "it lasts 2 s, slips by up to 2 mm and has not closed" in str(found)
    assert first_verified_mechanism(structure, joints, beyond=2.1e-3) is None


def test_several_instants_or_other_joints_are_refused():
    structure = arch()
    with pytest.raises(af.InvalidInput, match="give one instant"):
        verified_mechanism(structure, history(structure, [{}, {}]))
    with pytest.raises(af.InvalidInput, match="18 joints of this structure"):
        verified_mechanism(structure, failing(arch(5)))


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


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("wall", "moves"), [((1.0, 1.0), True), ((0.0, 0.0), False)])
def test_a_block_on_ice_slides_away_from_a_wall(side, wall, moves):
    """Its bed lets it slide either way, and a wall beside it open: it moves away from the wall."""

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
    rigid = RigidBlocks(af.Structure(blocks, joints))
    freedoms = np.array([0.0, wall[0], 0.0, wall[1], 2.0, 0.0])  # openings at both ends, slips
    assert largest_motion(rigid, freedoms).any() == moves


def test_a_joint_without_friction_or_shear_slides_to_either_side():
    """A stone on a level joint under its weight alone: nothing prefers a side, nothing holds it."""
    smooth = af.Contact(1e9, 1e9, friction=0.0)
    structure = af.column(breadth=1.0, heights=[1.0, 1.0], contact=smooth)
    found = verified_mechanism(structure, failing(structure))
    assert found.kind != "none"
    number = found.moved.joints[0]
    jump = kinematics.jumps(structure, found.motion)[number]
    assert np.abs(jump @ structure.joints[number].tangent).min() > 1e-3
    assert jump @ structure.normals[number] == pytest.approx([0.0, 0.0], abs=1e-7)
