"""Lengths of steps that an error chooses, of a thrust that is known at all times."""

from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.solvers.adaptive import AdaptiveStepper

TOLERANCE = 0.005
DEPTHS = np.array([2.0, 0.5, 1.0])
JUDGED = np.array([True, True, False])
REST = np.array([1e4, 1e3, 7e4])
"""N of the joints at rest [N]; the third is of no ring and no pier."""


class Known:
    """Stands for a stepper: the first joint has e(t) at the middle of each step, and N as at rest.

    Its solver gives up steps that are longer than `longest`.
    """

    solver = "some"

    def __init__(self, e, sample=0.01, longest=1.0):
        structure = SimpleNamespace(judged=JUDGED, depths=DEPTHS, weight=1e3, free=(1, 2))
        model, motion = SimpleNamespace(structure=structure), SimpleNamespace(dt=sample)
        self.equation = SimpleNamespace(model=model, motion=motion)
        self.e, self.longest, self.exact = e, longest, SimpleNamespace(batches=self.one_by_one)

    def advance_batch(self, state, dt, times):
        times = times[: len(times) if dt <= self.longest else 0]
        values = np.zeros((len(times), 3, 3))
        values[:, :, 0] = REST
        values[:, 0, 2] = self.e(times - 0.5 * dt) * REST[0] * DEPTHS[0]
        values[:, 2, 2] = 1e9 * np.cos(1e4 * times)  # of a joint that is not judged
        ones = np.ones(len(times))
        end = [af.dynamics.State(time, *np.zeros((3, 1))) for time in times]
        return af.dynamics.Batch(
            times, values, ones.astype(int), dt * ones, np.zeros((len(times), 4)), end.__getitem__
        )

    def fallback_step(self, state, dt):
        longest, self.longest = self.longest, np.inf
        batch = self.advance_batch(state, dt, np.array([state.time + dt]))
        self.longest = longest
        return batch

    def one_by_one(self, state, dt, end):
        yield self.fallback_step(state, dt)


NO_SLIP = SimpleNamespace(
    joints=np.zeros(0, int),
    estimate=lambda batch: np.zeros((len(batch.times), 0)),
    add=lambda batch: None,
)
"""Stands for the error of the slip where no joint can slide."""


def stepped(stepper, end):
    """The adaptive stepper after a run from rest to a time, and the ends of its steps."""
    start = stepper.fallback_step(SimpleNamespace(time=-1.0), 1.0)
    found = AdaptiveStepper(stepper, TOLERANCE, start, NO_SLIP)
    batches = list(found.batches(af.dynamics.State(0.0, *np.zeros((3, 1))), end))
    times = np.concatenate([batch.times for batch in batches])
    lengths = np.concatenate([batch.smallest_step for batch in batches])
    np.testing.assert_allclose(np.diff(times, prepend=0.0), lengths, rtol=1e-9)
    assert times[-1] == pytest.approx(end, rel=1e-12)
    return found, lengths


def bent(share, dt):
    """e(t) whose error, its second derivative times dt²/6, is a share of the tolerance at dt."""
    return lambda time: 3.0 * share * TOLERANCE / dt**2 * time**2


@pytest.mark.parametrize(
    ("sample", "first", "longest"),
    [
        (0.01, 0.005, 0.02),
        (0.005, 0.0025, 0.02),
        (0.003, 0.0015, 0.012),
        (0.05, 0.0125, 0.0125),
        (0.021, 0.0105, 0.0105),
        (2.9e-4, 1.45e-4, 18.56e-3),
        (1.4e-4, 1.4e-4, 17.92e-3),
        (5e-5, 1e-4, 12.8e-3),
    ],
)
def test_steps_at_rest_are_doubled_after_32_up_to_20_ms(sample, first, longest):
    """From half of the sample's length on; never beyond 20 ms, nor at first below 0.1 ms.

    After five doublings 31 steps of a length make the time a multiple of twice that length.
    """
    levels = np.arange(round(np.log2(longest / first)) + 1)
    lengths = first * 2.0 ** np.repeat(levels, np.where(levels < 5, 32, 31))
    _, found = stepped(Known(lambda time: 0.0 * time, sample), lengths.sum() + 4.0 * longest)
    assert found == pytest.approx([*lengths, *(4 * [longest])], rel=1e-12)


