"""Result folders: tables and pictures that `archfem run` writes, and folders opened again.

The files of a run appear in its folder together, when all of them exist (`archfem._files`).
"""

import shutil
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from archfem import _files
from archfem._optional import can_film
from archfem._validation import validate_arguments, validate_methods
from archfem.cases.answers import NO_DEMAND, state_outcome
from archfem.cases.case import Case
from archfem.cases.push_factors import PushFactors, compare_push, compare_with_motion
from archfem.cases.result_text import Remark, describe_pushover, note_collapse
from archfem.cases.run import (
    CASE_FILE,
    HISTORY_FILE,
    CaseResult,
    DeadLoadResult,
    Run,
    is_linked,
    link_file,
)
from archfem.cases.toml_file import read_tables
from archfem.dynamics.collapse_state import FALLEN_STATES
from archfem.dynamics.history import Ending, History
from archfem.errors import ArchfemError, InvalidInput, logger
from archfem.limit.collapse import Collapse, Outcome
from archfem.masonry.loads import find_push
from archfem.models.model import Doubt
from archfem.statics.pushover import Pushover
from archfem.statics.stress import strength_use_table
from archfem.view.collapse import draw_fall
from archfem.view.histories import draw_envelope, draw_envelopes
from archfem.view.statics import draw_free_body
from archfem.view.stress import draw_stress
from archfem.view.structure import draw_critical, draw_names
from archfem.view.style import Files


@validate_methods
@dataclass(frozen=True, eq=False)
class ResultFolder(CaseResult):
    """A folder that `archfem run`, `limit`, `rate` or `assess` has written, opened again.

    Attributes:
        folder: the folder.
        case: the case that was run.
        runs: histories by the names of their motions.
        missing: names of the pairs of a suite without a history.
        studies: folders of studies that the report shows; by default this one, if it has one.
    """

    folder: Path
    case: Case
    runs: Mapping[str, History]
    missing: tuple[str, ...] = ()
    studies: tuple[Path, ...] = ()

    def report(self, path: str | Path | None = None, others: Sequence[CaseResult] = ()) -> Path:
        """Write an HTML report of the folder in one file, for print.

        Args:
            path: the file, .html, or .docx for Word; by default report.html in the folder.
            others: results of other cases, which the report compares with these.

        Returns:
            The file.
        """
        report = super().report
        return self._write("report", lambda target: report(target, others), path)

    def page(self, path: str | Path | None = None) -> Path:
        """Write a page on which a reader changes the arch and shakes it, in any browser.

        Args:
            path: the file, .html; by default page.html in the folder.

        Returns:
            The file.

        Raises:
            InvalidInput: stones are not rigid and dry, or too many.
        """
        return self._write("page", super().page, path)

    def _write(
        self, name: str, write: Callable[[str | Path], Path], path: str | Path | None
    ) -> Path:
        """Write a page to a path, or into the folder in place of an earlier one."""
        if path is not None:
            return write(path)
        with _files.lock_folder(self.folder):  # refused now if another command writes
            group = _files.group_of(_files.read_file_list(self.folder), CASE_FILE)
        assert group is not None
        # others write meanwhile: figures take minutes
        with _files.temporary_folder() as made:
            page = write(made / f"{name}.html")
            with _files.replace_results(self.folder, name, group.inputs) as draft:
                if _files.group_of(_files.read_file_list(self.folder), CASE_FILE) != group:
                    raise InvalidInput(f"{self.folder} has other results now: write it again")
                shutil.copyfile(page, draft / page.name)
        return self.folder / page.name


