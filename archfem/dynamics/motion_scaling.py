"""Scale of a ground motion at the first mechanism, or at collapse of the structure.

Incremental dynamic analysis: runs at increasing and decreasing scales until each limit state is
bracketed, then at the geometric mean of the widest bracket. A structure may stand at a larger scale
than one at which it falls. Hence runs also fill the gaps between scales below the smallest fall;
where one falls, the search continues below it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from math import inf, sqrt
from time import perf_counter
from typing import Any

from archfem._display import ProgressReport, call_late_bound
from archfem._files import align_columns
from archfem._validation import validate_arguments, validate_methods
from archfem.dynamics.analysis import Analysis, takes_analysis, takes_falling_analysis
from archfem.dynamics.collapse_state import FALLEN_STATES, CollapseState, doubt_soft_blocks
from archfem.dynamics.events import EveryMechanism, applicable_definitions
from archfem.dynamics.fall import state_rigid_falls
from archfem.dynamics.history import Ending, History, first_mechanisms, partial_history
from archfem.dynamics.monitor import FILL_TENSION, PULLED, refuse_fill_in_tension
from archfem.dynamics.recorder import Record
from archfem.dynamics.rigid_body.rocking_body import (
    FirstFall,
    describe_first_fall,
    find_first_fall,
    say_scale,
)
from archfem.dynamics.schemes import EffectiveDamping, Viscous
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.time_history import time_history
from archfem.dynamics.verdict import MECHANISM_DEFINITIONS
from archfem.dynamics.verdict_range import VerdictRange
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.limit.mechanism_count import Mechanism
from archfem.masonry.structure import Structure, join_names
from archfem.models.model import Doubt, Model, group_doubts, log_doubts_once, merge_doubts
from archfem.motion.motion import Motion, admissible_range
from archfem.statics.equilibrium import Equilibrium, dead_load
from archfem.units import Ends

# Limit state of large displacements, in place of a definition of mechanisms
COLLAPSE_DEFINITION = "collapse"

# Words beside the bounds of a search that Ctrl-C has ended
UNFINISHED = "search unfinished"

# Step of a search that is given none, and the least to which it is shortened for sliding [s]
OWN_STEP, LEAST_STEP = 0.005, 0.0005

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
        most, below = self[self.first].lower, _find_tension(self.runs)
        stood = (run.scale for run in self.runs if run.survives(self.first) and run.scale < below)
        return max((scale for scale in stood if scale <= most), default=0.0)

    @property
    def states(self) -> dict[str, float]:
        """Smallest scales at which it forms a mechanism, and before at which its fill is pulled."""
        bracket, pulled = self[self.first], _find_tension(self.runs)
        scales = {"tension": pulled} if pulled <= bracket.lower else {}
        return scales | ({"mechanism": bracket.upper} if bracket.run else {})

    @property
    def sentence(self) -> str:
        """Scales around the first mechanism by any definition, in words."""
        first, bracket = self.first, self[self.first]
        met = "nor at any scale that was tried"
        if bracket.run:
            met = f"first mechanism at {say_scale(bracket.upper, self.pga)}, by {first}"
        return _say_bracket("no mechanism", self, met)

    def __repr__(self) -> str:
        """Return the sentence."""
        return self.sentence

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Reasons why the scales of the first mechanism may be wrong."""
        return _doubts_of_searches({"": self}, self.first)

    @property
    def kept_runs(self) -> KeptRuns:
        """Runs by time step and scale."""
        return {(self.dt, run.scale): run for run in self.runs}

    def with_run(self, run: ScaledRun) -> "MechanismScales":
        """Return the search with one more run."""
        return replace(self, runs=tuple(sorted([*self.runs, run], key=lambda each: each.scale)))

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


