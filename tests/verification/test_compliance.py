"""The stepper for large structures: its factor, its small problem, and the histories it gives."""

from dataclasses import replace

import numpy as np
import pytest
from glued import glued
from kernels import each_way, either  # noqa: F401  (a fixture)
from scipy import sparse
from scipy.sparse.linalg import splu

import archfem as af
from archfem.dynamics.solvers import newmark, supernodal_lu
from archfem.dynamics.solvers.base import advance
from archfem.dynamics.solvers.compliance import ComplianceSolver
from archfem.dynamics.solvers.newmark import step_numbers
from archfem.dynamics.solvers.supernodal_lu import (
    Elimination,
    symmetric_factor,
)

TIGHT = af.statics.Newton(tolerance=1e-13)
STRONG = af.Motion.synthetic(duration=4.0, pga=5.0, seed=5).cut(1.0, 1.6)
BRIEF = STRONG.cut(0.0, 0.25)
NEWMARK, CONSERVING = af.dynamics.Newmark(), af.dynamics.Conserving()


@pytest.fixture(scope="module")
def filled():
    """One span under backfill."""
    arch = af.shapes.Arch(
        measured="centre line",
        span=5.8,
        embrace=159.0,
        thickness=0.58,
        voussoirs=9,
        name="main arch",
    )
    return af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.4))


@pytest.mark.parametrize("rule", [pytest.param("lobatto", marks=pytest.mark.slow), "exact"])
@pytest.mark.parametrize(
    ("joints", "scheme"),
    [
        pytest.param("closed", CONSERVING, marks=pytest.mark.slow),
        pytest.param("closed", NEWMARK, marks=pytest.mark.slow),
        ("initial", af.HHT(-0.1)),
        pytest.param("none", CONSERVING, marks=pytest.mark.slow),
        pytest.param("none", af.HHT(-0.2), marks=pytest.mark.slow),
    ],
)
def test_history_is_that_of_snes(filled, rule, joints, scheme):
    """Histories and energies agree to 1e-8 of the largest, with a sixth of the points open.

    A few steps in which exact facets slide, fewer than a tenth, are left to SNES.
    """
    structure = filled if scheme == CONSERVING else glued(filled)
    model = af.build(structure, quadrature=rule, cells=(2, 2))
    given = {
        "start": af.dead_load(model, TIGHT),
        "damping": af.Rayleigh(0.05, (4.0, 20.0), joints),
        "scheme": scheme,
        "newton": TIGHT,
        "dt": 0.005,
    }
    slow, fast = (
        af.time_history(model, BRIEF, method=method, **given) for method in ("snes", "compliance")
    )
    assert fast.dataset.attrs["method"] == "compliance"
    hard = rule == "exact" and scheme == CONSERVING
    assert fast.dataset.attrs["fallback_steps"] <= (0.1 * len(fast.time) if hard else 0)
    last = model.operator.openings(fast.dataset["last_q"].values)
    assert np.mean(last > 0.0) > 1.0 / 6.0
    for key in ("N", "V", "M"):
        off = np.abs(fast.joints[key] - slow.joints[key]).max()
        assert off < 1e-8 * np.abs(slow.joints[key]).max()
    drift = fast.dataset["energy_drift"] - slow.dataset["energy_drift"]
    assert np.abs(drift).max() < 1e-6  # of a joule, where hundreds are exchanged


