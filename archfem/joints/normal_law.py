"""Normal forces of the contact law at joint points: springs, exact facets, and tensile bonds.

Two integrations of the traction across the joint have the same methods. `Springs` makes every
quadrature point a spring, f = W t. `Facets` integrates the traction exactly along facets with
linear opening. Along the joint every point is a spring in both.

Joints that stiffen as they close press by the linear law and an excess, which `large.closing_law`
integrates: exactly along facets at an instant, and so that it conserves energy over a step.

Dilatancy and tensile bonds shift the gap of the normal law. Dilatancy, by saw teeth of the angle ψ,
opens a joint by tan ψ |s_p|. An intact bond reaches its tensile strength f_t at the gap
g_t = f_t / k_n. The law

    t_n = k_n <g - g_t>_- + f_t,    |t_s| ≤ (c - μ f_t) - μ k_n <g - g_t>_-

is linear elastic up to f_t and stays there until the bond is declared broken; the limit is that of
the true traction, μ |t_n| + c. The law of dry joints therefore holds, also averaged over a step,
with a shifted gap, a constant pull and another cohesion. Along a facet between an intact and a
broken end the bond decreases linearly.

A softening bond with the damage D has 1 - D of both strengths. It pulls from its irreversible
opening κ on:

    t_n = k_n (<g>_- - <g - κ>_- + <g - κ - g_t>_-) + (1 - D) f_t,    g_t = (1 - D) f_t / k_n.

Three dry laws with shifted gaps therefore add up to it, at an instant and over a step.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from archfem._typing import Array, Flags, Numbers
from archfem.joints.contact_law import (
    ContactLaw,
    contact_fraction,
    contact_fraction_rate,
    is_closed,
)
from archfem.joints.large.closing_law import excess_energies, sum_excess
from archfem.joints.quadrature import JointPoints, Quadrature


@dataclass(frozen=True, eq=False)
class Places:
    """Places of integration on facets between joint points, or at springs."""

    gaps: Any  # at the places, each (k, f), or of springs (p,) [m]
    area: Array  # of the places (k, f) or (p,) [m²]
    shapes: Array | None = None  # φ of both ends of the facets there (2, k, f); None of springs

    def integrate(self, values: Array) -> Array:
        """Return integrals of values times φ_i, for each point (p,)."""
        weighted = self.area * values
        return weighted if self.shapes is None else (self.shapes * weighted).sum(axis=1).T.ravel()

    def integrate_products(self, values: Array) -> Array:
        """Return integrals of values times φ_i φ_j, for each coupled pair of points (m,)."""
        weighted = self.area * values
        if self.shapes is None:
            return weighted
        return ((self.shapes * weighted)[:, None] * self.shapes).sum(axis=2).ravel()


@dataclass(frozen=True, eq=False)
class NormalLaw(ABC):
    """Normal forces at joint points from their openings."""

    points: JointPoints

    end_count: ClassVar[int]  # points of a facet, its ends, or 1 of springs

    @cached_property
    def coupling_pairs(self) -> tuple[Numbers, Numbers]:
        """Pairs of points whose forces and openings are coupled, those of one facet, each (m,)."""
        ends = np.arange(len(self.points.offset)).reshape(-1, self.end_count).T
        pairs = np.broadcast_arrays(ends[:, None], ends)
        return pairs[0].ravel(), pairs[1].ravel()

    @cached_property
    def contact(self) -> ContactLaw:
        """Contact law of each facet or spring, an array (f,) for each parameter."""
        return self.points.contact.mapped(lambda values: values[:: self.end_count])

    @cached_property
    def area(self) -> Array:
        """Area of each facet or spring (f,) [m²]."""
        return self.points.weight.reshape(-1, self.end_count).sum(axis=1)

    @cached_property
    def _closing_parameters(self) -> tuple[Array, Array]:
        """k_n and 1/δ_m of each facet or spring, each in one piece of memory (f,)."""
        contact = self.contact
        return np.array(contact.normal_stiffness), np.array(contact.closing_rate)

    def _excess(self, start: Array, end: Array, rates: tuple[float, float]) -> tuple[Array, Array]:
        """Return means over a step of excess tensions (p,) [N], and derivatives (m,) [N/m]."""
        means, pairs = sum_excess(*self._closing_parameters, -start, -end, rates, self.end_count)
        area = self.area
        return -(area[:, None] * means).ravel(), np.asarray(area * pairs).ravel()

    @abstractmethod
    def divide(self, *gaps: Array) -> Places:
        """Return the places of integration, from gaps of the points (p,)."""

    def _divide_cohesion(self, places: Places, *gaps: Array) -> Places:
        """Return the places of integration of the area that coheres; without cohesion, as given."""
        contact = self.points.contact
        coheres = np.any(contact.cohesion)
        return self.divide(*map(contact.cohesive_gap, gaps)) if coheres else places

    def forces(self, opening: Array) -> Array:
        """Return the normal forces at the points, positive where they pull (p,) [N]."""
        return self.forces_and_area(opening)[0]

    def forces_and_area(self, opening: Array) -> tuple[Array, Array]:
        """Return `forces`, and the area that coheres, distributed to the points (p,) [N, m²]."""
        places = self.divide(opening)
        closed = self._divide_cohesion(places, opening)
        forces = places.integrate(self.contact.normal_traction(*places.gaps))
        if self.points.stiffens:
            forces = forces + self._excess(opening, opening, (1.0, 1.0))[0]
        return forces, closed.integrate(is_closed(*closed.gaps).astype(float))

    def stiffness(self, opening: Array) -> Array:
        """Return the derivative of `forces` for each of `coupling_pairs` (m,) [N/m]."""
        places = self.divide(opening)
        tangent = places.integrate_products(self.contact.normal_tangent(*places.gaps))
        if self.points.stiffens:  # a path without length, whose both ends follow the gap
            tangent = tangent + self._excess(opening, opening, (1.0, 1.0))[1]
        return tangent

    @property
    def closed_stiffness(self) -> Array:
        """Derivative of `forces` where all joints just touch and are closed (m,) [N/m]."""
        return self.stiffness(np.zeros_like(self.points.weight))

    def energies(self, opening: Array) -> Array:
        """Return the energies stored across the joints, distributed to the points (p,) [J]."""
        places = self.divide(opening)
        energies = places.integrate(self.contact.normal_energy(*places.gaps))
        return energies + self._excess_energies(opening) if self.points.stiffens else energies

    def _excess_energies(self, opening: Array) -> Array:
        """Return the energies in excess of the linear law, in equal parts to the ends (p,) [J]."""
        count = self.end_count
        energies = self.area * excess_energies(*self._closing_parameters, -opening, count)
        return np.repeat(energies / count, count)

    def contact_area_rate(self, opening: Array) -> Array:
        """Return the derivative of the closed area for each of `coupling_pairs` (m,) [m]."""
        return np.zeros_like(opening)

    def step_means(self, start: Array, end: Array, lag: float = 0.0) -> tuple[Array, Array]:
        """Return the means over a step of `forces_and_area`, each (p,) [N, m²].

        Gaps at both ends contain their change times the lag of damping.
        """
        places = self.divide(start, end)
        traction = self.contact.mean_normal_traction(*places.gaps)
        forces = places.integrate(traction)
        if self.points.stiffens:
            forces = forces + self._excess(start, end, (lag, 1.0 + lag))[0]
        closed = self._divide_cohesion(places, start, end)
        return forces, closed.integrate(contact_fraction(*closed.gaps))

    def mean_stiffness(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean force by a parameter, as `stiffness` (m,) [N/m]."""
        places = self.divide(start, end)
        before, after = places.gaps
        tangent = places.integrate_products(self.contact.mean_normal_tangent(before, after, rates))
        return tangent + self._excess(start, end, rates)[1] if self.points.stiffens else tangent

    def mean_area_rate(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean area by a parameter (m,) [m]."""
        places = self._divide_cohesion(self.divide(start, end), start, end)
        before, after = places.gaps
        return places.integrate_products(contact_fraction_rate(before, after, rates))


class Springs(NormalLaw):
    """Normal forces by a quadrature rule: each point is a spring, closed or open as a whole."""

    end_count = 1

    def divide(self, *gaps: Array) -> Places:
        """Return the points themselves."""
        return Places(gaps, self.points.weight)


# Gauss's three points on the unit interval, and their weights
GAUSS_POINTS = 0.5 * (1.0 + np.sqrt([0.6, 0.0, 0.6]) * [-1, 0, 1])
GAUSS_WEIGHTS = np.array([5, 8, 5]) / 18.0


class Facets(NormalLaw):
    """Normal forces integrated exactly over facets along which the opening is linear.

    The `points` are both ends of each facet, one facet after the other. With φ the two linear
    functions of a facet,

        f_i = ∫ w t φ_i,   ∂f_i/∂g_j = ∫ w t' φ_i φ_j.

    Gauss's rule integrates between the places where the facet opens or closes: at an instant, or at
    the start and at the end of a step. There traction, energy and their means over a step with gaps
    linear in time are polynomials, which the rule integrates exactly; so the work of a step is the
    change of energy.
    """

    end_count = 2

    def divide(self, *gaps: Array) -> Places:
        """Return Gauss's points on the parts of facets between the zero crossings of the gaps."""
        ends = [(gap[0::2], gap[1::2]) for gap in gaps]
        breaks = np.zeros((len(gaps) + 2, len(self.area)))
        breaks[1:-1] = [_divide_by_change(a, a, b) for a, b in ends]
        breaks[1:-1].sort(axis=0)
        breaks[-1] = 1.0
        length = (breaks[1:] - breaks[:-1])[:, None]
        place = (breaks[:-1, None] + GAUSS_POINTS[:, None] * length).reshape(-1, len(self.area))
        weight = self.area * (GAUSS_WEIGHTS[:, None] * length).reshape(place.shape)
        shapes = np.stack([1.0 - place, place])
        return Places([a + place * (b - a) for a, b in ends], weight, shapes)

    def contact_area_rate(self, opening: Array) -> Array:
        """Return the derivative of the closed area for each of `coupling_pairs` (2 p,) [m]."""
        gap = self.points.contact.cohesive_gap(opening)
        a, b = gap[0::2], gap[1::2]
        # the zero z = a / (a - b) ends the closed part, or begins it; φ at z divides the area
        zero, inverse = _divide_by_change(a, a, b), _divide_by_change(1.0, a, b)
        scale = np.where(is_closed(a), self.area, -self.area) * inverse**2
        shapes, rates = np.stack([1.0 - zero, zero]), np.stack([-b * scale, a * scale])
        return np.asarray(shapes[:, None] * rates).ravel()


def _divide_by_change(value: Array | float, a: Array, b: Array) -> Array:
    """Return value / (a - b) where a line from a to b crosses zero, which it does at a / (a - b).

    A line that ends at zero crosses it at 1 exactly: a part as short as round-off would have a
    large rate.
    """
    crosses = is_closed(a) != is_closed(b)
    return np.divide(value, a - b, out=np.zeros_like(a), where=crosses)


def choose_law(rule: Quadrature, points: JointPoints) -> NormalLaw:
    """Return the normal law of a quadrature rule."""
    return Facets(points) if rule.rule == "exact" else Springs(points)


# Excess over the strength of a bond, relative to it, that counts as round-off [-]
BOND_STRENGTH_TOLERANCE = 1e-9


def dilatancy_opening(points: JointPoints, slip: Array) -> Array | None:
    """Return the opening of each point by dilatancy (p,) [m]; None without dilatancy."""
    return None if points.dilatancy is None else points.dilatancy * np.abs(slip)


@dataclass(frozen=True, eq=False)
class CrackedLaw:
    """Normal forces of softening bonds without their pull, from gaps less `Bonds.shift`."""

    law: NormalLaw
    shift: Array  # irreversible opening and stretch of the bonds (p,) [m]
    stretch: Array  # of the bonds (p,) [m]

    def _sum(self, evaluate: Callable[..., Array], *gaps: Array) -> Array:
        """Return the sum of the three dry laws."""
        faces, crack = ([gap + each for gap in gaps] for each in (self.shift, self.stretch))
        return evaluate(*gaps) + evaluate(*faces) - evaluate(*crack)

    def forces_and_area(self, gaps: Array) -> tuple[Array, Array]:
        """Return forces, and the area closed to the bond, as `NormalLaw.forces_and_area`."""
        return self._sum(self.law.forces, gaps), self.law.forces_and_area(gaps)[1]

    def stiffness(self, gaps: Array) -> Array:
        """Return the derivative of forces, as `NormalLaw.stiffness`."""
        return self._sum(self.law.stiffness, gaps)

    def energies(self, gaps: Array) -> Array:
        """Return the stored energies, as `NormalLaw.energies`."""
        return self._sum(self.law.energies, gaps)

    def step_means(self, start: Array, end: Array, lag: float = 0.0) -> tuple[Array, Array]:
        """Return means over a step, as `NormalLaw.step_means`."""
        means = self.law.step_means
        forces = self._sum(lambda a, b: means(a, b, lag)[0], start, end)
        return forces, means(start, end, lag)[1]

    def mean_stiffness(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean force, as `NormalLaw.mean_stiffness`."""
        return self._sum(lambda a, b: self.law.mean_stiffness(a, b, rates), start, end)


@dataclass(frozen=True, eq=False)
class Bonds:
    """Intact, damaged and broken bonds of the joint points."""

    law: NormalLaw  # normal forces from gaps
    damage: Array  # D, the lost share of the strengths: 1 where a bond is broken (p,) [-]
    crack: Array  # κ, irreversible opening of softening bonds (p,) [m]

    @cached_property
    def intact(self) -> Flags:
        """Whether each point has a bond that is not broken (p,)."""
        return (self._strength > 0.0) & (self.damage < 1.0)

    @cached_property
    def softens(self) -> Flags:
        """Whether each point has a softening bond that is not broken (p,)."""
        rate = self.law.points.damage_by_opening
        return np.zeros_like(self.intact) if rate is None else self.intact & (rate > 0.0)

    @cached_property
    def stretch(self) -> Array:
        """Elastic gap at the tensile strength, (1 - D) f_t / k_n; 0 without bond (p,) [m]."""
        strength = np.where(self.intact, (1.0 - self.damage) * self._strength, 0.0)
        return strength / self.law.points.contact.normal_stiffness

    @cached_property
    def shift(self) -> Array:
        """Gap at which the tensile strength is reached, κ + `stretch` (p,) [m]."""
        return self.stretch + np.where(self.intact, self.crack, 0.0)

    @cached_property
    def normal_law(self) -> NormalLaw | CrackedLaw:
        """Normal law without `pull`, from gaps less `shift`."""
        cracked = bool(self.softens.any() and self.crack.any())
        return CrackedLaw(self.law, self.shift, self.stretch) if cracked else self.law

    @cached_property
    def pull(self) -> Array:
        """Force of each point at its strength, (1 - D) f_t times its area (p,) [N]."""
        return normal_forces(self.law, self.stretch)

    @cached_property
    def cohesion(self) -> Array:
        """Cohesion for gaps less `shift`: c - μ f_t of brittle bonds, 0 if broken (p,) [Pa]."""
        bonded = np.where(self.intact & ~self.softens, self._cohesion_at_shift, 0.0)
        return np.where(self._strength > 0.0, bonded, self.law.points.contact.cohesion)

    @cached_property
    def resistance(self) -> Array:
        """Shear limit of softening bonds for gaps less `shift`, also at their strength (p,) [N]."""
        points, share = self.law.points, 1.0 - self.damage
        softening = share * self._cohesion_at_shift * points.weight
        return np.where(self.softens & points.slides, softening, points.contact.resistance)

    @property
    def _cohesion_at_shift(self) -> Array:
        """Cohesion of whole bonds for gaps less `shift`, c - μ f_t (p,) [Pa]."""
        contact = self.law.points.contact
        return np.maximum(contact.cohesion - contact.friction * self._strength, 0.0)

    def energies(self, gaps: Array) -> Array:
        """Return the stored energies across the joints, from gaps less `shift` (p,) [J]."""
        return self.normal_law.energies(gaps) + self.pull * (gaps + 0.5 * self.stretch)

    def find_exceeded(self, gaps: Array) -> Flags:
        """Return which bonds are pulled beyond their strength, from gaps less `shift` (p,)."""
        stretch = self._strength / self.law.points.contact.normal_stiffness
        return self.intact & (gaps > BOND_STRENGTH_TOLERANCE * stretch)

    def most_exceeded(self, gaps: Array) -> Flags:
        """Return the bonds beyond their strength at the largest gap of each joint (p,)."""
        exceeded, joint = self.find_exceeded(gaps), self.law.points.joint
        largest = np.zeros(self.law.points.joint_count)
        np.maximum.at(largest, joint, np.where(exceeded, gaps, 0.0))
        # points with gaps equal but for round-off break together
        return exceeded & (gaps >= (1.0 - 1e-6) * largest[joint])

    def after(
        self, gaps: Array, exceeded: Flags, excess: Array, limit: Array
    ) -> tuple[Array, Array]:
        """Return damage and irreversible opening at the end of a step, as they are stored."""
        points = self.law.points
        tolerance = BOND_STRENGTH_TOLERANCE * (limit + points.contact.cohesion * points.weight)
        # a brittle bond also breaks once its point slides
        slid = np.where(np.abs(excess) > tolerance, np.abs(excess), 0.0)
        broken = self.intact & ~self.softens & (exceeded | (slid > 0.0))
        damage = np.where(broken, 1.0, self.damage)
        if points.damage_by_opening is None or points.damage_by_slip is None:
            return damage, self.crack
        # slip lowers the strength first; the crack then grows to where strength and gap agree
        by_slip = points.damage_by_slip * slid / points.shear_spring
        stretch = self._strength / points.contact.normal_stiffness
        beyond = np.where(self.find_exceeded(gaps + by_slip * stretch), gaps + by_slip * stretch, 0)
        growth = beyond / (1.0 - points.damage_by_opening * stretch)
        softened = np.minimum(damage + by_slip + points.damage_by_opening * growth, 1.0)
        crack = self.crack + np.where(self.softens, growth, 0.0)
        return np.where(self.softens, softened, damage), crack

    @property
    def _strength(self) -> Array:
        strength = self.law.points.tension
        return np.zeros_like(self.damage) if strength is None else strength


def normal_forces(law: NormalLaw, gaps: Array) -> Array:
    """Return the normal forces at the points of joints closed all over (p,) [N]."""
    first, second = law.coupling_pairs
    forces = np.zeros_like(gaps)
    np.add.at(forces, first, law.closed_stiffness * gaps[second])
    return forces
