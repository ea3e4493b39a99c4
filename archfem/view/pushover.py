"""The picture of a pushover: what is resisted over displacement, hinges in order, the limit."""

from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from archfem.errors import InvalidInput
from archfem.masonry.naming import listed_joints
from archfem.statics.pushover import Pushover
from archfem.units import mm
from archfem.view.style import COLUMN, HINGE, INK, LINES, SMALL, Page, dress, legend

NEAR_LIMITS, NEAR_DISCS = 0.05, 0.035
"""Distance of limits, and of discs, that share a label, relative to the axes."""

NEAR = 0.98
"""Share of the way to the last factor after which a curve is nearly flat."""


def draw_pushover(
    pushes: Pushover | Mapping[str, Pushover],
    *,
    limits: Mapping[str, float] | None = None,
    reach: float | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Draw factors over displacements; discs mark where joints first hinge.

    Where there is one curve its discs are numbered, with the joints' names and the faces that stay
    in contact beside it.

    Args:
        pushes: one, or what to call each pushover, and the pushover.
        limits: what to call known limits, and their factors, drawn as dashed lines.
        reach: of the displacement axis [m]; by default where the curves have become flat.
        axes: where to draw; by default a new figure.

    Returns:
        The page; that of `axes` where given.

    Raises:
        InvalidInput: there is no pushover, or too many to tell apart.
    """
    pushes = {"pushover": pushes} if isinstance(pushes, Pushover) else pushes
    if not 1 <= len(pushes) <= len(LINES):
        raise InvalidInput(f"{len(pushes)} pushovers in one picture: give 1 to {len(LINES)}")
    page = Page(figsize=(COLUMN, 3.8), layout="constrained")
    axes = page.add_subplot() if axes is None else axes
    units = {push.curve["factor"].attrs["units"] for push in pushes.values()}
    what = "load factor λ [-]" if units == {"1"} else "work on a unit of settlement [N m]"
    dress(axes, "displacement [mm]", what)
    reach = reach or max(_flat(push) for push in pushes.values())
    for (label, push), colour in zip(pushes.items(), LINES, strict=False):
        axes.plot(push.curve["displacement"] / mm, push.curve["factor"], color=colour, label=label)
        told = _mark(axes, push, reach)
    axes.plot([], [], "o", color=HINGE, ms=6.0, mec="white", label="joint hinges")
    falls = any(push.factor < float(push.curve["factor"][0]) for push in pushes.values())
    axes.set_xlim(0.0, reach / mm)
    if len(pushes) == 1 and told:
        _tell(axes, told, above=falls)
    for value in (limits or {}).values():
        axes.axhline(value, color=INK, ls="--", lw=1.0, zorder=1)
    for names, value in _apart(limits or {}, float(np.ptp(axes.get_ylim()))).items():
        _limit(axes, names, value, at_left=falls)
    legend(axes)
    return cast(Figure, axes.figure)


def _apart(limits: Mapping[str, float], high: float) -> dict[str, float]:
    """Lines of names and values, each for limits too near to be told apart, and the highest."""
    found: dict[str, float] = {}
    for name, value in sorted(limits.items(), key=lambda each: each[1]):
        words = f"{name}: {value:.4g}"
        if found and value - next(reversed(found.values())) < NEAR_LIMITS * high:
            words = f"{found.popitem()[0]}, {words}"
        found[words] = value
    return found


def _limit(axes: Axes, words: str, value: float, *, at_left: bool) -> None:
    """Name known limits, where no curve runs."""
    axes.annotate(
        words,
        (0.0 if at_left else 1.0, value),
        xycoords=("axes fraction", "data"),
        xytext=(4 if at_left else -4, 3),
        textcoords="offset points",
        fontsize=SMALL,
        ha="left" if at_left else "right",
    )


def _flat(push: Pushover) -> float:
    """Displacement by which a curve has become flat, and some more [m]."""
    factor = push.curve["factor"].values
    way = np.abs(factor - factor[0])
    first = int(np.argmax(way >= NEAR * way[-1]))
    return 1.3 * float(push.curve["displacement"][first])


def _mark(axes: Axes, push: Pushover, reach: float) -> dict[tuple[float, float], str]:
    """Put discs where joints first hinge, one for all of a step: their places, and which joints."""
    steps: dict[int, list[tuple[int, str]]] = {}
    for (joint, side), step in zip(push.hinges, push.hinge_steps, strict=True):
        steps.setdefault(step, []).append((joint, side))
    names, told = push.joints["name"].values.astype(str), {}
    for step, hinges in steps.items():
        place = float(push.curve["displacement"][step]) / mm, float(push.curve["factor"][step])
        if place[0] > reach / mm:
            continue
        axes.plot(*place, "o", color=HINGE, ms=6.0, mec="white", mew=0.8, zorder=5)
        faces = {side: [names[j] for j, own in hinges if own == side] for _, side in hinges}
        told[place] = "; ".join(f"{listed_joints(own)}, {side}" for side, own in faces.items())
    return told


def _runs(
    places: Sequence[tuple[float, float]], axes: Axes
) -> list[tuple[int, int, tuple[float, float]]]:
    """First and last number, from 1, of discs whose numbers would overlap, and the last place."""
    size = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())])
    found: list[tuple[int, int, tuple[float, float]]] = []
    for number, place in enumerate(places, start=1):
        if found and np.linalg.norm((np.array(place) - found[-1][2]) / size) < NEAR_DISCS:
            found[-1] = found[-1][0], number, place
        else:
            found.append((number, number, place))
    return found


def _tell(axes: Axes, told: Mapping[tuple[float, float], str], *, above: bool) -> None:
    """Number the discs of a curve, and say what they are in the corner that it leaves free."""
    halo = [withStroke(linewidth=2.5, foreground="white")]
    for first, last, place in _runs(list(told), axes):
        number = f"{first}" if first == last else f"{first}–{last}"
        axes.annotate(
            number, place, (4, -11), textcoords="offset points", fontsize=SMALL, color=INK,
            path_effects=halo,
        )  # fmt: skip
    lines = [f"{number}  {words}" for number, words in enumerate(told.values(), start=1)]
    axes.annotate(
        "\n".join(lines), (0.97, 0.95 if above else 0.05), xycoords="axes fraction",
        fontsize=SMALL, color=INK, ha="right", va="top" if above else "bottom",
        multialignment="left",
    )  # fmt: skip
