"""Common style of all figures: colours, type sizes, axes, titles, legends and annotations."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from string import ascii_lowercase
from textwrap import fill
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.collections import PolyCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure, FigureBase
from matplotlib.layout_engine import LayoutEngine, PlaceHolderLayoutEngine
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation, Text
from matplotlib.textpath import TextPath
from matplotlib.ticker import LogFormatter, LogFormatterMathtext, MaxNLocator
from matplotlib.transforms import Bbox

from archfem._files import atomic_write
from archfem._typing import Array
from archfem._validation import check_number, validate_arguments
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure, join_names


class Colour:
    """Colours of figures and films, by the thing that they show."""

    STONE, SUPPORT, SOIL = "#ece7dd", "#b9b3a6", "#f6f3ec"
    EDGE, UNDEFORMED = "#6b655a", "#cfcac0"  # outlines of blocks, and of blocks as built
    TEXT, GREY = "#1b1b1b", "#8d8d8d"
    THRUST, HINGE, SLIDING = "#0b4f8a", "#d7261e", "#e08a00"
    MECHANISM, LOAD = "#009e73", "#7b3294"

    # lines that share axes; apart in grey, and with all common kinds of colour blindness
    LINES = ("#083685", "#e69500", "#009068", "#a13179", "#90d2f2", "#151515")
    # in place of those which a dark page, that inverts figures, shows dark
    INVERTED = (LINES[1], "#c88000"), (LINES[4], "#64aed4")

    # scale of values, from low to high
    MAP = LinearSegmentedColormap.from_list(
        "archfem", (STONE, "#bcd9d3", "#7fb8b8", "#4690a3", "#2f6485")
    )


def line_style(number: int) -> dict[str, Any]:
    """Return the colour of one of several lines, and its dashes from the fifth line on."""
    return {"color": Colour.LINES[number], "ls": ("-", "-", "-", "-", "--", "-.")[number]}


class Size:
    """Font sizes [points], and widths of figures [inch]."""

    NOTE, LABEL, TITLE = 7.0, 8.0, 9.5  # LABEL also of ticks and legends; none is smaller than NOTE
    # a page of A4 prints 170 mm: no figure is wider, so that its type is printed as it is
    COLUMN, PAGE = 6.4, 170.0 / 25.4
    # of a structure: a report leaves no more of a page empty where a figure moves to the next
    HEIGHT = 107.0 / 25.4


# Percentage of stresses beyond the end of a colour scale: peaks at the corners about which blocks
# rotate would otherwise set the scale
CLIPPED_PERCENT = 0.5


class Page(Figure):
    """A figure whose names and titles are plain text, even if they contain a $."""

    def draw(self, renderer: RendererBase) -> None:
        """Draw the figure."""
        # a file is drawn twice, and laid out by the first drawing alone
        if not isinstance(self.get_layout_engine(), PlaceHolderLayoutEngine):
            letter_panels(self)
            disable_math(self)
            # axes true to scale shrink within their place: the next layout has room for their texts
            engine = self.get_layout_engine()
            if engine is not None and any(axes.get_aspect() != "auto" for axes in self.axes):
                engine.execute(self)
                self._trim(engine, renderer)
            for axes in self.axes:
                place_names(axes, renderer)
        super().draw(renderer)

    def _trim(self, engine: LayoutEngine, renderer: RendererBase) -> None:
        """Cut the height that a single drawing, true to scale and less high, leaves empty."""
        drawn = [axes for axes in self.axes if axes.get_label() != "<colorbar>"]
        if len(drawn) == 1 and drawn[0].axison:
            drawn[0].apply_aspect()
            place = drawn[0].get_position(original=True).y0 * self.get_figheight()
            below = drawn[0].get_tightbbox(renderer).y0 / self.dpi
            self.set_figheight(self.get_figheight() - max(below - place, 0.0))
            engine.execute(self)


def letter_panels(figure: Figure) -> None:
    """Letter the panels of a figure that has several, before their titles or above them."""
    # axes that share a place, such as those of a second scale, are one panel; a colour bar is none
    panels: dict[Any, Axes] = {}
    for axes in figure.axes:
        place = axes.get_subplotspec()
        if place is not None and axes.get_visible() and axes.get_label() != "<colorbar>":
            panels.setdefault(place, axes)
    if len(panels) < 2:
        return
    for letter, axes in zip(ascii_lowercase, panels.values(), strict=False):
        text, mark = axes.get_title(), f"({letter})"
        if text and not text.startswith(mark):
            axes.title.set_text(f"{mark} {text}")
        elif not text:
            axes.set_title(mark, loc="left", fontsize=Size.LABEL, color=Colour.TEXT)


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size [inch], at most as wide as a page."""
    return Page(figsize=(min(width, Size.PAGE), height), layout="constrained")


