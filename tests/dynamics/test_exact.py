"""Steps solved by SNES, and the fallback where one fails."""

import numpy as np
import pytest
from glued import glued

import archfem as af


def test_a_step_that_fails_is_halved(model, motion, breaking):
    short = motion.cut(0.0, 0.25)
    stepper = breaking(model, short, lambda time, dt: 0.2 < time < 0.21 and dt > 0.002)
    found = af.time_history(model, short, dt=0.005, method=stepper)
    smallest = found.dataset["smallest_step"].values
    assert smallest.min() == pytest.approx(0.00125)
    assert found.time[-1] == pytest.approx(0.25)


@pytest.mark.slow
def test_balance_of_a_step_taken_in_halves(ring, breaking):
    """Work and loss of both halves count."""
    model, newmark = af.build(glued(ring), fidelity="rigid"), af.dynamics.Newmark()
    short = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3).cut(1.0, 1.1)
    damping = af.Rayleigh(0.05, (8.0, 16.0))
    given = {"damping": damping, "scheme": newmark, "method": "snes"}
    fine = af.time_history(model, short, dt=0.0025, **given)
    stepper = breaking(model, short, lambda _, dt: dt > 0.003, scheme=newmark)
    halved = af.time_history(model, short, dt=0.005, method=stepper)
    assert halved.dataset.attrs["halved_steps"] == 20
    drift = fine.dataset["energy_drift"].values[::2]
    scale = np.abs(drift).max()
    assert halved.dataset["energy_drift"].values == pytest.approx(drift, abs=1e-3 * scale)


def test_a_step_taken_in_halves_makes_no_energy(model, breaking):
    """Halves also lose no energy, though joints open and slide; both keep the memory of joints."""
    short = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3).cut(1.0, 1.1)
    damping = af.Rayleigh(0.05, (8.0, 16.0))
    fine = af.time_history(model, short, dt=0.0025, damping=damping)
    stepper = breaking(model, short, lambda _, dt: dt > 0.003)
    halved = af.time_history(model, short, dt=0.005, method=stepper)
    assert halved.dataset.attrs["halved_steps"] == 20
    assert np.abs(halved.dataset["energy_drift"]).max() < 1e-5  # of a joule, where tens go round
    slips = fine.joints["slip"].values[::2]
    assert np.ptp(slips, axis=0).max() > 1e-5
    assert halved.joints["slip"].values == pytest.approx(slips, abs=1e-4 * np.abs(slips).max())
