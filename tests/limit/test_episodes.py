"""How long a mechanism lasts, and how far it opens."""

import numpy as np
import pytest
import xarray as xr
from mechanisms import ALTERNATING, arch, failing

import archfem as af
from archfem.limit.episodes import Episode, episode, lasting

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


def test_what_lasts_25_ms_opens_2_5_mm_and_closes_is_said_to_be_that():
    """Wider openings before, after and of other joints are none of the mechanism's."""
    instants = [{}, {6: 0.5}, *[ALTERNATING] * 5, {6: 0.5}, ALTERNATING]
    joints = shaken(instants, [0.0, 9e-3, 1e-3, 2e-3, 2.5e-3, 1e-3, 1e-3, 8e-3, 7e-3])
    found = af.limit.counted_mechanism(joints)
    met = episode(joints, found)
    assert found.time == 2 * STEP
    assert (met.duration, met.opening, met.closes) == pytest.approx((0.025, 2.5e-3, True))
    assert str(met) == "it lasts 25 ms, opens by up to 2.5 mm and closes again"


def test_further_failures_do_not_end_it():
    joints = shaken([ALTERNATING, ALTERNATING | {9: 0.5}, ALTERNATING, {}])
    assert episode(joints, af.limit.counted_mechanism(joints)).duration == pytest.approx(0.015)


def test_what_goes_on_at_the_end_has_not_closed():
    joints = shaken([{}, ALTERNATING, ALTERNATING], [0.0, 1e-3, 3e-3])
    found = af.limit.counted_mechanism(joints)
    assert str(episode(joints, found)) == (
        "it lasts 10 ms, opens by up to 3 mm and has not closed when the record ends"
    )
    short = joints.isel(time=[0, 1])
    assert str(episode(short, found)) == (
        "it lasts 5 ms, opens by up to 1 mm and has not closed when the record ends"
    )


def test_openings_that_nobody_kept_are_not_told():
    joints = shaken([ALTERNATING, {}])
    met = episode(joints, af.limit.counted_mechanism(joints))
    assert met == Episode(STEP, None, True)
    assert str(met) == "it lasts 5 ms and closes again"


def test_a_mechanism_of_another_record_is_refused():
    joints = shaken([{}, ALTERNATING])
    found = af.limit.counted_mechanism(joints)
    with pytest.raises(af.InvalidInput, match="none of those recorded"):
        episode(joints.isel(time=[0]), found)


def test_durations_are_told_in_fitting_units():
    assert [lasting(each) for each in (0.025, 0.9994, 1.0, 12.34)] == [
        "25 ms",
        "999 ms",
        "1 s",
        "12.3 s",
    ]
