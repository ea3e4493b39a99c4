"""Pictures of limit analysis: their content, not their looks."""

from dataclasses import replace
from functools import partial
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from backfilled import arch_bridge
from bonded import bonded_wall
from matplotlib.figure import Figure
from matplotlib.text import Text
from portals import DRY, box, portal

import archfem as af
from archfem.limit import rating
from archfem.limit.displaced_blocks import PlacedBlocks
from archfem.limit.vehicles import cut_road
from archfem.view import (
    draw_capacity,
    draw_collapse,
    draw_kinematic_assessment,
    draw_moving_load,
    draw_rating,
    draw_ratings,
    draw_structure,
    draw_worst_places,
)
from archfem.view.collapse import _draw_ties, _mark_hinges
from archfem.view.structure import draw_loads
from archfem.view.style import structure_axes


def lines_of(axes):
    """Lines by their labels in the legend."""
    lines = {line.get_label(): line.get_xydata() for line in axes.lines}
    return {label: line for label, line in lines.items() if not label.startswith("_")}


def pieces_of(axes):
    """Pieces of the thrust line, each from one joint to another."""
    return lines_of(axes)["thrust line"].reshape(-1, 3, 2)[:, :2]


def test_collapse_shows_thrust_line_hinges_and_moved_blocks(ring):
    found = af.collapse_factor(ring, live=af.BodyForce(1.0))
    figure = draw_collapse(ring, found)
    axes = figure.axes[0]
    lines = lines_of(axes)
    points = af.joints.thrust_line(ring, found.joints).values
    assert len(points) == 18
    np.testing.assert_array_equal(pieces_of(axes), np.stack([points[:-1], points[1:]], axis=1))
    assert len(lines["hinge"]) == 4
    np.testing.assert_allclose(lines["hinge"][0], ring.joints[0].intrados)  # lower block stays
    stones, moved = axes.collections
    assert (len(stones.get_paths()), len(moved.get_paths())) == (19, 17)
    assert "0.4571" in axes.get_title()
    figure.draw_without_rendering()


def test_a_hinge_that_hardly_turns_is_not_marked(ring):
    """It turns by 1/25 of the largest turn: walls in bond have dozens."""
    found = af.collapse_factor(ring, live=af.BodyForce(1.0))
    motion = found.motion.copy()
    still = next(k for k in range(1, 17) if k not in {joint for joint, _ in found.hinges})
    joint = ring.joints[still]
    turns = np.abs(
        [
            motion[ring.joints[k].higher, 2] - motion[ring.joints[k].lower, 2]
            for k, _ in found.hinges
        ]
    )
    motion[joint.higher, 2] += 0.04 * turns.max()
    more = replace(found, motion=motion, hinges=(*found.hinges, (still, "intrados")))
    assert len(lines_of(draw_collapse(ring, more).axes[0])["hinge"]) == 4


def test_without_a_state_the_mechanism_of_the_bound_is_drawn(ring):
    found = af.collapse_factor(ring, live=af.BodyForce(1.0))
    axes = draw_collapse(ring, replace(found, outcome=af.limit.Outcome.BRACKETED)).axes[0]
    assert "mechanism with dilatancy" in axes.get_legend_handles_labels()[1]


def test_a_load_that_never_overturns_shows_no_mechanism(ring):
    found = af.collapse_factor(ring, live=[af.PointLoad(x, (0.0, -1e3)) for x in (-1.4, 1.4)])
    axes = draw_collapse(ring, found).axes[0]
    assert set(lines_of(axes)) == {"thrust line", "live load: 1 kN"}
    assert len(axes.collections) == 1
    assert "never overturns" in axes.get_title()


def test_an_arch_that_falls_has_no_thrust_line():
    thin = af.circular_arch(radius=1.0, thickness=0.09, embrace=180.0, voussoirs=17)
    axes = draw_collapse(thin, af.collapse_factor(thin, live=af.BodyForce(1.0))).axes[0]
    assert set(lines_of(axes)) == {"hinge"}  # a load plays no part: it is not drawn


