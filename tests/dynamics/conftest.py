"""The ring on rigid blocks, and a motion that makes it a mechanism."""

import pytest
from kernels import each_way  # noqa: F401  (a fixture)

import archfem as af


@pytest.fixture(scope="session")
def model(ring):
    return af.build(ring, fidelity="rigid")


@pytest.fixture(scope="session")
def motion():
    return af.Motion.synthetic(duration=3.0, pga=6.0, seed=2)


@pytest.fixture(scope="session")
def run(model, motion):
    damping, record = af.Rayleigh(0.05, (8.0, 16.0)), af.Record(fields_every=50)
    return af.time_history(model, motion, dt=0.005, damping=damping, record=record)


@pytest.fixture(scope="session")
def breaking():
    """A function that gives a stepper whose attempts fail where `breaks(time, dt)` says so."""

    def stepper(model, motion, breaks, scheme=None):
        damping = af.Rayleigh(0.05, (8.0, 16.0))
        equation = af.dynamics.Equation(model, motion, damping, scheme or af.dynamics.Conserving())
        real = af.dynamics.SnesSolver(equation)
        tried = real.averaged if equation.conserving else real.attempt

        def attempt(state, dt):
            if breaks(state.time, dt):
                raise af.DidNotConverge("made to fail")
            return tried(state, dt)

        return af.dynamics.Stepper(
            equation, exact=af.dynamics.SnesSolver(equation, attempts=attempt)
        )

    return stepper
