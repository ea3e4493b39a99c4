"""The dense problem in the active joint rows: its compliance, its equations, their solution."""

import numpy as np
import pytest

from archfem.dynamics.solvers.active_compliance import (
    COLUMN_BLOCK,
    COLUMN_ROW,
    MARK,
    MAX_KRYLOV_VECTORS,
    NUMBER,
    PLACE,
    ROW_COLUMN,
    ROW_PADDING,
    ActiveCompliance,
    add_columns,
    add_gaps,
    begin_problem,
    clear_problem,
    padded,
    products,
    update_columns,
)
from archfem.dynamics.solvers.active_rows import MAX_DIRECT_ROWS, prepare_equations, solve_equations
from archfem.dynamics.solvers.newton import hold_reversed

NONE = np.zeros((0, 3), np.int64)

FEW, MANY = MAX_DIRECT_ROWS // 2, 2 * MAX_DIRECT_ROWS
"""Rows that are solved for by a factor, and by minimal residuals."""

RESIDUAL = 3e-4
"""Of minimal residuals, relative to the first."""


def compliance_of(full: np.ndarray) -> ActiveCompliance:
    """The workspace of a compliance whose rows are all filled."""
    compliance = ActiveCompliance.of(len(full), len(full), 4 * len(full))
    compliance.full[:] = full
    return compliance


