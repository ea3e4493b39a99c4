"""Structures drawn by pyvista: a viewer with a slider over time, and the blocks of films."""

import json
import os
import re
import sys
from collections.abc import Iterable
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from archfem._files import atomic_write
from archfem._optional import check_drawing, require_package
from archfem._typing import Array
from archfem._validation import validate_arguments, validate_methods
from archfem.dynamics.history import History
from archfem.models.model import Model
from archfem.view.films.frames import Frame, corner_values, frame_layers, frames_of_run
from archfem.view.films.renderer import Canvas, FramePainter
from archfem.view.films.settings import Setup, check_film
from archfem.view.pages.document import render
from archfem.view.positions import decisive_instant, fields_at, recorded_fields
from archfem.view.style import Colour

with require_package("pyvista"):
    import pyvista as pv


class Scene:
    """Blocks and marks of a structure in a pyvista plotter, each kind in a layer of its own."""

    def __init__(self, setup: Setup, size: tuple[int, int] | None = None) -> None:
        check_drawing()
        # without a display, VTK renders off screen by EGL
        if sys.platform == "linux" and not os.environ.get("DISPLAY"):
            os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        self._setup = setup
        hidden = size is not None or not os.environ.get("DISPLAY")
        self.plotter = pv.Plotter(off_screen=hidden, window_size=size)
        self.plotter.set_background("white")
        self.blocks = pv.PolyData()
        self._add_blocks()
        self._set_camera()
        self._marks: list[pv.Actor] = []  # a layer each, added with the first frame

    def show(self, frame: Frame) -> None:
        """Move blocks and marks to where a frame has them."""
        setup, layers = self._setup, frame_layers(self._setup, frame)
        corners = setup.triangles.corners(frame.places).reshape(-1, 2)
        self.blocks.points = self._in_layer(corners, 0)
        self.blocks["shade"] = corner_values(setup, frame).ravel()
        if not self._marks:
            # lines are wider than in an image of matplotlib, whose edges are smooth
            line = 4.0 / 3.0 * max(0.6, self.plotter.window_size[0] / 1100.0)
            for each in layers:
                width, opacity = line * each.width, each.opacity
                self._marks.append(self._add(pv.PolyData(), each.colour, width, opacity))
            self._moving += self._marks
        for height, (actor, layer) in enumerate(zip(self._marks, layers, strict=True), start=1):
            draw = self._segments if layer.width else self._polygons
            actor.mapper.dataset = draw(layer.shapes, height)
        self.plotter.render()

    def keep(self, frame: Frame) -> tuple[float, int]:
        """Add a copy of all that a frame has; return its time [s], and the number of actors."""
        self.show(frame)
        # the exporter leaves out empty meshes
        moving = [actor for actor in self._moving if actor.mapper.dataset.n_points]
        for actor in moving:
            copy, mesh = actor.copy(), actor.mapper.dataset.copy()
            copy.mapper.dataset = mesh
            # a new mesh sets these to the range of its own values
            copy.mapper.scalar_range = copy.mapper.lookup_table.scalar_range = self._ends
            self.plotter.add_actor(copy, render=False, reset_camera=False)
        return frame.time, len(moving)

    def count_static(self) -> int:
        """Return the number of actors that do not move."""
        every = self.plotter.renderer.actors.values()
        actors = [each for each in every if each not in self._moving]
        return sum(actor.mapper.dataset.n_points > 0 for actor in actors)

    def remove_moving(self) -> None:
        """Remove the actors that move, of which only copies are left."""
        self.plotter.remove_actor(self._moving, render=False, reset_camera=False)

    def add_colour_bar(self) -> None:
        """Add the colour bar of the blocks."""
        style = {"title_font_size": 14, "label_font_size": 12, "color": Colour.EDGE}
        self.plotter.add_scalar_bar(self._setup.scale.label, fmt="%.3g", n_labels=2, **style)

    def _add_blocks(self) -> None:
        """Add the blocks, undeformed and displaced, the supports and the ground."""
        setup, cells = self._setup, self._setup.model.cells
        corners = setup.triangles.corners(cells.places).reshape(-1, 2)
        faces = np.arange(len(corners)).reshape(-1, 3)
        self.blocks.copy_from(pv.PolyData.from_regular_faces(self._in_layer(corners, 0), faces))
        self.blocks["shade"] = np.zeros(len(corners))
        norm = setup.scale.norm
        ends = self._ends = (float(norm.vmin or 0.0), float(norm.vmax or 0.0))
        # a table of colours, since the scale of a fall is not linear
        shades = setup.scale.shades(norm(np.linspace(*ends, 256)))
        table = pv.LookupTable(values=(255.0 * shades).astype(np.uint8), scalar_range=ends)
        style = {"lighting": False, "show_scalar_bar": False}
        self._moving = [self.plotter.add_mesh(self.blocks, scalars="shade", cmap=table, **style)]
        for outline in setup.supports:
            self._add(self._polygons(outline[None], 0), Colour.SUPPORT)
        self._add(self._segments(cells.places[cells.outline_edges], -1), Colour.UNDEFORMED)
        if setup.ground is not None:
            self._add(self._segments(setup.ground[None], 0), Colour.EDGE, 2.0)

    def _set_camera(self) -> None:
        """Look straight at the visible region, which fills the window."""
        low, high = self._setup.low, self._setup.high
        width, height = self.plotter.window_size
        room = max(high[1] - low[1], (high[0] - low[0]) * height / width)
        self.plotter.view_xy()  # type: ignore[call-arg]
        self.plotter.enable_parallel_projection()  # type: ignore[call-arg]
        camera, centre = self.plotter.camera, 0.5 * (low + high)
        # pages are seen in perspective, from where the region fills the angle of view as well
        distance = 0.5 * room / np.tan(np.radians(0.5 * camera.view_angle))
        camera.focal_point, camera.position = (*centre, 0.0), (*centre, distance)
        camera.parallel_scale, camera.clipping_range = 0.5 * room, (0.1 * distance, 4.0 * distance)

    def _add(
        self, mesh: pv.PolyData, colour: str, width: float = 1.0, opacity: float = 1.0
    ) -> pv.Actor:
        """Add a mesh, which may be empty, in one colour; `width` is that of lines [pixels]."""
        actor = pv.Actor(mapper=pv.DataSetMapper(mesh))
        actor.prop.color, actor.prop.lighting, actor.prop.opacity = colour, False, opacity
        actor.prop.line_width = width
        self.plotter.add_actor(actor, render=False, reset_camera=False)
        return actor

    def _polygons(self, outlines: Array, layer: int) -> pv.PolyData:
        """Return filled polygons of equal numbers of corners (n, k, 2) as a mesh."""
        if not len(outlines):
            return pv.PolyData()
        corners = np.arange(outlines[..., 0].size).reshape(outlines.shape[:2])
        points = self._in_layer(outlines.reshape(-1, 2), layer)
        # VTK renders only convex polygons correctly
        return pv.PolyData.from_regular_faces(points, corners).triangulate()

    def _segments(self, segments: Array, layer: int) -> pv.PolyData:
        """Return line segments (n, 2, 2) as a mesh."""
        return pv.line_segments_from_points(self._in_layer(segments.reshape(-1, 2), layer))

    def _in_layer(self, points: Array, layer: int) -> Array:
        """Return plane points in a layer of the picture (n, 3) [m]; higher layers cover lower."""
        height = 1e-3 * self._setup.model.structure.size
        return np.column_stack([points, np.full(len(points), layer * height)])


