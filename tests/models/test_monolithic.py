"""Weak forms of joints that slide, against sparse products of the joint operator: the same law.

Both know the scalar laws; all else, from jumps to sums along joints, derivatives and memory at
points, is found in two ways.
"""

from functools import cache

import numpy as np
import pytest

import archfem as af
from archfem.joints.contact_law import is_closed
from archfem.masonry import assembled
from archfem.models.fem import _fenicsx
from archfem.models.fem.joint_facets import JointFacets
from archfem.models.fem.mesh import generate_mesh
from archfem.models.fem.space import build_broken_space

SAME = 1e-12
"""Two ways to the same numbers at one state, relative to the largest: rounding of sums."""

SOLVED = 1e-8
"""Of what Newton's method has found on the way, relative to the largest."""

TIGHT = af.statics.Newton(tolerance=1e-13)
BED = af.Contact(1.48e9, 0.30e9, 0.2)
UPPER = af.Contact(1.0e9, 0.50e9, 0.4, cohesion=5e3)
UPRIGHT = af.Contact(0.8e9, 0.40e9, None)
RULE = af.joints.Quadrature()
SETTINGS = (("lobatto", 1, "quadrilateral"), ("gauss", 2, "triangle"))


def touch(a, b):
    """Three kinds of joints: that slide, that stick as well, and that never slide."""
    names = {a.name, b.name}
    if "base" in names:
        return BED
    return UPPER if "top" in names else UPRIGHT


@cache
def wall():
    """A stone on two stones on a rock that dips by 10.5°, nearly as steep as its friction allows.

    Cells have several facets on joints, which share corners; the normals of some joints point up
    and those of others down, from the top, which is of lower number, to the stones under it.
    """
    c, s = np.cos(np.radians(10.5)), np.sin(np.radians(10.5))
    boxes = {
        "base": (-0.2, -0.3, 1.7, 0.0),
        "top": (0.3, 0.5, 1.2, 1.2),
        "left": (0.0, 0.0, 0.8, 0.5),
        "right": (0.8, 0.0, 1.5, 0.5),
    }
    blocks = []
    for name, (x0, y0, x1, y1) in boxes.items():
        corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        outline = tuple(map(tuple, corners @ [[c, s], [-s, c]]))
        fixed = name == "base"
        blocks.append(af.Block(outline, af.STONE, name, fixed=fixed, part="wall", role="pier"))
    return assembled(blocks, touch, name="wall")


@cache
def models(rule="lobatto", degree=1, cell="quadrilateral"):
    """The wall with all nodes, by matrices and by weak forms."""
    given = {"cells": (1, 4), "quadrature": rule, "degree": degree, "cell": cell}
    return [af.build(wall(), fidelity=fidelity, **given) for fidelity in ("full", "monolithic")]


@pytest.fixture(params=SETTINGS, ids=lambda setting: setting[0])
def both(request):
    """Two models that remember the same random slips, a state, and a direction."""
    full, slow = models(*request.param)
    random = np.random.default_rng(3)
    memory = 1e-4 * random.standard_normal(len(full.memory))
    start, q = 1e-4 * random.standard_normal((2, full.size))
    return [each.with_memory(memory) for each in (full, slow)], start, q


def differ(found, expected):
    """Largest difference, relative to the largest value."""
    return np.abs(np.asarray(found) - expected).max() / np.abs(expected).max()


def test_an_instant_is_that_of_the_joint_operator(both):
    (full, slow), direction, q = both
    assert slow.operator is None
    for name in ("force", "energy", "resultants", "updated_memory"):
        assert differ(getattr(slow, name)(q), getattr(full, name)(q)) < SAME, name
    assert differ(slow.tangent(q) @ direction, full.tangent(q) @ direction) < SAME
    slid = full.updated_memory(q) - full.memory
    status = is_closed(full.operator.effective_gaps(q))
    assert 0.2 < status.mean() < 0.8
    assert 0.0 < np.mean(slid[status] != 0.0) < 1.0  # of the closed points some hold


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_a_step_is_that_of_the_joint_operator(both, late):
    (full, slow), start, q = both
    by_matrices, by_forms = full.begin_step(start, late), slow.begin_step(start, late)
    for name in ("force", "resultants", "updated_memory", "dissipation"):
        assert differ(getattr(by_forms, name)(q), getattr(by_matrices, name)(q)) < SAME, name
    direction = q - start
    tangents = [passage.tangent(q) @ direction for passage in (by_forms, by_matrices)]
    assert differ(*tangents) < SAME


