"""Limit analysis: equilibrium, mechanism and outcomes on structures small enough to check."""

import logging
import time
from dataclasses import replace

import numpy as np
import pytest
from kinematics import displacement, gaps
from repeats import each_once

import archfem as af
from archfem.limit import Outcome, collapse_factor, stands

EXACT = 1e-7
"""Relative: the programme is solved to 1e-9 block weights."""

SIDEWAYS = af.BodyForce(1.0)
ECCENTRIC = af.PointLoad(1.4, (0.0, -1e3))
LOADS = [
    SIDEWAYS,
    af.BodyForce(-1.0),
    af.BodyForce(1.0, 0.3),
    ECCENTRIC,
    af.PointLoad(-0.5, (2e3, -1e3)),
]


def rough(friction):
    return replace(af.masonry.STONE_TO_STONE, friction=friction)


def ring(**changes):
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17}
    return af.circular_arch(**(given | changes))


def piers(**changes):
    given = {"radius": 3.0, "thickness": 0.6, "voussoirs": 15, "pier_breadth": 1.2}
    return af.arch_on_piers(**(given | {"courses": [0.5] * 4} | changes))


def weights(structure):
    return np.array([b.area * b.material.unit_weight * structure.width for b in structure.blocks])


def body_power(structure, motion, horizontal, vertical):
    """Power of a body force on velocities (n_blocks, 3), summed block by block."""
    return float(weights(structure) @ (motion[:, :2] @ [horizontal, vertical]))


def live_power(structure, motion, live):
    if isinstance(live, af.BodyForce):
        return body_power(structure, motion, live.horizontal, live.vertical)
    block, point = live.place(structure)
    arm = point - structure.blocks[block].centroid
    u, v, turn = motion[block]
    return live.force[0] * (u - turn * arm[1]) + live.force[1] * (v + turn * arm[0])


def unbalance(structure, joints, factor, live):
    """Largest force left over on a block: weight, live load and the forces of its joints."""
    number_of, point = live.place(structure) if isinstance(live, af.PointLoad) else (None, None)
    left = 0.0
    for number, block in enumerate(structure.blocks):
        if block.fixed:
            continue
        weight = weights(structure)[number]
        force, moment = np.array([0.0, -weight]), 0.0
        if number == number_of:
            push = factor * np.array(live.force)
            arm = point - block.centroid
            force, moment = force + push, arm[0] * push[1] - arm[1] * push[0]
        elif number_of is None:
            force = force + factor * weight * np.array([live.horizontal, live.vertical])
        for k, joint in enumerate(structure.joints):
            if number not in joint.blocks:
                continue
            sign = 1.0 if number == joint.higher else -1.0
            n, v, m = (float(joints[key][k]) for key in "NVM")
            push = sign * (n * structure.normals[k] - v * joint.tangent)
            across = np.linalg.det([joint.tangent, structure.normals[k]])
            arm = joint.middle - block.centroid
            force = force + push
            moment += arm[0] * push[1] - arm[1] * push[0] + sign * m * across
        left = max(left, np.abs(force).max(), abs(moment))
    return left


@pytest.mark.parametrize(
    ("live", "friction", "build"), each_once(LOADS, (None, "coulomb"), (piers, ring))
)
def test_static_and_kinematic_factors_are_equal(build, friction, live, verified):
    structure = build()
    found = collapse_factor(structure, live=live, friction=friction)
    motion = found.motion
    dead, work = body_power(structure, motion, 0.0, -1.0), live_power(structure, motion, live)
    assert work > 0.0 > dead
    assert found.factor == pytest.approx(-dead / work, rel=EXACT)
    case = "static against kinematic factor, rings and rings on piers under five loads"
    off = abs(found.factor * work / dead + 1.0)
    verified(case, "equal", "power of the mechanism found", "equal", difference=off)
    assert unbalance(structure, found.joints, found.factor, live) < 1e-6 * structure.weight


