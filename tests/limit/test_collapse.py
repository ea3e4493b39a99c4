"""Limit analysis: equilibrium, mechanism and outcomes on structures small enough to check."""

import logging
import time
from dataclasses import replace

import numpy as np
import pytest

from archfem.limit.collapse import Outcome, collapse_factor, stands
from archfem.limit.thickness import minimum_thickness
from archfem.masonry.actions import BodyForce, PointLoad, Settlement
from archfem.masonry.materials import STONE, STONE_TO_STONE
from archfem.masonry.rigid_motion import motion_of
from archfem.masonry.shapes import arch_on_piers, circular_arch, column
from archfem.units import MPa

EXACT = 1e-7
"""Relative: the programme is solved to 1e-9 block weights."""

SIDEWAYS = BodyForce(1.0)
ECCENTRIC = PointLoad(1.4, (0.0, -1e3))
LOADS = [SIDEWAYS, BodyForce(-1.0), BodyForce(1.0, 0.3), ECCENTRIC, PointLoad(-0.5, (2e3, -1e3))]


def rough(friction):
    return replace(STONE_TO_STONE, friction=friction)


def ring(**changes):
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17}
    return circular_arch(**(given | changes))


def piers(**changes):
    given = {"radius": 3.0, "thickness": 0.6, "voussoirs": 15, "pier_breadth": 1.2}
    return arch_on_piers(**(given | {"courses": [0.5] * 4} | changes))


def weights(structure):
    return np.array([b.area * b.material.unit_weight * structure.width for b in structure.blocks])


def body_power(structure, motion, horizontal, vertical):
    """Power of a body force on velocities (n_blocks, 3), summed block by block."""
    return float(weights(structure) @ (motion[:, :2] @ [horizontal, vertical]))


def live_power(structure, motion, live):
    if isinstance(live, BodyForce):
        return body_power(structure, motion, live.horizontal, live.vertical)
    block, point = live.place(structure)
    arm = point - structure.blocks[block].centroid
    u, v, turn = motion[block]
    return live.force[0] * (u - turn * arm[1]) + live.force[1] * (v + turn * arm[0])


def gaps(structure, motion):
    """Openings at both ends and slip of each joint (n_joints, 3), from the moved end points."""
    rows = []
    for joint, normal in zip(structure.joints, structure.normals, strict=True):
        jump = np.zeros((2, 2))
        for number, sign in ((joint.higher, 1.0), (joint.lower, -1.0)):
            moved = motion_of(joint.ends, structure.blocks[number].centroid) @ motion[number]
            jump += sign * moved
        rows.append([*(jump @ normal), jump.mean(axis=0) @ joint.tangent])
    return np.array(rows)


def unbalance(structure, joints, factor, live):
    """Largest force left over on a block: weight, live load and the forces of its joints."""
    number_of, point = live.place(structure) if isinstance(live, PointLoad) else (None, None)
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
            across = np.cross(joint.tangent, structure.normals[k])
            arm = joint.middle - block.centroid
            force = force + push
            moment += arm[0] * push[1] - arm[1] * push[0] + sign * m * across
        left = max(left, np.abs(force).max(), abs(moment))
    return left


@pytest.mark.parametrize("live", LOADS, ids=str)
@pytest.mark.parametrize("friction", [None, "coulomb"])
@pytest.mark.parametrize("build", [ring, piers], ids=["ring", "piers"])
def test_static_and_kinematic_factors_are_equal(build, friction, live):
    structure = build()
    found = collapse_factor(structure, live=live, friction=friction)
    motion = found.motion
    dead, work = body_power(structure, motion, 0.0, -1.0), live_power(structure, motion, live)
    assert work > 0.0 > dead
    assert found.factor == pytest.approx(-dead / work, rel=EXACT)
    assert unbalance(structure, found.joints, found.factor, live) < 1e-6 * structure.weight


@pytest.mark.parametrize("live", LOADS, ids=str)
def test_motion_opens_joints_and_never_closes_one(live):
    structure = ring(contact=rough(0.45))
    opening_in, opening_out, slip = gaps(structure, collapse_factor(structure, live=live).motion).T
    dilated = 0.45 * np.abs(slip)
    assert np.min(opening_in - dilated) > -EXACT
    assert np.min(opening_out - dilated) > -EXACT
    assert np.max(opening_in + opening_out) > 1e-3


