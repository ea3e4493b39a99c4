"""Interactive viewer of a run by pyvista: zoom, pan, and a slider over time."""

import os
import sys
from typing import Any

import numpy as np
import pyvista as pv

from archfem._optional import check_drawing
from archfem._typing import Array
from archfem._validation import validate_arguments, validate_methods
from archfem.dynamics.history import History
from archfem.models.model import Model
from archfem.view.films.film import check_film
from archfem.view.films.frames import frames_of_run
from archfem.view.films.settings import Setup
from archfem.view.joint_marks import support_outlines
from archfem.view.positions import fields_at, recorded_fields
from archfem.view.stress import Triangles
from archfem.view.style import Colour


@validate_methods
class Viewer:
    """A run in pyvista's viewer; `show()` opens it, in a window or in a notebook.

    Attributes:
        plotter: the `pyvista.Plotter`, to which further objects can be added.
    """

    def __init__(self, setup: Setup, run: History) -> None:
        check_drawing()
        # without a display, VTK renders off screen by EGL
        if sys.platform == "linux" and not os.environ.get("DISPLAY"):
            os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        self._setup, self._run = setup, run
        self._triangles = Triangles(setup.model.cells)
        self._blocks = pv.PolyData()
        self.plotter = pv.Plotter(off_screen=not os.environ.get("DISPLAY"))
        self._add_meshes()
        times = recorded_fields(run)[0]
        self.at(float(times[0]))
        style = {"title": "time [s]", "title_height": 0.02, "color": Colour.EDGE}
        ends = {"pointa": (0.2, 0.92), "pointb": (0.8, 0.92)}
        self.plotter.add_slider_widget(
            self.at, (times[0], times[-1]), value=times[0], **style, **ends
        )
        self.plotter.view_xy()  # type: ignore[call-arg]
        self.plotter.enable_parallel_projection()  # type: ignore[call-arg]

    def show(self, **options: Any) -> Any:
        """Open the viewer.

        Args:
            options: of `pyvista.Plotter.show`, for example `jupyter_backend` or `screenshot`.

        Returns:
            The result of `pyvista.Plotter.show`: a widget in a notebook, else nothing or an image.
        """
        return self.plotter.show(**options)

    def at(self, time: float) -> None:
        """Show the run at a time, with displacements interpolated linearly.

        Args:
            time: from the first to the last recorded field [s].
        """
        times, triangles = np.array([time]), self._triangles
        frame = next(frames_of_run(self._setup, self._run, times, fields_at(self._run, times)))
        self._blocks.points = self._in_layer(triangles.corners(frame.places).reshape(-1, 2), 0)
        if self._setup.scale.colour == "stress":  # a value for each cell
            self._blocks["shade"] = np.repeat(frame.shades[triangles.cell], 3)
        else:
            self._blocks["shade"] = triangles.corners(frame.shades).ravel()
        edges = frame.places[self._setup.model.cells.outline_edges]
        self._edges.dataset = self._segments(edges, 1)
        self._thrust.dataset = self._segments(frame.marks.links, 2)
        self._hinges.dataset = pv.PolyData(self._in_layer(frame.marks.hinges, 3))
        self.plotter.render()

    def _add_meshes(self) -> None:
        """Add the undeformed blocks, the supports, and empty meshes for all that moves."""
        setup, cells = self._setup, self._setup.model.cells
        self.plotter.set_background("white")
        corners = self._triangles.corners(cells.places).reshape(-1, 2)
        faces = np.arange(len(corners)).reshape(-1, 3)
        blocks = pv.PolyData.from_regular_faces(self._in_layer(corners, 0), faces)
        self._blocks.copy_from(blocks)
        self._blocks["shade"] = np.zeros(len(corners))
        bar = {"title": setup.scale.label, "title_font_size": 14, "label_font_size": 12}
        self.plotter.add_mesh(
            self._blocks,
            scalars="shade",
            cmap=setup.scale.shades,
            clim=(setup.scale.norm.vmin, setup.scale.norm.vmax),
            lighting=False,
            scalar_bar_args=bar | {"color": Colour.EDGE, "fmt": "%.3g", "n_labels": 2},
        )
        for outline in support_outlines(setup.model, setup.magnification):
            polygon = [len(outline), *range(len(outline))]
            mesh = pv.PolyData(self._in_layer(outline, 0), faces=polygon)
            # VTK renders only convex polygons correctly
            self._add(mesh.triangulate(), Colour.SUPPORT)
        self._add(self._segments(cells.places[cells.outline_edges], -1), Colour.UNDEFORMED)
        self._edges = self._add(pv.PolyData(), Colour.EDGE, 1.5)
        self._thrust = self._add(pv.PolyData(), Colour.THRUST, 3.0)
        self._hinges = self._add(pv.PolyData(), Colour.HINGE, 14.0)

    def _add(self, mesh: pv.PolyData, colour: str, width: float = 1.0) -> pv.DataSetMapper:
        """Add a mesh, which may be empty, in one colour; `width` is that of lines and points."""
        mapper = pv.DataSetMapper(mesh)
        actor = pv.Actor(mapper=mapper)
        actor.prop.color, actor.prop.lighting = colour, False
        actor.prop.line_width = actor.prop.point_size = width
        actor.prop.render_points_as_spheres = True
        self.plotter.add_actor(actor, render=False)
        return mapper

    def _segments(self, segments: Array, layer: int) -> pv.PolyData:
        """Return line segments (n, 2, 2) as a mesh."""
        return pv.line_segments_from_points(self._in_layer(segments.reshape(-1, 2), layer))

    def _in_layer(self, points: Array, layer: int) -> Array:
        """Return plane points in a layer of the picture (n, 3) [m]; higher layers cover lower."""
        height = 1e-3 * self._setup.model.structure.size
        return np.column_stack([points, np.full(len(points), layer * height)])


@validate_arguments
def viewer(
    run: History, model: Model, *, magnification: float | None = None, colour: str = "displacement"
) -> Viewer:
    """Return an interactive viewer of a run until blocks come loose: blocks, thrust line, hinges.

    Args:
        run: a history with recorded fields.
        model: the model of the run.
        magnification: of displacements [-]; by default a round number that makes them visible, and
            1 for large displacements.
        colour: "displacement" or, for deformable blocks, "stress".

    Returns:
        The viewer, not yet open.

    Raises:
        InvalidInput: the run has no fields or belongs to another model, or an option is invalid.
        NotInstalled: pyvista cannot be used.
    """
    check_film(model, run, colour, magnification)
    return Viewer(Setup.of(model, recorded_fields(run)[1], colour, magnification), run)
