"""The energy balance that a run keeps."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.energy import Balance

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
MOTION = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3)


def test_balance_counts_what_comes_and_goes():
    balance = Balance(0.0, -10.0)
    rows = np.array([[1.0, -9.0, 2.5, 0.5], [3.0, -9.0, 2.0, 0.0]])
    assert balance.add(rows) == pytest.approx([0.0, 0.0])
    assert balance.largest == pytest.approx(4.5)
    assert balance.add(np.array([[8.0, -9.0, 0.0, 0.0]])) == pytest.approx([5.0])
    assert balance.gain == pytest.approx(4.5)


@pytest.mark.parametrize("rule", ["lobatto", "exact"])
@pytest.mark.parametrize("joints", ["closed", "initial"])
@pytest.mark.parametrize("fast", ["contact", "chain", "compliance"])
def test_all_steppers_keep_the_same_balance(ring, rule, joints, fast):
    """To the 1e-8 within which their histories agree."""
    model = af.build(ring, fidelity="faces", quadrature=rule, cells=(2, 2))
    given = {
        "damping": af.Rayleigh(0.05, (8.0, 16.0), joints),
        "newton": af.statics.Newton(tolerance=1e-13),
    }
    drifts = []
    for method in ("snes", fast):
        run = af.time_history(model, MOTION.cut(0.8, 1.8), method=method, **given)
        drifts.append(run.dataset["energy_drift"].values)
    kinetic = 0.5 * model.mass.diagonal().sum() * 0.01**2  # of the ring at 1 cm/s [J]
    assert np.abs(drifts[0]).max() > 1e-6 * kinetic
    assert np.abs(drifts[0] - drifts[1]).max() < 1e-8 * kinetic


def test_drift_falls_with_the_step(model):
    """The trapezoidal rule errs where joints open: by the second order, roughly."""
    dead = af.dead_load(model)
    worst = [
        abs(
            af.time_history(model, MOTION, start=dead, damping=DAMPING, dt=dt).dataset.attrs[
                "energy_drift"
            ]
        )
        for dt in (0.004, 0.002, 0.001)
    ]
    assert worst[0] < 0.05
    assert worst[2] < 0.5 * worst[1] < 0.4 * worst[0]


def test_balance_is_exact_while_joints_stay_closed(stack):
    """Average acceleration keeps it, with damping and with work of the ground, to a millionth."""
    model = af.build(stack, fidelity="rigid")
    for method in ("snes", "contact", "chain", "compliance"):
        run = af.time_history(model, MOTION.scaled(0.05), damping=DAMPING, method=method)
        assert run.dataset["iterations"].max() <= 1
        assert abs(run.dataset.attrs["energy_drift"]) < 1e-6


def test_a_restart_goes_on_with_its_own_balance(model):
    first = af.time_history(model, MOTION.cut(0.0, 2.0), damping=DAMPING)
    second = af.time_history(model, MOTION, damping=DAMPING, start=af.dynamics.last_state(first))
    whole = af.time_history(model, MOTION, damping=DAMPING)
    drift = whole.dataset["energy_drift"].sel(time=slice(1.999, None)).values
    scale = np.abs(drift).max()
    assert second.dataset["energy_drift"].values == pytest.approx(
        drift - drift[0], abs=1e-6 * scale
    )
