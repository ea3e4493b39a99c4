"""Reports of cases, result folders and single histories."""

from collections.abc import Sequence
from hashlib import sha256
from importlib import import_module
from pathlib import Path

from archfem.cases.case import Case
from archfem.cases.report.conclusion import list_facts, list_joint_facts
from archfem.cases.report.report_data import ReportData, build_live_page, build_player, label_parts
from archfem.cases.report.sections import build_joint_sections, build_sections, number_captions
from archfem.cases.result_folder import ResultFolder
from archfem.cases.run import Run
from archfem.cases.toml_file import parse_tables
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.masonry.structure import join_words
from archfem.view.pages.document import Document, write_page
from archfem.view.pages.player import Player
from archfem.view.pages.word import write_word
from archfem.view.style import limit_width

# Width of the figures that a report draws [mm]: their captions stand beside them on paper
FIGURE_WIDTH = 110.0


def write_report(data: ReportData, path: str | Path, *others: ReportData) -> Path:
    """Write a report of one or several cases atomically, as HTML or, by its suffix, for Word."""
    cases = data, *others
    footer = "Written by archfem from the results named above; figures and numbers are theirs."
    if any(each.runs for each in cases):
        footer += " On paper a player shows the instant and the joint that it showed on the screen."
    digest = sha256("".join(each.case.text() for each in cases).encode()).hexdigest()[:12]
    origin = f"report of archfem {import_module('archfem').__version__} · case {digest}"
    parts = label_parts(cases)
    known = {each.folder for part in parts.values() for each in part.studies}
    if others and (lost := [place for place in data.study_folders if place not in known]):
        raise InvalidInput(f"{lost[0]} is a study of none of the cases: none has its structure")
    with limit_width(FIGURE_WIDTH):
        facts = list_joint_facts(parts) if others else list_facts(data)
        sections = build_joint_sections(parts) if others else build_sections(data)
    titles = dict.fromkeys(each.case.title for each in cases)
    title = (others and data.case.report.get("project")) or join_words([*titles])
    document = Document(title, origin, facts, number_captions(sections), footer)
    if Path(path).suffix.lower() == ".docx":
        return write_word(path, document)
    return write_page(path, document.page)


def write_report_of_case(
    result: Run | ResultFolder, path: str | Path, others: Sequence[Run | ResultFolder] = ()
) -> Path:
    """Write the report of the results of a case, or one of several."""
    return write_report(_collect_data(result), path, *map(_collect_data, others))


def write_page_of_case(result: Run | ResultFolder, path: str | Path) -> Path:
    """Write the page that shakes the structure of a case."""
    return build_live_page(_collect_data(result)).save(path)


def write_report_of_history(run: History, path: str | Path) -> Path:
    """Write the report of one run, with the case in its attributes."""
    text = run.dataset.attrs.get("case")
    if not text:
        raise InvalidInput(
            "this run was made in Python and keeps no case to report on: run.player(model) shows "
            "it, and archfem.cases.run_case runs a case"
        )
    case = Case.of(parse_tables(text))
    # A history that was read alone has no structure: that of its case is the same.
    run = run if run.structure is not None else History(run.dataset, case.structure)
    pairs, motion = list((case.suite or {}).get("pairs", ())), run.dataset.attrs.get("motion")
    name = str(motion or "run")
    missing = tuple(pair for pair in pairs if pair != name)
    return write_report(ReportData(case, {name: run}, missing=missing), path)


def player_of_case(result: Run | ResultFolder, run: str | None = None) -> Player:
    """Return the player of one run of a case."""
    data, names = _collect_data(result), list(result.runs)
    name = names[0] if run is None and len(names) == 1 else run
    if name is None or name not in names:
        problem = "no run is named" if run is None else f"there is no run '{run}'"
        raise InvalidInput(f"{problem}: there are {names}")
    return build_player(data.case, data.runs[name], data.case.title)


def _collect_data(result: Run | ResultFolder) -> ReportData:
    """Return the data of a report on the results of a case."""
    return ReportData(result.case, result.runs, result.folder, result.missing, result.studies)
