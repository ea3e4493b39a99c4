"""PETSc and SLEPc without PETSc's signal handlers, which turn Ctrl-C into an MPI abort."""

import sys
from typing import TYPE_CHECKING, Any

import petsc4py

if "petsc4py.PETSc" not in sys.modules:
    petsc4py.init(["archfem", "-no_signal_handler"])

from petsc4py import PETSc as PETSc

if TYPE_CHECKING:
    from slepc4py import SLEPc as SLEPc


def __getattr__(name: str) -> Any:
    """Load SLEPc at first use: only modes of vibration require it."""
    if name != "SLEPc":
        raise AttributeError(f"module '{__name__}' has no attribute {name!r}")
    import slepc4py

    if "slepc4py.SLEPc" not in sys.modules:
        slepc4py.init(["archfem", "-no_signal_handler"])
    from slepc4py import SLEPc

    return SLEPc
