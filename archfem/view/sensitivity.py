"""What a finding hangs on, in pictures: tornado diagram and convergence."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from archfem.arrays import Array
from archfem.view.style import COLUMN, EDGE, FAINT, LINES, SMALL, Page, dress


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
