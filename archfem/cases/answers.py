"""What a result answers to the report: sentences, rows among the capacities, doubts and notes."""

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.optimize import brentq

from archfem._display import NOTE_MARK, ProgressReport
from archfem.cases.case import Case
from archfem.cases.motion_keys import find_matched_band
from archfem.cases.push_factors import PushFactors
from archfem.cases.result_text import Remark, ResultTable
from archfem.dynamics.motion_scaling import CollapseScale
from archfem.dynamics.scale_search import MechanismScales
from archfem.errors import DidNotConverge, InvalidInput
from archfem.limit.collapse import Collapse
from archfem.limit.fill_range import FillRange
from archfem.limit.finite_mechanism import PathEnd
from archfem.masonry.loads import AttachedLoad, name_side
from archfem.masonry.materials import COURSE_LENGTH
from archfem.masonry.out_of_plane import describe_transverse_push, find_transverse_push
from archfem.masonry.structure import Structure
from archfem.models.model import Doubt, read_doubts, write_doubts
from archfem.motion.hazard import DESIGN_PERIOD, MEASURES
from archfem.motion.motion import Motion
from archfem.statics.assessed_mechanism import KinematicAssessment
from archfem.statics.assessment_checks import (
    NOT_SHOWN,
    UPPER_BOUND,
    AssessmentCheck,
    describe_difference,
    doubt_assumed,
)
from archfem.statics.first_mechanism import describe_tied_length
from archfem.units import STANDARD_GRAVITY, Ends, format_ratio, kN

# Results by the names of their files
RESULTS = {
    "limit": "limit analysis",
    "pushover": "pushover",
    "rating": "rating",
    "assessment": "kinematic assessment",
    "thickness": "least thickness",
    "scale": "scale of the motion",
    "risk": "annual rate of collapse",
    "modes": "modes",
    "accuracy": "comparison of models and time steps",
    "verdict_range": "range of the verdict over uncertain properties",
}


# Split of weights of a ratio that is less than with the weights apart
_OF_BODIES = "with one weight a body"

# Demand of a push that is compared with none
NO_DEMAND = "compared with no demand in numbers"


class Row(NamedTuple):
    """One result among the capacities, in words, with the numbers that sentences are made of."""

    result: str
    demand: str  # "-" where there is none
    outcome: str  # or capacity
    factor: str  # "-" where there is none
    numbers: Mapping[str, Any]  # such as the fields of `Ratios`; none without an answer


# Largest multiple of the forces of ties that is tried, and largest ratio of interest [-]
MOST_TIED = 4.0

# Begin of a note on motions that are matched up to a shorter period than that of a check
MATCHED = "the motions of the suite are matched from"


class Ratios(NamedTuple):
    """Ratios of a check of an assessment, factors on the spectrum [-]."""

    check: str
    directions: Sequence[str]
    least: float  # with the weights of blocks apart, where it is not the decisive one
    most: float  # largest of the decisive ones over a fill, or `least`; infinite of a lower bound
    needed: str = ""  # assumptions on the fill under which alone it passes
    linear: bool = False  # whether accelerations are checked, rather than displacements
    moved: float | None = None  # by displacements, of what passes at rest
    bodies: float | None = None  # with one weight a body, where it is less
    bounded: bool = False  # whether they are upper bounds, by which it fails and does not pass
    floor: float | None = None  # with e* = 1, whatever moves at the same push
    displaced: float | None = None  # of the values that are shown, of what passes at rest
    untied: float | None = None  # without ties, where by it alone it is shown to pass

    @property
    def name(self) -> str:
        """Name of the check, with the direction of one that holds in one alone, or its strip."""
        strips = {way.partition(", ")[2] for way in self.directions} - {""}
        alone = self.directions if len(self.directions) == 1 else strips
        return ", ".join([self.check, *alone])

    @property
    def decisive(self) -> float:
        """The least ratio: with e* = 1, or by either split of weights [-]."""
        return min(x for x in (self.least, self.bodies, self.floor) if x is not None)

    @property
    def unshown(self) -> bool:
        """Whether it neither passes nor fails, as the ratio is a lower bound and less than 1."""
        return self.most == np.inf and self.decisive < 1.0

    @property
    def fails(self) -> bool:
        """Whether it fails by the least ratio."""
        return self.decisive < 1.0 and not self.unshown

    @property
    def range(self) -> str:
        """The least ratio, and the largest over what is assumed of a fill, as text."""
        if self.unshown:
            return f"at least {format_ratio(self.decisive)}"
        ends = self.decisive, self.decisive if self.most == self.least else self.most
        return f"{Ends(ends):ratio}"

    @property
    def by_split(self) -> bool:
        """Whether it passes, and fails with one weight a body."""
        return self.least >= 1.0 > (self.bodies or 1.0)

    @property
    def beside(self) -> str:
        """What the least ratio is of, and the other ratios, in brackets."""
        apart = None if self.bodies is None else self.least
        found = None if self.floor is None else self.bodies or self.least
        texts = {"by displacements": self.moved, "of the mechanism found": found}
        texts |= {"with the weights apart": apart}
        each = [f"{format_ratio(x)} {words}" for words, x in texts.items() if x is not None]
        rest = " until it moves" * (self.moved is not None)
        return " with e* = 1" * bool(found) + rest + f" ({', '.join(each)})" * bool(each)

    def __str__(self) -> str:
        """Return all ratios in words."""
        return f"{self.range}{self.beside}"


