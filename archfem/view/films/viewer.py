"""pyvista's own viewer of a run: a window to zoom and pan in, with a slider over time."""

import os
import sys
from typing import Any

import numpy as np
import pyvista as pv

from archfem._optional import check_drawing
from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.models.model import Model
from archfem.view.films.film import check_film
from archfem.view.films.frames import Frame, moving
from archfem.view.films.renderer import Triangles
from archfem.view.films.settings import Setup
from archfem.view.joint_marks import support_outlines
from archfem.view.positions import fields_at, kept_fields
from archfem.view.style import EDGE, GHOST, HINGE, SUPPORT, THRUST

# The look of the scale of colours
BAR = {"title_font_size": 14, "label_font_size": 12, "color": EDGE, "fmt": "%.3g", "n_labels": 2}

# Place and look of the slider
SLIDER = {"pointa": (0.2, 0.92), "pointb": (0.8, 0.92), "title_height": 0.02, "color": EDGE}


class Viewer:
    """A run in pyvista's viewer; `show()` opens it, in a window or in a notebook.

    Attributes:
        plotter: pyvista's, for a user to add what else is to be seen.
    """

    def __init__(self, setup: Setup, run: History) -> None:
        check_drawing()
        if sys.platform == "linux" and not os.environ.get("DISPLAY"):
            os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        self._setup, self._run = setup, run
        self._triangles = Triangles(setup.model.cells)
        self._blocks = pv.PolyData()
        self.plotter = pv.Plotter(off_screen=not os.environ.get("DISPLAY"))
        self._build()
        times = kept_fields(run)[0]
        self.at(float(times[0]))
        self.plotter.add_slider_widget(
            self.at, (times[0], times[-1]), value=times[0], title="time [s]", **SLIDER
        )
        self.plotter.view_xy()  # type: ignore[call-arg]
        self.plotter.enable_parallel_projection()  # type: ignore[call-arg]

    def show(self, **options: Any) -> Any:
        """Open the viewer.

        Args:
            options: of `pyvista.Plotter.show`, for example `jupyter_backend` or `screenshot`.

        Returns:
            What pyvista returns: a widget in a notebook, else nothing or a picture.
        """
        return self.plotter.show(**options)

    def at(self, time: float) -> None:
        """Show the run at a time, between kept displacements straight.

        Args:
            time: from the first to the last that was kept [s].
        """
        when = np.array([time])
        shot = next(moving(self._setup, self._run, when, fields_at(self._run, when)))
        self._blocks.points = self._flat(self._triangles.corners(shot.places).reshape(-1, 2), 0)
        self._blocks["shade"] = self._shades(shot)
        edges = shot.places[self._setup.model.cells.outline_edges]
        for layer, (name, ends) in enumerate({"edges": edges, "thrust": shot.marks.links}.items()):
            self._moved[name].dataset = _lines(self._flat(ends.reshape(-1, 2), layer + 1))
        self._moved["hinges"].dataset = pv.PolyData(self._flat(shot.marks.hinges, 3))
        self.plotter.render()

    def _build(self) -> None:
        """Put everything before the camera, as it was built."""
        setup, plotter, cells = self._setup, self.plotter, self._setup.model.cells
        plotter.set_background("white")
        corners = self._triangles.corners(cells.places).reshape(-1, 2)
        self._blocks.copy_from(
            pv.PolyData.from_regular_faces(
                self._flat(corners, 0), np.arange(len(corners)).reshape(-1, 3)
            )
        )
        self._blocks["shade"] = np.zeros(len(corners))
        plotter.add_mesh(
            self._blocks,
            scalars="shade",
            cmap=setup.scale.shades,
            clim=(setup.scale.low, setup.scale.high),
            lighting=False,
            scalar_bar_args=BAR | {"title": setup.scale.label},
        )
        for outline in support_outlines(setup.model, setup.magnification):
            self._add(_polygon(self._flat(outline, 0)), SUPPORT)
        self._add(_lines(self._flat(cells.places[cells.outline_edges].reshape(-1, 2), -1)), GHOST)
        self._moved = {
            "edges": self._add(pv.PolyData(), EDGE, 1.5),
            "thrust": self._add(pv.PolyData(), THRUST, 3.0),
            "hinges": self._add(pv.PolyData(), HINGE, 14.0),
        }

    def _add(self, mesh: pv.PolyData, colour: str, width: float = 1.0) -> pv.DataSetMapper:
        """Add a mesh, which may be empty, in one flat colour; lines and points of a width."""
        mapper = pv.DataSetMapper(mesh)
        actor = pv.Actor(mapper=mapper)
        actor.prop.color, actor.prop.lighting = colour, False
        actor.prop.line_width = actor.prop.point_size = width
        actor.prop.render_points_as_spheres = True
        self.plotter.add_actor(actor, render=False)
        return mapper

    def _shades(self, shot: Frame) -> Array:
        """What the corners of the triangles are coloured by."""
        if self._setup.scale.colour == "stress":
            return np.repeat(shot.shades[self._triangles.cell], 3)
        return self._triangles.corners(shot.shades).ravel()

    def _flat(self, points: Array, layer: int) -> Array:
        """Points of the plane, in a layer of the picture (n, 3) [m]."""
        # how far a layer lies before the one below, relative to the size of the structure
        height = 1e-3 * self._setup.model.structure.size
        return np.column_stack([points, np.full(len(points), layer * height)])


def viewer(
    run: History,
    model: Model,
    *,
    magnification: float | None = None,
    colour: str = "displacement",
) -> Viewer:
    """Return pyvista's viewer of a run while its joints hold: blocks, thrust line, hinges.

    Args:
        run: with fields.
        model: that made the run.
        magnification: of displacements [-]; by default a round number that shows them well, and 1
            where they may be large.
        colour: "displacement" or, for blocks that are not rigid, "stress".

    Returns:
        The viewer, not yet open.

    Raises:
        InvalidInput: the run has no fields or is another model's, or an option cannot be meant.
        NotInstalled: there is no library to draw with.
    """
    check_film(model, run, colour, magnification)
    return Viewer(Setup.of(model, kept_fields(run)[1], colour, magnification), run)


def _lines(points: Array) -> pv.PolyData:
    """Straight lines between every two points (2 n, 3)."""
    pairs = np.arange(len(points)).reshape(-1, 2)
    return pv.PolyData(points, lines=np.column_stack([np.full(len(pairs), 2), pairs]).ravel())


def _polygon(points: Array) -> pv.PolyData:
    """A polygon (n, 3), cut into triangles as it may be concave."""
    return pv.PolyData(points, faces=[len(points), *range(len(points))]).triangulate()
