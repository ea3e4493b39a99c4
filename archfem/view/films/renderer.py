"""Rendering of a frame: structure, title, colour bar, legend and ground acceleration.

Constant parts of a film are drawn once. Blocks and marks are drawn into a window of the image by
matplotlib's Agg renderer, many shapes per call, or by another library's painter; blocks are divided
into triangles so fine that colours may vary linearly between their corners.
"""

from textwrap import shorten
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Affine2D, Bbox

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.joints.criteria import describe_assessed_joints
from archfem.view.films.encoder import Image
from archfem.view.films.frames import Frame, corner_values, frame_layers
from archfem.view.films.settings import Scale, Setup
from archfem.view.histories import draw_ground
from archfem.view.joint_marks import joint_pairs
from archfem.view.positions import comes_loose, ground_acceleration, mechanism_instant
from archfem.view.style import Colour, annotate, glyph_marker, style_colour_bar


class Canvas:
    """Window of an image in which shapes are drawn in metres, each over the earlier ones."""

    def __init__(
        self, renderer: RendererAgg, window: tuple[int, int, int, int], low: Array, high: Array
    ) -> None:
        self.size = window[2] - window[0], window[3] - window[1]
        self._renderer, self._window = renderer, Bbox.from_extents(*window)
        room = np.array(self._window.size)
        scale = float(np.min(room / (high - low)))
        origin = np.array(window[:2]) + 0.5 * room - 0.5 * scale * (low + high)
        self._pixels = Affine2D().scale(scale).translate(*origin)
        # line widths are those of a window of 1100 pixels; in smaller ones lines are thinner
        self._line_scale = max(0.6, self._window.width / 1100.0) * 72.0 / renderer.dpi

    def lines(self, segments: Array, colour: str, width: float) -> None:
        """Draw line segments (n, 2, 2)."""
        style = self._style(colour)
        style.set_linewidth(width * self._line_scale)
        style.set_capstyle("round")
        # the renderer limits the size of a path
        for first in range(0, len(segments), 4000):
            points = segments[first : first + 4000].reshape(-1, 2)
            path = Path(points, np.tile([Path.MOVETO, Path.LINETO], len(points) // 2))
            path.should_simplify = False
            self._renderer.draw_path(style, path, self._pixels)

    def fill(self, outlines: Array, colour: str, opacity: float = 1.0) -> None:
        """Fill polygons of equal numbers of corners (n, k, 2)."""
        if len(outlines):
            style, path = self._style(colour, opacity), Path.make_compound_path_from_polys(outlines)
            style.set_linewidth(0.0)
            self._renderer.draw_path(style, path, self._pixels, style.get_rgb())

    def shade(self, corners: Array, colours: Array) -> None:
        """Fill triangles (t, 3, 2) with colours that vary linearly between corners (t, 3, 4)."""
        self._renderer.draw_gouraud_triangles(self._style("white"), corners, colours, self._pixels)

    def paste(self, image: Image) -> None:
        """Fill the window with an image (height, width, 3)."""
        opaque = np.full((*image.shape[:2], 1), 255, dtype=np.uint8)
        # the renderer counts rows from the bottom
        pixels = np.ascontiguousarray(np.concatenate([image, opaque], axis=2)[::-1])
        self._renderer.draw_image(self._style("white"), *self._window.min, pixels)

    def _style(self, colour: str, opacity: float = 1.0) -> GraphicsContextBase:
        """Return a graphics context that is clipped to the window."""
        style = self._renderer.new_gc()
        style.set_foreground(colour)
        style.set_alpha(opacity)
        style.set_clip_rectangle(self._window)
        style.set_snap(False)
        return style


class FramePainter:
    """Draws blocks, supports and marks on a canvas, from the lowest layer to the uppermost."""

    def __init__(self, setup: Setup, canvas: Canvas) -> None:
        self._setup, self._canvas = setup, canvas

    def draw_background(self) -> None:
        """Draw the layers below the blocks, which do not change: ground, supports, outlines."""
        if self._setup.ground is not None:
            self._canvas.lines(self._setup.ground[None], Colour.EDGE, 2.0)
        cells = self._setup.model.cells
        self._canvas.lines(cells.places[cells.outline_edges], Colour.UNDEFORMED, 1.0)
        for outline in self._setup.supports:
            self._canvas.fill(outline[None], Colour.SUPPORT)

    def draw(self, frame: Frame) -> None:
        """Draw blocks and marks of a frame."""
        canvas, scale = self._canvas, self._setup.scale
        colours = scale.shades(scale.norm(corner_values(self._setup, frame)))
        canvas.shade(self._setup.triangles.corners(frame.places), colours)
        for layer in frame_layers(self._setup, frame):
            if layer.width:
                canvas.lines(layer.shapes, layer.colour, layer.width)
            else:
                canvas.fill(layer.shapes, layer.colour, layer.opacity)


class FrameLayout:
    """Layout of a frame, of which only changing parts are redrawn."""

    # heights of the header, the legend and the ground acceleration; width of the colour bar [inch]
    header, footer, strip, side = 0.55, 0.45, 1.75, 1.25
    font_size = 10.5  # [points]

    def __init__(
        self,
        setup: Setup,
        size: tuple[int, int],
        joints: xr.Dataset,
        run: History | None = None,
        painter: type[FramePainter] = FramePainter,
    ) -> None:
        # an image is 12.8 inches wide, or narrower: a small one has at least 60 dots per inch
        dpi = max(60.0, size[0] / 12.8)
        self._figure = Figure(figsize=(size[0] / dpi, size[1] / dpi), dpi=dpi)
        self._canvas = FigureCanvasAgg(self._figure)
        self._inches, self._speed = np.array(size) / dpi, 1.0
        below = self.footer + (self.strip if run else 0.0)
        with matplotlib.rc_context({"font.size": self.font_size, "legend.frameon": False}):
            self._draw_surroundings(setup, joints, run, below)
            self._cursor = self._draw_strip(run) if run else None
        left, right = round(0.25 * dpi), size[0] - round(self.side * dpi)
        window = (left, round(below * dpi), right, size[1] - round(self.header * dpi))
        canvas = Canvas(self._canvas.get_renderer(), window, setup.low, setup.high)
        self._painter = painter(setup, canvas)
        self._draw_background()

    def compose(self, frame: Frame, speed: float = 1.0) -> Image:
        """Draw a frame, with its time and numbers of failed joints, at a speed of the film."""
        joined = bool(len(frame.marks.thrust))  # loose blocks have no marks to explain
        if speed != self._speed or joined != self._legend.get_visible():
            self._speed = speed
            self._legend.set_visible(joined)
            self._draw_background()
        self._canvas.restore_region(self._background)
        self._painter.draw(frame)
        time = [] if frame.time is None else [f"t = {frame.time:6.3f} s"]
        self._state_text.set_text("    ".join([*frame.words, *time]))
        self._figure.draw_artist(self._state_text)
        if self._cursor is not None and frame.time is not None:
            self._cursor.set_xdata([frame.time, frame.time])
            self._figure.draw_artist(self._cursor)
        return np.asarray(self._canvas.buffer_rgba())

    def _draw_background(self) -> None:
        """Draw and store everything that does not change from frame to frame."""
        speed = _speed_text(self._speed) if self._cursor else ""
        self._scale_text.set_text(f"{self._magnification}{speed}")
        self._canvas.draw()
        self._painter.draw_background()
        self._background = self._canvas.copy_from_bbox(self._figure.bbox)

    def _draw_surroundings(
        self, setup: Setup, joints: xr.Dataset, run: History | None, below: float
    ) -> None:
        """Draw title, colour bar and legend, above a height [inch] that the strip takes."""
        name = setup.model.structure.name
        if run is not None:
            name = f"{run.dataset.attrs['title']}: {run.verdict.outcome}"
        top = 1.0 - 0.5 * self.header / self._inches[1]
        self._write(0.02, top, name[:1].upper() + name[1:], fontsize=13.0, ha="left")
        # 16 letters of this size take an inch
        assessed = describe_assessed_joints(joints)
        note = shorten(assessed, int(16.0 * self._inches[0]), placeholder=" …")
        low = 1.0 - 0.87 * self.header / self._inches[1]
        self._write(0.02, low, note, fontsize=0.75 * self.font_size, ha="left", color=Colour.EDGE)
        self._state_text = self._write(0.985, top, "", fontsize=13.0, animated=True)
        self._draw_colour_bar(setup.scale, below)
        self._magnification = f"displacements × {setup.magnification:g}"
        middle = (below - 0.5 * self.footer) / self._inches[1]
        handles = _legend_symbols(joints, run is not None, bool(setup.outlines))
        if not len(joint_pairs(setup.model.structure, joints["judged"].values)):
            handles = handles[1:]  # no block carries a single thrust
        style = {"columnspacing": 1.4, "handletextpad": 0.5, "bbox_to_anchor": (0.01, middle)}
        self._legend = self._figure.legend(handles=handles, loc="center left", ncols=6, **style)
        self._scale_text = self._write(0.985, middle, "")

    def _write(self, x: float, y: float, text: str, **style: Any) -> Text:
        """Write a line of text, by default right-aligned at a position."""
        style = {"ha": "right", "va": "center", "color": Colour.TEXT} | style
        return self._figure.text(x, y, text, parse_math=False, **style)

    def _draw_colour_bar(self, scale: Scale, below: float) -> None:
        """Draw the colour bar at the right of the window."""
        wide, high = self._inches
        room = high - below - self.header
        axes = self._add_axes(wide - self.side + 0.15, below + 0.07 * room, 0.16, 0.86 * room)
        shades = ScalarMappable(scale.norm, scale.shades)
        bar = self._figure.colorbar(shades, cax=axes, extend=scale.extend)
        style_colour_bar(bar, scale.label, self.font_size)

    def _draw_strip(self, run: History) -> Line2D:
        """Draw the ground acceleration; return the cursor that moves over it."""
        axes = self._add_axes(0.85, 0.55, self._inches[0] - 1.1, self.strip - 0.75)
        times, ground = ground_acceleration(run)
        draw_ground(axes, times, ground, size=self.font_size, width=0.9)
        axes.set_xlabel("time [s]", fontsize=self.font_size)
        state = "blocks loose" if comes_loose(run) else "blocks rocking"
        instants = [(run.time[-1], state)] if len(times) > len(run.time) else []
        if (mechanism := mechanism_instant(run)) is not None:
            instants.append((mechanism, "mechanism"))
        width = axes.get_position().width * self._inches[0]
        style: dict[str, Any] = {"xycoords": "axes fraction", "ha": "center", "va": "bottom"}
        style |= {"fontsize": self.font_size, "color": Colour.EDGE}
        end = width + 0.2  # of the room for a text [inch]; later texts push earlier ones aside
        for time, text in instants:
            axes.axvline(time, color=Colour.GREY, lw=1.0, ls="--")
            label = annotate(axes, text, (0.0, 1.0), (0, 1), **style)
            half = 0.5 * label.get_window_extent().width / self._figure.dpi
            share = (time - times[0]) / max(times[-1] - times[0], 1e-9)
            place = min(width * share, end - half)
            end = place - half - 0.1
            label.xy = (place / width, 1.0)
        return axes.axvline(run.time[0], color=Colour.HINGE, lw=1.8, animated=True)

    def _add_axes(self, *box: float) -> Axes:
        """Add axes with left, bottom, width and height [inch]."""
        return self._figure.add_axes(tuple(np.array(box) / np.tile(self._inches, 2)))


def _speed_text(speed: float) -> str:
    """Return the speed of a film in words."""
    if abs(speed - 1.0) < 0.01:
        return ", real time"
    if speed < 1.0:
        return f", slow motion: 1/{1.0 / speed:.3g} of real time"
    return f", {speed:.3g} times real time"


def _legend_symbols(joints: xr.Dataset, film: bool, mechanism: bool) -> list[Line2D]:
    """Return the legend's symbols of the marks that occur at joints, and of a mechanism."""
    hinges, slides = (bool(((joints[k] != 0) & joints["judged"]).any()) for k in ("hinge", "slide"))
    hinge = {"ls": "", "marker": "o", "ms": 9.0, "color": Colour.HINGE}
    sliding = {"ls": "", "marker": glyph_marker(), "ms": 17.0, "color": Colour.SLIDING}
    symbols = {
        "thrust line": {"color": Colour.THRUST, "lw": 2.4},
        "hinge": hinge if hinges else None,
        "earlier hinge": hinge | {"alpha": 0.3} if film and hinges else None,
        "sliding joint": sliding if slides else None,
        "mechanism": {"color": Colour.MECHANISM, "lw": 2.4} if mechanism else None,
    }
    return [Line2D([], [], label=label, **style) for label, style in symbols.items() if style]
