"""The command line: `archfem run CASE.toml --out DIR`, `archfem motion FILE...`."""

import argparse
import logging
import os
import resource
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from io import TextIOWrapper

from archfem.errors import ArchfemError, InvalidInput

Command = Callable[[argparse.Namespace], int | None]

INTERRUPTED = 130
"""What a shell expects of a command that Ctrl-C has ended."""

LEAST_MEMORY = 3 * 2**29
"""Address space that a run of a small ring takes, libraries included [bytes]."""

TERMINATED = 143
"""What it expects of one that was asked to end by SIGTERM."""

DOUBTFUL = 3
"""What a command ends with whose answer is in doubt."""

CODES = f"""\
exit codes: 0, an answer; 1, an error in words, no answer; 2, the words of the command are not
understood; {DOUBTFUL}, an answer that is in doubt: summary.txt begins with why (energy that drifts,
displacements that are not small, a rung that is wrong or errs by more than was asked for); 130,
ended by Ctrl-C, and 143, by SIGTERM: what was computed is kept.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code.

    Args:
        arguments: words after `archfem`; by default those that the process was given.

    Returns:
        As by `exit_code`, or 143 where SIGTERM has ended the command; where the words are not
        understood, the process ends with 2.
    """
    given = _parser().parse_args(arguments)
    if isinstance(sys.stdout, TextIOWrapper):  # each line when it is known, also into a pipe
        sys.stdout.reconfigure(line_buffering=True)
    logging.basicConfig(format="%(levelname)s: %(message)s", level=logging.WARNING)
    with _asked_to_end() as asked:
        code = exit_code(lambda: _carried_out(given))
    return TERMINATED if asked and code == INTERRUPTED else code


def _carried_out(given: argparse.Namespace) -> int | None:
    """Carry out a command, where there is room for it."""
    _check_memory()
    code: int | None = given.command(given)
    return code


