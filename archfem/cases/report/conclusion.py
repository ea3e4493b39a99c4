"""Head and conclusion of a report: who signs what, outcome with margin and range."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from archfem.cases.answers import RESULTS, Ratios, Statement, read_numbers
from archfem.cases.case import REPORT_KEYS
from archfem.cases.defaults import list_default_keys, list_materials_and_contacts
from archfem.cases.push_factors import PushFactors, site_acceleration
from archfem.cases.rating_text import NOT_COMPUTED
from archfem.cases.report import margins, outcomes
from archfem.cases.report.capacities import list_demands, tabulate_capacities, tabulate_demands
from archfem.cases.report.doubts import (
    HISTORIES,
    STUDIES,
    VARIATIONS,
    list_checks,
    list_decisive_doubts,
    list_doubts,
    list_elastic_fill,
    list_notes,
    list_unvaried,
    peak_of_ground,
)
from archfem.cases.report.motion_rules import find_missed, find_rule, is_of_norm, name_norm
from archfem.cases.report.outcomes import sentence
from archfem.cases.report.report_data import SHOWN_RESULTS, ReportData
from archfem.cases.report.scales import find_first_failures, list_scales, say_fragile
from archfem.cases.report.study_findings import MAX_TIE_DIFFERENCE, say_what_changes
from archfem.dynamics.collapse_state import COLLAPSE_STATES, RANGE_REMEDY
from archfem.masonry.out_of_plane import describe_lengths
from archfem.masonry.structure import Structure, join_names, join_words
from archfem.models.model import Doubt
from archfem.units import Ends, format_ratio
from archfem.view.pages.document import Grid, Section, TextBlock

# Doubts of a result that the conclusion states; the others stand in the section of the result
MAX_DOUBTS = 3
SECTIONS = {x: x.capitalize() for key, x in RESULTS.items() if key not in SHOWN_RESULTS}
SECTIONS |= {HISTORIES: "Response", VARIATIONS: "Range over uncertain properties"}
SECTIONS |= {STUDIES: "Study of many cases", RESULTS["rating"]: "Rating for a vehicle"}

# What commands keep of results that they have not finished
_BEGUN = {"risk": "risk_samples.nc"}

# Lines of the head with the answer, in their order
HEAD = ("verdict", "margin", "depends on", "not checked")

# Keys of [report] as the head has them
_SIGNED = {key.replace("_", " ") for key in REPORT_KEYS}

# What runs and pushovers depend on, where the case gives no stiffness of joints
DEFAULT_STIFFNESS = "the stiffness of joints is a default: measured ones differ tenfold"

# Demands of which factors of several cases are multiples, in words
KINDS = "the earthquake", "the site's acceleration by a push", "the vehicle", "the given load"

# Verdicts on cases, the worst first
VERDICTS = (
    "It does not survive",
    "A check or a demand fails",
    "Not decided",
    "It survives with damage",
    "All that was checked is passed",
)

# Place of a case among others: of its verdict, and whether a check passes where another fails
Place = tuple[int, bool]

# Project in the templates of new cases
PLACEHOLDER = "Name of the project"


def list_facts(data: ReportData) -> list[tuple[str, str]]:
    """List who signs what, and the principal results by name, which the report shows first."""
    report = data.case.report
    signed = [
        (key.replace("_", " "), report[key])
        for key in REPORT_KEYS
        if report.get(key) and key != "demand"  # it stands beside the capacities
    ]
    structure = data.case.structure
    joints = len({*structure.face_names})
    extent = f"{joints} joints, {describe_width(structure)}"
    blocks = [("structure", f"{len(structure.free)} blocks, {extent}")]
    blocks += [("joints", structure.assessment)] if structure.assessment else []
    doubtful = list_decisive_doubts(data, list_doubts(data))
    doubts = [("in doubt", ", ".join(doubtful))] if doubtful else []
    said: dict[str, list[str]] = {key: [] for key in HEAD}
    for key, text in _say_plainly(data, doubtful):
        said[key].append(sentence(text))
    head = [(key, " ".join(texts)) for key, texts in said.items() if texts]
    named = [f"{x.partition(',')[0]} of PGA {p:.2g} g" for x, p, _, of in list_demands(data) if of]
    named = [each.replace("push of PGA", "a push of") for each in named]
    question = [("question", f"Does it withstand {join_words(named)}?")] if named else []
    return [*signed, *question, *head, *doubts, *blocks]


def describe_width(structure: Structure) -> str:
    """Say how wide a structure is across its drawing, which is the length of a wall across it."""
    word = "long" if structure.above is not None else "thick" if structure.heads.any() else "wide"
    return f"{structure.width:.4g} m {word}{describe_lengths(structure)}"


def list_joint_facts(parts: Mapping[str, ReportData]) -> list[tuple[str, str]]:
    """List who signs what, the worst verdict, the least margins, and the other verdicts."""
    heads = {name: list_facts(data) for name, data in parts.items()}
    keys = [key for head in heads.values() for key, _ in head if key in _SIGNED]
    signed = [(key, _join_values(heads, key)) for key in dict.fromkeys(keys)]
    answer, margin, _, left = HEAD
    ranks = {name: _rank_verdict(data) for name, data in parts.items()}
    place = min(each for each, *_ in ranks.values())
    worst, listed = dict[str, list[str]](), list[str]()
    for kind in KINDS:  # factors on demands of several kinds have no order
        own = {name: given[kind] for name, (*_, given) in ranks.items() if kind in given}
        order = sorted(own, key=own.__getitem__)
        sizes = {name: _say_factor(parts[name], ranks[name][1][kind], kind) for name in order}
        listed += [f"of {name} {size}" for name, size in sizes.items()]
        first = [name for name in order if ranks[name][0] == place]
        for name in first:
            if own[name] <= own[first[0]] * (1.0 + MAX_TIE_DIFFERENCE):
                worst.setdefault(name, []).append(sizes[name])
    listed += [f"of {name} not known" for name, (_, least, _) in ranks.items() if not least]
    facts = [("cases", "; ".join(data.name for data in parts.values()))]
    in_doubt = {name: dict(head).get("in doubt") for name, head in heads.items()}
    doubts = "; ".join(f"{name}: {results}" for name, results in in_doubt.items() if results)
    said = {name: dict(head).get(answer, "") for name, head in heads.items()}
    if len(worst) > 1:
        named = [f"{name} ({join_words(each)})" for name, each in worst.items()]
        kinds = ", each by its kind of demand," * (len({*map(tuple, worst.values())}) > 1)
        words = f"the worst of {len(parts)} cases{kinds} are {join_words(named)}."
        doubt = ", some of it in doubt" * bool(doubts)
        facts.append((answer, f"{VERDICTS[place[0]]}{doubt}: {words}"))
    else:
        name = next(iter(worst), min(ranks, key=lambda x: ranks[x][0]))
        facts.append((answer, f"The worst of {len(parts)} cases is {name}: {said.pop(name)}"))
    norms = {x.case.report.get("norm", ""): x for x in parts.values() if "rating" in x.statements}
    of = f", ratings by codes that go with {join_words([*filter(None, norms)])}," * any(norms)
    facts.append((margin, f"The least margins{of} are {'; '.join(listed)}."))
    facts += [("in doubt", doubts)] * bool(doubts)
    unchecked = dict[str, list[str]]()
    for name, head in heads.items():
        for text in (text for key, text in head if key == left):
            unchecked.setdefault(text, []).append(name)
    facts += [(left, f"{join_words(names)}: {text}") for text, names in unchecked.items()]
    return [*signed, *facts, *((name, text) for name, text in said.items() if text)]


def _join_values(heads: Mapping[str, list[tuple[str, str]]], key: str) -> str:
    """Return a value of several cases, with the names of its cases where they differ."""
    named = dict[str, list[str]]()
    for name, head in heads.items():
        named.setdefault(dict(head).get(key, ""), []).append(name)
    values = {f"{text} ({join_words(names)})": text for text, names in named.items() if text}
    return "; ".join(values if len(named) > 1 else values.values())


def _say_factor(data: ReportData, factor: float, kind: str) -> str:
    """Say a least factor of a case, with "at most" before an upper bound, and until when it is."""
    pushes = _list_loads(data)
    bounds = [x.least for x in pushes if x.bounded or x.proved is not None]
    checks = read_numbers(Ratios, data.statements.get("assessment"))
    bounds += [check.decisive for check in checks if check.bounded]
    bounds += [least for least, words, _ in margins.say_less(data) if "≤" in words]
    until = ""
    for check in (x for x in checks if factor in (x.decisive, x.moved) and kind == KINDS[0]):
        until = f" by {check.name}"
        if check.displaced is not None and factor == check.decisive:
            by = f"{format_ratio(check.displaced)} by displacements ({check.name})"
            until = f" until it begins to move, {by}"
        elif check.moved == factor:
            at_rest = f"{format_ratio(check.decisive)} until it begins to move"
            until = f" by displacements ({check.name}), if it moved, {at_rest}"
    rated = data.statements["rating"].rows if kind == KINDS[2] else []
    for row in (x for x in rated if x.numbers["least"] == factor):
        bounds += [factor] * (NOT_COMPUTED in row.numbers.get("state", ""))
        named = row.demand.partition(" (")[0], row.numbers.get("state")
        until = "".join(f", {x}" for x in named if x)
    for push in (x for x in pushes if x.site and x.least == factor and kind == KINDS[1]):
        kind = f"{push.site.partition(';')[0]} by a push"
        peak = max(map(peak_of_ground, data.runs.values()), default=0.0)
        of_motions = factor * site_acceleration(data.case) / max(peak, 1e-9)
        if of_motions < factor:
            until = f", {format_ratio(of_motions)} times the {peak:.2g} g of its motions, by which "
            until += "it may move and need not fall"
    scaled = [x for x in list_scales(data) if kind == KINDS[0] and factor in (x.held, x.as_one)]
    if scaled and len(data.pairs) > len(list_scales(data)):
        until = f" by its scale under '{scaled[0].motion}', as not all motions were scaled"
    at_least = any(check.unshown and check.decisive == factor for check in checks)
    bound = "at least " if at_least else "at most " * (factor in bounds)
    return f"{bound}{format_ratio(factor)} times {kind}{until}"


def _list_loads(data: ReportData) -> list[PushFactors]:
    """List the factors on loads and pushes."""
    stated = (data.statements.get(name) for name in ("limit", "pushover"))
    return [load for each in stated for load in read_numbers(PushFactors, each)]


def _rank_verdict(data: ReportData) -> tuple[Place, dict[str, float], dict[str, float]]:
    """Return the place of a case among others, the worst first, and its least factors by kind.

    A place is that of `VERDICTS`, and whether a check of an assessment passes where another fails.
    Factors are those in the plane of the drawing, where all cases have them. Those behind are with
    the properties as given, by which cases are compared, as not all are varied.
    """
    ranked = [*margins.list_margins(data, across=False)]
    outcome = outcomes.find_worst(data)[1] if data.runs else ""
    stated = data.statements.get("rating")
    rows = stated.rows if stated else []
    if data.case.report.get("norm"):  # decides, if it has a rating
        rows = [row for row in rows if is_of_norm(data, row.demand)] or rows
    loads = _list_loads(data)
    factors = [load.least for load in loads if not load.site]
    fails = [x < 1.0 for x, is_ranked, _ in ranked if is_ranked]
    fails += [least < 1.0 for least, *_ in margins.say_less(data)]
    fails_otherwise = [not x.numbers["passes"] or x.numbers["least"] < 1.0 for x in rows]
    fails_otherwise += [x < 1.0 for x in factors] + [_say_unchecked(data)[1]]
    fails_otherwise += [scale < 1.0 for scale, *_ in margins.say_across(data)]
    shaken = [x for x, is_margin, _ in ranked if is_margin]
    pushed = [load.least for load in loads if load.site and not shaken]
    demands = shaken, pushed, [x.numbers["least"] for x in rows], factors
    ratings = [0.0 if row.factor == "-" else float(row.factor) for row in rows]
    undecided = outcome.startswith("may") or (bool(data.runs) and bool(_say_why_undecided(data)))
    failed = any([*fails, *fails_otherwise])
    holds = outcome == "does not survive", failed, undecided, "damage" in outcome, True
    listed = zip(KINDS, demands, strict=True)
    leasts = {kind: min(x) for kind, x in listed if min(x, default=np.inf) < np.inf}
    verdict, passing = holds.index(True), any(x.decisive >= 1.0 for x in list_checks(data))
    place = verdict, verdict == 1 and passing and not any(fails_otherwise)
    return place, leasts, leasts | ({KINDS[2]: min(ratings)} if ratings else {})


def _say_plainly(data: ReportData, doubtful: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the answer for a client, in the lines of the head."""
    checks = list_checks(data)
    failed = [x for x in checks if x.needed or (x.least < 1.0 and not x.unshown)]
    unsure = [x for x in checks if x.unshown or x.by_split or x.bounded]
    judged = failed or unsure or checks
    found = dict.fromkeys(margins.judge_check(data, check)[0] for check in judged)
    # of two senses one may say more than the other
    longest = [x for x in found if sum(y.startswith(x) for y in found) == 1]
    assessed = [f"by the kinematic assessment {words}" for words in longest]
    unchecked, overturns = _say_unchecked(data)
    answer, margin, depends, left = HEAD
    if data.runs:
        failing = [*assessed * bool(failed), *unchecked * overturns]
        yield from ((answer, x) for x in _say_survival(data, doubtful, failing))
        margin_texts = margins.say_least(data), _say_first_failures(data), say_fragile(data)
        yield from ((margin, x) for x in chain(*margin_texts))
        yield from ((depends, x) for x in _say_conditions(data))
    items = list_materials_and_contacts(data.case)
    keys = [key for item in items for key in list_default_keys(data.case, item)]
    if "normal_stiffness" in keys and (data.runs or "pushover" in data.statements):
        yield depends, DEFAULT_STIFFNESS
    yield from [] if data.runs and failed else ((answer, x) for x in assessed)
    for name, stated in data.statements.items():
        pushes = [*_say_pushes(data, name, stated)]
        yield from ((margin if data.runs else answer, x) for x in pushes)
        if name == "rating":
            yield from ((answer, x) for x in _say_ratings(data, stated))
        elif name == "risk" or not (data.runs or pushes or name in ("assessment", "scale")):
            for row in stated.rows[:1]:
                of_load = name in ("limit", "pushover")
                times = f"at {row.factor} times" if of_load else f"factor {row.factor}"
                times = f", {times} {row.demand}" * (row.factor != "-")
                yield answer, f"{row.result}: {row.outcome}{times * (name != 'risk')}"
    less = [words for x, words, _ in margins.say_less(data) if x < 1.0 or not data.runs]
    yield from ((depends, words) for words in less)
    yield from [] if data.runs and overturns else ((left, x) for x in unchecked)
    yield from [(answer, ": ".join(data.other_plane))] if data.other_plane else []


