"""Equilibrium under permanent loads: dead load, construction in stages, moved supports.

The load, and then the motion of the supports, is applied in steps that are halved where the
solver fails. Joints carry their memory, irreversible slip and broken bonds, from step to
step.

Warnings name results that a dry-stone structure cannot have. Joints that never slide carry any
shear, and elastic joints that slide may come to rest far from their drawn position. A structure of
rigid blocks that no thrust line within friction can hold must not be at rest: the safe theorem
(Heyman, Int. J. Solids Struct. 2 (1966) 249-279) checks it by a linear programme without stiffness.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations
from math import sqrt
from typing import Literal, Protocol, runtime_checkable

import numpy as np
import xarray as xr

from archfem._display import ResultDisplay
from archfem._threads import single_threaded
from archfem._typing import Array
from archfem._validation import check_type, is_one_of, validate_arguments
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.contact_law import LARGEST_CLOSING, ContactLaw
from archfem.joints.criteria import assessed_joints
from archfem.joints.resultants import joint_dataset, select_joint
from archfem.limit import instability
from archfem.limit.linear_programme import NoEquilibrium
from archfem.masonry.block import Block, as_point, say_place
from archfem.masonry.construction import Stage, resolve_stages
from archfem.masonry.loads import BodyForce
from archfem.masonry.parts import find_undivided
from archfem.masonry.standing import find_bodies
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Joint, Structure, join_joint_names, join_names
from archfem.models.construction import PartialStructure
from archfem.models.linear_blocks import LinearBlockModel
from archfem.models.model import Doubt, Model, check_model
from archfem.statics import relaxation
from archfem.statics.fill_checks import doubt_pieces, doubt_whole_fill, stands_as_rigid_blocks
from archfem.statics.newton import EquilibriumSolver, Newton
from archfem.statics.relaxation import linear_predictor, relax, solve_irreversible, solve_or_relax
from archfem.units import GPa, MPa, format_mm, mm

# Median depth of a ring's joints above which a wrong unit is likely [m]: of arches that span more
# than 60 m the deepest are about that
MAX_USUAL_DEPTH = 2.0

# Displacement along a joint under dead load above which a structure is not as drawn [m]
MAX_SLIP_AT_REST = 1.0 * mm


@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(ResultDisplay):
    """A structure at rest.

    Attributes:
        model: model in equilibrium, with the initial gaps and the memory of its joints.
        q: coordinates (n,).
        iterations: number of Newton iterations, over all steps.
        steps: number of steps of the load, and then of any motion of the supports.
    """

    model: Model
    q: Array
    iterations: int
    steps: int

    def transfer_memory(self, model: Model) -> Model:
        """Return a model with the initial gaps and the memory of the joints of this equilibrium.

        Args:
            model: model of the same fidelity and the same structure.

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
        gaps, others = self.model.initial_gaps, model.initial_gaps
        if gaps is not others:  # what was built in one go has none
            model = model.with_initial_gaps(np.zeros_like(others) if gaps is None else gaps)
        return model.with_memory(self.model.memory)

    @cached_property
    def joints(self) -> xr.Dataset:
        """N, V, M, eccentricity, friction, opening, rotation and slip over joint."""
        observer, large = self.model.observer(), self.model.large_displacements
        faces = observer.faces(observer.read(self.q))
        resultants = self.model.resultants(self.q)
        return joint_dataset(self.model.structure, resultants, faces=faces, moved=large)

    def _summary(self) -> str:
        """Describe the equilibrium in one or two lines."""
        joints, model = assessed_joints(self.joints), self.model
        return (
            f"Equilibrium of '{model.structure.name}' ({model.fidelity}, {model.size} coordinates)"
            f": |e| ≤ {float(abs(joints['eccentricity']).max()):.3f}, "
            f"V/N ≤ {float(joints['friction'].max()):.3f}, "
            f"N ≥ {float(joints['N'].min()) / 1e3:.3g} kN"
        )

    def joint(self, joint: str | int) -> xr.Dataset:
        """Return the resultants and the displacements of one joint.

        Args:
            joint: its name or number.

        Raises:
            InvalidInput: there is no such joint.
        """
        return select_joint(self.joints, joint)


