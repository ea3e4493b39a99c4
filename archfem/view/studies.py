"""A study in one picture: at which strength of the motions mechanisms begin, case by case."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem.arrays import Array
from archfem.view.style import EDGE, FAINT, INK, LINES, NORMAL, SMALL, WIDE, Page, dress

TICKS = (0.1, 0.2, 0.333, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
"""Factors that are written below the axis, as far as it goes."""

APART = 0.16
"""Distance of one definition from the next, relative to that of the cases."""


EXPLAINED = {
    "any four joints": "any four joints fail",
    "four in a ring": "four of one ring fail",
    "ring and pier": "four of a ring and a pier fail",
    "verified": "blocks can move (verified)",
}
"""What the definitions of a mechanism mean."""


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
        rows = np.arange(len(least)) + APART * (number - 0.5 * (len(tried) - 1))
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
