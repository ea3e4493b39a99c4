"""Rigid blocks under their own weight: the programme that every other question adds to."""

import numpy as np
from scipy import sparse

from archfem.arguments import among, instance, real, said
from archfem.errors import InvalidInput
from archfem.limit.blocks import RigidBlocks
from archfem.limit.fill import Fill
from archfem.limit.filled import Stones, stones_of
from archfem.limit.programme import Optimum, Programme, friction_limits, no_limits
from archfem.masonry.actions import BodyForce
from archfem.masonry.structure import Structure

SELF_WEIGHT = BodyForce(0.0, -1.0)

FRICTION = ("coulomb", "nonassociated", None)

UNBALANCED = 1e-8
"""Force missing for equilibrium, per weight of the free blocks, above which they do not stand."""


def _checked(structure: Structure, friction: str | None, strength: float | None) -> None:
    """Refuse options that mean nothing, and bonds, which do not yield but break."""
    if not among(friction, FRICTION):
        raise InvalidInput(f"friction {said(friction)} is not known: use one of {FRICTION}")
    if strength is not None and not real(strength, "strength [Pa]") > 0.0:
        raise InvalidInput(f"strength {strength:.3g} Pa is not positive: leave it out for no limit")
    if structure.tension.any():
        raise InvalidInput(
            f"joints have a tensile strength of {structure.tension.max():.3g} Pa: limit analysis "
            "is for joints that yield, and bonds break; for the safe answer without them give "
            "Contact(tension=0.0, cohesion=0.0), with them follow a pushover"
        )


def self_weight(
    structure: Structure, friction: str | None, strength: float | None, fill: Fill | None
) -> tuple[Stones, Programme]:
    """Return what stands, and the programme of its self-weight with nothing asked of it.

    Args:
        structure: supports are its fixed blocks.
        friction: as for `collapse_factor`.
        strength: as for `collapse_factor` [Pa].
        fill: as for `collapse_factor`.

    Raises:
        InvalidInput: as for `collapse_factor`.
    """
    instance(structure, Structure, "structure", "give one, e.g. circular_arch(…)")
    _checked(structure, friction, strength)
    stones = stones_of(structure, fill)
    left = stones.skeleton.structure
    blocks = RigidBlocks(left)
    limits = no_limits(len(left.joints))
    if friction is not None:
        limits = friction_limits(left.friction, blocks.cohesion)
    crushing = None
    if strength is not None:
        crushing = strength * left.width * left.depths / blocks.force
    weight = blocks.scaled(stones.load([SELF_WEIGHT]) + stones.active())
    dead = Programme(blocks, weight, limits, crushing)
    if fill is None:
        return stones, dead
    pressures = sparse.diags(-blocks.coordinates / blocks.force) @ stones.passive()
    return stones, dead.also(pressures, np.zeros(pressures.shape[1]), 1.0)


def balanced(fall: Optimum, dead: Programme) -> bool:
    """Return whether the forces missing for equilibrium are nothing.

    Args:
        fall: as `dead.unbalanced()` found it.
        dead: programme of the self-weight.
    """
    return fall.value <= UNBALANCED * len(dead.blocks.structure.free)
