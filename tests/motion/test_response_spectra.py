"""Response spectra against a closed form and an independent integration."""

import numpy as np
import pytest
from repeats import each_once
from scipy.integrate import solve_ivp, trapezoid

import archfem as af
from archfem.motion import response_spectra, response_spectrum, rotated_spectrum, scaled_to_spectrum

PERIODS = np.array([0.05, 0.1, 0.23, 0.4, 0.5, 0.71, 1.0, 2.0])


def harmonic_peak(period, damping, forcing, duration):
    """Largest ω²|u| of an oscillator at rest at first under sin(Ω t), from the closed form."""
    omega, driven = 2.0 * np.pi / period, 2.0 * np.pi / forcing
    ratio = driven / omega
    scale = 1.0 / ((1.0 - ratio**2) ** 2 + (2.0 * damping * ratio) ** 2)
    sine, cosine = -(1.0 - ratio**2) * scale, 2.0 * damping * ratio * scale
    damped = omega * np.sqrt(1.0 - damping**2)
    first = -cosine
    second = (damping * omega * first - driven * sine) / damped
    time = np.linspace(0.0, duration, 40_001)  # misses peaks by (ω dt)²/8: 8e-5
    steady = sine * np.sin(driven * time) + cosine * np.cos(driven * time)
    free = first * np.cos(damped * time) + second * np.sin(damped * time)
    return np.abs(steady + np.exp(-damping * omega * time) * free).max()


@pytest.mark.parametrize(("damping", "dt"), each_once((0.0, 0.02, 0.05, 0.2), (0.005, 0.02)))
def test_spectrum_of_a_sine_is_the_closed_form(damping, dt, verified):
    duration, forcing = 8.0, 0.8
    motion = af.Motion(np.sin(2.0 * np.pi / forcing * np.arange(0.0, duration + dt / 2, dt)), dt)
    exact = [harmonic_peak(period, damping, forcing, duration) for period in PERIODS]
    # At dt = 0.02 s straight lines miss the sine itself by (Ω dt)²/8 = 3e-3 of its amplitude; at
    # 0.005 s by 2e-4, below the tolerance of 1e-3.
    tolerance = 1e-3 if dt < 0.01 else 4e-3
    found = response_spectrum(motion, PERIODS, damping)
    assert found == pytest.approx(exact, rel=tolerance)
    case = f"spectrum of a sine in steps of {1e3 * dt:g} ms, damping 0 to 0.2"
    off = np.abs(found / exact - 1.0).max()
    verified(case, "equal", "closed form", "equal", difference=off)


@pytest.mark.parametrize("damping", [0.02, pytest.param(0.05, marks=pytest.mark.slow), 0.2])
def test_spectrum_is_that_of_another_library(damping, verified):
    """eqsig (Millen) steps the same exact recurrence, but takes its peaks from the samples."""
    eqsig = pytest.importorskip("eqsig")
    motion = af.Motion.synthetic(duration=6.0, seed=3)
    fine = motion.resampled(0.001)
    theirs = eqsig.AccSignal(np.array(fine.horizontal), fine.dt)
    theirs.generate_response_spectrum(response_times=PERIODS, xi=damping)
    # A peak between samples is missed by (ω dt)²/8 at most: 2e-3 of its height at 0.05 s, 5e-4 at
    # 0.1 s; found are 3e-4 and less.
    found = response_spectrum(motion, PERIODS, damping)
    assert found == pytest.approx(theirs.s_a, rel=1e-3)
    off = np.abs(found / theirs.s_a - 1.0).max()
    verified("spectrum of a motion, damping 0.02 to 0.2", "equal", "eqsig", "equal", difference=off)


@pytest.mark.parametrize(
    "period", [*(pytest.param(each, marks=pytest.mark.slow) for each in (0.05, 0.3)), 1.7]
)
def test_spectrum_is_that_of_an_independent_integration(period):
    motion = af.Motion.synthetic(duration=1.5, seed=3)
    omega = 2.0 * np.pi / period

    def rate(time, state):
        ground = np.interp(time, motion.times(), motion.horizontal)
        return [state[1], -(omega**2) * state[0] - 0.1 * omega * state[1] - ground]

    path = solve_ivp(
        rate,
        (0.0, 1.5),
        (0.0, 0.0),
        t_eval=np.linspace(0.0, 1.5, 10_001),
        max_step=motion.dt,
        rtol=1e-6,
        atol=1e-9,
    )
    expected = omega**2 * np.abs(path.y[0]).max()
    # The largest of many samples, 300 a period and more: 5e-5 below the peak.
    assert float(response_spectrum(motion, period)) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("turned", [0.0, 40.0])
