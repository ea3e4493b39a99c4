"""PETSc without its signal handlers, which turn Ctrl-C into an MPI abort."""

import ctypes
import sys
from contextlib import suppress

import petsc4py

if "petsc4py.PETSc" not in sys.modules:
    petsc4py.init(["archfem", "-no_signal_handler"])

from petsc4py import PETSc as PETSc

# MPI, which PETSc loads, makes the allocator of glibc keep all memory that was ever used. Large
# arrays go back to the system again: a third of the memory that a long run takes.
with suppress(OSError, AttributeError):  # another C library
    _mallopt = ctypes.CDLL(None).mallopt
    _mallopt(-4, 65536)  # M_MMAP_MAX, its default
    _mallopt(-3, 2**23)  # M_MMAP_THRESHOLD [bytes]
