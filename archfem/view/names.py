"""Which joint is which: names of joints in pictures, and a picture of nothing else."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from archfem.arrays import Array
from archfem.masonry.structure import Joint, Structure
from archfem.view.structure import draw_blocks
from archfem.view.style import INK, SLIP, SMALL, canvas, entitle, scale_of, stand

TINY = 4.5
"""Smallest size of type that can be read on paper [points]."""

POINT = 1.0 / 72.0
"""A point of type [inch]."""

TIGHT = 0.65
"""Size of type, relative to the distance of two names."""

STEEP = 91.0
"""Angle from which a name would stand on its head [°]; upright ones are read from the right."""

ROOM = 0.1, 0.15
"""Beside and below the blocks, for names, relative to the size of the structure."""

NAME = 0.4
"""Room beside the blocks at least [inch]."""

APART = 0.5
"""Space between the name of a joint and its end, relative to the size of its type."""


def short_name(name: str, part: str) -> str:
    """Return what tells a joint from others of its part: "5" of "main arch, joint 5".

    Args:
        name: of the joint.
        part: to which it belongs.
    """
    own = name.removeprefix(f"{part}, ")
    return own.removeprefix("joint ") or own


def draw_names(structure: Structure) -> Figure:
    """Draw the blocks, with the short name of each joint beside its intrados.

    Joints of rings and piers have one, or all where there are neither; what comes before, the
    name of the part, stands in its midst. "5" in "main arch" is "main arch, joint 5".

    Args:
        structure: whose joints are named.

    Returns:
        The page.
    """
    page = canvas(structure)
    axes = page.add_subplot()
    stand(axes, structure)
    draw_blocks(axes, structure)
    shown = [joint for joint, own in zip(structure.joints, structure.judged, strict=True) if own]
    inch = 1.0 / scale_of(structure)
    wide = float(np.ptp(np.concatenate([block.drawn()[:, 0] for block in structure.blocks])))
    axes.margins(max(ROOM[0], NAME * inch / wide), ROOM[1])
    axes.autoscale_view()
    for joint in shown:
        axes.plot(*joint.ends.T, color=SLIP, lw=1.0, zorder=4)
    for part in dict.fromkeys(joint.part for joint in shown):
        _name_part(axes, [joint for joint in shown if joint.part == part], inch)
    example = shown[len(shown) // 2].name
    title = f"{structure.name}: names of joints, such as '{example}'"
    entitle(axes, title)
    return page


def _name_part(axes: Axes, joints: Sequence[Joint], inch: float) -> None:
    """Name the joints of a part, each in line with itself, in type for which there is room."""
    ends = np.array([joint.ends[0] for joint in joints])
    apart = np.linalg.norm(np.diff(ends, axis=0), axis=1).min() if len(ends) > 1 else np.inf
    size = float(np.clip(TIGHT * apart / (inch * POINT), TINY, SMALL))
    for joint in joints:
        x, y = -joint.tangent
        angle = float(np.degrees(np.arctan2(y, x)))
        leftward = abs(angle) > STEEP
        style = {"rotation": angle - 180.0 * leftward, "rotation_mode": "anchor"}
        style |= {"ha": "right" if leftward else "left", "va": "center_baseline"}
        words, away = short_name(joint.name, joint.part), (APART * size * x, APART * size * y)
        _write(axes, words, joint.ends[0], away, fontsize=size, **style)
    if not joints[0].name.startswith(f"{joints[0].part}, "):
        return
    place, where = ends.mean(axis=0), "center"
    if joints[0].role != "ring":
        place, where = min((joint.middle for joint in joints), key=lambda middle: middle[1]), "top"
    below = (0.0, -1.4 * SMALL)
    _write(axes, joints[0].part, place, below, fontsize=SMALL, ha="center", va=where)


def _write(axes: Axes, words: str, place: Array, away: tuple[float, float], **style: Any) -> None:
    """Write words near a place, away from it by so many points."""
    axes.annotate(
        words, tuple(place), away, textcoords="offset points", color=INK, zorder=8,
        path_effects=[withStroke(linewidth=1.6, foreground="white")], **style,
    )  # fmt: skip
