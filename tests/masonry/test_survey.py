"""Surveyed outlines: read, made to touch, named; and what is refused."""

import json
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely

import archfem as af
from archfem.cases.case import Case
from archfem.cases.cli import main
from archfem.errors import InvalidInput, InvalidStructure
from archfem.masonry.materials import BACKFILL, SOIL_TO_STONE, STONE, STONE_TO_STONE
from archfem.masonry.shapes import Arch, Backfill, Pier, Sidewall, bridge
from archfem.masonry.survey.survey import Layer, read_outlines, surveyed, write_outlines

SHIPPED = Path(__file__).parents[2] / "meshes" / "survey.toml"


@pytest.fixture(scope="module")
def viaduct():
    """The viaduct from which the shipped survey was made."""
    ring = {"span": 4.0, "rise": 1.6, "thickness": 0.45, "voussoirs": 13}
    wall = {"length": 1.5, "height": 2.4, "above": 0.8}
    return bridge(
        arches=[Arch(name="west arch", **ring), Arch(name="east arch", **ring)],
        piers=[Pier(name="pier", gap=0.9, height=2.4)],
        sidewalls=[Sidewall(name="west sidewall", **wall), Sidewall(name="east sidewall", **wall)],
        backfill=Backfill(cover=0.5),
        width=4.0,
    )


@pytest.fixture(scope="module")
def drawing(viaduct, tmp_path_factory):
    """The viaduct as GeoJSON."""
    path = tmp_path_factory.mktemp("survey") / "viaduct.geojson"
    write_outlines(viaduct, path)
    return path


def square(x, y, size=1.0):
    return [[x, y], [x + size, y], [x + size, y + size], [x, y + size]]


