"""Joint laws of the user: tractions, tangent and history as functions of opening and slip.

A law is an object with the methods of `JointLaw`. It is evaluated at the points of a quadrature
rule, each on its own, in models of small displacements.

Over a time step opening and slip are linear in time, and tractions are means along this path, as in
`contact_law`. Simpson's rule takes the means, on parts of the step until these change nothing, so
that kinks of a law are found. The work on a law without history is then the change of its energy;
other losses are the work less this change.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from archfem._typing import Array, Numbers, Pascals, PascalsPerMetre
from archfem._validation import check_own_keys, report_user_errors, short_repr, validate_arguments
from archfem.errors import InvalidInput
from archfem.joints.contact_law import ContactLaw, clip_to_friction, is_closed, shear_tangent
from archfem.joints.normal_law import choose_law
from archfem.joints.operator import JointOperator, Pattern
from archfem.joints.quadrature import JointPoints, Quadrature
from archfem.joints.step_average import StepForces
from archfem.masonry.materials import Contact
from archfem.masonry.structure import Structure


class JointLaw(Protocol):
    """A joint law: tractions as functions of opening and slip, and of their history.

    Values are arrays over p joint points. The opening is positive where the joint is open, the
    slip is that of the higher block, positive toward the extrados. A normal traction is positive
    where it pulls, a shear traction where it resists a positive slip. `memory` has a row for each
    variable of the history, all zero in a joint that was never loaded.

    A law is frozen: its parameters are fields, and its history is in `memory` alone. The solver
    evaluates it many times from the same memory, that of the last state of rest or of the start of
    a time step; the memory after the converged state is the next one.

    Attributes:
        memory_size: number of variables of the history at each point, 0 for none.
    """

    memory_size: ClassVar[int]

    def respond(self, opening: Array, slip: Array, memory: Array) -> tuple[Any, Any, Any]:
        """Return the response to an opening and a slip.

        Args:
            opening: opening of each point (p,) [m].
            slip: slip of each point (p,) [m].
            memory: before (memory_size, p).

        Returns:
            Tractions (normal, shear), each (p,) [Pa]; their derivatives
            ((normal by opening, normal by slip), (shear by opening, shear by slip)), each (p,) or
            a number [Pa/m]; and the memory after (memory_size, p).
        """

    def energy(self, opening: Array, slip: Array, memory: Array) -> ArrayLike:
        """Return the energy stored for each area (p,) [J/m²].

        Args:
            opening: opening of each point (p,) [m].
            slip: slip of each point (p,) [m].
            memory: after the response to them (memory_size, p).
        """


@dataclass(frozen=True)
class DryJoint:
    """The law of a dry joint as a `JointLaw`: compression only, and Coulomb friction.

    It serves as an example, and as a base class. Joints without a law of their own have it where
    others of the structure have one.

    Attributes:
        normal_stiffness: compression per closing, k_n [Pa/m].
        shear_stiffness: shear traction per elastic slip, k_s [Pa/m].
        friction: Coulomb's coefficient μ [-]; infinite where the joint never slides, and is then
            sheared also where open.
        cohesion: c, where the joint is closed [Pa].
    """

    normal_stiffness: PascalsPerMetre
    shear_stiffness: PascalsPerMetre
    friction: float = inf
    cohesion: Pascals = 0.0

    memory_size: ClassVar[int] = 1

    def respond(self, opening: Array, slip: Array, memory: Array) -> tuple[Any, Any, Any]:
        """Return tractions, tangent and irreversible slip, as `JointLaw.respond`."""
        law = ContactLaw.of(self)
        closed = is_closed(law.cohesive_gap(opening))
        normal, across = law.normal_traction(opening), law.normal_tangent(opening)
        trial, limit = law.shear_traction(slip - memory[0]), law.shear_limit(normal, closed)
        shear = clip_to_friction(trial, limit)
        by_trial, by_limit = shear_tangent(trial, limit, closed)
        along, coupling = law.shear_traction(by_trial), by_limit * law.limit_rate(across, 0.0)
        lost = (trial - shear) / self.shear_stiffness
        return (normal, shear), ((across, 0.0), (coupling, along)), memory + lost

    def energy(self, opening: Array, slip: Array, memory: Array) -> Array:
        """Return the energy of both springs, as `JointLaw.energy`."""
        law, elastic = ContactLaw.of(self), slip - memory[0]
        along = 0.5 * law.shear_traction(elastic) * elastic
        return np.asarray(law.normal_energy(opening) + along)


# Laws that case files can name
registered_laws: dict[str, Callable[..., JointLaw]] = {}


@validate_arguments
def register_joint_law(name: str, law: type) -> None:
    """Add a joint law that contacts of case files can name, `law = { name = "NAME", … }`.

    In Python a law needs no registration: `Contact(…, law=…)`.

    Args:
        name: name of the law.
        law: frozen dataclass with the methods of `JointLaw`. Its fields are numbers, whole numbers
            and texts, the keys of a case; a number with a unit has it in its annotation,
            `Annotated[float, "Pa/m"]`, or its metadata, `field(metadata={"unit": "Pa/m"})`.

    Raises:
        InvalidInput: the class is no such dataclass.
    """
    check_own_keys(f"joint law '{name}'", law)
    _check_methods(law, f"joint law '{name}'")
    registered_laws[name] = law


def _check_methods(law: Any, what: str) -> None:
    """Refuse a law without its methods and its number of variables."""
    for method in ("respond", "energy"):
        if not callable(getattr(law, method, None)):
            raise InvalidInput(f"{what} has no method {method}(opening, slip, memory)")
    size = getattr(law, "memory_size", None)
    if not isinstance(size, int) or size < 0:
        raise InvalidInput(
            f"{what} has memory_size {short_repr(size)}: give the number of variables of its "
            "history, 0 for none"
        )


@dataclass(frozen=True, eq=False)
class PointLaws:
    """The laws of all joint points, each called once for all of its points."""

    laws: tuple[JointLaw, ...]
    number: Numbers  # law of each point (p,)

    @classmethod
    def of(cls, structure: Structure, points: JointPoints) -> "PointLaws":
        """Return the laws of the joints of a structure, checked once."""
        contacts = [joint.contact for joint in structure.joints]
        distinct = list(dict.fromkeys(contacts))
        laws = tuple(_law_of(contact) for contact in distinct)
        for law, contact in zip(laws, distinct, strict=True):
            check_law(law, f"law of contact '{contact.name}'")
        number = np.array([distinct.index(contact) for contact in contacts])
        return cls(laws, number[points.joint])

    @property
    def memory_size(self) -> int:
        """Largest number of variables of the history at a point."""
        return max(law.memory_size for law in self.laws)

    def respond(self, gaps: Array, memory: Array, rows: Numbers) -> tuple[Array, Array, Array]:
        """Return tractions (2, k), tangent (2, 2, k) and memory (m, k) at some of the points."""
        tractions, tangent = np.zeros_like(gaps), np.zeros((2, *gaps.shape))
        after = memory.copy()
        for number, law in enumerate(self.laws):
            of_law = np.flatnonzero(self.number[rows] == number)
            before = memory[: law.memory_size, of_law]
            found = evaluate_law(law, gaps[:, of_law], before, f"joint law {law!r}")
            tractions[:, of_law], tangent[:, :, of_law], after[: law.memory_size, of_law] = found
        return tractions, tangent, after

    def energy(self, gaps: Array, memory: Array) -> Array:
        """Return the energy stored at the points for each area (p,) [J/m²]."""
        stored = np.zeros_like(gaps[0])
        for number, law in enumerate(self.laws):
            of_law = self.number == number
            stored[of_law] = evaluate_energy(
                law, gaps[:, of_law], memory[: law.memory_size, of_law], f"joint law {law!r}"
            )
        return stored


def _law_of(contact: Contact) -> JointLaw:
    """Return the law of a contact: its own, or that of dry joints."""
    if contact.law is not None:
        return contact.law
    if contact.dilatancy > 0.0 or contact.tension > 0.0:
        raise InvalidInput(
            f"contact '{contact.name}' has dilatancy or tension beside contacts with a law of "
            "their own: leave both out, or give it a law as well"
        )
    stiffness = contact.normal_stiffness, contact.shear_stiffness
    return DryJoint(*stiffness, contact.coefficient, contact.cohesion)


def evaluate_law(law: JointLaw, gaps: Array, memory: Array, what: str) -> tuple[Array, ...]:
    """Return tractions (2, p), tangent (2, 2, p) and memory (m, p) of a law, of these shapes."""
    # a branch that `where` does not take may divide by zero; what it takes is checked below
    with report_user_errors(what), np.errstate(all="ignore"):
        tractions, tangent, after = law.respond(gaps[0], gaps[1], memory)
        count = gaps.shape[1]
        (normal, shear), ((a, b), (c, d)) = tractions, tangent
        rows = (*(normal, shear, a, b, c, d), *after)
        spread = np.stack([np.broadcast_to(np.asarray(row, float), (count,)) for row in rows])
    if len(spread) != 6 + len(memory):
        raise InvalidInput(
            f"{what}: {len(spread) - 6} rows of memory for memory_size = {len(memory)}"
        )
    if not np.isfinite(spread).all():
        point = int(np.flatnonzero(~np.isfinite(spread).all(axis=0))[0])
        raise InvalidInput(
            f"{what}: no finite values at opening {gaps[0, point]:.3g} m, slip {gaps[1, point]:.3g}"
            " m"
        )
    return spread[:2], spread[2:6].reshape(2, 2, count), spread[6:]


def evaluate_energy(law: JointLaw, gaps: Array, memory: Array, what: str) -> Array:
    """Return the energy of a law (p,) [J/m²]."""
    with report_user_errors(f"{what}, energy"):
        energy = np.asarray(law.energy(gaps[0], gaps[1], memory), float)
        return np.broadcast_to(energy, gaps[0].shape)


def check_law(law: JointLaw, what: str, count: int = 400) -> None:
    """Refuse a law whose tangent, or energy without history, does not belong to its tractions."""
    _check_methods(law, what)
    rng = np.random.default_rng(0)
    # from a hundredth of a micrometre to a centimetre; the second state follows on the first
    size = 10.0 ** rng.uniform(-8.0, -2.0, (2, 2, count))
    first, second = size * rng.choice([-1.0, 1.0], size.shape)
    memory = np.zeros((law.memory_size, count))
    for gaps in (first, second):
        _check_derivatives(law, gaps, memory, what)
        memory = evaluate_law(law, gaps, memory, what)[2]


def _check_derivatives(law: JointLaw, gaps: Array, memory: Array, what: str) -> None:
    """Compare tangent and tractions with central differences from one memory."""
    tractions, tangent, _ = evaluate_law(law, gaps, memory, what)
    step = 1e-6 * np.abs(gaps).max(axis=0)
    for axis, name in enumerate(("opening", "slip")):
        shift = np.zeros_like(gaps)
        shift[axis] = step
        ends = [evaluate_law(law, gaps + sign * shift, memory, what)[0] for sign in (1.0, -1.0)]
        rounding = 1e-13 * np.abs(tractions).max(axis=0) / step
        rate = (ends[0] - ends[1]) / (2.0 * step)
        scale = np.abs(tangent).max(axis=(0, 1)) + np.abs(rate).max(axis=0)
        found, size = tangent[:, axis], scale + rounding / 0.05
        _refuse_difference(found, rate, size, f"{what}: the tangent by {name}", "tractions", gaps)
        if law.memory_size == 0:
            high, low = (
                evaluate_energy(law, gaps + sign * shift, memory, what) for sign in (1.0, -1.0)
            )
            rate = ((high - low) / (2.0 * step))[None]
            stored = np.abs(evaluate_energy(law, gaps, memory, what))
            size = np.abs(tractions).max(axis=0) + 1e-13 * stored / step / 0.05
            _refuse_difference(
                tractions[axis][None], rate, size, f"{what}: the traction of {name}", "energy", gaps
            )


def _refuse_difference(
    found: Array, expected: Array, size: Array, what: str, of: str, gaps: Array
) -> None:
    """Refuse derivatives that differ at more points than a few kinks would make them differ."""
    tolerance, share = 0.05, 0.05
    relative = np.abs(found - expected).max(axis=0) / np.where(size > 0.0, size, 1.0)
    if np.mean(relative > tolerance) <= share:
        return
    # the median one of the wrong points is typical, where the worst may be beside a kink
    wrong = np.flatnonzero(relative > tolerance)
    point = wrong[np.argsort(relative[wrong])[len(wrong) // 2]]
    row = int(np.argmax(np.abs(found - expected)[:, point]))
    raise InvalidInput(
        f"{what} differs from the difference of {of} by {relative[point]:.0%}: "
        f"{found[row, point]:.4g} instead of {expected[row, point]:.4g} at opening "
        f"{gaps[0, point]:.3g} m, slip {gaps[1, point]:.3g} m; correct the law"
    )


@dataclass(frozen=True, eq=False)
class OwnLawOperator(JointOperator):
    """Joint operator whose points have laws of the user."""

    laws: PointLaws = field(kw_only=True)
    history: Array | None = None  # memory of the laws (m, p); None for zero

    @property
    def variables(self) -> Array:
        """Memory of the laws, zeros included (m, p)."""
        if self.history is not None:
            return self.history
        return np.zeros((self.laws.memory_size, len(self.points.offset)))

    @property
    def memory(self) -> Array:
        """Memory of the laws, one variable after the other (m p,)."""
        return self.variables.ravel()

    def with_memory(self, memory: Array) -> "OwnLawOperator":
        """Return the joint operator with another memory (m p,)."""
        return replace(self, history=memory.reshape(self.variables.shape))

    def gaps(self, q: Array) -> Array:
        """Return opening and slip of the points (2, p) [m]."""
        return np.stack([self.openings(q), self.slips(q)])

    def _respond(self, q: Array) -> tuple[Array, Array, Array]:
        """Return tractions, tangent and memory at the points."""
        return self.laws.respond(self.gaps(q), self.variables, np.arange(len(self.points.offset)))

    def point_forces(self, q: Array) -> tuple[Array, Array]:
        """Return normal and shear forces at the points, each (p,) [N]."""
        normal, shear = self.points.weight * self._respond(q)[0]
        return normal, shear

    def energy(self, q: Array) -> float:
        """Return the energy stored in the joints with the present memory [J]."""
        return float(self.points.weight @ self.laws.energy(self.gaps(q), self.variables))

    def updated_memory(self, q: Array) -> Array:
        """Return the memory once the joints are at rest at q, as `memory`."""
        return self._respond(q)[2].ravel()

    def stiffness(self, q: Array) -> Array:
        """Return the point stiffnesses on which the tangent depends (4 p,) [N/m]."""
        return self.arrange_stiffness(self._respond(q)[1])

    def arrange_stiffness(self, tangent: Array) -> Array:
        """Return derivatives of tractions as the point stiffnesses of `tangent_map` (4 p,)."""
        return np.asarray(self.points.weight * tangent).ravel()

    def linear_forces(self, stiffness: Array, gaps: Array) -> tuple[Array, Array]:
        """Return normal and shear forces at the points from point stiffnesses, each (p,) [N]."""
        normal, shear = np.einsum("abp,bp->ap", stiffness.reshape(2, 2, -1), gaps)
        return normal, shear

    def elastic_stiffness(self) -> Array:
        """Return the point stiffnesses with all joints closed, by the contacts' stiffnesses."""
        points = self.points
        none = np.zeros_like(points.weight)
        across = points.weight * points.contact.normal_stiffness
        return np.concatenate([across, none, none, points.shear_spring])

    def tangent_map(self, pattern: Pattern) -> sparse.csr_matrix:
        """Return the matrix from point stiffnesses to the entries of the tangent (nnz, 4 p)."""
        rows = self.opening, self.slip
        maps = [pattern.outer_product_map(left, right) for left in rows for right in rows]
        return sparse.hstack(maps, "csr")

    def coupling_pattern(self) -> sparse.csr_matrix:
        """Return a matrix with an entry wherever the tangent may have one (n, n)."""
        touched = abs(self.opening) + abs(self.slip)
        touched.data[:] = 1.0
        return (touched.T @ touched).tocsr()


