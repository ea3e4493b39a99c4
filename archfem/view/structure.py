"""Figures of structures: blocks, thrust lines, joint names, loads and displaced shapes."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.dynamics.history import History
from archfem.dynamics.verdict import find_farthest
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, describe_assessed_joints, envelope, with_failure_flags
from archfem.joints.resultants import check_instant
from archfem.limit.mechanism_count import counted_mechanism, leave_out_walls
from archfem.limit.mechanism_kinematics import verified_mechanism
from archfem.masonry.loads import BodyForce, PointLoad, Settlement
from archfem.masonry.standing import list_own_stones
from archfem.masonry.stiffness_ratio import list_stones
from archfem.masonry.structure import Joint, Structure
from archfem.models.model import Model
from archfem.statics.equilibrium import Equilibrium
from archfem.view import positions, style
from archfem.view.joint_marks import (
    Marker,
    Marks,
    joint_marks,
    joint_pairs,
    joints_of_state,
    model_and_coordinates,
    round_magnification,
    support_outlines,
)
from archfem.view.style import Colour, Size

Action = BodyForce | PointLoad | Settlement

# Letters of a joint's name for which there is room at an axis, or at the joint
MAX_NAME_LETTERS = 16


@validate_arguments
def draw_structure(
    structure: Structure,
    joints: xr.Dataset | None = None,
    *,
    criteria: Criteria | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Draw the blocks and, if joints are given, their thrust lines and failures at one instant.

    Supports are darker, soil is paler. Each ring and pier has its thrust line, interrupted where a
    joint is open. A red circle marks a hinge at the face where its blocks stay in contact. Two
    opposite arrows mark a sliding joint, a white gap an open one.

    Args:
        structure: the structure, undeformed.
        joints: its joints at one instant, as made by `joint_dataset`.
        criteria: failure criteria; by default those stored in `joints`.
        axes: matplotlib axes; by default those of a new figure.

    Returns:
        The figure; that of `axes` if given.

    Raises:
        InvalidInput: `joints` has several instants, or belongs to another structure.
    """
    axes = style.structure_axes(structure, axes)
    if joints is not None:
        check_instant(structure, joints)
        joints = with_failure_flags(joints, criteria)
    _draw_state(axes, structure, joints, structure.name)
    if joints is not None:
        style.add_legend(axes)
        style.add_note(cast(Figure, axes.figure), {"": describe_assessed_joints(joints)})
    return cast(Figure, axes.figure)


def _draw_state(axes: Axes, structure: Structure, joints: xr.Dataset | None, name: str) -> None:
    """Draw blocks and, if given, their joints at one instant; the title states failed joints."""
    draw_blocks(axes, structure)
    title = title_at_instant(name, joints)
    if joints is not None:
        draw_marks(axes, joint_marks(structure, joints))
        title += _describe_failed_joints(structure, joints)
    style.set_title(axes, title)
    axes.autoscale_view()


def _describe_failed_joints(structure: Structure, joints: xr.Dataset) -> str:
    """Return whether enough failed joints permit a motion; empty where fewer have failed."""
    found = verified_mechanism(structure, joints)
    counted = found.counted and counted_mechanism(leave_out_walls(joints))
    if counted is None:
        return ""
    motion = "no motion" if found.kind == "none" else f"{found.kind} mechanism"
    return f": {len(counted.joints)} failed joints; {motion} verified"


@validate_arguments
def draw_instants(states: Mapping[str, tuple[Structure, xr.Dataset | None]]) -> Figure:
    """Draw several structures, one below the other, with thrust lines and failed joints.

    Where enough joints have failed for a mechanism by count, the title states whether a motion of
    the blocks is verified, as by `verified_mechanism`.

    Args:
        states: the label of each state, its structure, and its joints at one instant or None.

    Returns:
        The figure, with a panel for each structure.
    """
    figure, panels = _lay_out_below([structure for structure, _ in states.values()])
    drawn = {label: joints for label, (_, joints) in states.items() if joints is not None}
    for axes, (label, (structure, joints)) in zip(panels, states.items(), strict=True):
        if joints is not None:
            check_instant(structure, joints)
        _draw_state(axes, structure, joints, label)
    _explain_panels(figure, drawn)
    return figure


