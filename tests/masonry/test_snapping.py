"""Outlines that nearly touch, made to touch; and those that are refused."""

import json
import re
from itertools import pairwise

import ezdxf
import numpy as np
import pytest
import shapely
from drawn import assert_same, geojson, square

import archfem as af
from archfem.masonry.block import measure_polygon


@pytest.mark.parametrize(
    ("error", "snap"),
    [(0.5e-3, 2e-3), pytest.param(2e-3, 8e-3, marks=pytest.mark.slow), (8e-3, 0.03)],
)
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2))])
def test_disturbed_outlines_are_made_to_touch(viaduct, drawing, tmp_path, error, snap, seed):
    rng = np.random.default_rng(seed)
    table = json.loads(drawing.read_text())
    for feature in table["features"]:
        ring = np.array(feature["geometry"]["coordinates"][0])[:-1]
        ring += rng.uniform(-error, error, ring.shape)
        if rng.uniform() < 0.5:
            ring = ring[::-1]
        feature["geometry"]["coordinates"] = [[*ring.tolist(), ring[0].tolist()]]
    path = tmp_path / "rough.geojson"
    path.write_text(json.dumps(table))
    # Copies of a corner lie in a square of ± error; their mean, or the foot on an edge, does too.
    assert_same(af.masonry.surveyed(path, snap=snap, width=4.0), viaduct, 2.0 * error)
    assert 0.5 * error < af.read_outlines(path, snap=snap).moved < snap


def test_vertices_are_put_onto_edges(tmp_path):
    """A stone across the joint of two others, corners up to 2 mm off, and a face with a bend."""
    path = geojson(
        tmp_path / "t.geojson",
        {
            "ground": [[0, 0], [4, 0.001], [4, 1], [2.1, 1.0015], [0, 1]],
            "left": [[0, 1.001], [2, 1], [2, 2], [0, 2]],
            "right": [[2.001, 0.999], [4, 1.001], [4, 2], [2, 2.001]],
            "top": [[0, 2.001], [4, 2], [4, 3], [0, 3]],
        },
    )
    found = af.masonry.surveyed(path, snap=2e-3)
    assert [joint.name for joint in found.joints] == [
        "ground to left",
        "ground to right",
        "left to right",
        "left to top",
        "right to top",
    ]
    depths = [joint.depth for joint in found.joints]
    assert depths == pytest.approx([2.0, 2.0, 1.0, 2.0, 2.0], abs=4e-3)
    assert len(found.blocks[0].outline) == 5  # vertices in a straight face are kept


LOWER = {"rock": square(0, -1)}


@pytest.mark.parametrize(
    ("outlines", "says"),
    [
        (
            LOWER | {"a": square(0, 0), "b": square(0.2, 0.2)},
            "overlap by 6.4e.03 cm².* outlines, or leave out the one drawn twice$",
        ),
        (LOWER | {"a": square(0, -0.004)}, "'rock' and 'a' overlap by 40 cm², about 3.98 mm deep"),
        (
            LOWER | {"a": square(0, -0.004)},
            "correct their outlines, or raise snap from 0.001 to 0.004 m, which also closes real",
        ),
        (
            LOWER | {"a": square(0, 0.004)},
            r"faces of 'rock' and 'a' are 4 mm apart at .* m, .* raise snap from 0.001 to 0.004 m",
        ),
        (
            LOWER | {"a": [[-0.1, 0.003], [2, 0], [2, 1], [0, 1]]},
            r"are 2.86 mm apart at \(0, 0\) m, within 0.005 m = 5 times snap, .* touch, or raise",
        ),
        (
            LOWER | {"a": [[-0.1, 0.0033], [1, 0], [1, 1], [-0.1, 1]]},
            r"are 3 mm apart at \(0, 0\) m, .*; or is the unit wrong\? By unit = 'm' .* 1.1 × 2 m$",
        ),
        (  # as of millimetres for centimetres: no snap up to a tenth of the stone closes it
            {
                "rock": [[0, -0.03], [0.03, -0.03], [0.03, 0], [0, 0]],
                "a": [[0, 0.004], [0.03, 0.004], [0.03, 0.03], [0, 0.03]],
            },
            r"are 4 mm apart .* touch; or is the unit wrong\? By unit = 'm' .* 0.03 × 0.06 m$",
        ),
        (  # as of inches for feet: the unit comes first where stones are metres large
            {
                "rock": [[0, -5], [4, -5], [4, 0], [0, 0]],
                "a": [[0, -0.01], [4, 0], [4, 5], [0, 5]],
            },
            r": is the unit wrong\? By unit = 'm' the drawing is 4 × 10 m; or else 'rock' ",
        ),
        (
            LOWER | {"a": square(0, 0), "b": square(0, 0)},
            r"'a' and 'b' at \(0.5, 0.5\) m are the same: leave one out$",
        ),
        (LOWER | {"a": [[0, 0], [1, 1], [1, 0], [0, 1]]}, "'a' crosses or touches itself"),
        (
            LOWER | {"a": square(0.998, 0)},
            r"touch along 2 mm only at .*, within 0.005 m = 5 times snap: join the corners "
            "there, or lower snap from 0.001 to 0.0004 m$",
        ),
        (
            LOWER | {"a": square(3, 3)},
            "'a' rest on nothing: .*; or of 4 × 5 m in all, is the unit wrong[?]$",
        ),
        (  # as of feet for inches
            {"rock": square(0, -10, 10), "a": square(0, 5, 10)},
            "^of 10 × 25 m in all, is the unit wrong[?] Or else blocks 'a' rest on nothing",
        ),
        (
            LOWER | {"a": [[0, 0], [1, 0], [1, 5e-4]]},
            "'a' at .* is no larger than snap = 0.001 m.* or lower snap from 0.001 to 8e-05 m",
        ),
        (
            LOWER | {"a": [[0.0009 * k, 0] for k in range(9)] + [[1, 1]]},
            "'a' at .* is no larger than snap = 0.001 m.* or lower snap from 0.001 to 0.0008 m",
        ),
    ],
)
def test_outlines_that_are_no_structure(tmp_path, outlines, says):
    path = geojson(tmp_path / "bad.geojson", outlines)
    with pytest.raises(af.errors.InvalidStructure, match=says):
        af.masonry.surveyed(path)


