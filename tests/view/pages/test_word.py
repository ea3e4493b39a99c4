"""Documents for Word: read again by python-docx, or refused where it is missing."""

import sys

import pytest

from archfem.errors import NotInstalled
from archfem.view.pages.document import Document, FigureBlock, Grid, Section, TextBlock
from archfem.view.pages.word import TEXT_WIDTH, write_word

TABLE = [["joint 0", "0.1"], ["joint 1", "-0.2"]]


def example(figure):
    pieces = [
        TextBlock("Run `archfem verdict`."),
        TextBlock("In doubt: the step.", "doubt"),
        Grid(["joint", "e"], TABLE, "Table 1. Eccentricities."),
        FigureBlock.of(figure, "Figure 1. The ring."),
    ]
    sections = [
        Section("Results", pieces),
        Section("Pair", [TextBlock("a = 1\nb = 2", "lines")], level=3),
    ]
    return Document("A ring", "case 12", [("verdict", "stands")], sections, "foot")


def test_a_document_has_its_headings_tables_captions_and_pictures(ring, tmp_path):
    docx = pytest.importorskip("docx")
    figure = ring.plot()
    path = write_word(tmp_path / "ring.docx", example(figure))
    found = docx.Document(str(path))
    texts = {paragraph.text: paragraph for paragraph in found.paragraphs}
    titles = {"A ring": "Title", "Results": "Heading 1", "Pair": "Heading 2"}
    assert {text: texts[text].style.name for text in titles} == titles
    assert {"case 12", "Run archfem verdict.", "a = 1\nb = 2", "foot"} <= set(texts)
    assert all(run.bold for run in texts["In doubt: the step."].runs)
    captions = {"Table 1. Eccentricities.", "Figure 1. The ring."}
    assert {text for text, each in texts.items() if each.style.name == "Caption"} == captions
    facts, grid = ([[c.text for c in row.cells] for row in t.rows] for t in found.tables)
    assert facts == [["verdict", "stands"]]
    assert grid == [["joint", "e"], *TABLE]
    (picture,) = found.inline_shapes
    drawn = figure.get_tightbbox().width + 0.04
    assert picture.width.inches == pytest.approx(min(drawn, TEXT_WIDTH), abs=0.01)
    assert 300 * drawn == pytest.approx(_pixels(found), abs=5.0)


def _pixels(found):
    """Width of the only picture of a document, from the header of its PNG file."""
    (part,) = (each for each in found.part.package.iter_parts() if each.content_type == "image/png")
    return int.from_bytes(part.blob[16:20], "big")


def test_a_missing_package_is_named(ring, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "docx", None)
    with pytest.raises(NotInstalled, match=r"pip install 'archfem\[word\]'"):
        write_word(tmp_path / "ring.docx", example(ring.plot()))
    assert not list(tmp_path.iterdir())
