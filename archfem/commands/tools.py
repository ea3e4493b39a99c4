"""Commands without result folders: check, animate, examples, new, schema, doctor.

The module imports drawing within functions, so that `archfem check` starts at once.
"""

import argparse
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from archfem import _numba, _optional
from archfem._display import NOTE_MARK, write_progress_line
from archfem._files import path_inside, read_listed
from archfem.cases import result_text, structure_text
from archfem.cases.answers import doubt_fill
from archfem.cases.case import Case, read_settings
from archfem.cases.examples import copy_example, list_example_titles, read_example, write_new_case
from archfem.cases.push_factors import PushFactors
from archfem.cases.run import HISTORY_FILE, DeadLoadResult, dead_load_of_case
from archfem.cases.structure_keys import find_drawing, list_unused_tables, read_survey
from archfem.cases.toml_file import format_key, parse_tables
from archfem.commands.cli import ExitCode
from archfem.dynamics.history import History
from archfem.dynamics.recorder import doubt_drift
from archfem.errors import ArchfemError, InvalidInput, NotInstalled
from archfem.limit.collapse import Collapse, Outcome
from archfem.models.model import Doubt
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite

PIP_INSTALL = f"{sys.executable} -m pip install"


def doubt_code(remarks: Iterable[result_text.Remark]) -> int:
    """Return the exit code of printed doubts and notes."""
    return ExitCode.DOUBTFUL if any(isinstance(each, Doubt) for each in remarks) else 0


def check(options: argparse.Namespace) -> int:
    """Check a case; where that fails, draw the drawing that it may have."""
    try:
        code = _check_case(options)
        # an earlier picture shows faults that are mended
        if (picture := Path(f"{Path(options.case).stem}_drawing.png")).exists():
            with suppress(ArchfemError, OSError):
                if _draw_as_read(options) is not None:
                    print(f"wrote {picture} anew: the drawing as it was read")
        return code
    except ArchfemError as error:
        # without drawing, file or place for the picture the error is all
        with suppress(ArchfemError, OSError):
            if (drawn := _draw_as_read(options, str(error))) is not None:
                print(f"wrote {drawn}: the drawing as it was read", file=sys.stderr)
        raise


def _draw_as_read(options: argparse.Namespace, error: str = "") -> Path | None:
    """Draw the drawing of a case in the current folder; None where it has none in error."""
    path = Path(options.case)
    given = find_drawing(read_settings(path, options.changes), path.parent)
    # errors of the drawing name it, or a structure that does not stand
    names = given and (given["path"].name in error or "does not stand" in error)
    if given is None or (error and not names):
        return None
    from archfem.view.sketch import draw_outlines
    from archfem.view.style import save

    return save(draw_outlines(**given, error=error), f"{path.stem}_drawing.png")


def _check_case(options: argparse.Namespace) -> int:
    """Read a case and its motions, and compute dead load, and limit analysis unless it searches."""
    case = Case.read(options.case, options.changes)
    print(case.title)
    if (survey := read_survey(case.settings, case.folder)) is not None:
        print(survey)
    print(structure_text.describe_supports(case.structure))
    print(structure_text.describe_depths(case.structure))
    for section, name, used in list_unused_tables(case.settings, case.structure):
        place = f"[{section}.{format_key(name)}]"
        print(f"{NOTE_MARK}{place} counts for nothing: there are {used} alone")
    case.limit.check(case.structure)
    doubts = list[Doubt]()
    if case.pushover is not None:
        case.pushover.check(case.structure)
    if case.limit.live and case.limit.friction == "nonassociated":
        print("limit analysis: `archfem limit` searches sliding without dilatancy, in both senses")
    elif case.limit.live:
        found = case.limit.solve(case.structure)
        doubts = show_both_senses(case, found, lambda _, text, *__: print(text))
    # Unreadable records are errors before the dead load is computed.
    case.check_ground()
    at_rest = DeadLoadResult.of(case)
    print(result_text.describe_dead_load(at_rest, explain=True))
    if case.pushover is not None:
        print(case.pushover)
    motions: Sequence[Motion] = ()
    if case.suite is not None:
        print_motions(suite := case.ground_suite())
        motions = suite.motions
    elif case.motion is not None:
        motion = case.ground_motion()
        motions = [motion]
        print(f"motion: {motion.name}, {motion.duration:.2f} s, PGA {motion.pga:.3f} m/s²")
    drifts = [doubt for motion in motions for doubt in doubt_drift(motion)]
    print(*result_text.mark_remarks(drifts), sep="\n", end="\n" * bool(drifts))
    doubts += [*drifts, *at_rest.doubts]
    ready = f"in doubt, {len(doubts)} times, as above" if doubts else "ready"
    print(f"{options.case}: {ready}; dead load in {at_rest.dead.iterations} iterations")
    return doubt_code(doubts)


