"""Cases side by side, carried out: what was found of each, a file for each, tables of all."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from archfem.dynamics.verdicts import DEFINITIONS, PUBLISHED
from archfem.errors import DidNotConverge
from archfem.files import in_one_stroke
from archfem.studies.comparison import Comparison, file_name
from archfem.studies.findings import Finding, write
from archfem.studies.study import Study
from archfem.view.studies import draw_study
from archfem.view.style import save


def compared(
    comparison: Comparison, folder: Path, *, workers: int | None = 1, client: Any = None
) -> Iterator[tuple[str, Finding]]:
    """Carry out a comparison; what an earlier command found is kept.

    Args:
        comparison: what to compare.
        folder: for the findings, as by `Study.run`, and a file of each case's.
        workers: as for `Study.run`.
        client: as for `Study.run`.

    Yields:
        Name of a case, and what was found of it.

    Raises:
        DidNotConverge: a case does not stand under dead load.
        KeyboardInterrupt: on Ctrl-C; what was found of whole pairs is kept.
    """
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
    """Write the tables of a comparison, and draw factors at first mechanism if it asks for them.

    Args:
        comparison: what was compared.
        findings: by name of the case.
        text: tables of them.
        folder: for the files.

    Returns:
        The files.
    """
    files = [folder / "study.txt"]
    with in_one_stroke(files[0]) as draft:
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
            for name in (*DEFINITIONS, PUBLISHED)
        },
        "fall": row["fall"] or None,
        "ended": row["ended"],
        "outcome": row["outcome"],
    }


def _scales(row: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    return {name: (row[f"scale: {name}"], row[f"survives: {name}"]) for name in DEFINITIONS}


def _parts(row: Mapping[str, Any], word: str, missing: Any = "") -> dict[str, Any]:
    """What was kept under a word, by the name behind it, without parts that only others have."""
    head = f"{word}: "
    return {
        name.removeprefix(head): value
        for name, value in row.items()
        if name.startswith(head) and (missing is None or (value == value and value != missing))
    }