@pytest.mark.slow
def test_steps_that_do_not_converge_are_left_to_snes(filled):
    model = af.build(filled, fidelity="rigid")
    equation = af.dynamics.Equation(model, STRONG, af.Rayleigh(0.05, (4.0, 20.0)))

    def impatient(series, memories, results, ground, system):
        count = advance(series, memories, results, ground, system)
        many = np.flatnonzero(results[1][:count] > 4)
        return int(many[0]) if len(many) else count

    solves = af.dynamics.SnesSolver(equation, TIGHT)
    given = {"newton": TIGHT, "dt": 0.005}
    alone = af.dynamics.Stepper(equation, exact=solves)
    exact = af.time_history(model, STRONG, method=alone, **given)
    stepper = af.dynamics.Stepper(
        equation, ComplianceSolver.of(equation), exact=solves, advance=impatient
    )
    run = af.time_history(model, STRONG, method=stepper, **given)
    assert run.dataset.attrs["fallback_steps"] > 3
    off = np.abs(run.joints["M"] - exact.joints["M"]).max()
    assert off < 1e-8 * np.abs(exact.joints["M"]).max()


update_images = either(newmark.update_images)
solve_forward = either(supernodal_lu.solve_forward)
solve_backward = either(supernodal_lu.solve_backward)


def solve(factor, vector):
    """Solve in place."""
    solve_forward(factor, vector)
    solve_backward(factor, vector, np.ones(len(factor.parent), bool))


def laplacian(side):
    """A matrix of a grid, and one of a piece apart from it."""
    line = sparse.diags([-1.0, 2.01, -1.0], [-1, 0, 1], (side, side))
    whole = sparse.identity(side)
    grid = sparse.kron(line, whole) + sparse.kron(whole, line)
    return sparse.block_diag([grid, line], format="csr")


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize("side", [2, 7, 30])
def test_factor_solves(side):
    matrix = laplacian(side)
    plan = Elimination.of(matrix)
    factor = symmetric_factor(matrix[plan.order][:, plan.order], plan)
    right = np.random.default_rng(1).standard_normal(matrix.shape[0])
    ordered = right[plan.order]
    solve_forward(factor, ordered)
    half, marked = ordered.copy(), np.ones(len(factor.parent), bool)
    solve_backward(factor, ordered, marked)
    solution = np.empty(len(right))
    solution[plan.order] = ordered
    assert matrix @ solution == pytest.approx(right, abs=1e-12)
    # A branch of the tree is solved the same without the rest.
    marked[:], group = False, 0
    while group >= 0:
        marked[group] = True
        group = factor.parent[group]
    solve_backward(factor, half, marked)
    inside = marked[plan.group_of]
    assert half[inside] == pytest.approx(ordered[inside], abs=1e-13)


def with_crumbs(rng):
    """A symmetric matrix but for some entries that are mere rounding, each without its mirror."""
    size = int(rng.integers(5, 60))
    sides = rng.integers(size, size=(2, 2 * size))
    matrix = np.zeros((size, size))
    matrix[sides[0], sides[1]] = rng.uniform(size=2 * size)
    matrix += matrix.T + 10.0 * size * np.eye(size)
    crumbs = rng.integers(size, size=(2, 24))
    matrix[tuple(crumbs)] += np.where(matrix[tuple(crumbs)] == 0.0, 1e-16, 0.0)
    return matrix


@pytest.mark.usefixtures("each_way")
def test_factor_bears_entries_that_rounding_has_left_on_one_side():
    """Three of 1800 such entries, six in each of 300 matrices, used to lie outside the plan."""
    rng = np.random.default_rng(1)
    for _ in range(75):
        matrix = with_crumbs(rng)
        plan = Elimination.of(sparse.csr_matrix(matrix))
        ordered = sparse.csr_matrix(matrix)[plan.order][:, plan.order]
        factor, right = symmetric_factor(ordered, plan), rng.standard_normal(len(matrix))
        found = right[plan.order]
        solve(factor, found)
        assert found == pytest.approx(np.linalg.solve(matrix, right)[plan.order], abs=1e-13)


def test_an_entry_outside_the_plan_is_refused():
    """It would be put anywhere."""
    plan = Elimination.of(sparse.identity(8, format="csr"))
    matrix = sparse.identity(8, format="lil")
    matrix[7, 0] = matrix[0, 7] = 0.1
    with pytest.raises(ValueError, match="the pattern of its factor lacks"):
        symmetric_factor(matrix.tocsr(), plan)


