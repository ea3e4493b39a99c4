"""Validity checks of a run, and its energy balance."""

import logging
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from glued import glued
from repeats import each_once

import archfem as af
from archfem.dynamics.monitor import EnergyBalance, RunMonitor

MOTION = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3)


@pytest.fixture(scope="module")
def whole(ring):
    """The ring whose joints never slide, for schemes that make or lose energy."""
    return af.build(glued(ring), fidelity="rigid")


def test_energy_from_nowhere_ends_a_run(whole):
    """Undamped under average acceleration impacts feed the highest modes: e = 0.5, 3 m away."""
    with pytest.raises(af.DidNotConverge, match=r"been gained without work.*or damping") as caught:
        af.time_history(whole, MOTION, dt=0.005, scheme=af.dynamics.Newmark())
    history = caught.value.history
    assert history.outcome.startswith("failed at")
    assert history.dataset.attrs["energy_drift"] > 0.5
    assert caught.value.last.time < history.time[-1] < 4.0


def test_drift_is_reported_once(whole, caplog):
    with caplog.at_level(logging.WARNING, "archfem"):
        run = af.time_history(whole, MOTION, dt=0.005, scheme=af.HHT(-0.1))
    messages = [record.message for record in caplog.records if "energy drifts" in record.message]
    assert len(messages) == 1
    assert "lost to the scheme; compare with" in messages[0]
    assert run.dataset.attrs["energy_drift"] < -0.05
    assert [doubt for doubt in run.doubts if "energy drifts" in doubt.cause]
    assert f"in doubt: {run.doubts[0]}" in str(run.verdict)


@pytest.mark.parametrize("damps", [False, True])
def test_energy_is_judged_at_every_step_however_many_come_at_once(ring, damps):
    """Energy that appears without work and vanishes again, or the reverse, within a batch."""
    model = af.build(ring, fidelity="rigid")
    dead = af.dead_load(model)
    state = af.dynamics.State(0.0, dead.q, *np.zeros((2, model.size)))
    seen = model.observer().read(dead.q)

    def batch(*kinetic):
        rows = np.zeros((len(kinetic), 4))
        rows[:, 0] = kinetic
        rows[:, 2] = np.diff(kinetic, prepend=0.0)
        rows[3:5, 2] += (came, -came)
        none, numbers = np.zeros((len(kinetic), 18, 3)), np.arange(1.0, len(kinetic) + 1.0)
        return af.dynamics.Batch(numbers, none, 1 + 0 * numbers, numbers, rows, lambda _: state)

    for came, word in (
        (-6e5, "been gained without work"),
        (3e6, "been lost to the scheme"),
        (-4e5, None),
    ):
        whole = batch(*(1e6 + 0.0 * np.arange(8.0)))
        for size in (1, 3, 8):
            guard = RunMonitor(model, replace(whole.cut(1), energy=np.zeros((1, 4))), damps=damps)
            said = None
            for first in range(0, 8, size):
                part = slice(first, first + size)
                some = replace(whole, times=whole.times[part], energy=whole.energy[part])
                guard.add(some, np.array([seen] * len(some.times)))
                try:
                    guard.check_run()
                except af.DidNotConverge as error:
                    said = str(error)
                    break
            if word is None or (damps and came > 0.0):
                assert said is None
                assert any("energy drifts: by t = 4 s" in doubt.cause for doubt in guard.doubts)
            else:
                assert said.startswith("by t = 4 s")
                assert word in said


def test_all_steppers_are_refused_with_the_same_text(whole):
    """The run gains energy; compiled steps arrive by 128, those of SNES one by one."""
    said, strong = [], MOTION.cut(0.5, 4.0).scaled(4.0)
    for method in ("snes", "compliance"):
        given = {"scheme": af.dynamics.Newmark(), "method": method, "dt": 0.005}
        with pytest.raises(af.DidNotConverge) as caught:
            af.time_history(whole, strong, **given)
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
    moved = run.verdict.displacement
    assert moved == pytest.approx(9.81 * 0.384**2, rel=0.01)
    longer = af.Motion(np.zeros(501), 0.002, np.full(501, -3.0 * 9.81))
    with pytest.raises(af.DidNotConverge, match=r"it has fallen apart.*until=CountedMechanism"):
        af.time_history(model, longer, dt=0.005)


