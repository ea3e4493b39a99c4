"""A block cut free: the forces on it where they act, and the polygon that they close."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure
from archfem.models.cells import Cells
from archfem.statics.freebody import FreeBody, forces_on
from archfem.units import kN
from archfem.view.style import (
    EDGE,
    FAINT,
    GHOST,
    INK,
    LINES,
    NORMAL,
    SMALL,
    STONE,
    Page,
    dress,
    entitle,
)

MOST = 12
"""Joints of a block whose forces can still be told apart."""

LONGEST = 0.75
"""Length of the largest force beside the block, relative to the block."""

NOTHING = 1e-12
"""Part of the largest force up to which another is round-off, as where a joint barely touches."""

WIDTH, PANEL, LINE = 9.6, 5.0, 0.18
"""Width of the page, height of its panels and of a line below them [inch]."""


def draw_free_body(
    structure: Structure, joints: xr.Dataset, block: int | str, *, cells: Cells | None = None
) -> Figure:
    """Draw the forces on one block at rest, and beside it the polygon they close.

    Left, the resultant of each joint, N and V together, points at where it acts on the block, and
    the weight hangs from the centroid; all to one scale. Right, the same forces tail to head in
    the order of their directions. What is left open is said relative to the largest force. Open
    joints are named, and have no arrow.

    Args:
        structure: whose block it is.
        joints: as made by `joint_dataset`, at one instant.
        block: its number or name.
        cells: of a model with a mesh, for the weight as meshed.

    Returns:
        The page: the block, the polygon, and below them what each force is.

    Raises:
        InvalidInput: the block is fixed, or has too many joints to draw.
        InvalidStructure: there is no such block.
    """
    body = forces_on(structure, joints, block, cells)
    if len(body.joints) > MOST:
        raise InvalidInput(
            f"block '{body.block.name}' has {len(body.joints)} joints: forces of at most {MOST} "
            "can be told apart; choose a stone"
        )
    page = Page(figsize=(WIDTH, PANEL + LINE * len(body.names)), layout="constrained")
    left, right = page.subplots(1, 2)
    colours = [LINES[k % len(LINES)] for k in range(len(body.joints))] + [FAINT]
    _block(left, structure, body, colours)
    _polygon(right, body, colours)
    handles = [
        Line2D([], [], color=colour, lw=2.2, label=f"{k + 1}  {words}")
        for k, (colour, words) in enumerate(zip(colours, _words(body, joints), strict=True))
    ]
    page.legend(handles=handles, loc="outside lower center", frameon=False, fontsize=SMALL)
    return page


def _words(body: FreeBody, joints: xr.Dataset) -> list[str]:
    """What each force is, with its components on the joint."""
    words = []
    for name, number, size in zip(body.names, (*body.joints, -1), body.sizes / kN, strict=True):
        words.append(f"{name}: {size:.1f} kN")
        if number >= 0 and size <= NOTHING * body.sizes.max() / kN:
            words[-1] = f"{name}: open"
        elif number >= 0:
            own = joints.isel(joint=number)
            normal, shear = float(own["N"]) / kN, float(own["V"]) / kN
            words[-1] += f" (N {normal:.1f}, V {shear:.1f}, e {float(own['eccentricity']):+.3f})"
    return words


def _block(axes: Axes, structure: Structure, body: FreeBody, colours: list[str]) -> None:
    """Draw the block between its neighbours, and the forces on it."""
    dress(axes, "x [m]", "y [m]")
    axes.set_aspect("equal")
    outline = body.block.drawn()
    number = structure.blocks.index(body.block)
    for joint in (structure.joints[k] for k in body.joints):
        (other,) = set(joint.blocks) - {number}
        drawn = structure.blocks[other].drawn()
        axes.add_patch(Polygon(drawn, facecolor="none", edgecolor=GHOST, lw=0.8, zorder=1))
    axes.add_patch(Polygon(outline, facecolor=STONE, edgecolor=EDGE, lw=1.2, zorder=2))
    size = float(np.ptp(outline, axis=0).max())
    length = LONGEST * size / body.sizes.max()
    heads = body.points.copy()
    heads[-1] += length * body.forces[-1]
    tails = heads - length * body.forces
    for k, (tail, head, colour) in enumerate(zip(tails, heads, colours, strict=True)):
        if body.sizes[k] <= NOTHING * body.sizes.max():  # an open joint
            continue
        _arrow(axes, tail, head, colour)
        away = (tail - head) / np.linalg.norm(tail - head) if k < len(tails) - 1 else [1.0, 0.0]
        _number(axes, k, tail + 0.07 * size * np.array(away), colour)
    axes.plot(*body.points[:-1].T, "o", ms=3.0, color=INK, zorder=6)
    axes.plot(*body.points[-1:].T, "+", ms=8.0, color=INK, zorder=6)
    seen = np.concatenate([outline, tails, heads])
    _frame(axes, seen)
    entitle(axes, body.block.name)


def _polygon(axes: Axes, body: FreeBody, colours: list[str]) -> None:
    """Draw the forces tail to head."""
    dress(axes, "horizontal force [kN]", "vertical force [kN]")
    axes.set_aspect("equal")
    forces = body.forces / kN
    order = np.argsort(np.arctan2(forces[:, 1], forces[:, 0]), kind="stable")
    order = order[body.sizes[order] > NOTHING * body.sizes.max()]
    corners = np.concatenate([np.zeros((1, 2)), np.cumsum(forces[order], axis=0)])
    span = float(np.ptp(corners, axis=0).max())
    for k, tail, head in zip(order, corners[:-1], corners[1:], strict=True):
        _arrow(axes, tail, head, colours[k])
        side = forces[k] / np.linalg.norm(forces[k])
        outward = np.array([side[1], -side[0]])
        _number(axes, int(k), 0.5 * (tail + head) + 0.06 * span * outward, colours[k])
    _frame(axes, corners)
    axes.set_title(
        f"closes to {body.closing_error:.0e} of the largest force", fontsize=NORMAL, color=INK
    )


def _frame(axes: Axes, seen: Array) -> None:
    """Show a square around points, true to scale."""
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle, half = 0.5 * (low + high), 0.58 * float((high - low).max())
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)


def _arrow(axes: Axes, tail: Array, head: Array, colour: str) -> None:
    """Draw one force."""
    style = {"arrowstyle": "-|>,head_length=0.5,head_width=0.22", "shrinkA": 0, "shrinkB": 0}
    look = {"color": colour, "lw": 1.8, "mutation_scale": 14, "joinstyle": "miter"}
    axes.annotate("", head, tail, arrowprops={**style, **look}, zorder=5)


def _number(axes: Axes, number: int, place: Array, colour: str) -> None:
    """Write the number of a force."""
    x, y = place
    words = str(number + 1)
    axes.text(x, y, words, color=colour, fontsize=NORMAL, ha="center", va="center", zorder=7)
