"""Cache of one process between points of a study: models, damping, modes, motions.

The points of a study often differ in few keys. The cache returns everything that a later point
shares with an earlier one, by the contents of its case and files. Its results have the same bits as
if they were computed anew.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

from archfem._recent import RecentResults
from archfem._validation import validate_arguments
from archfem.cases.case import Case
from archfem.cases.run import DeadLoadResult, damping_of, dead_load_of_case
from archfem.errors import InvalidInput
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.modes import Modes, modes
from archfem.studies.parameter_space import MODEL_SECTIONS
from archfem.studies.shared_results import compute_once

Value = TypeVar("Value")

_cache: dict[str, RecentResults[Any]] = {}


@validate_arguments
def dead_load_of(case: Case) -> DeadLoadResult:
    """Return the dead-load result of a case, with its damping; the model is reused if cached.

    Args:
        case: case of the structure.

    Raises:
        DidNotConverge: the structure does not stand.
    """
    key = _model_key(case)
    dead = _look_up("equilibria", key, lambda: dead_load_of_case(case))
    result = DeadLoadResult(case, dead)
    damping_key = f"{key} {case.analysis.damping!r}"
    # stored as the cached property `damping` of the result would store it
    result.__dict__["damping"] = _look_up("damping", damping_key, lambda: damping_of(case, dead))
    return result


def lowest_modes(result: DeadLoadResult, count: int = 1) -> Modes:
    """Compute the lowest modes about the dead load."""
    dead, key = result.dead, f"{_model_key(result.case)} {count}"
    return _look_up("modes", key, lambda: modes(dead.model, count, start=dead))


@validate_arguments
def ground_motion(case: Case) -> Motion:
    """Return the motion of a case, or that of the only pair of its suite.

    Args:
        case: case with a motion or a suite of one pair.

    Raises:
        InvalidInput: there is no motion or more than one, or it cannot be read or matched.
        DidNotConverge: the matching did not converge.
    """
    if case.suite is not None and len(pairs := list(case.suite["pairs"])) > 1:
        raise InvalidInput(
            f"the suite has {len(pairs)} pairs, and one motion is needed: take one of {pairs} by "
            '--pair NAME, or vary "suite.pair" in a study'
        )
    if case.suite is not None:
        return ground_suite(case).motions[0]
    if case.motion is None:
        return case.ground_motion()  # raises the error for a case without motion
    # The scale is applied last, so that scaled motions share one file and one matching.
    unscaled = replace(case, motion={k: v for k, v in case.motion.items() if k != "scale"})
    key = case.hash_sections(("motion",), ("scale",))
    return _look_up("motions", key, unscaled.ground_motion).scaled(case.motion.get("scale", 1.0))


def ground_suite(case: Case) -> Suite:
    """Return the suite of a case; suites that differ in their factors share files and matching."""
    if (settings := case.suite) is None:
        return case.ground_suite()  # raises the error for a case without suite
    keys = ("scale", "reduction", "reversed")
    plain = replace(case, suite={k: v for k, v in settings.items() if k not in keys})
    key = case.hash_sections(("suite",), keys)
    suite = _look_up("suites", key, lambda: _match_once(plain, key))
    factors = {name: settings.get(name, 1.0) for name in ("scale", "reduction")}
    suite = replace(suite, **factors)
    return suite.reversed() if settings.get("reversed", False) else suite


def _match_once(case: Case, key: str) -> Suite:
    """Return the suite of a case; its matched pairs are shared by all workers of a study."""
    if case.suite is None or not case.suite.get("matched", False):
        return case.ground_suite()  # records are read faster than they are exchanged

    def match() -> list[dict[str, Any]]:
        return [
            {"name": pair.name, "dt": pair.dt}
            | {name: pair.component(name).tolist() for name in pair.components}
            for pair in case.ground_suite().pairs
        ]

    # numbers in JSON have all digits: the motions have the same bits as those that were matched
    pairs = [Motion(**pair) for pair in compute_once("motions", key, match)]
    return Suite(case.suite.get("name", "suite"), tuple(pairs))


def _model_key(case: Case) -> str:
    """Key of the model of a case; it includes the motion if that selects the model."""
    selection = ("motion", "suite", "analysis", "criteria") if case.analysis.selects_model else ()
    return case.hash_sections((*MODEL_SECTIONS, *selection))


def _look_up(kind: str, key: str, make: Callable[[], Value]) -> Value:
    """Return a recent object of a kind, or make it."""
    # few objects that are as large as a model
    limit = 4 if kind in ("equilibria", "modes") else 64
    objects: RecentResults[Value] = _cache.setdefault(kind, RecentResults(limit))
    return objects.look_up(key, make)
