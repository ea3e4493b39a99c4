"""A stack as one rigid body: against pulses integrated from impact to impact, and loose blocks."""

from dataclasses import replace
from math import inf, isfinite

import numpy as np
import pytest
from loose_blocks import BREADTH, HEIGHT, G, floor, overturns, sine

import archfem as af
from archfem.dynamics import LooseBlocks, RigidBlockSimulation
from archfem.dynamics.collapse_state import CollapseState
from archfem.dynamics.rigid_body.rocking_body import (
    FirstFall,
    describe_first_fall,
    doubt_courses,
    find_rocking_body,
)

# Frequency over p, half sines, and peak over g of the least, or last, pulse that overturns
EDGES = [(1.0, 1, 0.33033), (8.0, 1, 1.20181), (2.0, 2, 0.30583), (3.0, 2, 0.88670)]


def column(count=2, breadth=BREADTH, height=HEIGHT, **options):
    return af.column(breadth=breadth, heights=[height / count] * count, **options)


def stacked(*boxes):
    """Boxes (left, bottom, right, top), of which each stands on the one before, on a floor."""
    base = floor(boxes[0], friction=5.0)
    blocks, joints = [*base.blocks], [*base.joints]
    for k, (left, low, right, high) in enumerate(boxes[1:], 2):
        corners = (left, low), (right, low), (right, high), (left, high)
        blocks.append(replace(base.blocks[1], outline=corners, name=f"block {k}"))
        inner, outer = max(left, boxes[k - 2][0]), min(right, boxes[k - 2][2])
        between = {"blocks": (k - 1, k), "intrados": (inner, low), "extrados": (outer, low)}
        joints.append(replace(base.joints[0], **between, name=f"joint {k}"))
    return replace(base, blocks=tuple(blocks), joints=tuple(joints))


def pulse(peak, period=1.0, rest=3.0):
    """One sine from 0.5 s on, and rest [g, s]."""
    times = np.arange(0.0, 0.5 + period + rest, 0.005)
    shaken = (times >= 0.5) & (times < 0.5 + period)
    return af.Motion(
        np.where(shaken, peak * G * np.sin(2.0 * np.pi * (times - 0.5) / period), 0.0), 0.005
    )


@pytest.mark.parametrize(("ratio", "halves", "edge"), EDGES)
def test_pulses_overturn_as_by_housner(ratio, halves, edge, verified):
    """Within 0.2 %, the pulse that ceases to overturn at larger peaks too."""
    body = find_rocking_body(replace(column(5), gravity=G))
    assert body.start == pytest.approx(G * BREADTH / HEIGHT)
    for factor in (0.998, 1.002):
        one = body.rock(sine(ratio, factor * edge, halves, 1e-3))
        assert isfinite(one.time) is overturns(ratio, factor * edge, halves)
    shaken = "half a sine" if halves == 1 else "one sine"
    case = f"stack as one rigid body, {shaken}, ω/p = {ratio:g}: edge of peaks that overturn [g]"
    verified(case, edge, "rigid block integrated event by event", "the same", difference=2e-3)


def test_a_body_of_unlike_courses_has_their_mass():
    """Courses of 0.5 × 1 m with weights 3 and 1: y = 0.75 m; I / m by Steiner's theorem."""
    stack = column(2, 0.5, 2.0)
    light = replace(af.STONE, name="light", unit_weight=af.STONE.unit_weight / 3.0)
    stack = replace(stack, blocks=(*stack.blocks[:2], replace(stack.blocks[2], material=light)))
    body = find_rocking_body(stack)
    assert body.arms == (pytest.approx((-0.25, 0.75)), pytest.approx((0.25, 0.75)))
    steiner = (0.25**2 * 3.0 + 0.75**2) / 4.0
    assert body.inertia == pytest.approx((0.5**2 + 1.0**2) / 12.0 + steiner)
    assert body.reach == pytest.approx((np.hypot(0.5, 2.0),) * 2)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_lopsided_body_rocks_as_one_loose_block(sense):
    """An L, also lifted by a vertical motion: by the steps of loose blocks, to 2 % of the way."""
    stack = stacked((0.0, 0.0, 0.6, 1.5), (0.0, 1.5, 0.9, 2.0))
    outline = ((0.0, 0.0), (0.6, 0.0), (0.6, 1.5), (0.9, 1.5), (0.9, 2.0), (0.0, 2.0))
    whole = replace(stack.blocks[1], outline=outline)
    one = replace(stack, blocks=(stack.blocks[0], whole), joints=stack.joints[:1])
    times = np.arange(0.0, 4.0, 0.005)
    across = sense * 0.4 * G * np.sin(2.0 * np.pi * times / 0.6) * (times < 0.6)
    motion = af.Motion(across, 0.005, vertical=0.5 * across)
    turns = [
        frame.poses[1, 2]
        for frame in RigidBlockSimulation(one, dt=2.5e-4).frames(
            LooseBlocks.as_built(one), 4.0, motion
        )
    ]
    reach = [np.hypot(0.9, 2.0), np.hypot(0.6, 2.0)]  # from the left and the right end
    farthest = max(2.0 * reach[int(turn < 0.0)] * np.sin(abs(turn) / 2.0) for turn in turns)
    found = find_rocking_body(stack).rock(motion)
    assert 0.02 < farthest < 0.5
    assert found.displacement == pytest.approx(farthest, rel=0.02)


