"""Commands on cases: run, modes, limit, thickness, assess, rate, mesh, accuracy, report; others."""

import argparse
import io
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from functools import partial, wraps
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from archfem import _files
from archfem._display import DOUBT_MARK, NOTE_MARK, ProgressReport, write_progress_line
from archfem._files import create_result_folder
from archfem._optional import can_film
from archfem.cases import answers, defaults, rating_text, result_text, structure_text
from archfem.cases import result_folder as results
from archfem.cases import run as case_run
from archfem.cases.analysis_keys import name_vehicles, parse_rating, rate_case
from archfem.cases.answers import RESULTS
from archfem.cases.case import Case, sign
from archfem.cases.run import RATING_FILE, DeadLoadResult, Result, Run, replace_run
from archfem.cases.structure_keys import read_survey
from archfem.cases.toml_file import format_tables, parse_change
from archfem.commands.tools import doubt_code, print_motions, show_both_senses
from archfem.dynamics.history import Ending, History
from archfem.dynamics.walls_across import check_across
from archfem.errors import ArchfemError, DidNotConverge, Interrupted, InvalidInput, keep_warnings
from archfem.limit.collapse import Collapse, describe_fill
from archfem.limit.instability import describe_geometric_factor
from archfem.limit.rating import Rating
from archfem.masonry.structure import join_words
from archfem.models.model import Doubt, group_doubts, merge_doubts
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.assessed_mechanism import KinematicAssessment
from archfem.statics.first_mechanism import OF_TIES
from archfem.statics.modes import Modes
from archfem.statics.pushover import Pushover
from archfem.view.collapse import draw_ratings, draw_worst_places
from archfem.view.motions import draw_suite
from archfem.view.style import Files, write_files

Command = Callable[[argparse.Namespace], int]
CaseCommand = Callable[[Case, argparse.Namespace], int]

# Modules that import pyvista or studies, which are slow, are imported where they are needed.


# Joints of the table that `archfem run` prints; summary.txt has all
MAX_PRINTED_JOINTS = 20


class FailedPairs(DidNotConverge):
    """Some pairs of a suite failed; the results of the suite are complete nevertheless."""


def run(options: argparse.Namespace) -> int:
    """Carry out a case: dead load, time histories and limit analysis, tables and pictures."""
    case, folder = Case.read(options.case, options.changes), create_result_folder(options.out)
    failure = None
    # All else is printed after the verdict, which is known last.
    with _print_at_end(folder, "run", case.title) as verdict, replace_run(case, folder) as draft:
        computed = case_run.carry_out(case, draft)
        if options.workers > 1 and case.suite is not None:
            from archfem.studies.study import compute_pairs

            # Workers save the histories, which are read below.
            before = {path.parent.name for path in draft.glob("*/history.nc")}
            compute_pairs(case, draft, workers=options.workers)
            computed = (
                replace(x, reused=x.motion.name in before) if isinstance(x, Run) and x.reused else x
                for x in computed
            )
        try:
            headline, doubts = print_results(case, computed, draft)
            verdict.append(headline)
        except FailedPairs as error:
            failure = error
    if failure is not None:
        raise failure
    return doubt_code(doubts)


@contextmanager
def _print_at_end(folder: Path, command: str, text: str = "") -> Iterator[list[str]]:
    """Print the output of a block when its results are in place, below a text and a verdict."""
    output, verdict = io.StringIO(), list[str]()
    try:
        with redirect_stdout(output):
            yield verdict
    finally:
        if text:
            print(": ".join([text, *filter(None, verdict)]))
        print(_name_published_files(output.getvalue(), folder, command), end="")


def write_results(
    command: str,
    case: Case,
    out: str | None,
    text: str,
    draw: Callable[[], Files],
    pair: str | None = None,
) -> None:
    """Write the results of a command to its folder, if one is given, and then print its text.

    Those of a pair of a suite are written to its own folder, and replace none of another pair.
    """
    if out is None:
        print(text)
        return
    name, inputs, place = name_group(command, pair), case.hash_inputs(), PurePath(pair or "")
    listed = _files.intact_file_list(Path(out)).items()
    if any(each.inputs != inputs for key, each in listed if key != name):
        others = f"{NOTE_MARK}{out} has results of another case, drawing or version of archfem"
        remedy = "a report shows those of one alone: give all the same `--set`, or name another"
        text += f"\n{others}: {remedy}"
    # a reader of the text, such as `head`, may leave before its end
    with _print_at_end(Path(out), name, text):
        folder = create_result_folder(out)
        with _files.replace_results(folder, name, inputs) as draft:
            run = _files.intact_file_list(folder).get("run")
            files: Files = {str(place / key): content for key, content in draw().items()}
            # a run has the case of the folder, in which [report] may have changed
            if run is None or run.inputs == inputs:
                files = {**case_run.case_files(case), **files}
            write(files, draft)


