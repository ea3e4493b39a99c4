"""Live loads, drawn as arrows with their sizes."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from archfem.arrays import Array
from archfem.masonry.actions import BodyForce, PointLoad, Settlement
from archfem.masonry.structure import Structure
from archfem.view.style import LOAD, SMALL

REACH, AWAY = 0.11, 0.04
"""Length of an arrow, and its distance from the structure, relative to the structure's size."""

Action = BodyForce | PointLoad | Settlement


def draw_loads(
    axes: Axes, structure: Structure, live: Sequence[Action], *, of: str = "λ ×"
) -> None:
    """Draw live loads: where they act, which way, and how large they are.

    A load in proportion to the weights is one arrow beside the structure, at its height; a force
    stands on the extrados; a movement of a support begins at it.

    Args:
        axes: to draw into.
        structure: that they act on.
        live: the loads.
        of: what they are multiplied by, in words.
    """
    for number, action in enumerate(live):
        start, way, words = _arrow(structure, action)
        tip = start + REACH * structure.size * way
        axes.annotate(
            "", tuple(tip), tuple(start), zorder=9,
            arrowprops={"arrowstyle": "-|>", "color": LOAD, "lw": 2.2, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
        room = [start, tip, start + np.array([0.0, AWAY * structure.size])]
        axes.update_datalim(np.array(room))
        if not number:
            axes.plot([], [], color=LOAD, lw=2.2, marker=">", ms=5, label="live load")
        away = (0, 5) if way[1] < 0.5 or abs(way[0]) > 0.5 else (6, 0)
        where = start if way[1] < -0.5 else 0.5 * (start + tip)
        axes.annotate(
            f"{of} {words}".strip(), tuple(where), away, textcoords="offset points", ha="center",
            va="bottom", fontsize=SMALL, color=LOAD, zorder=9,
        )  # fmt: skip
    axes.autoscale_view()


def _arrow(structure: Structure, action: Action) -> tuple[Array, Array, str]:
    """Where an arrow begins (2,) [m], its direction (2,), and what stands beside it."""
    if isinstance(action, BodyForce):
        size = np.array([action.horizontal, action.vertical])
        way = size / np.linalg.norm(size)
        points = np.concatenate([block.drawn() for block in structure.blocks])
        low, high = points.min(axis=0), points.max(axis=0)
        start = np.array([0.5 * (low[0] + high[0]), high[1] + 2.0 * AWAY * structure.size])
        start -= 0.5 * REACH * structure.size * way * [1.0, 0.0]
        share = float(np.linalg.norm(size))
        return start, way, "weight" if share == 1.0 else f"{share:.3g} weight"
    if isinstance(action, PointLoad):
        force = np.array(action.force)
        way = force / np.linalg.norm(force)
        place = action.place(structure)[1]
        return place - REACH * structure.size * way, way, f"{np.linalg.norm(force) / 1e3:.3g} kN"
    motion = np.array(action.motion)
    block = structure.blocks[action.place(structure)]
    start = np.array(block.centroid)
    if not motion[:2].any():
        return start, np.array([0.0, 1.0]), f"turn of the support by {motion[2]:.3g} rad"
    way = motion[:2] / np.linalg.norm(motion[:2])
    return start, way, f"movement of the support by {np.linalg.norm(motion[:2]):.3g} m"