@validate_arguments
def self_weight(model: Model) -> Array:
    """Return the generalised forces of gravity (n,) [N, N m].

    Args:
        model: model of any fidelity.
    """
    return model.load(BodyForce(0.0, -1.0))


@runtime_checkable
class Subject(Protocol):
    """A value that a structure at rest follows from, such as an `archfem.Analysis`."""

    def dead_load(self) -> Equilibrium:
        """Find the equilibrium under dead load, with its model."""


# State to linearise or to start at: an equilibrium, all joints closed, or None for the dead load
Start = Equilibrium | Literal["closed"] | None


def resolve_start(
    model: Model | Subject, start: Start
) -> tuple[Model, Equilibrium | Literal["closed"]]:
    """Return the model and the state to start at; the dead load is computed where none is given."""
    if isinstance(model, Subject):
        rest = model.dead_load()
        model, start = rest.model, rest if start is None else start
    check_model(model)
    if start is None:
        start = dead_load(model)
    elif not is_one_of(start, ("closed",)):
        check_type(start, Equilibrium, "start", 'give dead_load(model), "closed" or None')
    return model, start


@single_threaded
def dead_load(
    model: Model | Subject, newton: Newton | None = None, *, stages: Sequence[Stage] | None = None
) -> Equilibrium:
    """Find the equilibrium under self-weight.

    Joints open and slide as they must (nonlinear statics); joints with dilatancy open as they
    slide, and overstrained bonds break, until none does any more. Where Newton's method fails the
    structure is relaxed to rest, or steps of the load are halved. Displacements are small: the
    structure keeps its shape.

    Built in one go, the structure gets its weight as a whole. Built in stages, blocks are placed
    without stress onto the displaced structure, and centring holds some until it is struck. Where
    displacements may be large, building is by small ones, and balance is then restored in the
    displaced shape.

    The returned `model` stores the joint state (initial gaps, slip, broken bonds). Pass the result
    as `start=` to continue from it; to continue from `last_state(run)`, use this model.

    Args:
        model: model of any fidelity; in stages not "monolithic"; or an `archfem.Analysis`, which
            has settings and stages of its own.
        newton: settings of the solves.
        stages: stages of construction, e.g. `usual_stages(structure)`; by default in one go.

    Returns:
        The state, with its joints' resultants.

    Raises:
        InvalidInput: the model is none, or the stages do not build it.
        DidNotConverge: the structure cannot carry its own weight, or only just; `last` is the last
            equilibrium, under part of the weight.

    Example:
        >>> model = af.build(af.column(breadth=0.6, heights=[1.2, 1.2]), fidelity="rigid")
        >>> af.dead_load(model).joints["N"].values.round(3).tolist()
        [28800.0, 14400.0]
    """
    if isinstance(model, Subject):
        if newton is not None or stages is not None:
            raise InvalidInput("an analysis has newton and stages of its own: change them there")
        return model.dead_load()
    check_model(model)
    if stages is None:
        try:
            search = partial(solve_or_relax, check=_refuse_if_rigid_blocks_fall)
            return _check_closings(_load_from_rest(model, self_weight(model), newton, search))
        except DidNotConverge as error:
            message = _describe_failure(model, error, newton)
            raise DidNotConverge(message, last=error.last) from error
    # blocks are placed by small displacements on supports that have not moved
    small = model.small_displacement_model()
    if not isinstance(small, LinearBlockModel):
        raise InvalidInput(
            f"a model '{model.fidelity}' cannot be built in stages: use 'full', which is the same"
        )
    if small.structure.has_own_laws:
        raise InvalidInput(
            "contacts have a law of their own, with which nothing is built in stages: leave out "
            "the stages"
        )
    small = small.with_support_motion(np.zeros_like(model.support_motion))
    solver = _create_solver(small, newton)
    built = _build_in_stages(solver, small, stages)
    if model.large_displacements:
        # balance in the displaced shape; tangents have another sparsity pattern there
        whole = model.with_support_motion(small.support_motion).with_joint_state(built.model)
        solver, built = _create_solver(whole, newton), replace(built, model=whole)
        built = _apply_remaining_weight(solver, built, whole, "what was built")
    moved = _move_supports(solver, built, self_weight(model), model.support_motion)
    return _check_closings(moved)


