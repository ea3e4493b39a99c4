"""Blocks that turn in coordinates of their own, and the joints between them.

The coordinates of a block are the displacement of its centroid, its turn, and its elastic modes in
the frame that turns with it. Those neither move the centroid nor turn the block on the mean.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.joints.faces import face_matrix
from archfem.joints.facets import Facets
from archfem.joints.moving.moved import Moved
from archfem.joints.moving.overlap import Faces
from archfem.joints.moving.poses import Sides
from archfem.masonry.rigid_motion import motion_of
from archfem.masonry.structure import Structure
from archfem.models.jointed import Jointed
from archfem.models.model import Model

PLANE = ("rigid", "faces")
"""Rungs whose faces stay plane."""


@dataclass(frozen=True, eq=False)
class OwnCoordinates:
    """Blocks of a model of small displacements in coordinates of their own.

    Attributes:
        basis: those coordinates in the model's, (n, n).
        starts: first coordinate of each block that moves, by its number.
        centres: about which blocks turn (n_blocks, 2) [m].
        size: number of coordinates.
    """

    basis: sparse.csr_matrix
    starts: dict[int, int]
    centres: Array
    size: int

    @classmethod
    def of(cls, small: Jointed) -> "OwnCoordinates":
        """Return the coordinates of the blocks of a model.

        Args:
            small: a model of small displacements.
        """
        lift = small.cells.lift.tocoo()
        moving = lift.data != 0.0
        owner = np.zeros(small.size, dtype=np.intp)
        owner[lift.col[moving]] = small.cells.block[lift.row[moving] // 2]
        starts, pieces, order, count = {}, [], [], 0
        centres = np.array([block.centroid for block in small.structure.blocks], float)
        for number in small.structure.free:
            own = np.flatnonzero(owner == number)
            shapes, centres[number] = _own_coordinates(small, own, number)
            starts[number] = count
            count += shapes.shape[1]
            pieces.append(shapes)
            order.append(own)
        stacked = sparse.block_diag(pieces, format="csr")
        return cls(stacked[np.argsort(np.concatenate(order))], starts, centres, count)

    def joints(self, model: Jointed) -> Moved:
        """Return the joints between the blocks.

        Args:
            model: in these coordinates.
        """
        normals = model.structure.normals
        angle = np.arctan2(normals[:, 1], normals[:, 0])
        return Moved(self._sides(model), _faces(model), angle, _hands(model.structure))

    def _sides(self, model: Jointed) -> Sides:
        """The faces of the blocks on both sides of the joints."""
        structure, joints = model.structure, len(model.structure.joints)
        ends = np.append(sorted(self.starts.values()), self.size)
        sizes = {b: int(ends[np.searchsorted(ends, s) + 1] - s) for b, s in self.starts.items()}
        start, size = np.full((joints, 2), -1), np.zeros((joints, 2), int)
        arm, shapes = np.zeros((joints, 2, 2)), np.zeros((joints, 2, 3, max(sizes.values()) - 3))
        matrix, hands = face_matrix(model.operator)[0].tocsr(), _hands(structure)
        for joint, pair in enumerate(structure.pairs):
            axes = np.column_stack([structure.normals[joint], structure.tangents[joint]])
            rows = matrix[[joint, 2 * joints + joint, joints + joint]]  # gap, slip, turn
            for side, block in enumerate(map(int, pair)):
                arm[joint, side] = structure.middles[joint] - self.centres[block]
                if block not in self.starts:
                    continue
                first, number = self.starts[block], sizes[block]
                start[joint, side], size[joint, side] = first, number
                moves = (2 * side - 1) * rows[:, first + 3 : first + number].toarray()
                shapes[joint, side, :2, : number - 3] = axes @ moves[:2]
                shapes[joint, side, 2, : number - 3] = hands[joint] * moves[2]
        return Sides(start, size, arm, shapes, held_poses(structure, model.supports))


def _hands(structure: Structure) -> Array:
    """Whether the extrados is on the left of each joint's normal, 1, or on the right, -1 (j,)."""
    (nx, ny), (tx, ty) = structure.normals.T, structure.tangents.T
    found: Array = np.where(nx * ty - ny * tx > 0.0, 1.0, -1.0)
    return found


