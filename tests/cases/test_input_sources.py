"""Sources of inputs, which the case states under [report.sources]."""

import tomllib
from copy import deepcopy

import pytest

import archfem as af
from archfem.cases.case import case_of
from archfem.cases.report.inputs import compare_inputs, tabulate_inputs
from archfem.cases.report.report_data import ReportData

CASE = """
title = "a ring"
[structure]
shape = "circular_arch"
radius = "2.95 m"
thickness = "0.55 m"
embrace = "159 degree"
voussoirs = 9
width = "1 m"
[materials.stone]
strength = "3 MPa"
unit_weight = "24 kN/m**3"
[model]
fidelity = "rigid"
[analysis]
damping = { modes = "effective", ratio = 0.02 }
[motion]
scale = 1.5
synthetic = { seed = 3, duration = "2 s", pga = "0.2 g" }
"""

SOURCES = {
    "structure": "survey of May 2026",
    "structure.thickness": "cores, (3 of them)",
    "materials.stone": "tables",
    'materials."stone".strength': "assumed, no test",
    "motion.scale": "by the client",
    "motion.synthetic.pga": "hazard map",
    "analysis.damping.ratio": "a test",
}


def tables_with(sources, **changes):
    """Tables of the ring, with sources of its inputs."""
    return {**tomllib.loads(CASE), **changes, "report": {"sources": sources}}


def marks_of(tables):
    """Mark of each row of the inputs."""
    return {row[0]: row[2] for row in tabulate_inputs(ReportData(af.Case.of(tables), {})).rows}


def test_a_source_stands_beside_the_mark_of_what_is_given_at_or_below_its_key():
    """The longest key counts; a default has no source, nor has what follows from others."""
    plain, marks = marks_of(tomllib.loads(CASE)), marks_of(tables_with(SOURCES))
    expected = {
        **dict.fromkeys(("shape", "radius", "embrace", "voussoirs", "width"), "survey of May 2026"),
        "thickness": "cores, (3 of them)",
        "stone: strength": "assumed, no test",
        "stone: weight": "tables",
        "scale of the motion": "by the client",
        # the row has the whole table
        "motion, synthetic": "pga: hazard map",
        "damping": "a test",
    }
    defaults = ("gravity", "stone: E", "motion, synthetic", "damping, joints")
    assert {plain[name] for name in defaults} == {"default"}
    found = {name: mark for name, mark in marks.items() if mark != plain[name]}
    # of the rows of the synthetic motion the last has its defaults
    rows = tabulate_inputs(ReportData(af.Case.of(tables_with(SOURCES)), {})).rows
    made = [row[2] for row in rows if row[0] == "motion, synthetic"]
    assert made == ["given (pga: hazard map)", "default"]
    del expected["motion, synthetic"]
    assert found == {name: f"given ({text})" for name, text in expected.items()}


def test_a_source_of_a_key_without_a_row_has_a_row_of_its_own():
    """Of results that are not in the report, and of a table whose keys have other sources."""
    sources = {"limit.friction": "tilt test", "model": "as agreed", "model.fidelity": "the client"}
    tables = tables_with(sources | {"output": "none"}, limit={"friction": "coulomb"}, output={})
    rows = tabulate_inputs(ReportData(af.Case.of(tables), {})).rows
    assert [tuple(row) for row in rows[-3:]] == [
        ("limit.friction", "coulomb", "given (tilt test)"),
        ("model", "fidelity rigid", "given (as agreed)"),
        ("output", "-", "given (none)"),
    ]
    assert ("fidelity", "rigid", "given (the client)") in rows
    assert sum("given (" in row[2] for row in rows) == len(sources) + 1


def test_the_inputs_say_that_python_may_have_given_what_is_marked_a_default():
    """An analysis does not know which of its values were given."""
    column = af.column(breadth=1.0, heights=[1.0])
    given = af.Analysis(column, fidelity="rigid", criteria=af.Criteria(failures=4))
    plain = af.Analysis(column, fidelity="rigid")
    tables = [tabulate_inputs(ReportData(case_of(each), {})) for each in (given, plain)]
    assert tables[0] == tables[1]
    assert "Default: archfem's, since the case does not, or Python was given the same" in str(
        tables
    )


def test_pairs_of_a_suite_have_their_sources_in_the_row_of_all():
    pairs = {name: {"synthetic": {"seed": k}} for k, name in enumerate(("first", "the 2nd"), 1)}
    tables = tables_with({"suite.pairs.the 2nd": "Amatrice", "suite.pairs.first": "Norcia"})
    del tables["motion"]
    mark = marks_of(tables | {"suite": {"pairs": pairs}})["motions"]
    assert mark == 'given ("the 2nd": Amatrice; first: Norcia)'


def test_materials_with_sources_of_their_own_have_rows_of_their_own(unlike_weights):
    """Which stand in one row else, as stones that stand also for a wall."""
    tables = tables_with({}, **unlike_weights)
    assert marks_of(tables)["m1 and 2 more: weight"] == "given"
    tables["report"]["sources"] = {"materials.m2.unit_weight": "weighed"}
    marks = marks_of(tables)
    assert marks["m1 and 1 more: weight"] == "given"
    assert (marks["m2: weight"], marks["m2: E"]) == ("given (weighed)", "given")