def test_only_a_stack_that_rocks_is_one_body():
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7)
    assert find_rocking_body(ring) is None
    side = floor((0.0, 0.0, 0.5, 2.0), (2.0, 0.0, 2.5, 2.0))
    assert find_rocking_body(side) is None
    assert find_rocking_body(column(1)) is None
    bonded = af.Contact(1e9, 4e8, 0.6, cohesion=1e5, tension=1e5)
    assert find_rocking_body(column(3, contact=bonded)) is None


@pytest.mark.parametrize(
    ("friction", "peak", "slides"), [(0.24, 0.28, True), (0.4, 0.28, False), (0.4, 2.0, True)]
)
def test_a_body_that_slides_is_not_compared(friction, peak, slides):
    """Breadth over height is 0.25: it slides before it turns, never, or while it turns."""
    contact = af.Contact(1e9, 4e8, friction)
    body = find_rocking_body(column(3, contact=contact))
    assert (body.rock(pulse(peak)) is None) is slides
    assert (body.first_fall(pulse(peak), (1.0, 1.1)) is None) is slides
    assert body.rock(pulse(0.23)) == (inf, 0.0)
    state = CollapseState("fallen", None, (), 0.1, 0.0, True)
    assert bool([*doubt_courses(column(3, contact=contact), state, pulse(peak))]) is not slides


def test_a_plinth_is_no_part_of_the_body_that_rocks():
    body = find_rocking_body(
        stacked((-1.0, 0.0, 1.0, 0.5), (-0.3, 0.5, 0.3, 2.9), (-0.3, 2.9, 0.3, 5.3))
    )
    assert body.joint == "joint 2"
    assert body.start == pytest.approx(G * 0.3 / 2.4)


def test_the_first_fall_is_found_to_a_hundredth():
    """The half sine of ω/p = 1 overturns from 0.33033 g on, and at no larger scale it stands."""
    body = find_rocking_body(replace(column(3), gravity=G))
    found = body.first_fall(sine(1.0, 1.0, 1, 1e-3), (0.1, 2.0))
    assert 0.33033 < found.scale < 1.01 * 0.3304
    assert found.again is None
    assert describe_first_fall(found) == f"first falls at {found.scale:#.3g} × the motion"
    assert describe_first_fall(found, 2.0 * 9.80665).startswith(
        f"first falls at {2.0 * found.scale:#.3g} g ({found.scale:#.3g} × the motion)"
    )
    none = body.first_fall(sine(1.0, 1.0, 1, 1e-3), (0.1, 0.32))
    assert none == (inf, None, pytest.approx(BREADTH / HEIGHT, rel=1e-4))


def test_a_body_that_stands_again_beyond_its_first_fall_has_no_one_crossing():
    """One sine of ω/p = 5 falls from 0.71 g, stands from 1.68 g and falls from 1.84 g on."""
    body = find_rocking_body(replace(column(3), gravity=G))
    found = body.first_fall(sine(5.0, 1.0, 2, 1e-3), (0.5, 1.9))
    least, most = found.again
    stood = found.scale / 1.011, least, most
    fallen = found.scale, least / 1.011, most * 1.011
    assert [overturns(5.0, peak, 2) for peak in (*stood, *fallen)] == [False] * 3 + [True] * 3
    assert found.scale < least / 2.0
    words = (
        f"first falls at {found.scale:#.3g} × the motion, and does not fall at some scales from "
    )
    assert f"{words}{least:#.3g} to {most:#.3g} ×" in describe_first_fall(found)
    once = describe_first_fall(FirstFall(0.5, (2.0, 2.0)))
    assert once == "first falls at 0.500 × the motion, and does not fall at 2.00 ×"


