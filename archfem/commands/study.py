"""Command `archfem study`: run a study or a comparison of cases, or print its progress."""

import argparse
import sys
from pathlib import Path

from archfem._files import create_result_folder
from archfem.errors import InvalidInput
from archfem.studies.result_store import status


def study(options: argparse.Namespace) -> None:
    """Run a study, or the points of it that are left; print and write its tables."""
    if options.status is not None:
        print(status(options.status))
        return
    if options.case is None or options.out is None:
        raise InvalidInput("a study needs a file and a folder: archfem study STUDY.toml --out DIR")
    from archfem.studies.comparison import read_study_tables

    if options.own_code:  # compute = "module:function" beside the file
        sys.path.insert(0, str(Path(options.case).resolve().parent))
    if "cases" in read_study_tables(Path(options.case)):
        _compare(options, create_result_folder(options.out))
    else:
        _run_study(options, create_result_folder(options.out))


def _compare(options: argparse.Namespace, folder: Path) -> None:
    """Compare cases: tables, and a figure of the motion scales at first mechanisms."""
    from archfem.studies.comparison import Comparison, study_table
    from archfem.studies.comparison_run import run_comparison, write_comparison

    definition = Comparison.read(options.case, options.changes)
    print(definition.title)
    findings = {}
    for name, finding in run_comparison(
        definition, folder, workers=options.workers, client=options.scheduler
    ):
        findings[name] = finding
        print(f"{name}: {len(finding.runs)} pairs")
    text = study_table(findings)
    print(text)
    for path in write_comparison(definition, findings, text, folder):
        print(f"wrote {path}")


def _run_study(options: argparse.Namespace, folder: Path) -> None:
    """Run variations of one case: table of results, and errors of failed points."""
    from archfem.studies.result_store import CSV_FILE, NETCDF_FILE
    from archfem.studies.study import Study

    definition = Study.read(options.case, options.changes, own_code=options.own_code)
    print(f"{definition.title}: {len(definition.points)} points")
    table = definition.run(folder, workers=options.workers, client=options.scheduler)
    print(status(folder))
    errors = table["error"].values.ravel().tolist()
    for error in sorted({error for error in errors if error}):
        print(f"{errors.count(error)} ended in {error}")
    for name in (NETCDF_FILE, CSV_FILE):
        print(f"wrote {folder / name}")
