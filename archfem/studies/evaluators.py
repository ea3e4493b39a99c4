"""Evaluators: functions from a case to a flat table of findings, by name or given by the user."""

import hashlib
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any

import numpy as np
import xarray as xr

from archfem._validation import validate_arguments
from archfem.cases import rating_text, result_text
from archfem.cases.analysis_keys import rate_case
from archfem.cases.answers import doubt_fill, find_margin, list_ratios
from archfem.cases.case import Case
from archfem.cases.provenance import hash_inputs, remove_presentation
from archfem.cases.push_factors import compare_with_site, site_acceleration
from archfem.cases.run import DeadLoadResult, log_prefix
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.history import (
    Ending,
    History,
    classify_outcome,
    first_mechanisms,
    partial_history,
)
from archfem.dynamics.motion_scaling import mechanism_scales
from archfem.dynamics.schemes import EffectiveDamping, Viscous
from archfem.dynamics.time_history import time_history
from archfem.dynamics.verdict import ALL_DEFINITIONS, MECHANISM_DEFINITIONS
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints import criteria
from archfem.limit.collapse import Outcome
from archfem.limit.fill_range import BACKED, FillRange
from archfem.limit.mechanism_count import Mechanism
from archfem.masonry.structure import suggest_name
from archfem.models.model import Doubt, write_doubts
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium
from archfem.studies.cache import dead_load_of, ground_motion, ground_suite, lowest_modes
from archfem.studies.parameter_space import Point
from archfem.studies.statements import capacity_findings, dead_load_findings, history_findings

# A flat table: numbers, texts and rows of numbers by name
Findings = dict[str, Any]


def evaluate_dead_load(case: Case) -> Findings:
    """Return the largest |e| and friction of joints under dead load, and the first mode."""
    result = dead_load_of(case)
    joints = criteria.assessed_joints(result.dead.joints)
    return {
        "eccentricity": float(criteria.eccentricity_magnitude(joints).max()),
        "friction": float(joints["friction"].max()),
        "N": float(joints["N"].min()),
        **_describe_first_mode(result),
    }


def _describe_first_mode(result: DeadLoadResult) -> Findings:
    """Return frequency and mass ratio of the first mode about the dead load."""
    first = lowest_modes(result)
    return {"frequency": float(first.frequencies[0]), "mass": float(first.mass_ratios[0, 0])}


@dataclass(frozen=True, eq=False)
class PreparedRuns:
    """Runs of one structure under any motions, each independent of the others.

    All evaluations compute their histories by it, from a dead load and a damping that are shared.
    """

    analysis: Analysis
    rest: Equilibrium | None  # dead load; None where each motion selects its model
    damping: Viscous | EffectiveDamping | str | None

    def run(self, motion: Motion) -> History:
        """Return the history under a motion, by default not repeated; Ctrl-C ends all runs."""
        record = replace(self.analysis.record, repeat=self.analysis.record.repeat or False)
        given: Any = {"start": self.rest, "damping": self.damping, "record": record}
        run = time_history(self.analysis, motion, **given)
        if run.ending is Ending.INTERRUPTED:
            raise KeyboardInterrupt
        return run


def evaluate_history(case: Case) -> Findings:
    """Return the findings of the time history of a case."""
    result = dead_load_of(case)
    run = run_motion(result, ground_motion(case))
    return of_history(run.with_doubts((*result.doubts, *run.doubts)))


@validate_arguments
def run_motion(result: DeadLoadResult, motion: Motion, *, whole_fall: bool = True) -> History:
    """Return the time history of a case under a motion, independent of earlier runs.

    Args:
        result: dead-load result of the case.
        motion: ground motion.
        whole_fall: as of `Record`; False ends the fall of any case once a block is lost for good.

    Raises:
        DidNotConverge: a step failed.
        KeyboardInterrupt: on Ctrl-C.
    """
    analysis = result.case.analysis
    if not whole_fall:
        analysis = replace(analysis, record=replace(analysis.record, whole_fall=False))
    runs = PreparedRuns(analysis, result.dead, result.damping[0])
    with log_prefix(result.case.title, motion.name):
        return runs.run(motion)