@validate_arguments
def open_results(folder: str | Path, *, inputs: str | Path | None = None) -> ResultFolder:
    """Open a folder that `archfem run`, `limit`, `rate` or `assess` has written.

    Args:
        folder: the folder.
        inputs: folder of the mesh or extension of the case; by default the result folder.

    Returns:
        Case and histories of the folder.

    Raises:
        InvalidInput: it is no result folder, or a file was changed, or is of another run or
            another version of archfem.
    """
    place = Path(folder)
    if not place.is_dir():
        raise InvalidInput(f"there is no folder {place}: give one that `archfem run` has written")
    if _files.path_inside(place, _files.FINISHED_FOLDER).is_dir():  # of a command that was killed
        with _files.lock_folder(place):
            _files.complete_publication(place)
    if not _files.path_inside(place, CASE_FILE).is_file():
        raise InvalidInput(_missing_case_message(place))
    case = _read_case(place, None if inputs is None else Path(inputs))
    listed = _check_files(place)
    if deleted := _files.describe_deleted(place):
        logger.warning("%s: %s", place, deleted)
    pairs = (case.suite or {}).get("pairs", ())
    files = {name: place / name / HISTORY_FILE for name in pairs} or {"": place / HISTORY_FILE}
    runs = {
        name: History.read(path, case.structure)
        for name, path in files.items()
        if path.relative_to(place).as_posix() in listed and path.is_file()
    }
    if single := runs.pop("", None):  # named by its motion
        runs[str(single.dataset.attrs.get("motion", "")) or "motion"] = single
    return ResultFolder(place, case, runs, tuple(name for name in pairs if name not in runs))


def _check_files(place: Path) -> Collection[str]:
    """Return the names of the files of the run in a folder; refuse files that are not as listed."""
    groups = _files.read_file_list(place)
    owner = _files.group_of(groups, CASE_FILE)
    if owner is None:
        raise InvalidInput(
            f"{place} has no finished run, whose files `archfem run` lists in {_files.LIST_FILE}: "
            "run the case again"
        )
    # histories are checked as they are read, and an earlier report is replaced
    derived = _files.DERIVED["run"]
    written = [group for command, group in groups.items() if command not in derived]
    for name in (name for group in written for name in group.files):
        path = _files.path_inside(place, name)
        if path.is_file() and path.name != HISTORY_FILE:
            _files.read_listed(place, name)
    return owner.files


def _missing_case_message(place: Path) -> str:
    """Return the message of a folder without a case: its probable kind, and the remedy."""
    text = f"{place} has no {CASE_FILE}, which `archfem run` leaves in its folder"
    if (place / HISTORY_FILE).is_file() and (place.parent / CASE_FILE).is_file():
        return f"{text}: it is of one pair of a suite; give the suite's folder, {place.parent}"
    if (place / "study.json").is_file():
        return (
            f"{text}: it is of a study, which the report of a case shows: `archfem report FOLDER "
            f"--study {place}`"
        )
    return f"{text}: give that folder, or run the case again with `--out {place}`"


def _read_case(place: Path, inputs: Path | None) -> Case:
    """Read the case of a folder; its mesh is in another folder, that of the original case."""
    path = place / CASE_FILE
    settings = read_tables(path, "case file")
    try:
        return Case.of(settings, place if inputs is None else inputs)
    except ArchfemError as error:
        raise type(error)(f"{path}: {error}") from error


def limit_files(
    case: Case, collapse: Collapse, text: str, site: PushFactors | None, doubts: Sequence[Doubt]
) -> Files:
    """Return text, joints at collapse and mechanism of a limit analysis."""
    columns = ["name", "N", "V", "M", "eccentricity"]
    joints = collapse.joints.to_dataframe()[columns].to_csv(index=False).rstrip()
    # without a site the factor of a push would be read as one on a demand
    demand = "; ".join(filter(None, [NO_DEMAND, compare_with_motion(case, collapse)]))
    demand = demand if collapse.push else "the given load"
    over = collapse.over_fill
    if not collapse.push and (collapse.outcome is Outcome.COLLAPSES or over):
        bounded = collapse.bounded or bool(over and over.unknown)
        site = PushFactors(*collapse.range, bounded=bounded)
    remarks: list[Remark] = list(doubts)
    remarks += note_collapse(case.structure, collapse, case.limit, case.parapets)
    given = collapse.sentence, remarks, demand, site
    stated = state_outcome("limit analysis", *given).as_file("limit")
    return {"limit.txt": text, "limit.csv": joints, "collapse.png": collapse.plot(), **stated}


