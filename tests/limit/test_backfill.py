"""Fill in limit analysis: strength, columns and fans of load, self-weight programme."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

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
    row_of_stones,
    slender_bridge,
    two_walls,
)
from scipy.integrate import quad
from scipy.optimize import linprog
from shapely import LineString, Point, Polygon

import archfem as af
from archfem.limit import Fill
from archfem.limit.backfill import FillProfile, slice_blocks
from archfem.limit.self_weight import is_balanced
from archfem.masonry.stiffness_ratio import find_yielding_blocks

ROUND_OFF = 1e-12


def test_rankine_coefficients():
    for angle, passive in ((0.0, 1.0), (30.0, 3.0), (45.0, 3.0 + 2.0 * 2.0**0.5)):
        fill = Fill(friction_angle=angle, mobilisation=1.0)
        least, most = fill.pressures(np.array([0.0, 1e3]))
        np.testing.assert_allclose(most, [0.0, passive * 1e3], rtol=ROUND_OFF)
        np.testing.assert_allclose(least, [0.0, 1e3 / passive], rtol=ROUND_OFF)


def test_cohesion_adds_to_passive_and_takes_from_active_pressure():
    """Mohr's circle that touches c + σ tan φ: σ_1 - σ_3 = (σ_1 + σ_3) sin φ + 2 c cos φ."""
    angle, c, vertical = 32.0, 5e3, np.array([60e3, 90e3])
    least, most = Fill(friction_angle=angle, cohesion=c, mobilisation=1.0).pressures(vertical)
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    for small, large in ((vertical, most), (least, vertical)):
        touch = (large + small) * sine + 2.0 * c * cosine
        np.testing.assert_allclose(large - small, touch, rtol=ROUND_OFF)
    shallow, _ = Fill(friction_angle=angle, cohesion=c).pressures(np.array([1e3]))
    assert shallow == 0.0  # a crack: soil does not pull


def test_mobilisation_and_active_are_parts_and_active_is_the_floor():
    sigma = np.array([1e4])
    fill = Fill(friction_angle=30.0, mobilisation=0.5, active=0.5)
    assert fill.pressures(sigma) == (pytest.approx(1e4 / 6.0), pytest.approx(1.5e4))
    least, most = Fill(friction_angle=30.0, mobilisation=0.0).pressures(sigma)
    assert least == most == pytest.approx(1e4 / 3.0)


@pytest.mark.parametrize("dispersal", ["boussinesq", "uniform"])
def test_all_of_a_load_is_between_the_edges_of_its_fan(dispersal):
    fill = Fill(friction_angle=30.0, dispersal=dispersal, spread=40.0)
    edge = np.tan(np.radians(40.0))
    found = fill.share(np.array([-np.inf, -2.0 * edge, -edge, 0.0, edge, np.inf]))
    np.testing.assert_allclose(found, [0.0, 0.0, 0.0, 0.5, 1.0, 1.0], atol=ROUND_OFF)
    slopes = np.linspace(-edge, edge, 50)
    np.testing.assert_allclose(fill.share(slopes) + fill.share(-slopes), 1.0, rtol=ROUND_OFF)
    assert (np.diff(fill.share(slopes)) > 0.0).all()


def test_boussinesq_is_the_stress_under_a_line_load():
    """σ_z = 2 P z³ / (π (x² + z²)²), integrated over a level at a depth of 1.7 m."""
    fill, depth = Fill(friction_angle=30.0, spread=35.0), 1.7

    def stress(x):
        return 2.0 * depth**3 / (np.pi * (x * x + depth * depth) ** 2)

    edge = depth * np.tan(np.radians(35.0))
    whole = quad(stress, -edge, edge)[0]
    for x in (-0.9, 0.1, 0.7):
        part = quad(stress, -edge, x)[0] / whole
        assert fill.share(np.array(x / depth)) == pytest.approx(part, rel=1e-9)  # of quadrature


