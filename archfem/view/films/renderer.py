"""A page about a structure that moves: title, colour bar, legend, and the ground's motion.

A structure drawn at an instant: what never moves once, everything else for each picture.

A pen that draws many pieces at once, in metres, into a window of a page of pixels.

Polygons cut into triangles, so fine that colours may run straight between their corners.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Bbox, IdentityTransform
from numpy.typing import NDArray
from scipy import sparse

from archfem._typing import Array
from archfem.dynamics.history import History
from archfem.masonry.structure import Structure
from archfem.models.model import Cells
from archfem.view.films.encoder import Image
from archfem.view.films.frames import Frame
from archfem.view.films.settings import Scale, Setup
from archfem.view.joint_marks import support_outlines
from archfem.view.style import (
    EDGE,
    FAINT,
    GHOST,
    HINGE,
    INK,
    LINES,
    MOVED,
    SLIP,
    SUPPORT,
    THRUST,
    dress,
)

# Lines that are drawn in one stroke: the renderer has room for so many and more
TOGETHER = 4000


class Canvas:
    """Draws on what lies below, in the order in which it is told to."""

    def __init__(
        self, renderer: RendererAgg, window: tuple[int, int, int, int], low: Array, high: Array
    ) -> None:
        self._renderer = renderer
        self._window = Bbox.from_extents(*window)
        room, self._whole = np.array([self._window.width, self._window.height]), IdentityTransform()
        self._scale = float(np.min(room / (high - low)))
        self._origin = np.array(window[:2]) + 0.5 * room - 0.5 * self._scale * (low + high)
        # width of a window at which lines are as wide as given [pixels]
        # width of lines in small windows, relative to that
        self._broad = max(0.6, self._window.width / 1100.0) * 72.0 / renderer.dpi

    def lines(self, pieces: Array, colour: str, width: float) -> None:
        """Draw straight lines."""
        style = self._style(colour)
        style.set_linewidth(width * self._broad)
        style.set_capstyle("round")
        for first in range(0, len(pieces), TOGETHER):
            own = self._pixels(pieces[first : first + TOGETHER]).reshape(-1, 2)
            codes = np.tile(
                np.array([Path.MOVETO, Path.LINETO], dtype=Path.code_type), len(own) // 2
            )
            self._renderer.draw_path(style, _path(own, codes), self._whole)

    def fill(self, outlines: Array, colour: str, opacity: float = 1.0) -> None:
        """Fill polygons of equally many corners."""
        if not len(outlines):
            return
        style = self._style(colour, opacity)
        style.set_linewidth(0.0)
        count, corners = outlines.shape[:2]
        closed = np.concatenate([outlines, outlines[:, :1]], axis=1)
        one = [Path.MOVETO, *[Path.LINETO] * (corners - 1), Path.CLOSEPOLY]
        codes = np.tile(np.array(one, dtype=Path.code_type), count)
        shape = _path(self._pixels(closed).reshape(-1, 2), codes)
        self._renderer.draw_path(style, shape, self._whole, style.get_rgb())

    def shade(self, corners: Array, colours: Array) -> None:
        """Fill triangles with colours that run straight between their corners."""
        style = self._style("white")
        self._renderer.draw_gouraud_triangles(style, self._pixels(corners), colours, self._whole)

    def _pixels(self, points: Array) -> Array:
        """Where points (…, 2) [m] are on the page [pixels]."""
        return self._origin + self._scale * points

    def _style(self, colour: str, opacity: float = 1.0) -> GraphicsContextBase:
        """How the next stroke is drawn, inside the window alone."""
        style = self._renderer.new_gc()
        style.set_foreground(colour)
        style.set_alpha(opacity)
        style.set_clip_rectangle(self._window)
        style.set_snap(False)
        return style


def _path(points: Array, codes: Array) -> Path:
    """Points joined as told, none left out."""
    path = Path(points, codes)
    path.should_simplify = False
    return path


Numbers = NDArray[np.intp]


class Triangles:
    """Triangles over the cells of a model.

    cell: of each triangle (t,).
    """

    def __init__(self, cells: Cells) -> None:
        cut = [_cut(cell, cells.places[cell]) for cell in cells.polygons]
        corners = np.concatenate(cut)
        # triangles of a picture that are not cut further, and pieces of a side at most
        pieces = int(np.clip(round((600 / len(corners)) ** 0.5), 1, 4))
        share, parts = _grid(pieces)
        count = len(share)
        rows = np.repeat(np.arange(count * len(corners)), 3)
        columns = np.repeat(corners, count, axis=0).ravel()
        values = np.tile(share.ravel(), len(corners))
        shape = count * len(corners), len(cells.places)
        self._points = sparse.csr_matrix((values, (rows, columns)), shape)
        self._corners = (count * np.arange(len(corners))[:, None, None] + parts).reshape(-1, 3)
        owner = np.repeat(np.arange(len(cut)), [len(each) for each in cut])
        self.cell: Numbers = np.repeat(owner, len(parts))

    def corners(self, values: Array) -> Array:
        """Return what is known at the points of the cells, at the corners of the triangles."""
        return (self._points @ values)[self._corners]


def _grid(pieces: int) -> tuple[Array, Numbers]:
    """Points on a triangle of so many pieces a side, as shares of its corners; and its parts."""
    places = [(i, j) for i in range(pieces + 1) for j in range(pieces + 1 - i)]
    number = {place: k for k, place in enumerate(places)}
    share = np.array([(pieces - i - j, i, j) for i, j in places]) / pieces
    up = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in places if i + j < pieces]
    down = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in places if i + j < pieces - 1]
    return share, np.array([[number[place] for place in each] for each in up + down])


def _cut(cell: Numbers, places: Array) -> Numbers:
    """Triangles (n - 2, 3) of a polygon (n,), concave or not, with corners at places (n, 2)."""
    # ears are cut off, the roundest first, so that slivers are few
    left, found = list(range(len(cell))), []
    if _area(places) < 0.0:
        left.reverse()
    while len(left) > 3:
        before, after = np.roll(left, 1), np.roll(left, -1)
        ears = np.stack([before, left, after], axis=1)
        order = np.argsort(-_roundness(places[ears]), kind="stable")
        best = next((k for k in order if _is_empty(places, ears[k], left)), order[0])
        found.append(ears[best])
        del left[best]
    found.append(np.array(left))
    return cell[np.array(found)]


def _area(places: Array) -> float:
    """Area within a polygon (n, 2), positive where it runs anticlockwise [m²]."""
    x, y = places.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _roundness(corners: Array) -> Array:
    """Area of triangles (t, 3, 2) over their sides squared; negative where they lie outside."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    sides = corners - np.roll(corners, 1, axis=1)
    return area / np.sum(sides**2, axis=(1, 2)).clip(1e-300)


