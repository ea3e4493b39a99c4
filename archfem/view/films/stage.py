"""A structure drawn at an instant: what never moves once, everything else for each picture."""

from collections.abc import Sequence

import numpy as np

from archfem.arrays import Array
from archfem.masonry.structure import Structure
from archfem.view.films.pen import Pen
from archfem.view.films.setup import Setup
from archfem.view.films.shots import Shot
from archfem.view.films.triangles import Triangles
from archfem.view.marks import support_outlines
from archfem.view.style import EDGE, GHOST, HINGE, MOVED, SLIP, SUPPORT, THRUST

DISC = 0.0125
"""Radius of a hinge in a picture, relative to the size of the structure."""

SNUG = 0.3
"""The same at most, relative to the depth of the shallowest joint that is drawn."""

TURN = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
CIRCLE = np.column_stack([np.cos(TURN), np.sin(TURN)])


class Stage:
    """Blocks, supports and marks, drawn with a pen from the lowest layer to the uppermost.

    Args:
        setup: what stays the same.
        pen: that draws.
    """

    def __init__(self, setup: Setup, pen: Pen) -> None:
        self._setup, self._pen = setup, pen
        cells = setup.model.cells
        self._triangles = Triangles(cells)
        self._rims = cells.rims
        self._disc = _disc(setup.model.structure)
        self._supports = support_outlines(setup.model, setup.magnification)
        self._edges = _around(self._supports)

    def still(self) -> None:
        """Draw what lies below the blocks and never moves: ground, supports, where blocks stood."""
        if self._setup.ground is not None:
            self._pen.lines(self._setup.ground[None], EDGE, 2.0)
        self._pen.lines(self._setup.model.cells.places[self._rims], GHOST, 1.0)
        for outline in self._supports:
            self._pen.fill(outline[None], SUPPORT)

    def draw(self, shot: Shot) -> None:
        """Draw what a picture shows.

        Args:
            shot: blocks and marks at an instant.
        """
        pen, marks = self._pen, shot.marks
        pen.shade(self._triangles.corners(shot.places), self._colours(shot.shades))
        pen.lines(np.concatenate([shot.places[self._rims], self._edges]), EDGE, 1.2)
        pen.lines(_around(shot.outlines), MOVED, 3.0)
        self._discs(shot.past, HINGE, 1.0, 0.3)
        pen.lines(marks.links, "white", 6.0)
        pen.lines(marks.links, THRUST, 3.0)
        self._discs(marks.thrust[np.isfinite(marks.thrust[:, 0])], THRUST, 0.35)
        pen.fill(marks.slips, SLIP)
        self._discs(marks.hinges, "white", 1.25)
        self._discs(marks.hinges, HINGE, 1.0)

    def _colours(self, shades: Array) -> Array:
        """Colours at the corners of the triangles (t, 3, 4), from values by point or by cell."""
        scale, own = self._setup.scale, self._triangles
        if scale.colour == "stress":
            values = np.repeat(shades[own.cell][:, None], 3, axis=1)
        else:
            values = own.corners(shades)
        found: Array = scale.shades((values - scale.low) / (scale.high - scale.low))
        return found

    def _discs(self, centres: Array, colour: str, size: float, opacity: float = 1.0) -> None:
        """Draw discs about points (n, 2), of a size relative to a hinge's."""
        self._pen.fill(centres[:, None] + size * self._disc * CIRCLE, colour, opacity)


def _disc(structure: Structure) -> float:
    """Radius of a hinge [m]."""
    depths = structure.depths[structure.judged]
    return min(DISC * structure.size, SNUG * float(depths.min()))


def _around(outlines: Sequence[Array]) -> Array:
    """Sides of polygons, each (k, 2), one after another (sides, 2, 2)."""
    sides = [np.stack([each, np.roll(each, -1, axis=0)], axis=1) for each in outlines]
    return np.concatenate([np.zeros((0, 2, 2)), *sides])
