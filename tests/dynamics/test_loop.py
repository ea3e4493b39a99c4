"""The loop over steps, apart from the solvers that archfem has."""

from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.extending import overload

import archfem as af
from archfem.dynamics.solvers.base import advance, evaluate_step, solve_step, start_run

GRAVITY = 9.81
FRICTION = 0.5


class SlidingSystem(NamedTuple):
    """A block that slides on the ground, whose joint has its slip as a state."""

    mass: float
    dt: float
    stored: float
    work: np.ndarray  # the friction that acts, and how far the block has slid, there and back


class Sliding:
    """Coulomb's friction: neither linear nor elastic."""

    name = "sliding"
    order = np.arange(3)
    measures_faces = False

    def __init__(self, equation):
        self.mass = equation.model.mass[0, 0]
        q = af.dead_load(equation.model).q
        self.stored = equation.model.energy(q) - equation.weight @ q  # at rest, and for good

    @classmethod
    def of(cls, equation):
        return cls(equation)

    def system(self, dt):
        return SlidingSystem(self.mass, dt, self.stored, np.zeros(2))


def slides(system):
    return getattr(system, "instance_class", None) is SlidingSystem


@overload(start_run)
def _start_run(system, state, memory):
    if slides(system):

        def start(system, state, memory):
            system.work[0], system.work[1] = 0.0, memory[0]

        return start


@overload(solve_step)
def _solve_step(system, step, states, ground):
    if slides(system):

        def slide(system, step, states, ground):
            (before, after), dt = states, system.dt
            after[:] = before
            free = before[1, 0] - dt * ground[0]
            after[1, 0] = np.sign(free) * max(abs(free) - FRICTION * GRAVITY * dt, 0.0)
            moved = 0.5 * dt * (before[1, 0] + after[1, 0])
            after[0, 0] = before[0, 0] + moved
            after[2, 0] = (after[1, 0] - before[1, 0]) / dt
            system.work[0] = -system.mass * (after[2, 0] + ground[0])
            system.work[1] += abs(moved)
            return 1

        return slide


@overload(evaluate_step)
def _evaluate_step(system, step, states, ground, results, memory):
    if slides(system):

        def evaluated(system, step, states, ground, results, memory):
            resultants, energy, _ = results
            memory[:] = system.work[1]
            moved = states[1, 0, 0] - states[0, 0, 0]
            resultants[0, 0] = system.mass * GRAVITY
            resultants[0, 1] = system.work[0]
            resultants[0, 2] = 0.0
            energy[1] = system.stored
            energy[0] = 0.5 * system.mass * states[1, 1, 0] ** 2
            energy[2] = -system.mass * ground[0] * moved
            energy[3] = system.work[0] * moved

        return evaluated


@pytest.mark.slow
def test_a_solver_with_memory_and_friction_is_stepped_by_the_same_loop():
    """Newmark's block: a pulse a for a time t slides it by ½ (a - μ g) t² a/(μ g)."""
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid")
    dt, pulse, lasts = 1e-4, 0.8 * GRAVITY, 0.3
    ground = np.where(np.arange(10_001) * dt < lasts, -pulse, 0.0)
    equation = af.dynamics.Equation(model, af.Motion(ground, dt))
    sliding = Sliding.of(equation)
    loop = numba.njit(advance.py_func)  # not kept: this file may change
    stepper = af.dynamics.Stepper(equation, sliding, advance=loop)
    run = af.time_history(model, equation.motion, dt=dt, method=stepper)
    over = pulse - FRICTION * GRAVITY
    slid = 0.5 * over * lasts**2 * pulse / (FRICTION * GRAVITY)
    assert len(run.time) > 10 * 128  # steps of a batch
    assert run.dataset.attrs["method"] == "sliding"
    assert run.dataset["last_q"].values[0] == pytest.approx(slid, rel=1e-3)
    assert np.abs(run.joints["V"]).max() <= FRICTION * run.joints["N"].max() * (1.0 + 1e-9)
    lost = FRICTION * sliding.mass * GRAVITY * slid
    assert abs(run.dataset["energy_drift"].values[-1]) < 0.01 * lost
    *_, last = stepper.batches(equation.at_rest(af.dead_load(model).q), dt, ground.size * dt - dt)
    state = last.state(len(last.times) - 1)
    assert state.time == pytest.approx(1.0)
    assert state.memory == pytest.approx(slid, rel=1e-3)  # through all batches, at each point
