"""The energy balance of a run: what the ground gives must be stored or lost.

With T the kinetic energy, E the potential energy of blocks and joints and p the weight, over a step

    Δ(T + E(u) - p·u) = W - D,
    W = -Δu · M r ½ Σ a_g,    D = Δu · ½ Σ (C v + f(u + β v) - f(u)),

the sums over both ends of the step. Average acceleration keeps this balance exactly while no joint
opens or closes; across such a change the trapezoidal rule errs, and over thousands of impacts the
errors may add up to energy that comes from nowhere. What the two sides differ by, summed from the
start, is the drift. It is negative where a scheme damps by itself, as HHT does.
"""

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.models.model import Model

STILL = 1e-3
"""Energies below this fraction of that stored under self-weight count as none: they change forces,
which go with their root, by 3 % of the weight's."""


class Meter:
    """Takes the energies of a model from state to state.

    Args:
        model: any rung.
        weight: generalised forces of gravity (n,).
        damping: the constant part of damping, C (n, n).
        lag: β of damping that follows the joints [s].
    """

    def __init__(self, model: Model, weight: Array, damping: sparse.csr_matrix, lag: float) -> None:
        self.model = model
        self.weight = weight
        self.damping = damping
        self.lag = lag
        self._kept: tuple[Array, Array, float, float, Array] | None = None

    def step(self, before: tuple[Array, Array], after: tuple[Array, Array], ground: Array) -> Array:
        """Energies of a step from one state to the next.

        Args:
            before: displacements (n,) and velocities (n,) at the start.
            after: the same at the end.
            ground: mean acceleration of the ground over the step (2,) [m/s²].

        Returns:
            At the end kinetic and potential energy, that of the weight included; over the step
            the work of the ground and what is lost (4,) [J].
        """
        first, last = self._state(*before), self._state(*after)
        moved = after[0] - before[0]
        work = -float(moved @ (self.model.body @ ground))
        lost = 0.5 * float(moved @ (first[4] + last[4]))
        return np.array([last[2], last[3], work, lost])

    def _state(self, q: Array, velocity: Array) -> tuple[Array, Array, float, float, Array]:
        """A state, its kinetic and potential energy, and its damping forces."""
        if self._kept is not None and self._kept[0] is q and self._kept[1] is velocity:
            return self._kept
        kinetic = 0.5 * float(velocity @ (self.model.mass @ velocity))
        potential = self.model.energy(q) - float(self.weight @ q)
        forces = self.damping @ velocity
        if self.lag:
            forces += self.model.force(q + self.lag * velocity) - self.model.force(q)
        self._kept = (q, velocity, kinetic, potential, forces)
        return self._kept


class Balance:
    """Sums the energies of a run.

    Args:
        kinetic: energy at the start [J].
        potential: energy at the start, that of the weight included [J].

    Attributes:
        largest: the largest energy exchanged so far: kinetic, change of what is stored, work of
            the ground, what is lost [J].
    """

    def __init__(self, kinetic: float, potential: float) -> None:
        self._stored = kinetic + potential
        self._work = self._lost = 0.0
        self.largest = max(kinetic, STILL * abs(potential), 1e-300)

    def add(self, steps: Array) -> tuple[Array, Array]:
        """Go on by some steps.

        Args:
            steps: their energies, a row a step, as by `Meter.step` (steps, 4) [J].

        Returns:
            The drift after each step: energy that came from nowhere, or went nowhere, since the
            start (steps,) [J]; and the same as a fraction of the largest exchanged until then
            (steps,) [-].
        """
        kinetic, potential, work, lost = steps.T
        change = kinetic + potential - self._stored
        works, losses = self._work + np.cumsum(work), self._lost + np.cumsum(lost)
        drift: Array = change - works + losses
        self._work, self._lost = works[-1], losses[-1]
        exchanged = np.max([kinetic, np.abs(change), np.abs(works), losses], axis=0)
        largest = np.maximum.accumulate(np.maximum(exchanged, self.largest))
        self.largest = float(largest[-1])
        return drift, drift / largest
