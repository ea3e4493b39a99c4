"""Batches of steps by a solver, and steps that it leaves to SNES."""

from types import SimpleNamespace

import numpy as np
import pytest
from glued import glued
from repeats import each_once

import archfem as af
from archfem.dynamics import Stepper
from archfem.dynamics.solvers.base import advance
from archfem.dynamics.solvers.compliance import ComplianceSolver
from archfem.dynamics.solvers.newton import NewtonSolver

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
MOTION = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3)


@pytest.mark.parametrize(
    ("rule", "scheme", "solver"),
    each_once(
        ("exact", "lobatto"),
        (af.dynamics.Conserving(), af.dynamics.Newmark()),
        (NewtonSolver, ComplianceSolver),
    ),
)
def test_a_stepper_falls_back(ring, rule, scheme, solver):
    """With one pass allowed, every step that opens or closes a point is left to SNES."""
    slides = scheme == af.dynamics.Conserving()
    model = af.build(ring if slides else glued(ring), fidelity="rigid", quadrature=rule)
    newton, short = af.statics.Newton(tolerance=1e-13), MOTION.cut(1.2, 1.3)
    equation = af.dynamics.Equation(model, short, DAMPING, scheme)
    solves, given = af.dynamics.SnesSolver(equation, newton), {"newton": newton, "dt": 0.005}
    exact = af.time_history(model, short, method=Stepper(equation, exact=solves), **given)
    stepper = Stepper(equation, solver.of(equation), exact=solves, advance=_one_pass)
    run = af.time_history(model, short, method=stepper, **given)
    assert run.dataset.attrs["fallback_steps"] > 10
    assert exact.dataset.attrs["fallback_steps"] == 0
    assert run.dataset["iterations"].max() > 40  # all of the solver, and those of SNES
    off = np.abs(run.joints["M"] - exact.joints["M"]).max()
    assert off < 1e-8 * np.abs(exact.joints["M"]).max()
    drifts = [each.dataset["energy_drift"].values for each in (run, exact)]
    if slides:
        assert np.abs(drifts).max() < 1e-6  # of a joule, where tens are exchanged
    else:
        assert np.abs(drifts[0] - drifts[1]).max() < 1e-6 * np.abs(drifts[1]).max()


def test_a_step_that_does_not_settle_is_halved_by_the_solver(ring):
    """Halves of steps of which none settles whole, by SNES neither, are steps half as long.

    Forces over the whole step are the mean of both.
    """
    model, short = af.build(ring, fidelity="rigid"), MOTION.cut(1.2, 1.4)
    equation = af.dynamics.Equation(model, short, DAMPING, af.dynamics.Conserving())
    solves = af.dynamics.SnesSolver(equation, attempts=_refused)
    halving = Stepper(equation, NewtonSolver.of(equation), exact=solves, advance=_never_the_first())
    run = af.time_history(model, short, dt=0.005, method=halving)
    plain = Stepper(equation, NewtonSolver.of(equation))
    fine = af.time_history(model, short, dt=0.0025, method=plain)
    attributes = run.dataset.attrs
    assert (attributes["halved_steps"], attributes["fallback_steps"]) == (attributes["steps"], 0)
    assert attributes["shortest_step"] == 0.0025
    for name in ("M", "V", "slip"):
        most = np.abs(fine.joints[name]).max()
        halves = [fine.joints[name].values[k::2] for k in (1, 2)]
        expected = halves[1] if name == "slip" else 0.5 * (halves[0] + halves[1])
        off = np.abs(run.joints[name].values[1:] - expected)
        assert off.max() < 1e-8 * most  # each begins from λ = 0, and ends where rounding ends
    drifts = run.dataset["energy_drift"].values, fine.dataset["energy_drift"].values[::2]
    assert np.abs(drifts).max() < 1e-6  # of a joule, where tens are exchanged


def _one_pass(series, memories, results, ground, system):
    """Stop before the first step that took more than one pass, four steps at most at a time."""
    few = tuple(each[:4] for each in results)
    count = advance(series[:5], memories[:5], few, ground[:, :4].copy(), system)
    many = np.flatnonzero(results[1][:count] > 1)
    return int(many[0]) if len(many) else count


def _refused(state, dt, searches):
    """Find nothing; halves of the step take less time than a line search."""
    assert searches == 1
    raise af.DidNotConverge("no equilibrium")


def _never_the_first():
    """A loop that takes no step of the first system that it is given."""
    first = []

    def loop(series, memories, results, ground, system):
        first.append(system)
        return 0 if system is first[0] else advance(series, memories, results, ground, system)

    return loop


def test_a_step_is_halved_by_the_solver_three_times_at_most():
    """Each part is tried as a whole first; the shortest is an eighth."""
    tried, stepper = [], object.__new__(Stepper)

    def advance_batch(state, dt, times):
        tried.append(dt)
        return SimpleNamespace(times=())

    stepper.advance_batch = advance_batch
    assert stepper._in_parts(SimpleNamespace(time=0.0), 0.8, 3) is None
    assert tried == [0.4, 0.2, 0.1]
