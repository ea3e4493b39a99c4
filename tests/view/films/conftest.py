"""A ring of rigid stones, a run of it that makes hinges, and a ring of elastic stones."""

import numpy as np
import pytest

import archfem as af


@pytest.fixture(scope="session")
def coarse(ring):
    return af.build(ring, fidelity="full", cells=(2, 2))


@pytest.fixture(scope="session")
def model(ring):
    return af.build(ring, fidelity="rigid")


def shaken(model):
    """A third of a second of a pulse that makes hinges."""
    time = np.linspace(0.0, 0.3, 61)
    motion = af.Motion(6.0 * np.sin(2.0 * np.pi * time / 0.3), 0.005, name="pulse")
    damping = af.Rayleigh(0.05, (8.0, 16.0))
    return af.time_history(
        model, motion, dt=0.005, damping=damping, record=af.Record(fields_every=5)
    )


@pytest.fixture(scope="session")
def run(model):
    return shaken(model)
