"""Mechanisms by count and by motion: four hinges in the right places, and in the wrong ones."""

import numpy as np
import pytest
import xarray as xr

from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria
from archfem.joints.resultants import joint_dataset
from archfem.limit.blocks import RigidBlocks
from archfem.limit.collapse import collapse_factor
from archfem.limit.counted import counted_mechanism, mechanism_kind
from archfem.limit.verified import first_verified_mechanism, verified_mechanism
from archfem.masonry.actions import BodyForce
from archfem.masonry.rigid_motion import motion_of
from archfem.masonry.shapes import arch_on_piers, circular_arch, column

WEIGHT = 1e4  # normal force in every joint [N]: only signs and ratios matter


def ring(voussoirs=17):
    return circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=voussoirs)


def piers(courses):
    return arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=15, pier_breadth=1.2, courses=[0.5] * courses
    )


def joints_with(structure, hinges=(), sliding=(), apart=()):
    """Joints in compression, some hinging {joint: e}, sliding {joint: V/N} or without contact."""
    resultants = np.zeros((len(structure.joints), 3))
    resultants[:, 0] = WEIGHT
    for joint, e in dict(hinges).items():
        resultants[joint, 2] = e * WEIGHT * structure.joints[joint].depth
    for joint, ratio in dict(sliding).items():
        resultants[joint, 1] = ratio * WEIGHT
    resultants[list(apart)] = 0.0
    return joint_dataset(structure, resultants)


ALTERNATING = {0: -0.5, 6: 0.5, 12: -0.5, 17: 0.5}


def test_four_alternating_hinges_are_a_mechanism():
    structure = ring()
    found = verified_mechanism(structure, joints_with(structure, ALTERNATING))
    assert (found.kind, found.moved.part, found.agrees) == ("local", "arch", True)
    assert found.moved.blocks == tuple(range(1, 18))
    assert found.moved.joints == (0, 6, 12, 17)
    assert "agree" in str(found)


def test_motion_turns_about_the_face_in_contact():
    structure = ring()
    found = verified_mechanism(structure, joints_with(structure, ALTERNATING))
    for number, joint in enumerate(structure.joints):
        jump = sum(
            sign * motion_of(joint.ends, structure.blocks[block].centroid) @ found.motion[block]
            for block, sign in ((joint.higher, 1.0), (joint.lower, -1.0))
        )
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
    structure = ring()
    found = verified_mechanism(structure, joints_with(structure, hinges))
    assert found.kind == "none"
    assert found.counted.kind == "local"
    assert not found.agrees
    assert "disagree" in str(found)
    assert found.moved.blocks == ()
    assert not found.motion.any()


def test_joints_of_a_motion_are_those_that_work_in_it():
    """A fifth hinge, on the wrong face, fails and stays shut."""
    structure = ring()
    joints = joints_with(structure, ALTERNATING | {1: -0.5, 2: 0.5})
    found = verified_mechanism(structure, joints)
    assert found.counted.joints == (0, 1, 2, 6, 12, 17)
    jumps = np.abs(RigidBlocks(structure).gaps(found.motion)).max(axis=0)
    assert found.moved.joints == tuple(np.flatnonzero(jumps > 1e-6))
    assert set(found.moved.joints) < set(found.counted.joints)


def test_three_hinges_do_not_move_and_are_not_counted():
    structure = ring()
    found = verified_mechanism(structure, joints_with(structure, {0: -0.5, 8: 0.5, 17: -0.5}))
    assert (found.kind, found.counted, found.agrees) == ("none", None, True)


def test_a_hinge_short_of_the_edge_counts_from_the_limit_on():
    structure = ring()
    hinges = {joint: 0.93 * e for joint, e in ALTERNATING.items()}  # |e| = 0.465
    joints = joints_with(structure, hinges)
    assert verified_mechanism(structure, joints).kind == "local"
    assert verified_mechanism(structure, joints, limit=0.48).kind == "none"


