"""The dead load in one picture: thrust lines, and what is largest and least in numbers.

Pictures of vibration shapes.

A block cut free: the forces on it where they act, and the polygon that they close.

The picture of a pushover: what is resisted over displacement, hinges in order, the limit.
"""

from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from textwrap import fill
from typing import cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, assessed_joints
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_joint_names
from archfem.models.model import Cells
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.free_body import FreeBody, forces_on
from archfem.statics.modes import Modes
from archfem.statics.pushover import Pushover
from archfem.units import kN, mm
from archfem.view.joint_marks import support_outlines
from archfem.view.structure import draw_structure
from archfem.view.style import (
    COLUMN,
    EDGE,
    FAINT,
    GHOST,
    HINGE,
    INK,
    LETTER,
    LINES,
    LONG,
    NORMAL,
    SMALL,
    SOIL,
    STONE,
    SUPPORT,
    SYMBOL,
    WIDE,
    Page,
    dress,
    entitle,
    legend,
    renew_legend,
)

# Distance of a letter from the joint that it is about [points]
AWAY = 9.0


def draw_dead_load(dead: Equilibrium, *, criteria: Criteria | None = None) -> Figure:
    """Draw a structure under its dead load: its thrust lines, and numbers at the joints.

    Letters mark those joints of rings and piers that have the largest and the least N, the largest
    |e| and the largest V / N; below stand their numbers, and in the title weight and span of N.

    Args:
        dead: the equilibrium.
        criteria: what makes a joint fail; by default those by which it was judged.

    Returns:
        The page.
    """
    structure = dead.model.structure
    figure = draw_structure(structure, dead.joints, criteria=criteria)
    axes, normal = figure.axes[0], assessed_joints(dead.joints)["N"].values / 1e3
    entitle(
        axes,
        f"{structure.name}: dead load, weight {structure.weight / 1e3:.4g} kN, "
        f"N from {normal.min():.3g} to {normal.max():.3g} kN",
    )
    for letter, (number, words) in zip(ascii_lowercase, _telling(dead).items(), strict=False):
        _tell(axes, dead, number, letter=letter, words=words)
    renew_legend(figure)
    return figure


def _telling(dead: Equilibrium) -> dict[int, list[str]]:
    """What is said of which joints."""
    own = assessed_joints(dead.joints)
    numbers = own["joint"].values
    said: dict[int, list[str]] = {}
    for key, sign, words in (
        ("N", 1.0, "largest N = {:.3g} kN"),
        ("N", -1.0, "least N = {:.3g} kN"),
        ("eccentricity", 0.0, "largest |e|: e = {:.3f}"),
        ("friction", 1.0, "largest V/N = {:.3f}"),
    ):
        values = own[key].values * (1e-3 if key == "N" else 1.0)
        order = np.abs(values) if sign == 0.0 else sign * values
        if np.isfinite(order).any():
            place = int(np.nanargmax(np.round(order, 9)))
            said.setdefault(int(numbers[place]), []).append(words.format(values[place]))
    return said


def _tell(axes: Axes, dead: Equilibrium, number: int, *, letter: str, words: list[str]) -> None:
    """Put a letter beside a joint, beyond its extrados, and what it stands for into the legend."""
    joint = dead.model.structure.joints[number]
    axes.annotate(
        letter, tuple(joint.ends[1]), tuple(AWAY * joint.tangent), textcoords="offset points",
        fontsize=NORMAL, fontweight="bold", color=INK, zorder=8, ha="center", va="center",
    )  # fmt: skip
    letters = int((axes.figure.get_figwidth() - SYMBOL) / (LETTER * SMALL))
    label = fill(f"{joint.name}: {', '.join(words)}", letters)
    axes.plot([], [], ls="", marker=f"${letter}$", color=INK, ms=5, mew=0.4, label=label)


# Largest displacement in a picture, relative to the size of the structure
REACH = 0.04


def draw_modes(modes: Modes, numbers: Sequence[int] | None = None) -> Figure:
    """Draw vibration shapes, magnified, over the outline at rest; soil is paler than stone.

    Args:
        modes: as found by `modes`.
        numbers: which of them, counted from 1; by default all.

    Returns:
        The page, with a panel for each shape.

    Raises:
        InvalidInput: a number is not among them.
    """
    figure, panels = mode_panels(modes, numbers)
    for panel in panels:
        panel.swing(1.0)
    return figure


