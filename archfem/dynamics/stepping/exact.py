"""Every scheme, each step one equilibrium solve by SNES: what all strategies must equal."""

from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import replace

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.newmark import Numbers
from archfem.dynamics.steps import Batch, State, Step
from archfem.errors import DidNotConverge
from archfem.models.model import Passage
from archfem.statics.newton import CONVEX, SLIDING, Newton, Solved, Solver, magnitude

HALVINGS = 8
"""Times that a step may be halved before giving up."""

TURNS = 60
"""In which a step and the rise of its saw teeth are found, one from the other."""

Attempt = Callable[[State, float], Step]
"""From a state and a time step to the step."""


class Exact:
    """Steps an equation of motion, each step solved by SNES.

    Args:
        equation: of motion.
        newton: settings of the solves.
        attempts: tries a step in one; by default as the scheme has it. What it gives up by
            `DidNotConverge` is tried in halves.
    """

    def __init__(
        self, equation: Equation, newton: Newton | None = None, *, attempts: Attempt | None = None
    ) -> None:
        self.equation = equation
        self._attempts = attempts or (self.averaged if equation.conserving else self.attempt)
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
            yield step.batch

    def whole(self, state: State, dt: float) -> Step:
        """Return one step, not halved.

        Args:
            state: from which it goes.
            dt: its length [s].

        Raises:
            DidNotConverge: there was no equilibrium to be found.
        """
        return self._attempts(state, dt)

    def attempt(self, state: State, dt: float) -> Step:
        """Try a step of Newmark's method or HHT in one.

        Args:
            state: from which it goes.
            dt: its length [s].

        Returns:
            The step, with the resultants at its end.

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
        new = end(solved.q)
        ground = equation.motion.at(np.array([state.time, state.time + dt])).mean(axis=0)
        ends = (state.q, state.velocity), (new.q, new.velocity)
        energy = equation.meter.step(*ends, ground)
        resultants = equation.model.resultants(equation.contact(new))
        return Step(new, resultants, solved.iterations, dt, energy)

    def averaged(self, state: State, dt: float) -> Step:
        """Try a step of the conserving scheme in one.

        Args:
            state: from which it goes.
            dt: its length [s].

        Returns:
            The step, with the resultants on its mean.

        Raises:
            DidNotConverge: there was no equilibrium to be found.
        """
        equation, (numbers, linear) = self.equation, self._prepared(dt)
        model = equation.remembering(state)
        ground = equation.ground(np.array([state.time + dt]), dt)[0, 0]
        load = equation.weight - model.body @ ground
        gain = numbers.velocity[1]

        def speed(q: Array) -> Array:
            return np.asarray(gain * (q - state.q) - state.velocity)

        def solved(passage: Passage, guess: Array) -> Solved:
            def unbalanced(q: Array) -> Array:
                change, drag = (speed(q) - state.velocity) / dt, 0.5 * (speed(q) + state.velocity)
                moving = model.mass @ change + equation.viscous @ drag
                return np.asarray(moving + passage.force(q) - load)

            def tangent(q: Array) -> sparse.csr_matrix:
                matrix = passage.tangent(q)
                matrix.data = matrix.data + linear.data / numbers.gain
                return matrix

            searches = SLIDING if equation.remembers else CONVEX
            return self._solver.solve(unbalanced, tangent, guess, self._scale, searches)

        passage = model.passage(state.q, equation.lag / dt)
        passage, found = _raised(passage, solved, state.q + dt * state.velocity)
        q, moved = found.q, found.q - state.q
        memory, velocity = passage.remembered(q), speed(q)
        new = State(state.time + dt, q, velocity, (velocity - state.velocity) / dt, memory)
        lost = passage.lost(q) + float(moved @ (equation.viscous @ moved)) / dt
        work = -float(moved @ (model.body @ ground))
        energy = equation.energy(new) + np.array([0.0, 0.0, work, lost])
        return Step(new, passage.resultants(q), found.iterations, dt, energy)

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
            matrix = copy(stiffness)
            matrix.data = (stiffness.data + linear.data) / gain
            self._kept = kept = (stiffness, linear, matrix)
        return kept[2]

    def _advance(self, state: State, target: float, halvings: int) -> Step:
        """Reach a time in one step, or in halves of it where that fails."""
        dt = target - state.time
        try:
            step = self._attempts(state, dt)
        except DidNotConverge as error:
            if halvings == HALVINGS:
                raise DidNotConverge(
                    f"the step from t = {state.time:.6g} s failed, down to {dt:.3g} s ({error}): "
                    "the structure may have fallen apart; try a smaller dt or HHT",
                    last=state,
                ) from error
            first = self._advance(state, state.time + dt / 2.0, halvings + 1)
            second = self._advance(first.state, target, halvings + 1)
            return second.after(first, mean=self.equation.conserving)
        return replace(step, state=replace(step.state, time=target))


def _raised(
    passage: Passage, solve: Callable[[Passage, Array], Solved], guess: Array
) -> tuple[Passage, Solved]:
    """Solve a step by turns with where its saw teeth end; at once where there are none."""
    iterations = 0
    for _ in range(TURNS):
        found = solve(passage, guess)
        guess, iterations = found.q, iterations + found.iterations
        following = passage.raising(guess)
        if following is passage:
            return passage, replace(found, iterations=iterations)
        passage = following
    raise DidNotConverge(f"saw teeth of joints that slide do not settle in {TURNS} turns")


def _written(start: State, end: State, share: float) -> State:
    """State where the equation of a step is written, but with the acceleration at its end."""
    between = start.velocity + share * (end.velocity - start.velocity)
    return replace(end, q=start.q + share * (end.q - start.q), velocity=between)
