"""Content of single frames of a film, and their timing.

Until blocks come loose, frames show the model and its joints, afterwards blocks alone. Frames are
evenly spaced in time, or in slow motion around the decisive instant.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import xarray as xr

from archfem._typing import Array
from archfem._validation import check_between
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.units import mm
from archfem.view.films.settings import Setup, colour_values, polygon_sides
from archfem.view.joint_marks import MARKED_QUANTITIES, Marker, Marks, joint_marks
from archfem.view.positions import FallingBlocks, decisive_instant
from archfem.view.style import Colour

# Slow motion of a film: "auto", its start and end [s], or none
Window = str | tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class Frame:
    """Content of one frame."""

    places: Array  # displaced points of the cells (m, 2) [m]
    shades: Array  # values of the colour scale, by point (m,) or by cell
    time: float | None = None  # [s]; None for a state without time
    words: Sequence[str] = ()  # numbers of failed joints, or that blocks are loose or rock
    marks: Marks = field(default_factory=Marks)  # of the joints, displaced
    # places where hinges were before, displaced (n, 2) [m]
    past: Array = field(default_factory=lambda: np.zeros((0, 2)))
    outlines: Sequence[Array] = ()  # of blocks displaced by a mechanism, each (k, 2) [m]
    grains: Sequence[Array] = ()  # outlines of grains of fill, each (k, 2) [m]


class Layer(NamedTuple):
    """Lines or areas of a frame in one colour."""

    shapes: Array  # segments (n, 2, 2), or outlines of areas (n, k, 2) [m]
    colour: str
    width: float = 0.0  # of lines, in a picture 1100 pixels wide [points]; 0 for areas
    opacity: float = 1.0


def frame_layers(setup: Setup, frame: Frame) -> list[Layer]:
    """Return edges and marks of a frame, from the lowest layer to the uppermost."""
    marks, disc = frame.marks, setup.hinge_disc
    edges = frame.places[setup.model.cells.outline_edges]
    thrust = marks.thrust[np.isfinite(marks.thrust[:, 0])]
    return [
        Layer(np.concatenate([edges, polygon_sides(setup.supports)]), Colour.EDGE, 1.2),
        Layer(polygon_sides(frame.grains), Colour.EDGE, 1.2),
        Layer(polygon_sides(frame.outlines), Colour.MECHANISM, 3.0),
        Layer(frame.past[:, None] + disc, Colour.HINGE, opacity=0.3),
        Layer(marks.links, "white", 6.0),
        Layer(marks.links, Colour.THRUST, 3.0),
        Layer(thrust[:, None] + 0.35 * disc, Colour.THRUST),
        Layer(marks.slips, Colour.SLIDING),
        Layer(marks.hinges[:, None] + 1.25 * disc, "white"),
        Layer(marks.hinges[:, None] + disc, Colour.HINGE),
    ]


def corner_values(setup: Setup, frame: Frame) -> Array:
    """Return values of the colour scale at the corners of the triangles of the blocks (t, 3)."""
    triangles = setup.triangles
    if setup.scale.colour == "stress":  # a value for each cell
        return np.repeat(frame.shades[triangles.cell][:, None], 3, axis=1)
    return triangles.corners(frame.shades)


def frame_of_state(setup: Setup, q: Array, joints: xr.Dataset) -> Frame:
    """Return the frame of a single state."""
    model = setup.model
    shift = setup.magnification * model.observer().joint_ends(q)
    return Frame(
        *_places_and_values(setup, q),
        time=float(joints["time"]) if "time" in joints.coords else None,
        words=_count_failures(joints.expand_dims("step"))[0],
        marks=joint_marks(model.structure, joints, shift=shift),
    )


def frames_of_run(setup: Setup, run: History, times: Array, fields: Array) -> Iterator[Frame]:
    """Yield the frames of a run, while no block is loose."""
    structure, joint_ends = setup.model.structure, setup.model.observer().joint_ends
    joints = run.joints.transpose("time", "joint", ...)
    judged = joints["judged"].values
    steps = joints.indexes["time"].get_indexer(times, method="nearest")
    values = {key: joints[key].values for key in MARKED_QUANTITIES}
    side = joints["hinge"].values * judged
    # ends of joints that have been hinges up to each step (steps, n_joints, 2)
    hinged = np.maximum.accumulate(np.stack([side < 0, side > 0], axis=-1), axis=0)
    marker, words = Marker(structure, judged), _count_failures(joints)
    for time, step, q in zip(times, steps, fields, strict=True):
        shift = setup.magnification * joint_ends(q)
        yield Frame(
            *_places_and_values(setup, q),
            time=float(time),
            words=words[step],
            marks=marker.at({key: each[step] for key, each in values.items()}, shift),
            past=(structure.ends + shift)[hinged[step]],
            outlines=setup.outlines if time >= setup.since else (),
        )


def frames_of_fall(setup: Setup, falls: FallingBlocks, times: Array) -> Iterator[Frame]:
    """Yield the frames of loose blocks, which are rigid and drawn true to scale."""
    cells = setup.model.cells
    for time in times:
        places = falls.places(cells.places, cells.block, float(time))
        shades = np.linalg.norm(places - cells.places, axis=1) / mm
        if setup.scale.colour == "stress":  # loose blocks are rigid: stress is not computed
            shades = np.zeros(len(cells.polygons))
        grains = falls.grain_outlines(float(time))
        if grains:  # in their place the body, a point within one of them, is not seen
            places[np.isin(cells.block, falls.broken)] = grains[0].mean(axis=0)
        yield Frame(places, shades, float(time), [f"blocks are {falls.state}"], grains=grains)


def _places_and_values(setup: Setup, q: Array) -> tuple[Array, Array]:
    """Return the displaced points of the blocks, and their values of the colour scale."""
    cells = setup.model.cells
    places = cells.places + setup.magnification * cells.displacement(q)
    return places, colour_values(cells, q, setup.scale.colour)


def _count_failures(joints: xr.Dataset) -> list[list[str]]:
    """Return for each step how many judged joints hinge, slide and are open, in words."""
    adjectives = {"hinge": "hinging", "slide": "sliding", "open": "open"}
    judged = joints["judged"]
    counts = [((joints[key] != 0) & judged).sum("joint").values for key in adjectives]
    return [
        [f"{count} {word}" for count, word in zip(step, adjectives.values(), strict=True) if count]
        for step in np.stack(counts, axis=-1).tolist()
    ]


@dataclass(frozen=True, eq=False)
class FrameTiming:
    """Times of the frames of a film."""

    times: Array  # of the frames (frames,) [s]
    speeds: Array  # of the film relative to real time (frames,) [-]
    fps: float  # frames per second


def even_timing(known: Array, fps: float, seconds: float | None) -> FrameTiming:
    """Return evenly spaced times for a film of some length, at most one for each known field."""
    for key, value in (("fps", fps), ("seconds", seconds)):
        if value is not None:
            check_between(value, key, 0.0, 1e4)
    length = float(known[-1] - known[0])
    seconds = seconds or max(length, 1.0 / fps)
    count = min(len(known), max(1, round(seconds * fps)))
    times = np.linspace(known[0], known[-1], count)
    return FrameTiming(times, np.full(count, length / seconds or 1.0), count / seconds)


def slow_motion_timing(known: Array, fps: float, window: tuple[float, float]) -> FrameTiming:
    """Return times in real time, with slow motion inside a window [s]."""
    real = even_timing(known, fps, None)
    start, end = np.clip(window, known[0], known[-1])
    if not start < end:
        raise InvalidInput(
            f"window {window}: the run lasts from {known[0]:g} to {known[-1]:g} s; give two times "
            "of it, the earlier first, or 'auto'"
        )
    inside = known[(known >= start) & (known <= end)]
    spacing = float(np.median(np.diff(inside))) if len(inside) > 1 else float(end - start)
    # a tenth of real time, but at most four frames between two fields: between them displacements
    # are interpolated
    speed = float(np.clip(spacing * real.fps / 4.0, 0.1, 1.0))
    marks = np.array([known[0], start, end, known[-1]])
    film_time = np.append(0.0, np.cumsum(np.diff(marks) / [1.0, speed, 1.0]))
    count = max(1, round(film_time[-1] * real.fps))
    times = np.interp(np.linspace(0.0, film_time[-1], count), film_time, marks)
    slow = (times >= start) & (times < end)
    return FrameTiming(times, np.where(slow, speed, 1.0), real.fps)


def decisive_window(run: History) -> tuple[float, float]:
    """Return a time window around collapse, first mechanism or largest |e| of a run [s]."""
    instant = decisive_instant(run)
    return instant - 0.25, instant + 0.75


def frame_timing(
    run: History, known: Array, fps: float, seconds: float | None, window: Window
) -> FrameTiming:
    """Return the times of the frames of a run's film."""
    if window is None:
        return even_timing(known, fps, seconds)
    if seconds is not None:
        raise InvalidInput(f"seconds {seconds:g} and window {window}: give one of the two")
    if isinstance(window, str):
        if window != "auto":
            raise InvalidInput(f"window '{window}': give 'auto', or two times in seconds")
        window = decisive_window(run)
    return slow_motion_timing(known, fps, window)
