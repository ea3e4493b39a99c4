"""Linear programme of self-weight, and the options of analyses that are built on it."""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from archfem._typing import Array
from archfem._validation import check_between, check_choice, check_type
from archfem.errors import InvalidInput, logger
from archfem.limit.backfill import SELF_WEIGHT, BlocksWithFill, attach_fill
from archfem.limit.fill_range import FillRange, vary_fill
from archfem.limit.fill_strength import Fill
from archfem.limit.linear_programme import Optimum, Programme, RigidBlocks
from archfem.masonry.loads import Action
from archfem.masonry.materials import STONE, check_strength
from archfem.masonry.structure import HasStructure, Structure, structure_of
from archfem.units import MPa


def refuse_bonds(structure: Structure) -> None:
    """Refuse joints with tensile strength, which break and do not yield."""
    if structure.tension.any():
        raise InvalidInput(
            f"joints have a tensile strength of {structure.tension.max():.3g} Pa: this analysis is "
            "for joints that yield, and bonds break; for the safe answer without them give "
            "Contact(tension=0.0, cohesion=0.0); collapse_factor lets bonds yield, a pushover "
            "breaks them"
        )


def check_options(structure: Structure, friction: str | None, strength: float | None) -> float:
    """Refuse unknown options, and return the strength at which joints crush, infinite for none."""
    check_choice(friction, "friction", ("coulomb", "nonassociated", None))
    if strength is None:
        stones = (structure.blocks[k] for k in np.unique(structure.pairs[structure.judged]))
        own = {block.material.strength for block in stones} - {None, STONE.strength}
        return min(filter(None, own), default=np.inf)
    if strength != np.inf:
        check_between(strength, "strength [Pa]", 0.0, remedy="leave it out for no limit")
        check_strength(strength, "strength", np.inf)
    return strength


def say_strength(structure: Structure, strength: float | None, hard: str = "") -> str:
    """Say at which strength joints crush [Pa], and what a result is where they do not."""
    crushing = check_options(structure, "coulomb", strength) / MPa
    beside = f" ({hard} without crushing)" * bool(hard)
    return "without crushing" if np.isinf(crushing) else f"crushing at {crushing:.3g} MPa{beside}"


def joint_strengths(structure: Structure, strength: float) -> Array:
    """Return the strength of each joint, infinite beside fill in pieces (n_joints,) [Pa]."""
    is_piece = np.array([block.grain for block in structure.blocks])[structure.pairs].any(axis=1)
    return np.where(is_piece, np.inf, strength)


def self_weight_programme(
    structure: Structure,
    friction: str | None,
    strength: float | None,
    fill: Fill | None,
    dead: Sequence[Action] = (),
) -> tuple[BlocksWithFill, Programme]:
    """Return the rigid stones, and the linear programme of self-weight and other dead loads."""
    check_type(structure, Structure, "structure", "give one, e.g. circular_arch(…)")
    strength = check_options(structure, friction, strength)
    stones = attach_fill(structure, fill)
    rigid = stones.rigid_regions.structure
    blocks = RigidBlocks(rigid)
    coefficient = rigid.friction if friction is not None else np.full(len(rigid.joints), np.inf)
    crushing = None
    if np.isfinite(strength):
        crushing = blocks.crushing_forces(joint_strengths(rigid, strength))
    weight = blocks.dimensionless(stones.load([SELF_WEIGHT, *dead]) + stones.active_forces())
    # Compressions are counted from the plastic tension of bonds on: F + T/2 >= 0 at each end.
    slope = np.where(np.isfinite(coefficient), coefficient, 0.0)
    strengths = coefficient, blocks.cohesion - slope * blocks.tension
    programme = Programme(
        blocks, weight + blocks.balance @ blocks.bond, *strengths, crushing=crushing
    )
    if fill is None:
        return stones, programme
    # further unknowns, 0 to 1: the position of each contact's pressure in its range
    pressures = sparse.diags(-blocks.coordinate_units / blocks.force_unit) @ stones.passive_forces()
    return stones, programme.with_unknowns(pressures, np.zeros(pressures.shape[1]), 1.0)


def is_balanced(fall: Optimum, dead: Programme, tolerance: float = 1e-8) -> bool:
    """Return whether the forces missing for equilibrium are below a share of the weights."""
    return fall.value <= tolerance * len(dead.blocks.structure.free)


def stands(
    structure: Structure | HasStructure,
    *,
    friction: str | None = "coulomb",
    strength: float | None = None,
    fill: Fill | None = None,
) -> bool:
    """Check whether rigid blocks can be in equilibrium under their own weight (the safe theorem).

    A warning says where other assumptions on the fill decide that: pressure and backing.

    The programme finds the least forces that would have to be added to the blocks' weights:

        min Σ |r|   subject to   -G_oᵀ F + G_sᵀ V + r = f_dead,   F >= 0,   |V| <= c A + μ N.

    The structure stands where they vanish.

    Args:
        structure: supports are its fixed blocks; or an `archfem.Analysis` of it.
        friction: "coulomb" or "nonassociated", here the same, holds |V| <= c A + μ N; None
            forbids sliding.
        strength: as for `collapse_factor` [Pa].
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
    structure, options = structure_of(structure), (friction, strength)
    found = stands_as_given(structure, *options, fill)
    varied = vary_fill(fill, pushed=False) if isinstance(fill, Fill) else {}
    each = {k: stands_as_given(structure, *options, x) for k, (_, x) in varied.items() if x != fill}
    if only := FillRange({k: float(each.get(k, found)) for k in varied}).needed:
        logger.warning("what is assumed of the fill decides whether it stands: only with %s", only)
    return found


def stands_as_given(
    structure: Structure, friction: str | None, strength: float | None, fill: Fill | None
) -> bool:
    """Return the answer of `stands`, without its range over a fill."""
    refuse_bonds(structure)
    _, dead = self_weight_programme(structure, friction, strength, fill)
    return is_balanced(dead.minimise_residual(), dead)
