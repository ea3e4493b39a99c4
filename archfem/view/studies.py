"""Figures of studies: IDA, fragility, sensitivity, convergence, and accuracy over time."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any, Literal, Protocol

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from archfem._netcdf import name_flags
from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.dynamics.accuracy import Accuracy
from archfem.dynamics.collapse_state import FALLEN_STATES
from archfem.errors import InvalidInput
from archfem.motion.hazard import MEASURES, Hazard
from archfem.view import style
from archfem.view.style import Colour, Size

# Findings of limit analyses and ratings of which codes require at least 1
REQUIRED_FACTORS = ("factor", "without_pressure", "full_pressure", "geometric")

# Largest over least value beyond which dots of cases have a logarithmic axis [-]
WIDE_RATIO = 50.0

# Dashes of the lines over a key, one after the other
LINE_DASHES = "-", "--", "-.", ":"


class FragilityCurve(Protocol):
    """Fragility curve, as far as it is drawn."""

    median: float

    def probability(self, intensity: Any) -> Array:
        """Return the probability of the limit state at intensities."""

    def band(self, intensity: Any) -> tuple[Array, Array]:
        """Return the lower and the upper end of the confidence band at intensities."""


class RiskCurves(Protocol):
    """Result of `collapse_risk`, as far as it is drawn."""

    @property
    def hazard(self) -> Hazard:
        """Hazard curve of the site."""

    @property
    def sentence(self) -> str:
        """The rate, and its basis."""

    def fragility(self, measure: str | None = None) -> Any:
        """Return the fragility over an intensity, by default that of the hazard."""

    def disaggregation(self, bins: int = 12) -> tuple[Array, Array]:
        """Return edges of bins of intensity, and the share of the rate in each."""


class ConvergencePaths(Protocol):
    """Result of `mesh_sensitivity`, as far as it is drawn."""

    quantity: str

    @property
    def paths(self) -> Mapping[str, tuple[Array, Array, float, float]]:
        """Refinements by name, see `draw_convergence`."""


@validate_arguments
def draw_findings(
    table: xr.Dataset,
    max_panels: int = 12,
    max_keys: int = 3,
    limits: Mapping[str, float] | None = None,
) -> Figure:
    """Draw the findings of a study over each key that varies.

    Points that differ in one number alone are joined by a line. Colours are the values of a key in
    words, such as the case. Findings without negative values begin at zero over words, whose
    distances mean nothing. Named cases are bars with a dashed line at the first one, under several
    motions dots of their colours; of ratings these are the factors, with a line at 1. A case that
    falls, without a number, is a hatched bar to the end. Findings that the column `upper_bounds` of
    a point names are open marks or bars.

    Args:
        table: table of a study, as by `Study.run`.
        max_panels: number of panels: the first findings that differ are drawn.
        max_keys: number of keys that they are drawn over.
        limits: values of findings at which a dotted line is drawn, by their names.

    Returns:
        The figure, with a row for each finding and a column for each key; a panel for each finding
        where a single key varies, beside the names of the cases if they and motions alone do.

    Raises:
        InvalidInput: no finding is a number that differs between points.
    """
    flat = name_flags(table.drop_dims("entry", errors="ignore"))
    frame = flat.to_dataframe(dim_order=list(flat.dims)).reset_index()
    differs = {name: frame[name].replace(np.inf, np.nan).nunique() > 1 for name in frame}
    # numbers of points and samples are no keys of the case
    plain = [name for name in flat.coords if name not in ("point", "sample", "variation")]
    keys = [str(name) for name in plain if differs[name]][:max_keys]
    names = [name for name in flat.data_vars if differs[name] and frame[name].dtype.kind == "f"]
    if not names or not keys:
        raise InvalidInput("no finding is a number that differs between points")
    named = all(frame[key].dtype.kind not in "fi" for key in keys)
    if named and (len(keys) == 1 or keys == ["case", "pair"]):
        rated = [name for name in names if name in REQUIRED_FACTORS]
        return _draw_named_cases(flat, frame, keys, (rated or names)[:max_panels], limits or {})
    names = names[: max(max_panels // len(keys), 1)]
    columns = len(keys) if len(keys) > 1 else min(len(names), 3)
    rows = -(-len(names) * len(keys) // columns)
    figure = style.new_figure(max(0.6 + 2.6 * columns, Size.COLUMN), 0.9 + 1.5 * rows)
    same: Literal["row", "none"] = "row" if len(keys) > 1 else "none"
    panels = figure.subplots(rows, columns, sharex="col", sharey=same, squeeze=False).ravel()
    for number, (axes, (name, key)) in enumerate(zip(panels, product(names, keys), strict=False)):
        is_lowest = number + columns >= len(names) * len(keys)
        axes.tick_params(labelbottom=is_lowest)
        label = "" if len(keys) > 1 and number % columns else _label_key(flat, str(name), "\n")
        style.style_axes(axes, _label_key(flat, key) if is_lowest else "", label)
        others = [each for each in keys if each != key]
        # words first: a case says more than a number
        few = [each for each in others if frame[each].nunique() <= len(Colour.LINES)]
        coloured = next((each for each in few if frame[each].dtype.kind not in "fi"), None)
        coloured = coloured or next(iter(few), None)
        drawn = frame.rename(columns={name: "value"}).assign(bounded=_list_bounded(frame, name))
        _draw_over_key(axes, drawn, key, others, coloured)
        if limits and name in limits:
            axes.axhline(limits[str(name)], color=Colour.GREY, lw=0.9, ls=":")
        if number < columns and coloured is not None:
            labels = axes.get_legend_handles_labels()[1]
            look: Any = {"fontsize": Size.LABEL, "title_fontsize": Size.LABEL, "frameon": False}
            look |= {"ncols": style.legend_columns(labels, figure.get_figwidth() / columns)}
            look |= {"title": _label_key(flat, coloured), "bbox_to_anchor": (0.5, 1.0)}
            axes.legend(loc="lower center", **look)
    for axes in panels[len(names) * len(keys) :]:
        axes.remove()
    return figure


def _draw_named_cases(
    table: xr.Dataset,
    frame: Any,
    keys: Sequence[str],
    names: Sequence[Any],
    limits: Mapping[str, float],
) -> Figure:
    """Draw a panel for each finding, beside a row for each case: a bar, or dots of its motions."""
    key, *pairs = keys
    labels, columns = list(dict.fromkeys(frame[key])), min(len(names), 3)
    rows = -(-len(names) // columns)
    longest = style.text_width(max(len(f"{label}") for label in labels))
    size = 0.4 + longest + 2.0 * columns, 0.3 + rows * (0.7 + 0.18 * len(labels))
    figure = style.new_figure(max(size[0], Size.COLUMN), max(size[1], 1.5))
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    frame = frame.assign(place=frame[key].map(labels.index)).replace(np.inf, np.nan)
    for axes, name in zip(panels, names, strict=False):
        style.style_axes(axes, _label_key(table, str(name)))
        if frame["place"].is_unique:
            faces = np.where(_list_bounded(frame, name), "none", Colour.LINES[0])
            axes.barh(frame["place"], frame[name], height=0.7, color=faces, ec=Colour.LINES[0])
            _hatch_falls(axes, frame[frame[name].isna()])
        else:  # motions or samples of a case
            sets = frame.groupby(pairs, sort=False) if pairs else [(("",), frame)]
            for number, ((pair, *_), dots) in enumerate(sets):
                colour = Colour.LINES[number % len(Colour.LINES)]
                label = {"label": f"{pair}"} if pairs else {}
                axes.plot(dots[name], dots["place"], "o", ms=3.5, color=colour, **label)
                _mark_falls(axes, dots[dots[name].isna()], "place", colour, across=True)
            if frame[name].min() > 0.0 and frame[name].max() > WIDE_RATIO * frame[name].min():
                axes.set_xscale("log")
            else:
                axes.locator_params(axis="x", nbins=4)  # numbers of five digits fit
        look = {"color": Colour.GREY, "lw": 0.9}
        if not pairs:
            axes.axvline(frame[name].iloc[0], ls="--", label=f"{labels[0]}, the first", **look)
        if name in limits:
            axes.axvline(limits[name], ls=":", **look)
        # those of a push are accelerations, which pass at that of the site
        if name in REQUIRED_FACTORS and "without_pressure" in table:
            axes.axvline(1.0, label="a factor of 1", **look)
    panels[0].set_yticks(range(len(labels)), labels)
    panels[0].set_ylim(len(labels) - 0.5, -0.5)
    for axes in panels[len(names) :]:
        axes.remove()
    style.add_legend_below(figure, handles=panels[0].get_legend_handles_labels()[0])
    return figure


def _list_bounded(frame: Any, name: Any) -> list[bool]:
    """List whether a finding of each row is an upper bound."""
    stated = frame["upper_bounds"] if "upper_bounds" in frame else [""] * len(frame)
    return [name in f"{names}".split(", ") for names in stated]


def _hatch_falls(axes: Axes, unknown: Any) -> None:
    """Draw cases that fall, and so have no number, as hatched bars to the end of a panel."""
    falls = unknown[unknown["fall"].isin(FALLEN_STATES)] if "fall" in unknown else None
    look = {"fc": "none", "ec": Colour.HINGE, "hatch": "////", "lw": 0.0, "label": "falls"}
    if falls is not None and len(falls):
        axes.barh(falls["place"], 1.0, height=0.7, transform=axes.get_yaxis_transform(), **look)


def _mark_falls(axes: Axes, unknown: Any, key: str, colour: str, *, across: bool = False) -> None:
    """Draw points that fall, and so have no number, as triangles at the end of the axis."""
    falls = unknown[unknown["fall"].isin(FALLEN_STATES)] if "fall" in unknown else unknown[:0]
    if not len(falls):
        return
    at, end = falls[key], np.ones(len(falls))
    look: Any = {"color": colour, "ms": 5.0, "ls": "", "clip_on": False}
    if across:
        axes.plot(end, at, ">", transform=axes.get_yaxis_transform(), **look)
    else:
        axes.plot(at, end, "^", transform=axes.get_xaxis_transform(), **look)


def _label_key(table: xr.Dataset, key: str, gap: str = " ") -> str:
    """Return a key of a case, or a finding, with the unit of its values."""
    unit = table[key].attrs.get("units")
    return f"{key}{gap}[{unit}]" if unit else key


def _draw_over_key(
    axes: Axes, frame: Any, key: str, others: Sequence[str], coloured: str | None
) -> None:
    """Draw the values of a frame over a key, with a line for each set of other keys."""
    in_words = frame[key].dtype.kind not in "fi"
    if in_words:
        labels = list(dict.fromkeys(frame[key]))
        axes.set_xticks(range(len(labels)), labels, rotation=30, ha="right")
        axes.set_xlim(-0.5, len(labels) - 0.5)
        frame = frame.assign(**{key: frame[key].map(labels.index)})
    # samples differ in all keys at once: no two of them are joined
    joined = bool(others) and not in_words and 2 * frame.groupby(others).ngroups <= len(frame)
    sets = others if joined else [coloured] if coloured else []
    colours: dict[Any, str] = {}
    for _, group in frame.groupby(sets, sort=False) if sets else [("", frame)]:
        words = None if coloured is None else group[coloured].iloc[0]
        text = f"{words:.6g}" if isinstance(words, float) else f"{words}"
        label = None if words is None or words in colours else text
        colour = colours.setdefault(words, Colour.LINES[len(colours)])
        known = group[np.isfinite(group["value"])].sort_values(key)
        look = {"ms": 3.5, "lw": 1.2, "color": colour, "label": label}
        dashes = LINE_DASHES[[*colours].index(words) % len(LINE_DASHES)]  # equal lines show through
        axes.plot(known[key], known["value"], "o" + dashes * joined, **look)
        _mark_falls(axes, group[group["value"].isna()], key, colour)
        bounds = known[known["bounded"]]
        if len(bounds):
            axes.plot(bounds[key], bounds["value"], "o", **look | {"mfc": "white", "label": None})
    finite = frame["value"][np.isfinite(frame["value"])]
    if in_words and finite.min() >= 0.0:
        axes.set_ylim(0.0, 1.1 * finite.max())


def draw_study(
    factors: Mapping[str, Mapping[str, Array]], reduction: float = 1.0, title: str = ""
) -> Figure:
    """Draw the motion scales at which mechanisms begin, a row for each case.

    A mark is the median over the pairs of motions, its line their range; an arrow means that no
    mechanism began at the scales tried. Definitions of a mechanism that no case meets are left
    out, such as a ring and a pier where there are no piers.

    Args:
        factors: by name of the case and definition of a mechanism, the least scale at which it
            begins, for each pair (pairs,) [-]; infinite where it does not.
        reduction: reduction factor R; a line is drawn at 1 / R unless it is 1.
        title: title of the figure.

    Returns:
        The figure.
    """
    names = list(factors)
    first, *_ = cases = [*factors.values()]
    scales = {definition: np.array([case[definition] for case in cases]) for definition in first}
    scales = {d: values for d, values in scales.items() if np.isfinite(values).any()}
    label = "scale of the motions at the first mechanism [-]"
    figure, axes = style.new_axes(Size.PAGE, 1.9 + 0.42 * len(names), label)
    finite = np.concatenate([[1.0], *(each[np.isfinite(each)] for each in scales.values())])
    end = 1.3 * finite.max()
    _draw_ranges(axes, scales, end)
    for scale, text in {1.0 / reduction: f"1 / R, R = {reduction:g}", 1.0: "unscaled"}.items():
        axes.axvline(scale, color=Colour.GREY, lw=0.9, ls="--", zorder=0)
        look: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "color": Colour.EDGE}
        style.annotate(axes, text, (scale, 1.0), (0, 2), ha="center", va="bottom", **look)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xscale("log")
    ticks = [t for t in (0.1, 0.2, 0.333, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0) if t < end]
    axes.set_xticks(ticks, [f"{tick:.3g}" for tick in ticks])
    axes.set_xlim(0.85 * min(finite.min(), 1.0 / reduction), 1.06 * end)
    axes.minorticks_off()
    look = {"color": Colour.GREY, "ms": 5, "lw": 1.4}
    axes.plot([], [], "o-", label="median, and range of the pairs", **look)
    if any(~np.isfinite(each).all() for each in scales.values()):
        axes.plot([], [], ">", label="above the scales tried", **look)
    if title:
        style.set_figure_title(figure, title)
    head = "first mechanism: the first instant in which …"
    style.add_legend_below(figure, 2, title=head, title_fontsize=Size.LABEL)
    return figure


def _draw_ranges(axes: Axes, scales: Mapping[str, Array], end: float) -> None:
    """Draw median and range of scales (cases, pairs) by definition; arrows for infinite medians."""
    explanations = {
        "any joints at once": "enough joints fail at once",
        "one part at once": "enough of one ring or pier fail at once",
        "ring and pier at once": "enough of a ring and a pier fail at once",
        "one part over the record": "enough of one ring or pier have failed",
        "verified": "blocks can move (verified)",
    }
    for number, (definition, least) in enumerate(scales.items()):
        look = {"color": Colour.LINES[number], "ms": 5}
        # rows of one case lie around its tick, whose distance to the next is 1
        rows = np.arange(len(least)) + 0.16 * (number - 0.5 * (len(scales) - 1))
        low, middle, high = np.quantile(least, [0.0, 0.5, 1.0], axis=1, method="nearest")
        axes.hlines(rows, np.minimum(low, end), np.minimum(high, end), look["color"], lw=1.4)
        known = np.isfinite(middle)
        axes.plot([], [], "o", label=explanations.get(definition, definition), **look)
        axes.plot(middle[known], rows[known], "o", **look)
        axes.plot(np.full((~known).sum(), end), rows[~known], ">", **look)


def draw_ida(
    curves: Iterable[tuple[str, Array, Array]],
    capacities: Mapping[str, tuple[Array, Array]],
    *,
    fractiles: tuple[Array, Array] | None = None,
    measure: str = "peak ground acceleration [m/s²]",
    demand: str = "largest rotation of a joint [rad]",
) -> Figure:
    """Draw incremental dynamic analyses: curves, fractiles, and the intensities at limit states.

    Curves need not be monotonic. An arrow at the end of a curve means that the run at the next
    intensity ended early.

    Args:
        curves: name, intensities and demands of each motion, as by `Ida.curves`.
        capacities: by limit state the ends of the bracket of each motion, as by `Ida.capacities`.
        fractiles: intensities (n,) and the demands of the 16, 50 and 84 % fractiles (3, n).
        measure: label of the intensity axis.
        demand: label of the demand axis.

    Returns:
        The figure: curves at the left, limit states at the right, with a common intensity axis.
    """
    figure = style.new_figure(Size.PAGE, max(0.75 * Size.COLUMN, 3.2))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.2, 1.0))
    style.style_axes(left, demand, measure)
    style.style_axes(right)
    end, look = 0.0, {"color": Colour.GREY, "lw": 0.8}
    for number, (_, intensity, demands) in enumerate(curves):
        known = np.isfinite(demands)
        x, y = np.append(0.0, demands[known]), np.append(0.0, intensity[known])
        end = max(end, x.max())
        left.plot(x, y, marker=".", ms=3, label=None if number else "motions", **look)
        if not known.all() and known.any():
            tip = 1.06 * x[-1] + 1e-12, y[-1]
            left.annotate("", tip, (x[-1], y[-1]), arrowprops={"arrowstyle": "->"} | look)
    if fractiles is not None:
        names = {"16 %": ":", "50 %": "-", "84 %": "--"}
        for (name, dashes), values in zip(names.items(), fractiles[1], strict=True):
            known = np.isfinite(values)
            x, y = values[known], fractiles[0][known]
            left.plot(x, y, dashes, color=Colour.LINES[0], lw=1.8, label=name)
    left.set_xlim(0.0, 1.1 * end or 1.0)
    left.legend(frameon=False, fontsize=Size.LABEL, loc="lower right")
    _draw_capacities(right, capacities)
    left.set_ylim(bottom=0.0)  # last, since it fixes the upper end as well
    style.add_legend_below(figure, handles=right.get_legend_handles_labels()[0])
    return figure


def _draw_capacities(axes: Axes, capacities: Mapping[str, tuple[Array, Array]]) -> None:
    """Draw the bracket of each motion, the median, and a triangle where a state was not met."""
    for place, (low, high) in enumerate(capacities.values()):
        spread = place + np.linspace(-0.25, 0.25, len(low))
        met = np.isfinite(high)
        colour = Colour.LINES[place % len(Colour.LINES)]
        axes.vlines(spread[met], low[met], high[met], color=colour, lw=2.0)
        # a bracket may be too narrow to be seen: its middle is marked
        axes.plot(spread[met], 0.5 * (low + high)[met], ".", color=colour, ms=5)
        axes.plot(spread[~met], low[~met], "^", color=colour, ms=4)
        if met.sum() > len(met) / 2:
            middle = float(np.quantile(np.sqrt(low * high), 0.5, method="nearest"))
            axes.hlines(middle, place - 0.35, place + 0.35, color=Colour.EDGE, lw=1.2)
    _explain_capacities(axes, capacities)
    axes.set_xticks(range(len(capacities)), list(capacities), rotation=25, ha="right")
    axes.set_xlim(-0.6, len(capacities) - 0.4)
    axes.grid(axis="y", color=Colour.UNDEFORMED, lw=0.5)


def _explain_capacities(axes: Axes, capacities: Mapping[str, tuple[Array, Array]]) -> None:
    """Add legend entries of the marks that occur among the capacities."""
    met = [np.isfinite(high) for _, high in capacities.values()]
    marks: dict[str, tuple[bool, dict[str, Any]]] = {
        "bracket of a motion": (any(each.any() for each in met), {"marker": ".", "lw": 2.0}),
        "median": (any(each.mean() > 0.5 for each in met), {"color": Colour.EDGE, "lw": 1.2}),
        "not met up to here": (any(not each.all() for each in met), {"marker": "^", "ls": ""}),
    }
    for label, (occurs, look) in marks.items():
        if occurs:
            axes.plot([], [], label=label, **({"color": Colour.GREY, "ms": 5} | look))


@validate_arguments
def draw_ensemble(table: xr.Dataset) -> Figure:
    """Draw the largest displacement of each history over the scale of its motion, by outcome.

    Args:
        table: `displacement` [m] and `outcome` over `motion`, `scale` and other dimensions, as the
            dataset of `af.ensemble`.

    Returns:
        The figure. Scales of one motion are joined by a line; a history without an answer is left
        out.
    """
    label = "largest displacement of a corner [m]"
    figure, axes = style.new_axes(Size.COLUMN, 0.75 * Size.COLUMN, "scale of the motion [-]", label)
    rows = table[["displacement", "outcome"]].transpose("scale", ...)
    scale, shape = rows["scale"].values, (rows.sizes["scale"], -1)
    moved = rows["displacement"].values.reshape(shape)
    outcome = rows["outcome"].values.reshape(shape).astype(str)
    axes.plot(scale, moved, color=Colour.GREY, lw=0.6)
    for number, kind in enumerate(np.unique(outcome)):
        place, history = np.nonzero((outcome == kind) & np.isfinite(moved))
        look = {"marker": "oxs^"[number % 4], "color": Colour.LINES[number % len(Colour.LINES)]}
        name = f"{kind}: {len(place)} of {outcome.size}"
        axes.plot(scale[place], moved[place, history], ls="", ms=4, label=name, **look)
    if (moved > 0.0).any():
        axes.set_yscale("log")
    axes.legend(frameon=False, fontsize=Size.LABEL)
    return figure


def draw_fragility(
    curves: FragilityCurve | Mapping[str, FragilityCurve | tuple[Array, Array, Array]],
    intensity: Array | None = None,
    *,
    data: Mapping[str, tuple[Array, Array]] | None = None,
    measure: str = "peak ground acceleration [m/s²]",
) -> Figure:
    """Draw fragility curves with their confidence bands, and the data to which they were fitted.

    Args:
        curves: a `Fragility`; or by limit state such a curve, or the probability and the lower and
            upper end of its band (n,) [-].
        intensity: intensities of the curves (n,); by default up to three times the largest median.
        data: by limit state intensities and fractions of failures, drawn as marks.
        measure: label of the intensity axis.

    Returns:
        The figure.

    Raises:
        InvalidInput: probabilities are given without their intensities.
    """
    named = curves if isinstance(curves, Mapping) else {"limit state": curves}
    if intensity is None:
        if any(isinstance(curve, tuple) for curve in named.values()):
            raise InvalidInput("probabilities have no intensities: give intensity, or a Fragility")
        largest = max(curve.median for curve in named.values())
        intensity = np.linspace(0.0, 3.0 * largest, 301)[1:]
    size = Size.COLUMN, 0.7 * Size.COLUMN
    figure, axes = style.new_axes(*size, measure, "probability of the limit state [-]")
    for (name, curve), colour in zip(named.items(), Colour.LINES, strict=False):
        if isinstance(curve, tuple):
            middle, low, high = curve
        else:
            middle, (low, high) = curve.probability(intensity), curve.band(intensity)
        axes.fill_between(intensity, low, high, color=colour, alpha=0.15, lw=0.0)
        axes.plot(intensity, middle, color=colour, lw=1.8, label=name)
        if data is not None and name in data:
            axes.plot(*data[name], "o", color=colour, ms=3.5, mfc="white")
    # one entry each for what all limit states have, in grey
    axes.fill_between([], [], color=Colour.GREY, alpha=0.3, lw=0.0, label="confidence band")
    if data:
        look = {"color": Colour.GREY, "ms": 3.5, "mfc": "white"}
        axes.plot([], [], "o", label="data of the fit", **look)
    axes.set(xlim=(0.0, float(intensity.max())), ylim=(0.0, 1.0))
    axes.legend(frameon=False, fontsize=Size.LABEL, loc="lower right")
    return figure


def draw_tornado(
    ranges: Mapping[str, tuple[float, float]], usual: float, quantity: str = "finding"
) -> Figure:
    """Draw a tornado diagram: the change of a result as each parameter varies from low to high.

    Args:
        ranges: by name of the parameter, the result at its low and at its high value.
        usual: the result where no parameter is changed.
        quantity: name and unit of the result.

    Returns:
        The figure, with the most influential parameter at the top.
    """
    order = sorted(ranges, key=lambda name: float(np.ptp([*ranges[name], usual])))
    figure, axes = style.new_axes(Size.COLUMN, 0.9 + 0.42 * len(order), quantity)
    for row, name in enumerate(order):
        ends = zip(ranges[name], Colour.LINES, ("low", "high"), strict=False)
        # where both ends lie on one side, the nearer is drawn on top
        for value, colour, end in sorted(ends, key=lambda end: -abs(end[0] - usual)):
            look = {"height": 0.62, "color": colour, "label": None if row else end}
            axes.barh(row, value - usual, left=usual, **look)
    axes.axvline(usual, color=Colour.EDGE, lw=1.0)
    axes.set_yticks(range(len(order)), order)
    axes.margins(x=0.08)
    style.add_legend_below(figure, 2)
    return figure


@validate_arguments
def draw_collapse_risk(risk: RiskCurves) -> Figure:
    """Draw the fragility with its band, the hazard, and where in intensity the rate comes from.

    Args:
        risk: result of `archfem.collapse_risk`.

    Returns:
        The figure, a panel for each.
    """
    curve, hazard = risk.fragility(), risk.hazard
    word = {"pga": "PGA", "pgv": "PGV", "sa": "Sa", "sa_avg": "mean Sa"}[hazard.measure]
    label = f"{word} [{MEASURES[hazard.measure]}]"
    rows, columns = style.panel_grid(3)
    figure = style.new_figure(Size.PAGE, 0.4 + 2.4 * rows)
    first, second, third = figure.subplots(rows, columns).ravel()
    x = np.linspace(0.0, 2.5 * curve.median, 301)[1:]
    style.style_axes(first, label, "probability of a fall [-]")
    first.fill_between(x, *curve.band(x), color=Colour.LINES[0], alpha=0.2, lw=0.0)
    first.plot(x, curve.probability(x), color=Colour.LINES[0], lw=1.8)
    first.set(xlim=(0.0, x[-1]), ylim=(0.0, 1.0))
    style.style_axes(second, label, "rate of exceedance [1/year]")
    reach = np.geomspace(0.05 * curve.median, 2.5 * curve.median, 101)
    second.loglog(reach, hazard.rate_of(reach), color=Colour.LINES[1], lw=1.8)
    style.style_axes(third, label, "share of the rate [-]")
    edges, shares = risk.disaggregation()
    third.bar(edges[:-1], shares, np.diff(edges), align="edge", color=Colour.LINES[2], lw=0.0)
    for axes, title in zip((first, second, third), ("fragility", "hazard", "rate"), strict=True):
        style.set_title(axes, title)
    style.set_figure_title(figure, risk.sentence.partition(";")[0])
    return figure


def draw_convergence(
    paths: Mapping[str, tuple[Array, Array, float, float]] | ConvergencePaths,
    quantity: str | None = None,
) -> Figure:
    """Draw a result over the size of cells and steps, with its extrapolated limit and error bar.

    Args:
        paths: by name of the refinement, sizes relative to the finest (n,), results (n,), the limit
            at size zero, and the error bar of the finest; or a result of `mesh_sensitivity`.
        quantity: name and unit of the result.

    Returns:
        The figure, with a panel for each refinement.
    """
    if not isinstance(paths, Mapping):
        quantity, paths = quantity or paths.quantity, paths.paths
    quantity = quantity or "finding"
    wide = 0.25 * Size.COLUMN + 0.55 * Size.COLUMN * len(paths)
    figure = style.new_figure(wide, 0.55 * Size.COLUMN)
    panels = figure.subplots(1, len(paths), sharey=True, squeeze=False)[0]
    for axes, (name, (sizes, values, limit, error)) in zip(panels, paths.items(), strict=True):
        first = axes is panels[0]
        style.style_axes(axes, f"{name}:\nsize over the finest [-]", quantity if first else "")
        axes.plot(sizes, values, "o-", color=Colour.LINES[0], lw=1.4, ms=5)
        axes.errorbar(sizes[-1:], values[-1:], [error], color=Colour.LINES[1], capsize=4, lw=1.6)
        axes.plot([0.0], [limit], "D", color=Colour.LINES[2], ms=6, label="limit", clip_on=False)
        axes.plot([0.0, sizes[-1]], [limit, values[-1]], ":", color=Colour.GREY)
        axes.set_xlim(0.0, 1.08 * float(np.max(sizes)))
        axes.set_xticks(sizes, [f"{size:.3g}" for size in sizes])
    panels[0].legend(frameon=False, fontsize=Size.LABEL)
    return figure


@validate_arguments
def draw_accuracy(found: Accuracy) -> Figure:
    """Draw error over computing time of all settings on logarithmic axes, with the Pareto front.

    The shape of a mark is the fidelity, its colour the quadrature. Lines show the tolerance and the
    error of the reference; a ring marks the setting chosen.

    Args:
        found: result of `accuracy`.

    Returns:
        The figure.
    """
    labels = "computing time [s]", "error of the largest |e| of a joint [-]"
    figure, axes = style.new_axes(7.2, 5.0, *labels)
    axes.set(xscale="log", yscale="log")
    axes.tick_params(which="both", labelsize=Size.LABEL)
    # seconds as numbers, few enough to stay apart over three decades
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(lambda seconds, _: f"{seconds:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    # smaller errors are drawn at this one: they are uncertain, or exactly zero
    floor = max(found.reference_error / 10.0, 1e-7)
    reached = [trial for trial in found.front if np.isfinite(trial.error)]
    front = np.array([(trial.seconds, max(trial.error, floor)) for trial in reached])
    axes.step(*front.T, where="post", color=Colour.EDGE, lw=1.1, zorder=2, label="Pareto front")
    axes.axhline(found.tolerance, color=Colour.HINGE, lw=0.9, ls="--", label="tolerance")
    error = max(found.reference_error, floor)
    axes.axhline(error, color=Colour.GREY, lw=0.9, ls=":", label="error of the reference")
    if found.choice is not None:
        chosen = found.choice
        place = (chosen.seconds, max(chosen.error, floor))
        look = {"mfc": "none", "mec": Colour.HINGE, "mew": 1.4, "zorder": 6}
        axes.plot(*place, "o", ms=15, label=f"chosen:\n{chosen.setting.label}", **look)
    _draw_settings(axes, found, floor)
    axes.legend(fontsize=Size.LABEL, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def _draw_settings(axes: Axes, found: Accuracy, floor: float) -> None:
    """Mark each setting by fidelity and quadrature, and explain those that occur."""
    shapes = {"rigid": "o", "faces": "s", "condensed": "D", "full": "^"}
    colours = dict(zip(("nodal", "lobatto", "gauss", "exact"), Colour.LINES, strict=False))
    tried = [trial.setting.discretisation for trial in found.trials]
    for trial, setting in zip(found.trials, tried, strict=True):
        if np.isfinite(trial.error):
            # other fidelities are mixed ones
            marker = shapes.get(setting.name, "*")
            colour = colours.get(str(setting.quadrature), Colour.GREY)
            look = {"mfc": colour, "mec": "white", "mew": 0.5, "zorder": 4}
            axes.plot(trial.seconds, max(trial.error, floor), marker, ms=6, **look)
    for name in (name for name in shapes if name in {each.name for each in tried}):
        axes.plot([], [], shapes[name], color=Colour.EDGE, ms=6, label=name)
    for rule in (rule for rule in colours if rule in {each.quadrature for each in tried}):
        axes.plot([], [], "o", color=colours[rule], ms=6, label=rule)
