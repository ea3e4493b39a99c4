"""What a pass of Newton's method at the points that slide takes of the compliance, and of λ."""

import numpy as np
import pytest

from archfem.dynamics.stepping.columns import add_gaps, begin, forget, keep, take_in
from archfem.dynamics.stepping.compliance import DEEP, NARROW, WIDE, Compliance, broad, products
from archfem.dynamics.stepping.newton_pass import (
    FEW,
    holding,
    lacking_at,
    newton_change,
    prepared,
)
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
        was, force = (
            np.where(rng.random(len(rows)) < rng.random(), rng.random(len(rows)), 0.0)
            for _ in range(2)
        )
        entries = rng.integers(0, max(len(rows), 1), (len(rows) // 3, 2))
        stay = set(np.flatnonzero(was)) & set(at_work(compliance)[1].tolist())
        keep(compliance, was, force, entries, len(entries))
        columns = set(np.flatnonzero(force)) | set(entries[:, 0]) | stay
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
    lacks = np.random.default_rng(1).random(size)
    places, change = np.stack([np.arange(size)] * 2, axis=1), lacks.copy()
    prepared(compliance, (places, rates), size)
    newton_change(change, ((places, rates), size), compliance)
    left = matrix @ change - lacks
    assert np.linalg.norm(left) <= 1.01 * spread * np.linalg.norm(lacks)  # and rounding


@pytest.mark.parametrize("size", [FEW // 2, 2 * FEW], ids=["few", "many"])
def test_equations_that_are_used_again_leave_out_columns_that_came_since(size):
    """What such a row's λ lacks, it gets; what that does to others, the next equations say."""
    compliance = symmetric(size + 1)
    compliance.whole[:] *= 0.1 / size
    begin(compliance, np.arange(size + 1))
    places, rates = np.stack([np.arange(size)] * 2, axis=1), np.linspace(0.5, 1.0, size)
    take_in(compliance, np.zeros(size + 1), places, size)
    prepared(compliance, (places, rates), size)
    lacks = np.random.default_rng(1).random(size + 1)
    changes = np.stack([lacks, lacks])
    newton_change(changes[0], ((places, rates), size), compliance)
    take_in(compliance, np.eye(size + 1)[size], NONE, 0)
    newton_change(changes[1], ((places, rates), size), compliance)
    assert (changes[0, :size] != lacks[:size]).all()
    assert (changes[1] == changes[0]).all()
    assert changes[1, size] == lacks[size]


def test_nothing_lacking_changes_nothing():
    """Of a residual that is zero, none of which less could be left is sought."""
    compliance, rates, _ = ring_of_gaps(2 * FEW, 0.3)
    places, change = np.stack([np.arange(2 * FEW)] * 2, axis=1), np.zeros(2 * FEW)
    prepared(compliance, (places, rates), 2 * FEW)
    newton_change(change, ((places, rates), 2 * FEW), compliance)
    assert (change == 0.0).all()


def test_what_is_lacking_is_what_gaps_that_are_off_would_bring():
    """Entries of one place are summed, and rows without any lack nothing."""
    places, values = np.array([[0, 1], [0, 1], [2, 0], [2, 3]]), np.array([2.0, 1.0, 4.0, -1.0])
    rest, lacks = np.array([1.0, 10.0, 100.0, 7.0]), np.full(4, np.nan)
    lacking_at(rest, ((places, values), 4), lacks)
    assert lacks.tolist() == [30.0, 0.0, -3.0, 0.0]


@pytest.mark.parametrize("kind", [np.float32, float])
@pytest.mark.parametrize("rows", [1, 3, 4, 11])
def test_products_are_those_of_the_rows_up_to_the_vector(kind, rows):
    """Whole numbers, so exact; what else there is in the room of a row does not count."""
    matrix = np.random.default_rng(rows).integers(-9, 9, (rows, 2 * WIDE)).astype(kind)
    vector, images = np.arange(WIDE).astype(kind), np.full(rows, np.nan, kind)
    products(matrix.ravel(), 2 * WIDE, vector, images)
    assert (images == matrix[:, :WIDE] @ vector).all()


def test_rows_begin_with_a_line_of_memory():
    compliance = symmetric(WIDE + 1)
    rooms = (compliance.entries, compliance.rough, compliance.basis, *compliance.vectors)
    assert all(room.ctypes.data % 64 == 0 for room in rooms)
    assert [broad(count) for count in (0, 1, WIDE, WIDE + 1)] == [0, WIDE, WIDE, 2 * WIDE]
    assert compliance.sizes[2] == 2 * WIDE
