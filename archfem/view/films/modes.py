"""Films of vibration shapes."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from archfem.statics.modes import Modes
from archfem.view.films.writer import Image, film_path, write_film
from archfem.view.modes import Panel, mode_panels

FRAMES, FPS = 32, 20.0
"""Pictures of one swing, and how many of them a second shows."""

DENSITY = 100.0
"""Of a film [dots per inch]."""


def film_modes(
    modes: Modes, path: str | Path, numbers: Sequence[int] | None = None, *, swings: int = 1
) -> Path:
    """Film vibration shapes, each panel swinging once in the same time, whatever its period.

    Args:
        modes: as found by `modes`.
        path: the film, .mp4 or .gif, which repeats itself; folders are made.
        numbers: which of them, counted from 1; by default all.
        swings: how often they swing.

    Returns:
        The film's path.

    Raises:
        InvalidInput: a number is not among them, or the suffix is not that of a film.
    """
    target = film_path(path)
    figure, panels = mode_panels(modes, numbers)
    return write_film(target, _shots(figure, panels, swings), FPS)


def _shots(figure: Figure, panels: Sequence[Panel], swings: int) -> Iterator[Image]:
    """Yield the pictures of some swings (height, width, 3), of even numbers of pixels."""
    figure.set_dpi(DENSITY)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    figure.set_layout_engine("none")  # nothing on the page will move but the blocks
    for turn in np.tile(np.arange(FRAMES) / FRAMES, swings):
        for panel in panels:
            panel.swing(float(np.sin(2.0 * np.pi * turn)))
        canvas.draw()
        page = np.asarray(canvas.buffer_rgba())
        yield page[: page.shape[0] // 2 * 2, : page.shape[1] // 2 * 2, :3].copy()
