"""What a study finds of its cases: kept in files, set side by side in tables."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem.arrays import Array
from archfem.dynamics.falling.verdict import LOST
from archfem.dynamics.history import Ending
from archfem.dynamics.verdicts import DEFINITIONS, PUBLISHED
from archfem.files import in_one_stroke
from archfem.limit.counted import KINDS
from archfem.tables import aligned


@dataclass
class Finding:
    """What was found of one case.

    Attributes:
        case: the case as text.
        frequency: of the first mode about the dead load [Hz].
        mass: its share of the mass along x [-].
        roles: of the rings and piers, by part.
        dead: largest |e| of each of them under dead load [-].
        runs: by pair, the largest `eccentricity` and `friction` of each part [-], the first of the
            `mechanisms` by each definition, its kind and time [s], how the run `ended`, the same in
            words, `outcome`, and what it left, `fall`, where displacements may be large.
        scales: by pair and definition, the least factor found to fail and the largest below it
            found not to; infinite where none failed.
        search: options with which they were searched for; None where that was not kept.
    """

    case: str
    frequency: float
    mass: float
    roles: dict[str, str]
    dead: dict[str, float]
    runs: dict[str, dict[str, Any]] = field(default_factory=dict)
    scales: dict[str, dict[str, tuple[float, float]]] = field(default_factory=dict)
    search: dict[str, Any] | None = None

    def of_pairs(self, pairs: Sequence[str]) -> "Finding":
        """Return what was found under some of the pairs.

        Args:
            pairs: their names; those of which nothing is known are left out.
        """
        runs, scales = ({p: of[p] for p in pairs if p in of} for of in (self.runs, self.scales))
        return replace(self, runs=runs, scales=scales)

    def least(self, definition: str) -> Array:
        """Return the least factor that fails by a definition, of each pair (pairs,) [-].

        Args:
            definition: one of `DEFINITIONS`.
        """
        return np.array([found[definition][0] for found in self.scales.values()])

    @property
    def factors(self) -> dict[str, Array]:
        """`least` of each definition."""
        return {definition: self.least(definition) for definition in DEFINITIONS}


def by_part(values: xr.DataArray) -> dict[str, float]:
    """Return the largest value of each part's joints.

    Args:
        values: over joint, with the coordinate `part`.
    """
    largest = values.groupby("part").max()
    return dict(zip(largest["part"].values.tolist(), largest.values.tolist(), strict=True))


def write(finding: Finding, path: Path) -> None:
    """Write findings in one stroke.

    Args:
        finding: what was found of a case.
        path: the file, JSON.
    """
    with in_one_stroke(path) as draft:
        draft.write_text(json.dumps(asdict(finding), indent=1), encoding="utf-8")


def study_table(findings: Mapping[str, Finding]) -> str:
    """Return two tables, a line for each case.

    The first tells of the motions as each case applies them: the first mode, the gravest joint of
    rings and piers (its median over the pairs), in how many pairs each definition of a mechanism
    is met, in how many a mechanism of which class by the words of Demirel and Aldemir, and, where
    displacements may be large, in how many blocks fall; a run
    that broke off tells only of the time before, and is counted below. The second, where they were
    looked for, tells by what factor on the whole motions they begin: the median over the pairs, and
    their range.

    Args:
        findings: by name of the case.
    """
    head = ["case", "mode 1", "mass x", "|e| dead", "|e| rings", "|e| piers", *DEFINITIONS]
    head.append(PUBLISHED)
    falling = any(_falls(found) for found in findings.values())
    head += ["blocks fall"] if falling else []
    rows = []
    for name, found in findings.items():
        cells = [name, f"{found.frequency:.2f} Hz", f"{found.mass:.0%}"]
        cells.append(f"{max(found.dead.values()):.3f}")
        cells += [_largest(found, role) for role in ("ring", "pier")]
        for definition in DEFINITIONS:
            met = [run["mechanisms"][definition] is not None for run in found.runs.values()]
            cells.append(f"{sum(met)} of {len(met)}")
        rows.append([*cells, _classes(found), *([_falls(found) or "-"] if falling else [])])
    tables = [aligned(head, rows), *_broken(findings)]
    if any(found.scales for found in findings.values()):
        rows = [
            [name, *(_range(found.least(definition)) for definition in DEFINITIONS)]
            for name, found in findings.items()
        ]
        tables.append(aligned(["factor at first mechanism", *DEFINITIONS], rows))
    return "\n\n".join(tables)


def _classes(finding: Finding) -> str:
    """In how many pairs a mechanism of each class is met, by the words of Demirel and Aldemir."""
    met = [
        found["kind"] for run in finding.runs.values() if (found := run["mechanisms"][PUBLISHED])
    ]
    return ", ".join(f"{met.count(kind)} {kind}" for kind in KINDS if kind in met) or "none"


def _falls(finding: Finding) -> str:
    """In how many pairs blocks fall; empty where displacements were taken as small."""
    known = [kind for run in finding.runs.values() if (kind := run.get("fall")) is not None]
    return f"{sum(kind in LOST for kind in known)} of {len(known)}" if known else ""


def _broken(findings: Mapping[str, Finding]) -> list[str]:
    """A line for each case with runs that broke off, as one text or none."""
    lines = []
    for name, finding in findings.items():
        failed = [run["ended"] == Ending.FAILED for run in finding.runs.values()]
        if any(failed):
            lines.append(f"{name}: {sum(failed)} of {len(failed)} runs broke off")
    return ["\n".join(lines)] if lines else []


def _largest(finding: Finding, role: str) -> str:
    """Median over the pairs of the largest |e| in all rings, or in all piers."""
    each = [
        max(
            (e for part, e in run["eccentricity"].items() if finding.roles[part] == role),
            default=None,
        )
        for run in finding.runs.values()
    ]
    known = [e for e in each if e is not None]
    return f"{np.median(known):.3f}" if known else "-"


def _range(factors: Array) -> str:
    """Median and range of factors; a dash where there is none up to the largest that was tried."""
    if not len(factors) or np.isinf(factors).all():
        return "-"
    low, middle, high = np.quantile(factors, [0.0, 0.5, 1.0], method="nearest")
    return f"{_factor(middle)} ({_factor(low)} to {_factor(high)})"


def _factor(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "-"
