"""Joints that dilate and bonds that break, at rest: against closed forms of blocks on a bed."""

from functools import cache

import numpy as np
import pytest
from repeats import each_once

import archfem as af
from archfem.statics import Equilibrium
from archfem.statics.continuation import LoadPath
from archfem.statics.newton import EquilibriumSolver
from archfem.statics.relaxation import solve_irreversible

WEIGHT, STIFFNESS, TENSION = 20e3, 1e9, 50e3


@cache
def block(fidelity="rigid", rule="exact", height=1.0, cells=4, **given):
    """1 m broad and wide, on a bed of some facets; 20 kN for each metre of height."""
    contact = af.Contact(STIFFNESS, STIFFNESS, **given)
    structure = af.column(breadth=1.0, heights=[height], contact=contact)
    return af.build(structure, fidelity=fidelity, quadrature=rule, cells=(cells, 2))


def bonded(fidelity="rigid", rule="exact"):
    return block(fidelity, rule, friction=0.5, cohesion=2.0 * TENSION, tension=TENSION)


def under(model, horizontal, vertical, start=None):
    """Equilibrium under multiples of the weight, from rest or with the memory of a start."""
    load = model.load(af.BodyForce(horizontal, vertical))
    if start is not None:
        model = model.with_memory(start.model.memory)
    return af.statics.equilibrium_under(model, load)


