"""Speed against error in one picture."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem.dynamics.tradeoff import Accuracy, Trial
from archfem.view.style import EDGE, FAINT, LINES, SMALL, Page, dress
from archfem.view.style import HINGE as RED

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
    floor = max(found.doubt / 10.0, 1e-7)
    for trial in found.trials:
        if np.isfinite(trial.error):
            _mark(axes, trial, floor)
    reached = [trial for trial in found.front if np.isfinite(trial.error)]
    front = np.array([(trial.seconds, max(trial.error, floor)) for trial in reached])
    axes.step(*front.T, where="post", color=EDGE, lw=1.1, zorder=2, label="Pareto front")
    axes.axhline(found.tolerance, color=RED, lw=0.9, ls="--", label="tolerance")
    axes.axhline(max(found.doubt, floor), color=FAINT, lw=0.9, ls=":", label="doubt of reference")
    if found.chosen is not None:
        chosen = found.chosen
        place = (chosen.seconds, max(chosen.error, floor))
        axes.plot(*place, "o", ms=15, mfc="none", mec=RED, mew=1.4, zorder=6, label="chosen")
        axes.annotate(
            chosen.setting.label, place, xytext=(10, -14), textcoords="offset points", fontsize=8
        )
    _legend(axes, found)
    return figure


def _mark(axes: Axes, trial: Trial, floor: float) -> None:
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
