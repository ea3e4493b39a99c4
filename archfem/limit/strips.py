"""A structure cut into vertical strips: what lies above which stone, and what a fan meets first."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.limit.fill import Fill
from archfem.masonry.structure import TOUCHING, Structure

FINE = 1 / 2000
"""Width of the pieces on which a fan is summed up, as a fraction of the structure's size."""


@dataclass(frozen=True, eq=False)
class Slices:
    """Blocks cut along the verticals through all their corners: trapezia, strip by strip upwards.

    Attributes:
        block: number of the block that each is cut from (n,).
        strip: number of its strip, from the left (n,).
        side: x of its left and right side (n, 2) [m].
        bottom: y of its lower edge at both sides (n, 2) [m].
        top: y of its upper edge at both sides (n, 2) [m].
    """

    block: NDArray[np.intp]
    strip: NDArray[np.intp]
    side: Array
    bottom: Array
    top: Array

    @property
    def area(self) -> Array:
        """Area of each (n,) [m²]."""
        height = self.top - self.bottom
        return np.asarray(height.mean(axis=1) * (self.side[:, 1] - self.side[:, 0]))

    @property
    def middle(self) -> Array:
        """Place of the centroid of each along x (n,) [m]."""
        left, right = np.maximum(self.top - self.bottom, 0.0).T
        share = (left + 2.0 * right) / np.maximum(3.0 * (left + right), np.finfo(float).tiny)
        return np.asarray(self.side[:, 0] + share * (self.side[:, 1] - self.side[:, 0]))


def sliced(structure: Structure) -> Slices:
    """Cut the blocks of a structure along the verticals through all their corners.

    Args:
        structure: whose blocks are cut.

    Returns:
        The trapezia, from left to right and upwards.
    """
    outlines = [block.drawn() for block in structure.blocks]
    near = TOUCHING * structure.size
    cuts = np.unique(np.concatenate([outline[:, 0] for outline in outlines]))
    cuts = cuts[np.append(True, np.diff(cuts) > near)]
    found = [
        (number, strip, *cuts[strip : strip + 2], *low, *high)
        for number, outline in enumerate(outlines)
        for strip, low, high in _cut(outline, cuts, near)
    ]
    rows = np.array(found, dtype=float).reshape(-1, 8)
    rows = rows[np.lexsort((rows[:, 4:].sum(axis=1), rows[:, 1]))]
    whole = rows[:, :2].astype(np.intp)
    return Slices(whole[:, 0], whole[:, 1], rows[:, 2:4], rows[:, 4:6], rows[:, 6:8])


def _cut(outline: Array, cuts: Array, near: float) -> list[tuple[int, Array, Array]]:
    """Strip, lower and upper edge of every trapezium of one outline."""
    start, end = outline, np.roll(outline, -1, axis=0)
    swap = start[:, :1] > end[:, :1]
    left, right = np.where(swap, end, start), np.where(swap, start, end)
    steep = right[:, 0] - left[:, 0] <= near
    left, right = left[~steep], right[~steep]
    slope = (right[:, 1] - left[:, 1]) / (right[:, 0] - left[:, 0])
    pieces = []
    first, last = np.searchsorted(cuts, [left[:, 0].min() - near, right[:, 0].max() - near])
    for strip in range(first, last):
        over = (left[:, 0] <= cuts[strip] + near) & (right[:, 0] >= cuts[strip + 1] - near)
        x = cuts[strip : strip + 2]
        level = left[over, 1, None] + slope[over, None] * (x - left[over, 0, None])
        level = level[np.argsort(level.sum(axis=1))]
        pieces += [(strip, level[k], level[k + 1]) for k in range(0, len(level) - 1, 2)]
    return pieces


