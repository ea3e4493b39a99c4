"""Joints over time: several of one run, or one of several runs.

Eccentricity of the joints, part by part: its envelope over runs, or its value at one instant.
"""

from collections.abc import Collection, Mapping, Sequence
from textwrap import wrap
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import (
    Criteria,
    assessed_joints,
    envelope,
    part_roles,
    sliding_limits,
    step_lengths,
)
from archfem.masonry.structure import Structure
from archfem.view.structure import short_name
from archfem.view.style import (
    COLUMN,
    EDGE,
    FAINT,
    HINGE,
    INK,
    LINES,
    SLIP,
    SMALL,
    WIDE,
    Page,
    dress,
    entitle,
    legend,
)

# Joints that fit side by side in a wide picture, and those for which a panel has room at least
ROOM = 8

LABEL = "eccentricity e = M / (N h) [-]"

# Of the band between the least and the largest eccentricity of one run alone
SHADE = 0.15

# Distance of the crosses of one run from those of the next, above the upper face
STEP = 0.05


def draw_envelope(
    runs: Mapping[str, History],
    *,
    dead: xr.Dataset | None = None,
    dotted: Collection[str] = (),
    axes: Axes | None = None,
) -> Figure:
    """Draw the least and largest eccentricity of each joint over runs, against the faces.

    Each ring and pier has a panel of its own, with short names of its joints below. Crosses above
    the upper face mark joints that came apart at some time. Where runs have different criteria, the
    least |e| of a hinge is shown.

    Args:
        runs: what to call each run, and the run; those of different structures share the panels
            of parts of one name.
        dead: joints under dead load, drawn dotted.
        dotted: names of the runs that are drawn dotted and not filled.
        axes: where to draw, for a single ring or pier; by default a new figure.

    Returns:
        The page, with a panel for each ring and pier; that of `axes` where given.

    Raises:
        InvalidInput: there is no run, or too many to tell apart; axes were given for several
            parts.
    """
    drawn = {label: run.joints for label, run in runs.items()}
    shown, apart = _panels(drawn, axes), 0
    for row, ((label, joints), colour) in enumerate(zip(drawn.items(), LINES, strict=False)):
        for part, panel in shown.items():
            own = _of_part(joints, part)
            draw_band(panel, own, label, colour, shade=SHADE * (label not in dotted) / len(runs))
            crosses = np.flatnonzero(own["open"].any("time").values)
            height = np.full(len(crosses), 0.56 + STEP * row)
            panel.plot(crosses, height, "x", ms=4, color=colour)
            apart += len(crosses)
    first = next(iter(shown.values()))
    if apart:
        first.plot([], [], "x", ms=4, color=FAINT, label="came apart")
    if dead is not None:
        for part, panel in shown.items():
            at_rest = _of_part(dead, part)["eccentricity"]
            panel.plot(at_rest.values, ":", color=INK, lw=1.4, label="dead load")
    first.set_ylim(-0.56, 0.56 + (STEP * len(runs) if apart else 0.0))
    return _explained(shown)


def draw_eccentricity(states: Mapping[str, xr.Dataset], *, dotted: Collection[str] = ()) -> Figure:
    """Draw the eccentricity of each joint at one instant of each of several structures.

    Each ring and pier has a panel of its own, as by `draw_envelope`.

    Args:
        states: what to call each state, and its joints at one instant, for example dead load.
        dotted: names of the states that are drawn dotted.

    Returns:
        The page, with a panel for each ring and pier.

    Raises:
        InvalidInput: there is no state, or too many to tell apart, or one has several instants.
    """
    several = [label for label, joints in states.items() if joints["N"].dims != ("joint",)]
    if several:
        raise InvalidInput(f"{several} have several instants: give one, e.g. joints.isel(time=-1)")
    shown = _panels(states, None)
    for (label, joints), colour in zip(states.items(), LINES, strict=False):
        line = ":" if label in dotted else "-"
        style: dict[str, Any] = {"color": colour, "lw": 1.4, "marker": "o", "ms": 2.8}
        for part, panel in shown.items():
            values = _of_part(joints, part)["eccentricity"].values
            panel.plot(values, ls=line, label=label, **style)
    first = next(iter(shown.values()))
    first.set_ylim(-0.56, 0.56)
    return _explained(shown)


