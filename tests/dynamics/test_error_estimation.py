"""A-posteriori errors of models and time steps, from runs whose peaks are known."""

import logging
from types import SimpleNamespace

import numpy as np
import pytest
from mechanisms import filled, piers

import archfem as af
from archfem.dynamics import error_estimation
from archfem.dynamics.error_estimation import (
    RunPeaks,
    default_damping,
    estimate_errors,
    parts_about_peaks,
    run_peaks,
    severe_motion,
    strongest_window,
)


def test_the_error_of_a_model_is_measured_on_rings_and_piers():
    model = af.build(filled(), fidelity="rigid")
    motion = af.Motion(np.array([0.0, 1.0, 0.0]), dt=0.05)
    run = af.time_history(model, motion, dt=0.01)
    own = abs(run.joints["eccentricity"]).max("time").values
    found = run_peaks(model, motion, None, 0.01)
    assert found.peaks == pytest.approx(own[: len(piers(chords=1).joints)])
    assert found.rotation == pytest.approx(float(abs(run.joints["rotation"]).max()))


def window_of(strong, length, dt=0.01):
    """The strongest part of a motion of 0.01 m/s² that is 1 m/s² between two times."""
    horizontal = np.full(round(length / dt) + 1, 0.01)
    horizontal[round(strong[0] / dt) : round(strong[1] / dt)] = -1.0
    motion = af.Motion(horizontal, dt, np.full(len(horizontal), 9.0))
    return motion, strongest_window(motion)


def test_the_strongest_part_has_six_tenths_of_the_intensity():
    """Ten even seconds give six, at any time; upward motion does not count."""
    motion, found = window_of((6.0, 16.0), 20.0)
    assert found.duration == pytest.approx(6.5, abs=0.03)
    energy = np.sum(found.horizontal[round(0.5 / found.dt) :] ** 2) / np.sum(motion.horizontal**2)
    assert energy == pytest.approx(0.6, abs=0.005)


@pytest.mark.parametrize(("strong", "start"), [((6.0, 6.1), 5.5), ((19.5, 20.0), 16.0)])
def test_the_strongest_part_has_three_and_a_half_seconds_within_the_motion(strong, start):
    """Its run starts half a second earlier."""
    motion, found = window_of(strong, 20.0)
    begin = round(start / motion.dt)
    assert found.duration == pytest.approx(4.0, abs=0.05)
    assert found.horizontal[5:-5] == pytest.approx(motion.horizontal[begin : begin + 401][5:-5])


def test_a_short_motion_is_taken_as_it_is():
    motion = af.Motion(np.array([0.0, 1.0, 0.0]), 0.01)
    assert strongest_window(motion).horizontal == pytest.approx(motion.horizontal)


@pytest.mark.parametrize(("slenderness", "known"), [(2.0, 0.4), (80.0, 0.02)])
def test_a_severe_motion_brings_the_thrust_near_the_edge(slenderness, known):
    """A block under a g has e = a H / (2 B): 0.4 at a = 0.8 B / H, but 2 % of g at least.

    Found by ten halvings of 2 g: to 2 g / 1024.
    """
    block = af.column(breadth=1.0, heights=[slenderness])
    found = severe_motion(af.build(block, fidelity="rigid"))
    assert found.pga / 9.81 == pytest.approx(known, abs=2.0 / 1024.0)
    assert known - found.pga / 9.81 >= 0.0  # the side that is not beyond
    again = af.Motion.synthetic(duration=8.0, pga=found.pga, seed=1)
    assert found.horizontal == pytest.approx(again.horizontal)


