"""Criteria on joints whose state is known by construction."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem.cases.result_text import tabulate_joints
from archfem.dynamics import MECHANISM_DEFINITIONS
from archfem.joints import Criteria, assessed_joints
from archfem.joints.criteria import eccentricity_magnitude, sliding_ratio, with_failure_flags


def test_flags(joints):
    assert joints["hinge"][1, 3] == -1
    assert joints["hinge"][2, 14] == 1
    assert joints["hinge"][4, 14] == 0
    assert joints["slide"].sum() == 3
    assert joints["open"].sum() == 1
    assert joints["judged"].all()
    assert [joints[name].dtype for name in ("hinge", "slide", "open")] == [np.int8, bool, bool]


@pytest.mark.parametrize("share", [1.0 - 1e-9, 1.0, 1.0 + 1e-9])
def test_friction_at_its_limit_is_used_up_whatever_the_round_off(ring, share):
    normal = 1000.0 * 1.1 ** np.arange(18)  # V / N is then μ only to a few digits of the last
    resultants = np.stack([normal, 0.6 * share * normal, np.zeros(18)], axis=1)
    assert af.joints.joint_dataset(ring, resultants)["slide"].all()
    resultants[:, 1] *= 1.0 - 1e-5
    assert not af.joints.joint_dataset(ring, resultants)["slide"].any()


def test_a_joint_without_friction_slides_either_way():
    """A plain stack on a frictionless bed: nothing but the bed lets it move."""
    slippery = replace(af.masonry.STONE_TO_STONE, friction=0.0)
    stack = af.column(breadth=1.0, heights=[1.0], contact=slippery)
    joints = af.joints.joint_dataset(stack, np.array([[1000.0, 0.0, 0.0]]))
    assert af.verified_mechanism(stack, joints).moved.blocks == (1,)


def test_mechanism_needs_four_joints_at_once(joints):
    found = af.limit.counted_mechanism(joints)
    assert found.time == pytest.approx(0.2)
    assert found.joints == (3, 7, 11, 14)
    assert af.limit.counted_mechanism(joints.isel(time=[0, 1, 3, 4])) is None


def test_the_table_has_the_envelope_times_and_durations(joints):
    """Each hinge, slide and opening of the five steps of 0.1 s; a record is a step."""
    table = tabulate_joints(joints)
    assert len(table.text.splitlines()) == 19
    never = ["-", "-"]
    at = {
        0: ["open", "0.000", "0.000", "0.000", *never, *never, *never],
        3: ["open", "-0.480", "0.000", "0.000", "0.100 s", "0.200 s", *never, *never],
        7: ["open", "0.000", "0.000", "0.700", *never, "0.200 s", "0.300 s", *never],
        11: ["open", "0.000", "0.000", "0.000", *never, *never, "0.200 s", "0.100 s"],
        14: ["open", "0.000", "0.470", "0.000", "0.200 s", "0.100 s", *never, *never],
    }
    assert {number: table.rows[number][1:] for number in at} == at


PARTS = ["arch 1"] * 5 + ["pier 1"] * 4 + ["arch 2"] * 5 + ["backfill"] * 6
ROLES = ["ring"] * 5 + ["pier"] * 4 + ["ring"] * 5 + ["other"] * 6


def joints_of(failing):
    """Twenty joints of two rings, a pier and soil; those failing at each instant slide."""
    friction = np.zeros((len(failing), 20))
    for instant, joints in enumerate(failing):
        friction[instant, list(joints)] = 0.6
    joints = xr.Dataset(
        {
            "N": (("time", "joint"), np.ones_like(friction)),
            "eccentricity": (("time", "joint"), np.zeros_like(friction)),
            "friction": (("time", "joint"), friction),
        },
        {
            "time": np.arange(len(failing), dtype=float),
            "joint": np.arange(20),
            "name": ("joint", [f"joint {k}" for k in range(20)]),
            "part": ("joint", PARTS),
            "role": ("joint", ROLES),
            "friction_limit": ("joint", np.full(20, 0.6)),
            "cohesion_limit": ("joint", np.zeros(20)),
        },
    )
    return with_failure_flags(joints, Criteria())


def test_definitions_of_a_counted_mechanism():
    soil, three = range(14, 20), {0, 1, 9}
    states = [soil, three | set(soil), three | {10}, {0, 5, 6, 7}, {0, 5, 6, 9}, {1, 2, 3, 4, 5}]
    found = af.limit.counted_mechanisms(joints_of(states))
    anywhere, ring, mixed, over_record = found.values()
    assert list(found) == [name for name in MECHANISM_DEFINITIONS if name != "verified"]
    assert (anywhere.time, anywhere.kind, anywhere.joints) == (2.0, "global", (0, 1, 9, 10))
    assert (mixed.time, mixed.part, mixed.joints) == (3.0, "arch 1 + pier 1", (0, 5, 6, 7))
    assert (ring.time, ring.kind, ring.joints) == (5.0, "local", (1, 2, 3, 4))
    assert (ring.part, mixed.kind) == ("arch 1", "semi-global")
    # by then joints 0 and 1 had failed in the first arch, and 5, 6 and 7 in the pier
    assert (over_record.time, over_record.part) == (5.0, "arch 1")
    assert over_record.joints == (0, 1, 2, 3, 4)


def test_four_in_a_pier_are_a_mechanism_of_one_part():
    found = af.limit.counted_mechanisms(joints_of([{5, 6, 7, 8}]))
    assert found["any joints at once"].kind == "local"
    assert found["one part at once"].part == "pier 1"
    assert af.limit.demirel_aldemir_mechanism(joints_of([{5, 6, 7, 8}])) is None
    assert found["ring and pier at once"] is None  # no joint of a ring


def test_four_of_two_rings_and_a_pier_are_of_no_pair():
    found = af.limit.counted_mechanisms(joints_of([{0, 5, 9, 10}]))
    assert found["any joints at once"].kind == "global"
    assert found["ring and pier at once"] is None


def test_joints_of_rings_and_piers_are_judged_and_keep_their_numbers():
    joints = joints_of([{0}])
    assert assessed_joints(joints)["joint"].values.tolist() == list(range(14))
    turned = assessed_joints(joints.isel(joint=slice(None, None, -1)))
    assert turned["joint"].values.tolist() == list(range(13, -1, -1))
    soil = with_failure_flags(joints.isel(joint=slice(14, None)), Criteria())
    assert assessed_joints(soil).identical(soil)  # there is nothing else to judge


def test_a_wall_by_itself_is_counted():
    joints = joints_of([{14, 15, 16, 17}]).isel(joint=slice(14, None))
    found = af.limit.counted_mechanism(joints)
    assert (found.kind, found.part) == ("local", "backfill")


def test_table_holds_judged_joints_only():
    joints = joints_of([{0}, {15}])
    lines = tabulate_joints(joints, joints.isel(time=0)).text.splitlines()
    assert len(lines) == 15
    assert "joint 15" not in "".join(lines)


def test_limits_are_those_of_the_criteria(joints):
    wide = with_failure_flags(joints, Criteria(hinge=0.475))
    assert wide["hinge"][1, 3] == -1
    assert wide["hinge"][2, 14] == 0  # at 0.47
    assert af.limit.counted_mechanism(wide) is None
    assert af.limit.counted_mechanism(joints, Criteria(failures=5)) is None
    assert af.limit.counted_mechanism(joints, Criteria(hinge=0.475, failures=3)).joints == (
        3,
        7,
        11,
    )


def test_friction_of_the_criteria_stands_for_that_of_every_joint(joints):
    assert with_failure_flags(joints, Criteria(friction=0.75))["slide"].sum() == 0
    assert with_failure_flags(joints, Criteria(friction=0.7))["slide"].sum() == 3
    assert (
        with_failure_flags(joints, Criteria(friction=0.0))["slide"].sum() == 5 * 18 - 1
    )  # one is open


def test_joints_keep_the_criteria_by_which_they_were_judged(joints):
    ours = Criteria(hinge=0.4, failures=3, friction=0.5)
    judged_so = with_failure_flags(joints, ours)
    assert Criteria.of(judged_so) == Criteria.of(judged_so.isel(time=2)) == ours
    assert with_failure_flags(judged_so) is judged_so
    again = with_failure_flags(judged_so, Criteria())
    assert again.identical(joints)
    assert "criteria_friction" not in again.attrs


@pytest.mark.parametrize("hinge", [0.0, -0.46, 0.51, np.nan, np.inf, "0.46", None, True])
def test_a_hinge_lies_within_its_joint(hinge):
    with pytest.raises(af.errors.InvalidInput, match="criteria hinge"):
        Criteria(hinge=hinge)


@pytest.mark.parametrize(
    "given", [{"failures": 0}, {"failures": 4.0}, {"friction": -0.1}, {"friction": "none"}]
)
def test_invalid_criteria_are_refused(given):
    with pytest.raises(af.errors.InvalidInput, match=f"criteria {next(iter(given))}"):
        Criteria(**given)


@pytest.mark.parametrize(("e", "face"), [(0.459, 0), (0.461, 1), (-0.459, 0), (-0.461, -1)])
def test_a_joint_hinges_from_46_hundredths_on(ring, e, face):
    resultants = np.zeros((18, 3))
    resultants[:, 0], resultants[4, 2] = 1000.0, e * 1000.0 * 0.55
    assert af.joints.joint_dataset(ring, resultants)["hinge"].values.tolist() == [
        face if k == 4 else 0 for k in range(18)
    ]


@pytest.mark.parametrize(
    ("e", "closed"), [(0.0, 1.0), (1.0 / 6.0, 1.0), (-0.3, 0.6), (0.49, 0.03), (0.6, 0.0)]
)
def test_cohesion_holds_where_a_joint_is_closed(e, closed):
    """μ N + c A with A = 3 (1/2 - |e|) h w of the middle third on; 1 % of cohesion is left out."""
    normal, cohesion = np.array([2e3, 4e3, 0.0]), np.array([1e3, 0.0, 1e3])
    found = sliding_ratio(normal, np.full(3, e), np.array([0.6, 0.5, 0.6]), cohesion)
    assert found[:2] == pytest.approx([0.6 + 0.99 * closed * 0.5, 0.5], rel=1e-12)
    assert np.isnan(found[2])


def test_four_hinges_make_a_mechanism_and_three_do_not(ring):
    assert (Criteria().failures, Criteria().duration) == (4, 1e-3)
    resultants = np.zeros((18, 3))
    resultants[:, 0] = 1000.0
    for count in (3, 4):
        resultants[:count, 1] = 700.0
        found = af.limit.counted_mechanism(af.joints.joint_dataset(ring, resultants))
        assert (found is not None) is (count == 4)


def test_open_joints_count_as_hinges():
    """One of three, where the thrust that it lacks would have its edge."""
    joints = xr.Dataset({"eccentricity": ("joint", [-0.3, np.nan, 0.2])})
    assert eccentricity_magnitude(joints).values.tolist() == [0.3, 0.5, 0.2]
