"""Bonds that soften, against closed forms of a line from their strength to full separation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

import archfem as af
from archfem.joints.step_average import StepForces

STIFFNESS, TENSION, COHESION, FRICTION = 1e9, 50e3, 100e3, 0.5
OPENING_ENERGY, SLIP_ENERGY = 20.0, 60.0
FULL_OPENING, FULL_SLIP = 2.0 * OPENING_ENERGY / TENSION, 2.0 * SLIP_ENERGY / COHESION

BOND = af.Contact(
    STIFFNESS,
    STIFFNESS,
    FRICTION,
    cohesion=COHESION,
    tension=TENSION,
    fracture_energy=OPENING_ENERGY,
    shear_fracture_energy=SLIP_ENERGY,
)


def block(rule="exact", cells=4, contact=BOND):
    """1 m broad, high and wide on a bed of some facets."""
    structure = af.column(breadth=1.0, heights=[1.0], contact=contact)
    return af.build(structure, fidelity="rigid", quadrature=rule, cells=(cells, 2))


def follow(joints, places):
    """Total N and V of the joint at prescribed places, once damage is in balance at each."""
    forces = []
    for q in places:
        # slip and damage that depend on each other converge by their ratio, c² / (2 k_s G) < 0.1
        memory = joints.updated_memory(q)
        while np.abs(memory - joints.memory).max() > 1e-13:
            joints = joints.with_memory(memory)
            memory = joints.updated_memory(q)
        normal, shear = joints.point_forces(q)
        forces.append((normal.sum(), shear.sum()))
    return np.array(forces).T, joints


def shifts(along, across):
    """Coordinates of a block that moves without turning (k, 3)."""
    return np.stack(np.broadcast_arrays(along, across, 0.0), axis=1)


@pytest.mark.parametrize("rule", ["lobatto", "exact"])
def test_opening_is_a_line_from_strength_to_separation_and_takes_the_fracture_energy(rule):
    """t = f (1 - κ / κ_u) with κ = g - t / k; the work to separation is G A."""
    onset = TENSION / STIFFNESS
    gaps = np.append(np.linspace(onset, FULL_OPENING, 12), [0.0, 0.5 * onset, 1.1 * FULL_OPENING])
    gaps.sort()
    (normal, _), _ = follow(block(rule).operator, shifts(0.0, gaps))
    line = TENSION * (FULL_OPENING - gaps) / (FULL_OPENING - onset)
    expected = np.where(gaps < onset, STIFFNESS * gaps, np.maximum(line, 0.0))
    assert normal == pytest.approx(expected, abs=1e-9 * TENSION)
    # trapezoids of a broken line with places at its kinks are exact
    assert trapezoid(normal, gaps) == pytest.approx(OPENING_ENERGY, rel=1e-9)


@pytest.mark.parametrize("rule", ["lobatto", "exact"])
def test_slip_under_pressure_takes_its_fracture_energy_beside_friction(rule):
    """V = μ N + c (1 - κ / κ_u) with κ = s - V / k, under 20 kPa."""
    pressure = 20e3
    peak, rest = COHESION + FRICTION * pressure, FRICTION * pressure
    onset, end = peak / STIFFNESS, FULL_SLIP + rest / STIFFNESS
    slips = np.append(np.linspace(onset, end, 12), [0.0, 0.5 * onset, 1.2 * end])
    slips.sort()
    (_, shear), _ = follow(block(rule).operator, shifts(slips, -pressure / STIFFNESS))
    sliding = slips - peak / STIFFNESS
    line = peak - COHESION / (FULL_SLIP - COHESION / STIFFNESS) * sliding
    expected = np.where(sliding < 0.0, STIFFNESS * slips, np.maximum(line, rest))
    assert np.abs(shear) == pytest.approx(expected, abs=1e-6 * peak)
    beside = trapezoid(np.abs(shear), slips) - rest * (slips[-1] - 0.5 * rest / STIFFNESS)
    assert beside == pytest.approx(SLIP_ENERGY, rel=1e-6)


def test_opening_and_slip_add_to_one_damage():
    """D = κ_n / κ_u + κ_s / s_u: half of each leaves nothing, and lowers both strengths."""
    bed = block().operator
    _, slid = follow(bed, shifts(np.linspace(0.0, 0.5 * FULL_SLIP, 10), -1e-5))
    lost = slid.bonds.damage
    assert lost == pytest.approx(np.abs(slid.irreversible_slip) / FULL_SLIP, rel=1e-8)
    slip, gaps = slid.irreversible_slip[0], np.linspace(0.0, FULL_OPENING, 400)
    (normal, _), opened = follow(slid, shifts(slip, gaps))
    assert normal.max() == pytest.approx(TENSION * (1.0 - lost[0]), rel=0.05)  # steps of 2 µm
    assert normal.max() <= TENSION * (1.0 - lost[0])
    crack = opened.bonds.crack[opened.bonds.damage >= 1.0]
    assert crack == pytest.approx(FULL_OPENING * (1.0 - lost[0]), rel=0.01)  # the last step


@pytest.mark.parametrize("rule", ["lobatto", "exact"])
def test_a_crack_closes_without_pull_and_pulls_again_where_it_ended(rule):
    """Unloading is elastic; faces touch at their drawn place; damage is kept."""
    half = 0.5 * FULL_OPENING
    _, cracked = follow(block(rule).operator, shifts(0.0, np.linspace(0.0, half, 10)))
    crack, damage = cracked.bonds.crack[0], cracked.bonds.damage[0]
    strength = TENSION * (1.0 - damage)
    assert damage == pytest.approx(crack / FULL_OPENING, rel=1e-12)
    stretch = strength / STIFFNESS
    gaps = np.array([half, crack + 0.4 * stretch, crack, 0.5 * crack, 0.0, -1e-5, half])
    expected = np.array([strength, 0.4 * strength, 0.0, 0.0, 0.0, -1e-5 * STIFFNESS, strength])
    (normal, _), after = follow(cracked, shifts(0.0, gaps))
    assert normal == pytest.approx(expected, abs=1e-9 * TENSION)
    assert after.bonds.damage == pytest.approx(damage, rel=1e-12)


@pytest.mark.parametrize("lag", [0.0, 0.3])
@pytest.mark.parametrize("rule", ["lobatto", "exact"])
def test_the_work_of_a_step_is_stored_or_lost(rule, lag):
    """F·Δq = ΔE + lost over random steps that open, slide and close again."""
    joints, random = block(rule).operator, np.random.default_rng(4)
    first, damage = np.zeros(3), 0.0
    for _ in range(30):
        last = 2e-4 * random.standard_normal(3)
        step = StepForces(joints, first, lag)
        after = joints.with_memory(step.updated_memory(last))
        work, stored = step.force(last) @ (last - first), after.energy(last) - joints.energy(first)
        lost = step.dissipation(last)
        scale = np.abs(step.force(last) * (last - first)).sum()
        assert work == pytest.approx(stored + lost, abs=1e-8 * scale + 1e-12)
        assert lost >= -1e-8 * scale - 1e-12
        joints, first = after, last
        assert (joints.bonds.damage >= damage).all()
        damage = joints.bonds.damage
    assert (damage > 0.5).any()


@pytest.mark.parametrize("rule", ["lobatto", "exact"])
def test_the_tangents_are_the_slopes_of_the_forces(rule):
    """At a cracked place, at an instant and over a step: differences over 2e-11 m, to 1e-5."""
    turned = np.linspace(0.0, 1.0, 30)[:, None] * np.array([1e-4, 1e-4, 6e-4])
    _, joints = follow(block(rule).operator, turned)
    assert 0.0 < joints.bonds.damage.max() < 1.0
    model, q = block(rule).with_memory(joints.memory), 0.9 * turned[-1]
    step = 1e-11 * np.random.default_rng(1).standard_normal(3)
    # the step's tangent of facets leaves out how kinks move, and is exact for springs alone
    steps = [model.begin_step(0.5 * turned[-1], 0.2)] if rule == "lobatto" else []
    for subject in (model, *steps):
        change, expected = subject.force(q + step) - subject.force(q - step), 2 * subject.tangent(q)
        expected = expected @ step
        assert np.abs(change - expected).max() < 1e-5 * np.abs(expected).max()


def test_histories_converge_to_the_fracture_energy():
    """Damage grows at the ends of time steps: the excess of work falls with their length."""
    excess = []
    for steps in (25, 50, 100):
        joints, work = block().operator, 0.0
        gaps = np.linspace(0.0, 1.1 * FULL_OPENING, steps + 1)
        for first, last in zip(shifts(0.0, gaps[:-1]), shifts(0.0, gaps[1:]), strict=True):
            step = StepForces(joints, first, 0.0)
            work += step.force(last) @ (last - first)
            joints = joints.with_memory(step.updated_memory(last))
        excess.append(work - OPENING_ENERGY)
    assert 0.0 < excess[2] < 0.03 * OPENING_ENERGY
    ratios = np.array(excess[:2]) / excess[1:]
    assert ratios == pytest.approx(2.0, rel=0.1)


@pytest.mark.slow
def test_a_push_ends_between_brittle_bonds_and_bonds_that_yield():
    """Little energy is the brittle answer, within steps of a tenth; much that of limit analysis.

    Elastic joints let the toe turn, so that much energy ends 4 % below 3.5 of rigid blocks.
    """
    push = af.BodyForce(1.0)

    def peak(**energies):
        bare = replace(BOND, fracture_energy=None, shear_fracture_energy=None)
        return af.pushover(block("exact", 8, replace(bare, **energies)), push).factor

    least = {"fracture_energy": 1.2501, "shear_fracture_energy": 5.0001}
    some = {"fracture_energy": 10.0, "shear_fracture_energy": 50.0}
    brittle, hardly, softening = peak(), peak(**least), peak(**some)
    assert hardly == pytest.approx(brittle, rel=0.1)
    yielding = af.collapse_factor(block().structure, live=push).factor
    assert yielding == pytest.approx(3.5, rel=1e-6)  # (f A + W) b/2 = H h/2
    tough = peak(fracture_energy=1e5)
    assert 0.9 * yielding < tough < yielding
    assert 1.2 * brittle < softening < tough


@pytest.mark.slow
def test_peaks_of_springs_and_facets_converge_to_one():
    """Under 10 N/m and 50 N/m, by 8, 16 and 32 facets: changes fall, and both rules agree."""
    contact = replace(BOND, fracture_energy=10.0, shear_fracture_energy=50.0)
    stop = af.statics.Stop(displacement=2e-3)
    peaks = {
        rule: [
            af.pushover(block(rule, cells, contact), af.BodyForce(1.0), stop=stop).factor
            for cells in (8, 16, 32)
        ]
        for rule in ("lobatto", "exact")
    }
    for found in peaks.values():
        assert abs(found[2] - found[1]) < 0.02 * found[2]
    assert peaks["exact"][2] == pytest.approx(peaks["lobatto"][2], rel=0.02)


@pytest.mark.parametrize(
    ("given", "part"),
    [
        ({"fracture_energy": 1.2}, "not above 1.25 N/m"),
        ({"shear_fracture_energy": 4.9}, "not above 5 N/m"),
        ({"fracture_energy": None}, "give both"),
        ({"tension": 0.0}, "give both"),
    ],
)
def test_energies_that_no_bond_has_are_refused(given, part):
    """The elastic energy at the strength is the least; there is no energy without a bond."""
    with pytest.raises(af.InvalidInput, match=part):
        replace(BOND, **given)


def test_weak_forms_and_large_displacements_refuse_softening_too():
    """As they refuse brittle bonds, in words."""
    structure = block().structure
    with pytest.raises(af.InvalidInput, match="tension"):
        af.build(structure, fidelity="monolithic")
    with pytest.raises(af.InvalidInput, match="tens"):
        af.build(structure, fidelity="rigid", displacements="large")