def test_no_lower_snap_is_advised_that_leaves_a_gap_open(tmp_path):
    """The gap of 4.5 mm would be no error at 0.8 mm, and split the structure."""
    stones = LOWER | {"a": square(0, 0.0045), "b": square(0, 1.0045)}
    stones |= {"pier": [[1.0, -1.0], [2.0, -1.0], [2.0, 2.0045], [1.0, 2.0045]]}
    path = geojson(tmp_path / "gap.geojson", stones)
    with pytest.raises(af.InvalidStructure, match=r"4\.5 mm apart") as caught:
        af.masonry.surveyed(path)
    assert "lower snap" not in str(caught.value)
    af.masonry.surveyed(path, snap=8e-4)  # would be accepted nevertheless


def draw_ring(path, gap, off):
    """Draw nine stones apart, or over one another, with corners off, in mm as DXF or SVG."""
    rng = np.random.default_rng(1)
    angles = np.radians(np.linspace(160.0, 20.0, 10))
    faces = [[(r * np.cos(t), r * np.sin(t)) for r in (2.0, 2.4)] for t in angles]
    stones = [np.array([*face, *after[::-1]]) for face, after in pairwise(faces)]
    rocks = [
        np.array([*face, face[1] + out, face[0] + out])
        for face, out in ((np.array(faces[0]), [-0.5, -0.3]), (np.array(faces[-1]), [0.5, -0.3]))
    ]
    drawing, shapes = ezdxf.new(units=ezdxf.units.MM), ""
    for layer, outlines in (("STONES", stones), ("ROCK", rocks)):
        shapes += f'<g id="{layer}">'
        for points in outlines:
            along = points[[2, 3]].mean(axis=0) - points[[0, 1]].mean(axis=0)
            along *= 0.5 * gap / np.linalg.norm(along) * (layer == "STONES")
            drawn = points + np.outer([1, 1, -1, -1], along) + rng.uniform(-off, off, (4, 2))
            pairs = (1e3 * drawn).tolist()
            drawing.modelspace().add_lwpolyline(pairs, close=True, dxfattribs={"layer": layer})
            text = " ".join(f"{x},{3e3 - y}" for x, y in pairs)
            shapes += f'<polygon points="{text}"/>'
        shapes += "</g>"
    if path.suffix == ".svg":
        path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg">{shapes}</svg>')
    else:
        drawing.saveas(path)
    return shapely.MultiPolygon([shapely.Polygon(points) for points in stones])


