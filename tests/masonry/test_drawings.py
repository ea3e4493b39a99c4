"""Drawings read: GeoJSON and DXF, units and layers; and files that are none."""

import json
import re
import resource
import struct
from collections import Counter
from itertools import pairwise
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from drawn import assert_same, draw_portal, dxf, geojson, layers_of, square

import archfem as af
from archfem.cases.structure_text import describe_depths
from archfem.masonry.survey import drawings
from archfem.masonry.survey.drawings import read_drawing


@pytest.mark.parametrize(
    ("units", "factor", "unit"),
    [
        (6, 1.0, None),
        (4, 1e3, None),
        pytest.param(5, 1e2, None, marks=pytest.mark.slow),
        pytest.param(0, 1e3, "mm", marks=pytest.mark.slow),
        (1, 1e2, "cm"),
    ],
    ids=["m", "mm", "cm", "given", "given against the file"],
)
def test_round_trip_through_dxf(viaduct, tmp_path, units, factor, unit):
    path = dxf(tmp_path / "viaduct.dxf", viaduct, factor, units)
    layers = layers_of(viaduct)
    assert_same(af.masonry.surveyed(path, layers=layers, unit=unit, width=4.0), viaduct, 1e-6)


def test_round_trip_through_2d_polylines_drawn_clockwise(tmp_path):
    """Old-style polylines, mirrored by their extrusion, in a drawing that names nothing."""
    drawing = ezdxf.new()
    for x, y, layer in ((0.0, -1.0, "rock"), (0.0, 0.0, "pier"), (0.0, 1.0, "pier")):
        points = [(-px, py) for px, py in reversed(square(x, y))]
        attributes = {"layer": layer, "extrusion": (0, 0, -1)}
        drawing.modelspace().add_polyline2d(points, close=True, dxfattribs=attributes)
    drawing.saveas(tmp_path / "pier.dxf")
    layers = {"rock": af.masonry.Layer(fixed=True), "pier": af.masonry.Layer()}
    found = af.masonry.surveyed(tmp_path / "pier.dxf", layers=layers)
    assert [block.name for block in found.blocks] == ["rock 1", "pier 1", "pier 2"]
    assert [joint.name for joint in found.joints] == ["pier, base", "pier, joint 1"]
    assert found.blocks[1].centroid == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            {
                "geometry": {
                    "type": "MultiPolygon",
                    "coordinates": [[square(0, 0)], [square(2, 0)]],
                }
            },
            "'a' is a MultiPolygon: give each block as one Polygon",
        ),
        ({"geometry": {"type": "MultiPolygon", "coordinates": [3]}}, "'a' is a Polygon|Multi"),
        ({"geometry": None}, "'a' is a None"),
        (
            {
                "geometry": {
                    "type": "Polygon",
                    "coordinates": [square(0, 0, 4), square(1, 1)],
                }
            },
            "'a' has a hole",
        ),
        ({"geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1, 1]]]}}, "has 2 vertices"),
        ({"geometry": {"type": "Polygon", "coordinates": [[[0, 0], "x"]]}}, "no list of points"),
        ({"geometry": {"type": "Polygon", "coordinates": [[1, 2, 3]]}}, "no finite points"),
        (
            {"geometry": {"type": "Polygon", "coordinates": [[[0, 0, 0], [1, 0, 0], [1, 1, 9]]]}},
            "does not lie in the plane",
        ),
        ({"properties": {"name": "a", "Material": "stone"}}, "did you mean 'material'"),
        ({"properties": {"name": "a", "fixed": "yes"}}, "fixed = 'yes' is not true or false"),
        ({"properties": {"name": "a", "material": "jelly"}}, "'a' is of 'jelly'"),
    ],
)
def test_features_that_are_no_blocks(tmp_path, change, says):
    path = geojson(tmp_path / "bad.geojson", {"a": square(0, 0)})
    table = json.loads(path.read_text())
    table["features"][0] |= change
    path.write_text(json.dumps(table))
    with pytest.raises(af.errors.InvalidInput, match=says):
        af.read_outlines(path)


def test_wrong_units(tmp_path):
    big = {"rock": square(0, -400, 400), "a": square(0, 0, 400)}
    path = geojson(tmp_path / "mm.geojson", big)
    with pytest.raises(
        af.errors.InvalidInput, match=r"typically 566 m large: .* 0\.4 m by unit = \"mm\""
    ):
        af.read_outlines(path)
    assert af.read_outlines(path, unit="mm", snap=1e-4).blocks[0].area == pytest.approx(0.16)
    with pytest.raises(af.errors.InvalidInput, match="unit = '1 stone' is not in a unit like m"):
        af.read_outlines(path, unit="stone")
    degrees = {"a": square(31.2, 40.9, 5e-6), "b": square(31.2, 40.9 + 5e-6, 5e-6)}
    with pytest.raises(
        af.errors.InvalidInput, match=r"degrees \(CRS84\) do not do, export projected metres"
    ):
        af.read_outlines(geojson(tmp_path / "deg.geojson", degrees))


