"""Head and conclusion of a report: who signs what, outcome with margin and range, doubts."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from importlib import import_module
from typing import Any

import numpy as np

from archfem._files import read_file_list
from archfem.cases import result_text
from archfem.cases.case import REPORT_KEYS
from archfem.cases.report.motion_rules import note_checks
from archfem.cases.report.report_data import SHOWN_RESULTS, ReportData
from archfem.cases.report.study_findings import list_studied, read_study, say_what_changes
from archfem.cases.result_text import RESULTS, Row
from archfem.dynamics.collapse_state import COLLAPSE_STATES, FALLEN_STATES, CollapseState
from archfem.dynamics.history import History
from archfem.dynamics.motion_scaling import UNFINISHED
from archfem.dynamics.verdict import NO_RANGE
from archfem.dynamics.verdict_range import (
    HALF_STEP,
    MAX_RATIO_OF_DISPLACEMENTS,
    UNVARIED,
    VerdictRange,
)
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import join_names, join_words
from archfem.models.model import Doubt
from archfem.units import STANDARD_GRAVITY, format_mm
from archfem.view.pages.document import Grid, Section, TextBlock

# Outcomes of runs as verbs; small displacements end where blocks begin to move as a mechanism
_VERBS = {
    "stands": "stands",
    "dislocated": "stands dislocated",
    "partly fallen": "falls in part",
    "fallen": "falls",
    "mechanism": "becomes a mechanism",
    "no mechanism": "forms no mechanism",
    "unknown": "has no known outcome",
}


def describe_origin(data: ReportData) -> str:
    """Return version of the program and digest of the case, in one line."""
    digest = sha256(data.case.text().encode()).hexdigest()[:12]
    return f"report of archfem {import_module('archfem').__version__} · case {digest}"


# Ratio of the peaks of motions and spectrum beyond which they are different demands: those of
# matched motions exceed the target by a tenth
MAX_RATIO_OF_PEAKS = 1.25

# Doubts of a result that the conclusion states; the others stand with the result
MAX_DOUBTS = 3

# Doubts that outweigh others, the first most: a conclusion states these before others
_WEIGHTY = ("as rigid blocks none falls", "fall", "displace")

# Numbers of a doubt that differ from run to run: names of joints end in whole ones
_NUMBER = re.compile(
    r"(\d+\.\d+(?:e[-+]?\d+)?|\d+(?= (?:mm|m|ms|s|g|%|of)\b)|(?<= of )\d+|\d+(?=%))"
)

# Numbers of a doubt beyond which their ranges over several motions would be hard to read
MAX_RANGES = 2

# Fidelity of the variations of a verdict
VARIED_FIDELITY = "rigid"

# Results that may be of a push
PUSHES = RESULTS["limit"], RESULTS["pushover"]

# Results of runs: histories, and their variations
_HISTORIES, _VARIATIONS = "time histories", "variations"

# What commands keep of results that they have not finished
_BEGUN = {RESULTS["risk"]: "risk_samples.nc", RESULTS["verdict_range"]: "variations"}

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
    doubtful = list(dict.fromkeys(result for result, _ in list_doubts(data)))
    doubts = [("in doubt", ", ".join(doubtful))] if doubtful else []
    if not runs:
        # the place of a vehicle is in the conclusion
        factors = [
            f"{demand}: {outcome.partition(', with')[0]}, factor {factor}".removesuffix(
                ", factor -"
            )
            for _, (_, demand, outcome, factor) in _capacity_rows(data)
            if factor != "-" or demand == "no demand given"
        ]
        return [*signed, *([("verdict", "; ".join(factors))] if factors else []), *doubts, *blocks]
    peak = [("motions" if len(runs) > 1 else "motion", _describe_peaks(runs))]
    verdict = "; ".join([summarise_outcomes(data, runs), *_list_failed_checks(data)])
    return [*signed, ("verdict", verdict), *doubts, *blocks, *peak]


def _list_failed_checks(data: ReportData) -> Iterator[str]:
    """Yield the checks of a norm that are not passed; the linear one is no verdict of its own."""
    stated = data.statements.get("assessment")
    rows = [*stated.rows] if stated else []
    for name, _, outcome, _ in [x for x in rows if "linear, q" not in x[0]] or rows:
        if "passes" not in outcome or "only with" in outcome:
            some = " under some assumptions on the fill" * ("only with" in outcome)
            yield f"fails {name.partition(': ')[2]}{some}"


def _peak_of_ground(run: History) -> float:
    """Return the horizontal peak acceleration of a run [g]."""
    # Files of older versions have the acceleration at their steps alone.
    recorded = np.abs(run.dataset["ground"].values[:, 0]).max()
    return float(run.dataset.attrs.get("pga", recorded)) / STANDARD_GRAVITY


def _describe_peaks(runs: Iterable[History]) -> str:
    """Return the least and the largest peak acceleration of some runs."""
    peaks = sorted(map(_peak_of_ground, runs))
    return f"PGA {' to '.join(dict.fromkeys(f'{peaks[k]:.2f}' for k in (0, -1)))} g"


def summarise_outcomes(data: ReportData, runs: Sequence[History]) -> str:
    """Return outcome, and doubts or range, of a run, or how many runs have each outcome."""
    verdict = runs[0].verdict
    if len(runs) > 1:
        return result_text.count_outcomes([run.verdict for run in runs])
    if verdict.fall is not None:
        # lost blocks have a line of their own
        verdict = replace(verdict, fall=replace(verdict.fall, time=None))
    own = runs[0].dataset.attrs.get("motion")
    ranges = {each.dataset.attrs.get("motion"): each for each in data.verdict_ranges}
    found = ranges.get(own)
    if found is None and len(data.runs) == 1:  # a range over several motions has no name
        found = next(iter(ranges.values()), None)
    # a run cannot know that a range was computed after it; the conclusion says what was not varied
    text = verdict.headline.removesuffix(f"; {NO_RANGE}")
    if found is None:
        return text
    return f"{text}; {found.count} variations{found.unanswered}"


def build_conclusion(data: ReportData) -> Section:
    """Build the section on the answer in sentences, its doubts, and demands and capacities."""
    doubts: dict[str, list[str]] = {}
    every = list_doubts(data)
    stated = {text: result for result, text in reversed(every)}
    for text, result in stated.items():
        # a doubt of several results is stated once, without the scales of which it is true, too
        if text.partition("×")[2].partition(": ")[2] not in stated:
            doubts.setdefault(result, []).insert(0, text)
    doubtful = list(dict.fromkeys(result for result, _ in every))
    rows = [
        (name, demand, outcome + " (in doubt)" * (result in doubtful), factor)
        for result, (name, demand, outcome, factor) in _capacity_rows(data)
    ]
    demand = data.case.report.get("demand", "")
    blocks: list[Any] = [TextBlock(sentence(f"demand, as stated: {demand}"))] if demand else []
    for lead, texts in _build_paragraphs(data, rows, doubtful).items():
        sentences = [*map(sentence, texts)]
        if data.statements.keys() != {"rating"}:  # of a result that stands alone each is one
            sentences = [" ".join(sentences)] if sentences else []
        blocks += [TextBlock(each, lead=lead * (k == 0)) for k, each in enumerate(sentences)]
    for result in filter(doubts.get, doubtful):
        ordered = sorted(doubts[result], key=_weigh)
        shown = [sentence(text) for text in ordered[:MAX_DOUBTS]]
        if more := len(doubts[result]) - len(shown):
            shown.append(f"{more} more stand{'s' * (more == 1)} with the result.")
        blocks.append(TextBlock(f"In doubt, {result}: {' '.join(shown)}", "doubt"))
    for result, notes in list_notes(data).items():
        blocks.append(TextBlock(f"Note, {result}: {' '.join(map(sentence, notes))}", "missing"))
    if rows:
        head = ("", "demand", "capacity or outcome", "factor")
        factors = _FACTORS if any(row[3] != "-" for row in rows) else ""
        blocks.append(Grid(head, rows, f"Demand and capacity{factors}", "words"))
    blocks += map(TextBlock, _list_outdated(data))
    return Section("Conclusion", [*blocks, _build_signatures(data.case.report)])


def _list_outdated(data: ReportData) -> Iterator[str]:
    """Yield sentences on results that another version, or another case, has left, or no answer."""
    listed = {} if data.folder is None else read_file_list(data.folder)
    shown = [name for name in SHOWN_RESULTS if data.list_parts(f"{name}.txt")]
    unstated = RESULTS.keys() - {*shown, *data.statements}
    absent = {f"{name}.txt": RESULTS[name] for name in unstated}
    earlier = [
        f"{absent[name]} (run `archfem {command}` again)"
        for command, group in listed.items()
        for name in (path.rpartition("/")[2] for path in group.files)
        if name in absent
    ]
    for name in _BEGUN.keys() & absent.values():
        if data.folder and (data.folder / _BEGUN[name]).exists():
            yield f"The {name} was begun and has no answer: runs are left to compute."
    if data.case.report.get("project") == PLACEHOLDER:
        yield "The name of the project is that of the template: fill in [report] of the case."
    if earlier:
        made = "Not stated, for an earlier version of archfem or another case made it"
        yield f"{made}: {', '.join(earlier)}."


def _build_paragraphs(
    data: ReportData, rows: Sequence[Row], doubtful: Sequence[str]
) -> dict[str, list[str]]:
    """Return the sentences of the answer by their leads: outcomes, margin, what may change it."""
    answer = [f"the structure {each}" for each in _describe_outcomes(data)]
    if not data.runs:
        # an assessment is stated by the margin; a result that stands alone states all of itself
        stated = [each.sentences for name, each in data.statements.items() if name != "assessment"]
        answer = [*stated[0]] if len(data.statements) == 1 and stated else [x for x, *_ in stated]
    answer += [*_describe_ends(data), *_describe_ranges(data.verdict_ranges)]
    changes = [*_say_single_changes(data.verdict_ranges)]
    if (study := read_study(data)) is not None:
        changes += say_what_changes(study)
    if fill := join_names(list_elastic_fill(data)):
        changes.append(f"{fill} is elastic in the runs and carries tension, which soil does not")
    changes += ["the checks of the numbers raise no doubt"] * (bool(data.runs) and not doubtful)
    if doubtful:
        changes.append(f"the doubts below, on {join_names(doubtful)}, may change this")
    if single := list_unvaried(data):
        none = ", and displacements have no range" * (not data.verdict_ranges)
        changes.append(f"{join_words(single)} were not varied{none}")
    return {
        "Does it stand?" if data.runs else "Result:": answer,
        "By which margin?": [*_describe_margin(data, rows), *_say_vertical(data)],
        "What would change the answer?": changes,
    }


def _describe_ranges(ranges: Sequence[VerdictRange]) -> Iterator[str]:
    """Yield how often the structure falls in variations, and how far it moves at most."""
    if len(ranges) == 1:
        count, _, groups = ranges[0].sentence.partition("; ")
        yield f"in variations of its properties it {count}"
        if groups:
            yield f"it does so in {groups}"
    elif ranges:
        counts = [
            f"{each.count.removeprefix('falls ')} under '{each.dataset.attrs['motion']}'"
            f"{each.unanswered}"
            for each in ranges
        ]
        yield f"in variations of its properties it falls {join_words(counts)}"
    if moved := [each for each in ranges if each.displacements]:
        far = max(moved, key=lambda x: np.nanmax(x.dataset["displacement"].values[~x.falls]))
        most = f"it moves farthest under '{far.dataset.attrs.get('motion')}': " * (len(ranges) > 1)
        yield most + far.displacements.partition(";")[0].replace("ments", "ments are", 1)


def _say_single_changes(ranges: Sequence[VerdictRange]) -> Iterator[str]:
    """Yield what single changes of the variations do, in one sentence for equal ones."""
    texts: dict[str, list[str]] = {}
    for each in ranges:
        for text in each.what_changes:
            texts.setdefault(text, []).append(f"'{each.dataset.attrs.get('motion')}'")
    for text, motions in texts.items():
        yield f"under {join_words(motions)}: {text}" if len(ranges) > 1 else text


def _describe_margin(data: ReportData, rows: Sequence[Row]) -> Iterator[str]:
    """Yield the least factor on the demand of an earthquake, maybe as a range, and the others."""
    apart = list[str]()
    margins, checks = list[tuple[float, list[str]]](), list[tuple[float, list[str]]]()
    for name, demand, outcome, factor in rows:
        check, pushed = name.partition("assessment: ")[2], name in PUSHES
        if factor == "-":
            if pushed and data.runs:  # without runs it is the answer
                apart.append(f"{name}, beside no demand: {outcome.partition(';')[0]}")
            continue
        least = float(factor.partition(" ")[0])
        moves = _say_motion(data, least)
        if check:
            checks.append(_describe_check(data, (check, outcome, factor), moves))
        elif pushed and demand.startswith("the site"):
            bound = "at most " * ("(" in factor)  # the least found, without proof that none is less
            over = " over what is assumed of the fill" * (" to " in factor)
            size = f"{bound}{factor}"
            of = " with elastic joints" if name == RESULTS["pushover"] else " as rigid blocks"
            of *= bool(bound) or name == RESULTS["pushover"]
            if moves and least >= 1.0:  # shaken it moves before
                apart.append(f"a push of {size} times {demand}{over}{of} is no margin: {moves}")
            else:
                words = f"{size}{over}, for a push by {demand} to begin to move it{of}"
                then = moves if data.runs else "shaken it may begin to move at less"
                margins.append((least, [words, *filter(None, [then])]))
    margins += _describe_scales(data, [row for row in rows if row[0] == RESULTS["scale"]])
    for k, (_, (first, *others)) in enumerate(sorted([*margins, *sorted(checks)[:1]])):
        rank = ("the least margin is", "the next is", "then follows")[min(k, 2)]
        yield from [f"{rank} {first}", *others]
    yield from apart


def _describe_check(
    data: ReportData, row: tuple[str, str, str], moves: str
) -> tuple[float, list[str]]:
    """Return the ratio of a check of an assessment, and its sentences."""
    check, outcome, factor = row
    ratios, opened, bodies = factor.partition(" (")
    over = " over what is assumed of the fill" * (" to " in factor)
    least, by = float(factor.partition(" ")[0]), f"on {name_spectrum(data)}, by {check}"
    moved = re.search(r"([\d.]+) by displacements", factor)
    if moved and moves:  # what moves at less than the push that begins it is judged by how far
        begins = f"the check passes for what is at rest, and {moves}"
        return float(moved[1]), [f"{moved[1]} by displacements, {by}", begins]
    begins = f"{ratios} times the spectrum begins to move it"
    then = f"if it moved, it could be displaced by {moved[1]} times the demand" if moved else ""
    _, only, assumed = outcome.partition(" only with ")
    only = f", passed only with {assumed}" if only else ", which it fails" * (least < 1.0)
    return least, [f"{ratios}{over}{opened}{bodies}, {by}{only}", *[begins, then] * bool(moved)]


# States that a search of scales finds, in the words of its outcome and of the conclusion
_SCALED = {
    "a mechanism": "moves as a mechanism",
    "dislocated": "is dislocated",
    "falls": "falls",
    "first mechanism": "forms a mechanism",
}


def _list_scaled(outcome: str) -> dict[str, str]:
    """List the states that a search of scales has found, each with its least scale."""
    states = "|".join(_SCALED)
    pattern = rf"({states}) (?:from|at) (?:[\d.]+ g \()?([\d.]+) ×( or less)?"
    found = re.findall(pattern, outcome.partition(", the ")[0])
    return {state: f"{scale} ×{less}" for state, scale, less in found}


def _describe_scales(data: ReportData, rows: Sequence[Row]) -> Iterator[tuple[float, list[str]]]:
    """Yield the least scale up to which it stands, what comes beyond, and motions without any."""
    motions = [row[1].partition(",")[0] for row in rows]
    named = list(zip(rows, motions, strict=True))
    made = sorted((float(row[3]), name, row) for row, name in named if row[3] != "-")
    if not made:
        return
    least, first, row = made[0]
    found = {name: _list_scaled(row[2]) for _, name, row in made}
    # between the scales that were run nothing is known
    met = [float(at.split()[0]) for state, at in found[first].items() if state != "a mechanism"]
    unfinished = f" ({UNFINISHED})" * (UNFINISHED in row[2])
    words = f"{row[3]}{unfinished} on {row[1]}{', which it fails' * (min(met, default=2.0) <= 1.0)}"
    words += f", of {len(made)} motions" * (len(made) > 1)
    ends = [f"{_SCALED[state]} from {scale} on" for state, scale in found[first].items()]
    ends += [] if {"falls", "first mechanism"} & found[first].keys() else ["falls in no run"]
    texts = [words, f"it {join_words(ends)}"]
    falls = {name: float(x["falls"].split()[0]) for name, x in found.items() if "falls" in x}
    if falls and (weakest := min(falls, key=lambda name: falls[name])) != first:
        texts.append(f"it falls first under {weakest}, from {found[weakest]['falls']} on")
    # a search without a scale that holds may have the least of all
    if none := [name for row, name in named if row[3] == "-"]:
        texts.append(f"no scale is known up to which it stands under {join_words(none)}")
    if left := [name for name in (f"'{pair}'" for pair in data.pairs) if name not in motions]:
        texts.append(f"{join_words(left)} {'were' if left[1:] else 'was'} not scaled")
    yield least, texts


def _say_motion(data: ReportData, factor: float) -> str:
    """Say that a structure moves in a run no stronger than a multiple of the site's acceleration.

    It is empty if it moves in none. Without a spectrum the runs are the demand.
    """
    push = np.nan_to_num(factor * _peak_of_spectrum(data), nan=np.inf)
    runs = [run for run in data.runs.values() if _peak_of_ground(run) <= push]
    verdicts = [run.verdict for run in runs]
    if not any(x.mechanisms.get("verified") or x.outcome in FALLEN_STATES for x in verdicts):
        return ""
    held = all(verdict.outcome in COLLAPSE_STATES[:2] for verdict in verdicts)
    return f"in the runs it moves{', and falls in none' * held}"


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
    return f"the {code} spectrum of PGA {_peak_of_spectrum(data):.3g} g"


def read_spectrum(data: ReportData) -> Mapping[str, Any]:
    """Return the table of the assessment's spectrum, empty for that of a motion."""
    own = [data.case.settings.get(key) or {} for key in ("assessment", "suite")]
    return own[0].get("spectrum") or own[1].get("target") or {}


