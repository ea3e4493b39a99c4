"""A study in one picture: at which strength of the motions mechanisms begin, case by case.

Incremental dynamic analysis and fragility in pictures.

What a finding hangs on, in pictures: tornado diagram and convergence.

Speed against error in one picture.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem._typing import Array
from archfem.dynamics.accuracy import Accuracy, SettingResult
from archfem.view.style import (
    COLUMN,
    EDGE,
    FAINT,
    GHOST,
    INK,
    LINES,
    NORMAL,
    SMALL,
    WIDE,
    Page,
    dress,
)
from archfem.view.style import HINGE as RED

# Factors that are written below the axis, as far as it goes
TICKS = (0.1, 0.2, 0.333, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)


# What the definitions of a mechanism mean
EXPLAINED = {
    "any joints at once": "any four joints fail",
    "one part at once": "four of one ring fail",
    "ring and pier at once": "four of a ring and a pier fail",
    "verified": "blocks can move (verified)",
}


def draw_study(
    factors: Mapping[str, Mapping[str, Array]], reduction: float = 1.0, title: str = ""
) -> Figure:
    """Draw the factors on the motions at which mechanisms begin, a row for each case.

    A mark is the median over the pairs, its line their range; an arrow goes beyond what was tried.
    A definition by which nothing fails in any case, such as that of a ring and a pier where there
    are no piers, is left out.

    Args:
        factors: by name of the case and definition of a mechanism, the least that fails under each
            pair (pairs,) [-]; infinite where none does.
        reduction: R, drawn as a line at 1 / R beside that of the whole motions, unless it is 1.
        title: of the page.

    Returns:
        The page.
    """
    names = list(factors)
    definitions = [
        each
        for each in next(iter(factors.values()))
        if any(np.isfinite(own[each]).any() for own in factors.values())
    ]
    figure = Page(figsize=(0.75 * WIDE, 1.6 + 0.42 * len(names)), layout="constrained")
    axes = figure.add_subplot()
    dress(axes, "factor on the motions at the first mechanism [-]")
    tried = {d: np.array([each[d] for each in factors.values()]) for d in definitions}
    finite = np.concatenate([[1.0], *(each[np.isfinite(each)] for each in tried.values())])
    end = 1.3 * max(finite.max(initial=1.0), 1.0)
    _spread(axes, tried, end)
    _levels(axes, {1.0 / reduction: f"1 / R, R = {reduction:g}", 1.0: "whole motions"})
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xscale("log")
    ticks = [tick for tick in TICKS if tick < end]
    axes.set_xticks(ticks, [f"{tick:.3g}" for tick in ticks])
    axes.set_xlim(0.85 * min(finite.min(initial=1.0), 1.0 / reduction), 1.06 * end)
    axes.minorticks_off()
    axes.plot([], [], "o-", color=FAINT, ms=5, lw=1.4, label="median, and range of the pairs")
    if any(~np.isfinite(each).all() for each in tried.values()):
        axes.plot([], [], ">", color=FAINT, ms=5, label="more than was tried")
    if title:
        figure.suptitle(title, fontsize=NORMAL, color=INK, wrap=True)
    head = {"title": "first mechanism: the first instant in which …", "title_fontsize": SMALL}
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=SMALL, **head)
    return figure


def _spread(axes: Axes, tried: Mapping[str, Array], end: float) -> None:
    """Draw median and range of the factors (cases, pairs) by definition; arrows at the end."""
    for number, (definition, least) in enumerate(tried.items()):
        # distance of one definition from the next, relative to that of the cases
        rows = np.arange(len(least)) + 0.16 * (number - 0.5 * (len(tried) - 1))
        low, middle, high = np.quantile(least, [0.0, 0.5, 1.0], axis=1, method="nearest")
        axes.hlines(rows, np.minimum(low, end), np.minimum(high, end), color=LINES[number], lw=1.4)
        inside = np.isfinite(middle)
        words = EXPLAINED.get(definition, definition)
        axes.plot([], [], "o", color=LINES[number], ms=5, label=words)
        axes.plot(middle[inside], rows[inside], "o", color=LINES[number], ms=5)
        axes.plot(np.full((~inside).sum(), end), rows[~inside], ">", color=LINES[number], ms=5)


def _levels(axes: Axes, levels: Mapping[float, str]) -> None:
    """Draw lines at factors that have a name."""
    for factor, words in levels.items():
        axes.axvline(factor, color=FAINT, lw=0.9, ls="--", zorder=0)
        axes.annotate(
            words, (factor, 1.0), xycoords=("data", "axes fraction"), fontsize=SMALL, color=EDGE,
            ha="center", va="bottom", xytext=(0, 2), textcoords="offset points",
        )  # fmt: skip


SHARES = ("16 %", "50 %", "84 %")


def draw_ida(
    curves: Iterable[tuple[str, Array, Array]],
    capacities: Mapping[str, tuple[Array, Array]],
    *,
    fractiles: tuple[Array, Array] | None = None,
    measure: str = "peak ground acceleration [m/s²]",
    demand: str = "largest rotation of a joint [rad]",
) -> Figure:
    """Draw the curves of motions as they are, their fractiles, and where limit states are met.

    A curve that turns back is drawn so: response need not grow with the motion. One that ends in an
    arrow goes on to a run that broke off.

    Args:
        curves: name, intensities and demands of each motion, as by `Ida.curves`.
        capacities: by limit state the ends of the bracket of each motion, as by `Ida.capacities`.
        fractiles: intensities (n,) and the demands of the 16, 50 and 84 % fractiles (3, n).
        measure: of the axis.
        demand: likewise.

    Returns:
        The page: curves to the left, limit states to the right, on one axis of intensity.
    """
    figure = Page(figsize=(1.35 * COLUMN, 0.75 * COLUMN), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.2, 1.0))
    dress(left, demand, measure)
    dress(right)
    end = 0.0
    for number, (_, intensity, found) in enumerate(curves):
        known = np.isfinite(found)
        x, y = np.append(0.0, found[known]), np.append(0.0, intensity[known])
        end = max(end, x.max())
        left.plot(x, y, color=FAINT, lw=0.8, marker=".", ms=3, label=None if number else "motions")
        if not known.all() and known.any():
            left.annotate(
                "", (1.06 * x[-1] + 1e-12, y[-1]), (x[-1], y[-1]),
                arrowprops={"arrowstyle": "->", "color": FAINT, "lw": 0.8},
            )  # fmt: skip
    if fractiles is not None:
        for name, values, style in zip(SHARES, fractiles[1], (":", "-", "--"), strict=True):
            drawn = np.isfinite(values)
            left.plot(values[drawn], fractiles[0][drawn], style, color=LINES[0], lw=1.8, label=name)
    left.set_xlim(0.0, 1.1 * end or 1.0)
    left.set_ylim(bottom=0.0)
    left.legend(frameon=False, fontsize=SMALL, loc="lower right")
    _draw_capacities(right, capacities)
    return figure


def _draw_capacities(axes: Axes, capacities: Mapping[str, tuple[Array, Array]]) -> None:
    """Draw the bracket of each motion, the median, and a triangle where nothing was met."""
    for place, (low, high) in enumerate(capacities.values()):
        spread = place + np.linspace(-0.25, 0.25, len(low))
        met = np.isfinite(high)
        colour = LINES[place % len(LINES)]
        axes.vlines(spread[met], low[met], high[met], color=colour, lw=2.0)
        axes.plot(spread[~met], low[~met], "^", color=colour, ms=4)
        if met.sum() > len(met) / 2:
            middle = float(np.quantile(np.sqrt(low * high), 0.5, method="nearest"))
            axes.hlines(middle, place - 0.35, place + 0.35, color=EDGE, lw=1.2)
    axes.set_xticks(range(len(capacities)), list(capacities), rotation=25, ha="right")
    axes.set_xlim(-0.6, len(capacities) - 0.4)
    axes.grid(axis="y", color=GHOST, lw=0.5)


def draw_fragility(
    curves: Mapping[str, tuple[Array, Array, Array]],
    intensity: Array,
    *,
    data: Mapping[str, tuple[Array, Array]] | None = None,
    measure: str = "peak ground acceleration [m/s²]",
) -> Figure:
    """Draw fragility curves with their bands, and the data that they were fitted to.

    Args:
        curves: by limit state the probability, and the lower and upper end of its band (n,) [-].
        intensity: where they are drawn (n,).
        data: by limit state intensities and shares that failed, drawn as marks.
        measure: of the axis.

    Returns:
        The page.
    """
    figure = Page(figsize=(COLUMN, 0.7 * COLUMN), layout="constrained")
    axes = figure.add_subplot()
    dress(axes, measure, "probability of the limit state [-]")
    for (name, (middle, low, high)), colour in zip(curves.items(), LINES, strict=False):
        axes.fill_between(intensity, low, high, color=colour, alpha=0.15, lw=0.0)
        axes.plot(intensity, middle, color=colour, lw=1.8, label=name)
        if data is not None and name in data:
            axes.plot(*data[name], "o", color=colour, ms=3.5, mfc="white")
    axes.set_xlim(0.0, float(intensity.max()))
    axes.set_ylim(0.0, 1.0)
    axes.legend(frameon=False, fontsize=SMALL, loc="lower right")
    return figure


def draw_tornado(
    ranges: Mapping[str, tuple[float, float]], usual: float, quantity: str = "finding"
) -> Figure:
    """Draw by how much a finding changes as each of several things goes from low to high.

    Args:
        ranges: by what changes, the finding at its low and at its high end.
        usual: the finding where nothing changes.
        quantity: its name and unit.

    Returns:
        The page, what matters most at the top.
    """
    order = sorted(ranges, key=lambda name: float(np.ptp([*ranges[name], usual])))
    figure = Page(figsize=(COLUMN, 0.9 + 0.42 * len(order)), layout="constrained")
    axes = figure.add_subplot()
    dress(axes, quantity)
    for row, name in enumerate(order):
        ends = zip(ranges[name], LINES, ("low", "high"), strict=False)
        for value, colour, words in sorted(ends, key=lambda end: -abs(end[0] - usual)):
            label = None if row else words  # where both ends lie on one side, the nearer is on top
            axes.barh(row, value - usual, left=usual, height=0.62, color=colour, label=label)
    axes.axvline(usual, color=EDGE, lw=1.0)
    axes.set_yticks(range(len(order)), order)
    axes.margins(x=0.08)
    figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=SMALL)
    return figure


def draw_convergence(
    paths: Mapping[str, tuple[Array, Array, float, float]], quantity: str = "finding"
) -> Figure:
    """Draw a finding over sizes of cells and steps, with its limit and its error bar.

    Args:
        paths: by what is refined, sizes relative to the finest (n,), values (n,), the limit at size
            zero, and the error bar of the finest.
        quantity: its name and unit.

    Returns:
        The page, a panel for each.
    """
    wide = 0.25 * COLUMN + 0.55 * COLUMN * len(paths)
    figure = Page(figsize=(wide, 0.55 * COLUMN), layout="constrained")
    panels = figure.subplots(1, len(paths), sharey=True, squeeze=False)[0]
    for axes, (name, (sizes, values, limit, error)) in zip(panels, paths.items(), strict=True):
        dress(axes, f"{name}: size over the finest [-]", quantity if axes is panels[0] else "")
        axes.plot(sizes, values, "o-", color=LINES[0], lw=1.4, ms=5)
        axes.errorbar(sizes[-1:], values[-1:], [error], color=LINES[1], capsize=4, lw=1.6)
        axes.plot([0.0], [limit], "D", color=LINES[2], ms=6, label="limit", clip_on=False)
        axes.plot([0.0, sizes[-1]], [limit, values[-1]], ":", color=FAINT)
        axes.set_xlim(0.0, 1.08 * float(np.max(sizes)))
        axes.set_xticks(sizes, [f"{size:.3g}" for size in sizes])
    panels[0].legend(frameon=False, fontsize=SMALL)
    return figure


MARKERS = {"rigid": "o", "faces": "s", "condensed": "D", "full": "^"}
RULES = ("nodal", "lobatto", "gauss", "exact")


def draw_accuracy(found: Accuracy) -> Figure:
    """Draw error over time of all settings, doubly logarithmic, with the Pareto front marked.

    The shape of a mark is the rung, its colour the quadrature. The tolerance and the doubt of
    the reference are lines; the chosen setting is ringed.

    Args:
        found: settings tried.

    Returns:
        The page.
    """
    figure = Page(figsize=(7.2, 5.0), layout="constrained")
    axes = figure.add_subplot()
    dress(axes, "time to step through the motion [s]", "error in the largest |e| of a joint [-]")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.tick_params(which="both", labelsize=SMALL)
    floor = max(found.reference_error / 10.0, 1e-7)
    for trial in found.trials:
        if np.isfinite(trial.error):
            _mark(axes, trial, floor)
    reached = [trial for trial in found.front if np.isfinite(trial.error)]
    front = np.array([(trial.seconds, max(trial.error, floor)) for trial in reached])
    axes.step(*front.T, where="post", color=EDGE, lw=1.1, zorder=2, label="Pareto front")
    axes.axhline(found.tolerance, color=RED, lw=0.9, ls="--", label="tolerance")
    axes.axhline(
        max(found.reference_error, floor), color=FAINT, lw=0.9, ls=":", label="doubt of reference"
    )
    if found.choice is not None:
        chosen = found.choice
        place = (chosen.seconds, max(chosen.error, floor))
        axes.plot(*place, "o", ms=15, mfc="none", mec=RED, mew=1.4, zorder=6, label="chosen")
        axes.annotate(
            chosen.setting.label, place, xytext=(10, -14), textcoords="offset points", fontsize=8
        )
    _legend(axes, found)
    return figure


def _mark(axes: Axes, trial: SettingResult, floor: float) -> None:
    """One setting; those on a mixed ladder are stars."""
    asked = trial.setting.discretisation
    marker = MARKERS.get(asked.name, "*")
    colour = LINES[RULES.index(asked.quadrature) % len(LINES)]
    axes.plot(
        trial.seconds,
        max(trial.error, floor),
        marker,
        ms=6,
        mfc=colour,
        mec="white",
        mew=0.5,
        zorder=4,
    )


def _legend(axes: Axes, found: Accuracy) -> None:
    """Shapes for rungs, colours for quadratures."""
    rungs = {trial.setting.discretisation.name for trial in found.trials}
    rules = {trial.setting.discretisation.quadrature for trial in found.trials}
    for rung, marker in MARKERS.items():
        if rung in rungs:
            axes.plot([], [], marker, color=EDGE, ms=6, label=rung)
    for number, rule in enumerate(RULES):
        if rule in rules:
            axes.plot([], [], "o", color=LINES[number % len(LINES)], ms=6, label=rule)
    axes.legend(fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
