"""A plain run needs no call that Windows or macOS lacks, and none of the large packages."""

import errno
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

import archfem as af
from archfem import _files
from archfem.studies import process_pool

ROOT = Path(af.__file__).parents[1]

CASE = """
title = "a column"
[structure]
shape = "column"
breadth = 1.0
heights = [1.0, 1.0]
[model]
fidelity = "rigid"
displacements = "large"
[motion]
synthetic = { seed = 1, duration = 0.5, pga = 1.0 }
[analysis]
dt = "5 ms"
[output]
animation = true
"""

WITHOUT = """
import asyncio, os, signal, subprocess, sys  # these take sysconf, and msvcrt on Windows
from types import SimpleNamespace
for name in {missing}:
    sys.modules[name] = None
if "fcntl" in {missing}:
    sys.modules["msvcrt"] = SimpleNamespace(LK_NBLCK=2, locking=lambda *_: None)
    for name in ("fork", "getuid", "getpgid", "killpg", "sysconf"):
        delattr(os, name)
    del signal.SIGKILL, signal.SIGPIPE
import archfem
sys.exit(archfem.commands.main({words}))
"""

# how Matplotlib prints a figure is its own matter, and takes a quarter of a run
UNPRINTED = """
from matplotlib.figure import Figure
Figure.savefig = lambda figure, target, **given: target.touch()
"""

POSIX = ["fcntl", "resource", "pwd", "grp"]
LARGE = ["gmsh", "pyvista", "vtkmodules", "imageio", "imageio_ffmpeg", "dolfinx", "petsc4py"]
LARGE += ["mpi4py", "meshio", "distributed"]


def run_without(missing, *words, first=""):
    """Run a command in a process without some modules, and those of POSIX without its calls."""
    code = first + WITHOUT.format(missing=missing, words=list(map(str, words)))
    given = {"cwd": ROOT, "text": True, "capture_output": True, "check": False}
    return subprocess.run([sys.executable, "-c", code], **given)


@pytest.fixture(scope="module")
def carried_out(tmp_path_factory):
    """Folder and process of a run without calls of POSIX and without large packages."""
    folder = tmp_path_factory.mktemp("portable")
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    words = ("run", folder / "case.toml", "--out", folder / "out")
    return folder / "out", run_without(POSIX + LARGE, *words, first=UNPRINTED)


def test_a_run_needs_no_calls_of_posix_and_no_large_package(carried_out):
    folder, ran = carried_out
    assert ran.returncode == 0, ran.stderr
    assert "a column: stands" in ran.stdout
    assert {"history.nc", "dead.png", "summary.txt"} <= {path.name for path in folder.iterdir()}
    # the film is left out, which is said with the remedy
    assert "no film is written" in ran.stderr
    assert "pip install 'archfem[film]'" in ran.stderr
    assert not (folder / "hinges.mp4").exists()


def test_its_history_is_that_of_this_system(carried_out):
    run = af.History.read(carried_out[0] / "history.nc")
    case = af.Case.read(carried_out[0] / "case.toml")
    here = case.analysis.run(case.ground_motion())
    # its dead load is found by SciPy, and here by PETSc if that is there: to their tolerances
    expected = here.joints["N"].values
    assert abs(run.joints["N"].values - expected).max() < 1e-6 * abs(expected).max()


def test_a_history_is_read_where_the_size_of_the_memory_is_not_known(carried_out, monkeypatch):
    monkeypatch.delattr(os, "sysconf")
    assert af.History.read(carried_out[0] / "history.nc").time.size > 1


