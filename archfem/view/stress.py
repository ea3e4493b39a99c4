"""Map of principal compression over the blocks, with thrust lines and principal directions."""

from collections.abc import Collection
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation, UniformTriRefiner
from scipy import sparse

from archfem._typing import Array, Numbers
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.joints.resultants import joint_dataset
from archfem.masonry.block import triangulate_polygon
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure
from archfem.models.model import Cells, Model
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.stress import cell_stress, corner_stress_operator, principal_values
from archfem.units import MPa, kPa
from archfem.view import style
from archfem.view.joint_marks import joint_marks, model_and_coordinates
from archfem.view.structure import draw_blocks, draw_thrust
from archfem.view.style import Colour


class Triangles:
    """Triangulation of the cells of a model; `cell` is the cell of each triangle (t,)."""

    def __init__(self, cells: Cells) -> None:
        # below half of a pixel; each point of an arc makes a sliver, which is slow to draw
        tolerance = 0.0003 * float(np.ptp(cells.places, axis=0).max())
        cut = [c[triangulate_polygon(cells.places[c], tolerance)] for c in cells.polygons]
        corners = np.concatenate(cut)
        # each refinement divides a triangle into four; in about 200 triangles the linear variation
        # of colours cannot be seen
        refinements = int(np.clip(np.round(0.5 * np.log2(200 / len(corners))), 0, 2))
        unit = Triangulation([0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
        fine = UniformTriRefiner(unit).refine_triangulation(subdiv=refinements)
        shares = np.column_stack([1.0 - fine.x - fine.y, fine.x, fine.y])  # of the three corners
        count = len(shares)
        columns = np.repeat(corners, count, axis=0).ravel()
        values = np.tile(shares.ravel(), len(corners))
        shape = count * len(corners), len(cells.places)
        starts = np.arange(0, len(values) + 1, 3)  # three values in each row
        self._interpolation = sparse.csr_matrix((values, columns, starts), shape)
        first = count * np.arange(len(corners))
        self._corners = (first[:, None, None] + fine.triangles).reshape(-1, 3)
        owner = np.repeat(np.arange(len(cut)), [len(triangles) for triangles in cut])
        self.cell: Numbers = np.repeat(owner, len(fine.triangles))

    def corners(self, values: Array) -> Array:
        """Interpolate values at the points of the cells to the corners (t, 3, …)."""
        return (self._interpolation @ values)[self._corners]


@validate_arguments
def draw_stress(
    model: Model,
    q: Equilibrium | Array,
    *,
    parts: Collection[str] | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Map the largest principal compression, with thrust lines and principal directions.

    Crosses show the principal directions; the length of an arm is proportional to the stress: dark
    for compression, green for tension.

    Args:
        model: a model with a mesh, of any fidelity but "rigid".
        q: an equilibrium, or coordinates (n,) of a model with the initial gaps of its joints, such
            as those of a dead load in construction stages.
        parts: parts whose blocks are shaded, for example ["backfill"]; by default all but
            soil, and soil too where no stone has stress, since all are rigid.
        axes: matplotlib axes; by default those of a new figure.

    Returns:
        The figure, with a colour bar; that of `axes` if given.

    Raises:
        InvalidInput: the blocks are rigid, there is no such part, or q belongs to another model.
    """
    model, q = model_and_coordinates(model, q)
    structure, cells = model.structure, model.cells
    corners = (corner_stress_operator(cells) @ q).reshape(-1, 3)
    largest = np.abs(corners).max(axis=1)
    stressed = np.unique(cells.block[largest > 1e-9 * largest.max()])
    blocks = _select_blocks(structure, parts, stressed)
    has_own_figure = axes is None
    axes = style.structure_axes(structure, axes)
    figure = cast(Figure, axes.figure)
    draw_blocks(axes, structure)
    _shade(axes, cells, -principal_values(*corners.T)[1], blocks)
    outlines = [block.drawn() for block in structure.blocks]
    style.add_polygons(axes, outlines, "none", width=0.6, zorder=3)
    _draw_crosses(axes, cells, cell_stress(model, q), blocks)
    joints = joint_dataset(structure, model.resultants(q))
    draw_thrust(axes, joint_marks(structure, joints))
    style.set_title(axes, f"{structure.name}: principal compression")
    style.add_note(figure, {"": structure.assessment})
    axes.autoscale_view()
    if has_own_figure:
        style.add_legend_below(figure)
    return figure


def _select_blocks(
    structure: Structure, parts: Collection[str] | None, stressed: Numbers
) -> Numbers:
    """Return the numbers of the blocks to be shaded."""
    soil = find_yielding_blocks(structure)
    if parts is None:
        stones = np.array([number for number in structure.free if number not in soil])
        return stones if np.isin(stones, stressed).any() else np.array(structure.free)
    known = {structure.blocks[number].part for number in structure.free}
    unknown = sorted(set(parts) - known)
    if unknown or not parts:
        raise InvalidInput(f"parts {unknown} cannot be shaded: name some of {sorted(known)}")
    return np.array([n for n in structure.free if structure.blocks[n].part in parts])


def _shade(axes: Axes, cells: Cells, compression: Array, blocks: Numbers) -> None:
    """Shade the cells of blocks by compression at their corners [Pa], and add a colour bar."""
    triangles = Triangles(cells)
    shaded = np.isin(cells.owner[triangles.cell], blocks)
    x, y = triangles.corners(cells.places)[shaded].reshape(-1, 2).T
    shown = compression[np.isin(cells.block, blocks)].clip(0.0)
    highest = max(float(np.percentile(shown, 100.0 - style.CLIPPED_PERCENT)), 1.0)
    unit, name = (MPa, "MPa") if highest >= 0.05 * MPa else (kPa, "kPa")
    # warm colours, so that the blue thrust line stands out
    colours = (Colour.STONE, "#f6d19a", "#ea9a5b", "#c9553a", "#7d1d32")
    scale: dict[str, Any] = {"cmap": LinearSegmentedColormap.from_list("compression", colours)}
    scale |= {"vmin": 0.0, "vmax": highest / unit, "shading": "gouraud"}
    mesh = Triangulation(x, y, np.arange(len(x)).reshape(-1, 3))
    values = triangles.corners(compression)[shaded].ravel().clip(0.0) / unit
    painted = axes.tripcolor(mesh, values, zorder=2, rasterized=True, gid="compression", **scale)
    # width of the colour bar, and its distance from the axes: 0.16 inch
    wide = 0.16 / cast(Figure, axes.figure).get_figwidth()
    beside = axes.inset_axes((1.0 + wide, 0.0, wide, 1.0))
    extend = "max" if shown.max() > highest else "neither"
    bar = axes.figure.colorbar(painted, cax=beside, extend=extend, ticks=MaxNLocator(5))
    style.style_colour_bar(bar, f"compression [{name}]")


def _draw_crosses(axes: Axes, cells: Cells, stress: Array, blocks: Numbers) -> None:
    """Draw crosses along the principal directions, on a grid in each block."""
    # distance between crosses, and length of the longest arms: 0.21 inch on paper
    spacing = 0.21 * np.ptp(cells.places[:, 0]) / cast(Figure, axes.figure).get_figwidth()
    centre = np.array([cells.places[cell].mean(axis=0) for cell in cells.polygons])
    groups = []
    for number in blocks:
        own = np.flatnonzero(cells.owner == number)
        near = _group_cells(cells.places[cells.block == number], centre[own], spacing)
        groups += [own[group] for group in near]
    middle = np.array([centre[group].mean(axis=0) for group in groups])
    xx, yy, xy = np.array([stress[group].mean(axis=0) for group in groups]).T
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    angles = np.stack([angle, angle + 0.5 * np.pi])
    size = np.stack(principal_values(xx, yy, xy))
    share = size / np.abs(size).max()
    direction = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    arm = 0.5 * spacing * np.abs(share)[..., None] * direction
    ends = np.stack([middle - arm, middle + arm], axis=2)
    pressed, pulled = (-1.0, Colour.TEXT, "compression"), (1.0, Colour.MECHANISM, "tension")
    for sign, colour, name in (pressed, pulled):
        # shorter arms, relative to the longest, are left out
        lines = ends[sign * share > 0.08]
        if len(lines):
            look = {"colors": colour, "linewidths": 0.8, "label": name, "gid": name}
            axes.add_collection(LineCollection(list(lines), zorder=4, **look))


def _group_cells(corners: Array, centre: Array, spacing: float, size: int = 4) -> list[Numbers]:
    """Return groups of neighbouring cells of a block, at about equal distances."""
    middle = corners.mean(axis=0)
    # principal axes of the block: the grid follows an inclined voussoir
    axes = np.linalg.svd(corners - middle, full_matrices=False)[2]
    along, local = (corners - middle) @ axes.T, (centre - middle) @ axes.T
    low, extent = along.min(axis=0), np.ptp(along, axis=0)
    spacing = max(spacing, np.sqrt(size * np.prod(extent) / len(centre)))
    counts = np.maximum(1, np.round(extent / spacing)).astype(int)
    sides = zip(low, extent, counts, strict=True)
    steps = [start + (np.arange(n) + 0.5) * length / n for start, length, n in sides]
    groups = []
    for place in np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 2):
        distance = np.linalg.norm(local - place, axis=1)
        if distance.min() < 0.5 * spacing:
            groups.append(np.argsort(distance, kind="stable")[:size])
    return groups
