"""Structures on paper: one at an instant, or several side by side.

Which joint is which: names of joints in pictures, and a picture of nothing else.

A structure where its blocks have gone, with its thrust line there.

Live loads, drawn as arrows with their sizes.
"""

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.joints.criteria import Criteria, with_failure_flags
from archfem.joints.resultants import check_instant
from archfem.masonry.loads import BodyForce, PointLoad, Settlement
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Joint, Structure
from archfem.models.model import Model
from archfem.statics.equilibrium import Equilibrium
from archfem.view.joint_marks import (
    Marks,
    drawn,
    joint_marks,
    joints_at,
    round_magnification,
    support_outlines,
)
from archfem.view.positions import fields_at
from archfem.view.style import (
    EDGE,
    GHOST,
    HINGE,
    INK,
    LOAD,
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
    scale_of,
    stand,
)


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
        draw_marks(axes, joint_marks(structure, with_failure_flags(joints, criteria)))
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
    # height of a picture among others, relative to one by itself
    figure = Page(figsize=(wide, 0.78 * high * len(states)), layout="constrained")
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
    """Return the name of the structure, and the time where there is one."""
    if joints is None or "time" not in joints.coords:
        return structure.name
    return f"{structure.name}, t = {float(joints['time']):.3f} s"


def draw_blocks(axes: Axes, structure: Structure) -> None:
    """Draw blocks where they are, supports darker, soil paler."""
    soil = find_yielding_blocks(structure)
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


def draw_marks(axes: Axes, marks: Marks) -> None:
    """Draw thrust line, hinges, slips and gaps; what does not occur has no label."""
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


# A point of type [inch]
POINT = 1.0 / 72.0

# Size of type, relative to the distance of two names
TIGHT = 0.65


# Beside and below the blocks, for names, relative to the size of the structure
ROOM = 0.1, 0.15


# Space between the name of a joint and its end, relative to the size of its type
APART = 0.5


def short_name(name: str, part: str) -> str:
    """Return what tells a joint from others of its part: "5" of "main arch, joint 5"."""
    own = name.removeprefix(f"{part}, ")
    return own.removeprefix("joint ") or own


