"""Newton iterations on SciPy's sparse factors, and the equations of both Newton engines.

Small systems, and systems without PETSc, are solved here; `snes` solves the others. The line
searches are those of SNES: none ("basic"), for the point where the slope of the energy vanishes
("cp", critical point), and backtracking until the residual falls ("bt").
"""

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.optimize import brentq
from scipy.sparse.csgraph import structural_rank
from scipy.sparse.linalg import SuperLU, splu

from archfem._typing import Array

Residual = Callable[[Array], Array]
Tangent = Callable[[Array], sparse.csr_matrix]


class Failure(StrEnum):
    """Reasons why Newton's method ends without a solution."""

    SINGULAR_TANGENT = "the tangent is singular"
    NOT_A_NUMBER = "the residual is not a number"
    TOO_MANY_ITERATIONS = "too many iterations"
    LINE_SEARCH_FAILED = "the line search found no way down"


class Equations(NamedTuple):
    """Equations residual(q) = 0."""

    residual: Residual  # forces out of balance at q (n,)
    tangent: Tangent  # its derivative at q (n, n)
    # convergence test of a residual norm, at q and with a tangent near it
    is_converged: Callable[[float, Array, sparse.csr_matrix], bool]


class Attempt(NamedTuple):
    """Result of one attempt to solve the equations."""

    q: Array  # coordinates (n,)
    iterations: int  # of Newton's method
    residual: float  # Euclidean norm
    failure: str  # reason; "" where it has converged


def factorise(matrix: sparse.spmatrix) -> SuperLU:
    """Return the factors of a matrix; RuntimeError where it is singular, or not finite."""
    # SuperLU writes beyond its arrays where its columns leave no row for a pivot, as of a loose
    # block, or where entries are not finite: then it may end the process
    columns = matrix.tocsc()
    if not np.isfinite(columns.data).all() or structural_rank(columns) < columns.shape[0]:
        raise RuntimeError("rows or columns without entries of their own, or entries not finite")
    return splu(columns)


class ScipyNewton:
    """Newton's method, each tangent factorised by SuperLU."""

    def __init__(self) -> None:
        self._tangent: sparse.csr_matrix | None = None
        self._inverse: Callable[[Array], Array] | None = None

    def attempt(
        self, equations: Equations, start: Array, search: str, max_iterations: int
    ) -> Attempt:
        """Iterate from a start with one line search."""
        q, number, failure = start, 0, ""
        tangent = equations.tangent(q) if self._tangent is None else self._tangent
        while True:
            residual = equations.residual(q)
            norm = float(np.linalg.norm(residual))
            if not np.isfinite(norm):
                failure = Failure.NOT_A_NUMBER
            elif equations.is_converged(norm, q, tangent):
                break
            elif number == max_iterations:
                failure = Failure.TOO_MANY_ITERATIONS
            else:
                tangent = equations.tangent(q)
                step, failure = self._step(equations.residual, tangent, q, residual, search)
            if failure:
                break
            q, number = q + step, number + 1
        return Attempt(q, number, norm, failure)

    def _step(
        self, function: Residual, tangent: sparse.csr_matrix, q: Array, residual: Array, search: str
    ) -> tuple[Array, str]:
        """Return the next step, and the reason of a failure."""
        # a tangent that is the same object as the last one keeps its factor
        if tangent is not self._tangent or self._inverse is None:
            try:
                self._inverse = factorise(tangent).solve
            except RuntimeError:  # SuperLU: a pivot is zero
                return residual, Failure.SINGULAR_TANGENT
            self._tangent = tangent
        step = -self._inverse(residual)
        if not np.isfinite(step).all():
            return residual, Failure.SINGULAR_TANGENT
        if search == "basic":
            return step, ""
        if search == "bt":
            share = _backtrack(lambda along: float(np.linalg.norm(function(q + along * step))))
        else:
            share = _find_critical_point(lambda along: float(step @ function(q + along * step)))
        return share * step, "" if share > 0.0 else Failure.LINE_SEARCH_FAILED


def _find_critical_point(slope: Callable[[float], float], max_doublings: int = 20) -> float:
    """Return the share of a step where an increasing slope vanishes; 0 where it never does."""
    if slope(0.0) >= 0.0:
        return 0.0
    share = 1.0
    for _ in range(max_doublings):
        if slope(share) >= 0.0:
            return float(brentq(slope, 0.0, share, rtol=1e-10))
        share *= 2.0
    return 0.0


def _backtrack(
    norm: Callable[[float], float], decrease: float = 1e-4, max_halvings: int = 40
) -> float:
    """Halve a step until the residual falls (Armijo); return its share, 0 where it never does."""
    initial, share = norm(0.0), 1.0
    for _ in range(max_halvings):
        if norm(share) <= (1.0 - decrease * share) * initial:
            return share
        share *= 0.5
    return 0.0
