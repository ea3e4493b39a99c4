"""Joints that fail in known ways, and a bridge with soil."""

from pathlib import Path

import numpy as np
import pytest
from pictures import APART, WEIGHT, resultants

import archfem as af


@pytest.fixture
def joints(ring):
    """Three hinges, two sliding joints and two open ones at one instant."""
    return af.joints.joint_dataset(ring, resultants(ring)).assign_coords(time=3.66)


@pytest.fixture(scope="session")
def bridge():
    """Three rings, two piers, sidewalls, and soil joints over all of them."""
    return af.Case.read(Path(__file__).parents[2] / "meshes" / "prusias.toml").structure


@pytest.fixture
def run(ring):
    """A second in which three joints hinge half-way, and two come apart at the end."""
    time = np.linspace(0.0, 1.0, 11)
    found = np.zeros((11, len(ring.joints), 3))
    found[..., 0] = WEIGHT
    found[5] = found[10] = resultants(ring)
    found[5, APART, 0] = WEIGHT
    dataset = af.joints.joint_dataset(ring, found, time)
    dataset["ground"] = (("time", "axis"), np.column_stack([np.sin(9 * time), np.cos(9 * time)]))
    return af.History(dataset)


@pytest.fixture(scope="session")
def runs():
    """A thick and a thin ring under one motion."""
    motion = af.Motion.synthetic(duration=2.0, pga=3.0, seed=1)
    rings = {
        name: af.circular_arch(radius=2.95, thickness=t, embrace=159.0, voussoirs=9)
        for name, t in {"thick": 0.6, "thin": 0.5}.items()
    }
    return {
        name: af.time_history(
            af.build(ring, fidelity="rigid"), motion, damping=af.Rayleigh(0.05, (8.0, 16.0))
        )
        for name, ring in rings.items()
    }


@pytest.fixture(scope="session")
def column():
    """Three rigid stones on top of one another that may move as far as they like."""
    stones = af.column(breadth=0.4, heights=[0.8, 0.8, 0.8])
    return af.build(stones, fidelity="rigid", displacements="large")


@pytest.fixture(scope="session")
def toppled(column):
    """A run of the column under a swing of the ground of 8 m/s² in a second."""
    time = np.linspace(0.0, 1.0, 201)
    motion = af.Motion(8.0 * np.sin(2.0 * np.pi * time), 0.005, name="swing")
    return af.time_history(column, motion, dt=0.005, record=af.Record(fields_every=5))


@pytest.fixture(scope="session")
def hinged_late(toppled):
    """The same, with a joint that counts as a mechanism shortly before the stones are loose."""
    dataset = toppled.with_criteria(af.Criteria(failures=1)).dataset
    hinge = dataset["hinge"].where(dataset["time"] > 0.4, 0).astype(int)
    run = af.History(dataset.assign(hinge=hinge), toppled.structure)
    assert 0.4 < run.mechanism.time < 0.42 < run.time[-1]
    return run
