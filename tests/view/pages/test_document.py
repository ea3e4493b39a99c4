"""Documents: words escaped, tables and figures as they should be."""

import re
from pathlib import Path

from matplotlib.figure import Figure
from pages import read_page

from archfem.view.pages import document
from archfem.view.pages.document import Document, FigureBlock, Grid, Section, TextBlock


def test_words_of_users_are_escaped_and_numbers_typeset():
    evil = "<script>alert(1)</script>"
    pieces = [
        TextBlock(f"{evil} and `a < b`", "missing"),
        TextBlock(evil, "lines"),
        Grid([evil, "x"], [[evil, "-0.5"], ["-", "a-b"]], evil),
        Grid((), [(evil, evil)]),
        FigureBlock.of(Figure(figsize=(2.0, 1.0)), evil),
    ]
    page = Document(evil, evil, [(evil, evil)], [Section(evil, pieces)], evil).page
    read = read_page(page)
    assert evil not in page
    assert read.words.count(evil) >= 10
    assert {"−0.5", "–", "a-b", "a < b"} <= set(read.words)
    assert page.count("data:image/svg+xml;base64,") == 1
    assert "width:2.0in" in page


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