def _say_unchecked(data: ReportData) -> tuple[list[str], bool]:
    """Say that nothing was checked across the plane, and whether the demand may overturn it."""
    if (found := margins.find_unchecked_push(data)) is None:
        return [], False
    push, demand = found
    ways = list[str]()
    for size, verb in sorted([(push, "overturn"), (data.transverse_slide, "slide")]):
        of = (
            f" ({format_ratio(size / demand)} × the demand, {demand:.3g} g)" if demand > 0.0 else ""
        )
        ways += [f"{verb} from {size:.3g} g on{of}"] * bool(size < np.inf)
    falls = f", where it may {', and '.join(ways)}" * bool(push > 0.0)
    way = "across the plane of the drawing"
    if np.isnan(push):
        way = "perpendicular to this section, as along a wall,"
    return [f"{way} it was not checked{falls}"], min(push, data.transverse_slide) < demand


def _say_first_failures(data: ReportData) -> Iterator[str]:
    """Yield where it first fails: across its plane as one rigid body, and in its plane."""
    across = sorted(margins.say_across(data))[:1]
    plane = "in its plane " * bool(across)
    for _, _, falls, body in across:
        yield f"across its plane, held by nothing else, it {falls}: {body} as one rigid body"
    if failures := [*find_first_failures(data)]:
        yield from (f"{plane}it {words}" for words in failures[::-1])  # the least first
    elif "scale" not in data.statements and all(scale > 1.0 for scale, *_ in across):
        yield f"from which acceleration on it falls {plane}was not computed"


