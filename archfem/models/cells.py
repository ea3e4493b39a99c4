"""How points of the blocks move with a model's coordinates: for loads, pictures and stress."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array


@dataclass(frozen=True, eq=False)
class Cells:
    """Polygons that cover the blocks, and how they move.

    Attributes:
        places: points at rest (m, 2) [m].
        block: number of the block each point belongs to (m,).
        polygons: each the numbers of its corners in order.
        lift: displacements of the points, x and y in turn, from coordinates (2 m, n).
        stress: mean stress of each polygon, (σ_xx, σ_yy, σ_xy) in turn, from coordinates
            (3 n_polygons, n) [Pa]; None where blocks are rigid.
    """

    places: Array
    block: NDArray[np.intp]
    polygons: tuple[NDArray[np.intp], ...]
    lift: sparse.csr_matrix
    stress: sparse.csr_matrix | None = None

    @cached_property
    def owner(self) -> NDArray[np.intp]:
        """Block of each polygon (n_polygons,)."""
        return self.block[[cell[0] for cell in self.polygons]]

    def displacement(self, q: Array) -> Array:
        """Return the displacement of every point (m, 2) [m].

        Args:
            q: coordinates (n,).
        """
        moved: Array = self.lift @ q
        return moved.reshape(-1, 2)

    @cached_property
    def _edges(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Edges of all polygons (e, 2) and their blocks (e,)."""
        edges = np.concatenate([np.column_stack([c, np.roll(c, -1)]) for c in self.polygons])
        return edges, np.repeat(self.owner, [len(cell) for cell in self.polygons])

    @cached_property
    def rims(self) -> NDArray[np.intp]:
        """Edges around the blocks, those of one polygon only, with its sense (e, 2)."""
        edges, _ = self._edges
        _, first, count = np.unique(
            np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
        )
        single: NDArray[np.intp] = edges[first[count == 1]]
        return single

    def at(self, block: int, point: Array) -> sparse.csr_matrix:
        """Return the displacement of a point on the surface of a block, from coordinates.

        Taken from the nearest edge: linearly between its ends, and beside it, as where chords
        stand for an arc, turning with it, so that a rigid motion is exact.

        Args:
            block: number of the block.
            point: on its surface or near it (2,) [m].

        Returns:
            (2, n).
        """
        edge, share, beside = self.foot(block, point)
        ends = [self.lift[2 * node : 2 * node + 2] for node in edge]
        foot = (1.0 - share) * ends[0] + share * ends[1]
        along = self.places[edge[1]] - self.places[edge[0]]
        turn = sparse.csr_matrix([[-along[1], along[0]]]) @ (ends[1] - ends[0]) / (along @ along)
        return (foot + sparse.csr_matrix([[-beside[1]], [beside[0]]]) @ turn).tocsr()

    def foot(self, block: int, point: Array) -> tuple[NDArray[np.intp], float, Array]:
        """Return the edge of a block nearest to a point, and where the point is from it.

        Args:
            block: number of the block.
            point: on its surface or near it (2,) [m].

        Returns:
            Numbers of the edge's ends (2,); how far along it the nearest place is, 0 to 1; and from
            there to the point (2,) [m].
        """
        edges, owner = self._edges
        edges = edges[owner == block]
        start, step = self.places[edges[:, 0]], np.diff(self.places[edges], axis=1)[:, 0]
        share = np.sum((point - start) * step, axis=1) / np.sum(step * step, axis=1)
        share = np.clip(share, 0.0, 1.0)
        distance = np.linalg.norm(start + share[:, None] * step - point, axis=1)
        nearest = int(np.argmin(distance))
        beside = point - start[nearest] - share[nearest] * step[nearest]
        return edges[nearest], float(share[nearest]), beside
