"""Fill in pieces: compliance that no size changes, and earth pressures of Coulomb and Rankine."""

from dataclasses import replace
from math import radians, sqrt, tan

import numpy as np
import pytest
import shapely
from backfilled import arch_bridge

import archfem as af
from archfem.cases.structure_text import describe_depths
from archfem.dynamics.walls_across import find_falls_across
from archfem.masonry import BACKFILL, SOIL_TO_STONE, jointed_fill
from archfem.masonry.backfill import _incentre, _merge_slivers, _Piece, _tile_box
from archfem.masonry.stiffness_ratio import find_soft_blocks, find_yielding_blocks
from archfem.statics import Stop

HEIGHT = 1.5
"""Of the fill behind a wall [m]."""

WEDGE = 1e-4
"""Of the force of a wedge: it moves as one body, so that equilibrium alone decides."""


def box(length, floor, side, height=HEIGHT):
    """A fill between two walls, on a floor; the right wall is called "wall"."""

    def rectangle(x, y, name, **kind):
        corners = ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))
        kind = {"material": af.STONE, "fixed": True, "part": name, "role": "other"} | kind
        return af.Block(corners, name=name, **kind)

    far = length + 0.5
    blocks = (
        rectangle((-0.5, far), (-0.5, 0.0), "floor"),
        rectangle((0.0, length), (0.0, height), "fill", material=BACKFILL, fixed=False),
        rectangle((-0.5, 0.0), (0.0, height), "back"),
        rectangle((length, far), (0.0, height), "wall"),
    )
    return af.masonry.assembled(blocks, lambda a, b: floor if "floor" in (a.name, b.name) else side)


def smooth_box(angle, rows, *, passive=False, shift=0.0):
    """Fill in rows of pieces behind a smooth wall, on a floor as rough as it is itself.

    Joints run through the foot of the wall, but for a shift in widths of the tiling's triangles.
    """
    size = HEIGHT / (1.5 * rows)
    side = size * sqrt(3.0)
    length = side * (2.0 * np.ceil((4.5 if passive else 2.5) / side / 2.0) + shift)
    floor = af.Contact(0.3e9, 0.24e9, tan(radians(angle)))
    whole = box(length, floor, af.Contact(0.3e9, 0.24e9, 0.0))
    return jointed_fill(whole, size, friction_angle=angle)


def on_wall(structure, joints):
    """Force on the wall over γ H² / 2, of the fill between it and the floor."""
    wall = structure.block_number("wall")
    own = [
        k
        for k, pair in enumerate(structure.pairs)
        if wall in pair and not all(structure.blocks[n].fixed for n in pair)
    ]
    return joints["N"].values[..., own].sum(axis=-1) / (0.5 * 18e3 * HEIGHT**2)


def pressure(structure, move):
    """Force on the wall at rest, after it has moved at once [m]."""
    model = af.build(structure, fidelity="rigid", cells=(1, 1))
    found = af.dead_load(model.settled(af.Settlement("wall", (move, 0.0, 0.0))))
    return float(on_wall(structure, found.joints))


def pressed(structure, move):
    """Force on the wall where it has moved little by little, up to [m]."""
    model = af.build(structure, fidelity="rigid", cells=(1, 1))
    stop = Stop(displacement=abs(move) / structure.size)
    way = af.Settlement("wall", (np.sign(move), 0.0, 0.0))
    return float(on_wall(structure, af.pushover(model, way, stop=stop).joints)[-1])


@pytest.mark.parametrize(
    "size", [1.0, *(pytest.param(each, marks=pytest.mark.slow) for each in (0.5, 0.25))]
)
def test_compliance_does_not_depend_on_the_size(size):
    """A fill between smooth walls is pressed like a bar: E ε, however it is cut, clipped or merged.

    The push outweighs the fill's own pressure, so that all joints are closed.
    """
    push = 0.2
    length = 3.0 * sqrt(3.0)
    slick = af.Contact(1e13, 1e13, 0.0)
    fill = jointed_fill(box(length, slick, slick), size, friction_angle=45.0, cohesion=1e9)
    before, after = pressure(fill, 0.0), pressure(fill, -push)
    force = (after - before) * 0.5 * 18e3 * HEIGHT**2
    assert force == pytest.approx(6.25e6 * HEIGHT * push / length, rel=3e-3)


