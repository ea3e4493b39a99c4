"""Stones under a fill: what the fill lays on them, and what holds them back where they move."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import radians, tan

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.limit.blocks import rigid_load
from archfem.limit.fill import Fill
from archfem.limit.skeleton import Skeleton, skeleton_of, whole_of
from archfem.limit.strips import Profile
from archfem.masonry.actions import BodyForce, PointLoad
from archfem.masonry.rigid_motion import first_coordinate, motion_of
from archfem.masonry.softness import yielding_blocks
from archfem.masonry.structure import Structure

logger = logging.getLogger("archfem")

PIECES = 8
"""Into how many pieces, each pressed on as a whole, the face of a stone in a joint is cut."""

LEVEL = 1e-9
"""Rise of a face over its length below which it is level, and nothing presses on it sideways."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """Pieces of stones' faces that look into the fill, or up at it.

    Attributes:
        block: number in the skeleton of the stone of each (n,).
        ends: of each piece (n, 2, 2) [m].
        toward: sense of the pressure along x, 1 or -1 (n,).
        least: active pressure at both ends (n, 2) [Pa].
        most: mobilised passive pressure at both ends (n, 2) [Pa].
    """

    block: NDArray[np.intp]
    ends: Array
    toward: Array
    least: Array
    most: Array

    def thrust(self, pressure: Array, width: float) -> tuple[Array, Array]:
        """Return the resultants of pressures that run straight from end to end.

        Args:
            pressure: at both ends (n, 2) [Pa].
            width: out of plane [m].

        Returns:
            Points of action (n, 2) [m] and forces (n, 2) [N].
        """
        rise = np.abs(self.ends[:, 1, 1] - self.ends[:, 0, 1])
        size = self.toward * pressure.mean(axis=1) * rise * width
        first, last = pressure.T
        share = (first + 2.0 * last) / np.maximum(3.0 * (first + last), np.finfo(float).tiny)
        points = self.ends[:, 0] + share[:, None] * (self.ends[:, 1] - self.ends[:, 0])
        return points, np.stack([size, np.zeros(len(size))], axis=1)


@dataclass(frozen=True, eq=False)
class Stones:
    """What stands of a structure in limit analysis, and how its fill loads and holds it.

    Attributes:
        whole: the structure with its fill, if it has one.
        fill: strength of that, or None.
        skeleton: the stones that stand by themselves.
    """

    whole: Structure
    fill: Fill | None
    skeleton: Skeleton

    @cached_property
    def _place(self) -> NDArray[np.intp]:
        """Number in the skeleton of each block of the whole, -1 where left out (n_blocks,)."""
        place = np.full(self.skeleton.size, -1)
        place[list(self.skeleton.blocks)] = np.arange(len(self.skeleton.blocks))
        return place

    @cached_property
    def _profile(self) -> Profile:
        """Stones and what rests on them, in strips."""
        return Profile(self.whole, self._place >= 0)

    @cached_property
    def _columns(self) -> tuple[NDArray[np.intp], Array, Array]:
        """Stone, foot and weight of every column of fill."""
        return self._profile.columns()

    @cached_property
    def contacts(self) -> Contacts:
        """Pieces of the stones' faces on which the fill presses."""
        soil, normals = set(yielding_blocks(self.whole)), self.whole.normals
        block, ends, toward, stress = [], [], [], []
        for number, joint in enumerate(self.whole.joints):
            stone = next((b for b in joint.blocks if b not in soil), joint.lower)
            other = joint.blocks[0] + joint.blocks[1] - stone
            out = normals[number] * (1.0 if stone == joint.lower else -1.0)
            bare = self._place[stone] < 0 or self.whole.blocks[stone].fixed
            if bare or other not in soil or abs(out[0]) <= LEVEL or out[1] < -LEVEL:
                continue
            points = joint.ends[0] + np.linspace(0.0, 1.0, PIECES + 1)[:, None] * np.diff(
                joint.ends, axis=0
            )
            side = float(np.sign(out[0]))
            over = np.array([self._profile.overburden(point, side) for point in points])
            block += [self._place[stone]] * PIECES
            toward += [-side] * PIECES
            ends += list(pairwise(points))
            stress += list(pairwise(over))
        assert self.fill is not None
        least, most = self.fill.pressures(np.array(stress, dtype=float).reshape(-1, 2))
        return Contacts(
            np.array(block, dtype=np.intp),
            np.array(ends, dtype=float).reshape(-1, 2, 2),
            np.array(toward, dtype=float),
            least,
            most,
        )

    def load(self, actions: Sequence[BodyForce | PointLoad]) -> Array:
        """Return the generalised forces of actions on the free stones (3 n_free,) [N, N, N m].

        A body force acts on the fill too, and so on the stone at the foot of each column. A point
        load on the fill spreads in a fan.

        Args:
            actions: body forces in multiples of g, point loads in N; they add up.

        Raises:
            InvalidInput: a point load misses the structure, or one on fill does not press straight
                down.
        """
        total = np.zeros(3 * len(self.skeleton.structure.free))
        for action in actions:
            if self.fill is not None and isinstance(action, BodyForce):
                block, foot, weight = self._columns
                pull = weight[:, None] * np.array([action.horizontal, action.vertical])
                total += self._total(self._place[block], foot, pull)
            if self.fill is not None and isinstance(action, PointLoad):
                number, point = action.place(self.whole)
                if self._place[number] < 0:
                    total += self._spread(action, point)
                    continue
            total += rigid_load(self.skeleton.structure, [action])
        return total

    def _spread(self, load: PointLoad, point: Array) -> Array:
        """Generalised forces of a load on the fill (3 n_free,)."""
        if load.force[0] != 0.0 or load.force[1] > 0.0:
            raise InvalidInput(
                f"a point load of {load.force} N at x = {load.x:.4g} m stands on the fill, which "
                "spreads what presses straight down: give (0, -P), and forces along the road as "
                "a BodyForce or on a structure without fill"
            )
        assert self.fill is not None
        block, points, part = self._profile.fan(point, self.fill)
        forces = part[:, None] * np.array(load.force)
        return self._total(self._place[block], points, forces)

    def warn_of_sliding_fill(self, actions: Sequence[BodyForce | PointLoad], factor: float) -> None:
        """Warn where a fill without cohesion would slide before the stones become a mechanism.

        A column that is pulled sideways rests on the next layer by friction alone: it slides where
        the pull is more than tan φ of what presses it down.

        Args:
            actions: live, over self-weight.
            factor: of these at collapse [-].
        """
        pulls = [action for action in actions if isinstance(action, BodyForce)]
        if self.fill is None or self.fill.cohesion > 0.0:
            return
        slope = tan(radians(self.fill.friction_angle))
        sideways = factor * abs(sum(pull.horizontal for pull in pulls))
        if sideways > slope * (1.0 - factor * sum(pull.vertical for pull in pulls)):
            logger.warning(
                "at a factor of %.4g the fill itself slides, at %.3g g sideways and tan φ = %.3g: "
                "the factor is that of the stones alone, and no fill would stay to load them so",
                *(factor, sideways, slope),
            )

    def active(self) -> Array:
        """Return the generalised forces of the active pressure (3 n_free,) [N, N, N m]."""
        if self.fill is None:
            return np.zeros(3 * len(self.skeleton.structure.free))
        each = self.contacts
        points, forces = each.thrust(each.least, self.whole.width)
        return self._total(each.block, points, forces)

    def passive(self) -> sparse.csr_matrix:
        """Return what each contact may press beyond the active pressure, as generalised forces.

        Returns:
            One column for each of the contacts (3 n_free, n) [N, N, N m].
        """
        if self.fill is None:
            return sparse.csr_matrix((3 * len(self.skeleton.structure.free), 0))
        each = self.contacts
        points, forces = each.thrust(each.most - each.least, self.whole.width)
        return sparse.csr_matrix(self._generalised(each.block, points, forces).T)

    def soil(self, share: Array) -> xr.Dataset | None:
        """Return the pressures of the fill, or None where there is none.

        Args:
            share: of each contact, from 0 for active to 1 for mobilised passive pressure, behind
                whatever else (n or more,) [-].
        """
        if self.fill is None:
            return None
        each = self.contacts
        share = share[len(share) - len(each.block) :]
        least, most = each.least.mean(axis=1), each.most.mean(axis=1)
        variables = {
            "pressure": ("contact", least + share * (most - least), {"units": "Pa"}),
            "least": ("contact", least, {"units": "Pa"}),
            "most": ("contact", most, {"units": "Pa"}),
        }
        ends = ("contact", "end")
        return xr.Dataset(
            variables,
            {
                "block": ("contact", np.array(self.skeleton.blocks, dtype=np.intp)[each.block]),
                "x": (ends, each.ends[:, :, 0], {"units": "m"}),
                "y": (ends, each.ends[:, :, 1], {"units": "m"}),
                "toward": ("contact", each.toward),
            },
        )

    def _generalised(
        self, block: NDArray[np.intp], points: Array, forces: Array
    ) -> sparse.csr_matrix:
        """Generalised forces of forces at points of stones of the skeleton (n, 3 n_free)."""
        start = np.full(len(self.skeleton.blocks), -1)
        for number, first in first_coordinate(self.skeleton.structure).items():
            start[number] = first
        centroids = np.array([each.centroid for each in self.skeleton.structure.blocks])
        each = np.einsum("pi,pij->pj", forces, motion_of(points, centroids[block]))
        held = np.flatnonzero(start[block] >= 0)
        columns = start[block[held], None] + np.arange(3)
        shape = (len(block), 3 * len(self.skeleton.structure.free))
        return sparse.csr_matrix((each[held].ravel(), (held.repeat(3), columns.ravel())), shape)

    def _total(self, block: NDArray[np.intp], points: Array, forces: Array) -> Array:
        """Sum of those generalised forces (3 n_free,)."""
        return np.asarray(self._generalised(block, points, forces).sum(axis=0)).ravel()