def _is_empty(places: Array, ear: Numbers, left: list[int]) -> bool:
    """Return whether an ear turns the right way round and has no other corner within."""
    corners = places[ear]
    if _roundness(corners[None])[0] <= 0.0:
        return False
    others = places[[k for k in left if k not in ear]]
    within = np.ones(len(others), dtype=bool)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side, step = end - start, others - start
        within &= side[0] * step[:, 1] - side[1] * step[:, 0] > 0.0
    return not within.any()


TURN = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
CIRCLE = np.column_stack([np.cos(TURN), np.sin(TURN)])


class FramePainter:
    """Blocks, supports and marks, drawn with a pen from the lowest layer to the uppermost."""

    def __init__(self, setup: Setup, pen: Canvas) -> None:
        self._setup, self._pen = setup, pen
        cells = setup.model.cells
        self._triangles = Triangles(cells)
        self._rims = cells.outline_edges
        self._disc = _disc(setup.model.structure)
        self._supports = support_outlines(setup.model, setup.magnification)
        self._edges = _around(self._supports)

    def still(self) -> None:
        """Draw what lies below the blocks and never moves: ground, supports, where blocks stood."""
        if self._setup.ground is not None:
            self._pen.lines(self._setup.ground[None], EDGE, 2.0)
        self._pen.lines(self._setup.model.cells.places[self._rims], GHOST, 1.0)
        for outline in self._supports:
            self._pen.fill(outline[None], SUPPORT)

    def draw(self, shot: Frame) -> None:
        """Draw what a picture shows."""
        pen, marks = self._pen, shot.marks
        pen.shade(self._triangles.corners(shot.places), self._colours(shot.shades))
        pen.lines(np.concatenate([shot.places[self._rims], self._edges]), EDGE, 1.2)
        pen.lines(_around(shot.outlines), MOVED, 3.0)
        self._discs(shot.past, HINGE, 1.0, 0.3)
        pen.lines(marks.links, "white", 6.0)
        pen.lines(marks.links, THRUST, 3.0)
        self._discs(marks.thrust[np.isfinite(marks.thrust[:, 0])], THRUST, 0.35)
        pen.fill(marks.slips, SLIP)
        self._discs(marks.hinges, "white", 1.25)
        self._discs(marks.hinges, HINGE, 1.0)

    def _colours(self, shades: Array) -> Array:
        """Colours at the corners of the triangles (t, 3, 4), from values by point or by cell."""
        scale, own = self._setup.scale, self._triangles
        if scale.colour == "stress":
            values = np.repeat(shades[own.cell][:, None], 3, axis=1)
        else:
            values = own.corners(shades)
        return scale.shades((values - scale.low) / (scale.high - scale.low))

    def _discs(self, centres: Array, colour: str, size: float, opacity: float = 1.0) -> None:
        """Draw discs about points (n, 2), of a size relative to a hinge's."""
        self._pen.fill(centres[:, None] + size * self._disc * CIRCLE, colour, opacity)