class Scales(NamedTuple):
    """Scales of a motion at which a search has found states of a structure [-]."""

    motion: str
    pga: float  # of the motion [g]
    held: float  # largest below any at which it does not stand; 0 for none
    states: Mapping[str, float]  # smallest that was run at which it is in a state
    unfinished: bool  # whether Ctrl-C has ended the search
    all_steps: float | None = None  # largest first fall by a time step
    as_one: float | None = None  # at which a stack falls as one rigid body
    moves_in_all: bool = False  # whether it moves as a mechanism at all that were run
    again: Sequence[float] = ()  # beyond a fall, at which it stands
    dislocated_stones: str = ""  # names of the first, in brackets


Numbers = TypeVar("Numbers")


class Statement(NamedTuple):
    """Decisive sentences of a result, its rows among the capacities, its doubts and notes."""

    sentences: Sequence[str]
    rows: Sequence[Row]
    doubts: Sequence[Doubt] = ()
    notes: Sequence[str] = ()

    def as_file(self, name: str) -> dict[str, str]:
        """Return name and content of the file beside the text of a result."""
        doubts = json.loads(write_doubts(self.doubts))
        plain = self._replace(doubts=doubts, notes=list(dict.fromkeys(self.notes)))
        return {f"{name}.json": json.dumps(plain._asdict(), indent=1)}

    def with_remarks(self, remarks: Sequence[Remark]) -> "Statement":
        """Return this with the causes of some doubts, and with notes."""
        doubts = [Doubt(x.cause) for x in remarks if isinstance(x, Doubt)]
        notes = [x.removeprefix(NOTE_MARK) for x in remarks if isinstance(x, str)]
        return self._replace(doubts=[*doubts, *self.doubts], notes=[*self.notes, *notes])

    @classmethod
    def read(cls, text: str) -> "Statement":
        """Return what `as_file` wrote."""
        sentences, rows, doubts, notes = (json.loads(text)[name] for name in cls._fields)
        return cls(sentences, [Row(*x) for x in rows], read_doubts(json.dumps(doubts)), notes)


def read_numbers(kind: type[Numbers], stated: Statement | None) -> list[Numbers]:
    """Return the numbers of a kind of the rows that have them."""
    names = {*kind.__annotations__}
    needed = names.difference(kind._field_defaults)  # type: ignore[attr-defined]
    rows = [row.numbers for row in stated.rows] if stated else []
    return [kind(**each) for each in rows if needed <= {*each} <= names]


def cut_remedy(doubt: str) -> str:
    """Return a doubt without its remedy, which is for who computes, behind the last semicolon."""
    return doubt.rpartition("; ")[0] or doubt


