"""Head and conclusion of a report: who signs what, outcome with margin and range, doubts."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from importlib import import_module
from typing import Any

import numpy as np

from archfem._files import read_file_list
from archfem.cases import result_text
from archfem.cases.case import REPORT_KEYS
from archfem.cases.report.report_data import RESULTS, SHOWN_RESULTS, ReportData
from archfem.cases.result_text import Row
from archfem.dynamics.collapse_state import CollapseState
from archfem.dynamics.history import History
from archfem.dynamics.verdict import NO_RANGE
from archfem.joints.criteria import assessed_joints
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import join_names
from archfem.units import STANDARD_GRAVITY, format_mm
from archfem.view.pages.document import Grid, Section, TextBlock

# Outcomes of runs as verbs
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

# Results of runs: histories, and their variations, which the conclusion states together
_HISTORIES, _VARIATIONS = "time histories", "variations"

_FACTORS = (
    "; factor: the multiple of the demand at which a check is just passed, at which a load makes a "
    "mechanism, or, of an annual rate, at which the structure falls with a probability of one half"
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
        rows = (row for _, row in _capacity_rows(data) if row[3] != "-")
        # the place of a vehicle is in the conclusion
        factors = [
            f"{demand}: {outcome.partition(', with')[0]}, factor {factor}"
            for _, demand, outcome, factor in rows
        ]
        return [*signed, *([("verdict", "; ".join(factors))] if factors else []), *doubts, *blocks]
    pga = max(map(_peak_of_ground, runs))
    joints = [assessed_joints(run.joints) for run in runs]
    eccentricity = max(float(abs(each["eccentricity"]).max()) for each in joints)
    opened = " (joints came apart)" if any(bool(each["open"].any()) for each in joints) else ""
    friction = max(float(each["friction"].max()) for each in joints)
    sizes = [("PGA", f"{pga:.3g} g"), ("largest |e|", f"{eccentricity:.3f}{opened}")]
    sizes.append(("largest V / N", result_text.format_ratio(friction)))
    return [*signed, ("verdict", summarise_outcomes(data, runs)), *doubts, *blocks, *sizes]


def _peak_of_ground(run: History) -> float:
    """Return the horizontal peak acceleration of a run [g]."""
    # Files of older versions have the acceleration at their steps alone.
    recorded = np.abs(run.dataset["ground"].values[:, 0]).max()
    return float(run.dataset.attrs.get("pga", recorded)) / STANDARD_GRAVITY


def summarise_outcomes(data: ReportData, runs: Sequence[History]) -> str:
    """Return outcome, and doubts or range, of a run, or how many runs have each outcome."""
    verdict = runs[0].verdict
    if len(runs) > 1:
        return result_text.count_outcomes([run.verdict for run in runs])
    if verdict.fall is not None:
        # lost blocks have a line of their own
        verdict = replace(verdict, fall=replace(verdict.fall, time=None))
    own, found = runs[0].dataset.attrs.get("motion"), data.verdict_range
    if found is None or (len(data.runs) > 1 and found.dataset.attrs.get("motion") != own):
        return verdict.headline
    # a run cannot know that a range was computed after it
    return verdict.headline.replace(NO_RANGE, f"{found.count} variations{found.unanswered}")


def build_conclusion(data: ReportData) -> Section:
    """Build the section on outcomes in sentences, each with its doubts, on margins and range."""
    doubts = list_doubts(data)
    doubtful = list(dict.fromkeys(result for result, _ in doubts))
    rows = [
        (name, demand, outcome + (" (in doubt)" if result in doubtful else ""), factor)
        for result, (name, demand, outcome, factor) in _capacity_rows(data)
    ]
    lead = _build_lead(data, rows, doubtful)
    blocks: list[Any] = [TextBlock(lead)] if lead else []
    of_runs = _conclude_runs(data)
    stated = [(RESULTS[k], map(sentence, each.sentences)) for k, each in data.statements.items()]
    shown = set[str]()
    for result, sentences in ((_HISTORIES, of_runs), *stated):
        text = " ".join(sentences)
        blocks += [TextBlock(text)] if text else []
        about_these = (result, _VARIATIONS) if result == _HISTORIES else (result,)
        own = [doubt for about, doubt in doubts if about in about_these and doubt not in shown]
        shown |= {*own}  # a doubt of several results is stated once
        blocks += [TextBlock(f"In doubt: {doubt}.", "doubt") for doubt in own]
    if rows:
        head = ("", "demand", "capacity or outcome", "factor")
        factors = _FACTORS if any(row[3] != "-" for row in rows) else ""
        blocks.append(Grid(head, rows, f"Demand and capacity{factors}", "words"))
    blocks += map(TextBlock, _list_absent(data))
    return Section("Conclusion", [*blocks, _build_signatures(data.case.report)])


def _list_absent(data: ReportData) -> Iterator[str]:
    """Yield the sentences on results of another version or case, and on those not computed."""
    if data.folder is None:  # a history alone has no folder of further results
        return
    present = [name for name in SHOWN_RESULTS if f"{name}.txt" in data.files]
    present += data.statements
    absent = {f"{name}.txt": each for name, each in RESULTS.items() if name not in present}
    earlier = [
        f"{absent.pop(name)} (run `archfem {command}` again)"
        for command, group in read_file_list(data.folder).items()
        for name in group.files
        if name in absent
    ]
    made = "Not stated, for an earlier version of archfem or another case made it"
    for words, results in ((made, earlier), ("Not computed", [*absent.values()])):
        if results:
            yield f"{words}: {', '.join(results)}."


def _build_lead(data: ReportData, rows: Sequence[Row], doubtful: Sequence[str]) -> str:
    """Answer in three sentences: outcomes with their demand, least margin, what may change them."""
    # the least of a range
    checks = [
        (float(row[3].partition(" ")[0]), row) for row in rows if row[0].startswith("assessment: ")
    ]
    demand = data.case.report.get("demand", "")
    if not data.runs and not checks:
        # a load has one result, which says all
        return f"The demand, as stated: {sentence(demand)}" if demand else ""
    stated = [demand] if demand else []
    stated += [f"motions of {demand}" for name, demand, *_ in rows if name == _HISTORIES]
    lead = [f"the structure {'; it '.join(_describe_outcomes(data))}"] if data.runs else []
    if checks:
        factor, (check, _, outcome, margin) = min(checks)
        # of what is assumed of a fill
        _, only, assumed = outcome.partition(" only with ")
        fails = "" if factor >= 1.0 or only else ", and so fails"
        lead.append(
            f"its least margin is {margin}: it passes {check.partition(': ')[2]}{only}{assumed}, "
            f"up to {margin} times {name_spectrum(data)}{fails}"
        )
    lead[0] = f"for {' and '.join(stated)}: {lead[0]}" if stated else lead[0]
    changes = []
    if data.verdict_range is not None:
        found = data.verdict_range.sentence.partition("; of ")[0]
        changes.append(f"variations of its properties ({found})")
    changes += [f"the doubts given below, on {join_names(doubtful)}"] if doubtful else []
    single = list_unvaried(data)
    changes += [f"what was not varied: {', '.join(single)}"] if single else []
    lead += ["the checks of the numbers raise no doubt"] if data.runs and not doubtful else []
    lead += [f"what may change this: {'; '.join(changes)}"] if changes else []
    return " ".join(map(sentence, lead))


def name_spectrum(data: ReportData) -> str:
    """Name the demand of kinematic assessments, with its peak acceleration."""
    code = read_spectrum(data).get("code")
    if code is None:
        return "the motion"
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
        peaks = [f"{_peak_of_ground(run):.2f}" for run in data.runs.values()]
        demand = f"PGA {' to '.join(dict.fromkeys([min(peaks), max(peaks)]))} g"
        outcome = result_text.count_outcomes(verdicts) if len(peaks) > 1 else verdicts[0].outcome
        yield _HISTORIES, (_HISTORIES, demand, outcome, "-")
    if (computed := data.verdict_range) is not None:
        motion = computed.dataset.attrs.get("motion")
        name = f"{_VARIATIONS} under '{motion}'" if motion else _VARIATIONS
        yield _VARIATIONS, (name, "the same motion", computed.count + computed.unanswered, "-")
    for result, statement in data.statements.items():
        of = f" of {name_spectrum(data)}" if result == "assessment" else ""
        for name, demand, *others in statement.rows:
            yield RESULTS[result], (name, f"{demand}{of}", *others)


def _describe_outcomes(data: ReportData) -> Iterator[str]:
    """Yield each outcome with the motions that lead to it."""
    by_verb: dict[str, list[str]] = {}
    for name, run in data.runs.items():
        by_verb.setdefault(_VERBS[run.verdict.outcome], []).append(name)
    count = len(data.runs)
    for verb, names in by_verb.items():
        under = f"{len(names)} of {count} motions: {', '.join(names)}"
        if len(names) == count:
            under = f"all {count} motions" if count > 1 else f"the motion '{names[0]}'"
        yield f"{verb} under {under}"


def _conclude_runs(data: ReportData) -> Iterator[str]:
    """Yield sentences on incomplete runs, on falls, displacements and mechanisms."""
    count, verdicts = len(data.runs), [run.verdict for run in data.runs.values()]
    for name, run in data.runs.items():
        if run.verdict.incomplete:
            yield f"The run under '{name}' {run.verdict.incomplete}."
        if run.verdict.fall is not None and run.verdict.fall.blocks:
            yield f"Under '{name}' it loses {describe_lost(run.verdict.fall)}."
        if run.verdict.fall is not None and not run.verdict.fall.resting:
            yield f"Blocks still move at the end of '{name}'."
    sizes = np.array([[each.displacement, each.residual] for each in verdicts]).reshape(-1, 2)
    if np.isfinite(sizes).all() and len(sizes):
        largest, residual = map(format_mm, sizes.max(axis=0))
        yield f"The largest displacement of a block is {largest}, and {residual} at the end."
    if met := [each for each in verdicts if each.mechanisms.get("verified") is not None]:
        yield (
            f"The stones can move as a mechanism for a while under {len(met)} of {count} motions."
            if count > 1
            else f"The stones can move as a mechanism for a while: {describe_mechanism(met[0])}."
        )


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
    return () if data.verdict_range is None else data.verdict_range.properties


def list_doubts(data: ReportData) -> list[tuple[str, str]]:
    """Return each result in doubt with its doubt, once; of runs with the number that have it."""
    verdicts = [run.verdict for run in data.runs.values()]
    reasons = Counter(doubt.cause for verdict in verdicts for doubt in verdict.doubts)
    count = len(verdicts)
    of_runs = [f"{n} of {count} runs: {text}" if count > 1 else text for text, n in reasons.items()]
    doubts = [(_HISTORIES, text) for text in of_runs]
    if data.verdict_range is not None:
        doubts += [(_VARIATIONS, doubt.cause) for doubt in data.verdict_range.doubts]
        if fill := list_elastic_fill(data):
            text = (
                f"variations take {', '.join(fill)} as rigid: as an elastic body it was not varied"
            )
            doubts.append((_VARIATIONS, text))
    for name, stated in data.statements.items():
        doubts += [(RESULTS[name], doubt) for doubt in stated.doubts]
    if "assessment" in data.statements:
        doubts += [(RESULTS["assessment"], text) for text in _doubt_spectrum(data)]
    if "from memory" in (data.read_text("rating.txt") or ""):
        text = "values marked as from memory were not compared with the text of their code"
        doubts.append((RESULTS["rating"], text))
    return list(dict.fromkeys(doubts))


def _doubt_spectrum(data: ReportData) -> Iterator[str]:
    """Yield why a margin on the spectrum may mislead: a check of another code, other motions."""
    state = data.case.assessment.options.get("limit_state", "NTC-2018 SLV")
    name, code = getattr(state, "name", state), read_spectrum(data).get("code", "NTC")
    if name.startswith("NTC") and not str(code).startswith("NTC"):
        yield f"the check is one of NTC, which was not made for a spectrum of {code}"
    peaks = [_peak_of_ground(run) for run in data.runs.values()]
    if peaks:
        mean, other = np.mean(peaks), _peak_of_spectrum(data)
        if abs(np.log(mean / other)) > np.log(MAX_RATIO_OF_PEAKS):
            yield (
                f"the spectrum has a PGA of {other:.3g} g, and the motions have {mean:.3g} g: the "
                "margin is not one on the demand of the time histories"
            )


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
    single = ["one motion"] if len(data.runs) == 1 else []
    single += [] if data.verdict_range else ["one set of properties"]
    single += ["stiffness and strength of the fill"] if list_elastic_fill(data) else []
    predicted = all("predicted_error" in run.dataset.attrs for run in data.runs.values())
    if not predicted and "accuracy.txt" not in data.files:
        single.append("one model" if "dt" in list_varied(data) else "one model and time step")
    # the samples of a rate were scaled until they fell
    return single if {"scale", "risk"} & data.statements.keys() else [*single, "size of motions"]


def sentence(text: str) -> str:
    """Return a text with a capital at its beginning and a full stop at its end."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")
