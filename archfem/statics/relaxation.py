"""Equilibria that Newton's method alone does not find: a structure that creeps to rest.

Where blocks slide, or hang from joints that open in the first iteration, tangents are singular on
the way although the structure stands. A drag on every motion, µ K (q - q_0) with K the stiffness
of the closed structure, keeps them regular: steps of creep follow one another, joints remembering
each, and the drag fades as the structure comes to rest. It is pseudo-transient continuation:
Kelley and Keyes, SIAM Journal on Numerical Analysis 35 (1998) 508-523.

A step whose Newton iterations cycle is made with limits of friction that are given: first those
that no shear reaches, then those that follow from the solution before.
"""

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.joints.given_limits import GivenLimits
from archfem.joints.operator import JointOperator
from archfem.models.jointed import Jointed
from archfem.models.model import Model
from archfem.statics.newton import ROUGHLY, Solved, Solver, magnitude

STEPS = 100
"""Of creep, at most."""

EASY = 8
"""Iterations up to which a step was easy, and the next one is made with less drag."""

CHANGE = 4.0
"""Factor by which the drag falls after an easy step, and grows after one that failed."""

HARD = 256.0
"""Drag beyond which no step will succeed [-]."""

WAIT = 12
"""Steps in which what is out of balance must halve; else the structure flows."""

ROUNDS = 6
"""In which limits of friction are taken from the solution before, within a step."""


def relaxed(solver: Solver, model: Model, load: Array, start: Array) -> tuple[Model, Solved]:
    """Let a structure creep to equilibrium.

    Args:
        solver: for the pattern of this model's tangents.
        model: with what its joints remember at the start.
        load: generalised forces (n,).
        start: coordinates from which it creeps (n,).

    Returns:
        The model with what its joints remember in the end, and the coordinates there.

    Raises:
        DidNotConverge: it does not come to rest: it falls, or flows.
    """
    drag, iterations, rests = 1.0, 0, [np.inf]
    q, closed, scale = start, model.closed(), magnitude(load)
    while drag <= HARD and len(rests) <= STEPS:
        try:
            crept = _crept(solver, model, load, q, drag * closed)
        except DidNotConverge:
            drag *= CHANGE
            continue
        q, iterations = crept.q, iterations + crept.iterations
        model = model.remembering(model.remembered(q))
        rest = float(np.linalg.norm(model.force(q) - load))
        if rest <= _least(solver, model, q, scale):
            return model, Solved(q, iterations, rest)
        rests.append(rest)
        if len(rests) > WAIT and rest > 0.5 * rests[-WAIT]:
            break
        drag /= CHANGE if crept.iterations <= EASY else 1.0
    raise DidNotConverge(
        f"it does not come to rest in {len(rests) - 1} steps of creep: {rests[-1]:.2e} of "
        f"{scale:.2e} stays out of balance"
    )


def _crept(
    solver: Solver, model: Model, load: Array, start: Array, drag: sparse.csr_matrix
) -> Solved:
    """One step against a drag (n, n)."""
    try:
        return _dragged(solver, model, load, (start, start), drag, ("basic",))
    except DidNotConverge:
        if not isinstance(model, Jointed):
            raise
    points = len(model.operator.points.arm)
    given, q, iterations = np.full(points, magnitude(load)), start, 0
    for _ in range(ROUNDS):
        held = model.between(GivenLimits.of(model.operator, given))
        solved = _dragged(solver, held, load, (start, q), drag, ("basic", "cp"))
        q, iterations = solved.q, iterations + solved.iterations
        given = _limits(model.operator, q)
    return Solved(q, iterations, solved.residual)


def _limits(joints: JointOperator, q: Array) -> Array:
    """Coulomb's limits at q (p,) [N]."""
    opening = joints.felt(q)
    return joints.limits(joints.law.forces(opening), joints.law.closed(opening))


def _dragged(
    solver: Solver,
    model: Model,
    load: Array,
    starts: tuple[Array, Array],
    drag: sparse.csr_matrix,
    searches: tuple[str, ...],
) -> Solved:
    """Solve a step: from where the drag counts, and where iterations begin, each (n,)."""
    first, guess = starts

    def tangent(q: Array) -> sparse.csr_matrix:
        stiffness = model.tangent(q)
        together = stiffness.copy()
        together.data = stiffness.data + drag.data
        return together

    return solver.solve(
        lambda q: model.force(q) - load + drag @ (q - first),
        tangent,
        guess,
        magnitude(load),
        searches,
    )


def _least(solver: Solver, model: Model, q: Array, scale: float) -> float:
    """What may be left out of balance: the tolerance, or the rounding of large motions."""
    rounding = 8.0 * np.finfo(float).eps * np.linalg.norm(abs(model.tangent(q)) @ abs(q))
    return min(max(solver.settings.tolerance * scale, float(rounding)), ROUGHLY * scale)
