"""Intensity measures of motions, against closed forms."""

import numpy as np
import pytest

import archfem as af
from archfem.motion.response_spectra import measure_intensity


def test_measures_of_a_sine_are_the_closed_forms():
    omega, duration, dt = 2.0 * np.pi * 2.0, 10.0, 0.001
    times = np.arange(0.0, duration + dt / 2, dt)
    found = measure_intensity(af.Motion(np.sin(omega * times), dt))
    # Whole periods; straight lines miss a sine by (ω dt)²/12 = 1.3e-5.
    assert found.pga == pytest.approx(1.0, rel=1e-4)
    assert found.pgv == pytest.approx(2.0 / omega, rel=1e-4)
    assert found.pgd == pytest.approx(duration / omega, rel=1e-3)
    arias = np.pi / (2 * af.units.STANDARD_GRAVITY) * duration / 2
    assert found.arias == pytest.approx(arias, rel=1e-4)
    assert found.cav == pytest.approx(2.0 / np.pi * duration, rel=1e-4)
    # Energy grows evenly but for the half periods of sin².
    assert found.significant_duration == pytest.approx(0.9 * duration, abs=0.1)
    assert found.duration == pytest.approx(duration)


@pytest.mark.parametrize("rest", [0.0, 10.0])
def test_rest_behind_a_record_adds_no_drift_to_its_displacement(rest):
    """A pulse of 1 m/s² in 1 s, which leaves 0.995 m/s, displaces the ground by t²/2 to its end."""
    times = np.arange(101) * 0.01
    pulse = af.Motion(np.ones(101), 0.01).with_rest(rest)
    assert measure_intensity(pulse).pgd == pytest.approx(0.5 * times[-1] ** 2, rel=1e-6)


def test_housner_intensity_sums_the_pseudo_velocity():
    motion = af.Motion.synthetic(seed=2, duration=8.0)
    periods = np.linspace(0.1, 2.5, 800)
    velocity = af.response_spectrum(motion, periods) * periods / (2.0 * np.pi)
    expected = np.sum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(periods))
    # 97 periods in place of 800.
    assert measure_intensity(motion).housner == pytest.approx(expected, rel=3e-3)


def test_a_motion_at_rest_measures_nothing():
    found = measure_intensity(af.Motion(np.zeros(100), 0.01))
    assert (found.pga, found.arias, found.housner, found.significant_duration) == (0, 0, 0, 0)
    with pytest.raises(af.errors.InvalidInput, match="no component 'vertical'"):
        measure_intensity(af.Motion(np.zeros(100), 0.01), "vertical")


def test_housner_intensity_goes_from_a_tenth_to_two_and_a_half_seconds(monkeypatch):
    """An even spectrum of 1 m/s² in acceleration has ∫ T / 2π dT, which trapezia give exactly."""
    even = "archfem.motion.response_spectra.response_spectrum"

    def one(motion, periods, **_):
        assert np.diff(periods) == pytest.approx(0.025)  # as the table of measures says
        return np.ones_like(periods)

    monkeypatch.setattr(even, one)
    found = measure_intensity(af.Motion(np.array([0.0, 1.0, 0.0]), 0.01))
    assert found.housner == pytest.approx((2.5**2 - 0.1**2) / (4.0 * np.pi), rel=1e-12)
