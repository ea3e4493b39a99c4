"""Properties that are constant over a film: magnification, visible region and colour scale."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from matplotlib.colors import Colormap, Normalize, PowerNorm

from archfem._typing import Array
from archfem._validation import check_between, check_choice
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.models.model import Cells, Model, check_coordinate_count
from archfem.statics.stress import principal_values
from archfem.units import MPa, mm
from archfem.view.joint_marks import round_magnification, support_outlines
from archfem.view.positions import FallingBlocks
from archfem.view.stress import Triangles
from archfem.view.style import CLIPPED_PERCENT, Colour


@dataclass(frozen=True)
class Scale:
    """Colour scale of the blocks."""

    colour: str  # "displacement" or "stress"
    label: str  # of the colour bar, with the unit
    shades: Colormap  # from low to high
    norm: Normalize  # from values to [0, 1]
    extend: str  # end at which values beyond the scale occur, as in matplotlib's colour bars


def check_film(
    model: Model, run: History, colour: str, magnification: float | None, size: tuple[int, int]
) -> None:
    """Refuse invalid options, a run without fields, and a run of another model."""
    check_options(model, colour, magnification, size)
    if "q" not in run.dataset:
        raise InvalidInput(
            "the run has no fields to draw: record them with "
            "time_history(..., record=Record(fields_every=10)), in a case with "
            "fields_every = 10 in [record]"
        )
    check_coordinate_count(model, run.dataset.sizes["coordinate"])


def check_options(
    model: Model, colour: str, magnification: float | None, size: tuple[int, int]
) -> None:
    """Refuse invalid options of a frame."""
    check_choice(colour, "colour", ("displacement", "stress"))
    if colour == "stress" and model.cells.stress is None:
        raise InvalidInput(
            "rigid blocks have no stress: use colour='displacement', or build and run the model "
            "with fidelity='full'"
        )
    if magnification is not None:
        check_between(magnification, "magnification", 0.0, 1e12)
    smallest = (480, 320)  # the texts do not fit into a smaller frame
    if len(size) != 2 or any(n % 2 or n < least for n, least in zip(size, smallest, strict=True)):
        raise InvalidInput(
            f"size {size}: give an even width and height of at least {smallest} pixels"
        )


def colour_values(cells: Cells, q: Array, colour: str) -> Array:
    """Return displacements of points [mm], or least principal stresses of cells [MPa]."""
    if colour == "displacement":
        return np.linalg.norm(cells.displacement(q), axis=1) / mm
    assert cells.stress is not None, "checked by check_options"
    return principal_values(*(cells.stress @ q).reshape(-1, 3).T / MPa)[1]


def fit_scale(cells: Cells, fields: Array, colour: str) -> Scale:
    """Return a colour scale for all fields of a film (frames, n)."""
    values = np.array([colour_values(cells, q, colour) for q in fields])
    if colour == "displacement":
        highest = float(values.max()) or 1.0
        return Scale(colour, "displacement [mm]", Colour.MAP, Normalize(0.0, highest), "neither")
    lowest = min(float(np.percentile(values, CLIPPED_PERCENT)), -1e-6)
    label, shades = "least principal stress [MPa]", Colour.MAP.reversed()
    return Scale(colour, label, shades, Normalize(lowest, 0.0), "min")


@dataclass(frozen=True, eq=False)
class Setup:
    """Properties that are constant over a film."""

    model: Model  # the model that is shown
    magnification: float  # of displacements [-]
    scale: Scale  # colour scale of the blocks
    low: Array  # lower left corner of the visible region (2,) [m]
    high: Array  # upper right corner of the visible region (2,) [m]
    outlines: tuple[Array, ...] = ()  # of blocks displaced by a mechanism, each (k, 2) [m]
    since: float = 0.0  # time from which they are shown [s]
    falls: FallingBlocks | None = None  # positions of loose blocks; None if no block came loose

    @cached_property
    def triangles(self) -> Triangles:
        """Triangulation of the blocks."""
        return Triangles(self.model.cells)

    @cached_property
    def supports(self) -> list[Array]:
        """Outlines of the fixed blocks, displaced, each (k, 2) [m]."""
        return support_outlines(self.model, self.magnification)

    @property
    def ground(self) -> Array | None:
        """Ends of the ground line (2, 2) [m]; None where it is not drawn."""
        if self.falls is None:
            return None
        return np.array([[self.low[0], self.falls.level], [self.high[0], self.falls.level]])

    @property
    def hinge_disc(self) -> Array:
        """Outline of the disc of a hinge about its centre (32, 2) [m]."""
        structure, angle = self.model.structure, np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
        # discs of shallow joints must not cover their blocks
        shallowest = float(structure.depths[structure.judged].min())
        radius = min(0.0125 * structure.size, 0.3 * shallowest)
        return radius * np.column_stack([np.cos(angle), np.sin(angle)])

    @classmethod
    def of(cls, model: Model, fields: Array, colour: str, magnification: float | None) -> Self:
        """Return the properties for all frames; by default, magnify by a suitable factor."""
        cells, structure = model.cells, model.structure
        displacements = np.array([cells.displacement(q) for q in fields])
        if magnification is None:
            largest = float(np.abs(displacements).max()) / structure.size
            magnification = 1.0 if model.large_displacements else round_magnification(largest)
        supports = support_outlines(model, magnification)
        moved = cells.places + magnification * displacements
        points = np.concatenate([*supports, cells.places, moved.min(axis=0), moved.max(axis=0)])
        margin = 0.02 * structure.size
        low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
        return cls(model, magnification, fit_scale(cells, fields, colour), low, high)

    def with_outlines(self, outlines: list[Array], since: float) -> Self:
        """Return a copy with outlines of displaced blocks, and room for them."""
        points = np.concatenate([[self.low, self.high], *outlines])
        low, high = points.min(axis=0), points.max(axis=0)
        return replace(self, low=low, high=high, outlines=tuple(outlines), since=since)

    def with_falls(self, falls: FallingBlocks | None) -> Self:
        """Return a copy with room for loose blocks, up to one structure's size, and the ground."""
        if falls is None:
            return self
        size, cells = self.model.structure.size, self.model.cells
        moved = (falls.places(cells.places, cells.block, float(time)) for time in falls.times)
        places = np.array(list(moved))
        grains = (each for time in falls.times for each in falls.grain_outlines(float(time)))
        points = np.concatenate([*places, *grains, [self.low, self.high]])
        low = np.maximum(points.min(axis=0), self.low - size)
        high = np.minimum(points.max(axis=0), self.high + size)
        low[1] = min(low[1], falls.level - 0.02 * size)
        scale = self.scale
        if scale.colour == "displacement":
            lengths = np.linalg.norm(places - cells.places, axis=2) / mm
            visible = ((places >= low) & (places <= high)).all(axis=2)
            largest = float(lengths.max(where=visible, initial=scale.norm.vmax or 0.0))
            # a fall is some ten times the motion before it; square roots show both
            extend = "max" if lengths.max() > largest else "neither"
            scale = replace(scale, norm=PowerNorm(0.5, 0.0, largest), extend=extend)
        return replace(self, low=low, high=high, scale=scale, falls=falls)


def polygon_sides(outlines: Sequence[Array]) -> Array:
    """Return the sides of polygons, each (k, 2), one after another (sides, 2, 2)."""
    sides = [np.stack([each, np.roll(each, -1, axis=0)], axis=1) for each in outlines]
    return np.concatenate([np.zeros((0, 2, 2)), *sides])
