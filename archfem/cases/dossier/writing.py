"""The whole report, from its parts."""

from pathlib import Path

from archfem.cases.case import Case
from archfem.cases.dossier.case_part import case_sections
from archfem.cases.dossier.check_part import check_section, digest, source_section
from archfem.cases.dossier.ground_part import ground_section
from archfem.cases.dossier.rest_part import rest_sections
from archfem.cases.dossier.results import Results
from archfem.cases.dossier.run_part import facts_of, run_sections
from archfem.cases.toml import tables_of
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.view.pages.document import Document
from archfem.view.pages.player import write_page

FOOT = (
    "Written by archfem from the results named above; figures and numbers are theirs. On paper a "
    "player shows the instant and the joint that it showed on the screen."
)


def document_of(results: Results) -> Document:
    """Return the report.

    Args:
        results: of which it is.
    """
    case = results.case
    sections = [
        *case_sections(results),
        *rest_sections(results),
        ground_section(results),
        *run_sections(results),
        check_section(results),
        source_section(results),
    ]
    subtitle = f"archfem report · case {digest(case.text().encode())[:12]}"
    return Document(case.title, subtitle, facts_of(results), sections, FOOT)


def write_report(results: Results, path: str | Path) -> Path:
    """Write the report in one stroke.

    Args:
        results: of which it is.
        path: the file, .html; folders are made.

    Returns:
        The file.
    """
    return write_page(path, document_of(results).page)


def report_of(run: History, path: str | Path) -> Path:
    """Write the report of one run, by the case that it keeps.

    Args:
        run: of a case.
        path: as for `write_report`.

    Returns:
        The file.

    Raises:
        InvalidInput: the run keeps no case.
    """
    text = run.dataset.attrs.get("case")
    if not text:
        raise InvalidInput(
            "this run was made in Python and keeps no case to report on: run.player(model) shows "
            "it, and archfem.cases.carried_out runs a case"
        )
    case = Case.of(tables_of(text))
    known = run if run.structure is not None else History(run.dataset, case.structure)
    pairs, motion = list((case.suite or {}).get("pairs", ())), run.dataset.attrs.get("motion")
    name = str(motion) if motion in pairs else "run"
    missing = tuple(pair for pair in pairs if pair != name)
    return write_report(Results(case, {name: known}, missing=missing), path)
