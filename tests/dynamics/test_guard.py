"""What is said of runs that are doubtful, and what ends those that are wrong."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from glued import glued

import archfem as af
from archfem.dynamics.guard import Guard

MOTION = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3)


@pytest.fixture(scope="module")
def whole(ring):
    """The ring whose joints never slide, for schemes that make or lose energy."""
    return af.build(glued(ring), fidelity="rigid")


def test_energy_from_nowhere_ends_a_run(whole):
    """Undamped under average acceleration impacts feed the highest modes: e = 0.5, 3 m away."""
    with pytest.raises(af.DidNotConverge, match=r"come from nowhere.*or damping") as caught:
        af.time_history(whole, MOTION, dt=0.005, scheme=af.dynamics.Newmark())
    history = caught.value.history
    assert history.outcome.startswith("failed at")
    assert history.dataset.attrs["energy_drift"] > 0.5
    assert caught.value.last.time < history.time[-1] < 4.0


def test_drift_is_told_once(whole, caplog):
    with caplog.at_level(logging.WARNING, "archfem"):
        run = af.time_history(whole, MOTION, dt=0.005, scheme=af.HHT(-0.1))
    told = [record.message for record in caplog.records if "energy drifts" in record.message]
    assert len(told) == 1
    assert "lost to the scheme; compare with" in told[0]
    assert run.dataset.attrs["energy_drift"] < -0.05
    assert [words for words in run.doubts if "energy drifts" in words]
    assert run.verdict.startswith(f"in doubt: {run.doubts[0]}")


@pytest.mark.parametrize("damps", [False, True])
def test_energy_is_judged_at_every_step_however_many_come_at_once(ring, damps):
    """Energy that comes from nowhere and goes again, or the other way round, within a batch."""
    model = af.build(ring, fidelity="rigid")
    dead = af.dead_load(model)
    state = af.dynamics.State(0.0, dead.q, *np.zeros((2, model.size)))
    seen = af.models.Gauges.on(model).read(dead.q)

    def batch(*kinetic):
        rows = np.zeros((len(kinetic), 4))
        rows[:, 0] = kinetic
        rows[:, 2] = np.diff(kinetic, prepend=0.0)
        rows[3:5, 2] += (came, -came)
        none, numbers = np.zeros((len(kinetic), 18, 3)), np.arange(1.0, len(kinetic) + 1.0)
        return af.dynamics.Batch(numbers, none, 1 + 0 * numbers, numbers, rows, lambda _: state)

    for came, word in ((-6e5, "come from nowhere"), (3e6, "gone nowhere"), (-4e5, None)):
        whole = batch(*(1e6 + 0.0 * np.arange(8.0)))
        for size in (1, 3, 8):
            guard = Guard(model, replace(whole.cut(1), energy=np.zeros((1, 4))), damps=damps)
            said = None
            for first in range(0, 8, size):
                part = slice(first, first + size)
                some = replace(whole, times=whole.times[part], energy=whole.energy[part])
                guard.add(some, np.array([seen] * len(some.times)))
                try:
                    guard.judge()
                except af.DidNotConverge as error:
                    said = str(error)
                    break
            if word is None or (damps and came > 0.0):
                assert said is None
                assert any("energy drifts: by t = 4 s" in words for words in guard.doubts)
            else:
                assert said.startswith("by t = 4 s")
                assert word in said


def test_all_steppers_are_refused_alike(whole):
    """Of a run that makes energy: compiled steps come by 128, those of SNES one by one."""
    said = []
    for method in ("snes", "compliance"):
        with pytest.raises(af.DidNotConverge) as caught:
            af.time_history(whole, MOTION, dt=0.005, scheme=af.dynamics.Newmark(), method=method)
        said.append(str(caught.value))
    assert said[0] == said[1]


def test_displacements_that_are_not_small(stack, caplog):
    """Ground that drops at 3 g lets go of its blocks, which then are farther than small."""
    model = af.build(stack, fidelity="rigid")
    down = af.Motion(np.zeros(97), 0.004, np.full(97, -3.0 * 9.81))
    with caplog.at_level(logging.WARNING, "archfem"):
        run = af.time_history(model, down, dt=0.004)
    assert "beyond the small displacements" in caplog.text
    # relative to the ground they rise at 2 g, 96 steps of 4 ms long
    moved = run.dataset.attrs["largest_displacement"]
    assert moved == pytest.approx(9.81 * 0.384**2, rel=0.01)
    longer = af.Motion(np.zeros(501), 0.002, np.full(501, -3.0 * 9.81))
    with pytest.raises(af.DidNotConverge, match=r"it has fallen apart.*until=CountedMechanism"):
        af.time_history(model, longer, dt=0.005)


@pytest.mark.parametrize("method", ["snes", "contact", "chain", "compliance"])
def test_numbers_that_overflow_end_in_an_error(method):
    """A state that cannot be meant, in a joint as stiff as can be."""
    slides = method != "chain"
    stiff = af.Contact(1e16, 1e16, friction=0.6 if slides else None)
    scheme = af.dynamics.Conserving() if slides else af.dynamics.Newmark()
    model = af.build(af.column(breadth=1.0, heights=[1.0], contact=stiff), fidelity="rigid")
    state = af.dynamics.State(0.0, np.zeros(3), np.array([0.0, 1e200, 0.0]), np.zeros(3))
    with (
        np.errstate(all="ignore"),
        pytest.raises(af.DidNotConverge, match="not numbers any more") as caught,
    ):
        af.time_history(model, MOTION, start=state, method=method, scheme=scheme, dt=0.005)
    assert caught.value.history.outcome.startswith("failed at 0 s")


def looked(model, q=None, energy=(0.0, 0.0, 0.0, 0.0), damps=False):
    """A guard that has seen a step of a megajoule to some state, and energies beside it."""
    q = np.zeros(model.size) if q is None else np.asarray(q, dtype=float)
    state, rows = af.dynamics.State(0.0, q, *np.zeros((2, model.size))), np.array([energy])
    none, one = np.zeros((1, len(model.structure.joints), 3)), np.array([1.0])
    start = af.dynamics.Batch(one, none, 1 + 0 * one, one, np.zeros((1, 4)), lambda _: state)
    guard = Guard(model, start, damps=damps)
    seen = np.array([af.models.Gauges.on(model).read(q)])
    guard.add(replace(start, energy=rows), seen)
    return guard


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_drift_is_doubted_from_a_twentieth_on_and_wrong_from_a_half(stack, side):
    """Two per cent to either side of each; kinetic energy is the largest exchanged."""
    model = af.build(stack, fidelity="rigid")
    for share, doubted in ((0.049, False), (0.051, True), (0.49, True)):
        work, lost = (1e6 * (1.0 - share), 0.0) if side > 0.0 else (1e6, -1e6 * share)
        guard = looked(model, energy=(1e6, 0.0, work, lost))
        guard.judge()
        assert guard.worst == pytest.approx(side * share)
        assert bool(guard.doubts) is doubted
    guard = looked(model, energy=(1e6, 0.0, *((0.49e6, 0.0) if side > 0.0 else (1e6, -0.51e6))))
    with pytest.raises(af.DidNotConverge, match=r"51% of the energy had (come from|gone) nowhere"):
        guard.judge()


def test_turns_and_moves_are_doubted_where_they_are_no_longer_small(stack):
    """A joint that turns by 0.01, blocks that move by a joint's depth, or by all their size."""
    model = af.build(stack, fidelity="rigid")
    size = model.structure.size
    for turn, said in ((0.0098, []), (-0.0098, []), (0.0102, ["turn"]), (-0.0102, ["turn"])):
        guard = looked(model, [0, 0, 0, 0, 0, turn])
        guard.judge()
        assert guard.largest_turn == pytest.approx(abs(turn))
        assert ["turn" for words in guard.doubts if "a joint had turned by" in words] == said
    for far, doubted in ((0.99, False), (1.01, True), (0.99 * size, True)):
        guard = looked(model, [0, far, 0, 0, far, 0])
        guard.judge()
        assert guard.largest_displacement == pytest.approx(far)
        assert any("more than a joint is deep, 1 m" in words for words in guard.doubts) is doubted
    with pytest.raises(af.DidNotConverge, match="it has fallen apart"):
        looked(model, [0, 1.01 * size, 0, 0, 1.01 * size, 0]).judge()


