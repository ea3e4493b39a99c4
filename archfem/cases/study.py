"""Several cases side by side: what a measure buys, what an assumption decides."""

import logging
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from archfem.cases.case import Case
from archfem.cases.findings import Finding, by_part, kept, of_run, write
from archfem.cases.run import Rest, Result, Run, carried_out
from archfem.cases.settings import checked, refuse_unknown
from archfem.dynamics.history import Ending, History
from archfem.dynamics.scales import MechanismScales, mechanism_scales
from archfem.dynamics.verdicts import DEFINITIONS
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import judged, roles_of
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.modes import modes

logger = logging.getLogger("archfem")

CASE = {"case": str, "set": [str]}
SCALES = {"precision": "1", "between": ["1"]}
STUDY = {"title": str, "scales": (bool, dict), "pairs": [str], "set": [str], "cases": dict}

CarryOut = Callable[..., Iterator[Result]]
"""Carries out a case, as `archfem.cases.run.carried_out` does."""

Search = Callable[..., MechanismScales]
"""Finds the factors on a motion at which mechanisms begin, as `mechanism_scales` does."""


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
        return float(suite.get("reduction", 1.0) / suite.get("scale", 1.0))

    @classmethod
    def read(cls, path: str | Path, changes: Sequence[str] = ()) -> "Study":
        """Read a study: a TOML file that names case files and changes to them.

        Args:
            path: with a table [cases."name"] for each, of `case`, a file, and `set`, a list of
                "section.key=value"; `set` above the tables changes all cases, before their own.
            changes: made to every case.

        Returns:
            The study.

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


def compared(
    study: Study,
    folder: Path,
    *,
    carry_out: CarryOut = carried_out,
    search: Search = mechanism_scales,
) -> Iterator[tuple[str, Finding]]:
    """Carry out a study, case by case; what an earlier command found is kept.

    Args:
        study: what to compare.
        folder: for a file of each case's findings, written after every pair.
        carry_out: carries out a case under those of its pairs of which not all is known.
        search: finds the factors at which mechanisms begin.

    Yields:
        Name of a case, and what was found of it.

    Raises:
        DidNotConverge: a case does not stand under dead load.
        KeyboardInterrupt: on Ctrl-C; what was found of whole pairs is kept.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, case in study.cases.items():
        path = folder / f"{_file_name(name)}.json"
        finding = kept(path, case.text(), study.scales)
        wanted = _wanted(study, case, name)
        missing = [pair for pair in wanted if not _complete(study, finding, pair)]
        if missing:
            results = carry_out(case, pairs=missing)
            try:
                finding = _found(study, results, finding, path, search)
            except DidNotConverge as error:
                error.args = (f"'{name}': {error}",)
                raise
        assert finding is not None
        yield name, finding.of_pairs(wanted)


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
    study: Study, results: Iterator[Result], finding: Finding | None, path: Path, search: Search
) -> Finding:
    """Add the results of some pairs of a case to what was found of it before."""
    for result in results:
        if isinstance(result, Rest):
            rest = result
            finding = finding or _at_rest(rest)
            finding.search = study.scales
        elif isinstance(result, Suite):
            whole = {pair.name: pair.scaled(result.scale) for pair in result.pairs}
        elif isinstance(result, Run):
            assert finding is not None
            name = result.motion.name
            finding.runs[name] = of_run(_whole(result))
            if study.scales is not None:
                finding.scales[name] = _scales(rest, whole[name], search, study.scales)
            write(finding, path)
    assert finding is not None
    return finding


def _at_rest(rest: Rest) -> Finding:
    """What there is to say before the ground moves."""
    first = modes(rest.dead.model, 1, about=rest.dead)
    joints = judged(rest.dead.joints)
    return Finding(
        rest.case.text(),
        float(first.frequencies[0]),
        float(first.mass_ratios[0, 0]),
        roles_of(joints),
        by_part(abs(joints["eccentricity"]).fillna(0.5)),
    )


def _whole(run: Run) -> History:
    """The history of a run that Ctrl-C has not ended; where a step failed, that up to it."""
    if run.history.ended is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    if run.error is not None:
        logger.warning("%s, %s: %s", run.case.title, run.motion.name, run.error)
    return run.history


def _search(given: Any) -> dict[str, Any] | None:
    """What a study says of the search for factors: a table of options, true or false."""
    if isinstance(given, bool):
        return {} if given else None
    options = checked(given, SCALES, "scales")
    if len(options.get("between", (0, 0))) != 2:
        raise InvalidInput(f"scales.between = {options['between']}: give the least and the largest")
    return options


def _scales(
    rest: Rest, motion: Motion, search: Search, options: Mapping[str, Any]
) -> dict[str, tuple[float, float]]:
    """Factors on a motion at which mechanisms begin, and the largest below at which they do not."""
    found = search(
        rest.dead.model,
        motion,
        start=rest.dead,
        damping=rest.damping[0],
        dt=rest.case.analysis.get("dt"),
        criteria=rest.case.criteria,
        **options,
    )
    if found.interrupted:
        raise KeyboardInterrupt
    return {name: (found[name].upper, found[name].lower) for name in DEFINITIONS}


def _file_name(name: str) -> str:
    """A name as that of a file."""
    return re.sub(r"[^\w+-]+", "_", name).strip("_")


def _check_names(path: Path, cases: Mapping[str, Case], pairs: Sequence[str]) -> None:
    """Refuse cases that would share a file of findings, and pairs that no case has."""
    files = [_file_name(name) for name in cases]
    for name, file in zip(cases, files, strict=True):
        if not file or files.count(file) > 1:
            raise InvalidInput(
                f"{path}: '{name}' names a file of results too, and '{file}.json' is not its own: "
                "let names differ in letters and digits"
            )
    known = {pair for case in cases.values() for pair in (case.suite or {})["pairs"]}
    if strange := [pair for pair in pairs if pair not in known]:
        raise InvalidInput(f"{path}: no case has the pairs {strange}, but {sorted(known)}")


def _complete(study: Study, finding: Finding | None, pair: str) -> bool:
    """Whether everything that is asked of a pair has been found."""
    if finding is None:
        return False
    return pair in finding.runs and (pair in finding.scales or study.scales is None)
