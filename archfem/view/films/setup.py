"""What stays the same over a film: whose it is, how much is magnified, and what is seen."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from archfem.arrays import Array
from archfem.models.model import Model
from archfem.models.moving import Moving
from archfem.view.films.colours import Scale, scale_for
from archfem.view.marks import round_magnification, support_outlines
from archfem.view.moved import Falls

MARGIN = 0.02
"""Room around the structure, relative to its size."""


@dataclass(frozen=True, eq=False)
class Setup:
    """What stays the same over a whole film.

    Attributes:
        model: what is filmed.
        magnification: of its displacements [-].
        scale: from a number to a colour.
        low: lower left corner of what is seen (2,) [m].
        high: upper right corner of what is seen (2,) [m].
        outlines: of blocks as a mechanism moves them, each (k, 2) [m].
        since: when they are first shown [s].
        level: of the ground that blocks may fall to [m]; None where none fall.
    """

    model: Model
    magnification: float
    scale: Scale
    low: Array
    high: Array
    outlines: tuple[Array, ...] = ()
    since: float = 0.0
    level: float | None = None

    @property
    def ground(self) -> Array | None:
        """Ends of the ground's line (2, 2) [m]; None where it is not drawn."""
        if self.level is None:
            return None
        return np.array([[self.low[0], self.level], [self.high[0], self.level]])

    @classmethod
    def of(cls, model: Model, fields: Array, colour: str, magnification: float | None) -> Self:
        """Choose a scale, a magnification where none is given, and a view that fits all frames.

        Args:
            model: what is filmed.
            fields: coordinates (frames, n).
            colour: one of `COLOURS`.
            magnification: of displacements, or None.

        Returns:
            What stays the same over these frames, as yet without a mechanism.
        """
        cells, structure = model.cells, model.structure
        moves = np.array([cells.displacement(q) for q in fields])
        size = float(np.abs(moves).max()) / structure.size
        by = magnification or (1.0 if isinstance(model, Moving) else round_magnification(size))
        still = support_outlines(model, by)
        moved = cells.places + by * moves
        points = np.concatenate([*still, cells.places, moved.min(axis=0), moved.max(axis=0)])
        room = MARGIN * structure.size
        scale = scale_for(cells, fields, colour)
        return cls(model, by, scale, points.min(axis=0) - room, points.max(axis=0) + room)

    def with_outlines(self, outlines: list[Array], since: float) -> Self:
        """Return the same with outlines of blocks, and room for them.

        Args:
            outlines: as a mechanism moves them, each (k, 2) [m].
            since: when they are first shown [s].
        """
        points = np.concatenate([[self.low, self.high], *outlines])
        low, high = points.min(axis=0), points.max(axis=0)
        return replace(self, low=low, high=high, outlines=tuple(outlines), since=since)

    def with_falls(self, falls: Falls | None) -> Self:
        """Return the same with room for blocks that come loose, and the ground below them.

        Blocks that go farther than the structure is large are not followed.

        Args:
            falls: where those blocks are; None where none come loose.
        """
        if falls is None:
            return self
        size, cells = self.model.structure.size, self.model.cells
        seen = [falls.places(cells.places, cells.block, float(time)) for time in falls.times]
        points = np.concatenate([*seen, [self.low, self.high]])
        low = np.maximum(points.min(axis=0), self.low - size)
        high = np.minimum(points.max(axis=0), self.high + size)
        low[1] = min(low[1], falls.level - MARGIN * size)
        scale = replace(self.scale, extend="max") if self.scale.extend == "neither" else self.scale
        return replace(self, low=low, high=high, scale=scale, level=falls.level)
