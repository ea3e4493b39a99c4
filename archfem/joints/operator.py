"""The joint operator: from coordinates to opening and slip at points, and back to forces.

With G the sparse operator of `kinematics`, that takes generalised coordinates q to (opening, slip)
at points along the joints, the forces of all joints are Gᵀ f(G q) and their tangent is Gᵀ f' G.
How openings become normal forces is told in `springs` and `facets`; how slips become shear, and
what of it friction holds, in `law`.

Joints have memory: how far each point has slid for good, and which bonds are broken. It belongs to
the operator, whose forces are those after a load has changed since; `remembered` takes in what has
slid and broken meanwhile. What teeth and bonds do is told in `bonds`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.joints.bonds import Bonds, ridden
from archfem.joints.facets import Facets
from archfem.joints.kinematics import JointKinematics
from archfem.joints.law import held, is_closed

Status = NDArray[np.bool_]

TOUCHING = 1e-9
"""Excess over Coulomb's limit, relative to it, that is rounding of a point which holds."""

SLIDING = 1e-9
"""Share of its elastic stiffness that the tangent leaves a point which slides: a body that slides
at all its joints, to either side, would be free, though it holds as soon as it moves back."""


@dataclass(frozen=True, eq=False)
class JointOperator(JointKinematics):
    """Opening and slip along the joints as linear functions of coordinates, and their forces.

    Attributes:
        slid: how far each point has slid for good, that part of the slip which friction did not
            hold (p,) [m]; None where nothing has.
        broken: where bonds are broken for good, 1, else 0 (p,); None where none is.
    """

    slid: Array | None = None
    broken: Array | None = None

    @property
    def memory(self) -> Array:
        """How far each point has slid for good (p,) [m]; then where bonds are broken (2 p,)."""
        slid = self._slid
        return slid if self.bonds is None else np.concatenate([slid, self.bonds.broken])

    @property
    def _slid(self) -> Array:
        return np.zeros(len(self.points.arm)) if self.slid is None else self.slid

    def remembering(self, memory: Array) -> "JointOperator":
        """Return the same joints with another memory.

        Args:
            memory: as `memory` (p,) or (2 p,).
        """
        slid, broken = np.split(memory, [len(self.points.arm)])
        return replace(
            self, slid=slid if slid.any() else None, broken=broken if broken.any() else None
        )

    @cached_property
    def bonds(self) -> Bonds | None:
        """Bonds of the points; None where none has tensile strength."""
        if self.points.tension is None:
            return None
        return Bonds(self.law, np.zeros_like(self._slid) if self.broken is None else self.broken)

    @cached_property
    def ridden(self) -> Array | None:
        """How far teeth have raised each point (p,) [m]; None where they have not."""
        return None if self.slid is None else ridden(self.points, self.slid)

    def felt(self, q: Array, raised: Array | None = None) -> Array:
        """Return the gaps that the normal law sees, less what teeth and bonds shift (p,) [m].

        Args:
            q: coordinates (n,).
            raised: how far teeth raise each point (p,) [m]; by default as it is remembered.
        """
        gaps, raised = self.openings(q), self.ridden if raised is None else raised
        gaps = gaps if raised is None else gaps - raised
        return gaps if self.bonds is None else gaps - self.bonds.stretch

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
            normal: forces of the normal law, without the pull of bonds (p,) [N].
            closed: area on which each point is closed (p,) [m²].
        """
        slides, points = self.points.slides, self.points
        found: Array = self._cohesion * closed
        found[slides] -= points.friction[slides] * normal[slides]
        return np.where(slides, found, 0.0)

    @property
    def _cohesion(self) -> Array:
        return self.points.cohesion if self.bonds is None else self.bonds.cohesion

    def pulled(self, normal: Array) -> Array:
        """Return normal forces with the pull of bonds (p,) [N].

        Args:
            normal: forces of the normal law (p,) [N].
        """
        return normal if self.bonds is None else normal + self.bonds.pull

    def tractions(self, q: Array) -> tuple[Array, Array]:
        """Return normal and shear forces at the points, each (p,) [N].

        Args:
            q: coordinates (n,).
        """
        opening, shear = self.felt(q), self.elastic(q)
        normal = self.law.forces(opening)
        if not self.slides:
            return self.pulled(normal), shear
        limit = self.limits(normal, self.law.closed(opening))
        return self.pulled(normal), np.where(self.points.slides, held(shear, limit), shear)

    def force(self, q: Array) -> Array:
        """Return the generalised forces that the joints exert, as internal forces (n,).

        Args:
            q: coordinates (n,).
        """
        return self.pushed(*self.tractions(q))

    def energy(self, q: Array) -> float:
        """Return the energy stored in the joints if nothing slid any further [J].

        Args:
            q: coordinates (n,).
        """
        opening, shear = self.felt(q), self.elastic(q)
        stored = opening @ self.law.forces(opening) + shear @ (shear / self.points.shear)
        return 0.5 * float(stored) + self.tearing(opening)

    def across(self, gaps: Array) -> float:
        """Return the energy stored across the joints [J].

        Args:
            gaps: less what teeth raise (p,) [m].
        """
        felt = gaps if self.bonds is None else gaps - self.bonds.stretch
        return 0.5 * float(felt @ self.law.forces(felt)) + self.tearing(felt)

    def tearing(self, felt: Array) -> float:
        """Return what bonds add to the energy stored across the joints [J].

        Args:
            felt: gaps that the normal law sees (p,) [m].
        """
        return 0.0 if self.bonds is None else float(self.bonds.stored(felt).sum())

    def remembered(self, q: Array) -> Array:
        """Return what the joints remember once they are at rest at q, as `memory`.

        Of bonds that are torn those break first where each joint gapes most: what they held goes to
        the others, which may bear it.

        Args:
            q: coordinates (n,).
        """
        excess = self.elastic(q) - self.tractions(q)[1]
        if self.bonds is None:
            return self.slid_by(excess)
        felt = self.felt(q)
        limit = self.limits(self.law.forces(felt), self.law.closed(felt))
        return self.further(self.bonds.worst(felt), excess, limit)

    def slid_by(self, excess: Array) -> Array:
        """Return how far each point has slid for good at the end of a step (p,) [m].

        Args:
            excess: shear that friction did not hold on the way (p,) [N].
        """
        slid: Array = self._slid + np.where(self.points.slides, excess / self.points.shear, 0.0)
        return slid

    def further(self, torn: Status, excess: Array, limit: Array) -> Array:
        """Return what joints with bonds remember at the end of a step, as `memory` (2 p,).

        Args:
            torn: which bonds are pulled apart (p,).
            excess: shear that friction did not hold on the way (p,) [N].
            limit: of the shear (p,) [N].
        """
        assert self.bonds is not None
        over = np.where(self.points.slides, excess, 0.0)
        return np.concatenate([self.slid_by(excess), self.bonds.after(torn, over, limit)])

    def status(self, q: Array) -> Status:
        """Return which points are closed (p,).

        Args:
            q: coordinates (n,).
        """
        return is_closed(self.felt(q))

    def stiffness(self, q: Array) -> Array:
        """Return the numbers on which the tangent depends, as `tangents` takes them (m,) [N/m].

        Args:
            q: coordinates (n,).
        """
        opening, points = self.felt(q), self.points
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
        coupled: Array = rate[row] * (self._cohesion[row] * closed - friction * across)
        return coupled

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

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint (n_joints, 3) [N, N, N m].

        N = -∫ w t_n,   V = ∫ w t_s,   M = -∫ w t_n r

        Args:
            q: coordinates (n,).
        """
        return self.summed(*self.tractions(q))

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
