"""Why PETSc's solver ended, in our words."""

import pytest

PETSc = pytest.importorskip("petsc4py.PETSc")

from archfem.statics.newton_iteration import (  # noqa: E402
    LINE_SEARCH_FAILED,
    NOT_A_NUMBER,
    SINGULAR_TANGENT,
    TOO_MANY_ITERATIONS,
)
from archfem.statics.snes import _FAILURE_MESSAGES  # noqa: E402


def test_reasons_are_those_of_petsc():
    """Its own names for the numbers that it gives; PETSc 3.25 renames that of a NaN."""
    known = PETSc.SNES.ConvergedReason
    nan = "DIVERGED_FNORM_NAN" if PETSc.Sys.getVersion() < (3, 25) else "DIVERGED_FUNCTION_NANORINF"
    assert {
        known.DIVERGED_LINEAR_SOLVE: SINGULAR_TANGENT,
        getattr(known, nan): NOT_A_NUMBER,
        known.DIVERGED_MAX_IT: TOO_MANY_ITERATIONS,
        known.DIVERGED_LINE_SEARCH: LINE_SEARCH_FAILED,
    } == _FAILURE_MESSAGES
