"""Comparison of several cases under the motions of their suites: definition and tables."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._files import align_columns, atomic_write
from archfem._typing import Array
from archfem._validation import validate_arguments, validate_methods
from archfem.cases.case import Case
from archfem.cases.toml_file import check_table, read_tables, refuse_unknown
from archfem.dynamics.fall import FALLEN_STATES
from archfem.dynamics.history import (
    Ending,
    History,
    first_mechanisms,
    partial_history,
)
from archfem.dynamics.verdict import MECHANISM_DEFINITIONS, PUBLISHED_DEFINITION
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import assessed_joints, part_roles
from archfem.limit.mechanism_count import MECHANISM_KINDS
from archfem.studies.cache import dead_load_of, first_mode, ground_motion, ground_suite
from archfem.studies.evaluators import Evaluator, Findings, run_motion, scales_of
from archfem.studies.parameter_space import PAIR_KEY, Axis, Point


def read_study_tables(path: Path) -> dict[str, Any]:
    """Read the TOML tables of a study file."""
    return read_tables(path, "study")


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
        runs: by pair the largest `eccentricity` and `friction` of each part [-], the kind and time
            [s] of the first of the `mechanisms` by definition, how the run `ended`, this as a
            sentence, `outcome`, and the state after a collapse, `fall`, for large displacements.
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


def largest_by_part(values: xr.DataArray) -> dict[str, float]:
    """Return the largest value over the joints of each part."""
    largest = values.groupby("part").max()
    return dict(zip(largest["part"].values.tolist(), largest.values.tolist(), strict=True))


def write_finding(finding: Finding, path: Path) -> None:
    """Write the findings of a case as JSON."""
    with atomic_write(path) as draft:
        draft.write_text(json.dumps(asdict(finding), indent=1), encoding="utf-8")


@validate_arguments
def study_table(findings: Mapping[str, Finding]) -> str:
    """Return two tables with a line for each case.

    The first table is for the motions as the cases apply them. It has the first mode, the largest
    |e| of rings and piers (median over the pairs), and the number of pairs with a mechanism, by
    definition and by the classes of Demirel and Aldemir. For large displacements it has the number
    of pairs in which blocks fall. Incomplete runs count with their part before the failure and are
    listed below. The second table, if scales were searched, has the median and range over the pairs
    of the scale of the whole motion at the first mechanism.

    Args:
        findings: findings by name of the case.
    """
    head = ["case", "mode 1", "mass x", "|e| dead", "|e| rings", "|e| piers"]
    head += [*MECHANISM_DEFINITIONS, PUBLISHED_DEFINITION]
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
        rows = [
            [name, *(_range_text(finding.least(kind)) for kind in MECHANISM_DEFINITIONS)]
            for name, finding in findings.items()
        ]
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
    lines = []
    for name, finding in findings.items():
        failed = [run["ended"] == Ending.FAILED for run in finding.runs.values()]
        if any(failed):
            lines.append(f"{name}: {sum(failed)} of {len(failed)} runs broke off")
    return ["\n".join(lines)] if lines else []


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


@validate_methods
@dataclass(frozen=True)
class Comparison:
    """Cases to compare, each under the motions of its suite.

    Attributes:
        title: title.
        cases: cases by name.
        pairs: pairs of the suites that are run; None for all.
        scales: options of `mechanism_scales`, which searches the scales of the whole motions at the
            first mechanisms; None for no search.
    """

    title: str
    cases: dict[str, Case]
    pairs: tuple[str, ...] | None = None
    scales: dict[str, Any] | None = None

    @property
    def reduction(self) -> float:
        """Factor R of the first case's suite [-]."""
        suite = next(iter(self.cases.values())).suite or {}
        return float(suite.get("reduction", 1.0) / suite.get("scale", 1.0))

    @property
    def evaluator(self) -> Evaluator:
        """The function that is evaluated for each case under each pair."""
        return Evaluator(evaluate_comparison, {"scales": self.scales})

    @cached_property
    def axis(self) -> Axis:
        """Names of case and pair of each point.

        Raises:
            InvalidInput: a case has none of the pairs.
        """
        rows = [(name, pair) for name in self.cases for pair in self.pairs_of(name)]
        return Axis("point", ("case", "pair"), tuple(rows))

    @property
    def points(self) -> tuple[Point, ...]:
        """Each case under each of its pairs."""
        return tuple(
            Point(self.cases[name].settings, self.cases[name].folder, ((PAIR_KEY, pair),))
            for name, pair in self.axis.rows
        )

    def pairs_of(self, name: str) -> list[str]:
        """Return the pairs under which a case is run.

        Args:
            name: name of the case.

        Raises:
            InvalidInput: the case has none of the pairs.
        """
        suite = self.cases[name].suite or {}
        pairs = [pair for pair in suite["pairs"] if self.pairs is None or pair in self.pairs]
        if not pairs:
            raise InvalidInput(
                f"'{name}' has none of the pairs {self.pairs}, but {list(suite['pairs'])}"
            )
        return pairs

    @classmethod
    def read(cls, path: str | Path, changes: Sequence[str] = ()) -> "Comparison":
        """Read a comparison from a TOML file that names case files and changes to them.

        Args:
            path: path of a file with tables [cases."name"] of `case`, a file, and `set`, a list of
                "section.key=value". `set` above the tables changes all cases, before their own.
            changes: changes to every case, "section.key=value".

        Returns:
            The comparison.

        Raises:
            InvalidInput: the file or one of its cases is invalid.
        """
        path = Path(path)
        settings = read_study_tables(path)
        kinds = {"title": str, "scales": (bool, dict), "pairs": [str], "set": [str], "cases": dict}
        refuse_unknown(settings, kinds)
        settings, cases = check_table(settings, kinds, "study"), {}
        for name, table in settings.get("cases", {}).items():
            case = check_table(table, {"case": str, "set": [str]}, f"cases.{name}")
            if "case" not in case:
                raise InvalidInput(f"{path}: cases.{name} names no case file")
            all_changes = [*settings.get("set", []), *case.get("set", []), *changes]
            cases[name] = Case.read(path.parent / case["case"], all_changes)
            if cases[name].suite is None:
                raise InvalidInput(f"{path}: the case of '{name}' has no [suite] to compare under")
        if not cases:
            raise InvalidInput(f'{path} has no cases: write [cases."name"] with case = "file.toml"')
        pairs = settings.get("pairs")
        _check_names(path, cases, pairs or ())
        return cls(
            settings.get("title", path.stem),
            cases,
            None if pairs is None else tuple(pairs),
            _parse_search(settings.get("scales", False)),
        )


