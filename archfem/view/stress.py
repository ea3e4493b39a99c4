"""A map of principal compression over the blocks, with thrust lines and principal directions."""

from collections.abc import Collection
from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.joints.resultants import joint_dataset
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure
from archfem.models.model import Cells, Model
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.stress import cell_stress, corner_stress_operator, principal_values
from archfem.units import MPa, kPa
from archfem.view.joint_marks import drawn, joint_marks
from archfem.view.structure import draw_blocks, draw_thrust
from archfem.view.style import BEYOND, EDGE, INK, MOVED, SMALL, STONE, canvas, entitle, stand

# From none to the largest compression; warm, so that the thrust line stands out
SHADES = LinearSegmentedColormap.from_list(
    "compression", (STONE, "#f6d19a", "#ea9a5b", "#c9553a", "#7d1d32")
)


# Cells whose mean stress a cross shows
TOGETHER = 4

# Into how many a cell's sides are cut for shading
PIECES = 3

# Width of the colour bar, and its distance from the picture [inch]
BAR = 0.16

Numbers = NDArray[np.intp]


def draw_stress(
    model: Model,
    q: Equilibrium | Array,
    *,
    parts: Collection[str] | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Map the largest principal compression, with thrust lines and principal directions.

    Crosses lie along the principal directions and are as long as the stresses are large: dark
    under compression, green under tension.

    Args:
        model: any rung with a mesh.
        q: an equilibrium, or coordinates (n,) of a model that knows how its joints began, as that
            of a dead load in stages does.
        parts: whose blocks are shaded, for example ["backfill"]; by default all but soil.
        axes: where to draw; by default a new figure.

    Returns:
        The page, with a bar of colours; that of `axes` where given.

    Raises:
        InvalidInput: the blocks are rigid, there is no such part, or q is another model's.
    """
    model, q = drawn(model, q)
    structure, cells = model.structure, model.cells
    chosen = _chosen(structure, parts)
    corners = (corner_stress_operator(cells) @ q).reshape(-1, 3)
    own = axes is None
    axes = canvas(structure).add_subplot() if axes is None else axes
    page = cast(Figure, axes.figure)
    stand(axes, structure)
    draw_blocks(axes, structure)
    _shade(axes, cells, -principal_values(*corners.T)[1], chosen)
    outlines = [block.drawn() for block in structure.blocks]
    axes.add_collection(
        PolyCollection(outlines, facecolors="none", edgecolors=EDGE, linewidths=0.6, zorder=3)
    )
    _crosses(axes, cells, cell_stress(model, q), chosen)
    joints = joint_dataset(structure, model.resultants(q))
    draw_thrust(axes, joint_marks(structure, joints))
    entitle(axes, f"{structure.name}: principal compression")
    axes.autoscale_view()
    if own:
        page.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=SMALL)
    return page


def _chosen(structure: Structure, parts: Collection[str] | None) -> Numbers:
    """Numbers of the blocks that are shaded."""
    soil = find_yielding_blocks(structure)
    if parts is None:
        return np.array([number for number in structure.free if number not in soil])
    known = {structure.blocks[number].part for number in structure.free}
    unknown = sorted(set(parts) - known)
    if unknown or not parts:
        raise InvalidInput(f"parts {unknown} cannot be shaded: name some of {sorted(known)}")
    return np.array([n for n in structure.free if structure.blocks[n].part in parts])


def _shade(axes: Axes, cells: Cells, compression: Array, chosen: Numbers) -> None:
    """Colour the cells of blocks by compression at their corners [Pa], and add a colour bar."""
    shaded = [c for c, own in zip(cells.polygons, cells.owner, strict=True) if own in chosen]
    corners = np.array([[*cell, cell[-1]][:4] for cell in shaded])
    shown = compression[np.unique(corners)].clip(0.0)
    highest = max(float(np.percentile(shown, 100.0 - BEYOND)), 1.0)
    unit, name = (MPa, "MPa") if highest >= 0.05 * MPa else (kPa, "kPa")
    places, triangles = _cut(cells.places[corners])
    painted = axes.tripcolor(
        Triangulation(places[..., 0].ravel(), places[..., 1].ravel(), triangles),
        _inside(compression[corners]).ravel().clip(0.0) / unit,
        shading="gouraud",
        cmap=SHADES,
        vmin=0.0,
        vmax=highest / unit,
        zorder=2,
        rasterized=True,
    )
    painted.set_gid("compression")
    wide = BAR / cast(Figure, axes.figure).get_figwidth()
    beyond = "max" if shown.max() > highest else "neither"
    beside = axes.inset_axes((1.0 + wide, 0.0, wide, 1.0))
    bar = axes.figure.colorbar(painted, cax=beside, extend=beyond)
    bar.set_label(f"largest compression [{name}]", fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL, color=EDGE)
    bar.ax.yaxis.set_major_locator(MaxNLocator(5))
    bar.outline.set(edgecolor=EDGE, linewidth=0.8)


def _inside(corners: Array) -> Array:
    """Values on a grid in each cell from those at its four corners (cells, 4, …)."""
    s, t = np.meshgrid(*(np.linspace(0.0, 1.0, PIECES + 1),) * 2)
    share = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t]).reshape(4, -1)
    return np.einsum("kp,ck...->cp...", share, corners)


def _cut(corners: Array) -> tuple[Array, Numbers]:
    """Return points on a grid in each cell (cells, p, 2), and triangles between them (m, 3).

    Colours of a triangle run straight between those of its corners, past the ones between on the
    scale: over a whole cell of a coarse mesh that would be seen.
    """
    places = _inside(corners)
    row = PIECES + 1
    first = (np.arange(PIECES)[:, None] * row + np.arange(PIECES)).ravel()
    square = np.column_stack(
        [first, first + 1, first + row + 1, first, first + row + 1, first + row]
    )
    starts = np.arange(len(places)) * row**2
    return places, (starts[:, None, None] + square.reshape(-1, 3)).reshape(-1, 3)


def _crosses(axes: Axes, cells: Cells, stress: Array, chosen: Numbers) -> None:
    """Draw crosses along the principal directions, on a grid in each block."""
    # distance between two crosses on paper, and length of the longest arms [inch]
    spacing = 0.21 * np.ptp(cells.places[:, 0]) / cast(Figure, axes.figure).get_figwidth()
    centre = np.array([cells.places[cell].mean(axis=0) for cell in cells.polygons])
    groups = [
        np.flatnonzero(cells.owner == number)[group]
        for number in chosen
        for group in _grid(
            cells.places[cells.block == number], centre[cells.owner == number], spacing
        )
    ]
    middle = np.array([centre[group].mean(axis=0) for group in groups])
    across, up, shear = np.array([stress[group].mean(axis=0) for group in groups]).T
    angle = 0.5 * np.arctan2(2.0 * shear, across - up)
    turned = np.stack([angle, angle + 0.5 * np.pi])
    size = np.stack(principal_values(across, up, shear))
    share = size / np.abs(size).max()
    direction = np.stack([np.cos(turned), np.sin(turned)], axis=-1)
    arm = 0.5 * spacing * np.abs(share)[..., None] * direction
    ends = np.stack([middle - arm, middle + arm], axis=2)
    for sign, colour, name in ((-1.0, INK, "compression"), (1.0, MOVED, "tension")):
        # arms shorter than this, relative to the longest, are left out
        lines = ends[sign * share > 0.08]
        if len(lines):
            drawn = LineCollection(list(lines), colors=colour, linewidths=0.8, label=name)
            drawn.set(zorder=4, gid=name)
            axes.add_collection(drawn)


def _grid(corners: Array, centre: Array, spacing: float) -> list[Numbers]:
    """Groups of neighbouring cells of a block, about equally far from each other."""
    middle = corners.mean(axis=0)
    axes = np.linalg.svd(corners - middle, full_matrices=False)[2]
    along, local = (corners - middle) @ axes.T, (centre - middle) @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    spacing = max(spacing, np.sqrt(TOGETHER * np.prod(high - low) / len(centre)))
    counts = np.maximum(1, np.round((high - low) / spacing)).astype(int)
    steps = [
        a + (np.arange(n) + 0.5) * (b - a) / n for a, b, n in zip(low, high, counts, strict=True)
    ]
    groups = []
    for place in np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 2):
        distance = np.linalg.norm(local - place, axis=1)
        if distance.min() < 0.5 * spacing:
            groups.append(np.argsort(distance, kind="stable")[:TOGETHER])
    return groups
