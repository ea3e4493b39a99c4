"""A column that rocks on its base, with its displacements."""

import pytest

import archfem as af


@pytest.fixture(scope="session")
def rocked(stack):
    """Model and run of a column, rigid blocks, small displacements."""
    model = af.build(stack, fidelity="rigid")
    motion = af.Motion.synthetic(seed=1, duration=1.0, pga=6.0)
    record = af.Record(fields_every=4)
    return model, af.time_history(model, motion, dt=0.005, record=record)
