"""What a strategy of time stepping has to provide, and what most of them have in common."""

from typing import Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.dynamics.stepping.equation import Equation


class Strategy(Protocol):
    """A way to take steps in the compiled loop; what it gives is the history of `exact`.

    A further one provides this class, and for the type of its systems overloads (by
    `numba.extending.overload`) of the three functions that the loop calls: `begin` says what is
    carried from step to step, `settle` finds the state after a step, `measure` its resultants and
    energies. Nothing is presupposed of them: gaps need not be linear in the coordinates, and
    joints may have memory, in an array of the system that `settle` writes. A step that `settle`
    gives up must leave that memory as it was, since SNES takes the step instead; what the joints
    remember is told after each step, so that a run can go on from any. Where all is linear but the
    joints, overload `linear.solve` alone and give the system a field `linear`. To be chosen by "auto" it is listed in `choice.STRATEGIES`.

    Attributes:
        name: as users give it.
    """

    name: ClassVar[str]

    @property
    def setup(self) -> float:
        """Estimate of the time until the first step can be taken [s]."""

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the strategy for an equation of motion, or None where it does not apply.

        Args:
            equation: of motion.
        """

    def enter(self, vectors: Array) -> Array:
        """Return a state in the strategy's own terms (3, …).

        Args:
            vectors: q, velocity and acceleration (3, n).
        """

    def leave(self, vectors: Array) -> Array:
        """Return q, velocity and acceleration (3, n).

        Args:
            vectors: a state in the strategy's own terms (3, …).
        """

    def system(self, dt: float) -> NamedTuple:
        """Return all that steps of this length need, for the compiled loop.

        Args:
            dt: time step [s].
        """


class Reordered:
    """Coordinates in an order that suits the factor of a strategy.

    Args:
        order: numbers of the coordinates, the first one first (n,).
    """

    def __init__(self, order: NDArray[Any]) -> None:
        self.order = order
        self._place = np.argsort(order)

    def enter(self, vectors: Array) -> Array:
        """Return a state in order (3, n).

        Args:
            vectors: q, velocity and acceleration (3, n).
        """
        return vectors[:, self.order]

    def leave(self, vectors: Array) -> Array:
        """Return q, velocity and acceleration (3, n).

        Args:
            vectors: a state in order (3, n).
        """
        return vectors[:, self._place]