def state_outcome(
    result: str,
    words: str,
    remarks: Sequence[Remark] = (),
    demand: str = "-",
    factors: PushFactors | None = None,
) -> Statement:
    """State one outcome, which is the capacity too, with doubts and notes."""
    row = Row(result, demand, words, "-", {})
    if factors:
        demand = factors.site or demand
        row = Row(result, demand, words, str(factors), factors._asdict())
    return Statement([f"{result}: {words}"], [row]).with_remarks(remarks)


def state_scale(
    found: CollapseScale | MechanismScales, motion: Motion, remarks: Sequence[Remark]
) -> dict[str, str]:
    """Return the files with what is stated of a search of scales, and with its runs."""
    result, pga, words = RESULTS["scale"], motion.pga / STANDARD_GRAVITY, found.sentence
    files = dict[str, str]()
    held = found.held
    scales = Scales(motion.name, pga, held, found.states, found.interrupted)
    if isinstance(found, CollapseScale):
        scales = scales._replace(held=(held := found.held_by_all))
        files["scale.csv"] = ResultTable(*found.rows()).csv
        ends = found.first_falls[1], found.as_one.scale if found.as_one else np.inf
        reached = [scale if scale < np.inf else None for scale in ends]
        scales = scales._replace(all_steps=reached[0], as_one=reached[1], again=found.above)
        scales = scales._replace(moves_in_all=found.moves_in_all)
        scales = scales._replace(dislocated_stones=found.dislocated_stones)
    else:
        words += "; a fall was not computed"
    one = scales.as_one or np.inf  # at which it falls
    factor = (f"{held:#.3g}" if held < one else f"< {one:#.3g}") if held else "-"
    factor += " so far" * (found.interrupted and held > 0.0)
    factor += " by all time steps" * (0.0 < held < found.held)
    row = Row(result, f"'{motion.name}', PGA {pga:.2f} g", words, factor, scales._asdict())
    stated = Statement([f"{result}: {words}"], [row], found.doubts).with_remarks(remarks)
    return {**stated.as_file("scale"), **files}


def state_assessments(
    found: Mapping[str, KinematicAssessment], remarks: Sequence[Remark]
) -> Statement:
    """State each check of an assessment with the directions in which it holds; the last decides."""
    checks: dict[tuple[str, str], tuple[AssessmentCheck, AssessmentCheck, Ratios, list[str]]] = {}
    for direction, result in found.items():
        for number, (check, ratios) in enumerate(list_ratios(result)):
            # its values are those of the ratio that decides
            split = result.of_bodies if ratios.bodies is not None else None
            shown = check if split is None else split.checks[number]
            if ratios.floor is not None:
                shown = replace(check, capacity=ratios.floor * check.demand)
            same = checks.setdefault((str(check), str(ratios)), (check, shown, ratios, []))
            same[3].append(direction)
    last = [str(result.checks[-1]) for result in found.values()]
    rows, sentences = [], []
    for (text, _), (check, shown, ratios, directions) in checks.items():
        ways, outcome = " and ".join(directions), check.words
        numbers = ratios._replace(directions=directions)
        if check.outcome == "passes" and check.at_rest:
            outcome += ", for the mechanism does not begin to move"
            numbers = numbers._replace(displaced=shown.moved)
        demand, capacity = (f"{x:.4g} {check.unit}" for x in (shown.demand, shown.capacity))
        capacity += f" {_OF_BODIES}" * (shown is not check and ratios.floor is None)
        demand += check.amplified
        name = f"assessment: {check.name}, {ways}"
        rows.append(Row(name, demand, f"{capacity}, {outcome}", str(ratios), numbers._asdict()))
        sentences += [f"kinematic assessment, {ways}: {text}"] if text in last else []
    sentences.append(describe_margin(found.values()))
    doubts = [doubt for result in found.values() for doubt in result.doubts]
    owners = dict[str, list[str]]()
    for name, note in ((name, x) for name, result in found.items() for x in result.notes):
        owners.setdefault(note, []).append(name)
    # a note on some says on which
    notes = [
        note if len(names) == len(found) else f"{' and '.join(names)}: {note}"
        for note, names in owners.items()
    ]
    return Statement(sentences, rows, doubts, notes).with_remarks(remarks)


