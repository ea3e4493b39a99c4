"""Carry out what a case describes: limit analysis, dead load, runs; go on where one was ended."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import xarray as xr

from archfem.cases.case import Case
from archfem.cases.inputs import inputs_digest
from archfem.cases.kept import HISTORY, finished
from archfem.cases.reportable import Reportable
from archfem.cases.told import told_of
from archfem.dynamics.damping import effective_range, first_effective
from archfem.dynamics.events import CountedMechanism
from archfem.dynamics.history import Ending, History, history_of
from archfem.dynamics.ladder import Damping, choose
from archfem.dynamics.schemes import EffectiveDamping, Rayleigh, StiffnessDamping, Viscous
from archfem.dynamics.stepping.stepper import Stepper
from archfem.dynamics.time_history import Record, time_history
from archfem.errors import DidNotConverge
from archfem.limit.collapse import Collapse
from archfem.models.build import build
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.equilibrium import Equilibrium, dead_load
from archfem.statics.plausible import dead_load_doubts
from archfem.statics.strength import strength_use

if TYPE_CHECKING:
    from archfem.cases.dossier.results import Results

FRAMES = 10
"""Steps between two fields that are kept for an animation, unless the case says otherwise."""

Shake = Callable[[Case, Motion, Equilibrium, Viscous | None], History]
"""Runs a motion of a case from its dead load, with damping, as `shaken` does."""


@dataclass(frozen=True, eq=False)
class Rest:
    """A case under its dead load, from which its runs start.

    What follows from the dead load is worked out when first asked for, and once.

    Attributes:
        case: what was asked.
        dead: the equilibrium.
        seconds: that finding it took [s].
    """

    case: Case
    dead: Equilibrium
    seconds: float = 0.0

    @classmethod
    def of(cls, case: Case) -> "Rest":
        """Return a case with its dead load, as found by `at_rest`.

        Args:
            case: what was asked.
        """
        start = perf_counter()
        dead = at_rest(case)
        return cls(case, dead, perf_counter() - start)

    @cached_property
    def use(self) -> xr.Dataset | None:
        """Stress in the blocks and use of their strength, as by `strength_use`; None if rigid."""
        model = self.dead.model
        return None if model.cells.stress is None else strength_use(model, self.dead.q)

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """What makes the dead load doubtful, its model's rung included, a sentence each."""
        return (*self.dead.model.doubts, *dead_load_doubts(self.dead, self.case.criteria.friction))

    @cached_property
    def damping(self) -> tuple[Viscous | None, str]:
        """Damping of the runs, and in words how it was found, as by `damping_of`."""
        return damping_of(self.case, self.dead)


@dataclass(frozen=True, eq=False)
class Run(Reportable):
    """A case under one motion.

    Attributes:
        case: what was asked, with this motion alone.
        motion: as it was applied.
        history: what happened, also where a step failed or Ctrl-C ended it.
        path: file of the history; None where it was not to be kept.
        kept: whether an earlier command had finished it.
        seconds: that it took [s]; zero where it was kept.
        error: of the step that failed, if one did.
    """

    case: Case
    motion: Motion
    history: History
    path: Path | None = None
    kept: bool = False
    seconds: float = 0.0
    error: DidNotConverge | None = None

    def results(self) -> "Results":
        """Return what its report is written from."""
        from archfem.cases.dossier.results import Results  # loads matplotlib, which is slow

        folder = None if self.path is None else self.path.parent
        return Results(self.case, {self.motion.name: self.history}, folder)


Result = Collapse | Rest | Suite | Run
"""What carrying out a case finds."""


def carried_out(
    case: Case,
    folder: str | Path | None = None,
    *,
    pairs: Collection[str] | None = None,
    shake: Shake | None = None,
) -> Iterator[Result]:
    """Carry out a case, and give each result as soon as it is found.

    Where there is a folder, each history is kept in it, one motion's as history.nc, that of a pair
    in a folder of the pair's name. A pair that an earlier call has finished, of the same case and
    under the same motion, is taken from there, so that the same call again goes on where one was
    ended. A step that fails ends its run only; Ctrl-C ends the run, which is still given, and with
    it the suite.

    Args:
        case: what is asked.
        folder: for the histories; None keeps none.
        pairs: names of the pairs of its suite that are run; None for all.
        shake: runs a motion; by default `shaken`.

    Yields:
        A `Collapse` where the case asks for limit analysis; a `Rest`, the dead load; where there
        is a suite, the `Suite`; and for each motion a `Run`.

    Raises:
        InvalidInput: a motion cannot be read, or a structure not be taken as rigid blocks.
        DidNotConverge: the structure does not stand, a motion cannot be matched, or not even the
            first step of a run could be made.
    """
    shake, folder = shake or shaken, None if folder is None else Path(folder)
    (case if pairs is None else case.alone(*pairs)).check_ground()
    if case.limit is not None:
        yield case.limit.of(case.structure)
    rest = Rest.of(case)
    yield rest
    if case.suite is not None:
        suite = (case if pairs is None else case.alone(*pairs)).ground_suite()
        yield suite
        for motion in suite.motions:
            run = _of_pair(rest, motion, folder, shake)
            yield run
            if run.history.ended is Ending.INTERRUPTED:
                break
    elif case.motion is not None:
        path = None if folder is None else folder / HISTORY
        yield _run(case, case.ground_motion(), rest, path, shake)


