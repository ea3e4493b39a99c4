"""By how much errors in the strongest part of a motion are enlarged before they are promised."""

import io
import logging
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tqdm import tqdm

import archfem as af
from archfem.dynamics.ladder import choose
from archfem.dynamics.yardstick import Steps, Yardstick
from archfem.errors import DidNotConverge
from archfem.models.build import build as plain

STEPS = Steps(0.01, None)
BLOCK = af.column(breadth=0.5, heights=[2.5])


@pytest.fixture
def yardstick(monkeypatch):
    """Of peaks that are known: 0.3 by the finest model, 0.29 in half the steps, 0.26 by another.

    They grow by 0.4 of what the motion does; those of "rattling" jump by 0.02 where it is weaker,
    and it falls where the motion is stronger by more than 1.5 %.
    """

    def peaks(model, motion, damping, dt, **given):
        more = motion.pga - 1.0
        if model == "falling" and more > 0.015:
            raise DidNotConverge("it fell")
        known = 0.26 if model == "other" else 0.30 if dt == 0.01 else 0.29
        jump = 0.02 if model == "rattling" and more < -0.015 else 0.0
        return np.array([0.1, known + 0.4 * more + jump])

    monkeypatch.setattr("archfem.dynamics.yardstick.time_history", peaks)
    monkeypatch.setattr("archfem.dynamics.yardstick.peaks_of", lambda run: run)
    monkeypatch.setattr("archfem.dynamics.yardstick._turned", lambda run: 0.0)
    monkeypatch.setattr("archfem.dynamics.yardstick.dead_load", lambda model: None)
    return Yardstick("finest", af.Motion(np.array([0.0, 1.0, 0.0]), 0.01), None)


def test_errors_are_one_and_a_half_times_what_is_seen(yardstick):
    """In time that is 4/3 of what half the step changes: a scheme of second order has erred so."""
    assert yardstick.in_time(STEPS) == pytest.approx(1.5 * 4.0 / 3.0 * 0.01)
    assert yardstick.in_model("other", STEPS) == pytest.approx(1.5 * 0.04)


def test_what_does_not_grow_evenly_with_the_motion_is_chance(yardstick):
    """A jump by 0.02 on one side of two puts the middle off their mean by half of it."""
    assert yardstick.by_chance("other", STEPS) == pytest.approx(0.0, abs=1e-12)
    assert yardstick.by_chance("rattling", STEPS) == pytest.approx(1.5 * 0.01)
    assert yardstick.by_chance("falling", STEPS) == np.inf


@pytest.fixture
def shown(monkeypatch):
    """What is seen of progress, as on a terminal."""
    out = io.StringIO()
    seen = {"disable": False, "file": out, "mininterval": 0.0}
    monkeypatch.setattr("archfem.dynamics.ladder.tqdm", lambda **given: tqdm(**given | seen))
    return out


def rigid(structure, asked):
    """As many models as are asked for, all the same: they agree, whatever they err by."""
    return plain(structure, replace(asked, fidelity="rigid"))


@pytest.mark.parametrize(("pga", "rocks"), [(2.3, True), (0.5, False)])
def test_models_that_agree_promise_no_more_than_impacts_leave(pga, rocks, caplog, shown):
    """A slender block that rocks: a motion 1 % stronger makes another bounce the highest."""
    motion = af.Motion.synthetic(duration=2.5, pga=pga, seed=7)
    with caplog.at_level(logging.WARNING, "archfem"):
        model = choose(BLOCK, 0.002, motion, dt=0.005, builder=rigid)
    told = model.prediction
    assert "choosing a model" in shown.getvalue()
    assert "7/8" in shown.getvalue()  # two of steps, one model that others are compared with, four
    assert told.error == pytest.approx(told.in_time + told.of_chance)
    assert ("impacts decide" in caplog.text) is rocks
    assert any("impacts decide" in words for words in model.doubts) is rocks
    assert told.of_chance > 0.002 if rocks else told.of_chance < 1e-4


def test_motions_near_by_are_one_and_two_per_cent_weaker_and_stronger(monkeypatch):
    """Each run is made once, and told of; steps half as long have a quarter of the tolerance."""
    asked, told = [], []

    def run(model, motion, *, damping, dt, tolerance, start):
        asked.append((motion.pga, dt, tolerance))
        return SimpleNamespace(joints={"rotation": np.array([0.1, -0.2])})

    monkeypatch.setattr("archfem.dynamics.yardstick.time_history", run)
    monkeypatch.setattr("archfem.dynamics.yardstick.peaks_of", lambda run: np.zeros(1))
    monkeypatch.setattr("archfem.dynamics.yardstick.dead_load", lambda model: None)
    motion = af.Motion(np.array([0.0, 1.0, 0.0]), 0.01)
    measure = Yardstick("finest", motion, None, lambda: told.append(1))
    for _ in range(2):
        assert measure.by_chance("other", STEPS) == 0.0
    assert sorted(pga for pga, *_ in asked) == pytest.approx([0.98, 0.99, 1.0, 1.01, 1.02])
    assert len(told) == 5
    measure.in_time(Steps(None, 0.004))
    assert asked[5:] == [(1.0, None, 0.004), (1.0, None, 0.001)]
    assert measure.turn(Steps(None, 0.004)) == 0.2
    assert len(asked) == 7
    assert Steps(0.01, None).halved == Steps(0.005, None)
    assert Steps(0.01, None).label == "steps of 10 ms"
    assert Steps(None, 0.004).label == "steps for 0.004 in |e|"
