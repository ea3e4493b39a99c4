"""Backfill in limit analysis: earth pressure and load spreading.

A fill is not a body here but an action on the stones below it. The structure is cut into vertical
strips. The weight of each column of fill rests on the stone at its foot. The vertical stress in it
gives the active and the passive pressure on the stones' faces (Rankine). A load on the road spreads
in a fan down to the stones that it meets first (Flamant).
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from math import radians, tan
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from archfem._typing import Array, Flags, Numbers
from archfem._validation import check_number
from archfem.errors import InvalidInput, logger
from archfem.joints.rigid_kinematics import jump_rates
from archfem.limit.fill_strength import Fill, place_backing
from archfem.limit.linear_programme import RigidBlocks
from archfem.limit.mechanism_kinematics import RigidRegions, find_rigid_regions, take_all_rigid
from archfem.masonry.loads import Action, BodyForce, PointLoad
from archfem.masonry.standing import find_bodies
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure

SELF_WEIGHT = BodyForce(0.0, -1.0)


@dataclass(frozen=True, eq=False)
class BlockSlices:
    """Trapezia of blocks cut along the verticals through all corners, strip by strip upwards."""

    block: Numbers  # number of the block of each slice (n,)
    strip: Numbers  # number of its strip, from the left (n,)
    side: Array  # x of its left and right side (n, 2) [m]
    bottom: Array  # y of its lower edge at both sides (n, 2) [m]
    top: Array  # y of its upper edge at both sides (n, 2) [m]

    @property
    def area(self) -> Array:
        """Area of each slice (n,) [m²]."""
        height = self.top - self.bottom
        return np.asarray(height.mean(axis=1) * (self.side[:, 1] - self.side[:, 0]))

    @property
    def middle(self) -> Array:
        """Centroid of each slice along x (n,) [m]."""
        share = _centroid_share(np.maximum(self.top - self.bottom, 0.0))
        return np.asarray(self.side[:, 0] + share * (self.side[:, 1] - self.side[:, 0]))


@dataclass(frozen=True, eq=False)
class FillColumns:
    """Vertical columns of fill, each of which acts on the stone at its foot."""

    stone: Numbers  # number of the block at the foot of each column (n,)
    place: Array  # at which its forces act (n, 2) [m]
    weight: Array  # (n,) [N]
    lean: Array  # vertical force over the horizontal one that causes it (n,) [-]


def _centroid_share(heights: Array) -> Array:
    """Return where the centroids of trapezia are between their sides of given heights (n, 2)."""
    left, right = heights.T
    share = (left + 2.0 * right) / np.maximum(3.0 * (left + right), np.finfo(float).tiny)
    return np.asarray(share)


@lru_cache(maxsize=8)
def slice_blocks(structure: Structure) -> BlockSlices:
    """Cut the blocks of a structure along the verticals through all their corners."""
    outlines = [block.drawn() for block in structure.blocks]
    near = CONTACT_TOLERANCE * structure.size
    cuts = np.unique(np.concatenate([outline[:, 0] for outline in outlines]))
    cuts = cuts[np.append(True, np.diff(cuts) > near)]
    trapezia = [
        (number, strip, *cuts[strip : strip + 2], *low, *high)
        for number, outline in enumerate(outlines)
        for strip, low, high in _slice_outline(outline, cuts, near)
    ]
    rows = np.array(trapezia, dtype=float).reshape(-1, 8)
    rows = rows[np.lexsort((rows[:, 4:].sum(axis=1), rows[:, 1]))]  # by strip, then upwards
    numbers = rows[:, :2].astype(np.intp)
    return BlockSlices(numbers[:, 0], numbers[:, 1], rows[:, 2:4], rows[:, 4:6], rows[:, 6:8])


def _slice_outline(outline: Array, cuts: Array, near: float) -> list[tuple[int, Array, Array]]:
    """Return strip, lower and upper edge of every trapezium of one outline."""
    start, end = outline, np.roll(outline, -1, axis=0)
    swap = start[:, :1] > end[:, :1]
    left, right = np.where(swap, end, start), np.where(swap, start, end)
    steep = right[:, 0] - left[:, 0] <= near  # vertical edges bound no trapezium
    left, right = left[~steep], right[~steep]
    slope = (right[:, 1] - left[:, 1]) / (right[:, 0] - left[:, 0])
    pieces = []
    first, last = np.searchsorted(cuts, [left[:, 0].min() - near, right[:, 0].max() - near])
    for strip in range(first, last):
        over = (left[:, 0] <= cuts[strip] + near) & (right[:, 0] >= cuts[strip + 1] - near)
        x = cuts[strip : strip + 2]
        level = left[over, 1, None] + slope[over, None] * (x - left[over, 0, None])
        # from below, edges of an outline are in turn a lower and an upper one
        level = level[np.argsort(level.sum(axis=1))]
        pieces += [(strip, level[k], level[k + 1]) for k in range(0, len(level) - 1, 2)]
    return pieces


@dataclass(frozen=True, eq=False)
class FillProfile:
    """Stones of a structure, and the fill and paving that rest on them, in vertical strips."""

    structure: Structure
    stones: Flags  # whether each block is a stone (n_blocks,)

    @cached_property
    def slices(self) -> BlockSlices:
        """All blocks in strips."""
        return slice_blocks(self.structure)

    @cached_property
    def near(self) -> float:
        """Distance below which points coincide [m]."""
        return CONTACT_TOLERANCE * self.structure.size

    @cached_property
    def _unit_weights(self) -> Array:
        """Unit weights of the slices (n,) [N/m³]."""
        cut, area = self.slices, self.slices.area
        weights = np.array([x.material.unit_weight for x in self.structure.blocks])[cut.block]
        for number in self._bodies:  # which rest on their feet alone
            own = cut.block == number
            feet = own & (cut.bottom.max(axis=1) < cut.bottom[own].min() + self.near)
            weights[own] *= feet[own] * area[own].sum() / area[feet].sum()
        return np.asarray(weights)

    @cached_property
    def _bodies(self) -> list[int]:
        """Numbers of the bodies that stand on the structure."""
        return [self.structure.block_number(name) for name in find_bodies(self.structure)]

    def columns(self, lever: float = 0.0) -> FillColumns:
        """Return the columns of fill.

        A body on the fill has the moment of its forces about the fill's surface in any case: no
        shear carries it away. On one base it acts column by column; on several feet it leans on
        those in front.

        Args:
            lever: where the place is, from 0 for the foot of a column to 1 for its centroid [-].
        """
        cut, rests = self.slices, ~self.stones[self.slices.block]
        soft = np.isin(cut.block, find_yielding_blocks(self.structure))
        # the stone below each slice of fill, through any fill between them, and the top of that
        below, surface = np.where(rests, -1, np.arange(len(rests))), np.arange(len(rests))
        for k in range(1, len(rests)):
            if rests[k] and cut.strip[k] == cut.strip[k - 1]:
                below[k] = below[k - 1]
                surface[k] = k if soft[k] else surface[k - 1]
        carried = np.flatnonzero(rests & (below >= 0))
        weight = (self._unit_weights * cut.area)[carried] * self.structure.width
        carrier, x = below[carried], cut.middle[carried]
        foot = _interpolate_edge(cut.side[carrier], cut.top[carrier], x)
        ends = (_interpolate_edge(cut.side[carried], y[carried], x) for y in (cut.bottom, cut.top))
        height, base, lean = np.asarray(0.5 * sum(ends)), surface[carried], 0.0 * weight
        for number in self._bodies:
            own = cut.block[carried] == number
            load = weight[feet := own & (weight > 0.0)]
            if len(load) == own.sum():
                continue
            # as a rigid body on feet that are equally stiff along their length
            height[feet] = self.structure.blocks[number].points[:, 1].min()
            arm = x[feet] - np.average(x[feet], weights=load)
            above = self.structure.centroids[number, 1] - height[feet]
            lean[feet] = -above * load.sum() * arm / (load @ arm**2)
        level = np.where(soft[carried], height, _interpolate_edge(cut.side[base], cut.top[base], x))
        height -= (1.0 - lever) * (level - foot)
        place = np.stack([x, height], axis=1)
        return FillColumns(cut.block[carrier], place, weight, lean)

    def overburden(self, point: Array, side: float) -> float:
        """Return the vertical stress of all fill above a point, just beside it [Pa]."""
        cut, x = self.slices, point[0] + 2.0 * side * self.near
        over = np.flatnonzero((cut.side[:, 0] <= x) & (x < cut.side[:, 1]))
        at = np.full(len(over), point[0])
        edges = (_interpolate_edge(cut.side[over], y[over], at) for y in (cut.bottom, cut.top))
        stress = 0.0
        for k, low, high in zip(over, *edges, strict=True):
            if self.stones[cut.block[k]] and low > point[1] - self.near:
                break  # a stone above carries the fill beyond it
            if not self.stones[cut.block[k]]:
                stress += float(self._unit_weights[k] * max(high - max(low, point[1]), 0.0))
        return stress

    def fills(self, left: Array, right: Array) -> bool:
        """Return whether there is fill all along a level line between two points."""
        cut, height = self.slices, 0.5 * (left[1] + right[1])
        start, end = np.maximum(cut.side[:, 0], left[0]), np.minimum(cut.side[:, 1], right[0])
        x = 0.5 * (start + end)
        bottom, top = (_interpolate_edge(cut.side, edge, x) for edge in (cut.bottom, cut.top))
        covers = ~self.stones[cut.block] & (bottom < height) & (height < top) & (start < end)
        # arcs are drawn by chords
        return bool((end - start)[covers].sum() > 0.99 * (right[0] - left[0]))

    @cached_property
    def _skyline(self) -> tuple[Numbers, Array, Array]:
        """Top surface of the stones, in narrow pieces: block or -1, and x and y of both sides."""
        cut, stone = self.slices, self.stones[self.slices.block]
        blocks, sides, levels = [], [], []
        for strip in range(int(cut.strip.max()) + 1):
            in_strip = np.flatnonzero(cut.strip == strip)
            if not len(in_strip):
                continue
            stones = in_strip[stone[in_strip]]
            left, right = cut.side[in_strip[0]]
            # the fan is integrated on pieces of 1/2000 of the structure's size
            count = int(np.ceil((right - left) / (1 / 2000 * self.structure.size)))
            x, y = np.linspace(left, right, count + 1), np.full(count + 1, -np.inf)
            if len(stones):
                y = np.interp(x, cut.side[stones[-1]], cut.top[stones[-1]])
            blocks.append(np.full(count, cut.block[stones[-1]] if len(stones) else -1))
            sides.append(np.stack([x[:-1], x[1:]], axis=1))
            levels.append(np.stack([y[:-1], y[1:]], axis=1))
        return np.concatenate(blocks), np.concatenate(sides), np.concatenate(levels)

    def fan(self, point: Array, fill: Fill) -> tuple[Numbers, Array, Array]:
        """Return the stones that a load reaches through the fill, points there, and its shares."""
        halves = (self._half_fan(point, fill, sense) for sense in (1, -1))
        block, points, part = map(np.concatenate, zip(*halves, strict=True))
        return block, points, part

    def _half_fan(self, point: Array, fill: Fill, sense: int) -> tuple[Numbers, Array, Array]:
        """Return `fan` for the rays on one side of the load: right if sense is 1, left if -1."""
        block, side, level = self._skyline
        distance = sense * (side[:, ::sense] - point[0])
        beyond = np.flatnonzero(distance[:, 1] > self.near)[::sense]
        # slopes of the rays to both sides of each piece; a stone above the load stops all rays
        depth = point[1] - level[beyond, ::sense]
        slope = distance[beyond] / np.maximum(depth, self.near)
        outward = np.where(depth > self.near, np.maximum(slope, 0.0), np.inf)
        # A stone that stands up into the fan shades those behind it: the running maximum of the
        # slopes separates the rays already intercepted from those that go on. Rays that no stone
        # intercepts end in the ground.
        reached = np.minimum(np.maximum.accumulate(outward.ravel()), fill.edge)[1::2]
        before = np.concatenate([[0.0], reached[:-1]])
        met = np.flatnonzero(reached > before)
        # the force acts where the middle ray of each interval meets the piece
        first, last = slope[met].T
        ray = 0.5 * (before + reached)[met]
        along = np.clip((ray - first) / np.where(last > first, last - first, np.inf), 0.0, 1.0)
        ends = np.stack([side, level], axis=2)[beyond[met], ::sense]
        points = ends[:, 0] + along[:, None] * (ends[:, 1] - ends[:, 0])
        return block[beyond[met]], points, fill.share(reached[met]) - fill.share(before[met])


def _interpolate_edge(side: Array, edge: Array, x: Array) -> Array:
    """Return the height of edges at places between their ends (n,) [m]."""
    share = (x - side[:, 0]) / (side[:, 1] - side[:, 0])
    return np.asarray(edge[:, 0] + share * (edge[:, 1] - edge[:, 0]))


@dataclass(frozen=True, eq=False)
class FillContacts:
    """Pieces of stones' faces in contact with the fill beside or above them."""

    block: Numbers  # number of the stone of each piece in the rigid regions (n,)
    ends: Array  # of each piece (n, 2, 2) [m]
    toward: Array  # sense of the pressure along x, 1 or -1 (n,)
    least: Array  # active pressure at both ends (n, 2) [Pa]
    most: Array  # mobilised passive pressure at both ends (n, 2) [Pa]
    backed: Flags  # whether the piece is beside backing, not fill (n,)
    partner: Numbers  # piece to its left on which the same fill presses, or the piece itself (n,)

    @property
    def shared(self) -> sparse.csr_matrix:
        """Whether a piece has the pressure of an unknown, that of its partner (n, n)."""
        count = len(self.partner)
        entries = np.ones(count), (np.arange(count), self.partner)
        return sparse.csr_matrix(entries, (count, count))

    def thrust(self, pressure: Array, width: float) -> tuple[Array, Array]:
        """Return points and resultants (n, 2) of pressures that are linear along each piece."""
        along = self.ends[:, 1] - self.ends[:, 0]
        size = self.toward * pressure.mean(axis=1) * np.abs(along[:, 1]) * width
        points = self.ends[:, 0] + _centroid_share(pressure)[:, None] * along
        return points, np.stack([size, np.zeros(len(size))], axis=1)


