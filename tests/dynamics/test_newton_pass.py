"""What a pass of Newton's method at the points that slide takes of the compliance, and of λ."""

import numpy as np
import pytest

from archfem.dynamics.stepping.columns import add_gaps, no_columns, take_in
from archfem.dynamics.stepping.newton_pass import FEW, ROUGH, holding, newton_change, prepared

NONE = np.zeros((0, 2), np.int64)


def test_gaps_by_the_columns_are_those_by_all_of_the_compliance():
    """Columns come in as λ is no longer zero, or as a derivative of it is not; none comes twice."""
    rng = np.random.default_rng(0)
    compliance, rows = rng.random((9, 9)), np.array([1, 2, 5, 6, 8])
    columns, force = no_columns(rows), np.array([0.0, 3.0, 0.0, 0.0, -2.0])
    take_in(columns, compliance, force, NONE, 0)
    assert columns.places[: columns.taken[0]].tolist() == [1, 4]
    force[0] = 0.5
    take_in(columns, compliance, force, np.array([[3, 1], [0, 0]]), 1)
    assert columns.places[: columns.taken[0]].tolist() == [1, 4, 0, 3]
    assert columns.column.tolist() == [2, 0, -1, 3, 1]
    gaps = np.ones(len(rows))
    add_gaps(columns, force, gaps)
    assert np.allclose(gaps, 1.0 + compliance[np.ix_(rows, rows)] @ force, rtol=1e-15)


def test_what_would_slide_the_other_way_holds_first():
    force, change = np.array([-4.0, 3.0, 5.0, -6.0, 0.0]), np.empty(5)
    assert holding(np.array([2.0, 1.0, 0.0, -1.0, 7.0]), force, change)
    assert force.tolist() == [0.0, 3.0, 5.0, -6.0, 0.0]
    assert change.tolist() == [4.0, 0.0, 0.0, 0.0, 0.0]
    assert not holding(np.array([1.0, -1.0]), np.array([1.0, -2.0]), change[:2])


@pytest.mark.parametrize(
    ("size", "weight", "spread"),
    [(FEW // 2, 2.0, 1e-12), (2 * FEW, 0.3, ROUGH), (2 * FEW, 2.0, 1e-12)],
    ids=["few", "many", "many for which gradients do not end"],
)
def test_a_pass_solves_however_many_columns_there_are(size, weight, spread):
    """Where each gap moves but the next, gradients need as many products as there are gaps."""
    compliance, rows = weight * np.roll(np.eye(size), 1, axis=1), np.arange(size)
    columns, rest = no_columns(rows), np.random.default_rng(1).random(size)
    entered = (np.stack([rows, rows], axis=1), np.linspace(0.5, 1.0, size)), size
    take_in(columns, compliance, np.zeros(size), entered[0][0], size)
    system = prepared(columns, entered[0], size, np.empty(size**2))
    right = entered[0][1] * rest
    exact = np.linalg.solve(np.eye(size) - entered[0][1][:, None] * compliance, right)
    found = newton_change(rest, entered, (columns, system))
    assert np.linalg.norm(found - exact) <= 3.0 * spread * np.linalg.norm(exact)