@pytest.mark.parametrize("live", LOADS, ids=str)
def test_motion_opens_joints_and_never_closes_one(live):
    structure = ring(contact=rough(0.45))
    opening_in, opening_out, slip = gaps(structure, collapse_factor(structure, live=live).motion).T
    dilated = 0.45 * np.abs(slip)
    assert np.min(opening_in - dilated) > -EXACT
    assert np.min(opening_out - dilated) > -EXACT
    assert np.max(opening_in + opening_out) > 1e-3


def test_factor_of_an_inclined_load_by_hand():
    """Moments, about the second to the fourth hinge, of all that stands left of each.

    Unknown are the two reactions at the first hinge and the factor. The load stands on the arc.
    """
    structure, x, force = ring(), -0.7, np.array([2e3, -1.5e3])
    found = collapse_factor(structure, live=af.PointLoad(x, tuple(force)), friction=None)
    at = np.array([x, np.sqrt((2.95 + 0.275) ** 2 - x**2)])
    hinges = [(j, np.array(getattr(structure.joints[j], face))) for j, face in found.hinges]
    assert len(hinges) == 4
    (first, foot), loaded = hinges[0], np.arctan2(*at)  # clockwise from the crown
    rows, known = [], []
    for joint, pivot in hinges[1:]:
        stones = structure.blocks[first + 1 : joint + 1]
        middle = np.arctan2(*np.array(structure.joints[joint].middle))
        pushed = np.linalg.det([at - pivot, force]) if loaded < middle else 0.0
        rows.append([-(foot - pivot)[1], (foot - pivot)[0], pushed])
        known.append(sum(20e3 * stone.area * (stone.centroid - pivot)[0] for stone in stones))
    assert found.factor == pytest.approx(np.linalg.solve(rows, known)[2], rel=EXACT)


def test_fastest_corner_moves_at_unit_speed():
    structure = ring()
    motion = collapse_factor(structure, live=SIDEWAYS).motion
    speeds = [
        np.linalg.norm(displacement(block.drawn(), block, own), axis=1).max()
        for block, own in zip(structure.blocks, motion, strict=True)
    ]
    assert max(speeds) == pytest.approx(1.0, rel=EXACT)


def test_hinges_are_named_by_the_face_in_contact():
    structure = ring()
    found = collapse_factor(structure, live=SIDEWAYS)
    assert found.hinges == ((0, "intrados"), (6, "extrados"), (12, "intrados"), (17, "extrados"))
    opening = gaps(structure, found.motion)
    for joint, side in found.hinges:
        e = float(found.joints["eccentricity"][joint])
        assert e == pytest.approx(-0.5 if side == "intrados" else 0.5, abs=1e-6)
        closed, open_ = (0, 1) if side == "intrados" else (1, 0)
        assert opening[joint, closed] == pytest.approx(0.0, abs=EXACT)
        assert opening[joint, open_] > 1e-3


def test_mirrored_load_gives_the_mirrored_mechanism():
    right, left = (collapse_factor(ring(), live=af.BodyForce(sign)) for sign in (1.0, -1.0))
    assert left.factor == pytest.approx(right.factor, rel=EXACT)
    assert [(17 - joint, side) for joint, side in reversed(left.hinges)] == list(right.hinges)


@pytest.mark.parametrize(
    "changes",
    [
        {"radius": 29.5, "thickness": 5.5},
        {"width": 7.0},
        {"material": replace(af.STONE, unit_weight=2e5)},
        {"gravity": 1.62},
    ],
    ids=["size", "width", "weight", "gravity"],
)
def test_factor_of_a_body_force_has_no_scale(changes):
    expected = collapse_factor(ring(), live=SIDEWAYS).factor
    assert collapse_factor(ring(**changes), live=SIDEWAYS).factor == pytest.approx(
        expected, rel=EXACT
    )