def test_usual_damping_is_five_per_cent_at_the_first_frequency():
    """A rigid block on a closed joint: sway and rocking by their two by two matrices."""
    breadth, height = 0.6, 2.4
    contact = af.Contact(1e9, 4e8)
    block = af.column(breadth=breadth, heights=[height], contact=contact)
    mass = 2e4 / 9.81 * breadth * height
    sway, arm = 4e8 * breadth, height / 2.0
    turning = 1e9 * breadth**3 / 12.0 + sway * arm**2
    stiffness = np.array([[sway, sway * arm], [sway * arm, turning]])
    inertia = np.diag([mass, mass * (breadth**2 + height**2) / 12.0])
    square = np.linalg.eigvals(np.linalg.solve(inertia, stiffness)).min()
    found = default_damping(af.build(block, fidelity="rigid"))
    assert found.ratio == 0.05
    assert found.frequency == pytest.approx(np.sqrt(square) / (2.0 * np.pi), rel=1e-9)


def runs_of(*peaks):
    """Runs of known largest |e| of two joints; None for a failed run."""
    return [RunPeaks(None if each is None else np.array([0.1, each])) for each in peaks]


def test_the_error_of_the_finest_run_is_extrapolated_at_order_two():
    """Peaks e + c h²: the errors are exactly those of the series."""
    steps = np.array([4.0, 2.0, 1.0])
    found = estimate_errors(runs_of(*(0.3 - 0.002 * steps**2)))
    assert found == pytest.approx(0.002 * steps**2)


def test_a_single_run_has_no_error_estimate():
    assert estimate_errors(runs_of(0.3)) == [np.inf]


@pytest.mark.parametrize(
    ("peaks", "known"),
    [((None, 0.3, 0.31), (True, False, False)), ((0.3, 0.31, None), (True, True, True))],
)
def test_a_failed_run_has_no_error_and_gives_none(peaks, known):
    assert list(np.isinf(estimate_errors(runs_of(*peaks)))) == list(known)


def test_a_run_that_fails_has_no_peaks(monkeypatch, stack):
    def fail(monitor):
        raise af.DidNotConverge("made to fail")

    monkeypatch.setattr(error_estimation.RunMonitor, "check_run", fail)
    model = af.build(stack, fidelity="rigid")
    assert run_peaks(model, af.Motion.synthetic(duration=0.25), None, 0.005).peaks is None


def test_parts_about_peaks_give_the_peaks_of_the_whole_run():
    """The parts have the same steps, from states on the way, and include the decisive ones."""
    model = af.build(COLUMN, fidelity="rigid")
    motion = af.Motion.synthetic(duration=6.0, pga=1.5, seed=3)
    damping = default_damping(model)
    whole = run_peaks(model, motion, damping, 0.005)
    joints = af.time_history(model, motion, damping=damping, dt=0.005).joints
    series = abs(joints["eccentricity"])
    assert whole.times == pytest.approx(joints["time"].values[series.argmax("time").values])
    parts = parts_about_peaks(whole, before=0.3, after=0.02)
    assert sum(end - start.time for start, end in parts) < 3.0
    assert run_peaks(model, motion, damping, 0.005, parts).peaks == pytest.approx(
        whole.peaks, rel=1e-9
    )


def test_parts_that_overlap_are_one():
    states = tuple(SimpleNamespace(time=0.5 * k) for k in range(12))
    run = RunPeaks(np.zeros(3), times=np.array([4.2, 1.2, 0.3]), states=states)
    found = parts_about_peaks(run, before=1.0, after=0.25)
    assert [(start.time, end) for start, end in found] == [(0.0, 1.45), (3.0, 4.45)]


COLUMN = af.column(breadth=1.0, heights=[1.0, 1.0, 1.0])


def test_a_run_whose_joints_turn_is_doubted(caplog):
    model = af.build(COLUMN, fidelity="rigid")
    motion = af.Motion.synthetic(duration=8.0, pga=3.2, seed=3)
    with caplog.at_level(logging.WARNING, "archfem"):
        run = af.time_history(model, motion, damping=default_damping(model), dt=0.0025)
    assert float(np.abs(run.joints["rotation"]).max()) > 0.01
    assert "a joint had turned by" in caplog.text
