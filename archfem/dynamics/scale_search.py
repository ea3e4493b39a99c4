"""Search of scales of a ground motion: runs, brackets of limit states, and the next scale.

Incremental dynamic analysis: runs at increasing and decreasing scales until each limit state is
bracketed, then at the geometric mean of the widest bracket. A structure may stand at a larger scale
than one at which it falls. Hence runs also fill the gaps between scales below the smallest fall;
where one falls, the search continues below it. A run ends once a block is lost for good. The
smallest fall is then repeated to its end, with the checks of a whole fall.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, sqrt
from time import perf_counter
from typing import Any

from archfem._display import ProgressReport, write_progress_line
from archfem._files import align_columns
from archfem.dynamics.collapse_state import FALLEN_STATES, CollapseState
from archfem.dynamics.history import Ending
from archfem.dynamics.monitor import FILL_TENSION, PULLED
from archfem.dynamics.rigid_body.rocking_body import say_scale
from archfem.dynamics.verdict import MECHANISM_DEFINITIONS
from archfem.errors import InvalidInput
from archfem.limit.mechanism_count import Mechanism
from archfem.masonry.structure import join_names
from archfem.models.model import Doubt, group_doubts, log_doubts_once, merge_doubts

# Limit state of large displacements, in place of a definition of mechanisms
COLLAPSE_DEFINITION = "collapse"

# Words beside the bounds of a search that Ctrl-C has ended
UNFINISHED = "search unfinished"

# What a search leaves open
NOT_VARIED = "no property or motion: how far others, such as other seeds, differ is unknown"

# Gaps between scales are filled down to a ratio, from a share of the smallest fall on [-]
FILLED_SHARE, FILLED_RATIO = 0.5, 1.1
NEAR_SHARE, NEAR_RATIO = 0.7, 1.05  # where windows of falls are most frequent


@dataclass(frozen=True)
class ScaledRun:
    """Result of one run of a search."""

    scale: float  # factor on the motion [-]
    mechanisms: dict[str, Mechanism | None]  # the first mechanism by each definition, or None
    ending: Ending
    outcome: str  # ending in words
    fall: CollapseState | None = None  # state of collapse; None for small displacements
    doubts: tuple[Doubt, ...] = ()
    admissible_step: float = inf  # that follows sliding, where that of the run does not [s]
    whole: bool = True  # whether its fall was followed beyond the loss of a block

    def has_answer(self, definition: str) -> bool:
        """Return whether the run decides on a limit state: on a fall by a state of collapse."""
        return definition != COLLAPSE_DEFINITION or self.fall is not None

    def fails(self, definition: str) -> bool:
        """Return whether the limit state was met."""
        if definition == COLLAPSE_DEFINITION:
            return self.fall is not None and self.fall.kind in FALLEN_STATES
        # a step without equilibrium counts as a mechanism
        return self.mechanisms[definition] is not None or self.ending is Ending.FAILED

    def survives(self, definition: str) -> bool:
        """Return whether the whole motion passed without the limit state."""
        return self.has_answer(definition) and not self.fails(definition)


# Runs by time step, None where it was not given, and scale
KeptRuns = Mapping[tuple[float | None, float], ScaledRun]


@dataclass(frozen=True)
class Bracket:
    """Scales between which a limit state is first met.

    Failure need not be monotonic in the scale: the smallest failing scale counts.
    """

    lower: float  # largest surviving scale below `upper` [-]; 0 for none
    upper: float  # smallest failing scale [-]; infinite for none
    run: ScaledRun | None  # that at `upper`, or None
    above: tuple[float, ...]  # surviving scales beyond `upper`
    unanswered: tuple[float, ...] = ()  # scales of runs that do not decide on it

    @property
    def ratio(self) -> float:
        """Ratio of the bounds [-]; infinite where one is missing."""
        return self.upper / self.lower if self.lower > 0.0 else inf


@dataclass(frozen=True)
class MechanismScales:
    """Runs of a search for the scales at first mechanism; `scales[definition]` is a bracket."""

    definitions: tuple[str, ...]  # for which the structure has enough joints
    runs: tuple[ScaledRun, ...] = ()  # in order of their scales
    interrupted: bool = False  # whether Ctrl-C ended the search
    pga: float | None = None  # peak of the motion [m/s²]
    dt: float | None = None  # time step that was given [s]

    @property
    def first(self) -> str:
        """Definition of the mechanism that is met at the smallest scale."""
        return min(self.definitions, key=lambda definition: self[definition].upper)

    @property
    def held(self) -> float:
        """Largest scale below the first mechanism, and below a fill in tension [-]; 0 for none."""
        most, below = self[self.first].lower, find_tension(self.runs)
        stood = (run.scale for run in self.runs if run.survives(self.first) and run.scale < below)
        return max((scale for scale in stood if scale <= most), default=0.0)

    @property
    def held_in_doubt(self) -> float:
        """Largest scale below the first mechanism, whatever its fill [-]; 0 for none."""
        return self[self.first].lower

    @property
    def states(self) -> dict[str, float]:
        """Smallest scales at which it forms a mechanism, and before at which its fill is pulled."""
        bracket, pulled = self[self.first], find_tension(self.runs)
        scales = {"tension": pulled} if pulled <= bracket.lower else {}
        return scales | ({"mechanism": bracket.upper} if bracket.run else {})

    @property
    def sentence(self) -> str:
        """Scales around the first mechanism by any definition, in words."""
        first, bracket = self.first, self[self.first]
        met = "nor at any scale that was tried"
        if bracket.run:
            met = f"first mechanism at {say_scale(bracket.upper, self.pga)}, by {first}"
        return say_bracket("no mechanism", self, met)

    def __repr__(self) -> str:
        """Return the sentence, and what was varied."""
        return f"{self.sentence}; varied was the scale, and {NOT_VARIED}"

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Reasons why the scales of the first mechanism may be wrong."""
        return doubt_searches({"": self}, self.first)

    @property
    def kept_runs(self) -> KeptRuns:
        """Runs by time step and scale."""
        return {(self.dt, run.scale): run for run in self.runs}

    def with_run(self, run: ScaledRun) -> "MechanismScales":
        """Return the search with one more run, in place of one at its scale."""
        others = [each for each in self.runs if each.scale != run.scale]
        return replace(self, runs=tuple(sorted([*others, run], key=lambda each: each.scale)))

    def __getitem__(self, definition: str) -> Bracket:
        """Bracket of a definition; without bounds if the structure has too few joints for it."""
        if definition not in self.definitions:
            return Bracket(0.0, inf, None, ())
        failing = [run for run in self.runs if run.fails(definition)]
        surviving = [run.scale for run in self.runs if run.survives(definition)]
        upper = failing[0].scale if failing else inf
        return Bracket(
            max((scale for scale in surviving if scale < upper), default=0.0),
            upper,
            failing[0] if failing else None,
            tuple(scale for scale in surviving if scale > upper),
            tuple(run.scale for run in self.runs if not run.has_answer(definition)),
        )

    def table(self) -> str:
        """Return a line per definition: its bracket, and the mechanism at the upper bound."""
        head = ["mechanism", "survives", "fails", "class", "at", "part", "note"]
        return align_columns(head, [self._row(definition) for definition in MECHANISM_DEFINITIONS])

    def _row(self, definition: str) -> list[str]:
        bracket = self[definition]
        mechanism = bracket.run.mechanisms[definition] if bracket.run else None
        notes = []
        if bracket.run and mechanism is None:
            notes.append(bracket.run.outcome)
        if definition not in self.definitions:
            notes.append("has no such joints")
        if bracket.above:
            notes.append("survives also " + ", ".join(f"{scale:.3g}" for scale in bracket.above))
        return [
            definition,
            f"{bracket.lower:.3g}" if bracket.lower else "-",
            f"{bracket.upper:.3g}" if bracket.run else "-",
            mechanism.kind if mechanism else "-",
            f"{mechanism.time:.3f} s" if mechanism and mechanism.time is not None else "-",
            mechanism.part if mechanism else "-",
            "; ".join(notes) or "-",
        ]


