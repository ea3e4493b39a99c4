"""A damped oscillator under a sampled ground acceleration, against closed forms."""

import numpy as np
import pytest

import archfem as af
from archfem.motion import response_spectra

STEP = np.ones(2001)  # m/s², from the first sample on
DT = 0.001  # s


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.3])
def test_displacement_under_a_step_is_the_closed_form(damping):
    omega = 2.0 * np.pi / 0.4
    damped = omega * np.sqrt(1.0 - damping**2)
    times = np.arange(len(STEP)) * DT
    swing = np.cos(damped * times) + damping * omega / damped * np.sin(damped * times)
    exact = -(1.0 - np.exp(-damping * omega * times) * swing) / omega**2
    # The recurrence is exact for a constant: round-off over 2000 steps.
    found = response_spectra.oscillator_displacement(STEP, DT, 0.4, damping)
    assert found == pytest.approx(exact, abs=1e-10 / omega**2 * len(STEP))


def test_peak_has_its_sign_and_its_time():
    periods = np.array([0.4, 1.0])
    values, times = response_spectra.find_peak_responses(-STEP[:1001], DT, periods, 0.3)
    # The first swing is the largest; it overshoots by exp(-π ζ/√(1-ζ²)) after half a damped period.
    damped = np.sqrt(1.0 - 0.3**2)
    assert values == pytest.approx(-(1.0 + np.exp(-np.pi * 0.3 / damped)), rel=1e-6)
    assert times == pytest.approx(0.5 * periods / damped, rel=1e-4)


@pytest.mark.parametrize("period", [5e-324, 1e-300, 1e-12])
def test_a_nearly_rigid_oscillator_follows_the_ground_too(period):
    samples = np.array([0.0, 1.0, -3.0, 2.0])
    values, times = response_spectra.find_peak_responses(samples, 0.1, np.array([period]), 0.05)
    assert (values.tolist(), times.tolist()) == ([-3.0], [0.2])


def test_rigid_oscillator_follows_the_ground():
    samples = np.array([0.0, 1.0, -3.0, 2.0])
    values, times = response_spectra.find_peak_responses(samples, 0.1, np.zeros(1), 0.05)
    assert (values[0], times[0]) == (-3.0, pytest.approx(0.2))


def test_interpolation_keeps_the_samples_and_the_straight_lines():
    fine = response_spectra.interpolate_steps(np.array([0.0, 4.0, 2.0]), 4)
    assert fine == pytest.approx([0.0, 1.0, 2.0, 3.0, 4.0, 3.5, 3.0, 2.5, 2.0])


@pytest.mark.parametrize(
    ("periods", "damping", "message"),
    [
        ([-0.1], 0.05, "from 0 s upwards"),
        ([np.nan], 0.05, "from 0 s upwards"),
        ([np.inf], 0.05, "from 0 s upwards"),
        ([0.1], 1.0, "damping ratio .* = 1.0 is not"),
        ([0.1], -0.01, "damping ratio .* = -0.01 is not"),
        ([0.1], np.nan, r"damping ratio \[-\] = nan"),
    ],
)
def test_invalid_periods_and_damping_are_refused(periods, damping, message):
    with pytest.raises(af.errors.InvalidInput, match=message):
        response_spectra.find_peak_responses(STEP, DT, np.array(periods), damping)


@pytest.mark.parametrize(
    ("period", "parts"), [(0.4, 1), (0.39, 2), (0.2, 2), (0.05, 8), (4e-4, 1000), (3e-4, 1000)]
)
def test_an_oscillation_has_forty_samples_up_to_a_thousand_a_step(period, parts, monkeypatch):
    """A record in steps of 10 ms is divided into no more parts than necessary."""
    calls = []

    def displacement(samples, dt, period, damping):
        calls.append((len(samples), dt))
        return np.ones(len(samples))

    monkeypatch.setattr(response_spectra, "oscillator_displacement", displacement)
    response_spectra.find_peak_responses(np.ones(5), 0.01, np.array([period]), 0.05)
    assert calls == [(4 * parts + 1, pytest.approx(0.01 / parts))]


def test_the_top_of_a_parabola_through_three_samples():
    """a - b (t - t₀)², sampled beside its top, of either sense; a flat row, and one that grows."""
    for sense in (-1.0, 1.0):
        row = sense * (3.0 - 0.2 * (np.arange(7) - 3.3) ** 2)
        peak, place = response_spectra._find_parabola_peak(row)
        assert (peak, place) == (pytest.approx(3.0 * sense), pytest.approx(3.3))
    assert response_spectra._find_parabola_peak(np.array([0.0, 1.0, 1.0, 1.0, 0.0])) == (
        pytest.approx(1.125),
        pytest.approx(1.5),
    )
    assert response_spectra._find_parabola_peak(np.array([1.0, 2.0, 4.0])) == (4.0, 2.0)
