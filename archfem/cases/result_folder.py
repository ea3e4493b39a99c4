"""Result folders: tables and pictures that `archfem run` writes, and folders opened again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import xarray as xr

from archfem._files import atomic_write
from archfem._validation import validate_arguments, validate_methods
from archfem.cases.case import Case
from archfem.cases.provenance import list_input_files
from archfem.cases.run import HISTORY_FILE, CaseResult, DeadLoadResult, Run
from archfem.cases.toml_file import parse_tables, read_tables
from archfem.dynamics.accuracy import Accuracy
from archfem.dynamics.history import History
from archfem.dynamics.verdict_range import VerdictRange
from archfem.errors import ArchfemError, InvalidInput
from archfem.joints.criteria import assessed_joints
from archfem.limit.collapse import Collapse
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.modes import Modes
from archfem.statics.stress import strength_use_table
from archfem.view.collapse import draw_collapse, draw_fall
from archfem.view.histories import draw_envelope, draw_joints, most_stressed_joints
from archfem.view.motions import draw_motion, draw_spectra, draw_suite
from archfem.view.statics import draw_dead_load, draw_free_body, draw_modes
from archfem.view.stress import draw_stress
from archfem.view.structure import draw_during, draw_names
from archfem.view.studies import draw_accuracy, draw_verdict_range
from archfem.view.style import LINE_COLOURS, save

CASE_FILE = "case.toml"
# The summary of a run is written last: if it exists, all other files of the run do.
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
        return super().report(self.folder / "report.html" if path is None else path)


@validate_arguments
def open_results(folder: str | Path, *, inputs: str | Path | None = None) -> ResultFolder:
    """Open a folder that `archfem run` has written.

    Args:
        folder: the folder.
        inputs: folder of the drawing that the case names; by default the result folder.

    Returns:
        Case and histories of the folder.

    Raises:
        InvalidInput: it is no result folder, the drawing does not exist, or a history is that of
            another structure or case.
    """
    place = Path(folder)
    if not place.is_dir():
        raise InvalidInput(f"there is no folder {place}: give one that `archfem run` has written")
    if not (place / CASE_FILE).is_file():
        raise InvalidInput(_missing_case_message(place))
    case = _read_case(place, None if inputs is None else Path(inputs))
    if case.suite is not None:
        files = {name: place / name / HISTORY_FILE for name in case.suite["pairs"]}
    else:
        files = {_motion_name(case): place / HISTORY_FILE}
    runs = {
        name: History.read(path, case.structure) for name, path in files.items() if path.is_file()
    }
    for name, run in runs.items():
        _check_case_of_history(files[name], run, case if case.suite is None else case.alone(name))
    # A single motion without a history is no missing pair: the case may have dead load only.
    missing = () if case.suite is None else tuple(name for name in files if name not in runs)
    return ResultFolder(place, case, runs, missing)


def _check_case_of_history(path: Path, run: History, case: Case) -> None:
    """Refuse a history of another case, as a command that was broken off leaves in its folder."""
    text = run.dataset.attrs.get("case")
    if text is not None and parse_tables(str(text)) != parse_tables(case.text()):
        raise InvalidInput(
            f"{path} is of another case than {CASE_FILE} in the folder: a later command ended "
            "before it had computed this run; run the case again"
        )


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
    """Write the result of limit analysis, and draw the mechanism over the structure."""
    figure = draw_collapse(case.structure, collapse)
    return [_write_text(text, folder / "limit.txt"), save(figure, folder / "collapse.png")]


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
    figures = {
        "critical_instant.png": draw_during(dead.model, history, _critical_instant(history)),
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


def is_written(run: Run) -> bool:
    """Return whether the files of a run exist and are not older than its history."""
    if run.path is None or not (summary := run.path.with_name(SUMMARY_FILE)).is_file():
        return False
    # After an interruption between history and figures, all files are written again.
    return summary.stat().st_mtime_ns >= run.path.stat().st_mtime_ns


def _critical_instant(run: History) -> xr.Dataset:
    """Return the joints at the first mechanism, or at the largest |e|."""
    if run.mechanism is not None:
        return run.joints.sel(time=run.mechanism.time, method="nearest")
    eccentricity = abs(assessed_joints(run.joints)["eccentricity"])
    return run.joints.isel(time=int(eccentricity.max("joint").argmax("time")))


def write_suite(suite: Suite, target: DesignSpectrum | None, folder: Path) -> list[Path]:
    """Draw the spectra of a suite beside its target."""
    return [save(draw_suite(suite, target), folder / "spectra.png")]


def write_pairs(
    runs: Mapping[str, History], at_rest: DeadLoadResult, text: str, folder: Path
) -> list[Path]:
    """Write the table of a suite, and draw the envelopes of its runs."""
    pairs, per_figure = (
        list(runs.items()),
        len(LINE_COLOURS),
    )  # as many runs as there are line styles
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
    return [
        _write_text(text, folder / "accuracy.txt"),
        save(draw_accuracy(accuracy), folder / "accuracy.png"),
    ]


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


def with_unique_names(motions: Sequence[Motion], names: Sequence[str]) -> list[Motion]:
    """Return motions named as their files, with a number behind a name that is used before."""
    named: list[Motion] = []
    for index, (motion, name) in enumerate(zip(motions, names, strict=True)):
        before = list(names[:index]).count(name)
        named.append(replace(motion, name=f"{name} ({before + 1})" if before else name))
    return named


def _write_text(text: str, path: Path) -> Path:
    """Write a text atomically."""
    with atomic_write(path) as draft:
        draft.write_text(text + "\n", encoding="utf-8")
    return path
