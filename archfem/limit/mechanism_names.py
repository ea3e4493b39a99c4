"""Plain names of collapse mechanisms, as "four-hinge mechanism" or "overturning about the toe".

A name follows from the motion alone. Blocks that move as one are one body. One body, or a wall of
many, is named by its mean rigid motion: sliding without rotation, overturning about a corner that
stays in contact, or both. A chain of bodies with one joint between two of them has hinges and
sliding joints.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from archfem._typing import Array, Flags, Numbers
from archfem.limit.displaced_blocks import merge_blocks
from archfem.limit.linear_programme import RigidBlocks
from archfem.limit.mechanism_kinematics import find_rigid_regions
from archfem.masonry.structure import Structure, join_joint_names, join_words

# Motions below this share of the largest are round-off, or do not count for a name [-]
STILL = 1e-4

# Motions from this share of the largest on are of the mean motion [-]
FAST = 0.1

# Share of the squared velocities that a mean rigid motion must explain to name a wall [-]
EXPLAINED = 0.6

COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def name_mechanism(structure: Structure, motion: Array) -> str:
    """Name the mechanism of a motion of all blocks (n_blocks, 3); "" where none moves."""
    regions = find_rigid_regions(structure)
    moving = NamedMotion(RigidBlocks(regions.structure), motion[list(regions.blocks)])
    if moving.bodies.max(initial=-1) < 0:
        return ""
    if moving.bodies.max() > 0 and moving.is_chain:
        return moving.name_chain()
    return moving.name_body()


class MeanMotion(NamedTuple):
    """A rigid motion in place of that of several blocks."""

    middle: Array  # centroid (2,) [m]
    speed: Array  # velocity of the centroid (2,) [m/s]
    turn: float  # angular velocity [rad/s]
    radius: float  # of gyration [m]
    share: float  # of the squared velocities that it explains [-]

    @property
    def centre(self) -> Array:
        """Centre of rotation (2,) [m]."""
        return self.middle + self.speed[::-1] * [-1.0, 1.0] / self.turn


@dataclass(frozen=True, eq=False)
class NamedMotion:
    """A motion of rigid blocks, with its bodies and the joints between them."""

    blocks: RigidBlocks
    motion: Array  # of its blocks (n_blocks, 3)

    @property
    def structure(self) -> Structure:
        """Structure of the rigid regions."""
        return self.blocks.structure

    @cached_property
    def least(self) -> float:
        """Least displacement that counts [m/s]."""
        return STILL * self.blocks.largest_displacement(self.motion)

    @cached_property
    def gaps(self) -> Array:
        """Openings of intrados and extrados ends, and slips (3, n_joints)."""
        return np.array(self.blocks.gaps(self.motion))

    @cached_property
    def touching(self) -> Flags:
        """Whether each joint moves and stays in contact, with dilatancy by μ at most."""
        friction = self.structure.friction
        friction = np.where(np.isfinite(friction), friction, 0.0)  # what never slides never dilates
        apart = self.gaps[:2].min(axis=0) - friction * abs(self.gaps[2]) > self.least
        return (abs(self.gaps).max(axis=0) > self.least) & ~apart

    @cached_property
    def turning(self) -> Flags:
        """Whether each joint turns about an end."""
        return self.touching & (abs(self.gaps[1] - self.gaps[0]) > self.least)

    @property
    def main_hinges(self) -> Flags:
        """Whether each joint is assessed, and turns by much of the largest turn of these."""
        angles = abs(self.gaps[1] - self.gaps[0]) / self.structure.depths
        angles *= self.turning & self.structure.judged
        return angles > FAST * angles.max()

    @cached_property
    def sliding(self) -> Flags:
        """Whether each joint slides."""
        return self.touching & (abs(self.gaps[2]) > self.least)

    @property
    def slides_within(self) -> bool:
        """Whether moving blocks slide on each other, by much of the largest displacement."""
        within = self.sliding & (self.bodies[self.structure.pairs] >= 0).all(axis=1)
        largest = self.blocks.largest_displacement(self.motion)
        return bool(np.abs(self.gaps[2][within]).max(initial=0.0) > FAST * largest)

    @cached_property
    def bodies(self) -> Numbers:
        """Body of each block, -1 for the ground."""
        return merge_blocks(self.structure, abs(self.gaps).max(axis=0) <= self.least)

    @property
    def is_chain(self) -> bool:
        """Whether bodies meet at single joints, as those of rings and piers, not of walls."""
        if self.structure.heads[abs(self.gaps).max(axis=0) > self.least].any():
            return False
        pairs = np.sort(self.bodies[self.structure.pairs[self.touching]], axis=1)
        return len(np.unique(pairs, axis=0)) == len(pairs)

    @cached_property
    def contacts(self) -> Array:
        """The end of each joint that opens less (n_joints, 2) [m]."""
        end = np.argmin(self.gaps[:2], axis=0)
        return self.structure.ends[np.arange(len(end)), end]

    def name_chain(self) -> str:
        """Name a mechanism of several bodies by its hinges and sliding joints."""
        hinges, slides = int(self.turning.sum()), int(self.sliding.sum())
        if not hinges:
            return f"sliding at {self._list_joints(self.sliding)}"
        parts = list(dict.fromkeys(self.structure.blocks[k].part for k in self.moving))
        whole = {self.structure.blocks[k].part for k in self.structure.free} == set(parts)
        of = "" if whole else f" of {join_words(parts)}"
        if slides:
            counts = f"{count(hinges, 'hinge')} and {count(slides, 'sliding joint')}"
            return f"combined hinge-slide mechanism{of}, {counts}"
        word = COUNTS[hinges] if hinges < len(COUNTS) else str(hinges)
        return f"{word}-hinge {'symmetric ' if self.is_symmetric else ''}mechanism{of}"

    @property
    def is_symmetric(self) -> bool:
        """Whether the mirror image of the hinges about a vertical axis are the hinges."""
        points = self.contacts[self.turning]
        mirrored = points * [-1.0, 1.0] + [points[:, 0].min() + points[:, 0].max(), 0.0]
        away = np.linalg.norm(points[:, None] - mirrored, axis=-1).min(axis=1)
        return bool(len(points) > 1 and away.max() < self.near)

    def _list_joints(self, chosen: Flags) -> str:
        """Return the names of joints."""
        return join_joint_names([self.structure.joints[k].name for k in np.flatnonzero(chosen)])

    @cached_property
    def moving(self) -> list[int]:
        """Numbers of the blocks that move."""
        return [k for k in self.structure.free if self.bodies[k] >= 0]

    @cached_property
    def corners(self) -> tuple[Array, Array, Array]:
        """Corners of the fast blocks, their velocities and areas (n, 2), (n, 2), (n,)."""
        points, velocities, areas = [], [], []
        size = np.linalg.norm(self.motion * [1.0, 1.0, self.blocks.length_unit], axis=1)
        # slow ones at the edge of a wedge say little of where it goes
        for k in np.flatnonzero(size > FAST * size.max()):
            block, (x, y, turn) = self.structure.blocks[k], self.motion[k]
            arms = block.points - block.centroid
            points.append(block.points)
            velocities.append([x, y] + turn * arms[:, ::-1] * [-1.0, 1.0])
            areas.append(np.full(len(arms), block.area / len(arms)))
        return np.concatenate(points), np.concatenate(velocities), np.concatenate(areas)

    @cached_property
    def mean_motion(self) -> MeanMotion:
        """Rigid motion nearest to that of the moving blocks."""
        points, velocities, areas = self.corners
        middle = areas @ points / areas.sum()
        arms = points - middle
        speed = areas @ velocities / areas.sum()
        size = areas @ (arms**2).sum(axis=1)
        turn = areas @ (arms[:, 0] * velocities[:, 1] - arms[:, 1] * velocities[:, 0]) / size
        rest = velocities - speed - turn * arms[:, ::-1] * [-1.0, 1.0]
        share = 1.0 - areas @ (rest**2).sum(axis=1) / (areas @ (velocities**2).sum(axis=1))
        return MeanMotion(middle, speed, float(turn), float(np.sqrt(size / areas.sum())), share)

    @cached_property
    def base(self) -> list[tuple[int, int, int]]:
        """Joints in contact at the edge of the moving blocks: number, block that moves, other."""
        moving, found = set(self.moving), []
        for number in np.flatnonzero(self.touching):
            one, other = self.structure.pairs[number]
            if (one in moving) != (other in moving):
                found.append((number, *((one, other) if one in moving else (other, one))))
        return found

    def name_body(self) -> str:
        """Name the motion of one body, or of many as one."""
        mean, base = self.mean_motion, self.base
        beds = [row for row in base if abs(self.structure.normals[row[0], 1]) > 0.7]
        if mean.share < EXPLAINED or not base:
            hinges, slides = int(self.turning.sum()), int(self.sliding.sum())
            counts = f"{count(hinges, 'hinge')}, {count(slides, 'sliding joint')}"
            return f"mechanism of several bodies, {counts}"
        is_slide = abs(mean.turn) * mean.radius < 0.1 * np.linalg.norm(mean.speed)
        if is_slide and not beds:
            return f"sliding at {self._list_joints(self.sliding)}"
        subject, is_low, is_whole = self._describe_moving(beds or base)
        if is_slide:
            # what rocks together carries the blocks above it without turning them
            rocks = self.turning[[number for number, *_ in beds]].any()
            return f"{'sway' if rocks else 'sliding'} of {subject}"
        toe, mover, _ = min(base, key=lambda row: np.hypot(*self.contacts[row[0]] - mean.centre))
        places = mean.centre, mean.middle
        slip, reach = (np.hypot(*self.contacts[toe] - place) for place in places)
        # the slip of the toe over the motion of the centroid; and joints within a wedge
        if slip > 0.33 * reach or (is_low and self.slides_within):
            if is_low and len(self.moving) > 1 and not is_whole:
                stones = f"{count(len(self.moving), 'stone')}, turning and sliding"
                main = self.main_hinges
                rings = main & [joint.role == "ring" for joint in self.structure.joints]
                if rings.sum() > 2:  # no wedge has the hinges of an arch
                    text = f"mechanism of {stones}, with hinges at {self._list_joints(rings)}"
                    return text + self._say_overturning(main & ~rings)
                return f"toe wedge of {stones}"
            return f"combined overturning and sliding of {subject}"
        about = f"about the toe of {self._label([mover])}"
        if is_low:
            return f"{'' if is_whole else 'toe wedge '}overturning {about}"
        return f"rocking of {subject} {about}"

    def _say_overturning(self, hinges: Flags) -> str:
        """Say which parts have a hinge on a support among some joints."""
        feet = [
            self.structure.joints[number].part
            for number in np.flatnonzero(hinges)
            if any(self.structure.blocks[k].fixed for k in self.structure.pairs[number])
        ]
        return "".join(f"; {part} overturns about its toe" for part in dict.fromkeys(feet))

    def _describe_moving(self, base: Sequence[tuple[int, int, int]]) -> tuple[str, bool, bool]:
        """Say which blocks move; whether they are on a support, and are all above their base."""
        heights = self.contacts[[number for number, *_ in base], 1]
        lowest = np.flatnonzero(heights < heights.min() + self.near)
        below = [base[k][2] for k in lowest]
        is_low = any(self.structure.blocks[k].fixed for k in below)
        left = list({*self.structure.free} - {*self.moving})
        is_whole = not (self.structure.centroids[left, 1] > heights.min()).any()
        moving = "all" if is_whole else count(len(self.moving), "block")
        if len(self.moving) == 1 and not is_whole:
            moving = self.structure.blocks[self.moving[0]].name
        return f"{moving} {'on' if is_low else 'above'} {self._label(below)}", is_low, is_whole

    @property
    def near(self) -> float:
        """Distance within which places are the same [m]."""
        return 1e-3 * self.structure.size

    def _label(self, numbers: Sequence[int]) -> str:
        """Return what names of blocks have in common before a comma, or where they end."""
        blocks = [self.structure.blocks[k] for k in numbers]
        common = {block.name.rpartition(",")[0] or block.name for block in blocks}
        top = max(block.points[:, 1].max() for block in blocks)
        return common.pop() if len(common) == 1 else f"y = {top:.3g} m"


def count(number: int, noun: str) -> str:
    """Return a number with its noun, in the plural where there are several."""
    return f"{COUNTS[number] if number < len(COUNTS) else number} {noun}{'s' * (number != 1)}"