def say_bracket(state: str, found: Any, met: str) -> str:
    """Return a bracket in words, from the state at its lower bound to the event above it."""
    if scale := found.states.get("tension"):
        met = f"at {scale:#.3g} × {PULLED}: {met}"
    met = f"{UNFINISHED}, {met}" if found.interrupted else met
    if not found.held:  # the smaller ones, if any were run, have no answer
        if found.held_in_doubt:
            return f"{state} in doubt up to {found.held_in_doubt:#.3g} ×, {met}"
        return f"{met}; no smaller scale is known to survive"
    return f"{state} at {say_scale(found.held, found.pga)}, {met}"


def find_tension(runs: Iterable[ScaledRun]) -> float:
    """Return the smallest scale at which an elastic fill bears more tension than soil [-]."""
    doubted = (run.scale for run in runs if any(x.words == FILL_TENSION for x in run.doubts))
    return min(doubted, default=inf)


def list_bounds(scales: MechanismScales, definition: str) -> list[ScaledRun]:
    """Return the runs at both ends of a bracket."""
    bracket = scales[definition]
    return [run for run in scales.runs if run.scale in (bracket.lower, bracket.upper)]


def doubt_searches(searches: Mapping[str, MechanismScales], definition: str) -> tuple[Doubt, ...]:
    """Return reasons why brackets may be wrong: runs broken off, not monotonic, or in doubt.

    Searches are by their settings in words. Doubts that differ in numbers alone are stated once.
    """
    doubts, of_runs = list[Doubt](), list[Doubt]()
    for settings, scales in searches.items():
        bracket = scales[definition]
        if above := bracket.above:
            words = "it is not monotonic: above a fall it survives {:#.3g} × the motion"
            doubts.append(Doubt(words, "", ((min(above), max(above)),), settings))
        if broken := [run for run in scales.runs if run.scale in bracket.unanswered]:
            first = f": the first {broken[0].outcome}" if broken[0].outcome else ""
            words, at = "runs without an answer were at {:#.3g} × the motion{}", bracket.unanswered
            doubts.append(Doubt(words, "", ((at[0], at[-1]), first), settings))
        if scales.interrupted:
            made = f"{len(scales.runs)} run{'s' * (len(scales.runs) != 1)}"
            words = f"the search was interrupted after {made}"
            doubts.append(Doubt(words, "the same command continues it", (), settings))
        ends = [run.scale for run in list_bounds(scales, definition)]
        # with joints a run below a fall may fall too
        loose = [run.scale for run in scales.runs if run.fall and run.fall.lacks_joints]
        ends += [scale for scale in loose if scale < bracket.upper]
        for run in (run for run in scales.runs if run.scale in ends):
            place = f"{run.scale:#.3g} × {settings}".strip()
            of_runs += [replace(doubt, place=place) for doubt in run.doubts]
    for same in group_doubts(of_runs):
        first, *others = [doubt.place for doubt in same]
        likewise = f" (likewise at {join_names(others)})" if others else ""
        doubts.append(merge_doubts(same, f"at {first}{likewise}"))
    return tuple(doubts)