def geojson(path, outlines, **more):
    """Write outlines: name, points and further properties of each."""
    features = [
        {
            "type": "Feature",
            "properties": {"name": name, "fixed": k == 0} | more,
            "geometry": {"type": "Polygon", "coordinates": [[*points, points[0]]]},
        }
        for k, (name, points) in enumerate(outlines.items())
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def dxf(path, structure, factor=1.0, units=6):
    """Write a structure's blocks on layers by part, and their names as texts."""
    drawing = ezdxf.new()
    drawing.units = units
    space = drawing.modelspace()
    for block in structure.blocks:
        layer = f"{block.part}-fixed" if block.fixed else block.part
        points = factor * block.points
        space.add_lwpolyline(points, close=True, dxfattribs={"layer": layer})
        at = shapely.Polygon(points).representative_point().coords[0]
        space.add_text(block.name, dxfattribs={"insert": at, "layer": "TEXT"})
    drawing.saveas(path)
    return path


def layers_of(structure):
    found = {}
    for block in structure.blocks:
        name = f"{block.part}-fixed" if block.fixed else block.part
        found[name] = Layer(part=block.part, material=block.material.name, fixed=block.fixed)
    return found


def assert_same(found, given, tolerance):
    """All joints of rings and piers by name, all others by their blocks, with the same ends."""
    assert [block.name for block in found.blocks] == [block.name for block in given.blocks]
    assert len(found.joints) == len(given.joints)
    named = {joint.name: joint for joint in found.joints}
    for joint in given.joints:
        if joint.role == "other":
            others = [each for each in found.joints if set(each.blocks) == set(joint.blocks)]
            away = [np.abs(each.ends - joint.ends).max() for each in others]
            mine = others[int(np.argmin(away))]
        else:
            mine = named[joint.name]
        assert set(mine.blocks) == set(joint.blocks)
        assert mine.ends == pytest.approx(joint.ends, abs=tolerance)
        assert (mine.part, mine.role) == (joint.part, joint.role)
        assert mine.contact == joint.contact


def test_round_trip_through_geojson(viaduct, drawing):
    found = surveyed(drawing, width=4.0)
    assert_same(found, viaduct, 1e-9)
    assert read_outlines(drawing).moved < 1e-12
    assert found.weight == pytest.approx(viaduct.weight, rel=1e-12)
    assert [(b.material, b.fixed, b.part) for b in found.blocks] == [
        (b.material, b.fixed, b.part) for b in viaduct.blocks
    ]


@pytest.mark.parametrize(
    ("units", "factor", "unit"),
    [(6, 1.0, None), (4, 1e3, None), (5, 1e2, None), (0, 1e3, "mm"), (1, 1e2, "cm")],
    ids=["m", "mm", "cm", "given", "given against the file"],
)
def test_round_trip_through_dxf(viaduct, tmp_path, units, factor, unit):
    path = dxf(tmp_path / "viaduct.dxf", viaduct, factor, units)
    layers = layers_of(viaduct)
    assert_same(surveyed(path, layers=layers, unit=unit, width=4.0), viaduct, 1e-6)


def test_round_trip_through_2d_polylines_drawn_clockwise(tmp_path):
    """Old-style polylines, mirrored by their extrusion, in a drawing that names nothing."""
    drawing = ezdxf.new()
    for x, y, layer in ((0.0, -1.0, "rock"), (0.0, 0.0, "pier"), (0.0, 1.0, "pier")):
        points = [(-px, py) for px, py in reversed(square(x, y))]
        attributes = {"layer": layer, "extrusion": (0, 0, -1)}
        drawing.modelspace().add_polyline2d(points, close=True, dxfattribs=attributes)
    drawing.saveas(tmp_path / "pier.dxf")
    layers = {"rock": Layer(fixed=True), "pier": Layer()}
    found = surveyed(tmp_path / "pier.dxf", layers=layers)
    assert [block.name for block in found.blocks] == ["rock 1", "pier 1", "pier 2"]
    assert [joint.name for joint in found.joints] == ["pier, base", "pier, joint 1"]
    assert found.blocks[1].centroid == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize(("error", "snap"), [(0.5e-3, 2e-3), (2e-3, 8e-3), (8e-3, 0.03)])
@pytest.mark.parametrize("seed", [0, 1, 2])
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
    assert_same(surveyed(path, snap=snap, width=4.0), viaduct, 2.0 * error)
    assert 0.5 * error < read_outlines(path, snap=snap).moved < snap


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
    found = surveyed(path, snap=2e-3)
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


def test_shipped_survey_bears_as_the_viaduct_does(viaduct):
    """The survey is off by up to 1.2 mm, so a line of thrust by as much of 450 mm: 0.003 h."""
    case = Case.read(SHIPPED)
    assert case.structure.width == viaduct.width
    assert_same(case.structure, viaduct, 2e-3)
    mine = {}
    for key, structure in (("survey", case.structure), ("viaduct", viaduct)):
        joints = af.dead_load(af.build(structure, fidelity="full", cells=(2, 2))).joints
        judged = [n for n, each in enumerate(structure.joints) if each.role != "other"]
        names = [structure.joints[n].name for n in judged]
        order = [judged[k] for k in np.argsort(names)]
        mine[key] = {name: joints[name].values[order] for name in ("N", "V", "eccentricity")}
    survey, exact = mine["survey"], mine["viaduct"]
    assert len(exact["N"]) == 28 + 6
    assert survey["eccentricity"] == pytest.approx(exact["eccentricity"], abs=3e-3)
    assert survey["N"] == pytest.approx(exact["N"], rel=3e-3)
    assert survey["V"] == pytest.approx(exact["V"], abs=3e-3 * exact["N"].max())


def test_four_sided_stones_are_meshed_from_side_to_side(viaduct, drawing):
    for mine, given in zip(read_outlines(drawing).blocks, viaduct.blocks, strict=True):
        if given.role != "other" and given.corners is not None:
            first = mine.points[list(mine.corners)]
            assert {tuple(p) for p in first[:2]} == {
                tuple(p) for p in given.points[list(given.corners)][:2]
            } or given.part == "pier"
        if given.name.endswith("skewback") or given.name == "backfill":
            assert mine.corners is None


def test_corners_of_odd_stones(tmp_path):
    path = geojson(
        tmp_path / "odd.geojson",
        {
            "extra vertex": [[0, 0], [2, 0], [4, 0.01], [4, 1], [2, 1], [0, 1]],
            "upright": [[0, 1], [1, 1], [1, 4], [0, 4]],
            "five": [[1, 1], [2, 1], [2, 3], [1.6, 3.5], [1, 2]],
            "notched": [[2, 1], [4, 1], [4, 3], [3, 3], [3, 2], [2, 2]],
        },
    )
    blocks = {block.name: block.corners for block in read_outlines(path).blocks}
    assert blocks["extra vertex"] == (0, 2, 3, 5)
    assert blocks["upright"] == (1, 2, 3, 0)
    assert blocks["five"] is None
    assert blocks["notched"] is None


def test_material_and_layer_of_a_feature(tmp_path):
    outlines = {"rock": square(0, -1), "soil": square(0, 0)}
    path = geojson(tmp_path / "x.geojson", outlines, part="fill", surveyor="A. N. Other")
    layers = {"fill": Layer(part="backfill", material="backfill")}
    rock, soil = read_outlines(path, layers=layers).blocks
    assert (rock.fixed, soil.fixed) == (True, False)
    assert (soil.part, soil.material) == ("backfill", BACKFILL)
    assert read_outlines(path).blocks[0].material == STONE
    own = geojson(tmp_path / "y.geojson", outlines, part="fill", material="stone")
    assert read_outlines(own, layers=layers).blocks[1].material == STONE


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
    with pytest.raises(InvalidStructure, match=says):
        surveyed(path)


def test_gaps_that_are_meant_are_left(tmp_path):
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
    names = [joint.name for joint in surveyed(path).joints]
    assert names == ["rock to a", "rock to b", "rock to c"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"geometry": {"type": "MultiPolygon", "coordinates": [[square(0, 0)]]}}, "a MultiPolygon"),
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
    with pytest.raises(InvalidInput, match=says):
        read_outlines(path)


