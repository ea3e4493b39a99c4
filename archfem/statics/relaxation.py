"""Relaxation to equilibrium where Newton's method fails, and irreversible joints.

Where blocks slide, or are suspended from joints that open in the first iteration, tangents are
singular on the way although the structure stands. A drag on every motion, µ K (q - q_0) with K the
stiffness of the closed structure, makes them regular: steps of creep follow one another, each with
the joint memory of the one before, and the drag fades as the residual falls. It is pseudo-transient
continuation (Kelley and Keyes 1998).

A step whose Newton iterations cycle is solved with Tresca's law, whose limits of friction do not
depend on the normal forces. Its energy is convex, and its tangents are symmetric. The limits are
then updated from the solution and the step is repeated, first with limits that no shear reaches
(Haslinger, Hlaváček and Nečas 1996).

Slip changes no force in a flat dry joint. Dilatancy raises the blocks that have slid, and a bond
that breaks releases its force: then equilibrium is solved again, from the present state, until
nothing slides or breaks any more. The overstrained bonds where each joint opens most break first. A
crack thus grows from its tip, and stops where the rest bears the load.

Where joints slide a structure has many equilibria, and the loading path decides between them. A
search therefore starts near the last equilibrium, and joint memory is taken from equilibria alone.
From a relaxed state Newton's method looks for the equilibrium whose slips grow in proportion to the
load: where displacements are small it depends on no steps, neither of creep nor of the load.

References: Kelley and Keyes, SIAM J. Numer. Anal. 35 (1998) 508-523. Haslinger, Hlaváček and
Nečas, Handbook of Numerical Analysis IV (1996).
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem._typing import Array
from archfem.errors import DidNotConverge
from archfem.joints.contact_law import exceeds_limit
from archfem.joints.operator import JointOperator
from archfem.models.linear_blocks import LinearBlockModel
from archfem.models.model import Model
from archfem.statics import newton
from archfem.statics.newton import CONVEX_SEARCHES, EquilibriumSolver, Solution, load_magnitude

# Equilibria under one load, between which joints may slide or break
MAX_IRREVERSIBLE_ITERATIONS = 1000

# Finds an equilibrium of a model under a load (n,) from an initial guess (n,), and returns the
# model with its joint memory there
Search = Callable[[EquilibriumSolver, Model, Array, Array], tuple[Model, Solution]]

# Searches for the first trial of a whole step, for halved steps and for the smallest steps
SearchSequence = tuple[Search, Search, Search]


@dataclass(frozen=True, eq=False)
class TrescaJoints(JointOperator):
    """Joint operator with shear limits independent of the normal forces (Tresca's law)."""

    # limit at each point, not negative (p,) [N]
    shear_limit: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, joints: JointOperator, shear_limit: Array) -> "TrescaJoints":
        """Return joints with other shear limits and the same memory."""
        operator = joints.law, joints.opening, joints.slip, joints.gap_offset
        # joints that never slide have no other limit than their own
        limit = np.maximum(shear_limit, joints.points.contact.resistance)
        return cls(*operator, joints.irreversible_slip, joints.damage, joints.crack, limit)

    def coulomb_limit(self, normal: Array, closed: Array) -> Array:
        """Return the shear limits, for any normal forces (p,) [N]."""
        return self.shear_limit

    def stiffness(self, q: Array) -> Array:
        """Return the point stiffnesses of the tangent, as `tangents` takes them (m,) [N/m]."""
        across = self.normal_law.stiffness(self.effective_gaps(q))
        over = exceeds_limit(self.trial_shear(q), self.shear_limit)
        along = np.where(over, 0.0, self.points.shear_spring)
        # no coupling of slip with opening: it is zero where that of Coulomb's law would stand
        return np.concatenate([across, along, *([np.zeros_like(across)] if self.slides else [])])