def test_a_uniform_fan_of_one_in_two():
    fill = Fill(friction_angle=30.0, dispersal="uniform", spread=np.degrees(np.arctan(0.5)))
    assert fill.share(np.array(0.25)) == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"friction_angle": 0.6}, "give degrees"),
        ({"friction_angle": 70.0}, "give degrees"),
        ({"friction_angle": -1.0}, "below 0"),
        ({"friction_angle": "35"}, "has no unit"),
        ({"cohesion": 2e6}, r"\[Pa\] = 2000000.0 is not between"),
        ({"mobilisation": 1.5}, "a part"),
        ({"active": 3.0}, "a part"),
        ({"lever": 1.2}, "a part"),
        ({"dispersal": "elastic"}, "is not known"),
        ({"spread": 90.0}, "degrees from the vertical"),
        ({"spread": 0.52}, "looks like radians: give 29.79 for 0.52 rad"),
        ({"spread": 0.0}, "degrees from the vertical"),
    ],
)
def test_an_invalid_fill_is_refused(given, says):
    with pytest.raises(af.InvalidInput, match=says):
        Fill(**{"friction_angle": 35.0, **given})


AREA_ROUND_OFF = 1e-9
FINE = 5e-3
"""Of places within a fan: it is summed over pieces of 1/2000 of the structure."""


def profile(structure):
    stones = np.ones(len(structure.blocks), dtype=bool)
    stones[list(find_yielding_blocks(structure))] = False
    stones[[block.part == "paving" for block in structure.blocks]] = False
    return FillProfile(structure, stones)


@pytest.mark.parametrize("build", [arch_bridge, row_of_stones])
def test_slices_cover_every_block(build):
    structure = build()
    cut = slice_blocks(structure)
    for number, block in enumerate(structure.blocks):
        own = cut.block == number
        assert cut.area[own].sum() == pytest.approx(block.area, rel=AREA_ROUND_OFF)
        x = (cut.area * cut.middle)[own].sum() / cut.area[own].sum()
        assert x == pytest.approx(block.centroid[0], rel=AREA_ROUND_OFF, abs=AREA_ROUND_OFF)


def test_every_stone_carries_the_column_above_it():
    structure = arch_bridge(width=3.0)
    columns = profile(structure).columns()
    foot, weight = columns.place, columns.weight
    assert not columns.lean.any()  # for no vehicle stands on it
    for number, block in enumerate(structure.blocks):
        if block.part != "arch":
            continue
        expected, x = column_above(structure, number)
        own = columns.stone == number
        assert weight[own].sum() == pytest.approx(expected, rel=1e-6)  # corners merged within 1e-6
        assert (weight * foot[:, 0])[own].sum() / expected == pytest.approx(x, rel=1e-6)
    whole = fill_of(structure)
    assert weight.sum() == pytest.approx(3.0 * whole.area * whole.material.unit_weight, rel=1e-9)


def test_nothing_of_an_eroded_fill_under_paving_is_lost_between_two_rings():
    arches = [
        af.shapes.Arch(
            measured="centre line",
            span=4.7,
            embrace=157.0,
            thickness=0.5,
            voussoirs=14,
            name="west arch",
        ),
        af.shapes.Arch(
            measured="centre line",
            span=5.8,
            embrace=159.0,
            thickness=0.6,
            voussoirs=17,
            name="east arch",
        ),
    ]
    walls = [
        af.shapes.Sidewall(length=2.8, height=2.0, above=above, name=f"{side} wall")
        for side, above in (("west", 0.0), ("east", 0.8))
    ]
    structure = af.bridge(
        arches=arches,
        piers=[af.shapes.Pier(gap=1.0, height=2.0)],
        sidewalls=walls,
        backfill=af.shapes.Backfill(cover=0.5, erosion=0.4),
        paving=af.shapes.Paving(thickness=0.2),
        width=4.7,
    )
    found = profile(structure)
    resting = [b for b, stone in zip(structure.blocks, found.stones, strict=True) if not stone]
    weight = 4.7 * sum(block.area * block.material.unit_weight for block in resting)
    columns = found.columns()
    assert columns.weight.sum() == pytest.approx(weight, rel=AREA_ROUND_OFF)
    parts = {structure.blocks[number].part for number in columns.stone}
    assert parts >= {"west arch", "east arch", "pier", "west wall", "east wall"}


