"""The dead load in one picture: thrust lines, and what is largest and least in numbers."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from archfem.joints.criteria import Criteria, judged
from archfem.statics.equilibrium import Equilibrium
from archfem.view.structure import draw_structure
from archfem.view.style import EDGE, INK, SMALL, entitle, plain

AWAY = 22.0
"""Distance of words from the joint that they are about [points]."""


def draw_dead_load(dead: Equilibrium, *, criteria: Criteria | None = None) -> Figure:
    """Draw a structure under its dead load: its thrust lines, and numbers at the joints.

    Numbers stand at those joints of rings and piers that have the largest and the least N, the
    largest |e| and the largest V / N; in the title stand the weight and the span of N.

    Args:
        dead: the equilibrium.
        criteria: what makes a joint fail; by default those by which it was judged.

    Returns:
        The page.
    """
    structure = dead.model.structure
    figure = draw_structure(structure, dead.joints, criteria=criteria)
    axes, normal = figure.axes[0], judged(dead.joints)["N"].values / 1e3
    entitle(
        axes,
        f"{structure.name}: dead load, weight {structure.weight / 1e3:.3g} kN, "
        f"N from {normal.min():.3g} to {normal.max():.3g} kN",
    )
    for number, words in _telling(dead).items():
        _tell(axes, dead, number, words)
    axes.margins(0.09, 0.12)
    plain(figure)
    return figure


def _telling(dead: Equilibrium) -> dict[int, list[str]]:
    """What is said of which joints."""
    own = judged(dead.joints)
    numbers = own["joint"].values
    said: dict[int, list[str]] = {}
    for key, sign, words in (
        ("N", 1.0, "largest N = {:.3g} kN"),
        ("N", -1.0, "least N = {:.3g} kN"),
        ("eccentricity", 0.0, "largest |e|: e = {:.3f}"),
        ("friction", 1.0, "largest V/N = {:.3f}"),
    ):
        values = own[key].values * (1e-3 if key == "N" else 1.0)
        order = np.abs(values) if sign == 0.0 else sign * values
        if np.isfinite(order).any():
            place = int(np.nanargmax(np.round(order, 9)))
            said.setdefault(int(numbers[place]), []).append(words.format(values[place]))
    return said


def _tell(axes: Axes, dead: Equilibrium, number: int, words: list[str]) -> None:
    """Write beside a joint, beyond its extrados."""
    joint = dead.model.structure.joints[number]
    x, y = joint.tangent
    where = {"ha": "left" if x > 0.3 else "right" if x < -0.3 else "center"}
    where |= {"va": "bottom" if y > 0.3 else "top" if y < -0.3 else "center"}
    axes.annotate(
        "\n".join([joint.name, *words]), tuple(joint.ends[1]), (AWAY * x, AWAY * y),
        textcoords="offset points", fontsize=SMALL, color=INK, zorder=8, annotation_clip=False,
        arrowprops={"arrowstyle": "-", "color": EDGE, "lw": 0.7, "shrinkA": 0, "shrinkB": 1},
        path_effects=[withStroke(linewidth=2.0, foreground="white")], **where,
    )  # fmt: skip
