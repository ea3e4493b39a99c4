"""Figures of verdicts: outcomes over uncertain properties, and over the scale of a motion."""

from itertools import islice
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from archfem._typing import Array, Flags
from archfem._validation import validate_arguments
from archfem.dynamics.collapse_state import COLLAPSE_STATES, FALLEN_STATES
from archfem.dynamics.motion_scaling import CollapseScale
from archfem.dynamics.verdict_range import VerdictRange
from archfem.view import style
from archfem.view.style import Colour, Size


@validate_arguments
def draw_verdict_range(verdicts: VerdictRange) -> Figure:
    """Draw the residual displacement over each varied property; falls lie above a line.

    Args:
        verdicts: runs, as by `archfem.verdict_range`.

    Returns:
        The figure, with panels of the properties that explain most, the first most.
    """
    rows, max_panels = verdicts.answers, 6
    falls = verdicts.falls[verdicts.answered]
    residual = 1e3 * rows["residual"].values
    top = 3.0 * float(residual[~falls].max(initial=1.0))
    heights = np.where(falls, 2.0 * top, np.maximum(residual, 1e-3 * top))
    shares = verdicts.importance()
    labels = {
        "k_n": "normal stiffness, factor [-]",
        "k_s": "shear stiffness, factor [-]",
        "friction": "friction, added [-]",
        "damping_ratio": "damping ratio, factor [-]",
        "dt": "time step",
        "sign": "sign of the motion",
        "scale": "scale of the motion [-]",
    }
    shares = dict(islice(shares.items(), max_panels))
    columns = min(3, len(shares), int(Size.PAGE / 1.6))
    lines = -(-len(shares) // columns)
    figure = style.new_figure(Size.PAGE, 0.7 + 1.8 * lines)
    panels = figure.subplots(lines, columns, sharey=True, squeeze=False).ravel()
    for axes in panels[len(shares) :]:
        axes.set_visible(False)
    for axes, (name, share) in zip(panels, shares.items(), strict=False):
        beside = "residual\ndisplacement [mm]" if axes in panels[::columns] else ""
        style.style_axes(axes, labels.get(name, name.replace("_", " ")), beside)
        if name in verdicts.beyond_chance:
            style.set_title(axes, f"explains {share:.0%}")
        _draw_property(axes, verdicts, rows[name].values, heights)
        if falls.any():
            axes.axhline(top, color=Colour.GREY, lw=0.9, ls="--")
        axes.set(yscale="log", ylim=(0.7e-3 * top, 4.0 * top))
    style.add_legend_below(figure, 3)
    shares_of = "; shares are of the variance of the outcome" * bool(verdicts.beyond_chance)
    style.set_figure_title(figure, verdicts.headline + shares_of)
    return figure


def _draw_property(axes: Axes, verdicts: VerdictRange, values: Array, heights: Array) -> None:
    """Draw a dot for each answered run over a property, labels side by side."""
    if values.dtype.kind == "f":
        places = values
        if values.max() > 10.0 * values.min() > 0.0:
            axes.set_xscale("log")
            axes.xaxis.set_minor_formatter(NullFormatter())
            if values.max() < 50.0 * values.min():  # few powers of ten
                axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    else:
        labels, number = np.unique(values, return_inverse=True)
        # runs of one label are spread out, so that equal results remain visible
        spread = np.linspace(-0.3, 0.3, len(values))
        places = number + spread
        words = [str(label).replace(" and ", "\nand ") for label in labels]
        axes.set_xticks(range(len(labels)), words)
        axes.set_xlim(-0.5, len(labels) - 0.5)
    kinds = verdicts.falls, verdicts.dislocated, verdicts.in_doubt
    falls, parted, doubted = (kind[verdicts.answered] for kind in kinds)
    groups: tuple[tuple[Flags, str, Any, dict[str, Any]], ...] = (
        (~(falls | parted), "stands", Colour.LINES[0], {"marker": "o"}),
        (parted, "dislocated", Colour.LINES[1], {"marker": "D"}),
        (falls, "falls, above the dashed line", Colour.HINGE, {"marker": "^"}),
        (doubted, "in doubt under dead load", Colour.GREY, {"marker": "o", "ms": 8, "mfc": "none"}),
    )
    for chosen, label, colour, look in groups:
        if chosen.any():
            look = {"ls": "none", "ms": 4, "alpha": 0.8, "color": colour, **look}
            axes.plot(places[chosen], heights[chosen], label=label, **look)


def draw_scale(found: CollapseScale, limit: float) -> Figure:
    """Draw the residual displacement of each run over its scale, and the limit [m] of dislocation.

    A run with lost blocks is drawn above all others, as the distance to the ground says nothing.
    """
    labels = "scale of the motion [-]", "residual displacement [mm]"
    figure, axes = style.new_axes(Size.COLUMN, 3.0, *labels)
    axes.set(xscale="log", yscale="log")
    made = {**found.longer, **found.searches}
    runs = [(dt, run.scale, run.fall) for dt in made for run in made[dt].runs if run.fall]
    steps = list(dict.fromkeys(dt for dt, *_ in runs))
    held = [fall.residual for *_, fall in runs if fall.kind not in FALLEN_STATES]
    top = 3.0 * max([limit, *held])
    marks = dict(zip(COLLAPSE_STATES, "oD^^", strict=True))
    for dt, scale, fall in runs:
        height = top if fall.kind in FALLEN_STATES else max(fall.residual, 1e-6)
        colour = Colour.LINES[steps.index(dt) % len(Colour.LINES)]
        axes.plot(scale, 1e3 * height, marks[fall.kind], color=colour, ms=4, alpha=0.8)
    for k, dt in enumerate(steps):
        look = {"color": Colour.LINES[k % len(Colour.LINES)], "label": f"{1e3 * dt:g} ms"}
        axes.plot([], [], "s", ms=4, **look)
    for state in [state for state in marks if any(fall.kind == state for *_, fall in runs)]:
        axes.plot([], [], marks[state], color=Colour.GREY, ms=4, label=state)
    axes.axhline(1e3 * limit, color=Colour.GREY, lw=0.9, ls="--", label="limit of dislocation")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter(NullFormatter())
        axis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0, 7.0)))
    style.add_legend_below(figure, 4)
    return figure
