"""Friction with memory at the joints' points: against laws written anew, differences, balances."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from repeats import each_once

import archfem as af
from archfem.joints.contact_law import mean_shear_tangent

RULES = ("lobatto", "exact")


@cache
def ring(friction=0.5, cohesion=20e3, fidelity="rigid", rule="lobatto"):
    """Seven stones, with joints that stick and slide within small motions."""
    contact = af.Contact(1.48e9, 0.3e9, friction, cohesion=cohesion)
    structure = af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7, width=1.3, contact=contact
    )
    return af.build(structure, fidelity=fidelity, cells=(2, 2), quadrature=rule)


@cache
def mixed(fidelity="rigid", rule="lobatto"):
    """The same with joints that never slide, without cohesion, and without friction among them."""
    structure = ring().structure
    kinds = [(None, 0.0), (0.4, 0.0), (0.0, 30e3), (0.7, 10e3)]
    joints = [
        replace(
            joint,
            contact=replace(joint.contact, friction=kinds[k % 4][0], cohesion=kinds[k % 4][1]),
        )
        for k, joint in enumerate(structure.joints)
    ]
    structure = replace(structure, joints=tuple(joints))
    return af.build(structure, fidelity=fidelity, cells=(2, 2), quadrature=rule)


@cache
def dead_load(model):
    return af.dead_load(model)


def places(model, seed, size=1e-4):
    """A settled memory, and two places between which points open, close, stick and slide."""
    random = np.random.default_rng(seed)
    dead = dead_load(model)
    before, first, last = (
        dead.q + size * random.standard_normal(model.size) * scale for scale in (1.0, 1.0, 0.7)
    )
    return dead.model.with_memory(dead.model.updated_memory(before)), first, last


def slid_and_held(model, q):
    """Whether any points slide, hold and are open at q."""
    operator = model.operator
    normal, shear = operator.point_forces(q)
    slides = operator.points.slides
    held = np.isclose(shear, operator.trial_shear(q), rtol=1e-9, atol=1e-9)
    return (slides & ~held).any(), (slides & held & (normal < 0.0)).any(), (normal == 0.0).any()


# ---- at an instant


def scalar(points, i, gap, slip, slid):
    """Normal and shear force of one spring, and how far it has slid, written out by cases."""
    contact = points.contact
    area, k_n, k_s = points.weight[i], contact.normal_stiffness[i], contact.shear_stiffness[i]
    normal = area * k_n * gap if gap < 0.0 else 0.0
    shear = area * k_s * (slip - slid)
    if not points.slides[i]:
        return normal, shear, 0.0
    limit = contact.friction[i] * -normal + (contact.cohesion[i] * area if gap <= 0.0 else 0.0)
    if shear > limit:
        return normal, limit, slip - limit / (area * k_s)
    if shear < -limit:
        return normal, -limit, slip + limit / (area * k_s)
    return normal, shear, slid


def test_a_path_of_springs_is_that_of_scalar_return_mappings():
    """Many random motions one after another, each spring followed on its own."""
    model, random = mixed(), np.random.default_rng(1)
    points, count = model.operator.points, len(model.operator.points.offset)
    slid, seen, rest = np.zeros(count), np.zeros(3, bool), dead_load(model).q
    for _ in range(60):
        q = rest + 1e-4 * random.standard_normal(model.size)
        seen |= slid_and_held(model, q)
        openings, slips = model.operator.openings(q), model.operator.slips(q)
        rows = [scalar(points, i, openings[i], slips[i], slid[i]) for i in range(count)]
        normal, shear, slid = np.array(rows).T
        found = model.operator.point_forces(q)
        assert found[0] == pytest.approx(normal, rel=1e-12, abs=1e-6)
        assert found[1] == pytest.approx(shear, rel=1e-12, abs=1e-6)
        model = model.with_memory(model.updated_memory(q))
        assert model.memory == pytest.approx(slid, rel=1e-12, abs=1e-15)
    assert seen.all()


@pytest.mark.parametrize("rule", RULES)
def test_no_point_bears_more_shear_than_friction_holds(rule):
    """Open points bear none: |t| ≤ μ N + c A at every point, to rounding."""
    for seed in range(10):
        model, q, _ = places(mixed(rule=rule), seed)
        operator = model.operator
        normal, shear = operator.point_forces(q)
        closed = operator.law.forces_and_area(operator.openings(q))[1]
        slides = operator.points.slides
        limit = operator.points.contact.cohesion[slides] * closed[slides]
        limit -= operator.points.contact.friction[slides] * normal[slides]
        over = np.abs(shear[slides]) - limit
        assert over.max() <= 1e-12 * np.abs(shear).max()
        apart = slides & (operator.openings(q) > 0.0) & (closed == 0.0)
        assert np.abs(shear[apart]).max(initial=0.0) <= 1e-12 * np.abs(shear).max()


def test_an_updated_memory_holds_without_sliding_further():
    """Once its memory is taken in, the same place gives the same forces, and slides no more."""
    for rule in RULES:
        model, q, _ = places(mixed(rule=rule), 3)
        after = model.with_memory(model.updated_memory(q))
        force = model.force(q)
        assert after.force(q) == pytest.approx(force, abs=1e-12 * np.abs(force).max())
        assert after.updated_memory(q) == pytest.approx(after.memory, abs=1e-12 * 1e-4)


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))]
)
def test_the_static_tangent_is_the_slope_of_the_forces(fidelity, rule, seed):
    """Springs are linear between changes of status: 1e-8 covers rounding over 1e-10 m.

    Facets are smooth, so that central differences err by their square.
    """
    model, q, _ = places(mixed(fidelity, rule), seed)
    seen = slid_and_held(model, q)
    assert seen[0]
    assert seen[1]
    step = 1e-10 * np.random.default_rng(seed + 50).standard_normal(model.size)
    change = model.force(q + step) - model.force(q - step)
    expected = 2.0 * model.tangent(q) @ step
    assert change == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


# ---- over a step


def above(x, limit):
    """Integral of min(max(x, -limit), limit) from 0 to x."""
    return np.where(np.abs(x) <= limit, 0.5 * x**2, limit * np.abs(x) - 0.5 * limit**2)


def mean_held(start, end, limit):
    """Mean of a stop that is driven straight from a traction within its limit to another."""
    return (above(end, limit) - above(start, limit)) / (end - start)


def below(x):
    """Integral of min(x, 0) from 0 to x."""
    return np.where(x < 0.0, 0.5 * x**2, 0.0)


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_a_step_of_springs_is_the_mean_along_its_path(late):
    """Written anew through integrals of <g>_- and of the stop; the area is the time closed.

    Up to 1e-4 c / k_n a joint coheres.
    """
    model, first, last = places(ring(), 4)
    operator, passage = model.operator, model.begin_step(first, late)
    points = operator.points
    gaps = operator.openings(first), operator.openings(last)
    ahead = late * (gaps[1] - gaps[0])
    start, end = gaps[0] + ahead, gaps[1] + ahead
    normal = (
        points.weight
        * points.contact.normal_stiffness
        * (below(end) - below(start))
        / (end - start)
    )
    reach = 1e-4 * points.contact.cohesion / points.contact.normal_stiffness
    closed = (np.minimum(end, reach) - np.minimum(start, reach)) / (end - start)
    limit = -points.contact.friction * normal + points.contact.cohesion * points.weight * closed
    elastic = operator.trial_shear(first), operator.trial_shear(last)
    change = elastic[1] - elastic[0]
    begin = np.clip(elastic[0], -limit, limit)
    shear = mean_held(begin, begin + change, limit) + late * change
    shear = np.clip(shear, -limit, limit)
    slid = operator.slips(last) - np.clip(begin + change, -limit, limit) / points.shear_spring
    force = operator.generalised_force(normal, shear)
    assert passage.force(last) == pytest.approx(force, rel=1e-9, abs=1e-9 * np.abs(force).max())
    assert passage.updated_memory(last) == pytest.approx(slid, abs=1e-9 * np.abs(slid).max())
    sliding = np.abs(begin + change) > limit
    assert sliding.any()
    assert (~sliding).any()
    assert ((closed > 0.0) & (closed < 1.0)).any()


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
@pytest.mark.parametrize("late", [0.0, 0.4])
@pytest.mark.parametrize("rule", RULES)
def test_the_work_of_a_step_is_stored_or_lost(fidelity, late, rule):
    """F·Δq = ΔE + lost to rounding, and nothing is ever gained: random steps from random memories.

    Also from memories that the joints could not hold at the start of the step.
    """
    for seed in range(12):
        model, first, last = places(mixed(fidelity, rule), seed)
        passage = model.begin_step(first, late)
        moved, after = last - first, model.with_memory(passage.updated_memory(last))
        work = passage.force(last) @ moved
        stored = after.energy(last) - model.energy(first)
        lost = passage.dissipation(last)
        scale = np.abs(passage.force(last) * moved).sum()
        assert work == pytest.approx(stored + lost, abs=1e-13 * scale)
        assert lost >= -1e-14 * scale


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
@pytest.mark.parametrize("late", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_the_tangent_of_a_step_of_springs_is_exact(fidelity, late, seed):
    model, first, last = places(mixed(fidelity), seed)
    off = misfit(model, first, last, late)
    assert off < 1e-8


@pytest.mark.parametrize("late", [0.0, 0.4])
def test_the_tangent_of_a_step_of_joints_that_never_slide_is_exact(late):
    model, first, last = places(ring(friction=None, cohesion=0.0), 1)
    assert misfit(model, first, last, late) < 1e-8


@pytest.mark.parametrize("late", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_the_tangent_of_a_step_of_facets_is_that_of_gauss_rule(late, seed):
    """The rule's places move with the openings, which its derivative leaves out: about 1e-3."""
    model, first, last = places(mixed(rule="exact"), seed)
    assert misfit(model, first, last, late) < 1e-2


