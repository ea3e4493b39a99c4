"""Surveys as structures: corners, materials, layers and roles of drawn outlines, and cases."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import shapely
from drawn import assert_same, draw_portal, dxf, geojson, square

import archfem as af
from archfem.cases.structure_keys import read_survey
from archfem.cases.structure_text import describe_supports
from archfem.commands import main

SHIPPED = Path(__file__).parents[2] / "meshes" / "survey.toml"


def test_round_trip_through_geojson(viaduct, drawing):
    found = af.masonry.surveyed(drawing, width=4.0)
    assert_same(found, viaduct, 1e-9)
    assert af.read_outlines(drawing).moved < 1e-12
    assert found.weight == pytest.approx(viaduct.weight, rel=1e-12)
    assert [(b.material, b.fixed, b.part) for b in found.blocks] == [
        (b.material, b.fixed, b.part) for b in viaduct.blocks
    ]


@pytest.mark.slow
def test_shipped_survey_bears_as_the_viaduct_does(viaduct, verified):
    """The survey is off by up to 1.2 mm, so a line of thrust by as much of 450 mm: 0.003 h."""
    case = af.Case.read(SHIPPED)
    assert case.structure.width == viaduct.width
    assert_same(case.structure, viaduct, 2e-3)
    mine = {}
    for key, structure in (("survey", case.structure), ("viaduct", viaduct)):
        joints = af.dead_load(af.build(structure, fidelity="full", cells=(1, 1))).joints
        judged = [n for n, each in enumerate(structure.joints) if each.role != "other"]
        names = [structure.joints[n].name for n in judged]
        order = [judged[k] for k in np.argsort(names)]
        mine[key] = {name: joints[name].values[order] for name in ("N", "V", "eccentricity")}
    survey, exact = mine["survey"], mine["viaduct"]
    assert len(exact["N"]) == 28 + 6
    assert survey["eccentricity"] == pytest.approx(exact["eccentricity"], abs=3e-3)
    assert survey["N"] == pytest.approx(exact["N"], rel=3e-3)
    assert survey["V"] == pytest.approx(exact["V"], abs=3e-3 * exact["N"].max())
    off = np.abs(survey["eccentricity"] - exact["eccentricity"]).max()
    case = "survey rounded to 1 mm: e of its joints under dead load"
    verified(case, "equal", "the viaduct it was drawn from", "equal", difference=off)


def test_four_sided_stones_are_meshed_from_side_to_side(viaduct, drawing):
    for mine, given in zip(af.read_outlines(drawing).blocks, viaduct.blocks, strict=True):
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
    blocks = {block.name: block.corners for block in af.read_outlines(path).blocks}
    assert blocks["extra vertex"] == (0, 2, 3, 5)
    assert blocks["upright"] == (1, 2, 3, 0)
    assert blocks["five"] is None
    assert blocks["notched"] is None


def test_material_and_layer_of_a_feature(tmp_path):
    outlines = {"rock": square(0, -1), "soil": square(0, 0)}
    path = geojson(tmp_path / "x.geojson", outlines, part="fill", surveyor="A. N. Other")
    layers = {"fill": af.masonry.Layer(part="backfill", material="backfill")}
    rock, soil = af.read_outlines(path, layers=layers).blocks
    assert (rock.fixed, soil.fixed) == (True, False)
    assert (soil.part, soil.material) == ("backfill", af.masonry.BACKFILL)
    assert af.read_outlines(path).blocks[0].material == af.STONE
    own = geojson(tmp_path / "y.geojson", outlines, part="fill", material="stone")
    assert af.read_outlines(own, layers=layers).blocks[1].material == af.STONE


def test_layers_must_be_those_of_the_file(tmp_path, stack):
    path = dxf(tmp_path / "stack.dxf", stack)
    with pytest.raises(
        af.errors.InvalidInput, match=r"'column-fixed' \(.*\) nothing is said: name"
    ):
        af.read_outlines(path, layers={"column": af.masonry.Layer()})
    layers = {"column": af.masonry.Layer(), "column-fixed": af.masonry.Layer(ignore=True)}
    assert len(af.read_outlines(path, layers=layers).blocks) == 2
    with pytest.raises(
        af.errors.InvalidInput, match=r"no outlines on layer 'colum': its layers are \['col"
    ):
        af.read_outlines(path, layers=layers | {"colum": af.masonry.Layer()})
    with pytest.raises(af.errors.InvalidStructure, match=r"snap \[m\] = 0\.0 is not above 0"):
        af.read_outlines(path, snap=0.0)


PIERS = """
"west pier" = { x = ["-2 m", "0 m"], y = ["-1.35 m", "0 m"], role = "pier" }
"east pier" = { x = ["0 m", "2 m"], y = ["-1.35 m", "0 m"], role = "pier" }
"""


def one_layer(folder, piers=PIERS, ground="-1.35 m"):
    """Write the case of a portal whose stones are on the layer of its ring, over a given level."""
    folder.mkdir()
    courses = [f"{side} {k}" for side in ("WEST", "EAST") for k in (1, 2, 3)]
    path = draw_portal(folder, dict.fromkeys(courses, "RING"))
    text = re.sub(r"(WEST|EAST) = .*\n", "", path.read_text()).replace("[model]", f"{piers}[model]")
    text = text.replace('part = "slab", fixed = true', "ignore = true")
    path.write_text(text.replace("[structure.l", f'ground = "{ground}"\n[structure.l'))
    return path


def test_stones_of_one_layer_have_parts_by_place_and_ground_by_its_level(tmp_path):
    """As the same stones on layers of their own, on a slab that is drawn."""
    layered, placed = (
        af.Case.read(path).structure
        for path in (draw_portal(tmp_path), one_layer(tmp_path / "one"))
    )
    parts = [[(b.part, b.role) for b in each.blocks if not b.fixed] for each in (layered, placed)]
    assert parts[0] == parts[1]
    (ground,) = (block for block in placed.blocks if block.fixed)
    assert (ground.name, ground.points[:, 1].max()) == ("ground", pytest.approx(-1.35, abs=4e-3))
    assert np.ptp(ground.points[:, 0]) == pytest.approx(2.0 * 3.65, abs=0.05)  # of 3.65 m drawn
    pushes = [af.collapse_factor(each, live=af.BodyForce(1.0)).factor for each in (layered, placed)]
    assert pushes[1] == pytest.approx(pushes[0], abs=1e-4)  # feet are 1.5 mm off the level [g]


@pytest.mark.parametrize(
    ("piers", "words"),
    [
        (
            PIERS.replace("-2 m", "2 m"),
            r"no stones within x and y .* of 'west pier': by unit = 'mm' they lie within x = "
            r"\[-1\.8\d*, 1\.8\d*\], y = \[-1\.3\d*, 1\.\d*\] m; correct the limits, or the unit",
        ),
        (
            PIERS.replace('"0 m", "2 m"', '"-2 m", "2 m"'),
            "within x and y of 'west pier', 'east pier': let",
        ),
        (PIERS.replace('["-2 m", "0 m"]', '["-2 m"]'), r"limits of x or y .* give \(a, b\)"),
    ],
)
def test_limits_of_parts_must_hold_stones_and_be_apart(tmp_path, piers, words):
    with pytest.raises(af.InvalidInput, match=words):
        af.Case.read(one_layer(tmp_path / "one", piers))


def test_the_size_in_a_question_on_the_unit_is_that_of_the_drawing_without_its_ground(tmp_path):
    text = (path := one_layer(tmp_path / "one")).read_text()
    path.write_text(re.sub("snap = .*", 'snap = "0.1 mm"', text))
    with pytest.raises(af.InvalidStructure, match=r"the drawing is 3\.6\d × "):
        af.Case.read(path)


def test_stacks_of_one_pier_that_stand_apart_are_counted(tmp_path):
    """As where limits of one pier are so wide that they hold the stones of both."""
    wide = PIERS.splitlines()[1].replace('"0 m"]', '"2 m"]', 1) + "\n"
    both = ((PIERS, "3 of 'west pier', 11 of"), (wide, "6 of 'west pier' in 2 stacks apart, "))
    for number, (piers, said) in enumerate(both):
        case = af.Case.read(one_layer(tmp_path / str(number), piers))
        assert said in (text := describe_supports(case.structure))
    free = [block for block in case.structure.blocks if not block.fixed]
    loads = [shapely.Polygon(block.drawn()).area * block.material.unit_weight for block in free]
    assert text.startswith(f"blocks that move, {case.structure.width * sum(loads) / 1e3:.4g} kN in")


def test_outlines_by_place_can_be_left_out(tmp_path):
    left_out = PIERS + 'keystone = { x = ["-0.1 m", "0.1 m"], y = ["1 m", "2 m"], ignore = true }\n'
    path = one_layer(tmp_path / "one", left_out)
    survey = read_survey(tomllib.loads(path.read_text()), path.parent)
    assert (len(survey.blocks), survey.ignored["keystone"]) == (17, 1)


PAD = {"pad": {"normal_stiffness": 1e9, "shear_stiffness": 1e8}}
RUBBER = {"rubber": {"young": 1e8, "poisson": 0.4, "unit_weight": 12e3}}
ON_PADS = {"contacts": PAD, "materials": RUBBER}


def case(tmp_path, properties=ON_PADS, **structure):
    given = {"shape": "outlines", "file": "x.geojson"} | structure
    return af.Case.of({"structure": given, **properties}, tmp_path)


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
    with pytest.raises(af.errors.InvalidInput, match='give one for "rubber/stone"'):
        case(tmp_path, **given)
    with pytest.raises(
        af.errors.InvalidInput, match=r"unknown key 'structure.layers.pier.fix': did you mea"
    ):
        case(tmp_path, layers={"pier": {"fix": True}})
    with pytest.raises(af.errors.InvalidInput, match="'bad' is not among the contacts"):
        case(tmp_path, **given, contacts={"rubber/stone": "bad"})
    with pytest.raises(af.errors.InvalidInput, match="has no file: name the drawing"):
        af.Case.of({"structure": {"shape": "outlines"}})


def test_soil_meets_stone_as_the_preset_says(tmp_path):
    outlines = {"rock": square(0, -1), "soil": square(0, 0), "more": square(0, 1)}
    path = geojson(tmp_path / "x.geojson", outlines, material="backfill")
    table = json.loads(path.read_text())
    table["features"][0]["properties"]["material"] = "stone"
    path.write_text(json.dumps(table))
    for joints in (case(tmp_path, {}).structure.joints, af.masonry.surveyed(path).joints):
        assert [joint.contact for joint in joints] == [
            af.masonry.SOIL_TO_STONE,
            af.masonry.STONE_TO_STONE,
        ]


@pytest.mark.slow
def test_check_command(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # which has the picture of the failed check
    changes = ["--set", "model.fidelity=rigid"]
    assert main(["check", str(SHIPPED), *changes]) == 3  # in doubt: its soil is not rigid
    assert "51 blocks, 89 joints" in capsys.readouterr().out
    assert main(["check", str(SHIPPED), *changes, "--set", "structure.snap=1 mm"]) == 1
    assert "or raise snap from 0.001 to 0.002 m" in capsys.readouterr().err
    (picture,) = tmp_path.glob("*_drawing.png")
    faulty = picture.read_bytes()
    assert main(["check", str(SHIPPED), *changes]) == 3
    assert f"wrote {picture.name} anew" in capsys.readouterr().out
    assert picture.read_bytes() != faulty


@pytest.mark.parametrize(
    ("turn", "bend", "four"),
    [(44.0, 0.0, False), (46.0, 0.0, True), (90, 9.0, True), (90, 11.0, False)],
)
def test_corners_turn_by_45_degrees_and_other_vertices_by_less_than_ten(tmp_path, turn, bend, four):
    """A rhombus of that turn at two of its vertices, one of whose sides bends in its middle."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    off = 0.5 * np.tan(np.radians(bend / 2.0))
    outline = [[0, 0], [1, 0], [1 + c, s], [c, s]]
    outline = [outline[0], [0.5, -off], *outline[1:]] if bend else outline
    path = geojson(tmp_path / "any.geojson", {"a": outline})
    (block,) = af.read_outlines(path).blocks
    assert (block.corners is not None) is four
