"""The strategy for large structures: one sparse factor for the run, unknowns at open points only.

The effective matrix with all joints closed is factorised once for a time step. With it a step is

    (K + μ M + ν R) w = r + Gᵀ λ,    z = G w,    λ = J(z) z,

of which multiplying by G leaves a small problem in the points that are open, with their compliance
F = G (K + μ M + ν R)⁻¹ Gᵀ, found point by point as they open. What comes out is checked against the
gaps of the whole structure. It is `modal` without the modes, for structures that have too many of
them, and takes any damping.
"""

from typing import Any, ClassVar, NamedTuple, Self

import numba
import numpy as np
from numba.extending import overload

from archfem.dynamics.stepping import passing  # noqa: F401  (steps of the conserving scheme)
from archfem.dynamics.stepping.compliance import Compliance
from archfem.dynamics.stepping.elimination import Elimination
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.linear import Linear, reordered, solve
from archfem.dynamics.stepping.loop import ITERATIONS
from archfem.dynamics.stepping.panels import Factor, backward, factorised, forward
from archfem.dynamics.stepping.small_problem import (
    SETTLED,
    exact,
    expected,
    largest,
    release,
    shift,
    unload,
)
from archfem.dynamics.stepping.sparse_rows import add_rows, row_times, times, trimmed
from archfem.dynamics.stepping.strategy import Reordered

ENTRY = 5e-6
"""What ordering and factorising take, for each entry of the mass matrix [s]."""


class SparseSystem(NamedTuple):
    """A structure's matrices in the order of their factor.

    Attributes:
        linear: its matrices by rows.
        factor: of K + μ M + ν R.
        group: of the factor to which each coordinate belongs (n,).
        compliance: F (p, p), of which the known rows are filled.
        known: which they are (p,).
    """

    linear: Linear
    factor: Factor
    group: Any
    compliance: Compliance
    known: Any


class Sparse(Reordered):
    """Steps with one sparse factor of the effective matrix.

    Args:
        equation: of motion.
    """

    name: ClassVar[str] = "compliance"

    def __init__(self, equation: Equation) -> None:
        model = equation.model
        parts = (trimmed(each) for each in (model.mass, equation.rest, model.closed()))
        self._elimination = Elimination.of(sum(abs(part) for part in parts))
        super().__init__(self._elimination.order)
        self._equation = equation

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the strategy, or None where supports have moved or more than joints is not linear.

        Args:
            equation: of motion.
        """
        return cls(equation) if equation.joints is not None else None

    @property
    def setup(self) -> float:
        """Estimate of the time until the first step can be taken [s]."""
        return ENTRY * float(self._equation.model.mass.nnz)

    def system(self, dt: float) -> SparseSystem:
        """Return all that steps of this length need.

        Args:
            dt: time step [s].
        """
        equation, order = self._equation, self.order
        linear = reordered(equation, order, dt)
        numbers = linear.numbers
        effective = (
            trimmed(equation.model.closed())
            + numbers.inertia * trimmed(equation.model.mass)
            + numbers.rate * trimmed(equation.rest)
        )
        points = len(linear.opening[0]) - 1
        return SparseSystem(
            linear,
            factorised(effective[order][:, order], self._elimination),
            self._elimination.group_of,
            Compliance.of(np.empty((points, points))),
            np.zeros(points, dtype=np.bool_),
        )


@overload(solve)
def _solve(system, vector, gap, before, force):  # type: ignore
    return _solved if getattr(system, "instance_class", None) is SparseSystem else None


def _solved(system, vector, gap, before, force):  # type: ignore
    """Solve a step: from its right side to the contact, in place; leaves gaps and λ.

    Returns:
        Passes over the joints; -1 if they do not settle.
    """
    opening, law, factor = system.linear.opening, system.linear.law, system.factor
    near = expected(law, gap, before, force)
    before[:] = gap
    start, room = np.empty(len(gap)), np.empty(len(vector))
    everywhere = np.ones(len(factor.parent), dtype=np.bool_)
    enough = SETTLED * largest(law, gap)
    forward(factor, vector, room)
    half = vector.copy()
    passes, fresh = 1, True
    for _ in range(ITERATIONS):
        rows = np.flatnonzero(near)
        if len(rows) > 0:
            _know(rows, system, room)
            if fresh:
                backward(factor, vector, room, _branches(rows, system))
                start[:] = 0.0
                for row in rows:
                    start[row] = row_times(opening, row, vector)
                shift(law, start)
            else:
                start[:] = gap
                unload(law, start, rows, system.compliance, force)
            taken = release(law, start, rows, system.compliance, force, enough)
            if taken < 0:
                return -1
            passes += taken - 1
            vector[:] = 0.0
            add_rows(opening, rows, force, vector)
            forward(factor, vector, room)
            for k in range(len(half)):
                vector[k] += half[k]
        backward(factor, vector, room, everywhere)
        times(opening, vector, gap)
        shift(law, gap)
        if exact(law, gap, force, near):
            return passes
        passes, fresh = passes + 1, False
    return -1


@numba.njit(cache=True)
def _know(rows, system, room):  # type: ignore
    """Find the rows of F that are not known yet, as far as they meet those that are."""
    known, compliance, opening = system.known, system.compliance.whole, system.linear.opening
    force = np.ones(len(known))
    for row in rows:
        if not known[row]:
            known[row] = True
            held = np.flatnonzero(known)
            vector = np.zeros(len(system.linear.weight))
            add_rows(opening, np.array([row]), force, vector)
            forward(system.factor, vector, room)
            backward(system.factor, vector, room, _branches(held, system))
            for other in held:
                compliance[row, other] = row_times(opening, other, vector)
                compliance[other, row] = compliance[row, other]


@numba.njit(cache=True)
def _branches(rows, system):  # type: ignore
    """Groups of the factor on which the gaps at these points depend."""
    indptr, indices, _ = system.linear.opening
    parent = system.factor.parent
    wanted = np.zeros(len(parent), dtype=np.bool_)
    for row in rows:
        for entry in range(indptr[row], indptr[row + 1]):
            group = system.group[indices[entry]]
            while group >= 0 and not wanted[group]:
                wanted[group] = True
                group = parent[group]
    return wanted
