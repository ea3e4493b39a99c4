"""Outcomes of the runs of a report in words: the worst one, falls, lost blocks, displacements."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from archfem.cases.report.doubts import list_varied, peak_of_ground
from archfem.cases.report.inputs import tabulate_inputs
from archfem.cases.report.report_data import ReportData
from archfem.cases.report.study_findings import list_studied, say_failures
from archfem.dynamics.collapse_state import COLLAPSE_STATES, CollapseState
from archfem.dynamics.history import History
from archfem.dynamics.verdict import Verdict
from archfem.dynamics.verdict_range import HALF_STEP, UNVARIED, VerdictRange
from archfem.masonry.structure import Structure, join_words
from archfem.units import Ends, format_mm

# Names of varied properties by the words of their single changes, where they differ
_SYMBOLS = {"shear stiffness": "k_s", "normal stiffness": "k_n", "damping": "damping ratio"}
_SYMBOLS |= {HALF_STEP: "dt", "motion reversed": "sign"}

# Words of a sentence
MAX_WORDS = 25

# Outcomes of runs as verbs and in plain words, the worst first; small displacements end where
# blocks begin to move
_VERBS = {
    "fallen": ("falls", "does not survive"),
    "partly fallen": ("falls in part", "does not survive"),
    "unknown": ("has no known outcome", "may or may not survive"),
    "mechanism": ("becomes a mechanism", "may or may not survive"),
    "dislocated": ("is dislocated but stands", "survives with damage"),
    "stands": ("stands", "survives"),
    "no mechanism": ("forms no mechanism", "survives"),
}


def find_worst(data: ReportData) -> tuple[str, str]:
    """Return the worst outcome of the runs as a verb and in plain words."""
    outcomes = {_name(run.verdict) for run in data.runs.values()}
    return next(words for outcome, words in _VERBS.items() if outcome in outcomes)


def find_worst_run(data: ReportData) -> str:
    """Return the motion of the worst outcome, and of the largest displacement among these."""
    order, found = [*_VERBS], {name: run.verdict for name, run in data.runs.items()}
    return min(found, key=lambda x: (order.index(_name(found[x])), -found[x].displacement))


def _name(verdict: Verdict) -> str:
    """Return the outcome of a run, which is unknown where it was broken off."""
    return "unknown" if verdict.incomplete else verdict.outcome


def describe_outcomes(data: ReportData) -> Iterator[str]:
    """Yield each outcome with the motions that lead to it, and the largest displacement."""
    total = len(data.runs) + len(data.missing)
    for outcome, (verb, _) in _VERBS.items():
        own = {k: run.verdict for k, run in data.runs.items() if run.verdict.outcome == outcome}
        if not own:
            continue
        names = [*own]
        peaks = describe_peaks(data.runs[name] for name in names)
        under = f"{len(names)} of {total} motions: {', '.join(names)} ({peaks})"
        if len(names) == total:
            under = f"all {len(names)} motions of {peaks}"
            under = under if len(names) > 1 else f"the motion '{names[0]}' of {peaks}"
        fall = "; whether it falls was not computed" if outcome == "mechanism" else ""
        yield f"{verb} under {under}{fall}"


def describe_peaks(runs: Iterable[History]) -> str:
    """Return the least and the largest peak acceleration of some runs."""
    return f"PGA {Ends.of(map(peak_of_ground, runs)):.2f} g"


def list_ranges_of_steps(data: ReportData) -> Iterator[str]:
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


def describe_ends(data: ReportData) -> Iterator[str]:
    """Yield sentences on runs that were broken off, lost blocks, and those that still move."""
    falls = {name: run.verdict.fall for name, run in data.runs.items()}
    for name, run in data.runs.items():
        if run.verdict.incomplete:
            yield f"the run under '{name}' {run.verdict.incomplete}"
    if lost := {f"'{k}'": fall for k, fall in falls.items() if fall and fall.time is not None}:
        which = describe_lost(data.case.structure, [*lost.values()])
        if len(lost) == 1 and (by := next(iter(lost.values())).mechanism):
            which += f"; it falls {by}"
        yield f"under {join_words([*lost])} it loses {which}"
    if moving := [f"'{name}'" for name, fall in falls.items() if fall and not fall.resting]:
        yield f"blocks still move at the end of {join_words(moving)}"


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
    """Return a text with a capital and a full stop; clauses of a long one are sentences."""
    text, clause = text.strip(), text.partition("; ")[0]
    if len(text.split()) > MAX_WORDS and clause != text and ": " not in clause:  # no list
        return " ".join(map(sentence, text.split("; ")))
    first = 0 if re.match(r"\w[*_]", text) else 1  # a symbol remains what it is
    return text[:first].upper() + text[first:] + ("" if text.endswith((".", "?")) else ".")


def _list_changes(found: VerdictRange, *, worse: bool = True) -> dict[str, int]:
    """Return the rank of each single change with a worse outcome than the unvaried, or another."""
    ranks = {each.name: min(each.rank, 2) for each in found.single_changes if each.rank >= 0}
    given = ranks.get(UNVARIED, 3)
    return {k: x for k, x in ranks.items() if x > given or (x < given < 3 and not worse)}


def _name_property(change: str) -> str:
    """Return the property of a single change, in words."""
    return re.split(r" (?=[-+/×'(])", change)[0]


def list_changing(found: VerdictRange) -> dict[str, str]:
    """Return the properties, by their names, whose single changes have another outcome."""
    words = dict.fromkeys(map(_name_property, _list_changes(found, worse=False)))
    return {_SYMBOLS.get(each, each): each for each in words}


def say_friction_range(data: ReportData) -> Iterator[str]:
    """Yield between which coefficients of friction the samples lie, if friction is varied."""
    for found in data.verdict_ranges[:1] if "friction" in list_varied(data) else ():
        ends = Ends.of(found.dataset["friction"].values)
        own, *others = {joint.contact.friction for joint in data.case.structure.joints}
        if own is not None and not others:
            low, high = (max(0.0, own + end) for end in ends)
            yield f"friction was varied from {low:.2g} to {high:.2g} only"
        else:
            yield f"friction was varied by {ends:.2g} only"


def say_provisos(data: ReportData) -> tuple[str, list[str]]:
    """Say with which inputs a survival holds, and with which others it falls or is dislocated.

    They are of single changes and of cases of studies that do worse than the runs.
    """
    damaged, verbs = "damage" in find_worst(data)[1], ("is dislocated", "falls")
    changes = dict[str, int]()  # the worst under any motion
    for name, rank in (x for each in data.verdict_ranges for x in _list_changes(each).items()):
        changes |= {name: max(rank, changes.get(name, 0))} if rank > damaged else {}
    properties, told = dict.fromkeys(map(_name_property, changes)), list[str]()
    if changes:
        does = " or ".join(verbs[rank - 1] for rank in sorted({*changes.values()})[::-1])
        told.append(f"in single changes it {does} {join_words([f'with {x}' for x in changes])}")
    for study in data.own_studies:
        if failing := say_failures(study, damaged=damaged):
            told.append(f"in {study.name} it {failing}")
            properties |= dict.fromkeys(list_studied(study) & {"friction"})
    return _say_inputs(data, properties), told


def _say_inputs(data: ReportData, properties: Iterable[str]) -> str:
    """Say the values of some properties of joints with their marks or sources; "" without any."""
    said, rows = list[str](), tabulate_inputs(data).rows if properties else ()
    for words in properties:
        symbol = {"friction": "μ"}.get(words, _SYMBOLS.get(words, words))
        for name, value, mark in rows:
            if name.endswith(f": {symbol}"):
                source = mark.removesuffix(")").removeprefix("given (")
                size = re.split(r" at | \((?=[a-z])", value)[0]
                said.append(f"{words} {size} ({source.partition(' (')[0]})")
    return f" with {join_words([*dict.fromkeys(said)])}" * bool(said)


def say_by_motion(ranges: Sequence[VerdictRange], said: Iterable[Sequence[str]]) -> Iterator[str]:
    """Yield what is said of each of some variations with their motions, equal texts once."""
    motions: dict[str, list[str]] = {}
    for each, texts in zip(ranges, said, strict=True):
        for text in texts:
            motions.setdefault(text, []).append(f"'{each.dataset.attrs.get('motion')}'")
    for text, names in motions.items():
        yield f"under {join_words(names)}: {text}" if len(ranges) > 1 else text


def say_what_decides(ranges: Sequence[VerdictRange]) -> list[str]:
    """Say which of the properties that were varied decides, also alone, or displaces it most."""
    names = dict.fromkeys(name for each in ranges if each.is_mixed for name in each.deciding)
    for each in ranges if names else ():  # what changes an outcome alone decides, too
        names |= dict.fromkeys(list_changing(each).values())
    said = [f"of what was varied, {join_words([*names])} decide{'s' * (len(names) == 1)}"]
    said *= bool(names)
    said += say_by_motion(ranges, map(_say_changed, ranges))
    for found in () if said else ranges:  # single changes have the outcome of the unvaried
        changes = found.single_changes
        given = next((x for x in changes if x.name == UNVARIED and x.rank in (0, 1)), None)
        if given and found.is_beyond_steps(changes[0], given):
            most, own = (format_mm(found.measure(each)) for each in (changes[0], given))
            ends = f"{most} in place of {own}" + " at the end" * found.is_dislocation_worst
            return [f"of what was varied, {changes[0].name} displaces it most: {ends}"]
    none = "no property that was varied decides" if ranges else "no property was varied"
    unanswered = any(x.name == UNVARIED and x.rank < 0 for y in ranges for x in y.single_changes)
    none = (
        "which property decides is unknown, for the unvaried run has no answer" * unanswered or none
    )
    return said or [none]


def _say_changed(found: VerdictRange) -> list[str]:
    """Say with which single changes it falls, or does not, or else is dislocated, or is not."""
    ranks = {each.name: min(each.rank, 2) for each in found.single_changes if each.rank >= 0}
    given = ranks.get(UNVARIED, 3)
    verbs = {2: ("does not fall", "falls"), 1: ("is not dislocated", "is dislocated")}
    for rank, words in verbs.items():
        if names := [name for name, x in ranks.items() if x != given and max(x, given) == rank]:
            return [f"it {words[given < rank]} {join_words([f'with {x}' for x in names])}"]
    return []
