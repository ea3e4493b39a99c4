"""Where blocks and the ends of joints are at some time of a run, loose blocks too."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.dynamics.rigid_body.bodies import make_bodies
from archfem.masonry.structure import Structure


def turned(points: Array, angle: Array) -> Array:
    """Return points, turned about the origin (…, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = np.moveaxis(points, -1, 0)
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def kept_fields(run: History) -> tuple[Array, Array]:
    """Return the fields of a run; where blocks came loose, up to the last."""
    data = run.dataset
    times, fields = data["frame_time"].values, data["q"].values
    if "fall_pose" in data and data.attrs["last_time"] > times[-1]:
        times = np.append(times, data.attrs["last_time"])
        fields = np.concatenate([fields, data["last_q"].values[None]])
    return times, fields


def fields_at(run: History, times: Array) -> Array:
    """Return coordinates at some times, straight between those that were kept (frames, n)."""
    kept, fields = kept_fields(run)
    if len(kept) == 1:
        return np.repeat(fields, len(times), axis=0)
    after = np.searchsorted(kept, times).clip(1, len(kept) - 1)
    share = ((times - kept[after - 1]) / (kept[after] - kept[after - 1]))[:, None]
    return (1.0 - share) * fields[after - 1] + share * fields[after]


@dataclass(frozen=True, eq=False)
class FallingBlocks:
    """Where blocks that came loose in a run are, until they rest."""

    structure: Structure  # whose blocks
    times: Array  # of the frames (f,) [s]
    # displacement of each block's centroid from where it was built, and its turn (f, n_blocks, 3)
    # [m, m, rad]
    poses: Array
    level: float  # of the ground [m]

    @classmethod
    def of(cls, structure: Structure, run: History) -> Self | None:
        """Return the falling part of a run; None where blocks held together."""
        if "fall_pose" not in run.dataset:
            return None
        times, poses = run.dataset["fall_time"].values, run.dataset["fall_pose"].values
        return cls(structure, times, poses, make_bodies(structure, 0.0).level)

    def pose(self, time: float) -> Array:
        """Return the poses of all blocks, straight between two frames (n_blocks, 3)."""
        if len(self.times) == 1:
            return self.poses[0]
        after = int(np.searchsorted(self.times, time).clip(1, len(self.times) - 1))
        before, last = self.times[after - 1], self.times[after]
        share = np.clip((time - before) / (last - before), 0.0, 1.0)
        return (1.0 - share) * self.poses[after - 1] + share * self.poses[after]

    def places(self, points: Array, block: Array, time: float) -> Array:
        """Return where points of the blocks are (m, 2) [m]."""
        poses = self.pose(time)[block]
        centres = np.array([each.centroid for each in self.structure.blocks])[block]
        return centres + poses[:, :2] + turned(points - centres, poses[:, 2])

    def outlines(self, time: float) -> list[Array]:
        """Return the outlines of all blocks, each (k, 2) [m]."""
        drawn = [block.drawn() for block in self.structure.blocks]
        sizes = [len(each) for each in drawn]
        block = np.repeat(np.arange(len(drawn)), sizes)
        return np.split(self.places(np.concatenate(drawn), block, time), np.cumsum(sizes)[:-1])
