"""Which instants a film shows, and how fast."""

import numpy as np
import pytest

import archfem as af
from archfem.view.films.frames import (
    decisive_window,
    even_timing,
    frame_timing,
    slow_motion_timing,
)
from archfem.view.positions import FallingBlocks

KEPT = np.linspace(0.0, 10.0, 401)


def test_slow_motion_is_slow_there_and_real_time_elsewhere():
    """Steps between frames: 1/20 s, and a tenth of it within a second; so it lasts 9 s longer."""
    fine = np.linspace(0.0, 10.0, 4001)
    timing = slow_motion_timing(fine, 20.0, (4.0, 5.0))
    steps, slow = np.diff(timing.times), timing.speeds[:-1] < 1.0
    assert timing.fps == 20.0
    assert len(timing.times) / timing.fps == pytest.approx(10.0 + 9.0, abs=0.06)
    assert np.median(steps[slow]) == pytest.approx(0.005, rel=0.01)
    assert np.median(steps[~slow]) == pytest.approx(0.05, rel=0.01)
    assert steps.min() > 0.0049  # from the first frame on
    assert ((timing.times[:-1] >= 4.0) & (timing.times[:-1] < 5.0)).tolist() == slow.tolist()


def test_few_fields_allow_of_little_slow_motion():
    """A field each 25 ms at 20 frames a second: four frames between two make 1/8."""
    assert slow_motion_timing(KEPT, 20.0, (4.0, 5.0)).speeds.min() == pytest.approx(0.125)
    assert slow_motion_timing(KEPT[::8], 5.0, (4.0, 5.0)).speeds.min() == pytest.approx(0.25)


def test_slow_motion_is_cut_to_the_run_and_its_speed_follows_from_the_fields_inside():
    """A field each 2 s, so 0.6 frames a second: four frames between two of them, or none."""
    late = slow_motion_timing(np.linspace(0.0, 10.0, 4001), 20.0, (9.5, 12.0))
    assert len(late.times) / late.fps == pytest.approx(9.5 + 5.0, abs=0.06)
    assert late.times[[0, -1]].tolist() == [0.0, 10.0]
    for window, spacing in (((4.2, 5.8), 1.6), ((3.9, 5.9), 2.0), ((3.9, 6.1), 2.0)):
        speeds = slow_motion_timing(KEPT[::80], 20.0, window).speeds
        assert speeds.min() == pytest.approx(0.6 * spacing / 4.0)
        assert speeds.max() == 1.0


@pytest.mark.parametrize(
    ("fields", "seconds", "speed", "fps"),
    [(1, None, 1.0, 20.0), (5, None, 1.0, 5.0), (5, 2.0, 0.5, 2.5), (5, 0.01, 100.0, 100.0)],
)
def test_a_film_has_at_most_a_frame_for_each_field_and_at_least_one(fields, seconds, speed, fps):
    """Of a second from 2 s on, or of one instant, at 20 frames a second."""
    known = np.linspace(2.0, 3.0, fields)
    timing = even_timing(known, 20.0, seconds)
    assert timing.speeds == pytest.approx(speed)
    assert timing.fps == pytest.approx(fps)
    assert timing.times == pytest.approx(known[:1] if seconds == 0.01 else known)


def test_a_film_of_another_length_states_its_speed():
    assert even_timing(KEPT, 20.0, None).speeds == pytest.approx(1.0)
    assert even_timing(KEPT, 20.0, 40.0).speeds == pytest.approx(0.25)


def test_the_decisive_window_has_the_mechanism_or_the_fall(run, column, toppled):
    falls = FallingBlocks.of(column.structure, toppled)
    start, end = decisive_window(toppled)
    # a quarter of a second before it, and three after
    assert (falls.times[0] - start, end - falls.times[0]) == pytest.approx((0.25, 0.75))
    start, end = decisive_window(run)
    assert start < run.mechanism.time < end
    calm = af.History(run.dataset).with_criteria(af.Criteria(failures=17))
    tilt = abs(run.joints["eccentricity"]).max("joint")
    start, _ = decisive_window(calm)
    assert start + 0.25 == pytest.approx(float(tilt["time"][int(tilt.argmax("time"))]))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"window": "soon"}, r"window 'soon': give 'auto', or two times"),
        ({"window": (5.0, 4.0)}, r"window .*: the run lasts from 0 to 10 s"),
        ({"window": (20.0, 30.0)}, r"window .*: the run lasts from 0 to 10 s"),
        ({"window": "auto", "seconds": 5.0}, r"give one of the two"),
    ],
)
def test_invalid_windows_are_refused(run, options, said):
    with pytest.raises(af.InvalidInput, match=said):
        frame_timing(run, KEPT, 20.0, **{"seconds": None, "window": None, **options})
