"""HTML documents of sections with text, tables, figures and players."""

from abc import ABC, abstractmethod
from base64 import b64decode, b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from html import escape
from io import BytesIO
from pathlib import Path
from re import sub
from shutil import which
from subprocess import run
from typing import Any

import matplotlib
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from archfem._files import atomic_write, temporary_folder
from archfem._optional import missing_package_message
from archfem._validation import validate_methods
from archfem.errors import InvalidInput, NotInstalled
from archfem.view.style import Colour, disable_math

# Margins of figures, which have those of the page
_WITHOUT_MARGIN: dict[str, Any] = {"bbox_inches": "tight", "pad_inches": 0.02}

# Rules of a figure where the page is dark, and shows its colours inverted
_IN_THE_DARK = "".join(
    f'[style*="{key}: {old}"] {{ {key}: {new} !important }} '
    for old, new in Colour.INVERTED
    for key in ("stroke", "fill")
)
_IN_THE_DARK = f"@media screen and (prefers-color-scheme: dark) {{ {_IN_THE_DARK}}}"


@dataclass(frozen=True)
class TextBlock:
    """A paragraph, or preformatted text."""

    text: str  # escaped; a part between ` is set as code
    # "plain"; "missing" for results that do not exist; "doubt" for warnings; "lines" for
    # preformatted text
    manner: str = "plain"
    caption: str = ""  # above preformatted text that is a table
    lead: str = ""  # first words of a paragraph, in bold letters

    kind = "words"


@dataclass(frozen=True)
class Grid:
    """A table."""

    head: Sequence[str]  # titles of the columns; none for a list of terms and explanations
    rows: Sequence[Sequence[str]]  # cells of each row
    caption: str = ""  # above the table
    # "numbers"; "words", aligned at their left; or "form", with room to write
    manner: str = "numbers"

    kind = "grid"


@dataclass(frozen=True)
class FigureBlock:
    """A figure."""

    source: str  # the picture as a data URI
    caption: str  # below the figure
    inches: float  # width of the figure; it shrinks with a narrower page
    # that was drawn, not read from a file; equal pictures have equal sources
    figure: Figure | None = field(default=None, compare=False)
    beside: bool = False  # whether another one stands beside it

    kind = "plate"

    @classmethod
    def of(cls, figure: Figure, caption: str) -> "FigureBlock":
        """Return a matplotlib figure as a vector graphic."""
        disable_math(figure)
        buffer = BytesIO()
        fixed = {"svg.fonttype": "path", "svg.hashsalt": "archfem", "path.simplify_threshold": 0.5}
        with matplotlib.rc_context(fixed):
            figure.savefig(
                buffer, format="svg", transparent=True, metadata={"Date": None}, **_WITHOUT_MARGIN
            )
        # without the room above and below drawings that are true to scale
        width = float(figure.get_tightbbox().width) + 2.0 * _WITHOUT_MARGIN["pad_inches"]
        # upright rectangles are printed at least a pixel wide: letters such as l would be smudged
        content = buffer.getvalue().replace(b") scale(", b") skewX(0.1) scale(")
        content = content.replace(b"</style>", _IN_THE_DARK.encode() + b"</style>", 1)
        return cls(_uri("image/svg+xml", content), caption, width, figure)

    def raster(self) -> bytes:
        """Return the picture as PNG, 300 dots per inch."""
        if self.figure is None:
            return b64decode(self.source.partition(",")[2])
        buffer = BytesIO()
        self.figure.savefig(buffer, format="png", dpi=300, **_WITHOUT_MARGIN)
        return buffer.getvalue()

    @classmethod
    def read(cls, path: Path, caption: str) -> "FigureBlock":
        """Return a picture from a PNG file."""
        content = path.read_bytes()
        pixels = int.from_bytes(content[16:20], "big")  # width in the PNG header
        # `archfem.view.save` writes 300 dots per inch
        return cls(_uri("image/png", content), caption, round(pixels / 300.0, 2))


