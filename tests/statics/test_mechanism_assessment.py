"""Kinematic assessment: six cases worked by hand, the checks of the codes, and refused input."""

import re
from dataclasses import replace
from functools import partial
from itertools import pairwise
from math import atan2, cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from backfilled import SOIL, arch_bridge, rectangle, retaining_wall, slender_bridge, two_walls
from bonded import bonded_wall
from scipy.optimize import brentq

import archfem as af
from archfem._display import ProgressReport
from archfem.cases.answers import (
    Statement,
    _TieSearch,
    assess_untied,
    compare_checks,
    describe_margin,
    doubt_strip,
    doubt_ties,
    find_margin,
    list_ratios,
    note_ties,
    state_assessments,
)
from archfem.cases.defaults import note_loads_left_out
from archfem.cases.report import margins
from archfem.cases.report.conclusion import list_facts
from archfem.cases.report.report_data import ReportData
from archfem.cases.structure_keys import write_structure
from archfem.cases.toml_file import read_object
from archfem.limit.finite_mechanism import PathEnd, PathFollower
from archfem.statics import LIMIT_STATES, AssessmentCheck, LimitState, mechanism_assessment
from archfem.statics.assessment_checks import (
    BY_MECHANISM,
    BY_SPLIT,
    NOT_SHOWN,
    UPPER_BOUND,
    describe_difference,
    spectral_acceleration,
)
from archfem.studies.evaluators import evaluate_assessment

G = 9.81
SPECTRUM = af.motion.Ntc2018(ag=0.25, f0=2.4, tc_star=0.32, site="B")
OWN = LimitState("of our own", 0.5, 2.0, 1.0, 0.05, "a test")
RING = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
STONE = af.STONE.unit_weight


@pytest.fixture(scope="module")
def ring():
    return af.kinematic_assessment(RING, SPECTRUM)


def box(left, right, low, high, name, **options):
    outline = ((left, low), (right, low), (right, high), (left, high))
    return af.Block(outline, af.STONE, name, **options)


def bed(pair, left, right, level, friction=0.6):
    contact = af.Contact(1.48e9, 0.30e9, friction)
    return af.Joint(pair, (left, level), (right, level), contact, f"bed {pair}")


def oscillator(weights, speeds, factor):
    """e* and a0* [m/s²] of weights with virtual displacements."""
    weights, speeds = np.array(weights), np.array(speeds)
    share = (weights @ speeds) ** 2 / (weights.sum() * (weights @ speeds**2))
    return share, factor * G / share


def check_values(found, expected, verified, case, tolerance=1e-3):
    """Compare with values worked by hand, within 1e-3 of each."""
    for name, value in expected.items():
        computed = getattr(found, name)
        verified(f"{case}: {name}", value, "closed form", computed)
        assert computed == pytest.approx(value, rel=tolerance), name


def test_a_rigid_block(verified):
    """α0 = b/h, e* = 1; the centroid is above the corner at d0* = b/2."""
    found = af.kinematic_assessment(af.column(breadth=0.6, heights=[2.4]), SPECTRUM)
    a, d = 0.25 * G, 0.3
    # T_s at d_s* = 0.16 d0* from the circle of the centroid, radius R, about the corner
    beta, radius = atan2(0.3, 1.2), sqrt(0.3**2 + 1.2**2)
    turn = beta - np.arcsin((0.3 - 0.16 * d) / radius)
    secant = 2.0 * pi * sqrt(0.16 * d / (G * np.tan(beta - turn)))
    expected = {"alpha_0": 0.25, "e_star": 1.0, "a_0_star": a, "d_0_star": d, "T_s": secant}
    expected["M_star"] = 0.6 * 2.4 * STONE / G
    check_values(found, expected, verified, "rigid block 0.6 x 2.4 m")
    assert str(found).startswith("kinematic assessment of column, pushed to the right\n")
    assert f" m/s² ({a / 9.80665:.3f} g), which the checks divide by FC = 1.35, d_0*" in str(found)
    assert found.notes == ()
    periods = np.array([0.1, 1.0, 3.0])
    displacement, acceleration = found.demand(periods)
    spectrum = 9.80665 * replace(SPECTRUM, damping=0.08).horizontal(periods)
    assert acceleration == pytest.approx(spectrum)
    assert displacement == pytest.approx(spectrum * periods**2 / (4.0 * pi**2))


def test_a_crushed_edge_sets_the_hinge_of_a_block_back(verified):
    """By W / (2 f w) from the edge: α0 = 2 (b/2 - W / (2 f w)) / h, and d0* is that arm."""
    breadth, height, strength = 0.6, 2.4, 0.4e6
    for heights in ([1.4, 1.0], [height]):
        block = replace(af.column(breadth=breadth, heights=heights), width=0.5)
        arm = 0.5 * breadth - 0.5 * block.weight / (strength * 0.5)
        for direction in (1.0, -1.0):
            found = af.kinematic_assessment(block, SPECTRUM, strength=strength, direction=direction)
            assert found.alpha_0 == pytest.approx(2.0 * arm / height)
            assert f"0.4 MPa: hinges are set back by {1e3 * (0.3 - arm):.3g} mm" in str(found)
    values = {"alpha_0": 2.0 * arm / height, "d_0_star": arm}
    check_values(found, values, verified, "rigid block that crushes at 0.4 MPa")
    weak = replace(
        block,
        blocks=[replace(x, material=replace(af.STONE, strength=strength)) for x in block.blocks],
    )
    assert af.kinematic_assessment(weak, SPECTRUM).alpha_0 == pytest.approx(2.0 * arm / height)
    assert af.kinematic_assessment(block, SPECTRUM).alpha_0 == pytest.approx(0.25)
    mass = af.masonry.AttachedLoad("block 1", (0.0, 2.4), weight=110e3)
    with pytest.raises(af.InvalidInput, match=r"loads where joints crush at 0.4 MPa: af.stands"):
        af.kinematic_assessment(block, SPECTRUM, strength=strength, loads=[mass])


@pytest.mark.parametrize("strength", [5e6, 1e6, 0.3e6])
def test_an_arch_that_crushes_has_the_factor_of_limit_analysis(strength, verified):
    """That of |M| <= N (h - N / (f w)) / 2, whose cuts are another programme."""
    found = af.kinematic_assessment(RING, SPECTRUM, strength=strength)
    limit = af.collapse_factor(RING, live=af.BodyForce(1.0), strength=strength)
    source = "limit analysis with cuts of the crushing limit"
    verified(f"arch that crushes at {strength:g} Pa", limit.factor, source, found.alpha_0)
    assert found.alpha_0 == pytest.approx(limit.factor, rel=2e-4)
    assert found.hinges == limit.hinges
    thrusts = limit.joints["N"].values[[k for k, _ in limit.hinges]]
    back = found.path.blocks.setback[[k for k, _ in found.hinges]]
    # thrusts converge to 1e-4 of the depth
    assert back == pytest.approx(thrusts / (2.0 * strength * RING.width), abs=0.5e-4 * 0.55)


def two_storeys():
    """A wall of two storeys, 0.5 and 0.4 m thick, flush on its left face, with two floors."""
    blocks = (
        box(0.0, 0.5, -0.5, 0.0, "base", fixed=True),
        box(0.0, 0.5, 0.0, 3.0, "first storey"),
        box(0.0, 0.4, 3.0, 6.0, "second storey"),
    )
    joints = (bed((0, 1), 0.0, 0.5, 0.0), bed((1, 2), 0.0, 0.4, 3.0))
    floors = [
        af.masonry.AttachedLoad("first storey", (0.2, 3.0), weight=15e3),
        af.masonry.AttachedLoad("second storey", (0.2, 6.0), weight=10e3),
    ]
    weights = [0.5 * 3.0 * STONE, 0.4 * 3.0 * STONE, 15e3, 10e3]
    points = [(0.25, 1.5), (0.2, 4.5), (0.2, 3.0), (0.2, 6.0)]
    return af.Structure(blocks, joints), floors, weights, points


@pytest.fixture(scope="module")
def storeys():
    """The wall with its floors, pushed to the left."""
    structure, floors, _, _ = two_storeys()
    return af.kinematic_assessment(structure, SPECTRUM, direction=-1.0, loads=floors)


def overturning(weights, points, edge=0.0):
    """α0 and the turn at the fall of points that turn about (edge, 0), to the left."""
    arms = np.array([x - edge for x, _ in points])
    heights = np.array([y for _, y in points])
    factor = weights @ arms / (weights @ heights)
    return factor, np.arctan(factor), arms, heights


@pytest.mark.slow
def test_a_wall_of_two_storeys_with_floors(storeys, verified):
    found, (_, _, weights, points) = storeys, two_storeys()
    factor, turn, arms, heights = overturning(np.array(weights), points)
    share, acceleration = oscillator(weights, heights, factor)
    # control point: centroid of the second storey, the fastest of a block
    moved = arms[1] - (arms[1] * np.cos(turn) - heights[1] * np.sin(turn))
    weights = np.array(weights)
    d_0 = moved * (weights @ heights**2) / (heights[1] * (weights @ heights))
    expected = {"alpha_0": factor, "e_star": share, "a_0_star": acceleration, "d_0_star": d_0}
    check_values(found, expected, verified, "wall of two storeys with floors")
    assert "pushed to the left\n" in str(found)
    assert found.control == "second storey"


def test_a_wall_with_a_tie(storeys, verified):
    """A constant tie force T at 5.8 m adds its moment; it turns with the wall."""
    structure, floors, weights, points = two_storeys()
    pull, level = 6e3, 5.8
    tie = af.masonry.AttachedLoad("second storey", (0.0, level), force=(pull, 0.0))
    found = af.kinematic_assessment(structure, SPECTRUM, direction=-1.0, loads=[*floors, tie])
    weights, (_, _, arms, heights) = np.array(weights), overturning(np.array(weights), points)
    factor = (weights @ arms + pull * level) / (weights @ heights)
    # α = 0: Σ P (x cos θ - y sin θ) + T y_t cos θ = 0
    turn = np.arctan((weights @ arms + pull * level) / (weights @ heights))
    share, acceleration = oscillator(weights, heights, factor)
    moved = arms[1] - (arms[1] * np.cos(turn) - heights[1] * np.sin(turn))
    d_0 = moved * (weights @ heights**2) / (heights[1] * (weights @ heights))
    expected = {"alpha_0": factor, "e_star": share, "a_0_star": acceleration, "d_0_star": d_0}
    check_values(found, expected, verified, "the same wall with a tie")
    assert found.alpha_0 > 1.5 * storeys.alpha_0


@pytest.mark.slow
def test_a_passive_tie_resists_in_one_sense_and_pushes_in_none():
    """A strip of 0.5 × 4 m and 40 kN, with 2 kN at 3 m: α = (W b / 2 ± T 3) / (W h / 2)."""
    strip, tie = af.column(breadth=0.5, heights=[2.0, 2.0]), ("block 2", (0.0, 3.0))
    for passive, pushed in ((True, 0.5 / 4.0), (False, (40e3 * 0.25 - 2e3 * 3.0) / (40e3 * 2.0))):
        load = af.masonry.AttachedLoad(*tie, force=(-2e3, 0.0), passive=passive)
        right, left = (
            af.kinematic_assessment(strip, SPECTRUM, direction=sense, loads=[load])
            for sense in (1.0, -1.0)
        )
        assert right.alpha_0 == pytest.approx((40e3 * 0.25 + 2e3 * 3.0) / (40e3 * 2.0), rel=1e-4)
        assert left.alpha_0 == pytest.approx(pushed, rel=1e-4)
        says = [any("pushes in this sense" in note for note in x.notes) for x in (right, left)]
        assert says == [False, not passive]


def assess_tied(height, force, direction=1.0):
    """A strip of two blocks of 0.5 × 2 m and 20 kN each, with a tie at a height."""
    strip, block = af.column(breadth=0.5, heights=[2.0, 2.0]), f"block {1 if height <= 2.0 else 2}"
    tie = af.masonry.AttachedLoad(block, (0.0, height), force=(-force, 0.0), passive=True)
    return af.kinematic_assessment(strip, SPECTRUM, direction=direction, loads=[tie])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("force", "factor", "pull"),
    [
        (3e3, 0.2, 3),
        (2e4, 0.25, 5),
        (3e5, 0.25, 5),
    ],
)
def test_a_tie_bears_what_equilibrium_needs(force, factor, pull):
    """By moments about the toe, at 2 m: α 80 = 10 + 2 t; above the tie α = 0.25 / 1, t = 5 kN."""
    found = assess_tied(2.0, force)
    assert found.alpha_0 == pytest.approx(factor, rel=1e-4)
    says = f"pushed to the right, alpha_0 needs {pull} of the {force / 1e3:g} kN of the tie at bl"
    assert found.notes[0].startswith(says)
    assert "are in all for 1 m of width, without a factor on the tie, " in found.notes[1]
    if pull == 5:  # what rocks is the block above, which the tie does not reach
        alone = af.kinematic_assessment(af.column(breadth=0.5, heights=[2.0]), SPECTRUM)
        assert found.d_0_star == pytest.approx(alone.d_0_star, rel=1e-4)
        assert found.displacement.capacity == pytest.approx(alone.displacement.capacity, rel=1e-4)
    free = assess_tied(2.0, force, direction=-1.0)
    assert free.alpha_0 == pytest.approx(0.125, rel=1e-4)
    assert free.notes[0].startswith(
        f"pushed to the left, alpha_0 needs none of the {force / 1e3:g} kN of the tie at block 1;"
    )
    assert ", pushed to the left: " in describe_margin([found, free])
    assert ", pushed to" not in describe_margin([free, replace(free, direction=1.0)])
    # one more mechanism of the other sense, of a higher ratio, makes that no stronger
    checks = {
        name: replace(getattr(free, name), ratio=2.0 * getattr(free, name).ratio, bodies=None)
        for name in ("linear", "displacement")
    }
    both = [free, replace(free, direction=1.0), replace(free, direction=1.0, **checks)]
    assert ", pushed to" not in describe_margin(both)


def overturn(height, top, weight, pull=0.0, level=0.0, half=0.25):
    """α₀ and the ratio of NTC-2018 SLV of a body of one weight that a tie holds, by virtual work.

    The tie is on its rear face at a level; d* is that of a point at the height `top`.
    """

    def factor(turn):
        rest = weight * (half * cos(turn) - height / 2 * sin(turn))
        tied = pull * (level * cos(turn) + 2 * half * sin(turn))
        return (rest + tied) / (weight * (height / 2 * cos(turn) + half * sin(turn)))

    def moved(turn):
        return (half * (1.0 - cos(turn)) + top * sin(turn)) * height / 2 / top

    capacity = 0.4 * moved(brentq(factor, 0.0, 1.5))
    acceleration = G * factor(brentq(lambda turn: moved(turn) - capacity, 0.0, 1.5)) / 1.35
    period = 1.68 * pi * sqrt(capacity / acceleration)
    demand = replace(SPECTRUM, damping=0.08).horizontal(period) * G * (period / 2 / pi) ** 2
    return factor(0.0), capacity / float(demand)