def test_files_that_are_no_drawings(tmp_path):
    for name, text, says in (
        ("a.shp", "", "is no drawing: give a .geojson, .dxf, .svg, .ifc or .msh"),
        ("a.geojson", "{", "it is not JSON"),
        ("b.geojson", "[]", "no GeoJSON FeatureCollection"),
        ("d.geojson", '{"features": [3]}', "feature 1 is 3, where GeoJSON has an object"),
        ("c.geojson", '{"type": "FeatureCollection", "features": []}', "no closed outlines"),
        ("a.dxf", "nonsense", "it is no DXF drawing that ezdxf reads"),
        ("e.geojson", " " * 2**25, "it is not JSON"),
        ("f.geojson", " " * (2**25 + 1), "has 33554433 bytes, and a drawing at most 33554432"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(af.errors.InvalidInput, match=says):
            af.read_outlines(tmp_path / name)
    with pytest.raises(af.errors.InvalidInput, match="there is no drawing"):
        af.read_outlines(tmp_path / "none.dxf")


@pytest.mark.parametrize(
    ("draw", "says"),
    [
        (lambda s: s.add_lwpolyline(square(2, 0)), r"at \(2, 0\) m on layer '0' is not closed"),
        (lambda s: s.add_line((0, 0), (1, 1)), "layer '0' has a LINE beside its polylines"),
        (lambda s: s.add_hatch(), "layer '0' has a HATCH beside its polylines: make a closed"),
        (
            lambda s: s.add_solid(square(2, 0), dxfattribs={"layer": "TOP"}),
            "layer 'TOP' has a SOLID, which would be left out: make a closed polyline of each",
        ),
        (lambda s: s.add_trace(square(2, 0)), "layer '0' has a TRACE"),
        (lambda s: s.add_3dface(square(2, 0)), "layer '0' has a 3DFACE"),
        (lambda s: s.add_mline(square(2, 0)), "layer '0' has a MLINE"),
        (lambda s: setattr(s.add_region(), "sat", ["x"]), "layer '0' has a REGION"),
        (lambda s: s.add_circle((2, 0), 1), "layer '0' has a CIRCLE"),
        (
            lambda s: s.add_lwpolyline([(2, 0), (3, 0), (3, 1), (2, 0.002)]),
            "is not closed, its ends are 2 mm apart: close",
        ),
        (lambda s: s.add_polymesh((3, 3)), "is a mesh"),
        (
            lambda s: (
                s.add_text("one", dxfattribs={"insert": (0.2, 0.2)}),
                s.add_mtext("two", dxfattribs={"insert": (0.4, 0.4)}),
            ),
            r"has the texts \['one', 'two'\] in it",
        ),
    ],
)
def test_dxf_that_cannot_be_read(tmp_path, draw, says):
    drawing = ezdxf.new("R2000")  # which holds regions as text
    drawing.modelspace().add_lwpolyline(square(0, 0), close=True)
    draw(drawing.modelspace())
    drawing.saveas(tmp_path / "bad.dxf")
    with pytest.raises(af.errors.InvalidInput, match=says):
        af.read_outlines(tmp_path / "bad.dxf")


def test_a_multipolygon_of_one_polygon_is_that_polygon(tmp_path):
    """As QGIS exports layers of polygons."""
    path = geojson(tmp_path / "qgis.geojson", {"a": square(0, 0), "b": square(0, 1)})
    one = af.read_outlines(path)
    table = json.loads(path.read_text())
    for feature in table["features"]:
        rings = feature["geometry"]["coordinates"]
        feature["geometry"] = {"type": "MultiPolygon", "coordinates": [rings]}
    path.write_text(json.dumps(table))
    assert af.read_outlines(path).blocks == one.blocks


def test_an_outline_whose_ends_coincide_within_snap_is_closed(tmp_path):
    """Ends that a program prints with other digits, after an arc or a line."""
    for gap, bulge in ((4e-7, 0.0), (9e-4, 0.0), (4e-7, 0.2)):
        drawing = ezdxf.new(units=6)
        points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, bulge), (gap, 0, 0)]
        drawing.modelspace().add_lwpolyline(points, "xyb")
        drawing.saveas(tmp_path / "open.dxf")
        (block,) = af.read_outlines(tmp_path / "open.dxf").blocks
        # a segment of the half angle 2 atan(0.2) beside the square
        half = 2.0 * np.arctan(bulge)
        radius = 0.5 / np.sin(half) if bulge else 0.0
        segment = radius**2 * (half - 0.5 * np.sin(2.0 * half))
        assert block.area == pytest.approx(1.0 + segment, abs=1e-3)
    with pytest.raises(af.InvalidInput, match=r"is not closed, its ends are 0\.0004 mm"):
        af.read_outlines(tmp_path / "open.dxf", snap=1e-7)