def at_rest(case: Case) -> Equilibrium:
    """Return the dead load of a case, on the model that it names.

    With fidelity "auto" the model is chosen for the case's own motion, or the first of its suite.

    Args:
        case: what was asked.

    Raises:
        DidNotConverge: the structure does not stand.
    """
    model = _chosen(case) if case.chooses else build(case.structure, case.discretisation)
    return dead_load(model, stages=case.stages)


def _chosen(case: Case) -> Model:
    """Choose a model for the runs to come, by the case's motion where it has one."""
    motion = None
    if case.motion is not None:
        motion = case.ground_motion()
    elif case.suite is not None:
        first = next(iter(case.suite["pairs"]))  # the others need not be matched for this
        motion = case.alone(first).ground_suite().motions[0]
    damping, dt = expected_damping(case), case.analysis.get("dt")
    displacements = case.discretisation.displacements
    return choose(case.structure, case.tolerance, motion, damping, dt, displacements=displacements)


def expected_damping(case: Case) -> Damping:
    """Return the damping of a case whose model is not chosen yet.

    Args:
        case: what was asked.

    Returns:
        What the case says, or a function that finds it of the finest model.
    """
    if isinstance(case.damping, EffectiveDamping):
        return lambda model: damping_of(case, dead_load(model))[0]
    return case.damping


def damping_of(case: Case, dead: Equilibrium) -> tuple[Viscous | None, str]:
    """Return the damping of a case about its dead load, and in words how it was found.

    Args:
        case: what was asked.
        dead: its dead load.

    Raises:
        InvalidInput: it is to be that of the effective modes, and fewer than two are.
    """
    damping, how = case.damping, ""
    if isinstance(damping, EffectiveDamping):
        damping, how = _found(damping, dead)
    if damping is None:
        return None, "damping: none"
    ratio = f"damping: {100.0 * damping.ratio:g} % at"
    if isinstance(damping, StiffnessDamping):
        return damping, f"{ratio} {damping.frequency:.2f} Hz, proportional to stiffness{how}"
    low, high = damping.frequencies
    return damping, f"{ratio} {low:.2f} and {high:.2f} Hz{how}"


def _found(wanted: EffectiveDamping, dead: Equilibrium) -> tuple[Viscous, str]:
    """Damping by effective modes about a dead load, and in words which modes they are."""
    if wanted.kind == "rayleigh":
        ends = effective_range(dead.model, dead, share=wanted.share)
        return Rayleigh(wanted.ratio, ends.frequencies, wanted.joints), f"; {ends.text}"
    first = first_effective(dead.model, dead)
    return StiffnessDamping(wanted.ratio, first.frequency, wanted.joints), f"; {first.text}"


def shaken(
    case: Case,
    motion: Motion,
    dead: Equilibrium,
    damping: Viscous | None = None,
    *,
    method: str | Stepper = "auto",
) -> History:
    """Return the time history of a case under a motion; the history carries the case.

    Args:
        case: tells steps, scheme, damping, and what to record.
        motion: of the ground.
        dead: where it starts.
        damping: as by `damping_of`, which is asked where it is not given.
        method: as for `time_history`.

    Raises:
        DidNotConverge: a step failed; `history` is the record up to it.
    """
    output = case.output
    of_case = {"case": case.text(), "inputs": inputs_digest(case.settings, case.folder)}
    animated = FRAMES if output.get("animation", False) else None
    try:
        with told_of(case.title, motion.name):
            run = time_history(
                dead.model,
                motion,
                dt=case.analysis.get("dt"),
                start=dead,
                damping=damping or damping_of(case, dead)[0],
                scheme=case.scheme,
                record=Record(
                    every=output.get("every", 1), fields_every=output.get("fields_every", animated)
                ),
                until=CountedMechanism() if case.analysis.get("halt", False) else None,
                criteria=case.criteria,
                method=method,
            )
    except DidNotConverge as error:
        if error.history is not None:
            error.history.dataset.attrs |= of_case
        raise
    run.dataset.attrs |= of_case
    return run


def _of_pair(rest: Rest, motion: Motion, folder: Path | None, shake: Shake) -> Run:
    """Run a pair, or take what an earlier command left of it."""
    case = rest.case.alone(motion.name)
    path = None if folder is None else folder / motion.name / HISTORY
    if path is not None and (history := finished(path, case, motion)) is not None:
        chosen = rest.dead.model.prediction  # by the first pair, which this one may not be
        if chosen is None or history.dataset.attrs.get("predicted_error") == chosen.error:
            return Run(case, motion, history, path, kept=True)
    return _run(case, motion, rest, path, shake)


def _run(case: Case, motion: Motion, rest: Rest, path: Path | None, shake: Shake) -> Run:
    """Run a motion and keep its history, also where a step fails."""
    start, failure = perf_counter(), None
    try:
        history = shake(case, motion, rest.dead, rest.damping[0])
    except DidNotConverge as error:
        history, failure = history_of(error), error
    seconds = perf_counter() - start
    doubts = dict.fromkeys((*rest.doubts, *history.doubts))
    history.dataset.attrs["doubts"] = "\n".join(doubts)
    if path is not None:
        history.save(path)
    return Run(case, motion, history, path, seconds=seconds, error=failure)
