"""Triangular mesh of a fill between stones, and the contacts of the edges along its outline.

Points of the outline are equally far apart between its corners and the ends of its joints. Points
inside are those of equilateral triangles. Delaunay's triangulation of both has every edge of the
outline once points are added where one is missing.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.spatial import Delaunay

from archfem._typing import Array, Flags, Numbers
from archfem.errors import InvalidStructure
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure

SURFACE, HELD = -1, -2
"""What edges without a block beside them touch: air, and more fill."""


@dataclass(frozen=True, eq=False)
class FillMesh:
    """Triangles of all fill of a structure.

    Attributes:
        structure: structure with its fill.
        holds_ends: whether more fill holds vertical ends without a block beside them.
        points: corners of the triangles (n, 2) [m].
        triangles: points of each, anticlockwise (t, 3).
        owner: number of the block of each triangle (t,).
    """

    structure: Structure
    holds_ends: bool
    points: Array
    triangles: Numbers
    owner: Numbers

    @cached_property
    def touches(self) -> Numbers:
        """Block beside each side of the boundary, `SURFACE` or `HELD` (b,)."""
        near = CONTACT_TOLERANCE * self.structure.size
        middles, x = self.points[self.sides[self.boundary]].mean(axis=1), self.points[:, 0]
        beside = np.full(len(middles), SURFACE)
        # points that were merged may have moved by some times the tolerance of contacts
        if self.holds_ends:
            ends = np.abs(self.normals(self.boundary)[0][:, 0]) > 1.0 - 1e-6
            outermost = np.minimum(middles[:, 0] - x.min(), x.max() - middles[:, 0]) < 4.0 * near
            beside[ends & outermost] = HELD
        fill = set(self.owner.tolist())
        for joint, pair in zip(self.structure.joints, self.structure.pairs, strict=True):
            stones = [number for number in pair if number not in fill]
            if len(stones) == 1:
                arm, along = middles - joint.ends[0], joint.tangent
                place, away = arm @ along, np.abs(arm @ [-along[1], along[0]])
                on_joint = (away < 8.0 * near) & (place > 0.0) & (place < joint.depth)
                beside[on_joint] = stones[0]
        return beside

    @cached_property
    def areas(self) -> Array:
        """Area of each triangle (t,) [m²]."""
        along, across = np.moveaxis(np.diff(self.points[self.triangles], axis=1), 1, 0)
        return np.asarray(0.5 * (along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]))

    @cached_property
    def gradients(self) -> Array:
        """Gradients of the linear shape functions of each triangle's corners (t, 3, 2) [1/m]."""
        corners = self.points[self.triangles]
        opposite = np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1)
        turned = np.stack([-opposite[..., 1], opposite[..., 0]], axis=-1)
        return np.asarray(turned / (2.0 * self.areas[:, None, None]))

    @cached_property
    def sides(self) -> Numbers:
        """Points of the sides of all triangles, from corner k to the next (3 t, 2)."""
        return np.stack([self.triangles, np.roll(self.triangles, -1, axis=1)], axis=-1).reshape(
            -1, 2
        )

    @cached_property
    def edges(self) -> tuple[Numbers, Numbers]:
        """Sorted points of each edge (e, 2), and the edge of each side (3 t,)."""
        edges, number = np.unique(np.sort(self.sides, axis=1), axis=0, return_inverse=True)
        return edges, number.ravel()

    @cached_property
    def boundary(self) -> Numbers:
        """Sides that are on the boundary, in the order of `touches` (b,)."""
        _, number = self.edges
        return np.flatnonzero(np.bincount(number)[number] == 1)

    @cached_property
    def pairs(self) -> Numbers:
        """Both sides of each edge between two triangles (i, 2)."""
        _, number = self.edges
        order = np.argsort(number, kind="stable")
        same = np.flatnonzero(number[order][1:] == number[order][:-1])
        return np.stack([order[same], order[same + 1]], axis=1)

    def normals(self, sides: Numbers) -> tuple[Array, Array]:
        """Return outward unit normals (k, 2) and lengths (k,) [m] of sides."""
        start, end = np.moveaxis(self.points[self.sides[sides]], 1, 0)
        along = end - start
        length = np.linalg.norm(along, axis=1)
        return np.stack([along[:, 1], -along[:, 0]], axis=1) / length[:, None], length

    def refined(self, chosen: Flags) -> "FillMesh":
        """Return a mesh in which all sides of chosen triangles are halved.

        Where a triangle has a halved side its longest side is halved too, so that angles stay
        bounded (Rivara, Int. J. Numer. Meth. Eng. 20 (1984) 745-756).

        Args:
            chosen: whether triangles are divided (t,).
        """
        edges, number = self.edges
        side = number.reshape(-1, 3)
        start, end = np.moveaxis(self.points[edges], 1, 0)
        lengths = np.linalg.norm(end - start, axis=1)
        longest = lengths[side].argmax(axis=1)
        first = side[np.arange(len(side)), longest]
        halved = np.zeros(len(edges), dtype=bool)
        halved[side[chosen]] = True
        while (missing := halved[side].any(axis=1) & ~halved[first]).any():
            halved[first[missing]] = True
        middle = np.where(halved, len(self.points) + np.cumsum(halved) - 1, -1)
        points = np.concatenate([self.points, 0.5 * (start + end)[halved]])
        # corners a, b, c from the longest side ab, and the middles of ab, bc, ca
        turned = (longest[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(self.triangles, turned, axis=1).T
        ab, bc, ca = np.take_along_axis(middle[side], turned, axis=1).T
        parts = (
            (ab < 0, (a, b, c)),
            ((ab >= 0) & (ca < 0), (a, ab, c)),
            ((ab >= 0) & (ca >= 0), (a, ab, ca)),
            ((ab >= 0) & (ca >= 0), (ca, ab, c)),
            ((ab >= 0) & (bc < 0), (ab, b, c)),
            ((ab >= 0) & (bc >= 0), (ab, b, bc)),
            ((ab >= 0) & (bc >= 0), (ab, bc, c)),
        )
        triangles = [np.stack(corners, axis=1)[which] for which, corners in parts]
        owner = np.concatenate([self.owner[which] for which, _ in parts])
        return FillMesh(self.structure, self.holds_ends, points, np.concatenate(triangles), owner)


def mesh_fill(
    structure: Structure, fill: tuple[int, ...], size: float, holds_ends: bool
) -> FillMesh:
    """Divide the fill of a structure into triangles.

    Args:
        structure: structure with its fill.
        fill: numbers of the blocks of fill.
        size: size of the triangles, about [m].
        holds_ends: whether more fill holds vertical ends without a block beside them.

    Raises:
        InvalidStructure: the outline of a fill cannot be divided so finely.
    """
    near = CONTACT_TOLERANCE * structure.size
    points, triangles, owner = [np.empty((0, 2))], [np.empty((0, 3), int)], []
    for number in fill:
        outline = _divide_outline(structure, number, size, near)
        own, parts = _triangulate(outline, size)
        triangles.append(parts + sum(map(len, points)))
        points.append(own)
        owner += [number] * len(parts)
    # points of neighbouring fills coincide along their joints, within rounding of both
    everywhere = np.concatenate(points)
    _, first, place = np.unique(
        np.round(everywhere / (4.0 * near)), axis=0, return_index=True, return_inverse=True
    )
    return FillMesh(
        structure,
        holds_ends,
        everywhere[first],
        place.ravel()[np.concatenate(triangles)],
        np.array(owner, dtype=np.intp),
    )


def _divide_outline(structure: Structure, number: int, size: float, near: float) -> Array:
    """Return points along a block's outline, through its corners and the ends of its joints."""
    corners = structure.blocks[number].drawn()
    ends = structure.ends[[number in pair for pair in structure.pairs]].reshape(-1, 2)
    points = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        arm = ends - start
        away = np.abs(arm @ [-along[1], along[0]])
        places = (arm @ along)[away <= near]
        stops = np.unique(np.concatenate([[0.0, length], places[(places > 0) & (places < length)]]))
        stops = stops[np.append(np.diff(stops) > 2.0 * near, True)]
        for low, high in pairwise(stops):
            count = max(int(np.ceil((high - low) / size)), 1)
            part = low + (high - low) * np.arange(count)[:, None] / count
            points.append(start + part * along)
    return np.concatenate(points)


def _triangulate(outline: Array, size: float, most: int = 12) -> tuple[Array, Numbers]:
    """Return points and anticlockwise triangles within a closed line of points."""
    inside = _points_within(outline, size)
    for _ in range(most):
        points = np.concatenate([outline, inside])
        triangles = Delaunay(points).simplices
        kept = triangles[_is_within(points[triangles].mean(axis=1), outline)]
        sides = kept[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        found = set(map(frozenset, sides.tolist()))
        count = len(outline)
        missing = [k for k in range(count) if frozenset((k, (k + 1) % count)) not in found]
        if not missing:
            return points, _turn_left(points, kept)
        middles = 0.5 * (outline[missing] + np.roll(outline, -1, axis=0)[missing])
        outline = np.insert(outline, np.array(missing) + 1, middles, axis=0)
    raise InvalidStructure(
        f"a fill of {count} points along its outline cannot be divided into triangles of "
        f"{size:.3g} m: look whether its outline crosses or touches itself"
    )


def _turn_left(points: Array, triangles: Numbers) -> Numbers:
    """Return triangles with anticlockwise points, without those of no area."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    turned = np.where((twice < 0.0)[:, None], triangles[:, ::-1], triangles)
    # points on one straight side make triangles of rounding alone
    return turned[np.abs(twice) > 1e-9 * np.abs(twice).max()]


def _points_within(outline: Array, size: float) -> Array:
    """Return points of equilateral triangles within an outline, not too near to it."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    rise = 0.5 * np.sqrt(3.0) * size
    rows = np.arange(low[1] + 0.5 * rise, high[1], rise)
    columns = np.arange(low[0], high[0] + size, size)
    grid = np.stack(np.meshgrid(columns, rows), axis=-1)
    grid[1::2, :, 0] += 0.5 * size
    points = grid.reshape(-1, 2)
    points = points[_is_within(points, outline)]
    start, along = outline, np.roll(outline, -1, axis=0) - outline
    share = ((points[:, None] - start) * along).sum(axis=-1) / (along**2).sum(axis=-1)
    foot = start + np.clip(share, 0.0, 1.0)[..., None] * along
    away = np.linalg.norm(points[:, None] - foot, axis=-1).min(axis=1, initial=np.inf)
    # nearer to the outline triangles would be flatter than half of an equilateral one
    return points[away > 0.55 * size]


def _is_within(points: Array, outline: Array) -> Flags:
    """Return whether points are within a closed line, by the number of its crossings (n,)."""
    (x1, y1), (x2, y2) = outline.T, np.roll(outline, -1, axis=0).T
    x, y = points[:, 0, None], points[:, 1, None]
    crosses = (y1 > y) != (y2 > y)
    rise = np.where(y2 == y1, 1.0, y2 - y1)
    return np.asarray((crosses & (x < x1 + (y - y1) * (x2 - x1) / rise)).sum(axis=1) % 2 == 1)