def test_paving_rests_on_the_blocks_under_the_fill():
    bare, paved = (profile(row_of_stones(paving=paving)).columns() for paving in (0.0, 0.2))
    each = 0.5 * 0.2 * af.STONE.unit_weight
    for stone in range(1, 13):
        more, less = (x.weight[x.stone == stone].sum() for x in (paved, bare))
        assert more - less == pytest.approx(each, rel=AREA_ROUND_OFF)


def test_overburden_is_unit_weight_times_depth():
    found = profile(row_of_stones(cover=1.5, paving=0.2))
    stress = 1.5 * af.masonry.BACKFILL.unit_weight + 0.2 * af.STONE.unit_weight
    assert found.overburden(np.array([2.2, 0.5]), 1.0) == pytest.approx(stress, rel=1e-6)
    assert found.overburden(np.array([2.2, 2.0]), 1.0) == pytest.approx(4e3, rel=1e-6)


@pytest.mark.parametrize("dispersal", ["boussinesq", "uniform"])
@pytest.mark.parametrize("x", [3.0, 2.83, 3.31])
def test_a_fan_on_a_level_row(dispersal, x):
    cover, fill = 1.2, af.limit.Fill(friction_angle=35.0, dispersal=dispersal, spread=45.0)
    block, points, part = profile(row_of_stones(cover)).fan(np.array([x, 0.5 + cover]), fill)
    assert part.sum() == pytest.approx(1.0, rel=AREA_ROUND_OFF)
    assert part @ points[:, 0] == pytest.approx(x, abs=FINE * cover)
    for stone in range(12):
        ends = (np.array([0.5 * stone, 0.5 * (stone + 1)]) - x) / cover
        expected = float(np.diff(fill.share(ends))[0])
        assert part[block == stone + 1].sum() == pytest.approx(expected, abs=AREA_ROUND_OFF)


def test_a_fan_on_an_arch_brings_all_of_the_load_straight_down():
    """Radial stress brings the same to any face: of an arch, the part between rays to its corners.

    The moment about the load vanishes only on a level face, so the part of each stone is compared.
    """
    structure, fill = arch_bridge(), af.limit.Fill(friction_angle=35.0)
    top = max(block.points[:, 1].max() for block in structure.blocks)
    x = 3.4
    block, _, part = profile(structure).fan(np.array([x, top]), fill)
    assert part.sum() == pytest.approx(1.0, rel=AREA_ROUND_OFF)
    for number in np.unique(block):
        edge = structure.blocks[number].points
        back = edge[np.argsort(edge[:, 1] + 0.0 * edge[:, 0])[-2:]]
        ends = np.sort((back[:, 0] - x) / (top - back[:, 1]))
        expected = float(np.diff(fill.share(ends))[0])
        assert part[block == number].sum() == pytest.approx(expected, abs=1e-6)


def test_a_back_that_points_at_the_load_is_met_at_its_upper_corner():
    """All its rays have one slope: a middle ray between those to its ends is undefined."""
    rock = af.Block(((0.0, -4.0), (4.0, -4.0), (4.0, -3.0), (0.0, -3.0)), af.STONE, "rock", True)
    outline = ((1.0, -3.0), (2.0, -3.0), (2.0, -1.0), (1.0, 0.0))
    stone = af.Block(outline, af.STONE, "stone", part="pier", role="pier")
    structure = af.masonry.assembled([rock, stone], af.masonry.STONE_TO_STONE)
    fill = Fill(friction_angle=35.0, dispersal="uniform", spread=60.0)
    block, points, part = profile(structure).fan(np.array([0.0, 1.0]), fill)
    share = np.diff(fill.share(np.array([0.25, 1.0])))  # steeper rays meet the rock before it
    np.testing.assert_allclose(part[block == 1].sum(), share[0], rtol=ROUND_OFF)
    np.testing.assert_allclose(points[block == 1], [(1.0, 0.0)], atol=ROUND_OFF)


