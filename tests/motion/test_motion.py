"""`Motion` and operations on its components."""

import numpy as np
import pytest

import archfem as af


def sine(frequency=2.0, duration=4.0, dt=0.01, amplitude=1.0):
    return amplitude * np.sin(2.0 * np.pi * frequency * np.arange(0.0, duration + dt / 2.0, dt))


@pytest.fixture(scope="module")
def shaking():
    return af.Motion.synthetic(duration=10.0, pga=3.0, seed=4)


def test_components_keep_their_own_lengths():
    motion = af.Motion(sine(), 0.01, vertical=sine()[:100], name="short vertical")
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
        (np.array([0.0, 1.0 + 1.0j]), 0.01, "is complex"),
        (["fast"], 0.01, "not a row of numbers"),
        (None, 0.01, "one row of finite numbers"),
        ([0.0, 1.0], 0.0, "positive number"),
        ([0.0, 1.0], -0.01, "positive number"),
        (np.ones(11), 5.0, "give seconds"),  # ms
        ([0.0, 1.0], np.nan, "positive number"),
        ([0.0, 1.0], "0.01", "positive number"),
        ([0.0, 5.01 * af.units.STANDARD_GRAVITY], 0.01, "wrong unit"),
    ],
)
def test_invalid_motions_are_refused(samples, dt, message):
    with pytest.raises(af.errors.InvalidInput, match=message):
        af.Motion(samples, dt)


def test_vertical_of_nearly_two_g_is_a_motion():
    motion = af.Motion([0.0, 1.0], 0.01, vertical=[0.0, 1.9 * af.units.STANDARD_GRAVITY])
    assert np.abs(motion.vertical).max() == 1.9 * af.units.STANDARD_GRAVITY


def test_samples_cannot_be_changed_from_outside():
    samples = np.array([0.0, 1.0])
    motion = af.Motion(samples, 0.01)
    samples[1] = 7.0
    assert motion.pga == 1.0
    with pytest.raises(ValueError, match="read-only"):
        motion.horizontal[0] = 3.0


def test_at_is_straight_between_samples_and_zero_outside():
    motion = af.Motion([1.0, 3.0, -1.0], 0.1, vertical=[2.0, 4.0])
    values = motion.at(np.array([-0.01, 0.0, 0.05, 0.15, 0.2, 0.21]))
    expected = [[0, 0], [1, 2], [2, 3], [1, 0], [-1, 0], [0, 0]]
    assert values == pytest.approx(np.array(expected, dtype=float), abs=1e-12)


def test_the_last_instant_summed_up_in_steps_is_inside():
    motion = af.Motion(sine(frequency=0.3), 0.01)
    late = float(np.cumsum(np.full(400, 0.01))[-1])
    assert late != motion.duration
    assert motion.at(late)[0, 0] == pytest.approx(motion.horizontal[-1], rel=1e-6)
    assert af.Motion([2.0], 0.01).at(0.0)[0, 0] == 2.0


def test_scaling_acts_on_all_components(shaking):
    half = shaking.scaled(-0.5)
    assert half.pga == pytest.approx(1.5)
    assert half.vertical == pytest.approx(-0.5 * shaking.vertical)
    assert shaking.scaled_to_pga(2.0).pga == pytest.approx(2.0)
    with pytest.raises(af.errors.InvalidInput, match="must be > 0"):
        af.Motion(np.zeros(3), 0.01).scaled_to_pga(1.0)


@pytest.mark.parametrize(
    "change",
    [
        lambda motion: motion.scaled(-0.4),
        lambda motion: motion.cut(2.0, 5.0),
        lambda motion: motion.resampled(0.0037),
        lambda motion: motion.baseline_corrected(),
        lambda motion: motion.band_passed(0.5, 10.0),
    ],
    ids=["scaled", "cut", "resampled", "baseline_corrected", "band_passed"],
)
def test_every_component_is_changed_equally(shaking, change):
    alone = change(af.Motion(shaking.vertical, shaking.dt))
    changed = change(shaking)
    assert np.array_equal(changed.vertical, alone.horizontal)
    assert not np.array_equal(changed.vertical, shaking.vertical)
    assert changed.dt == alone.dt
    assert changed.name == shaking.name


def test_reversed_motion_leaves_the_vertical(shaking):
    both = shaking.with_transverse(shaking.scaled(0.5))
    turned = both.reversed()
    assert np.array_equal(turned.horizontal, -both.horizontal)
    assert np.array_equal(turned.transverse, -both.transverse)
    assert np.array_equal(turned.vertical, both.vertical)


def test_cut_keeps_both_ends(shaking):
    part = shaking.cut(2.0, 5.0)
    assert part.duration == pytest.approx(3.0)
    assert part.horizontal[[0, -1]] == pytest.approx(shaking.horizontal[[400, 1000]])
    assert shaking.cut(4.0).duration == pytest.approx(6.0)


def test_cut_after_the_end_of_a_component_leaves_it_at_zero():
    part = af.Motion(sine(), 0.01, vertical=sine()[:100]).cut(2.0, 3.0)
    assert part.at(part.times())[:, 1] == pytest.approx(0.0)
    with pytest.raises(af.errors.InvalidInput, match="nothing of the 4 s is left"):
        af.Motion(sine(), 0.01).cut(5.0, 6.0)


def test_a_cut_without_an_end_runs_to_the_end(shaking):
    assert shaking.cut(4.0, 99.0).duration == pytest.approx(6.0)
    assert shaking.cut(4.0, np.inf).duration == pytest.approx(6.0)


