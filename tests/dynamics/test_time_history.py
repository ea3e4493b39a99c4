"""Whole runs: events, criteria, interruption, failure, restart."""

import os
import signal
from types import SimpleNamespace

import numpy as np
import pytest
from glued import glued
from scipy.integrate import solve_ivp

import archfem as af
from archfem.dynamics import Ending, Record, last_state
from archfem.dynamics.error_estimation import RunPeaks
from archfem.dynamics.separation import LooseningMonitor
from archfem.dynamics.time_history import _doubt_shortest_steps, _find_end, _resolve_steps
from archfem.studies.evaluators import PreparedRuns

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
GIVEN = {"damping": DAMPING, "dt": 0.005}


def test_a_model_keeps_its_prediction(model):
    foreseen = af.models.Prediction(
        error=0.003,
        tolerance=0.005,
        dt=0.0025,
        candidates=(),
    )
    chosen = model.with_prediction(foreseen)
    assert (chosen.prediction, model.prediction) == (foreseen, None)
    assert chosen.with_support_motion(chosen.support_motion).prediction == foreseen
    short = af.time_history(chosen, af.Motion.synthetic(duration=0.25, seed=2))
    assert np.diff(short.time) == pytest.approx(0.0025)
    assert short.dataset.attrs["predicted_error"] == 0.003


def test_an_event_ends_the_run(run, model, motion):
    assert run.mechanism is not None
    halted = af.time_history(model, motion, **GIVEN, until=af.CountedMechanism())
    assert halted.time[-1] == pytest.approx(run.mechanism.time)
    assert "a mechanism of arch by joints " in halted.outcome
    assert halted.mechanism == run.mechanism


LOOSE = af.Criteria(hinge=0.38)


@pytest.fixture(scope="module")
def weak(motion):
    """A motion under which joints hinge by |e| of 0.38, and never four by 0.46."""
    return motion.scaled(0.7)


def test_criteria_of_the_event_are_those_of_the_run(model, weak):
    event = af.CountedMechanism(criteria=LOOSE)
    assert af.time_history(model, weak, **GIVEN).mechanism is None
    halted = af.time_history(model, weak, **GIVEN, until=event)
    assert halted.ending is af.dynamics.Ending.EVENT
    assert halted.criteria == LOOSE
    assert halted.mechanism.time == halted.time[-1]


@pytest.mark.parametrize(
    "event",
    [af.CountedMechanism(), pytest.param(af.dynamics.MovingMechanism(), marks=pytest.mark.slow)],
)
def test_an_event_obeys_the_criteria_of_the_run(model, motion, event):
    criteria = af.Criteria(hinge=0.42, friction=0.4)
    whole = af.time_history(model, motion, **GIVEN, criteria=criteria)
    halted = af.time_history(model, motion, **GIVEN, criteria=criteria, until=event)
    found = whole.mechanism if event == af.CountedMechanism() else whole.verified.moved
    assert halted.time[-1] == found.time
    ended_by = halted.mechanism if event == af.CountedMechanism() else halted.verified.moved
    assert ended_by == found


def test_criteria_of_run_and_event_must_be_the_same(model, motion):
    given = {**GIVEN, "criteria": af.Criteria(hinge=0.4)}
    with pytest.raises(af.InvalidInput, match=r"hinge=0\.4.*hinge=0\.38.*to the run alone"):
        af.time_history(model, motion, until=af.CountedMechanism(criteria=LOOSE), **given)
    short = motion.cut(0.0, 0.5)
    same = af.time_history(
        model, short, until=af.CountedMechanism(criteria=af.Criteria(hinge=0.4)), **given
    )
    assert same.criteria == given["criteria"]


@pytest.mark.parametrize(
    "event",
    [
        af.dynamics.EveryMechanism(),
        pytest.param(af.CountedMechanism(), marks=pytest.mark.slow),
        pytest.param(af.dynamics.MovingMechanism(), marks=pytest.mark.slow),
    ],
)
def test_an_event_begins_afresh_in_each_run(model, motion, event):
    first, second = (af.time_history(model, motion, **GIVEN, until=event) for _ in range(2))
    assert first.ending is second.ending is af.dynamics.Ending.EVENT
    assert first.outcome == second.outcome
    assert first.time[-1] == second.time[-1]


