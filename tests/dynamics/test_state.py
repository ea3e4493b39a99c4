"""Steps in batches, and steps made of two halves."""

from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.dynamics import Batch
from archfem.dynamics.state import Step


def step(time, force, iterations, smallest, energy):
    state = af.dynamics.State(time, *np.zeros((3, 2)))
    return Step(state, np.full((1, 3), force), iterations, smallest, np.array(energy))


FIRST = step(0.1, 4.0, 3, 0.002, [7.0, 8.0, 1.0, 0.25])
SECOND = step(0.2, 10.0, 5, 0.001, [9.0, 6.0, 2.0, 0.5])


@pytest.mark.parametrize(("mean", "force"), [(True, 7.0), (False, 10.0)])
def test_two_halves_are_a_step(mean, force):
    """Effort, work and loss add up; energies and the state are those at the end."""
    whole = SECOND.appended_to(FIRST, mean=mean)
    assert (whole.resultants == force).all()
    assert (whole.iterations, whole.smallest_step) == (8, 0.001)
    assert FIRST.appended_to(SECOND, mean=mean).smallest_step == 0.001
    assert whole.energy.tolist() == [9.0, 6.0, 3.0, 0.75]
    assert whole.state.time == 0.2


def test_a_step_is_a_batch_of_one():
    batch = SECOND.batch
    assert batch.times.tolist() == [0.2]
    assert batch.iterations.tolist() == [5]
    assert batch.smallest_step.tolist() == [0.001]
    assert batch.energy.tolist() == [[9.0, 6.0, 2.0, 0.5]]
    assert batch.resultants.shape == (1, 1, 3)
    assert batch.state(0) is SECOND.state


def test_a_batch_is_cut_and_read():
    """Readings that come with it, or else off its coordinates or its states."""
    times, rows = np.arange(1.0, 5.0), np.arange(16.0).reshape(4, 4)
    states = [af.dynamics.State(t, np.full(2, t), *np.zeros((2, 2))) for t in times]
    given = (times, np.zeros((4, 1, 3)), np.arange(4), times, rows, lambda k: states[k])
    gauges = SimpleNamespace(read=lambda q: 2.0 * q, read_many=lambda q, faces: 3.0 * q)
    whole = Batch(*given)
    assert whole.cut(4) is whole
    part = whole.cut(2)
    assert (part.times.tolist(), part.energy.tolist()) == ([1.0, 2.0], rows[:2].tolist())
    assert part.read(gauges).tolist() == [[2.0, 2.0], [4.0, 4.0]]
    with_readings = Batch(*given, readings=np.full((4, 3), 9.0)).cut(3)
    assert with_readings.read(gauges).tolist() == [[9.0] * 3] * 3
    with_rows = Batch(*given, q=np.arange(8.0).reshape(4, 2)).cut(2)
    stored = with_rows.with_readings(gauges)
    assert with_rows.readings is None
    assert stored.readings.tolist() == stored.read(gauges).tolist() == [[0.0, 3.0], [6.0, 9.0]]
