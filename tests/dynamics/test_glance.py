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


def at(glance, resultants, least):
    """What holds at one step."""
    (found,) = glance(resultants[None], least)
    return found


class Asked:
    """Takes note of the joints of which it was asked, and says that they hold."""

    def __init__(self):
        self.seen = []

    def __call__(self, seen):
        self.seen.append(seen.labelled())
        return frozenset({str(len(self.seen))})


def test_nothing_is_asked_while_no_joint_fails_and_nothing_twice(ring):
    asked = Asked()
    glance = Glance(ring, af.Criteria(), range(18), asked)
    first, second = state(ring, {0: -0.5, 6: -0.5}), state(ring, {0: -0.5, 6: 0.5})
    assert at(glance, state(ring, {}), 1) == frozenset()
    for number, hinges in enumerate((first, second), 1):
        assert at(glance, hinges, 1) == {str(number)}
        assert np.flatnonzero(asked.seen[-1]["hinge"]).tolist() == [0, 6]
        assert asked.seen[-1]["M"].values == pytest.approx(hinges[:, 2])
        # other forces, the same joints on the same faces
        assert at(glance, 1.1 * hinges, 1) == {str(number)}
    assert len(asked.seen) == 2


def test_a_joint_may_slide_either_way_or_come_apart(ring):
    asked = Asked()
    glance = Glance(ring, af.Criteria(), range(18), asked)
    for number, force in enumerate(
        ([WEIGHT, WEIGHT, 0.0], [WEIGHT, -WEIGHT, 0.0], [0.0, 0.0, 0.0]), 1
    ):
        resultants = state(ring, {})
        resultants[3] = force
        assert at(glance, resultants, 1) == at(glance, resultants, 1) == {str(number)}


def test_only_some_joints_and_so_many_of_them_count(ring):
    glance = Glance(ring, af.Criteria(), [1, 2, 3], Asked())
    assert not at(glance, state(ring, {0: 0.5}), 1)
    assert not at(glance, state(ring, {0: 0.5, 1: 0.5}), 2)
    assert at(glance, state(ring, {1: 0.5, 2: 0.5}), 2)


def test_many_steps_at_once_are_seen_as_one_by_one(ring):
    steps = np.array([state(ring, {}), state(ring, {2: 0.5}), state(ring, {2: -0.5, 9: 0.5})])
    steps[1, 4] = WEIGHT, -WEIGHT, 0.0
    asked, alone = Asked(), Asked()
    together = list(Glance(ring, af.Criteria(), range(18), asked)(steps, 1))
    glance = Glance(ring, af.Criteria(), range(18), alone)
    assert together == [at(glance, step, 1) for step in steps] == [set(), {"1"}, {"2"}]
    for first, second in zip(asked.seen, alone.seen, strict=True):
        assert first.identical(second)