def broken(state):
    """Which bonds are broken, one number a joint point."""
    memory = state.model.memory
    return memory[len(memory) // 2 :]


@pytest.mark.parametrize(
    ("fidelity", "rule"),
    [
        ("rigid", "lobatto"),
        pytest.param("rigid", "exact", marks=pytest.mark.slow),
        pytest.param("faces", "lobatto", marks=pytest.mark.slow),
        pytest.param("faces", "exact", marks=pytest.mark.slow),
    ],
)
def test_a_bond_carries_pure_tension_up_to_its_strength(fidelity, rule):
    """f_t A = 50 kN, pulled upward: at 0.999 it hangs, unbroken; at 1.001 it flies away."""
    model, most = bonded(fidelity, rule), TENSION / WEIGHT
    state = under(model, 0.0, 0.999 * most)
    assert not broken(state).any()
    assert float(state.joints["N"][0]) == pytest.approx(-0.999 * TENSION, rel=1e-9)
    assert not bool(state.joints["open"][0])
    with pytest.raises(af.DidNotConverge):
        under(model, 0.0, 1.001 * most)


@pytest.mark.parametrize("rule", ["lobatto", pytest.param("exact", marks=pytest.mark.slow)])
@pytest.mark.parametrize("fidelity", ["rigid", pytest.param("faces", marks=pytest.mark.slow)])
def test_a_bonded_bed_breaks_where_its_edge_reaches_the_strength(fidelity, rule):
    """Weight and a push at mid-height: -W / A + 6 M / (w b²) = f_t, with M = H h / 2.

    At 0.999 of that nothing breaks; at 1.001 the edge does. Facets then tear through, and the
    block falls, since dry it resists H h / 2 = W b / 2 alone; so it does at 1.3 between springs,
    of which the next one is farther from the edge.
    """
    model = bonded(fidelity, rule)
    most = (TENSION + WEIGHT) / 6.0 / (0.5 * WEIGHT)
    assert not broken(under(model, 0.999 * most, -1.0)).any()
    assert 0.5 * most > 0.5  # beyond what dry blocks resist
    if rule == "lobatto":
        assert broken(under(model, 1.001 * most, -1.0)).any()
    with pytest.raises(af.DidNotConverge):
        under(model, (1.001 if rule == "exact" else 1.3) * most, -1.0)


def test_the_factor_of_a_pushover_is_its_peak_where_bonds_break():
    """By hand 7/6: -W / A + 6 M / (w b²) = f_t; steps grow by a tenth. Dry, it tips at 1/2."""
    push = af.pushover(bonded(), af.BodyForce(1.0))
    assert 7.0 / 6.0 / 1.1 < push.factor <= 7.0 / 6.0
    assert float(push.curve["factor"][-1]) == pytest.approx(0.5, rel=1e-6)
    assert f"factor {push.factor:.4g} after" in str(push)
    assert "at the end 0.5, " in str(push)


@pytest.mark.parametrize("control", ["displacement", "arc length", "path", "force"])
def test_bonds_that_break_one_by_one_leave_the_dry_arch(control):
    """After a break the arch pushes back until its dry joints bear: no less than they do alone."""

    def ring(**bond):
        contact = af.Contact(1e10, 4e9, 0.75, **bond)
        return af.circular_arch(span=4.0, rise=2.0, thickness=0.24, voussoirs=9, contact=contact)

    dry = af.collapse_factor(ring(), live=af.BodyForce(1.0)).factor
    model = af.build(ring(tension=80e3, cohesion=160e3), fidelity="rigid")
    stop = af.statics.Stop(displacement=0.02)
    push = af.pushover(model, af.BodyForce(1.0), control=control, stop=stop)
    factors = push.curve["factor"].values
    assert control == "force" or factors.min() < 0.0 < factors[-1]
    assert push.factor > dry
    assert push.outcome.startswith("the load moved by")


@pytest.mark.parametrize("control", ["displacement", "path"])
def test_a_bond_without_which_nothing_stands_ends_the_load(control):
    """A block of 0.5 m glued to a wall, by hand: W (1 + λ) 0.25 m = f_t w b² / 6; then it falls."""
    wall, stone = (
        af.Block(((x, 0), (x + 0.5, 0), (x + 0.5, 1), (x, 1)), af.STONE, str(x), fixed=x < 0)
        for x in (-0.5, 0.0)
    )
    contact = af.Contact(STIFFNESS, STIFFNESS, 0.6, cohesion=1e6, tension=2e5)
    bed = af.Joint((0, 1), (0.0, 1.0), (0.0, 0.0), contact, "bed")
    structure = af.Structure((wall, stone), (bed,))
    push = af.pushover(af.build(structure, fidelity="rigid"), af.BodyForce(0.0, -1.0),
                       control=control)  # fmt: skip
    most = 2e5 / 6.0 / (0.25 * structure.weight) - 1.0
    assert most / 1.1 < push.factor <= most
    assert push.outcome == "it bears no load any more"
    assert np.isnan(push.limit)


def cracked(moment, tension):
    """Depth that still bears and turn of a bed of 1 m under its weight and a moment, by hand [m].

    Stress is straight, from f_t at the tip of the crack to the other edge, where it is s:
    N = (s - f_t) d / 2,  M - N (1 - d) / 2 = (s + f_t) d² / 12,  θ = (s + f_t) / (k d).
    """
    roots = np.roots([tension, -2.0 * WEIGHT, 3.0 * WEIGHT - 6.0 * moment])
    depth = float(roots.min())
    return depth, (2.0 * WEIGHT / depth + 2.0 * tension) / (STIFFNESS * depth)


@pytest.mark.parametrize("fidelity", ["rigid", pytest.param("faces", marks=pytest.mark.slow)])
def test_a_crack_stops_where_the_rest_bears_the_load(fidelity):
    """f_t = 10 kPa, M = 6 kN m: a crack of a quarter of the depth, to one of 32 facets.

    The turn is that of the part that bears, to 3 %; a dry bed, which is open farther, turns more.
    Cohesion is so large that no bond breaks by shear, which is 12 kPa, nor dry does it slide.
    """
    given = {"friction": 0.9, "cohesion": 60e3, "cells": 32}
    state = under(block(fidelity, tension=10e3, **given), 0.6, -1.0)
    depth, turn = cracked(6e3, 10e3)
    assert 0.7 < depth < 0.8
    assert np.mean(broken(state)) == pytest.approx(1.0 - depth, abs=1.0 / 32.0)
    turned = abs(float(state.joints["rotation"][0]))
    assert turned == pytest.approx(turn, rel=0.03)
    dry = under(block(fidelity, **given), 0.6, -1.0)
    assert turned < 0.95 * abs(float(dry.joints["rotation"][0]))
    for key in ("N", "V", "M"):
        assert float(state.joints[key][0]) == pytest.approx(float(dry.joints[key][0]), rel=1e-8)


def test_broken_bonds_stay_broken():
    """Unloaded and loaded again, to what a fresh bed bears unbroken, it turns more than that."""
    model = block(friction=0.9, cohesion=60e3, tension=10e3, cells=16)
    first = under(model, 0.6, -1.0)
    rest = under(model, 0.0, -1.0, first)
    again = under(model, 0.45, -1.0, rest)
    assert broken(first).any()
    assert np.array_equal(broken(first), broken(rest))
    assert np.array_equal(broken(first), broken(again))
    fresh = under(model, 0.45, -1.0)
    assert not broken(fresh).any()
    turned = [abs(float(each.joints["rotation"][0])) for each in (again, fresh)]
    assert turned[0] > 1.01 * turned[1]


def test_rigid_blocks_and_faces_break_equally():
    """A joint that is statically determinate: the same bonds, forces to 1e-9."""
    states = [
        under(block(each, friction=0.9, cohesion=20e3, tension=10e3), 0.55, -1.0)
        for each in ("rigid", "faces")
    ]
    assert broken(states[0]).any()
    assert np.array_equal(*(broken(each) for each in states))
    for key in ("N", "V", "M"):
        forces = [float(each.joints[key][0]) for each in states]
        assert forces[1] == pytest.approx(forces[0], rel=1e-9)


def test_shear_breaks_a_bond_and_takes_its_cohesion():
    """A plate of W = 200 N: up to μ W + c A = 20.2 kN, then, pushed on, μ W = 200 N alone.

    The push at mid-height tilts the stress by 3 %, so that one edge goes that much earlier.
    """
    given = {"height": 0.01, "rule": "lobatto", "friction": 1.0, "cohesion": 20e3}
    model, weight = block(**given, tension=5e3), 200.0
    limit = (weight + 20e3) / weight
    assert not broken(under(model, 0.95 * limit, -1.0)).any()
    with pytest.raises(af.DidNotConverge):
        under(model, 1.001 * limit, -1.0)
    path = pushed(model, af.dead_load(model), 1.0, 1e-4)
    assert 0.7 * limit < max(path.factors) < limit  # in steps of a quarter of it
    assert path.factors[-1] == pytest.approx(1.0, rel=1e-6)


# ---- saw teeth


TEETH = {"friction": 0.5, "dilatancy": 0.2}


def pushed(model, start, way, distance, steps=20):
    """Push a block by its weight's multiple until it has moved so far."""
    path = LoadPath.of(model, [af.BodyForce(way, 0.0)], start)
    units = distance / steps / path.unit[0]
    for _ in range(steps):
        assert path.advance(np.array([1.0, 0.0]), units)
    return path


def let_go(path):
    """The block at rest where it was left, under its weight alone."""
    model, solved = solve_irreversible(
        EquilibriumSolver(path.model.size), path.model, path.dead, path.states[-1]
    )
    return Equilibrium(model, solved.q, 0, 0)


@pytest.mark.parametrize(("fidelity", "rule"), each_once(("rigid", "faces"), ("lobatto", "exact")))
def test_a_shear_box_rises_and_falls_on_its_teeth(fidelity, rule):
    """Under constant N: tan ψ × slip up, either way, and back to nothing at the start.

    The resistance is μ N both ways, up and down. Beside the teeth the bed is only as much closed
    as the weight closes it, 2 kN / 1e9 N/m, at mid-depth; points slide alike to their elastic
    slips, 1e-6 m.
    """
    model = block(fidelity, rule, height=0.1, **TEETH)
    dead = af.dead_load(model)
    closed, slid = -2e3 / STIFFNESS, []
    for way, distance in ((1.0, 1e-3), (-1.0, 1.1e-3), (-1.0, 1e-3)):
        path = pushed(model, dead, way, distance)
        memory = path.model.memory
        gap = path.faces[-1, 0, 0] if path.faces.ndim == 3 else path.faces[-1, 0]
        slid.append(float(memory.mean()))
        assert np.ptp(memory) < 1e-6
        assert path.factors[-1] == pytest.approx(0.5, rel=1e-4)
        assert gap - closed == pytest.approx(0.2 * np.abs(memory).mean(), abs=2e-9)
        dead = let_go(path)
        model = dead.model
    assert slid[0] == pytest.approx(1e-3, rel=2e-3)  # less the elastic slip, 1e-6 m
    assert abs(slid[1]) < 0.12e-3
    assert slid[2] < -0.9e-3


def test_a_block_between_two_beds_presses_on_both_as_it_rises():
    """No room to rise: N = k_n tan ψ s at each bed, and H = 2 μ N, to 1 % in 100 steps.

    In a step points slide against the force that teeth had left, and ride up then: where those
    press harder for it, the error is of first order, one step in a hundred.
    """
    errors = [confined(steps) for steps in (25, 100)]
    assert errors[1] == pytest.approx(-0.01, rel=0.01)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.01)


