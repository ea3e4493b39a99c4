"""Blocks between joints: forces, their tangent and their energy fit together."""

import numpy as np
import pytest
from glued import glued

import archfem as af


def test_unchanged_tangents_are_factorised_once(ring):
    """By springs at points: with exact integrals a tangent follows every edge of contact."""
    dead = af.dead_load(af.build(ring, fidelity="full", cells=(4, 4), quadrature="lobatto"))
    tangent = dead.model.tangent(dead.q)
    assert dead.model.tangent(dead.q * (1.0 + 1e-12)) is tangent
    assert dead.model.tangent(np.zeros(dead.model.size)) is not tangent


@pytest.mark.parametrize("fidelity", ["rigid", "full"])
def test_tangent_is_the_derivative_of_force(ring, fidelity):
    model = af.build(ring, fidelity=fidelity, cells=(2, 2))
    random = np.random.default_rng(5)
    q, along = 1e-4 * random.standard_normal((2, model.size))
    step = 1e-7
    difference = (model.force(q + step * along) - model.force(q - step * along)) / (2.0 * step)
    assert model.tangent(q) @ along == pytest.approx(
        difference, rel=1e-6, abs=1e-6 * np.abs(difference).max()
    )


@pytest.mark.parametrize("fidelity", ["rigid", "full"])
def test_force_is_the_slope_of_energy_where_nothing_slides(ring, fidelity):
    model = af.build(glued(ring), fidelity=fidelity, cells=(2, 2))
    random = np.random.default_rng(5)
    q, along = 1e-4 * random.standard_normal((2, model.size))
    step = 1e-7
    energy = (model.energy(q + step * along) - model.energy(q - step * along)) / (2.0 * step)
    assert model.force(q) @ along == pytest.approx(energy, rel=1e-6)


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_the_work_of_a_step_on_joints_that_hold_is_stored_energy(late):
    """Late forces are of (1/2 - l) of the start and (1/2 + l) of the end: of stones they lose l."""
    soft = af.Material(young=1e9, poisson=0.2, unit_weight=25e3)
    stack = glued(af.column(breadth=1.0, heights=[1.0, 1.0], material=soft))
    model = af.build(stack, fidelity="faces", cells=(1, 1))
    first, last = 1e-5 * np.random.default_rng(3).normal(size=(2, model.size))
    first, last = (each + af.dead_load(model).q for each in (first, last))
    passage, way = model.begin_step(first, late), last - first
    stored = model.energy(last) - model.energy(first)
    lost = passage.dissipation(last)
    assert passage.force(last) @ way == pytest.approx(stored + lost, rel=1e-9)
    assert lost >= late * float(way @ model.block_stiffness @ way) * (1.0 - 1e-9)
    if not late:
        assert lost == pytest.approx(0.0, abs=1e-9 * abs(stored))


def test_before_anything_opens_the_tangent_is_that_of_closed_joints():
    soft = af.Material(young=1e9, poisson=0.2, unit_weight=25e3)
    stack = glued(af.column(breadth=1.0, heights=[1.0, 1.0], material=soft))
    for fidelity in ("rigid", "faces"):
        dead = af.dead_load(af.build(stack, fidelity=fidelity, cells=(1, 1)))
        closed, tangent = (
            dead.model.closed_tangent().toarray(),
            dead.model.tangent(dead.q).toarray(),
        )
        assert closed == pytest.approx(tangent, abs=1e-9 * np.abs(tangent).max())
