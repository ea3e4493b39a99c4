"""Normal forces of facets of the joints along which the opening is linear, integrated exactly.

At an instant and in the mean of a step, along which openings change linearly, both with their
derivatives, and the area on which each facet is closed; `springs` has the same methods.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from archfem.arrays import Array
from archfem.joints.law import (
    closed_time,
    closed_time_rate,
    is_closed,
    mean_closing,
    mean_closing_rate,
)
from archfem.joints.points import JointPoints, Numbers

PLACES, SHARES = 0.5 * (1.0 + np.sqrt([0.6, 0.0, 0.6]) * [-1, 0, 1]), np.array([5, 8, 5]) / 18.0
"""Gauss's three points on the unit interval, and their weights."""


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
        return _squared(functions, self._normal * mean_closing_rate(before, after, rates))

    def mean_closed_rate(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean area by a parameter, of each of `entries` (2 p,) [m].

        Args:
            start: gaps at the start of the step (p,) [m].
            end: gaps at its end (p,) [m].
            rates: change of both per change of the parameter [-].
        """
        (before, after), functions = self._over(start, end)
        return _squared(functions, self._area * closed_time_rate(before, after, rates))

    def _over(self, start: Array, end: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Gaps at both ends of a step at places on facets, and weights of ∫φ_1 and ∫φ_2 there."""
        ends = [(gaps[0::2], gaps[1::2]) for gaps in (start, end)]
        zeros = np.sort([_zero(*each) for each in ends], axis=0)
        breaks = np.concatenate([np.zeros_like(zeros[:1]), zeros, np.ones_like(zeros[:1])])
        length = np.diff(breaks, axis=0)
        places = breaks[:-1, None] + PLACES[:, None] * length[:, None]
        weights = SHARES[:, None] * length[:, None]
        before, after = ((1.0 - places) * a + places * b for a, b in ends)
        return (before, after), (weights * (1.0 - places), weights * places)


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
