"""What stays the same over a film: whose it is, how much is magnified, and what is seen.

What the blocks in a film are coloured by, and on which scale.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from matplotlib.colors import Colormap

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.models.model import Cells, Model
from archfem.units import MPa, mm
from archfem.view.joint_marks import round_magnification, support_outlines
from archfem.view.positions import FallingBlocks
from archfem.view.style import BEYOND, LIGHT_TO_DARK

# What blocks can be coloured by
COLOURS = ("displacement", "stress")


@dataclass(frozen=True)
class Scale:
    """From a number to a colour."""

    colour: str  # one of `COLOURS`
    label: str  # of the colour bar, with its unit
    shades: Colormap  # from low to high
    low: float  # end of the scale
    high: float  # end of the scale
    extend: str  # at which end values beyond the scale occur, as colour bars call it


def check_colour(cells: Cells, colour: str) -> None:
    """Refuse what blocks cannot be coloured by."""
    if colour not in COLOURS:
        raise InvalidInput(f"colour '{colour}' is not known: use one of {COLOURS}")
    if colour == "stress" and cells.stress is None:
        raise InvalidInput(
            "rigid blocks have no stress: use colour='displacement', or build and run the model "
            "with fidelity='full'"
        )


def shade(cells: Cells, q: Array, colour: str) -> Array:
    """What the blocks are coloured by."""
    if colour == "displacement":
        lengths: Array = np.linalg.norm(cells.displacement(q), axis=1)
        return lengths / mm
    assert cells.stress is not None, "checked by check_colour"
    across, up, shear = (cells.stress @ q).reshape(-1, 3).T / MPa
    return 0.5 * (across + up) - np.hypot(0.5 * (across - up), shear)


def scale_for(cells: Cells, fields: Array, colour: str) -> Scale:
    """Choose a scale that suits a whole film."""
    found = np.array([shade(cells, q, colour) for q in fields])
    if colour == "displacement":
        highest = float(found.max()) or 1.0
        return Scale(colour, "displacement [mm]", LIGHT_TO_DARK, 0.0, highest, "neither")
    lowest = min(float(np.percentile(found, BEYOND)), -1e-6)
    label, shades = "least principal stress [MPa]", LIGHT_TO_DARK.reversed()
    return Scale(colour, label, shades, lowest, 0.0, "min")


# Room around the structure, relative to its size
MARGIN = 0.02


@dataclass(frozen=True, eq=False)
class Setup:
    """What stays the same over a whole film."""

    model: Model  # what is filmed
    magnification: float  # of its displacements [-]
    scale: Scale  # from a number to a colour
    low: Array  # lower left corner of what is seen (2,) [m]
    high: Array  # upper right corner of what is seen (2,) [m]
    outlines: tuple[Array, ...] = ()  # of blocks as a mechanism moves them, each (k, 2) [m]
    since: float = 0.0  # when they are first shown [s]
    level: float | None = None  # of the ground that blocks may fall to [m]; None where none fall

    @property
    def ground(self) -> Array | None:
        """Ends of the ground's line (2, 2) [m]; None where it is not drawn."""
        if self.level is None:
            return None
        return np.array([[self.low[0], self.level], [self.high[0], self.level]])

    @classmethod
    def of(cls, model: Model, fields: Array, colour: str, magnification: float | None) -> Self:
        """Choose a scale, a magnification where none is given, and a view that fits all frames."""
        cells, structure = model.cells, model.structure
        moves = np.array([cells.displacement(q) for q in fields])
        size = float(np.abs(moves).max()) / structure.size
        by = magnification or (1.0 if model.large_displacements else round_magnification(size))
        still = support_outlines(model, by)
        moved = cells.places + by * moves
        points = np.concatenate([*still, cells.places, moved.min(axis=0), moved.max(axis=0)])
        room = MARGIN * structure.size
        scale = scale_for(cells, fields, colour)
        return cls(model, by, scale, points.min(axis=0) - room, points.max(axis=0) + room)

    def with_outlines(self, outlines: list[Array], since: float) -> Self:
        """Return the same with outlines of blocks, and room for them."""
        points = np.concatenate([[self.low, self.high], *outlines])
        low, high = points.min(axis=0), points.max(axis=0)
        return replace(self, low=low, high=high, outlines=tuple(outlines), since=since)

    def with_falls(self, falls: FallingBlocks | None) -> Self:
        """Return the same with room for blocks that come loose, and the ground below them.

        Blocks that go farther than the structure is large are not followed.
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
