"""Scale factors at first mechanism: closed form, whole runs, the search on made-up runs."""

from math import inf
from types import SimpleNamespace

import numpy as np
import pytest

from archfem.dynamics import scales
from archfem.dynamics.history import Ending
from archfem.dynamics.scales import MechanismScales, ScaledRun, mechanism_scales
from archfem.dynamics.schemes import Rayleigh
from archfem.dynamics.time_history import time_history
from archfem.dynamics.verdicts import DEFINITIONS, first_mechanisms
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import HINGE, Criteria
from archfem.limit.counted import Mechanism
from archfem.masonry.shapes import arch_on_piers, column
from archfem.models.rigid import rigid
from archfem.motion.motion import Motion
from archfem.motion.signals import LARGEST_PEAK
from archfem.statics.equilibrium import dead_load

ROUND_OFF = 1.0 + 1e-9
DAMPING = Rayleigh(0.05, (8.0, 16.0))


@pytest.fixture(scope="module")
def on_piers():
    return rigid(
        arch_on_piers(radius=3.0, thickness=0.6, voussoirs=15, pier_breadth=1.2, courses=[0.5] * 3)
    )


def test_a_slow_push_hinges_a_block_as_statics_says():
    """e = a h / (2 g b) reaches its limit; the pulse lasts 250 periods of the block."""
    breadth, height, peak = 0.5, 1.0, 4.0
    model = rigid(column(breadth=breadth, heights=[height]))
    pulse = 0.5 * peak * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, 401)))
    found = mechanism_scales(
        model, Motion(pulse, dt=0.02), damping=Rayleigh(0.05, (10.0, 30.0)), precision=0.01, dt=0.01
    )
    expected = HINGE * 2.0 * model.structure.gravity * breadth / height / peak
    bracket = found["verified"]
    assert bracket.lower / 1.01 < expected < 1.01 * bracket.upper  # the pulse is not quite static
    assert bracket.ratio <= 1.01 * ROUND_OFF
    assert found.asked == ("verified",)
    assert "has no such joints" in found.table()


def test_bounds_are_those_of_whole_runs(on_piers):
    """Each bound again, to the end of the motion, without the event that shortens runs."""
    motion = Motion.synthetic(duration=2.0, pga=6.0, seed=2)
    dead = dead_load(on_piers)
    found = mechanism_scales(on_piers, motion, start=dead, damping=DAMPING, precision=0.2)
    assert found.asked == DEFINITIONS
    for scale in {
        bound for name in DEFINITIONS for bound in (found[name].lower, found[name].upper)
    }:
        run = time_history(on_piers, motion.scaled(scale), start=dead, damping=DAMPING)
        met = first_mechanisms(run)
        for name in DEFINITIONS:
            if scale <= found[name].lower:
                assert met[name] is None
            elif scale == found[name].upper:
                assert met[name] == found[name].trial.found[name]
    assert all(found[name].ratio <= 1.2 * ROUND_OFF for name in DEFINITIONS)
    assert found["any four joints"].upper <= min(found[name].upper for name in DEFINITIONS[:3])


def pretend(monkeypatch, fails, ended=lambda scale: Ending.FINISHED):
    """Runs that fail by a rule of the scale alone."""

    def run(model, motion, **_):
        return SimpleNamespace(scale=motion.pga, ended=ended(motion.pga), outcome="in words")

    def met(run):
        hit = Mechanism("local", "arch", (0,), 1.0)
        return {name: hit if fails[name](run.scale) else None for name in DEFINITIONS}

    monkeypatch.setattr(scales, "time_history", run)
    monkeypatch.setattr(scales, "first_mechanisms", met)


UNIT = Motion(np.array([0.0, 1.0, 0.0]), dt=0.01)
THRESHOLDS = dict(zip(DEFINITIONS, (0.21, 0.74, 0.75, 3.1), strict=True))


def beyond(threshold):
    return lambda scale: scale >= threshold


def test_search_closes_in_on_every_threshold(on_piers, monkeypatch):
    pretend(monkeypatch, {name: beyond(each) for name, each in THRESHOLDS.items()})
    found = mechanism_scales(on_piers, UNIT, start=object(), precision=0.02)
    for name, threshold in THRESHOLDS.items():
        assert found[name].lower < threshold <= found[name].upper
        assert found[name].ratio <= 1.02 * ROUND_OFF
    assert len(found.trials) <= 10 + 5 * 4  # ladder, and ln(√2) / ln(1.02) halved to 1 for each


