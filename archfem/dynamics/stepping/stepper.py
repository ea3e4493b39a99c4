"""The stepper: many steps at a time by a strategy, and SNES or parts for one that does not settle.

A step that a strategy gives up is SNES's, so that all strategies give one history. Where many
points hold and slide in turn SNES may find no solution either, while halves of the step have one:
those are the strategy's again, which is by far faster.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.dynamics.stepping import loop
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.exact import Exact
from archfem.dynamics.stepping.strategy import Reordered, Strategy, in_own_terms
from archfem.dynamics.steps import Batch, State, Step
from archfem.errors import DidNotConverge
from archfem.models.gauges import Gauges, MovedGauges

BATCH = 128
"""Steps between two looks at events, Ctrl-C and the progress bar."""

HALVINGS = 3
"""Times that a step which neither settles whole is halved by the strategy, before SNES does it."""


class Stepper:
    """Steps an equation of motion by a strategy, and by SNES what that gives up.

    Args:
        equation: of motion.
        strategy: takes the steps; without one SNES takes them all.
        exact: takes those that the strategy gives up; by default `Exact` of the equation.
        advance: the loop over steps that a strategy settles.
    """

    def __init__(
        self,
        equation: Equation,
        strategy: Strategy | None = None,
        *,
        exact: Exact | None = None,
        advance: Callable[..., int] = loop.advance,
    ) -> None:
        self.equation = equation
        self.strategy = strategy
        self.exact = exact or Exact(equation)
        self._advance = advance
        self._systems: dict[float, Any] = {}

    @property
    def name(self) -> str:
        """The method, as users give it."""
        return self.strategy.name if self.strategy else "snes"

    def batches(self, start: State, dt: float, end: float) -> Iterator[Batch]:
        """Yield the steps to the end, many at a time.

        Args:
            start: state from which to go.
            dt: time step [s].
            end: time of the last step [s].

        Raises:
            DidNotConverge: SNES failed as well; `last` is the state before.
        """
        if self.strategy is None:
            yield from self.exact.batches(start, dt, end)
            return
        total = round((end - start.time) / dt)
        state, done = start, 0
        while done < total:
            times = start.time + dt * np.arange(done + 1, min(done + BATCH, total) + 1)
            batch = self.taken(state, dt, times)
            if len(batch.times):
                yield batch
                done += len(batch.times)
                state = batch.state(len(batch.times) - 1)
            if len(batch.times) < len(times):
                batch = self.unsettled(state, dt)
                yield batch
                done += 1
                state = batch.state(0)

    def unsettled(self, state: State, dt: float) -> Batch:
        """Return a step that does not settle: whole by SNES, else in parts, else in parts by SNES.

        Args:
            state: from which to go.
            dt: time step [s].

        Raises:
            DidNotConverge: SNES failed in parts as well; `last` is the state before.
        """
        end, whole = state.time + dt, True
        try:
            step: Step | None = self.exact.whole(state, dt)
        except DidNotConverge:
            step, whole = self._in_parts(state, dt, HALVINGS), False
        if step is None:
            (batch,) = self.exact.batches(state, dt, end)
        else:
            batch = replace(step, state=replace(step.state, time=end)).batch
        passes = batch.iterations + loop.ITERATIONS  # those in vain count too
        return replace(batch, iterations=passes, fallback=whole or step is None)

    def _in_parts(self, state: State, dt: float, halvings: int) -> Step | None:
        """Take a step in two halves, or shorter parts of them; None if the shortest fail."""
        first = self._part(state, dt / 2.0, halvings - 1)
        if first is None:
            return None
        second = self._part(first.state, dt / 2.0, halvings - 1)
        return second and second.after(first, mean=self.equation.conserving)

    def _part(self, state: State, dt: float, halvings: int) -> Step | None:
        """Take a step at once, else in halves as often as they may be halved."""
        batch = self.taken(state, dt, np.array([state.time + dt]))
        if len(batch.times):
            passes, end = int(batch.iterations[0]), batch.state(0)
            return Step(end, batch.resultants[0], passes, dt, batch.energy[0])
        step = self._in_parts(state, dt, halvings) if halvings else None
        return step and replace(step, iterations=step.iterations + loop.ITERATIONS)

    def taken(self, state: State, dt: float, times: Array) -> Batch:
        """Return the steps by the strategy up to these times, or up to one that does not settle.

        Args:
            state: from which to go.
            dt: time step [s].
            times: ends of the steps (steps,) [s].
        """
        strategy = self.strategy
        assert strategy is not None
        room = self.prepared(state, dt, times)
        series, memories, results, *_ = room
        count = self._advance(*room)
        resultants, passes, energy = (each[:count] for each in results)
        return Batch(
            times[:count],
            resultants,
            passes,
            np.full(count, dt),
            energy,
            lambda k: self._state(float(times[k]), series[k + 1], memories[k + 1]),
            readings=self._read(series[1 : count + 1, 0]),
        )

    def _state(self, time: float, vectors: Array, memory: Array) -> State:
        """A state, from the strategy's own terms."""
        assert self.strategy is not None
        q, velocity, acceleration = self.strategy.leave(vectors)
        remembered = memory if self.equation.remembers else None
        return State(time, q, velocity, acceleration, remembered)

    @cached_property
    def _gauges(self) -> tuple[sparse.csr_matrix | Array, Array | None] | MovedGauges:
        """Of the model: in the strategy's own terms where they are a matrix, and its offset."""
        assert self.strategy is not None
        gauges, mass = Gauges.on(self.equation.model), self.equation.model.mass
        if isinstance(gauges, MovedGauges):
            return gauges
        offset = gauges.offset if gauges.offset.any() else None
        return in_own_terms(self.strategy, gauges.matrix, mass), offset

    def _read(self, displacements: Array) -> Array:
        """Readings (steps, r), from displacements in the strategy's own terms (steps, m)."""
        if isinstance(self._gauges, MovedGauges):
            assert isinstance(self.strategy, Reordered)
            return self._gauges.over(self.strategy.left(displacements))
        matrix, offset = self._gauges
        readings: Array = (matrix @ np.ascontiguousarray(displacements.T)).T
        return readings if offset is None else readings + offset

    def prepared(self, state: State, dt: float, times: Array) -> tuple[Any, ...]:
        """Return what `loop.advance` takes to go from a state to these times.

        Args:
            state: from which to go.
            dt: time step [s].
            times: ends of the steps (steps,) [s].
        """
        assert self.strategy is not None
        steps, joints = len(times), len(self.equation.model.structure.joints)
        first = self.strategy.enter(np.stack([state.q, state.velocity, state.acceleration]))
        series = np.empty((steps + 1, *first.shape))
        series[0] = first
        memories = np.zeros((steps + 1, self.equation.remembers))
        if state.memory is not None and self.equation.remembers:
            memories[0] = state.memory
        passes = np.zeros(steps, dtype=np.int64)
        results = (np.empty((steps, joints, 3)), passes, np.empty((steps, 4)))
        if dt not in self._systems:
            self._systems[dt] = self.strategy.system(dt)
        return series, memories, results, self.equation.ground(times, dt), self._systems[dt]
