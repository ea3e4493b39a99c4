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
