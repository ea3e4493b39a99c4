"""Stiffness of blocks relative to their joints, and their lowest internal frequency."""

from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np

from archfem._typing import Flags
from archfem.masonry.block import Block
from archfem.masonry.structure import Joint, Structure

# Stiffness of a block over that of its joints from which joints deform instead [-]
SOFT_JOINTS = 10.0


@dataclass(frozen=True)
class BlockStiffness:
    """Stiffness measures of a block."""

    inner: float  # estimated first frequency with fixed joints [Hz]
    ratio: float  # stiffness E / L of the block over the joint stiffness k_n [-]


def estimate_block_stiffness(structure: Structure, number: int) -> BlockStiffness:
    """Estimate the stiffness ratio and the first internal frequency of a block."""
    # first mode: a shear wave that crosses the block twice, c_s / (2 L), L² the area
    block = structure.blocks[number]
    length = sqrt(block.area)
    joints = [joint for joint in structure.joints if number in joint.blocks]
    stiffest = max((joint.contact.normal_stiffness for joint in joints), default=inf)
    shear_modulus = block.material.young / (2.0 * (1.0 + block.material.poisson))
    wave = sqrt(shear_modulus / structure.density(block))
    return BlockStiffness(wave / (2.0 * length), block.material.young / length / stiffest)


def soften_joints(structure: Structure) -> Structure:
    """Return a structure whose joints have the compliance of their blocks as well as their own."""
    joints = tuple(_soften_joint(structure, joint) for joint in structure.joints)
    return replace(structure, joints=joints)


def _soften_joint(structure: Structure, joint: Joint) -> Joint:
    """Return a joint in series with the halves of its blocks that it borders."""
    normal = shear = 0.0
    for block in (structure.blocks[number] for number in joint.blocks):
        if not block.fixed:
            # a bar of length L = area / depth: L / E in compression, L / G in shear
            half = 0.5 * block.area / joint.depth / block.material.young
            normal += half
            shear += 2.0 * (1.0 + block.material.poisson) * half
    return replace(joint, contact=joint.contact.in_series(normal, shear))


def find_soft_blocks(structure: Structure) -> tuple[int, ...]:
    """Return the blocks whose internal modes are too low for static condensation."""
    # Earthquakes have energy up to 25 Hz. Condensation neglects (f / f_inner)² of the inertia:
    # one per cent where the first internal frequency is ten times higher.
    return tuple(
        number
        for number in structure.free
        if estimate_block_stiffness(structure, number).inner < 10.0 * 25.0
    )


def estimate_bending(structure: Structure, number: int) -> float:
    """Return the first frequency of a block as a beam held at its joints, or infinity [Hz]."""
    # held at one end, 0.1615 d / L² √(E/ρ), or at both, 1.028 d / L² √(E/ρ) (Euler and Bernoulli)
    block = structure.blocks[number]
    length = _measure_length(block)
    depths = [joint.depth for joint in structure.joints if number in joint.blocks]
    if max(depths) > 0.5 * length:  # held along its length, as a course by another
        return inf
    wave = sqrt(block.material.young / structure.density(block))
    return (0.1615 if len(depths) == 1 else 1.028) * block.area / length**3 * wave


def _measure_length(block: Block) -> float:
    """Return twice the distance of the farthest corner from the centroid [m]."""
    return 2.0 * float(np.linalg.norm(np.array(block.points) - block.centroid, axis=1).max())


def estimate_locking(structure: Structure, number: int, along: int) -> float:
    """Return by how much cells of degree 1 along a block raise its frequency of bending [-]."""
    # straight edges of length a add shear of (a / d)² / 2 (1 + ν) to the bending stiffness at depth
    # d; meshes have cells up to twice as long as a block is thick
    block = structure.blocks[number]
    bends = estimate_bending(structure, number) < inf
    if not bends or estimate_block_stiffness(structure, number).ratio >= SOFT_JOINTS:
        return 0.0  # joints deform instead
    cell = min(_measure_length(block) ** 2 / block.area / along, 2.0)
    return sqrt(1.0 + 0.5 * cell**2 / (1.0 + block.material.poisson)) - 1.0


def estimate_lowest_inner(structure: Structure) -> float:
    """Return the lowest frequency of stones that are held by joints, infinite if these are soft."""
    # held at one end alone a wave crosses the block four times instead of twice
    single = np.bincount(structure.pairs.ravel(), minlength=len(structure.blocks)) == 1
    lowest = inf
    for number in list_stones(structure):
        found = estimate_block_stiffness(structure, number)
        if found.ratio < SOFT_JOINTS:
            inner = found.inner / (1.0 + single[number])
            lowest = min(lowest, inner, estimate_bending(structure, number))
    return lowest


def find_yielding_blocks(structure: Structure) -> tuple[int, ...]:
    """Return the blocks, of neither rings nor piers, that adapt to others as fill does."""
    # As one rigid body, fill would support each of the rings below. The pieces of a fill with
    # joints adapt together.
    return tuple(
        number
        for number in structure.free
        if structure.blocks[number].role == "other" and _is_yielding(structure, number)
    )


def list_stones(structure: Structure) -> list[int]:
    """Return the free blocks that do not yield, or all free blocks where there are no others."""
    fill = find_yielding_blocks(structure)
    return [number for number in structure.free if number not in fill] or list(structure.free)


def mark_stone_joints(structure: Structure) -> Flags:
    """Return whether joints have no yielding block on either side (j,)."""
    return ~np.isin(structure.pairs, find_yielding_blocks(structure)).any(axis=1)


def _is_yielding(structure: Structure, number: int, stiffest_fill: float = 1e9) -> bool:
    """Return whether a block is softer than its joints, and no stiffer than fill can be [Pa]."""
    # the ratio is about 0.005 for fill and 40 for voussoirs, but below 1 for stones too where
    # joints are stiffer than the stones
    block = structure.blocks[number]
    is_fill = block.material.young <= stiffest_fill
    return block.grain or (is_fill and estimate_block_stiffness(structure, number).ratio < 1.0)