def test_cases_that_differ_in_a_source_show_it_in_their_columns():
    other = tables_with({**SOURCES, "structure.thickness": "drawing"})
    parts = {
        label: ReportData(af.Case.of(tables), {})
        for label, tables in (("A", tables_with(SOURCES)), ("B", other))
    }
    same, differing = compare_inputs(parts)
    ends = "0.55 m (given: cores, (3 of them))", "0.55 m (given: drawing)"
    assert [tuple(row) for row in differing.rows] == [("thickness", *ends)]
    assert ("radius", "2.95 m", "given (survey of May 2026)") in same.rows


def test_more_cases_than_a_page_is_broad_have_a_row_for_each_value():
    tables = {label: tables_with({}) for label in "ABCDE"}
    tables["B"]["structure"] = tables["D"]["structure"] = {**tables["B"]["structure"], "width": 2.0}
    data = {label: ReportData(af.Case.of(each), {}) for label, each in tables.items()}
    _, differing = compare_inputs(data)
    first = f"{data['A'].case.structure.width:g} m"
    assert [row[2] for row in differing.rows if row[1].startswith((first, "2 m"))] == [
        "A, C and E",
        "B and D",
    ]


def test_inputs_of_one_case_alone_stand_in_a_table_without_columns_of_the_others():
    cases = {label: tables_with({}) for label in "ABC"}
    del cases["A"]["motion"], cases["B"]["motion"]
    cases["B"]["model"] = {"fidelity": "rigid", "quadrature": "lobatto"}
    data = {label: ReportData(af.Case.of(tables), {}) for label, tables in cases.items()}
    same, several, alone = compare_inputs(data)
    assert [row[0] for row in several.rows] == ["quadrature"]
    assert {row[0] for row in alone.rows} == {"C"}
    own = {row[0] for row in tabulate_inputs(data["C"]).rows}
    rows = {row[1] for row in alone.rows}, {row[0] for row in same.rows}, {"quadrature"}
    assert own == set.union(*rows)
    assert sum(map(len, rows)) == len(own)
    assert ("C", "scale of the motion", "1.5", "given") in alone.rows
    # cases that are alike need one table
    assert [each.caption for each in compare_inputs({"A": data["A"], "B": data["A"]})] == [
        same.caption
    ]


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("structure.thicknes", "'structure.thicknes': did you mean 'thickness'?"),
        ("material.stone", "'material': did you mean 'materials'?"),
        ("materials.stone.young", "'materials.stone.young': the keys are"),
        ("structure.radius.mean", "'structure.radius.mean': the keys are []"),
    ],
)
def test_a_source_of_no_key_of_the_case_is_refused(key, words, tmp_path):
    path = tmp_path / "ring.toml"
    path.write_text(f"{CASE}[report.sources]\n{key!r} = 'survey'\n", encoding="utf-8")
    with pytest.raises(af.InvalidInput) as refused:
        af.Case.read(path)
    assert str(refused.value).startswith(f"{path}: report.sources: unknown key {words}")
    case = af.Case.of(tomllib.loads(CASE))
    with pytest.raises(af.InvalidInput, match=r"report\.sources: unknown key"):
        case.signed([f'report.sources."{key}"=survey'])
    signed = case.signed(['report.sources."structure.radius"=survey'])
    assert signed.report["sources"] == {"structure.radius": "survey"}


def test_a_source_is_a_text_under_a_key_in_quotes():
    with pytest.raises(af.InvalidInput, match=r'sources\.structure is a dict: .*"a\.b" = "…"'):
        af.Case.of(tables_with({"structure": {"radius": "survey"}}))


def test_sources_change_no_result_and_are_written_with_the_case(tmp_path):
    plain, case = af.Case.of(tomllib.loads(CASE)), af.Case.of(tables_with(SOURCES))
    assert case.hash_inputs() == plain.hash_inputs()
    assert case.analysis == plain.analysis
    path = tmp_path / "ring.toml"
    path.write_text(case.text(), encoding="utf-8")
    again = af.Case.read(path)
    assert again.settings == case.settings
    assert again.report["sources"] == SOURCES


def test_results_of_a_drawing_keep_the_sources_of_its_keys(tmp_path):
    """Results have its blocks in place of its file, and can be read as a case, too."""
    af.masonry.write_outlines(af.column(breadth=1.0, heights=[1.0]), tmp_path / "pier.geojson")
    drawn = {"shape": "outlines", "file": "pier.geojson"}
    tables = tables_with({"structure.file": "laser scan"}, structure=drawn)
    path = tmp_path / "pier.toml"
    path.write_text(af.Case.of(deepcopy(tables), tmp_path).text(), encoding="utf-8")
    case = af.Case.read(path)
    assert "file" not in case.settings["structure"]
    assert case.report["sources"] == {"structure.file": "laser scan"}
    assert case.signed(["report.author=me"]).report["author"] == "me"
