"""Fall of separated blocks to the ground, and the state of collapse at the end of a run.

While joints hold, forces are those of `joints.large`. Once a joint has turned or slid so far that
its blocks are loose, or stones meet outside their joints, all blocks continue as free rigid blocks
(`dynamics.rigid_body`), with the positions and the momentum of the model, until they rest. The
final positions classify the collapse.
"""

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.dynamics.rigid_body.bodies import (
    Bodies,
    FallFrame,
    LooseBlocks,
    find_unkept_ratios,
    make_bodies,
)
from archfem.dynamics.rigid_body.contact_detection import (
    PlacedPieces,
    allocate_pieces,
    find_meeting,
    measure_gaps,
)
from archfem.dynamics.rigid_body.time_stepping import RigidBlockSimulation
from archfem.dynamics.state import Batch, State
from archfem.errors import DidNotConverge, InvalidInput
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_names
from archfem.models.model import Doubt, Model, check_model
from archfem.motion.motion import Motion
from archfem.units import G, format_mm

logger = logging.getLogger("archfem")

# Kinds of collapse, in order of severity
COLLAPSE_STATES = ("stands", "dislocated", "partly fallen", "fallen")

# Displacement above which a structure is dislocated, over the depth of the shallowest joint [-]
DISLOCATION = 0.1

# Kinds of collapse with lost blocks
FALLEN_STATES = COLLAPSE_STATES[2:]

# Coefficient of friction of loose stones where their joints never slide: that of rough stone
ASSUMED_FRICTION = 0.6


@dataclass(frozen=True, eq=False)
class ReleasedBlocks:
    """Loose rigid blocks in place of a model, and the energies at the transition."""

    start: LooseBlocks  # poses and velocities of all blocks
    kinetic_before: float  # of the model, elastic modes of the blocks included [J]
    kinetic_after: float  # of the rigid blocks [J]


@validate_arguments
def release_blocks(model: Model, state: State) -> ReleasedBlocks:
    """Return the blocks of a model as loose rigid blocks with the same positions and momentum.

    Args:
        model: model of large displacements.
        state: state in the coordinates of the model, with the memory of its joints.

    Raises:
        InvalidInput: the model's displacements are small.
    """
    check_model(model)
    poses, velocities = model.rigid_motions(state.q, state.velocity)
    loaded = model if state.memory is None else model.with_memory(state.memory)
    mass = make_bodies(model.structure, 0.0).mass
    inertia = np.column_stack([mass[:, 0], mass])
    return ReleasedBlocks(
        LooseBlocks(state.time, poses, velocities, strain_energy=loaded.energy(state.q)),
        0.5 * float(state.velocity @ (model.mass @ state.velocity)),
        0.5 * float(np.sum(inertia * velocities**2)),
    )


@dataclass(frozen=True)
class CollapseState:
    """State of collapse at the end of a run.

    A block is *lost* once its centroid has sunk by more than half the root of its area, or once it
    has turned by more than 45°, wherever it comes to rest. Fill does not count. The structure

    - *stands*: no block is lost, and none is displaced by more than a tenth of the depth of the
      shallowest joint of rings and piers;
    - is *dislocated*: no block is lost, but some are displaced further;
    - is *partly fallen*: blocks are lost, but a ring retains all of its own;
    - is *fallen*: every ring has lost a block. Where there is no ring, the piers count instead,
      and where there is none, all blocks as one.

    Blocks fall by far more than the limit or by far less, so that the kind is insensitive to the
    limits; the time is sensitive, by about the time in which a stone falls by its own size. Whether
    a structure falls under a record is sensitive to the scale of the record, the step, friction and
    restitution. State it as a range of scales, from runs at two steps.

    Attributes:
        kind: "stands", "dislocated", "partly fallen" or "fallen".
        time: time of the first frame with a lost block, None without [s].
        blocks: names of the lost blocks, in the order of the structure.
        displacement: largest displacement of any corner of a free block, see `Verdict` [m].
        residual: the same at the end [m].
        resting: whether all blocks were at rest at the end, or vibrated too weakly to overturn; if
            not, more may fall.
    """

    kind: str
    time: float | None
    blocks: tuple[str, ...]
    displacement: float
    residual: float
    resting: bool

    @property
    def text(self) -> str:
        """Kind of collapse, with the time and the lost blocks."""
        still = "" if self.resting else ", while blocks still move"
        if self.time is None:
            return f"{self.kind}{still}"
        return f"{self.kind}, first at {self.time:.2f} s; lost: {join_names(self.blocks)}{still}"