@pytest.mark.parametrize(
    ("missing", "words", "remedy"),
    [
        pytest.param(
            *(["imageio"], ("animate", "history.nc"), "pip install 'archfem[film]'"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(["pyvista"], ("animate", "history.nc", "--renderer", "pyvista"), "'archfem[film]'"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(["gmsh"], ("mesh", "case.toml", "--out", "a.msh"), "pip install 'archfem[mesh]'"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_a_missing_package_is_for_is_said_in_one_line(carried_out, missing, words, remedy):
    folder = carried_out[0]
    words = [folder / word if "." in word else word for word in words]
    if words[0] == "mesh":
        pytest.importorskip("dolfinx")
        words += ["--set", "model.fidelity=full", "--set", "model.displacements=small"]
    ran = run_without(missing, *words)
    assert ran.returncode == 1
    assert "Traceback" not in ran.stderr
    assert f"{missing[0]} cannot be loaded" in ran.stderr
    assert remedy in ran.stderr.splitlines()[-1]


def test_locks_of_windows_exclude_and_leave_the_content_readable(monkeypatch, tmp_path):
    held = set()

    def lock(number, mode, count):
        place = os.fstat(number).st_ino, os.lseek(number, 0, os.SEEK_CUR)
        if place in held:
            raise OSError(errno.EACCES, "locked")
        held.add(place)

    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(LK_NBLCK=2, locking=lock))
    with _files.lock_folder(tmp_path):
        ((_, offset),) = held
        assert offset > len((tmp_path / ".lock").read_bytes()) > 0
        with (
            pytest.raises(af.InvalidInput, match=f"another command runs.*process {os.getpid()}"),
            _files.lock_folder(tmp_path),
        ):
            pass
    # a lock that is waited for is taken as soon as it is free
    held.clear()
    with (tmp_path / "file").open("ab+") as first, (tmp_path / "file").open("ab+") as second:
        _files.lock_file(first, wait=True)
        monkeypatch.setattr(_files, "sleep", lambda _: held.clear())
        _files.lock_file(second, wait=True)
        assert len(held) == 1


def test_cores_are_counted_without_calls_of_linux(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 7)
    assert process_pool.count_cores() == 7


@pytest.mark.slow
def test_studies_start_workers_anew_where_no_process_can_fork(tmp_path):
    """As on Windows and macOS: workers by spawn, as many as there are cores.

    The others of `POSIX` stay, since the standard library kills a process by SIGKILL here.
    """
    (tmp_path / "case.toml").write_text(CASE.split("[motion]")[0], encoding="utf-8")
    words = 'case = "case.toml"\ncompute = "limit"\nset = ["limit.horizontal=1.0"]\n'
    words += "[vary.structure]\nbreadth = [0.5, 0.6]\n"  # it turns before it slides
    (tmp_path / "study.toml").write_text(words, encoding="utf-8")
    changed = "import multiprocessing, os\ndel os.fork, os.sched_getaffinity\n"
    changed += "os.cpu_count = lambda: 2\n"
    changed += 'multiprocessing.get_all_start_methods = lambda: ["spawn"]\n'
    words = ["study", tmp_path / "study.toml", "--out", tmp_path / "out"]
    ran = run_without([], *words, first=changed)
    assert ran.returncode == 0, ran.stderr
    table = (tmp_path / "out" / "results.csv").read_text(encoding="utf-8")
    assert len(table.splitlines()) == 3


def test_the_conda_recipe_has_the_version_and_the_dependencies_of_the_package():
    """No conda builds it here: the recipe says so, and is compared word by word."""
    recipe = (ROOT / ".ci" / "conda" / "meta.yaml").read_text(encoding="utf-8")
    assert "have not built it" in recipe
    assert f'version: "{af.__version__}"' in recipe
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    listed = recipe.split("  run:\n")[1].split("test:")[0].split("    - ")[1:]
    names = {"matplotlib": "matplotlib-base", "lazy-loader": "lazy_loader", "netCDF4": "netcdf4"}
    own = [each.partition(">=") for each in project["dependencies"]]
    expected = {f"{names.get(name, name)} >={least}" for name, _, least in own}
    assert {each.strip() for each in listed} == expected | {f"python {project['requires-python']}"}
    assert project["scripts"]["archfem"] in recipe
