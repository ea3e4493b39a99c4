"""The skeleton of a structure: the blocks that move as rigid bodies when joints fail."""

from dataclasses import dataclass, replace

import numpy as np

from archfem.arrays import Array
from archfem.masonry.softness import yielding_blocks
from archfem.masonry.structure import Structure


@dataclass(frozen=True, eq=False)
class Skeleton:
    """What is left of a structure without its yielding bodies.

    Attributes:
        structure: the blocks and joints that are left.
        blocks: numbers that its blocks have in the whole structure.
        joints: numbers that its joints have there.
        size: number of blocks of the whole structure.
    """

    structure: Structure
    blocks: tuple[int, ...]
    joints: tuple[int, ...]
    size: int

    def in_whole(self, motion: Array) -> Array:
        """Return the motion of all blocks of the whole structure, zero for those left out.

        Args:
            motion: of the skeleton's blocks (n_left, 3) [m, m, rad].

        Returns:
            (size, 3) [m, m, rad].
        """
        whole = np.zeros((self.size, 3))
        whole[list(self.blocks)] = motion
        return whole


def skeleton_of(structure: Structure) -> Skeleton:
    """Leave out the yielding bodies, and what no longer stands on fixed ground without them.

    A structure of nothing but yielding bodies is its own skeleton.

    Args:
        structure: the whole.

    Returns:
        What is left, and the numbers it has in the whole.
    """
    everything = set(range(len(structure.blocks)))
    blocks = _standing(structure, everything - set(yielding_blocks(structure)))
    if not set(blocks) & set(structure.free):
        return whole_of(structure)
    return _left(structure, blocks)


def whole_of(structure: Structure) -> Skeleton:
    """Leave out nothing: every block is taken as rigid.

    Args:
        structure: the whole.

    Returns:
        All of it, with the numbers that it has.
    """
    return _left(structure, tuple(range(len(structure.blocks))))


def _left(structure: Structure, blocks: tuple[int, ...]) -> Skeleton:
    """Some of the blocks, with their joints; what supports do to each other is no matter."""
    place = {number: k for k, number in enumerate(blocks)}
    joints = tuple(
        number
        for number, joint in enumerate(structure.joints)
        if place.keys() >= set(joint.blocks) and set(joint.blocks) & set(structure.free)
    )
    left = replace(
        structure,
        blocks=tuple(structure.blocks[number] for number in blocks),
        joints=tuple(
            replace(joint, blocks=(place[joint.blocks[0]], place[joint.blocks[1]]))
            for joint in map(structure.joints.__getitem__, joints)
        ),
    )
    return Skeleton(left, blocks, joints, len(structure.blocks))


def _standing(structure: Structure, blocks: set[int]) -> tuple[int, ...]:
    """Those of some blocks that are joined, through others of them, to a fixed one."""
    held = {number for number in blocks if structure.blocks[number].fixed}
    pairs = [set(joint.blocks) for joint in structure.joints if blocks >= set(joint.blocks)]
    while reached := {number for pair in pairs if pair & held for number in pair} - held:
        held |= reached
    return tuple(sorted(held))