def limit_width(millimetres: float) -> AbstractContextManager[None]:
    """Draw the figures of a `with` block for a width at which they are printed, such as a column.

    Type keeps its size, 7 points at least; titles and legends take more lines.

    Args:
        millimetres: the largest width [mm], from 60 to 170, the width of a page.

    Raises:
        InvalidInput: the width is not within these limits.
    """
    return _change_width(check_number(millimetres, "width [mm]", minimum=60.0, maximum=170.0))


@contextmanager
def _change_width(millimetres: float) -> Iterator[None]:
    """Change the widths of figures within a block."""
    kept = Size.COLUMN, Size.PAGE
    Size.PAGE = millimetres / 25.4
    Size.COLUMN = min(Size.COLUMN, Size.PAGE)
    try:
        yield
    finally:
        Size.COLUMN, Size.PAGE = kept


class PowersOfTen(LogFormatter):
    """Labels of a logarithmic axis, such as 10⁻² and 2×10⁻², in plain text."""

    def __call__(self, value: float, pos: int | None = None) -> str:
        """Return the label of a value, empty where the axis has no room for one."""
        if not super().__call__(value, pos):
            return ""
        factor, exponent = f"{value:.0e}".split("e")
        power = "10" + str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return power if factor == "1" else f"{factor}×{power}"


def disable_math(drawing: FigureBase) -> None:
    """Show all texts as plain text, also the powers of ten at logarithmic axes."""
    for text in drawing.findobj(Text):
        text.set_parse_math(False)
    for axis in (axis for axes in drawing.axes for axis in (axes.xaxis, axes.yaxis)):
        if isinstance(axis.get_major_formatter(), LogFormatterMathtext):
            axis.set_major_formatter(PowersOfTen())
        if isinstance(axis.get_minor_formatter(), LogFormatterMathtext):
            axis.set_minor_formatter(PowersOfTen(labelOnlyBase=False))


def text_width(letters: float, size: float = Size.LABEL) -> float:
    """Return the approximate width of a text [inch]; a letter is 0.56 of the font size wide."""
    return letters * 0.56 * size / 72.0


def panel_grid(count: int) -> tuple[int, int]:
    """Return rows and columns of panels: side by side on a page, in a column one below another."""
    return (1, count) if Size.PAGE > 5.0 else (count, 1)


def set_title(axes: Axes, text: str, size: float = Size.TITLE) -> None:
    """Set the title of axes, wrapped to the width of their part of the figure."""
    place, width, indent = axes.get_subplotspec(), axes.figure.get_figwidth(), ""
    if place is not None and place.get_gridspec().ncols * place.get_gridspec().nrows > 1:
        indent = "(a) "  # the letter of the panel follows at last
    if place is not None and (columns := place.get_gridspec().ncols) > 1:
        ratios = np.array(place.get_gridspec().get_width_ratios() or np.ones(columns), dtype=float)
        width *= ratios[list(place.colspan)].sum() / ratios.sum()
    width -= 0.3  # labels of the axis at the left shift the panel
    text, letters = " ".join(text.split()), max(int(width / text_width(1, size)), 12)
    for narrower in range(letters, 11, -1):
        lines = fill(text, narrower, initial_indent=indent, break_long_words=False)
        # capitals are 0.2 of the font size wider than other letters
        wide = [len(line) + 0.35 * sum(map(str.isupper, line)) for line in lines.splitlines()]
        if max(wide, default=0.0) <= letters:
            break
    lines = lines.removeprefix(indent)
    axes.set_title(lines, fontsize=size, color=Colour.TEXT, parse_math=False)