@validate_arguments
def of_history(run: History, mechanisms: Mapping[str, Mechanism | None] | None = None) -> Findings:
    """Return the findings of a run.

    Args:
        run: time history.
        mechanisms: its first mechanisms by definition; by default those of `first_mechanisms`.

    Returns:
        The largest values over time and the joints of rings and piers: `eccentricity`, |e| [-], 0.5
        for an open joint; `friction`, |V| / N [-], infinite for an open one; `rotation` [rad],
        `opening` [m], `slip` [m].
        The `largest_displacement` and `residual_displacement` of a block [m]. The time of the first
        mechanism by each definition [s], infinite if there is none, and its class. How the run
        `ended`. `fall`, the state after a collapse, "" for small displacements. `energy_drift`, the
        largest energy error at any step over the exchanged energy [-]. `assessed`, which joints
        count, if not all do. `doubts`, the number of doubts, and `doubts, stated`, all of them
        as JSON.
    """
    findings: Findings = {**largest_values(run), "outcome": classify_outcome(run)}
    for definition, first in (mechanisms or first_mechanisms(run)).items():
        findings[definition] = np.inf if first is None or first.time is None else first.time
        findings[f"{definition}, class"] = "" if first is None else str(first.kind)
    findings |= {"ended": str(run.ending), "fall": "" if run.fall is None else run.fall.kind}
    assessed = criteria.describe_assessed_joints(run.joints)
    findings |= {"assessed": assessed} if assessed else {}
    drift = float(run.dataset.attrs["energy_drift"])
    return findings | {"energy_drift": drift} | _state_doubts(run.doubts)


def _state_doubts(doubts: Sequence[Doubt]) -> Findings:
    """Return the number of doubts, and all of them as JSON."""
    return {"doubts": float(len(doubts)), result_text.STATED_DOUBTS: write_doubts(doubts)}


def _name_bounds(bounds: Sequence[str]) -> Findings:
    """Return the finding that names those which are upper bounds, if there are any."""
    return {result_text.UPPER_BOUNDS: ", ".join(bounds)} if bounds else {}


def largest_values(run: History) -> dict[str, float]:
    """Return the largest values and displacements of `of_history`."""
    attributes = run.dataset.attrs
    return {
        "eccentricity": _largest(run, "eccentricity", 0.5),
        "friction": _largest(run, "friction", np.inf),
        **{name: _largest(run, name) for name in ("rotation", "opening", "slip")},
        "largest_displacement": float(attributes.get("displacement", np.nan)),
        "residual_displacement": float(attributes.get("residual", np.nan)),
    }


def _largest(run: History, name: str, undefined: float = -np.inf) -> float:
    """Largest magnitude over time and the joints of rings and piers; `undefined` replaces NaN."""
    values, judged = run.dataset[name].values, run.dataset["judged"].values
    sizes = np.abs(values if judged.all() else values[..., judged])  # a selection is a copy
    largest = sizes.max()
    if np.isnan(largest):
        largest = np.where(np.isnan(sizes), undefined, sizes).max()
    return float(largest)


def evaluate_scales(
    case: Case, precision: float = 0.05, between: tuple[float, float] = (0.05, 5.0)
) -> Findings:
    """Return the scale of the motion at the first mechanism of each definition."""
    motion = ground_motion(case)
    return scales_of(dead_load_of(case), motion, precision=precision, between=between)


def scales_of(result: DeadLoadResult, motion: Motion, **options: Any) -> Findings:
    """Return the scales of a motion at first mechanisms, as `evaluate_scales` does."""
    if "between" in options:  # a list in a study file
        options["between"] = tuple(options["between"])
    with log_prefix(result.case.title, motion.name):
        options |= {"start": result.dead, "damping": result.damping[0]}
        scales = mechanism_scales(result.case.analysis, motion, **options)
    if scales.interrupted:
        raise KeyboardInterrupt
    return {name: scales[name].upper for name in MECHANISM_DEFINITIONS} | {
        f"{name}, survives": scales[name].lower for name in MECHANISM_DEFINITIONS
    }


