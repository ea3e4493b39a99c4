"""The player: a run in a browser or a notebook, with a slider over time."""

from dataclasses import dataclass
from html import escape
from pathlib import Path

from archfem._files import atomic_write
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.models.model import Model
from archfem.view.pages.document import rendered
from archfem.view.pages.player_data import LARGEST, Scene


@dataclass(frozen=True, eq=False)
class Player:
    """A run that can be played: in a notebook it shows itself, elsewhere `save` writes a page.

    The structure with its thrust line, hinges, sliding and open joints; a slider over time, one for
    the magnification of displacements; the ground's acceleration with a cursor; and of a joint that
    one clicks e and V / N over time.

    Attributes:
        scene: what it shows.
    """

    scene: Scene

    @property
    def kind(self) -> str:
        """What it is in a document."""
        return "player"

    @property
    def page(self) -> str:
        """A whole page, in one file."""
        return rendered("player_page.html", title=self.scene.data["title"], player=self)

    def save(self, path: str | Path) -> Path:
        """Write a page in one stroke.

        Args:
            path: the file, .html; folders are made.

        Returns:
            The file.
        """
        return write_page(path, self.page)

    def _repr_html_(self) -> str:
        """The player in a frame of its own, so that a notebook's style and its own stay apart."""
        low, high = self.scene.box
        # height of the picture at most, of all that is around it, and the width of a notebook
        # [pixels]
        picture = min(540.0, 900.0 * float((high[1] - low[1]) / (high[0] - low[0])))
        # height of the picture at most, of all that is around it, and the width of a notebook
        # [pixels]
        style = f"width:100%;height:{picture + 550.0:.0f}px;border:0"
        return f'<iframe srcdoc="{escape(self.page)}" style="{style}"></iframe>'


def player(run: History, model: Model | None = None, *, title: str = "") -> Player:
    """Return a player of a run.

    Args:
        run: with fields, where blocks are to move; its structure is drawn.
        model: that made the run; needed where it has fields.
        title: above the picture; by default the run's own.

    Returns:
        The player; it also works on histories of large displacements, and follows what falls.

    Raises:
        InvalidInput: the run does not know its structure and no model is given, it has fields and
            no model is given, or the model is another's.
    """
    if model is None and run.structure is None:
        raise InvalidInput(
            "this history does not know its structure, so that there is nothing to draw: read it "
            "with History.read(path, structure), or give the model that made it"
        )
    if model is None and "q" in run.dataset:
        raise InvalidInput(
            "this history has displacements, and only its model knows how blocks move by them: "
            "give the model that made it, player(run, model)"
        )
    structure = model.structure if model is not None else run.structure
    assert structure is not None
    return Player(Scene(structure, run, model, title, LARGEST))


def write_page(path: str | Path, text: str) -> Path:
    """Write a page in one stroke."""
    target = Path(path)
    if target.suffix.lower() not in (".html", ".htm"):
        raise InvalidInput(f"{target} has suffix '{target.suffix}': a page is .html")
    with atomic_write(target) as draft:
        draft.write_text(text, encoding="utf-8")
    return target
