"""Roles of parts: given by blocks and joints, or by names with a warning; verdicts by role."""

import json
import logging
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import archfem as af
from archfem.masonry.parts import infer_role, select_assessed_parts
from archfem.masonry.structure import describe_piers
from archfem.studies.evaluators import findings_by_part
from archfem.view.joint_marks import joint_marks

RING = {"span": 4.0, "rise": 1.6, "thickness": 0.3, "voussoirs": 13}
FILL = af.shapes.Backfill(cover=0.5)
WEIGHT = 1e4
NAMES = {
    "arches": ("west arch", "east arch", "pier"),
    "English": ("west vault", "east vault", "stem"),
    "German": ("linker Bogen", "rechter Bogen", "Pfeiler"),
}


@cache
def viaduct(west, east, middle, fill=FILL):
    """Two rings, a pier and fill, of the names given."""
    return af.bridge(
        arches=[
            af.shapes.Arch(measured="centre line", name=west, **RING),
            af.shapes.Arch(measured="centre line", name=east, **RING),
        ],
        piers=[af.shapes.Pier(name=middle, gap=0.9, height=2.4)],
        backfill=fill,
    )


def without_roles(structure):
    """A structure of the same blocks and joints, whose roles are not given."""
    blocks, joints = (
        tuple(replace(each, role="") for each in members)
        for members in (structure.blocks, structure.joints)
    )
    return replace(structure, blocks=blocks, joints=joints)


def quake(structure):
    """Resultants (6, n_joints, 3) of which more and more joints hinge on alternating faces.

    First those of the fill alone, which are not judged; at last four of one ring that can move.
    """
    depth = np.array([joint.depth for joint in structure.joints])
    found = np.zeros((6, len(depth), 3))
    found[..., 0] = WEIGHT
    soil = [k for k, joint in enumerate(structure.joints) if "backfill" in joint.name]
    pier = next(k for k, joint in enumerate(structure.joints) if joint.name.endswith(", base"))
    west = next(k for k, joint in enumerate(structure.joints) if joint.name.endswith(", joint 0"))
    a, b, c, d = (west + k for k in (0, 4, 9, 13))
    for instant, failing in enumerate(
        [soil, [a, b, pier], [a, b, c, pier], [a], [b], [a, b, c, d]]
    ):
        for k, joint in enumerate(failing):
            side = 0.49 if k % 2 else -0.49
            found[instant, joint, 2] = side * WEIGHT * depth[joint]
    return found


def verdicts(structure):
    """First mechanisms of that quake by each definition: joints, time, class and moving blocks."""
    joints = af.joints.joint_dataset(structure, quake(structure), np.arange(6.0))
    found = af.first_mechanisms(af.History(joints, structure))
    return {name: replace(each, part="") for name, each in found.items()}


@pytest.fixture
def warnings(caplog):
    """The warnings so far."""
    caplog.set_level(logging.WARNING, "archfem")
    return lambda: [record.getMessage() for record in caplog.records]


@pytest.mark.parametrize("names", NAMES.values(), ids=NAMES)
def test_the_verdict_does_not_depend_on_names(names, warnings):
    """Not on the names, whether the shapes find the joints, or `assembled` does."""
    expected = verdicts(viaduct(*NAMES["arches"]))
    kinds = {name: (each.time, each.kind) for name, each in expected.items()}
    assert kinds == {
        "any joints at once": (2.0, "semi-global"),
        "one part at once": (5.0, "local"),
        "ring and pier at once": (2.0, "semi-global"),
        "one part over the record": (5.0, "local"),
        "verified": (5.0, "local"),
        "Demirel and Aldemir": (5.0, "local"),
    }
    made = viaduct(*names)
    assert verdicts(made) == expected
    again = af.masonry.assembled(made.blocks, af.masonry.STONE_TO_STONE)
    first = af.masonry.assembled(viaduct(*NAMES["arches"]).blocks, af.masonry.STONE_TO_STONE)
    assert [each.role for each in again.joints] == [each.role for each in first.joints]
    assert [each.ends.tolist() for each in again.joints] == [e.ends.tolist() for e in first.joints]
    assert warnings() == []