def _check_closings(state: Equilibrium) -> Equilibrium:
    """Refuse dead load that closes a joint beyond the law of joints that stiffen; else return it.

    Raises:
        InvalidInput: an edge of a joint is closed by nearly its largest closing, or more.
    """
    structure, observer = state.model.structure, state.model.observer()
    largest = [joint.contact.closure or np.inf for joint in structure.joints]
    if min(largest) == np.inf:
        return state
    gap, rotation, _ = observer.faces(observer.read(state.q))
    closings = 0.5 * np.abs(rotation) * structure.depths - gap
    worst = int(np.argmax(closings / largest))
    if closings[worst] > LARGEST_CLOSING * largest[worst]:
        joint, closing = structure.joints[worst], closings[worst]
        stress = -ContactLaw.of(joint.contact).closing_traction(-closing)
        raise InvalidInput(
            f"dead load closes joint '{joint.name}' by {closing / mm:.3g} mm at its edge, of a "
            f"largest closing of {largest[worst] / mm:.3g} mm, and its stress reaches "
            f"{stress / MPa:.3g} MPa: the law ends at {LARGEST_CLOSING:.0%}: give "
            f"'{joint.contact.name}' a larger closure or normal_stiffness"
        )
    return state


def _describe_failure(model: Model, error: DidNotConverge, newton: Newton | None) -> str:
    """Return the message of a failed dead load, with its cause by limit analysis."""
    try:
        cause = instability.explain_instability(model.structure)
    except (InvalidInput, DidNotConverge):  # soft bodies or bonds: limit analysis does not apply
        return str(error)
    if cause is not None:
        return f"'{model.structure.name}' does not stand under its own weight: {cause}"
    if pieces := _describe_moving_pieces(model, newton):
        return f"as rigid blocks it stands, but not with joints that open: {pieces}; {error}"
    soft = "joints are" if model.fidelity == "rigid" else "joints and blocks are"
    text = f"as rigid blocks it stands, but its {soft} too soft for its depth"
    friction = float(model.structure.friction.max())
    if friction < 1.1 * (instability.least_friction(model.structure) or 0.0):
        text = (
            f"as rigid blocks {instability.describe_friction(model.structure)}, which is too near "
            f"its {friction:g} for joints that deform (give more of it, or stiffer joints)"
        )
    part = _find_carried_part(model, newton)
    ways = f"{error}; limit analysis and dynamics.RigidBlockSimulation need no stiffness"
    if part is None:
        return f"{text}: compare with stiffer joints; {ways}"
    # rounded up to two digits
    factor = float(f"{1.05 / part:.2g}")
    least = factor * min(joint.contact.normal_stiffness for joint in model.structure.joints)
    stiff = f"it stands if they are {factor:g} times as stiff, k_n from {least:.2g} Pa/m on"
    return f"{text}: {stiff}; {ways}"


