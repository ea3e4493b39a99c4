"""Cases side by side, carried out: what was found of each, a file for each, tables of all.

Pairs of a suite on processes, their histories kept where `carried_out` keeps them.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from archfem._files import atomic_write
from archfem.cases.case import Case
from archfem.cases.run import Run, run_case
from archfem.dynamics.history import Ending
from archfem.dynamics.verdict import MECHANISM_DEFINITIONS, PUBLISHED_DEFINITION
from archfem.errors import DidNotConverge, InvalidInput
from archfem.studies.comparison import Comparison, Finding, file_name, write
from archfem.studies.evaluators import Evaluator, Findings
from archfem.studies.parameter_space import PAIR, Axis, Point
from archfem.studies.study import Study
from archfem.view.studies import draw_study
from archfem.view.style import save


def compared(
    comparison: Comparison, folder: Path, *, workers: int | None = 1, client: Any = None
) -> Iterator[tuple[str, Finding]]:
    """Carry out a comparison; what an earlier command found is kept."""
    study = Study(comparison.title, comparison.asked, (comparison.axis,), comparison.points)
    table = study.run(folder, workers=workers, client=client)
    found = {str(name): table[name].values.tolist() for name in table.data_vars}
    rows = {
        place: {name: values[number] for name, values in found.items()}
        for number, place in enumerate(comparison.axis.rows)
    }
    for name, case in comparison.cases.items():
        own = {pair: rows[name, pair] for pair in comparison.wanted(name)}
        for row in own.values():
            if row["error"]:
                raise DidNotConverge(f"'{name}': {row['error'].partition(': ')[2]}")
        finding = _finding(case.text(), own, comparison.scales)
        write(finding, folder / f"{file_name(name)}.json")
        yield name, finding


def write_comparison(
    comparison: Comparison, findings: Mapping[str, Finding], text: str, folder: Path
) -> list[Path]:
    """Write the tables of a comparison, and draw factors at first mechanism if it asks for them."""
    files = [folder / "study.txt"]
    with atomic_write(files[0]) as draft:
        draft.write_text(f"{comparison.title}\n\n{text}\n", encoding="utf-8")
    if comparison.scales is not None:
        factors = {name: each.factors for name, each in findings.items()}
        page = draw_study(factors, comparison.reduction, comparison.title)
        files.append(save(page, folder / "study.png"))
    return files


def _finding(
    case: str, rows: Mapping[str, Mapping[str, Any]], search: dict[str, Any] | None
) -> Finding:
    """What was found of a case, from its rows by pair."""
    first = next(iter(rows.values()))
    return Finding(
        case,
        first["frequency"],
        first["mass"],
        _parts(first, "role"),
        _parts(first, "dead"),
        {pair: _run(row) for pair, row in rows.items()},
        {} if search is None else {pair: _scales(row) for pair, row in rows.items()},
        search,
    )


def _run(row: Mapping[str, Any]) -> dict[str, Any]:
    """What was kept of a run."""
    kinds, times = (_parts(row, word, missing=None) for word in ("mechanism", "time"))
    return {
        "eccentricity": _parts(row, "eccentricity"),
        "friction": _parts(row, "friction"),
        "mechanisms": {
            name: {"kind": kinds[name], "time": times[name]} if kinds[name] else None
            for name in (*MECHANISM_DEFINITIONS, PUBLISHED_DEFINITION)
        },
        "fall": row["fall"] or None,
        "ended": row["ended"],
        "outcome": row["outcome"],
    }


def _scales(row: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    return {
        name: (row[f"scale: {name}"], row[f"survives: {name}"]) for name in MECHANISM_DEFINITIONS
    }


def _parts(row: Mapping[str, Any], word: str, missing: Any = "") -> dict[str, Any]:
    """What was kept under a word, by the name behind it, without parts that only others have."""
    head = f"{word}: "
    return {
        name.removeprefix(head): value
        for name, value in row.items()
        if name.startswith(head) and (missing is None or (value == value and value != missing))
    }


def run_pairs(
    case: Case, folder: str | Path, *, workers: int | None = None, client: Any = None
) -> list[str]:
    """Run the pairs of a case's suite of which no history is kept yet.

    `carried_out(case, folder)` then finds them, and runs again what broke off.

    Args:
        case: with a suite.
        folder: for the histories.
        workers: as for `Study.run`.
        client: as for `Study.run`, of workers that see the folder.

    Returns:
        How each pair ended; the words of an error where it has no history.

    Raises:
        InvalidInput: the case has no suite, or chooses its model by one pair for all.
    """
    if case.suite is None or case.selects_model:
        raise InvalidInput(
            "pairs run side by side where a case has a [suite], and names its model: "
            "model.fidelity = 'auto' chooses one by the first pair for all"
        )
    pairs = tuple(case.suite["pairs"])
    points = tuple(Point(case.settings, case.folder, ((PAIR, pair),)) for pair in pairs)
    asked = Evaluator(pair_kept, {"folder": str(Path(folder).resolve())})
    study = Study(case.title, asked, (Axis(PAIR, (PAIR,), tuple((p,) for p in pairs)),), points)
    found = study.run(workers=workers, client=client)
    ended = found["ended"].values if "ended" in found else [""] * len(pairs)
    return [a or b for a, b in zip(found["error"].values.tolist(), ended, strict=True)]


def pair_kept(case: Case, folder: str) -> Findings:
    """Run the only pair of a case, and keep its history."""
    (run,) = (each for each in run_case(case, folder) if isinstance(each, Run))
    if run.history.ending is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    return {"ended": str(run.history.ending)}
