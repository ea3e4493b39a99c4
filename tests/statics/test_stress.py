"""Stress against closed forms: turned states, and linear fields at corners."""

from dataclasses import replace

import numpy as np
import pytest
from cells import one_cell
from scipy import sparse

import archfem as af
from archfem.statics.stress import _fit, at_corners, principal


@pytest.mark.parametrize("angle", [-80.0, -30.0, 0.0, 20.0, 65.0])
def test_principal_stresses_are_those_that_were_turned(stack, angle):
    """σ = R diag(s1, s2) Rᵀ must give s1, s2 and the turn back."""
    turn = np.radians(angle)
    first, second = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    stress = 0.3 * af.units.MPa * np.outer(first, first) - 2.0 * af.units.MPa * np.outer(
        second, second
    )
    found = principal(one_cell(stack, stress[[0, 1, 0], [0, 1, 1]]), np.ones(1))
    assert found["s1"].values == pytest.approx([0.3 * af.units.MPa])
    assert found["s2"].values == pytest.approx([-2.0 * af.units.MPa])
    assert found["angle"].values == pytest.approx([turn])
    assert [*found["x"].values, *found["y"].values] == [0.5, 0.5]
    assert found["name"].values.tolist() == ["block 1"]


@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
def test_a_linear_stress_is_recovered_exactly_at_corners(ring, cell):
    """Any plane through the centres, on distorted cells, and never across a joint."""
    cells = af.build(ring, fidelity="full", cells=(4, 3), cell=cell).cells
    centre = np.array([cells.places[c].mean(axis=0) for c in cells.polygons])
    slope = np.array([[1.0, 2.0], [-3.0, 0.5], [0.7, -1.1]])
    step = np.sin(cells.block)[:, None]  # a jump from each block to the next
    own = replace(cells, stress=sparse.identity(3 * len(centre), format="csr"))
    at_centres = centre @ slope.T + np.sin(cells.owner)[:, None]
    found = (at_corners(own) @ at_centres.ravel()).reshape(-1, 3)
    assert found == pytest.approx(cells.places @ slope.T + step, abs=1e-9)


def test_a_corner_takes_in_neighbours_where_fewer_than_four_cells_meet():
    """Inside a stone of 4 by 4 cells exactly four do; at its faces two, at its corners one."""
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="full", cells=(4, 4))
    cells, fit = model.cells, _fit(model.cells)
    meet = np.bincount(np.concatenate(cells.polygons), minlength=len(cells.places))
    taken = np.diff(fit.indptr)
    assert sorted(set(meet.tolist())) == [1, 2, 4]
    assert (taken[meet == 4] == 4).all()
    assert set(taken[meet == 2].tolist()) == {6, 8}  # less beside a corner
    assert (taken[meet == 1] == 4).all()