@pytest.mark.parametrize(
    ("kind", "moved", "peak", "words"),
    [
        ("stands", 0.4, 0.25, "as one rigid body on 'joint 0' it falls, at 4.0"),
        ("fallen", 5.0, 0.25, None),
        ("fallen", 5.0, 0.16, "it does not fall, and moves by "),
        ("stands", 0.24, 0.16, None),
        ("stands", 0.17, 0.16, "and in courses by 170 mm"),
        ("stands", 0.001, 0.105, None),  # as one body by less than a tenth of the depth
    ],
)
def test_courses_are_doubted_where_one_body_does_otherwise(kind, moved, peak, words):
    """A strip of 0.6 × 5.9 m under one sine: one body falls from 0.7 × 0.25 g on."""
    strip = column(4, 0.6, 5.9)
    state = CollapseState(kind, None, (), moved, 0.0, True)
    doubts = [doubt.cause for doubt in doubt_courses(strip, state, pulse(peak))]
    assert len(doubts) == (words is not None)
    assert all(words in doubt for doubt in doubts)


@pytest.mark.parametrize(("count", "doubted"), [(8, True), (2, False)])
def test_a_run_says_what_one_body_does(count, doubted):
    """Eight courses come back from 0.7 of their depth; two fall, as one body does."""
    strip = af.Analysis(
        column(count, 0.6, 5.9), fidelity="rigid", displacements="large", damping="effective"
    )
    run = strip.run(pulse(0.25, rest=5.0))
    causes = [doubt.cause for doubt in run.doubts]
    assert (run.fall.kind != "fallen") is doubted
    assert any("as one rigid body" in cause for cause in causes) is doubted
    # the largest displacement of the run, long before its end
    assert any("of the depth of the shallowest part" in cause for cause in causes) is doubted


@pytest.mark.parametrize("stiffness", [1.48e9, 1e11])
def test_courses_on_soft_joints_rock_without_a_hinge(stiffness):
    """Beyond twice the push of limit analysis, by 0.2 of the depth, with |e| below 0.46.

    Of a joint of depth d under N at the height H of the weight, N e d - N H θ is largest, with
    θ = 2 N / (9 k d² (0.5 - e)²), at (0.5 - e)³ = 4 N H / (9 k d³): 0.43 in the base alone.
    """
    soft = af.Contact(stiffness, stiffness / 4.0, 0.6)
    material = replace(af.STONE, unit_weight=22e3)
    strip = column(16, 0.65, 6.8, contact=soft, material=material)
    assert af.collapse_factor(strip, live=af.BodyForce(1.0)).factor < 0.48 * 0.2
    model = af.build(strip, fidelity="rigid", displacements="large")
    run = af.time_history(model, pulse(0.2, 0.6, 1.5), damping="effective", dt=0.0025)
    largest = float(abs(run.joints["eccentricity"]).max())
    missed = 0.5 - (4.0 * 22e3 * 6.8 * 0.65 * 3.4 / (9.0 * stiffness * 0.65**3)) ** (1.0 / 3.0)
    doubts = [doubt.cause for doubt in run.doubts if "joints as soft as these" in doubt.cause]
    assert run.verdict.displacement > 0.1 * 0.65
    assert (missed < 0.46) is bool(doubts) is (largest < 0.46) is (run.verified is None)
    assert all(f"|e| up to {largest:.3g}, though a corner moved by" in each for each in doubts)


@pytest.mark.slow
def test_a_scale_of_a_stack_states_that_of_one_body():
    """Of the half sine above; courses on stiff joints fall at the same scale to a tenth."""
    stiff = af.Contact(1e11, 4e10, 5.0)
    stack = replace(column(2, contact=stiff), gravity=G)
    analysis = af.Analysis(stack, fidelity="rigid", displacements="large", damping="effective")
    found = analysis.scale(sine(1.0, 0.3, 1, 1e-3).with_rest(3.0), dt=0.002, precision=0.1)
    assert found.as_one.scale == pytest.approx(1.10, rel=0.011)
    assert found.upper == pytest.approx(1.10, rel=0.1)
    scale = f"{0.3 * found.as_one.scale * G / 9.80665:#.3g} g ({found.as_one.scale:#.3g} × the"
    # the least push by limit analysis; the motion has a peak of 0.3 g
    push = af.collapse_factor(stack, live=af.BodyForce(1.0), friction=None).factor / 0.3
    assert found.as_one.rocks == pytest.approx(push, rel=1e-3)
    rocks = f"as one rigid body without crushing it rocks from {push:#.3g} × on and first falls at "
    assert f"{rocks}{scale} motion)" in found.sentence
