"""The equation of motion that every stepper solves.

With u the displacements relative to the ground, at every step

    M a + C v + f(u + β v) = p - M r a_g,

f the internal forces of blocks and joints, p the self-weight. Newmark's method and HHT write it at
an instant, the conserving scheme for the means over a step. Stiffness-proportional damping is
written as f(u + β v), so that the joint's dashpot acts only where the joint is closed,
t_n = k_n <g + β ġ>_-: a continuous law, whose energy stays convex. Damping on a constant matrix
(the initial stiffness, or that of the blocks alone) enters through C = α M + R.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem.arrays import Array
from archfem.dynamics.energy import Meter
from archfem.dynamics.schemes import Conserving, Scheme, Viscous, check_sliding
from archfem.dynamics.stepping.newmark import Numbers, numbers_of
from archfem.dynamics.steps import State
from archfem.joints.operator import JointOperator
from archfem.models.model import Model
from archfem.motion.averages import mean_accelerations
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import self_weight


@dataclass(frozen=True, eq=False)
class Equation:
    """A model, the ground motion that shakes it, its damping, and how time is discretised.

    Attributes:
        model: any rung.
        motion: of the ground.
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
        """Refuse sliding and bonds by schemes that write the equation at an instant."""
        check_sliding(self.scheme, self.model.structure)

    @property
    def conserving(self) -> bool:
        """Whether forces are means over steps."""
        return isinstance(self.scheme, Conserving)

    @cached_property
    def lag(self) -> float:
        """β of damping that follows the joints [s]."""
        damping = self.damping
        return damping.stiffness if damping and damping.joints == "closed" else 0.0

    @cached_property
    def drag(self) -> float:
        """α of damping by mass [1/s]."""
        return self.damping.mass if self.damping else 0.0

    @cached_property
    def rest(self) -> sparse.csr_matrix:
        """What of C is not proportional to M, on the pattern of the model's matrices."""
        matrix, damping = self.model.mass.copy(), self.damping
        if damping is None or damping.joints == "closed":
            matrix.data = np.zeros_like(matrix.data)
        else:
            fixed = self.model.closed() if damping.joints == "initial" else self.model.blocks
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
        """The joints, where all that is not linear are joints that a compiled loop can follow.

        Of joints on supports that have moved only the conserving scheme knows; of saw teeth and
        bonds none does.
        """
        joints = self.model.operator
        if joints is None or not joints.points.plain:
            return None
        return joints if self.conserving or joints.offset is None else None

    @cached_property
    def remembers(self) -> int:
        """How many joint points remember what they have slid."""
        slides = bool(np.isfinite(self.model.structure.friction).any())
        return len(self.model.memory) if slides else 0

    @cached_property
    def meter(self) -> Meter:
        """Takes energies from state to state."""
        return Meter(self.model, self.weight, self.viscous, self.lag)

    def numbers(self, dt: float) -> Numbers:
        """Return the numbers of a time step.

        Args:
            dt: its length [s].
        """
        scheme = (self.scheme.beta, self.scheme.gamma, self.scheme.alpha)
        return numbers_of(dt, scheme, self.lag, self.drag)

    def load(self, time: float) -> Array:
        """Return the generalised forces of gravity and of the ground (n,).

        Args:
            time: since the motion began [s].
        """
        return np.asarray(self.weight - self.model.body @ self.motion.at(time)[0])

    def ground(self, times: Array, dt: float) -> Array:
        """Acceleration of the ground in steps that end at these times.

        Args:
            times: ends of the steps, one after another (steps,) [s].
            dt: their length [s].

        Returns:
            Where the equation of each step is written, and the mean over it
            (2, steps, 2) [m/s²].
        """
        starts = np.append(times[0] - dt, times)
        if self.conserving:
            return np.stack(2 * [mean_accelerations(self.motion, starts)])
        ends = self.motion.at(starts)
        written = self.motion.at(times + self.scheme.alpha * dt)
        return np.stack([written, 0.5 * (ends[:-1] + ends[1:])])

    def at_rest(self, q: Array, time: float = 0.0, memory: Array | None = None) -> State:
        """Return the state of a structure at rest, with the acceleration that its forces give.

        Args:
            q: coordinates (n,).
            time: since the motion began [s].
            memory: how far each joint point has slid for good (p,) [m].
        """
        return self.released(State(time, q, np.zeros_like(q), np.zeros_like(q), memory))

    def released(self, state: State) -> State:
        """Return the same state with the acceleration that its forces give.

        Args:
            state: whose acceleration does not matter.
        """
        forces = (
            self.load(state.time)
            - self.viscous @ state.velocity
            - self.remembering(state).force(self.contact(state))
        )
        return replace(state, acceleration=splu(self.model.mass.tocsc()).solve(forces))

    def remembering(self, state: State) -> Model:
        """Return the model with what its joints remember in a state.

        Args:
            state: of the structure.
        """
        return self.model if state.memory is None else self.model.remembering(state.memory)

    def contact(self, state: State) -> Array:
        """Return what the joint law sees, u + β v (n,).

        Args:
            state: of the structure.
        """
        return state.q + self.lag * state.velocity

    def energy(self, state: State) -> Array:
        """Return kinetic and potential energy of a state, and two zeros (4,) [J].

        Args:
            state: of the structure.
        """
        kinetic = 0.5 * float(state.velocity @ (self.model.mass @ state.velocity))
        potential = self.remembering(state).energy(state.q) - float(self.weight @ state.q)
        return np.array([kinetic, potential, 0.0, 0.0])