@pytest.mark.parametrize("rows", [1, 2, pytest.param(4, marks=pytest.mark.slow)])
def test_an_oedometer_is_as_compliant_as_a_bar(rows):
    """Fill under its own weight settles by γ H² / 2E at its top, where there are few rows too."""
    slick, held = af.Contact(1e13, 1e13, 0.0), af.Contact(1e13, 1e13, None)
    size = HEIGHT / (1.5 * rows)
    fill = jointed_fill(
        box(2.0 * size * sqrt(3.0), held, slick), size, friction_angle=45.0, cohesion=1e9
    )
    model = af.build(fill, fidelity="rigid", cells=(1, 1))
    q = af.dead_load(model).q.reshape(-1, 3)
    work = sum(fill.blocks[n].area * 18e3 * -q[k, 1] for k, n in enumerate(fill.free))
    area = sum(fill.blocks[n].area for n in fill.free)
    exact = area * 18e3**2 * HEIGHT**2 / 3.0 / 6.25e6  # ∫ γ u dA, u = γ (H y - y²/2) / E
    assert work == pytest.approx(exact, rel=0.3 / rows**2)


@pytest.mark.parametrize(
    ("angle", "rows"),
    [
        (20.0, 1),
        pytest.param(20.0, 4, marks=pytest.mark.slow),
        (30.0, 1),
        pytest.param(30.0, 2, marks=pytest.mark.slow),
        pytest.param(40.0, 1, marks=pytest.mark.slow),
        pytest.param(40.0, 4, marks=pytest.mark.slow),
    ],
)
def test_active_force_is_that_of_the_best_wedge(angle, rows, verified):
    """The wedge on the joints at 60° presses with cot 60° tan(60° - φ); Rankine's where φ = 30°."""
    found = pressed(smooth_box(angle, rows), 0.004)
    assert found == pytest.approx(tan(radians(60.0 - angle)) / sqrt(3.0), rel=WEDGE)
    rankine = tan(radians(45.0 - angle / 2.0)) ** 2
    assert found == pytest.approx(rankine, rel={20.0: 0.012, 30.0: WEDGE, 40.0: 0.034}[angle])
    case = f"fill in pieces, {rows} rows, active force, φ = {angle:g}°: K_a"
    verified(case, rankine, "Rankine (1857)", found)


@pytest.mark.parametrize(
    ("angle", "rows"),
    [
        pytest.param(20.0, 2, marks=pytest.mark.slow),
        (30.0, 1),
        pytest.param(30.0, 2, marks=pytest.mark.slow),
        pytest.param(40.0, 2, marks=pytest.mark.slow),
    ],
)
def test_passive_force_is_that_of_the_best_wedge(angle, rows, verified):
    """The wedge on the joints at 30° resists with cot 30° tan(30° + φ)."""
    found = pressed(smooth_box(angle, rows, passive=True), -0.08)
    assert found == pytest.approx(tan(radians(30.0 + angle)) * sqrt(3.0), rel=WEDGE)
    rankine = tan(radians(45.0 + angle / 2.0)) ** 2
    assert found == pytest.approx(rankine, rel={20.0: 0.013, 30.0: WEDGE, 40.0: 0.035}[angle])
    case = f"fill in pieces, {rows} rows, passive force, φ = {angle:g}°: K_p"
    verified(case, rankine, "Rankine (1857)", found)


