"""Documents: words escaped, tables and figures as they should be."""

import re
from base64 import b64decode
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from pages import read_page

from archfem.view.pages import document
from archfem.view.pages.document import Document, FigureBlock, Grid, Section, TextBlock
from archfem.view.style import Colour


def test_words_of_users_are_escaped_and_numbers_typeset():
    evil = "<script>alert(1)</script>"
    pieces = [
        TextBlock(f"{evil} and `a < b`", "missing"),
        TextBlock(evil, "lines"),
        Grid([evil, "x"], [[evil, "-0.5"], ["-", "a-b"], ["`c < d`", "e"]], evil),
        Grid((), [(evil, evil)]),
        FigureBlock.of(Figure(figsize=(2.0, 1.0)), evil),
    ]
    page = Document(evil, evil, [(evil, evil)], [Section(evil, pieces)], evil).page
    read = read_page(page)
    assert evil not in page
    assert read.words.count(evil) >= 10
    assert {"−0.5", "–", "a-b", "a < b", "c < d"} <= set(read.words)
    assert page.count("data:image/svg+xml;base64,") == 1
    assert "width:2.04in" in page


def test_figures_have_no_room_around_their_drawings():
    """Axes of half the width of a figure, without words."""
    figure = Figure(figsize=(4.0, 2.0))
    figure.add_axes((0.25, 0.25, 0.5, 0.5)).tick_params(labelbottom=False, labelleft=False)
    assert 2.0 < FigureBlock.of(figure, "").inches < 2.2


def test_no_letter_is_an_upright_rectangle():
    """Printers draw those at least a pixel wide: l and I looked smudged."""
    figure = Figure(figsize=(2.0, 1.0))
    figure.suptitle("fill")
    drawn = b64decode(FigureBlock.of(figure, "").source.partition(",")[2]).decode()
    texts = re.findall(r'transform="(translate[^"]*scale\([^"]*)"', drawn)
    assert texts
    assert all("skewX(0.1) scale(" in transform for transform in texts)


def test_text_contrasts_with_its_ground_in_both_colour_schemes():
    """WCAG 2 requires a contrast of 4.5 of body text; relative luminance as it defines."""
    style = (Path(document.__file__).parent / "templates" / "page.css").read_text(encoding="utf-8")
    schemes = [
        dict(re.findall(r"--([a-z]+): #([0-9a-f]{6})", part))
        for part in style.split("@media screen")[:2]
    ]

    def luminance(colour):
        parts = [int(colour[k : k + 2], 16) / 255 for k in (0, 2, 4)]
        linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    for colours in schemes:
        for text in ("ink", "soft", "faint", "thrust"):
            for ground in ("paper", "wash"):
                low, high = sorted(luminance(colours[name]) for name in (text, ground))
                assert (high + 0.05) / (low + 0.05) >= 4.5, (text, ground)


@pytest.mark.parametrize(("lines", "kept"), [(4, 1), (40, 0)])
def test_text_in_columns_breaks_anywhere(lines, kept):
    """What looks like a table is kept whole, but not beside others in columns."""
    table = "\n".join(["a  b"] * lines)
    page = Document("", "", [], [Section("", [TextBlock(f"title\n\n{table}", "lines")])]).page
    assert page.count('<span class="table">') == kept
    assert page.count('<pre class="long">') == 1 - kept


@pytest.mark.parametrize(("lines", "kept"), [(8, 1), (12, 0)])
def test_a_few_lines_of_text_are_kept_whole(lines, kept):
    page = Document("", "", [], [Section("", [TextBlock("a\n" * lines, "lines")])]).page
    assert page.count('<pre class="few">') == kept


@pytest.mark.parametrize(("letters", "kept"), [(60, 1), (100, 0)])
def test_a_list_of_terms_of_more_than_a_few_lines_breaks(letters, kept):
    """Kept whole it would leave a third of a page empty, as digests of inputs did."""
    rows = [("SHA", "0" * letters)] * 6
    page = Document("", "", [], [Section("", [Grid((), rows)])]).page
    assert page.count('class="terms whole"') == kept


def test_lines_of_a_figure_are_seen_on_a_dark_page():
    """Contrast by WCAG 2.1 of 3 for graphics, after the filters of CSS (Filter Effects 1, 8)."""
    css = (Path(document.__file__).parent / "templates" / "page.css").read_text(encoding="utf-8")
    dark = css.partition("prefers-color-scheme: dark")[2]
    paper = re.search(r"--paper: (#\w+)", dark)[1]
    share = float(
        re.search(r"\.plate img \{ filter: invert\((.*?)\) hue-rotate\(180deg\)", dark)[1]
    )
    # rows of red, green and blue: 2 × weights of luminance on all, minus the identity
    turn = 2.0 * np.array([[0.213, 0.715, 0.072]] * 3) - np.eye(3)

    def luminance(rgb):
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        return linear @ [0.2126, 0.7152, 0.0722] + 0.05

    figure = Figure(figsize=(4.0, 3.0))
    axes = figure.add_subplot()
    for colour in Colour.LINES:
        axes.plot([0.0, 1.0], color=colour)
    drawn = b64decode(FigureBlock.of(figure, "").source.partition(",")[2]).decode()
    rules = drawn.partition("(prefers-color-scheme: dark)")[2].partition("</style>")[0]
    ground = luminance(np.array(matplotlib.colors.to_rgb(paper)))
    for colour in Colour.LINES:
        assert f"stroke: {colour}" in drawn
        new = re.search(rf'"stroke: {colour}"\] {{ stroke: (#\w+)', rules)
        rgb = np.array(matplotlib.colors.to_rgb(new[1] if new else colour))
        shown = np.clip(turn @ (share - (2.0 * share - 1.0) * rgb), 0.0, 1.0)
        assert luminance(shown) / ground >= 3.0