def evaluate_limit(case: Case) -> Findings:
    """Return the collapse factor of a case by limit analysis, and the size of its mechanism.

    `least_push` is over both senses and the states of the fill, `least_push_on_backing` over those
    with a backing that is given, `least_factor` that of another load over the states. An infinite
    factor never makes a mechanism; NaN is that of a case which does not stand, or of one without a
    state without dilatancy, which `factor_at_most` bounds. `upper_bounds` names findings not proved
    least.
    """
    with result_text.record_doubts(case.structure) as doubts:
        collapse = case.limit.solve(case.structure)
        other = case.limit.opposite if collapse.outcome is not Outcome.INFEASIBLE else None
        senses = [collapse] if other is None else [collapse, other.solve(case.structure)]
    doubts += doubt_fill(compare_with_site(case, *senses), collapse)
    findings: Findings = {"factor": float(collapse.factor)}
    findings |= {"hinges": len(collapse.hinges), "slides": len(collapse.sliding)}
    if collapse.outcome is Outcome.BRACKETED:
        findings["factor_at_most"] = float(collapse.upper)
    searched = [x.bounded or (x.solutions and x.solutions.may_be_less) for x in senses]
    bounds = ["factor"] * bool(searched[0])
    if collapse.over_fill and not collapse.push:
        findings["least_factor"] = float(collapse.range[0])
        bounds += ["least_factor"] * bool(searched[0] or collapse.over_fill.unknown)
    if push := abs(collapse.push):
        unknown = [x.over_fill.unknown for x in senses if x.over_fill]
        factors = [x.factor if x.over_fill is None else x.range[0] for x in senses]
        least, site = push * float(np.min(factors)), site_acceleration(case)
        leasts = {"least_push": least}
        leasts |= {"least_push_over_site": least / site} if site > 0.0 else {}
        over = FillRange.least_of([x.over_fill for x in senses if x.over_fill]).values
        backed = [push * value for key, value in over.items() if key.backing == BACKED]
        leasts |= {"least_push_on_backing": min(backed)} if backed else {}
        bounds += ["push"] * len(bounds) + [*leasts] * any([*searched, *unknown])
        findings = leasts | findings | {"push": push * float(collapse.factor)}
    return findings | _name_bounds(bounds) | _state_doubts(doubts)


def evaluate_assessment(case: Case) -> Findings:
    """Return the least margin of a kinematic assessment and its least α₀, over both senses.

    It is over the states of the fill too, and below 1 where the demand is not withstood.
    """
    with result_text.record_doubts(case.structure) as doubts:
        found = case.assessment.solve(case.structure, case.demand).values()
    doubts += [doubt for each in found for doubt in each.doubts]
    least = {"least_margin": find_margin(found), "alpha_0": min(float(x.alpha_0) for x in found)}
    # another check that is an upper bound is in its doubt, and not in a margin that is exact
    decides = min((x for each in found for _, x in list_ratios(each)), key=lambda x: x.decisive)
    bounds = ["least_margin"] * decides.bounded
    bounds += ["alpha_0"] * any(each.linear.bounded for each in found)
    return least | _name_bounds(bounds) | _state_doubts(doubts)


def evaluate_rating(case: Case) -> Findings:
    """Return the factor of a case in each state of its fill, and the place of the vehicle."""
    with result_text.record_doubts(case.structure) as doubts:
        found = rate_case(case.structure, case.rating, case.limit)
    stated = rating_text.doubt_rating(found, case.limit)
    doubts += [each for each in stated if isinstance(each, Doubt)]
    place = {"position": found.moving.position, "hinges": len(found.moving.worst.hinges)}
    return found.factors | place | _state_doubts(doubts)


