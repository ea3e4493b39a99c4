"""Why PETSc's solver ended, in archfem's words; and the effects of loading PETSc."""

from pathlib import Path

import numpy as np
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


def test_memory_that_is_freed_goes_back_to_the_system():
    """MPI, which PETSc loads, lets the process keep it: RSS stayed at its largest value."""

    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

    before = resident()
    values = np.ones(10_000_000)
    assert resident() > before + 70e6
    del values
    assert resident() < before + 10e6
