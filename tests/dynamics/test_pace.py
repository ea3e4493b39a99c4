"""Steps whose length an error in the eccentricity chooses."""

import numpy as np
import pytest

import archfem as af

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
FINE = 1.5625e-4
"""A fixed step at which largest eccentricities no longer change by 1e-4 [s]."""


@pytest.fixture(scope="module")
def ring():
    """A ring whose joints open and slide, and its dead load."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=9)
    model = af.build(ring, fidelity="rigid", cells=(2, 2))
    return model, af.dead_load(model)


def peaks(run):
    """Largest |e| of every joint; an open joint counts as hinged."""
    e = run.joints["eccentricity"].values
    return np.abs(np.where(np.isnan(e), 0.5, e)).max(axis=0)


@pytest.mark.parametrize("seed", [3, pytest.param(5, marks=pytest.mark.slow)])
def test_steps_err_by_no_more_than_the_tolerance(ring, seed):
    model, dead = ring
    motion = af.Motion.synthetic(duration=2.0, pga=2.5, seed=seed)
    wanted = peaks(af.time_history(model, motion, dt=FINE, start=dead, damping=DAMPING))
    for tolerance in (0.02, 0.005):
        run = af.time_history(model, motion, tolerance=tolerance, start=dead, damping=DAMPING)
        assert run.dataset.attrs["tolerance"] == tolerance
        assert np.abs(peaks(run) - wanted).max() <= tolerance
        assert run.time[-1] == pytest.approx(motion.duration, abs=1e-9)


def test_steps_are_long_at_rest_and_short_in_an_impact(ring):
    model, dead = ring
    shaking = af.Motion.synthetic(duration=1.0, pga=4.0, seed=3)
    quiet = np.zeros(2 * len(shaking.horizontal))
    motion = af.Motion(np.concatenate([quiet, shaking.horizontal]), shaking.dt)
    run = af.time_history(model, motion, start=dead, damping=DAMPING)
    steps = np.diff(run.time)
    still = run.time[1:] < 0.9 * len(quiet) * shaking.dt
    assert steps[still].max() >= 0.5 * 2e-2
    assert 1e-4 / 1.5 <= steps[~still].min() < 0.1 * 2e-2
    assert run.dataset.attrs["shortest_step"] == pytest.approx(steps.min())


@pytest.mark.slow
def test_snes_and_solvers_take_the_same_steps(ring):
    model, dead = ring
    motion = af.Motion.synthetic(duration=4.0, pga=2.5, seed=2).cut(1.0, 1.1)
    one, other = (
        af.time_history(model, motion, start=dead, damping=DAMPING, method=method)
        for method in ("snes", "newton")
    )
    assert np.abs(np.interp(one.time, other.time, other.joints["M"].values[:, 0])).max() > 0.0
    np.testing.assert_allclose(peaks(one), peaks(other), atol=0.005)


@pytest.mark.slow
def test_a_run_to_the_plain_call_keeps_its_energy(ring):
    """Undamped, through impacts: the drift is that of the solves, not of the steps."""
    model, _ = ring
    motion = af.Motion.synthetic(duration=0.8, pga=4.0, seed=3)
    run = af.time_history(model, motion)
    assert run.ending == "finished"
    assert abs(run.dataset.attrs["energy_drift"]) < 1e-6
    assert run.dataset.attrs["tolerance_unmet"] <= 0.05


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"dt": 0.005, "tolerance": 0.01}, "give one of both"),
        ({"tolerance": 0.0}, "between 0 and 1"),
        ({"tolerance": float("nan")}, "nan is not between 0 and 1"),
    ],
)
def test_invalid_input_is_refused(ring, options, words):
    model, dead = ring
    with pytest.raises(af.InvalidInput, match=words):
        af.time_history(model, af.Motion(np.zeros(10), 0.01), start=dead, **options)
