"""Dead load by stages: closed forms of columns, balance of forces, and later analyses."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem import InvalidInput
from archfem.masonry import Stage, usual_stages
from archfem.models.construction import PartialStructure
from archfem.statics import self_weight

ROUND_OFF = 1e-9
"""Of solves to 1e-10 of the load."""


@pytest.fixture(scope="module")
def column():
    """Three square courses on a base."""
    return af.column(breadth=1.0, heights=[1.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def bridge():
    """A small bridge with fill in pieces, which holds together a little."""
    ring = af.shapes.Arch(
        measured="centre line", name="arch", span=4.0, rise=1.6, thickness=0.45, voussoirs=11
    )
    wall = {"length": 1.0, "height": 1.2, "above": 0.8}
    whole = af.bridge(
        arches=[ring],
        sidewalls=[
            af.shapes.Sidewall(name="left wall", **wall),
            af.shapes.Sidewall(name="right wall", **wall),
        ],
        backfill=af.shapes.Backfill(cover=0.4),
        paving=af.shapes.Paving(thickness=0.2),
        width=4.0,
    )
    return af.masonry.jointed_fill(whole, 0.8, friction_angle=35.0, cohesion=10e3)


@pytest.fixture(scope="module")
def built(bridge):
    """The bridge of rigid blocks, built in stages with its fill in three layers."""
    model = af.build(bridge, fidelity="rigid", cells=(2, 1), quadrature="exact")
    return af.dead_load(model, stages=usual_stages(bridge, layers=3))


def upward(structure, motions):
    """Vertical displacements of rigid blocks [m]."""
    return motions.reshape(-1, 3)[: len(structure.free), 1]


def one_by_one(structure):
    """A stage for each block that moves."""
    return [Stage(blocks=(number,)) for number in structure.free]


def test_a_column_built_course_by_course(column):
    """Course i of n sinks by i (n - i + 1) W / k after it was placed; forces are those at once."""
    model = af.build(column, fidelity="rigid")
    staged, direct = af.dead_load(model, stages=one_by_one(column)), af.dead_load(model)
    sink = 20e3 / 1.48e9  # of a joint under one course
    assert upward(column, staged.q) == pytest.approx([-3 * sink, -4 * sink, -3 * sink])
    assert upward(column, direct.q) == pytest.approx([-3 * sink, -5 * sink, -6 * sink])
    assert staged.joints["N"].values == pytest.approx([60e3, 40e3, 20e3], rel=ROUND_OFF)


@pytest.mark.parametrize("fidelity", ["faces", "full"])
def test_stresses_of_an_elastic_column_do_not_depend_on_the_order(fidelity):
    """Courses that do not bulge (ν = 0) stay conforming, so that only displacements differ."""
    column = af.column(breadth=1.0, heights=[1.0, 1.0, 1.0], material=af.Material(30e9, 0.0, 20e3))
    model = af.build(column, fidelity=fidelity, cells=(2, 2))
    staged, direct = af.dead_load(model, stages=one_by_one(column)), af.dead_load(model)
    for name in ("N", "V", "M"):
        assert staged.joints[name].values == pytest.approx(
            direct.joints[name].values, rel=1e-6, abs=1e-3
        )
    last, first = (model.cells.stress @ each.q for each in (staged, direct))
    assert last == pytest.approx(first, abs=1e-6 * np.abs(first).max())
    assert not np.allclose(staged.q, direct.q, rtol=0.1)


@pytest.mark.parametrize(
    ("fidelity", "displacements"), [("rigid", "small"), ("faces", "small"), ("rigid", "large")]
)
def test_a_ring_that_leaves_its_centring_stands_as_if_built_at_once(fidelity, displacements):
    """Stones on centring bear nothing; nothing slides, so the way does not matter."""
    glued = af.Contact(1.48e9, 0.30e9, None)
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, contact=glued)
    model = af.build(ring, fidelity=fidelity, cells=(2, 2), displacements=displacements)
    staged = af.dead_load(model, stages=usual_stages(ring))
    direct = af.dead_load(model)
    assert staged.q == pytest.approx(direct.q, abs=1e-7 * np.abs(direct.q).max())


@pytest.mark.slow
def test_a_bridge_built_in_stages_is_in_balance(bridge, built):
    found = built
    weight = self_weight(found.model)
    rest = np.linalg.norm(found.model.force(found.q) - weight)
    assert rest <= 1e-9 * np.abs(weight).sum()
    limits = bridge.friction * found.joints["N"].values + 10e3 * bridge.width * bridge.depths
    assert np.all(np.abs(found.joints["V"].values) <= limits * (1.0 + ROUND_OFF))
    carried = sum(
        sign * (n * bridge.normals[k, 1] - v * bridge.tangents[k, 1])
        for k, (n, v) in enumerate(found.joints[["N", "V"]].to_array().values.T)
        for sign, block in zip((-1.0, 1.0), bridge.pairs[k], strict=True)
        if bridge.blocks[block].fixed
    )
    assert -carried == pytest.approx(bridge.weight, rel=1e-8)


def test_runs_and_modes_start_from_the_built_state(column):
    """A structure at rest stays at rest, though its joints began in different places."""
    model = af.build(column, fidelity="rigid")
    dead = af.dead_load(model, stages=one_by_one(column))
    still = af.Motion.synthetic(duration=0.25, pga=1e-9, seed=1)
    run = af.time_history(model, still, start=dead, method="snes", dt=0.005)
    assert run.joints["N"].values[-1] == pytest.approx([60e3, 40e3, 20e3], rel=1e-6)
    closed = af.modes(model, 3, "closed")
    assert af.modes(dead.model, 3, start=dead).frequencies == pytest.approx(closed.frequencies)
    sides = af.pushover(model, af.BodyForce(1.0), start=dead)
    assert sides.limit == pytest.approx(1.0 / 3.0, rel=2e-2)  # of breadth to height


@pytest.mark.parametrize("displacements", ["small", "large"])
def test_supports_that_moved_do_so_after_building(column, displacements):
    model = af.build(column, fidelity="rigid", displacements=displacements)
    model = model.settled(af.Settlement(0, (0.0, -0.01, 0.0)))
    staged = af.dead_load(model, stages=one_by_one(column))
    sink = 20e3 / 1.48e9
    expected = np.array([-3 * sink, -4 * sink, -3 * sink]) - 0.01
    assert upward(column, staged.q) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("fidelity", "cells"), [("rigid", (2, 1)), pytest.param("full", (1, 1), marks=pytest.mark.slow)]
)
def test_blocks_that_move_far_go_on_from_where_they_were_built(fidelity, cells):
    """Courses sink as if displacements were small, and then stay at rest."""
    column = af.column(breadth=1.0, heights=[1.0, 1.0, 1.0], material=af.Material(30e9, 0.0, 20e3))
    given = {"fidelity": fidelity, "cells": cells}
    small, large = (
        af.dead_load(af.build(column, displacements=each, **given), stages=one_by_one(column))
        for each in ("small", "large")
    )
    for name in ("N", "opening"):
        scale = abs(small.joints[name].values).max()
        assert large.joints[name].values == pytest.approx(
            small.joints[name].values, abs=1e-8 * scale
        )
    still = af.Motion.synthetic(duration=0.25, pga=1e-9, seed=1).cut(0.0, 0.05)
    for method in ("newton", "snes"):
        model = af.build(column, displacements="large", **given)
        run = af.time_history(model, still, start=large, method=method, dt=0.005)
        assert run.joints["N"].values[-1] == pytest.approx([60e3, 40e3, 20e3], rel=1e-6)


@pytest.mark.slow
def test_a_bridge_built_in_stages_is_in_balance_where_it_has_moved(bridge, built):
    """Its joints carry forces near those of small displacements."""
    given = {"fidelity": "rigid", "cells": (2, 1), "quadrature": "exact"}
    large = af.build(bridge, displacements="large", **given)
    near, far = built, af.dead_load(large, stages=usual_stages(bridge, layers=3))
    rest = np.linalg.norm(far.model.force(far.q) - self_weight(far.model))
    assert rest <= 1e-9 * bridge.weight
    direct = af.dead_load(large)
    apart, between_ways = (
        np.abs(each.joints["N"].values - far.joints["N"].values).max() for each in (near, direct)
    )
    assert apart < 0.05 * between_ways


def test_usual_stages_of_a_bridge(bridge):
    stages = usual_stages(bridge, layers=3)
    assert [stage.name for stage in stages] == [
        "piers and walls", "rings", "centring struck", "fill, layer 1", "fill, layer 2",
        "fill, layer 3", "parts on the fill",
    ]  # fmt: skip
    placed = [number for stage in stages for number in stage.blocks]
    assert sorted(placed) == list(bridge.free)


@pytest.mark.parametrize(
    ("stages", "words"),
    [
        ([Stage(blocks=(1, 2))], r"no stage places \['.*'\]"),
        ([Stage(blocks=(1,)), Stage(blocks=(1, 2, 3))], "stand already"),
        ([Stage(blocks=(1, 2, 3), centring=True)], "never struck"),
        ([Stage(blocks=("cours",))], "there is no block or part 'cours'"),
        ([Stage(blocks=(0,))], "is fixed"),
    ],
)
def test_stages_that_build_nothing_are_refused(column, stages, words):
    model = af.build(column, fidelity="rigid")
    with pytest.raises(InvalidInput, match=words):
        af.dead_load(model, stages=stages)


@pytest.mark.slow
def test_a_stage_that_cannot_stand_is_named():
    """Fill without its walls' weight, placed as one ring without centring, falls at once."""
    ring = af.circular_arch(radius=1.0, thickness=0.08, embrace=180.0, voussoirs=4, chords=1)
    with pytest.raises(af.DidNotConverge, match="'centring struck'"):
        af.dead_load(af.build(ring, fidelity="rigid"), stages=usual_stages(ring))


