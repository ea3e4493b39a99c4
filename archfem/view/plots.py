"""Pictures on paper: a structure at an instant, envelopes of eccentricity, histories of joints."""

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from archfem.criteria import HINGE, envelope, opened
from archfem.errors import InvalidInput
from archfem.history import History
from archfem.structure import Array, Structure
from archfem.view.marks import Marks, joint_marks
from archfem.view.style import (
    COLUMN,
    EDGE,
    FAINT,
    INK,
    LINES,
    NORMAL,
    SLIP,
    SMALL,
    STONE,
    SUPPORT,
    THRUST,
    canvas,
    dress,
    legend,
)
from archfem.view.style import HINGE as RED

LOOSE = 2.0
"""Mobilised friction at which its axis ends, relative to the largest coefficient: a joint about
to open has any value."""


def draw_structure(
    structure: Structure,
    joints: xr.Dataset | None = None,
    *,
    limit: float = HINGE,
    axes: Axes | None = None,
) -> Figure:
    """Draw the blocks and, where given, what their joints do at one instant.

    Supports are darker. The thrust line is interrupted where a joint is open. A red circle marks
    a hinge on the face where its blocks stay in contact, two opposite arrows a joint that slides,
    a white gap one that has come apart.

    Args:
        structure: what stands.
        joints: its joints at one instant, as made by `joint_dataset`.
        limit: of |e| for a hinge [-].
        axes: where to draw; by default a new figure.

    Raises:
        InvalidInput: `joints` has several instants, or those of another structure.
    """
    axes = canvas(structure).add_subplot() if axes is None else axes
    dress(axes, "x [m]", "y [m]")
    axes.set_aspect("equal")
    _blocks(axes, structure)
    if joints is not None:
        _check_instant(structure, joints)
        _marks(axes, joint_marks(structure, joints, limit=limit))
        legend(axes)
    axes.set_title(_title(structure, joints), fontsize=NORMAL, color=INK)
    axes.autoscale_view()
    return cast(Figure, axes.figure)


def draw_envelope(
    runs: Mapping[str, History],
    *,
    dead: xr.Dataset | None = None,
    limit: float = HINGE,
    axes: Axes | None = None,
) -> Figure:
    """Draw the least and largest eccentricity of each joint over runs, against the faces.

    Crosses above the upper face mark joints that came apart at some time.

    Args:
        runs: what to call each run, and the run.
        dead: joints under dead load, drawn dotted.
        limit: of |e| for a hinge [-].
        axes: where to draw; by default a new figure.

    Raises:
        InvalidInput: there is no run, or too many to tell apart.
    """
    if not 1 <= len(runs) <= len(LINES):
        raise InvalidInput(f"{len(runs)} runs in one picture: give 1 to {len(LINES)}")
    page = Figure(figsize=(COLUMN, 3.4), layout="constrained")
    axes = page.add_subplot() if axes is None else axes
    dress(axes, "joint [-]", "eccentricity e = M / (N h) [-]")
    _faces(axes, limit)
    apart = [np.flatnonzero(opened(run.joints).any("time")) for run in runs.values()]
    for row, ((label, run), colour) in enumerate(zip(runs.items(), LINES, strict=False)):
        _band(axes, run.joints, label, colour)
        height = np.full(len(apart[row]), 0.56 + 0.05 * row)
        axes.plot(apart[row], height, "x", ms=4, color=colour)
    if any(map(len, apart)):
        axes.plot([], [], "x", ms=4, color=FAINT, label="came apart")
    if dead is not None:
        axes.plot(dead["joint"], dead["eccentricity"], ":", color=INK, lw=1.4, label="dead load")
    axes.set_ylim(-0.56, 0.56 + 0.05 * len(runs))
    axes.set_yticks(np.linspace(-0.5, 0.5, 5))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    legend(axes)
    return cast(Figure, axes.figure)


def draw_joint_histories(run: History, joints: Sequence[int], *, limit: float = HINGE) -> Figure:
    """Draw eccentricity and mobilised friction of joints over time, below the ground's motion.

    Lines are interrupted while a joint is open.

    Args:
        run: what happened.
        joints: numbers of the joints.
        limit: of |e| for a hinge [-].

    Raises:
        InvalidInput: there is no such joint.
    """
    _check_numbers(run, joints)
    rows = 1 + len(joints)
    figure = Figure(figsize=(COLUMN, 0.9 + 1.15 * rows), layout="constrained")
    panels = figure.subplots(rows, 2, sharex=True)
    for axes in panels[0]:
        _ground(axes, run)
    if len(panels[0, 1].lines) > 1:
        panels[0, 1].legend(frameon=False, fontsize=SMALL, ncols=2, loc="upper right")
    for (left, right), number in zip(panels[1:], joints, strict=True):
        _eccentricity(left, run.joints.sel(joint=number), limit)
        _friction(right, run.joints.sel(joint=number))
    for axes in panels[-1]:
        axes.set_xlabel("time [s]", fontsize=SMALL)
    figure.align_ylabels(panels)
    return figure


def _check_instant(structure: Structure, joints: xr.Dataset) -> None:
    """Joints must be of one instant, and of this structure."""
    if joints["N"].dims != ("joint",) or joints.sizes["joint"] != len(structure.joints):
        raise InvalidInput(
            f"joints have dimensions {dict(joints.sizes)}: give one instant of the "
            f"{len(structure.joints)} joints of this structure, e.g. joints.isel(time=-1)"
        )


