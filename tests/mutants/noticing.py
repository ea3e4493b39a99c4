"""Statements that each test executes, and whether one of some tests fails."""

import builtins
import functools
import importlib
import json
import os
import resource
import sys
import time
import traceback
from collections import defaultdict
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

BEFOREHAND = (
    *("numpy", "scipy.optimize", "scipy.sparse.linalg", "scipy.interpolate", "scipy.integrate"),
    *("scipy.signal", "xarray", "pandas", "netCDF4", "matplotlib.pyplot", "matplotlib.collections"),
    *("numba", "shapely", "ezdxf", "pint", "tqdm", "threadpoolctl"),
)
"""Packages that tests need, imported once: each run of tests is a fork of this process."""

KEEPS = "archfem._numba"
"""Module of archfem whose caches are of no physics: it chooses a place on disk once."""

Reached = dict[str, tuple[float, list[list[str | int]]]]
"""Of each test that passes: CPU time [s], and modules and lines that it executes."""


def get_ready() -> None:
    """Import modules before forking, so that forks need not."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    for name in BEFOREHAND:
        importlib.import_module(name)


def failing(place: Path, tests: list[str], limit: float) -> str | None:
    """Name of the first of some tests that fails in a copy of the package; None if none does.

    Args:
        place: folder of the copy.
        tests: as pytest names them, in the order in which they run.
        limit: CPU time [s]; a change that makes tests so slow is noticed.
    """
    said = place / "noticed.txt"
    said.unlink(missing_ok=True)
    plugin = Choice(tests, said)
    files = list(dict.fromkeys(test.split("::")[0] for test in tests))
    code = _forked(place, ["-x", *files], plugin, limit)
    if code in (0, pytest.ExitCode.NO_TESTS_COLLECTED):
        return None
    return said.read_text() if said.exists() else f"ended with {code}"


def reached(place: Path, folders: list[str]) -> None:
    """Write to `reached.json` the statements that each passing test executes, as `Reached`.

    Args:
        place: folder of a copy of the package, its modules `marked`.
        folders: of tests, or files.
    """
    _forked(place, folders, Reach(place / "reached.json"), resource.RLIM_INFINITY)


class Choice:
    """Plugin of pytest: only some tests, in their order, and the name of the first that fails."""

    def __init__(self, tests: list[str], said: Path):
        self.order = {test: number for number, test in enumerate(tests)}
        self.said = said

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        items[:] = [item for item in items if item.nodeid in self.order]
        items.sort(key=lambda item: self.order[item.nodeid])

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.said.write_text(report.nodeid)

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed:
            self.said.write_text(f"{report.nodeid} cannot be read")


class Reach:
    """Plugin of pytest: statements that each test executes, and its CPU time."""

    def __init__(self, target: Path):
        self.target, self.found = target, {}
        self.now: set[tuple[str, int]] = set()
        self.fixtures: dict[int, set[tuple[str, int]]] = defaultdict(set)
        builtins._reached = lambda place: self.now.add(place)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Any:
        before, self.now = self.now, set()
        yield
        self.fixtures[id(fixturedef)] |= self.now
        self.now |= before

    @pytest.hookimpl(hookwrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: Any) -> Any:
        _forget(item.module)
        self.now, self.failed, start = set(), False, time.process_time()
        yield
        for fixtures in item._fixtureinfo.name2fixturedefs.values():
            self.now.update(*(self.fixtures[id(each)] for each in fixtures))
        if not self.failed:
            self.found[item.nodeid] = (time.process_time() - start, sorted(self.now))

    def pytest_runtest_logreport(self, report: Any) -> None:
        self.failed |= not report.passed

    def pytest_sessionfinish(self) -> None:
        self.target.write_text(json.dumps(self.found))


def _forget(module: ModuleType) -> None:
    """Empty the caches of physics and of a module of tests: each test executes all it needs."""
    own = [each for name, each in sys.modules.items() if name.startswith("archfem.") and each]
    for each in (*own, module):
        for value in list(vars(each).values()):
            if isinstance(value, functools._lru_cache_wrapper) and each.__name__ != KEEPS:
                value.cache_clear()


def _forked(place: Path, tests: list[str], plugin: object, limit: float) -> int:
    """Run tests in a copy of the package, in a process of their own; return how it ended."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    code = 1
    try:
        code = _run(place, tests, plugin, limit)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _run(place: Path, tests: list[str], plugin: object, limit: float) -> int:
    spent = time.process_time()
    if limit != resource.RLIM_INFINITY:
        limit = int(spent + limit) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    os.chdir(place)
    log = os.open(place / "log.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 1)
    os.dup2(log, 2)
    os.environ["PYTHONPATH"] = str(place)
    sys.path.insert(0, str(place))
    for name in [name for name in sys.modules if name.split(".")[0] == "archfem"]:
        del sys.modules[name]
    return int(pytest.main(["-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests], [plugin]))
