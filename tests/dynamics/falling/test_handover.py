"""From a model of jointed blocks to loose ones."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.falling.engine import Falling
from archfem.dynamics.falling.handover import released
from archfem.dynamics.steps import State
from archfem.models.moving import Moving


@pytest.fixture(scope="module")
def model(ring):
    return Moving(af.build(ring, fidelity="rigid"))


@pytest.fixture(scope="module")
def state(model):
    rng = np.random.default_rng(3)
    shape = np.tile([0.02, 0.02, 0.01], model.size // 3)
    q, v = (shape * rng.normal(size=model.size) for _ in range(2))
    return State(1.5, q, 10.0 * v, np.zeros_like(q))


def test_rigid_blocks_keep_pose_and_velocity(ring, model, state):
    found = released(model, state)
    assert found.start.time == 1.5
    assert found.start.poses[list(ring.free)].ravel() == pytest.approx(state.q, abs=1e-12)
    speeds = found.start.velocities[list(ring.free)].ravel()
    assert speeds == pytest.approx(state.velocity, abs=1e-11)
    assert found.after == pytest.approx(found.before, rel=1e-12)
    assert found.strain == pytest.approx(model.energy(state.q), rel=1e-12)
    assert not found.start.poses[[0, -1]].any()


def test_faces_of_joints_are_where_the_model_has_them(ring, state):
    """Elastic blocks turn about another point than the centroid of their outline."""
    model = Moving(af.build(ring, fidelity="faces", cells=(2, 2)))
    q = np.zeros(model.size)
    velocity = np.zeros(model.size)
    for k, first in enumerate(model.starts[:-1]):
        q[first : first + 3] = state.q[3 * k : 3 * k + 3]
        velocity[first : first + 3] = state.velocity[3 * k : 3 * k + 3]
    found = released(model, State(0.0, q, velocity, np.zeros_like(q)))
    opening = model.measures(q)[:, 0]
    poses = found.start.poses
    for joint, (lower, higher) in enumerate(ring.pairs):
        ends = []
        for block in (lower, higher):
            arm = ring.middles[joint] - ring.blocks[block].centroid
            c, s = np.cos(poses[block, 2]), np.sin(poses[block, 2])
            turned = np.array([[c, -s], [s, c]]) @ arm
            ends.append(poses[block, :2] + turned - arm)
        jump = ends[1] - ends[0]
        mean = 0.5 * (poses[lower, 2] + poses[higher, 2])
        c, s = np.cos(mean), np.sin(mean)
        normal = np.array([[c, -s], [s, c]]) @ ring.normals[joint]
        assert jump @ normal == pytest.approx(opening[joint], abs=1e-10)
    assert found.after == pytest.approx(found.before, rel=3e-3)  # chords of the mesh


def test_supports_stay_where_they_have_moved(ring, model, state):
    supports = np.zeros((len(ring.blocks), 3))
    supports[0] = -0.01, 0.0, 0.002
    assert released(model.moved(supports), state).start.poses[0] == pytest.approx(supports[0])


def test_a_ring_thrown_up_falls_from_there(ring, model):
    """The handover of a ring whose blocks fly apart at 2 m/s goes on without a jolt."""
    q, velocity = np.zeros(model.size), np.zeros(model.size)
    velocity[1::3] = 2.0
    found = released(model, State(0.0, q, velocity, np.zeros_like(q)))
    end = Falling(ring).last(found.start, 0.1)
    lift = 2.0 * 0.1 - 0.5 * ring.gravity * 0.1**2
    assert end.poses[list(ring.free), 1] == pytest.approx(lift, rel=1e-9)


def test_a_model_of_small_displacements_is_refused(ring, state):
    with pytest.raises(af.errors.InvalidInput, match="large displacements"):
        released(af.build(ring, fidelity="rigid"), state)