def name_group(command: str, pair: str | None) -> str:
    """Return the name of a command's results in the list of a folder, as the command is called."""
    return command if pair is None else f"{command} --pair {pair}"


def _name_published_files(text: str, folder: Path, command: str) -> str:
    """Replace the names of files of a draft by those of the result folder, unless it is left."""
    draft = folder / f"{_files.DRAFT_PREFIX}{command}"
    if draft.exists():
        return text
    lines = text.replace(str(draft), str(folder)).splitlines(keepends=True)
    # a draft that failed may have been deleted
    return "".join(x for x in lines if x[:6] != "wrote " or Path(x[6:].strip()).exists())


def keep_attempt(name: str) -> Callable[[CaseCommand], Command]:
    """Let a command read its case, and leave the reason in its folder where it finds no answer."""

    def decorate(command: CaseCommand) -> Command:
        @wraps(command)
        def attempt(options: argparse.Namespace) -> int:
            case = Case.read(options.case, options.changes)
            try:
                return command(case, options)
            except DidNotConverge as error:
                text, pair = f"no answer: {error}", getattr(options, "pair", None)
                demand = f"'{pair}'" if pair else "-"
                stated = answers.state_outcome(RESULTS[name], text, demand=demand)
                files: Files = {f"{name}.txt": text, **stated.as_file(name)}
                write_results(command.__name__, case, options.out, text, lambda: files, pair)
                raise

        return attempt

    return decorate


def modes(options: argparse.Namespace) -> int:
    """Compute the modes of a case about its dead load: table, picture, film of the first two."""
    case, folder = Case.read(options.case, options.changes), create_result_folder(options.out)
    print(case.title)
    given = folder, "modes"
    with _print_at_end(*given), _files.replace_results(*given, case.hash_inputs()) as draft:
        at_rest = DeadLoadResult.of(case)
        print(result_text.describe_dead_load(at_rest))
        computed = print_modes(at_rest, options.count, draft)
        first = range(1, min(len(computed.frequencies), 2) + 1)
        if can_film():
            from archfem.view.films.film import film_modes

            write({"modes.gif": lambda path: film_modes(computed, path, first)}, draft)
    return doubt_code([*at_rest.doubts, *computed.doubts])


@keep_attempt("limit")
def limit(case: Case, options: argparse.Namespace) -> int:
    """Find the collapse factor of the loads in [limit], and the mechanism."""

    def show(found: Collapse, text: str, *others: Any) -> None:
        given = case.structure, case.limit.strength, case.limit.fill
        at_rest = describe_geometric_factor(*given) if case.limit.fill else ""
        text = "\n".join(filter(None, [text, at_rest]))
        files = partial(results.limit_files, case, found, text, *others)
        write_results("limit", case, options.out, f"{case.title}\n{text}", files)

    with result_text.record_doubts(case.structure) as doubts:
        first = case.limit.solve_so_far(case.structure)
        return doubt_code(show_both_senses(case, first, show, doubts))


def thickness(options: argparse.Namespace) -> int:
    """Find the least thickness of a ring at rest, scaled about its middle line."""
    case = Case.read(options.case, options.changes)
    with result_text.record_doubts(case.structure) as doubts:
        rows, lines = structure_text.describe_thickness(case, options.part)
    text = "\n".join([*lines, *result_text.mark_remarks(doubts)])
    remarks: list[result_text.Remark] = [*doubts, *(x for x in lines if x.startswith(NOTE_MARK))]
    sentences = [f"{row.result}: {row.outcome}" for row in rows]
    stated = answers.Statement(sentences, rows).with_remarks(remarks)
    files: Files = {"thickness.txt": text, **stated.as_file("thickness")}
    write_results("thickness", case, options.out, f"{case.title}\n{text}", lambda: files)
    return doubt_code(doubts)


