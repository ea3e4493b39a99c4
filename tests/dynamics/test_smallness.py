"""What is said where displacements are too large to be taken as small."""

import logging
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem.dynamics.ladder import choose
from archfem.dynamics.probe import peaks, usual_damping
from archfem.dynamics.smallness import PER_TURN, QUIET, error_of_small
from archfem.dynamics.yardstick import SAFETY, Steps, Yardstick
from archfem.models.build import build as plain
from archfem.models.moving import Moving

STEPS = Steps(0.0025, None)
COLUMN = af.column(breadth=1.0, heights=[1.0, 1.0, 1.0])


def yardstick(structure, pga, fidelity="rigid", seconds=3.0):
    model = af.build(structure, fidelity=fidelity)
    motion = af.Motion.synthetic(duration=seconds, pga=pga, seed=3)
    return Yardstick(model, motion, usual_damping(model))


def quick(structure, asked):
    """As many models as are asked for, all of rigid stones."""
    return plain(structure, replace(asked, fidelity="rigid"))


def test_where_joints_hardly_turn_nothing_is_measured():
    found = error_of_small(yardstick(COLUMN, 0.2), STEPS)
    assert 0.0 < found <= PER_TURN * QUIET


def test_it_is_the_difference_that_large_displacements_make(ring):
    """By runs of this test's own, over the same motion."""
    measure = yardstick(ring, 2.5)
    runs = [
        peaks(
            af.build(ring, fidelity="rigid", displacements=kind),
            measure.window,
            measure.damping,
            STEPS.dt,
        )
        for kind in ("small", "large")
    ]
    found = error_of_small(measure, STEPS)
    assert found == pytest.approx(SAFETY * np.abs(runs[0] - runs[1]).max(), rel=1e-9)
    assert 1e-3 < found < 0.05


def test_small_displacements_let_stand_what_falls():
    """A slender column under a pulse by far too long: no model of small displacements overturns."""
    slender = af.column(breadth=0.3, heights=[3.0])
    model = af.build(slender, fidelity="rigid")
    push = af.Motion(np.full(151, 2.0), 0.01)
    measure = Yardstick(model, push, usual_damping(model))
    assert error_of_small(measure, Steps(0.005, None)) == np.inf


def test_with_soil_it_is_estimated_from_the_turn():
    """In a run that was made already to tell what steps err by."""
    runs: list[None] = []
    stack = af.column(breadth=1.0, heights=[1.0, 0.5])
    soft = replace(stack.blocks[1], material=af.masonry.BACKFILL)
    soft_stack = replace(stack, blocks=(stack.blocks[0], soft, stack.blocks[2]))
    measure = yardstick(soft_stack, 0.5, {"block 1": "full", "rest": "faces"}, seconds=1.0)
    measure = replace(measure, told=lambda: runs.append(None))
    measure.in_time(STEPS)
    run = af.time_history(measure.model, measure.window, damping=measure.damping, dt=STEPS.dt)
    turn = float(np.abs(run.joints["rotation"]).max())
    assert error_of_small(measure, STEPS) == pytest.approx(PER_TURN * turn)
    assert len(runs) == 2


def test_a_choice_warns_of_what_it_cannot_mend(caplog):
    """The rigid column turns at its foot: no finer mesh makes small displacements right."""
    motion = af.Motion.synthetic(duration=3.0, pga=2.6, seed=3)
    with caplog.at_level(logging.WARNING, "archfem"):
        model = choose(COLUMN, 0.004, motion, dt=0.005, builder=quick)
    assert model.prediction.of_small > 0.004
    assert "because displacements are taken as small" in model.prediction.text
    assert "to take displacements as small" in caplog.text
    assert "displacements='large'" in caplog.text


def test_a_choice_may_be_of_large_displacements():
    """The rung that small ones ask for; nothing is left to doubt about their size."""
    motion = af.Motion.synthetic(duration=1.0, pga=0.8, seed=3)
    model = choose(COLUMN, 0.05, motion, dt=0.005, displacements="large", builder=quick)
    assert isinstance(model, Moving)
    assert model.prediction.of_small == 0.0
    assert model.prediction.met
    with pytest.raises(af.InvalidInput, match="displacements 'huge' are not known"):
        choose(COLUMN, 0.05, motion, dt=0.005, displacements="huge", builder=quick)


def test_a_run_whose_joints_turn_is_doubted(caplog):
    model = af.build(COLUMN, fidelity="rigid")
    motion = af.Motion.synthetic(duration=8.0, pga=3.2, seed=3)
    with caplog.at_level(logging.WARNING, "archfem"):
        run = af.time_history(model, motion, damping=usual_damping(model), dt=0.0025)
    assert float(np.abs(run.joints["rotation"]).max()) > 0.01
    assert "a joint had turned by" in caplog.text


@pytest.mark.parametrize(("turn", "looks"), [(-0.98e-4, 1), (1.02e-4, 2)])
def test_a_second_look_is_taken_from_a_tenth_of_a_milliradian_on(turn, looks, monkeypatch):
    """Of the joint that turns most, either way; up to there 7 a radian is what it errs by."""
    made = []

    def shaken(model, motion, **given):
        made.append(model)
        rotation = xr.DataArray([[0.0, turn], [0.5 * turn, 0.0]])
        e = 0.1 if len(made) == 1 else 0.13
        return SimpleNamespace(joints={"rotation": rotation}, ended=None, peaks=np.array([e, 0.0]))

    monkeypatch.setattr("archfem.dynamics.smallness.time_history", shaken)
    monkeypatch.setattr("archfem.dynamics.smallness.peaks_of", lambda run: run.peaks)
    model = af.build(COLUMN, fidelity="rigid")
    motion = af.Motion(np.zeros(5), 0.01)
    found = error_of_small(Yardstick(model, motion, None), STEPS)
    assert found == pytest.approx(7.0 * abs(turn) if looks == 1 else 1.5 * 0.03)
    assert [isinstance(each, Moving) for each in made] == [False, True][:looks]