def draw_names(structure: Structure) -> Figure:
    """Draw the blocks, with the short name of each joint beside its intrados.

    Joints of rings and piers have one, or all where there are neither; what comes before, the
    name of the part, stands in its midst. "5" in "main arch" is "main arch, joint 5".

    Args:
        structure: whose joints are named.

    Returns:
        The page.
    """
    page = canvas(structure)
    axes = page.add_subplot()
    stand(axes, structure)
    draw_blocks(axes, structure)
    shown = [joint for joint, own in zip(structure.joints, structure.judged, strict=True) if own]
    inch = 1.0 / scale_of(structure)
    wide = float(np.ptp(np.concatenate([block.drawn()[:, 0] for block in structure.blocks])))
    # room beside the blocks at least [inch]
    axes.margins(max(ROOM[0], 0.4 * inch / wide), ROOM[1])
    axes.autoscale_view()
    for joint in shown:
        axes.plot(*joint.ends.T, color=SLIP, lw=1.0, zorder=4)
    for part in dict.fromkeys(joint.part for joint in shown):
        _name_part(axes, [joint for joint in shown if joint.part == part], inch)
    example = shown[len(shown) // 2].name
    title = f"{structure.name}: names of joints, such as '{example}'"
    entitle(axes, title)
    return page


def _name_part(axes: Axes, joints: Sequence[Joint], inch: float) -> None:
    """Name the joints of a part, each in line with itself, in type for which there is room."""
    ends = np.array([joint.ends[0] for joint in joints])
    apart = np.linalg.norm(np.diff(ends, axis=0), axis=1).min() if len(ends) > 1 else np.inf
    # smallest size of type that can be read on paper [points]
    size = float(np.clip(TIGHT * apart / (inch * POINT), 4.5, SMALL))
    for joint in joints:
        x, y = -joint.tangent
        angle = float(np.degrees(np.arctan2(y, x)))
        # angle from which a name would stand on its head [°]; upright ones are read from the right
        leftward = abs(angle) > 91.0
        style = {"rotation": angle - 180.0 * leftward, "rotation_mode": "anchor"}
        style |= {"ha": "right" if leftward else "left", "va": "center_baseline"}
        words, away = short_name(joint.name, joint.part), (APART * size * x, APART * size * y)
        _write(axes, words, joint.ends[0], away, fontsize=size, **style)
    if not joints[0].name.startswith(f"{joints[0].part}, "):
        return
    place, where = ends.mean(axis=0), "center"
    if joints[0].role != "ring":
        place, where = min((joint.middle for joint in joints), key=lambda middle: middle[1]), "top"
    below = (0.0, -1.4 * SMALL)
    _write(axes, joints[0].part, place, below, fontsize=SMALL, ha="center", va=where)


def _write(axes: Axes, words: str, place: Array, away: tuple[float, float], **style: Any) -> None:
    """Write words near a place, away from it by so many points."""
    axes.annotate(
        words, tuple(place), away, textcoords="offset points", color=INK, zorder=8,
        path_effects=[withStroke(linewidth=1.6, foreground="white")], **style,
    )  # fmt: skip


def draw_displaced(
    model: Model,
    q: Equilibrium | Array,
    *,
    joints: xr.Dataset | None = None,
    criteria: Criteria | None = None,
    magnification: float = 1.0,
    axes: Axes | None = None,
) -> Figure:
    """Draw the blocks where they are, over where they stood, and their joints there.

    Args:
        model: what stands.
        q: an equilibrium, or coordinates (n,).
        joints: at that instant, e.g. `run.joints.sel(time=…)`; by default as the model has them.
        criteria: what makes a joint fail; by default those of `joints`, or else the usual ones.
        magnification: of displacements [-]; by default they are true to scale, and those of stiff
            joints next to nothing.
        axes: where to draw; by default a new figure.

    Returns:
        The page; that of `axes` where given.

    Raises:
        InvalidInput: q or joints are another model's.
    """
    model, q = drawn(model, q)
    joints = joints_at(model, q, joints, criteria)
    structure, cells = model.structure, model.cells
    axes = canvas(structure).add_subplot() if axes is None else axes
    stand(axes, structure)
    places = cells.places + magnification * cells.displacement(q)
    still = LineCollection(
        list(cells.places[cells.outline_edges]), colors=GHOST, linewidths=0.6, zorder=0
    )
    faces = [places[np.asarray(cell)] for cell in cells.polygons]
    stones = PolyCollection(faces, facecolors=STONE, edgecolors=STONE, linewidths=0.3, zorder=1)
    rims = LineCollection(list(places[cells.outline_edges]), colors=EDGE, linewidths=0.7, zorder=2)
    supports = PolyCollection(
        support_outlines(model, magnification),
        facecolors=SUPPORT,
        edgecolors=EDGE,
        linewidths=0.7,
        zorder=1,
    )
    stones.set_gid("blocks")
    for drawing in (still, stones, rims, supports):
        axes.add_collection(drawing)
    draw_marks(
        axes, joint_marks(structure, joints, shift=magnification * model.observer().joint_ends(q))
    )
    legend(axes)
    scale = "" if magnification == 1.0 else f", displacements × {magnification:g}"
    entitle(axes, title_of(structure, joints) + scale)
    axes.autoscale_view()
    return cast(Figure, axes.figure)


def draw_during(model: Model, run: History, joints: xr.Dataset) -> Figure:
    """Draw an instant of a run: where displacements were kept, blocks where they have gone.

    They are magnified by a round number that shows them well, unless they may be large.
    """
    if "q" in run.dataset:
        q = fields_at(run, joints["time"].values[None])[0]
        most = float(np.abs(model.cells.displacement(q)).max())
        by = 1.0 if model.large_displacements else round_magnification(most / model.structure.size)
        return draw_displaced(model, q, joints=joints, magnification=by)
    return draw_structure(model.structure, joints)


# Length of an arrow, and its distance from the structure, relative to the structure's size
REACH, AWAY = 0.11, 0.04

Action = BodyForce | PointLoad | Settlement


def draw_loads(
    axes: Axes, structure: Structure, live: Sequence[Action], *, of: str = "λ ×"
) -> None:
    """Draw live loads: where they act, which way, and how large they are.

    A load in proportion to the weights is one arrow beside the structure, at its height; a force
    stands on the extrados; a movement of a support begins at it.
    """
    for number, action in enumerate(live):
        start, way, words = _arrow(structure, action)
        tip = start + REACH * structure.size * way
        axes.annotate(
            "", tuple(tip), tuple(start), zorder=9,
            arrowprops={"arrowstyle": "-|>", "color": LOAD, "lw": 2.2, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
        room = [start, tip, start + np.array([0.0, AWAY * structure.size])]
        axes.update_datalim(np.array(room))
        if not number:
            axes.plot([], [], color=LOAD, lw=2.2, marker=">", ms=5, label="live load")
        away = (0, 5) if way[1] < 0.5 or abs(way[0]) > 0.5 else (6, 0)
        where = start if way[1] < -0.5 else 0.5 * (start + tip)
        axes.annotate(
            f"{of} {words}".strip(), tuple(where), away, textcoords="offset points", ha="center",
            va="bottom", fontsize=SMALL, color=LOAD, zorder=9,
        )  # fmt: skip
    axes.autoscale_view()


def _arrow(structure: Structure, action: Action) -> tuple[Array, Array, str]:
    """Where an arrow begins (2,) [m], its direction (2,), and what stands beside it."""
    if isinstance(action, BodyForce):
        size = np.array([action.horizontal, action.vertical])
        way = size / np.linalg.norm(size)
        points = np.concatenate([block.drawn() for block in structure.blocks])
        low, high = points.min(axis=0), points.max(axis=0)
        start = np.array([0.5 * (low[0] + high[0]), high[1] + 2.0 * AWAY * structure.size])
        start -= 0.5 * REACH * structure.size * way * [1.0, 0.0]
        share = float(np.linalg.norm(size))
        return start, way, "weight" if share == 1.0 else f"{share:.3g} weight"
    if isinstance(action, PointLoad):
        force = np.array(action.force)
        way = force / np.linalg.norm(force)
        place = action.place(structure)[1]
        return place - REACH * structure.size * way, way, f"{np.linalg.norm(force) / 1e3:.3g} kN"
    motion = np.array(action.motion)
    block = structure.blocks[action.place(structure)]
    start = np.array(block.centroid)
    if not motion[:2].any():
        return start, np.array([0.0, 1.0]), f"turn of the support by {motion[2]:.3g} rad"
    way = motion[:2] / np.linalg.norm(motion[:2])
    return start, way, f"movement of the support by {np.linalg.norm(motion[:2]):.3g} m"