@pytest.mark.parametrize("method", ["snes", "newton", "compliance"])
@pytest.mark.parametrize("scheme", [af.dynamics.Conserving(), af.dynamics.Newmark()])
def test_numbers_that_overflow_end_in_an_error(method, scheme):
    """An impossible state, in the stiffest joint."""
    slides = scheme == af.dynamics.Conserving()
    stiff = af.Contact(1e16, 1e16, friction=0.6 if slides else None)
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
    state, rows = af.dynamics.State(0.0, 0.0 * q, *np.zeros((2, model.size))), np.array([energy])
    none, one = np.zeros((1, len(model.structure.joints), 3)), np.array([1.0])
    start = af.dynamics.Batch(one, none, 1 + 0 * one, one, np.zeros((1, 4)), lambda _: state)
    guard = RunMonitor(model, start, damps=damps)
    seen = np.array([model.observer().read(q)])
    guard.add(replace(start, energy=rows), seen)
    return guard


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_drift_is_doubted_from_a_twentieth_on_and_wrong_from_a_half(stack, side):
    """Two per cent to either side of each; kinetic energy is the largest exchanged."""
    model = af.build(stack, fidelity="rigid")
    for share, doubted in ((0.049, False), (0.051, True), (0.49, True)):
        work, lost = (1e6 * (1.0 - share), 0.0) if side > 0.0 else (1e6, -1e6 * share)
        guard = looked(model, energy=(1e6, 0.0, work, lost))
        guard.check_run()
        assert guard.worst_drift == pytest.approx(side * share)
        assert bool(guard.doubts) is doubted
    guard = looked(model, energy=(1e6, 0.0, *((0.49e6, 0.0) if side > 0.0 else (1e6, -0.51e6))))
    with pytest.raises(af.DidNotConverge, match=r"51% of the energy had been (gained|lost)"):
        guard.check_run()


def test_turns_and_moves_are_doubted_where_they_are_no_longer_small(stack):
    """A joint that turns by 0.01, blocks that move by a joint's depth, or by all their size."""
    model = af.build(stack, fidelity="rigid")
    size = model.structure.size
    for turn, said in ((0.0098, []), (-0.0098, []), (0.0102, ["turn"]), (-0.0102, ["turn"])):
        guard = looked(model, [0, 0, 0, 0, 0, turn])
        guard.check_run()
        assert guard.largest_turn == pytest.approx(abs(turn))
        assert ["turn" for doubt in guard.doubts if "a joint had turned by" in doubt.cause] == said
    for far, doubted in ((0.99, False), (1.01, True), (0.99 * size, True)):
        guard = looked(model, [0, far, 0, 0, far, 0])
        guard.check_run()
        assert guard.largest_displacement == pytest.approx(far)
        assert (
            any("more than a joint is deep, 1 m" in doubt.cause for doubt in guard.doubts)
            is doubted
        )
    with pytest.raises(af.DidNotConverge, match="it has fallen apart"):
        looked(model, [0, 1.01 * size, 0, 0, 1.01 * size, 0]).check_run()


@pytest.mark.parametrize(("slip", "doubted"), [(0.098, False), (0.102, True), (0.98, True)])
def test_facets_that_slid_past_each_other_are_doubted(stack, monkeypatch, slip, doubted):
    model = af.build(stack, fidelity="rigid", displacements="large")
    monkeypatch.setattr(type(model), "face_mismatch", lambda self, q: (slip, "joint 1"))
    guard = looked(model)
    guard.check_run()
    assert (
        any("had slid by" in doubt.cause and "'joint 1'" in doubt.cause for doubt in guard.doubts)
        is doubted
    )
    assert all("cells=(1, 1) of cell='triangle'" in doubt.remedy for doubt in guard.doubts)
    # stones that are rigid already cannot be made coarser
    assert not any("for stones" in doubt.remedy for doubt in guard.doubts)
    monkeypatch.setattr(model, "fidelity", "backfill: full, rest: condensed")
    fine = looked(model)
    fine.check_run()
    assert any("for stones" in doubt.remedy for doubt in fine.doubts) is doubted
    monkeypatch.setattr(model, "fidelity", "backfill: full, rest: rigid")
    fine = looked(model)
    fine.check_run()
    assert not any("for stones" in doubt.remedy for doubt in fine.doubts)
    monkeypatch.setattr(type(model), "face_mismatch", lambda self, q: (1.02, "joint 1"))
    with pytest.raises(af.DidNotConverge, match=r"'joint 1' had slid by 1 of a facet"):
        looked(model).check_run()


