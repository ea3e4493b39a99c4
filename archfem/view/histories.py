"""Figures of joints over time, and of eccentricities joint by joint.

Time histories of several joints of a run or of one joint in several runs; the envelope of the
eccentricities over runs, and the eccentricities at one instant.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from archfem._typing import Array, Flags
from archfem._validation import validate_arguments
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints import criteria
from archfem.joints.criteria import Criteria, assessed_joints, describe_assessed_joints
from archfem.masonry.structure import Structure
from archfem.view import style
from archfem.view.structure import MAX_NAME_LETTERS
from archfem.view.style import Colour, Size


@validate_arguments
def draw_envelope(
    runs: Mapping[str, History | Sequence[History]],
    *,
    dead: xr.Dataset | Mapping[str, xr.Dataset] | None = None,
    dotted: Collection[str] = (),
    axes: Axes | None = None,
) -> Figure:
    """Draw the least and largest eccentricity of each joint over runs, between the joint's faces.

    Each ring and pier has its own panel, with short names of its joints at the axis; piers of
    structures that differ have the heights of their joints there. A wall in bond has one joint of
    each bed, that of the largest |e|. Crosses above the upper face mark joints that opened at some
    time. Where runs have different criteria, the least |e| of a hinge is shown.

    Args:
        runs: the label of each run, and the run, or runs under several motions, which share a
            colour; runs of different structures share the panels of parts of the same name.
        dead: joints under dead load, drawn dotted; or those of each label, drawn dashed in its
            colour.
        dotted: labels of the runs that are drawn dotted, without shading.
        axes: matplotlib axes, for a single ring or pier; by default those of a new figure.

    Returns:
        The figure, with a panel for each ring and pier; that of `axes` if given.

    Raises:
        InvalidInput: there is no run, or more than there are colours; a label has none; axes were
            given for several parts.
    """
    states = {
        label: [run.joints for run in ([runs] if isinstance(runs, History) else runs)]
        for label, runs in runs.items()
    }
    panels, openings = _make_panels(states, axes), 0
    row_height = 0.05  # of the crosses of a run, in units of e
    for row, (label, several) in enumerate(states.items()):
        colour = Colour.LINES[row]
        # shades of several runs add up where they overlap
        shade = 0.0 if label in dotted else 0.2 / len(runs) / len(several)
        for panel in panels:
            opened = list[float]()
            for number, joints in enumerate(several):
                places, own = panel.select(joints)
                look = style.line_style(row) | {"label": "" if number else label}
                _draw_band(panel.axes, places, own, look, shade=shade)
                opened += places[own["open"].any("time").values].tolist()
            height = np.full(len(opened), 0.56 + row_height * row)
            panel.axes.plot(opened, height, "x", ms=4, color=colour)
            openings += len(opened)
    first = panels[0].axes
    if openings:
        first.plot([], [], "x", ms=4, color=Colour.GREY, label="opened")
    colours = dict(zip(runs, Colour.LINES, strict=False))
    for label, at_rest in ({"": dead} if isinstance(dead, xr.Dataset) else dead or {}).items():
        line: dict[str, Any] = {"ls": "--" if label else ":", "lw": 1.0}
        line["color"] = colours.get(label, Colour.TEXT)
        _draw_state(panels, at_rest, f"dead load {label}".strip(), **line)
    first.set_ylim(-0.56, 0.56 + (row_height * len(runs) if openings else 0.0))
    return _finish_panels(panels, states)


def _draw_state(panels: Sequence["PartPanel"], joints: xr.Dataset, label: str, **look: Any) -> None:
    """Draw the eccentricities of joints at one instant in all panels."""
    for panel in panels:
        places, own = panel.select(joints)
        panel.axes.plot(places, own["eccentricity"].values, label=label, **look)


def draw_envelopes(
    runs: Mapping[str, History | Sequence[History]], dead: xr.Dataset | None
) -> list[Figure]:
    """Draw the envelopes of any number of runs, in as many figures as line styles require."""
    # of about equal numbers: the last run is not alone in a figure
    number = -(-len(runs) // len(Colour.LINES)) or 1
    pairs, count = list(runs.items()), -(-len(runs) // number)
    groups = [dict(pairs[first : first + count]) for first in range(0, len(pairs), count)]
    return [draw_envelope(group, dead=dead) for group in groups]


@validate_arguments
def draw_eccentricity(states: Mapping[str, xr.Dataset], *, dotted: Collection[str] = ()) -> Figure:
    """Draw the eccentricity of each joint at one instant of each of several structures.

    Each ring and pier has its own panel, as in `draw_envelope`.

    Args:
        states: the label of each state, and its joints at one instant, for example dead load.
        dotted: labels of the states that are drawn dotted.

    Returns:
        The figure, with a panel for each ring and pier.

    Raises:
        InvalidInput: there is no state, or more than there are colours, or one has several
            instants.
    """
    several = [label for label, joints in states.items() if joints["N"].dims != ("joint",)]
    if several:
        raise InvalidInput(f"{several} have several instants: give one, e.g. joints.isel(time=-1)")
    listed = {label: [joints] for label, joints in states.items()}
    panels = _make_panels(listed, None)
    for number, (label, joints) in enumerate(states.items()):
        look = style.line_style(number) | ({"ls": ":"} if label in dotted else {})
        _draw_state(panels, joints, label, marker="o", ms=2.2, lw=1.2, **look)
    panels[0].axes.set_ylim(-0.56, 0.56)
    return _finish_panels(panels, listed)


def _draw_band(
    axes: Axes, places: Array, joints: xr.Dataset, look: dict[str, Any], *, shade: float
) -> None:
    """Draw the least and the largest eccentricity of joints, dotted if the band is not shaded."""
    span = criteria.envelope(joints)
    look = {"lw": 1.1, "marker": "o", "ms": 2.2} | look
    if shade > 0.0:
        low, high = span["lowest"], span["highest"]
        axes.fill_between(places, low, high, color=look["color"], alpha=shade, lw=0)
    else:
        look |= {"ls": ":", "ms": 1.6}
    axes.plot(places, span["highest"], **look)
    axes.plot(places, span["lowest"], **look | {"label": ""})


def _draw_faces(axes: Axes, hinge: float) -> None:
    """Draw the faces of a joint at e = ±1/2, and the least |e| of a hinge."""
    for side in (-1.0, 1.0):
        axes.axhspan(side * hinge, side * 0.5, color=Colour.HINGE, alpha=0.12, lw=0)
        axes.axhline(side * 0.5, color=Colour.EDGE, lw=1.2)
        label = f"hinge from |e| = {hinge:.3g}" if side > 0.0 else None
        axes.axhline(side * hinge, color=Colour.HINGE, lw=0.7, ls="--", label=label)
    axes.axhline(0.0, color=Colour.GREY, lw=0.5)


def _joints_of_part(joints: xr.Dataset, part: str) -> xr.Dataset:
    """Return the joints of one part."""
    own = joints["part"].values.astype(str) == part
    return joints if own.all() else joints.isel(joint=own)


@dataclass(frozen=True)
class PartPanel:
    """Axes of one ring or pier, over its joints one by one, or over their heights."""

    axes: Axes
    part: str
    by_height: bool
    is_wall: bool  # in bond, which has a joint of each bed here

    def select(self, joints: xr.Dataset) -> tuple[Array, xr.Dataset]:
        """Return the joints of the part, and their places along the axis (n,).

        A bed of a wall is shown by its joint of the largest |e|: hundreds are unreadable.
        """
        own = _joints_of_part(assessed_joints(joints), self.part)
        if self.is_wall:
            e = abs(own["eccentricity"])
            e = (e.max("time") if "time" in e.dims else e).fillna(0.5)  # of an open joint
            order = np.argsort(-e.values, kind="stable")
            heights = own["height"].values.round(6)
            own = own.isel(joint=order[np.unique(heights[order], return_index=True)[1]])
        places = own["height"].values if self.by_height else np.arange(own.sizes["joint"])
        return places.astype(float), own


def _heights_differ(states: Iterable[xr.Dataset], part: str) -> bool:
    """Return whether a pier has joints at heights that it has not in another state."""
    found = set()
    for joints in states:
        own = _joints_of_part(joints, part)
        # rings have joints of equal heights
        if (own["role"] != "pier").any():
            return False
        if own.sizes["joint"]:
            found.add(tuple(own["height"].values.round(6).tolist()))
    return len(found) > 1


def _is_wall(joints: xr.Dataset, part: str) -> bool:
    """Return whether a part is a wall in bond, whose joints have heights."""
    own = _joints_of_part(joints, part)
    has_coordinates = {criteria.HEAD_COORDINATE, "height"} <= {*own.coords}
    return has_coordinates and bool(own[criteria.HEAD_COORDINATE].any())


def _make_panels(
    states: Mapping[str, Sequence[xr.Dataset]], axes: Axes | None
) -> Sequence[PartPanel]:
    """Return a panel for each ring and pier, the rings first, with the faces of its joints."""
    if not 1 <= len(states) <= len(Colour.LINES):
        raise InvalidInput(f"{len(states)} runs in one picture: give 1 to {len(Colour.LINES)}")
    if empty := [label for label, several in states.items() if not several]:
        raise InvalidInput(f"{empty} have no runs: give one or several each")
    names: dict[str, list[str]] = {}
    roles: dict[str, str] = {}
    every = [joints for several in states.values() for joints in several]
    for joints in every:
        assessed = assessed_joints(joints)
        roles |= criteria.part_roles(assessed)
        for part in criteria.part_roles(assessed):
            own = _joints_of_part(assessed, part)["name"].values.astype(str).tolist()
            names[part] = max(names.get(part, []), own, key=len)
    parts = sorted(names, key=lambda part: roles[part] != "ring")
    if axes is not None and len(parts) > 1:
        raise InvalidInput(f"parts {parts} do not fit one pair of axes: leave axes out")
    walls = {part: all(_is_wall(joints, part) for joints in every) for part in parts}
    sizes = {part: 0 if walls[part] else len(names[part]) for part in parts}
    drawn = _lay_out_panels(sizes) if axes is None else {parts[0]: axes}
    hinge = min(Criteria.of(joints).hinge for joints in every)
    panels = [
        PartPanel(each, part, _heights_differ(every, part), walls[part])
        for part, each in drawn.items()
    ]
    for panel in panels:
        part, own = panel.part, panel.axes
        first = axes is not None or own.get_subplotspec().is_first_col()
        along = "height [m]" if panel.by_height else "joint [-]"
        style.style_axes(own, along, "eccentricity e = M / (N h) [-]" if first else "")
        _draw_faces(own, hinge)
        _label_places(panel, [style.short_name(name, part) for name in names[part]], every[0])
        if len(parts) > 1:
            own.set_title(part, fontsize=Size.LABEL, color=Colour.TEXT)
            if not (panel.by_height or panel.is_wall):
                own.set_xlim(-0.7, sizes[part] - 0.3)
    return panels


def _label_places(panel: PartPanel, names: Sequence[str], joints: xr.Dataset) -> None:
    """Label the axis of a panel that counts joints, by their names or by beds."""
    if panel.by_height:
        return
    if not panel.is_wall:
        _label_joints(panel.axes, names)
        return
    heights = panel.select(joints)[1]["height"].values
    panel.axes.set_xlabel("height of the bed, with its joint of the largest |e| [m]")
    shown = range(0, len(heights), -(-len(heights) // 8))  # as far as there is room
    panel.axes.set_xticks(shown, [f"{heights[k]:.3g}" for k in shown])


def _label_joints(axes: Axes, names: Sequence[str]) -> None:
    """Write the names of joints at 0, 1, …, as far as there is room, or 0, 1, … for long ones."""
    if max(map(len, names), default=0) > MAX_NAME_LETTERS:
        axes.set_xlabel("joint number [-]")
        names = [str(k) for k in range(len(names))]
    labels = {float(k): name for k, name in enumerate(names)}
    # an axis takes a dozen of numbers, and half as many names
    most = 12 if max(map(len, names), default=0) < 3 else max(2, min(6, len(names) // 3))
    axes.xaxis.set_major_locator(MaxNLocator(most, integer=True))
    axes.xaxis.set_major_formatter(lambda place, _: labels.get(round(place, 6), ""))


def _lay_out_panels(
    sizes: Mapping[str, int], *, min_joints: int = 10, joints_per_inch: float = 12.0
) -> dict[str, Axes]:
    """Return empty panels on one figure, as wide as their parts have joints, in rows."""
    rows: list[dict[str, int]] = [{}]
    for part, size in sizes.items():
        width = max(size, min_joints)
        if rows[-1] and sum(rows[-1].values()) + width > joints_per_inch * Size.PAGE:
            rows.append({})
        rows[-1][part] = width
    inches = (Size.COLUMN, 3.4) if len(sizes) == 1 else (Size.PAGE, 0.6 + 2.5 * len(rows))
    figure, panels = style.new_figure(*inches), dict[str, Axes]()
    longest = max(sum(row.values()) for row in rows)
    first: Axes | None = None
    grid = figure.add_gridspec(len(rows), 1)
    for number, row in enumerate(rows):
        # an empty last column: panels of all rows are drawn to one scale
        rest = longest - sum(row.values())
        widths = [*row.values(), *([rest] if rest else [])]
        columns = grid[number].subgridspec(1, len(widths), width_ratios=widths)
        for k, part in enumerate(row):
            panels[part] = figure.add_subplot(columns[k], sharey=first)
            panels[part].tick_params(labelleft=k == 0)
            first = first or panels[part]
    return panels


def _finish_panels(
    panels: Sequence[PartPanel], states: Mapping[str, Sequence[xr.Dataset]]
) -> Figure:
    """Mark quarters of the depth; add one legend for all panels, and a note on their joints."""
    first = panels[0].axes
    first.set_yticks(np.linspace(-0.5, 0.5, 5))
    figure = cast(Figure, first.figure)
    if len(panels) == 1:
        style.add_legend(first)
    else:
        style.add_legend_below(figure, 8)
    notes = {label: describe_assessed_joints(several[0]) for label, several in states.items()}
    style.add_note(figure, notes)
    return figure


@validate_arguments
def draw_joints(run: History, joints: Sequence[str | int] | None = None) -> Figure:
    """Draw eccentricity and mobilised friction of joints over time, below the ground acceleration.

    Friction has the sign of the shear force. Lines are interrupted while a joint is open; limits
    follow from the run's criteria.

    Args:
        run: the history.
        joints: their names or numbers; by default the two that are closest to failure.

    Returns:
        The figure: the ground acceleration, and a row for each joint.

    Raises:
        InvalidInput: there is no such joint.
    """
    joints = most_stressed_joints(run) if joints is None else joints
    if not len(joints):
        raise InvalidInput("no joints to draw: give their names, e.g. ['main arch, joint 5']")
    selected, rows = [run.joint(joint) for joint in joints], 1 + len(joints)
    figure = style.new_figure(Size.COLUMN, 0.9 + 1.15 * rows)
    grid = figure.add_gridspec(rows, 2)
    ground = figure.add_subplot(grid[0, :])
    draw_ground(ground, run.time, run.dataset["ground"].values)
    ground.xaxis.set_major_locator(MaxNLocator(5 if Size.PAGE > 5.0 else 2))
    left_panels = []
    for row, joint in enumerate(selected, start=1):
        left, right = (figure.add_subplot(grid[row, k], sharex=ground) for k in range(2))
        # a line of 20 letters fits beside a panel
        name = "\n".join(wrap(str(joint["name"].values), 20))
        _draw_eccentricity(left, joint, f"{name}\nM / (N h) [-]")
        _draw_friction(right, joint)
        left_panels.append(left)
        for axes in (left, right):
            axes.set_xlabel("time [s]" if row == len(selected) else "", fontsize=Size.LABEL)
            axes.tick_params(labelbottom=row == len(selected))
    figure.align_ylabels([ground, *left_panels])
    style.add_note(figure, {"": describe_assessed_joints(run.joints)})
    return figure


@validate_arguments
def draw_joint(runs: Mapping[str, History], joint: str | int) -> Figure:
    """Draw mobilised friction and eccentricity of one joint over time, a column for each run.

    Friction has the sign of the shear force. Lines are interrupted while the joint is open. Dashed
    lines are the limits by the run's criteria: the friction coefficient, and |e| of a hinge.

    Args:
        runs: the label of each run, and the run.
        joint: its name or number.

    Returns:
        The figure, with a column for each run.

    Raises:
        InvalidInput: a run has no such joint.
    """
    figure = style.new_figure(Size.PAGE, 3.4)
    panels = figure.subplots(2, len(runs), sharex=True, sharey="row", squeeze=False)
    for column, (label, run) in zip(panels.T, runs.items(), strict=True):
        own = run.joint(joint)
        _draw_friction(column[0], own)
        _draw_eccentricity(column[1], own, "eccentricity M / (N h) [-]")
        column[1].set_xlabel("time [s]", fontsize=Size.LABEL)
        style.set_title(column[0], f"{label}: {own['name'].values!s}")
        for axes in column:
            axes.set_xlim(run.time[0], run.time[-1])
            axes.label_outer()
    notes = {label: describe_assessed_joints(run.joints) for label, run in runs.items()}
    style.add_note(figure, notes)
    return figure


def draw_ground(
    axes: Axes, times: Array, ground: Array, *, size: float = Size.LABEL, width: float = 0.6
) -> None:
    """Draw the ground acceleration (n, 2) over time, in a font size and a line width [points]."""
    style.style_axes(axes, "", "ground [m/s²]", size)
    axes.plot(times, ground[:, 0], color=Colour.TEXT, lw=width, label="horizontal", zorder=3)
    if ground[:, 1].any():
        axes.plot(times, ground[:, 1], color=Colour.LINES[1], lw=0.85 * width, label="vertical")
        # above the axes' right end: inside it would cover the lines
        look: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.95)}
        axes.legend(ncols=2, frameon=False, fontsize=size, **look)
    axes.set_xlim(times[0], max(times[-1], times[0] + 1e-9))


def _draw_eccentricity(axes: Axes, joint: xr.Dataset, label: str) -> None:
    """Draw the eccentricity of a joint between its faces."""
    style.style_axes(axes, "", label)
    hinge = Criteria.of(joint).hinge
    _draw_faces(axes, hinge)
    # above the panel: inside it would cover the line
    look: dict[str, Any] = {"xycoords": "axes fraction", "color": Colour.HINGE}
    look |= {"ha": "right", "va": "bottom"}
    style.annotate(axes, f"hinge from |e| = {hinge:.3g}", (1.0, 1.0), (-3, 1), **look)
    axes.plot(joint["time"], joint["eccentricity"], color=Colour.LINES[0], lw=0.6)
    axes.set_ylim(-0.56, 0.56)


def _draw_friction(axes: Axes, joint: xr.Dataset) -> None:
    """Draw mobilised friction with the sign of the shear force, between its limits."""
    style.style_axes(axes, "", "V / N [-]")
    own = Criteria.of(joint)
    limit = float(own.coefficients(joint["friction_limit"].values))
    ratio = np.sign(joint["V"].values) * joint["friction"].values
    if np.isfinite(limit):  # else the joint cannot slide
        # cohesion raises the limits above the coefficient
        limits = np.nan_to_num(criteria.sliding_limits(joint, own), nan=limit)
        _draw_friction_limits(axes, joint["time"].values, ratio, limits)
        look: dict[str, Any] = {"va": "bottom", "xycoords": ("axes fraction", "data")}
        look |= {"ha": "right", "color": Colour.SLIDING}
        style.annotate(axes, f"μ = {limit:g}", (1.0, limit), (-3, 1), **look)
    axes.plot(joint["time"], ratio, color=Colour.LINES[0], lw=0.6)


def _draw_friction_limits(axes: Axes, times: Array, ratio: Array, limits: Array) -> None:
    """Draw the ratios V / N at which a joint slides, and marks where V / N is off the axis."""
    largest = float(np.nanmax(np.abs(ratio), initial=0.0))
    # a joint about to open has any V / N: the axis ends at three times the coefficient
    top = float(np.clip(1.08 * largest, 1.5 * limits[0], 3.0 * limits[0]))
    for side in (1.0, -1.0):
        axes.plot(times, side * limits, color=Colour.SLIDING, lw=0.9, ls="--")
        shade = {"color": Colour.SLIDING, "alpha": 0.12, "lw": 0}
        axes.fill_between(times, side * limits, side * top, **shade)
    axes.set_ylim(-top, top)
    if largest > top:
        beyond = np.abs(np.nan_to_num(ratio)) > top
        edge = 0.97 * top * np.sign(ratio[beyond])
        axes.scatter(times[beyond], edge, marker="d", s=6, color=Colour.HINGE, zorder=4)
        look = {"xycoords": "axes fraction", "color": Colour.HINGE}
        text = f"◆ beyond, up to {largest:.3g}"
        style.annotate(axes, text, (0.0, 0.0), (3, 2), fontsize=Size.LABEL - 1.0, **look)


def _mirror_images(structure: Structure | None, numbers: Array, first: int) -> Flags:
    """Return which of the numbered joints are the mirror image of one of them (n,)."""
    if structure is None:
        return np.zeros(len(numbers), dtype=bool)
    middles, ends = structure.middles[numbers], structure.ends[..., 0]
    image = np.array([ends.min() + ends.max() - middles[first, 0], middles[first, 1]])
    # tolerance relative to the size of the structure
    return np.linalg.norm(middles - image, axis=1) < 1e-6 * structure.size


def most_stressed_joints(run: History) -> list[int]:
    """Return two joints closest to failure: one by its eccentricity, one by its friction."""
    # the second slides for the longest time, or is closest to sliding; a mirror image of the first
    # behaves as that does, and is left out
    own = assessed_joints(run.joints)
    numbers = own["joint"].values
    e = abs(own["eccentricity"]).max("time").fillna(0.5).values
    first = int(np.argmax(e))
    use = (own["friction"] / own["friction_limit"]).max("time").fillna(0.0).values
    steps = criteria.step_lengths(run.time)[:, None]
    slid = (own["slide"].transpose("time", "joint").values * steps).sum(0)
    order = np.lexsort([-e, -np.where(np.isfinite(use), use, 0.0), -np.round(slid, 9)])
    twin = _mirror_images(run.structure, numbers, first)
    others = [k for k in order if k != first and not twin[k]] or [k for k in order if k != first]
    return [int(numbers[k]) for k in (first, *others[:1])]
