"""Optional packages: which features require them, and the command that installs them.

FEniCSx has no wheels. What is large or seldom needed is an extra of archfem, as `archfem[film]`.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import CDLL
from importlib.util import find_spec
from typing import NamedTuple

from archfem.errors import NotInstalled, logger


class Requirement(NamedTuple):
    """A package that may be missing."""

    feature: str  # that requires it
    remedy: str  # how to install it


FENICSX_REMEDY = (
    "on Debian and Ubuntu 'apt-get install python3-dolfinx' and a virtual environment made by "
    "'/usr/bin/python3 -m venv --system-site-packages DIR', elsewhere 'conda install -c "
    "conda-forge fenics-dolfinx'"
)

OPTIONAL_PACKAGES = {
    "FEniCSx": Requirement(
        "meshes, and all models but those of fidelity = 'rigid' (--set model.fidelity=rigid),",
        FENICSX_REMEDY,
    ),
    "PETSc": Requirement("its solvers", "it comes with FEniCSx, " + FENICSX_REMEDY),
    "ObsPy": Requirement("records in miniSEED and SAC", "pip install 'archfem[seismology]'"),
    "python-docx": Requirement("reports for Word", "pip install 'archfem[word]'"),
    "pygmm": Requirement("ground-motion models", "pip install 'archfem[hazard]'"),
    "Clarabel": Requirement("bounds with a plastic fill", "pip install 'archfem[cones]'"),
    "Chromium": Requirement(
        "reports as PDF",
        "'apt-get install chromium', or install Google Chrome; or print the page in a browser",
    ),
    "EGL": Requirement(
        "pyvista's viewer of a run", "'apt-get install libegl1 libgl1', elsewhere Mesa's libEGL"
    ),
    "trame": Requirement("pyvista's HTML pages", "pip install 'archfem[notebooks]'"),
    "meshio": Requirement(
        "meshes of gmsh, and files other than .dxf and .vtu,", "pip install 'archfem[exchange]'"
    ),
    "imageio": Requirement("films", "pip install 'archfem[film]'"),
    "pyvista": Requirement("its viewer and its films", "pip install 'archfem[film]'"),
    "ifcopenshell": Requirement("IFC files", "pip install 'archfem[ifc]'"),
    "gmsh": Requirement(
        "meshes",
        "pip install 'archfem[mesh]'; where libGLU or another library is missing, 'apt-get install "
        "libglu1-mesa libgl1 libopengl0 libxcursor1 libxft2 libxinerama1 libxrender1 "
        "libfontconfig1'",
    ),
}

# VTK draws without a screen by the first of these libraries that it finds.
OFFSCREEN_LIBRARIES = ("libEGL.so.1", "libOSMesa.so.8", "libOSMesa.so.6")


@contextmanager
def require_package(name: str) -> Iterator[None]:
    """Turn a failed import into an error that names the feature and the remedy."""
    try:
        yield
    except Exception as error:  # another NumPy or a missing library raises errors of many classes
        raise NotInstalled(missing_package_message(name, str(error))) from error


def missing_package_message(name: str, reason: str) -> str:
    """Return the message of a package that cannot be loaded."""
    package = OPTIONAL_PACKAGES[name]
    return (
        f"{name} cannot be loaded by {sys.executable} ({reason}); {package.feature} need it: "
        f"{package.remedy}"
    )


def can_film() -> bool:
    """Return whether films can be written; warn where they cannot."""
    if find_spec("imageio") is not None:
        return True
    message = missing_package_message("imageio", "no film is written")
    logger.warning(message)
    return False


def check_drawing() -> None:
    """Refuse to open a viewer where VTK finds no library for it, which would end the process."""
    if not can_draw():
        names = ", ".join(OFFSCREEN_LIBRARIES)
        raise NotInstalled(missing_package_message("EGL", f"none of {names} is there"))


def can_draw() -> bool:
    """Return whether VTK finds a library to draw with."""
    if sys.platform != "linux":
        return True
    screen = ("libGL.so.1",) if os.environ.get("DISPLAY") else ()
    return any(map(_is_loadable, (*OFFSCREEN_LIBRARIES, *screen)))


def _is_loadable(library: str) -> bool:
    """Return whether a shared library can be loaded with all its dependencies."""
    try:
        CDLL(library)
    except OSError:
        return False
    return True
