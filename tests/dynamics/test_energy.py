"""The energy balance that a run keeps, and what it says when the balance fails."""

import logging

import numpy as np
import pytest

from archfem.dynamics.energy import Balance
from archfem.dynamics.ladder import build
from archfem.dynamics.schemes import HHT, Rayleigh
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.exact import Exact
from archfem.dynamics.stepping.loop import ITERATIONS, advance
from archfem.dynamics.stepping.modal import Modal
from archfem.dynamics.stepping.stepper import Stepper
from archfem.dynamics.steps import State
from archfem.dynamics.time_history import Record, last_state, time_history
from archfem.errors import DidNotConverge
from archfem.masonry.materials import Contact
from archfem.masonry.shapes import column
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import dead_load
from archfem.statics.newton import Newton

DAMPING = Rayleigh(0.05, (8.0, 16.0))
MOTION = Motion.synthetic(duration=4.0, pga=2.0, seed=3)


@pytest.fixture(scope="module")
def model(ring):
    return build(ring, fidelity="rigid")


@pytest.mark.parametrize("rule", ["lobatto", "exact"])
@pytest.mark.parametrize("joints", ["closed", "initial"])
@pytest.mark.parametrize("fast", ["contact", "chain", "compliance"])
def test_all_steppers_keep_the_same_balance(ring, rule, joints, fast):
    """To the 1e-8 within which their histories agree."""
    model = build(ring, fidelity="faces", quadrature=rule, cells=(2, 2))
    given = {"damping": Rayleigh(0.05, (8.0, 16.0), joints), "newton": Newton(tolerance=1e-13)}
    drifts = []
    for method in ("snes", fast):
        run = time_history(model, MOTION.cut(0.8, 1.8), method=method, **given)
        drifts.append(run.dataset["energy_drift"].values)
    kinetic = 0.5 * model.mass.diagonal().sum() * 0.01**2  # of the ring at 1 cm/s [J]
    assert np.abs(drifts[0]).max() > 1e-6 * kinetic
    assert np.abs(drifts[0] - drifts[1]).max() < 1e-8 * kinetic


def test_drift_falls_with_the_step(model):
    """The trapezoidal rule errs where joints open: by the second order, roughly."""
    dead = dead_load(model)
    worst = [
        abs(
            time_history(model, MOTION, start=dead, damping=DAMPING, dt=dt).dataset.attrs[
                "energy_drift"
            ]
        )
        for dt in (0.004, 0.002, 0.001)
    ]
    assert worst[0] < 0.05
    assert worst[2] < 0.5 * worst[1] < 0.4 * worst[0]


def test_balance_is_exact_while_joints_stay_closed(stack):
    """Average acceleration keeps it, with damping and with work of the ground, to a millionth."""
    model = build(stack, fidelity="rigid")
    for method in ("snes", "contact", "chain", "compliance"):
        run = time_history(model, MOTION.scaled(0.05), damping=DAMPING, method=method)
        assert run.dataset["iterations"].max() <= 1
        assert abs(run.dataset.attrs["energy_drift"]) < 1e-6


def test_energy_from_nowhere_ends_a_run(model):
    """Undamped under average acceleration impacts feed the highest modes: e = 0.5, 3 m away."""
    with pytest.raises(DidNotConverge, match=r"come from nowhere.*use damping") as caught:
        time_history(model, MOTION)
    history = caught.value.history
    assert history.outcome.startswith("failed at")
    assert history.dataset.attrs["energy_drift"] > 0.5
    assert caught.value.last.time < history.time[-1] < 4.0


def test_drift_is_told_once(model, caplog):
    with caplog.at_level(logging.WARNING, "archfem"):
        run = time_history(model, MOTION, scheme=HHT(-0.1))
    told = [record.message for record in caplog.records if "energy drifts" in record.message]
    assert len(told) == 1
    assert "lost to the scheme; compare with a smaller dt" in told[0]
    assert run.dataset.attrs["energy_drift"] < -0.05


def test_displacements_that_are_not_small(stack, caplog):
    """Ground that drops at 3 g lets go of its blocks, which then are farther than small."""
    model = build(stack, fidelity="rigid")
    down = Motion(np.zeros(97), 0.004, np.full(97, -3.0 * 9.81))
    with caplog.at_level(logging.WARNING, "archfem"):
        run = time_history(model, down, dt=0.004)
    assert "beyond the small displacements" in caplog.text
    # relative to the ground they rise at 2 g, 96 steps of 4 ms long
    moved = run.dataset.attrs["largest_displacement"]
    assert moved == pytest.approx(9.81 * 0.384**2, rel=0.01)
    longer = Motion(np.zeros(501), 0.002, np.full(501, -3.0 * 9.81))
    with pytest.raises(DidNotConverge, match=r"it has fallen apart.*until=CountedMechanism"):
        time_history(model, longer)