def draw_band(
    axes: Axes, joints: xr.Dataset, label: str, colour: str, *, shade: float = SHADE
) -> None:
    """Draw the least and the largest eccentricity of joints, one after another from 0."""
    span, number = envelope(joints), np.arange(joints.sizes["joint"])
    style: dict[str, Any] = {"color": colour, "lw": 1.3, "marker": "o", "ms": 2.8}
    if shade > 0.0:
        axes.fill_between(number, span["lowest"], span["highest"], color=colour, alpha=shade, lw=0)
    else:
        style |= {"ls": ":", "ms": 2.0}
    axes.plot(number, span["highest"], **style, label=label)
    axes.plot(number, span["lowest"], **style)


def draw_faces(axes: Axes, hinge: float) -> None:
    """Draw the faces of the joints, and where a joint counts as hinged."""
    for side in (-1.0, 1.0):
        axes.axhspan(side * hinge, side * 0.5, color=HINGE, alpha=0.12, lw=0)
        axes.axhline(side * 0.5, color=EDGE, lw=1.2)
        axes.axhline(side * hinge, color=HINGE, lw=0.7, ls="--")
    axes.axhline(0.0, color=FAINT, lw=0.5)


def _of_part(joints: xr.Dataset, part: str) -> xr.Dataset:
    """The joints of one part."""
    return joints.isel(joint=np.flatnonzero(joints["part"].values.astype(str) == part))


def _panels(drawn: Mapping[str, xr.Dataset], axes: Axes | None) -> dict[str, Axes]:
    """A panel for each ring and pier, the rings first, with the faces of its joints."""
    if not 1 <= len(drawn) <= len(LINES):
        raise InvalidInput(f"{len(drawn)} runs in one picture: give 1 to {len(LINES)}")
    names: dict[str, list[str]] = {}
    roles: dict[str, str] = {}
    for joints in drawn.values():
        own = assessed_joints(joints)
        roles |= part_roles(own)
        for part in part_roles(own):
            found = _of_part(own, part)["name"].values.astype(str).tolist()
            names[part] = max(names.get(part, []), found, key=len)
    sizes = {part: len(own) for part, own in names.items()}
    parts = sorted(sizes, key=lambda part: roles[part] != "ring")
    if axes is None:
        shown = _page({part: sizes[part] for part in parts})
    elif len(parts) == 1:
        shown = {parts[0]: axes}
        axes.set_ylabel(LABEL)
    else:
        raise InvalidInput(f"parts {parts} do not fit one pair of axes: leave axes out")
    hinge = min(Criteria.of(joints).hinge for joints in drawn.values())
    for part, panel in shown.items():
        dress(panel, "joint [-]", panel.get_ylabel())
        draw_faces(panel, hinge)
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        panel.xaxis.set_major_formatter(_named([short_name(each, part) for each in names[part]]))
        if len(parts) > 1:
            entitle(panel, part)
            panel.set_xlim(-0.7, sizes[part] - 0.3)
    return shown


def _named(names: Sequence[str]) -> FuncFormatter:
    """Write names at whole numbers, and nothing beyond them."""

    def name(place: float, _: object) -> str:
        number = round(place)
        return names[number] if 0 <= number < len(names) else ""

    return FuncFormatter(name)


def _page(sizes: Mapping[str, int]) -> dict[str, Axes]:
    """Empty panels on one page, as wide as their parts have joints, in as many rows as needed."""
    rows: list[dict[str, int]] = [{}]
    for part, size in sizes.items():
        # joints that fit side by side in a wide picture, and those for which a panel has room at
        # least
        if rows[-1] and sum(rows[-1].values()) + max(size, ROOM) > 80:
            rows.append({})
        rows[-1][part] = max(size, ROOM)
    inches = (COLUMN, 3.4) if len(sizes) == 1 else (WIDE, 0.6 + 2.8 * len(rows))
    page, found = Page(figsize=inches, layout="constrained"), {}
    longest = max(sum(row.values()) for row in rows)
    first: Axes | None = None
    whole = page.add_gridspec(len(rows), 1)
    for number, row in enumerate(rows):
        rest = longest - sum(row.values())
        widths = [*row.values(), *([rest] if rest else [])]
        columns = whole[number].subgridspec(1, len(widths), width_ratios=widths)
        for k, part in enumerate(row):
            panel = page.add_subplot(columns[k], sharey=first)
            panel.tick_params(labelleft=k == 0)
            if k == 0:
                panel.set_ylabel(LABEL)
            first = first or panel
            found[part] = panel
    return found