@pytest.mark.parametrize(("friction", "tension"), [(None, 0.0), (0.6, 2e4)])
def test_forces_on_placed_blocks_are_the_slope_of_their_energy(column, friction, tension):
    """By central differences: two courses of three whose joints open and shear, and do not slide.

    A millionth of the largest force: steps of 1e-9 m lose 1e-16 of the energy over 1e-9 m.
    """
    contact = af.Contact(1.48e9, 0.30e9, friction, cohesion=5e4, tension=tension)
    joints = tuple(replace(joint, contact=contact) for joint in column.joints)
    site = PartialStructure(af.build(replace(column, joints=joints), fidelity="rigid"))
    site = site.placed([1], np.zeros(site.size)).placed([2], np.zeros(site.size))
    q = 1e-6 * np.array([1.0, -20.0, 1.0, 2.0, -19.0, -9.0, 0.0, 0.0, 0.0])
    steps = 1e-9 * np.eye(site.size)[:6]
    slope = [(site.energy(q + step) - site.energy(q - step)) / 2e-9 for step in steps]
    force = site.force(q)
    assert slope == pytest.approx(force[:6], abs=1e-6 * np.abs(force).max())
    assert np.abs(force[:6]).min() > 1e-3 * np.abs(force).max()


def test_the_tangent_is_that_of_placed_blocks_and_holds_the_others(column):
    """Central differences of forces of the lower two courses; the third is on springs alone."""
    contact = af.Contact(1.48e9, 0.30e9, None)
    joints = tuple(replace(joint, contact=contact) for joint in column.joints)
    model = af.build(replace(column, joints=joints), fidelity="faces")
    site = PartialStructure(model)
    site = site.placed([1], np.zeros(site.size)).placed([2], np.zeros(site.size))
    q = -1e-6 * np.linspace(1.0, 2.0, site.size)
    tangent = site.tangent(q).toarray()
    steps = 1e-10 * np.eye(site.size)
    slopes = np.array([(site.force(q + step) - site.force(q - step)) / 2e-10 for step in steps])
    assert tangent == pytest.approx(slopes.T, abs=1e-5 * tangent.max())
    energies = [(site.energy(q + step) - site.energy(q - step)) / 2e-10 for step in steps]
    placed = np.isin(model.cells.block, [1, 2])
    free = abs(model.cells.shape_functions[np.repeat(placed, 2)]).sum(axis=0).A1 > 0.0
    force = site.force(q)
    assert np.array(energies)[free] == pytest.approx(force[free], abs=1e-5 * abs(force).max())
    held = tangent[~free]
    assert np.count_nonzero(held) == len(held)
    assert np.count_nonzero(tangent[:, ~free]) == len(held)


