"""One equilibrium solve through PETSc SNES.

The joint law makes internal forces the gradient of a convex energy, so Newton's full step finds
the equilibrium in a few iterations from any closed start. Where statuses cycle near collapse, a
search along the step for the point where the energy's slope vanishes ("cp") settles them.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import count

import numpy as np
from scipy import sparse

from archfem._petsc import PETSc
from archfem.arguments import instance, real
from archfem.arrays import Array
from archfem.errors import DidNotConverge, InvalidInput

Residual = Callable[[Array], Array]
Tangent = Callable[[Array], sparse.csr_matrix]

ROUGHLY = 1e-7
"""Residual, relative to the load, above which round-off is no excuse."""

SEARCHES = {"basic": 12, "cp": 60}
"""Line searches in the order tried, and the iterations each may take; more than a dozen full
steps are a cycle of statuses."""

SYMMETRIC = {"pc_type": ("cholesky", "icc"), "ksp_type": ("cg", "minres", "symmlq")}
"""Methods that take a matrix for symmetric, by the options of PETSc that choose them."""

ASYMMETRY = 1e-9
"""Difference of a matrix and its transpose, relative to its largest entry, that is round-off."""

_REASONS = {
    -3: "the tangent is singular",
    -4: "the residual is not a number",
    -5: "too many iterations",
    -6: "the line search found no way down",
}
_prefixes = (f"archfem_{number}_" for number in count())


@dataclass(frozen=True, kw_only=True)
class Newton:
    """Settings of an equilibrium solve.

    Attributes:
        tolerance: largest residual, relative to the load [-].
        petsc: further options for PETSc, without a prefix, e.g. {"snes_monitor": ""}. Methods for
            symmetric matrices are refused where joints slide, for tangents then are not.
    """

    tolerance: float = 1e-10
    petsc: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what no solve could reach, and options without names."""
        if not 0.0 < real(self.tolerance, "tolerance of a solve [-]") < 1.0:
            raise InvalidInput(f"tolerance {self.tolerance:g} of a solve is not between 0 and 1")
        instance(self.petsc, Mapping, "petsc", 'give a dictionary, e.g. {"snes_monitor": ""}')


@dataclass(frozen=True)
class Solved:
    """A converged solve.

    Attributes:
        q: coordinates (n,).
        iterations: of Newton's method, those of a failed first attempt included.
        residual: norm of what is left.
    """

    q: Array
    iterations: int
    residual: float


