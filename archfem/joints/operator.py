"""The joint operator: from coordinates to opening and slip at points, and back to forces.

With G the sparse operator that takes generalised coordinates q to (opening, slip) at points along
the joints, the forces of all joints are Gᵀ f(G q) and their tangent is Gᵀ f' G. Whatever the
coordinates are (nodes, rigid motions, modes), the rest is the same. How openings become normal
forces is told in `springs` and `facets`; how slips become shear, and what of it friction holds, in
`law`.

Joints have memory: how far each point has slid for good. It belongs to the operator, whose forces
are those after a load has changed since; `remembered` takes in what has slid meanwhile.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.facets import Facets
from archfem.joints.integration import Law
from archfem.joints.law import held, is_closed
from archfem.joints.points import JointPoints
from archfem.joints.sparsity import Pattern

Status = NDArray[np.bool_]

TOUCHING = 1e-9
"""Excess over Coulomb's limit, relative to it, that is rounding of a point which holds."""

SLIDING = 1e-9
"""Share of its elastic stiffness that the tangent leaves a point which slides: a body that slides
at all its joints, to either side, would be free, though it holds as soon as it moves back."""


@dataclass(frozen=True, eq=False)
class JointOperator:
    """Opening and slip along the joints as linear functions of coordinates, and their forces.

    Attributes:
        law: normal forces from openings, and the points at which those are taken.
        opening: rows of G for the opening, positive open (p, n).
        slip: rows of G for the slip, of the higher block toward the extrados (p, n).
        offset: opening and slip at q = 0, which supports cause that have moved (2, p) [m], or None.
        slid: how far each point has slid for good, that part of the slip which friction did not
            hold (p,) [m]; None where nothing has.
    """

    law: Law
    opening: sparse.csr_matrix
    slip: sparse.csr_matrix
    offset: Array | None = None
    slid: Array | None = None

    @property
    def points(self) -> JointPoints:
        """Where openings and slips are taken."""
        return self.law.points

    @property
    def memory(self) -> Array:
        """How far each point has slid for good (p,) [m]."""
        return np.zeros(len(self.points.arm)) if self.slid is None else self.slid

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

    def elastic(self, q: Array) -> Array:
        """Return the shear forces at the points if nothing slid any further (p,) [N].

        Args:
            q: coordinates (n,).
        """
        slips = self.slips(q)
        return self.points.shear * (slips if self.slid is None else slips - self.slid)

    def limits(self, normal: Array, closed: Array) -> Array:
        """Return Coulomb's limit of the shear at the points; 0 where one never slides (p,) [N].

        Args:
            normal: forces, positive where they pull (p,) [N].
            closed: area on which each point is closed (p,) [m²].
        """
        slides, points = self.points.slides, self.points
        found: Array = points.cohesion * closed
        found[slides] -= points.friction[slides] * normal[slides]
        return np.where(slides, found, 0.0)

    def tractions(self, q: Array) -> tuple[Array, Array]:
        """Return normal and shear forces at the points, each (p,) [N].

        Args:
            q: coordinates (n,).
        """
        opening, shear = self.openings(q), self.elastic(q)
        normal = self.law.forces(opening)
        if not self.slides:
            return normal, shear
        limit = self.limits(normal, self.law.closed(opening))
        return normal, np.where(self.points.slides, held(shear, limit), shear)

    def force(self, q: Array) -> Array:
        """Return the generalised forces that the joints exert, as internal forces (n,).

        Args:
            q: coordinates (n,).
        """
        return self.pushed(*self.tractions(q))

    def pushed(self, normal: Array, shear: Array) -> Array:
        """Return generalised forces from those at the points (n,).

        Args:
            normal: forces, positive where they pull (p,) [N].
            shear: forces (p,) [N].
        """
        force: Array = self.back[0] @ normal + self.back[1] @ shear
        return force

    def energy(self, q: Array) -> float:
        """Return the energy stored in the joints if nothing slid any further [J].

        Args:
            q: coordinates (n,).
        """
        opening, shear = self.openings(q), self.elastic(q)
        stored = opening @ self.law.forces(opening) + shear @ (shear / self.points.shear)
        return 0.5 * float(stored)

    def remembered(self, q: Array) -> Array:
        """Return how far each point has slid for good once it is at q (p,) [m].

        Args:
            q: coordinates (n,).
        """
        further = (self.elastic(q) - self.tractions(q)[1]) / self.points.shear
        slid: Array = self.memory + np.where(self.points.slides, further, 0.0)
        return slid

    def status(self, q: Array) -> Status:
        """Return which points are closed (p,).

        Args:
            q: coordinates (n,).
        """
        return is_closed(self.openings(q))

    def stiffness(self, q: Array) -> Array:
        """Return the numbers on which the tangent depends, as `tangents` takes them (m,) [N/m].

        Args:
            q: coordinates (n,).
        """
        opening, points = self.openings(q), self.points
        across = self.law.stiffness(opening)
        if not self.slides:
            return np.concatenate([across, points.shear])
        normal, shear = self.law.forces(opening), self.elastic(q)
        closed = self.law.closed(opening)
        limit = (1.0 + TOUCHING) * self.limits(normal, closed)
        over = points.slides & ((np.abs(shear) > limit) | (closed == 0.0))
        sign = np.where(over, np.sign(shear), 0.0)
        left = np.where(limit > 0.0, SLIDING, 0.0)  # nothing where it is open
        along = np.where(over, left, 1.0) * points.shear
        coupled = self.limit_rates(across, self.law.closed_rate(opening), sign)
        return np.concatenate([across, along, coupled])

    def limit_rates(self, across: Array, closed: Array, rate: Array) -> Array:
        """Return the derivative of shear by opening through Coulomb's limit, of each of `entries`.

        Args:
            across: derivative of normal forces, for each of `entries` (m,) [N/m].
            closed: derivative of closed areas (m,) [m].
            rate: of the shear by its limit (p,) [-].
        """
        row = self.law.entries[0]
        friction = np.where(self.points.slides, self.points.friction, 0.0)[row]
        coupled: Array = rate[row] * (self.points.cohesion[row] * closed - friction * across)
        return coupled

    def shear_resultants(self) -> sparse.csr_matrix:
        """Elastic shear resultant of each joint from coordinates, sparse (n_joints, n) [N]."""
        return (self.sums[0] @ sparse.diags(self.points.shear) @ self.slip).tocsr()

    def answered(self, stiffness: Array, gaps: Array) -> tuple[Array, Array]:
        """Return the forces at the points that answer small gaps, each (p,) [N].

        Args:
            stiffness: as by `stiffness` or `glued` (m,) [N/m].
            gaps: opening and slip at the points (2, p) [m].
        """
        first, second = self.law.entries
        across, along, coupled = np.split(stiffness, [len(first), len(first) + len(gaps[0])])
        normal, shear = np.zeros_like(gaps[0]), along * gaps[1]
        np.add.at(normal, first, across * gaps[0][second])
        if self.slides:
            np.add.at(shear, first, coupled * gaps[0][second])
        return normal, shear

    def bonded(self, gaps: Array) -> tuple[Array, Array]:
        """Return the forces at the points if joints held tension and nothing slid, each (p,) [N].

        Args:
            gaps: opening and slip at the points (2, p) [m].
        """
        return self.answered(self.glued(), gaps)

    def glued(self) -> Array:
        """Return what `stiffness` is where all is closed and nothing slides (m,) [N/m]."""
        across = self.law.stiffness(np.full(len(self.points.arm), -1.0))
        parts = [across, self.points.shear]
        return np.concatenate([*parts, np.zeros_like(across)] if self.slides else parts)

    def tangents(self, pattern: Pattern) -> sparse.csr_matrix:
        """Return the linear map from `stiffness` to the entries of the tangent (nnz, m).

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

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint (n_joints, 3) [N, N, N m].

        N = -∫ w t_n,   V = ∫ w t_s,   M = -∫ w t_n r

        Args:
            q: coordinates (n,).
        """
        return self.summed(*self.tractions(q))

    def summed(self, normal: Array, shear: Array) -> Array:
        """Return N, V, M of every joint from the forces at the points (n_joints, 3) [N, N, N m].

        Args:
            normal: forces, positive where they pull (p,) [N].
            shear: forces (p,) [N].
        """
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
        offset = None if self.offset is None else self.offset[:, kept]
        chosen = Facets(points.chosen(kept, weight[kept]))
        return JointOperator(chosen, self.opening[kept], self.slip[kept], offset)


def _ones(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """A matrix of ones wherever another stores an entry, zero or not."""
    return sparse.csr_matrix((np.ones(matrix.nnz), matrix.indices, matrix.indptr), matrix.shape)