@pytest.mark.parametrize(("slip", "doubted"), [(0.098, False), (0.102, True), (0.98, True)])
def test_facets_that_slid_past_each_other_are_doubted(stack, monkeypatch, slip, doubted):
    model = af.build(stack, fidelity="rigid", displacements="large")
    monkeypatch.setattr(type(model), "mismatch", lambda self, q: (slip, "joint 1"))
    guard = looked(model)
    guard.judge()
    assert any("had slid by" in words and "'joint 1'" in words for words in guard.doubts) is doubted
    monkeypatch.setattr(type(model), "mismatch", lambda self, q: (1.02, "joint 1"))
    with pytest.raises(af.DidNotConverge, match=r"'joint 1' had slid by 1 of a facet"):
        looked(model).judge()


def test_between_looks_the_middles_of_blocks_are_watched(stack):
    """Every 32nd step all points are looked at: the first, and the 33rd."""
    model = af.build(stack, fidelity="rigid")
    gauges, far = af.models.Gauges.on(model), np.array([0.0, 0.3, 0.0, 0.0, 0.4, 0.0])
    guard = looked(model)
    asked = []

    def state(k):
        asked.append(k)
        return af.dynamics.State(0.0, np.zeros(model.size), *np.zeros((2, model.size)))

    count = 40
    none, times = np.zeros((count, len(stack.joints), 3)), np.arange(2.0, 2.0 + count)
    rows = np.zeros((count, 4))
    steps = af.dynamics.Batch(times, none, 0 * times, times, rows, state)
    readings = np.array([gauges.read(k / (count - 1.0) * far) for k in range(count)])
    guard.add(steps, readings)
    assert guard.largest_displacement == pytest.approx(0.4)
    assert asked[0] == 31  # the 33rd of all, since one had come before
    assert set(asked[1:]) == {count - 1}
