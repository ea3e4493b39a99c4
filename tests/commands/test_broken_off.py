"""A run that is broken off keeps what was computed, and says so by its exit code."""

import os
import resource
import signal

import pytest

import archfem as af
from archfem.commands.line import INTERRUPTED, TERMINATED, main

COLUMN = """
[structure]
shape = "column"
breadth = 1.0
heights = [1.0]
[model]
fidelity = "rigid"
[motion]
synthetic = { seed = 1, duration = 3.0, pga = 1.0 }
"""


@pytest.fixture
def column(tmp_path):
    path = tmp_path / "column.toml"
    path.write_text(COLUMN)
    return path


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, INTERRUPTED), (signal.SIGTERM, TERMINATED)]
)
def test_a_signal_ends_a_motion_and_keeps_what_was_computed(
    column, tmp_path, undrawn, monkeypatch, capsys, number, code
):
    def cut_short(case, motion, dead, damping):
        def press(structure, resultants):
            if len(seen) == 300:
                os.kill(os.getpid(), number)
            seen.append(resultants)

        seen = []
        return af.time_history(dead.model, motion, dt=0.005, start=dead, until=press)

    monkeypatch.setattr("archfem.cases.run.shaken", cut_short)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # may be ignored here
    try:
        assert main(["run", str(column), "--out", str(tmp_path / "out")]) == code
    finally:
        signal.signal(signal.SIGINT, before)
    run = af.History.read(tmp_path / "out" / "history.nc", af.Case.read(column).structure)
    assert run.ended is af.dynamics.Ending.INTERRUPTED
    assert 0.5 < run.time[-1] < 2.9
    summary = (tmp_path / "out" / "summary.txt").read_text()
    assert "outcome: interrupted at" in summary
    assert "interrupted" in capsys.readouterr().err


def test_a_full_disk_is_an_error_in_words(column, tmp_path, undrawn, capsys):
    """A file may not be longer than 20 kB: so it is with a full disk, and the error is alike."""
    out = tmp_path / "out"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        assert main(["run", str(column), "--out", str(out)]) == 1
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "history.nc could not be written, for the disk is full" in capsys.readouterr().err
    assert not (out / "history.nc").exists()
    assert not list(out.glob(".*.part*"))