@pytest.mark.parametrize(("tension", "doubted"), [(5.7e3, False), (5.9e3, True)])
def test_tension_that_soil_does_not_bear_is_doubted(stack, monkeypatch, tension, doubted):
    """Mohr's circle of uniaxial tension σ touches the limit of 30° and 5 kPa at 5 kPa · 2 / √3."""
    monkeypatch.setattr(
        "archfem.dynamics.monitor.observe_fill_tension", lambda model: lambda q: tension
    )
    guard = looked(af.build(stack, fidelity="rigid", displacements="large"))
    guard.check_run()
    assert guard.fill_tension[0] == tension
    assert any("kPa of tension" in doubt.cause for doubt in guard.doubts) is doubted


def test_a_run_states_the_largest_tension_of_its_fill():
    """That of the recorded fields, at every second step."""
    arch = af.shapes.Arch(span=5.0, rise=1.2, thickness=0.4, voussoirs=9)
    bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.3), width=3.0)
    model = af.build(bridge, fidelity={"backfill": "full", "rest": "rigid"}, cells=(2, 2))
    record = af.dynamics.Record(fields_every=2)
    run = af.time_history(model, MOTION.cut(0.0, 0.5), dt=0.005, damping="effective", record=record)
    use = af.statics.strength_use_over(model, run.dataset)
    fill = use.isel(block=use["part"].values == "backfill")
    tension, time = (float(fill[name].item()) for name in ("tension", "tension_time"))
    assert 0.0 < tension == pytest.approx(run.dataset.attrs["fill_tension"], rel=1e-9)
    words = (
        f"largest tension in elastic fill {tension / 1e3:.3g} kPa, at {time:.3f} s: soil has none"
    )
    assert words in run.verdict.remarks


def test_every_step_of_a_batch_counts_for_displacements(stack, monkeypatch):
    """Facets, if any are paired, are checked at every 32nd step alone: the first, and the 33rd."""
    model = af.build(stack, fidelity="rigid", displacements="large")
    monkeypatch.setattr(type(model), "face_mismatch", lambda self, q: (0.0, "joint 1"))
    observer, far = model.observer(), np.array([0.0, 0.3, 0.0, 0.0, 0.4, 0.0])
    guard = looked(model)
    evaluated = []

    def state(k):
        evaluated.append(k)
        return af.dynamics.State(0.0, np.zeros(model.size), *np.zeros((2, model.size)))

    count = 40
    none, times = np.zeros((count, len(stack.joints), 3)), np.arange(2.0, 2.0 + count)
    rows = np.zeros((count, 4))
    steps = af.dynamics.Batch(times, none, 0 * times, times, rows, state)
    path = np.minimum(np.arange(count), count - 1 - np.arange(count)) / 19.0
    guard.add(steps, np.array([observer.read(share * far) for share in path]))
    displacements = guard.displacements
    assert displacements.largest == pytest.approx([0.3, 0.4])
    assert displacements.residual == pytest.approx([0.0, 0.0])
    assert displacements.time == pytest.approx([21.0, 21.0])  # the first of two equal steps
    assert evaluated[0] == 31  # the 33rd of all, since one had come before


DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
SHAKING = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3)
NEWMARK, CONSERVING = af.dynamics.Newmark(), af.dynamics.Conserving()
WAYS = [(scheme, method) for scheme in (NEWMARK, CONSERVING) for method in ("newton", "compliance")]
"""Schemes, and compiled methods."""


def test_the_balance_counts_energy_gained_and_lost():
    balance = EnergyBalance(0.0, -10.0)
    rows = np.array([[1.0, -9.0, 2.5, 0.5], [3.0, -9.0, 2.0, 0.0]])
    assert balance.add(rows)[0] == pytest.approx([0.0, 0.0])
    assert balance.largest_exchange == pytest.approx(4.5)
    drift, fractions = balance.add(np.array([[8.0, -9.0, 0.0, 0.0], [3.0, -9.0, 0.0, 0.0]]))
    assert drift == pytest.approx([5.0, 0.0])
    assert fractions == pytest.approx([5.0 / 9.0, 0.0])  # of the energy exchanged until then


