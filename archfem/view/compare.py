"""Two or more structures side by side: at one instant, and at one joint over time."""

from collections.abc import Mapping
from typing import Any, cast

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem.criteria import Criteria
from archfem.history import History
from archfem.structure import Structure
from archfem.view.envelopes import draw_faces
from archfem.view.plots import draw_structure
from archfem.view.style import HINGE as RED
from archfem.view.style import INK, LINES, NORMAL, SMALL, WIDE, canvas, dress

SNUG = 0.78
"""Height of a picture among others, relative to one by itself."""


def draw_instants(states: Mapping[str, tuple[Structure, xr.Dataset | None]]) -> Figure:
    """Draw several structures, one below the other, with thrust lines and failed joints.

    Args:
        states: what to call each, the structure, and its joints at one instant or None.
    """
    wide, high = canvas(next(iter(states.values()))[0]).get_size_inches()
    figure = Figure(figsize=(wide, SNUG * high * len(states)), layout="constrained")
    panels = figure.subplots(len(states), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    marks: dict[str, Any] = {}
    for axes, (label, (structure, joints)) in zip(panels, states.items(), strict=True):
        draw_structure(structure, joints, axes=axes)
        if joints is not None and "time" in joints.coords:
            label = f"{label}, t = {float(joints['time']):.3f} s"
        axes.set_title(label, fontsize=NORMAL, color=INK)
        axes.label_outer()
        handles, words = axes.get_legend_handles_labels()
        marks |= dict(zip(words, handles, strict=True))
        if axes.get_legend() is not None:
            axes.get_legend().remove()
    if marks:
        figure.legend(
            handles=list(marks.values()), labels=list(marks), loc="outside lower center", ncols=4,
            frameon=False, fontsize=SMALL,
        )  # fmt: skip
    return figure


def draw_joint(runs: Mapping[str, History], joint: str | int) -> Figure:
    """Draw mobilised friction and eccentricity of one joint over time, a column for each run.

    Red lines are the limits by the run's criteria: the coefficient of friction, and |e| of a hinge.
    Lines are interrupted while the joint is open.

    Args:
        runs: what to call each run, and the run.
        joint: its name, or its number.

    Raises:
        InvalidInput: a run has no such joint.
    """
    figure = Figure(figsize=(0.8 * WIDE, 4.2), layout="constrained")
    panels = figure.subplots(2, len(runs), sharex=True, sharey="row", squeeze=False)
    for column, (label, run) in zip(panels.T, runs.items(), strict=True):
        own = run.joint(joint)
        _friction(cast(Axes, column[0]), own)
        dress(column[1], "time [s]", "eccentricity M / (N h) [-]")
        draw_faces(column[1], run.criteria.hinge)
        column[1].plot(own["time"], own["eccentricity"], color=LINES[0], lw=0.6)
        column[1].set_ylim(-0.56, 0.56)
        column[0].set_title(f"{label}: {own['name'].values!s}", fontsize=NORMAL, color=INK)
        for axes in column:
            axes.set_xlim(run.time[0], run.time[-1])
            axes.label_outer()
    return figure


def _friction(axes: Axes, joint: xr.Dataset) -> None:
    """Draw the mobilised friction with its sense, between its limits."""
    dress(axes, "", "V / N [-]")
    limit = float(Criteria.of(joint).coefficients(joint["friction_limit"].values))
    for side in (-1.0, 1.0):
        axes.axhline(side * limit, color=RED, lw=0.8, ls="--")
    axes.plot(
        joint["time"], joint["V"] / joint["N"].where(joint["N"] > 0.0), color=LINES[0], lw=0.6
    )
    axes.set_ylim(-1.5 * limit, 1.5 * limit)
    axes.annotate(
        f"μ = {limit:g}", (1.0, limit), xycoords=("axes fraction", "data"), fontsize=SMALL,
        ha="right", va="bottom", color=RED,
    )  # fmt: skip
