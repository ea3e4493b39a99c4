"""Batches of steps by a strategy, and what it leaves to SNES."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.stepping.loop import ITERATIONS, advance
from archfem.dynamics.stepping.modal import Modal
from archfem.dynamics.stepping.stepper import Stepper

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
MOTION = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3)


@pytest.mark.parametrize("rule", ["lobatto", "exact"])
def test_contact_stepper_falls_back(ring, rule):
    """With one pass allowed, every step that opens or closes a point is left to SNES."""
    model = af.build(ring, fidelity="rigid", quadrature=rule)
    newton, short = af.statics.Newton(tolerance=1e-13), MOTION.cut(0.8, 1.8)
    equation = af.dynamics.Equation(model, short, DAMPING)
    solves = af.dynamics.Exact(equation, newton)
    exact = af.time_history(model, short, newton=newton, method=Stepper(equation, exact=solves))
    stepper = Stepper(equation, Modal.of(equation), exact=solves, advance=_one_pass)
    run = af.time_history(model, short, newton=newton, method=stepper)
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