def test_wrong_units(tmp_path):
    big = {"rock": square(0, -400, 400), "a": square(0, 0, 400)}
    path = geojson(tmp_path / "mm.geojson", big)
    with pytest.raises(InvalidInput, match=r"typically 566 m large: .* unit = \"mm\""):
        read_outlines(path)
    assert read_outlines(path, unit="mm", snap=1e-4).blocks[0].area == pytest.approx(0.16)
    with pytest.raises(InvalidInput, match="unit = '1 stone' is not in a unit like m"):
        read_outlines(path, unit="stone")
    degrees = {"a": square(31.2, 40.9, 5e-6), "b": square(31.2, 40.9 + 5e-6, 5e-6)}
    with pytest.raises(InvalidInput, match=r"degrees \(CRS84\) do not do: export projected metres"):
        read_outlines(geojson(tmp_path / "deg.geojson", degrees))


def test_files_that_are_no_drawings(tmp_path):
    for name, text, says in (
        ("a.shp", "", "is no drawing: give a .geojson or a .dxf"),
        ("a.geojson", "{", "it is not JSON"),
        ("b.geojson", "[]", "no GeoJSON FeatureCollection"),
        ("d.geojson", '{"features": [3]}', "feature 1 is not as GeoJSON has it"),
        ("c.geojson", '{"type": "FeatureCollection", "features": []}', "no closed outlines"),
        ("a.dxf", "nonsense", "it is not DXF"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(InvalidInput, match=says):
            read_outlines(tmp_path / name)
    with pytest.raises(InvalidInput, match="there is no drawing"):
        read_outlines(tmp_path / "none.dxf")


@pytest.mark.parametrize(
    ("draw", "says"),
    [
        (lambda s: s.add_lwpolyline(square(2, 0)), r"at \(2, 0\) on layer '0' is not closed"),
        (lambda s: s.add_line((0, 0), (1, 1)), "layer '0' has a LINE beside its polylines"),
        (
            lambda s: s.add_lwpolyline([(2, 0, 0.3), (3, 0, 0), (3, 1, 0)], "xyb", close=True),
            "has arcs, and joints are straight",
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
    drawing = ezdxf.new()
    drawing.modelspace().add_lwpolyline(square(0, 0), close=True)
    draw(drawing.modelspace())
    drawing.saveas(tmp_path / "bad.dxf")
    with pytest.raises(InvalidInput, match=says):
        read_outlines(tmp_path / "bad.dxf")


def test_dxf_without_a_unit(tmp_path, stack):
    path = dxf(tmp_path / "none.dxf", stack, units=0)
    with pytest.raises(InvalidInput, match=r"does not say its unit \(\$INSUNITS\)"):
        read_outlines(path)


def test_layers_must_be_told_rightly(tmp_path, stack):
    path = dxf(tmp_path / "stack.dxf", stack)
    with pytest.raises(InvalidInput, match="of layer 'column-fixed' nothing is said"):
        read_outlines(path, layers={"column": Layer()})
    told = {"column": Layer(), "column-fixed": Layer(ignore=True)}
    assert len(read_outlines(path, layers=told).blocks) == 2
    with pytest.raises(InvalidInput, match=r"no outlines on layer 'colum': its layers are \['col"):
        read_outlines(path, layers=told | {"colum": Layer()})
    with pytest.raises(InvalidStructure, match=r"snap 0\.0 m is not above 0"):
        read_outlines(path, snap=0.0)


def case(tmp_path, **structure):
    given = {"shape": "outlines", "file": "x.geojson"} | structure
    return Case.of({"structure": given, "contacts": {"pad": PAD}, "materials": RUBBER}, tmp_path)


PAD = {"normal_stiffness": 1e9, "shear_stiffness": 1e8}
RUBBER = {"rubber": {"young": 1e8, "poisson": 0.4, "unit_weight": 12e3}}


def test_case_of_a_survey(tmp_path):
    outlines = {"rock": square(0, -100, 100), "pad": square(0, 0, 100), "top": square(0, 100, 100)}
    path = geojson(tmp_path / "x.geojson", outlines, part="pier")
    table = json.loads(path.read_text())
    table["features"][1]["properties"]["material"] = "rubber"
    path.write_text(json.dumps(table))
    given = {"unit": "cm", "snap": "5 mm", "layers": {"pier": {"part": "north pier"}}}
    found = case(tmp_path, **given, contacts={"rubber/stone": "pad"}, width="2 m").structure
    assert (found.name, found.width, found.blocks[1].area) == ("x", 2.0, pytest.approx(1.0))
    assert [joint.name for joint in found.joints] == ["north pier, base", "north pier, joint 1"]
    assert {joint.contact.name for joint in found.joints} == {"pad"}
    with pytest.raises(InvalidInput, match='give one for "rubber/stone"'):
        case(tmp_path, **given)
    with pytest.raises(InvalidInput, match=r"unknown key 'structure.layers.pier.fix': did you mea"):
        case(tmp_path, layers={"pier": {"fix": True}})
    with pytest.raises(InvalidInput, match="'bad' is not among the contacts"):
        case(tmp_path, **given, contacts={"rubber/stone": "bad"})
    with pytest.raises(InvalidInput, match="has no file: name the drawing"):
        Case.of({"structure": {"shape": "outlines"}})


def test_soil_meets_stone_as_the_preset_says(tmp_path):
    outlines = {"rock": square(0, -1), "soil": square(0, 0), "more": square(0, 1)}
    path = geojson(tmp_path / "x.geojson", outlines, material="backfill")
    table = json.loads(path.read_text())
    table["features"][0]["properties"]["material"] = "stone"
    path.write_text(json.dumps(table))
    for joints in (case(tmp_path).structure.joints, surveyed(path).joints):
        assert [joint.contact for joint in joints] == [SOIL_TO_STONE, STONE_TO_STONE]


def test_check_command(capsys):
    changes = ["--set", "model.fidelity=rigid"]
    assert main(["check", str(SHIPPED), *changes]) == 0
    assert "51 blocks, 89 joints" in capsys.readouterr().out
    assert main(["check", str(SHIPPED), *changes, "--set", "structure.snap=1 mm"]) == 1
    assert "raise snap if the survey is rougher" in capsys.readouterr().err
