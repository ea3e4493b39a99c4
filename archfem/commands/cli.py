"""Argument parser and exit codes of the command line, such as `archfem run CASE.toml --out DIR`."""

import argparse
import logging
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from enum import IntEnum
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from io import TextIOWrapper
from time import monotonic
from typing import Any

from archfem._files import describe_os_error
from archfem.errors import ArchfemError, InvalidInput

AddArgument = Callable[..., Any]  # as `ArgumentParser.add_argument`


class ExitCode(IntEnum):
    """Exit codes besides 0, 1 and 2."""

    DOUBTFUL = 3
    INTERRUPTED = 130  # a shell expects 128 + the number of a signal that ended a command


EXIT_CODES = (
    "exit codes: 0, an answer; 1, an error in words, no answer; 2, the arguments are not "
    f"understood; {ExitCode.DOUBTFUL}, an answer in doubt: each line 'in doubt: …' "
    "says why (energy that drifts, a fidelity that is wrong, fill that only tension holds, sliding "
    f"that dilates); {ExitCode.INTERRUPTED}, ended by Ctrl-C, and 143, "
    "by SIGTERM: what was computed is kept in the folder of --out, of `rate` whole vehicles and "
    "variations alone, of `assess` nothing."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code.

    Args:
        arguments: arguments after `archfem`; by default those of the process.

    Returns:
        The exit code of `exit_code`, or 143 if SIGTERM ended the command; the process exits with 2
        if the arguments are not understood.
    """
    parser = _build_parser()
    if not (sys.argv[1:] if arguments is None else arguments):
        parser.exit(2, parser.format_help())
    options = parser.parse_args(arguments)
    if isinstance(sys.stdout, TextIOWrapper):
        # Lines are printed without delay, also into a pipe. Characters that the terminal does not
        # know are printed as their codes.
        sys.stdout.reconfigure(line_buffering=True, errors="backslashreplace")
    # Warnings of the library are logged, and printed to stderr.
    logging.basicConfig(format="%(levelname)s: %(message)s", level=logging.WARNING)
    with _interrupt_on_sigterm() as signals:
        code = exit_code(lambda: _run_command(options))
    return 128 + signal.SIGTERM if signals and code == ExitCode.INTERRUPTED else code


def _run_command(options: argparse.Namespace) -> int | None:
    """Run a command, if the memory suffices."""
    _check_memory()
    if getattr(options, "own_code", False):
        import_module("archfem.cases.provenance").permit_extensions()
    return options.command(options)


@contextmanager
def _interrupt_on_sigterm() -> Iterator[list[float]]:
    """Raise KeyboardInterrupt on SIGTERM, as Ctrl-C does; yield the received signals."""
    received: list[float] = []

    def interrupt(*_: object) -> None:
        # `timeout` sends it twice, to the process and to its group: the second one must not
        # break off what the first one lets be kept
        repeated = bool(received) and monotonic() - received[-1] < 1.0
        received.append(monotonic())  # so that the exit code differs from that of Ctrl-C
        if not repeated:
            raise KeyboardInterrupt

    previous = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield received
    finally:
        signal.signal(signal.SIGTERM, previous)


def _check_memory(min_bytes: int = 3 * 2**29) -> None:
    """Refuse a memory limit at which libraries crash or block while they are imported."""
    if find_spec("resource") is None:  # Windows
        return
    resource = import_module("resource")
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
        return ExitCode.INTERRUPTED
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
    _add_result_commands(commands)
    _add_installation_commands(commands)
    _add_film(commands)
    _add_motion_commands(commands)
    return parser


def _add_command(
    commands: Any, name: str, about: str, module: str, function: str = "", **texts: str
) -> AddArgument:
    """Add a command, and return the function that adds its arguments."""

    def command(options: argparse.Namespace) -> int | None:
        # imported when the command is called, since imports take time
        return getattr(import_module(f"archfem.commands.{module}"), function or name)(options)

    parser = commands.add_parser(name, help=about, **texts)
    parser.set_defaults(command=command)
    return parser.add_argument


def _add_case_command(
    commands: Any,
    name: str,
    about: str,
    folder: str = "folder for the results",
    required: bool = True,
    module: str = "run",
) -> AddArgument:
    """Add a command that takes a case file."""
    texts = {"description": about, "epilog": EXIT_CODES}
    add_argument = _add_command(commands, name, about, module, **texts)
    add_argument("case", metavar="CASE.toml", help="the case file")
    _add_changes(add_argument)
    if folder:
        add_argument("--out", required=required, metavar="DIR", help=folder)
    return add_argument


def _add_case_commands(commands: Any) -> None:
    """Add the commands that take a case file."""
    add = partial(_add_case_command, commands)
    add_to = add("run", "dead load, time histories, tables and pictures")
    add_to("--workers", type=int, default=1, help="processes for pairs of a suite (1)")
    add("check", "read a case, build its model and find its dead load", "", module="tools")
    about = "frequencies, masses and shapes of vibrations about dead load"
    add("modes", about)("--count", type=int, default=6, help="how many modes (6)")
    about = "collapse factor and mechanism by limit analysis of the case alone"
    add("limit", about, "folder for text, table and picture (none)", required=False)
    about = "least thickness of a ring at rest, scaled about its middle line"
    add_to = add("thickness", about, "folder for the text (none)", required=False)
    add_to("--part", help="the ring, one of several")
    about = "kinematic assessment of the collapse mechanism against a design spectrum"
    add_to = add("assess", about, "folder for text and pictures (none)", required=False)
    add_to("--parts", action="store_true", help="each part by itself")
    _add_rating(add)
    add_to = add("mesh", "write the mesh of a case as a gmsh file", "")
    add_to("--out", required=True, metavar="FILE.msh", help="the mesh file")
    about = "does it fall, whatever its uncertain properties are?"
    of_margin = partial(add, required=False, module="margin")
    add_to = of_margin("verdict", about, "folder that keeps all runs (none)")
    add_to("--workers", type=int, default=1, help="processes for the runs (1)")
    about = "sampled runs; up to 14 more change one property each, or none (236)"
    add_to("--samples", type=int, default=236, help=about)
    add_to("--pair", metavar="NAME", help="one motion of a [suite] alone (each in turn)")
    about = "at which factor on its motion does it fall, or form a mechanism?"
    add_to = of_margin("scale", about, "folder for the table (none)")
    add_to("--pair", metavar="NAME", help="one motion of a [suite] alone (each in turn)")
    about = "annual rate of collapse, from the hazard and the sampling of [risk]"
    add("risk", about)("--workers", type=int, default=1, help="processes for the runs (1)")
    about = "speed against error over fidelities, meshes, quadratures and steps"
    add("accuracy", about)("--workers", type=int, default=1, help="processes for settings (1)")


def _add_rating(add: Callable[..., AddArgument]) -> None:
    """Add `archfem rate`."""
    about = "rating of a bridge for vehicles by limit analysis"
    add_to = add("rate", about, "")
    about = "such as LM1, or Eurocode, CS454, HL93 for all of a code (that of [rating]); repeatable"
    add_to("--vehicle", action="append", default=[], metavar="NAME", help=about, dest="vehicles")
    add_to("--live", type=float, help="partial factor on the vehicle (of its code)")
    add_to("--impact", type=float, help="dynamic factor on the vehicle (of its code)")
    add_to("--dead", type=float, help="partial factor on the weights (1)")
    add_to("--width", help="width that carries one vehicle [m] (by rule)")
    add_to("--area-load", help="load beside the axles [Pa] (of its code)")
    about = "also with other rings, piers, cover, strength, friction and width, one at a time"
    add_to("--vary", action="store_true", help=about)
    add_to("--out", metavar="DIR", help="folder for text, table and picture (none)")


def _add_changes(add_argument: AddArgument) -> None:
    """Add the options that change values of a case, and permit its code."""
    _add_own_code(add_argument)
    metavar = "SECTION.KEY=VALUE"
    about = "use this value instead of the file's, and names of files from its folder; repeatable"
    add_argument("--set", action="append", default=[], metavar=metavar, dest="changes", help=about)


def _add_own_code(add_argument: AddArgument) -> None:
    """Add the option that permits code of the user."""
    about = "run the Python modules that the file names: only if you trust them"
    add_argument("--own-code", action="store_true", help=about)


def _add_result_commands(commands: Any) -> None:
    """Add `archfem report`, `archfem page` and `archfem study`."""
    text = "Write one self-contained HTML page of a result folder, or of a history alone."
    about = "one HTML page of a result folder, to print"
    add = _add_command(commands, "report", about, "run", description=text)
    about = "that `archfem run` has written, several for one report; or a history.nc"
    add("folders", nargs="+", metavar="FOLDER", help=about)
    add("--out", metavar="FILE.html", help="the page (FOLDER/report.html), or .docx for Word")
    about = "who signs what, as in report.author=NAME; repeatable"
    add(
        "--set", action="append", default=[], metavar="report.KEY=WORDS", dest="changes", help=about
    )
    add("--inputs", metavar="DIR", help="folder of a mesh or an extension of the case (FOLDER)")
    about = "folder of a study that the report shows (FOLDER); repeatable"
    add("--study", action="append", default=[], metavar="DIR", help=about, dest="studies")
    add("--pdf", action="store_true", help="also print it, by Chromium or Chrome")
    _add_own_code(add)
    text = (
        "Write one HTML page that shakes the arch of a result folder, and lets readers change it."
    )
    about = "one HTML page that shakes the arch, down to the ground"
    add = _add_command(commands, "page", about, "run", description=text)
    add("folder", metavar="FOLDER", help="that `archfem run` has written")
    add("--out", metavar="FILE.html", help="the page (FOLDER/page.html)")
    add("--inputs", metavar="DIR", help="folder of a mesh or an extension of the case (FOLDER)")
    _add_own_code(add)
    about = "many cases: a table of results, on all cores or a cluster"
    add = _add_command(commands, "study", about, "study", description=about)
    add("case", nargs="?", metavar="STUDY.toml", help="the study's file")
    _add_changes(add)
    add("--out", metavar="DIR", help="folder for the results")
    add("--workers", type=int, help="processes (one a core)")
    add("--scheduler", metavar="tcp://HOST:PORT", help="of Dask, for a cluster")
    add("--status", metavar="DIR", help="say how far the study in a folder is")


def _add_installation_commands(commands: Any) -> None:
    """Add the commands on the installation and its example cases."""
    about = "compile the time steps once, for some minutes"
    text = (
        "Compile all that steps in time, once, for some minutes; a run compiles only what it needs."
    )
    add = _add_command(commands, "compile", about, "run", "compile_steps", description=text)
    add("--jobs", type=int, help="processes that compile (one a core)")
    _add_command(commands, "examples", "the cases that archfem brings, a line each", "tools")
    text = "Print a case, as in `archfem example ring > ring.toml`, or copy it."
    about = "print one of them, or copy it"
    add = _add_command(commands, "example", about, "tools", description=text)
    add("name", metavar="NAME", help="as `archfem examples` lists them")
    add("--out", metavar="DIR", help="copy it there, with all that it refers to")
    about = "write a commented case to begin with"
    add = _add_command(commands, "new", about, "tools", description=about)
    kinds = ("ring", "bridge", "wall", "portal")
    add("kind", choices=kinds, help="of structure; a wall across its plane")
    add("--out", metavar="CASE.toml", help="the file (its kind.toml)")
    _add_command(commands, "schema", "print the JSON schema of case files, for editors", "tools")
    about = "what is installed, what is missing, how to get it"
    _add_command(commands, "doctor", about, "tools")


def _add_film(commands: Any) -> None:
    """Add `archfem animate`."""
    about = "film the history of a run"
    add = _add_command(commands, "animate", about, "tools", description=about)
    add("history", metavar="HISTORY.nc", help="the history, which has fields, or its folder")
    add("--case", metavar="CASE.toml", help="its case (the one beside it)")
    add("--out", metavar="FILM.mp4", help="the film, or a .gif (beside it)")
    about = "slow motion around the mechanism, or a time [s]"
    add("--window", metavar="auto|FROM,TO", help=about)
    add("--colour", help="displacement or stress (displacement)")
    add("--magnification", type=float, help="of displacements (chosen)")
    add("--fps", type=float, help="frames a second, at most (20)")
    add("--seconds", type=float, help="how long the film lasts (as the run)")
    add("--size", metavar="WIDTHxHEIGHT", help="in pixels (1280x720)")
    add("--renderer", help="matplotlib, or pyvista, also for .html (matplotlib)")
    _add_own_code(add)


def _add_motion_commands(commands: Any) -> None:
    """Add `archfem motion` and `archfem select`."""
    text = "Print the measures of records, draw them, their integrals and spectra."
    about = "measures and pictures of ground motions"
    add = _add_command(commands, "motion", about, "records", description=text)
    add("files", nargs="+", metavar="FILE", help="a record")
    add("--column", type=int, help="component or plain column, counted from 1")
    add("--units", help="of columns, miniSEED or SAC: g, m/s2, cm/s2 or gal")
    add("--dt", type=float, help="time between samples of plain columns [s]")
    add("--response", metavar="XML", help="StationXML of counts in miniSEED, SAC")
    add("--out", default="out/motions", metavar="DIR", help="folder for the pictures")
    about = "select recorded motions by the rule of a code"
    add = _add_command(commands, "select", about, "records", description=about)
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
