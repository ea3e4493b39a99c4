"""The joint operator: from coordinates to opening and slip at points, and back to forces.

With G the sparse operator that takes generalised coordinates q to (opening, slip) at the joint
quadrature points and W their weights, the forces of all joints are Gᵀ W t(G q), their tangent is
Gᵀ W D G. Whatever the coordinates are (nodes, rigid motions, modes), the rest is the same.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.laws import is_closed, normal_traction, shear_traction
from archfem.structure import Array, Structure

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

    joint: NDArray[np.intp]
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

    @cached_property
    def sums(self) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """Matrices (n_joints, p) that sum tractions over each joint to a force, and a moment."""
        points = np.arange(len(self.joint))
        shape = (self.count, len(points))
        force = sparse.csr_matrix((self.weight, (self.joint, points)), shape)
        moment = sparse.csr_matrix((self.weight * self.arm, (self.joint, points)), shape)
        return force, moment

    def resultants(self, normal: Array, shear: Array) -> Array:
        """Resultants N, V, M of the tractions at the points.

            N = -∫ w t_n,   V = ∫ w t_s,   M = -∫ w t_n r

        Args:
            normal: t_n (p,) or (p, steps) [Pa].
            shear: t_s, the same shape [Pa].

        Returns:
            (n_joints, 3) or (n_joints, 3, steps) [N, N, N m].
        """
        force, moment = self.sums
        return np.stack([-(force @ normal), force @ shear, -(moment @ normal)], axis=1)


@dataclass(frozen=True, eq=False)
class JointOperator:
    """Opening and slip at the joint points as linear functions of coordinates.

    Attributes:
        points: where, and how stiff.
        opening: rows of G for the opening, positive open (p, n).
        slip: rows of G for the slip, of the higher block toward the extrados (p, n).
    """

    points: JointPoints
    opening: sparse.csr_matrix
    slip: sparse.csr_matrix

    @cached_property
    def _transposed(self) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        weight = sparse.diags(self.points.weight)
        return (weight @ self.opening).T.tocsr(), (weight @ self.slip).T.tocsr()

    def tractions(self, q: Array) -> tuple[Array, Array]:
        """Normal and shear traction at the points (p,), (p,) [Pa]."""
        return (
            normal_traction(self.opening @ q, self.points.normal_stiffness),
            shear_traction(self.slip @ q, self.points.shear_stiffness),
        )

    def force(self, q: Array) -> Array:
        """Generalised forces that the joints exert, as internal forces (n,)."""
        normal, shear = self.tractions(q)
        opening, slip = self._transposed
        return opening @ normal + slip @ shear

    def energy(self, q: Array) -> float:
        """Energy stored in the joints [J]."""
        normal, shear = self.tractions(q)
        stored = normal**2 / self.points.normal_stiffness + shear**2 / self.points.shear_stiffness
        return 0.5 * float(self.points.weight @ stored)

    def status(self, q: Array) -> Status:
        """Which points are closed (p,)."""
        return is_closed(self.opening @ q)

    def stiffness(self, closed: Status) -> sparse.csr_matrix:
        """Tangent of `force` with these points closed (n, n)."""
        opening, slip = self._transposed
        normal = sparse.diags(np.where(closed, self.points.normal_stiffness, 0.0))
        shear = sparse.diags(self.points.shear_stiffness)
        return (opening @ normal @ self.opening + slip @ shear @ self.slip).tocsr()

    def couplings(self) -> sparse.csr_matrix:
        """A matrix with an entry wherever `stiffness` may have one, whatever cancels (n, n)."""
        opening, slip = abs(self.opening), abs(self.slip)
        return (opening.T @ opening + slip.T @ slip).tocsr()

    def resultants(self, q: Array) -> Array:
        """N, V, M of every joint (n_joints, 3) [N, N, N m]."""
        return self.points.resultants(*self.tractions(q))

    def projected(self, basis: sparse.csr_matrix) -> "JointOperator":
        """Express the same joints in the coordinates of a basis (n, m): G B."""
        return replace(self, opening=self.opening @ basis, slip=self.slip @ basis)
