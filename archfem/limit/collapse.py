"""Limit analysis of rigid blocks: collapse factor and mechanism by the static theorem.

The programme of `linear_programme` is set up by `backfill` and solved here; its dual is the
mechanism. Warnings name strength that joints might not have: friction with the dilatancy of
associated flow, dilatancy that is neglected, and cohesion of joints that are partly open.

At any stiffness, faces of rigid blocks press linearly on an elastic joint. Where the thrust is
outside the middle third, they press over c = 3 (h/2 - |e|). A gap transmits no shear, so cohesion
acts on the closed part only, as in elastic joints. Limit analysis takes it over the whole joint;
how much of it remains depends on where the thrust of the state is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from archfem._display import ExplainedWord, ResultDisplay
from archfem._typing import Array, CrushingStrength
from archfem._validation import validate_arguments
from archfem.errors import Interrupted, InvalidInput, keep_warnings, logger
from archfem.joints.resultants import check_instant, joint_dataset
from archfem.limit.backfill import BlocksWithFill, sum_body_forces
from archfem.limit.collapse_warnings import (
    warn_dilatancy,
    warn_lift,
    warn_locking,
    warn_lost_solution,
    warn_sliding,
)
from archfem.limit.fill_bounds import FillBounds, bound_least_factor, refine_bounds
from archfem.limit.fill_range import FillAssumption, FillRange, say_part, vary_fill
from archfem.limit.fill_strength import Fill, PlasticFill, find_clear_springing, place_backing
from archfem.limit.linear_programme import Optimum, Programme, RigidBlocks
from archfem.limit.mechanism_kinematics import RigidRegions
from archfem.limit.mechanism_names import name_mechanism
from archfem.limit.nonassociated import NonassociatedBounds, search_nonassociated
from archfem.limit.self_weight import (
    check_options,
    is_balanced,
    refuse_bonds,
    self_weight_programme,
)
from archfem.masonry.loads import (
    Action,
    PointLoad,
    Settlement,
    describe_massless,
    find_push,
    list_loads,
    name_side,
)
from archfem.masonry.materials import STONE
from archfem.masonry.standing import find_bodies
from archfem.masonry.structure import (
    CLEAR_TURNS,
    HasStructure,
    Structure,
    join_names,
    list_or_count,
    structure_of,
)
from archfem.units import MPa, kN, kPa


class Outcome(ExplainedWord):
    """Outcome of a limit analysis."""

    COLLAPSES = "collapses", "the load turns it into a mechanism"
    UNBOUNDED = "unbounded", "this load never overturns it"
    INFEASIBLE = "infeasible", "it does not stand under its own weight"
    SETTLES = "settles", "it follows its support and stands"
    LOCKS = "locks", "it cannot follow this movement of its support"
    BRACKETED = "bracketed", "no state without dilatancy was found"


# Said of a mechanism in whose place any stones above a bed joint may slide
ONE_OF_MANY = " (one of many: all bed joints reach μ)"


@dataclass(frozen=True, eq=False, repr=False)
class Collapse(ResultDisplay):
    """Result of a limit analysis: factor, joint forces and mechanism.

    Attributes:
        factor: multiple of the live load at collapse [-]; infinite where it never collapses,
            undefined (NaN) where it does not stand, or where no state was found. For a settlement,
            work of the weights on it [N m]: for a translation by 1 m, the thrust on the support
            along it, in N. With a `Fill` it is that of the fill as given, and may be the largest
            over what is assumed of it: the least is `range[0]`, with hinges and picture in `least`.
        outcome: how the analysis ended; `outcome.sentence` gives its meaning.
        hinges: joints that turn, with the face where the blocks stay in contact.
        sliding: numbers of the joints that slide.
        joints: N, V, M and derived quantities, as made by `joint_dataset`, at the factor; of one
            state under self-weight where the factor is infinite, NaN where there is none.
        motion: velocities of all blocks' centroids and rotations (n_blocks, 3) [m/s, m/s, rad/s].
            They are scaled so that the fastest corner has 1 m/s, or follow a settlement. Zero where
            nothing moves. Where the structure does not stand: the motion of its fall under its
            weight; where no state without dilatancy was found: that of the bound `upper`.
        solutions: bounds on all solutions where sliding is without dilatancy; else None.
        soil: pressure of the fill on each piece of a stone's face, with its least and largest
            possible values [Pa]; the number of the block, the piece's ends and the sense of the
            pressure along x; of a `PlasticFill` pressure and shear at both ends; None without fill.
        fill_motion: velocities of a `PlasticFill` by triangle, and strain rates over the largest;
            else None.
        upper: bound that no state of equilibrium exceeds: the factor itself, with a `PlasticFill`
            the bound from above. `factor` is the bound from below then, as `lower` is.
        over_fill: factors over all assumptions on a `Fill`; None without one, and of a settlement.
        least: the result under the assumption with the least factor, the fall at rest where nothing
            stands under it; None where it is this one.
        notes: what is in doubt about this factor, and not about the least.
        bounded: whether the factor is an upper estimate: where joints slide by associated flow, or
            fail by bonds, or partly open by cohesion.
        strength: compressive strength at which joints crush [Pa]; infinite where they do not.
        live: the growing actions, or the settlement.
        dead: the actions beside self-weight that do not grow.
        structure: the analysed structure; None where the result was built by hand.
    """

    factor: float
    outcome: Outcome
    hinges: tuple[tuple[int, str], ...]
    sliding: tuple[int, ...]
    joints: xr.Dataset
    motion: Array
    solutions: NonassociatedBounds | None = None
    soil: xr.Dataset | None = None
    fill_motion: xr.Dataset | None = None
    upper: float = np.nan
    over_fill: FillRange | None = None
    least: "Collapse | None" = None
    notes: tuple[str, ...] = ()
    bounded: bool = False
    strength: float = np.inf
    live: tuple[Action | Settlement, ...] = ()
    dead: tuple[Action, ...] = ()
    structure: Structure | None = None

    def __post_init__(self) -> None:
        """Let the factor be its own upper bound where there is no other."""
        if np.isnan(self.upper):
            object.__setattr__(self, "upper", self.factor)

    @property
    def lower(self) -> float:
        """The factor, or a proved bound where none was found: none is below it [-].

        It is of the fill as given; the least over what is assumed of a `Fill` is `range[0]`.
        """
        if self.outcome is Outcome.BRACKETED and self.solutions:
            return self.solutions.bracket[0]
        return self.factor

    @property
    def hinge_names(self) -> tuple[str, ...]:
        """Names of the joints that turn, in the order of `hinges`."""
        return tuple(str(self.joints["name"].values[joint]) for joint, _ in self.hinges)

    @property
    def sliding_names(self) -> tuple[str, ...]:
        """Names of the joints that slide, in the order of `sliding`."""
        return tuple(str(self.joints["name"].values[joint]) for joint in self.sliding)

    @property
    def range(self) -> tuple[float, float]:
        """Least and largest factor: over all assumptions on a fill, or both bounds [-]."""
        return (self.lower, self.upper) if self.over_fill is None else self.over_fill.ends

    @property
    def bonded(self) -> list[int]:
        """Failing joints that bonds hold, which break rather than yield."""
        failing = {*self.sliding, *(joint for joint, _ in self.hinges)}
        if self.structure is None:
            return []
        return sorted(failing.intersection(np.flatnonzero(self.structure.tension > 0.0).tolist()))

    @property
    def push(self) -> float:
        """Horizontal body force that alone grows, at a factor of 1 [g]; else 0."""
        return find_push(self.live)

    @property
    def sentence(self) -> str:
        """The outcome, and the load at collapse where there is one, with the end that moves so."""
        unit = abs(self.push) or 1.0
        if self.over_fill and self.outcome is Outcome.INFEASIBLE:
            state = min(self.over_fill.values, key=self.over_fill.values.__getitem__)
            most = f"else at up to {unit * self.range[1]:.4g}{self._name_load()}"
            words = f"{self.outcome.sentence} (fill: {state._replace(inertia='')})"
            return f"{words}: {self.mechanism_name}; {most}"
        if self.outcome is Outcome.UNBOUNDED and self.over_fill and np.isfinite(self.range[0]):
            return f"{self.outcome.sentence}, or does {self.describe_range()}"
        if self.outcome not in (Outcome.COLLAPSES, Outcome.BRACKETED):
            return self._headline
        ends = self.range if self.outcome is Outcome.COLLAPSES else (self.lower, self.upper)
        low, high = (f"{unit * bound:.4g}" for bound in ends)
        place, words = f"at {low}" if low == high else f"at {low} to {high}", self._name_load()
        if self.outcome is Outcome.BRACKETED:
            place = f"between {low} and {high}"
            if np.isinf(self.upper):
                place = f"at least {low}"
            elif low == high or (self.solutions and not self.solutions.has_lower_bound):
                place = f"at most {high}"
            return f"{self._headline}; it is {place}{words}"
        if self.solutions and self.solutions.may_be_less:
            place, words = place.replace("at ", "at ≤ ", 1), f"{words} (least found)"
        of = {ends[0]: "of the least", ends[1]: "of the most"}.get(self.factor, "between")
        shown = f" ({of})" * bool(self.over_fill and low != high)
        return f"{self._headline}{shown}, {place}{words}"

    @property
    def mechanism_name(self) -> str:
        """Plain name of the mechanism, as "four-hinge mechanism"; "" where nothing moves."""
        if self.structure is None or not self.motion.any():
            return ""
        slides = self.push and self.sliding and not self.hinges
        many = slides and slides_anywhere(self.structure, abs(self.factor * self.push))
        return name_mechanism(self.structure, self.motion) + ONE_OF_MANY * bool(many)

    @property
    def _loads(self) -> list[Action]:
        """Actions of `live` that are no settlement."""
        return [action for action in self.live if not isinstance(action, Settlement)]

    @property
    def _headline(self) -> str:
        """The name of the mechanism in place of the outcome, or after it."""
        unnamed = Outcome.SETTLES, Outcome.BRACKETED
        name = self.mechanism_name if self.outcome not in unnamed else ""
        if self.outcome is Outcome.COLLAPSES and name:
            return name
        return f"{self.outcome.sentence}: {name}" if name else self.outcome.sentence

    def _name_load(self) -> str:
        """Return the unit of the factor and the kind of the load, in words."""
        points = [action for action in self.live if isinstance(action, PointLoad)]
        if self.push:
            return f" g, pushed to the {name_side(self.push)}"
        if points and len(points) == len(self.live):
            sizes = join_names([f"{np.hypot(*point.force) / kN:.4g}" for point in points])
            places = join_names([f"{point.x:.4g}" for point in points])
            return f" times {sizes} kN at x = {places} m"
        is_settlement = len(self.live) == 1 and isinstance(self.live[0], Settlement)
        return " N m" if is_settlement else " times the load"

    def describe_range(self) -> str:
        """Describe both ends of the range over all assumptions on a fill; empty without one."""
        if self.over_fill is None:
            return ""
        return f"at {self.over_fill.describe(abs(self.push) or 1.0, name=' g' * bool(self.push))}"

    def _summary(self) -> str:
        """Describe the result in one or two lines."""
        return f"Collapse: {self}"

    def __str__(self) -> str:
        """Describe outcome, factor and failing joints in one line."""
        faces = [
            side if self.structure is None else self.structure.joints[number].name_face(side)
            for number, side in self.hinges
        ]
        turning = zip(self.hinge_names, faces, strict=True)
        sides = [f"{name} at the {face}" for name, face in turning]
        hinges = list_or_count(sides, CLEAR_TURNS) or "none"
        sliding = list_or_count(self.sliding_names) or "none"
        bound = "" if self.upper == self.lower or np.isnan(self.lower) else f" to {self.upper:.4g}"
        if self.range[0] < (1.0 - 1e-4) * self.lower:
            bound += f" with the fill as given (least {self.range[0]:.4g}, see .least)"
        text = f"{self._headline}: factor {self.lower:.4g}{bound}; hinges: {hinges}; "
        solutions = "" if self.solutions is None else f"; {self.solutions}"
        over = f"; {self.describe_range()}" if self.over_fill else ""
        crushing = ""
        if self.structure is not None:
            crushing = f"; {describe_crushing(self.strength, self.structure)}"
        massless = f"; {words}" if (words := describe_massless(self.live, self.dead)) else ""
        return f"{text}sliding: {sliding}{solutions}{over}{crushing}{massless}"


def slides_anywhere(structure: Structure, push: float) -> bool:
    """Return whether a push in multiples of the weight is the friction of all bed joints."""
    level = abs(structure.normals[~structure.heads, 1]) > 1.0 - 1e-9
    alike = np.allclose(structure.friction, push, rtol=1e-3)
    return bool(len(level) > 1 and level.all() and alike)


def collapse_factor(
    structure: Structure | HasStructure,
    *,
    live: Action | Settlement | Sequence[Action],
    friction: str | None = "coulomb",
    strength: CrushingStrength = None,
    fill: Fill | PlasticFill | None = None,
    dead: Sequence[Action] = (),
) -> Collapse:
    """Find the factor at which live actions, over self-weight, make rigid blocks a mechanism.

    Static theorem: the largest factor for which equilibrium and the joint criteria can both hold:

        max λ   subject to   -G_oᵀ F + G_sᵀ V = f_dead + λ f_live,   F >= 0,   |V| <= c A + μ N.

    F are the compressions at both ends of each joint; F >= 0 is the same as |M| <= N h/2. The dual
    programme finds the mechanism of least work: velocities v with f_live·v = 1 and joints that
    nowhere close,

        min c A·|G_s v| - f_dead·v   subject to   G_o v >= μ |G_s v|.

    Cohesion c (`Contact.cohesion`) acts on the area A of the whole joint, depth times width, and
    not only on its closed part. Where a joint with cohesion opens, the factor is an upper estimate,
    and a warning says so; `closed_cohesion` reduces it to the closed part of a given state. Tensile
    strength f_t (`Contact.tension`) yields too, over the depth h: F >= -f_t w h/2 at both ends, so
    that a hinge resists f_t w h²/2 about its edge. Bonds break where such joints yield: a warning
    says that the factor is an upper estimate. The dilatancy of contacts plays no part: sliding
    dilates by μ ("coulomb") or not at all ("nonassociated"), and a warning says so where the latter
    neglects it.

    A *settlement* s poses another problem. Of all states of equilibrium under self-weight, the
    movement of a support selects the one that resists it least. The factor is the work of the
    weights on it:

        min F·o_s - V·s_s   subject to   -G_oᵀ F + G_sᵀ V = f_dead,   F >= 0,   |V| <= c A + μ N.

    The settlement alone would cause the openings o_s and the slips s_s. Spreading supports
    give the least thrust of an arch and closing supports the greatest.

    Args:
        structure: supports are its fixed blocks; or an `archfem.Analysis` of it.
        live: one action, or several that grow together; a `Settlement` stands alone.
        friction: "coulomb" holds |V| <= c A + μ N with sliding that dilates (associated). If joints
            slide, the factor is an upper estimate and a warning is logged; "nonassociated" searches
            states whose joints slide without dilating for the weakest; None forbids sliding.
        strength: compressive strength σ of the blocks [Pa], which limits |M| to
            N h/2 - N²/(2 σ w), by a rectangular stress block. By default it is the least that the
            materials at assessed joints have, or are given in a case; 56 MPa, the value of the
            preset `STONE`, does not count. Infinite for no limit, "none" in a case. Joints of fill
            in pieces (`jointed_fill`) have their own strength, and not this one.
        fill: strength of blocks softer than their joints. These and the blocks on them become
            weight and pressures on the stones (`Fill`), or a plastic continuum with two bounds of
            the result (`PlasticFill`). None where there are none, or where they are cut into pieces
            (`jointed_fill`): the joints of these have that strength.
        dead: loads that act beside self-weight and do not grow, such as that of a press.

    Returns:
        The factor, the outcome and the mechanism.

    Raises:
        InvalidInput: an option is unknown; an action misses the structure or its movable part;
            joints have tensile strength under a settlement; or bodies too soft to be rigid are
            without the strength of a fill.
        DidNotConverge: the solver of linear programmes gave up.

    Note:
        The motion is one of the possible ones where several have the same factor. Without
        associated flow factors are not unique: `solutions` of the result gives the range of those
        from the search and the bounds of all. The factor is the least of the search, or for a
        settlement the greatest work. Where the search has none it is NaN, and the outcome says so.

    References:
        Heyman, Int. J. Solids Struct. 2 (1966) 249-279. Livesley, Int. J. Numer. Meth. Eng. 12
        (1978) 1853-1871. Ferris and Tin-Loi, Int. J. Mech. Sci. 43 (2001) 209-224.
    """
    structure = structure_of(structure)
    loads = live if isinstance(live, Settlement) else list_loads(live)
    if isinstance(loads, Settlement):
        refuse_bonds(structure)
    else:
        warn_lift(loads)
    stays = tuple(list_loads(dead)) if dead else ()
    given = structure, loads, stays, friction, strength
    if isinstance(fill, Fill) and not isinstance(loads, Settlement):
        return _solve_range(given, fill)
    return solve_as_given(*given, fill)


def _solve_range(given: tuple[Any, Any, Any, Any, Any], fill: Fill) -> Collapse:
    """Return a result with its range over a fill; what it warns of is that of the least."""
    said = list[str]()
    try:
        with keep_warnings() as said:
            result = solve_as_given(*given, fill)
        if np.isnan(result.factor):
            return result
        every, falls = _vary_assumptions(given, fill, result, said), Outcome.INFEASIBLE
        others = {k: each for k, each in every.items() if each[0].outcome is not Outcome.BRACKETED}
        values = {k: 0.0 if x.outcome is falls else x.factor for k, (x, _) in others.items()}
        over = FillRange(values, tuple(k for k in every if k not in others))
        result = replace(result, over_fill=over)
        if over.ends[0] == result.factor:
            return result
        least, of_least = others[min(values, key=values.__getitem__)]
        # what is in doubt at a larger factor alone
        notes = tuple(x for x in said if x not in of_least)
        said = of_least
        return replace(result, notes=notes, least=replace(least, over_fill=over, notes=notes))
    finally:
        for warning in said:
            logger.warning("%s", warning)


def _vary_assumptions(
    given: tuple[Any, Any, Any, Any, Any], fill: Fill, found: Collapse, said: list[str]
) -> dict[FillAssumption, tuple[Collapse, list[str]]]:
    """Return results and warnings under all assumptions on a fill, one known."""
    results = dict[FillAssumption, tuple[Collapse, list[str]]]()
    pushed = bool(sum_body_forces([*found._loads, *found.dead])[0])
    for assumption, (_, assumed) in vary_fill(fill, pushed=pushed).items():
        each, own = found, said
        if assumed != fill:
            try:
                with keep_warnings() as own:
                    each = solve_as_given(*given, assumed)
            except Interrupted as error:
                raise Interrupted(found) from error
        if each.outcome is Outcome.BRACKETED:
            words = "the range over the fill leaves out %s, with which %s"
            logger.warning(words, assumption, each.outcome.sentence)
        results[assumption] = each, own
    return results


def solve_as_given(
    structure: Structure,
    live: Settlement | list[Action],
    dead: Sequence[Action],
    friction: str | None,
    strength: float | None,
    fill: Fill | PlasticFill | None,
) -> Collapse:
    """Return the result of `collapse_factor` without its range over a fill."""
    if isinstance(fill, PlasticFill):
        if isinstance(live, Settlement):
            raise InvalidInput(
                "a settlement and a plastic fill: the bounds are of loads that grow; give the fill "
                "as af.limit.Fill, or a load"
            )
        search = refine_bounds(structure, live, friction, strength, fill, dead)
        result = read_bounds(structure, bound_least_factor({"load": search})["load"], friction)
    else:
        stones, programme = self_weight_programme(structure, friction, strength, fill, dead)
        if not (isinstance(live, Settlement) or stones.load(live).any()):
            raise InvalidInput(
                "the load is zero on all that can move: give it a force or a multiple of g, or "
                "another place"
            )
        result = _solve_collapse(stones, programme, live, friction)
        if result.outcome is Outcome.COLLAPSES and not isinstance(live, Settlement):
            stones.warn_of_lost_loads(live, dead, result.factor)
    if np.isinf(result.factor):
        warn_locking(structure, friction, fill)
    if friction is None:
        warn_idle_joints(result)
    actions = (live,) if isinstance(live, Settlement) else tuple(live)
    crushes = check_options(structure, friction, strength)
    result = replace(result, strength=crushes, live=actions, dead=tuple(dead), structure=structure)
    result = replace(result, bounded=warn_bonds(structure, result) or result.bounded)
    if result.outcome is Outcome.BRACKETED:
        logger.warning(
            "%s: the mechanism is of the bound, and dilates; %s; a pushover finds a state of "
            "elastic joints",
            *(result.sentence, result.solutions),
        )
    if result.solutions is not None and result.solutions.interrupted:
        raise Interrupted(result)
    return result


@validate_arguments
def closed_cohesion(structure: Structure, joints: xr.Dataset) -> Structure:
    """Restrict the cohesion and tension of joints to the part that is closed in a state.

    Limit analysis of the result is that of joints which lose cohesion where they open, in this
    state: give the last one of a pushover, and compare with the limit to which that tends.

    Args:
        structure: its joints have cohesion.
        joints: N, V, M of a state of it, e.g. `push.joints.isel(step=-1)`.

    Returns:
        The same blocks; each joint has its cohesion times the closed part of its depth.

    Raises:
        InvalidInput: `joints` has several instants, or those of another structure.

    Example:
        >>> stone = af.Contact(1.48e9, 0.30e9, friction=0.3, cohesion=6e3)
        >>> block = af.column(breadth=1.0, heights=[1.0], contact=stone)
        >>> push = af.pushover(af.build(block, fidelity="rigid"), af.BodyForce(1.0))
        >>> less = af.limit.closed_cohesion(block, push.joints.isel(step=-1))
        >>> each = (push, *(af.collapse_factor(b, live=af.BodyForce(1.0)) for b in (less, block)))
        >>> [round(found.factor, 4) for found in each]
        [0.5172, 0.5172, 0.6]
    """
    check_instant(structure, joints)
    fractions = contact_fractions(structure, joints["N"].values, joints["M"].values)
    joints_closed = []
    for joint, part in zip(structure.joints, fractions, strict=True):
        bond = {key: getattr(joint.contact, key) * float(part) for key in ("tension", "cohesion")}
        contact = replace(joint.contact, **bond)
        joints_closed.append(replace(joint, contact=contact))
    return replace(structure, joints=tuple(joints_closed))


def contact_fractions(structure: Structure, normal: Array, moment: Array) -> Array:
    """Return the closed fraction of each joint, for linear pressure; 0 without any (n_joints,)."""
    pressed = normal > 0.0
    eccentricity = np.abs(moment) / np.where(pressed, normal, 1.0) / structure.depths
    return np.where(pressed, np.clip(3.0 * (0.5 - eccentricity), 0.0, 1.0), 0.0)


def _solve_collapse(
    stones: BlocksWithFill, dead: Programme, live: Settlement | list[Action], friction: str | None
) -> Collapse:
    """Return the result of `collapse_factor`, without its live actions."""
    fall, structure = dead.minimise_residual(), stones.whole
    if not is_balanced(fall, dead):
        return _read_result(stones, dead, Outcome.INFEASIBLE, np.nan, _without_forces(fall))
    support = None
    if isinstance(live, Settlement):
        support = np.zeros((len(stones.rigid_regions.blocks), 3))
        support[stones.rigid_regions.blocks.index(live.place(structure))] = live.motion
        # the programme of least work on the motion of the supports
        intrados, extrados, slip = dead.blocks.gaps(support)
        programme = replace(dead, force_cost=np.concatenate([intrados, extrados, -slip]))
        scale = dead.blocks.force_unit
        bounded, unbounded = Outcome.SETTLES, Outcome.LOCKS
    else:
        programme, scale = dead.with_load_factor(stones.load(live)), -1.0
        bounded, unbounded = Outcome.COLLAPSES, Outcome.UNBOUNDED
    optimum = associated = programme.solve()
    solutions = None
    if friction == "nonassociated":
        warn_dilatancy(structure)
        optimum, solutions = search_nonassociated(programme, associated, scale)
    if optimum is None:
        shown = associated if support is None else None
        result = _read_without_optimum(stones, dead, unbounded, fall, solutions, shown)
        return replace(result, solutions=solutions)
    result = _read_result(stones, programme, bounded, scale * optimum.value, optimum, support)
    above = False
    if solutions is not None:
        warn_lost_solution(solutions)
    if not isinstance(live, Settlement):
        failing = {*result.sliding, *(joint for joint, _ in result.hinges)}
        if friction is not None and not structure.tension.any():  # bonds that hold stay closed
            above = warn_cohesion(structure, tuple(failing), result.joints, result.factor)
    if friction == "coulomb":
        above |= warn_sliding(structure, result.sliding, result.factor)
    return replace(result, solutions=solutions, bounded=above)


def _read_without_optimum(
    stones: BlocksWithFill,
    dead: Programme,
    unbounded: Outcome,
    fall: Optimum,
    solutions: NonassociatedBounds | None,
    associated: Optimum | None,
) -> Collapse:
    """Return the result where no factor limits the load, or none was found between its bounds."""
    at_rest = replace(fall, multipliers=np.zeros_like(fall.multipliers))
    lower, upper = solutions.bracket if solutions else (np.inf, np.inf)
    bound = upper if unbounded is Outcome.LOCKS else lower
    if not np.isfinite(bound):
        return _read_result(stones, dead, unbounded, np.inf, at_rest)
    shown = _without_forces(associated or at_rest)
    result = _read_result(stones, dead, Outcome.BRACKETED, np.nan, shown)
    return replace(result, upper=upper)


def read_bounds(structure: Structure, bounds: FillBounds, friction: str | None) -> Collapse:
    """Return the result of `collapse_factor` from bounds with a plastic fill, without its loads."""
    lower, upper = bounds.lower, bounds.above.factor
    blocks, regions = bounds.filled.blocks, bounds.filled.regions
    outcome = Outcome.COLLAPSES if np.isfinite(upper) else Outcome.UNBOUNDED
    outcome = Outcome.INFEASIBLE if np.isnan(upper) else outcome
    motion = blocks.motion(bounds.above.motion if np.isfinite(upper) else 0.0 * bounds.above.motion)
    if motion.any():
        motion = motion / blocks.largest_displacement(motion)
    hinges, slides = _find_failing(blocks, regions, motion)
    joints = _read_joints(structure, blocks, regions, bounds.below.forces)
    result = Collapse(lower, outcome, hinges, slides, joints, regions.expand_motion(motion))
    bounded = friction is not None and warn_sliding(structure, result.sliding, result.factor)
    soil, moved = bounds.contact_stress, bounds.fill_motion
    return replace(result, soil=soil, fill_motion=moved, upper=upper, bounded=bounded)


def _without_forces(optimum: Optimum) -> Optimum:
    """Return the same mechanism with undefined forces (NaN)."""
    forces, unknowns = (np.full_like(each, np.nan) for each in (optimum.forces, optimum.unknowns))
    return replace(optimum, forces=forces, unknowns=unknowns)


def _read_result(
    stones: BlocksWithFill,
    programme: Programme,
    outcome: Outcome,
    factor: float,
    optimum: Optimum,
    support: Array | None = None,
) -> Collapse:
    """Return joint resultants and the motion of all blocks of the structure from an optimum."""
    blocks, regions = programme.blocks, stones.rigid_regions
    motion = blocks.motion(optimum.multipliers)
    # A motion that follows a moving support has its own size; any other one is scaled.
    if support is not None:
        motion = motion + support
    elif motion.any():
        motion = motion / blocks.largest_displacement(motion)
    hinges, slides = _find_failing(blocks, regions, motion)
    joints = _read_joints(stones.whole, blocks, regions, optimum.forces - blocks.bond)
    moved, soil = regions.expand_motion(motion), stones.pressure_dataset(optimum.unknowns)
    # without the sign of a zero
    return Collapse(float(factor) + 0.0, outcome, hinges, slides, joints, moved, soil=soil)


def _find_failing(
    blocks: RigidBlocks, regions: RigidRegions, motion: Array
) -> tuple[tuple[tuple[int, str], ...], tuple[int, ...]]:
    """Return the joints that turn in a motion, with the face in contact, and those that slide."""
    least = 1e-6 * blocks.largest_displacement(motion)  # above the round-off of the programme
    intrados, extrados, slip = blocks.gaps(motion)
    dilation = np.where(abs(slip) > 0.0, blocks.structure.friction, 0.0) * abs(slip)
    # sliding faces touch flat, or ride up by associated flow
    gap = np.minimum(intrados, extrados)
    apart = (gap > least) & (abs(gap - dilation) > least)
    turning = (abs(extrados - intrados) > least) & ~apart
    hinges = tuple(
        (regions.joints[j], "intrados" if intrados[j] < extrados[j] else "extrados")
        for j in np.flatnonzero(turning)
    )
    return hinges, tuple(regions.joints[j] for j in np.flatnonzero((abs(slip) > least) & ~apart))


def _read_joints(
    whole: Structure, blocks: RigidBlocks, regions: RigidRegions, forces: Array
) -> xr.Dataset:
    """Return the resultants of all joints of a structure from the forces between its stones."""
    resultants = np.full((len(whole.joints), 3), np.nan)
    resultants[list(regions.joints)] = blocks.resultants(forces)
    return joint_dataset(whole, resultants)


def describe_crushing(strength: float | None, structure: Structure) -> str:
    """Describe at which strength joints crush, if at all: that of the stones, or one for them."""
    blocks = {structure.blocks[k] for k in np.unique(structure.pairs[structure.judged]).tolist()}
    own = sorted({block.material.strength or np.inf for block in blocks})
    if strength is None or np.isinf(strength):
        words = "joints do not crush: no strength of the stones counts"
        if not (preset := STONE.strength) or preset not in own:
            return words
        return f"{words} ({preset / MPa:g} MPa of the preset is not given)"
    of_stones = "the strength of the stones"
    if not np.isclose(strength, own).any():
        listed = " and ".join(f"{x / MPa:.3g} MPa" for x in own if x < np.inf) or "not known"
        of_stones = f"given for limit analysis (stones: {listed})"
    return f"joints crush at {strength / MPa:.3g} MPa, {of_stones}"


# by the table of load tests in docs/theory/fill.md
PLASTIC_EVIDENCE = (
    "too strong for 5 of 8 bridges under load tests: state the range to law 'pressure'"
)


def describe_fill(fill: Fill | PlasticFill | None, structure: Structure) -> str:
    """Describe how a fill acts on the stones of limit analysis; "" without its strength."""
    if fill is None:
        return ""
    fill = place_backing(fill, structure)
    strength = f"friction angle {fill.friction_angle:g}°, cohesion {fill.cohesion / kPa:g} kPa"
    if isinstance(fill, PlasticFill):
        text = f"fill: a plastic body, {strength}, {PLASTIC_EVIDENCE}"
        holds = "stones below are fixed"
    else:
        share = f"{say_part(fill.active)} of the active and at most {say_part(fill.mobilisation)}"
        text = f"fill: weight, and {share} of the passive pressure, {strength}"
        if find_bodies(structure):
            text += "; bodies on it press straight down, without dispersal"
        holds = f"it holds faces horizontally, by up to {fill.backing_strength / MPa:g} MPa"
    if fill.backing is None:
        return text
    height = fill.backing - find_clear_springing(structure)
    above = "" if np.isnan(height) else f", {height:.3g} m above the lowest clear springing"
    return f"{text}; backing up to y = {fill.backing:.4g} m{above}: {holds}"


def warn_idle_joints(result: Collapse) -> None:
    """Warn of joints without force, which never slide although they would open freely."""
    normal = result.joints["N"].values
    if idle := np.count_nonzero(normal <= 1e-6 * normal.max(initial=0.0)):
        logger.warning(
            "friction None locks %d joints that carry nothing, such as head joints: no part of a "
            "wall in bond can lift along a stepped crack, so that the factor %.4g is no bound; "
            "friction='nonassociated' lets it",
            *(idle, result.factor),
        )


def warn_bonds(structure: Structure, result: Collapse) -> bool:
    """Warn of failing joints that are held by bonds; return whether there are any."""
    if bonded := result.bonded:
        logger.warning(
            "%d joints such as '%s' fail by bonds that yield, up to %.3g Pa in tension: bonds are "
            "brittle and break one after the other, so that the factor %.4g is an upper estimate; "
            "a pushover breaks them, and without tension and cohesion the factor is safe",
            *(len(bonded), structure.joints[bonded[0]].name, structure.tension.max()),
            result.upper,
        )
    return bool(bonded)


def warn_cohesion(
    structure: Structure, failing: Sequence[int], joints: xr.Dataset, factor: float
) -> bool:
    """Warn of failing joints whose shear exceeds that of their closed part; return if any does."""
    normal, shear, moment = (joints[key].values for key in "NVM")
    strength = structure.cohesion * contact_fractions(structure, normal, moment)
    holds = np.isfinite(structure.friction) & (structure.cohesion > 0.0)
    strength[holds] += structure.friction[holds] * normal[holds]
    tolerance = 1e-6  # relative, above the round-off of the linear programme
    limit = (1.0 + tolerance) * strength + tolerance * structure.cohesion
    beyond = holds & (np.abs(shear) > limit)
    if overstrained := [number for number in sorted(failing) if beyond[number]]:
        logger.warning(
            "%d joints such as '%s' fail partly open, held by cohesion on all their area: the "
            "factor %.4g is an upper estimate; af.limit.closed_cohesion restricts it to the closed "
            "part in a state, such as the end of a pushover",
            *(len(overstrained), structure.joints[overstrained[0]].name, factor),
        )
    return bool(overstrained)