class MovesOn(DidNotConverge):
    """Structure that moves on in steps of creep."""

    def __init__(self, message: str, steps: tuple[Array, Array]) -> None:
        super().__init__(message)
        self.steps = steps  # coordinates before and after the last one


def relax(
    solver: EquilibriumSolver, model: Model, load: Array, start: Array
) -> tuple[Model, Solution]:
    """Find an equilibrium by steps of creep against a fading drag."""
    drag, max_drag, max_steps = 1.0, 256.0, 100  # drag relative to the closed stiffness [-]
    easy_iterations, drag_factor, patience = 8, 4.0, 24
    iterations, residuals = 0, [np.inf]
    q, before, closed, scale = start, start, model.closed_tangent(), load_magnitude(load)
    while drag <= max_drag and len(residuals) <= max_steps:
        try:
            step = _solve_creep_step(solver, model, load, q, drag * closed)
        except DidNotConverge:
            drag *= drag_factor
            continue
        before, q, iterations = q, step.q, iterations + step.iterations
        model = model.with_memory(model.updated_memory(q))
        residual = float(np.linalg.norm(model.force(q) - load))
        if residual <= _relaxation_tolerance(solver, model, q, scale):
            return model, Solution(q, iterations, residual)
        residuals.append(residual)
        # a residual that does not halve in two dozen steps belongs to a structure that flows: that
        # of wheels on pieces of fill may rest for a dozen
        if len(residuals) > patience and residual > 0.5 * residuals[-patience]:
            break
        drag /= drag_factor if step.iterations <= easy_iterations else 1.0
    raise MovesOn(
        f"it does not come to rest in {len(residuals) - 1} steps of creep: {residuals[-1]:.2e} of "
        f"{scale:.2e} stays out of balance",
        (before, q),
    )


def _solve_creep_step(
    solver: EquilibriumSolver, model: Model, load: Array, start: Array, drag: sparse.csr_matrix
) -> Solution:
    """Solve one step against a drag (n, n), by Coulomb's law or by updated Tresca limits."""
    try:
        return _solve_with_drag(solver, model, load, (start, start), drag, ("basic",))
    except DidNotConverge:
        # laws of the user have no limit of friction to update
        if not isinstance(model, LinearBlockModel) or model.structure.has_own_laws:
            raise
    joints = model.operator
    limit, q, iterations = np.full(len(joints.points.offset), load_magnitude(load)), start, 0
    for _ in range(6):  # updates of the limits, of which a step needs no more accuracy
        tresca = model.with_joint_law(TrescaJoints.of(joints, limit))
        solution = _solve_with_drag(solver, tresca, load, (start, q), drag, ("basic", "cp"))
        q, iterations = solution.q, iterations + solution.iterations
        limit = joints.coulomb_limit(*joints.normal_law.forces_and_area(joints.effective_gaps(q)))
    return Solution(q, iterations, solution.residual)


def _solve_with_drag(
    solver: EquilibriumSolver,
    model: Model,
    load: Array,
    starts: tuple[Array, Array],
    drag: sparse.csr_matrix,
    searches: tuple[str, ...],
) -> Solution:
    """Solve a step from the origin of the drag and an initial guess, each (n,)."""
    origin, guess = starts

    def tangent(q: Array) -> sparse.csr_matrix:
        stiffness = model.tangent(q)
        # both have one pattern: adding the entries keeps it, where a sparse sum might not
        total = stiffness.copy()
        total.data = stiffness.data + drag.data
        return total

    def residual(q: Array) -> Array:
        return model.force(q) - load + drag @ (q - origin)

    return solver.solve(residual, tangent, guess, load_magnitude(load), searches)


def _relaxation_tolerance(solver: EquilibriumSolver, model: Model, q: Array, scale: float) -> float:
    """Return the accepted residual: the tolerance, or the round-off of large motions [N]."""
    rounding = 8.0 * np.finfo(float).eps * np.linalg.norm(abs(model.tangent(q)) @ abs(q))
    tolerance = max(solver.settings.tolerance * scale, float(rounding))
    return min(tolerance, newton.MAX_ROUND_OFF_RESIDUAL * scale)


