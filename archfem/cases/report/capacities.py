"""Demands and capacities of a report: one row for each check, with its factor and doubt."""

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from archfem._files import group_of, read_file_list
from archfem.cases import result_text
from archfem.cases.answers import RESULTS, Row
from archfem.cases.defaults import say_loads_left_out
from archfem.cases.push_factors import peak_of_spectrum, site_acceleration
from archfem.cases.rating_text import ONLY
from archfem.cases.report import outcomes
from archfem.cases.report.doubts import (
    HISTORIES,
    MAX_RATIO_OF_PEAKS,
    VARIATIONS,
    list_decisive_doubts,
    list_doubts,
    peak_of_ground,
    read_spectrum,
    spans_run,
)
from archfem.cases.report.motion_rules import is_of_norm
from archfem.cases.report.report_data import ReportData
from archfem.cases.run import CASE_FILE
from archfem.dynamics.collapse_state import FALLEN_STATES
from archfem.dynamics.rigid_body.rocking_body import describe_first_fall
from archfem.dynamics.walls_across import SCALES_ACROSS
from archfem.limit.instability import list_margins_at_rest
from archfem.masonry.structure import join_words
from archfem.models.model import Doubt
from archfem.units import STANDARD_GRAVITY, Ends, format_mm, format_ratio
from archfem.view.pages.document import Grid

# Fidelity of the variations of a verdict
VARIED_FIDELITY = "rigid"

# What the factors of results are, as multiples of their demands
_FACTORS = {
    "assessment": "a check is just passed",
    **dict.fromkeys(("limit", "pushover", "rating"), "a load makes a mechanism"),
    "scale": "up to it no fall or dislocation",
    "thickness": "of a thickness, the given over the least",
    "risk": "half a probability of a fall",
}


def list_demands(data: ReportData) -> Iterator[tuple[str, Ends, str, list[str]]]:
    """Yield each demand of an earthquake: name, peaks [g], source in the case, and results."""
    case, limit = data.case, data.case.limit.demand
    pushes = [RESULTS[name] for name in ("limit", "pushover") if name in data.statements]
    if data.runs:
        # whole motions: the ground of a run ends with it
        up = [x.vertical for x in data.motions.values() if x.vertical is not None]
        vertical = max((np.abs(x).max().item() for x in up), default=0.0) / STANDARD_GRAVITY
        with_vertical = f", with vertical ones of up to {vertical:.2g} g"
        also = with_vertical if vertical else ", without vertical ones"
        peaks, source = map(peak_of_ground, data.runs.values()), "[suite]"
        used = ["time histories, and what varies or scales them"]
        yield f"motions{also}", Ends.of(peaks), source if case.suite else "[motion]", used
    if limit is not None:
        yield "push", Ends.of([limit / STANDARD_GRAVITY]), "[limit]", pushes
        pushes = []
    if np.isfinite(spectrum := peak_of_spectrum(case)):
        source = "[assessment]" if case.assessment.spectrum else "[suite], its target"
        used = [*[RESULTS["assessment"]] * ("assessment" in data.statements), *pushes]
        yield f"{read_spectrum(data)['code']} spectrum", Ends.of([spectrum]), source, used


def tabulate_demands(data: ReportData) -> list[Grid]:
    """Tabulate the demands with their sources; none where the capacities have a single one."""
    found, text = [each for each in list_demands(data) if each[-1]], data.case.report.get("demand")
    compared = "words alone, which are compared with none"
    compared += ": limit.demand is" * (data.case.limit.demand is not None)
    spectrum = data.case.assessment.spectrum or data.case.target
    ag, given = getattr(spectrum, "ag", None), re.search(r"\ba_?g *= *([\d.]*\d) *g\b", text or "")
    if ag is not None and given and np.isclose(float(given[1]), ag):
        compared = f"those of the {read_spectrum(data)['code']} spectrum, as its ag is equal"
    rows = [("as stated", text, "[report]", compared)] if text else []
    rows += [(x, f"{'PGA ' * (x != 'push')}{p:.3g} g", y, join_words(of)) for x, p, y, of in found]
    peaks = [peak for _, ends, *_ in found for peak in ends]
    differ = bool(peaks) and max(peaks) > MAX_RATIO_OF_PEAKS * min(peaks)
    caption = "Demands of an earthquake" + "; a margin on one is none on another" * differ
    head = ("demand", "horizontal", "source in the case", "of which results")
    stated = rows[1:] or (text and data.is_shaken)  # a vehicle has no demand of an earthquake
    return [Grid(head, rows, caption, "words")] if stated else []


def find_demand(data: ReportData) -> float:
    """Return the site's acceleration [g], or the largest peak of the motions; 0 without any."""
    if np.isfinite(site := site_acceleration(data.case)):
        return site
    return max((ends[-1] for _, ends, *_ in list_demands(data)), default=0.0)


def name_spectrum(data: ReportData) -> str:
    """Name the demand of kinematic assessments, with its peak acceleration."""
    code = read_spectrum(data).get("code")
    if code is None:
        return "the spectrum of the motion"
    ground = "above ground " * (code == "floor")
    return f"the {code} spectrum {ground}of PGA {peak_of_spectrum(data.case):.3g} g"


def tabulate_capacities(parts: Mapping[str, ReportData]) -> list[Grid]:
    """Tabulate demands and capacities of one or several cases; none without any."""
    named = dict[Sequence[str], list[str]]()
    for name, data in parts.items():
        for row in _mark_rows(data):
            named.setdefault(row, []).append(name)
    rows = [(join_words(names), *row) if names[0] else row for row, names in named.items()]
    stated = {name for data in parts.values() for name in data.statements}
    words = dict.fromkeys(_FACTORS[name] for name in _FACTORS if name in stated)
    factors = f". Factors are multiples of the demand: {'; '.join(words)}" * bool(words)
    head = (*["case"] * (len(parts) > 1), "", "demand", "capacity or outcome", "factor")
    return [Grid(head, rows, f"Demand and capacity{factors}", "words outcomes")] if rows else []