def _peak_of_spectrum(data: ReportData) -> float:
    """Return the spectral acceleration of the assessment's demand at period zero [g]."""
    spectrum = data.case.assessment.spectrum or data.case.target
    return float(spectrum.horizontal(0.0)) if spectrum is not None else np.nan


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
        sizes = np.array([[each.displacement, each.residual] for each in verdicts])
        if np.isfinite(sizes).all():
            largest, residual = map(format_mm, sizes.max(axis=0))
            over = "time steps" if data.fidelity == VARIED_FIDELITY else "time steps and fidelity"
            steps = ", ".join(_list_ranges_of_steps(data))
            beside = f" (over {over} {steps})" * bool(steps)
            outcome += f"; displaced by up to {largest}{beside}, {residual} at the end"
        yield _HISTORIES, (_HISTORIES, demand, outcome, "-")
    for computed in data.verdict_ranges:
        motion = computed.dataset.attrs.get("motion")
        name = f"{_VARIATIONS} under '{motion}'" if motion else _VARIATIONS
        outcome = "; ".join(filter(None, [computed.count, computed.displacements]))
        yield _VARIATIONS, (name, "the same motion", outcome + computed.unanswered, "-")
    for result, statement in data.statements.items():
        of = f" of {name_spectrum(data)}" if result == "assessment" else ""
        for name, demand, *others in statement.rows:
            beside = of
            if data.runs and demand == "no demand given":
                beside = f"; beside it motions of {_describe_peaks(data.runs.values())}"
            yield RESULTS[result], (name, f"{demand}{beside}", *others)


