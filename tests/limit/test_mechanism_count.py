"""Mechanisms by count: classes, duration and opening."""

import numpy as np
import pytest
import xarray as xr
from mechanisms import ALTERNATING, arch, failing, piers

import archfem as af
from archfem.limit import (
    counted_mechanism,
    counted_mechanisms,
    demirel_aldemir_mechanism,
)
from archfem.limit.mechanism_count import (
    duration_text,
    has_counted_mechanism,
    matching_definitions,
    mechanism_kind,
)
from archfem.masonry.parts import select_assessed_parts


def history(structure, instants):
    """Joints over time, one state a second, with an eccentricity for each joint given."""
    steps = [failing(structure, hinges) for hinges in instants]
    return xr.concat(steps, dim="time", coords="minimal", compat="override").assign_coords(
        time=np.arange(len(instants), dtype=float)
    )


def test_count_takes_the_class_of_all_failed_joints_or_the_given_class():
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
    assert counted_mechanism(joints, af.Criteria(failures=7)) is None


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


RING = {3: 0.5, 6: -0.5, 9: 0.5}
"""Three hinges of the ring on piers of two courses."""

FOURTH = {12: -0.5}


@pytest.mark.parametrize(
    ("failures", "found"),
    [
        (RING, None),
        (RING | {0: 0.5}, None),  # a pier's joint is not one of the four
        (RING | {0: 0.5, 19: 0.5}, None),
        (RING | FOURTH, ("local", "arch")),
        (RING | FOURTH | {0: 0.5}, ("semi-global", "left pier + arch")),
        (RING | FOURTH | {0: 0.5, 19: 0.5}, ("global", "left pier + arch + right pier")),
        ({0: 0.5, 1: 0.5, 18: 0.5, 19: 0.5}, None),  # no ring
    ],
)
def test_the_words_of_demirel_and_aldemir(failures, found):
    """Four in one ring are local; joints of piers beside them make it semi-global or global."""
    met = demirel_aldemir_mechanism(failing(piers(2), failures))
    assert (met and (met.kind, met.part)) == found
    if met:
        assert met.joints == tuple(sorted(failures))


def test_the_words_of_demirel_and_aldemir_begin_with_four_in_a_ring():
    """They count sliding joints, and joints that also hinge once; a wider count begins before."""
    structure = piers(2)
    instants = [RING, RING | {0: 0.5}, RING | FOURTH | {0: 0.5}, RING | FOURTH]
    joints = history(structure, instants)
    met = demirel_aldemir_mechanism(joints)
    assert (met.time, met.kind) == (2.0, "semi-global")
    assert met.names == tuple(structure.joints[joint].name for joint in (0, 3, 6, 9, 12))
    assert counted_mechanisms(joints)["one part at once"].time == met.time
    assert counted_mechanism(joints).time == 1.0
    assert demirel_aldemir_mechanism(joints, af.Criteria(failures=3)).time == 0.0
    both = dict.fromkeys(RING, 0.7)
    assert demirel_aldemir_mechanism(failing(structure, RING, both)) is None
    assert demirel_aldemir_mechanism(failing(structure, RING, {12: -0.7})).kind == "local"
    assert demirel_aldemir_mechanism(failing(structure, RING, apart=[12])).kind == "local"


def test_two_rings_without_piers_are_local_each():
    """Three and two failures in two rings are none; where one has four, only that one counts."""
    spans = [
        af.shapes.Arch(
            measured="centre line",
            span=4.0,
            rise=1.5,
            thickness=0.5,
            voussoirs=9,
            name=f"{side} arch",
        )
        for side in ("left", "right")
    ]
    structure = af.bridge(arches=spans, piers=[af.shapes.Pier(gap=1.0, height=1.5)])
    of = {
        part: [k for k, joint in enumerate(structure.joints) if joint.part == part]
        for part in ("left arch", "right arch")
    }
    few = dict.fromkeys(of["left arch"][:3] + of["right arch"][:2], 0.5)
    assert demirel_aldemir_mechanism(failing(structure, few)) is None
    assert counted_mechanism(failing(structure, few)).kind == "global"
    met = demirel_aldemir_mechanism(failing(structure, few | {of["left arch"][3]: 0.5}))
    assert (met.kind, met.part, met.joints) == ("local", "left arch", tuple(of["left arch"][:4]))


def test_states_shorter_than_the_least_duration_count_by_no_definition():
    """Four hinges for 0.2 ms, and later, first some and then others, for 1.1 ms in all."""
    ring, other = arch(), {0: -0.5, 6: 0.5, 12: -0.5, 16: 0.5}
    joints = history(ring, [{}, ALTERNATING, {}, ALTERNATING, other, {}])
    joints = joints.assign_coords(time=[0.0, 2e-4, 1e-3, 1.6e-3, 2.1e-3, 4e-3])

    def times(least):
        criteria = af.Criteria(duration=least)
        by_count = counted_mechanisms(joints, criteria)["one part at once"]
        moved = af.limit.first_verified_mechanism(ring, joints, criteria)
        found = [counted_mechanism(joints, criteria), demirel_aldemir_mechanism(joints, criteria)]
        return {
            None if each is None else each.time
            for each in (*found, by_count, None if moved is None else moved.moved)
        }

    assert af.Criteria().duration == 1e-3
    assert times(0.0) == {2e-4}
    assert times(1e-3) == times(1.1e-3) == {1.6e-3}
    assert times(1.2e-3) == {None}