def test_map_of_capacity_carries_known_values():
    capacity = xr.DataArray(
        [[0.26, 0.92, 1.6], [0.0, 0.45, 0.9], [np.nan, 0.15, 0.42]],
        {"embrace": [120.0, 150.0, 180.0], "ratio": [0.05, 0.15, 0.25]},
        ("embrace", "ratio"),
    )
    known = {(180.0, 0.1075): 0.0, (120.0, 0.02285): 0.0, (120.0, 0.1): 0.58, (120.0, 0.2): 1.264}
    figure = draw_capacity(capacity, {120.0: 0.023, 150.0: 0.054, 180.0: 0.107}, known)
    axes = figure.axes[0]
    assert {text.get_text() for text in axes.texts} >= {"0.1075", "0.02285", "0.58", "1.264"}
    assert axes.get_ylim() == (0.0, 0.25)
    figure.draw_without_rendering()


def test_the_load_is_drawn_and_named(ring):
    found = af.collapse_factor(ring, live=af.PointLoad(-1.0, (0.0, -1e4)))
    assert found.structure is ring
    assert found.live == (af.PointLoad(-1.0, (0.0, -1e4)),)
    axes = draw_collapse(ring, found).axes[0]
    assert f"live load: {found.factor:.3g} × 10 kN" in axes.get_legend_handles_labels()[1]
    assert axes.get_title().replace("\n", " ") == f"{ring.name}: {found.sentence}"
    arrow = next(text for text in axes.texts if text.arrow_patch is not None)
    assert arrow.xy == pytest.approx(found.live[0].place(ring)[1])  # it points at the extrados


@pytest.fixture
def few_places(monkeypatch):
    """Places of vehicles are an eighth of a bridge apart, not a hundredth."""
    monkeypatch.setattr(rating, "_places_along", partial(rating._places_along, steps=8))


@pytest.fixture(scope="module")
def coarse_ring():
    """The ring with fewer voussoirs, for searches of many programmes."""
    return af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7)


def test_a_picture_of_a_slender_wall_names_what_its_result_names():
    """The tie at block 3, block 1 at whose toe it turns, and joint 0; ticks are apart."""
    wall = af.column(breadth=0.6, heights=[2.0, 2.0, 2.0])
    tie = af.masonry.AttachedLoad("block 3", (0.0, 5.0), force=(-500.0, 0.0), passive=True)
    spectrum = af.motion.Ntc2018(ag=0.15, f0=2.5, tc_star=0.33, site="B")
    for direction, loads in ((1.0, [tie]), (-1.0, [])):
        found = af.kinematic_assessment(wall, spectrum, direction=direction, loads=loads)
        assert found.mechanism_name == "overturning about the toe of block 1"
        figure = draw_kinematic_assessment(found)
        figure.draw_without_rendering()
        axes = figure.axes[0]
        names = {text.get_text(): text for text in axes.texts}
        assert {*names} == {"0", "block 1", *["block 3"] * len(loads)}
        # the joint is beside its hinge, and the block on the side that the wall leaves
        assert names["0"].xy == pytest.approx((0.3 * direction, 0.0))
        assert names["block 1"].xy == pytest.approx((-0.3 * direction, 1.0))
        low, high = axes.get_xlim()
        ticks = [*axes.get_xticklabels(), *axes.get_yticklabels()]
        inside = [low <= x.get_position()[0] <= high for x in axes.get_xticklabels()]
        shown = [x.get_window_extent() for x in axes.get_xticklabels()]
        shown = sorted(
            (x for x, seen in zip(shown, inside, strict=True) if seen), key=lambda x: x.x0
        )
        assert shown
        assert all(one.x1 < other.x0 for one, other in pairwise(shown))
        boxes = [text.get_window_extent() for text in names.values()]
        assert not any(x.get_window_extent().overlaps(box) for x in ticks for box in boxes)


