"""Pictures of motions: accelerograms with their integrals, and the spectra of a suite."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem.codes import DesignSpectrum
from archfem.errors import InvalidInput
from archfem.motion import Motion
from archfem.spectra import response_spectrum
from archfem.suite import Suite
from archfem.units import STANDARD_GRAVITY

PERIODS = np.geomspace(0.02, 3.0, 150)
"""Periods at which spectra are drawn [s]."""


def accelerogram(motion: Motion) -> Figure:
    """Draw acceleration, velocity and displacement, a column for each component of the motion."""
    names = motion.components
    figure = Figure(figsize=(4.5 * len(names) + 1.0, 6.0), layout="constrained")
    axes = figure.subplots(3, len(names), sharex=True, squeeze=False)
    for column, name in zip(axes.T, names, strict=True):
        rows = (
            (motion.component(name) / STANDARD_GRAVITY, "acceleration [g]"),
            (motion.velocity(name), "velocity [m/s]"),
            (motion.displacement(name), "displacement [m]"),
        )
        for axis, (values, label) in zip(column, rows, strict=True):
            _trace(axis, motion.times(name), values)
            axis.set_ylabel(label)
        column[0].set_title(name, fontsize="medium")
        column[-1].set_xlabel("time [s]")
    figure.suptitle(motion.name)
    return figure


def spectra(motions: Sequence[Motion], *, damping: float = 0.05) -> Figure:
    """Draw the response spectra of motions, horizontal and, where there is one, vertical.

    Raises:
        InvalidInput: there is no motion.
    """
    if not motions:
        raise InvalidInput("spectra of no motion: give one or more")
    upright = [motion for motion in motions if motion.vertical is not None]
    panels = [("horizontal", motions), ("vertical", upright)]
    panels = [(name, members) for name, members in panels if members]
    figure, axes = _panels(len(panels))
    for axis, (name, members) in zip(axes, panels, strict=True):
        for motion in members:
            values = response_spectrum(motion, PERIODS, damping, component=name)
            axis.plot(PERIODS, values / STANDARD_GRAVITY, lw=1.0, label=motion.name)
        _label(axis, name)
    return figure


def suite_spectra(suite: Suite, target: DesignSpectrum | None = None) -> Figure:
    """Draw the spectra of a suite, their mean, and the target they were matched to.

    Spectra include the suite's scale but not its reduction factor, as the target does.

    Args:
        suite: motions, all with or all without a vertical.
        target: design spectrum, drawn beside them.
    """
    names = ["horizontal"]
    if all(pair.vertical is not None for pair in suite.pairs):
        names.append("vertical")
    figure, axes = _panels(len(names))
    for axis, name in zip(axes, names, strict=True):
        values = suite.spectra(PERIODS, component=name) / STANDARD_GRAVITY
        for pair, row in zip(suite.pairs, values, strict=True):
            axis.plot(PERIODS, row, lw=0.8, alpha=0.8, label=pair.name)
        axis.plot(PERIODS, values.mean(axis=0), "k", lw=2.0, label="mean")
        if target is not None:
            aim = target.vertical if name == "vertical" else target.horizontal
            axis.plot(PERIODS, aim(PERIODS), "r--", lw=2.0, label="target")
        _label(axis, name)
    figure.suptitle(suite.name)
    return figure


def _panels(count: int) -> tuple[Figure, Sequence[Axes]]:
    figure = Figure(figsize=(6.0 * count, 4.5), layout="constrained")
    return figure, figure.subplots(1, count, squeeze=False)[0]


def _trace(axis: Axes, times: np.ndarray, values: np.ndarray) -> None:
    """Draw a time history and mark its peak."""
    axis.plot(times, values, lw=0.7)
    top = int(np.argmax(np.abs(values)))
    axis.plot(times[top], values[top], "o", ms=4, color="tab:red")
    axis.annotate(f"{values[top]:.3g}", (times[top], values[top]), fontsize="small")
    axis.grid(alpha=0.3)


def _label(axis: Axes, component: str) -> None:
    axis.set(xlabel="period [s]", ylabel="spectral acceleration [g]", title=component)
    axis.set_ylim(bottom=0.0)
    axis.grid(alpha=0.3)
    axis.legend(fontsize="x-small")
