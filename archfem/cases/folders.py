"""Result folders opened again."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from archfem.cases.case import Case
from archfem.cases.inputs import input_files
from archfem.cases.kept import HISTORY
from archfem.cases.reportable import Reportable
from archfem.cases.toml import tables_in
from archfem.dynamics.history import History
from archfem.errors import ArchfemError, InvalidInput

if TYPE_CHECKING:
    from archfem.cases.dossier.results import Results

CASE, REPORT, STUDY = "case.toml", "report.html", "study.json"
"""Names of the case's file, which `archfem run` leaves in its folder, of a report, and of what
tells that a folder is of a study."""


@dataclass(frozen=True, eq=False)
class Opened(Reportable):
    """A folder that `archfem run` left, opened again.

    Attributes:
        folder: that was opened.
        case: as it was understood.
        runs: what each run is called, and the run: pairs of a suite, or the only one.
        missing: names of the pairs that were not run.
    """

    folder: Path
    case: Case
    runs: Mapping[str, History]
    missing: tuple[str, ...] = ()

    def results(self) -> "Results":
        """Return what its report is written from."""
        from archfem.cases.dossier.results import Results  # loads matplotlib, which is slow

        return Results(self.case, self.runs, self.folder, self.missing)

    def report(self, path: str | Path | None = None) -> Path:
        """Write a report of all that the folder holds: one HTML file, to hand in and to print.

        Args:
            path: the file, .html; by default report.html in the folder.

        Returns:
            The file.
        """
        return super().report(self.folder / REPORT if path is None else path)


def opened(folder: str | Path, *, inputs: str | Path | None = None) -> Opened:
    """Return the results in a folder that `archfem run` left.

    Args:
        folder: of the results.
        inputs: where the name of a drawing starts that the case is of; by default the folder.

    Raises:
        InvalidInput: it is no such folder, or the drawing that its case names is not found, or a
            history is of another structure.
    """
    place = Path(folder)
    if not place.is_dir():
        raise InvalidInput(f"there is no folder {place}: give one that `archfem run` has written")
    if not (place / CASE).is_file():
        raise InvalidInput(_no_results(place))
    case = _case(place, None if inputs is None else Path(inputs))
    runs: dict[str, History] = {}
    missing = []
    if case.suite is not None:
        for name in case.suite["pairs"]:
            if (path := place / name / HISTORY).is_file():
                runs[name] = History.read(path, case.structure)
            else:
                missing.append(name)
    elif (path := place / HISTORY).is_file():
        runs[_name(case)] = History.read(path, case.structure)
    return Opened(place, case, runs, tuple(missing))


def _name(case: Case) -> str:
    """What the only motion of a case is called."""
    said = case.motion or {}
    if "synthetic" in said:
        return f"synthetic {said['synthetic'].get('seed', 0)}"
    return Path(str(said.get("file", "motion"))).stem


def _no_results(place: Path) -> str:
    """Why a folder is none of results, and what to do."""
    words = f"{place} has no {CASE}, which `archfem run` leaves in its folder"
    if (place / HISTORY).is_file() and (place.parent / CASE).is_file():
        return f"{words}: it is of one pair of a suite; give the suite's folder, {place.parent}"
    if (place / STUDY).is_file():
        return f"{words}: it is of a study; a report is of one case, run by itself"
    return f"{words}: give that folder, or run the case again with `--out {place}`"


def _case(place: Path, inputs: Path | None) -> Case:
    """Read the case of a folder, whose drawing stays where it was when the case was run."""
    path, start = place / CASE, place if inputs is None else inputs
    settings = tables_in(path, "case file")
    drawing = input_files({"structure": settings.get("structure")}, start)
    if drawing and not drawing[0].is_file():
        raise InvalidInput(
            f"{path} names the drawing {settings['structure']['file']}, and there is none in "
            f"{start}: give the folder of the case that was run, as inputs, or by "
            f"`archfem report {place} --inputs FOLDER`"
        )
    try:
        return Case.of(settings, start)
    except ArchfemError as error:
        raise type(error)(f"{path}: {error}") from error