@pytest.mark.parametrize("passive", [False, True], ids=["active", "passive"])
@pytest.mark.parametrize(
    "angle", [30.0, *(pytest.param(each, marks=pytest.mark.slow) for each in (20.0, 40.0))]
)
def test_limit_analysis_of_the_pieces_finds_the_same_wedges(angle, passive):
    """As rigid blocks: the wall that gives way bears the least thrust, pushed in the greatest."""
    way = af.Settlement("wall", (-1.0 if passive else 1.0, 0.0, 0.0))
    found = af.collapse_factor(smooth_box(angle, 1, passive=passive), live=way)
    thrust = abs(found.factor) / (0.5 * 18e3 * HEIGHT**2)
    inclined = radians(30.0 + angle if passive else 60.0 - angle)
    assert thrust == pytest.approx(tan(inclined) * sqrt(3.0) ** (1 if passive else -1), rel=1e-8)
    assert found.sliding


def test_the_strength_of_stones_leaves_pieces_their_own():
    """K_p = 3 as without it; a column on the wall tips about the middle of its crushed strip."""
    way = af.Settlement("wall", (-1.0, 0.0, 0.0))
    found = af.collapse_factor(smooth_box(30.0, 1, passive=True), live=way, strength=0.2e6)
    assert abs(found.factor) / (0.5 * 18e3 * HEIGHT**2) == pytest.approx(3.0, rel=1e-8)
    rough = af.Contact(0.3e9, 0.24e9, 1.0)
    whole = box(2.0, rough, rough)
    shaft = ((2.05, HEIGHT), (2.45, HEIGHT), (2.45, HEIGHT + 1.6), (2.05, HEIGHT + 1.6))
    column = af.Block(shaft, af.STONE, "column", role="other")
    stones = af.masonry.assembled((*whole.blocks, column), rough)
    fill = jointed_fill(stones, 1.0, friction_angle=30.0)
    push = af.PointLoad(2.25, (1e3, 0.0))
    found = af.collapse_factor(fill, live=push, strength=0.1e6)
    weight = 0.4 * 1.6 * af.STONE.unit_weight
    strip = weight / 0.1e6
    assert 1e3 * found.factor * 1.6 == pytest.approx(weight * (0.4 - strip) / 2.0, rel=1e-6)


def test_between_fixed_walls_pieces_that_dilate_bear_any_load(caplog):
    """They lock, and words say so; round-off stops the solver within its usual tolerance."""
    rough = af.Contact(0.3e9, 0.24e9, tan(radians(30.0)))
    fill = jointed_fill(box(3.0, rough, rough), 0.7, friction_angle=35.0)
    load = af.PointLoad(1.5, (0.0, -1e3))
    found = af.collapse_factor(fill, live=load)
    assert found.outcome.sentence == "this load never overturns it"
    assert "it may lock between the stones, as soil does not" in caplog.text
    caplog.clear()
    af.limit.moving_load(fill, 1e3, positions=[1.5])
    assert caplog.text.count("it may lock between the stones") == 2  # of the row, and of the worst
    caplog.clear()
    af.collapse_factor(fill, live=load, friction=None)
    assert not caplog.text


@pytest.mark.slow
def test_of_a_vehicle_on_given_fill_no_pieces_lock_whether_it_is_cut_or_not(caplog):
    """Both have the same factors, infinite where no axle reaches a stone that moves."""
    bridge = arch_bridge()
    pieces = jointed_fill(bridge, 1.0, friction_angle=30.0, cohesion=5e3)
    given = {"fill": af.limit.Fill(friction_angle=30.0), "strength": 5e6}
    given["positions"] = [-0.7, 2.5, 3.5, 4.5]
    factors = [
        af.limit.moving_load(each, [50e3, 50e3], spacings=[1.5], **given).factors["factor"].values
        for each in (bridge, pieces)
    ]
    assert np.isinf(factors[0]).any()
    assert factors[1] == pytest.approx(factors[0], rel=1e-6)
    assert "lock" not in caplog.text
    assert "lintel" not in describe_depths(pieces)


