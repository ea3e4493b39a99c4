"""Player of a run in a browser or a notebook, with a slider over time."""

from dataclasses import dataclass

from archfem._validation import validate_arguments
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.models.model import Model
from archfem.view.pages.document import FigureBlock, StandalonePage, render
from archfem.view.pages.player_data import Scene
from archfem.view.structure import draw_critical


@dataclass(frozen=True, eq=False)
class Player(StandalonePage):
    """Interactive page of a run, shown in a notebook or written by `save`.

    It shows the structure with its thrust line, hinges, sliding and open joints, at first at the
    largest displacement unless blocks fall; sliders for the time and for the magnification of
    displacements; the ground acceleration with a cursor; and e and V / N over time of the joint
    that is clicked on.

    Attributes:
        scene: the data shown.
        caption: text below it in a document; "" for none.
        kind: name of this block in the templates of documents.
    """

    scene: Scene
    caption: str = ""

    kind = "player"

    @property
    def page(self) -> str:
        """The complete page (HTML), without references to other files."""
        return render("player_page.html", title=self.scene.data["title"], player=self)

    @property
    def still(self) -> FigureBlock:
        """Picture of critical instants, for documents in which nothing plays."""
        scene = self.scene
        drawn = draw_critical(scene.structure, scene.run, scene.model)
        return FigureBlock.of(drawn, self.caption)

    @property
    def frame_height(self) -> float:
        """Height of the page in a notebook [pixels]."""
        low, high = self.scene.box
        # a notebook is about 900 pixels wide; the controls and diagrams take 550 in height
        picture = min(540.0, 900.0 * float((high[1] - low[1]) / (high[0] - low[0])))
        return picture + 550.0


@validate_arguments
def player(run: History, model: Model | None = None, *, title: str = "") -> Player:
    """Return a player of a run.

    Args:
        run: the history, also of large displacements and of loose blocks; blocks move if it
            contains fields.
        model: the model of the run; required if the run contains fields.
        title: above the structure; by default the title of the run.

    Returns:
        The player.

    Raises:
        InvalidInput: no model is given, and the run contains fields or no structure; or the model
            is not that of the run.
    """
    if model is None and run.structure is None:
        raise InvalidInput(
            "this history does not contain its structure, so that there is nothing to draw: read "
            "it with History.read(path, structure), or give the model that made it"
        )
    if model is None and "q" in run.dataset:
        raise InvalidInput(
            "this history has displacements, and the motion of the blocks follows from its model: "
            "give the model of the run, player(run, model)"
        )
    structure = model.structure if model is not None else run.structure
    assert structure is not None
    return Player(Scene(structure, run, model, title))
