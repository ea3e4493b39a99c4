"""Head and conclusion of a report: who signs what, outcome with margin and range."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from importlib import import_module
from typing import Any

import numpy as np

from archfem._files import group_of, read_file_list
from archfem.cases import result_text
from archfem.cases.answers import NO_DEMAND, RESULTS, Ratios, Row, read_numbers
from archfem.cases.case import REPORT_KEYS
from archfem.cases.report.doubts import (
    HISTORIES,
    VARIATIONS,
    list_checks,
    list_decisive_doubts,
    list_doubts,
    list_elastic_fill,
    list_notes,
    list_unvaried,
    peak_of_ground,
    read_spectrum,
)
from archfem.cases.report.report_data import SCALES_ACROSS, SHOWN_RESULTS, ReportData
from archfem.cases.report.scales import describe_scales, say_first_failure, say_fragile
from archfem.cases.report.study_findings import read_study, say_what_changes
from archfem.cases.result_text import PushFactors, peak_of_spectrum, site_acceleration
from archfem.cases.run import CASE_FILE
from archfem.dynamics.collapse_state import (
    COLLAPSE_STATES,
    FALLEN_STATES,
    RANGE_REMEDY,
    CollapseState,
)
from archfem.dynamics.history import History
from archfem.dynamics.rigid_body.rocking_body import describe_first_fall
from archfem.dynamics.verdict_range import HALF_STEP, UNVARIED, VerdictRange
from archfem.masonry.structure import Structure, join_names, join_words
from archfem.models.model import Doubt, Ends
from archfem.units import STANDARD_GRAVITY, format_mm
from archfem.view.pages.document import Grid, Section, TextBlock

# Outcomes of runs as verbs, the worst first; small displacements end where blocks begin to move
_VERBS = {
    "fallen": "falls",
    "partly fallen": "falls in part",
    "mechanism": "becomes a mechanism",
    "dislocated": "is dislocated but stands",
    "stands": "stands",
    "no mechanism": "forms no mechanism",
    "unknown": "has no known outcome",
}


def describe_origin(data: ReportData) -> str:
    """Return version of the program and digest of the case, in one line."""
    digest = sha256(data.case.text().encode()).hexdigest()[:12]
    return f"report of archfem {import_module('archfem').__version__} · case {digest}"


# Doubts of a result that the conclusion states; the others stand in the section of the result
MAX_DOUBTS = 3
SECTIONS = {
    HISTORIES: "Response",
    VARIATIONS: "Range over uncertain properties",
    RESULTS["limit"]: "Limit analysis",
    RESULTS["pushover"]: "Pushover",
    RESULTS["rating"]: "Rating for a vehicle",
    RESULTS["assessment"]: "Kinematic assessment",
    RESULTS["scale"]: "Scale of the motion",
    RESULTS["risk"]: "Annual rate of collapse",
}

# Fidelity of the variations of a verdict
VARIED_FIDELITY = "rigid"

# Vehicles that the head of a report names one by one
MAX_VEHICLES = 3

# Results with a margin, which is made of the numbers of their rows
_NUMBERED = {"limit", "pushover", "assessment", "scale"}

# What commands keep of results that they have not finished
_BEGUN = {RESULTS["risk"]: "risk_samples.nc", RESULTS["verdict_range"]: "variations"}

# Demand of a push beside one that the report states in words
UNCOMPARED = "not compared with the demand, which [limit] does not give"

# Project in the templates of new cases
PLACEHOLDER = "Name of the project"

_FACTORS = (
    "; factor: the multiple of the demand at which a check is just passed or a load makes a "
    "mechanism, up to which a scaled motion neither fells nor dislocates it, or at which a fall "
    "has a probability of one half"
)


def list_facts(data: ReportData) -> list[tuple[str, str]]:
    """List who signs what, and the principal results by name, which the report shows first."""
    report = data.case.report
    signed = [
        (key.replace("_", " "), report[key])
        for key in REPORT_KEYS
        if report.get(key) and key != "demand"  # it stands beside the capacities
    ]
    runs, structure = list(data.runs.values()), data.case.structure
    blocks = [("structure", f"{len(structure.free)} blocks, {len(structure.joints)} joints")]
    blocks += [("joints", structure.assessment)] if structure.assessment else []
    doubtful = list_decisive_doubts(data, list_doubts(data))
    doubts = [("in doubt", ", ".join(doubtful))] if doubtful else []
    if not runs:
        verdict = "; ".join([*_say_checks(data), *_say_factors(data)])
        verdicts = [("verdict", verdict)] if verdict else []
        return [*signed, *verdicts, *_list_ratings(data), *doubts, *blocks]
    peak = [("motions" if len(runs) > 1 else "motion", _describe_peaks(runs))]
    did, *others = summarise_outcomes(data, runs).split("; ")
    did = ", ".join([did, *_say_movement(data)])
    ranges = [x for x in data.verdict_ranges if x.decisive.any()] if len(runs) > 1 else []
    ranges.sort(key=lambda x: (x.falls.sum(), x.dislocated.sum()))
    others += [f"{x.count} under '{x.dataset.attrs.get('motion')}'" for x in ranges[-1:]]
    verdict = "; ".join([did, *others, *say_fragile(data), *_say_checks(data)])
    return [*signed, ("verdict", verdict), *doubts, *blocks, *peak]


def _say_factors(data: ReportData) -> Iterator[str]:
    """Yield the factors of results without runs; those of checks and vehicles are said apart."""
    for result, row in _capacity_rows(data):
        said = result in (RESULTS["assessment"], RESULTS["rating"])
        if said or (row.factor == "-" and row.demand != _say_uncompared(data)):
            continue
        text = f"{row.demand}: {row.outcome}" + f", factor {row.factor}" * (row.factor != "-")
        is_push = row.numbers.get("site")
        yield f"a push begins to move it at {row.factor} times {row.demand}" if is_push else text


def _list_ratings(data: ReportData) -> Iterator[tuple[str, str]]:
    """Yield each vehicle with its outcome, or of many those that have each outcome."""
    stated = data.statements.get("rating")
    rows = [row for row in stated.rows if row.factor != "-"] if stated else []
    outcomes: dict[str, list[Row]] = {}
    for row in rows:
        outcomes.setdefault(row.numbers.get("outcome", row.outcome), []).append(row)
    for outcome, same in outcomes.items():
        vehicles = [(row.demand, f"{outcome}, factor {row.factor}") for row in same]
        if len(rows) > MAX_VEHICLES:
            listed = join_words([f"{row.demand} ({row.factor})" for row in same])
            vehicles = [(outcome, listed)]
        yield from vehicles


def _say_movement(data: ReportData) -> Iterator[str]:
    """Yield how far the structure moves where it does not fall, and at which scale it falls."""
    verdicts = [run.verdict for run in data.runs.values()]
    sizes = [x.displacement for x in verdicts if x.outcome in COLLAPSE_STATES[:2]]
    if sizes and np.isfinite(sizes).all():
        yield f"moves by {Ends.of(sizes):mm}"
    yield from say_first_failure(data)


def _say_checks(data: ReportData) -> Iterator[str]:
    """Yield whether the checks of an assessment and across the plane are met, and by how much."""
    for check in list_checks(data):
        ratios = [x for x in (check.least, check.most, check.moved, check.bodies) if x is not None]
        met, by = "is met", f"{Ends.of(ratios):.3g} × the spectrum"
        if check.needed:
            met = "is not met under some assumptions on the fill"
        elif check.least < 1.0:
            met = "is not met"
        elif check.by_split:
            met = "is met or not by the split of weights"
        elif check.moved is not None:
            moves = _say_motion(data, check.least, peak_of_spectrum(data.case))
            met = "is met at rest" + " alone, and it moves" * bool(moves)
            by = f"{check.moved:.3g} by displacements"
        kind = "check" if check.linear else "displacement check"
        yield f"the {kind} of {check.name} {met} ({by})"
    yield from (f"it first falls at {text}" for x, text in sorted(_say_across(data))[:1] if x <= 1)


def _describe_peaks(runs: Iterable[History]) -> str:
    """Return the least and the largest peak acceleration of some runs."""
    return f"PGA {Ends.of(map(peak_of_ground, runs)):.2f} g"


def summarise_outcomes(data: ReportData, runs: Sequence[History]) -> str:
    """Return outcome, and doubts or range, of a run, or how many runs have each outcome."""
    if len(runs) > 1:
        counts = Counter(run.verdict.outcome for run in runs)
        words = ", ".join(
            f"{verb} under {counts[outcome]}" for outcome, verb in _VERBS.items() if counts[outcome]
        )
        return f"{words} of {len(runs)} motions"
    own = runs[0].dataset.attrs.get("motion")
    ranges = {each.dataset.attrs.get("motion"): each for each in data.verdict_ranges}
    found = ranges.get(own)
    if found is None and len(data.runs) == 1:  # a range over several motions has no name
        found = next(iter(ranges.values()), None)
    # lost blocks have a line of their own, and the conclusion says what was not varied
    text = runs[0].verdict.brief
    return text if found is None else f"{text}; {found.count}{found.unanswered}"


def build_conclusion(data: ReportData) -> Section:
    """Build the section on the answer in sentences, its doubts, and demands and capacities."""
    doubts: dict[str, list[Doubt]] = {}
    every, stated = list_doubts(data), set[tuple[str, ...]]()
    # a doubt of several results is stated once, without the motions of which it is true, too
    for result, doubt in sorted(every, key=lambda each: bool(each[1].place)):
        if doubt.kind not in stated:
            doubts.setdefault(result, []).append(doubt)
        stated.add(doubt.kind)
    doubtful, decisive = [*dict.fromkeys(x for x, _ in every)], list_decisive_doubts(data, every)
    rows = []
    for result, row in _capacity_rows(data):
        # what a bound from above fails it fails for certain
        fails = row.numbers.get("most", 1.0) < 1.0
        in_doubt = " (in doubt)" * (result in (decisive if fails else doubtful))
        rows.append((*row[:2], f"{row.outcome}{in_doubt}", row.factor))
    demand = data.case.report.get("demand", "")
    blocks: list[Any] = [TextBlock(sentence(f"demand, as stated: {demand}"))] if demand else []
    for lead, texts in _build_paragraphs(data, decisive).items():
        sentences = [*map(sentence, texts)]
        if data.statements.keys() != {"rating"}:  # of a result that stands alone each is one
            sentences = [" ".join(sentences)] if sentences else []
        blocks += [TextBlock(each, lead=lead * (k == 0)) for k, each in enumerate(sentences)]
    blocks += _build_transverse(data)
    for result in filter(doubts.get, doubtful):
        # those that a range answers are of the outcome
        ordered = sorted(doubts[result], key=lambda x: not x.remedy.startswith(RANGE_REMEDY))
        shown = [sentence(str(replace(x, remedy=""))) for x in ordered[:MAX_DOUBTS]]
        if more := len(doubts[result]) - len(shown):
            shown.append(f"{more} more: see section '{SECTIONS[result]}'.")
        blocks.append(TextBlock(f"In doubt, {result}: {' '.join(shown)}", "doubt"))
    for result, notes in list_notes(data).items():
        blocks.append(TextBlock(f"Note, {result}: {' '.join(map(sentence, notes))}", "missing"))
    if rows:
        head = ("", "demand", "capacity or outcome", "factor")
        factors = _FACTORS if any(row[3] != "-" for row in rows) else ""
        blocks.append(Grid(head, rows, f"Demand and capacity{factors}", "words"))
    blocks += map(TextBlock, _list_outdated(data))
    return Section("Conclusion", [*blocks, _build_signatures(data.case.report)])


def _build_transverse(data: ReportData) -> list[TextBlock]:
    """Build the paragraph on what is not checked across the plane, for results of earthquakes."""
    if not data.runs and not data.statements.keys() - {"rating", "thickness"}:
        return []
    text, (push, _) = data.case.structure.transverse_remark, data.case.structure.transverse_push
    peaks = [0.0, *map(peak_of_ground, data.runs.values()), site_acceleration(data.case)]
    demand = float(np.nanmax(peaks))
    text += f"; the demand of {demand:.3g} g is {demand / push:.2g} times that" * (push < demand)
    if data.falls_across:
        text = text.removeprefix("nothing is checked across the plane of the drawing: ")
    manner = "doubt" if push < demand else "plain"
    return [TextBlock(sentence(text), manner, lead="Across its plane?")]


def _list_outdated(data: ReportData) -> Iterator[str]:
    """Yield sentences on results that another version, or another case, has left, or no answer."""
    listed = {} if data.folder is None else read_file_list(data.folder)
    shown = [name for name in SHOWN_RESULTS if data.list_parts(f"{name}.txt")]
    unstated = RESULTS.keys() - {*shown, *data.statements}
    unstated |= {
        name
        for name in _NUMBERED & data.statements.keys()
        if any(row.factor != "-" and not row.numbers for row in data.statements[name].rows)
    }
    absent = {f"{name}.txt": RESULTS[name] for name in unstated}
    own, earlier, other = group_of(listed, CASE_FILE), list[str](), list[str]()
    for command, group in listed.items():
        names = [name for path in group.files if (name := path.rpartition("/")[2]) in absent]
        again = [f"{absent[name]} (run `archfem {command}` again)" for name in names]
        (earlier if own and group.inputs == own.inputs else other).extend(again)
    for name in _BEGUN.keys() & absent.values():
        if data.folder and (data.folder / _BEGUN[name]).exists():
            yield f"The {name} was begun and has no answer: runs are left to compute."
    if data.case.report.get("project") == PLACEHOLDER:
        yield "The name of the project is that of the template: fill in [report] of the case."
    if earlier:
        made = "Not stated in full, for an earlier version of archfem made it"
        yield f"{made}: {', '.join(earlier)}."
    if other:
        # digests of inputs do not say which is the older
        made = "Not stated, for its case, drawing or version of archfem is not that of the runs"
        yield f"{made}: {', '.join(other)}; or run `archfem run` again, if the runs are older."


def _build_paragraphs(data: ReportData, doubtful: Sequence[str]) -> dict[str, list[str]]:
    """Return the sentences of the answer by their leads: outcomes, margin, what may change it."""
    answer = [*_say_answer(data)]
    if not data.runs:
        # an assessment is stated by the margin; a result that stands alone states all of itself
        stated = [each.sentences for name, each in data.statements.items() if name != "assessment"]
        answer += [*stated[0]] if len(data.statements) == 1 and stated else [x for x, *_ in stated]
    answer += [*_describe_ends(data), *_describe_ranges(data.verdict_ranges)]
    changes = [*_say_causes(data.verdict_ranges)]
    if (study := read_study(data)) is not None:
        changes += say_what_changes(study)
    if fill := join_names(list_elastic_fill(data)):
        changes.append(f"{fill} is elastic in the runs and carries tension, which soil does not")
    changes += ["the checks of the numbers raise no doubt"] * (bool(data.runs) and not doubtful)
    if doubtful:
        changes.append(f"the doubts below, on {join_names(doubtful)}, may change this")
    if single := list_unvaried(data):
        none = ", and displacements have no range" * (bool(data.runs) and not data.verdict_ranges)
        changes.append(f"{join_words(single)} were not varied{none}")
    given = [key for key in ("suite", "motion") if data.case.settings.get(key)]
    if given and not data.runs and not {"scale", "risk"} & data.statements.keys():
        changes.append(f"no motion was run, though [{given[0]}] is in the case")
    return {
        "Does it stand?" if data.runs else "Result:": answer,
        "By which margin?": [*_describe_margin(data), *_say_vertical(data)],
        "What would change the answer?": changes,
    }


def _say_answer(data: ReportData) -> Iterator[str]:
    """Yield the answer in one sentence: outcomes, displacements, first fall, and checks."""
    done = [*_describe_outcomes(data)]
    moved = ", ".join(_say_movement(data)) if done else ""
    joint = ", " if len(done) == 1 else "; it "
    text = "; it ".join(done) + f"{joint}{moved}" * bool(moved)
    clauses = [*([f"the structure {text}"] if done else []), *say_fragile(data), *_say_checks(data)]
    yield from ["; ".join(clauses)] if clauses else []


def _describe_ranges(ranges: Sequence[VerdictRange]) -> Iterator[str]:
    """Yield how often the structure falls in variations, and how far it moves at most."""
    for each in ranges:
        motion, answers = each.dataset.attrs.get("motion"), each.answers["sampled"].values.any()
        under = f"under '{motion}' it " if motion else "it "
        groups = f": {each.groups}" if len(ranges) == 1 else ""
        yield f"{under}{each.count}{groups}{each.unanswered}" if answers else each.sentence
    if moved := [each for each in ranges if each.displacements]:
        far = max(moved, key=lambda x: np.nanmax(x.dataset["displacement"].values[~x.falls]))
        most = f"it moves farthest under '{far.dataset.attrs.get('motion')}': " * (len(ranges) > 1)
        yield f"{most}largest displacements are {far.displacement_ends}"


def _say_causes(ranges: Sequence[VerdictRange]) -> Iterator[str]:
    """Yield what separates falls in variations, and what single changes do, equal ones once."""
    texts: dict[str, list[str]] = {}
    for each in ranges:
        for text in [*[each.where] * each.is_mixed, *each.what_changes]:
            texts.setdefault(text, []).append(f"'{each.dataset.attrs.get('motion')}'")
    for text, motions in texts.items():
        yield f"under {join_words(motions)}: {text}" if len(ranges) > 1 else text


def _describe_margin(data: ReportData) -> Iterator[str]:
    """Yield the least factor on the demand of an earthquake, maybe as a range, and the others."""
    checks = read_numbers(Ratios, data.statements.get("assessment"))
    margins = [*sorted(_describe_check(data, each) for each in checks)[:1], *describe_scales(data)]
    margins += [(least, [f"below {text}"]) for least, text in sorted(_say_across(data))[:1]]
    for k, (_, (first, *others)) in enumerate(sorted(margins)):
        rank = ("the least margin is", "the next is", "then follows")[min(k, 2)]
        yield from [f"{rank} {first}", *others]
    for name in (x for x in ("limit", "pushover") if x in data.statements):
        for push in read_numbers(PushFactors, data.statements[name]):
            yield from _describe_push(data, name, push) if push.site else ()
        for row in data.statements[name].rows:
            if row.factor == "-" and data.runs:  # without runs it is the answer
                yield f"{row.result}, {_say_uncompared(data)}: {row.outcome}"


def _say_across(data: ReportData) -> Iterator[tuple[float, str]]:
    """Yield the scale at which each body across the plane first falls, if any, and in words."""
    for key, (first, name) in data.falls_across.items():
        if first.scale < np.inf:
            peak = f"PGA {data.motions[name].pga / STANDARD_GRAVITY:.2f} g"
            body = f"the {key} across the plane as one rigid body, held by nothing else"
            yield first.scale, f"{first.scale:#.3g} × '{name}', {peak}: {body}"


def _say_uncompared(data: ReportData) -> str:
    """Say with which demand a push is not compared, and why."""
    demand = data.case.limit.demand
    if demand is not None:
        return f"not compared with the demand of {demand / STANDARD_GRAVITY:.3g} g"
    return UNCOMPARED if data.case.report.get("demand") else NO_DEMAND


def _describe_push(data: ReportData, name: str, push: PushFactors) -> Iterator[str]:
    """Yield at which multiple of the site's acceleration a push begins to move a structure."""
    elastic = name == "pushover"
    moves = _say_motion(data, push.least, site_acceleration(data.case))
    bounded = push.proved is not None  # the least found, without proof that none is less
    of = " with elastic joints" if elastic else " as rigid blocks" * bounded
    over = " over what is assumed of the fill" * (push.most > push.least)
    size = f"a push of {'at most ' * bounded}{push} times {push.site}{over}"
    if moves and push.least >= 1.0:  # shaken it moves before
        yield f"{size}{of} is no margin: {moves}"
        return
    yield f"{size} begins to move it{of}, which is no collapse"
    if then := moves if data.runs else "shaken it may begin to move at less":
        yield then


