"""What a study asks of each case: one function, by name or given, and its options.

What can be found of a case, by name: each a function from a case to a flat table.
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from archfem.cases.case import Case
from archfem.cases.run import DeadLoadResult, log_prefix, run_time_history
from archfem.dynamics.history import MECHANISM_DEFINITIONS, Ending, History, first_mechanisms
from archfem.dynamics.motion_scaling import mechanism_scales
from archfem.errors import InvalidInput
from archfem.joints.criteria import assessed_joints
from archfem.limit.mechanism_count import Mechanism
from archfem.masonry.structure import suggest_name
from archfem.motion.motion import Motion
from archfem.studies.cache import dead_load_of, first_mode, ground_motion, stepper_of

Findings = dict[str, Any]


def at_rest(case: Case) -> Findings:
    """Return what there is to say of a case before the ground moves."""
    rest = dead_load_of(case)
    dead = rest.dead
    joints, first = assessed_joints(dead.joints), first_mode(rest)
    return {
        "eccentricity": float(abs(joints["eccentricity"]).fillna(0.5).max()),
        "friction": float(joints["friction"].max()),
        "N": float(joints["N"].min()),
        "frequency": float(first.frequencies[0]),
        "mass": float(first.mass_ratios[0, 0]),
    }


def history(case: Case) -> Findings:
    """Return what a run of a case came to."""
    rest, motion = dead_load_of(case), ground_motion(case)
    return of_history(run_motion(rest, motion))


def run_motion(rest: DeadLoadResult, motion: Motion) -> History:
    """Return a whole time history of a case, stepped in the same way each time.

    Args:
        rest: the case under its dead load.
        motion: of the ground.

    Raises:
        DidNotConverge: a step failed.
        KeyboardInterrupt: on Ctrl-C.
    """
    stepper = stepper_of(rest, motion)
    run = run_time_history(rest.case, motion, rest.dead, rest.damping[0], method=stepper)
    if run.ending is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    return run


def of_history(run: History, mechanisms: Mapping[str, Mechanism | None] | None = None) -> Findings:
    """Return the findings of a run.

    Args:
        run: what happened.
        mechanisms: its first ones, as by `first_mechanisms`, which finds them if they are not told.

    Returns:
        The largest of rings and piers: `eccentricity`, |e| [-], 0.5 where a joint is open;
        `friction`, |V| / N [-]; `rotation` [rad], `opening` [m] and `slip` [m] of a joint; the
        largest and the residual `integrate_displacement` [m] of a block; by each definition of a mechanism
        the time of the first [s], infinite where there is none, and its class; how the run
        `ended`; what is left, `fall`, where displacements may be large; the largest drift of its
        energy at any step, of what was exchanged, `energy_drift` [-], and how many `doubts` it has.
    """
    found: Findings = {
        "eccentricity": _largest(run, "eccentricity", 0.5),
        "friction": _largest(run, "friction", np.inf),
        **{name: _largest(run, name) for name in ("rotation", "opening", "slip")},
    }
    for name in ("largest_displacement", "residual_displacement"):
        found[name] = float(run.dataset[name].max())
    for definition, met in (mechanisms or first_mechanisms(run)).items():
        found[definition] = np.inf if met is None or met.time is None else met.time
        found[f"{definition}, class"] = "" if met is None else str(met.kind)
    found |= {"ended": str(run.ending), "fall": "" if run.fall is None else run.fall.kind}
    drift = float(run.dataset.attrs["energy_drift"])
    return found | {"energy_drift": drift, "doubts": float(len(run.warnings))}


def _largest(run: History, name: str, undefined: float = -np.inf) -> float:
    """Largest size of something of the joints of rings and piers; what stands for it where NaN."""
    sizes = np.abs(run.dataset[name].values[..., run.dataset["judged"].values])
    return float(np.where(np.isnan(sizes), undefined, sizes).max())


def scales(
    case: Case, precision: float = 0.05, between: tuple[float, float] = (0.05, 5.0)
) -> Findings:
    """Return by what factor on the motion of a case each definition of a mechanism is first met."""
    rest, motion = dead_load_of(case), ground_motion(case)
    return of_scales(rest, motion, precision=precision, between=between)


def of_scales(rest: DeadLoadResult, motion: Motion, **options: Any) -> Findings:
    """Return the factors on a motion at which mechanisms begin, as `scales` does."""
    options["between"] = tuple(options.get("between", (0.05, 5.0)))
    with log_prefix(rest.case.title, motion.name):
        found = mechanism_scales(
            rest.dead.model,
            motion,
            start=rest.dead,
            damping=rest.damping[0],
            dt=rest.case.analysis.get("dt"),
            criteria=rest.case.criteria,
            method=partial(stepper_of, rest),
            **options,
        )
    if found.interrupted:
        raise KeyboardInterrupt
    brackets = {definition: found[definition] for definition in MECHANISM_DEFINITIONS}
    return {name: each.upper for name, each in brackets.items()} | {
        f"{name}, survives": each.lower for name, each in brackets.items()
    }


def limit(case: Case) -> Findings:
    """Return what limit analysis finds of a case."""
    if case.limit is None:
        raise InvalidInput("the case has no [limit]: give horizontal = 1.0, or a point load")
    found = case.limit.solve(case.structure)
    return {
        "factor": float(found.factor),
        "outcome": str(found.outcome.name).lower(),
        "hinges": len(found.hinges),
        "slides": len(found.sliding),
    }


# What a study may ask for by name
FINDERS: Mapping[str, Callable[..., Findings]] = {
    "history": history,
    "scales": scales,
    "dead load": at_rest,
    "limit": limit,
}


# One finding: a number, words, or a row of numbers
Value = float | int | str | list[float]

# Finds something of a case: a flat table of numbers, words and rows of numbers
Find = Callable[..., Mapping[str, Any]]


@dataclass(frozen=True)
class Evaluator:
    """A function from a case to findings, with its options."""

    find: Find  # the function; it takes a case and the options as keywords
    options: Mapping[str, Any] = field(default_factory=dict)  # of the function, by name

    @classmethod
    def of(cls, given: Any) -> "Evaluator":
        """Return what is asked for."""
        options: dict[str, Any] = {}
        if isinstance(given, Mapping):
            options = dict(given)
            given = options.pop("name", None)
        find = _by_name(given) if isinstance(given, str) else given
        if not callable(find):
            raise InvalidInput(
                f"cannot compute {given!r}: name one of {sorted(FINDERS)}, or 'module:function'"
            )
        try:
            inspect.signature(find).bind(None, **options)
        except TypeError as error:
            raise InvalidInput(f"{given!r} does not take {options}: {error}") from error
        return cls(find, options)

    @property
    def text(self) -> str:
        """What tells this from anything else that is asked: the function's module, and options."""
        name = f"{self.find.__module__}:{getattr(self.find, '__qualname__', repr(self.find))}"
        try:
            source = _source(self.find)
        except (OSError, TypeError):
            source = ""
        return f"{name} {sorted(self.options.items())!r}\n{source}"

    def evaluate(self, case: Case) -> dict[str, Value]:
        """Return what is found of a case."""
        found = self.find(case, **self.options)
        if not isinstance(found, Mapping):
            raise InvalidInput(f"find gave a {type(found).__name__}: it is to give a flat table")
        return {str(key): _value(key, value) for key, value in found.items()}


