"""Solver "compliance": one sparse factor for the run, unknowns in the active joint rows only.

The effective matrix with all joints closed and stuck is factorised once for a length of step:

    (K + μ M + ν R) w = r + Gᵀ λ,    z = G w + z₀,    λ = λ(z).

Multiplied by G, this is a dense problem in the rows that open or slide (`active_rows`), with their
compliance F = G (K + μ M + ν R)⁻¹ Gᵀ. Rows of F are computed once they become active. The result is
checked against the gaps of the whole structure.
"""

from copy import deepcopy
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numba.extending import overload

from archfem._numba import KERNEL_OPTIONS, kernel
from archfem.dynamics.solvers.active_compliance import FILLED, NEAR, ActiveCompliance
from archfem.dynamics.solvers.active_rows import (
    check_active_rows,
    predict_active_rows,
    solve_active_rows,
    subtract_released,
)
from archfem.dynamics.solvers.base import MAX_ITERATIONS, is_system
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.joint_law import OFFSET, largest_force
from archfem.dynamics.solvers.linear_step import (
    LAMBDA,
    PRODUCT,
    RIGHT_SIDE,
    Z_BEFORE,
    Z_END,
    LinearStepWorkspace,
    LinearSystem,
    W,
    Z,
    effective_matrix,
    joint_rows,
    linear_system,
    linear_workspace,
    solve_contact,
)
from archfem.dynamics.solvers.sparse_products import (
    add_rows,
    multiply,
    row_times,
    without_round_off,
)
from archfem.dynamics.solvers.supernodal_lu import (
    Elimination,
    Panels,
    definite_factor,
    solve_lower,
    solve_upper,
)


class ComplianceSystem(NamedTuple):
    """A structure's matrices in the order of their factor."""

    linear: LinearSystem  # its matrices by rows
    work: LinearStepWorkspace
    factor: Panels  # of K + μ M + ν R
    group: Any  # of the factor to which each coordinate belongs (n,)
    marked: Any  # groups of the factor in which a solve is wanted (groups,)
    active: Any  # numbers of active rows (r,)
    unit: Any  # displacements by forces of one at a row of gaps (n,)
    compliance: ActiveCompliance  # F, filled for rows that have been active