def _describe_moving_pieces(model: Model, newton: Newton | None) -> str:
    """Return which pieces of a fill move on, and what would hold them; "" where none do."""
    structure = model.structure
    if not any(block.grain for block in structure.blocks):
        return ""
    try:
        relax(_create_solver(model, newton), model, self_weight(model), np.zeros(model.size))
    except relaxation.MovesOn as moves_on:
        observer = model.observer()
        before, after = (observer.faces(observer.read(q)) for q in moves_on.steps)
        motion = [new - old for new, old in zip(after, before, strict=True)]
        speed = abs(motion[0]) + 0.5 * abs(motion[1]) * structure.depths + abs(motion[2])
        # those of joints beside a wedge that moves as one
        fast = np.flatnonzero(speed > 0.3 * speed.max())
        names = join_joint_names([structure.joints[k].name for k in fast])
        end = instability.name_free_end(structure, {*structure.pairs[fast].ravel().tolist()})
        return (
            f"pieces of the fill move on ({names}): {end or 'more of its cohesion may hold them'}"
        )
    return ""


def _find_carried_part(model: Model, newton: Newton | None, rounds: int = 20) -> float | None:
    """Return a part of the weight that the structure carries, near the largest; None without one.

    Where nothing but weight and stiffness has the dimension of a force, only their ratio matters: a
    structure that carries a part of its weight carries the whole with that much stiffer joints.
    """
    if any(joint.contact.cohesion > 0.0 for joint in model.structure.joints):
        return None
    weight, tried, largest, growth = self_weight(model), 1.0, 0.0, 2.0
    for _ in range(rounds):
        part = tried
        try:
            equilibrium_under(model, tried * weight, newton)
        except DidNotConverge as error:
            if error.last is None:
                break
            carried = error.last.model.force(error.last.q)
            part = float(carried @ weight) / float(weight @ weight)
        # a search may end too early, by steps that are too long or by rounding: more is tried in
        # smaller steps, until not even 5 % more is found
        if part <= 1.02 * largest and largest > 0.0:
            growth = sqrt(growth)
        largest = max(largest, part)
        if growth < 1.05 or largest >= 1.0:
            break
        # steps of the load are a sixty-fourth of it
        tried = min(growth * largest, 1.0) if largest > 0.0 else tried / 64.0
    return largest or None


@validate_arguments
def equilibrium_under(model: Model, load: Array, newton: Newton | None = None) -> Equilibrium:
    """Find the equilibrium under a load that is applied from rest.

    Supports that have moved do so after the load, step by step, so that joints slide and open in
    that order.

    Args:
        model: model of any fidelity.
        load: generalised forces (n,).
        newton: settings of the solves.

    Returns:
        The state under the whole load, on supports that have moved all the way.

    Raises:
        DidNotConverge: there is none; `last` is the last equilibrium.
    """
    return _load_from_rest(model, load, newton, solve_or_relax)


def _load_from_rest(
    model: Model, load: Array, newton: Newton | None, first_search: relaxation.Search
) -> Equilibrium:
    """Find the equilibrium under a load; the first search tries the whole of it."""
    solver = _create_solver(model, newton)
    fixed = model.with_support_motion(np.zeros_like(model.support_motion))
    unloaded = Equilibrium(fixed, np.zeros(model.size), 0, 0)
    searches = first_search, solve_irreversible, solve_or_relax
    loaded = _increment_load(solver, unloaded, lambda part: (fixed, part * load), "load", searches)
    return _move_supports(solver, loaded, load, model.support_motion)


def _refuse_if_rigid_blocks_fall(model: Model) -> None:
    """Refuse a structure that no joint forces within friction hold as rigid blocks."""
    # Resultants in balance within friction would be those of rigid blocks too. Without cohesion no
    # part of the weight is carried either, which long searches would find.
    structure = model.structure
    scales = not (model.large_displacements or structure.cohesion.any())
    if scales and not structure.has_own_laws and not stands_as_rigid_blocks(structure):
        raise NoEquilibrium("nothing within friction holds it as rigid blocks")


def _create_solver(model: Model, newton: Newton | None) -> EquilibriumSolver:
    if newton is not None:
        check_type(newton, Newton, "newton", "give Newton(tolerance=…)")
    return EquilibriumSolver(model.size, newton, prefer_scipy=True)


