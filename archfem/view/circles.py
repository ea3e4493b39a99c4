"""Figures of surveyed points against the circles nearest to them."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure
from archfem.masonry.survey.circle_fit import fitted_circle
from archfem.units import mm
from archfem.view import style
from archfem.view.style import Colour, Size


@validate_arguments
def draw_circle_fit(curves: Structure | Mapping[str, Array]) -> Figure:
    """Draw points along arcs, the circles nearest to them, and their distances from these.

    Circles are those of `fitted_circle`. The legend has radius and root mean square distance.

    Args:
        curves: the label of each arc and its points, from one springing to the other (n, 2) [m]; or
            a structure, for the joints' ends on the intrados of each of its rings.

    Returns:
        The figure: the arcs to scale, above distances over the angle from the vertical, positive
        where a point is outside its circle.

    Raises:
        InvalidInput: there is no arc, or more than there are colours, or points make no circle.
    """
    points = _find_intrados(curves) if isinstance(curves, Structure) else curves
    if not 1 <= len(points) <= len(Colour.LINES):
        raise InvalidInput(f"{len(points)} arcs in one picture: give 1 to {len(Colour.LINES)}")
    every = np.concatenate([np.asarray(own).reshape(-1, 2) for own in points.values()])
    wide, tall = np.maximum(np.ptp(every, axis=0), 1e-3)
    high = float(np.clip((Size.PAGE - 1.0) * tall / wide, 0.8, 4.0))
    figure = style.new_figure(Size.PAGE, high + 2.9)
    above, below = figure.subplots(2, 1, height_ratios=[high + 0.4, 1.6])
    style.style_length_axes(above)
    style.style_axes(below, "angle from the vertical [°]", "distance from the circle [mm]")
    below.axhline(0.0, color=Colour.GREY, lw=0.8)
    reach = 0.1  # of the lower axis [mm]: round-off of exact circles is not drawn
    for (label, own), colour in zip(points.items(), Colour.LINES, strict=False):
        circle = fitted_circle(own)
        x, y = (np.asarray(own) - circle.centre).T
        # from the vertical, as far as the points go to either side
        angles = np.unwrap(np.arctan2(x, y))
        fine = np.linspace(angles.min(), angles.max(), 200)
        arc = circle.centre + circle.radius * np.column_stack([np.sin(fine), np.cos(fine)])
        text = f"{label}: R = {circle.radius:.3f} m, rms {circle.rms / mm:.2f} mm"
        above.plot(*arc.T, color=colour, lw=0.9, label=text)
        above.plot(*np.asarray(own).T, "o", color=colour, ms=2.6)
        look = {"color": colour, "lw": 0.9, "marker": "o", "ms": 2.6}
        below.plot(np.degrees(angles), circle.distances / mm, **look)
        reach = max(reach, 1.1 * float(np.abs(circle.distances).max()) / mm)
    below.set_ylim(-reach, reach)
    style.add_legend_below(figure, 2)
    return figure


def _find_intrados(structure: Structure) -> dict[str, Array]:
    """Return the ends of the joints of each ring on its intrados (n, 2) [m]."""
    ends = [(joint.part, joint.intrados) for joint in structure.joints if joint.role == "ring"]
    return {ring: np.array([end for own, end in ends if own == ring]) for ring, _ in ends}
