"""Rigid blocks in equilibrium: forces at the ends of the joints, and their balance.

Each joint carries a compression at its intrados end, F_i, one at its extrados end, F_e, and a
shear force V. They are as good as resultants,

    N = F_i + F_e,   M = (F_e - F_i) h/2,

and turn |M| <= N h/2 into F_i, F_e >= 0. Virtual work makes their balance with the loads f the
transpose of the opening of the two ends and of the slip in terms of the motions of the blocks:
-G_oᵀ F + G_sᵀ V = f. Livesley, Int. J. Numer. Meth. Eng. 12 (1978) 1853-1871.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.quadrature import Quadrature
from archfem.joints.rigid import rigid_joints
from archfem.masonry.actions import BodyForce, PointLoad
from archfem.masonry.rigid_motion import first_coordinate, motion_of
from archfem.masonry.structure import Structure


def rigid_load(structure: Structure, actions: Sequence[BodyForce | PointLoad]) -> Array:
    """Return the generalised forces of actions on the free blocks (3 n_free,) [N, N, N m].

    Args:
        structure: whose blocks are loaded.
        actions: body forces in multiples of g, point loads in N; they add up.

    Raises:
        InvalidInput: a point load misses the structure.
    """
    start = first_coordinate(structure)
    load = np.zeros(3 * len(start))
    for action in actions:
        if isinstance(action, BodyForce):
            for number, first in start.items():
                block = structure.blocks[number]
                weight = block.area * block.material.unit_weight * structure.width
                load[first : first + 2] += weight * np.array([action.horizontal, action.vertical])
        else:
            number, point = action.place(structure)
            motion = motion_of(point[None, :], structure.blocks[number].centroid)[0]
            load[start[number] : start[number] + 3] += np.array(action.force) @ motion
    return load


@dataclass(frozen=True, eq=False)
class RigidBlocks:
    """The blocks of a structure, rigid, with forces at the two ends of each joint.

    Attributes:
        structure: whose blocks they are.
    """

    structure: Structure

    @property
    def force(self) -> float:
        """Unit of force in the programme: the mean weight of a free block [N]."""
        return self.structure.weight / len(self.structure.free)

    @cached_property
    def length(self) -> float:
        """Unit of length in the programme: the mean depth of a joint [m]."""
        return float(self.structure.depths.mean())

    @cached_property
    def coordinates(self) -> Array:
        """Units of the block coordinates in the programme (3 n_free,) [m, m, rad]."""
        return np.tile([1.0, 1.0, 1.0 / self.length], len(self.structure.free))

    @cached_property
    def cohesion(self) -> Array:
        """Shear that cohesion carries, c A of each whole joint (n_joints,) [mean block weights]."""
        return self.structure.cohesion / self.force

    @cached_property
    def kinematics(self) -> sparse.csr_matrix:
        """Openings of all intrados ends, of all extrados ends, and slips, of the free blocks.

        Shape (3 n_joints, 3 n_free) [-, -, m].
        """
        ends = rigid_joints(self.structure, 1, Quadrature("nodal"))
        rows = [ends.opening[0::2], ends.opening[1::2], ends.slip[0::2]]
        return sparse.vstack(rows, format="csr")

    def gaps(self, motion: Array) -> Array:
        """Openings at the intrados and the extrados, and slip, of a motion of all blocks.

        Args:
            motion: of the centroid of every block, fixed ones too (n_blocks, 3) [m, m, rad].

        Returns:
            (3, n_joints) [m].
        """
        structure, jump = self.structure, np.zeros((len(self.structure.joints), 2, 2))
        centroids = np.array([block.centroid for block in structure.blocks])
        for side, sign in enumerate((-1.0, 1.0)):
            block = structure.pairs[:, side]
            x, y = np.moveaxis(structure.ends - centroids[block, None], -1, 0)
            u, v, turn = motion[block].T[:, :, None]
            jump += sign * np.stack([u - turn * y, v + turn * x], axis=-1)
        intrados, extrados = np.einsum("kei,ki->ek", jump, structure.normals)
        slip = np.einsum("ki,ki->k", jump[:, 0], structure.tangents)
        return np.stack([intrados, extrados, slip])

    @cached_property
    def balance(self) -> sparse.csr_matrix:
        """Balance of each free block, in the programme's units (3 n_free, 3 n_joints)."""
        sign = np.repeat([-1.0, -1.0, 1.0], len(self.structure.depths))
        return sparse.diags(self.coordinates) @ self.kinematics.T @ sparse.diags(sign)

    def scaled(self, load: Array) -> Array:
        """Return generalised forces in the programme's units (3 n_free,).

        Args:
            load: as made by `rigid_load` (3 n_free,) [N, N, N m].
        """
        return self.coordinates * load / self.force

    def motion(self, coordinates: Array) -> Array:
        """Return the motion of all blocks, zero for fixed ones (n_blocks, 3) [m, m, rad].

        Args:
            coordinates: multipliers of the balance (3 n_free,), in the programme's units.
        """
        motion = np.zeros((len(self.structure.blocks), 3))
        motion[list(self.structure.free)] = (self.coordinates * coordinates).reshape(-1, 3)
        return motion

    def reach(self, motion: Array) -> float:
        """Return the largest displacement of a corner of any block [m].

        Args:
            motion: of the centroid of every block (n_blocks, 3) [m, m, rad].
        """
        return max(
            float(np.linalg.norm(motion_of(block.drawn(), block.centroid) @ own, axis=1).max())
            for block, own in zip(self.structure.blocks, motion, strict=True)
        )

    def resultants(self, forces: Array) -> Array:
        """Return N, V, M of every joint (n_joints, 3) [N, N, N m].

        Args:
            forces: F_i of all joints, then F_e, then V (3 n_joints,) [mean block weights].
        """
        intrados, extrados, shear = self.force * forces.reshape(3, -1)
        moment = (extrados - intrados) * self.structure.depths / 2.0
        return np.stack([intrados + extrados, shear, moment], axis=1)