def test_an_assessment_shows_moved_blocks_curve_and_demand(coarse_ring):
    found = af.kinematic_assessment(
        coarse_ring,
        af.Eurocode8(ag=0.3, ground="B"),
        confidence_factor=1.2,
    )
    figure = draw_kinematic_assessment(found)
    left, right = figure.axes
    stones, moved = left.collections
    assert (len(stones.get_paths()), len(moved.get_paths())) == (9, 7)
    hinges = lines_of(left)["hinge at rest"]
    np.testing.assert_allclose(hinges[0], coarse_ring.joints[0].intrados)
    # curve, capacity and demand are of one weight for each body, whose ratio is less
    whole = found.of_bodies
    lines, check = lines_of(right), whole.displacement
    curve = lines["capacity a*(d*), FC = 1.2"]
    np.testing.assert_allclose(curve[0], [0.0, found.alpha_0 * 9.81 / whole.e_star / 1.2])
    last = lines.get("the same, an upper bound", curve)[-1]
    np.testing.assert_allclose(last, [whole.d_0_star, 0.0], atol=1e-12)
    point = lines[f"demand {check.demand:.3f} m"][0]
    np.testing.assert_allclose(
        point, [check.demand, check.demand * (2 * np.pi / check.period) ** 2]
    )
    # the ground acceleration is the nearer bound here: 0.3 g on ground B, S = 1.2
    apart = found.a_0_star / 1.2 / (0.3 * 1.2 * 9.80665)
    ratios = apart * found.e_star / whole.e_star, apart
    title = right.get_title().replace("\n", " ")
    words = "ratio {:.3g} with one weight a body, {:.3g} with the weights apart, at which it begins"
    assert words.format(*ratios) in title
    figure.draw_without_rendering()
    # weights that are alike have one ratio
    alone = replace(found, displacement=replace(found.displacement, bodies=None))
    drawn = draw_kinematic_assessment(alone).axes[1]
    assert f"ratio {apart:.2f}, at which it begins" in drawn.get_title().replace("\n", " ")
    np.testing.assert_allclose(lines_of(drawn)["capacity a*(d*), FC = 1.2"][0, 1], apart * 3.530394)
    # what is an upper bound is dotted
    bounded = replace(alone, curve=found.curve.assign_attrs(holds=3))
    drawn = lines_of(draw_kinematic_assessment(bounded).axes[1])
    dotted = drawn["the same, an upper bound"]
    assert len(drawn["capacity a*(d*), FC = 1.2"]) == 4
    assert dotted[0][0] == pytest.approx(found.curve["d"].values[3])
    np.testing.assert_allclose(dotted[-1], [found.d_0_star, 0.0], atol=1e-12)
    # the name of a structure may be wider than the panel
    assert left.get_title() == f"(a) alpha_0 = {found.alpha_0:.3f}, e* = {whole.e_star:.2f}"
    piers = af.arch_on_piers(radius=3, thickness=0.6, voussoirs=7, pier_breadth=1.2, courses=[1.5])
    locked = af.kinematic_assessment(piers, found.spectrum, part="left pier")
    with pytest.raises(af.InvalidInput, match="no mechanism moves under horizontal forces"):
        draw_kinematic_assessment(locked)


def test_an_assessment_shows_ties_to_the_ground_and_between_blocks():
    """A fifth of the height long towards the ground; that of a floor is no tie."""
    piers = af.arch_on_piers(radius=3, thickness=0.6, voussoirs=7, pier_breadth=1.2, courses=[1.5])
    names = [block.name for block in piers.blocks]
    one, other = (names[piers.free[k]] for k in (0, -1))
    ends = [piers.blocks[names.index(name)].centroid for name in (one, other)]
    bar = {"anchor": other, "anchor_point": tuple(ends[1]), "passive": True}
    loads = [
        af.masonry.AttachedLoad(one, tuple(ends[0]), force=(1e3, 0.0), **bar),
        af.masonry.AttachedLoad(one, tuple(ends[0]), force=(0.0, -1e3), passive=True),
        af.masonry.AttachedLoad(one, tuple(ends[0]), weight=1e3),
    ]
    axes = Figure().add_subplot()
    _draw_ties(axes, PlacedBlocks.at_rest(piers, loads))
    between, down = (line.get_xydata() for line in axes.lines)
    assert [*lines_of(axes)] == ["tie"]
    np.testing.assert_allclose(between, ends)
    # each end of a bar has the name of its block, not the middle, where no block is
    written = {text.get_text(): text.xy for text in axes.texts}
    assert {*written} == {one, other}
    np.testing.assert_allclose(written[other], ends[1])
    size = 0.2 * np.ptp(np.concatenate([b.drawn() for b in piers.blocks]), axis=0).max()
    np.testing.assert_allclose(down, [ends[0], ends[0] - [0.0, size]])