def _describe_check(data: ReportData, check: Ratios) -> tuple[float, list[str]]:
    """Return the ratio of a check of an assessment, and its sentences."""
    over = " over what is assumed of the fill" * (check.most > check.least)
    by = f"on {name_spectrum(data)}, by {check.name}"
    moves = _say_motion(data, check.least, peak_of_spectrum(data.case))
    if check.moved is not None and moves:  # what moves at less than the push that begins it is
        begins = f"the check passes for what is at rest, and {moves}"  # judged by how far
        return check.moved, [f"{check.moved:.3g} by displacements, {by}", begins]
    fails = f", passed only with {check.needed}" if check.needed else ""
    fails = fails or ", which it fails" * (check.least < 1.0)
    fails = fails or ", which it fails with one weight a body" * check.by_split
    ends = f"{Ends((check.least, check.most)):.3g}"
    texts = [f"{ends}{over}{check.beside}, {by}{fails}"]
    if check.moved is not None:
        texts.append(f"{ends} times the spectrum begins to move it")
        texts.append(f"if it moved, it could be displaced by {check.moved:.3g} times the demand")
    return check.decisive, texts


def _say_motion(data: ReportData, factor: float, site: float) -> str:
    """Say that a structure moves in a run no stronger than a multiple of the site's acceleration.

    It is empty if it moves in none. Without a spectrum the runs are the demand.
    """
    push = np.nan_to_num(factor * site, nan=np.inf)
    runs = [run for run in data.runs.values() if peak_of_ground(run) <= push]
    verdicts = [run.verdict for run in runs]
    if not any(x.mechanisms.get("verified") or x.outcome in FALLEN_STATES for x in verdicts):
        return ""
    held = all(verdict.outcome in COLLAPSE_STATES[:2] for verdict in verdicts)
    of = f" of up to {push:.2f} g" * (len(runs) < len(data.runs))
    return f"in the runs{of} it moves{', and falls in none' * held}"


