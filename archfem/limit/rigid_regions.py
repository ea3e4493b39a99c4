"""Rigid regions of a structure: the blocks that move as rigid bodies when joints fail."""

from dataclasses import dataclass, replace

import numpy as np

from archfem._typing import Array
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, find_supported_blocks


@dataclass(frozen=True, eq=False)
class RigidRegions:
    """A structure without its yielding bodies, such as an elastic fill."""

    structure: Structure  # the remaining blocks and joints
    blocks: tuple[int, ...]  # numbers of its blocks in the whole structure
    joints: tuple[int, ...]  # numbers of its joints in the whole structure
    size: int  # number of blocks of the whole structure

    def expand_motion(self, motion: Array) -> Array:
        """Return the motion of all blocks of the whole structure, zero for the yielding ones."""
        whole = np.zeros((self.size, 3))
        whole[list(self.blocks)] = motion
        return whole


def find_rigid_regions(structure: Structure) -> RigidRegions:
    """Remove the yielding bodies, and the blocks that do not stand on fixed ground without them."""
    everything = set(range(len(structure.blocks)))
    blocks = find_supported_blocks(structure, everything - set(find_yielding_blocks(structure)))
    # A structure of nothing but yielding bodies is taken as rigid.
    if not blocks & set(structure.free):
        return take_all_rigid(structure)
    return _select_blocks(structure, tuple(sorted(blocks)))


def take_all_rigid(structure: Structure) -> RigidRegions:
    """Return the regions in which every block is rigid."""
    return _select_blocks(structure, tuple(range(len(structure.blocks))))


def _select_blocks(structure: Structure, blocks: tuple[int, ...]) -> RigidRegions:
    """Return some of the blocks, with their joints except those between supports."""
    place = {number: k for k, number in enumerate(blocks)}
    joints = tuple(
        number
        for number, joint in enumerate(structure.joints)
        if place.keys() >= set(joint.blocks) and set(joint.blocks) & set(structure.free)
    )
    selected = replace(
        structure,
        blocks=tuple(structure.blocks[number] for number in blocks),
        joints=tuple(
            replace(joint, blocks=(place[joint.blocks[0]], place[joint.blocks[1]]))
            for joint in map(structure.joints.__getitem__, joints)
        ),
    )
    return RigidRegions(selected, blocks, joints, len(structure.blocks))