def _say_pushes(data: ReportData, name: str, stated: Statement) -> Iterator[str]:
    """Yield where a push begins to move it: beside runs only at less than the site's."""
    for push in read_numbers(PushFactors, stated):
        if push.site and (not data.runs or push.least < 1.0):
            yield next(margins.describe_push(data, name, push))


def _say_ratings(data: ReportData, stated: Statement) -> Iterator[str]:
    """Yield the least rating by the norm of the report, that without a code, and unlike ones.

    Each is as given and with less of what is assumed. Without a norm that without a code is first.
    """
    own = [row for row in stated.rows if is_of_norm(data, row.demand)]
    shown = [*(own or stated.rows)[:1]]
    of = [re.split(" by | with ", row.demand)[0] for row in shown]
    # the vehicle itself, whose place is known
    shown += [row for row in stated.rows if row.demand in of and row not in shown]
    for row in shown:
        needed = ", 1 is required" * (bool(data.case.report.get("norm")) and row in own)
        outcome, semicolon, over = row.outcome.partition("; ")
        outcome, _, place = outcome.partition(", with ")
        words = f"{row.factor}{' as given' * bool(over)}{needed}, {outcome}{semicolon}{over}"
        yield f"rating for {row.demand}: factor {words}"
        # of its places the result has those from springings, and of other axles
        yield from [f"worst with {re.split('(?<= m), ', place)[0]}"] * bool(place)
    left = [row for row in stated.rows if row not in shown]
    passes, fails = ([x for x in left if x.numbers["passes"] is state] for state in (True, False))
    unsure = [x for x in passes if x.outcome.startswith("passes only")]
    passes = [x for x in passes if x not in unsure]
    if any(x.numbers["passes"] for x in shown):
        passes = []  # one is enough
    elif not passes:
        fails = []  # as all do
    too = " too" * any(not x.numbers["passes"] for x in shown)
    for words, rows in (f"fails{too}", fails), ("passes", passes):
        if rows:
            yield f"it {words} for {join_words([f'{x.demand} ({x.factor})' for x in rows])}"
    only = dict[str, list[str]]()
    for row in unsure:
        outcome, _, losses = row.outcome.partition("; ")
        # places are among the capacities
        of = [row.factor, *[re.sub(r" \(axles? at [^)]*\)", "", losses)] * bool(losses)]
        least, state = row.numbers["least"], row.numbers.get("state", "")
        of += [f"{format_ratio(least, 4)} {state}"] * (state not in losses)
        named = f"{row.demand} ({', '.join(of).replace('; ', ', ')})"
        only.setdefault(outcome.partition(", with ")[0], []).append(named)
    for words, each in only.items():
        yield f"it {words} for {join_words(each)}"


