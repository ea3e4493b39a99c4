"""Commands on the margin under each motion of a case: range of the verdict, scale of a fall."""

import argparse
import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from functools import wraps
from pathlib import Path, PurePath
from typing import Any

from archfem._display import DOUBT_MARK, write_progress_line
from archfem._files import create_result_folder, intact_file_list, path_inside, read_listed
from archfem.cases import answers
from archfem.cases.case import Case
from archfem.cases.defaults import note_loads_left_out
from archfem.cases.result_text import mark_remarks, record_doubts
from archfem.cases.run import HISTORY_FILE, load_finished_run
from archfem.commands.cli import ExitCode
from archfem.commands.run import Command, keep_attempt, name_group, write_results
from archfem.commands.tools import doubt_code
from archfem.dynamics import collapse_state, motion_scaling
from archfem.dynamics.collapse_state import FALLEN_STATES, CollapseState
from archfem.dynamics.history import Ending, History
from archfem.dynamics.motion_scaling import OWN_STEP, CollapseScale
from archfem.dynamics.scale_search import KeptRuns, MechanismScales, ScaledRun
from archfem.dynamics.walls_across import check_across
from archfem.errors import InvalidInput
from archfem.limit.mechanism_count import Mechanism
from archfem.masonry.structure import join_words
from archfem.models.model import Doubt
from archfem.motion.motion import Motion
from archfem.statics.fill_checks import doubt_pieces
from archfem.units import format_mm
from archfem.view.style import Files

# Modules of studies are slow to import, and imported where they are needed.

# File with the runs of an interrupted search, from which the same command continues
KEPT_RUNS = "scale_runs.json"


def _for_each_pair(command: Command) -> Command:
    """Let a command of one motion follow each pair of a suite, unless one is named."""

    @wraps(command)
    def follow(options: argparse.Namespace) -> int:
        suite = Case.read(options.case, options.changes).suite
        if suite is None or options.pair is not None:
            return command(options)
        codes = []
        for number, pair in enumerate(suite["pairs"]):
            words = f"pair {number + 1} of {len(suite['pairs'])}, '{pair}'"
            write_progress_line(command.__name__, words)
            codes.append(command(argparse.Namespace(**{**vars(options), "pair": pair})))
        return max(codes)

    return follow


@_for_each_pair
@keep_attempt("verdict_range")
def verdict(case: Case, options: argparse.Namespace) -> int:
    """Run a case over joint rules, stiffness, friction and damping: how often does it fall?"""
    from archfem.studies.variations import verdict_range

    motion = _choose_motion(case, options)
    print(case.title)
    # of its own, in which other pairs may be varied at the same time
    place = PurePath("variations", options.pair or "")
    folder = None if options.out is None else path_inside(Path(options.out), place)
    sampling = {"workers": options.workers, "samples": options.samples, "folder": folder}
    computed = verdict_range(case.analysis, motion, fidelity="rigid", **case.verdict, **sampling)
    _, falls = check_across(case.structure, {motion.name: motion})
    head, line, text = str(computed).partition("\n")
    text = f"{head}{falls}{_say_steps(case, motion, options)}{line}{text}"
    text = "\n".join([text, *note_loads_left_out(case)])
    own: Files = {"verdict_range.nc": computed.save, "verdict_range.txt": text}

    def draw() -> Files:
        return own | {"verdict_range.png": computed.plot()}

    write_results("verdict", case, options.out, text, draw, options.pair)
    return doubt_code(computed.doubts)


def _say_steps(case: Case, motion: Motion, options: argparse.Namespace) -> str:
    """Say that variations take other steps than a run, and how far that in the folder moves."""
    if case.analysis.dt is not None:
        return ""
    text = f"\nvariations take steps of {1e3 * OWN_STEP:g} ms, and a run varies its own"
    if (run := _find_run(case, motion, options)) is None:
        return text
    most, left = (format_mm(run.dataset.attrs[key]) for key in ("displacement", "residual"))
    return f"{text}: in this folder it is displaced by up to {most}, {left} at the end"


def _find_run(case: Case, motion: Motion, options: argparse.Namespace) -> History | None:
    """Return the finished run of the folder under a motion of the same case, or None."""
    if options.out is None:
        return None
    alone = case if options.pair is None else case.alone(options.pair)
    return load_finished_run(Path(options.out, options.pair or "", HISTORY_FILE), alone, motion)


def _choose_motion(case: Case, options: argparse.Namespace) -> Motion:
    """Return the motion of a case, or the pair of its suite that is named; make the folder."""
    from archfem.studies.cache import ground_motion

    if options.out is not None:  # a folder that cannot be written is refused before the runs
        create_result_folder(options.out)
    return ground_motion(case if options.pair is None else case.alone(options.pair))


