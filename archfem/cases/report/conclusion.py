"""Head and conclusion of a report: who signs what, outcome with margin and range, doubts."""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from hashlib import sha256
from importlib import import_module
from typing import Any

import numpy as np

from archfem.cases import result_text
from archfem.cases.case import REPORT_KEYS
from archfem.cases.report.report_data import NOTE_MARK, ReportData
from archfem.dynamics.collapse_state import CollapseState
from archfem.dynamics.history import History
from archfem.dynamics.verdict import DOUBT_MARK, NO_RANGE
from archfem.dynamics.verdict_range import property_text
from archfem.joints.criteria import assessed_joints
from archfem.limit.rating import PRESSURE_RANGE
from archfem.masonry.joint_closing import describe_closing
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.motion.hazard import DESIGN_PERIOD, MEASURES
from archfem.units import STANDARD_GRAVITY, format_mm
from archfem.view.pages.document import Grid, Section, TextBlock

_Row = tuple[str, str, str, str]  # result, demand, capacity or outcome, factor

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


# Files of further commands, and what they hold
_FURTHER_RESULTS = {
    "modes.txt": "modes",
    "limit.txt": "limit analysis",
    "rating.txt": "a rating for a vehicle",
    "assessment.txt": "a kinematic assessment",
    "accuracy.txt": "a comparison of models and time steps",
    "verdict_range.txt": "the range of the verdict over uncertain properties",
    "risk.txt": "the annual rate of collapse",
}


# Result that the conclusion states with the time histories
_VARIATIONS = "variations"

# Results that the conclusion states, in this order, by the files of their commands
_STATED_RESULTS = {
    "": "time histories",
    "limit.txt": "limit analysis",
    "pushover.txt": "pushover",
    "rating.txt": "rating",
    "assessment.txt": "kinematic assessment",
    "risk.txt": "annual rate of collapse",
}

_FACTORS = (
    "; factor: the multiple of the demand at which a check is just passed, at which a load makes a "
    "mechanism, or, of an annual rate, at which the structure falls with a probability of one half"
)

