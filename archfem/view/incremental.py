"""Incremental dynamic analysis and fragility in pictures."""

from collections.abc import Iterable, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem.arrays import Array
from archfem.view.style import COLUMN, EDGE, FAINT, GHOST, LINES, SMALL, Page, dress

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
