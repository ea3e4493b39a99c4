"""Corotational coordinates of blocks, and displacements of points in these coordinates.

The coordinates of a block are the displacement of its centroid, its rotation, and its elastic
motions in the frame that rotates with it. These neither move the centroid nor rotate the block on
the mean.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import qr

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.joints.large.face_kinematics import FaceKinematics
from archfem.joints.large.rates import find_rate_pairs
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import rigid_motion_matrix
from archfem.models.linear_blocks import LinearBlockModel
from archfem.models.model import Cells, Model


@dataclass(frozen=True, eq=False)
class CorotationalCoordinates:
    """Blocks of a model of small displacements in coordinates of their own.

    A fill retains its coordinates: it deforms rather than rotates, and its displacements are small.
    """

    basis: sparse.csr_matrix  # those coordinates in the model's (n, n)
    # coordinates of each free block, and whether it has a rotating frame, by block number
    blocks: dict[int, tuple[range, bool]]
    centres: Array  # about which blocks rotate (n_blocks, 2) [m]

    @classmethod
    def of(cls, small: LinearBlockModel) -> "CorotationalCoordinates":
        """Return the coordinates of the blocks of a model."""
        # block of each coordinate: the one whose points it displaces
        entries = small.cells.shape_functions.tocoo()
        moving = entries.data != 0.0
        owner = np.zeros(small.size, dtype=np.intp)
        owner[entries.col[moving]] = small.cells.block[entries.row[moving] // 2]
        fill, bases, order, blocks, count = set(_find_fill(small)), [], [], {}, 0
        centres = np.array([block.centroid for block in small.structure.blocks], float)
        for number in small.structure.free:
            columns = np.flatnonzero(owner == number)
            has_frame = number not in fill or len(columns) == 3
            basis: Any = sparse.identity(len(columns))
            if has_frame:
                basis, centres[number] = _corotational_basis(small, columns, number)
            blocks[number] = range(count, count + basis.shape[1]), has_frame
            count += basis.shape[1]
            bases.append(basis)
            order.append(columns)
        stacked = sparse.block_diag(bases, format="csr")
        return cls(stacked[np.argsort(np.concatenate(order))], blocks, centres)

    @property
    def block_starts(self) -> Array:
        """First coordinate of each free block, and the number of all (m + 1,)."""
        return np.array([0, *(span.stop for span, _ in self.blocks.values())])


def _find_fill(small: LinearBlockModel) -> list[int]:
    """Return the blocks of fill, which deform with the blocks below and get no rotating frame."""
    blocks = small.structure.blocks
    return [number for number in find_yielding_blocks(small.structure) if not blocks[number].grain]


def _corotational_basis(small: LinearBlockModel, columns: Any, number: int) -> tuple[Array, Array]:
    """Return rigid and elastic motions of a block in the model's coordinates, and its centre."""
    mass = small.mass[columns][:, columns].toarray()
    cells = small.cells
    nodes = np.flatnonzero(cells.block == number)
    rows = (2 * nodes[:, None] + np.arange(2)).ravel()
    shapes = cells.shape_functions[rows][:, columns].toarray()

    def rigid_motions(centre: Array) -> Array:
        motion = rigid_motion_matrix(cells.places[nodes], centre).reshape(-1, 3)
        return np.linalg.lstsq(shapes, motion, rcond=None)[0]

    # the centre of mass uncouples displacement and rotation
    centre = np.array(small.structure.blocks[number].centroid)
    rigid = rigid_motions(centre)
    inertia = rigid.T @ mass @ rigid
    centre = centre + np.array([inertia[1, 2], -inertia[0, 2]]) / inertia[0, 0]
    rigid = rigid_motions(centre)
    if len(columns) == 3:
        return rigid, centre
    return np.column_stack([rigid, _mean_axis_motions(small, columns, rigid.T @ mass)]), centre


