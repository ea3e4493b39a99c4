"""Fall of separated blocks to the ground, and the state of collapse at the end of a run.

While joints hold, forces are those of `joints.large`. Once a joint has turned or slid so far that
its blocks are loose, they continue as free rigid blocks (`dynamics.rigid_body`), with the positions
and the momentum of the model, until they rest. The final positions classify the collapse.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.dynamics.rigid_body.bodies import FallFrame, LooseBlocks, make_bodies
from archfem.dynamics.rigid_body.time_stepping import RigidBlockSimulation
from archfem.dynamics.state import Batch, State
from archfem.errors import InvalidInput
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_names
from archfem.models.model import Model, check_model
from archfem.motion.motion import Motion

# Kinds of collapse, in order of severity
COLLAPSE_STATES = ("stands", "dislocated", "partly fallen", "fallen")

# Kinds of collapse with lost blocks
FALLEN_STATES = COLLAPSE_STATES[2:]


@dataclass(frozen=True, eq=False)
class ReleasedBlocks:
    """Loose rigid blocks in place of a model, and the energies at the transition."""

    start: LooseBlocks  # poses and velocities of all blocks
    strain_energy: float  # of joints and blocks, lost at the transition to rigid blocks [J]
    kinetic_before: float  # of the model, elastic modes of the blocks included [J]
    kinetic_after: float  # of the rigid blocks [J]


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
        LooseBlocks(state.time, poses, velocities),
        loaded.energy(state.q),
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
        resting: whether all blocks were at rest at the end; if not, more may fall.
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


def _collapse_kind(
    structure: Structure, lost: list[int], residual: float, dislocation: float = 0.1
) -> str:
    """Return the kind of collapse; `dislocation` is relative to the shallowest joint [-]."""
    if not lost:
        depths = structure.depths[structure.judged] if structure.judged.any() else structure.depths
        return COLLAPSE_STATES[int(residual > dislocation * depths.min())]
    blocks = structure.blocks
    roles = {blocks[number].role for number in structure.free}
    role = next((role for role in ("ring", "pier") if role in roles), None)
    if role is None:
        return "fallen"
    parts = {blocks[number].part for number in structure.free if blocks[number].role == role}
    return "partly fallen" if parts - {blocks[number].part for number in lost} else "fallen"


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
        loose &= _between_stones(structure)
        if not loose.any():
            return None
        k = int(np.argmax(loose.any(axis=1)))
        joint = int(np.argmax(loose[k]))
        name = structure.joints[joint].name
        if rotation[k, joint] > self.max_rotation:
            return k, f"'{name}' had turned by {rotation[k, joint]:.2g} rad"
        return k, f"'{name}' had slid by {slip[k, joint]:.2g} m, off its face"


def _between_stones(structure: Structure) -> NDArray[np.bool_]:
    """Return whether joints have no fill on either side (j,)."""
    return ~np.isin(structure.pairs, find_yielding_blocks(structure)).any(axis=1)


def is_overturning(model: Model, state: State, min_rotation: float = 0.05) -> bool:
    """Return whether a joint has rotated by more than an angle [rad] and blocks still move."""
    observer, stones = model.observer(), _between_stones(model.structure)
    rotations = observer.faces(observer.read(state.q))[1, stones]
    overturns = float(np.abs(rotations).max(initial=0.0)) > min_rotation
    return overturns and not _rests(release_blocks(model, state).start)


def simulate_fall(
    model: Model,
    start: State,
    state: State,
    motion: Motion,
    rocking_ratio: float | None = None,
    settling_time: float = 20.0,
) -> tuple[xr.Dataset, CollapseState]:
    """Follow loose blocks until they rest, or until `settling_time` after the motion has ended [s].

    Displacements count from the start of the run. The ratio is that of `RigidBlockSimulation`.
    """
    released = release_blocks(model, state)
    end = max(motion.duration, state.time) + settling_time
    simulation = RigidBlockSimulation(
        _with_sliding_joints(model.structure), rocking_ratio=rocking_ratio
    )
    frames = list(simulation.frames(released.start, end, motion, spacing=0.02))
    poses, _ = model.rigid_motions(start.q, start.velocity)
    fall = classify_collapse(model.structure, frames, poses)
    return _fall_dataset(frames, motion, released), fall


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
            "handover_strain": released.strain_energy,
            "handover_kinetic": np.array([released.kinetic_before, released.kinetic_after]),
            "fall_residual": settling.residual,
            "fall_unsettled": settling.unsettled_share,
        },
    )


def standing_state(model: Model, start: State, state: State) -> CollapseState:
    """Return the state of collapse of a structure without separated blocks."""
    loose = release_blocks(model, state).start
    poses, _ = model.rigid_motions(start.q, start.velocity)
    return replace(classify_collapse(model.structure, [loose], poses), resting=_rests(loose))


def _rests(loose: LooseBlocks, rest_speed: float = 5e-4) -> bool:
    """Return whether no block moves faster than a speed [m/s]."""
    return bool(np.abs(loose.velocities[:, :2]).max() <= rest_speed)


def _with_sliding_joints(structure: Structure, friction: float = 0.6) -> Structure:
    """Return the structure without cohesion, and with friction in joints that never slide."""
    joints = []
    for joint in structure.joints:
        coefficient = joint.contact.coefficient if joint.contact.slides else friction
        contact = replace(joint.contact, friction=coefficient, cohesion=0.0)
        joints.append(replace(joint, contact=contact))
    return replace(structure, joints=tuple(joints))
