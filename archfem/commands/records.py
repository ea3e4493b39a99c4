"""Commands on ground motions: their measures and pictures, and a selection by a code's rule."""

import argparse
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from archfem._files import create_result_folder
from archfem.cases import result_text
from archfem.commands.run import write
from archfem.errors import DidNotConverge, InvalidInput
from archfem.motion.motion import Motion
from archfem.view.motions import draw_spectra


def motion(options: argparse.Namespace) -> None:
    """Print the measures of records and draw them."""
    folder = create_result_folder(options.out)
    given = {key: getattr(options, key) for key in ("column", "units", "dt", "response")}
    read, refused = _read_records(options.files, given)
    motions = _name_by_file(read)
    print(result_text.tabulate_motions(motions).text)
    figures = {f"{motion.name}.png": motion.plot() for motion in motions}
    write({**figures, "spectra.png": draw_spectra(motions)}, folder)
    if refused:
        raise InvalidInput(
            f"{len(refused)} of {len(options.files)} files were refused, as said above"
        )


def select(options: argparse.Namespace) -> None:
    """Select records of a folder by a code's rule: text, table, picture, and [suite] of a case."""
    from archfem.cases.motion_keys import build_spectrum, write_selected_suite
    from archfem.cases.toml_file import parse_tables
    from archfem.motion.record_selection import select_records

    try:
        target = parse_tables(f"target = {options.spectrum}")["target"]
    except InvalidInput as error:
        error.args = (f"--spectrum {options.spectrum} is no table of TOML: {error}",)
        raise
    spectrum = build_spectrum(target, "--spectrum")
    names = ("count", "rule", "scales", "measure")
    settings = {name: getattr(options, name) for name in names}
    settings["scales"] = tuple(settings["scales"])
    # files without a name are refused, since no record has such files
    settings["events"] = dict(event.partition("=")[::2] for event in options.events)
    failure = None
    try:
        with name_options(events="--event"):
            found = select_records(options.folder, spectrum, options.period, **settings)
    except DidNotConverge as error:  # the nearest selection is shown, and the command fails
        failure, found = error, error.last
    print(found)
    if options.out is not None:
        suite = write_selected_suite(found, Path(options.folder).absolute(), target)
        texts = {"selection.txt": str(found), "selection.csv": found.table()}
        texts["selection.toml"] = suite.rstrip()
        write({**texts, "selection.png": found.plot()}, create_result_folder(options.out))
    if failure is not None:
        raise DidNotConverge("no set was found that meets the rule: above is the nearest")


def _name_by_file(read: Mapping[str, Motion]) -> list[Motion]:
    """Return motions named as their files, with a number behind a name that is used before."""
    named: list[Motion] = []
    names = [Path(path).name for path in read]
    for index, (motion, name) in enumerate(zip(read.values(), names, strict=True)):
        before = names[:index].count(name)
        named.append(replace(motion, name=f"{name} ({before + 1})" if before else name))
    return named


def _read_records(
    files: Sequence[str], given: Mapping[str, Any]
) -> tuple[dict[str, Motion], list[InvalidInput]]:
    """Read records: motions by file, and the errors of refused files, which are printed."""
    read, refused = {}, []
    names = {name: f"--{name}" for name in given}
    for path in files:
        try:
            with name_options(**names):
                read[path] = Motion.read(path, **given)
        except InvalidInput as error:
            refused.append(error)
            if len(files) > 1:
                print(f"archfem: {error}", file=sys.stderr)
    # A single refused record is the error of the command.
    if not read:
        raise refused[0]
    return read, refused


@contextmanager
def name_options(**options: str) -> Iterator[None]:
    """Name options of the command, by keyword, where errors of a block name keywords of Python."""

    def replace_keyword(match: re.Match[str]) -> str:
        # the value of `units='g'` is separated from the option, other words are already
        return f"{options[match[1]]} " if match[2] else options[match[1]]

    try:
        yield
    except InvalidInput as error:
        pattern = rf"\b({'|'.join(options)})=(?=(['\d])?)"
        raise InvalidInput(re.sub(pattern, replace_keyword, str(error))) from error
