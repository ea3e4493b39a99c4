"""Several cases side by side: what a measure buys, what an assumption decides."""

import json
import logging
import os
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem.analysis import at_rest, damping_of, shaken
from archfem.case import Case
from archfem.criteria import judged, part_role
from archfem.errors import DidNotConverge, InvalidInput
from archfem.history import History
from archfem.modal import modes
from archfem.motion import Motion
from archfem.scales import mechanism_scales
from archfem.settings import checked, refuse_unknown
from archfem.statics import Equilibrium
from archfem.summary import aligned
from archfem.verdicts import DEFINITIONS, first_mechanisms

logger = logging.getLogger("archfem")

CASE = {"case": str, "set": [str]}
SCALES = {"precision": "1", "between": ["1"]}
KEYS = ("title", "scales", "pairs", "set", "cases")


@dataclass(frozen=True)
class Study:
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
        return suite.get("reduction", 1.0) / suite.get("scale", 1.0)

    @classmethod
    def read(cls, path: str | Path, changes: Sequence[str] = ()) -> "Study":
        """Read a study: a TOML file that names case files and changes to them.

        Args:
            path: with a table [cases."name"] for each, of `case`, a file, and `set`, a list of
                "section.key=value"; `set` above the tables changes all cases, before their own.
            changes: made to every case.

        Raises:
            InvalidInput: the file or one of its cases cannot be meant.
        """
        path = Path(path)
        if not path.is_file():
            raise InvalidInput(f"there is no study {path}")
        try:
            given = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InvalidInput(f"{path} is not TOML: {error}") from error
        refuse_unknown(given, KEYS)
        cases = {}
        for name, table in given.get("cases", {}).items():
            own = checked(table, CASE, f"cases.{name}")
            if "case" not in own:
                raise InvalidInput(f"{path}: cases.{name} names no case file")
            both = [*given.get("set", []), *own.get("set", []), *changes]
            cases[name] = Case.read(path.parent / own["case"], both)
            if cases[name].suite is None:
                raise InvalidInput(f"{path}: the case of '{name}' has no [suite] to compare under")
        if not cases:
            raise InvalidInput(f'{path} has no cases: write [cases."name"] with case = "file.toml"')
        pairs = given.get("pairs")
        return cls(
            str(given.get("title", path.stem)),
            cases,
            None if pairs is None else tuple(pairs),
            _search(given.get("scales", False)),
        )


@dataclass
class Finding:
    """What was found of one case.

    Attributes:
        case: the case as text, by which a finding is known again.
        frequency: of the first mode about the dead load [Hz].
        mass: its share of the mass along x [-].
        dead: largest |e| of each ring and pier under dead load [-].
        runs: by pair, what `of_run` gives.
        scales: by pair and definition, the least factor found to fail and the largest below it
            found not to; infinite where none failed.
    """

    case: str
    frequency: float
    mass: float
    dead: dict[str, float]
    runs: dict[str, dict[str, Any]] = field(default_factory=dict)
    scales: dict[str, dict[str, tuple[float, float]]] = field(default_factory=dict)

    def least(self, definition: str) -> np.ndarray:
        """Least factor that fails by a definition, of each pair (pairs,) [-]."""
        return np.array([found[definition][0] for found in self.scales.values()])


