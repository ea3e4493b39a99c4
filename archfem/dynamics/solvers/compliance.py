"""Solver "compliance": one sparse factor for the run, unknowns in the active joint rows only.

The effective matrix with all joints closed and stuck is factorised once for a length of step:

    (K + μ M + ν R) w = r + Gᵀ λ,    z = G w + z₀,    λ = λ(z).

Multiplied by G, this is a dense problem in the rows that open or slide (`active_rows`). Their
compliance is F = G (K + μ M + ν R)⁻¹ Gᵀ. Rows of F are computed once they become active. The result
is checked against the gaps of the whole structure.
"""

from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from archfem._numba import kernel
from archfem.dynamics.solvers import active_rows, linear_step
from archfem.dynamics.solvers.active_compliance import ActiveRows, begin_problem, clear_problem
from archfem.dynamics.solvers.base import MAX_ITERATIONS, StepSolver, is_kind, overload_for
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.joint_law import largest_force
from archfem.dynamics.solvers.sparse_products import (
    add_rows,
    multiply,
    row_times,
    without_round_off,
)
from archfem.dynamics.solvers.supernodal_lu import (
    Elimination,
    SymmetricFactor,
    solve_backward,
    solve_forward,
    symmetric_factor,
)


class ComplianceSystem(NamedTuple):
    """A structure's matrices in the order of their factor."""

    linear: linear_step.LinearSystem  # its matrices by rows
    work: linear_step.LinearStepWorkspace
    factor: SymmetricFactor  # of K + μ M + ν R
    group: Any  # of the factor to which each coordinate belongs (n,)
    marked: Any  # groups of the factor in which a solve is wanted (groups,)
    listed: Any  # numbers of the rows of a problem (r,)
    unit: Any  # displacements by forces of one at a row of gaps (n,)
    active: ActiveRows  # F, filled for rows that have been active