def set_figure_title(figure: Figure, text: str) -> None:
    """Set the title of a figure, wrapped to its width."""
    letters = int((figure.get_figwidth() - 0.2) / text_width(1, Size.TITLE))
    lines = "\n".join(fill(line, letters) for line in text.splitlines())
    figure.suptitle(lines, fontsize=Size.TITLE, color=Colour.TEXT)


def add_note(figure: Figure, notes: Mapping[str, str]) -> None:
    """Write notes above the panels of a figure; those that differ are preceded by their labels."""
    labels: dict[str, list[str]] = {}
    for label, note in notes.items():
        labels.setdefault(note, []).append(label)
    several = len(labels) > 1
    texts = [f"{join_names(labels[note])}: {note}" if several else note for note in labels if note]
    if texts and not figure.get_suptitle():  # a figure of the user may have a title
        letters = int(figure.get_figwidth() / text_width(1, Size.NOTE))
        text = "\n".join(fill(each, letters) for each in texts)
        figure.suptitle(text, fontsize=Size.NOTE, color=Colour.EDGE, parse_math=False)
        figure.set_figheight(figure.get_figheight() + 0.12 * (1 + text.count("\n")))


def style_axes(axes: Axes, x: str = "", y: str = "", size: float = Size.LABEL) -> None:
    """Label the axes in a font size [points] and apply the common style."""
    axes.set_xlabel(x, fontsize=size)
    axes.set_ylabel(y, fontsize=size)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set(color=Colour.EDGE, linewidth=0.8)
    axes.tick_params(labelsize=size, color=Colour.EDGE, width=0.8, length=3.0)


def style_length_axes(axes: Axes) -> None:
    """Style axes that show lengths [m] true to scale."""
    style_axes(axes, "x [m]", "y [m]")
    axes.ticklabel_format(style="plain", useOffset=False)  # of a survey, to be found in a drawing
    # below the title, for which a layout leaves room at the top of the place of the axes
    axes.set_aspect("equal", anchor="N")


def new_axes(width: float, height: float, x: str = "", y: str = "") -> tuple[Figure, Axes]:
    """Return an empty figure of a size [inch] and its only axes, with their labels."""
    figure = new_figure(width, height)
    axes = figure.add_subplot()
    style_axes(axes, x, y)
    return figure, axes


def structure_axes(structure: Structure, axes: Axes | None = None) -> Axes:
    """Return styled axes that show a structure true to scale, by default those of a new figure."""
    axes = structure_figure(structure).add_subplot() if axes is None else axes
    style_length_axes(axes)
    low, high = outline_bounds(structure)
    # a tick label takes about 0.55 inch; of a slender structure there is one
    most = int(np.clip(drawing_scale(structure) * (high - low)[0] / 0.55, 1, 9))
    axes.xaxis.set_major_locator(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10], min_n_ticks=1))
    return axes


def style_colour_bar(bar: Colorbar, label: str, size: float = Size.LABEL) -> None:
    """Label a colour bar and apply the common style."""
    bar.set_label(label, fontsize=size)
    bar.ax.tick_params(labelsize=size, color=Colour.EDGE)
    bar.outline.set(edgecolor=Colour.EDGE, linewidth=0.8)


def glyph_marker(letter: str = "⇌") -> Outline:
    """Return a letter as a marker, by default two harpoons, the symbol of a sliding joint."""
    # as mathematical text it would load a parser, and fonts that may be missing
    glyph = TextPath((0.0, 0.0), letter)
    return Outline(glyph.vertices - glyph.get_extents().get_points().mean(axis=0), glyph.codes)


def white_halo(width: float) -> list[withStroke]:
    """Return path effects that draw a white stroke behind a line or a text."""
    return [withStroke(linewidth=width, foreground="white")]