class ComplianceSolver:
    """Steps with one sparse factor of the effective matrix."""

    name: ClassVar[str] = "compliance"

    def __init__(self, equation: Equation) -> None:
        model = equation.model
        parts = (model.mass, equation.rest, model.closed_tangent())
        self._elimination = Elimination.of(sum(abs(without_round_off(part)) for part in parts))
        self._equation, self.order = equation, self._elimination.order

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the solver, or None where more than plain joints is not linear."""
        return cls(equation) if equation.joints is not None else None

    def system(self, dt: float) -> ComplianceSystem:
        """Return the data of steps of one length [s]."""
        linear = linear_system(self._equation, self.order, dt)
        matrix = effective_matrix(self._equation, self.order, dt)
        factor = definite_factor(matrix, self._elimination)
        pairs = len(joint_rows(self._equation, dt).pairs)
        rows, group = linear.law.rows.shape[1], self._elimination.group_of
        marked, active = np.zeros(len(factor.parent), bool), np.zeros(rows, np.int64)
        unit = np.zeros(len(linear.weight))
        compliance = ActiveCompliance.of(rows, len(linear.law.segments), pairs)
        return ComplianceSystem(
            linear, linear_workspace(linear), factor, group, marked, active, unit, compliance
        )

    def copy_system(self, system: ComplianceSystem) -> ComplianceSystem:
        """Return a copy for another run, with an empty compliance: untouched pages cost nothing."""
        old, segments = system.compliance, len(system.linear.law.segments)
        empty = ActiveCompliance.of(len(old.full), segments, len(old.derivatives[1]))
        return deepcopy(system, {id(system.compliance): empty})


@overload(solve_contact, jit_options=KERNEL_OPTIONS)
def _solve_contact(system):  # type: ignore
    return _solve_by_compliance if is_system(system, ComplianceSystem) else None


def _solve_by_compliance(system):  # type: ignore
    """Solve a step, adding rows that turn out to be active; returns iterations, or -1."""
    linear, law, compliance, work = system.linear, system.linear.law, system.compliance, system.work
    right = work.vectors[RIGHT_SIDE]
    vector, half = work.vectors[W], work.vectors[PRODUCT]
    gap, start = work.rows[Z], work.rows[Z_END]
    predict_active_rows(law, compliance, work.rows)
    tolerance, iterations = 1e-12 * largest_force(law, gap), 1
    # forward substitution of the right side serves all rounds
    for k in range(len(right)):
        half[k] = right[k]
    solve_lower(system.factor, half)
    for k in range(len(right)):
        vector[k] = half[k]
    for row in range(len(gap)):
        work.rows[Z_BEFORE, row] = gap[row]
    for iteration in range(MAX_ITERATIONS):
        count = _list_marked(compliance.flags[NEAR], system.active)
        rows = system.active[:count]
        if count > 0:
            more = _solve_in_rows(system, rows, iteration == 0, tolerance)
            if more < 0:
                return -1
            iterations += more - 1
            # right side with the released forces, whose forward substitution is added
            for k in range(len(vector)):
                vector[k] = 0.0
            add_rows(linear.gaps, work.rows[LAMBDA], vector)
            solve_lower(system.factor, vector)
            for k in range(len(half)):
                vector[k] += half[k]
        for group in range(len(system.marked)):
            system.marked[group] = True
        _solve_branches(system, vector)
        multiply(linear.gaps, vector, gap)
        for row in range(len(gap)):
            gap[row] += law.rows[OFFSET, row]
            start[row] = gap[row]
        if check_active_rows(law, compliance, gap, compliance.flags[NEAR]):
            return iterations
        iterations += 1
    return -1


@kernel
def _solve_in_rows(system, rows, first, tolerance):  # type: ignore
    """Solve for λ in some rows; returns iterations, or -1."""
    law, work, start = system.linear.law, system.work, system.work.rows[Z_END]
    for row in rows:
        if not system.compliance.flags[FILLED, row]:
            _fill_compliance(system, row)
    # gaps of these rows if nothing were released
    if first:
        _mark_branches(system, rows)
        _solve_branches(system, work.vectors[W])
        for row in rows:
            start[row] = row_times(system.linear.gaps, row, work.vectors[W]) + law.rows[OFFSET, row]
    else:
        subtract_released(system.compliance, rows, work.rows[LAMBDA], start)
    return solve_active_rows(law, start, rows, system.compliance, work.rows[LAMBDA], tolerance)


@kernel
def _list_marked(marks, numbers):  # type: ignore
    """List the numbers of what is marked; returns how many there are."""
    count = 0
    for k in range(len(marks)):
        if marks[k]:
            numbers[count] = k
            count += 1
    return count


@kernel
def _fill_compliance(system, row):  # type: ignore
    """Compute a row of F, as far as it meets rows computed before."""
    (indptr, indices, data), compliance = system.linear.gaps, system.compliance
    compliance.flags[FILLED, row] = True
    vector = system.unit
    for k in range(len(vector)):
        vector[k] = 0.0
    for entry in range(indptr[row], indptr[row + 1]):
        vector[indices[entry]] += data[entry]
    solve_lower(system.factor, vector)
    count = _list_marked(compliance.flags[FILLED], compliance.slips)
    _mark_branches(system, compliance.slips[:count])
    _solve_branches(system, vector)
    for other in compliance.slips[:count]:
        value = row_times(system.linear.gaps, other, vector)
        compliance.full[row, other] = compliance.full[other, row] = value


@kernel
def _mark_branches(system, rows):  # type: ignore
    """Mark the groups of the factor on which the gaps of some rows depend, with all ancestors."""
    (indptr, indices, _), parent, marked = system.linear.gaps, system.factor.parent, system.marked
    for group in range(len(marked)):
        marked[group] = False
    for row in rows:
        for entry in range(indptr[row], indptr[row + 1]):
            group = system.group[indices[entry]]
            while group >= 0 and not marked[group]:
                marked[group] = True
                group = parent[group]


@kernel
def _solve_branches(system, vector):  # type: ignore
    """Solve with the upper triangle in the groups that are marked."""
    for group in range(len(system.marked) - 1, -1, -1):
        if system.marked[group]:
            solve_upper(system.factor, vector, group)
