"""Artificial accelerograms."""

import numpy as np
import pytest

import archfem as af
from archfem.motion import signal_processing


def test_a_peak_that_looks_like_a_multiple_of_g_is_named_in_both_units(caplog):
    af.Motion.synthetic(duration=5.0, pga=0.3, seed=1)
    assert "is 0.3 m/s², which is 0.0306 g: write 2.94 m/s² if it is 0.3 g" in caplog.text


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


def test_components_have_their_peaks_and_end_at_rest():
    motion = af.Motion.synthetic(duration=15.0, dt=0.01, pga=1.0, vertical_ratio=0.5, seed=2)
    assert np.abs(motion.horizontal).max() == 1.0
    assert np.abs(motion.vertical).max() == 0.5
    for component in motion.components:
        assert motion.velocity(component)[-1] == pytest.approx(0.0, abs=1e-9)
        assert motion.displacement(component)[-1] == pytest.approx(0.0, abs=1e-9)


def test_envelope_rises_stays_and_fades():
    shape = signal_processing.intensity_envelope(1001)
    assert shape[[0, 75, 150, 500]] == pytest.approx([0.0, 0.25, 1.0, 1.0])
    assert shape[[700, 1000]] == pytest.approx(np.exp([-1.0, -2.5]))


def test_the_horizontal_does_not_depend_on_the_vertical():
    options = {"duration": 5.0, "dt": 0.01, "pga": 2.0, "seed": 4}
    both, alone = (af.Motion.synthetic(vertical_ratio=ratio, **options) for ratio in (0.5, 0.0))
    assert alone.vertical is None
    assert np.array_equal(both.horizontal, alone.horizontal)
    assert np.abs(both.vertical).max() == pytest.approx(1.0)


def test_the_least_duration_and_peaks_that_are_accepted():
    """Fifty steps, a peak of a millimetre per second squared."""
    motion = af.Motion.synthetic(duration=0.5, dt=0.01, pga=1e-3, vertical_ratio=0.05)
    assert len(motion.horizontal) == 51
    assert np.abs(motion.horizontal).max() == pytest.approx(1e-3)
    assert np.abs(motion.vertical).max() == pytest.approx(5e-5)
    for given in ({"duration": 0.49}, {"pga": 0.0}, {"vertical_ratio": -0.05}):
        options = {"duration": 0.5, "dt": 0.01, "pga": 1.0, "vertical_ratio": 0.5} | given
        with pytest.raises(af.errors.InvalidInput, match="50 samples or more"):
            af.Motion.synthetic(**options)


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
    monkeypatch.setattr(np.random, "default_rng", lambda seed: Impulse)
    given = {"duration": (count - 1) * dt, "dt": dt, "pga": 1.0, "vertical_ratio": 1.0}
    found = af.Motion.synthetic(**given).component(component)
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