def carried_out(study: Study, folder: Path) -> Iterator[tuple[str, Finding]]:
    """Carry out a study, case by case; what an earlier command found is kept.

    Args:
        study: what to compare.
        folder: for a file of each case's findings, written after every pair.

    Raises:
        DidNotConverge: a case does not stand under dead load.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, case in study.cases.items():
        path = folder / f"{_file_name(name)}.json"
        finding = _kept(path, case)
        wanted = _wanted(study, case, name)
        missing = [pair for pair in wanted if not _complete(study, finding, pair)]
        if missing:
            finding = _found(study, case, missing, finding, path)
        assert finding is not None
        yield name, finding


def _wanted(study: Study, case: Case, name: str) -> list[str]:
    """Pairs of a case that a study asks for."""
    assert case.suite is not None
    pairs = [pair for pair in case.suite["pairs"] if study.pairs is None or pair in study.pairs]
    if not pairs:
        raise InvalidInput(
            f"'{name}' has none of the pairs {study.pairs}, but {list(case.suite['pairs'])}"
        )
    return pairs


def _found(
    study: Study, case: Case, pairs: Sequence[str], finding: Finding | None, path: Path
) -> Finding:
    """Run some pairs of a case, and add to what was found of it before."""
    suite, dead = case.ground_suite(), at_rest(case)
    finding = finding or _at_rest(case, dead)
    for motion, pair in zip(suite.motions, suite.pairs, strict=True):
        if motion.name in pairs:
            finding.runs[motion.name] = _run(case, motion, dead)
            if study.scales is not None:
                whole = pair.scaled(suite.scale)
                finding.scales[motion.name] = _scales(case, whole, dead, study.scales)
            _write(finding, path)
    return finding


def of_run(run: History) -> dict[str, Any]:
    """What a study keeps of a run: maxima by part, and the first mechanism by each definition."""
    joints = judged(run.joints)
    return {
        "eccentricity": _by_part(abs(joints["eccentricity"]).max("time").fillna(0.5)),
        "friction": _by_part(joints["friction"].max("time").fillna(np.inf)),
        "mechanisms": {
            definition: None if found is None else {"kind": found.kind, "time": found.time}
            for definition, found in first_mechanisms(run).items()
        },
        "outcome": run.outcome,
    }


def study_table(findings: Mapping[str, Finding]) -> str:
    """Two tables, a line for each case.

    The first tells of the motions as each case applies them: the first mode, the gravest joint of
    rings and piers (its median over the pairs), and in how many pairs each definition of a
    mechanism is met. The second, where they were looked for, tells by what factor on the whole
    motions they begin: the median over the pairs, and their range.

    Args:
        findings: by name of the case.
    """
    head = ["case", "mode 1", "mass x", "|e| dead", "|e| rings", "|e| piers", *DEFINITIONS]
    rows = []
    for name, found in findings.items():
        cells = [name, f"{found.frequency:.2f} Hz", f"{found.mass:.0%}"]
        cells.append(f"{max(found.dead.values()):.3f}")
        cells += [_largest(found, role) for role in ("ring", "pier")]
        for definition in DEFINITIONS:
            met = [run["mechanisms"][definition] is not None for run in found.runs.values()]
            cells.append(f"{sum(met)} of {len(met)}")
        rows.append(cells)
    tables = [aligned(head, rows)]
    if any(found.scales for found in findings.values()):
        rows = [
            [name, *(_range(found.least(definition)) for definition in DEFINITIONS)]
            for name, found in findings.items()
        ]
        tables.append(aligned(["factor at first mechanism", *DEFINITIONS], rows))
    return "\n\n".join(tables)


def _at_rest(case: Case, dead: Equilibrium) -> Finding:
    """What there is to say before the ground moves."""
    first = modes(dead.model, 1, about=dead)
    largest = _by_part(abs(judged(dead.joints)["eccentricity"]).fillna(0.5))
    return Finding(
        case.text(), float(first.frequencies[0]), float(first.mass_ratios[0, 0]), largest
    )


def _run(case: Case, motion: Motion, dead: Equilibrium) -> dict[str, Any]:
    """Run one pair; where a step fails, what was found up to it counts."""
    try:
        return of_run(shaken(case, motion, dead))
    except DidNotConverge as error:
        if error.history is None:
            raise
        logger.warning("%s, %s: %s", case.title, motion.name, error)
        return of_run(error.history)


def _search(given: Any) -> dict[str, Any] | None:
    """What a study says of the search for factors: a table of options, true or false."""
    if isinstance(given, bool):
        return {} if given else None
    options = checked(given, SCALES, "scales")
    if "between" in options:
        options["between"] = tuple(options["between"])
    return options


def _scales(
    case: Case, motion: Motion, dead: Equilibrium, options: Mapping[str, Any]
) -> dict[str, tuple[float, float]]:
    """Factors on a motion at which mechanisms begin, and the largest below at which they do not."""
    found = mechanism_scales(
        dead.model,
        motion,
        start=dead,
        damping=damping_of(case, dead)[0],
        dt=case.analysis.get("dt"),
        **options,
    )
    return {name: (found[name].upper, found[name].lower) for name in DEFINITIONS}


def _by_part(values: xr.DataArray) -> dict[str, float]:
    """Largest value of each part's joints."""
    largest = values.groupby("part").max()
    return dict(zip(largest["part"].values.tolist(), largest.values.tolist(), strict=True))


def _file_name(name: str) -> str:
    """A name as that of a file."""
    return re.sub(r"[^\w+-]+", "_", name).strip("_")


def _kept(path: Path, case: Case) -> Finding | None:
    """Findings of an earlier command, where they are of the same case."""
    try:
        found = Finding(**json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    return found if found.case == case.text() else None


def _complete(study: Study, finding: Finding | None, pair: str) -> bool:
    """Whether everything that is asked of a pair has been found."""
    if finding is None:
        return False
    return pair in finding.runs and (pair in finding.scales or study.scales is None)


def _write(finding: Finding, path: Path) -> None:
    """Write findings in one stroke."""
    draft = path.with_suffix(".part")
    draft.write_text(json.dumps(asdict(finding), indent=1), encoding="utf-8")
    os.replace(draft, path)


def _largest(finding: Finding, role: str) -> str:
    """Median over the pairs of the largest |e| in all rings, or in all piers."""
    each = [
        max((e for part, e in run["eccentricity"].items() if part_role(part) == role), default=None)
        for run in finding.runs.values()
    ]
    known = [e for e in each if e is not None]
    return f"{np.median(known):.3f}" if known else "-"


def _range(factors: np.ndarray) -> str:
    """Median and range of factors; a dash where there is none up to the largest that was tried."""
    if not len(factors) or np.isinf(factors).all():
        return "-"
    low, middle, high = np.quantile(factors, [0.0, 0.5, 1.0], method="nearest")
    return f"{_factor(middle)} ({_factor(low)} to {_factor(high)})"


def _factor(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "-"