def test_fastest_corner_moves_at_unit_speed():
    structure = ring()
    motion = collapse_factor(structure, live=SIDEWAYS).motion
    speeds = [
        np.linalg.norm(motion_of(block.drawn(), block.centroid) @ own, axis=1).max()
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
    right, left = (collapse_factor(ring(), live=BodyForce(sign)) for sign in (1.0, -1.0))
    assert left.factor == pytest.approx(right.factor, rel=EXACT)
    assert [(17 - joint, side) for joint, side in reversed(left.hinges)] == list(right.hinges)


@pytest.mark.parametrize(
    "changes",
    [
        {"radius": 29.5, "thickness": 5.5},
        {"width": 7.0},
        {"material": replace(STONE, unit_weight=2e3)},
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
    tilting = collapse_factor(column(breadth=0.6, heights=[2.4]), live=SIDEWAYS)
    assert tilting.factor == pytest.approx(0.25, rel=EXACT)
    assert tilting.hinges == ((0, "extrados"),)
    sliding = collapse_factor(column(breadth=0.6, heights=[2.4], contact=rough(0.1)), live=SIDEWAYS)
    assert sliding.factor == pytest.approx(0.1, rel=EXACT)
    assert (sliding.hinges, sliding.sliding) == ((), (0,))


def test_without_friction_a_column_stands_but_resists_nothing():
    slippery = column(breadth=0.6, heights=[2.4], contact=rough(0.0))
    assert stands(slippery)
    assert collapse_factor(slippery, live=SIDEWAYS).factor == pytest.approx(0.0, abs=1e-9)
    assert not stands(ring(contact=rough(0.0)))


def test_strength_moves_the_hinge_inside_the_joint():
    """The base crushes over W / (σ w): the block tilts about the middle of that strip."""
    block = column(breadth=0.6, heights=[2.4], width=0.5)
    strip = block.weight / (0.5 * MPa * 0.5)
    found = collapse_factor(block, live=SIDEWAYS, strength=0.5 * MPa)
    assert found.factor == pytest.approx((0.6 - strip) / 2.4, rel=1e-6)  # cuts: 1e-7 of σ w h
    assert found.hinges == ((0, "extrados"),)


def test_strength_lowers_the_factor_steadily():
    factors = [
        collapse_factor(ring(), live=SIDEWAYS, strength=s * MPa).factor for s in (0.3, 1, 10, 1e6)
    ]
    assert np.all(np.diff(factors) > 0.0)
    assert factors[-1] == pytest.approx(collapse_factor(ring(), live=SIDEWAYS).factor, rel=1e-5)
    assert collapse_factor(ring(), live=SIDEWAYS, strength=0.1 * MPa).outcome == "infeasible"


def test_strong_joints_respect_the_stress_block():
    structure, strength = ring(), 0.5 * MPa
    joints = collapse_factor(structure, live=SIDEWAYS, strength=strength).joints
    most = joints["N"] * joints["depth"] / 2 - joints["N"] ** 2 / (2 * strength * structure.width)
    crushing = strength * structure.width * joints["depth"]
    assert float((abs(joints["M"]) - most).max()) < 1e-6 * float((crushing * joints["depth"]).max())


def test_a_load_that_presses_a_column_down_never_overturns_it():
    found = collapse_factor(column(breadth=0.6, heights=[2.4]), live=PointLoad(0.1, (0.0, -1.0)))
    assert found.outcome is Outcome.UNBOUNDED
    assert found.factor == np.inf
    assert "never overturns" in str(found)
    assert not found.motion.any()
    assert found.hinges == ()


def test_an_arch_that_cannot_stand_says_so_and_falls():
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
    block = column(breadth=0.6, heights=[2.4], contact=rough(0.0))
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
    assert collapse_factor(leaning, live=BodyForce(-1.0)).outcome is Outcome.INFEASIBLE


def test_sliding_is_warned_of(caplog):
    block = column(breadth=0.6, heights=[2.4], contact=rough(0.1))
    with caplog.at_level(logging.WARNING, "archfem"):
        collapse_factor(block, live=SIDEWAYS)
    assert "joints [0] slide" in caplog.text
    caplog.clear()
    with caplog.at_level(logging.WARNING, "archfem"):
        collapse_factor(block, live=SIDEWAYS, friction="nonassociated")
        collapse_factor(ring(), live=SIDEWAYS)
    assert not caplog.text


def test_sliding_without_dilatancy_is_weaker_and_hardly_dilates():
    structure = circular_arch(
        radius=3.0, thickness=0.6, embrace=120.0, voussoirs=15, contact=rough(0.5)
    )
    push = PointLoad(0.0, (-1e3, 0.0))
    upper = collapse_factor(structure, live=push)
    found = collapse_factor(structure, live=push, friction="nonassociated")
    assert found.factor < 0.95 * upper.factor
    assert found.sliding
    excess = abs(found.joints["V"]) - 0.5 * found.joints["N"]
    assert float(excess.max()) < 1e-4 * float(found.joints["N"].max())  # iteration: 1e-5
    opening_in, opening_out, slip = gaps(structure, found.motion).T
    dilation = np.minimum(opening_in, opening_out)[list(found.sliding)]
    assert np.all(dilation < 2e-3 * np.abs(slip[list(found.sliding)]))  # α = 1e-3


def test_sliding_without_dilatancy_changes_nothing_where_nothing_slides():
    plain, without = (
        collapse_factor(ring(), live=SIDEWAYS, friction=f).factor
        for f in ("coulomb", "nonassociated")
    )
    assert without == pytest.approx(plain, rel=EXACT)


def test_spreading_supports_find_the_least_thrust_and_closing_ones_the_greatest():
    structure = ring()
    spread = collapse_factor(structure, live=Settlement("left abutment", (-1.0, 0.0, 0.0)))
    close = collapse_factor(structure, live=Settlement(0, (1.0, 0.0, 0.0)))
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
        collapse_factor(ring(), live=Settlement(0, (-size, 0.0, 0.0))) for size in (1.0, 0.005)
    )
    assert half.factor == pytest.approx(0.005 * one.factor, rel=EXACT)
    assert half.motion[0] == pytest.approx([-0.005, 0.0, 0.0])


def test_an_arch_that_holds_a_straight_strut_locks_when_its_supports_close():
    flat = circular_arch(span=4.0, rise=0.2, thickness=1.0, voussoirs=9)
    found = collapse_factor(flat, live=Settlement("left abutment", (1.0, 0.0, 0.0)))
    assert found.outcome is Outcome.LOCKS
    assert "cannot follow" in found.outcome.sentence
    assert found.factor == np.inf


def test_least_thickness_is_a_bracket():
    def build(thickness):
        return circular_arch(radius=2.0, thickness=thickness, embrace=140.0, voussoirs=12)

    least = minimum_thickness(build, tolerance=1e-5)
    assert stands(build(least))
    assert not stands(build(least * (1.0 - 1.1e-5)))


def test_capacity_of_rings_grows_with_thickness_and_falls_with_embrace():
    def capacity(embrace, ratio):
        made = circular_arch(radius=1.0, thickness=ratio, embrace=embrace, voussoirs=16)
        return collapse_factor(made, live=SIDEWAYS, friction=None).factor

    factors = np.array([[capacity(e, r) for r in (0.05, 0.12, 0.18)] for e in (120, 150, 180)])
    assert np.isnan(factors[2, 0])
    assert (np.nan_to_num(np.diff(factors, axis=1), nan=1.0) > 0.0).all()
    assert (np.nan_to_num(np.diff(factors, axis=0), nan=-1.0) < 0.0).all()


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
        (lambda: collapse_factor(ring(), live=PointLoad(9.0, (0.0, -1.0))), "misses the structure"),
        (lambda: collapse_factor(ring(), live=SIDEWAYS, friction="cohesion"), "is not known"),
        (lambda: stands(ring(), friction="none"), "is not known"),
        (lambda: stands(ring(), strength=0.0), "is not positive"),
        (lambda: collapse_factor(ring(), live=Settlement(3, (1.0, 0.0, 0.0))), "cannot settle"),
        (lambda: collapse_factor(ring(), live=Settlement("pier", (1.0, 0, 0))), "cannot settle"),
        (lambda: minimum_thickness(lambda t: ring(thickness=t), tolerance=0.0), "tolerance"),
        (
            lambda: minimum_thickness(
                lambda t: ring(thickness=t, contact=rough(0.0)), tolerance=1e-3
            ),
            "no thickness makes it stand",
        ),
        (
            lambda: minimum_thickness(lambda t: column(breadth=t, heights=[1.0])),
            "stands at any thickness",
        ),
        (lambda: minimum_thickness(lambda t: ring(thickness=-t)), "builds? makes no structure"),
        (lambda: piers(courses=[]), "at least one height"),
        (lambda: piers(pier_breadth=0.5), "is not between"),
    ],
)
def test_input_that_cannot_be_meant_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
