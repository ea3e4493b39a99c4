"""Why PETSc's solver ended, in our words."""

import pytest

PETSc = pytest.importorskip("petsc4py.PETSc")

from archfem.statics.snes import _FAILURE_MESSAGES  # noqa: E402


def test_reasons_are_those_of_petsc():
    """Its own names for the numbers that it gives; PETSc 3.25 renames that of a NaN."""
    known = PETSc.SNES.ConvergedReason
    nan = "DIVERGED_FNORM_NAN" if PETSc.Sys.getVersion() < (3, 25) else "DIVERGED_FUNCTION_NANORINF"
    assert {
        known.DIVERGED_LINEAR_SOLVE: "the tangent is singular",
        getattr(known, nan): "the residual is not a number",
        known.DIVERGED_MAX_IT: "too many iterations",
        known.DIVERGED_LINE_SEARCH: "the line search found no way down",
    } == _FAILURE_MESSAGES
