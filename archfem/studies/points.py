"""One point of a study: a case file and what differs from it."""

import hashlib
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

from archfem.cases.case import Case
from archfem.cases.inputs import inputs_digest
from archfem.cases.settings import put, refuse_unknown
from archfem.errors import InvalidInput

MODEL = ("structure", "materials", "contacts", "model", "dead_load")
"""Sections of a case that make its model."""

PAIR = "suite.pair"
"""Key whose value is the one pair of the suite that a point is about."""


@dataclass(frozen=True)
class Point:
    """One case of a study, told by what differs from a case that many points share.

    Attributes:
        base: tables of the case that is changed.
        folder: where relative file names start.
        changes: keys, "section.key" each, and their values; "suite.pair" names the one pair of the
            suite that is meant.
    """

    base: Mapping[str, Any] = field(repr=False)
    folder: Path
    changes: tuple[tuple[str, Any], ...] = ()

    @property
    def settings(self) -> dict[str, Any]:
        """Tables of the case, changes made.

        Raises:
            InvalidInput: a key goes through something that is no table, or there is no such pair.
        """
        made = deepcopy(dict(self.base))
        for key, value in self.changes:
            if key == PAIR:
                _leave_one(made, value)
            else:
                put(made, key, deepcopy(value))
        return made

    @property
    def case(self) -> Case:
        """The case.

        Raises:
            InvalidInput: what cannot be meant.
            InvalidStructure: lengths that do not make a structure.
        """
        return Case.of(self.settings, self.folder)

    def digest(self, asked: str) -> str:
        """Return what tells this point from every other: of its case, its files and the version.

        Args:
            asked: what is to be found, as text.
        """
        text = f"{asked}\n{inputs_digest(self.settings, self.folder)}"
        return hashlib.sha256(text.encode()).hexdigest()[:32]


def model_of(point: Point) -> str:
    """Return what points of one study have in common where they are of one model, as a rule.

    Args:
        point: of the study.
    """
    told = [change for change in point.changes if change[0].partition(".")[0] in MODEL]
    return f"{id(point.base)} {told!r}"


def by_model(points: Iterable[tuple[int, Point]]) -> list[tuple[int, Point]]:
    """Return points in their order, but those of one model together: who has built it goes on.

    Args:
        points: with their numbers.
    """
    groups: dict[str, list[tuple[int, Point]]] = {}
    for number, point in points:
        groups.setdefault(model_of(point), []).append((number, point))
    return list(chain.from_iterable(groups.values()))


def _leave_one(settings: dict[str, Any], pair: str) -> None:
    """Take all other pairs out of a suite."""
    pairs = settings.get("suite", {}).get("pairs", {})
    if not pairs:
        raise InvalidInput(f"{PAIR} = {pair!r}: the case has no [suite] to take a pair of")
    refuse_unknown({pair: None}, pairs, "suite.pairs")
    settings["suite"]["pairs"] = {pair: pairs[pair]}
