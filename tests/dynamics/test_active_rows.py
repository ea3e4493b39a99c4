"""The dense problem in the active joint rows: forces in balance as joints open, close and slide."""

from itertools import pairwise

import numpy as np
import pytest
from glued import glued

import archfem as af
from archfem.dynamics import Equation, SnesSolver, Stepper
from archfem.dynamics.solvers.active_rows import MAX_DIRECT_ROWS
from archfem.dynamics.solvers.compliance import ComplianceSolver
from archfem.dynamics.solvers.joint_law import gap_rows

DT, STEPS = 0.005, 40

CONSERVING, NEWMARK = af.dynamics.Conserving(), af.dynamics.Newmark()


class RandomRun:
    """Steps of a ring by the solver alone, the acceleration of the ground random in each."""

    def __init__(self, fidelity, rule, scheme, stiffness):
        contact = af.Contact(stiffness, 0.4 * stiffness, 0.5)
        shape = af.circular_arch(
            radius=3.0, thickness=0.5, embrace=150.0, voussoirs=13, contact=contact
        )
        structure = shape if scheme == CONSERVING else glued(shape)
        model = af.build(structure, fidelity=fidelity, cells=(4, 2), quadrature=rule)
        samples = np.random.default_rng(1).normal(0.0, 15.0, STEPS + 1)
        motion, damping = af.Motion(samples, DT), af.StiffnessDamping(0.05, 9.0)
        self.equation = Equation(model, motion, damping, scheme)
        self.stepper = Stepper(self.equation, ComplianceSolver.of(self.equation))
        rest = self.equation.at_rest(af.dead_load(model).q)
        self.batch, states = self.continued(rest, STEPS)
        self.states = [rest, *states]

    def continued(self, start, count):
        """Steps from a state, with the rows that were active before, and the states they reach."""
        times = start.time + DT * np.arange(1, count + 1)
        batch = self.stepper.advance_batch(start, DT, times)
        return batch, [batch.state(k) for k in range(len(batch.times))]

    @property
    def opened(self):
        """Whether each opening row of the gaps is open, from step to step (steps + 1, rows)."""
        gaps = gap_rows(self.equation.joints)
        openings = [gaps.rows @ state.q + gaps.offset for state in self.states]
        return np.array(openings)[:, : gaps.openings] > 0.0


# models, whether more rows open at once than are solved for by a factor, and the iterations that
# Newton's method takes in a step on average, rounded up
RUNS = {
    "few rows": ("rigid", "exact", CONSERVING, 1e9, False, 6.0),
    "many rows": ("condensed", "lobatto", CONSERVING, 1e9, True, 8.0),
    # the residual does not always fall fast, and a factor is used instead
    "stiff joints": ("condensed", "exact", CONSERVING, 1e11, True, 16.0),
    "at an instant": ("condensed", "exact", NEWMARK, 1e9, False, 7.0),
}


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=pytest.mark.slow if name in ("many rows", "stiff joints") else ())
        for name in RUNS
    ],
)
def case(request):
    *model, many, iterations = RUNS[request.param]
    return RandomRun(*model), many, iterations


def test_joints_open_and_close_and_newton_converges_fast(case):
    run, many, iterations = case
    assert len(run.batch.times) == STEPS
    changes = np.diff(run.opened.astype(int), axis=0)
    # on average each row opens and closes once in 40 steps, and did twice in 60
    assert min((changes > 0).sum(), (changes < 0).sum()) > run.opened.shape[1]
    assert (run.opened.sum(axis=1).max() > MAX_DIRECT_ROWS) == many
    assert run.batch.iterations.mean() < iterations


def test_forces_that_the_joint_operator_evaluates_balance(case):
    """To 1e-10 of the forces of joints that would all be closed and stuck."""
    run, *_ = case
    equation = run.equation
    for (before, after), found in zip(pairwise(run.states), run.batch.resultants, strict=True):
        model, times = equation.with_memory(before), np.array([after.time])
        if equation.conserving:
            step = model.begin_step(before.q, equation.lag / DT)
            force, resultants, memory = (
                evaluate(after.q) for evaluate in (step.force, step.resultants, step.updated_memory)
            )
            assert after.memory == pytest.approx(memory, rel=1e-12, abs=1e-16)
            acceleration = (after.velocity - before.velocity) / DT
            velocity = 0.5 * (after.velocity + before.velocity)
        else:
            contact = equation.contact(after)
            force, resultants = model.force(contact), model.resultants(contact)
            acceleration, velocity = after.acceleration, after.velocity
        assert found == pytest.approx(resultants, abs=1e-10 * np.abs(resultants).max())
        load = equation.weight - model.mass_influence @ equation.ground(times, DT)[0, 0]
        off = model.mass @ acceleration + equation.viscous @ velocity + force - load
        assert np.abs(off).max() < 1e-10 * np.abs(model.closed_tangent() @ after.q).max()


def test_steps_are_those_of_snes(case):
    """Of four steps SNES may give up one, as rounding decides where joints are stiff."""
    run, *_ = case
    exact = SnesSolver(run.equation, af.statics.Newton(tolerance=1e-13))
    given_up = 0
    for k in range(0, STEPS, 10):
        try:
            expected, found = exact.whole(run.states[k], DT), run.states[k + 1]
        except af.DidNotConverge:
            given_up += 1
            continue
        moved = np.abs(found.q - run.states[k].q).max()
        assert found.q == pytest.approx(expected.state.q, abs=1e-9 * moved)
        largest = np.abs(expected.resultants).max()
        assert run.batch.resultants[k] == pytest.approx(expected.resultants, abs=1e-9 * largest)
    assert given_up <= 1


def test_rows_that_were_active_before_do_not_matter(case):
    """Steps are repeated from later ones to earlier ones, with the workspace of those."""
    run, *_ = case
    for k in (30, 15, 0):
        _, states = run.continued(run.states[k], 5)
        assert len(states) == 5
        for again, once in zip(states, run.states[k + 1 :], strict=False):
            assert again.q == pytest.approx(once.q, abs=1e-9 * np.abs(once.q).max())