class Face(NamedTuple):
    """Face of a stone below the fill, or a piece of one."""

    region: int  # number of the stone in the rigid regions
    ends: Array  # (2, 2) [m]
    side: float  # sense of the outward normal along x, 1 or -1


def _find_facing(faces: Sequence[Face], fixed: Sequence[Face], heights: Array) -> Numbers:
    """Return pairs of faces, left and right, with only fill between them at one of some heights.

    Args:
        faces: faces of free stones.
        fixed: faces of fixed stones, which are in no pair and may be between two others.
        heights: at which to look, any number [m].
    """
    ends = np.array([face.ends for face in (*faces, *fixed)]).reshape(-1, 2, 2)
    side = np.array([face.side for face in faces] + [0.0] * len(fixed))
    (x, y), (across, rise) = ends[:, 0].T, (ends[:, 1] - ends[:, 0]).T
    pairs = [np.zeros((0, 2), dtype=np.intp)]
    for height in heights:
        share = (height - y) / rise
        at = np.flatnonzero((share > 0.0) & (share < 1.0))
        at = at[np.argsort((x + share * across)[at])]
        neighbours = np.stack([at[:-1], at[1:]], axis=1)
        pairs.append(neighbours[(side[neighbours] == [1.0, -1.0]).all(axis=1)])
    return np.unique(np.concatenate(pairs), axis=0)


