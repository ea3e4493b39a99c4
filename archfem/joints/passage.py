"""Joints over a step: the mean of their forces, and what they remember at its end.

Opening and slip go straight from the start of the step to its end. Damping that follows the joints
shifts openings by its lag, g + β ġ, so that a joint feels them earlier, and never pulls.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from archfem.arrays import Array
from archfem.joints.law import excess, held, shear_over_step
from archfem.joints.operator import JointOperator


@dataclass(frozen=True, eq=False)
class Passage:
    """A step of the joints from a state that is known.

    Attributes:
        operator: of the joints, with what they remember of the time before.
        start: coordinates at its start (n,).
        late: lag of damping over the length of the step, β/Δt [-].
    """

    operator: JointOperator
    start: Array
    late: float

    @cached_property
    def _before(self) -> tuple[Array, Array]:
        """Openings and elastic shear at the start, each (p,)."""
        return self.operator.openings(self.start), self.operator.elastic(self.start)

    def _path(self, q: Array) -> tuple[Array, Array]:
        """From where to where the openings go that the joints feel, each (p,)."""
        before, after = self._before[0], self.operator.openings(q)
        ahead = self.late * (after - before)
        return before + ahead, after + ahead

    def _sheared(self, q: Array) -> Array:
        """Change of the elastic shear if nothing slid (p,)."""
        return self.operator.elastic(q) - self._before[1]

    def _over(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Mean normal and shear forces, Coulomb's limit, and elastic shear at the end (p,)."""
        operator, slides = self.operator, self.operator.points.slides
        normal, closed = operator.law.mean(*self._path(q))
        limit, change, first = operator.limits(normal, closed), self._sheared(q), self._before[1]
        shear, last = shear_over_step(first, change, self.late, limit)
        glued = first + (0.5 + self.late) * change
        return (
            normal,
            np.where(slides, shear, glued),
            limit,
            np.where(slides, last, first + change),
        )

    def force(self, q: Array) -> Array:
        """Return the mean of the generalised forces of the joints (n,).

        Args:
            q: coordinates at the end (n,).
        """
        return self.operator.pushed(*self._over(q)[:2])

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates at the end (n,).
        """
        return self.operator.summed(*self._over(q)[:2])

    def remembered(self, q: Array) -> Array:
        """Return how far each point has slid for good at the end (p,) [m].

        Args:
            q: coordinates at the end (n,).
        """
        operator, points = self.operator, self.operator.points
        further = (operator.elastic(q) - self._over(q)[3]) / points.shear
        slid: Array = operator.memory + np.where(points.slides, further, 0.0)
        return slid

    def lost(self, q: Array) -> float:
        """Return the energy that friction and the lag of damping take [J]; never negative.

        Args:
            q: coordinates at the end (n,).
        """
        operator, points = self.operator, self.operator.points
        before, after = self._before[0], operator.openings(q)
        normal, shear, limit, _ = self._over(q)
        lagging = (normal - operator.law.mean(before, after)[0]) @ (after - before)
        change, first = self._sheared(q), self._before[1]
        start = np.where(points.slides, held(first, limit), first)
        over = np.abs(excess(start + change, limit))
        mean = np.where(
            points.slides,
            shear_over_step(first, change, 0.0, limit)[0],
            first + 0.5 * change,
        )
        rubbing = 0.5 * (first**2 - start**2) + over * limit + (shear - mean) * change
        return float(lagging + np.sum(rubbing / points.shear))

    def stiffness(self, q: Array) -> Array:
        """Return the derivative of the mean force by q, as `tangents` takes it (m,) [N/m].

        Args:
            q: coordinates at the end (n,).
        """
        operator, points, late = self.operator, self.operator.points, self.late
        path, rates = self._path(q), (late, 1.0 + late)
        across = operator.law.mean_stiffness(*path, rates)
        if not operator.slides:
            return np.concatenate([across, (0.5 + late) * points.shear])
        by_change, by_limit = self._shear_rates(q)
        along = np.where(points.slides, by_change, 0.5 + late) * points.shear
        closed = operator.law.mean_closed_rate(*path, rates)
        return np.concatenate([across, along, operator.limit_rates(across, closed, by_limit)])

    def _shear_rates(self, q: Array) -> tuple[Array, Array]:
        """Derivatives of the mean shear by its elastic change and by the limit, each (p,) [-]."""
        first, change, limit = self._before[1], self._sheared(q), self._over(q)[2]
        start = held(first, limit)
        over = excess(start + change, limit)
        with np.errstate(divide="ignore", invalid="ignore"):
            slid = np.where(over != 0.0, over / change, 0.0)
        lost = np.where(np.abs(first) > limit, np.sign(first), 0.0)
        mean = shear_over_step(first, change, 0.0, limit)[0] + self.late * change
        rubs = np.abs(mean) > limit
        by_change = 0.5 * (1.0 - slid) ** 2 + self.late
        by_limit = (1.0 - slid) * lost + slid * np.sign(change)
        return np.where(rubs, 0.0, by_change), np.where(rubs, np.sign(mean), by_limit)
