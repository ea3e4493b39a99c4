"""Mean accelerations between instants."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

import archfem as af
from archfem.dynamics.solvers.equation import mean_accelerations


@pytest.mark.parametrize("step", [0.002, 0.01, 0.0137, 0.05])
def test_means_are_those_of_the_straight_lines_between_samples(step):
    samples = np.random.default_rng(1).standard_normal(12)
    motion = af.Motion(samples, 0.01, vertical=samples[::-1].copy())
    times = np.arange(0.0, 0.11, step)
    found = mean_accelerations(motion, times)
    for axis in range(2):
        for k, (start, end) in enumerate(pairwise(times)):
            kinks = np.arange(12) * 0.01
            inside = kinks[(kinks > start) & (kinks < end)]
            wanted = quad(lambda t, of: motion.at(t)[0, of], start, end, axis, points=inside)[0]
            assert found[k, axis] == pytest.approx(wanted / (end - start), abs=1e-7)


def test_outside_of_the_record_the_ground_is_still():
    motion = af.Motion(np.ones(11), 0.01)
    found = mean_accelerations(motion, np.array([0.0, 0.1, 0.2, 0.3]))
    np.testing.assert_allclose(found[:, 0], [1.0, 0.0, 0.0], atol=1e-12)