def _equalise(ends: Array, least: Array, most: Array, left: Numbers, right: Numbers) -> None:
    """Give pieces that face each other the same range of pressure, in place."""
    order = np.argsort(ends[:, :, 1], axis=1)  # from below
    low, high = (np.take_along_axis(each, order, axis=1) for each in (least, most))
    # it is as large as the fill pushes anywhere between them, or as the weakest place can bear
    low[left] = low[right] = np.maximum(low[left], low[right])
    high[left] = high[right] = np.maximum(low[left], np.minimum(high[left], high[right]))
    least[:], most[:] = (np.take_along_axis(each, order, axis=1) for each in (low, high))


@dataclass(frozen=True, eq=False)
class BlocksWithFill:
    """Rigid stones of a structure, with the loads and the resistance of its fill."""

    whole: Structure  # with its fill
    fill: Fill | None  # strength of the fill, or None without one
    rigid_regions: RigidRegions  # the stones that stand by themselves

    @cached_property
    def _profile(self) -> FillProfile:
        """Stones and fill in strips."""
        return FillProfile(self.whole, self.rigid_regions.place >= 0)

    def _faces(self) -> tuple[list[Face], list[Face]]:
        """Return the faces of free stones and those of fixed stones below the fill."""
        soil, normals = set(find_yielding_blocks(self.whole)), self.whole.normals
        free: list[Face] = []
        fixed: list[Face] = []
        level = 1e-9  # rise over length of a face without side pressure
        for number, joint in enumerate(self.whole.joints):
            stone = next((b for b in joint.blocks if b not in soil), joint.lower)
            other = joint.blocks[0] + joint.blocks[1] - stone
            out = normals[number] * (1.0 if stone == joint.lower else -1.0)
            bare = self.rigid_regions.place[stone] < 0
            if bare or other not in soil or abs(out[0]) <= level or out[1] < -level:
                continue
            face = Face(self.rigid_regions.place[stone], joint.ends, float(np.sign(out[0])))
            (fixed if self.whole.blocks[stone].fixed else free).append(face)
        return free, fixed

    @cached_property
    def contacts(self) -> FillContacts:
        """Pieces of the stones' faces on which the fill presses, or that the backing holds."""
        assert self.fill is not None
        faces, fixed = self._faces()
        level = self._backing_level(faces)
        pieces, stress = [], []
        for face, along in zip(faces, self._cut_faces(faces, level), strict=True):
            points = face.ends[0] + along[:, None] * (face.ends[1] - face.ends[0])
            over = np.array([self._profile.overburden(point, face.side) for point in points])
            pieces += [face._replace(ends=np.array(ends)) for ends in pairwise(points)]
            stress += list(pairwise(over))
        least, most = self.fill.pressures(np.array(stress, dtype=float).reshape(-1, 2))
        ends = np.array([piece.ends for piece in pieces]).reshape(-1, 2, 2)
        middle, partner = ends[:, :, 1].mean(axis=1), np.arange(len(pieces))
        least[middle < level], most[middle < level] = 0.0, self.fill.backing_strength
        left, right = self._drop_open(ends, _find_facing(pieces, fixed, middle), least, most).T
        partner[right] = left
        _equalise(ends, least, most, left, right)
        alone = np.setdiff1d(self._find_beside_rings(pieces), [left, right])
        most[alone] = least[alone]
        numbers = np.array([piece.region for piece in pieces], dtype=np.intp)
        toward = np.array([-piece.side for piece in pieces])
        return FillContacts(numbers, ends, toward, least, most, middle < level, partner)

    def _drop_open(self, ends: Array, pairs: Numbers, least: Array, most: Array) -> Numbers:
        """Return the pairs of facing pieces with fill all along between them.

        Where it ends in air between them it bears no passive pressure, in place, and a warning
        says so.
        """
        places = ends.mean(axis=1)
        filled = [self._profile.fills(places[left], places[right]) for left, right in pairs]
        is_open = ~np.array(filled, dtype=bool)
        if is_open.any():
            pieces = np.unique(pairs[is_open])
            most[pieces] = least[pieces]
            logger.warning(
                "the fill beside x = %.4g m, y = %.4g m ends in air before the opposite face: no "
                "passive pressure and no backing counts there; draw the fill without the gap if it "
                "has none",
                *places[pairs[is_open][0, 0]],
            )
        return pairs[~is_open]

    def _find_beside_rings(self, pieces: Sequence[Face]) -> Numbers:
        """Return the pieces of rings that look towards another ring.

        One that faces none is above its crown. The fill would carry its passive pressure over that
        ring to the ground, a span away, or bring it on the back of the ring: neither is counted on.
        """
        numbers = [self.rigid_regions.blocks[piece.region] for piece in pieces]
        blocks = [self.whole.blocks[number] for number in numbers]
        part = np.array([block.part if block.role == "ring" else "" for block in blocks])
        side = np.array([piece.side for piece in pieces])
        place = np.array([piece.ends[:, 0].mean() for piece in pieces])
        towards = np.zeros(len(pieces), dtype=bool)
        for name in {*part.tolist()} - {""}:
            others = np.where((part != name) & (part != ""), place, np.nan)
            low, high = np.nanmin(others, initial=np.inf), np.nanmax(others, initial=-np.inf)
            towards |= (part == name) & np.where(side > 0.0, place < high, place > low)
        return np.flatnonzero(towards)

    def _backing_level(self, faces: Sequence[Face]) -> float:
        """Return the level below which there is backing, -inf for none [m]."""
        assert self.fill is not None
        if (level := self.fill.backing) is None:
            return -np.inf
        heights = np.array([face.ends[:, 1] for face in faces])
        _check_backing(level, heights, "faces below the fill")
        return float(level)

    def _cut_faces(self, faces: Sequence[Face], level: float) -> list[Array]:
        """Return where each face is cut along it: in eight, and where those that it faces are cut.

        Faces on both sides of a pier are cut at the same heights, even if they do not all face
        each other: one may face a low ring and, above it, one beyond.
        """
        ends = np.array([face.ends for face in faces]).reshape(-1, 2, 2)
        start, rise = ends[:, 0, 1], ends[:, 1, 1] - ends[:, 0, 1]
        shares = np.linspace(0.0, 1.0, 9)
        heights = start[:, None] + shares * rise[:, None]
        every = np.unique(heights)
        between = 0.5 * (every[1:] + every[:-1])[np.diff(every) > self._profile.near]
        left, right = _find_facing(faces, [], between).T
        facing = sparse.coo_matrix((left >= 0, (left, right)), (len(faces), len(faces)))
        _, group = connected_components(facing, directed=False)
        cuts = []
        for k, near in enumerate(self._profile.near / np.abs(rise)):
            at = (np.append(heights[group == group[k]], level) - start[k]) / rise[k]
            at = np.unique([*shares, *at[(at > near) & (at < 1.0 - near)]])
            cuts.append(at[np.append(True, np.diff(at) > near)])
        return cuts

    def load(self, actions: Sequence[BodyForce | PointLoad]) -> Array:
        """Return the generalised forces of actions on the free stones (3 n_free,) [N, N, N m].

        Args:
            actions: that act on the whole structure.
        """
        total = np.zeros(3 * len(self.rigid_regions.structure.free))
        for action in actions:
            # a body force acts on the fill too, and so on the stone below each column
            if self.fill is not None and isinstance(action, BodyForce):
                columns = self._profile.columns(self.fill.lever)
                pull = columns.weight[:, None] * np.array([action.horizontal, action.vertical])
                pull[:, 1] += action.horizontal * columns.lean * columns.weight
                stones = self.rigid_regions.place[columns.stone]
                total += self._sum_forces(stones, columns.place, pull)
            if self.fill is not None and isinstance(action, PointLoad):
                number, point = action.place(self.whole)
                if self.rigid_regions.place[number] < 0:
                    total += self._spread_load(action, point)
                    continue
            total += RigidBlocks(self.rigid_regions.structure).load([action])
        return total

    def _spread_load(self, load: PointLoad, point: Array) -> Array:
        """Return the generalised forces of a load on the fill (3 n_free,)."""
        if load.force[0] != 0.0 or load.force[1] > 0.0:
            raise InvalidInput(
                f"a point load of {load.force} N at x = {load.x:.4g} m stands on the fill, which "
                "spreads what presses straight down: give (0, -P), and forces along the road as "
                "a BodyForce or on a structure without fill"
            )
        assert self.fill is not None
        block, points, part = self._profile.fan(point, self.fill)
        forces = part[:, None] * np.array(load.force)
        return self._sum_forces(self.rigid_regions.place[block], points, forces)

    def warn_of_lost_loads(
        self, live: Sequence[Action], dead: Sequence[Action], factor: float
    ) -> None:
        """Warn where a fill without cohesion slides, or an axle lifts, before stones move."""
        if self.fill is None:
            return
        grown = np.array(sum_body_forces(dead)) + factor * np.array(sum_body_forces(live))
        sideways, down = abs(float(grown[0])), 1.0 - grown[1]
        # what is taken off an axle, as a share of its load and of the horizontal pull
        share = np.max(np.sign(grown[0]) * self._profile.columns().lean, initial=0.0)
        if sideways * share > down:
            logger.warning(
                "at a factor of %.4g, %.3g g sideways, an axle has lifted, at %.3g g: the factor "
                "is that of a vehicle which the road holds down; cut the fill into pieces",
                *(factor, sideways, down / share),
            )
        # A column rests on the next layer by friction alone: it slides where the horizontal pull
        # exceeds tan φ times the vertical force.
        slope = tan(radians(self.fill.friction_angle))
        if sideways > slope * down and self.fill.cohesion <= 0.0:
            logger.warning(
                "at a factor of %.4g the fill itself slides, at %.3g g sideways and tan φ = %.3g: "
                "the factor is that of the stones alone, and no fill would stay to load them so",
                *(factor, sideways, slope),
            )

    def active_forces(self) -> Array:
        """Return the generalised forces of the active pressure (3 n_free,) [N, N, N m]."""
        if self.fill is None:
            return np.zeros(3 * len(self.rigid_regions.structure.free))
        contacts = self.contacts
        points, forces = contacts.thrust(contacts.least, self.whole.width)
        return self._sum_forces(contacts.block, points, forces)

    def passive_forces(self) -> sparse.csr_matrix:
        """Return the generalised forces of each contact's pressure range (3 n_free, n)."""
        contacts = self.contacts
        points, forces = contacts.thrust(contacts.most - contacts.least, self.whole.width)
        single = self._apply_forces(contacts.block, points, forces).T
        return sparse.csr_matrix(single @ contacts.shared)

    def pressure_dataset(self, share: Array) -> xr.Dataset | None:
        """Return the pressures of the fill over contact, or None where there is none."""
        if self.fill is None:
            return None
        contacts = self.contacts
        first = len(share) - len(contacts.block)  # a load factor may stand before them
        share = share[first:][contacts.partner]
        least, most = contacts.least.mean(axis=1), contacts.most.mean(axis=1)
        pressures = {"pressure": least + share * (most - least), "least": least, "most": most}
        variables = {key: ("contact", value, {"units": "Pa"}) for key, value in pressures.items()}
        ends, numbers = ("contact", "end"), np.array(self.rigid_regions.blocks, dtype=np.intp)
        coordinates = {
            "block": ("contact", numbers[contacts.block]),
            "x": (ends, contacts.ends[:, :, 0], {"units": "m"}),
            "y": (ends, contacts.ends[:, :, 1], {"units": "m"}),
            "toward": ("contact", contacts.toward),
            "backed": ("contact", contacts.backed),
        }
        return xr.Dataset(variables, coordinates)

    def _apply_forces(self, block: Numbers, points: Array, forces: Array) -> sparse.csr_matrix:
        """Return the generalised forces of forces at points of the stones (n, 3 n_free)."""
        structure = self.rigid_regions.structure
        # supports have no coordinates
        free = structure.first_coordinates[block] // 3
        pairs = np.stack([np.full_like(free, -1), free], axis=1)
        return jump_rates(forces, points, pairs, structure.centroids[list(structure.free)])

    def _sum_forces(self, block: Numbers, points: Array, forces: Array) -> Array:
        """Return the sum of the generalised forces of forces at points (3 n_free,)."""
        return np.asarray(self._apply_forces(block, points, forces).sum(axis=0)).ravel()


