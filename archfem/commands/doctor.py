"""The command that looks at the installation: what is there, what is missing, how it is had."""

import argparse
import os
import re
import shutil
import sys
from collections.abc import Iterator
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from archfem import compiled, packages
from archfem.errors import NotInstalled

PIP = f"{sys.executable} -m pip install"

TRIED = {"numba": "numba", "gmsh": "gmsh", "matplotlib": "matplotlib.figure", "netCDF4": "netCDF4"}
"""Packages that are also loaded, since libraries of the system may be missing to them."""


class Finding(NamedTuple):
    """One line of what was looked at.

    Attributes:
        what: was looked at.
        state: what it is like.
        remedy: what to do about it; "" where all is well.
    """

    what: str
    state: str
    remedy: str = ""


def doctor(given: argparse.Namespace) -> None:
    """Print what is installed, what is missing, and the command that mends it.

    Args:
        given: nothing.

    Raises:
        NotInstalled: something is missing, or does not work.
    """
    found = list(findings())
    width = max(len(each.what) for each in found)
    for each in found:
        print(f"{each.what.ljust(width)}  {each.state}")
    ill = [each for each in found if each.remedy]
    for each in ill:
        print(f"\n{each.what}: {each.remedy}")
    if ill:
        raise NotInstalled(f"not all is well: {', '.join(each.what for each in ill)}")
    print("\nall is well")


def findings() -> Iterator[Finding]:
    """Look at the installation.

    Yields:
        What was found, line by line.
    """
    here = import_module("archfem")
    yield Finding("archfem", f"{here.__version__} in {Path(here.__file__ or '').parent}")
    yield Finding("Python", f"{sys.version.split()[0]}, {sys.executable}")
    yield from _required()
    yield from _fenicsx()
    yield _drawing()
    yield _ffmpeg()
    yield _compiled()
    if find_spec("distributed") is None:
        yield Finding("distributed", f"none; only clusters need it: {PIP} 'archfem[cluster]'")


def _required() -> Iterator[Finding]:
    """What pip installs with archfem."""
    try:
        asked = metadata.requires("archfem") or []
    except metadata.PackageNotFoundError:
        yield Finding("packages", "archfem itself is not installed", f"{PIP} archfem")
        return
    for line in asked:
        told = re.match(r"([\w.-]+)(?:\[.*\])?>=([\d.]+)$", line)
        if told is not None:  # else it is of an extra
            yield _package(*told.groups())


def _package(name: str, least: str) -> Finding:
    """A package of at least a version."""
    remedy = f"{PIP} '{name}>={least}'"
    try:
        version = metadata.version(name)
        if _numbers(version) < _numbers(least):
            return Finding(name, f"{version}, older than {least}", remedy)
        if name in TRIED:
            import_module(TRIED[name])
    except metadata.PackageNotFoundError:
        return Finding(name, "missing", remedy)
    except Exception as error:  # whatever a foreign package does when it cannot be loaded
        told = packages.NEEDS[name].get if name in packages.NEEDS else remedy
        return Finding(name, f"does not load: {error}", told)
    return Finding(name, version)


def _fenicsx() -> Iterator[Finding]:
    """FEniCSx, and what it needs to compile forms."""
    try:
        import_module("archfem.models.fem")
        import_module("archfem.statics.eigen")
    except ImportError as error:
        state = "missing" if find_spec("dolfinx") is None else f"does not load: {error.__cause__}"
        without = "; without it rigid stones can be stepped, and limit analysis done"
        yield Finding("FEniCSx", state, packages.NEEDS["FEniCSx"].get + without)
        return
    for name in packages.FENICSX:
        yield Finding(name, str(import_module(name).__version__))
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    get = "'apt-get install gcc libc6-dev', elsewhere 'conda install -c conda-forge c-compiler'"
    yield Finding("C compiler", compiler or "missing", "" if compiler else get)


def _drawing() -> Finding:
    """The library with which pyvista's viewer draws."""
    if packages.can_draw():
        return Finding("library of the viewer", "found")
    return Finding("library of the viewer", "missing", packages.NEEDS["EGL"].get)


def _ffmpeg() -> Finding:
    """The program that writes films."""
    try:
        return Finding("ffmpeg", import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except Exception as error:  # missing, or without its program
        return Finding("ffmpeg", str(error), f"{PIP} 'imageio[ffmpeg]'")


def _compiled() -> Finding:
    """What time steps need, compiled."""
    compiled.prepare()
    count, folders = compiled.count_kept(), compiled.kept_in()
    if not count:
        return Finding("compiled code", "none yet: the first run, or 'archfem compile', makes it")
    return Finding("compiled code", f"{count} functions in {', '.join(map(str, folders))}")


def _numbers(version: str) -> list[int]:
    """The numbers that a version begins with."""
    return [int(part) for part in re.findall(r"\d+", version)[:3]]