def test_joints_that_just_touch_are_closed_and_hold():
    full, slow = models()
    rest = np.zeros(full.size)
    assert (
        abs(slow.tangent(rest) - full.closed_tangent()).max()
        < SAME * abs(full.closed_tangent()).max()
    )
    tangents = [each.begin_step(rest, 0.3).tangent(rest) for each in (slow, full)]
    assert abs(tangents[0] - tangents[1]).max() < SAME * abs(tangents[1]).max()


def test_a_support_that_has_moved_moves_the_joints():
    full, slow = (
        each.settled(af.Settlement("base", (1e-4, -2e-4, 1e-5))).with_memory(
            1e-5 * np.arange(len(each.memory))
        )
        for each in models()
    )
    start, q = 1e-4 * np.random.default_rng(4).standard_normal((2, full.size))
    assert differ(slow.resultants(q), full.resultants(q)) < SAME
    means = [each.begin_step(start, 0.0).resultants(q) for each in (slow, full)]
    assert differ(*means) < SAME


def test_memory_of_a_copy_is_its_own():
    _, slow = models()
    q = 1e-4 * np.random.default_rng(5).standard_normal(slow.size)
    force = slow.force(q)
    passage = slow.begin_step(np.zeros(slow.size), 0.0)
    mean = passage.force(q)
    slid = slow.with_memory(np.full(len(slow.memory), 1e-4))
    assert differ(slid.force(q), force) > 1e-6
    assert differ(slid.begin_step(q, 0.1).force(-q), mean) > 1e-6
    assert np.array_equal(slow.force(q), force)
    assert np.array_equal(passage.force(q), mean)


def test_no_cell_has_two_facets_of_one_colour():
    facets = JointFacets(
        build_broken_space(generate_mesh(wall(), af.models.Discretisation(cells=(1, 1)))), RULE
    )
    cells_at = _fenicsx.find_connectivity(facets.space.mesh.grid, 1, 2)
    pairs = [
        (cell, colour)
        for facet, colour in zip(facets.space.facets.numbers, facets.colours, strict=True)
        for cell in cells_at(facet)
    ]
    assert len(set(pairs)) == len(pairs)
    assert len({cell for cell, _ in pairs}) < len(pairs)  # some cell has two


@cache
def dead():
    """The wall under its own weight, at both fidelities."""
    return [af.dead_load(model, TIGHT) for model in models()]


def test_dead_load_under_which_joints_slide():
    full, slow = dead()
    assert np.mean(np.abs(full.model.memory) > 1e-7) > 0.2
    assert differ(slow.q, full.q) < SOLVED
    assert differ(slow.model.memory, full.model.memory) < SOLVED
    assert slow.iterations == full.iterations


def test_history_in_which_joints_open_and_slide():
    motion = af.Motion.synthetic(duration=4.0, pga=6.0, seed=5).cut(1.0, 1.1)
    given = {"dt": 0.005, "newton": TIGHT, "method": "snes"}
    full, slow = (
        af.time_history(
            start.model, motion, start=start, damping=af.Rayleigh(0.05, (8.0, 16.0)), **given
        )
        for start in dead()
    )
    assert len(full.time) == 21
    for key in ("N", "V", "M"):
        assert differ(slow.joints[key], full.joints[key]) < SOLVED
    for key in ("last_q", "last_velocity"):
        assert differ(slow.dataset[key], full.dataset[key]) < SOLVED
    of_beds = full.joints["friction"].isel(joint=slice(2)).max("time")
    assert of_beds.values == pytest.approx(BED.friction, rel=1e-9)  # all of their points slide
    open_ = ~is_closed(models()[0].operator.effective_gaps(full.dataset["last_q"].values))
    assert 0.0 < open_.mean() < 1.0
