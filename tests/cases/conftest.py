"""A small case, and a record, that many tests of cases use."""

import pytest


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
def at2():
    """A function that writes accelerations [g] at steps dt [s] to a file of format AT2."""

    def write(path, samples, dt):
        rows = "\n".join(f"{sample:.6f}" for sample in samples)
        head = "RECORD OF A TEST\nTEST, STATION, 180\nACCELERATION IN UNITS OF G\n"
        path.write_text(f"{head}NPTS= {len(samples)}, DT= {dt:.4f} SEC\n{rows}\n")

    return write
