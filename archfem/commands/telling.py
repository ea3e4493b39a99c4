"""What is said of a case as its results come, and the tables and pictures that are written."""

import sys
from collections.abc import Iterable
from pathlib import Path

from archfem.cases.case import Case
from archfem.cases.run import Rest, Result, Run
from archfem.dynamics.history import Ending, History
from archfem.errors import ArchfemError, DidNotConverge
from archfem.joints.criteria import judged
from archfem.limit.collapse import Collapse
from archfem.motion.suite import Suite
from archfem.statics.modes import Modes
from archfem.statics.strength import use_sentence

MODES = 4
"""How many modes a run shows."""


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
            tell_written(write_limit(case, result, text, folder))
        elif isinstance(result, Rest):
            rest = result
            tell_rest(rest)
            tell_written(write_dead(rest, folder))
            if case.moves:
                _tell_first_modes(rest, folder)
        elif isinstance(result, Suite):
            suite = result
            tell_motions(suite)
            tell_written(write_suite(suite, case.target, folder))
        else:
            _tell_run(result, rest)
            runs[result.motion.name] = result.history
    if case.suite is not None:
        _tell_pairs(suite, runs, rest, folder)
    return bool(rest.doubts) or any(run.doubts for run in runs.values())


def _tell_first_modes(rest: Rest, folder: Path) -> None:
    """Tell of the modes, as of what a run begins with; a rest that has none may be shaken still."""
    try:
        tell_modes(rest, min(MODES, rest.dead.model.size), folder)
    except ArchfemError as error:
        print(f"no modes about dead load: {error}\n{rest.damping[1]}")


def tell_modes(rest: Rest, count: int, folder: Path) -> Modes:
    """Print the first modes about dead load and the damping, and write table and shapes.

    Args:
        rest: a case under its dead load.
        count: how many.
        folder: for the files.

    Returns:
        The modes.

    Raises:
        DidNotConverge: they were not found.
        InvalidInput: there are not so many.
    """
    from archfem.cases.report import write_modes
    from archfem.statics.modes import modes as lowest

    found = lowest(rest.dead.model, count, about=rest.dead)
    text = f"{found.table()}\n\n{rest.damping[1]}"
    print(text)
    tell_written(write_modes(found, text, folder))
    return found


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
        tell_written([done.path])
    text = run_words(done.case.structure, history, rest.dead.joints)
    print(text)
    tell_written(write_run(done, rest, text, done.path.parent))
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
    tell_written(write_pairs(runs, rest, text, folder))
    if any(run.ended is Ending.INTERRUPTED for run in runs.values()):
        print("run the same command again to go on with the pairs that are left", file=sys.stderr)
        raise KeyboardInterrupt
    broken = [name for name, run in runs.items() if not run.ended.by_itself]
    if broken:
        raise DidNotConverge(
            f"{len(broken)} of {len(runs)} pairs have no equilibrium at some step: "
            f"{', '.join(broken)}; what was computed is kept"
        )


def tell_rest(rest: Rest) -> None:
    """Print the size of the model and how its joints and blocks are used under dead load.

    Args:
        rest: a case under its dead load.
    """
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


def tell_motions(suite: Suite) -> None:
    """Print what matching did, or how strong the motions are.

    Args:
        suite: of motions.
    """
    from archfem.cases.summary import match_table, motion_table

    print(match_table(suite.matches) if suite.matches else motion_table(suite.motions))


def tell_written(files: Iterable[Path]) -> None:
    """Print the names of files that were written.

    Args:
        files: one a line.
    """
    for path in files:
        print(f"wrote {path}")
