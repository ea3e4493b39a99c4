"""The fidelity "faces" where faces of a stone share corners: rings with soil on their backs."""

import numpy as np
import pytest

import archfem as af

TIGHT = af.statics.Newton(tolerance=1e-13)
SOIL = {"backfill": "full"}
STONES = 13


@pytest.fixture(scope="module")
def arch():
    """A ring between fixed abutments, under fill that ends in wedges on the springings."""
    ring = af.shapes.Arch(
        measured="centre line", span=5.0, embrace=160.0, thickness=0.5, voussoirs=STONES
    )
    return af.bridge(arches=[ring], backfill=af.shapes.Backfill(cover=0.3))


@pytest.fixture(scope="module")
def models(arch):
    """The ring's stones by their faces and by their joint nodes, on one mesh."""
    given = {"cells": (4, 4), "quadrature": "exact"}
    return {
        fidelity: af.build(arch, fidelity={**SOIL, "rest": fidelity}, **given)
        for fidelity in ("faces", "condensed", "full")
    }


def test_a_stone_under_soil_keeps_its_four_corners(models):
    assert models["full"].size - models["faces"].size == (2 * 5 * 5 - 2 * 4) * STONES


def test_the_basis_holds_rigid_motions(models):
    """Every block has its own, exactly: without them no mechanism could form."""
    cells = models["faces"].cells
    drawn = np.random.default_rng(1).normal(size=(cells.block.max() + 1, 3))[cells.block]
    x, y = cells.places.T
    wanted = np.stack([drawn[:, 0] - y * drawn[:, 2], drawn[:, 1] + x * drawn[:, 2]], 1).ravel()
    q = np.linalg.lstsq(cells.shape_functions.toarray(), wanted, rcond=None)[0]
    assert np.abs(cells.shape_functions @ q - wanted).max() < 1e-10 * np.abs(wanted).max()


@pytest.mark.slow
def test_dead_load_and_shaking_against_all_joint_nodes(arch, models):
    """Bounds are twice the errors in e that were found, 0.0007 and 0.0011, where e reaches 0.47."""
    motion = af.Motion.synthetic(duration=4.0, pga=3.0, seed=5).cut(0.5, 2.0)
    dead, shaken = {}, {}
    for fidelity in ("faces", "condensed"):
        state = af.dead_load(models[fidelity], TIGHT)
        dead[fidelity] = state.joints["eccentricity"].values
        damping = af.Rayleigh(0.05, (3.0, 12.0))
        run = af.time_history(models[fidelity], motion, dt=0.005, damping=damping, start=state)
        shaken[fidelity] = abs(run.joints["eccentricity"]).max("time").values
    assert np.abs(shaken["condensed"]).max() > 0.4
    assert 1e-6 < np.abs(dead["faces"] - dead["condensed"]).max() < 0.0014
    assert 1e-6 < np.abs(shaken["faces"] - shaken["condensed"]).max() < 0.0022


@pytest.mark.parametrize(("length", "bends"), [(2.5, False), (2.7, True)])
def test_a_long_bed_bends(length, bends):
    """A course of 0.4 m is a long beam on its joints from 2.6 m: then it keeps its nodes."""

    def box(low, high, name):
        outline = ((0.0, high), (0.0, low), (length, low), (length, high))
        return af.Block(outline, af.STONE, name, fixed=low < 0.0, corners=(0, 1, 2, 3))

    courses = [box(-0.3, 0.0, "ground"), box(0.0, 0.4, "low"), box(0.4, 0.8, "high")]
    wall = af.masonry.assembled(courses, af.masonry.STONE_TO_STONE)
    sizes = {
        fidelity: af.build(wall, fidelity=fidelity, cells=(8, 4)).size
        for fidelity in ("faces", "condensed")
    }
    assert sizes["condensed"] > 50
    assert sizes["faces"] == (sizes["condensed"] if bends else 9)