def test_long_names_of_hinges_leave_room_for_the_drawing():
    """'course 1, stone 7 to course 2, stone 8' took the width of the page, and more."""
    wall = bonded_wall(3, half=1.0)
    long = [k for k, joint in enumerate(wall.joints) if len(joint.name) > 24][:3]
    motion = np.random.default_rng(3).normal(size=(len(wall.blocks), 3))
    path = SimpleNamespace(velocity=motion)
    found = SimpleNamespace(hinges=[(k, "intrados") for k in long], path=path)
    axes = structure_axes(wall)
    draw_structure(wall, axes=axes)
    _mark_hinges(axes, wall, found, label="hinge")
    axes.figure.draw_without_rendering()
    assert len(long) == 3
    assert not axes.texts
    assert axes.get_position().width > 0.6


@pytest.mark.slow
def test_an_assessment_without_a_finite_motion_shows_the_mechanism_as_it_begins():
    wall = bonded_wall(7, half=1.0)
    found = af.kinematic_assessment(wall, af.Eurocode8(ag=0.3, ground="B"))
    figure = draw_kinematic_assessment(found)
    (axes,) = figure.axes
    # the mechanism rises above the wall, and the title stays within the page
    figure.draw_without_rendering()
    assert axes.title.get_window_extent().y1 < figure.dpi * figure.get_figheight()
    moved = np.abs(found.path.velocity).max(axis=1) > 1e-3
    assert len(axes.collections[1].get_paths()) == moved.sum() > 10
    assert axes.collections[1].get_label() == "mechanism as it begins"


@pytest.mark.slow
def test_a_rating_shows_factors_over_the_middle_and_the_mechanism(coarse_ring, few_places):
    lorry = af.limit.Vehicle("lorry", (5e3, 5e3), (1.0,))
    found = af.rate(coarse_ring, lorry)
    figure = draw_rating(found)
    upper, lower = figure.axes
    lines = lines_of(upper)
    np.testing.assert_allclose(lines["worst place"], [[found.moving.position, found.factor]])
    drawn = lines[f"driving {found.moving.direction}"]
    assert np.nanmin(drawn[:, 1]) == pytest.approx(found.factor, rel=1e-6)
    assert f"factor {found.factor:.3g}" in upper.get_title()
    assert " m of width" in lower.get_title().replace("\n", " ")
    ends = [getattr(coarse_ring.joints[k], side) for k, side in found.moving.worst.hinges]
    np.testing.assert_allclose(lines_of(lower)["hinge"], ends)
    assert upper.get_xlim() == lower.get_xlim()
    figure.draw_without_rendering()
    assert all(any(t.label1.get_visible() for t in x.xaxis.get_major_ticks()) for x in figure.axes)
    labels = lower.get_legend_handles_labels()[1]
    assert f"live load: {found.factor:.3g} × 5 kN" in labels  # both axles are equal


