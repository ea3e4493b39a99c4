"""The joint operator: from generalised coordinates to gaps and slips at joint points, and back.

The sparse operator G takes coordinates q to (opening, slip) at points along the joints, its
transpose takes forces there to generalised forces. In all coordinates (nodal displacements, rigid
motions, modes) the joint forces are Gᵀ f(G q) and their tangent is Gᵀ f' G. The law f is that of
`contact_law`, with the dilatancy and tensile bonds of `normal_law`.

Joints have memory: the irreversible slip of each point, and the damage of bonds. Forces follow
from the displacements since the memory was updated.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem._typing import Array, Flags, Numbers
from archfem.joints.contact_law import ContactLaw, clip_to_friction, shear_tangent
from archfem.joints.normal_law import Bonds, CrackedLaw, NormalLaw, dilatancy_opening
from archfem.joints.quadrature import JointPoints


@dataclass(frozen=True, eq=False)
class Pattern:
    """Positions at which matrices of a family may have entries."""

    indptr: NDArray[np.int32]  # starts of the rows (n + 1,)
    indices: NDArray[np.int32]  # columns, ascending in each row (nnz,)

    @classmethod
    def of(cls, *matrices: sparse.csr_matrix) -> "Pattern":
        """Return the union of the patterns of some matrices."""
        ones = [sparse.csr_matrix((np.ones(m.nnz), m.indices, m.indptr), m.shape) for m in matrices]
        union = sum(ones[1:], ones[0]).tocsr()
        union.sort_indices()
        return cls(union.indptr, union.indices)

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.indptr) - 1

    def find_entries(self, rows: NDArray[np.int32], columns: NDArray[np.int32]) -> Numbers:
        """Return the positions of entries in the data of this pattern (k,)."""
        # one sorted key for each entry: row times size plus column
        row = np.repeat(np.arange(self.size, dtype=np.int64), np.diff(self.indptr))
        keys = row * self.size + self.indices
        sought = rows.astype(np.int64) * self.size + columns
        entries = np.searchsorted(keys, sought)
        assert np.array_equal(keys[entries], sought), "an entry lies outside the pattern"
        return entries

    def with_data(self, data: Array) -> sparse.csr_matrix:
        """Return a matrix with this pattern."""
        return sparse.csr_matrix((data, self.indices, self.indptr), 2 * (self.size,))

    def spread(self, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
        """Return a matrix stored on this pattern."""
        entries = matrix.tocoo()
        data = np.zeros(len(self.indices))
        np.add.at(data, self.find_entries(entries.row, entries.col), entries.data)
        return self.with_data(data)

    def outer_product_map(
        self, left: sparse.csr_matrix, right: sparse.csr_matrix
    ) -> sparse.csr_matrix:
        """Return the linear map (nnz, m) from factors d to the entries of Σ_k d_k l_k r_kᵀ."""
        # every pair of entries of row k of both matrices, one after the other
        count, right_count = np.diff(left.indptr), np.diff(right.indptr)
        size = count * right_count
        row = np.repeat(np.arange(left.shape[0]), size)
        within = np.arange(len(row)) - np.repeat(np.cumsum(size) - size, size)
        first = left.indptr[row] + within // right_count[row]
        second = right.indptr[row] + within % right_count[row]
        entries = self.find_entries(left.indices[first], right.indices[second])
        values = left.data[first] * right.data[second]
        return sparse.csr_matrix((values, (entries, row)), (len(self.indices), left.shape[0]))


@dataclass(frozen=True, eq=False)
class JointOperator:
    """Map coordinates to openings and slips along the joints, and to joint forces.

    Attributes:
        law: normal law, with the joint points (p).
        opening: rows of G for the opening, positive open (p, n).
        slip: rows of G for the slip of the higher block, positive toward the extrados (p, n).
        gap_offset: opening and slip at q = 0, due to moved supports and construction (2, p) [m];
            None for zero.
        irreversible_slip: part of the slip that friction has not held (p,) [m]; None for zero.
        damage: lost share of the strength of bonds, 1 where broken (p,) [-]; None for none.
        crack: irreversible opening of softening bonds (p,) [m]; None for zero.
    """

    law: NormalLaw
    opening: sparse.csr_matrix
    slip: sparse.csr_matrix
    gap_offset: Array | None = None
    irreversible_slip: Array | None = None
    damage: Array | None = None
    crack: Array | None = None

    @property
    def points(self) -> JointPoints:
        """Joint points, at which openings and slips are evaluated."""
        return self.law.points

    @property
    def slides(self) -> bool:
        """Whether any point can slide."""
        return bool(self.points.slides.any())

    @cached_property
    def force_matrices(self) -> tuple[sparse.csc_matrix, sparse.csc_matrix]:
        """Matrices from normal and shear forces at the points to generalised forces (n, p)."""
        return self.opening.T, self.slip.T

    def openings(self, q: Array) -> Array:
        """Return the openings at the points, positive where open (p,) [m].

        Args:
            q: coordinates (n,).
        """
        gaps = self.opening @ q
        return gaps if self.gap_offset is None else gaps + self.gap_offset[0]

    def slips(self, q: Array) -> Array:
        """Return the slips of the higher block at the points, toward the extrados (p,) [m].

        Args:
            q: coordinates (n,).
        """
        slips = self.slip @ q
        return slips if self.gap_offset is None else slips + self.gap_offset[1]

    def generalised_force(self, normal: Array, shear: Array) -> Array:
        """Return generalised forces from forces at the points (n,).

        Args:
            normal: normal forces, positive where they pull (p,) [N].
            shear: shear forces (p,) [N].
        """
        return self.force_matrices[0] @ normal + self.force_matrices[1] @ shear

    def sum_resultants(self, normal: Array, shear: Array) -> Array:
        """Return N, V, M of every joint from forces at the points (n_joints, 3) [N, N, N m].

        Args:
            normal: normal forces, positive where they pull (p,) [N].
            shear: shear forces (p,) [N].
        """
        points = self.points
        sums = [points.sum_by_joint(force) for force in (-normal, shear, -points.offset * normal)]
        return np.stack(sums, axis=1)

    def shear_resultants(self) -> sparse.csr_matrix:
        """Return the matrix from coordinates to elastic shear resultants (n_joints, n) [N]."""
        points = self.points
        entries = points.shear_spring, (points.joint, np.arange(len(points.joint)))
        shape = points.joint_count, len(points.joint)
        return (sparse.csr_matrix(entries, shape) @ self.slip).tocsr()

    def projected(self, basis: sparse.csr_matrix) -> Self:
        """Return the joint operator in the coordinates of a basis, G B.

        Args:
            basis: B, its columns in the present coordinates (n, m).
        """
        return replace(self, opening=self.opening @ basis, slip=self.slip @ basis)

    @property
    def memory(self) -> Array:
        """Irreversible slip of each point (p,) [m]; of bonds then their damage (2 p,) [-].

        Where any bond softens, irreversible openings follow (3 p,) [m].
        """
        bonds = self.bonds
        if bonds is None:
            return self._slip_memory
        return self._join_memory(self._slip_memory, bonds.damage, bonds.crack)

    def _join_memory(self, slip: Array, damage: Array, crack: Array) -> Array:
        """Return the memory of joints with bonds from its parts."""
        softens = self.points.damage_by_opening is not None
        return np.concatenate([slip, damage, crack] if softens else [slip, damage])

    @property
    def _slip_memory(self) -> Array:
        """Irreversible slip, zeros included (p,) [m]."""
        if self.irreversible_slip is None:
            return np.zeros(len(self.points.offset))
        return self.irreversible_slip

    def with_memory(self, memory: Array) -> "JointOperator":
        """Return the joint operator with another memory.

        Args:
            memory: as `memory` (p,), (2 p,) or (3 p,).
        """
        parts = [part if part.any() else None for part in memory.reshape(-1, self._point_count)]
        slip, damage, crack = (*parts, None, None)[:3]
        return replace(self, irreversible_slip=slip, damage=damage, crack=crack)

    @property
    def _point_count(self) -> int:
        return len(self.points.offset)

    @cached_property
    def bonds(self) -> Bonds | None:
        """Bonds of the points; None without tensile strength at any point."""
        if self.points.tension is None:
            return None
        zeros = np.zeros(self._point_count)
        damage, crack = (zeros if each is None else each for each in (self.damage, self.crack))
        return Bonds(self.law, damage, crack)

    @property
    def normal_law(self) -> NormalLaw | CrackedLaw:
        """Normal law of `effective_gaps`, without the pull of bonds."""
        return self.law if self.bonds is None else self.bonds.normal_law

    @cached_property
    def dilatancy_opening(self) -> Array | None:
        """Opening of each point by dilatancy (p,) [m]; None for zero."""
        if self.irreversible_slip is None:
            return None
        return dilatancy_opening(self.points, self.irreversible_slip)

    def effective_gaps(self, q: Array, dilatancy: Array | None = None) -> Array:
        """Return the gaps of the normal law, less dilatancy and the shift of bonds (p,) [m].

        Args:
            q: coordinates (n,).
            dilatancy: opening by dilatancy (p,) [m]; by default that of the memory.
        """
        gaps = self.gaps_of_faces(q, dilatancy)
        return gaps if self.bonds is None else gaps - self.bonds.shift

    def gaps_of_faces(self, q: Array, dilatancy: Array | None = None) -> Array:
        """Return the gaps less dilatancy (p,) [m].

        Args:
            q: coordinates (n,).
            dilatancy: opening by dilatancy (p,) [m]; by default that of the memory.
        """
        dilatancy = self.dilatancy_opening if dilatancy is None else dilatancy
        return self.openings(q) if dilatancy is None else self.openings(q) - dilatancy

    def trial_shear(self, q: Array) -> Array:
        """Return the shear forces at the points without further slip (p,) [N].

        Args:
            q: coordinates (n,).
        """
        slips = self.slips(q)
        elastic = slips if self.irreversible_slip is None else slips - self.irreversible_slip
        return self.points.shear_spring * elastic

    def coulomb_limit(self, normal: Array, closed: Array) -> Array:
        """Return Coulomb's limit of the shear force at the points, μ |N| + c A (p,) [N].

        Args:
            normal: forces of the normal law, without the pull of bonds (p,) [N].
            closed: closed area of each point (p,) [m²].

        Returns:
            The limit, `NO_LIMIT` where a point never slides.
        """
        return np.asarray(self.contact.shear_limit(normal, closed))

    @cached_property
    def contact(self) -> ContactLaw:
        """Contact law of the points with the shear limit that belongs to `effective_gaps`."""
        contact, bonds = self.points.contact, self.bonds
        if bonds is None:
            return contact
        return contact._replace(cohesion=bonds.cohesion, resistance=bonds.resistance)

    def add_bond_pull(self, normal: Array) -> Array:
        """Return normal forces with the pull of bonds (p,) [N].

        Args:
            normal: forces of the normal law (p,) [N].
        """
        return normal if self.bonds is None else normal + self.bonds.pull

    def point_forces(self, q: Array) -> tuple[Array, Array]:
        """Return normal and shear forces at the points, each (p,) [N].

        Args:
            q: coordinates (n,).
        """
        normal, closed = self.normal_law.forces_and_area(self.effective_gaps(q))
        shear = self.trial_shear(q)
        if self.slides:
            shear = clip_to_friction(shear, self.coulomb_limit(normal, closed))
        return self.add_bond_pull(normal), shear

    def force(self, q: Array) -> Array:
        """Return the generalised forces of the joints, as internal forces (n,).

        Args:
            q: coordinates (n,).
        """
        return self.generalised_force(*self.point_forces(q))

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint (n_joints, 3) [N, N, N m].

        N = -∫ w t_n,   V = ∫ w t_s,   M = -∫ w t_n r

        Args:
            q: coordinates (n,).
        """
        return self.sum_resultants(*self.point_forces(q))

    def energy(self, q: Array) -> float:
        """Return the energy stored in the joints without further slip [J].

        Args:
            q: coordinates (n,).
        """
        return float(self.point_energies(q).sum())

    def point_energies(self, q: Array) -> Array:
        """Return the energies stored at the points without further slip (p,) [J].

        Args:
            q: coordinates (n,).
        """
        along = 0.5 * self.trial_shear(q) ** 2 / self.points.shear_spring
        return self.normal_energies(self.gaps_of_faces(q)) + along

    def normal_energies(self, gaps: Array) -> Array:
        """Return the energies stored across the joints, distributed to the points (p,) [J].

        Args:
            gaps: as `gaps_of_faces` (p,) [m].
        """
        if self.bonds is None:
            return self.law.energies(gaps)
        return self.bonds.energies(gaps - self.bonds.shift)

    def updated_memory(self, q: Array) -> Array:
        """Return the memory once the joints are at rest at q, as `memory`.

        The brittle bonds that break first are those at the largest gap of each joint, of all beyond
        their strength. The others may carry their force.

        Args:
            q: coordinates (n,).
        """
        excess = self.trial_shear(q) - self.point_forces(q)[1]
        if self.bonds is None:
            return self.add_slip(excess)
        gaps = self.effective_gaps(q)
        limit = self.coulomb_limit(*self.normal_law.forces_and_area(gaps))
        return self.add_breakage(gaps, self.bonds.most_exceeded(gaps), excess, limit)

    def add_slip(self, excess: Array) -> Array:
        """Return the irreversible slip of each point at the end of a step (p,) [m].

        Args:
            excess: shear force beyond the limit during the step (p,) [N].
        """
        return self._slip_memory + excess / self.points.shear_spring

    def add_breakage(self, gaps: Array, exceeded: Flags, excess: Array, limit: Array) -> Array:
        """Return the memory of joints with bonds at the end of a step, as `memory`.

        Args:
            gaps: as `effective_gaps`, at the end (p,) [m].
            exceeded: which brittle bonds beyond their strength break (p,).
            excess: shear force beyond the limit during the step (p,) [N].
            limit: Coulomb's limit (p,) [N].
        """
        assert self.bonds is not None
        damage, crack = self.bonds.after(gaps, exceeded, excess, limit)
        return self._join_memory(self.add_slip(excess), damage, crack)

    def stiffness(self, q: Array) -> Array:
        """Return the point stiffnesses on which the tangent depends, for `tangent_map` (m,) [N/m].

        They are the derivatives of normal forces by gaps for each coupled pair of points, and of
        shear forces by slips for each point. If any point slides, those of shear forces by gaps
        follow for each coupled pair.

        Args:
            q: coordinates (n,).
        """
        gaps, points = self.effective_gaps(q), self.points
        across = self.normal_law.stiffness(gaps)
        if not self.slides:
            return np.concatenate([across, points.shear_spring])
        normal, closed = self.normal_law.forces_and_area(gaps)
        limit = self.coulomb_limit(normal, closed)
        along, by_limit = shear_tangent(self.trial_shear(q), limit, closed)
        coupled = self.friction_coupling(across, self.law.contact_area_rate(gaps), by_limit)
        return np.concatenate([across, along * points.shear_spring, coupled])

    def friction_coupling(self, across: Array, closed: Array, rate: Array) -> Array:
        """Return the derivative of shear by gaps through Coulomb's limit, for coupled pairs.

        Args:
            across: derivative of normal forces (m,) [N/m].
            closed: derivative of closed areas (m,) [m].
            rate: derivative of the shear by its limit (p,) [-].

        Returns:
            Derivatives (m,) [N/m].
        """
        row = self.law.coupling_pairs[0]
        contact = self.contact.mapped(lambda values: values[row])
        return np.asarray(rate[row] * contact.limit_rate(across, closed))

    def linear_forces(self, stiffness: Array, gaps: Array) -> tuple[Array, Array]:
        """Return normal and shear forces at the points from point stiffnesses, each (p,) [N].

        Args:
            stiffness: as by `stiffness` or `elastic_stiffness` (m,) [N/m].
            gaps: opening and slip at the points (2, p) [m].
        """
        first, second = self.law.coupling_pairs
        across, along, coupled = np.split(stiffness, [len(first), len(first) + len(gaps[0])])
        normal, shear = np.zeros_like(gaps[0]), along * gaps[1]
        np.add.at(normal, first, across * gaps[0][second])
        if self.slides:
            np.add.at(shear, first, coupled * gaps[0][second])
        return normal, shear

    def elastic_forces(self, gaps: Array) -> tuple[Array, Array]:
        """Return normal and shear forces with all joints closed and no slip, each (p,) [N].

        Args:
            gaps: opening and slip at the points (2, p) [m].
        """
        return self.linear_forces(self.elastic_stiffness(), gaps)

    def elastic_stiffness(self) -> Array:
        """Return the point stiffnesses with all joints closed and no slip (m,) [N/m]."""
        across = self.law.closed_stiffness
        parts = [across, self.points.shear_spring]
        return np.concatenate([*parts, np.zeros_like(across)] if self.slides else parts)

    def tangent_map(self, pattern: Pattern) -> sparse.csr_matrix:
        """Return the matrix from point stiffnesses to the entries of the tangent (nnz, m).

        Args:
            pattern: sparsity pattern of the tangent.
        """
        first, second = self.law.coupling_pairs
        maps = [
            pattern.outer_product_map(self.opening[first], self.opening[second]),
            pattern.outer_product_map(self.slip, self.slip),
        ]
        if self.slides:
            maps.append(pattern.outer_product_map(self.slip[first], self.opening[second]))
        return sparse.hstack(maps, "csr")

    def coupling_pattern(self) -> sparse.csr_matrix:
        """Return a matrix with an entry wherever the tangent may have one (n, n)."""
        # products of ones: no entries cancel
        first, second = self.law.coupling_pairs
        opening, slip = _ones(self.opening), _ones(self.slip)
        pattern = opening[first].T @ opening[second] + slip.T @ slip
        if self.slides:
            pattern = pattern + slip[first].T @ opening[second]
        return pattern.tocsr()


def _ones(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """Return a matrix of ones wherever another stores an entry, zero or not."""
    return sparse.csr_matrix((np.ones(matrix.nnz), matrix.indices, matrix.indptr), matrix.shape)