def _say_vertical(data: ReportData) -> Iterator[str]:
    """Say that runs have a vertical motion, where results beside them leave it out."""
    checks = [RESULTS[x] for x in ("limit", "assessment", "pushover") if x in data.statements]
    peaks = [np.abs(run.dataset["ground"].values[:, 1]).max() for run in data.runs.values()]
    if checks and max(peaks, default=0.0) > 0.0:
        size = f"{max(peaks) / STANDARD_GRAVITY:.2f} g"
        text = f"the runs have a vertical motion too, of up to {size}; {join_words(checks)} "
        yield text + ("have none" if checks[1:] else "has none")


def name_spectrum(data: ReportData) -> str:
    """Name the demand of kinematic assessments, with its peak acceleration."""
    code = read_spectrum(data).get("code")
    if code is None:
        return "the spectrum of the motion"
    return f"the {code} spectrum of PGA {peak_of_spectrum(data.case):.3g} g"


def _build_signatures(report: Mapping[str, str]) -> Grid:
    """Build the lines to be signed, with the names and the date that are given."""
    rows = [
        (who.replace("_", " "), report.get(who, ""), report.get("date", ""), "")
        for who in ("author", "checked_by")
    ]
    return Grid(("", "name", "place, date", "signature"), rows, "", "form")