def test_a_run_continues_where_it_stopped(run, model, motion):
    first = af.time_history(model, motion.cut(0.0, 1.5), **GIVEN)
    second = af.time_history(model, motion, **GIVEN, start=last_state(first))
    assert second.time[0] == pytest.approx(1.5)
    whole = run.joints["M"].sel(time=slice(1.501, None)).values  # the first is no mean yet
    assert second.joints["M"].values[1:] == pytest.approx(whole, rel=1e-6, abs=1e-3)


def test_ctrl_c_keeps_the_computed_steps(model, motion):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # may be ignored here
    seen = []

    def press(structure, resultants):
        seen.append(resultants)
        if len(seen) == 300:
            os.kill(os.getpid(), signal.SIGINT)

    try:
        run = af.time_history(model, motion, **GIVEN, until=press)
    finally:
        signal.signal(signal.SIGINT, before)
    assert "interrupted at" in run.outcome
    assert run.ending is af.dynamics.Ending.INTERRUPTED
    assert not run.ending.is_complete
    assert 0.5 < run.time[-1] < 1.6
    assert run.joints["N"].notnull().all()


def test_a_failure_carries_the_history(model, motion, breaking):
    stepper = breaking(model, motion, lambda time, _: time > 0.2)
    with pytest.raises(af.DidNotConverge, match="made to fail") as caught:
        af.time_history(model, motion, dt=0.005, method=stepper)
    assert caught.value.history.time[-1] == pytest.approx(0.205, abs=0.006)
    assert caught.value.last.time == pytest.approx(0.205, abs=0.006)
    assert "failed at" in caught.value.history.outcome
    assert caught.value.history.ending is af.dynamics.Ending.FAILED


def test_hht_damps_less_than_it_changes(ring, motion):
    """At α = -0.05 the largest eccentricity stays within 5 % of average acceleration's."""
    model, weak = af.build(glued(ring), fidelity="rigid"), motion.scaled(0.3)
    peaks = [
        float(abs(af.time_history(model, weak, scheme=s, **GIVEN).joints["eccentricity"]).max())
        for s in (af.dynamics.Newmark(), af.HHT(-0.05))
    ]
    assert peaks[0] == pytest.approx(peaks[1], rel=0.05)


def test_refusals(model, motion):
    with pytest.raises(af.InvalidInput, match=r"dt \[s\] = 0\.5 is"):
        af.time_history(model, motion, dt=0.5)
    with pytest.raises(af.InvalidInput, match="record every = 0"):
        Record(every=0)


def test_steps_are_given_or_predicted_or_chosen_by_a_tolerance(model):
    """Between a microsecond and a tenth of a second; 0.005 of |e| where nothing is said."""
    assert _resolve_steps(model, None, None) == (None, 0.005)
    assert _resolve_steps(model, None, 0.02) == (None, 0.02)
    for dt in (1.01e-6, 0.1):
        assert _resolve_steps(model, dt, None) == (dt, 0.005)
    for dt in (0.99e-6, 0.101):
        with pytest.raises(af.InvalidInput, match=r"is not between 1e-06 and 0\.1"):
            _resolve_steps(model, dt, None)
    stepped = model.with_prediction(af.models.Prediction(0.0, 0.01, 0.002, ()))
    assert _resolve_steps(stepped, None, None) == (0.002, 0.005)
    assert _resolve_steps(stepped, 0.004, None) == (0.004, 0.005)