def _explained(shown: Mapping[str, Axes]) -> Figure:
    """Mark quarters of the depth, and explain the lines of all panels once."""
    first = next(iter(shown.values()))
    first.set_yticks(np.linspace(-0.5, 0.5, 5))
    page = cast(Figure, first.figure)
    if len(shown) == 1:
        legend(first)
    else:
        page.legend(
            *first.get_legend_handles_labels(),
            loc="outside lower center",
            ncols=2 + len(LINES),
            frameon=False,
            fontsize=SMALL,
        )
    return page


def draw_joints(run: History, joints: Sequence[str | int] | None = None) -> Figure:
    """Draw eccentricity and mobilised friction of joints over time, below the ground's motion.

    Friction has the sense of the shear force. Lines are interrupted while a joint is open; limits
    are by the run's criteria.

    Args:
        run: what happened.
        joints: their names, or their numbers; by default the two that tell most.

    Returns:
        The page: the ground's motion, and a row for each joint.

    Raises:
        InvalidInput: there is no such joint.
    """
    joints = telling_joints(run) if joints is None else joints
    if not len(joints):
        raise InvalidInput("no joints to draw: give their names, e.g. ['main arch, joint 5']")
    chosen, rows = [run.joint(joint) for joint in joints], 1 + len(joints)
    figure = Page(figsize=(COLUMN, 0.9 + 1.15 * rows), layout="constrained")
    grid = figure.add_gridspec(rows, 2)
    ground = figure.add_subplot(grid[0, :])
    _ground(ground, run)
    ground.xaxis.set_major_locator(MaxNLocator(5))
    panels = []
    for row, own in enumerate(chosen, start=1):
        left, right = (figure.add_subplot(grid[row, k], sharex=ground) for k in range(2))
        criteria = Criteria.of(own)
        # that fit beside a panel
        name = "\n".join(wrap(str(own["name"].values), 20))
        dress(left, "", f"{name}\nM / (N h) [-]")
        _eccentricity(left, own, criteria)
        _friction(right, own, criteria)
        panels.append((left, right))
    for axes in panels[-1]:
        axes.set_xlabel("time [s]", fontsize=SMALL)
    for axes in (each for row in panels[:-1] for each in row):
        axes.tick_params(labelbottom=False)
    figure.align_ylabels([ground, *(left for left, _ in panels)])
    return figure


def draw_joint(runs: Mapping[str, History], joint: str | int) -> Figure:
    """Draw mobilised friction and eccentricity of one joint over time, a column for each run.

    Friction has the sense of the shear force. Lines are interrupted while the joint is open; dashed
    ones are the limits by the run's criteria: the coefficient of friction, and |e| of a hinge.

    Args:
        runs: what to call each run, and the run.
        joint: its name, or its number.

    Returns:
        The page, with a column for each run.

    Raises:
        InvalidInput: a run has no such joint.
    """
    figure = Page(figsize=(0.8 * WIDE, 4.2), layout="constrained")
    panels = figure.subplots(2, len(runs), sharex=True, sharey="row", squeeze=False)
    for column, (label, run) in zip(panels.T, runs.items(), strict=True):
        own = run.joint(joint)
        criteria = Criteria.of(own)
        _friction(column[0], own, criteria)
        dress(column[1], "time [s]", "eccentricity M / (N h) [-]")
        _eccentricity(column[1], own, criteria)
        entitle(column[0], f"{label}: {own['name'].values!s}")
        for axes in column:
            axes.set_xlim(run.time[0], run.time[-1])
            axes.label_outer()
    return figure


def _ground(axes: Axes, run: History) -> None:
    """Draw the acceleration of the ground."""
    dress(axes, "", "ground [m/s²]")
    time, ground = run.time, run.dataset["ground"].values
    axes.plot(time, ground[:, 0], color=INK, lw=0.6, label="horizontal")
    if ground[:, 1].any():
        axes.plot(time, ground[:, 1], color=LINES[4], lw=0.5, alpha=0.9, label="vertical")
        axes.legend(
            frameon=False, fontsize=SMALL, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 0.96)
        )
    axes.set_xlim(time[0], time[-1])


