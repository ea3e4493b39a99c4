"""Carry out a case: dead load, time histories and limit analysis.

`run_case` yields each result as soon as it is computed. Histories are saved in a folder; those of
an earlier call are reused if case, input files, program and ground motion are the same.
"""

import logging
import os
import shutil
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.util import find_spec
from itertools import zip_longest
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr

from archfem import _files
from archfem._display import call_late_bound
from archfem._netcdf import read_dataset
from archfem._validation import validate_arguments
from archfem.cases.case import Case
from archfem.cases.structure_keys import read_survey
from archfem.cases.toml_file import read_tables
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.damping import resolve_effective_damping
from archfem.dynamics.fall import mark_interrupted
from archfem.dynamics.history import FILE_KIND, Ending, History, partial_history
from archfem.dynamics.recorder import Record
from archfem.dynamics.schemes import Viscous
from archfem.dynamics.slip_error import least_compression
from archfem.dynamics.time_history import time_history
from archfem.errors import (
    ArchfemError,
    DidNotConverge,
    InvalidInput,
    filter_log,
    keep_warnings,
    logger,
)
from archfem.joints.criteria import assessed_joints
from archfem.limit.collapse import Collapse
from archfem.limit.fill_strength import Fill
from archfem.limit.self_weight import stands
from archfem.masonry.loads import describe_forces
from archfem.masonry.stiffness_ratio import soften_joints
from archfem.masonry.structure import list_first
from archfem.models.model import Doubt
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.equilibrium import Equilibrium, dead_load_doubts
from archfem.statics.pushover import Pushover
from archfem.statics.stress import strength_use
from archfem.units import format_mm

if TYPE_CHECKING:
    from archfem.view.pages.player import Player


# Names of files in a result folder.
CASE_FILE = "case.toml"
DRAWING_FILE = "drawing.txt"  # file of the blocks, its unit, and how far corners were moved
RATING_FILE = "rating.toml"  # [rating] as `archfem rate` took it
HISTORY_FILE = "history.nc"

# Whole motion of a run in its history: accelerations (sample, axis), and its step as attribute
MOTION_VARIABLE = "whole_motion"


class CaseResult:
    """Base class of results of a case: they have a report and a player."""

    def report(self, path: str | Path, others: "Sequence[CaseResult]" = ()) -> Path:
        """Write an HTML report in one file, for print.

        Args:
            path: the file, .html, or .docx for Word; missing folders are created.
            others: results of other cases, which the report compares with these.

        Returns:
            The file.
        """
        return call_late_bound("CaseResult.report", self, path, others)

    def page(self, path: str | Path) -> Path:
        """Write a page on which a reader changes the arch and shakes it, in any browser.

        Args:
            path: the file, .html; missing folders are created.

        Returns:
            The file.

        Raises:
            InvalidInput: stones are not rigid and dry, or too many.
        """
        return call_late_bound("CaseResult.page", self, path)

    def player(self, run: str | None = None) -> "Player":
        """Return the player of a run, which displays in notebooks and can be saved as a page.

        Args:
            run: name of the run; required if there are several.

        Returns:
            The player.

        Raises:
            InvalidInput: there is no run, or none of that name, or several and none is named.
        """
        return call_late_bound("CaseResult.player", self, run)


