"""The picture of a drawing that is no structure: outlines, overlaps, gaps, open lines."""

import json
from itertools import combinations

import ezdxf
import numpy as np
import pytest
import shapely
from drawn import draw_portal

import archfem as af
from archfem.view import draw_outlines

BESIDE = {"left": (0.0, 1.0), "right": (1.0, 2.0)}


def draw(path, boxes=BESIDE, units=ezdxf.units.M, factor=1.0, opened=()):
    """Write boxes between two x, one high, each on the layer of its name."""
    drawing = ezdxf.new(units=units)
    for name, (left, right) in boxes.items():
        corners = [(left, 0.0), (right, 0.0), (right, 1.0), (left, 1.0)]
        points = [(factor * x, factor * y) for x, y in corners]
        layer = {"layer": name}
        drawing.modelspace().add_lwpolyline(points, close=name not in opened, dxfattribs=layer)
    drawing.saveas(path)
    return path


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.mark.parametrize(
    ("gap", "said"),
    [
        (0.0, []),
        (0.004, ["gap (1)"]),
        (0.02, []),  # beyond five times snap, an opening
        (0.0004, []),
        (0.0009, []),  # within snap, which closes it
        (0.0012, ["gap (1)"]),
        (-0.0004, []),
        (-0.0009, []),  # deeper than half of snap, which closes it nevertheless
        (-0.004, ["overlap (1)"]),
        (-0.3, ["overlap (1)"]),
    ],
)
def test_overlaps_and_narrow_gaps_are_marked(tmp_path, gap, said):
    boxes = {"left": (0.0, 1.0), "right": (1.0 + gap, 2.0)}
    figure = draw_outlines(draw(tmp_path / "two.dxf", boxes))
    healed = ["overlap that snap closes (1)"] * (gap == -0.0009)
    assert legend(figure) == ["layer 'left' (1)", "layer 'right' (1)", *healed, *said]
    axes = figure.axes[0]
    rings = [line for line in axes.lines if line.get_marker() == "o"]
    assert len(rings) == len(said)
    for ring in rings:
        assert ring.get_xdata() == pytest.approx([1.0 + gap / 2.0], abs=1e-6)
        assert ring.get_ydata() == pytest.approx([0.5])
    texts = {text.get_text() for text in axes.texts}
    assert texts == {"left 1", "right 1"}


@pytest.mark.parametrize(("wide", "gaps"), [(0.0018, 1), (0.0009, 0)])
def test_a_gap_is_marked_by_its_widest_place(tmp_path, wide, gaps):
    """From nothing at the foot: its mean width is less than snap."""
    one, other = ([(0, 0), (1, 0), (1, 1), (0, 1)], [(1, 0), (2, 0), (2, 1), (1 + wide, 1)])
    drawing = ezdxf.new(units=ezdxf.units.M)
    for points in (one, other):
        drawing.modelspace().add_lwpolyline(points, close=True)
    drawing.saveas(tmp_path / "wedge.dxf")
    assert ("gap (1)" in legend(draw_outlines(tmp_path / "wedge.dxf"))) == bool(gaps)


def test_coordinates_are_those_of_the_drawing(tmp_path):
    path = draw(tmp_path / "two.dxf", units=ezdxf.units.MM, factor=1e3)
    axes = draw_outlines(path).axes[0]
    assert axes.get_xlabel() == "x [mm]"
    assert axes.dataLim.x1 == pytest.approx(2000.0)
    # a file without a unit, or with a wrong one, has a picture nevertheless
    axes = draw_outlines(draw(tmp_path / "no.dxf", units=0, factor=1e3)).axes[0]
    assert axes.get_xlabel() == "x [units]"
    axes = draw_outlines(path, unit="km").axes[0]
    assert (axes.get_xlabel(), axes.dataLim.x1) == ("x [km]", pytest.approx(2000.0))


def test_polylines_that_are_not_closed_are_drawn_beside_the_others(tmp_path):
    figure = draw_outlines(draw(tmp_path / "open.dxf", opened=("right",)))
    assert legend(figure) == ["layer 'left' (1)", "not closed"]
    title = figure.axes[0].get_title()
    assert title == "open.dxf as read: 1 closed outlines, 1 not closed"
    assert draw_outlines(draw(tmp_path / "open.dxf"), ignored=["right"]).axes[0].dataLim.x1 == 1.0


def test_names_that_are_too_long_become_numbers(tmp_path):
    boxes = {f"a very long name of a layer {k}": (k, k + 1.0) for k in range(12)}
    axes = draw_outlines(draw(tmp_path / "row.dxf", boxes)).axes[0]
    assert [text.get_text() for text in axes.texts][:2] in (["1", "1"], ["1", "2"])


