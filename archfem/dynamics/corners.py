"""Displacements of the corners of the blocks, kept beside the coordinates of a run."""

import numpy as np
import xarray as xr

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.models.model import Model


def corner_displacements(model: Model, fields: Array) -> xr.Dataset:
    """Return how far the corners of the blocks that move have gone.

    Args:
        model: whose blocks.
        fields: coordinates (frames, n).

    Returns:
        `displacement` over frame, corner and axis [m], with the name of each corner's block and its
        place as built, `corner_x` and `corner_y` [m], as coordinates.
    """
    structure, cells = model.structure, model.cells
    points, names = [], []
    for number in structure.free:
        block = structure.blocks[number]
        own = np.flatnonzero(cells.block == number)
        for corner in block.points:
            points.append(own[np.linalg.norm(cells.places[own] - corner, axis=1).argmin()])
            names.append(block.name)
    moved = np.array([cells.displacement(q)[points] for q in fields])
    x, y = cells.places[points].T
    return xr.Dataset(
        {"displacement": (("frame", "corner", "axis"), moved, {"units": "m"})},
        {
            "corner_block": ("corner", names),
            "corner_x": ("corner", x, {"units": "m"}),
            "corner_y": ("corner", y, {"units": "m"}),
            "axis": ["x", "y"],
        },
    )


def displacement_of(dataset: xr.Dataset) -> xr.DataArray:
    """Return the displacements of the corners of the blocks that a run kept beside its fields.

    Args:
        dataset: of the run.

    Returns:
        Over time, point and xy [m]; coordinates tell each point's `block`, and where it was built,
        `x` and `y` [m].

    Raises:
        InvalidInput: no fields were recorded, or by a version that did not keep these.
    """
    if "displacement" not in dataset:
        raise InvalidInput(
            "the run has no displacements of points: record fields with "
            "time_history(..., record=Record(fields_every=10)), or run it again"
        )
    kept = {"corner_block": "block", "corner_x": "x", "corner_y": "y"}
    found = dataset["displacement"].drop_vars("frame_time", errors="ignore")
    found = found.rename({"frame": "time", "corner": "point", "axis": "xy", **kept})
    return found.assign_coords(time=("time", dataset["frame_time"].values, {"units": "s"}))