def shuffled_structure(rng):
    """A ring, a column, or a ring on piers, of stones some of which are soft as soil."""
    kind, contact = rng.integers(3), af.Contact(10.0 ** rng.uniform(8.5, 11.0), 3e8, 0.6)
    radius = rng.uniform(1.0, 4.0)
    if kind == 0:
        made = af.column(breadth=radius, heights=list(rng.uniform(0.3, 2.0, 4)), contact=contact)
    elif kind == 1:
        made = af.circular_arch(
            radius=radius,
            thickness=0.2 * radius,
            embrace=rng.uniform(100.0, 180.0),
            voussoirs=int(rng.integers(4, 12)),
            contact=contact,
        )
    else:
        made = af.arch_on_piers(
            radius=radius,
            thickness=0.2 * radius,
            voussoirs=int(rng.integers(4, 9)),
            pier_breadth=rng.uniform(0.4, 0.8) * radius,
            courses=[0.4 * radius] * int(rng.integers(1, 4)),
            contact=contact,
        )
    soft = replace(af.STONE, young=10.0 ** rng.uniform(6.0, 9.0), name="soft")
    stones = tuple(
        replace(block, material=soft) if rng.random() < 0.4 else block for block in made.blocks
    )
    return replace(made, blocks=stones)


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize(
    ("first", "count"), [(0, 8), pytest.param(8, 2032, marks=pytest.mark.slow)]
)
def test_each_solve_of_a_random_structure_is_that_of_superlu(first, count):
    """Another order and another factor agree to 1e-8, with 1e12 between stiff and soft at most."""
    for seed in range(first, first + count):
        rng = np.random.default_rng(seed)
        fidelity = "rigid" if rng.random() < 0.85 else "faces"
        model = af.build(shuffled_structure(rng), fidelity=fidelity, cells=(2, 2))
        equation = af.dynamics.Equation(model, STRONG, af.StiffnessDamping(0.05, 8.0))
        solver = ComplianceSolver.of(equation)
        system = solver.system(0.005)
        inertia, rate = system.linear.numbers.inertia, system.linear.numbers.rate
        whole = model.closed_tangent() + inertia * model.mass + rate * equation.rest
        right = rng.standard_normal(model.size)
        found = right.copy()
        solve(system.factor, found)
        wanted = splu(whole.tocsc()[solver.order][:, solver.order]).solve(right)
        assert np.abs(found - wanted).max() <= 1e-8 * np.abs(wanted).max(), seed


def test_factor_keeps_sparse():
    """A grid of 900 fills in to a tenth of the dense factor at most."""
    matrix = laplacian(30)
    plan = Elimination.of(matrix)
    factor = symmetric_factor(matrix[plan.order][:, plan.order], plan)
    assert len(factor.panels) < 0.1 * matrix.shape[0] ** 2


def test_matrix_that_is_not_definite_is_refused():
    matrix = laplacian(4)
    plan = Elimination.of(matrix)
    matrix = matrix - 3.0 * sparse.identity(matrix.shape[0], format="csr")
    with pytest.raises(np.linalg.LinAlgError):
        symmetric_factor(matrix[plan.order][:, plan.order], plan)


@pytest.mark.usefixtures("each_way")
def test_images_follow_the_state():
    """Images of a random matrix, under HHT, against its products with the state."""
    rng = np.random.default_rng(4)
    numbers = step_numbers(0.005, (0.3025, 0.6, -0.1), 1e-3, 0.4)
    matrix = rng.standard_normal((8, 8))
    before, contact = rng.standard_normal((3, 8)), rng.standard_normal(8)
    after, image = np.empty((3, 8)), np.empty((3, 8))
    update_images(contact, before, after, numbers)
    update_images(matrix @ contact, before @ matrix.T, image, numbers)
    assert image == pytest.approx(after @ matrix.T, rel=1e-9)
