"""Without PETSc: SciPy finds the same equilibria."""

import sys

import numpy as np
import pytest
from scipy import sparse

import archfem as af
from archfem.statics import Newton, newton, newton_iteration
from archfem.statics.newton import EquilibriumSolver


@pytest.fixture
def alone(monkeypatch):
    """FEniCSx and its libraries as if not installed."""

    def found(name):
        return None if name in ("dolfinx", "petsc4py", "mpi4py") else name

    monkeypatch.setattr(newton, "find_spec", found)


def kinked(q):
    """The force of a spring that is stiff where it is closed, under a load."""
    return np.where(q < 0.0, 2.0, 1e-3) * q + 1.0


def stiffness(q):
    return sparse.csr_matrix([[2.0 if q[0] < 0.0 else 1e-3]])


@pytest.mark.parametrize("search", ["basic", "cp", "bt"])
def test_a_kink_is_solved_exactly(alone, search):
    solved = EquilibriumSolver(1).solve(kinked, stiffness, np.array([5.0]), 1.0, [search])
    assert solved.q[0] == pytest.approx(-0.5, rel=1e-9)


def test_a_dead_load_is_that_of_petsc(ring, monkeypatch):
    """Both solve to 1e-10 of the load."""
    model = af.build(ring, fidelity="rigid")
    monkeypatch.setattr(newton, "MAX_SCIPY_UNKNOWNS", 0)
    usual = af.dead_load(model)
    monkeypatch.setattr(newton, "find_spec", lambda name: None)
    other = af.dead_load(model)
    assert other.q == pytest.approx(usual.q, rel=1e-8, abs=1e-8 * np.abs(usual.q).max())


def test_full_steps_of_small_systems_need_no_petsc(monkeypatch):
    """PETSc searches along a step; options are for it alone, and so are large systems."""
    monkeypatch.setitem(sys.modules, "archfem.statics.snes", None)
    start = np.array([5.0])
    light = EquilibriumSolver(1, prefer_scipy=True)
    assert light.solve(kinked, stiffness, start, 1.0, ["basic"]).q[0] == pytest.approx(-0.5)
    with pytest.raises(af.errors.NotInstalled):
        light.solve(kinked, stiffness, start, 1.0, ["cp"])
    with pytest.raises(af.errors.NotInstalled):
        EquilibriumSolver(1, Newton(petsc={"snes_monitor": ""}), prefer_scipy=True)
    many = EquilibriumSolver(newton.MAX_SCIPY_UNKNOWNS + 1, prefer_scipy=True)
    with pytest.raises(af.errors.NotInstalled):
        many.solve(kinked, stiffness, start, 1.0, ["basic"])


@pytest.mark.parametrize(
    ("force", "tangent", "says"),
    [
        (lambda q: q * 0.0 + 1.0, lambda q: sparse.csr_matrix([[0.0]]), "the tangent is singular"),
        (lambda q: q + np.nan, stiffness, "the residual is not a number"),
        (lambda q: np.exp(q), lambda q: sparse.csr_matrix([[np.exp(q[0])]]), "too many iterations"),
    ],
)
def test_an_equation_without_a_solution_is_refused_with_the_reason(alone, force, tangent, says):
    with pytest.raises(af.DidNotConverge, match=says):
        EquilibriumSolver(1).solve(force, tangent, np.array([0.0]), 1.0, ["basic"])


@pytest.mark.parametrize(
    ("search", "force"), [("cp", lambda q: 1.0 + q**2), ("bt", lambda q: 1.0 + 0.0 * q)]
)
def test_a_step_that_leads_nowhere_down(alone, search, force):
    with pytest.raises(af.DidNotConverge, match="no way down"):
        EquilibriumSolver(1).solve(force, stiffness, np.array([5.0]), 1.0, [search])


def test_a_search_down_the_residual_converges_where_full_steps_oscillate(alone):
    """arctan from 2, whose full steps grow; it needs no energy, and the root is 0."""

    def slope(q):
        return sparse.csr_matrix([[1.0 / (1.0 + q[0] ** 2)]])

    with pytest.raises(af.DidNotConverge), np.errstate(over="ignore"):
        EquilibriumSolver(1).solve(np.arctan, slope, np.array([2.0]), 1.0, ["basic"])
    solved = EquilibriumSolver(1).solve(np.arctan, slope, np.array([2.0]), 1.0, ["bt"])
    assert abs(solved.q[0]) < 1e-10  # the tolerance of a solve, relative to a load of 1


@pytest.mark.parametrize(("search", "most"), [("basic", 12), ("bt", 60)])
def test_full_steps_are_given_up_sooner_than_searches(alone, search, most):
    """The root of e^q, which is nowhere: each step is one to the left, and halves no more."""

    def exponential(q):
        return sparse.csr_matrix([[np.exp(q[0])]])

    with pytest.raises(af.DidNotConverge, match=f"after {most} iterations: too many"):
        EquilibriumSolver(1).solve(np.exp, exponential, np.zeros(1), 1e-40, [search])


def test_errors_of_missing_petsc_state_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "archfem.statics.snes", None)
    with pytest.raises(af.errors.NotInstalled, match="python3-dolfinx"):
        EquilibriumSolver(1, Newton(petsc={"pc_type": "svd"}))


@pytest.mark.parametrize("library", ["PETSc", "SciPy"])
def test_a_block_held_by_rounding_alone_is_no_equilibrium(library, request):
    """A stiff block that flies away, but for a stiffness of the size of rounding: 1e9 m far."""
    if library == "SciPy":
        request.getfixturevalue("alone")
    stiff = sparse.csr_matrix([[1e11, -1e11], [-1e11, 1e11 + 1e-4]])
    load = np.array([0.0, 1e5])
    with pytest.raises(af.DidNotConverge, match=r"rounding holds it|singular|iterations"):
        EquilibriumSolver(2).solve(lambda q: stiff @ q - load, lambda q: stiff, np.zeros(2), 1e5)


@pytest.mark.parametrize(
    ("zero", "share"), [(0.3, 0.3), (1.0, 1.0), (700.0, 700.0), (5.3e5, 0.0), (5.2e5, 5.2e5)]
)
def test_the_lowest_place_along_a_step(zero, share):
    """Where the slope vanishes: a step may be doubled twenty times, to 2^19 = 524288 of it."""
    found = newton_iteration._find_critical_point(lambda along: 1e-6 * (along - zero))
    assert found == pytest.approx(share, rel=1e-9)


def test_where_energy_rises_no_step_is_taken():
    assert newton_iteration._find_critical_point(lambda along: 0.0) == 0.0
    assert newton_iteration._find_critical_point(lambda along: along + 0.01) == 0.0


@pytest.mark.parametrize(
    ("slope", "share"), [(1.01e-4, 1.0), (0.99e-4, 0.0), (0.0, 0.0), (-1.0, 0.0)]
)
def test_a_step_is_taken_where_the_residual_falls_by_a_ten_thousandth_of_it(slope, share):
    """Armijo's condition, of a residual straight along the step: up to where it is round-off."""
    found = newton_iteration._backtrack(lambda along: 3.0 * (1.0 - slope * along))
    assert found == pytest.approx(share, abs=1e-9)


@pytest.mark.parametrize(("falls", "share"), [(0.3, 0.25), (2.0**-39, 2.0**-39), (2.0**-40, 0.0)])
def test_a_step_is_halved_forty_times_at_most(falls, share):
    """A residual that is lower only up to a share of the step."""
    found = newton_iteration._backtrack(lambda along: 0.5 if 0.0 < along <= falls else 1.0)
    assert found == share
