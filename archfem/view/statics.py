"""Figures of statics: dead load, mode shapes, free-body diagrams and pushover curves."""

from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from textwrap import fill
from typing import cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, assessed_joints
from archfem.masonry.structure import Structure, join_joint_names
from archfem.models.model import Cells
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.free_body import FreeBody, forces_on
from archfem.statics.modes import Modes
from archfem.statics.pushover import Pushover
from archfem.units import kN, mm
from archfem.view import style
from archfem.view.structure import DisplacedBlocks, draw_structure
from archfem.view.style import Colour, Size

# Letters of a line in the corner of a pushover's picture
MAX_LISTED_LETTERS = 48


@validate_arguments
def draw_dead_load(dead: Equilibrium, *, criteria: Criteria | None = None) -> Figure:
    """Draw a structure under its dead load: its thrust lines, and extreme values at the joints.

    Letters mark the joints of rings and piers with the largest and the least N, the largest |e| and
    the largest V / N. The legend gives these values; the title gives the weight and the range of N.

    Args:
        dead: the equilibrium.
        criteria: failure criteria; by default those stored in the equilibrium.

    Returns:
        The figure.
    """
    structure = dead.model.structure
    figure = draw_structure(structure, dead.joints, criteria=criteria)
    axes, normal = figure.axes[0], assessed_joints(dead.joints)["N"].values / kN
    title = (
        f"{structure.name}: dead load, weight {structure.weight / kN:.4g} kN, "
        f"N from {_write_force(normal.min())} to {_write_force(normal.max())} kN"
    )
    style.set_title(axes, title)
    for letter, (number, texts) in zip(ascii_lowercase, _extremes(dead).items(), strict=False):
        joint = structure.joints[number]
        look = {"ha": "center", "va": "center", "fontweight": "bold", "zorder": 8}
        # 9 points beyond the extrados
        offset = 9.0 * np.array(joint.tangent)
        style.annotate(axes, letter, joint.ends[1], offset, fontsize=Size.TITLE, **look)
        # the symbol of an entry takes 0.6 inch
        letters = int((figure.get_figwidth() - 0.6) / style.text_width(1))
        label = fill(f"{joint.name}: {', '.join(texts)}", letters)
        look = {"marker": style.glyph_marker(letter), "color": Colour.TEXT, "ms": 5, "mew": 0.4}
        axes.plot([], [], ls="", label=label, **look)
    # the legend is made anew: entries were added after that of the structure
    for legend in figure.legends:
        legend.remove()
    style.add_legend_below(figure, 1)
    lines = sum(1 + text.get_text().count("\n") for text in figure.legends[0].get_texts())
    figure.set_figheight(figure.get_figheight() + 0.17 * (lines - 1))
    return figure


def _extremes(dead: Equilibrium) -> dict[int, list[str]]:
    """Return the joints with extreme values, and these values in words."""
    own = assessed_joints(dead.joints)
    normal, e, friction = (own[key].values for key in ("N", "eccentricity", "friction"))
    numbers = own["joint"].values
    extremes: dict[int, list[str]] = {}
    for ranked, values, write in (
        (normal / kN, normal / kN, lambda force: f"largest N = {_write_force(force)} kN"),
        (-normal / kN, normal / kN, lambda force: f"least N = {_write_force(force)} kN"),
        (np.abs(e), e, "largest |e|: e = {:.3f}".format),
        (friction, friction, "largest V/N = {:.3f}".format),
    ):
        if np.isfinite(ranked).any():
            # rounded: of equal values in a symmetric structure the first is marked
            place = int(np.nanargmax(np.round(ranked, 9)))
            extremes.setdefault(int(numbers[place]), []).append(write(values[place]))
    return extremes


def _write_force(force: float) -> str:
    """Write a force with three figures, without a power of ten."""
    return f"{float(f'{force:.3g}'):.9g}"


