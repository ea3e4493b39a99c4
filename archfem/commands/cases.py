"""The commands of the command line: each takes what was given and prints what it finds."""

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from archfem.cases.case import Case
from archfem.cases.run import Rest, Result, Run, carried_out
from archfem.commands.line import DOUBTFUL
from archfem.dynamics.history import Ending, History
from archfem.errors import DidNotConverge, InvalidInput
from archfem.files import result_folder
from archfem.joints.criteria import judged
from archfem.limit.collapse import Collapse
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.strength import use_sentence


def check(given: argparse.Namespace) -> int:
    """Read a case, do its limit analysis, find its dead load, read its motions.

    Args:
        given: `case`, a file, and `changes` to it.

    Returns:
        `DOUBTFUL` where it cannot be meant to rest as it does, else 0.
    """
    from archfem.cases.summary import collapse_words

    case = Case.read(given.case, given.changes)
    print(case.title)
    if case.limit is not None:
        print(collapse_words(case.structure, case.limit.of(case.structure)))
    case.check_ground()
    rest = Rest.of(case)
    _tell_rest(rest)
    if case.suite is not None:
        _tell_motions(case.ground_suite())
    elif case.motion is not None:
        motion = case.ground_motion()
        print(f"motion: {motion.name}, {motion.duration:.2f} s, peak {motion.pga:.3f} m/s²")
    ready = f"in doubt, {len(rest.doubts)} times, as above" if rest.doubts else "ready"
    print(f"{given.case}: {ready}; dead load in {rest.dead.iterations} iterations")
    return DOUBTFUL if rest.doubts else 0


def motion(given: argparse.Namespace) -> None:
    """Print the measures of records and draw them.

    Args:
        given: `files`, the `column`, `units` and `dt` [s] of plain ones, and the folder `out`.

    Raises:
        InvalidInput: some files are no records; the others are told of before.
    """
    from archfem.cases.report import named_apart, write_motions
    from archfem.cases.summary import motion_table

    folder, options = result_folder(given.out), (given.column, given.units, given.dt)
    read, refused = _records(given.files, *options)
    motions = named_apart(list(read.values()), [Path(path).name for path in read])
    print(motion_table(motions))
    _tell_written(write_motions(motions, folder))
    if refused:
        raise InvalidInput(
            f"{len(refused)} of {len(given.files)} files were refused, as said above"
        )


def accuracy(given: argparse.Namespace) -> None:
    """Run a case over rungs, meshes, rules and steps, or go on with it: table and picture.

    Args:
        given: `case`, a file, `changes` to it, the folder `out`, and `workers`.
    """
    from archfem.cases.report import write_accuracy
    from archfem.cases.summary import accuracy_words
    from archfem.studies.tradeoff import case_accuracy

    case, folder = Case.read(given.case, given.changes), result_folder(given.out)
    found = case_accuracy(case, folder / "settings", workers=given.workers)
    text = accuracy_words(found)
    print(text)
    _tell_written(write_accuracy(found, text, folder))


def compile_steps(given: argparse.Namespace) -> None:
    """Compile what time steps need, so that no run has to wait for it.

    Args:
        given: `jobs`, how many processes compile; None for one a core.
    """
    from archfem.dynamics.compiling import compile_all

    for kind, seconds in compile_all(given.jobs):
        print(f"{seconds:5.0f} s: {kind}", flush=True)


def mesh(given: argparse.Namespace) -> None:
    """Write the mesh of a case as a gmsh file.

    Args:
        given: `case`, a file, `changes` to it, and the mesh file `out`.
    """
    from archfem.models.fem.mesh import write_mesh

    case = Case.read(given.case, given.changes)
    write_mesh(case.structure, given.out, case.discretisation)
    print(f"wrote {given.out}")


def modes(given: argparse.Namespace) -> None:
    """Find the modes of a case about its dead load: table, picture, film of the first two.

    Args:
        given: `case`, a file, `changes` to it, the `count` of modes, and the folder `out`.
    """
    from archfem.cases.report import write_modes
    from archfem.statics.modes import modes as lowest

    case, folder = Case.read(given.case, given.changes), result_folder(given.out)
    print(case.title)
    rest = Rest.of(case)
    _tell_rest(rest)
    found = lowest(rest.dead.model, given.count, about=rest.dead)
    text = f"{found.table()}\n\n{rest.damping[1]}"
    print(text)
    _tell_written(write_modes(found, text, folder))


