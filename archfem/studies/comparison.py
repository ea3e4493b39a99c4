"""Several cases side by side: what a measure buys, what an assumption decides.

What a study finds of its cases: kept in files, set side by side in tables.

A study's file as tables.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._files import align_columns, atomic_write
from archfem._typing import Array
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
from archfem.studies.evaluators import Evaluator, Findings, of_scales, run_motion
from archfem.studies.parameter_space import PAIR, Axis, Point


def study_tables(path: Path) -> dict[str, Any]:
    """Return the tables of a study's file."""
    return read_tables(path, "study")


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
            definition: one of `MECHANISM_DEFINITIONS`.
        """
        return np.array([found[definition][0] for found in self.scales.values()])

    @property
    def factors(self) -> dict[str, Array]:
        """`least` of each definition."""
        return {definition: self.least(definition) for definition in MECHANISM_DEFINITIONS}


def by_part(values: xr.DataArray) -> dict[str, float]:
    """Return the largest value of each part's joints."""
    largest = values.groupby("part").max()
    return dict(zip(largest["part"].values.tolist(), largest.values.tolist(), strict=True))


def write(finding: Finding, path: Path) -> None:
    """Write findings in one stroke."""
    with atomic_write(path) as draft:
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
    head = [
        "case",
        "mode 1",
        "mass x",
        "|e| dead",
        "|e| rings",
        "|e| piers",
        *MECHANISM_DEFINITIONS,
    ]
    head.append(PUBLISHED_DEFINITION)
    falling = any(_falls(found) for found in findings.values())
    head += ["blocks fall"] if falling else []
    rows = []
    for name, found in findings.items():
        cells = [name, f"{found.frequency:.2f} Hz", f"{found.mass:.0%}"]
        cells.append(f"{max(found.dead.values()):.3f}")
        cells += [_largest(found, role) for role in ("ring", "pier")]
        for definition in MECHANISM_DEFINITIONS:
            met = [run["mechanisms"][definition] is not None for run in found.runs.values()]
            cells.append(f"{sum(met)} of {len(met)}")
        rows.append([*cells, _classes(found), *([_falls(found) or "-"] if falling else [])])
    tables = [align_columns(head, rows), *_broken(findings)]
    if any(found.scales for found in findings.values()):
        rows = [
            [name, *(_range(found.least(definition)) for definition in MECHANISM_DEFINITIONS)]
            for name, found in findings.items()
        ]
        tables.append(align_columns(["factor at first mechanism", *MECHANISM_DEFINITIONS], rows))
    return "\n\n".join(tables)


def _classes(finding: Finding) -> str:
    """In how many pairs a mechanism of each class is met, by the words of Demirel and Aldemir."""
    met = [
        found["kind"]
        for run in finding.runs.values()
        if (found := run["mechanisms"][PUBLISHED_DEFINITION])
    ]
    return (
        ", ".join(f"{met.count(kind)} {kind}" for kind in MECHANISM_KINDS if kind in met) or "none"
    )


def _falls(finding: Finding) -> str:
    """In how many pairs blocks fall; empty where displacements were taken as small."""
    known = [kind for run in finding.runs.values() if (kind := run.get("fall")) is not None]
    return f"{sum(kind in FALLEN_STATES for kind in known)} of {len(known)}" if known else ""


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


CASE = {"case": str, "set": [str]}
SCALES = {"precision": "1", "range": ["1"]}
STUDY = {"title": str, "scales": (bool, dict), "pairs": [str], "set": [str], "cases": dict}


