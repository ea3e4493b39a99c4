"""What a solve of equations is asked, and what comes of an attempt, whoever makes it."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from scipy import sparse

from archfem.arrays import Array

Residual = Callable[[Array], Array]
Tangent = Callable[[Array], sparse.csr_matrix]


class Equations(NamedTuple):
    """Equations residual(q) = 0.

    Attributes:
        residual: forces out of balance at q (n,).
        tangent: its derivative at q (n, n).
        fits: whether the norm of a residual is small enough, at q and with a tangent near it.
    """

    residual: Residual
    tangent: Tangent
    fits: Callable[[float, Array, sparse.csr_matrix], bool]


class Attempt(NamedTuple):
    """What came of an attempt.

    Attributes:
        q: coordinates (n,).
        iterations: of Newton's method.
        rest: norm of the residual.
        failure: why it ended without a solution; "" where it has one.
    """

    q: Array
    iterations: int
    rest: float
    failure: str


SINGULAR = "the tangent is singular"
NO_NUMBER = "the residual is not a number"
TOO_MANY = "too many iterations"
NO_WAY_DOWN = "the line search found no way down"


class Engine(Protocol):
    """Newton's method, by one library or another."""

    def attempt(self, equations: Equations, start: Array, search: str, most: int) -> Attempt:
        """Look for a solution.

        Args:
            equations: whose tangents all have one sparsity pattern.
            start: first guess (n,).
            search: along each step: "basic" takes all of it, "cp" goes where the energy's slope
                along it vanishes, "bt" back to where the residual has fallen.
            most: iterations it may take.

        Returns:
            What came of it.
        """
        ...