@validate_arguments
def classify_collapse(
    structure: Structure, frames: Iterable[LooseBlocks], start: Array | None = None
) -> CollapseState:
    """Return the state of collapse from the positions of blocks over time.

    Args:
        structure: structure of free and fixed blocks.
        frames: frames of the run in order, such as those of `RigidBlockSimulation.frames`; the last
            one gives the residual displacement.
        start: poses of all blocks from which displacements count, such as those under dead load
            (n_blocks, 3) [m, m, rad]; by default those as built.

    Raises:
        InvalidInput: there is no frame.
    """
    free = list_stones(structure)
    start = np.zeros((len(structure.blocks), 3)) if start is None else start
    corners = _place_corners(structure, free)
    origin, farthest, residual = corners(start), 0.0, 0.0
    sizes = np.sqrt([structure.blocks[number].area for number in free])
    lost, time, last = np.zeros(len(free), dtype=bool), None, None
    for last in frames:
        residual = float(np.linalg.norm(corners(last.poses) - origin, axis=1).max())
        farthest = max(farthest, residual)
        poses = last.poses[free]
        lost |= (poses[:, 1] < -0.5 * sizes) | (np.abs(poses[:, 2]) > np.pi / 4.0)
        if time is None and lost.any():
            time = last.time
    if last is None:
        raise InvalidInput(
            "a run of no frames says nothing: give those of RigidBlockSimulation.frames"
        )
    numbers = [number for number, gone in zip(free, lost, strict=True) if gone]
    return CollapseState(
        _collapse_kind(structure, numbers, residual),
        time,
        tuple(structure.blocks[number].name for number in numbers),
        farthest,
        residual,
        bool(getattr(last, "resting", False)),
    )


def _collapse_kind(structure: Structure, lost: list[int], residual: float) -> str:
    """Return the kind of collapse."""
    if not lost:
        return COLLAPSE_STATES[int(residual > DISLOCATION * _smallest_depth(structure))]
    blocks = structure.blocks
    roles = {blocks[number].role for number in structure.free}
    role = next((role for role in ("ring", "pier") if role in roles), None)
    if role is None:
        return "fallen"
    parts = {blocks[number].part for number in structure.free if blocks[number].role == role}
    return "partly fallen" if parts - {blocks[number].part for number in lost} else "fallen"


def doubt_collapse(structure: Structure, fall: CollapseState) -> list[Doubt]:
    """Return doubts of a structure that has not fallen but was near another kind of collapse."""
    doubts: list[Doubt] = []
    if fall.kind in FALLEN_STATES:
        return doubts
    depth = _smallest_depth(structure)
    # Of 200 random structures, 7 stand although rigid blocks fall or move farther: all moved by
    # more than 0.6, as did 14 of the others. A stack overturns at about 1.
    if fall.displacement > 0.6 * depth:
        cause = (
            f"a corner was displaced by {format_mm(fall.displacement)}, "
            f"{fall.displacement / depth:.2g} of the depth of the shallowest joint: other joints "
            "or time steps may let it fall"
        )
        doubts.append(Doubt(cause, "state a range, `verdict_range`"))
    limit = DISLOCATION * depth
    if limit / 1.5 < fall.residual < 1.5 * limit:
        cause = (
            f"it {'stands' if fall.kind == COLLAPSE_STATES[0] else 'is dislocated'} by little: "
            f"residual displacement {format_mm(fall.residual)}, limit {format_mm(limit)}"
        )
        doubts.append(Doubt(cause, "state the displacement rather than the kind"))
    return doubts


def _smallest_depth(structure: Structure) -> float:
    """Return the depth of the shallowest joint of rings and piers [m]."""
    depths = structure.depths[structure.judged] if structure.judged.any() else structure.depths
    return float(depths.min())


def list_stones(structure: Structure) -> list[int]:
    """Return the free blocks that are no backfill, or all free blocks where there are no others."""
    fill = find_yielding_blocks(structure)
    return [number for number in structure.free if number not in fill] or list(structure.free)