@keep_attempt("assessment")
def assess(case: Case, options: argparse.Namespace) -> int:
    """Assess the collapse mechanisms of a case against a design spectrum, in both directions."""
    with result_text.record_doubts(case.structure) as doubts:
        try:
            found = case.assessment.solve(case.structure, case.demand, options.parts)
        except KeyboardInterrupt as error:
            bound = f"{error.last.sentence}; " if isinstance(error, Interrupted) else ""
            write_progress_line("assessment", f"{bound}nothing is kept")
            raise
    ties: list[result_text.Remark] = [
        f"{NOTE_MARK}the force of ties with which all checks pass was not searched to its end"
    ]
    try:  # a search of many assessments, which may be cut short
        with keep_warnings():  # which are those of the assessment
            found = found if options.parts else answers.assess_untied(case, found)
            ties = [] if options.parts else answers.note_ties(case)
    finally:
        every = _show_assessment(case, found, [*doubts, *ties], options.out)
    return doubt_code(every)


def _show_assessment(
    case: Case,
    found: Mapping[str, KinematicAssessment],
    remarks: list[result_text.Remark],
    out: str | None,
) -> list[result_text.Remark]:
    """Write the results of an assessment and print them; return all its remarks."""
    remarks += [] if case.assessment.tied_along else answers.doubt_strip(case.structure)
    remarks += [*answers.doubt_ties(case)]
    remarks += answers.note_sense(case)
    remarks += answers.note_band(case, found.values())
    remarks += answers.note_across(case.structure, found.values())
    remarks += result_text.note_masses(case.structure, parapets=case.parapets)
    own = group_doubts(doubt for result in found.values() for doubt in result.doubts)
    every = [*remarks, *map(merge_doubts, own)]  # of both senses once
    texts = [answers.describe_margin(found.values())]
    for name, result in found.items():
        # doubts follow at the end, once, and the note on all forces of ties is that of the first
        said = DOUBT_MARK, *[f"{NOTE_MARK}{OF_TIES}"] * any(OF_TIES in text for text in texts)
        lines = [x for x in str(result).splitlines() if not x.startswith(said)]
        texts.append("\n".join([f"{name}: {lines[0]}", *lines[1:]]))
    of_fill = describe_fill(case.assessment.options.get("fill"), case.structure)
    spectrum = defaults.describe_spectrum_defaults(case)
    spectrum = f"spectrum, by default: {spectrum}" * bool(spectrum)
    of_case = [of_fill, defaults.describe_fill_defaults(case), spectrum]
    texts.append("\n".join(filter(None, of_case)))
    text = "\n\n".join(filter(None, [*texts, "\n".join(result_text.mark_remarks(every))]))

    def draw() -> Files:
        numbered = {f"assessment_{k}.png": result for k, result in enumerate(found.values())}
        figures = {name: each.plot() for name, each in numbered.items() if each.path is not None}
        stated = answers.state_assessments(found, remarks).as_file("assessment")
        return {"assessment.txt": text, **stated, **figures}

    write_results("assess", case, out, f"{case.title}\n{text}", draw)
    return every


@keep_attempt("rating")
def rate(case: Case, options: argparse.Namespace) -> int:
    """Rate the bridge of a case for vehicles, by the joints and the fill of its [limit]."""
    values = {x: getattr(options, x) for x in ("live", "impact", "dead", "width", "area_load")}
    # as in --set, so that a length may have a unit
    given = dict(parse_change(f"{k}={x}") for k, x in values.items() if x is not None)
    rating = {**case.settings.get("rating", {}), **given}
    tables = name_vehicles(options.vehicles, rating)
    rated = _rate_each(case, tables)
    ratings, (first, _, table), varied = [each[:2] for each in rated], rated[0], None
    stated = rating_text.state_ratings(ratings)
    interrupted = len(ratings) < len(tables) and not np.isnan(first.factor)
    if options.vary and not interrupted and not np.isnan(first.factor):
        # the one whose outcome other properties change first
        found, lines, own = min(rated, key=lambda each: abs(np.log(max(each[0].factor, 1e-9))))
        varied, sentences, doubts = _vary(case, own, found, options.out)
        interrupted = len(doubts) > 0
        if sentences and len(rated) > 1:
            words = f"only {found.vehicle.name} was varied, whose factor is nearest to 1: "
            sentences.append(f"{words}others by --vehicle, each alone")
        freed = [cell for name, cell in varied.rows if name.startswith("abutments free")]
        if freed and "not computed" not in freed:
            lines[:] = [x for x in lines if rating_text.IMMOVABLE not in str(x)]
        stated = rating_text.state_ratings(ratings, varied)
        lines[:0] = [*sentences, *doubts]
        stated = stated._replace(sentences=[*stated.sentences, *sentences]).with_remarks(doubts)
    text, files = rating_text.describe_ratings(case, ratings, varied)
    # the case of the folder, that of a run, may be rated for another vehicle
    files |= {RATING_FILE: format_tables({"rating": table}).rstrip(), **stated.as_file("rating")}

    def draw() -> Files:
        drawn = {"rating.png": first.plot()}
        if len(found := [found for found, _ in ratings]) > 1:
            drawn |= {"vehicles.png": draw_ratings(found), "places.png": draw_worst_places(found)}
        return {**files, **drawn}

    write_results("rate", case, options.out, f"{case.title}\n{text}", draw)
    if interrupted:
        raise KeyboardInterrupt
    return doubt_code([doubt for _, doubts in ratings for doubt in doubts])