@pytest.mark.parametrize(
    ("force", "decides"),
    [
        (3e3, True),
        pytest.param(0.3e3, False, marks=pytest.mark.slow),
        pytest.param(2e4, False, marks=pytest.mark.slow),
    ],
)
def test_what_is_above_a_tie_may_have_the_least_ratio(force, decides, verified):
    """Two blocks of 0.5 × 2 m, tied at 2 m: all of them, or the upper one."""
    whole, upper = overturn(4.0, 3.0, 40e3, force, 2.0), overturn(2.0, 1.0, 20e3)
    found = assess_tied(2.0, force)
    first = min(whole, upper)  # by α₀
    assert (found.alpha_0, found.checks[-1].decisive) == pytest.approx(first, rel=5e-3)
    assert (found.above is not None) == decides == (upper[1] < first[1])
    if decides:
        check = found.above.checks[-1]
        assert (found.above.alpha_0, check.ratio) == pytest.approx(upper, rel=1e-3)
        verified("what is above a tie: ratio", upper[1], "virtual work", check.ratio)
        says = "rocking of all above block 1 about the toe of block 2, from alpha_0 = 0.25 on, has "
        says += f"a lower ratio: {upper[1]:.3g} by NTC-2018 SLV, fails"
        assert says in str(found)
        assert repr(found).endswith(f"passes; {says}")
        assert not found.passes
    assert assess_tied(2.0, force, direction=-1.0).above is None


def wall_with_a_parapet(friction):
    """A wall of 1 × 3 m with 0.3 × 1 m on it, flush on its left face."""
    blocks = (
        box(0.0, 1.0, -0.5, 0.0, "base", fixed=True),
        box(0.0, 1.0, 0.0, 3.0, "wall"),
        box(0.0, 0.3, 3.0, 4.0, "parapet"),
    )
    joints = (bed((0, 1), 0.0, 1.0, 0.0, friction), bed((1, 2), 0.0, 0.3, 3.0, friction))
    return af.Structure(blocks, joints)


def test_a_thin_part_above_a_bed_may_have_the_least_ratio():
    """By moments, and by virtual work of a block, to the left."""
    structure = wall_with_a_parapet(0.6)
    found = af.kinematic_assessment(structure, SPECTRUM, direction=-1.0)
    assert found.alpha_0 == pytest.approx((3.0 * 0.5 + 0.3 * 0.15) / (3.0 * 1.5 + 0.3 * 3.5))
    assert found.checks[-1].passes
    above = overturn(1.0, 0.5, 1.0, half=0.15)
    assert above[0] > found.alpha_0
    assert (found.above.alpha_0, found.above.checks[-1].ratio) == pytest.approx(above, rel=1e-3)
    assert not found.passes
    # blocks that are named move alone
    assert af.kinematic_assessment(structure, SPECTRUM, direction=-1.0, blocks=[1, 2]).above is None


@pytest.mark.slow
def test_a_wall_and_its_parapet_slide_at_one_factor():
    structure = wall_with_a_parapet(0.2)
    found = af.kinematic_assessment(structure, SPECTRUM, direction=-1.0, friction="nonassociated")
    assert (found.alpha_0, found.above) == (pytest.approx(0.2), None)


def test_no_force_of_a_tie_suffices_where_what_is_above_it_fails():
    """Without the tie all of it fails, and with any tie the block above it."""
    spectrum = {"code": "NTC-2018", "ag": 0.25, "f0": 2.4, "tc_star": 0.32, "site": "B"}
    tie = {"block": "block 1", "point": [0.0, 2.0], "force": [-12e3, 0.0], "passive": True}
    column = {"shape": "column", "breadth": 0.5, "heights": [2.0, 2.0], "width": 4.0, "above": 0.0}
    assessment = {"spectrum": spectrum, "direction": 1, "loads": [tie]}
    case = af.Case.of({"structure": column, "assessment": assessment})
    name, (_, ratio) = (
        "rocking of all above block 1 about the toe of block 2",
        overturn(2.0, 1.0, 20e3),
    )
    says = f"not even 4 times the forces of the ties suffice: {name} has a ratio of {ratio:.3g}"
    # all of it at e* = 1: q α g / FC = PGA, and α 160 2 = 160 0.25 + 2 t
    pga = 0.25 * (1.4 - 0.4 * 2.4 * 0.25) * 9.80665 / 9.81
    needed = 160.0 * (1.35 * pga / 2.0 - 0.125)
    says += f"; all else passes from {needed:.3g} kN of the tie at block 1 on, in all for 4 m of "
    says += "wall at its foot, without a factor on the tie"
    assert note_ties(case) == [f"note: pushed to the right, {says}"]
    found = case.assessment.solve(case.structure, None)
    assert list(found) == ["right", f"right, {name}"]
    margins = [find_margin([each]) for each in found.values()]
    assert margins[0] > 1.0 > margins[1] == pytest.approx(ratio, rel=1e-3)
    # what moves above ties is in a building
    whole, above = ([str(x) for x in each.doubts] for each in found.values())
    doubt = "and 2 m above it, at the foot of what moves, it"
    assert [sum(doubt in text for text in each) for each in (whole, above)] == [0, 1]
    assert (
        "in all for 4 m of wall at its foot, without a factor on the tie" in found["right"].notes[1]
    )


def two_tied_blocks(force):
    """Blocks of 1 × 3 and 0.5 × 3 m, 20 kN/m³, side by side, and a bar between their tops."""
    contact = af.Contact(1e9, 4e8, friction=None)
    blocks, joints = [], []
    for name, x, breadth in (("left", 0.0, 1.0), ("right", 4.0, 0.5)):
        for kind, low, high in (("base", -0.5, 0.0), ("", 0.0, 3.0)):
            corners = ((x, low), (x + breadth, low), (x + breadth, high), (x, high))
            of = f"{name} {kind}".strip()
            blocks.append(af.Block(corners, af.STONE, of, fixed=bool(kind), role="pier"))
        pair = (len(blocks) - 2, len(blocks) - 1)
        joints.append(af.Joint(pair, (x, 0.0), (x + breadth, 0.0), contact, of, role="pier"))
    bar = {"block": "left", "point": ["1 m", "3 m"], "force": [f"{force} N", 0], "passive": True}
    bar |= {"anchor": "right", "anchor_point": ["4 m", "3 m"]}
    load = read_object(af.masonry.AttachedLoad, bar, "assessment.loads")
    return af.Structure(tuple(blocks), tuple(joints)), [load]


def test_a_bar_between_two_blocks_pulls_both(verified):
    """Both rock by one angle: α (W₁ + W₂) h / 2 = W₁ b₁ / 2 + W₂ b₂ / 2; T from the right one."""
    light, height = 30e3, 3.0  # the right block, 0.5 m broad
    both = (1.0 + 0.25) / (1.5 * height)
    pull = light * (both * height / 2.0 - 0.25) / height
    for force, factor in ((2.0 * pull, both), (0.5 * pull, 0.5 / height + pull / light)):
        structure, loads = two_tied_blocks(force)
        found = af.kinematic_assessment(structure, SPECTRUM, loads=loads)
        assert found.alpha_0 == pytest.approx(factor, rel=1e-4)
        verified(f"two blocks and a bar of {force:.0f} N, α", factor, "moments", found.alpha_0)
        share = f"needs {min(force, pull) / 1e3:.4g} of the {force / 1e3:.4g} kN of the tie at left"
        assert f"{share} and right" in found.notes[0]
    # the weak bar yields: the right block turns alone about (4.5, 0), as d* of its centroid says
    capacity = found.displacement.capacity
    turn = brentq(lambda angle: 0.25 * (1 - cos(angle)) + 1.5 * sin(angle) - capacity, 0.0, 0.5)
    corner = 4.5 - 0.5 * cos(turn) + 3.0 * sin(turn), 0.5 * sin(turn) + 3.0 * cos(turn)
    stretch = np.hypot(corner[0] - 1.0, corner[1] - 3.0) - 3.0
    assert f"capacity stretched by {1e3 * stretch:.3g} mm at left and right" in found.notes[0]
    slack = af.kinematic_assessment(structure, SPECTRUM, loads=loads, direction=-1.0)
    assert slack.alpha_0 == pytest.approx(0.5 / height, rel=1e-4)


def test_the_pull_of_a_bar_that_grows_and_where_it_yields_are_said():
    """From the left top to the middle of the right block: moments about its toe, all the way."""
    structure, (level,) = two_tied_blocks(1e3)
    chord, weight, toe = np.array([3.0, -1.5]), 30e3, (4.5, 0.0)

    def assess(force):
        pull = tuple(force * chord / np.hypot(*chord))
        bar = replace(level, anchor_point=(4.0, 1.5), force=pull)
        return af.kinematic_assessment(structure, SPECTRUM, loads=[bar])

    found, pulls = assess(1e6), []
    for moved, factor in zip(found.path.displacements, found.path.factors, strict=True):
        (left, right), ends = moved[[1, 3], 2], []
        for turn, about, point in ((left, (1.0, 0.0), (0.0, 3.0)), (right, toe, (-0.5, 1.5))):
            turned = [[cos(turn), -sin(turn)], [sin(turn), cos(turn)]]
            ends.append(np.array(turned) @ point + about)
        bar = ends[0] - ends[1]
        assert np.hypot(*bar) == pytest.approx(np.hypot(*chord), rel=1e-9)
        along, (x, y) = bar / np.hypot(*bar), ends[1] - toe
        from_toe = moved[3, :2] + (-0.25, 1.5)
        pulls.append(weight * (from_toe @ (1.0, factor)) / (x * along[1] - y * along[0]))
    assert max(pulls) > 1.1 * pulls[0]
    assert found.path.pulls == pytest.approx([max(pulls)], rel=1e-6)
    assert f"is kept pulling up to {max(pulls) / 1e3:.4g} kN at left and right\n" in str(found)
    assert "yields" not in str(found)
    force = np.mean([pulls[0], max(pulls)])
    yields = float(np.interp(force, pulls, found.curve["d"]))
    said = re.search(r"the tie at left and right yields at d\* = ([\d.]+) m", str(assess(force)))
    assert float(said[1]) == pytest.approx(yields, rel=0.02)


def test_two_ties_to_the_ground_are_no_bar():
    structure, (bar,) = two_tied_blocks(4e3)
    free = {"anchor": None, "anchor_point": None}
    ends = [
        replace(bar, **free),
        replace(bar, block="right", point=(4.0, 3.0), force=(-4e3, 0.0), **free),
    ]
    found = af.kinematic_assessment(structure, SPECTRUM, loads=ends)
    (doubt,) = (x for x in found.doubts if "towards each other" in x.cause)
    assert doubt.cause.startswith("the ties at left and right pull")
    for wrong, says in (
        ({"anchor_point": None}, "a bar between two blocks needs both"),
        ({"passive": False}, "and passive = true"),
        ({"force": (0.0, 4e3)}, r"pulls by \(0\.0, 4000\.0\) N, and its other end lies at \(3\.0"),
        ({"anchor_point": bar.point}, "give a force that points there"),
    ):
        with pytest.raises(af.InvalidInput, match=says):
            replace(bar, **wrong)
    away = replace(bar, anchor_point=(3.0, 3.0))
    with pytest.raises(af.InvalidInput, match="1 m from 'right'"):
        af.kinematic_assessment(structure, SPECTRUM, loads=[away])


def test_a_check_that_alone_fails_is_in_every_headline_with_the_force_of_a_tie():
    """A block of 1 × 8 m of 160 kN: α = 1 / 8, and by a tie at 4 m α 160 4 = 160 0.5 + 4 t."""
    spectrum = {"code": "NTC-2018", "ag": 0.25, "f0": 2.4, "tc_star": 0.32, "site": "B"}
    tie = {"block": "block 1", "point": [0.5, 4.0], "force": [-15e3, 0.0], "passive": True}
    column = {"shape": "column", "breadth": 1.0, "heights": [8.0]}
    case = af.Case.of({"structure": column, "assessment": {"spectrum": spectrum, "loads": [tie]}})
    found = case.assessment.solve(case.structure, None)
    pga = 0.25 * (1.4 - 0.4 * 2.4 * 0.25) * 9.80665 / 9.81
    ratios = [2.0 * alpha / 1.35 / pga for alpha in (0.125 + 15.0 / 160.0, 0.125)]
    assert [x.linear.ratio for x in found.values()] == pytest.approx(ratios, rel=1e-4)
    free = found["left"]
    assert free.passes  # by displacements
    # the margin is that of the linear check to the left, which is exact
    assert found["right"].displacement.bounded
    assert not evaluate_assessment(case).get("upper_bounds")
    high = af.Case.of({"structure": column | {"above": 8.0}, "assessment": {"spectrum": spectrum}})
    assert "least_margin" in evaluate_assessment(high)["upper_bounds"]
    moved = f"{free.displacement.ratio:.3g}"
    says = f"passes by displacements ({moved}), fails by the linear check ({ratios[1]:.3g}); no "
    says += "clause that was read says which governs"
    assert repr(free).endswith(says)
    margin = describe_margin(found.values())
    assert margin.startswith(f"least margin {ratios[1]:.3g}, by linear, q = 2, FC = 1.35, pushed ")
    other = f"; pushed to the right {ratios[0]:.3g} by the same check"
    assert margin.endswith(f", pushed to the left: {says}{other}")
    needed = 160.0 * (1.35 * pga / 2.0 - 0.125)
    assert note_loads_left_out(case) == [
        "note: without the ties of [assessment], which limits and runs leave out"
    ]
    assert note_loads_left_out(af.Case.of({"structure": column})) == []
    load = {"block": "block 1", "point": [0.5, 4.0]}
    floors = [load | {"weight": "3 kN"}, load | {"weight": "4 kN", "force": ["1 kN", "0 kN"]}]
    assessment = {"spectrum": spectrum, "loads": [tie, *floors]}
    loaded = af.Case.of({"structure": column, "assessment": assessment})
    (said,) = note_loads_left_out(loaded)
    assert said.startswith("note: without the 7 kN of weights, constant forces and ties of [assess")
    assert said.endswith(
        "as [structure.floors] of a wall, which columns across it have too, or as "
        "bodies, [structure.standing]"
    )
    assert note_ties(case) == [
        f"note: pushed to the right, from {needed:.3g} kN of the tie at block 1 on, in all for 1 m "
        "of width, without a factor on the tie, all forces tried pass its checks, one by an upper "
        "bound alone, so that more may be needed: give the `free_length` of ties",
        "note: pushed to the left, no tie holds it: if floors and walls do, give direction = 1",
    ]
    bounded = replace(free, displacement=replace(free.displacement, bounded=True))
    assert describe_margin([bounded]).endswith(": fails")  # an upper bound shows no passing
    # the report has the same words
    data = ReportData(case, {})
    vars(data)["statements"] = {"assessment": state_assessments(found, [])}
    verdict = dict(list_facts(data))["verdict"]
    said = says.replace("; no", ". No")
    assert (
        f"By the kinematic assessment on the NTC-2018 spectrum of PGA 0.29 g it {said}." in verdict
    )


@pytest.mark.parametrize(
    ("ratios", "words"),
    [
        (
            ((1.08, 1.08), (0.63, 0.7)),
            "passes by displacements (1.08), fails by the linear check (0.63); ",
        ),
        (
            ((0.87, 1.04), (0.43, 0.5)),
            "passes or fails, by the split of weights, by displacements (0.87), fails by ",
        ),
        (
            ((0.73, 0.9), (1.16, 1.4)),
            "fails by displacements (0.73), passes by the linear check (1.16); ",
        ),
        (
            ((1.2, 1.3), (0.9, 1.1)),
            "passes by displacements (1.2), passes or fails, by the split of weights, by the ",
        ),
        (((0.88, 1.1), (0.89, 1.08)), ""),
        (((0.9, 0.9), (0.6, 0.6)), ""),
        (((1.2, 1.2), (1.1, 1.1)), ""),
        (((0.9, 0.9),), ""),
    ],
)
def test_a_difference_of_checks_is_one_of_passing_and_failing(ratios, words):
    said = describe_difference(*ratios)
    assert said.startswith(words)
    assert bool(said) is bool(words)