@pytest.mark.parametrize("kind", ["dxf", pytest.param("svg", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("gap", "off", "problem"),
    [
        (5e-3, 0.0, "apart"),
        pytest.param(20e-3, 0.0, "apart", marks=pytest.mark.slow),
        (-3e-3, 0.0, "overlap"),
        pytest.param(-10e-3, 0.0, "overlap", marks=pytest.mark.slow),
        (0.0, 4e-3, "overlap"),
        (0.0, 2e-3, "would move"),
    ],
)
def test_the_snap_that_an_error_names_closes_the_ring(tmp_path, kind, gap, off, problem):
    """And its place, in the drawing's units, is one of the ring."""
    path = tmp_path / f"ring.{kind}"
    ring = draw_ring(path, gap, off)
    layers = {"STONES": af.masonry.Layer(part="arch"), "ROCK": af.masonry.Layer(fixed=True)}
    with pytest.raises(af.InvalidStructure, match=problem) as caught:
        af.masonry.surveyed(path, unit="mm", snap=2e-3, layers=layers)
    found = re.search(
        r"at \((\S+), (\S+)\) mm.*, or raise snap from 2 to (\S+) mm", str(caught.value)
    )
    x, y, snap = map(float, found.groups())
    snap *= 1e-3
    assert "lower snap" not in str(caught.value)
    place = shapely.Point(1e-3 * x, 1e-3 * (y if kind == "dxf" else 3e3 - y))
    assert place.distance(ring) < 0.02
    assert 2e-3 < snap <= max(abs(gap), 2.5 * off, 4e-3) * 1.3
    assert len(af.masonry.surveyed(path, unit="mm", snap=snap, layers=layers).joints) == 10


@pytest.mark.filterwarnings("error")
def test_a_tolerance_as_large_as_the_blocks_is_refused(tmp_path):
    """All vertices merge to one place, so that edges have no length."""
    path = geojson(tmp_path / "bad.geojson", LOWER | {"a": square(0, 0)})
    with pytest.raises(
        af.errors.InvalidStructure, match=r"no larger than snap = 1\.6 m: .* to 0\.15 m"
    ):
        af.masonry.surveyed(path, snap=1.6)


def test_intended_gaps_are_left(tmp_path):
    """A joint open at one end by 6 mm, an open joint of 10 mm: more than five times snap."""
    path = geojson(
        tmp_path / "open.geojson",
        {
            "rock": [[0, -1], [3, -1], [3, 0], [0, 0]],
            "a": [[0, 0], [1, 0], [0.994, 1], [0, 1]],
            "b": square(1, 0),
            "c": [[2.01, 0], [3, 0], [3, 1], [2.01, 1]],
        },
    )
    names = [joint.name for joint in af.masonry.surveyed(path).joints]
    assert names == ["rock to a", "rock to b", "rock to c"]


@pytest.mark.parametrize("west", [0.0, 1e4])
@pytest.mark.parametrize(("gap", "intended"), [(4.9e-3, False), (5.1e-3, True)])
def test_a_gap_counts_as_intended_from_five_times_the_tolerance(tmp_path, gap, intended, west):
    """Two stones side by side on a rock, and a short contact with its edge, at any place."""
    rock = [[west, -1], [west + 4, -1], [west + 4, 0], [west, 0]]
    stones = {"a": square(west, 0), "b": square(west + 1 + gap, 0)}
    apart = geojson(tmp_path / "gap.geojson", {"rock": rock} | stones)
    begin = west + 4 - gap
    stone = [[begin, 0], [west + 5, 0], [west + 5, 1], [begin, 1]]
    short = geojson(tmp_path / "short.geojson", {"rock": rock, "a": stone})
    if intended:
        assert len(af.masonry.surveyed(apart).joints) == 2
        assert af.masonry.surveyed(short).joints[0].depth == pytest.approx(gap)
    else:
        with pytest.raises(af.errors.InvalidStructure, match=r"'b' are 4.9 mm apart"):
            af.masonry.surveyed(apart)
        with pytest.raises(af.errors.InvalidStructure, match=r"touch along 4.9 mm only"):
            af.masonry.surveyed(short)


@pytest.mark.parametrize(("step", "refused"), [(0.95e-3, True), (0.75e-3, False)])
def test_vertices_move_by_twice_the_tolerance_at_most(tmp_path, step, refused):
    """Six in a row become one in their middle, two and a half steps from the ends."""
    row = [[step * k, 0.0] for k in range(6)]
    path = geojson(tmp_path / "row.geojson", {"a": [*row, [1, 0], [1, 1], [0, 1]]})
    if refused:
        words = r"corner of 'a' at .* would move by 2.38 mm"
        with pytest.raises(af.errors.InvalidStructure, match=words):
            af.read_outlines(path)
    else:
        assert af.read_outlines(path).moved == pytest.approx(2.5 * step)


def test_areas_have_the_sense_of_their_outline():
    """A triangle, a square and an angle, at any place, by Green's theorem by hand."""
    angle = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2]], float)
    outlines = {4.5: [[0, 0], [3, 0], [1, 3]], 1.0: square(0, 0), 4.0: angle}
    for area, outline in outlines.items():
        points = np.array(outline, float) + np.array([100.0, -50.0])
        assert measure_polygon(points)[0] == pytest.approx(area)
        assert measure_polygon(points[::-1])[0] == pytest.approx(-area)