def test_nothing_to_draw_is_refused(tmp_path):
    with pytest.raises(af.InvalidInput, match="no polylines to draw"):
        draw_outlines(draw(tmp_path / "none.dxf", {}))
    (tmp_path / "none.geojson").write_text(json.dumps({"type": "FeatureCollection"}))
    with pytest.raises(af.InvalidInput, match="no GeoJSON FeatureCollection"):
        draw_outlines(tmp_path / "none.geojson")


CASE = """[structure]
shape = "outlines"
file = "two.dxf"
snap = "1 mm"

[structure.layers]
left = { part = "wall", role = "pier", fixed = true }
right = { part = "wall", role = "pier" }
"""


@pytest.mark.slow
def test_a_failed_check_says_where_the_picture_is(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    draw(tmp_path / "two.dxf", {"left": (0.0, 1.0), "right": (0.9, 2.0)})
    case, picture = tmp_path / "two.toml", tmp_path / "two_drawing.png"
    case.write_text(CASE)
    assert af.commands.main(["check", str(case)]) == 1
    said = capsys.readouterr().err
    assert f"wrote {picture.name}: the drawing as it was read" in said
    assert "overlap by" in said
    assert picture.stat().st_size > 1000
    picture.unlink()
    # a sound drawing, a missing one, and a case without one have none
    draw(tmp_path / "two.dxf", {"left": (0.0, 1.0), "right": (1.0, 2.0)})
    bonded = '[contacts."stone to stone"]\ntension = "0.1 MPa"\ncohesion = "0.2 MPa"\n'
    case.write_text(f'{CASE}{bonded}[model]\nfidelity = "rigid"\ndisplacements = "large"\n')
    assert af.commands.main(["check", str(case)]) == 1
    said = capsys.readouterr().err
    assert (
        "as at 'left 1 to right 1' of contact 'stone to stone': leave these out, or give " in said
    )
    assert "wrote" not in said
    (tmp_path / "two.dxf").unlink()
    assert af.commands.main(["check", str(case)]) == 1
    case.write_text('[structure]\nshape = "column"\n')
    assert af.commands.main(["check", str(case)]) == 1
    assert "wrote" not in capsys.readouterr().err
    assert not picture.exists()


def ring_of(figure, kind):
    """Places of the rings of a kind of fault."""
    (line,) = (x for x in figure.axes[0].lines if x.get_label().startswith(kind))
    return line.get_xydata().tolist()


def test_the_picture_marks_what_the_message_names(tmp_path):
    """A bed 4 mm below the corner beside it, and an overlap of 0.9 mm that snap = 1 mm closes."""
    stones = [
        ((0, 0), (1, 0), (1, 1), (0, 1)),
        ((1, -1), (2, -1), (2, 0.996), (1, 0.996)),
        ((1, 0.996), (2, 0.996), (2, 2), (1, 2)),
        ((1.9991, -1), (3, -1), (3, 2), (1.9991, 2)),
        ((0, 1), (1, 1), (1, 2), (0, 2)),
    ]
    drawing = ezdxf.new(units=ezdxf.units.M)
    for points in stones:
        drawing.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": "wall"})
    drawing.saveas(path := tmp_path / "short.dxf")
    with pytest.raises(af.InvalidStructure, match=r"'wall 1' and 'wall 3' touch along 4 mm only"):
        af.masonry.read_outlines(path)
    figure = draw_outlines(path)
    assert legend(figure)[1:] == ["short contact (1)", "overlap that snap closes (2)"]
    ((x, y),) = ring_of(figure, "short contact")
    assert x == pytest.approx(1.0)
    assert 0.996 <= y <= 1.0
    assert figure.axes[0].get_title() == "short.dxf as read: 5 closed outlines, 1 fault"


def test_a_stone_amid_gaps_and_one_drawn_twice_are_marked_at_their_faults_alone(tmp_path):
    """Joints of 0.8 mm around a stone are one with the two of 3 mm; below, two are alike."""
    boxes = {
        "left": (0, 0.9992, 0, 1.0022),
        "amid": (1, 2, 0, 1),
        "right": (2.003, 3, 0, 1.0022),
        "top": (0, 3, 1.003, 2),
        "foot": (0, 3, -1, -0.0008),
        "again": (0, 3, -1, -0.0008),
    }
    drawing = ezdxf.new(units=ezdxf.units.MM)
    for name, (x0, x1, y0, y1) in boxes.items():
        points = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        points = [(1e6 + 1e3 * x, 1e6 + 1e3 * y) for x, y in points]
        drawing.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": name})
    drawing.saveas(path := tmp_path / "amid.dxf")
    figure = draw_outlines(path)
    assert legend(figure)[len(boxes) :] == ["overlap (1)", "gap (2)"]
    gaps = next(x for x in figure.axes[0].collections if len(x.get_paths()) == 2)
    sizes = [shapely.Polygon(x.vertices).area / 1e6 for x in gaps.get_paths()]
    assert max(sizes) < 0.01  # m², and 1 with the stone
    ((x, y),) = ring_of(figure, "overlap")
    assert (x, y) == pytest.approx((1e6 + 1.5e3, 1e6 - 500.4))
    figure.canvas.draw()
    labels = [label.get_text() for label in figure.axes[0].get_xticklabels()]
    assert "1001000" in labels


def test_all_faults_of_a_drawing_are_listed_in_one_pass(tmp_path):
    """A line, a circle, an open stone, two overlaps of 6 mm and two gaps of 3 mm."""
    drawing = ezdxf.new(units=ezdxf.units.M)
    space, layer = drawing.modelspace(), {"dxfattribs": {"layer": "wall"}}
    space.add_line((0, 0), (1, 0), **layer)
    space.add_circle((0, 0), 1.0)
    lefts = [0.0, 1.0, 1.994, 2.988, 3.991, 4.994]
    for k, x in enumerate([*lefts, 5.994]):
        right = x + 1.0
        points = [(x, 0), (right, 0), (right, 1), (x, 1)]
        space.add_lwpolyline(points, close=k < len(lefts), **layer)
    drawing.saveas(path := tmp_path / "all.dxf")
    with pytest.raises(af.InvalidInput) as caught:
        af.masonry.read_outlines(path, layers={"wall": af.masonry.Layer(part="w", role="pier")})
    said = str(caught.value)
    for words in (
        "layer 'wall' has a LINE beside its polylines",
        "layer '0' has a CIRCLE, which would be left out",
        "a polyline at (5.994, 0) m on layer 'wall' is not closed",
        "the deepest of 2 overlaps",
        "the widest of 2 gaps",
        *(f"'wall {k}' and 'wall {k + 1}'" for k in (2, 3, 4, 5)),
    ):
        assert said.count(words) == 1, words
    # the line, the circle, the open stone, the overlaps and the gaps
    assert len(said.splitlines()) == 5
    figure = draw_outlines(path)
    assert legend(figure)[1:] == ["not closed", "overlap (2)", "gap (2)"]
    places = [2.988 + 0.003, 1.994 + 0.003]
    assert sorted(x for x, _ in ring_of(figure, "overlap")) == pytest.approx(places[::-1])
    assert sorted(x for x, _ in ring_of(figure, "gap")) == pytest.approx([3.9895, 4.9925])


def test_the_nearest_faces_of_a_stone_without_support_are_marked(tmp_path):
    """12 mm above the one below, which is no narrow gap; the other stone is 0.5 m away."""
    drawing = ezdxf.new(units=ezdxf.units.M)
    for y in (0.0, 1.012, 2.512):
        points = [(0, y), (1, y), (1, y + 1), (0, y + 1)]
        drawing.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": "pier"})
    drawing.saveas(path := tmp_path / "loose.dxf")
    figure = draw_outlines(path, error="no compression in its joints can hold 'pier 2', however")
    assert legend(figure)[1:] == ["face not joined (1)"]
    assert ring_of(figure, "face") == [pytest.approx([0.5, 1.0], abs=0.02)]
    # 0.5 m below the third there is no face: the stone itself is marked
    figure = draw_outlines(path, error="no compression in its joints can hold 'pier 3', however")
    assert ring_of(figure, "face")[0][1] == pytest.approx(3.0, abs=0.2)
    assert legend(draw_outlines(path)) == ["layer 'pier' (3)"]


def test_polylines_in_x_and_z_are_drawn_flat(tmp_path):
    drawing = ezdxf.new(units=ezdxf.units.M)
    drawing.modelspace().add_polyline3d([(0, 0, 0), (1, 0, 0), (1, 0, 1)], close=True)
    drawing.saveas(path := tmp_path / "upright.dxf")
    assert draw_outlines(path).axes


def test_seven_layers_have_colours_of_their_own(tmp_path):
    boxes = {f"layer {k}": (float(k), k + 1.0) for k in range(7)}
    figure = draw_outlines(draw(tmp_path / "seven.dxf", boxes))
    faces = {tuple(each.get_facecolor()[0]) for each in figure.axes[0].collections}
    assert len(faces) == 7


def test_every_stone_of_a_drawing_has_its_name_apart_from_others(tmp_path):
    """By its whole name, or by its number in its layer, as results name it."""
    structure = af.Case.read(draw_portal(tmp_path)).structure
    figure = draw_outlines(tmp_path / "portal.dxf", snap=4e-3)
    figure.draw_without_rendering()
    texts = figure.axes[0].texts
    names = [block.name for block in structure.blocks]
    for text in texts:
        x, y = text.get_position() if not hasattr(text, "xy") else text.xy
        near = np.linalg.norm(structure.centroids - np.array([x, y]) / 1e3, axis=1).argmin()
        assert names[near].endswith(text.get_text())
    assert len(texts) == len(names)
    boxes = [text.get_window_extent().shrunk(0.9, 0.9) for text in texts]
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
