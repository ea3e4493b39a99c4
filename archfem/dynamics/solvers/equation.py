"""The equation of motion, its damping, and its loads over a step.

The displacements u are relative to the ground. At every step

    M a + C v + f(u + β v) = p - M r a_g,

with f the internal forces of blocks and joints, and p the self-weight. Newmark's method and HHT
write it at an instant, the conserving scheme for the means over a step. Stiffness-proportional
damping is written as f(u + β v), so that the joint's dashpot acts only where the joint is closed,
t_n = k_n <g + β ġ>_-: a continuous law, whose energy stays convex. Damping on a constant matrix
(the initial stiffness, or that of the blocks alone) enters through C = α M + R.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem._typing import Array
from archfem.dynamics.schemes import Conserving, Scheme, Viscous, check_friction_scheme
from archfem.dynamics.solvers.newmark import StepNumbers, step_numbers
from archfem.dynamics.state import State
from archfem.joints.operator import JointOperator
from archfem.models.model import Model
from archfem.motion.motion import COMPONENTS, Motion
from archfem.statics.equilibrium import self_weight

# Integrals of the components of each motion up to its samples
_cached_integrals: WeakKeyDictionary[Motion, dict[str, Array]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Equation:
    """Equation of motion of a model under a ground motion, with damping and time discretisation.

    Attributes:
        model: model of any fidelity.
        motion: motion of the ground.
        damping: None is undamped.
        scheme: conserving, Newmark's or HHT-α.

    Raises:
        InvalidInput: joints can slide or break, and the scheme has no memory.
    """

    model: Model
    motion: Motion
    damping: Viscous | None = None
    scheme: Scheme = field(default_factory=Conserving)

    def __post_init__(self) -> None:
        """Refuse sliding and bonds with schemes that write the equation at an instant."""
        check_friction_scheme(self.scheme, self.model.structure)

    @property
    def conserving(self) -> bool:
        """Whether forces are means over steps."""
        return isinstance(self.scheme, Conserving)

    @cached_property
    def lag(self) -> float:
        """β of damping written as f(u + β v), which acts in closed joints only [s]; else 0."""
        damping = self.damping
        return damping.stiffness if damping and damping.joints == "closed" else 0.0

    @cached_property
    def drag(self) -> float:
        """α of damping by mass [1/s]."""
        return self.damping.mass if self.damping else 0.0

    @cached_property
    def rest(self) -> sparse.csr_matrix:
        """R, the part of C not proportional to M, on the pattern of the model's matrices."""
        matrix, damping = self.model.mass.copy(), self.damping
        if damping is None or damping.joints == "closed":
            matrix.data = np.zeros_like(matrix.data)
        else:
            initial = damping.joints == "initial"
            fixed = self.model.closed_tangent() if initial else self.model.block_stiffness
            matrix.data = damping.stiffness * fixed.data
        return matrix

    @cached_property
    def viscous(self) -> sparse.csr_matrix:
        """C, on the pattern of the model's matrices."""
        matrix = self.rest.copy()
        matrix.data = self.drag * self.model.mass.data + self.rest.data
        return matrix

    @cached_property
    def weight(self) -> Array:
        """Generalised forces of gravity (n,)."""
        return self_weight(self.model)

    @cached_property
    def joints(self) -> JointOperator | None:
        """The joints, where these are all that is not linear and their law is compiled.

        The compiled law covers neither dilatancy nor bonds nor laws of the user; supports that
        have moved it covers for the conserving scheme only.
        """
        joints = self.model.operator
        if joints is None or not joints.points.is_plain:
            return None
        return joints if self.conserving or joints.gap_offset is None else None

    @cached_property
    def memory_size(self) -> int:
        """Number of values of the joint memory that are stored."""
        structure = self.model.structure
        slides = bool(np.isfinite(structure.friction).any())
        return len(self.model.memory) if slides or structure.has_own_laws else 0

    def numbers(self, dt: float) -> StepNumbers:
        """Return the coefficients of a time step.

        Args:
            dt: its length [s].
        """
        scheme = (self.scheme.beta, self.scheme.gamma, self.scheme.alpha)
        return step_numbers(dt, scheme, self.lag, self.drag)

    def load(self, time: float) -> Array:
        """Return the generalised forces of gravity and of the ground (n,).

        Args:
            time: since the motion began [s].
        """
        return np.asarray(self.weight - self.model.mass_influence @ self.motion.at(time)[0])

    def ground(self, times: Array, dt: float) -> Array:
        """Return the acceleration of the ground in steps.

        Args:
            times: ends of the steps, one after another (steps,) [s].
            dt: their length [s].

        Returns:
            Values where the equation of each step is written, and means over each step
            (2, steps, 2) [m/s²].
        """
        starts = np.append(times[0] - dt, times)
        if self.conserving:
            return np.stack(2 * [mean_accelerations(self.motion, starts)])
        written = times + self.scheme.alpha * dt
        values = self.motion.at(np.concatenate([starts, written]))
        ends = values[: len(starts)]
        return np.stack([values[len(starts) :], 0.5 * (ends[:-1] + ends[1:])])

    def at_rest(self, q: Array, time: float = 0.0, memory: Array | None = None) -> State:
        """Return the state of a structure at rest, with the acceleration due to its forces.

        Args:
            q: coordinates (n,).
            time: since the motion began [s].
            memory: irreversible slip of each joint point (p,) [m].
        """
        return self.accelerated(State(time, q, np.zeros_like(q), np.zeros_like(q), memory))

    def accelerated(self, state: State) -> State:
        """Return a state with the acceleration that its forces cause.

        Args:
            state: state of the structure; its acceleration is ignored.
        """
        forces = (
            self.load(state.time)
            - self.viscous @ state.velocity
            - self.with_memory(state).force(self.contact(state))
        )
        derived = self.model.derived
        if "mass factor" not in derived:
            derived["mass factor"] = splu(self.model.mass.tocsc())
        return replace(state, acceleration=derived["mass factor"].solve(forces))

    def with_memory(self, state: State) -> Model:
        """Return the model with the joints' memory of a state.

        Args:
            state: state of the structure.
        """
        return self.model if state.memory is None else self.model.with_memory(state.memory)

    def contact(self, state: State) -> Array:
        """Return the contact displacement of the joint law, u + β v (n,).

        Args:
            state: state of the structure.
        """
        return state.q + self.lag * state.velocity

    def energy(self, state: State) -> Array:
        """Return kinetic and potential energy of a state, and two zeros (4,) [J].

        Args:
            state: state of the structure.
        """
        kinetic = 0.5 * float(state.velocity @ (self.model.mass @ state.velocity))
        potential = self.with_memory(state).energy(state.q) - float(self.weight @ state.q)
        return np.array([kinetic, potential, 0.0, 0.0])

    def step_energy(self, before: State, after: State, ground: Array) -> Array:
        """Return kinetic and potential energy after a step, its work and its loss (4,) [J].

        Args:
            before: state before the step.
            after: state after it.
            ground: mean acceleration of the ground in it (2,) [m/s²].
        """
        increment = after.q - before.q
        work = -float(increment @ (self.model.mass_influence @ ground))
        forces = self._damping_forces(before) + self._damping_forces(after)
        return np.array([*self.energy(after)[:2], work, 0.5 * float(increment @ forces)])

    def _damping_forces(self, state: State) -> Array:
        """Return the damping forces in a state (n,)."""
        forces: Array = self.viscous @ state.velocity
        if self.lag:
            forces += self.model.force(self.contact(state)) - self.model.force(state.q)
        return forces