@dataclass(frozen=True, eq=False)
class DeadLoadResult:
    """Equilibrium of a case under dead load, from which its runs start.

    Quantities that follow from the equilibrium are computed at first use and cached.

    Attributes:
        case: the case.
        dead: equilibrium under dead load.
        seconds: wall time of the computation [s].
    """

    case: Case
    dead: Equilibrium
    seconds: float = 0.0

    @classmethod
    def of(cls, case: Case) -> "DeadLoadResult":
        """Compute the dead load of a case, as `dead_load_of_case` does.

        Args:
            case: the case.

        Returns:
            The result, with the time of its computation.
        """
        start = perf_counter()
        dead = dead_load_of_case(case)
        return cls(case, dead, perf_counter() - start)

    @cached_property
    def strength_use(self) -> xr.Dataset | None:
        """Stress in the blocks and use of their strength (`strength_use`); None if rigid."""
        model = self.dead.model
        return None if model.cells.stress is None else strength_use(model, self.dead.q)

    @cached_property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the drawing, the model's fidelity and the equilibrium."""
        friction = self.case.analysis.failure_criteria.friction
        lost = list[Doubt]()
        with suppress(InvalidInput):  # the drawing may be gone, whose blocks the case has
            survey = read_survey(self.case.settings, self.case.folder)
            words = "ignored layer '{}' has a closed outline at {} that touches stones along {:.0%}"
            words += " of its sides, as a stone does, and is left out"
            remedy = "if it is a stone, draw it on the layer of its part"
            lost = [Doubt(words, remedy, each) for each in survey.lost] if survey else []
        limit = self.case.limit
        # bonds, which limit analysis of dead load does not take
        with keep_warnings() as said, suppress(ArchfemError):
            if isinstance(limit.fill, Fill) and not stands(self.case.structure, **limit.resistance):
                words = "limit analysis with the fill of [limit] finds no equilibrium at rest"
                lost.append(Doubt(words, "check the thickness of rings and piers, and the fill"))
        lost += [Doubt("{}", "measure the fill, and look for backing", (each,)) for each in said]
        loads = (*limit.dead, *self.case.assessment.options.get("loads", ()))
        ties = [f"the tie at {load.block}" for load in loads if getattr(load, "passive", False)]
        left = ", ".join([each for each in (describe_forces(loads), list_first(ties, 3)) if each])
        if self.case.has_motion and left:
            words = "left out of runs, which have no loads but weights: {}"
            lost.append(Doubt(words, "a limit analysis or an assessment counts it", (left,)))
        return (*self.dead.model.doubts, *lost, *dead_load_doubts(self.dead, friction))

    @cached_property
    def finer(self) -> tuple[Analysis, Equilibrium] | None:
        """Analysis and dead load of the next finer fidelity; None without one to compare with."""
        model = self.dead.model
        levels = {"rigid": "faces", "faces": "condensed", "condensed": "full"}
        if model.fidelity not in levels or model.prediction or find_spec("dolfinx") is None:
            return None
        return self._change_analysis(fidelity=levels[model.fidelity])

    @cached_property
    def softened(self) -> tuple[Analysis, Equilibrium] | None:
        """Analysis and dead load with the compliance of rigid blocks in their joints.

        None for elastic blocks, laws of the user and joints that stiffen as they close: a spring in
        series with these follows no such law. Histories are then compared without this screen.
        """
        structure = self.case.structure
        stiffens = any(joint.contact.closure is not None for joint in structure.joints)
        if self.dead.model.fidelity != "rigid" or structure.has_own_laws or stiffens:
            return None
        return self._change_analysis(structure=soften_joints(structure))

    def _change_analysis(self, **changes: Any) -> tuple[Analysis, Equilibrium] | None:
        """Return a changed analysis with its dead load; None if it does not exist."""
        try:
            other = replace(self.case.analysis, **changes)
            return other, other.dead_load()
        except ArchfemError:  # no such model for this case, or no equilibrium
            return None

    @cached_property
    def damping(self) -> tuple[Viscous | None, str]:
        """Damping of the runs and its description, as `damping_of` returns them."""
        return damping_of(self.case, self.dead)


@dataclass(frozen=True, eq=False)
class Run(CaseResult):
    """Time history of a case under one motion.

    Attributes:
        case: the case with this motion alone.
        motion: ground motion as applied.
        history: recorded response; after a failed step or Ctrl-C, up to that step.
        path: file of the history, or None.
        reused: whether the history is that of an earlier call.
        seconds: wall time of the integration [s]; zero if reused.
        error: error of the failed step, or None.
    """

    case: Case
    motion: Motion
    history: History
    path: Path | None = None
    reused: bool = False
    seconds: float = 0.0
    error: DidNotConverge | None = None

    # The report reads these, as of a `ResultFolder`.
    missing: ClassVar[tuple[str, ...]] = ()
    studies: ClassVar[tuple[Path, ...]] = ()

    @property
    def runs(self) -> Mapping[str, History]:
        """The history by the name of its motion."""
        return {self.motion.name: self.history}

    @property
    def folder(self) -> Path | None:
        """Folder of the history, or None."""
        return None if self.path is None else self.path.parent