def list_ratios(found: KinematicAssessment) -> list[tuple[AssessmentCheck, Ratios]]:
    """List the checks of an assessment with their ratios; with one weight a body if it is less."""
    listed = []
    for number, check in enumerate(found.checks):
        over, split = check.over_fill, check.bodies
        floor = None if check.floor is None else check.decisive
        split = check.decisive if split and floor is None else split
        bodies = split if (split or np.inf) < 0.999 * check.ratio else None
        least = check.decisive if bodies is floor is None else check.ratio
        moved = check.moved if check.at_rest and not over else None
        if bodies is not None and moved is not None and found.of_bodies:
            whole = found.of_bodies.checks[number]
            moved = whole.moved if whole.at_rest else None
        most = np.inf if check.unshown else over.ends[1] if over else least
        needed, linear = over.needed if over else "", check.unit != "m"
        bounded = check.bounded and not check.unshown
        numbers = needed, linear, moved, bodies, bounded, floor
        ratios = Ratios(check.name, (), least, most, *numbers, untied=check.untied)
        listed.append((check, ratios))
    return listed


def find_margin(found: Iterable[KinematicAssessment]) -> float:
    """Return the least ratio of all checks, over what is assumed of a fill too [-]."""
    return min(ratios.decisive for result in found for _, ratios in list_ratios(result))


def compare_checks(checks: Sequence[Ratios]) -> str:
    """Say by which checks an assessment passes and by which not; empty where none differ."""
    moved = {way for check in checks if not check.linear for way in check.directions}
    last = [x for x in checks if not (x.linear and moved.issuperset(x.directions))]
    if not last:
        return ""
    least = min(last, key=lambda x: x.decisive)
    linear = min((x.decisive for x in checks if x.linear), default=0.0)
    undecided = [x for x in last if x.unshown or x.bounded]
    if least not in undecided:
        every = [x for x in checks if x.linear]
        ratios = [[(x.decisive, x.least) for x in each] for each in (last, every)]
        pairs = [tuple(map(min, zip(*each, strict=True))) for each in ratios if each]
        return describe_difference(*pairs)
    failing = [x.decisive for x in last if x.fails]
    if failing and least.unshown:
        return f"another mechanism or sense does not pass ({format_ratio(min(failing))})"
    why = f", as their ratio, {format_ratio(least.decisive)}, is {UPPER_BOUND}"
    if least.unshown:
        why = f" ({least.range}), as the path ends before alpha vanishes"
    shown = f"{NOT_SHOWN} by displacements{why}"
    if untied := 0.0 if failing else min(x.untied or 0.0 for x in undecided):
        shown = (
            f"passes by displacements without ties ({format_ratio(untied)}); with them it {shown}"
        )
    verb = "passes" if linear >= 1.0 else "fails"
    said = least.unshown or bool(untied) or linear >= 1.0 <= least.decisive
    return f"{verb} the linear check ({format_ratio(linear)}), and {shown}" * said


def describe_margin(found: Iterable[KinematicAssessment]) -> str:
    """Describe the least ratio of all checks, and its range over what is assumed of a fill."""
    listed, checks = [], []
    for number, result in enumerate(found):
        own = list_ratios(result)
        listed += [(*each, result.direction) for each in own]
        checks += [x._replace(directions=[str(number)]) for _, x in own]
    check, ratios, sense = min(listed, key=lambda each: each[1].decisive)
    alike = [(x, way) for x, _, way in listed if x.name == check.name]
    same = [x.over_fill for x, _ in alike if x.over_fill is not None]
    if same:
        over = FillRange.least_of(same)
        of = f" {_OF_BODIES}" * (ratios.bodies is not None)
        of = of if ratios.floor is None else " with e* = 1"
        outcome = over.outcome if ratios.needed else check.words
        return f"least margin{of} {over.describe(digits=3)}, by {check.name}: {outcome}"
    others, least = [x.decisive for x, way in alike if way != sense], ratios.decisive
    side, other = "", ""
    if others and min(others) > 1.001 * least:
        side = f", pushed to the {name_side(sense)}"
        other = f"; pushed to the {name_side(-sense)} {format_ratio(min(others))} by the same check"
    outcome = compare_checks(checks) or check.words
    return f"least margin {ratios}, by {check.name}{side}: {outcome}{other}"


