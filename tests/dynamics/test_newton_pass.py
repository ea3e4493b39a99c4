"""What a pass of Newton's method at the points that slide takes of the compliance, and of λ."""

import numpy as np
import pytest

from archfem.dynamics.stepping.columns import add_gaps, begin, forget, keep, take_in
from archfem.dynamics.stepping.compliance import DEEP, NARROW, Compliance
from archfem.dynamics.stepping.newton_pass import FEW, holding, newton_change, prepared
from archfem.dynamics.stepping.residuals import ROUGH

NONE = np.zeros((0, 2), np.int64)


def symmetric(size: int) -> Compliance:
    """A compliance of random entries."""
    half = np.random.default_rng(0).random((size, size))
    return Compliance.of(half + half.T)


def at_work(compliance: Compliance) -> tuple[np.ndarray, np.ndarray]:
    """Rows at work, and which of them are columns."""
    rows, columns = compliance.sizes[:2]
    return compliance.rows[:rows], compliance.places[:columns]


def agrees(compliance: Compliance, force: np.ndarray) -> None:
    """Assert that gaps by the columns are those by all of F, and what is where."""
    rows, places = at_work(compliance)
    gaps, sought = np.ones(len(rows)), compliance.whole[np.ix_(rows, rows)] @ force
    add_gaps(compliance, force, gaps)
    assert np.allclose(gaps, 1.0 + sought, rtol=1e-13)  # of at most 150 terms of one sign
    assert compliance.place[rows].tolist() == list(range(len(rows)))
    assert np.count_nonzero(compliance.place >= 0) == len(rows)
    assert compliance.column[places].tolist() == list(range(len(places)))
    assert np.count_nonzero(compliance.column[: len(rows)] >= 0) == len(places)
    assert not compliance.needed.any()


def test_gaps_by_the_columns_are_those_by_all_of_the_compliance():
    """Columns come in as λ is no longer zero, or as a derivative of it is not; none comes twice."""
    compliance, force = symmetric(9), np.array([0.0, 3.0, 0.0, 0.0, -2.0])
    begin(compliance, np.array([1, 2, 5, 6, 8]))
    take_in(compliance, force, NONE, 0)
    assert at_work(compliance)[1].tolist() == [1, 4]
    force[0] = 0.5
    take_in(compliance, force, np.array([[3, 1], [0, 0]]), 1)
    assert at_work(compliance)[1].tolist() == [1, 4, 0, 3]
    agrees(compliance, force)


def test_rows_and_columns_come_and_go_from_problem_to_problem():
    """Whatever went before, the entries are those of the rows and columns that are there."""
    size, rng = 4 * NARROW, np.random.default_rng(1)
    compliance = symmetric(size)
    for problem in range(60):
        rows = np.flatnonzero(rng.random(size) < rng.random())
        begin(compliance, rows)
        assert sorted(at_work(compliance)[0]) == rows.tolist()
        force = np.where(rng.random(len(rows)) < rng.random(), rng.random(len(rows)), 0.0)
        entries = rng.integers(0, max(len(rows), 1), (len(rows) // 3, 2))
        keep(compliance, force, entries, len(entries))
        columns = set(np.flatnonzero(force)) | set(entries[:, 0])
        assert set(at_work(compliance)[1].tolist()) == columns
        agrees(compliance, force)
        if problem % 20 == 19:
            forget(compliance)
            assert at_work(compliance)[0].size == at_work(compliance)[1].size == 0
            assert (compliance.place == -1).all()


def test_what_would_slide_the_other_way_holds_first():
    force, change = np.array([-4.0, 3.0, 5.0, -6.0, 0.0]), np.empty(5)
    assert holding(np.array([2.0, 1.0, 0.0, -1.0, 7.0]), force, change)
    assert force.tolist() == [0.0, 3.0, 5.0, -6.0, 0.0]
    assert change.tolist() == [4.0, 0.0, 0.0, 0.0, 0.0]
    assert not holding(np.array([1.0, -1.0]), np.array([1.0, -2.0]), change[:2])


def ring_of_gaps(size: int, weight: float) -> tuple[Compliance, np.ndarray, np.ndarray]:
    """Equations in which each gap is moved by the next but for the last few, λ' and 1 - λ' F."""
    compliance = Compliance.of(weight * np.roll(np.eye(size), 1, axis=1))
    rows, rates = np.arange(size), np.linspace(0.5, 1.0, size)
    begin(compliance, rows)
    take_in(compliance, np.zeros(size), np.stack([rows, rows], axis=1), size)
    for k in range(size):  # of a matrix that is not symmetric, which F would be
        compliance.entries[k * compliance.sizes[2] :][:size] = compliance.whole[k]
    return compliance, rates, np.eye(size) - rates[:, None] * compliance.whole


@pytest.mark.parametrize(
    ("size", "weight", "spread"),
    [(FEW // 2, 2.0, 1e-12), (2 * FEW, 0.3, ROUGH), (2 * FEW, 2.0, 1e-12)],
    ids=["few", "many", "many for which residuals do not fall"],
)
def test_a_pass_solves_however_many_columns_there_are(size, weight, spread):
    """Where each gap moves but the next, residuals need as many products as there are gaps."""
    assert DEEP < 2 * FEW
    compliance, rates, matrix = ring_of_gaps(size, weight)
    rest, change = np.random.default_rng(1).random(size), np.empty(size)
    places = np.stack([np.arange(size)] * 2, axis=1)
    prepared(compliance, (places, rates), size)
    newton_change(rest, ((places, rates), size), compliance, change)
    left = matrix @ change - rates * rest
    assert np.linalg.norm(left) <= 1.01 * spread * np.linalg.norm(rates * rest)  # and rounding


@pytest.mark.parametrize("size", [FEW // 2, 2 * FEW], ids=["few", "many"])
def test_equations_that_are_used_again_leave_out_columns_that_came_since(size):
    """What such a column's λ is to be, the next equations say."""
    compliance = symmetric(size + 1)
    compliance.whole[:] *= 0.1 / size
    begin(compliance, np.arange(size + 1))
    places, rates = np.stack([np.arange(size)] * 2, axis=1), np.linspace(0.5, 1.0, size)
    take_in(compliance, np.zeros(size + 1), places, size)
    prepared(compliance, (places, rates), size)
    rest, changes = np.random.default_rng(1).random(size + 1), np.empty((2, size + 1))
    newton_change(rest, ((places, rates), size), compliance, changes[0])
    take_in(compliance, np.eye(size + 1)[size], NONE, 0)
    newton_change(rest, ((places, rates), size), compliance, changes[1])
    assert changes[0].any()
    assert (changes[1] == changes[0]).all()
    assert changes[1, size] == 0.0


def test_nothing_lacking_changes_nothing():
    """Of a residual that is zero, none of which less could be left is sought."""
    compliance, rates, _ = ring_of_gaps(2 * FEW, 0.3)
    places, change = np.stack([np.arange(2 * FEW)] * 2, axis=1), np.ones(2 * FEW)
    prepared(compliance, (places, rates), 2 * FEW)
    newton_change(np.zeros(2 * FEW), ((places, rates), 2 * FEW), compliance, change)
    assert (change == 0.0).all()