# Results that `run_case` yields.
Result = Collapse | DeadLoadResult | Pushover | Suite | Run


@validate_arguments
def run_case(
    case: Case, folder: str | Path | None = None, *, pairs: Collection[str] | None = None
) -> Iterator[Result]:
    """Carry out a case, and yield each result as soon as it is computed.

    With a folder each history is saved: that of one motion as history.nc, that of a pair of a suite
    in a folder of the pair's name. Case, history and list of files appear together, in place of
    those of another case; `open_results` reads them. Pairs that an earlier call has finished are
    reused if case, input files, program and motion are the same. An interrupted call can therefore
    be repeated. A failed step ends its run alone; Ctrl-C ends the run, which is still yielded, and
    the suite; neither replaces a run that was finished before.

    Args:
        case: the case.
        folder: folder of the histories; None saves none.
        pairs: names of the pairs of the suite to run; None runs all.

    Yields:
        The `DeadLoadResult`; a `Pushover` if the case has one; the `Suite` if there is one; a `Run`
        for each motion; and a `Collapse` if the case has [limit] with a load.

    Raises:
        InvalidInput: a motion cannot be read, limit analysis is not possible, or another command
            writes to the folder.
        DidNotConverge: the structure has no equilibrium under dead load, a motion cannot be
            matched, or the first step of a run failed.
    """
    if folder is None:
        yield from carry_out(case, None, pairs=pairs)
        return
    folder, inputs = Path(folder), case.hash_inputs()
    with _files.lock_folder(folder):
        draft, kept = _start_draft(case, folder, inputs), False
        try:
            for result in carry_out(case, draft, pairs=pairs):
                if isinstance(result, Run):
                    result = _publish_run(result, folder, draft, inputs)
                    kept = result.path is not None and result.path.is_relative_to(draft)
                    if not draft.exists():  # for the next pair
                        _start_draft(case, folder, inputs)
                yield result
        finally:
            if not kept:
                shutil.rmtree(draft, ignore_errors=True)


def carry_out(
    case: Case, folder: Path | None, *, pairs: Collection[str] | None = None
) -> Iterator[Result]:
    """Yield the results of `run_case`, with histories in a draft of a result folder."""
    # Unreadable records are errors before the dead load is computed.
    selected = case if pairs is None else case.alone(*pairs)
    selected.check_ground()
    case.limit.check(case.structure)
    if case.pushover is not None:
        case.pushover.check(case.structure)
    at_rest = DeadLoadResult.of(case)
    yield at_rest
    if case.pushover is not None:
        yield case.pushover.solve(at_rest.dead, case.analysis.failure_criteria)
    if case.suite is not None:
        suite = selected.ground_suite()  # spectral matching takes a second a pair
        yield suite
        for motion in suite.motions:
            run = _run_pair(at_rest, motion, folder)
            yield run
            if run.history.ending is Ending.INTERRUPTED:  # by Ctrl-C, or SIGTERM
                return
    elif case.motion is not None:
        path = None if folder is None else folder / HISTORY_FILE
        run = _run_motion(case, case.ground_motion(), at_rest, path)
        yield run
        if run.history.ending is Ending.INTERRUPTED:
            return
    # of a large wall it takes longest, and its interruption loses nothing else
    if case.limit.live:
        yield case.limit.solve_so_far(case.structure)


@validate_arguments
def dead_load_of_case(case: Case) -> Equilibrium:
    """Compute the equilibrium of a case under dead load, built in the stages of the case.

    With fidelity "auto" the model is selected for the motion of the case, or the first pair of its
    suite.

    Args:
        case: the case.

    Returns:
        The equilibrium.

    Raises:
        DidNotConverge: the structure has no equilibrium.
    """
    if not case.analysis.selects_model or not case.has_motion:
        return case.analysis.dead_load()
    if case.suite is None:
        return case.analysis.dead_load(case.ground_motion())
    first = next(iter(case.suite["pairs"]))  # matching the other pairs would only take time
    return case.analysis.dead_load(case.alone(first).ground_suite().motions[0])


