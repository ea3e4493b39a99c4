"""Blocks that turn in coordinates of their own, and where their joints go among those.

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
from archfem.joints.moving.poses import Sides
from archfem.masonry.rigid_motion import motion_of
from archfem.masonry.softness import yielding_blocks
from archfem.models.jointed import Jointed
from archfem.models.model import Model


@dataclass(frozen=True, eq=False)
class OwnCoordinates:
    """Blocks of a model of small displacements in coordinates of their own.

    A fill keeps the coordinates that it has: it deforms rather than turns, and its displacements
    are taken as small.

    Attributes:
        basis: those coordinates in the model's, (n, n).
        blocks: of each block that moves, by its number in their order, which coordinates are its,
            and whether it has a frame that turns.
        centres: about which blocks turn (n_blocks, 2) [m].
    """

    basis: sparse.csr_matrix
    blocks: dict[int, tuple[range, bool]]
    centres: Array

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
        fill, pieces, order, blocks, count = set(_fill(small)), [], [], {}, 0
        centres = np.array([block.centroid for block in small.structure.blocks], float)
        for number in small.structure.free:
            own = np.flatnonzero(owner == number)
            turns = number not in fill or len(own) == 3
            shapes: Any = sparse.identity(len(own))
            if turns:
                shapes, centres[number] = _own_coordinates(small, own, number)
            blocks[number] = range(count, count + shapes.shape[1]), turns
            count += shapes.shape[1]
            pieces.append(shapes)
            order.append(own)
        stacked = sparse.block_diag(pieces, format="csr")
        return cls(stacked[np.argsort(np.concatenate(order))], blocks, centres)

    @property
    def starts(self) -> Array:
        """Where the coordinates of each block that moves begin, and the number of all (m + 1,)."""
        return np.array([0, *(span.stop for span, _ in self.blocks.values())])


def _fill(small: Jointed) -> list[int]:
    """Blocks that deform, and go with what they lie on rather than turn."""
    blocks = small.structure.blocks
    return [number for number in yielding_blocks(small.structure) if not blocks[number].grain]


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
    number = sides.index  # (j, 2, s)
    used = np.arange(number.shape[-1]) < sides.size[:, :, None]
    flat = number.reshape(len(number), -1)
    known = used.reshape(len(number), -1)
    both = known[:, :, None] & known[:, None, :]
    places = np.flatnonzero(both)
    rows = np.broadcast_to(flat[:, :, None], both.shape)[both]
    columns = np.broadcast_to(flat[:, None, :], both.shape)[both]
    coupled = sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), (size, size))
    own = np.flatnonzero(known)
    return Slots((flat.ravel()[own], own), (rows, columns), places), coupled


def jointed(small: Model) -> Jointed:
    """Return a model of small displacements, if it is one that may have large ones.

    Args:
        small: the model.

    Raises:
        InvalidInput: it has no matrices, or the joints obey a law that is not known for large
            motion.
    """
    if not isinstance(small, Jointed):
        raise InvalidInput(
            f"large displacements are not known on the rung '{small.fidelity}': use 'full', which "
            "is the same model, or a lower one"
        )
    if not small.operator.points.plain:
        raise InvalidInput(
            "joints with dilatancy or tension are not known with large displacements: leave them "
            "out"
        )
    return small