def make_operator(
    structure: Structure,
    rule: Quadrature,
    points: JointPoints,
    opening: sparse.csr_matrix,
    slip: sparse.csr_matrix,
) -> JointOperator:
    """Return the joint operator of a structure from the rows of G."""
    law = choose_law(rule, points)
    if not points.has_own_laws:
        return JointOperator(law, opening, slip)
    return OwnLawOperator(law, opening, slip, laws=PointLaws.of(structure, points))


@dataclass(frozen=True, eq=False)
class OwnLawStep(StepForces):
    """Mean joint forces of a time step by laws of the user, without dilatancy of their own."""

    operator: OwnLawOperator  # with the joint memory at the start
    # means at the last coordinates, which force and tangent share
    _last: dict[bytes, tuple[Array, Array]] = field(default_factory=dict)

    @cached_property
    def _gaps_before(self) -> Array:
        """Opening and slip at the start (2, p) [m]."""
        return self.operator.gaps(self.start)

    def _mean_response(self, q: Array) -> tuple[Array, Array]:
        """Return mean tractions (2, p), and their derivatives by the gaps at the end (2, 2, p)."""
        key = q.tobytes()
        if key not in self._last:
            self._last.clear()
            self._last[key] = self._integrate(self.operator.gaps(q) - self._gaps_before)
        return self._last[key]

    def _integrate(self, change: Array, tolerance: float = 1e-10) -> tuple[Array, Array]:
        """Return the means along a path, by Simpson's rule on parts where these change it."""
        parts, max_divisions = 8, 8  # the last parts, 1e-7 of a step, add less than round-off
        total = np.zeros((6, change.shape[1]))
        rows, begin, length = np.arange(change.shape[1]), np.zeros(change.shape[1]), 1.0
        scale = np.zeros(0)
        for division in range(max_divisions + 1):
            places = begin + length * np.linspace(0.0, 1.0, 5)[:, None]
            values = self._evaluate(change, rows, places)
            if division == 0:
                scale = np.abs(values[:, :2]).max(axis=(0, 1))
            whole, halves = (
                length * np.tensordot(weights, values, 1)
                for weights in (np.array([1, 0, 4, 0, 1]) / 6.0, np.array([1, 4, 2, 4, 1]) / 12.0)
            )
            rough = np.abs(whole - halves)[:2].max(axis=0) > tolerance * scale[rows]
            rough &= division < max_divisions
            np.add.at(total.T, rows[~rough], halves[:, ~rough].T)
            length /= parts
            begin = (begin[rough] + length * np.arange(parts)[:, None]).ravel()
            rows = np.tile(rows[rough], parts)
            if not len(rows):
                break
        return total[:2], total[2:].reshape(2, 2, -1)

    def _evaluate(self, change: Array, rows: Numbers, places: Array) -> Array:
        """Return tractions, and derivatives by the gaps at the end, on the way (5, 6, k)."""
        # places of the points `rows` (k,) from 0 at the start to 1 at the end (5, k)
        ahead = places + self.damping_lag
        gaps = self._gaps_before[:, rows, None] + change[:, rows, None] * ahead.T
        all_rows = np.repeat(rows, len(places))
        memory = self.operator.variables[:, all_rows]
        tractions, tangent, _ = self.operator.laws.respond(gaps.reshape(2, -1), memory, all_rows)
        values = np.concatenate([tractions, tangent.reshape(4, -1)])
        values = values.reshape(6, len(rows), len(places)).transpose(2, 0, 1)
        values[:, 2:] *= ahead[:, None]
        return values

    def _point_forces(self, q: Array) -> tuple[Array, Array]:
        """Return mean normal and shear forces, each (p,) [N]."""
        normal, shear = self.operator.points.weight * self._mean_response(q)[0]
        return normal, shear

    def stiffness(self, q: Array) -> Array:
        """Return the derivative of the mean force, for `OwnLawOperator.tangent_map` (4 p,)."""
        return self.operator.arrange_stiffness(self._mean_response(q)[1])

    def updated_memory(self, q: Array) -> Array:
        """Return the joint memory at the end of the step, as `OwnLawOperator.memory`."""
        return self.operator.updated_memory(q)

    def dissipation(self, q: Array) -> float:
        """Return the work on the joints less the change of their energy [J]."""
        change = self.operator.gaps(q) - self._gaps_before
        work = float(np.sum(self._point_forces(q) * change))
        after = self.operator.with_memory(self.updated_memory(q))
        return work - (after.energy(q) - self.operator.energy(self.start))


def build_registered_law(name: str, values: dict[str, Any]) -> JointLaw:
    """Return a registered law from the values of its fields."""
    with report_user_errors(f"joint law '{name}'"):
        return registered_laws[name](**values)
