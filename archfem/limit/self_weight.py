"""Linear programme of self-weight, and the options of analyses that are built on it."""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from archfem._typing import Array
from archfem._validation import check_between, check_choice, check_type
from archfem.errors import InvalidInput
from archfem.limit.backfill import SELF_WEIGHT, BlocksWithFill, attach_fill
from archfem.limit.fill_strength import Fill
from archfem.limit.linear_programme import Optimum, Programme, RigidBlocks
from archfem.masonry.loads import Action
from archfem.masonry.materials import STONE, check_strength
from archfem.masonry.structure import Structure
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
