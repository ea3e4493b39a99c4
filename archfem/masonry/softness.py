"""How soft blocks are: too soft for the lower rungs, or softer than the joints around them."""

from dataclasses import dataclass
from math import sqrt

from archfem.masonry.block import Block
from archfem.masonry.structure import Structure

SEISMIC = 25.0
"""Upper end of the band in which earthquakes carry energy [Hz]."""

CLEAR = 10.0
"""Factor by which a block's first inner mode must lie above it to be condensed statically.

The inertia that condensation neglects is (f / f_inner)² of what matters: one per cent then.
"""

YIELDING = 1.0
"""Stiffness of a block, E / L, over that of its joints, k_n, below which it gives way itself before
its joints open: about 0.005 for backfill, 40 for a voussoir."""


@dataclass(frozen=True)
class Softness:
    """How soft a block is.

    Attributes:
        inner: estimate of its first mode with its joints held [Hz].
        ratio: its own stiffness E / L over the joint stiffness k_n [-].
    """

    inner: float
    ratio: float


def softness(structure: Structure, number: int) -> Softness:
    """Return an estimate of how soft a block is.

    Its first mode is that of a shear wave which crosses it twice, c_s / (2 L) with L² its area.

    Args:
        structure: whose joints hold it.
        number: of the block.
    """
    block = structure.blocks[number]
    length = sqrt(block.area)
    stiffest = max(
        joint.contact.normal_stiffness for joint in structure.joints if number in joint.blocks
    )
    wave = sqrt(_shear_modulus(block) / structure.density(block))
    return Softness(wave / (2.0 * length), block.material.young / length / stiffest)


def _shear_modulus(block: Block) -> float:
    return block.material.young / (2.0 * (1.0 + block.material.poisson))


def soft_blocks(structure: Structure) -> tuple[int, ...]:
    """Return the numbers of the blocks whose inner modes reach down to the seismic band.

    They need all their nodes.

    Args:
        structure: whose blocks that move are looked at.
    """
    return tuple(
        number for number in structure.free if softness(structure, number).inner < CLEAR * SEISMIC
    )


def yielding_blocks(structure: Structure) -> tuple[int, ...]:
    """Return the numbers of the blocks that deform rather than let their joints open.

    They are of neither rings nor piers. A fill fits itself to what it lies on; taken as one rigid
    body it would hold every ring below. So do the grains of a fill that has joints of its own,
    together.

    Args:
        structure: whose blocks that move are looked at.
    """
    return tuple(
        number
        for number in structure.free
        if structure.blocks[number].role == "other" and _yields(structure, number)
    )


def _yields(structure: Structure, number: int) -> bool:
    return structure.blocks[number].grain or softness(structure, number).ratio < YIELDING
