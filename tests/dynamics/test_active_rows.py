"""The dense problem in the active joint rows: its compliance, its equations, their solution."""

import numpy as np
import pytest
from kernels import from_python

from archfem.dynamics.solvers import active_compliance, active_rows, joint_law
from archfem.dynamics.solvers.active_compliance import ActiveRows

add_columns = from_python(active_compliance.add_columns)
add_gaps = from_python(active_compliance.add_gaps)
begin_problem = from_python(active_compliance.begin_problem)
update_columns = from_python(active_compliance.update_columns)
prepare_equations = from_python(active_rows.prepare_equations)
solve_equations = from_python(active_rows.solve_equations)
hold_reversed = from_python(joint_law.hold_reversed)

FEW, MANY = 50, 200
"""Rows that are solved for by a factor, as up to 100 are, and by minimal residuals."""

RESIDUAL = 3e-4
"""Of minimal residuals, relative to the first."""

# kernels are compiled anew where tests call them from Python
pytestmark = pytest.mark.slow


def compliance_of(full: np.ndarray) -> ActiveRows:
    """The workspace of a compliance whose rows are all filled."""
    active = ActiveRows.of(len(full), len(full), 4 * len(full))
    active.full[:] = full
    return active


def enter(active: ActiveRows, places: np.ndarray, values: np.ndarray) -> None:
    """Write down derivatives of λ."""
    active.derivatives[0][: len(places), :2] = places
    active.derivatives[1][: len(values)] = values


def symmetric(size: int) -> ActiveRows:
    """A compliance of random entries."""
    half = np.random.default_rng(0).random((size, size))
    return compliance_of(half + half.T)


def test_rows_come_and_go_from_problem_to_problem():
    """Gaps are those by all of F, after any other problem."""
    size, rng = 250, np.random.default_rng(1)
    active = symmetric(size)
    for _ in range(60):
        rows = np.flatnonzero(rng.random(size) < rng.random())
        begin_problem(active, rows)
        numbers = active.numbers[: active.sizes[0]]
        assert sorted(numbers) == rows.tolist()
        assert active.place[numbers].tolist() == list(range(len(rows)))
        assert np.count_nonzero(active.place >= 0) == len(rows)
        for _ in range(2):
            some = rng.random(len(rows)) < rng.random()
            force, gaps = np.where(some, rng.random(len(rows)), 0.0), np.ones(len(rows))
            update_columns(active, np.zeros(len(rows)), force, 0)
            add_gaps(active, force, gaps)
            by_all = 1.0 + active.full[np.ix_(numbers, numbers)] @ force
            assert np.allclose(gaps, by_all, rtol=1e-13)  # of at most 250 terms of one sign
            columns = active.row_of[: active.sizes[1]]
            assert set(np.flatnonzero(force)) == set(columns)
            assert active.column_of[columns].tolist() == list(range(len(columns)))


def test_points_that_reverse_their_slip_are_held():
    """They release nothing, and what they release has no derivative, until they slide again."""
    released, last = np.array([-4.0, 3.0, 5.0, -6.0, 0.0]), np.array([2.0, 1.0, 0.0, -1.0, 7.0])
    rows, values = np.array([[0, 0, 0], [0, 1, 1], [1, 0, 2], [4, 4, 3]]), np.ones(4)
    hold_reversed(last, released, (rows, values), 4)
    assert released.tolist() == [0.0, 3.0, 5.0, -6.0, 0.0]
    assert values.tolist() == [0.0, 0.0, 1.0, 1.0]


def ring_of_gaps(size: int, weight: float) -> tuple[ActiveRows, np.ndarray]:
    """Equations in which each gap is moved by both its neighbours, and 1 - λ' F."""
    shift = np.roll(np.eye(size), 1, axis=1)
    active, rates = compliance_of(weight * (shift + shift.T)), np.linspace(0.5, 1.0, size)
    begin_problem(active, np.arange(size))
    enter(active, np.stack([np.arange(size)] * 2, axis=1), rates)
    add_columns(active, np.zeros(size), size)
    return active, np.eye(size) - rates[:, None] * active.full


@pytest.mark.parametrize(
    ("size", "weight", "spread"),
    [
        (FEW, 1.3, 1e-12),
        (MANY, 0.3, RESIDUAL),
        (MANY, 1.3, 1e-12),
    ],
    ids=["few", "many", "many for which residuals do not fall"],
)
def test_equations_are_solved_however_many_there_are(size, weight, spread):
    """Where residuals do not fall fast, a factor is used."""
    active, matrix = ring_of_gaps(size, weight)
    right = np.random.default_rng(1).random(size)
    change = right.copy()
    prepare_equations(active, size)
    assert active.sizes[3] == size
    solve_equations(change, active, size)
    left = matrix @ change - right
    assert np.linalg.norm(left) <= 10.0 * spread * np.linalg.norm(right)  # and rounding


def test_rows_without_derivative_and_force_have_no_equation():
    active = symmetric(FEW)
    begin_problem(active, np.arange(FEW))
    enter(active, np.array([[5, 6], [5, 7], [9, 9]]), np.array([0.01, 0.02, 0.03]))
    add_columns(active, np.eye(FEW)[3], 3)
    prepare_equations(active, 3)
    assert active.row_of[: active.sizes[3]].tolist() == [3, 5, 9]
    matrix, change = np.eye(FEW), np.zeros(FEW)
    matrix[5] -= 0.01 * active.full[6] + 0.02 * active.full[7]
    matrix[9] -= 0.03 * active.full[9]
    change[[3, 5]] = 1.0, 2.0
    exact = np.linalg.solve(matrix, change)
    solve_equations(change, active, 3)
    assert np.allclose(change, exact, rtol=1e-12)


def test_zero_residual_changes_nothing():
    active, _ = ring_of_gaps(MANY, 0.3)
    change = np.zeros(MANY)
    prepare_equations(active, MANY)
    solve_equations(change, active, MANY)
    assert (change == 0.0).all()
