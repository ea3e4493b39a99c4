"""What a process remembers between points: models under dead load, damping, motions.

Points of a study often differ in little. What a later point shares with an earlier one, by all that
the case and its files say of it, is taken from here.
"""

import json
from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from archfem.cases.case import Case
from archfem.cases.inputs import content_digest, input_files
from archfem.cases.run import Rest, at_rest, damping_of
from archfem.dynamics.schemes import Conserving, Scheme, Viscous
from archfem.dynamics.stepping.choice import stepper_for
from archfem.dynamics.stepping.equation import Equation
from archfem.errors import InvalidInput
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.equilibrium import Equilibrium
from archfem.studies.warm import warm

Made = TypeVar("Made")

MODELS, OTHERS = 4, 64
"""How many models are kept, which may be large, and how many of anything else."""

MODEL = ("structure", "materials", "contacts", "model", "dead_load")
GROUND = ("motion", "suite")
ANALYSIS = ("analysis", "criteria")

METHODS = ("compliance", "turning", "contact", "tangent", "snes")
"""Ways to step, of which the first that applies is taken: a choice by timing may differ."""

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
    return _remembered("motions", _key(case, GROUND), case.ground_motion)


def ground_suite(case: Case) -> Suite:
    """Return the suite of a case, read and matched before if it was.

    Args:
        case: what is asked.

    Raises:
        InvalidInput: there is none, or a pair cannot be read or matched.
        DidNotConverge: a pair cannot be matched.
    """
    return _remembered("suites", _key(case, GROUND), case.ground_suite)


def method_for(rest: Rest, motion: Motion) -> str:
    """Return the way to step that a run takes whatever else the machine does: not that timed best.

    Args:
        rest: what is shaken.
        motion: of the ground.
    """
    damping, scheme = rest.damping[0], rest.case.scheme or Conserving()
    key = f"{_model_key(rest.case)} {damping!r} {scheme!r}"
    return _remembered("methods", key, lambda: _first_method(rest, motion, damping, scheme))


def _first_method(rest: Rest, motion: Motion, damping: Viscous | None, scheme: Scheme) -> str:
    """The first way to step that applies."""
    dead = rest.dead
    equation = Equation(dead.continued(dead.model), motion, damping, scheme)
    start = equation.at_rest(dead.q, memory=dead.model.memory)
    for method in METHODS:
        try:
            stepper_for(method, equation, start, 0.005)
        except InvalidInput:
            continue
        return method
    return METHODS[-1]


def _model_key(case: Case) -> str:
    """Everything that makes the model of a case; the motion too, where it is chosen for that."""
    return _key(case, (*MODEL, *GROUND, *ANALYSIS) if case.chooses else MODEL)


def _key(case: Case, sections: Sequence[str]) -> str:
    """Everything that some sections of a case say, files included, as text."""
    told = {name: case.settings[name] for name in sections if name in case.settings}
    files = [(str(p), content_digest(p)) for p in input_files(told, case.folder)]
    return json.dumps([told, files], sort_keys=True, default=str)


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