def animate(options: argparse.Namespace) -> None:
    """Film the history of a run."""
    path = Path(options.history)
    path = path_inside(path, HISTORY_FILE) if path.is_dir() else path
    if not path.is_file():
        raise InvalidInput(f"there is no history file {path}")
    case = _read_case(path) if options.case is None else Case.read(options.case)
    run = History.read(path, case.structure)
    names = ("window", "colour", "magnification", "fps", "seconds", "size", "renderer")
    # Options that were not given keep the defaults of `film`.
    settings = {key: value for key in names if (value := getattr(options, key)) is not None}
    if settings.get("window", "auto") != "auto":
        remedy = "give 'auto', or two times in seconds such as 8.0,9.5"
        settings["window"] = _parse_pair("window", options.window, float, ",", remedy)
    if "size" in settings:
        remedy = "give width and height, such as 1280x720"
        settings["size"] = _parse_pair("size", options.size, int, "x", remedy)
    from archfem.view.films.film import film  # pyvista and the encoder are slow to import

    target = Path(options.out) if options.out is not None else path.with_suffix(".mp4")
    print(f"wrote {film(dead_load_of_case(case).model, run, target, **settings)}")


def _read_case(path: Path, name: str = "case.toml") -> Case:
    """Read the case of a run: beside its history, or beside the folder of its pair."""
    for folder in (path.parent, path.absolute().parent.parent):
        if path_inside(folder, name).is_file():
            read_listed(folder, name)
            try:
                return Case.read(folder / name)
            except InvalidInput as error:
                # such as a drawing, which lies beside the case that was run
                raise InvalidInput(f"{error}; or give that case, --case CASE.toml") from error
    if text := History.read(path).dataset.attrs.get("case"):  # a history that was moved alone
        return Case.of(parse_tables(text))
    raise InvalidInput(
        f"there is no {name} beside {path}, as `archfem run` writes one: give the case of the "
        "run, --case CASE.toml"
    )


def _parse_pair(
    option: str, text: str, number: type, separator: str, remedy: str
) -> tuple[Any, Any]:
    """Parse two numbers such as "1280x720"."""
    try:
        first, second = (number(part) for part in text.lower().split(separator))
    except ValueError as error:
        raise InvalidInput(f"--{option} {text}: {remedy}") from error
    return first, second


def examples(options: argparse.Namespace) -> None:
    """Print names and titles of the example cases."""
    titles = list_example_titles()
    width = max(map(len, titles))
    for name, title in titles.items():
        print(f"{name.ljust(width)}  {title}")


def example(options: argparse.Namespace) -> None:
    """Print an example case, or copy it with the files that it names."""
    if options.out is not None:
        for path in copy_example(options.name, Path(options.out)):
            print(f"wrote {path}")
        return
    text, companions = read_example(options.name)
    # The text goes to stdout, to be saved; the note does not.
    print(text, end="")
    if companions:
        names = ", ".join(path.name for path in companions)
        print(
            f"archfem: it refers to {names} where archfem is installed; "
            f"`archfem example {options.name} --out DIR` copies all of them",
            file=sys.stderr,
        )