@takes_analysis
@validate_arguments
def mechanism_scales(  # noqa: PLR0913  (arguments of `time_history`, and of the search)
    model: Model | Analysis,
    motion: Motion,
    *,
    start: Equilibrium | None = None,
    damping: Viscous | EffectiveDamping | str | None = None,
    dt: float | None = None,
    criteria: Criteria | None = None,
    precision: float = 0.05,
    between: tuple[float, float] = (0.05, 5.0),
    method: str | Callable[[Motion], Stepper] = "auto",
    made: KeptRuns | None = None,
) -> MechanismScales:
    """Find the smallest scale of a motion at which each definition of a mechanism is first met.

    Incremental dynamic analysis: scales decrease from 1 by a factor √2 until nothing is met and
    increase until everything is, then brackets are bisected. Each run covers all definitions and
    ends once all are met. A run without equilibrium counts as failed. Ctrl-C ends the search and
    returns the runs made so far. Scales between those that were run are not tested.

    Args:
        model: model of any fidelity, or an `Analysis`, whose settings are then the defaults.
        motion: motion to scale, vertical component included.
        start: dead load, computed if not given.
        damping: as for `time_history`.
        dt: time step [s], as for `time_history`.
        criteria: as for `time_history`.
        precision: relative width of the final brackets [-].
        between: smallest and largest scale [-]; no ground motion may exceed 5 g.
        method: as for `time_history`, or a function from a scaled motion to its solver.
        made: `kept_runs` of an interrupted search with the same arguments, which continues.

    Returns:
        Brackets, mechanisms and runs; at most 40 runs are made.

    Raises:
        InvalidInput: precision or scales are out of range.
        DidNotConverge: the structure does not stand under dead load.

    References:
        Vamvatsikos and Cornell, Earthq. Eng. Struct. Dyn. 31 (2002) 491-514.
    """
    check_search(precision, between)
    start = start or dead_load(model)

    def run_scaled(scale: float) -> ScaledRun:
        if kept := (made or {}).get((dt, scale)):
            return kept
        scaled = motion.scaled(scale)
        solver = method if isinstance(method, str) else method(scaled)
        options = {"start": start, "damping": damping, "criteria": criteria, "method": solver}
        record = Record(whole_fall=False)  # mechanisms come before a fall
        run = _run_as_far(model, scaled, dt=dt, until=EveryMechanism(), record=record, **options)
        return ScaledRun(scale, first_mechanisms(run), run.ending, run.outcome, doubts=run.doubts)

    definitions = (*applicable_definitions(start.model.structure, criteria), "verified")
    within = admissible_range(between, motion)
    found = search_scales(run_scaled, definitions, precision, within, name=motion.name)
    return replace(found, pga=motion.pga, dt=dt)


def _run_as_far(model: Model | Analysis, motion: Motion, **options: Any) -> History:
    """Return the history of a run, up to a step that has no equilibrium."""
    try:
        return time_history(model, motion, **options)
    except DidNotConverge as error:
        history = partial_history(error)
        if history.ending is not Ending.FAILED:  # the fall of loose blocks did
            history.dataset.attrs["outcome"] += f", and {str(error).partition(':')[0]}"
        return history


def _say_bracket(state: str, found: Any, met: str) -> str:
    """Return a bracket in words, from the state at its lower bound to the event above it."""
    if scale := found.states.get("tension"):
        met = f"at {scale:#.3g} × {PULLED}: {met}"
    met = f"{UNFINISHED}, {met}" if found.interrupted else met
    if not found.held:  # the smaller ones, if any were run, have no answer
        return f"{met}; no smaller scale is known to survive"
    return f"{state} at {say_scale(found.held, found.pga)}, {met}"


def _find_tension(runs: Iterable[ScaledRun]) -> float:
    """Return the smallest scale at which an elastic fill bears more tension than soil [-]."""
    doubted = (run.scale for run in runs if any(x.words == FILL_TENSION for x in run.doubts))
    return min(doubted, default=inf)


def _list_bounds(scales: MechanismScales, definition: str) -> list[ScaledRun]:
    """Return the runs at both ends of a bracket."""
    bracket = scales[definition]
    return [run for run in scales.runs if run.scale in (bracket.lower, bracket.upper)]


