"""`Fall`: what of a structure stands, is dislocated or has fallen, from where its blocks lie."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.falling.bodies import Bodies, bodies_of
from archfem.dynamics.falling.state import Loose
from archfem.errors import InvalidInput
from archfem.masonry.naming import listed
from archfem.masonry.softness import yielding_blocks
from archfem.masonry.structure import Structure

KINDS = ("stands", "dislocated", "partly fallen", "fallen")
"""What can be said of a structure, from the best to the worst."""

LOST = KINDS[2:]
"""Those of structures that have lost blocks."""

SUNK = 0.5
"""How far the centroid of a block that is lost has sunk, over the root of the block's area [-]."""

TURNED = np.pi / 4.0
"""How far a block that is lost has turned [rad]."""

DISLOCATED = 0.1
"""Displacement of a dislocated structure, over the depth of its shallowest judged joint [-]."""


@dataclass(frozen=True)
class Fall:
    """What a run has left of a structure.

    A block is *lost* once its centroid has sunk by more than half the root of its area, or once it
    has turned by more than 45°, whatever it then lies on. Fill does not count. The structure

    - *stands*: no block is lost, and none is displaced by more than a tenth of the depth of the
      shallowest judged joint;
    - is *dislocated*: no block is lost, but some are displaced further;
    - is *partly fallen*: blocks are lost, but a ring keeps all of its own;
    - is *fallen*: every ring has lost a block. Where there is no ring, the piers count instead,
      and where there is none, all blocks as one.

    Blocks fall by far more than the limit or by far less, so that the limits hardly matter to the
    kind; they do to the time, by about the time in which a stone falls by its own size. Whether a
    structure falls under a record is sensitive to all else: to the scale of the record, the step,
    friction, and restitution. Give it as a range of scales, from runs at two steps.

    Attributes:
        kind: one of `KINDS`.
        time: of the first frame in which a block was lost, None where none was [s].
        blocks: names of the blocks lost, in the order of the structure.
        residual: largest displacement of a corner of any free block at the end [m].
        resting: whether all blocks had come to rest; if not, more may fall.
    """

    kind: str
    time: float | None
    blocks: tuple[str, ...]
    residual: float
    resting: bool

    @property
    def words(self) -> str:
        """The same as the end of a sentence on the structure."""
        left = f"the largest displacement left is {self.residual:.3g} m"
        still = "" if self.resting else ", and blocks still move"
        if self.time is None:
            return f"{'stands' if self.kind == 'stands' else 'stands, dislocated'}; {left}{still}"
        names = listed(self.blocks, "; ")
        return f"is {self.kind}, at {self.time:.2f} s first; lost: {names}; {left}{still}"


def fall_of(structure: Structure, frames: Iterable[Loose]) -> Fall:
    """Return what a run has left of a structure.

    Args:
        structure: of free and fixed blocks.
        frames: of the run, in order, such as `Falling.frames` gives; what is asked of the end is
            taken from the last.

    Raises:
        InvalidInput: there is no frame.
    """
    fill = yielding_blocks(structure)
    free = [number for number in structure.free if number not in fill] or list(structure.free)
    sizes = np.sqrt([structure.blocks[number].area for number in free])
    lost, time, last = np.zeros(len(free), dtype=bool), None, None
    for last in frames:
        poses = last.poses[free]
        lost |= (poses[:, 1] < -SUNK * sizes) | (np.abs(poses[:, 2]) > TURNED)
        if time is None and lost.any():
            time = last.time
    if last is None:
        raise InvalidInput("a run of no frames says nothing: give those of Falling.frames")
    residual = _residual(bodies_of(structure, 0.0), free, last.poses)
    numbers = [number for number, gone in zip(free, lost, strict=True) if gone]
    return Fall(
        _kind(structure, numbers, residual),
        time,
        tuple(structure.blocks[number].name for number in numbers),
        residual,
        bool(getattr(last, "resting", False)),
    )


def _kind(structure: Structure, lost: list[int], residual: float) -> str:
    """Which of the kinds."""
    if not lost:
        depths = structure.depths[structure.judged] if structure.judged.any() else structure.depths
        return KINDS[int(residual > DISLOCATED * depths.min())]
    blocks = structure.blocks
    roles = {blocks[number].role for number in structure.free}
    role = next((role for role in ("ring", "pier") if role in roles), None)
    if role is None:
        return KINDS[3]
    parts = {blocks[number].part for number in structure.free if blocks[number].role == role}
    whole = parts - {blocks[number].part for number in lost}
    return KINDS[2 if whole else 3]


def _residual(bodies: Bodies, free: list[int], poses: Array) -> float:
    """Largest displacement of a corner of any free block [m]."""
    body = np.repeat(bodies.owner, np.diff(bodies.start))
    arms, pose = bodies.arms, poses[body]
    c, s = np.cos(pose[:, 2]) - 1.0, np.sin(pose[:, 2])
    x = pose[:, 0] + c * arms[:, 0] - s * arms[:, 1]
    y = pose[:, 1] + s * arms[:, 0] + c * arms[:, 1]
    return float(np.hypot(x, y)[np.isin(body, free)].max())