def _say_survival(
    data: ReportData, doubtful: Sequence[str], failed: Sequence[str]
) -> Iterator[str]:
    """Yield whether it survives the motions, and how often with other properties.

    Too few motions decide none, nor do runs without joints. What fails otherwise comes before a
    survival, and behind a fall.
    """
    verdicts, (_, answer) = [run.verdict for run in data.runs.values()], outcomes.find_worst(data)
    in_doubt = " (in doubt, as below)" * (HISTORIES in doubtful)
    survives, reason = answer.startswith("survives"), _say_why_undecided(data)
    answer = f"{'under its motions ' * bool(survives and failed)}it {answer}{in_doubt}"
    yield from failed if survives else ()
    given, provisos = outcomes.say_provisos(data) if survives else ("", [])
    if survives and reason:
        yield f"not decided{in_doubt}, as {reason}"
    sizes = [x.displacement for x in verdicts if x.outcome in COLLAPSE_STATES[:2]]
    known = bool(sizes) and np.isfinite(sizes).all()
    moved = f", and moves by {Ends.of(sizes):mm}" if known else ""
    beside = any(scale <= 1.0 for scale, *_ in margins.say_across(data))
    lead = f"in its plane{in_doubt} it" if beside else f"{answer}{given}: it"
    if survives and (reason or find_missed(data)):
        lead = f"it{in_doubt * (not reason)}"
    first, *others = outcomes.describe_outcomes(data)
    said = [f"{lead} {first}", *(f"it {each}" for each in others)]
    yield from [*said[:-1], f"{said[-1]}{moved}", *provisos]
    yield from () if survives else failed


