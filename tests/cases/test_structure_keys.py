"""Structures, fills and construction stages of case files."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

import archfem as af
from archfem._validation import declared_keys
from archfem.cases.defaults import list_defaults
from archfem.cases.report.inputs import tabulate_inputs
from archfem.cases.report.report_data import ReportData
from archfem.cases.structure_keys import build_structure, write_structure
from archfem.cases.toml_file import format_tables
from archfem.masonry import with_finish

RING = Path(__file__).parents[2] / "meshes" / "ring.toml"
BRIDGES = [
    path
    for path in sorted(RING.parent.glob("prusias*.toml"))
    if path.stem not in ("prusias_retrofit", "prusias_sensitivity")  # studies of them
]
EACH_FILL = ("prusias", "prusias_paving", "prusias_restored")
"""Bridges without paving, with paving, and with all that restored ones have."""


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("structure.width=0", "do not fit into a width of 0 m"),
        ("structure.arches.main arch.spn=3", "structure.arches.main arch.spn': did you mean"),
        ("structure.arches.mian arch.thickness=1", "mian arch lacks span, voussoirs: give them"),
        ("structure.piers.gapp=3", "'structure.piers.gapp': did you mean 'gap'"),
        ("structure.backfill.hmp=3", "'structure.backfill.hmp': did you mean 'hump'"),
        ("structure.paving={thickness=0.2,lenght=1}", "structure.paving.lenght': did you mean"),
        ("suite.pairs.pair-1.synthetic.sed=1", "'suite.pairs.pair-1.synthetic.sed': did you mean"),
        ("suite.target.code=['EC8']", r"suite.target.code = \['EC8'\] is not known"),
        ("analysis.damping.jonts='closed'", "'analysis.damping.jonts': did you mean"),
    ],
)
def test_refusals_name_the_key_in_tables_of_a_bridge(change, says):
    with pytest.raises((af.InvalidInput, af.InvalidStructure), match=says):
        af.Case.read(RING.with_name("prusias.toml"), [change])


WALL = {"shape": "wall", "breadth": 2.0, "height": 1.0, "width": 0.4, "course": 0.5}


@pytest.mark.parametrize(
    ("section", "name", "key", "values"),
    [
        ("contacts", "stone-to-stone", "contact", {"friction": 0.3}),
        ("materials", "sandstone", "material", {"preset": "stone", "unit_weight": 22e3}),
    ],
)
def test_a_table_that_no_stone_has_is_refused(section, name, key, values):
    """Such as of a misspelt name: the preset would count in its place."""
    if section == "contacts":
        values |= {"normal_stiffness": 1.48e9, "shear_stiffness": 0.3e9}
    tables = {section: {name: values}}
    says = rf"\[{section}.{name}\] counts for nothing: .* has the {key} '{name}', .* did you mean"
    with pytest.raises(af.InvalidInput, match=says):
        af.Case.of({"structure": WALL, "model": {"fidelity": "rigid"}, **tables})
    # named as the message says, and under another name than that of its table
    for more in ({}, {"name": "of the signer"}):
        named = {"structure": {**WALL, key: name}, section: {name: values | more}}
        built = build_structure(named)
        assert built.weight / 2.0 / 0.4 == pytest.approx(values.get("unit_weight", 20e3))
        assert set(built.friction) == {values.get("friction", 0.6)}


def test_a_table_of_a_preset_that_no_joint_has_is_noted_by_a_check(tmp_path, capsys):
    """A base may have it for other shapes, and the ground below a wall is no soil by its name."""
    path = tmp_path / "wall.toml"
    tables = {"structure": WALL, "contacts": {"soil to stone": {"friction": 0.3}}}
    path.write_text(format_tables({**tables, "model": {"fidelity": "rigid"}}), encoding="utf-8")
    af.commands.main(["check", str(path)])
    assert '[contacts."soil to stone"] counts for nothing: there' in capsys.readouterr().out


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=() if path.stem in EACH_FILL else pytest.mark.slow, id=path.stem)
        for path in BRIDGES
    ],
)
def test_shipped_bridges(path):
    structure = af.Case.read(path).structure
    parts = {block.part for block in structure.blocks}
    assert {"north arch", "main arch", "south arch", "north pier", "south pier"} <= parts
    assert ("paving" in parts) == path.stem.endswith(("_paving", "_restored"))
    assert structure.joints[structure.joint_number("main arch, joint 5")].part == "main arch"


def test_a_table_of_parts_has_keys_that_hold_for_all_parts():
    case = af.Case.read(
        RING.with_name("prusias.toml"),
        ["structure.piers.height=2.8", "structure.piers.south pier.height=2.4"],
    )
    lowest = {
        part: min(
            y for block in case.structure.blocks if block.part == part for _, y in block.outline
        )
        for part in ("north pier", "south pier")
    }
    assert lowest["north pier"] - lowest["south pier"] == pytest.approx(-0.4)


@pytest.mark.parametrize(
    ("keys", "blocks"),
    [
        ('shape="pointed_arch", span=4.0, rise="3 m", thickness=0.5, voussoirs=11', 13),
        ('shape="elliptical_arch", span=4.0, rise=1.2, thickness=0.6, voussoirs=11', 13),
        ('shape="flat_arch", span=2.0, thickness=0.5, voussoirs=7, skewback="20 deg"', 9),
        ('shape="arch_along", intrados=[[0,0],[1,"1 m"],[2,0]], thickness=0.4, voussoirs=5', 7),
        (
            'shape="buttressed_arch", span=4.0, rise=1.2, thickness=0.5, voussoirs=11, '
            "breadth=1.5, height=2.0, course=0.5",
            21,
        ),
        (
            'shape="arcade", spans=[4.0, 5.0], embraces=[170.0], thicknesses=[0.6], voussoirs=[9], '
            "heights=[2.0, 3.0, 2.5], breadths=[1.6], course=1.0",
            28,
        ),
    ],
)
def test_shapes_by_name(keys, blocks):
    assert len(build_structure(tomllib.loads(f"structure = {{ {keys} }}")).blocks) == blocks


SHAPES = [each for each in vars(af.shapes).values() if callable(each)]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.__name__)
def test_no_length_or_angle_of_a_shape_is_without_its_unit(shape):
    assert len(SHAPES) == 18
    kinds = declared_keys(shape, named=(af.Material, af.Contact))
    assert [key for key, kind in kinds.items() if "'1'" in repr([kind])] == []


def test_one_value_stands_for_all_parts_of_an_arcade():
    lengths = {"rises": "1.2 m", "thicknesses": 0.5, "heights": "200 cm", "breadths": 1.6}
    table = {"shape": "arcade", "spans": [4.0, 5.0], "voussoirs": 9, **lengths}
    numbers = {"rises": 1.2, "thicknesses": 0.5, "heights": 2.0, "breadths": 1.6}
    expected = af.shapes.arcade(spans=[4.0, 5.0], voussoirs=9, **numbers)
    assert build_structure({"structure": table}) == expected
    with pytest.raises(af.InvalidInput, match=r"structure.voussoirs\[0\] = True is not a whole"):
        build_structure({"structure": {**table, "voussoirs": [True, 9]}})
    with pytest.raises(af.InvalidInput, match=r"structure\.spans = 4\.0 is not a list"):
        build_structure({"structure": {**table, "spans": 4.0}})


BRIDGE = {
    "structure": {
        "shape": "bridge",
        "arches": {
            "arch": {
                "measured": "centre line",
                "span": 4.0,
                "rise": 1.6,
                "thickness": 0.45,
                "voussoirs": 9,
            }
        },
        "sidewalls": {
            "length": 1.0,
            "height": 0.8,
            "above": 1.0,
            "left wall": {},
            "right wall": {},
        },
        "backfill": {"cover": 0.4},
    },
    "model": {"fidelity": "rigid", "cells": [1, 1]},
}
FILL = {
    "law": "jointed",
    "piece_size": "0.8 m",
    "friction_angle": "35 degree",
    "cohesion": "20 kPa",
}


def case(fill=None, **tables):
    """A small bridge, with a fill and other tables."""
    structure = BRIDGE["structure"] | ({} if fill is None else {"fill": fill})
    return af.Case.of({**BRIDGE, "structure": structure, **tables})


def test_a_fill_is_elastic_unless_it_is_to_be_in_pieces():
    whole, same, cut = case(), case({"law": "elastic"}), case(FILL)
    assert whole.structure == same.structure
    pieces = [block for block in cut.structure.blocks if block.grain]
    assert len(pieces) > 10
    between = [joint for joint in cut.structure.joints if joint.contact.name == "fill"]
    assert {joint.contact.cohesion for joint in between} == {20e3}
    assert between[0].contact.friction == pytest.approx(0.7002, rel=1e-4)


STANDING = {
    "length": "1 m",
    "centre_of_gravity": "0.9 m",
    "lorry": {"x": "3 m", "weight": "40 kN", "width": "0.5 m"},
    "cart": {"x": "1.4 m", "weight": "5 kN"},
}


@pytest.mark.parametrize(
    "fill", [{}, pytest.param(FILL, marks=pytest.mark.slow)], ids=["elastic", "in pieces"]
)
def test_a_file_keeps_bodies_and_fill_as_they_are_given(fill, tmp_path):
    structure = BRIDGE["structure"] | {"standing": STANDING} | ({"fill": fill} if fill else {})
    read = af.Case.of({**BRIDGE, "structure": structure})
    bodies = {block.name: block for block in read.structure.blocks[-2:]}
    assert [*bodies] == ["lorry", "cart"]
    assert bodies["lorry"].area * bodies["lorry"].material.unit_weight == pytest.approx(80e3)
    again = af.Case.read(read.analysis.write(tmp_path / "again.toml"))
    assert again.structure == read.structure
    written = again.settings["structure"]
    assert written["shape"] == "bridge"
    assert written["standing"]["lorry"] == {
        "x": 3.0, "length": 1.0, "weight": 40e3, "centre_of_gravity": 0.9, "width": 0.5,
    }  # fmt: skip
    assert written.get("fill", {}).get("piece_size") == (0.8 if fill else None)
    rows = tabulate_inputs(ReportData(read, {})).rows
    ((key, words, mark),) = (row for row in rows if "lorry" in " ".join(row))
    assert (key, mark) == ("standing", "given")
    assert "lorry x 3 m; weight 40 kN; width 0.5 m" in words
    # its weight is no value of a material that the case leaves to a default
    named = [each.subject for each in list_defaults(read)]
    assert "backfill" in named
    assert not {"lorry", "cart"} & {*named}


def test_bodies_stand_on_walls_and_on_blocks_of_a_file(tmp_path):
    body = {"x": 0.0, "length": 0.4, "weight": 5e3, "centre_of_gravity": 1.0}
    wall = {"shape": "column", "breadth": 2.0, "heights": [0.5, 0.5]}
    read = af.Case.of({"structure": wall | {"standing": {"statue": body}}})
    assert af.Case.read(read.analysis.write(tmp_path / "wall.toml")).settings["structure"][
        "standing"
    ] == {"statue": body}
    bare = af.Case.of({"structure": wall}).structure
    blocks = write_structure(replace(bare, origin=None))
    assert blocks["structure"]["shape"] == "blocks"
    blocks["structure"]["standing"] = {"statue": body}
    assert af.Case.of(blocks).structure.blocks == read.structure.blocks
    with pytest.raises(af.InvalidInput, match=r"structure\.standing names no part"):
        af.Case.of({"structure": wall | {"standing": body}})
    del body["centre_of_gravity"]
    with pytest.raises(af.InvalidInput, match=r"standing\.statue lacks centre_of_gravity"):
        af.Case.of({"structure": wall | {"standing": {"statue": body}}})


def test_a_case_is_built_in_stages():
    built = case(FILL, dead_load={"stages": "usual", "layers": 2})
    assert [stage.name for stage in built.analysis.stages] == [
        "piers and walls", "rings", "centring struck", "fill, layer 1", "fill, layer 2",
    ]  # fmt: skip
    assert case().analysis.stages is None
    assert af.cases.dead_load_of_case(built).model.initial_gaps is not None


def test_usual_stages_have_four_layers_of_a_fill_without_cohesion():
    fill = {key: value for key, value in FILL.items() if key != "cohesion"}
    built = case(fill, dead_load={"stages": "usual"})
    names = [stage.name for stage in built.analysis.stages]
    assert names[3:] == [f"fill, layer {k}" for k in (1, 2, 3, 4)]
    assert {j.contact.cohesion for j in built.structure.joints if j.contact.name == "fill"} == {0.0}


def test_stages_of_a_cases_own():
    own = [
        {"blocks": ["left wall", "right wall"]},
        {"blocks": ["arch"], "centring": True},
        {"name": "the fill", "blocks": ["backfill"]},
        {"strike": True},
    ]
    stages = case(FILL, dead_load={"stages": own}).analysis.stages
    assert [stage.name for stage in stages] == ["stage 0", "stage 1", "the fill", "stage 3"]
    found = af.cases.dead_load_of_case(case(FILL, dead_load={"stages": own}))
    assert found.joints["N"].values.min() >= 0.0


@pytest.mark.parametrize(
    ("fill", "dead_load", "words"),
    [
        ({"law": "plastic"}, {}, "structure.fill.law = 'plastic'"),
        ({"piece_size": 0.5}, {}, "need law = 'jointed'"),
        ({"law": "jointed", "piece_size": 0.5}, {}, "friction_angle"),
        (FILL, {"stages": "some"}, "dead_load.stages = 'some'"),
        (FILL, {"layers": 2}, "needs stages = 'usual'"),
        (FILL, {"stages": [{"blocks": ["arch"]}], "layers": 2}, "stages of its own"),
        (FILL, {"stages": [{"blocks": ["arch"]}]}, "no stage places"),
        (FILL, {"steps": 2}, "unknown key 'dead_load.steps'"),
    ],
)
def test_invalid_input_is_refused(fill, dead_load, words):
    with pytest.raises(af.InvalidInput, match=words):
        case(fill, dead_load=dead_load)


RING_OF_20_MPA = {
    "structure": {"shape": "circular_arch", "span": 5.0, "rise": 1.8}
    | {"thickness": 0.5, "voussoirs": 7},
    "materials": {"stone": {"strength": "20 MPa"}},
}


def test_a_finish_is_read_and_written():
    """Beside friction; the stones decide, and the shape is written with the law."""
    contact = {"stone to stone": {"finish": "dressed", "friction": 0.7}}
    ring = build_structure({**RING_OF_20_MPA, "contacts": contact})
    law = af.joint_stiffness(30e9, 0.5, "dressed", strength=20e6).closing_contact(0.7)
    assert {joint.contact for joint in ring.joints} == {law}
    assert build_structure(RING_OF_20_MPA).joints[0].contact.closure is None
    for structure in (ring, with_finish(build_structure(RING_OF_20_MPA), "dressed")):
        tables = write_structure(structure)
        assert tables["structure"]["shape"] == "circular_arch"
        assert tables["contacts"]["stone to stone"]["finish"] == "dressed"
        assert "normal_stiffness" not in tables["contacts"]["stone to stone"]
        assert build_structure(tables) == structure
    # a stiffness of its own is none of a finish
    own = [replace(j, contact=replace(law, normal_stiffness=1e9)) for j in ring.joints]
    tables = write_structure(replace(ring, joints=tuple(own)))
    assert tables["contacts"]["stone to stone"]["normal_stiffness"] == 1e9
    assert build_structure(tables).joints == tuple(own)


@pytest.mark.parametrize(
    ("contact", "says"),
    [
        ({"finish": "polished"}, "finish.* 'polished'"),
        ({"finish": "hewn", "closure": 1e-4}, "has a finish and closure, which follows from it"),
        (
            {"finish": "hewn", "shear_stiffness": 1e9},
            r"leave out one \(remove = \['contacts.stone to stone.finish'\]",
        ),
    ],
)
def test_a_finish_is_refused_beside_what_follows_from_it(contact, says):
    with pytest.raises(af.InvalidInput, match=says):
        build_structure({**RING_OF_20_MPA, "contacts": {"stone to stone": contact}})


@pytest.mark.parametrize("weight", [3200.0, 20.0])
def test_a_unit_weight_with_its_unit_is_taken_as_it_stands(weight):
    """3.2 kN/m³ are those of a timber, and look like the kg/m³ of a stone."""
    table = {"young": 1e10, "poisson": 0.3, "unit_weight": f"{1e-3 * weight} kN/m³"}
    shape = {"shape": "column", "breadth": 1.0, "heights": [1.0], "material": "timber"}
    built = build_structure({"structure": shape, "materials": {"timber": table}})
    assert built.blocks[1].material.unit_weight == weight
    assert replace(built.blocks[1].material, young=2e10).unit_weight == weight
    assert build_structure(tomllib.loads(format_tables(write_structure(built)))) == built
    table["unit_weight"] = weight
    with pytest.raises(af.InvalidInput, match="looks like"):
        build_structure({"structure": shape, "materials": {"timber": table}})
    table["unit_weight"] = "1e-7 kN/m³"
    with pytest.raises(af.InvalidInput, match="give a weight, not a density"):
        build_structure({"structure": shape, "materials": {"timber": table}})