def doubt_fill(site: PushFactors | None, found: Collapse) -> list[Doubt]:
    """Return the doubt of a push of the site, or a load, that is borne on some fills alone."""
    if found.over_fill and not found.push:
        needed = found.over_fill.needed
        return doubt_assumed(f"the load is borne: only with {needed}", decide=bool(needed))
    decide = site is not None and site.least < 1.0 <= site.most
    return doubt_assumed("the ground sets it in motion", decide=decide)


def note_across(structure: Structure, found: Iterable[KinematicAssessment]) -> list[str]:
    """Return a note on the push across the plane that overturns it before alpha_0 moves it."""
    weaker = find_transverse_push(structure)[0] < min(each.alpha_0 for each in found)
    text = describe_transverse_push(structure)  # of a column of a wall none
    return [f"{NOTE_MARK}{text}"] * (weaker and bool(text))


def doubt_strip(structure: Structure) -> list[Remark]:
    """Return the doubt of a whole gable whose strip is not known, as its stones carry a roof."""
    load, below = (block.material.stands_for for block in structure.blocks[-2:])
    slopes = structure.above is not None and load == below not in (None, COURSE_LENGTH)
    words = "the weights of its upper courses are with '{}', so that the strip through its highest "
    words += "place, which is weaker, is not assessed"
    remedy = "assess the column strip too, or give it as a load instead of in the stones"
    return [Doubt(words, remedy, (load,))] * slopes


def doubt_ties(case: Case) -> list[Remark]:
    """Return doubts about ties that pull in the one sense of the push."""
    sense = sum(case.assessment.directions)  # 0 of both
    words = "the tie at {} pulls in the sense of the push, which it never holds"
    remedy = "correct the sign of its force, which points to where it is held"
    return [
        Doubt(words, remedy, (str(load.block),))
        for load in case.assessment.options.get("loads", ())
        if load.passive and not load.anchor and sense * load.force[0] > 0.0
    ]


class _Tied(NamedTuple):
    """What is found with a multiple of the forces of ties, ratios up to the largest of interest."""

    margin: float  # least ratio of all checks [-]
    linear: float  # of the linear ones [-]
    mechanism: str
    ratios: Ratios  # of the check that decides
    bounded: bool  # whether one is an upper bound
    breaks: bool  # whether a tie does, at the end of a path
    by_name: Mapping[str, float]  # least ratio of each mechanism [-]

    def margin_but(self, mechanism: str) -> float:
        """Return the least ratio of all mechanisms but one [-]."""
        return min((x for name, x in self.by_name.items() if name != mechanism), default=MOST_TIED)


