"""A pen that draws many pieces at once, in metres, into a window of a page of pixels."""

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.path import Path
from matplotlib.transforms import Bbox, IdentityTransform

from archfem.arrays import Array

TOGETHER = 4000
"""Lines that are drawn in one stroke: the renderer has room for so many and more."""

FULL = 1100.0
"""Width of a window at which lines are as wide as given [pixels]."""

THINNEST = 0.6
"""Width of lines in small windows, relative to that."""


class Pen:
    """Draws on what lies below, in the order in which it is told to.

    Args:
        renderer: of the page.
        window: left, lower, right and upper end of what is drawn into [pixels].
        low: lower left corner of what is seen (2,) [m].
        high: upper right corner of it (2,) [m].
    """

    def __init__(
        self, renderer: RendererAgg, window: tuple[int, int, int, int], low: Array, high: Array
    ) -> None:
        self._renderer = renderer
        self._window = Bbox.from_extents(*window)
        room, self._whole = np.array([self._window.width, self._window.height]), IdentityTransform()
        self._scale = float(np.min(room / (high - low)))
        self._origin = np.array(window[:2]) + 0.5 * room - 0.5 * self._scale * (low + high)
        self._broad = max(THINNEST, self._window.width / FULL) * 72.0 / renderer.dpi

    def lines(self, pieces: Array, colour: str, width: float) -> None:
        """Draw straight lines.

        Args:
            pieces: their ends (n, 2, 2) [m].
            colour: of all of them.
            width: in a window of full size [pixels].
        """
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
        """Fill polygons of equally many corners.

        Args:
            outlines: (n, corners, 2) [m].
            colour: of all of them.
            opacity: from 0 to 1.
        """
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
        """Fill triangles with colours that run straight between their corners.

        Args:
            corners: (t, 3, 2) [m].
            colours: there (t, 3, 4), red, green, blue and opacity from 0 to 1.
        """
        style = self._style("white")
        self._renderer.draw_gouraud_triangles(style, self._pixels(corners), colours, self._whole)

    def _pixels(self, points: Array) -> Array:
        """Where points (…, 2) [m] are on the page [pixels]."""
        found: Array = self._origin + self._scale * points
        return found

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
