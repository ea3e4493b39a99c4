"""Figures of ground motions: accelerograms with their integrals, and response spectra."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import COMPONENTS, Motion
from archfem.motion.record_selection import RecordSelection
from archfem.motion.response_spectra import response_spectrum
from archfem.motion.suite import Suite
from archfem.units import STANDARD_GRAVITY
from archfem.view import style
from archfem.view.style import Colour, Size

# Periods at which spectra are drawn [s]
SPECTRUM_PERIODS = np.geomspace(0.02, 3.0, 150)


@validate_arguments
def draw_motion(motion: Motion) -> Figure:
    """Draw acceleration, velocity and displacement over time, with their peaks.

    Args:
        motion: a motion with one or several components.

    Returns:
        The figure, with a column for each component.
    """
    names = motion.components
    figure = style.new_figure(Size.COLUMN * (0.4 + 0.6 * len(names)), 3.4)
    axes = figure.subplots(3, len(names), sharex=True, squeeze=False)
    for number, (column, name) in enumerate(zip(axes.T, names, strict=True)):
        rows = (
            (motion.component(name) / STANDARD_GRAVITY, "acceleration\n[g]"),
            (motion.velocity(name), "velocity\n[m/s]"),
            (motion.displacement(name), "displacement\n[m]"),
        )
        for axis, (values, label) in zip(column, rows, strict=True):
            _draw_history(axis, motion.times(name), values)
            # components share the quantity of a row
            label = label if number == 0 else ""
            style.style_axes(axis, "time [s]" if axis is column[-1] else "", label)
        if len(names) > 1:  # a single component may have any direction
            column[0].set_title(name, fontsize=Size.TITLE)
    style.set_figure_title(figure, motion.name)
    return figure


@validate_arguments
def draw_spectra(motions: Sequence[Motion], *, damping: float = 0.05) -> Figure:
    """Draw the acceleration response spectra of motions, a panel for each component.

    The component of a motion that has only one is drawn with the horizontal ones.

    Args:
        motions: one or several motions.
        damping: damping ratio of the oscillators [-].

    Returns:
        The figure, with a panel for each component.

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
                values = response_spectrum(motion, SPECTRUM_PERIODS, damping, component=name)
                _draw_spectrum(axis, values, index, motion.name)
        alone = name == "horizontal" and any(len(motion.components) == 1 for motion in motions)
        _label_panel(axis, "horizontal or only component" if alone else name)
    style.add_legend_below(figure)
    return figure


@validate_arguments
def draw_accelerograms(suite: Suite) -> Figure:
    """Draw the accelerations of all pairs of a suite over time, at one scale.

    They include the scale of the suite but not its reduction factor, like its spectra. Each has its
    peak beside it.

    Args:
        suite: the suite; vertical components are drawn where a pair has one.

    Returns:
        The figure, with a panel for the horizontal components and one for the vertical ones.
    """
    pairs = [pair.scaled(suite.scale / STANDARD_GRAVITY) for pair in suite.pairs]
    names = [name for name in COMPONENTS[:2] if any(name in pair.components for pair in pairs)]
    peaks = [np.abs(pair.component(n)).max() for pair in pairs for n in pair.components]
    # distance of the baselines [g]: opposite peaks of neighbours do not meet
    apart = 1.6 * float(max(peaks)) or 1.0
    bases = [-apart * row for row in range(len(pairs))]
    figure = style.new_figure(Size.PAGE, 1.0 + 0.55 * len(pairs))
    panels = figure.subplots(1, len(names), sharex=True, sharey=True, squeeze=False)[0]
    for axes, name in zip(panels, names, strict=True):
        style.style_axes(axes, "time [s]")
        axes.set_title(name, fontsize=Size.LABEL)
        for base, pair in zip(bases, pairs, strict=True):
            if name in pair.components:
                values = pair.component(name)
                axes.plot(pair.times(name), base + values, Colour.LINES[0], lw=0.5)
                look = {"xycoords": ("axes fraction", "data"), "fontsize": Size.NOTE, "ha": "right"}
                style.annotate(axes, f"{np.abs(values).max():.2f} g", (1.0, base), (0, 3), **look)
        axes.set_yticks(bases, [pair.name for pair in pairs])
        axes.spines["left"].set_visible(False)
    panels[0].set(xlim=(0.0, None), ylim=(bases[-1] - 0.7 * apart, 0.7 * apart))
    _set_suite_title(figure, suite)
    return figure


def _set_suite_title(figure: Figure, suite: Suite) -> None:
    """Write the name of a suite, and that its motions are not yet divided by R."""
    divided = f", before division by R = {suite.reduction:g}" if suite.reduction != 1.0 else ""
    style.set_figure_title(figure, f"{suite.name}{divided}")