def pushover_files(case: Case, push: Pushover, notes: Sequence[str]) -> Files:
    """Return text, curve and picture of a pushover."""
    curve = push.curve.to_dataframe().to_csv().rstrip()
    peak = push.factor * abs(find_push(case.pushover.live if case.pushover else []))
    dead = case.pushover.dead if case.pushover else ()
    site = compare_push(case, peak, peak, dead) if peak else None
    stated = state_outcome("pushover", push.sentence, notes, "-", site)
    return {
        "pushover.txt": describe_pushover(case.structure, push, notes),
        "pushover.csv": curve,
        "pushover.png": push.plot(),
        **stated.as_file("pushover"),
    }


def dead_load_files(result: DeadLoadResult) -> Files:
    """Return thrust line, joint names, and, where available, stress and a free body."""
    case, dead, model = result.case, result.dead, result.dead.model
    files: Files = {
        "dead.png": dead.plot(criteria=case.analysis.failure_criteria),
        "names.png": draw_names(case.structure),
    }
    if result.strength_use is not None:
        files["dead_stress.png"] = draw_stress(model, dead)
        files["dead_stress.txt"] = strength_use_table(result.strength_use)
    if "free_body" in case.output:
        given = case.structure, dead.joints, case.output["free_body"]
        files["free_body.png"] = draw_free_body(*given, cells=model.cells)
    return files


def run_files(run: Run, at_rest: DeadLoadResult, text: str) -> Files:
    """Return critical instant, envelope, joints over time, fall, film and summary of a run.

    One that was interrupted has a summary alone, since pictures take time.
    """
    case, history, dead = run.case, run.history, at_rest.dead
    if history.ending is Ending.INTERRUPTED:
        return {"summary.txt": text}
    files: Files = {} if case.suite is None else {"motion.png": run.motion.plot()}
    files |= {
        "critical_instant.png": draw_critical(case.structure, history, dead.model),
        "envelope.png": draw_envelope({case.title: history}, dead=dead.joints),
        # The joints of the case, or else those of the largest |e| and of the longest sliding.
        "joints.png": history.plot(joints=case.joints or None),
    }
    if history.verdict.outcome in FALLEN_STATES and "fall_pose" in history.dataset:
        files["fall.png"] = draw_fall(history)
    if case.output.get("animation", False) and can_film():
        from archfem.view.films.film import film  # pyvista and the encoder are slow to import

        # a small film, which takes no longer than the rest; `archfem animate` writes larger ones
        files["hinges.mp4"] = partial(film, dead.model, history, fps=12.0, size=(960, 540))
    return {**files, "summary.txt": text}


def adopt_files(run: Run) -> bool:
    """Add the files of a pair that an earlier call has finished to the draft of its history."""
    assert run.path is not None
    pair, draft, folder = run.path.parents[0].name, run.path.parents[1], run.path.parents[2]
    listed = _files.intact_file_list(folder).get("run")
    names = [] if listed is None else [n for n in listed.files if n.startswith(f"{pair}/")]
    same_history = is_linked(run.path, folder / pair / HISTORY_FILE)
    if f"{pair}/summary.txt" not in names or not same_history:
        return False
    try:
        for name in names:
            _files.read_listed(folder, name)
    except InvalidInput:
        return False
    for name in names:
        if not (draft / name).exists():
            link_file(folder / name, draft / name)
    return True


def pair_files(runs: Mapping[str, History], at_rest: DeadLoadResult, text: str) -> Files:
    """Return the table of a suite and, unless it was interrupted, the envelopes of its runs."""
    if any(run.ending is Ending.INTERRUPTED for run in runs.values()):
        return {"suite.txt": text}
    figures = draw_envelopes(runs, at_rest.dead.joints)
    numbers = ["", *(f"_{number}" for number in range(2, len(figures) + 1))]
    envelopes = {f"envelope{k}.png": each for k, each in zip(numbers, figures, strict=True)}
    return {"suite.txt": text, **envelopes}