def mean_accelerations(motion: Motion, times: Array) -> Array:
    """Return the mean acceleration of the ground between each time and the next.

    The record is straight between its samples and zero outside, and is integrated exactly.
    """
    means = np.zeros((len(times) - 1, 2))
    for axis, name in enumerate(COMPONENTS[:2]):
        samples = getattr(motion, name)
        if samples is not None:
            sums = _integrate_samples(motion, name)
            speeds = motion.dt * _integrate_to(samples, sums, times / motion.dt)
            means[:, axis] = (speeds[1:] - speeds[:-1]) / (times[1:] - times[:-1])
    return means


def _integrate_to(samples: Array, sums: Array, places: Array) -> Array:
    """Integrate a component from its first sample to fractional sample numbers (m,)."""
    last = len(samples) - 1
    inside = np.minimum(np.maximum(places, 0.0), last)
    lower = np.minimum(inside.astype(int), max(last - 1, 0))
    part = inside - lower
    rise = samples[np.minimum(lower + 1, last)] - samples[lower]
    return sums[lower] + part * (samples[lower] + 0.5 * part * rise)


def _integrate_samples(motion: Motion, name: str) -> Array:
    """Integrate a component up to each of its samples, once for each motion (n,)."""
    integrals = _cached_integrals.setdefault(motion, {})
    if name not in integrals:
        samples = motion.component(name)
        integrals[name] = np.append(0.0, np.cumsum(0.5 * (samples[1:] + samples[:-1])))
    return integrals[name]