def confined(steps):
    """Error of H for a block that is pushed by 1 mm between two fixed ones, relative."""
    contact = af.Contact(STIFFNESS, STIFFNESS, **TEETH)
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.1), (0.0, 0.1))
    outlines = [tuple((x, y + 0.1 * k) for x, y in square) for k in range(3)]
    blocks = tuple(
        af.Block(outline, af.STONE, f"block {k}", fixed=k != 1, role="pier")
        for k, outline in enumerate(outlines)
    )
    joints = tuple(
        af.Joint((k, k + 1), (0.0, y), (1.0, y), contact, f"bed {k}", role="pier")
        for k, y in enumerate((0.1, 0.2))
    )
    model = af.build(af.Structure(blocks, joints), fidelity="rigid", quadrature="lobatto")
    path = pushed(model, af.dead_load(model), 1.0, 1e-3, steps)
    slid = np.abs(path.model.memory).mean()
    expected = 2.0 * TEETH["friction"] * STIFFNESS * TEETH["dilatancy"] * slid
    return path.factors[-1] * 2e3 / expected - 1.0


def test_stability_is_not_said_to_rest_on_bonds():
    """Bonds break and do not yield; `collapse_factor` alone lets them yield, with a warning."""
    ring = bonded().structure
    for analysis in (
        af.stands,
        lambda ring: af.collapse_factor(ring, live=af.Settlement(0, (0.1, 0.0, 0.0))),
        lambda ring: af.moving_load(ring, [1e3]),
    ):
        with pytest.raises(af.InvalidInput, match="bonds break"):
            analysis(ring)