def test_more_cover_spreads_a_load_wider():
    fill = af.limit.Fill(friction_angle=35.0)
    spread, peak = [], []
    for cover in (0.3, 0.8, 1.5, 2.5):
        block, points, part = profile(row_of_stones(cover)).fan(np.array([2.75, 0.5 + cover]), fill)
        spread.append(part @ (points[:, 0] - 2.75) ** 2)
        peak.append(max(part[block == stone].sum() for stone in set(block)))
    assert (np.diff(spread) > 0.0).all()
    assert (np.diff(peak) < 0.0).all()


def test_a_stone_that_stands_up_shades_the_stones_behind_it():
    low = row_of_stones(1.0)
    tall = [
        af.Block(
            tuple((x, 1.3 if y == 0.5 else y) for x, y in block.outline),
            block.material,
            block.name,
            part=block.part,
            role=block.role,
        )
        if block.name == "stone 7"
        else block
        for block in low.blocks
        if block.name != "soil"
    ]
    right, left = ((4.0, 6.0), (0.0, 3.5))
    soil = af.Block(
        (
            (left[0], 0.5),
            (left[1], 0.5),
            (left[1], 1.3),
            (right[0], 1.3),
            (right[0], 0.5),
            (right[1], 0.5),
            (right[1], 1.5),
            (left[0], 1.5),
        ),
        af.masonry.BACKFILL,
        "soil",
        part="soil",
        role="other",
    )
    structure = af.masonry.assembled([*tall, soil], af.masonry.SOIL_TO_STONE)
    fill = af.limit.Fill(friction_angle=35.0, dispersal="uniform", spread=45.0)
    block, _, part = profile(structure).fan(np.array([3.4, 1.5]), fill)
    # Rays to the right reach the foot of stone 7 at slope 0.1, and its top's far end at 3.
    assert part[block == 8].sum() == pytest.approx(0.5 - 0.05, rel=1e-6)
    assert part[block > 8].sum() == 0.0
    assert part.sum() == pytest.approx(1.0, rel=AREA_ROUND_OFF)


def test_pressure_that_misses_the_structure_acts_on_the_ground():
    fill = af.limit.Fill(friction_angle=35.0, dispersal="uniform", spread=45.0)
    _, _, part = profile(row_of_stones(1.0)).fan(np.array([0.0, 1.5]), fill)
    assert part.sum() == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize("free", [1, 200])
@pytest.mark.parametrize(("share", "stands"), [(0.98, True), (1.02, False)])
def test_the_residual_may_be_the_rounding_of_all_blocks_that_move(free, share, stands):
    dead = SimpleNamespace(blocks=SimpleNamespace(structure=SimpleNamespace(free=range(free))))
    fall = SimpleNamespace(value=share * 1e-8 * free)
    assert is_balanced(fall, dead) is stands