def fold(turn):
    """Σ x and Σ y of the centroids of two halves that fold to the right, their top held [m].

    The lower one turns about its right toe, the upper one back about its left lower corner.
    """
    low = np.array([[cos(turn), sin(turn)], [-sin(turn), cos(turn)]])
    knee = low @ (-0.5, 2.0) + (0.25, 0.0)
    back = brentq(lambda t: knee[0] + 0.25 * cos(t) - 2.0 * sin(t), -0.1, 1.0)
    high = np.array([[cos(back), -sin(back)], [sin(back), cos(back)]])
    return low @ (-0.25, 1.0) + knee + high @ (0.25, 1.0)


def test_a_strong_tie_at_the_top_leaves_vertical_bending(verified):
    """Lower blocks turn about the toe, upper ones back about their knee, by virtual work.

    α (h₁ + h₂) h₁ / 2 = h₁ b / 2 + h₂ (b + b h₁ / (2 h₂)), least over the knees at h₁.
    """
    column, b, height = af.column(breadth=0.5, heights=[0.75] * 4), 0.5, 3.0
    tie = af.masonry.AttachedLoad("block 4", (-0.25, 3.0), force=(-50e3, 0.0), passive=True)
    found = af.kinematic_assessment(column, SPECTRUM, loads=[tie])
    rests = {h: h * b / 2 + (height - h) * b + b * h / 2 for h in (0.75, 1.5, 2.25)}
    factor = min(2.0 * rest / (height * h) for h, rest in rests.items())
    assert found.alpha_0 == pytest.approx(factor, rel=1e-6)
    assert found.hinges == ((0, "extrados"), (3, "intrados"))
    pull = 30.0 * (factor * height / 2 - b / 2) / height  # by moments about the toe
    says = f"needs {pull:.4g} of the 50 kN of the tie at block 4; up to the capacity"
    assert says in found.notes[0]
    ties = [tie, replace(tie, block="block 3", point=(-0.25, 2.25))]
    several = af.kinematic_assessment(column, SPECTRUM, loads=ties).notes[0]
    assert "of the 50 kN of the tie at block 3, or another split; up" in several
    verified("column tied at its top, α", factor, "virtual work", found.alpha_0)


def test_a_tie_holds_its_point_along_the_motion():
    """Tied at 4 m the halves turn against each other: α 20 (1 + 1) = 20 (0.25 + 0.75), t = 7.5.

    Along the motion α = Σ dy / Σ dx, by virtual work: the tie does none.
    """
    found = assess_tied(4.0, 2e4)
    assert found.alpha_0 == pytest.approx(0.5, rel=1e-4)
    assert found.notes[0].startswith("pushed to the right, alpha_0 needs 7.5 of the 20 kN")
    assert "with what equilibrium needs where it keeps its length" in found.notes[1]
    turns, step = -found.path.displacements[:, 1, 2], 1e-5
    for turn, factor in zip(turns, found.path.factors, strict=True):
        dx, dy = fold(turn + step) - fold(turn - step)
        assert factor == pytest.approx(dy / dx, abs=1e-4)
    assert found.path.end is PathEnd.RELEASED  # the tie slackens as it falls
    tie = "the tie at block 2 slackens"
    assert found.path.ending == f"{PathEnd.RELEASED.sentence}: {tie}"
    assert turns[-1] > 0.1
    assert found.path.factors[-1] < 2e-3
    assert assess_tied(4.0, 5e3).alpha_0 == pytest.approx((10.0 + 5.0 * 4.0) / 80.0, rel=1e-4)


def fold_below(turn, high=0.5, low=3.0):
    """Centroids (2, 2) [m], as a lower block turns and the upper one's top left corner is held."""
    turned = np.array([[cos(turn), sin(turn)], [-sin(turn), cos(turn)]])
    knee = turned @ (-0.5, low) + (0.25, 0.0)
    back = brentq(lambda t: knee[0] + 0.25 - high * sin(t), -0.1, 0.5 * pi)
    upper = np.array([[cos(back), -sin(back)], [sin(back), cos(back)]])
    return np.array(
        [turned @ (-0.25, low / 2) + (0.25, 0.0), knee + upper @ (0.25, high / 2)]
    ), knee


def factor_below(turn, weights=(3.0, 0.5), step=1e-5):
    """α of the fold by virtual work, of which the tie has none."""
    ahead, behind = (np.array(weights) @ fold_below(x)[0] for x in (turn + step, turn - step))
    dx, dy = ahead - behind
    return dy / dx


def slack_below(turn):
    """Moment of the upper block about its knee without the tie, 0 where the tie slackens."""
    (_, upper), knee = fold_below(turn)
    right, up = upper - knee
    return right + factor_below(turn) * up


@pytest.fixture(scope="module")
def held_top():
    """Case of a block of 0.5 × 3 m with one of 0.5 m on it, and a tie of 3 kN at its top."""
    spectrum = {"code": "NTC-2018", "ag": 0.3, "f0": 2.4, "tc_star": 0.32, "site": "B"}
    tie = {"block": "block 2", "point": [-0.25, 3.5], "force": [-3e3, 0.0], "passive": True}
    column = {"shape": "column", "breadth": 0.5, "heights": [3.0, 0.5]}
    assessment = {"spectrum": spectrum, "direction": 1, "loads": [tie]}
    return af.Case.of({"structure": column, "assessment": assessment})


def test_a_path_that_ends_early_has_a_lower_bound(held_top, verified):
    """Its end, where the tie slackens, counts as d₀*; the weights move by 1.5 m/s both: d* = d_C.

    C is the centroid of both blocks, of 3 and 0.5 m.

    A stronger tie turns no pass into a fail.
    """
    settings = held_top.assessment
    tie = settings.options["loads"][0]
    own = replace(settings, options={**settings.options, "loads": [replace(tie, force=(-6e3, 0))]})
    (found,) = own.solve(held_top.structure, None).values()
    end = brentq(slack_below, 0.01, 0.15)
    assert found.path.end is PathEnd.RELEASED
    assert found.path.factors[-1] == pytest.approx(factor_below(end), rel=0.02) != 0.0
    assert found.control == "block 1, block 2"

    def move(turn):
        return np.average((fold_below(turn)[0] - fold_below(0.0)[0])[:2, 0], weights=[3.0, 0.5])

    capacity = 0.4 * move(end)
    turn = brentq(lambda x: move(x) - capacity, 0.0, end)
    period = 1.68 * pi * sqrt(capacity / (G * factor_below(turn) / 1.35))
    spectrum = replace(SPECTRUM, ag=0.3, damping=0.08)
    demand = float(spectrum.horizontal(period)) * 9.80665 * (period / 2 / pi) ** 2
    check, linear = found.displacement, found.linear.ratio
    assert (found.e_star, check.ratio) == pytest.approx((1.0, capacity / demand), rel=5e-3)
    verified("path that ends early: ratio", capacity / demand, "virtual work", check.ratio)
    assert check.at_least
    assert (check.outcome, found.passes, check.ratio < 1.0) == (NOT_SHOWN, False, True)
    ratio = f"{check.ratio:.3g}"
    assert f"{NOT_SHOWN}, the spectrum may be at least {ratio} times as strong" in str(found)
    split = replace(check, ratio=1.2, bodies=0.9)  # passes with the weights apart alone
    assert split.ratios == "at least 0.9 (1.2 with the weights apart)"
    assert (
        replace(split, bodies=1.3, ratio=0.8).ratios == "at least 0.8 (1.3 with one weight a body)"
    )
    assert (split.doubt_split(), len(split.doubt_end(""))) == ([], 1)
    # no other mechanism is in equilibrium where it ends, and up to there none has a lower factor
    higher = replace(check, ratio=1.2)
    assert (check.bounded, higher.passes, higher.doubt_end("")) == (False, True, [])
    (doubt,) = (x for x in found.doubts if "a lower bound" in str(x))
    assert str(doubt).endswith("leave out ties: count on what it withstands without them")
    says = f"passes the linear check ({linear:.3g}), and {NOT_SHOWN} by displacements (at least "
    says += f"{ratio}), as the path ends before alpha vanishes"
    headline = f"least margin at least {ratio}, by NTC-2018 SLV: {says}"
    assert describe_margin([found]) == headline
    stated = state_assessments({"right": found}, [])
    data = ReportData(held_top, {})
    vars(data)["statements"] = {"assessment": Statement.read(stated.as_file("x")["x.json"])}
    test = "No run can test it, for runs leave out the loads of [assessment]"  # the tie
    assert f"it {says}. {test}." in dict(list_facts(data))["verdict"]
    (margin,) = margins.describe_margin(data)
    assert margin.startswith(f"the least margin is at least {ratio}, on the NTC-2018 spectrum")
    assert margin.endswith("by NTC-2018 SLV, right, a lower bound")
    # a mechanism that fails, fails
    ratios = [x for _, x in list_ratios(found)]
    other = ratios[1]._replace(least=0.9, most=0.9)
    assert compare_checks([*ratios, other]) == "another mechanism or sense does not pass (0.9)"
    failing = [ratios[0]._replace(least=0.8, most=0.8), ratios[1]]
    assert compare_checks(failing).startswith(f"fails the linear check (0.8), and {NOT_SHOWN}")


def test_a_tied_wall_that_is_not_shown_to_pass_says_that_it_passes_untied(verified):
    """A block of 0.6 × 6 m; its tie stretches by more than a short bar bears."""
    spectrum = {"code": "NTC-2018", "ag": 0.15, "f0": 2.5, "tc_star": 0.33, "site": "B"}
    tie = {"block": "block 1", "point": [0.0, 3.8], "force": [-2e3, 0.0], "passive": True}
    column = {"shape": "column", "breadth": 0.6, "heights": [6.0]}
    assessment = {"spectrum": spectrum, "direction": 1, "loads": [tie]}
    case = af.Case.of({"structure": column, "assessment": assessment})
    found = case.assessment.solve(case.structure, None)
    tied = found["right"].displacement
    assert (tied.bounded, tied.passes) == (True, False)
    found = assess_untied(case, found)
    # about the toe; the arm of the centroid is hypot(0.3, 3)
    capacity, arm = 0.4 * 0.3, hypot(0.3, 3.0)
    alpha = (0.3 - capacity) / sqrt(arm**2 - (0.3 - capacity) ** 2)
    period = 1.68 * pi * sqrt(1.35 * capacity / (G * alpha))
    table = af.motion.Ntc2018(ag=0.15, f0=2.5, tc_star=0.33, site="B", damping=0.08)
    demand = float(table.horizontal(period)) * af.units.STANDARD_GRAVITY * (period / 2 / pi) ** 2
    check = found["right"].displacement
    verified("tied block: ratio without the tie", capacity / demand, "moments", check.untied)
    assert check.untied == pytest.approx(capacity / demand, rel=1e-3)  # steps of the curve
    untied = f"{check.untied:.3g}"
    assert f": passes by an upper bound alone (without ties it passes: {untied}), " in str(check)
    linear = found["right"].linear.ratio
    says = f"passes the linear check ({linear:.3g}), and passes by displacements without ties "
    says += f"({untied}); with them it {NOT_SHOWN} by displacements, as their ratio, "
    says += f"{check.ratio:.3g}, is an upper bound"
    assert describe_margin(found.values()).endswith(f": {says}")
    data, stated = ReportData(case, {}), state_assessments(found, [])
    vars(data)["statements"] = {"assessment": Statement.read(stated.as_file("x")["x.json"])}
    said = says.replace("; with", ". With")
    assert f"it {said}." in dict(list_facts(data))["verdict"]
    # an end of the path before alpha vanishes, and a sense that fails
    linear, moved = (x for _, x in list_ratios(found["right"]))
    early = moved._replace(least=0.9, most=np.inf, bounded=False)
    assert compare_checks([linear, early]).endswith(
        f"with them it {NOT_SHOWN} by displacements (at least 0.9), as the path ends before alpha "
        "vanishes"
    )
    failing = moved._replace(least=0.8, most=0.8, bounded=False, untied=None)
    assert "without ties" not in compare_checks([linear, moved, failing])
    # a wall that fails without its tie, as one of twice the spectrum
    assessment["spectrum"] = spectrum | {"ag": 0.3}
    weak = af.Case.of({"structure": column, "assessment": assessment})
    found = weak.assessment.solve(weak.structure, None)
    assert assess_untied(weak, found) == found


def assess_case(structure, spectrum, **assessment):
    """Case and assessments of a column that was made in Python."""
    tables = write_structure(structure) | {"assessment": {"spectrum": spectrum, **assessment}}
    case = af.Case.of(tables)
    return case, case.assessment.solve(case.structure, None)


def test_the_strip_of_a_whole_gable_is_in_its_verdict(verified):
    """A strip through the ridge is a prism, which turns from thickness over height on."""
    gable = {"breadth": 5.2, "height": 6.2, "eaves": 3.8, "width": 0.6, "course": 0.25}
    wall = af.Case.of({"structure": {"shape": "wall", "stone": 0.5, **gable}}).structure
    columns = af.masonry.columns_across(wall)
    pga = 0.15 * 1.2 * af.units.STANDARD_GRAVITY / G
    ratio = 2.0 / 1.35 * (0.6 / 6.2) / pga
    spectrum = {"code": "NTC-2018", "ag": 0.15, "f0": 2.5, "tc_star": 0.33, "site": "B"}
    case, found = assess_case(columns["whole"], spectrum)
    own = found["right, strip through the highest place"]
    verified("gable: least ratio of a strip", ratio, "overturning of a prism", own.linear.decisive)
    assert own.linear.decisive == pytest.approx(ratio, rel=1e-6) == find_margin(found.values())
    assert find_margin([found["right"]]) > 1.2 * ratio
    (note,) = (note for note in own.notes if "tied together along its length" in note)
    assert note.startswith("it is 5.2 m of wall with courses as long as the longest")
    assert own.structure.weight == pytest.approx(5.2 * columns["strip"].weight)
    # a beam on the slopes holds it: the rest is as without this key
    beam = {"tied_along": "a concrete beam"}
    _, alone = assess_case(columns["whole"], spectrum, **beam)
    assert [*alone] == [name for name in found if "strip" not in name]
    assert find_margin(alone.values()) == find_margin(x for k, x in found.items() if k in alone)
    for side in ("right", "left"):
        assert alone[side].notes[-1].endswith("tied along by: a concrete beam")
    rows = state_assessments(found, []).rows
    assert any(", strip through the highest place" in row.result for row in rows)
    assert evaluate_assessment(case)["least_margin"] == pytest.approx(ratio, rel=1e-6)
    # a strip, and a block, whose courses are all as long
    for prism in (columns["strip"], af.column(breadth=0.6, heights=[6.2])):
        assert not any("highest" in name for name in assess_case(prism, spectrum)[1])