class ScenePainter(FramePainter):
    """Draws the frames of a film by pyvista."""

    def __init__(self, setup: Setup, canvas: Canvas) -> None:
        super().__init__(setup, canvas)
        self._scene = Scene(setup, canvas.size)

    def draw_background(self) -> None:
        """Draw nothing: the image of a frame covers the window."""

    def draw(self, frame: Frame) -> None:
        """Draw blocks and marks of a frame."""
        self._scene.show(frame)
        self._canvas.paste(self._scene.plotter.screenshot(return_img=True))


def _export_page(plotter: pv.Plotter) -> str:
    """Return a page with a scene and the script that shows it, without files beside it."""
    # an optional part of trame that this page does not use would download files of its own
    unused = "trame.widgets.vtklocal"
    modules: dict[str, Any] = sys.modules
    blocked = modules.setdefault(unused, None) is None
    try:
        with require_package("trame"):
            import_module("trame")  # without it pyvista warns before it fails
            # older versions of pyvista have the exporter itself
            return str(getattr(plotter, "trame", plotter).export_html(None).getvalue())
    finally:
        if blocked:
            del modules[unused]


def write_scenes(path: Path, setup: Setup, run: History, frames: Iterable[Frame]) -> Path:
    """Write an HTML page with all frames in one scene, of which a slider shows one at a time."""
    scene = Scene(setup)
    static = scene.count_static()
    shown = [scene.keep(frame) for frame in frames]
    scene.remove_moving()
    scene.add_colour_bar()
    page = _export_page(scene.plotter)
    title = f"{run.dataset.attrs['title']}: {run.verdict.outcome}"
    page = re.sub("<title>.*?</title>", lambda _: f"<title>{escape(title)}</title>", page, count=1)
    times = np.array([time for time, _ in shown])
    wide, high = scene.plotter.window_size
    known = {
        **{"title": title, "static": static, "counts": [count for _, count in shown]},
        **{"times": times.round(4).tolist()},
        "first": int(np.argmin(np.abs(times - decisive_instant(run)))),
        "aspect": wide / high,
        "distance": float(scene.plotter.camera.position[2]),
    }
    # a tag in the title must not end the script
    controls = render("scenes.html", known=json.dumps(known).replace("<", "\\u003c"))
    # in the head, since the script of the scene empties the body; and its icons would be downloaded
    page = page.replace("</head>", f"{controls}</head>", 1)
    page = page.replace("https://kitware.github.io/vtk-js/icon/", "data:,")
    with atomic_write(path) as draft:
        draft.write_text(page, "utf-8")
    return path


