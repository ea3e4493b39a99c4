"""The verification table, from `docs/verification.json` to Markdown."""

import json
from itertools import groupby
from pathlib import Path

from rooms import keep
from sphinx.application import Sphinx


def number(value: object) -> str:
    """Format a number, a list of numbers, or text for a cell."""
    if isinstance(value, list):
        return ", ".join(number(each) for each in value)
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def difference(row: dict[str, object]) -> str:
    """Format a difference for a cell: as a bound where it is round-off."""
    value = row["difference"]
    if value is None:
        return ""
    return f"< {value:.0e}" if value in {1e-6, 1e-9, 1e-12} else f"{value:.2g}"


def lines(rows: list[dict[str, object]]) -> list[str]:
    """Return the table, with a heading for each test file."""
    text: list[str] = []
    for (test, of), group in groupby(rows, key=lambda row: (row["test"], row["of"])):
        text += ["", f"**{str(of).rstrip('.')}** (`{test}`)", ""]
        text += ["| case | reference | source | computed | difference |", "|---|---|---|---|---|"]
        for row in group:
            case = row["case"] + (f" ({row['times']} cases)" if row["times"] != 1 else "")
            cells = [case, number(row["reference"]), row["source"], number(row["computed"])]
            safe = [str(cell).replace("|", "\\|") for cell in [*cells, difference(row)]]
            text.append(f"| {' | '.join(safe)} |")
    return text


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the table to the file that the page includes."""
    folder = Path(app.srcdir)
    (folder / "made").mkdir(exist_ok=True)
    rows = json.loads((folder / "verification.json").read_text(encoding="utf-8"))
    keep(folder / "made" / "verification.md", [*lines(rows), ""])
    return {"parallel_read_safe": True}
