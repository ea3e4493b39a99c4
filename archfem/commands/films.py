"""The command for films: a history that was kept becomes one, as often as wanted."""

import argparse
from pathlib import Path

from archfem.cases.case import Case
from archfem.cases.run import at_rest
from archfem.dynamics.history import History
from archfem.errors import InvalidInput

CASE = "case.toml"
"""What `archfem run` writes beside its results."""


def animate(given: argparse.Namespace) -> None:
    """Film the history of a run.

    Args:
        given: `history`, a file; `case`, that of the run, or None for the one beside the history;
            `out`, the film, or None for one beside the history; and how it is filmed: `window`,
            `colour`, `magnification`, `fps`, `seconds` and `size`, as words or None.

    Raises:
        InvalidInput: there is no such history, or something cannot be meant.
    """
    path = Path(given.history)
    if not path.is_file():
        raise InvalidInput(f"there is no history file {path}")
    case = Case.read(given.case or _case_beside(path))
    run = History.read(path, case.structure)
    asked = {key: getattr(given, key) for key in ("magnification", "colour", "fps", "seconds")}
    asked |= {"window": _window(given.window), "size": _size(given.size)}
    from archfem.view.films.scenes import film  # loads what writes films

    target = Path(given.out) if given.out is not None else path.with_suffix(".mp4")
    chosen = {key: value for key, value in asked.items() if value is not None}
    print(f"wrote {film(at_rest(case).model, run, target, **chosen)}")


def _case_beside(path: Path) -> Path:
    """The case of a run: beside its history, or beside the folder of its pair."""
    places = [folder / CASE for folder in (path.parent, path.absolute().parent.parent)]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        raise InvalidInput(
            f"there is no {CASE} beside {path}, as `archfem run` writes one: give the case of the "
            "run, --case CASE.toml"
        )
    return found


def _window(words: str | None) -> str | tuple[float, float] | None:
    """Read "auto", or two times "8.0,9.5" [s]."""
    if words is None or words == "auto":
        return words
    try:
        start, end = (float(word) for word in words.split(","))
    except ValueError as error:
        raise InvalidInput(
            f"--window {words}: give 'auto', or two times in seconds such as 8.0,9.5"
        ) from error
    return start, end


def _size(words: str | None) -> tuple[int, int] | None:
    """Read a width and a height such as "1280x720" [pixels]."""
    if words is None:
        return None
    try:
        wide, high = (int(word) for word in words.lower().split("x"))
    except ValueError as error:
        raise InvalidInput(f"--size {words}: give width and height, such as 1280x720") from error
    return wide, high
