"""Pictures of vibration shapes."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.masonry.softness import yielding_blocks
from archfem.models.cells import Cells
from archfem.statics.modes import Modes
from archfem.view.marks import support_outlines
from archfem.view.style import (
    COLUMN,
    EDGE,
    FAINT,
    GHOST,
    INK,
    LONG,
    SMALL,
    SOIL,
    STONE,
    SUPPORT,
    WIDE,
    Page,
)

REACH = 0.04
"""Largest displacement in a picture, relative to the size of the structure."""

HIGHEST, HEADED, FOOT = 3.0, 0.45, 0.25
"""Largest height of a panel; height of its title and of the gap below it, and of what is said below
all [inch]."""


def draw_modes(modes: Modes, numbers: Sequence[int] | None = None) -> Figure:
    """Draw vibration shapes, magnified, over the outline at rest; soil is paler than stone.

    Args:
        modes: as found by `modes`.
        numbers: which of them, counted from 1; by default all.

    Returns:
        The page, with a panel for each shape.

    Raises:
        InvalidInput: a number is not among them.
    """
    figure, panels = mode_panels(modes, numbers)
    for panel in panels:
        panel.swing(1.0)
    return figure


def mode_panels(modes: Modes, numbers: Sequence[int] | None) -> tuple[Figure, list["Panel"]]:
    """Return a page of two columns, and its panels, one for each shape, not yet moved.

    Args:
        modes: as found by `modes`.
        numbers: which of them, counted from 1; None for all.

    Raises:
        InvalidInput: a number is not among them.
    """
    count = len(modes.frequencies)
    chosen = list(range(1, count + 1) if numbers is None else numbers)
    if not chosen or not set(chosen) <= set(range(1, count + 1)):
        raise InvalidInput(f"modes {chosen} cannot be drawn: there are 1 to {count}")
    low, high = _view(modes)
    wide, tall = high - low
    columns, rows = min(2, len(chosen)), -(-len(chosen) // 2)
    across = (COLUMN if wide < LONG * tall else WIDE) / 2.0
    up = min(across * tall / wide, HIGHEST) + HEADED
    figure = Page(figsize=(across * columns, up * rows + FOOT), layout="constrained")
    places = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in places:
        axes.set_axis_off()
    panels = []
    for axes, number in zip(places, chosen, strict=False):
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        panels.append(Panel(axes, modes, number))
    drawn = REACH * modes.model.structure.size
    words = f"largest displacement drawn as {drawn:.2g} m: shapes have no size of their own"
    figure.supxlabel(words, fontsize=SMALL, color=EDGE)
    return figure, panels


def _view(modes: Modes) -> tuple[Array, Array]:
    """Corners of what is seen: the structure, and room to swing."""
    structure = modes.model.structure
    points = np.concatenate([block.drawn() for block in structure.blocks])
    room = 1.1 * REACH * structure.size
    return points.min(axis=0) - room, points.max(axis=0) + room


class Panel:
    """One mode on its axes."""

    def __init__(self, axes: Axes, modes: Modes, number: int) -> None:
        model = modes.model
        cells, structure = model.cells, model.structure
        moves = cells.displacement(modes.shapes[:, number - 1])
        self._moves = moves * REACH * structure.size / np.linalg.norm(moves, axis=1).max()
        self._places = cells.places
        soil = yielding_blocks(structure)
        self._loops = sorted(_loops(cells), key=lambda loop: cells.block[loop[0]] not in soil)
        pale = [cells.block[loop[0]] in soil for loop in self._loops]
        rest = LineCollection(cells.places[cells.rims], colors=GHOST, linewidths=0.9, zorder=1)
        still = PolyCollection(
            support_outlines(model, 1.0), facecolors=SUPPORT, edgecolors=EDGE, linewidths=0.6
        )
        self._blocks = PolyCollection(
            [],
            facecolors=[SOIL if each else STONE for each in pale],
            edgecolors=[FAINT if each else EDGE for each in pale],
            linewidths=0.6,
            zorder=2,
        )
        for drawn in (rest, still, self._blocks):
            axes.add_collection(drawn, autolim=False)
        axes.set_title(_title(modes, number), fontsize=SMALL, color=INK)

    def swing(self, phase: float) -> None:
        """Move the blocks.

        Args:
            phase: of the swing, -1 to 1 at its ends and 0 at rest.
        """
        places = self._places + phase * self._moves
        self._blocks.set_verts([places[loop] for loop in self._loops])


def _loops(cells: Cells) -> list[list[int]]:
    """Points around each block, in order."""
    following, loops = dict(cells.rims.tolist()), []
    while following:
        start, point = following.popitem()
        loop = [start]
        while point != start:
            loop.append(point)
            point = following.pop(point)
        loops.append(loop)
    return loops


def _title(modes: Modes, number: int) -> str:
    frequency, (x, y) = modes.frequencies[number - 1], 100.0 * modes.mass_ratios[number - 1]
    return f"mode {number}: {frequency:.2f} Hz\nmass along x {x:.0f} %, along y {y:.0f} %"