@dataclass(frozen=True)
class Comparison:
    """Cases to compare, each under the motions of its suite.

    Attributes:
        title: in words.
        cases: by the name of each.
        pairs: pairs of the suites that are run; None for all.
        scales: options of `mechanism_scales`, which finds the factors on the whole motions at
            which mechanisms begin; None finds none.
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
    def asked(self) -> Evaluator:
        """What is asked of each case under each pair."""
        return Evaluator(evaluate_comparison, {"scales": self.scales})

    @cached_property
    def axis(self) -> Axis:
        """Names of cases and pairs, point by point.

        Raises:
            InvalidInput: a case has none of the pairs asked for.
        """
        rows = [(name, pair) for name in self.cases for pair in self.wanted(name)]
        return Axis("point", ("case", "pair"), tuple(rows))

    @property
    def points(self) -> tuple[Point, ...]:
        """Each case under each of its pairs."""
        return tuple(
            Point(self.cases[name].settings, self.cases[name].folder, ((PAIR, pair),))
            for name, pair in self.axis.rows
        )

    def wanted(self, name: str) -> list[str]:
        """Return the pairs of a case that are asked for.

        Args:
            name: of the case.

        Raises:
            InvalidInput: it has none of them.
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
        """Read a comparison: a TOML file that names case files and changes to them.

        Args:
            path: with a table [cases."name"] for each, of `case`, a file, and `set`, a list of
                "section.key=value"; `set` above the tables changes all cases, before their own.
            changes: made to every case.

        Returns:
            The comparison.

        Raises:
            InvalidInput: the file or one of its cases cannot be meant.
        """
        path = Path(path)
        given = study_tables(path)
        refuse_unknown(given, STUDY)
        given, cases = check_table(given, STUDY, "study"), {}
        for name, table in given.get("cases", {}).items():
            own = check_table(table, CASE, f"cases.{name}")
            if "case" not in own:
                raise InvalidInput(f"{path}: cases.{name} names no case file")
            both = [*given.get("set", []), *own.get("set", []), *changes]
            cases[name] = Case.read(path.parent / own["case"], both)
            if cases[name].suite is None:
                raise InvalidInput(f"{path}: the case of '{name}' has no [suite] to compare under")
        if not cases:
            raise InvalidInput(f'{path} has no cases: write [cases."name"] with case = "file.toml"')
        pairs = given.get("pairs")
        _check_names(path, cases, pairs or ())
        return cls(
            given.get("title", path.stem),
            cases,
            None if pairs is None else tuple(pairs),
            _search(given.get("scales", False)),
        )


def evaluate_comparison(case: Case, scales: Mapping[str, Any] | None = None) -> Findings:
    """Return what is set side by side of a case under the one pair of its suite."""
    rest, motion = dead_load_of(case), ground_motion(case)
    joints, first = assessed_joints(rest.dead.joints), first_mode(rest)
    found: Findings = {
        "frequency": float(first.frequencies[0]),
        "mass": float(first.mass_ratios[0, 0]),
        **_each("role", part_roles(joints)),
        **_each("dead", by_part(abs(joints["eccentricity"]).fillna(0.5))),
    }
    try:
        run = run_motion(rest, motion)
    except DidNotConverge as error:
        run = partial_history(error)
    found |= of_run(run)
    if scales is not None:
        suite = ground_suite(case)
        factors = of_scales(rest, suite.pairs[0].scaled(suite.scale), **scales)
        for name, factor in factors.items():
            definition, survives, _ = name.partition(", survives")
            found[f"{'survives' if survives else 'scale'}: {definition}"] = factor
    return found


def of_run(run: History) -> Findings:
    """Return what is kept of a run, which may have broken off."""
    joints, met = assessed_joints(run.joints), first_mechanisms(run)
    return {
        **_each("eccentricity", by_part(abs(joints["eccentricity"]).max("time").fillna(0.5))),
        **_each("friction", by_part(joints["friction"].max("time").fillna(np.inf))),
        **_each("mechanism", {name: str(m.kind) if m else "" for name, m in met.items()}),
        **_each("time", {name: m.time if m else np.inf for name, m in met.items()}),
        "fall": "" if run.fall is None else run.fall.kind,
        "ended": str(run.ending),
        "outcome": run.outcome,
    }


def _each(word: str, values: Mapping[str, Any]) -> Findings:
    """Values under their names, a word before each."""
    return {f"{word}: {name}": value for name, value in values.items()}


def _search(given: Any) -> dict[str, Any] | None:
    """What a study says of the search for factors: a table of options, true or false."""
    if isinstance(given, bool):
        return {} if given else None
    options = check_table(given, SCALES, "scales")
    if "range" in options:
        if len(options["range"]) != 2:
            raise InvalidInput(f"scales.range = {options['range']}: give the least and the largest")
        options["between"] = options.pop("range")  # keyword of `mechanism_scales`
    return options


def file_name(name: str) -> str:
    """Return a name as that of a file."""
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
    known = {pair for case in cases.values() for pair in (case.suite or {})["pairs"]}
    if strange := [pair for pair in pairs if pair not in known]:
        raise InvalidInput(f"{path}: no case has the pairs {strange}, but {sorted(known)}")