def _list_ranges_of_steps(data: ReportData) -> Iterator[str]:
    """Yield how far a motion displaces the structure by the steps of its run and variations."""
    for found in data.verdict_ranges:
        motion = found.dataset.attrs.get("motion")
        sizes = [
            each.displacement
            for each in found.single_changes
            if each.name in (UNVARIED, HALF_STEP) and each.outcome in COLLAPSE_STATES[:2]
        ]
        runs = [run.verdict for run in data.runs.values() if run.dataset.attrs["motion"] == motion]
        if sizes and runs and runs[0].outcome in COLLAPSE_STATES[:2]:
            sizes.append(runs[0].displacement)
            ends = f"{format_mm(min(sizes))} to {format_mm(max(sizes))}"
            yield ends + f" under '{motion}'" * (len(data.runs) > 1)


def _describe_outcomes(data: ReportData) -> Iterator[str]:
    """Yield each outcome with the motions that lead to it, and the largest displacement."""
    by_verb: dict[str, list[str]] = {}
    for name, run in data.runs.items():
        by_verb.setdefault(_VERBS[run.verdict.outcome], []).append(name)
    for verb, names in by_verb.items():
        of = f"of {_describe_peaks(data.runs[name] for name in names)}"
        under = f"{len(names)} of {len(data.runs)} motions {of}: {', '.join(names)}"
        if len(names) == len(data.runs):
            under = f"all {len(names)} motions {of}"
            under = under if len(names) > 1 else f"the motion '{names[0]}' {of}"
        fall = "; whether it falls was not computed" if verb == _VERBS["mechanism"] else ""
        yield f"{verb} under {under}{fall}"