def mode_panels(modes: Modes, numbers: Sequence[int] | None) -> tuple[Figure, list["Panel"]]:
    """Return a page of two columns, and its panels, one for each shape, not yet moved."""
    count = len(modes.frequencies)
    chosen = list(range(1, count + 1) if numbers is None else numbers)
    if not chosen or not set(chosen) <= set(range(1, count + 1)):
        raise InvalidInput(f"modes {chosen} cannot be drawn: there are 1 to {count}")
    low, high = _view(modes)
    wide, tall = high - low
    columns, rows = min(2, len(chosen)), -(-len(chosen) // 2)
    across = (COLUMN if wide < LONG * tall else WIDE) / 2.0
    # largest height of a panel; height of its title and of the gap below it, and of what is said
    # below all [inch]
    up = min(across * tall / wide, 3.0) + 0.45
    # largest height of a panel; height of its title and of the gap below it, and of what is said
    # below all [inch]
    figure = Page(figsize=(across * columns, up * rows + 0.25), layout="constrained")
    places = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in places:
        axes.set_axis_off()
    panels = []
    for axes, number in zip(places, chosen, strict=False):
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        panels.append(Panel(axes, modes, number))
    drawn = REACH * modes.model.structure.size
    words = f"largest displacement drawn as {drawn:.2g} m: shapes have no size of their own"
    figure.supxlabel(words, fontsize=SMALL, color=EDGE)
    return figure, panels


def _view(modes: Modes) -> tuple[Array, Array]:
    """Corners of what is seen: the structure, and room to swing."""
    structure = modes.model.structure
    points = np.concatenate([block.drawn() for block in structure.blocks])
    room = 1.1 * REACH * structure.size
    return points.min(axis=0) - room, points.max(axis=0) + room


class Panel:
    """One mode on its axes."""

    def __init__(self, axes: Axes, modes: Modes, number: int) -> None:
        model = modes.model
        cells, structure = model.cells, model.structure
        moves = cells.displacement(modes.shapes[:, number - 1])
        self._moves = moves * REACH * structure.size / np.linalg.norm(moves, axis=1).max()
        self._places = cells.places
        soil = find_yielding_blocks(structure)
        self._loops = sorted(_loops(cells), key=lambda loop: cells.block[loop[0]] not in soil)
        pale = [cells.block[loop[0]] in soil for loop in self._loops]
        rest = LineCollection(
            cells.places[cells.outline_edges], colors=GHOST, linewidths=0.9, zorder=1
        )
        still = PolyCollection(
            support_outlines(model, 1.0), facecolors=SUPPORT, edgecolors=EDGE, linewidths=0.6
        )
        self._blocks = PolyCollection(
            [],
            facecolors=[SOIL if each else STONE for each in pale],
            edgecolors=[FAINT if each else EDGE for each in pale],
            linewidths=0.6,
            zorder=2,
        )
        for drawn in (rest, still, self._blocks):
            axes.add_collection(drawn, autolim=False)
        axes.set_title(_title(modes, number), fontsize=SMALL, color=INK)

    def swing(self, phase: float) -> None:
        """Move the blocks."""
        places = self._places + phase * self._moves
        self._blocks.set_verts([places[loop] for loop in self._loops])


def _loops(cells: Cells) -> list[list[int]]:
    """Points around each block, in order."""
    following, loops = dict(cells.outline_edges.tolist()), []
    while following:
        start, point = following.popitem()
        loop = [start]
        while point != start:
            loop.append(point)
            point = following.pop(point)
        loops.append(loop)
    return loops


def _title(modes: Modes, number: int) -> str:
    frequency, (x, y) = modes.frequencies[number - 1], 100.0 * modes.mass_ratios[number - 1]
    return f"mode {number}: {frequency:.2f} Hz\nmass along x {x:.0f} %, along y {y:.0f} %"


# Joints of a block whose forces can still be told apart
MOST = 12


# Part of the largest force up to which another is round-off, as where a joint barely touches
NOTHING = 1e-12


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
    # width of the page, height of its panels and of a line below them [inch]
    # width of the page, height of its panels and of a line below them [inch]
    page = Page(figsize=(9.6, 5.0 + 0.18 * len(body.names)), layout="constrained")
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
    # length of the largest force beside the block, relative to the block
    length = 0.75 * size / body.sizes.max()
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


def draw_pushover(
    pushes: Pushover | Mapping[str, Pushover],
    *,
    limits: Mapping[str, float] | None = None,
    reach: float | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Draw factors over displacements; discs mark where joints first hinge.

    Where there is one curve its discs are numbered, with the joints' names and the faces that stay
    in contact beside it.

    Args:
        pushes: one, or what to call each pushover, and the pushover.
        limits: what to call known limits, and their factors, drawn as dashed lines.
        reach: of the displacement axis [m]; by default where the curves have become flat.
        axes: where to draw; by default a new figure.

    Returns:
        The page; that of `axes` where given.

    Raises:
        InvalidInput: there is no pushover, or too many to tell apart.
    """
    pushes = {"pushover": pushes} if isinstance(pushes, Pushover) else pushes
    if not 1 <= len(pushes) <= len(LINES):
        raise InvalidInput(f"{len(pushes)} pushovers in one picture: give 1 to {len(LINES)}")
    page = Page(figsize=(COLUMN, 3.8), layout="constrained")
    axes = page.add_subplot() if axes is None else axes
    units = {push.curve["factor"].attrs["units"] for push in pushes.values()}
    what = "load factor λ [-]" if units == {"1"} else "work on a unit of settlement [N m]"
    dress(axes, "displacement [mm]", what)
    reach = reach or max(_flat(push) for push in pushes.values())
    for (label, push), colour in zip(pushes.items(), LINES, strict=False):
        axes.plot(push.curve["displacement"] / mm, push.curve["factor"], color=colour, label=label)
        told = _mark(axes, push, reach)
    axes.plot([], [], "o", color=HINGE, ms=6.0, mec="white", label="joint hinges")
    falls = any(push.factor < float(push.curve["factor"][0]) for push in pushes.values())
    axes.set_xlim(0.0, reach / mm)
    if len(pushes) == 1 and told:
        _tell_pushover(axes, told, above=falls)
    for value in (limits or {}).values():
        axes.axhline(value, color=INK, ls="--", lw=1.0, zorder=1)
    for names, value in _apart(limits or {}, float(np.ptp(axes.get_ylim()))).items():
        _limit(axes, names, value, at_left=falls)
    legend(axes)
    return cast(Figure, axes.figure)


def _apart(limits: Mapping[str, float], high: float) -> dict[str, float]:
    """Lines of names and values, each for limits too near to be told apart, and the highest."""
    found: dict[str, float] = {}
    for name, value in sorted(limits.items(), key=lambda each: each[1]):
        words = f"{name}: {value:.4g}"
        # distance of limits, and of discs, that share a label, relative to the axes
        if found and value - next(reversed(found.values())) < 0.05 * high:
            words = f"{found.popitem()[0]}, {words}"
        found[words] = value
    return found


def _limit(axes: Axes, words: str, value: float, *, at_left: bool) -> None:
    """Name known limits, where no curve runs."""
    axes.annotate(
        words,
        (0.0 if at_left else 1.0, value),
        xycoords=("axes fraction", "data"),
        xytext=(4 if at_left else -4, 3),
        textcoords="offset points",
        fontsize=SMALL,
        ha="left" if at_left else "right",
    )


def _flat(push: Pushover) -> float:
    """Displacement by which a curve has become flat, and some more [m]."""
    factor = push.curve["factor"].values
    way = np.abs(factor - factor[0])
    # share of the way to the last factor after which a curve is nearly flat
    first = int(np.argmax(way >= 0.98 * way[-1]))
    return 1.3 * float(push.curve["displacement"][first])


def _mark(axes: Axes, push: Pushover, reach: float) -> dict[tuple[float, float], str]:
    """Put discs where joints first hinge, one for all of a step: their places, and which joints."""
    steps: dict[int, list[tuple[int, str]]] = {}
    for (joint, side), step in zip(push.hinges, push.hinge_steps, strict=True):
        steps.setdefault(step, []).append((joint, side))
    names, told = push.joints["name"].values.astype(str), {}
    for step, hinges in steps.items():
        place = float(push.curve["displacement"][step]) / mm, float(push.curve["factor"][step])
        if place[0] > reach / mm:
            continue
        axes.plot(*place, "o", color=HINGE, ms=6.0, mec="white", mew=0.8, zorder=5)
        faces = {side: [names[j] for j, own in hinges if own == side] for _, side in hinges}
        told[place] = "; ".join(f"{join_joint_names(own)}, {side}" for side, own in faces.items())
    return told


def _runs(
    places: Sequence[tuple[float, float]], axes: Axes
) -> list[tuple[int, int, tuple[float, float]]]:
    """First and last number, from 1, of discs whose numbers would overlap, and the last place."""
    size = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())])
    found: list[tuple[int, int, tuple[float, float]]] = []
    for number, place in enumerate(places, start=1):
        # distance of limits, and of discs, that share a label, relative to the axes
        if found and np.linalg.norm((np.array(place) - found[-1][2]) / size) < 0.035:
            found[-1] = found[-1][0], number, place
        else:
            found.append((number, number, place))
    return found


def _tell_pushover(axes: Axes, told: Mapping[tuple[float, float], str], *, above: bool) -> None:
    """Number the discs of a curve, and say what they are in the corner that it leaves free."""
    halo = [withStroke(linewidth=2.5, foreground="white")]
    for first, last, place in _runs(list(told), axes):
        number = f"{first}" if first == last else f"{first}–{last}"
        axes.annotate(
            number, place, (4, -11), textcoords="offset points", fontsize=SMALL, color=INK,
            path_effects=halo,
        )  # fmt: skip
    lines = [f"{number}  {words}" for number, words in enumerate(told.values(), start=1)]
    axes.annotate(
        "\n".join(lines), (0.97, 0.95 if above else 0.05), xycoords="axes fraction",
        fontsize=SMALL, color=INK, ha="right", va="top" if above else "bottom",
        multialignment="left",
    )  # fmt: skip