def test_a_roof_on_slopes_is_on_top_of_the_strip(verified):
    """A wall of 7 × 0.7 m to eaves at 5 m and a ridge at 8 m, 20 kN/m³: moments of a metre of it.

    The roof of 110.6 kN acts at the middle of the slopes on the whole, and at the ridge on the
    strip. Its thrust stays at the middle of the slopes.
    """
    gable = {"breadth": 7.0, "height": 8.0, "eaves": 5.0, "width": 0.7, "course": 0.5}
    gable |= {"shape": "wall", "stone": 1.0, "material": "masonry"}
    tables = {"structure": gable, "materials": {"masonry": {"preset": "stone", "unit_weight": 2e4}}}
    whole = af.masonry.columns_across(af.Case.of(tables).structure)["whole"]
    spectrum = {"code": "NTC-2018", "ag": 0.18, "f0": 2.45, "tc_star": 0.34, "site": "C"}
    (course,) = (x.name for x in whole.blocks if x.points[:, 1].max() == pytest.approx(6.5))
    roof = {"block": course, "point": [0.0, 6.5], "weight": 110.64e3, "force": [1.4e3, 0.0]}
    eaves = {"block": "block 10", "point": [0.0, 5.0], "weight": 14e3}
    _, found = assess_case(whole, spectrum, direction=1, loads=[roof, eaves])
    strip = found["right, strip through the highest place"]
    wall, load, low, thrust = 112.0, 110.64 / 7.0, 2.0, 0.2  # of a metre [kN]
    turned = np.array([wall * 4.0, load * 8.0, low * 5.0])
    alpha = (0.35 * (wall + load + low) - thrust * 6.5) / turned.sum()
    share = turned.sum() ** 2 / ((wall + load + low) * (turned @ [4.0, 8.0, 5.0]))
    ratio = 2.0 / 1.35 * alpha / share / (0.18 * (1.7 - 0.6 * 2.45 * 0.18))
    ratio *= G / af.units.STANDARD_GRAVITY
    own = strip.linear.bodies
    verified("gable with a roof: ratio of a strip", ratio, "moments", own)
    assert (strip.alpha_0, own) == pytest.approx((alpha, ratio), rel=1e-4)
    assert strip.linear.decisive < found["right"].linear.decisive
    # its share of a tie is that of its length, and what its note names is said to be the strip's
    tie = {"block": "block 10", "point": [0.0, 5.0], "force": [-70e3, 0.0], "passive": True}
    case, found = assess_case(whole, spectrum, direction=1, loads=[tie])
    tied = found["right, strip through the highest place"].alpha_0
    assert tied == pytest.approx((0.35 * wall + 10.0 * 5.0) / (wall * 4.0), rel=1e-4)
    with ProgressReport("ties", None) as progress:
        assert _TieSearch(case, 1.0, progress).solve(1.0).mechanism.endswith(" of the strip")
    # above its eaves alone, where no course has the length of the wall at the foot
    gable_alone = af.masonry.columns_across(af.Case.of(tables).structure, above=5.0)["whole"]
    roof = {"block": "block 3", "point": [0.0, 1.5], "weight": 110.64e3}
    _, found = assess_case(gable_alone, spectrum, direction=1, loads=[roof])
    alone = found["right, strip through the highest place"].alpha_0
    assert alone == pytest.approx(0.35 * (42.0 + load) / (42.0 * 1.5 + load * 3.0), rel=1e-6)
    # in the stones the roof and the length of a course are one weight: a doubt says so
    gable["floors"] = {"roof": {"level": 8.0, "load": 15.8e3}}
    stacks = af.masonry.columns_across(af.Case.of(tables).structure)
    said = [[str(x) for x in doubt_strip(stacks[name])] for name in ("whole", "strip")]
    assert said[0][0].startswith("the weights of its upper courses are with 'roof', so that the")
    assert (len(said[0]), said[1], doubt_strip(whole)) == (1, [], [])


def test_a_ratio_without_ties_is_no_bound_of_that_with_them():
    """Where spectral displacements grow as T the ratio does as √(d_u a*), which a tail lowers."""
    d, a_0 = np.linspace(0.0, 0.05, 101), 1.5
    free = a_0 * (1.0 - d / 0.05)
    # from 0.9 d₀* on a tie holds a tenth of a₀*, up to 2 d₀*
    far = np.append(d[:91], [0.1, 0.1])
    tied = np.append(free[:91], [0.1 * a_0, 0.0])
    rules = LIMIT_STATES["NTC-2018 SLV"]
    untied, longer = (rules.check(SPECTRUM, 1.35, *x) for x in ((d, free), (far, tied)))
    ratio = sqrt(0.8 * 0.2 / (0.4 * 0.6))
    assert longer.moved / untied.moved == pytest.approx(ratio, rel=1e-6)


def test_a_mechanism_of_stronger_ties_puts_the_ratio_of_given_ones_in_doubt(held_top):
    """The note contradicts no headline; the linear check needs α W h / 2 = W b / 2 + t h."""
    (found,) = held_top.assessment.solve(held_top.structure, None).values()
    own, weight = find_margin([found]), 35.0
    assert own > 1.0
    alpha = 1.35 / 2.0 * 0.3 * (1.4 - 0.4 * 2.4 * 0.3) * 9.80665 / 9.81  # e* = 1
    needed = (alpha * weight * 1.75 - weight * 0.25) / 3.5
    note, doubt = map(str, note_ties(held_top))
    ratio = "a ratio of at least 0.865"  # that of the test above
    assert note == (
        f"note: pushed to the right, with 4 times the forces of the ties it {NOT_SHOWN} by "
        f"displacements: two-hinge mechanism has {ratio}; the linear check alone is passed from "
        f"{needed:.3g} kN of the tie at block 2 on"
    )
    lower = f"pushed to the right, two-hinge mechanism has {ratio} (NTC-2018 SLV) with 1.41 times"
    given = f"the forces of the ties, and with those given the least is {own:.3g}: "
    assert doubt.startswith(f"{lower} {given}")
    # a bound from below bounds no ratio with less force
    assert "with these it is not shown to pass either" in doubt


def test_the_end_of_a_path_by_a_tie_is_read_from_no_text(monkeypatch):
    name_event = PathFollower._name_event

    def reword(*given):
        event = name_event(*given)
        return event if isinstance(event.text, PathEnd) else replace(event, text="in other words")

    monkeypatch.setattr(PathFollower, "_name_event", reword)
    path = assess_tied(4.0, 2e4).path
    assert path.end is PathEnd.RELEASED
    assert path.events[-1].text == "in other words"


def test_a_bar_between_posts_that_turn_alike_changes_nothing():
    """The lintel keeps the distance of its points already."""
    contact, blocks = af.Contact(1e9, 4e8, friction=None), []
    for name, x, breadth, low, high in (
        ("ground", -1.0, 5.0, -0.5, 0.0),
        *(("left", 0.0, 0.5, 0.0, 2.0), ("right", 2.5, 0.5, 0.0, 2.0)),
        ("lintel", -0.2, 3.4, 2.0, 2.5),
    ):
        corners = ((x, low), (x + breadth, low), (x + breadth, high), (x, high))
        blocks.append(af.Block(corners, af.STONE, name, fixed=name == "ground", role="pier"))
    portal = af.masonry.assembled(blocks, contact)
    ends = {"block": "left", "point": (0.0, 1.8), "anchor": "right", "anchor_point": (3.0, 1.8)}
    bar = af.masonry.AttachedLoad(**ends, force=(1e4, 0.0), passive=True)
    tied, free = (af.kinematic_assessment(portal, SPECTRUM, loads=each) for each in ([bar], []))
    assert tied.alpha_0 == pytest.approx(free.alpha_0, rel=1e-6)
    assert tied.d_0_star == pytest.approx(free.d_0_star, rel=1e-6)


@pytest.mark.parametrize(
    ("height", "doubted"), [(3.0, True), pytest.param(0.1, False, marks=pytest.mark.slow)]
)
def test_a_tie_is_stretched_up_to_the_capacity(height, doubted):
    """As one body about the toe: its point moves by h sin θ + b/2 (1 - cos θ), of α(θ_0) = 0."""
    force, weight, b, top = 2e3, 40e3, 0.5, 4.0
    found = assess_tied(height, force)
    falls = atan2(weight * b / 2 + force * height, (weight * top - force * b) / 2)
    move = [y * sin(falls) + b / 2 * (1.0 - cos(falls)) for y in (1.0, 3.0)]
    # δ is 1 and 3, that of the control point
    assert found.d_0_star == pytest.approx(move[1] * (1 + 9) / (3 * (1 + 3)), rel=1e-3)
    capacity = 0.4 * move[1]
    turn = brentq(lambda angle: 3.0 * sin(angle) + b / 2 * (1.0 - cos(angle)) - capacity, 0.0, 1.0)
    stretch = height * sin(turn) + b / 2 * (1.0 - cos(turn))
    assert f"to the capacity stretched by {1e3 * stretch:.3g} mm at block" in found.notes[0]
    (doubt,) = found.doubts or (None,)
    assert (doubt is not None) == doubted == (stretch > 0.04)
    assert found.displacement.bounded == doubted
    if doubt:
        says = f"stretched by {1e3 * stretch:.3g} mm, by which iron that bears 2 % breaks unless "
        says += f"{50.0 * stretch:.3g} m of bar are free: the displ"
        assert not found.displacement.passes
        assert found.displacement.words == "passes by an upper bound alone"
        assert says in doubt.cause
    free = assess_tied(height, force, direction=-1.0)
    assert "to the capacity stretched by 0 mm at block" in free.notes[0]
    assert not free.doubts


def test_a_tie_that_slackened_pulls_beyond_its_length_at_rest_alone(verified):
    """A block of 0.6 × 2.4 m hangs by a corner at r from its toe, 0.1 rad off their line.

    The tie is longer than at rest by r (cos 0.1 - cos(θ - 0.1)); moments about the toe give α.
    """
    wall, off, arm = af.column(breadth=0.6, heights=[2.4]), 0.1, np.hypot(0.6, 2.4)
    weight = 0.6 * 2.4 * wall.blocks[-1].material.unit_weight
    angle = atan2(2.4, -0.6) - off
    force = 0.1 * weight * np.array([cos(angle), sin(angle)])
    tie = af.masonry.AttachedLoad("block 1", (-0.3, 2.4), force=tuple(force), passive=True)
    found = af.kinematic_assessment(wall, SPECTRUM, loads=[tie])
    turns = -found.path.displacements[:, 1, 2]
    taut = turns > 2.0 * off
    assert 0 < taut.sum() < (turns > off).sum() < len(turns)
    held = taut * 0.1 * arm * np.sin(turns - off)
    lever = 1.2 * np.cos(turns) + 0.3 * np.sin(turns)
    factors = (0.3 * np.cos(turns) - 1.2 * np.sin(turns) + held) / lever
    largest = np.abs(found.path.factors - factors).max()
    verified("tie that slackens and tightens: largest error of α", 0.0, "moments", largest)
    assert largest < 1e-6  # round-off


@pytest.mark.parametrize("length", ["4 m", "15 m", "60 m"])
def test_a_tie_breaks_by_its_free_length(length, verified):
    """A block of 0.6 × 6 m about its toe; at 3.8 m it moves by 3.8 sin θ + 0.3 (1 - cos θ).

    The iron of the tie there breaks at 8 cm, before the capacity, at 30 cm, beyond it, or never.
    """
    tie = {"block": "block 1", "point": [0.0, 3.8], "force": [-2e3, 0.0], "passive": True}
    wall = af.column(breadth=0.6, heights=[6.0])
    spectrum = af.motion.Ntc2018(ag=0.15, f0=2.5, tc_star=0.33, site="B")
    free, tied = (
        af.kinematic_assessment(
            wall, spectrum, loads=[read_object(af.masonry.AttachedLoad, tie | more, "loads")]
        )
        for more in ({}, {"free_length": length})
    )
    (doubt,) = free.doubts
    assert doubt.remedy == "verify its free length, and give it as `free_length`"

    def move(turn, height=3.0):
        return height * sin(turn) + 0.3 * (1.0 - cos(turn))

    limit = 0.02 * float(length.removesuffix(" m"))
    broken = move(brentq(lambda turn: move(turn, 3.8) - limit, 0.0, 1.0))
    early = broken < free.d_0_star
    assert early == (length != "60 m")
    assert (broken < free.displacement.capacity) == (length == "4 m")
    assert (tied.path.end is PathEnd.BREAKS) == tied.displacement.at_least == early
    assert not tied.displacement.bounded
    assert not any("stretched by" in str(each) for each in tied.doubts)
    if early:
        moved = float(tied.curve["d"][-1])
        verified(f"tie of {length}: d* at which it breaks [m]", broken, "rotation", moved)
        assert moved == pytest.approx(broken, rel=1e-4)  # of a step, which is straight
        assert tied.displacement.capacity == pytest.approx(0.4 * broken, rel=1e-4)
        assert np.isinf(tied.d_0_star)
        says = "a tie breaks, at a strain of 2 % of its free length: that at block 1, and the "
        says += f"displacement check counts d* = {moved:.4g} m there as d_0*, on the safe side"
        weight = 3.6 * wall.blocks[1].material.unit_weight
        turn = brentq(lambda turn: move(turn, 3.8) - limit, 0.0, 1.0)
        held = 2e3 * (3.8 * cos(turn) + 0.3 * sin(turn)) / weight
        factor = (0.3 * cos(turn) - 3.0 * sin(turn) + held) / (3.0 * cos(turn) + 0.3 * sin(turn))
        assert tied.path.factors[-1] == pytest.approx(factor, rel=1e-3)
    else:
        assert (tied.displacement.ratio, tied.doubts) == (free.displacement.ratio, ())
        assert tied.displacement.passes
        says = " mm at block 1 (it breaks at 1200 mm)\n"
    assert says in str(tied)


@pytest.mark.slow
def test_a_stronger_tie_that_breaks_puts_a_given_one_in_no_doubt():
    """The wall above: of 36 m it breaks at 0.72 m, beyond the fall, and with more force before."""
    spectrum = {"code": "NTC-2018", "ag": 0.165, "f0": 2.5, "tc_star": 0.33, "site": "B"}
    tie = {"block": "block 1", "point": [0.0, 3.8], "force": [-2e3, 0.0], "passive": True}
    loads = [tie | {"free_length": "36 m"}]
    column = {"shape": "column", "breadth": 0.6, "heights": [6.0]}
    assessment = {"spectrum": spectrum, "direction": 1, "loads": loads}
    case = af.Case.of({"structure": column, "assessment": assessment})
    (found,) = case.assessment.solve(case.structure, None).values()
    assert (found.passes, found.path.end) == (True, PathEnd.FALLS)
    (note,) = note_ties(case)
    assert note.startswith("note: pushed to the right, from ")


def test_a_force_acts_on_its_block():
    """A mistyped height of 2.7 m on a block that ends at 2 m; a mass may stand above its block."""
    strip = af.column(breadth=0.5, heights=[2.0, 2.0])
    force = af.masonry.AttachedLoad("block 1", (0.0, 2.7), force=(-2e3, 0.0), passive=True)
    says = (
        r"2\.7\) m, 0\.7 m from 'block 1' \(x .* y from 0 to 2 m\), above the 0\.2 m of an anchor"
    )
    with pytest.raises(af.InvalidInput, match=says):
        af.kinematic_assessment(strip, SPECTRUM, loads=[force])
    for load in (replace(force, point=(0.0, 2.19)), replace(force, force=(0.0, 0.0), weight=1e3)):
        assert af.kinematic_assessment(strip, SPECTRUM, loads=[load]).alpha_0 > 0.0