def presses_by_level(structure, fill, moving, levels=800):
    """Least and greatest size, and stones, points and forces on them of each level of a fill.

    The polygon of the fill is cut into thin levels. Each presses on the stones at its two ends, on
    both equally where both may move; on a single one passively unless it lies above another ring.
    """
    rings = {n: Polygon(structure.blocks[n].points).centroid for n in moving}
    rings = {n: at for n, at in rings.items() if structure.blocks[n].role == "ring"}
    faces = {number: [LineString(f) for f in faces_of(structure, number)] for number in moving}
    soil = fill_of(structure)
    polygon = Polygon(soil.points)
    left, low, right, road = polygon.bounds
    height = (road - low) / levels
    for y in low + height * (0.5 + np.arange(levels)):
        sizes = fill.pressures(np.array((road - y) * soil.material.unit_weight))
        if fill.backing is not None and y < fill.backing:
            sizes = 0.0, fill.backing_strength
        sizes = height * structure.width * np.array(sizes)
        pieces = polygon.intersection(LineString([(left - 1.0, y), (right + 1.0, y)]))
        for piece in getattr(pieces, "geoms", [pieces]):
            pressed = [
                (number, end, (push, 0.0))
                for end, push in zip(sorted(piece.coords), (-1.0, 1.0), strict=True)
                for number in moving
                if any(face.distance(Point(end)) < 1e-9 for face in faces[number])
            ]
            (start, _), (stop, _) = sorted(piece.coords)
            own = {structure.blocks[number].part for number, *_ in pressed}
            beside = any(
                start < at.x < stop and structure.blocks[number].part not in own
                for number, at in rings.items()
            )
            if len(pressed) == 1 and beside:
                sizes = (sizes[0], sizes[0])
            for group in [pressed] if len(pressed) == 2 else [[each] for each in pressed]:
                yield sizes, group


def push_by_levels(structure, fill, sense=1.0):
    """Horizontal pull that brings down rings and piers: a linear programme by other means [g].

    Nothing slides.
    """
    moving = [n for n in structure.free if structure.blocks[n].part != "backfill"]
    joints = [j for j in structure.joints if set(j.blocks) & set(moving) and j.role != "other"]
    columns, bounds, weights = [], [], []

    def act(*forces):
        column = np.zeros(3 * len(moving))
        for number, (x, y), force in forces:
            if number in moving:
                row = 3 * moving.index(number)
                column[row : row + 3] += [*force, x * force[1] - y * force[0]]
        return column

    for joint in joints:
        along = joint.ends[1] - joint.ends[0]
        along /= np.linalg.norm(along)
        across = structure.centroids[joint.blocks[1]] - structure.centroids[joint.blocks[0]]
        across -= along * (across @ along)
        across /= np.linalg.norm(across)
        for point, force, low in (
            *((end, across, 0.0) for end in joint.ends),
            (joint.ends[0], along, None),
        ):
            columns.append(act((joint.blocks[1], point, force), (joint.blocks[0], point, -force)))
            bounds.append((low, None))
    for number in moving:
        block = structure.blocks[number]
        weight = block.area * block.material.unit_weight * structure.width
        weights.append((number, structure.centroids[number], weight))
        for face in faces_of(structure, number):
            above, x = column_above(structure, number)
            weights.append((number, (x, np.interp(x, *face.T)), above))
    dead = act(*((number, point, (0.0, -weight)) for number, point, weight in weights))
    pull = act(*((number, point, (sense * weight, 0.0)) for number, point, weight in weights))
    for sizes, pressed in presses_by_level(structure, fill, moving):
        columns.append(act(*pressed))
        bounds.append(sizes)
    matrix = np.column_stack([*columns, pull])
    cost = np.append(np.zeros(len(columns)), -1.0)
    return -linprog(cost, A_eq=matrix, b_eq=-dead, bounds=[*bounds, (0.0, None)]).fun


@pytest.mark.slow
@pytest.mark.parametrize(
    "levels",
    [np.arange(0.7, 0.78, 0.02), np.arange(0.5, 1.0, 0.02)],
    ids=["few", "all"],
)
def test_backing_holds_faces_up_to_its_level_as_in_an_independent_programme(levels):
    """It holds less than fixed stones would, and no small step of the level adds much."""
    structure, load = arch_bridge(), af.BodyForce(1.0, 0.0)
    fill = Fill(friction_angle=35.0, mobilisation=0.0, active=0.0)
    found = [
        af.collapse_factor(
            structure, live=load, friction=None, fill=replace(fill, backing=level)
        ).factor
        for level in levels
    ]
    assert np.diff(found).min() > 0.0
    assert (np.diff(found) / found[:-1]).max() < 0.05
    for level, factor in list(zip(levels, found, strict=True))[::8]:
        backed = replace(fill, backing=level)
        assert push_by_levels(structure, backed) == pytest.approx(factor, rel=5e-3)