def bulged_arch(path, *, mirrored=False, filled=False, count=13):
    """Draw a semicircular ring of radii 2 and 2.4 m with arcs, on rock, and soil above it."""
    drawing = ezdxf.new(units=6)
    space = drawing.modelspace()
    sense = -1.0 if mirrored else 1.0
    angles = np.linspace(np.pi, 0.0, count + 1)
    bulge = np.tan(0.25 * np.pi / count)

    def draw(layer, *vertices):
        row = [(sense * x, y, sense * b) for x, y, b in vertices]
        normal = {"extrusion": (0, 0, sense)}
        # in the coordinates of a polyline whose normal points away, x and the arcs are mirrored
        row = [(sense * x, y, sense * b) for x, y, b in row]
        space.add_lwpolyline(row, "xyb", close=True, dxfattribs={"layer": layer} | normal)

    for first, last in pairwise(angles):
        corners = (2.0, first, -bulge), (2.0, last, 0), (2.4, last, bulge), (2.4, first, 0)
        draw("ARCH", *((r * np.cos(a), r * np.sin(a), b) for r, a, b in corners))
    for side in (-1.0, 1.0):
        x, width = side * 2.0, side * 1.4
        draw("ROCK", (x, -0.5, 0), (x + width, -0.5, 0), (x + width, 0, 0), (x, 0, 0))
    if filled:
        above = (2.4, 0, 0), (3.4, 0, 0), (3.4, 3, 0), (-3.4, 3, 0), (-3.4, 0, 0), (-2.4, 0, -1.0)
        draw("FILL", *above)
    drawing.saveas(path)
    return path


ARCH = {
    "ARCH": af.masonry.Layer(part="arch", role="ring"),
    "ROCK": af.masonry.Layer(part="rock", role="other", fixed=True),
}


@pytest.mark.parametrize("mirrored", [pytest.param(False, marks=pytest.mark.slow), True])
def test_arcs_of_polylines_are_read_to_half_of_snap(tmp_path, mirrored, verified):
    """A ring drawn with bulges bears as the ring of exact arcs does, and weighs the same."""
    path = bulged_arch(tmp_path / "arcs.dxf", mirrored=mirrored)
    exact = af.circular_arch(radius=2.2, thickness=0.4, embrace=180.0, voussoirs=13)
    area = sum(block.area for block in exact.blocks if not block.fixed)
    factors = []
    for snap in (1e-3,) if mirrored else (1e-3, 1e-5):
        found = af.masonry.surveyed(path, layers=ARCH, snap=snap)
        assert len(found.joints) == 14
        stones = [block for block in found.blocks if not block.fixed]
        for block in stones:
            assert block.corners is not None
            radii = np.linalg.norm(block.points, axis=1)
            assert np.minimum(abs(radii - 2.0), abs(radii - 2.4)) == pytest.approx(0.0, abs=1e-9)
        # chords lie below an arc by 2/3 of their sagitta, a half of snap at most, on average
        lost = area - sum(block.area for block in stones)
        assert 0.0 < lost < np.pi * 2.4 * snap / 3.0
        factors.append(af.collapse_factor(found, live=af.BodyForce(1.0)).factor)
    reference = af.collapse_factor(exact, live=af.BodyForce(1.0)).factor
    assert factors == pytest.approx([reference] * len(factors), rel=1e-3)
    if mirrored:
        return
    assert factors[1] == pytest.approx(reference, rel=1e-5)
    verified("ring drawn with arcs of DXF: collapse factor", reference, "exact arcs", factors[1])


def test_stones_on_both_sides_of_an_arc_touch_along_it(tmp_path):
    """Soil is drawn with one arc over all voussoirs, which it meets chord by chord."""
    layers = ARCH | {"FILL": af.masonry.Layer(part="backfill", material="backfill", role="other")}
    path = bulged_arch(tmp_path / "fill.dxf", filled=True)
    found = af.masonry.surveyed(path, layers=layers)
    fill = next(k for k, block in enumerate(found.blocks) if block.part == "backfill")
    along = [joint for joint in found.joints if fill in joint.blocks and joint.middle[1] > 1e-6]
    length = sum(np.linalg.norm(joint.ends[1] - joint.ends[0]) for joint in along)
    assert length == pytest.approx(np.pi * 2.4, rel=1e-3)
    assert {min(joint.blocks) for joint in along} == set(range(13))


def test_blocks_inserted_in_a_drawing_are_read(tmp_path, monkeypatch):
    """Of an insert the layer 0 is its own; stones in an array are within another insert."""
    drawing = ezdxf.new(units=6)
    space, stone = drawing.modelspace(), drawing.blocks.new("stone")
    stone.add_lwpolyline(square(0, 0), close=True)
    stone.add_text("note", dxfattribs={"layer": "NOTES"})
    outer = drawing.blocks.new("pair")
    array = {"layer": "PIER", "row_count": 2, "row_spacing": 1.0}
    outer.add_blockref("stone", (0, 0), dxfattribs=array)
    space.add_blockref("pair", (5, 1))
    space.add_lwpolyline(square(5, 0), close=True, dxfattribs={"layer": "ROCK"})
    space.add_blockref("stone", (9, 9), dxfattribs={"layer": "NOTES"})
    drawing.saveas(tmp_path / "blocks.dxf")
    layers = {"PIER": af.masonry.Layer(), "ROCK": af.masonry.Layer(fixed=True)}
    layers["NOTES"] = af.masonry.Layer(ignore=True)
    found = af.masonry.surveyed(tmp_path / "blocks.dxf", layers=layers)
    assert [block.name for block in found.blocks] == ["PIER 1", "PIER 2", "ROCK 1"]
    assert found.blocks[1].centroid == pytest.approx([5.5, 2.5])
    # without a row of the table the stones of an insert are named, as any other
    del layers["PIER"]
    with pytest.raises(af.InvalidInput, match=r"of layer 'PIER' \(closed outlines: 2, the first"):
        af.read_outlines(tmp_path / "blocks.dxf", layers=layers)
    assert drawings.MAX_ENTITIES == 100_000
    monkeypatch.setattr(drawings, "MAX_ENTITIES", 1000)  # a hundred times as many take seconds
    array["row_count"] = 300
    for place in range(4):
        space.add_blockref("stone", (place, 0), dxfattribs=array)
    drawing.saveas(tmp_path / "blocks.dxf")
    with pytest.raises(af.InvalidInput, match="more than 1000 entities"):
        read_drawing(tmp_path / "blocks.dxf")