@pytest.mark.parametrize(
    ("height", "kept"),
    [
        (4.0, ""),
        (4.1, "1 kN 2.1 m from block 1"),
        pytest.param(6.0, "1 kN 4 m from block 1", marks=pytest.mark.slow),
        (27.0, None),
    ],
)
def test_a_mass_acts_within_the_size_of_the_stones(height, kept):
    """A block that ends at 2 m and is as high, of a strip of 4 m: 27 m for 2.7 m are refused."""
    strip = af.column(breadth=0.5, heights=[2.0, 2.0])
    load = af.masonry.AttachedLoad("block 1", (0.0, height), weight=1e3)
    if kept is None:
        says = r"mass acts at \(0\.0, 27\.0\) m, 25 m from 'block 1' .* the 4 m of all stones"
        with pytest.raises(af.InvalidInput, match=says):
            af.kinematic_assessment(strip, SPECTRUM, loads=[load])
        return
    found = af.kinematic_assessment(strip, SPECTRUM, loads=[load])
    assert found.alpha_0 == pytest.approx(41e3 * 0.25 / (40e3 * 2.0 + 1e3 * height), rel=1e-4)
    notes = [note for note in found.notes if note.startswith("masses act further from")]
    assert len(notes) == bool(kept)
    assert all(f", {kept}: verify" in note for note in notes)


def test_a_portal(verified):
    """Columns b x h rock about their corners, the lintel moves with their tops: α = tan(β - θ)."""
    b, h, span = 0.5, 2.5, 3.0
    blocks = (
        box(0.0, b, -0.5, 0.0, "left base", fixed=True),
        box(0.0, b, 0.0, h, "left column"),
        box(span, span + b, -0.5, 0.0, "right base", fixed=True),
        box(span, span + b, 0.0, h, "right column"),
        box(0.0, span + b, h, h + 0.4, "lintel"),
    )
    joints = (
        *(bed((0, 1), 0.0, b, 0.0), bed((2, 3), span, span + b, 0.0)),
        *(bed((1, 4), 0.0, b, h), bed((3, 4), span, span + b, h)),
    )
    found = af.kinematic_assessment(af.Structure(blocks, joints), SPECTRUM)
    weights = np.array([b * h, b * h, (span + b) * 0.4])
    share, acceleration = oscillator(weights, [h / 2, h / 2, h], b / h)
    beta, radius = atan2(b, h), sqrt(b**2 + h**2)
    d_0 = b * (weights @ np.array([0.25, 0.25, 1.0])) / (weights @ np.array([0.5, 0.5, 1.0]))
    expected = {"alpha_0": b / h, "e_star": share, "a_0_star": acceleration, "d_0_star": d_0}
    check_values(found, expected, verified, "portal")
    # along the whole path; the lintel moves by b - R sin(β - θ)
    turn = beta - np.arcsin((b - found.curve["d_control"].values) / radius)
    np.testing.assert_allclose(found.curve["alpha"], np.tan(beta - turn), atol=1e-7)


@pytest.mark.slow
def test_the_ring_of_the_readme(ring, verified):
    """Values of its four hinges moved as a four-bar by another program."""
    found = ring
    expected = {"alpha_0": 0.4571, "e_star": 0.809, "a_0_star": 0.565 * G, "d_0_star": 0.2785}
    check_values(found, expected | {"T_s": 0.629}, verified, "README ring as a four-bar")
    assert [joint for joint, _ in found.hinges] == [0, 6, 12, 17]
    assert found.sliding == ()
    assert found.curve["a"].values[0] == found.a_0_star
    assert found.curve["d"].values[-1] == found.d_0_star
    # of the centroid of all weights, d_C / e*, by the displacements of equal voussoirs
    moved = found.path.displacements[-1][list(RING.free), 0].mean() / found.e_star
    assert f"all weights, with a d_0* of {moved:.4g} m" in found.notes[0]


def test_an_arch_on_piers_has_the_mass_of_its_moving_blocks(verified):
    """Hinges at joints 3, 7, 11 and the right pier's base: bodies by instantaneous centres."""
    structure = af.arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=11, pier_breadth=1.2, courses=[1.5, 1.5]
    )
    found = af.kinematic_assessment(structure, SPECTRUM)
    ends = {"intrados": 0, "extrados": 1}
    a, b, c, d = (structure.joints[j].ends[ends[side]] for j, side in found.hinges)
    # the middle body turns about the point where lines ab and dc meet
    s, _ = np.linalg.solve(np.column_stack([b - a, d - c]), d - a)
    centre = a + s * (b - a)
    ratio = np.linalg.norm(b - a) / np.linalg.norm(b - centre) * np.sign((b - a) @ (b - centre))
    last = ratio * ((c - centre) @ (c - d)) / ((c - d) @ (c - d))
    centres, turns = (a, centre, d), (1.0, ratio, last)
    joints = [joint for joint, _ in found.hinges]
    blocks = [number for number in structure.free if found.path.mechanisms[0].body[number] >= 0]
    weights, across, up = [], [], []
    for number in blocks:
        block = structure.blocks[number]
        body = int(np.searchsorted(joints[1:3], number - 0.5))
        body = 2 if block.part == "right pier" else body
        x, y = block.centroid - centres[body]
        weights.append(block.area * block.material.unit_weight)
        across.append(-turns[body] * y)
        up.append(turns[body] * x)
    factor = np.dot(weights, up) / np.dot(weights, across)
    share, acceleration = oscillator(weights, across, factor)
    expected = {"alpha_0": factor, "e_star": share, "a_0_star": acceleration}
    check_values(found, expected, verified, "arch on piers by instantaneous centres")


def test_the_linear_check_multiplies_by_q_and_divides_by_confidence():
    block = af.column(breadth=0.6, heights=[2.4])
    found = af.kinematic_assessment(block, SPECTRUM, q=3.0, confidence_factor=1.2)
    ground = float(SPECTRUM.horizontal(0.0)) * 9.80665
    assert found.linear.capacity == pytest.approx(3.0 * found.a_0_star / 1.2)
    assert found.linear.demand == pytest.approx(ground, rel=1e-9)
    assert found.linear.ratio == pytest.approx(found.linear.capacity / ground)
    assert "C8.7.1.2.1.7" in found.linear.source


@pytest.mark.parametrize(
    ("name", "share", "factor", "secant", "damping"),
    [
        ("NTC-2018 SLV", 0.4, 1.68, 1.0, 0.08),
        pytest.param("NTC-2018 SLC", 0.6, 1.56, 1.0, 0.10, marks=pytest.mark.slow),
        ("NTC-2008 SLV", 0.4, 2.0, 0.4, 0.05),
    ],
)
def test_displacement_checks_of_a_rigid_block(name, share, factor, secant, damping):
    """Capacity, period and demand by the formulas of the code, to 1e-3."""
    block = af.column(breadth=0.6, heights=[2.4])
    check = af.kinematic_assessment(block, SPECTRUM, limit_state=name).displacement
    d, radius = share * 0.3, sqrt(0.3**2 + 1.2**2)
    acceleration = G * np.tan(np.arcsin((0.3 - secant * d) / radius)) / 1.35
    period = factor * pi * sqrt(secant * d / acceleration)
    assert check.capacity == pytest.approx(d, rel=1e-3)
    assert check.period == pytest.approx(period, rel=1e-3)
    demand = replace(SPECTRUM, damping=damping).horizontal(period) * G * (period / 2 / pi) ** 2
    assert check.demand == pytest.approx(float(demand), rel=1e-3)
    assert check.ratio == pytest.approx(d / float(demand), rel=2e-3)
    assert check.source == LIMIT_STATES[name].source


def test_a_mechanism_that_the_ground_does_not_start_passes():
    """a0*/FC above the ground acceleration passes, for any displacement spectrum."""
    weak = af.motion.TableSpectrum([0.0, 4.0], [0.05, 3.0])
    found = af.kinematic_assessment(af.column(breadth=0.6, heights=[2.4]), weak)
    assert found.displacement.demand > found.displacement.capacity
    assert found.displacement.ratio == pytest.approx(0.25 / 1.35 / 0.05, rel=1e-3)
    assert found.passes
    # without these words a capacity below the demand reads as if it failed
    assert str(found.displacement).endswith(
        "3.7 times as strong before the mechanism begins to move"
    )
    assert found.displacement.at_rest
    assert not found.linear.at_rest


def test_rules_of_another_code_and_motions():
    block = af.column(breadth=0.6, heights=[2.4])
    motion = af.Motion.synthetic(duration=4.0, pga=2.0, seed=1)
    check = af.kinematic_assessment(block, motion, limit_state=OWN).displacement
    assert (check.name, check.capacity) == ("of our own", pytest.approx(0.15, rel=1e-4))
    periods = np.arange(0.002, check.period, 0.002)
    spectrum = af.response_spectrum(motion, periods, 0.05) * (periods / 2 / pi) ** 2
    # both rows of periods have steps of a few ms
    assert check.demand == pytest.approx(spectrum.max(), rel=1e-3)


@pytest.mark.parametrize("period", [0.31, 0.57, 0.83])
def test_a_narrow_peak_of_a_motion_is_part_of_the_demand(period):
    """A long sine moves an oscillator most by its static displacement / (2 ζ √(1 - ζ²))."""
    times, ratio = np.arange(6000) * 0.005, 0.08
    motion = af.Motion(0.6 * np.sin(2.0 * pi * times / period), 0.005)
    block = af.column(breadth=0.6, heights=[3.0])
    check = af.kinematic_assessment(block, motion, confidence_factor=1.0).displacement
    assert check.period > 1.5
    exact = 0.6 * (period / 2.0 / pi) ** 2 / (2.0 * ratio * sqrt(1.0 - ratio**2))
    # steps d of 4.2 ms miss up to (d / 2 ζ T)² / 2 of a peak at T
    assert check.demand == pytest.approx(exact, rel=4e-3)


def test_a_point_of_a_table_is_part_of_the_demand():
    """S_d = S (T / 2π)² is largest there, by far, with S of the code's 8 % by η."""
    rows = [0.0, 0.2, 0.599, 0.6, 0.601, 1.5, 4.0], [0.2, 0.5, 0.3, 2.0, 0.3, 0.1, 0.02]
    block = af.column(breadth=0.6, heights=[3.0])
    check = af.kinematic_assessment(block, af.motion.TableSpectrum(*rows)).displacement
    exact = 2.0 * G * sqrt(10.0 / 13.0) * (0.6 / 2.0 / pi) ** 2
    assert check.demand == pytest.approx(exact, rel=1e-3)


def test_spectra_at_another_damping_and_beyond_four_seconds():
    eta = sqrt(10.0 / 13.0)
    five = af.Tbec2018(ss=1.0, s1=0.3, site="ZC")
    np.testing.assert_allclose(
        spectral_acceleration(five, np.array([1.0]), 0.08),
        G * eta * five.horizontal([1.0]),
        rtol=1e-3,
    )
    four, eight = spectral_acceleration(SPECTRUM, np.array([4.0, 8.0]), 0.08)
    assert eight == pytest.approx(four / 4.0)


@pytest.mark.slow
def test_parts_and_blocks_by_themselves():
    blocks = (
        box(0.0, 3.0, -0.5, 0.0, "base", fixed=True, part="ground", role="other"),
        box(0.0, 0.5, 0.0, 1.0, "low", part="low pier"),
        box(2.0, 2.3, 0.0, 0.6, "foot", part="tall pier"),
        box(2.0, 2.3, 0.6, 1.8, "head", part="tall pier"),
    )
    joints = (bed((0, 1), 0.0, 0.5, 0.0), bed((0, 2), 2.0, 2.3, 0.0), bed((2, 3), 2.0, 2.3, 0.6))
    structure = af.Structure(blocks, joints)
    found = af.statics.assess_parts(structure, SPECTRUM)
    assert {name: round(each.alpha_0, 6) for name, each in found.items()} == {
        "low pier": 0.5,
        "tall pier": round(0.3 / 1.8, 6),
    }
    # only the joints of the head may move
    head = af.kinematic_assessment(structure, SPECTRUM, blocks=["head"])
    assert head.alpha_0 == pytest.approx(0.25)
    whole = af.kinematic_assessment(structure, SPECTRUM)
    assert whole.alpha_0 == pytest.approx(0.3 / 1.8)


@pytest.mark.slow
def test_sliding_with_and_without_dilatancy():
    contact = af.Contact(1.48e9, 0.30e9, 0.5)
    ring = af.circular_arch(radius=2.95, thickness=0.9, embrace=159.0, voussoirs=9, contact=contact)
    both = {
        law: af.kinematic_assessment(ring, SPECTRUM, friction=law)
        for law in ("coulomb", "nonassociated", None)
    }
    flat = af.collapse_factor(ring, live=af.BodyForce(1.0), friction="nonassociated")
    assert both["nonassociated"].alpha_0 == pytest.approx(flat.factor, rel=1e-4)
    assert both["coulomb"].sliding == (9,)
    assert both[None].sliding == ()
    assert both[None].alpha_0 > both["coulomb"].alpha_0


@pytest.mark.slow
@pytest.mark.parametrize("friction", ["coulomb", "nonassociated"])
def test_sliding_has_no_capacity_of_displacement(friction):
    """Nor do the edges of a drawn ground count: alpha stays at μ = 0.6 as the stones slide."""
    for ledge in (0.3, 1.0):
        edge = 2.0 + ledge
        ground = box(-edge, edge, -0.5, 0.0, "ground", fixed=True)
        slabs = box(-2.0, 2.0, 0.0, 0.5, "lower"), box(-2.0, 2.0, 0.5, 1.0, "upper")
        squat = af.masonry.assembled([ground, *slabs], af.Contact(1e9, 1e9, friction=0.6))
        found = af.kinematic_assessment(squat, SPECTRUM, friction=friction)
        assert found.alpha_0 == pytest.approx(0.6)
        assert found.checks == [found.linear]
        assert (found.path.end.name, len(found.path.factors)) == ("SLIDES", 1)
        (note,) = found.notes
        assert note.startswith("this mechanism slides without turning")
        for text in (str(found), found.table(), repr(found)):
            assert "d_0" not in text
            assert "nan" not in text
        assert "(one of many: all bed joints reach μ)" in str(found)
        assert "kg of this body, " in str(found)
        assert found.plot() is not None
    turning = af.kinematic_assessment(squat, SPECTRUM, friction=None)
    assert "d_0* = " in str(turning)
    assert "one of many" not in str(turning)


@pytest.mark.slow
def test_without_a_displacement_check_the_spectrum_of_the_start_is_said():
    """A slab slides from μ g on, over FC and the ground acceleration; q raises all above it."""
    slab = af.column(breadth=2.0, heights=[1.0], contact=af.Contact(1e9, 1e9, friction=0.6))
    for q in (1.0, 2.0):
        found = af.kinematic_assessment(slab, SPECTRUM, q=q)
        start = 0.6 * G / 1.35 / found.linear.demand
        assert found.linear.ratio == pytest.approx(q * start)
        assert f"; it moves from {start:.3g} times the spectrum on (q = 1), and" in found.notes[0]


@pytest.fixture(scope="module")
def wedge():
    """A wall in bond whose wedge no finite motion follows, and the weakest mechanism found."""
    wall = bonded_wall(7, half=1.0)
    found = af.collapse_factor(wall, live=af.BodyForce(1.0), friction="nonassociated")
    return found, af.kinematic_assessment(wall, SPECTRUM)


