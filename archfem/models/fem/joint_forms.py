"""The two faces of a joint in UFL: gap and slip between them, and the tractions these ask for.

With n the normal from one side to the other and ⟦u⟧ the jump along it, the gap of a displacement is
⟦u⟧·n and its slip ⟦u⟧·t. Here t is ±n turned left, with the sign that, for n from the lower to the
higher block, lets t point to the extrados. Neither depends on which side comes first.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import ufl

from archfem.joints.law import (
    closed_time,
    excess,
    held,
    mean_closing,
    normal_traction,
    shear_over_step,
    shear_traction,
)
from archfem.joints.operator import TOUCHING
from archfem.models.fem import _fenicsx
from archfem.models.fem.joint_facets import JointFacets, Patch

GRAZE = 1e-200
"""By which faces overlap that just touch, and friction there holds more than it must [m, Pa].

Derivatives then are those of a closed joint that holds, and nothing else is changed.
"""

Fields = tuple[Any, Any]


@dataclass(frozen=True, eq=False)
class Faces:
    """The faces of one contact, as weak forms have them.

    Attributes:
        facets: on all joints.
        patch: those of this contact and of one colour.
    """

    facets: JointFacets
    patch: Patch

    def _number(self, value: float) -> Any:
        return _fenicsx.constant(self.facets.space.mesh.grid, value)

    @cached_property
    def _stiffness(self) -> Fields:
        """k_n and k_s [Pa/m]."""
        contact = self.patch.contact
        return self._number(contact.normal_stiffness), self._number(contact.shear_stiffness)

    @cached_property
    def _strength(self) -> Fields:
        """Friction μ [-] and cohesion c [Pa]."""
        contact = self.patch.contact
        return self._number(contact.coefficient), self._number(contact.cohesion)

    @cached_property
    def _normal(self) -> Any:
        return ufl.FacetNormal(self.facets.space.mesh.grid)("+")

    def opening(self, u: Any) -> Any:
        """Return the gap of a displacement, positive open [m].

        Args:
            u: displacement, a UFL expression [m].
        """
        return ufl.dot(u("-") - u("+"), self._normal)

    def slip(self, u: Any) -> Any:
        """Return the slip of a displacement, of the higher block toward the extrados [m].

        Args:
            u: displacement, a UFL expression [m].
        """
        along = self.facets.sense(self.patch.colour) * ufl.perp(self._normal)
        return ufl.dot(u("-") - u("+"), along)

    def _elastic(self, u: Any) -> Any:
        """Traction along the joint if nothing slid any further [Pa]."""
        slip = self.slip(u) - self.facets.carried(self.patch.colour)
        return shear_traction(slip, self._stiffness[1])

    def _limit(self, normal: Any, closed: Any) -> Any:
        """Coulomb's limit, μ |t_n| + c where closed [Pa]."""
        friction, cohesion = self._strength
        return cohesion * closed - friction * normal

    def tractions(self, u: Any) -> Fields:
        """Return the tractions across and along the joint [Pa].

        Args:
            u: displacement, a UFL expression [m].
        """
        return self._tractions(u, 0.0)

    def steady_tractions(self, u: Any, same: Any) -> Fields:
        """Return the same tractions, whose derivative by u lets hold what slides by rounding.

        Args:
            u: displacement, a UFL expression [m].
            same: equal to u, but not what derivatives are by.
        """
        if not self.patch.contact.slides:
            return self.tractions(u)
        wider = TOUCHING * self._limit_of(same) + GRAZE * self._closed(same)
        return self._tractions(u, wider)

    def _tractions(self, u: Any, wider: Any) -> Fields:
        """Tractions where Coulomb's limit is a little wider."""
        normal = normal_traction(self.opening(u) - GRAZE, self._stiffness[0])
        shear = self._elastic(u)
        if self.patch.contact.slides:
            shear = held(shear, self._limit_of(u) + wider)
        return normal, shear

    def _closed(self, u: Any) -> Any:
        """One where the joint is closed, else zero [-]."""
        return ufl.conditional(ufl.lt(self.opening(u) - GRAZE, 0.0), 1.0, 0.0)

    def _limit_of(self, u: Any) -> Any:
        """Coulomb's limit of a displacement [Pa]."""
        normal = normal_traction(self.opening(u) - GRAZE, self._stiffness[0])
        return self._limit(normal, self._closed(u))

    def energy(self, u: Any) -> Any:
        """Return what an area of the joint stores if nothing slid any further [J/m²].

        Args:
            u: displacement, a UFL expression [m].
        """
        normal = normal_traction(self.opening(u), self._stiffness[0])
        return 0.5 * (normal * self.opening(u) + self._elastic(u) ** 2 / self._stiffness[1])

    def slid(self, u: Any) -> Any:
        """Return how far the joint has slid for good once it is displaced [m].

        Args:
            u: displacement, a UFL expression [m].
        """
        return self._left(u, self.tractions(u)[1])

    def _left(self, u: Any, shear: Any) -> Any:
        """That part of the slip which the elastic traction does not ask for [m]."""
        if not self.patch.contact.slides:
            return self.facets.carried(self.patch.colour)
        return self.slip(u) - shear / self._stiffness[1]

    def _path(self, step: Fields, late: Any) -> Fields:
        """From where to where the gap goes that the joint feels [m]."""
        before, after = (self.opening(u) - GRAZE for u in step)
        ahead = late * (after - before)
        return before + ahead, after + ahead

    def _sheared(self, step: Fields) -> Fields:
        """Elastic traction at the start, and its change if nothing slid [Pa]."""
        return self._elastic(step[0]), shear_traction(
            self.slip(step[1]) - self.slip(step[0]), self._stiffness[1]
        )

    def _mean_limit(self, step: Fields, late: Any) -> Any:
        """Coulomb's limit over a step: that of the mean normal traction [Pa]."""
        path = self._path(step, late)
        return self._limit(self._stiffness[0] * mean_closing(*path), closed_time(*path))

    def _shear_over(self, step: Fields, late: Any, felt: Any) -> Fields:
        """Mean shear by a limit with a lag, and its elastic part at the end [Pa]."""
        first, change = self._sheared(step)
        if not self.patch.contact.slides:
            return first + (0.5 + felt) * change, first + change
        return shear_over_step(first, change, felt, self._mean_limit(step, late))

    def means(self, step: Fields, late: Any) -> Fields:
        """Return the means over a step of the tractions across and along the joint [Pa].

        Args:
            step: displacements at its start and its end, UFL expressions [m].
            late: lag of damping over the length of the step [-].
        """
        normal = self._stiffness[0] * mean_closing(*self._path(step, late))
        return normal, self._shear_over(step, late, late)[0]

    def slid_over(self, step: Fields, late: Any) -> Any:
        """Return how far the joint has slid for good at the end of a step [m].

        Args:
            step: displacements at its start and its end, UFL expressions [m].
            late: lag of damping over the length of the step [-].
        """
        return self._left(step[1], self._shear_over(step, late, late)[1])

    def lost(self, step: Fields, late: Any) -> Any:
        """Return what friction and the lag of damping take of an area over a step [J/m²].

        Args:
            step: displacements at its start and its end, UFL expressions [m].
            late: lag of damping over the length of the step [-].
        """
        before, after = self._path(step, 0.0)
        ahead = mean_closing(*self._path(step, late)) - mean_closing(before, after)
        lagging = self._stiffness[0] * ahead * (after - before)
        first, change = self._sheared(step)
        more = self._shear_over(step, late, late)[0] - self._shear_over(step, late, 0.0)[0]
        rubbing = more * change
        if self.patch.contact.slides:
            limit = self._mean_limit(step, late)
            start = held(first, limit)
            over = abs(excess(start + change, limit))
            rubbing += 0.5 * (first**2 - start**2) + over * limit
        return lagging + rubbing / self._stiffness[1]