@pytest.mark.parametrize(
    ("event", "parting", "meeting", "said"),
    [
        (None, None, None, (Ending.FINISHED, None, 4)),
        (2, None, None, (Ending.EVENT, "enough", 3)),
        (2, 1, None, (Ending.PARTED, "the blocks coming loose: apart", 2)),
        (2, 2, None, (Ending.EVENT, "enough", 3)),
        (0, 3, None, (Ending.EVENT, "enough", 1)),
        (None, 0, None, (Ending.PARTED, "the blocks coming loose: apart", 1)),
        (2, None, 2, (Ending.MET, "stones meeting outside their joints: together", 2)),
        (1, None, 2, (Ending.EVENT, "enough", 2)),
        (0, None, 0, (Ending.MET, "stones meeting outside their joints: together", 0)),
        (None, 1, 2, (Ending.PARTED, "the blocks coming loose: apart", 2)),
        (None, 2, 2, (Ending.MET, "stones meeting outside their joints: together", 2)),
    ],
)
def test_the_first_event_ends_a_run_within_a_batch(event, parting, meeting, said):
    """Each step has its length, the first from where the batch before ended.

    A run ends after the step of a separation, and before that of a meeting.
    """
    lengths = []

    def watch(resultants, step):
        lengths.append(step)
        return "enough" if resultants == event else None

    loosening = LooseningMonitor(
        *(
            SimpleNamespace(
                find_first=lambda batch, found=found: None if found[0] is None else found
            )
            for found in ((parting, "apart"), (meeting, "together"))
        )
    )
    batch = SimpleNamespace(times=np.array([1.1, 1.2, 1.4, 1.5]), resultants=[0, 1, 2, 3])
    assert _find_end((watch, loosening), batch, 1.0) == said
    assert lengths == pytest.approx([0.1, 0.1, 0.2, 0.1][: len(lengths)])


@pytest.mark.parametrize(("share", "count"), [(0.0199, 0), (0.0201, 1)])
def test_steps_that_missed_their_tolerance_are_doubted(share, count):
    doubts = _doubt_shortest_steps(1e-3, share)
    assert len(doubts) == count
    assert all("more than 0.001 in |e| in 2% of the run" in doubt.cause for doubt in doubts)


@pytest.mark.parametrize(("pace", "announced"), [(0.4, True), (0.01, False)])
def test_a_run_of_minutes_is_announced_after_five_seconds(
    stack, monkeypatch, caplog, pace, announced
):
    """By a clock that ticks at each look: 100 s, of which every batch of steps takes a share."""
    looks = iter(np.arange(0.0, 1e4, 30.0 * pace))
    monkeypatch.setattr("archfem.dynamics.time_history.monotonic", lambda: next(looks))
    model = af.build(stack, fidelity="rigid")
    af.time_history(model, af.Motion(np.zeros(4001), 0.005), dt=0.005)
    words = [r.getMessage() for r in caplog.records if "the run takes about" in r.getMessage()]
    assert len(words) == announced


def test_the_pace_of_a_run_is_that_of_a_hundredth_of_it(stack, monkeypatch, caplog):
    looks = iter(np.arange(0.0, 1e6, 12.0))
    monkeypatch.setattr("archfem.dynamics.time_history.monotonic", lambda: next(looks))
    model = af.build(stack, fidelity="rigid")
    af.time_history(model, af.Motion(np.zeros(4001), 0.5), dt=0.02)
    (words,) = (r for r in caplog.records if "the run takes about" in r.getMessage())
    _, done, duration, _, advice = words.args
    assert advice == ""  # a dt is given
    assert duration == 2000.0
    assert 20.0 < done < 40.0


BREADTH, HEIGHT, NORMAL, SHEAR = 0.6, 2.4, 1.48e9, 3e8
LAG = af.StiffnessDamping(0.05, 10.0)


def rocking(seed, pga, begin):
    """Return a block on an elastic joint that cannot slide, and 2.5 s of a motion."""
    contact = af.Contact(NORMAL, SHEAR, friction=None)
    block = af.column(breadth=BREADTH, heights=[HEIGHT], contact=contact)
    motion = af.Motion.synthetic(duration=10.0, pga=pga, seed=seed)
    return af.build(block, fidelity="rigid"), motion.cut(begin, begin + 2.5)