def _describe_ends(data: ReportData) -> Iterator[str]:
    """Yield sentences on runs that were broken off, lost blocks, and those that still move."""
    for name, run in data.runs.items():
        verdict = run.verdict
        if verdict.incomplete:
            yield f"The run under '{name}' {verdict.incomplete}."
        if verdict.fall is not None and verdict.fall.blocks:
            yield f"Under '{name}' it loses {describe_lost(verdict.fall)}."
        if verdict.fall is not None and not verdict.fall.resting:
            yield f"Blocks still move at the end of '{name}'."


def describe_mechanism(verdict: Any) -> str:
    """Return the first mechanism of a run in a few words."""
    for definition in ("verified", *verdict.mechanisms):
        if (found := verdict.mechanisms.get(definition)) is not None:
            words = "verified" if definition == "verified" else f"by {definition}"
            return f"{found.kind}, {words} at {found.time:.2f} s"
    return "none by any definition"


def describe_lost(fall: CollapseState, max_names: int = 3) -> str:
    """Return the number of lost blocks, the time of the first, and the first names."""
    names = ", ".join([*fall.blocks[:max_names], *(["…"] if fall.blocks[max_names:] else [])])
    return f"{len(fall.blocks)} blocks, the first at {fall.time:.2f} s: {names}"


