"""Newton's method on SciPy's sparse factors, for where PETSc is not installed."""

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.optimize import brentq
from scipy.sparse.linalg import splu

from archfem.arrays import Array
from archfem.statics.attempts import (
    NO_NUMBER,
    NO_WAY_DOWN,
    SINGULAR,
    TOO_MANY,
    Attempt,
    Equations,
    Residual,
)

DOUBLINGS = 20
"""Times that a step may be doubled before its energy must have a lowest point."""

NEARLY = 1e-10
"""Of a step, to which the place of that point is found."""

FALLS, HALVINGS = 1e-4, 40
"""Part by which a whole step has to lower the residual, and times that it may be halved."""


class SuperLU:
    """Newton's method, each tangent factorised by SuperLU."""

    def __init__(self) -> None:
        self._tangent: sparse.csr_matrix | None = None
        self._inverse: Callable[[Array], Array] | None = None

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
        q, number, failure = start, 0, ""
        tangent = equations.tangent(q) if self._tangent is None else self._tangent
        while True:
            rest = equations.residual(q)
            size = float(np.linalg.norm(rest))
            if not np.isfinite(size):
                failure = NO_NUMBER
            elif equations.fits(size, q, tangent):
                break
            elif number == most:
                failure = TOO_MANY
            else:
                tangent = equations.tangent(q)
                step, failure = self._step(equations.residual, tangent, q, rest, search)
            if failure:
                break
            q, number = q + step, number + 1
        return Attempt(q, number, size, failure)

    def _step(
        self, residual: Residual, tangent: sparse.csr_matrix, q: Array, rest: Array, search: str
    ) -> tuple[Array, str]:
        """The next step, and why there is none."""
        if tangent is not self._tangent or self._inverse is None:
            try:
                self._inverse = splu(tangent.tocsc()).solve
            except RuntimeError:  # SuperLU says that a pivot is zero
                return rest, SINGULAR
            self._tangent = tangent
        step = -self._inverse(rest)
        if not np.isfinite(step).all():
            return rest, SINGULAR
        if search == "basic":
            return step, ""
        if search == "bt":
            share = _falling(lambda along: float(np.linalg.norm(residual(q + along * step))))
        else:
            share = _lowest(lambda along: float(step @ residual(q + along * step)))
        return share * step, "" if share > 0.0 else NO_WAY_DOWN


def _lowest(slope: Callable[[float], float]) -> float:
    """Share of a step where a slope that grows along it vanishes; 0 where it vanishes nowhere."""
    if slope(0.0) >= 0.0:
        return 0.0
    share = 1.0
    for _ in range(DOUBLINGS):
        if slope(share) >= 0.0:
            return float(brentq(slope, 0.0, share, rtol=NEARLY))
        share *= 2.0
    return 0.0


def _falling(size: Callable[[float], float]) -> float:
    """Share of a step by which a residual falls, halved until it does; 0 where it never does."""
    whole, share = size(0.0), 1.0
    for _ in range(HALVINGS):
        if size(share) <= (1.0 - FALLS * share) * whole:
            return share
        share *= 0.5
    return 0.0
