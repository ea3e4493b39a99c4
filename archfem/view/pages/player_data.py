"""Data of the player of a run: structure, displacements and joint histories, packed as text.

The page draws frames from displacements and joint histories. If they exceed the size limit, every
second step is left out, or three of four, and so on; the page shows by how much it was thinned.
"""

import json
import zlib
from base64 import b64encode
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import assessed_joints, describe_assessed_joints, sliding_limits
from archfem.masonry.block import Block
from archfem.masonry.structure import Structure, rigid_motion_matrix
from archfem.models.model import Model, check_coordinate_count, check_model
from archfem.view import positions
from archfem.view.joint_marks import DRAWN_DISPLACEMENT, joint_pairs, round_magnification

# Default size of the packed part of a player [bytes]
MAX_PACKED_BYTES = 3_000_000


@dataclass(frozen=True, eq=False)
class Outlines:
    """Corners of all blocks, one block after another; arcs are replaced by chords."""

    structure: Structure  # structure of the blocks

    @cached_property
    def rings(self) -> list[Array]:
        """Outline of each block (k, 2) [m]."""
        # a smaller distance of a chord from its arc cannot be seen
        tolerance = 2e-4 * self.structure.size
        return [block.drawn(_count_chords(block, tolerance)) for block in self.structure.blocks]

    @cached_property
    def points(self) -> Array:
        """Corners of all blocks (p, 2) [m]."""
        return np.concatenate(self.rings)

    @cached_property
    def block(self) -> NDArray[np.intp]:
        """Number of the block of each corner (p,)."""
        return np.repeat(np.arange(len(self.rings)), [len(ring) for ring in self.rings])

    def displacements(self, model: Model, fields: Array) -> Array:
        """Return displacements of the corners in each field (frames, p, 2) [m]."""
        matrix, supports = self._interpolation(model), np.zeros_like(self.points)
        for number, block in enumerate(self.structure.blocks):
            if block.fixed:
                own = self.block == number
                motion = rigid_motion_matrix(self.points[own], block.centroid)
                supports[own] = motion @ model.support_motion[number]
        frames = [matrix @ model.cells.displacement(q).ravel() for q in fields]
        return np.array(frames).reshape(len(fields), -1, 2) + supports

    def _interpolation(self, model: Model) -> sparse.csr_matrix:
        """Return the matrix from displacements of the cells' points to those of the corners."""
        # a corner rotates with the nearest edge, which is exact for rigid blocks at any rotation
        cells, rows = model.cells, []
        zero = sparse.csr_matrix((2, 2 * len(cells.places)))
        for point, number in zip(self.points, self.block.tolist(), strict=True):
            if self.structure.blocks[number].fixed:
                rows.append(zero)
                continue
            edge, weights = cells.edge_weights(number, point)
            columns = np.repeat(2 * edge, 2) + np.tile([0, 1], 2)
            place = np.repeat([0, 1], 4), np.tile(columns, 2)
            rows.append(sparse.csr_matrix((weights.ravel(), place), zero.shape))
        return sparse.vstack(rows, format="csr")


def _count_chords(block: Block, tolerance: float) -> int:
    """Return the number of chords that keep within a distance [m] of an arc; 1 for a polygon."""
    if block.centre is None:
        return 1
    arms = block.points - np.array(block.centre)
    length = np.linalg.norm(arms, axis=1)
    cosines = [arms[k] @ arms[k + 1] / (length[k] * length[k + 1]) for k in (0, 2)]
    angle = float(np.arccos(np.clip(min(cosines), -1.0, 1.0)))
    # a chord of the angle α lies at most r α² / 8 from its arc
    return max(1, int(np.ceil(angle / np.sqrt(8.0 * tolerance / length.max()))))


