"""Pictures of motions: accelerograms with their integrals, and the spectra of a suite."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import COMPONENTS, Motion
from archfem.motion.response_spectra import response_spectrum
from archfem.motion.suite import Suite
from archfem.units import STANDARD_GRAVITY
from archfem.view.style import COLUMN, HINGE, INK, LINES, NORMAL, SMALL, Page, dress

# Periods at which spectra are drawn [s]
PERIODS = np.geomspace(0.02, 3.0, 150)


def draw_motion(motion: Motion) -> Figure:
    """Draw acceleration, velocity and displacement over time, with their peaks.

    Args:
        motion: with one component or several.

    Returns:
        The page, with a column for each component.
    """
    names = motion.components
    figure = Page(figsize=(COLUMN * (0.4 + 0.6 * len(names)), 5.5), layout="constrained")
    axes = figure.subplots(3, len(names), sharex=True, squeeze=False)
    for column, name in zip(axes.T, names, strict=True):
        rows = (
            (motion.component(name) / STANDARD_GRAVITY, "acceleration [g]"),
            (motion.velocity(name), "velocity [m/s]"),
            (motion.displacement(name), "displacement [m]"),
        )
        for axis, (values, label) in zip(column, rows, strict=True):
            _trace(axis, motion.times(name), values)
            dress(axis, "time [s]" if axis is column[-1] else "", label)
        if len(names) > 1:  # one alone may be of any direction
            column[0].set_title(name, fontsize=NORMAL)
    figure.suptitle(motion.name, fontsize=NORMAL, wrap=True)
    return figure


def draw_spectra(motions: Sequence[Motion], *, damping: float = 0.05) -> Figure:
    """Draw the response spectra of motions, a panel for each component there is.

    The only component of a motion is drawn with the horizontals, whatever its direction.

    Args:
        motions: at least one.
        damping: of the oscillators, as a fraction of critical [-].

    Returns:
        The page, with a panel for each component.

    Raises:
        InvalidInput: there is no motion.
    """
    if not motions:
        raise InvalidInput("spectra of no motion: give one or more")
    names = [name for name in COMPONENTS if any(name in motion.components for motion in motions)]
    figure, axes = _panels(len(names))
    for axis, name in zip(axes, names, strict=True):
        for index, motion in enumerate(motions):
            if name in motion.components:
                values = response_spectrum(motion, PERIODS, damping, component=name)
                style = {"color": LINES[index % len(LINES)], "ls": _dashes(index), "lw": 1.0}
                axis.plot(PERIODS, values / STANDARD_GRAVITY, **style, label=motion.name)
        alone = name == "horizontal" and any(len(motion.components) == 1 for motion in motions)
        _label(axis, "horizontal or only component" if alone else name)
    _legend(figure, axes)
    return figure


def draw_suite(suite: Suite, target: DesignSpectrum | None = None) -> Figure:
    """Draw the spectra of a suite, their mean, and the target they were matched to.

    Spectra include the suite's scale but not its reduction factor, as the target does.

    Args:
        suite: motions; verticals are drawn where all have one.
        target: design spectrum, drawn beside them over the periods at which it is defined.

    Returns:
        The page, with a panel for the horizontals and one for the verticals, if any.
    """
    names = ["horizontal"]
    if all(pair.vertical is not None for pair in suite.pairs):
        names.append("vertical")
    figure, axes = _panels(len(names))
    for axis, name in zip(axes, names, strict=True):
        values = suite.spectra(PERIODS, component=name) / STANDARD_GRAVITY
        for index, (pair, row) in enumerate(zip(suite.pairs, values, strict=True)):
            style = {"color": LINES[index % len(LINES)], "ls": _dashes(index), "lw": 0.7}
            axis.plot(PERIODS, row, **style, label=pair.name)
        axis.plot(PERIODS, values.mean(axis=0), INK, lw=1.8, label="mean")
        if target is not None:
            aim = target.vertical if name == "vertical" else target.horizontal
            axis.plot(*_defined(aim), HINGE, ls="--", lw=1.8, label="target")
        _label(axis, name)
        _mark_band(axis, suite)
    figure.suptitle(suite.name, fontsize=NORMAL, wrap=True)
    _legend(figure, axes)
    return figure


def _mark_band(axis: Axes, suite: Suite) -> None:
    """Shade the periods over which all pairs were matched, if they were."""
    bands = [match.band for match in suite.matches]
    if bands:
        low, high = max(low for low, _ in bands), min(high for _, high in bands)
        words = f"matched, {low:g} to {high:g} s"
        axis.axvspan(low, high, color=HINGE, alpha=0.06, lw=0.0, zorder=0, label=words)


def _defined(aim: Callable[[Array], Array]) -> Array:
    """Return those of the periods at which a target is defined, and its values (2, n)."""
    known = []
    for period in PERIODS:
        try:
            known.append((period, float(aim(period))))
        except InvalidInput:  # a table ends somewhere, and need not have a vertical
            continue
    return np.array(known).reshape(-1, 2).T


def _dashes(index: int) -> str:
    """Return the kind of a line, another where colours begin anew."""
    return ("-", "--", ":", "-.")[index // len(LINES) % 4]


def _legend(figure: Figure, axes: Sequence[Axes]) -> None:
    """Explain the lines below all panels; the first has one of every motion."""
    handles, names = axes[0].get_legend_handles_labels()
    columns = 4 if max(map(len, names)) < 20 else 2
    figure.legend(
        handles, names, loc="outside lower center", ncols=columns, frameon=False, fontsize=SMALL
    )


def _panels(count: int) -> tuple[Figure, Sequence[Axes]]:
    figure = Page(figsize=(0.75 * COLUMN * max(count, 1.3), 4.2), layout="constrained")
    return figure, figure.subplots(1, count, squeeze=False)[0]


def _trace(axis: Axes, times: Array, values: Array) -> None:
    """Draw a time history and mark its peak."""
    axis.plot(times, values, LINES[0], lw=0.7)
    top = int(np.argmax(np.abs(values)))
    axis.plot(times[top], values[top], "o", ms=3.5, color=HINGE)
    axis.annotate(
        f"{values[top]:.3g}",
        (times[top], values[top]),
        xytext=(5, 0),
        textcoords="offset points",
        va="center",
        fontsize=SMALL,
    )


def _label(axis: Axes, component: str) -> None:
    dress(axis, "period [s]", "spectral acceleration [g]")
    axis.set_title(component, fontsize=NORMAL)
    axis.set_ylim(bottom=0.0)
