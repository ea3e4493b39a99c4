"""Structures and models that many tests use."""

import gc
import importlib
import os
from contextlib import suppress
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from verified import Table, verified  # noqa: F401  (a fixture)

import archfem as af

STEPPING = (
    *("cases", "dynamics", "test_notebooks.py", "test_readme.py", "verification", "validation"),
    *("view", "statics", "masonry"),
)
"""Tests that step through time, and so need compiled functions: the more, the earlier."""


def pytest_addoption(parser):
    help = "run the tests that tell of what they verify, and write it there"
    parser.addoption("--verified", metavar="FILE.json", help=help)


def pytest_configure(config):
    # garbage is looked for seldom: collecting tests makes large syntax trees, a fifth of its time
    gc.set_threshold(50_000, 20, 100)
    # a failure of the machine, against which files are flushed, ends the tests too
    os.fsync = lambda number: None
    if config.getoption("--verified") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Table(config.getoption("--verified")))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Import the files of a folder from its end in every second worker.

    Pytest rewrites the assertions of a new file, which takes half of the time of collecting them:
    each worker rewrites one half, and reads the other one from the cache on disk.
    """
    report = yield
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    if isinstance(collector, pytest.Dir) and int(worker[2:]) % 2:
        for file in reversed(report.result):
            if isinstance(file, pytest.Module):
                with suppress(Exception, pytest.skip.Exception):  # collecting the file raises it
                    _ = file.obj
    return report


def pytest_collection_finish():
    """Look for garbage among what tests make alone: a twentieth of their time."""
    gc.freeze()


def pytest_collection_modifyitems(config, items):
    """Let one of many workers compile the kernels of all, while others run tests that need none.

    Each begins with a part of the list and later takes over from the end of another's part.
    """
    tests = config.rootpath / "tests"

    def place(item):
        folder = item.path.relative_to(tests).parts[0]
        return STEPPING.index(folder) if folder in STEPPING else len(STEPPING)

    if hasattr(config, "workerinput"):
        items.sort(key=place)
    if config.getoption("--verified"):
        items[:] = [item for item in items if "verified" in item.fixturenames]


@pytest.fixture(scope="session")
def ring():
    """The validation ring of Demirel and Aldemir (2021), Figure 3."""
    return af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)


@pytest.fixture(scope="session")
def ring_model(ring):
    """The ring with all nodes of 4 × 4 cells a voussoir."""
    return af.build(ring, fidelity="full", cells=(4, 4))


@pytest.fixture(scope="session")
def stack():
    """Two square blocks on a base."""
    return af.column(breadth=1.0, heights=[1.0, 1.0])


@pytest.fixture
def undrawn(monkeypatch):
    """Figures are made, but their files stay empty: printing them takes most of the time."""

    def unprinted(figure, target, **given):
        if not hasattr(target, "write"):
            Path(target).touch()

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", unprinted)


@pytest.fixture
def low_resolution(monkeypatch):
    """Figures are printed with a quarter of the dots per inch, which shortens a command by half."""
    from matplotlib.figure import Figure

    print_figure = Figure.savefig
    monkeypatch.setattr(
        Figure,
        "savefig",
        lambda figure, target, **given: print_figure(figure, target, **{**given, "dpi": 75}),
    )


@pytest.fixture
def unplotted(undrawn, monkeypatch):
    """Commands and reports get empty figures: for tests of texts and files, in a third of the time.

    Tests that take `undrawn` alone, and those of `view`, make the figures.
    """
    from matplotlib.figure import Figure

    report = "cases.report.sections", "cases.report.response"
    for room in ("cases.result_folder", *report, "commands.run", "commands.records"):
        module = importlib.import_module(f"archfem.{room}")
        for name in [name for name in vars(module) if name.startswith("draw_")]:
            made = [Figure()] if name == "draw_envelopes" else Figure()
            monkeypatch.setattr(module, name, lambda *_, made=made, **__: made)
    monkeypatch.setattr("archfem._display.ResultDisplay.plot", lambda *_, **__: Figure())


@pytest.fixture
def undoubted(monkeypatch):
    """Runs of cases are not compared with finer ones: a third of the time of a short run."""
    monkeypatch.setattr("archfem.cases.run.doubt_fidelity", lambda *_: [])


@pytest.fixture
def small(tmp_path):
    """File of a case: a column under two pairs of one second."""
    path = tmp_path / "small.toml"
    path.write_text(
        """
title = "a column under two pairs"
[structure]
shape = "column"
breadth = 1.0
heights = [1.0, 1.0]
[model]
fidelity = "rigid"
[suite]
name = "small"
reduction = 2.0
[suite.pairs]
first = { synthetic = { seed = 1, duration = 1.0, pga = 1.0 } }
second = { synthetic = { seed = 2, duration = 1.0, pga = 1.0, vertical_ratio = 0.0 } }
"""
    )
    return path


@pytest.fixture
def unlike_weights():
    """Tables of three stones that stand also for a wall and differ in weight alone."""
    blocks = [
        {"outline": [[0, k], [1, k], [1, k + 1], [0, k + 1]], "name": f"b{k}", "material": f"m{k}"}
        for k in range(4)
    ]
    blocks[0] |= {"fixed": True, "material": "stone"}
    load = {"young": 3e10, "poisson": 0.2, "stands_for": "the wall above"}
    materials = {f"m{k}": {**load, "unit_weight": f"{20 * k} kN/m³"} for k in (1, 2, 3)}
    return {"structure": {"shape": "blocks", "blocks": blocks}, "materials": materials}


@pytest.fixture
def at2():
    """A function that writes accelerations [g] at steps dt [s] to a file of format AT2."""

    def write(path, samples, dt):
        rows = "\n".join(f"{sample:.6f}" for sample in samples)
        head = "RECORD OF A TEST\nTEST, STATION, 180\nACCELERATION IN UNITS OF G\n"
        path.write_text(f"{head}NPTS= {len(samples)}, DT= {dt:.4f} SEC\n{rows}\n")

    return write
