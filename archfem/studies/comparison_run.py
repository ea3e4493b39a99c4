"""Runs of a comparison, with a file of findings for each case, and of the pairs of a suite."""

from collections.abc import Iterator, Mapping
from math import nan
from pathlib import Path
from typing import Any

from archfem._files import atomic_write
from archfem._validation import validate_arguments
from archfem.cases.case import Case
from archfem.cases.run import Run, run_case
from archfem.dynamics.history import Ending
from archfem.dynamics.verdict import MECHANISM_DEFINITIONS, PUBLISHED_DEFINITION
from archfem.errors import DidNotConverge, InvalidInput
from archfem.studies.comparison import Comparison, Finding, file_name, write_finding
from archfem.studies.evaluators import Evaluator, Findings
from archfem.studies.parameter_space import PAIR_KEY, Axis, Point
from archfem.studies.study import Study
from archfem.view.studies import draw_study
from archfem.view.style import save


def run_comparison(
    comparison: Comparison, folder: Path, *, workers: int | None = 1, client: Any = None
) -> Iterator[tuple[str, Finding]]:
    """Run the points of a comparison that are not stored yet; yield the findings of each case."""
    study = Study(comparison.title, comparison.evaluator, (comparison.axis,), comparison.points)
    table = study.run(folder, workers=workers, client=client)
    columns = {str(name): table[name].values.tolist() for name in table.data_vars}
    rows = {
        point: {name: values[number] for name, values in columns.items()}
        for number, point in enumerate(comparison.axis.rows)
    }
    for name, case in comparison.cases.items():
        rows_of_case = {pair: rows[name, pair] for pair in comparison.pairs_of(name)}
        for row in rows_of_case.values():
            if row["error"]:
                raise DidNotConverge(f"'{name}': {row['error'].partition(': ')[2]}")
        finding = _build_finding(case.text(), rows_of_case, comparison.scales)
        write_finding(finding, folder / f"{file_name(name)}.json")
        yield name, finding


def write_comparison(
    comparison: Comparison, findings: Mapping[str, Finding], text: str, folder: Path
) -> list[Path]:
    """Write the tables of a comparison, and a figure of the scales if they were searched."""
    files = [folder / "study.txt"]
    with atomic_write(files[0]) as draft:
        draft.write_text(f"{comparison.title}\n\n{text}\n", encoding="utf-8")
    if comparison.scales is not None:
        factors = {name: finding.factors for name, finding in findings.items()}
        page = draw_study(factors, comparison.reduction, comparison.title)
        files.append(save(page, folder / "study.png"))
    return files


def _build_finding(
    case: str, rows: Mapping[str, Mapping[str, Any]], search: dict[str, Any] | None
) -> Finding:
    """The findings of a case, from its rows by pair."""
    first = next(iter(rows.values()))  # dead load and mode are the same in all rows
    scales = {
        pair: {
            name: (row[f"scale: {name}"], row[f"survives: {name}"])
            for name in MECHANISM_DEFINITIONS
        }
        for pair, row in rows.items()
        if search is not None
    }
    runs = {pair: _run_findings(row) for pair, row in rows.items()}
    roles, dead = _select(first, "role"), _select(first, "dead")
    return Finding(case, first["frequency"], first["mass"], roles, dead, runs, scales, search)


def _run_findings(row: Mapping[str, Any]) -> dict[str, Any]:
    """The findings of one run, from its row."""
    kinds, times = _select(row, "mechanism"), _select(row, "time")
    return {
        "eccentricity": _select(row, "eccentricity"),
        "friction": _select(row, "friction"),
        "mechanisms": {
            name: {"kind": kinds[name], "time": times.get(name, nan)} if name in kinds else None
            for name in (*MECHANISM_DEFINITIONS, PUBLISHED_DEFINITION)
        },
        "fall": row["fall"] or None,
        "ended": row["ended"],
        "outcome": row["outcome"],
    }


def _select(row: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    """Values whose names have a prefix; NaN and "" stand for parts that only other cases have."""
    prefix = f"{prefix}: "
    return {
        name.removeprefix(prefix): value
        for name, value in row.items()
        if name.startswith(prefix) and value == value and value != ""
    }


@validate_arguments
def run_pairs(
    case: Case, folder: str | Path, *, workers: int | None = None, client: Any = None
) -> list[str]:
    """Run the pairs of a suite whose histories are not in the folder yet.

    `run_case(case, folder)` then loads them, and runs again those that are incomplete.

    Args:
        case: case with a suite.
        folder: folder of the histories.
        workers: number of processes, as for `Study.run`.
        client: as for `Study.run`; its workers must see the folder.

    Returns:
        How the run of each pair ended; the text of an error if there is no history.

    Raises:
        InvalidInput: the case has no suite, or selects its model by one pair for all.
    """
    if case.suite is None or case.selects_model:
        raise InvalidInput(
            "pairs run in parallel only if a case has a [suite] and names its model: "
            "model.fidelity = 'auto' selects one by the first pair for all"
        )
    pairs = tuple(case.suite["pairs"])
    points = tuple(Point(case.settings, case.folder, ((PAIR_KEY, pair),)) for pair in pairs)
    evaluator = Evaluator(save_pair, {"folder": str(Path(folder).resolve())})
    axis = Axis(PAIR_KEY, (PAIR_KEY,), tuple((pair,) for pair in pairs))
    table = Study(case.title, evaluator, (axis,), points).run(workers=workers, client=client)
    endings = table["ended"].values if "ended" in table else [""] * len(pairs)
    return [a or b for a, b in zip(table["error"].values.tolist(), endings, strict=True)]


def save_pair(case: Case, folder: str) -> Findings:
    """Run the only pair of a case, and save its history."""
    (run,) = (result for result in run_case(case, folder) if isinstance(result, Run))
    if run.history.ending is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    return {"ended": str(run.history.ending)}
