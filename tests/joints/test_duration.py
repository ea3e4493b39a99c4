"""How long something holds, over steps of any lengths."""

import numpy as np
import pytest

from archfem.joints.criteria import DurationCounter, find_lasting, step_lengths

TIME = np.array([0.0, 1e-3, 1.2e-3, 1.5e-3, 5e-3, 6e-3])


def test_a_record_lasts_for_the_step_that_ends_with_it():
    assert step_lengths(TIME) == pytest.approx([1e-3, 1e-3, 2e-4, 3e-4, 3.5e-3, 1e-3])
    assert step_lengths(np.array([2.0])).tolist() == [0.0]


@pytest.mark.parametrize(
    ("up", "least", "expected"),
    [
        ([2], 1e-3, None),  # 0.2 ms
        ([2, 3], 5e-4, 2),
        ([2, 3], 6e-4, None),
        ([2, 3, 5], 1e-3, 5),  # a break begins it anew
        ([2, 3, 4], 4e-3, 2),
        ([0], 1e-3, 0),
        ([2], 0.0, 2),
        ([], 0.0, None),
    ],
)
def test_the_first_lasting_state_is_found(up, least, expected):
    assert find_lasting(up, TIME, least, lambda instant: instant) == expected
    # the same where every record is looked at, and by a watch of each step
    every = find_lasting(range(6), TIME, least, lambda k: k if k in up else None)
    unbroken, lengths = DurationCounter(least), step_lengths(TIME)
    ends = [k for k in range(6) if unbroken.add_step(k in up, float(lengths[k]))]
    assert every == expected
    assert bool(ends) == (expected is not None)


def test_a_duration_adds_up_from_zero():
    unbroken = DurationCounter(0.25)
    steps = [(True, 0.2), (True, 0.05), (False, 0.3), (True, 0.2), (True, 0.1)]
    assert [unbroken.add_step(*each) for each in steps] == [False, True, False, False, True]


def test_a_single_record_is_a_state_that_stays():
    assert find_lasting([0], np.array([1.0]), 1e-3, lambda instant: instant) == 0
    assert find_lasting([1], np.array([0.0, 1e-3]), 2e-3, lambda instant: instant) is None


def test_steps_as_long_as_the_least_count_whatever_the_round_off():
    time = 1e-3 * np.arange(3000)
    assert np.diff(time).min() < 1e-3
    for instant in range(1, 3000, 7):
        assert find_lasting([instant], time, 1e-3, lambda number: number) == instant
