"""Saw teeth and bonds: what joints that dilate or resist tension add to the law of dry ones.

Both shift the gap that the normal law sees. Teeth raise the faces by tan ψ |s|, with s what a point
has slid for good. A bond that is intact stretches by g_t = f_t / k_n before it would give, and

    t_n = k_n <g - g_t>_- + f_t,    |t_s| ≤ (c - μ f_t) - μ k_n <g - g_t>_-

is linear elastic up to f_t and stays there until the bond is declared broken; the limit is that of
the true traction, μ |t_n| + c. So all that is known of the law of dry joints holds, on average
over a step too, with a gap that is shifted, a pull that is constant, and another cohesion. Along a
facet between an intact and a broken end the bond fades linearly.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.joints.integration import Law
from archfem.joints.points import JointPoints

EXCEEDED = 1e-9
"""Excess over the strength of a bond, relative to it, that is rounding of one that holds."""

ALIKE = 1e-6
"""Difference between gaps, relative, by which points of a joint gape alike and break together."""


def ridden(points: JointPoints, slid: Array) -> Array | None:
    """Return how far saw teeth raise each point (p,) [m]; None where none has teeth.

    Args:
        points: on the joints.
        slid: how far each has slid for good (p,) [m].
    """
    return None if points.dilatancy is None else points.dilatancy * np.abs(slid)


@dataclass(frozen=True, eq=False)
class Bonds:
    """Which points of the joints are still bonded, and what that does to the normal law.

    Attributes:
        law: normal forces from gaps, of points some of which have tensile strength.
        broken: where bonds are broken for good, 1, else 0 (p,).
    """

    law: Law
    broken: Array

    @cached_property
    def intact(self) -> NDArray[np.bool_]:
        """Which points are bonded (p,)."""
        intact: NDArray[np.bool_] = (self._strength > 0.0) & (self.broken == 0.0)
        return intact

    @cached_property
    def stretch(self) -> Array:
        """Gap at which each point reaches its tensile strength, f_t / k_n; 0 unbonded (p,) [m]."""
        stretch: Array = np.where(self.intact, self._strength, 0.0)
        return stretch / self.law.points.normal_stiffness

    @cached_property
    def pull(self) -> Array:
        """Force f_t of each point while its gap is `stretch` (p,) [N]."""
        return normal_forces(self.law, self.stretch)

    @cached_property
    def cohesion(self) -> Array:
        """Cohesion beside the shifted law: c - μ f_t intact, 0 broken (p,) [Pa]."""
        points = self.law.points
        with np.errstate(invalid="ignore"):  # of points that never slide
            lowered = points.cohesion - points.friction * self._strength
        bonded = np.where(self.intact, np.maximum(lowered, 0.0), 0.0)
        return np.where(self._strength > 0.0, bonded, points.cohesion)

    def stored(self, felt: Array) -> Array:
        """Return the energy that pulls add to that of the shifted law, at each point (p,) [J].

        Args:
            felt: gap that the law sees, less than the gap by `stretch` (p,) [m].
        """
        stored: Array = self.pull * (felt + 0.5 * self.stretch)
        return stored

    def torn(self, felt: Array) -> NDArray[np.bool_]:
        """Return which bonds are pulled beyond their strength (p,).

        Args:
            felt: gap that the law sees (p,) [m].
        """
        torn: NDArray[np.bool_] = self.intact & (felt > EXCEEDED * self.stretch)
        return torn

    def worst(self, felt: Array) -> NDArray[np.bool_]:
        """Return which bonds are torn, of each joint only where it gapes most (p,).

        Args:
            felt: gap that the law sees (p,) [m].
        """
        torn, joint = self.torn(felt), self.law.points.joint
        most = np.zeros(self.law.points.count)
        np.maximum.at(most, joint, np.where(torn, felt, 0.0))
        return torn & (felt >= (1.0 - ALIKE) * most[joint])

    def after(self, torn: NDArray[np.bool_], excess: Array, limit: Array) -> Array:
        """Return where bonds are broken at the end of a step, as `broken` (p,).

        Args:
            torn: which are pulled apart (p,).
            excess: shear that friction did not hold, 0 where a point never slides (p,) [N].
            limit: of the shear (p,) [N].
        """
        points = self.law.points
        most = EXCEEDED * (limit + points.cohesion * points.weight)
        broken = self.intact & (torn | (np.abs(excess) > most))
        return np.where(broken, 1.0, self.broken)

    @property
    def _strength(self) -> Array:
        strength = self.law.points.tension
        return np.zeros_like(self.broken) if strength is None else strength


def normal_forces(law: Law, gaps: Array) -> Array:
    """Return the normal forces at the points if joints held tension without limit (p,) [N].

    Args:
        law: of the joints.
        gaps: at the points (p,) [m].
    """
    first, second = law.entries
    forces = np.zeros_like(gaps)
    np.add.at(forces, first, law.stiffness(np.full(len(gaps), -1.0)) * gaps[second])
    return forces