def _say_conditions(data: ReportData) -> Iterator[str]:
    """Yield rules that the motions miss, how often it falls otherwise, and what decides."""
    missed = [(x.rule.partition(",")[0], x.found.partition("; ")[2]) for x in find_missed(data)]
    if rules := [f"{rule} ({without})" if without else rule for rule, without in missed]:
        yield f"the motions do not meet {name_norm(find_rule(data))} by their {join_words(rules)}"
    if len(data.runs) + len(data.missing) == 1 and outcomes.find_worst(data)[1] == "survives":
        yield "one motion was run, and others of its size may do otherwise"
    ranges = sorted(data.verdict_ranges, key=lambda x: (x.falls.sum(), x.dislocated.sum()))
    for found in ranges[-1:]:
        motion = found.dataset.attrs.get("motion")
        under = f", under '{motion}'" * (len(data.runs) > 1 and bool(motion))
        yield f"with other plausible properties it {found.count}{under}"
    every = [(each.name, text) for each in data.own_studies for text in say_what_changes(each)]
    if ranges or not every:
        yield from outcomes.say_what_decides(ranges[::-1])
        yield from outcomes.say_friction_range(data)
    # the verdict has these
    below = {study for least, _, study in margins.say_less(data) if least < 1.0}
    # the section of a study names its cases
    yield from (
        text.partition("; of the others ")[0] for study, text in every if study not in below
    )


