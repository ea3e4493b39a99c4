"""Documents: words escaped, tables and figures as they should be."""

from matplotlib.figure import Figure
from pages import read_page

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