@contextmanager
def _asked_to_end() -> Iterator[list[int]]:
    """Let SIGTERM end what goes on as Ctrl-C does; the signals that have come."""
    came: list[int] = []

    def end(number: int, _: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield came
    finally:
        signal.signal(signal.SIGTERM, before)


def _check_memory() -> None:
    """Refuse a limit on memory under which libraries crash or wait for ever as they are loaded.

    Raises:
        InvalidInput: the limit is below what they take.
    """
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < LEAST_MEMORY:
        raise InvalidInput(
            f"memory is limited to {limit / 2**30:.2f} GiB, and libraries alone take "
            f"{LEAST_MEMORY / 2**30:.2f} GiB: raise the limit (ulimit -v)"
        )


def exit_code(command: Callable[[], int | None]) -> int:
    """Run a command, print the error that ends it, if one does, and return its exit code.

    Args:
        command: what to do; may return an exit code of its own.

    Returns:
        0 for success, 1 for an error of the case or of a file, 3 for an answer that is in doubt,
        130 after Ctrl-C.
    """
    try:
        return command() or 0
    except ArchfemError as error:
        print(f"archfem: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("archfem: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever read the output has gone, as in `archfem … | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:  # a folder that cannot be made, a full disk
        print(f"archfem: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="archfem",
        description="Does a dry-stone arch or bridge survive an earthquake?",
        epilog=CODES,
    )
    release = import_module("archfem").__version__
    parser.add_argument("--version", action="version", version=f"archfem {release}")
    chosen = parser.add_subparsers(required=True, metavar="COMMAND")

    def case_command(name: str, about: str) -> argparse.ArgumentParser:
        command = chosen.add_parser(name, help=about, description=about, epilog=CODES)
        command.add_argument("case", metavar="CASE.toml", help="the case file")
        _changes(command)
        return command

    run = case_command("run", "dead load, time histories, tables and pictures")
    run.add_argument("--out", required=True, metavar="DIR", help="folder for the results")
    run.add_argument("--workers", type=int, default=1, help="processes for pairs of a suite (1)")
    run.set_defaults(command=_later("cases", "run"))
    check = case_command("check", "read a case, build its model and find its dead load")
    check.set_defaults(command=_later("cases", "check"))
    modes = case_command("modes", "frequencies, masses and shapes of vibrations about dead load")
    modes.add_argument("--out", required=True, metavar="DIR", help="folder for the results")
    modes.add_argument("--count", type=int, default=6, help="how many modes (6)")
    modes.set_defaults(command=_later("cases", "modes"))
    mesh = case_command("mesh", "write the mesh of a case as a gmsh file")
    mesh.add_argument("--out", required=True, metavar="FILE.msh", help="the mesh file")
    mesh.set_defaults(command=_later("cases", "mesh"))
    accuracy = case_command("accuracy", "speed against error over rungs, meshes, rules and steps")
    accuracy.add_argument("--out", required=True, metavar="DIR", help="folder for the results")
    accuracy.add_argument("--workers", type=int, default=1, help="processes for settings (1)")
    accuracy.set_defaults(command=_later("cases", "accuracy"))
    report = chosen.add_parser("report", help="one HTML page of a result folder, to print")
    report.description = "Write one self-contained HTML page of what a result folder holds."
    report.add_argument("folder", metavar="FOLDER", help="that `archfem run` has written")
    report.add_argument("--out", metavar="FILE.html", help="the page (FOLDER/report.html)")
    report.add_argument("--inputs", metavar="DIR", help="folder of the case's drawing (FOLDER)")
    report.set_defaults(command=_later("cases", "report"))
    about = "many cases: a table of what is found of each, on all cores or a cluster"
    _study_command(chosen.add_parser("study", help=about, description=about))
    ready = chosen.add_parser("compile", help="compile once what time steps need: about a minute")
    ready.add_argument("--jobs", type=int, help="processes that compile (one a core)")
    ready.set_defaults(command=_later("cases", "compile_steps"))
    shipped = chosen.add_parser("examples", help="the cases that archfem brings, a line each")
    shipped.set_defaults(command=_later("examples", "examples"))
    _example_command(chosen.add_parser("example", help="print one of them, or copy it"))
    health = chosen.add_parser("doctor", help="what is installed, what is missing, how to get it")
    health.set_defaults(command=_later("doctor", "doctor"))
    about = "film the history of a run"
    _film_command(chosen.add_parser("animate", help=about, description=about))
    _motion_command(chosen.add_parser("motion", help="measures and pictures of ground motions"))
    return parser


def _later(module: str, name: str) -> Command:
    """A command that is imported when it is given: most import all rooms."""

    def command(given: argparse.Namespace) -> int | None:
        code: int | None = getattr(import_module(f"archfem.commands.{module}"), name)(given)
        return code

    return command


def _changes(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="SECTION.KEY=VALUE",
        dest="changes",
        help="use this value instead of the file's; may be given again",
    )


def _study_command(command: argparse.ArgumentParser) -> None:
    command.add_argument("case", nargs="?", metavar="STUDY.toml", help="the study's file")
    _changes(command)
    command.add_argument("--out", metavar="DIR", help="folder for the results")
    command.add_argument("--workers", type=int, help="processes (one a core)")
    command.add_argument("--scheduler", metavar="tcp://HOST:PORT", help="of Dask, for a cluster")
    command.add_argument(
        "--own-code", action="store_true", help="let the study's find run a function of its own"
    )
    command.add_argument("--status", metavar="DIR", help="say how far the study in a folder is")
    command.set_defaults(command=_later("studies", "study"))


def _example_command(command: argparse.ArgumentParser) -> None:
    command.description = "Print a case, as in `archfem example ring > ring.toml`, or copy it."
    command.add_argument("name", metavar="NAME", help="as `archfem examples` lists them")
    command.add_argument("--out", metavar="DIR", help="copy it there, with all that it refers to")
    command.set_defaults(command=_later("examples", "example"))


def _film_command(command: argparse.ArgumentParser) -> None:
    command.add_argument("history", metavar="HISTORY.nc", help="the history, which has fields")
    command.add_argument("--case", metavar="CASE.toml", help="its case (the one beside it)")
    command.add_argument("--out", metavar="FILM.mp4", help="the film, or a .gif (beside it)")
    command.add_argument(
        "--window", metavar="auto|FROM,TO", help="slow motion around the mechanism, or a time [s]"
    )
    command.add_argument("--colour", help="displacement or stress (displacement)")
    command.add_argument("--magnification", type=float, help="of displacements (chosen)")
    command.add_argument("--fps", type=float, help="frames a second, at most (20)")
    command.add_argument("--seconds", type=float, help="how long the film lasts (as the run)")
    command.add_argument("--size", metavar="WIDTHxHEIGHT", help="in pixels (1280x720)")
    command.set_defaults(command=_later("films", "animate"))


def _motion_command(command: argparse.ArgumentParser) -> None:
    command.description = "Print the measures of records, draw them, their integrals and spectra."
    command.add_argument("files", nargs="+", metavar="FILE", help="a record")
    command.add_argument("--column", type=int, help="component or plain column, counted from 1")
    command.add_argument("--units", help="of plain columns: g, m/s2, cm/s2 or gal")
    command.add_argument("--dt", type=float, help="time between samples of plain columns [s]")
    command.add_argument(
        "--out", default="out/motions", metavar="DIR", help="folder for the pictures"
    )
    command.set_defaults(command=_later("cases", "motion"))
