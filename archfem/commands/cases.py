"""The commands for cases: each takes what was given and prints what it finds."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from archfem.cases.case import Case
from archfem.cases.run import Rest, carried_out
from archfem.commands.line import DOUBTFUL
from archfem.commands.telling import tell, tell_modes, tell_motions, tell_rest, tell_written
from archfem.errors import InvalidInput
from archfem.files import result_folder
from archfem.motion.motion import Motion


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
    tell_rest(rest)
    if case.suite is not None:
        tell_motions(case.ground_suite())
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
    tell_written(write_motions(motions, folder))
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
    tell_written(write_accuracy(found, text, folder))


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
    from archfem.view.films.modes import film_modes

    case, folder = Case.read(given.case, given.changes), result_folder(given.out)
    print(case.title)
    rest = Rest.of(case)
    tell_rest(rest)
    found = tell_modes(rest, given.count, folder)
    first = range(1, min(len(found.frequencies), 2) + 1)
    tell_written([film_modes(found, folder / "modes.gif", first)])


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
