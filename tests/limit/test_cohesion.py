"""Cohesion of joints in limit analysis: on single blocks, and in joints that open."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from kinematics import gaps
from scipy.optimize import brentq

import archfem as af
from archfem.joints.contact_law import COHESIVE_OPENING
from archfem.joints.criteria import with_failure_flags
from archfem.limit import End, Outcome, closed_cohesion, nonassociated
from archfem.limit.collapse import warn_cohesion

EXACT = 1e-7
"""Relative: the programme is solved to 1e-9 block weights."""

SIDEWAYS = af.BodyForce(1.0)
SLIDING = ["coulomb", "nonassociated"]


@pytest.fixture(autouse=True)
def few_starts(monkeypatch):
    """Searches without dilatancy start from the associated state and five others, not forty."""
    monkeypatch.setattr(nonassociated, "MAX_START_COUNT", 5)


def glued(cohesion, friction=0.4):
    return replace(af.masonry.STONE_TO_STONE, friction=friction, cohesion=cohesion)


def block_on_incline(slope, contact, breadth=1.2, height=0.3, width=0.7):
    """A block on a fixed one whose face rises to the right by `slope` radians."""
    turn = np.array([[np.cos(slope), np.sin(slope)], [-np.sin(slope), np.cos(slope)]])
    corners = np.array([[0.0, 0.0], [breadth, 0.0], [breadth, height], [0.0, height]])
    blocks = [
        af.Block(
            tuple(map(tuple, (corners + np.array([0.0, y])) @ turn)), af.STONE, name, fixed=y < 0.0
        )
        for name, y in (("bed", -height), ("block", 0.0))
    ]
    return replace(af.masonry.assembled(blocks, contact), width=width)


@pytest.mark.parametrize("friction", SLIDING)
@pytest.mark.parametrize(
    "cohesion",
    [0.0, pytest.param(0.5 * af.units.kPa, marks=pytest.mark.slow), 1.0 * af.units.kPa],
)
def test_a_pushed_block_slides_at_its_friction_and_cohesion(friction, cohesion):
    """λ W = μ W + c A, well before it overturns at breadth over height, 4."""
    structure = block_on_incline(0.0, glued(cohesion))
    found = af.collapse_factor(structure, live=SIDEWAYS, friction=friction)
    area = 1.2 * 0.7
    assert found.factor == pytest.approx(0.4 + cohesion * area / structure.weight, rel=EXACT)
    assert found.sliding == (0,)
    assert found.hinges == ()


@pytest.mark.parametrize("friction", SLIDING)
@pytest.mark.parametrize("downhill", [True, False])
def test_a_block_pushed_along_an_incline(friction, downhill):
    """Along the face ±W sin α + λ W cos α = c A + μ (W cos α ∓ λ W sin α), downhill above."""
    slope, cohesion, mu = 0.2, 0.8 * af.units.kPa, 0.4
    structure = block_on_incline(slope, glued(cohesion, mu))
    push = af.BodyForce(-1.0 if downhill else 1.0)
    found = af.collapse_factor(structure, live=push, friction=friction)
    held = cohesion * 1.2 * 0.7 / structure.weight
    sense = 1.0 if downhill else -1.0
    sine, cosine = sense * np.sin(slope), np.cos(slope)
    by_hand = (held + mu * cosine - sine) / (cosine + mu * sine)
    assert found.factor == pytest.approx(by_hand, rel=EXACT)
    assert found.sliding == (0,)


def test_cohesion_holds_a_block_on_a_steep_incline():
    """It stands where W sin α <= μ W cos α + c A."""
    slope, mu = 0.6, 0.4
    weight = block_on_incline(slope, glued(0.0)).weight
    needed = weight * (np.sin(slope) - mu * np.cos(slope)) / (1.2 * 0.7)
    assert not af.stands(block_on_incline(slope, glued(0.0, mu)))
    assert not af.stands(block_on_incline(slope, glued(0.999 * needed, mu)))
    assert af.stands(block_on_incline(slope, glued(1.001 * needed, mu)))


def test_a_block_glued_between_walls_lifts_at_its_weight_and_both_faces():
    """Walls that do not press hold it by cohesion alone, without dilatancy: W + 2 c A."""
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    blocks = [
        af.Block(tuple(map(tuple, square + np.array([x, 0.0]))), af.STONE, name, fixed=x != 0.0)
        for x, name in ((0.0, "block"), (-1.0, "left"), (1.0, "right"))
    ]
    cohesion = 3.0 * af.units.kPa
    structure = af.masonry.assembled(blocks, glued(cohesion))
    lift = af.PointLoad(0.5, (0.0, 1.0))
    assert af.collapse_factor(structure, live=lift).outcome is Outcome.UNBOUNDED
    found = af.collapse_factor(structure, live=lift, friction="nonassociated")
    assert found.outcome is Outcome.COLLAPSES
    assert found.factor == pytest.approx(structure.weight + 2.0 * cohesion, rel=1e-6)


def test_the_mechanism_pays_for_cohesion():
    """Upper theorem: live work is that of the weights, and c A on every slip."""
    contact = glued(2.0 * af.units.kPa, 0.35)
    structure = af.circular_arch(
        radius=3.0, thickness=0.8, embrace=120.0, voussoirs=9, contact=contact
    )
    push = af.PointLoad(0.0, (-1e3, 0.0))
    dry = af.circular_arch(
        radius=3.0, thickness=0.8, embrace=120.0, voussoirs=9, contact=replace(contact, cohesion=0)
    )
    found = af.collapse_factor(structure, live=push)
    assert found.sliding
    assert found.factor > 1.05 * af.collapse_factor(dry, live=push).factor
    number, point = push.place(structure)
    arm = point - structure.blocks[number].centroid
    work = push.force[0] * (found.motion[number, 0] - found.motion[number, 2] * arm[1])
    weights = [b.area * b.material.unit_weight * structure.width for b in structure.blocks]
    slips = np.abs(gaps(structure, found.motion)[:, 2])
    lost = 2.0 * af.units.kPa * structure.width * structure.depths @ slips
    assert found.factor * work == pytest.approx(weights @ found.motion[:, 1] + lost, rel=1e-6)


def test_joints_that_never_slide_are_left_out_without_dilatancy():
    """A block that cannot slide overturns, at breadth over height."""
    structure = block_on_incline(0.0, glued(0.0, None), breadth=0.3, height=1.2)
    for friction in SLIDING:
        found = af.collapse_factor(structure, live=SIDEWAYS, friction=friction)
        assert found.factor == pytest.approx(0.25, rel=EXACT)


@pytest.mark.slow
def test_a_support_moves_as_far_with_enough_cohesion_as_without_sliding():
    def spread(cohesion, friction="coulomb"):
        contact = glued(cohesion, 0.45)
        structure = af.circular_arch(
            radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7, contact=contact
        )
        apart = af.Settlement("left abutment", (-4.0, 0.0, 0.0))
        return af.limit.largest_movement(structure, apart, friction=friction, tolerance=1e-3)

    dry, held, never = spread(0.0), spread(20.0 * af.units.kPa), spread(0.0, None)
    assert dry.end is End.SLIDES
    assert dry.largest < held.largest == never.largest
    assert held.end is never.end is End.FALLS


# ---- verdicts obey the joints' own law


def held_block(angle, friction, cohesion):
    """A low block on a face that rises to the right, at rest on a stiff joint."""
    contact = af.Contact(1e10, 4e9, friction, cohesion=cohesion)
    bare = block_on_incline(angle, contact)
    blocks = tuple(replace(block, role="pier") for block in bare.blocks)
    return replace(bare, blocks=blocks, joints=tuple(replace(j, role="pier") for j in bare.joints))


@pytest.mark.parametrize("factor", [1.0 + 1e-5, 1.05])
def test_a_block_that_cohesion_holds_counts_as_sliding_only_when_it_is_used_up(factor):
    """W sin φ = μ W cos φ + c A: far beyond μ N either way."""
    angle, friction = np.radians(40.0), 0.5
    used = factor < 1.01
    bare = held_block(angle, friction, 0.0)
    needed = bare.weight * (np.sin(angle) - friction * np.cos(angle)) / (1.2 * 0.7)
    structure = held_block(angle, friction, factor * needed)
    joints = af.dead_load(af.build(structure, fidelity="rigid")).joints
    assert float(joints["friction"][0]) == pytest.approx(np.tan(angle), rel=1e-6)
    assert bool(joints["slide"][0]) == used
    assert (af.verified_mechanism(structure, joints).kind == "local") == used
    alone = af.verified_mechanism(structure, joints, af.Criteria(friction=friction))
    assert alone.kind == "local"  # a criterion of |V| / N alone ignores cohesion
    again = af.joints.joint_dataset(structure, joints[["N", "V", "M"]].to_array().values.T)
    assert again["slide"].values.tolist() == joints["slide"].values.tolist()


@pytest.mark.parametrize(("peak", "slides"), [(0.66, False), (0.74, True)])
def test_a_shaken_block_is_a_mechanism_only_beyond_friction_and_cohesion(peak, slides):
    """It holds up to a = (μ + c A / W) g = 0.7 g, and the event agrees with the record."""
    contact = af.Contact(1e10, 4e9, 0.4, cohesion=0.3 * 8e3)
    structure = af.column(breadth=1.0, heights=[0.4], contact=contact)
    assert structure.weight == pytest.approx(8e3)
    time = np.arange(0.0, 1.0, 0.005)
    shaking = peak * structure.gravity * np.sin(2.0 * np.pi * 2.0 * time) * np.minimum(1, 2 * time)
    given = {"damping": af.StiffnessDamping(0.05, 20.0), "dt": 0.005}
    model = af.build(structure, fidelity="rigid")
    run = af.time_history(model, af.Motion(shaking, 0.005), **given)
    assert float(run.joints["friction"].max()) > 0.6
    assert (run.verified is not None) == slides
    assert bool(np.abs(run.dataset["last_memory"].values).max() > 1e-6) == slides
    until = af.dynamics.MovingMechanism()
    halted = af.time_history(model, af.Motion(shaking, 0.005), until=until, **given)
    assert (halted.ending == "event") == slides
    if slides:
        assert halted.time[-1] == run.verified.moved.time


def test_the_force_of_cohesion_falls_as_a_joint_opens():
    """The closed part of a plane face without tension is 3 (1/2 - |e|): 0.3 at e = 0.4."""
    contact = af.Contact(1e9, 4e8, 0.5, cohesion=10e3)
    structure = af.column(breadth=2.0, heights=[1.0], width=0.5, contact=contact)
    normal, whole = 20e3, 10e3 * 2.0 * 0.5
    for e, share in ((0.0, 1.0), (0.16, 1.0), (0.4, 0.3), (-0.4, 0.3), (0.49, 0.03)):
        for used, slides in ((1.0, True), (0.98, False)):
            shear = 0.5 * normal + used * share * whole
            rows = np.array([[normal, -shear, e * normal * 2.0]])
            found = af.joints.joint_dataset(structure, rows)
            assert bool(found["slide"][0]) == slides
            assert bool(with_failure_flags(found, af.Criteria(hinge=0.4))["slide"][0]) == slides


FRICTION, HELD = 0.3, 0.3
"""Of the bed: μ, and c A over the weight of the block."""

SLIDES = (FRICTION + 1.5 * HELD) / (1.0 + 1.5 * HELD)
"""Of a square block: λ = μ + c A / W · 3 (1/2 - λ/2), whose thrust is at λ/2 of the breadth."""


def block(held=HELD, friction=FRICTION):
    """A square block on a bed with cohesion."""
    contact = replace(af.masonry.STONE_TO_STONE, friction=friction)
    plain = af.column(breadth=1.0, heights=[1.0], contact=contact)
    cohesion = held * plain.weight / (plain.width * 1.0)
    glued = replace(contact, cohesion=cohesion)
    return af.column(breadth=1.0, heights=[1.0], contact=glued)


@pytest.mark.parametrize(
    "friction", ["coulomb", pytest.param("nonassociated", marks=pytest.mark.slow)]
)
def test_a_block_slides_on_the_closed_part_of_its_bed(friction, verified, caplog):
    """A pushover loses cohesion where the bed opens; limit analysis has it whole, and says so.

    Beyond the closed part 1.5 (1 - λ) of the bed it coheres over COHESIVE_OPENING c / (k_n θ):
    it has turned by θ = 2 N / (k_n w) over the square of that part.
    """

    def excess(factor):
        closed = 1.5 * (1.0 - factor)
        return FRICTION + HELD * (closed + 0.5 * COHESIVE_OPENING * HELD * closed**2) - factor

    slides = brentq(excess, 0.3, 0.7, xtol=1e-14)
    assert slides == pytest.approx(SLIDES, rel=1e-5)
    push = af.pushover(af.build(block(), fidelity="rigid"), SIDEWAYS)
    verified("block on a bed with cohesion, part of it open: limit", slides, "statics", push.factor)
    assert push.factor == pytest.approx(slides, rel=1e-9)
    whole = af.collapse_factor(block(), live=SIDEWAYS, friction=friction)
    assert whole.factor == pytest.approx(FRICTION + HELD, rel=1e-7)
    assert "1 joints such as 'joint 0' fail partly open" in caplog.text
    caplog.clear()
    less = closed_cohesion(block(), push.joints.isel(step=-1))
    found = af.collapse_factor(less, live=SIDEWAYS, friction=friction)
    # by the closed part at the pushover's factor
    assert found.factor == pytest.approx(SLIDES, rel=1e-5)


@pytest.mark.parametrize(("held", "friction"), [(0.1, 0.1), (0.0, 0.3), (5.0, 0.3)])
def test_nothing_is_warned_of_where_no_cohesion_is_lost(held, friction, caplog):
    """The bed stays closed; it has no cohesion; it turns on its edge, which does not slide."""
    af.collapse_factor(block(held, friction), live=SIDEWAYS, friction="nonassociated")
    lost = held == 5.0  # at the edge nothing is closed, and friction alone is too little
    assert ("fail partly open" in caplog.text) == lost


def test_the_closed_part_is_three_times_the_distance_from_thrust_to_edge():
    structure = af.column(breadth=0.5, heights=[1.0] * 5, contact=block().joints[0].contact)
    joints = af.dead_load(af.build(structure, fidelity="rigid")).joints.copy(deep=True)
    joints["N"][:] = [1.0, 1.0, 1.0, 0.0, 0.06]
    joints["M"][:] = [0.05, -0.15, 0.25, 0.0, 0.005]
    less = closed_cohesion(structure, joints)
    np.testing.assert_allclose(
        less.cohesion / structure.cohesion, [1.0, 0.6, 0.0, 0.0, 1.0], atol=1e-12
    )
    assert [joint.name for joint in less.joints] == [joint.name for joint in structure.joints]


def test_joints_of_another_structure_are_refused():
    joints = af.dead_load(af.build(block(), fidelity="rigid")).joints
    with pytest.raises(af.InvalidInput):
        closed_cohesion(af.column(breadth=1.0, heights=[1.0, 1.0]), joints)


def test_joints_without_cohesion_are_not_named_as_cohesive(caplog):
    """Round-off of a search leaves a shear above μ N, which no cohesion holds."""
    structure = block_on_incline(0.0, glued(0.0))
    found = af.collapse_factor(structure, live=af.BodyForce(1.0))
    joints = found.joints.assign(V=found.joints["V"] * (1.0 + 1e-4))
    caplog.clear()
    warn_cohesion(structure, (0,), joints, found.factor)
    assert not caplog.records


BREADTH, HEIGHT, TENSION = 0.6, 2.4, 20e3


def bonded_column(**changes):
    bond = {"friction": 0.6, "cohesion": 40e3, "tension": TENSION} | changes
    contact = replace(af.masonry.STONE_TO_STONE, **bond)
    return af.column(breadth=BREADTH, heights=[HEIGHT], contact=contact)


@pytest.mark.parametrize("strength", [None, 0.2e6])
def test_a_bond_that_yields_turns_about_the_toe(strength, caplog):
    """Tension below the turning joint, and a block of stress at its toe: by hand."""
    column = bonded_column()
    found = af.collapse_factor(column, live=af.BodyForce(1.0), strength=strength)
    weight, width = column.weight, column.width
    # σ over a depth x at the toe, f_t over the rest: N = σ w x - f_t w (b - x) is the weight
    moment = 0.5 * (weight + TENSION * width * BREADTH) * BREADTH
    if strength is not None:
        x = (weight + TENSION * width * BREADTH) / ((strength + TENSION) * width)
        moment = 0.5 * (strength + TENSION) * width * x * (BREADTH - x)
    assert found.factor == pytest.approx(moment / (weight * HEIGHT / 2.0), rel=1e-6)
    assert "bonds are brittle" in caplog.text
    assert found.bounded
    # the resultants are those of the joint: nothing but the weight is above it
    assert float(found.joints["N"][0]) == pytest.approx(weight, rel=1e-6)


@pytest.mark.parametrize(
    "friction", ["coulomb", pytest.param("nonassociated", marks=pytest.mark.slow)]
)
def test_a_bond_is_pulled_off_and_sheared_by_its_strength(friction):
    """Lifted: the weight and T. Pushed at its foot: c A + μ N, with N of the weight alone."""
    column = bonded_column()
    area = column.width * BREADTH
    lifted = af.collapse_factor(column, live=af.BodyForce(0.0, 1.0), friction=friction)
    exact = 1.0 + TENSION * area / column.weight
    assert lifted.factor == pytest.approx(exact, rel=1e-6)
    low = af.PointLoad(0.0, (1e3, 0.0), y=0.01)
    pushed = af.collapse_factor(column, live=low, friction=friction)
    assert pushed.factor == pytest.approx((40e3 * area + 0.6 * column.weight) / 1e3, rel=1e-6)


def test_a_bond_is_without_effect_where_it_has_no_strength():
    dry, bonded = (bonded_column(tension=tension) for tension in (0.0, 1e-3))
    factors = [af.collapse_factor(each, live=af.BodyForce(1.0)).factor for each in (dry, bonded)]
    assert factors[0] == pytest.approx(factors[1], rel=1e-6)


def weakest_four_hinges(arch, live, tension):
    """Least factor of all mechanisms of four hinges, by their velocities and dissipation."""
    count = len(arch.joints)
    ends = np.array([[joint.intrados, joint.extrados] for joint in arch.joints])
    weights, x = (np.zeros(count + 1) for _ in range(2))
    for k, block in enumerate(arch.blocks):
        weights[k] = 0.0 if block.fixed else block.area * block.material.unit_weight * arch.width
        x[k] = block.centroid[0]
    loaded, point = live.place(arch)
    plastic = 0.5 * tension * arch.width * arch.depths**2
    best = np.inf
    for first in (0, 1):  # face of the first hinge, then they alternate
        for places in combinations(range(count), 4):
            a, b, c, d = (ends[j, (first + k) % 2] for k, j in enumerate(places))
            # turning rates of the three links: ω1 (b - a) + ω2 (c - b) + ω3 (d - c) = 0, ω1 = ±1
            sense = -1.0 if first == 0 else 1.0
            sides = np.column_stack([c - b, d - c])
            if abs(np.linalg.det(sides)) < 1e-12:
                continue
            second, third = np.linalg.solve(sides, -sense * (b - a))
            turns = np.diff([0.0, sense, second, third, 0.0])
            if not (turns * turns[0] * [1, -1, 1, -1] >= 0.0).all():
                continue  # a joint would close
            rates = np.array([0.0, sense, second, third, 0.0])
            link = np.searchsorted(places, np.arange(count + 1), side="left")
            centres = np.array([a, a, b, c, d])[:, 0]
            starts = np.cumsum([0.0, 0.0, sense * (b - a)[0], second * (c - b)[0], 0.0])
            down = -(starts[link] + rates[link] * (x - centres[link]))
            here = link[loaded]
            live_power = live.force[1] * (starts[here] + rates[here] * (point[0] - centres[here]))
            if live_power <= 0.0:
                continue
            held = plastic[list(places)] @ np.abs(turns)
            best = min(best, (held - weights @ down) / live_power)
    return best


@pytest.mark.parametrize("tension", [0.0, 20e3])
def test_an_arch_in_mortar_falls_by_the_weakest_of_all_four_hinges(tension):
    mortar = replace(af.masonry.STONE_TO_STONE, friction=0.8, cohesion=1e6, tension=tension)
    arch = af.circular_arch(
        radius=2.0, thickness=0.12, embrace=100.0, voussoirs=14, width=0.25, contact=mortar
    )
    live = af.PointLoad(-0.7, (0.0, -1e3))
    found = af.collapse_factor(arch, live=live)
    assert found.factor == pytest.approx(weakest_four_hinges(arch, live, tension), rel=1e-6)
