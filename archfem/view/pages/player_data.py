"""What the player shows of a run: a structure, its displacements and its joints, packed.

Displacements and resultants are kept, no frames: the page draws them. Where all would be too much,
every second step is left out, or three of four, and so on; the page says so.

Points of the blocks that a page draws, and how they move.

Arrays over time as text in a page: whole numbers of a quantum, differences, deflate, base64.

Neighbours in time are alike, so that their differences are small whole numbers, which deflate packs
well: bytes of like weight stand together. A browser undoes it in a few lines.
"""

import json
import zlib
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import assessed_joints, sliding_limits
from archfem.masonry.block import Block
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, rigid_motion_matrix
from archfem.models.model import Model, check_model
from archfem.view.joint_marks import SWING, linked
from archfem.view.positions import FallingBlocks, kept_fields


@dataclass(frozen=True, eq=False)
class Outlines:
    """Corners of all blocks, one block after another, arcs as chords."""

    structure: Structure  # whose blocks they are

    @cached_property
    def rings(self) -> list[Array]:
        """Outline of each block (k, 2) [m]."""
        # distance of a chord from its arc that is not seen, relative to the size of the structure
        near = 2e-4 * self.structure.size
        return [block.drawn(_chords(block, near)) for block in self.structure.blocks]

    @cached_property
    def points(self) -> Array:
        """All of them (p, 2) [m]."""
        return np.concatenate(self.rings)

    @cached_property
    def block(self) -> NDArray[np.intp]:
        """Number of the block that each point belongs to (p,)."""
        return np.repeat(np.arange(len(self.rings)), [len(ring) for ring in self.rings])

    @cached_property
    def kinds(self) -> list[str]:
        """What each block is drawn as: "support", "soil" or "stone"."""
        soil = find_yielding_blocks(self.structure)
        return [
            "support" if block.fixed else "soil" if number in soil else "stone"
            for number, block in enumerate(self.structure.blocks)
        ]

    def moved(self, model: Model, fields: Array) -> Array:
        """Return displacements of the points (frames, p, 2) [m]."""
        follow, still = self._following(model), self._of_supports(model)
        frames = [follow @ model.cells.displacement(q).ravel() for q in fields]
        return np.array(frames).reshape(len(fields), -1, 2) + still

    def _following(self, model: Model) -> sparse.csr_matrix:
        """Matrix from displacements of the cells' points to those of the outlines.

        A point beside an edge turns with it, which is exact where the block is rigid, however far
        it turns.
        """
        cells, rows = model.cells, []
        still, one = sparse.csr_matrix((2, 2 * len(cells.places))), np.eye(2)
        for point, number in zip(self.points, self.block.tolist(), strict=True):
            if self.structure.blocks[number].fixed:
                rows.append(still)
                continue
            edge, share, away = cells.nearest_edge(number, point)
            along = cells.places[edge[1]] - cells.places[edge[0]]
            across = np.array([-along[1], along[0]])
            turning = np.outer(away, along) + np.outer([-away[1], away[0]], across)
            turned = turning / float(along @ along)
            entries = np.hstack([(1.0 - share) * one - turned, share * one + turned])
            columns = np.repeat(2 * edge, 2) + np.tile([0, 1], 2)
            place = np.repeat([0, 1], 4), np.tile(columns, 2)
            rows.append(sparse.csr_matrix((entries.ravel(), place), still.shape))
        return sparse.vstack(rows, format="csr")

    def _of_supports(self, model: Model) -> Array:
        """Displacements of the points of supports that have moved (p, 2) [m]; 0 of the others."""
        moved = np.zeros_like(self.points)
        for number, block in enumerate(self.structure.blocks):
            if block.fixed:
                own = self.block == number
                motion = rigid_motion_matrix(self.points[own], block.centroid)
                moved[own] = motion @ model.support_motion[number]
        return moved


def _chords(block: Block, near: float) -> int:
    """Chords of each arc of a block that do not leave it farther than that; 1 of a polygon."""
    if block.centre is None:
        return 1
    arms = block.points - np.array(block.centre)
    radius = float(np.linalg.norm(arms, axis=1).max())
    corners = [arms[side : side + 2] for side in (0, 2)]
    angle = max(float(np.arccos(np.clip(_cosine(*pair), -1.0, 1.0))) for pair in corners)
    return max(1, int(np.ceil(angle / np.sqrt(8.0 * near / radius))))


def _cosine(one: Array, other: Array) -> float:
    """Cosine of the angle between two arms."""
    return float(one @ other / (np.linalg.norm(one) * np.linalg.norm(other)))