def has_irreversible_joints(model: Model) -> bool:
    """Return whether joint memory may change joint forces: dilatancy, bonds or own laws."""
    return model.operator is not None and not model.operator.points.is_plain


def is_stationary(model: Model, q: Array, iterations: int) -> bool:
    """Return whether an equilibrium was in balance without iterations, and tears no bond."""
    operator = model.operator
    if iterations > 0 or operator is None or operator.bonds is None:
        return iterations == 0
    return not operator.bonds.find_exceeded(operator.effective_gaps(q)).any()


def solve_irreversible(
    solver: EquilibriumSolver,
    model: Model,
    load: Array,
    start: Array,
    searches: tuple[str, ...] = CONVEX_SEARCHES,
) -> tuple[Model, Solution]:
    """Find an equilibrium that remains one with the joint memory updated by it."""
    q, iterations = start, 0
    for number in range(MAX_IRREVERSIBLE_ITERATIONS):
        solution = _solve_balance(solver, model, load, q, searches)
        q, iterations = solution.q, iterations + solution.iterations
        # the first equilibrium may be in balance by chance, with memory of its own still to come
        if number > 0 and is_stationary(model, solution.q, solution.iterations):
            return model, Solution(q, iterations, solution.residual)
        before, model = model.memory, model.with_memory(model.updated_memory(q))
        if not has_irreversible_joints(model):
            return model, solution
    change = float(np.abs(model.memory - before).max())
    raise DidNotConverge(
        f"joints still dilate or break in {MAX_IRREVERSIBLE_ITERATIONS} rounds under the same "
        f"load, by {change:.2g} m in the last one: give less dilatancy, or softer joints across "
        "than along"
    )


def _solve_balance(
    solver: EquilibriumSolver, model: Model, load: Array, start: Array, searches: tuple[str, ...]
) -> Solution:
    """Find an equilibrium by Newton's method with the present joint memory."""
    scale = load_magnitude(load)
    return solver.solve(lambda q: model.force(q) - load, model.tangent, start, scale, searches)


def linear_predictor(model: Model, q: Array, motion: Array) -> Array:
    """Return coordinates after a motion of the supports, with joint statuses frozen (n,)."""
    # Supports that move together carry the structure with them as it is.
    try:
        return q - splu(model.tangent(q).tocsc()).solve(model.support_forces(q, motion))
    except RuntimeError:  # the tangent is singular
        return q


# Finds an equilibrium near the start, by a few full Newton steps
solve_local = partial(solve_irreversible, searches=("basic",))


def solve_or_relax(
    solver: EquilibriumSolver,
    model: Model,
    load: Array,
    start: Array,
    check: Callable[[Model], None] | None = None,
    *,
    in_proportion: bool = True,
) -> tuple[Model, Solution]:
    """Find an equilibrium by Newton's method, and where that fails by relaxation.

    The check comes between them, and may raise the reason for which there is none. Slips of creep
    stay, as on a path in small steps, or give way to those that grow in proportion to the load.
    """
    try:
        return solve_irreversible(solver, model, load, start)
    except DidNotConverge:
        if check is not None:
            check(model)
        relaxed, crept = relax(solver, model, load, start)
        if has_irreversible_joints(model):
            return solve_irreversible(solver, relaxed, load, crept.q)
        if not in_proportion:
            return relaxed, crept
        # Creep makes joints slide to and fro, and its end depends on its steps. Of the equilibria
        # near it that one is taken whose slips grow in proportion to the load.
        try:
            model, solution = solve_irreversible(solver, model, load, crept.q)
        except DidNotConverge:
            return relaxed, crept
        return model, replace(solution, iterations=crept.iterations + solution.iterations)
