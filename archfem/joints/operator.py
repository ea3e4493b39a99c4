"""The joint operator: from coordinates to opening and slip at points, and back to forces.

With G the sparse operator that takes generalised coordinates q to (opening, slip) at points along
the joints, the forces of all joints are Gᵀ f(G q) and their tangent is Gᵀ f' G. Whatever the
coordinates are (nodes, rigid motions, modes), the rest is the same. How the traction between and
at the points becomes the forces f is the law's: springs at quadrature points, f = W t, or the exact
integral over facets along which opening and slip are linear.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.law import is_closed, normal_traction
from archfem.joints.quadrature import Quadrature
from archfem.joints.sparsity import Pattern
from archfem.masonry.structure import Structure

Numbers = NDArray[np.intp]
Status = NDArray[np.bool_]


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
        """Put points on joints, given each joint's arms [m] and lengths [m]."""
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
        """Normal forces at the points, positive where they pull (p,) [N]."""
        return normal_traction(opening, self._normal)

    def stiffness(self, opening: Array) -> Array:
        """Derivative of `forces`, one number for each of `entries` [N/m]."""
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
        """Normal forces at the ends of the facets, positive where they pull (p,) [N]."""
        first, mixed, second = self._closed(opening)
        a, b = opening[0::2], opening[1::2]
        ends = self._normal * np.stack([first * a + mixed * b, mixed * a + second * b])
        return ends.T.ravel()

    def stiffness(self, opening: Array) -> Array:
        """Derivative of `forces`, one number for each of `entries` [N/m]."""
        first, mixed, second = self._closed(opening)
        return np.concatenate([self._normal * k for k in (first, mixed, mixed, second)])


Law = Springs | Facets


@dataclass(frozen=True, eq=False)
class JointOperator:
    """Opening and slip along the joints as linear functions of coordinates, and their forces.

    Attributes:
        law: forces from openings and slips, and the points at which those are taken.
        opening: rows of G for the opening, positive open (p, n).
        slip: rows of G for the slip, of the higher block toward the extrados (p, n).
        offset: opening and slip at q = 0, which supports cause that have moved (2, p) [m], or None.
    """

    law: Law
    opening: sparse.csr_matrix
    slip: sparse.csr_matrix
    offset: Array | None = None

    @property
    def points(self) -> JointPoints:
        """Where openings and slips are taken."""
        return self.law.points

    @cached_property
    def _back(self) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        return self.opening.T.tocsr(), (self.slip.T @ self.law.shear).tocsr()

    @cached_property
    def sums(self) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """Matrices (n_joints, p) that sum forces over each joint, and their moments."""
        points = self.points
        shape = (points.count, len(points.arm))
        places = (points.joint, np.arange(len(points.arm)))
        force = sparse.csr_matrix((np.ones(shape[1]), places), shape)
        return force, sparse.csr_matrix((points.arm, places), shape)

    def openings(self, q: Array) -> Array:
        """Openings at the points (p,) [m]."""
        return self.opening @ q if self.offset is None else self.opening @ q + self.offset[0]

    def slips(self, q: Array) -> Array:
        """Slips at the points (p,) [m]."""
        return self.slip @ q if self.offset is None else self.slip @ q + self.offset[1]

    def force(self, q: Array) -> Array:
        """Generalised forces that the joints exert, as internal forces (n,)."""
        normal, shear = self._back
        return normal @ self.law.forces(self.openings(q)) + shear @ self.slips(q)

    def energy(self, q: Array) -> float:
        """Energy stored in the joints [J]; forces are homogeneous, so it is half of f·g."""
        opening, slip = self.openings(q), self.slips(q)
        return 0.5 * float(opening @ self.law.forces(opening) + slip @ (self.law.shear @ slip))

    def status(self, q: Array) -> Status:
        """Which points are closed (p,)."""
        return is_closed(self.openings(q))

    def stiffness(self, q: Array) -> Array:
        """The numbers on which the tangent depends, for `normal_stiffness` (entries,) [N/m]."""
        return self.law.stiffness(self.openings(q))

    def normal_stiffness(self, pattern: Pattern) -> sparse.csr_matrix:
        """The linear map from `stiffness` to the entries of the tangent on a pattern (nnz, m)."""
        first, second = (self.opening[side] for side in self.law.entries)
        return pattern.outer(first, second)

    def shear_stiffness(self) -> sparse.csr_matrix:
        """The part of the tangent that never changes (n, n)."""
        return self._back[1] @ self.slip

    def shear_resultants(self) -> sparse.csr_matrix:
        """Shear resultant of each joint from coordinates, sparse (n_joints, n) [N]."""
        return (self.sums[0] @ self.law.shear @ self.slip).tocsr()

    def couplings(self) -> sparse.csr_matrix:
        """A matrix with an entry wherever the tangent may have one, whatever cancels (n, n)."""
        first, second = self.law.entries
        opening, slip = _ones(self.opening), _ones(self.slip)
        across = opening[first].T @ opening[second]
        return (across + slip.T @ (_ones(self.law.shear) @ slip)).tocsr()

    def resultants(self, q: Array) -> Array:
        """N, V, M of every joint (n_joints, 3) [N, N, N m].

        N = -∫ w t_n,   V = ∫ w t_s,   M = -∫ w t_n r
        """
        normal = self.law.forces(self.openings(q))
        shear = self.law.shear @ self.slips(q)
        force, moment = self.sums
        return np.stack([-(force @ normal), force @ shear, -(moment @ normal)], axis=1)

    def projected(self, basis: sparse.csr_matrix) -> "JointOperator":
        """Express the same joints in the coordinates of a basis (n, m): G B."""
        return replace(self, opening=self.opening @ basis, slip=self.slip @ basis)

    def spanned(self, whole: Sequence[bool]) -> "JointOperator":
        """One facet instead of several on each joint that moves as a plane (n_joints,).

        Only for `Facets`: the first and the last point of the joint become the facet's ends.
        """
        points = self.points
        first = np.searchsorted(points.joint, np.arange(points.count))
        last = np.append(first[1:], len(points.joint)) - 1
        rows, weight = [], points.weight.copy()
        for joint, plane in enumerate(whole):
            own = np.arange(first[joint], last[joint] + 1)
            if plane:
                weight[[own[0], own[-1]]] = points.weight[own].sum() / 2.0
                own = own[[0, -1]]
            rows.append(own)
        kept = np.concatenate(rows)
        chosen = JointPoints(
            points.joint[kept],
            points.arm[kept],
            weight[kept],
            points.normal_stiffness[kept],
            points.shear_stiffness[kept],
            points.count,
        )
        offset = None if self.offset is None else self.offset[:, kept]
        return JointOperator(Facets(chosen), self.opening[kept], self.slip[kept], offset)


def _ones(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """A matrix of ones wherever another stores an entry, zero or not."""
    return sparse.csr_matrix((np.ones(matrix.nnz), matrix.indices, matrix.indptr), matrix.shape)


def law_of(rule: Quadrature, points: JointPoints) -> Law:
    """The law that a quadrature rule asks for."""
    return Facets(points) if rule.rule == "exact" else Springs(points)
