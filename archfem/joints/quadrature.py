"""Rules that integrate the traction along a joint."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from archfem.arguments import among, whole
from archfem.arrays import Array
from archfem.errors import InvalidInput

legendre: Any = np.polynomial.legendre
"""Its functions have no types."""

RULES = ("lobatto", "nodal", "gauss", "exact")


@dataclass(frozen=True)
class Quadrature:
    """A rule on each facet of a joint.

    Near a hinge the outermost point is the lever arm, so a rule with points at the ends of the
    joint (Lobatto, nodal) can reach |e| = 0.5 and a Gauss rule cannot.

    Attributes:
        rule: "lobatto" or "gauss"; "nodal": springs at the nodes, weighted by the trapezoidal
            rule (degree 1) or Simpson's (degree 2), as in Demirel and Aldemir (2021); "exact":
            the traction integrated in closed form, for facets along which the opening is linear.
        points: points on a facet; None takes 3, for "nodal" those of the element, for "exact"
            the two ends, which neighbouring facets then do not share.

    Example:
        >>> af.joints.Quadrature("lobatto").on_facet(1)[0].tolist()
        [0.0, 0.5, 1.0]
    """

    rule: str = "lobatto"
    points: int | None = None

    def __post_init__(self) -> None:
        """Refuse unknown rules and impossible numbers of points."""
        if not among(self.rule, RULES):
            raise InvalidInput(f"quadrature {self.rule!r} is not known: use one of {RULES}")
        if self.rule in ("nodal", "exact") and self.points is not None:
            raise InvalidInput(
                f"{self.rule} quadrature has points of its own, not {self.points}: leave points out"
            )
        least = 1 if self.rule == "gauss" else 2
        if self.points is not None and not least <= whole(self.points, "quadrature points") <= 64:
            raise InvalidInput(
                f"{self.points} {self.rule} points on a facet: give between {least} and 64"
            )

    def count(self, degree: int) -> int:
        """Return the number of points on one facet.

        Args:
            degree: of the element, which only the nodal rule asks for.
        """
        if self.rule == "exact":
            return 2
        if self.rule == "nodal":
            return degree + 1
        return self.points or 3

    def on_facet(self, degree: int) -> tuple[Array, Array]:
        """Return points (p,) and weights (p,) on the interval from 0 to 1, in ascending order.

        Args:
            degree: of the element, which only the nodal rule asks for.
        """
        n = self.count(degree)
        points, weights = legendre.leggauss(n) if self.rule == "gauss" else _lobatto(n)
        return 0.5 * (1.0 + points), 0.5 * weights

    def on_joint(self, breaks: Array, degree: int = 1) -> tuple[Array, Array]:
        """Points and weights on a joint made of several facets.

        Points that two neighbouring facets share are given once, with both weights.

        Args:
            breaks: ends of the facets along the joint (f + 1,), ascending [m].
            degree: degree of the element, which only the nodal rule asks for.

        Returns:
            Points (p,) and weights (p,), both in the unit of `breaks`.
        """
        unit, share = self.on_facet(degree)
        lengths = np.diff(breaks)[:, None]
        stride = len(unit) - (self.rule in ("lobatto", "nodal"))  # these share their end points
        number = stride * np.arange(len(lengths))[:, None] + np.arange(len(unit))
        points = np.empty(number[-1, -1] + 1)
        weights = np.zeros_like(points)
        points[number] = breaks[:-1, None] + lengths * unit
        np.add.at(weights, number, lengths * share)
        return points, weights


def _lobatto(n: int) -> tuple[Array, Array]:
    """Gauss-Lobatto points and weights on [-1, 1]: the ends and the roots of P'_{n-1}."""
    polynomial = np.zeros(n)
    polynomial[-1] = 1.0
    inner = legendre.legroots(legendre.legder(polynomial)) if n > 2 else np.array([])
    points = np.concatenate([[-1.0], np.sort(inner.real), [1.0]])
    return points, 2.0 / (n * (n - 1) * legendre.legval(points, polynomial) ** 2)