def test_drift_is_relative_to_a_least_exchanged_energy():
    """The least exchange is a thousandth of the 10 J under self-weight."""
    _, fractions = EnergyBalance(0.0, -10.0).add(np.array([[1e-4, -10.0, 0.0, 0.0]]))
    assert fractions == pytest.approx([0.01])


@cache
def drift_by(method, ring, rule, joints, scheme):
    """The drift of a run of the ring, whose joints slide where the scheme allows, and its model."""
    structure = ring if scheme == CONSERVING else glued(ring)
    model = af.build(structure, fidelity="faces", quadrature=rule, cells=(2, 2))
    given = {
        "dt": 0.005,
        "scheme": scheme,
        "damping": af.Rayleigh(0.05, (8.0, 16.0), joints),
        "newton": af.statics.Newton(tolerance=1e-13),
    }
    run = af.time_history(model, SHAKING.cut(1.2, 1.26), method=method, **given)
    return run.dataset["energy_drift"].values, model


@pytest.mark.parametrize(
    ("way", "rule", "joints"), each_once(WAYS, ("lobatto", "exact"), ("closed", "initial"))
)
def test_all_steppers_keep_the_same_balance(ring, way, rule, joints):
    """Balances agree to 1e-8, as histories do; by the conserving scheme without drift."""
    scheme, fast = way
    slow, model = drift_by("snes", ring, rule, joints, scheme)
    quick, _ = drift_by(fast, ring, rule, joints, scheme)
    kinetic = 0.5 * model.mass.diagonal().sum() * 0.01**2  # of the ring at 1 cm/s [J]
    assert (np.abs(slow).max() > 1e-6 * kinetic) == (scheme != CONSERVING)
    assert np.abs(slow - quick).max() < 1e-8 * kinetic


def test_drift_falls_with_the_step(ring):
    """The trapezoidal rule errs where joints open: by the second order, roughly."""
    model = af.build(glued(ring), fidelity="rigid")
    given = {"start": af.dead_load(model), "damping": DAMPING, "scheme": NEWMARK}
    runs = (af.time_history(model, SHAKING, dt=dt, **given) for dt in (0.004, 0.002, 0.001))
    worst = [abs(run.dataset.attrs["energy_drift"]) for run in runs]
    assert worst[0] < 0.05
    assert worst[2] < 0.5 * worst[1] < 0.4 * worst[0]


@pytest.mark.parametrize(
    ("scheme", "method"),
    [*WAYS, *(pytest.param(s, "snes", marks=pytest.mark.slow) for s in (NEWMARK, CONSERVING))],
    ids=str,
)
def test_balance_is_exact_while_joints_stay_closed(stack, scheme, method):
    """Average acceleration keeps it, with damping and with work of the ground, to a millionth."""
    model = af.build(stack if scheme == CONSERVING else glued(stack), fidelity="rigid")
    given = {"damping": DAMPING, "scheme": scheme, "method": method, "dt": 0.005}
    run = af.time_history(model, SHAKING.cut(1.0, 1.4).scaled(0.05), **given)
    assert run.dataset["iterations"].max() <= 1
    assert abs(run.dataset.attrs["energy_drift"]) < 1e-6


def test_a_restart_continues_with_its_own_balance(ring):
    """By a scheme with an energy balance."""
    model = af.build(glued(ring), fidelity="rigid")
    given = {"damping": DAMPING, "scheme": NEWMARK, "dt": 0.005}
    first = af.time_history(model, SHAKING.cut(0.0, 2.0), **given)
    second = af.time_history(model, SHAKING, start=af.dynamics.last_state(first), **given)
    whole = af.time_history(model, SHAKING, **given)
    drift = whole.dataset["energy_drift"].sel(time=slice(1.999, None)).values
    scale = np.abs(drift).max()
    assert second.dataset["energy_drift"].values == pytest.approx(
        drift - drift[0], abs=1e-6 * scale
    )
