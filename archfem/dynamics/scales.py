"""By what factor a ground motion must be multiplied for the first mechanism, by each definition."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np
from tqdm import tqdm

from archfem.annotated import as_annotated
from archfem.dynamics.events import EveryMechanism, possible_counts
from archfem.dynamics.falling.verdict import LOST, Fall
from archfem.dynamics.history import Ending, history_of
from archfem.dynamics.schemes import Viscous
from archfem.dynamics.stepping.stepper import Stepper
from archfem.dynamics.time_history import time_history
from archfem.dynamics.verdicts import DEFINITIONS, first_mechanisms
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.limit.counted import Mechanism
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.motion.signals import LARGEST_PEAK
from archfem.statics.equilibrium import Equilibrium, dead_load
from archfem.tables import aligned

logger = logging.getLogger("archfem")

RUNG = sqrt(2.0)
"""Ratio of two scales on the ladder that is climbed before bisection."""

RUNS = 40
"""Most runs of one search; four definitions to five per cent take about fifteen."""


COLLAPSE = "collapse"
"""What is looked for where displacements may be large: that the structure falls."""


@dataclass(frozen=True)
class ScaledRun:
    """One run of a search.

    Attributes:
        scale: factor on the motion [-].
        found: the first mechanism by each definition, or None.
        ended: how the run ended.
        outcome: the same in words.
        fall: what the run has left of a structure whose displacements may be large.
    """

    scale: float
    found: dict[str, Mechanism | None]
    ended: Ending
    outcome: str
    fall: Fall | None = None

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the run, which then tells only what it met."""
        return self.ended is Ending.INTERRUPTED

    @property
    def broken(self) -> bool:
        """Whether a step had no equilibrium, which counts as failed."""
        return self.ended is Ending.FAILED

    @property
    def fell(self) -> bool:
        """Whether the structure, or a part of it, has fallen."""
        return self.fall is not None and self.fall.kind in LOST

    def fails(self, definition: str) -> bool:
        """Return whether a mechanism was met, or the run broke off.

        Args:
            definition: of a mechanism, one of `DEFINITIONS`, or `COLLAPSE`.
        """
        met = self.fell if definition == COLLAPSE else self.found[definition] is not None
        return met or self.broken

    def survives(self, definition: str) -> bool:
        """Return whether the whole motion passed without a mechanism.

        Args:
            definition: of a mechanism, one of `DEFINITIONS`.
        """
        return not self.fails(definition) and not self.interrupted


@dataclass(frozen=True)
class Bracket:
    """Between which scales a mechanism begins.

    Failing need not be monotonic in the scale: the smallest that was found to fail counts.

    Attributes:
        lower: largest scale below `upper` found to survive [-]; 0 where none is.
        upper: smallest scale found to fail [-]; infinite where none is.
        run: that at `upper`, or None.
        above: scales beyond `upper` that survived all the same.
    """

    lower: float
    upper: float
    run: ScaledRun | None
    above: tuple[float, ...]

    @property
    def ratio(self) -> float:
        """How far apart the bounds are, 1 for not at all; infinite where one is missing."""
        return self.upper / self.lower if self.lower > 0.0 else inf


@dataclass(frozen=True)
class MechanismScales:
    """What a search for the scales at first mechanism found; `scales[definition]` is a bracket.

    Attributes:
        asked: definitions that the structure has joints for.
        runs: all that were made, in order of their scales.
        interrupted: whether Ctrl-C ended the search.
    """

    asked: tuple[str, ...]
    runs: tuple[ScaledRun, ...] = ()
    interrupted: bool = False

    def with_run(self, run: ScaledRun) -> "MechanismScales":
        """Return these and one run more.

        Args:
            run: at a scale not yet tried.
        """
        runs = sorted([*self.runs, run], key=lambda each: each.scale)
        return MechanismScales(self.asked, tuple(runs), run.interrupted)

    def __getitem__(self, definition: str) -> Bracket:
        """The bracket of one of `DEFINITIONS`; without bounds where it was not asked for."""
        if definition not in self.asked:
            return Bracket(0.0, inf, None, ())
        failing = [run for run in self.runs if run.fails(definition)]
        surviving = [run.scale for run in self.runs if run.survives(definition)]
        upper = failing[0].scale if failing else inf
        return Bracket(
            max((scale for scale in surviving if scale < upper), default=0.0),
            upper,
            failing[0] if failing else None,
            tuple(scale for scale in surviving if scale > upper),
        )

    def table(self) -> str:
        """One line a definition: its bracket, and the mechanism at its upper end."""
        head = ["mechanism", "survives", "fails", "class", "at", "part", "note"]
        return aligned(head, [self._row(definition) for definition in DEFINITIONS])

    def _row(self, definition: str) -> list[str]:
        bracket = self[definition]
        found = bracket.run.found[definition] if bracket.run else None
        notes = []
        if bracket.run and found is None:
            notes.append(bracket.run.outcome)
        if definition not in self.asked:
            notes.append("has no such joints")
        if bracket.above:
            notes.append("survives also " + ", ".join(f"{scale:.3g}" for scale in bracket.above))
        return [
            definition,
            f"{bracket.lower:.3g}" if bracket.lower else "-",
            f"{bracket.upper:.3g}" if bracket.run else "-",
            found.kind if found else "-",
            f"{found.time:.3f} s" if found and found.time is not None else "-",
            found.part if found else "-",
            "; ".join(notes) or "-",
        ]