@dataclass
class PackedArrays:
    """Arrays over time as text: integers of a quantum, differences, deflate, base64."""

    # Consecutive values are similar: their differences are small. Bytes of equal significance stand
    # together, which deflate compresses better.

    # name, shape (series, samples) and quantum of each array, in the order of the bytes
    head: list[dict[str, Any]] = field(default_factory=list)
    _planes: list[bytes] = field(default_factory=list)

    def add(self, name: str, values: Array, quantum: float = 0.0) -> None:
        """Add an array (series, samples); the default quantum is 1/4000 of its largest value."""
        quantum = quantum or float(np.nanmax(np.abs(values), initial=0.0)) / 4000 or 1.0
        values = np.asarray(values, float)
        known = np.isfinite(values)
        integers = np.rint(np.where(known, values, 0.0) / quantum)
        # the page reads this number as undefined
        integers = np.where(known, integers, -(2**29)).astype(np.int64)
        steps = np.diff(integers, axis=1, prepend=0)
        folded = ((steps << 1) ^ (steps >> 63)).astype("<u4")  # 0, -1, 1, -2, … as 0, 1, 2, 3, …
        self._planes.append(folded.ravel().view(np.uint8).reshape(-1, 4).T.tobytes())
        self.head.append({"name": name, "shape": list(values.shape), "quantum": quantum})

    def add_times(self, name: str, times: Array) -> None:
        """Add times [s], to a microsecond."""
        self.add(name, times[None], 1e-6)

    @property
    def text(self) -> str:
        """All arrays, as text."""
        return b64encode(zlib.compress(b"".join(self._planes), 6)).decode("ascii")


