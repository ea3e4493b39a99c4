"""Openings and slips along the joints as linear functions of coordinates, and back to forces.

G takes generalised coordinates q to (opening, slip) at points along the joints, Gᵀ takes forces
there to generalised ones. Whatever the coordinates are (nodes, rigid motions, modes), and whatever
the forces, the rest is the same.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.integration import Law
from archfem.joints.points import JointPoints
from archfem.joints.sparsity import Pattern


@dataclass(frozen=True, eq=False)
class JointKinematics:
    """Opening and slip along the joints, and the sums of what acts there.

    Attributes:
        law: normal forces from openings, and the points at which those are taken.
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

    @property
    def slides(self) -> bool:
        """Whether any point can slide."""
        return bool(self.points.slides.any())

    @cached_property
    def back(self) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """From forces at the points to generalised ones: of openings and of slips, each (n, p)."""
        return self.opening.T.tocsr(), self.slip.T.tocsr()

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

    def pushed(self, normal: Array, shear: Array) -> Array:
        """Return generalised forces from those at the points (n,).

        Args:
            normal: forces, positive where they pull (p,) [N].
            shear: forces (p,) [N].
        """
        force: Array = self.back[0] @ normal + self.back[1] @ shear
        return force

    def summed(self, normal: Array, shear: Array) -> Array:
        """Return N, V, M of every joint from the forces at the points (n_joints, 3) [N, N, N m].

        Args:
            normal: forces, positive where they pull (p,) [N].
            shear: forces (p,) [N].
        """
        force, moment = self.sums
        return np.stack([-(force @ normal), force @ shear, -(moment @ normal)], axis=1)

    def shear_resultants(self) -> sparse.csr_matrix:
        """Elastic shear resultant of each joint from coordinates, sparse (n_joints, n) [N]."""
        return (self.sums[0] @ sparse.diags(self.points.shear) @ self.slip).tocsr()

    def tangents(self, pattern: Pattern) -> sparse.csr_matrix:
        """Return the linear map from stiffnesses to the entries of the tangent (nnz, m).

        Stiffnesses are those of `JointOperator.stiffness`.

        Args:
            pattern: that has all `couplings` (nnz entries).
        """
        first, second = self.law.entries
        maps = [
            pattern.outer(self.opening[first], self.opening[second]),
            pattern.outer(self.slip, self.slip),
        ]
        if self.slides:
            maps.append(pattern.outer(self.slip[first], self.opening[second]))
        return sparse.hstack(maps, "csr")

    def couplings(self) -> sparse.csr_matrix:
        """A matrix with an entry wherever the tangent may have one, whatever cancels (n, n)."""
        first, second = self.law.entries
        opening, slip = _ones(self.opening), _ones(self.slip)
        across = opening[first].T @ opening[second] + slip.T @ slip
        if self.slides:
            across = across + slip[first].T @ opening[second]
        return across.tocsr()

    def projected(self, basis: sparse.csr_matrix) -> Self:
        """Return the same joints in the coordinates of a basis, G B.

        Args:
            basis: what each new coordinate is in the old ones (n, m).
        """
        return replace(self, opening=self.opening @ basis, slip=self.slip @ basis)


def _ones(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """A matrix of ones wherever another stores an entry, zero or not."""
    return sparse.csr_matrix((np.ones(matrix.nnz), matrix.indices, matrix.indptr), matrix.shape)
