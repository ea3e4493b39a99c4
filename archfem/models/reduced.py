"""Lower rungs of the ladder: a Galerkin basis turns a model into a smaller one.

Between joints everything is linear, so a basis B for each block gives every fidelity by the one
formula M → BᵀMB, K → BᵀKB, G → GB. Displacements and stresses inside the blocks are recovered by
the same basis. Reference: Guyan, AIAA J. 3 (1965) 380, for static condensation.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem.arrays import Array
from archfem.joints.facets import Facets
from archfem.masonry.rigid_motion import motion_of
from archfem.masonry.structure import Structure
from archfem.models.jointed import Jointed

Numbers = NDArray[np.intp]


def projected(model: Jointed, basis: sparse.csr_matrix, fidelity: str) -> Jointed:
    """Express a model in the coordinates of a basis.

    Args:
        model: with n coordinates.
        basis: columns are motions in those coordinates (n, m).
        fidelity: what to call the result.

    Returns:
        A model with m coordinates, the factors of the columns.
    """
    cells, back = model.cells, basis.T.tocsr()
    return Jointed(
        model.structure,
        fidelity,
        mass=back @ (model.mass @ basis),
        blocks=back @ (model.blocks @ basis),
        body=basis.T @ model.body,
        operator=model.operator.projected(basis),
        cells=replace(
            cells,
            lift=cells.lift @ basis,
            stress=None if cells.stress is None else cells.stress @ basis,
        ),
    ).moved(model.supports)


def reduced(model: Jointed, rungs: Sequence[str], fidelity: str) -> Jointed:
    """Reduce the blocks of a model with all nodes, each to a rung of its own.

    "rigid" keeps three motions of a block; "faces" three of each joint face, which moves as a
    plane, and condenses the rest statically; "condensed" keeps all nodes on joints and condenses
    the others; "full" keeps all. Where faces of a block share nodes they cannot move on their own:
    there "faces" keeps the displacements of the faces' ends, and each face moves linearly between
    its two; it may stretch, but stays straight. The faces of a long thin block would bend: it keeps
    its nodes, as "condensed" does.

    Args:
        model: with all nodes.
        rungs: of each block of the structure, some of `RUNGS` (n_blocks,).
        fidelity: what to call the result.

    Returns:
        The smaller model.
    """
    joints = _faces(model)
    pieces, order = [], []
    plane = {number for number, block in enumerate(model.structure.blocks) if block.fixed}
    for number in model.structure.free:
        nodes = np.flatnonzero(model.cells.block == number)
        faces = [own for face in joints if len(own := np.intersect1d(face, nodes))]
        rung = rungs[number]
        if rung == "faces" and _bends(model.structure, number):
            rung = "condensed"
        if rung in ("rigid", "faces"):
            plane.add(number)
        pieces.append(_basis(model, nodes, faces, rung))
        order.append(_dofs(nodes))
    stacked = sparse.block_diag(pieces, format="csr")
    basis = stacked[np.argsort(np.concatenate(order))]
    return projected(_spanned(model, plane), basis, fidelity)


def _bends(structure: Structure, number: int) -> bool:
    """Return whether a face is a long beam on its joint as elastic foundation: λ L > π.

    λ⁴ = k_n w / (4 E I); Hetényi, Beams on elastic foundation (1946). The thickness of the beam is
    about the block's area over its longest extent.
    """
    block = structure.blocks[number]
    thickness = block.area / float(np.linalg.norm(np.ptp(block.points, axis=0)))
    bending = block.material.young * thickness**3 / 3.0  # 4 E I / w
    own = [joint for joint in structure.joints if number in joint.blocks]
    stiffness = np.array([joint.contact.normal_stiffness for joint in own])
    lengths = np.array([joint.depth for joint in own])
    return bool(np.any((stiffness / bending) ** 0.25 * lengths > np.pi))


def _dofs(nodes: Numbers) -> Numbers:
    """Degrees of freedom of nodes, x and y in turn."""
    return (2 * nodes[:, None] + np.arange(2)).ravel()


def _faces(model: Jointed) -> list[Numbers]:
    """Nodes on each joint, of both its sides."""
    rows = abs(model.operator.opening) + abs(model.operator.slip)
    joint = model.operator.points.joint
    return [
        np.unique(rows[np.flatnonzero(joint == number)].indices // 2)
        for number in range(model.operator.points.count)
    ]


def _basis(model: Jointed, nodes: Numbers, faces: list[Numbers], rung: str) -> sparse.csr_matrix:
    """Basis of one block (2 nodes, m), its nodes in ascending order."""
    if rung == "full":
        return sparse.identity(2 * len(nodes), format="csr")
    places = model.cells.places
    if rung == "rigid":
        motion = motion_of(places[nodes], places[nodes].mean(axis=0))
        return sparse.csr_matrix(motion.reshape(-1, 3))
    held = np.unique(np.concatenate(faces))
    if rung == "faces" and sum(map(len, faces)) == len(held):
        motions = [motion_of(places[face], places[face].mean(axis=0)) for face in faces]
        columns = sparse.block_diag([motion.reshape(-1, 3) for motion in motions])
        on_joints = columns.tocsr()[np.argsort(_dofs(np.concatenate(faces)))]
    elif rung == "faces":
        on_joints = sparse.kron(_between_ends(places, faces, held), np.eye(2), format="csr")
    else:
        on_joints = sparse.identity(2 * len(held), format="csr")
    return _condensed(model, nodes, held, on_joints)


def _between_ends(places: Array, faces: list[Numbers], held: Numbers) -> Array:
    """Shares of the faces' ends in the displacements of the held nodes (held, ends)."""
    pairs, weights = [], []
    for face in faces:
        relative = places[face] - places[face[0]]
        far = face[np.argmax(np.sum(relative**2, axis=1))]
        near = face[np.argmax(np.sum((places[face] - places[far]) ** 2, axis=1))]
        along = places[far] - places[near]
        pairs.append((near, far))
        weights.append((places[face] - places[near]) @ along / (along @ along))
    ends = np.unique(pairs)
    shares = np.zeros((len(held), len(ends)))
    for face, pair, weight in zip(faces, pairs, weights, strict=True):
        columns = np.searchsorted(ends, pair)
        shares[np.searchsorted(held, face)[:, None], columns] = np.stack([1.0 - weight, weight], 1)
    return shares


