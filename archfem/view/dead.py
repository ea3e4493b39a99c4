"""The dead load in one picture: thrust lines, and what is largest and least in numbers."""

from string import ascii_lowercase
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archfem.joints.criteria import Criteria, judged
from archfem.statics.equilibrium import Equilibrium
from archfem.view.structure import draw_structure
from archfem.view.style import INK, LETTER, NORMAL, SMALL, SYMBOL, entitle, renew_legend

AWAY = 9.0
"""Distance of a letter from the joint that it is about [points]."""


def draw_dead_load(dead: Equilibrium, *, criteria: Criteria | None = None) -> Figure:
    """Draw a structure under its dead load: its thrust lines, and numbers at the joints.

    Letters mark those joints of rings and piers that have the largest and the least N, the largest
    |e| and the largest V / N; below stand their numbers, and in the title weight and span of N.

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
        f"{structure.name}: dead load, weight {structure.weight / 1e3:.4g} kN, "
        f"N from {normal.min():.3g} to {normal.max():.3g} kN",
    )
    for letter, (number, words) in zip(ascii_lowercase, _telling(dead).items(), strict=False):
        _tell(axes, dead, number, letter=letter, words=words)
    renew_legend(figure)
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


def _tell(axes: Axes, dead: Equilibrium, number: int, *, letter: str, words: list[str]) -> None:
    """Put a letter beside a joint, beyond its extrados, and what it stands for into the legend."""
    joint = dead.model.structure.joints[number]
    axes.annotate(
        letter, tuple(joint.ends[1]), tuple(AWAY * joint.tangent), textcoords="offset points",
        fontsize=NORMAL, fontweight="bold", color=INK, zorder=8, ha="center", va="center",
    )  # fmt: skip
    letters = int((axes.figure.get_figwidth() - SYMBOL) / (LETTER * SMALL))
    label = fill(f"{joint.name}: {', '.join(words)}", letters)
    axes.plot([], [], ls="", marker=f"${letter}$", color=INK, ms=5, mew=0.4, label=label)
