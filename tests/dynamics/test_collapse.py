"""Where a structure comes apart, and whether blocks are on their way to fall."""

from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.dynamics import collapse
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


def test_a_fall_is_followed_for_twenty_seconds_after_the_motion(tower, monkeypatch):
    """Frames each fiftieth of a second, of joints that all slide and none of which is bonded."""
    asked = []

    class Falling:
        def __init__(self, structure):
            asked.append(structure)

        def frames(self, start, end, motion, *, spacing):
            asked.append((start, end, spacing))
            yield start

    given = SimpleNamespace(start=SimpleNamespace(time=1.0, poses=np.zeros((3, 3))))
    given.strain, given.before, given.after = 0.5, 2.0, 1.5
    monkeypatch.setattr(collapse, "released", lambda model, state: given)
    monkeypatch.setattr(collapse, "Falling", Falling)
    monkeypatch.setattr(collapse, "fall_of", lambda structure, frames: len(frames))
    motion = af.Motion(np.arange(401.0) / 1e3, 0.01)
    for time, end in ((1.0, 24.0), (6.0, 26.0)):
        asked.clear()
        state = SimpleNamespace(time=time)
        found, fall = collapse.fallen(tower, state, motion)
        assert asked[1] == (given.start, pytest.approx(end), 0.02)
        assert fall == 1
    assert found["fall_ground"].values == pytest.approx(np.array([[0.1, 0.0]]))
    assert found.attrs["handover_kinetic"].tolist() == [2.0, 1.5]


def test_loose_stones_rub_as_their_joints_did_or_by_six_tenths():
    for friction, rubs in ((0.45, 0.45), (None, 0.6)):
        contact = af.Contact(1e9, 4e8, friction, cohesion=1e4)
        loose = collapse._rubbing(af.column(breadth=1.0, heights=[1.0], contact=contact))
        assert [each.contact.friction for each in loose.joints] == [rubs]
        assert [each.contact.cohesion for each in loose.joints] == [0.0]
