"""What single pictures show: a model while its joints hold, its blocks once they are loose.

Which instants a film shows, and how fast: evenly, or in slow motion around what matters.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import assessed_joints
from archfem.units import mm
from archfem.view.films.settings import Setup, shade
from archfem.view.joint_marks import NO_MARKS, TOLD, Marker, Marks, joint_marks
from archfem.view.positions import FallingBlocks

NOWHERE = np.zeros((0, 2))

# Flags of joints that fail, and what such joints are
FAILING = {"hinge": "hinging", "slide": "sliding", "open": "open"}


@dataclass(frozen=True, eq=False)
class Frame:
    """What one picture shows."""

    places: Array  # points of the cells, as drawn (m, 2) [m]
    shades: Array  # what the blocks are coloured by, by point (m,) or by cell
    time: float | None = None  # of the picture [s]; None where it is not known
    words: Sequence[str] = ()  # how many joints fail, and how, or that blocks are loose
    marks: Marks = NO_MARKS  # of the joints, as moved
    # where hinges have been, as moved (n, 2) [m]
    past: Array = field(default_factory=lambda: NOWHERE)
    outlines: Sequence[Array] = ()  # of blocks as a mechanism moves them, each (k, 2) [m]


def still(setup: Setup, q: Array, joints: xr.Dataset) -> Frame:
    """Return what a picture of a state shows."""
    model = setup.model
    shift = setup.magnification * model.observer().joint_ends(q)
    return Frame(
        *_blocks(setup, q),
        time=float(joints["time"]) if "time" in joints.coords else None,
        words=_failing(_counts(joints)),
        marks=joint_marks(model.structure, joints, shift=shift),
    )


def moving(setup: Setup, run: History, times: Array, fields: Array) -> Iterator[Frame]:
    """Yield what the pictures of a run show, while its joints hold."""
    structure, carried, joints = (
        setup.model.structure,
        setup.model.observer().joint_ends,
        run.joints,
    )
    steps = joints.indexes["time"].get_indexer(times, method="nearest")
    told = {key: joints[key].transpose("time", "joint").values for key in TOLD}
    marker, been, counts = (
        Marker(structure, joints["judged"].values),
        _been(joints),
        _counts(joints),
    )
    for time, step, q in zip(times, steps, fields, strict=True):
        shift = setup.magnification * carried(q)
        yield Frame(
            *_blocks(setup, q),
            time=float(time),
            words=_failing(counts[step]),
            marks=marker.at({key: values[step] for key, values in told.items()}, shift),
            past=(structure.ends + shift)[been[step]],
            outlines=setup.outlines if time >= setup.since else (),
        )


def falling(setup: Setup, falls: FallingBlocks, times: Array) -> Iterator[Frame]:
    """Yield what the pictures of a fall show: blocks alone, to scale, as rigid as they are then."""
    cells = setup.model.cells
    for time in times:
        places = falls.places(cells.places, cells.block, float(time))
        shades = np.linalg.norm(places - cells.places, axis=1) / mm
        if setup.scale.colour == "stress":  # of blocks in flight nobody knows it
            shades = np.zeros(len(cells.polygons))
        yield Frame(places, shades, float(time), ["blocks are loose"])


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


# Where a film is in slow motion: "auto", from when until when [s], or nowhere
Window = str | tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class FrameTiming:
    """What a film shows when."""

    times: Array  # of its frames (frames,) [s]
    speeds: Array  # at which each is shown, relative to the real one (frames,) [-]
    fps: float  # frames that a second shows


def even(known: Array, fps: float, seconds: float | None) -> FrameTiming:
    """Return even times, in as many frames as the film lasts for, and no more than fields."""
    for key, value in (("fps", fps), ("seconds", seconds)):
        if value is not None and not 0.0 < value < 1e4:
            raise InvalidInput(f"{key} {value:.4g} is not between 0 and 10000")
    lasting = seconds or max(float(known[-1] - known[0]), 1.0 / fps)
    count = min(len(known), max(1, round(lasting * fps)))
    speed = float(known[-1] - known[0]) / lasting or 1.0
    return FrameTiming(
        np.linspace(known[0], known[-1], count), np.full(count, speed), count / lasting
    )


def slowed(known: Array, fps: float, window: tuple[float, float]) -> FrameTiming:
    """Return the times of a film in real time, but in slow motion from one instant to another."""
    real = even(known, fps, None)
    start, end = np.clip(window, known[0], known[-1])
    if not start < end:
        raise InvalidInput(
            f"window {window}: the run lasts from {known[0]:g} to {known[-1]:g} s; give two times "
            "of it, the earlier first, or 'auto'"
        )
    inside = known[(known >= start) & (known <= end)]
    apart = float(np.median(np.diff(inside))) if len(inside) > 1 else float(end - start)
    # speed of slow motion, relative to the real one, and pictures between two kept fields at most:
    # what happens between them is not known
    speed = float(np.clip(apart * real.fps / 4.0, 0.1, 1.0))
    marks = np.array([known[0], start, end, known[-1]])
    shown = np.append(0.0, np.cumsum(np.diff(marks) / [1.0, speed, 1.0]))
    times = np.interp(
        np.linspace(0.0, shown[-1], max(1, round(shown[-1] * real.fps))), shown, marks
    )
    slow = (times >= start) & (times < end)
    return FrameTiming(times, np.where(slow, speed, 1.0), real.fps)


def decisive(run: History, falls: FallingBlocks | None) -> tuple[float, float]:
    """Return the time around what matters most in a run [s].

    That is where blocks come loose, or else the first mechanism by count, or else where a joint's
    thrust comes nearest to a face.
    """
    if falls is not None:
        instant = float(falls.times[0])
    elif run.mechanism is not None and run.mechanism.time is not None:
        instant = run.mechanism.time
    else:
        tilt = abs(assessed_joints(run.joints)["eccentricity"]).max("joint")
        instant = float(run.time[int(tilt.fillna(0.0).argmax("time"))])
    # how long before and after the instant that matters a film is in slow motion [s]
    return instant - 0.25, instant + 0.75


def pace_of(
    run: History, falls: FallingBlocks | None, known: Array, fps: float, seconds: float | None,
    window: Window,
) -> FrameTiming:  # fmt: skip
    """Return which instants of a run its film shows, and how fast."""
    if window is None:
        return even(known, fps, seconds)
    if seconds is not None:
        raise InvalidInput(f"seconds {seconds:g} and window {window}: give one of the two")
    if isinstance(window, str):
        if window != "auto":
            raise InvalidInput(f"window '{window}': give 'auto', or two times in seconds")
        window = decisive(run, falls)
    return slowed(known, fps, window)
