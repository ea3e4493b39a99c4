"""Separation of blocks: joints let go, stones meet outside their joints, or blocks overturn.

A model has contact forces in its joints alone. With large displacements, blocks are followed as
loose rigid blocks (`dynamics.fall`) from the step at which these do not suffice any more.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from archfem._typing import Array, Flags
from archfem.dynamics.collapse_state import shallowest_part
from archfem.dynamics.history import Ending, History
from archfem.dynamics.rigid_body.bodies import Bodies, make_bodies, masses_of
from archfem.dynamics.rigid_body.contact_detection import (
    PlacedPieces,
    allocate_pieces,
    find_meeting,
    measure_gaps,
)
from archfem.dynamics.state import Batch, State
from archfem.masonry.stiffness_ratio import find_yielding_blocks, mark_stone_joints
from archfem.masonry.structure import CONTACT_TOLERANCE
from archfem.models.model import Model
from archfem.units import G

# Blocks stay where they are if joints, over as long at the end, swing by less than this share of
# their rotation: a keystone arch swung by 0.018 for 20 s, about hinges that stayed open
SWING_TIME, MAX_SWING = 1.0, 0.05  # [s], [-]
MIN_SAMPLES = 10  # records in that time


@dataclass(frozen=True, eq=False)
class LooseningMonitor:
    """Detection of the step from which blocks are followed as loose rigid blocks."""

    separation: "SeparationMonitor"
    meeting: "MeetingMonitor"

    @classmethod
    def of(cls, model: Model, start: State) -> Self:
        """Return the monitor of a run; runs from one state share it."""
        derived, key = model.derived, start.q.tobytes()
        if derived.get("loosening", (b"",))[0] != key:
            derived["loosening"] = key, cls(SeparationMonitor(model), MeetingMonitor(model, start))
        return derived["loosening"][1]

    def find_end(self, batch: Batch) -> tuple[Ending, str | None, int]:
        """Return how and why blocks become loose within a batch, and after how many steps."""
        loose, met = self.separation.find_first(batch), self.meeting.find_first(batch)
        # loose blocks start from before they meet: a joint does not know of the other stone
        if met is not None and (loose is None or met[0] <= loose[0]):
            return Ending.MET, f"stones meeting outside their joints: {met[1]}", met[0]
        if loose is not None:
            return Ending.PARTED, f"the blocks coming loose: {loose[1]}", loose[0] + 1
        return Ending.FINISHED, None, len(batch.times)


@dataclass(frozen=True, eq=False)
class SeparationMonitor:
    """Detection of the step at which a joint between stones separates.

    A joint separates at a large rotation or once it has slid off its face. Joints of fill do not
    count: its pieces adapt to their support, tumble on the spot or crumble off its ends.
    """

    model: Model
    max_rotation: float = 0.3  # a voussoir is about to tumble [rad]

    def find_first(self, batch: Batch) -> tuple[int, str] | None:
        """Return the first step of a batch with separated blocks and the reason, or None."""
        observer, structure = self.model.observer(), self.model.structure
        _, rotation, slip = np.moveaxis(observer.faces(batch.read(observer)), -2, 0)
        # faces overlap at all slips between two at which they do
        ends = np.stack([slip.min(axis=0), slip.max(axis=0)])
        is_turned = max(-rotation.min(), rotation.max()) > self.max_rotation
        if not is_turned and np.all(structure.overlaps(ends)[0] > 0.0):
            return None
        rotation = np.abs(rotation)
        loose = (rotation > self.max_rotation) | self._find_slid_off(slip)
        # which blocks are fill takes long to find out, and matters once a joint is loose
        if loose.any():
            loose &= mark_stone_joints(structure)
        if not loose.any():
            return None
        k = int(np.argmax(loose.any(axis=1)))
        joint = int(np.argmax(loose[k]))
        name = structure.joints[joint].name
        if rotation[k, joint] > self.max_rotation:
            return k, f"'{name}' had turned by {rotation[k, joint]:.2g} rad"
        return k, f"'{name}' had slid by {abs(slip[k, joint]):.2g} m, off its face"

    def _find_slid_off(self, slip: Array) -> Flags:
        """Return whether faces have slid off each other, and onto no other face (steps, joints)."""
        structure, pairs = self.model.structure, self.model.structure.pairs
        touching = structure.overlaps(slip)[0] > 0.0
        off, near = ~touching, CONTACT_TOLERANCE * structure.size
        for joint in np.flatnonzero(off.any(axis=0)):
            # a stone on two others may leave one of them: joints of its face are on one line
            free = [block for block in pairs[joint] if not structure.blocks[block].fixed]
            heights = (structure.ends - structure.middles[joint]) @ structure.normals[joint]
            beside = np.isin(pairs, free).any(axis=1) & (np.abs(heights) <= near).all(axis=1)
            off[:, joint] &= ~touching[:, beside].any(axis=1)
        return off


@dataclass(frozen=True, eq=False)
class MeetingMonitor:
    """Detection of the step at which stones meet outside their joints.

    A model has contact forces in its joints alone, which end with the overlap of their faces. Fill
    does not count, since it adapts.
    """

    model: Model
    start: State  # overlaps at the start of the run do not count
    # deepest overlap beyond that at the start and the compression of joints [m]: stones that touch
    # as built press each other by less, and none may be deeper than 1 mm
    tolerance: float = 5e-4

    def find_first(self, batch: Batch) -> tuple[int, str] | None:
        """Return the first step of a batch with stones in each other and their names, or None."""
        observer = self.model.observer()
        readings = batch.read(observer)
        corners, faces = observer.corners(readings), observer.faces(readings)
        # beyond the overlap a joint is open, and slip × rotation bounds how deep a stone is there
        deep = np.abs(faces[:, 1] * faces[:, 2]) > self.tolerance
        overruns = deep.any(axis=1) & self.model.large_displacements
        steps = np.arange(len(faces)) if self._may_meet(corners) else np.flatnonzero(overruns)
        if not len(steps):
            return None
        limits, pairs = self._limits.copy(), self.model.structure.pairs[self._joints]
        if not overruns.any():
            limits[tuple(pairs.T)] = limits[tuple(pairs.T[::-1])] = -np.inf
        poses = self._fit_motions(corners[steps])
        depths = np.ascontiguousarray(self._compressions(faces[steps]))  # one kind to compile for
        k, *pair = find_meeting(self._bodies, self._world, poses, limits, pairs, depths)
        if k < 0:
            return None
        names = [*(f"'{block.name}'" for block in self.model.structure.blocks), "the ground"]
        return int(steps[k]), f"{names[min(pair)]} met {names[max(pair)]}"

    def _may_meet(self, corners: Array) -> bool:
        """Return whether any blocks without a joint have moved by more than is between them."""
        start = self._corners
        farthest = np.maximum(corners.max(axis=0) - start, start - corners.min(axis=0))
        distances = np.hypot(*farthest.T)
        reach = np.zeros(len(self._room))
        # displacements of a rigid block are linear, and arcs bulge by half of a chord at most
        reach[self._owner[self._first]] = 2.0 * np.maximum.reduceat(distances, self._first)
        return bool(np.any(reach[:, None] + reach > self._room))

    def _compressions(self, faces: Array) -> Array:
        """Return how deep stones are in each other at their joints (steps, joints) [m]."""
        gap, rotation, slip = np.moveaxis(faces, -2, 0)
        length, middle = self.model.structure.overlaps(slip)
        turn = 2.0 * np.sin(0.5 * rotation)
        depths = turn * middle + 0.5 * length * np.abs(turn) - gap
        return np.maximum(depths[:, self._joints], 0.0)

    @cached_property
    def _joints(self) -> NDArray[np.intp]:
        """Numbers of the joints between stones."""
        return np.flatnonzero(mark_stone_joints(self.model.structure))

    @cached_property
    def _gaps(self) -> Array:
        """Gaps at the start of blocks and the ground; infinite with fill (b + 1, b + 1) [m]."""
        motions = self._fit_motions(self._corners[None])[0]
        gaps = measure_gaps(self._bodies, self._world, motions)
        fill = list(find_yielding_blocks(self.model.structure))
        gaps[fill] = gaps[:, fill] = np.inf
        return gaps

    @cached_property
    def _limits(self) -> Array:
        """Gaps below which blocks have met, apart from compression in joints (b + 1, b + 1) [m]."""
        # arcs are chords here, so that blocks may be in each other as built
        return np.where(np.isinf(self._gaps), -np.inf, np.minimum(self._gaps, 0.0) - self.tolerance)

    @cached_property
    def _room(self) -> Array:
        """Sum of displacements without which two blocks cannot meet (b + 1, b + 1) [m]."""
        pairs, room = self.model.structure.pairs, np.maximum(self._gaps, 0.0) + self.tolerance
        room[tuple(pairs.T)] = room[tuple(pairs.T[::-1])] = np.inf
        return room

    @cached_property
    def _world(self) -> PlacedPieces:
        """Workspace of the pieces."""
        return allocate_pieces(self._bodies)

    @cached_property
    def _bodies(self) -> Bodies:
        """Convex pieces of all blocks."""
        structure = self.model.structure
        # the level of the ground matters to loose stones alone
        lowest = min(block.points[:, 1].min() for block in structure.blocks)
        return make_bodies(structure, 0.0, None if self.model.large_displacements else lowest)

    @cached_property
    def _owner(self) -> NDArray[np.intp]:
        """Number of the block of each corner, block by block (c,)."""
        return self.model.observer().corner_blocks

    @cached_property
    def _first(self) -> NDArray[np.intp]:
        """First corner of each free block."""
        return np.flatnonzero(np.diff(self._owner, prepend=-1))

    @cached_property
    def _places(self) -> NDArray[np.complex128]:
        """Corners as built, x + i y, so that a rotation is a product (c,) [m]."""
        cells = self.model.cells
        return _as_complex(cells.places[cells.corners(self.model.structure)])

    @cached_property
    def _corners(self) -> Array:
        """Displacements of the corners at the start (c, 2) [m]."""
        observer = self.model.observer()
        return observer.corners(observer.read(self.start.q))

    def _fit_motions(self, corners: Array) -> Array:
        """Return the rigid motions of all blocks that fit displacements of corners best.

        Args:
            corners: displacements (steps, c, 2) [m].

        Returns:
            Poses (steps, n_blocks, 3) [m, m, rad].
        """
        structure, places = self.model.structure, self._places
        first, counts = self._first, np.diff(self._first, append=len(self._owner))
        free = self._owner[first]

        def mean(values: NDArray[Any]) -> NDArray[Any]:
            return np.add.reduceat(values, first, axis=-1) / counts

        middle, moved = mean(places), mean(_as_complex(corners))
        arms = places - np.repeat(middle, counts)
        after = arms + _as_complex(corners) - np.repeat(moved, counts, axis=-1)
        # least squares: the angle of the sum of the products
        turn = np.angle(mean(np.conj(arms) * after))
        centroids = _as_complex(structure.centroids[list(free)])
        motion = moved + (np.exp(1.0j * turn) - 1.0) * (centroids - middle)
        poses = np.tile(self.model.support_motion, (len(corners), 1, 1))
        poses[:, free] = np.stack([motion.real, motion.imag, turn], axis=-1)
        return poses


def _as_complex(points: Array) -> NDArray[np.complex128]:
    """Return points (…, 2) as complex numbers x + i y (…,)."""
    return points[..., 0] + 1.0j * points[..., 1]


def is_overturning(model: Model, state: State, min_rotation: float = 0.05) -> bool:
    """Return whether a joint has rotated by more than an angle [rad] and blocks still move."""
    return _largest_rotation(model, state) > min_rotation and not _is_still(model, state)


def is_resting(model: Model, state: State, shaken: bool) -> bool:
    """Return whether blocks are still, or vibrate too weakly to overturn on a ground at rest.

    `shaken`: the ground still moves.
    """
    return _is_still(model, state) or (not shaken and _only_vibrates(model, state))


def swings_little(history: History) -> bool:
    """Return whether joints at last swing little about where they stay, on a ground at rest."""
    late = history.time >= history.time[-1] - SWING_TIME
    if late.sum() < MIN_SAMPLES or late[0] or history.dataset["ground"].values[late].any():
        return False
    rotations = history.joints["rotation"].values[late]
    return bool(np.ptp(rotations, axis=0).max() <= MAX_SWING * np.abs(rotations).max())


def _only_vibrates(model: Model, state: State) -> bool:
    """Return whether blocks move too weakly to overturn on a ground at rest.

    The kinetic energy of each block suffices to raise it by less than 2e-4 of the depth of the
    shallowest part. No joint is rotated by more than 0.02 rad.
    """
    # A column of slenderness 20, tilted by 0.02 rad, has to rise by 4.5e-3 of its width to overturn
    if _largest_rotation(model, state) > 0.02:
        return False
    free = list(model.structure.free)
    mass, inertia = masses_of(model.structure)[free].T
    velocities = model.rigid_motions(state.q, state.velocity)[1][free]
    squares = np.sum(velocities[:, :2] ** 2, axis=1) + inertia / mass * velocities[:, 2] ** 2
    return bool(np.max(squares / (2.0 * G)) <= 2e-4 * shallowest_part(model.structure)[0])


def _largest_rotation(model: Model, state: State) -> float:
    """Return the largest rotation of a joint between stones [rad]."""
    observer, stones = model.observer(), mark_stone_joints(model.structure)
    rotations = observer.faces(observer.read(state.q))[1, stones]
    return float(np.abs(rotations).max(initial=0.0))


def _is_still(model: Model, state: State, rest_speed: float = 5e-4) -> bool:
    """Return whether no block moves faster than a speed [m/s]."""
    _, velocities = model.rigid_motions(state.q, state.velocity)
    return bool(np.abs(velocities[:, :2]).max() <= rest_speed)
