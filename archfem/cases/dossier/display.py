"""The model by which blocks of a run move on the page, built again from its case."""

from archfem.cases.case import Case
from archfem.dynamics.history import History
from archfem.errors import ArchfemError
from archfem.models.build import build
from archfem.models.discretisation import FIDELITIES, Discretisation
from archfem.models.model import Model
from archfem.view.pages.player import Player
from archfem.view.pages.scenes import LARGEST, Scene

LEAST = 800_000
"""Size of a player's packed part at least, however many there are [bytes]."""


def player_of(case: Case, run: History, title: str, players: int = 1) -> Player:
    """Return the player of a run of a case; blocks stand still where it kept no displacements.

    Args:
        case: of the run.
        run: that is played.
        title: above the picture.
        players: that share a page.
    """
    model, why = display_model(case, run)
    largest = max(LARGEST // players, LEAST)
    return Player(Scene(case.structure, run, model, title, largest, why))


def display_model(case: Case, run: History) -> tuple[Model | None, str]:
    """Return the model whose coordinates a run kept; None and why, where there is none.

    Args:
        case: of the run.
        run: with displacements or without.
    """
    if "q" not in run.dataset:
        return None, ""
    try:
        model = build(case.structure, _asked(case, run))
    except (ArchfemError, ImportError) as error:
        return None, f"Stones are drawn where they stand, for their model cannot be built: {error}"
    if model.size != run.dataset.sizes["coordinate"]:
        return None, (
            "Stones are drawn where they stand: the run was made with a model of "
            f"{run.dataset.sizes['coordinate']} coordinates, and its case gives one of "
            f"{model.size}."
        )
    return model, ""


def _asked(case: Case, run: History) -> Discretisation:
    """What the run was modelled by; the rung where "auto" chose it is told by the run."""
    if not case.chooses:
        return case.discretisation
    told = str(run.dataset.attrs["fidelity"])
    if told in FIDELITIES:
        return Discretisation(told, displacements=case.discretisation.displacements)
    rungs = dict(each.rsplit(": ", 1) for each in told.split(", ") if ": " in each)
    return Discretisation(rungs, displacements=case.discretisation.displacements)