@_for_each_pair
@keep_attempt("scale")
def scale(case: Case, options: argparse.Namespace) -> int:
    """Scale the motion of a case until it falls, or forms a mechanism in small displacements."""
    kept, begun = (_read_kept(case, options, name) for name in ("scale.txt", KEPT_RUNS))
    if kept and options.pair and begun is None and not kept.startswith("no answer"):
        print(f"{case.title}\n{kept}")
        return ExitCode.DOUBTFUL if f"\n{DOUBT_MARK}" in kept else 0
    motion = _choose_motion(case, options)
    found: CollapseScale | MechanismScales
    is_large = case.analysis.displacements == "large"
    search = motion_scaling.collapse_scale if is_large else motion_scaling.mechanism_scales
    made = _unpack_runs(begun or "[]")
    if made:
        write_progress_line("scale", f"{len(made)} runs of the interrupted search are kept")
    with record_doubts(case.structure) as doubts:
        found = search(case.analysis, motion, made=made)
        if found.interrupted and not found.kept_runs:  # no run says anything
            raise KeyboardInterrupt
        doubts += doubt_pieces(case.structure)
        doubts += _compare_with_run(found, _find_run(case, motion, options))
    notes = note_loads_left_out(case)
    files: Files = {**answers.state_scale(found, motion, [*doubts, *notes])}
    doubts += found.doubts
    lines = [f"{motion.name}: {found}", *mark_remarks(doubts), *notes, "", found.table()]
    if isinstance(found, CollapseScale):
        from archfem.view.verdicts import draw_scale

        lines[1:1] = filter(None, [found.mechanism])
        limit = collapse_state.DISLOCATION * collapse_state.shallowest_part(case.structure)[0]
        if any(run.fall for run in found.kept_runs.values()):
            files["scale.png"] = draw_scale(found, limit)
    files["scale.txt"] = text = "\n".join(lines)
    if found.interrupted:
        runs = [(dt, asdict(run)) for (dt, _), run in found.kept_runs.items()]
        files[KEPT_RUNS] = json.dumps(runs)
    write_results("scale", case, options.out, f"{case.title}\n{text}", lambda: files, options.pair)
    if found.interrupted:
        raise KeyboardInterrupt
    return doubt_code(doubts)


def _compare_with_run(
    found: CollapseScale | MechanismScales, run: History | None
) -> Iterator[Doubt]:
    """Yield a doubt where it falls at 1 × the motion by steps of a search or in a run alone."""
    if run is None or run.fall is None:
        return
    falls, made = run.fall.kind in FALLEN_STATES, found.kept_runs.items()
    answers_at_one = {dt: x.fall.kind for (dt, at), x in made if dt and at == 1.0 and x.fall}
    others = [dt for dt, kind in answers_at_one.items() if (kind in FALLEN_STATES) != falls]
    if others:
        steps = f"by steps of {join_words([f'{1e3 * dt:g}' for dt in others])} ms"
        which = ["in the run of this folder", steps][:: 1 if falls else -1]
        words = "at 1.00 × it falls {}, but not {}".format(*which)
        yield Doubt(words, f"give both the same, `--set analysis.dt={min(others):g}`")


def _read_kept(case: Case, options: argparse.Namespace, name: str) -> str | None:
    """Return a file of an earlier search under the same motion of the same case, or None."""
    if options.out is None:
        return None
    group = intact_file_list(Path(options.out)).get(name_group("scale", options.pair))
    place = (Path(options.pair or "") / name).as_posix()
    if group is not None and group.inputs == case.hash_inputs() and place in group.files:
        with suppress(InvalidInput):  # deleted, or changed
            return read_listed(Path(options.out), place).decode("utf-8").strip()
    return None


def _unpack_runs(text: str) -> KeptRuns:
    """Return the runs of an interrupted search from their file, which this very program wrote."""
    made = {}
    for dt, run in json.loads(text):
        met = run["mechanisms"].items()
        run["mechanisms"] = {name: _unpack_mechanism(x) for name, x in met}
        run["fall"] = run["fall"] and CollapseState(**_with_tuples(run["fall"]))
        run["ending"] = Ending(run["ending"])
        run["doubts"] = [Doubt(**_with_tuples(doubt)) for doubt in run["doubts"]]
        made[dt, run["scale"]] = ScaledRun(**_with_tuples(run))
    return made


def _unpack_mechanism(values: dict[str, Any] | None) -> Mechanism | None:
    """Return a mechanism that was written as JSON, or None."""
    if values is None:
        return None
    larger = _unpack_mechanism(values["larger"])
    return Mechanism(**_with_tuples({**values, "larger": larger}))


def _with_tuples(values: dict[str, Any]) -> dict[str, Any]:
    """Return values that were written as JSON, with tuples in place of its lists."""
    return {key: tuple(x) if isinstance(x, list) else x for key, x in values.items()}