def refuse_code(given: Any) -> None:
    """Refuse what a file says is to be found if that is code of its own."""
    name = given.get("name") if isinstance(given, Mapping) else given
    if isinstance(name, str) and ":" in name:
        raise InvalidInput(
            f"compute = '{name}' is code, which no file runs by itself: if you trust it, say so, "
            "archfem study --own-code, or Study.read(…, own_code=True)"
        )


def _source(find: Find) -> str:
    """Source of the module that a function is of; of the function alone where it has no file."""
    file = inspect.getsourcefile(find)
    if file is None or not Path(file).is_file():
        return inspect.getsource(find)
    return Path(file).read_text(encoding="utf-8")


def _by_name(name: str) -> Find:
    """A function of ours by its name, or one of the user's by that of its module."""
    if name in FINDERS:
        return FINDERS[name]
    module, colon, function = name.partition(":")
    if not colon:
        hint = suggest_name(name, FINDERS) or f"use one of {sorted(FINDERS)}"
        raise InvalidInput(f"cannot compute '{name}': {hint}, or 'package.module:function'")
    try:
        found: Find = getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise InvalidInput(f"cannot compute '{name}': {error}") from error
    return found


def _value(key: str, value: Any) -> Value:
    """One finding as JSON can hold it."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, bool):
        return int(value)
    if value is None:
        return float("nan")
    if isinstance(value, str):
        return str(value)
    if isinstance(value, int | float):
        return value
    if isinstance(value, list | tuple) and all(isinstance(each, int | float) for each in value):
        return [float(each) for each in value]
    raise InvalidInput(
        f"finding '{key}' is a {type(value).__name__}: give a number, words, or a row of numbers"
    )
