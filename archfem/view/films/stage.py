"""A structure in front of a camera: moved, photographed, and moved again."""

import os
import sys
from collections.abc import Sequence
from itertools import pairwise
from types import TracebackType
from typing import Self

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.masonry.structure import Structure
from archfem.models.cells import Cells
from archfem.packages import check_drawing
from archfem.view.films.colours import shade
from archfem.view.films.setup import Setup
from archfem.view.films.shots import Shot
from archfem.view.films.writer import Image
from archfem.view.marks import support_outlines
from archfem.view.style import EDGE, GHOST, HINGE, MOVED, SLIP, SUPPORT, THRUST

Numbers = NDArray[np.intp]

DISC = 0.0125
"""Radius of a hinge in a picture, relative to the size of the structure."""

SNUG = 0.3
"""The same at most, relative to the depth of the shallowest joint that is drawn."""

FULL = 1100.0
"""Width of a photograph at which lines are as wide as given [pixels]."""

TURN = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
CIRCLE = np.column_stack([np.cos(TURN), np.sin(TURN)])

REST, EDGES, MOTION, PAST, HALO, LINE, ARROWS, RIMS, HINGES = -1, *range(1, 9)
"""Layers of a picture, from the blocks upwards."""


class Stage:
    """Blocks, supports and marks before a camera that looks along -z.

    Use it as a context: leaving it frees what VTK holds.
    """

    def __init__(self, setup: Setup, size: tuple[int, int]) -> None:
        _go_headless()
        self._setup = setup
        cells = setup.model.cells
        self._pen = max(0.6, size[0] / FULL)
        self._height = 1e-3 * setup.model.structure.size
        self._disc = _disc(setup.model.structure)
        self._blocks = _surface(cells)
        self._edges = cells.rims
        self._outlines = _lines(self._flat(cells.places, EDGES), self._edges)
        check_drawing()
        self._plotter = pv.Plotter(off_screen=True, window_size=list(size))
        self._plotter.background_color = pv.Color("white")
        self._plotter.enable_anti_aliasing("msaa", multi_samples=8)
        self._paint(shade(cells, np.zeros(setup.model.size), setup.scale.colour))
        self._plotter.add_mesh(
            self._blocks,
            scalars="shade",
            cmap=setup.scale.shades,
            clim=(setup.scale.low, setup.scale.high),
            lighting=False,
            show_scalar_bar=False,
        )
        self._build()
        self._aim(size)

    def __enter__(self) -> Self:
        """The stage itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Free the plotter."""
        self._plotter.close()

    def photograph(self, shot: Shot) -> Image:
        """Move the structure and take a picture.

        Args:
            shot: what it shows.

        Returns:
            Red, green and blue from 0 to 255 (height, width, 3).
        """
        marks = shot.marks
        self._blocks.points = self._flat(shot.places, 0)
        self._outlines.points = self._flat(shot.places, EDGES)
        self._paint(shot.shades)
        pairs = np.arange(2 * len(marks.links)).reshape(-1, 2)
        for name, layer in (("halo", HALO), ("thrust", LINE)):
            points = self._flat(marks.links.reshape(-1, 2), layer)
            self._meshes[name].dataset = _lines(points, pairs)
        dots = marks.thrust[np.isfinite(marks.thrust[:, 0])]
        self._meshes["dots"].dataset = self._discs(dots, LINE, 0.35)
        self._meshes["motion"].dataset = self._loops(shot.outlines)
        self._meshes["past"].dataset = self._discs(shot.past, PAST, 1.0)
        self._meshes["slips"].dataset = self._polygons(marks.slips, ARROWS)
        self._meshes["rims"].dataset = self._discs(marks.hinges, RIMS, 1.25)
        self._meshes["hinges"].dataset = self._discs(marks.hinges, HINGES, 1.0)
        self._plotter.render()
        return np.asarray(self._plotter.screenshot(return_img=True), dtype=np.uint8)

    def _build(self) -> None:
        """Put everything on the stage, marks still empty."""
        for outline in support_outlines(self._setup.model, self._setup.magnification):
            self._add(self._polygons(outline[None], 0), SUPPORT)
            around = np.arange(len(outline))
            edges = np.column_stack([around, np.roll(around, -1)])
            self._add(_lines(self._flat(outline, EDGES), edges), EDGE, 1.5)
        if self._setup.ground is not None:
            self._add(_lines(self._flat(self._setup.ground, REST), np.array([[0, 1]])), EDGE, 2.0)
        rest = _lines(self._flat(self._setup.model.cells.places, REST), self._edges)
        self._add(rest, GHOST)
        self._add(self._outlines, EDGE, 1.5)
        self._meshes = {
            "motion": self._add(pv.PolyData(), MOVED, 3.0),
            "past": self._add(pv.PolyData(), HINGE, opacity=0.3),
            "halo": self._add(pv.PolyData(), "white", 6.0),
            "thrust": self._add(pv.PolyData(), THRUST, 3.0),
            "dots": self._add(pv.PolyData(), THRUST),
            "slips": self._add(pv.PolyData(), SLIP),
            "rims": self._add(pv.PolyData(), "white"),
            "hinges": self._add(pv.PolyData(), HINGE),
        }

    def _paint(self, shades: Array) -> None:
        """Give the blocks the values by which they are coloured."""
        if self._setup.scale.colour == "stress":
            self._blocks.cell_data["shade"] = shades[self._blocks.cell_data["cell"]]
        else:
            self._blocks.point_data["shade"] = shades

    def _add(
        self, mesh: pv.PolyData, colour: str, width: float = 1.0, opacity: float = 1.0
    ) -> pv.DataSetMapper:
        """Add a mesh, which may be empty, in one flat colour."""
        mapper = pv.DataSetMapper(mesh)
        actor = pv.Actor(mapper=mapper)
        actor.prop.color, actor.prop.opacity = colour, opacity
        actor.prop.line_width, actor.prop.lighting = width * self._pen, False
        self._plotter.add_actor(actor, render=False)
        return mapper

    def _aim(self, size: tuple[int, int]) -> None:
        """Look at all of the view, from the front, without perspective."""
        low, high = self._setup.low, self._setup.high
        middle, extent = 0.5 * (low + high), high - low
        camera = self._plotter.camera
        camera.focal_point = (*middle, 0.0)
        camera.position = (*middle, 2.0 * self._setup.model.structure.size)
        camera.up = (0.0, 1.0, 0.0)
        camera.parallel_projection = True
        camera.parallel_scale = 0.5 * max(extent[1], extent[0] * size[1] / size[0])
        self._plotter.reset_camera_clipping_range()

    def _flat(self, points: Array, layer: float) -> Array:
        """Points of the plane, in a layer of the picture (n, 3) [m]."""
        return np.column_stack([points, np.full(len(points), layer * self._height)])

    def _polygons(self, outlines: Array, layer: float) -> pv.PolyData:
        """Polygons of equally many corners (n, corners, 2)."""
        if not len(outlines):
            return pv.PolyData()
        count, corners = outlines.shape[:2]
        numbers = np.arange(count * corners).reshape(count, corners)
        faces = np.insert(numbers, 0, corners, axis=1).ravel()
        points = self._flat(outlines.reshape(-1, 2), layer)
        return _triangles(pv.PolyData(points, faces=faces))

    def _loops(self, outlines: Sequence[Array]) -> pv.PolyData:
        """Closed lines, each (k, 2) [m]."""
        if not outlines:
            return pv.PolyData()
        starts = np.cumsum([0, *map(len, outlines)])
        pairs = [
            np.column_stack([np.arange(a, b), np.roll(np.arange(a, b), -1)])
            for a, b in pairwise(starts)
        ]
        return _lines(self._flat(np.concatenate(outlines), MOTION), np.concatenate(pairs))

    def _discs(self, centres: Array, layer: float, size: float) -> pv.PolyData:
        """Discs about points (n, 2), of a size relative to a hinge's."""
        return self._polygons(centres[:, None] + size * self._disc * CIRCLE, layer)


def _disc(structure: Structure) -> float:
    """Radius of a hinge [m]."""
    depths = structure.depths[structure.judged]
    return min(DISC * structure.size, SNUG * float(depths.min()))


def _go_headless() -> None:
    """Let VTK draw without a display where there is none."""
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")


def _surface(cells: Cells) -> pv.PolyData:
    """The blocks' cells, cut into triangles that know the number of their cell."""
    listed = np.concatenate([[len(cell), *cell] for cell in cells.polygons])
    places = np.column_stack([cells.places, np.zeros(len(cells.places))])
    surface = pv.PolyData(places, faces=listed)
    surface.cell_data["cell"] = np.arange(len(cells.polygons))
    return _triangles(surface)


def _triangles(surface: pv.PolyData) -> pv.PolyData:
    """Cut polygons, which may be concave, into triangles."""
    cut: pv.PolyData = surface.triangulate()
    return cut


def _lines(points: Array, pairs: Numbers) -> pv.PolyData:
    """Straight lines between pairs of points (n, 3)."""
    twos = np.full(len(pairs), 2)
    return pv.PolyData(points, lines=np.column_stack([twos, pairs]).ravel())
