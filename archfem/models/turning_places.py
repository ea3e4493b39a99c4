"""How points of blocks move that turn as far as they like: for loads and pictures."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.models.cells import Cells


@dataclass(frozen=True, eq=False)
class TurningCells(Cells):
    """Cells of blocks that turn.

    Attributes:
        turns: coordinate of the turn of the block that each point belongs to, -1 where it has no
            frame that turns (m,).
    """

    turns: Any = ()

    @classmethod
    def of(cls, cells: Cells, blocks: dict[int, tuple[range, bool]]) -> "TurningCells":
        """Return the same cells on blocks that turn.

        Args:
            cells: whose `lift` holds for small displacements.
            blocks: coordinates of each block that moves, and whether it has a frame that turns.
        """
        of_block = {
            number: span.start + 2 if turns else -1 for number, (span, turns) in blocks.items()
        }
        turns = np.array([of_block[int(block)] for block in cells.block])
        return cls(cells.places, cells.block, cells.polygons, cells.lift, cells.stress, turns)

    @cached_property
    def _about(self) -> tuple[Array, sparse.csr_matrix]:
        """Arms of the points from the centroids (m, 2), and their elastic displacements."""
        columns = self.lift.tocsc()
        turn = np.unique(self.turns[self.turns >= 0])
        arms = np.zeros_like(self.places)
        for column in turn:
            motion = columns[:, column].toarray().reshape(-1, 2)
            own = self.turns == column
            arms[own] = np.column_stack([motion[own, 1], -motion[own, 0]])
        rigid = np.zeros(self.lift.shape[1], bool)
        rigid[np.concatenate([turn, turn - 1, turn - 2])] = True
        elastic = (self.lift @ sparse.diags((~rigid).astype(float))).tocsr()
        elastic.eliminate_zeros()
        return arms, elastic

    def middles(self, blocks: int) -> "TurningCells":
        """Return one point for each block, which moves as its points do on the mean.

        Args:
            blocks: their number.
        """
        share = 1.0 / np.bincount(self.block)[self.block]
        place = (self.block, np.arange(len(share)))
        mean = sparse.csr_matrix((share, place), (blocks, len(share)))
        turns = np.full(blocks, -1)
        turns[self.block] = self.turns
        lift = (sparse.kron(mean, sparse.identity(2)) @ self.lift).tocsr()
        return TurningCells(mean @ self.places, np.arange(blocks), (), lift, None, turns)

    def displacement(self, q: Array) -> Array:
        """Return the displacement of every point (…, m, 2) [m].

        Args:
            q: coordinates of one state or of many (…, n).
        """
        arms, elastic = self._about
        framed = self.turns >= 0
        turn, x, y = (np.where(framed, q[..., self.turns - k], 0.0) for k in (0, 2, 1))
        strained = np.asarray(elastic @ q.T).T.reshape(*x.shape, 2)
        u, v, (rx, ry) = strained[..., 0], strained[..., 1], arms.T
        c, s, less = np.cos(turn), np.sin(turn), -2.0 * np.sin(0.5 * turn) ** 2
        across = x + less * rx - s * ry + c * u - s * v
        return np.stack([across, y + s * rx + less * ry + s * u + c * v], axis=-1)


@dataclass(frozen=True, eq=False)
class TurningPoint:
    """A point of a block that turns.

    Attributes:
        first: first coordinate of the block.
        arm: from its centroid (2,) [m].
        shapes: displacements there of its modes (2, s).
    """

    first: int
    arm: Array
    shapes: Array

    def _turned(self, q: Array) -> tuple[Array, Array, Array]:
        """Where it is in the block, the block's rotation, and the derivative of that."""
        c, s = np.cos(q[self.first + 2]), np.sin(q[self.first + 2])
        strained = self.shapes @ q[self.first + 3 : self.first + 3 + self.shapes.shape[1]]
        return self.arm + strained, np.array([[c, -s], [s, c]]), np.array([[-s, -c], [c, -s]])

    def displacement(self, q: Array) -> Array:
        """Displacement from coordinates (2,) [m]."""
        place, turn, _ = self._turned(q)
        return q[self.first : self.first + 2] + turn @ place - self.arm

    def gradient(self, q: Array, size: int) -> sparse.csr_matrix:
        """Its derivative (2, n)."""
        place, turn, rate = self._turned(q)
        local = np.column_stack([np.eye(2), rate @ place, turn @ self.shapes])
        columns = self.first + np.arange(local.shape[1])
        found = sparse.lil_matrix((2, size))
        found[:, columns] = local
        return found.tocsr()

    def bend(self, q: Array, force: Array, size: int) -> sparse.csr_matrix:
        """Derivative of the generalised forces of a force (n, n)."""
        place, turn, rate = self._turned(q)
        theta, modes = self.first + 2, self.first + 3 + np.arange(self.shapes.shape[1])
        found = sparse.lil_matrix((size, size))
        found[theta, theta] = -force @ (turn @ place)
        found[theta, modes] = found[modes, theta] = force @ (rate @ self.shapes)
        return found.tocsr()


@dataclass(frozen=True, eq=False)
class StillPoint:
    """A point of a block that has no frame that turns.

    Attributes:
        rows: its displacement from coordinates (2, n).
    """

    rows: sparse.csr_matrix

    def displacement(self, q: Array) -> Array:
        """Displacement from coordinates (2,) [m]."""
        return np.asarray(self.rows @ q)

    def gradient(self, q: Array, size: int) -> sparse.csr_matrix:
        """Its derivative (2, n)."""
        return self.rows

    def bend(self, q: Array, force: Array, size: int) -> sparse.csr_matrix:
        """Derivative of the generalised forces of a force: none (n, n)."""
        return sparse.csr_matrix((size, size))