def test_a_rating_shows_its_worst_place_and_the_axles_as_given(ring, few_places):
    """A lorry longer than the ring is worst with its middle far beside it; it spreads over 2 m."""
    wide = replace(ring, width=4.0)
    lorry = af.limit.Vehicle("lorry", (3e3, 12e3, 12e3), (12.0, 1.3), live=1.5, impact=1.2)
    axles, places = [3.6 * axle for axle in lorry.axles], np.linspace(-9.0, 9.0, 37).tolist()
    moving = af.moving_load(wide, axles, spacings=lorry.spacings, positions=places)
    factors = {"live": 1.5, "impact": 1.2, "dead": 1.0, "geometric": 1.0}
    factors |= {"area_load": 0.0, "by_rule": np.nan, "strength": None}
    found = af.limit.Rating(wide, lorry, width=2.0, moving=moving, **factors)
    upper, lower = draw_rating(found).axes
    place, drawn = lines_of(upper)["worst place"][0], lines_of(upper)
    left, right = upper.get_xlim()
    assert left < place[0] < right
    assert abs(place[0]) > np.abs([block.points[:, 0] for block in ring.blocks]).max()
    visible = drawn[f"driving {found.moving.direction}"]
    visible = visible[(left < visible[:, 0]) & (visible[:, 0] < right)]
    assert np.nanmin(visible[:, 1]) == pytest.approx(found.factor, rel=1e-6)
    assert upper.get_ylim()[0] <= found.factor <= upper.get_ylim()[1]
    labels = lower.get_legend_handles_labels()[1]
    assert f"live load: {found.factor:.3g} × 1.8 × 12 kN" in labels
    # without colours lines of the legend differ by dashes and marks
    handles = [x for axes in (upper, lower) for x in axes.get_legend_handles_labels()[0]]
    looks = {
        x.get_label(): (x.get_linestyle(), x.get_marker())
        for x in handles
        if hasattr(x, "get_marker")
    }
    named = [looks[label] for label in ("driving right", "driving left", "thrust line")]
    assert len({*named}) == 3
    # the bridge is analysed under more newtons, over all of its width
    sizes = [-load.force[1] for load in found.moving.worst.live]
    np.testing.assert_allclose(sizes, 12e3 * 1.8 * 2.0)


@pytest.mark.slow
def test_a_rating_marks_where_the_distributed_load_stands(coarse_ring, few_places):
    found = af.rate(coarse_ring, af.limit.Vehicle("lorry", (5e3,), area_load=2e3), friction=None)
    marked = lines_of(draw_rating(found).axes[1])["distributed load"]
    (axle, *strips) = found.moving.worst.live
    np.testing.assert_allclose(marked[:, 0], [load.x for load in strips])
    sinks = [load.place(coarse_ring)[1] for load in strips]
    np.testing.assert_allclose(marked, sinks)
    assert axle.force[1] == -5e3
    assert 0 < len(strips) < 40


@pytest.mark.slow
def test_several_vehicles_are_drawn_each_at_its_worst_place(coarse_ring, few_places, monkeypatch):
    """Of seven the first six: a line each, and a panel with its own axles; the last is named."""
    monkeypatch.setattr(cut_road, "__defaults__", (8,))
    lorries = [
        af.limit.Vehicle(f"lorry {k}", (5e3 + 1e3 * k, 5e3), (1.0,), area_load=2e3 * (k > 1))
        for k in range(3)
    ]
    ratings = [af.rate(coarse_ring, lorry, friction=None) for lorry in lorries]
    seven = [*ratings, *ratings, ratings[0]]
    (upper,) = draw_ratings(seven).axes
    figure = draw_worst_places(seven)
    panels = figure.axes
    assert len(panels) == 6
    # a page prints as much in full width, so that no letter shrinks
    for drawn in (figure, draw_ratings(seven)):
        wide, high = 25.4 * drawn.get_size_inches()
        assert wide == pytest.approx(170.0)
        assert high <= 94.0
    sizes = [text.get_fontsize() for text in figure.findobj(Text) if text.get_text()]
    assert min(sizes) >= 7.0
    legend = [text.get_text() for text in upper.get_legend().get_texts()]
    assert legend == 2 * [f"{lorry.name}, without partial factors" for lorry in lorries]
    points = [line.get_xydata()[0] for line in upper.lines if line.get_marker() == "o"]
    expected = [(found.moving.position, found.factor) for found in 2 * ratings]
    np.testing.assert_allclose(points, expected)
    for found, axes in zip(ratings, panels[:3], strict=True):
        title = f"{found.vehicle.name}, without partial factors: {found.factor:.3g}"
        # both axles stand on it, the first at the right where it drives there
        front, rear = (f"{axle / 1e3:g}" for axle in found.vehicle.axles)
        ends = (rear, front) if found.moving.direction == "right" else (front, rear)
        title += " ({} kN and {} kN)".format(*ends) * (front != rear)
        assert axes.get_title().replace("\n", " ") == title
        # nothing stands beside arrows that are so near
        assert not [text for text in axes.texts if "kN" in text.get_text()]
        tips = [text.xy for text in axes.texts if text.arrow_patch is not None]
        count = int(
            found.moving.factors["axles"].sel(
                direction=found.moving.direction, position=found.moving.position
            )
        )
        loads = found.moving.worst.live[:count]
        np.testing.assert_allclose(tips, [load.place(coarse_ring)[1] for load in loads])
        ends = [getattr(coarse_ring.joints[k], side) for k, side in found.moving.worst.hinges]
        np.testing.assert_allclose(lines_of(axes)["hinge"], ends)
    left = f"not drawn: {seven[-1].label} ({seven[-1].factor:.3g})"
    assert figure.get_suptitle() == left
    assert upper.get_title().replace("\n", " ").endswith(f"; {left}")
    assert not draw_worst_places(ratings).get_suptitle()
    (below,) = figure.legends
    assert "distributed load" in [text.get_text() for text in below.get_texts()]


