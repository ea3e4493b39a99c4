"""Every benchmark script starts: each runs with `--quick`, which takes its smallest scene."""

import importlib
import logging
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parent / "benchmarks"

NAMES = sorted(
    path.stem for path in SCRIPTS.glob("*.py") if "def main(arguments" in path.read_text("utf-8")
)
"""Scripts with a command line of their own."""

FIRST = ("opensees_ring", "run")
"""Scripts that import OpenSees, which must be loaded before archfem and its MPI."""

LONG = (
    "scaling",
    "shaken_blocks",
    "three_ways",
    "profile_step",
    "assessment_map",
    "bridge",
    "bridge_falls",
    "bridge_fragility",
    "bridge_history",
    "bridge_inference",
    "bridge_range",
    "closing_law",
    "drift_and_equality",
    "energy_drift",
    "ensemble",
    "fidelity_errors",
    "floor",
    "matched_records",
    "monolithic",
    "opensees_ring",
    "predicted_error",
    "random_structures",
    "run",
    "solvers",
    "study_cluster",
    "study_efficiency",
    "study_kills",
)
"""Scripts that take a third of a second or more: one runs five others of these, one compiles a loop
of its own, two start studies of processes, three match motions, and one needs OpenSees."""


MARKED = [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in NAMES]


@pytest.fixture(scope="module")
def scripts():
    """Make the modules of the benchmarks importable, and forget them afterwards."""
    before = set(sys.modules)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(SCRIPTS)
        yield
    for name in set(sys.modules) - before:
        if Path(getattr(sys.modules[name], "__file__", None) or "/").parent == SCRIPTS:
            del sys.modules[name]


@pytest.fixture
def logging_levels():
    """Restore the logging levels that a script sets for its process."""
    logger, disabled = logging.getLogger("archfem"), logging.root.manager.disable
    level = logger.level
    yield
    logger.setLevel(level)
    logging.disable(disabled)


@pytest.mark.usefixtures("scripts", "logging_levels")
@pytest.mark.parametrize("name", [name for name in LONG if name not in FIRST])
def test_names_that_a_long_benchmark_imports_exist(name):
    assert callable(importlib.import_module(name).main)


@pytest.mark.usefixtures("scripts", "logging_levels")
@pytest.mark.parametrize("name", MARKED)
def test_benchmark_starts(name, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    if name in FIRST and find_spec("openseespy"):
        command = [sys.executable, str(SCRIPTS / f"{name}.py"), "--quick"]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    else:
        importlib.import_module(name).main(["--quick"])
        printed = capsys.readouterr().out
    assert printed.strip()
    if len(printed.splitlines()) == 1 and printed.startswith("left out"):
        pytest.skip(printed.strip())
