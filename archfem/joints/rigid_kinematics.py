"""The joint operator of rigid blocks: opening and slip of all joints from the blocks' motions."""

import numpy as np
from scipy import sparse

from archfem._typing import Array, Numbers
from archfem.joints.operator import JointOperator
from archfem.joints.own_law import make_operator
from archfem.joints.quadrature import JointPoints, Quadrature
from archfem.masonry.structure import Structure, rigid_motion_matrix


def facet_ends(depth: float, cells: int) -> Array:
    """Return offsets from mid-depth of the ends of equal facets along a joint (cells + 1,) [m]."""
    return depth * np.linspace(-0.5, 0.5, cells + 1)


def rigid_joint_operator(structure: Structure, cells: int, rule: Quadrature) -> JointOperator:
    """Return the joint operator in terms of rigid motions of the free blocks."""
    rules = [rule.on_joint(facet_ends(depth, cells)) for depth in structure.depths]
    points = JointPoints.on(structure, rules)
    opening, slip = _point_rates(structure, points, free_only=True)
    return make_operator(structure, rule, points, opening, slip)


def block_motion_gaps(structure: Structure, points: JointPoints, motion: Array) -> Array:
    """Return opening and slip at the joint points due to rigid motions of all blocks (2, p) [m]."""
    rates = _point_rates(structure, points, free_only=False)
    return np.stack([rate @ motion.ravel() for rate in rates])


def _point_rates(
    structure: Structure, points: JointPoints, *, free_only: bool
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Return the rates of openings and slips at the joint points with motions of blocks."""
    tangents = structure.tangents[points.joint]
    places = structure.middles[points.joint] + points.offset[:, None] * tangents
    pairs, centroids = structure.pairs[points.joint], structure.centroids
    if free_only:
        pairs, centroids = structure.first_coordinates[pairs] // 3, centroids[list(structure.free)]
    opening = jump_rates(structure.normals[points.joint], places, pairs, centroids)
    return opening, jump_rates(tangents, places, pairs, centroids)


def jump_rates(
    directions: Array, places: Array, pairs: Numbers, centres: Array
) -> sparse.csr_matrix:
    """Return the matrix from motions of bodies to the jumps at places along directions (p, 3 m).

    A jump is the motion of the second body of a pair less that of the first; -1 does not move.
    """
    row, side = np.nonzero(pairs >= 0)
    body = pairs[row, side]
    motion: Array = rigid_motion_matrix(places[row], centres[body])
    motion[side == 0] *= -1.0
    values = np.einsum("na,nac->nc", directions[row], motion)
    entries = np.repeat(row, 3), (3 * body[:, None] + np.arange(3)).ravel()
    rates = sparse.csr_matrix((values.ravel(), entries), (len(pairs), 3 * len(centres)))
    rates.eliminate_zeros()
    return rates