def integrate_rocking(motion, density):
    """Return the largest displacement of a corner by an own integration [m].

    The joint is a bed of springs without tension, whose gaps take their rates times the lag.
    """
    mass, lag, arm = density * BREADTH * HEIGHT, LAG.stiffness, 0.5 * HEIGHT
    inertia = mass * (BREADTH**2 + HEIGHT**2) / 12.0
    ends = -0.5 * BREADTH, 0.5 * BREADTH
    times = [motion.times(), motion.times("vertical")]
    down = -mass * af.units.G / (NORMAL * BREADTH)

    def rates(time, state):
        x, y, turn = (state[:3] + lag * state[3:]).tolist()
        first, last = ends
        if turn and first < -y / turn < last:  # closed from one end to where the gap is zero
            first, last = (first, -y / turn) if turn > 0.0 else (-y / turn, last)
        elif y > 0.0:
            first = last = 0.0
        area, static, second = last - first, (last**2 - first**2) / 2, (last**3 - first**3) / 3
        normal = -NORMAL * (y * area + turn * static)
        moment = -NORMAL * (y * static + turn * second)
        shear = -SHEAR * BREADTH * (x + arm * turn)
        ground = np.interp(time, times[0], motion.horizontal)
        upward = np.interp(time, times[1], motion.vertical)
        forces = shear / mass - ground, normal / mass - af.units.G - upward
        return *state[3:], *forces, (moment + arm * shear) / inertia

    given = {"method": "LSODA", "rtol": 1e-6, "atol": 1e-9, "max_step": 5e-3}
    done = solve_ivp(rates, (0.0, motion.duration), [0.0, down, 0.0, 0.0, 0.0, 0.0], **given)
    x, y, turn = done.y[:3]
    return max(np.hypot(x - arm * turn, y - down + a * turn).max() for a in ends)


@pytest.mark.parametrize(
    ("chosen", "off"),
    [
        ((1, 2.5, 2.0), (True, True)),
        pytest.param((5, 2.5, 1.0), (True, False), marks=pytest.mark.slow),
    ],
    ids=["all steps", "constant steps"],
)
def test_what_rocking_multiplies_is_doubted(chosen, off, verified):
    """By constant and by default steps a displacement errs by a factor of 2.5, or two fifths."""
    model, motion = rocking(*chosen)
    density = model.structure.density(model.structure.blocks[1])
    expected = integrate_rocking(motion, density)
    fine = af.time_history(model, motion, dt=2e-4, damping=LAG)
    size = fine.verdict.displacement
    assert size == pytest.approx(expected, rel=0.01)
    verified(
        f"block rocks, motion {chosen[0]}, displacement [m]", expected, "own integration", size
    )
    assert not fine.doubts
    for dt, wrong in zip((0.005, None), off, strict=True):
        run = af.time_history(model, motion, dt=dt, damping=LAG)
        size = run.verdict.displacement
        assert (abs(size / expected - 1.0) > 0.1) == wrong == bool(run.doubts)
        if wrong:
            (doubt,) = run.doubts
            assert f"change the largest displacement from {1e3 * size:.3g} mm to" in doubt.cause
            assert doubt.values[3] == pytest.approx(expected, rel=0.1)
            assert doubt.remedy.startswith(
                f"take shorter steps, `--set analysis.dt={doubt.values[0] / 1e3:g}`"
            )
            alone = af.time_history(model, motion, dt=dt, damping=LAG, record=Record(repeat=False))
            assert not alone.doubts
            assert alone.verdict.displacement == size


def test_a_repetition_that_is_stopped_or_fails_is_stated(monkeypatch):
    """Ctrl-C keeps the run; blocks that come loose by shorter steps alone are a doubt."""
    model, motion = rocking(1, 2.5, 2.0)
    monkeypatch.setattr("archfem.dynamics.time_history.follow_peaks", lambda *_: RunPeaks(None))
    (doubt,) = af.time_history(model, motion, dt=0.005, damping=LAG).doubts
    assert "with steps of 1 ms in place of 5 ms the run fails" in doubt.cause

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("archfem.dynamics.time_history.follow_peaks", stop)
    run = af.time_history(model, motion, dt=0.005, damping=LAG)
    assert run.ending is Ending.INTERRUPTED
    assert run.time[-1] == pytest.approx(2.5)
    monkeypatch.setattr("archfem.dynamics.time_history.MAX_REPEATED_SIZE", 2)
    assert not af.time_history(model, motion, dt=0.005, damping=LAG).doubts


def test_runs_of_studies_are_repeated_where_the_record_says_so():
    """Of hundreds the time would triple; `record.repeat` decides where it is given."""
    model, motion = rocking(1, 2.5, 2.0)
    for record, count in ((Record(), 0), (Record(repeat=True), 1)):
        analysis = af.Analysis(model.structure, fidelity="rigid", dt=0.005, record=record)
        runs = PreparedRuns(analysis, None, LAG)
        assert len(runs.run(motion).doubts) == count
