"""The joints between blocks that turn in coordinates of their own, whole or in pieces.

Between faces that stay plane a joint is one piece, whose faces overlap by less the further they
slide. Where faces bend, or belong to a fill, each facet of the mesh is a piece, between the two
pairs of nodes at its ends: displacement and turn of its faces are linear in what the blocks do in
their frames, so that all of a piece is as of a plane face. Its places stay opposite as meshed.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.joints.facets import Facets
from archfem.joints.moving.moved import Moved
from archfem.joints.moving.overlap import Faces
from archfem.joints.moving.poses import Sides
from archfem.masonry.structure import Structure
from archfem.models.jointed import Jointed

STRAIGHT = 1e-9
"""How far a face may bend, relative to its motion, and still be plane."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of the joints of a structure.

    Attributes:
        structure: whose joints.
        joint: which joint each is of (j,).
        first: where its points begin among all (j + 1,).
        aside: how far its middle lies from that of the joint, toward the extrados (j,) [m].
        depth: its length (j,) [m].
    """

    structure: Structure
    joint: Any
    first: Any
    aside: Array
    depth: Array

    @classmethod
    def of(cls, model: Jointed) -> "Pieces":
        """Return the pieces of the joints of a model.

        Args:
            model: of small displacements.

        Raises:
            InvalidInput: faces bend, and their tractions are not integrated exactly.
        """
        points, depths = model.operator.points, model.structure.depths
        bounds = np.searchsorted(points.joint, np.arange(points.count + 1))
        found: list[tuple[int, int, float, float]] = []
        for number, (begin, end) in enumerate(pairwise(bounds)):
            if _plane(model, begin, end):
                found.append((number, begin, 0.0, depths[number]))
                continue
            _check_exact(model, number)
            for place in range(begin, end, 2):
                low, high = points.arm[place : place + 2]
                found.append((number, place, 0.5 * (low + high), abs(high - low)))
        joint, first, aside, depth = map(np.array, zip(*found, strict=True))
        return cls(model.structure, joint, np.append(first, len(points.arm)), aside, depth)

    @property
    def middles(self) -> Array:
        """Middles of the pieces before anything moved (j, 2) [m]."""
        along = self.structure.tangents[self.joint]
        found: Array = self.structure.middles[self.joint] + self.aside[:, None] * along
        return found

    @property
    def paired(self) -> Any:
        """Whether each piece is one of several of its joint (j,)."""
        return np.bincount(self.joint)[self.joint] > 1

    def held(self, supports: Array) -> Array:
        """Return poses of the faces of blocks that do not move by themselves (j, 2, 3) [m, m, rad].

        Args:
            supports: motions of the fixed blocks (n_blocks, 3) [m, m, rad].
        """
        pairs = self.structure.pairs[self.joint]
        centres = np.array([block.centroid for block in self.structure.blocks])
        x, y, turn = np.moveaxis(supports[pairs], -1, 0)
        rx, ry = np.moveaxis(self.middles[:, None] - centres[pairs], -1, 0)
        less = -2.0 * np.sin(0.5 * turn) ** 2
        along, across = less * rx - np.sin(turn) * ry, np.sin(turn) * rx + less * ry
        return np.stack([x + along, y + across, turn], axis=-1)


def _plane(model: Jointed, begin: int, end: int) -> bool:
    """Whether the opening of a joint stays linear along it, and slip as well."""
    operator, arm = model.operator, model.operator.points.arm[begin:end]
    if end - begin < 3:
        return True
    line = np.column_stack([np.ones_like(arm), arm])
    across = np.eye(len(arm)) - line @ np.linalg.pinv(line)
    for rows in (operator.opening[begin:end], operator.slip[begin:end]):
        used = rows[:, np.unique(rows.indices)].toarray()
        if np.abs(across @ used).max(initial=0.0) > STRAIGHT * np.abs(used).max(initial=0.0):
            return False
    return True


def _check_exact(model: Jointed, number: int) -> None:
    """Refuse faces that bend between springs."""
    if not isinstance(model.operator.law, Facets):
        raise InvalidInput(
            f"the faces of joint '{model.structure.joints[number].name}' bend, and large "
            "displacements of such joints are known with exact quadrature alone: leave "
            "quadrature out, or take fidelity 'faces' or 'rigid'"
        )


def hands(structure: Structure) -> Array:
    """Return 1 where the extrados is on the left of a joint's normal, -1 on the right (j,).

    Args:
        structure: whose joints.
    """
    (nx, ny), (tx, ty) = structure.normals.T, structure.tangents.T
    found: Array = np.where(nx * ty - ny * tx > 0.0, 1.0, -1.0)
    return found


def joints_of(
    model: Jointed, pieces: Pieces, blocks: Mapping[int, tuple[range, bool]], centres: Array
) -> Moved:
    """Return the joints between blocks in coordinates of their own.

    Args:
        model: in those coordinates.
        pieces: of its joints.
        blocks: coordinates of each block that moves, and whether it has a frame that turns.
        centres: about which blocks turn (n_blocks, 2) [m].
    """
    structure, normals = model.structure, model.structure.normals[pieces.joint]
    return Moved(
        _sides(model, pieces, blocks, centres),
        _faces(model, pieces),
        np.arctan2(normals[:, 1], normals[:, 0]),
        hands(structure)[pieces.joint],
        pieces.joint,
        pieces.aside,
        len(structure.joints),
        np.zeros((len(pieces.joint), 4)),
    )


def _moves(model: Jointed, pieces: Pieces) -> list[sparse.csr_matrix]:
    """From coordinates to opening, slip, turn and stretch of the pieces, to the left (j, n)."""
    return _measured(model, pieces, model.operator.opening, model.operator.slip)


def built_measures(model: Jointed, pieces: Pieces, built: Array) -> Array:
    """Return opening, slip, turn and stretch at which pieces began, to the left (j, 4).

    Args:
        model: in coordinates of the blocks.
        pieces: of its joints.
        built: opening and slip at which its points began (2, p) [m].
    """
    return np.column_stack(_measured(model, pieces, *built))


def _measured(model: Jointed, pieces: Pieces, opening: Any, slip: Any) -> list[Any]:
    """Opening, slip, turn and stretch of the pieces from what points open and slip (p, …)."""
    points = model.operator.points
    piece = np.repeat(np.arange(len(pieces.joint)), np.diff(pieces.first))
    hand = hands(model.structure)[pieces.joint]
    off = hand[piece] * (points.arm - pieces.aside[piece])
    shape = (len(pieces.joint), len(piece))
    place = (piece, np.arange(len(piece)))
    share = points.weight / np.bincount(piece, points.weight)[piece]
    mean = sparse.csr_matrix((share, place), shape)
    spread = np.bincount(piece, share * off**2)[piece]
    slope = sparse.csr_matrix((share * off / spread, place), shape)
    along = sparse.diags(hand[piece]) @ slip
    stretch = sparse.diags(pieces.depth) @ (slope @ along)
    return [mean @ opening, mean @ along, -(slope @ opening), stretch]


def _sides(
    model: Jointed, pieces: Pieces, blocks: Mapping[int, tuple[range, bool]], centres: Array
) -> Sides:
    """The faces of the blocks on both sides of the pieces."""
    structure, count = model.structure, len(pieces.joint)
    moves = [each.tocsr() for each in _moves(model, pieces)]
    own: dict[tuple[int, int], Any] = {}
    turns = np.zeros((count, 2), bool)
    used = sum(abs(each) for each in moves).tocsr()
    for piece, joint in enumerate(pieces.joint):
        touched = used.indices[used.indptr[piece] : used.indptr[piece + 1]]
        for side, block in enumerate(map(int, structure.pairs[joint])):
            if block not in blocks:
                own[piece, side] = np.zeros(0, int)
                continue
            span, turns[piece, side] = blocks[block]
            numbers = np.sort(touched[(touched >= span.start) & (touched < span.stop)])
            own[piece, side] = np.array(span) if turns[piece, side] else numbers
    most = max(3, *(len(numbers) for numbers in own.values()))
    index, size = np.zeros((count, 2, most), int), np.zeros((count, 2), int)
    shapes, stretch = np.zeros((count, 2, 3, most)), np.zeros((count, 2, most))
    normals, left = structure.normals[pieces.joint], np.zeros((count, 2))
    left[:, 0], left[:, 1] = -normals[:, 1], normals[:, 0]
    for (piece, side), numbers in own.items():
        first, end = (3 if turns[piece, side] else 0), len(numbers)
        index[piece, side, :end], size[piece, side] = numbers, end
        sign = 2 * side - 1
        g, s, turn, longer = (sign * each[piece].toarray()[0, numbers[first:]] for each in moves)
        axes = np.column_stack([normals[piece], left[piece]])
        shapes[piece, side, :2, first:end] = axes @ np.stack([g, s])
        shapes[piece, side, 2, first:end] = turn
        stretch[piece, side, first:end] = longer
    if np.abs(stretch).max(initial=0.0) <= STRAIGHT * np.abs(shapes).max(initial=0.0):
        stretch = stretch[:, :, :0]
    arm = pieces.middles[:, None] - centres[structure.pairs[pieces.joint]]
    return Sides(index, size, turns, arm, shapes, stretch, pieces.held(model.supports))


def _faces(model: Jointed, pieces: Pieces) -> Faces:
    """What the law of the joints needs."""
    structure, points = model.structure, model.operator.points
    contacts = [structure.joints[joint].contact for joint in pieces.joint]
    facets = isinstance(model.operator.law, Facets)
    piece = np.repeat(np.arange(len(pieces.joint)), np.diff(pieces.first))
    depth, hand = pieces.depth[piece], hands(structure)[points.joint]
    share = points.weight / (structure.width * depth)
    return Faces(
        pieces.depth,
        structure.width * np.array([each.normal_stiffness for each in contacts]),
        np.array([each.coefficient for each in contacts]),
        pieces.first,
        hand * (points.arm - pieces.aside[piece]) / depth,
        np.repeat(share[0::2] + share[1::2], 2) if facets else share,
        points.shear,
        facets,
        structure.width * np.array([each.cohesion for each in contacts]),
        pieces.paired,
    )
