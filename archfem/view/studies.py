"""A study in one picture: at which strength of the motions mechanisms begin, case by case."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem.arrays import Array
from archfem.view.style import EDGE, FAINT, LINES, SMALL, WIDE, dress

TICKS = (0.1, 0.2, 0.333, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
"""Factors that are written below the axis, as far as it goes."""

APART = 0.16
"""Distance of one definition from the next, relative to that of the cases."""


def draw_study(factors: Mapping[str, Mapping[str, Array]], reduction: float = 1.0) -> Figure:
    """Draw the factors on the motions at which mechanisms begin, a row for each case.

    A mark is the median over the pairs, its line their range; an arrow goes beyond what was tried.

    Args:
        factors: by name of the case and definition of a mechanism, the least that fails under each
            pair (pairs,) [-]; infinite where none does.
        reduction: R, drawn as a line at 1 / R beside that of the whole motions, unless it is 1.

    Returns:
        The page.
    """
    names, definitions = list(factors), list(next(iter(factors.values())))
    figure = Figure(figsize=(0.75 * WIDE, 1.1 + 0.42 * len(names)), layout="constrained")
    axes = figure.add_subplot()
    dress(axes, "factor on the motions at the first mechanism [-]")
    tried = {d: np.array([each[d] for each in factors.values()]) for d in definitions}
    finite = np.concatenate([each[np.isfinite(each)] for each in tried.values()])
    end = 1.3 * max(finite.max(initial=1.0), 1.0)
    _spread(axes, tried, end)
    _levels(axes, {1.0 / reduction: f"R = {reduction:g}", 1.0: "whole"})
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xscale("log")
    ticks = [tick for tick in TICKS if tick < end]
    axes.set_xticks(ticks, [f"{tick:.3g}" for tick in ticks])
    axes.set_xlim(0.85 * min(finite.min(initial=1.0), 1.0 / reduction), 1.06 * end)
    axes.minorticks_off()
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=SMALL)
    return figure


def _spread(axes: Axes, tried: Mapping[str, Array], end: float) -> None:
    """Draw median and range of the factors (cases, pairs) by definition; arrows at the end."""
    for number, (definition, least) in enumerate(tried.items()):
        rows = np.arange(len(least)) + APART * (number - 0.5 * (len(tried) - 1))
        low, middle, high = np.quantile(least, [0.0, 0.5, 1.0], axis=1, method="nearest")
        axes.hlines(rows, np.minimum(low, end), np.minimum(high, end), color=LINES[number], lw=1.4)
        inside = np.isfinite(middle)
        axes.plot(middle[inside], rows[inside], "o", color=LINES[number], ms=5, label=definition)
        axes.plot(np.full((~inside).sum(), end), rows[~inside], ">", color=LINES[number], ms=5)


def _levels(axes: Axes, levels: Mapping[float, str]) -> None:
    """Draw lines at factors that have a name."""
    for factor, words in levels.items():
        axes.axvline(factor, color=FAINT, lw=0.9, ls="--", zorder=0)
        axes.annotate(
            words, (factor, 1.0), xycoords=("data", "axes fraction"), fontsize=SMALL, color=EDGE,
            ha="center", va="bottom", xytext=(0, 2), textcoords="offset points",
        )  # fmt: skip
