"""The command for studies: carries one out, or says how far it has come."""

import argparse
import sys
from pathlib import Path

from archfem.errors import InvalidInput
from archfem.files import result_folder
from archfem.studies.progress import status


def study(given: argparse.Namespace) -> None:
    """Carry out a study, or go on with it: its table, or tables of cases side by side.

    Args:
        given: `case`, the file of a study, `changes` to its cases, the folder `out`, `workers` or
            `scheduler`, and whether to run its `own_code`; or `status`, the folder of a study.

    Raises:
        InvalidInput: neither a study and a folder were given, nor the folder of one.
    """
    if given.status is not None:
        print(status(given.status))
        return
    if given.case is None or given.out is None:
        raise InvalidInput("a study needs a file and a folder: archfem study STUDY.toml --out DIR")
    from archfem.studies.files import study_tables

    if given.own_code:  # find = "module:function" beside the file
        sys.path.insert(0, str(Path(given.case).resolve().parent))
    if "cases" in study_tables(Path(given.case)):
        _compare(given, result_folder(given.out))
    else:
        _go_over(given, result_folder(given.out))


def _compare(given: argparse.Namespace, folder: Path) -> None:
    """Cases side by side: their tables, and a picture of the factors at first mechanism."""
    from archfem.studies.compared import compared, write_comparison
    from archfem.studies.comparison import Comparison
    from archfem.studies.findings import study_table

    asked = Comparison.read(given.case, given.changes)
    print(asked.title)
    found = {}
    for name, finding in compared(asked, folder, workers=given.workers, client=given.scheduler):
        found[name] = finding
        print(f"{name}: {len(finding.runs)} pairs")
    text = study_table(found)
    print(text)
    for path in write_comparison(asked, found, text, folder):
        print(f"wrote {path}")


def _go_over(given: argparse.Namespace, folder: Path) -> None:
    """What differs from one case: the table of findings, and what became of points that failed."""
    from archfem.studies.study import Study
    from archfem.studies.table import CSV, NETCDF

    asked = Study.read(given.case, given.changes, own_code=given.own_code)
    print(f"{asked.title}: {len(asked.points)} points")
    found = asked.run(folder, workers=given.workers, client=given.scheduler)
    print(status(folder))
    errors = found["error"].values.ravel().tolist()
    for error in sorted({error for error in errors if error}):
        print(f"{errors.count(error)} ended in {error}")
    for name in (NETCDF, CSV):
        print(f"wrote {folder / name}")