@pytest.mark.slow
def test_a_run_meets_the_same_mechanism_whatever_its_parts_are_called(warnings):
    """A run without known vaults meets another one, with warnings."""
    motion = af.Motion(5.0 * np.sin(4.0 * np.pi * np.arange(0.0, 0.8, 0.005)), 0.005)
    met = []
    for names in (NAMES["arches"], NAMES["German"]):
        made = viaduct(*names, fill=None)
        run = af.time_history(
            af.build(made, fidelity="rigid"),
            motion,
            dt=0.005,
            damping=af.Rayleigh(0.05, (4.0, 15.0)),
        )
        met.append((replace(run.mechanism, part=""), replace(run.verified.moved, part="")))
    assert met[0] == met[1]
    assert met[0][0].kind == "global"
    assert not [words for words in warnings() if "displacements as small" not in words]
    blank = af.build(without_roles(made), fidelity="rigid")
    run = af.time_history(blank, motion, dt=0.005, damping=af.Rayleigh(0.05, (4.0, 15.0)))
    assert replace(run.mechanism, part="") != met[0][0]
    assert len([words for words in warnings() if "displacements as small" not in words]) >= 3


@pytest.mark.parametrize(
    "event", [af.CountedMechanism, af.dynamics.MovingMechanism, af.dynamics.EveryMechanism]
)
def test_events_go_by_roles(event):
    endings = []
    for names in NAMES.values():
        made = viaduct(*names)
        watch = event().start_monitor(made, af.Criteria())
        ends = [watch(resultants, 0.005) is not None for resultants in quake(made)]
        endings.append(ends.index(True))
    assert len(set(endings)) == 1


def test_findings_and_pictures_go_by_roles_too():
    """Findings that studies keep, and panels of pictures."""
    seen = []
    for names in (NAMES["arches"], NAMES["German"]):
        made = viaduct(*names)
        joints = af.joints.joint_dataset(made, quake(made), np.arange(6.0))
        run = af.History(joints.assign_attrs(ended="finished", outcome="reached the end"), made)
        panels = [axes.get_title() for axes in af.view.draw_envelope({"run": run}).axes]
        assert panels == list(names)
        found = findings_by_part(run)
        by_name = {word: {} for word in ("eccentricity", "friction", "mechanism", "time")}
        for key, value in found.items():
            word, colon, name = key.partition(": ")
            if colon:
                by_name[word][name] = value
        assert set(by_name["eccentricity"]) == set(names)
        marks = joint_marks(made, joints.isel(time=5))
        seen.append((by_name["mechanism"], by_name["time"], marks.hinges.tolist()))
    assert seen[0] == seen[1]


def test_an_unknown_name_is_warned_of_once_with_ways_to_set_its_role(warnings):
    made = without_roles(viaduct(*NAMES["English"]))
    assert len(warnings()) == 3
    for name in NAMES["English"]:
        (said,) = (each for each in warnings() if f"'{name}'" in each)
        assert f"part '{name}' is taken for neither ring nor pier" in said
        assert "its name has no word of a known role" in said
        assert 'Block(role="ring")' in said
        assert "[structure.layers]" in said
    assert set(af.joints.part_roles(af.joints.joint_dataset(made, quake(made)[0])).values()) == {
        "other"
    }
    assert verdicts(without_roles(viaduct(*NAMES["arches"]))) == verdicts(viaduct(*NAMES["arches"]))
    assert len(warnings()) == 3
    replace(made, width=2.0)
    assert len(warnings()) == 3  # its blocks have their roles now


def test_the_role_of_a_part_that_is_fixed_is_never_warned_of(warnings):
    column = af.column(breadth=1.0, heights=[1.0, 1.0])
    parts = [
        replace(block, part="plinth" if block.fixed else "pier", role="") for block in column.blocks
    ]
    replace(column, blocks=tuple(parts))
    assert warnings() == []
    replace(column, blocks=(*parts[:2], replace(parts[2], part="plinth")))
    assert len(warnings()) == 1