def enter(compliance: ActiveCompliance, places: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Write down derivatives of λ; returns their places."""
    compliance.derivatives[0][: len(places), :2] = places
    compliance.derivatives[1][: len(values)] = values
    return compliance.derivatives[0]


def symmetric(size: int) -> ActiveCompliance:
    """A compliance of random entries."""
    half = np.random.default_rng(0).random((size, size))
    return compliance_of(half + half.T)


def at_work(compliance: ActiveCompliance) -> tuple[np.ndarray, np.ndarray]:
    """Rows at work, and which of them are columns."""
    rows, columns = compliance.sizes[:2]
    return compliance.indices[NUMBER, :rows], compliance.indices[COLUMN_ROW, :columns]


def agrees(compliance: ActiveCompliance, force: np.ndarray) -> None:
    """Assert that gaps by the columns are those by all of F, and what is where."""
    rows, places = at_work(compliance)
    gaps, sought = np.ones(len(rows)), compliance.full[np.ix_(rows, rows)] @ force
    add_gaps(compliance, force, gaps)
    assert np.allclose(gaps, 1.0 + sought, rtol=1e-13)  # of at most 150 terms of one sign
    assert compliance.indices[PLACE, rows].tolist() == list(range(len(rows)))
    assert np.count_nonzero(compliance.indices[PLACE] >= 0) == len(rows)
    assert compliance.indices[ROW_COLUMN, places].tolist() == list(range(len(places)))
    assert np.count_nonzero(compliance.indices[ROW_COLUMN, : len(rows)] >= 0) == len(places)
    assert not compliance.flags[MARK].any()


def test_gaps_by_the_columns_are_those_by_all_of_the_compliance():
    """Columns come in as λ is no longer zero, or as a derivative of it is not; none comes twice."""
    compliance, force = symmetric(9), np.array([0.0, 3.0, 0.0, 0.0, -2.0])
    begin_problem(compliance, np.array([1, 2, 5, 6, 8]))
    add_columns(compliance, force, NONE, 0)
    assert at_work(compliance)[1].tolist() == [1, 4]
    force[0] = 0.5
    add_columns(compliance, force, np.array([[3, 1, 0], [0, 0, 0]]), 1)
    assert at_work(compliance)[1].tolist() == [1, 4, 0, 3]
    agrees(compliance, force)


def test_rows_and_columns_come_and_go_from_problem_to_problem():
    """Whatever went before, the entries are those of the rows and columns that are there."""
    size, rng = 4 * COLUMN_BLOCK, np.random.default_rng(1)
    compliance = symmetric(size)
    for problem in range(60):
        rows = np.flatnonzero(rng.random(size) < rng.random())
        begin_problem(compliance, rows)
        assert sorted(at_work(compliance)[0]) == rows.tolist()
        was, force = (
            np.where(rng.random(len(rows)) < rng.random(), rng.random(len(rows)), 0.0)
            for _ in range(2)
        )
        entries = rng.integers(0, max(len(rows), 1), (len(rows) // 3, 3))
        stay = set(np.flatnonzero(was)) & set(at_work(compliance)[1].tolist())
        update_columns(compliance, was, force, entries, len(entries))
        columns = set(np.flatnonzero(force)) | set(entries[:, 0]) | stay
        assert set(at_work(compliance)[1].tolist()) == columns
        agrees(compliance, force)
        if problem % 20 == 19:
            clear_problem(compliance)
            assert at_work(compliance)[0].size == at_work(compliance)[1].size == 0
            assert (compliance.indices[PLACE] == -1).all()


def test_points_that_reverse_their_slip_are_held():
    """They release nothing, and what they release has no derivative, until they slide again."""
    released, last = np.array([-4.0, 3.0, 5.0, -6.0, 0.0]), np.array([2.0, 1.0, 0.0, -1.0, 7.0])
    rows, values = np.array([[0, 0, 0], [0, 1, 1], [1, 0, 2], [4, 4, 3]]), np.ones(4)
    hold_reversed(last, released, (rows, values), 4)
    assert released.tolist() == [0.0, 3.0, 5.0, -6.0, 0.0]
    assert values.tolist() == [0.0, 0.0, 1.0, 1.0]


def ring_of_gaps(size: int, weight: float) -> tuple[ActiveCompliance, np.ndarray, np.ndarray]:
    """Equations in which each gap is moved by the next but for the last few, λ' and 1 - λ' F."""
    compliance = compliance_of(weight * np.roll(np.eye(size), 1, axis=1))
    rows, rates = np.arange(size), np.linspace(0.5, 1.0, size)
    begin_problem(compliance, rows)
    add_columns(compliance, np.zeros(size), np.stack([rows, rows], axis=1), size)
    for k in range(size):  # of a matrix that is not symmetric, which F would be
        compliance.entries[k * compliance.sizes[2] :][:size] = compliance.full[k]
    return compliance, rates, np.eye(size) - rates[:, None] * compliance.full


@pytest.mark.parametrize(
    ("size", "weight", "spread"),
    [
        (FEW, 2.0, 1e-12),
        (MANY, 0.3, RESIDUAL),
        (MANY, 2.0, 1e-12),
    ],
    ids=["few", "many", "many for which residuals do not fall"],
)
def test_a_pass_solves_however_many_columns_there_are(size, weight, spread):
    """Where each gap moves but the next, residuals need as many products as there are gaps."""
    assert MAX_KRYLOV_VECTORS < MANY
    compliance, rates, matrix = ring_of_gaps(size, weight)
    lacks = np.random.default_rng(1).random(size)
    places, change = np.stack([np.arange(size)] * 2, axis=1), lacks.copy()
    enter(compliance, places, rates)
    prepare_equations(compliance, size)
    solve_equations(change, compliance, size)
    left = matrix @ change - lacks
    assert np.linalg.norm(left) <= 1.01 * spread * np.linalg.norm(lacks)  # and rounding


@pytest.mark.parametrize("size", [FEW, MANY], ids=["few", "many"])
def test_equations_that_are_used_again_leave_out_columns_that_came_since(size):
    """What such a row's λ lacks, it gets; what that does to others, the next equations say."""
    compliance = symmetric(size + 1)
    compliance.full[:] *= 0.1 / size
    begin_problem(compliance, np.arange(size + 1))
    places, rates = np.stack([np.arange(size)] * 2, axis=1), np.linspace(0.5, 1.0, size)
    add_columns(compliance, np.zeros(size + 1), places, size)
    enter(compliance, places, rates)
    prepare_equations(compliance, size)
    lacks = np.random.default_rng(1).random(size + 1)
    changes = np.stack([lacks, lacks])
    solve_equations(changes[0], compliance, size)
    add_columns(compliance, np.eye(size + 1)[size], NONE, 0)
    solve_equations(changes[1], compliance, size)
    assert (changes[0, :size] != lacks[:size]).all()
    assert (changes[1] == changes[0]).all()
    assert changes[1, size] == lacks[size]


def test_nothing_lacking_changes_nothing():
    """Of a residual that is zero, none of which less could be left is sought."""
    compliance, rates, _ = ring_of_gaps(MANY, 0.3)
    places, change = (
        np.stack([np.arange(MANY)] * 2, axis=1),
        np.zeros(MANY),
    )
    enter(compliance, places, rates)
    prepare_equations(compliance, MANY)
    solve_equations(change, compliance, MANY)
    assert (change == 0.0).all()


@pytest.mark.parametrize("kind", [np.float32, float])
@pytest.mark.parametrize("rows", [1, 3, 4, 11])
def test_products_are_those_of_the_rows_up_to_the_vector(kind, rows):
    """Whole numbers, so exact; what else there is in the room of a row does not count."""
    matrix = np.random.default_rng(rows).integers(-9, 9, (rows, 2 * ROW_PADDING)).astype(kind)
    vector, images = np.arange(ROW_PADDING).astype(kind), np.full(rows, np.nan, kind)
    products(matrix.ravel(), 2 * ROW_PADDING, vector, images)
    assert (images == matrix[:, :ROW_PADDING] @ vector).all()


def test_rows_begin_with_a_line_of_memory():
    compliance = symmetric(ROW_PADDING + 1)
    rooms = (compliance.entries, compliance.single, compliance.basis, *compliance.vectors)
    assert all(room.ctypes.data % 64 == 0 for room in rooms)
    assert [padded(count) for count in (0, 1, ROW_PADDING, ROW_PADDING + 1)] == [
        0,
        ROW_PADDING,
        ROW_PADDING,
        2 * ROW_PADDING,
    ]
    assert compliance.sizes[2] == 2 * ROW_PADDING
