"""Points on the joints, and the normal forces there from openings.

How the traction between and at the points becomes the forces f is the law's: springs at quadrature
points, f = W t, or the exact integral over facets along which the opening is linear. Each gives
forces at an instant and their mean over a step, along which openings change linearly, both with
their derivatives, and the area on which each point is closed. Along the joints every point is a
spring of its own.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.joints.law import closed_time, is_closed, mean_closing, normal_traction
from archfem.joints.quadrature import Quadrature
from archfem.masonry.structure import Structure

Numbers = NDArray[np.intp]

PLACES, SHARES = 0.5 * (1.0 + np.sqrt([0.6, 0.0, 0.6]) * [-1, 0, 1]), np.array([5, 8, 5]) / 18.0
"""Gauss's three points on the unit interval, and their weights."""


@dataclass(frozen=True, eq=False)
class JointPoints:
    """Quadrature points on the joints of a structure.

    Attributes:
        joint: number of the joint each point lies on (p,).
        arm: distance from the joint's mid-point toward the extrados (p,) [m].
        weight: joint area that each point stands for, width included (p,) [m²].
        normal_stiffness: k_n (p,) [Pa/m].
        shear_stiffness: k_s (p,) [Pa/m].
        friction: μ, infinite where a point never slides (p,) [-].
        cohesion: c (p,) [Pa].
        count: number of joints.
    """

    joint: Numbers
    arm: Array
    weight: Array
    normal_stiffness: Array
    shear_stiffness: Array
    friction: Array
    cohesion: Array
    count: int

    @classmethod
    def on(cls, structure: Structure, rules: list[tuple[Array, Array]]) -> "JointPoints":
        """Return points put on the joints of a structure.

        Args:
            structure: whose joints they lie on.
            rules: of each joint, the arms of its points and the length that each stands for (p,)
                [m].
        """
        sizes = [len(arms) for arms, _ in rules]
        joint = np.repeat(np.arange(len(rules)), sizes)
        contacts = [each.contact for each in structure.joints]
        numbers = [
            (c.normal_stiffness, c.shear_stiffness, c.coefficient, c.cohesion) for c in contacts
        ]
        return cls(
            joint,
            np.concatenate([arms for arms, _ in rules]),
            np.concatenate([lengths for _, lengths in rules]) * structure.width,
            *np.array(numbers).T[:, joint],
            len(rules),
        )

    def chosen(self, rows: Numbers, weight: Array) -> "JointPoints":
        """Return some of the points.

        Args:
            rows: numbers of those (r,).
            weight: joint area that each of those stands for (r,) [m²].
        """
        return JointPoints(
            self.joint[rows],
            self.arm[rows],
            weight,
            self.normal_stiffness[rows],
            self.shear_stiffness[rows],
            self.friction[rows],
            self.cohesion[rows],
            self.count,
        )

    @cached_property
    def slides(self) -> NDArray[np.bool_]:
        """Whether each point can slide (p,)."""
        return np.isfinite(self.friction)

    @cached_property
    def shear(self) -> Array:
        """Elastic shear force of each point per slip (p,) [N/m]."""
        return self.weight * self.shear_stiffness


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

    def forces(self, opening: Array) -> Array:
        """Return the normal forces at the points, positive where they pull (p,) [N].

        Args:
            opening: gaps at the points, positive where open (p,) [m].
        """
        forces: Array = normal_traction(opening, self._normal)
        return forces

    def stiffness(self, opening: Array) -> Array:
        """Return the derivative of `forces`, one number for each of `entries` (p,) [N/m].

        Args:
            opening: gaps at the points (p,) [m].
        """
        return np.where(is_closed(opening), self._normal, 0.0)

    def closed(self, opening: Array) -> Array:
        """Return the area on which each point is closed (p,) [m²].

        Args:
            opening: gaps at the points (p,) [m].
        """
        return np.where(is_closed(opening), self.points.weight, 0.0)

    def closed_rate(self, opening: Array) -> Array:
        """Return the derivative of `closed`, one number for each of `entries` (p,) [m].

        Args:
            opening: gaps at the points (p,) [m].
        """
        return np.zeros_like(opening)

    def mean(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Return the means over a step of `forces` and `closed`, each (p,) [N, m²].

        Args:
            start: gaps at its start (p,) [m].
            end: gaps at its end (p,) [m].
        """
        area: Array = self.points.weight * closed_time(start, end)
        return self._normal * mean_closing(start, end), area

    def mean_stiffness(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean force by a parameter, for each of `entries` (p,) [N/m].

        Args:
            start: gaps at the start of the step (p,) [m].
            end: gaps at its end (p,) [m].
            rates: change of both per change of the parameter [-].
        """
        return self._normal * _closing_rate(start, end, rates)

    def mean_closed_rate(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean area by a parameter, for each of `entries` (p,) [m].

        Args:
            start: gaps at the start of the step (p,) [m].
            end: gaps at its end (p,) [m].
            rates: change of both per change of the parameter [-].
        """
        return self.points.weight * _time_rate(start, end, rates)


@dataclass(frozen=True, eq=False)
class Facets:
    """The traction integrated exactly over facets along which the opening is linear.

    With φ the two linear functions of a facet and c the part of it that is closed,

        f_i = K_ij g_j,   K_ij = ∫_c w k_n φ_i φ_j,

    and because the traction vanishes at the end of c, K is the derivative of f as well.

    Over a step every place of a facet goes straight from its gap at the start to that at the end.
    The mean of its traction is known in closed form, and integrated by Gauss's rule between the
    places where the facet opens or closes at the start or at the end: there energies are
    polynomials that the rule integrates exactly, so the work of a step is the change of energy.

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
    def _area(self) -> Array:
        return self.points.weight[0::2] + self.points.weight[1::2]

    @cached_property
    def _normal(self) -> Array:
        return self._area * self.points.normal_stiffness[0::2]

    def _ends(self, opening: Array) -> tuple[Array, Array]:
        """From where to where each facet, of unit length, is closed."""
        a, b = opening[0::2], opening[1::2]
        zero = _zero(a, b)
        start = np.where(is_closed(a), 0.0, zero)
        end = np.where(is_closed(b), 1.0, zero)
        closed = is_closed(a) | is_closed(b)
        return np.where(closed, start, 0.0), np.where(closed, end, 0.0)

    def _closed(self, opening: Array) -> tuple[Array, Array, Array]:
        """∫_c φ_i φ_j over a facet of unit length, for (1, 1), (1, 2) and (2, 2)."""
        start, end = self._ends(opening)
        squares, cubes = (end**2 - start**2) / 2.0, (end**3 - start**3) / 3.0
        return (end - start) - 2.0 * squares + cubes, squares - cubes, cubes

    def forces(self, opening: Array) -> Array:
        """Return the normal forces at the ends of the facets, positive where they pull (p,) [N].

        Args:
            opening: gaps at the ends, positive where open (p,) [m].
        """
        first, mixed, second = self._closed(opening)
        a, b = opening[0::2], opening[1::2]
        return _in_turn(
            self._normal * (first * a + mixed * b), self._normal * (mixed * a + second * b)
        )

    def stiffness(self, opening: Array) -> Array:
        """Return the derivative of `forces`, one number for each of `entries` (2 p,) [N/m].

        Args:
            opening: gaps at the ends (p,) [m].
        """
        first, mixed, second = self._closed(opening)
        return np.concatenate([self._normal * k for k in (first, mixed, mixed, second)])

    def closed(self, opening: Array) -> Array:
        """Return the area on which the facet is closed, shared among its ends (p,) [m²].

        Args:
            opening: gaps at the ends (p,) [m].
        """
        start, end = self._ends(opening)
        second = (end**2 - start**2) / 2.0
        return _in_turn(self._area * (end - start - second), self._area * second)

    def closed_rate(self, opening: Array) -> Array:
        """Return the derivative of `closed`, one number for each of `entries` (2 p,) [m].

        Args:
            opening: gaps at the ends (p,) [m].
        """
        a, b = opening[0::2], opening[1::2]
        turns, place = is_closed(a) != is_closed(b), _zero(a, b)
        grows = np.where(is_closed(a), 1.0, -1.0) * self._area
        with np.errstate(divide="ignore", invalid="ignore"):
            by_a, by_b = (np.where(turns, each / (a - b) ** 2, 0.0) for each in (-b, a))
        parts = ((1.0 - place) * by_a, (1.0 - place) * by_b, place * by_a, place * by_b)
        return np.concatenate([grows * part for part in parts])

    def mean(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Return the means over a step of `forces` and `closed`, each (p,) [N, m²].

        Args:
            start: gaps at its start (p,) [m].
            end: gaps at its end (p,) [m].
        """
        (before, after), functions = self._over(start, end)
        sums = [
            [np.sum(function * values, axis=(0, 1)) for function in functions]
            for values in (mean_closing(before, after), closed_time(before, after))
        ]
        return (
            _in_turn(*(self._normal * each for each in sums[0])),
            _in_turn(*(self._area * each for each in sums[1])),
        )

    def mean_stiffness(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean force by a parameter, of each of `entries` (2 p,).

        Args:
            start: gaps at the start of the step (p,) [m].
            end: gaps at its end (p,) [m].
            rates: change of both per change of the parameter [-].
        """
        (before, after), functions = self._over(start, end)
        return _squared(functions, self._normal * _closing_rate(before, after, rates))

    def mean_closed_rate(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean area by a parameter, of each of `entries` (2 p,) [m].

        Args:
            start: gaps at the start of the step (p,) [m].
            end: gaps at its end (p,) [m].
            rates: change of both per change of the parameter [-].
        """
        (before, after), functions = self._over(start, end)
        return _squared(functions, self._area * _time_rate(before, after, rates))

    def _over(self, start: Array, end: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Places on the facets (3, 3, facets): gaps there at both ends of a step, and weights.

        The weights are those of the integrals of φ_1 and φ_2 over a facet of unit length.
        """
        ends = [(gaps[0::2], gaps[1::2]) for gaps in (start, end)]
        zeros = np.sort([_zero(*each) for each in ends], axis=0)
        breaks = np.concatenate([np.zeros_like(zeros[:1]), zeros, np.ones_like(zeros[:1])])
        length = np.diff(breaks, axis=0)
        places = breaks[:-1, None] + PLACES[:, None] * length[:, None]
        weights = SHARES[:, None] * length[:, None]
        before, after = ((1.0 - places) * a + places * b for a, b in ends)
        return (before, after), (weights * (1.0 - places), weights * places)


Law = Springs | Facets


def law_of(rule: Quadrature, points: JointPoints) -> Law:
    """Return the law that a quadrature rule asks for.

    Args:
        rule: quadrature on each facet.
        points: that it has put on the joints.
    """
    return Facets(points) if rule.rule == "exact" else Springs(points)


def _in_turn(first: Array, second: Array) -> Array:
    """Values at both ends of the facets as one row of points (p,)."""
    return np.stack([first, second], axis=1).ravel()


def _squared(functions: tuple[Array, Array], values: Array) -> Array:
    """Integrals of values times φ_i φ_j from the weights of φ_1 and φ_2, as entries (2 p,)."""
    first, second = functions
    share = second / np.where(first + second > 0.0, first + second, 1.0)
    parts = (first * (1.0 - share), first * share, second * (1.0 - share), second * share)
    return np.concatenate([np.sum(part * values, axis=(0, 1)) for part in parts])


def _zero(a: Array, b: Array) -> Array:
    """Where a line from a to b crosses zero, on the unit interval; 0 where it does not."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(is_closed(a) != is_closed(b), a / (a - b), 0.0)


def _closing_rate(start: Array, end: Array, rates: tuple[float, float]) -> Array:
    """Derivative of `mean_closing` by a parameter at `rates` of which both gaps change."""
    time = closed_time(start, end)
    time = np.where(is_closed(start) & is_closed(end), 1.0, time)  # also where both just touch
    square = 0.5 * time**2
    by_start = np.where(is_closed(start), time - square, square)
    by_end = np.where(is_closed(end), time - square, square)
    rate: Array = rates[0] * by_start + rates[1] * by_end
    return rate


def _time_rate(start: Array, end: Array, rates: tuple[float, float]) -> Array:
    """Derivative of `closed_time` by a parameter at `rates` of which both gaps change."""
    time, turns = closed_time(start, end), is_closed(start) != is_closed(end)
    whole = np.where(turns, abs(start) + abs(end), np.inf)
    by_start, by_end = (np.where(is_closed(each), 1.0 - time, time) for each in (start, end))
    rate: Array = -(rates[0] * by_start + rates[1] * by_end) / whole
    return rate