def report(given: argparse.Namespace) -> None:
    """Write one page of what a result folder holds.

    Args:
        given: `folder`, the page `out`, and `inputs`, the folder of the case's drawing, or None.
    """
    from archfem.cases.folders import opened

    path = opened(given.folder, inputs=given.inputs).report(given.out)
    print(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")


def run(given: argparse.Namespace) -> int:
    """Carry out a case: limit analysis, dead load and time histories, tables and pictures.

    Args:
        given: `case`, a file, `changes` to it, the folder `out`, and `workers` for pairs.

    Returns:
        `DOUBTFUL` where a run has doubts, else 0.
    """
    case, folder = Case.read(given.case, given.changes), result_folder(given.out)
    (folder / "case.toml").write_text(case.text(), encoding="utf-8")
    print(case.title)
    if given.workers > 1 and case.suite is not None:
        from archfem.studies.pairs import run_pairs

        run_pairs(case, folder, workers=given.workers)
    return DOUBTFUL if tell(case, carried_out(case, folder), folder) else 0


def tell(case: Case, results: Iterable[Result], folder: Path) -> bool:
    """Print the results of a case as they come, and write their tables and pictures.

    Args:
        case: what was asked.
        results: as by `carried_out`.
        folder: for the files.

    Returns:
        Whether any run has doubts; its summary begins with them.

    Raises:
        DidNotConverge: a step of a run failed.
        KeyboardInterrupt: Ctrl-C ended a pair of a suite.
    """
    from archfem.cases.report import write_dead, write_limit, write_suite
    from archfem.cases.summary import collapse_words

    runs: dict[str, History] = {}
    for result in results:
        if isinstance(result, Collapse):
            text = collapse_words(case.structure, result)
            print(text)
            _tell_written(write_limit(case, result, text, folder))
        elif isinstance(result, Rest):
            rest = result
            _tell_rest(rest)
            _tell_written(write_dead(rest, folder))
            print(rest.damping[1])
        elif isinstance(result, Suite):
            suite = result
            _tell_motions(suite)
            _tell_written(write_suite(suite, case.target, folder))
        else:
            _tell_run(result, rest)
            runs[result.motion.name] = result.history
    if case.suite is not None:
        _tell_pairs(suite, runs, rest, folder)
    return bool(rest.doubts) or any(run.doubts for run in runs.values())


def _tell_run(done: Run, rest: Rest) -> None:
    """Print what a run did and write its files, unless an earlier command has.

    Raises:
        DidNotConverge: a step of the only run failed; one of a suite ends its own pair alone.
        KeyboardInterrupt: Ctrl-C ended the only run.
    """
    from archfem.cases.report import is_written, write_run
    from archfem.cases.summary import run_words

    assert done.path is not None
    motion, history = done.motion, done.history
    if done.kept:
        print(f"{motion.name}: finished before, kept {done.path}")
        if is_written(done):
            return
    elif done.error is not None:
        print(f"what was computed is kept in {done.path}", file=sys.stderr)
        if done.case.suite is None:
            raise done.error
        print(f"archfem: {motion.name}: {done.error}", file=sys.stderr)
    else:
        print(
            f"time history: {motion.name}, peak {motion.pga:.2f} m/s², "
            f"{float(history.time[-1]):.2f} s in {done.seconds:.1f} s; {history.outcome}"
        )
        _tell_written([done.path])
    text = run_words(done.case.structure, history, rest.dead.joints)
    print(text)
    _tell_written(write_run(done, rest, text, done.path.parent))
    if history.ended is Ending.INTERRUPTED and done.case.suite is None:
        raise KeyboardInterrupt


def _tell_pairs(suite: Suite, runs: dict[str, History], rest: Rest, folder: Path) -> None:
    """Print one line for each pair that was run, and say where not all of them were.

    Raises:
        DidNotConverge: a step of some pairs failed.
        KeyboardInterrupt: Ctrl-C ended the last.
    """
    from archfem.cases.report import write_pairs
    from archfem.cases.summary import pair_table

    text = pair_table(runs)
    if doubtful := [name for name, run in runs.items() if run.doubts]:
        text += f"\n\nin doubt, as their summaries say: {', '.join(doubtful)}"
    print(f"{suite.name}, scale {suite.scale:g}, R = {suite.reduction:g}\n{text}")
    _tell_written(write_pairs(runs, rest, text, folder))
    if any(run.ended is Ending.INTERRUPTED for run in runs.values()):
        print("run the same command again to go on with the pairs that are left", file=sys.stderr)
        raise KeyboardInterrupt
    broken = [name for name, run in runs.items() if not run.ended.by_itself]
    if broken:
        raise DidNotConverge(
            f"{len(broken)} of {len(runs)} pairs have no equilibrium at some step: "
            f"{', '.join(broken)}; what was computed is kept"
        )


def _tell_rest(rest: Rest) -> None:
    """Print the size of the model and how its joints and blocks are used under dead load."""
    model, joints = rest.dead.model, judged(rest.dead.joints)
    structure = rest.case.structure
    print(
        f"model: {model.fidelity}, {len(structure.free)} blocks, "
        f"{len(structure.joints)} joints, {model.size} coordinates "
        f"({rest.seconds:.2f} s with the dead load)"
    )
    if model.prediction is not None:
        print(f"model: {model.prediction.text}")
    print(
        f"dead load: |e| ≤ {float(abs(joints['eccentricity']).max()):.3f}, "
        f"V/N ≤ {float(joints['friction'].max()):.3f}, "
        f"N ≥ {float(joints['N'].min()) / 1e3:.2f} kN"
    )
    if rest.use is not None:
        print(f"dead load: {use_sentence(rest.use)}")
    for words in rest.doubts:
        print(f"in doubt: {words}")


def _tell_motions(suite: Suite) -> None:
    """Print what matching did, or how strong the motions are."""
    from archfem.cases.summary import match_table, motion_table

    print(match_table(suite.matches) if suite.matches else motion_table(suite.motions))


def _records(
    files: Sequence[str], column: int | None, units: str | None, dt: float | None
) -> tuple[dict[str, Motion], list[InvalidInput]]:
    """Read records: the motions by file, and why others were refused, which is told."""
    read, refused = {}, []
    for path in files:
        try:
            read[path] = Motion.read(path, column=column, units=units, dt=dt)
        except InvalidInput as error:
            refused.append(error)
            if len(files) > 1:
                print(f"archfem: {error}", file=sys.stderr)
    if not read:
        raise refused[0]
    return read, refused


def _tell_written(files: Iterable[Path]) -> None:
    for path in files:
        print(f"wrote {path}")