def test_order_of_blocks_does_not_matter():
    """Numbering blocks from the right turns every normal round; joints stay as they were."""
    structure = ring()
    last = len(structure.blocks) - 1
    turned = replace(
        structure,
        blocks=structure.blocks[::-1],
        joints=tuple(
            replace(joint, blocks=(last - joint.lower, last - joint.higher))
            for joint in structure.joints
        ),
    )
    one, other = (collapse_factor(each, live=ECCENTRIC) for each in (structure, turned))
    assert other.factor == pytest.approx(one.factor, rel=EXACT)
    assert other.hinges == one.hinges
    np.testing.assert_allclose(other.joints["N"], one.joints["N"], rtol=1e-6)


def test_a_block_tilts_at_breadth_over_height_and_slides_at_friction():
    tilting = collapse_factor(af.column(breadth=0.6, heights=[2.4]), live=SIDEWAYS)
    assert tilting.factor == pytest.approx(0.25, rel=EXACT)
    assert tilting.hinges == ((0, "extrados"),)
    sliding = collapse_factor(
        af.column(breadth=0.6, heights=[2.4], contact=rough(0.1)), live=SIDEWAYS
    )
    assert sliding.factor == pytest.approx(0.1, rel=EXACT)
    assert (sliding.hinges, sliding.sliding) == ((), (0,))


def test_without_friction_a_column_stands_but_resists_nothing():
    slippery = af.column(breadth=0.6, heights=[2.4], contact=rough(0.0))
    assert stands(slippery)
    assert collapse_factor(slippery, live=SIDEWAYS).factor == pytest.approx(0.0, abs=1e-9)
    assert not stands(ring(contact=rough(0.0)))


def test_a_load_that_presses_a_column_down_never_overturns_it():
    found = collapse_factor(
        af.column(breadth=0.6, heights=[2.4]), live=af.PointLoad(0.1, (0.0, -1.0))
    )
    assert found.outcome is Outcome.UNBOUNDED
    assert found.factor == np.inf
    assert "never overturns" in str(found)
    assert not found.motion.any()
    assert found.hinges == ()


def test_an_arch_that_cannot_stand_is_reported_and_falls():
    thin = ring(thickness=0.2, embrace=180.0)
    found = collapse_factor(thin, live=SIDEWAYS)
    assert found.outcome is Outcome.INFEASIBLE
    assert np.isnan(found.factor)
    assert "does not stand under its own weight" in str(found)
    assert np.isnan(found.joints["N"]).all()
    assert body_power(thin, found.motion, 0.0, -1.0) > 0.0
    assert not stands(thin)


def test_an_arch_held_up_by_its_live_load_does_not_stand():
    """A factor above zero at which it would stand is no answer: the load comes second."""
    block = af.column(breadth=0.6, heights=[2.4], contact=rough(0.0))
    leaning = replace(
        block,
        blocks=tuple(
            replace(b, outline=tuple((x + 0.05 * y, y - 0.05 * x) for x, y in b.outline))
            for b in block.blocks
        ),
        joints=tuple(
            replace(j, intrados=(-0.3, 0.015), extrados=(0.3, -0.015)) for j in block.joints
        ),
    )
    assert collapse_factor(leaning, live=SIDEWAYS).outcome is Outcome.INFEASIBLE
    assert collapse_factor(leaning, live=af.BodyForce(-1.0)).outcome is Outcome.INFEASIBLE


def test_sliding_is_warned_of(caplog):
    block = af.column(breadth=0.6, heights=[2.4], contact=rough(0.1))
    with caplog.at_level(logging.WARNING, "archfem"):
        collapse_factor(block, live=SIDEWAYS)
    assert "joints slide (joint 0)" in caplog.text
    caplog.clear()
    with caplog.at_level(logging.WARNING, "archfem"):
        collapse_factor(block, live=SIDEWAYS, friction="nonassociated")
        collapse_factor(ring(), live=SIDEWAYS)
    assert not caplog.text