def test_balance_of_a_step_taken_in_halves(model):
    """Work and loss of both halves count."""
    equation = Equation(model, MOTION.cut(0.0, 1.0), DAMPING)
    real = Exact(equation)

    def failing(state, dt):
        if dt > 0.003:
            raise DidNotConverge("made to fail")
        return real.attempt(state, dt)

    fine = time_history(model, MOTION.cut(0.0, 1.0), damping=DAMPING, dt=0.0025, method="snes")
    stepper = Stepper(equation, exact=Exact(equation, attempts=failing))
    halved = time_history(model, MOTION.cut(0.0, 1.0), method=stepper)
    assert halved.dataset.attrs["halved_steps"] == 200
    drift = fine.dataset["energy_drift"].values[::2]
    scale = np.abs(drift).max()
    assert halved.dataset["energy_drift"].values == pytest.approx(drift, abs=1e-3 * scale)


@pytest.mark.parametrize("rule", ["lobatto", "exact"])
def test_contact_stepper_falls_back(ring, rule):
    """With one pass allowed, every step that opens or closes a point is left to SNES."""
    model = build(ring, fidelity="rigid", quadrature=rule)
    newton, short = Newton(tolerance=1e-13), MOTION.cut(0.8, 1.8)
    equation = Equation(model, short, DAMPING)
    solves = Exact(equation, newton)
    exact = time_history(model, short, newton=newton, method=Stepper(equation, exact=solves))
    stepper = Stepper(equation, Modal.of(equation), exact=solves, advance=_one_pass)
    run = time_history(model, short, newton=newton, method=stepper)
    assert run.dataset.attrs["fallback_steps"] > 10
    assert exact.dataset.attrs["fallback_steps"] == 0
    assert run.dataset["iterations"].max() > ITERATIONS
    off = np.abs(run.joints["M"] - exact.joints["M"]).max()
    assert off < 1e-8 * np.abs(exact.joints["M"]).max()
    drift = run.dataset["energy_drift"] - exact.dataset["energy_drift"]
    assert np.abs(drift).max() < 1e-6 * np.abs(exact.dataset["energy_drift"]).max()


def _one_pass(series, results, ground, system):
    """Stop before the first step that took more than one pass."""
    count = advance(series, results, ground, system)
    many = np.flatnonzero(results[1][:count] > 1)
    return int(many[0]) if len(many) else count


def test_effort_between_records_is_kept(model):
    every = time_history(model, MOTION, damping=DAMPING)
    third = time_history(model, MOTION, damping=DAMPING, record=Record(every=4))
    assert third.dataset["iterations"].sum() == every.dataset["iterations"].sum()
    drift = every.dataset["energy_drift"].values[::4]
    assert third.dataset["energy_drift"].values == pytest.approx(drift, rel=1e-12)


def test_numbers_that_overflow_end_in_an_error():
    """A state that cannot be meant, in a joint as stiff as can be."""
    stiff = Contact(1e16, 1e16)
    model = build(column(breadth=1.0, heights=[1.0], contact=stiff), fidelity="rigid")
    state = State(0.0, np.zeros(3), np.array([0.0, 1e200, 0.0]), np.zeros(3))
    for method in ("snes", "contact", "chain", "compliance"):
        with (
            np.errstate(all="ignore"),
            pytest.raises(DidNotConverge, match="not numbers any more") as caught,
        ):
            time_history(model, MOTION, start=state, method=method)
        assert caught.value.history.outcome.startswith("failed at 0 s")


def test_a_restart_goes_on_with_its_own_balance(model):
    first = time_history(model, MOTION.cut(0.0, 2.0), damping=DAMPING)
    second = time_history(model, MOTION, damping=DAMPING, start=last_state(first))
    whole = time_history(model, MOTION, damping=DAMPING)
    drift = whole.dataset["energy_drift"].sel(time=slice(1.999, None)).values
    scale = np.abs(drift).max()
    assert second.dataset["energy_drift"].values == pytest.approx(
        drift - drift[0], abs=1e-6 * scale
    )


def test_balance_counts_what_comes_and_goes():
    balance = Balance(0.0, -10.0)
    rows = np.array([[1.0, -9.0, 2.5, 0.5], [3.0, -9.0, 2.0, 0.0]])
    assert balance.add(rows) == pytest.approx([0.0, 0.0])
    assert balance.largest == pytest.approx(4.5)
    assert balance.add(np.array([[8.0, -9.0, 0.0, 0.0]])) == pytest.approx([5.0])
    assert balance.gain == pytest.approx(4.5)
