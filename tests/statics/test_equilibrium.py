"""The dead load: what carries it, what cannot, and what an error then carries."""

import numpy as np
import pytest

import archfem as af
from archfem.statics.equilibrium import dead_load, self_weight


def semicircle(share, fidelity):
    """Of 17 chorded stones, so many times as thick as limit analysis of the same polygon asks."""
    given = {"radius": 1.0, "embrace": 180.0, "voussoirs": 17, "chords": 1}
    return af.build(af.circular_arch(thickness=share * 0.10546, **given), fidelity=fidelity)


@pytest.mark.parametrize("fidelity", ["rigid", "full"])
def test_a_ring_stands_just_above_its_least_thickness(fidelity):
    found = dead_load(semicircle(1.02, fidelity))
    assert np.abs(found.joints["eccentricity"]).max() <= 0.5 + 1e-9


@pytest.mark.parametrize("fidelity", ["rigid", pytest.param("full", marks=pytest.mark.slow)])
def test_a_ring_does_not_stand_just_below_its_least_thickness(fidelity):
    thin = semicircle(0.98, fidelity)
    with pytest.raises(
        af.DidNotConverge, match=r"no equilibrium beyond .* make it thicker"
    ) as caught:
        dead_load(thin)
    assert caught.value.last.q.shape == (thin.size,)


def test_point_load_is_carried_whole(ring):
    """Thrusts at both springings balance weight and load, on either rung."""
    load = af.PointLoad(x=1.0, force=(0.0, -5e3))
    for fidelity in ("rigid", "full"):
        model = af.build(ring, fidelity=fidelity)
        forces = self_weight(model) + model.load(load)
        joints = af.statics.equilibrium_under(model, forces).joints
        up = sum(
            side
            * float(
                joints["N"][k] * ring.normals[k, 1] - joints["V"][k] * ring.joints[k].tangent[1]
            )
            for k, side in ((0, 1.0), (17, -1.0))
        )
        weight = model.body[:, 1].sum() * ring.gravity
        assert up == pytest.approx(weight + 5e3, rel=1e-9)


def test_joints_that_stay_closed_take_one_step_and_one_iteration(stack):
    found = dead_load(af.build(stack, fidelity="rigid"))
    assert (found.iterations, found.steps) == (1, 1)


def test_point_load_off_the_structure(ring):
    with pytest.raises(af.InvalidInput, match=r"x = 9 m misses the structure"):
        af.PointLoad(x=9.0, force=(0.0, -1.0)).place(ring)
