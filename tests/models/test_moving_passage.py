"""A step of blocks that move far: its work is stored or lost, and its tangent is a derivative."""

import numpy as np
import pytest
from repeats import each_once

import archfem as af

SOFT = af.Material(young=1e9, poisson=0.2, unit_weight=25e3)
"""Stones that strain by about as much as their joints do."""

ROUND_OFF = 1e-12
"""Of sums of some hundred works, whose terms are as large as their total."""


def moved(fidelity, seed, friction=0.3):
    """Two stones on a support, somewhere pressed and turned, and where a step takes them [m]."""
    contact = af.Contact(1e9, 4e8, friction)
    tower = af.column(breadth=0.5, heights=[0.5, 0.5], material=SOFT, contact=contact)
    model = af.build(tower, fidelity=fidelity, cells=(2, 2), displacements="large")
    rng = np.random.default_rng(seed)
    dead = af.dead_load(model)
    first = dead.q + 1e-4 * rng.normal(size=model.size)
    return dead.model, first, first + 1e-4 * rng.normal(size=model.size)


@pytest.mark.parametrize(("fidelity", "late"), each_once(("rigid", "faces"), (0.0, 0.4)))
def test_the_work_of_a_step_is_stored_or_lost(fidelity, late):
    """F·Δq = ΔE + lost, of joints and of stones that strain; friction gives nothing back."""
    for seed in range(2):
        model, first, last = moved(fidelity, seed)
        passage = model.begin_step(first, late)
        after = model.with_memory(passage.updated_memory(last))
        work, lost = passage.force(last) * (last - first), passage.dissipation(last)
        scale = np.abs(work).sum()
        stored = after.energy(last) - model.energy(first)
        assert work.sum() == pytest.approx(stored + lost, abs=ROUND_OFF * scale)
        assert lost >= -ROUND_OFF * scale


@pytest.mark.parametrize(("fidelity", "left"), [("rigid", 1e-8), ("faces", 5e-5)])
def test_the_tangent_of_a_step_is_the_derivative_of_its_force(fidelity, left):
    """Along the step, by central differences, which round to 1e-10.

    Places of Gauss that move with the closed part of a face leave up to 2.5e-5, by the order in
    which a mesh has its nodes.
    """
    model, first, last = moved(fidelity, 1, friction=None)
    passage, way = model.begin_step(first, 0.4), last - first
    slope = (passage.force(last + 1e-5 * way) - passage.force(last - 1e-5 * way)) / 2e-5
    known = passage.tangent(last) @ way
    assert known == pytest.approx(slope, abs=left * np.abs(slope).max())


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
def test_at_an_instant_force_and_tangent_are_slopes_of_the_energy(fidelity):
    """Along a line, by central differences of what rounds to 1e-9 of the largest."""
    model, first, last = moved(fidelity, 2, friction=None)
    way, step = last - first, 1e-4
    ends = (first + step * way, first - step * way)
    slope = (model.energy(ends[0]) - model.energy(ends[1])) / (2.0 * step)
    assert model.force(first) @ way == pytest.approx(slope, rel=1e-6)
    bent = (model.force(ends[0]) - model.force(ends[1])) / (2.0 * step)
    known = model.tangent(first) @ way
    assert known == pytest.approx(bent, abs=1e-4 * np.abs(bent).max())
    assert model.updated_memory(first) == pytest.approx(model.memory, abs=0.0)
    assert model.face_mismatch(last) == (0.0, "")  # all faces are plane
