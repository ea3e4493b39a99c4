"""Packages that not every machine has: what needs them, and the command that brings them.

Everything that archfem needs comes with `pip install archfem`, but FEniCSx: that has no wheels.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import CDLL
from typing import NamedTuple

from archfem.errors import NotInstalled

FENICSX = ("dolfinx", "petsc4py", "slepc4py", "mpi4py")
"""The packages that are FEniCSx and what it stands on."""


class Need(NamedTuple):
    """A package, or several that come together.

    Attributes:
        what: is done by it.
        get: how it is had.
    """

    what: str
    get: str


FROM = (
    "on Debian and Ubuntu 'apt-get install python3-dolfinx' and a virtual environment made by "
    "'/usr/bin/python3 -m venv --system-site-packages DIR', elsewhere 'conda install -c "
    "conda-forge fenics-dolfinx slepc4py'"
)
"""How FEniCSx is had."""

NEEDS = {
    "FEniCSx": Need(
        "meshes, and all models but those of fidelity = 'rigid' (--set model.fidelity=rigid),",
        FROM,
    ),
    "PETSc": Need("its solvers", "it comes with FEniCSx, " + FROM),
    "SLEPc": Need("modes of large models", "it comes with FEniCSx, " + FROM),
    "EGL": Need(
        "pyvista's viewer of a run", "'apt-get install libegl1 libgl1', elsewhere Mesa's libEGL"
    ),
    "gmsh": Need(
        "meshes",
        "'pip install gmsh'; where libGLU or another library is what it lacks, 'apt-get install "
        "libglu1-mesa libgl1 libopengl0 libxcursor1 libxft2 libxinerama1 libxrender1 "
        "libfontconfig1'",
    ),
}
"""What may be missing, by name."""

DISPLAYS = ("libEGL.so.1", "libOSMesa.so.8", "libOSMesa.so.6")
"""Libraries of which VTK takes the first that is there, to draw without a screen."""


@contextmanager
def needed(name: str) -> Iterator[None]:
    """Let imports that fail say what they are for, and how the package is had.

    Args:
        name: of the package, in `NEEDS`.

    Yields:
        Nothing.

    Raises:
        NotInstalled: the package is not there, or a library that it needs.
    """
    try:
        yield
    except Exception as error:  # a NumPy it was not built for, a library it lacks: all fail apart
        raise NotInstalled(lacking(name, str(error))) from error


def lacking(name: str, why: str) -> str:
    """Return what to say of a package that is not there.

    Args:
        name: of the package, in `NEEDS`.
        why: it is missed.
    """
    need = NEEDS[name]
    return f"{name} cannot be loaded by {sys.executable} ({why}); {need.what} need it: {need.get}"


def check_drawing() -> None:
    """Refuse to open a viewer where VTK finds no library for it, which would end the process.

    Raises:
        NotInstalled: there is none.
    """
    if not can_draw():
        raise NotInstalled(lacking("EGL", f"none of {', '.join(DISPLAYS)} is there"))


def can_draw() -> bool:
    """Return whether VTK finds a library to draw with; without one it ends the process."""
    if sys.platform != "linux":
        return True
    screen = ("libGL.so.1",) if os.environ.get("DISPLAY") else ()
    return any(map(_loads, (*DISPLAYS, *screen)))


def _loads(library: str) -> bool:
    """Whether a library is there, with all that it needs itself."""
    try:
        CDLL(library)
    except OSError:
        return False
    return True