class Solver:
    """Solves residual(q) = 0 again and again with tangents of one sparsity pattern.

    A tangent that is the same object as the last one is not factorised again.
    """

    def __init__(self, size: int, settings: Newton | None = None) -> None:
        self.settings = settings or Newton()
        self._matrix: PETSc.Mat | None = None
        self._loaded: sparse.csr_matrix | None = None
        self._tangent: Tangent | None = None
        self._residual: Residual | None = None
        self._solution = PETSc.Vec().createSeq(size)
        self._rest = PETSc.Vec().createSeq(size)
        self._searches: dict[str, PETSc.SNES] = {}
        self._scale = 1.0

    def solve(
        self,
        residual: Residual,
        tangent: Tangent,
        start: Array,
        scale: float,
        searches: Iterable[str] = tuple(SEARCHES),
    ) -> Solved:
        """Find q with ‖residual(q)‖ ≤ tolerance × scale, in the Euclidean norm.

        Args:
            residual: forces out of balance at q (n,).
            tangent: derivative of the residual at q (n, n).
            start: first guess (n,).
            scale: size of the load, as by `magnitude`.
            searches: line searches to try, one after the other.

        Returns:
            Coordinates, and what it took to find them.

        Raises:
            DidNotConverge: neither a full step nor a line search led there.
        """
        self._residual, self._tangent = residual, tangent
        self._scale = scale
        iterations = 0
        for search in searches:
            snes = self._snes(search, start)
            self._solution.array[:] = start
            snes.solve(None, self._solution)
            iterations += snes.getIterationNumber()
            # SNES may report success after a line search broke down at the start: look again.
            if snes.getConvergedReason() > 0 and self._fits(snes.getFunctionNorm()):
                return Solved(self._solution.array.copy(), iterations, snes.getFunctionNorm())
        reason = int(snes.getConvergedReason())
        raise DidNotConverge(
            f"no equilibrium after {iterations} iterations: "
            f"{_REASONS.get(reason, f'SNES reason {reason}')}, residual "
            f"{snes.getFunctionNorm():.2e} against a load of {scale:.2e}"
        )

    def _snes(self, search: str, start: Array) -> PETSc.SNES:
        if self._matrix is None:
            first = self._tangent(start)  # type: ignore[misc]
            self._loaded = first
            self._matrix = PETSc.Mat().createAIJ(
                first.shape, csr=(first.indptr, first.indices, first.data)
            )
        if search not in self._searches:
            self._searches[search] = self._new(search)
        return self._searches[search]

    def _new(self, search: str) -> PETSc.SNES:
        snes = PETSc.SNES().create(PETSc.COMM_SELF)
        snes.setFunction(self._evaluate, self._rest)
        snes.setJacobian(self._load, self._matrix)
        snes.setConvergenceTest(self._judge)
        prefix = next(_prefixes)
        chosen = {
            "snes_linesearch_type": search,
            "snes_linesearch_max_it": "40",
            "snes_max_it": str(SEARCHES[search]),
            "ksp_type": "preonly",
            "pc_type": "lu",
            **self.settings.petsc,
        }
        options = PETSc.Options()
        for key, value in chosen.items():
            options.setValue(prefix + key, value)
        snes.setOptionsPrefix(prefix)
        snes.setFromOptions()
        for key in chosen:
            options.delValue(prefix + key)
        return snes

    def _evaluate(self, snes: PETSc.SNES, q: PETSc.Vec, result: PETSc.Vec) -> None:
        result.array[:] = self._residual(q.array_r)  # type: ignore[misc]

    def _judge(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        reasons = PETSc.SNES.ConvergedReason
        if not np.isfinite(norms[2]):
            return int(reasons.DIVERGED_FNORM_NAN)
        return int(reasons.CONVERGED_FNORM_ABS if self._fits(norms[2]) else reasons.ITERATING)

    def _fits(self, rest: float) -> bool:
        """Return whether a residual is within the tolerance, or nothing but round-off.

        Large rigid motions of stiff blocks leave a residual of the order of the rounding of
        tangent times displacement, below which no iteration can go.
        """
        if rest <= self.settings.tolerance * self._scale:
            return True
        if rest > ROUGHLY * self._scale:
            return False
        assert self._loaded is not None
        rounding = np.linalg.norm(abs(self._loaded) @ abs(self._solution.array_r))
        return bool(rest <= 8.0 * np.finfo(float).eps * rounding)

    def _load(self, snes: PETSc.SNES, q: PETSc.Vec, matrix: PETSc.Mat, _: PETSc.Mat) -> None:
        tangent = self._tangent(q.array_r)  # type: ignore[misc]
        self._check_symmetry(tangent)
        if tangent is not self._loaded:
            matrix.setValuesCSR(tangent.indptr, tangent.indices, tangent.data)
            matrix.assemble()
            self._loaded = tangent

    def _check_symmetry(self, tangent: sparse.csr_matrix) -> None:
        """Refuse methods for symmetric matrices where the tangent is not symmetric."""
        chosen = self.settings.petsc
        asked = {key: chosen[key] for key, each in SYMMETRIC.items() if chosen.get(key) in each}
        if asked and abs(tangent - tangent.T).max() > ASYMMETRY * abs(tangent).max():
            raise InvalidInput(
                f"petsc = {asked} is for symmetric matrices, and where joints slide the tangent is "
                "not: leave it out, and each tangent is factorised by LU"
            )


def magnitude(load: Array) -> float:
    """Return the size of a load: the sum of absolute components, the same on any mesh.

    Args:
        load: generalised forces (n,).
    """
    return float(np.sum(np.abs(load)))
