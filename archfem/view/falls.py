"""The picture of a fall: where the blocks are, from the joint that lets go to the ground."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.view.moved import Falls
from archfem.view.style import EDGE, GHOST, INK, NORMAL, STONE, SUPPORT, Page, canvas, dress

SHARES = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Of the way down, by the mean of all blocks, at which they are drawn."""


def draw_fall(run: History) -> Figure:
    """Draw the blocks of a structure at four instants of its fall, over where they stood.

    Args:
        run: in which blocks came loose, and which knows its structure.

    Returns:
        The page, a panel for each instant.

    Raises:
        InvalidInput: the run does not know its structure, or nothing came loose.
    """
    falls = None if run.structure is None else Falls.of(run.structure, run)
    if falls is None:
        raise InvalidInput(
            "there is no fall to draw: no block came loose, displacements were taken as small, or "
            "the run does not know its structure; read it with History.read(path, structure)"
        )
    wide, high = canvas(falls.structure).get_size_inches()
    figure = Page(figsize=(1.5 * wide, 1.35 * high), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    for axes, time in zip(panels, _instants(falls), strict=True):
        _panel(axes, falls, time)
    return figure


def _instants(falls: Falls) -> list[float]:
    """Times of the instants that are drawn [s]."""
    sunk = -falls.poses[:, list(falls.structure.free), 1].mean(axis=1)
    way = np.maximum.accumulate(sunk - sunk[0])
    first = [int(np.argmax(way >= share * way[-1])) for share in SHARES[:-1]]
    return [float(falls.times[k]) for k in (*first, -1)]


def _panel(axes: Axes, falls: Falls, time: float) -> None:
    """Draw one instant."""
    blocks = falls.structure.blocks
    dress(axes, "x [m]", "y [m]")
    axes.set_aspect("equal")
    axes.axhline(falls.level, color=EDGE, lw=1.2, zorder=0)
    built = [block.drawn() for block in blocks]
    axes.add_collection(
        PolyCollection(built, facecolors="none", edgecolors=GHOST, linewidths=0.6, zorder=1)
    )
    faces = [SUPPORT if block.fixed else STONE for block in blocks]
    moved = PolyCollection(
        falls.outlines(time), facecolors=faces, edgecolors=EDGE, linewidths=0.7, zorder=2
    )
    moved.set_gid("blocks")
    axes.add_collection(moved)
    axes.set_title(f"t = {time:.2f} s", fontsize=NORMAL, color=INK)
    axes.autoscale_view()
    axes.label_outer()
