"""Mechanisms by count, and their classes."""

import numpy as np
import pytest
import xarray as xr
from mechanisms import failing, piers

import archfem as af
from archfem.limit.counted import counted_mechanism, mechanism_kind


def history(structure, instants):
    """Joints over time, one state a second, with an eccentricity for each joint given."""
    steps = [failing(structure, hinges) for hinges in instants]
    return xr.concat(steps, dim="time", coords="minimal", compat="override").assign_coords(
        time=np.arange(len(instants), dtype=float)
    )


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
