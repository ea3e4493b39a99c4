"""Equilibrium under loads that stay: self-weight first of all."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from scipy.sparse.linalg import splu

from archfem.arguments import instance
from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.joints.resultants import joint_dataset, one_joint
from archfem.masonry.actions import BodyForce
from archfem.models.gauges import Gauges
from archfem.models.model import Model, check_model
from archfem.statics.newton import Newton, Solved, Solver, magnitude

A_LITTLE = 1e-9
"""Motion of supports by which the force that they exert on a structure is found [m]."""

SMALLEST_STEP = 1.0 / 64.0
"""Of a load or a settlement, to which steps are halved before giving up."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A structure at rest.

    Attributes:
        model: whose equilibrium it is, with what its joints remember of how it came about.
        q: coordinates (n,).
        iterations: of Newton's method, over all steps.
        steps: in which the load, and then any motion of the supports, was brought on.
    """

    model: Model
    q: Array
    iterations: int
    steps: int

    @cached_property
    def joints(self) -> xr.Dataset:
        """N, V, M, eccentricity, friction, opening, rotation and slip over joint."""
        gauges = Gauges.on(self.model)
        faces = gauges.faces(gauges.read(self.q))
        return joint_dataset(self.model.structure, self.model.resultants(self.q), faces=faces)

    def joint(self, joint: str | int) -> xr.Dataset:
        """Return what one joint carries.

        Args:
            joint: its name or number.

        Raises:
            InvalidInput: there is no such joint.
        """
        return one_joint(self.joints, joint)


def self_weight(model: Model) -> Array:
    """Return the generalised forces of gravity (n,).

    Args:
        model: any rung of the ladder.
    """
    return model.load(BodyForce(0.0, -1.0))


def dead_load(model: Model, newton: Newton | None = None) -> Equilibrium:
    """Find the equilibrium under self-weight.

    Joints open and slide as they must (nonlinear statics); steps of the load are halved where
    Newton's method fails. Displacements are small: the structure keeps its shape.

    Args:
        model: any rung of the ladder.
        newton: settings of the solves.

    Returns:
        The state, with its joints' resultants.

    Raises:
        InvalidInput: the model is none.
        DidNotConverge: the structure cannot carry its own weight, or hardly; `last` is the last
            equilibrium found on the way, under part of the weight.
    """
    check_model(model)
    return equilibrium_under(model, self_weight(model), newton)


def equilibrium_under(model: Model, load: Array, newton: Newton | None = None) -> Equilibrium:
    """Find the equilibrium under a load that is brought on from rest.

    Supports that have moved do so after that, little by little: the joints follow.

    Args:
        model: any rung of the ladder.
        load: generalised forces (n,).
        newton: settings of the solves.

    Returns:
        The state under the whole load, on supports that have moved all the way.

    Raises:
        DidNotConverge: there is none; `last` is the last one on the way.
    """
    if newton is not None:
        instance(newton, Newton, "newton", "give Newton(tolerance=…)")
    solver = Solver(model.size, newton)
    before = model.moved(np.zeros_like(model.supports))
    rest = Equilibrium(before, np.zeros(model.size), 0, 0)
    carried = _grown(solver, rest, lambda part: (before, part * load), "load")
    if not model.supports.any():
        return carried
    return _grown(
        solver, carried, lambda part: (model.moved(part * model.supports), load), "settlement"
    )


def _grown(
    solver: Solver,
    found: Equilibrium,
    at: Callable[[float], tuple[Model, Array]],
    what: str,
) -> Equilibrium:
    """Follow an equilibrium while something grows, which gives a model and a load for each part."""
    factor, step = 0.0, 1.0
    while factor < 1.0:
        target = min(1.0, factor + step)
        model, load = at(target)
        model = model.remembering(found.model.memory)
        try:
            solved = _solve(solver, model, load, _followed(found, model))
        except DidNotConverge as error:
            step /= 2.0
            if step >= SMALLEST_STEP:
                continue
            raise DidNotConverge(
                f"no equilibrium beyond {factor:.3f} of the {what} ({error}): the structure cannot "
                "carry it; make it thicker, or check the outline, the supports and the load",
                last=found,
            ) from error
        model = model.remembering(model.remembered(solved.q))
        found = Equilibrium(model, solved.q, found.iterations + solved.iterations, found.steps + 1)
        factor = target
    return found


def _followed(found: Equilibrium, model: Model) -> Array:
    """Coordinates if the structure follows its supports, with its joints as they are now (n,)."""
    before, q = found.model, found.q
    moved = model.supports - before.supports
    if not moved.any():
        return q
    part = A_LITTLE / np.abs(moved).max()
    ahead = before.moved(before.supports + part * moved).remembering(before.memory)
    change = (ahead.force(q) - before.force(q)) / part
    try:
        followed: Array = q - splu(before.tangent(q).tocsc()).solve(change)
    except RuntimeError:  # the tangent is singular
        return q
    return followed


def _solve(solver: Solver, model: Model, load: Array, start: Array) -> Solved:
    return solver.solve(lambda q: model.force(q) - load, model.tangent, start, magnitude(load))