def _place_corners(structure: Structure, blocks: Sequence[int]) -> Callable[[Array], Array]:
    """Return a function from poses to corners of blocks, relative to centroids as built [m]."""
    all_blocks = structure.blocks
    corners = [np.asarray(all_blocks[k].points) - all_blocks[k].centroid for k in blocks]
    owner, (x, y) = np.repeat(blocks, [len(each) for each in corners]), np.concatenate(corners).T

    def place(poses: Array) -> Array:
        pose = poses[owner]
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        return pose[:, :2] + np.column_stack([c * x - s * y, s * x + c * y])

    return place


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
        rotation, slip = np.abs(rotation), np.abs(slip)
        loose = (rotation > self.max_rotation) | (slip >= structure.depths)
        # which blocks are fill takes long to find out, and matters once a joint is loose
        if loose.any():
            loose &= _between_stones(structure)
        if not loose.any():
            return None
        k = int(np.argmax(loose.any(axis=1)))
        joint = int(np.argmax(loose[k]))
        name = structure.joints[joint].name
        if rotation[k, joint] > self.max_rotation:
            return k, f"'{name}' had turned by {rotation[k, joint]:.2g} rad"
        return k, f"'{name}' had slid by {slip[k, joint]:.2g} m, off its face"


@dataclass(frozen=True, eq=False)
class MeetingMonitor:
    """Detection of the step at which stones meet outside their joints.

    A model has contact forces in its joints alone. Once faces have slid these end with the overlap,
    although one of the faces may be longer. Fill does not count, since it adapts.
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
        overruns = self._may_overrun(faces)
        if not overruns and not self._may_meet(corners):
            return None
        limits, pairs = self._limits.copy(), self.model.structure.pairs[self._joints]
        if not overruns:
            limits[tuple(pairs.T)] = limits[tuple(pairs.T[::-1])] = -np.inf
        poses, depths = self._fit_motions(corners), self._compressions(faces)
        k, *pair = find_meeting(self._bodies, self._world, poses, limits, pairs, depths)
        if k < 0:
            return None
        names = [*(f"'{block.name}'" for block in self.model.structure.blocks), "the ground"]
        return k, f"{names[min(pair)]} met {names[max(pair)]}"

    def _may_overrun(self, faces: Array) -> bool:
        """Return whether a face has slid over its end and turned, with large displacements."""
        # beyond the overlap a joint is open, and slip × rotation is how deep a longer face is there
        _, rotation, slip = np.abs(faces).max(axis=0)
        return self.model.large_displacements and bool(np.any(rotation * slip > self.tolerance))

    def _may_meet(self, corners: Array) -> bool:
        """Return whether any blocks without a joint have moved by more than is between them."""
        farthest = np.maximum(
            corners.max(axis=0) - self._corners, self._corners - corners.min(axis=0)
        )
        distances = np.hypot(*farthest.T)
        reach = np.zeros(len(self._room))
        # displacements of a rigid block are linear, and arcs bulge by half of a chord at most
        reach[self._owner[self._first]] = 2.0 * np.maximum.reduceat(distances, self._first)
        return bool(np.any(reach[:, None] + reach > self._room))

    def _compressions(self, faces: Array) -> Array:
        """Return how deep stones are in each other at their joints (steps, joints) [m]."""
        gap, rotation, slip = np.moveaxis(faces[..., self._joints], -2, 0)
        overlap = np.maximum(self.model.structure.depths[self._joints] - np.abs(slip), 0.0)
        depths: Array = np.maximum(0.5 * overlap * np.abs(rotation) - gap, 0.0)
        return depths

    @cached_property
    def _joints(self) -> NDArray[np.intp]:
        """Numbers of the joints between stones."""
        return np.flatnonzero(_between_stones(self.model.structure))

    @cached_property
    def _gaps(self) -> Array:
        """Gaps at the start of blocks and the ground; infinite with fill (b + 1, b + 1) [m]."""
        derived, start = self.model.derived, self.start.q.tobytes()
        if derived.get("gaps", (b"",))[0] != start:
            motions = self._fit_motions(self._corners[None])[0]
            gaps = measure_gaps(self._bodies, self._world, motions)
            fill = list(find_yielding_blocks(self.model.structure))
            gaps[fill] = gaps[:, fill] = np.inf
            derived["gaps"] = start, gaps
        gaps = derived["gaps"][1]
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
        if self.model.large_displacements:
            return make_bodies(structure, 0.0)
        # the level of the ground matters to loose stones alone
        return make_bodies(
            structure, 0.0, min(block.points[:, 1].min() for block in structure.blocks)
        )

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
            means: NDArray[Any] = np.add.reduceat(values, first, axis=-1) / counts
            return means

        middle, moved = mean(places), mean(_as_complex(corners))
        arms = places - np.repeat(middle, counts)
        after = arms + _as_complex(corners) - np.repeat(moved, counts, axis=-1)
        # least squares: the angle of the sum of the products
        turn = np.angle(mean(np.conj(arms) * after))
        centroids = _as_complex(np.array([structure.blocks[k].centroid for k in free]))
        motion = moved + (np.exp(1.0j * turn) - 1.0) * (centroids - middle)
        poses = np.tile(self.model.support_motion, (len(corners), 1, 1))
        poses[:, free] = np.stack([motion.real, motion.imag, turn], axis=-1)
        return poses


def _as_complex(points: Array) -> NDArray[np.complex128]:
    """Return points (…, 2) as complex numbers x + i y (…,)."""
    return points[..., 0] + 1.0j * points[..., 1]


def _between_stones(structure: Structure) -> NDArray[np.bool_]:
    """Return whether joints have no fill on either side (j,)."""
    return ~np.isin(structure.pairs, find_yielding_blocks(structure)).any(axis=1)


def is_overturning(model: Model, state: State, min_rotation: float = 0.05) -> bool:
    """Return whether a joint has rotated by more than an angle [rad] and blocks still move."""
    overturns = _largest_rotation(model, state) > min_rotation
    return overturns and not _rests(release_blocks(model, state).start)


def _largest_rotation(model: Model, state: State) -> float:
    """Return the largest rotation of a joint between stones [rad]."""
    observer, stones = model.observer(), _between_stones(model.structure)
    rotations = observer.faces(observer.read(state.q))[1, stones]
    return float(np.abs(rotations).max(initial=0.0))


def simulate_fall(
    model: Model,
    start: State,
    state: State,
    motion: Motion,
    rocking_ratio: float | None = None,
    settling_time: float = 20.0,
) -> tuple[xr.Dataset, CollapseState]:
    """Follow loose blocks until they rest, or until `settling_time` after the motion has ended [s].

    Displacements count from the start of the run. Steps are shortened where they fail. The ratio is
    that of `RigidBlockSimulation`, for the joints where it has an effect.
    """
    released = release_blocks(model, state)
    end = max(motion.duration, state.time) + settling_time
    loose = _with_sliding_joints(model.structure)
    ratios: float | dict[str, float] | None = rocking_ratio
    if rocking_ratio is not None and (unkept := find_unkept_ratios(loose, rocking_ratio)):
        names = {joint.name for joint in loose.joints} - unkept.keys()
        ratios = dict.fromkeys(names, rocking_ratio)
    failure, steps = None, (5e-4, 2.5e-4, 1.25e-4)  # [s]
    for dt in steps:
        simulation = RigidBlockSimulation(loose, dt=dt, rocking_ratio=ratios)
        try:
            frames = list(simulation.frames(released.start, end, motion, spacing=0.02))
        except DidNotConverge as error:
            logger.info("the fall is repeated with shorter steps: %s", error)
            failure = error
            continue
        poses, _ = model.rigid_motions(start.q, start.velocity)
        fall = classify_collapse(model.structure, frames, poses)
        return _fall_dataset(frames, motion, released).assign_attrs(fall_step=dt), fall
    raise DidNotConverge(
        f"loose blocks could not be followed from {state.time:.4g} s on, by steps of "
        f"{1e3 * steps[0]:g} to {1e3 * steps[-1]:g} ms ('{failure}'): compare with "
        "another dt of time_history, or with archfem.dynamics.RigidBlockSimulation from the start"
    ) from failure


def _fall_dataset(
    frames: Sequence[FallFrame], motion: Motion, released: ReleasedBlocks
) -> xr.Dataset:
    """Return the frames of a fall as a dataset."""
    times = np.array([frame.time for frame in frames])
    poses = np.array([frame.poses for frame in frames])
    settling = frames[-1].settling
    attributes = {
        "long_name": "displacement of a block's centroid, and its turn, from where it was built",
        "units": "m, m, rad",
    }
    ground = {"units": "m/s2", "long_name": "acceleration of the ground"}
    return xr.Dataset(
        {
            "fall_pose": (("fall_frame", "block", "pose"), poses, attributes),
            "fall_ground": (("fall_frame", "axis"), motion.at(times), ground),
        },
        {"fall_time": ("fall_frame", times, {"units": "s"}), "pose": ["x", "y", "turn"]},
        {
            "handover_strain": released.start.strain_energy,
            "handover_kinetic": np.array([released.kinetic_before, released.kinetic_after]),
            "fall_violation": settling.residual,
            "fall_unsettled": settling.unsettled_share,
        },
    )


def doubt_rocking_ratio(structure: Structure, ratio: float | None) -> list[Doubt]:
    """Return a doubt where loose blocks keep more at an impact than the damping was to give."""
    unkept = {} if ratio is None else find_unkept_ratios(_with_sliding_joints(structure), ratio)
    if not unkept:
        return []
    doubt = Doubt(
        f"the damping was to give a restitution of {ratio:g}, but loose blocks keep at least "
        f"{min(unkept.values()):.4g} at {join_names(sorted(unkept))} (Housner)",
        "give `restitution_damping` at least that",
    )
    return [doubt]


def doubt_loose_friction(structure: Structure) -> list[Doubt]:
    """Return a doubt where loose stones slide by other properties than their joints."""
    joints = [structure.joints[k] for k in np.flatnonzero(_between_stones(structure))]
    held = [joint.name for joint in joints if not joint.contact.slides]
    cohesive = [j.name for j in joints if j.contact.slides and j.contact.cohesion > 0.0]
    doubts = []
    if held:
        cause = (
            f"loose stones have a coefficient of friction of {ASSUMED_FRICTION:g} where their "
            f"joints never slide: {join_names(held)}"
        )
        doubts.append(Doubt(cause, "give these joints a coefficient of friction"))
    if cohesive:
        cause = f"loose stones have no cohesion, in intact joints too: {join_names(cohesive)}"
        doubts.append(Doubt(cause, "compare with joints without cohesion throughout"))
    return doubts


def standing_state(model: Model, start: State, state: State, shaken: bool) -> CollapseState:
    """Return the state of collapse without separated blocks; `shaken`: the ground still moves."""
    loose = release_blocks(model, state).start
    poses, _ = model.rigid_motions(start.q, start.velocity)
    resting = _rests(loose) or (not shaken and _only_vibrates(model, state, loose))
    return replace(classify_collapse(model.structure, [loose], poses), resting=resting)


def _only_vibrates(
    model: Model,
    state: State,
    loose: LooseBlocks,
    max_rise: float = 2e-4,
    max_rotation: float = 0.02,
) -> bool:
    """Return whether blocks move too weakly to overturn on a ground at rest.

    The kinetic energy of each block suffices to raise it by less than `max_rise` of the depth of
    the shallowest joint, and no joint is rotated by more than `max_rotation` [rad].
    """
    # A column of slenderness 20, tilted by 0.02 rad, has to rise by 4.5e-3 of its width to overturn
    if _largest_rotation(model, state) > max_rotation:
        return False
    free = list(model.structure.free)
    mass, inertia = make_bodies(model.structure, 0.0).mass[free].T
    velocities = loose.velocities[free]
    squares = np.sum(velocities[:, :2] ** 2, axis=1) + inertia / mass * velocities[:, 2] ** 2
    return bool(np.max(squares / (2.0 * G)) <= max_rise * _smallest_depth(model.structure))


def _rests(loose: LooseBlocks, rest_speed: float = 5e-4) -> bool:
    """Return whether no block moves faster than a speed [m/s]."""
    return bool(np.abs(loose.velocities[:, :2]).max() <= rest_speed)


def _with_sliding_joints(structure: Structure) -> Structure:
    """Return the structure without cohesion, and with friction in joints that never slide."""
    joints = []
    for joint in structure.joints:
        coefficient = joint.contact.coefficient if joint.contact.slides else ASSUMED_FRICTION
        contact = replace(joint.contact, friction=coefficient, cohesion=0.0)
        joints.append(replace(joint, contact=contact))
    return replace(structure, joints=tuple(joints))