@validate_arguments
def draw_backbones(
    runs: History | Mapping[str, History],
    *,
    dead: xr.Dataset | Mapping[str, xr.Dataset] | None = None,
) -> Figure:
    """Draw the band that thrust lines cover over a run, on the outline of the structure.

    At each joint of rings and piers the band reaches from the least to the largest eccentricity.
    Red circles mark the faces at which joints hinged at some instant, gaps the joints that opened.

    Args:
        runs: a history with its structure, or the label of each one and the history.
        dead: joints under dead load, of all runs or by label, drawn as a dotted thrust line.

    Returns:
        The figure, with a panel for each run, one below the other.

    Raises:
        InvalidInput: there is no run, a run has no structure, or `dead` is of another structure.
    """
    runs = {"": runs} if isinstance(runs, History) else runs
    structures = [run.structure for run in runs.values() if run.structure is not None]
    if not runs or len(structures) < len(runs):
        raise InvalidInput(
            f"{len(structures)} of {len(runs)} runs have a structure to draw: give one or more, "
            "read with History.read(path, structure)"
        )
    if dead is None or isinstance(dead, xr.Dataset):
        dead = {} if dead is None else dict.fromkeys(runs, dead)
    if unknown := sorted(set(dead) - set(runs)):
        raise InvalidInput(f"dead load of {unknown}, but the runs are {list(runs)}")
    figure, panels = _lay_out_below(structures)
    for axes, structure, (label, run) in zip(panels, structures, runs.items(), strict=True):
        draw_blocks(axes, structure)
        _draw_backbone(axes, structure, run.joints, dead.get(label))
        first, last = run.time[[0, -1]]
        title = f"thrust lines from {first:.4g} to {last:.4g} s"
        style.set_title(axes, f"{label or structure.name}: {title}")
        axes.autoscale_view()
    _explain_panels(figure, {label: run.joints for label, run in runs.items()})
    return figure


def _draw_backbone(
    axes: Axes, structure: Structure, joints: xr.Dataset, dead: xr.Dataset | None
) -> None:
    """Draw the band between extreme thrust lines, hinges of all instants, and the dead load."""
    shown, span = joints["judged"].values, envelope(joints)
    marker, pairs = Marker(structure, shown), joint_pairs(structure, shown)
    low, high = (marker.points(span[key].values) for key in ("lowest", "highest"))
    first, second = pairs.T
    # an extrados may be on the other hand in the next part: bands must not cross over
    turned = np.einsum("ij,ij->i", *structure.tangents[pairs.T]) < 0.0
    ends = [np.where(turned[:, None], a[second], b[second]) for a, b in ((low, high), (high, low))]
    bands = np.stack([low[first], high[first], *ends], axis=1)
    bands = bands[np.isfinite(bands).all(axis=(1, 2))]
    look: dict[str, Any] = {"width": 0.0, "zorder": 4, "alpha": 0.35, "gid": "band"}
    style.add_polygons(axes, list(bands), Colour.THRUST, **look)
    sides = bands[:, [[0, 3], [1, 2]]].reshape(-1, 2, 2)
    look = {"color": Colour.THRUST, "lw": 0.8, "zorder": 5}
    look["label"] = "least and largest eccentricity"
    axes.plot(*_join_segments(sides).T, gid="backbones", **look)
    hinges = [
        structure.ends[(joints["hinge"] == side).any("time").values & shown, end]
        for side, end in ((-1, 0), (1, 1))
    ]
    gaps = structure.ends[joints["open"].any("time").values & shown]
    draw_marks(axes, Marks(hinges=np.concatenate(hinges), gaps=gaps), " at some instant")
    if dead is not None:
        check_instant(structure, dead)
        links = marker.points(dead["eccentricity"].values)[pairs]
        look = {"color": Colour.TEXT, "lw": 1.0, "ls": ":", "zorder": 6, "label": "dead load"}
        axes.plot(*_join_segments(links).T, gid="dead load", **look)


