"""Time stepping: Newmark and HHT-α, each step one equilibrium solve.

With u the displacements relative to the ground, at every step

    M a + C v + f(u + β_c v) = p - M r a_g,

f the internal forces of blocks and joints, p the self-weight. Stiffness-proportional damping is
written as f(u + β v), so that the joint's dashpot acts only where the joint is closed,
t_n = k_n <g + β ġ>_-: a continuous law, whose energy stays convex. Damping on a constant matrix
(the initial stiffness, or that of the blocks alone) enters through C.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem.energy import Meter
from archfem.errors import DidNotConverge
from archfem.models import Model
from archfem.motion import Motion
from archfem.newton import Newton, Solver, magnitude
from archfem.schemes import Newmark, Rayleigh, Scheme
from archfem.states import Batch, State, Step
from archfem.statics import self_weight
from archfem.structure import Array

HALVINGS = 8
"""Times that a step may be halved before giving up."""


class Stepper:
    """Advances a model under a ground motion, each step solved by SNES."""

    name = "snes"

    def __init__(
        self,
        model: Model,
        motion: Motion,
        *,
        damping: Rayleigh | None = None,
        scheme: Scheme | None = None,
        newton: Newton | None = None,
    ) -> None:
        self.model = model
        self.motion = motion
        self.scheme = scheme or Newmark()
        self.lag = damping.stiffness if damping and damping.joints == "closed" else 0.0
        self.damping = _damping_matrix(model, damping)
        self.weight = self_weight(model)
        self._scale = magnitude(self.weight)
        self._solver = Solver(model.size, newton)
        self._meter = Meter(model, self.weight, self.damping, self.lag)
        self._kept: tuple[float, sparse.csr_matrix, sparse.csr_matrix] | None = None

    def at_rest(self, q: Array, time: float = 0.0) -> State:
        """The state of a structure at rest as the ground begins to move."""
        return self.released(State(time, q, np.zeros_like(q), np.zeros_like(q)))

    def released(self, state: State) -> State:
        """The same state with the acceleration that its forces give."""
        forces = (
            self._load(state.time)
            - self.damping @ state.velocity
            - self.model.force(self.contact(state))
        )
        return replace(state, acceleration=splu(self.model.mass.tocsc()).solve(forces))

    def contact(self, state: State) -> Array:
        """What the joint law sees, u + β v."""
        return state.q + self.lag * state.velocity

    def energy(self, state: State) -> Array:
        """Kinetic and potential energy of a state, and two zeros (4,) [J]."""
        now = (state.q, state.velocity)
        return self._meter.step(now, now, np.zeros(2))

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
        """Yield the same steps with their resultants, in batches of one."""
        for step in self.steps(start, dt, end):
            yield Batch(
                np.array([step.state.time]),
                self.model.resultants(step.contact)[None],
                np.array([step.iterations]),
                np.array([step.smallest]),
                step.energy[None],
                partial(_given, step.state),
            )

    def _load(self, time: float) -> Array:
        return self.weight - self.model.body @ self.motion.at(time)[0]

    def _advance(self, state: State, target: float, halvings: int) -> Step:
        """Reach a time in one step, or in halves of it where that fails."""
        dt = target - state.time
        try:
            new, iterations = self._try(state, dt)
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
        ground = self.motion.at(np.array([state.time, target])).mean(axis=0)
        energy = self._meter.step((state.q, state.velocity), (new.q, new.velocity), ground)
        return Step(new, self.contact(new), iterations, dt, energy)

    def _try(self, state: State, dt: float) -> tuple[State, int]:
        trial = _Trial(self.model, self.scheme, self.damping, self.lag, state, dt)
        load = self._load(state.time + trial.share * dt)
        guess = state.q + dt * state.velocity + 0.5 * dt**2 * state.acceleration
        solved = self._solver.solve(
            lambda q: trial.force(q) - load,
            lambda q: self._effective(trial, q),
            guess,
            self._scale,
        )
        return trial.end(solved.q), solved.iterations

    def _effective(self, trial: "_Trial", q: Array) -> sparse.csr_matrix:
        """Tangent of a trial step; the same object as before while stiffness and step stay."""
        stiffness = self.model.tangent(trial.between(q))
        kept = self._kept
        if kept is None or kept[1] is not stiffness or abs(kept[0] - trial.dt) > 1e-9 * trial.dt:
            matrix = stiffness.copy()
            matrix.data = trial.tangent_data(stiffness.data)
            self._kept = kept = (trial.dt, stiffness, matrix)
        return kept[2]


@dataclass(frozen=True, eq=False)
class _Trial:
    """The equation of one step, at t + (1 + α) dt, as a function of the displacement at its end."""

    model: Model
    scheme: Scheme
    damping: sparse.csr_matrix
    lag: float
    start: State
    dt: float

    @property
    def share(self) -> float:
        """Where between start and end the equation is written, 1 + α."""
        return 1.0 + self.scheme.alpha

    @property
    def _to_velocity(self) -> float:
        return self.scheme.gamma / (self.scheme.beta * self.dt)

    @property
    def _to_acceleration(self) -> float:
        return 1.0 / (self.scheme.beta * self.dt**2)

    def end(self, q: Array) -> State:
        """State at the end, by Newmark's formulas."""
        beta, gamma, dt, start = self.scheme.beta, self.scheme.gamma, self.dt, self.start
        moved, v, a = q - start.q, start.velocity, start.acceleration
        return State(
            start.time + dt,
            q,
            self._to_velocity * moved
            + (1.0 - gamma / beta) * v
            + dt * (1.0 - 0.5 * gamma / beta) * a,
            self._to_acceleration * moved - v / (beta * dt) - (0.5 / beta - 1.0) * a,
        )

    def _seen(self, end: State) -> tuple[Array, Array]:
        """Contact u + β v and velocity where the equation is written."""
        v = self.start.velocity + self.share * (end.velocity - self.start.velocity)
        q = self.start.q + self.share * (end.q - self.start.q)
        return q + self.lag * v, v

    def between(self, q: Array) -> Array:
        """Contact where the equation is written."""
        return self._seen(self.end(q))[0]

    def force(self, q: Array) -> Array:
        """Inertia, damping and internal forces."""
        end = self.end(q)
        contact, v = self._seen(end)
        return self.model.mass @ end.acceleration + self.damping @ v + self.model.force(contact)

    def tangent_data(self, stiffness: Array) -> Array:
        """Entries of the derivative of `force`, from those of the model's tangent."""
        return (
            self._to_acceleration * self.model.mass.data
            + self.share * self._to_velocity * self.damping.data
            + self.share * (1.0 + self.lag * self._to_velocity) * stiffness
        )


def _damping_matrix(model: Model, damping: Rayleigh | None) -> sparse.csr_matrix:
    """The constant part of damping, on the pattern of the model's matrices."""
    matrix = model.mass.copy()
    if damping is None:
        matrix.data = np.zeros_like(matrix.data)
        return matrix
    matrix.data = damping.mass * model.mass.data
    if damping.joints == "initial":
        matrix.data += damping.stiffness * model.closed().data
    elif damping.joints == "none":
        matrix.data += damping.stiffness * model.blocks.data
    return matrix


def _given(state: State, _: int) -> State:
    """The state of a batch of one."""
    return state