@validate_arguments
def draw_suite(suite: Suite, target: DesignSpectrum | None = None) -> Figure:
    """Draw the response spectra of a suite, their mean, and the design spectrum.

    The spectra include the scale of the suite but not its reduction factor, like the design
    spectrum, and the title states the latter.

    Args:
        suite: the suite; vertical components are drawn if all its motions have one.
        target: design spectrum, drawn at the periods at which it is defined.

    Returns:
        The figure, with a panel for the horizontal components and one for the vertical ones.
    """
    names = ["horizontal"]
    if all(pair.vertical is not None for pair in suite.pairs):
        names.append("vertical")
    figure, axes = _panels(len(names))
    for axis, name in zip(axes, names, strict=True):
        values = suite.spectra(SPECTRUM_PERIODS, component=name)
        for index, (pair, row) in enumerate(zip(suite.pairs, values, strict=True)):
            _draw_spectrum(axis, row, index, pair.name)
        mean = values.mean(axis=0) / STANDARD_GRAVITY
        axis.plot(SPECTRUM_PERIODS, mean, Colour.TEXT, lw=1.8, label="mean")
        if target is not None:
            function = target.vertical if name == "vertical" else target.horizontal
            axis.plot(*_tabulate(function), Colour.HINGE, ls="--", lw=1.8, label="target")
        _label_panel(axis, name)
        _mark_matched_periods(axis, suite)
    _set_suite_title(figure, suite)
    style.add_legend_below(figure)
    return figure


@validate_arguments
def draw_selection(found: RecordSelection) -> Figure:
    """Draw the scaled spectra of selected records, their mean, the design spectrum and its bounds.

    Args:
        found: selection of records.

    Returns:
        The figure; the periods that the rule checks are shaded.
    """
    rule, (first, last) = found.rule, found.band
    periods = np.geomspace(0.5 * first, 1.5 * last, 120)
    spectra = found.spectra_at(periods) / STANDARD_GRAVITY
    figure = style.new_figure(1.3 * Size.COLUMN, 4.2)
    axes = figure.subplots()
    shade = {"color": Colour.HINGE, "alpha": 0.06, "lw": 0.0, "zorder": 0}
    axes.axvspan(first, last, label=f"checked, {first:.3g} to {last:.3g} s", **shade)
    for index, row in enumerate(spectra):
        label = f"{len(spectra)} scaled records" if index == 0 else None
        axes.plot(periods, row, color=Colour.GREY, lw=0.7, label=label)
    axes.plot(periods, spectra.mean(axis=0), Colour.TEXT, lw=1.8, label="mean")
    target = found.target / STANDARD_GRAVITY
    axes.plot(found.periods, target, Colour.HINGE, ls="--", lw=1.8, label="design spectrum")
    for bound in (rule.lower, rule.upper):
        if np.isfinite(bound):
            label = f"bound, {bound:g} times"
            axes.plot(found.periods, bound * target, Colour.HINGE, ls=":", lw=1.0, label=label)
    style.style_axes(axes, "period [s]", f"spectral acceleration, {found.measure} [g]")
    state = "met" if found.meets else f"missed by {found.shortfall:.2g}"
    axes.set_title(f"{rule.name}: {state}", fontsize=Size.TITLE)
    axes.set_ylim(bottom=0.0)
    style.add_legend_below(figure, 3)
    return figure


def _draw_spectrum(axes: Axes, values: Array, index: int, name: str) -> None:
    """Draw one of several spectra [m/s²], with its own colour and dashes."""
    # colours repeat after a cycle, with other dashes; the last one, black, is that of the mean
    colours = Colour.LINES[:-1]
    cycle, place = divmod(index, len(colours))
    look = {"color": colours[place], "ls": ("-", "--", ":", "-.")[cycle % 4], "lw": 1.0}
    axes.plot(SPECTRUM_PERIODS, values / STANDARD_GRAVITY, label=name, **look)


def _mark_matched_periods(axis: Axes, suite: Suite) -> None:
    """Shade the periods in which all motions were matched, if they were."""
    bands = [match.band for match in suite.matches]
    if bands:
        low, high = max(low for low, _ in bands), min(high for _, high in bands)
        look = {"color": Colour.HINGE, "alpha": 0.06, "lw": 0.0, "zorder": 0}
        axis.axvspan(low, high, label=f"matched, {low:g} to {high:g} s", **look)


def _tabulate(spectrum: Callable[[Array], Array]) -> Array:
    """Return the periods at which a design spectrum is defined, and its values (2, n)."""
    points = []
    for period in SPECTRUM_PERIODS:
        try:
            points.append((period, float(spectrum(period))))
        except InvalidInput:  # a tabulated spectrum ends at some period, and may lack a vertical
            continue
    return np.array(points).reshape(-1, 2).T


def _panels(count: int) -> tuple[Figure, Sequence[Axes]]:
    """Return a figure and its panels side by side."""
    figure = style.new_figure(0.75 * Size.COLUMN * max(count, 1.3), 3.4)
    return figure, figure.subplots(1, count, squeeze=False)[0]


def _draw_history(axis: Axes, times: Array, values: Array) -> None:
    """Draw a time history and mark its peak."""
    axis.plot(times, values, Colour.LINES[0], lw=0.7)
    peak = int(np.argmax(np.abs(values)))
    axis.plot(times[peak], values[peak], "o", ms=3.5, color=Colour.HINGE)
    axis.margins(y=0.15)  # the number is above the axis of time
    text, halo = f"{values[peak]:.3g}".replace("-", "−"), style.white_halo(1.6)
    place = times[peak], values[peak]
    style.annotate(axis, text, place, (5, 0), va="center", path_effects=halo)


def _label_panel(axis: Axes, component: str) -> None:
    """Label a panel of spectra."""
    style.style_axes(axis, "period [s]", "spectral acceleration [g]")
    axis.set_title(component, fontsize=Size.TITLE)
    axis.set_ylim(bottom=0.0)