def test_a_pulse_swings_the_oscillator_most_after_its_end(turned, verified):
    """A constant acceleration over 0.2 s: 2 a sin(π d/T) without damping, for T above 0.4 s."""
    line = af.Motion(np.full(41, 1.5), 0.005)
    periods = np.array([0.41, 0.7, 2.0, 8.0, 1e4])
    exact = 3.0 * np.sin(np.pi * 0.2 / periods)
    angle = np.radians(turned)
    pair = af.Motion(np.cos(angle) * line.horizontal, line.dt)
    pair = pair.with_transverse(af.Motion(np.sin(angle) * line.horizontal, line.dt))
    for found in (
        response_spectrum(line, periods, 0.0),
        rotated_spectrum(pair, periods, 100.0, 0.0),
    ):
        assert found == pytest.approx(exact, rel=1e-7)
    verified("spectrum of a pulse that ends at once", exact[2], "closed form", found[2])


def test_free_vibration_after_a_half_sine_counts_wherever_a_spectrum_is_used():
    """A pulse of 3 m/s² over 0.25 s, integrated by quadrature of Duhamel's integral."""
    dt, length = 0.005, 0.25
    motion = af.Motion(3.0 * np.sin(np.pi * np.arange(51) * dt / length), dt)
    periods, damping = np.array([1.0, 2.0, 4.0]), 0.05
    fine = np.linspace(0.0, length, 20_001)
    ground = np.interp(fine, motion.times(), motion.horizontal)
    exact = []
    for omega in 2.0 * np.pi / periods:
        damped = omega * np.sqrt(1.0 - damping**2)
        # u(t) = exp(-ζ ω t) (s sin ω_d t - c cos ω_d t) after the pulse
        growth = np.exp(damping * omega * fine) * ground / damped
        c, s = (trapezoid(growth * f(damped * fine), fine) for f in (np.sin, np.cos))
        after = np.linspace(length, length + 2.0 * np.pi / omega, 100_001)
        free = s * np.sin(damped * after) - c * np.cos(damped * after)
        exact.append(omega**2 * np.abs(np.exp(-damping * omega * after) * free).max())
    assert exact == pytest.approx([2.620, 1.369, 0.692], abs=5e-4)
    assert response_spectrum(motion, periods) == pytest.approx(exact, rel=1e-6)
    assert scaled_to_spectrum(motion, 1.0, 1.0).pga == pytest.approx(3.0 / exact[0], rel=1e-6)
    # of a motion that is followed for 3 s more, parabolas through samples miss peaks by 2e-6
    followed = af.Motion(np.append(motion.horizontal, np.zeros(600)), dt)
    housner = [response_spectra.measure_intensity(each).housner for each in (motion, followed)]
    assert housner[0] == pytest.approx(housner[1], rel=1e-5)


def test_spectrum_begins_at_the_peak_acceleration():
    motion = af.Motion.synthetic(seed=5, duration=8.0)
    spectrum = response_spectrum(motion, [0.0, 1e-5, 1e-3])
    # A rigid oscillator follows the ground; at 1 ms it does to a few in a thousand.
    assert spectrum == pytest.approx(motion.pga, rel=5e-3)
    assert spectrum[0] == motion.pga
    assert response_spectrum(motion, 0.3).shape == ()


def test_spectrum_does_not_depend_on_how_finely_the_motion_is_sampled():
    motion = af.Motion.synthetic(seed=5, duration=8.0, dt=0.02)
    coarse, fine = (
        response_spectrum(shaking, PERIODS) for shaking in (motion, motion.resampled(0.001))
    )
    # The same straight lines; the difference is in peaks between samples.
    assert coarse == pytest.approx(fine, rel=1e-4)


def test_spectrum_counts_the_acceleration_of_the_first_sample():
    # A step of 1 m/s² on an undamped oscillator: exactly twice the static response.
    motion = af.Motion(np.ones(2001), 0.001)
    assert float(response_spectrum(motion, 0.4, 0.0)) == pytest.approx(2.0, rel=1e-6)


def test_vertical_spectrum_and_refusals():
    motion = af.Motion.synthetic(seed=1, duration=5.0)
    upright = af.Motion(motion.vertical, motion.dt)
    assert response_spectrum(motion, PERIODS, component="vertical") == pytest.approx(
        response_spectrum(upright, PERIODS)
    )
    with pytest.raises(af.errors.InvalidInput, match="no component 'vertical'"):
        response_spectrum(upright, PERIODS, component="vertical")
    with pytest.raises(af.errors.InvalidInput, match="from 0 s upwards"):
        response_spectrum(motion, [-0.1])
    with pytest.raises(af.errors.InvalidInput, match="damping ratio"):
        response_spectrum(motion, 0.1, 5.0)


