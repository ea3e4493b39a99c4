"""Result folders: tables and pictures that `archfem run` writes, and folders opened again.

The files of a run appear in its folder together, when all of them exist (`archfem._files`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import tomli_w

from archfem import _files
from archfem._files import FileGroup
from archfem._validation import validate_arguments, validate_methods
from archfem.cases.case import Case
from archfem.cases.provenance import list_input_files
from archfem.cases.run import (
    CASE_FILE,
    HISTORY_FILE,
    CaseResult,
    DeadLoadResult,
    Run,
    is_linked,
    link_file,
)
from archfem.cases.toml_file import Table, read_tables
from archfem.dynamics.accuracy import Accuracy
from archfem.dynamics.history import History
from archfem.dynamics.verdict_range import VerdictRange
from archfem.errors import ArchfemError, InvalidInput
from archfem.limit.collapse import Collapse
from archfem.limit.vehicles import Rating
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.record_selection import RecordSelection
from archfem.motion.suite import Suite
from archfem.statics.mechanism_assessment import KinematicAssessment
from archfem.statics.modes import Modes
from archfem.statics.stress import strength_use_table
from archfem.view.collapse import draw_collapse, draw_fall, draw_kinematic_assessment, draw_rating
from archfem.view.histories import draw_envelope, draw_joints, most_stressed_joints
from archfem.view.motions import draw_motion, draw_selection, draw_spectra, draw_suite
from archfem.view.positions import decisive_instant
from archfem.view.statics import draw_dead_load, draw_free_body, draw_modes
from archfem.view.stress import draw_stress
from archfem.view.structure import draw_during, draw_names
from archfem.view.studies import draw_accuracy, draw_verdict_range
from archfem.view.style import LINE_COLOURS, save

SUMMARY_FILE = "summary.txt"


@validate_methods
@dataclass(frozen=True, eq=False)
class ResultFolder(CaseResult):
    """A folder that `archfem run` has written, opened again.

    Attributes:
        folder: the folder.
        case: the case that was run.
        runs: histories by the names of their motions.
        missing: names of the pairs of a suite without a history.
    """

    folder: Path
    case: Case
    runs: Mapping[str, History]
    missing: tuple[str, ...] = ()

    def report(self, path: str | Path | None = None) -> Path:
        """Write an HTML report of the folder in one file, for print.

        Args:
            path: the file, .html; by default report.html in the folder.

        Returns:
            The file.
        """
        if path is not None:
            return super().report(path)
        inputs = _files.read_file_list(self.folder)["run"].inputs
        with _files.replace_results(self.folder, "report", inputs) as draft:
            super().report(draft / "report.html")
        return self.folder / "report.html"


@validate_arguments
def open_results(folder: str | Path, *, inputs: str | Path | None = None) -> ResultFolder:
    """Open a folder that `archfem run` has written.

    Args:
        folder: the folder.
        inputs: folder of the drawing that the case names; by default the result folder.

    Returns:
        Case and histories of the folder.

    Raises:
        InvalidInput: it is no result folder, the drawing does not exist, or a file was changed or
            is of another run.
    """
    place = Path(folder)
    if not place.is_dir():
        raise InvalidInput(f"there is no folder {place}: give one that `archfem run` has written")
    if (place / _files.FINISHED_FOLDER).is_dir():  # of a command that was killed
        with _files.lock_folder(place):
            _files.complete_publication(place)
    if not (place / CASE_FILE).is_file():
        raise InvalidInput(_missing_case_message(place))
    case = _read_case(place, None if inputs is None else Path(inputs))
    listed = _check_files(place).files
    if case.suite is not None:
        files = {name: place / name / HISTORY_FILE for name in case.suite["pairs"]}
    else:
        files = {_motion_name(case): place / HISTORY_FILE}
    runs = {
        name: History.read(path, case.structure)
        for name, path in files.items()
        if path.is_file() and path.relative_to(place).as_posix() in listed
    }
    # A single motion without a history is no missing pair: the case may have dead load only.
    missing = () if case.suite is None else tuple(name for name in files if name not in runs)
    return ResultFolder(place, case, runs, missing)


def _check_files(place: Path) -> FileGroup:
    """Return the files of the run in a folder; refuse any that was changed or is of another run."""
    groups = _files.read_file_list(place)
    run = groups.get("run")
    if run is None:
        raise InvalidInput(
            f"{place} has no finished run, whose files `archfem run` lists in {_files.LIST_FILE}: "
            "run the case again"
        )
    # histories are checked as they are read, and an earlier report is replaced
    written = [group for command, group in groups.items() if command != "report"]
    for path in (place / name for group in written for name in group.files):
        if path.is_file() and path.name != HISTORY_FILE:
            _files.check_listed(path, _files.read_bytes(path, "result", max_bytes=2**40))
    return run


def _motion_name(case: Case) -> str:
    """Return the name of the only motion of a case."""
    settings = case.motion or {}
    if "synthetic" in settings:
        return f"synthetic {settings['synthetic'].get('seed', 0)}"
    return Path(str(settings.get("file", "motion"))).stem


def _missing_case_message(place: Path) -> str:
    """Return the message of a folder without a case: its probable kind, and the remedy."""
    text = f"{place} has no {CASE_FILE}, which `archfem run` leaves in its folder"
    if (place / HISTORY_FILE).is_file() and (place.parent / CASE_FILE).is_file():
        return f"{text}: it is of one pair of a suite; give the suite's folder, {place.parent}"
    if (place / "study.json").is_file():
        return f"{text}: it is of a study; a report is of one case, run by itself"
    return f"{text}: give that folder, or run the case again with `--out {place}`"


def _read_case(place: Path, inputs: Path | None) -> Case:
    """Read the case of a folder; its drawing is in another folder, that of the original case."""
    path, start = place / CASE_FILE, place if inputs is None else inputs
    settings = read_tables(path, "case file")
    drawing = list_input_files({"structure": settings.get("structure")}, start)
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


def write_limit(case: Case, collapse: Collapse, text: str, folder: Path) -> list[Path]:
    """Write limit analysis and the joints at collapse, and draw the mechanism."""
    columns = ["name", "N", "V", "M", "eccentricity"]
    joints = collapse.joints.to_dataframe()[columns]
    return [
        _write_text(text, folder / "limit.txt"),
        _write_text(joints.to_csv(index=False).rstrip(), folder / "limit.csv"),
        save(draw_collapse(case.structure, collapse), folder / "collapse.png"),
    ]


def write_assessments(
    found: Mapping[str, KinematicAssessment], text: str, folder: Path
) -> list[Path]:
    """Write the results of kinematic assessments, and draw each."""
    figures = [
        save(draw_kinematic_assessment(result), folder / f"assessment_{place}.png")
        for place, result in enumerate(found.values())
        if result.path is not None
    ]
    return [_write_text(text, folder / "assessment.txt"), *figures]


def write_rating(found: Rating, folder: Path) -> list[Path]:
    """Write the rating of a bridge, the factors at all places, and the picture of both."""
    return [
        _write_text(str(found), folder / "rating.txt"),
        _write_text(found.table(), folder / "rating.csv"),
        save(draw_rating(found), folder / "rating.png"),
    ]


def write_dead_load(result: DeadLoadResult, folder: Path) -> list[Path]:
    """Draw thrust line, joint names, and, where available, stress and a free body."""
    case, dead, model = result.case, result.dead, result.dead.model
    files = [
        save(draw_dead_load(dead, criteria=case.criteria), folder / "dead.png"),
        save(draw_names(case.structure), folder / "names.png"),
    ]
    if result.strength_use is not None:
        files.append(save(draw_stress(model, dead), folder / "dead_stress.png"))
        table = strength_use_table(result.strength_use)
        files.append(_write_text(table, folder / "dead_stress.txt"))
    if "free_body" in case.output:
        block = case.output["free_body"]
        figure = draw_free_body(case.structure, dead.joints, block, cells=model.cells)
        files.append(save(figure, folder / "free_body.png"))
    return files


def write_run(run: Run, at_rest: DeadLoadResult, text: str, folder: Path) -> list[Path]:
    """Draw critical instant, envelope, joints over time and fall of a run; film it if requested."""
    case, history, dead = run.case, run.history, at_rest.dead
    critical = history.joints.sel(time=decisive_instant(history), method="nearest")
    figures = {
        "critical_instant.png": draw_during(dead.model, history, critical),
        "envelope.png": draw_envelope({case.title: history}, dead=dead.joints),
        # The joints of the case, or else those of the largest |e| and of the longest sliding.
        "joints.png": draw_joints(history, case.joints or most_stressed_joints(history)),
    }
    if "fall_pose" in history.dataset:
        figures["fall.png"] = draw_fall(history)
    if case.suite is not None:
        figures = {"motion.png": draw_motion(run.motion)} | figures
    files = [save(figure, folder / name) for name, figure in figures.items()]
    if case.output.get("animation", False):
        from archfem.view.films.film import film  # pyvista and the encoder are slow to import

        files.append(film(dead.model, history, folder / "hinges.mp4"))
    return [*files, _write_text(text, folder / SUMMARY_FILE)]


def adopt_files(run: Run) -> bool:
    """Add the files of a pair that an earlier call has finished to the draft of its history.

    Returns False, and adds none, if they are not those of this history.
    """
    assert run.path is not None
    pair, draft, folder = run.path.parents[0].name, run.path.parents[1], run.path.parents[2]
    listed = _files.intact_file_list(folder).get("run")
    names = [] if listed is None else [n for n in listed.files if n.startswith(f"{pair}/")]
    same_history = is_linked(run.path, folder / pair / HISTORY_FILE)
    if f"{pair}/{SUMMARY_FILE}" not in names or not same_history:
        return False
    try:
        for name in names:
            _files.check_listed(folder / name, _files.read_bytes(folder / name, "result"))
    except InvalidInput:
        return False
    for name in names:
        if not (draft / name).exists():
            link_file(folder / name, draft / name)
    return True


def write_suite(suite: Suite, target: DesignSpectrum | None, folder: Path) -> list[Path]:
    """Draw the spectra of a suite beside its target."""
    return [save(draw_suite(suite, target), folder / "spectra.png")]


def write_pairs(
    runs: Mapping[str, History], at_rest: DeadLoadResult, text: str, folder: Path
) -> list[Path]:
    """Write the table of a suite, and draw the envelopes of its runs."""
    pairs, per_figure = list(runs.items()), len(LINE_COLOURS)  # as many runs as line styles
    files = [_write_text(text, folder / "suite.txt")]
    for number, first in enumerate(range(0, len(pairs), per_figure), start=1):
        figure = draw_envelope(dict(pairs[first : first + per_figure]), dead=at_rest.dead.joints)
        name = "envelope.png" if number == 1 else f"envelope_{number}.png"
        files.append(save(figure, folder / name))
    return files


def write_modes(modes: Modes, text: str, folder: Path) -> list[Path]:
    """Write the table of modes, and draw their shapes."""
    return [_write_text(text, folder / "modes.txt"), save(draw_modes(modes), folder / "modes.png")]


def write_accuracy(accuracy: Accuracy, text: str, folder: Path) -> list[Path]:
    """Write and draw computing time against error."""
    figure = save(draw_accuracy(accuracy), folder / "accuracy.png")
    return [_write_text(text, folder / "accuracy.txt"), figure]


def write_verdict_range(verdicts: VerdictRange, folder: Path) -> list[Path]:
    """Write and draw the verdicts over a range of properties."""
    return [
        verdicts.save(folder / "verdict_range.nc"),
        _write_text(str(verdicts), folder / "verdict_range.txt"),
        save(draw_verdict_range(verdicts), folder / "verdict_range.png"),
    ]


def write_motions(motions: Sequence[Motion], folder: Path) -> list[Path]:
    """Draw each motion with its integrals, and the spectra of all."""
    files = [save(draw_motion(motion), folder / f"{motion.name}.png") for motion in motions]
    return [*files, save(draw_spectra(motions), folder / "spectra.png")]


def write_selection(found: RecordSelection, suite: Table, folder: Path) -> list[Path]:
    """Write selected records as text, table, picture, and as the [suite] of a case."""
    return [
        _write_text(str(found), folder / "selection.txt"),
        _write_text(found.table(), folder / "selection.csv"),
        _write_text(tomli_w.dumps({"suite": suite}), folder / "selection.toml"),
        save(draw_selection(found), folder / "selection.png"),
    ]


def with_unique_names(motions: Sequence[Motion], names: Sequence[str]) -> list[Motion]:
    """Return motions named as their files, with a number behind a name that is used before."""
    named: list[Motion] = []
    for index, (motion, name) in enumerate(zip(motions, names, strict=True)):
        before = list(names[:index]).count(name)
        named.append(replace(motion, name=f"{name} ({before + 1})" if before else name))
    return named


def _write_text(text: str, path: Path) -> Path:
    """Write a text atomically."""
    with _files.atomic_write(path) as draft:
        draft.write_text(text + "\n", encoding="utf-8")
    return path
