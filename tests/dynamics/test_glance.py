"""A quick look at joints: nothing is labelled while none fails, and nothing twice."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.glance import Glance

WEIGHT = 1e4


def state(structure, hinges):
    """N, V, M with some joints hinging, {joint: e}."""
    resultants = np.zeros((len(structure.joints), 3))
    resultants[:, 0] = WEIGHT
    for joint, e in hinges.items():
        resultants[joint, 2] = e * WEIGHT * structure.joints[joint].depth
    return resultants


def test_nothing_is_seen_while_no_joint_fails_and_nothing_twice(ring):
    glance = Glance(ring, af.Criteria(), range(18))
    first, second = state(ring, {0: -0.5, 6: -0.5}), state(ring, {0: -0.5, 6: 0.5})
    assert glance(state(ring, {}), 1) is None
    for hinges in (first, second):
        seen = glance(hinges, 1)
        assert np.flatnonzero(seen["hinge"]).tolist() == [0, 6]
        assert seen["M"].values == pytest.approx(hinges[:, 2])
        assert glance(1.1 * hinges, 1) is None  # other forces, the same joints on the same faces


def test_a_joint_may_slide_either_way_or_come_apart(ring):
    glance = Glance(ring, af.Criteria(), range(18))
    for force in ([WEIGHT, WEIGHT, 0.0], [WEIGHT, -WEIGHT, 0.0], [0.0, 0.0, 0.0]):
        resultants = state(ring, {})
        resultants[3] = force
        assert glance(resultants, 1) is not None
        assert glance(resultants, 1) is None


def test_only_some_joints_and_so_many_of_them_count(ring):
    glance = Glance(ring, af.Criteria(), [1, 2, 3])
    assert glance(state(ring, {0: 0.5}), 1) is None
    assert glance(state(ring, {0: 0.5, 1: 0.5}), 2) is None
    assert glance(state(ring, {1: 0.5, 2: 0.5}), 2) is not None