@pytest.mark.parametrize("span", [(-0.1, 3.0), (3.0, 2.0), (np.nan, 3.0), (0.0, np.nan)])
def test_cut_to_nothing_is_refused(shaking, span):
    with pytest.raises(af.errors.InvalidInput, match="nothing of the 10 s is left"):
        shaking.cut(*span)


def test_refining_by_a_whole_number_keeps_the_motion(shaking):
    times = np.linspace(0.0, 10.0, 777)
    # Straight lines between the same points: equal to round-off.
    assert shaking.resampled(0.001).at(times) == pytest.approx(shaking.at(times), abs=1e-9)


def test_rotation_keeps_energy_and_turns_back(shaking):
    both = af.Motion(shaking.horizontal, shaking.dt, transverse=shaking.vertical)
    turned = both.rotated("0.7 rad")
    energy = both.horizontal**2 + both.transverse**2
    assert turned.horizontal**2 + turned.transverse**2 == pytest.approx(energy)
    assert turned.rotated("-0.7 rad").horizontal == pytest.approx(both.horizontal)
    with pytest.raises(af.errors.InvalidInput, match="no component 'transverse'"):
        shaking.rotated(10.0)


def test_a_quarter_turn_is_90_degrees_and_bare_radians_are_refused(shaking):
    both = af.Motion(shaking.horizontal, shaking.dt, transverse=shaking.vertical)
    assert both.rotated(90).horizontal == pytest.approx(both.transverse)
    with pytest.raises(af.errors.InvalidInput, match="looks like radians"):
        both.rotated(0.5 * np.pi)


def test_vertical_comes_from_another_motion(shaking):
    level = af.Motion(sine(), 0.01)
    assert level.with_vertical(af.Motion(sine()[:50], 0.01)).vertical == pytest.approx(sine()[:50])
    assert level.with_vertical(level).with_vertical(None).components == ("horizontal",)
    whole = af.Motion(sine(), 0.01, 0.5 * sine())
    assert level.with_vertical(whole).vertical == pytest.approx(0.5 * sine())
    with pytest.raises(af.errors.InvalidInput, match=r"step of 0\.005 s"):
        level.with_vertical(shaking)


def test_each_file_is_read_by_its_own_units_and_step(tmp_path):
    plain = tmp_path / "level.txt"
    plain.write_text("\n".join(f"{value} 0.0" for value in (0, 98.1, -49.05, 0)))
    upright = tmp_path / "upright.AT2"
    header = ("RECORD OF A TEST", "TEST, STATION, UP", "ACCELERATION IN UNITS OF G")
    upright.write_text("\n".join((*header, "NPTS= 3, DT= .0050 SEC", "0.0 0.02 -0.01\n")))
    keywords = {"column": 1, "units": "cm/s2", "dt": 0.005}
    motion = af.Motion.read(plain, vertical=upright, transverse=upright, **keywords)
    assert motion.horizontal == pytest.approx([0.0, 0.981, -0.4905, 0.0])
    expected = np.array([0.0, 0.02, -0.01]) * af.units.STANDARD_GRAVITY
    assert motion.vertical == pytest.approx(expected)
    assert motion.transverse == pytest.approx(motion.vertical)
    with pytest.raises(af.errors.InvalidInput, match=r"upright\.AT2.*states its units"):
        af.Motion.read(upright, units="g")
    with pytest.raises(af.errors.InvalidInput, match=r"level\.txt"):  # states no unit itself
        af.Motion.read(upright, vertical=plain)


def test_small_numbers_are_numbers(shaking):
    """A peak of a millimetre per second squared, and a step that differs by a millionth."""
    weak = shaking.scaled_to_pga(1e-3)
    assert weak.pga == pytest.approx(1e-3)
    assert weak.scaled_to_pga(0.05).pga == pytest.approx(0.05)
    for pga in (0.0, -1.0):
        with pytest.raises(af.InvalidInput, match="both must be > 0"):
            shaking.scaled_to_pga(pga)
    for change, same in ((0.9e-6, True), (1.2e-6, False)):
        other = af.Motion(sine(), shaking.dt * (1.0 + change))
        if same:
            assert shaking.with_vertical(other).dt == shaking.dt
        else:
            with pytest.raises(af.InvalidInput, match="bring the coarser to the finer by"):
                shaking.with_vertical(other)


def test_cuts_fall_on_samples_to_a_millionth_of_one(shaking):
    dt = shaking.dt
    for off, first in ((1e-7, 100), (-1e-7, 100), (1e-3, 101), (-1e-3, 100)):
        part = shaking.cut((100 + off) * dt, (200 + off) * dt)
        last = 199 if off == -1e-3 else 200
        assert part.horizontal.tolist() == shaking.horizontal[first : last + 1].tolist()
    assert len(shaking.cut(100 * dt, 100 * dt).horizontal) == 1


def test_ground_rests_behind_a_motion():
    motion = af.Motion([1.0, -2.0, 0.5], 0.01, vertical=[0.3, 0.2, 0.1])
    rested = motion.with_rest(0.02)
    assert rested.horizontal.tolist() == [1.0, -2.0, 0.5, 0.0, 0.0]
    assert rested.vertical.tolist() == [0.3, 0.2, 0.1, 0.0, 0.0]
    assert rested.duration == pytest.approx(motion.duration + 0.02)
    with pytest.raises(af.InvalidInput, match="rest"):
        motion.with_rest(-1.0)