def sum_body_forces(actions: Sequence[Action]) -> tuple[float, float]:
    """Return the sum of the body forces among actions, along x and y [g]."""
    pulls = [action for action in actions if isinstance(action, BodyForce)]
    return sum(pull.horizontal for pull in pulls), sum(pull.vertical for pull in pulls)


def hold_backed(structure: Structure, level: float | None) -> Structure:
    """Return a structure whose stones of rings and piers below a level do not move."""
    if level is None:
        return structure
    stones = [n for n in structure.free if structure.blocks[n].role != "other"]
    heights = structure.centroids[stones, 1]
    _check_backing(level, heights, "centroids")
    held = {number for number, y in zip(stones, heights, strict=True) if y < level}
    blocks = [
        replace(block, fixed=block.fixed or number in held)
        for number, block in enumerate(structure.blocks)
    ]
    return replace(structure, blocks=tuple(blocks))


def _check_backing(level: float, heights: Array, places: str) -> None:
    """Refuse a level of backing that holds none or all of the places of stones at some heights."""
    check_number(level, "fill, backing")
    lowest, highest = heights.min(), heights.max()
    if not lowest < level < highest:
        raise InvalidInput(
            f"fill, backing {level:.4g} m holds {'all' if level > lowest else 'none'} of the "
            f"stones, whose {places} are {lowest:.4g} to {highest:.4g} m high: "
            "give a level between, or leave it out"
        )