def show_both_senses(
    case: Case,
    first: Collapse,
    show: Callable[[Collapse, str, PushFactors | None, Sequence[Doubt]], None],
    doubts: Sequence[Doubt] = (),
) -> list[Doubt]:
    """Show a result of limit analysis beside that of the other sense, each at its least end.

    Both may add to the doubts; those that are shown are returned. Where it, or the rest, is cut
    short, the result is shown.
    """
    # where a structure does not stand, the load plays no part
    other = None if first.outcome is Outcome.INFEASIBLE else case.limit.opposite
    opposite, left = None, "\nin the other sense: not computed" if other else ""
    try:
        if first.solutions and first.solutions.interrupted:
            raise KeyboardInterrupt
        first = first.least or first
        if other is not None:
            # a search in walls takes minutes in each sense
            write_progress_line("limit analysis", f"{first.sentence}; the other sense follows")
            opposite = other.solve(case.structure)
            opposite = opposite.least or opposite
            left = ""
    finally:
        found, text, site = result_text.describe_limit(case, first, opposite)
        once = [*dict.fromkeys(doubts)]  # both senses may have the same
        slides = [doubt for doubt in once if doubt.cause.startswith("joints slide (")]
        if len(slides) > 1 and opposite is not None:  # that of the sense which is shown is enough
            once.remove(slides[0 if found is opposite else 1])
        once += doubt_fill(site, found)
        show(found, "\n".join([f"{text}{left}", *result_text.mark_remarks(once)]), site, once)
    return once


def print_motions(suite: Suite) -> None:
    """Print the result of spectral matching, or the measures of the motions."""
    if suite.matches:
        print(result_text.tabulate_matches(suite.matches).text)
    else:
        print(result_text.tabulate_motions(suite.motions).text)


class Diagnosis(NamedTuple):
    """State of one part of the installation."""

    item: str
    state: str
    remedy: str = ""  # empty if all is well


def new(options: argparse.Namespace) -> None:
    """Write a commented case to begin with."""
    path = Path(options.out or f"{options.kind}.toml")
    write_new_case(options.kind, path, Path(__file__).with_name("case.schema.json"))
    print(f"wrote {path}: `archfem check {path}` reads it, `archfem run {path} --out DIR` runs it")


def schema(options: argparse.Namespace) -> None:
    """Print the JSON schema of case files."""
    print(import_module("archfem.commands.schema").format_schema(), end="")


def doctor(options: argparse.Namespace) -> None:
    """Print installed and missing packages, and the commands that install them."""
    diagnoses = list(diagnose_installation())
    width = max(len(diagnosis.item) for diagnosis in diagnoses)
    for diagnosis in diagnoses:
        print(f"{diagnosis.item.ljust(width)}  {diagnosis.state}")
    faults = [diagnosis for diagnosis in diagnoses if diagnosis.remedy]
    for fault in faults:
        print(f"\n{fault.item}: {fault.remedy}")
    # An error, so that scripts and CI see the exit code 1.
    if faults:
        raise NotInstalled(f"not all is well: {', '.join(fault.item for fault in faults)}")
    print("\nall is well")


def diagnose_installation() -> Iterator[Diagnosis]:
    """Diagnose archfem, Python, required packages, FEniCSx, libraries and compiled code."""
    package = import_module("archfem")
    folder = Path(package.__file__ or "").parent
    yield Diagnosis("archfem", f"{package.__version__} in {folder}")
    yield Diagnosis("Python", f"{sys.version.split()[0]}, {sys.executable}")
    yield from _diagnose_requirements()
    yield from _diagnose_fenicsx()
    if find_spec("pyvista") is not None:
        found = _optional.can_draw()
        remedy = "" if found else _optional.OPTIONAL_PACKAGES["EGL"].remedy
        yield Diagnosis("library of the viewer", "found" if found else "missing", remedy)
    if find_spec("imageio") is not None:
        yield _diagnose_ffmpeg()
    yield _diagnose_compiled_code()
    optional = {
        "gmsh": ("mesh", "only meshes of elastic stones need it"),
        "imageio": ("film", "only films need it"),
        "pyvista": ("film", "only its viewer and its films need it"),
        "distributed": ("cluster", "only clusters need it"),
        "openpyxl": ("tables", "only tables of studies for Excel need it"),
        "trame": ("notebooks", "only pyvista's pages and its viewer in notebooks need it"),
    }
    for name, (extra, need) in optional.items():
        if find_spec(name) is None:
            yield Diagnosis(name, f"none; {need}: {PIP_INSTALL} 'archfem[{extra}]'")


