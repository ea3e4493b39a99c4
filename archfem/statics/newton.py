"""One equilibrium solve: through PETSc SNES, or where that is not installed or not worth it SciPy.

The joint law makes internal forces the gradient of a convex energy, so Newton's full step finds
the equilibrium in a few iterations from any closed start. Where statuses cycle near collapse, a
search along the step for the point where the energy's slope vanishes ("cp") settles them. Joints
that slide have no such energy: there a step ends where the residual has fallen ("bt").
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.util import find_spec

import numpy as np
from scipy import sparse

from archfem.arguments import instance, real
from archfem.arrays import Array
from archfem.errors import DidNotConverge, InvalidInput
from archfem.packages import needed
from archfem.statics.attempts import Engine, Equations, Residual, Tangent
from archfem.statics.superlu import SuperLU

ROUGHLY = 1e-7
"""Residual, relative to the load, above which round-off is no excuse."""

SMALL = 300
"""Coordinates up to which SciPy takes about as long as PETSc, 5 to 9 ms a dead load."""

HOLLOW = 1e-3
"""Rounding of forces, relative to the load, that must not be taken for equilibrium. Of stones that
are displaced by a metre it is below 1e-5."""

SEARCHES = {"basic": 12, "cp": 60, "bt": 60}
"""Line searches, and the iterations each may take; more than a dozen full steps are a cycle of
statuses."""

CONVEX, SLIDING = ("basic", "cp"), ("basic", "bt")
"""Searches in the order tried: along an energy, and down the residual where joints slide."""

SYMMETRIC = {"pc_type": ("cholesky", "icc"), "ksp_type": ("cg", "minres", "symmlq")}
"""Methods that take a matrix for symmetric, by the options of PETSc that choose them."""

ASYMMETRY = 1e-9
"""Difference of a matrix and its transpose, relative to its largest entry, that is round-off."""


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

    Args:
        size: number of coordinates.
        settings: of the solves.
        sparing: whether full steps of what is small are left to SciPy, unless there are options
            for PETSc, which takes longer to load than a few solves take.

    Raises:
        NotInstalled: there are options for PETSc, which is not installed.
    """

    def __init__(self, size: int, settings: Newton | None = None, *, sparing: bool = False) -> None:
        self.settings = settings or Newton()
        self._size = size
        self._light = SuperLU() if sparing and size <= SMALL and not self.settings.petsc else None
        if self.settings.petsc:
            _ = self._engine  # which may not be there
        self._scale = 1.0
        self._stiffest = 0.0

    def solve(
        self,
        residual: Residual,
        tangent: Tangent,
        start: Array,
        scale: float,
        searches: Iterable[str] = CONVEX,
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
        self._scale = scale
        equations = Equations(residual, self._checked(tangent), self._fits)
        iterations = 0
        for search in searches:
            engine = self._light if self._light and search == "basic" else self._engine
            found = engine.attempt(equations, start, search, SEARCHES[search])
            iterations += found.iterations
            if not found.failure:
                return Solved(found.q, iterations, found.rest)
        failure = found.failure
        if found.rest <= self.settings.tolerance * scale:
            failure = f"nothing but rounding holds it, displaced by {abs(found.q).max():.1e}"
        raise DidNotConverge(
            f"no equilibrium after {iterations} iterations: {failure}, residual "
            f"{found.rest:.2e} against a load of {scale:.2e}"
        )

    @cached_property
    def _engine(self) -> Engine:
        """What solves, loaded when it is first needed: PETSc takes a while, and begins MPI."""
        if find_spec("petsc4py") is None and not self.settings.petsc:
            return SuperLU()
        with needed("PETSc"):
            from archfem.statics.snes import Snes
        return Snes(self._size, self.settings.petsc)

    def _fits(self, rest: float, q: Array, tangent: sparse.csr_matrix) -> bool:
        """Return whether a residual is within the tolerance, or nothing but round-off.

        Large rigid motions of stiff blocks leave a residual of the order of the rounding of
        tangent times displacement, below which no iteration can go. Where that is of the order of
        the load, a block has gone so far that what is left of its stiffness by rounding holds it.
        """
        if 8.0 * np.finfo(float).eps * self._stiffest * abs(q).max() > HOLLOW * self._scale:
            return False
        if rest <= self.settings.tolerance * self._scale:
            return True
        if rest > ROUGHLY * self._scale:
            return False
        rounding = np.linalg.norm(abs(tangent) @ abs(q))
        return bool(rest <= 8.0 * np.finfo(float).eps * rounding)

    def _checked(self, tangent: Tangent) -> Tangent:
        """Note the stiffness of the first tangent; refuse methods for symmetric ones elsewhere."""
        # the first is that of the start; later ones may be of iterates that went anywhere
        chosen = self.settings.petsc
        asked = {key: chosen[key] for key, each in SYMMETRIC.items() if chosen.get(key) in each}
        noted = False

        def checked(q: Array) -> sparse.csr_matrix:
            nonlocal noted
            matrix = tangent(q)
            if not noted:
                self._stiffest = max(self._stiffest, float(abs(matrix.data).max(initial=0.0)))
                noted = True
            if asked and abs(matrix - matrix.T).max() > ASYMMETRY * abs(matrix).max():
                raise InvalidInput(
                    f"petsc = {asked} is for symmetric matrices, and where joints slide the "
                    "tangent is not: leave it out, and each tangent is factorised by LU"
                )
            return matrix

        return checked


def magnitude(load: Array) -> float:
    """Return the size of a load: the sum of absolute components, the same on any mesh.

    Args:
        load: generalised forces (n,).
    """
    return float(np.sum(np.abs(load)))
