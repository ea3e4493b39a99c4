"""A case that takes milliseconds, a study of it, and a module of finders for workers."""

import sys
from pathlib import Path

import pytest

import archfem as af

FINDERS = '''
"""Finders of the tests, in a module that workers can import."""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_info

from archfem import _numba


def lengths(case):
    """Findings that take no time."""
    ring = case.settings["structure"]
    if ring["thickness"] > 0.9:
        raise RuntimeError("too thick for this test")
    return {"twice": 2.0 * ring["thickness"], "voussoirs": ring["voussoirs"], "rows": [1.0, 2.0]}


def lengths_again(case):
    """The same findings by another name."""
    return lengths(case)


def slowly(case, seconds=0.2):
    """Findings that take time."""
    time.sleep(seconds)
    return lengths(case)


def compiling(case):
    """Announces what every worker would compile."""
    _numba._time_compilation = lambda: 0.1
    _numba._announce_compilation("SmallSystem")
    return lengths(case)


def deadly(case, folder):
    """Ends its own process: a thin ring the first time, a thick one always."""
    mark = Path(folder) / "seen"
    thin = case.settings["structure"]["thickness"] < 0.55
    if not (thin and mark.exists()):
        if thin:  # a thick one may be first
            mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return lengths(case)


def matches(case, folder):
    """Mean of the only pair; each matching, which takes no time here, leaves a file."""
    from dataclasses import replace
    from unittest.mock import patch

    import archfem as af
    from archfem.studies import cache

    def matched(suite, target, band):
        time.sleep(0.05)
        (Path(folder) / f"{suite.pairs[0].name} {time.monotonic_ns()}").touch()
        return replace(suite, pairs=tuple(pair.scaled(1.0 / 3.0) for pair in suite.pairs))

    cache._cache.pop("suites", None)  # as if each point were computed by another process
    with patch.object(af.Suite, "matched", matched):
        motion = af.studies.ground_motion(case)
    return {"mean": float(motion.horizontal.mean()), "last": float(motion.vertical[-2])}


def noisy(case):
    """Warns with a number of its own, and of something else."""
    import logging

    thickness = case.settings["structure"]["thickness"]
    for text in ("a joint had turned by %g rad", "another %g"):
        logging.getLogger("archfem").warning(text, thickness)
    return {}


def ending(case, folder):
    """Ends its own process in one way or another, or tells of it."""
    thickness = case.settings["structure"]["thickness"]
    if thickness < 0.65:
        deadly(case, folder)
    elif thickness < 0.75:
        os._exit(0)
    elif thickness < 0.805:
        print("an exit is noted")
        print("so are errors", file=sys.stderr)
        sys.exit(5)
    handles = {os.readlink(each) for each in Path("/proc/self/fd").iterdir() if each.is_symlink()}
    return {
        "sockets": sum(handle.startswith("socket:") for handle in handles),
        "threads": len(list(Path(f"/proc/{os.getppid()}/task").iterdir())),
        "blas": max(each["num_threads"] for each in threadpool_info()),
        "mpi": sum(name in sys.modules for name in ("mpi4py.MPI", "petsc4py.PETSc")),
        "draw": np.random.random(),
        "process": os.getpid(),
        "parent": os.getppid(),
    }


def orphaned(case, folder):
    """Ends the parent of its process, the first time."""
    seen = Path(folder) / "seen"
    first = not seen.exists()
    seen.mkdir(exist_ok=True)
    for process in (os.getpid(), os.getppid()):
        (seen / str(process)).touch()
    if first:
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(0.5)
    return lengths(case)
'''


@pytest.fixture(scope="session")
def finders(tmp_path_factory):
    """The module `finders_of_tests`, also for workers."""
    folder = tmp_path_factory.mktemp("finders")
    (folder / "finders_of_tests.py").write_text(FINDERS)
    sys.path.insert(0, str(folder))
    yield folder
    sys.path.remove(str(folder))
    sys.modules.pop("finders_of_tests", None)


@pytest.fixture
def ring_file(tmp_path):
    """Case file of a rigid ring of five stones, half a second of shaking."""
    path = tmp_path / "ring.toml"
    path.write_text(
        'title = "a small ring"\n'
        '[structure]\nshape = "circular_arch"\nradius = 3.0\nthickness = 0.6\nembrace = 150.0\n'
        'voussoirs = 5\n[model]\nfidelity = "rigid"\n'
        "[analysis]\ndt = 0.005\ndamping = { ratio = 0.05, frequency = 8.0 }\n"
        "[motion]\nscale = 1.0\nsynthetic = { seed = 1, duration = 0.5, pga = 3.0 }\n"
    )
    return path


@pytest.fixture
def small_ring(ring_file):
    """The case of that file."""
    return af.Case.read(ring_file)


@pytest.fixture
def study_file(ring_file, finders):
    """A study of six points, one of which fails."""
    path = ring_file.with_name("study.toml")
    path.write_text(
        'title = "six rings"\ncase = "ring.toml"\ncompute = "finders_of_tests:lengths"\n'
        "[vary]\nstructure.thickness = [0.5, 0.6, 1.0]\nmotion.scale = [1.0, 2.0]\n"
    )
    return path


@pytest.fixture
def matching_study(finders):
    """A function of a folder: a study of two rings on one suite of three pairs to be matched."""

    def study(folder):
        folder.mkdir()
        suite = {
            "matched": True,
            "target": {"code": "TBEC-2018", "ss": 1.0, "s1": 0.3, "site": "ZD"},
            "pairs": {n: {"synthetic": {"seed": k, "duration": 1.0}} for k, n in enumerate("abc")},
        }
        ring = {"shape": "circular_arch", "radius": 3.0, "embrace": 150.0, "voussoirs": 5}
        case = af.Case.of({"structure": {**ring, "thickness": 0.5}, "suite": suite})
        over = {"structure.thickness": [0.5, 0.6], "suite.pair": list("abc")}
        find = {"name": "finders_of_tests:matches", "folder": str(folder)}
        return af.Study(case, over, find), folder

    return study


def rows_of(folder: Path) -> dict[str, str]:
    """The stored rows of a study by their names."""
    return {path.name: path.read_text() for path in folder.glob("points/*/*.json")}
