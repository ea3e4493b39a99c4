"""Partly built structures: blocks that are not yet placed, and blocks on centring."""

from collections.abc import Iterable

import numpy as np
from scipy import sparse

from archfem._typing import Array, Flags
from archfem.masonry.loads import Action
from archfem.models.linear_blocks import LinearBlockModel


class PartialStructure(LinearBlockModel):
    """A model of the part of a structure that stands, in the coordinates of the whole.

    Joints to missing blocks carry nothing. A block is placed without stress onto the displaced
    structure: the gaps and slips of its joints at that time count as zero. Coordinates of missing
    blocks, and of blocks on centring, are held at zero, without forces or loads.
    """

    def __init__(self, whole: LinearBlockModel) -> None:
        vars(self).update(whole.__getstate__())
        self.whole = whole  # model of all blocks, built at once
        # which blocks stand, fixed ones among them, and which are held by centring (n_blocks,)
        self.standing: Flags = np.array([block.fixed for block in whole.structure.blocks])
        self.centred: Flags = np.zeros_like(self.standing)
        self._last = None
        self._rows = np.repeat(np.arange(whole.size), np.diff(whole.mass.indptr))
        # stiffness of held coordinates, of the order of the others' for the condition of matrices
        self._held_stiffness = float(np.mean(whole.closed_tangent().diagonal()))

    def placed(
        self, blocks: Iterable[int], q: Array, *, centring: bool = False
    ) -> "PartialStructure":
        """Return the model with further blocks, placed on the structure displaced by q."""
        new = np.zeros_like(self.standing)
        new[list(blocks)] = True
        standing, centred = self.standing | new, self.centred | (new & centring)
        other = self.copy_with(standing=standing, centred=centred)
        # points that begin to act are closed and without slip in the present displacement
        begin = other._active_points & ~self._active_points
        gaps = np.stack([self.operator.openings(q), self.operator.slips(q)])
        initial = np.zeros_like(gaps) if self.initial_gaps is None else self.initial_gaps
        return other.with_initial_gaps(np.where(begin, initial - gaps, initial))

    def struck(self) -> "PartialStructure":
        """Return the model without its centring."""
        return self.copy_with(centred=np.zeros_like(self.centred), _last=None)

    def finished(self) -> LinearBlockModel:
        """Return the model of all blocks with these initial gaps and this memory."""
        return self.whole.with_support_motion(self.support_motion).with_joint_state(self)

    @property
    def _active_points(self) -> Flags:
        """Which joint points lie between two standing blocks (p,)."""
        pairs = self.structure.pairs[self.operator.points.joint]
        return self.standing[pairs].all(axis=1)

    @property
    def _free(self) -> Flags:
        """Which coordinates belong to blocks that stand without centring (n,)."""
        return (self.standing & ~self.centred)[self.cells.coordinate_owner]

    def assemble_tangent(self, block_factor: float, stiffness: Array) -> sparse.csr_matrix:
        """Return the tangent of the placed blocks; held coordinates have their own stiffness."""
        active, free = self._active_points, self._free
        pairs = active[self.operator.law.coupling_pairs[0]]
        parts = [pairs, active, *([pairs] if self.operator.slides else [])]
        joints = np.where(np.concatenate(parts), stiffness, 0.0)
        matrix = super().assemble_tangent(block_factor, joints)
        rows, columns = self._rows, matrix.indices
        held = np.where((rows == columns) & ~free[rows], self._held_stiffness, 0.0)
        matrix.data = np.where(free[rows] & free[columns], matrix.data, held)
        return matrix

    def force(self, q: Array) -> Array:
        """Return the internal forces of the placed blocks (n,)."""
        of_joints = self.operator.generalised_force(*self._point_forces(q))
        forces = self.block_stiffness @ q + of_joints
        return np.where(self._free, forces, self._held_stiffness * q)

    def _point_forces(self, q: Array) -> tuple[Array, Array]:
        """Return normal and shear forces at the points between standing blocks, each (p,) [N]."""
        active = self._active_points
        normal, shear = self.operator.point_forces(q)
        return np.where(active, normal, 0.0), np.where(active, shear, 0.0)

    def energy(self, q: Array) -> float:
        """Return the potential energy of the placed blocks without further slip [J]."""
        in_joints = self.operator.point_energies(q)[self._active_points]
        return 0.5 * float(q @ (self.block_stiffness @ q)) + float(in_joints.sum())

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, zero next to missing blocks (n_joints, 3)."""
        return self.operator.sum_resultants(*self._point_forces(q))

    def updated_memory(self, q: Array) -> Array:
        """Return the joint memory once the model is at q, as `memory`."""
        memory = super().updated_memory(q)
        return np.where(np.resize(self._active_points, len(memory)), memory, 0.0)

    def load(self, action: Action, q: Array | None = None) -> Array:
        """Return the generalised forces of an action on blocks that stand without centring (n,)."""
        return np.where(self._free, super().load(action), 0.0)