@validate_arguments
def damping_of(case: Case, dead: Equilibrium) -> tuple[Viscous | None, str]:
    """Return the damping of a case, whose frequencies may be those of modes about the dead load.

    Args:
        case: the case.
        dead: its equilibrium under dead load.

    Returns:
        The damping, and a sentence with ratio, frequencies, and how these were determined.

    Raises:
        InvalidInput: damping by effective modes, of which there are fewer than two.
    """
    return resolve_effective_damping(case.analysis.damping, dead.model, dead)


@validate_arguments
def run_time_history(
    case: Case, motion: Motion, dead: Equilibrium, damping: Viscous | None = None
) -> History:
    """Compute the time history of a case under a motion; the history contains the case.

    Args:
        case: the case.
        motion: ground motion.
        dead: equilibrium that the run starts from.
        damping: damping of the run; by default that of the case.

    Returns:
        The history.

    Raises:
        DidNotConverge: a step failed; `history` of the error is the record up to it.
    """
    attrs = {"case": case.text(), "inputs": case.hash_inputs()}

    def complete(dataset: xr.Dataset) -> None:
        dataset.attrs |= attrs
        vertical = () if motion.vertical is None else motion.vertical
        samples = [*zip_longest(motion.horizontal, vertical, fillvalue=0.0)]
        # a report measures all of the motion, which a run that falls does not follow to its end
        dataset[MOTION_VARIABLE] = ("sample", "axis"), samples, {"dt": motion.dt}

    given: Any = {} if damping is None else {"damping": damping}  # None would be undamped
    try:
        with log_prefix(case.title, motion.name):
            run = time_history(case.analysis, motion, start=dead, **given)
    except DidNotConverge as error:
        # The partial history is saved like a complete one.
        if error.history is not None:
            complete(error.history.dataset)
        raise
    complete(run.dataset)
    return run


def log_prefix(*names: str) -> AbstractContextManager[None]:
    """Prefix warnings of a block with names, so that those of many runs can be distinguished."""

    def add_prefix(record: logging.LogRecord) -> bool:
        if not getattr(record, "named", False):  # an inner block has added its own prefix
            record.msg, record.args = f"{', '.join(names)}: {record.getMessage()}", ()
            record.named = True
        return True

    return filter_log(add_prefix)


def _run_pair(at_rest: DeadLoadResult, motion: Motion, folder: Path | None) -> Run:
    """Run a pair of a suite, or reuse the history of an earlier call."""
    case = at_rest.case.alone(motion.name)
    path = None if folder is None else folder / motion.name / HISTORY_FILE
    if path is not None and (history := load_finished_run(path, case, motion)) is not None:
        # A model that was selected for the first pair may differ from that of the earlier call.
        prediction = at_rest.dead.model.prediction
        if prediction is None or history.dataset.attrs.get("predicted_error") == prediction.error:
            return Run(case, motion, history, path, reused=True)
    return _run_motion(case, motion, at_rest, path)


def _run_motion(case: Case, motion: Motion, at_rest: DeadLoadResult, path: Path | None) -> Run:
    """Run a motion and save its history, also if a step fails."""
    start, failure = perf_counter(), None
    try:
        history = run_time_history(case, motion, at_rest.dead, at_rest.damping[0])
    except DidNotConverge as error:
        history, failure = partial_history(error), error
    seconds = perf_counter() - start
    compared = list[Doubt]()
    if history.ending is not Ending.INTERRUPTED:
        try:
            compared = doubt_fidelity(at_rest, motion, history)
        except KeyboardInterrupt:
            history = mark_interrupted(history, "its comparison with a finer fidelity, at the end")
    history = history.with_doubts((*at_rest.doubts, *history.doubts, *compared))
    if path is not None:
        history.save(path)
        del history  # of a long run it takes hundreds of megabytes
        # as later calls read it, so that their tables have the same digits
        history = History.read(path, case.structure)
    return Run(case, motion, history, path, seconds=seconds, error=failure)