def test_a_role_of_one_block_holds_for_all_of_its_part(warnings):
    made = without_roles(viaduct("west vault", "east arch", "pier"))
    assert len(warnings()) == 1
    number = next(k for k, each in enumerate(made.blocks) if each.part == "west vault")
    blank = [replace(each, role="") for each in made.blocks]
    blank[number] = replace(blank[number], role="ring")
    joints = tuple(replace(each, role="") for each in made.joints)
    again = af.Structure(tuple(blank), joints, made.width)
    assert {each.role for each in again.blocks if each.part == "west vault"} == {"ring"}
    assert {each.role for each in again.joints if each.part == "west vault"} == {"ring"}
    assert verdicts(again) == verdicts(viaduct(*NAMES["arches"]))
    assert len(warnings()) == 1


@pytest.mark.parametrize(
    ("part", "role"),
    [
        ("", "ring"),
        ("arch", "ring"),
        ("north_arch", "ring"),
        ("Ring2", "ring"),
        ("Arches", "ring"),
        ("left pier", "pier"),
        ("piers", "pier"),
        ("columns (east)", "pier"),
        ("lintel", "ring"),
        ("door lintels", "ring"),
        ("left post", "pier"),
        ("left abutment", "other"),
        ("slab", "other"),
        ("backfill", "other"),
        ("spandrel-walls", "other"),
    ],
)
def test_names_that_imply_a_role(part, role, warnings):
    assert infer_role(part) == role
    assert warnings() == []


@pytest.mark.parametrize(
    ("part", "role", "why"),
    [
        ("spring line", "other", "has no word of a known role"),
        ("mainarch", "other", "has no word of a known role"),
        ("3", "other", "has no word of a known role"),
        ("fill over the arch", "ring", "has words of ring and other"),
        ("pier foundation", "pier", "has words of pier and other"),
    ],
)
def test_names_that_leave_a_role_open(part, role, why, warnings):
    assert infer_role(part) == role
    (said,) = warnings()
    assert f"part '{part}' is taken for" in said
    assert why in said


def test_rings_and_piers_are_judged_or_all_where_there_is_neither():
    assert select_assessed_parts({"wall": "other", "pier": "pier", "": "ring"}) == ("pier", "")
    assert select_assessed_parts({"wall": "other", "fill": "other"}) == ("wall", "fill")


def test_roles_that_contradict_one_another_are_refused():
    made = af.column(breadth=1.0, heights=[1.0, 1.0])
    base, block, top = made.blocks
    with pytest.raises(
        af.errors.InvalidStructure, match=r"'base' has role 'pier' and 'block 1' has .*'ring'"
    ):
        replace(made, blocks=(base, replace(block, role="ring"), top))
    wrong = tuple(replace(joint, role="other") for joint in made.joints)
    with pytest.raises(
        af.errors.InvalidStructure, match="'joint 0' has role 'other': give all blocks and"
    ):
        replace(made, joints=wrong)
    with pytest.raises(
        af.errors.InvalidStructure, match=r"role 'vault', which is not known: .*'ring', 'pie"
    ):
        af.masonry.assembled([base, replace(block, role="vault")], af.masonry.STONE_TO_STONE)
    with pytest.raises(
        af.errors.InvalidStructure, match=r"of part 'wall', .* 'other' and .* 'pier'"
    ):
        af.masonry.assembled(
            [replace(base, part="wall", role="other"), replace(block, part="wall")],
            af.masonry.SOIL_TO_STONE,
        )
    with pytest.raises(
        af.errors.InvalidStructure, match=r"of part 'backfill', .*'ring' and .*'other'"
    ):
        viaduct("backfill", "east arch", "pier")


