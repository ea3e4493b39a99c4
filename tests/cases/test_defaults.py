"""Deciding values that a case does not give are marked as defaults."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.cases.case import case_of
from archfem.cases.defaults import (
    describe_defaults,
    describe_margins_at_rest,
    describe_spectrum_defaults,
    explain_defaults,
    list_default_keys,
    list_defaults,
    list_fill_values,
)
from archfem.cases.report.sections import _describe_extent
from archfem.cases.result_text import describe_dead_load
from archfem.masonry.out_of_plane import find_transverse_push
from archfem.masonry.structure import describe_assessment

COLUMN = {"shape": "column", "breadth": 0.6, "heights": [1.2, 1.2]}
BARE = {"structure": COLUMN, "motion": {"synthetic": {"seed": 1, "duration": 1.0, "pga": 1.0}}}


def test_every_deciding_value_that_is_left_out_is_named():
    text = describe_defaults(af.Case.of(BARE))
    assert text.partition(": ")[2].split("; ") == [
        "'stone' E 30 GPa, weight 20 kN/m³, strength 56 MPa",
        "'stone to stone' k_n 1.48 MPa/mm, k_s 0.3 MPa/mm, μ 0.6",
        "width 1 m",
        "vertical motion 2/3 of the horizontal",
        "no damping",
        "hinge at |e| 0.46",
        "mechanism of 4 joints",
        "fidelity 'full'",
        "displacements 'small'",
    ]


IN_PIECES = {
    "shape": "bridge",
    "arches": {"arch": {"span": 2.0, "rise": 0.5, "thickness": 0.3, "voussoirs": 5}},
    "sidewalls": {"length": 1.5, "height": 1.0, "left wall": {}, "right wall": {}},
    "backfill": {"cover": 0.4},
    "fill": {"law": "jointed", "piece_size": 0.45, "friction_angle": "20 degree"},
}


def test_a_default_of_many_contacts_is_named_once():
    """Pieces of a fill have a contact with stone for each depth of soil."""
    text = describe_defaults(af.Case.of({"structure": IN_PIECES}))
    assert "'soil to stone' μ 0.6;" in text


def test_a_default_modulus_is_named_where_displacements_depend_on_it():
    """Not that of rigid stone; pieces of a fill have theirs in their joints."""
    held = IN_PIECES | {"fill": IN_PIECES["fill"] | {"cohesion": 1e5}}
    given = {"structure": held, "model": {"fidelity": "rigid"}}
    (found,) = [x for x in list_defaults(af.Case.of(given)) if x.key.endswith(".young")]
    assert found.key == "materials.backfill.young"
    assert found.words == f"E {af.masonry.BACKFILL.young / 1e6:g} MPa"
    assert found.reason.endswith("; displacements depend on it")
    own, *changed = (
        af.cases.DeadLoadResult.of(af.Case.of(given | {"materials": materials})).dead.q
        for materials in ({}, {"stone": {"young": 50e9}}, {"backfill": {"young": 60e6}})
    )
    assert [np.allclose(q, own, rtol=1e-6, atol=1e-9) for q in changed] == [True, False]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"code": "EC8", "ag": 0.2, "ground": "B"}, "type 1"),
        ({"code": "EC8", "ag": 0.2, "ground": "B", "type": 1}, ""),
        ({"code": "NTC-2018", "ag": 0.2, "f0": 2.4, "tc_star": 0.3, "site": "B"}, "topography 1.0"),
        ({"code": "table", "periods": [0.0, 1.0], "values": [0.1, 0.2]}, ""),
    ],
)
def test_what_a_spectrum_leaves_open_is_named(given, words):
    case = af.Case.of({"structure": COLUMN, "assessment": {"spectrum": given}})
    assert describe_spectrum_defaults(case) == words
    found = [(each.words, each.key) for each in list_defaults(case) if each.subject == "spectrum"]
    assert found == [(words, f"assessment.spectrum.{words.split(' ')[0]}")] * bool(words)
    # that of the assessment is the site's, even where the target of a suite leaves more open
    target = {"code": "EC8", "ag": 0.2, "ground": "B"}
    suite = {"target": target, "pairs": {"a": {"synthetic": {"seed": 1, "duration": 1.0}}}}
    case = af.Case.of({**case.settings, "suite": suite})
    assert describe_spectrum_defaults(case) == words
    assert "suite.target.type: type 1: 2 is for sites" in explain_defaults(case)


def test_values_that_are_given_are_not():
    contact = {"normal_stiffness": 1.48e9, "friction": 0.6}  # also where they equal the default
    given = {
        "structure": {**BARE["structure"], "width": 1.0},
        "contacts": {"stone to stone": contact},
        "motion": {"synthetic": {"seed": 1, "vertical_ratio": 0.5}},
        "criteria": {"hinge": 0.46, "failures": 4},
        "model": {"fidelity": "rigid", "displacements": "large"},
        "analysis": {"damping": "effective"},
    }
    case = af.Case.of(given)
    joint, stone = case.structure.joints[0], case.structure.blocks[1]
    assert list_default_keys(case, joint.contact) == ["shear_stiffness"]
    assert list_default_keys(case, stone.material) == ["young", "unit_weight", "strength"]
    text = describe_defaults(case)
    assert "'stone to stone' k_s 0.3 MPa/mm;" not in text
    assert text.endswith("'stone to stone' k_s 0.3 MPa/mm")
    materials = {"stone": {"young": 1e10, "unit_weight": 2e4, "strength": 1e7}}
    contacts = {"stone to stone": {**contact, "shear_stiffness": "0.3 MPa/mm"}}
    assert (
        describe_defaults(af.Case.of({**given, "materials": materials, "contacts": contacts})) == ""
    )


@pytest.mark.parametrize("name", ["stone", "light"])
def test_a_changed_copy_of_the_preset_keeps_its_defaults(tmp_path, name):
    """Whether it is copied in Python, or by the key `preset`; what is given by hand is given."""
    column = af.column(breadth=0.6, heights=[1.2, 1.2])
    light = replace(af.STONE, name=name, unit_weight=16e3, stands_for="a window beside it")
    blocks = (*column.blocks[:2], replace(column.blocks[2], material=light))
    analysis = af.Analysis(replace(column, blocks=blocks))
    case = af.Case.read(analysis.write(tmp_path / "copy.toml"))
    assert case.analysis == analysis
    assert list_default_keys(case, light) == ["young", "strength"]
    assert case.limit.strength is None
    (key,) = case.settings["materials"]
    assert (
        case.settings["materials"][key].items() >= {"preset": "stone", "unit_weight": 16e3}.items()
    )
    given = af.Case.read(tmp_path / "copy.toml", [f'materials."{key}".strength="56 MPa"'])
    assert list_default_keys(given, light) == ["young"]
    assert given.limit.strength == 56e6
    with pytest.raises(af.InvalidInput, match=r"materials\..*\.preset = 'marble' is not known"):
        af.Case.read(tmp_path / "copy.toml", [f'materials."{key}".preset="marble"'])


def test_python_and_files_have_the_same_defaults():
    """A value of Python with nothing given has the defaults of a case with nothing given."""
    analysis = af.Analysis(af.column(breadth=0.6, heights=[1.2, 1.2]))
    motion = af.Motion.synthetic(seed=1, duration=1.0, pga=1.0)
    case = af.Case.of({**BARE, "title": "column"})
    assert case.analysis == analysis
    assert case.ground_motion().vertical.tobytes() == motion.vertical.tobytes()
    here = describe_defaults(case_of(analysis, motion)).split("; ")
    # the samples of a motion have no ratio; all else is left out in both
    assert set(describe_defaults(case).split("; ")) - set(here) == {
        "vertical motion 2/3 of the horizontal"
    }


def test_the_ratio_of_a_matched_suite_is_that_before_matching():
    """Matching gives each component its own target, whatever the ratio was."""
    pairs = {"one": {"synthetic": {"seed": 1, "duration": 10.0}}}
    suite = {"pairs": pairs, "target": {"code": "EC8", "type": 1, "ag": 0.25, "ground": "A"}}
    for matched, words in ((True, "horizontal, before matching;"), (False, "horizontal;")):
        case = af.Case.of({"structure": COLUMN, "suite": {**suite, "matched": matched}})
        assert f"vertical motion 2/3 of the {words}" in describe_defaults(case)


def test_results_name_them():
    case = af.Case.of({**BARE, "model": {"fidelity": "rigid"}})
    assert describe_defaults(case) in describe_dead_load(af.cases.DeadLoadResult.of(case))


def test_the_dead_load_says_whether_it_stands_and_what_is_in_doubt():
    """Joints of very little friction are doubted."""
    for friction, doubted in ((0.6, ""), (0.05, ", in doubt as below")):
        contact = {"normal_stiffness": 1.48e9, "friction": friction}
        given = {"model": {"fidelity": "rigid"}, "contacts": {"stone to stone": contact}}
        text = describe_dead_load(af.cases.DeadLoadResult.of(af.Case.of(BARE | given)))
        assert f"dead load: stands under its own weight{doubted}: |e| ≤ " in text


@pytest.mark.parametrize("backing", [{}, {"backing": 0.5}, {"backing_height": 0.5}])
def test_the_dead_load_says_that_backing_is_fill(backing):
    limit = {"horizontal": 1.0, "fill": {"friction_angle": 30.0, **backing}}
    case = af.Case.of({**BARE, "model": {"fidelity": "rigid"}, "limit": limit})
    text = describe_dead_load(af.cases.DeadLoadResult.of(case))
    note = "\nnote: the backing of [limit] is fill here, in dead load and runs\n"
    assert (note in text) == (len(backing) > 0)


def test_beds_of_a_wall_in_bond_follow_the_other_piers_in_the_line_of_the_dead_load():
    """A pier of two stones, the upper 3 m high, beside a wall of 2 m with a head joint."""
    boxes = {
        "wall": [(0, 0, 1, 1), (1, 0, 2, 1), (0, 1, 2, 2)],
        "pier": [(3, 0, 4, 1), (3, 1, 4, 4)],
        "ground": [(0, -1, 4, 0)],
    }
    blocks = [
        {"name": f"{part} {k}", "outline": [[a, c], [b, c], [b, d], [a, d]], "part": part}
        | {"role": "other" if part == "ground" else "pier", "fixed": part == "ground"}
        for part, own in boxes.items()
        for k, (a, c, b, d) in enumerate(own)
    ]
    case = af.Case.of({"structure": {"shape": "blocks", "blocks": blocks}})
    text = describe_dead_load(af.cases.DeadLoadResult.of(case))
    (line,) = [each for each in text.splitlines() if each.startswith("dead load: stands")]
    pier, beds = line.split("; of head joints")[0].split("; of beds of wall, ")
    weight = 1e-3 * af.STONE.unit_weight
    assert pier.endswith(f"N ≥ {3.0 * weight:.2f} kN")
    assert beds.endswith(f"N ≥ {weight:.2f} kN")
    names, parts = [f"{k}" for k in range(6)], ["wall"] + ["fill"] * 4 + ["ring"]
    judged, heads = np.arange(6) == 5, np.arange(6) == 0
    said = describe_assessment(names, parts, judged, heads)
    assert said.endswith("not assessed: 1 head joint of wall; 4 of fill")


def test_head_joints_are_apart_in_the_line_of_the_dead_load(tmp_path):
    """Two stones side by side under a third: their joint carries nothing."""
    corners = {"a": (0, 0, 1, 1), "b": (1, 0, 2, 1), "c": (0, 1, 2, 2), "ground": (0, -1, 2, 0)}
    blocks = []
    for name, (left, low, right, high) in corners.items():
        outline = [(left, low), (right, low), (right, high), (left, high)]
        part, role = ("ground", "other") if name == "ground" else ("wall", "pier")
        fixed = name == "ground"
        blocks.append(af.Block(outline, af.STONE, name, fixed=fixed, part=part, role=role))
    wall = af.masonry.assembled(blocks, af.Contact(1e9, 4e8, friction=0.6))
    case = af.Case.read(af.Analysis(wall, fidelity="rigid").write(tmp_path / "wall.toml"))
    at_rest = af.cases.DeadLoadResult.of(case)
    text = describe_dead_load(at_rest)
    (line,) = [each for each in text.splitlines() if each.startswith("dead load: ")]
    assert line.startswith("dead load: stands under its own weight: |e| ≤ ")
    beds, heads = line.split("; of head joints, which do not count, ")
    assert beds.endswith(f"N ≥ {1e-3 * af.STONE.unit_weight:.2f} kN")  # c rests on a and b
    assert heads.endswith("N ≥ 0.00 kN")
    # 1 m thick and 2 m high: a strip overturns no sooner than all of it
    push, body = find_transverse_push(wall)
    assert (push, body) == (pytest.approx(0.5), "all of it")
    assert "not assessed: a to b\nnothing is checked across the plane of the drawing: " in text
    assert "held by nothing else, all of it begins to overturn at 0.5 g, by the width" in text
    head = int(np.flatnonzero(case.structure.heads)[0])
    # within a thousandth all of the friction; a head joint does not count
    for number, used, said in ((0, 0.5995, True), (0, 0.599, False), (head, 0.6, False)):
        joints = at_rest.dead.joints.copy(deep=True)
        joints["friction"][number] = used
        vars(at_rest.dead)["joints"] = joints
        text = describe_dead_load(at_rest)
        assert ("V/N is μ at 1 joint, which makes no mechanism" in text) is said


def test_check_explains_each_default_by_its_key(tmp_path, capsys):
    path = tmp_path / "case.toml"
    path.write_text(af.Case.of({**BARE, "model": {"fidelity": "rigid"}}).text(), encoding="utf-8")
    assert af.commands.main(["check", str(path)]) == 0
    case, said = af.Case.read(path), capsys.readouterr().out
    assert explain_defaults(case) in said
    for each in list_defaults(case):
        assert f"{each.key}: {each.words}: {each.reason}" in said
    # each key is one of the case: a change of it takes the default away
    for value in ("materials.stone.strength=1e7", 'contacts."stone to stone".friction=0.5'):
        key = value.partition("=")[0]
        assert key in [each.key for each in list_defaults(case)]
        assert key not in [each.key for each in list_defaults(af.Case.read(path, [value]))]


def test_check_explains_a_finish_with_its_range_in_place_of_defaults():
    contact = {"stone to stone": {"finish": "hewn"}}
    case = af.Case.of({**BARE, "model": {"fidelity": "rigid"}, "contacts": contact})
    keys = [each.key for each in list_defaults(case)]
    assert 'contacts."stone to stone".friction' in keys
    assert not any(key.endswith("stiffness") for key in keys)
    stone, depth = case.structure.blocks[1].material, case.structure.joints[0].depth
    law = af.joint_stiffness(stone.young, depth, "hewn", strength=stone.strength)
    (line,) = [each for each in explain_defaults(case).splitlines() if "finish" in each]
    for values, unit in ((law.initial, 1e9), (law.shear, 1e9), (law.closure, 1e-3)):
        low, usual, high = (f"{value / unit:.2g}" for value in sorted(values))
        assert f"{usual} ({low} to {high})" in line
    assert "Bandis" in line


@pytest.mark.parametrize("friction", [6.0, 1.0, None])
def test_a_friction_of_more_than_dry_stone_has_is_noted(friction):
    contact = af.Contact(1e9, 4e8, friction=friction)
    stack = af.column(breadth=0.6, heights=[1.2], contact=contact)
    lines = describe_margins_at_rest(af.Case.of(BARE), stack)
    note = "note: a coefficient of friction is 6, and dry stone has 0.4 to 0.8"
    assert (note in lines) == any("dry stone" in each for each in lines) == (friction == 6.0)


def test_contacts_of_one_name_are_named_once_where_friction_decides():
    """Two stones on a slope of 1 in 2, on contacts that differ in stiffness alone."""
    slope = af.Block(((0, 0), (4, 0), (4, 2)), af.STONE, "slope", fixed=True)
    blocks = [slope]
    for x in (1.0, 2.5):
        corners = ((x, x / 2), (x + 1, (x + 1) / 2), (x + 0.8, x / 2 + 0.9), (x - 0.2, x / 2 + 0.4))
        blocks.append(af.Block(corners, af.STONE, f"{x}", part="wall", role="pier"))
    soft, stiff = (replace(af.masonry.STONE_TO_STONE, normal_stiffness=k * 1e9) for k in (1, 2))
    law = lambda one, other: soft if "1.0" in (one.name, other.name) else stiff  # noqa: E731
    stones = af.masonry.assembled(blocks, law)
    *_, note = describe_margins_at_rest(af.Case.of(BARE), stones)
    assert note == (
        "note: friction decides whether it stands: dry stone has 0.4 to 0.8, and the case gives "
        'none in contacts."stone to stone"'
    )


@pytest.mark.parametrize(
    ("tables", "left_out"),
    [
        ({}, ""),
        ({"assessment": {"passive": True}}, ""),  # a tie, which other results name
        ({"assessment": {}}, ", without the loads of [assessment]"),
        ({"assessment": {}, "limit": {}}, ", without the loads of [assessment] and limit.dead"),
    ],
)
def test_lines_on_what_is_at_rest_say_which_loads_they_leave_out(tables, left_out):
    """A constant thrust of 1 kN at the top of two stones of 14.4 kN each, which alone have none."""
    thrust = {"force": ["1 kN", "0 kN"], "point": ["0 m", "2.4 m"], "block": "block 2"}
    given = {name: {"loads": [thrust | own]} for name, own in tables.items()}
    if "limit" in given:
        given["limit"] = {"horizontal": 1.0, "dead": [{"x": "0 m", "force": ["1 kN", "0 kN"]}]}
    case = af.Case.of({**BARE, "model": {"fidelity": "rigid"}, **given})
    friction, depth = describe_margins_at_rest(case, case.structure)
    assert (
        friction
        == f"as rigid blocks it stands from a coefficient of friction of 0.05 or less{left_out}"
    )
    assert depth.startswith("geometric factor of safety at rest, without crushing: 20 or more")
    assert depth.endswith(f"under the same weight{left_out}")


def test_courses_of_other_weights_state_equal_defaults_once(tmp_path):
    """A wall of courses 4, 3 and 2 m long across its plane: three materials of one stone."""
    blocks = [af.Block(((0, -1), (4, -1), (4, 0), (0, 0)), af.STONE, "ground", fixed=True)]
    for level, left in enumerate((0.0, 0.5, 1.0)):
        corners = ((left, level), (4 - left, level), (4 - left, level + 1), (left, level + 1))
        blocks.append(af.Block(corners, af.STONE, f"{level}", part="wall", role="pier"))
    wall = af.masonry.assembled(blocks, af.Contact(1e9, 4e8, friction=0.6), width=0.5)
    whole = af.masonry.columns_across(wall)["whole"]
    assert [x.material.unit_weight for x in whole.blocks[1:]] == [20e3, 15e3, 10e3]
    case = af.Case.read(af.Analysis(whole, fidelity="rigid").write(tmp_path / "whole.toml"))
    values = "'stone' weight 20 kN/m³, strength 56 MPa;"
    assert describe_defaults(case).startswith(f"defaults, where the case gives no value: {values}")
    assert describe_defaults(case).count("strength 56 MPa") == 1
    assert "stand" not in _describe_extent(case.structure)


@pytest.mark.parametrize("key", ["backing", "backing_height"])
def test_a_given_backing_has_no_default_of_the_other_key_but_a_strength(key):
    limit = {"horizontal": 1.0, "fill": {"friction_angle": 30.0, key: 0.5}}
    listed = [*list_fill_values(af.Case.of({**BARE, "limit": limit}))]
    strength = "limit.fill.backing_strength", "1 MPa", False
    of_backing = [row for row in listed if "backing" in row[0]]
    assert of_backing == [(f"limit.fill.{key}", "0.5 m", True), strength]
    del limit["fill"][key]
    listed = [*list_fill_values(af.Case.of({**BARE, "limit": limit}))]
    of_backing = [row for row in listed if "backing" in row[0]]
    assert of_backing == [("limit.fill.backing", "none", False)]


def test_forces_that_a_run_leaves_out_are_doubted_once():
    """A thrust of 5 kN in both sections, and a tie; a mass is no force to be left out."""
    thrust = {"block": "block 1", "point": [-0.3, 1.0], "force": [4e3, -3e3]}
    loads = [thrust, thrust | {"force": [-9e3, 0.0], "passive": True}]
    loads.append({"block": "block 1", "point": [0.0, 1.0], "weight": 1e3})
    limit = {"horizontal": 1.0, "dead": [{"x": -0.3, "y": 1.0, "force": [4e3, -3e3]}]}
    rigid = {"model": {"fidelity": "rigid"}, "assessment": {"loads": loads}, "limit": limit}
    shaken = {"motion": {"synthetic": {"seed": 1, "duration": 4.0, "pga": 1.0}}}
    for motion in ({}, shaken):
        case = af.Case.of({"structure": COLUMN, **rigid, **motion})
        at_rest = af.cases.DeadLoadResult.of(case)
        said = [str(doubt) for doubt in at_rest.doubts if "left out of runs" in str(doubt)]
        words = "left out of runs, which have no loads but weights: 5 kN at x = -0.3 m, the tie at "
        words += "block 1; a limit analysis or an assessment counts it"
        assert said == [words] * bool(motion)
