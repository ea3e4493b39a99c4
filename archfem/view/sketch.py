"""Figure of a drawing as it was read, with the faults that keep it from being a structure."""

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem._typing import Array, Metres
from archfem._validation import validate_arguments
from archfem.masonry.survey.drawings import Outline
from archfem.masonry.survey.faults import CLOSED_BY_SNAP, find_faults, sketch_drawing
from archfem.view import style
from archfem.view.style import Colour, Size

FAULT_COLOURS = {
    "overlap": Colour.HINGE,
    "gap": Colour.SLIDING,
    "short contact": Colour.THRUST,
    "face not joined": Colour.MECHANISM,
    CLOSED_BY_SNAP: f"{Colour.HINGE}40",
}


@validate_arguments
def draw_outlines(
    path: str | Path,
    *,
    unit: str | None = None,
    snap: Metres = 1e-3,
    ignored: Collection[str] = (),
    error: str = "",
) -> Figure:
    """Draw the outlines of a drawing by layer, with their names or numbers.

    Overlaps that are errors are red, gaps between one and five times snap are orange, contacts of
    no more are blue; each has a ring around it. Overlaps that snap closes are pale.
    Polylines that are not closed are purple. The coordinates are those of the drawing, y upwards.

    Args:
        path: drawing, as for `archfem.masonry.read_outlines`.
        unit: unit of the coordinates, as there.
        snap: tolerance of touching outlines, as there [m].
        ignored: layers that are left out.
        error: message whose stones are marked where outlines fit: green are the nearest faces that
            they do not touch.

    Returns:
        The figure; it needs no outlines that touch.

    Raises:
        InvalidInput: the file is no drawing, or has nothing to draw.
    """
    closed, lines = sketch_drawing(path, unit, ignored, snap)
    every = [*closed, *lines]
    frame = every[0].frame
    bounds = np.concatenate([each.drawn for each in every])
    low, high = bounds.min(axis=0), bounds.max(axis=0)
    extent = np.maximum(high - low, 1e-3 * max(high - low))  # polylines in x and z are flat
    scale = min(np.array([Size.PAGE - 0.8, 5.6]) / extent)  # [inch / unit]
    wide, tall = scale * (high - low) + [0.8, 1.6]
    figure = style.new_figure(max(0.75 * Size.COLUMN, wide), max(0.35 * Size.COLUMN, tall))
    axes = figure.add_subplot()
    style.style_axes(axes, f"x [{frame.unit}]", f"y [{frame.unit}]")
    axes.set_aspect("equal")
    axes.ticklabel_format(style="plain", useOffset=False)  # of a survey, to be found in a drawing
    _draw_layers(axes, closed, scale)
    for line in lines:
        look = {"color": Colour.LOAD, "lw": 1.8, "zorder": 4}
        axes.plot(*line.drawn.T, "o-", ms=5.0, label="not closed", **look)
    counts = [f"{len(closed)} closed outlines"]
    found = find_faults(closed, snap, error)
    for kind, places in found.items():
        _mark_faults(axes, places, kind)
    faults = sum(len(places) for kind, places in found.items() if kind != CLOSED_BY_SNAP)
    counts += [f"{faults} fault{'s' * (faults > 1)}"] if faults else []
    counts += [f"{len(lines)} not closed"] if lines else []
    axes.autoscale_view()
    style.set_title(axes, f"{Path(path).name} as read: {', '.join(counts)}")
    handles = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    style.add_legend_below(figure, handles=list(handles.values()))
    return figure


def _draw_layers(axes: Axes, closed: Sequence[Outline], scale: float) -> None:
    """Draw closed outlines in the colours of their layers, each with its name or its number."""
    layers = list(dict.fromkeys(each.layer for each in closed))
    for number, layer in enumerate(layers):
        own = [each.drawn for each in closed if each.layer == layer]
        # the colours repeat, stronger each time
        again, colour = divmod(number, len(Colour.LINES))
        face = Colour.LINES[colour] + ("40", "80", "c0")[again % 3]
        style.add_polygons(axes, own, face, label=f"layer '{layer}' ({len(own)})")
    for number, outline in enumerate(closed, 1):
        points = outline.drawn
        x, y = (points - points[0]).T
        # mean width, as the corners of a sloping stone reach above its neighbours
        room = scale * 0.5 * float(abs(x @ np.roll(y, 1) - y @ np.roll(x, 1)) / (np.ptp(y) or 1.0))
        names = (outline.name, outline.name.removeprefix(outline.layer).strip(), str(number))
        fitting = (t for t in names if t and style.text_width(len(t), Size.NOTE) < room)
        style.write_name(axes, next(fitting, names[-1]), points.mean(axis=0))


def _mark_faults(axes: Axes, faults: Sequence[Array], kind: str) -> None:
    """Fill faults, and draw a ring around each, which may be too narrow to be seen."""
    if not faults:
        return
    colour, label = FAULT_COLOURS[kind], f"{kind} ({len(faults)})"
    if kind == CLOSED_BY_SNAP:
        style.add_polygons(axes, faults, colour, edge=colour, zorder=5, label=label)
        return
    # what is below a stone drawn twice stays visible
    style.add_polygons(axes, faults, f"{colour}80", edge=colour, width=1.5, zorder=5)
    places = np.array([fault.mean(axis=0) for fault in faults])
    look = {"mfc": "none", "mec": colour, "ms": 13.0, "mew": 1.6, "ls": "", "zorder": 7}
    axes.plot(*places.T, "o", label=label, **look)