@validate_arguments
def draw_modes(modes: Modes, numbers: Sequence[int] | None = None) -> Figure:
    """Draw mode shapes over the undeformed outline; soil is paler than stone.

    A mode is called local if other parts, such as ends of the fill, move over twice as far as any
    ring or pier.

    Args:
        modes: result of `modes`.
        numbers: numbers of the modes, counted from 1; by default all.

    Returns:
        The figure, with a panel for each mode.

    Raises:
        InvalidInput: there is no mode of such a number.
    """
    figure, panels = mode_panels(modes, numbers)
    for panel in panels:
        panel.show_phase(1.0)
    return figure


def mode_panels(modes: Modes, numbers: Sequence[int] | None) -> tuple[Figure, list["ModePanel"]]:
    """Return a figure of two columns, and its panels, one for each mode, yet without blocks."""
    count = len(modes.frequencies)
    chosen = list(range(1, count + 1) if numbers is None else numbers)
    if not chosen or not set(chosen) <= set(range(1, count + 1)):
        raise InvalidInput(f"modes {chosen} cannot be drawn: there are 1 to {count}")
    amplitude = ModePanel.amplitude * modes.model.structure.size
    low, high = style.outline_bounds(modes.model.structure)
    low, high = low - 1.1 * amplitude, high + 1.1 * amplitude
    wide, tall = high - low
    # a few modes of a long bridge need the whole width
    columns = 1 if len(chosen) == 1 or (wide > 4.0 * tall and len(chosen) < 5) else 2
    rows, across = -(-len(chosen) // columns), Size.PAGE / 2.0 if columns > 1 else Size.COLUMN
    # a panel is at most 3 inches high; its title takes 0.45, the text below all panels 0.25
    up = min(across * tall / wide, 3.0) + 0.45
    figure = style.new_figure(across * columns, up * rows + 0.25)
    places = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in places:
        axes.set_axis_off()
    panels = []
    for axes, number in zip(places, chosen, strict=False):
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        panels.append(ModePanel(axes, modes, number))
    text = f"mode shapes are normalised to a largest displacement of {amplitude:.2g} m"
    if modes.local[np.array(chosen) - 1].any():
        text += "\nlocal: other parts move more than twice as far as any ring or pier"
    figure.supxlabel(text, fontsize=Size.LABEL, color=Colour.EDGE)
    return figure, panels


class ModePanel:
    """One mode shape on its axes."""

    amplitude = 0.04  # largest displacement, relative to the size of the structure

    def __init__(self, axes: Axes, modes: Modes, number: int) -> None:
        cells = modes.model.cells
        shape = cells.displacement(modes.shapes[:, number - 1])
        amplitude = ModePanel.amplitude * modes.model.structure.size
        self._displacements = shape * amplitude / np.linalg.norm(shape, axis=1).max()
        self._places, self._blocks = cells.places, DisplacedBlocks(axes, modes.model)
        frequency, (x, y) = modes.frequencies[number - 1], 100.0 * modes.mass_ratios[number - 1]
        local = ", local" if modes.local[number - 1] else ""
        masses = f"effective mass: x {x:.0f} %, y {y:.0f} %"
        title = f"mode {number}: {frequency:.2f} Hz{local}\n{masses}"
        axes.set_title(title, fontsize=Size.LABEL, color=Colour.TEXT)

    def show_phase(self, factor: float) -> None:
        """Displace the blocks by the mode shape times a factor."""
        self._blocks.move(self._places + factor * self._displacements)


@validate_arguments
def draw_free_body(
    structure: Structure, joints: xr.Dataset, block: int | str, *, cells: Cells | None = None
) -> Figure:
    """Draw the free-body diagram of one block, and beside it the force polygon.

    Left, the resultant of each joint, N and V together, ends at its point of application, and the
    weight begins at the centroid; all forces have one scale. Right, the same forces are drawn tail
    to head in the order of their directions. The title gives the closing error relative to the
    largest force. Open joints are named in the legend, and have no arrow.

    Args:
        structure: the structure.
        joints: as made by `joint_dataset`, at one instant.
        block: number or name of the block.
        cells: cells of a model with a mesh, for the weight of the mesh.

    Returns:
        The figure: the block, the polygon, and a legend that lists the forces.

    Raises:
        InvalidInput: the block is fixed, or has too many joints to draw.
        InvalidStructure: there is no such block.
    """
    body = forces_on(structure, joints, block, cells)
    limit = 12  # forces that can be distinguished
    if len(body.joints) > limit:
        raise InvalidInput(
            f"block '{body.block.name}' has {len(body.joints)} joints: forces of at most {limit} "
            "can be distinguished; choose a stone"
        )
    rows, columns = style.panel_grid(2)
    figure = style.new_figure(Size.PAGE, 1.1 + 2.4 * rows + 0.18 * len(body.names))
    left, right = figure.subplots(rows, columns)
    colours = [Colour.LINES[k % len(Colour.LINES)] for k in range(len(body.joints))]
    colours.append(Colour.GREY)
    _draw_block_forces(left, structure, body, colours)
    _draw_force_polygon(right, body, colours)
    handles = [
        Line2D([], [], color=colour, lw=2.2, label=f"{k + 1}  {text}")
        for k, (colour, text) in enumerate(zip(colours, _force_texts(body, joints), strict=True))
    ]
    style.add_legend_below(figure, 1, handles=handles)
    return figure


def _is_acting(body: FreeBody) -> Array:
    """Return which forces act; those of open joints, zero up to round-off, do not."""
    return body.sizes > 1e-12 * body.sizes.max()


def _force_texts(body: FreeBody, joints: xr.Dataset) -> list[str]:
    """Return the size of each force, with its components on the joint."""
    texts = []
    names, sizes, acting = body.names, body.sizes / kN, _is_acting(body)
    for name, number, size, acts in zip(names, (*body.joints, -1), sizes, acting, strict=True):
        if not acts:
            texts.append(f"{name}: open")
            continue
        text = f"{name}: {size:.1f} kN"
        if number >= 0:  # a joint, not the weight
            own = joints.isel(joint=number)
            normal, shear = float(own["N"]) / kN, float(own["V"]) / kN
            text += f" (N {normal:.1f}, V {shear:.1f}, e {float(own['eccentricity']):+.3f})"
        texts.append(text)
    return texts


def _draw_block_forces(
    axes: Axes, structure: Structure, body: FreeBody, colours: list[str]
) -> None:
    """Draw the block between its neighbours, and the forces on it."""
    outline = draw_block(axes, structure, structure.blocks.index(body.block), body.joints)
    size = float(np.ptp(outline, axis=0).max())
    # the largest force is drawn 0.75 times as long as the block
    length = 0.75 * size / body.sizes.max()
    heads = body.points.copy()
    heads[-1] += length * body.forces[-1]  # the weight begins where the others end
    tails = heads - length * body.forces
    for k in np.flatnonzero(_is_acting(body)):
        draw_force(axes, tails[k], heads[k], colours[k])
        away = np.array([1.0, 0.0])
        if k < len(tails) - 1:
            away = (tails[k] - heads[k]) / np.linalg.norm(tails[k] - heads[k])
        _number_force(axes, k, tails[k], away, colours[k])
    axes.plot(*body.points[:-1].T, "o", ms=3.0, color=Colour.TEXT, zorder=6)
    axes.plot(*body.points[-1:].T, "+", ms=8.0, color=Colour.TEXT, zorder=6)
    set_square_limits(axes, np.concatenate([outline, tails, heads]))


def draw_block(axes: Axes, structure: Structure, number: int, joints: Sequence[int]) -> Array:
    """Draw a block between its neighbours at some joints, and return its outline (k, 2) [m]."""
    style.style_length_axes(axes)
    for joint in (structure.joints[k] for k in joints):
        (other,) = set(joint.blocks) - {number}
        neighbour = [structure.blocks[other].drawn()]
        style.add_polygons(axes, neighbour, "none", edge=Colour.UNDEFORMED, width=0.8)
    outline = structure.blocks[number].drawn()
    style.add_polygons(axes, [outline], Colour.STONE, width=1.2, zorder=2)
    style.set_title(axes, structure.blocks[number].name)
    return outline


def _draw_force_polygon(axes: Axes, body: FreeBody, colours: list[str]) -> None:
    """Draw the forces tail to head."""
    style.style_axes(axes, "horizontal force [kN]", "vertical force [kN]")
    axes.set_aspect("equal")
    forces = body.forces / kN
    order = np.argsort(np.arctan2(forces[:, 1], forces[:, 0]), kind="stable")
    order = order[_is_acting(body)[order]]
    corners = np.concatenate([np.zeros((1, 2)), np.cumsum(forces[order], axis=0)])
    for k, tail, head in zip(order, corners[:-1], corners[1:], strict=True):
        draw_force(axes, tail, head, colours[k])
        x, y = forces[k] / np.linalg.norm(forces[k])
        outward = np.array([y, -x])
        _number_force(axes, k, 0.5 * (tail + head), outward, colours[k])
    set_square_limits(axes, corners)
    style.set_title(axes, f"closes to {body.closing_error:.0e} of the largest force")


def set_square_limits(axes: Axes, points: Array) -> None:
    """Set the limits of axes to a square around points."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.58 * float((high - low).max())
    (left, bottom), (right, top) = middle - half, middle + half
    axes.set(xlim=(left, right), ylim=(bottom, top))


def draw_force(axes: Axes, tail: Array, head: Array, colour: str) -> None:
    """Draw the arrow of a force."""
    arrow = {"arrowstyle": "-|>,head_length=0.5,head_width=0.22", "shrinkA": 0, "shrinkB": 0}
    arrow |= {"color": colour, "lw": 1.4, "mutation_scale": 10, "joinstyle": "miter"}
    axes.annotate("", head, tail, arrowprops=arrow, zorder=5)


def _number_force(axes: Axes, index: int, place: Array, away: Array, colour: str) -> None:
    """Write the number of a force, counted from 1, beside a place in a direction."""
    look = {"fontsize": Size.TITLE, "ha": "center", "va": "center", "zorder": 7}
    style.annotate(axes, str(index + 1), place, 9.0 * away, color=colour, **look)


@validate_arguments
def draw_pushover(
    pushes: Pushover | Mapping[str, Pushover],
    *,
    limits: Mapping[str, float] | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Draw pushover curves, load factor over displacement, with discs at the first hinges.

    The discs of a single curve are numbered. The names of their joints and the faces in contact are
    listed beside the curve. If they are long, the first six are in the legend instead.

    Args:
        pushes: a pushover analysis, or the label of each one and the analysis.
        limits: names of known limit loads, and their factors, drawn as dashed lines.
        axes: matplotlib axes; by default those of a new figure.

    Returns:
        The figure; that of `axes` if given.

    Raises:
        InvalidInput: there is no pushover, or more than there are colours.
    """
    pushes = {"pushover": pushes} if isinstance(pushes, Pushover) else pushes
    if not 1 <= len(pushes) <= len(Colour.LINES):
        raise InvalidInput(f"{len(pushes)} pushovers in one picture: give 1 to {len(Colour.LINES)}")
    axes = style.new_figure(Size.COLUMN, 3.8).add_subplot() if axes is None else axes
    units = {push.curve["factor"].attrs["units"] for push in pushes.values()}
    load = "load factor λ [-]" if units == {"1"} else "work per unit of settlement [N m]"
    style.style_axes(axes, "displacement [mm]", load)
    reach = max(_displacement_shown(push) for push in pushes.values())
    for number, (label, push) in enumerate(pushes.items()):
        displacement, factor = push.curve["displacement"] / mm, push.curve["factor"]
        axes.plot(displacement, factor, label=label, **style.line_style(number))
        hinges = _mark_first_hinges(axes, push, reach)
    look = {"color": Colour.HINGE, "ms": 6.0, "mec": "white"}
    axes.plot([], [], "o", label="first hinge of a joint", **look)
    # the list stands where no curve runs
    falls = any(p.curve["factor"][-1] < p.curve["factor"][0] for p in pushes.values())
    axes.set_xlim(0.0, reach / mm)
    if len(pushes) == 1 and hinges:
        _list_hinges(axes, hinges, at_top=falls)
    for number, (name, value) in enumerate((limits or {}).items()):
        look = {"ls": ("--", ":", "-.")[number % 3], "color": Colour.TEXT, "lw": 1.0, "zorder": 1}
        axes.axhline(value, label=f"{name}: {value:.4g}", **look)
    style.add_legend(axes)
    return cast(Figure, axes.figure)


def _displacement_shown(push: Pushover) -> float:
    """Return 1.3 times the displacement at which a curve is flat, or all where it softens [m]."""
    factor, displacement = (push.curve[key].values for key in ("factor", "displacement"))
    change = np.abs(factor - factor[0])
    if change[-1] < 0.98 * change.max():
        return 1.04 * float(displacement.max())
    return 1.3 * float(displacement[np.argmax(change >= 0.98 * change[-1])])


def _mark_first_hinges(axes: Axes, push: Pushover, reach: float) -> dict[tuple[float, float], str]:
    """Mark the steps in which joints first hinge; return their places and joints."""
    steps: dict[int, list[tuple[int, str]]] = {}
    for (joint, side), step in zip(push.hinges, push.hinge_steps, strict=True):
        steps.setdefault(step, []).append((joint, side))
    names, found = push.joints["name"].values.astype(str), {}
    for step, hinges in steps.items():
        place = float(push.curve["displacement"][step]) / mm, float(push.curve["factor"][step])
        if place[0] > reach / mm:
            continue
        axes.plot(*place, "o", color=Colour.HINGE, ms=6.0, mec="white", mew=0.8, zorder=5)
        faces = {side: [names[j] for j, own in hinges if own == side] for _, side in hinges}
        found[place] = "; ".join(f"{join_joint_names(own)}, {side}" for side, own in faces.items())
    return found


def _merge_close_discs(
    places: Sequence[tuple[float, float]], axes: Axes
) -> list[tuple[int, int, tuple[float, float]]]:
    """Return first and last number, from 1, of discs that share a label, and its place."""
    size = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())])
    merged: list[tuple[int, int, tuple[float, float]]] = []
    for number, place in enumerate(places, start=1):
        # the numbers of closer discs would overlap
        if merged and np.linalg.norm((np.array(place) - merged[-1][2]) / size) < 0.035:
            merged[-1] = merged[-1][0], number, place
        else:
            merged.append((number, number, place))
    return merged


def _list_hinges(
    axes: Axes, hinges: Mapping[tuple[float, float], str], *, at_top: bool, most: int = 6
) -> None:
    """Number the discs of a curve, and list their joints at the right, long names in the legend."""
    for first, last, place in _merge_close_discs(list(hinges), axes):
        number = f"{first}" if first == last else f"{first}–{last}"
        style.annotate(axes, number, place, (4, -11), path_effects=style.white_halo(2.5))
    lines = [f"{number}  {joints}" for number, joints in enumerate(hinges.values(), start=1)]
    if len(max(lines, key=len)) > MAX_LISTED_LETTERS:
        rest = [f"… ({len(lines)} in all)"] if len(lines) > most else []
        axes.plot([], [], " ", label="\n".join([*lines[:most], *rest]))
        return
    place, alignment = ((0.97, 0.95), "top") if at_top else ((0.97, 0.05), "bottom")
    look = {"ha": "right", "va": alignment, "multialignment": "left"}
    style.annotate(axes, "\n".join(lines), place, xycoords="axes fraction", **look)