@pytest.mark.slow
def test_backing_is_hatched_up_to_its_level():
    structure, load = arch_bridge(voussoirs=9), af.BodyForce(1.0)
    for level in (None, 0.5):
        fill = af.limit.Fill(friction_angle=35.0, backing=level)
        axes = af.collapse_factor(structure, live=load, friction=None, fill=fill).plot().axes[0]
        assert ("backing" in axes.get_legend_handles_labels()[1]) == (level is not None)
    (hatched,) = (each for each in axes.collections if each.get_label() == "backing")
    corners = axes.transData.inverted().transform(hatched.clipbox.corners())
    assert corners[:, 1].max() == pytest.approx(0.5)


def test_a_moving_load_shows_factors_over_its_middle_and_the_mechanism(coarse_ring):
    places = np.linspace(-4.0, 4.0, 17)  # on and off
    found = af.moving_load(coarse_ring, [40e3, 80e3], spacings=[1.5], positions=places)
    upper, _ = draw_moving_load(found).axes
    right = found.factors["factor"].sel(direction="right").values
    (line,) = (each for each in upper.lines if each.get_label() == "driving right")
    assert line.get_xdata() == pytest.approx(found.factors["position"].values)
    seen = np.isfinite(right)
    assert line.get_ydata()[seen] == pytest.approx(right[seen])
    (worst,) = (each for each in upper.lines if each.get_label() == "worst place")
    assert worst.get_xdata() == pytest.approx([found.position])
    assert worst.get_ydata() == pytest.approx([found.worst.factor])
    assert f"least factor {found.worst.factor:.3g}" in upper.get_title()
    assert found.plot().axes[0].get_title() == upper.get_title()
    assert repr(found).startswith(f"MovingLoad: least factor {found.worst.factor:.4g}, ")


def side_by_side(pier, backfill=None):
    """Two arches over a pier, and fixed walls beside them."""
    arch = af.shapes.Arch(
        measured="centre line", span=2.0, rise=0.6, thickness=0.3, voussoirs=5, name="arch"
    )
    names = ("left wall", "right wall")
    walls = [af.shapes.Sidewall(length=1.0, height=0.5, state="fixed", name=name) for name in names]
    arches = [arch, replace(arch, name="second arch")]
    return af.bridge(arches=arches, piers=[pier], sidewalls=walls, backfill=backfill)


def wall():
    """Three courses in running bond."""
    ends = [(0.0, 0.8, 1.6), (0.0, 0.4, 1.2, 1.6), (0.0, 0.8, 1.6)]
    blocks = [box(0.0, -1.0, 2.0, 0.0, "rock", fixed=True, part="wall")]
    for y, places in enumerate(ends):
        blocks += [box(a, y, b, y + 1.0, f"{a} {y}", part="wall") for a, b in pairwise(places)]
    return af.masonry.assembled(blocks, DRY)


