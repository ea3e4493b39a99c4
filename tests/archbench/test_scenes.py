"""Scenes and references of Arch-Bench: their format, and files that are not as it says."""

import json

import pytest

from archbench import make_scenes
from archbench.scene import (
    ACTIONS,
    HERE,
    BenchError,
    read_references,
    read_scene,
    scene_names,
    scene_problems,
    signed_area,
)

NAMES = scene_names()


def test_scenes_and_references_belong_together():
    assert sorted(path.stem for path in (HERE / "references").glob("*.toml")) == NAMES
    assert {name[:3] for name in NAMES} >= {
        *("S01", "S02", "S03", "S04", "S05", "S06", "S07", "S08", "S10", "S11", "S12"),
        *("S15", "S20", "S21", "S22", "S32", "S33"),
    }


def test_every_scene_and_reference_can_be_read():
    assert {name: read_scene(name)["id"] for name in NAMES} == {name: name for name in NAMES}
    texts = {name: HERE / "references" / f"{name}.toml" for name in NAMES}
    # without a reference the file says why
    assert [
        name
        for name, path in texts.items()
        if not read_references(name)
        and not path.read_text(encoding="utf-8").startswith("# No reference")
    ] == []


def test_scenes_are_those_that_are_made_from_their_lengths():
    for made in make_scenes.scenes():
        assert json.loads(json.dumps(made)) == read_scene(made["id"])
    assert len(list(make_scenes.scenes())) == len(NAMES)


def test_at_least_eight_measured_rows_were_read_in_a_source():
    read = [
        value
        for name in NAMES
        for value in read_references(name)
        if value.kind == "E" and value.grade in ("a", "b")
    ]
    assert len(read) >= 8


def test_at_least_six_measured_rows_of_lateral_action_were_read():
    lateral = [
        value
        for name in NAMES
        if read_scene(name)["action"]["kind"] in ("push", "sideways")
        for value in read_references(name)
        if value.kind == "E" and value.grade in ("a", "b")
    ]
    assert len(lateral) >= 6


def test_a_granite_wall_weighs_what_its_data_base_says():
    """4.8 kN and the press at the base, of which the beam is 1 kN."""
    for name, press in (("S32_040", 40.0), ("S32_250", 250.0)):
        scene = read_scene(name)
        area = sum(signed_area(b["outline"]) * b["density"] for b in scene["blocks"][1:])
        (dead,) = scene["action"]["dead"]
        weight = 1e-3 * scene["width"] * scene["gravity"] * area
        assert weight - 1e-3 * dead["force"][1] == pytest.approx(4.8 + press, rel=1e-6)


def test_bridges_name_the_lengths_that_were_not_read():
    bridges = [read_scene(name) for name in NAMES if name.startswith(("S20", "S21", "S22"))]
    assert len(bridges) == 8
    assert all("cover" in scene["from_memory"] for scene in bridges)
    # a note is no substitute for the list
    assert not any("memory" in read_scene(name).get("note", "") for name in NAMES)


def joints_off_edges(name):
    """The joints of a scene whose ends are not on one edge of each of their blocks."""
    scene = read_scene(name)
    key = "growth" if scene["action"]["kind"] == "thickness" else None
    for joint in scene["joints"]:
        ends = joint["ends"]
        for number in joint["blocks"]:
            block = scene["blocks"][number]
            points = block["outline"]
            if key:  # a member of the family
                points = [
                    (x + 0.1 * u, y + 0.1 * v)
                    for (x, y), (u, v) in zip(points, block[key], strict=True)
                ]
                ends = [
                    (x + 0.1 * u, y + 0.1 * v)
                    for (x, y), (u, v) in zip(joint["ends"], joint[key], strict=True)
                ]
            edges = zip(points, [*points[1:], points[0]], strict=True)
            if not any(all(distance(end, *edge) < 1e-6 for end in ends) for edge in edges):
                yield name, joint["blocks"]


def test_joints_lie_on_the_edges_of_both_blocks():
    assert [joint for name in NAMES for joint in joints_off_edges(name)] == []


def distance(point, start, end):
    """Distance of a point from a segment."""
    (x, y), (ax, ay), (bx, by) = point, start, end
    length = ((bx - ax) ** 2 + (by - ay) ** 2) ** 0.5
    along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length
    beyond = max(-along, along - length, 0.0)
    return beyond + abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length


def broken(**changes):
    return {**read_scene("S04"), **changes}


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        ({}, "are missing"),
        (broken(colour="red"), "unknown"),
        (broken(from_memory=[1.5]), "not read"),
        (broken(action={"kind": "prayer"}), "is none of"),
        (broken(action={"kind": "sideways", "force": 1}), "has keys"),
        (broken(quantities={}), "no quantity"),
        (broken(quantities={"factor": {"unit": "g"}}), "needs a unit and a meaning"),
        (broken(laws={}), "unknown law"),
        (broken(joints=[{"blocks": [0, 99], "ends": [], "law": "dry"}]), "not there"),
        (
            broken(
                blocks=[
                    {"name": "b", "outline": [[0, 0], [0, 1], [1, 0]], "density": 1, "fixed": True}
                ]
            ),
            "not anticlockwise",
        ),
    ],
)
def test_a_wrong_scene_is_refused(scene, message):
    assert message in "; ".join(scene_problems(scene))


def copied(tmp_path, text):
    """A folder with one scene, and the text as its references."""
    for folder in ("scenes", "references"):
        (tmp_path / folder).mkdir()
    scene = json.dumps(read_scene("S04"))
    (tmp_path / "scenes" / "S04.json").write_text(scene, encoding="utf-8")
    (tmp_path / "references" / "S04.toml").write_text(text, encoding="utf-8")
    return tmp_path


VALUE = """
[[value]]
quantity = "factor"
number = 0.45
uncertainty = 0.01
kind = "A"
grade = "a"
source = "a book"
url = "https://example.org"
licence = "CC0"
read_by = "page 3"
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.45", "nan", "not finite"),
        ("0.01", "0.0", "not positive"),
        ('"A"', '"X"', "none of"),
        ('grade = "a"', 'grade = "z"', "none of"),
        ('"factor"', '"colour"', "no such quantity"),
        ('"a book"', '""', "source or licence"),
        ('"page 3"', '""', "read_by"),
        ('licence = "CC0"', "", "cannot be read"),
        ("[[value]]", "[[value", "cannot be read"),
    ],
)
def test_a_wrong_reference_is_refused(tmp_path, old, new, message):
    folder = copied(tmp_path, VALUE.replace(old, new))
    with pytest.raises(BenchError, match=message):
        read_references("S04", folder)


def test_a_right_reference_is_read(tmp_path):
    (value,) = read_references("S04", copied(tmp_path, VALUE))
    assert (value.number, value.kind) == (0.45, "A")


def test_a_missing_scene_is_named(tmp_path):
    with pytest.raises(BenchError, match="S99"):
        read_scene("S99", tmp_path)


def test_actions_are_those_in_use():
    assert {read_scene(name)["action"]["kind"] for name in NAMES} == set(ACTIONS)


def test_the_area_of_a_square():
    assert signed_area([[0, 0], [2, 0], [2, 2], [0, 2]]) == 4.0
