"""Head and conclusion of a report: who signs what, outcome with margin and range, doubts."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from importlib import import_module
from typing import Any

import numpy as np

from archfem.cases import result_text
from archfem.cases.case import REPORT_KEYS
from archfem.cases.report.report_data import ReportData
from archfem.dynamics.collapse_state import CollapseState
from archfem.dynamics.history import History
from archfem.dynamics.verdict import DOUBT_MARK, NO_RANGE
from archfem.dynamics.verdict_range import property_text
from archfem.joints.criteria import assessed_joints
from archfem.masonry.joint_closing import describe_closing
from archfem.units import format_mm
from archfem.view.pages.document import Section, TextBlock

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


def list_facts(data: ReportData) -> list[tuple[str, str]]:
    """List who signs what, and the principal results by name, which the report shows first."""
    report = data.case.report
    signed = [(key.replace("_", " "), report[key]) for key in REPORT_KEYS if report.get(key)]
    runs, structure = list(data.runs.values()), data.case.structure
    blocks = [("structure", f"{len(structure.free)} blocks, {len(structure.joints)} joints")]
    blocks += [("joints", structure.assessment)] if structure.assessment else []
    if not runs:
        return [*signed, *blocks]
    # Files of older versions have the acceleration at their steps alone.
    pga = max(
        run.dataset.attrs.get("pga", float(np.abs(run.dataset["ground"].values[:, 0]).max()))
        for run in runs
    )
    joints = [assessed_joints(run.joints) for run in runs]
    eccentricity = max(float(abs(each["eccentricity"]).max()) for each in joints)
    opened = " (joints came apart)" if any(bool(each["open"].any()) for each in joints) else ""
    friction = max(float(each["friction"].max()) for each in joints)
    sizes = [("PGA", f"{pga:.2f} m/s²"), ("largest |e|", f"{eccentricity:.3f}{opened}")]
    sizes.append(("largest V / N", result_text.format_ratio(friction)))
    verdict = ("verdict", summarise_outcomes(data, runs))
    return [*signed, verdict, *blocks, *sizes]


def summarise_outcomes(data: ReportData, runs: Sequence[History]) -> str:
    """Return outcome, and doubts or range, of a run, or how many runs have each outcome."""
    verdict = runs[0].verdict
    if len(runs) > 1:
        outcomes = result_text.count_outcomes([run.verdict for run in runs])
        return f"{outcomes}; doubts, of all results: {len(list_doubts(data)) or 'none'}"
    if verdict.fall is not None:
        # lost blocks have a line of their own
        verdict = replace(verdict, fall=replace(verdict.fall, time=None))
    if (found := data.verdict_range) is None:
        return verdict.headline
    # a run cannot know that a range was computed after it
    return verdict.headline.replace(NO_RANGE, f"{found.count} variations")


def build_conclusion(data: ReportData) -> Section:
    """Build the section on outcome, margin and range in sentences, with the doubts beside them."""
    sentences = [*_conclude_runs(data), *_conclude_joints(data), *_conclude_range(data)]
    sentences += _conclude_statics(data)
    blocks = [TextBlock(" ".join(sentences))] if sentences else []
    blocks += [TextBlock(f"In doubt: {text}.", "doubt") for text in list_doubts(data)]
    blocks += [TextBlock(text) for text in filter(None, [describe_what_is_not_varied(data)])]
    # a history alone has no folder of further results
    absent = [what for name, what in _FURTHER_RESULTS.items() if name not in data.files]
    if data.folder is not None and absent:
        blocks.append(TextBlock(f"Not computed: {', '.join(absent)}."))
    return Section("Conclusion", blocks)


def _conclude_runs(data: ReportData) -> Iterator[str]:
    """Yield sentences on the outcomes of the runs, and on displacements and mechanisms."""
    by_verb: dict[str, list[str]] = {}
    for name, run in data.runs.items():
        by_verb.setdefault(_VERBS[run.verdict.outcome], []).append(name)
    count, verdicts = len(data.runs), [run.verdict for run in data.runs.values()]
    for verb, names in by_verb.items():
        under = f"{len(names)} of {count} motions: {', '.join(names)}"
        if len(names) == count:
            under = f"all {count} motions" if count > 1 else f"the motion '{names[0]}'"
        yield f"The structure {verb} under {under}."
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
    if text := data.read_text("risk.txt"):
        yield sentence(f"the structure {text.splitlines()[0]}")


def _conclude_statics(data: ReportData) -> Iterator[str]:
    """Yield the decisive sentences of limit analysis, pushover, rating and assessment."""
    for name in ("limit.txt", "pushover.txt", "rating.txt"):
        if text := data.read_text(name):
            yield sentence(text.splitlines()[0])
    for part in (data.read_text("assessment.txt") or "").split("\n\n"):
        direction = part.partition(":")[0]
        checks = [line for line in part.splitlines() if re.search(r": (passes|fails)", line)]
        if checks:
            yield sentence(f"kinematic assessment, {direction}: {checks[-1]}")


def list_doubts(data: ReportData) -> list[str]:
    """Return the doubts about all results, each once; of runs with the number that have it."""
    verdicts = [run.verdict for run in data.runs.values()]
    reasons = Counter(str(doubt) for verdict in verdicts for doubt in verdict.doubts)
    doubts = list(reasons)
    if len(verdicts) > 1:
        doubts = [f"{count} of {len(verdicts)} runs: {text}" for text, count in reasons.items()]
    for name in ("limit.txt", "rating.txt", "assessment.txt", "risk.txt"):
        lines = (data.read_text(name) or "").splitlines()
        # what a kinematic assessment leaves out stands there as a note
        for mark in (DOUBT_MARK, "note: "):
            doubts += [line.removeprefix(mark) for line in lines if line.startswith(mark)]
    return list(dict.fromkeys(doubts))


def describe_what_is_not_varied(data: ReportData) -> str:
    """Say what was not varied, without which "no doubts" says little; "" without a run."""
    if not data.runs:
        return ""
    single = ["one motion"] if len(data.runs) == 1 else []
    single += [] if data.verdict_range else ["one set of properties"]
    predicted = all("predicted_error" in run.dataset.attrs for run in data.runs.values())
    if not predicted and "accuracy.txt" not in data.files:
        single.append("one model" if "dt" in list_varied(data) else "one model and time step")
    doubts = "" if list_doubts(data) else "The checks of the numbers raise no doubt. "
    if not single:
        return doubts.strip()
    return (
        f"{doubts}Not varied: {', '.join(single)}. What another choice of these would change was "
        "not computed, nor by how much the motion may be scaled."
    )


def sentence(text: str) -> str:
    """Return a text with a capital at its beginning and a full stop at its end."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")
