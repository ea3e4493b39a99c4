"""Why PETSc's solver ended, in our words."""

import pytest

PETSc = pytest.importorskip("petsc4py.PETSc")

from archfem.statics.attempts import NO_NUMBER, NO_WAY_DOWN, SINGULAR, TOO_MANY  # noqa: E402
from archfem.statics.snes import _REASONS  # noqa: E402


def test_reasons_are_those_of_petsc():
    """Its own names for the numbers that it gives."""
    known = PETSc.SNES.ConvergedReason
    assert _REASONS == {
        known.DIVERGED_LINEAR_SOLVE: SINGULAR,
        known.DIVERGED_FNORM_NAN: NO_NUMBER,
        known.DIVERGED_MAX_IT: TOO_MANY,
        known.DIVERGED_LINE_SEARCH: NO_WAY_DOWN,
    }
