"""Points on the joints, and the forces there from openings and slips.

How the traction between and at the points becomes the forces f is the law's: springs at quadrature
points, f = W t, or the exact integral over facets along which opening and slip are linear.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.law import is_closed, normal_traction
from archfem.joints.quadrature import Quadrature
from archfem.masonry.structure import Structure

Numbers = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class JointPoints:
    """Quadrature points on the joints of a structure.

    Attributes:
        joint: number of the joint each point lies on (p,).
        arm: distance from the joint's mid-point toward the extrados (p,) [m].
        weight: joint area that each point stands for, width included (p,) [m²].
        normal_stiffness: k_n (p,) [Pa/m].
        shear_stiffness: k_s (p,) [Pa/m].
        count: number of joints.
    """

    joint: Numbers
    arm: Array
    weight: Array
    normal_stiffness: Array
    shear_stiffness: Array
    count: int

    @classmethod
    def on(cls, structure: Structure, rules: list[tuple[Array, Array]]) -> "JointPoints":
        """Return points put on the joints of a structure.

        Args:
            structure: whose joints they lie on.
            rules: of each joint, the arms of its points and the length that each stands for (p,)
                [m].
        """
        sizes = [len(arms) for arms, _ in rules]
        joint = np.repeat(np.arange(len(rules)), sizes)
        contacts = [each.contact for each in structure.joints]
        return cls(
            joint,
            np.concatenate([arms for arms, _ in rules]),
            np.concatenate([lengths for _, lengths in rules]) * structure.width,
            np.array([contact.normal_stiffness for contact in contacts])[joint],
            np.array([contact.shear_stiffness for contact in contacts])[joint],
            len(rules),
        )


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

    @cached_property
    def shear(self) -> sparse.csr_matrix:
        """Shear forces at the points from slips (p, p) [N/m]."""
        return sparse.diags(self.points.weight * self.points.shear_stiffness).tocsr()

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


@dataclass(frozen=True, eq=False)
class Facets:
    """The traction integrated exactly over facets along which the opening is linear.

    With φ the two linear functions of a facet and c the part of it that is closed,

        f_i = K_ij g_j,   K_ij = ∫_c w k_n φ_i φ_j,

    and because the traction vanishes at the end of c, K is the derivative of f as well.

    Attributes:
        points: two to a facet, its ends, in turn.
    """

    points: JointPoints

    @property
    def _starts(self) -> Numbers:
        return np.arange(0, len(self.points.arm), 2)

    @property
    def entries(self) -> tuple[Numbers, Numbers]:
        """Pairs of points whose forces and openings are coupled."""
        a, b = self._starts, self._starts + 1
        return np.concatenate([a, a, b, b]), np.concatenate([a, b, a, b])

    @cached_property
    def _normal(self) -> Array:
        both = self.points.weight * self.points.normal_stiffness
        return both[0::2] + both[1::2]

    @cached_property
    def shear(self) -> sparse.csr_matrix:
        """Shear forces at the ends from slips, exact for linear slip (p, p) [N/m]."""
        both = self.points.weight * self.points.shear_stiffness
        whole = sparse.diags((both[0::2] + both[1::2]) / 6.0)
        return sparse.kron(whole, [[2.0, 1.0], [1.0, 2.0]]).tocsr()

    def _closed(self, opening: Array) -> tuple[Array, Array, Array]:
        """∫_c φ_i φ_j over a facet of unit length, for (1, 1), (1, 2) and (2, 2)."""
        a, b = opening[0::2], opening[1::2]
        with np.errstate(divide="ignore", invalid="ignore"):
            zero = np.where(a != b, np.clip(a / (a - b), 0.0, 1.0), 0.0)
        start = np.where(is_closed(a), 0.0, zero)
        end = np.where(is_closed(b), 1.0, zero)
        closed = is_closed(a) | is_closed(b)
        start, end = np.where(closed, start, 0.0), np.where(closed, end, 0.0)
        squares, cubes = (end**2 - start**2) / 2.0, (end**3 - start**3) / 3.0
        return (end - start) - 2.0 * squares + cubes, squares - cubes, cubes

    def forces(self, opening: Array) -> Array:
        """Return the normal forces at the ends of the facets, positive where they pull (p,) [N].

        Args:
            opening: gaps at the ends, positive where open (p,) [m].
        """
        first, mixed, second = self._closed(opening)
        a, b = opening[0::2], opening[1::2]
        ends = self._normal * np.stack([first * a + mixed * b, mixed * a + second * b])
        return ends.T.ravel()

    def stiffness(self, opening: Array) -> Array:
        """Return the derivative of `forces`, one number for each of `entries` (2 p,) [N/m].

        Args:
            opening: gaps at the ends (p,) [m].
        """
        first, mixed, second = self._closed(opening)
        return np.concatenate([self._normal * k for k in (first, mixed, mixed, second)])


Law = Springs | Facets


def law_of(rule: Quadrature, points: JointPoints) -> Law:
    """Return the law that a quadrature rule asks for.

    Args:
        rule: quadrature on each facet.
        points: that it has put on the joints.
    """
    return Facets(points) if rule.rule == "exact" else Springs(points)
