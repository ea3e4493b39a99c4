"""`Motion` and what is done to its components."""

import numpy as np
import pytest

from archfem.errors import InvalidInput
from archfem.motion import Motion
from archfem.units import STANDARD_GRAVITY


def sine(frequency=2.0, duration=4.0, dt=0.01, amplitude=1.0):
    return amplitude * np.sin(2.0 * np.pi * frequency * np.arange(0.0, duration + dt / 2.0, dt))


@pytest.fixture(scope="module")
def shaking():
    return Motion.synthetic(duration=10.0, pga=3.0, seed=4)


def test_components_keep_their_own_lengths():
    motion = Motion(sine(), 0.01, vertical=sine()[:100], name="short vertical")
    assert len(motion.horizontal) == 401
    assert len(motion.vertical) == 100
    assert motion.duration == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("samples", "dt", "message"),
    [
        ([], 0.01, "one row of finite numbers"),
        ([0.0, np.nan], 0.01, "one row of finite numbers"),
        ([0.0, np.inf], 0.01, "one row of finite numbers"),
        ([[0.0, 1.0]], 0.01, "one row of finite numbers"),
        (["fast"], 0.01, "not a row of numbers"),
        (None, 0.01, "one row of finite numbers"),
        ([0.0, 1.0], 0.0, "positive number"),
        ([0.0, 1.0], -0.01, "positive number"),
        ([0.0, 1.0], np.nan, "positive number"),
        ([0.0, 1.0], "0.01", "positive number"),
        ([0.0, 5.01 * STANDARD_GRAVITY], 0.01, "wrong unit"),
    ],
)
def test_what_is_no_motion_is_refused(samples, dt, message):
    with pytest.raises(InvalidInput, match=message):
        Motion(samples, dt)


def test_vertical_of_nearly_two_g_is_a_motion():
    motion = Motion([0.0, 1.0], 0.01, vertical=[0.0, 1.9 * STANDARD_GRAVITY])
    assert np.abs(motion.vertical).max() == 1.9 * STANDARD_GRAVITY


def test_samples_cannot_be_changed_from_outside():
    samples = np.array([0.0, 1.0])
    motion = Motion(samples, 0.01)
    samples[1] = 7.0
    assert motion.pga == 1.0
    with pytest.raises(ValueError, match="read-only"):
        motion.horizontal[0] = 3.0


def test_at_is_straight_between_samples_and_zero_outside():
    motion = Motion([1.0, 3.0, -1.0], 0.1, vertical=[2.0, 4.0])
    values = motion.at(np.array([-0.01, 0.0, 0.05, 0.15, 0.2, 0.21]))
    expected = [[0, 0], [1, 2], [2, 3], [1, 0], [-1, 0], [0, 0]]
    assert values == pytest.approx(np.array(expected, dtype=float), abs=1e-12)


def test_the_last_instant_summed_up_in_steps_is_inside():
    motion = Motion(sine(frequency=0.3), 0.01)
    late = sum([0.01] * 400)
    assert late != motion.duration
    assert motion.at(late)[0, 0] == pytest.approx(motion.horizontal[-1], rel=1e-6)
    assert Motion([2.0], 0.01).at(0.0)[0, 0] == 2.0


def test_scaling_acts_on_all_components(shaking):
    half = shaking.scaled(-0.5)
    assert half.pga == pytest.approx(1.5)
    assert half.vertical == pytest.approx(-0.5 * shaking.vertical)
    assert shaking.scaled_to_pga(2.0).pga == pytest.approx(2.0)
    with pytest.raises(InvalidInput, match="must be > 0"):
        Motion(np.zeros(3), 0.01).scaled_to_pga(1.0)


def test_cut_keeps_both_ends(shaking):
    part = shaking.cut(2.0, 5.0)
    assert part.duration == pytest.approx(3.0)
    assert part.horizontal[[0, -1]] == pytest.approx(shaking.horizontal[[400, 1000]])
    assert shaking.cut(4.0).duration == pytest.approx(6.0)


def test_cut_after_the_end_of_a_component_leaves_it_at_zero():
    part = Motion(sine(), 0.01, vertical=sine()[:100]).cut(2.0, 3.0)
    assert part.at(part.times())[:, 1] == pytest.approx(0.0)
    with pytest.raises(InvalidInput, match="nothing of the 4 s is left"):
        Motion(sine(), 0.01).cut(5.0, 6.0)


@pytest.mark.parametrize("dt", [0.0025, 0.0013, 0.007, 0.02])
def test_resampling_keeps_the_peaks(shaking, dt):
    again = shaking.resampled(dt)
    assert again.dt == dt
    assert again.horizontal.max() == shaking.horizontal.max()
    assert again.horizontal.min() == shaking.horizontal.min()
    assert again.duration == pytest.approx(shaking.duration, abs=dt)


def test_refining_by_a_whole_number_keeps_the_motion(shaking):
    times = np.linspace(0.0, 10.0, 777)
    # Straight lines between the same points: equal to round-off.
    assert shaking.resampled(0.001).at(times) == pytest.approx(shaking.at(times), abs=1e-9)


