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
from archfem.view.marks import joint_marks, support_outlines
from archfem.view.moved import carrier, fields_at
from archfem.view.states import drawn, joints_at
from archfem.view.structure import draw_marks, draw_structure, title_of
from archfem.view.style import EDGE, GHOST, INK, NORMAL, STONE, SUPPORT, canvas, dress, legend


def draw_displaced(
    model: Model,
    q: Equilibrium | Array,
    *,
    joints: xr.Dataset | None = None,
    criteria: Criteria | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Draw the blocks where they are, true to scale, over where they stood, and their joints there.

    What is seen of small displacements is next to nothing: `picture` magnifies them.

    Args:
        model: what stands.
        q: an equilibrium, or coordinates (n,).
        joints: at that instant, e.g. `run.joints.sel(time=…)`; by default as the model has them.
        criteria: what makes a joint fail; by default those of `joints`, or else the usual ones.
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
    dress(axes, "x [m]", "y [m]")
    axes.set_aspect("equal")
    places = cells.places + cells.displacement(q)
    still = LineCollection(list(cells.places[cells.rims]), colors=GHOST, linewidths=0.6, zorder=0)
    faces = [places[np.asarray(cell)] for cell in cells.polygons]
    stones = PolyCollection(faces, facecolors=STONE, edgecolors=STONE, linewidths=0.3, zorder=1)
    rims = LineCollection(list(places[cells.rims]), colors=EDGE, linewidths=0.7, zorder=2)
    supports = PolyCollection(
        support_outlines(model, 1.0), facecolors=SUPPORT, edgecolors=EDGE, linewidths=0.7, zorder=1
    )
    stones.set_gid("blocks")
    for drawing in (still, stones, rims, supports):
        axes.add_collection(drawing)
    draw_marks(axes, joint_marks(structure, joints, shift=carrier(model)(q)))
    legend(axes)
    axes.set_title(title_of(structure, joints), fontsize=NORMAL, color=INK)
    axes.autoscale_view()
    return cast(Figure, axes.figure)


def draw_during(model: Model, run: History, joints: xr.Dataset) -> Figure:
    """Draw an instant of a run: where displacements may be large and were kept, blocks as they are.

    Args:
        model: that made the run.
        run: with fields or without.
        joints: of it, at that instant.

    Returns:
        The page.
    """
    if isinstance(model, Moving) and "q" in run.dataset:
        q = fields_at(run, joints["time"].values[None])[0]
        return draw_displaced(model, q, joints=joints)
    return draw_structure(model.structure, joints)
