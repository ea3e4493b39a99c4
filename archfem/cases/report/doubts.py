"""Doubts and notes of the results in a report, and what was not varied."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from archfem._display import NOTE_MARK
from archfem._files import read_sealed_json
from archfem.cases.answers import MATCHED, RESULTS, Ratios, read_numbers
from archfem.cases.defaults import note_loads_left_out
from archfem.cases.report.motion_rules import check_motions, note_checks, note_rating
from archfem.cases.report.report_data import ReportData
from archfem.cases.report.study_findings import list_studied
from archfem.cases.result_text import OF_GIVEN_FILL
from archfem.dynamics.collapse_state import COLLAPSE_STATES, FALLEN_STATES, RANGE_REMEDY
from archfem.dynamics.history import History
from archfem.dynamics.verdict_range import MAX_RATIO_OF_DISPLACEMENTS, VerdictRange, property_text
from archfem.masonry.out_of_plane import UNCHECKED_ACROSS
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import join_words
from archfem.models.model import Doubt, group_doubts, merge_doubts
from archfem.statics.assessment_checks import OF_SPLIT, UPPER_BOUND
from archfem.statics.equilibrium import MAX_SLIP_AT_REST
from archfem.units import STANDARD_GRAVITY, Ends

# Ratio of the peaks of motions and spectrum beyond which they are different demands: those of
# matched motions exceed the target by a tenth
MAX_RATIO_OF_PEAKS = 1.25

# Ratio of the displacements of a run and the unvaried of its variations beyond which a range of
# these does not hold for the run: other steps alone change them by `MAX_RATIO_OF_DISPLACEMENTS`
MAX_RATIO_TO_RUN = 2.0

# Fewest motions that test a spectrum, in both norms of the rules
MIN_MOTIONS = 3

# Results of runs: histories, and their variations
HISTORIES, VARIATIONS = "time histories", "variations"

# Names of blocks in a note, by which those of mirrored mechanisms differ alone
_OF_BLOCKS = re.compile(r"centroid of .*?(?=, at first|, whose)")

# Result of cases beside the given one
STUDIES = "study"

# Stiffnesses of contacts that it varies, by its names
_STIFFNESSES = {"k_n": "normal_stiffness", "k_s": "shear_stiffness"}

# What `[verdict.vary]` varies, in the words of the conclusion
_VARIED_PROPERTIES = "stiffness", "friction", "damping"


def list_varied(data: ReportData) -> tuple[str, ...]:
    """Return the properties that the range of the verdict varies; none without a range."""
    return data.verdict_ranges[0].properties if data.verdict_ranges else ()


def list_doubts(data: ReportData) -> list[tuple[str, Doubt]]:
    """Return each result in doubt with its doubts, each kind once, of the runs that have it."""
    ranges, doubts = data.verdict_ranges, [(HISTORIES, doubt) for doubt in _merge_runs(data)]
    several = max(len(ranges), len(data.runs)) > 1
    varied = list[Doubt]()
    for found in ranges:
        under = str(found.dataset.attrs.get("motion", "")) * several
        own = [*_doubt_displacement(data, found), *found.doubts]
        varied += [replace(doubt, place=under) for doubt in own]
    doubts += [(VARIATIONS, doubt) for doubt in _merge_motions(varied)]
    if ranges and (fill := list_elastic_fill(data)):
        text = f"variations take {', '.join(fill)} as rigid: as an elastic body it was not varied"
        doubts.append((VARIATIONS, Doubt(text)))
    doubts += [(VARIATIONS, Doubt(words)) for words in _list_unfinished(data)]
    for name, stated in data.statements.items():
        doubts += [(RESULTS[name], doubt) for doubt in _merge_motions(stated.doubts)]
    known = {doubt.kind for _, doubt in doubts}
    words = "none of its cases is known to have the structure of this report"
    others = (each.name for each in data.studies if not each.is_own)
    doubts += [(STUDIES, Doubt(f"{name}: {words}")) for name in others]
    # with their cases as a part of the words: they are of no other result
    listed = (x for study in data.own_studies for x in study.doubts if x.kind not in known)
    return [*doubts, *((STUDIES, Doubt(str(replace(doubt, remedy="")))) for doubt in listed)]


def _list_unfinished(data: ReportData) -> Iterator[str]:
    """Yield how many runs of a verdict, and of a study in the folder, were finished, if not all."""
    pairs = (data.case.suite or {}).get("pairs", ())
    places = {f"variations/{pair}": f"verdict --pair {pair}" for pair in pairs}
    for place, command in {"variations": "verdict", **places, "": "study"}.items():
        path = (data.folder or Path()) / place / "progress.json"
        if data.folder and path.is_file():
            progress = read_sealed_json(path, "progress")
            if (done := progress["done"]) < (total := progress["total"]):
                yield f"unfinished: {done} of {total} runs; run `archfem {command}` again"


def _merge_runs(data: ReportData) -> Iterator[Doubt]:
    """Yield each kind of doubt of the runs once, with how many of several runs have it."""
    verdicts = [run.verdict for run in data.runs.values()]
    for same in group_doubts(x for each in verdicts for x in each.doubts):
        count = sum(any(doubt in same for doubt in each.doubts) for each in verdicts)
        yield merge_doubts(same, f"{count} of {len(verdicts)} runs" * (len(verdicts) > 1))


def _merge_motions(doubts: Iterable[Doubt]) -> Iterator[Doubt]:
    """Yield each kind of doubt once, under all of its motions, which are the places of some."""
    for same in group_doubts(doubts):
        motions = dict.fromkeys(f"'{doubt.place}'" for doubt in same if doubt.place)
        yield merge_doubts(same, f"under {join_words([*motions])}" * bool(motions))


def list_checks(data: ReportData) -> list[Ratios]:
    """List the checks of an assessment; the linear one decides if it is alone."""
    checks = read_numbers(Ratios, data.statements.get("assessment"))
    return [check for check in checks if not check.linear] or checks


def list_decisive_doubts(data: ReportData, doubts: Sequence[tuple[str, Doubt]]) -> list[str]:
    """List the results whose doubts may change the answer.

    A bound from above can not change an assessment of which a check fails by it, nor a study whose
    cases all do; nor does the split of weights where a check fails by any.
    """
    checks, studies = list_checks(data), [each.worst for each in data.own_studies if each.doubts]
    margins = [worst.get("least_margin", [1.0]) for worst in studies]
    failed = {
        RESULTS["assessment"]: any(max(x.least, x.most) < 1.0 for x in checks),
        STUDIES: all(len(each) and max(each) < 1.0 for each in margins),
    }
    bounded = {
        (result, doubt)
        for result, doubt in doubts
        if failed.get(result) and (UPPER_BOUND in str(doubt) or OF_SPLIT in doubt.words)
    }
    return list(dict.fromkeys(each[0] for each in doubts if each not in bounded))


def object_to_motions(data: ReportData) -> str:
    """Say why the runs are no test of the spectrum of an assessment; "" if they are one."""
    suite, spectrum = data.case.suite or {}, read_spectrum(data)
    own = data.case.settings.get("suite", {}).get("target")
    matched = suite.get("matched", False) and own == spectrum
    size = (suite.get("scale", 1.0) if matched else 1.0) / suite.get("reduction", 1.0)
    rules = [x.met or x.required.startswith("no rule") for x in check_motions(data)] or [False]
    outcomes = {x.verdict.outcome for x in data.runs.values()}
    reasons = {
        "they leave out the loads of [assessment]": bool(note_loads_left_out(data.case)),
        "their displacements are small": data.case.analysis.displacements != "large",
        "outcomes are unknown": not outcomes <= {*COLLAPSE_STATES},
        f"{join_words(data.missing)} were not run": bool(data.missing),
    }
    if spectrum:  # else the motions are the demand
        notes = data.statements["assessment"].notes
        reasons |= {
            "their target is another spectrum": own not in (None, spectrum),
            f"{MIN_MOTIONS} at least are needed": len(data.runs) < MIN_MOTIONS,
            f"they have {size:.3g} of its size": size < 1.0,
            "they end before the period of the check": any(MATCHED in x for x in notes),
            "they are not matched to it, and no rules of a norm are met": not (
                matched or all(rules)
            ),
        }
    return next((reason for reason, holds in reasons.items() if holds), "")


def _doubt_displacement(data: ReportData, found: VerdictRange) -> Iterator[Doubt]:
    """Yield how the unvaried run of the variations differs from the run under that motion."""
    run, base = data.runs.get(found.dataset.attrs.get("motion", "")), found.dataset.isel(run=0)
    if run is None or base["sampled"] or base["error"].item():
        return
    verdict = run.verdict
    if verdict.outcome not in COLLAPSE_STATES:
        return
    sizes = verdict.displacement, float(base["displacement"])
    fallen = [each in FALLEN_STATES for each in (verdict.outcome, base["outcome"].item())]
    own, other = ("falls" if falls else "is displaced by up to {:mm}" for falls in fallen)
    # displaced by less it stands as drawn
    largest = max(MAX_RATIO_OF_DISPLACEMENTS * min(sizes), MAX_SLIP_AT_REST)
    if fallen[0] != fallen[1] or (not fallen[0] and max(sizes) > largest):
        held = (size for size, falls in zip(sizes, fallen, strict=True) if not falls)
        words = f"the run {own}; with another time step or fidelity it {other}"
        yield Doubt(words, RANGE_REMEDY, tuple(held))


def spans_run(data: ReportData, found: VerdictRange) -> bool:
    """Return whether the unvaried of variations is displaced nearly as far as the run."""
    run, base = data.runs.get(found.dataset.attrs.get("motion", "")), found.dataset.isel(run=0)
    if run is None or base["sampled"] or run.verdict.outcome in FALLEN_STATES:
        return True
    sizes = run.verdict.displacement, float(base["displacement"])
    return not max(sizes) > MAX_RATIO_TO_RUN * min(sizes)


def _select_notes(notes: Sequence[str]) -> list[str]:
    """Return the notes that the conclusion has; of two mirrored mechanisms the first has it."""
    # what is not about the least factor of a push stands in its text alone, and a paragraph has
    # what is not checked across
    kept = (x for x in notes if not x.startswith((OF_GIVEN_FILL, UNCHECKED_ACROSS)))
    first = dict[str, str]()
    for note in kept:
        first.setdefault(_OF_BLOCKS.sub("", note), note)
    return [*first.values()]


def list_notes(data: ReportData) -> dict[str, list[str]]:
    """Return the notes of each result, with those on the norm: of motions, and of ratings."""
    notes = {
        RESULTS[name]: own
        for name, each in data.statements.items()
        for notes in [[*(note_rating(data) if name == "rating" else ()), *each.notes]]
        if (own := _select_notes(notes))
    }
    left_out = [x.removeprefix(NOTE_MARK) for x in note_loads_left_out(data.case)]
    missed = [*note_checks(data), *left_out * bool(data.runs)]
    return notes | ({HISTORIES: missed} if missed else {})


def list_ranges(data: ReportData, found: VerdictRange) -> list[tuple[str, str, str]]:
    """Return each varied property, its range, and the mark of this."""
    rows = list[tuple[str, str, str]]()
    for name in found.properties:
        values = found.dataset[name].values
        mark = "given" if name in data.read_table("verdict").get("vary", ()) else "default"
        if values.dtype.kind != "f":
            words = ", ".join(dict.fromkeys(map(str, values)))
            rows.append((property_text(name), words, mark))
            continue
        ends, unit = Ends.of(values), " × that of the case"
        own = dict[str, list[float]]()  # of each contact, which may be of stones or of fill
        for joint in data.case.structure.joints if name in found.dataset.attrs else ():
            own.setdefault(joint.contact.name, []).append(
                getattr(joint.contact, _STIFFNESSES[name]) / 1e9
            )
        if len(own) > 1:
            spans = (
                f"{k} {Ends((ends[0] * min(x), ends[1] * max(x))):.3g}" for k, x in own.items()
            )
            unit = f" × that of each joint: {'; '.join(spans)} MPa/mm"
        elif name in found.dataset.attrs:
            given = found.dataset.attrs[name] / 1e9
            ends, unit = Ends(given * end for end in ends), " MPa/mm"
        unit = " added to that of the case" if name == "friction" else unit
        rows.append((property_text(name), f"{ends:.3g}{unit}", mark))
    return rows


def list_elastic_fill(data: ReportData) -> list[str]:
    """Return the materials of blocks that yield to others, if they are elastic bodies in a run."""
    if not data.runs or ("rigid" in data.fidelity and "full" not in data.fidelity):
        return []
    structure = data.case.structure
    bodies = [structure.blocks[number] for number in find_yielding_blocks(structure)]
    return list(dict.fromkeys(block.material.name for block in bodies))


def list_unvaried(data: ReportData) -> list[str]:
    """Return what was not varied, without which "no doubt" says little."""
    studied, static = set[str](), set[str]()
    for study in data.own_studies:
        (static if data.runs and study.is_static else studied).update(list_studied(study))
    if not data.runs:
        computed = {"limit", "assessment", "pushover"} & data.statements.keys()
        needed = ["lengths", *["stiffness"] * ("pushover" in computed), "friction"]
        return [each for each in needed if computed and each not in studied]
    single = ["motion"] if len(data.runs) == 1 else []
    if not data.verdict_ranges:
        single += ["lengths", *_VARIED_PROPERTIES]
    else:
        single.append("lengths")
        varied = {each.dataset.attrs.get("motion", "") for each in data.verdict_ranges}
        single += _list_unvaried_under(data, data.runs.keys() - varied) if "" not in varied else []
    single += ["stiffness and strength of the fill"] if list_elastic_fill(data) else []
    # the samples of a rate were scaled until they fell
    single += [] if {"scale", "risk"} & data.statements.keys() else ["size of the motions"]
    predicted = all("predicted_error" in run.dataset.attrs for run in data.runs.values())
    if not predicted and "accuracy.txt" not in data.files:
        searches = [data.read_text(x) or "" for x in data.list_parts("scale.csv").values()]
        steps = {run.partition(",")[0] for x in searches for run in x.splitlines()[1:]}
        stepped = "dt" in list_varied(data) or len(steps) > 1
        single += ["fidelity"] if stepped else ["time step", "fidelity"]
    alone = " (varied in statics alone)"
    return [f"{each}{alone * (each in static)}" for each in single if each not in studied]


def _list_unvaried_under(data: ReportData, left: Collection[str]) -> list[str]:
    """List the properties that were varied under other motions of several than those left."""
    found = dict[str, list[str]]()
    for name in (x for x in data.runs if x in left and len(data.runs) > 1):
        studies = [x for x in data.own_studies if name in x.motions and not x.is_static]
        studied = set[str]().union(*map(list_studied, studies))
        left_out = [x for x in _VARIED_PROPERTIES if x not in studied]
        words = join_words(left_out) if studied.intersection(_VARIED_PROPERTIES) else "properties"
        found.setdefault(words, []).append(f"'{name}'")
    return [f"{words} under {join_words(names)}" for words, names in found.items() if words]


def peak_of_ground(run: History) -> float:
    """Return the horizontal peak acceleration of a run [g]."""
    return float(run.dataset.attrs["pga"]) / STANDARD_GRAVITY


def read_spectrum(data: ReportData) -> Mapping[str, Any]:
    """Return the table of the assessment's spectrum, empty for that of a motion."""
    own = [data.case.settings.get(key) or {} for key in ("assessment", "suite")]
    return own[0].get("spectrum") or own[1].get("target") or {}