def _lay_out_below(structures: Sequence[Structure]) -> tuple[Figure, Sequence[Axes]]:
    """Return panels for structures, one below the other, on axes that they share."""
    wide, high = style.structure_figure(structures[0]).get_size_inches()
    # a panel among others needs less height than a figure of its own
    figure = style.new_figure(wide, max(0.78 * len(structures), 1.0) * high)
    panels = figure.subplots(len(structures), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, structure in zip(panels, structures, strict=True):
        style.structure_axes(structure, axes).label_outer()
    return figure, panels


def _explain_panels(figure: Figure, joints: Mapping[str, xr.Dataset]) -> None:
    """Add one legend for the marks of all panels, and a note on the joints that are assessed."""
    if any(axes.get_legend_handles_labels()[0] for axes in figure.axes):
        style.add_legend_below(figure)
    notes = {label: describe_assessed_joints(each) for label, each in joints.items()}
    style.add_note(figure, notes)


def title_at_instant(name: str, joints: xr.Dataset | None) -> str:
    """Return a name, with the time of the joints if they have one."""
    if joints is None or "time" not in joints.coords:
        return name
    return f"{name}, t = {float(joints['time']):.3f} s"


def block_colours(structure: Structure) -> list[str]:
    """Return the fill colour of each block."""
    colours = {"support": Colour.SUPPORT, "soil": Colour.SOIL, "stone": Colour.STONE}
    return [colours[kind] for kind in positions.block_kinds(structure)]


def draw_blocks(axes: Axes, structure: Structure) -> None:
    """Draw the undeformed blocks, supports darker, soil paler."""
    outlines = [block.drawn() for block in structure.blocks]
    style.add_polygons(axes, outlines, block_colours(structure), gid="blocks")


class DisplacedBlocks:
    """Blocks of a model on axes, over their undeformed outlines."""

    def __init__(self, axes: Axes, model: Model, magnification: float = 1.0) -> None:
        cells, self._edges = model.cells, model.cells.outline_edges
        colours = np.array(block_colours(model.structure))[cells.owner]
        # soil is drawn first, below the stones
        order = np.argsort(colours != Colour.SOIL, kind="stable")
        self._polygons = [np.asarray(cells.polygons[k]) for k in order]
        # cells are outlined in their own colour, which covers the seams between them
        look = {"facecolors": colours[order], "edgecolors": "face", "linewidths": 0.3}
        self._cells = PolyCollection([], zorder=1, gid="blocks", **look)
        self._rims = LineCollection([], colors=Colour.EDGE, linewidths=0.7, zorder=2)
        look = {"colors": Colour.UNDEFORMED, "linewidths": 0.6}
        undeformed = LineCollection(cells.places[self._edges], zorder=0, **look)
        for drawing in (undeformed, self._cells, self._rims):
            axes.add_collection(drawing)
        style.add_polygons(axes, support_outlines(model, magnification), Colour.SUPPORT)

    def move(self, places: Array) -> None:
        """Move the points of the cells to places (m, 2) [m]."""
        self._cells.set_verts([places[polygon] for polygon in self._polygons])
        self._rims.set_segments(places[self._edges])


def draw_thrust(axes: Axes, marks: Marks) -> None:
    """Draw the thrust lines, and the points at which thrust crosses joints."""
    look: dict[str, Any] = {"color": Colour.THRUST, "zorder": 5, "ms": 2.2, "lw": 1.3}
    # where blocks have many joints, as in a wall, there are points alone
    label = "thrust at a joint"
    if len(marks.links):
        halo, label = {"path_effects": style.white_halo(2.6)}, "_points"
        axes.plot(*_join_segments(marks.links).T, label="thrust line", gid="links", **look, **halo)
    if np.isfinite(marks.thrust).any():
        axes.plot(*marks.thrust.T, "o", label=label, gid="thrust", **look)


def draw_marks(axes: Axes, marks: Marks, when: str = "") -> None:
    """Draw thrust line, hinges, sliding and open joints; only those that occur have a label."""
    draw_thrust(axes, marks)
    look: dict[str, Any]
    if len(marks.hinges):
        look = {"mfc": Colour.HINGE, "mec": "white", "mew": 0.9, "ms": 5, "zorder": 7}
        axes.plot(*marks.hinges.T, "o", label=f"hinge{when}", gid="hinges", **look)
    if len(marks.slips):
        look = {"edge": "white", "width": 0.4, "zorder": 6, "gid": "slips"}
        style.add_polygons(axes, list(marks.slips), Colour.SLIDING, **look)
        look = {"marker": style.glyph_marker(), "ms": 13.6, "mew": 0.5, "color": Colour.SLIDING}
        axes.plot([], [], ls="", label="sliding joint", **look)
    if len(marks.gaps):
        edge = [withStroke(linewidth=3.8, foreground=Colour.EDGE)]
        look = {"color": "white", "lw": 2.4, "path_effects": edge, "zorder": 4, "gid": "gaps"}
        gaps = _join_segments(marks.gaps)
        axes.plot(*gaps.T, label=f"open joint{when}", solid_capstyle="butt", **look)


def _join_segments(segments: Array) -> Array:
    """Join segments (n, 2, 2) to one line that is interrupted after each (3 n, 2)."""
    return np.insert(segments, 2, np.nan, axis=1).reshape(-1, 2)


def list_numbers(structure: Structure) -> list[str]:
    """Name a stone by its joints, unless it is drawn with its name, and list numbered joints."""
    shown = [joint for joint, own in zip(structure.joints, structure.judged, strict=True) if own]
    sides = [(first, last) for first, last in pairwise(shown) if first.blocks[1] == last.blocks[0]]
    texts = [
        f"{structure.blocks[last.blocks[0]].name} is between {first.name} and {last.name}"
        for first, last in sides[len(sides) // 2 :][: not find_named_stones(structure)]
    ]
    for part in dict.fromkeys(joint.part for joint in shown):
        names = [style.short_name(joint.name, part) for joint in shown if joint.part == part]
        if max(map(len, names), default=0) > MAX_NAME_LETTERS:
            listed = ", ".join(f"{k} {name}" for k, name in enumerate(names))
            texts.append(f"{part or 'joints'}: {listed}")
    return texts


def find_assessed_walls(structure: Structure) -> set[str]:
    """Return the assessed parts that are walls in bond."""
    joints = zip(structure.joints, structure.heads, structure.judged, strict=True)
    kinds = [(joint.part, head, own) for joint, head, own in joints]
    return {part for part, head, _ in kinds if head} & {part for part, _, own in kinds if own}


def find_named_stones(structure: Structure) -> list[int]:
    """Return the stones with room for their names: of stones in bond, if most have it."""
    scale, stones, found = style.drawing_scale(structure), list_stones(structure), list[int]()
    for number in stones if structure.heads.any() else ():
        wide, high = scale * np.ptp(structure.blocks[number].outline, axis=0)
        letters = len(structure.blocks[number].name)
        if style.text_width(letters, Size.NOTE) < wide and high > Size.NOTE / 72.0:
            found.append(number)
    return found if len(found) > 0.5 * len(stones) else []


@validate_arguments
def draw_names(structure: Structure) -> Figure:
    """Draw the blocks, with the short names of joints beside their intrados.

    Joints of rings and piers are named, or all joints of a structure that has neither; where they
    are too near to one another on a page, every second or third; long names are numbered. The name
    of a ring stands above it, or in its opening below a deck, that of another part below: "5" in
    "main arch" is "main arch, joint 5". The stones of a wall in bond are numbered instead, as in
    `structure.blocks`, by "#5" where joints of other parts have numbers.

    Args:
        structure: the structure.

    Returns:
        The figure.
    """
    axes = style.structure_axes(structure)
    draw_blocks(axes, structure)
    shown = [joint for joint, own in zip(structure.joints, structure.judged, strict=True) if own]
    inch = 1.0 / style.drawing_scale(structure)  # [m]
    low, high = style.outline_bounds(structure)
    # names beside and below the blocks need at least 0.4 inch
    axes.margins(*np.maximum([0.1, 0.15], 0.4 * inch / (high - low)))
    axes.figure.set_figheight(axes.figure.get_figheight() + 0.4)
    axes.autoscale_view()
    for joint in shown:
        axes.plot(*joint.ends.T, color=Colour.SLIDING, lw=1.0, zorder=4)
    parts = dict.fromkeys(joint.part for joint in shown)
    walls, named = find_assessed_walls(structure), find_named_stones(structure)
    numbered = bool(walls) and not named
    sign = "#" * (not walls.issuperset(parts))  # beside numbers of joints
    for part in parts:
        if part in walls and numbered:
            _number_stones(axes, structure, part, inch, sign)
        elif part not in walls:
            top = max(block.points[:, 1].max() for block in structure.blocks)
            _name_part(axes, [joint for joint in shown if joint.part == part], inch, float(top))
    example, of = shown[len(shown) // 2].name, "stones, and of " * bool(named)
    title = f"{structure.name}: names of {of}joints, such as '{example}'"
    if numbered:
        stones = [k for k in structure.free if structure.blocks[k].part in walls]
        number = stones[len(stones) // 2]
        stone = structure.blocks[number].name
        title = f"{structure.name}: numbers of stones; {sign}{number} is '{stone}'"
    style.set_title(axes, title)
    numbers = [] if numbered else list_numbers(structure)
    note = "; ".join(filter(None, [structure.assessment, *numbers]))
    style.add_note(figure := cast(Figure, axes.figure), {"": note})
    if not structure.heads.any():
        figure.draw_without_rendering()
        _keep_apart(sorted(axes.texts, key=lambda text: text.get_text() not in parts))
    for k in named:
        style.write_name(axes, structure.blocks[k].name, structure.centroids[k])
    return figure


def draw_dimensions(axes: Axes, structure: Structure) -> None:
    """Draw length and height of what can move."""
    outlines = np.concatenate([structure.blocks[number].outline for number in structure.free])
    (left, bottom), (right, top) = outlines.min(axis=0), outlines.max(axis=0)
    away = 0.06 * max(right - left, top - bottom)
    look: dict[str, Any] = {"arrowstyle": "<->", "color": Colour.TEXT, "lw": 0.7, "shrinkA": 0}
    look["shrinkB"] = 0
    text: dict[str, Any] = {"fontsize": Size.NOTE, "ha": "center", "va": "center"}
    text["bbox"] = {"fc": "white", "ec": "none", "pad": 1.0}
    for one, other, turn in (
        ((left, top + away), (right, top + away), 0.0),
        ((right + away, bottom), (right + away, top), 90.0),
    ):
        axes.annotate("", one, other, arrowprops=look)
        (x, y), size = 0.5 * np.add(one, other), max(np.subtract(other, one))
        axes.text(x, y, f"{size:.3g} m", rotation=turn, **text)


def _keep_apart(texts: Sequence[Text]) -> None:
    """Remove texts that would be written over earlier ones."""
    kept = list[Any]()
    for text in texts:
        if any(map((box := text.get_window_extent()).overlaps, kept)):
            text.remove()
        else:
            kept.append(box)


def _number_stones(axes: Axes, structure: Structure, part: str, inch: float, sign: str) -> None:
    """Write the numbers of a wall's stones, as many as fit in legible type."""
    numbers = [k for k in structure.free if structure.blocks[k].part == part]
    boxes = np.array([np.ptp(structure.blocks[k].outline, axis=0) for k in numbers])
    # figures, without descenders, take 0.8 of the height, and 0.7 of their size with the space
    sizes = np.minimum(0.8 * boxes[:, 1], boxes[:, 0] / (0.7 * len(f"{sign}{numbers[-1]}")))
    room = (points := 72.0 * sizes / inch) >= Size.NOTE
    if room.mean() > 0.5:  # smaller stones, as at a slope, have no number
        numbers, points = np.array(numbers)[room].tolist(), points[room]
    fitting = float(points.min())
    every = max(1, int(np.ceil(Size.NOTE / fitting)))
    for number in numbers[::every]:
        style.write_name(axes, f"{sign}{number}", structure.centroids[number])


def _name_part(axes: Axes, joints: Sequence[Joint], inch: float, top: float) -> None:
    """Write the names of a part and of its joints, as many as fit in legible type below a top."""
    faces, outward = (np.array([(j.ends[0], -j.tangent) for j in joints])).swapaxes(0, 1)
    names = [style.short_name(joint.name, joint.part) for joint in joints]
    if max(map(len, names)) > MAX_NAME_LETTERS:  # they would be written over each other
        names = [str(k) for k in range(len(names))]

    def are_apart(every: int, size: float) -> bool:
        """Return whether every so many names are apart: upright ones in an opening are nearer."""
        offsets = [style.reach_name(*each, size) for each in zip(names, outward, strict=True)]
        wide = 0.32 * size * np.array([*map(len, names)])[::every]
        gaps = np.abs(np.diff((72.0 / inch * faces + offsets)[::every], axis=0))
        beside = (gaps[:, 0] > wide[1:] + wide[:-1] + 1.0) | (gaps[:, 1] > 1.2 * size)
        return bool(np.all(beside & (0.65 * np.hypot(*gaps.T) > size)))

    tried = [(n, size) for n in range(1, len(names) + 1) for size in (Size.LABEL, Size.NOTE)]
    every, size = next(one for one in tried if are_apart(*one))
    for name, face, way in list(zip(names, faces, outward, strict=True))[::every]:
        note = style.write_name(axes, name, face, way, size)
        note.set_gid("at")
        x, y = note.xyann
        note.xyann = x, y + 0.5 * size * (name == "base")  # above the line of the ground
    if not joints[0].name.startswith(f"{joints[0].part}, "):
        return
    is_ring = joints[0].role == "ring"
    corners = np.array([joint.ends for joint in joints]).reshape(-1, 2)
    above = is_ring and corners[:, 1].max() > top - 1e-6  # a deck would strike the name through
    place = corners[:, 0].mean(), corners[:, 1].max() if above else corners[:, 1].min()
    way = 0.0, 1.0 if above else -1.8
    part = style.write_name(axes, joints[0].part, place, way, Size.LABEL)
    part.set_gid("at" if is_ring else "beside")  # within an opening nothing else is struck


@validate_arguments
def draw_displaced(
    model: Model,
    q: Equilibrium | Array,
    *,
    joints: xr.Dataset | None = None,
    criteria: Criteria | None = None,
    magnification: float = 1.0,
    axes: Axes | None = None,
) -> Figure:
    """Draw the displaced blocks over the undeformed ones, with the marks at their joints.

    Args:
        model: the model.
        q: an equilibrium, or coordinates (n,).
        joints: at that instant, e.g. `run.joints.sel(time=…)`; by default computed by the model.
        criteria: failure criteria; by default those of `joints`, or else the default ones.
        magnification: magnification of displacements [-]; by default they are true to scale, so
            that those of stiff joints cannot be seen.
        axes: matplotlib axes; by default those of a new figure.

    Returns:
        The figure; that of `axes` if given.

    Raises:
        InvalidInput: q or joints belong to another model.
    """
    model, q = model_and_coordinates(model, q)
    joints = joints_of_state(model, q, joints, criteria)
    structure, cells = model.structure, model.cells
    axes = style.structure_axes(structure, axes)
    places = cells.places + magnification * cells.displacement(q)
    DisplacedBlocks(axes, model, magnification).move(places)
    axes.update_datalim(places)
    shift = magnification * model.observer().joint_ends(q)
    draw_marks(axes, joint_marks(structure, joints, shift=shift))
    style.add_legend(axes)
    style.add_note(cast(Figure, axes.figure), {"": describe_assessed_joints(joints)})
    scale = "" if magnification == 1.0 else f", displacements × {magnification:g}"
    style.set_title(axes, title_at_instant(structure.name, joints) + scale)
    _clip_to_stones(axes, structure, places, cells.block)
    return cast(Figure, axes.figure)


def _clip_to_stones(axes: Axes, structure: Structure, places: Array, block: Array) -> None:
    """Fit axes to a structure and its displaced stones: fill may have fallen out of sight."""
    axes.autoscale_view()
    stones = places[np.isin(block, list_stones(structure))]
    seen, room = np.concatenate([stones, style.outline_bounds(structure)]), 0.1 * structure.size
    (left, low), (right, high) = seen.min(axis=0) - room, seen.max(axis=0) + room
    axes.set_xlim(np.clip(axes.get_xlim(), left, right))
    axes.set_ylim(np.clip(axes.get_ylim(), low, high))


def draw_critical(structure: Structure, run: History, model: Model | None = None) -> Figure:
    """Draw the decisive instant of a run and, where nothing falls, that of largest displacement."""
    joints = run.joints.sel(time=positions.decisive_instant(run), method="nearest")
    if (time := positions.peak_instant(run)) is None:
        return draw_during(structure, run, joints, model)
    low, high = style.outline_bounds(structure)
    # side by side, unless they would be less than half as high as wide
    rows, columns = style.panel_grid(2) if 2.0 * (high - low)[1] > (high - low)[0] else (2, 1)
    with style.limit_width(25.4 * Size.PAGE / columns):
        size = style.structure_figure(structure).get_size_inches()
        figure = style.new_figure(*size)
        figure.set_size_inches(size * [columns, rows])
        first, last = figure.subplots(rows, columns)
        for axes in (first, last):
            style.structure_axes(structure, axes)
    draw_during(structure, run, joints, model, first)
    _draw_peak(last, structure, run, run.joints.sel(time=time, method="nearest"))
    first.get_legend().remove()
    style.add_legend_below(figure)
    return figure


def _draw_peak(axes: Axes, structure: Structure, run: History, joints: xr.Dataset) -> None:
    """Draw the displaced blocks and the marks at the largest displacement of a run."""
    outlines = [block.drawn() for block in structure.blocks]
    block = np.repeat(np.arange(len(outlines)), [len(outline) for outline in outlines])
    places = np.concatenate(outlines)
    moved = positions.peak_displacements(structure, run, places, block)
    stones = np.isin(block, list_own_stones(structure))
    by = round_magnification(float(np.abs(moved[stones]).max()) / structure.size)
    displaced = np.split(places + by * moved, np.flatnonzero(np.diff(block)) + 1)
    style.add_polygons(axes, outlines, "none", edge=Colour.UNDEFORMED, width=0.6, zorder=0)
    style.add_polygons(axes, displaced, block_colours(structure), gid="blocks")
    farthest = dict.fromkeys(find_farthest(run.dataset, structure)[0])
    middles = {name: displaced[structure.block_number(name)].mean(axis=0) for name in farthest}
    # the lower name is below its point and the other above, so that neighbours stay apart
    named = sorted(middles.items(), key=lambda item: float(item[1][1]))
    for (name, middle), side in zip(named, ("top", "bottom"), strict=False):
        style.write_name(axes, name, middle).set_va(side)
    shift = by * positions.peak_joint_ends(structure, run)
    draw_marks(axes, joint_marks(structure, joints, shift=shift))
    scale = "" if by == 1.0 else f", displacements × {by:g}"
    style.set_title(axes, title_at_instant("largest displacement", joints) + scale)
    _clip_to_stones(axes, structure, places + by * moved, block)


def draw_during(
    structure: Structure,
    run: History,
    joints: xr.Dataset,
    model: Model | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Draw an instant of a run, with displaced blocks if the run contains displacements."""
    if model is not None and "q" in run.dataset:
        q = positions.fields_at(run, joints["time"].values[None])[0]
        largest = float(np.abs(model.cells.displacement(q)).max()) / model.structure.size
        magnification = 1.0 if model.large_displacements else round_magnification(largest)
        return draw_displaced(model, q, joints=joints, magnification=magnification, axes=axes)
    return draw_structure(structure, joints, axes=axes)


def draw_loads(
    axes: Axes, structure: Structure, live: Sequence[Action], *, factor: str = "λ ×"
) -> None:
    """Draw live loads as arrows of one length, with unlike sizes beside them and in the legend."""
    length = 0.11 * structure.size
    drawn = [_load_arrow(structure, action, length) for action in live]
    sizes = [size for *_, size in drawn]
    for start, direction, size in drawn:
        tip = start + length * direction
        arrow = {"arrowstyle": "-|>", "color": Colour.LOAD, "lw": 2.2, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tuple(tip), tuple(start), zorder=9, arrowprops=arrow)
        axes.update_datalim([start, tip])
        if len({*sizes}) > 1:  # which arrow is which
            look = {"ha": "right", "va": "center", "rotation": 90, "zorder": 9}
            style.annotate(axes, size, 0.5 * (start + tip), (-3.0, 0.0), **look)
    if sizes:
        named = ", ".join(dict.fromkeys(sizes))
        named = f"({named})" if factor and "," in named else named
        label = " ".join(["live load:", *filter(None, [factor]), named])
        axes.plot([], [], color=Colour.LOAD, lw=2.2, marker=">", ms=5, label=label)
    axes.autoscale_view()


def _load_arrow(structure: Structure, action: Action, length: float) -> tuple[Array, Array, str]:
    """Return the start of a load's arrow (2,) [m], its direction (2,), and its size in words."""
    if isinstance(action, BodyForce):
        acceleration = np.array([action.horizontal, action.vertical])
        share = float(np.linalg.norm(acceleration))
        direction = acceleration / share
        low, high = style.outline_bounds(structure)
        start = np.array([0.5 * (low[0] + high[0]), high[1] + 0.08 * structure.size])
        start[0] -= 0.5 * length * direction[0]
        return start, direction, "weight" if share == 1.0 else f"{share:.3g} weight"
    if isinstance(action, PointLoad):
        force = np.array(action.force)
        size = np.linalg.norm(force)
        direction = force / size
        return action.place(structure)[1] - length * direction, direction, f"{size / 1e3:.3g} kN"
    motion = np.array(action.motion)
    start = np.array(structure.blocks[action.place(structure)].centroid)
    size = np.linalg.norm(motion[:2])
    if not size:
        return start, np.array([0.0, 1.0]), f"rotation of the support by {motion[2]:.3g} rad"
    return start, motion[:2] / size, f"movement of the support by {size:.3g} m"
