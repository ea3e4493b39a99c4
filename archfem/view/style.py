"""One look for all pictures: colours, sizes, and axes that carry units."""

from pathlib import Path
from textwrap import fill

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import LogFormatter, MaxNLocator

from archfem._files import atomic_write
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure

STONE, SUPPORT, EDGE = "#ece7dd", "#b9b3a6", "#6b655a"
SOIL = "#f6f3ec"
INK, FAINT, GHOST = "#1b1b1b", "#8d8d8d", "#cfcac0"
THRUST, HINGE, SLIP = "#0b4f8a", "#d7261e", "#e08a00"
MOVED = "#009e73"
LOAD = "#7b3294"
# Colours of lines that share axes; they stay apart for all common kinds of colour blindness
LINES = ("#0b4f8a", "#e08a00", "#009e73", "#cc6fa4", "#56b4e9", "#1b1b1b")

# From none to much
LIGHT_TO_DARK = LinearSegmentedColormap.from_list(
    "archfem", (STONE, "#bcd9d3", "#7fb8b8", "#4690a3", "#2f6485")
)

# Percentage of stresses left beyond the scale: the corners on which blocks turn would otherwise
# take all of it
BEYOND = 0.5

# Sizes of type [points]: ticks, legends and labels; titles
SMALL, NORMAL = 8.0, 9.5

# Width and largest height of a picture [inch]
COLUMN = 6.4

# Width of a picture of a long structure, or of many panels [inch]
WIDE = 11.0

# Width over height from which a structure is long; a ring has at most about 3
LONG = 4.0


# Width of a letter, relative to the size of its type in points [inch]
LETTER = 0.56 / 72.0

# Height of a line of a legend [inch]
LINE = 0.17

# Room that an entry of a legend takes beside its words [inch]
SYMBOL = 0.6


class Page(Figure):
    """A page on which names and titles are words, though they hold a $."""

    def draw(self, renderer: RendererBase) -> None:
        """Draw it."""
        plain(self)
        super().draw(renderer)


def plain(drawn: Artist) -> None:
    """Take every text for words, not for mathematics; only powers of ten at an axis are that."""
    powers = {
        label
        for axes in drawn.findobj(Axes)
        for axis in (axes.xaxis, axes.yaxis)
        if isinstance(axis.get_major_formatter(), LogFormatter)
        for label in axis.get_ticklabels(which="both")
    }
    for text in drawn.findobj(Text):
        if text not in powers:
            text.set_parse_math(False)


def entitle(axes: Axes, words: str) -> None:
    """Write a title above axes, in as many lines as their part of the page has it take."""
    place = axes.get_subplotspec()
    parts = 1 if place is None else place.get_gridspec().ncols
    letters = int(axes.figure.get_figwidth() / parts / (LETTER * NORMAL))
    lines = fill(" ".join(words.split()), max(letters, 12), break_long_words=False)
    axes.set_title(lines, fontsize=NORMAL, color=INK, parse_math=False)


def stand(axes: Axes, structure: Structure) -> None:
    """Dress axes in which a structure stands, true to scale, with room between ticks."""
    dress(axes, "x [m]", "y [m]")
    axes.set_aspect("equal")
    wide = np.ptp(np.concatenate([block.drawn()[:, 0] for block in structure.blocks]))
    broad = scale_of(structure) * wide
    # room that the label of a tick takes [inch]
    axes.xaxis.set_major_locator(
        MaxNLocator(int(np.clip(broad / 0.55, 1, 9)), steps=[1, 2, 2.5, 5, 10])
    )


def dress(axes: Axes, x: str = "", y: str = "") -> None:
    """Label axes and take away what is not needed."""
    axes.set_xlabel(x, fontsize=SMALL)
    axes.set_ylabel(y, fontsize=SMALL)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set(color=EDGE, linewidth=0.8)
    axes.tick_params(labelsize=SMALL, color=EDGE, width=0.8, length=3.0)


def legend(axes: Axes) -> None:
    """Explain what is labelled: below axes that have a page to themselves, else among the lines."""
    page = axes.figure
    if len(page.axes) == 1 and isinstance(page, Figure) and page.get_layout_engine() is not None:
        labels = axes.get_legend_handles_labels()[1]
        longest = max((len(line) for label in labels for line in label.split("\n")), default=0)
        fitting = int(page.get_figwidth() / (SYMBOL + longest * LETTER * SMALL))
        columns = max(1, min(4, fitting))
        page.legend(loc="outside lower center", ncols=columns, frameon=False, fontsize=SMALL)
    else:
        axes.legend(frameon=False, fontsize=SMALL)
    plain(page)


def renew_legend(page: Figure) -> None:
    """Explain anew what is labelled, where more was drawn after a page was explained."""
    for old in page.legends:
        old.remove()
    legend(page.axes[0])
    lines = sum(1 + text.get_text().count("\n") for text in page.legends[0].get_texts())
    page.set_figheight(page.get_figheight() + LINE * (lines - 1))


def canvas(structure: Structure) -> Figure:
    """Return an empty page that fits a structure, long ones on a wide page."""
    points = np.concatenate([block.drawn() for block in structure.blocks])
    wide, high = np.ptp(points, axis=0)
    scale = scale_of(structure)
    size = max(0.5 * COLUMN, scale * wide + 0.8), max(0.35 * COLUMN, scale * high + 1.2)
    return Page(figsize=size, layout="constrained")


def scale_of(structure: Structure) -> float:
    """Return how large a structure is drawn on a page of its own, about [inch / m]."""
    points = np.concatenate([block.drawn() for block in structure.blocks])
    wide, high = np.ptp(points, axis=0)
    room = COLUMN if wide < LONG * high else WIDE
    # width and largest height of a picture [inch]
    return float(min((room - 0.8) / wide, (6.8 - 1.2) / high))


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure in one stroke: the suffix says how (.pdf, .svg, .png, …).

    Args:
        figure: what to write.
        path: the file; folders are made.

    Returns:
        The file's path.

    Raises:
        InvalidInput: the suffix is not one of a picture.
    """
    target = Path(path)
    kinds = sorted(figure.canvas.get_supported_filetypes())
    kind = target.suffix.removeprefix(".").lower()
    if kind not in kinds:
        raise InvalidInput(f"{target} has suffix '{target.suffix}': use one of {kinds}")
    plain(figure)
    fonts = {"pdf.fonttype": 42, "svg.fonttype": "none"}
    with atomic_write(target) as draft, matplotlib.rc_context(fonts):
        figure.savefig(draft, format=kind, dpi=300)
    return target