def _move_supports(
    solver: EquilibriumSolver, state: Equilibrium, load: Array, motion: Array
) -> Equilibrium:
    """Move the supports of a structure at rest to their final places."""
    if not motion.any():
        return state

    def at(part: float) -> tuple[Model, Array]:
        return state.model.with_support_motion(part * motion), load

    # where full Newton steps do not converge the motion is halved: a search far from the start may
    # end in an equilibrium that the loading path does not reach
    searches = relaxation.solve_local, relaxation.solve_local, solve_or_relax
    return _increment_load(solver, state, at, "settlement", searches)


def _build_in_stages(
    solver: EquilibriumSolver, whole: LinearBlockModel, stages: Sequence[Stage]
) -> Equilibrium:
    """Build a structure stage by stage, each in equilibrium before the next."""
    built = PartialStructure(whole)
    state = Equilibrium(built, np.zeros(whole.size), 0, 0)
    for stage, blocks in zip(stages, resolve_stages(whole.structure, stages), strict=True):
        if stage.strike:
            built = built.struck().with_memory(state.model.memory)
            state = _apply_remaining_weight(solver, state, built, f"'{stage.name}'")
        if blocks:
            built = built.with_memory(state.model.memory)
            built = built.placed(blocks, state.q, centring=stage.centring)
            state = _apply_remaining_weight(solver, state, built, f"'{stage.name}'")
    return replace(state, model=built.with_memory(state.model.memory).finished())


def _apply_remaining_weight(
    solver: EquilibriumSolver, state: Equilibrium, model: Model, what: str
) -> Equilibrium:
    """Apply in steps the part of the weight that is not in balance yet."""
    carried = model.force(state.q)
    remaining = self_weight(model) - carried
    return _increment_load(solver, state, lambda part: (model, carried + part * remaining), what)


def _increment_load(
    solver: EquilibriumSolver,
    state: Equilibrium,
    at: Callable[[float], tuple[Model, Array]],
    what: str,
    searches: relaxation.SearchSequence = (solve_or_relax, solve_irreversible, solve_irreversible),
) -> Equilibrium:
    """Follow an equilibrium while a load or motion grows; `at(factor)` returns model and load."""
    # by default the structure may relax, once, to all of a load
    # share of a load or a settlement to which steps are halved before the search fails
    min_load_step = 1.0 / 64.0
    find, find_halved, find_smallest = searches
    factor, step = 0.0, 1.0
    while factor < 1.0:
        target = min(1.0, factor + step)
        model, load = at(target)
        model = model.with_memory(state.model.memory)
        # blocks follow a motion of the supports to first order
        motion = model.support_motion - state.model.support_motion
        guess = linear_predictor(state.model, state.q, motion) if motion.any() else state.q
        try:
            model, solution = find(solver, model, load, guess)
        except DidNotConverge as error:
            # the step stays halved for the rest of the load
            step /= 2.0
            find = find_halved if step > min_load_step else find_smallest
            if step >= min_load_step and not isinstance(error, NoEquilibrium):
                continue
            raise DidNotConverge(
                f"no equilibrium beyond {factor:.3f} of the {what}, by steps of "
                f"{min_load_step:.3f}: {error}",
                last=state,
            ) from error
        iterations, factor = state.iterations + solution.iterations, target
        state = Equilibrium(model, solution.q, iterations, state.steps + 1)
    return state