def _capacity_rows(data: ReportData) -> Iterator[tuple[str, Row]]:
    """Yield each result with its demand, capacity or outcome, and factor; "-" where is none."""
    if data.runs:
        verdicts = [run.verdict for run in data.runs.values()]
        demand, outcome = _describe_peaks(data.runs.values()), verdicts[0].outcome
        outcome = result_text.count_outcomes(verdicts) if len(verdicts) > 1 else outcome
        # of a fall it is the way to the ground
        held = [(x.displacement, x.residual) for x in verdicts if x.outcome not in FALLEN_STATES]
        if (sizes := np.array(held)).size and np.isfinite(sizes).all():
            largest, residual = map(format_mm, sizes.max(axis=0))
            over = "time steps" if data.fidelity == VARIED_FIDELITY else "time steps and fidelity"
            steps = ", ".join(_list_ranges_of_steps(data))
            beside = f" (over {over} {steps})" * bool(steps)
            outcome += f"; displaced by up to {largest}{beside}, {residual} at the end"
        yield HISTORIES, Row(HISTORIES, demand, outcome, "-", {})
    for computed in data.verdict_ranges:
        motion = computed.dataset.attrs.get("motion")
        name = f"{VARIATIONS} under '{motion}'" if motion else VARIATIONS
        outcome = "; ".join(filter(None, [computed.count, computed.displacements]))
        yield VARIATIONS, Row(name, "the same motion", outcome + computed.unanswered, "-", {})
    for key, (first, name) in data.falls_across.items():
        demand = f"'{name}', of {SCALES_ACROSS[0]:g} to {SCALES_ACROSS[1]:g} ×"
        factor = f"{first.scale:#.3g}" if first.scale < np.inf else "-"
        outcome = describe_first_fall(first).removeprefix("; ") + ", held by nothing else"
        yield "", Row(f"across the plane, {key}", demand, outcome, factor, {})
    for result, statement in data.statements.items():
        of = f" of {name_spectrum(data)}" if result == "assessment" else ""
        for row in statement.rows:
            demand = f"{row.demand}{of}"
            if row.demand == NO_DEMAND:
                demand = _say_uncompared(data)
                peaks = _describe_peaks(data.runs.values()) if data.runs else ""
                demand += f"; beside it motions of {peaks}" * bool(peaks)
            yield RESULTS[result], row._replace(demand=demand)


