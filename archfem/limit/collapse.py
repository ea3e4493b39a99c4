"""Limit analysis of rigid blocks: the load that turns a structure into a mechanism."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import xarray as xr
from scipy import sparse

from archfem.arguments import instance, real
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.joints.resultants import joint_dataset
from archfem.limit.blocks import RigidBlocks, rigid_load
from archfem.limit.programme import Optimum, Programme, friction_limits, no_limits
from archfem.limit.sliding import WithoutDilatancy, without_dilatancy
from archfem.masonry.actions import BodyForce, PointLoad, Settlement, loads
from archfem.masonry.softness import yielding_blocks
from archfem.masonry.structure import Structure

logger = logging.getLogger("archfem")

SELF_WEIGHT = BodyForce(0.0, -1.0)

FRICTION = ("coulomb", "nonassociated", None)

UNBALANCED = 1e-8
"""Force missing for equilibrium, per weight of the free blocks, above which they do not stand."""

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


@dataclass(frozen=True, eq=False)
class Collapse:
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
    """

    factor: float
    outcome: Outcome
    hinges: tuple[tuple[int, str], ...]
    sliding: tuple[int, ...]
    joints: xr.Dataset
    motion: Array
    solutions: WithoutDilatancy | None = None

    @property
    def hinge_names(self) -> tuple[str, ...]:
        """Names of the joints that turn, in the order of `hinges`."""
        return tuple(str(self.joints["name"].values[joint]) for joint, _ in self.hinges)

    @property
    def sliding_names(self) -> tuple[str, ...]:
        """Names of the joints that slide, in the order of `sliding`."""
        return tuple(str(self.joints["name"].values[joint]) for joint in self.sliding)

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
) -> Collapse:
    """Find the factor at which live actions, over self-weight, make rigid blocks a mechanism.

    Static theorem: the largest factor for which equilibrium and the joint criteria can both hold,

        max λ   subject to   -G_oᵀ F + G_sᵀ V = f_dead + λ f_live,   F >= 0,   |V| <= μ N,

    with F the compressions at both ends of each joint, F >= 0 the same as |M| <= N h/2. Its dual
    is the mechanism of least work: velocities v with f_live·v = 1 and joints that nowhere close,

        min -f_dead·v   subject to   G_o v >= μ |G_s v|.

    A *settlement* s asks another question: of all states of equilibrium under self-weight, the
    movement of a support selects the one that resists it least, and the factor is the work of the
    weights on it,

        min F·o_s - V·s_s   subject to   -G_oᵀ F + G_sᵀ V = f_dead,   F >= 0,   |V| <= μ N,

    with o_s, s_s the openings and slips that the settlement alone would cause. Spreading supports
    give the least thrust of an arch and closing supports the greatest.

    Args:
        structure: supports are its fixed blocks.
        live: one action, or several that grow together; a `Settlement` comes alone.
        friction: "coulomb" holds |V| <= μ N with sliding that dilates (associated), so that with
            sliding joints the factor is an upper estimate and a warning is logged; "nonassociated"
            searches states whose joints slide without dilating for the weakest; None forbids
            sliding.
        strength: compressive strength σ of the blocks [Pa], which limits |M| to
            N h/2 - N²/(2 σ w), by a rectangular stress block; None for no limit.

    Returns:
        The factor, how it was found, and the mechanism.

    Raises:
        InvalidInput: an option is unknown, an action misses the structure, or bodies such as a
            fill cannot be taken as rigid.
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
    dead = _self_weight(structure, friction, strength)
    fall = _unbalanced(dead)
    if not _balanced(fall, dead):
        return _result(dead, Outcome.INFEASIBLE, np.nan, replace(fall, forces=np.nan * fall.forces))
    support = None
    if isinstance(live, Settlement):
        support = np.zeros((len(structure.blocks), 3))
        support[live.place(structure)] = live.motion
        asked, scale = _settled(dead, support), dead.blocks.force
        ends = Outcome.SETTLES, Outcome.LOCKS
    else:
        asked, scale = _loaded(dead, loads(live)), -1.0
        ends = Outcome.COLLAPSES, Outcome.UNBOUNDED
    found = associated = asked.solve()
    known = None
    if friction == "nonassociated":
        found, known = without_dilatancy(asked, associated, scale)
    if found is None:
        rest = replace(fall, coordinates=np.zeros_like(fall.coordinates))
        if known is None or associated is None:
            return replace(_result(dead, ends[1], np.inf, rest), solutions=known)
        return _bracketed(dead, rest, known, support is None)
    result = _result(asked, ends[0], scale * found.value, found, support=support)
    result = replace(result, solutions=known)
    if friction == "coulomb" and result.sliding:
        logger.warning(
            "joints %s (%s) slide: with the dilatancy of associated flow the factor %.4g is an "
            "upper estimate; friction='nonassociated' does without it",
            list(result.sliding),
            ", ".join(result.sliding_names),
            result.factor,
        )
    return result


def stands(
    structure: Structure, *, friction: str | None = "coulomb", strength: float | None = None
) -> bool:
    """Tell whether rigid blocks can be in equilibrium under their own weight (the safe theorem).

    The programme finds the least forces that would have to be added to the blocks' weights,

        min Σ |r|   subject to   -G_oᵀ F + G_sᵀ V + r = f_dead,   F >= 0,   |V| <= μ N,

    and the structure stands where that is nothing.

    Args:
        structure: supports are its fixed blocks.
        friction: "coulomb" or "nonassociated", here the same, holds |V| <= μ N; None forbids
            sliding.
        strength: compressive strength of the blocks [Pa], as for `collapse_factor`; None for no
            limit.

    Returns:
        Whether it stands.

    Raises:
        InvalidInput: an option is unknown, or bodies such as a fill cannot be taken as rigid.

    References:
        Heyman, Int. J. Solids Struct. 2 (1966) 249-279.
    """
    dead = _self_weight(structure, friction, strength)
    return _balanced(_unbalanced(dead), dead)


def _checked(friction: str | None, strength: float | None) -> None:
    """Refuse options that mean nothing."""
    if friction not in FRICTION:
        raise InvalidInput(f"friction {friction!r} is not known: use one of {FRICTION}")
    if strength is not None and not real(strength, "strength [Pa]") > 0.0:
        raise InvalidInput(f"strength {strength:.3g} Pa is not positive: leave it out for no limit")


def _check_stiff(structure: Structure) -> None:
    """Refuse bodies that cannot be taken as rigid: they would hold what lies under them."""
    names = [structure.blocks[number].name for number in yielding_blocks(structure)]
    if names:
        raise InvalidInput(
            f"blocks {names} are softer than the joints around them: rigid, they would hold every "
            "ring below; build the structure without them, with their weight as point loads, or "
            "push a finite-element model over, in which they deform"
        )


def _self_weight(structure: Structure, friction: str | None, strength: float | None) -> Programme:
    """Programme whose load is the self-weight, with nothing asked of it."""
    instance(structure, Structure, "structure", "give one, e.g. circular_arch(…)")
    _checked(friction, strength)
    _check_stiff(structure)
    blocks = RigidBlocks(structure)
    count = len(structure.joints)
    limits = no_limits(count)
    if friction is not None:
        limits = friction_limits(structure.friction, np.zeros(count))
    crushing = None
    if strength is not None:
        crushing = strength * structure.width * structure.depths / blocks.force
    return Programme(blocks, blocks.scaled(rigid_load(structure, [SELF_WEIGHT])), limits, crushing)


def _unbalanced(dead: Programme) -> Optimum:
    """Least forces to be added for equilibrium; their multipliers are the fall of the blocks."""
    size = len(dead.load)
    either = sparse.identity(size)
    columns = sparse.hstack([either, -either], format="csr")
    found = replace(dead, columns=columns, prices=np.ones(2 * size)).solve()
    assert found is not None  # no sum of magnitudes is below zero
    return found


def _loaded(dead: Programme, live: Sequence[BodyForce | PointLoad]) -> Programme:
    """Ask for the largest factor of live actions."""
    load = dead.blocks.scaled(rigid_load(dead.blocks.structure, live))
    return replace(dead, columns=sparse.csr_matrix(-load[:, None]), prices=np.array([-1.0]))


def _settled(dead: Programme, support: Array) -> Programme:
    """Ask for the least work on a motion of the supports."""
    gaps = dead.blocks.gaps(support)
    return replace(dead, cost=np.concatenate([gaps[0], gaps[1], -gaps[2]]))


def _bracketed(dead: Programme, rest: Optimum, known: WithoutDilatancy, least: bool) -> Collapse:
    """Return the safe end of the bracket, where no solution without dilatancy was found."""
    logger.warning("no state without dilatancy was found; the factor is only a bound: %s", known)
    bound = known.bracket[0 if least else 1]
    state = replace(rest, forces=np.nan * rest.forces)
    return replace(_result(dead, Outcome.BRACKETED, bound, state), solutions=known)


def _balanced(fall: Optimum, dead: Programme) -> bool:
    """Whether the forces missing for equilibrium are nothing."""
    return fall.value <= UNBALANCED * len(dead.blocks.structure.free)


def _result(
    asked: Programme, outcome: Outcome, factor: float, found: Optimum, support: Array | None = None
) -> Collapse:
    """Return the optimum read as joint resultants and as a motion of blocks.

    A motion that follows a moving support keeps its size, any other is scaled.
    """
    structure = asked.blocks.structure
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
        (int(j), "intrados" if intrados[j] < extrados[j] else "extrados")
        for j in np.flatnonzero(turning)
    )
    slides = tuple(int(j) for j in np.flatnonzero((abs(slip) > least) & ~apart))
    joints = joint_dataset(structure, asked.blocks.resultants(found.forces))
    return Collapse(float(factor), outcome, hinges, slides, joints, motion)
