"""The quick ones of the hard cases, each judged by its own study; all: `python -m hard`."""

import numpy as np
import pytest
from hard.cases_of_bridges import DAMPING, IN_BALANCE_IN_HALVES, stiffly_filled
from hard.setting import unbalanced_steps
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


@pytest.mark.slow
def test_a_step_in_halves_is_out_of_balance_by_what_is_off_by_a_millionth():
    run, dead, motion = stiffly_filled()
    steps, moved = (run.dataset[name].values for name in ("smallest_step", "q"))
    (halved,) = np.flatnonzero(steps < 0.75 * steps[1])[-1:]
    off = {"nothing": unbalanced_steps(run, dead, motion, DAMPING)}
    off["motion"] = unbalanced_steps(run, dead, motion.scaled(1.0 + 1e-6), DAMPING)
    whole, place = moved.copy(), abs(moved[halved]).argmax()
    moved[halved:, place] *= 1.0 + 1e-6
    off["displacement"] = unbalanced_steps(run, dead, motion, DAMPING)
    moved[:], steps[halved] = whole, steps[1]
    off["halves"] = unbalanced_steps(run, dead, motion, DAMPING)
    steps[halved] /= 4.0  # has no yardstick
    off["quarters"] = unbalanced_steps(run, dead, motion, DAMPING)
    assert off.pop("nothing") < IN_BALANCE_IN_HALVES
    assert min(off.values()) > IN_BALANCE_IN_HALVES, off