def _list_ranges_of_steps(data: ReportData) -> Iterator[str]:
    """Yield how far a motion displaces the structure by the steps of its run and variations."""
    for found in data.verdict_ranges:
        motion = found.dataset.attrs.get("motion", "")
        sizes = [
            each.displacement
            for each in found.single_changes
            if each.name in (UNVARIED, HALF_STEP) and each.outcome in COLLAPSE_STATES[:2]
        ]
        run = data.runs.get(motion)
        if sizes and run and run.verdict.outcome in COLLAPSE_STATES[:2]:
            sizes.append(run.verdict.displacement)
            under = f" under '{motion}'" * (len(data.runs) > 1)
            yield f"{Ends.of(sizes):mm}{under}"


def _describe_outcomes(data: ReportData) -> Iterator[str]:
    """Yield each outcome with the motions that lead to it, and the largest displacement."""
    for outcome, verb in _VERBS.items():
        names = [name for name, run in data.runs.items() if run.verdict.outcome == outcome]
        if not names:
            continue
        of = f"of {_describe_peaks(data.runs[name] for name in names)}"
        under = f"{len(names)} of {len(data.runs)} motions {of}: {', '.join(names)}"
        if len(names) == len(data.runs):
            under = f"all {len(names)} motions {of}"
            under = under if len(names) > 1 else f"the motion '{names[0]}' {of}"
        fall = "; whether it falls was not computed" if outcome == "mechanism" else ""
        yield f"{verb} under {under}{fall}"


