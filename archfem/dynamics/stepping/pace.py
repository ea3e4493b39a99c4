"""Steps as long as an error in the eccentricity of the joints allows.

An averaged force is its value at the middle of the step, but for ¹/₂₄ Δt² of its curvature in time.
So the second difference of the resultants from step to step, ¼ Δt² f'' and more where vibration is
not resolved, tells what a step does not see, and costs nothing: it is taken of M / (N h), with N
at least half of that under dead load, and the worst joint of rings and piers counts.
Steps whose error is too large are taken again, half as long; where it is small they become twice as
long. They are the record's own, halved or doubled, so that a step never ends between two samples
unless it is shorter than they are apart.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.stepping.stepper import Stepper
from archfem.dynamics.steps import Batch, State

SHORTEST, LONGEST = 1e-4, 2e-2
"""Steps that are not halved, and not doubled, any more [s]."""

SEEN = 6.0
"""Second difference of an eccentricity, of the error in its largest value: between 2 and 30 in the
rings, columns and bridge tried."""

EASY = 0.1
"""Error of a step, of that allowed, below which the next may be twice as long."""

FEW = 32
"""Steps taken before their errors are looked at."""

LEAST = 0.5
"""Compression that joints are taken to have at least, of that under dead load [-]."""


@dataclass(eq=False)
class Pace:
    """Steps of their own length, by a stepper.

    Attributes:
        stepper: takes them.
        tolerance: of |e| of every joint of rings and piers [-].
        first: the start, as a batch of one.
        unmet: steps so far that err by more though they are the shortest.
        taken: steps so far.
    """

    stepper: Stepper
    tolerance: float
    first: Batch
    unmet: int = 0
    taken: int = 0
    _seen: list[tuple[float, Array]] = field(default_factory=list)

    def __post_init__(self) -> None:
        structure = self.stepper.equation.model.structure
        judged = structure.judged if structure.judged.any() else np.ones_like(structure.judged)
        self._judged, self._depths = np.flatnonzero(judged), structure.depths[judged]
        rest = self.first.resultants[0, self._judged, 0]
        self._least = LEAST * np.maximum(rest, np.mean(np.abs(rest)) * LEAST)

    @property
    def unmet_share(self) -> float:
        """Part of the steps that err by more than the tolerance though they are the shortest."""
        return self.unmet / max(self.taken, 1)

    def batches(self, start: State, end: float) -> Iterator[Batch]:
        """Yield the steps to the end, some at a time.

        Args:
            start: state from which to go.
            end: time of the last step [s].

        Raises:
            DidNotConverge: a step failed though it is the shortest; `last` is the state before.
        """
        sample = self.stepper.equation.motion.dt
        finest = int(np.floor(np.log2(SHORTEST / sample) + 0.5))
        coarsest = max(int(np.floor(np.log2(LONGEST / sample))), finest)
        tick, level, done = sample * 2.0**finest, 0, 0
        level = min(max(-finest - 1, 0), coarsest - finest)
        total, state = round((end - start.time) / tick), start
        while done < total:
            while level > 0 and (done % 2**level or done + 2**level > total):
                level -= 1
            count = min(FEW, (total - done) // 2**level)
            ends = start.time + tick * (done + 2**level * np.arange(1, count + 1))
            batch, worst = self._tried(state, tick * 2**level, ends, level == 0)
            if batch is None:
                level -= 1
                continue
            done += 2**level * len(batch.times)
            state = batch.state(len(batch.times) - 1)
            yield batch
            if len(batch.times) < count and level > 0:
                level -= 1
            elif worst < EASY * self.tolerance and level < coarsest - finest:
                level += 1

    def _tried(
        self, state: State, dt: float, ends: Array, last: bool
    ) -> tuple[Batch | None, float]:
        """Steps before one that errs too much, and their largest error; all if they are the last.

        Returns:
            Without steps None, and infinity: then even the first errs too much.
        """
        batch = self._taken(state, dt, ends, last)
        if batch is None:
            return None, np.inf
        errors = self._errors(batch)
        good = len(errors) if last else int(np.argmax(np.append(errors, np.inf) > self.tolerance))
        if good == 0:
            return None, np.inf
        self.taken += good
        self.unmet += int(np.sum(errors[:good] > self.tolerance))
        middles = batch.times - 0.5 * dt
        scaled = self._scaled(batch.resultants[max(good - 2, 0) : good])
        self._seen += list(zip(middles[max(good - 2, 0) : good], scaled, strict=True))
        self._seen = self._seen[-2:]
        return batch.cut(good), float(errors[:good].max())

    def _taken(self, state: State, dt: float, ends: Array, last: bool) -> Batch | None:
        """Steps by the strategy, or one it does not settle; None where a shorter may be easier."""
        stepper = self.stepper
        if stepper.strategy is not None:
            batch = stepper.taken(state, dt, ends)
            if len(batch.times):
                return batch
            if not last:
                return None
            return replace(stepper.unsettled(state, dt), times=ends[:1])
        (batch,) = stepper.exact.batches(state, dt, state.time + dt)
        return replace(batch, times=ends[:1])

    def _scaled(self, resultants: Array) -> Array:
        """M / (N h) of the joints that are judged (steps, joints)."""
        normal, moment = resultants[:, self._judged, 0], resultants[:, self._judged, 2]
        e: Array = moment / (np.maximum(normal, self._least) * self._depths)
        return e

    def _errors(self, batch: Batch) -> Array:
        """Errors of the steps in |e| of the worst joint (steps,)."""
        dt = batch.smallest[0]
        middles = batch.times - 0.5 * dt
        before, values = self._seen, self._scaled(batch.resultants)
        times = np.append([time for time, _ in before], middles)
        values = np.concatenate([*(value[None] for _, value in before), values])
        errors = np.zeros(len(times))
        if len(times) > 2:
            slopes = np.diff(values, axis=0) / np.diff(times)[:, None]
            bends = 2.0 * np.diff(slopes, axis=0) / (times[2:] - times[:-2])[:, None]
            errors[2:] = dt**2 * np.abs(bends).max(axis=1) / SEEN
        return errors[len(before) :]
