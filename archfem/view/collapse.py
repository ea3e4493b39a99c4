"""Pictures of limit analysis: thrust line and mechanism in one, and the capacity of rings.

The picture of a fall: where the blocks are, from the joint that lets go to the ground.
"""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.resultants import thrust_line
from archfem.limit.collapse import Collapse, Outcome
from archfem.masonry.structure import Structure, rigid_motion_matrix
from archfem.view.joint_marks import displaced, swung
from archfem.view.positions import FallingBlocks
from archfem.view.structure import draw_loads, draw_structure
from archfem.view.style import (
    COLUMN,
    EDGE,
    GHOST,
    HINGE,
    INK,
    LIGHT_TO_DARK,
    MOVED,
    NORMAL,
    SLIP,
    SMALL,
    STONE,
    SUPPORT,
    THRUST,
    Page,
    canvas,
    dress,
    entitle,
    legend,
)

# Horizontal accelerations between which the map of capacity changes its colour [g]
LEVELS = [0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0]


def draw_collapse(structure: Structure, found: Collapse) -> Figure:
    """Draw the thrust line in the structure as it stands, over the mechanism that it becomes.

    Args:
        structure: as it stands.
        found: what limit analysis found for it.

    Returns:
        The page; what was found is its title.
    """
    figure = draw_structure(structure)
    axes = figure.axes[0]
    if found.motion.any():
        motion = swung(structure, found.motion)
        _draw_motion(axes, structure, motion)
        _mark_hinges(axes, structure, found, motion)
        _mark_sliding(axes, structure, found)
    _draw_thrust(axes, structure, found.joints)
    draw_loads(axes, structure, found.live, of=_multiple(found))
    entitle(axes, f"{structure.name}: {_caption(found)}")
    legend(axes)
    return figure


def draw_found(found: Collapse) -> Figure:
    """Draw what was found for the structure that it knows, as by `draw_collapse`."""
    if found.structure is None:
        raise InvalidInput(
            "this result does not know its structure: use draw_collapse(structure, …)"
        )
    return draw_collapse(found.structure, found)


def draw_capacity(
    capacity: xr.DataArray,
    thinnest: Mapping[float, float],
    known: Mapping[tuple[float, float], float],
) -> Figure:
    """Draw what rings withstand over embrace and thickness, with known values on it.

    Args:
        capacity: horizontal acceleration at collapse over embrace [degrees] and ratio, t/R [g];
            undefined (NaN) where a ring does not stand.
        thinnest: least t/R under self-weight over embrace [degrees], the edge of the map.
        known: accelerations over (embrace [degrees], t/R) that are known from elsewhere [g]; zero
            at the least t/R.

    Returns:
        The page, with a bar of colours beside the map.
    """
    figure = Page(figsize=(COLUMN, 4.4), layout="constrained")
    axes = figure.add_subplot()
    embraces, ratios = capacity["embrace"].values, capacity["ratio"].values
    # height of the map where no acceleration overturns a ring [g]
    values = np.nan_to_num(capacity.values.T, nan=0.0, posinf=1e3)
    filled = axes.contourf(embraces, ratios, values, LEVELS, cmap=LIGHT_TO_DARK, extend="max")
    axes.contour(embraces, ratios, values, LEVELS[1:], colors="white", linewidths=0.5)
    edge = np.array(sorted(thinnest.items()))
    axes.fill_between(edge[:, 0], 0.0, edge[:, 1], color="white", zorder=2)
    axes.plot(*edge.T, color=INK, lw=1.6, zorder=3, label="thinnest that stands")
    _mark_known(axes, known)
    dress(axes, "embrace [°]", "thickness / radius, t/R [-]")
    axes.set_xlim(embraces[0], embraces[-1])
    axes.set_ylim(0.0, ratios[-1])
    legend(axes)
    bar = figure.colorbar(filled)
    bar.set_label("horizontal acceleration at collapse [g]", fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL, color=EDGE)
    return figure


def _draw_motion(axes: Axes, structure: Structure, motion: Array) -> None:
    """Draw the blocks that move where a motion (n_blocks, 3) takes them."""
    moved = PolyCollection(
        displaced(structure, motion),
        facecolors=f"{MOVED}30",
        edgecolors=MOVED,
        linewidths=0.8,
        zorder=2,
    )
    moved.set_label("mechanism")
    axes.add_collection(moved)
    axes.autoscale_view()


def _mark_hinges(axes: Axes, structure: Structure, found: Collapse, motion: Array) -> None:
    """Mark each hinge on the face where its blocks stay in contact, as moved."""
    points = []
    for number, side in found.hinges:
        joint = structure.joints[number]
        end = joint.ends[0 if side == "intrados" else 1]
        carrier = rigid_motion_matrix(end[None, :], structure.blocks[joint.lower].centroid)[0]
        points.append(end + carrier @ motion[joint.lower])
    if points:
        x, y = np.array(points).T
        axes.plot(x, y, "o", mfc=HINGE, mec="white", mew=0.8, ms=7.5, zorder=6, label="hinge")