@pytest.mark.slow
def test_without_dilatancy_the_wedge_is_the_same():
    found = af.collapse_factor(
        smooth_box(30.0, 1, passive=True),
        live=af.Settlement("wall", (-1.0, 0.0, 0.0)),
        friction="nonassociated",
    )
    assert abs(found.factor) / (0.5 * 18e3 * HEIGHT**2) == pytest.approx(3.0, rel=1e-8)


def test_dry_pieces_do_not_stand_with_a_free_upright_end():
    """With c = γ H / 4 or more, tan φ aside, they do (Rankine's critical height is 4 c / γ)."""
    whole = box(3.0, af.Contact(1e9, 4e8, 0.6), af.Contact(1e9, 4e8, 0.6))
    free = [number for number, each in enumerate(whole.blocks) if each.name != "wall"]
    open_end = af.masonry.assembled(
        [whole.blocks[number] for number in free], lambda a, b: af.Contact(1e9, 4e8, 0.6)
    )
    assert not af.stands(jointed_fill(open_end, 0.5, friction_angle=30.0))
    assert af.stands(jointed_fill(open_end, 0.5, friction_angle=30.0, cohesion=18e3 * HEIGHT / 4.0))


@pytest.mark.slow
def test_where_no_joint_meets_the_foot_forces_converge_in_proportion_to_the_size():
    """Slip lines then leave the wall up to a triangle's height above its foot."""
    found = [pressed(smooth_box(30.0, n, passive=True, shift=1.0), -0.14) for n in (1, 2, 4)]
    errors = np.array(found) / 3.0 - 1.0
    assert errors[1] == pytest.approx(0.11, abs=0.02)
    assert np.all(errors > 0.0)
    assert np.all(errors[1:] < 0.6 * errors[:-1])


@pytest.mark.slow
def test_fill_bears_no_tension():
    """Elastic fill hangs between walls that part; pieces open, and rest on the floor."""
    glue = af.Contact(1e10, 1e10, None)
    whole = box(3.0, glue, glue)
    torn = jointed_fill(whole, 0.5, friction_angle=30.0)
    model = af.build(torn, fidelity="rigid", cells=(1, 1))
    normal = af.dead_load(model.settled(af.Settlement("wall", (0.01, 0.0, 0.0)))).joints["N"]
    assert normal.values.min() >= 0.0
    elastic = af.build(whole, fidelity="full", cells=(2, 2))
    moved = af.dead_load(elastic.settled(af.Settlement("wall", (0.01, 0.0, 0.0))))
    stress = (elastic.cells.stress @ moved.q).reshape(-1, 3)
    mean = 0.5 * (stress[:, 0] + stress[:, 1])
    radius = np.hypot(0.5 * (stress[:, 0] - stress[:, 1]), stress[:, 2])
    assert (mean + radius).max() > 1e3


def test_pieces_fill_the_body_and_are_soil_still():
    ring = {"span": 4.0, "rise": 1.6, "thickness": 0.45, "voussoirs": 13}
    whole = af.bridge(
        arches=[af.shapes.Arch(measured="centre line", name="arch", **ring)],
        backfill=af.shapes.Backfill(cover=0.5),
    )
    fill = jointed_fill(whole, 0.4, friction_angle=35.0, cohesion=5e3)
    soil = find_yielding_blocks(fill)
    assert sum(fill.blocks[n].area for n in soil) == pytest.approx(whole.blocks[-1].area)
    # slivers below 30 % of a whole piece are merged
    assert min(fill.blocks[n].area for n in soil) > 0.3 * 0.4**2 * np.sqrt(3.0) / 8.0
    assert {fill.blocks[n].part for n in soil} == {"backfill"}
    assert find_soft_blocks(fill) == ()  # no fidelity is too low for them
    assert [j.name for j in fill.joints if j.role == "ring"] == [
        j.name for j in whole.joints if j.role == "ring"
    ]
    between = [j for j in fill.joints if {*j.blocks} <= set(soil)]
    assert {round(j.contact.normal_stiffness) for j in between} == {
        round(6.25e6 / (0.4 * (sqrt(3.0) - 1.0) / 2.0))
    }
    against = [j for j in fill.joints if len({*j.blocks} & set(soil)) == 1]
    assert all(j.contact.friction == SOIL_TO_STONE.friction for j in against)
    assert all(j.contact.normal_stiffness <= 0.3e9 * (1.0 + 1e-9) for j in against)


