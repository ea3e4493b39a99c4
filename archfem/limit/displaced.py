"""Rigid blocks that have moved far: where they touch now, and what moves them further.

Each joint is what it was on either block, and the two need not coincide any more. An end is open by
the distance of the higher block's corner from the lower block's face, and slip is counted at the
end that is nearer to contact. Openings and slip are those of the present places; their rates are
exact for corners that touch, so that the forces of hinges act where the hinges are.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.limit.blocks import RigidBlocks
from archfem.masonry.rigid_motion import motion_of


@dataclass(frozen=True, eq=False)
class DisplacedBlocks(RigidBlocks):
    """The blocks of a structure, rigid, after displacements and rotations of any size.

    Attributes:
        displacement: of every block's centroid along x and y, and anticlockwise rotation
            (n_blocks, 3) [m, m, rad].
    """

    displacement: Array

    def moved(self, motion: Array) -> "DisplacedBlocks":
        """Return the blocks after a further motion.

        Args:
            motion: of every block (n_blocks, 3) [m, m, rad].
        """
        return DisplacedBlocks(self.structure, self.displacement + motion)

    def carried(self, points: Array, block: int) -> Array:
        """Return where points that move with a block are now (p, 2) [m].

        Args:
            points: where they were (p, 2) [m].
            block: number of the block.
        """
        centroid, (x, y, turn) = self.structure.blocks[block].centroid, self.displacement[block]
        arm = (points - centroid) @ _rotation(turn).T
        places: Array = centroid + arm + [x, y]
        return places

    @cached_property
    def faces(self) -> Array:
        """Ends of the joints on the lower and on the higher blocks (2, n_joints, 2, 2) [m]."""
        joints = self.structure.joints
        return np.array(
            [
                [self.carried(joint.ends, joint.lower) for joint in joints],
                [self.carried(joint.ends, joint.higher) for joint in joints],
            ]
        )

    @cached_property
    def axes(self) -> Array:
        """Normals and tangents of the lower blocks' faces (2, n_joints, 2)."""
        turns = [_rotation(self.displacement[joint.lower, 2]) for joint in self.structure.joints]
        fixed = np.stack([self.structure.normals, self.structure.tangents])
        axes: Array = np.einsum("jab,kjb->kja", np.array(turns), fixed)
        return axes

    @cached_property
    def opened(self) -> Array:
        """Openings at the intrados and the extrados, and slip (3, n_joints) [m]."""
        apart = self.faces[1] - self.faces[0]
        openings, slips = np.einsum("jea,kja->kej", apart, self.axes)
        nearer = np.argmin(openings, axis=0)
        return np.vstack([openings, slips[nearer, np.arange(len(nearer))]])

    @cached_property
    def _rates(self) -> sparse.csr_matrix:
        """Rates of `opened`, row by row, with motions of all blocks (3 n_joints, 3 n_blocks)."""
        joints, nearer = self.structure.joints, np.argmin(self.opened[:2], axis=0)
        rates = np.zeros((3, len(joints), len(self.structure.blocks), 3))
        for number, joint in enumerate(joints):
            normal, tangent = self.axes[:, number]
            places = self.faces[1, number]
            for block, sign in ((joint.higher, 1.0), (joint.lower, -1.0)):
                centre = self.structure.blocks[block].centroid + self.displacement[block, :2]
                points = sign * motion_of(places, centre)
                rates[:2, number, block] = np.einsum("a,eac->ec", normal, points)
                rates[2, number, block] = tangent @ points[nearer[number]]
        return sparse.csr_matrix(rates.reshape(3 * len(joints), -1))

    @cached_property
    def kinematics(self) -> sparse.csr_matrix:
        """Rates of openings and slips with motions of the free blocks (3 n_joints, 3 n_free)."""
        free = np.array(self.structure.free)
        columns: sparse.csr_matrix = self._rates[:, (3 * free[:, None] + np.arange(3)).ravel()]
        return columns

    def gaps(self, motion: Array) -> Array:
        """Rates of openings and slip, as of `RigidBlocks`, at the present places.

        Args:
            motion: of every block (n_blocks, 3) [m, m, rad].

        Returns:
            (3, n_joints) [m].
        """
        gaps: Array = (self._rates @ motion.ravel()).reshape(3, -1)
        return gaps


def _rotation(turn: float) -> Array:
    """Matrix that turns vectors anticlockwise (2, 2)."""
    return np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