def _check_numbers(run: History, joints: Sequence[int]) -> None:
    """There must be such joints."""
    known = run.joints["joint"].values
    unknown = [number for number in joints if number not in known]
    if unknown or not len(joints):
        raise InvalidInput(
            f"joints {unknown or 'none'} cannot be drawn: give numbers from 0 to {len(known) - 1}"
        )


def _title(structure: Structure, joints: xr.Dataset | None) -> str:
    """Name of the structure, and the time where there is one."""
    if joints is None or "time" not in joints.coords:
        return structure.name
    return f"{structure.name}, t = {float(joints['time']):.3f} s"


def _blocks(axes: Axes, structure: Structure) -> None:
    """Draw blocks where they are, supports darker."""
    faces = [SUPPORT if block.fixed else STONE for block in structure.blocks]
    outlines = [block.drawn() for block in structure.blocks]
    drawn = PolyCollection(outlines, facecolors=faces, edgecolors=EDGE, linewidths=0.7, zorder=1)
    drawn.set_gid("blocks")
    axes.add_collection(drawn)


def _marks(axes: Axes, marks: Marks) -> None:
    """Draw thrust line, hinges, slips and gaps; what does not occur has no label."""
    halo = withStroke(linewidth=3.4, foreground="white")
    line: dict[str, Any] = {"color": THRUST, "lw": 1.7, "zorder": 5, "path_effects": [halo]}
    axes.plot(*_broken(marks.links).T, label="thrust line", gid="links", **line)
    axes.plot(*marks.thrust.T, "o", ms=3.0, color=THRUST, zorder=5, gid="thrust")
    if len(marks.hinges):
        disc: dict[str, Any] = {"mfc": RED, "mec": "white", "mew": 0.9, "ms": 8, "zorder": 7}
        axes.plot(*marks.hinges.T, "o", label="hinge", gid="hinges", **disc)
    if len(marks.slips):
        arrows = PolyCollection(
            list(marks.slips), facecolors=SLIP, edgecolors="white", linewidths=0.4
        )
        arrows.set(zorder=6, gid="slips")
        axes.add_collection(arrows)
        symbol: dict[str, Any] = {
            "marker": r"$\rightleftharpoons$",
            "ms": 12,
            "color": SLIP,
            "mew": 0.5,
        }
        axes.plot([], [], ls="", label="sliding joint", **symbol)
    if len(marks.gaps):
        edge = [withStroke(linewidth=3.8, foreground=EDGE)]
        style: dict[str, Any] = {"color": "white", "lw": 2.4, "path_effects": edge, "zorder": 4}
        axes.plot(
            *_broken(marks.gaps).T, label="open joint", gid="gaps", solid_capstyle="butt", **style
        )


def _broken(pieces: Array) -> Array:
    """Pieces of a line (n, 2, 2), one after another, with a break after each (3 n, 2)."""
    return np.insert(pieces, 2, np.nan, axis=1).reshape(-1, 2)


def _faces(axes: Axes, limit: float) -> None:
    """Draw the faces of the joints, and where a joint counts as hinged."""
    for side in (-1.0, 1.0):
        axes.axhspan(side * limit, side * 0.5, color=RED, alpha=0.12, lw=0)
        axes.axhline(side * 0.5, color=EDGE, lw=1.2)
        axes.axhline(side * limit, color=RED, lw=0.7, ls="--")
    axes.axhline(0.0, color=FAINT, lw=0.5)


def _band(axes: Axes, joints: xr.Dataset, label: str, colour: str) -> None:
    """Fill between the least and the largest eccentricity of each joint."""
    span, number = envelope(joints), joints["joint"].values
    axes.fill_between(number, span["lowest"], span["highest"], color=colour, alpha=0.15, lw=0)
    style: dict[str, Any] = {"color": colour, "lw": 1.3, "marker": "o", "ms": 2.8}
    axes.plot(number, span["highest"], **style, label=label)
    axes.plot(number, span["lowest"], **style)


def _ground(axes: Axes, run: History) -> None:
    """Draw the acceleration of the ground."""
    dress(axes, "", "ground [m/s²]")
    ground = run.dataset["ground"].values
    axes.plot(run.time, ground[:, 0], color=INK, lw=0.6, label="horizontal")
    if ground[:, 1].any():
        axes.plot(run.time, ground[:, 1], color=LINES[4], lw=0.5, alpha=0.9, label="vertical")
    axes.set_xlim(run.time[0], run.time[-1])


def _eccentricity(axes: Axes, joint: xr.Dataset, limit: float) -> None:
    """Draw where the thrust crosses a joint, against its faces."""
    dress(axes, "", f"{joint['name'].values!s}\nM / (N h) [-]")
    _faces(axes, limit)
    axes.plot(joint["time"], joint["eccentricity"], color=LINES[0], lw=0.6)
    axes.set_ylim(-0.56, 0.56)


def _friction(axes: Axes, joint: xr.Dataset) -> None:
    """Draw mobilised friction against its limit."""
    dress(axes, "", "|V| / N [-]")
    limit = float(joint["friction_limit"])
    axes.axhspan(limit, LOOSE * limit, color=SLIP, alpha=0.12, lw=0)
    axes.axhline(limit, color=SLIP, lw=0.9, ls="--")
    axes.plot(joint["time"], joint["friction"], color=LINES[0], lw=0.6)
    axes.set_ylim(0.0, LOOSE * limit)