def test_spreading_supports_find_the_least_thrust_and_closing_ones_the_greatest():
    structure = ring()
    spread = collapse_factor(structure, live=af.Settlement("left abutment", (-1.0, 0.0, 0.0)))
    close = collapse_factor(structure, live=af.Settlement(0, (1.0, 0.0, 0.0)))
    assert (spread.outcome, close.outcome) == (Outcome.SETTLES, Outcome.SETTLES)
    assert 0.0 < spread.factor < -close.factor
    for found, thrust in ((spread, spread.factor), (close, -close.factor)):
        n, v = float(found.joints["N"][0]), float(found.joints["V"][0])
        push = n * structure.normals[0] - v * structure.joints[0].tangent
        assert push[0] == pytest.approx(thrust, rel=EXACT)
        assert body_power(structure, found.motion, 0.0, -1.0) == pytest.approx(
            found.factor, rel=EXACT
        )
    sides = [side for _, side in spread.hinges]
    assert sides[0] == sides[-1] == "intrados"
    assert "extrados" in sides[1:-1]
    assert {side for _, side in close.hinges[1:-1]} == {"intrados"}


def test_settlement_scales_with_its_motion():
    one, half = (
        collapse_factor(ring(), live=af.Settlement(0, (-size, 0.0, 0.0))) for size in (1.0, 0.005)
    )
    assert half.factor == pytest.approx(0.005 * one.factor, rel=EXACT)
    assert half.motion[0] == pytest.approx([-0.005, 0.0, 0.0])


def test_an_arch_that_holds_a_straight_strut_locks_when_its_supports_close():
    flat = af.circular_arch(span=4.0, rise=0.2, thickness=1.0, voussoirs=9)
    found = collapse_factor(flat, live=af.Settlement("left abutment", (1.0, 0.0, 0.0)))
    assert found.outcome is Outcome.LOCKS
    assert "cannot follow" in found.outcome.sentence
    assert found.factor == np.inf


def test_capacity_of_rings_grows_with_thickness_and_falls_with_embrace():
    def capacity(embrace, ratio):
        made = af.circular_arch(radius=1.0, thickness=ratio, embrace=embrace, voussoirs=16)
        return collapse_factor(made, live=SIDEWAYS, friction=None).factor

    factors = np.array([[capacity(e, r) for r in (0.05, 0.12, 0.18)] for e in (120, 150, 180)])
    assert np.isnan(factors[2, 0])
    assert (np.nan_to_num(np.diff(factors, axis=1), nan=1.0) > 0.0).all()
    assert (np.nan_to_num(np.diff(factors, axis=0), nan=-1.0) < 0.0).all()


@pytest.mark.slow
def test_five_hundred_voussoirs_take_seconds():
    begun = time.perf_counter()
    found = collapse_factor(ring(voussoirs=500), live=SIDEWAYS)
    assert time.perf_counter() - begun < 20.0  # 1 s on a free core
    half = collapse_factor(ring(voussoirs=250), live=SIDEWAYS).factor
    assert half * (1.0 - 1e-4) < found.factor <= half  # the same joints, and as many more
    assert len(found.hinges) == 4