def _mark_sliding(axes: Axes, structure: Structure, found: Collapse) -> None:
    """Draw sliding joints as heavy lines, where they were."""
    for count, number in enumerate(found.sliding):
        label = "_" if count else "sliding joint"
        axes.plot(*structure.joints[number].ends.T, color=SLIP, lw=2.4, zorder=4, label=label)


def _draw_thrust(axes: Axes, structure: Structure, joints: xr.Dataset) -> None:
    """Draw the line through the points where the thrust crosses the joints."""
    line = thrust_line(structure, joints).values
    if np.isfinite(line).any():
        axes.plot(*line.T, color=THRUST, lw=1.5, marker=".", ms=3, zorder=4, label="thrust line")


def _caption(found: Collapse) -> str:
    """Outcome, and the factor where there is one."""
    sentence = found.outcome.sentence
    if found.outcome in (Outcome.COLLAPSES, Outcome.BRACKETED):
        sentence += f" at a factor of {found.factor:.4g}"
    return sentence


def _multiple(found: Collapse) -> str:
    """What the live load is multiplied by, in words."""
    return f"{found.factor:.3g} ×" if np.isfinite(found.factor) else ""


def _mark_known(axes: Axes, known: Mapping[tuple[float, float], float]) -> None:
    """Put known values on the map of capacity."""
    thin = [point for point, factor in known.items() if factor == 0.0]
    strong = [point for point, factor in known.items() if factor > 0.0]
    for points, label, mark in (
        (thin, "known thinnest", {"marker": "D", "mfc": "white", "mec": INK, "ms": 6}),
        (strong, "known factor", {"marker": "o", "mfc": HINGE, "mec": "white", "ms": 7}),
    ):
        if points:
            axes.plot(*np.array(points).T, ls="", zorder=5, clip_on=False, label=label, **mark)
    for point, factor in known.items():
        text = f"{factor:.3f}".rstrip("0") if factor else f"{point[1]:.4g}"
        note = axes.annotate(
            text, point, (-8, 3), textcoords="offset points", fontsize=SMALL, ha="right", zorder=6
        )
        note.set_path_effects([withStroke(linewidth=2.0, foreground="white")])


# Of the way down, by the mean of all blocks, at which they are drawn
SHARES = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)


def draw_fall(run: History) -> Figure:
    """Draw the blocks of a structure at four instants of its fall, over where they stood.

    Args:
        run: in which blocks came loose, and which knows its structure.

    Returns:
        The page, a panel for each instant.

    Raises:
        InvalidInput: the run does not know its structure, or nothing came loose.
    """
    falls = None if run.structure is None else FallingBlocks.of(run.structure, run)
    if falls is None:
        raise InvalidInput(
            "there is no fall to draw: no block came loose, displacements were taken as small, or "
            "the run does not know its structure; read it with History.read(path, structure)"
        )
    wide, high = canvas(falls.structure).get_size_inches()
    figure = Page(figsize=(1.5 * wide, 1.35 * high), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    for axes, time in zip(panels, _instants(falls), strict=True):
        _panel(axes, falls, time)
    return figure


def _instants(falls: FallingBlocks) -> list[float]:
    """Times of the instants that are drawn [s]."""
    sunk = -falls.poses[:, list(falls.structure.free), 1].mean(axis=1)
    way = np.maximum.accumulate(sunk - sunk[0])
    first = [int(np.argmax(way >= share * way[-1])) for share in SHARES[:-1]]
    return [float(falls.times[k]) for k in (*first, -1)]


def _panel(axes: Axes, falls: FallingBlocks, time: float) -> None:
    """Draw one instant."""
    blocks = falls.structure.blocks
    dress(axes, "x [m]", "y [m]")
    axes.set_aspect("equal")
    axes.axhline(falls.level, color=EDGE, lw=1.2, zorder=0)
    built = [block.drawn() for block in blocks]
    axes.add_collection(
        PolyCollection(built, facecolors="none", edgecolors=GHOST, linewidths=0.6, zorder=1)
    )
    faces = [SUPPORT if block.fixed else STONE for block in blocks]
    moved = PolyCollection(
        falls.outlines(time), facecolors=faces, edgecolors=EDGE, linewidths=0.7, zorder=2
    )
    moved.set_gid("blocks")
    axes.add_collection(moved)
    axes.set_title(f"t = {time:.2f} s", fontsize=NORMAL, color=INK)
    axes.autoscale_view()
    axes.label_outer()
