"""Elimination in dense panels against SuperLU, of matrices whose entries change in part."""

import logging

import numpy as np
import pytest
from kernels import either
from scipy import sparse
from scipy.sparse.linalg import spsolve

import archfem as af
from archfem.dynamics import Equation
from archfem.dynamics.solvers import supernodal_lu
from archfem.dynamics.solvers.newton import NewtonSolver
from archfem.dynamics.solvers.supernodal_lu import (
    Elimination,
    eliminate,
    panel_places,
    panels_of,
)

SIDE = 9
"""Of a grid of unknowns, of which two edges meet joints."""

CHANGE = np.array([0, *range(1, SIDE), *range(SIDE, SIDE * SIDE, SIDE)])


@pytest.fixture
def grid():
    """A matrix that is not symmetric, how its unknowns are eliminated, and what changes of it."""
    rng = np.random.default_rng(0)
    line = sparse.diags([1.0, 1.0, 1.0], [-1, 0, 1], shape=(SIDE, SIDE))
    pattern = sparse.kron(line, line).tocsr()
    elimination = Elimination.of(pattern)
    matrix = pattern[elimination.order][:, elimination.order].tocsr()
    matrix.data = rng.normal(size=matrix.nnz)
    matrix += sparse.identity(SIDE**2) * 12.0
    touched = np.isin(elimination.order, CHANGE)
    entries = matrix.tocoo()
    own = touched[entries.row] & touched[entries.col]
    return matrix, elimination, np.stack([entries.row[own], entries.col[own]]).astype(np.int64)


solve_panels = either(supernodal_lu.solve_panels)


def factorise(panels, places, added):
    """Add to entries of the matrix, and factorise it."""
    panels.entries[:] = panels.base
    np.add.at(panels.entries, panel_places(panels, *places), added)
    return eliminate(panels)


# the kernel is compiled anew where a test calls it from Python; the history below is by it too
@pytest.mark.usefixtures("each_way")
@pytest.mark.slow
def test_solutions_are_those_of_superlu_for_any_added_entries(grid):
    matrix, elimination, places = grid
    panels = panels_of(matrix, elimination, *places)
    assert 0 < panels.changed.sum() < len(elimination.groups)
    rng = np.random.default_rng(1)
    for _ in range(2):
        added, right = rng.normal(size=places.shape[1]), rng.normal(size=SIDE**2)
        more = sparse.coo_matrix((added, places), matrix.shape)
        assert factorise(panels, places, added)
        solution = right.copy()
        solve_panels(panels, solution)
        assert solution == pytest.approx(spsolve((matrix + more).tocsc(), right), abs=1e-12)


def test_a_pivot_that_vanishes_is_reported(grid):
    matrix, elimination, places = grid
    panels = panels_of(matrix, elimination, *places)
    last = int(np.argmax(np.where(places[0] == places[1], places[0], -1)))
    added, row = np.zeros(places.shape[1]), int(places[0, last])
    schur = 1.0 / np.linalg.inv(matrix.toarray()[: row + 1, : row + 1])[row, row]
    added[last] = -schur
    assert not factorise(panels, places, added)


@pytest.mark.slow
def test_a_bridge_with_a_fill_has_the_history_of_snes(caplog):
    """N to 1e-7 of the largest, slips and rotations to 1e-8 m and rad."""
    caplog.set_level(logging.ERROR)
    arch = af.shapes.Arch(
        measured="centre line", span=4.0, embrace=159.0, thickness=0.5, voussoirs=7, name="arch"
    )
    bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.4))
    soil = {"backfill": "full", "rest": "rigid"}
    built = af.build(bridge, fidelity=soil, displacements="large", cells=(4, 4))
    shake = af.Motion.synthetic(duration=0.5, pga=4.0, seed=3).cut(0.0, 0.06)
    given = {"dt": 0.005, "damping": af.StiffnessDamping(0.05, 8.0)}
    tight = af.statics.Newton(tolerance=1e-12)
    system = NewtonSolver(Equation(built, shake)).system(0.005)
    assert not system.tangent.changed.all()
    runs = [
        af.time_history(built, shake, method=method, newton=tight, **given).joints
        for method in ("newton", "snes")
    ]
    scale = float(runs[1]["N"].max())
    assert float(np.abs(runs[0]["N"] - runs[1]["N"]).max()) < 1e-7 * scale
    for name in ("opening", "rotation", "slip"):
        assert float(np.abs(runs[0][name] - runs[1][name]).max()) < 1e-8
