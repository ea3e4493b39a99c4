"""Pairs of a suite on processes, their histories kept where `carried_out` keeps them."""

from pathlib import Path
from typing import Any

from archfem.cases.case import Case
from archfem.cases.run import Run, carried_out
from archfem.dynamics.history import Ending
from archfem.errors import InvalidInput
from archfem.studies.asking import Asked
from archfem.studies.finders import Found
from archfem.studies.over import Axis
from archfem.studies.points import PAIR, Point
from archfem.studies.study import Study


def run_pairs(
    case: Case, folder: str | Path, *, workers: int | None = None, client: Any = None
) -> list[str]:
    """Run the pairs of a case's suite of which no history is kept yet.

    `carried_out(case, folder)` then finds them, and runs again what broke off.

    Args:
        case: with a suite.
        folder: for the histories.
        workers: as for `Study.run`.
        client: as for `Study.run`, of workers that see the folder.

    Returns:
        How each pair ended; the words of an error where it has no history.

    Raises:
        InvalidInput: the case has no suite, or chooses its model by one pair for all.
    """
    if case.suite is None or case.chooses:
        raise InvalidInput(
            "pairs run side by side where a case has a [suite], and names its model: "
            "model.fidelity = 'auto' chooses one by the first pair for all"
        )
    pairs = tuple(case.suite["pairs"])
    points = tuple(Point(case.settings, case.folder, ((PAIR, pair),)) for pair in pairs)
    asked = Asked(pair_kept, {"folder": str(Path(folder).resolve())})
    study = Study(case.title, asked, (Axis(PAIR, (PAIR,), tuple((p,) for p in pairs)),), points)
    found = study.run(workers=workers, client=client)
    ended = found["ended"].values if "ended" in found else [""] * len(pairs)
    return [a or b for a, b in zip(found["error"].values.tolist(), ended, strict=True)]


def pair_kept(case: Case, folder: str) -> Found:
    """Run the only pair of a case, and keep its history.

    Args:
        case: with a suite of one pair.
        folder: for the history.

    Returns:
        How it `ended`.

    Raises:
        KeyboardInterrupt: on Ctrl-C.
    """
    (run,) = (each for each in carried_out(case, folder) if isinstance(each, Run))
    if run.history.ended is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    return {"ended": str(run.history.ended)}