def _say_why_undecided(data: ReportData) -> str:
    """Say how the runs are too few, or lack joints, to decide a survival; "" if they do not."""
    count, rule = len(data.runs), find_rule(data)
    total = count + len(data.missing)
    words = [f"{count} of {total} motions {'were' if count > 1 else 'was'} run"] * (count < total)
    if rule and count < rule.fewest:
        words.append(f"{name_norm(rule)} (from memory) requires {rule.fewest} motions at least")
    falls = [run.verdict.fall for run in data.runs.values()]
    if loose := sum(fall is not None and fall.lacks_joints for fall in falls):
        words.append(f"in {loose} of {count} runs joints were not followed through strong motion")
    return join_words(words)


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
    blocks: list[Any] = tabulate_demands(data)
    # of several cases one table has all capacities
    blocks += [] if data.label else tabulate_capacities({"": data})
    for lead, texts in _build_paragraphs(data, decisive).items():
        sentences = [*map(sentence, texts)]
        if data.statements.keys() != {"rating"}:  # of a result that stands alone each is one
            sentences = [" ".join(sentences)] if sentences else []
        blocks += [TextBlock(each, lead=lead * (k == 0)) for k, each in enumerate(sentences)]
    blocks += margins.build_transverse(data)
    for result in filter(doubts.get, doubtful):
        # those that a range answers are of the outcome
        ordered = sorted(doubts[result], key=lambda x: not x.remedy.startswith(RANGE_REMEDY))
        shown = [sentence(str(replace(x, remedy=""))) for x in ordered[:MAX_DOUBTS]]
        if more := len(doubts[result]) - len(shown):
            shown.append(f"{more} more: see section '{SECTIONS[result]}'.")
        # what cannot change the answer is none of the doubts of the head
        lead, manner = ("In doubt", "doubt") if result in decisive else ("Note", "missing")
        blocks.append(TextBlock(f"{lead}, {result}: {' '.join(shown)}", manner))
    for result, notes in list_notes(data).items():
        blocks.append(TextBlock(f"Note, {result}: {' '.join(map(sentence, notes))}", "missing"))
    blocks += map(TextBlock, _list_unfinished(data))
    blocks += [] if data.label else [build_signatures(data.case.report)]
    return Section("Conclusion", blocks)


