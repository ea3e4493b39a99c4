"""Fill that falls as grains: areas, overlaps and momentum by closed forms, and falls that end."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
import xarray as xr

import archfem as af
from archfem.dynamics.analysis import with_one_facet
from archfem.dynamics.collapse_state import doubt_soft_blocks
from archfem.dynamics.history import History
from archfem.dynamics.loose_fill import (
    _cut_off,
    doubt_fallen_fill,
    interpolate_field,
    loosen_fill,
)
from archfem.dynamics.recorder import Record
from archfem.dynamics.rigid_body.bodies import LooseBlocks
from archfem.masonry.block import rotate
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.studies.study import Study
from archfem.studies.variations import as_falling, prepare_runs
from archfem.view.films.frames import frames_of_fall
from archfem.view.films.settings import Setup
from archfem.view.pages.player_data import Scene
from archfem.view.positions import FallingBlocks

SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


@pytest.fixture(scope="module")
def footbridge():
    """An arch with fill in one piece between fixed walls."""
    wall = {"length": 1.0, "height": 0.5, "above": 0.5, "state": "fixed"}
    return af.bridge(
        arches=[af.shapes.Arch(span=6.0, rise=1.5, thickness=0.4, voussoirs=15)],
        sidewalls=[af.shapes.Sidewall(**wall, name=f"{side} wall") for side in ("left", "right")],
        backfill=af.shapes.Backfill(cover=0.3),
        width=3.0,
    )


def place(block, pose):
    """Return a block of straight edges in its place."""
    arms, (c, s) = np.array(block.drawn()) - block.centroid, (np.cos(pose[2]), np.sin(pose[2]))
    x, y = arms.T
    moved = block.centroid + pose[:2] + np.column_stack([c * x - s * y, s * x + c * y])
    return shapely.Polygon(moved)


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_the_least_is_cut_off_two_squares(share):
    other = np.add(SQUARE, (0.9, 0.3))
    every = np.ones(4, bool)
    one, two = _cut_off(SQUARE, other, every, share), _cut_off(other, SQUARE, every, share)
    assert shapely.area(shapely.Polygon(one)) == pytest.approx(1.0 - 0.1 * share)
    assert shapely.area(shapely.Polygon(two)) == pytest.approx(1.0 - 0.1 * share)
    if share == 0.5:
        common = shapely.intersection(shapely.Polygon(one), shapely.Polygon(two))
        assert common.area == pytest.approx(0.0, abs=1e-12)
    assert _cut_off(SQUARE, np.add(SQUARE, (1.0, 0.0)), every, share) is SQUARE


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_a_corner_is_cut_off_along_the_face_that_it_is_in(share):
    """A square of which a corner is by d in a face x + y = 2 - d √2."""
    other, every, depth = (
        np.array([(1.9, 0.0), (1.9, 1.9), (0.0, 1.9)]),
        np.ones(4, bool),
        0.1 / 2**0.5,
    )
    one, two = _cut_off(SQUARE, other, every, share), _cut_off(other, SQUARE, every, share)
    assert shapely.area(shapely.Polygon(one)) == pytest.approx(1.0 - (share * depth) ** 2)
    legs = 1.9 - share * 0.1
    assert shapely.area(shapely.Polygon(two)) == pytest.approx(legs**2 / 2.0)


def test_grains_of_fill_as_built_fill_its_place(footbridge):
    (number,) = find_yielding_blocks(footbridge)
    loose = loosen_fill(footbridge, LooseBlocks.as_built(footbridge), {})
    grains = [loose.structure.blocks[k] for k in np.flatnonzero(loose.origin == number)]
    whole = shapely.Polygon(footbridge.blocks[number].drawn())
    assert len(grains) > 15
    assert sum(block.area for block in grains) == pytest.approx(whole.area, rel=2e-3)
    for grain in grains:
        outline = shapely.Polygon(grain.points)
        assert shapely.difference(outline, whole).area < 1e-3 * whole.area
        assert outline.convex_hull.area == pytest.approx(outline.area, rel=1e-9)


def test_fill_that_was_pressed_into_stones_is_cut_off(footbridge):
    """A body that lies 0.1 m too deep loses what is in the arch, and in no grain twice."""
    (number,) = find_yielding_blocks(footbridge)
    start = LooseBlocks.as_built(footbridge)
    start.poses[:, 0] = 0.3  # of all
    start.poses[number, 1] = -0.1
    loose = loosen_fill(footbridge, start, {})
    placed = [
        place(block, pose)
        for block, pose in zip(loose.structure.blocks, loose.start.poses, strict=True)
    ]
    fill, whole = loose.origin == number, shapely.Polygon(footbridge.blocks[number].drawn())
    grains, stones = ([placed[k] for k in np.flatnonzero(which)] for which in (fill, ~fill))
    masonry, soil = shapely.unary_union(stones), shapely.unary_union(grains)
    inside = shapely.difference(shapely.affinity.translate(whole, 0.3, -0.1), masonry)
    # straight cuts take a little more at corners of stones
    assert 0.95 * inside.area < soil.area <= inside.area + 0.01
    # stones are drawn with more chords than they are simulated with
    assert shapely.intersection(soil, masonry).area < 0.01
    assert sum(grain.area for grain in grains) == pytest.approx(soil.area, abs=1e-6)


def test_grains_have_the_motion_of_their_body(footbridge):
    """Places and velocities of a body that shears are linear; its momentum is kept."""
    (number,) = find_yielding_blocks(footbridge)
    outline = np.array(footbridge.blocks[number].drawn())
    heights = outline[:, 1:]
    zero = np.zeros_like(heights)
    field = interpolate_field(
        outline, np.hstack([0.02 * heights, zero]), np.hstack([heights, zero])
    )
    loose = loosen_fill(footbridge, LooseBlocks.as_built(footbridge), {number: field})
    which = np.flatnonzero(loose.origin == number)
    grains, speeds = [loose.structure.blocks[k] for k in which], loose.start.velocities[which]
    body, areas = footbridge.blocks[number], np.array([grain.area for grain in grains])
    assert areas @ speeds[:, 0] / areas.sum() == pytest.approx(body.centroid[1], rel=0.02)
    middle = areas @ [grain.centroid for grain in grains] / areas.sum()
    assert middle[0] == pytest.approx(body.centroid[0] + 0.02 * body.centroid[1], abs=2e-3)
    moved = next(iter(loose_frames(loose)))
    assert loose.restore(moved).velocities[number, 0] == pytest.approx(body.centroid[1], rel=0.02)


def test_grains_of_a_turning_bridge_turn_with_it(footbridge):
    """All blocks turn and move as one rigid body: no grain is cut, and each has its speed."""
    (number,) = find_yielding_blocks(footbridge)
    start, turn, spin = LooseBlocks.as_built(footbridge), 0.1, 2.0
    built = np.array([block.centroid for block in footbridge.blocks])
    placed = np.add(rotate(built, turn), (0.5, 2.0))
    start.poses[:, :2], start.poses[:, 2] = placed - built, turn
    start.velocities[:] = np.column_stack(
        [-spin * placed[:, 1], spin * placed[:, 0], np.full(len(placed), spin)]
    )
    loose = loosen_fill(footbridge, start, {})
    which = np.flatnonzero(loose.origin == number)
    grains = [loose.structure.blocks[k] for k in which]
    area = sum(grain.area for grain in grains)
    assert area == pytest.approx(footbridge.blocks[number].area, rel=2e-3)
    x, y = np.array([grain.centroid for grain in grains]).T
    expected = np.column_stack([-spin * y, spin * x, np.full_like(x, spin)])
    assert loose.start.velocities[which] == pytest.approx(expected, abs=2e-3)


def loose_frames(loose):
    """Yield the frames of loose grains."""
    simulation = af.dynamics.RigidBlockSimulation(loose.structure, dt=5e-4)
    yield from simulation.frames(loose.start, loose.start.time + 0.02)


def test_a_structure_without_fill_is_returned_as_it_is(ring):
    start = LooseBlocks.as_built(ring)
    loose = loosen_fill(ring, start, {})
    assert loose.structure is ring
    assert loose.start is start


@pytest.mark.slow
def test_a_search_of_a_fall_has_one_facet_of_fill_on_each_stone(footbridge, monkeypatch):
    """Default cells end a run as stones slide by a facet; why it has no answer is said."""
    analysis = af.Analysis(
        footbridge, fidelity={"backfill": "full", "rest": "rigid"}, displacements="large"
    )
    motion, seen = af.Motion(np.array([0.0, 1.0, 0.0]), dt=0.01), []
    monkeypatch.setattr(History, "doubts", ())
    monkeypatch.setattr(History, "mechanisms", {})

    def slide(model, *_, **__):
        seen.append(model.size)
        lost = af.DidNotConverge("loose blocks were lost: why", last=None)
        attrs = {"outcome": "ended by loose blocks", "ended": "parted"}
        lost.history = History(xr.Dataset(attrs=attrs), footbridge)
        raise lost

    monkeypatch.setattr("archfem.dynamics.motion_scaling.time_history", slide)
    found = analysis.scale(motion, dt=[0.01], between=(1.0, 1.0))
    one = with_one_facet(analysis)
    assert set(seen) == {one.model.size} != {analysis.model.size}
    assert str(found.doubts[-1]).endswith(
        "at 1.00 × the motion: the first ended by loose blocks, and loose blocks were lost"
    )
    coarse = ida_cells(analysis, monkeypatch, motion)
    assert coarse == {"cells": [1, 1], "cell": "triangle"}
    dry = af.Analysis(af.column(breadth=1.0, heights=[1.0]))
    assert with_one_facet(dry) is dry


def ida_cells(analysis, monkeypatch, motion):
    """Return the cells of the case that an IDA takes."""
    taken = []
    monkeypatch.setattr(Study, "run", lambda study, *_, **__: taken.append(study))
    af.ida(analysis, [motion], limits=["collapse"])
    model = taken[0].points[0].case.settings["model"]
    return {name: model[name] for name in ("cells", "cell")}


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["exact", "rigid"])
def test_a_bridge_with_fill_in_one_piece_falls_by_elastic_and_rigid_joints(footbridge, rule):
    """Fill as one rigid body overlapped with stones, or held them: no run had an answer."""
    analysis = af.Analysis(
        footbridge, fidelity={"backfill": "full", "rest": "rigid"}, damping="effective", dt=0.005
    )
    falling = replace(as_falling(analysis), record=Record(whole_fall=False))
    run = prepare_runs(falling, {"joint_rule": rule})
    motion = af.Motion.synthetic(seed=1, duration=3.0, pga=45.0)
    assert run(motion).kind == "fallen"
    (doubt,) = doubt_soft_blocks(footbridge)
    assert "holds stones by tension until they are loose: backfill" in str(doubt)


def test_pictures_of_a_fall_have_the_grains_in_place_of_the_fill(footbridge):
    """Grains that all move by one motion leave the area of the fill and move its centroid."""
    (number,) = find_yielding_blocks(footbridge)
    loose = loosen_fill(footbridge, LooseBlocks.as_built(footbridge), {})
    moved = loose.start.poses + np.array([0.5, -1.0, 0.0])
    frames = [loose.start.poses, moved]
    run = xr.Dataset(
        {
            "fall_time": ("fall_frame", [1.0, 2.0]),
            "fall_pose": (
                ("fall_frame", "block", "pose"),
                np.zeros((2, len(footbridge.blocks), 3))
                + [[[0.0]], [[1.0]]] * np.array([0.5, -1.0, 0.0]),
            ),
        }
    ).merge(loose.describe_grains(frames))
    falls = FallingBlocks.of(footbridge, History(run, footbridge))
    assert falls.broken.tolist() == [number]
    count = len(run["grain_block"])
    assert len(falls.outlines(1.5)) == len(falls.owners) == len(footbridge.blocks) - 1 + count
    whole = shapely.Polygon(footbridge.blocks[number].drawn())
    built, halfway = (
        shapely.union_all([shapely.Polygon(each) for each in falls.grain_outlines(time)])
        for time in (1.0, 1.5)
    )
    assert shapely.difference(built, whole).area < 1e-3 * whole.area
    assert halfway.area == pytest.approx(whole.area, rel=5e-3)
    travel = np.subtract(halfway.centroid.coords[0], built.centroid.coords[0])
    assert travel == pytest.approx([0.25, -0.5], abs=1e-3)
    # a fall of stones alone has none
    stones = run.drop_vars([name for name in run if str(name).startswith("grain_")])
    assert FallingBlocks.of(footbridge, History(stones, footbridge)).grain_outlines(1.5) == []


@pytest.mark.slow
def test_film_and_player_show_grains_from_the_fall_on(footbridge):
    """The fill becomes a point in a grain then; before, grains are points below the stones."""
    analysis = as_falling(
        af.Analysis(
            footbridge,
            fidelity={"backfill": "full", "rest": "rigid"},
            damping="effective",
            dt=0.005,
        )
    )
    analysis = replace(analysis, record=Record(fields_every=50, whole_fall=False))
    run = analysis.run(af.Motion.synthetic(seed=1, duration=3.0, pga=45.0))
    model, (number,) = analysis.model, find_yielding_blocks(footbridge)
    scene, falls = Scene(footbridge, run, model), FallingBlocks.of(footbridge, run)
    lengths = [len(each) for each in falls.grain_outlines(0.0)]
    rings = np.split(np.arange(len(scene.points)), np.cumsum([b["count"] for b in scene._blocks()]))
    assert [len(ring) for ring in rings[len(footbridge.blocks) : -1]] == lengths
    last, fill = scene.points + scene.fallen[1][-1], rings[number]
    assert np.ptp(last[fill], axis=0) == pytest.approx(0.0, abs=1e-9)
    drawn = sum(shapely.Polygon(last[ring]).area for ring in rings[len(footbridge.blocks) : -1])
    assert drawn == pytest.approx(footbridge.blocks[number].area, rel=0.1)
    held = scene.points + scene.moved[1][-1]
    assert np.ptp(held[rings[-2]], axis=0) == pytest.approx(0.0)
    assert shapely.Polygon(held[fill]).area > 0.5 * footbridge.blocks[number].area
    setup = Setup.of(model, run.dataset["q"].values, "displacement", 1.0).with_falls(falls)
    (frame,) = frames_of_fall(setup, falls, falls.times[-1:])
    own = model.cells.block == number
    assert np.ptp(frame.places[own], axis=0) == pytest.approx(0.0)
    assert len(frame.grains) == len(lengths)


def test_pieces_that_fell_out_of_the_ends_of_the_fill_are_in_doubt_by_end(footbridge):
    pieces = af.masonry.jointed_fill(footbridge, 0.5, friction_angle=35.0)
    fill = find_yielding_blocks(pieces)
    x = pieces.centroids[:, 0]
    outlines = [pieces.blocks[number].points[:, 0] for number in fill]
    ends = min(each.min() for each in outlines), max(each.max() for each in outlines)
    order = sorted(fill, key=lambda number: x[number])
    moved = np.zeros(len(pieces.blocks))
    moved[pieces.free[0]] = 2.0  # a stone
    moved[fill[len(fill) // 2]] = 0.02  # less than its size
    assert not [*doubt_fallen_fill(pieces, moved)]
    moved[order[:3]], moved[order[-1]] = 200.0, 1.0
    said = [str(doubt) for doubt in doubt_fallen_fill(pieces, moved)]
    for text, end, count in zip(said, ends, (3, 1), strict=True):
        assert f"free end at x = {end:.4g} m, {count} of {len(fill)}; retain" in text


@pytest.mark.parametrize("over_crown", [-0.05, 0.05])
def test_an_end_that_a_wall_retains_up_to_the_crown_gets_no_advice_to_retain_it(over_crown):
    """The wall of the left end ends by 5 cm below or above the highest corner of the ring."""
    arch = af.shapes.Arch(span=6.0, rise=1.5, thickness=0.4, voussoirs=15)
    held = {"length": 1.0, "height": 0.5, "setback": 0.0, "state": "fixed"}

    def build(left):
        walls = [af.shapes.Sidewall(**held, above=x, name=f"{x:g}") for x in (left, 1.0)]
        fill = af.shapes.Backfill(cover=0.3)
        return af.bridge(arches=[arch], sidewalls=walls, backfill=fill)

    crown = max(np.max(x.points, axis=0)[1] for x in build(1.1).blocks if x.role == "ring")
    low = max(np.max(x.points, axis=0)[1] for x in build(1.1).blocks if x.fixed) - 1.1
    bridge = build(crown + over_crown - low)
    pieces = af.masonry.jointed_fill(bridge, 0.5, friction_angle=35.0)
    moved = np.zeros(len(pieces.blocks))
    moved[[*find_yielding_blocks(pieces)]] = 9.0
    left, right = doubt_fallen_fill(pieces, moved)
    advised = ["setback = 0" in doubt.remedy for doubt in (left, right)]
    assert advised == [over_crown < 0.0, True]
    assert ("longer ones, `length`" in left.remedy) == (over_crown > 0.0)


@pytest.mark.slow
def test_no_scale_is_searched_where_the_fill_bears_tension_at_rest(footbridge):
    """In proportion to its weight: twice as heavy it bears twice the tension."""
    analysis = af.Analysis(
        footbridge, fidelity={"backfill": "full", "rest": "rigid"}, displacements="large"
    )
    motion = af.Motion.synthetic(duration=0.5, pga=2.0, seed=1)
    tension = {}
    for heavy in (4.0, 8.0):
        blocks = [
            replace(x, material=replace(x.material, unit_weight=heavy * x.material.unit_weight))
            for x in footbridge.blocks
        ]
        model = replace(analysis, structure=replace(footbridge, blocks=tuple(blocks)))
        with pytest.raises(af.errors.InvalidInput, match="under dead load alone") as error:
            af.collapse_scale(model, motion)
        tension[heavy] = float(str(error.value).split(" bears ")[1].split()[0])
    assert tension[8.0] == pytest.approx(2.0 * tension[4.0], rel=0.1)
