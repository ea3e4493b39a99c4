"""Equilibria that last: joints which dilate, or break, upset the one in which they did.

What a dry joint has slid changes none of its forces. Saw teeth raise what has slid on them, and a
bond that breaks lets go of what it held: then equilibrium is sought again, from where the structure
is, until nothing slides or breaks any more. Of bonds that are torn those break first where each
joint gapes most, so that a crack goes on from its tip, and stops where the rest bears the load.
"""

import numpy as np

from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.models.model import Model
from archfem.statics.newton import CONVEX, Solved, Solver, magnitude

ROUNDS = 1000
"""In which joints may slide or break under the same load, each followed by an equilibrium."""


def upset(model: Model) -> bool:
    """Return whether what the joints remember may change their forces.

    Args:
        model: any rung.
    """
    return model.operator is not None and not model.operator.points.plain


def lasts(model: Model, q: Array, iterations: int) -> bool:
    """Return whether an equilibrium lasts: it was in balance as it had been left, and none is torn.

    Args:
        model: with what its joints remember of the one before.
        q: coordinates (n,).
        iterations: by which it was found.
    """
    operator = model.operator
    if iterations > 0 or operator is None or operator.bonds is None:
        return iterations == 0
    return not operator.bonds.torn(operator.felt(q)).any()


def lasting(
    solver: Solver,
    model: Model,
    load: Array,
    start: Array,
    searches: tuple[str, ...] = CONVEX,
) -> tuple[Model, Solved]:
    """Find an equilibrium that what the joints remember of it does not upset.

    Args:
        solver: for the pattern of this model's tangents.
        model: with what its joints remember at the start.
        load: generalised forces (n,).
        start: first guess (n,).
        searches: line searches to try, one after the other.

    Returns:
        The model with what its joints remember there, and the coordinates.

    Raises:
        DidNotConverge: there is no equilibrium, or joints go on sliding or breaking.
    """
    q, iterations = start, 0
    for number in range(ROUNDS):
        solved = _balanced(solver, model, load, q, searches)
        q, iterations = solved.q, iterations + solved.iterations
        if number > 0 and lasts(model, solved.q, solved.iterations):
            return model, Solved(q, iterations, solved.residual)
        before, model = model.memory, model.remembering(model.remembered(q))
        if not upset(model):
            return model, solved
    further = float(np.abs(model.memory - before).max())
    raise DidNotConverge(
        f"joints that dilate or break go on to do so in {ROUNDS} rounds under the same load, by "
        f"{further:.2g} m in the last one: give less dilatancy, or softer joints across than along"
    )


def _balanced(
    solver: Solver, model: Model, load: Array, start: Array, searches: tuple[str, ...]
) -> Solved:
    """An equilibrium by Newton's method, whatever the joints then remember."""
    scale = magnitude(load)
    return solver.solve(lambda q: model.force(q) - load, model.tangent, start, scale, searches)
