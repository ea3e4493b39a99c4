"""Normal forces at points of the joints that are springs of their own, from openings.

At an instant and in the mean of a step, along which openings change linearly, both with their
derivatives, and the area on which each point is closed; `facets` has the same methods.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from archfem.arrays import Array
from archfem.joints.law import (
    closed_time,
    closed_time_rate,
    is_closed,
    mean_closing,
    mean_closing_rate,
    normal_traction,
)
from archfem.joints.points import JointPoints, Numbers


@dataclass(frozen=True, eq=False)
class Springs:
    """The traction integrated by a quadrature rule: each point is a spring of its own.

    The stiffness of the points is all or nothing, so the tangent changes only with the status.

    Attributes:
        points: where the springs are.
    """

    points: JointPoints

    @property
    def entries(self) -> tuple[Numbers, Numbers]:
        """Pairs of points whose forces and openings are coupled."""
        number = np.arange(len(self.points.arm))
        return number, number

    @cached_property
    def _normal(self) -> Array:
        return self.points.weight * self.points.normal_stiffness

    def forces(self, opening: Array) -> Array:
        """Return the normal forces at the points, positive where they pull (p,) [N].

        Args:
            opening: gaps at the points, positive where open (p,) [m].
        """
        forces: Array = normal_traction(opening, self._normal)
        return forces

    def stiffness(self, opening: Array) -> Array:
        """Return the derivative of `forces`, one number for each of `entries` (p,) [N/m].

        Args:
            opening: gaps at the points (p,) [m].
        """
        return np.where(is_closed(opening), self._normal, 0.0)

    def closed(self, opening: Array) -> Array:
        """Return the area on which each point is closed (p,) [m²].

        Args:
            opening: gaps at the points (p,) [m].
        """
        return np.where(is_closed(opening), self.points.weight, 0.0)

    def closed_rate(self, opening: Array) -> Array:
        """Return the derivative of `closed`, one number for each of `entries` (p,) [m].

        Args:
            opening: gaps at the points (p,) [m].
        """
        return np.zeros_like(opening)

    def mean(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Return the means over a step of `forces` and `closed`, each (p,) [N, m²].

        Args:
            start: gaps at its start (p,) [m].
            end: gaps at its end (p,) [m].
        """
        area: Array = self.points.weight * closed_time(start, end)
        return self._normal * mean_closing(start, end), area

    def mean_stiffness(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean force by a parameter, for each of `entries` (p,) [N/m].

        Args:
            start: gaps at the start of the step (p,) [m].
            end: gaps at its end (p,) [m].
            rates: change of both per change of the parameter [-].
        """
        return self._normal * mean_closing_rate(start, end, rates)

    def mean_closed_rate(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean area by a parameter, for each of `entries` (p,) [m].

        Args:
            start: gaps at the start of the step (p,) [m].
            end: gaps at its end (p,) [m].
            rates: change of both per change of the parameter [-].
        """
        return self.points.weight * closed_time_rate(start, end, rates)