def evaluate_comparison(
    case: Case, scales: Mapping[str, Any] | None = None, statements: bool = False
) -> Findings:
    """Return the findings of a case under the one pair of its suite, or of its limit analysis."""
    if case.suite is None:
        return capacity_findings(case)
    result, motion = dead_load_of(case), ground_motion(case)
    joints = criteria.assessed_joints(result.dead.joints)
    findings: Findings = {
        **_describe_first_mode(result),
        **_prefix("role", criteria.part_roles(joints)),
        **_prefix("dead", _largest_by_part(criteria.eccentricity_magnitude(joints))),
    }
    try:
        run = run_motion(result, motion)
    except DidNotConverge as error:
        run = partial_history(error)
    findings |= findings_by_part(run)
    if statements:
        findings |= dead_load_findings(result) | history_findings(run, case)
        findings["pga"] = ground_suite(case).pairs[0].pga
    if scales is not None:
        suite = ground_suite(case)
        # the whole motion: the reduction R of the suite is not applied
        bounds = scales_of(result, suite.pairs[0].scaled(suite.scale), **scales)
        for name, scale in bounds.items():
            definition, survives, _ = name.partition(", survives")
            findings[f"{'survives' if survives else 'scale'}: {definition}"] = scale
    return findings


def findings_by_part(run: History) -> Findings:
    """Return the findings of a run, which may be incomplete."""
    joints, mechanisms = criteria.assessed_joints(run.joints), first_mechanisms(run)
    eccentricity = abs(joints["eccentricity"]).max("time").fillna(0.5)
    friction = joints["friction"].max("time").fillna(np.inf)
    return {
        **_prefix("eccentricity", _largest_by_part(eccentricity)),
        **_prefix("friction", _largest_by_part(friction)),
        **_prefix("mechanism", {name: str(m.kind) if m else "" for name, m in mechanisms.items()}),
        **_prefix("time", {name: m.time if m else np.inf for name, m in mechanisms.items()}),
        "fall": "" if run.fall is None else run.fall.kind,
        "ended": str(run.ending),
        "outcome": run.outcome,
    }


def _prefix(prefix: str, values: Mapping[str, Any]) -> Findings:
    """Prepend a prefix to the names of findings."""
    return {f"{prefix}: {name}": value for name, value in values.items()}


def _largest_by_part(values: xr.DataArray) -> dict[str, float]:
    """Return the largest value over the joints of each part."""
    largest = values.groupby("part").max()
    return dict(zip(largest["part"].values.tolist(), largest.values.tolist(), strict=True))


# Functions that a study file may name
NAMED_EVALUATORS: Mapping[str, Callable[..., Findings]] = {
    "history": evaluate_history,
    "scales": evaluate_scales,
    "dead load": evaluate_dead_load,
    "limit": evaluate_limit,
    "assessment": evaluate_assessment,
    "rating": evaluate_rating,
    "comparison": evaluate_comparison,
}

# SI units of findings by function; findings without one are ratios, counts or words
FINDING_UNITS: Mapping[Callable[..., Mapping[str, Any]], Mapping[str, str]] = {
    evaluate_limit: dict.fromkeys(("push", "least_push", "least_push_on_backing"), "g"),
    evaluate_rating: {"position": "m"},
    evaluate_history: {
        "rotation": "rad",
        **dict.fromkeys(("opening", "slip", "largest_displacement", "residual_displacement"), "m"),
        **dict.fromkeys(ALL_DEFINITIONS, "s"),
    },
    evaluate_dead_load: {"N": "N", "frequency": "Hz"},
}

_registered_findings: dict[str, Callable[..., Findings]] = {}


@validate_arguments
def register_finding(name: str, find: Callable[..., Findings]) -> None:
    """Add a function that studies can name in `compute`.

    Args:
        name: name of the function, without a colon.
        find: function of a `Case`, and of options as keywords, to a flat table of numbers and
            texts; at the top of a module, so that worker processes find it.

    Raises:
        InvalidInput: the function takes no case, or the name is one of archfem's.
    """
    if name in NAMED_EVALUATORS or ":" in name:
        raise InvalidInput(f"finding '{name}': the name has a colon, or is one of archfem's")
    Evaluator.of(find)
    _registered_findings[name] = find