def list_varied(data: ReportData) -> tuple[str, ...]:
    """Return the properties that the range of the verdict varies; none without a range."""
    return data.verdict_ranges[0].properties if data.verdict_ranges else ()


def list_doubts(data: ReportData) -> list[tuple[str, str]]:
    """Return each result in doubt with its doubt, once; of runs with the number that have it."""
    verdicts = [run.verdict for run in data.runs.values()]
    doubts = [(_HISTORIES, text) for text in _merge_doubts([v.doubts for v in verdicts])]
    for found in data.verdict_ranges:
        under = f"under '{found.dataset.attrs.get('motion')}': " * (len(data.verdict_ranges) > 1)
        doubts += [(_VARIATIONS, text) for text in _doubt_displacement(data, found)]
        doubts += [(_VARIATIONS, f"{under}{doubt.cause}") for doubt in found.doubts]
    if data.verdict_ranges and (fill := list_elastic_fill(data)):
        text = f"variations take {', '.join(fill)} as rigid: as an elastic body it was not varied"
        doubts.append((_VARIATIONS, text))
    for name, stated in data.statements.items():
        doubts += [(RESULTS[name], doubt) for doubt in stated.doubts]
    return [*_merge_motions(dict.fromkeys(doubts))]


def _merge_motions(doubts: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield each doubt of a result once, with all motions under which it is true."""
    found: dict[tuple[str, ...], list[tuple[str, str]]] = {}
    for result, text in doubts:
        named = re.search(r"under '([^']+)'", text)
        plain = text.replace(named[0], "\0", 1) if named else text
        kind = _NUMBER.split(plain)[::2] if named else [text]
        found.setdefault((result, *kind), []).append((named[1] if named else "", plain))
    for (result, *_), same in found.items():
        motions, texts = ([*dict.fromkeys(column)] for column in zip(*same, strict=True))
        first, *others = (f"'{motion}'" for motion in motions)
        merged, differing = _merge_numbers(texts)
        if differing > MAX_RANGES:
            merged = f"{texts[0]}; likewise under {join_words(others)}".replace(
                "\0", f"under {first}"
            )
        yield result, merged.replace("\0", f"under {join_words([first, *others])}")


def _merge_doubts(runs: Sequence[Iterable[Doubt]]) -> Iterator[str]:
    """Yield each doubt of some runs once, with how many have it; that of a run alone as it is."""
    found: dict[tuple[str, ...], list[str]] = {}
    for cause in (cause for doubts in runs for cause in dict.fromkeys(x.cause for x in doubts)):
        found.setdefault(tuple(_NUMBER.split(cause)[::2]), []).append(cause)
    for texts in found.values():
        merged, _ = _merge_numbers(texts)
        yield f"{len(texts)} of {len(runs)} runs: {merged}" if len(runs) > 1 else merged


def _merge_numbers(texts: Sequence[str]) -> tuple[str, int]:
    """Return texts that differ in numbers alone as one, with their ranges, and how many differ."""
    parts = [_NUMBER.split(text) for text in texts]
    columns = [
        sorted(set(column), key=float) for column in zip(*(x[1::2] for x in parts), strict=True)
    ]
    ranges = [" to ".join(dict.fromkeys((column[0], column[-1]))) for column in columns]
    merged = parts[0]
    merged[1::2] = ranges
    return "".join(merged), sum(len(column) > 1 for column in columns)


def _weigh(doubt: str) -> int:
    """Return the place of a doubt among others, by its words."""
    return next((k for k, words in enumerate(_WEIGHTY) if words in doubt), len(_WEIGHTY))


def _doubt_displacement(data: ReportData, found: VerdictRange) -> Iterator[str]:
    """Yield how the unvaried run of the variations differs from the run under that motion."""
    motion, base = found.dataset.attrs.get("motion"), found.dataset.isel(run=0)
    if not motion or base["sampled"] or base["error"].item():
        return
    for run in data.runs.values():
        verdict = run.verdict
        if run.dataset.attrs.get("motion") != motion or verdict.outcome not in COLLAPSE_STATES:
            continue
        sizes = verdict.displacement, float(base["displacement"])
        fallen = [each in FALLEN_STATES for each in (verdict.outcome, base["outcome"].item())]
        own, other = (
            "fallen" if falls else f"displaced by up to {format_mm(size)}"
            for falls, size in zip(fallen, sizes, strict=True)
        )
        if fallen[0] != fallen[1] or (
            not fallen[0] and max(sizes) > MAX_RATIO_OF_DISPLACEMENTS * min(sizes)
        ):
            yield (
                f"the run under '{motion}' is {own}, the unvaried one of its variations, of "
                f"other time steps or another fidelity, {other}"
            )


def list_notes(data: ReportData) -> dict[str, list[str]]:
    """Return the notes of each result, with that on motions of another demand."""
    notes = {RESULTS[name]: [*each.notes] for name, each in data.statements.items() if each.notes}
    notes |= {_HISTORIES: missed} if (missed := note_checks(data)) else {}
    peaks = [_peak_of_ground(run) for run in data.runs.values()]
    if peaks and "assessment" in data.statements:
        mean, other = np.mean(peaks), _peak_of_spectrum(data)
        if abs(np.log(mean / other)) > np.log(MAX_RATIO_OF_PEAKS):
            notes.setdefault(RESULTS["assessment"], []).append(
                f"the spectrum has a PGA of {other:.3g} g, and the motions have {mean:.3g} g: the "
                "margin is not one on the demand of the time histories"
            )
    return notes


def list_elastic_fill(data: ReportData) -> list[str]:
    """Return the materials of blocks that yield to others, if they are elastic bodies in a run."""
    if not data.runs or ("rigid" in data.fidelity and "full" not in data.fidelity):
        return []
    structure = data.case.structure
    bodies = [structure.blocks[number] for number in find_yielding_blocks(structure)]
    return list(dict.fromkeys(block.material.name for block in bodies))


def list_unvaried(data: ReportData) -> list[str]:
    """Return what was not varied, without which "no doubt" says little; nothing without a run."""
    if not data.runs:
        return []
    single = ["motion"] if len(data.runs) == 1 else []
    if not data.verdict_ranges:
        single += ["lengths", "stiffness", "friction", "damping"]
    else:
        single.append("lengths")
        varied = {each.dataset.attrs.get("motion", "") for each in data.verdict_ranges}
        left = [f"'{name}'" for name in data.runs if name not in varied and len(data.runs) > 1]
        single += [f"properties under {join_words(left)}"] if left and "" not in varied else []
    single += ["stiffness and strength of the fill"] if list_elastic_fill(data) else []
    # the samples of a rate were scaled until they fell
    single += [] if {"scale", "risk"} & data.statements.keys() else ["size of the motions"]
    predicted = all("predicted_error" in run.dataset.attrs for run in data.runs.values())
    if not predicted and "accuracy.txt" not in data.files:
        single += ["fidelity"] if "dt" in list_varied(data) else ["time step", "fidelity"]
    study = read_study(data)
    studied = set() if study is None else list_studied(study)
    return [each for each in single if each not in studied]


def sentence(text: str) -> str:
    """Return a text with a capital at its beginning and a full stop at its end."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "?")) else ".")
