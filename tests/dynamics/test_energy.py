"""The energy balance that a run keeps."""

from functools import cache

import numpy as np
import pytest
from glued import glued

import archfem as af
from archfem.dynamics.energy import Balance

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
MOTION = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3)
NEWMARK, CONSERVING = af.dynamics.Newmark(), af.dynamics.Conserving()
WAYS = [
    *((NEWMARK, method) for method in ("contact", "chain", "compliance")),
    *((CONSERVING, method) for method in ("contact", "compliance")),
]
"""Schemes, and the compiled methods that know them."""


def test_balance_counts_what_comes_and_goes():
    balance = Balance(0.0, -10.0)
    rows = np.array([[1.0, -9.0, 2.5, 0.5], [3.0, -9.0, 2.0, 0.0]])
    assert balance.add(rows)[0] == pytest.approx([0.0, 0.0])
    assert balance.largest == pytest.approx(4.5)
    drift, fractions = balance.add(np.array([[8.0, -9.0, 0.0, 0.0], [3.0, -9.0, 0.0, 0.0]]))
    assert drift == pytest.approx([5.0, 0.0])
    assert fractions == pytest.approx([5.0 / 9.0, 0.0])  # of what was exchanged until then


def test_what_is_as_good_as_nothing_is_not_judged():
    """Of 10 J under self-weight a hundredth of a joule is exchanged at least."""
    _, fractions = Balance(0.0, -10.0).add(np.array([[1e-4, -10.0, 0.0, 0.0]]))
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
    run = af.time_history(model, MOTION.cut(1.2, 1.6), method=method, **given)
    return run.dataset["energy_drift"].values, model


@pytest.mark.parametrize(
    ("rule", "joints"),
    [
        ("lobatto", "closed"),
        ("exact", "initial"),
        pytest.param("lobatto", "initial", marks=pytest.mark.slow),
        pytest.param("exact", "closed", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize(("scheme", "fast"), WAYS)
def test_all_steppers_keep_the_same_balance(ring, rule, joints, scheme, fast):
    """To the 1e-8 within which their histories agree; by the conserving scheme without drift."""
    slow, model = drift_by("snes", ring, rule, joints, scheme)
    quick, _ = drift_by(fast, ring, rule, joints, scheme)
    kinetic = 0.5 * model.mass.diagonal().sum() * 0.01**2  # of the ring at 1 cm/s [J]
    assert (np.abs(slow).max() > 1e-6 * kinetic) == (scheme != CONSERVING)
    assert np.abs(slow - quick).max() < 1e-8 * kinetic


def test_drift_falls_with_the_step(ring):
    """The trapezoidal rule errs where joints open: by the second order, roughly."""
    model = af.build(glued(ring), fidelity="rigid")
    given = {"start": af.dead_load(model), "damping": DAMPING, "scheme": NEWMARK}
    runs = (af.time_history(model, MOTION, dt=dt, **given) for dt in (0.004, 0.002, 0.001))
    worst = [abs(run.dataset.attrs["energy_drift"]) for run in runs]
    assert worst[0] < 0.05
    assert worst[2] < 0.5 * worst[1] < 0.4 * worst[0]


@pytest.mark.parametrize(
    ("scheme", "method"), [(NEWMARK, "snes"), (CONSERVING, "snes"), *WAYS], ids=str
)
def test_balance_is_exact_while_joints_stay_closed(stack, scheme, method):
    """Average acceleration keeps it, with damping and with work of the ground, to a millionth."""
    model = af.build(stack if scheme == CONSERVING else glued(stack), fidelity="rigid")
    given = {"damping": DAMPING, "scheme": scheme, "method": method, "dt": 0.005}
    run = af.time_history(model, MOTION.cut(1.0, 2.0).scaled(0.05), **given)
    assert run.dataset["iterations"].max() <= 1
    assert abs(run.dataset.attrs["energy_drift"]) < 1e-6


def test_a_restart_goes_on_with_its_own_balance(ring):
    """Of a scheme that has one to tell."""
    model = af.build(glued(ring), fidelity="rigid")
    given = {"damping": DAMPING, "scheme": NEWMARK, "dt": 0.005}
    first = af.time_history(model, MOTION.cut(0.0, 2.0), **given)
    second = af.time_history(model, MOTION, start=af.dynamics.last_state(first), **given)
    whole = af.time_history(model, MOTION, **given)
    drift = whole.dataset["energy_drift"].sel(time=slice(1.999, None)).values
    scale = np.abs(drift).max()
    assert second.dataset["energy_drift"].values == pytest.approx(
        drift - drift[0], abs=1e-6 * scale
    )
