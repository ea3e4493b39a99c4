"""Where a structure comes apart, and whether blocks are on their way to fall."""

from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.collapse import Parting, tilting

BREADTH = 0.5


@pytest.fixture(scope="module")
def tower():
    """Two blocks that may move far; coordinates are the motions of their centroids."""
    shape = af.column(breadth=BREADTH, heights=[0.5, 0.5])
    return af.build(shape, fidelity="rigid", displacements="large")


def batch(*states):
    """Steps that end in some states."""

    def read(gauges):
        return np.array([gauges.read(np.array(q, dtype=float)) for q in states])

    return SimpleNamespace(times=0.01 * np.arange(len(states)), read=read)


def leant(turn):
    """The upper block turned about the middle of its joint, at a height of half a metre."""
    return [0.0, 0.0, 0.0, -0.25 * np.sin(turn), 0.25 * (np.cos(turn) - 1.0), turn]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_joint_lets_go_where_it_has_turned_by_three_tenths(tower, side):
    assert Parting(tower).step(batch(leant(0.0), leant(side * 0.295))) is None
    k, why = Parting(tower).step(batch(leant(0.0), leant(side * 0.305), leant(side * 0.4)))
    assert k == 1
    assert why == "'joint 1' had turned by 0.3 rad"


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_joint_lets_go_where_it_has_slid_off_its_face(tower, side):
    near, off = (
        [side * share * BREADTH, 0, 0, side * share * BREADTH, 0, 0] for share in (0.99, 1)
    )
    assert Parting(tower).step(batch(near, near)) is None
    assert Parting(tower).step(batch(near, off)) == (1, "'joint 0' had slid by 0.5 m, off its face")


@pytest.mark.parametrize(
    ("turn", "speed", "falls"), [(0.049, 1.0, False), (0.051, 1.0, True), (0.051, 0.0, False)]
)
def test_blocks_that_lean_and_move_are_followed(tower, turn, speed, falls):
    velocity = np.zeros(tower.size)
    velocity[3] = speed
    state = af.dynamics.State(1.0, np.array(leant(turn)), velocity, np.zeros(tower.size))
    assert tilting(tower, state) is falls