# A check of a kinematic assessment
_CHECK = re.compile(
    r"(?P<name>.*): capacity (?P<capacity>\S+ \S+), demand (?P<demand>\S+ [^\s:]+).*: "
    r"(?P<outcome>passes|fails), the spectrum may be (?P<factor>\S+) times as strong(?P<rest>.*)"
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
    if not runs:
        return [*signed, *blocks]
    pga = max(map(_peak_of_ground, runs))
    joints = [assessed_joints(run.joints) for run in runs]
    eccentricity = max(float(abs(each["eccentricity"]).max()) for each in joints)
    opened = " (joints came apart)" if any(bool(each["open"].any()) for each in joints) else ""
    friction = max(float(each["friction"].max()) for each in joints)
    sizes = [("PGA", f"{pga:.2f} m/s²"), ("largest |e|", f"{eccentricity:.3f}{opened}")]
    sizes.append(("largest V / N", result_text.format_ratio(friction)))
    verdict = [("verdict", summarise_outcomes(data, runs))]
    doubtful = list(dict.fromkeys(result for result, _ in list_doubts(data)))
    verdict += [("in doubt", ", ".join(doubtful))] if doubtful else []
    return [*signed, *verdict, *blocks, *sizes]


def _peak_of_ground(run: History) -> float:
    """Return the horizontal peak acceleration of a run [m/s²]."""
    # Files of older versions have the acceleration at their steps alone.
    steps = float(np.abs(run.dataset["ground"].values[:, 0]).max())
    return float(run.dataset.attrs.get("pga", steps))


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
    return verdict.headline.replace(NO_RANGE, f"{found.count} variations")


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
    for name, result in _STATED_RESULTS.items():
        text = " ".join(_conclude_file(data, name) if name else _conclude_histories(data))
        blocks += [TextBlock(text)] if text else []
        about_these = (result,) if name else (result, _VARIATIONS)
        own = (doubt for about, doubt in doubts if about in about_these)
        blocks += [TextBlock(f"In doubt: {doubt}.", "doubt") for doubt in own]
    if rows:
        head = ("", "demand", "capacity or outcome", "factor")
        factors = _FACTORS if any(row[3] != "-" for row in rows) else ""
        blocks.append(Grid(head, rows, f"Demand and capacity{factors}", "words"))
    blocks += [TextBlock(text) for text in filter(None, [describe_what_is_not_varied(data)])]
    # a history alone has no folder of further results
    absent = [what for name, what in _FURTHER_RESULTS.items() if name not in data.files]
    if data.folder is not None and absent:
        blocks.append(TextBlock(f"Not computed: {', '.join(absent)}."))
    return Section("Conclusion", [*blocks, _build_signatures(data.case.report)])


def _build_lead(data: ReportData, rows: Sequence[_Row], doubtful: Sequence[str]) -> str:
    """Answer in a few sentences: demand, outcomes, variations, least margin, results in doubt."""
    checks = [(float(row[3]), row[0]) for row in rows if row[0].startswith("assessment: ")]
    if not data.runs and not checks:
        return ""  # a load has one result, which says all
    stated = [data.case.report["demand"]] if data.case.report.get("demand") else []
    stated += [f"motions of {demand}" for name, demand, *_ in rows if name == "time histories"]
    lead = [f"the structure {text}" for text in _describe_outcomes(data)]
    if data.verdict_range is not None:
        lead.append(f"it {data.verdict_range.count} variations of its properties")
    if checks:
        factor, check = min(checks)
        outcome = "passes" if factor >= 1.0 else "fails"
        lead.append(f"it {outcome} with a least margin of {factor:g} on the spectrum, by {check}")
    lead += [f"in doubt, for reasons given below: {', '.join(doubtful)}"] if doubtful else []
    lead[0] = f"for {' and '.join(stated)}: {lead[0]}" if stated else lead[0]
    return " ".join(map(sentence, lead))


def _build_signatures(report: Mapping[str, str]) -> Grid:
    """Build the lines to be signed, with the names and the date that are given."""
    rows = [
        (who.replace("_", " "), report.get(who, ""), report.get("date", ""), "")
        for who in ("author", "checked_by")
    ]
    return Grid(("", "name", "place, date", "signature"), rows, "", "form")


def _capacity_rows(data: ReportData) -> Iterator[tuple[str, _Row]]:
    """Yield each result with its demand, capacity or outcome, and factor; "-" where is none."""
    if stated := data.case.report.get("demand"):
        yield "", ("as stated", stated, "-", "-")
    if data.runs:
        verdicts = [run.verdict for run in data.runs.values()]
        peaks = [f"{_peak_of_ground(run) / STANDARD_GRAVITY:.2f}" for run in data.runs.values()]
        demand = f"PGA {' to '.join(dict.fromkeys([min(peaks), max(peaks)]))} g"
        outcome = result_text.count_outcomes(verdicts) if len(peaks) > 1 else verdicts[0].outcome
        yield "time histories", ("time histories", demand, outcome, "-")
    if (computed := data.verdict_range) is not None:
        motion = computed.dataset.attrs.get("motion")
        name = f"{_VARIATIONS} under '{motion}'" if motion else _VARIATIONS
        yield _VARIATIONS, (name, "the same motion", computed.count, "-")
    for name, result in _STATED_RESULTS.items():
        if text := data.read_text(name):
            build: dict[str, Callable[[str], Iterator[_Row]]]
            build = {"assessment.txt": _assessment_rows, "risk.txt": partial(_risk_row, data)}
            for row in build.get(name, partial(_load_row, result))(text):
                yield result, row


def _load_row(result: str, text: str) -> Iterator[_Row]:
    """Yield the row of a load that grows until it makes a mechanism."""
    first = text.splitlines()[0]
    if found := re.search(r" for (.*?): factor (\S+) (.*?), ((?:passes|fails).*)", first):
        vehicle, factor, place, outcome = found.groups()
        yield result, vehicle, f"{outcome}, {place}", factor
    elif found := re.search(r", at (\S+(?: to \S+)?) times (.*)", first):
        yield result, found[2], "a mechanism", found[1]
    elif found := re.search(r", at (.*)", first):
        yield result, "-", f"a mechanism at {found[1]}", "-"
    else:
        yield result, "-", first.partition(": ")[2], "-"


def _list_checks(text: str) -> dict[str, list[str]]:
    """Return the checks of a kinematic assessment, each with the directions in which it holds."""
    checks: dict[str, list[str]] = {}
    for part in text.split("\n\n"):
        for line in filter(_CHECK.match, part.splitlines()):
            checks.setdefault(line, []).append(part.partition(":")[0])
    return checks


def _assessment_rows(text: str) -> Iterator[_Row]:
    """Yield a row for each check of a kinematic assessment."""
    for line, directions in _list_checks(text).items():
        if found := _CHECK.match(line):
            name = f"assessment: {found['name']}, {' and '.join(directions)}"
            # a check of displacement passes, too, where the mechanism does not begin to move
            unmoved = bool(found["rest"]) and found["outcome"] == "passes"
            rest = ", for the mechanism does not begin to move" if unmoved else ""
            outcome = f"{found['capacity']}, {found['outcome']}{rest}"
            yield name, found["demand"], outcome, found["factor"]


def _risk_row(data: ReportData, text: str) -> Iterator[_Row]:
    """Yield the row of the annual rate: hazard by its return periods, and median of the falls."""
    found, risk = re.search(r"falls at (.*? a year).*; median (\S+) ", text), data.case.risk
    if not found or risk is None:
        return
    hazard = risk.hazard
    name, unit = hazard.measure.upper().replace("_AVG", ", mean,"), MEASURES[hazard.measure]
    few = len(hazard.intensity) <= 4
    years = 1.0 / hazard.rate if few else np.array([DESIGN_PERIOD])
    sizes = hazard.intensity_of(years)
    listed = ", ".join(f"{value:.3g}" for value in sizes)
    demand = f"{name} {listed} {unit} once in {', '.join(f'{each:.4g}' for each in years)} years"
    if len(sizes) == 2:  # one line in double logarithm
        slope = float(np.log(years[1] / years[0]) / np.log(sizes[1] / sizes[0]))
        demand += f", rate {float(sizes[0]) ** slope / years[0]:.3g} a^-{slope:.3g}"
    factors = ", ".join(f"{float(found[2]) / value:.3g}" for value in sizes)
    yield "annual rate", demand, f"median {name} {found[2]} {unit}, falls at {found[1]}", factors


def _conclude_histories(data: ReportData) -> list[str]:
    """Return the sentences on the runs, on the law of their joints, and on their range."""
    return [*_conclude_runs(data), *_conclude_joints(data), *_conclude_range(data)]


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
    known = [each for each in verdicts if "verified" in each.mechanisms]
    if met := sum(each.mechanisms["verified"] is not None for each in known):
        yield (
            f"The stones can move as a mechanism for a while under {met} of {count} motions."
            if count > 1
            else f"The stones can move as a mechanism for a while: {describe_mechanism(known[0])}."
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


def _conclude_joints(data: ReportData) -> Iterator[str]:
    """Yield the sentence on the law by which joints close, if runs depend on it."""
    law = describe_closing(data.case.structure)
    if data.runs and law:
        varied = {"joint_rule", "k_n", "finish"}.intersection(list_varied(data))
        yield sentence(f"{law}, which was {'varied' if varied else 'not varied'}")


def list_varied(data: ReportData) -> tuple[str, ...]:
    """Return the properties that the range of the verdict varies; none without a range."""
    return () if data.verdict_range is None else data.verdict_range.properties


def _conclude_range(data: ReportData) -> Iterator[str]:
    """Yield the sentences on the range of the verdict and on the risk, if the folder has them."""
    if (computed := data.verdict_range) is not None:
        words = ", ".join(map(property_text, computed.properties))
        varied = " and ".join(words.rsplit(", ", 1))
        verb = "is" if len(computed.properties) == 1 else "are"
        # files of older versions do not name the motion
        motion = computed.dataset.attrs.get("motion") if len(data.runs) > 1 else None
        under = f" under '{motion}'" if motion else ""
        yield f"Where {varied} {verb} uncertain,{under} the structure {computed.sentence}."


def _conclude_file(data: ReportData, name: str) -> list[str]:
    """Return the decisive sentences of the file of a command."""
    text = data.read_text(name)
    if not text:
        return []
    if name == "risk.txt":
        return [sentence(f"the structure {text.splitlines()[0]}")]
    if name != "assessment.txt":
        first, *others = text.splitlines()
        return list(map(sentence, [first, *(x for x in others if x.startswith(PRESSURE_RANGE))]))
    decisive: dict[str, list[str]] = {}  # the last check of each direction
    for part in text.split("\n\n"):
        for line, ways in [*_list_checks(part).items()][-1:]:
            decisive.setdefault(line, []).extend(ways)
    return [
        sentence(f"kinematic assessment, {' and '.join(ways)}: {line}")
        for line, ways in decisive.items()
    ]


def list_doubts(data: ReportData) -> list[tuple[str, str]]:
    """Return each result in doubt with its doubt, once; of runs with the number that have it."""
    verdicts = [run.verdict for run in data.runs.values()]
    reasons = Counter(doubt.cause for verdict in verdicts for doubt in verdict.doubts)
    count = len(verdicts)
    of_runs = [f"{n} of {count} runs: {text}" if count > 1 else text for text, n in reasons.items()]
    doubts = [("time histories", text) for text in of_runs]
    if data.verdict_range is not None:
        doubts += [(_VARIATIONS, str(doubt)) for doubt in data.verdict_range.doubts]
    for name, result in _STATED_RESULTS.items():
        lines = (data.read_text(name) or "").splitlines()
        for mark in (DOUBT_MARK, NOTE_MARK):
            doubts += [(result, line.removeprefix(mark)) for line in lines if line.startswith(mark)]
    return list(dict.fromkeys(doubts))


def list_elastic_fill(data: ReportData) -> list[str]:
    """Return the materials of blocks that yield to others, if they are elastic bodies in a run."""
    if not data.runs or ("rigid" in data.fidelity and "full" not in data.fidelity):
        return []
    structure = data.case.structure
    bodies = [structure.blocks[number] for number in find_yielding_blocks(structure)]
    return list(dict.fromkeys(block.material.name for block in bodies))


def describe_what_is_not_varied(data: ReportData) -> str:
    """Say what was not varied, without which "no doubts" says little; "" without a run."""
    if not data.runs:
        return ""
    single = ["one motion"] if len(data.runs) == 1 else []
    single += [] if data.verdict_range else ["one set of properties"]
    single += ["stiffness and strength of the fill"] if list_elastic_fill(data) else []
    predicted = all("predicted_error" in run.dataset.attrs for run in data.runs.values())
    if not predicted and "accuracy.txt" not in data.files:
        single.append("one model" if "dt" in list_varied(data) else "one model and time step")
    doubts = "" if list_doubts(data) else "The checks of the numbers raise no doubt. "
    if not single:
        return doubts.strip()
    # the samples of a rate were scaled until they fell
    scale = "" if "risk.txt" in data.files else ", nor by how much the motion may be scaled"
    return (
        f"{doubts}Not varied: {', '.join(single)}. What another choice of these would change was "
        f"not computed{scale}."
    )


def sentence(text: str) -> str:
    """Return a text with a capital at its beginning and a full stop at its end."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")
