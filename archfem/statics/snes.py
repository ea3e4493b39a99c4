"""Newton iterations by PETSc SNES, with any of its options."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import count
from typing import Any

import numpy as np
from scipy import sparse

from archfem._petsc import PETSc, list_option_names, was_option_read
from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.masonry.structure import suggest_name
from archfem.statics.newton_iteration import Attempt, Equations, Failure

# by SNES converged reason; numbers, since PETSc 3.25 renames that of a NaN
_NAN_REASON = -4
_FAILURE_MESSAGES = {
    -3: Failure.SINGULAR_TANGENT,
    _NAN_REASON: Failure.NOT_A_NUMBER,
    -5: Failure.TOO_MANY_ITERATIONS,
    -6: Failure.LINE_SEARCH_FAILED,
}
# Minimum degree takes half of the time of nested dissection, the default of PETSc.
LU = {"pc_type": "lu", "pc_factor_mat_ordering_type": "qmd"}

# PETSc's options are global: every solver has a prefix of its own
_prefixes = (f"archfem_{number}_" for number in count())


@contextmanager
def _set_options(prefix: str, options: Mapping[str, str | float]) -> Iterator[None]:
    """Set options with a prefix, and remove them again: the global table stays as it was."""
    table = PETSc.Options()
    for key, value in options.items():
        table.setValue(prefix + key, value)
    try:
        yield
    finally:
        for key in options:
            table.delValue(prefix + key)


class PetscNewton:
    """Newton's method by PETSc SNES; one SNES for each line search, one matrix for all."""

    def __init__(self, size: int, options: Mapping[str, str | float]) -> None:
        self._options = options
        self._unread = set(options)
        self._matrix: PETSc.Mat | None = None
        self._entries = np.empty(0)  # of the matrix, shared with PETSc
        self._loaded: sparse.csr_matrix | None = None
        self._equations: Equations | None = None
        self._raised: BaseException | None = None
        self._solution = PETSc.Vec().createSeq(size)
        self._residual = PETSc.Vec().createSeq(size)
        self._snes: dict[str, PETSc.SNES] = {}

    def attempt(
        self, equations: Equations, start: Array, search: str, max_iterations: int
    ) -> Attempt:
        """Iterate from a start with one line search."""
        self._equations = equations
        if self._matrix is None:
            self._create_matrix(equations.tangent(start))
        if search not in self._snes:
            self._snes[search] = self._create_snes(search, max_iterations)
        snes = self._snes[search]
        self._solution.array[:] = start
        self._raised = None
        prefix = snes.getOptionsPrefix()
        try:
            # some options are read in each solve, as of what is printed and of factors
            with _set_options(prefix, self._options):
                snes.solve(None, self._solution)
                self._record_read(prefix)
        except PETSc.Error:
            if self._raised is not None:  # newer versions replace it by their own error
                raise self._raised from None
            raise
        iterations = snes.getIterationNumber()
        if self._unread and iterations:
            self._refuse_unread()
        reason, norm = int(snes.getConvergedReason()), snes.getFunctionNorm()
        failure = "" if reason > 0 else _FAILURE_MESSAGES.get(reason, f"SNES reason {reason}")
        # SNES may report success after a line search broke down at the start: check again.
        if not failure and not self._is_converged(norm):
            failure = Failure.LINE_SEARCH_FAILED
        return Attempt(self._solution.array.copy(), iterations, norm, failure)

    def _create_matrix(self, tangent: sparse.csr_matrix) -> None:
        """Create the matrix, whose entries PETSc shares with an array."""
        self._loaded, self._entries = tangent, tangent.data.copy()
        csr = tangent.indptr, tangent.indices, self._entries
        self._matrix = PETSc.Mat().createAIJWithArrays(tangent.shape, csr, comm=PETSc.COMM_SELF)

    def _create_snes(self, search: str, max_iterations: int) -> PETSc.SNES:
        snes = PETSc.SNES().create(PETSc.COMM_SELF)
        snes.setFunction(self._evaluate, self._residual)
        snes.setJacobian(self._load_tangent, self._matrix)
        snes.setConvergenceTest(self._test_convergence)
        prefix = next(_prefixes)
        settings = {"snes_linesearch_type": search, "snes_linesearch_max_it": "40"}
        settings |= {"snes_max_it": str(max_iterations), "ksp_type": "preonly"}
        factors = {} if "pc_type" in self._options else LU
        snes.setOptionsPrefix(prefix)
        with _set_options(prefix, {**settings, **factors, **self._options}):
            snes.setFromOptions()
            self._record_read(prefix)
        return snes

    def _record_read(self, prefix: str) -> None:
        """Record which options of the user PETSc has read."""
        self._unread = {key for key in self._unread if not was_option_read(prefix + key)}

    def _refuse_unread(self) -> None:
        """Refuse options that no line search reads either."""
        for search in {"basic", "cp", "bt"} - {*self._snes}:
            self._create_snes(search, 1).destroy()
        if not self._unread:
            return
        known = list_option_names()
        hints = [
            f"'{key}' is of a solver that is not selected"
            if key in known
            else f"'{key}' is not known, {suggest_name(key, known) or 'and no name is like it'}"
            for key in sorted(self._unread)
        ]
        raise InvalidInput(f"options petsc that PETSc does not read: {'; '.join(hints)}")

    def _evaluate(self, snes: PETSc.SNES, q: PETSc.Vec, result: PETSc.Vec) -> None:
        result.array[:] = self._call(self._equations.residual, q)  # type: ignore[union-attr]

    def _test_convergence(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, ...]) -> int:
        reasons = PETSc.SNES.ConvergedReason
        if not np.isfinite(norms[2]):
            return _NAN_REASON
        converged = self._is_converged(norms[2])
        return int(reasons.CONVERGED_FNORM_ABS if converged else reasons.ITERATING)

    def _is_converged(self, norm: float) -> bool:
        assert self._equations is not None
        assert self._loaded is not None
        return self._equations.is_converged(norm, self._solution.array_r, self._loaded)

    def _load_tangent(
        self, snes: PETSc.SNES, q: PETSc.Vec, matrix: PETSc.Mat, _: PETSc.Mat
    ) -> None:
        tangent = self._call(self._equations.tangent, q)  # type: ignore[union-attr]
        # the same object as before needs no new factor
        if tangent is not self._loaded:
            self._entries[:] = tangent.data
            matrix.assemble()
            matrix.stateIncrease()  # so that a new factor is computed
            self._loaded = tangent

    def _call(self, function: Callable[[Array], Any], q: PETSc.Vec) -> Any:
        """Evaluate a function at a vector; store an exception for `attempt` to raise."""
        try:
            return function(q.array_r)
        except BaseException as error:
            self._raised = error
            raise
