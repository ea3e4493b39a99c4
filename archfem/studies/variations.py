"""Variations of a run: the same motion over uncertain properties of structure and model.

Joint rule, stiffness, friction, damping, sign of the motion and time step are varied one at a time
and all together, by a Latin hypercube. The result is the share of runs in which the structure
falls, and the properties that decide it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import qmc

from archfem._typing import Flags
from archfem._validation import check_integer, validate_arguments
from archfem.cases.case import Case
from archfem.cases.defaults import list_default_keys
from archfem.cases.rating_text import ALL_AT_ONCE, AT_ONCE_BY_CS454, NOT_COMPUTED
from archfem.cases.result_text import ResultTable
from archfem.cases.structure_keys import PRESETS, find_table
from archfem.cases.toml_file import Table, format_key
from archfem.cases.verdict_keys import DEFAULT_RANGES, NEUTRAL, check_ranges, default_ranges
from archfem.dynamics.analysis import Analysis, with_one_facet
from archfem.dynamics.collapse_state import (
    UNDECIDED,
    CollapseState,
    classify_collapse,
    doubt_soft_blocks,
    doubt_standing,
)
from archfem.dynamics.damping import damping_kind, resolve_effective_damping, vary_damping
from archfem.dynamics.loose_fill import loosen_fill
from archfem.dynamics.motion_scaling import OWN_STEP, CollapseScale
from archfem.dynamics.recorder import Record
from archfem.dynamics.rigid_body.bodies import LooseBlocks
from archfem.dynamics.rigid_body.simulation import RigidBlockSimulation
from archfem.dynamics.schemes import Conserving, EffectiveDamping, Viscous, interpret_damping
from archfem.dynamics.verdict_range import VerdictRange
from archfem.errors import DidNotConverge, InvalidInput, InvalidStructure, logger
from archfem.limit.fill_strength import PlasticFill, has_backing
from archfem.limit.rating import Rating, rate_again
from archfem.limit.vehicles import with_cs454
from archfem.limit.worst_places import ASSUMED_STRENGTH
from archfem.masonry.joint_closing import with_finish
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_words, with_contacts
from archfem.models.model import Doubt, write_doubts
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import MAX_SLIP_AT_REST, slips_at_rest
from archfem.statics.fill_checks import fill_doubts
from archfem.studies.evaluators import PreparedRuns
from archfem.studies.parameter_space import Point, WholePoint
from archfem.studies.result_store import evaluate_with_progress
from archfem.units import MPa, in_degrees, in_unit

# Row of a rating with abutments that move
FREE = "abutments free"

# Least coefficient of friction of a variation [-]
LEAST_FRICTION = 0.05

# A property that is varied beside a rating, its value in words, and keys of the case with it
Change = tuple[str, str, dict[str, Any]]


@dataclass(frozen=True, eq=False)
class Variation(WholePoint):
    """One run of the range: the settings as given, and the changed values by name."""

    analysis: Analysis = field(repr=False)
    motion: Motion = field(repr=False)
    changes: tuple[tuple[str, Any], ...]


@validate_arguments
def verdict_range(  # noqa: PLR0913  (one call, one argument for each thing that may vary)
    structure: Structure | Analysis,
    motion: Motion,
    *,
    damping: Viscous | EffectiveDamping | str | None = None,
    dt: float | None = None,
    fidelity: str | None = None,
    vary: Mapping[str, Any] | None = None,
    samples: int = 236,
    seed: int = 0,
    workers: int = 1,
    folder: str | Path | None = None,
) -> VerdictRange:
    """Run a structure under a motion with large displacements, for ranges of uncertain properties.

    The run as given is the first, followed by each property at each of its values alone. A Latin
    hypercube over all is last (McKay, Beckman and Conover, 1979). By default these are varied:

    - "joint_rule": "exact" integration over each joint, "three points" (springs at its ends and
      middle), and "rigid" blocks in contact, without elastic joints or damping;
    - "k_n" and "k_s": factors from 1/3 to 3 on the stiffness of the joints, or over the range of
      their finish (`joint_stiffness` by the median depth of its joints), evenly in logarithm;
    - "friction": -0.1 to 0.1, added to each coefficient that is given, at least to 0.05;
    - "damping_ratio": factors from 0.5 to 2; "damping_kind": "stiffness", or "mass and stiffness"
      (`Rayleigh`), which drags loose blocks;
    - "sign": the motion "as given" or "reversed" along x; "dt": the step "as given" or "half".

    Args:
        structure: structure of free and fixed blocks, or an `Analysis`, whose settings are then
            those of the run as given, but for large displacements.
        motion: ground acceleration.
        damping: damping as given, as for `time_history`; by default that of the analysis, or
            "effective" for a structure. An undamped run has no damping to vary.
        dt: time step as given [s]; by default that of the analysis, or 5 ms.
        fidelity: fidelity of the blocks with elastic joints; by default that of the analysis, or
            "rigid" for a structure and in place of "auto".
        vary: values by name, for those of the default ranges: numbers are the ends of a range, and
            a single value holds a property there. Also "finish", some of "as given", "sawn",
            "dressed", "hewn" and "weathered"; all joints of stones then have its usual law of
            closing (`joint_stiffness`, by strength and modulus of the stone); "scale", factors on
            the motion; and any other name with a mapping from labels to structures or to motions.
        samples: number of runs of the Latin hypercube, beside up to 14 by the default ranges that
            change one property or none. The default takes less than a minute for a
            ring of 17 stones over 8 s on two cores. It gives a share of 5 % to ± 3 %.
        seed: seed of its random numbers.
        workers: number of processes.
        folder: folder that keeps finished runs, from which the same call continues.

    Returns:
        All runs. A run without an equilibrium counts neither as standing nor as fallen.

    Raises:
        InvalidInput: an argument is out of range, or a name or value is unknown.
        DidNotConverge: the structure as given does not stand under dead load.
    """
    check_integer(samples, "samples")
    analysis = as_falling(structure, fidelity, damping, dt)
    rest = analysis.dead_load(motion)  # a structure that does not stand is refused before any run
    viscous, _ = resolve_effective_damping(analysis.damping, rest.model, rest)
    defaults = default_ranges(analysis.structure)
    if viscous is None:
        defaults = {name: defaults[name] for name in defaults if not name.startswith("damping")}
    ranges = check_ranges({**defaults, **(vary or {})})
    neutral = {**NEUTRAL, "damping_kind": damping_kind(viscous)}
    # the run as given, and each property at each other value alone
    changes = [{}, *({k: x} for k, row in ranges.items() for x in row if x != neutral.get(k))]
    changes += sample_changes(ranges, samples, seed)
    variations = [Variation(analysis, motion, _resolve_labels(ranges, each)) for each in changes]
    points = list(enumerate(variations))
    name = f"range of {motion.name or 'the motion'}"
    rows = dict(evaluate_with_progress(points, evaluate_variation, workers, name, folder))
    dataset = _build_dataset(ranges, changes, [rows[k] for k in range(len(points))], neutral)
    dataset["sampled"] = "run", np.arange(len(points)) >= len(points) - samples
    named = [each for row in ranges.values() if isinstance(row, dict) for each in row.values()]
    several = any(isinstance(each, Motion) for each in named)
    dataset.attrs["motion"] = "" if several else motion.name
    structures = [analysis.structure, *(each for each in named if isinstance(each, Structure))]
    doubts = [*rest.model.doubts, *fill_doubts(analysis.structure)]
    if isinstance(structure, Analysis) and analysis.fidelity != structure.fidelity:
        doubts = [_blame_variations(each, analysis.fidelity) for each in doubts]
    doubts += doubt_soft_blocks(*structures)
    steps = [row["found"].get("admissible_step", inf) for row in rows.values()]
    lacking = [row["found"].get("lacks_joints", False) for row in rows.values()]
    # rigid blocks have steps of their own
    halved = [x.get("dt") == "half" and x.get("joint_rule") != "rigid" for x in changes]
    doubts += doubt_runs(steps, lacking, analysis.dt, halved=np.array(halved))
    outcomes, residuals = dataset["outcome"].values, dataset["residual"].values
    doubts += doubt_standing(analysis.structure, outcomes, residuals)
    dataset.attrs["doubts"] = write_doubts(doubts)
    contacts = [joint.contact for joint in analysis.structure.joints]
    dataset.attrs["k_n"] = float(np.mean([contact.normal_stiffness for contact in contacts]))
    dataset.attrs["k_s"] = float(np.mean([contact.shear_stiffness for contact in contacts]))
    return VerdictRange(dataset)


def _blame_variations(doubt: Doubt, fidelity: object) -> Doubt:
    """Return the doubt of a fidelity that the case has not, but its variations take."""
    if not doubt.remedy.startswith(f"'{fidelity}' is wrong"):
        return doubt
    remedy = (
        f"the variations take them as '{fidelity}', and the case's own fidelity was not varied: "
        "judge by its runs, or vary it by af.verdict_range(case.analysis, motion)"
    )
    return replace(doubt, remedy=remedy)


def doubt_runs(
    admissible: Sequence[float],
    lack_joints: Sequence[bool],
    dt: float | None,
    runs: str = "runs",
    halved: Flags | None = None,
) -> Iterator[Doubt]:
    """Yield doubts where steps are too long for sliding, or joints lack, in runs or samples.

    Admissible steps are infinite where those of the run follow. Of runs some may have half the
    step; where all of these follow, it is the remedy, as of other steps others may not follow.
    """
    of, long = f"in {{}} of {len(admissible)} {runs}", np.array(admissible) < inf
    if long.any() and dt is not None:
        step, why, half = min(admissible), "or less, and repeat this while any is in doubt", ""
        if halved is not None:
            half = " or half of it"
            if halved.any() and not long[halved].any():
                step, why = 0.5 * dt, f"with which none of {halved.sum()} runs is in doubt"
            why += "; without dt, a single run varies its steps, and has no such doubt"
        words = f"{of} the steps, {1e3 * dt:g} ms{half}, are long for sliding"
        remedy = f"take {1e3 * step:g} ms, `--set analysis.dt={step:g}`, {why}"
        yield Doubt(words, remedy, (int(long.sum()),))
    if lacking := int(sum(lack_joints)):
        words = "blocks were loose, without elastic joints, before strong motion was over, and none"
        remedy = "`archfem run CASE.toml` says which stones met, and what to do"
        yield Doubt(f"{of} {words} fell", remedy, (lacking,))


def as_falling(
    structure: Structure | Analysis,
    fidelity: str | None = None,
    damping: Viscous | EffectiveDamping | str | None = None,
    dt: float | None = None,
) -> Analysis:
    """Return an analysis with large displacements, which keeps nothing but the outcome of a run."""
    if isinstance(structure, Structure):
        structure = Analysis(structure, fidelity="rigid", damping="effective")
    structure = with_one_facet(structure)
    return replace(
        structure,
        fidelity=fidelity or ("rigid" if structure.selects_model else structure.fidelity),
        damping=interpret_damping(damping) or structure.damping,
        dt=dt or structure.dt or OWN_STEP,
        displacements="large",
        scheme=Conserving(),
        until=None,
        record=Record(),
    )


def verdict_range_of_bracket(
    bracket: CollapseScale, structure: Structure, motion: Motion, **options: Any
) -> VerdictRange:
    """Run a structure over its uncertain properties, and over motion scales within a bracket."""
    if bracket.lower == 0.0:
        raise InvalidInput(
            "it fell at the smallest scale that was tried, so that no scale is known to stand: "
            "search from a smaller one, between=(…, …)"
        )
    ratio = bracket.upper / bracket.lower if bracket.upper < inf else 2.0
    vary = {"scale": (1.0, ratio), **options.pop("vary", {})}
    return verdict_range(structure, motion.scaled(bracket.lower), vary=vary, **options)


def sample_changes(ranges: Mapping[str, Any], samples: int, seed: int) -> list[dict[str, Any]]:
    """Return a Latin hypercube over all properties."""
    shares = qmc.LatinHypercube(d=len(ranges), seed=seed).random(samples)
    return [
        {name: _value_at(ranges[name], share) for name, share in zip(ranges, row, strict=True)}
        for row in shares
    ]


def draw_samples(
    ranges: Mapping[str, Any],
    weights: Mapping[str, float],
    records: int,
    begin: int,
    size: int,
    seed: int,
) -> tuple[list[dict[str, Any]], Any, Any]:
    """Return properties, alternative and record of the samples of one hypercube."""
    # that of samples added later has a seed of its own, and leaves those before as they are
    own = int(np.random.SeedSequence([seed, begin]).generate_state(1)[0]) if begin else seed
    random = np.random.default_rng(own)
    # alternatives in proportion to their weights, in random order
    shares = (random.permutation(size) + random.random(size)) / size
    places = np.searchsorted(np.cumsum([*weights.values()])[:-1], shares, side="right")
    # all records in random order before any again
    dealt = np.concatenate([random.permutation(records) for _ in range(-(-size // records))])
    return sample_changes(ranges, size, own), np.array([*weights])[places], dealt[:size]


def _resolve_labels(
    ranges: Mapping[str, Any], changes: Mapping[str, Any]
) -> tuple[tuple[str, Any], ...]:
    """Return the changes with structures and motions in place of their labels."""
    return tuple(
        (name, ranges[name][value] if isinstance(ranges[name], Mapping) else value)
        for name, value in changes.items()
    )


def _value_at(values: Any, share: float) -> Any:
    """Return the value at a share of a range: a label, or a number between the ends."""
    options = list(values)
    if isinstance(options[0], str):
        return options[int(share * len(options))]
    low, high = min(options), max(options)
    # factors over more than twice are spread evenly in their logarithm
    if low > 0.0 and high / low > 2.0:
        return float(low * (high / low) ** share)
    return float(low + share * (high - low))


def evaluate_variation(variation: Variation) -> dict[str, Any]:
    """Return outcome, displacements and time of collapse of one run."""
    analysis, motion = variation.analysis, variation.motion
    structure, changes = analysis.structure, {**NEUTRAL, **dict(variation.changes)}
    for value in changes.values():
        structure = value if isinstance(value, Structure) else structure
        motion = value if isinstance(value, Motion) else motion
    motion = motion.scaled(changes["scale"])
    if changes["sign"] == "reversed":
        motion = motion.reversed()
    runs = prepare_runs(replace(analysis, structure=structure), changes)
    state = runs(motion)
    time = np.nan if state.time is None else state.time
    same = ("displacement", "residual", "admissible_step", "lacks_joints")
    kept = {"outcome": state.kind, "time": time, "slip_at_rest": getattr(runs, "slip_at_rest", 0.0)}
    return kept | {name: getattr(state, name) for name in same}


class FallingRuns(PreparedRuns):
    """Runs of a structure with elastic joints, of which the states of collapse alone are kept."""

    def __call__(self, motion: Motion) -> CollapseState:
        """Return the state of collapse after a motion."""
        history = self.run(motion)
        if history.fall is None:
            raise DidNotConverge(f"the run {history.outcome}", last=None)
        return history.fall

    @property
    def slip_at_rest(self) -> float:
        """How far shear displaces joints under dead load; runs of rigid blocks have none [m]."""
        return 0.0 if self.rest is None else float(slips_at_rest(self.rest.joints).max())


def prepare_runs(
    analysis: Analysis, changes: Mapping[str, Any]
) -> Callable[[Motion], CollapseState]:
    """Return a function from motions to the states of collapse of a changed structure."""
    changes = {**NEUTRAL, **changes}
    assert analysis.dt is not None
    dt = analysis.dt * (0.5 if changes["dt"] == "half" else 1.0)
    if changes["joint_rule"] == "rigid":
        return partial(_run_rigid_blocks, _vary_contacts(analysis.structure, changes), dt=dt)
    three = changes["joint_rule"] == "three points"
    rule: Any = {"quadrature": "trapezoidal", "quadrature_points": 3} if three else {}
    rule = {"quadrature": "exact", "quadrature_points": None, **rule}
    return FallingRuns(**vars(change_properties(replace(analysis, dt=dt, **rule), changes)))


def change_properties(analysis: Analysis, changes: Mapping[str, Any]) -> PreparedRuns:
    """Return the runs of a structure whose joints and damping are changed."""
    changes = {**NEUTRAL, **changes}
    analysis = replace(analysis, structure=_vary_contacts(analysis.structure, changes))
    rest = analysis.dead_load()
    kind, factor = changes.get("damping_kind"), changes["damping_ratio"]
    damping = vary_damping(analysis.damping, rest.model, rest, kind, factor)
    return PreparedRuns(analysis, rest, damping)


def _vary_contacts(structure: Structure, changes: Mapping[str, Any]) -> Structure:
    """Return the structure with other laws of closing, stiffness and friction of its joints."""
    if all(changes[name] == NEUTRAL[name] for name in ("finish", "k_n", "k_s", "friction")):
        return structure
    if changes["finish"] != "as given":
        structure = with_finish(structure, changes["finish"])
    return with_contacts(
        structure,
        lambda given: replace(
            given,
            normal_stiffness=changes["k_n"] * given.normal_stiffness,
            shear_stiffness=changes["k_s"] * given.shear_stiffness,
            friction=max(given.coefficient + changes["friction"], LEAST_FRICTION),
        ),
    )


def _run_rigid_blocks(structure: Structure, motion: Motion, *, dt: float) -> CollapseState:
    """Run rigid blocks in contact, and return their state of collapse."""
    # fill as a rigid body would hold the stones in their places
    loose = loosen_fill(structure, LooseBlocks.as_built(structure), {})
    # impulses need shorter steps than elastic joints
    simulation = RigidBlockSimulation(loose.structure, dt=min(dt / 2.5, 2e-3))
    end = motion.duration + 20.0  # time in which blocks settle [s]
    frames = simulation.frames(loose.start, end, motion, spacing=0.05)
    found = classify_collapse(structure, map(loose.restore, frames))
    if found.kind == UNDECIDED:
        raise DidNotConverge(f"by {end:.4g} s it is {found.text}", last=None)
    return found


def _build_dataset(
    ranges: Mapping[str, Any],
    changes: Sequence[Mapping[str, Any]],
    rows: Sequence[Mapping[str, Any]],
    neutral: Mapping[str, Any],
) -> xr.Dataset:
    """Return the table of all runs; a property that a run does not change has its neutral value."""
    columns: dict[str, Any] = {}
    for name, values in ranges.items():
        first = "as given" if isinstance(values, Mapping) else neutral[name]
        columns[name] = "run", np.array([change.get(name, first) for change in changes])
    columns["outcome"] = "run", np.array([row["found"].get("outcome", "unknown") for row in rows])
    for name, unit in (("displacement", "m"), ("residual", "m"), ("time", "s")):
        values = np.array([row["found"].get(name, np.nan) for row in rows])
        columns[name] = "run", values, {"units": unit}
    columns["error"] = "run", np.array([str(row["error"]) for row in rows])
    slips = np.array([row["found"].get("slip_at_rest", 0.0) for row in rows])
    if (slips > MAX_SLIP_AT_REST).any():  # else no run is in doubt by them
        columns["slip_at_rest"] = "run", slips, {"units": "m"}
    return xr.Dataset(columns, attrs={"properties": list(ranges)})


@dataclass(frozen=True, eq=False)
class RatingVariation(WholePoint):
    """A rated bridge, and the keys of its case with other values."""

    inputs: str  # digest of all that the rating as given depends on
    changes: tuple[tuple[str, Any], ...]
    base: Case = field(repr=False, compare=False)  # with [rating] of one vehicle
    found: Rating = field(repr=False, compare=False)


def evaluate_rating_variation(variation: RatingVariation) -> dict[str, float]:
    """Return the factor of a bridge with changed properties."""
    other = Point.of(variation.base, variation.changes).case
    given = other.rating.get("width"), other.limit.resistance
    return {"factor": rate_again(variation.found, other.structure, given[0], **given[1])}


def vary_rating(
    case: Case, rating: Mapping[str, Any], found: Rating, folder: str | Path | None = None
) -> tuple[ResultTable, list[str], int]:
    """Rate the bridge of a case with other properties, one at a time and the worst at once.

    Args:
        case: case of the bridge.
        rating: [rating] of one vehicle.
        found: rating with the properties of the case.
        folder: folder that keeps finished variations, from which the same call continues.

    Returns:
        Table of properties and factors, the worst first; the range, and the first quantity to
        measure, in words; and how many variations are left after Ctrl-C.

    Raises:
        InvalidInput: the fill is a plastic one.
    """
    if isinstance(found.fill, PlasticFill):
        raise InvalidInput('a rating is varied with fill of law "pressure", not with "plastic"')
    case = Case.of({**case.settings, "rating": dict(rating)}, case.folder)
    listed = [*_list_rating_changes(case, found)]
    changes = {name: change for _, name, change in listed}
    known = {"the values of the case": found.factor}
    if found.fill is not None:
        known |= {"no pressure of the fill": np.nan_to_num(found.without_pressure)}
        known |= {"its active pressure alone": np.nan_to_num(found.active_alone)}
        known |= {"all of its passive pressure": found.full_pressure}
        none = {"limit.fill.mobilisation": 0.0, "limit.fill.active": 0.0}
        listed.append(("pressure", "no pressure of the fill", none))
        alone = {"limit.fill.mobilisation": 0.0, "limit.fill.active": 1.0}
        listed.append(("pressure", "its active pressure alone", alone))
        listed.append(("pressure", "all of its passive pressure", {"limit.fill.mobilisation": 1.0}))
    if has_backing(found.fill):
        known |= {"no backing": np.nan_to_num(found.without_backing)}
        given = [f"limit.fill.{x}" for x in case.settings["limit"]["fill"] if "backing" in x]
        listed.append(("backing", "no backing", {"remove": given}))
    if found.crushing:
        name = f"stones of {ASSUMED_STRENGTH / MPa:g} MPa that crush"
        known[name] = np.nan_to_num(found.crushing["factor"])
        listed.append(("strength", name, {"limit.strength": ASSUMED_STRENGTH}))
    known |= _rate_changed(case, found, changes, folder)
    if known.keys() >= changes.keys():
        known |= _rate_at_once(case, found, _merge_worst(listed, known), folder)
    of_all = [ALL_AT_ONCE, *[AT_ONCE_BY_CS454] * bool(found.by_cs454)]
    late = [name for name in (*changes, *of_all) if name not in known]
    order = sorted(known, key=lambda name: np.nan_to_num(known[name], nan=inf))
    rows = [[name, f"{known[name]:.4g}".replace("nan", "-")] for name in order]
    rows += [[name, NOT_COMPUTED] for name in late]
    if np.isclose(known.get(FREE, inf), found.factor, rtol=1e-3):
        _, arguments = case.structure.origin or ("", {})
        walls = (f"{x.height:.3g} m high on {x.length:.3g} m" for x in arguments["sidewalls"])
        of_free = next(row for row in rows if row[0] == FREE)
        of_free[0] += f", no change: {join_words([*dict.fromkeys(walls)])} they do not move"
    rows = [[name, "does not stand" if cell == "0" else cell] for name, cell in rows]
    name = found.vehicle.name
    words = _say_spreads(name, listed, known, len(late))
    return ResultTable([f"{found.label} with", "factor"], rows), words, len(late)


def _rate_at_once(
    case: Case, found: Rating, worst: dict[str, Any], folder: str | Path | None
) -> dict[str, float]:
    """Return the factor with the worst of each property at once, and that by CS 454.

    A width by rule is the share of that of the changed bridge, whose cover may be less.
    """
    if "rating.width" in worst and found.is_width_by_rule:
        others = [(key, value) for key, value in worst.items() if key != "rating.width"]
        rule = found.vehicle.spread_over(Point.of(case, others).case.structure)
        worst = worst | {"rating.width": worst["rating.width"] * rule / found.width}
    known = _rate_changed(case, found, {ALL_AT_ONCE: worst}, folder)
    if known and found.by_cs454:
        other = with_cs454(found.vehicle)
        (live, impact), axle = other.factors, {"rating.vehicle.impact_on": other.impact_on}
        worst = worst | {"rating.live": live, "rating.impact": impact, **axle}
        driven = replace(found, vehicle=other, live=live, impact=impact)
        known |= _rate_changed(case, driven, {AT_ONCE_BY_CS454: worst}, folder)
    return known


def _merge_worst(listed: Sequence[Change], known: Mapping[str, float]) -> dict[str, Any]:
    """Return the changed keys of a case with the worst value of each property."""
    worst = dict[str, tuple[float, dict[str, Any]]]()
    for subject, name, change in listed:
        if known[name] < worst.get(subject, (known["the values of the case"],))[0]:
            worst[subject] = known[name], change
    return {key: value for _, change in worst.values() for key, value in change.items()}


# Quantities that no measurement finds, in words
_UNMEASURED = {
    "pressure": "pressure of the fill, which is assumed",
    "width": "width that carries a vehicle, a rule",
}


def _say_spreads(
    vehicle: str, listed: Sequence[Change], known: Mapping[str, float], late: int
) -> list[str]:
    """Return the range of single changes, all at once, and all quantities by their effect."""
    given = known["the values of the case"]
    single = {k: x for k, x in known.items() if ALL_AT_ONCE not in k and np.isfinite(x)}
    least, most = min(single, key=single.__getitem__), max(single, key=single.__getitem__)
    missing = f"; {late} variations were not computed" if late else ""
    at_once = f"; {ALL_AT_ONCE} {known[ALL_AT_ONCE]:.4g}" if ALL_AT_ONCE in known else ""
    range_text = (
        f"one property at a time changes the factor of {vehicle}, {given:.4g}, to "
        f"{single[least]:.4g} ({least}) at least and {single[most]:.4g} ({most}) at most"
        f"{at_once}{missing}"
    )
    ends = dict[str, list[float]]()
    for subject, name, _ in listed:
        if name in single:
            ends.setdefault(subject, [given]).append(single[name])
    order = sorted(ends, key=lambda subject: -float(np.ptp(ends[subject])))
    spreads = [
        f"{_UNMEASURED.get(each, each)} ({min(ends[each]):.4g} to {max(ends[each]):.4g})"
        for each in order
        if np.ptp(ends[each]) > 1e-4 * given  # digits that are printed
    ]
    return [range_text, *[f"measure first, for {vehicle}: {', '.join(spreads)}"] * bool(spreads)]


def _rate_changed(
    case: Case, found: Rating, changes: Mapping[str, dict[str, Any]], folder: str | Path | None
) -> dict[str, float]:
    """Return the factor with each change by its name, up to Ctrl-C.

    It is 0 where the bridge does not stand, and NaN where there is no such bridge.
    """
    names, inputs, factors = [*changes], case.hash_inputs(), dict[str, float]()
    given = [RatingVariation(inputs, tuple(each.items()), case, found) for each in changes.values()]
    evaluate = partial(evaluate_with_progress, name="variations of the rating", folder=folder)
    with suppress(KeyboardInterrupt):
        for k, row in evaluate([*enumerate(given)], evaluate_rating_variation, 1):
            factors[names[k]] = np.nan if row["error"] else np.nan_to_num(row["found"]["factor"])
            # rings may not fit on a narrower pier
            if row["error"] and not row["error"].startswith(InvalidStructure.__name__):
                logger.warning("%s: %s", names[k], row["error"])
    return factors


def _list_rating_changes(case: Case, found: Rating) -> Iterator[Change]:
    """Yield properties varied beside a rating, values in words, and keys of the case with them."""
    yield from _list_changed_lengths(case, found)
    fixed = _list_keys(case.settings["structure"], ("state",))
    if free := {path: "free" for path, state in fixed if state == "fixed"}:
        yield "abutments", FREE, free
    yield from _list_changed_weights(case)
    if np.isfinite(found.strength):
        half = {"limit.strength": 0.5 * found.strength}
        yield "strength", "half the strength of the stones", half
    for section in ("limit", "structure"):  # as weight and pressure, or in pieces
        fill = case.settings.get(section, {}).get("fill", {})
        for by in (-5.0, 5.0) if "friction_angle" in fill else ():
            angle = in_degrees(fill["friction_angle"], "angle of friction") + by
            change_of_fill = {f"{section}.fill.friction_angle": f"{angle:.17g} degree"}
            yield "friction angle of the fill", f"fill of {angle:.3g}°", change_of_fill
    contacts = {joint.contact for joint in found.structure.joints if joint.contact.slides}
    keys = {find_table(case.settings, each)[0]: each.coefficient for each in contacts}
    # that between pieces of fill has no table
    known = {*PRESETS["contacts"], *case.settings.get("contacts", {})} & keys.keys()
    for by in DEFAULT_RANGES["friction"] if known and case.limit.friction else ():
        name = f"{abs(by):g} {'less' if by < 0.0 else 'more'} friction of joints"
        changed = {key: max(keys[key] + by, LEAST_FRICTION) for key in sorted(known)}
        paths = {f"contacts.{format_key(key)}.friction": x for key, x in changed.items()}
        yield "friction of joints", name, paths
    for share in (0.9, 1.1):
        width = min(share * found.width, found.structure.width)
        yield "width", f"a vehicle on {width:.3g} m", {"rating.width": width}


def _list_changed_lengths(case: Case, found: Rating) -> Iterator[Change]:
    """Yield rings, piers and cover likewise."""
    every = _list_keys(case.settings["structure"], ("thickness", "breadth", "gap", "cover"))
    lengths = {path: in_unit(value, "m", path) for path, value in every}
    breadth = min((x.depth for x in found.structure.joints if x.role == "pier"), default=0.0)
    rows: tuple[tuple[str, str, Callable[[float, float], float]], ...] = (
        ("thickness", "rings a tenth thinner, rings a tenth thicker", lambda x, by: x + by * x),
        ("breadth", "piers a tenth narrower, piers a tenth broader", lambda x, by: x + by * x),
        ("gap", "piers a tenth narrower, piers a tenth broader", lambda x, by: x + by * breadth),
        ("cover", "0.1 m less cover, 0.1 m more cover", lambda x, by: max(x + by, 0.02)),
    )
    for key, names, change in rows:
        paths = {path: x for path, x in lengths.items() if path.endswith(f".{key}")}
        for name, by in zip(names.split(", "), (-0.1, 0.1), strict=True) if paths else ():
            subject = "cover" if key == "cover" else name.split()[0]
            yield subject, name, {path: change(x, by) for path, x in paths.items()}


def _list_changed_weights(case: Case) -> Iterator[Change]:
    """Yield likewise the weights of fill, which scatter, and those that the case does not give."""
    blocks = case.structure.blocks
    of_fill = {blocks[number].material for number in find_yielding_blocks(case.structure)}
    for material in dict.fromkeys(block.material for block in blocks):
        if material in of_fill or "unit_weight" in list_default_keys(case, material):
            key, name = find_table(case.settings, material)[0], material.name
            key = f"materials.{format_key(key)}.unit_weight"
            for by, words in ((0.9, "a tenth lighter"), (1.1, "a tenth heavier")):
                yield f"weight of {name}", f"{name} {words}", {key: by * material.unit_weight}


def _list_keys(table: Table, keys: Sequence[str], path: str = "structure") -> Iterator[Any]:
    """Yield path and value of some keys in the tables of a structure."""
    for key, value in table.items():
        place = f"{path}.{format_key(key)}"
        if isinstance(value, Mapping) and key != "paving":
            yield from _list_keys(value, keys, place)
        elif key in keys:
            yield place, value