def dead_load_doubts(dead: Equilibrium, friction: float | None = None) -> tuple[Doubt, ...]:
    """Return reasons why a structure cannot rest as its dead load says."""
    structure, joints = dead.model.structure, assessed_joints(dead.joints)
    ratio, names = joints["friction"], joints["name"].values
    limit = 1.0 if friction is None else friction  # rough faces of stone slide at 0.6 to 0.75
    doubts = [*structure_doubts(structure), *doubt_pieces(structure)]
    if (steep := (ratio > limit).values).any():
        reason = (
            f"under dead load |V| / N is {float(ratio.max()):.3g} in "
            f"{join_joint_names(names[steep])}, and joints slide from {limit:g} on: they hold "
            "only because they never slide"
        )
        doubts.append(Doubt(reason, "give the contacts their friction"))
    doubts += _doubt_slip(structure, joints)
    smallest = min(joint.contact.coefficient for joint in structure.joints)
    if smallest < 0.1:
        reason = f"the least coefficient of friction is {smallest:g}"
        doubts.append(Doubt(reason, "joints of stone have 0.6 to 0.75: check it"))
    if not stands_as_rigid_blocks(structure):
        reason = (
            "it was found at rest, but as rigid blocks nothing within friction holds it: "
            "archfem.stands says that it falls"
        )
        doubts.append(Doubt(reason, "compare with stiffer joints, or with large displacements"))
    return tuple(doubts)


def slips_at_rest(joints: xr.Dataset) -> Array:
    """Return how far shear displaces each assessed joint under dead load (n,) [m]."""
    return abs(assessed_joints(joints)["slip"].values)


def _doubt_slip(structure: Structure, joints: xr.Dataset) -> Iterator[Doubt]:
    """Doubt a structure whose joints slide far at rest, or are soft enough to move as far."""
    slip = slips_at_rest(joints)
    if not (far := slip > MAX_SLIP_AT_REST).any():
        return
    names = join_joint_names(joints["name"].values[far].tolist())
    size = f"by up to {slip.max() / mm:.3g} mm ({names})"
    ratio, limit = joints["friction"].values[far], joints["friction_limit"].values[far]
    if (ratio > 0.99 * limit).any():  # where all of a face slides they are equal, but for round-off
        reason = f"under dead load joints slide {size}: it does not stand as it was drawn"
        yield Doubt(reason, "check friction and the direction of these joints")
        return
    contacts = [structure.joints[number].contact for number in joints["joint"].values[far]]
    soft = np.array([contact.shear_stiffness for contact in contacts])
    # the displacement is nearly in inverse proportion to k_s; rounded up to two digits
    enough = float(f"{1.05 * (soft * slip[far]).max() / MAX_SLIP_AT_REST / GPa:.2g}")
    yield Doubt(
        f"under dead load shear displaces joints {size}: it does not stand as it was drawn; none "
        f"slides, with |V| / N up to {ratio.max():.3g}: they are soft, k_s from "
        f"{soft.min() / GPa:.3g} MPa/mm",
        f"give a shear_stiffness of about {enough:g} MPa/mm or more; limit analysis and rigid "
        "blocks need none",
    )


def structure_doubts(structure: Structure) -> list[Doubt]:
    """Return doubts about fixed blocks, parts and size of stones, and about fill in one piece."""
    fixed = [*_doubt_inner_supports(structure), *_doubt_ends(structure)]
    remedy = "if so, give it that part, in a drawing by its layer"
    parts = [Doubt(cause, remedy) for cause in structure.misplaced.values()]
    sizes = [*_doubt_slope(structure), *_doubt_depth(structure), *_doubt_undivided(structure)]
    return [*fixed, *parts, *sizes, *_doubt_ties(structure), *doubt_whole_fill(structure)]


def _doubt_ties(structure: Structure, most: int = 3) -> Iterator[Doubt]:
    """Doubt bodies that lie on many stones of a wall in bond, and tie them to one another."""
    heads, blocks = structure.pairs[structure.heads], structure.blocks
    stones = [number for number in heads.flat if blocks[number].role == "pier"]
    bonded = np.isin(structure.pairs, stones).any(axis=1)
    for name in find_bodies(structure):
        number = structure.block_number(name)
        below = bonded & (structure.pairs == number).any(axis=1)
        # axles leave gaps between their wheels
        lies = structure.depths[below].sum() > 0.9 * np.ptp(blocks[number].points[:, 0])
        if lies and below.sum() > most:
            yield Doubt(
                f"'{name}' lies on {below.sum()} stones of a wall as one rigid body, which ties "
                "them together: below pieces they may resist less",
                "cut it into pieces of about a stone's length, or add its weight to the stones",
            )