@pytest.mark.slow
def test_a_search_that_finds_nothing_leaves_the_mechanism_that_dilates(monkeypatch):
    """Its factor is the upper bound of the static theorem, and no lower bound of the search."""
    monkeypatch.setattr("archfem.limit.nonassociated.find_solution", lambda *_, **__: None)
    monkeypatch.setattr("archfem.limit.nonassociated.descend", lambda *_, **__: [])
    wall = bonded_wall(7, half=1.0)
    found = af.kinematic_assessment(wall, SPECTRUM)
    dilating = af.collapse_factor(wall, live=af.BodyForce(1.0), strength=np.inf)
    assert found.alpha_0 == pytest.approx(dilating.factor)
    assert found.displacement is None
    assert found.checks == [found.linear]
    assert "a search without dilatancy found none: hold a motion" in str(found.doubts)


@pytest.mark.slow
def test_a_wedge_of_a_wall_in_bond_has_the_linear_check_alone(wedge, verified):
    """e*, M* and a0* by hand from displacements at rest, alpha_0 by their work and of friction.

    Associated flow has a larger factor, and its mechanism cannot begin without dilatancy.
    """
    (limit, found), wall = wedge, wedge[0].structure
    # a number, so that those of both senses are stated in one doubt
    (push,) = [x.values[1] for x in found.doubts if "without dilatancy found, and" in x.words]
    assert push == pytest.approx(0.9 * limit.factor, rel=1e-4)
    free = list(wall.free)
    sizes = [np.ptp(np.array(wall.blocks[k].outline), axis=0) for k in free]
    weights = np.array([0.4 * breadth * height * STONE for breadth, height in sizes])
    across, up, _ = limit.motion[free].T
    friction = 0.0  # work of 0.6 N on the slips of beds and heads
    for joint, normal in zip(wall.joints, limit.joints["N"].values, strict=True):
        middle, along = joint.ends.mean(axis=0), np.diff(joint.ends, axis=0)[0]
        jump = np.zeros(2)
        for block, sign in zip(joint.blocks, (-1.0, 1.0), strict=True):
            x, y = middle - wall.blocks[block].centroid
            speed, rise, rotation = limit.motion[block]
            jump += sign * np.array([speed - rotation * y, rise + rotation * x])
        friction += 0.6 * normal * abs(jump @ along) / np.hypot(*along)
    factor = (weights @ up + friction) / (weights @ across)
    moves = np.abs(limit.motion[free]).max(axis=1) > 1e-9
    share, acceleration = oscillator(weights[moves], across[moves], factor)
    expected = {"alpha_0": factor, "e_star": share, "a_0_star": acceleration}
    expected["M_star"] = share * weights[moves].sum() / G
    check_values(found, expected, verified, "wedge of a wall in bond", 1e-6)
    # joints that have come apart, by less than μ of their slip too, neither slide nor turn
    assert set(limit.sliding) == set(found.sliding)
    assert {k for k, _ in limit.hinges} - set(limit.sliding) == {k for k, _ in found.hinges}
    associated = af.collapse_factor(wall, live=af.BodyForce(1.0)).factor
    assert found.alpha_0 == pytest.approx(limit.factor, rel=1e-9)
    assert found.alpha_0 < 0.999 * associated
    assert found.displacement is None
    assert found.checks == [found.linear]
    assert found.linear.ratio == pytest.approx(2.0 * acceleration / 1.35 / found.linear.demand)
    assert "there is no displacement check" in found.notes[0]
    foot, doubt = (doubt.cause for doubt in found.doubts)  # it rests on the first course
    assert foot.startswith("the spectrum is that of the ground, and 0.25 m above it, ")
    assert doubt.startswith("alpha_0 is an upper bound, the least that a search")
    # of e* = 1, as a_0* = alpha_0 g / e*
    least = 2.0 * factor * G / 1.35 / found.linear.demand
    ends = f"{least:.3g} (e* = 1, whatever moves at this alpha_0) to {found.linear.ratio:.3g}"
    assert f"the spectrum may be {ends} times as strong" in str(found)
    assert found.linear.floor == pytest.approx(least, rel=1e-6)
    assert find_margin([found]) == pytest.approx(least, rel=1e-6)
    assert f"it moves from {0.5 * least:.3g} times the spectrum on (q = 1)" in found.notes[0]
    apart = found.linear.bodies and f", {found.linear.ratio:.3g} with the weights apart"
    own = f"{found.linear.bodies or found.linear.ratio:.3g} of the mechanism found{apart or ''}"
    assert describe_margin([found]).startswith(f"least margin {least:.3g} with e* = 1 ({own}), by")
    # between the ratio of e* = 1 and that of the mechanism another one decides
    for scale, outcome in ((0.99, "passes"), (1.01, BY_MECHANISM)):
        ratios = {k: getattr(found.linear, k) / (scale * least) for k in ("ratio", "floor")}
        check = replace(found.linear, bodies=None, **ratios)
        assert (check.outcome, check.passes) == (outcome, False)  # an upper bound shows nothing
        assert replace(check, bounded=False).passes == (scale < 1.0)
    assert f"e* = {share:.3f} of the {weights[moves].sum() / 1e3:.4g} kN that move" in str(found)
    assert all(UPPER_BOUND in doubt.values for doubt in found.doubts)
    assert found.linear.bounded
    assert "nan" not in str(found) + found.table()
    assert "NTC-2018 SLV" not in str(found)


@pytest.mark.slow
def test_a_wall_in_bond_that_crushes_is_searched_with_its_hinges_set_back(wedge):
    """Without sliding the factor is that of limit analysis; with it less than without dilatancy."""
    wall, strength = wedge[0].structure, 1e6
    for friction in (None, "nonassociated"):
        found = af.kinematic_assessment(wall, SPECTRUM, friction=friction, strength=strength)
        law = friction and "coulomb"
        given = {"live": af.BodyForce(1.0), "friction": law, "strength": strength}
        limit = af.collapse_factor(wall, **given).factor
        if friction is None:
            assert found.alpha_0 == pytest.approx(limit, rel=1e-4)
        else:
            assert 0.9 * limit < found.alpha_0 < min(limit, 0.99 * wedge[0].factor)


@pytest.mark.slow
def test_a_wedge_under_loads_has_an_upper_estimate(wedge):
    """Loads are not searched without dilatancy: the factor of associated flow, with a doubt."""
    wall = wedge[0].structure
    corner = wall.free[0]  # with a weight too small to count
    load = af.masonry.AttachedLoad(corner, tuple(wall.blocks[corner].centroid), weight=1e-3)
    part = af.kinematic_assessment(wall, SPECTRUM, loads=[load])
    assert part.displacement is None
    assert part.alpha_0 > wedge[1].alpha_0
    assert part.doubts[1].cause.startswith("faces dilate as this mechanism slides: alpha_0 = ")


@pytest.mark.slow
def test_a_fill_is_weight_on_the_stones():
    """The factor is that of limit analysis with a fill that presses on nothing, to 1e-6."""
    bridge = arch_bridge()
    found = af.kinematic_assessment(bridge, SPECTRUM)
    fill = af.limit.Fill(friction_angle=35.0, mobilisation=0.0, active=0.0)
    expected = af.collapse_factor(bridge, live=af.BodyForce(1.0), fill=fill).factor
    assert found.path.mechanisms[0].factor == pytest.approx(expected, rel=1e-6)
    assert "the fill counts as weight" in found.doubts[0].cause
    with pytest.raises(af.InvalidInput, match="attached loads or a fill: use 'coulomb'"):
        af.kinematic_assessment(bridge, SPECTRUM, friction="nonassociated")


@pytest.mark.slow
@pytest.mark.parametrize("lever", [1.0, 0.0])
def test_a_body_on_the_fill_is_weight_and_mass_and_no_load_is_attached_to_fill(lever):
    """The factor is that of limit analysis, under either assumption on the fill's inertia."""
    bridge = arch_bridge(voussoirs=5)
    body = {"x": 3.5, "length": 1.0, "weight": 30e3, "centre_of_gravity": 0.8}
    loaded = af.masonry.carrying(bridge, [af.masonry.StandingBody(**body)])
    fill = af.limit.Fill(friction_angle=35.0, mobilisation=0.0, active=0.0, lever=lever)
    found = af.kinematic_assessment(loaded, SPECTRUM, fill=fill)
    expected = af.collapse_factor(loaded, live=af.BodyForce(1.0), fill=fill).factor
    assert found.path.mechanisms[0].factor == pytest.approx(expected, rel=1e-6)
    load = af.masonry.AttachedLoad("backfill", (3.5, 1.5), weight=30e3)
    with pytest.raises(af.InvalidInput, match=r"'backfill', which is fill and no stone: stand it"):
        af.kinematic_assessment(bridge, SPECTRUM, loads=[load])
    plastic = af.limit.PlasticFill(friction_angle=35.0)
    with pytest.raises(af.InvalidInput, match="cannot take a PlasticFill"):
        af.kinematic_assessment(bridge, SPECTRUM, fill=plastic)
    own = af.masonry.AttachedLoad(bridge.free[0], (2.2, 0.2), force=(0.0, -1.0))
    noted = af.kinematic_assessment(bridge, SPECTRUM, loads=[own])
    assert any("constant forces have no mass" in note for note in noted.notes)


@pytest.mark.slow
@pytest.mark.parametrize(("direction", "part"), [(-1.0, 1.0), (1.0, 0.4)])
def test_a_wall_turns_from_the_fill_behind_it_or_into_it(direction, part, verified):
    """Active or passive thrust at a third of its height about the toe, at rest and turned."""
    fill = af.limit.Fill(friction_angle=30.0, mobilisation=0.4)
    wall = retaining_wall()
    options = {"direction": direction, "friction": None, "fill": fill}
    found = af.kinematic_assessment(wall, SPECTRUM, **options)
    breadth, height, weight = 1.0, 2.0, 2.0 * STONE
    # it holds the wall back, or pushes it over
    thrust = direction * part * 3.0**direction * 0.5 * SOIL.unit_weight * height**2
    path = found.path
    turn = np.abs(path.displacements[:, 1, 2])
    c, s = np.cos(turn), np.sin(turn)
    lever = height / 3.0 * c + (breadth * s if direction < 0.0 else 0.0)
    factors = 0.5 * weight * (breadth * c - height * s) + thrust * lever
    factors /= 0.5 * weight * (height * c + breadth * s)
    assert path.factors[:-1] == pytest.approx(factors[:-1], rel=1e-9)
    assert path.factors[-1] == pytest.approx(0.0, abs=1e-8)
    assert "all along the motion" in found.notes[0]
    verified(
        f"wall beside a fill, pushed {direction:+g}: alpha_0",
        factors[0],
        "closed form",
        found.alpha_0,
    )


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ground", *(x for x in ("strut", "fill"))])
def test_backing_holds_a_wall_against_the_ground_and_against_another_wall(kind):
    """At rest its strength acts about the toe: λ W H/2 = W b/2 + S h²/2; two walls turn at once."""
    level, weight = 0.1, 2.0 * STONE
    fill = af.limit.Fill(friction_angle=30.0, mobilisation=0.0, active=0.0, backing=level)
    strut = replace(fill, backing_strength=1e8)
    structure, given, expected = {
        "ground": (retaining_wall(), fill, 0.5 + 0.5e6 * level**2 / weight),
        "strut": (two_walls(), strut, (2.0 * 0.5 + 4.0 * 1.0) / 6.0),
        "fill": (two_walls(), af.limit.Fill(friction_angle=30.0), (2.0 * 0.5 + 4.0 * 1.0) / 6.0),
    }[kind]
    found = af.kinematic_assessment(structure, SPECTRUM, friction=None, fill=given)
    assert found.path.mechanisms[0].factor == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "build",
    [
        partial(arch_bridge, voussoirs=8),
        partial(slender_bridge, left=(8.4, 2.1), right=(6.0, 1.2)),
    ],
    ids=["arch", "spans"],
)
def test_pressures_of_a_fill_are_those_of_limit_analysis(build):
    """The first factor of a bridge on a fill is the collapse factor, also with a cohesive one."""
    fill, bridge = af.limit.Fill(friction_angle=35.0, cohesion=2e3), build()
    found = af.kinematic_assessment(bridge, SPECTRUM, fill=fill)
    expected = af.collapse_factor(bridge, live=af.BodyForce(1.0), fill=fill).factor
    assert found.path.mechanisms[0].factor == pytest.approx(expected, rel=1e-6)
    bare = af.limit.Fill(friction_angle=35.0, mobilisation=0.0, active=0.0)
    assert expected > 1.05 * af.collapse_factor(bridge, live=af.BodyForce(1.0), fill=bare).factor


def test_words_table_and_a_mechanism_that_never_moves(ring):
    found = ring
    text = str(found)
    assert "joint 6 at the extrados" in text
    assert "NTC-2018 SLV: capacity 0.1114 m" in text
    assert "in doubt: beyond d* = " in text  # joints that the mechanism keeps closed
    assert "d_0_star" in found.table()
    assert "alpha_0 0.4571" in repr(found)
    piers = af.arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=7, pier_breadth=1.2, courses=[1.5]
    )
    locked = af.kinematic_assessment(piers, SPECTRUM, part="left pier")
    assert (locked.alpha_0, locked.displacement, locked.passes) == (np.inf, None, True)
    assert locked.M_star == 0.0
    assert "no horizontal force makes it a mechanism" in str(locked)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"direction": 0.5}, "direction 0.5: give 1 to the right or -1 to the left"),
        ({"friction": "dry"}, "friction 'dry' is not known: use 'coulomb'"),
        ({"limit_state": "SLV"}, "limit_state = 'SLV' is not known: use one of"),
        ({"q": 0.5}, r"q \[-\] = 0.5 is not between 1 and 10"),
        ({"q": 10.5}, r"q \[-\] = 10.5 is not between 1 and 10"),
        ({"confidence_factor": 2.1}, r"confidence_factor \[-\] = 2.1 is not between 1 and 2"),
        ({"part": "tower"}, "there is no part 'tower' that moves: use one of"),
        ({"blocks": []}, "has none that moves: name some of voussoir 1"),
        ({"blocks": ["voussoir 99"]}, "there is no block 'voussoir 99'"),
        ({"part": "arch", "blocks": [1]}, "part and blocks are both given"),
        ({"spectrum": 0.3}, "spectrum = 0.3 is a float"),
    ],
)
def test_refused_arguments(options, message):
    given = {"spectrum": SPECTRUM} | options
    with pytest.raises(af.InvalidInput, match=message):
        af.kinematic_assessment(RING, given.pop("spectrum"), **given)


def test_refused_structures_and_rules():
    thin = af.circular_arch(radius=1.0, thickness=0.05, embrace=180.0, voussoirs=11)
    with pytest.raises(af.InvalidInput, match="does not stand under its own weight"):
        af.kinematic_assessment(thin, SPECTRUM)
    wall = af.column(breadth=0.6, heights=[2.4])
    push = af.masonry.AttachedLoad(1, (0.0, 2.4), force=(2e4, 0.0))
    with pytest.raises(af.InvalidInput, match=r"does not stand .* forces act whole; a tie, which"):
        af.kinematic_assessment(wall, SPECTRUM, loads=[push])
    # pushed to the right it stands, and falls to the left by itself
    leaning = af.Block(((0.0, 0.0), (0.5, 0.0), (-0.4, 1.5), (-0.9, 1.5)), af.STONE, "leaning")
    base = box(0.0, 0.5, -0.5, 0.0, "base", fixed=True)
    with pytest.raises(af.InvalidInput, match="does not stand under its own weight"):
        af.kinematic_assessment(
            af.Structure((base, leaning), (bed((0, 1), 0.0, 0.5, 0.0),)), SPECTRUM
        )
    bond = af.Contact(1e9, 1e9, 0.6, cohesion=1e5, tension=1e5)
    bonded = af.column(breadth=0.6, heights=[2.4], contact=bond)
    with pytest.raises(af.InvalidInput, match="tensile strength"):
        af.kinematic_assessment(bonded, SPECTRUM)
    with pytest.raises(af.InvalidInput, match=r"attached load, weight .* = -1"):
        af.masonry.AttachedLoad(1, (0.0, 1.0), weight=-1.0)
    with pytest.raises(af.InvalidInput, match=r"above 1e\+09 N: give newtons"):
        af.masonry.AttachedLoad(1, (0.0, 1.0), weight=1e12)