def _eccentricity(axes: Axes, joint: xr.Dataset, criteria: Criteria) -> None:
    """Draw where the thrust crosses a joint, against its faces."""
    draw_faces(axes, criteria.hinge)
    axes.plot(joint["time"], joint["eccentricity"], color=LINES[0], lw=0.6)
    axes.set_ylim(-0.56, 0.56)


def _friction(axes: Axes, joint: xr.Dataset, criteria: Criteria) -> None:
    """Draw mobilised friction with the sense of the shear force, between its limits."""
    dress(axes, "", "V / N [-]")
    limit = float(criteria.coefficients(joint["friction_limit"].values))
    if np.isfinite(limit):  # else it never slides
        _friction_limits(axes, joint, criteria, limit)
    ratio = np.sign(joint["V"].values) * joint["friction"].values
    axes.plot(joint["time"], ratio, color=LINES[0], lw=0.6)
    most, top = float(np.nanmax(np.abs(ratio), initial=0.0)), axes.get_ylim()[1]
    if np.isfinite(limit) and most > top:
        beyond = np.abs(np.nan_to_num(ratio)) > top
        edge = 0.97 * top * np.sign(ratio[beyond])
        axes.scatter(joint["time"].values[beyond], edge, marker="d", s=6, color=HINGE, zorder=4)
        _note(axes, f"◆ beyond, up to {most:.3g}", (0.0, 0.0), HINGE)


def _twins(structure: Structure | None, numbers: Array, first: int) -> NDArray[np.bool_]:
    """Whether joints of some numbers are mirror images of one of them (n,)."""
    if structure is None:
        return np.zeros(len(numbers), dtype=bool)
    middles, ends = structure.middles[numbers], structure.ends[..., 0]
    image = np.array([ends.min() + ends.max() - middles[first, 0], middles[first, 1]])
    # distance of joints from each other's mirror image that makes them twins, relative to the size
    # of the structure
    return np.linalg.norm(middles - image, axis=1) < 1e-6 * structure.size


def telling_joints(run: History) -> list[int]:
    """Return two joints that tell most of a run: one by where its thrust is, one by its friction.

    The first has the largest |e|, or opens; the second slides for the longest time, or else comes
    nearest to it. It is not the mirror image of the first, which does much the same, where the
    run knows its structure.
    """
    own = assessed_joints(run.joints)
    numbers = own["joint"].values
    tilt = abs(own["eccentricity"]).max("time").fillna(0.5).values
    first = int(np.argmax(tilt))
    use = (own["friction"] / own["friction_limit"]).max("time").fillna(0.0).values
    slid = (own["slide"].transpose("time", "joint").values * step_lengths(run.time)[:, None]).sum(0)
    order = np.lexsort([-tilt, -np.where(np.isfinite(use), use, 0.0), -np.round(slid, 9)])
    twin = _twins(run.structure, numbers, first)
    others = [k for k in order if k != first and not twin[k]] or [k for k in order if k != first]
    return [int(numbers[k]) for k in (first, *others[:1])]


def _friction_limits(axes: Axes, joint: xr.Dataset, criteria: Criteria, limit: float) -> None:
    """Draw the ratios at which a joint slides: μ, and more by cohesion."""
    limits = np.nan_to_num(sliding_limits(joint, criteria), nan=limit)
    most = float(np.nanmax(joint["friction"].values, initial=0.0))
    # mobilised friction at which its axis ends at least and at most, relative to the coefficient: a
    # joint about to open has any value, and what lies beyond is told
    top = float(np.clip(1.08 * most, 1.5 * limits[0], 3.0 * limits[0]))
    for side in (1.0, -1.0):
        axes.plot(joint["time"], side * limits, color=SLIP, lw=0.9, ls="--")
        axes.fill_between(joint["time"], side * limits, side * top, color=SLIP, alpha=0.12, lw=0)
    axes.set_ylim(-top, top)
    axes.annotate(
        f"μ = {limit:g}", (1.0, limit), (-3, 1), xycoords=("axes fraction", "data"),
        textcoords="offset points", fontsize=SMALL, ha="right", va="bottom", color=SLIP,
    )  # fmt: skip


def _note(axes: Axes, words: str, place: tuple[float, float], colour: str) -> None:
    """Write into a corner."""
    axes.annotate(
        words, place, (3, 2), xycoords="axes fraction", textcoords="offset points",
        fontsize=SMALL - 1.0, color=colour, ha="left", va="bottom",
    )  # fmt: skip