def _doubt_depth(structure: Structure) -> Iterator[Doubt]:
    """Doubt a ring whose joints are far deeper than those of built ones."""
    rings = np.array([joint.role == "ring" for joint in structure.joints], dtype=bool)
    depths = structure.depths[rings & structure.judged]
    if len(depths) and (depth := float(np.median(depths))) > MAX_USUAL_DEPTH:
        yield Doubt(
            f"joints of the ring are typically {depth:.3g} m deep, as of hardly any arch",
            "check the unit of the lengths; `unit` in [structure] replaces that of a drawing",
        )


def _doubt_undivided(structure: Structure) -> Iterator[Doubt]:
    """Doubt rings whose stones could hinge inside, as where several are drawn as one."""
    blocks = structure.blocks
    found = find_undivided(blocks, structure.joints, structure.pairs, structure.ends)
    for part in dict.fromkeys(blocks[k].part for k in found):
        own = [k for k in found if blocks[k].part == part]
        spans, hollows = zip(*(found[k] for k in own), strict=True)
        names = join_names([f"'{blocks[k].name}'" for k in own]) + (f" of '{part}'" if part else "")
        yield Doubt(
            f"in one piece over {{:.3g}} times the depth of a joint, {names} could hinge inside: "
            "the inner face rises by {:.2g} of the depth, and a ring of voussoirs is weaker",
            "draw the outline of each voussoir, unless it is one stone",
            ((min(spans), max(spans)), (min(hollows), max(hollows))),
        )


def _doubt_ends(structure: Structure) -> Iterator[Doubt]:
    """Doubt fixed blocks like a voussoir or course between a fixed one and a ring or pier."""
    blocks, pairs = structure.blocks, structure.pairs.tolist()
    fixed = [pair for pair in pairs if blocks[pair[0]].fixed and blocks[pair[1]].fixed]
    heights = structure.centroids[:, 1]
    both = sorted((*fixed, *(pair[::-1] for pair in fixed)), key=lambda pair: -heights[pair[1]])
    behind = dict(both)  # the lowest one that each fixed block touches
    for joint, support, free, outward in _free_faces(structure):
        block, stone = blocks[support], blocks[free]
        size = np.ptp(block.points, axis=0)
        if support not in behind or joint.role == "other" or free in structure.misplaced:
            continue
        like = block.area <= 1.5 * stone.area
        if joint.role == "pier":  # footings project
            below = heights[behind[support]] < block.points[:, 1].min()
            like = below and outward[1] > 0.5 and size[0] <= 1.05 * joint.depth
        courses = (b for b in blocks if b.role == "pier" and not b.fixed)
        like = like or any(np.allclose(np.ptp(b.points, axis=0), size, rtol=0.03) for b in courses)
        # one that has the part of the ring or pier is fixed on purpose, not by its layer
        if like and block.part != joint.part:
            beside = f"'{blocks[behind[support]].name}'"
            yield Doubt(
                f"'{block.name}' at {say_place(as_point(block.centroid))} m "
                f"({format_mm(size[0])} broad) is fixed, as is {beside} beside it, and carries "
                f"'{joint.part}': by its size it may be a stone of that, which is weaker then",
                "if it is, give it the part of that ring or pier, in a drawing by its layer; if "
                f"it is none, draw it as one with {beside}",
            )


