"""What a result answers to the report: sentences, rows among the capacities, doubts and notes."""

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from archfem._display import DOUBT_MARK, NOTE_MARK
from archfem.cases.case import Case
from archfem.cases.result_text import ResultTable
from archfem.dynamics.motion_scaling import CollapseScale, MechanismScales
from archfem.limit.fill_range import FillRange
from archfem.limit.rating import Rating
from archfem.motion.hazard import DESIGN_PERIOD, MEASURES
from archfem.motion.matching import DEFAULT_BAND
from archfem.motion.motion import Motion
from archfem.statics.assessment_checks import AssessmentCheck
from archfem.statics.mechanism_assessment import KinematicAssessment
from archfem.units import STANDARD_GRAVITY

# Results by the names of their files
RESULTS = {
    "limit": "limit analysis",
    "thickness": "least thickness",
    "pushover": "pushover",
    "rating": "rating",
    "assessment": "kinematic assessment",
    "scale": "scale of the motion",
    "risk": "annual rate of collapse",
    "modes": "modes",
    "accuracy": "comparison of models and time steps",
    "verdict_range": "range of the verdict over uncertain properties",
}

Row = Sequence[str]  # result, demand, capacity or outcome, factor; "-" where there is none


class Statement(NamedTuple):
    """Decisive sentences of a result, its rows among the capacities, its doubts and notes."""

    sentences: Sequence[str]
    rows: Sequence[Row]
    doubts: Sequence[str] = ()  # lines of the text, or without their mark; also those of notes
    notes: Sequence[str] = ()

    def as_file(self, name: str) -> dict[str, str]:
        """Return name and content of the file beside the text of a result."""
        lines = [*self.doubts, *(f"{NOTE_MARK}{note}" for note in self.notes)]
        doubts = (x.removeprefix(DOUBT_MARK) for x in lines if not x.startswith(NOTE_MARK))
        notes = (x.removeprefix(NOTE_MARK) for x in lines if x.startswith(NOTE_MARK))
        plain = self._replace(
            doubts=list(dict.fromkeys(map(cut_remedy, doubts))), notes=list(dict.fromkeys(notes))
        )
        return {f"{name}.json": json.dumps(plain._asdict(), indent=1)}


def cut_remedy(doubt: str) -> str:
    """Return a doubt without its remedy, which is for who computes, behind the last semicolon."""
    return doubt.rpartition("; ")[0] or doubt


def state_outcome(
    result: str, words: str, doubts: Sequence[str] = (), demand: str = "-", factor: str = "-"
) -> Statement:
    """State one outcome, which is the capacity too."""
    return Statement([f"{result}: {words}"], [(result, demand, words, factor)], doubts)


def state_scale(
    found: CollapseScale | MechanismScales, motion: Motion, doubts: Sequence[str]
) -> dict[str, str]:
    """Return the files with what is stated of a search of scales, and with its runs."""
    demand = f"'{motion.name}', PGA {motion.pga / STANDARD_GRAVITY:.2f} g"
    # what was run between the scales stands in the text
    words, files = repr(found).partition(";")[0], dict[str, str]()
    if isinstance(found, CollapseScale):
        lower = found.held
        files["scale.csv"] = ResultTable(*found.rows()).csv
    else:
        lower = min((found[each] for each in found.definitions), key=lambda x: x.upper).lower
        words += "; a fall was not computed"
    factor = f"{lower:#.3g}" if lower else "-"
    stated = state_outcome(RESULTS["scale"], words, doubts, demand, factor)
    return {**stated.as_file("scale"), **files}


def state_ratings(rated: Sequence[tuple[Rating, Sequence[str]]]) -> Statement:
    """State the factor of each vehicle, by codes too; of the first by pressure and backing."""
    rows, sentences = [], list[str]()
    for found, _ in rated:
        name, factor = found.vehicle.name, "-" if np.isnan(found.factor) else f"{found.factor:.4g}"
        rows.append(("rating", name, f"{found.outcome}, {found.place}", factor))
        for code, (of_code, words) in found.by_codes.items():
            rows.append(("rating", f"{name} {code}", words, f"{of_code:.4g}"))
        own = [repr(found)]
        if factor != "-":
            own = [f"rating for {name}: factor {factor}, {found.outcome}", f"worst {found.place}"]
        sentences += [*own, *found.describe_codes()]
        if found is rated[0][0]:
            sentences += [*found.describe_pressure(), *found.describe_backing()]
    return Statement(sentences, rows, [doubt for _, own in rated for doubt in own])