def _own_coordinates(small: Jointed, own: Any, number: int) -> tuple[Array, Array]:
    """Motions of a block in the model's coordinates: rigid ones, then modes; and its centre."""
    mass = small.mass[own][:, own].toarray()
    stiffness = small.blocks[own][:, own].toarray()
    cells = small.cells
    nodes = np.flatnonzero(cells.block == number)
    rows = (2 * nodes[:, None] + np.arange(2)).ravel()
    lift = small.cells.lift[rows][:, own].toarray()

    def about(centre: Array) -> Array:
        motion = motion_of(cells.places[nodes], centre).reshape(-1, 3)
        found: Array = np.linalg.lstsq(lift, motion, rcond=None)[0]
        return found

    centre = np.array(small.structure.blocks[number].centroid)
    rigid = about(centre)
    inertia = rigid.T @ mass @ rigid
    centre = centre + np.array([inertia[1, 2], -inertia[0, 2]]) / inertia[0, 0]
    rigid = about(centre)
    if len(own) == 3:
        return rigid, centre
    modes = eigh(stiffness, mass)[1]
    return np.column_stack([rigid, modes[:, 3:]]), centre


def _faces(model: Jointed) -> Faces:
    """What the law of the joints needs."""
    structure, points = model.structure, model.operator.points
    contacts = [joint.contact for joint in structure.joints]
    depth, facets = structure.depths, isinstance(model.operator.law, Facets)
    share = points.weight / (structure.width * depth[points.joint])
    return Faces(
        depth,
        structure.width * np.array([each.normal_stiffness for each in contacts]),
        np.array([each.coefficient for each in contacts]),
        np.searchsorted(points.joint, np.arange(points.count + 1)),
        points.arm / depth[points.joint],
        np.repeat(share[0::2] + share[1::2], 2) if facets else share,
        points.shear,
        facets,
        structure.width * np.array([each.cohesion for each in contacts]),
    )


def held_poses(structure: Structure, supports: Array) -> Array:
    """Return poses of the faces of blocks that do not move by themselves (j, 2, 3) [m, m, rad].

    Args:
        structure: of the joints.
        supports: motions of the fixed blocks (n_blocks, 3) [m, m, rad].
    """
    centres = np.array([block.centroid for block in structure.blocks])
    held = np.zeros((len(structure.joints), 2, 3))
    for joint, pair in enumerate(structure.pairs):
        for side, block in enumerate(pair):
            x, y, turn = supports[block]
            rx, ry = structure.middles[joint] - centres[block]
            less = -2.0 * np.sin(0.5 * turn) ** 2
            held[joint, side] = (
                x + less * rx - np.sin(turn) * ry,
                y + np.sin(turn) * rx + less * ry,
                turn,
            )
    return held


@dataclass(frozen=True, eq=False)
class Slots:
    """Where what joints do goes among the model's coordinates.

    Attributes:
        rows: coordinates of joints' forces, and where those are among all of `Answer.force`.
        pairs: rows and columns of the entries of joints' stiffness.
        places: where those are among all of `Answer.rate`.
    """

    rows: tuple[Any, Any]
    pairs: tuple[Any, Any]
    places: Any


def slots_of(sides: Sides, size: int) -> tuple[Slots, sparse.csr_matrix]:
    """Return slots of all joints, and a matrix with entries where joints couple coordinates (n, n).

    Args:
        sides: of the joints.
        size: number of coordinates.
    """
    most = 3 + sides.shapes.shape[-1]
    local = np.arange(most)
    number = sides.start[:, :, None] + local  # (j, 2, s)
    used = (sides.start[:, :, None] >= 0) & (local < sides.size[:, :, None])
    flat = number.reshape(len(number), -1)
    known = used.reshape(len(number), -1)
    both = known[:, :, None] & known[:, None, :]
    places = np.flatnonzero(both)
    rows = np.broadcast_to(flat[:, :, None], both.shape)[both]
    columns = np.broadcast_to(flat[:, None, :], both.shape)[both]
    coupled = sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), (size, size))
    own = np.flatnonzero(known)
    return Slots((flat.ravel()[own], own), (rows, columns), places), coupled


def plane(small: Model) -> Jointed:
    """Return a model of small displacements, if it is one that may have large ones.

    Args:
        small: the model.

    Raises:
        InvalidInput: faces bend, or the joints obey a law that is not known for large motion.
    """
    if not isinstance(small, Jointed) or small.fidelity not in PLANE:
        raise InvalidInput(
            f"large displacements are not known on the rung '{small.fidelity}': use one of {PLANE}"
        )
    points = small.operator.points
    if not points.plain:
        raise InvalidInput(
            "joints with dilatancy or tension are not known with large displacements: leave them "
            "out"
        )
    return small