def test_scaling_to_a_spectral_value():
    motion = scaled_to_spectrum(af.Motion.synthetic(seed=1, duration=5.0), 6.0, 0.4)
    assert float(response_spectrum(motion, 0.4)) == pytest.approx(6.0)
    with pytest.raises(af.errors.InvalidInput, match="must be > 0"):
        scaled_to_spectrum(motion, 0.0, 0.4)


def test_rotd_of_a_pair_along_a_line_is_that_of_the_line(verified):
    """In the direction θ the response is that of the line times |cos(θ - 40°)|."""
    along = af.Motion.synthetic(duration=6.0, seed=2, vertical_ratio=0.0)
    turned = np.radians(40.0)
    across = af.Motion(np.sin(turned) * along.horizontal, along.dt)
    pair = af.Motion(np.cos(turned) * along.horizontal, along.dt).with_transverse(across)
    periods = np.array([0.0, *PERIODS])
    line = response_spectrum(along, periods)
    largest, median = (rotated_spectrum(pair, periods, share) for share in (100.0, 50.0))
    # 40° is among the directions; the median of |cos| over whole degrees is that of 45°
    assert largest == pytest.approx(line, rel=1e-12)
    assert median == pytest.approx(line / np.sqrt(2.0), rel=1e-12)
    ratio = float(np.mean(median / largest))
    verified("RotD50 over RotD100 of a pair along a line", 0.5**0.5, "closed form", ratio)


@pytest.mark.parametrize(("samples", "period"), [(5, 1.0), (27, 1.01), (27, 0.02 / 600.0)])
def test_rotd_refines_a_peak_between_its_neighbours_as_a_spectrum_does(samples, period):
    """A step of acceleration, whose largest answer is the last sample, the last but one, a first.

    It is largest after half a period. A rigid oscillator is followed in a thousand parts of a step,
    here of 0.6 of its period each.
    """
    line = af.Motion(np.ones(samples), 0.02)
    turned = np.radians(40.0)
    across = af.Motion(np.sin(turned) * line.horizontal, line.dt)
    pair = af.Motion(np.cos(turned) * line.horizontal, line.dt).with_transverse(across)
    expected = float(response_spectrum(line, period))
    found = float(rotated_spectrum(pair, period, 100.0))
    assert found == pytest.approx(expected, rel=1e-9)


def test_rotd_of_a_pair_at_rest_is_zero():
    rest = af.Motion(np.zeros(9), 0.01)
    assert rotated_spectrum(rest.with_transverse(rest), [0.0, 0.3]).tolist() == [0.0, 0.0]


def test_rotd_of_a_circular_pair_is_the_same_in_all_directions():
    """The amplitude of a steady response under a rotating acceleration, for each direction."""
    forcing, peak, dt = 0.5, 2.0, 0.004
    time = np.arange(0.0, 50.0, dt)
    # a smooth start and end over 40 turns leave no free vibrations, within or after the motion
    ramp = np.clip(np.minimum(time, 50.0 - time) / 20.0, 0.0, 1.0)
    ramp = peak * np.sin(0.5 * np.pi * ramp) ** 2
    angle = 2.0 * np.pi * time / forcing
    pair = af.Motion(ramp * np.cos(angle), dt).with_transverse(af.Motion(ramp * np.sin(angle), dt))
    periods = np.array([0.0, 0.2, 0.5, 1.0])
    ratio = periods / forcing
    exact = peak / np.sqrt((1.0 - ratio**2) ** 2 + (0.1 * ratio) ** 2)
    # straight lines between 125 samples of a turn miss the circle by 3e-4
    for share in (0.0, 50.0, 100.0):
        assert rotated_spectrum(pair, periods, share) == pytest.approx(exact, rel=1e-3)


def test_rotd_is_the_percentile_over_rotated_motions():
    """The accelerations are turned, where the function turns the responses."""
    pair = af.Motion.synthetic(duration=4.0, seed=5, vertical_ratio=0.0)
    pair = pair.with_transverse(af.Motion.synthetic(duration=3.0, seed=6, vertical_ratio=0.0))
    periods = np.array([0.0, 0.1, 0.5])
    turned = [response_spectrum(pair.rotated(f"{k} degree"), periods) for k in range(180)]
    for share in (0.0, 50.0, 100.0):
        expected = np.percentile(turned, share, axis=0)
        assert rotated_spectrum(pair, periods, share) == pytest.approx(expected, rel=1e-9)
    with pytest.raises(af.InvalidInput, match="no component 'transverse'"):
        rotated_spectrum(af.Motion(np.ones(9), 0.01), 0.1)
    with pytest.raises(af.InvalidInput, match="percentile of directions = 101"):
        rotated_spectrum(pair, 0.1, 101.0)