def test_dxf_without_a_unit(tmp_path, stack):
    path = dxf(tmp_path / "none.dxf", stack, units=0)
    breadth = np.ptp(np.concatenate([block.points for block in stack.blocks])[:, 0])
    words = rf'unit \(\$INSUNITS\): give .* right, .*, {breadth:.3g} m by unit = "m"$'
    with pytest.raises(af.errors.InvalidInput, match=words):
        af.read_outlines(path)


@pytest.mark.parametrize(
    ("size", "sound"), [(0.0205, True), (0.0195, False), (19.5, True), (20.5, False)]
)
def test_a_block_is_between_two_centimetres_and_twenty_metres_large(tmp_path, size, sound):
    """Its diagonal, of half of all blocks: of three here two count."""
    edge = size / 2**0.5
    outlines = {"a": square(0, 0, edge), "b": square(0, edge, edge), "c": square(edge, 0, 0.1)}
    path = geojson(tmp_path / "any.geojson", outlines)
    if sound:
        assert len(read_drawing(path)) == 3
    else:
        with pytest.raises(af.InvalidInput, match=f"typically {size:.3g} m large.*: give the unit"):
            read_drawing(path)


@pytest.mark.parametrize(
    ("place", "said"), [((179.9, 89.9), True), ((180.1, 0), False), ((0, 90.1), False)]
)
def test_small_blocks_within_the_globe_may_be_in_degrees(tmp_path, place, said):
    outlines = {"a": square(*place, 1e-5), "b": square(0, 0, 1e-5)}
    path = geojson(tmp_path / "any.geojson", outlines)
    with pytest.raises(af.InvalidInput) as caught:
        read_drawing(path)
    assert ("degrees (CRS84)" in str(caught.value)) is said


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"geometry": 3}, r"'geometry' of 'a' is 3, where GeoJSON has an object in braces"),
        ({"properties": [1]}, r"'properties' of feature 1 is \[1\], where GeoJSON has an object"),
        ({"properties": {"material": ["stone"]}}, r"material = \['stone'\] is a table: give words"),
        ({"geometry": {"type": "Polygon", "coordinates": "x"}}, "give each block as one Polygon"),
        (
            {"geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1e300, 0], [1, 1]]]}},
            r"a coordinate of 1e\+300 m, and there is room up to 1e\+09 m",
        ),
        (
            {"geometry": {"type": "Polygon", "coordinates": [[[0, 0], [10**400, 0], [1, 1]]]}},
            "no list of points",
        ),
        ({"properties": {"name": "a\x1b[2J"}}, r"has '\\x1b', which cannot be printed"),
    ],
)
def test_values_that_no_program_exports(change, says, tmp_path):
    feature = {"geometry": {"type": "Polygon", "coordinates": [square(0, 0)]}}
    feature = {"properties": {"name": "a"}} | feature | change
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    with pytest.raises(af.InvalidInput, match=says):
        af.read_outlines(path)