def test_as_many_fail_as_make_a_mechanism_from_four_on(ring):
    """Over time, three, four and five that slide; of some other number as the criteria say."""
    resultants = np.zeros((3, 18, 3))
    resultants[..., 0] = 1000.0
    for step, count in enumerate((3, 4, 5)):
        resultants[step, :count, 1] = 700.0
    joints = af.joints.joint_dataset(ring, resultants, np.arange(3.0))
    assert has_counted_mechanism(joints).values.tolist() == [False, True, True]
    strict = af.joints.joint_dataset(
        ring, resultants, np.arange(3.0), criteria=af.Criteria(failures=5)
    )
    assert has_counted_mechanism(strict).values.tolist() == [False, False, True]


def test_definitions_are_met_at_an_instant_where_counting_finds_a_mechanism():
    structure, rng, met = piers(2), np.random.default_rng(5), set()
    roles = {joint.part: joint.role for joint in structure.joints}
    for _ in range(40):
        hinges = np.flatnonzero(rng.random(len(structure.joints)) < rng.uniform(0.0, 0.5)).tolist()
        down = [structure.joints[number].part for number in hinges]
        count = {part: down.count(part) for part in select_assessed_parts(roles)}
        joints = failing(structure, dict.fromkeys(hinges, 0.5))
        found = {name for name, each in counted_mechanisms(joints).items() if each is not None}
        found -= {"one part over the record"}
        assert matching_definitions(count, roles, 4) == found
        met.add(frozenset(found))
    assert len(met) > 3


STEP = 0.005
"""Time from one instant to the next [s]."""


def shaken(instants, opening=None):
    """Joints over time: hinges at each instant, and the opening of joint 6 [m]."""
    steps = [failing(arch(), hinges) for hinges in instants]
    joints = xr.concat(steps, dim="time", coords="minimal", compat="override")
    joints = joints.assign_coords(time=STEP * np.arange(len(instants)))
    if opening is not None:
        wide = np.zeros((len(instants), joints.sizes["joint"]))
        wide[:, 6], wide[:, 9] = opening, 1.0  # joint 9 is none of the mechanism
        joints["opening"] = ("time", "joint"), wide
    return joints


def test_an_episode_of_25_ms_and_2_5_mm_that_closes_is_stated_so():
    """Wider openings before, after and of other joints are none of the mechanism's."""
    instants = [{}, {6: 0.5}, *[ALTERNATING] * 5, {6: 0.5}, ALTERNATING]
    joints = shaken(instants, [0.0, 9e-3, 1e-3, 2e-3, 2.5e-3, 1e-3, 1e-3, 8e-3, 7e-3])
    found = af.limit.counted_mechanism(joints)
    assert found.time == 2 * STEP
    assert (found.duration, found.opening, found.closes) == pytest.approx((0.025, 2.5e-3, True))
    assert found.course == "it lasts 25 ms, opens by up to 2.5 mm and closes again"


def test_further_failures_do_not_end_an_episode():
    joints = shaken([ALTERNATING, ALTERNATING | {9: 0.5}, ALTERNATING, {}])
    assert af.limit.counted_mechanism(joints).duration == pytest.approx(0.015)


def test_a_mechanism_open_at_the_end_has_not_closed():
    joints = shaken([{}, ALTERNATING, ALTERNATING], [0.0, 1e-3, 3e-3])
    assert af.limit.counted_mechanism(joints).course == (
        "it lasts 10 ms, opens by up to 3 mm and has not closed when the record ends"
    )
    short = joints.isel(time=[0, 1])
    assert af.limit.counted_mechanism(short).course == (
        "it lasts 5 ms, opens by up to 1 mm and has not closed when the record ends"
    )


def test_openings_that_were_not_kept_are_not_stated():
    joints = shaken([ALTERNATING, {}])
    found = af.limit.counted_mechanism(joints)
    assert (found.duration, found.opening, found.closes) == (STEP, None, True)
    assert found.course == "it lasts 5 ms and closes again"


def test_a_static_state_has_no_course():
    joints = shaken([{}, ALTERNATING])
    found = af.limit.counted_mechanism(joints.isel(time=1))
    assert (found.time, found.duration, found.closes) == (STEP, None, None)
    assert str(found) == "local mechanism of arch at 0.005 s by joints 0, 6, 12 and 17"


def test_durations_are_written_in_fitting_units():
    assert [duration_text(each) for each in (0.025, 0.9994, 1.0, 12.34)] == [
        "25 ms",
        "999 ms",
        "1 s",
        "12.3 s",
    ]


def test_damage_over_a_record_is_that_of_the_part_that_fails_first():
    """Two joints of the right pier, one after the other, and then two of the ring."""
    joints = history(piers(2), [{18: 0.5}, {19: 0.5}, {3: 0.5}, {6: -0.5}])
    found = counted_mechanisms(joints, af.Criteria(failures=2))["one part over the record"]
    assert (found.part, found.time, found.joints) == ("right pier", 1.0, (18, 19))
