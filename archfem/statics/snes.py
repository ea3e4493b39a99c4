"""Newton's method by PETSc SNES, with all its options."""

from collections.abc import Callable, Mapping
from itertools import count
from typing import Any

import numpy as np
from scipy import sparse

from archfem._petsc import PETSc
from archfem.arrays import Array
from archfem.statics.attempts import (
    NO_NUMBER,
    NO_WAY_DOWN,
    SINGULAR,
    TOO_MANY,
    Attempt,
    Equations,
)

_REASONS = {-3: SINGULAR, -4: NO_NUMBER, -5: TOO_MANY, -6: NO_WAY_DOWN}
_prefixes = (f"archfem_{number}_" for number in count())


class Snes:
    """Newton's method by PETSc SNES.

    Args:
        size: number of coordinates.
        options: of PETSc, without a prefix.
    """

    def __init__(self, size: int, options: Mapping[str, str]) -> None:
        self._options = options
        self._matrix: PETSc.Mat | None = None
        self._loaded: sparse.csr_matrix | None = None
        self._equations: Equations | None = None
        self._raised: BaseException | None = None
        self._solution = PETSc.Vec().createSeq(size)
        self._rest = PETSc.Vec().createSeq(size)
        self._searches: dict[str, PETSc.SNES] = {}

    def attempt(self, equations: Equations, start: Array, search: str, most: int) -> Attempt:
        """Look for a solution.

        Args:
            equations: whose tangents all have one sparsity pattern.
            start: first guess (n,).
            search: along each step, by PETSc's name.
            most: iterations it may take.

        Returns:
            What came of it.

        Raises:
            Error: of PETSc; errors of the equations are raised as they are.
        """
        self._equations = equations
        if self._matrix is None:
            first = self._loaded = equations.tangent(start)
            self._matrix = PETSc.Mat().createAIJ(
                first.shape, csr=(first.indptr, first.indices, first.data)
            )
        if search not in self._searches:
            self._searches[search] = self._new(search, most)
        snes = self._searches[search]
        self._solution.array[:] = start
        self._raised = None
        try:
            snes.solve(None, self._solution)
        except PETSc.Error:
            if self._raised is not None:  # newer versions put their own error in its place
                raise self._raised from None
            raise
        reason, rest = int(snes.getConvergedReason()), snes.getFunctionNorm()
        failure = "" if reason > 0 else _REASONS.get(reason, f"SNES reason {reason}")
        # SNES may report success after a line search broke down at the start: look again.
        if not failure and not self._fits(rest):
            failure = NO_WAY_DOWN
        return Attempt(self._solution.array.copy(), snes.getIterationNumber(), rest, failure)

    def _new(self, search: str, most: int) -> PETSc.SNES:
        snes = PETSc.SNES().create(PETSc.COMM_SELF)
        snes.setFunction(self._evaluate, self._rest)
        snes.setJacobian(self._load, self._matrix)
        snes.setConvergenceTest(self._judge)
        prefix = next(_prefixes)
        chosen = {
            "snes_linesearch_type": search,
            "snes_linesearch_max_it": "40",
            "snes_max_it": str(most),
            "ksp_type": "preonly",
            "pc_type": "lu",
            **self._options,
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
        result.array[:] = self._asked(self._equations.residual, q)  # type: ignore[union-attr]

    def _judge(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        reasons = PETSc.SNES.ConvergedReason
        if not np.isfinite(norms[2]):
            return int(reasons.DIVERGED_FNORM_NAN)
        return int(reasons.CONVERGED_FNORM_ABS if self._fits(norms[2]) else reasons.ITERATING)

    def _fits(self, rest: float) -> bool:
        assert self._equations is not None
        assert self._loaded is not None
        return self._equations.fits(rest, self._solution.array_r, self._loaded)

    def _load(self, snes: PETSc.SNES, q: PETSc.Vec, matrix: PETSc.Mat, _: PETSc.Mat) -> None:
        tangent = self._asked(self._equations.tangent, q)  # type: ignore[union-attr]
        if tangent is not self._loaded:
            matrix.setValuesCSR(tangent.indptr, tangent.indices, tangent.data)
            matrix.assemble()
            self._loaded = tangent

    def _asked(self, function: Callable[[Array], Any], q: PETSc.Vec) -> Any:
        """What a function says of a vector; an error of its own is kept."""
        try:
            return function(q.array_r)
        except BaseException as error:
            self._raised = error
            raise