@dataclass(frozen=True, eq=False)
class _TieSearch:
    """Assessments in one sense with multiples of the forces of ties."""

    case: Case
    sense: float
    progress: ProgressReport
    tried: dict[float, _Tied] = field(default_factory=dict)

    @cached_property
    def ties(self) -> list[AttachedLoad]:
        """Ties of the case."""
        return [x for x in self.case.assessment.options["loads"] if x.passive]

    def solve(self, scale: float) -> _Tied:
        """Return what is found with a multiple of the forces, which is assessed once."""
        if scale in self.tried:
            return self.tried[scale]
        self.progress.show(f"pushed to the {name_side(self.sense)}, {scale:.3g} times", 1)
        settings = self.case.assessment
        loads = [x for x in settings.options["loads"] if not x.passive]
        if scale:
            loads += [replace(x, force=(scale * x.force[0], scale * x.force[1])) for x in self.ties]
        options = {**settings.options, "loads": loads}
        own = replace(settings, directions=(self.sense,), options=options)
        found = own.solve(self.case.structure, self.case.demand)
        of = {k: x.mechanism_name + " of the strip" * ("highest" in k) for k, x in found.items()}
        listed = [(x, of[key]) for key, each in found.items() for _, x in list_ratios(each)]
        ratios, name = min(listed, key=lambda each: (not each[0].fails, each[0].decisive))
        margin = min(MOST_TIED, *(x.decisive for x, _ in listed))
        linear = min(MOST_TIED, *(x.decisive for x, _ in listed if x.linear))
        breaks = any(each.path and each.path.end is PathEnd.BREAKS for each in found.values())
        by_name: dict[str, float] = {}
        for x, each in listed:
            by_name[each] = min(x.decisive, by_name.get(each, MOST_TIED))
        given = ratios, any(x.bounded for x, _ in listed), breaks, by_name
        return self.tried.setdefault(scale, _Tied(margin, linear, name, *given))

    def find_multiple(self, name: str) -> float:
        """Return from which multiple on a ratio is 1 at all that are tried; infinite if at none.

        The ratio is a field of what is found, or that of all mechanisms but the named one.
        """

        def exceed(scale: float) -> float:
            found = self.solve(scale)
            return float(getattr(found, name, found.margin_but(name))) - 1.0

        if exceed(MOST_TIED) <= 0.0:
            return np.inf
        # from above, as another mechanism with less force may pass again
        scales = [*(MOST_TIED * 2.0 ** (-0.5 * np.arange(1, 11))), 0.0]
        low = next((scale for scale in scales if exceed(scale) < 0.0), None)
        if low is None:
            return 0.0
        high = 2.0**0.5 * low or float(scales[-2])
        return float(brentq(exceed, low, high, xtol=1e-3))

    def say_forces(self, scale: float) -> str:
        """Say a multiple of the forces; of one tie its force."""
        if len(self.ties) > 1:
            return f"{scale:.3g} times the forces of the ties"
        (tie,) = self.ties
        return f"{scale * np.hypot(*tie.force) / kN:.3g} kN of the tie at {tie.block}"

    def describe(self) -> str:
        """Describe the force from which on all tried ones pass; empty where ties do nothing."""
        if self.solve(0.0).margin >= 1.0:
            return ""
        most, scale = self.solve(MOST_TIED), self.find_multiple("margin")
        if scale < np.inf:
            length = describe_tied_length(self.case.structure)
            text = f"from {self.say_forces(scale)} on, {length}, all forces tried pass its checks"
            bound = ", one by an upper bound alone, so that more may be needed"
            free = ": give the `free_length` of ties" * any(
                x.free_length is None for x in self.ties
            )
            text += f"{bound}{free}" * self.solve(scale).bounded
        elif not any(tie.anchor or self.sense * tie.force[0] < 0.0 for tie in self.ties):
            return f"no tie holds it: if floors and walls do, give direction = {-self.sense:g}"
        else:
            times = f"{MOST_TIED:g} times the forces of the ties"
            text = f"not even {times} suffice: {most.mechanism}"
            if most.ratios.unshown:
                text = f"with {times} it {NOT_SHOWN} by displacements: {most.mechanism}"
            text += f" has a ratio of {most.ratios.range}"
            own = self.solve(1.0).by_name.get(name := most.mechanism, np.inf)
            # no tie holds it: its ratio is the same with each
            if abs(own / most.by_name[name] - 1.0) < 1e-3:
                scale, length = self.find_multiple(name), describe_tied_length(self.case.structure)
                passes = f"; all else passes from {self.say_forces(scale)} on, {length}"
                text += passes * (0.0 < scale < np.inf)
        linear = self.find_multiple("linear")
        if linear >= 0.99 * scale:
            return text
        alone = f"from {self.say_forces(linear)} on" if linear else "without ties"
        return f"{text}; the linear check alone is passed {alone}"

    def doubt_lower(self) -> list[Remark]:
        """Return the doubt of a mechanism that has a lower ratio with stronger ties."""
        # the end of a path by a tie that breaks bounds nothing
        stronger = {x: y.margin for x, y in self.tried.items() if x > 1.0 and not y.breaks}
        own, bound = self.solve(1.0), 1.01 * min(stronger.values(), default=np.inf)
        if own.margin < bound:
            return []
        # of about equal ratios that with the least force
        least = self.tried[scale := min(x for x, margin in stronger.items() if margin < bound)]
        words = (
            "pushed to the {}, {} has a ratio of {} ({}) with {:.3g} times the forces of the ties, "
            "and with those given the least is {:.3g}: ties only resist it, so that with these it "
        )
        side, ratios = name_side(self.sense), least.ratios
        words += "is not shown to pass either" if ratios.unshown else "has no higher ratio"
        values = side, least.mechanism, ratios.range, ratios.check, scale, own.margin
        return [Doubt(words, "take the lower ratio", values)]


