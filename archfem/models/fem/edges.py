"""Edges of blocks that touch: around each block, and shared where two blocks touch."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from archfem.arrays import Array
from archfem.masonry.structure import TOUCHING, Structure

Numbers = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges between the points at which outlines bend or meet; touching blocks share them.

    Attributes:
        structure: whose blocks they bound.
        points: where edges end (n, 2) [m].
        ends: their two points, the lower number first (m, 2).
        boundaries: points around each block, anticlockwise.
        around: edges around each block; the k-th starts at the k-th point of the boundary.
    """

    structure: Structure
    points: Array
    ends: Numbers
    boundaries: tuple[Numbers, ...]
    around: tuple[Numbers, ...]

    @cached_property
    def lengths(self) -> Array:
        """Lengths of the edges (m,) [m]."""
        start, end = self.points[self.ends.T]
        lengths: Array = np.linalg.norm(end - start, axis=1)
        return lengths

    @cached_property
    def structured(self) -> tuple[int, ...]:
        """Numbers of the blocks that are meshed from side to side."""
        blocks = self.structure.blocks
        return tuple(number for number, block in enumerate(blocks) if block.corners is not None)

    @cached_property
    def unstructured(self) -> tuple[int, ...]:
        """Numbers of the blocks that are meshed freely."""
        return tuple(n for n in range(len(self.boundaries)) if n not in set(self.structured))

    def corners(self, number: int) -> Numbers:
        """Return the points at the four corners of a structured block (4,).

        Args:
            number: of the block.
        """
        block, boundary = self.structure.blocks[number], self.boundaries[number]
        corners = block.points[list(block.corners or ())]
        away = np.linalg.norm(self.points[boundary] - corners[:, None], axis=2)
        nearest: Numbers = boundary[np.argmin(away, axis=1)]
        return nearest

    @cached_property
    def sides(self) -> dict[int, list[Numbers]]:
        """Edges on each of the four sides of each structured block, by its number."""
        return {number: self._sides(number) for number in self.structured}

    def _sides(self, number: int) -> list[Numbers]:
        boundary, around = self.boundaries[number], self.around[number]
        starts = [int(np.flatnonzero(boundary == point)[0]) for point in self.corners(number)]
        turned = np.roll(around, -starts[0])
        stops = [(start - starts[0]) % len(boundary) for start in starts] + [len(boundary)]
        return [turned[a:b] for a, b in pairwise(stops)]

    @cached_property
    def joints(self) -> tuple[Numbers, ...]:
        """Edges on each joint: those that both its blocks have, between its ends."""
        near = TOUCHING * self.structure.size
        found = []
        for joint in self.structure.joints:
            shared = np.intersect1d(self.around[joint.lower], self.around[joint.higher])
            relative = self.points[self.ends[shared]] - joint.ends[0]
            along = relative @ joint.tangent
            off = relative @ np.array([-joint.tangent[1], joint.tangent[0]])
            within = (np.abs(off) <= near) & (along > -near) & (along < joint.depth + near)
            found.append(shared[within.all(axis=1)])
        return tuple(found)


def edges_of(structure: Structure, chords: Sequence[int]) -> Edges:
    """Find the edges of a structure's blocks.

    Args:
        structure: its blocks touch along joints.
        chords: in which each block's arcs are drawn, where it has any (n_blocks,).

    Returns:
        The edges, cut wherever another block's corner lies on one.
    """
    near = TOUCHING * structure.size
    drawn = [block.drawn(n) for block, n in zip(structure.blocks, chords, strict=True)]
    every = np.concatenate(drawn)
    first = np.array([min(group) for group in cKDTree(every).query_ball_point(every, near)])
    kept, number = np.unique(first, return_inverse=True)
    points = every[kept]
    starts = np.cumsum([0, *map(len, drawn)])
    boundaries = tuple(
        _with_points_on_edges(number[a:b], points, near) for a, b in pairwise(starts)
    )
    pairs = [np.sort(np.stack([each, np.roll(each, -1)], axis=1), axis=1) for each in boundaries]
    ends, of_pair = np.unique(np.concatenate(pairs), axis=0, return_inverse=True)
    around = np.split(of_pair.ravel(), np.cumsum([len(each) for each in boundaries])[:-1])
    return Edges(structure, points, ends, boundaries, tuple(around))


def _with_points_on_edges(boundary: Numbers, points: Array, near: float) -> Numbers:
    """Insert points of other blocks that lie on a boundary's edges."""
    boundary = boundary[boundary != np.roll(boundary, 1)]
    starts = points[boundary]
    edges = np.roll(starts, -1, axis=0) - starts
    lengths = np.linalg.norm(edges, axis=1)[:, None]
    low, high = starts.min(axis=0) - near, starts.max(axis=0) + near
    others = np.flatnonzero(np.all((points >= low) & (points <= high), axis=1))
    x, y = np.moveaxis(points[others] - starts[:, None], 2, 0)
    along = (x * edges[:, :1] + y * edges[:, 1:]) / lengths
    off = (y * edges[:, :1] - x * edges[:, 1:]) / lengths
    edge, point = np.nonzero((np.abs(off) <= near) & (along > near) & (along < lengths - near))
    order = np.lexsort((along[edge, point], edge))
    return np.insert(boundary, edge[order] + 1, others[point[order]])