def _vary(
    case: Case, table: Mapping[str, Any], found: Rating, out: str | None
) -> tuple[result_text.ResultTable, list[str], list[Doubt]]:
    """Return table and sentences of the variations of a rating, and those that Ctrl-C left out."""
    from archfem.studies.variations import vary_rating

    folder = None if out is None else _files.path_inside(Path(out), "rating_variations")
    varied, sentences, left = vary_rating(case, table, found, folder)
    remedy = "give --out, which keeps the others"
    if folder is not None:
        remedy = f"run the same command again, which continues from {folder}"
    words = f"interrupted: {left} variations of the rating were not computed"
    return varied, sentences, [Doubt(words, remedy)] if left else []


def _rate_each(
    case: Case, tables: Sequence[Mapping[str, Any]]
) -> list[tuple[Rating, list[result_text.Remark], Mapping[str, Any]]]:
    """Return ratings with their doubts and tables, that of the least `rank` first.

    Those before Ctrl-C are returned, if there are any.
    """
    rated, count = list[tuple[Rating, list[result_text.Remark], Mapping[str, Any]]](), len(tables)
    with ProgressReport("rating", count) as progress:
        for number, table in enumerate(tables):
            progress.show(f"vehicle {number + 1} of {count}")
            try:
                with result_text.record_doubts(case.structure) as doubts:
                    found = rate_case(case.structure, parse_rating(table), case.limit)
            except KeyboardInterrupt:
                if not rated:
                    write_progress_line("rating", "no vehicle was rated, and nothing is kept")
                    raise
                left = f"interrupted: {count - number} of {count} vehicles were not rated"
                rated[-1][1].append(Doubt(left, "a new command rates all of its own"))
                break
            rated.append((found, [*doubts, *rating_text.doubt_rating(found, case.limit)], table))
            progress.show(f"{found.vehicle.name}: {found.headline.partition(',')[0]}", 1)
            if np.isnan(found.factor):  # whatever the vehicle
                break
    return sorted(rated, key=lambda each: each[0].rank[0])


def mesh(options: argparse.Namespace) -> None:
    """Write the mesh of a case as a gmsh file."""
    from archfem.models.fem.mesh import write_mesh

    case = Case.read(options.case, options.changes)
    write_mesh(case.structure, options.out, case.analysis.discretisation)
    print(f"wrote {options.out}")


@keep_attempt("accuracy")
def accuracy(case: Case, options: argparse.Namespace) -> int:
    """Run a case over fidelities, meshes, quadratures and steps: table and picture."""
    from archfem.studies.convergence import case_accuracy
    from archfem.view.studies import draw_accuracy

    folder = create_result_folder(options.out)
    compared = case_accuracy(case, _files.path_inside(folder, "settings"), workers=options.workers)
    text = result_text.describe_accuracy(compared)
    files: Files = {"accuracy.txt": text, "accuracy.png": draw_accuracy(compared)}
    write_results("accuracy", case, options.out, text, lambda: files)
    return 0


