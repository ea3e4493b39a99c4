"""What a strategy of time stepping has to provide, and what most of them have in common."""

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem.arrays import Array
from archfem.dynamics.stepping.equation import Equation

ROUND_OFF = 1e-8
"""Of two ways to the same readings, relative to the largest: entering and leaving modes."""


class Strategy(Protocol):
    """A way to take steps in the compiled loop; what it gives is the history of `exact`.

    A further one provides this class, and for the type of its systems overloads (by
    `numba.extending.overload`) of the three functions that the loop calls: `begin` says what is
    carried from step to step, `settle` finds the state after a step, `measure` its resultants and
    energies. Nothing is presupposed of them: gaps need not be linear in the coordinates, and
    joints may have memory. `begin` is given what they remember, `measure` tells what they do after
    each step, so that a run can go on from any, and SNES can take a step that `settle` gives up.
    Where all is linear but the joints, overload `linear.solve` alone and give the system a field
    `linear`. To be chosen by "auto" it is listed in `choice.STRATEGIES`.

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


def in_own_terms(
    strategy: Strategy, matrix: sparse.csr_matrix, mass: sparse.csr_matrix
) -> sparse.csr_matrix | Array:
    """Return a linear map of displacements as one of displacements in a strategy's own terms.

    With q = L η that is D L. Of reordered coordinates it is D with its columns in their order; of
    modes, for which Lᵀ M L = 1 and so entering is η = Lᵀ M q, it is what D M⁻¹ becomes when
    entered. Where neither holds, L is found vector by vector.

    Args:
        strategy: whose terms they are.
        matrix: D (r, n).
        mass: M (n, n).

    Returns:
        D L (r, m).
    """
    if isinstance(strategy, Reordered):
        return matrix[:, strategy.order]
    found = _in_threes(strategy.enter, splu(mass.tocsc()).solve(matrix.T.toarray()).T)
    probe = np.cos(np.arange(found.shape[-1]))
    expected = matrix @ _in_threes(strategy.leave, probe[None])[0]
    if np.allclose(found @ probe, expected, rtol=0.0, atol=ROUND_OFF * np.abs(expected).max()):
        return found
    return np.asarray(matrix @ _in_threes(strategy.leave, np.eye(len(probe))).T)


def _in_threes(way: Callable[[Array], Array], vectors: Array) -> Array:
    """Enter or leave with any number of vectors (k, …), which go three at a time as states do."""
    missing = -len(vectors) % 3
    filled = np.concatenate([vectors, np.zeros((missing, *vectors.shape[1:]))])
    found = [way(filled[first : first + 3]) for first in range(0, len(filled), 3)]
    return np.concatenate(found)[: len(vectors)]


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

    def left(self, displacements: Array) -> Array:
        """Return displacements as the model orders them (steps, n).

        Args:
            displacements: in order (steps, n).
        """
        return displacements[:, self._place]
