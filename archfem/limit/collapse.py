"""Limit analysis of rigid blocks: the load that turns a structure into a mechanism."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import xarray as xr

from archfem.arrays import Array
from archfem.joints.resultants import joint_dataset
from archfem.limit.fill import Fill
from archfem.limit.filled import Stones
from archfem.limit.programme import Optimum, Programme
from archfem.limit.sliding import WithoutDilatancy, without_dilatancy
from archfem.limit.told import tell_of_cohesion, tell_of_dilatancy, tell_of_sliding
from archfem.limit.weight import balanced, self_weight
from archfem.masonry.actions import BodyForce, PointLoad, Settlement, loads
from archfem.masonry.structure import Structure
from archfem.shown import Shown

logger = logging.getLogger("archfem")

MOVING = 1e-6
"""Least movement in a joint, relative to that of the fastest corner, that counts as movement."""


class Outcome(StrEnum):
    """How a limit analysis ends."""

    COLLAPSES = "collapses"
    UNBOUNDED = "unbounded"
    INFEASIBLE = "infeasible"
    SETTLES = "settles"
    LOCKS = "locks"
    BRACKETED = "bracketed"

    @property
    def sentence(self) -> str:
        """What it means."""
        return _SENTENCES[self]


_SENTENCES = {
    Outcome.COLLAPSES: "the load turns it into a mechanism",
    Outcome.UNBOUNDED: "this load never overturns it",
    Outcome.INFEASIBLE: "it does not stand under its own weight",
    Outcome.SETTLES: "it follows its support and stands",
    Outcome.LOCKS: "it cannot follow this movement of its support",
    Outcome.BRACKETED: "no state without dilatancy was found, and none lies beyond this bound",
}


@dataclass(frozen=True, eq=False, repr=False)
class Collapse(Shown, picture="collapse.draw_found"):
    """What limit analysis found.

    Attributes:
        factor: multiple of the live load at collapse [-]; infinite where it never collapses,
            undefined (NaN) where it does not stand. For a settlement, work that the weights do on
            it [N m]: for a translation by 1 m, the thrust on the support along it, in N.
        outcome: how the analysis ended; `outcome.sentence` says what that means.
        hinges: joints that turn, with the face where the blocks stay in contact.
        sliding: numbers of the joints that slide.
        joints: N, V, M and what follows, as made by `joint_dataset`, at the factor found; of one
            state under self-weight where the factor is infinite, NaN where there is none.
        motion: velocities of all blocks' centroids and rotations (n_blocks, 3), scaled so that
            the fastest corner has 1 m/s, or those that follow a settlement. Zero where nothing
            moves. Where it does not stand: how it falls under its own weight.
        solutions: with sliding without dilatancy, what is known of all its solutions.
        soil: where there is a fill, its pressure on each piece of a stone's face, between the least
            and the most that it can be [Pa], with the number of the block, the piece's ends and the
            sense of the pressure along x; else None.
        live: the actions that grew, or the settlement that was followed.
        structure: that was asked about; None where it is not known.
    """

    factor: float
    outcome: Outcome
    hinges: tuple[tuple[int, str], ...]
    sliding: tuple[int, ...]
    joints: xr.Dataset
    motion: Array
    solutions: WithoutDilatancy | None = None
    soil: xr.Dataset | None = None
    live: tuple[BodyForce | PointLoad | Settlement, ...] = ()
    structure: Structure | None = None

    @property
    def hinge_names(self) -> tuple[str, ...]:
        """Names of the joints that turn, in the order of `hinges`."""
        return tuple(str(self.joints["name"].values[joint]) for joint, _ in self.hinges)

    @property
    def sliding_names(self) -> tuple[str, ...]:
        """Names of the joints that slide, in the order of `sliding`."""
        return tuple(str(self.joints["name"].values[joint]) for joint in self.sliding)

    def _words(self) -> str:
        """What it is, in a line or two."""
        return f"Collapse: {self}"

    def __str__(self) -> str:
        """Outcome, factor and failing joints, by number and name, in one line."""
        turning = zip(self.hinges, self.hinge_names, strict=True)
        hinges = ", ".join(f"{j} ({name}) {side}" for (j, side), name in turning) or "none"
        slipping = zip(self.sliding, self.sliding_names, strict=True)
        sliding = ", ".join(f"{j} ({name})" for j, name in slipping) or "none"
        words = f"{self.outcome.sentence}: factor {self.factor:.4g}; hinges {hinges}; "
        known = "" if self.solutions is None else f"; {self.solutions}"
        return f"{words}sliding {sliding}{known}"


def collapse_factor(
    structure: Structure,
    *,
    live: BodyForce | PointLoad | Settlement | Sequence[BodyForce | PointLoad],
    friction: str | None = "coulomb",
    strength: float | None = None,
    fill: Fill | None = None,
) -> Collapse:
    """Find the factor at which live actions, over self-weight, make rigid blocks a mechanism.

    Static theorem: the largest factor for which equilibrium and the joint criteria can both hold,

        max λ   subject to   -G_oᵀ F + G_sᵀ V = f_dead + λ f_live,   F >= 0,   |V| <= c A + μ N,

    with F the compressions at both ends of each joint, F >= 0 the same as |M| <= N h/2. Its dual
    is the mechanism of least work: velocities v with f_live·v = 1 and joints that nowhere close,

        min c A·|G_s v| - f_dead·v   subject to   G_o v >= μ |G_s v|.

    Cohesion c (`Contact.cohesion`) acts on the area A of the whole joint, depth times width, and
    not only on its closed part: the factor is an upper estimate where a joint with cohesion opens,
    a warning says so, and `closed_cohesion` leaves it to what a given state has closed.
    Joints with tensile strength are refused, since bonds break and do not yield. The dilatancy of
    contacts plays no part: sliding dilates by μ ("coulomb") or not at all ("nonassociated"), and
    a warning says so where the latter leaves it out.

    A *settlement* s asks another question: of all states of equilibrium under self-weight, the
    movement of a support selects the one that resists it least, and the factor is the work of the
    weights on it,

        min F·o_s - V·s_s   subject to   -G_oᵀ F + G_sᵀ V = f_dead,   F >= 0,   |V| <= c A + μ N,

    with o_s, s_s the openings and slips that the settlement alone would cause. Spreading supports
    give the least thrust of an arch and closing supports the greatest.

    Args:
        structure: supports are its fixed blocks.
        live: one action, or several that grow together; a `Settlement` comes alone.
        friction: "coulomb" holds |V| <= c A + μ N with sliding that dilates (associated), so that
            with sliding joints the factor is an upper estimate and a warning is logged;
            "nonassociated" searches states whose joints slide without dilating for the weakest;
            None forbids sliding.
        strength: compressive strength σ of the blocks [Pa], which limits |M| to
            N h/2 - N²/(2 σ w), by a rectangular stress block; None for no limit.
        fill: strength of blocks softer than their joints, which become weight and pressures on the
            stones (`Fill`), with those that rest on them; None where there are none, or where they
            are cut into pieces (`jointed_fill`), whose joints have that strength.

    Returns:
        The factor, how it was found, and the mechanism.

    Raises:
        InvalidInput: an option is unknown, an action misses the structure, joints have tensile
            strength, or bodies too soft to be rigid are without the strength of a fill.
        DidNotConverge: the solver of linear programmes gave up.

    Note:
        The motion is one of the possible ones where several have the same factor. Without
        associated flow factors are not unique: `solutions` of the result tells between which they
        were found and between which all lie, and the factor is the least found, or for a settlement
        the greatest work. Where none is found it is the proven bound, and the outcome says so.

    References:
        Heyman, Int. J. Solids Struct. 2 (1966) 249-279. Livesley, Int. J. Numer. Meth. Eng. 12
        (1978) 1853-1871. Ferris and Tin-Loi, Int. J. Mech. Sci. 43 (2001) 209-224.
    """
    asked = (live,) if isinstance(live, Settlement) else tuple(loads(live))
    weighed = self_weight(structure, friction, strength, fill)
    return replace(_found(structure, weighed, live, friction), live=asked, structure=structure)


def _found(
    structure: Structure,
    weighed: tuple[Stones, Programme],
    live: BodyForce | PointLoad | Settlement | Sequence[BodyForce | PointLoad],
    friction: str | None,
) -> Collapse:
    """Return what `collapse_factor` found, as yet without its live actions."""
    stones, dead = weighed
    fall = dead.unbalanced()
    if not balanced(fall, dead):
        nothing = _unknown(fall)
        return _result(stones, dead, Outcome.INFEASIBLE, np.nan, nothing)
    support = None
    if isinstance(live, Settlement):
        support = np.zeros((len(stones.skeleton.blocks), 3))
        support[stones.skeleton.blocks.index(live.place(structure))] = live.motion
        asked, scale = _settled(dead, support), dead.blocks.force
        ends = Outcome.SETTLES, Outcome.LOCKS
    else:
        asked, scale = dead.growing(stones.load(loads(live))), -1.0
        ends = Outcome.COLLAPSES, Outcome.UNBOUNDED
    found = associated = asked.solve()
    known = None
    if friction == "nonassociated":
        tell_of_dilatancy(structure)
        found, known = without_dilatancy(asked, associated, scale)
    if found is None:
        rest = replace(fall, coordinates=np.zeros_like(fall.coordinates))
        if known is None or associated is None:
            return replace(_result(stones, dead, ends[1], np.inf, rest), solutions=known)
        return _bracketed(stones, dead, rest, known, support is None)
    result = _result(stones, asked, ends[0], scale * found.value, found, support=support)
    result = replace(result, solutions=known)
    if not isinstance(live, Settlement):
        stones.warn_of_sliding_fill(loads(live), result.factor)
        failing = {*result.sliding, *(joint for joint, _ in result.hinges)}
        if friction is not None:
            tell_of_cohesion(structure, tuple(failing), result.joints, result.factor)
    if friction == "coulomb":
        tell_of_sliding(result.sliding, result.sliding_names, result.factor)
    return result


def stands(
    structure: Structure,
    *,
    friction: str | None = "coulomb",
    strength: float | None = None,
    fill: Fill | None = None,
) -> bool:
    """Tell whether rigid blocks can be in equilibrium under their own weight (the safe theorem).

    The programme finds the least forces that would have to be added to the blocks' weights,

        min Σ |r|   subject to   -G_oᵀ F + G_sᵀ V + r = f_dead,   F >= 0,   |V| <= c A + μ N,

    and the structure stands where that is nothing.

    Args:
        structure: supports are its fixed blocks.
        friction: "coulomb" or "nonassociated", here the same, holds |V| <= c A + μ N; None
            forbids sliding.
        strength: compressive strength of the blocks [Pa], as for `collapse_factor`; None for no
            limit.
        fill: strength of the fill, as for `collapse_factor`; None where there is none.

    Returns:
        Whether it stands.

    Raises:
        InvalidInput: an option is unknown, joints have tensile strength, or bodies too soft to be
            rigid are without the strength of a fill.

    References:
        Heyman, Int. J. Solids Struct. 2 (1966) 249-279.

    Example:
        >>> af.stands(af.circular_arch(radius=1.0, thickness=0.05, embrace=180.0, voussoirs=11))
        False
    """
    _, dead = self_weight(structure, friction, strength, fill)
    return balanced(dead.unbalanced(), dead)


def _settled(dead: Programme, support: Array) -> Programme:
    """Ask for the least work on a motion of the supports."""
    gaps = dead.blocks.gaps(support)
    return replace(dead, cost=np.concatenate([gaps[0], gaps[1], -gaps[2]]))


def _unknown(found: Optimum) -> Optimum:
    """The same, of which forces are not known."""
    sizes = found.forces.shape, found.unknowns.shape
    forces, unknowns = (np.full(size, np.nan) for size in sizes)
    return replace(found, forces=forces, unknowns=unknowns)


def _bracketed(
    stones: Stones, dead: Programme, rest: Optimum, known: WithoutDilatancy, least: bool
) -> Collapse:
    """Return the safe end of the bracket, where no solution without dilatancy was found."""
    logger.warning("no state without dilatancy was found; the factor is only a bound: %s", known)
    bound = known.bracket[0 if least else 1]
    state = _unknown(rest)
    return replace(_result(stones, dead, Outcome.BRACKETED, bound, state), solutions=known)


def _result(
    stones: Stones,
    asked: Programme,
    outcome: Outcome,
    factor: float,
    found: Optimum,
    support: Array | None = None,
) -> Collapse:
    """Return the optimum read as joint resultants and as a motion of the whole's blocks.

    A motion that follows a moving support keeps its size, any other is scaled.
    """
    structure, skeleton = asked.blocks.structure, stones.skeleton
    motion = asked.blocks.motion(found.coordinates)
    if support is not None:
        motion = motion + support
    elif motion.any():
        motion = motion / asked.blocks.reach(motion)
    least = MOVING * asked.blocks.reach(motion)
    intrados, extrados, slip = asked.blocks.gaps(motion)
    slid = np.where(abs(slip) > 0.0, structure.friction, 0.0) * abs(slip)
    apart = np.minimum(intrados, extrados) - slid > least
    turning = (abs(extrados - intrados) > least) & ~apart
    hinges = tuple(
        (skeleton.joints[j], "intrados" if intrados[j] < extrados[j] else "extrados")
        for j in np.flatnonzero(turning)
    )
    slides = tuple(skeleton.joints[j] for j in np.flatnonzero((abs(slip) > least) & ~apart))
    resultants = np.full((len(stones.whole.joints), 3), np.nan)
    resultants[list(skeleton.joints)] = asked.blocks.resultants(found.forces)
    joints = joint_dataset(stones.whole, resultants)
    moved, soil = skeleton.in_whole(motion), stones.soil(found.unknowns)
    return Collapse(float(factor), outcome, hinges, slides, joints, moved, soil=soil)
