"""Steps of adaptive length, controlled by errors in the eccentricity and the slip of the joints.

The mean force over a step is its value at the middle, but for ¹/₂₄ Δt² of its curvature in time.
The second difference of the resultants from step to step therefore estimates the error, at no cost.
It is taken of M / (N h), with N at least half of that under dead load; the worst joint of rings and
piers counts. The slip may err in a step by a share of the joint's depth (`dynamics.slip_error`).
Steps with too large an error are repeated at half the length; where the error is small the length
is doubled. Lengths are those of the record, halved or doubled: steps end between two samples only
if they are shorter than these are apart.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from archfem._typing import Array
from archfem.dynamics.slip_error import SlipError, least_compression, second_derivatives
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.state import Batch, State

# Error of the slip in one step over the joint's depth, and over the tolerance on |e| [-]. A block
# that slides under ten motions then errs by at most 0.5 % of its way to and fro
SLIP_TOLERANCE = 4e-4


@dataclass(eq=False)
class AdaptiveStepper:
    """Steps of adaptive length by a stepper."""

    stepper: Stepper
    tolerance: float  # of |e| of every joint of rings and piers [-]
    first: Batch  # the start, as a batch of one
    slip_error: SlipError  # of the steps so far
    unmet: int = 0  # shortest steps so far with a larger error
    taken: int = 0  # steps so far
    _last: list[tuple[float, Array]] = field(default_factory=list)

    def __post_init__(self) -> None:
        structure = self.stepper.equation.model.structure
        judged = structure.judged if structure.judged.any() else np.ones_like(structure.judged)
        self._judged, self._depths = np.flatnonzero(judged), structure.depths[judged]
        self._least = least_compression(self.first.resultants[0, self._judged, 0], structure)
        self._slip_limits = SLIP_TOLERANCE * structure.depths[self.slip_error.joints]

    @property
    def unmet_share(self) -> float:
        """Share of the steps whose error exceeds the tolerance at the shortest length."""
        return self.unmet / max(self.taken, 1)

    def batches(self, start: State, end: float) -> Iterator[Batch]:
        """Yield the steps from a state to a time [s], between two checks of their errors."""
        model, sample = self.stepper.equation.model, self.stepper.equation.motion.dt
        shortest, longest = 1e-4, 2e-2  # not halved, and not doubled, any more [s]
        finest = int(np.floor(np.log2(shortest / sample) + 0.5))
        coarsest = max(int(np.floor(np.log2(longest / sample))), finest)
        tick, done = sample * 2.0**finest, 0
        level = min(max(-finest - 1, 0), coarsest - finest)
        total, state = round((end - start.time) / tick), start
        while done < total:
            while level > 0 and (done % 2**level or done + 2**level > total):
                level -= 1
            # 32 steps between two checks of the error; SNES takes one at a time
            count = min(32 if self.stepper.solver is not None else 1, (total - done) // 2**level)
            # an odd number of steps so far is made even, so that the length can be doubled
            if count > 1 and (done // 2**level + count) % 2 == 1:
                count -= 1
            ends = start.time + tick * (done + 2**level * np.arange(1, count + 1))
            batch, worst = self._try_steps(state, tick * 2**level, ends, level == 0)
            if batch is None:
                level -= 1
                continue
            done += 2**level * len(batch.times)
            state = batch.state(len(batch.times) - 1)
            yield batch if batch.q is None else batch.with_readings(model.observer())
            if len(batch.times) < count and level > 0:
                level -= 1
            elif worst < 0.1 * self.tolerance and level < coarsest - finest:
                level += 1

    def _try_steps(
        self, state: State, dt: float, ends: Array, last: bool
    ) -> tuple[Batch | None, float]:
        """Return the steps before the first with too large an error, and their largest error.

        All are returned if they are the `last`, which cannot be shorter; None without any.
        """
        batch = self._take_steps(state, dt, ends, last)
        if batch is None:
            return None, np.inf
        slips = self.slip_error.estimate(batch)
        of_slips = (slips / self._slip_limits).max(axis=1, initial=0.0)
        errors = np.maximum(self._errors(batch), of_slips)
        good = len(errors) if last else int(np.argmax(np.append(errors, np.inf) > self.tolerance))
        if good == 0:
            return None, np.inf
        batch = batch.cut(good)
        self._add(batch, errors[:good])
        return batch, float(errors[:good].max())

    def judge(self, batch: Batch) -> None:
        """Add the errors of steps of a constant length."""
        self.slip_error.estimate(batch)
        self._add(batch, self._errors(batch))

    def _add(self, batch: Batch, errors: Array) -> None:
        """Add steps with their errors."""
        self.taken += len(errors)
        self.unmet += int(np.sum(errors > self.tolerance))
        middles = batch.times[-2:] - 0.5 * batch.smallest_step[-2:]
        scaled = self._scale_moments(batch.resultants[-2:])
        self._last = [*self._last, *zip(middles, scaled, strict=True)][-2:]
        self.slip_error.add(batch)

    def _take_steps(self, state: State, dt: float, ends: Array, last: bool) -> Batch | None:
        """Return steps by the solver, or a fall-back step; None where shorter ones may converge."""
        stepper = self.stepper
        if stepper.solver is not None:
            batch = stepper.advance_batch(state, dt, ends)
            if len(batch.times):
                return batch
            if not last:
                return None
            return replace(stepper.fallback_step(state, dt), times=ends[:1])
        (batch,) = stepper.exact.batches(state, dt, state.time + dt)
        return replace(batch, times=ends[:1])

    def _scale_moments(self, resultants: Array) -> Array:
        """Return M / (N h) of the joints of rings and piers (steps, joints)."""
        normal, moment = resultants[:, self._judged, 0], resultants[:, self._judged, 2]
        e: Array = moment / (np.maximum(normal, self._least) * self._depths)
        return e

    def _errors(self, batch: Batch) -> Array:
        """Return the error of each step in |e| of the worst joint (steps,)."""
        dt = batch.smallest_step[0]
        middles = batch.times - 0.5 * dt
        before, values = self._last, self._scale_moments(batch.resultants)
        times = np.append([time for time, _ in before], middles)
        values = np.concatenate([*(value[None] for _, value in before), values])
        # the second difference is 2 to 30 times the error of the largest |e| in the rings, columns
        # and bridge examined
        bends = second_derivatives(times, values)[len(before) :]
        errors: Array = dt**2 * np.abs(bends).max(axis=1) / 6.0
        return errors
