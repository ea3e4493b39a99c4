"""Scale of a ground motion at the first mechanism, or at collapse of the structure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from math import inf
from typing import Any

from archfem._display import call_late_bound
from archfem._files import align_columns
from archfem._validation import validate_arguments, validate_methods
from archfem.dynamics.analysis import Analysis, takes_analysis, takes_falling_analysis
from archfem.dynamics.collapse_state import FALLEN_STATES, doubt_soft_blocks, name_stones
from archfem.dynamics.events import EveryMechanism, applicable_definitions
from archfem.dynamics.fall import state_rigid_falls
from archfem.dynamics.history import Ending, History, first_mechanisms, partial_history
from archfem.dynamics.monitor import refuse_fill_in_tension
from archfem.dynamics.recorder import Record
from archfem.dynamics.rigid_body import rocking_body
from archfem.dynamics.scale_search import (
    COLLAPSE_DEFINITION,
    FILLED_SHARE,
    NEAR_RATIO,
    NOT_VARIED,
    Bracket,
    KeptRuns,
    MechanismScales,
    ScaledRun,
    check_search,
    doubt_searches,
    find_tension,
    list_bounds,
    say_bracket,
    search_scales,
)
from archfem.dynamics.schemes import EffectiveDamping, Viscous
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.time_history import LEAVE_OUT, OR_LEAVE_OUT, time_history
from archfem.dynamics.verdict import ROCKS_SOFTLY
from archfem.dynamics.verdict_range import VerdictRange
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.masonry.structure import Structure, join_names
from archfem.models.model import Doubt, Model
from archfem.motion.motion import Motion, admissible_range
from archfem.statics.equilibrium import Equilibrium, dead_load
from archfem.units import Ends

# State of a run that says nothing of a fall
NO_ANSWER = "no answer"

# Step of a search that is given none, and the least to which it is shortened for sliding [s]
OWN_STEP, LEAST_STEP = 0.005, 0.0005


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


def _shake_until_lost(shake: Callable[..., History]) -> tuple[History, bool]:
    """Return a run, which ends once a block is lost for good, and whether it is whole."""
    run = shake(record=Record(whole_fall=False))
    if "fall_step" not in run.dataset.attrs:  # no block became loose
        return run, True
    fell = run.fall is not None and run.fall.kind in FALLEN_STATES
    if fell or run.ending is Ending.INTERRUPTED:
        return run, False
    return shake(), True  # where none was lost, several lengths of steps count


@validate_methods
@dataclass(frozen=True)
class CollapseScale:
    """Scales of a motion between which a structure falls, searched with several time steps.

    A structure has fallen once its `CollapseState` is "partly fallen" or "fallen". A run that is
    broken off counts neither as a fall nor as standing, and no bracket rests on it. Only falls and
    dislocations count of `longer` steps, and of a step whose search was interrupted, unless no step
    has a finished search. The response need not be monotonic: it may survive a motion stronger than
    one that brought it down, and fall at a scale between two at which it stood.

    Attributes:
        searches: runs made, by time step [s].
        pga: peak of the motion [m/s²].
        of_model: doubts that concern every run, whatever its scale.
        longer: runs made before, with steps too long for sliding; none of them counts as standing.
        as_one: first fall of a stack as one rigid body; None of other structures.
    """

    searches: dict[float, MechanismScales]
    pga: float | None = None
    of_model: tuple[Doubt, ...] = ()
    longer: dict[float, MechanismScales] = field(default_factory=dict)
    as_one: rocking_body.FirstFall | None = None

    @property
    def sentence(self) -> str:
        """Scales around the fall, and the least at which it is dislocated, in words."""
        (least, last), met = self.first_falls, "falls at no scale that was tried"
        if least < inf:
            met = f"falls at {rocking_body.say_scale(least, self.pga)}"
        elif unanswered := [run.scale for run in self._runs if run.fall is None]:
            none = f"{len(unanswered)} have none, the first at {min(unanswered):#.3g} ×"
            met = f"falls in no run that has an answer ({none})"
        if least < last:
            at = f"first at {last:#.3g} ×" if last < inf else "at no scale"
            ends = {dt: each[COLLAPSE_DEFINITION].upper for dt, each in self._finished.items()}
            met = f"{met}, by steps of {1e3 * max(ends, key=ends.__getitem__):g} ms {at}"
        shorter = min(self.bracket(dt).upper for dt in self.searches)
        if least < shorter < inf:  # by steps too long for sliding
            met = f"{met}, by those that follow sliding at {shorter:#.3g} ×"
        if self.above:
            met = f"{met}, and {rocking_body.say_again(self.above)}"
        if self.dislocated < inf:
            met = f"dislocated at {self.dislocated:#.3g} ×{self.dislocated_stones}, {met}"
        if self.moves <= max(self._stood):
            met = f"a mechanism at {self.moves:#.3g} ×{' or less' * self.moves_in_all}, {met}"
        said, first = say_bracket("stands", self, met), self.as_one
        if first is None:
            return said
        rocks = f"rocks from {first.rocks:#.3g} × on and " * (first.rocks < inf)
        falls = rocking_body.describe_first_fall(first, self.pga)
        one = f"as one rigid body without crushing it {rocks}{falls}"
        return f"{one}; in courses it {said}" if first.scale < least else f"{said}; {one}"

    def __repr__(self) -> str:
        """Return the sentence, how closely scales were run, and what was varied."""
        steps = join_names([f"{1e3 * dt:g}" for dt in sorted(self._every, reverse=True)])
        varied = f"; varied were the scale and the time step ({steps} ms), and {NOT_VARIED}"
        return f"{self.sentence}{self._say_tested()}{varied}"

    @property
    def mechanism(self) -> str:
        """Joints by which it falls at the smallest such scale, in words; "" if unknown."""
        least, _ = self.first_falls
        falls = (run.fall for run in self._runs if run.scale == least)
        by = next((fall.mechanism for fall in falls if fall and fall.mechanism), "")
        return f"at {least:#.3g} × it falls {by}" if by else ""

    def _say_tested(self) -> str:
        """Return in words how closely scales were run up to `lower`; "" where none stands."""
        stood = sorted({scale for scale, _ in self._list_held()})
        # from that share of the smallest fall on the search has filled them
        top = min(self.first_falls[0], max((run.scale for run in self._runs), default=inf))
        gaps = [gap for gap in pairwise(stood) if gap[1] >= FILLED_SHARE * top]
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
        low, high = self.first_falls
        if len(self._finished) > 1 and _disagreeing(self._finished):
            words = f"its time steps find the first fall at {Ends((low, high)):#.3g} × the motion"
            if high == inf:
                words = f"a time step finds a fall at {low:#.3g} ×, and another none"
            doubts.append(Doubt(words))  # ranges of several motions are none of steps
        every = {
            dt: replace(search, runs=(run, *self._stand_again(search)))
            for dt, search in self.longer.items()
            if (run := search[COLLAPSE_DEFINITION].run) and run.scale == low
        }
        every |= self.searches
        searches = {f"by {1e3 * dt:g} ms": search for dt, search in every.items()}
        of_runs = doubt_searches(searches, COLLAPSE_DEFINITION)
        doubts += [x for x in of_runs if replace(x, place="") not in self.of_model]
        whole = (run for run in self._runs if run.fails(COLLAPSE_DEFINITION) and run.whole)
        falls = [(run.scale, run.doubts) for run in whole]
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
    def _finished(self) -> dict[float, MechanismScales]:
        """Finished searches, those with longer steps first; all if none is."""
        finished = {dt: each for dt, each in self._every.items() if not each.interrupted}
        return finished or self.searches

    @property
    def _decisive(self) -> dict[float, MechanismScales]:
        """Finished searches, those with longer steps only if there are no others."""
        return {dt: x for dt, x in self._finished.items() if dt in self.searches} or self._finished

    @property
    def _runs(self) -> list[ScaledRun]:
        """Runs of these, and of interrupted searches; of longer steps falls and dislocations."""
        made, longer = {**self._decisive, **self.searches}, self.longer.values()
        moved = (x for each in longer for x in each.runs if x.fall and x.fall.kind != "stands")
        return [*(run for search in made.values() for run in search.runs), *moved]

    @property
    def first_falls(self) -> tuple[float, float]:
        """Smallest scale at which any run fell, and the largest first fall of a finished step [-].

        They are infinite for none. Steps too long for sliding are among these.
        """
        falls = (run.scale for run in self._runs if run.fails(COLLAPSE_DEFINITION))
        finished = (each[COLLAPSE_DEFINITION].upper for each in self._finished.values())
        return min(falls, default=inf), max(finished, default=inf)

    @property
    def lower(self) -> float:
        """Largest scale below all falls up to which each finished step came without one [-]."""
        reached = min(each[COLLAPSE_DEFINITION].lower for each in self._decisive.values())
        least, _ = self.first_falls
        held = (run.scale for run in self._runs if run.fall and run.scale < least)
        return max((scale for scale in held if scale <= reached), default=0.0)

    @property
    def moves(self) -> float:
        """Smallest scale at which failed or soft joints let blocks move [-]; infinite for none."""
        moving = (
            run.scale
            for run in self._runs
            if run.mechanisms.get("verified") or any(x.words == ROCKS_SOFTLY for x in run.doubts)
        )
        return min(moving, default=inf)

    @property
    def moves_in_all(self) -> bool:
        """Whether it moves at the smallest scale that was run, and maybe at smaller ones."""
        return self.moves == min((run.scale for run in self._runs), default=0.0)

    @property
    def states(self) -> dict[str, float]:
        """Smallest scales run at which it moves, is dislocated, and falls by any step [-].

        That of "tension" is one at which it stands, and its fill bears more of it than soil does.
        """
        scales = {"tension": find_tension(self._runs), "moves": self.moves}
        scales = {state: at for state, at in scales.items() if at <= max(self._stood)}
        scales |= {"dislocated": self.dislocated, "falls": self.first_falls[0]}
        return {state: scale for state, scale in scales.items() if scale < inf}

    @property
    def dislocated(self) -> float:
        """Smallest scale up to `lower` at which it was dislocated [-]; infinite for none."""
        return min((at for at, kind in self._list_held() if kind == "dislocated"), default=inf)

    @property
    def dislocated_stones(self) -> str:
        """Names of the stones that were dislocated at that scale, in brackets; "" for none."""
        falls = (run.fall for run in self._runs if run.scale == self.dislocated)
        return name_stones([*dict.fromkeys(x for fall in falls if fall for x in fall.blocks)])

    @property
    def held(self) -> float:
        """Largest scale at which it stood below any at which it did not [-]; 0 for none.

        It is also below any at which an elastic fill bears more tension than soil.
        """
        return max(at for at in self._stood if at < find_tension(self._runs))

    @property
    def held_in_doubt(self) -> float:
        """Largest scale at which it stood below any at which it did not, whatever its fill [-]."""
        return max(self._stood)

    @property
    def held_by_all(self) -> float:
        """Largest such scale by every time step, also of a search that Ctrl-C ended; 0 for none."""
        least = self.held
        for search in self.searches.values() if self.interrupted else ():
            runs = [(x.scale, bool(x.fall and x.fall.kind == "stands")) for x in search.runs]
            failed = min((scale for scale, stood in runs if not stood), default=inf)
            least = min(least, max((x for x, stood in runs if stood and x < failed), default=0.0))
        return least

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
        """Scale by which it fell with each finished step that follows sliding, or infinite [-]."""
        return max(each[COLLAPSE_DEFINITION].upper for each in self._decisive.values())

    @property
    def above(self) -> tuple[float, ...]:
        """Scales at which the structure stood although it fell at a smaller scale [-].

        Those of longer steps are below the scale by which it fell with each of the shorter ones.
        """
        found = {x.scale for each in self.longer.values() for x in self._stand_again(each)}
        return tuple(sorted(found.union(*(self.bracket(dt).above for dt in self.searches))))

    def _stand_again(self, longer: MechanismScales) -> list[ScaledRun]:
        """List the runs of a longer step that stand above a fall, below `upper`."""
        above = [x for x in longer[COLLAPSE_DEFINITION].above if x < self.upper]
        return [run for run in longer.runs if run.scale in above]

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
                f"{fall.kind}{fall.dislocated_stones}" if fall else NO_ANSWER,
                f"{fall.time:.2f} s" if fall and fall.time is not None else "-",
                f"{fall.residual:.3g} m" if fall and run.whole else "-",
            ]
            for dt, search in self._every.items()
            for run, x in ((run, run.fall) for run in search.runs)
            # a fall that was not followed may be of more parts
            for fall in [x and (x if run.whole else replace(x, kind="loses a block"))]
        ]
        return ["step", "scale", "properties", "the structure", "at", "residual"], rows

    def table(self) -> str:
        """Return a line per run: step, scale, state of collapse, time and residual displacement."""
        return align_columns(*self.rows())


# Searches with a time step [s] from scales on, with what was found before
SearchStep = Callable[[float, Sequence[float], MechanismScales | None], MechanismScales]


def _search_steps(
    search: SearchStep, steps: Sequence[float], shortens: bool
) -> dict[float, MechanismScales]:
    """Search with each time step, and again around a fall that another one has jumped over.

    A first step that is too long for sliding ends it, where shorter ones come after.
    """
    searches: dict[float, MechanismScales] = {}
    first = 1.0
    for step in steps:
        searches[step] = search(step, [first], None)
        too_long = shortens and _admissible_step(searches) < steps[0]
        if searches[step].interrupted or too_long:
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


def _choose_shorter(run: ScaledRun, is_chosen: bool) -> ScaledRun:
    """Return a run with remedies that give another step, if the search has chosen its own."""
    if not is_chosen:
        return run
    given = (
        (x, x.remedy.replace(LEAVE_OUT, "give shorter ones by analysis.dt")) for x in run.doubts
    )
    doubts = (replace(x, remedy=remedy.removesuffix(OR_LEAVE_OUT)) for x, remedy in given)
    return replace(run, doubts=tuple(doubts))


def _admissible_step(searches: Mapping[float, MechanismScales]) -> float:
    """Return the step that follows sliding in all runs that bound a fall [s]; infinite if any."""
    if any(search.interrupted for search in searches.values()):
        return inf  # it ends here
    bounds = (run for each in searches.values() for run in list_bounds(each, COLLAPSE_DEFINITION))
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

    known = dict[tuple[float, float], ScaledRun]()

    def run_scaled(step: float, scale: float) -> ScaledRun:
        key = step, scale
        again = known.get(key)  # to its end
        if (kept := again or (made or {}).get(key)) and (kept.whole or again is None):
            return known.setdefault(key, kept)
        # one that hardly falls is not broken off first
        held = (run.scale for run in known.values() if run.survives(COLLAPSE_DEFINITION))
        to_end = again or scale <= max(held, default=0.0)
        given = {"start": begin, "damping": damping, "dt": step}
        shake = partial(_run_as_far, model, motion.scaled(scale), **given)
        run, whole = (shake(), True) if to_end else _shake_until_lost(shake)
        met, follows = run.mechanisms, run.dataset.attrs.get("admissible_step", inf)
        # one too small to matter does not move the structure
        met = {name: found and found.decisive for name, found in met.items()}
        ended = run.ending, run.outcome, run.fall, run.doubts, follows, whole
        known[key] = _choose_shorter(ScaledRun(scale, met, *ended), shortens)
        return known[key]

    limits, limit = admissible_range(between, motion), (COLLAPSE_DEFINITION,)

    def search(step: float, at: Sequence[float], found: MechanismScales | None) -> MechanismScales:
        run = partial(run_scaled, step)
        return search_scales(run, limit, precision, limits, at, found, motion.name)

    searches, longer = _search_steps(search, steps, shortens), dict[float, MechanismScales]()
    while shortens and (shorter := _admissible_step(searches)) < steps[0]:
        longer |= searches
        steps = [shorter, 0.5 * shorter]
        searches = _search_steps(search, steps, shortens)
    largest = max([limits[0], *(run.scale for x in searches.values() for run in x.runs)])
    as_one = rocking_body.find_first_fall(model.structure, motion, (limits[0], largest))
    return CollapseScale(searches, motion.pga, doubt_soft_blocks(model.structure), longer, as_one)