def _disc(structure: Structure) -> float:
    """Radius of a hinge [m]."""
    depths = structure.depths[structure.judged]
    # radius of a hinge in a picture, relative to the size of the structure
    # the same at most, relative to the depth of the shallowest joint that is drawn
    return min(0.0125 * structure.size, 0.3 * float(depths.min()))


def _around(outlines: Sequence[Array]) -> Array:
    """Sides of polygons, each (k, 2), one after another (sides, 2, 2)."""
    sides = [np.stack([each, np.roll(each, -1, axis=0)], axis=1) for each in outlines]
    return np.concatenate([np.zeros((0, 2, 2)), *sides])


# Heights of header, legend and strip, width of the colour bar's side, left margin [inch]
HEAD, SIDE, FOOT, STRIP = 0.55, 1.25, 0.45, 1.75

# Sizes of type [points]
TYPE = 10.5


class FrameLayout:
    """A page on which only what changes is drawn again."""

    def __init__(self, setup: Setup, size: tuple[int, int], run: History | None = None) -> None:
        # width of a page [inch], and the least of its dots per inch: a smaller page is narrower
        dense = max(60.0, size[0] / 12.8)
        self._figure = Figure(figsize=(size[0] / dense, size[1] / dense), dpi=dense)
        self._canvas = FigureCanvasAgg(self._figure)
        self._inches = np.array(size) / dense
        below = FOOT + (STRIP if run else 0.0)
        # heights of header, legend and strip, width of the colour bar's side, left margin [inch]
        window = (
            round(0.25 * dense),
            round(below * dense),
            size[0] - round(SIDE * dense),
            size[1] - round(HEAD * dense),
        )
        self._still(setup, run, below)
        self._said = self._write(0.985, "", ha="right", animated=True)
        self._cursor = self._strip(run) if run else None
        pen = Canvas(self._canvas.get_renderer(), window, setup.low, setup.high)
        self._stage, self._speed = FramePainter(setup, pen), 1.0
        self._lay()

    def compose(self, shot: Frame, speed: float = 1.0) -> Image:
        """Draw a picture, with the time and the count of what has failed."""
        if speed != self._speed:
            self._speed = speed
            self._lay()
        self._canvas.restore_region(self._background)
        self._stage.draw(shot)
        self._said.set_text(_sentence(shot))
        self._figure.draw_artist(self._said)
        if self._cursor is not None and shot.time is not None:
            self._cursor.set_xdata([shot.time, shot.time])
            self._figure.draw_artist(self._cursor)
        return np.asarray(self._canvas.buffer_rgba())

    def _lay(self) -> None:
        """Draw what stays as it is."""
        self._told.set_text(f"{self._by}{_speed_words(self._speed) if self._cursor else ''}")
        self._canvas.draw()
        self._stage.still()
        self._background = self._canvas.copy_from_bbox(self._figure.bbox)

    def _still(self, setup: Setup, run: History | None, below: float) -> None:
        """Draw title, colour bar and legend."""
        name = run.dataset.attrs["title"] if run else setup.model.structure.name
        self._write(0.02, name[:1].upper() + name[1:], ha="left")
        self._colour_bar(setup.scale, below)
        self._by = f"displacements × {setup.magnification:g}"
        middle = (below - 0.5 * FOOT) / self._inches[1]
        self._figure.legend(
            handles=_symbols(run is not None, bool(setup.outlines)), loc="center left", ncols=6,
            frameon=False, fontsize=TYPE, bbox_to_anchor=(0.01, middle), columnspacing=1.4,
            handletextpad=0.5,
        )  # fmt: skip
        self._told = self._figure.text(
            0.985, middle, "", fontsize=TYPE, ha="right", va="center", color=INK
        )

    def _write(self, x: float, words: str, *, ha: str, animated: bool = False) -> Text:
        """Write into the header."""
        y = 1.0 - 0.5 * HEAD / self._inches[1]
        # sizes of type [points]
        return self._figure.text(
            x, y, words, fontsize=13.0, ha=ha, va="center", color=INK, animated=animated,
            parse_math=False,
        )  # fmt: skip

    def _colour_bar(self, scale: Scale, below: float) -> None:
        """Draw the colour bar at the right of the window."""
        wide, high = self._inches
        tall = 0.86 * (high - below - HEAD)
        low = below + 0.07 * (high - below - HEAD)
        axes = self._axes(wide - SIDE + 0.15, low, 0.16, tall)
        shades = ScalarMappable(Normalize(scale.low, scale.high), scale.shades)
        bar = self._figure.colorbar(shades, cax=axes, extend=scale.extend)
        bar.set_label(scale.label, fontsize=TYPE)
        bar.ax.tick_params(labelsize=TYPE, color=EDGE)
        bar.outline.set(edgecolor=EDGE, linewidth=0.8)

    def _strip(self, run: History) -> Line2D:
        """Draw the acceleration of the ground, and make the cursor that will move over it."""
        axes = self._axes(0.85, 0.55, self._inches[0] - 1.1, STRIP - 0.75)
        times, ground = _ground(run)
        dress(axes, "time [s]", "ground [m/s²]")
        axes.plot(times, ground[:, 0], color=INK, lw=0.9, label="horizontal", zorder=3)
        if ground[:, 1].any():
            axes.plot(times, ground[:, 1], color=LINES[4], lw=0.8, label="vertical")
            axes.legend(
                loc="lower right", bbox_to_anchor=(1.0, 0.94), ncols=2, frameon=False, fontsize=TYPE
            )
        axes.set_xlim(times[0], max(times[-1], times[0] + 1e-9))
        axes.tick_params(labelsize=TYPE)
        axes.xaxis.label.set_fontsize(TYPE)
        axes.yaxis.label.set_fontsize(TYPE)
        if len(times) > len(run.time):
            _flag(axes, run.time[-1], "loose")
        if run.mechanism is not None and run.mechanism.time is not None:
            _flag(axes, run.mechanism.time, "mechanism")
        return axes.axvline(run.time[0], color=HINGE, lw=1.8, animated=True)

    def _axes(self, *box: float) -> Axes:
        """Axes at left, bottom, width and height [inch]."""
        return self._figure.add_axes(tuple(np.array(box) / np.tile(self._inches, 2)))


