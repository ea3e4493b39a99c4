"""Newton's method and the dead load: convergence, failure, what an error carries."""

import numpy as np
import pytest
from scipy import sparse

from archfem.dynamics.ladder import build
from archfem.errors import DidNotConverge, InvalidInput
from archfem.masonry.actions import PointLoad
from archfem.masonry.shapes import circular_arch
from archfem.statics.equilibrium import dead_load, equilibrium, self_weight
from archfem.statics.newton import Newton, Solver


def test_a_kink_is_solved_exactly():
    """k <x>_- = -1 from an open start: one step back to closed, one onto the answer."""
    matrices = {closed: sparse.csr_matrix([[2.0 if closed else 1e-3]]) for closed in (True, False)}
    solver = Solver(1)
    solved = solver.solve(
        lambda x: np.where(x < 0.0, 2.0, 1e-3) * x + 1.0,
        lambda x: matrices[bool(x[0] < 0.0)],
        np.array([5.0]),
        1.0,
    )
    assert solved.q[0] == pytest.approx(-0.5, rel=1e-12)
    assert solved.residual <= 1e-10


def test_unchanged_tangents_are_factorised_once(ring_model):
    dead = dead_load(ring_model)
    tangent = ring_model.tangent(dead.q)
    assert ring_model.tangent(dead.q * (1.0 + 1e-12)) is tangent
    assert ring_model.tangent(np.zeros(ring_model.size)) is not tangent


@pytest.mark.parametrize("fidelity", ["rigid", "full"])
def test_tangent_is_the_derivative_of_force(ring, fidelity):
    model = build(ring, fidelity=fidelity, cells=(2, 2))
    random = np.random.default_rng(5)
    q, along = 1e-4 * random.standard_normal((2, model.size))
    step = 1e-7
    difference = (model.force(q + step * along) - model.force(q - step * along)) / (2.0 * step)
    assert model.tangent(q) @ along == pytest.approx(
        difference, rel=1e-6, abs=1e-6 * np.abs(difference).max()
    )
    energy = (model.energy(q + step * along) - model.energy(q - step * along)) / (2.0 * step)
    assert model.force(q) @ along == pytest.approx(energy, rel=1e-6)


@pytest.mark.parametrize("fidelity", ["rigid", "full"])
def test_least_thickness_is_bracketed(fidelity):
    """A semicircle of 17 chorded stones stands at 1.02 times its least t/R and not at 0.98."""
    least = 0.10546  # by limit analysis of the same polygon
    given = {"radius": 1.0, "embrace": 180.0, "voussoirs": 17, "chords": 1}
    stands = build(circular_arch(thickness=1.02 * least, **given), fidelity=fidelity)
    found = dead_load(stands)
    assert np.abs(found.joints["eccentricity"]).max() <= 0.5 + 1e-9
    falls = build(circular_arch(thickness=0.98 * least, **given), fidelity=fidelity)
    with pytest.raises(DidNotConverge, match=r"no equilibrium beyond .* make it thicker") as caught:
        dead_load(falls)
    assert caught.value.last.q.shape == (falls.size,)


def test_point_load_is_carried_whole(ring):
    """Thrusts at both springings balance weight and load, on either rung."""
    load = PointLoad(x=1.0, force=(0.0, -5e3))
    for fidelity in ("rigid", "full"):
        model = build(ring, fidelity=fidelity)
        forces = self_weight(model) + model.load(load)
        joints = equilibrium(model, forces).joints
        up = sum(
            side
            * float(
                joints["N"][k] * ring.normals[k, 1] - joints["V"][k] * ring.joints[k].tangent[1]
            )
            for k, side in ((0, 1.0), (17, -1.0))
        )
        weight = model.body[:, 1].sum() * ring.gravity
        assert up == pytest.approx(weight + 5e3, rel=1e-9)


def test_point_load_off_the_structure(ring):
    with pytest.raises(InvalidInput, match=r"x = 9 m misses the structure"):
        PointLoad(x=9.0, force=(0.0, -1.0)).place(ring)


def test_petsc_options_are_passed_on_and_removed(ring):
    from petsc4py import PETSc

    before = dict(PETSc.Options().getAll())
    model = build(ring, fidelity="rigid")
    default = dead_load(model)
    other = dead_load(model, Newton(petsc={"pc_type": "svd"}))
    assert other.q == pytest.approx(default.q, rel=1e-9, abs=1e-15)
    assert dict(PETSc.Options().getAll()) == before


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"fidelity": "exact"}, "fidelity 'exact' is not known"),
        ({"cells": (4, 4, 4)}, "has 3 values"),
        ({"quadrature": "simpson"}, "'simpson' is not known"),
    ],
)
def test_build_refuses(ring, given, says):
    with pytest.raises(InvalidInput, match=says):
        build(ring, **given)