@pytest.mark.parametrize(
    ("size", "angle", "words"),
    [
        (0.5, 70.0, "not between 0 and 60"),
        (0.0, 30.0, "not above 0"),
        (1e-3, 30.0, "give a size with which"),
        (50.0, 30.0, "give a size with which"),
    ],
)
def test_invalid_input_is_refused(size, angle, words):
    whole = box(3.0, SOIL_TO_STONE, SOIL_TO_STONE)
    with pytest.raises(af.InvalidInput, match=words):
        jointed_fill(whole, size, friction_angle=angle)


def test_a_structure_without_fill_is_refused(stack):
    with pytest.raises(af.InvalidInput, match="no fill to cut"):
        jointed_fill(stack, 0.5, friction_angle=30.0)


def test_fill_is_cut_once():
    cut = smooth_box(30.0, 1)
    with pytest.raises(af.InvalidInput, match="into pieces already"):
        jointed_fill(cut, 0.5, friction_angle=30.0)


def test_pieces_are_halves_of_equilateral_triangles():
    """Sides of 1, √3/2 and 1/2 of the longest; the circle in one touches all three."""
    size = 0.8
    pieces = list(_tile_box(np.zeros(2), np.array([3.0, 1.2]), 1.5, size))
    for corners in pieces:
        sides = np.roll(corners, -1, axis=0) - corners
        lengths = np.linalg.norm(sides, axis=1)
        assert sorted(lengths) == pytest.approx([0.4, 0.4 * sqrt(3.0), 0.8])
        arm = np.array(_incentre(corners)) - corners
        away = (sides[:, 0] * arm[:, 1] - sides[:, 1] * arm[:, 0]) / lengths
        assert away == pytest.approx((sqrt(3.0) - 1.0) / 4.0 * size)
    whole = np.concatenate(pieces)
    assert whole[:, 1].min() == 0.0
    assert whole[:, 1].max() == pytest.approx(1.2)
    assert whole[:, 0].min() <= 0.0
    assert whole[:, 0].max() >= 3.0
    assert np.abs(whole[:, 0] - 1.5).min() < 1e-12  # an upright line through the middle


@pytest.mark.parametrize(("part", "pieces"), [(0.29, 1), (0.31, 2)])
def test_slivers_are_joined_to_their_neighbour(part, pieces):
    """Pieces are kept from three tenths of a whole one on."""
    least = 0.3 * 1.0
    whole = shapely.box(0.0, 0.0, 1.0, 1.0)
    rest = shapely.box(1.0, 0.0, 1.0 + part, 1.0)
    found = _merge_slivers([_Piece(whole, (0.5, 0.5)), _Piece(rest, (1.5, 0.5))], least, 1e-9)
    assert len(found) == pieces
    assert sum(each.polygon.area for each in found) == pytest.approx(1.0 + part)
    # one that touches no other stays
    away = shapely.box(1.5, 0.0, 1.5 + part, 1.0)
    apart = [_Piece(whole, (0.5, 0.5)), _Piece(away, (1.6, 0.5))]
    assert len(_merge_slivers(apart, least, 1e-9)) == 2


def test_pieces_are_a_thousand_times_as_stiff_as_their_fill():
    slick = af.Contact(1e13, 1e13, 0.0)
    fill = jointed_fill(box(3.0, slick, slick), 1.0, friction_angle=30.0)
    young = {block.material.young for block in fill.blocks if block.grain}
    assert [*young] == [pytest.approx(6.25e9)]


