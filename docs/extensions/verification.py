"""The table of what tests verify, from `docs/verification.json` to Markdown."""

import json
from itertools import groupby
from pathlib import Path

from rooms import keep
from sphinx.application import Sphinx


def number(value: object) -> str:
    """A number, a row of numbers, or words, as a cell shows them."""
    if isinstance(value, list):
        return ", ".join(number(each) for each in value)
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def difference(row: dict[str, object]) -> str:
    """A difference as a cell shows it: a bound where it is round-off."""
    value = row["difference"]
    if value is None:
        return ""
    return f"< {value:.0e}" if value in {1e-6, 1e-9, 1e-12} else f"{value:.2g}"


def lines(rows: list[dict[str, object]]) -> list[str]:
    """The table, under a heading for each file of tests."""
    told: list[str] = []
    for (test, of), group in groupby(rows, key=lambda row: (row["test"], row["of"])):
        told += ["", f"**{str(of).rstrip('.')}** (`{test}`)", ""]
        told += ["| case | reference | source | computed | difference |", "|---|---|---|---|---|"]
        for row in group:
            case = row["case"] + (f" ({row['times']} cases)" if row["times"] != 1 else "")
            cells = [case, number(row["reference"]), row["source"], number(row["computed"])]
            safe = [str(cell).replace("|", "\\|") for cell in [*cells, difference(row)]]
            told.append(f"| {' | '.join(safe)} |")
    return told


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the table where the page includes it from."""
    folder = Path(app.srcdir)
    (folder / "made").mkdir(exist_ok=True)
    rows = json.loads((folder / "verification.json").read_text(encoding="utf-8"))
    keep(folder / "made" / "verification.md", [*lines(rows), ""])
    return {"parallel_read_safe": True}