def doubt_fidelity(at_rest: DeadLoadResult, motion: Motion, history: History) -> list[Doubt]:
    """Return a doubt where the next finer fidelity disagrees in |e| at the start of a run."""
    # of the largest |e| [-]; rigid stones of ordinary stiffness differ by 0.02 where joints slide
    tolerance = 0.03
    # Softened joints differ as a finer fidelity does, by a factor of 0.35 at least in 180 random
    # runs. They need no mesh, whose libraries take longer to load than the run.
    screened = _compare_start(at_rest, at_rest.softened, motion, history)
    if screened is not None and screened[0] <= 0.25 * tolerance:
        return []
    compared = _compare_start(at_rest, at_rest.finer, motion, history)
    if compared is None or compared[0] <= tolerance:
        return []
    worst, end, finer = compared
    words = (
        f"within the first {{:g}} s fidelity '{at_rest.dead.model.fidelity}' differs from "
        f"'{finer}' by {{:.2g}} in the largest |e| of a joint, and displacements may differ "
        f"several times: take fidelity '{finer}'"
    )
    return [Doubt(words, "or 'auto', which predicts its error", (end, worst))]


def _compare_start(
    at_rest: DeadLoadResult,
    other: tuple[Analysis, Equilibrium] | None,
    motion: Motion,
    history: History,
) -> tuple[float, float, str] | None:
    """Return the difference of another analysis in the largest |e|, its end, and the fidelity."""
    if other is None:
        return None
    analysis, dead = other
    try:
        cut = motion.cut(0.0, 0.5)
        with keep_warnings():  # which are of this model, and not of the run
            settings: Any = {"start": dead, "damping": at_rest.damping[0]}
            run = time_history(analysis, cut, record=Record(repeat=False), **settings)
        if run.ending is Ending.INTERRUPTED:
            raise KeyboardInterrupt
    except ArchfemError:  # it has no equilibrium at some step: no comparison
        return None
    # either run may have ended before, by an event or a failed step
    end = min(float(history.time[-1]), float(run.time[-1]))
    sizes = []
    # as in the control of the steps: |e| of a joint that carries next to nothing decides nothing
    least = least_compression(assessed_joints(history.joints)["N"].values[0], dead.model.structure)
    for each in (history, run):
        joints = assessed_joints(each.joints.sel(time=slice(None, end)))
        pressed = np.maximum(joints["N"].values, least) * joints["depth"].values
        sizes.append(np.abs(joints["M"].values / pressed).max(axis=0))
    worst = float(np.abs(sizes[0] - sizes[1]).max(initial=0.0))
    return worst, end, dead.model.fidelity


def load_finished_run(path: Path, case: Case, motion: Motion) -> History | None:
    """Return the finished history of an earlier call, if its inputs and motion are the same."""
    try:
        run = History.read(path, case.structure)
        finished = run.ending.is_complete
    except InvalidInput:
        return None
    if not finished or run.dataset.attrs.get("inputs") != case.hash_inputs():
        return None
    # Spectral matching reproduces accelerations up to round-off, far below 1e-6 m/s².
    saved, applied = run.dataset["ground"].values, motion.at(run.time)
    return run if np.allclose(saved, applied, rtol=0.0, atol=1e-6) else None


@contextmanager
def replace_run(case: Case, folder: Path) -> Iterator[Path]:
    """Yield a draft folder whose files replace those of an earlier run when the block ends."""
    # If the block fails, the folder keeps the results of an earlier run; without any it gets what
    # was computed. The draft of a suite has the histories of earlier calls.
    inputs = case.hash_inputs()
    with _files.lock_folder(folder):
        draft = _start_draft(case, folder, inputs)
        try:
            yield draft
        except BaseException as error:
            kept = _keep_partial_results(folder, draft, inputs)
            if isinstance(error, KeyboardInterrupt) and not kept:
                logger.warning("interrupted before there was a result: nothing is kept")
            raise
        _files.publish_draft(folder, "run", inputs)