# Stands for an undefined value (NaN)
NOTHING = -(2**29)


@dataclass
class PackedArrays:
    """Arrays that are being packed."""

    # of each array its shape (series, samples) and its quantum, in the order of the bytes
    head: list[dict[str, Any]] = field(default_factory=list)
    _planes: list[bytes] = field(default_factory=list)

    def add(self, name: str, values: Array, quantum: float) -> None:
        """Add an array."""
        values = np.asarray(values, float)
        known = np.isfinite(values)
        whole = np.where(known, np.rint(np.where(known, values, 0.0) / quantum), NOTHING)
        steps = np.diff(whole.astype(np.int64), axis=1, prepend=0)
        folded = ((steps << 1) ^ (steps >> 63)).astype("<u4")  # 0, -1, 1, -2, … as 0, 1, 2, 3, …
        self._planes.append(folded.ravel().view(np.uint8).reshape(-1, 4).T.tobytes())
        self.head.append({"name": name, "shape": list(values.shape), "quantum": quantum})

    @property
    def text(self) -> str:
        """All arrays, as text."""
        return b64encode(zlib.compress(b"".join(self._planes), 6)).decode("ascii")


def quantum_of(values: Array, levels: int) -> float:
    """Return the quantum that splits the largest size of some values into so many levels."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    return largest / levels or 1.0


def unpacked(head: list[Mapping[str, Any]], text: str) -> dict[str, NDArray[np.float64]]:
    """Return the arrays of a pack by name, as a page reads them."""
    raw = np.frombuffer(zlib.decompress(b64decode(text)), np.uint8)
    found, start = {}, 0
    for each in head:
        count = int(np.prod(each["shape"]))
        planes = raw[start : start + 4 * count].reshape(4, count)
        folded = np.ascontiguousarray(planes.T).view("<u4").reshape(each["shape"]).astype(np.int64)
        whole = np.cumsum((folded >> 1) ^ -(folded & 1), axis=1)
        found[each["name"]] = np.where(whole == NOTHING, np.nan, whole * each["quantum"])
        start += 4 * count
    return found


# Levels of displacements and forces; quantum of e and V / N [-], and of times [s]
FINE, RATIO, INSTANT = 4000, 1e-3, 1e-6

# V / N beyond which a joint is all but open: it is kept as this [-]
MOST = 5.0


# Size of the packed part of a player, unless less is asked for [bytes]
LARGEST = 3_000_000

# Room around the structure, relative to its size
ROOM = 0.04


@dataclass(frozen=True, eq=False)
class Scene:
    """What the player shows of a run."""

    structure: Structure  # that was shaken
    run: History  # what happened
    # that made the run; None where the run kept no fields, or nobody has the model: blocks are
    # then drawn where they stand
    model: Model | None = None
    title: str = ""  # above the picture
    largest: int = LARGEST  # size of the packed part [bytes]
    why_still: str = ""  # why there are no displacements, where there are none

    def __post_init__(self) -> None:
        """Refuse what does not go together."""
        if self.run.joints.sizes["joint"] != len(self.structure.joints):
            raise InvalidInput(
                f"the run has {self.run.joints.sizes['joint']} joints, and the structure "
                f"{len(self.structure.joints)}: give the structure, or model, that was shaken"
            )
        if self.model is None or "q" not in self.run.dataset:
            return
        check_model(self.model)
        kept = self.run.dataset.sizes["coordinate"]
        if kept != self.model.size:
            raise InvalidInput(
                f"the run has {kept} coordinates, and the model {self.model.size}: give the model "
                "that made the run"
            )

    @cached_property
    def outlines(self) -> Outlines:
        """Of the blocks."""
        return Outlines(self.structure)

    @cached_property
    def falls(self) -> FallingBlocks | None:
        """Where loose blocks are; None where none came loose."""
        return FallingBlocks.of(self.structure, self.run)

    @cached_property
    def _frames(self) -> tuple[Array, Array] | None:
        """Times (f,) and coordinates (f, n) of the frames that are worth keeping."""
        if self.model is None or "q" not in self.run.dataset:
            return None
        times, fields = kept_fields(self.run)
        between = (times[-1] - times[0]) / max(len(times) - 1, 1)
        # frames that are worth keeping for each second [Hz]
        every = max(1, int(1.0 / (40.0 * between))) if between > 0.0 else 1
        chosen = np.unique(np.append(np.arange(0, len(times), every), len(times) - 1))
        return times[chosen], fields[chosen]

    @cached_property
    def moved(self) -> tuple[Array, Array, Array] | None:
        """Times (f,) and displacements of outlines (f, p, 2) and joint ends (f, n_joints, 2, 2)."""
        if self._frames is None or self.model is None:
            return None
        times, fields = self._frames
        carried = self.model.observer().joint_ends
        ends = np.array([carried(q) for q in fields])
        return times, self.outlines.moved(self.model, fields), ends

    @cached_property
    def fallen(self) -> tuple[Array, Array] | None:
        """Times (f,) and displacements of the outlines (f, p, 2) while blocks fall."""
        if self.falls is None:
            return None
        points, block = self.outlines.points, self.outlines.block
        places = [self.falls.places(points, block, float(time)) for time in self.falls.times]
        return self.falls.times, np.array(places) - points

    @property
    def true_scale(self) -> bool:
        """Whether displacements are drawn as they are, unless the reader asks otherwise."""
        return self.model is not None and self.model.large_displacements

    @cached_property
    def magnification(self) -> float:
        """A round number by which displacements are seen well [-]."""
        if self.true_scale:
            return 1.0
        if self.moved is not None:
            largest, aim = float(np.abs(self.moved[1]).max()), SWING * self.structure.size
        elif "opening" in self.run.joints:
            joints = assessed_joints(self.run.joints)
            largest = float(joints["opening"].max())
            aim = 0.3 * float(joints["depth"].mean())
        else:
            return 1.0
        steps = np.outer(10.0 ** np.arange(9), [1.0, 2.0, 5.0]).ravel()
        fits = steps[steps * largest <= aim]
        return float(fits[-1]) if largest > 0.0 and len(fits) else 1.0

    @cached_property
    def still(self) -> float:
        """The instant shown at first, and on paper [s]: the first mechanism, or the gravest e."""
        if self.run.mechanism is not None and self.run.mechanism.time is not None:
            return float(self.run.mechanism.time)
        tilt = abs(assessed_joints(self.run.joints)["eccentricity"]).max("joint").fillna(0.0)
        return float(self.run.time[int(tilt.argmax("time"))])

    @cached_property
    def gravest(self) -> int:
        """Number of the joint shown at first: that which leans most, or opens."""
        joints = assessed_joints(self.run.joints)
        worst = abs(joints["eccentricity"]).max("time").where(~joints["open"].any("time"), 0.5)
        return int(joints["joint"].values[int(worst.fillna(0.5).argmax("joint"))])

    @cached_property
    def packed(self) -> tuple[PackedArrays, int]:
        """Arrays over time, as fine as there is room for; and of how many steps one is kept."""
        every = 1
        while True:
            pack = self._pack(every)
            if len(pack.text) <= self.largest or every >= len(self.run.time):
                return pack, every
            every *= 2

    def _pack(self, every: int) -> PackedArrays:
        """Pack one of so many steps, and of frames no more than are as dense."""
        pack, joints = PackedArrays(), self.run.joints.isel(time=self._kept(every))
        pack.add("time", joints["time"].values[None], INSTANT)
        e, ratio, normal = (joints[key].values.T for key in ("eccentricity", "friction", "N"))
        pack.add("e", e, RATIO)
        pack.add("ratio", np.minimum(ratio, MOST), RATIO)
        pack.add("normal", normal, quantum_of(normal, FINE))
        if "opening" in joints:
            opening = joints["opening"].values.T
            pack.add("opening", opening, quantum_of(opening, FINE))
        pack.add("flags", _flags(joints).T, 1.0)
        ground, times = self.run.dataset["ground"].values, self.run.time
        if "fall_ground" in self.run.dataset:
            data = self.run.dataset
            times = np.append(times, data["fall_time"].values[1:])
            ground = np.concatenate([ground, data["fall_ground"].values[1:]])
        pack.add("ground_time", times[None], INSTANT)
        pack.add("ground", ground.T, quantum_of(ground, FINE))
        self._pack_motion(pack, max(1, every // 2))
        return pack

    def _pack_motion(self, pack: PackedArrays, every: int) -> None:
        """Pack displacements: of outlines and joint ends, then of outlines in the fall."""
        for name, found in (("frame", self.moved), ("fall", self.fallen)):
            if found is None:
                continue
            times = found[0]
            chosen = np.unique(np.append(np.arange(0, len(times), every), len(times) - 1))
            pack.add(f"{name}_time", times[chosen][None], INSTANT)
            for what, values in zip(("points", "ends"), found[1:], strict=False):
                rows = values[chosen].reshape(len(chosen), -1).T
                pack.add(f"{name}_{what}", rows, quantum_of(rows, FINE))

    def _kept(self, every: int) -> NDArray[np.intp]:
        """Numbers of the records that are kept, the last and that of the still among them."""
        count = len(self.run.time)
        shown = int(np.argmin(np.abs(self.run.time - self.still)))
        kept: NDArray[np.intp] = np.append(np.arange(0, count, every), [shown, count - 1])
        return np.unique(kept)

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Corners, low and high, of what is seen (2,) [m]."""
        points = self.outlines.points
        spread = [points]
        if self.moved is not None:
            by = 1.2 * self.magnification
            spread += [points + by * self.moved[1].min(axis=0)]
            spread += [points + by * self.moved[1].max(axis=0)]
        size = self.structure.size
        low, high = _around(spread, ROOM * size)
        if self.fallen is not None and self.falls is not None:
            fell = points + self.fallen[1]
            wide, up = _around([fell.min(axis=0), fell.max(axis=0)], ROOM * size)
            low = np.minimum(low, np.maximum(wide, low - 0.5 * size))
            high = np.maximum(high, np.minimum(up, high + 0.5 * size))
            low[1] = min(low[1], self.falls.level - ROOM * size)
        return low, high

    @cached_property
    def data(self) -> dict[str, Any]:
        """All of it, as a page takes it."""
        pack, every = self.packed
        low, high = self.box
        run, structure, falls = self.run, self.structure, self.falls
        mechanism = run.mechanism
        return {
            "title": self.title or str(run.dataset.attrs.get("title", structure.name)),
            "box": _short([low, high]),
            "points": _short(self.outlines.points),
            "blocks": _blocks(self.outlines),
            "joints": _joints(structure, run.joints),
            "links": linked(structure, run.joints["judged"].values).tolist(),
            "hinge": run.criteria.hinge,
            "magnification": self.magnification,
            "still": self.still,
            "chosen": self.gravest,
            "every": every,
            "most": MOST,
            "end": float(run.time[-1] if falls is None else falls.times[-1]),
            "loose": None if falls is None else float(falls.times[0]),
            "level": None if falls is None else falls.level,
            "mechanism": None if mechanism is None else mechanism.time,
            "note": "" if self.moved is not None else self.why_still or _still(run),
            "pack": pack.head,
            "bytes": pack.text,
        }

    @property
    def text(self) -> str:
        """The same as JSON that may stand in a page: nothing in it ends the element around it."""
        return json.dumps(self.data, separators=(",", ":")).replace("<", "\\u003c")


