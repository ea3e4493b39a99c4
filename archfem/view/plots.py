"""Pictures on paper: a structure at an instant, histories of joints."""

from collections.abc import Sequence
from textwrap import wrap
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from archfem.criteria import Criteria, flagged
from archfem.errors import InvalidInput
from archfem.history import History
from archfem.skeleton import yielding_blocks
from archfem.structure import Array, Structure
from archfem.view.envelopes import draw_faces
from archfem.view.marks import Marks, joint_marks
from archfem.view.style import (
    COLUMN,
    EDGE,
    INK,
    LINES,
    NORMAL,
    SLIP,
    SMALL,
    SOIL,
    STONE,
    SUPPORT,
    THRUST,
    canvas,
    dress,
    legend,
)
from archfem.view.style import HINGE as RED

LETTERS = 20
"""That fit beside a panel."""

LOOSE = 2.0
"""Mobilised friction at which its axis ends, relative to the largest coefficient: a joint about
to open has any value."""


def draw_structure(
    structure: Structure,
    joints: xr.Dataset | None = None,
    *,
    criteria: Criteria | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Draw the blocks and, where given, what their joints do at one instant.

    Supports are darker, soil is paler. Each ring and pier has its thrust line, interrupted where a
    joint is open. A red circle marks a hinge on the face where its blocks stay in contact, two
    opposite arrows a joint that slides, a white gap one that has come apart.

    Args:
        structure: what stands.
        joints: its joints at one instant, as made by `joint_dataset`.
        criteria: what makes a joint fail; by default those by which the joints were judged already.
        axes: where to draw; by default a new figure.

    Raises:
        InvalidInput: `joints` has several instants, or those of another structure.
    """
    axes = canvas(structure).add_subplot() if axes is None else axes
    dress(axes, "x [m]", "y [m]")
    axes.set_aspect("equal")
    draw_blocks(axes, structure)
    if joints is not None:
        _check_instant(structure, joints)
        _marks(axes, joint_marks(structure, flagged(joints, criteria)))
        legend(axes)
    axes.set_title(_title(structure, joints), fontsize=NORMAL, color=INK)
    axes.autoscale_view()
    return cast(Figure, axes.figure)


def draw_joint_histories(run: History, joints: Sequence[int]) -> Figure:
    """Draw eccentricity and mobilised friction of joints over time, below the ground's motion.

    Lines are interrupted while a joint is open; limits are by the run's criteria.

    Args:
        run: what happened.
        joints: numbers of the joints.

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
        above = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.96)}
        panels[0, 1].legend(frameon=False, fontsize=SMALL, ncols=2, **above)
    for (left, right), number in zip(panels[1:], joints, strict=True):
        _eccentricity(left, run.joints.sel(joint=number))
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


def draw_blocks(axes: Axes, structure: Structure) -> None:
    """Draw blocks where they are, supports darker, soil paler."""
    soil = yielding_blocks(structure)
    faces = [
        SUPPORT if block.fixed else SOIL if number in soil else STONE
        for number, block in enumerate(structure.blocks)
    ]
    outlines = [block.drawn() for block in structure.blocks]
    drawn = PolyCollection(outlines, facecolors=faces, edgecolors=EDGE, linewidths=0.7, zorder=1)
    drawn.set_gid("blocks")
    axes.add_collection(drawn)


def draw_thrust(axes: Axes, marks: Marks) -> None:
    """Draw the thrust lines."""
    halo = withStroke(linewidth=3.4, foreground="white")
    line: dict[str, Any] = {"color": THRUST, "lw": 1.7, "zorder": 5, "path_effects": [halo]}
    axes.plot(*_broken(marks.links).T, label="thrust line", gid="links", **line)
    axes.plot(*marks.thrust.T, "o", ms=3.0, color=THRUST, zorder=5, gid="thrust")


def _marks(axes: Axes, marks: Marks) -> None:
    """Draw thrust line, hinges, slips and gaps; what does not occur has no label."""
    draw_thrust(axes, marks)
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


def _ground(axes: Axes, run: History) -> None:
    """Draw the acceleration of the ground."""
    dress(axes, "", "ground [m/s²]")
    ground = run.dataset["ground"].values
    axes.plot(run.time, ground[:, 0], color=INK, lw=0.6, label="horizontal")
    if ground[:, 1].any():
        axes.plot(run.time, ground[:, 1], color=LINES[4], lw=0.5, alpha=0.9, label="vertical")
    axes.set_xlim(run.time[0], run.time[-1])


def _eccentricity(axes: Axes, joint: xr.Dataset) -> None:
    """Draw where the thrust crosses a joint, against its faces."""
    name = "\n".join(wrap(str(joint["name"].values), LETTERS))
    dress(axes, "", f"{name}\nM / (N h) [-]")
    draw_faces(axes, Criteria.of(joint).hinge)
    axes.plot(joint["time"], joint["eccentricity"], color=LINES[0], lw=0.6)
    axes.set_ylim(-0.56, 0.56)


def _friction(axes: Axes, joint: xr.Dataset) -> None:
    """Draw mobilised friction against its limit."""
    dress(axes, "", "|V| / N [-]")
    limit = float(Criteria.of(joint).coefficients(joint["friction_limit"].values))
    axes.axhspan(limit, LOOSE * limit, color=SLIP, alpha=0.12, lw=0)
    axes.axhline(limit, color=SLIP, lw=0.9, ls="--")
    axes.plot(joint["time"], joint["friction"], color=LINES[0], lw=0.6)
    axes.set_ylim(0.0, LOOSE * limit)