def test_pieces_are_counted_by_their_area():
    """A whole one is a right triangle of sides s/2 and √3 s/2."""
    smooth = af.Contact(1e10, 1e10, 0.0)
    whole = box(3.0, smooth, smooth)

    def cut(count):
        piece = 3.0 * HEIGHT / count
        return jointed_fill(whole, sqrt(8.0 * piece / sqrt(3.0)), friction_angle=30.0)

    assert len(cut(2.1).blocks) > len(whole.blocks)
    with pytest.raises(af.InvalidInput, match=r"make 1\.9 of a fill"):
        cut(1.9)


@pytest.mark.slow
def test_the_tiling_goes_with_a_long_fill_wherever_it_lies():
    """Six metres by 0.3 m, cut at two places: the same pieces, which are the whole fill."""
    smooth = af.Contact(1e10, 1e10, 0.0)
    shift = np.array([-64.0, -32.0])
    found = []
    for place in (np.zeros(2), shift):
        blocks = [
            replace(each, outline=tuple(map(tuple, (each.points + place).tolist())))
            for each in box(6.0, smooth, smooth, height=0.3).blocks
        ]
        cut = jointed_fill(af.masonry.assembled(blocks, smooth), 0.3, friction_angle=30.0)
        found.append([each for each in cut.blocks if each.grain])
    assert sum(each.area for each in found[0]) == pytest.approx(6.0 * 0.3)
    for here, there in zip(*found, strict=True):
        assert there.points == pytest.approx(here.points + shift, abs=1e-6)


def test_joints_to_stone_are_in_series_with_the_fill_beside_them():
    """Whole pieces on a floor, between walls of 60°: the circle inscribed in each touches them."""
    size, stone = 0.6, af.Contact(0.3e9, 0.12e9, 0.6)
    side, rise = sqrt(3.0) * size, 1.5 * size

    def body(points, name, **kind):
        return af.Block(tuple(points), af.STONE, name, role="other", part=name, **kind)

    left = [(-side, 0.0), (-0.5 * side, rise), (-2.0 * side, rise), (-2.0 * side, 0.0)]
    fill = body([(-side, 0.0), (side, 0.0), (0.5 * side, rise), (-0.5 * side, rise)], "fill")
    blocks = [
        body([(-side, -1.0), (side, -1.0), (side, 0.0), (-side, 0.0)], "floor", fixed=True),
        replace(fill, material=BACKFILL),
        body(left, "left wall", fixed=True),
        body([(-x, y) for x, y in left[::-1]], "right wall", fixed=True),
    ]
    cut = jointed_fill(af.masonry.assembled(blocks, stone), size, friction_angle=30.0)
    soil = (sqrt(3.0) - 1.0) / 4.0 * size / BACKFILL.young
    against = [j for j in cut.joints if not all(cut.blocks[n].grain for n in j.blocks)]
    assert len(against) == 4 + 2 + 2
    for joint in against:
        law = joint.contact
        assert 1.0 / law.normal_stiffness == pytest.approx(1.0 / 0.3e9 + soil)
        assert 1.0 / law.shear_stiffness == pytest.approx(1.0 / 0.12e9 + soil)


def test_steep_joints_of_pieces_are_no_head_joints_of_a_wall():
    """So no run checks the bridge across its plane as a wall in bond."""
    cut = jointed_fill(arch_bridge(), 0.8, friction_angle=35.0)
    steep = np.abs(cut.normals[:, 0]) > np.abs(cut.normals[:, 1])
    inner = np.array([len({cut.blocks[k].part for k in pair}) == 1 for pair in cut.pairs])
    fill = np.array([cut.blocks[k].grain for k in cut.pairs[:, 0]])
    assert (steep & inner & fill).sum() > 10
    assert not cut.heads.any()
    assert "head joint" not in cut.assessment
    assert find_falls_across(cut, {}) == {}
