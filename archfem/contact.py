"""Time stepping that uses what is special here: everything is linear but the joints.

With all joints closed the structure is linear and, under Rayleigh damping on its mass and closed
stiffness, falls into independent modes. In their coordinates η, all of which are kept, a step is

    Δη = H (forces + Bᵀ λ),    z = z₀ + F λ,    λ = J(z) z,

with H diagonal, B = G Φ the modes' openings at the joint points, F = c B H Bᵀ their compliance over
one step, and λ the forces that take tension out of the closed joints. J is block-diagonal
and vanishes where a joint is closed, so a step costs one product B ξ and a small dense problem in
the open points alone. The idea is Wilson's fast nonlinear analysis (Three-dimensional static and
dynamic analysis of structures, 2002, chapter 18), here without truncation: the history is that of
the equilibrium solves of `dynamics`, to rounding.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from archfem import kernel
from archfem.batches import compiled_law, in_batches
from archfem.dynamics import Batch, State, Stepper
from archfem.modal_energy import energies
from archfem.models.jointed import Jointed
from archfem.motion import Motion
from archfem.newton import Newton
from archfem.schemes import Rayleigh, Scheme
from archfem.structure import Array

LARGEST = 1200
"""Coordinates up to which all modes are computed and kept."""


def applies(model: Jointed, damping: Rayleigh | None) -> bool:
    """Whether the closed structure falls into modes, few enough to keep all of them."""
    proportional = damping is None or damping.joints != "none"
    return proportional and model.joints.offset is None and model.size <= LARGEST


def work(model: Jointed) -> float:
    """About how many multiplications a step takes."""
    return float(model.joints.opening.shape[0] + 8) * model.size


@dataclass(frozen=True, eq=False)
class _Modes:
    """The closed structure in its modes.

    Attributes:
        shapes: Φ, unit modal masses (n, n).
        back: M Φ, from displacements to modes (n, n).
        squares: ω² (n,) [1/s²].
        opening: B = G Φ (p, n).
        shear: shear resultant of each joint (n_joints, n).
        weight: modal self-weight (n,).
        body: modal force per unit ground acceleration (n, 2).
    """

    shapes: Array
    back: Array
    squares: Array
    opening: Array
    shear: Array
    weight: Array
    body: Array

    @classmethod
    def of(cls, model: Jointed, weight: Array) -> "_Modes":
        squares, shapes = eigh(model.closed().toarray(), model.mass.toarray())
        joints = model.joints
        shear = joints.sums[0] @ (joints.law.shear @ (joints.slip @ shapes))
        return cls(
            shapes,
            model.mass @ shapes,
            squares,
            np.ascontiguousarray(joints.opening @ shapes),
            np.ascontiguousarray(shear),
            shapes.T @ weight,
            shapes.T @ model.body,
        )


class ContactStepper:
    """Advances a model under a ground motion, in the modes of its closed state.

    A step whose open points do not settle is taken by SNES instead.
    """

    name = "contact"

    def __init__(
        self,
        model: Jointed,
        motion: Motion,
        *,
        damping: Rayleigh | None = None,
        scheme: Scheme | None = None,
        newton: Newton | None = None,
    ) -> None:
        self.model = model
        self.motion = motion
        self.exact = Stepper(model, motion, damping=damping, scheme=scheme, newton=newton)
        self.lag = self.exact.lag
        self._modes = _Modes.of(model, self.exact.weight)
        self._law = compiled_law(model)
        rate = damping.stiffness if damping else 0.0
        self._rates = (damping.mass if damping else 0.0) + rate * self._modes.squares
        self._step: tuple[float, kernel.Coefficients, Array] | None = None

    def at_rest(self, q: Array, time: float = 0.0) -> State:
        """The state of a structure at rest as the ground begins to move."""
        return self.exact.at_rest(q, time)

    def energy(self, state: State) -> Array:
        """Kinetic and potential energy of a state, and two zeros (4,) [J]."""
        return self.exact.energy(state)

    def batches(self, start: State, dt: float, end: float) -> Iterator[Batch]:
        """Yield the steps to the end, many at a time.

        Args:
            start: state from which to go.
            dt: time step [s].
            end: time of the last step [s].

        Raises:
            DidNotConverge: SNES failed as well; `last` is the state before.
        """
        return in_batches(self._batch, self.exact, start, dt=dt, end=end)

    def _batch(self, state: State, dt: float, times: Array) -> tuple[Batch, bool]:
        """Take steps up to these times, or up to one whose open points do not settle."""
        modes, coefficients, compliance = self._prepared(dt)
        series = np.empty((len(times) + 1, 3, len(modes.squares)))
        series[0] = np.stack([state.q, state.velocity, state.acceleration]) @ modes.back
        gaps = np.empty((len(series), len(modes.opening)))
        gaps[0] = modes.opening @ (series[0, 0] + self.lag * series[0, 1])
        resultants = np.empty((len(times), self.model.joints.points.count, 3))
        iterations = np.zeros(len(times), dtype=np.int64)
        count = kernel.advance(
            series,
            gaps,
            resultants,
            iterations,
            modes.weight + self._ground(times + self.exact.scheme.alpha * dt),
            (modes.opening, modes.shear, compliance),
            coefficients,
            self._law,
        )
        ground = self._ground(np.append(times[0] - dt, times[:count]))
        batch = Batch(
            times[:count],
            resultants[:count],
            iterations[:count],
            np.full(count, dt),
            energies(
                series[: count + 1],
                gaps[: count + 1],
                (modes.weight, 0.5 * (ground[:-1] + ground[1:])),
                modes.opening,
                coefficients,
                self._law,
            ),
            lambda k: State(float(times[k]), *(modes.shapes @ x for x in series[k + 1])),
        )
        return batch, count == len(times)

    def _ground(self, times: Array) -> Array:
        """Modal forces of the ground (steps, n)."""
        return -self.motion.at(times) @ self._modes.body.T

    def _prepared(self, dt: float) -> tuple[_Modes, "kernel.Coefficients", Array]:
        """What a step of this length needs."""
        modes = self._modes
        if self._step is None or self._step[0] != dt:
            scheme = self.exact.scheme
            numbers = kernel.coefficients(
                dt,
                (scheme.beta, scheme.gamma, scheme.alpha),
                self.lag,
                (modes.squares, self._rates),
            )
            compliance = (modes.opening * (numbers.seen * numbers.gain)) @ modes.opening.T
            self._step = (dt, numbers, np.ascontiguousarray(compliance))
        return modes, self._step[1], self._step[2]