PIER = af.shapes.Pier(gap=0.8, height=0.5)
BUTTRESSED = {"span": 4.0, "rise": 1.6, "thickness": 0.5, "breadth": 1.2, "height": 2.0}


@pytest.mark.parametrize(
    ("structure", "count"),
    [
        # posts and lintel; a voussoir each; a voussoir and a course each, but for the pier's upper
        # stone, which two arches press; none where blocks have more joints than two
        (portal("ring"), 3),
        (portal("other"), 3),
        (side_by_side(PIER), 10),
        (side_by_side(replace(PIER, height=1.2)), 10 + 2),
        (side_by_side(PIER, af.shapes.Backfill(cover=0.3)), 10),
        (af.shapes.buttressed_arch(voussoirs=7, **BUTTRESSED), 7 + 2 * 5),
        (wall(), 0),
    ],
    ids=["portal", "lintel", "side by side", "on a pier", "below fill", "buttressed", "wall"],
)
def test_a_thrust_line_at_collapse_runs_through_stones_alone(structure, count):
    """Each piece crosses one free stone between its two joints; none is in the air or ground."""
    fill = af.limit.Fill(friction_angle=35.0) if "backfill" in str(structure.blocks) else None
    found = af.collapse_factor(structure, live=af.BodyForce(1.0), fill=fill)
    axes = draw_collapse(structure, found).axes[0]
    if not count:
        assert "thrust line" not in lines_of(axes)
        assert len(lines_of(axes)["thrust at a joint"])
        return
    points = af.joints.thrust_line(structure, found.joints).values
    for piece in pieces_of(axes):
        ends = [np.flatnonzero((points == end).all(axis=1)) for end in piece]
        blocks = [set(structure.joints[int(number)].blocks) for (number,) in ends]
        (block,) = blocks[0] & blocks[1]
        assert not structure.blocks[block].fixed
    assert len(pieces_of(axes)) == count


@pytest.mark.parametrize(
    ("forces", "sizes"), [((1e3, 1e3), "1 kN"), ((1e3, 2e3, 3e3), "(1 kN, 2 kN, 3 kN)")]
)
def test_the_legend_has_the_sizes_of_loads(ring, forces, sizes):
    places = np.linspace(-0.26, 0.26, len(forces))
    loads = [af.PointLoad(x, (0.0, -force)) for x, force in zip(places, forces, strict=True)]
    axes = draw_structure(ring).axes[0]
    draw_loads(axes, ring, loads)
    assert axes.get_legend_handles_labels()[1] == [f"live load: λ × {sizes}"]
    arrows = [text for text in axes.texts if not text.get_text()]
    tails = np.array([text.xyann for text in arrows])
    tips = np.array([text.xy for text in arrows])
    np.testing.assert_allclose(tips, [load.place(ring)[1] for load in loads])
    # unlike sizes stand beside their arrows, halfway along
    named = {text.get_text(): text.xy for text in axes.texts if text not in arrows}
    middles = 0.5 * (tails + tips) if len({*forces}) > 1 else []
    assert [*named] == [f"{force / 1e3:g} kN" for force in forces][: len(middles)]
    np.testing.assert_allclose([*named.values()], middles)
    assert (tails[:, 1] > tips[:, 1]).all()
    np.testing.assert_allclose(tails[:, 0], tips[:, 0])


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_movement_begins_at_its_support(ring, side):
    axes = draw_structure(ring).axes[0]
    draw_loads(axes, ring, [af.Settlement(f"{side} abutment", (0.0, -0.01, 0.0))])
    (arrow,) = axes.texts
    block = ring.blocks[ring.block_number(f"{side} abutment")]
    np.testing.assert_allclose(arrow.xyann, block.centroid)
    assert arrow.xy[1] < arrow.xyann[1]
    (label,) = axes.get_legend_handles_labels()[1]
    assert label == "live load: λ × movement of the support by 0.01 m"