def check_search(precision: float, between: Sequence[float]) -> None:
    """Refuse a width of brackets, or a range of scales, that no search has."""
    if not (1e-4 <= precision <= 1.0 and 0.0 < between[0] <= between[1] < inf):
        raise InvalidInput(
            f"precision {precision:g} between scales {tuple(between)}: give 0.0001 to 1, and two "
            "scales above 0, the smaller first"
        )


# Progress of a search whose first two runs are in doubt, as its others will be
_MAY_BE_VAIN = (
    "elastic fill bears more tension than soil at both scales so far, so that the answer will be "
    'in doubt: cut the fill into pieces (law = "jointed" in [structure.fill] of a case); Ctrl-C '
    "ends the search, with its runs kept"
)


@log_doubts_once()
def search_scales(
    run_scaled: Callable[[float], ScaledRun],
    definitions: tuple[str, ...],
    precision: float,
    between: tuple[float, float],
    begin: Sequence[float] = (1.0,),
    found: MechanismScales | None = None,
    name: str = "",
) -> MechanismScales:
    """Make runs until all brackets are within the precision, and below a fall no gap is wide.

    Nor is the gap below the smallest dislocation, where falls are searched.

    The first ones are at `begin`; those that were `found` before are kept. The smallest fall is run
    again if it is not whole.
    """
    scales, made, spent, count = found or MechanismScales(definitions), "", 0.0, 0
    try:
        with ProgressReport(f"scale of {name or 'the motion'}", None) as progress:
            while (scale := _next_scale(scales, precision, between, begin)) is not None:
                began = perf_counter()
                progress.show("; ".join(filter(None, [made, f"now {scale:#.3g} ×"])))
                run = run_scaled(scale)
                seconds = perf_counter() - began
                spent += seconds
                if run.ending is Ending.INTERRUPTED:  # says nothing about the scale
                    raise KeyboardInterrupt
                scales = scales.with_run(run)
                fall = run.fall
                result = f"{fall.kind}{fall.dislocated_stones}" if fall else run.outcome
                made = f"{scale:#.3g} × the motion: {result}, in {seconds:.2g} s"
                count += 1
                if left := _count_left(scales, precision, between, begin):
                    last = spent / count * left
                    made += f"; about {left} runs, {last:.2g} s, are left by this time step alone"
                progress.show(made, 1)
                if len(scales.runs) == 2 and all(find_tension([x]) < inf for x in scales.runs):
                    write_progress_line("scale", _MAY_BE_VAIN)
    except KeyboardInterrupt:
        scales = replace(scales, interrupted=True)
    return scales


