"""The joint operator of rigid blocks: opening and slip of all joints from the blocks' motions."""

import numpy as np
from scipy import sparse

from archfem._typing import Array
from archfem.joints.operator import JointOperator
from archfem.joints.own_law import make_operator
from archfem.joints.quadrature import JointPoints, Numbers, Quadrature
from archfem.masonry.structure import Structure, rigid_motion_matrix


def facet_ends(depth: float, cells: int) -> Array:
    """Return offsets from mid-depth of the ends of equal facets along a joint (cells + 1,) [m]."""
    return depth * np.linspace(-0.5, 0.5, cells + 1)


def rigid_joint_operator(structure: Structure, cells: int, rule: Quadrature) -> JointOperator:
    """Return the joint operator in terms of rigid motions of the free blocks."""
    rules = [rule.on_joint(facet_ends(depth, cells)) for depth in structure.depths]
    points = JointPoints.on(structure, rules)
    places, normals, tangents = _point_frames(structure, points)
    jump = _jump_entries(structure, points, places)
    size = 3 * len(structure.free)
    opening, slip = (_component(directions, jump, size) for directions in (normals, tangents))
    return make_operator(structure, rule, points, opening, slip)


def block_motion_gaps(structure: Structure, points: JointPoints, motion: Array) -> Array:
    """Return opening and slip at the joint points due to rigid motions of all blocks (2, p) [m]."""
    places, normals, tangents = _point_frames(structure, points)
    jump = np.zeros_like(places)
    centroids = np.array([block.centroid for block in structure.blocks])
    for side, sign in enumerate((-1.0, 1.0)):
        block = structure.pairs[points.joint, side]
        jump += sign * np.einsum(
            "pij,pj->pi", rigid_motion_matrix(places, centroids[block]), motion[block]
        )
    return np.stack([np.sum(normals * jump, axis=1), np.sum(tangents * jump, axis=1)])


def _point_frames(structure: Structure, points: JointPoints) -> tuple[Array, Array, Array]:
    """Return places of the joint points, and normals and tangents there, each (p, 2)."""
    tangents = structure.tangents[points.joint]
    places = structure.middles[points.joint] + points.offset[:, None] * tangents
    return places, structure.normals[points.joint], tangents


Jump = tuple[Numbers, Numbers, Array]


def _jump_entries(structure: Structure, points: JointPoints, places: Array) -> Jump:
    """Return the nonzero blocks of the jump's matrix: their rows, first columns and values."""
    first_coordinate = np.full(len(structure.blocks), -1)
    first_coordinate[list(structure.free)] = 3 * np.arange(len(structure.free))
    centroids = np.array([block.centroid for block in structure.blocks])
    # lower blocks of all points, then higher ones
    block = structure.pairs[points.joint].T.ravel()
    rows = np.flatnonzero(first_coordinate[block] >= 0)
    free, count = block[rows], len(places)
    motion = rigid_motion_matrix(places[rows % count], centroids[free])
    sign = np.where(rows < count, -1.0, 1.0)
    return rows % count, first_coordinate[free], sign[:, None, None] * motion


def _component(directions: Array, jump: Jump, size: int) -> sparse.csr_matrix:
    """Return the component of the jump at each point along a direction (p, n)."""
    rows, start, motion = jump
    values = directions[rows, 0, None] * motion[:, 0] + directions[rows, 1, None] * motion[:, 1]
    entries = np.repeat(rows, 3), (start[:, None] + np.arange(3)).ravel()
    component = sparse.csr_matrix((values.ravel(), entries), (len(directions), size))
    component.eliminate_zeros()
    return component
