"""Fill that falls: convex grains in place of its bodies, which rigid blocks cannot follow.

Fill in one piece has deformed with the stones below, and pieces may be in each other where they
have no joint. As rigid bodies of their shapes as built they would overlap with stones. Grains are
parts of the fill as it has deformed. Their overlaps with stones and other grains are cut off.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import sqrt
from statistics import fmean

import numpy as np
import xarray as xr
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

from archfem._typing import Array, Flags, Numbers
from archfem.dynamics.rigid_body.bodies import (
    Bodies,
    FallFrame,
    LooseBlocks,
    make_bodies,
    split_convex,
)
from archfem.masonry.backfill import TILE_AREA, cut_block, stiffen
from archfem.masonry.block import Block, drop_straight_vertices, measure_polygon, rotate
from archfem.masonry.stiffness_ratio import find_yielding_blocks, list_stones
from archfem.masonry.structure import Structure
from archfem.models.model import Doubt

# Function from points as built (k, 2) to their places (k, 2) [m] and velocities (k, 2) [m/s]
Field = Callable[[Array], tuple[Array, Array]]

# Grains below this share of the mean area of all are left out: what is overlap to others would be
# a way through them
SMALLEST_SHARE = 0.05


class LooseStructure(Structure):
    """Stones as built and grains where they lie: those may overlap, and need no joint."""

    def _check_outlines(self) -> None:
        """Accept grains that lie where stones were built."""

    def _check_support(self) -> None:
        """Accept grains without a joint."""


@dataclass(frozen=True, eq=False)
class LooseFill:
    """Structure with its fill in grains, and their start."""

    structure: Structure
    start: LooseBlocks
    origin: Numbers  # block of each block or grain in the structure as built (b,)
    built: LooseBlocks  # start of the structure as built

    def restore(self, frame: FallFrame) -> FallFrame:
        """Return a frame of the structure as built: a body of fill moves as its grains on average.

        The average is by area.
        """
        if self.start is self.built:
            return frame
        areas = np.array([block.area for block in self.structure.blocks])
        shares = areas / np.bincount(self.origin, areas, len(self.built.poses))[self.origin]
        poses, velocities = self.built.poses.copy(), np.zeros_like(self.built.velocities)
        np.add.at(poses, self.origin, shares[:, None] * (frame.poses - self.start.poses))
        np.add.at(velocities, self.origin, shares[:, None] * frame.velocities)
        return replace(frame, poses=poses, velocities=velocities)

    def describe_grains(self, poses: Sequence[Array]) -> xr.Dataset:
        """Return corners of the grains at the start, and their motion over frames, for pictures."""
        if self.start is self.built:
            return xr.Dataset()
        grains = [k for k, block in enumerate(self.structure.blocks) if block.grain]
        corners = [np.array(self.structure.blocks[k].points) for k in grains]
        owner = np.repeat(np.arange(len(grains)), [len(each) for each in corners])
        # positions in a picture need no more digits
        moved = np.array(poses, np.float32)[:, grains]
        return xr.Dataset(
            {
                "grain_corner": (("grain_point", "axis"), np.concatenate(corners), {"units": "m"}),
                "grain_of_corner": ("grain_point", owner),
                "grain_block": ("grain", self.origin[grains]),
                "grain_pose": (("fall_frame", "grain", "pose"), moved, {"units": "m, m, rad"}),
            }
        )


@dataclass(eq=False)
class _Grain:
    """A convex part of a body of fill."""

    block: int  # of the structure as built
    points: Array  # anticlockwise (k, 2) [m]
    velocity: Array  # (3,)


def _area(grain: _Grain) -> float:
    """Return the area of a grain [m²]."""
    return measure_polygon(grain.points)[0]


def loosen_fill(structure: Structure, start: LooseBlocks, fields: Mapping[int, Field]) -> LooseFill:
    """Return a structure whose fill consists of grains where it is at a start.

    Args:
        structure: with fill in one piece, or in pieces.
        start: state of its blocks.
        fields: places and velocities of bodies that have deformed; others are rigid.
    """
    judged = list_stones(structure)
    fill = [number for number in structure.free if number not in judged]
    if not fill:
        return LooseFill(structure, start, np.arange(len(structure.blocks)), start)
    stones = [number for number in range(len(structure.blocks)) if number not in fill]
    grains = [grain for number in fill for grain in _cut_grains(structure, number, start, fields)]
    smallest = SMALLEST_SHARE * fmean(map(_area, grains))
    bodies = make_bodies(structure)
    _trim(grains, _place_stones(bodies, stones, start.poses), bodies.level)
    kept = [grain for grain in grains if len(grain.points) > 2 and _area(grain) > smallest]
    place = {number: new for new, number in enumerate(stones)}
    blocks = [structure.blocks[number] for number in stones]
    blocks += [_as_block(structure.blocks[g.block], g, k) for k, g in enumerate(kept)]
    between = (joint for joint in structure.joints if place.keys() >= {*joint.blocks})
    joints = [replace(x, blocks=(place[x.blocks[0]], place[x.blocks[1]])) for x in between]
    options = structure.width, structure.gravity, structure.name
    rest, speeds = np.zeros((len(kept), 3)), np.array([g.velocity for g in kept]).reshape(-1, 3)
    return LooseFill(
        LooseStructure(tuple(blocks), tuple(joints), *options),
        replace(
            start,
            poses=np.vstack([start.poses[stones], rest]),
            velocities=np.vstack([start.velocities[stones], speeds]),
        ),
        np.array([*stones, *(grain.block for grain in kept)]),
        start,
    )


def doubt_fallen_fill(structure: Structure, moved: Array) -> Iterator[Doubt]:
    """Yield a doubt for each end out of which pieces fell, by displacements of blocks (b,) [m]."""
    blocks, fill = structure.blocks, find_yielding_blocks(structure)
    gone = [number for number in fill if moved[number] > sqrt(blocks[number].area)]
    if not gone:
        return
    x, y = np.concatenate([blocks[number].points for number in fill]).T
    places, middle = structure.centroids[gone, 0], 0.5 * (x.min() + x.max())
    crown = max((k.points[:, 1].max() for k in blocks if k.role == "ring"), default=np.inf)
    for end, count in ((x.min(), (places < middle).sum()), (x.max(), (places >= middle).sum())):
        words = "pieces of the fill fell out of its free end at x = {:.4g} m, {} of {}"
        remedy = "retain the end: in a case give the sidewalls setback = 0, and `above` up to just "
        remedy += "below the road"
        if y[np.isclose(x, end)].min() >= crown:  # a wall holds all that is lower
            remedy = "walls retain it up to the crown: compare with longer ones, `length`"
        if count:
            yield Doubt(words, remedy, (float(end), int(count), len(fill)))


def interpolate_field(places: Array, displacements: Array, velocities: Array) -> Field:
    """Return the field between points (k, 2), linear, and outside of them that of the nearest."""
    values = np.hstack([displacements, velocities])
    within, beyond = LinearNDInterpolator(places, values), NearestNDInterpolator(places, values)

    def move(points: Array) -> tuple[Array, Array]:
        found = within(points)
        found = np.where(np.isnan(found), beyond(points), found)
        return points + found[:, :2], found[:, 2:]

    return move


def _as_block(body: Block, grain: _Grain, number: int) -> Block:
    """Return a grain as a block with the material of its body."""
    points = tuple(map(tuple, grain.points.tolist()))
    name = f"{body.name}, grain {number}"
    material = body.material if body.grain else stiffen(body.material)
    return Block(points, material, name, part=body.part, role=body.role, grain=True)


def _cut_grains(
    structure: Structure, number: int, start: LooseBlocks, fields: Mapping[int, Field]
) -> Iterator[_Grain]:
    """Yield the convex parts of a body of fill where it is at the start."""
    body = structure.blocks[number]
    outlines = [body.drawn()]
    if not body.grain:
        # about as many tiles as stones: the cost of a step grows with more than their number
        size = sqrt(body.area / len(structure.free) / TILE_AREA)
        outlines = [np.array(each.polygon.exterior.coords)[:-1] for each in cut_block(body, size)]
    spin = start.velocities[number, 2]
    move = fields.get(number) or _rigid_field(body, start, number)
    for outline in outlines:
        built = outline if measure_polygon(outline)[0] > 0.0 else outline[::-1]
        moved = drop_straight_vertices(move(built)[0], 1e-6)
        places, speeds = (each.mean(axis=0) for each in move(built))
        for part in split_convex(moved):
            points = moved[list(part)]
            x, y = measure_polygon(points)[1] - places
            velocity = np.array([*(speeds + spin * np.array([-y, x])), spin])
            yield _Grain(number, points, velocity)


def _rigid_field(body: Block, start: LooseBlocks, number: int) -> Field:
    """Return places and velocities of a rigid body."""
    (x, y, turn), (vx, vy, spin) = start.poses[number], start.velocities[number]

    def move(points: Array) -> tuple[Array, Array]:
        arms = rotate(points - body.centroid, turn)
        speeds = np.array([vx, vy]) + spin * np.column_stack([-arms[:, 1], arms[:, 0]])
        return body.centroid + np.array([x, y]) + arms, speeds

    return move


# Convex polygon, and whether its edges are part of an outline
Convex = tuple[Array, Flags]


def _place_stones(bodies: Bodies, stones: Sequence[int], poses: Array) -> Iterator[Convex]:
    """Yield the convex pieces of all stones in their places."""
    spans = pairwise(bodies.piece_starts)
    for owner, (begin, end) in zip(bodies.owner, spans, strict=True):
        if owner in stones:
            middle = bodies.centre[owner] + poses[owner, :2]
            yield middle + rotate(bodies.arms[begin:end], poses[owner, 2]), bodies.outer[begin:end]


def _trim(grains: Sequence[_Grain], stones: Iterable[Convex], level: float) -> None:
    """Cut off the overlaps of grains with ground and stones, and half of those of two grains."""
    for grain in grains:
        grain.points = _cut_by_line(grain.points, np.array([0.0, -1.0]), -level)
    for points, outer in stones:
        for grain in _near(grains, points):
            grain.points = _cut_off(grain.points, points, outer, 1.0)
    for count, grain in enumerate(grains):
        for other in _near(grains[:count], grain.points):
            if len(grain.points) > 2:
                every = np.ones(max(len(grain.points), len(other.points)), bool)
                one, two = grain.points, other.points
                grain.points = _cut_off(one, two, every, 0.5)
                other.points = _cut_off(two, one, every, 0.5)


def _near(grains: Sequence[_Grain], points: Array) -> list[_Grain]:
    """Return the grains whose boxes have a part in that of some points."""
    if not len(points):
        return []
    low, high = points.min(axis=0), points.max(axis=0)
    return [
        grain
        for grain in grains
        if len(grain.points) > 2
        and (grain.points.max(axis=0) > low).all()
        and (grain.points.min(axis=0) < high).all()
    ]


def _cut_off(points: Array, other: Array, outer: Flags, share: float) -> Array:
    """Return a convex polygon without a share of the depth by which it is in another one."""
    depths, normals = list[float](), [*_normals(points), *_normals(other)]
    for normal, corner in zip(normals, (*points, *other), strict=True):
        farther = other if len(depths) < len(points) else points
        depths.append(float(normal @ corner - (farther @ normal).min()))
    # along the direction in which the least has to be cut off; cuts between pieces separate too
    is_outer = np.append(np.ones(len(points), bool), outer[: len(other)])
    if min(depths) <= 1e-6:
        return points
    edge = int(np.argmin(np.where(is_outer, depths, np.inf)))
    own, normal = edge < len(points), normals[edge]
    face = float(normal @ (*points, *other)[edge])
    if own:
        return _cut_by_line(points, normal, face - share * depths[edge])
    return _cut_by_line(points, -normal, (1.0 - share) * depths[edge] - face)


def _normals(points: Array) -> Array:
    """Return the outward normals of the edges of an anticlockwise polygon (k, 2)."""
    x, y = (np.roll(points, -1, axis=0) - points).T
    return np.column_stack([y, -x]) / np.hypot(x, y)[:, None]


def _cut_by_line(points: Array, normal: Array, limit: float) -> Array:
    """Return the part of a convex polygon on which normal · x is at most a limit [m]."""
    beyond, kept = points @ normal - limit, []
    for k, corner in enumerate(points):
        after = (k + 1) % len(points)
        if beyond[k] <= 0.0:
            kept.append(corner)
        if beyond[k] * beyond[after] < 0.0:
            part = beyond[k] / (beyond[k] - beyond[after])
            kept.append(corner + part * (points[after] - corner))
    found = np.array(kept).reshape(-1, 2)
    return found[np.linalg.norm(found - np.roll(found, 1, axis=0), axis=1) > 1e-4]
