"""Documents in the format of Word (.docx), by python-docx."""

from io import BytesIO
from pathlib import Path
from typing import Any

from archfem._files import atomic_write
from archfem._optional import require_package
from archfem.view.pages.document import Document, FigureBlock, Grid, TextBlock

# Text of a page that is 210 mm wide, with margins of 20 mm [inch]
TEXT_WIDTH = 6.69


def write_word(path: str | Path, document: Document) -> Path:
    """Write a document for Word atomically; players are pictures."""
    with require_package("python-docx"):
        from docx import Document as WordDocument
        from docx.shared import Inches, Mm, Pt

    target, word = Path(path), WordDocument()
    page, style = word.sections[0], word.styles["Normal"]
    page.page_width, page.page_height = Mm(210), Mm(297)
    page.left_margin = page.right_margin = Mm(20)
    style.font.size = Pt(10)
    word.core_properties.title = document.title
    word.add_heading(document.title, 0)
    word.add_paragraph(document.subtitle)
    _add_table(word, Grid((), document.facts))
    for section in document.sections:
        word.add_heading(section.title, section.level - 1)
        for piece in section.pieces:
            if isinstance(piece, TextBlock):
                _add_text(word, piece)
            elif isinstance(piece, Grid):
                _add_table(word, piece)
            else:
                picture = piece if isinstance(piece, FigureBlock) else piece.still
                width = Inches(min(picture.inches, TEXT_WIDTH))
                word.add_picture(BytesIO(picture.raster()), width)
                more = "" if picture is piece else " The HTML report plays it."
                word.add_paragraph(f"{piece.caption}{more}", "Caption")
    word.add_paragraph(document.foot)
    with atomic_write(target) as draft:
        word.save(str(draft))
    return target


def _add_text(word: Any, block: TextBlock) -> None:
    """Add a paragraph; code and preformatted text have letters of one width."""
    if block.caption:
        word.add_paragraph(block.caption, "Caption").paragraph_format.keep_with_next = True
    paragraph = word.add_paragraph()
    if block.lead:
        paragraph.add_run(f"{block.lead} ").bold = True
    parts = [block.text] if block.manner == "lines" else block.text.split("`")
    for number, part in enumerate(parts):
        run = paragraph.add_run(part)
        run.bold = block.manner == "doubt"
        if number % 2 or block.manner == "lines":
            run.font.name = "Courier New"


def _add_table(word: Any, grid: Grid) -> None:
    """Add a table below its caption; terms without a head have bold names."""
    if grid.caption:
        word.add_paragraph(grid.caption, "Caption").paragraph_format.keep_with_next = True
    rows = [*([grid.head] if grid.head else []), *grid.rows]
    if not rows:
        return
    table = word.add_table(0, len(rows[0]), "Light Grid")
    for number, row in enumerate(rows):
        for place, (cell, text) in enumerate(zip(table.add_row().cells, row, strict=True)):
            run = cell.paragraphs[0].add_run(text.replace("`", ""))
            run.bold = number == 0 if grid.head else place == 0