QUICK = (6.0, 1.2), None, -1.0
"""End of the right ring, backing and sense of the case that takes least."""


@pytest.mark.parametrize(
    ("rings", "backing", "sense"),
    [
        *(
            pytest.param(
                *({"left": (8.4, 2.1), "right": right}, backing, sense),
                marks=() if (right, backing, sense) == QUICK else pytest.mark.slow,
            )
            for right in ((8.4, 2.2), (6.0, 1.2))
            for backing, sense in product((0.7, None), (1.0, -1.0))
        ),
        *(
            pytest.param(
                *({"left": (8.4, 2.1), "low": (5.0, 1.0), "right": (8.4, 2.3)}, backing, sense),
                marks=pytest.mark.slow,
            )
            for backing, sense in product((0.7, None), (1.0, -1.0))
        ),
    ],
)
def test_fill_between_rings_as_in_an_independent_programme(rings, sense, backing):
    """Also where one ring is higher, and two are above the crown of the one between.

    Fill above the lower ring bears no passive pressure on the higher one.
    """
    structure = slender_bridge(**rings)
    fill = Fill(friction_angle=35.0, backing=backing)
    found = af.collapse_factor(structure, live=af.BodyForce(sense), friction=None, fill=fill)
    # with 800 to 6400 levels the programme scatters by up to 1.5 %, as levels near corners differ
    assert found.factor == pytest.approx(push_by_levels(structure, fill, sense), rel=1.5e-2)


@pytest.mark.parametrize(("level", "strength"), [(0.05, 1e6), (0.1, 2e6), (0.2, 1e6)])
def test_backing_behind_a_wall_by_hand(level, strength):
    """A wall turns about its toe when the backing crushes: λ W H/2 = W b/2 + S h²/2."""
    fill = Fill(
        friction_angle=35.0,
        mobilisation=0.0,
        active=0.0,
        backing=level,
        backing_strength=strength,
    )
    weight, moment = 2.0 * af.STONE.unit_weight, 0.5 * strength * level**2
    found = af.collapse_factor(
        retaining_wall(), live=af.BodyForce(1.0, 0.0), friction=None, fill=fill
    )
    assert found.factor == pytest.approx((weight * 0.5 + moment) / weight, rel=1e-9)


NO_PRESSURE = Fill(friction_angle=30.0, mobilisation=0.0, active=0.0)


@pytest.mark.parametrize("fill", [replace(NO_PRESSURE, backing=1.5), Fill(friction_angle=30.0)])
def test_backing_or_fill_between_two_walls_is_a_strut(fill):
    """Both turn about their toes at once: the sum of the weights' moments over that of the push."""
    found = af.collapse_factor(two_walls(), live=af.BodyForce(1.0), friction=None, fill=fill)
    assert found.factor == pytest.approx((2.0 * 0.5 + 4.0 * 1.0) / (2.0 + 4.0), rel=1e-9)
    height = np.ptp(found.soil.y.values, axis=1)
    thrust = (found.soil.toward * found.soil.pressure * height).groupby("block").sum()
    assert thrust[0] == pytest.approx(-thrust[1])
    assert abs(float(thrust[0])) > 0.01 * af.STONE.unit_weight


