"""Saw teeth and bonds at the joints' points: against laws written anew, differences, balances."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from repeats import each_once

import archfem as af
from archfem.joints.step_average import StepForces

RULES = ("lobatto", "exact")

TURNS = 60
"""In which the rise of teeth over a step is found."""


@cache
def ring(fidelity="rigid", rule="lobatto"):
    """Joints with teeth, with bonds, with both, and bonds that never slide."""
    structure = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7, width=1.3)
    kinds = [
        {"friction": 0.4, "dilatancy": 0.15},
        {"friction": 0.5, "cohesion": 40e3, "tension": 60e3},
        {"friction": 0.5, "cohesion": 80e3, "tension": 30e3, "dilatancy": 0.2},
        {"friction": None, "tension": 50e3},
    ]
    joints = [
        replace(joint, contact=replace(joint.contact, **kinds[k % 4]))
        for k, joint in enumerate(structure.joints)
    ]
    structure = replace(structure, joints=tuple(joints))
    return af.build(structure, fidelity=fidelity, cells=(2, 2), quadrature=rule)


def places(model, seed, size=1e-4):
    """A memory with some bonds broken, and two places; a bond that has slid is broken."""
    random = np.random.default_rng(seed)
    points = model.operator.points
    broken = np.where(random.random(len(points.offset)) < 0.4, 1.0, 0.0) * (points.tension > 0.0)
    free = points.slides & ((broken > 0.0) | (points.tension == 0.0))
    slid = np.where(free, size * random.standard_normal(len(broken)), 0.0)
    first, last = (size * random.standard_normal(model.size) for _ in range(2))
    return model.with_memory(np.concatenate([slid, broken])), first, first + 0.5 * last


def scalar(model, i, gap, slip):
    """Normal and shear force of one spring, how far it has slid and whether it broke, by cases."""
    points, count = model.operator.points, len(model.operator.points.offset)
    slid, broken = model.memory[i], model.memory[count + i]
    contact = points.contact
    area, k_n, k_s = points.weight[i], contact.normal_stiffness[i], contact.shear_stiffness[i]
    bonded = points.tension[i] > 0.0 and not broken
    most = points.tension[i] if bonded else 0.0
    stress = k_n * (gap - points.dilatancy[i] * abs(slid))
    torn = stress > most
    stress = min(stress, most)
    shear = k_s * (slip - slid)
    if not points.slides[i]:
        return area * stress, area * shear, slid, float(broken or (bonded and torn))
    cohesion = contact.cohesion[i] if bonded or points.tension[i] == 0.0 else 0.0
    limit = 0.0 if torn else cohesion - contact.friction[i] * stress
    if abs(shear) > limit:
        slid, torn = slip - np.sign(shear) * limit / k_s, True
        shear = np.sign(shear) * limit
    return area * stress, area * shear, slid, float(broken or (bonded and torn))


def test_a_path_of_springs_is_that_of_scalar_laws():
    """Forces are those of Mohr and Coulomb with a cut-off in tension, in true tractions."""
    model, random = ring(), np.random.default_rng(1)
    count = len(model.operator.points.offset)
    sizes = np.repeat([2e-6, 6e-6, 2e-5, 1e-4], 15)
    before = 0.0
    for size in sizes:
        q = size * random.standard_normal(model.size)
        gaps, slips = model.operator.openings(q), model.operator.slips(q)
        rows = [scalar(model, i, gaps[i], slips[i]) for i in range(count)]
        normal, shear, slid, broken = np.array(rows).T
        found = model.operator.point_forces(q)
        assert found[0] == pytest.approx(normal, rel=1e-10, abs=1e-6)
        assert found[1] == pytest.approx(shear, rel=1e-10, abs=1e-6)
        step = model.begin_step(q, 0.0)  # of no length: there all that is torn breaks
        model = model.with_memory(np.concatenate([model.updated_memory(q)[:count], broken]))
        assert model.memory[:count] == pytest.approx(slid, rel=1e-9, abs=1e-14)
        assert np.array_equal(step.updated_memory(q)[count:], broken)
        assert broken.sum() >= before
        before = broken.sum()
    assert 0 < before <= (model.operator.points.tension > 0.0).sum()


def test_a_bonded_joint_is_linear_elastic_below_its_strength():
    """Facets and springs: N = -k A g, M = k I θ, and the same energy."""
    contact = af.Contact(2e9, 1e9, None, tension=1e6)
    structure = af.column(breadth=1.0, heights=[1.0], width=2.0, contact=contact)
    for rule in RULES:
        model = af.build(structure, fidelity="rigid", quadrature=rule, cells=(3, 1))
        q = np.array([0.0, 1e-4, 3e-4])  # up to 5e5 Pa of tension, and compression
        normal, _, moment = model.resultants(q)[0]
        assert normal == pytest.approx(-2e9 * 2.0 * 1e-4, rel=1e-12)
        assert abs(moment) == pytest.approx(2e9 * 2.0 / 12.0 * 3e-4, rel=1e-12)
        shear = 1e9 * 2.0 * (0.5 * 3e-4) ** 2  # the joint is half a metre below the centroid
        expected = 0.5 * (2e9 * 2.0 * (1e-8 + 9e-8 / 12.0) + shear)
        assert model.energy(q) == pytest.approx(expected, rel=1e-12)
        assert not model.updated_memory(q).any()


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("seed", range(4))
def test_forces_are_the_slope_of_the_energy_where_nothing_slides(rule, seed):
    """Bonds never slide, some are broken: a central difference over 1e-9 m, to 1e-6."""
    contact = af.Contact(1.48e9, 0.3e9, None, tension=60e3)
    structure = af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7, contact=contact
    )
    model = af.build(structure, fidelity="rigid", quadrature=rule, cells=(2, 2))
    random = np.random.default_rng(seed)
    count = len(model.operator.points.offset)
    memory = np.concatenate([np.zeros(count), np.round(random.random(count))])
    model, q = model.with_memory(memory), 1e-4 * random.standard_normal(model.size)
    step = 1e-9 * random.standard_normal(model.size)
    change = model.energy(q + step) - model.energy(q - step)
    assert change == pytest.approx(2.0 * model.force(q) @ step, rel=1e-6)


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))]
)
def test_the_static_tangent_is_the_slope_of_the_forces(fidelity, rule, seed):
    """Linear between changes of status, or smooth: 1e-7 over 1e-10 m."""
    model, q, _ = places(ring(fidelity, rule), seed)
    step = 1e-10 * np.random.default_rng(seed + 50).standard_normal(model.size)
    change = model.force(q + step) - model.force(q - step)
    expected = 2.0 * model.tangent(q) @ step
    assert change == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())


def settled(passage, q):
    """A step whose teeth end where the slip puts them, and the turns that took."""
    for turn in range(TURNS):
        following = passage.with_dilatancy(q)
        if following is passage:
            return passage, turn
        passage = following
    raise AssertionError("teeth do not settle")


@pytest.mark.parametrize(("fidelity", "late"), each_once(("rigid", "faces"), (0.4, 0.0)))
@pytest.mark.parametrize("rule", RULES)
def test_the_work_of_a_step_is_stored_or_lost(fidelity, late, rule):
    """F·Δq = ΔE + lost, and nothing is gained; what teeth miss by 1e-9 may go either way.

    Bonds that break at the end of the step, and what friction pays for the rise, are in.
    """
    broke = rose = 0
    for seed in range(8):
        model, first, last = places(ring(fidelity, rule), seed)
        passage, turns = settled(model.begin_step(first, late), last)
        after = model.with_memory(passage.updated_memory(last))
        work = passage.force(last) @ (last - first)
        stored, lost = after.energy(last) - model.energy(first), passage.dissipation(last)
        scale = np.abs(passage.force(last) * (last - first)).sum()
        assert work == pytest.approx(stored + lost, abs=1e-8 * scale)
        assert lost >= -1e-8 * scale
        count = len(model.operator.points.offset)
        broke, rose = broke + (after.memory - model.memory)[count:].sum(), rose + turns
    assert broke > 10
    assert rose > 10


@pytest.mark.parametrize("late", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_the_tangent_of_a_step_of_springs_is_exact(late, seed):
    """With the end of the teeth given, a central difference over 1e-10 m, to 1e-7."""
    model, first, last = places(ring(), seed)
    passage, _ = settled(model.begin_step(first, late), last)
    step = 1e-10 * np.random.default_rng(7).standard_normal(model.size)
    change = passage.force(last + step) - passage.force(last - step)
    expected = 2.0 * passage.tangent(last) @ step
    assert np.abs(change - expected).max() < 1e-7 * np.abs(expected).max()


def test_a_broken_bond_is_a_dry_joint():
    """Without cohesion, at an instant and over a step, to the last bit."""
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 7}
    for rule in RULES:
        models = [
            af.build(
                af.circular_arch(**given, contact=contact),
                fidelity="rigid",
                quadrature=rule,
                cells=(2, 2),
            )
            for contact in (
                af.Contact(1.48e9, 0.3e9, 0.5, cohesion=50e3, tension=80e3),
                af.Contact(1.48e9, 0.3e9, 0.5),
            )
        ]
        bonded, dry = models
        random, count = np.random.default_rng(3), len(dry.operator.points.offset)
        slid, first, last = (
            1e-4 * random.standard_normal(size) for size in (count, dry.size, dry.size)
        )
        bonded = bonded.with_memory(np.concatenate([slid, np.ones(count)]))
        dry = dry.with_memory(slid)
        assert np.array_equal(bonded.force(first), dry.force(first))
        steps = bonded.begin_step(first, 0.1), dry.begin_step(first, 0.1)
        assert np.array_equal(steps[0].force(last), steps[1].force(last))
        assert np.array_equal(steps[0].updated_memory(last)[:count], steps[1].updated_memory(last))


@pytest.mark.parametrize("slid", [0.0, 5e-3])
@pytest.mark.parametrize("way", [2e-3, 1.55e-4])
def test_teeth_have_settled_at_a_billionth_of_their_rise(slid, way):
    """Of the largest in the step, or of that of an elastic slip, as where points barely slide.

    A block on a level joint is shifted, pressed by 0.05 mm at one end and 0.15 mm at the other.
    """
    contact = af.Contact(2e9, 1e9, 0.5, dilatancy=0.1)
    column = af.column(breadth=1.0, heights=[1.0], contact=contact)
    joints = af.build(column, fidelity="rigid", quadrature="lobatto", cells=(2, 1)).operator
    initial = 0.1 * slid * np.ones(len(joints.points.offset))
    joints = joints.with_memory(initial / 0.1)
    first, last = (
        np.array([slid + shift - 0.5e-4, initial[0] - 1e-4, 1e-4]) for shift in (0.0, way)
    )
    assert joints.slips(last) == pytest.approx(slid + way)
    assert StepForces(joints, first, 0.0).dissipation(first) == pytest.approx(0.0, abs=1e-9)

    def target(rise):
        return 0.1 * np.abs(StepForces(joints, first, 0.0, rise).updated_memory(last))

    begun = StepForces(joints, first, 0.0).with_dilatancy(last)
    assert begun.end_opening == pytest.approx(target(None), rel=1e-12)
    rise = begun.end_opening
    for _ in range(TURNS):
        rise = target(rise)
    elastic = 0.1 * (slid + way) - rise
    bound = 1e-9 * max(np.abs(rise - initial).max(), elastic.max())
    error = np.abs(target(rise + 1e-10) - rise - 1e-10).max()
    for share in (0.98, 1.02):
        step = StepForces(joints, first, 0.0, rise + 1e-10 * share * bound / error)
        assert (step.with_dilatancy(last) is step) is (share < 1.0)