def _ground(run: History) -> tuple[Array, Array]:
    """Times, and the acceleration of the ground then (n, 2) [m/s²], fall included."""
    data = run.dataset
    if "fall_ground" not in data:
        return run.time, data["ground"].values
    times = np.append(run.time, data["fall_time"].values[1:])
    return times, np.concatenate([data["ground"].values, data["fall_ground"].values[1:]])


def _flag(axes: Axes, time: float, words: str) -> None:
    """Mark an instant."""
    axes.axvline(time, color=FAINT, lw=1.0, ls="--")
    where: dict[str, Any] = {
        "xytext": (0, 1),
        "textcoords": "offset points",
        "ha": "center",
        "va": "bottom",
    }
    place = ("data", "axes fraction")
    axes.annotate(words, (time, 1.0), xycoords=place, fontsize=TYPE, color=EDGE, **where)


def _sentence(shot: Frame) -> str:
    """Time, and how many joints that are judged hinge, slide or are open."""
    time = [] if shot.time is None else [f"t = {shot.time:6.3f} s"]
    return "    ".join([*shot.words, *time])


def _speed_words(speed: float) -> str:
    """How fast a film shows what happens."""
    if abs(speed - 1.0) < 0.01:
        return ", real time"
    if speed < 1.0:
        return f", slow motion: 1/{1.0 / speed:.3g} of real time"
    return f", {speed:.3g} times real time"


def _symbols(film: bool, motion: bool) -> list[Line2D]:
    """What the marks mean, with traces in a film and a mechanism where one moves."""
    moving = [Line2D([], [], color=MOVED, lw=2.4, label="mechanism")] if motion else []
    past = [_symbol("has hinged", "o", HINGE, alpha=0.3)] if film else []
    return [
        Line2D([], [], color=THRUST, lw=2.4, label="thrust line"),
        _symbol("hinge", "o", HINGE),
        *past,
        _symbol("sliding joint", r"$\rightleftharpoons$", SLIP, size=15),
        *moving,
    ]


def _symbol(
    label: str, marker: str, colour: str, *, size: float = 9.0, alpha: float = 1.0
) -> Line2D:
    """One mark of a legend."""
    return Line2D([], [], ls="", marker=marker, ms=size, color=colour, alpha=alpha, label=label)