def _still(run: History) -> str:
    """What a reader is told where blocks do not move."""
    opening = ", with the openings of the joints between them" if "opening" in run.joints else ""
    return (
        f"The run kept no displacements: stones are drawn where they stand{opening}. With "
        "save_fields_every = 8 in [output] of its case it keeps them."
    )


def _around(points: list[Array], room: float) -> tuple[Array, Array]:
    """Corners of a box around points, with room."""
    every = np.concatenate(points)
    return every.min(axis=0) - room, every.max(axis=0) + room


def _flags(joints: xr.Dataset) -> Array:
    """Flags as one whole number: hinge + 1, and 4 slides, 8 open, 16 V > 0, 32 rotation > 0."""
    number = joints["hinge"].values.astype(float) + 1.0
    turned = joints["rotation"].values > 0.0 if "rotation" in joints else np.zeros(number.shape)
    for bit, flag in (
        (4, joints["slide"].values),
        (8, joints["open"].values),
        (16, joints["V"].values > 0.0),
        (32, turned),
    ):
        number += bit * flag
    return number


def _blocks(outlines: Outlines) -> list[dict[str, Any]]:
    """Name, kind and number of points of each block."""
    blocks = outlines.structure.blocks
    return [
        {"name": block.name, "kind": kind, "count": len(ring)}
        for block, kind, ring in zip(blocks, outlines.kinds, outlines.rings, strict=True)
    ]


def _joints(structure: Structure, joints: xr.Dataset) -> list[dict[str, Any]]:
    """Name, ends, normal and limit of each joint, and whether it is judged."""
    limits = sliding_limits(joints.isel(time=0), History(joints).criteria)
    return [
        {
            "name": joint.name,
            "ends": _short(joint.ends),
            "normal": _short(normal),
            "judged": bool(shown),
            "limit": round(float(limit), 4) if np.isfinite(limit) else None,
        }
        for joint, normal, shown, limit in zip(
            structure.joints, structure.normals, joints["judged"].values, limits, strict=True
        )
    ]


def _short(values: Any) -> Any:
    """Coordinates as lists, to a tenth of a millimetre."""
    return np.round(np.asarray(values, float), 4).tolist()