@dataclass(frozen=True)
class Evaluator:
    """A function from a case to findings, with its options."""

    find: Callable[..., Mapping[str, Any]]  # takes a case, and the options as keywords
    options: Mapping[str, Any] = field(default_factory=dict)  # of the function, by name

    @classmethod
    def of(cls, setting: Any) -> "Evaluator":
        """Return the evaluator of a function, a name, or a table of `name` and options."""
        options = dict(setting) if isinstance(setting, Mapping) else {"name": setting}
        setting = options.pop("name", None)
        find = _find_function(setting) if isinstance(setting, str) else setting
        if not callable(find):
            raise InvalidInput(
                f"cannot compute {setting!r}: name one of {sorted(NAMED_EVALUATORS)}, or "
                "'module:function'"
            )
        try:
            inspect.signature(find).bind(None, **options)
        except TypeError as error:
            raise InvalidInput(f"{setting!r} does not take {options}: {error}") from error
        return cls(find, options)

    @property
    def text(self) -> str:
        """Text that identifies function and options: the name, and the source of its module."""
        name = f"{self.find.__module__}:{getattr(self.find, '__qualname__', repr(self.find))}"
        try:
            # the whole module, since the function may call others of it
            source = "".join(inspect.findsource(self.find)[0])
        except (OSError, TypeError):
            source = ""
        return f"{name} {sorted(self.options.items())!r}\n{source}"

    @property
    def name(self) -> str:
        """Name of one of archfem's functions, as study files give it; "" for others."""
        return next((name for name, find in NAMED_EVALUATORS.items() if find is self.find), "")

    @property
    def units(self) -> Mapping[str, str]:
        """SI units of its findings, by name."""
        return FINDING_UNITS.get(self.find, {})

    def digest(self, point: Point) -> str:
        """Return a digest of all that the findings of a point depend on, files included."""
        settings = point.settings
        if self.find.__module__.startswith("archfem."):  # a function of the user may read all
            settings = remove_presentation(settings)
        text = f"{self.text}\n{hash_inputs(settings, point.folder)}"
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    def evaluate(self, case: Case) -> Findings:
        """Return the findings of a case."""
        findings = self.find(case, **self.options)
        if not isinstance(findings, Mapping):
            raise InvalidInput(
                f"compute returned a {type(findings).__name__}: it must return a flat table"
            )
        return {str(key): _to_json(key, value) for key, value in findings.items()}


def refuse_code(setting: Any) -> None:
    """Refuse a function of the user in a study file, since importing it would run its code."""
    name = setting.get("name") if isinstance(setting, Mapping) else setting
    if isinstance(name, str) and ":" in name:
        raise InvalidInput(
            f"compute = '{name}' is code, which no file runs by itself: if you trust it, say so, "
            "archfem study --own-code, or Study.read(…, own_code=True)"
        )


def _find_function(name: str) -> Callable[..., Mapping[str, Any]]:
    """Return a named evaluator, or a function of the user by "module:function"."""
    named = {**NAMED_EVALUATORS, **_registered_findings}
    if name in named:
        return named[name]
    module, colon, function = name.partition(":")
    if not colon:
        hint = suggest_name(name, NAMED_EVALUATORS) or f"use one of {sorted(NAMED_EVALUATORS)}"
        raise InvalidInput(f"cannot compute '{name}': {hint}, or 'package.module:function'")
    try:
        return getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise InvalidInput(f"cannot compute '{name}': {error}") from error


def _to_json(key: str, value: Any) -> float | int | str | list[float]:
    """Convert a finding to a type of JSON."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, bool):
        return int(value)
    if value is None:
        return float("nan")
    if isinstance(value, int | float | str):
        return value
    if isinstance(value, list | tuple) and all(isinstance(each, int | float) for each in value):
        return [float(each) for each in value]
    raise InvalidInput(
        f"finding '{key}' is a {type(value).__name__}: give a number, a text, or a row of numbers"
    )
