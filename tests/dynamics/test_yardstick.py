"""By how much errors in the strongest part of a motion are enlarged before they are promised."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.yardstick import Steps, Yardstick


@pytest.fixture
def yardstick(monkeypatch):
    """Of peaks that are known: 0.3 by the finest model, 0.29 in half the steps, 0.26 by another."""

    def peaks(model, motion, damping, dt, **given):
        return np.array([0.1, 0.26 if model == "other" else 0.30 if dt == 0.01 else 0.29])

    monkeypatch.setattr("archfem.dynamics.yardstick.peaks", peaks)
    monkeypatch.setattr("archfem.dynamics.yardstick.dead_load", lambda model: None)
    return Yardstick("finest", af.Motion(np.zeros(5), 0.01), None)


def test_errors_are_one_and_a_half_times_what_is_seen(yardstick):
    """In time that is 4/3 of what half the step changes: a scheme of second order has erred so."""
    steps = Steps(0.01, None)
    assert yardstick.in_time(steps) == pytest.approx(1.5 * 4.0 / 3.0 * 0.01)
    assert yardstick.in_model("other", steps) == pytest.approx(1.5 * 0.04)
