"""Positions of blocks over a run, including blocks that came loose, and the ground motion."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
import xarray as xr

from archfem._typing import Array, Numbers
from archfem.dynamics.collapse_state import FALLEN_STATES
from archfem.dynamics.history import Ending, History
from archfem.dynamics.rigid_body.bodies import make_bodies
from archfem.joints.criteria import Criteria, assessed_joints
from archfem.limit.mechanism_count import counted_mechanism, leave_out_walls
from archfem.masonry.block import measure_polygon, rotate
from archfem.masonry.standing import list_own_stones
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure


def block_kinds(structure: Structure) -> list[str]:
    """Return the kind of each block: "support", "soil" or "stone"."""
    soil = find_yielding_blocks(structure)
    return [
        "support" if block.fixed else "soil" if number in soil else "stone"
        for number, block in enumerate(structure.blocks)
    ]


def decisive_instant(run: History) -> float:
    """Return when blocks came loose, else the first mechanism, else largest |e| of a joint [s]."""
    return float(run.dataset["fall_time"][0]) if comes_loose(run) else first_motion_instant(run)


def comes_loose(run: History) -> bool:
    """Return whether blocks came loose in a motion or fell after it, and did not merely rock on."""
    fallen = run.fall is not None and run.fall.kind in FALLEN_STATES
    return "fall_pose" in run.dataset and (fallen or run.ending is not Ending.FINISHED)


def mechanism_instant(run: History) -> float | None:
    """Return the time of the first mechanism, verified or else by count, or None [s]."""
    # enough joints may fail while no block can move: a verified motion comes first
    if (verified := run.mechanisms.get("verified")) is not None:
        return (verified.decisive or verified).time
    found = counted_mechanism(leave_out_walls(run.joints))
    return None if found is None else found.time


def first_motion_instant(run: History) -> float:
    """Return the time of the first mechanism, else of the largest |e| of a joint [s].

    Joints that are hinges at the start, such as a stone's on two others of unequal height, do not
    count: they say nothing of the motion. No joint of a wall in bond counts: a wall alone has the
    instant at which a joint is farthest open or has slid farthest.
    """
    if (time := mechanism_instant(run)) is not None:
        return time
    counted = leave_out_walls(run.joints)
    joints = assessed_joints(counted)
    if not joints.sizes["joint"]:
        joints = assessed_joints(run.joints)
        apart = joints[["opening", "slip"]].to_array()
        apart = abs(apart - apart.isel(time=0)).max(["variable", "joint"])
        return float(run.time[int(apart.argmax("time"))])
    e = abs(joints["eccentricity"])
    e = e.where(e.isel(time=0) < Criteria.of(run.joints).hinge).max("joint")
    return float(run.time[int(e.fillna(0.0).argmax("time"))])


def recorded_fields(run: History) -> tuple[Array, Array]:
    """Return times and coordinates of the recorded fields, up to the instant of collapse."""
    data = run.dataset
    times, fields = data["frame_time"].values, data["q"].values
    if "fall_pose" in data and data.attrs["last_time"] > times[-1]:
        times = np.append(times, data.attrs["last_time"])
        fields = np.concatenate([fields, data["last_q"].values[None]])
    return times, fields


def peak_instant(run: History) -> float | None:
    """Return the time of the largest displacement [s]; None if it is unknown, or blocks fall."""
    if "peak_displacement" not in run.dataset or comes_loose(run):
        return None
    if "fall_pose" in run.dataset:  # a tail after the motion, of which places are not kept
        if run.structure is None:
            return None
        largest = run.dataset["largest_displacement"].values[list_own_stones(run.structure)].max()
        if run.dataset.attrs["displacement"] > 1.01 * largest:
            return None
    return float(run.dataset["peak_displacement"].attrs["time"])


def peak_displacements(structure: Structure, run: History, points: Array, block: Numbers) -> Array:
    """Return displacements of points of blocks at the largest one, linear along edges (p, 2)."""
    corners, moved = run.dataset["peak_displacement"].values, np.zeros(points.shape)
    first = 0
    for number in structure.free:
        start = np.asarray(structure.blocks[number].points)
        along, own = np.roll(start, -1, axis=0) - start, np.flatnonzero(block == number)
        arms = points[own, None] - start
        share = np.clip((arms * along).sum(axis=2) / (along**2).sum(axis=1), 0.0, 1.0)
        edge = np.linalg.norm(arms - share[..., None] * along, axis=2).argmin(axis=1)
        ends = corners[first : first + len(start)], share[np.arange(len(own)), edge, None]
        moved[own] = (1.0 - ends[1]) * ends[0][edge] + ends[1] * np.roll(ends[0], -1, axis=0)[edge]
        first += len(start)
    return moved


def peak_joint_ends(structure: Structure, run: History) -> Array:
    """Return displacements of the ends of joints at the largest one, midway of faces (j, 2, 2)."""
    points = np.tile(structure.ends.reshape(-1, 2), (2, 1))
    blocks = np.repeat(structure.pairs.T, 2, axis=1).ravel()
    return peak_displacements(structure, run, points, blocks).reshape(2, -1, 2, 2).mean(axis=0)


def ground_acceleration(run: History) -> tuple[Array, Array]:
    """Return times and ground acceleration (n, 2) [m/s²], including the fall."""
    data = run.dataset
    if "fall_ground" not in data:
        return run.time, data["ground"].values
    times = np.append(run.time, data["fall_time"].values[1:])
    return times, np.concatenate([data["ground"].values, data["fall_ground"].values[1:]])


def fields_at(run: History, times: Array) -> Array:
    """Interpolate the recorded fields linearly at times (len(times), n)."""
    return _interpolate(*recorded_fields(run), times)


def _interpolate(known: Array, values: Array, times: Array) -> Array:
    """Interpolate values (f, …) at known times (f,) linearly, constant beyond their range."""
    after = np.maximum(np.searchsorted(known, times), 1)
    before, after = after - 1, np.minimum(after, len(known) - 1)
    # beyond the last frame there is no interval; any length gives its value
    length = np.where(after > before, known[after] - known[before], 1.0)
    share = np.clip((times - known[before]) / length, 0.0, 1.0)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return (1.0 - share) * values[before] + share * values[after]


@dataclass(frozen=True, eq=False)
class FallingBlocks:
    """Positions of the blocks from the instant of collapse until they rest."""

    structure: Structure  # undeformed
    times: Array  # of the frames (f,) [s]
    # displacement of each block's centroid, and its rotation (f, n_blocks, 3) [m, m, rad]
    poses: Array
    level: float  # of the ground [m]
    # grains of fill that fall in its place, with their poses; else empty
    grains: xr.Dataset = field(default_factory=xr.Dataset)
    state: str = "loose"  # or "rocking", where blocks merely rock on after the motion

    @classmethod
    def of(cls, structure: Structure, run: History) -> Self | None:
        """Return the fall in a run; None where no block came loose."""
        if "fall_pose" not in run.dataset:
            return None
        times, poses = run.dataset["fall_time"].values, run.dataset["fall_pose"].values
        grains = run.dataset[[key for key in run.dataset if str(key).startswith("grain_")]]
        level, state = make_bodies(structure, 0.0).level, "loose" if comes_loose(run) else "rocking"
        return cls(structure, times, poses, level, grains, state)

    @property
    def broken(self) -> Numbers:
        """Numbers of the bodies of fill that fall as grains."""
        return np.unique(self.grains["grain_block"].values) if self.grains else np.zeros(0, int)

    @property
    def owners(self) -> Numbers:
        """Number of the block of each outline."""
        kept = np.setdiff1d(np.arange(len(self.structure.blocks)), self.broken)
        return np.append(kept, self.grains["grain_block"].values) if self.grains else kept

    def pose(self, time: float) -> Array:
        """Return the poses of all blocks at a time (n_blocks, 3)."""
        return _interpolate(self.times, self.poses, np.array([time]))[0]

    def places(self, points: Array, block: int | Numbers, time: float) -> Array:
        """Return the positions at a time (m, 2) [m] of points of a block, or of one block each."""
        poses = self.pose(time)[block]
        centres = self.structure.centroids[block]
        return centres + poses[..., :2] + rotate(points - centres, poses[..., 2])

    def outlines(self, time: float) -> list[Array]:
        """Return the outlines at a time, each (k, 2) [m], of blocks and then of grains."""
        blocks = enumerate(self.structure.blocks)
        kept = [(number, block) for number, block in blocks if number not in self.broken]
        places = [self.places(block.drawn(), number, time) for number, block in kept]
        return [*places, *self.grain_outlines(time)]

    def grain_outlines(self, time: float) -> list[Array]:
        """Return the outlines of the grains of fill at a time, each (k, 2) [m]."""
        if not self.grains:
            return []
        corners, owner = (self.grains[f"grain_{key}"].values for key in ("corner", "of_corner"))
        poses = _interpolate(self.times, self.grains["grain_pose"].values, np.array([time]))[0]
        outlines = np.split(corners, np.flatnonzero(np.diff(owner)) + 1)
        centres = [measure_polygon(outline)[1] for outline in outlines]
        return [
            centre + pose[:2] + rotate(outline - centre, pose[2])
            for outline, centre, pose in zip(outlines, centres, poses, strict=True)
        ]
