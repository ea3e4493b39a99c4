"""Solver "snes": every scheme, each step one equilibrium solve by PETSc's SNES.

Its histories are the reference that all other solvers reproduce to rounding.
"""

from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import replace

import numpy as np
from scipy import sparse

from archfem._typing import Array
from archfem.dynamics.schemes import HHT, check_friction_scheme
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.newmark import StepNumbers
from archfem.dynamics.state import Batch, State, Step
from archfem.errors import DidNotConverge, InvalidInput
from archfem.models.model import ModelStep
from archfem.statics.newton import (
    CONVEX_SEARCHES,
    EquilibriumSolver,
    Newton,
    Solution,
    load_magnitude,
)

# Function that solves a step from a state and a time step; a third argument limits the searches
Attempt = Callable[..., Step]


class SnesSolver:
    """Steps an equation of motion, each step solved by SNES.

    Args:
        equation: equation of motion.
        newton: settings of the solves.
        attempts: solves a step as a whole; by default by the formulas of the scheme. Where it
            raises `DidNotConverge` the step is halved.
    """

    def __init__(
        self, equation: Equation, newton: Newton | None = None, *, attempts: Attempt | None = None
    ) -> None:
        self.equation = equation
        self._attempts = attempts or (self.averaged if equation.conserving else self.attempt)
        self._scale = load_magnitude(equation.weight)
        self._solver = EquilibriumSolver(equation.model.size, newton)
        self._step: tuple[float, StepNumbers, sparse.csr_matrix] | None = None
        self._matrix: tuple[sparse.csr_matrix, sparse.csr_matrix, sparse.csr_matrix] | None = None

    def steps(self, start: State, dt: float, end: float) -> Iterator[Step]:
        """Yield the steps to the end, one after another.

        Args:
            start: state before the first step.
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
            start: state before the first step.
            dt: time between the yielded states [s].
            end: time of the last one [s].

        Raises:
            DidNotConverge: a step failed even when halved; `last` is the state before it.
        """
        for step in self.steps(start, dt, end):
            yield step.batch

    def whole(self, state: State, dt: float, searches: int = 2) -> Step:
        """Return a step that is not halved.

        Args:
            state: before the step.
            dt: its length [s].
            searches: number of line searches that are tried; the first takes whole corrections.

        Raises:
            DidNotConverge: SNES finds no equilibrium.
        """
        return self._attempts(state, dt, searches)

    def attempt(self, state: State, dt: float, searches: int = 2) -> Step:
        """Return a step of Newmark's method or HHT that is not halved.

        Args:
            state: before the step.
            dt: its length [s].
            searches: number of line searches that are tried; the first takes whole corrections.

        Returns:
            The step, with the resultants at its end.

        Raises:
            DidNotConverge: SNES finds no equilibrium.
        """
        equation, (numbers, linear) = self.equation, self._step_matrix(dt)
        model, share, (rates, rate) = equation.model, numbers.share, numbers.velocity
        before = np.stack([state.q, state.velocity, state.acceleration])
        # velocity, where the equation is written, and acceleration if nothing is displaced
        still = (1.0 - share) * state.velocity + share * (rates @ before)
        fading = numbers.acceleration[0] @ before
        load = equation.load(state.time + share * dt)
        load = load - model.mass @ fading - equation.viscous @ still

        def contact(moved: Array) -> Array:
            # u + β v, where the equation is written
            along = share * (1.0 + equation.lag * rate)
            return np.asarray(state.q + equation.lag * still + along * moved)

        def residual(q: Array) -> Array:
            moved = q - state.q
            return np.asarray(linear @ moved + model.force(contact(moved)) - load)

        def tangent(q: Array) -> sparse.csr_matrix:
            return self._tangent(contact(q - state.q), linear, numbers.gain)

        guess = state.q + dt * state.velocity + 0.5 * dt**2 * state.acceleration
        tried = CONVEX_SEARCHES[:searches]
        solved = self._solver.solve(residual, tangent, guess, self._scale, tried)
        moved = solved.q - state.q
        velocity = rate * moved + rates @ before
        acceleration = numbers.acceleration[1] * moved + fading
        new = State(state.time + dt, solved.q, velocity, acceleration)
        ground = equation.motion.at(np.array([state.time, state.time + dt])).mean(axis=0)
        energy = equation.step_energy(state, new, ground)
        resultants = model.resultants(equation.contact(new))
        return Step(new, resultants, solved.iterations, dt, energy)

    def averaged(self, state: State, dt: float, searches: int = 2) -> Step:
        """Return a step of the conserving scheme that is not halved.

        Args:
            state: before the step.
            dt: its length [s].
            searches: number of line searches that are tried; the first takes whole corrections.

        Returns:
            The step, with the resultants on its mean.

        Raises:
            DidNotConverge: SNES finds no equilibrium.
        """
        equation, (numbers, linear) = self.equation, self._step_matrix(dt)
        model = equation.with_memory(state)
        ground = equation.ground(np.array([state.time + dt]), dt)[0, 0]
        # the mean velocity is that of the displacement; without one, v is stopped and reversed
        stopped = model.mass @ (2.0 / dt * state.velocity)
        load = equation.weight - model.mass_influence @ ground + stopped

        def solve_passage(passage: ModelStep, guess: Array) -> Solution:
            def residual(q: Array) -> Array:
                return np.asarray(linear @ (q - state.q) + passage.force(q) - load)

            def tangent(q: Array) -> sparse.csr_matrix:
                matrix = passage.tangent(q)
                matrix.data = matrix.data + linear.data
                return matrix

            # without an energy where joints slide: down the residual
            tried = (("basic", "bt") if equation.memory_size else CONVEX_SEARCHES)[:searches]
            try:
                return self._solver.solve(residual, tangent, guess, self._scale, tried)
            except DidNotConverge:  # an impact of stiff joints: the velocity leads too far
                if searches == 1:
                    raise
                return self._solver.solve(residual, tangent, state.q, self._scale, ("cp",))

        passage = model.begin_step(state.q, equation.lag / dt)
        passage, solution = _solve_with_teeth(passage, solve_passage, state.q + dt * state.velocity)
        q, moved = solution.q, solution.q - state.q
        memory, velocity = passage.updated_memory(q), numbers.velocity[1] * moved - state.velocity
        new = State(state.time + dt, q, velocity, (velocity - state.velocity) / dt, memory)
        lost = passage.dissipation(q) + float(moved @ (equation.viscous @ moved)) / dt
        work = -float(moved @ (model.mass_influence @ ground))
        energy = equation.energy(new) + np.array([0.0, 0.0, work, lost])
        return Step(new, passage.resultants(q), solution.iterations, dt, energy)

    def _step_matrix(self, dt: float) -> tuple[StepNumbers, sparse.csr_matrix]:
        """Return numbers of a step, and the derivative of inertia and drag by its displacement.

        They are the same objects as before while the length of the step stays.
        """
        if self._step is None or abs(self._step[0] - dt) > 1e-9 * dt:
            numbers, matrix = self.equation.numbers(dt), self.equation.viscous.copy()
            inertia = numbers.acceleration[1] * self.equation.model.mass.data
            matrix.data = inertia + numbers.share * numbers.velocity[1] * matrix.data
            self._step = (dt, numbers, matrix)
        return self._step[1:]

    def _tangent(self, contact: Array, linear: sparse.csr_matrix, gain: float) -> sparse.csr_matrix:
        """Return the tangent of a step; the same object as long as stiffness and step are."""
        stiffness, last = self.equation.model.tangent(contact), self._matrix
        if last is None or last[0] is not stiffness or last[1] is not linear:
            matrix = copy(stiffness)
            matrix.data = stiffness.data / gain + linear.data
            self._matrix = last = (stiffness, linear, matrix)
        return last[2]

    def _advance(self, state: State, target: float, halvings: int) -> Step:
        """Return a step to a time, as a whole or in halves."""
        dt = target - state.time
        try:
            step = self._attempts(state, dt)
        except DidNotConverge as error:
            if halvings == 8:  # 1/256 of the step
                raise DidNotConverge(
                    f"the step from t = {state.time:.6g} s failed, down to {dt:.3g} s ({error}): "
                    f"the structure may have fallen apart; {self._remedy()}",
                    last=state,
                ) from error
            first = self._advance(state, state.time + dt / 2.0, halvings + 1)
            second = self._advance(first.state, target, halvings + 1)
            return second.appended_to(first, mean=self.equation.conserving)
        return replace(step, state=replace(step.state, time=target))

    def _rounding_share(self) -> float:
        """Return the force of the stiffest joint by rounding of positions, over the weight [-]."""
        structure = self.equation.model.structure
        stiffness = max(
            joint.contact.normal_stiffness * depth
            for joint, depth in zip(structure.joints, structure.depths, strict=True)
        )
        rounding = float(np.finfo(float).eps) * structure.size
        return rounding * stiffness * structure.width / structure.weight

    def _remedy(self) -> str:
        """Return a remedy where steps fail: damping by the scheme only where it applies."""
        model, scheme = self.equation.model, HHT()
        stiffest, admissible = self._rounding_share(), 1e-6
        if stiffest > admissible:
            # neither shorter steps nor damping make positions more accurate
            return (
                f"joints are so stiff that the rounding of positions changes their forces by "
                f"{stiffest:.1g} of the weight: divide their stiffness by "
                f"{stiffest / admissible:.0f} or more, or take rigid blocks, "
                "dynamics.RigidBlockSimulation"
            )
        try:
            check_friction_scheme(scheme, model.structure)
        except InvalidInput:
            return "try a smaller dt"
        if model.large_displacements or isinstance(self.equation.scheme, HHT):
            return "try a smaller dt"
        return f"try a smaller dt, or scheme={scheme}"


def _solve_with_teeth(
    passage: ModelStep, solve: Callable[[ModelStep, Array], Solution], guess: Array
) -> tuple[ModelStep, Solution]:
    """Alternate between solving a step and its dilatancy opening until that stays; return both."""
    iterations, alternations = 0, 60
    for _ in range(alternations):
        solution = solve(passage, guess)
        guess, iterations = solution.q, iterations + solution.iterations
        following = passage.with_dilatancy(guess)
        if following is passage:
            return passage, replace(solution, iterations=iterations)
        passage = following
    raise DidNotConverge(f"saw teeth of joints that slide do not converge in {alternations} turns")
