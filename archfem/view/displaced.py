"""A structure where its blocks have gone, with its thrust line there."""

from typing import cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from archfem.arrays import Array
from archfem.dynamics.history import History
from archfem.joints.criteria import Criteria
from archfem.models.model import Model
from archfem.models.moving import Moving
from archfem.statics.equilibrium import Equilibrium
from archfem.view.marks import joint_marks, round_magnification, support_outlines
from archfem.view.moved import carrier, fields_at
from archfem.view.states import drawn, joints_at
from archfem.view.structure import draw_marks, draw_structure, title_of
from archfem.view.style import (
    EDGE,
    GHOST,
    STONE,
    SUPPORT,
    canvas,
    entitle,
    legend,
    stand,
)


def draw_displaced(
    model: Model,
    q: Equilibrium | Array,
    *,
    joints: xr.Dataset | None = None,
    criteria: Criteria | None = None,
    magnification: float = 1.0,
    axes: Axes | None = None,
) -> Figure:
    """Draw the blocks where they are, over where they stood, and their joints there.

    Args:
        model: what stands.
        q: an equilibrium, or coordinates (n,).
        joints: at that instant, e.g. `run.joints.sel(time=…)`; by default as the model has them.
        criteria: what makes a joint fail; by default those of `joints`, or else the usual ones.
        magnification: of displacements [-]; by default they are true to scale, and those of stiff
            joints next to nothing.
        axes: where to draw; by default a new figure.

    Returns:
        The page; that of `axes` where given.

    Raises:
        InvalidInput: q or joints are another model's.
    """
    model, q = drawn(model, q)
    joints = joints_at(model, q, joints, criteria)
    structure, cells = model.structure, model.cells
    axes = canvas(structure).add_subplot() if axes is None else axes
    stand(axes, structure)
    places = cells.places + magnification * cells.displacement(q)
    still = LineCollection(list(cells.places[cells.rims]), colors=GHOST, linewidths=0.6, zorder=0)
    faces = [places[np.asarray(cell)] for cell in cells.polygons]
    stones = PolyCollection(faces, facecolors=STONE, edgecolors=STONE, linewidths=0.3, zorder=1)
    rims = LineCollection(list(places[cells.rims]), colors=EDGE, linewidths=0.7, zorder=2)
    supports = PolyCollection(
        support_outlines(model, magnification),
        facecolors=SUPPORT,
        edgecolors=EDGE,
        linewidths=0.7,
        zorder=1,
    )
    stones.set_gid("blocks")
    for drawing in (still, stones, rims, supports):
        axes.add_collection(drawing)
    draw_marks(axes, joint_marks(structure, joints, shift=magnification * carrier(model)(q)))
    legend(axes)
    scale = "" if magnification == 1.0 else f", displacements × {magnification:g}"
    entitle(axes, title_of(structure, joints) + scale)
    axes.autoscale_view()
    return cast(Figure, axes.figure)


def draw_during(model: Model, run: History, joints: xr.Dataset) -> Figure:
    """Draw an instant of a run: where displacements were kept, blocks where they have gone.

    They are magnified by a round number that shows them well, unless they may be large.

    Args:
        model: that made the run.
        run: with fields or without.
        joints: of it, at that instant.

    Returns:
        The page.
    """
    if "q" in run.dataset:
        q = fields_at(run, joints["time"].values[None])[0]
        most = float(np.abs(model.cells.displacement(q)).max())
        by = 1.0 if isinstance(model, Moving) else round_magnification(most / model.structure.size)
        return draw_displaced(model, q, joints=joints, magnification=by)
    return draw_structure(model.structure, joints)
