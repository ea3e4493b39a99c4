"""The joint operator: from coordinates to opening and slip at points, and back to forces.

With G the sparse operator that takes generalised coordinates q to (opening, slip) at points along
the joints, the forces of all joints are Gᵀ f(G q) and their tangent is Gᵀ f' G. Whatever the
coordinates are (nodes, rigid motions, modes), the rest is the same. How the traction becomes the
forces f is told in `points`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.law import is_closed
from archfem.joints.points import Facets, JointPoints, Law
from archfem.joints.sparsity import Pattern

Status = NDArray[np.bool_]


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
        """Return the openings at the points, positive where open (p,) [m].

        Args:
            q: coordinates (n,).
        """
        found: Array = self.opening @ q
        return found if self.offset is None else found + self.offset[0]

    def slips(self, q: Array) -> Array:
        """Return the slips at the points, of the higher block toward the extrados (p,) [m].

        Args:
            q: coordinates (n,).
        """
        found: Array = self.slip @ q
        return found if self.offset is None else found + self.offset[1]

    def force(self, q: Array) -> Array:
        """Return the generalised forces that the joints exert, as internal forces (n,).

        Args:
            q: coordinates (n,).
        """
        normal, shear = self._back
        force: Array = normal @ self.law.forces(self.openings(q)) + shear @ self.slips(q)
        return force

    def energy(self, q: Array) -> float:
        """Return the energy stored in the joints [J]: half of f·g, as forces are homogeneous.

        Args:
            q: coordinates (n,).
        """
        opening, slip = self.openings(q), self.slips(q)
        return 0.5 * float(opening @ self.law.forces(opening) + slip @ (self.law.shear @ slip))

    def status(self, q: Array) -> Status:
        """Return which points are closed (p,).

        Args:
            q: coordinates (n,).
        """
        return is_closed(self.openings(q))

    def stiffness(self, q: Array) -> Array:
        """Return the numbers on which the tangent depends, as `matrices` takes them (m,) [N/m].

        Args:
            q: coordinates (n,).
        """
        return self.law.stiffness(self.openings(q))

    def matrices(self, pattern: Pattern) -> tuple[Array, sparse.csr_matrix]:
        """Return the parts of the tangent on a pattern, as always + across @ `stiffness`.

        Args:
            pattern: that has all `couplings` (nnz entries).

        Returns:
            Entries that never change, of the slips (nnz,), and the linear map from `stiffness` to
            the entries of the openings (nnz, m).
        """
        first, second = (self.opening[side] for side in self.law.entries)
        return pattern.spread(self.shear_stiffness()).data, pattern.outer(first, second)

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
        """Return N, V, M of every joint (n_joints, 3) [N, N, N m].

        N = -∫ w t_n,   V = ∫ w t_s,   M = -∫ w t_n r

        Args:
            q: coordinates (n,).
        """
        normal = self.law.forces(self.openings(q))
        shear = self.law.shear @ self.slips(q)
        force, moment = self.sums
        return np.stack([-(force @ normal), force @ shear, -(moment @ normal)], axis=1)

    def projected(self, basis: sparse.csr_matrix) -> "JointOperator":
        """Return the same joints in the coordinates of a basis, G B.

        Args:
            basis: what each new coordinate is in the old ones (n, m).
        """
        return replace(self, opening=self.opening @ basis, slip=self.slip @ basis)

    def spanned(self, whole: Sequence[bool]) -> "JointOperator":
        """Return one facet instead of several on each joint whose faces stay plane.

        Only for `Facets`: the first and the last point of the joint become the facet's ends.

        Args:
            whole: whether they stay plane, for each joint (n_joints,).
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