def test_the_rates_of_a_step_shorter_than_rounding_are_those_of_a_slide():
    """What is held of a force beyond its limit rounds to more than the limit; no point slides more
    than it moves."""
    random = np.random.default_rng(0)
    first, limit = 1e4 * random.standard_normal(2000), 1e4 * random.random(2000)
    for change in (0.0, 1e-320, 1e-13):
        by_change, by_limit = mean_shear_tangent(first, np.full(2000, change), 0.0, limit)
        assert ((by_change >= 0.0) & (by_change <= 0.5)).all()
        assert (np.abs(by_limit) <= 1.0).all()


def misfit(model, first, last, late):
    """Relative difference of a step's tangent from a central difference."""
    passage = model.begin_step(first, late)
    step = 1e-10 * np.random.default_rng(7).standard_normal(model.size)
    change = passage.force(last + step) - passage.force(last - step)
    expected = 2.0 * passage.tangent(last) @ step
    return np.abs(change - expected).max() / np.abs(expected).max()


def test_a_step_bears_no_more_shear_than_friction_holds():
    """|V| ≤ μ N + c A of the means, joint by joint, with A at most the whole area."""
    for rule in RULES:
        for seed in range(10):
            model, first, last = places(ring(rule=rule), seed)
            structure = model.structure
            normal, shear, _ = model.begin_step(first, 0.2).resultants(last).T
            most = 0.5 * normal + 20e3 * structure.depths * structure.width
            assert np.all(np.abs(shear) <= most * (1.0 + 1e-12))
            dry, first, last = places(ring(cohesion=0.0, rule=rule), seed)
            normal, shear, _ = dry.begin_step(first, 0.2).resultants(last).T
            assert np.all(np.abs(shear) <= 0.5 * normal * (1.0 + 1e-12) + 1e-9)