def test_piers_reach_to_the_ground_and_carry_the_ring():
    structure = piers(chords=1)
    assert [structure.blocks[k].fixed for k in (0, -1)] == [True, True]
    assert {joint.part for joint in structure.joints} == {"left pier", "arch", "right pier"}
    assert len(structure.joints) == 4 + 16 + 4
    feet = [structure.joints[k].middle for k in (0, -1)]
    np.testing.assert_allclose(feet, [[-3.0, -2.0], [3.0, -2.0]])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: collapse_factor(ring(), live=af.PointLoad(9.0, (0.0, -1.0))),
            "misses the structure",
        ),
        (lambda: collapse_factor(ring(), live=SIDEWAYS, friction="cohesion"), "is not known"),
        (lambda: collapse_factor(ring(), live=af.BodyForce(0.0)), "load is zero"),
        (lambda: collapse_factor(ring(), live=[SIDEWAYS, af.BodyForce(-1.0)]), "load is zero"),
        (lambda: stands(ring(), friction="none"), "is not known"),
        (lambda: stands(ring(), strength=0.0), "is not above 0"),
        (lambda: collapse_factor(ring(), live=af.Settlement(3, (1.0, 0.0, 0.0))), "cannot settle"),
        (lambda: collapse_factor(ring(), live=af.Settlement("pier", (1.0, 0, 0))), "cannot settle"),
        (lambda: piers(courses=[]), "at least one height"),
        (lambda: piers(pier_breadth=0.5), "is not between"),
    ],
)
def test_invalid_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    ("way", "hinges", "slides"),
    [((1.0, 0.0, 0.0), 0, 2), ((0.0, -1.0, 0.0), 2, 1)],
)
def test_the_mechanism_over_a_support_does_not_depend_on_its_movement(way, hinges, slides):
    """By a metre, a millimetre or a micrometre: joints slide apart by μ of their slip."""
    ring = af.circular_arch(
        **{"radius": 2.95, "thickness": 0.8, "embrace": 120.0, "voussoirs": 7, "chords": 1},
        contact=af.Contact(1.48e9, 0.3e9, 0.3),
    )
    for far in (1.0, 1e-3, 1e-6):
        motion = tuple(far * each for each in way)
        found = af.collapse_factor(ring, live=af.Settlement("right abutment", motion))
        assert (len(found.hinges), len(found.sliding)) == (hinges, slides)


def test_a_mechanism_that_only_slides_has_no_hinges():
    block = af.column(breadth=1.0, heights=[0.5], contact=af.Contact(1e10, 4e9, 0.3))
    found = af.collapse_factor(block, live=af.BodyForce(1.0))
    assert "factor 0.3; hinges: none; sliding: joint" in str(found)


def test_a_press_on_a_pier_stabilises_it():
    """About the toe: (W + P) b/2 = λ W h; the press itself may be the weight of a block."""
    pier = af.column(breadth=0.6, heights=[1.0, 1.0, 1.0])
    weight = pier.weight
    push, press = af.PointLoad(0.0, (weight, 0.0), y=1.5), af.PointLoad(0.0, (0.0, -2.0 * weight))
    found = collapse_factor(pier, live=push, dead=[press])
    assert found.factor == pytest.approx(0.6, abs=EXACT)
    assert found.dead == (press,)
    # the top block weighs seven times as much
    heavy = replace(af.STONE, unit_weight=7.0 * af.STONE.unit_weight, stands_for="press")
    blocks = (*pier.blocks[:-1], replace(pier.blocks[-1], material=heavy))
    loaded = replace(pier, blocks=blocks)
    assert loaded.weight == pytest.approx(3.0 * weight)
    assert collapse_factor(loaded, live=push).factor == pytest.approx(0.6, abs=EXACT)


@pytest.mark.parametrize("live", LOADS)
def test_a_dead_part_of_the_live_load_is_no_longer_live(live):
    whole = collapse_factor(ring(), live=live)
    part = replace(live, **_scaled(live, 0.4 * whole.factor))
    rest = collapse_factor(ring(), live=live, dead=[part])
    assert rest.factor == pytest.approx(0.6 * whole.factor, rel=1e-6)
    assert collapse_factor(ring(), live=live, dead=[]).factor == whole.factor


def _scaled(action, factor):
    if isinstance(action, af.PointLoad):
        return {"force": tuple(factor * each for each in action.force)}
    return {key: factor * getattr(action, key) for key in ("horizontal", "vertical")}


def test_too_much_dead_load_is_no_collapse_factor():
    live = af.PointLoad(1.4, (0.0, -1e3))
    whole = collapse_factor(ring(), live=live).factor
    beyond = af.PointLoad(1.4, (0.0, -1.01e3 * whole))
    assert collapse_factor(ring(), live=SIDEWAYS, dead=[beyond]).outcome is Outcome.INFEASIBLE