def _list_unfinished(data: ReportData) -> Iterator[str]:
    """Yield sentences on what is left to compute, or to fill in."""
    for name, file in _BEGUN.items():
        if name not in data.statements and data.folder and (data.folder / file).exists():
            yield f"The {RESULTS[name]} was begun and has no answer: runs are left to compute."
    if data.case.report.get("project") == PLACEHOLDER:
        yield "The name of the project is that of the template: fill in [report] of the case."


def _build_paragraphs(data: ReportData, doubtful: Sequence[str]) -> dict[str, list[str]]:
    """Return the sentences of the answer by their leads: outcomes, margin, what may change it."""
    answer = list[str]()
    if not data.runs:  # of several results the table has the outcomes, and of an assessment
        stated = [each for name, each in data.statements.items() if name != "assessment"]
        told = [each for each in stated if len(data.statements) == 1 or not each.rows]
        ordered = (sorted(x.sentences, key=lambda y: not is_of_norm(data, y)) for x in told)
        answer += chain.from_iterable(ordered)
    answer += outcomes.describe_ends(data)
    said = {*margins.say_least(data)} if data.runs else set[str]()  # in the head
    changes = list[str]()
    if not data.runs:  # the head has them beside runs
        changes += [text for study in data.own_studies for text in say_what_changes(study)]
    if fill := join_names(list_elastic_fill(data)):
        changes.append(f"{fill} is elastic in the runs and carries tension, which soil does not")
    changes += ["the checks of the numbers raise no doubt"] * (bool(data.runs) and not doubtful)
    if doubtful:
        changes.append(f"the doubts below, on {join_names(doubtful)}, may change this")
    if single := list_unvaried(data):
        none = "; displacements have no range" * (bool(data.runs) and not data.verdict_ranges)
        verb = "were" if len(single) > 1 or single[0].partition(" (")[0].endswith("s") else "was"
        changes.append(f"{join_words(single)} {verb} not varied{none}")
    given = [key for key in ("suite", "motion") if data.case.settings.get(key)]
    if given and not data.runs and not {"scale", "risk"} & data.statements.keys():
        changes.append(f"no motion was run, though [{given[0]}] is in the case")
    return {
        "What else was found?" if data.runs else "Result:": answer,
        "By which margin?": [
            x for x in dict.fromkeys(margins.describe_margin(data)) if x not in said
        ],
        "What would change the answer?": changes,
    }


def build_signatures(report: Mapping[str, str]) -> Grid:
    """Build the lines to be signed, with the names and the date that are given."""
    rows = [
        (who.replace("_", " "), report.get(who, ""), report.get("date", "") * (who == "author"), "")
        for who in ("author", "checked_by")
    ]
    return Grid(("", "name", "place, date", "signature"), rows, "", "form")
