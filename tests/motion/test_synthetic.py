"""Artificial accelerograms."""

import numpy as np
import pytest

import archfem as af
from archfem.motion import signal_processing
from archfem.motion.signal_processing import generate_accelerogram, generate_enveloped_noise


def test_synthetic_motion_repeats_and_ends_at_rest():
    first, second = (af.Motion.synthetic(seed=7) for _ in range(2))
    other = af.Motion.synthetic(seed=8)
    assert np.array_equal(first.horizontal, second.horizontal)
    assert not np.array_equal(first.horizontal, other.horizontal)
    assert first.pga == pytest.approx(0.3 * af.units.STANDARD_GRAVITY)
    assert np.abs(first.vertical).max() == pytest.approx(0.2 * af.units.STANDARD_GRAVITY)
    for component in first.components:
        assert first.velocity(component)[-1] == pytest.approx(0.0, abs=1e-9)
        assert first.displacement(component)[-1] == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(af.errors.InvalidInput, match="50 samples or more"):
        af.Motion.synthetic(duration=0.1)
    with pytest.raises(af.errors.InvalidInput, match="seed of a synthetic motion = -1"):
        af.Motion.synthetic(seed=-1)


def test_a_motion_without_end_or_samples_is_refused():
    for duration in (np.inf, np.nan):
        with pytest.raises(af.errors.InvalidInput, match=r"duration .* is not a finite number"):
            af.Motion.synthetic(duration=duration)
    with pytest.raises(af.errors.InvalidInput, match="50 samples or more"):
        af.Motion.synthetic(dt=0.0)


@pytest.mark.parametrize("component", ["horizontal", "vertical"])
def test_noise_has_a_peak_of_one_and_ends_at_rest(component):
    random = np.random.default_rng(2)
    noise = generate_enveloped_noise(1500, 0.01, random=random, component=component)
    assert np.abs(noise).max() == 1.0
    motion = af.Motion(noise, 0.01)
    assert motion.velocity()[-1] == pytest.approx(0.0, abs=1e-9)
    assert motion.displacement()[-1] == pytest.approx(0.0, abs=1e-9)


def test_envelope_rises_stays_and_fades():
    shape = signal_processing.intensity_envelope(1001)
    assert shape[[0, 75, 150, 500]] == pytest.approx([0.0, 0.25, 1.0, 1.0])
    assert shape[[700, 1000]] == pytest.approx(np.exp([-1.0, -2.5]))


def test_the_horizontal_does_not_depend_on_the_vertical():
    options = {"pga": 2.0, "seed": 4}
    level, upright = generate_accelerogram(5.0, 0.01, ratio=0.5, **options)
    alone, nothing = generate_accelerogram(5.0, 0.01, ratio=0.0, **options)
    assert nothing is None
    assert np.array_equal(level, alone)
    assert np.abs(upright).max() == pytest.approx(1.0)


def test_the_least_duration_and_peaks_that_are_accepted():
    """Fifty steps, a peak of a millimetre per second squared."""
    level, upright = generate_accelerogram(0.5, 0.01, pga=1e-3, ratio=0.05, seed=0)
    assert len(level) == 51
    assert np.abs(level).max() == pytest.approx(1e-3)
    assert np.abs(upright).max() == pytest.approx(5e-5)
    for given in ({"duration": 0.49}, {"pga": 0.0}, {"ratio": -0.05}):
        options = {"duration": 0.5, "pga": 1.0, "ratio": 0.5} | given
        with pytest.raises(af.errors.InvalidInput, match="50 samples or more"):
            generate_accelerogram(options.pop("duration"), 0.01, seed=0, **options)


@pytest.mark.parametrize(("component", "ground"), [("horizontal", 15.0), ("vertical", 25.0)])
def test_noise_has_the_spectrum_of_kanai_tajimi_and_clough_and_penzien(
    component, ground, monkeypatch
):
    """The response to an impulse, from the real and imaginary parts of both filters by hand.

    Firm ground by Clough and Penzien: 15 rad/s and 60 %; the high-pass is at a tenth of that.
    """
    count, dt = 200, 0.02

    class Impulse:
        @staticmethod
        def standard_normal(size):
            assert size == 2 * count
            return np.eye(1, size)[0]

    monkeypatch.setattr(signal_processing, "correct_baseline", lambda samples, dt: samples)
    monkeypatch.setattr(signal_processing, "intensity_envelope", np.ones)
    found = generate_enveloped_noise(count, dt, random=Impulse, component=component)
    response = np.zeros(count)
    for k in range(count + 1):
        omega = 2.0 * np.pi * k / (2 * count * dt)
        s, damped = 1.0j * omega, 2.0 * 0.6
        soft, hard = 0.1 * ground, ground
        value = (hard**2 + damped * hard * s) / (hard**2 + damped * hard * s + s**2)
        value *= s**2 / (soft**2 + damped * soft * s + s**2)
        both = 1.0 if k in (0, count) else 2.0
        response += both * (value * np.exp(1.0j * np.pi * k * np.arange(count) / count)).real
    assert found == pytest.approx(response / np.abs(response).max(), abs=1e-9)
