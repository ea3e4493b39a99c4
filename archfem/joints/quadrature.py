"""Quadrature of the tractions along a joint: rules on facets, and the points on all joints."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from archfem._typing import Array, Flags, Numbers
from archfem._validation import check_choice, check_integer
from archfem.errors import InvalidInput
from archfem.joints.contact_law import ContactLaw
from archfem.masonry.structure import Structure

legendre: Any = np.polynomial.legendre  # without type annotations


@dataclass(frozen=True)
class Quadrature:
    """Define a quadrature rule on each facet of a joint.

    Near a hinge the outermost point is the lever arm. A rule with points at the ends of the joint
    (Lobatto, trapezoidal, nodal) can therefore reach |e| = 0.5, and a Gauss rule cannot.

    Attributes:
        rule: "lobatto" or "gauss"; "trapezoidal": n equidistant points, the ends with half the
            weight of the others, 1 / (n - 1); "nodal": springs at the nodes of the element,
            weighted by the trapezoidal rule (degree 1) or Simpson's (degree 2), as in Demirel and
            Aldemir (2021); "exact": the traction integrated in closed form, for facets along which
            the opening is linear.
        points: number of points on a facet; None takes 3, for "trapezoidal" 2, for "nodal" those
            of the element, for "exact" the two ends, which neighbouring facets then do not share.

    Raises:
        InvalidInput: the rule is unknown, or does not exist for this number of points.

    Example:
        >>> af.joints.Quadrature("lobatto").on_facet(1)[0].tolist()
        [0.0, 0.5, 1.0]
    """

    rule: str = "lobatto"
    points: int | None = None

    def __post_init__(self) -> None:
        """Check the rule and its number of points."""
        rules = ("lobatto", "trapezoidal", "nodal", "gauss", "exact")
        check_choice(self.rule, "quadrature", rules)
        if self.points is None:
            return
        if self.rule in ("nodal", "exact"):
            raise InvalidInput(
                f"{self.rule} quadrature has points of its own, not {self.points}: leave points out"
            )
        minimum = 1 if self.rule == "gauss" else 2
        check_integer(self.points, f"{self.rule} points on a facet", minimum=minimum, maximum=64)

    def count(self, degree: int) -> int:
        """Return the number of points on one facet.

        Args:
            degree: polynomial degree of the element, used by the nodal rule only.
        """
        if self.rule == "exact":
            return 2
        if self.rule == "nodal":
            return degree + 1
        return self.points or (2 if self.rule == "trapezoidal" else 3)

    def on_facet(self, degree: int) -> tuple[Array, Array]:
        """Return points and weights on the interval from 0 to 1.

        Args:
            degree: polynomial degree of the element, used by the nodal rule only.

        Returns:
            Points in ascending order (p,) and weights (p,), both [-].
        """
        n = self.count(degree)
        if self.rule == "trapezoidal":
            weights = np.full(n, 1.0 / (n - 1))
            weights[[0, -1]] *= 0.5
            return np.linspace(0.0, 1.0, n), weights
        points, weights = legendre.leggauss(n) if self.rule == "gauss" else _lobatto(n)
        return 0.5 * (1.0 + points), 0.5 * weights

    def on_joint(self, breaks: Array, degree: int = 1) -> tuple[Array, Array]:
        """Return points and weights on a joint made of several facets.

        A point shared by two neighbouring facets occurs once, with the sum of both weights.

        Args:
            breaks: ends of the facets along the joint (f + 1,), ascending [m].
            degree: polynomial degree of the element, used by the nodal rule only.

        Returns:
            Points (p,) and weights (p,), both in the unit of `breaks`.
        """
        unit, weight = self.on_facet(degree)
        lengths = np.diff(breaks)[:, None]
        shares_ends = self.rule in ("lobatto", "trapezoidal", "nodal")
        stride = len(unit) - shares_ends
        number = stride * np.arange(len(lengths))[:, None] + np.arange(len(unit))
        points = np.empty(number[-1, -1] + 1)
        weights = np.zeros_like(points)
        points[number] = breaks[:-1, None] + lengths * unit
        np.add.at(weights, number, lengths * weight)
        return points, weights


def _lobatto(n: int) -> tuple[Array, Array]:
    """Return Gauss-Lobatto points and weights on [-1, 1]: the ends and the roots of P'_{n-1}."""
    polynomial = np.zeros(n)
    polynomial[-1] = 1.0
    inner = legendre.legroots(legendre.legder(polynomial)) if n > 2 else np.array([])
    points = np.concatenate([[-1.0], np.sort(inner.real), [1.0]])
    return points, 2.0 / (n * (n - 1) * legendre.legval(points, polynomial) ** 2)


@dataclass(frozen=True, eq=False)
class JointPoints:
    """Quadrature points on the joints of a structure."""

    joint: Numbers  # number of each point's joint (p,)
    offset: Array  # distance from the joint's mid-depth toward the extrados (p,) [m]
    weight: Array  # joint area of each point, width included (p,) [m²]
    contact: ContactLaw  # contact law, an array (p,) for each parameter
    joint_count: int
    dilatancy: Array | None = None  # tan ψ (p,) [-]; None without dilatancy at any point
    tension: Array | None = None  # tensile strength f_t (p,) [Pa]; None without bonds
    # damage of bonds by irreversible opening and by slip, 0 of brittle ones, each (p,) [1/m];
    # None without softening
    damage_by_opening: Array | None = None
    damage_by_slip: Array | None = None
    has_own_laws: bool = False  # whether any point has a law of the user

    @classmethod
    def on(cls, structure: Structure, rules: list[tuple[Array, Array]]) -> "JointPoints":
        """Return points with the contact parameters of their joints, from rules for each joint."""
        sizes = [len(offsets) for offsets, _ in rules]
        joint = np.repeat(np.arange(len(rules)), sizes)
        contacts = [joint.contact for joint in structure.joints]
        return cls(
            joint,
            np.concatenate([offsets for offsets, _ in rules]),
            np.concatenate([lengths for _, lengths in rules]) * structure.width,
            ContactLaw.at_points(contacts, joint),
            len(rules),
            _spread_if_any([contact.dilatancy for contact in contacts], joint),
            _spread_if_any([contact.tension for contact in contacts], joint),
            _spread_if_any([contact.damage_rates[0] for contact in contacts], joint),
            _spread_if_any([contact.damage_rates[1] for contact in contacts], joint),
            structure.has_own_laws,
        )

    @property
    def is_plain(self) -> bool:
        """Whether no point has dilatancy, a bond or a law of the user."""
        return self.dilatancy is None and self.tension is None and not self.has_own_laws

    @cached_property
    def stiffens(self) -> bool:
        """Whether any joint stiffens as it closes."""
        return bool(self.contact.closing_rate.any())

    @cached_property
    def slides(self) -> Flags:
        """Whether each point can slide (p,)."""
        return np.asarray(self.contact.resistance == 0.0)

    @cached_property
    def shear_spring(self) -> Array:
        """Elastic shear stiffness of each point (p,) [N/m]."""
        return self.weight * self.contact.shear_stiffness

    def sum_by_joint(self, values: Array) -> Array:
        """Return the sums over the points of every joint (n_joints,)."""
        return np.asarray(np.bincount(self.joint, values, self.joint_count), float)


def _spread_if_any(values: list[float], joint: Numbers) -> Array | None:
    """Return values of the joints at their points (p,); None where all are zero."""
    return np.array(values)[joint] if any(values) else None
