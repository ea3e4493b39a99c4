"""Equilibrium under loads that stay: self-weight first of all."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import xarray as xr

from archfem.arguments import instance
from archfem.arrays import Array
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import judged
from archfem.joints.resultants import joint_dataset, one_joint
from archfem.masonry.actions import BodyForce
from archfem.masonry.stages import Stage, placed
from archfem.models.gauges import Gauges
from archfem.models.jointed import Jointed
from archfem.models.model import Model, check_model
from archfem.models.moving import Moving
from archfem.models.turning_stages import on_site, taken_over
from archfem.models.unfinished import Unfinished
from archfem.shown import Shown
from archfem.statics.newton import Newton, Solver
from archfem.statics.search import BRINGING_ON, FOLLOWING, Ways, followed
from archfem.threads import on_one_thread

SMALLEST_STEP = 1.0 / 64.0
"""Of a load or a settlement, to which steps are halved before giving up."""


@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(Shown, picture="dead.draw_dead_load"):
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

    def continued(self, model: Model) -> Model:
        """Return a model with what the joints of this equilibrium know of how it came about.

        Args:
            model: the same rung of the same structure.

        Raises:
            InvalidInput: it is another one.
        """
        if model.size != self.model.size or len(model.memory) != len(self.model.memory):
            raise InvalidInput(
                f"the state has {self.model.size} coordinates and {len(self.model.memory)} joint "
                f"points, the model {model.size} and {len(model.memory)}: give the same model's"
            )
        if model.structure.fingerprint != self.model.structure.fingerprint:
            raise InvalidInput(
                f"the state is of another structure, '{self.model.structure.name}', whose blocks "
                f"are elsewhere than those of '{model.structure.name}': give the same model's"
            )
        built = self.model.built if isinstance(self.model, Jointed | Moving) else None
        if built is not None and isinstance(model, Jointed | Moving):
            model = model.begun(built)
        return model.remembering(self.model.memory)

    @cached_property
    def joints(self) -> xr.Dataset:
        """N, V, M, eccentricity, friction, opening, rotation and slip over joint."""
        gauges = Gauges.on(self.model)
        faces = gauges.faces(gauges.read(self.q))
        resultants, moved = self.model.resultants(self.q), isinstance(self.model, Moving)
        return joint_dataset(self.model.structure, resultants, faces=faces, moved=moved)

    def _words(self) -> str:
        """What it is, in a line or two."""
        own, model = judged(self.joints), self.model
        return (
            f"Equilibrium of '{model.structure.name}' ({model.fidelity}, {model.size} coordinates)"
            f": |e| ≤ {float(abs(own['eccentricity']).max()):.3f}, "
            f"V/N ≤ {float(own['friction'].max()):.3f}, N ≥ {float(own['N'].min()) / 1e3:.3g} kN"
        )

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


@on_one_thread
def dead_load(
    model: Model, newton: Newton | None = None, *, stages: Sequence[Stage] | None = None
) -> Equilibrium:
    """Find the equilibrium under self-weight.

    Joints open and slide as they must (nonlinear statics), those that dilate ride up, and bonds
    that are overstrained break, until none does any more; where Newton's method fails the
    structure creeps to rest, or steps of the load are halved. Displacements are small: the
    structure keeps its shape.

    Built in one go, the structure gets its weight as a whole. Built in stages, blocks come
    without stress onto what has been displaced already, and centring holds some until it is
    struck. Where displacements may be large, building is by small ones, and balance is then found
    in the shape that it has given. Joints of the result's `model` know how they began; whatever
    takes the result as its start goes on with them, and a run that goes on from a `last_state`
    needs that model.

    Args:
        model: any rung of the ladder; in stages not "monolithic".
        newton: settings of the solves.
        stages: in which the structure was built, e.g. `usual_stages(structure)`; by default in one
            go.

    Returns:
        The state, with its joints' resultants.

    Raises:
        InvalidInput: the model is none, or the stages do not build it.
        DidNotConverge: the structure cannot carry its own weight, or hardly; `last` is the last
            equilibrium found on the way, under part of the weight.

    Example:
        >>> model = af.build(af.column(breadth=0.6, heights=[1.2, 1.2]), fidelity="rigid")
        >>> af.dead_load(model).joints["N"].values.round(3).tolist()
        [28800.0, 14400.0]
    """
    check_model(model)
    if stages is None:
        return equilibrium_under(model, self_weight(model), newton)
    if isinstance(model, Moving):
        return _built_to_move(model, newton, stages)
    if not isinstance(model, Jointed):
        raise InvalidInput(
            f"a model '{model.fidelity}' cannot be built in stages: use 'full', which is the same"
        )
    solver = _solver(model, newton)
    built = _built(solver, model.moved(np.zeros_like(model.supports)), stages)
    return _on_moved_supports(solver, built, self_weight(model), model.supports)


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
    solver = _solver(model, newton)
    before = model.moved(np.zeros_like(model.supports))
    rest = Equilibrium(before, np.zeros(model.size), 0, 0)
    carried = _grown(solver, rest, lambda part: (before, part * load), "load")
    return _on_moved_supports(solver, carried, load, model.supports)


def _solver(model: Model, newton: Newton | None) -> Solver:
    if newton is not None:
        instance(newton, Newton, "newton", "give Newton(tolerance=…)")
    return Solver(model.size, newton, sparing=True)


def _on_moved_supports(
    solver: Solver, found: Equilibrium, load: Array, supports: Array
) -> Equilibrium:
    """Move the supports of a structure at rest to where they are to be."""
    if not supports.any():
        return found
    model = found.model

    def at(part: float) -> tuple[Model, Array]:
        return model.moved(part * supports), load

    return _grown(solver, found, at, "settlement", FOLLOWING)


def _built(solver: Solver, whole: Jointed, stages: Sequence[Stage]) -> Equilibrium:
    """Build a structure stage by stage."""
    site = Unfinished(whole)
    found = Equilibrium(site, np.zeros(whole.size), 0, 0)
    for stage, blocks in zip(stages, placed(whole.structure, stages), strict=True):
        if stage.strike:
            site = site.struck().remembering(found.model.memory)
            found = _brought_on(solver, found, site, f"'{stage.name}'")
        if blocks:
            site = site.remembering(found.model.memory)
            site = site.placed(blocks, found.q, centring=stage.centring)
            found = _brought_on(solver, found, site, f"'{stage.name}'")
    return replace(found, model=site.remembering(found.model.memory).finished())


def _built_to_move(model: Moving, newton: Newton | None, stages: Sequence[Stage]) -> Equilibrium:
    """Build blocks by small displacements, and find their balance where that has taken them."""
    small = on_site(model)
    built = _built(_solver(small, newton), small, stages)
    assert isinstance(built.model, Jointed)
    whole = taken_over(model.moved(small.supports), built.model)
    solver = _solver(whole, newton)
    found = _brought_on(solver, replace(built, model=whole), whole, "what was built")
    return _on_moved_supports(solver, found, self_weight(model), model.supports)


def _brought_on(solver: Solver, found: Equilibrium, site: Model, what: str) -> Equilibrium:
    """Bring on, little by little, all weight that is not in balance yet."""
    carried = site.force(found.q)
    rest = self_weight(site) - carried
    return _grown(solver, found, lambda part: (site, carried + part * rest), what)


def _grown(
    solver: Solver,
    found: Equilibrium,
    at: Callable[[float], tuple[Model, Array]],
    what: str,
    ways: Ways = BRINGING_ON,
) -> Equilibrium:
    """Follow an equilibrium while something grows, which gives a model and a load for each part."""
    find, halved, smallest = ways
    factor, step = 0.0, 1.0
    while factor < 1.0:
        target = min(1.0, factor + step)
        model, load = at(target)
        model = model.remembering(found.model.memory)
        try:
            model, solved = find(solver, model, load, _start(found, model))
        except DidNotConverge as error:
            step /= 2.0
            find = halved if step > SMALLEST_STEP else smallest
            if step >= SMALLEST_STEP:
                continue
            raise DidNotConverge(
                f"no equilibrium beyond {factor:.3f} of the {what} ({error}): the structure cannot "
                "carry it; make it thicker, or check the outline, the supports and the load",
                last=found,
            ) from error
        found = Equilibrium(model, solved.q, found.iterations + solved.iterations, found.steps + 1)
        factor = target
    return found


def _start(found: Equilibrium, model: Model) -> Array:
    """Where the search for the next equilibrium begins: the last one, on its supports (n,)."""
    moved = model.supports - found.model.supports
    return followed(found.model, found.q, moved) if moved.any() else found.q
