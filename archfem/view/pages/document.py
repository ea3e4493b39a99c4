"""Documents for a browser and for paper: sections of words, tables, figures and players."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from pathlib import Path
from re import sub
from typing import Any

import matplotlib
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.text import Text


@dataclass(frozen=True)
class TextBlock:
    """A paragraph, or lines of text as they are."""

    text: str  # the words; they are escaped, and what stands between ` is set as code
    # "plain", "missing" for what the results do not hold, "doubt" for what is to be looked at, or
    # "lines" for text whose columns matter
    manner: str = "plain"

    kind = "words"


@dataclass(frozen=True)
class Grid:
    """A table."""

    head: Sequence[str]  # titles of the columns; none for a list of terms and what they are
    rows: Sequence[Sequence[str]]  # as many cells each
    caption: str = ""  # above the table

    kind = "grid"


@dataclass(frozen=True)
class FigureBlock:
    """A figure."""

    source: str  # the picture itself, as a data URI
    caption: str  # below it
    inches: float  # its width; it is made smaller where the page is narrower

    kind = "plate"

    @classmethod
    def of(cls, figure: Figure, caption: str) -> "FigureBlock":
        """Return a figure as lines that stay sharp at any size."""
        for text in figure.findobj(Text):  # names and titles are words, though they hold a $
            text.set_parse_math(False)
        buffer = BytesIO()
        with matplotlib.rc_context({"svg.fonttype": "path", "path.simplify_threshold": 0.5}):
            figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
        return cls(_uri("image/svg+xml", buffer.getvalue()), caption, float(figure.get_figwidth()))

    @classmethod
    def read(cls, path: Path, caption: str) -> "FigureBlock":
        """Return a picture that was written earlier."""
        content = path.read_bytes()
        pixels = int.from_bytes(content[16:20], "big")  # where the header of the format has it
        # dots per inch of the pictures that `archfem.view.save` writes
        return cls(_uri("image/png", content), caption, round(pixels / 300.0, 2))


@dataclass(frozen=True)
class Section:
    """A chapter of a document."""

    title: str  # its heading
    pieces: Sequence[Any]  # `Words`, `Grid`, `Plate`, `Player`
    level: int = 2  # 2, or 3 for a part of the chapter before


@dataclass(frozen=True)
class Document:
    """A whole document."""

    title: str  # of all
    subtitle: str  # below it
    facts: Sequence[tuple[str, str]]  # what is to be seen at once: a name and a value each
    sections: Sequence[Section]  # in order
    foot: str = ""  # at the end

    @property
    def page(self) -> str:
        """The document as one page, with all that it needs."""
        return rendered("document.html", document=self)


def rendered(template: str, **values: Any) -> str:
    """Return a template of this room filled in; words are escaped."""
    return _templates().get_template(template).render(**values)


@cache
def _templates() -> Environment:
    """The templates, to which a file of style or script is given as it is."""
    found = Environment(
        loader=PackageLoader("archfem.view.pages"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    assert found.loader is not None
    source = found.loader.get_source
    found.globals["plain"] = lambda name: Markup(source(found, name)[0])
    found.globals["raw"] = Markup
    found.filters["typeset"] = _typeset
    return found


def _typeset(cell: str) -> str:
    """A cell with the minus of a number, and the dash of what there is not, as print has them."""
    return "–" if cell == "-" else sub(r"^-(?=\d)", "−", cell)


def _uri(media: str, content: bytes) -> str:
    """A data URI."""
    return f"data:{media};base64,{b64encode(content).decode('ascii')}"