@dataclass(frozen=True, eq=False)
class Profile:
    """A structure as stones, and as what rests on them: fill, and paving on the fill.

    Attributes:
        structure: the whole.
        stones: whether each block is a stone (n_blocks,).
    """

    structure: Structure
    stones: NDArray[np.bool_]

    @cached_property
    def slices(self) -> Slices:
        """All blocks in strips."""
        return sliced(self.structure)

    @cached_property
    def near(self) -> float:
        """Distance of points that count as one [m]."""
        return TOUCHING * self.structure.size

    @cached_property
    def _unit_weights(self) -> Array:
        """Of the slices (n,) [N/m³]."""
        weights = np.array([block.material.unit_weight for block in self.structure.blocks])
        return np.asarray(weights[self.slices.block])

    def columns(self) -> tuple[NDArray[np.intp], Array, Array]:
        """Return the columns of what rests on stones: stone, foot, weight.

        Returns:
            Number of the stone under each (n,), the point on it below the column's centroid
            (n, 2) [m], and the weight for the whole width (n,) [N]. What has no stone below it
            rests on the ground and is not among them.
        """
        cut, rests = self.slices, ~self.stones[self.slices.block]
        below = np.where(rests, -1, np.arange(len(rests)))
        for k in range(1, len(rests)):
            if rests[k] and cut.strip[k] == cut.strip[k - 1]:
                below[k] = below[k - 1]
        held = np.flatnonzero(rests & (below >= 0))
        weight = (self._unit_weights * cut.area)[held] * self.structure.width
        carrier, x = below[held], cut.middle[held]
        foot = np.stack([x, _level(cut.side[carrier], cut.top[carrier], x)], axis=1)
        return cut.block[carrier], foot, weight

    def overburden(self, point: Array, side: float) -> float:
        """Return the vertical stress in the fill beside a point, from all that rests above it [Pa].

        Args:
            point: on the face of a stone (2,) [m].
            side: where the fill is, -1 for left of the point and 1 for right.
        """
        cut, x = self.slices, point[0] + 2.0 * side * self.near
        over = np.flatnonzero((cut.side[:, 0] <= x) & (x < cut.side[:, 1]))
        at = np.full(len(over), point[0])
        bottom, top = (_level(cut.side[over], edge[over], at) for edge in (cut.bottom, cut.top))
        stress = 0.0
        for k, low, high in zip(over, bottom, top, strict=True):
            if self.stones[cut.block[k]] and low > point[1] - self.near:
                break
            if not self.stones[cut.block[k]]:
                stress += float(self._unit_weights[k] * max(high - max(low, point[1]), 0.0))
        return stress

    @cached_property
    def _skyline(self) -> tuple[NDArray[np.intp], Array, Array]:
        """Highest stone below each of many narrow pieces: number or -1, x and y of its sides."""
        cut, stone = self.slices, self.stones[self.slices.block]
        blocks, sides, levels = [], [], []
        for strip in range(int(cut.strip.max()) + 1):
            own = np.flatnonzero(cut.strip == strip)
            if not len(own):
                continue
            held = own[stone[own]]
            left, right = cut.side[own[0]]
            count = int(np.ceil((right - left) / (FINE * self.structure.size)))
            x, y = np.linspace(left, right, count + 1), np.full(count + 1, -np.inf)
            if len(held):
                y = np.interp(x, cut.side[held[-1]], cut.top[held[-1]])
            blocks.append(np.full(count, cut.block[held[-1]] if len(held) else -1))
            sides.append(np.stack([x[:-1], x[1:]], axis=1))
            levels.append(np.stack([y[:-1], y[1:]], axis=1))
        return np.concatenate(blocks), np.concatenate(sides), np.concatenate(levels)

    def fan(self, point: Array, fill: Fill) -> tuple[NDArray[np.intp], Array, Array]:
        """Return what each stone gets of a load that goes down through the fill in a fan.

        A stone that stands up into the fan shades what is behind it. What no stone meets goes into
        the ground.

        Args:
            point: where the load stands, on the fill (2,) [m].
            fill: which spreads it.

        Returns:
            Numbers of stones (n,), points where they are met (n, 2) [m], and parts of the load
            (n,), of which several may be of one stone.
        """
        found = [self._half_fan(point, fill, sense) for sense in (1, -1)]
        block, points, part = (np.concatenate(each) for each in zip(*found, strict=True))
        return block, points, part

    def _half_fan(
        self, point: Array, fill: Fill, sense: int
    ) -> tuple[NDArray[np.intp], Array, Array]:
        """What stones to one side of a load get of it, outwards: to the right where sense is 1."""
        block, side, level = self._skyline
        far = sense * (side[:, ::sense] - point[0])
        beyond = np.flatnonzero(far[:, 1] > self.near)[::sense]
        depth = point[1] - level[beyond, ::sense]
        slope = far[beyond] / np.maximum(depth, self.near)
        ahead = np.where(depth > self.near, np.maximum(slope, 0.0), np.inf)
        seen = np.minimum(np.maximum.accumulate(ahead.ravel()), fill.edge)[1::2]
        before = np.concatenate([[0.0], seen[:-1]])
        met = np.flatnonzero(seen > before)
        first, last = slope[met].T
        ray = 0.5 * (before + seen)[met]
        along = np.clip((ray - first) / np.where(last > first, last - first, np.inf), 0.0, 1.0)
        ends = np.stack([side, level], axis=2)[beyond[met], ::sense]
        points = ends[:, 0] + along[:, None] * (ends[:, 1] - ends[:, 0])
        return block[beyond[met]], points, fill.share(seen[met]) - fill.share(before[met])


def _level(side: Array, edge: Array, x: Array) -> Array:
    """Height of edges, told at both sides, at places between them (n,) [m]."""
    share = (x - side[:, 0]) / (side[:, 1] - side[:, 0])
    return np.asarray(edge[:, 0] + share * (edge[:, 1] - edge[:, 0]))
