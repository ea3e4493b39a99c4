"""Doubts and notes of the results in a report, and what was not varied."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from archfem.cases.answers import RESULTS, Row
from archfem.cases.report.motion_rules import note_checks
from archfem.cases.report.report_data import ReportData
from archfem.cases.report.study_findings import list_studied, read_study
from archfem.dynamics.collapse_state import COLLAPSE_STATES, FALLEN_STATES
from archfem.dynamics.history import History
from archfem.dynamics.verdict_range import MAX_RATIO_OF_DISPLACEMENTS, VerdictRange
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import join_words
from archfem.models.model import Doubt
from archfem.units import STANDARD_GRAVITY, format_mm

# Ratio of the peaks of motions and spectrum beyond which they are different demands: those of
# matched motions exceed the target by a tenth
MAX_RATIO_OF_PEAKS = 1.25

# Doubts that outweigh others, the first most: a conclusion states these before others
_WEIGHTY = ("as rigid blocks none falls", "fall", "displace")

# Numbers of a doubt that differ from run to run: names of joints end in whole ones
_NUMBER = re.compile(
    r"(\d+\.\d+(?:e[-+]?\d+)?|\d+(?= (?:mm|m|ms|s|g|%|of)\b)|(?<= of )\d+|\d+(?=%))"
)

# Numbers of a doubt beyond which their ranges over several motions would be hard to read
MAX_RANGES = 2

# Results of runs: histories, and their variations
HISTORIES, VARIATIONS = "time histories", "variations"


def list_varied(data: ReportData) -> tuple[str, ...]:
    """Return the properties that the range of the verdict varies; none without a range."""
    return data.verdict_ranges[0].properties if data.verdict_ranges else ()


def list_doubts(data: ReportData) -> list[tuple[str, str]]:
    """Return each result in doubt with its doubt, once; of runs with the number that have it."""
    verdicts = [run.verdict for run in data.runs.values()]
    doubts = [(HISTORIES, text) for text in _merge_doubts([v.doubts for v in verdicts])]
    for found in data.verdict_ranges:
        under = f"under '{found.dataset.attrs.get('motion')}': " * (len(data.verdict_ranges) > 1)
        doubts += [(VARIATIONS, text) for text in _doubt_displacement(data, found)]
        doubts += [(VARIATIONS, f"{under}{doubt.cause}") for doubt in found.doubts]
    if data.verdict_ranges and (fill := list_elastic_fill(data)):
        text = f"variations take {', '.join(fill)} as rigid: as an elastic body it was not varied"
        doubts.append((VARIATIONS, text))
    for name, stated in data.statements.items():
        own = _shorten_scales(stated.doubts) if name == "scale" else stated.doubts
        doubts += [(RESULTS[name], doubt) for doubt in own]
    return [*_merge_motions(dict.fromkeys(doubts))]


def _shorten_scales(doubts: Sequence[str]) -> Iterator[str]:
    """Yield doubts of searches without scales and steps; those of first falls as one range."""
    ends, motions = list[str](), list[str]()
    for doubt in doubts:
        motion = re.match(r"under ('[^']+'): ", doubt)
        found = re.search(r"time steps find the first fall from ([\d.]+) to ([\d.]+) ×", doubt)
        if found is None:
            # at which scales stands with the result
            yield re.sub(r"at [\d.]+ × by [\d.]+ ms(?: \(likewise [^)]*\))?: ", "", doubt, count=1)
            continue
        ends += found.groups()
        motions += [motion[1]] if motion else []
    if ends:
        under = f"under {join_words(motions)} " * bool(motions)
        low, high = min(ends, key=float), max(ends, key=float)
        yield f"{under}it first falls between {low} and {high} × over its time steps"


def list_checks(data: ReportData) -> list[Row]:
    """List the rows of the checks of an assessment; the linear one decides if it is alone."""
    rows = [*data.statements["assessment"].rows] if "assessment" in data.statements else []
    return [row for row in rows if "linear, q" not in row[0]] or rows


def list_decisive_doubts(data: ReportData, doubts: Iterable[tuple[str, str]]) -> list[str]:
    """List the results whose doubts may change the answer.

    A bound from above can not change checks that fail by it.
    """
    outcomes = [outcome for _, _, outcome, _ in list_checks(data)]
    failed = bool(outcomes) and not any("passes" in each for each in outcomes)
    own = RESULTS["assessment"]
    return list(
        dict.fromkeys(
            result
            for result, text in doubts
            if not (failed and result == own and "an upper bound" in text.lower())
        )
    )


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


def weigh(doubt: str) -> int:
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
    notes |= {HISTORIES: missed} if (missed := note_checks(data)) else {}
    peaks = [peak_of_ground(run) for run in data.runs.values()]
    if peaks and "assessment" in data.statements:
        mean, other = np.mean(peaks), peak_of_spectrum(data)
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
    """Return what was not varied, without which "no doubt" says little."""
    study = read_study(data)
    studied = set() if study is None else list_studied(study)
    if not data.runs:
        static = {"limit", "assessment", "pushover"} & data.statements.keys()
        return [each for each in ("lengths", "friction") if static and each not in studied]
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
    return [each for each in single if each not in studied]


def peak_of_ground(run: History) -> float:
    """Return the horizontal peak acceleration of a run [g]."""
    # Files of older versions have the acceleration at their steps alone.
    recorded = np.abs(run.dataset["ground"].values[:, 0]).max()
    return float(run.dataset.attrs.get("pga", recorded)) / STANDARD_GRAVITY


def peak_of_spectrum(data: ReportData) -> float:
    """Return the spectral acceleration of the assessment's demand at period zero [g]."""
    spectrum = data.case.assessment.spectrum or data.case.target
    return float(spectrum.horizontal(0.0)) if spectrum is not None else np.nan


def read_spectrum(data: ReportData) -> Mapping[str, Any]:
    """Return the table of the assessment's spectrum, empty for that of a motion."""
    own = [data.case.settings.get(key) or {} for key in ("assessment", "suite")]
    return own[0].get("spectrum") or own[1].get("target") or {}