def _mean_axis_motions(small: LinearBlockModel, columns: Any, momentum: Array) -> Array:
    """Return a sparse basis of a block's motions without momentum, from its momenta (3, s).

    Each motion displaces one coordinate, and three that are common to all motions. A face then sees
    few motions unless it has one of the three. These are therefore at the corners of one face: the
    first, so that of two stacked blocks one sees few motions at their joint.
    """
    operator = small.operator
    touched = (abs(operator.opening) + abs(operator.slip))[:, columns]
    joint = operator.points.joint
    first = touched[joint == joint[touched.getnnz(axis=1) > 0][0]]
    # pivots by weight: corners touch half as many points; other faces only where one has too few
    weights = np.where(first.getnnz(axis=0) > 0, 1.0, 1e-3)
    weights /= np.maximum(touched.getnnz(axis=0), 1) ** 2
    scaled = momentum / np.linalg.norm(momentum, axis=1)[:, None] * weights
    order = qr(scaled, mode="r", pivoting=True)[1]
    common, own = np.sort(order[:3]), np.sort(order[3:])
    basis = np.zeros((len(columns), len(own)))
    basis[own, np.arange(len(own))] = 1.0
    basis[common] = -np.linalg.solve(momentum[:, common], momentum[:, own])
    return basis


@dataclass(frozen=True, eq=False)
class Slots:
    """Places of the joint forces and their rates among the model's coordinates."""

    rows: tuple[Any, Any]  # coordinates, and entries of `JointStepForces.force` for them
    pairs: tuple[Any, Any]  # rows and columns of the blocks of their derivatives


def find_slots(sides: FaceKinematics, size: int) -> tuple[Slots, sparse.csr_matrix]:
    """Return slots of all joints, and a matrix with entries where joints couple coordinates."""
    used = np.arange(sides.index.shape[-1]) < sides.size[:, :, None]
    rows, columns = find_rate_pairs(sides)
    coupling = sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), (size, size))
    entries = np.flatnonzero(used)
    return Slots((sides.index.ravel()[entries], entries), (rows, columns)), coupling


def check_small_model(small: Model) -> LinearBlockModel:
    """Return a model of small displacements, or refuse one that cannot have large ones."""
    if not isinstance(small, LinearBlockModel):
        raise InvalidInput(
            f"large displacements do not exist with fidelity '{small.fidelity}': use 'full', which "
            "is the same model, or a lower one"
        )
    if not small.operator.points.is_plain:
        raise InvalidInput(
            "joints with dilatancy or tension do not exist with large displacements: leave them out"
        )
    return small


@dataclass(frozen=True, eq=False)
class RotatingCells(Cells):
    """Cells of blocks in corotational coordinates."""

    # coordinate of the rotation of each point's block, -1 without a rotating frame (m,)
    turns: Any = ()

    @classmethod
    def of(cls, cells: Cells, blocks: dict[int, tuple[range, bool]]) -> "RotatingCells":
        """Return the cells on rotating blocks."""
        turn = {n: span.start + 2 if has_frame else -1 for n, (span, has_frame) in blocks.items()}
        turns = np.array([turn[int(block)] for block in cells.block])
        return cls(
            cells.places, cells.block, cells.polygons, cells.shape_functions, cells.stress, turns
        )

    @cached_property
    def _arms(self) -> tuple[Array, sparse.csr_matrix]:
        """Vectors from the centroids to the points (m, 2), and elastic displacements (2 m, n)."""
        columns = self.shape_functions.tocsc()
        turn = np.unique(self.turns[self.turns >= 0])
        arms = np.zeros_like(self.places)
        # displacements by a unit rotation are the arms, rotated by 90°
        for column in turn:
            motion = columns[:, column].toarray().reshape(-1, 2)
            points = self.turns == column
            arms[points] = np.column_stack([motion[points, 1], -motion[points, 0]])
        rigid = np.zeros(self.shape_functions.shape[1], bool)
        rigid[np.concatenate([turn, turn - 1, turn - 2])] = True
        elastic = (self.shape_functions @ sparse.diags((~rigid).astype(float))).tocsr()
        elastic.eliminate_zeros()
        return arms, elastic

    def select(self, points: Any) -> "RotatingCells":
        """Return some of the points alone, without polygons."""
        shapes = self.shape_functions[np.add.outer(2 * points, (0, 1)).ravel()]
        places, block, turns = self.places[points], self.block[points], self.turns[points]
        return RotatingCells(places, block, (), shapes, None, turns)

    def displacement(self, q: Array) -> Array:
        """Return the displacements of all points (…, m, 2) [m]."""
        arms, elastic = self._arms
        has_frame = self.turns >= 0
        turn, x, y = (np.where(has_frame, q[..., self.turns - k], 0.0) for k in (0, 2, 1))
        strained = np.asarray(elastic @ q.T).T.reshape(*x.shape, 2)
        u, v, (rx, ry) = strained[..., 0], strained[..., 1], arms.T
        # (x, y) + (R - I) r + R u, with cos θ - 1 by the half angle
        c, s, less = np.cos(turn), np.sin(turn), -2.0 * np.sin(0.5 * turn) ** 2
        dx = x + less * rx - s * ry + c * u - s * v
        return np.stack([dx, y + s * rx + less * ry + s * u + c * v], axis=-1)