def annotate(
    axes: Axes,
    text: str,
    point: Array | tuple[float, float],
    offset: Array | tuple[float, float] = (0.0, 0.0),
    **style: Any,
) -> Annotation:
    """Write a text at an offset [points] from a point."""
    default = {"textcoords": "offset points", "fontsize": Size.LABEL, "color": Colour.TEXT}
    return axes.annotate(text, tuple(point), tuple(offset), **(default | style))


def short_name(name: str, part: str) -> str:
    """Return the name of a joint within its part: "5" for "main arch, joint 5"."""
    own = name.removeprefix(f"{part}, ")
    return own.removeprefix("joint ") or own


def write_name(
    axes: Axes, name: str, point: Any, way: Any = (0.0, 0.0), size: float = Size.NOTE
) -> Annotation:
    """Write a name on a white halo at a point, or beside it, best in a direction (2,)."""
    look: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 9, "fontsize": size}
    # the halo covers the line of a block within a word
    look |= {"path_effects": white_halo(2.6), "gid": "beside" if np.any(way) else "at"}
    note = annotate(axes, name, point, reach_name(name, np.asarray(way), size), **look)
    note.set_in_layout(not np.any(way))  # a layout moves what it would be placed by
    return note


def reach_name(name: str, way: Array, size: float = Size.NOTE) -> Array:
    """Return the offset of the middle of a name beside its point, in a direction (2,) [points]."""
    return (4.0 + size * (0.4 + 0.28 * abs(way[0]) * len(name))) * way


def place_names(axes: Axes, renderer: RendererBase) -> None:
    """Turn names about their points where they would cover others, hinges, ties or edges."""
    names = [text for text in axes.texts if text.get_gid() == "beside"]
    if not names:
        return
    axes.apply_aspect()
    points = axes.figure.dpi / 72.0
    taken = [text.get_window_extent(renderer) for text in axes.texts if text not in names]
    for line in axes.lines:
        half = 0.4 * line.get_markersize() * points
        if line.get_marker() != "None" and half > 1.5 * points:  # not the points of thrust
            places = line.get_transform().transform(line.get_xydata())
            taken += [Bbox([place - half, place + half]) for place in places]
    edges = [line.get_transform().transform_path(line.get_path()) for line in axes.lines]
    for drawn in axes.collections:
        edges += map(drawn.get_transform().transform_path, drawn.get_paths())
    turns = np.exp(1j * np.deg2rad([0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0]))
    for name in names:
        first, box = np.array(name.xyann), name.get_window_extent(renderer)
        ways = complex(*first) / np.hypot(*first) * turns
        text, both = name.get_text(), [*ways, *(1.8 * ways)]
        offsets = [reach_name(text, np.array([w.real, w.imag])) for w in both]
        boxes = [box.translated(*(points * (offset - first))) for offset in offsets]

        def cost(box: Bbox) -> int:
            covered = sum(map(box.overlaps, taken)) + (axes.bbox.count_contains(box.corners()) < 4)
            return 8 * covered + sum(edge.intersects_bbox(box, filled=False) for edge in edges)

        best = int(np.argmin([*map(cost, boxes)]))
        name.xyann = tuple(offsets[best])
        taken.append(boxes[best])


def add_polygons(
    axes: Axes,
    outlines: Sequence[Array],
    face: str | list[str],
    *,
    edge: str = Colour.EDGE,
    width: float = 0.7,
    zorder: float = 1,
    **options: Any,
) -> None:
    """Add polygons, each (k, 2), with a face and an edge colour, and a width of the edge."""
    style = {"facecolors": face, "edgecolors": edge, "linewidths": width, "zorder": zorder}
    axes.add_collection(PolyCollection(outlines, **style, **options))