@dataclass(frozen=True)
class Section:
    """A chapter of a document."""

    title: str  # heading
    pieces: Sequence[Any]  # `TextBlock`, `Grid`, `FigureBlock`, `Player`
    level: int = 2  # of the heading: 2, or 3 for a subsection


@dataclass(frozen=True)
class Document:
    """An HTML document."""

    title: str  # of the document
    subtitle: str  # beside the title
    facts: Sequence[tuple[str, str]]  # name and value of the main results
    sections: Sequence[Section]  # in order
    foot: str = ""  # last line

    @property
    def page(self) -> str:
        """The complete page (HTML), without references to other files."""
        return render("document.html", document=self)


def print_page(page: Path, target: Path) -> Path:
    """Print a page to a PDF file by an installed Chromium or Chrome."""
    if target.suffix.lower() != ".pdf":
        raise InvalidInput(f"{target} has suffix '{target.suffix}': a printed report is .pdf")
    names = "chromium", "chromium-browser", "google-chrome"
    browser = next(filter(None, map(which, names)), None)
    if browser is None:
        raise NotInstalled(missing_package_message("Chromium", "it is not on the PATH"))
    with atomic_write(target) as draft, temporary_folder() as profile:
        # the page is our own and loads no other file; Chromium's sandbox refuses to run for root
        command = [browser, "--headless=new", "--no-sandbox", "--disable-gpu"]
        command += ["--disable-dev-shm-usage", f"--user-data-dir={profile}"]
        # time for the players to unpack and draw their data
        command += ["--virtual-time-budget=30000", "--no-pdf-header-footer"]
        command += ["--generate-pdf-document-outline"]
        command += [f"--print-to-pdf={draft}", page.resolve().as_uri()]
        done = run(command, capture_output=True, timeout=300, check=False)
        if done.returncode or not draft.is_file():
            said = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
            raise NotInstalled(missing_package_message("Chromium", f"it ended with {said}"))
    return target


def render(template: str, **values: Any) -> str:
    """Fill in a template of this package; values are escaped."""
    return _templates().get_template(template).render(**values)


@cache
def _templates() -> Environment:
    """Return the environment of the templates, which may include style and script files."""
    loader = PackageLoader("archfem.view.pages")
    blocks = {"trim_blocks": True, "lstrip_blocks": True, "keep_trailing_newline": True}
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, **blocks)
    source = loader.get_source
    environment.globals["plain"] = lambda name: Markup(source(environment, name)[0])
    environment.globals["raw"] = Markup
    environment.filters["typeset"] = _typeset
    return environment


def _typeset(cell: str) -> str:
    """Return a cell with typographic minus signs, and dashes for missing values."""
    return "–" if cell == "-" else sub(r"^-(?=\d)", "−", cell)


def _uri(media: str, content: bytes) -> str:
    """Return a data URI."""
    return f"data:{media};base64,{b64encode(content).decode('ascii')}"


def write_page(path: str | Path, text: str) -> Path:
    """Write a page atomically."""
    target = Path(path)
    if target.suffix.lower() not in (".html", ".htm"):
        raise InvalidInput(
            f"{target} has suffix '{target.suffix}': a page is .html, which --pdf prints"
        )
    with atomic_write(target) as draft:
        draft.write_text(text, encoding="utf-8")
    return target


@validate_methods
class StandalonePage(ABC):
    """A page that is one file, shown in a notebook or written by `save`."""

    @property
    @abstractmethod
    def page(self) -> str:
        """The complete page (HTML), without references to other files."""

    @property
    @abstractmethod
    def frame_height(self) -> float:
        """Height of the page in a notebook [pixels]."""

    def save(self, path: str | Path) -> Path:
        """Write the page to a file atomically.

        Args:
            path: path of the file, .html; missing folders are created.

        Returns:
            The path of the file.

        Raises:
            InvalidInput: the suffix is not that of a page.
        """
        return write_page(path, self.page)

    def _repr_html_(self) -> str:
        """The page in a frame, which keeps its style apart from that of a notebook."""
        style = f"width:100%;height:{self.frame_height:.0f}px;border:0"
        return f'<iframe srcdoc="{escape(self.page)}" style="{style}"></iframe>'