def test_every_run_of_a_search_has_the_criteria(on_piers, monkeypatch):
    pretend(monkeypatch, dict.fromkeys(DEFINITIONS, beyond(1.0)))
    made_up, seen = scales.time_history, []
    monkeypatch.setattr(
        scales, "time_history", lambda *a, **given: seen.append(given) or made_up(*a, **given)
    )
    ours = Criteria(hinge=0.4, failures=60)
    found = mechanism_scales(on_piers, UNIT, start=object(), criteria=ours)
    assert all(given["criteria"] == ours for given in seen)
    assert found.asked == ("verified",)  # there are no sixty joints


def test_what_fails_nowhere_or_everywhere_is_said(on_piers, monkeypatch):
    always, never = (lambda _: True), (lambda _: False)
    pretend(monkeypatch, dict(zip(DEFINITIONS, (always, never, never, beyond(2.0)), strict=True)))
    found = mechanism_scales(on_piers, UNIT, start=object(), between=(0.1, 3.0))
    assert (found["any four joints"].lower, found["any four joints"].upper) == (0.0, 0.1)
    assert (found["four in a ring"].lower, found["four in a ring"].upper) == (3.0, inf)
    assert found["verified"].upper == pytest.approx(2.0, rel=0.05)


def test_no_motion_beyond_what_a_motion_may_be_is_tried(on_piers, monkeypatch):
    pretend(monkeypatch, dict.fromkeys(DEFINITIONS, lambda _: False))
    strong = UNIT.scaled(20.0)
    found = mechanism_scales(on_piers, strong, start=object())
    assert found.trials[-1].scale == pytest.approx(LARGEST_PEAK / 20.0)


def test_survivals_above_a_failure_are_noted(on_piers, monkeypatch):
    """A window that fails, below scales that survive: the smallest failure found counts."""
    fails = {name: beyond(0.3) for name in DEFINITIONS}
    fails["verified"] = lambda scale: 0.45 < scale < 0.6 or scale >= 2.0
    pretend(monkeypatch, fails)
    found = mechanism_scales(on_piers, UNIT, start=object())
    bracket = found["verified"]
    assert 0.45 <= bracket.upper <= 0.45 * 1.05
    assert 1.0 in bracket.above
    assert "survives also" in found.table()
    assert not found["any four joints"].above


def test_a_run_without_equilibrium_counts_as_failed(on_piers, monkeypatch):
    pretend(monkeypatch, dict.fromkeys(DEFINITIONS, lambda _: False))
    made_up = scales.time_history

    def failing(model, motion, **given):
        if motion.pga >= 1.3:
            history = SimpleNamespace(
                scale=motion.pga, ended=Ending.FAILED, outcome="failed at 0.3 s"
            )
            raise DidNotConverge("no equilibrium", history=history)
        return made_up(model, motion, **given)

    monkeypatch.setattr(scales, "time_history", failing)
    found = mechanism_scales(on_piers, UNIT, start=object())
    for name in DEFINITIONS:
        assert found[name].lower < 1.3 <= found[name].upper
    assert found.table().count("failed at 0.3 s") == len(DEFINITIONS)


def test_ctrl_c_keeps_what_is_known(on_piers, monkeypatch):
    pretend(
        monkeypatch,
        {name: beyond(2.5) for name in DEFINITIONS},
        lambda scale: Ending.INTERRUPTED if scale > 1.9 else Ending.FINISHED,
    )
    found = mechanism_scales(on_piers, UNIT, start=object())
    assert [trial.scale for trial in found.trials] == pytest.approx([1.0, 2.0**0.5, 2.0])
    assert found["verified"].lower == pytest.approx(2.0**0.5)  # the broken-off run tells nothing
    assert found["verified"].trial is None


def test_hand_made_trials():
    hit = Mechanism("local", "arch", (1, 2, 3, 4), 1.5)
    met = {scale: hit if scale in (2.0, 4.0) else None for scale in (1.0, 2.0, 3.0, 4.0)}
    trials = [
        ScaledRun(scale, {"verified": found}, Ending.FINISHED, "") for scale, found in met.items()
    ]
    found = MechanismScales(("verified",), tuple(trials))["verified"]
    assert (found.lower, found.upper, found.above) == (1.0, 2.0, (3.0,))
    assert found.trial.found["verified"] is hit


def test_refusals(on_piers):
    with pytest.raises(InvalidInput, match="precision 0 between"):
        mechanism_scales(on_piers, UNIT, precision=0.0)
    with pytest.raises(InvalidInput, match="the smaller first"):
        mechanism_scales(on_piers, UNIT, between=(2.0, 1.0))