def test_a_survey_gives_roles_by_properties_or_layers(tmp_path, warnings):
    made = viaduct(*NAMES["German"])
    path = tmp_path / "viaduct.geojson"
    af.masonry.write_outlines(made, path)
    joints = [(joint.name, joint.role) for joint in af.masonry.surveyed(path).joints]
    assert warnings() == []
    table = json.loads(path.read_text())
    for feature in table["features"]:
        del feature["properties"]["role"]
    path.write_text(json.dumps(table))
    layers = {block.part: {"role": block.role} for block in made.blocks}
    structure = {"shape": "outlines", "file": str(path), "layers": layers}
    found = af.Case.of({"structure": structure}).structure
    assert [(joint.name, joint.role) for joint in found.joints] == joints
    assert warnings() == []
    af.read_outlines(path)
    assert {said.split("'")[1] for said in warnings()} == set(NAMES["German"])


def test_values_that_a_drawing_does_not_hold_are_named(tmp_path, warnings):
    soft = af.Contact(1e9, 2e8, friction=0.5, name="pads")
    path = tmp_path / "stack.geojson"
    af.masonry.write_outlines(af.column(breadth=1.0, heights=[1.0], contact=soft), path)
    assert [text.partition(" does not hold ")[2] for text in warnings()] == [
        "the values of ['pads']: write an Analysis to keep them"
    ]


def test_invalid_roles_of_a_survey_are_refused(tmp_path):
    path = tmp_path / "stack.geojson"
    af.masonry.write_outlines(af.column(breadth=1.0, heights=[1.0]), path)
    table = json.loads(path.read_text())
    rest = table["features"][1]["properties"]
    rest["role"] = "ring"
    path.write_text(json.dumps(table))
    with pytest.raises(
        af.errors.InvalidStructure, match=r"stack.geojson: of part 'column', 'base' has role"
    ):
        af.masonry.surveyed(path)
    rest["role"] = "vault"
    path.write_text(json.dumps(table))
    with pytest.raises(
        af.errors.InvalidStructure, match=r"stack.geojson: 'block 1' .* role 'vault'"
    ):
        af.masonry.surveyed(path)
    del rest["role"]
    rest["Role"] = "pier"
    path.write_text(json.dumps(table))
    with pytest.raises(af.errors.InvalidInput, match="property 'Role': did you mean 'role'"):
        af.masonry.surveyed(path)


def test_the_role_of_a_feature_precedes_that_of_its_layer(tmp_path):
    path = tmp_path / "stack.geojson"
    af.masonry.write_outlines(af.column(breadth=1.0, heights=[1.0]), path)
    blocks = af.read_outlines(path, layers={"column": af.masonry.Layer(role="other")}).blocks
    assert {block.role for block in blocks} == {"pier"}


def test_a_bridge_of_a_case_may_call_its_parts_anything(warnings):
    case = af.Case.of({"structure": {"shape": "bridge", "arches": {"Bogen": RING}}})
    assert {joint.role for joint in case.structure.joints} == {"ring"}
    assert warnings() == []


def test_a_saved_history_keeps_roles(tmp_path):
    made = viaduct(*NAMES["English"])
    dataset = af.joints.joint_dataset(made, quake(made), np.arange(6.0))
    path = af.History(dataset, made).save(tmp_path / "run.nc")
    again = af.History.read(path)
    assert af.joints.part_roles(again.joints) == af.joints.part_roles(dataset)
    assert af.joints.assessed_joints(again.joints)["joint"].equals(
        af.joints.assessed_joints(dataset)["joint"]
    )
    assert again.mechanism == af.limit.counted_mechanisms(dataset)["any joints at once"]


def test_a_pier_with_a_setback_has_both_breadths():
    blocks = [af.Block(((-1, -1), (1, -1), (1, 0), (-1, 0)), af.STONE, "ground", fixed=True)]
    for level, left in enumerate((0.0, 0.0, 0.15)):
        corners = ((left, level), (0.65, level), (0.65, level + 1), (left, level + 1))
        blocks.append(af.Block(corners, af.STONE, f"{level}", part="front", role="pier"))
    front = af.masonry.assembled(blocks, af.Contact(1e9, 4e8, friction=0.6))
    assert describe_piers(front) == {"front": "0.5 to 0.65 m broad"}
