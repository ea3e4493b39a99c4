"""Joints whose limits of friction are given: Tresca's law, with which equilibria are minima.

Coulomb's limit follows the normal force, which makes tangents unsymmetric and lets Newton's method
cycle. With limits that stay the energy is convex. Equilibria under Coulomb's law are then sought as
those under limits which are taken from the last one: Haslinger, Hlaváček and Nečas, Handbook of
Numerical Analysis IV (1996).
"""

from dataclasses import dataclass, field

import numpy as np

from archfem.arrays import Array
from archfem.joints.operator import TOUCHING, JointOperator


@dataclass(frozen=True, eq=False)
class GivenLimits(JointOperator):
    """The joint operator, with limits of the shear that do not follow the normal forces.

    Attributes:
        given: limit at each point, not negative (p,) [N].
    """

    given: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, joints: JointOperator, given: Array) -> "GivenLimits":
        """Return joints with given limits.

        Args:
            joints: whose points, coordinates and memory they have.
            given: limits (p,) [N].
        """
        parts = joints.law, joints.opening, joints.slip, joints.offset, joints.slid, joints.broken
        return cls(*parts, given)

    def limits(self, normal: Array, closed: Array) -> Array:
        """Return the limits that were given (p,) [N].

        Args:
            normal: forces, which do not matter here (p,) [N].
            closed: areas, which do not either (p,) [m²].
        """
        return self.given

    def stiffness(self, q: Array) -> Array:
        """Return the numbers on which the tangent depends, as `tangents` takes them (m,) [N/m].

        Args:
            q: coordinates (n,).
        """
        across = self.law.stiffness(self.felt(q))
        over = self.points.slides & (np.abs(self.elastic(q)) > (1.0 + TOUCHING) * self.given)
        along = np.where(over, 0.0, self.points.shear)
        return np.concatenate([across, along, *([np.zeros_like(across)] if self.slides else [])])