def _start_draft(case: Case, folder: Path, inputs: str) -> Path:
    """Return a draft with the case, and of a suite the histories that earlier calls computed."""
    _files.complete_publication(folder)
    _files.refuse_unlisted(folder, (CASE_FILE, HISTORY_FILE))
    _warn_of_another_case(case, folder)
    draft, listed = _files.start_draft(folder, "run"), _files.intact_file_list(folder).get("run")
    pairs = {f"{name}/{HISTORY_FILE}": name for name in (case.suite or {}).get("pairs", ())}
    for path in _files.list_files(draft):
        name = path.relative_to(draft).as_posix()
        if name not in pairs or not _is_of(path, case.alone(pairs[name])):
            path.unlink()
    for name, pair in pairs.items():
        path = _files.path_inside(folder, name)
        if path.is_file() and not (draft / name).exists():
            # histories of this very case need not be read again
            known = listed is not None and listed.inputs == inputs and name in listed.files
            if known or _is_of(path, case.alone(pair)):
                link_file(path, draft / name)
    for name, text in case_files(case).items():
        with _files.atomic_write(draft / name) as part:
            part.write_text(f"{text}\n", encoding="utf-8")
    return draft


def _warn_of_another_case(case: Case, folder: Path) -> None:
    """Say that a folder has results of a case with another title, which a run replaces."""
    path = _files.path_inside(folder, CASE_FILE)
    with suppress(InvalidInput):  # damaged
        title = read_tables(path, "case file").get("title", case.title) if path.is_file() else ""
        if title not in ("", case.title):
            text = "%s has results of another case, '%s': those of the same names are replaced"
            logger.warning(text, folder, title)


def case_files(case: Case) -> dict[str, str]:
    """Return the case, and the report on its drawing, whose blocks the case has."""
    files = {CASE_FILE: case.text().rstrip("\n")}
    if (survey := read_survey(case.settings, case.folder)) is not None:
        table = case.settings["structure"]
        snap = table.get("snap", 1e-3)
        within = snap if isinstance(snap, str) else format_mm(snap)
        files[DRAWING_FILE] = f"{table['file']}, snap {within}; {survey}"
    return files


def _is_of(path: Path, case: Case) -> bool:
    """Return whether a file is a history of a case and its input files by this program."""
    try:
        stored = read_dataset(path, FILE_KIND).attrs.get("inputs")
    except InvalidInput:
        return False
    return bool(stored == case.hash_inputs())


def _publish_run(run: Run, folder: Path, draft: Path, inputs: str) -> Run:
    """Move a run from its draft to its place, unless it is incomplete and would replace another."""
    assert run.path is not None
    name = run.path.relative_to(draft)
    place, listed = _files.path_inside(folder, name), _files.intact_file_list(folder).get("run")
    if listed is not None:
        same = listed.inputs == inputs and name.as_posix() in listed.files
        if same and place.is_file() and _files.hash_content(place) == _files.hash_content(run.path):
            return replace(run, path=place)  # pictures and summary of it stay
        # of a suite the other pairs are run nevertheless
        broken_off = run.error is not None and run.case.suite is None
        replaces = same or listed.inputs != inputs
        if replaces and (broken_off or run.history.ending is Ending.INTERRUPTED):
            _warn_of_draft(folder, draft)
            return run
    _files.publish_draft(folder, "run", inputs)
    return replace(run, path=place)


def _keep_partial_results(folder: Path, draft: Path, inputs: str) -> bool:
    """Publish results of a run that failed, if any, unless the folder has those of another run."""
    files = [path for path in _files.list_files(draft) if path.name != CASE_FILE]
    new = [path for path in files if not is_linked(path, folder / path.relative_to(draft))]
    if new and "run" not in _files.intact_file_list(folder):
        _files.publish_draft(folder, "run", inputs)
        logger.warning("what was computed is kept in %s", folder)
    elif any(path.name == HISTORY_FILE for path in new):
        _warn_of_draft(folder, draft)
    else:
        shutil.rmtree(draft, ignore_errors=True)
        return False
    return True


def _warn_of_draft(folder: Path, draft: Path) -> None:
    """Say where the results are of a run that was broken off."""
    text = "%s keeps the results of an earlier run; what was computed now is in %s"
    logger.warning(text, folder, draft)


def link_file(source: Path, target: Path) -> None:
    """Link a file, or copy it where the disk has no links."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def is_linked(path: Path, other: Path) -> bool:
    """Return whether two paths are of the same file."""
    return other.is_file() and path.samefile(other)
