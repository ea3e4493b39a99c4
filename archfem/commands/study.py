"""Command `archfem study`: run a study or a comparison of cases, or print its progress."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from archfem._display import DOUBT_MARK
from archfem._files import DERIVED, create_result_folder, hash_content, replace_results
from archfem.commands.cli import ExitCode
from archfem.errors import Interrupted, InvalidInput
from archfem.models.model import Doubt
from archfem.studies.result_store import RESULT_FILES, format_table, status

if TYPE_CHECKING:
    from archfem.studies.study import Study


def study(options: argparse.Namespace) -> int:
    """Run a study, or the points of it that are left: a table of all points, and a picture."""
    if options.status is not None:
        print(status(options.status))
        return 0
    if options.case is None or options.out is None:
        raise InvalidInput("a study needs a file and a folder: archfem study STUDY.toml --out DIR")
    from archfem.studies.study import Study

    if options.own_code:  # compute = "module:function" beside the file
        sys.path.insert(0, str(Path(options.case).resolve().parent))
    definition = Study.read(options.case, options.changes, own_code=options.own_code)
    folder = create_result_folder(options.out)
    print(f"{definition.title}: {len(definition.points)} points", flush=True)
    interruption = None
    try:
        table = definition.run(folder, workers=options.workers, client=options.scheduler)
    except Interrupted as stop:
        table, interruption = stop.last, stop
    print(status(folder))
    errors = table["error"].values.ravel().tolist()
    for error in sorted({error for error in errors if error}):
        print(f"{DOUBT_MARK}{errors.count(error)} of {len(errors)} points ended in {error}")
    # of this very table
    inputs = hash_content(folder / RESULT_FILES[0])
    with replace_results(folder, DERIVED["study"][0], inputs) as draft:
        doubts = _write_results(definition, table, draft)
    for name in ("study.txt", "study.png", *RESULT_FILES):
        if (folder / name).is_file():
            print(f"wrote {folder / name}")
    if interruption is not None:
        raise interruption
    return 1 if all(errors) else ExitCode.DOUBTFUL if any(errors) or doubts else 0


def _write_results(definition: "Study", table: xr.Dataset, folder: Path) -> list[Doubt]:
    """Print, write and draw the table of a study, with comparisons, and return its doubts."""
    from archfem.cases.report import study_findings
    from archfem.studies.comparison import file_name, study_table, write_finding
    from archfem.studies.study import NOT_COMPUTED, Comparison
    from archfem.view.studies import draw_findings, draw_study
    from archfem.view.style import write_files

    findings = definition.findings(table) if isinstance(definition, Comparison) else {}
    for name, finding in findings.items():
        write_finding(finding, folder / f"{file_name(name)}.json")
    text = study_table(findings) if findings else format_table(table)
    if isinstance(definition, Comparison) and definition.statements:
        text = f"{definition.answers(table)}\n\n{text}"
    found = study_findings.collect_findings(definition.title, text, table)
    said = [*study_findings.say_what_changes(found), *study_findings.say_below_site(found)]
    said += [f"{DOUBT_MARK}{doubt}" for doubt in found.doubts]
    text = "\n\n".join(filter(None, [text, "\n".join(said)]))
    print(text)
    left = table["error"].values.ravel().tolist().count(NOT_COMPUTED)
    title = definition.title + f", interrupted: {left} points are not computed" * (left > 0)
    write_files({"study.txt": f"{title}\n\n{text}"}, folder)
    factors = {name: finding.factors for name, finding in findings.items() if finding.scales}
    try:
        if isinstance(definition, Comparison) and factors:
            picture = draw_study(factors, definition.reduction, title)
        else:
            # the push in g, as in the table, is the factor in its unit
            picture = draw_findings(found.numbers if "push" in found.names else table)
        write_files({"study.png": picture}, folder)
    except InvalidInput as error:
        print(f"no picture: {error}")
    return found.doubts
