"""Scaled motions in a report: at which scale, and at which peak, a structure first fails."""

from collections.abc import Iterator

import numpy as np

from archfem.cases.answers import Scales, read_numbers
from archfem.cases.report.doubts import peak_of_ground
from archfem.cases.report.report_data import ReportData
from archfem.dynamics.collapse_state import COLLAPSE_STATES, FALLEN_STATES
from archfem.dynamics.monitor import PULLED
from archfem.dynamics.scale_search import UNFINISHED
from archfem.masonry.structure import join_words
from archfem.units import Ends

# States that a search of scales finds, in the words of margin and answer
_STATES = {
    "tension": (f"is {PULLED},", ""),
    "moves": ("moves as a verified mechanism", ""),
    "dislocated": ("is dislocated", "is first dislocated"),
    "falls": ("falls", "first falls"),
    "mechanism": ("forms a mechanism", "first forms a mechanism"),
}

# The same of runs that are not scaled, by their outcomes
_FAILURES = dict.fromkeys(FALLEN_STATES, "falls") | {x: x for x in ("dislocated", "mechanism")}


def list_scales(data: ReportData) -> list[Scales]:
    """List what searches of scales have found, by motion; one without an answer has not run."""
    searches = read_numbers(Scales, data.statements.get("scale"))
    return [x for x in searches if x.held or x.states or not x.unfinished]


def _list_unscaled(data: ReportData) -> dict[str, tuple[str, float]]:
    """Return state and peak [g] of failures under motions that are not scaled as others are."""
    scaled = {each.motion for each in list_scales(data)}
    runs = {name: run for name, run in data.runs.items() if scaled and name not in scaled}
    failed = {name: run for name, run in runs.items() if run.verdict.outcome in _FAILURES}
    return {name: (_FAILURES[x.verdict.outcome], peak_of_ground(x)) for name, x in failed.items()}


def find_first_failures(data: ReportData) -> Iterator[str]:
    """Yield each first failure over all motions: at the least peak, and at the least scale."""
    # without a scale that holds, a fill bears tension at all of them
    searches = [x for x in list_scales(data) if x.held or "tension" not in x.states]
    unscaled, least = _list_unscaled(data), np.inf
    several, count = len(searches) + len(unscaled) > 1, len(data.runs)
    beyond = f"{_was(len(searches))} scaled: under others it may fail at less"
    some = f"; {len(searches)} of {count} motions {beyond}" * (len(searches) < count)
    unfinished = any(x.unfinished for x in searches)
    some += "; the search is unfinished: at less it may, too" * unfinished
    for state in ("falls", "dislocated", "mechanism"):
        made = [(x.states[state], x.pga, x.motion) for x in searches if state in x.states]
        whole = [(1.0, peak, name) for name, (x, peak) in unscaled.items() if x == state]
        first = [(scale * pga, scale, motion) for scale, pga, motion in [*made, *whole]]
        # a dislocation beyond a fall says nothing
        if not first or min(first)[0] >= least:
            continue
        least, at, name = min(first)
        ends = [(scale * pga, scale, of) for scale, pga, of in made]
        steps = (x for x in searches if state == "falls" and x.all_steps)
        ends += [((x.all_steps or 0.0) * x.pga, x.all_steps or 0.0, x.motion) for x in steps]
        over = ["motions"] * (len(searches) > 1) + ["time steps"] * (state == "falls")
        # the least is of those that were searched, or has no range; scale and peak are of one run
        peak, scale, other = max(ends) if name not in unscaled else min(first)
        wide = f"{peak:.3g} g, {scale:#.3g} × " + (f"'{other}'" if several else "the motion")
        wide *= f"{peak:.3g}" != f"{least:.3g}"
        motion = f"'{name}'" if several or count > 1 else "the motion"
        beside = f" (by other {' or '.join(over)} up to {wide})" * bool(wide)
        does = _STATES[state][1].replace("first ", "" if unfinished else "first ")
        # of unlike peaks another motion may have a smaller scale
        peak, scale, other = min(first, key=lambda x: x[1])
        beside += f"; the least scale is {scale:#.3g} × '{other}', of {peak:.3g} g" * (scale < at)
        yield f"{does} at {least:.3g} g, {at:#.3g} × {motion}{beside}{some}"
        some = ""  # once


