"""The quick ones of the hard cases, each judged by its own study; all: `python -m hard`."""

import pytest
from hard.table import CASES

LONG = (
    "pulse of one step",
    "three very wide voussoirs",
    "blocks and joints renumbered",
    "joints 1000 × softer",
    "ring under 1.5 g vertical",
    "rocking block, HHT(-0.1), 1 ms",
    "time step 20 ms",
    "filled segment of 30°",
    "cells 1 × 1",
    "soil joints 100 × softer",
    "60 s of nothing",
    "60 s of nothing, undamped",
    "width 100 m",
    "bare bridge of thin rings",
    "fill of 0.5 MPa",
    "0.98 × least thickness, rigid",
    "filled span at 0.8 g, 0.4 s",
    "filled span, fidelities by part",
    "filled span, damping 'none', conserving",
    "sidewalls retained",
    "piers of 20 m, 50 courses",
    "compliance stepper, faces, exact",
    "newton stepper, faces, exact",
    "paving on an eroded deck",
    "filled span, 20 ms steps",
    "wide flat span on a slender pier",
    "viaduct of 8 spans, bare",
    "record × 3",
    "0.98 × least, soft joints",
    "cover of 45 mm",
    "flat ring, 20°",
    "rocking block, HHT(-0.05), 1 ms",
    "rocking block, average acceleration, 1 ms",
    "mirrored motion",
    "width 1 mm",
)
"""Seconds each, and near to others that are quicker."""


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, marks=pytest.mark.slow if case.name in LONG else (), id=case.name)
        for case in CASES
        if case.quick
    ],
)
def test_hard_case(case):
    cells, right = case.row()
    assert right, " | ".join(cells)


def test_long_cases_are_among_the_hard_ones():
    """Under an older name a case would run here, and take its seconds."""
    assert {case.name for case in CASES} >= set(LONG)
