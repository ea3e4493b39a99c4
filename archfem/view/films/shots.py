"""What single pictures show: a model while its joints hold, its blocks once they are loose."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.dynamics.history import History
from archfem.units import mm
from archfem.view.films.colours import shade
from archfem.view.films.setup import Setup
from archfem.view.marks import NO_MARKS, TOLD, Marker, Marks, joint_marks
from archfem.view.moved import Falls, carrier

NOWHERE = np.zeros((0, 2))

FAILING = {"hinge": "hinging", "slide": "sliding", "open": "open"}
"""Flags of joints that fail, and what such joints are."""


@dataclass(frozen=True, eq=False)
class Shot:
    """What one picture shows.

    Attributes:
        places: points of the cells, as drawn (m, 2) [m].
        shades: what the blocks are coloured by, by point (m,) or by cell.
        time: of the picture [s]; None where it is not known.
        words: how many joints fail, and how, or that blocks are loose.
        marks: of the joints, as moved.
        past: where hinges have been, as moved (n, 2) [m].
        outlines: of blocks as a mechanism moves them, each (k, 2) [m].
    """

    places: Array
    shades: Array
    time: float | None = None
    words: Sequence[str] = ()
    marks: Marks = NO_MARKS
    past: Array = field(default_factory=lambda: NOWHERE)
    outlines: Sequence[Array] = ()


def still(setup: Setup, q: Array, joints: xr.Dataset) -> Shot:
    """Return what a picture of a state shows.

    Args:
        setup: whose model it is.
        q: coordinates (n,).
        joints: in that state.
    """
    model = setup.model
    shift = setup.magnification * carrier(model)(q)
    return Shot(
        *_blocks(setup, q),
        time=float(joints["time"]) if "time" in joints.coords else None,
        words=_failing(_counts(joints)),
        marks=joint_marks(model.structure, joints, shift=shift),
    )


def moving(setup: Setup, run: History, times: Array, fields: Array) -> Iterator[Shot]:
    """Yield what the pictures of a run show, while its joints hold.

    Args:
        setup: whose model it is.
        run: of it.
        times: of the pictures (frames,) [s].
        fields: coordinates (frames, n).
    """
    structure, carried, joints = setup.model.structure, carrier(setup.model), run.joints
    steps = joints.indexes["time"].get_indexer(times, method="nearest")
    told = {key: joints[key].transpose("time", "joint").values for key in TOLD}
    marker, been, counts = (
        Marker(structure, joints["judged"].values),
        _been(joints),
        _counts(joints),
    )
    for time, step, q in zip(times, steps, fields, strict=True):
        shift = setup.magnification * carried(q)
        yield Shot(
            *_blocks(setup, q),
            time=float(time),
            words=_failing(counts[step]),
            marks=marker.at({key: values[step] for key, values in told.items()}, shift),
            past=(structure.ends + shift)[been[step]],
            outlines=setup.outlines if time >= setup.since else (),
        )


def falling(setup: Setup, falls: Falls, times: Array) -> Iterator[Shot]:
    """Yield what the pictures of a fall show: blocks alone, to scale, as rigid as they are then.

    Args:
        setup: whose model it is.
        falls: of its blocks.
        times: of the pictures (frames,) [s].
    """
    cells = setup.model.cells
    for time in times:
        places = falls.places(cells.places, cells.block, float(time))
        shades = np.linalg.norm(places - cells.places, axis=1) / mm
        if setup.scale.colour == "stress":  # of blocks in flight nobody knows it
            shades = np.zeros(len(cells.polygons))
        yield Shot(places, shades, float(time), ["blocks are loose"])


def _blocks(setup: Setup, q: Array) -> tuple[Array, Array]:
    """Where the points of the blocks are drawn, and what the blocks are coloured by."""
    cells = setup.model.cells
    places = cells.places + setup.magnification * cells.displacement(q)
    return places, shade(cells, q, setup.scale.colour)


def _been(joints: xr.Dataset) -> NDArray[np.bool_]:
    """Return whether ends of judged joints have been hinges by each step (steps, n_joints, 2)."""
    side = joints["hinge"].transpose("time", "joint").values * joints["judged"].values
    return np.maximum.accumulate(np.stack([side < 0, side > 0], axis=-1), axis=0)


def _counts(joints: xr.Dataset) -> NDArray[np.intp]:
    """How many judged joints fail in each of the ways `FAILING` (…, 3)."""
    own = joints["judged"].values
    flags = (joints[key].transpose(..., "joint").values for key in FAILING)
    return np.stack([(own & (each != 0)).sum(axis=-1) for each in flags], axis=-1)


def _failing(counts: NDArray[np.intp]) -> list[str]:
    """How many joints hinge, slide or are open, in words."""
    pairs = zip(counts.tolist(), FAILING.values(), strict=True)
    return [f"{count} {word}" for count, word in pairs if count]
