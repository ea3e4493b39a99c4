"""Rigid blocks in equilibrium: loads, gaps, and the balance that is their transpose."""

import numpy as np
import pytest
from kinematics import gaps
from mechanisms import arch

import archfem as af
from archfem.limit.blocks import RigidBlocks, rigid_load


@pytest.fixture
def motion():
    """Of all blocks of the arch, supports included."""
    return np.random.default_rng(3).standard_normal((19, 3))


def test_gaps_are_those_of_the_points_at_the_joints(motion):
    found = RigidBlocks(arch()).gaps(motion)
    assert pytest.approx(gaps(arch(), motion), abs=1e-12) == found.T


def test_forces_do_the_work_of_their_balance(motion):
    """F and V on the gaps of a motion, against what they leave on the blocks."""
    blocks = RigidBlocks(arch())
    motion[[0, -1]] = 0.0
    forces = np.random.default_rng(4).standard_normal(3 * 18)
    intrados, extrados, slip = blocks.gaps(motion)
    work = forces @ np.concatenate([-intrados, -extrados, slip])
    left = blocks.balance @ forces
    assert left @ (motion[1:-1].ravel() / blocks.coordinates) == pytest.approx(work)


def test_loads_are_forces_at_centroids():
    structure = arch()
    weights = [b.area * b.material.unit_weight for b in structure.blocks[1:-1]]
    push = af.PointLoad(0.0, (2e3, -1e3))
    found = rigid_load(structure, [af.BodyForce(0.5, -1.0), push]).reshape(-1, 3)
    block, point = push.place(structure)
    x, y = point - structure.blocks[block].centroid
    expected = np.outer(weights, [0.5, -1.0, 0.0])
    expected[block - 1] += [2e3, -1e3, -1e3 * x - 2e3 * y]
    assert found == pytest.approx(expected)
