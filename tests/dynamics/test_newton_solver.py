"""Newton's method on the whole structure: its history, its tangent, and when it is selected."""

from dataclasses import replace

import numpy as np
import pytest
from glued import glued
from scipy import sparse

import archfem as af
from archfem.dynamics import Stepper
from archfem.dynamics.solvers import joint_law
from archfem.dynamics.solvers.newton import NewtonSolver, narrowest_width
from archfem.dynamics.solvers.selection import select_solver, stepper_for

DT = 0.005

MOTION = af.Motion.synthetic(duration=5.0, pga=6.0, seed=1)


def sliding_ring(fidelity="rigid", friction=0.3, damping=None):
    """Equation of motion of a ring whose joints slide, and its state at rest."""
    bare = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=9)
    joints = [replace(j, contact=replace(j.contact, friction=friction)) for j in bare.joints]
    model = af.build(replace(bare, joints=tuple(joints)), fidelity=fidelity, cells=(2, 2))
    equation, dead = af.dynamics.Equation(model, MOTION, damping), af.dead_load(model)
    return equation, equation.at_rest(dead.q, memory=dead.model.memory)


def _steps(equation, start, is_narrow):
    """Thirty steps from a state, with a factor of its own in each iteration or not."""
    solver = NewtonSolver(equation)
    solver._reduction = 0.0 if is_narrow else 0.01
    return list(Stepper(equation, solver).batches(start, DT, 0.15))


@pytest.mark.parametrize(
    "damping", [pytest.param(None, marks=pytest.mark.slow), af.StiffnessDamping(0.05, 8.0)]
)
@pytest.mark.parametrize("is_narrow", [True, False])
def test_the_solver_gives_the_history_of_snes(damping, is_narrow):
    """A second run gives the same bits, whether factors serve for several iterations or not."""
    equation, start = sliding_ring(damping=damping)
    runs = [_steps(equation, start, is_narrow) for _ in range(2)]
    assert not any(batch.fallback for batch in runs[0])
    result, again = (np.concatenate([b.resultants for b in batches]) for batches in runs)
    assert np.array_equal(result, again)
    exact = af.dynamics.SnesSolver(equation).batches(start, DT, 0.15)
    expected = np.concatenate([batch.resultants for batch in exact])
    assert np.abs(result - expected).max() < 1e-7 * np.abs(result).max()
    assert np.abs(runs[0][-1].state(len(runs[0][-1].times) - 1).memory).max() > 1e-4


def test_a_chain_of_rigid_stones_has_a_band_of_two_stones():
    equation, _ = sliding_ring()
    assert NewtonSolver.of(equation).half_width == 5  # six coordinates, less one


@pytest.mark.parametrize(
    ("fidelity", "scheme", "damping", "method"),
    [
        ("rigid", af.dynamics.Conserving(), "closed", "compliance"),
        ("rigid", af.dynamics.Newmark(), "none", "compliance"),
        ("full", af.dynamics.Conserving(), "closed", "compliance"),
        ("monolithic", af.dynamics.Conserving(), "closed", "snes"),
    ],
)
def test_a_short_ring_that_never_slides_selects_the_solver(ring, fidelity, scheme, damping, method):
    model = af.build(glued(ring), fidelity=fidelity, cells=(4, 4))
    rayleigh = af.Rayleigh(0.05, (8.0, 16.0), damping)
    equation = af.dynamics.Equation(model, MOTION, rayleigh, scheme)
    assert stepper_for("auto", equation).name == method


@pytest.mark.parametrize(("voussoirs", "slides"), [(17, True), (40, False)])
def test_chains_of_rigid_stones_select_the_solver_of_a_narrow_band(voussoirs, slides):
    """Joints that never slide have half as many rows, so that only long chains of them count."""
    chain = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=voussoirs)
    model = af.build(chain if slides else glued(chain), fidelity="rigid")
    solver = select_solver(af.dynamics.Equation(model, MOTION))
    assert solver.name == "newton"
    assert solver.half_width <= 12


@pytest.mark.parametrize(("voussoirs", "method"), [(17, "compliance"), (45, "newton")])
def test_long_chains_of_elastic_stones_that_slide_select_the_solver(voussoirs, method):
    """Equations in the sliding rows, which are hundreds, would take up to ten times as long."""
    ring = af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=voussoirs, width=1.0
    )
    model = af.build(ring, fidelity="condensed")
    assert select_solver(af.dynamics.Equation(model, MOTION)).name == method


def test_large_displacements_select_the_solver_at_any_width(ring):
    model = af.build(ring, fidelity="faces", cells=(4, 4), displacements="large")
    assert select_solver(af.dynamics.Equation(model, MOTION)).name == "newton"


def test_supports_that_have_moved_are_refused_by_schemes_at_an_instant(ring):
    model = af.build(glued(ring), fidelity="rigid")
    moved = model.settled(af.Settlement(0, (0.0, -1e-3, 0.0)))
    equation = af.dynamics.Equation(moved, MOTION, scheme=af.dynamics.Newmark())
    for method in ("newton", "compliance"):
        with pytest.raises(af.InvalidInput, match="supports that have not moved"):
            stepper_for(method, equation)
        assert stepper_for(method, af.dynamics.Equation(moved, MOTION)).name == method


def test_the_narrower_order_is_taken():
    """A shuffled chain gets the width of Cuthill and McKee's order; an ordered one its own."""
    chain = sparse.diags([1.0, 1.0, 1.0], [-1, 0, 1], (30, 30)).tocsr()
    shuffle = np.random.default_rng(2).permutation(30)
    for matrix in (chain, chain[shuffle][:, shuffle]):
        assert narrowest_width(matrix.tocsr()) == 1


def test_points_that_reverse_their_slip_are_held(each_way):
    """They release nothing, and what they release has no derivative, until they slide again."""
    released, last = np.array([-4.0, 3.0, 5.0, -6.0, 0.0]), np.array([2.0, 1.0, 0.0, -1.0, 7.0])
    rows, values = np.array([[0, 0, 0], [0, 1, 1], [1, 0, 2], [4, 4, 3]]), np.ones(4)
    each_way(joint_law.hold_reversed)(last, released, (rows, values), 4)
    assert released.tolist() == [0.0, 3.0, 5.0, -6.0, 0.0]
    assert values.tolist() == [0.0, 0.0, 1.0, 1.0]