@dataclass(frozen=True, eq=False)
class RotatingPoint:
    """A point of a block with a rotating frame."""

    first: int  # first coordinate of the block
    arm: Array  # from the centroid of the block (2,) [m]
    shapes: Array  # displacements by the elastic motions (2, s)

    def _local(self, q: Array) -> tuple[Array, Array, Array]:
        """Return the place in the block's frame, the rotation matrix, and its derivative."""
        c, s = np.cos(q[self.first + 2]), np.sin(q[self.first + 2])
        strained = self.shapes @ q[self.first + 3 : self.first + 3 + self.shapes.shape[1]]
        return self.arm + strained, np.array([[c, -s], [s, c]]), np.array([[-s, -c], [c, -s]])

    def displacement(self, q: Array) -> Array:
        """Return the displacement from coordinates (2,) [m]."""
        place, rotation, _ = self._local(q)
        return q[self.first : self.first + 2] + rotation @ place - self.arm

    def gradient(self, q: Array, size: int) -> sparse.csr_matrix:
        """Return the derivative of the displacement (2, n)."""
        place, rotation, rate = self._local(q)
        local = np.column_stack([np.eye(2), rate @ place, rotation @ self.shapes])
        gradient = sparse.lil_matrix((2, size))
        gradient[:, self.first + np.arange(local.shape[1])] = local
        return gradient.tocsr()

    def force_rate(self, q: Array, force: Array, size: int) -> sparse.csr_matrix:
        """Return the derivative of the generalised forces of a force on the point (n, n)."""
        place, rotation, rate = self._local(q)
        turn, elastic = self.first + 2, self.first + 3 + np.arange(self.shapes.shape[1])
        matrix = sparse.lil_matrix((size, size))
        matrix[turn, turn] = -force @ (rotation @ place)
        matrix[turn, elastic] = matrix[elastic, turn] = force @ (rate @ self.shapes)
        return matrix.tocsr()


@dataclass(frozen=True, eq=False)
class FramelessPoint:
    """A point of a block without a rotating frame."""

    rows: sparse.csr_matrix  # its displacement from coordinates (2, n)

    def displacement(self, q: Array) -> Array:
        """Return the displacement from coordinates (2,) [m]."""
        return np.asarray(self.rows @ q)

    def gradient(self, q: Array, size: int) -> sparse.csr_matrix:
        """Return the derivative of the displacement (2, n)."""
        return self.rows

    def force_rate(self, q: Array, force: Array, size: int) -> sparse.csr_matrix:
        """Return the derivative of the generalised forces of a force, zero (n, n)."""
        return sparse.csr_matrix((size, size))
