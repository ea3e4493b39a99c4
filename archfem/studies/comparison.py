"""Comparison of several cases under the motions of their suites: findings and their tables."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._files import align_columns, atomic_write
from archfem._typing import Array
from archfem._validation import validate_arguments, validate_methods
from archfem.cases.case import Case
from archfem.cases.toml_file import check_table
from archfem.dynamics.collapse_state import FALLEN_STATES
from archfem.dynamics.history import Ending
from archfem.dynamics.verdict import ALL_DEFINITIONS, MECHANISM_DEFINITIONS, PUBLISHED_DEFINITION
from archfem.errors import InvalidInput
from archfem.limit.mechanism_count import MECHANISM_KINDS
from archfem.studies.parameter_space import PAIR_KEY, Point


@validate_methods
@dataclass
class Finding:
    """Findings of one case of a comparison.

    Attributes:
        case: case as TOML text.
        frequency: frequency of the first mode about the dead load [Hz].
        mass: mass ratio of this mode along x [-].
        roles: roles, "ring" or "pier", by part.
        dead: largest |e| under dead load by part [-].
        runs: by pair the largest `eccentricity` and `friction` of each part [-]; the kind and time
            [s] of the first of the `mechanisms` by definition; the end of the run, `ended`, and as
            a sentence, `outcome`; and for large displacements the state after a collapse, `fall`.
        scales: by pair and definition the smallest failing scale and the largest scale below it
            that survives [-]; infinite if none fails.
        search: options of the search for scales; None without a search.
    """

    case: str
    frequency: float
    mass: float
    roles: dict[str, str]
    dead: dict[str, float]
    runs: dict[str, dict[str, Any]] = field(default_factory=dict)
    scales: dict[str, dict[str, tuple[float, float]]] = field(default_factory=dict)
    search: dict[str, Any] | None = None

    def least(self, definition: str) -> Array:
        """Return the smallest failing scale of each pair (pairs,) [-].

        Args:
            definition: definition of a mechanism, one of `MECHANISM_DEFINITIONS`.
        """
        return np.array([scales[definition][0] for scales in self.scales.values()])

    @property
    def factors(self) -> dict[str, Array]:
        """Smallest failing scale of each pair (pairs,) [-], for each definition of a mechanism."""
        return {definition: self.least(definition) for definition in MECHANISM_DEFINITIONS}


def write_finding(finding: Finding, path: Path) -> None:
    """Write the findings of a case as JSON."""
    with atomic_write(path) as draft:
        draft.write_text(json.dumps(asdict(finding), indent=1), encoding="utf-8")


@validate_arguments
def study_table(findings: Mapping[str, Finding]) -> str:
    """Return two tables with a line for each case.

    The first table is for the motions as the cases apply them. It has the first mode, the largest
    |e| of rings and piers (median over the pairs), and the number of pairs with a mechanism.
    Mechanisms are counted by definition and by the classes of Demirel and Aldemir. For large
    displacements it has the number of pairs in which blocks fall. Incomplete runs count with their
    part before the failure and are listed below. The second table exists if scales were searched.
    It has the median and range over the pairs of the scale of the whole motion at the first
    mechanism.

    Args:
        findings: findings by name of the case.
    """
    head = ["case", "mode 1", "mass x", "|e| dead", "|e| rings", "|e| piers"]
    head += ALL_DEFINITIONS
    falls = [_falls_text(finding) for finding in findings.values()]
    rows = []
    for name, finding in findings.items():
        cells = [name, f"{finding.frequency:.2f} Hz", f"{finding.mass:.0%}"]
        cells.append(f"{max(finding.dead.values()):.3f}")
        cells += [_median_eccentricity(finding, role) for role in ("ring", "pier")]
        for definition in MECHANISM_DEFINITIONS:
            occurs = [run["mechanisms"][definition] is not None for run in finding.runs.values()]
            cells.append(f"{sum(occurs)} of {len(occurs)}")
        rows.append([*cells, _classes_text(finding)])
    if any(falls):
        head.append("blocks fall")
        rows = [[*row, text or "-"] for row, text in zip(rows, falls, strict=True)]
    tables = [align_columns(head, rows), *_incomplete_runs(findings)]
    if any(finding.scales for finding in findings.values()):
        rows = [[name, *map(_range_text, each.factors.values())] for name, each in findings.items()]
        tables.append(align_columns(["factor at first mechanism", *MECHANISM_DEFINITIONS], rows))
    return "\n\n".join(tables)


def _classes_text(finding: Finding) -> str:
    """Number of pairs with a mechanism of each class of Demirel and Aldemir."""
    mechanisms = [run["mechanisms"][PUBLISHED_DEFINITION] for run in finding.runs.values()]
    kinds = [mechanism["kind"] for mechanism in mechanisms if mechanism]
    counts = [f"{kinds.count(kind)} {kind}" for kind in MECHANISM_KINDS if kind in kinds]
    return ", ".join(counts) or "none"


def _falls_text(finding: Finding) -> str:
    """Number of pairs in which blocks fall; empty for small displacements."""
    states = [state for run in finding.runs.values() if (state := run.get("fall")) is not None]
    return f"{sum(state in FALLEN_STATES for state in states)} of {len(states)}" if states else ""


def _incomplete_runs(findings: Mapping[str, Finding]) -> list[str]:
    """A text with a line for each case with incomplete runs; no text if there are none."""
    ends = {name: [run["ended"] for run in each.runs.values()] for name, each in findings.items()}
    failed = {name: own.count(Ending.FAILED) for name, own in ends.items()}
    lines = [f"{k}: {failed[k]} of {len(ends[k])} runs broke off" for k in ends if failed[k]]
    return ["\n".join(lines)] * bool(lines)


def _median_eccentricity(finding: Finding, role: str) -> str:
    """Median over the pairs of the largest |e| of all rings, or of all piers."""
    parts = [part for part, each in finding.roles.items() if each == role]
    by_pair = [
        [run["eccentricity"][part] for part in parts if part in run["eccentricity"]]
        for run in finding.runs.values()
    ]
    largest = [max(values) for values in by_pair if values]
    return f"{np.median(largest):.3f}" if largest else "-"


def _range_text(scales: Array) -> str:
    """Median and range of scales; a dash if none failed up to the largest that was tried."""
    if not len(scales) or np.isinf(scales).all():
        return "-"
    quantiles = np.quantile(scales, [0.5, 0.0, 1.0], method="nearest")
    middle, low, high = (f"{q:.2f}" if np.isfinite(q) else "-" for q in quantiles)
    return f"{middle} ({low} to {high})"


def build_findings(
    labels: Sequence[str], points: Sequence[Point], table: xr.Dataset, search: dict[str, Any] | None
) -> dict[str, Finding]:
    """Return the findings of a comparison by label, without those of which a point failed."""
    cases: dict[str, Case] = {}
    for label, point in zip(labels, points, strict=True):
        changes = tuple(change for change in point.changes if change[0] != PAIR_KEY)
        cases.setdefault(label, replace(point, changes=changes).case)
    return {
        label: _build_finding(cases[label].text(), by_pair, search)
        for label, by_pair in rows_by_label(labels, points, table).items()
        if cases[label].suite is not None
    }


def rows_by_label(
    labels: Sequence[str], points: Sequence[Point], table: xr.Dataset
) -> dict[str, dict[str, dict[str, Any]]]:
    """Return the rows of a comparison by label and pair, without labels with a failed point."""
    columns = {str(name): table[name].values.ravel().tolist() for name in table.data_vars}
    rows: dict[str, dict[str, dict[str, Any]]] = {}
    for number, (label, point) in enumerate(zip(labels, points, strict=True)):
        pair = str(dict(point.changes).get(PAIR_KEY, ""))
        rows.setdefault(label, {})[pair] = {name: each[number] for name, each in columns.items()}
    return {
        label: by_pair
        for label, by_pair in rows.items()
        if not any(row["error"] for row in by_pair.values())
    }


def _build_finding(
    case: str, rows: Mapping[str, Mapping[str, Any]], search: dict[str, Any] | None
) -> Finding:
    """The findings of a case, from its rows by pair."""
    first = next(iter(rows.values()))  # dead load and mode are the same in all rows
    searched, names = {} if search is None else rows, MECHANISM_DEFINITIONS
    scales = {
        pair: {name: (row[f"scale: {name}"], row[f"survives: {name}"]) for name in names}
        for pair, row in searched.items()
    }
    runs = {pair: _run_findings(row) for pair, row in rows.items()}
    roles, dead = _select(first, "role"), _select(first, "dead")
    return Finding(case, first["frequency"], first["mass"], roles, dead, runs, scales, search)


def _run_findings(row: Mapping[str, Any]) -> dict[str, Any]:
    """The findings of one run, from its row."""
    kinds, times = _select(row, "mechanism"), _select(row, "time")
    mechanisms = {
        name: {"kind": kinds[name], "time": times.get(name, nan)} if name in kinds else None
        for name in ALL_DEFINITIONS
    }
    sizes = {name: _select(row, name) for name in ("eccentricity", "friction")}
    end = {"fall": row["fall"] or None, "ended": row["ended"], "outcome": row["outcome"]}
    return {**sizes, "mechanisms": mechanisms, **end}


def _select(row: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    """Values whose names have a prefix; NaN and "" stand for parts that only other cases have."""
    prefix = f"{prefix}: "
    return {
        name.removeprefix(prefix): value
        for name, value in row.items()
        if name.startswith(prefix) and value == value and value != ""
    }


def parse_search(setting: Any) -> dict[str, Any] | None:
    """Options of the search for scales; None for no search."""
    if isinstance(setting, bool):
        return {} if setting else None
    options = check_table(setting, {"precision": "1", "range": ["1"]}, "scales")
    if "range" in options:
        if len(options["range"]) != 2:
            raise InvalidInput(f"scales.range = {options['range']}: give the least and the largest")
        options["between"] = options.pop("range")  # keyword of `mechanism_scales`
    return options


def file_name(name: str) -> str:
    """Return a file name for the name of a case."""
    return re.sub(r"[^\w+-]+", "_", name).strip("_")