def _describe_ends(data: ReportData) -> Iterator[str]:
    """Yield sentences on runs that were broken off, lost blocks, and those that still move."""
    falls = {name: run.verdict.fall for name, run in data.runs.items()}
    for name, run in data.runs.items():
        if run.verdict.incomplete:
            yield f"the run under '{name}' {run.verdict.incomplete}"
    if lost := {f"'{name}'": fall for name, fall in falls.items() if fall and fall.blocks}:
        which = describe_lost(data.case.structure, [*lost.values()])
        yield f"under {join_words([*lost])} it loses {which}"
    if moving := [f"'{name}'" for name, fall in falls.items() if fall and not fall.resting]:
        yield f"blocks still move at the end of {join_words(moving)}"


def describe_mechanism(verdict: Any) -> str:
    """Return the first mechanism of a run in a few words."""
    for definition in ("verified", *verdict.mechanisms):
        if (found := verdict.mechanisms.get(definition)) is not None:
            words = "verified" if definition == "verified" else f"by {definition}"
            return f"{found.kind}, {words} at {found.time:.2f} s"
    return "none by any definition"


def describe_lost(structure: Structure, falls: Sequence[CollapseState]) -> str:
    """Return the number of lost blocks, the time of the first, and of one fall which they are."""
    counts, times = [len(fall.blocks) for fall in falls], [fall.time or 0.0 for fall in falls]
    text = f"{Ends.of(counts)} blocks, the first at {Ends.of(times):.2f} s"
    return text if len(falls) > 1 else f"{text}: {list_lost(structure, falls[0].blocks)}"


def list_lost(structure: Structure, names: Sequence[str], max_names: int = 4) -> str:
    """List lost blocks by name, or many by their parts."""
    blocks = [structure.blocks[number] for number in structure.free]
    if len(names) <= max_names:
        return ", ".join(names)
    counts, lost = (
        Counter(block.part or "no part" for block in each)
        for each in (blocks, [block for block in blocks if block.name in names])
    )
    whole = [part for part, count in lost.items() if count == counts[part]]
    some = [f"{count} of {counts[part]} of {part}" for part, count in lost.items()]
    some = [text for text, part in zip(some, lost, strict=True) if part not in whole]
    return "; ".join([f"all of {join_words(whole)}"] * bool(whole) + some)


def sentence(text: str) -> str:
    """Return a text with a capital at its beginning and a full stop at its end."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "?")) else ".")
