"""Joint forces averaged over a time step, and the joint memory at its end.

Opening and slip are linear in time over the step. Damping that follows the joints shifts openings
by its time lag, g + β ġ, so that a joint closes and opens earlier, and never pulls.

With dilatancy the opening of a point grows linearly over the step, to the value that belongs to the
slip at its end. It follows from fixed-point iteration: a step is solved with one value, and
`with_dilatancy` returns the step with the next. The normal force acts on the gap less the dilatancy
opening; friction dissipates μ N |s| less the work N tan ψ |s| of opening, which is not negative.
Bonds break or soften at the end of a step; the energy stored in the part that they lose is then
lost.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from archfem._typing import Array
from archfem.joints.contact_law import (
    ZERO_DIVISION_GUARD,
    lagged_path,
    mean_shear_tangent,
    shear_loss,
    shear_over_step,
)
from archfem.joints.normal_law import dilatancy_opening
from archfem.joints.operator import JointOperator


@dataclass(frozen=True, eq=False)
class StepForces:
    """Mean joint forces of a time step from a state with known joint memory."""

    operator: JointOperator  # with the joint memory at the start
    start: Array  # coordinates at its start (n,)
    damping_lag: float  # time lag of damping over the length of the step, β/Δt [-]
    # opening of each point by dilatancy at the end (p,) [m]; None as at the start
    end_opening: Array | None = None
    # error of the last iterate of that opening (p,) [m], and the relaxation factor applied [-]
    last_correction: tuple[Array, float] | None = None

    @cached_property
    def _before(self) -> tuple[Array, Array]:
        """Effective gaps and elastic shear forces at the start, each (p,)."""
        return self.operator.effective_gaps(self.start), self.operator.trial_shear(self.start)

    def _gap_path(self, q: Array) -> tuple[Array, Array]:
        """Return the gaps at start and end, plus their change times `damping_lag`, each (p,)."""
        before, after = self._before[0], self.operator.effective_gaps(q, self.end_opening)
        return lagged_path(before, after, self.damping_lag)

    def _shear_path(self, q: Array) -> tuple[Array, Array]:
        """Return the elastic shear at the start and its change without further slip (p,) [N]."""
        return self._before[1], self.operator.trial_shear(q) - self._before[1]

    def _means(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Return mean normal force, mean shear, Coulomb's limit, shear lost by slip (p,)."""
        normal, closed = self.operator.normal_law.step_means(*self._gap_path(q), self.damping_lag)
        limit = self.operator.coulomb_limit(normal, closed)
        shear, lost = shear_over_step(*self._shear_path(q), self.damping_lag, limit)
        return normal, shear, limit, lost

    def _point_forces(self, q: Array) -> tuple[Array, Array]:
        """Return mean normal and shear forces, each (p,) [N]."""
        normal, shear, *_ = self._means(q)
        return self.operator.add_bond_pull(normal), shear

    def force(self, q: Array) -> Array:
        """Return the mean of the generalised forces of the joints (n,)."""
        return self.operator.generalised_force(*self._point_forces(q))

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m]."""
        return self.operator.sum_resultants(*self._point_forces(q))

    def updated_memory(self, q: Array) -> Array:
        """Return the joint memory at the end of the step, as `JointOperator.memory`."""
        operator, (_, _, limit, lost) = self.operator, self._means(q)
        if operator.bonds is None:
            return operator.add_slip(lost)
        gaps = operator.effective_gaps(q, self.end_opening)
        return operator.add_breakage(gaps, operator.bonds.find_exceeded(gaps), lost, limit)

    def with_dilatancy(self, q: Array) -> "StepForces":
        """Return the step with the dilatancy opening due to the slip on the way to q."""
        points = self.operator.points
        if points.dilatancy is None:
            return self
        limit, slip = self._means(q)[2], self.updated_memory(q)[: len(points.offset)]
        target, initial = dilatancy_opening(points, slip), self.operator.dilatancy_opening
        assert target is not None
        initial = np.zeros_like(slip) if initial is None else initial
        present = initial if self.end_opening is None else self.end_opening
        error = target - present
        # converged within round-off of the largest opening in the step, or of an elastic slip
        scale = np.abs(target - initial).max()
        elastic = (points.dilatancy * limit / points.shear_spring).max()
        if np.abs(error).max() <= 1e-9 * max(scale, elastic):
            return self
        factor = 1.0
        if self.last_correction is not None:
            factor = _aitken_factor(error, *self.last_correction)
        return replace(self, end_opening=present + factor * error, last_correction=(error, factor))

    def _opening_change(self) -> Array | float:
        """Return the growth of the dilatancy opening over the step (p,) [m]."""
        initial = self.operator.dilatancy_opening
        if self.end_opening is None:
            return 0.0
        return self.end_opening if initial is None else self.end_opening - initial

    def _bond_energy_loss(self, q: Array) -> float:
        """Return the energy that bonds lose at the end of the step [J]."""
        operator = self.operator
        if operator.bonds is None:
            return 0.0
        gaps = operator.gaps_of_faces(q, self.end_opening)
        after = operator.with_memory(self.updated_memory(q))
        return float(np.sum(operator.normal_energies(gaps) - after.normal_energies(gaps)))

    def dissipation(self, q: Array) -> float:
        """Return the energy lost to friction, broken bonds and damping [J]; never negative."""
        operator, points = self.operator, self.operator.points
        before, after = self._before[0], operator.effective_gaps(q, self.end_opening)
        normal, _, limit, _ = self._means(q)
        # damping across: lagged less unlagged mean force, on the change of the gap
        across = (normal - operator.normal_law.step_means(before, after)[0]) @ (after - before)
        along = shear_loss(*self._shear_path(q), self.damping_lag, limit)
        lost = float(across + np.sum(along / points.shear_spring))
        if points.is_plain:
            return lost
        opened = np.sum(operator.add_bond_pull(normal) * self._opening_change())
        return lost + float(opened) + self._bond_energy_loss(q)

    def stiffness(self, q: Array) -> Array:
        """Return the derivative of the mean force, for `JointOperator.tangent_map` (m,) [N/m]."""
        operator, points, lag = self.operator, self.operator.points, self.damping_lag
        # by how much the lagged gaps at both ends change with the gap at the end
        path, rates = self._gap_path(q), (lag, 1.0 + lag)
        across = operator.normal_law.mean_stiffness(*path, rates)
        if not operator.slides:
            return np.concatenate([across, (0.5 + lag) * points.shear_spring])
        by_change, by_limit = mean_shear_tangent(*self._shear_path(q), lag, self._means(q)[2])
        area_rate = operator.law.mean_area_rate(*path, rates)
        coupling = operator.friction_coupling(across, area_rate, by_limit)
        return np.concatenate([across, by_change * points.shear_spring, coupling])


def _aitken_factor(error: Array, last_error: Array, last_factor: float) -> float:
    """Return the relaxation factor of a fixed-point iteration by Aitken's method."""
    # Irons and Tuck, Int. J. Numer. Meth. Eng. 1 (1969) 275-277, bounded to 0.05 to 2
    change = error - last_error
    scale = max(float(change @ change), ZERO_DIVISION_GUARD)
    return min(max(-last_factor * float(last_error @ change) / scale, 0.05), 2.0)