def _doubts_of_searches(
    searches: Mapping[str, MechanismScales], definition: str
) -> tuple[Doubt, ...]:
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
        for run in _list_bounds(scales, definition):
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

    The first ones are at `begin`; those that were `found` before are kept.
    """
    scales = found or MechanismScales(definitions)
    try:
        with ProgressReport(f"scale of {name or 'the motion'}", None) as progress:
            while (scale := _next_scale(scales, precision, between, begin)) is not None:
                began = perf_counter()
                run = run_scaled(scale)
                seconds = perf_counter() - began
                if run.ending is Ending.INTERRUPTED:  # says nothing about the scale
                    raise KeyboardInterrupt
                scales = scales.with_run(run)
                result = run.fall.kind if run.fall else run.outcome
                progress.show(f"{scale:#.3g} × the motion: {result}, in {seconds:.2g} s", 1)
    except KeyboardInterrupt:
        scales = replace(scales, interrupted=True)
    return scales


def _next_below_fall(scales: MechanismScales, precision: float, smallest: float) -> float | None:
    """Return a scale in the widest gap below the smallest fall or the last run, or None."""
    runs = scales.runs
    top = min(scales[COLLAPSE_DEFINITION].upper, runs[-1].scale)
    if runs[0].scale > max(FILLED_SHARE * top, smallest):
        return max(runs[0].scale / sqrt(2.0), smallest)

    def excess(gap: tuple[float, float]) -> float:
        ratio = NEAR_RATIO if gap[1] > NEAR_SHARE * top else FILLED_RATIO
        return gap[1] / gap[0] / max(ratio, 1.0 + precision)

    gaps = pairwise(run.scale for run in runs if run.scale <= top)
    wide = [gap for gap in gaps if gap[1] > FILLED_SHARE * top and excess(gap) > 1.0]
    if not wide:
        return None
    lower, upper = max(wide, key=excess)
    return sqrt(lower * upper)


def _next_scale(
    scales: MechanismScales, precision: float, between: tuple[float, float], begin: Sequence[float]
) -> float | None:
    """Return the scale of the next run, or None."""
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
    if runs[0].scale > smallest and (fails or _find_tension(runs[:1]) < inf):
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


@validate_methods
@dataclass(frozen=True)
class CollapseScale:
    """Scales of a motion between which a structure falls, searched with several time steps.

    A structure has fallen once its `CollapseState` is "partly fallen" or "fallen". A run that is
    broken off counts neither as a fall nor as standing, and no bracket rests on it. Only falls
    count of a step whose search was interrupted, unless no step has a finished search. The response
    need not be monotonic: it may survive a motion stronger than one that brought it down, and fall
    at a scale between two at which it stood.

    Attributes:
        searches: runs made, by time step [s].
        pga: peak of the motion [m/s²].
        of_model: doubts that concern every run, whatever its scale.
        longer: runs made before, with steps too long for sliding; no bound rests on them.
        as_one: first fall of a stack as one rigid body; None of other structures.
    """

    searches: dict[float, MechanismScales]
    pga: float | None = None
    of_model: tuple[Doubt, ...] = ()
    longer: dict[float, MechanismScales] = field(default_factory=dict)
    as_one: FirstFall | None = None

    @property
    def sentence(self) -> str:
        """Scales around the fall, and the least at which it is dislocated, in words."""
        least, met = self._least_fall, "falls at no scale that was tried"
        if least < inf:
            met = f"falls at {say_scale(least, self.pga)}"
        elif unanswered := [run.scale for run in self._runs if run.fall is None]:
            none = f"{len(unanswered)} have none, the first at {min(unanswered):#.3g} ×"
            met = f"falls in no run that has an answer ({none})"
        if least < self.upper:
            at = f"first falls at {self.upper:#.3g} ×" if self.upper < inf else "falls at no scale"
            met = f"{met}, {'the other' if len(self.searches) == 2 else 'the last'} time step {at}"
        if self.above:
            met = f"{met}, and stands again at {Ends.of(self.above):#.3g} ×"
        if self.dislocated < inf:
            met = f"dislocated at {self.dislocated:#.3g} ×, {met}"
        if self.moves <= max(self._stood):
            met = f"a mechanism at {self.moves:#.3g} ×{' or less' * self.moves_in_all}, {met}"
        said, first = _say_bracket("stands", self, met), self.as_one
        if first is None:
            return said
        one = f"as one rigid body it {describe_first_fall(first, self.pga)}"
        return f"{one}; in courses it {said}" if first.scale <= self.held else f"{said}; {one}"

    def __repr__(self) -> str:
        """Return the sentence, how closely scales were run, and what was varied."""
        steps = join_names([f"{1e3 * dt:g}" for dt in sorted(self._every, reverse=True)])
        varied = f"; varied were the scale and the time step ({steps} ms), and no property"
        return f"{self.sentence}{self._say_tested()}{varied}"

    def _say_tested(self) -> str:
        """Return in words how closely scales were run up to `lower`; "" where none stands."""
        stood = sorted({scale for scale, _ in self._list_held()})
        gaps = [gap for gap in pairwise(stood) if gap[1] > FILLED_SHARE * self.lower]
        if not gaps:
            return ""
        ratio = max(high / low for low, high in gaps)
        parted = " or is dislocated" * (self.dislocated < self.lower)
        parted += " or has no answer" * (min(self.unanswered, default=inf) < self.lower)
        return (
            f"; stands{parted} at every smaller scale that was run: from {gaps[0][0]:#.3g} × on "
            f"they are up to a factor of {ratio:.2f} apart, and none between was run"
        )

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the search."""
        return any(search.interrupted for search in self.searches.values())

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Reasons why the scales may be wrong."""
        doubts = [*self.of_model]
        finished = {dt: each for dt, each in self._every.items() if not each.interrupted}
        if len(finished) > 1 and _disagreeing(finished):
            low, *_, high = sorted(x[COLLAPSE_DEFINITION].upper for x in finished.values())
            words, ends = "its time steps find the first fall at {:#.3g} × the motion", (low, high)
            if high == inf:
                words, ends = "a time step finds a fall at {:#.3g} ×, and another none", (low, low)
            doubts.append(Doubt(words, "", (ends,)))
        searches = {f"by {1e3 * dt:g} ms": search for dt, search in self.searches.items()}
        of_runs = _doubts_of_searches(searches, COLLAPSE_DEFINITION)
        doubts += [x for x in of_runs if replace(x, place="") not in self.of_model]
        falls = [(run.scale, run.doubts) for run in self._runs if run.fails(COLLAPSE_DEFINITION)]
        return tuple(state_rigid_falls(doubt, falls) for doubt in doubts)

    @property
    def _every(self) -> dict[float, MechanismScales]:
        """All runs made, those with longer steps first."""
        return {**self.longer, **self.searches}

    @property
    def kept_runs(self) -> KeptRuns:
        """Runs by time step and scale."""
        return {(dt, run.scale): run for dt, each in self._every.items() for run in each.runs}

    def bracket(self, dt: float) -> Bracket:
        """Return the bracket of collapse that was found with one time step.

        Args:
            dt: time step [s].

        Returns:
            Its `lower` and `upper` scales [-].
        """
        return self.searches[dt][COLLAPSE_DEFINITION]

    @property
    def _decisive(self) -> dict[float, MechanismScales]:
        """Finished searches, those with longer steps if there are no others; all if none is."""
        made = (self.searches, self.longer)
        finished = ({dt: x for dt, x in each.items() if not x.interrupted} for each in made)
        return next(filter(None, finished), self.searches)

    @property
    def _runs(self) -> list[ScaledRun]:
        """Runs of these, and of interrupted searches with shorter steps, whose falls count."""
        made = {**self._decisive, **self.searches}
        return [run for search in made.values() for run in search.runs]

    @property
    def _least_fall(self) -> float:
        """Smallest scale at which it fell with any step [-]; infinite for none."""
        return min((run.scale for run in self._runs if run.fails(COLLAPSE_DEFINITION)), default=inf)

    @property
    def lower(self) -> float:
        """Largest scale below all falls up to which each finished step came without one [-]."""
        reached = min(each[COLLAPSE_DEFINITION].lower for each in self._decisive.values())
        held = (run.scale for run in self._runs if run.fall and run.scale < self._least_fall)
        return max((scale for scale in held if scale <= reached), default=0.0)

    @property
    def moves(self) -> float:
        """Smallest scale at which failed joints let blocks move [-]; infinite for none."""
        return min((run.scale for run in self._runs if run.mechanisms.get("verified")), default=inf)

    @property
    def moves_in_all(self) -> bool:
        """Whether it moves at the smallest scale that was run, and maybe at smaller ones."""
        return self.moves == min((run.scale for run in self._runs), default=0.0)

    @property
    def states(self) -> dict[str, float]:
        """Smallest scales run at which it moves, is dislocated, and falls by any step [-].

        That of "tension" is one at which it stands, and its fill bears more of it than soil does.
        """
        scales = {"tension": _find_tension(self._runs), "moves": self.moves}
        scales = {state: at for state, at in scales.items() if at <= max(self._stood)}
        scales |= {"dislocated": self.dislocated, "falls": self._least_fall}
        return {state: scale for state, scale in scales.items() if scale < inf}

    @property
    def dislocated(self) -> float:
        """Smallest scale up to `lower` at which it was dislocated [-]; infinite for none."""
        return min((at for at, kind in self._list_held() if kind == "dislocated"), default=inf)

    @property
    def held(self) -> float:
        """Largest scale at which it stood below any at which it did not [-]; 0 for none.

        It is also below any at which an elastic fill bears more tension than soil.
        """
        return max(at for at in self._stood if at < _find_tension(self._runs))

    @property
    def _stood(self) -> list[float]:
        """Scales at which it stood below any at which it did not, whatever its fill, or 0 [-]."""
        held, end = self._list_held(), self.dislocated
        return [0.0, *(at for at, kind in held if kind == "stands" and at < end)]

    def _list_held(self) -> list[tuple[float, str]]:
        """List the scales up to `lower`, each with the state of collapse."""
        lower = self.lower
        return [(run.scale, run.fall.kind) for run in self._runs if run.fall and run.scale <= lower]

    @property
    def upper(self) -> float:
        """Scale by which it fell with all finished steps [-]; infinite if it stood with one."""
        return max(each[COLLAPSE_DEFINITION].upper for each in self._decisive.values())

    @property
    def above(self) -> tuple[float, ...]:
        """Scales at which the structure stood although it fell at a smaller scale [-]."""
        return tuple(sorted({s for dt in self.searches for s in self.bracket(dt).above}))

    @property
    def unanswered(self) -> tuple[float, ...]:
        """Scales of runs that were broken off before a state of collapse was known [-]."""
        return tuple(sorted({run.scale for run in self._runs if run.fall is None}))

    def verdict_range(self, structure: Structure, motion: Motion, **options: Any) -> VerdictRange:
        """Compute the range of verdicts over uncertain properties and over scales in the bracket.

        Args:
            structure: structure that was shaken.
            motion: unscaled motion.
            options: as for `archfem.verdict_range`; `vary` may override the range of "scale",
                which is from `lower` to `upper`, or to twice `lower` where it never fell.

        Returns:
            All runs; those of single changes are at the lower scale.

        Raises:
            InvalidInput: it fell at the smallest scale that was tried; or as `verdict_range`.
        """
        return call_late_bound("CollapseScale.verdict_range", self, structure, motion, **options)

    def rows(self) -> tuple[list[str], list[list[str]]]:
        """Return titles and cells of a row per run: varied and fixed values, state, residual."""
        rows = [
            [
                f"{1e3 * dt:g} ms",
                f"{run.scale:.3g}",
                "as given",
                fall.kind if fall else "no answer",
                f"{fall.time:.2f} s" if fall and fall.time is not None else "-",
                f"{fall.residual:.3g} m" if fall else "-",
            ]
            for dt, search in self._every.items()
            for run in search.runs
            for fall in [run.fall]
        ]
        return ["step", "scale", "properties", "the structure", "at", "residual"], rows

    def table(self) -> str:
        """Return a line per run: step, scale, state of collapse, time and residual displacement."""
        return align_columns(*self.rows())


# Searches with a time step [s] from scales on, with what was found before
SearchStep = Callable[[float, Sequence[float], MechanismScales | None], MechanismScales]


def _search_steps(search: SearchStep, steps: Sequence[float]) -> dict[float, MechanismScales]:
    """Search with each time step, and again around a fall that another one has jumped over."""
    searches: dict[float, MechanismScales] = {}
    first = 1.0
    for step in steps:
        searches[step] = search(step, [first], None)
        if searches[step].interrupted:
            return searches
        # the next search begins near this fall, and its scales lie between those of this one
        least = searches[step][COLLAPSE_DEFINITION].upper
        first = least / NEAR_RATIO**0.5 if least < inf else first
    while not searches[step].interrupted and (pair := _disagreeing(searches)):
        step, weakest = pair
        made = searches[step]
        searches[step] = search(step, [weakest.lower, weakest.upper], made)
        if searches[step].runs == made.runs:
            break
    return searches


def _admissible_step(searches: Mapping[float, MechanismScales]) -> float:
    """Return the step that follows sliding in all runs that bound a fall [s]; infinite if any."""
    if any(search.interrupted for search in searches.values()):
        return inf  # it ends here
    bounds = (run for each in searches.values() for run in _list_bounds(each, COLLAPSE_DEFINITION))
    return max(LEAST_STEP, min((run.admissible_step for run in bounds), default=inf))


def _disagreeing(searches: dict[float, MechanismScales]) -> tuple[float, Bracket] | None:
    """Return a time step that stands where another one falls, and the bracket of that, or None."""
    brackets = {dt: search[COLLAPSE_DEFINITION] for dt, search in searches.items()}
    step = max(brackets, key=lambda dt: brackets[dt].lower)
    weakest = min(brackets.values(), key=lambda bracket: bracket.upper)
    return (step, weakest) if brackets[step].lower >= weakest.upper else None


@takes_falling_analysis
@validate_arguments
def collapse_scale(
    model: Model | Analysis,
    motion: Motion,
    *,
    start: Equilibrium | None = None,
    damping: Viscous | EffectiveDamping | str | None = None,
    dt: float | Sequence[float] | None = None,
    precision: float = 0.05,
    between: tuple[float, float] = (0.1, 10.0),
    made: KeptRuns | None = None,
) -> CollapseScale:
    """Search the smallest scale of a motion at which a structure falls, among those it runs.

    Scales are searched as by `mechanism_scales`, once for each time step: a fall under a record is
    sensitive to all parameters, and a result on which two steps disagree is not reliable. A step
    that stands where another one falls is run at the scales around that fall, too. Whether a
    structure falls need not be monotonic in the scale. Hence gaps between scales are filled to a
    ratio of 1.1 from half of the smallest fall on, and of 1.05 from 0.7 of it. The ratio is
    `precision` where that is larger. The search continues below a fall found there. A window of
    falls narrower than a gap is found by chance only: for a check at one scale, run that scale.

    Args:
        model: model of large displacements, `build(…, displacements="large")`, or such an
            `Analysis`. The settings of an analysis are then the defaults, except that fill in one
            piece has one facet on each stone.
        motion: motion to scale, vertical component included.
        start: dead load, computed if not given.
        damping: as for `time_history`.
        dt: time steps, or one that is tried with its half too [s]; by default 5 ms, or shorter down
            to 0.5 ms where the runs that bound the fall slide farther than such steps follow.
        precision: relative width of the final brackets [-].
        between: smallest and largest scale [-]; no ground motion may exceed 5 g.
        made: `kept_runs` of an interrupted search with the same arguments, which continues.

    Returns:
        All runs, with the scales between which the structure falls by each step.

    Raises:
        InvalidInput: displacements are small; precision, steps or scales are out of range; or
            elastic fill bears more tension at rest than soil, so that no scale would count.
        DidNotConverge: the structure does not stand under dead load.
    """
    begin = start or dead_load(model)
    if not begin.model.large_displacements:
        raise InvalidInput(
            f"model '{begin.model.fidelity}' has small displacements: build it with "
            "displacements='large'"
        )
    refuse_fill_in_tension(begin)
    dt, shortens = OWN_STEP if dt is None else dt, dt is None
    steps = [dt, 0.5 * dt] if isinstance(dt, int | float) else [*dt]
    check_search(precision, between)
    if not steps:
        raise InvalidInput("dt = () has no step: give one or two")

    def run_scaled(step: float, scale: float) -> ScaledRun:
        if kept := (made or {}).get((step, scale)):
            return kept
        run = _run_as_far(model, motion.scaled(scale), start=begin, damping=damping, dt=step)
        met, follows = run.mechanisms, run.dataset.attrs.get("admissible_step", inf)
        return ScaledRun(scale, met, run.ending, run.outcome, run.fall, run.doubts, follows)

    limits, limit = admissible_range(between, motion), (COLLAPSE_DEFINITION,)

    def search(step: float, at: Sequence[float], found: MechanismScales | None) -> MechanismScales:
        run = partial(run_scaled, step)
        return search_scales(run, limit, precision, limits, at, found, motion.name)

    searches, longer = _search_steps(search, steps), dict[float, MechanismScales]()
    while shortens and (shorter := _admissible_step(searches)) < steps[0]:
        longer |= searches
        steps = [shorter, 0.5 * shorter]
        searches = _search_steps(search, steps)
    largest = max([limits[0], *(run.scale for x in searches.values() for run in x.runs)])
    as_one = find_first_fall(model.structure, motion, (limits[0], largest))
    return CollapseScale(searches, motion.pga, doubt_soft_blocks(model.structure), longer, as_one)