def _mark_rows(data: ReportData) -> Iterator[tuple[str, ...]]:
    """Yield the rows of the capacities of a case, each marked that a doubt is about.

    A doubt is about rows of its motion or its check; without these, about all rows of its result.
    """
    rows, pairs = [*_capacity_rows(data)], {*data.runs, *data.pairs}
    checks = {row.numbers.get("check") for _, row in rows}
    doubts = list_doubts(data)
    decisive = list_decisive_doubts(data, doubts)

    def is_about(doubt: Doubt, row: Row) -> bool:
        named = [f"'{pair}'" for pair in pairs if f"'{pair}'" in doubt.place]
        named += [name for name in checks if name and name in doubt.values]
        if "the displacement check" in doubt.words and row.numbers.get("linear"):
            return False
        if doubt.words.startswith(ONLY):  # of the rows that say so too
            return doubt.words.partition(", for ")[0].removeprefix("the bridge ") in row.outcome
        return not named or any(name in f"{row.result} {row.demand}" for name in named)

    for result, row in rows:
        # what a bound from above fails it fails for certain
        uncertain = row.numbers.get("most", 1.0) >= 1.0 or result in decisive
        about = any(of == result and is_about(doubt, row) for of, doubt in doubts)
        in_doubt = " (in doubt)" * (uncertain and about)
        yield row.result, row.demand, f"{row.outcome}{in_doubt}", row.factor


def _list_outdated(data: ReportData) -> Iterator[Row]:
    """Yield a row for each result that another case has left."""
    listed = {} if data.folder is None else read_file_list(data.folder)
    own = group_of(listed, CASE_FILE)
    for command, group in listed.items():
        names = {path.rpartition("/")[2].removesuffix(".txt") for path in group.files}
        if own is None or group.inputs != own.inputs:
            for result in (RESULTS[name] for name in RESULTS if name in names):
                # digests of inputs do not say which is the older
                again = f"run `archfem {command}`, or `archfem run`, again with the same `--set`"
                outcome = (
                    f"not stated, for its case, drawing or version of archfem is another: {again}"
                )
                yield Row(result, "-", outcome, "-", {})


def _capacity_rows(data: ReportData) -> Iterator[tuple[str, Row]]:
    """Yield each result with its demand, capacity or outcome, and factor; "-" where is none."""
    if data.runs:
        verdicts = [run.verdict for run in data.runs.values()]
        demand, outcome = outcomes.describe_peaks(data.runs.values()), verdicts[0].outcome
        demand = f"{len(verdicts)} motion{'s' * (len(verdicts) > 1)}, {demand}"
        outcome = result_text.count_outcomes(verdicts) if len(verdicts) > 1 else outcome
        outcome += f"; not run: {', '.join(data.missing)}" * bool(data.missing)
        # of a fall it is the way to the ground
        held = {k: run.verdict for k, run in data.runs.items()}
        held = {k: x for k, x in held.items() if x.outcome not in FALLEN_STATES}
        sizes = np.array([(x.displacement, x.residual) for x in held.values()])
        if sizes.size and np.isfinite(sizes).all():
            (largest, residual), farthest = map(format_mm, sizes.max(axis=0)), sizes.argmax(axis=0)
            over = "time steps" if data.fidelity == VARIED_FIDELITY else "time steps and fidelity"
            steps = ", ".join(outcomes.list_ranges_of_steps(data))
            # each is the largest of all motions, which may be of two
            at_most, at_end = (f" under '{[*held][k]}'" * (len(data.runs) > 1) for k in farthest)
            at_end *= at_end != at_most
            outcome += f"; displaced by up to {largest}{at_most}, {residual} at the end{at_end}"
            outcome += f"; over {over} by {steps}" * bool(steps)
        yield HISTORIES, Row(HISTORIES, demand, outcome, "-", {})
    for computed in data.verdict_ranges:
        motion = computed.dataset.attrs.get("motion")
        name = f"{VARIATIONS} under '{motion}'" if motion else VARIATIONS
        moved = computed.displacements * spans_run(data, computed)
        outcome = "; ".join(filter(None, [computed.count, moved]))
        yield VARIATIONS, Row(name, "the same motion", outcome + computed.unanswered, "-", {})
    for key, (first, name) in data.across[0].items():
        demand = f"'{name}', of {SCALES_ACROSS[0]:g} to {SCALES_ACROSS[1]:g} ×"
        factor = f"{first.scale:#.3g}" if first.scale < np.inf else "-"
        falls = describe_first_fall(first, data.motions[name].pga)
        outcome = f"as one rigid body it {falls}, held by nothing else"
        yield "", Row(f"across the plane, {key}", demand, outcome, factor, {})
    for result, statement in data.statements.items():
        of = f" of {name_spectrum(data)}" if result == "assessment" else ""
        for row in sorted(statement.rows, key=lambda x: not is_of_norm(data, x.demand)):
            yield RESULTS[result], row._replace(demand=f"{row.demand}{of}")
    case, limit = data.case, data.case.limit
    at_rest = list_margins_at_rest(case.structure, limit.strength, limit.fill)
    for times, of in () if "thickness" in data.statements else at_rest:
        outcome = f"stands; the factor is of {of}{say_loads_left_out(case)}"
        yield "", Row("at rest", "its own weight", outcome, format_ratio(times), {})
    yield from (("", row) for row in _list_outdated(data))
