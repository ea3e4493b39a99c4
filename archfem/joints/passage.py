"""Joints over a step: the mean of their forces, and what they remember at its end.

Opening and slip go straight from the start of the step to its end. Damping that follows the joints
shifts openings by its lag, g + β ġ, so that a joint feels them earlier, and never pulls.

Saw teeth raise a point straight from where they had it at the start to where it has slid in the
end, which is found by turns: a step is taken with one end, `raising` tells the next. The normal
force works on the gap less that rise, and friction takes μ N |s| less the work N tan ψ |s| of
rising, which is not negative. Bonds break at the end of a step; what they stored then is lost.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from archfem.arrays import Array
from archfem.joints.bonds import ridden
from archfem.joints.law import NONE, excess, held, shear_over_step
from archfem.joints.operator import JointOperator

RAISED = 1e-9
"""Difference between where teeth are taken to be at the end of a step and where slip puts them, of
the farthest that they move or, if that is more, of an elastic slip up to the limit: rounding."""


LEAST, MOST = 0.05, 2.0
"""Shares of what teeth have missed that are made up in a turn."""


@dataclass(frozen=True, eq=False)
class Passage:
    """A step of the joints from a state that is known.

    Attributes:
        operator: of the joints, with what they remember of the time before.
        start: coordinates at its start (n,).
        late: lag of damping over the length of the step, β/Δt [-].
        raised: how far teeth raise each point at the end (p,) [m]; None as at the start.
        turn: by how much that was missed the turn before (p,) [m], and the share of it that was
            made up [-].
    """

    operator: JointOperator
    start: Array
    late: float
    raised: Array | None = None
    turn: tuple[Array, float] | None = None

    @cached_property
    def _before(self) -> tuple[Array, Array]:
        """Gaps that the normal law sees and elastic shear at the start, each (p,)."""
        return self.operator.felt(self.start), self.operator.elastic(self.start)

    def _path(self, q: Array) -> tuple[Array, Array]:
        """From where to where the openings go that the joints feel, each (p,)."""
        before, after = self._before[0], self.operator.felt(q, self.raised)
        ahead = self.late * (after - before)
        return before + ahead, after + ahead

    def _sheared(self, q: Array) -> Array:
        """Change of the elastic shear if nothing slid (p,)."""
        return self.operator.elastic(q) - self._before[1]

    def _over(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Means of the normal law and of shear, Coulomb's limit, elastic shear at the end (p,)."""
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

    def _acting(self, q: Array) -> tuple[Array, Array]:
        """Mean normal and shear forces, each (p,)."""
        normal, shear, *_ = self._over(q)
        return self.operator.pulled(normal), shear

    def force(self, q: Array) -> Array:
        """Return the mean of the generalised forces of the joints (n,).

        Args:
            q: coordinates at the end (n,).
        """
        return self.operator.pushed(*self._acting(q))

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates at the end (n,).
        """
        return self.operator.summed(*self._acting(q))

    def remembered(self, q: Array) -> Array:
        """Return what the joints remember at the end, as `JointOperator.memory`.

        Args:
            q: coordinates at the end (n,).
        """
        operator, (_, _, limit, last) = self.operator, self._over(q)
        excess = operator.elastic(q) - last
        if operator.bonds is None:
            return operator.slid_by(excess)
        return operator.further(operator.bonds.torn(operator.felt(q, self.raised)), excess, limit)

    def raising(self, q: Array) -> "Passage":
        """Return the same step with teeth where the slip on the way to q puts them.

        Args:
            q: coordinates at the end (n,).

        Returns:
            The very same object where they are there already, to rounding.
        """
        points = self.operator.points
        if points.dilatancy is None:
            return self
        limit, slid = self._over(q)[2], self.remembered(q)[: len(points.arm)]
        found, begun = ridden(points, slid), self.operator.ridden
        begun = np.zeros_like(slid) if begun is None else begun
        taken = begun if self.raised is None else self.raised
        assert found is not None
        far = np.abs(found - begun).max()
        elastic = (points.dilatancy * limit / points.shear).max()
        missed = found - taken
        if np.abs(missed).max() <= RAISED * max(far, elastic):
            return self
        share = 1.0 if self.turn is None else _share(missed, *self.turn)
        return replace(self, raised=taken + share * missed, turn=(missed, share))

    def _rise(self) -> Array | float:
        """How far teeth rise over the step (p,) [m]."""
        begun = self.operator.ridden
        if self.raised is None:
            return 0.0
        return self.raised if begun is None else self.raised - begun

    def _torn(self, q: Array) -> float:
        """Energy that bonds held which break at the end [J]."""
        operator = self.operator
        if operator.bonds is None:
            return 0.0
        gaps = operator.felt(q, self.raised) + operator.bonds.stretch
        return operator.across(gaps) - operator.remembering(self.remembered(q)).across(gaps)

    def lost(self, q: Array) -> float:
        """Return the energy that friction, bonds and the lag of damping take [J]; never negative.

        Args:
            q: coordinates at the end (n,).
        """
        operator, points = self.operator, self.operator.points
        before, after = self._before[0], operator.felt(q, self.raised)
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
        lost = float(lagging + np.sum(rubbing / points.shear))
        if points.plain:
            return lost
        return lost + float(np.sum(operator.pulled(normal) * self._rise())) + self._torn(q)

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
        with np.errstate(all="ignore"):  # sums round by more than the least of changes
            slid = np.where(over != 0.0, np.clip(over / change, 0.0, 1.0), 0.0)
        lost = np.where(np.abs(first) > limit, np.sign(first), 0.0)
        mean = shear_over_step(first, change, 0.0, limit)[0] + self.late * change
        rubs = np.abs(mean) > limit
        by_change = 0.5 * (1.0 - slid) ** 2 + self.late
        by_limit = (1.0 - slid) * lost + slid * np.sign(change)
        return np.where(rubs, 0.0, by_change), np.where(rubs, np.sign(mean), by_limit)


def _share(missed: Array, before: Array, share: float) -> float:
    """Share of what is missed to make up in the next turn, by Aitken's method."""
    # Irons and Tuck, Int. J. Numer. Meth. Eng. 1 (1969) 275-277.
    change = missed - before
    found = -share * float(before @ change) / max(float(change @ change), NONE)
    return min(max(found, LEAST), MOST)
