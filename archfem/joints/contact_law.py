"""The contact law of dry joints: tractions from opening and slip, at an instant and over a step.

Openings g are positive where the joint is open, tractions positive where they pull. The joint bears
only compression across, and an elastic traction limited by Coulomb friction along:

    t_n = k_n <g>_-,    t_s = k_s (s - s_p),    |t_s| ≤ μ |t_n| + c where the joint is closed,

with s_p the irreversible slip. The scalar law is written with arithmetic and `abs` alone, so that
one definition serves NumPy arrays and UFL expressions; derivatives, which UFL finds by itself, are
for arrays only.

Over a step opening and slip are linear in time, and tractions are averaged along this path. The
work of the mean traction is the change of the stored energy, wherever the joint opens or closes on
the way: the averaged vector field of Quispel and McLaren, J. Phys. A 41 (2008) 045206. Friction is
a slider in series with the shear spring, whose limit over a step is that of the mean normal force.

Two integrations of the normal traction have the same methods. `Springs` makes every quadrature
point a spring, f = W t. `Facets` integrates the traction exactly along facets with linear opening.
Along the joint every point is a spring in both.

Dilatancy and tensile bonds shift the gap of the normal law. Dilatancy, by saw teeth of the angle ψ,
opens a joint by tan ψ |s_p|. An intact bond reaches its tensile strength f_t at the gap
g_t = f_t / k_n, and

    t_n = k_n <g - g_t>_- + f_t,    |t_s| ≤ (c - μ f_t) - μ k_n <g - g_t>_-

is linear elastic up to f_t and stays there until the bond is declared broken; the limit is that of
the true traction, μ |t_n| + c. The law of dry joints therefore holds, also averaged over a step,
with a shifted gap, a constant pull and another cohesion. Along a facet between an intact and a
broken end the bond decreases linearly.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.joints.quadrature import JointPoints, Numbers, Quadrature

# Added to a denominator that may be zero where the quotient is to be zero
ZERO_DIVISION_GUARD = 1e-300


def negative_part(x: Any) -> Any:
    """Return the negative part of a value: x where x < 0, else 0."""
    return 0.5 * (x - abs(x))


def normal_traction(opening: Any, stiffness: Any) -> Any:
    """Return the traction across a joint that closes elastically and opens freely [Pa].

    t_n = k_n <g>_-      (compression only)
    """
    return stiffness * negative_part(opening)


def shear_traction(slip: Any, stiffness: Any) -> Any:
    """Return the elastic traction along a joint, t_s = k_s s [Pa]."""
    return stiffness * slip


def friction_excess(trial: Any, limit: Any) -> Any:
    """Return the part of a trial shear traction beyond the limit [Pa]."""
    return negative_part(trial + limit) - negative_part(limit - trial)


def clip_to_friction(trial: Any, limit: Any) -> Any:
    """Return a trial shear traction clipped to the limit [Pa]."""
    return trial - friction_excess(trial, limit)


def contact_fraction(start: Any, end: Any) -> Any:
    """Return the fraction of a step for which a joint is closed, gap linear in time [-]."""
    return -(negative_part(start) + negative_part(end)) / (
        abs(start) + abs(end) + ZERO_DIVISION_GUARD
    )


def mean_closing(start: Any, end: Any) -> Any:
    """Return the mean of <g>_- over a step [m]."""
    return 0.5 * (negative_part(start) + negative_part(end)) * contact_fraction(start, end)


def shear_over_step(start: Any, change: Any, lag: Any, limit: Any) -> tuple[Any, Any]:
    """Return the mean shear traction over a step, and its elastic part at the end [Pa].

    The elastic traction grows with the slip up to the limit, and stays there. Excess at the start
    is lost. Damping with the time lag adds to the mean, up to the limit. The work of the mean is
    the change of the stored energy and a loss that is never negative.
    """
    first = clip_to_friction(start, limit)
    excess = friction_excess(first + change, limit)
    # max(|change|, |excess|); the excess is the last part of the change, at the limit
    largest = 0.5 * (abs(change) + abs(excess) + abs(abs(change) - abs(excess)))
    mean = first + 0.5 * change - 0.5 * excess * abs(excess) / (largest + ZERO_DIVISION_GUARD)
    return clip_to_friction(mean + lag * change, limit), first + change - excess


def is_closed(opening: Array) -> NDArray[np.bool_]:
    """Return where the normal spring acts."""
    # a joint that just touches is closed: the tangent of the unloaded structure would be singular
    return opening <= 0.0


def mean_closing_rate(start: Array, end: Array, rates: tuple[float, float]) -> Array:
    """Return the derivative of `mean_closing` from those of the gaps at start and end [-]."""
    fraction = contact_fraction(start, end)
    # the fraction is 0 / 0 where both gaps just touch
    fraction = np.where(is_closed(start) & is_closed(end), 1.0, fraction)
    square = 0.5 * fraction**2
    by_start = np.where(is_closed(start), fraction - square, square)
    by_end = np.where(is_closed(end), fraction - square, square)
    return rates[0] * by_start + rates[1] * by_end


def contact_fraction_rate(start: Array, end: Array, rates: tuple[float, float]) -> Array:
    """Return the derivative of `contact_fraction` from those of the gaps at start and end [1/m]."""
    fraction, changes = contact_fraction(start, end), is_closed(start) != is_closed(end)
    total = np.where(changes, abs(start) + abs(end), np.inf)  # no derivative without a change
    by_start, by_end = (np.where(is_closed(gap), 1.0 - fraction, fraction) for gap in (start, end))
    return -(rates[0] * by_start + rates[1] * by_end) / total


@dataclass(frozen=True, eq=False)
class Springs:
    """Normal forces by a quadrature rule: each point is a spring, closed or open as a whole."""

    points: JointPoints

    @property
    def coupling_pairs(self) -> tuple[Numbers, Numbers]:
        """Pairs of points whose forces and openings are coupled: each point with itself."""
        number = np.arange(len(self.points.offset))
        return number, number

    @cached_property
    def _spring(self) -> Array:
        """Stiffness of each point (p,) [N/m]."""
        return self.points.weight * self.points.normal_stiffness

    def forces(self, opening: Array) -> Array:
        """Return the normal forces at the points, positive where they pull (p,) [N]."""
        return normal_traction(opening, self._spring)

    def stiffness(self, opening: Array) -> Array:
        """Return the derivative of `forces` for each of `coupling_pairs` (p,) [N/m]."""
        return np.where(is_closed(opening), self._spring, 0.0)

    def contact_area(self, opening: Array) -> Array:
        """Return the area on which each point is closed (p,) [m²]."""
        return np.where(is_closed(opening), self.points.weight, 0.0)

    def contact_area_rate(self, opening: Array) -> Array:
        """Return the derivative of `contact_area` for each of `coupling_pairs` (p,) [m]."""
        return np.zeros_like(opening)

    def step_means(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Return the means over a step of `forces` and `contact_area`, each (p,) [N, m²]."""
        area = self.points.weight * contact_fraction(start, end)
        return self._spring * mean_closing(start, end), area

    def mean_stiffness(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean force by a parameter, as `stiffness` (p,) [N/m]."""
        return self._spring * mean_closing_rate(start, end, rates)

    def mean_area_rate(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean area by a parameter (p,) [m]."""
        return self.points.weight * contact_fraction_rate(start, end, rates)


# Gauss's three points on the unit interval, and their weights
GAUSS_POINTS = 0.5 * (1.0 + np.sqrt([0.6, 0.0, 0.6]) * [-1, 0, 1])
GAUSS_WEIGHTS = np.array([5, 8, 5]) / 18.0


@dataclass(frozen=True, eq=False)
class Facets:
    """Normal forces integrated exactly over facets along which the opening is linear.

    With φ the two linear functions of a facet and c the part of it that is closed,

        f_i = K_ij g_j,   K_ij = ∫_c w k_n φ_i φ_j,

    and because the traction vanishes at the end of c, K is the derivative of f as well.

    Over a step the gap of every place of a facet is linear in time, and the mean of its traction
    has a closed form. It is integrated by Gauss's rule between the places where the facet opens or
    closes at the start or at the end. The integrands of the energy are polynomials there, which the
    rule integrates exactly, so the work of a step is the change of energy.
    """

    points: JointPoints  # both ends of each facet, one facet after the other

    @property
    def coupling_pairs(self) -> tuple[Numbers, Numbers]:
        """Pairs of points whose forces and openings are coupled: the ends of a facet."""
        a = np.arange(0, len(self.points.offset), 2)
        b = a + 1
        return np.concatenate([a, a, b, b]), np.concatenate([a, b, a, b])

    @cached_property
    def _area(self) -> Array:
        """Area of each facet (f,) [m²]."""
        return self.points.weight[0::2] + self.points.weight[1::2]

    @cached_property
    def _spring(self) -> Array:
        """Stiffness of each facet (f,) [N/m]."""
        return self._area * self.points.normal_stiffness[0::2]

    def _find_closed_part(self, opening: Array) -> tuple[Array, Array]:
        """Return the ends of the closed part of each facet of unit length (f,)."""
        a, b = opening[0::2], opening[1::2]
        zero = _zero_crossing(a, b)
        start = np.where(is_closed(a), 0.0, zero)
        end = np.where(is_closed(b), 1.0, zero)
        closed = is_closed(a) | is_closed(b)
        return np.where(closed, start, 0.0), np.where(closed, end, 0.0)

    def _moments(self, opening: Array) -> tuple[Array, Array, Array]:
        """Return ∫_c φ_i φ_j over a facet of unit length, for (1, 1), (1, 2) and (2, 2)."""
        start, end = self._find_closed_part(opening)
        squares, cubes = (end**2 - start**2) / 2.0, (end**3 - start**3) / 3.0
        return (end - start) - 2.0 * squares + cubes, squares - cubes, cubes

    def forces(self, opening: Array) -> Array:
        """Return the normal forces at the ends of the facets, positive where they pull (p,) [N]."""
        first, mixed, second = self._moments(opening)
        a, b = opening[0::2], opening[1::2]
        return _interleave(
            self._spring * (first * a + mixed * b), self._spring * (mixed * a + second * b)
        )

    def stiffness(self, opening: Array) -> Array:
        """Return the derivative of `forces` for each of `coupling_pairs` (2 p,) [N/m]."""
        first, mixed, second = self._moments(opening)
        return np.concatenate([self._spring * k for k in (first, mixed, mixed, second)])

    def contact_area(self, opening: Array) -> Array:
        """Return the closed area of the facets, distributed to their ends by φ (p,) [m²]."""
        start, end = self._find_closed_part(opening)
        second = (end**2 - start**2) / 2.0
        return _interleave(self._area * (end - start - second), self._area * second)

    def contact_area_rate(self, opening: Array) -> Array:
        """Return the derivative of `contact_area` for each of `coupling_pairs` (2 p,) [m]."""
        a, b = opening[0::2], opening[1::2]
        partly, zero = is_closed(a) != is_closed(b), _zero_crossing(a, b)
        # the zero z = a / (a - b) ends the closed part, or begins it; φ at z divides the area
        sign = np.where(is_closed(a), 1.0, -1.0) * self._area
        with np.errstate(divide="ignore", invalid="ignore"):
            by_a, by_b = (np.where(partly, gap / (a - b) ** 2, 0.0) for gap in (-b, a))
        parts = ((1.0 - zero) * by_a, (1.0 - zero) * by_b, zero * by_a, zero * by_b)
        return np.concatenate([sign * part for part in parts])

    def step_means(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Return the means over a step of `forces` and `contact_area`, each (p,) [N, m²]."""
        (before, after), weights = self._integration(start, end)
        closing, fraction = (
            [np.sum(weight * values, axis=(0, 1)) for weight in weights]
            for values in (mean_closing(before, after), contact_fraction(before, after))
        )
        return (
            _interleave(*(self._spring * each for each in closing)),
            _interleave(*(self._area * each for each in fraction)),
        )

    def mean_stiffness(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean force by a parameter, as `stiffness` (2 p,) [N/m]."""
        (before, after), weights = self._integration(start, end)
        return _integrate_products(weights, self._spring * mean_closing_rate(before, after, rates))

    def mean_area_rate(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean area by a parameter (2 p,) [m]."""
        (before, after), weights = self._integration(start, end)
        return _integrate_products(
            weights, self._area * contact_fraction_rate(before, after, rates)
        )

    def _integration(
        self, start: Array, end: Array
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Return gaps at Gauss points at both ends of a step, and weights of ∫φ_1 and ∫φ_2."""
        # three segments, between the zero crossings at the start and at the end
        ends = [(gaps[0::2], gaps[1::2]) for gaps in (start, end)]
        zeros = np.sort([_zero_crossing(*gaps) for gaps in ends], axis=0)
        breaks = np.concatenate([np.zeros_like(zeros[:1]), zeros, np.ones_like(zeros[:1])])
        length = np.diff(breaks, axis=0)
        places = breaks[:-1, None] + GAUSS_POINTS[:, None] * length[:, None]
        weights = GAUSS_WEIGHTS[:, None] * length[:, None]
        before, after = ((1.0 - places) * a + places * b for a, b in ends)
        return (before, after), (weights * (1.0 - places), weights * places)


def _interleave(first: Array, second: Array) -> Array:
    """Return values at both ends of the facets as one row of points (p,)."""
    return np.stack([first, second], axis=1).ravel()


def _integrate_products(weights: tuple[Array, Array], values: Array) -> Array:
    """Return integrals of values times φ_i φ_j, from the weights of φ_1 and φ_2 (2 p,)."""
    first, second = weights
    # φ_2 at the Gauss points; empty segments have zero weights
    place = second / np.where(first + second > 0.0, first + second, 1.0)
    products = (first * (1.0 - place), first * place, second * (1.0 - place), second * place)
    return np.concatenate([np.sum(product * values, axis=(0, 1)) for product in products])


def _zero_crossing(a: Array, b: Array) -> Array:
    """Return where a line from a to b crosses zero, on the unit interval; 0 where it does not."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(is_closed(a) != is_closed(b), a / (a - b), 0.0)


Law = Springs | Facets


def choose_law(rule: Quadrature, points: JointPoints) -> Law:
    """Return the normal law of a quadrature rule."""
    return Facets(points) if rule.rule == "exact" else Springs(points)


# Excess over the strength of a bond, relative to it, that counts as round-off [-]
BOND_STRENGTH_TOLERANCE = 1e-9


def dilatancy_opening(points: JointPoints, slip: Array) -> Array | None:
    """Return the opening of each point by dilatancy (p,) [m]; None without dilatancy."""
    return None if points.dilatancy is None else points.dilatancy * np.abs(slip)


@dataclass(frozen=True, eq=False)
class Bonds:
    """Intact and broken bonds of the joint points."""

    law: Law  # normal forces from gaps
    broken: Array  # 1 where a bond is broken, else 0 (p,)

    @cached_property
    def intact(self) -> NDArray[np.bool_]:
        """Whether each point has an intact bond (p,)."""
        return (self._strength > 0.0) & (self.broken == 0.0)

    @cached_property
    def stretch(self) -> Array:
        """Gap at the tensile strength, f_t / k_n; 0 without bond (p,) [m]."""
        return np.where(self.intact, self._strength, 0.0) / self.law.points.normal_stiffness

    @cached_property
    def pull(self) -> Array:
        """Force of each point at the gap `stretch`, f_t times its area (p,) [N]."""
        return normal_forces(self.law, self.stretch)

    @cached_property
    def cohesion(self) -> Array:
        """Cohesion for gaps less `stretch`: c - μ f_t if bonded, 0 if broken (p,) [Pa]."""
        points = self.law.points
        with np.errstate(invalid="ignore"):  # infinite friction times zero strength
            lowered = points.cohesion - points.friction * self._strength
        bonded = np.where(self.intact, np.maximum(lowered, 0.0), 0.0)
        return np.where(self._strength > 0.0, bonded, points.cohesion)

    def energy_of_pull(self, gaps: Array) -> Array:
        """Return the energy of the forces `pull`, from gaps less `stretch` (p,) [J]."""
        return self.pull * (gaps + 0.5 * self.stretch)

    def find_exceeded(self, gaps: Array) -> NDArray[np.bool_]:
        """Return which bonds are pulled beyond their strength, from gaps less `stretch` (p,)."""
        return self.intact & (gaps > BOND_STRENGTH_TOLERANCE * self.stretch)

    def most_exceeded(self, gaps: Array) -> NDArray[np.bool_]:
        """Return the bonds beyond their strength at the largest gap of each joint (p,)."""
        exceeded, joint = self.find_exceeded(gaps), self.law.points.joint
        largest = np.zeros(self.law.points.joint_count)
        np.maximum.at(largest, joint, np.where(exceeded, gaps, 0.0))
        # points with gaps equal but for round-off break together
        return exceeded & (gaps >= (1.0 - 1e-6) * largest[joint])

    def broken_after(self, exceeded: NDArray[np.bool_], excess: Array, limit: Array) -> Array:
        """Return the flags of broken bonds at the end of a step, as `broken` (p,)."""
        points = self.law.points
        tolerance = BOND_STRENGTH_TOLERANCE * (limit + points.cohesion * points.weight)
        # a bond also breaks once its point slides
        broken = self.intact & (exceeded | (np.abs(excess) > tolerance))
        return np.where(broken, 1.0, self.broken)

    @property
    def _strength(self) -> Array:
        strength = self.law.points.tension
        return np.zeros_like(self.broken) if strength is None else strength


def normal_forces(law: Law, gaps: Array) -> Array:
    """Return the normal forces at the points of joints closed all over (p,) [N]."""
    first, second = law.coupling_pairs
    forces = np.zeros_like(gaps)
    np.add.at(forces, first, law.stiffness(np.full(len(gaps), -1.0)) * gaps[second])
    return forces
