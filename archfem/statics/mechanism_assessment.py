"""Kinematic assessment: a collapse mechanism against a design spectrum, by force and displacement.

The mechanism becomes an oscillator of one degree of freedom. P are the weights of all that moves,
and δ their horizontal virtual displacements at rest. The participating mass and its share are

    M* = (Σ P δ)² / (g Σ P δ²),   e* = g M* / Σ P.

Spectral acceleration and displacement are those of a control point C along the finite path:

    a* = α g / e*,   d* = d_C Σ P δ² / (δ_C Σ P δ).

a*(d*) is the capacity curve; it begins at a₀* and vanishes at d₀*. C is the centroid that moves
fastest along x at rest, of all blocks that are equally fast, or that of all weights that move, with
d* = d_C / e*, whose displacement capacity is the lesser multiple of the demand. The checks compare
a₀*, raised by a behaviour factor, with the ground acceleration. They compare a share of d₀* with
the displacement spectrum at a secant period.

References:
    Circolare 21 January 2019 n. 7 C.S.LL.PP. on the NTC 2018, C8.7.1.2.1.1 to C8.7.1.2.1.8.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import xarray as xr

from archfem._typing import Array, CrushingStrength, Numbers, Seconds
from archfem._validation import check_between, check_choice, validate_arguments
from archfem.errors import DidNotConverge, InvalidInput
from archfem.limit.backfill import attach_fill
from archfem.limit.displaced_blocks import TOUCHING, KinematicChain, PlacedBlocks, Tie
from archfem.limit.fill_range import FillAssumption, vary_fill
from archfem.limit.fill_strength import Fill, PlasticFill
from archfem.limit.finite_mechanism import MechanismPath, PathEnd, PathFollower
from archfem.limit.self_weight import check_options
from archfem.masonry.loads import AttachedLoad, BodyForce
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import (
    HasStructure,
    Structure,
    join_names,
    structure_of,
)
from archfem.models.model import Doubt
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.statics.assessed_mechanism import KinematicAssessment
from archfem.statics.assessment_checks import (
    LIMIT_STATES,
    UPPER_BOUND,
    AssessmentCheck,
    LimitState,
    add_fill_ranges,
    check_assessable,
    describe_floor,
    find_height_left_out,
    first_acceleration,
    judge_floor,
    list_lower,
    place_spectrum,
    secant_period,
)
from archfem.statics.first_mechanism import (
    DoesNotStand,
    describe_loads,
    describe_ties,
    doubt_loads,
    doubt_stretches,
    find_first_mechanism,
    find_foot,
    find_stretches,
    find_weakest_bodies,
    press_stones,
    search_flat,
    select_joints,
    take_fill_as_loads,
)
from archfem.units import format_ratio

# Largest difference of d₀* of two control points that are as good as one [-]: ratios differ by less
SAME_POINT = 0.01


@validate_arguments
def kinematic_assessment(  # noqa: PLR0913  (the factors of the codes are arguments)
    structure: Structure | HasStructure,
    spectrum: DesignSpectrum | Motion,
    *,
    direction: float = 1.0,
    friction: str | None = "coulomb",
    part: str | None = None,
    blocks: Sequence[int | str] | None = None,
    loads: Sequence[AttachedLoad] = (),
    fill: Fill | PlasticFill | None = None,
    limit_state: str | LimitState = "NTC-2018 SLV",
    q: float = 2.0,
    confidence_factor: float = 1.35,
    strength: CrushingStrength = None,
    free_period: Seconds | None = None,
) -> KinematicAssessment:
    """Assess the collapse mechanism under horizontal forces against a spectrum at the ground.

    The mechanism is that of `collapse_factor` under `BodyForce(direction)`, without cohesion, which
    is left out with a warning: α₀ is then on the safe side. It is followed along its finite motion
    (`archfem.limit.finite_mechanism`), which gives the capacity curve a*(d*). Two checks follow,
    with the factors of the Italian code:

    - *linear*: q a₀* / FC against the ground acceleration, that of the spectrum at T = 0;
    - *displacement*: d_u* as a share of d₀* against the displacement spectrum at the period of the
      limit state. The accelerations of the curve are divided by FC. A mechanism that the ground
      acceleration does not set in motion, a₀* / FC above it, passes as well. There is no check of a
      mechanism without a finite motion, such as most wedges of walls in bond. Nor is there one
      where the mechanism slides without turning, and its factor does not fall as it moves.

    Where joints crush, hinges are at the resultants of their crushed edges, N / (2 w f) inside: N
    is the thrust as the mechanism begins, width w and strength f.

    A fill, bodies softer than their joints, counts by its weight and mass on the stones below,
    column by column; with its strength, `fill`, it presses on them as in `collapse_factor`. Along
    the motion pressures are those of the weights as built: active on faces that move away, and
    passive on those that move into the fill. What stands high above the ground needs the
    spectrum there, of which `motion.FloorSpectrum` has the rule; a doubt says so of any other.

    Args:
        structure: supports are its fixed blocks; or an `archfem.Analysis` of it.
        spectrum: elastic design spectrum, 5 % damped unless it has a `damping`, corrected to that
            of the limit state by η = √(10/(5 + ξ)) >= 0.55; or a ground motion, whose response
            spectrum is the demand. Beyond 4 s the spectral displacement of European codes is held.
        direction: sense of the horizontal forces along x, 1 or -1.
        friction: "coulomb", "nonassociated" or None for no sliding, as for `collapse_factor`. In
            walls in bond, and where dilatancy alone lets the mechanism of "coulomb" move, that of
            "nonassociated" is taken, if it can be searched. None is no bound for walls in bond.
        part: name of a part; only joints that touch its blocks may move.
        blocks: names or numbers of blocks; only joints that touch them may move.
        loads: loads that stay with their blocks, such as floors and ties.
        fill: strength of the fill, a `Fill`; None leaves its pressure out. The bounds of a
            `PlasticFill` have no finite motion. In a case that of [limit], unless one is given.
        limit_state: rules of the displacement check: "NTC-2018 SLV" (d_u* = 0.4 d₀*, T = 1.68 π
            √(d_u* FC/a*), 8 % damping; Circolare 7/2019, C8.7.1.2.1.6 and .8), "NTC-2018 SLC" (0.6,
            1.56 π, 10 %; there), "NTC-2008 SLV" (0.4, secant period at 0.4 d_u*, 5 %; Circolare
            617/2009, from memory), or a `LimitState` with rules of another code.
        q: behaviour factor [-]; Circolare 7/2019, C8.7.1.2.1.7.
        confidence_factor: FC [-], that of knowledge level LC1 where the strength of the masonry is
            not taken into account; Circolare 7/2019, C8.7.1.2.1.3. The value 1.35 of LC1
            is from memory (C8.5.4.1).
        strength: as for `collapse_factor`, where the joints crush [Pa]; in a case that of [limit].
        free_period: T_0 of what vibrates freely until it moves, as a parapet or a gable above its
            eaves [s]: the linear check of all that is assessed takes the spectrum there, and none
            is at rest below it; Circolare 7/2019, eq. C8.7.1.9, and C8.7.1.7 for T_0. 0 where cross
            walls hold it until it moves; None also, in doubt where a floor shakes it.

    Returns:
        Oscillator, capacity curve and checks.

    Raises:
        InvalidInput: an argument is unknown or out of range, or the structure does not stand.
        DidNotConverge: the solver of linear programmes gave up.

    Note:
        EN 1998-3 and ASCE 41 have checks of their own, whose texts could not be read: give their
        factors as a `LimitState`.

    References:
        Circolare 21 January 2019 n. 7 C.S.LL.PP., C8.7.1.2.1.

    Example:
        >>> wall = af.column(breadth=0.6, heights=[2.4])
        >>> found = af.kinematic_assessment(wall, af.Eurocode8(ag=0.2, ground="B"))
        >>> round(found.alpha_0, 4), round(found.d_0_star, 4), found.displacement.passes
        (0.25, 0.3, True)
    """
    rules = limit_state
    if not isinstance(rules, LimitState):
        other = ", or give the rules of another code as a LimitState"
        rules = LIMIT_STATES[check_choice(rules, "limit_state", LIMIT_STATES, other)]
    if abs(direction) != 1.0:
        raise InvalidInput(f"direction {direction!r}: give 1 to the right or -1 to the left")
    for name, value, most in (("q", q, 10.0), ("confidence_factor", confidence_factor, 2.0)):
        check_between(value, f"{name} [-]", 1.0, most, ends="[]")
    structure = structure_of(structure)
    check_assessable(structure, friction, loads)
    search = _Search(
        *(structure, spectrum, float(direction), friction, part, blocks, tuple(loads), rules),
        *(confidence_factor, q, check_options(structure, friction, strength), free_period),
    )
    lever = fill.lever if isinstance(fill, Fill) else 0.0
    found = search.assess(lever, fill)
    found = add_fill_ranges(found, search.vary(lever, fill, found))
    least = (found.least or found).path
    if part is blocks is None and (above := search.assess_above(lever, fill, found)):
        found = replace(found, above=above)
    if fill is not None and least is not None:
        push = [BodyForce(search.direction)]
        attach_fill(structure, fill).warn_of_lost_loads(push, (), least.mechanisms[0].factor)
    return found


@dataclass(frozen=True, eq=False)
class _Search:
    """Search for the mechanism of a structure and its finite motion, for any strength of a fill."""

    structure: Structure
    spectrum: DesignSpectrum | Motion
    direction: float
    friction: str | None
    part: str | None
    blocks: Sequence[int | str] | None
    loads: tuple[AttachedLoad, ...]
    rules: LimitState
    confidence_factor: float
    q: float
    strength: float = np.inf  # at which joints crush [Pa]
    free_period: float | None = None  # T_0 [s]
    bed: int | None = None  # the one joint that moves at first

    def assess_above(
        self, lever: float, fill: Any, found: KinematicAssessment
    ) -> KinematicAssessment | None:
        """Return the assessment of what is above a bed of a stack with a lower ratio, if any.

        That of the least ratio by displacements has in `above` that by the linear check.
        """
        lower, law = None, self.friction and "coulomb"  # flat, the whole alone is searched
        given = self.spectrum, self.q, self.confidence_factor
        rate = partial(self.rules.rate, *given, free_period=self.free_period)
        bodies = find_weakest_bodies(self.structure, self.loads, self.direction, rate)
        for bed, blocks in bodies.items():
            if [bed] != [joint for joint, _ in found.hinges]:
                above = replace(self, bed=bed, blocks=blocks, friction=law).assess(lever, fill)
                if list_lower(above.checks, found.checks):
                    lower = replace(above, above=lower)
        return lower

    def assess(self, lever: float, fill: Fill | PlasticFill | None) -> KinematicAssessment:
        """Return the assessment with a fill, whose horizontal forces act at a lever."""
        filled = None if fill is None else attach_fill(self.structure, fill)
        whole = self.structure if filled is None else filled.whole
        stones, weights = take_fill_as_loads(whole, lever)
        joints = select_joints(stones, self.part, self.blocks)
        pressure = None if filled is None else press_stones(filled)
        loads = (*weights, *self.loads)
        placed = PlacedBlocks.at_rest(stones, loads, self.direction, pressure)
        friction = stones.friction if self.friction else np.full(len(stones.joints), np.inf)
        first = joints if self.bed is None else [self.bed]
        placed, mechanism = find_first_mechanism(placed, first, friction, self.strength)
        if mechanism is None:
            return _Oscillator(self, placed, None, 0, bool(weights)).assess()
        path, holds, doubt = self._follow(placed, joints, friction, mechanism)
        ties = describe_ties(placed, first, friction, path.mechanisms[0].factor)
        return _Oscillator(self, placed, path, holds, bool(weights), False, doubt, ties).assess()

    def _follow(
        self, placed: PlacedBlocks, joints: list[int], friction: Array, first: KinematicChain
    ) -> tuple[MechanismPath, int, Doubt | None]:
        """Return the path of a mechanism, where it holds to, and the doubt about its factor.

        In walls in bond, and where dilatancy alone lets a mechanism move, it is that of the search
        without dilatancy, if it is weaker; of one that has no finite motion even so, the path is
        the place at rest.
        """
        mechanism, moved, doubt = first, None, None
        slides = any(contact.slip for contact in first.contacts)
        searches = [False, True] if self.friction == "coulomb" else [True]
        for searched in searches if slides else [False]:
            if searched:
                mechanism, doubt = search_flat(placed, joints, first, self.friction)
                if moved is not None and moved[0].factors[0] <= mechanism.factor:
                    return (*moved, doubt if mechanism is not first else None)
            follower = PathFollower(placed, joints, friction)
            with suppress(DidNotConverge):  # no mechanism was found whose faces slide flat
                path = follower.follow(mechanism)
                if follower.travel > TOUCHING * self.structure.size:
                    path = path.end_sliding()
                    moved = path, follower.last_equilibrium(path)
                    # in walls in bond flat motions are many, and the search may find a weaker one
                    if searched or not (slides and self.structure.heads.any()):
                        return (*moved, doubt)
        rest = np.array([mechanism.factor]), np.zeros((1, *mechanism.motion.shape))
        path = MechanismPath(placed, *rest, mechanism.motion, (mechanism,), (), PathEnd.LOCKS)
        return path, 0, doubt

    def vary(
        self, lever: float, fill: Any, found: KinematicAssessment
    ) -> dict[FillAssumption, KinematicAssessment | None]:
        """Return the assessment by assumption on a fill, one being known; None does not stand."""
        others: dict[FillAssumption, KinematicAssessment | None] = {}
        if not find_yielding_blocks(self.structure):
            return others
        for assumption, (place, assumed) in vary_fill(fill).items():
            others[assumption] = found
            if (place, assumed) != (lever, fill):
                try:
                    others[assumption] = self.assess(place, assumed)
                except DoesNotStand:
                    others[assumption] = None
        return others


@validate_arguments
def assess_parts(
    structure: Structure, spectrum: DesignSpectrum | Motion, **options: Any
) -> dict[str, KinematicAssessment]:
    """Assess the mechanism of every part by itself.

    Args:
        structure: structure with named parts.
        spectrum: as for `kinematic_assessment`.
        options: other arguments of `kinematic_assessment`, but `part` and `blocks`.

    Returns:
        Assessment of each part that has blocks which move, by its name.

    Raises:
        InvalidInput: as for `kinematic_assessment`.
    """
    parts = dict.fromkeys(structure.blocks[number].part for number in structure.free)
    return {part: kinematic_assessment(structure, spectrum, part=part, **options) for part in parts}


@dataclass(frozen=True, eq=False)
class _Oscillator:
    """Equivalent oscillator of a mechanism, and the demand on it."""

    given: _Search
    placed: PlacedBlocks
    path: MechanismPath | None
    holds: int  # last place at which the joints that do not move hold
    fill: bool  # whether some of the loads are the weight of a fill
    by_body: bool = False  # whether each body that moves as one has one weight, beside the loads
    searched: Doubt | None = None  # about a factor that was searched without dilatancy
    ties: str = ""  # forces of the ties, in words
    centred: bool = False  # whether the control point is the centroid of all weights

    @cached_property
    def weights(self) -> tuple[Array, Array]:
        """Weights that move [N], and their virtual displacements along the forces [m/s]."""
        assert self.path is not None
        speed, _, turn = self.path.velocity.T
        weights, speeds, bodies = [], [], []
        # a fill belongs to the body below it; M* sums the weights of bodies and of loads apart
        loads = len(self.placed.masses) - sum(bool(load.weight) for load in self.given.loads)
        for number, (k, place, weight) in enumerate(self.placed.masses):
            if (body := self.path.mechanisms[0].body[k]) >= 0:
                weights.append(weight)
                speeds.append(speed[k] - turn[k] * (place[1] - self.placed.centroids[k, 1]))
                bodies.append(body if number < loads else -number)
        moved = self.placed.direction * np.array(speeds)
        if not self.by_body:
            return np.array(weights), moved
        _, own = np.unique(bodies, return_inverse=True)
        of_bodies = np.bincount(own, weights).astype(float)
        return of_bodies, np.bincount(own, weights * moved) / of_bodies

    @cached_property
    def foot(self) -> float:
        """Height above the ground of the foot of what moves [m]."""
        return find_foot(self.placed.structure, self.path)

    @property
    def spectrum(self) -> DesignSpectrum | Motion:
        """Spectrum at the foot of what moves."""
        return place_spectrum(self.given.spectrum, self.foot)

    @cached_property
    def control(self) -> Numbers:
        """Numbers of the blocks whose centroid is the control point, fastest along x at rest.

        Blocks that are equally fast, as those of a body that slides, count by their weights: the
        end of a body that later turns is as good as the other.
        """
        assert self.path is not None
        free = np.array(self.placed.structure.free)
        along = self.placed.direction * self.path.velocity[free, 0]
        fast = np.abs(along) >= (1.0 - 1e-6) * np.abs(along).max()
        return free[fast & ((along > 0.0) == (along[fast].max() > 0.0))]

    @property
    def moved(self) -> float:
        """Capacity over demand of the displacement check [-]."""
        return self.displacement.moved if self.displacement else np.inf

    def _follow_control(self) -> Array:
        """Return the displacement of the control point along x (n,) [m]."""
        assert self.path is not None
        if not self.centred:
            return self.path.follow_centroid(self.control)
        body, rest = self.path.mechanisms[0].body, self.placed.masses
        places = [self.placed.moved(each).masses for each in self.path.displacements]
        moved = [[x[1][0] - y[1][0] for x, y in zip(each, rest, strict=True)] for each in places]
        weights = [weight * (body[k] >= 0) for k, _, weight in rest]
        return np.average(moved, axis=1, weights=weights)

    @cached_property
    def other(self) -> "_Oscillator | None":
        """The same by the other control point, if its displacements are others."""
        other = replace(self, centred=not self.centred)
        own, moved = (float(x.curve["d"][-1]) for x in (self, other))
        return other if abs(moved - own) > SAME_POINT * own and moved > 0.0 else None

    @cached_property
    def e_star(self) -> float:
        """Participating share of the weight that moves [-]."""
        if self.path is None or not self.path.velocity.any():
            return np.nan
        weight, speed = self.weights
        return float((weight @ speed) ** 2 / (weight.sum() * (weight @ speed**2)))

    @cached_property
    def curve(self) -> xr.Dataset:
        """Capacity curve over the places of the path."""
        factors, control, moved = np.zeros(0), np.zeros(0), np.zeros(0)
        if self.path is not None:
            factors, moved = self.path.factors, np.zeros(len(self.path.factors))
            control = self.placed.direction * self._follow_control()
            if self.path.velocity.any():
                weight, speed = self.weights
                own = self.placed.direction * self.path.velocity[self.control[0], 0]
                own = (weight @ speed) / weight.sum() if self.centred else own
                moved = control / own * (weight @ speed**2) / (weight @ speed)
        acceleration = factors * self.placed.structure.gravity / self.e_star
        values = {"d": moved, "a": acceleration, "alpha": factors, "d_control": control}
        units = {"d": "m", "a": "m/s2", "alpha": "1", "d_control": "m"}
        columns = {key: ("place", values[key], {"units": units[key]}) for key in values}
        return xr.Dataset(columns, attrs={"holds": 0 if self.bounded_at_rest else self.holds})

    def notes(self, factor: float) -> list[str]:
        """Return the assumptions of the curve, and its omissions on the safe side."""
        if self.path is None:
            return []
        found = describe_loads(self.path, self.given.loads, self.ties, self.stretches)
        if self.displacement and self.other:
            names = self.control_name if len(self.control) < 4 else f"{len(self.control)} blocks"
            own, other = (f"{names}, at first the fastest", "all weights")[:: 1 - 2 * self.centred]
            found.append(
                f"d* is of the centroid of {own}, whose capacity is {self.moved:.3g} times the "
                f"demand: no more than the {self.other.moved:.3g} times by that of {other}, "
                f"with a d_0* of {self.other.curve['d'].values[-1]:.4g} m"
            )
        collapse = self.path.mechanisms[0].factor
        if factor < (1.0 - 1e-3) * collapse:
            found.append(
                f"sliding that dilates (associated flow) would raise alpha_0 to {collapse:.4g}, "
                "and faces slide flat here"
            )
        if len(self.path.factors) == 1:
            why = "this mechanism begins, and its contacts permit no finite motion"
            if self.path.end is PathEnd.SLIDES:
                why = (
                    "this mechanism slides without turning and alpha does not fall as it moves; "
                    "the end of the faces or of the ground in the drawing is no capacity"
                )
            least = self.linear.floor or replace(self, by_body=True).linear.ratio
            found.append(
                f"{why}: there is no displacement check; it moves from "
                f"{format_ratio(least / self.given.q)} times the spectrum on (q = 1), and what it "
                "withstands beyond rests on q alone; a time history computes it"
            )
        elif self.path.end is not PathEnd.FALLS:
            found.append(
                f"alpha does not vanish: {self.path.ending}, and the displacement check counts "
                f"d* = {self.curve['d'].values[-1]:.4g} m there as d_0*, on the safe side"
            )
        return found

    @cached_property
    def stretches(self) -> list[tuple[Tie, float]]:
        """Each tie and its largest stretch up to the capacity of the displacement check [m]."""
        return find_stretches(self.path, self.curve["d"].values, self.given.rules.share)

    @property
    def opens(self) -> bool:
        """Whether joints that the mechanism keeps closed open or slide on its way."""
        return self.path is not None and self.holds < len(self.path.factors) - 1

    @property
    def bounded_at_rest(self) -> bool:
        """Whether alpha_0 too is an upper bound."""
        return bool(self.searched or (self.opens and self.holds == 0))

    @property
    def bounded(self) -> bool:
        """Whether each ratio is an upper bound, also as the spectrum is larger at the foot."""
        height = find_height_left_out(self.given.spectrum, self.placed.structure, self.foot)
        return self.bounded_at_rest or height > 0.0

    @property
    def doubts(self) -> list[Doubt]:
        """Why a ratio may be too high: another code's spectrum, a fill left out, other joints."""
        found = self.given.rules.doubt(self.given.spectrum, self.placed.structure, self.foot)
        if self.searched:
            found.append(self.searched)
        if self.fill and self.placed.fill is None and self.path is not None:
            words = "the fill counts as weight and mass on the stones, without its pressure on them"
            found.append(Doubt(words, "give fill for it"))
        if self.opens:
            held = abs(float(self.curve["d"][self.holds]))
            late = f"beyond d* = {held:.3g} m", "there the curve"
            place, what = late if self.holds else ("from rest", "the whole curve, and each ratio,")
            words = f"{place} joints open or slide that the mechanism keeps closed: {what} is {{}}"
            found.append(Doubt(words, self.remedy, (UPPER_BOUND,)))
        return found + doubt_stretches(self.stretches) + doubt_loads(self.placed, self.given.loads)

    @cached_property
    def linear(self) -> AssessmentCheck:
        """Linear check with a behaviour factor q."""
        confidence, q = self.given.confidence_factor, self.given.q
        free = self.given.free_period or 0.0
        ground = first_acceleration(self.spectrum, free)
        capacity = q / confidence * (np.inf if self.path is None else float(self.curve["a"][0]))
        ratio = capacity / ground
        return AssessmentCheck(
            *(f"linear, q = {q:g}, FC = {confidence:g}", capacity, ground, "m/s²", ratio, np.nan),
            f"Circolare 7/2019, C8.7.1.2.1.5 and C8.7.1.2.1.7, eq. C8.7.1.{9 if free else 8}",
            bounded=self.bounded,
            floor=self.e_star * ratio if self.searched else None,
            amplified=describe_floor(self.spectrum) + f" at T_0 = {free:g} s" * bool(free),
        )

    def assess(self) -> KinematicAssessment:
        """Return the assessment by the weights of blocks, or by one for each body."""
        path, structure = self.path, self.placed.structure
        # d_0* is of what acts up to the collapse: Circolare 7/2019, C8.7.1.2.1.6
        if path and path.breaks and path.end is not PathEnd.BREAKS:
            path = path.end_broken()
            return replace(self, path=path, holds=min(self.holds, len(path.factors) - 1)).assess()
        given, curve = self.given, self.curve
        alpha_0, a_0, d_0, secant = np.inf, np.inf, np.inf, np.nan
        mass, control, displacement = 0.0, "", None
        if path is not None:
            alpha_0, a_0 = float(curve["alpha"][0]), float(curve["a"][0])
            mass = self.e_star * (self.weights[0].sum() / structure.gravity)
            control = "all weights" if self.centred else self.control_name
            displacement = self.displacement
            other = self.other if displacement and not self.centred else None
            if other and other.moved < self.moved:
                return other.assess()
            if path.end is PathEnd.FALLS:
                d_0 = float(curve["d"][-1])
                secant = secant_period(curve["d"].values, curve["a"].values, 0.16 * d_0)
        found = KinematicAssessment(
            structure,
            self.spectrum,
            self.placed.direction,
            *(alpha_0, mass, self.e_star, a_0, d_0, secant, curve),
            self.linear,
            displacement,
            *(given.rules, given.confidence_factor, given.strength, control, path),
            tuple(self.notes(alpha_0)),
            tuple(self.doubts),
        )
        return found if self.by_body else self._split_weights(found)

    def _split_weights(self, found: KinematicAssessment) -> KinematicAssessment:
        """Return it with the ratios of one weight a body, and doubts where these fail."""
        found = replace(found, of_bodies=(whole := replace(self, by_body=True).assess()))
        if whole.e_star > 1.001 * found.e_star:
            found = replace(found, linear=replace(found.linear, bodies=whole.linear.ratio))
            if found.displacement is not None and whole.displacement is not None:
                moved = replace(found.displacement, bodies=whole.displacement.ratio)
                found = replace(found, displacement=moved)
        doubts = [y for x in found.checks for y in (*x.doubt_split(), *x.doubt_end(self.remedy))]
        given = self.given.spectrum, self.foot, self.given.free_period
        more, turn = judge_floor(*given, whole.checks, self.given.bed is not None)
        ratios = [f"{x.bodies:.3g} by {x.name}" for x in found.checks if x.bodies is not None]
        split = (
            "weights are at the centroids of blocks: one for each body that moves as one gives "
            f"e* = {whole.e_star:.3f}, and the spectrum may be as strong as {join_names(ratios)}"
        )
        notes = (*found.notes, *more, *[split] * bool(ratios))
        return replace(found, doubts=(*found.doubts, *doubts, *turn), notes=notes)

    @property
    def remedy(self) -> str:
        """What tests a ratio of displacements; no run, where there are ties."""
        tied = "not decided, as runs leave out ties: count on what it withstands without them"
        return tied if self.placed.ties else "a time history with large displacements can test it"

    @cached_property
    def control_name(self) -> str:
        """Names of the fastest blocks."""
        blocks = self.placed.structure.blocks
        return join_names([blocks[number].name for number in self.control])

    @cached_property
    def displacement(self) -> AssessmentCheck | None:
        """Check of the displacement against the spectrum, of a mechanism that moves."""
        if self.path is None or len(self.path.factors) == 1:
            return None
        given, curve = self.given, (self.curve["d"].values, self.curve["a"].values)
        check = given.rules.check(self.spectrum, given.confidence_factor, *curve, given.free_period)
        higher = not check.at_rest and bool(self.opens or doubt_stretches(self.stretches))
        at_least = self.path.end is not PathEnd.FALLS
        return replace(check, bounded=self.bounded or higher, at_least=at_least)
