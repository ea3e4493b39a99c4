"""Masses, shapes and friction of a structure's blocks, as arrays that compiled loops take."""

import logging
from itertools import pairwise
from math import inf, isinf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from archfem.arguments import real
from archfem.arrays import Array
from archfem.dynamics.falling.pieces import convex_pieces, corners_of
from archfem.errors import InvalidInput
from archfem.masonry.block import Block
from archfem.masonry.softness import soft_blocks
from archfem.masonry.structure import TOUCHING, Structure

logger = logging.getLogger("archfem")

CHORD = np.radians(15.0)
"""Angle of a ring [rad] up to which one chord stands for a stone's arc: it leaves the arc by less
than 0.9 % of the radius."""

ENDLESS = 1e3
"""Coefficient of friction that stands for an infinite one."""


class Bodies(NamedTuple):
    """Rigid bodies of convex pieces above a level ground; the ground counts as one more body.

    Attributes:
        inverse: 1/m and 1/I, zero for what is fixed (b + 1, 2) [1/kg, 1/(kg m²)].
        mass: m and I, zero for what is fixed (b, 2) [kg, kg m²].
        centre: centroids as built (b + 1, 2) [m].
        reach: of the farthest vertex from the centroid (b,) [m].
        friction: coefficient between two bodies (b + 1, b + 1).
        owner: body of each piece (p,).
        start: first vertex of each piece, and the number of vertices (p + 1,).
        arms: vertices from the body's centroid, as built, anticlockwise in each piece (k, 2) [m].
        normals: of the edges from these vertices to the next, outward, as built (k, 2).
        outer: whether that edge bounds the body, and is no cut between its pieces (k,).
        level: of the ground [m].
        near: gap that still counts as contact [m].
    """

    inverse: Array
    mass: Array
    centre: Array
    reach: Array
    friction: Array
    owner: NDArray[np.int64]
    start: NDArray[np.int64]
    arms: Array
    normals: Array
    outer: NDArray[np.bool_]
    level: float
    near: float


def bodies_of(
    structure: Structure, friction: float | None = None, level: float | None = None
) -> Bodies:
    """Return the blocks of a structure as bodies, in their order.

    Args:
        structure: free and fixed blocks.
        friction: coefficient between blocks that no joint connects, and to the ground; None takes
            the least of the structure's joints.
        level: height of the ground [m]; None takes the lowest point of the fixed blocks.

    Raises:
        InvalidInput: no coefficient is known, or the ground lies above the foot of a free block.
    """
    blocks = structure.blocks
    ground = _ground(structure, level)
    shapes = [_pieces(block) for block in blocks]
    owner = [body for body, pieces in enumerate(shapes) for _ in pieces]
    pieces = [piece for each in shapes for piece in each]
    arms = np.concatenate([points for points, _ in pieces])
    steps = np.concatenate([np.roll(points, -1, axis=0) - points for points, _ in pieces])
    across = np.column_stack([steps[:, 1], -steps[:, 0]])
    mass = np.array([_mass(structure, block) for block in blocks])
    inverse = np.zeros((len(blocks) + 1, 2))
    inverse[list(structure.free)] = 1.0 / mass[list(structure.free)]
    return Bodies(
        inverse,
        mass,
        np.array([*(block.centroid for block in blocks), (0.0, ground)]),
        np.array([max(np.hypot(*points.T).max() for points, _ in each) for each in shapes]),
        _friction(structure, friction),
        np.array(owner, dtype=np.int64),
        np.cumsum([0, *(len(points) for points, _ in pieces)]).astype(np.int64),
        arms,
        across / np.linalg.norm(across, axis=1)[:, None],
        np.concatenate([outer for _, outer in pieces]),
        ground,
        TOUCHING * structure.size,
    )


def check_dry(structure: Structure) -> None:
    """Refuse joints with cohesion, and say where a block is no rigid body.

    Args:
        structure: of stones.

    Raises:
        InvalidInput: a joint has cohesion.
    """
    for joint in structure.joints:
        if joint.contact.cohesion > 0.0:
            raise InvalidInput(
                f"joint '{joint.name}' has cohesion {joint.contact.cohesion:.3g} Pa, which is not "
                "known of blocks that fall: leave cohesion out"
            )
    for number in soft_blocks(structure):
        if not structure.blocks[number].fixed:
            logger.warning(
                "block '%s' is soft, and falls here as one rigid body: cut it with jointed_fill",
                structure.blocks[number].name,
            )


def _mass(structure: Structure, block: Block) -> tuple[float, float]:
    """Mass and moment of inertia, zero for what is fixed."""
    if block.fixed:
        return 0.0, 0.0
    density = structure.density(block) * structure.width
    return density * block.area, density * block.polar_moment


def _pieces(block: Block) -> list[tuple[Array, NDArray[np.bool_]]]:
    """Convex pieces of a block: vertices from its centroid, and whether edges bound the block."""
    points = corners_of(block.drawn(_chords(block))) - block.centroid
    count = len(points)
    return [
        (
            points[list(piece)],
            np.array([(a + 1) % count == b for a, b in pairwise((*piece, piece[0]))]),
        )
        for piece in convex_pieces(points)
    ]


def _chords(block: Block) -> int:
    """How many chords stand for an arc."""
    if block.centre is None:
        return 1
    start, end = block.points[:2] - np.array(block.centre)
    turn = abs(np.arctan2(start[0] * end[1] - start[1] * end[0], start @ end))
    return int(np.ceil(turn / CHORD - 1e-9))


def _friction(structure: Structure, others: float | None) -> Array:
    """Coefficients between any two bodies, the ground the last of them."""
    least = float(structure.friction.min(initial=inf))
    if others is None and isinf(least):
        raise InvalidInput(
            "no joint of the structure slides, so that the friction between stones that fall is "
            "not known: give friction"
        )
    between = least if others is None else real(others, "friction", least=0.0)
    count = len(structure.blocks) + 1
    found = np.full((count, count), between)
    joined = np.full((count, count), inf)
    known = np.zeros((count, count), dtype=bool)
    for (a, b), coefficient in zip(structure.pairs, structure.friction, strict=True):
        joined[a, b] = joined[b, a] = min(joined[a, b], coefficient)
        known[a, b] = known[b, a] = True
    return np.minimum(np.where(known, joined, found), ENDLESS)


def _ground(structure: Structure, level: float | None) -> float:
    """Level of the ground, below which no free block may begin."""
    feet = [float(block.points[:, 1].min()) for block in structure.blocks]
    fixed = [foot for foot, block in zip(feet, structure.blocks, strict=True) if block.fixed]
    ground = min(fixed) if level is None else real(level, "level [m]")
    number = min(structure.free, key=feet.__getitem__)
    if feet[number] < ground - TOUCHING * structure.size:
        raise InvalidInput(
            f"the ground at {ground:.4g} m lies above the foot of block "
            f"'{structure.blocks[number].name}' at {feet[number]:.4g} m: give a lower level"
        )
    return ground
