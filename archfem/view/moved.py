"""Where blocks and the ends of joints are at some time of a run, loose blocks too."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.falling.bodies import bodies_of
from archfem.dynamics.history import History
from archfem.joints.moving.poses import pose
from archfem.masonry.structure import Structure
from archfem.models.model import Model
from archfem.models.moving import Moving
from archfem.view.marks import joint_ends, support_shift


def carrier(model: Model) -> Callable[[Array], Array]:
    """Return what gives displacements of both ends of each joint, from coordinates (n,).

    An end is midway between the two blocks. Where displacements may be large, it is that of what
    still overlaps of the two faces, seen along their mean direction.

    Args:
        model: whose joints they are.

    Returns:
        A function that gives (n_joints, 2, 2) [m]: by joint, end (intrados first) and axis.
    """
    if isinstance(model, Moving):
        return lambda q: _overlaps(model, q)
    ends, supports = joint_ends(model), support_shift(model)

    def carried(q: Array) -> Array:
        moved: Array = (ends @ q).reshape(-1, 2, 2) + supports
        return moved

    return carried


def _overlaps(model: Moving, q: Array) -> Array:
    """Displacements of the ends of what overlaps (n_joints, 2, 2) [m]."""
    structure, q = model.structure, np.ascontiguousarray(q, float)
    joints, poses = model.joints, np.zeros((len(structure.joints), 2, 3))
    share = joints.faces.depth / np.bincount(joints.whole, joints.faces.depth)[joints.whole]
    for piece, joint in enumerate(joints.whole):
        for side in range(2):
            poses[joint, side] += share[piece] * np.array(pose(joints.sides, piece, side, q))
    mean, apart = poses.mean(axis=1), poses[:, 1] - poses[:, 0]
    along = turned(structure.tangents, mean[:, 2])
    slip = np.sum(along * apart[:, :2], axis=1)
    half = 0.5 * np.maximum(structure.depths - np.abs(slip), 0.0) * np.cos(0.5 * apart[:, 2])
    middles = structure.middles + mean[:, :2]
    ends = middles[:, None] + np.array([-1.0, 1.0])[:, None] * (half[:, None] * along)[:, None]
    found: Array = ends - structure.ends
    return found


def turned(points: Array, angle: Array) -> Array:
    """Return points, turned about the origin (…, 2).

    Args:
        points: to be turned (…, 2).
        angle: anticlockwise (…) [rad].
    """
    c, s = np.cos(angle), np.sin(angle)
    x, y = np.moveaxis(points, -1, 0)
    found: Array = np.stack([c * x - s * y, s * x + c * y], axis=-1)
    return found


def kept_fields(run: History) -> tuple[Array, Array]:
    """Return the fields of a run; where blocks came loose, up to the last.

    Args:
        run: with fields.

    Returns:
        Times (frames,) [s] and coordinates (frames, n).
    """
    data = run.dataset
    times, fields = data["frame_time"].values, data["q"].values
    if "fall_pose" in data and data.attrs["last_time"] > times[-1]:
        times = np.append(times, data.attrs["last_time"])
        fields = np.concatenate([fields, data["last_q"].values[None]])
    return times, fields


def fields_at(run: History, times: Array) -> Array:
    """Return coordinates at some times, straight between those that were kept (frames, n).

    Args:
        run: with fields.
        times: at which (frames,) [s].
    """
    kept, fields = kept_fields(run)
    if len(kept) == 1:
        return np.repeat(fields, len(times), axis=0)
    after = np.searchsorted(kept, times).clip(1, len(kept) - 1)
    share = ((times - kept[after - 1]) / (kept[after] - kept[after - 1]))[:, None]
    found: Array = (1.0 - share) * fields[after - 1] + share * fields[after]
    return found


@dataclass(frozen=True, eq=False)
class Falls:
    """Where blocks that came loose in a run are, until they rest.

    Attributes:
        structure: whose blocks.
        times: of the frames (f,) [s].
        poses: displacement of each block's centroid from where it was built, and its turn
            (f, n_blocks, 3) [m, m, rad].
        level: of the ground [m].
    """

    structure: Structure
    times: Array
    poses: Array
    level: float

    @classmethod
    def of(cls, structure: Structure, run: History) -> Self | None:
        """Return the falling part of a run; None where blocks held together.

        Args:
            structure: that was shaken.
            run: of it.
        """
        if "fall_pose" not in run.dataset:
            return None
        times, poses = run.dataset["fall_time"].values, run.dataset["fall_pose"].values
        return cls(structure, times, poses, bodies_of(structure, 0.0).level)

    def pose(self, time: float) -> Array:
        """Return the poses of all blocks, straight between two frames (n_blocks, 3).

        Args:
            time: from the first frame to the last [s].
        """
        if len(self.times) == 1:
            only: Array = self.poses[0]
            return only
        after = int(np.searchsorted(self.times, time).clip(1, len(self.times) - 1))
        before, last = self.times[after - 1], self.times[after]
        share = np.clip((time - before) / (last - before), 0.0, 1.0)
        found: Array = (1.0 - share) * self.poses[after - 1] + share * self.poses[after]
        return found

    def places(self, points: Array, block: Array, time: float) -> Array:
        """Return where points of the blocks are (m, 2) [m].

        Args:
            points: as built (m, 2) [m].
            block: number of the block that each belongs to (m,).
            time: from the first frame to the last [s].
        """
        poses = self.pose(time)[block]
        centres = np.array([each.centroid for each in self.structure.blocks])[block]
        found: Array = centres + poses[:, :2] + turned(points - centres, poses[:, 2])
        return found

    def outlines(self, time: float) -> list[Array]:
        """Return the outlines of all blocks, each (k, 2) [m].

        Args:
            time: from the first frame to the last [s].
        """
        drawn = [block.drawn() for block in self.structure.blocks]
        sizes = [len(each) for each in drawn]
        block = np.repeat(np.arange(len(drawn)), sizes)
        return np.split(self.places(np.concatenate(drawn), block, time), np.cumsum(sizes)[:-1])