def test_integrals_of_a_sine_match_the_closed_form():
    omega, dt = 2.0 * np.pi, 0.001
    times = np.arange(4001) * dt
    motion = Motion(np.sin(omega * times), dt)
    # Straight lines between samples miss a sine by (ω dt)²/12 = 3e-6 of its amplitude.
    exact_velocity = (1.0 - np.cos(omega * times)) / omega
    assert motion.velocity() == pytest.approx(exact_velocity, abs=1e-5)
    exact = (times - np.sin(omega * times) / omega) / omega
    assert motion.displacement() == pytest.approx(exact, abs=1e-5)


def test_baseline_correction_takes_out_an_offset_and_a_slope(shaking):
    times = shaking.times()
    drifting = Motion(shaking.horizontal + 0.05 + 0.01 * times, shaking.dt)
    corrected = drifting.baseline_corrected()
    assert abs(drifting.displacement()[-1]) > 3.0
    # The ends are conditions of the fit: zero to round-off.
    assert corrected.velocity()[-1] == pytest.approx(0.0, abs=1e-10)
    assert corrected.displacement()[-1] == pytest.approx(0.0, abs=1e-10)
    # The polynomial also takes a little of the motion's own slow displacement.
    assert np.abs(corrected.horizontal - shaking.horizontal).max() < 0.05 * shaking.pga


def test_band_pass_keeps_what_lies_inside_and_drops_what_lies_outside():
    slow, middle, fast = (sine(f, duration=40.0) for f in (0.05, 2.0, 30.0))
    passed = Motion(slow + middle + fast, 0.01).band_passed(0.5, 10.0)
    inner = slice(1000, 3000)
    # Fourth order both ways: 2 Hz is kept to 1e-3, 30 Hz and 0.05 Hz fall below 1e-3.
    assert passed.horizontal[inner] == pytest.approx(middle[inner], abs=3e-3)
    with pytest.raises(InvalidInput, match="band from"):
        passed.band_passed(0.5, 60.0)


def test_rotation_keeps_energy_and_turns_back(shaking):
    both = Motion(shaking.horizontal, shaking.dt, transverse=shaking.vertical)
    turned = both.rotated(0.7)
    energy = both.horizontal**2 + both.transverse**2
    assert turned.horizontal**2 + turned.transverse**2 == pytest.approx(energy)
    assert turned.rotated(-0.7).horizontal == pytest.approx(both.horizontal)
    with pytest.raises(InvalidInput, match="no component 'transverse'"):
        shaking.rotated(0.1)


def test_significant_duration_holds_nine_tenths_of_the_energy(shaking):
    part = shaking.significant()
    share = np.sum(part.horizontal**2) / np.sum(shaking.horizontal**2)
    # One sample more or less at each end.
    assert share == pytest.approx(0.9, abs=0.01)
    with pytest.raises(InvalidInput, match="a motion that moves"):
        Motion(np.zeros(9), 0.01).significant()


def test_vertical_comes_from_another_motion(shaking):
    level = Motion(sine(), 0.01)
    assert level.with_vertical(Motion(sine()[:50], 0.01)).vertical == pytest.approx(sine()[:50])
    with pytest.raises(InvalidInput, match=r"step of 0\.005 s"):
        level.with_vertical(shaking)


def test_synthetic_motion_repeats_and_ends_at_rest():
    first, second = (Motion.synthetic(seed=7) for _ in range(2))
    other = Motion.synthetic(seed=8)
    assert np.array_equal(first.horizontal, second.horizontal)
    assert not np.array_equal(first.horizontal, other.horizontal)
    assert first.pga == pytest.approx(0.3 * STANDARD_GRAVITY)
    assert np.abs(first.vertical).max() == pytest.approx(0.2 * STANDARD_GRAVITY)
    for component in first.components:
        assert first.velocity(component)[-1] == pytest.approx(0.0, abs=1e-9)
        assert first.displacement(component)[-1] == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(InvalidInput, match="50 samples or more"):
        Motion.synthetic(duration=0.1)
    with pytest.raises(InvalidInput, match="seed of a synthetic motion = -1"):
        Motion.synthetic(seed=-1)


def test_each_file_is_read_by_its_own_units_and_step(tmp_path):
    plain = tmp_path / "level.txt"
    plain.write_text("\n".join(f"{value} 0.0" for value in (0, 98.1, -49.05, 0)))
    upright = tmp_path / "upright.AT2"
    header = ("RECORD OF A TEST", "TEST, STATION, UP", "ACCELERATION IN UNITS OF G")
    upright.write_text("\n".join((*header, "NPTS= 3, DT= .0050 SEC", "0.0 0.02 -0.01\n")))
    keywords = {"column": 1, "units": "cm/s2", "dt": 0.005}
    motion = Motion.read(plain, vertical=upright, transverse=upright, **keywords)
    assert motion.horizontal == pytest.approx([0.0, 0.981, -0.4905, 0.0])
    assert motion.vertical == pytest.approx(np.array([0.0, 0.02, -0.01]) * STANDARD_GRAVITY)
    assert motion.transverse == pytest.approx(motion.vertical)
    with pytest.raises(InvalidInput, match=r"upright\.AT2.*states its units"):
        Motion.read(upright, units="g")
    with pytest.raises(InvalidInput, match=r"level\.txt"):  # states no unit itself
        Motion.read(upright, vertical=plain)