@as_annotated
def mechanism_scales(  # noqa: PLR0913  (what `time_history` takes, and the search)
    model: Model,
    motion: Motion,
    *,
    start: Equilibrium | None = None,
    damping: Viscous | None = None,
    dt: float | None = None,
    criteria: Criteria | None = None,
    precision: float = 0.05,
    between: tuple[float, float] = (0.05, 5.0),
    method: str | Callable[[Motion], Stepper] = "auto",
) -> MechanismScales:
    """Find the least factor on a motion at which each definition of a mechanism is first met.

    Incremental dynamic analysis: scales go down from 1 by a factor √2 until nothing is met and up
    until everything is, then brackets are halved. Each run tells of all definitions, and ends once
    all are met. A run without equilibrium counts as failed. Ctrl-C ends the search and keeps what
    is known.

    Args:
        model: any rung of the ladder.
        motion: multiplied as a whole, vertical component included.
        start: the dead load, found first where it is not given.
        damping: as for `time_history`.
        dt: time step [s], likewise.
        criteria: as for `time_history`.
        precision: relative width of the last brackets [-].
        between: least and largest scale tried [-]; no ground motion may exceed 5 g.
        method: as for `time_history`, or what makes a stepper for each scaled motion.

    Returns:
        Brackets, mechanisms and runs; at most 40 runs are made.

    Raises:
        InvalidInput: precision or scales cannot be meant.
        DidNotConverge: the structure does not stand under dead load.

    References:
        Vamvatsikos and Cornell, Earthq. Eng. Struct. Dyn. 31 (2002) 491-514.
    """
    if not 1e-4 <= precision <= 1.0 or not 0.0 < between[0] <= between[1]:
        raise InvalidInput(
            f"precision {precision:g} between scales {between}: give 0.0001 to 1, and two scales "
            "above 0, the smaller first"
        )
    start = start or dead_load(model)
    least, largest = between

    def shaken(scale: float) -> ScaledRun:
        scaled = motion.scaled(scale)
        try:
            run = time_history(
                model,
                scaled,
                start=start,
                damping=damping,
                dt=dt,
                until=EveryMechanism(),
                criteria=criteria,
                method=method if isinstance(method, str) else method(scaled),
            )
        except DidNotConverge as error:
            run = history_of(error)
        return ScaledRun(scale, first_mechanisms(run), run.ended, run.outcome)

    asked = (*possible_counts(model.structure, criteria), "verified")
    return search(
        shaken, asked, precision, (least, max(least, min(largest, largest_scale(motion))))
    )


def largest_scale(motion: Motion) -> float:
    """Return the largest factor by which a motion may be multiplied: none is stronger than 5 g [-].

    Args:
        motion: all of its components count.
    """
    peak = max(float(np.abs(motion.component(name)).max()) for name in motion.components)
    return LARGEST_PEAK / peak if peak > 0.0 else inf


def search(
    shaken: Callable[[float], ScaledRun],
    asked: tuple[str, ...],
    precision: float,
    between: tuple[float, float],
) -> MechanismScales:
    """Make runs until all brackets are narrow, as `mechanism_scales` does.

    Args:
        shaken: makes the run at a scale.
        asked: definitions to find brackets for, of `DEFINITIONS`.
        precision: relative width of the last brackets [-].
        between: least and largest scale tried [-].

    Returns:
        Brackets, mechanisms and runs; at most 40 runs are made.
    """
    found = MechanismScales(asked)
    try:
        with tqdm(unit="run", disable=None, leave=False, desc="scales") as bar:
            while (scale := _next(found, precision, between)) is not None:
                bar.set_postfix_str(f"× {scale:.3g}")
                found = found.with_run(shaken(scale))
                bar.update()
    except KeyboardInterrupt:
        found = replace(found, interrupted=True)
    if found.interrupted:
        logger.warning("interrupted after %d runs: what is known is kept", len(found.runs))
    return found


def _next(found: MechanismScales, precision: float, between: tuple[float, float]) -> float | None:
    """The scale to try next, or None where nothing more is to be learnt."""
    runs, (least, largest) = found.runs, between
    if not runs:
        return min(max(1.0, least), largest)
    if len(runs) >= RUNS or found.interrupted:
        return None
    brackets = [found[definition] for definition in found.asked]
    if runs[0].scale > least and any(bracket.lower == 0.0 for bracket in brackets):
        return max(runs[0].scale / RUNG, least)
    if runs[-1].scale < largest and any(bracket.run is None for bracket in brackets):
        return min(runs[-1].scale * RUNG, largest)
    wide = [each for each in brackets if 1.0 + precision < each.ratio < inf]
    if not wide:
        return None
    widest = max(wide, key=lambda bracket: bracket.ratio)
    return sqrt(widest.lower * widest.upper)
