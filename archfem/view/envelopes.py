"""Eccentricity of the joints, part by part: its envelope over runs, or its value at one instant."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, envelope, judged, roles_of
from archfem.view.names import short_name
from archfem.view.style import (
    COLUMN,
    EDGE,
    FAINT,
    HINGE,
    INK,
    LINES,
    SMALL,
    WIDE,
    Page,
    dress,
    entitle,
    legend,
)

ROW, ROOM = 80, 8
"""Joints that fit side by side in a wide picture, and those for which a panel has room at least."""

LABEL = "eccentricity e = M / (N h) [-]"

SHADE = 0.15
"""Of the band between the least and the largest eccentricity of one run alone."""

STEP = 0.05
"""Distance of the crosses of one run from those of the next, above the upper face."""


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
    """Draw the least and the largest eccentricity of joints, one after another from 0.

    Args:
        axes: where to draw.
        joints: over time and joint.
        label: of the lines.
        colour: of the lines, and of the band between them.
        shade: of the band, 0 to 1; without a band the lines are dotted.
    """
    span, number = envelope(joints), np.arange(joints.sizes["joint"])
    style: dict[str, Any] = {"color": colour, "lw": 1.3, "marker": "o", "ms": 2.8}
    if shade > 0.0:
        axes.fill_between(number, span["lowest"], span["highest"], color=colour, alpha=shade, lw=0)
    else:
        style |= {"ls": ":", "ms": 2.0}
    axes.plot(number, span["highest"], **style, label=label)
    axes.plot(number, span["lowest"], **style)


def draw_faces(axes: Axes, hinge: float) -> None:
    """Draw the faces of the joints, and where a joint counts as hinged.

    Args:
        axes: where to draw, eccentricity upwards.
        hinge: |e| from which it does [-].
    """
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
        own = judged(joints)
        roles |= roles_of(own)
        for part in roles_of(own):
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
        if rows[-1] and sum(rows[-1].values()) + max(size, ROOM) > ROW:
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