def test_limit_analysis_warns_of_teeth_that_it_leaves_out(caplog):
    structure = block(height=0.1, **TEETH).structure
    found = af.collapse_factor(structure, live=af.BodyForce(1.0, 0.0), friction="nonassociated")
    assert found.factor == pytest.approx(0.5, rel=1e-6)
    assert "joints dilate by up to 0.2" in caplog.text


def test_weak_forms_name_a_fidelity_with_teeth_and_bonds():
    for given in (TEETH, {"friction": None, "tension": 1e3}):
        structure = block(height=0.1, **given).structure
        with pytest.raises(af.InvalidInput, match="use 'full'"):
            af.build(structure, fidelity="monolithic")


def test_bonds_of_a_structure_that_is_built_in_stages():
    """A stack of two: laid one on the other it stands, unbroken, as built in one go."""
    contact = af.Contact(STIFFNESS, STIFFNESS, 0.5, cohesion=1e5, tension=TENSION)
    structure = af.column(breadth=1.0, heights=[1.0, 1.0], contact=contact)
    model = af.build(structure, fidelity="rigid")
    staged = af.dead_load(model, stages=af.masonry.usual_stages(structure))
    whole = af.dead_load(model)
    assert not staged.model.memory.any()
    assert staged.joints["N"].values == pytest.approx(whole.joints["N"].values, rel=1e-9)