def _count_left(
    scales: MechanismScales, precision: float, between: tuple[float, float], begin: Sequence[float]
) -> int:
    """Count the runs that are left if it falls from the middle of its bracket on.

    A missing end of the bracket is assumed at the next scale; first mechanisms are not counted.
    """
    if scales.definitions != (COLLAPSE_DEFINITION,):
        return 0
    bracket, count = scales[COLLAPSE_DEFINITION], 0
    upper = min(bracket.upper, sqrt(2.0) * scales.runs[-1].scale)
    falls = sqrt(upper * (bracket.lower or scales.runs[0].scale / sqrt(2.0)))
    while (scale := _next_scale(scales, precision, between, begin)) is not None:
        kind = FALLEN_STATES[0] if scale >= falls else "stands"
        fall = CollapseState(kind, None, (), 0.0, 0.0, True)
        scales, count = scales.with_run(ScaledRun(scale, {}, Ending.FINISHED, "", fall)), count + 1
    return count


def _next_below_fall(scales: MechanismScales, precision: float, smallest: float) -> float | None:
    """Return a scale in the widest gap below the smallest fall or the last run, or None.

    The gap below the smallest dislocation is filled too.
    """
    runs = scales.runs
    moved = (run.scale for run in runs if run.fall and run.fall.kind == "dislocated")
    dislocated = min(moved, default=0.0)
    top = min(scales[COLLAPSE_DEFINITION].upper, runs[-1].scale)
    first = runs[0].scale
    if first > smallest and (first > FILLED_SHARE * top or first == dislocated):
        return max(first / sqrt(2.0), smallest)

    def excess(gap: tuple[float, float]) -> float:
        ratio = NEAR_RATIO if gap[1] > NEAR_SHARE * top else FILLED_RATIO
        return gap[1] / gap[0] / max(ratio, 1.0 + precision)

    gaps = pairwise(run.scale for run in runs if run.scale <= top)
    filled = (gap for gap in gaps if gap[1] > FILLED_SHARE * top or gap[1] == dislocated)
    wide = [gap for gap in filled if excess(gap) > 1.0]
    if not wide:
        return None
    lower, upper = max(wide, key=excess)
    return sqrt(lower * upper)


def _next_scale(
    scales: MechanismScales, precision: float, between: tuple[float, float], begin: Sequence[float]
) -> float | None:
    """Return the scale of the next run, which repeats the smallest fall at last, or None."""
    if (scale := _next_new_scale(scales, precision, between, begin)) is not None:
        return scale
    fall = scales[COLLAPSE_DEFINITION].run
    return None if fall is None or fall.whole else fall.scale


def _next_new_scale(
    scales: MechanismScales, precision: float, between: tuple[float, float], begin: Sequence[float]
) -> float | None:
    """Return a scale that was not run, or None."""
    runs, (smallest, largest) = scales.runs, between
    ratio, max_runs = sqrt(2.0), 40  # ratio of scales before bisection
    first = [min(max(scale, smallest), largest) for scale in begin]
    missing = [scale for scale in first if all(scale != run.scale for run in runs)]
    if missing:
        return missing[0]
    # four definitions to five per cent take about fifteen runs
    if len(runs) >= max_runs:
        return None
    brackets = [scales[definition] for definition in scales.definitions]
    fails = any(bracket.lower == 0.0 for bracket in brackets)
    if runs[0].scale > smallest and (fails or find_tension(runs[:1]) < inf):
        return max(runs[0].scale / ratio, smallest)
    if runs[-1].scale < largest and any(bracket.run is None for bracket in brackets):
        return min(runs[-1].scale * ratio, largest)
    wide = [bracket for bracket in brackets if 1.0 + precision < bracket.ratio < inf]
    fills = COLLAPSE_DEFINITION in scales.definitions
    if fills and (scale := _next_below_fall(scales, precision, smallest)) is not None:
        return scale
    for bracket in sorted(wide, key=lambda bracket: -bracket.ratio):
        # a scale without an answer divides no bracket: its neighbours are tried instead
        for share in (1.0 / 2.0, 1.0 / 3.0, 2.0 / 3.0):
            scale = bracket.lower * bracket.ratio**share
            if all(abs(scale / other - 1.0) > 1e-6 for other in bracket.unanswered):
                return float(scale)
    return None
