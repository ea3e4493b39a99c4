"""Newton's method for one equilibrium, by PETSc SNES or by SciPy, with fall-back line searches.

The joint law makes internal forces the gradient of a convex energy, so full Newton steps converge
in a few iterations from any closed start. Where statuses of joints cycle near collapse, a search
along the step for the point where the energy's slope vanishes ("cp") settles them. Joints that
slide have no such energy: there the step is shortened until the residual falls ("bt").
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from archfem._optional import require_package
from archfem._typing import Array
from archfem._validation import check_between, check_fields, check_type
from archfem.errors import DidNotConverge, InvalidInput
from archfem.statics.newton_iteration import Equations, Residual, ScipyNewton, Tangent

if TYPE_CHECKING:
    from archfem.statics.snes import PetscNewton

# Residual, relative to the load, above which it cannot be round-off [-]
MAX_ROUND_OFF_RESIDUAL = 1e-7

# Coordinates up to which SciPy takes about as long as PETSc, 5 to 9 ms a dead load
MAX_SCIPY_UNKNOWNS = 300

# Options that PETSc reads, of a test of convergence that is not used
UNUSED_TESTS = {
    *("snes_rtol", "snes_atol", "snes_stol", "snes_divergence_tolerance"),
    "snes_convergence_test",
}

# Line searches in the order tried along an energy
CONVEX_SEARCHES = ("basic", "cp")


@dataclass(frozen=True, kw_only=True)
class Newton:
    """Settings of an equilibrium solve.

    Attributes:
        tolerance: largest residual, relative to the load [-].
        petsc: further options for PETSc, without a prefix, e.g. {"snes_monitor": ""}. The first
            solve refuses options that PETSc does not read, and methods for symmetric matrices where
            joints slide, since tangents then are not.
    """

    tolerance: float = 1e-10
    petsc: Mapping[str, str | float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse tolerances that no solve could reach, and options without names."""
        check_between(self.tolerance, "tolerance of a solve [-]", 0.0, 1.0)
        check_type(self.petsc, Mapping, "petsc", 'give a dictionary, e.g. {"snes_monitor": ""}')
        check_fields(self)
        if unused := UNUSED_TESTS & {*self.petsc}:
            raise InvalidInput(
                f"petsc = {sorted(unused)} has no effect: solves converge by the residual over the "
                f"load; give Newton(tolerance={self.tolerance:g}) another value instead"
            )


@dataclass(frozen=True)
class Solution:
    """A converged solve."""

    q: Array  # coordinates (n,)
    iterations: int  # of Newton's method, including failed attempts
    residual: float  # Euclidean norm


class EquilibriumSolver:
    """Solves residual(q) = 0 repeatedly, with tangents of one sparsity pattern."""

    def __init__(
        self, size: int, settings: Newton | None = None, *, prefer_scipy: bool = False
    ) -> None:
        self.settings = settings or Newton()
        self._size = size
        is_small = size <= MAX_SCIPY_UNKNOWNS and not self.settings.petsc
        self._scipy_engine = ScipyNewton() if prefer_scipy and is_small else None
        if self.settings.petsc:
            _ = self._engine  # raises at once where PETSc is missing
        self._scale = 1.0
        self._stiffest = 0.0

    def solve(
        self,
        residual: Residual,
        tangent: Tangent,
        start: Array,
        scale: float,
        searches: Iterable[str] = CONVEX_SEARCHES,
    ) -> Solution:
        """Find q with ‖residual(q)‖ ≤ tolerance × scale, in the Euclidean norm."""
        self._scale = scale
        equations = Equations(residual, self._check_tangents(tangent), self._is_converged)
        iterations = 0
        for search in searches:
            engine = (self._scipy_engine if search == "basic" else None) or self._engine
            # more than a dozen full steps are a cycle of joint statuses
            attempt = engine.attempt(equations, start, search, 12 if search == "basic" else 60)
            iterations += attempt.iterations
            if not attempt.failure:
                return Solution(attempt.q, iterations, attempt.residual)
        failure = attempt.failure
        if attempt.residual <= self.settings.tolerance * scale:
            failure = f"nothing but rounding holds it, displaced by {abs(attempt.q).max():.1e}"
        raise DidNotConverge(
            f"no equilibrium after {iterations} iterations: {failure}, residual "
            f"{attempt.residual:.2e} against a load of {scale:.2e}"
        )

    @cached_property
    def _engine(self) -> "ScipyNewton | PetscNewton":
        """Engine for large systems, loaded when it is first needed: PETSc is slow to initialise."""
        if find_spec("petsc4py") is None and not self.settings.petsc:
            return ScipyNewton()
        with require_package("PETSc"):
            from archfem.statics.snes import PetscNewton
        return PetscNewton(self._size, self.settings.petsc)

    def _is_converged(self, residual: float, q: Array, tangent: sparse.csr_matrix) -> bool:
        """Return whether a residual is within the tolerance, or nothing but round-off."""
        # Large rigid motions of stiff blocks cause a residual of the order of the rounding of
        # tangent times displacement, below which no iteration can go. Where that is of the order
        # of the load, a block has moved so far that only rounding holds it: no equilibrium. For
        # stones displaced by a metre the ratio is below 1e-5.
        rounding_unit = 8.0 * np.finfo(float).eps
        if rounding_unit * self._stiffest * abs(q).max() > 1e-3 * self._scale:
            return False
        if residual <= self.settings.tolerance * self._scale:
            return True
        if residual > MAX_ROUND_OFF_RESIDUAL * self._scale:
            return False
        return bool(residual <= rounding_unit * np.linalg.norm(abs(tangent) @ abs(q)))

    def _check_tangents(self, tangent: Tangent) -> Tangent:
        """Wrap a tangent: record its largest entry, refuse symmetric solvers if unsymmetric."""
        # Only the tangent at the start counts: later iterates may be anywhere.
        symmetric = {"pc_type": ("cholesky", "icc"), "ksp_type": ("cg", "minres", "symmlq")}
        petsc = self.settings.petsc
        chosen = {key: petsc[key] for key, names in symmetric.items() if petsc.get(key) in names}
        is_first = True

        def check(q: Array) -> sparse.csr_matrix:
            nonlocal is_first
            matrix = tangent(q)
            if is_first:
                self._stiffest = max(self._stiffest, float(abs(matrix.data).max(initial=0.0)))
                is_first = False
            # asymmetry of less than 1e-9 of the largest entry is round-off
            if chosen and abs(matrix - matrix.T).max() > 1e-9 * abs(matrix).max():
                raise InvalidInput(
                    f"petsc = {chosen} is for symmetric matrices, and where joints slide the "
                    "tangent is not: leave it out, and each tangent is factorised by LU"
                )
            return matrix

        return check


def load_magnitude(load: Array) -> float:
    """Return the size of a load: the sum of absolute components, the same on any mesh."""
    return float(np.sum(np.abs(load)))