def add_legend_below(figure: Figure, columns: int = 4, **options: Any) -> None:
    """Add a legend below all panels, what several have once, of at most so many columns."""
    handles = list[Artist]()
    for axes in figure.axes:
        known = {handle.get_label() for handle in handles}
        own = axes.get_legend_handles_labels()[0]
        handles += [handle for handle in own if handle.get_label() not in known]
    options = {"frameon": False, "fontsize": Size.LABEL, "handles": handles} | options
    labels = [str(handle.get_label()) for handle in options["handles"]]
    columns = min(columns, legend_columns(labels, figure.get_figwidth()))
    figure.legend(loc="outside lower center", ncols=columns, **options)


def legend_columns(labels: Sequence[str], width: float) -> int:
    """Return the number of columns of a legend that fit a width [inch]."""
    # the symbol of an entry takes 0.6 inch
    sizes = [0.6 + text_width(max(map(len, label.split("\n")))) for label in labels]
    for columns in range(len(sizes), 1, -1):
        # as matplotlib divides them
        if sum(max(column) for column in np.array_split(sizes, columns)) <= width:
            return columns
    return 1


def add_legend(axes: Axes) -> None:
    """Add a legend: below axes that have a figure of their own, else inside the axes."""
    page = axes.figure
    if len(page.axes) == 1 and isinstance(page, Figure) and page.get_layout_engine() is not None:
        add_legend_below(page)
    else:
        axes.legend(frameon=False, fontsize=Size.LABEL)
    disable_math(page)


def outline_bounds(structure: Structure) -> tuple[Array, Array]:
    """Return the lower left and upper right corner of all blocks, each (2,) [m]."""
    points = np.concatenate([block.drawn() for block in structure.blocks])
    return points.min(axis=0), points.max(axis=0)


def drawing_scale(structure: Structure) -> float:
    """Return the approximate scale at which a structure is drawn on its own figure [inch / m]."""
    low, high = outline_bounds(structure)
    width, height = high - low
    # margins: 0.8 inch beside the drawing, 1.2 above and below
    return float(min((Size.PAGE - 0.8) / width, (Size.HEIGHT - 1.2) / height))


def structure_figure(structure: Structure) -> Figure:
    """Return an empty figure that fits a structure."""
    low, high = outline_bounds(structure)
    # in a narrow figure title and legend take a line more each
    margins = [0.8, 1.2 if Size.PAGE > 5.0 else 1.6]
    width, height = drawing_scale(structure) * (high - low) + margins
    return new_figure(max(0.5 * Size.COLUMN, width), max(0.35 * Size.COLUMN, height))


@validate_arguments
def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure to a file atomically; the suffix selects the format (.pdf, .svg, .png, …).

    Args:
        figure: the figure.
        path: path of the file; missing folders are created.

    Returns:
        The path of the file.

    Raises:
        InvalidInput: the suffix is not that of a picture format.
    """
    target = Path(path)
    kinds = sorted(figure.canvas.get_supported_filetypes())
    kind = target.suffix.removeprefix(".").lower()
    if kind not in kinds:
        raise InvalidInput(f"{target} has suffix '{target.suffix}': use one of {kinds}")
    if not isinstance(figure, Page):  # it disables math itself whenever it is drawn
        disable_math(figure)
    # text stays text, which can be searched and edited; names of parts are the same at every run
    fixed = {"pdf.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "archfem"}
    # a tenth larger than by the default level, in two thirds of the time
    own: Any = {"png": {"pil_kwargs": {"compress_level": 3}}, "svg": {"metadata": {"Date": None}}}
    with atomic_write(target) as draft, matplotlib.rc_context(fixed):
        figure.savefig(draft, format=kind, dpi=300, **own.get(kind, {}))
    return target


# Contents of result files by name: a text, a figure, or a function that writes the file
Files = dict[str, str | Figure | Callable[[Path], object]]


def write_files(files: Files, folder: Path) -> list[Path]:
    """Write files to a folder, each atomically, and return their paths."""
    for name, content in files.items():
        if isinstance(content, Figure):
            save(content, folder / name)
        elif isinstance(content, str):
            with atomic_write(folder / name) as draft:
                draft.write_text(content + "\n", encoding="utf-8")
        else:
            content(folder / name)
    return [folder / name for name in files]
