"""What the blocks in a film are coloured by, and on which scale."""

from dataclasses import dataclass

import numpy as np
from matplotlib.colors import Colormap

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.models.cells import Cells
from archfem.units import MPa, mm
from archfem.view.style import BEYOND, LIGHT_TO_DARK

COLOURS = ("displacement", "stress")
"""What blocks can be coloured by."""


@dataclass(frozen=True)
class Scale:
    """From a number to a colour.

    Attributes:
        colour: one of `COLOURS`.
        label: of the colour bar, with its unit.
        shades: from low to high.
        low: end of the scale.
        high: end of the scale.
        extend: at which end values beyond the scale occur, as colour bars call it.
    """

    colour: str
    label: str
    shades: Colormap
    low: float
    high: float
    extend: str


def check_colour(cells: Cells, colour: str) -> None:
    """Refuse what blocks cannot be coloured by.

    Args:
        cells: of the model, which know of stress or do not.
        colour: asked for.

    Raises:
        InvalidInput: the colour is not known, or rigid blocks are to show stress.
    """
    if colour not in COLOURS:
        raise InvalidInput(f"colour '{colour}' is not known: use one of {COLOURS}")
    if colour == "stress" and cells.stress is None:
        raise InvalidInput(
            "rigid blocks have no stress: use colour='displacement', or build and run the model "
            "with fidelity='full'"
        )


def shade(cells: Cells, q: Array, colour: str) -> Array:
    """What the blocks are coloured by.

    Args:
        cells: of the model.
        q: coordinates (n,).
        colour: "displacement", the length of it at every point [mm], or "stress", the least
            principal one of every cell, compression negative [MPa].

    Returns:
        A value for each point (n_points,), or for each cell (n_cells,).
    """
    if colour == "displacement":
        lengths: Array = np.linalg.norm(cells.displacement(q), axis=1)
        return lengths / mm
    assert cells.stress is not None, "checked by check_colour"
    across, up, shear = (cells.stress @ q).reshape(-1, 3).T / MPa
    least: Array = 0.5 * (across + up) - np.hypot(0.5 * (across - up), shear)
    return least


def scale_for(cells: Cells, fields: Array, colour: str) -> Scale:
    """Choose a scale that suits a whole film.

    Args:
        cells: of the model.
        fields: coordinates (frames, n).
        colour: one of `COLOURS`.

    Returns:
        From 0 to the largest displacement, or from nearly the least stress to 0.
    """
    found = np.array([shade(cells, q, colour) for q in fields])
    if colour == "displacement":
        highest = float(found.max()) or 1.0
        return Scale(colour, "displacement [mm]", LIGHT_TO_DARK, 0.0, highest, "neither")
    lowest = min(float(np.percentile(found, BEYOND)), -1e-6)
    label, shades = "least principal stress [MPa]", LIGHT_TO_DARK.reversed()
    return Scale(colour, label, shades, lowest, 0.0, "min")
