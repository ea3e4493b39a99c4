"""A screen of failed joints: a quick look at whether they can move at all.

The gaps g of the joints, openings and slips, fit together where every closed loop of blocks
closes: Rᵀ g = 0, with R a basis of the self-stresses, Gᵀ R = 0. A motion that the failed joints
permit is then a point of a small cone,

    R_fᵀ g_f = 0,   g_f >= 0 where a joint moves one way only,   g = 0 in all others,

three equations a loop, whatever the number of blocks (Gordan's alternative: either such a point
exists, or a self-stress that presses every failed joint shut).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import nnls
from scipy.sparse.csgraph import dijkstra

from archfem.arrays import Array
from archfem.limit.blocks import RigidBlocks

SHUT = 1e-5
"""Least misfit of loops, per unit of gap, that counts: well above what the linear programme lets
pass (1e-7), so that it and not this decides close cases."""

ROUND_OFF = 1e-12
"""Entry of an orthonormal basis below which it is nothing: that joint is in no loop."""


@dataclass(frozen=True, eq=False)
class Screen:
    """Self-stresses of rigid blocks, and the joints that must move for some parts to move.

    Attributes:
        blocks: the rigid blocks.
        parts: whose motion is asked for.
    """

    blocks: RigidBlocks
    parts: tuple[str, ...]

    @cached_property
    def stresses(self) -> Array:
        """Orthonormal basis R of the self-stresses (3 n_joints, r) [-]."""
        gaps = self.blocks.kinematics @ sparse.diags(self.blocks.coordinates)
        basis = np.linalg.qr(gaps.toarray(), mode="complete")[0][:, gaps.shape[1] :]
        return np.where(np.abs(basis) > ROUND_OFF, basis, 0.0)

    @cached_property
    def telling(self) -> NDArray[np.bool_]:
        """Joints on a path from the ground to each block of the parts (n_joints,).

        A block whose path does not open or slip anywhere does not move. Paths avoid joints between
        blocks of other parts, whose own motion is not asked for.
        """
        structure = self.blocks.structure
        asked = [not block.fixed and block.part in self.parts for block in structure.blocks]
        ground = len(structure.blocks)
        vertex = [ground if block.fixed else k for k, block in enumerate(structure.blocks)]
        between: dict[tuple[int, int], int] = {}
        weights = sparse.lil_matrix((ground + 1, ground + 1))
        for number, joint in enumerate(structure.joints):
            a, b = (vertex[block] for block in joint.blocks)
            between[a, b] = between[b, a] = number
            near = any(asked[block] for block in joint.blocks)
            weights[a, b] = weights[b, a] = 1.0 if near else float(len(structure.joints))
        before = dijkstra(weights.tocsr(), indices=ground, return_predecessors=True)[1]
        found = np.zeros(len(structure.joints), dtype=bool)
        for block in np.flatnonzero(asked):
            while block != ground:
                found[between[block, before[block]]] = True
                block = before[block]
        return found

    def permit(self, freedoms: Array) -> bool:
        """Tell whether the failed joints may permit a motion of the parts.

        Args:
            freedoms: of every joint (3 n_joints,), as `Verifier.freedoms` gives them.

        Returns:
            False where they permit none; True where they may, which is for the programme of
            `verified_mechanism` to decide.
        """
        either = np.flatnonzero(freedoms == 2.0)
        ways = np.concatenate([np.flatnonzero(freedoms), either])
        sense = np.concatenate([np.sign(freedoms[freedoms != 0.0]), -np.ones(len(either))])
        columns = self.stresses[ways].T * sense
        asked = np.tile(self.telling, 3)
        gaps = [np.where(asked[ways] & (freedoms[ways] != 2.0), 1.0, 0.0)]
        gaps += [
            side * sense * (ways == slip) for slip in either[asked[either]] for side in (1, -1)
        ]
        return any(_closes(columns, gap) for gap in gaps)


def _closes(columns: Array, gap: Array) -> bool:
    """Whether movements x >= 0 with gap·x = 1 close every loop, columns x = 0."""
    if not gap.any():
        return False
    try:
        misfit = nnls(np.vstack([columns, gap]), np.append(np.zeros(len(columns)), 1.0))[1]
    except RuntimeError:  # it gave up
        return True
    return bool(misfit < SHUT)