def test_a_gap_that_a_third_block_fills_is_none(tmp_path):
    """The floor of a trough, 4 mm thick, between a rock and the slab that lies in it."""
    bottom, floor = [[0.5, 0], [1.35, 0]], [[0.7, 0.004], [1.3, 0.004]]
    path = geojson(
        tmp_path / "trough.geojson",
        {
            "rock": [[0, -1], [2, -1], [2, 0], [0, 0]],
            "trough": [*bottom, [1.35, 1], [1.3, 1], *floor[::-1], [0.7, 1], [0.5, 1]],
            "slab": [*floor, [1.3, 1], [0.7, 1]],
        },
    )
    names = [joint.name for joint in af.masonry.surveyed(path).joints]
    assert names == ["rock to trough", *(f"trough to slab, {k}" for k in (1, 2, 3))]


def test_gaps_that_blocks_touch_across_are_none(tmp_path):
    """In a drawing 70 m large, blocks touch within 70 µm, here more than four times snap."""
    rock = [[0, -40], [60, -40], [60, 0], [0, 0]]
    stones = {f"{x}": square(x, 4e-5) for x in (10, 20)}
    path = geojson(tmp_path / "large.geojson", {"rock": rock} | stones)
    assert len(af.masonry.surveyed(path, snap=1e-5).joints) == 2


def test_a_vertex_beside_a_corner_merges_with_it(tmp_path):
    """Nearly as far as snap in both directions, which is farther than snap at a slant."""
    stone = [[0.9e-3, 0.9e-3], [1, 0], [1, 1], [0, 1]]
    found = af.read_outlines(geojson(tmp_path / "near.geojson", LOWER | {"a": stone}))
    rock, stone = (block.points for block in found.blocks)
    assert stone[0] == pytest.approx([0.45e-3, 0.45e-3], abs=1e-12)
    assert np.any(np.all(rock == stone[0], axis=1))


def test_a_vertex_near_two_edges_is_moved_to_the_nearer_one(tmp_path):
    """A stone on a wedge, near its tip: 0.1 mm above its upper side and 0.9 mm above its foot."""
    along = np.array([-1.0, 0.2]) / np.hypot(1.0, 0.2)
    off = 1e-4 * np.array([0.2, 1.0]) / np.hypot(1.0, 0.2)
    near, far = (np.array([1.0, 0.0]) + s * along + off for s in (4e-3, 0.8))
    stone = [far.tolist(), near.tolist(), [near[0], 1.0], [far[0], 1.0]]
    wedge = [[0, 0], [1, 0], [0, 0.2]]
    found = af.read_outlines(geojson(tmp_path / "wedge.geojson", {"wedge": wedge, "a": stone}))
    assert found.moved == pytest.approx(1e-4)


def test_joints_that_bend_by_less_than_snap_are_made_straight_and_free_faces_are_not(tmp_path):
    """A middle stone: its left face bends by half of snap, its bed as much, its top by more."""
    bed, top, side = [0.5, 0.5e-3], [[0.7, 1.0], [0.3, 1.03]], [-0.5e-3, 0.5]
    outlines = {
        "rock": [[0, -1], [1, -1], [1, 0], bed, [0, 0]],
        "stone": [[0, 0], bed, [1, 0], [1, 1], *top, [0, 1], side],
        "cap": [[0, 1], *top[::-1], [1, 1], [1, 2], [0, 2]],
    }
    found = af.read_outlines(geojson(tmp_path / "bent.geojson", outlines))
    straight = [[0, 0], [0.5, 0.0], [1, 0], [1, 1], *top, [0, 1], side]
    assert found.blocks[1].points == pytest.approx(np.array(straight, float), abs=1e-12)
    assert found.moved == pytest.approx(0.5e-3)