@keep_attempt("risk")
def risk(case: Case, options: argparse.Namespace) -> int:
    """Compute the annual rate at which the structure of a case falls, by its [risk]."""
    from archfem.studies.collapse_risk import collapse_risk

    if case.risk is None:
        raise InvalidInput(f"{options.case} has no [risk]: give it a hazard, and a [suite]")
    folder = create_result_folder(options.out)
    print(case.title)
    alternatives = {
        label: (weight, Case.read(options.case, [*options.changes, *changes]).analysis)
        for label, (weight, changes) in case.risk.alternatives.items()
    }
    motions = case.ground_suite() if case.suite is not None else [case.ground_motion()]
    found = collapse_risk(
        *(case.analysis, motions, case.risk.hazard),
        alternatives=alternatives or None,
        workers=options.workers,
        out=_files.path_inside(folder, "risk_samples.nc"),
        target=case.target,
        **case.risk.options,
    )
    text = "\n".join([str(found), *defaults.note_loads_left_out(case)])
    files: Files = {"risk.txt": text, "risk.nc": found.save, "risk.png": found.plot()}
    files |= answers.state_risk(found).as_file("risk")
    write_results("risk", case, options.out, text, lambda: files)
    return doubt_code(found.doubts)


def report(options: argparse.Namespace) -> None:
    """Write the report of result folders, or of a history alone."""
    if options.pdf and str(options.out).lower().endswith(".docx"):
        raise InvalidInput(f"--pdf prints the page, and {options.out} is none: give FILE.html")
    sign({}, options.changes)  # a wrong key is found before histories are read
    if options.pdf:
        write_progress_line("report", "drawing figures")
    if (history := Path(options.folders[0])).is_file() and not options.folders[1:]:
        folders = {"set": options.changes, "study": options.studies, "inputs": options.inputs}
        if ignored := join_words([f"--{name}" for name, value in folders.items() if value]):
            raise InvalidInput(f"{history} takes no {ignored}: give the folder of its results")
        path = History.read(history).report(options.out or history.with_suffix(".html"))
    else:
        opened = [results.open_results(each, inputs=options.inputs) for each in options.folders]
        studies, by = tuple(map(Path, options.studies)), options.changes
        found, *others = (replace(x, case=x.case.signed(by), studies=studies) for x in opened)
        path = found.report(options.out, others)
    print(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")
    if options.pdf:
        from archfem.view.pages.document import print_page

        write_progress_line("report", "printing by the browser")
        print(f"wrote {print_page(path, path.with_suffix('.pdf'))}")


def page(options: argparse.Namespace) -> None:
    """Write the page that shakes the structure of a result folder."""
    path = results.open_results(options.folder, inputs=options.inputs).page(options.out)
    print(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")


def compile_steps(options: argparse.Namespace) -> None:
    """Compile the kernels of time steps, so that no run waits for it."""
    from archfem._numba import delete_damaged_files
    from archfem.dynamics.warm_up import compile_all

    delete_damaged_files()
    for kind, seconds in compile_all(options.jobs):
        print(f"{seconds:5.0f} s: {kind}", flush=True)


def print_results(case: Case, found: Iterable[Result], folder: Path) -> tuple[str, list[Doubt]]:
    """Print results, write their files, and return the verdict and all doubts."""
    # `carry_out` yields dead load, pushover, suite, runs and limit analysis in this order.
    runs, motions, shown = dict[str, History](), dict[str, Motion](), list[Doubt]()
    if (survey := read_survey(case.settings, case.folder)) is not None:
        print(survey)
    with result_text.record_doubts(case.structure) as doubts:
        supports = len(doubts)
        # results are printed at the end, and those before the first run may take minutes
        write_progress_line(case.title, f"dead load of {len(case.structure.free)} blocks")
        for result in found:
            if isinstance(result, Collapse):
                shown = show_both_senses(case, result, partial(_print_limit, case, folder), doubts)
            elif isinstance(result, DeadLoadResult):
                at_rest = result
                print(result_text.describe_dead_load(at_rest))
                write(results.dead_load_files(at_rest), folder)
                if case.has_motion:
                    write_progress_line(case.title, "modes and motions")
                    _print_first_modes(at_rest, folder)
            elif isinstance(result, Pushover):
                given = case.pushover
                loads = (given.live, given.dead) if given else ((), ())
                notes = result_text.note_masses(case.structure, *loads, case.parapets)
                print(result_text.describe_pushover(case.structure, result, notes))
                write(results.pushover_files(case, result, notes), folder)
            elif isinstance(result, Suite):
                suite = result
                print_motions(suite)
                write({"spectra.png": draw_suite(suite, case.target)}, folder)
            else:
                print(f"{result.motion.name}: {result.history.outcome}", file=sys.stderr)
                _print_run(result, at_rest)
                runs[result.motion.name] = result.history
                motions[result.motion.name] = result.motion
            del doubts[supports:]  # they are not of the next result
    if case.suite is not None:
        _print_pairs(suite, runs, at_rest, folder)
    verdict = result_text.describe_verdicts(runs.values(), case.structure) if runs else ""
    across, falls = check_across(case.structure, motions)
    if across:
        print(across)
    of_runs = (doubt for run in runs.values() for doubt in run.doubts)
    return verdict + falls, [*shown, *at_rest.doubts, *of_runs]


def _print_limit(case: Case, folder: Path, found: Collapse, text: str, *others: Any) -> None:
    """Print limit analysis, and write its files."""
    print(text)
    write(results.limit_files(case, found, text, *others), folder)


def _print_first_modes(at_rest: DeadLoadResult, folder: Path, max_modes: int = 4) -> None:
    """Print the first modes; a state without modes can be run nevertheless."""
    # With open joints the tangent stiffness may be singular.
    try:
        print_modes(at_rest, min(max_modes, at_rest.dead.model.size), folder)
    except ArchfemError as error:
        print(f"no modes about dead load: {error}\n{at_rest.damping[1]}")


def print_modes(at_rest: DeadLoadResult, count: int, folder: Path) -> Modes:
    """Print the first modes about dead load and the damping, and write table and shapes."""
    from archfem.statics.modes import modes as compute_modes

    computed = compute_modes(at_rest.dead.model, count, start=at_rest.dead)
    text = f"{computed.table()}\n\n{at_rest.damping[1]}"
    print(text)
    head = "frequency [Hz],period [s],mass x,mass y"
    columns = [computed.frequencies, computed.periods, computed.mass_ratios]
    rows = (",".join(f"{x:.6g}" for x in row) for row in np.column_stack(columns))
    files: Files = {"modes.csv": "\n".join([head, *rows]), "modes.png": computed.plot()}
    write({"modes.txt": text, **files}, folder)
    return computed


def _print_run(run: Run, at_rest: DeadLoadResult) -> None:
    """Print the result of a run and write its files, unless an earlier command has."""
    assert run.path is not None  # `archfem run` always has a folder
    motion, history = run.motion, run.history
    if run.reused:
        print(f"{motion.name}: finished before, kept {run.path}")
        if results.adopt_files(run):
            return
    elif run.error is not None:
        if run.case.suite is None:
            raise run.error
        # The other pairs of a suite are run nevertheless.
        print(f"archfem: {motion.name}: {run.error}", file=sys.stderr)
    else:
        took = f" in {run.seconds:.1f} s" if run.seconds else ""  # not known of workers
        print(
            f"time history: {motion.name}, PGA {motion.pga:.2f} m/s², "
            f"{float(history.time[-1]):.2f} s{took}; {history.outcome}"
        )
        print(f"wrote {run.path}")
    notes = [defaults.describe_defaults(run.case), *defaults.note_loads_left_out(run.case)]
    listed = "\n".join(filter(None, notes))
    given = run.case.structure, history, at_rest.dead.joints
    across, falls = check_across(run.case.structure, {motion.name: motion})
    # what all motions do across is printed once, after their runs
    said, text = (
        "\n\n".join(filter(None, [result_text.describe_run(*given, count, falls), line, listed]))
        for count, line in ((MAX_PRINTED_JOINTS, ""), (None, across))
    )
    print(said)
    write(results.run_files(run, at_rest, text), run.path.parent)
    if history.ending is Ending.INTERRUPTED and run.case.suite is None:
        raise KeyboardInterrupt


def _print_pairs(
    suite: Suite, runs: dict[str, History], at_rest: DeadLoadResult, folder: Path
) -> None:
    """Print the table of a suite; interrupted or failed runs end the command with an error."""
    text = result_text.describe_pairs(runs)
    print(f"{suite.name}, scale {suite.scale:g}, R = {suite.reduction:g}\n{text}")
    write(results.pair_files(runs, at_rest, text), folder)
    if any(run.ending is Ending.INTERRUPTED for run in runs.values()):
        print("run the same command again to compute the pairs that are left", file=sys.stderr)
        raise KeyboardInterrupt
    failed = [name for name, run in runs.items() if not run.ending.is_complete]
    if failed:
        raise FailedPairs(
            f"{len(failed)} of {len(runs)} pairs have no equilibrium at some step: "
            f"{', '.join(failed)}; what was computed is kept"
        )


def write(files: Files, folder: Path) -> None:
    """Write files to a folder, and print their names."""
    for path in write_files(files, folder):
        print(f"wrote {path}")
