"""Condensed models: projection of a model with all nodes onto a basis of each block.

Blocks between joints are linear, so a basis B for each block gives every fidelity by M → BᵀMB,
K → BᵀKB, G → GB. Displacements and stresses inside the blocks are recovered by the same basis.

"rigid" has three motions of a block. "faces" has three motions of each joint face, which stays
plane, and condenses the other nodes statically (Guyan, AIAA J. 3 (1965) 380). "condensed" retains
all nodes on joints and condenses the others. "full" retains all nodes. Where faces of a block share
nodes they cannot move separately: "faces" then retains the displacements of the faces' ends, and a
face moves linearly between its two; it may stretch, but stays straight. The faces of a long thin
block would bend: it has the nodes of "condensed" instead.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem._typing import Array, Numbers
from archfem.masonry.structure import Structure, rigid_motion_matrix
from archfem.models.linear_blocks import LinearBlockModel


def project_model(
    model: LinearBlockModel, basis: sparse.csr_matrix, fidelity: str
) -> LinearBlockModel:
    """Return a model in the coordinates of a basis."""
    cells, transposed = model.cells, basis.T.tocsr()
    stress = None if cells.stress is None else cells.stress @ basis
    return LinearBlockModel(
        model.structure,
        fidelity,
        mass=transposed @ (model.mass @ basis),
        block_stiffness=transposed @ (model.block_stiffness @ basis),
        mass_influence=basis.T @ model.mass_influence,
        operator=model.operator.projected(basis),
        cells=replace(cells, shape_functions=cells.shape_functions @ basis, stress=stress),
    ).with_support_motion(model.support_motion)


def condense_blocks(
    model: LinearBlockModel, fidelities: Sequence[str], fidelity: str
) -> LinearBlockModel:
    """Reduce the blocks of a model with all nodes, each to its own fidelity."""
    joints = _joint_nodes(model)
    bases, order = [], []
    for number in model.structure.free:
        nodes = np.flatnonzero(model.cells.block == number)
        faces = [face for joint in joints if len(face := np.intersect1d(joint, nodes))]
        block_fidelity = fidelities[number]
        if block_fidelity == "faces" and _has_bending_faces(model.structure, number):
            block_fidelity = "condensed"
        bases.append(_block_basis(model, nodes, faces, block_fidelity))
        order.append(_dofs(nodes))
    stacked = sparse.block_diag(bases, format="csr")
    return project_model(model, stacked[np.argsort(np.concatenate(order))], fidelity)


def _has_bending_faces(structure: Structure, number: int) -> bool:
    """Return whether a face of a block bends like a long beam on elastic foundation."""
    # λ L > π with λ⁴ = k_n w / (4 E I): Hetényi, Beams on elastic foundation (1946). The thickness
    # of the beam is about the block's area over its longest extent.
    block = structure.blocks[number]
    thickness = block.area / float(np.linalg.norm(np.ptp(block.points, axis=0)))
    bending = block.material.young * thickness**3 / 3.0  # 4 E I / w
    joints = [joint for joint in structure.joints if number in joint.blocks]
    stiffness = np.array([joint.contact.normal_stiffness for joint in joints])
    lengths = np.array([joint.depth for joint in joints])
    return bool(np.any((stiffness / bending) ** 0.25 * lengths > np.pi))


def _dofs(nodes: Numbers) -> Numbers:
    """Return the degrees of freedom of nodes, x and y in turn."""
    return (2 * nodes[:, None] + np.arange(2)).ravel()


def _joint_nodes(model: LinearBlockModel) -> list[Numbers]:
    """Return the nodes on each joint, of both its sides."""
    rows = abs(model.operator.opening) + abs(model.operator.slip)
    joint = model.operator.points.joint
    return [
        np.unique(rows[np.flatnonzero(joint == number)].indices // 2)
        for number in range(model.operator.points.joint_count)
    ]


def _block_basis(
    model: LinearBlockModel, nodes: Numbers, faces: list[Numbers], fidelity: str
) -> sparse.csr_matrix:
    """Return the basis of one block, its nodes in ascending order (2 nodes, m)."""
    if fidelity == "full":
        return sparse.identity(2 * len(nodes), format="csr")
    places = model.cells.places
    if fidelity == "rigid":
        motion = rigid_motion_matrix(places[nodes], places[nodes].mean(axis=0))
        return sparse.csr_matrix(motion.reshape(-1, 3))
    retained = np.unique(np.concatenate(faces))
    if fidelity == "faces" and sum(map(len, faces)) == len(retained):
        # faces without common nodes: a rigid motion of each
        motions = [rigid_motion_matrix(places[face], places[face].mean(axis=0)) for face in faces]
        columns = sparse.block_diag([motion.reshape(-1, 3) for motion in motions])
        on_joints = columns.tocsr()[np.argsort(_dofs(np.concatenate(faces)))]
    elif fidelity == "faces":
        shares = _interpolate_between_ends(places, faces, retained)
        on_joints = sparse.kron(shares, np.eye(2), format="csr")
    else:
        on_joints = sparse.identity(2 * len(retained), format="csr")
    return _condense_inner_nodes(model, nodes, retained, on_joints)


def _interpolate_between_ends(places: Array, faces: list[Numbers], retained: Numbers) -> Array:
    """Return weights of the faces' ends in the displacements of the retained nodes (k, ends)."""
    pairs, weights = [], []
    for face in faces:
        # the two nodes farthest apart
        relative = places[face] - places[face[0]]
        far = face[np.argmax(np.sum(relative**2, axis=1))]
        near = face[np.argmax(np.sum((places[face] - places[far]) ** 2, axis=1))]
        along = places[far] - places[near]
        pairs.append((near, far))
        weights.append((places[face] - places[near]) @ along / (along @ along))
    ends = np.unique(pairs)
    shares = np.zeros((len(retained), len(ends)))
    for face, pair, weight in zip(faces, pairs, weights, strict=True):
        columns = np.searchsorted(ends, pair)
        rows = np.searchsorted(retained, face)[:, None]
        shares[rows, columns] = np.stack([1.0 - weight, weight], 1)
    return shares


def _condense_inner_nodes(
    model: LinearBlockModel, nodes: Numbers, retained: Numbers, on_joints: sparse.csr_matrix
) -> sparse.csr_matrix:
    """Return motions of the retained nodes, and of the others without forces on them."""
    inner = np.setdiff1d(nodes, retained)
    basis = sparse.lil_matrix((2 * len(nodes), on_joints.shape[1]))
    basis[_dofs(np.searchsorted(nodes, retained))] = on_joints
    if len(inner):
        stiffness = model.block_stiffness[_dofs(inner)]
        coupled = (stiffness[:, _dofs(retained)] @ on_joints).toarray()
        solved = splu(stiffness[:, _dofs(inner)].tocsc()).solve(coupled)
        basis[_dofs(np.searchsorted(nodes, inner))] = -solved
    return basis.tocsr()