def test_a_drawing_of_too_many_vertices_or_too_rough_a_tolerance_takes_no_time(tmp_path):
    """Every edge is compared with every vertex, and pairs of vertices within snap are listed."""
    fine = [[0.001 * k, 0.0] for k in range(20_001)] + [[10.0, 3.0]]
    with pytest.raises(af.InvalidInput, match="it has 20002 vertices, and there is room for 20000"):
        read_drawing(geojson(tmp_path / "a.geojson", {"a": fine}))
    many = {f"{k}": square(0.5 * (k % 20), 0.5 * (k // 20), 0.5) for k in range(400)}
    says = "would merge 1600 vertices at each place on .*; without a unit it is in metres"
    with pytest.raises(af.errors.InvalidStructure, match=says):
        af.read_outlines(geojson(tmp_path / "b.geojson", many), snap=20.0)


def test_a_failure_of_the_library_that_reads_dxf_is_reported_with_its_cause(tmp_path, monkeypatch):
    def fail(path):
        raise struct.error("unpack_from requires a buffer")

    monkeypatch.setattr("ezdxf.filemanagement.readfile", fail)
    (tmp_path / "a.dxf").write_text("0")
    says = r"a.dxf: it is no DXF drawing that ezdxf reads \(error: unpack_from .*\): save it again"
    with pytest.raises(af.InvalidInput, match=says):
        read_drawing(tmp_path / "a.dxf")


def test_reading_a_drawing_leaves_the_limits_of_the_process_as_they_were(viaduct, tmp_path):
    before = resource.getrlimit(resource.RLIMIT_AS)
    read_drawing(dxf(tmp_path / "viaduct.dxf", viaduct))
    assert resource.getrlimit(resource.RLIMIT_AS) == before


@pytest.mark.parametrize("own", [None, 2**29])
def test_a_library_may_take_a_gigabyte_or_what_the_process_may(tmp_path, monkeypatch, own):
    limits = resource.getrlimit(resource.RLIMIT_AS)
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    found = []

    def read(path):
        found.append(resource.getrlimit(resource.RLIMIT_AS)[0])
        return ezdxf.new(units=6)

    monkeypatch.setattr("ezdxf.filemanagement.readfile", read)
    (tmp_path / "a.dxf").write_text("0")
    try:
        if own is not None:
            resource.setrlimit(resource.RLIMIT_AS, (taken + own, limits[1]))
        with pytest.raises(af.InvalidInput, match="no closed outlines"):
            read_drawing(tmp_path / "a.dxf")
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
    # what the test itself takes meanwhile is far less
    assert found == [pytest.approx(taken + (own or 2**30), abs=2**27)]


def test_lines_in_place_of_outlines_are_counted(tmp_path):
    drawing = ezdxf.new(units=6)
    for x in (0.0, 1.0):
        drawing.modelspace().add_line((x, 0.0), (x, 1.0))
    drawing.saveas(tmp_path / "lines.dxf")
    with pytest.raises(af.InvalidInput, match="no polylines, but 2 LINE: make a closed one"):
        af.read_outlines(tmp_path / "lines.dxf")


@pytest.mark.parametrize("hide", ["entity", "off", "frozen", "insert", "frozen insert"])
def test_outlines_that_a_dxf_hides_are_no_stones_but_counted(tmp_path, hide):
    drawing = ezdxf.new(units=6)
    for layer in ("ROCK", "WALL", "OLD", "SHEET"):
        drawing.layers.add(layer)
    space, block = drawing.modelspace(), drawing.blocks.new("OLDER")
    space.add_lwpolyline(square(0, -1), close=True, dxfattribs={"layer": "ROCK"})
    space.add_lwpolyline(square(0, 0), close=True, dxfattribs={"layer": "WALL"})
    target, flags = (block, {}) if "insert" in hide else (space, {"invisible": hide == "entity"})
    target.add_lwpolyline(square(0, 1), close=True, dxfattribs={"layer": "old", **flags})
    if target is block:
        invisible = {"invisible": int(hide == "insert")}
        space.add_blockref("OLDER", (0, 0), dxfattribs={"layer": "SHEET", **invisible})
    if hide == "off":
        drawing.layers.get("OLD").off()
    if hide == "frozen":
        drawing.layers.get("OLD").freeze()
    if hide == "frozen insert":
        drawing.layers.get("SHEET").freeze()
    drawing.saveas(tmp_path / "a.dxf")
    layers = {"ROCK": af.masonry.Layer(fixed=True), "WALL": af.masonry.Layer(role="pier")}
    survey = af.read_outlines(tmp_path / "a.dxf", layers=layers)
    layer = "SHEET" if "insert" in hide else "old"
    assert [block.name for block in survey.blocks] == ["ROCK 1", "WALL 1"]
    assert str(survey).endswith(f"ignored layers: '{layer} (hidden)' with 1 outlines")


def test_an_insert_on_a_layer_that_is_off_shows_its_parts_on_other_layers(tmp_path):
    drawing = ezdxf.new(units=6)
    drawing.layers.add("SHEET").off()
    block = drawing.blocks.new("WALLS")
    block.add_lwpolyline(square(0, 0), close=True, dxfattribs={"layer": "WALL"})
    block.add_lwpolyline(square(2, 0), close=True, dxfattribs={"layer": "0"})
    drawing.modelspace().add_blockref("WALLS", (0, 0), dxfattribs={"layer": "SHEET"})
    drawing.saveas(tmp_path / "a.dxf")
    ignored = Counter()
    assert [each.layer for each in read_drawing(tmp_path / "a.dxf", ignored=ignored)] == ["WALL"]
    assert ignored == {"SHEET (hidden)": 1}
    layers = {"WALL": af.masonry.Layer(), "SHEET": af.masonry.Layer()}
    with pytest.raises(af.InvalidInput, match=r"no outlines on layer 'SHEET'.*and 1 .*are hidden"):
        af.read_outlines(tmp_path / "a.dxf", layers=layers)


@pytest.mark.parametrize("unit", [None, "ft"])
def test_a_us_survey_foot_is_1200_3937_m(tmp_path, unit):
    """As a foot of 0.3048 m it would be 2e-6 shorter."""
    drawing = ezdxf.new(units=21)
    drawing.modelspace().add_lwpolyline(square(0, 0, 3.937), close=True)
    drawing.saveas(tmp_path / "a.dxf")
    (outline,) = read_drawing(tmp_path / "a.dxf", unit)
    assert outline.points.max() == pytest.approx(1.2, rel=1e-12 if unit is None else 3e-6)
    assert not outline.frame.stated


def test_a_layer_of_geojson_is_refused_where_a_part_is_missing(tmp_path):
    path = geojson(tmp_path / "a.geojson", {"a": square(0, 0)})
    path.write_text(path.read_text().replace('"name"', '"Layer": "POST", "name"'))
    with pytest.raises(af.InvalidInput, match=r"'layer', which is not read.*read are name, part"):
        read_drawing(path)
    path.write_text(path.read_text().replace('"name"', '"part": "post", "name"'))
    assert [each.layer for each in read_drawing(path)] == ["post"]


def test_the_unit_of_a_drawing_is_judged_before_its_open_ends(tmp_path):
    """In metres that are millimetres, ends 0.5 mm apart would be 0.5 m."""
    drawing = ezdxf.new(units=ezdxf.units.M)
    for k in range(3):
        corners = [(700.0 * x, 700.0 * y) for x, y in square(k, 0)]
        drawing.modelspace().add_lwpolyline([*corners, (corners[0][0] + 0.5, corners[0][1])])
    drawing.saveas(tmp_path / "a.dxf")
    with pytest.raises(af.InvalidInput, match=r"typically 990 m large.* 2.1 m by unit = \"mm\""):
        read_drawing(tmp_path / "a.dxf")
    drawing.units = ezdxf.units.MM
    drawing.saveas(tmp_path / "a.dxf")
    assert [outline.name for outline in read_drawing(tmp_path / "a.dxf")] == [
        *("layer 0, stone 1", "layer 0, stone 2", "layer 0, stone 3")
    ]


@pytest.mark.parametrize("kind", [pytest.param("dxf", marks=pytest.mark.slow), "geojson"])
def test_check_says_how_a_drawing_was_read(tmp_path, capsys, kind, undrawn):
    """Unit, the corner that snap moved by 3 mm, one outline that is ignored, least depth."""
    stones = {"ROCK": square(0, -1000, 1000), "WALL": square(0, 3, 1000), "NOTE": square(0, 9, 800)}
    if kind == "dxf":
        drawing = ezdxf.new(units=ezdxf.units.MM)
        for layer, points in stones.items():
            drawing.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": layer})
        drawing.saveas(tmp_path / "a.dxf")
    else:
        path = geojson(tmp_path / "a.geojson", stones)
        path.write_text(re.sub(r'"name": ("\w+")', r'"name": \1, "part": \1', path.read_text()))
    (tmp_path / "a.toml").write_text(
        f"""
[structure]
shape = "outlines"
file = "a.{kind}"
unit = "mm"
snap = "4 mm"

[structure.layers]
ROCK = {{ fixed = true }}
WALL = {{ role = "pier" }}
NOTE = {{ ignore = true }}

[model]
fidelity = "rigid"
"""
    )
    line = (
        "drawing: 1 × 2 m, read in mm, corners moved by up to 1.5 mm; ignored layers: "
        "'NOTE' with 1 outlines;\n  closed by snap: 1 joint, drawn open by more than 1 mm, 3 mm "
        "between "
    )
    assert af.commands.main(["run", str(tmp_path / "a.toml"), "--out", str(tmp_path / "out")]) == 0
    assert line in capsys.readouterr().out
    assert af.commands.main(["check", str(tmp_path / "a.toml")]) == 0
    said = capsys.readouterr().out
    assert line in said
    assert re.search(
        r"depth of joints: 1000 mm at least, at WALL, \w+ ?\d?; median 1000 mm", said
    ), said


def draw_named(path, stones, layer="NAMES"):
    """Write outlines of 1 m with their names as texts, and an axis."""
    drawing = ezdxf.new(units=ezdxf.units.MM)
    space = drawing.modelspace()
    for name, points in stones.items():
        space.add_lwpolyline(points, close=True, dxfattribs={"layer": "WALL"})
        if name:
            place = np.mean(points, axis=0) + np.array([0.0, 100.0])
            space.add_text(name, dxfattribs={"layer": layer, "insert": tuple(place)})
    space.add_line((0, 0), (0, 9000), dxfattribs={"layer": "AXES"})
    drawing.saveas(path)
    return path


def test_what_ignored_layers_hold_is_said(tmp_path):
    stones = {f"S{k}": square(0, 1000 * k, 1000) for k in range(3)}
    path = draw_named(tmp_path / "a.dxf", stones)
    ignore = af.masonry.Layer(ignore=True)
    layers = {"WALL": af.masonry.Layer(role="pier"), "AXES": ignore}
    said = str(af.read_outlines(path, layers=layers | {"NAMES": ignore}))
    assert said.endswith(
        "ignored layers: 'AXES' with 0 outlines, 1 LINE, 'NAMES' with 0 outlines, 3 TEXT, one text "
        "in each of 3 outlines: if it is the stone's name, leave the layer out of "
        "[structure.layers]"
    )
    survey = af.read_outlines(path, layers=layers)
    assert [block.name for block in survey.blocks] == [*stones]


def test_texts_are_names_by_the_advice_of_an_ignored_layer(tmp_path):
    """A line on their layer, and a stone with two texts, are in the way until they are moved."""
    stones = {f"S{k}": square(0, 1000 * k, 1000) for k in range(5)}
    path = draw_named(tmp_path / "a.dxf", stones)
    drawing = ezdxf.readfile(path)
    space = drawing.modelspace()
    line = space.add_line((0, 0), (0, 9), dxfattribs={"layer": "NAMES"})
    note = space.add_text("note", dxfattribs={"layer": "NAMES", "insert": (500, 700)})
    drawing.saveas(path)
    ignore = af.masonry.Layer(ignore=True)
    layers = {"WALL": af.masonry.Layer(role="pier"), "AXES": ignore}
    assert str(af.read_outlines(path, layers=layers | {"NAMES": ignore})).endswith(
        "one text in each of 4 outlines: if it is the stone's name, move the texts to a layer that "
        "is not in [structure.layers], and leave one text in 'WALL 1'"
    )
    for moved in (line, note):
        with pytest.raises(af.InvalidInput, match=r"has a LINE|has the texts"):
            af.read_outlines(path, layers=layers)
        moved.dxf.layer = "AXES"
        drawing.saveas(path)
    found = af.read_outlines(path, layers=layers)
    assert [block.name for block in found.blocks] == [*stones]


@pytest.mark.parametrize(
    ("unit", "point", "said"),
    [
        ("mm", (1002.7804, 1051.2196), "(1002780, 1051220) mm"),
        ("cm", (1002.7804, 1051.2196), "(100278, 105122) cm"),
        ("m", (451002.7804, 5.25), "(451002.78, 5.25) m"),
        ("m", (0.5, 0.123456), "(0.5, 0.123456) m"),
        ("mm", (0.00025, 0.0), "(0.25, 0) mm"),
    ],
)
def test_places_are_said_to_a_millimetre(unit, point, said):
    """The last digit is a millimetre or less, far from the origin too."""
    frame = drawings.Frame({"mm": 1e-3, "cm": 1e-2, "m": 1.0}[unit], unit)
    assert frame.place(point) == said


def test_stones_drawn_twice_and_crossed_outlines_keep_their_names(tmp_path):
    """A pier around its stones overlaps them; a name is within the hull of a crossed outline."""
    stones = {f"S{k}": square(0, 1000 * k, 1000) for k in range(3)}
    whole = [(0, 0), (1000, 0), (1000, 3000), (0, 3000)]
    path = draw_named(tmp_path / "a.dxf", stones | {"": whole})
    layers = {"WALL": af.masonry.Layer(role="pier"), "AXES": af.masonry.Layer(ignore=True)}
    with pytest.raises(af.InvalidStructure, match=r"'S\d' and 'WALL 4' overlap|'WALL 4' and 'S\d'"):
        af.read_outlines(path, layers=layers)
    stones["S2"] = [(0, 2000), (1000, 3000), (1000, 2000), (0, 3000)]
    with pytest.raises(af.InvalidStructure, match="outline of 'S2' crosses"):
        af.read_outlines(draw_named(path, stones), layers=layers)


def test_a_stone_on_an_ignored_layer_is_a_doubt(tmp_path, capsys):
    """A filling between two posts and a lintel; a frame, and notes in and off stones, are none."""

    def box(left, low, right, high):
        return [(left, low), (right, low), (right, high), (left, high)]

    posts = [box(0, 0, 400, 1000), box(800, 0, 1200, 1000)]
    layers = {"ROCK": [box(0, -500, 1200, 0)], "POST": posts, "LINTEL": [box(0, 1000, 1200, 1300)]}
    layers["NOTE"] = [box(401, 1, 799, 999)]
    layers["FRAME"] = [
        box(-900, -900, 2000, 2000),
        box(100, 100, 300, 300),
        box(1210, 0, 1600, 900),
    ]
    drawing = ezdxf.new(units=ezdxf.units.MM)
    for layer, boxes in layers.items():
        for points in boxes:
            drawing.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": layer})
    drawing.saveas(tmp_path / "a.dxf")
    (tmp_path / "a.toml").write_text(
        """
[structure]
shape = "outlines"
file = "a.dxf"

[structure.layers]
ROCK = { fixed = true }
POST = { role = "pier" }
LINTEL = { role = "ring" }
NOTE = { ignore = true }
FRAME = { ignore = true }

[model]
fidelity = "rigid"
"""
    )
    assert af.commands.main(["check", str(tmp_path / "a.toml")]) == 3
    said = capsys.readouterr().out
    assert said.count("in doubt: ignored layer ") == 1
    assert (
        "ignored layer 'NOTE' has a closed outline at (600, 500) mm that touches stones along "
        "100% of its sides, as a stone does, and is left out; if it is a stone, draw it on the "
    ) in said


def test_median_depths_are_by_part():
    """A pier is twice as deep as the ring: one median would be of neither."""
    portal = af.arch_on_piers(
        radius=1.5, thickness=0.35, voussoirs=9, pier_breadth=0.7, courses=[0.5]
    )
    (depths, *_) = describe_depths(portal).splitlines()
    assert depths.endswith("median 700 mm of 'left pier', 350 mm of 'arch', 700 mm of 'right pier'")
    ring = af.circular_arch(radius=1.0, thickness=0.2, embrace=150.0, voussoirs=7)
    assert describe_depths(ring).splitlines()[0].endswith("; median 200 mm")


def test_a_small_drawing_needs_its_unit_in_the_case(tmp_path):
    """Centimetres in a file that says millimetres; a model in a laboratory may be as small."""

    def shrink(stones):
        stones.update({name: 0.1 * points for name, points in stones.items()})

    case = draw_portal(tmp_path, change=shrink)
    with pytest.raises(af.InvalidInput, match=r'typically 0\.0\d+ m large.*, 5 m by unit = "cm"'):
        af.Case.read(case)
    small, large = (
        af.Case.read(case, [f"structure.unit={unit}", f"structure.snap={snap} mm"]).structure.size
        for unit, snap in (("mm", 0.4), ("cm", 4.0))
    )
    assert large == pytest.approx(10.0 * small, rel=1e-3)


def test_words_that_several_stones_have_in_them_are_no_names(tmp_path):
    drawing = ezdxf.new(units=ezdxf.units.M)
    space = drawing.modelspace()
    for k, name in enumerate(["sill", "granite"]):
        space.add_lwpolyline(square(k, 0), close=True, dxfattribs={"layer": "STONE"})
        for y, words in ((0.3, name), (0.6, "granite")):
            space.add_text(words, dxfattribs={"insert": (k + 0.5, y), "height": 0.05})
    drawing.saveas(path := tmp_path / "notes.dxf")
    assert [outline.name for outline in read_drawing(path)] == ["sill", "STONE 2"]


def test_a_vertex_that_is_drawn_twice_is_one(tmp_path):
    def repeat(stones):
        corners = stones["RING 4"]
        stones["RING 4"] = np.array([*corners[[0, 0, 1, 2, 2, 3, 0]]])

    repeated = af.Case.read(draw_portal(tmp_path, change=repeat)).structure
    (block,) = (block for block in repeated.blocks if block.name == "RING 4")
    assert len(block.points) == 4
    assert repeated.fingerprint == af.Case.read(draw_portal(tmp_path)).structure.fingerprint


def test_stones_on_a_sheet_are_not_in_model_space(tmp_path):
    drawing = ezdxf.new(units=ezdxf.units.M)
    drawing.paperspace().add_lwpolyline(square(0, 0), close=True)
    drawing.saveas(path := tmp_path / "sheet.dxf")
    with pytest.raises(af.InvalidInput, match="draw them in model space, not on a sheet"):
        read_drawing(path)


@pytest.mark.parametrize("layer", ["RIGN", "Ring"])
def test_a_misspelt_layer_is_the_one_it_is_like(tmp_path, layer):
    case = draw_portal(tmp_path, {"RING 4": layer})
    words = rf"of layer '{layer}' \(closed outlines: 1, .*\) nothing is said: did you mean 'RING'\?"
    with pytest.raises(af.InvalidInput, match=words):
        af.Case.read(case)


def test_a_misspelt_layer_of_the_case_is_the_one_to_correct(tmp_path):
    """The drawing has RING, and no stone on RNIG."""
    case = draw_portal(tmp_path)
    case.write_text(case.read_text().replace("RING = ", "RNIG = "))
    words = (
        r"of layer 'RING' .* nothing is said: for 'RNIG' of \[structure.layers\], did you mean 'R"
    )
    with pytest.raises(af.InvalidInput, match=words):
        af.Case.read(case)


def test_a_unit_of_the_case_that_contradicts_the_drawing_is_said(tmp_path, caplog):
    """Before a gap, which it may have made; and where the drawing is read nevertheless."""
    contradiction = "contradicts the drawing, in mm by its \\$INSUNITS. "
    case = draw_portal(tmp_path)
    for unit, warnings in (("mm", 0), ("cm", 1)):
        caplog.clear()
        af.Case.read(case, [f"structure.unit={unit}", "structure.snap=40 mm"][: 1 + warnings])
        found = [record.getMessage() for record in caplog.records]
        assert len(found) == warnings
    assert re.search(f"unit = 'cm' {contradiction}By it that is 50 × ", found[0])
    with pytest.raises(
        af.InvalidStructure, match=f"dxf: unit = 'cm' {contradiction}By unit = .* or else"
    ):
        af.Case.read(case, ["structure.unit=cm"])


def test_a_unit_that_an_impossible_header_demands_is_used_without_a_warning(tmp_path, caplog):
    """Of a drawing in mm whose header says m: without a unit it is refused."""
    case = draw_portal(tmp_path)
    drawing = ezdxf.readfile(tmp_path / "portal.dxf")
    drawing.units = ezdxf.units.M
    drawing.saveas(tmp_path / "portal.dxf")
    with pytest.raises(af.InvalidInput, match='by unit = "mm"'):
        af.Case.read(case)
    assert af.Case.read(case, ["structure.unit=mm"]).structure.blocks
    assert not caplog.records


def test_a_law_among_the_names_of_laws_of_a_structure_is_sent_to_its_place(tmp_path):
    change = 'structure.contacts."stone to stone".finish=dressed'
    with pytest.raises(af.InvalidInput, match=r'law under \[contacts\."stone to stone"\], at'):
        af.Case.read(draw_portal(tmp_path), [change])