def note_ties(case: Case) -> list[Remark]:
    """Return notes on the force of ties with which a sense just passes, and doubts about it."""
    settings, notes = case.assessment, list[Remark]()
    ties = any(load.passive for load in settings.options.get("loads", ()))
    for sense in settings.directions if ties else ():
        # without its ties it may not stand
        with suppress(InvalidInput), ProgressReport("forces of ties", None) as progress:
            search, doubts = _TieSearch(case, sense, progress), list[Remark]()
            try:
                if text := search.describe():
                    doubts = search.doubt_lower()
            except DidNotConverge as error:
                text = f"the force of ties with which all checks pass was not found: {error}"
            note = f"{NOTE_MARK}pushed to the {name_side(sense)}, {text}"
            notes += [*[note] * bool(text), *doubts]
    return notes


def assess_untied(
    case: Case, found: Mapping[str, KinematicAssessment]
) -> dict[str, KinematicAssessment]:
    """Return assessments with the ratio without ties, where it alone shows a sense to pass."""
    settings, given = case.assessment, dict(found)
    loads = [load for load in settings.options.get("loads", ()) if not load.passive]
    own = replace(settings, options={**settings.options, "loads": loads})
    for key, x in found.items():
        check, tied = x.checks[-1], bool(x.path and x.path.blocks.ties)
        if tied and (check.unshown or (check.bounded and check.outcome != "fails")):
            # without its ties it may not stand
            with suppress(InvalidInput, DidNotConverge):
                free = replace(own, directions=(x.direction,)).solve(case.structure, case.demand)
                same = {key: free[key]} if key in free else free
                checks = [each.checks[-1] for each in same.values()]
                if all(each.passes and each.unit == check.unit == "m" for each in checks):
                    check = replace(check, untied=min(each.decisive for each in checks))
                    given[key] = replace(x, displacement=check)
    return given


def note_sense(case: Case) -> list[str]:
    """Return a note on the sense of push that the case leaves out."""
    sense, *others = case.assessment.directions
    words = f"pushed to the {name_side(-sense)} nothing was assessed, as the case gives direction"
    return [f"{NOTE_MARK}{words} = {sense:g}"] * (not others)


def note_band(case: Case, found: Iterable[KinematicAssessment]) -> list[str]:
    """Return a note where motions are matched up to a shorter period than that of a check."""
    if (band := find_matched_band(case.suite)) is None:
        return []
    low, high = band
    longer = [each.checks[-1].period for each in found if each.checks[-1].period > high]
    words = (
        f"{MATCHED} {low:g} to {high:g} s, and T = {max(longer, default=high):.2f} s is longer: "
    )
    words += "there they may be weaker than the spectrum; give suite.band"
    return [f"{NOTE_MARK}{words}"] * bool(longer)


def state_risk(found: Any) -> Statement:  # of `archfem.studies`, a room to the right
    """State the annual rate, the hazard by its return periods, and the median of the falls."""
    hazard, median, rate = found.hazard, found.fragility().median, found.rate()
    name, unit = hazard.measure.upper().replace("_AVG", ", mean,"), MEASURES[hazard.measure]
    years = 1.0 / hazard.rate if len(hazard.rate) <= 4 else np.array([DESIGN_PERIOD])
    sizes = hazard.intensity_of(years)
    listed = ", ".join(f"{value:.3g}" for value in sizes)
    demand = f"{name} {listed} {unit} once in {', '.join(f'{each:.4g}' for each in years)} years"
    outcome = f"median {name} {median:.3g} {unit}, falls at {rate.rate:.2g} a year"
    factors = zip(sizes, years, strict=True)
    factor = ", ".join(f"{median / size:.3g} on {each:.4g} years" for size, each in factors)
    half = f"in half of the cases from {median:.3g} {unit} of {name}"
    text = f"the structure falls at {rate}; {half}; {hazard.origin}"
    return Statement([text], [Row("annual rate", demand, outcome, factor, {})], found.doubts)
