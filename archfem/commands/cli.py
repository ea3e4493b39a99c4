"""Argument parser and exit codes of the command line, such as `archfem run CASE.toml --out DIR`."""

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
from typing import Any

from archfem._files import describe_os_error
from archfem.errors import ArchfemError, InvalidInput

Command = Callable[[argparse.Namespace], int | None]

# Exit codes: a shell expects 128 + the number of a signal that ended a command.
EXIT_DOUBTFUL = 3
EXIT_INTERRUPTED = 130
EXIT_TERMINATED = 143

EXIT_CODES = (
    "exit codes: 0, an answer; 1, an error in words, no answer; 2, the arguments are not "
    f"understood; {EXIT_DOUBTFUL}, an answer that is in doubt: summary.txt begins with why "
    "(energy that drifts, displacements that are not small, a fidelity that is wrong or errs "
    f"by more than is permitted); {EXIT_INTERRUPTED}, ended by Ctrl-C, and {EXIT_TERMINATED}, "
    "by SIGTERM: what was computed is kept."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code.

    Args:
        arguments: arguments after `archfem`; by default those of the process.

    Returns:
        The exit code of `exit_code`, or 143 if SIGTERM ended the command; the process exits with 2
        if the arguments are not understood.
    """
    options = _build_parser().parse_args(arguments)
    if isinstance(sys.stdout, TextIOWrapper):
        # Lines are printed without delay, also into a pipe. Characters that the terminal does not
        # know are printed as their codes.
        sys.stdout.reconfigure(line_buffering=True, errors="backslashreplace")
    # Warnings of the library are logged, and printed to stderr.
    logging.basicConfig(format="%(levelname)s: %(message)s", level=logging.WARNING)
    with _interrupt_on_sigterm() as signals:
        code = exit_code(lambda: _run_command(options))
    return EXIT_TERMINATED if signals and code == EXIT_INTERRUPTED else code


def _run_command(options: argparse.Namespace) -> int | None:
    """Run a command, if the memory suffices."""
    _check_memory()
    if getattr(options, "own_code", False):
        import_module("archfem.cases.provenance").permit_extensions()
    return options.command(options)


@contextmanager
def _interrupt_on_sigterm() -> Iterator[list[int]]:
    """Raise KeyboardInterrupt on SIGTERM, as Ctrl-C does; yield the received signals."""
    received: list[int] = []

    def interrupt(number: int, _: object) -> None:
        received.append(number)  # so that the exit code differs from that of Ctrl-C
        raise KeyboardInterrupt

    previous = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield received
    finally:
        signal.signal(signal.SIGTERM, previous)


def _check_memory(min_bytes: int = 3 * 2**29) -> None:
    """Refuse a memory limit at which libraries crash or block while they are imported."""
    # 1.5 GiB is the address space of a run of a small ring, libraries included.
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < min_bytes:
        raise InvalidInput(
            f"memory is limited to {limit / 2**30:.2f} GiB, and libraries alone take "
            f"{min_bytes / 2**30:.2f} GiB: raise the limit (ulimit -v)"
        )


def exit_code(command: Callable[[], int | None]) -> int:
    """Run a command, print its error if there is one, and return its exit code."""
    try:
        return command() or 0
    except ArchfemError as error:
        print(f"archfem: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("archfem: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # the reader of the output has ended, as in `archfem … | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:  # a folder that cannot be made, a full disk
        place = error.filename and f"{error.filename} cannot be read or written: "
        print(f"archfem: {place or ''}{describe_os_error(error)}", file=sys.stderr)
        return 1
    return 0


def _build_parser() -> argparse.ArgumentParser:
    """Build the parser of all commands."""
    description = "Does a dry-stone arch or bridge survive an earthquake?"
    parser = argparse.ArgumentParser(prog="archfem", description=description, epilog=EXIT_CODES)
    release = import_module("archfem").__version__
    parser.add_argument("--version", action="version", version=f"archfem {release}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_case_commands(commands)
    _add_report(commands.add_parser("report", help="one HTML page of a result folder, to print"))
    about = "many cases: a table of results, on all cores or a cluster"
    _add_study(commands.add_parser("study", help=about, description=about))
    ready = commands.add_parser("compile", help="compile the time steps once: about a minute")
    ready.add_argument("--jobs", type=int, help="processes that compile (one a core)")
    ready.set_defaults(command=_load_command("run", "compile_steps"))
    examples = commands.add_parser("examples", help="the cases that archfem brings, a line each")
    examples.set_defaults(command=_load_command("tools", "examples"))
    _add_example(commands.add_parser("example", help="print one of them, or copy it"))
    doctor = commands.add_parser("doctor", help="what is installed, what is missing, how to get it")
    doctor.set_defaults(command=_load_command("tools", "doctor"))
    about = "film the history of a run"
    _add_film(commands.add_parser("animate", help=about, description=about))
    _add_motion(commands.add_parser("motion", help="measures and pictures of ground motions"))
    about = "select recorded motions by the rule of a code"
    _add_select(commands.add_parser("select", help=about, description=about))
    return parser


def _add_case_commands(commands: Any) -> None:
    """Add the commands that take a case file."""

    def add(name: str, about: str, out: str | None = "DIR") -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=about, description=about, epilog=EXIT_CODES)
        command.set_defaults(command=_load_command("run", name))
        command.add_argument("case", metavar="CASE.toml", help="the case file")
        _add_changes(command)
        if out is not None:
            target = "folder for the results" if out == "DIR" else "the mesh file"
            command.add_argument("--out", required=True, metavar=out, help=target)
        return command

    run = add("run", "dead load, time histories, tables and pictures")
    run.add_argument("--workers", type=int, default=1, help="processes for pairs of a suite (1)")
    add("check", "read a case, build its model and find its dead load", None)
    modes = add("modes", "frequencies, masses and shapes of vibrations about dead load")
    modes.add_argument("--count", type=int, default=6, help="how many modes (6)")
    limit = add("limit", "collapse factor and mechanism by limit analysis of the case alone", None)
    limit.add_argument("--out", metavar="DIR", help="folder for text, table and picture (none)")
    about = "kinematic assessment of the collapse mechanism against a design spectrum"
    assess = add("assess", about, None)
    assess.add_argument("--out", metavar="DIR", help="folder for text and pictures (none)")
    assess.add_argument("--parts", action="store_true", help="each part by itself")
    rate = add("rate", "rating of a bridge for a vehicle by limit analysis", None)
    rate.add_argument("--vehicle", metavar="NAME", help="such as LM1 or LM71 (that of [rating])")
    rate.add_argument("--live", type=float, help="partial factor on the vehicle (of its code)")
    rate.add_argument("--impact", type=float, help="dynamic factor on the vehicle (of its code)")
    rate.add_argument("--dead", type=float, help="partial factor on the weights (1)")
    rate.add_argument("--width", type=float, help="width that carries one vehicle [m] (all)")
    rate.add_argument("--out", metavar="DIR", help="folder for text, table and picture (none)")
    add("mesh", "write the mesh of a case as a gmsh file", "FILE.msh")
    verdict = add("verdict", "does it fall, whatever its uncertain properties are?", None)
    verdict.add_argument("--out", metavar="DIR", help="folder for table and picture (none)")
    verdict.add_argument("--workers", type=int, default=1, help="processes for the runs (1)")
    verdict.add_argument("--samples", type=int, default=26, help="runs of the sample (26)")
    about = "speed against error over fidelities, meshes, quadratures and steps"
    accuracy = add("accuracy", about)
    accuracy.add_argument("--workers", type=int, default=1, help="processes for settings (1)")


def _load_command(module: str, name: str) -> Command:
    """Return a command whose module is imported when it is called, since imports take time."""

    def command(options: argparse.Namespace) -> int | None:
        return getattr(import_module(f"archfem.commands.{module}"), name)(options)

    return command


def _add_changes(command: argparse.ArgumentParser) -> None:
    """Add the options that change values of a case, and permit its code."""
    _add_own_code(command)
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="SECTION.KEY=VALUE",
        dest="changes",
        help="use this value instead of the file's; may be given again",
    )


def _add_own_code(command: argparse.ArgumentParser) -> None:
    """Add the option that permits code of the user."""
    about = "run the Python modules that the file names: only if you trust them"
    command.add_argument("--own-code", action="store_true", help=about)


def _add_report(command: argparse.ArgumentParser) -> None:
    """Add the arguments of `archfem report`."""
    command.description = "Write one self-contained HTML page of what a result folder holds."
    command.add_argument("folder", metavar="FOLDER", help="that `archfem run` has written")
    command.add_argument("--out", metavar="FILE.html", help="the page (FOLDER/report.html)")
    command.add_argument("--inputs", metavar="DIR", help="folder of the case's drawing (FOLDER)")
    command.add_argument("--pdf", action="store_true", help="also print it, by Chromium or Chrome")
    _add_own_code(command)
    command.set_defaults(command=_load_command("run", "report"))


def _add_study(command: argparse.ArgumentParser) -> None:
    """Add the arguments of `archfem study`."""
    command.add_argument("case", nargs="?", metavar="STUDY.toml", help="the study's file")
    _add_changes(command)
    command.add_argument("--out", metavar="DIR", help="folder for the results")
    command.add_argument("--workers", type=int, help="processes (one a core)")
    command.add_argument("--scheduler", metavar="tcp://HOST:PORT", help="of Dask, for a cluster")
    command.add_argument("--status", metavar="DIR", help="say how far the study in a folder is")
    command.set_defaults(command=_load_command("study", "study"))


def _add_example(command: argparse.ArgumentParser) -> None:
    """Add the arguments of `archfem example`."""
    command.description = "Print a case, as in `archfem example ring > ring.toml`, or copy it."
    command.add_argument("name", metavar="NAME", help="as `archfem examples` lists them")
    command.add_argument("--out", metavar="DIR", help="copy it there, with all that it refers to")
    command.set_defaults(command=_load_command("tools", "example"))


def _add_film(command: argparse.ArgumentParser) -> None:
    """Add the arguments of `archfem animate`."""
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
    command.add_argument("--renderer", help="matplotlib, or pyvista, also for .html (matplotlib)")
    _add_own_code(command)
    command.set_defaults(command=_load_command("tools", "animate"))


def _add_motion(command: argparse.ArgumentParser) -> None:
    """Add the arguments of `archfem motion`."""
    command.description = "Print the measures of records, draw them, their integrals and spectra."
    command.add_argument("files", nargs="+", metavar="FILE", help="a record")
    command.add_argument("--column", type=int, help="component or plain column, counted from 1")
    command.add_argument("--units", help="of columns, miniSEED or SAC: g, m/s2, cm/s2 or gal")
    command.add_argument("--dt", type=float, help="time between samples of plain columns [s]")
    command.add_argument("--response", metavar="XML", help="StationXML of counts in miniSEED, SAC")
    command.add_argument(
        "--out", default="out/motions", metavar="DIR", help="folder for the pictures"
    )
    command.set_defaults(command=_load_command("run", "motion"))


def _add_select(command: argparse.ArgumentParser) -> None:
    """Add the arguments of `archfem select`."""
    add = command.add_argument
    add("folder", metavar="FOLDER", help="folder of the records")
    about = 'design spectrum, as target of a case: \'{ code = "EC8", ag = 0.3, ground = "B" }\''
    add("--spectrum", required=True, metavar="TABLE", help=about)
    add("--period", required=True, type=float, help="fundamental period of the structure [s]")
    add("--rule", default="EC8", help="EC8 or NTC-2018 (EC8)")
    add("--count", type=int, default=7, help="how many records (7)")
    add("--scales", type=float, nargs=2, default=(1 / 3, 3.0), help="allowed (0.333 3)")
    add("--measure", default="horizontal", help="horizontal, RotD50 or RotD100 (horizontal)")
    about = "earthquake of files; may be given again"
    add("--event", action="append", default=[], metavar="FILES=NAME", dest="events", help=about)
    add("--out", metavar="DIR", help="folder for text, table, picture and [suite] (none)")
    command.set_defaults(command=_load_command("run", "select"))