@dataclass(frozen=True, eq=False)
class Scene:
    """Content of the player of a run."""

    structure: Structure  # structure of the run
    run: History  # the history shown
    # model of the run; without it or recorded fields, blocks are drawn undeformed
    model: Model | None = None
    title: str = ""  # above the structure
    max_bytes: int = MAX_PACKED_BYTES  # size limit of the packed part
    missing_reason: str = ""  # why there are no displacements, if there are none

    # largest V / N that is shown [-]; a joint with more is about to open
    max_friction_ratio: ClassVar[float] = 5.0

    def __post_init__(self) -> None:
        """Refuse a run of another structure or model."""
        if self.run.joints.sizes["joint"] != len(self.structure.joints):
            raise InvalidInput(
                f"the run has {self.run.joints.sizes['joint']} joints, and the structure "
                f"{len(self.structure.joints)}: give the structure, or model, of the run"
            )
        if self.model is not None and "q" in self.run.dataset:
            check_model(self.model)
            check_coordinate_count(self.model, self.run.dataset.sizes["coordinate"])

    @cached_property
    def outlines(self) -> Outlines:
        """Outlines of the blocks."""
        return Outlines(self.structure)

    @cached_property
    def falls(self) -> positions.FallingBlocks | None:
        """Positions of loose blocks; None if no block came loose."""
        return positions.FallingBlocks.of(self.structure, self.run)

    @cached_property
    def moved(self) -> tuple[Array, Array, Array] | None:
        """Times (f,) and displacements of outlines (f, p, 2) and joint ends (f, n_joints, 2, 2)."""
        if self.model is None or "q" not in self.run.dataset:
            return self.peak
        times, fields = positions.recorded_fields(self.run)
        between = (times[-1] - times[0]) / max(len(times) - 1, 1)
        # more than 40 frames per second cannot be distinguished
        chosen = _thin_out(len(times), int(1.0 / (40.0 * between)) if between > 0.0 else 1)
        joint_ends = self.model.observer().joint_ends
        ends = np.array([joint_ends(q) for q in fields[chosen]])
        moved = self.outlines.displacements(self.model, fields[chosen])
        more = len(self.points) - moved.shape[1]  # of grains, which are a point before the fall
        return times[chosen], np.pad(moved, ((0, 0), (0, more), (0, 0))), ends

    @cached_property
    def peak(self) -> tuple[Array, Array, Array] | None:
        """Time and displacements as of frames, of the largest displacement alone."""
        if (time := positions.peak_instant(self.run)) is None:
            return None
        corners = self.outlines.points, self.outlines.block
        points = positions.peak_displacements(self.structure, self.run, *corners)
        ends = positions.peak_joint_ends(self.structure, self.run)
        return np.array([time]), points[None], ends[None]

    @cached_property
    def fallen(self) -> tuple[Array, Array] | None:
        """Times (f,) and displacements of the outlines (f, p, 2) while blocks fall."""
        if self.falls is None:
            return None
        points, block = self.outlines.points, self.outlines.block
        places = []
        for time in self.falls.times.tolist():
            blocks, grains = self.falls.places(points, block, time), self.grains(time)
            if grains:  # the body in their place becomes a point within one of them
                blocks[np.isin(block, self.falls.broken)] = grains[0].mean(axis=0)
            places.append(np.concatenate([blocks, *grains]))
        return self.falls.times, np.array(places) - self.points

    def grains(self, time: float) -> list[Array]:
        """Return the outlines of the grains of fill at a time of the fall, each (k, 2) [m]."""
        return [] if self.falls is None else self.falls.grain_outlines(time)

    @cached_property
    def points(self) -> Array:
        """Corners at rest (p, 2) [m]: of blocks, and those of grains in one point below these."""
        structure, count = self.structure, sum(len(each) for each in self.grains(0.0))
        hidden = np.tile(structure.centroids[structure.free[0]], (count, 1))
        return np.concatenate([self.outlines.points, hidden])

    @cached_property
    def magnification(self) -> float:
        """Default magnification: a round number that makes displacements visible [-]."""
        if self.falls is not None:
            return 1.0
        if self.moved is not None:
            return round_magnification(float(np.abs(self.moved[1]).max()) / self.structure.size)
        if "opening" in self.run.joints:  # seen as a gap of a third of the depth
            joints = assessed_joints(self.run.joints)
            share = float(joints["opening"].max()) / float(joints["depth"].mean())
            return round_magnification(3.0 * DRAWN_DISPLACEMENT * share)
        return 1.0

    @cached_property
    def initial_time(self) -> float:
        """Time shown at first, and in print [s]: of the largest displacement, if it is known."""
        time = positions.peak_instant(self.run)
        return positions.first_motion_instant(self.run) if time is None else time

    @cached_property
    def marks(self) -> set[str]:
        """Kinds of marks that any instant shows: "hinge", "slip", "gap"."""
        flags = _encode_flags(assessed_joints(self.run.joints)).astype(int)
        shown = {"hinge": (flags & 3) != 1, "slip": (flags & 4) != 0, "gap": (flags & 8) != 0}
        return {kind for kind, found in shown.items() if found.any()}

    @cached_property
    def initial_joint(self) -> int:
        """Number of the joint shown at first: then of the largest |e|, or open."""
        joints = assessed_joints(self.run.joints).sel(time=self.initial_time, method="nearest")
        largest = abs(joints["eccentricity"]).where(~joints["open"], 0.5)
        return int(joints["joint"].values[int(largest.fillna(0.5).argmax("joint"))])

    @cached_property
    def packed(self) -> tuple[PackedArrays, int]:
        """Arrays over time, thinned until they fit, and the number of steps per stored step."""
        every = 1
        while True:
            pack = self._pack(every)
            if len(pack.text) <= self.max_bytes or every >= len(self.run.time):
                return pack, every
            every *= 2

    def _pack(self, every: int) -> PackedArrays:
        """Pack one of `every` steps, and one of `every // 2` frames."""
        times = self.run.time
        steps = np.append(_thin_out(len(times), every), np.argmin(abs(times - self.initial_time)))
        pack, joints = PackedArrays(), self.run.joints.isel(time=np.unique(steps))
        pack.add_times("time", joints["time"].values)
        e, ratio, normal = (joints[key].values.T for key in ("eccentricity", "friction", "N"))
        pack.add("e", e, 1e-3)
        pack.add("ratio", np.minimum(ratio, self.max_friction_ratio), 1e-3)
        pack.add("normal", normal)
        if "opening" in joints:
            pack.add("opening", joints["opening"].values.T)
        pack.add("flags", _encode_flags(joints).T, 1.0)
        times, ground = positions.ground_acceleration(self.run)
        pack.add_times("ground_time", times)
        pack.add("ground", ground.T)
        for name, motion in (("frame", self.moved), ("fall", self.fallen)):
            if motion is not None:
                frames = _thin_out(len(motion[0]), every // 2)
                pack.add_times(f"{name}_time", motion[0][frames])
                for places, values in zip(("points", "ends"), motion[1:], strict=False):
                    pack.add(f"{name}_{places}", values[frames].reshape(len(frames), -1).T)
        return pack

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Lower left and upper right corner of the visible region (2,) [m]."""
        points, size = self.points, self.structure.size
        margin, visible = 0.04 * size, [points]
        if self.moved is not None:
            # the reader may magnify displacements somewhat more
            scaled = 1.2 * self.magnification * self.moved[1]
            visible += [points + scaled.min(axis=0), points + scaled.max(axis=0)]
        low, high = _bounds(np.concatenate(visible), margin)
        if self.fallen is not None and self.falls is not None:
            # loose blocks are shown up to half a structure's size away
            fall_low, fall_high = _bounds((points + self.fallen[1]).reshape(-1, 2), margin)
            low = np.minimum(low, np.maximum(fall_low, low - 0.5 * size))
            high = np.maximum(high, np.minimum(fall_high, high + 0.5 * size))
            low[1] = min(low[1], self.falls.level - margin)
        return low, high

    def _blocks(self) -> list[dict[str, Any]]:
        """Return name, kind and number of corners of the blocks, and of the grains of fill."""
        names = [block.name for block in self.structure.blocks]
        kinds, rings = positions.block_kinds(self.structure), self.outlines.rings
        if self.falls is not None and (grains := self.grains(0.0)):
            owners = self.falls.owners[-len(grains) :]
            names += [f"grain of {names[number]}" for number in owners]
            kinds, rings = kinds + ["soil"] * len(grains), rings + grains
        return [
            {"name": name, "kind": kind, "count": len(ring)}
            for name, kind, ring in zip(names, kinds, rings, strict=True)
        ]

    @cached_property
    def data(self) -> dict[str, Any]:
        """All data of the page."""
        pack, every = self.packed
        run, structure, falls = self.run, self.structure, self.falls
        return {
            "title": self.title or str(run.dataset.attrs.get("title", structure.name)),
            "box": _round(self.box),
            "points": _round(self.points),
            "blocks": self._blocks(),
            "joints": _joints(structure, run.joints),
            "links": joint_pairs(structure, run.joints["judged"].values).tolist(),
            "hinge": run.criteria.hinge,
            "magnification": self.magnification,
            "still": self.initial_time,
            "chosen": self.initial_joint,
            "every": every,
            "most": self.max_friction_ratio,
            "end": float(run.time[-1] if falls is None else falls.times[-1]),
            "loose": None if falls is None else float(falls.times[0]),
            "state": None if falls is None else falls.state,
            "level": None if falls is None else falls.level,
            "mechanism": positions.mechanism_instant(run),
            "peak": positions.peak_instant(self.run),
            "note": self.note,
            "pack": pack.head,
            "bytes": pack.text,
        }

    @property
    def note(self) -> str:
        """Sentences on joints that are not assessed, and on missing displacements."""
        moves = self.moved is not None and len(self.moved[0]) > 1
        note = "" if moves else self.missing_reason or _default_note(self.run)
        assessed = describe_assessed_joints(self.run.joints)
        return f"{assessed[:1].upper()}{assessed[1:]}. {note}" if assessed else note

    @property
    def text(self) -> str:
        """Data as JSON for a script element: no text can end the element."""
        return json.dumps(self.data, separators=(",", ":")).replace("<", "\\u003c")


def _thin_out(count: int, every: int) -> NDArray[np.intp]:
    """Return the indices below a count in steps of `every`, and the last index."""
    return np.unique(np.append(np.arange(0, count, max(1, every)), count - 1))


def _default_note(run: History) -> str:
    """Return the note in a page without displacements."""
    opening = ", with the openings of the joints between them" if "opening" in run.joints else ""
    only, apart, them = "no displacements", "", "them"
    if positions.peak_instant(run) is not None:
        only, apart, them = "the largest displacement alone", " at all other instants", "others"
    remedy = f"fields_every = 8 in [record] of its case records {them}"
    return f"The run contains {only}: blocks are drawn undeformed{apart}{opening}; {remedy}."


def _bounds(points: Array, margin: float) -> tuple[Array, Array]:
    """Return the corners of a box around points (n, 2), with a margin."""
    return points.min(axis=0) - margin, points.max(axis=0) + margin


def _encode_flags(joints: xr.Dataset) -> Array:
    """Return flags as integers: hinge + 1, and 4 slides, 8 open, 16 V > 0, 32 rotation > 0."""
    hinge = joints["hinge"].values.astype(float)
    positive = joints["rotation"].values > 0.0 if "rotation" in joints else np.zeros(hinge.shape)
    slide, opened, shear = (joints[key].values for key in ("slide", "open", "V"))
    return hinge + 1.0 + 4 * slide + 8 * opened + 16 * (shear > 0.0) + 32 * positive


def _joints(structure: Structure, joints: xr.Dataset) -> list[dict[str, Any]]:
    """Return name, ends, normal and friction limit of each joint, and whether it is judged."""
    limits = sliding_limits(joints.isel(time=0), History(joints).criteria)
    columns = {
        "name": [joint.name for joint in structure.joints],
        "ends": _round([joint.ends for joint in structure.joints]),
        "normal": _round(structure.normals),
        "judged": joints["judged"].values.astype(bool).tolist(),
        "limit": [round(float(x), 4) if np.isfinite(x) else None for x in limits],
    }
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _round(values: Any) -> Any:
    """Return coordinates [m] as lists, rounded to a tenth of a millimetre."""
    return np.round(np.asarray(values, float), 4).tolist()
