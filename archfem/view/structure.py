"""Structures on paper: one at an instant, or several side by side."""

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from archfem.arrays import Array
from archfem.joints.criteria import Criteria, flagged
from archfem.joints.resultants import check_instant
from archfem.masonry.softness import yielding_blocks
from archfem.masonry.structure import Structure
from archfem.view.marks import Marks, joint_marks
from archfem.view.style import (
    EDGE,
    HINGE,
    SLIP,
    SMALL,
    SOIL,
    STONE,
    SUPPORT,
    THRUST,
    Page,
    canvas,
    entitle,
    legend,
    stand,
)

STACKED = 0.78
"""Height of a picture among others, relative to one by itself."""


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

    Returns:
        The page; that of `axes` where given.

    Raises:
        InvalidInput: `joints` has several instants, or those of another structure.
    """
    axes = canvas(structure).add_subplot() if axes is None else axes
    stand(axes, structure)
    draw_blocks(axes, structure)
    if joints is not None:
        check_instant(structure, joints)
        draw_marks(axes, joint_marks(structure, flagged(joints, criteria)))
        legend(axes)
    entitle(axes, title_of(structure, joints))
    axes.autoscale_view()
    return cast(Figure, axes.figure)


def draw_instants(states: Mapping[str, tuple[Structure, xr.Dataset | None]]) -> Figure:
    """Draw several structures, one below the other, with thrust lines and failed joints.

    Args:
        states: what to call each, the structure, and its joints at one instant or None.

    Returns:
        The page, with a panel for each structure.
    """
    wide, high = canvas(next(iter(states.values()))[0]).get_size_inches()
    figure = Page(figsize=(wide, STACKED * high * len(states)), layout="constrained")
    panels = figure.subplots(len(states), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    marks: dict[str, Any] = {}
    for axes, (label, (structure, joints)) in zip(panels, states.items(), strict=True):
        draw_structure(structure, joints, axes=axes)
        if joints is not None and "time" in joints.coords:
            label = f"{label}, t = {float(joints['time']):.3f} s"
        entitle(axes, label)
        axes.label_outer()
        handles, words = axes.get_legend_handles_labels()
        marks |= dict(zip(words, handles, strict=True))
        if axes.get_legend() is not None:
            axes.get_legend().remove()
    if marks:
        figure.legend(
            handles=list(marks.values()), labels=list(marks), loc="outside lower center", ncols=4,
            frameon=False, fontsize=SMALL,
        )  # fmt: skip
    return figure


def title_of(structure: Structure, joints: xr.Dataset | None) -> str:
    """Return the name of the structure, and the time where there is one.

    Args:
        structure: that is drawn.
        joints: at that instant.
    """
    if joints is None or "time" not in joints.coords:
        return structure.name
    return f"{structure.name}, t = {float(joints['time']):.3f} s"


def draw_blocks(axes: Axes, structure: Structure) -> None:
    """Draw blocks where they are, supports darker, soil paler.

    Args:
        axes: to draw into.
        structure: whose blocks they are.
    """
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
    """Draw the thrust lines.

    Args:
        axes: to draw into.
        marks: of one instant.
    """
    halo = withStroke(linewidth=3.4, foreground="white")
    line: dict[str, Any] = {"color": THRUST, "lw": 1.7, "zorder": 5, "path_effects": [halo]}
    axes.plot(*_broken(marks.links).T, label="thrust line", gid="links", **line)
    axes.plot(*marks.thrust.T, "o", ms=3.0, color=THRUST, zorder=5, gid="thrust")


def draw_marks(axes: Axes, marks: Marks) -> None:
    """Draw thrust line, hinges, slips and gaps; what does not occur has no label.

    Args:
        axes: to draw into.
        marks: of one instant.
    """
    draw_thrust(axes, marks)
    if len(marks.hinges):
        disc: dict[str, Any] = {"mfc": HINGE, "mec": "white", "mew": 0.9, "ms": 8, "zorder": 7}
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