def _diagnose_requirements() -> Iterator[Diagnosis]:
    """Diagnose the packages that pip installs with archfem."""
    try:
        requirements = metadata.requires("archfem") or []
    except metadata.PackageNotFoundError:
        yield Diagnosis("packages", "archfem itself is not installed", f"{PIP_INSTALL} archfem")
        return
    for line in requirements:
        # Requirements of extras have a marker behind the version, and do not match.
        if match := re.match(r"([\w.-]+)(?:\[.*\])?(?:<[\d.]+,)?>=([\d.]+)$", line):
            yield _diagnose_package(*match.groups())


def _diagnose_package(name: str, min_version: str) -> Diagnosis:
    """Diagnose a package that must have a minimum version."""
    remedy = f"{PIP_INSTALL} '{name}>={min_version}'"
    try:
        version = metadata.version(name)
        if _numbers(version) < _numbers(min_version):
            return Diagnosis(name, f"{version}, older than {min_version}", remedy)
        # these are also imported, since libraries of the system may be missing
        if name in ("numba", "netCDF4", "matplotlib"):
            import_module("matplotlib.figure" if name == "matplotlib" else name)
    except metadata.PackageNotFoundError:
        return Diagnosis(name, "missing", remedy)
    except Exception as error:  # imports of other packages may raise errors of any class
        if name in _optional.OPTIONAL_PACKAGES:
            remedy = _optional.OPTIONAL_PACKAGES[name].remedy
        return Diagnosis(name, f"does not load: {error}", remedy)
    return Diagnosis(name, version)


def _diagnose_fenicsx() -> Iterator[Diagnosis]:
    """Diagnose FEniCSx, and the C compiler for its forms."""
    try:
        # These modules import dolfinx and petsc4py with a message of their own.
        import_module("archfem.models.fem")
        import_module("archfem.statics.snes")
    except ImportError as error:
        remedy = _optional.OPTIONAL_PACKAGES["FEniCSx"].remedy
        if find_spec("dolfinx") is None:  # pip cannot install it, and most works without it
            state = (
                "none; motions, limit analysis, and statics, histories and falls of rigid stones "
                f"work. Elastic stones, meshes and stress need it: {remedy}"
            )
            yield Diagnosis("FEniCSx", state)
        else:
            yield Diagnosis("FEniCSx", f"does not load: {error.__cause__}", remedy)
        return
    for name in ("dolfinx", "petsc4py", "mpi4py"):
        yield Diagnosis(name, str(import_module(name).__version__))
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    remedy = "'apt-get install gcc libc6-dev', elsewhere 'conda install -c conda-forge c-compiler'"
    yield Diagnosis("C compiler", compiler or "missing", "" if compiler else remedy)


def _diagnose_ffmpeg() -> Diagnosis:
    """Diagnose the program that encodes films."""
    try:
        return Diagnosis("ffmpeg", import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except Exception as error:  # the package is missing, or its program
        return Diagnosis("ffmpeg", str(error), f"{PIP_INSTALL} 'imageio[ffmpeg]'")


def _diagnose_compiled_code() -> Diagnosis:
    """Diagnose the cache of compiled kernels."""
    import_module("archfem.dynamics.warm_up")  # declares all kernels
    count, folders = _numba.count_cached_functions(), _numba.cache_folders()
    if not count:
        return Diagnosis("compiled code", "none yet: the first run, or 'archfem compile', makes it")
    state, remedy = f"{count} functions in {', '.join(map(str, folders))}", ""
    if damaged := _numba.find_damaged_files():
        remedy = "'archfem compile' makes them anew, as the next run does"
        state += f"; {len(damaged)} damaged files, the first {damaged[0]}"
    return Diagnosis("compiled code", state, remedy)


def _numbers(version: str) -> list[int]:
    """Return the first three numbers of a version."""
    return [int(part) for part in re.findall(r"\d+", version)[:3]]