def say_fragile(data: ReportData) -> Iterator[str]:
    """Yield a sentence on each motion that it withstands, and at a smaller scale does not."""
    for search in list_scales(data):
        run = data.runs.get(search.motion)
        outcome = run.verdict.outcome if run else ""
        weaker = [
            (search.states[state], _STATES[state][0])
            for state in ("falls", "dislocated")
            if search.states.get(state, 1.0) < 1.0 and _FAILURES.get(outcome) != state
        ]
        if weaker and outcome in COLLAPSE_STATES[:2]:
            does = "stands" if outcome == COLLAPSE_STATES[0] else _STATES["dislocated"][0]
            listed = join_words([f"{words} at {scale:#.3g} ×" for scale, words in weaker])
            yield f"under '{search.motion}' it {does} at 1.00 ×, but {listed}: not robust"


def describe_scales(data: ReportData) -> Iterator[tuple[float, list[str]]]:
    """Yield the least scale up to which it stands, what comes beyond, and motions without any.

    It is no margin, and infinite, where an unfinished search has found no failure at 1 and less.
    """
    searches, unscaled = list_scales(data), _list_unscaled(data)
    for state in dict.fromkeys(state for state, _ in unscaled.values()):
        own = {f"'{name}'": peak for name, (of, peak) in unscaled.items() if of == state}
        of = f"{join_words([*own])}, PGA {Ends.of(own.values()):.2f} g"
        fails = f"under which it {_STATES[state][0]}, and which {_was(len(own))} not scaled"
        yield np.nextafter(1.0, 0.0), [f"below 1 on {of}, {fails}"]
    made = [each for each in searches if each.held]
    if not made:
        return
    # what fails at 1 decides, whatever is left to run
    first = min(made, key=lambda x: (_met(x) > 1.0, _bound(x), x.pga))
    is_failed = _met(first) <= 1.0
    is_open = not is_failed and any(each.unfinished for each in searches)
    # smaller scales may fail that were not run
    words = f"{first.held:#.3g}" + f" so far ({UNFINISHED})" * first.unfinished
    if _bound(first) < first.held:
        words = f"below {_bound(first):#.3g} as one rigid body ({words} in courses)"
    words += f" on '{first.motion}', at a PGA of {_bound(first) * first.pga:.3g} g"
    words += ", beyond which it fails" * is_failed
    words += f", of {len(made)} motions" if made[1:] else ", under one motion"
    texts = [words, *_say_as_one(searches)]
    # a search without a scale that holds may have the least of all
    if none := [f"'{each.motion}'" for each in searches if not each.held]:
        texts.append(f"no scale is known up to which it stands under {join_words(none)}")
    known = {each.motion for each in searches} | unscaled.keys()
    if left := [f"'{pair}'" for pair in data.pairs if pair not in known]:
        texts.append(f"{join_words(left)} {_was(len(left))} not scaled")
    if is_open:
        texts[0] = f"it stands at a scale of {words}: no margin, as a search is unfinished"
    yield (np.inf if is_open else _bound(first)), texts


def _met(search: Scales) -> float:
    """Return the least scale that was run at which it fails; between these nothing is known."""
    met = [search.states.get(state, np.inf) for state in ("dislocated", "falls", "mechanism")]
    return min(*met, search.as_one or np.inf)


def _was(count: int) -> str:
    """Return the verb of some motions."""
    return "were" if count > 1 else "was"


def _bound(search: Scales) -> float:
    """Return the largest scale up to which it stands, in courses and as one rigid body."""
    return min(search.held, search.as_one or np.inf)


def _say_as_one(searches: list[Scales]) -> Iterator[str]:
    """Yield the first fall as one rigid body."""
    as_one = {x.motion: x.as_one for x in searches if x.as_one}
    # a smaller one is the margin
    if as_one and min(as_one.values()) > min(map(_bound, searches)):
        motion = min(as_one, key=as_one.__getitem__)
        yield f"as one rigid body it first falls at {as_one[motion]:#.3g} × '{motion}'"