def _doubt_slope(structure: Structure) -> Iterator[Doubt]:
    """Doubt piers whose beds all slope alike, as in a drawing that is turned a little."""
    role = np.array([joint.role == "pier" for joint in structure.joints], dtype=bool)
    beds = np.flatnonzero(role & structure.judged & (np.abs(structure.normals[:, 1]) > 0.5))
    if len(beds) < 4 or np.ptp(structure.middles[beds, 0]) < 2.0 * structure.depths[beds].max():
        return
    x, y = structure.normals[beds].T
    slopes = np.degrees(np.arctan(-x / y))
    slope = float(np.median(slopes))
    # a corner that errs by 2 mm turns a bed of half a metre by 0.3°
    if abs(slope) > 1.0 and np.abs(slopes - slope).max() < 0.5 * abs(slope):
        yield Doubt(
            f"all beds of the piers slope by about {slope:.2g}°, positive up to the right",
            "turn the drawing, unless the piers lean as built",
        )


def _free_faces(structure: Structure) -> Iterator[tuple[Joint, int, int, Array]]:
    """Yield joints at supports, with their fixed block, the other and the normal from fixed."""
    joints = zip(structure.joints, structure.pairs.tolist(), structure.normals, strict=True)
    for joint, (low, high), normal in joints:
        if structure.blocks[low].fixed != structure.blocks[high].fixed:
            fixed_first = structure.blocks[low].fixed
            yield (joint, low, high, normal) if fixed_first else (joint, high, low, -normal)


def _doubt_inner_supports(structure: Structure) -> list[Doubt]:
    """Return a doubt for fixed blocks within a ring or pier, or that lie on blocks that move."""
    blocks, body = structure.blocks, np.arange(len(structure.blocks))
    for one, other in structure.pairs:  # fixed blocks side by side are one body
        if blocks[one].fixed and blocks[other].fixed:
            body[body == body[other]] = body[one]
    # faces of each body that touch a part: block, middle of the joint, normal away from the block
    faces: dict[tuple[int, str], list[tuple[int, Array, Array]]] = {}
    below: dict[int, list[str]] = {}  # names of what moves below each fixed block
    fill = find_yielding_blocks(structure)
    for joint, block, free, outward in _free_faces(structure):
        # a bed, to 60° steep; a sidewall may lie on pieces of fill
        if outward[1] < -0.5 and free not in fill:
            below.setdefault(block, []).append(f"'{blocks[free].name}'")
        if joint.role == "other":
            continue
        of_part = faces.setdefault((int(body[block]), joint.part), [])
        of_part.append((block, joint.middle, outward))
    doubts = dict[tuple[int, str], Doubt]()
    for (number, part), touching in faces.items():
        for (first, at, one), (last, beyond, other) in combinations(touching, 2):
            # both look away from one another, and not upwards, as springings on a pier do
            away = one @ other < 0.0 < (at - beyond) @ (one - other)
            if away and one[1] + other[1] < 0.1:
                doubts[number, part] = _doubt_support(structure, sorted({first, last}), part)
                break
    stated = {number for number, _ in doubts}
    carried = [number for number in below if body[number] not in stated]
    return [*doubts.values(), *(_doubt_carried(blocks[k], below[k]) for k in carried)]


def _doubt_carried(block: Block, below: Sequence[str]) -> Doubt:
    """Return the doubt about a fixed block that lies on others, which move."""
    x, y = block.centroid
    return Doubt(
        f"'{block.name}' at ({x:.2f}, {y:.2f}) m cannot move, but lies on {join_names(below)}, "
        "which can, and puts no weight there: what it holds is far stronger than a structure "
        "in which it moves",
        "take fixed from it, in a drawing by its layer",
    )


def _doubt_support(structure: Structure, numbers: Sequence[int], part: str) -> Doubt:
    """Return the doubt about fixed blocks within a part."""
    x, y = structure.centroids[numbers].mean(axis=0)
    names = " and ".join(f"'{structure.blocks[number].name}'" for number in numbers)
    within = f"stones of '{part}'" if part else "stones"
    return Doubt(
        f"{names} at ({x:.2f}, {y:.2f}) m cannot move, but stands between {within}: what it holds "
        "is far stronger than a structure in which it moves",
        "take fixed from it, in a drawing by its layer, or, if it is a support, give the stones "
        "beside it parts of their own",
    )
