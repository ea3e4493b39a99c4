"""Rigid motions of blocks: two translations of the centroid and a rotation, three to a block."""

import numpy as np

from archfem.arrays import Array
from archfem.masonry.structure import Structure


def motion_of(points: Array, centroid: Array) -> Array:
    """Return the displacement of points per unit rigid motion of their block (p, 2, 3).

    For small motions (u, v, θ), anticlockwise θ, a point moves by u - θ (y - y_c) along x and by
    v + θ (x - x_c) along y.

    Args:
        points: on the block, or on several (p, 2) [m].
        centroid: of the block (2,), or of each point's own (p, 2) [m].
    """
    arm = points - centroid
    motion = np.zeros((len(points), 2, 3))
    motion[:, 0, 0] = motion[:, 1, 1] = 1.0
    motion[:, 0, 2], motion[:, 1, 2] = -arm[:, 1], arm[:, 0]
    return motion


def first_coordinate(structure: Structure) -> dict[int, int]:
    """Return the number of the first of the three coordinates of each block that moves.

    Args:
        structure: whose free blocks have coordinates, in their order.
    """
    return {block: 3 * k for k, block in enumerate(structure.free)}