def state_assessments(found: Mapping[str, KinematicAssessment], doubts: list[str]) -> Statement:
    """State each check of an assessment with the directions in which it holds; the last decides."""
    checks: dict[tuple[str, str], tuple[AssessmentCheck, list[str]]] = {}
    for direction, result in found.items():
        for check, ratios in list_ratios(result):
            checks.setdefault((str(check), ratios), (check, []))[1].append(direction)
    last = [str(result.checks[-1]) for result in found.values()]
    rows, sentences = [], []
    for (text, ratios), (check, directions) in checks.items():
        ways, outcome = " and ".join(directions), check.outcome
        if check.passes and check.at_rest:
            outcome += ", for the mechanism does not begin to move"
        demand, capacity = (f"{x:.4g} {check.unit}" for x in (check.demand, check.capacity))
        name = f"assessment: {check.name}, {ways}"
        rows.append((name, demand, f"{capacity}, {outcome}", ratios))
        sentences += [f"kinematic assessment, {ways}: {text}"] if text in last else []
    sentences.append(describe_margin(found.values()))
    return Statement(sentences, rows, doubts, [x for each in found.values() for x in each.notes])


def list_ratios(found: KinematicAssessment) -> list[tuple[AssessmentCheck, str]]:
    """List the checks of an assessment with their ratios; with one weight a body if it is less."""
    listed = []
    for check, whole in zip(found.checks, (found.of_bodies or found).checks, strict=True):
        beside = [f"{check.moved:.3g} by displacements"] * (check.at_rest and not check.over_fill)
        less = whole.ratio < 0.999 * check.least
        beside += [f"{whole.ratio:.3g} with one weight a body"] * less
        listed.append((check, check.ratios + f" ({'; '.join(beside)})" * bool(beside)))
    return listed


def describe_margin(found: Iterable[KinematicAssessment]) -> str:
    """Describe the least ratio of all checks, and its range over what is assumed of a fill."""
    listed = [each for result in found for each in list_ratios(result)]
    check, ratios = min(listed, key=lambda each: each[0].least)
    same = [x.over_fill for x, _ in listed if x.name == check.name and x.over_fill is not None]
    if same:
        over = FillRange.least_of(same)
        ratios = ratios.replace(check.ratios, over.describe(digits=3))
        return f"least margin {ratios}, by {check.name}: {over.outcome}"
    return f"least margin {ratios}, by {check.name}: {check.outcome}"


def note_band(case: Case, found: Iterable[KinematicAssessment]) -> list[str]:
    """Return a note where motions are matched up to a shorter period than that of a check."""
    low, high = DEFAULT_BAND
    longer = [each.checks[-1].period for each in found if each.checks[-1].period > high]
    if not longer or not (case.suite or {}).get("matched", False):
        return []
    return [
        f"{NOTE_MARK}the motions of the suite are matched from {low:g} to {high:g} s, and T = "
        f"{max(longer):.2f} s is longer: there they may be weaker than the spectrum; judge their "
        "displacements by the figure of spectra"
    ]


def state_risk(found: Any) -> Statement:  # of `archfem.studies`, a room to the right
    """State the annual rate, the hazard by its return periods, and the median of the falls."""
    hazard, median, rate = found.hazard, found.fragility().median, found.rate()
    name, unit = hazard.measure.upper().replace("_AVG", ", mean,"), MEASURES[hazard.measure]
    years = 1.0 / hazard.rate if len(hazard.rate) <= 4 else np.array([DESIGN_PERIOD])
    sizes = hazard.intensity_of(years)
    listed = ", ".join(f"{value:.3g}" for value in sizes)
    demand = f"{name} {listed} {unit} once in {', '.join(f'{each:.4g}' for each in years)} years"
    outcome = f"median {name} {median:.3g} {unit}, falls at {rate.rate:.2g} a year"
    factors = zip(sizes, years, strict=True)
    factor = ", ".join(f"{median / size:.3g} on {each:.4g} years" for size, each in factors)
    text = (
        f"the structure falls at {rate}; in half of the cases from {median:.3g} {unit} of {name}; "
    )
    text += hazard.origin
    row = "annual rate", demand, outcome, factor
    return Statement([text], [row], list(map(str, found.doubts)))