def refuse_missing_fill(soil: Collection[Any]) -> None:
    """Refuse the strength of a fill where no block is one."""
    if not soil:
        raise InvalidInput(
            "fill is given, but no block is soft enough to be one (role 'other', and softer than "
            "the joints around it): leave fill out, or build the structure with its backfill"
        )


def attach_fill(structure: Structure, fill: object) -> BlocksWithFill:
    """Separate the stones of a structure from its fill, and check that the fill has a strength."""
    if fill is not None and not isinstance(fill, Fill):
        raise InvalidInput(
            f"this analysis cannot take a {type(fill).__name__}: only collapse_factor bounds a "
            "plastic fill, and moving_load and rate by it; give af.limit.Fill here"
        )
    soil = find_yielding_blocks(structure)
    names = [structure.blocks[number].name for number in soil]
    # Fill cut into pieces has the strength of its joints: its pieces are rigid as stones are.
    if names and fill is None and all(structure.blocks[number].grain for number in soil):
        return BlocksWithFill(structure, None, take_all_rigid(structure))
    if names and fill is None:
        raise InvalidInput(
            f"blocks {names} are softer than the joints around them: rigid, they would hold every "
            "ring below; to take them as weight and earth pressure, give their strength: "
            "fill=af.limit.Fill(friction_angle=35.0), or in a case fill = "
            '{ friction_angle = "35 degree" } in [limit]; or push a finite-element model over'
        )
    if fill is not None:
        refuse_missing_fill(names)
    regions = find_rigid_regions(structure)
    if set(regions.blocks) & set(soil):
        raise InvalidInput(f"there is nothing but fill, {names}: limit analysis is of stones")
    return BlocksWithFill(structure, place_backing(fill, structure), regions)