def stones_of(structure: Structure, fill: Fill | None) -> Stones:
    """Return what stands of a structure in limit analysis, under its fill.

    A fill that is cut into pieces has the strength of its joints and needs none told: its pieces
    are rigid blocks as stones are.

    Args:
        structure: the whole.
        fill: strength of its yielding blocks; None where it has none, or only in joints.

    Raises:
        InvalidInput: there are such blocks and no strength of theirs, or the other way round; or
            there is nothing else.
    """
    soil = yielding_blocks(structure)
    names = [structure.blocks[number].name for number in soil]
    if names and fill is None and all(structure.blocks[number].grain for number in soil):
        return Stones(structure, None, whole_of(structure))
    if names and fill is None:
        raise InvalidInput(
            f"blocks {names} are softer than the joints around them: rigid, they would hold every "
            "ring below; give their strength, fill=af.limit.Fill(friction_angle=35.0), to take "
            "them as weight and earth pressure, or push a finite-element model over"
        )
    if fill is not None and not names:
        raise InvalidInput(
            "fill is given, but no block is soft enough to be one (role 'other', and softer than "
            "the joints around it): leave fill out, or build the structure with its backfill"
        )
    skeleton = skeleton_of(structure)
    if set(skeleton.blocks) & set(soil):
        raise InvalidInput(f"there is nothing but fill, {names}: limit analysis is of stones")
    return Stones(structure, fill, skeleton)
