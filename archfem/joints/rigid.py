"""The joint operator of rigid blocks: opening and slip of all joints from the blocks' motions."""

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.integration import law_of
from archfem.joints.operator import JointOperator
from archfem.joints.points import JointPoints
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
    jump = _jump(structure, points, places, size)
    return JointOperator(law_of(rule, points), _along(normals, jump), _along(tangents, jump))


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


def _jump(structure: Structure, points: JointPoints, places: Array, size: int) -> list[Array]:
    """Displacement of the higher block less that of the lower, x and y: two (p, n) matrices."""
    start = np.full(len(structure.blocks), -1)
    start[list(structure.free)] = 3 * np.arange(len(structure.free))
    centroids = np.array([block.centroid for block in structure.blocks])
    jump = [sparse.csr_matrix((len(places), size)) for _ in range(2)]
    for side, sign in enumerate((-1.0, 1.0)):
        block = structure.pairs[points.joint, side]
        rows = np.flatnonzero(start[block] >= 0)
        motion = sign * motion_of(places[rows], centroids[block[rows]])
        columns = start[block[rows], None] + np.arange(3)
        where = (np.repeat(rows, 3), columns.ravel())
        for axis in range(2):
            values = motion[:, axis].ravel()
            jump[axis] = jump[axis] + sparse.csr_matrix((values, where), jump[axis].shape)
    return jump


def _along(directions: Array, jump: list[Array]) -> sparse.csr_matrix:
    """Component of the jump at each point along a direction (p, 2)."""
    component = sum(sparse.diags(directions[:, axis]) @ jump[axis] for axis in range(2))
    component = component.tocsr()
    component.eliminate_zeros()
    return component