@validate_methods
class Viewer:
    """A run in pyvista's viewer; `show()` opens it, in a window or in a notebook.

    Attributes:
        plotter: the `pyvista.Plotter`, to which further objects can be added.
    """

    def __init__(self, setup: Setup, run: History) -> None:
        self._setup, self._run, self._scene = setup, run, Scene(setup)
        self.plotter = self._scene.plotter
        self._scene.add_colour_bar()
        times = recorded_fields(run)[0]
        first, last = times[0], times[-1]
        self.at(float(first))
        style = {"title": "time [s]", "title_height": 0.02, "color": Colour.EDGE}
        place = {"pointa": (0.2, 0.92), "pointb": (0.8, 0.92), "value": first}
        self.plotter.add_slider_widget(self.at, (first, last), **style, **place)

    def show(self, **options: Any) -> Any:
        """Open the viewer.

        Args:
            options: options of `pyvista.Plotter.show`, for example `jupyter_backend` or
                `screenshot`.

        Returns:
            The result of `pyvista.Plotter.show`: a widget in a notebook, else nothing or an image.
        """
        return self.plotter.show(**options)

    def at(self, time: float) -> None:
        """Show the run at a time, with displacements interpolated linearly.

        Args:
            time: from the first to the last recorded field [s].
        """
        times = np.array([time])
        frames = frames_of_run(self._setup, self._run, times, fields_at(self._run, times))
        self._scene.show(next(frames))


@validate_arguments
def viewer(
    run: History, model: Model, *, magnification: float | None = None, colour: str = "displacement"
) -> Viewer:
    """Return an interactive viewer of a run until blocks come loose: blocks, thrust line, hinges.

    Args:
        run: a history with recorded fields.
        model: the model of the run.
        magnification: magnification of displacements [-]; by default a round number that makes them
            visible, and 1 for large displacements.
        colour: "displacement" or, for deformable blocks, "stress".

    Returns:
        The viewer, not yet open.

    Raises:
        InvalidInput: the run has no fields or belongs to another model, or an option is invalid.
        NotInstalled: pyvista cannot be used.
    """
    check_film(model, run, colour, magnification, (1280, 720))
    return Viewer(Setup.of(model, recorded_fields(run)[1], colour, magnification), run)
