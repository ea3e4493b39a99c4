"""The dead load: what carries it, what cannot, and what an error then carries."""

import numpy as np
import pytest

import archfem as af
from archfem.statics.equilibrium import Equilibrium, _grown, dead_load, self_weight
from archfem.statics.newton import Solved


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


class Growing:
    """A model that stands as it is."""

    supports, memory = np.zeros(1), np.zeros(0)

    def remembering(self, memory):
        return self


def grown(most, ways=("whole", "half", "least")):
    """Parts of a load at which an equilibrium was sought up to a largest one, and how it was."""
    asked, begin = [], Equilibrium(Growing(), np.zeros(1), 5, 2)

    def way(name):
        def find(solver, model, load, start):
            asked.append((float(load), name, float(start[0])))
            if load > most(len(asked)):
                raise af.DidNotConverge("made to fail")
            return model, Solved(np.array([load]), 3, 0.0)

        return find

    ways = tuple(way(name) for name in ways)
    try:
        found = _grown(None, begin, lambda part: (begin.model, part), "load", ways)
    except af.DidNotConverge as error:
        return asked, error
    return asked, found


def test_steps_of_a_load_are_halved_where_there_is_no_equilibrium():
    """To a half, and from then on as long as that; each begins where the last one ended."""
    asked, found = grown(lambda count: 0.6 if count == 1 else 1.0)
    assert asked == [(1.0, "whole", 0.0), (0.5, "half", 0.0), (1.0, "half", 0.5)]
    assert (found.iterations, found.steps, found.q[0]) == (5 + 6, 2 + 2, 1.0)


def test_a_load_is_given_up_at_a_sixty_fourth_of_it():
    """Another way is tried for the smallest step; what was found last is told, and how far."""
    asked, error = grown(lambda count: 0.3)
    parts = [part for part, *_ in asked]
    known = [1.0, 0.5, 0.25, 0.5, 0.375, 0.3125, 0.28125, 0.3125, 0.296875, 0.3125]
    assert parts == pytest.approx(known)
    assert [name for _, name, _ in asked][-3:] == ["half", "least", "least"]
    assert "no equilibrium beyond 0.297 of the load" in str(error)
    assert error.last.q[0] == pytest.approx(0.296875)


def test_an_equilibrium_in_a_line(stack):
    found = dead_load(af.build(stack, fidelity="rigid"))
    assert repr(found) == (
        f"Equilibrium of '{stack.name}' (rigid, 6 coordinates): |e| ≤ 0.000, V/N ≤ 0.000, N ≥ 20 kN"
    )
