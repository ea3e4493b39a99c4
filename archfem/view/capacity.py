"""Pictures of limit analysis: thrust line and mechanism in one, and the capacity of rings."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from archfem.equilibrium import RigidBlocks
from archfem.kinematics import motion_of
from archfem.limit import Collapse, Outcome
from archfem.resultants import thrust_line
from archfem.structure import Array, Structure

STONE, SUPPORT, EDGE = "#e9e4da", "#b9b3a6", "#6b655a"
MOVED, THRUST, HINGE = "#2a6f97", "#c1272d", "#1b1b1b"

SWING = 0.06
"""Displacement of the fastest corner in a picture, relative to the size of the structure."""

STILL = 1e-4
"""Displacement too small to be drawn, relative to the size of the structure."""

LEVELS = [0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0]
"""Horizontal accelerations between which the map of capacity changes its colour [g]."""

NEVER = 1e3
"""Height of the map where no acceleration overturns a ring [g]."""

HORIZONTAL = {
    (120.0, 0.10): 0.580,
    (120.0, 0.15): 0.913,
    (120.0, 0.20): 1.264,
    (180.0, 0.15): 0.144,
    (180.0, 0.20): 0.284,
    (157.5, 0.15): 0.37,
}
"""Known horizontal accelerations at collapse [g] over (embrace [degrees], t/R); the last one is
Oppenheim's, Earthquake Eng. Struct. Dyn. 21 (1992) 1005-1017, for 7 voussoirs."""

THINNEST = {120.0: 0.02285, 180.0: 0.1075}
"""Known least t/R under self-weight over embrace [degrees]; Milankovitch, Z. Math. Phys. 55 (1907)
1-27, for the semicircle."""


def structure_figure(structure: Structure) -> Figure:
    """Draw the blocks of a structure, its supports darker."""
    figure, axes = _canvas(structure)
    _draw_blocks(axes, structure)
    axes.set_title(structure.name, fontsize=10)
    return figure


def collapse_figure(structure: Structure, found: Collapse) -> Figure:
    """Draw the thrust line in the structure as it stands, over the mechanism that it becomes.

    Args:
        structure: as it stands.
        found: what limit analysis found for it.
    """
    figure, axes = _canvas(structure)
    _draw_blocks(axes, structure)
    if found.motion.any():
        swing = SWING * structure.size / RigidBlocks(structure).reach(found.motion)
        _draw_motion(axes, structure, swing * found.motion)
        _mark_hinges(axes, structure, found, swing * found.motion)
        _mark_sliding(axes, structure, found)
    _draw_thrust(axes, structure, found.joints)
    axes.set_title(_caption(found), fontsize=10)
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    return figure


def capacity_figure(
    capacity: xr.DataArray,
    thinnest: Mapping[float, float],
) -> Figure:
    """Draw what rings withstand over embrace and thickness, with known values on it.

    Args:
        capacity: as made by `ring_capacity` [g].
        thinnest: least t/R under self-weight over embrace [degrees], the edge of the map.
    """
    figure = Figure(figsize=(6.2, 4.4), layout="constrained")
    axes = figure.add_subplot()
    embraces, ratios = capacity["embrace"].values, capacity["ratio"].values
    values = np.nan_to_num(capacity.values.T, nan=0.0, posinf=NEVER)
    filled = axes.contourf(embraces, ratios, values, LEVELS, cmap="YlGnBu", extend="max")
    axes.contour(embraces, ratios, values, LEVELS[1:], colors="white", linewidths=0.5)
    edge = np.array(sorted(thinnest.items()))
    axes.fill_between(edge[:, 0], 0.0, edge[:, 1], color="white", zorder=2)
    axes.plot(*edge.T, color=HINGE, lw=1.6, zorder=3, label="thinnest that stands")
    _mark_known(axes)
    axes.set_xlabel("embrace [°]")
    axes.set_ylabel("thickness / radius, t/R [-]")
    axes.set_xlim(embraces[0], embraces[-1])
    axes.set_ylim(0.0, ratios[-1])
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    figure.colorbar(filled, label="horizontal acceleration at collapse [g]")
    return figure


