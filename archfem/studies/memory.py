"""What a process remembers between points: models under dead load, damping, steppers, motions.

Points of a study often differ in little. What a later point shares with an earlier one, by all that
the case and its files say of it, is taken from here.
"""

import hashlib
import json
from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from archfem.cases.case import Case
from archfem.cases.inputs import content_digest, input_files
from archfem.cases.run import Rest, at_rest, damping_of
from archfem.dynamics.schemes import Conserving
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.stepper import Stepper
from archfem.dynamics.time_history import STEP
from archfem.errors import InvalidInput
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.modes import Modes, modes
from archfem.studies.points import MODEL
from archfem.studies.steppers import Ready
from archfem.studies.warm import warm

Made = TypeVar("Made")

MODELS, OTHERS = 4, 64
"""How many models are kept, which may be large, and how many of anything else."""

GROUND = ("motion", "suite")
ANALYSIS = ("analysis", "criteria")

FACTORS = ("scale", "reduction", "reversed")
"""What a case says of a motion, or a suite, that is read and matched without it all the same."""

_kept: dict[str, OrderedDict[str, Any]] = {}


def resting(case: Case) -> Rest:
    """Return a case under its dead load, damping found, on a model made before if there is one.

    Args:
        case: what is asked.

    Raises:
        DidNotConverge: the structure does not stand.
    """
    warm()
    key = _model_key(case)
    dead: Equilibrium = _remembered("models", key, lambda: at_rest(case), MODELS)
    rest = Rest(case, dead)
    damped = f"{key} {case.analysis.get('damping')!r}"
    found = _remembered("damping", damped, lambda: damping_of(case, dead))
    rest.__dict__["damping"] = found  # where the cached property would put it
    return rest


def first_mode(rest: Rest) -> Modes:
    """Return the first mode about a dead load.

    Args:
        rest: a case under its dead load.

    Raises:
        DidNotConverge: it was not found.
    """
    dead = rest.dead
    key = _model_key(rest.case)
    return _remembered("modes", key, lambda: modes(dead.model, 1, about=dead), MODELS)


def ground_motion(case: Case) -> Motion:
    """Return the motion of a case, or that of the only pair of its suite, matched if it is to be.

    Args:
        case: what is asked.

    Raises:
        InvalidInput: there is none, more than one, or it cannot be read or matched.
        DidNotConverge: it cannot be matched.
    """
    if case.suite is not None and len(pairs := list(case.suite["pairs"])) > 1:
        raise InvalidInput(
            f"the suite has {len(pairs)} pairs and a point of a study is about one: go over "
            f'"suite.pair" = {pairs}'
        )
    if case.suite is not None:
        return ground_suite(case).motions[0]
    if case.motion is None:
        return case.ground_motion()  # which says that there is none
    plain = replace(case, motion=_without(case.motion, ("scale",)))
    whole = _remembered("motions", _ground_key(case), plain.ground_motion)
    return whole.scaled(case.motion.get("scale", 1.0))


def ground_suite(case: Case) -> Suite:
    """Return the suite of a case, read and matched before if it was, at whatever scale.

    Args:
        case: what is asked.

    Raises:
        InvalidInput: there is none, or a pair cannot be read or matched.
        DidNotConverge: a pair cannot be matched.
    """
    if (told := case.suite) is None:
        return case.ground_suite()  # likewise
    plain = replace(case, suite=_without(told, FACTORS))
    found = _remembered("suites", _ground_key(case), plain.ground_suite)
    factors = {name: told.get(name, 1.0) for name in ("scale", "reduction")}
    scaled = replace(found, **factors)
    return scaled.reversed() if told.get("reversed", False) else scaled


def stepper_of(rest: Rest, motion: Motion) -> Stepper:
    """Return a fresh stepper for a run, the way it steps chosen whatever else the machine does.

    Args:
        rest: what is shaken.
        motion: of the ground.
    """
    dead, damping, scheme = rest.dead, rest.damping[0], rest.case.scheme or Conserving()

    def ready() -> Ready:
        equation = Equation(dead.continued(dead.model), motion, damping, scheme)
        return Ready.of(equation, equation.at_rest(dead.q, memory=dead.model.memory), STEP)

    key = f"{_model_key(rest.case)} {damping!r} {scheme!r}"
    return _remembered("steppers", key, ready, MODELS).under(motion)


def _model_key(case: Case) -> str:
    """Everything that makes the model of a case; the motion too, where it is chosen for that."""
    return _key(case, (*MODEL, *GROUND, *ANALYSIS) if case.chooses else MODEL)


def _ground_key(case: Case) -> str:
    """Everything that a case says of the ground, but for factors."""
    left_out = {"motion": ("scale",), "suite": FACTORS}
    return _key(case, GROUND, left_out)


def _key(
    case: Case, sections: Sequence[str], left_out: Mapping[str, Collection[str]] | None = None
) -> str:
    """What tells everything that some sections of a case say, files included."""
    told = {
        name: _without(case.settings[name], (left_out or {}).get(name, ()))
        for name in sections
        if name in case.settings
    }
    files = [(str(p), content_digest(p)) for p in input_files(told, case.folder)]
    text = json.dumps([told, files], default=str)  # arches and piers stand in their order
    return hashlib.sha256(text.encode()).hexdigest()


def _without(table: Mapping[str, Any], keys: Collection[str]) -> dict[str, Any]:
    """A table without some of its keys."""
    return {key: value for key, value in table.items() if key not in keys}


def _remembered(kind: str, key: str, make: Callable[[], Made], most: int = OTHERS) -> Made:
    """What was made before under a key, or what is made now; of many the oldest is forgotten."""
    kept = _kept.setdefault(kind, OrderedDict())
    if key not in kept:
        kept[key] = make()
        while len(kept) > most:
            kept.popitem(last=False)
    kept.move_to_end(key)
    found: Made = kept[key]
    return found