def _condensed(
    model: Jointed, nodes: Numbers, held: Numbers, on_joints: sparse.csr_matrix
) -> sparse.csr_matrix:
    """Motions of the held nodes, and what the others do under them when no force acts there."""
    inner = np.setdiff1d(nodes, held)
    basis = sparse.lil_matrix((2 * len(nodes), on_joints.shape[1]))
    position = np.searchsorted(nodes, held)
    basis[_dofs(position)] = on_joints
    if len(inner):
        stiffness = model.blocks[_dofs(inner)]
        coupled = (stiffness[:, _dofs(held)] @ on_joints).toarray()
        solved = splu(stiffness[:, _dofs(inner)].tocsc()).solve(coupled)
        basis[_dofs(np.searchsorted(nodes, inner))] = -solved
    return basis.tocsr()


def _spanned(model: Jointed, plane: set[int]) -> Jointed:
    """With exact facets, let one span each joint that never slides between plane faces.

    Each end of a facet slides by itself, and has a bond of its own: a joint which can slide, or is
    bonded, keeps several.

    Args:
        model: with all nodes.
        plane: numbers of the blocks whose faces stay plane.

    Returns:
        The same model, with fewer joint points where that changes nothing.
    """
    if not isinstance(model.operator.law, Facets):
        return model
    whole = [
        set(joint.blocks) <= plane and not joint.contact.slides and joint.contact.tension == 0.0
        for joint in model.structure.joints
    ]
    return model.with_operator(model.operator.spanned(whole))