def evaluate_comparison(case: Case, scales: Mapping[str, Any] | None = None) -> Findings:
    """Return the findings of a case under the one pair of its suite."""
    result, motion = dead_load_of(case), ground_motion(case)
    joints, first = assessed_joints(result.dead.joints), first_mode(result)
    findings: Findings = {
        "frequency": float(first.frequencies[0]),
        "mass": float(first.mass_ratios[0, 0]),
        **_prefix("role", part_roles(joints)),
        **_prefix("dead", largest_by_part(abs(joints["eccentricity"]).fillna(0.5))),
    }
    try:
        run = run_motion(result, motion)
    except DidNotConverge as error:
        run = partial_history(error)
    findings |= findings_of_run(run)
    if scales is not None:
        suite = ground_suite(case)
        # the whole motion: the reduction R of the suite is not applied
        bounds = scales_of(result, suite.pairs[0].scaled(suite.scale), **scales)
        for name, scale in bounds.items():
            definition, survives, _ = name.partition(", survives")
            findings[f"{'survives' if survives else 'scale'}: {definition}"] = scale
    return findings


def findings_of_run(run: History) -> Findings:
    """Return the findings of a run, which may be incomplete."""
    joints, mechanisms = assessed_joints(run.joints), first_mechanisms(run)
    eccentricity = abs(joints["eccentricity"]).max("time").fillna(0.5)
    friction = joints["friction"].max("time").fillna(np.inf)
    return {
        **_prefix("eccentricity", largest_by_part(eccentricity)),
        **_prefix("friction", largest_by_part(friction)),
        **_prefix("mechanism", {name: str(m.kind) if m else "" for name, m in mechanisms.items()}),
        **_prefix("time", {name: m.time if m else np.inf for name, m in mechanisms.items()}),
        "fall": "" if run.fall is None else run.fall.kind,
        "ended": str(run.ending),
        "outcome": run.outcome,
    }


def _prefix(prefix: str, values: Mapping[str, Any]) -> Findings:
    """Prepend a prefix to the names of findings."""
    return {f"{prefix}: {name}": value for name, value in values.items()}


def _parse_search(setting: Any) -> dict[str, Any] | None:
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


def _check_names(path: Path, cases: Mapping[str, Case], pairs: Sequence[str]) -> None:
    """Refuse cases that would share a file of findings, and pairs that no case has."""
    files = [file_name(name) for name in cases]
    for name, file in zip(cases, files, strict=True):
        if not file or files.count(file) > 1:
            raise InvalidInput(
                f"{path}: '{name}' names a file of results too, and '{file}.json' is not its own: "
                "let names differ in letters and digits"
            )
    available = {pair for case in cases.values() for pair in (case.suite or {})["pairs"]}
    if unknown := [pair for pair in pairs if pair not in available]:
        raise InvalidInput(f"{path}: no case has the pairs {unknown}, but {sorted(available)}")
