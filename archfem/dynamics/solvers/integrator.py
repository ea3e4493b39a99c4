"""Time integrator: many steps at a time by a solver, with fall-back to SNES or shorter steps.

A step that a solver gives up is taken by SNES, so that all solvers give one history. Where many
points stick and slide in turn, whole corrections by SNES cycle as well, while halves of the step
converge. The solver takes these again, ten times faster than line searches of SNES, which are
left to steps that do not converge in halves either.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.dynamics.solvers import base
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.snes import SnesSolver
from archfem.dynamics.state import Batch, State, Step
from archfem.errors import DidNotConverge


class Stepper:
    """Steps an equation of motion by a solver, and by SNES where that gives up.

    Args:
        equation: equation of motion.
        solver: takes the steps; without one SNES takes them all.
        exact: takes those that the solver gives up; by default `SnesSolver` of the equation.
        advance: the loop over steps that a solver converges in.
    """

    def __init__(
        self,
        equation: Equation,
        solver: base.StepSolver | None = None,
        *,
        exact: SnesSolver | None = None,
        advance: Callable[..., int] = base.advance,
    ) -> None:
        self.equation = equation
        self.solver = solver
        self.exact = exact or SnesSolver(equation)
        self._advance = advance
        self._systems: dict[float, Any] = {}

    @property
    def name(self) -> str:
        """The method, as users give it."""
        return self.solver.name if self.solver else "snes"

    def batches(self, start: State, dt: float, end: float) -> Iterator[Batch]:
        """Yield the steps to the end, many at a time.

        Args:
            start: state before the first step.
            dt: time step [s].
            end: time of the last step [s].

        Raises:
            DidNotConverge: SNES failed as well; `last` is the state before.
        """
        if self.solver is None:
            yield from self.exact.batches(start, dt, end)
            return
        total = round((end - start.time) / dt)
        # steps between two checks of events, Ctrl-C and the progress bar: more of small systems;
        # few at first, as steps after an event, or those in which Ctrl-C comes, are lost
        state, done, size, most = start, 0, 128, min(max(128, 65536 // len(start.q)), 512)
        while done < total:
            last = min(done + size, total)
            size = min(2 * size, most)
            times = start.time + dt * np.arange(done + 1, last + 1)
            batch = self.advance_batch(state, dt, times)
            if len(batch.times):
                yield batch.with_readings(self.equation.model.observer())
                done += len(batch.times)
                state = batch.state(len(batch.times) - 1)
            if len(batch.times) < len(times):
                batch = self.fallback_step(state, dt)
                yield batch
                done += 1
                state = batch.state(0)

    def fallback_step(self, state: State, dt: float) -> Batch:
        """Return a step that the solver gives up: by SNES, else in parts, else in parts by SNES.

        Args:
            state: before the step.
            dt: time step [s].

        Raises:
            DidNotConverge: SNES failed in parts as well; `last` is the state before.
        """
        end, whole = state.time + dt, True
        try:
            step: Step | None = self.exact.whole(state, dt, searches=1)
        except DidNotConverge:
            # three halvings at most, after which SNES halves further
            step, whole = self._in_parts(state, dt, 3), False
        if step is None:
            (batch,) = self.exact.batches(state, dt, end)
        else:
            batch = replace(step, state=replace(step.state, time=end)).batch
        iterations = batch.iterations + base.MAX_ITERATIONS  # those of the solver count, too
        return replace(batch, iterations=iterations, fallback=whole or step is None)

    def _in_parts(self, state: State, dt: float, halvings: int) -> Step | None:
        """Take a step in two halves, or shorter parts of them; None if the shortest fail."""
        first = self._part(state, dt / 2.0, halvings - 1)
        if first is None:
            return None
        second = self._part(first.state, dt / 2.0, halvings - 1)
        return second and second.appended_to(first, mean=self.equation.conserving)

    def _part(self, state: State, dt: float, halvings: int) -> Step | None:
        """Take a step at once, else in halves as often as they may be halved."""
        batch = self.advance_batch(state, dt, np.array([state.time + dt]))
        if len(batch.times):
            iterations, end = int(batch.iterations[0]), batch.state(0)
            return Step(end, batch.resultants[0], iterations, dt, batch.energy[0])
        step = self._in_parts(state, dt, halvings) if halvings else None
        return step and replace(step, iterations=step.iterations + base.MAX_ITERATIONS)

    def advance_batch(self, state: State, dt: float, times: Array) -> Batch:
        """Return the steps by the solver up to these times, or to one that does not converge.

        Args:
            state: before the first step.
            dt: time step [s].
            times: ends of the steps (steps,) [s].
        """
        arrays = self.allocate_batch(state, dt, times)
        series, memories, results, *_ = arrays
        count = self._advance(*arrays)
        resultants, iterations, energy, faces = (each[:count] for each in results)
        return Batch(
            times[:count],
            resultants,
            iterations,
            np.full(count, dt),
            energy,
            lambda k: self._state(float(times[k]), series[k + 1], memories[k + 1]),
            q=series[1 : count + 1, 0].take(self._place, axis=1),
            faces=faces if faces.size else None,
        )

    def _state(self, time: float, vectors: Array, memory: Array) -> State:
        """Return a state from the vectors of the solver."""
        q, velocity, acceleration = vectors[:, self._place]
        return State(time, q, velocity, acceleration, memory if self.equation.memory_size else None)

    @cached_property
    def _place(self) -> NDArray[Any]:
        """Place of each coordinate in the order of the solver (n,)."""
        assert self.solver is not None
        return np.argsort(self.solver.order)

    def allocate_batch(self, state: State, dt: float, times: Array) -> tuple[Any, ...]:
        """Return the arguments of `base.advance` for the steps to these times.

        Args:
            state: before the first step.
            dt: time step [s].
            times: ends of the steps (steps,) [s].
        """
        assert self.solver is not None
        steps, joints = len(times), len(self.equation.model.structure.joints)
        series = np.empty((steps + 1, 3, len(state.q)))
        series[0] = np.stack([state.q, state.velocity, state.acceleration])[:, self.solver.order]
        memories = np.zeros((steps + 1, self.equation.memory_size))
        if state.memory is not None and self.equation.memory_size:
            memories[0] = state.memory
        iterations = np.zeros(steps, dtype=np.int64)
        if dt not in self._systems:
            self._systems[dt] = self.solver.system(dt)
        faces = np.empty((steps, 3 if self.solver.measures_faces else 0, joints))
        results = np.empty((steps, joints, 3)), iterations, np.empty((steps, 4)), faces
        return series, memories, results, self.equation.ground(times, dt), self._systems[dt]
