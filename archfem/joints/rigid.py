"""The joint operator of rigid blocks: opening and slip of all joints from the blocks' motions."""

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.integration import law_of
from archfem.joints.operator import JointOperator
from archfem.joints.points import JointPoints, Numbers
from archfem.joints.quadrature import Quadrature
from archfem.masonry.rigid_motion import motion_of
from archfem.masonry.structure import Structure


def facets_of(depth: float, cells: int) -> Array:
    """Return the ends of equal facets along a joint (cells + 1,), from its mid-point outwards [m].

    Args:
        depth: of the joint [m].
        cells: number of facets.
    """
    return depth * np.linspace(-0.5, 0.5, cells + 1)


def rigid_joints(structure: Structure, cells: int, rule: Quadrature) -> JointOperator:
    """Opening and slip of every joint in terms of rigid motions of the blocks.

    Args:
        structure: its fixed blocks do not move.
        cells: facets on each joint.
        rule: quadrature on each facet.

    Returns:
        Operator on 3 coordinates a free block [m, m, rad].
    """
    rules = [rule.on_joint(facets_of(depth, cells)) for depth in structure.depths]
    points = JointPoints.on(structure, rules)
    size = 3 * len(structure.free)
    places, normals, tangents = _frames(structure, points)
    jump = _jump(structure, points, places)
    opening, slip = (_along(each, jump, size) for each in (normals, tangents))
    return JointOperator(law_of(rule, points), opening, slip)


def gaps_of(structure: Structure, points: JointPoints, motion: Array) -> Array:
    """Opening and slip that motions of blocks alone cause at points on the joints.

    Args:
        structure: whose blocks move.
        points: on its joints (p points).
        motion: of the centroid of every block (n_blocks, 3) [m, m, rad].

    Returns:
        (2, p) [m].
    """
    places, normals, tangents = _frames(structure, points)
    jump = np.zeros_like(places)
    centroids = np.array([block.centroid for block in structure.blocks])
    for side, sign in enumerate((-1.0, 1.0)):
        block = structure.pairs[points.joint, side]
        jump += sign * np.einsum("pij,pj->pi", motion_of(places, centroids[block]), motion[block])
    return np.stack([np.sum(normals * jump, axis=1), np.sum(tangents * jump, axis=1)])


def _frames(structure: Structure, points: JointPoints) -> tuple[Array, Array, Array]:
    """Places of points on the joints, and the joints' normals and tangents there, each (p, 2)."""
    tangents = structure.tangents[points.joint]
    places = structure.middles[points.joint] + points.arm[:, None] * tangents
    return places, structure.normals[points.joint], tangents


Jump = tuple[Numbers, Numbers, Array]


def _jump(structure: Structure, points: JointPoints, places: Array) -> Jump:
    """Displacement of the higher block less that of the lower: its entries that are not zero.

    Returns:
        Points (m,), first coordinates of a block (m,), and by each of its three x and y (m, 2, 3).
    """
    start = np.full(len(structure.blocks), -1)
    start[list(structure.free)] = 3 * np.arange(len(structure.free))
    centroids = np.array([block.centroid for block in structure.blocks])
    block = structure.pairs[points.joint].T.ravel()
    rows = np.flatnonzero(start[block] >= 0)
    own, count = block[rows], len(places)
    motion = motion_of(places[rows % count], centroids[own])
    sign = np.where(rows < count, -1.0, 1.0)
    return rows % count, start[own], sign[:, None, None] * motion


def _along(directions: Array, jump: Jump, size: int) -> sparse.csr_matrix:
    """Component of the jump at each point along a direction (p, 2)."""
    rows, start, motion = jump
    values = directions[rows, 0, None] * motion[:, 0] + directions[rows, 1, None] * motion[:, 1]
    where = np.repeat(rows, 3), (start[:, None] + np.arange(3)).ravel()
    component = sparse.csr_matrix((values.ravel(), where), (len(directions), size))
    component.eliminate_zeros()
    return component
