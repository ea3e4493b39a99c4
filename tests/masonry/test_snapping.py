"""Outlines that nearly touch, made to touch; and those that are refused."""

import json

import numpy as np
import pytest
from drawn import assert_same, geojson, square

import archfem as af
from archfem.masonry.block import measure_polygon


@pytest.mark.parametrize(("error", "snap"), [(0.5e-3, 2e-3), (2e-3, 8e-3), (8e-3, 0.03)])
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
        (LOWER | {"a": square(0, 0), "b": square(0.2, 0.2)}, "'a' and 'b' overlap by 6.4e.03 cm²"),
        (LOWER | {"a": square(0, -0.004)}, "'rock' and 'a' overlap by 40 cm², about 3.98 mm deep"),
        (LOWER | {"a": square(0, 0.004)}, "are 4 mm apart at .* raise snap = 0.001 m above"),
        (LOWER | {"a": [[-0.1, 0.003], [2, 0], [2, 1], [0, 1]]}, r"are 2.86 mm apart at .0\.000"),
        (LOWER | {"a": square(0, 0), "b": square(0, 0)}, "'a' and 'b' are the same"),
        (LOWER | {"a": [[0, 0], [1, 1], [1, 0], [0, 1]]}, "'a' crosses or touches itself"),
        (LOWER | {"a": square(0.998, 0)}, "'rock' and 'a' touch along 2 mm only"),
        (LOWER | {"a": square(3, 3)}, r"\['a'\] rest on nothing"),
        (LOWER | {"a": [[0, 0], [1, 0], [1, 5e-4]]}, "'a' is no larger than snap 0.001 m"),
        (
            LOWER | {"a": [[0.0009 * k, 0] for k in range(9)] + [[1, 1]]},
            "vertex of 'a' at .* by 3.96 mm",
        ),
    ],
)
def test_outlines_that_are_no_structure(tmp_path, outlines, says):
    path = geojson(tmp_path / "bad.geojson", outlines)
    with pytest.raises(af.errors.InvalidStructure, match=says):
        af.masonry.surveyed(path)


@pytest.mark.filterwarnings("error")
def test_a_tolerance_as_large_as_the_blocks_is_refused(tmp_path):
    """All vertices merge to one place, so that edges have no length."""
    path = geojson(tmp_path / "bad.geojson", LOWER | {"a": square(0, 0)})
    with pytest.raises(af.errors.InvalidStructure, match=r"is no larger than snap 1\.6 m: lower"):
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


@pytest.mark.parametrize(("gap", "intended"), [(4.9e-3, False), (5.1e-3, True)])
def test_a_gap_counts_as_intended_from_five_times_the_tolerance(tmp_path, gap, intended):
    """Two stones side by side on a rock, and a short contact with its edge."""
    rock = [[0, -1], [4, -1], [4, 0], [0, 0]]
    apart = geojson(
        tmp_path / "gap.geojson", {"rock": rock, "a": square(0, 0), "b": square(1 + gap, 0)}
    )
    short = geojson(
        tmp_path / "short.geojson",
        {"rock": rock, "a": [[4 - gap, 0], [5, 0], [5, 1], [4 - gap, 1]]},
    )
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
        words = r"vertex of 'a' at .* would move by 2.38 mm"
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
    """A plate of 4 mm between two slabs: corners of the upper one are above its inside."""
    path = geojson(
        tmp_path / "plate.geojson",
        {
            "rock": [[0, -1], [2, -1], [2, 0], [0, 0]],
            "plate": [[-0.3, 0], [2.3, 0], [2.3, 0.004], [-0.3, 0.004]],
            "slab": [[0.5, 0.004], [1.2, 0.004], [1.2, 1], [0.5, 1]],
        },
    )
    names = [joint.name for joint in af.masonry.surveyed(path).joints]
    assert names == ["rock to plate", "plate to slab"]