class ComplianceSolver(StepSolver):
    """Steps with one sparse factor of the effective matrix."""

    name: ClassVar[str] = "compliance"

    def __init__(self, equation: Equation) -> None:
        model = equation.model
        parts = (model.mass, equation.rest, model.closed_tangent())
        self._elimination = Elimination.of(sum(abs(without_round_off(part)) for part in parts))
        self._equation, self.order, self.assembled = equation, self._elimination.order, {}

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the solver, or None where anything but plain joints is nonlinear."""
        joints = equation.joints
        return None if joints is None or joints.points.stiffens else cls(equation)

    def assemble(self, dt: float) -> ComplianceSystem:
        """Return the data of steps of one length [s]."""
        linear, pairs, effective = linear_step.linear_system(self._equation, self.order, dt)
        factor = symmetric_factor(effective, self._elimination)
        rows = len(linear.law.offset)
        return ComplianceSystem(
            linear,
            linear_step.linear_workspace(linear),
            factor,
            self._elimination.group_of,
            np.zeros(len(factor.parent), bool),
            np.zeros(rows, np.int64),
            np.zeros(len(linear.weight)),
            ActiveRows.of(rows, len(linear.law.segments), len(pairs)),
        )

    def constants(self, system: ComplianceSystem) -> tuple[Any, ...]:
        """Return the parts of the data that no step changes."""
        factor = system.factor
        return (*linear_step.constant_parts(system.linear), *factor[:-1], system.group)

    def empty_parts(self, system: ComplianceSystem) -> dict[int, Any]:
        """Return an empty F: untouched pages cost nothing."""
        old, segments = system.active, len(system.linear.law.segments)
        return {id(old): ActiveRows.of(len(old.full), segments, len(old.derivatives[1]))}


def _solve_by_compliance(system):  # type: ignore
    """Solve a step, adding rows that turn out to be active; returns iterations, or -1."""
    linear, law, active, work = system.linear, system.linear.law, system.active, system.work
    vector, half, gap = work.contact, work.product, work.gap
    active_rows.predict_active_rows(law, active, work)
    tolerance, iterations = 1e-12 * largest_force(law, gap), 1
    # forward substitution of the right side serves all rounds
    _copy(work.right_side, half)
    solve_forward(system.factor, half)
    _copy(gap, work.gap_before)
    for iteration in range(MAX_ITERATIONS):
        count = _list_marked(active.near, system.listed)
        _copy(half, vector)
        if count > 0:
            more = _solve_in_rows(system, system.listed[:count], iteration == 0, tolerance)
            if more < 0:
                return -1
            iterations += more - 1
            # right side with the released forces, whose forward substitution is added
            vector[:] = 0.0
            add_rows(linear.gaps, work.force, vector)
            solve_forward(system.factor, vector)
            for k in range(len(vector)):
                vector[k] += half[k]
        for group in range(len(system.marked)):
            system.marked[group] = True
        solve_backward(system.factor, vector, system.marked)
        multiply(linear.gaps, vector, gap)
        for row in range(len(gap)):
            gap[row] += law.offset[row]
        _copy(gap, work.gap_end)
        if active_rows.check_active_rows(law, active, gap, active.near):
            return iterations
        iterations += 1
    return -1


overload_for(is_kind(ComplianceSystem), linear_step.solve_contact, _solve_by_compliance)


@kernel
def _solve_in_rows(system, rows, first, tolerance):  # type: ignore
    """Solve for λ in some rows; returns iterations, or -1."""
    law, work, start, gaps = system.linear.law, system.work, system.work.gap_end, system.linear.gaps
    for row in rows:
        if not system.active.filled[row]:
            _fill_compliance(system, row)
    some = False
    for force in work.force:
        some = some or force != 0.0
    if not some:  # so that histories do not depend on what was solved before
        clear_problem(system.active)
    begin_problem(system.active, rows)
    # gaps of these rows if nothing were released
    if first:
        _mark_branches(system, rows)
        solve_backward(system.factor, work.contact, system.marked)
        for row in rows:
            start[row] = row_times(gaps, row, work.contact) + law.offset[row]
    else:
        active_rows.subtract_released(system.active, work.force, start)
    return active_rows.solve_active_rows(law, start, system.active, work.force, tolerance)


@kernel
def _copy(source, target):  # type: ignore
    """Copy a vector."""
    for k in range(len(source)):
        target[k] = source[k]


@kernel
def _list_marked(marks, numbers):  # type: ignore
    """List the indices at which `marks` is true; returns how many there are."""
    count = 0
    for k in range(len(marks)):
        if marks[k]:
            numbers[count] = k
            count += 1
    return count


@kernel
def _fill_compliance(system, row):  # type: ignore
    """Compute the entries of a row of F in the columns of all rows filled so far, and its own."""
    (indptr, indices, data), active = system.linear.gaps, system.active
    active.filled[row] = True
    # displacements by forces of one at the row, then the gaps that they cause at the others
    vector = system.unit
    vector[:] = 0.0
    for entry in range(indptr[row], indptr[row + 1]):
        vector[indices[entry]] += data[entry]
    solve_forward(system.factor, vector)
    count = _list_marked(active.filled, active.slips)
    _mark_branches(system, active.slips[:count])
    solve_backward(system.factor, vector, system.marked)
    for other in active.slips[:count]:
        value = row_times(system.linear.gaps, other, vector)
        active.full[row, other] = active.full[other, row] = value


@kernel
def _mark_branches(system, rows):  # type: ignore
    """Mark the groups of the factor on which the gaps of some rows depend, with all ancestors."""
    (indptr, indices, _), parent, marked = system.linear.gaps, system.factor.parent, system.marked
    marked[:] = False
    for row in rows:
        for entry in range(indptr[row], indptr[row + 1]):
            group = system.group[indices[entry]]
            while group >= 0 and not marked[group]:
                marked[group] = True
                group = parent[group]
