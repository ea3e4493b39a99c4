"""A page about a structure that moves: title, colour bar, legend, and the ground's motion."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from archfem.arrays import Array
from archfem.dynamics.history import History
from archfem.view.films.colours import Scale
from archfem.view.films.pen import Pen
from archfem.view.films.setup import Setup
from archfem.view.films.shots import Shot
from archfem.view.films.stage import Stage
from archfem.view.films.writer import Image
from archfem.view.style import EDGE, FAINT, HINGE, INK, LINES, MOVED, SLIP, THRUST, dress

BROAD, COARSE = 12.8, 60.0
"""Width of a page [inch], and the least of its dots per inch: a smaller page is narrower."""

HEAD, SIDE, FOOT, STRIP, EDGE_ROOM = 0.55, 1.25, 0.45, 1.75, 0.25
"""Heights of header, legend and strip, width of the colour bar's side, left margin [inch]."""

TYPE, LARGE = 10.5, 13.0
"""Sizes of type [points]."""


class Page:
    """A page on which only what changes is drawn again."""

    def __init__(self, setup: Setup, size: tuple[int, int], run: History | None = None) -> None:
        dense = max(COARSE, size[0] / BROAD)
        self._figure = Figure(figsize=(size[0] / dense, size[1] / dense), dpi=dense)
        self._canvas = FigureCanvasAgg(self._figure)
        self._inches = np.array(size) / dense
        below = FOOT + (STRIP if run else 0.0)
        window = (
            round(EDGE_ROOM * dense),
            round(below * dense),
            size[0] - round(SIDE * dense),
            size[1] - round(HEAD * dense),
        )
        self._still(setup, run, below)
        self._said = self._write(0.985, "", ha="right", animated=True)
        self._cursor = self._strip(run) if run else None
        pen = Pen(self._canvas.get_renderer(), window, setup.low, setup.high)
        self._stage, self._speed = Stage(setup, pen), 1.0
        self._lay()

    def compose(self, shot: Shot, speed: float = 1.0) -> Image:
        """Draw a picture, with the time and the count of what has failed.

        Args:
            shot: what it shows.
            speed: at which a film shows it, relative to the real one [-].

        Returns:
            The page (height, width, 4), red, green, blue and opacity from 0 to 255; the next call
            draws over it.
        """
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
        page: Image = np.asarray(self._canvas.buffer_rgba())
        return page

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
        return self._figure.text(
            x, y, words, fontsize=LARGE, ha=ha, va="center", color=INK, animated=animated,
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


def _sentence(shot: Shot) -> str:
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