def test_a_sliding_block_moves_though_nobody_counts_it():
    structure = column(breadth=0.6, heights=[1.0, 1.0])
    found = verified_mechanism(structure, joints_with(structure, sliding={1: 0.61}))
    assert (found.kind, found.moved.blocks, found.counted) == ("local", (2,), None)
    slip = found.motion[2] - found.motion[1]
    assert slip[0] == pytest.approx(1.0)  # toward the extrados, as V > 0 says: right
    assert slip[1:] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_block_that_came_apart_may_lift():
    structure = column(breadth=0.6, heights=[1.0])
    found = verified_mechanism(structure, joints_with(structure, apart=[0]))
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
    collapse = collapse_factor(structure, live=BodyForce(1.0), friction=None)
    found = verified_mechanism(structure, collapse.joints)
    assert (found.kind, found.moved.part) == (kind, part)
    assert found.agrees
    sharp = verified_mechanism(structure, collapse.joints, limit=0.4999)  # none but its own hinges
    moving = [k for k, own in enumerate(collapse.motion) if np.abs(own).max() > 1e-6]
    assert list(sharp.moved.blocks) == moving


def test_piers_moving_both_are_global():
    structure = piers(2)
    bases = {0: 0.5, 19: 0.5}
    crown = {9: 0.5, 10: 0.5}
    haunches = {5: -0.5, 14: -0.5}
    found = verified_mechanism(structure, joints_with(structure, bases | crown | haunches))
    assert found.kind == "global"
    assert found.moved.part == "left pier + arch + right pier"
    assert found.counted.kind == "global"


def history(structure, instants):
    """Joints over time, one state a second, with an eccentricity for each joint given."""
    steps = [joints_with(structure, hinges) for hinges in instants]
    return xr.concat(steps, dim="time", coords="minimal", compat="override").assign_coords(
        time=np.arange(len(instants), dtype=float)
    )


def test_first_motion_and_first_count_in_a_history():
    structure = ring()
    wrong = dict.fromkeys(ALTERNATING, 0.5)
    joints = history(structure, [{}, {0: -0.5}, wrong, wrong, ALTERNATING, {}])
    assert counted_mechanism(joints).time == 2.0
    found = first_verified_mechanism(structure, joints)
    assert (found.moved.time, found.kind) == (4.0, "local")
    assert found.counted.time == 4.0
    assert first_verified_mechanism(structure, joints.isel(time=slice(0, 4))) is None


def test_count_takes_the_class_of_all_that_failed_or_the_class_asked_for():
    structure = piers(2)
    ring_and_pier = {3: 0.5, 6: -0.5, 9: 0.5, 0: 0.5}
    four_in_ring = {3: 0.5, 6: -0.5, 9: 0.5, 12: -0.5}
    joints = history(structure, [ring_and_pier, four_in_ring | {19: 0.5, 0: 0.5}, four_in_ring])
    first = counted_mechanism(joints)
    assert (first.kind, first.part, first.time) == ("semi-global", "left pier + arch", 0.0)
    assert first.joints == (0, 3, 6, 9)
    local = counted_mechanism(joints, kinds=("local",))
    assert (local.kind, local.part, local.time) == ("local", "arch", 1.0)
    assert local.joints == (3, 6, 9, 12)
    assert counted_mechanism(joints.isel(time=[1])).kind == "global"
    assert counted_mechanism(joints.isel(time=2)).kind == "local"
    assert counted_mechanism(joints, Criteria(failures=7)) is None


@pytest.mark.parametrize(
    ("roles", "kind"),
    [
        ([], "none"),
        (["ring"], "local"),
        (["pier"], "local"),
        (["other"], "local"),
        (["ring", "other", "other"], "local"),
        (["ring", "pier"], "semi-global"),
        (["ring", "ring"], "global"),
        (["pier", "pier"], "global"),
        (["ring", "pier", "pier"], "global"),
    ],
)
def test_class_follows_from_rings_and_piers(roles, kind):
    assert mechanism_kind(roles) == kind


def test_several_instants_or_other_joints_are_refused():
    structure = ring()
    with pytest.raises(InvalidInput, match="give one instant"):
        verified_mechanism(structure, history(structure, [{}, {}]))
    with pytest.raises(InvalidInput, match="18 joints of this structure"):
        verified_mechanism(structure, joints_with(ring(5)))
