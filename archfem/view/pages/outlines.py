"""Points of the blocks that a page draws, and how they move."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.masonry.block import Block
from archfem.masonry.rigid_motion import motion_of
from archfem.masonry.softness import yielding_blocks
from archfem.masonry.structure import Structure
from archfem.models.model import Model

SAGITTA = 2e-4
"""Distance of a chord from its arc that is not seen, relative to the size of the structure."""


@dataclass(frozen=True, eq=False)
class Outlines:
    """Corners of all blocks, one block after another, arcs as chords.

    Attributes:
        structure: whose blocks they are.
    """

    structure: Structure

    @cached_property
    def rings(self) -> list[Array]:
        """Outline of each block (k, 2) [m]."""
        near = SAGITTA * self.structure.size
        return [block.drawn(_chords(block, near)) for block in self.structure.blocks]

    @cached_property
    def points(self) -> Array:
        """All of them (p, 2) [m]."""
        return np.concatenate(self.rings)

    @cached_property
    def block(self) -> NDArray[np.intp]:
        """Number of the block that each point belongs to (p,)."""
        return np.repeat(np.arange(len(self.rings)), [len(ring) for ring in self.rings])

    @cached_property
    def kinds(self) -> list[str]:
        """What each block is drawn as: "support", "soil" or "stone"."""
        soil = yielding_blocks(self.structure)
        return [
            "support" if block.fixed else "soil" if number in soil else "stone"
            for number, block in enumerate(self.structure.blocks)
        ]

    def moved(self, model: Model, fields: Array) -> Array:
        """Return displacements of the points (frames, p, 2) [m].

        Args:
            model: of the structure.
            fields: its coordinates (frames, n).
        """
        follow, still = self._following(model), self._of_supports(model)
        frames = [follow @ model.cells.displacement(q).ravel() for q in fields]
        return np.array(frames).reshape(len(fields), -1, 2) + still

    def _following(self, model: Model) -> sparse.csr_matrix:
        """Matrix from displacements of the cells' points to those of the outlines.

        A point beside an edge turns with it, which is exact where the block is rigid, however far
        it turns.

        Returns:
            (2 p, 2 m), m the number of the cells' points.
        """
        cells, rows = model.cells, []
        still, one = sparse.csr_matrix((2, 2 * len(cells.places))), np.eye(2)
        for point, number in zip(self.points, self.block.tolist(), strict=True):
            if self.structure.blocks[number].fixed:
                rows.append(still)
                continue
            edge, share, away = cells.foot(number, point)
            along = cells.places[edge[1]] - cells.places[edge[0]]
            across = np.array([-along[1], along[0]])
            turning = np.outer(away, along) + np.outer([-away[1], away[0]], across)
            turned = turning / float(along @ along)
            entries = np.hstack([(1.0 - share) * one - turned, share * one + turned])
            columns = np.repeat(2 * edge, 2) + np.tile([0, 1], 2)
            place = np.repeat([0, 1], 4), np.tile(columns, 2)
            rows.append(sparse.csr_matrix((entries.ravel(), place), still.shape))
        return sparse.vstack(rows, format="csr")

    def _of_supports(self, model: Model) -> Array:
        """Displacements of the points of supports that have moved (p, 2) [m]; 0 of the others."""
        moved = np.zeros_like(self.points)
        for number, block in enumerate(self.structure.blocks):
            if block.fixed:
                own = self.block == number
                motion = motion_of(self.points[own], block.centroid)
                moved[own] = motion @ model.supports[number]
        return moved


def _chords(block: Block, near: float) -> int:
    """Chords of each arc of a block that do not leave it farther than that; 1 of a polygon."""
    if block.centre is None:
        return 1
    arms = block.points - np.array(block.centre)
    radius = float(np.linalg.norm(arms, axis=1).max())
    corners = [arms[side : side + 2] for side in (0, 2)]
    angle = max(float(np.arccos(np.clip(_cosine(*pair), -1.0, 1.0))) for pair in corners)
    return max(1, int(np.ceil(angle / np.sqrt(8.0 * near / radius))))


def _cosine(one: Array, other: Array) -> float:
    """Cosine of the angle between two arms."""
    return float(one @ other / (np.linalg.norm(one) * np.linalg.norm(other)))
