"""The next equilibrium, from the last one: where the search begins, and how it goes on.

Where joints slide a structure has many equilibria, and comes to the one that its way leads to. A
search begins near it, and what joints remember is taken from equilibria alone.
"""

from collections.abc import Callable

from scipy.sparse.linalg import splu

from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.models.model import Model
from archfem.statics.lasting import lasting, upset
from archfem.statics.newton import Solved, Solver
from archfem.statics.relaxation import relaxed

Way = Callable[[Solver, Model, Array, Array], tuple[Model, Solved]]
"""Finds an equilibrium of a model under a load (n,) from a first guess (n,), and the model with
what its joints then remember."""

Ways = tuple[Way, Way, Way]
"""Of finding equilibria while something grows: in one step, in halved and in the smallest steps."""


def followed(model: Model, q: Array, motion: Array) -> Array:
    """Return coordinates if a structure follows its supports with its joints as they are (n,).

    To first order: no joint opens, closes or begins to slide. Supports that move together take the
    structure with them as it is.

    Args:
        model: before its supports move, with what its joints remember.
        q: coordinates of its equilibrium (n,).
        motion: of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
    """
    try:
        found: Array = q - splu(model.tangent(q).tocsc()).solve(model.pulled(q, motion))
    except RuntimeError:  # the tangent is singular
        return q
    return found


def found_nearby(solver: Solver, model: Model, load: Array, start: Array) -> tuple[Model, Solved]:
    """Find an equilibrium by a few full steps of Newton's method, as `lasting`.

    Args:
        solver: for the pattern of this model's tangents.
        model: with what its joints remember before.
        load: generalised forces (n,).
        start: first guess (n,).

    Returns:
        The model with what its joints then remember, and the coordinates.

    Raises:
        DidNotConverge: they did not lead to one.
    """
    return lasting(solver, model, load, start, ("basic",))


def found_or_crept(solver: Solver, model: Model, load: Array, start: Array) -> tuple[Model, Solved]:
    """Find an equilibrium, as `lasting`; where Newton's method fails, the structure creeps there.

    Args:
        solver: for the pattern of this model's tangents.
        model: with what its joints remember before.
        load: generalised forces (n,).
        start: first guess (n,).

    Returns:
        The model with what its joints then remember, and the coordinates.

    Raises:
        DidNotConverge: it does not come to rest.
    """
    try:
        return lasting(solver, model, load, start)
    except DidNotConverge:
        model, solved = relaxed(solver, model, load, start)
        return lasting(solver, model, load, solved.q) if upset(model) else (model, solved)


BRINGING_ON: Ways = (found_or_crept, lasting, lasting)
"""While a load grows: the structure may creep, once, to all of it."""

FOLLOWING: Ways = (found_nearby, found_nearby, found_or_crept)
"""While supports move: where full steps of Newton's method do not lead there the motion is halved,
for a search that goes far may end in an equilibrium to which the structure would not come."""
