"""Newmark and HHT-α, each step one equilibrium solve by SNES: what all strategies must equal."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.newmark import Numbers
from archfem.dynamics.steps import Batch, State, Step
from archfem.errors import DidNotConverge
from archfem.statics.newton import Newton, Solver, magnitude

HALVINGS = 8
"""Times that a step may be halved before giving up."""

Attempt = Callable[[State, float], tuple[State, int]]
"""From a state and a time step to the state after it and the iterations that took."""


class Exact:
    """Steps an equation of motion, each step solved by SNES.

    Args:
        equation: of motion.
        newton: settings of the solves.
        attempts: tries a step in one; by default `attempt`. What it gives up by `DidNotConverge`
            is tried in halves.
    """

    def __init__(
        self, equation: Equation, newton: Newton | None = None, *, attempts: Attempt | None = None
    ) -> None:
        self.equation = equation
        self._attempts = attempts or self.attempt
        self._scale = magnitude(equation.weight)
        self._solver = Solver(equation.model.size, newton)
        self._step: tuple[float, Numbers, sparse.csr_matrix] | None = None
        self._kept: tuple[sparse.csr_matrix, sparse.csr_matrix, sparse.csr_matrix] | None = None

    def steps(self, start: State, dt: float, end: float) -> Iterator[Step]:
        """Yield one step after another until the end.

        Args:
            start: state from which to go.
            dt: time between the yielded states [s].
            end: time of the last one [s].

        Raises:
            DidNotConverge: a step failed even when halved; `last` is the state before it.
        """
        state = start
        first = start.time
        for number in range(1, round((end - first) / dt) + 1):
            target = first + number * dt
            step = self._advance(state, target, 0)
            state = step.state
            yield step

    def batches(self, start: State, dt: float, end: float) -> Iterator[Batch]:
        """Yield the same steps with their resultants, in batches of one.

        Args:
            start: state from which to go.
            dt: time between the yielded states [s].
            end: time of the last one [s].

        Raises:
            DidNotConverge: a step failed even when halved; `last` is the state before it.
        """
        for step in self.steps(start, dt, end):
            yield Batch(
                np.array([step.state.time]),
                self.equation.model.resultants(step.contact)[None],
                np.array([step.iterations]),
                np.array([step.smallest]),
                step.energy[None],
                partial(_given, step.state),
            )

    def attempt(self, state: State, dt: float) -> tuple[State, int]:
        """Try a step in one.

        Args:
            state: from which it goes.
            dt: its length [s].

        Returns:
            The state after it, and how many iterations that took.

        Raises:
            DidNotConverge: there was no equilibrium to be found.
        """
        equation, (numbers, linear) = self.equation, self._prepared(dt)
        load = equation.load(state.time + numbers.share * dt)
        before = np.stack([state.q, state.velocity, state.acceleration])
        unmoved = numbers.velocity[0] @ before, numbers.acceleration[0] @ before

        def end(q: Array) -> State:
            moved = q - state.q
            velocity = numbers.velocity[1] * moved + unmoved[0]
            return State(state.time + dt, q, velocity, numbers.acceleration[1] * moved + unmoved[1])

        def unbalanced(q: Array) -> Array:
            now = _written(state, end(q), numbers.share)
            moving = equation.model.mass @ now.acceleration + equation.viscous @ now.velocity
            return np.asarray(moving + equation.model.force(equation.contact(now)) - load)

        def tangent(q: Array) -> sparse.csr_matrix:
            contact = equation.contact(_written(state, end(q), numbers.share))
            return self._tangent(contact, linear, numbers.gain)

        guess = state.q + dt * state.velocity + 0.5 * dt**2 * state.acceleration
        solved = self._solver.solve(unbalanced, tangent, guess, self._scale)
        return end(solved.q), solved.iterations

    def _prepared(self, dt: float) -> tuple[Numbers, sparse.csr_matrix]:
        """Numbers of a step, and μ M + ν R; the same objects as before while the step stays."""
        if self._step is None or abs(self._step[0] - dt) > 1e-9 * dt:
            numbers, matrix = self.equation.numbers(dt), self.equation.rest.copy()
            mass = self.equation.model.mass.data
            matrix.data = numbers.inertia * mass + numbers.rate * matrix.data
            self._step = (dt, numbers, matrix)
        return self._step[1:]

    def _tangent(self, contact: Array, linear: sparse.csr_matrix, gain: float) -> sparse.csr_matrix:
        """Tangent of a step; the same object as before while stiffness and step stay."""
        stiffness, kept = self.equation.model.tangent(contact), self._kept
        if kept is None or kept[0] is not stiffness or kept[1] is not linear:
            matrix = stiffness.copy()
            matrix.data = (stiffness.data + linear.data) / gain
            self._kept = kept = (stiffness, linear, matrix)
        return kept[2]

    def _advance(self, state: State, target: float, halvings: int) -> Step:
        """Reach a time in one step, or in halves of it where that fails."""
        dt = target - state.time
        try:
            new, iterations = self._attempts(state, dt)
        except DidNotConverge as error:
            if halvings == HALVINGS:
                raise DidNotConverge(
                    f"the step from t = {state.time:.6g} s failed, down to {dt:.3g} s ({error}): "
                    "the structure may have fallen apart; try a smaller dt or HHT",
                    last=state,
                ) from error
            first = self._advance(state, state.time + dt / 2.0, halvings + 1)
            return self._advance(first.state, target, halvings + 1).after(first)
        new = replace(new, time=target)
        ground = self.equation.motion.at(np.array([state.time, target])).mean(axis=0)
        before, after = (state.q, state.velocity), (new.q, new.velocity)
        energy = self.equation.meter.step(before, after, ground)
        return Step(new, self.equation.contact(new), iterations, dt, energy)


def _written(start: State, end: State, share: float) -> State:
    """State where the equation of a step is written, but with the acceleration at its end."""
    between = start.velocity + share * (end.velocity - start.velocity)
    return replace(end, q=start.q + share * (end.q - start.q), velocity=between)


def _given(state: State, _: int) -> State:
    """The state of a batch of one."""
    return state
