"""Blocks between joints: forces, their tangent and their energy fit together."""

import numpy as np
import pytest

import archfem as af


def test_unchanged_tangents_are_factorised_once(ring_model):
    dead = af.dead_load(ring_model)
    tangent = ring_model.tangent(dead.q)
    assert ring_model.tangent(dead.q * (1.0 + 1e-12)) is tangent
    assert ring_model.tangent(np.zeros(ring_model.size)) is not tangent


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
    energy = (model.energy(q + step * along) - model.energy(q - step * along)) / (2.0 * step)
    assert model.force(q) @ along == pytest.approx(energy, rel=1e-6)