@pytest.mark.parametrize(
    ("count", "words"), [(5, "'block 4', 'block 5']: every"), (6, "'block 5'] and 1 more: every")]
)
def test_blocks_that_no_stage_places_are_named_up_to_five(count, words):
    tower = af.column(breadth=1.0, heights=[1.0] * (count + 1))
    stages = [Stage(blocks=(count + 1,))]
    with pytest.raises(InvalidInput) as caught:
        af.dead_load(af.build(tower, fidelity="rigid"), stages=stages)
    assert "no stage places ['block 1', 'block 2', 'block 3', 'block 4'" in str(caught.value)
    assert words in str(caught.value)


def test_fill_is_placed_in_layers_of_equal_height(bridge):
    """By the heights of its pieces, from the lowest to the highest of them."""
    soil = {n: bridge.blocks[n].centroid[1] for n in bridge.free if bridge.blocks[n].grain}
    low, high = min(soil.values()), max(soil.values())
    layers = [each for each in usual_stages(bridge, layers=3) if "layer" in each.name]
    assert sum(len(each.blocks) for each in layers) == len(soil)
    for k, each in enumerate(layers):
        own = [(soil[n] - low) / (high - low) for n in each.blocks]
        assert k / 3 <= min(own) + 1e-12
        assert max(own) <= (k + 1) / 3 + 1e-12
    assert [each.centring for each in usual_stages(bridge)].count(True) == 1


@pytest.mark.parametrize("displacements", ["small", "large"])
def test_a_state_has_its_own_gaps_on_a_model_that_was_built_otherwise(displacements):
    """Built in stages or in one go: the first joints of a path are those of the state itself."""
    piers = af.arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=3, pier_breadth=1.2, courses=[0.8, 0.8]
    )
    model = af.build(piers, fidelity="rigid", displacements=displacements)
    states = [af.dead_load(model, stages=stages) for stages in (None, usual_stages(piers))]
    assert np.abs(states[1].model.initial_gaps).max() > 1e-6
    for state, other in (states, states[::-1]):
        path = af.pushover(
            other.model, af.BodyForce(0.1), start=state, stop=af.statics.Stop(steps=1)
        )
        for name in ("N", "V", "M"):
            found, expected = path.joints[name].values[0], state.joints[name].values
            assert found == pytest.approx(expected, abs=1e-9 * piers.weight)