@pytest.mark.slow
def test_cohesion_that_is_left_out_is_named(caplog):
    """The squat stone slides at its friction, 0.6 g, as without cohesion, and a warning says so."""
    glue = af.Contact(1e9, 1e9, 0.6, cohesion=1e5)
    squat = af.column(breadth=2.0, heights=[1.0], contact=glue)
    assert af.kinematic_assessment(squat, SPECTRUM).alpha_0 == pytest.approx(0.6, rel=1e-6)
    assert "a cohesion of 1e+05 Pa, which the assessment leaves out" in caplog.text
    caplog.clear()
    # breadth over height; and no joint slides
    turning = af.kinematic_assessment(squat, SPECTRUM, friction=None)
    assert turning.alpha_0 == pytest.approx(2.0, rel=1e-6)
    assert not caplog.text


@pytest.mark.parametrize(
    ("name", "most"),
    [("share", 1.0), ("period_factor", 10.0), ("secant_share", 1.0), ("damping", 0.5)],
)
def test_rules_of_a_code_are_ratios(name, most):
    rules = LIMIT_STATES["NTC-2018 SLV"]
    assert getattr(replace(rules, **{name: most}), name) == most
    for value in (0.0, 1.04 * most):
        says = rf"{name} \[-\] = .* is not between 0 and {most:g}"
        with pytest.raises(af.InvalidInput, match=says):
            replace(rules, **{name: value})


@pytest.mark.parametrize(
    ("ratio", "passes", "at_rest"),
    [
        (0.5, False, False),
        (0.5 * (1.0 + 0.95e-9), False, False),  # round-off of a ratio of 2 to 4
        (0.5 * (1.0 + 1.05e-9), False, True),
        (0.99, False, True),
        (1.01, True, True),
    ],
)
def test_a_check_is_passed_from_a_ratio_of_one_on(ratio, passes, at_rest):
    check = AssessmentCheck("of our own", 2.0, 4.0, "m", ratio, 1.0, "a test")
    assert (check.passes, check.at_rest) == (passes, at_rest)


@pytest.mark.slow
def test_a_fill_rests_on_the_stone_below_it():
    """Stone and fill turn together about the stone's corner; what rests on rock does not move."""
    soil = ((0.0, 0.5), (0.5, 0.5), (0.5, 0.0), (1.0, 0.0), (1.0, 1.5), (0.0, 1.5))
    blocks = [
        rectangle(0.0, -1.0, 1.0, 0.0, "rock", fixed=True),
        rectangle(0.0, 0.0, 0.5, 0.5, "stone"),
        af.Block(soil, SOIL, "soil", role="other"),
    ]

    def contact(a, b):
        stones = "soil" not in (a.name, b.name)
        return af.masonry.STONE_TO_STONE if stones else af.masonry.SOIL_TO_STONE

    structure = af.masonry.assembled(blocks, contact)
    found = af.kinematic_assessment(structure, SPECTRUM, direction=-1.0, friction=None)
    weights, heights = np.array([0.25 * STONE, 0.5 * SOIL.unit_weight]), np.array([0.25, 0.5])
    factor = weights.sum() * 0.25 / (weights @ heights)
    share, acceleration = oscillator(weights, heights, factor)
    assert (found.alpha_0, found.e_star) == pytest.approx((factor, share), rel=1e-6)
    assert found.a_0_star == pytest.approx(acceleration, rel=1e-6)
    assert "the fill counts as weight" in found.doubts[0].cause


@pytest.mark.slow
def test_sliding_without_dilatancy_is_searched_for_whole_structures_only():
    """Slabs slide, and a pier turns: then there is nothing to search for."""
    slabs, pier = (af.column(breadth=b, heights=[h, h]) for b, h in ((4.0, 0.5), (0.6, 1.2)))
    part = {"blocks": [2], "friction": "nonassociated"}
    with pytest.raises(af.InvalidInput, match="is searched for the whole structure only"):
        af.kinematic_assessment(slabs, SPECTRUM, **part)
    assert af.kinematic_assessment(slabs, SPECTRUM, blocks=[2]).alpha_0 == pytest.approx(0.6)
    assert af.kinematic_assessment(pier, SPECTRUM, **part).alpha_0 == pytest.approx(0.5)


def test_notes_tell_where_the_curve_is_an_upper_bound(ring):
    """From the last place but one on, and of a factor that is less by a thousandth."""
    placed = mechanism_assessment.PlacedBlocks.at_rest(RING, (), 1.0)
    last, factor = len(ring.path.factors) - 1, ring.path.mechanisms[0].factor
    for holds, share, said, bounded in (
        (last, 0.9995, [], (False, False)),
        (last - 1, 0.9995, ["beyond d* = "], (False, False)),
        (0, 0.9995, ["from rest joints open"], (True, True)),
        (last, 0.99895, ["sliding that dilates"], (False, False)),
    ):
        rules = ring.limit_state, ring.confidence_factor, 2.0
        given = mechanism_assessment._Search(
            RING, ring.spectrum, 1.0, "coulomb", None, None, (), *rules
        )
        oscillator = mechanism_assessment._Oscillator(given, placed, ring.path, holds, False)
        own = [x for x in oscillator.notes(share * factor) if not x.startswith("d* is of")]
        notes = [*own, *oscillator.doubts]
        assert all(str(x).startswith(start) for x, start in zip(notes, said, strict=True))
        checks = oscillator.assess().checks
        assert tuple(check.bounded for check in checks) == bounded
    # at rest the start decides, which the curve beyond it does not change
    longer = replace(ring.limit_state, share=0.99, secant_share=0.2, damping=0.5)
    for rules, rests in ((ring.limit_state, True), (longer, False)):
        other = replace(oscillator, holds=last - 1, given=replace(given, rules=rules))
        check = other.assess().displacement
        assert check.at_rest == rests
        assert check.bounded is not rests  # a bool, which files hold


@pytest.mark.slow
@pytest.mark.parametrize(("limit_state", "count"), [("NTC-2018 SLV", 1), (OWN, 0)])
def test_a_check_of_one_code_on_a_spectrum_of_another_is_in_doubt(limit_state, count):
    """Whatever the spectrum of the check's own code, or one without a code, gives."""
    column = af.column(breadth=0.6, heights=[2.4])
    given = {"limit_state": limit_state}
    european = af.kinematic_assessment(column, af.Eurocode8(ag=0.2, ground="B"), **given)
    doubts = [x for x in european.doubts if "not made for a spectrum of EC8; give" in str(x)]
    assert len(doubts) == len(european.doubts) == count
    assert str(european).count("in doubt: the check is one of NTC") == count
    for spectrum in (SPECTRUM, af.motion.TableSpectrum([0.0, 4.0], [0.2, 0.2])):
        assert not af.kinematic_assessment(column, spectrum, **given).doubts


@pytest.mark.slow
def test_courses_that_move_as_one_raise_both_ratios(verified):
    """n equal courses that turn about the base have e* = 3 n² / (4 n² - 1)."""
    whole, split = (
        af.kinematic_assessment(af.column(breadth=0.5, heights=[1.8 / n] * n), SPECTRUM)
        for n in (1, 8)
    )
    check_values(split, {"e_star": 192.0 / 255.0}, verified, "rigid block of eight courses")
    assert split.alpha_0 == pytest.approx(whole.alpha_0)
    assert all(b.ratio > 1.2 * a.ratio for a, b in zip(whole.checks, split.checks, strict=True))
    assert whole.of_bodies.e_star == whole.e_star == 1.0
    check_values(split.of_bodies, {"e_star": 1.0}, verified, "eight courses as one rigid block")
    # the control point is higher up in eight courses
    found = [check.ratio for check in split.of_bodies.checks]
    assert found == pytest.approx([check.ratio for check in whole.checks], rel=0.01)
    stated = f"as strong as {found[0]:.3g} by linear, q = 2, FC = 1.35, {found[1]:.3g} by NTC-2018"
    assert f"gives e* = 1.000, and the spectrum may be {stated}" in str(split)
    assert "weights are at the centroids" not in str(whole)


def test_a_load_is_a_weight_beside_that_of_its_body(verified):
    """Circolare 7/2019, C8.7.1.2.1: M* sums weights of bodies and of what they carry apart."""
    column, loads = af.column(breadth=0.5, heights=[0.9] * 2), [("block 1", 0.9), ("block 2", 1.8)]
    weights, heights = np.array([18.0, 5.0, 9.0]), np.array([0.9, 0.9, 1.8])
    floors = [
        af.masonry.AttachedLoad(name, (0.0, y), weight=1e3 * weight)
        for (name, y), weight in zip(loads, weights[1:], strict=True)
    ]
    tie = af.masonry.AttachedLoad("block 1", (0.0, 0.9), force=(-1.0e3, 0.0), passive=True)
    found = af.kinematic_assessment(column, SPECTRUM, loads=[tie, *floors])
    factor = (0.25 * weights.sum() + 0.9) / (weights @ heights)
    share, acceleration = oscillator(weights, heights, factor)
    expected = {"alpha_0": factor, "e_star": share, "a_0_star": acceleration}
    check_values(found.of_bodies, expected, verified, "one body with two floors", 1e-6)
    assert share < 0.95


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scale", "count"),
    [
        (0.5, 0),
        (1.0, 1),
        (2.0, 1),
        (4.0, 0),
    ],
)
def test_a_check_that_one_weight_a_body_fails_is_no_pass(scale, count):
    """Eight courses against one block: only where both pass, or fail, is the answer sure."""
    site = af.motion.Ntc2018(ag=0.25 * scale, f0=2.4, tc_star=0.32, site="B")
    whole, split = (
        af.kinematic_assessment(af.column(breadth=0.5, heights=[1.8 / n] * n), site) for n in (1, 8)
    )
    outcomes = {(True, True): "passes", (True, False): BY_SPLIT, (False, False): "fails"}
    for one, courses in zip(whole.checks, split.checks, strict=True):
        assert courses.outcome == outcomes[courses.ratio >= 1.0, one.ratio >= 1.0]
    unsure = [check for check in split.checks if check.outcome == BY_SPLIT]
    assert len(unsure) == len(split.doubts) == count
    assert all(check.name in str(split.doubts[0]) for check in unsure)
    assert split.passes is whole.passes is (scale == 0.5)
    assert (BY_SPLIT in split.plot().axes[1].get_title().replace("\n", " ")) is bool(unsure)
    said, listed = describe_margin([split]), dict(list_ratios(split))
    unsure_of = "passes or fails, by the split of weights, by"  # one check alone
    words = {
        0.5: [": passes"],
        1.0: [f"{unsure_of} displacements (", "passes by the linear check ("],
        2.0: ["fails by displacements (", f"{unsure_of} the linear check ("],
        4.0: [": fails"],
    }[scale]
    assert all(each in said for each in words)
    assert said.endswith(words[0]) is (len(words) == 1)
    assert any(ratios.by_split for ratios in listed.values()) is bool(unsure)
    assert not whole.doubts


def test_a_wall_held_at_its_top_moves_as_by_hand(verified):
    """A wall 3 m high and 0.4 m thick bends at 2.1 m; a tie beam holds it from 2.7 m up.

    Two bodies: the lower one turns about its outer foot, the upper one slides up the beam's corner.
    """
    b, hinge, levels = 0.4, 2.1, np.array([*np.linspace(0.0, 2.4, 9), 3.0])
    boxes = {f"course {k}": (0.0, y0, b, y1) for k, (y0, y1) in enumerate(pairwise(levels))}
    fixed = {"ground": (-1.0, -0.5, 1.0, 0.0), "beam": (b, 2.7, 0.9, 3.0)}
    blocks = [
        af.Block(
            ((x0, y0), (x1, y0), (x1, y1), (x0, y1)),
            af.Material(30e9, 0.2, 20e3),
            name,
            fixed=name in fixed,
            part="wall",
            role="pier",
        )
        for name, (x0, y0, x1, y1) in (boxes | fixed).items()
    ]

    def touch(one, other):
        return af.Contact(1e9, 4e8, friction=1e-9 if "beam" in (one.name, other.name) else 2.0)

    wall = af.masonry.assembled(blocks, touch)
    found = af.kinematic_assessment(wall, SPECTRUM)

    heights, weights = 0.5 * (levels[1:] + levels[:-1]), np.diff(levels)
    upper, corner = heights > hinge, b + 2.7j

    def places(turn):
        """Centroids (x + i y), pin between the bodies, and turn of the upper one."""
        pin = b + (hinge * 1j - b) * np.exp(-1j * turn)
        away = corner - pin
        back = brentq(lambda angle: (away * np.exp(-1j * angle)).real - b, -0.2, 1.2)
        low = b + (0.5 * b + 1j * heights - b) * np.exp(-1j * turn)
        high = pin + (0.5 * b + 1j * (heights - hinge)) * np.exp(1j * back)
        return np.where(upper, high, low), pin, back

    def velocities(turn, step=1e-6):
        return (places(turn + step)[0] - places(turn - step)[0]) / (2.0 * step)

    def factor(turn):
        rates = velocities(turn)
        return (weights @ rates.imag) / (weights @ rates.real)

    def push_of_beam(turn):
        """Moment of the upper weights about the pin; the beam can only push."""
        now, pin, _ = places(turn)
        arms = (now - pin)[upper]
        return weights[upper] @ (arms.real + factor(turn) * arms.imag)

    rates = velocities(0.0).real
    work, inertia = weights @ rates, weights @ rates**2
    parted = brentq(push_of_beam, 1e-4, 0.13)
    assert factor(parted) > 0.0  # there the upper body leaves the beam and falls
    moved = (places(parted)[0] - places(0.0)[0]).real
    assert found.alpha_0 == pytest.approx(0.5266106, rel=1e-6)
    assert found.alpha_0 == pytest.approx(factor(0.0), rel=1e-6)
    share = work**2 / (weights.sum() * inertia)
    assert found.e_star == pytest.approx(share, rel=1e-5)
    # the centroid of all weights has the lesser capacity, d* = d_C / e*; the fastest is course 6
    expected = (weights @ moved) / weights.sum() / share
    assert found.d_0_star == pytest.approx(expected, rel=1e-4)
    assert found.displacement.capacity == pytest.approx(0.4 * expected, rel=1e-4)
    verified("wall held at its top: d_0* of all weights", expected, "by hand", found.d_0_star)
    control = np.abs(rates).argmax()
    fastest = moved[control] * inertia / (rates[control] * work)
    assert found.control == "all weights"
    assert f"of course 6, at first the fastest, with a d_0* of {fastest:.4g} m" in found.notes[0]