def _canvas(structure: Structure) -> tuple[Figure, Axes]:
    """Axes in metres, of the same scale both ways, on a page as wide as a column."""
    points = np.concatenate([block.drawn() for block in structure.blocks])
    wide, high = np.ptp(points, axis=0)
    height = float(np.clip(5.8 * high / wide + 1.2, 2.6, 8.0))
    figure = Figure(figsize=(6.4, height), layout="constrained")
    axes = figure.add_subplot()
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)
    return figure, axes


def _draw_blocks(axes: Axes, structure: Structure) -> None:
    """Draw blocks where they are, supports darker."""
    faces = [SUPPORT if block.fixed else STONE for block in structure.blocks]
    outlines = [block.drawn() for block in structure.blocks]
    axes.add_collection(
        PolyCollection(outlines, facecolors=faces, edgecolors=EDGE, linewidths=0.6, zorder=1)
    )
    axes.autoscale_view()


def _draw_motion(axes: Axes, structure: Structure, motion: Array) -> None:
    """Draw the blocks that move where a motion (n_blocks, 3) takes them."""
    outlines = []
    for block, own in zip(structure.blocks, motion, strict=True):
        displaced = motion_of(block.drawn(), block.centroid) @ own
        if np.abs(displaced).max() > STILL * structure.size:
            outlines.append(block.drawn() + displaced)
    moved = PolyCollection(
        outlines, facecolors=f"{MOVED}30", edgecolors=MOVED, linewidths=0.8, zorder=2
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
        carrier = motion_of(end[None, :], structure.blocks[joint.lower].centroid)[0]
        points.append(end + carrier @ motion[joint.lower])
    if points:
        x, y = np.array(points).T
        axes.plot(x, y, "o", mfc="white", mec=HINGE, mew=1.3, ms=6, zorder=5, label="hinge")


def _mark_sliding(axes: Axes, structure: Structure, found: Collapse) -> None:
    """Draw sliding joints as heavy lines, where they were."""
    for count, number in enumerate(found.sliding):
        label = "_" if count else "sliding joint"
        axes.plot(*structure.joints[number].ends.T, color=HINGE, lw=2.4, zorder=4, label=label)


def _draw_thrust(axes: Axes, structure: Structure, joints: xr.Dataset) -> None:
    """Draw the line through the points where the thrust crosses the joints."""
    line = thrust_line(structure, joints).values
    if np.isfinite(line).any():
        axes.plot(*line.T, color=THRUST, lw=1.5, marker=".", ms=3, zorder=4, label="thrust line")


def _caption(found: Collapse) -> str:
    """Outcome, and the factor where there is one."""
    sentence = found.outcome.sentence
    if found.outcome is Outcome.COLLAPSES:
        sentence += f" at a factor of {found.factor:.4g}"
    return sentence[0].upper() + sentence[1:]


def _mark_known(axes: Axes) -> None:
    """Put known values on the map of capacity."""
    thin, strong = np.array(list(THINNEST.items())), np.array(list(HORIZONTAL))
    axes.plot(
        *thin.T, "D", mfc="white", mec=HINGE, ms=6, zorder=5, clip_on=False, label="known thinnest"
    )
    axes.plot(
        *strong.T, "o", mfc=THRUST, mec="white", ms=7, zorder=5, clip_on=False, label="known factor"
    )
    texts = {point: f"{factor:.3f}".rstrip("0") for point, factor in HORIZONTAL.items()}
    texts |= {point: f"{point[1]:.4g}" for point in THINNEST.items()}
    for point, text in texts.items():
        note = axes.annotate(
            text, point, (-8, 3), textcoords="offset points", fontsize=8, ha="right", zorder=6
        )
        note.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