def test_steps_without_a_solver_are_as_long_as_their_error_allows():
    """One at a time, each of which may be doubled."""
    stepper = Known(lambda time: 0.0 * time)
    stepper.solver = None
    _, found = stepped(stepper, 0.32)
    assert found == pytest.approx([0.005, 0.005, 0.01, *(15 * [0.02])])


def test_a_run_ends_with_shorter_steps_where_the_last_would_go_too_far():
    _, found = stepped(Known(lambda time: 0.0 * time), 0.48 + 0.0275)
    assert found[64:] == pytest.approx([0.02, 0.005, 0.0025])


@pytest.mark.parametrize(
    ("share", "lengths"),
    [(1.01, (2, 0.0025)), (0.99, (32, 0.005)), (0.102, (32, 0.005)), (0.098, (32, 0.01))],
)
def test_steps_are_halved_beyond_the_tolerance_and_doubled_below_a_tenth_of_it(share, lengths):
    """The error of e = c t² is c dt² / 3 in every step after the second."""
    found, steps = stepped(Known(bent(share, 0.005)), 0.64)
    count, after = lengths
    assert steps[:count] == pytest.approx(0.005)
    assert steps[count:] == pytest.approx(after)
    assert found.unmet_share == 0.0
    assert found.taken == len(steps)


@pytest.mark.parametrize(("share", "unmet"), [(1.01, 1.0), (0.99, 0.0)])
def test_steps_of_a_tenth_of_a_millisecond_are_taken_at_any_error(share, unmet):
    """But for the first two, of which no error is known, they count as steps that do not meet it.

    The longer steps before are two of each length, of 5 ms to 0.16 ms.
    """
    tick = 0.01 / 128
    found, steps = stepped(Known(bent(share, tick)), 0.02)
    shortest = int(np.sum(np.isclose(steps, tick)))
    assert steps.min() == pytest.approx(tick)
    assert steps[0] == pytest.approx(0.005)
    assert found.taken == len(steps)
    assert found.unmet == pytest.approx(unmet * shortest, abs=0)
    assert found.unmet_share == found.unmet / len(steps)


def test_the_error_of_steps_of_several_lengths_is_that_of_a_parabola():
    """Slopes between middles of steps of 5 ms, and one of 1.25 ms: the bend is 2 c exactly."""
    stepper = Known(bent(0.5, 0.005))
    first = stepper.fallback_step(SimpleNamespace(time=0), 1)
    found = AdaptiveStepper(stepper, TOLERANCE, first, NO_SLIP)
    long = stepper.advance_batch(None, 0.005, 0.005 * np.arange(1, 6))
    assert found._errors(long) == pytest.approx([0.0, 0.0, *(3 * [0.5 * TOLERANCE])])
    batch, worst = found._try_steps(None, 0.005, long.times[:2], False)
    assert (len(batch.times), worst) == (2, 0.0)
    short = stepper.advance_batch(None, 0.00125, np.array([0.01125, 0.0125]))
    assert found._errors(short) == pytest.approx(2 * [0.5 * TOLERANCE / 16.0])


def test_thrust_is_measured_at_half_the_compression_at_rest_at_least():
    """A joint that is barely pressed at rest is measured at half of half the mean."""
    stepper = Known(lambda time: 0.0 * time)
    first = stepper.fallback_step(SimpleNamespace(time=0), 1)
    found = AdaptiveStepper(stepper, TOLERANCE, first, NO_SLIP)
    least = np.array([0.5 * 1e4, 0.25 * 5.5e3])
    resultants = np.zeros((3, 3, 3))
    resultants[:, :, 2] = 100.0
    resultants[:, :2, 0] = [[-1e3, -1e3], 0.98 * least, 2.0 * least]
    expected = 100.0 / (np.array([least, least, 2.0 * least]) * DEPTHS[:2])
    assert found._scale_moments(resultants) == pytest.approx(expected)


def test_steps_that_the_solver_gives_up_are_halved_and_at_last_taken_without_it():
    _, steps = stepped(Known(lambda time: 0.0 * time, longest=0.003), 0.08 + 0.0025)
    assert steps == pytest.approx(0.0025)
    tick = 0.01 / 128
    _, steps = stepped(Known(lambda time: 0.0 * time, longest=0.0), 4 * tick)
    assert steps == pytest.approx(4 * [tick])
