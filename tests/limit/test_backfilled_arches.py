"""Limit analysis of stones under a fill: walls by Rankine, an arch by its line of thrust."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from backfilled import (
    SOIL,
    arch_bridge,
    column_above,
    faces_of,
    fill_of,
    rectangle,
    retaining_wall,
    two_walls,
)
from scipy.optimize import linprog

import archfem as af
from archfem.limit.backfill import attach_fill

EXACT = 1e-6
"""Relative: the programme is solved to 1e-9 block weights, corners count as one within 1e-6."""

SUMMED = 1e-5
"""Relative: a fan is summed over pieces of 1/2000 of the structure, by the test over rays."""

RAYS = 40
"""To each stone."""

GRAVEL = af.limit.Fill(friction_angle=35.0)
ALL = replace(GRAVEL, mobilisation=1.0)
NONE = replace(GRAVEL, mobilisation=0.0, active=0.0)

QUARTER = af.PointLoad(3.25, (0.0, -1e3))
SIDEWAYS = af.BodyForce(1.0)


def earth_pressure(height, coefficient):
    return coefficient * SOIL.unit_weight * height**2 / 2.0


@pytest.mark.parametrize("friction", [0.3, 0.9])
@pytest.mark.parametrize("part", [0.0, 0.4, 1.0])
def test_a_wall_pushed_into_its_fill_meets_rankine(friction, part):
    """Slides where λ W = μ W + E_p, tilts where λ W h/2 = W b/2 + E_p h/3."""
    breadth, height = 1.5, 2.0
    fill = af.limit.Fill(friction_angle=30.0, mobilisation=part, active=0.0)
    wall = retaining_wall(breadth, height, friction)
    weight, push = breadth * height * af.STONE.unit_weight, earth_pressure(height, 3.0 * part)
    slide = friction + push / weight
    tilt = breadth / height + push / weight * 2.0 / 3.0
    found = af.collapse_factor(wall, live=SIDEWAYS, fill=fill)
    assert found.factor == pytest.approx(min(slide, tilt), rel=EXACT)
    assert bool(found.sliding) == (slide < tilt)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.3, 0.9])
def test_a_wall_pushed_into_its_fill_without_dilatancy_starts_from_states_with_the_fill(friction):
    """On level rock N is the weight, so that nothing changes; no start lacks equilibrium."""
    wall, fill = retaining_wall(1.5, 2.0, friction), replace(ALL, active=0.0)
    plain, found = (
        af.collapse_factor(wall, live=SIDEWAYS, fill=fill, friction=f)
        for f in ("coulomb", "nonassociated")
    )
    assert found.factor == pytest.approx(plain.factor, rel=EXACT)
    # no factor is above the associated one, which the first start already has
    assert found.solutions.starts == (1, 1)


@pytest.mark.parametrize("friction", [0.3, 0.9])
def test_a_wall_pulled_from_its_fill_is_pushed_by_it(friction):
    breadth, height = 1.5, 2.0
    wall = retaining_wall(breadth, height, friction)
    weight, push = breadth * height * af.STONE.unit_weight, earth_pressure(height, 1.0 / 3.0)
    slide = friction - push / weight
    tilt = breadth / height - push / weight * 2.0 / 3.0
    found = af.collapse_factor(
        wall, live=af.BodyForce(-1.0), fill=af.limit.Fill(friction_angle=30.0)
    )
    assert found.factor == pytest.approx(min(slide, tilt), rel=EXACT)


@pytest.mark.slow
def test_a_wall_stands_from_the_breadth_at_which_the_fill_does_not_tip_it():
    """W b/2 = K_a γ h²/2 h/3 with W = γ_s b h: b² = K_a γ h² / (3 γ_s)."""
    height, fill = 2.0, af.limit.Fill(friction_angle=30.0)
    least = height * np.sqrt(SOIL.unit_weight / (9.0 * af.STONE.unit_weight))
    assert af.stands(retaining_wall(1.001 * least, height, 2.0), fill=fill)
    assert not af.stands(retaining_wall(0.999 * least, height, 2.0), fill=fill)
    assert af.stands(retaining_wall(0.5 * least, height, 2.0), fill=replace(fill, active=0.0))
    found = af.minimum_thickness(
        lambda breadth: retaining_wall(breadth, height, 2.0), fill=fill, tolerance=1e-4
    )
    assert found == pytest.approx(least, rel=2e-4)


def test_cohesion_holds_a_wall_back():
    """E_p = K_p γ h²/2 + 2 c h √K_p, at h/3 and at h/2."""
    fill = af.limit.Fill(friction_angle=30.0, cohesion=4e3, mobilisation=1.0, active=0.0)
    weight = 1.5 * 2.0 * af.STONE.unit_weight
    first, second = earth_pressure(2.0, 3.0), 2.0 * 4e3 * 2.0 * np.sqrt(3.0)
    found = af.collapse_factor(retaining_wall(1.5, 2.0, 9.0), live=SIDEWAYS, fill=fill)
    assert found.factor == pytest.approx(0.75 + (first * 2.0 / 3.0 + second) / weight, rel=EXACT)


def test_paving_on_the_fill_presses_through_it():
    """A load q on all of the fill adds the pressure K_a q, and its force at h/2."""
    wall = retaining_wall(1.5, 2.0, 9.0)
    paving = rectangle(0.0, 2.0, 6.0, 2.3, "paving")
    rough = replace(af.masonry.STONE_TO_STONE, friction=9.0)
    paved = af.masonry.assembled(
        [*wall.blocks, paving],
        lambda a, b: af.masonry.SOIL_TO_STONE if "soil" in (a.name, b.name) else rough,
    )
    q, weight = 0.3 * af.STONE.unit_weight, 1.5 * 2.0 * af.STONE.unit_weight
    fill = af.limit.Fill(friction_angle=30.0)
    expected = 0.75 - (earth_pressure(2.0, 1 / 3) * 2.0 / 3.0 + q * 2.0 / 3.0) / weight
    found = af.collapse_factor(paved, live=af.BodyForce(-1.0), fill=fill)
    assert found.factor == pytest.approx(expected, rel=EXACT)


def forces_on(structure, number, fill, x, top, pieces=8):
    """Fixed forces on a voussoir, the live one, and horizontal ones that may come on top.

    Each is a point and a force; those on top are with their greatest size.
    """
    block = structure.blocks[number]
    dead = [(block.centroid, (0.0, -block.area * block.material.unit_weight))]
    weight, middle = column_above(structure, number)
    dead.append((np.array([middle, 0.0]), (0.0, -weight)))
    (face,) = faces_of(structure, number)
    toward = 1.0 if face[1, 1] > face[0, 1] else -1.0
    edge = np.tan(np.radians(fill.spread))
    low, high = np.clip((face[:, 0] - x) / (top - face[:, 1]), -edge, edge)
    assert low <= high  # no stone shades another
    rays = low + (np.arange(RAYS) + 0.5) / RAYS * (high - low)
    step = (face[1, 1] - face[0, 1]) / (face[1, 0] - face[0, 0])
    met = (x + rays * (top - face[0, 1] + step * face[0, 0])) / (1.0 + rays * step)
    part = (high - low) / (2.0 * edge) / RAYS
    live = [(np.array([place, 0.0]), (0.0, -part)) for place in met]
    passive = np.tan(np.radians(45.0 + fill.friction_angle / 2.0)) ** 2
    more = []
    for low, high in pairwise(np.linspace(*face, pieces + 1)):
        z = top - np.array([low[1], high[1]])
        force = SOIL.unit_weight * z.mean() * abs(high[1] - low[1])
        level = (low[1] * (2 * z[0] + z[1]) + high[1] * (z[0] + 2 * z[1])) / (3 * z.sum())
        point = np.array([0.0, level])
        least = fill.active * force / passive
        most = max(least, fill.mobilisation * force * passive)
        dead.append((point, (toward * least, 0.0)))
        more.append((point, (toward * (most - least), 0.0)))
    return dead, live, more


def cross(arm, force):
    return arm[0] * force[1] - arm[1] * force[0]


def factor_by_line_of_thrust(structure, fill, x):
    """Largest load at x, in N, under which a line of thrust stays within the ring.

    Unknowns are the force and moment at the left springing, the load, and the shares of pressures
    that come on top; right of each joint the moment about its two ends must have two signs.
    """
    top = fill_of(structure).points[:, 1].max()
    ring = [k for k, block in enumerate(structure.blocks) if block.part == "arch"]
    loads = [forces_on(structure, k, fill, x, top) for k in ring]
    shares = sum(len(more) for _, _, more in loads)
    joints = [j for j in structure.joints if j.part == "arch" and j.name.startswith("arch, joint")]
    rows, bounds = [], []
    for place, joint in enumerate(joints):
        for end, sign in ((joint.intrados, 1.0), (joint.extrados, -1.0)):
            about = np.array(end)
            row = np.zeros(4 + shares)
            row[:3] = [cross(-about, (1.0, 0.0)), cross(-about, (0.0, 1.0)), 1.0]
            fixed, column = 0.0, 4
            for block, (dead, live, more) in enumerate(loads):
                if block < place:
                    fixed += sum(cross(point - about, force) for point, force in dead)
                    row[3] += sum(cross(point - about, force) for point, force in live)
                    turns = [cross(point - about, force) for point, force in more]
                    row[column : column + len(more)] = turns
                column += len(more)
            rows.append(sign * row)
            bounds.append(-sign * fixed)
    cost = np.zeros(4 + shares)
    cost[3] = -1.0
    limits = [(None, None)] * 3 + [(0.0, None)] + [(0.0, 1.0)] * shares
    found = linprog(cost, A_ub=np.array(rows), b_ub=bounds, bounds=limits, method="highs")
    assert found.status == 0
    return -found.fun


@pytest.mark.parametrize(
    "fill",
    [
        replace(NONE, dispersal="uniform"),
        replace(GRAVEL, mobilisation=0.0, dispersal="uniform"),
        replace(GRAVEL, dispersal="uniform", spread=40.0),
        replace(ALL, dispersal="uniform", active=0.0),
    ],
    ids=["weight", "active", "passive in part", "passive"],
)
def test_an_arch_carries_the_load_of_its_line_of_thrust(fill):
    structure = arch_bridge()
    found = af.collapse_factor(structure, live=QUARTER, friction=None, fill=fill)
    expected = factor_by_line_of_thrust(structure, fill, QUARTER.x)
    assert found.factor * 1e3 == pytest.approx(expected, rel=SUMMED)
    assert [side for _, side in found.hinges] == ["intrados", "extrados"] * 2


@pytest.mark.parametrize(
    "live",
    [QUARTER, SIDEWAYS, pytest.param(af.BodyForce(-0.5, 0.2), marks=pytest.mark.slow)],
    ids=str,
)
def test_static_and_kinematic_factors_are_equal(live):
    """Hinges do no work: loads, weights and pressures do none together on the mechanism."""
    structure = arch_bridge(cover=0.6, width=2.5)
    found = af.collapse_factor(structure, live=live, friction=None, fill=GRAVEL)
    stones = attach_fill(structure, GRAVEL)
    free = [stones.rigid_regions.blocks[k] for k in stones.rigid_regions.structure.free]
    motion = found.motion[free].ravel()
    share = (found.soil["pressure"] - found.soil["least"]) / (
        found.soil["most"] - found.soil["least"]
    )
    dead = stones.load([af.BodyForce(0.0, -1.0)]) + stones.active_forces()
    held = stones.passive_forces() @ share.values
    work = stones.load([live]) @ motion
    assert work > 0.0
    assert found.factor == pytest.approx(-(dead + held) @ motion / work, rel=EXACT)
    pushed = stones.passive_forces().T @ motion
    small = 1e-7 * np.abs(pushed).max()
    np.testing.assert_allclose(share[pushed < -small], 1.0, atol=1e-6)  # into the fill
    np.testing.assert_allclose(share[pushed > small], 0.0, atol=1e-6)  # away from it
    assert (pushed < -small).any()
    assert (pushed > small).any()


def test_a_fill_without_weight_strength_or_spread_is_not_there():
    nothing = replace(SOIL, unit_weight=1e-3)
    fill = af.limit.Fill(friction_angle=0.0, mobilisation=1.0, spread="0.1 degree")
    for live in (QUARTER, SIDEWAYS):
        bare = af.collapse_factor(arch_bridge(cover=None), live=live).factor
        found = af.collapse_factor(arch_bridge(0.02, nothing), live=live, fill=fill)
        assert found.factor == pytest.approx(bare, rel=1e-5)  # the fan is 3 mm wide


def test_the_pressures_bound_the_factor():
    """A narrower range of pressures is never better, and a wider one never worse."""
    structure = arch_bridge(cover=0.5, voussoirs=10)

    def factor(**changes):
        fill = replace(GRAVEL, **changes)
        return af.collapse_factor(structure, live=QUARTER, fill=fill).factor

    by_part = [factor(mobilisation=part) for part in (0.15, 0.3, 0.6, 1.0)]
    by_angle = [factor(friction_angle=angle) for angle in (20.0, 30.0, 40.0)]
    by_active = [factor(active=part) for part in (1.0, 0.5, 0.0)]
    by_cohesion = [factor(cohesion=c) for c in (0.0, 2e3, 1e4)]
    by_spread = [factor(spread=angle) for angle in (10.0, 30.0, 50.0)]
    for row in (by_part, by_angle, by_active, by_cohesion, by_spread):
        assert (np.diff(row) > 0.0).all()


def test_more_cover_carries_more():
    factors = [
        af.collapse_factor(arch_bridge(cover), live=QUARTER, fill=GRAVEL).factor
        for cover in (0.1, 0.3, 0.6, 1.0)
    ]
    assert (np.diff(factors) > 0.0).all()


@pytest.mark.slow
def test_width_cancels():
    """Widths cancel: weights and earth pressure grow equally."""
    expected = af.collapse_factor(arch_bridge(), live=SIDEWAYS, fill=GRAVEL).factor
    found = af.collapse_factor(arch_bridge(width=7.0), live=SIDEWAYS, fill=GRAVEL).factor
    assert found == pytest.approx(expected, rel=EXACT)


def test_mirrored_load_gives_the_mirrored_mechanism():
    structure = arch_bridge()
    middle = fill_of(structure).points[:, 0].mean()
    loads = (QUARTER, af.PointLoad(2.0 * middle - QUARTER.x, QUARTER.force))
    left, right = (af.collapse_factor(structure, live=load, fill=GRAVEL) for load in loads)
    assert right.factor == pytest.approx(left.factor, rel=EXACT)
    assert [(20 - joint, side) for joint, side in reversed(right.hinges)] == list(left.hinges)


def test_order_of_blocks_does_not_matter():
    structure = arch_bridge()
    last = len(structure.blocks) - 1
    turned = replace(
        structure,
        blocks=structure.blocks[::-1],
        joints=tuple(
            replace(joint, blocks=(last - joint.lower, last - joint.higher))
            for joint in structure.joints
        ),
    )
    one, other = (
        af.collapse_factor(each, live=QUARTER, fill=GRAVEL) for each in (structure, turned)
    )
    assert other.factor == pytest.approx(one.factor, rel=EXACT)
    assert other.hinges == one.hinges
    np.testing.assert_allclose(other.motion, one.motion[::-1], atol=1e-6)


def test_results_have_the_numbering_of_the_whole_structure():
    structure = arch_bridge()
    found = af.collapse_factor(structure, live=QUARTER, fill=GRAVEL)
    soil = structure.blocks.index(fill_of(structure))
    touching = [soil in joint.blocks for joint in structure.joints]
    assert found.joints.sizes["joint"] == len(structure.joints)
    np.testing.assert_array_equal(np.isnan(found.joints["N"]), touching)
    assert found.motion.shape == (len(structure.blocks), 3)
    assert not found.motion[soil].any()
    for joint, side in found.hinges:
        e = float(found.joints["eccentricity"][joint])
        assert e == pytest.approx(-0.5 if side == "intrados" else 0.5, abs=1e-6)
    names = {structure.blocks[number].part for number in found.soil["block"].values}
    assert names == {"arch"}
    assert (found.soil["least"] <= found.soil["pressure"]).all()
    assert (found.soil["pressure"] <= found.soil["most"] * (1.0 + 1e-9)).all()


def test_a_spreading_support_finds_the_least_thrust():
    structure = arch_bridge()
    springing = next(j for j in structure.joints if j.name == "arch, joint 0")
    support = next(b for b in springing.blocks if structure.blocks[b].fixed)
    thrusts = {}
    for sense in (-1.0, 1.0):
        move = af.Settlement(support, (sense, 0.0, 0.0))
        found = af.collapse_factor(structure, live=move, fill=GRAVEL)
        assert found.outcome is af.limit.Outcome.SETTLES
        k = structure.joints.index(springing)
        normal = structure.normals[k] * (1.0 if support == springing.lower else -1.0)
        n, v = float(found.joints["N"][k]), float(found.joints["V"][k])
        sign = 1.0 if support == springing.lower else -1.0
        push = n * normal[0] - sign * v * springing.tangent[0]
        assert push == pytest.approx(-sense * found.factor, rel=EXACT)
        thrusts[sense] = push
    assert 0.0 < thrusts[-1.0] < thrusts[1.0]


@pytest.mark.slow
def test_crushing_and_sliding_go_with_a_fill():
    structure = arch_bridge()
    strong, weak, weaker = (
        af.collapse_factor(structure, live=QUARTER, fill=GRAVEL, strength=s).factor
        for s in (None, 5e6, 1e6)
    )
    assert weaker < weak < strong
    plain = af.collapse_factor(structure, live=QUARTER, fill=GRAVEL, friction="nonassociated")
    assert plain.factor == pytest.approx(strong, rel=1e-4)  # no joint slides


def test_an_arch_too_thin_for_its_fill_does_not_stand():
    thin = arch_bridge(rise=2.4, thickness=0.12)
    found = af.collapse_factor(thin, live=QUARTER, fill=NONE)
    assert found.outcome is af.limit.Outcome.INFEASIBLE
    assert np.isnan(found.soil["pressure"]).all()
    assert not af.stands(thin, fill=NONE)
    assert af.stands(thin, fill=ALL)


@pytest.mark.slow
def test_a_fill_that_slides_first_is_warned_of(caplog):
    structure = arch_bridge(thickness=0.6)
    with caplog.at_level("WARNING", "archfem"):
        loose = replace(GRAVEL, friction_angle=20.0)
        found = af.collapse_factor(structure, live=SIDEWAYS, friction=None, fill=loose)
        assert found.factor > np.tan(np.radians(20.0))
        assert "the fill itself slides" in caplog.text
        caplog.clear()
        sticky = replace(loose, cohesion=5e3)
        af.collapse_factor(structure, live=SIDEWAYS, friction=None, fill=sticky)
        af.collapse_factor(structure, live=QUARTER, friction=None, fill=loose)
    assert "the fill itself slides" not in caplog.text


def test_a_column_turns_its_stone_about_the_height_of_its_force():
    """A stone under a narrow column of fill rocks about its toe, by moments."""
    breadth, height, depth = 1.0, 1.0, 3.0
    parts = [
        rectangle(-1.0, -1.0, 2.0, 0.0, "rock", fixed=True),
        rectangle(0.0, 0.0, breadth, height, "stone", part="wall", role="pier"),
        rectangle(0.0, height, breadth, height + depth, "soil", SOIL),
    ]
    structure = af.masonry.assembled(parts, af.masonry.SOIL_TO_STONE)
    stone, soil = (breadth * (each.material.unit_weight) for each in structure.blocks[1:])
    weights = np.array([stone * height, soil * depth])
    for lever in (0.0, 0.5, 1.0):
        heights = np.array([height / 2.0, height + lever * depth / 2.0])
        expected = weights.sum() * breadth / 2.0 / (weights @ heights)
        fill = af.limit.Fill(friction_angle=45.0, lever=lever)
        found = af.collapse_factor(structure, live=SIDEWAYS, friction=None, fill=fill).factor
        assert found == pytest.approx(expected, rel=1e-9)


def test_a_fill_that_ends_in_air_between_two_walls_holds_neither(caplog):
    """The slender wall turns alone, at b / h; with fill all along between both turn at once."""
    filled = two_walls()
    fill = af.limit.Fill(friction_angle=30.0, active=0.0, mobilisation=1.0)
    together = af.collapse_factor(filled, live=SIDEWAYS, friction=None, fill=fill)
    assert together.factor == pytest.approx((2.0 * 0.5 + 4.0 * 1.0) / 6.0)
    assert "ends in air" not in caplog.text
    rock, slender, _, thick = filled.blocks
    soils = [rectangle(*x, "soil", SOIL) for x in ((0.0, 0.0, 0.9, 2.0), (1.1, 0.0, 2.0, 2.0))]
    soils = [replace(soil, name=f"soil {k}", part=f"soil {k}") for k, soil in enumerate(soils)]
    parted = af.masonry.assembled(
        [rock, slender, *soils, thick],
        lambda a, b: (
            af.masonry.SOIL_TO_STONE if "soil" in a.name + b.name else af.masonry.STONE_TO_STONE
        ),
    )
    alone = af.collapse_factor(parted, live=SIDEWAYS, friction=None, fill=fill)
    assert alone.factor == pytest.approx(0.5)
    assert "beside x = 0 m, y = 0.125 m ends in air before the opposite face" in caplog.text


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: af.stands(arch_bridge()), r"fill=af.limit.Fill\(friction_angle"),
        (lambda: af.stands(arch_bridge(cover=None), fill=GRAVEL), "no block is soft enough"),
        (
            lambda: af.collapse_factor(
                arch_bridge(), live=af.PointLoad(3.0, (1.0, -1.0)), fill=GRAVEL
            ),
            "presses straight down",
        ),
        (
            lambda: af.collapse_factor(
                arch_bridge(), live=af.PointLoad(99.0, (0.0, -1.0)), fill=GRAVEL
            ),
            "misses the structure",
        ),
    ],
)
def test_invalid_input_is_refused(call, says):
    with pytest.raises(af.InvalidInput, match=says):
        call()


def test_nothing_but_fill_is_refused():
    base = rectangle(0.0, -1.0, 2.0, 0.0, "rock", fixed=True)
    body = rectangle(0.0, 0.0, 2.0, 1.0, "soil", SOIL)
    with pytest.raises(af.InvalidInput, match="nothing but fill"):
        af.stands(af.masonry.assembled([base, body], af.masonry.SOIL_TO_STONE), fill=GRAVEL)
