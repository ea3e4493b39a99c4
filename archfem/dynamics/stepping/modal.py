"""The strategy that works in modes: everything is linear but the joints.

With all joints closed the structure is linear and, under Rayleigh damping on its mass and closed
stiffness, falls into independent modes. In their coordinates η, all of which are kept, a step is

    w = H (r + Bᵀ λ),    z = B H r + F λ,

with H diagonal, B = G Φ the modes' openings at the joint points, F = B H Bᵀ their compliance over
one step, and λ the tension taken out of open joints, so a step costs one product with B and a small
dense problem in the open points alone. The idea is Wilson's fast nonlinear analysis
(Three-dimensional static and dynamic analysis of structures, 2002, chapter 18), here without
truncation: the history is that of the equilibrium solves, to rounding.
"""

from functools import cached_property
from typing import ClassVar, NamedTuple, Self

import numba
import numpy as np
from numba.extending import overload
from scipy.linalg import eigh

from archfem.arrays import Array
from archfem.dynamics.stepping import passing  # noqa: F401  (steps of the conserving scheme)
from archfem.dynamics.stepping.compliance import Compliance
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.linear import Linear, gaps_of, solve
from archfem.dynamics.stepping.loop import ITERATIONS
from archfem.dynamics.stepping.small_problem import (
    SETTLED,
    exact,
    expected,
    largest,
    release,
    shift,
)
from archfem.dynamics.stepping.sparse_rows import add_rows, times

LARGEST = 1200
"""Coordinates up to which all modes are computed and kept."""

CUBE = 0.5e-9
"""What the modes take to be found, for each coordinate cubed [s]."""


class ModalSystem(NamedTuple):
    """A structure in its modes.

    Attributes:
        linear: its matrices, diagonal or dense.
        gain: H (n,).
        compliance: F (p, p).
    """

    linear: Linear
    gain: Array
    compliance: Compliance


class Modal:
    """Steps in the modes of the closed structure.

    Args:
        equation: of motion.
    """

    name: ClassVar[str] = "contact"

    def __init__(self, equation: Equation) -> None:
        self._equation = equation

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the strategy, or None where modes are coupled by damping or are too many.

        Args:
            equation: of motion.
        """
        proportional = equation.damping is None or equation.damping.joints != "none"
        few = equation.model.size <= LARGEST
        return cls(equation) if equation.joints is not None and proportional and few else None

    @property
    def setup(self) -> float:
        """Estimate of the time until the first step can be taken [s]."""
        return CUBE * self._equation.model.size**3

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        """ω² (n,) [1/s²] and shapes of unit modal mass (n, n)."""
        model = self._equation.model
        squares, shapes = eigh(model.closed().toarray(), model.mass.toarray())
        return squares, shapes

    @cached_property
    def _back(self) -> Array:
        """From displacements to modes, M Φ (n, n)."""
        return np.asarray(self._equation.model.mass @ self._modes[1])

    def enter(self, vectors: Array) -> Array:
        """Return a state in modal coordinates (3, n).

        Args:
            vectors: q, velocity and acceleration (3, n).
        """
        return np.asarray(vectors @ self._back)

    def leave(self, vectors: Array) -> Array:
        """Return q, velocity and acceleration (3, n).

        Args:
            vectors: a state in modal coordinates (3, n).
        """
        return np.stack([self._modes[1] @ each for each in vectors])

    def system(self, dt: float) -> ModalSystem:
        """Return all that steps of this length need.

        Args:
            dt: time step [s].
        """
        equation, (squares, shapes) = self._equation, self._modes
        numbers, damping = equation.numbers(dt), equation.damping
        rate = damping.stiffness if damping and damping.joints == "initial" else 0.0
        rows = gaps_of(equation, dt)
        opening = np.ascontiguousarray(rows.gaps @ shapes)
        linear = Linear(
            np.ones_like(squares),
            squares,
            rate * squares if rate else np.empty(0),
            opening,
            np.ascontiguousarray(rows.shear @ shapes),
            shapes.T @ rows.weight,
            np.ascontiguousarray((shapes.T @ equation.model.body).T),
            numbers,
            rows.law,
        )
        gain = 1.0 / (squares * (1.0 + numbers.rate * rate) + numbers.inertia)
        compliance = (opening * gain) @ opening.T
        return ModalSystem(linear, gain, Compliance.of(np.ascontiguousarray(compliance)))


@overload(solve)
def _solve(system, vector, gap, before, force):  # type: ignore
    return _solved if getattr(system, "instance_class", None) is ModalSystem else None


def _solved(system, vector, gap, before, force):  # type: ignore
    """Solve a step: from its right side to the modes' contact, in place; leaves gaps and λ.

    Returns:
        Passes over the open points; -1 if they do not settle.
    """
    linear, law = system.linear, system.linear.law
    near = expected(law, gap, before, force)
    enough = SETTLED * largest(law, gap)
    before[:] = gap
    for k in range(len(vector)):
        vector[k] *= system.gain[k]
    start = np.empty(len(gap))
    times(linear.opening, vector, start)
    shift(law, start)
    gap[:] = start
    passes = 0
    for _ in range(ITERATIONS):
        passes += 1
        rows = np.flatnonzero(near)
        if len(rows) > 0:
            taken = release(law, start, rows, system.compliance, force, enough)
            if taken < 0:
                return -1
            passes += taken - 1
            gap[:] = start
            add_rows(system.compliance.whole, rows, force, gap)
        if exact(law, gap, force, near):
            _give(vector, linear.opening, force, system.gain)
            return passes
    return -1


@numba.njit(cache=True)
def _give(vector, opening, force, gain):  # type: ignore
    """Add what the tension taken out moves, H Bᵀ λ."""
    for row in range(len(force)):
        if force[row] != 0.0:
            for k in range(len(vector)):
                vector[k] += gain[k] * opening[row, k] * force[row]