def test_a_load_with_a_wrong_sign_or_unit_is_in_doubt():
    """A block of 160 kN, a tie that points outwards, and a mass of 9 N in place of 9 kN."""
    spectrum = {"code": "NTC-2018", "ag": 0.25, "f0": 2.4, "tc_star": 0.32, "site": "B"}
    tie = {"block": "block 1", "point": [0.5, 4.0], "force": [15e3, 0.0], "passive": True}
    column = {"shape": "column", "breadth": 1.0, "heights": [8.0]}
    for direction, wrong in ((1, True), (-1, False)):
        assessment = {"spectrum": spectrum, "loads": [tie], "direction": direction}
        case = af.Case.of({"structure": column, "assessment": assessment})
        doubted = [str(x) for x in doubt_ties(case)]
        says = "the tie at block 1 pulls in the sense of the push, which it never holds; correct "
        assert [x.startswith(says) for x in doubted] == [True] * wrong
    # to one side floors and walls may hold what no tie does
    case = af.Case.of({"structure": column, "assessment": assessment | {"direction": 1}})
    says = "note: pushed to the right, no tie holds it: if floors and walls do, give direction = -1"
    assert note_ties(case) == [says]
    for weight, wrong in ((9.0, True), (9e3, False)):
        load = af.masonry.AttachedLoad("block 1", (0.5, 4.0), weight)
        found = af.kinematic_assessment(case.structure, SPECTRUM, loads=[load])
        says = "the load at block 1 is 9 N, below 1 % of the lightest block, 160 kN"
        assert [x.startswith(says) for x in map(str, found.doubts)] == [True] * wrong


GROUND = af.motion.Ntc2018(ag=0.18, f0=2.5, tc_star=0.32, site="B")


def front_of_three_storeys(eaves, floors):
    """Blocks of 0.65, 0.65 and 0.5 m flush outside, 10.5 m high; floors, roof, thrust and ties."""
    levels, inner = [0.0, 3.4, 6.8, 10.5], [0.0, 0.0, 0.15]
    blocks, joints = [box(-1.0, 1.0, -0.5, 0.0, "ground", fixed=True)], []
    loads = [af.masonry.AttachedLoad("storey 3", (0.4, 10.5), 5e3, (1.5e3, 0.0))]
    for k, left in enumerate(inner):
        blocks.append(box(left, 0.65, *levels[k : k + 2], f"storey {k + 1}"))
        joints.append(bed((k, k + 1), left, 0.65, levels[k]))
        pull = eaves if k == 2 else floors
        of_block = {"block": f"storey {k + 1}", "point": (left, levels[k + 1])}
        loads += [af.masonry.AttachedLoad(**of_block, weight=9e3)] * (k < 2)
        loads += [af.masonry.AttachedLoad(**of_block, force=(-pull, 0.0), passive=True)] * (
            pull > 0
        )
    return af.Structure(tuple(blocks), tuple(joints)), loads


def test_a_floor_spectrum_follows_the_mechanism_up_a_front(verified):
    """a_Z = 0.54 g · 9/7 · 6.8/10.5 · √1.01, by hand, against moments about the toe at 6.8 m."""
    floor = af.motion.FloorSpectrum(GROUND, 0.29, height=10.5, storeys=3)
    demand = 0.18 * 1.2 * 2.5 * 9.0 / 7.0 * 6.8 / 10.5 * sqrt(1.01)
    assert demand == pytest.approx(0.452, abs=5e-4)
    arms, heights = 42.0 * 0.25 - 1.5 * 3.7, 37.0 * 1.85 + 5.0 * 3.7  # kN m, without the tie
    share = heights**2 / (42.0 * (37.0 * 1.85**2 + 5.0 * 3.7**2))  # e* of the storey and the roof
    free = 2.0 / 1.35 * arms / heights / share / demand
    needed = (1.35 / 2.0 * demand * share * heights - arms) / 3.7
    for eaves, floors, ratio in ((0.0, 0.0, free), (1e3 * needed, 12e3, 1.0)):
        structure, loads = front_of_three_storeys(eaves, floors)
        found = af.kinematic_assessment(structure, floor, loads=loads)
        assert found.linear.demand == pytest.approx(0.18 * 1.2 * af.units.STANDARD_GRAVITY)
        above = found.above
        assert above.mechanism_name.startswith("rocking of all above storey 2 ")
        assert above.linear.demand / af.units.STANDARD_GRAVITY == pytest.approx(demand)
        verified(f"front, tie of {eaves:.0f} N at the eaves", ratio, "moments", above.linear.ratio)
        assert above.linear.decisive == pytest.approx(ratio, rel=1e-3)
        says = "demand 4.431 m/s² (amplification 0.833, a_Z 0.452 g)"
        assert says in str(above)
        (row,) = (x for x in state_assessments({"x": above}, ()).rows if "linear" in x.result)
        assert row.demand == says.removeprefix("demand ")
        # 1.1 / √0.05 of what vibrates by itself
        assert "at its own period T_0, up to 4.92 times as much" in str(above)
        assert "amplification" not in str(found.linear)
        assert "T_0" not in str(found).partition("rocking of all above")[0]
        assert not any("that of the ground" in each.cause for each in above.doubts)
    # from the floors on: what a column above them has for its tie
    roof = {"block": "block 1", "point": [0.0, 3.7], "weight": 5e3, "force": [1.5e3, 0.0]}
    tie = {"block": "block 1", "point": [0.0, 3.7], "force": [-4e3, 0.0], "passive": True}
    spectrum = {"code": "floor", "period": 0.29, "height": 10.5, "storeys": 3}
    spectrum["ground_spectrum"] = {"code": "NTC-2018", "ag": 0.18, "f0": 2.5, "tc_star": 0.32}
    spectrum["ground_spectrum"]["site"] = "B"
    column = {"shape": "column", "breadth": 0.5, "heights": [3.7], "above": 6.8}
    assessment = {"spectrum": spectrum, "direction": 1, "loads": [roof, tie]}
    case = af.Case.of({"structure": column, "assessment": assessment})
    (note,) = note_ties(case)
    said = float(re.search(r"from (\S+) kN of the tie at block 1 on", note)[1])
    assert said == pytest.approx(needed, abs=0.01)  # 1e-3 of the tie's 4 kN, and three digits


def test_what_moves_high_above_the_ground_is_in_doubt_under_its_spectrum():
    """Above 6.8 m of a front by any spectrum of the ground; a ring is as high as its springings."""
    structure, loads = front_of_three_storeys(7e3, 12e3)
    table = af.motion.TableSpectrum(periods=[0.0, 1.0, 4.0], values=[0.3, 0.3, 0.1])
    doubt = "and 6.8 m above it, at the foot of what moves, it is larger"
    for spectrum in (GROUND, table):
        found = af.kinematic_assessment(structure, spectrum, loads=loads)
        whole, above = (any(doubt in str(x) for x in y.doubts) for y in (found, found.above))
        assert (whole, above) == (False, True)
    sizes = {"radius": 2.0, "thickness": 0.4, "voussoirs": 12}
    piers = af.arch_on_piers(**sizes, pier_breadth=2.0, courses=[1.0, 1.5])
    found = af.kinematic_assessment(piers, GROUND, part="arch")
    assert any("and 2.5 m above it" in str(each) for each in found.doubts)
    slender = af.arch_on_piers(**sizes, pier_breadth=1.0, courses=[1.0, 1.5])
    for structure in (slender, af.circular_arch(**sizes, embrace=160.0)):
        found = af.kinematic_assessment(structure, GROUND)
        assert not any("that of the ground" in each.cause for each in found.doubts)


def parapet(above, *heights):
    """A stack 0.5 m thick whose foot is at a height above the ground; None for none given."""
    return replace(af.column(breadth=0.5, heights=heights or [1.0]), above=above)


def floor_level(period=0.0, ag=0.18):
    """S_eZ at the top of a building of 10.5 m and three storeys, T_1 = 0.29 s, by C7.2.6 [g]."""
    level, peak = 3.0 * ag * 9.0 / 7.0 * sqrt(1.01), 1.1 / sqrt(0.05)  # S_e(T_1) = 1.2 · 2.5 a_g
    return level * peak / (1.0 + (peak - 1.0) * (1.0 - period / (0.8 * 0.29)) ** 1.6)


def test_what_vibrates_freely_takes_the_spectrum_at_its_own_period(verified):
    """A parapet of 0.5 × 1 m: α₀ = 0.5, e* = 1; eq. C8.7.1.9 with C7.2.6."""
    floor = af.motion.FloorSpectrum(GROUND, 0.29, height=10.5, storeys=3)
    held, free = (
        af.kinematic_assessment(parapet(10.5), floor, free_period=x) for x in (None, 0.12)
    )
    capacity = 2.0 / 1.35 * 0.5 * G / af.units.STANDARD_GRAVITY
    for found, period in ((held, 0.0), (free, 0.12)):
        ratio = capacity / floor_level(period)
        verified(f"parapet: ratio at {period} s", ratio, "C7.2.6 by hand", found.linear.ratio)
        assert found.linear.ratio == pytest.approx(ratio, rel=1e-6)
    assert held.linear.ratio > 1.0 > free.linear.ratio
    # it may fail by its own period, and says so; what moves from the ratio of q = 1 on
    (doubt,) = (str(x) for x in held.doubts if "vibrates freely" in str(x))
    worst = held.linear.ratio * 0.05**0.5 / 1.1
    says = "linear, q = 2, FC = 1.35 passes with a_Z, and of what vibrates freely its ratio may be "
    assert doubt.startswith(f"{says}{worst:.3g}, by T_0; give free_period")
    assert " at T_0 = 0.12 s: fails" in str(free.linear)
    assert "free_period = 0.12 s is T_0 of what moves above z = 10.5 m" in free.notes
    assert "a_Z" not in str(free.displacement)
    assert (held.linear.source[-1], free.linear.source[-1]) == ("8", "9")
    said = "at its own period T_0, up to 4.92 times as much"
    assert (said in str(held), said in str(free)) == (True, False)
    # 0 says that it does not vibrate freely
    stated = af.kinematic_assessment(parapet(10.5), floor, free_period=0.0)
    assert str(stated.linear) == str(held.linear)
    assert not stated.doubts
    assert said not in str(stated)
    # what is above a bed is rated with it too, and a wall on the ground takes its spectrum
    stack = af.kinematic_assessment(parapet(10.5, 0.6, 0.6), floor, free_period=0.12)
    rules = stack.limit_state, stack.curve["d"].values, stack.curve["a"].values
    rated = rules[0].rate(floor, 2.0, 1.35, 10.5, *rules[1:], 0.12)
    assert rated == pytest.approx((stack.linear.ratio, stack.displacement.ratio))
    ground = af.kinematic_assessment(parapet(0.0), GROUND, free_period=0.2)
    assert ground.linear.demand == pytest.approx(0.54 * af.units.STANDARD_GRAVITY)


def test_a_free_period_of_0_of_the_whole_is_in_doubt_above_its_tie():
    """What is above a tie at the top of the building may vibrate freely, with the most by T_0."""
    floor = af.motion.FloorSpectrum(replace(GROUND, ag=0.05), 0.29, height=10.5, storeys=3)
    wall = replace(af.column(breadth=0.5, heights=[10.5, 2.0]), above=0.0)
    tie = af.masonry.AttachedLoad("block 1", (0.0, 10.5), force=(-12e3, 0.0), passive=True)
    held, free = (
        af.kinematic_assessment(wall, floor, loads=[tie], free_period=x).above for x in (0.0, 0.12)
    )
    alpha = 0.5 / 2.0
    ratio = 2.0 / 1.35 * alpha * G / af.units.STANDARD_GRAVITY / floor_level(0.0, 0.05)
    assert held.linear.ratio == pytest.approx(ratio, rel=1e-3)
    (doubt,) = (str(x) for x in held.doubts if "vibrates freely" in str(x) and "linear" in str(x))
    assert f"its ratio may be {ratio * 0.05**0.5 / 1.1:.3g}, by T_0; assess it alone" in doubt
    assert not any("vibrates freely" in str(x) for x in free.doubts)


def test_a_mechanism_at_rest_by_a_z_alone_is_in_doubt(verified):
    """What vibrates freely is set in motion by S_eZ(T_0), and then displacements decide."""
    ground = replace(GROUND, ag=0.05)
    floor = af.motion.FloorSpectrum(ground, 0.29, height=10.5, storeys=3)
    small = replace(af.column(breadth=0.03, heights=[0.06]), above=10.5)
    held, free = (af.kinematic_assessment(small, floor, free_period=x) for x in (None, 0.12))
    begins = 0.5 / 1.35 * G / af.units.STANDARD_GRAVITY
    for found, period in ((held, 0.0), (free, 0.12)):
        ratio, check = begins / floor_level(period, 0.05), found.displacement
        verified(f"at rest: ratio at {period} s", ratio, "C7.2.6 by hand", check.ratio)
        assert check.ratio == pytest.approx(ratio, rel=1e-6)
        assert (check.at_rest, check.moved < 0.8) == (True, True)
    assert free.displacement.ratio < 1.0 < held.displacement.ratio
    doubted = [x.values[0] for x in held.doubts if "vibrates freely" in str(x)]
    assert doubted == ["linear, q = 2, FC = 1.35", "NTC-2018 SLV"]
    # what passes once it moves does so at any T_0
    (linear,) = af.kinematic_assessment(
        parapet(10.5), replace(floor, ground_spectrum=ground)
    ).doubts
    assert linear.values[0] == "linear, q = 2, FC = 1.35"


def test_what_stands_above_a_building_is_shaken_as_its_top():
    """The first mode is 1 there. Where no height is given, that of the ground is in doubt."""
    floor = af.motion.FloorSpectrum(GROUND, 0.29, height=10.5, storeys=3)
    top, higher = (
        af.kinematic_assessment(parapet(z), floor, free_period=0.0) for z in (10.5, 12.0)
    )
    assert higher.linear.demand == pytest.approx(floor_level() * af.units.STANDARD_GRAVITY)
    assert str(higher.linear) == str(top.linear)
    said = "its foot, z = 12 m, is above H = 10.5 m of the spectrum: z = H is taken"
    assert ([said in x for x in higher.notes].count(True), said in str(top)) == (1, False)
    for heights in ([1.0], [0.6, 0.6]):
        for above, doubted in ((None, True), (0.0, False), (10.5, False)):
            found = af.kinematic_assessment(parapet(above, *heights), floor, free_period=0.0)
            says = [str(x) for x in found.doubts if "height of its foot" in str(x)]
            assert len(says) == doubted
    assert "taken as 0: what moves is shaken as at z = 0 m" in str(
        af.kinematic_assessment(parapet(None), floor)
    )
    # other spectra take no height, and a ring has its own foot
    at_top = floor.at(10.5)
    for structure, spectrum in ((parapet(None), at_top), (parapet(None), GROUND), (RING, floor)):
        found = af.kinematic_assessment(structure, spectrum)
        assert "height of its foot" not in str(found)


def test_both_senses_of_a_symmetric_ring_that_slides_have_one_capacity():
    """Five stones beyond the sliding joint are equally fast, and turn by little thereafter."""
    ring = af.circular_arch(
        radius=2.4385, thickness=0.5, embrace=132.1, voussoirs=15, contact=af.Contact(1e9, 4e8, 0.6)
    )
    spectrum = af.Eurocode8(ag=0.3, ground="C")
    right, left = (
        af.kinematic_assessment(ring, spectrum, direction=x, strength=20e6) for x in (1, -1)
    )
    assert "voussoir 15" in right.control
    assert "voussoir 1," in left.control
    assert "sliding" in right.mechanism_name
    # both paths end at their own step
    assert float(right.curve["d"][-1]) == pytest.approx(float(left.curve["d"][-1]), rel=1e-6)