# ---- a loop


def block(friction, cohesion=0.0, rule="lobatto"):
    """A block of 1 m² on a base, 20 kN heavy."""
    contact = af.Contact(1e9, 4e8, friction, cohesion=cohesion)
    structure = af.column(breadth=1.0, heights=[1.0], contact=contact)
    return af.build(structure, fidelity="rigid", quadrature=rule)


@pytest.mark.parametrize(("rule", "cohesion"), each_once(RULES, (0.0, 3e3)))
def test_a_loop_of_even_slip_dissipates_its_area(rule, cohesion):
    """Under constant N a loop of amplitude S is a parallelogram of area 4 Y (S - Y/k).

    Y = μ N + c A. Steps carry on from each other's memory, and their losses add up to the area.
    """
    model, size = block(0.5, cohesion, rule), 1e-4
    dead = af.dead_load(model)
    limit, stiffness = 0.5 * 20e3 + cohesion, 4e8
    across = np.linspace(-size, size, 41)
    model = dead.model.with_memory(dead.model.memory)
    lost, area = 0.0, 0.0
    for turn, path in enumerate([across[20:], across[::-1], across, across[::-1], across]):
        for start, end in pairwise(path):
            first, last = (dead.q + np.array([each, 0.0, 0.0]) for each in (start, end))
            passage = model.begin_step(first, 0.0)
            if turn > 2:  # the loop closes from the second on
                lost += passage.dissipation(last)
                area += passage.force(last)[0] * (end - start)
            model = model.with_memory(passage.updated_memory(last))
    expected = 4.0 * limit * (size - limit / stiffness)
    assert lost == pytest.approx(expected, rel=1e-11)
    assert area == pytest.approx(expected, rel=1e-11)
