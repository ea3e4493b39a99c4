"""Dilatancy and tensile bonds: their effect on the law of dry joints.

Both shift the gap of the normal law. Dilatancy, by saw teeth of the angle ψ, opens a joint by
tan ψ |s_p|, with s_p the irreversible slip. An intact bond reaches its tensile strength f_t at the
gap g_t = f_t / k_n, and

    t_n = k_n <g - g_t>_- + f_t,    |t_s| ≤ (c - μ f_t) - μ k_n <g - g_t>_-

is linear elastic up to f_t and stays there until the bond is declared broken; the limit is that of
the true traction, μ |t_n| + c. The law of dry joints therefore holds, also averaged over a step,
with a shifted gap, a constant pull and another cohesion. Along a facet between an intact and a
broken end the bond decreases linearly.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.joints.contact_law import Law
from archfem.joints.quadrature import JointPoints

# Excess over the strength of a bond, relative to it, that counts as round-off [-]
BOND_STRENGTH_TOLERANCE = 1e-9


def dilatancy_opening(points: JointPoints, slip: Array) -> Array | None:
    """Return the opening of each point by dilatancy (p,) [m]; None without dilatancy."""
    return None if points.dilatancy is None else points.dilatancy * np.abs(slip)


@dataclass(frozen=True, eq=False)
class Bonds:
    """Intact and broken bonds of the joint points."""

    law: Law  # normal forces from gaps
    broken: Array  # 1 where a bond is broken, else 0 (p,)

    @cached_property
    def intact(self) -> NDArray[np.bool_]:
        """Whether each point has an intact bond (p,)."""
        return (self._strength > 0.0) & (self.broken == 0.0)

    @cached_property
    def stretch(self) -> Array:
        """Gap at the tensile strength, f_t / k_n; 0 without bond (p,) [m]."""
        return np.where(self.intact, self._strength, 0.0) / self.law.points.normal_stiffness

    @cached_property
    def pull(self) -> Array:
        """Force of each point at the gap `stretch`, f_t times its area (p,) [N]."""
        return normal_forces(self.law, self.stretch)

    @cached_property
    def cohesion(self) -> Array:
        """Cohesion for gaps less `stretch`: c - μ f_t if bonded, 0 if broken (p,) [Pa]."""
        points = self.law.points
        with np.errstate(invalid="ignore"):  # infinite friction times zero strength
            lowered = points.cohesion - points.friction * self._strength
        bonded = np.where(self.intact, np.maximum(lowered, 0.0), 0.0)
        return np.where(self._strength > 0.0, bonded, points.cohesion)

    def energy_of_pull(self, gaps: Array) -> Array:
        """Return the energy of the forces `pull`, from gaps less `stretch` (p,) [J]."""
        return self.pull * (gaps + 0.5 * self.stretch)

    def find_exceeded(self, gaps: Array) -> NDArray[np.bool_]:
        """Return which bonds are pulled beyond their strength, from gaps less `stretch` (p,)."""
        return self.intact & (gaps > BOND_STRENGTH_TOLERANCE * self.stretch)

    def most_exceeded(self, gaps: Array) -> NDArray[np.bool_]:
        """Return the bonds beyond their strength at the largest gap of each joint (p,)."""
        exceeded, joint = self.find_exceeded(gaps), self.law.points.joint
        largest = np.zeros(self.law.points.joint_count)
        np.maximum.at(largest, joint, np.where(exceeded, gaps, 0.0))
        # points with gaps equal but for round-off break together
        return exceeded & (gaps >= (1.0 - 1e-6) * largest[joint])

    def broken_after(self, exceeded: NDArray[np.bool_], excess: Array, limit: Array) -> Array:
        """Return the flags of broken bonds at the end of a step, as `broken` (p,)."""
        points = self.law.points
        tolerance = BOND_STRENGTH_TOLERANCE * (limit + points.cohesion * points.weight)
        # a bond also breaks once its point slides
        broken = self.intact & (exceeded | (np.abs(excess) > tolerance))
        return np.where(broken, 1.0, self.broken)

    @property
    def _strength(self) -> Array:
        strength = self.law.points.tension
        return np.zeros_like(self.broken) if strength is None else strength


def normal_forces(law: Law, gaps: Array) -> Array:
    """Return the normal forces at the points of joints closed all over (p,) [N]."""
    first, second = law.coupling_pairs
    forces = np.zeros_like(gaps)
    np.add.at(forces, first, law.stiffness(np.full(len(gaps), -1.0)) * gaps[second])
    return forces
