"""PETSc without its signal handlers, which turn Ctrl-C into an MPI abort."""

import ctypes
import re
import sys
from contextlib import suppress
from pathlib import Path

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


def was_option_read(name: str) -> bool:
    """Return whether an option that is set now, with its prefix, has been read by any object."""
    # petsc4py does not have this function; its module is linked to the library that does
    read = ctypes.c_int(0)
    ctypes.CDLL(PETSc.__file__).PetscOptionsUsed(None, name.encode(), ctypes.byref(read))
    return bool(read.value)


def list_option_names() -> set[str]:
    """Return the names of all options of nonlinear and linear solvers of the loaded PETSc."""
    # PETSc has no list of them, but its libraries contain each as text
    loaded = {line.split()[-1] for line in Path("/proc/self/maps").read_text().splitlines()}
    libraries = [Path(name) for name in loaded if "petsc" in Path(name).name.lower()]
    texts = [library.read_bytes() for library in libraries if library.is_file()]
    names = re.findall(rb"-((?:snes|ksp|pc|mat)_[a-z0-9_]+)\0", b"".join(texts))
    return {name.decode() for name in names}