def test_a_fixed_stone_between_two_walls_separates_them():
    """Active thrust helps to turn the thick one, and the slender one has the passive one."""
    bare = two_walls()
    soil, wall = bare.blocks[2], rectangle(0.9, 0.0, 1.1, 2.0, "middle", fixed=True)
    parts = [rectangle(x, 0.0, x + 0.9, 2.0, f"soil {x}", soil.material) for x in (0.0, 1.1)]
    structure = af.masonry.assembled(
        [*bare.blocks[:2], parts[0], wall, parts[1], bare.blocks[3]], af.masonry.SOIL_TO_STONE
    )
    fill = Fill(friction_angle=30.0)
    found = af.collapse_factor(structure, live=af.BodyForce(1.0), friction=None, fill=fill)
    thrust = 0.5 * soil.material.unit_weight * 2.0**2 / 3.0
    expected = 1.0 - thrust * 2.0 / 3.0 / (4.0 * af.STONE.unit_weight)
    assert found.factor == pytest.approx(expected, rel=1e-9)


def test_under_a_sloping_road_both_walls_have_the_same_pressure():
    """At least what the deeper side pushes, at most what the shallower one bears."""
    blocks = [
        rectangle(-2.0, -1.0, 6.0, 0.0, "rock", fixed=True),
        rectangle(-1.0, 0.0, 0.0, 2.0, "low"),
        af.Block(((0.0, 0.0), (2.0, 0.0), (2.0, 3.0), (0.0, 2.0)), SOIL, "soil", role="other"),
        rectangle(2.0, 0.0, 4.0, 3.0, "high"),
    ]
    structure = af.masonry.assembled(blocks, af.masonry.SOIL_TO_STONE)
    fill = Fill(friction_angle=30.0, mobilisation=0.5)
    found = af.collapse_factor(structure, live=af.BodyForce(1.0), friction=None, fill=fill).soil
    low, high = (found.sel(contact=found.block == number) for number in (1, 3))
    y = low.y.mean("end").values
    assert low.sizes["contact"] > 8
    stress = SOIL.unit_weight * np.array([3.0 - y, 2.0 - y])
    least, most = stress[0] / 3.0, np.maximum(stress[0] / 3.0, 1.5 * stress[1])
    for key, expected in (("least", least), ("most", most)):
        np.testing.assert_allclose(low[key], expected, rtol=0.04)  # at the middle of a piece
    shared = high.isel(contact=np.argsort(high.y.mean("end").values)[: len(y)])
    order = np.argsort(y)
    for key in ("least", "most", "pressure"):
        np.testing.assert_allclose(low[key][order], shared[key], rtol=1e-9)


@pytest.mark.slow
def test_backing_fixes_the_stones_below_its_level_in_a_plastic_fill():
    """As of a bridge whose lowest stones are fixed; they do not move, and it carries more."""
    pytest.importorskip("clarabel")
    structure = arch_bridge()
    stones = [n for n in structure.free if structure.blocks[n].role == "ring"]
    level = float(np.sort(structure.centroids[stones, 1])[7]) + 1e-3
    held = [n for n in stones if structure.centroids[n, 1] < level]
    assert len(held) == 8
    fixed = replace(
        structure,
        blocks=tuple(
            replace(block, fixed=block.fixed or n in held)
            for n, block in enumerate(structure.blocks)
        ),
    )
    load = af.PointLoad(x=3.6, force=(0.0, -1e3))
    fill = af.limit.PlasticFill(friction_angle=35.0, cohesion=2e3)
    free, same, backed = (
        af.collapse_factor(each, live=load, fill=replace(fill, backing=backing))
        for each, backing in ((structure, None), (fixed, None), (structure, level))
    )
    assert backed.factor == pytest.approx(same.factor, rel=1e-9)
    assert backed.factor > 1.05 * free.upper
    assert not backed.motion[held].any()


@pytest.mark.parametrize(("level", "words"), [(-5.0, "holds none"), (9.0, "holds all")])
def test_backing_that_holds_all_or_none_is_refused(level, words):
    fill = af.limit.Fill(friction_angle=35.0, backing=level)
    with pytest.raises(af.InvalidInput, match=f"backing {level:.4g} m {words} of the stones"):
        af.rate(arch_bridge(), "LM1", fill=fill)
