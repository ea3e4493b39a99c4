"""Loads that grow: their size, their forces, and how far they move along themselves."""

import numpy as np
import pytest

import archfem as af
from archfem.statics.continuation import GrowingLoad

ACTIONS = [af.BodyForce(0.3, -0.4), af.PointLoad(0.2, (3e3, -4e3))]


@pytest.fixture(params=["small", "large"])
def model(request):
    tower = af.column(breadth=1.0, heights=[1.0, 1.0])
    return af.build(tower, fidelity="rigid", displacements=request.param)


def test_the_size_of_a_load_is_the_sum_of_its_actions(model):
    load = GrowingLoad.of(model, ACTIONS)
    assert load.size == pytest.approx(0.5 * model.structure.weight + 5e3)
    assert GrowingLoad.of(model, ACTIONS[1:]).size == pytest.approx(5e3)
    with pytest.raises(af.InvalidInput, match="the load is zero"):
        GrowingLoad.of(model, [af.BodyForce(0.0)])


def test_a_load_moves_by_its_work_over_its_size(model):
    """Blocks shifted without turning: weights and force go as far, on whichever block."""
    load, q = GrowingLoad.of(model, ACTIONS), np.tile([0.02, -0.01, 0.0], 2)
    weight = model.structure.weight
    work = weight * (0.3 * 0.02 + 0.4 * 0.01) + 3e3 * 0.02 + 4e3 * 0.01
    assert load.displacement(q) == pytest.approx(work / load.size)
    forces = load.forces(np.zeros(model.size))
    assert forces == pytest.approx(load.first)
    assert forces[[0, 3]].sum() == pytest.approx(0.3 * weight + 3e3)
    assert forces[[1, 4]].sum() == pytest.approx(-0.4 * weight - 4e3)


def test_forces_of_a_load_are_the_slope_of_its_work(model):
    """Their rate is their slope, by central differences; there is none unless blocks turn."""
    load, q = GrowingLoad.of(model, ACTIONS), 0.1 * np.array([1.0, -2.0, 3.0, 1.0, 2.0, -2.0])
    steps = 1e-6 * np.eye(model.size)
    slope = [
        (load.displacement(q + e) - load.displacement(q - e)) * load.size / 2e-6 for e in steps
    ]
    assert load.forces(q) == pytest.approx(slope, abs=1e-3)
    rate = load.rate(q)
    bent = np.array([(load.forces(q + e) - load.forces(q - e)) / 2e-6 for e in steps])
    if rate is None:
        assert not bent.any()
    else:
        assert rate.toarray() == pytest.approx(bent, abs=1e-3)
        assert np.abs(bent).max() > 100.0
