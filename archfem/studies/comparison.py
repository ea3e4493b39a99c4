"""Several cases side by side: what a measure buys, what an assumption decides."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from archfem.cases.case import Case
from archfem.cases.settings import checked, refuse_unknown
from archfem.dynamics.history import History, history_of
from archfem.dynamics.verdicts import first_mechanisms
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import judged, roles_of
from archfem.studies.asking import Asked
from archfem.studies.files import study_tables
from archfem.studies.finders import Found, of_scales, run_of
from archfem.studies.findings import by_part
from archfem.studies.memory import first_mode, ground_motion, ground_suite, resting
from archfem.studies.over import Axis
from archfem.studies.points import PAIR, Point

CASE = {"case": str, "set": [str]}
SCALES = {"precision": "1", "between": ["1"]}
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
    def asked(self) -> Asked:
        """What is asked of each case under each pair."""
        return Asked(beside, {"scales": self.scales})

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
        given, cases = checked(given, STUDY, "study"), {}
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
        _check_names(path, cases, pairs or ())
        return cls(
            given.get("title", path.stem),
            cases,
            None if pairs is None else tuple(pairs),
            _search(given.get("scales", False)),
        )


def beside(case: Case, scales: Mapping[str, Any] | None = None) -> Found:
    """Return what is set side by side of a case under the one pair of its suite.

    Args:
        case: what is asked.
        scales: options of the search for factors on the whole motion; None looks for none.

    Returns:
        Of the dead load `frequency` [Hz] and `mass` [-] of the first mode, and of each part "role:"
        and "dead:", its |e|; of the run, of each part, "eccentricity:" and "friction:", by each
        definition "mechanism:" and "time:", and how it `ended`; and, where they are looked for, the
        factors "scale:" and "survives:" by each definition.

    Raises:
        DidNotConverge: the structure does not stand.
        KeyboardInterrupt: on Ctrl-C.
    """
    rest, motion = resting(case), ground_motion(case)
    joints, first = judged(rest.dead.joints), first_mode(rest)
    found: Found = {
        "frequency": float(first.frequencies[0]),
        "mass": float(first.mass_ratios[0, 0]),
        **_each("role", roles_of(joints)),
        **_each("dead", by_part(abs(joints["eccentricity"]).fillna(0.5))),
    }
    try:
        run = run_of(rest, motion)
    except DidNotConverge as error:
        run = history_of(error)
    found |= of_run(run)
    if scales is not None:
        suite = ground_suite(case)
        factors = of_scales(rest, suite.pairs[0].scaled(suite.scale), **scales)
        for name, factor in factors.items():
            definition, survives, _ = name.partition(", survives")
            found[f"{'survives' if survives else 'scale'}: {definition}"] = factor
    return found


def of_run(run: History) -> Found:
    """Return what is kept of a run, which may have broken off.

    Args:
        run: what happened.

    Returns:
        As `beside` does.
    """
    joints, met = judged(run.joints), first_mechanisms(run)
    return {
        **_each("eccentricity", by_part(abs(joints["eccentricity"]).max("time").fillna(0.5))),
        **_each("friction", by_part(joints["friction"].max("time").fillna(np.inf))),
        **_each("mechanism", {name: str(m.kind) if m else "" for name, m in met.items()}),
        **_each("time", {name: m.time if m else np.inf for name, m in met.items()}),
        "fall": "" if run.fall is None else run.fall.kind,
        "ended": str(run.ended),
        "outcome": run.outcome,
    }


def _each(word: str, values: Mapping[str, Any]) -> Found:
    """Values under their names, a word before each."""
    return {f"{word}: {name}": value for name, value in values.items()}


def _search(given: Any) -> dict[str, Any] | None:
    """What a study says of the search for factors: a table of options, true or false."""
    if isinstance(given, bool):
        return {} if given else None
    options = checked(given, SCALES, "scales")
    if len(options.get("between", (0, 0))) != 2:
        raise InvalidInput(f"scales.between = {options['between']}: give the least and the largest")
    return options


def file_name(name: str) -> str:
    """Return a name as that of a file.

    Args:
        name: of a case.
    """
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
