"""Reports: they contain all files of the folder, and leave out what was not computed."""

import base64
import logging
import re
import shutil
import tomllib
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from pages import head_of, read_page
from portals import portal

import archfem as af
from archfem._files import read_file_list, replace_results, write_sealed_json
from archfem.cases import answers, result_text
from archfem.cases.defaults import describe_defaults, list_defaults
from archfem.cases.push_factors import PushFactors
from archfem.cases.report import capacities, conclusion, report, report_data
from archfem.cases.report.conclusion import build_conclusion, list_facts
from archfem.cases.report.inputs import tabulate_inputs
from archfem.cases.report.response import (
    _tabulate_joints,
    build_ground_section,
    supported_weight_ratio,
)
from archfem.cases.report.sections import (
    _build_rating,
    build_input_section,
    build_sections,
    build_structure_section,
)
from archfem.cases.result_text import ResultTable
from archfem.cases.run import carry_out, replace_run
from archfem.cases.structure_keys import write_structure
from archfem.limit import rating
from archfem.limit.vehicles import cut_road
from archfem.models.model import Doubt
from archfem.statics.assessment_checks import UPPER_BOUND, AssessmentCheck
from archfem.studies.fragility import Rate
from archfem.units import format_mm
from archfem.view.pages.document import FigureBlock
from archfem.view.style import write_files

CASE = """
title = "a column <b>& more</b> under two pairs"
[structure]
shape = "column"
breadth = 1.0
heights = [1.0, 1.0]
[model]
fidelity = "rigid"
[suite]
name = "small"
reduction = 2.0
[suite.pairs]
first = { synthetic = { seed = 1, duration = 1.0, pga = 1.0 } }
second = { synthetic = { seed = 2, duration = 1.0, pga = 1.0, vertical_ratio = 0.0 } }
[record]
fields_every = 10
"""

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR42mNkYAAAAAYAAjCB0C8AAAAASUVORK5CYII="
)


@pytest.fixture(scope="module")
def carried_out(tmp_path_factory):
    """Folder of a suite of two pairs, with the files that a report reads."""
    folder = tmp_path_factory.mktemp("suite")
    case = af.Case.of(tomllib.loads(CASE))
    with replace_run(case, folder) as draft:
        list(carry_out(case, draft))
    return folder


@pytest.fixture
def kept(carried_out, undrawn, tmp_path):
    """A copy of it."""
    return Path(shutil.copytree(carried_out, tmp_path / "out"))


@pytest.mark.slow
def test_a_suite_has_a_report_with_a_player_for_each_pair(kept, capsys):
    with replace_results(kept, "modes", read_file_list(kept)["run"].inputs) as draft:
        (draft / "modes.txt").write_text("mode 1 at 3.14 Hz")
    page, every = kept / "page.html", ["--set", "report.pairs=all"]
    assert af.commands.main(["report", str(kept), "--out", str(page), *every]) == 0
    assert f"wrote {page}" in capsys.readouterr().out
    read = read_page(page.read_text(encoding="utf-8"))
    words = " ".join(read.words)
    assert [scene["title"].split(": ")[1] for scene in read.scenes] == ["first", "second"]
    assert all(scene["note"] == "" for scene in read.scenes)
    assert "a column <b>& more</b> under two pairs" in words
    assert "mode 1 at 3.14 Hz" in words
    assert "Ground motions" in words
    assert "Not among the results" not in words
    assert "Not computed" not in words
    assert "It survives: it forms no mechanism under all 2 motions of PGA 0.05 g" in words
    assert "Measures of the motions as applied, at their own samples" in words
    assert "The checks of the numbers raise no doubt. Lengths, stiffness, friction" in words
    assert ", damping, size of the motions, time step and fidelity were not varied; displ" in words
    assert "another case" not in words
    case = af.Case.read(kept / "case.toml")
    digest = sha256(case.signed(["report.pairs=all"]).text().encode()).hexdigest()
    assert digest in words
    # the digest and the table of inputs stand in place of the file, which is beside the report
    assert "case.toml" in words
    assert "[structure]" not in words
    assert "1.0000 of the weight" in words
    run = af.History.read(kept / "first" / "history.nc", case.structure)
    assert f"{float(run.joints['friction'].max()):.3f}" in words


# Of the second check, the ratio that decides and the other
APART = "0.45 (0.5 with the weights apart)"
CHECKS = [
    AssessmentCheck("linear, q = 2, FC = 1.35", 8.212, 2.844, "m/s²", 8.212 / 2.844, np.nan, ""),
    AssessmentCheck("a code", 0.11, 0.22, "m", 0.5, 1.178, "", bodies=0.45),
]


def state_each(hazard):
    """Statements by command and file, of results that were made up."""
    assessed = SimpleNamespace(checks=CHECKS, direction=1.0, notes=("faces slide flat",))
    whole = replace(CHECKS[1], capacity=0.099, ratio=0.45, bodies=None)
    assessed.of_bodies = SimpleNamespace(checks=[CHECKS[0], whole])
    assessed.doubts = (Doubt("it is {}", "compare it with a run", (UPPER_BOUND,)),)
    place = "passes without all, with 2 axles at -0.1, 1.1 m"
    found = SimpleNamespace(hazard=hazard, doubts=(), sentence="falls at 0.002 a year")
    found.rate = lambda: Rate(0.002, 0.001, 0.003)
    found.fragility = lambda: SimpleNamespace(median=6.0)
    vehicle = answers.Row("rating", "LM1", place, "1.25", {"passes": True, "least": 1.25})
    doubts = [Doubt("a made one", "mend it")]
    factors = PushFactors(4.8, 4.8)
    turns = "it turns, at 4.8 times the load", doubts, "the given load", factors
    return {
        ("limit", "limit"): answers.state_outcome("limit analysis", *turns),
        ("rate", "rating"): answers.Statement(["rated"], [vehicle]),
        ("assess", "assessment"): answers.state_assessments(
            {"right": assessed, "left": assessed}, []
        ),
        ("risk", "risk"): answers.state_risk(found),
    }


def write_stated(folder, hazard):
    """Write the files of these to a result folder."""
    inputs = read_file_list(folder)["run"].inputs
    for (command, name), stated in state_each(hazard).items():
        with replace_results(folder, command, inputs) as draft:
            write_files({f"{name}.txt": "its text", **stated.as_file(name)}, draft)


def test_demand_and_capacity_stand_beside_their_doubts(kept, undrawn):
    write_stated(kept, af.Hazard.from_return_periods({475.0: 3.0, 2475.0: 8.0}))
    found = af.cases.open_results(kept)
    case = found.case.signed(["report.demand=0.25 g, 475 years", "report.author=A. Mason"])
    case = replace(case, limit=replace(case.limit, strength=2e7))
    data = report_data.ReportData(case, found.runs, found.folder)
    *sentences, signatures = build_conclusion(data).pieces
    assumed = dict(build_input_section(data).pieces[1].rows)
    assert "no crushing" not in assumed["joints"]
    assert assumed["joints"].endswith("crushing in limit analysis and assessments alone, at 20 MPa")
    demands, table = (each for each in sentences if each.kind == "grid")
    vertical = "with vertical ones of up to 0.034 g"
    assert demands.rows == [
        ("as stated", "0.25 g, 475 years", "[report]", "words alone, which are compared with none"),
        (f"motions, {vertical}", "PGA 0.051 g", "[suite]", demands.rows[1][-1]),
    ]
    verdicts = [run.verdict for run in data.runs.values()]
    sizes = np.max([[each.displacement, each.residual] for each in verdicts], axis=0)
    moved = "up to {} under 'second', {} at the end under 'first'".format(*map(format_mm, sizes))
    worst = [
        max(data.runs, key=lambda x, name=name: getattr(data.runs[x].verdict, name))
        for name in ("displacement", "residual")
    ]
    assert worst == ["second", "first"]  # of two runs
    assert table.rows == [
        (
            "time histories",
            "2 motions, PGA 0.05 g",
            f"no mechanism in 2 of 2 runs; displaced by {moved}",
            "-",
        ),
        ("limit analysis", "the given load", "it turns, at 4.8 times the load (in doubt)", "4.8"),
        ("rating", "LM1", "passes without all, with 2 axles at -0.1, 1.1 m", "1.25"),
        *(
            (
                f"assessment: {name}, right and left",
                f"{demand} of the spectrum of the motion",
                # an upper bound on what fails raises no doubt about it
                capacity if "fails" in capacity else f"{capacity} (in doubt)",
                factor,
            )
            for name, demand, capacity, factor in (
                ("linear, q = 2, FC = 1.35", "2.844 m/s²", "8.212 m/s², passes", "2.89"),
                # of the factor that decides
                ("a code", "0.22 m", "0.099 m with one weight a body, fails", APART),
            )
        ),
        (
            "annual rate",
            "PGA 3, 8 m/s² once in 475, 2475 years",
            "median PGA 6 m/s², falls at 0.002 a year",
            "2 on 475 years, 0.75 on 2475 years",
        ),
    ]
    texts = [each.text for each in sentences if each.kind == "words"]
    leads = ["What would change the answer?", "Across its plane?"]
    assert [each.lead for each in sentences if each.kind == "words"][:2] == leads
    facts = dict(list_facts(data))  # the head has the margin, and nothing has it again
    assert (
        "The least margin is 0.45 (0.5 with the weights apart), on the spectrum of the motion, by "
        "a code, which it fails."
    ) in facts["margin"]
    assert texts[:1] == [
        "The doubts below, on limit analysis, may change this. Lengths, "
        "stiffness, friction, damping, time step and fidelity "
        "were not varied; displacements have no range.",
    ]
    assert texts[1:] == [
        "Nothing is checked across the plane of the drawing. If that is the section of a wall, it "
        "is checked across its own plane here, and in it by a case of its own.",
        "In doubt, limit analysis: A made one.",
        "Note, kinematic assessment: It is an upper bound.",
        "Note, kinematic assessment: Faces slide flat.",
    ]
    assert facts["in doubt"] == "limit analysis"
    failed = (
        "By the kinematic assessment on the spectrum of the motion it fails by displacements "
        "(0.45), passes by the linear check (2.89). No clause that was read says which governs."
    )
    rate = "Annual rate: median PGA 6 m/s², falls at 0.002 a year."
    unchecked = "Perpendicular to this section, as along a wall, it was not checked."
    rest = "Rating for LM1: factor 1.25, passes without all. Worst with 2 axles at -0.1, 1.1 m. "
    but = "Under its motions it survives: it forms no mechanism under all 2 motions"
    assert head_of(facts.items()).startswith(f"{failed} {but}")
    default = "The stiffness of joints is a default: measured ones differ tenfold."
    assert head_of(facts.items()).endswith(f"No property was varied. {default} {unchecked}")
    # the head has the least margin first
    assert f" {rest}{rate} The least margin is 0.45 (0.5 with the" in head_of(facts.items())
    assert " which it fails. From which acceleration" in head_of(facts.items())
    alone = report_data.ReportData(case, {}, found.folder)
    given, _, margin = build_conclusion(alone).pieces[:3]
    assert given.rows == demands.rows[:1]
    turns = "it turns, at 4.8 times the load"
    assert margin.text.startswith("The least margin is 0.45 (0.5 with the weights apart), on the ")
    facts = dict(list_facts(alone))
    assert head_of(facts.items()).startswith(
        f"{failed} Limit analysis: {turns}, at 4.8 times the given"
    )
    assert rest in head_of(facts.items())
    # [suite] is in the case; its motions are those of the rate
    for ends in (
        "may change this. Lengths and friction were not varied.",
        "not varied. No motion was run, though [suite] is in the case.",
    ):
        leads = {getattr(x, "lead", ""): x for x in build_conclusion(alone).pieces}
        assert leads["What would change the answer?"].text.endswith(ends)
        alone.statements.pop("risk", None)
    assert {("assessment: q", "2 (Circolare 7/2019, C8.7.1.2.1.7)", "default")} < {
        tuple(row) for row in build_input_section(alone).pieces[0].rows
    }
    titles = {section.title for section in build_sections(data)}
    assert {*conclusion.SECTIONS.values()} - titles <= {
        *("Response", "Pushover", "Scale of the motion", "Range over uncertain properties"),
        *("Least thickness", "Study of many cases"),
    }
    assert signatures.rows == [("author", "A. Mason", "", ""), ("checked by", "", "", "")]


@pytest.mark.parametrize(("ag", "noted"), [(0.03, True), (0.045, False)])
def test_a_margin_names_its_spectrum_which_may_be_another_demand(kept, undrawn, ag, noted):
    """Motions of PGA 0.05 g beside spectra of 1.15 a_g."""
    write_stated(kept, af.Hazard.power(0.02116, 3.0))
    found = af.cases.open_results(kept)
    tables = {**found.case.settings}
    tables["assessment"] = {"spectrum": {"code": "EC8", "ag": ag, "ground": "C"}}
    data = report_data.ReportData(af.Case.of(tables), found.runs, found.folder)
    pieces = build_conclusion(data).pieces
    given, table = (each for each in pieces[:-1] if each.kind == "grid")
    spectrum = f"the EC8 spectrum of PGA {1.15 * ag:.3g} g"
    demands = [row[1] for row in table.rows if row[0].startswith("assessment")]
    assert demands == [f"{own} of {spectrum}" for own in ("2.844 m/s²", "0.22 m")]
    margin = dict(list_facts(data))["margin"]
    assert f"The least margin is {APART}, on {spectrum}, by a code, wh" in margin
    demands = [row[:3] for row in given.rows]
    assert ("EC8 spectrum", f"PGA {1.15 * ag:.3g} g", "[assessment]") == demands[1]
    assert ("; a margin on one is none on another" in given.caption) == noted


def test_a_rate_is_stated_beside_the_hazard_at_its_return_periods():
    """Of a law, and of a curve of many points, the intensities of return periods of codes."""
    law, points = af.Hazard.power(0.02116, 3.0), 1.0 + np.arange(6.0)
    for site, demand in (
        (law, "PGA 2.16, 3.74 m/s² once in 475, 2475 years"),
        (af.Hazard(points, law.rate_of(points)), "PGA 2.16 m/s² once in 475 years"),
    ):
        (row,) = state_each(site)["risk", "risk"].rows
        assert (row[1], row[3][:4]) == (demand, "2.78")


def test_a_check_that_passes_at_rest_says_so():
    resting = replace(CHECKS[1], ratio=1.5, bodies=None)
    found = SimpleNamespace(checks=[resting], direction=1.0, notes=(), doubts=())
    (row,) = answers.state_assessments({"right": found}, []).rows
    outcome = "0.11 m, passes, for the mechanism does not begin to move"
    factor = "1.5 until it moves (0.5 by displacements)"
    assert row[:4] == ("assessment: a code, right", "0.22 m", outcome, factor)
    expected = answers.Ratios("a code", ["right"], 1.5, 1.5, moved=0.5, displaced=0.11 / 0.22)
    assert answers.Ratios(**row.numbers) == expected


def test_a_check_of_the_strip_alone_is_named_by_it():
    strip = "strip through the highest place"
    check = answers.Ratios("linear", [f"right, {strip}", f"left, {strip}"], 0.4, 0.4)
    assert check.name == f"linear, {strip}"
    assert check._replace(directions=["right", "left"]).name == "linear"


def test_displacements_until_it_moves_are_of_the_split_of_weights_that_decides():
    """They are the quotient of the capacity and the demand that the table shows."""
    ring = af.circular_arch(radius=2.81, thickness=0.42, embrace=180.0, voussoirs=19, width=3.0)
    spectrum = af.Eurocode8(ag=0.25, ground="B")
    found = af.kinematic_assessment(ring, spectrum)
    (row,) = answers.state_assessments({"right": found}, []).rows[1:]
    capacity, demand = (float(x.split(" m")[0]) for x in (row.outcome, row.demand))
    assert "with one weight a body" in row.outcome
    split = answers.Ratios(**row.numbers)
    assert split.bodies < split.least
    # four digits are shown
    assert split.moved == pytest.approx(capacity / demand, rel=2e-4)


def test_capacity_is_that_of_the_ratio_with_all_weight_in_motion_where_it_decides():
    check = replace(CHECKS[0], capacity=10.0, demand=2.5, ratio=4.0, floor=3.0, bodies=3.5)
    found = SimpleNamespace(checks=[check], direction=1.0, notes=(), doubts=(), of_bodies=None)
    (row,) = answers.state_assessments({"right": found}, []).rows
    factor = "3 with e* = 1 (3.5 of the mechanism found, 4 with the weights apart)"
    assert row[1:4] == ("2.5 m/s²", "7.5 m/s², passes", factor)


def test_results_of_another_case_are_named_and_not_stated(kept, undrawn):
    write_stated(kept, af.Hazard.power(0.02116, 3.0))
    with replace_results(kept, "limit", "other") as draft:
        stated = state_each(af.Hazard.power(0.02116, 3.0))["limit", "limit"]
        text = "limit analysis: it turns, at 0.25 g to the left"
        write_files({"limit.txt": text, **stated.as_file("limit")}, draft)
    found = af.cases.open_results(kept)
    data = report_data.ReportData(found.case, found.runs, found.folder)
    pieces = build_conclusion(data).pieces
    texts = [each.text for each in pieces if each.kind == "words"]
    assert not any("turns" in text for text in texts)
    (table,) = (each for each in pieces[:-1] if each.kind == "grid")
    assert [row[0] for row in table.rows] == [
        *("time histories", "rating"),
        *(f"assessment: {check.name}, right and left" for check in CHECKS),
        "annual rate",
        "limit analysis",
    ]
    assert table.rows[-1][2:] == (
        "not stated, for its case, drawing or version of archfem is another: run `archfem limit`, "
        "or `archfem run`, again with the same `--set`",
        "-",
    )


def test_a_result_of_one_pair_of_another_case_is_named_beside_that_of_the_others(kept, undrawn):
    for pair, inputs in (("first", read_file_list(kept)["run"].inputs), ("second", "other")):
        with replace_results(kept, f"scale --pair {pair}", inputs) as draft:
            (draft / pair).mkdir()
            stated = answers.state_outcome("scale of the motion", f"{pair} stands")
            files = {"scale.txt": pair, **stated.as_file("scale")}
            write_files({f"{pair}/{name}": text for name, text in files.items()}, draft)
    found = af.cases.open_results(kept)
    data = report_data.ReportData(found.case, found.runs, found.folder)
    (table,) = capacities.tabulate_capacities({"": data})
    said = [row[2] for row in table.rows if row[0] == "scale of the motion"]
    assert said[0] == "first stands"
    assert "run `archfem scale --pair second`, or" in said[1]
    assert len(said) == 2


def test_missing_pairs_are_named_and_different_cases_refused(kept, unplotted):
    (kept / "second" / "history.nc").unlink()
    found = af.cases.open_results(kept)
    assert (list(found.runs), found.missing) == (["first"], ("second",))
    assert found.player().scene.run is found.runs["first"]
    with pytest.raises(af.InvalidInput, match=r"no run 'third': there are \['first'\]"):
        found.player("third")
    assert found.report() == kept / "report.html"
    words = " ".join(read_page((kept / "report.html").read_text(encoding="utf-8")).words)
    assert "Not among the results: runs of second" in words
    text = (kept / "case.toml").read_text()
    (kept / "case.toml").write_text(text.replace("reduction = 2.0", "reduction = 3.0"))
    with pytest.raises(af.InvalidInput, match=r"case\.toml is not the file that archfem wrote"):
        af.cases.open_results(kept)


def test_folders_that_hold_no_results_are_refused(kept, tmp_path):
    with pytest.raises(af.InvalidInput, match="there is no folder"):
        af.cases.open_results(tmp_path / "nowhere")
    with pytest.raises(af.InvalidInput, match=r"has no case.toml.*run the case again"):
        af.cases.open_results(tmp_path)
    with pytest.raises(af.InvalidInput, match="of one pair of a suite; give the suite's folder"):
        af.cases.open_results(kept / "first")
    (kept / "empty").mkdir()
    shutil.copytree(kept / "first", tmp_path / "alone")
    for other in (kept / "empty", tmp_path / "alone"):
        with pytest.raises(af.InvalidInput, match=r"has no case.toml.*run the case again"):
            af.cases.open_results(other)
    (tmp_path / "study.json").write_text("{}")
    with pytest.raises(af.InvalidInput, match="it is of a study"):
        af.cases.open_results(tmp_path)
    (tmp_path / "case.toml").write_text("title = ")
    with pytest.raises(af.InvalidInput, match="is not TOML"):
        af.cases.open_results(tmp_path)
    drawing = '[structure]\nshape = "outlines"\nfile = "stones.geojson"\n'
    (tmp_path / "case.toml").write_text(drawing)
    with pytest.raises(af.InvalidInput, match=r"case\.toml: .*stones\.geojson"):
        af.cases.open_results(tmp_path)


def test_a_run_in_memory_has_a_report_and_a_player(small, unplotted, undoubted, tmp_path):
    case = af.Case.read(small, ["analysis.damping={ratio=0.05, frequency=5.0}"])
    *_, run = af.cases.run_case(case, pairs=["first"])
    words = " ".join(read_page(run.report(tmp_path / "run.html").read_text()).words)
    assert "damping 5 % of critical given damping, joints closed default" in " ".join(words.split())
    assert "5 Hz, proportional to stiffness" in words
    assert "contains the largest displacement alone" in run.player().scene.data["note"]
    assert "Ground motions" not in words
    assert "The run is not complete" not in words
    data = report_data.ReportData(case, {"first": run.history})
    assert data.dead["N"].values.tolist() == run.history.joints["N"][0].values.tolist()
    assert (
        report_data.ReportData(case, {"first": run.history}, tmp_path).files == {}
    )  # none were written


def test_a_history_has_a_report_and_a_player_too(kept, unplotted, tmp_path):
    """By the case that it keeps; one of a model made in Python has a player alone."""
    run = af.History.read(kept / "first" / "history.nc")
    run.dataset.attrs["title"] = "of another name: second"  # `motion` alone names what it ran
    words = " ".join(read_page(run.report(tmp_path / "run.html").read_text()).words)
    assert "a column <b>& more</b> under two pairs" in words
    assert run.dataset.attrs["motion"] == "first"
    assert "runs of first" not in words
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid")
    alone = af.time_history(model, af.Motion(np.array([0.0, 0.1, 0.0]), 0.01), dt=0.01)
    with pytest.raises(af.InvalidInput, match="keeps no case to report on"):
        alone.report(tmp_path / "none.html")
    assert "<iframe" in alone.player()._repr_html_()


def test_a_case_without_motion_has_a_report_too(small, unplotted, tmp_path):
    case, folder = (
        af.Case.of(tomllib.loads(small.read_text().split("[suite]")[0])),
        tmp_path / "out",
    )
    with replace_run(case, folder) as draft:
        files = {"limit.txt": "it stands", "assessment.txt": "right: it moves"}
        files |= answers.Statement(["it stands"], []).as_file("limit")
        remarks = ["note: faces slide; flat", Doubt("it is so", "run")]
        noted = answers.Statement([], []).with_remarks(remarks)
        write_files(files | noted.as_file("assessment"), draft)
    words = " ".join(read_page(af.cases.open_results(folder).report().read_text()).words)
    assert "It stands." in words  # the conclusion
    assert "Note, kinematic assessment: Faces slide; flat." in words
    assert "In doubt, kinematic assessment: It is so." in words
    assert "blocks rigid joints dry" in " ".join(
        words.split()
    )  # of limit analysis, whatever the case's model is
    # sections that would only say what is missing are left out
    for title in ("Dead load", "Ground motion", "Response", "Modes", "Mechanism and collapse"):
        assert title not in words


def test_supports_bear_the_weight(ring, caplog):
    caplog.set_level(logging.ERROR)
    rest = af.dead_load(af.build(ring, fidelity="rigid"))
    assert supported_weight_ratio(ring, rest.joints) == pytest.approx(1.0, abs=1e-9)
    half = rest.joints.assign(N=0.5 * rest.joints["N"], V=0.5 * rest.joints["V"])
    assert supported_weight_ratio(ring, half) == pytest.approx(0.5, abs=1e-9)
    # large displacements turn the springings
    arch = af.shapes.pointed_arch(span=5.2, rise=3.4, thickness=0.42, voussoirs=8)
    rest = af.dead_load(af.build(arch, fidelity="rigid", displacements="large"))
    assert supported_weight_ratio(arch, rest.joints) < 0.99995
    assert supported_weight_ratio(arch, rest.joints, large=True) == pytest.approx(1.0, abs=1e-6)


def test_a_report_of_a_history_is_of_its_pair_or_its_motion(kept, monkeypatch, tmp_path):
    seen = []
    monkeypatch.setattr(report, "write_report", lambda data, path: seen.append(data))
    run = af.History.read(kept / "first" / "history.nc")
    report.write_report_of_history(run, tmp_path / "run.html")
    assert (list(seen[0].runs), seen[0].missing) == (["first"], ())
    lines = CASE.splitlines()
    of_a_motion = [*lines[: lines.index("[suite]")], "[motion]", "synthetic = { seed = 1 }"]
    run.dataset.attrs |= {"case": "\n".join(of_a_motion), "motion": "mine"}
    report.write_report_of_history(run, tmp_path / "run.html")
    assert (list(seen[1].runs), seen[1].missing) == (["mine"], ())


def test_results_are_read_though_a_file_was_deleted(kept):
    """Present files are checked, and missing ones are left out."""
    with replace_results(kept, "modes", read_file_list(kept)["run"].inputs) as draft:
        (draft / "modes.txt").write_text("mode 1 at 3.14 Hz")
    (kept / "modes.txt").unlink()
    assert set(af.cases.open_results(kept).runs) == {"first", "second"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rubble", "own"])
def test_results_need_no_drawing_beside_them(name, unplotted, undoubted, tmp_path, capsys):
    """A pier of a drawing is run, and reported and filmed from a folder that was moved alone."""
    drawing, place = tmp_path / "drawn" / "pier.geojson", tmp_path / "elsewhere"
    drawing.parent.mkdir()
    rubble = replace(af.STONE, name=name, unit_weight=17e3)
    pier = af.column(breadth=0.8, heights=[0.7, 0.9], material=rubble, width=1.1)
    af.masonry.write_outlines(pier, drawing)
    # a material under the name of its table, and one that its table gives another name
    material = {"young": 30e9, "poisson": 0.2, "unit_weight": "17 kN/m**3"}
    tables = {
        "title": "a pier",
        "structure": {"shape": "outlines", "file": drawing.name, "width": 1.1},
        "materials": {name: material},
        "model": {"fidelity": "rigid"},
        "motion": {"synthetic": {"duration": 0.3, "pga": 1.0, "vertical_ratio": 0.0}},
        "record": {"fields_every": 4},
    }
    if name == "own":
        drawing.write_text(drawing.read_text().replace('"own"', '"coarse"'))
        tables["materials"] = {"coarse": material | {"name": "own"}}
    case = af.Case.of(tables, drawing.parent)
    with replace_run(case, tmp_path / "out") as draft:
        list(carry_out(case, draft))
    defaults = describe_defaults(case)
    moved = "pier.geojson, snap 1 mm; drawing: 0.8 × 1.74 m, read in m, corners moved by up to 0 m"
    shutil.rmtree(drawing.parent)
    shutil.move(tmp_path / "out", place)
    found = af.cases.open_results(place)
    assert replace(found.case.structure, name="a pier") == case.structure
    if name == "rubble":  # the words name a material by its table
        assert describe_defaults(found.case) == defaults
    assert af.commands.main(["report", str(place)]) == 0
    assert f"The outlines were read from {moved}" in words_of(place / "report.html")
    if name == "rubble":
        given = ["--out", str(place / "film.gif"), "--size", "480x320", "--fps", "5"]
        assert af.commands.main(["animate", str(place), *given]) == 0
    # and the history alone
    assert af.History.read(place / "history.nc").report(tmp_path / "alone.html").is_file()
    # the case of the folder is one to run
    assert af.Case.read(place / "case.toml").structure.weight == pytest.approx(pier.weight)


def words_of(path):
    """The text of a page."""
    return " ".join(read_page(Path(path).read_text(encoding="utf-8")).words)


def test_who_signs_is_in_the_head_and_changes_no_result(kept, unplotted, capsys):
    given = ["--set", "report.norm=NTC 2018", "--set", "report.author=A. Mason"]
    given += ["--set", "report.version=issue 2"]
    assert af.commands.main(["report", str(kept), *given]) == 0
    words = words_of(kept / "report.html")
    head = words.partition("Conclusion")[0]
    # in the order of a title block, whatever the order in which they are given
    assert 0 < head.index("A. Mason") < head.index("issue 2") < head.index("NTC 2018")
    # the results are those of the case without it
    case = af.Case.read(kept / "case.toml")
    assert case.signed(["report.author=A. Mason"]).hash_inputs() == case.hash_inputs()
    # one history has no folder whose words or studies it could show
    alone = ["report", str(kept / "first" / "history.nc"), "--study", str(kept), *given]
    assert af.commands.main(alone) == 1
    assert "history.nc takes no --set and --study: give the folder" in capsys.readouterr().err
    assert not (kept / "first" / "history.html").exists()
    capsys.readouterr()
    assert af.commands.main(["report", str(kept), "--set", "structure.breadth=2"]) == 1
    assert "'structure.breadth' changes results: run the case again" in capsys.readouterr().err
    assert af.commands.main(["report", str(kept), "--set", "report.pairs=most"]) == 1
    assert 'report.pairs = \'most\' must be "worst" or "all"' in capsys.readouterr().err
    # before the folder is opened, as its histories take their time
    assert af.commands.main(["report", str(kept / "none"), "--set", "report.autor=me"]) == 1
    assert "did you mean 'author'" in capsys.readouterr().err


def test_captions_are_numbered_without_a_gap(carried_out, unplotted, tmp_path):
    words = words_of(af.cases.open_results(carried_out).report(tmp_path / "page.html"))
    for kind in ("Figure", "Table"):
        numbers = [int(number) for number in re.findall(rf"{kind} (\d+)\. [A-Z]", words)]
        assert numbers == list(range(1, len(numbers) + 1))
        assert len(numbers) > 3
    # what was assessed is drawn behind the answer, before the tables of the inputs
    drawn = words.index("Figure 1. The structure, with its assessed joints")
    assert words.index("Demand and capacity") < drawn < words.index("Inputs. Given")


@pytest.mark.slow
def test_a_report_for_word_has_the_sections_of_the_page(
    carried_out, tmp_path, capsys, unplotted, monkeypatch
):
    docx = pytest.importorskip("docx")
    monkeypatch.setattr(FigureBlock, "raster", lambda _: PIXEL)
    path = tmp_path / "report.docx"
    every = ["--set", "report.pairs=all"]
    assert af.commands.main(["report", str(carried_out), "--out", str(path), *every]) == 0
    assert "wrote" in capsys.readouterr().out
    found = docx.Document(str(path))
    headings = [each.text for each in found.paragraphs if each.style.name.startswith("Heading")]
    page = tmp_path / "report.html"
    assert af.commands.main(["report", str(carried_out), "--out", str(page), *every]) == 0
    words = words_of(page)
    assert len(headings) > 5
    # the players are pictures
    captions = [each.text for each in found.paragraphs if each.style.name == "Caption"]
    assert len(found.inline_shapes) == sum(text.startswith("Figure") for text in captions)
    assert sum(text.endswith("The HTML report plays it.") for text in captions) == 2
    assert all(heading in words for heading in headings)
    assert af.commands.main(["report", str(carried_out), "--out", str(path), "--pdf"]) == 1
    assert "--pdf prints the page" in capsys.readouterr().err


def test_every_input_has_its_mark():
    tables = tomllib.loads(CASE) | {
        "materials": {"stone": {"young": "5 GPa"}},
        "contacts": {"stone to stone": {"cohesion": "2 kPa"}},
        "criteria": {"hinge": 0.45},
        "analysis": {"damping": "effective"},
    }
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(tables), {})).rows
    marks = {name: (value, mark) for name, value, mark in rows}
    assert {mark for _, mark in marks.values()} == {"given", "default"}
    finished = {**tables, "contacts": {"stone to stone": {"finish": "dressed"}}}
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(finished), {})).rows
    assert {mark for *_, mark in rows} == {"given", "default", "inferred"}
    expected = {
        "breadth": ("1 m", "given"),
        "gravity": ("9.81 m/s²", "default"),
        "stone: E": ("5 GPa (unused: blocks are rigid)", "given"),
        "stone: weight": ("20 kN/m³ (table 2 of Demirel and Aldemir (2021))", "default"),
        "stone to stone: μ": ("0.6 (dry stone has 0.4 to 0.8)", "default"),
        "stone to stone: cohesion": ("2 kPa", "given"),
        "reduction factor R": ("2.0", "given"),
        "scale of the motions": ("1.0", "default"),
        "fidelity": ("rigid", "given"),
        "displacements": ("small", "default"),
        "time step": ("by an error of 0.005 in |e|", "default"),
        "damping": ("5 % of critical", "default"),
        "damping, joints": ("closed", "default"),
        "damping, kind": ("stiffness", "default"),
        "damped at": ("the effective modes about dead load", "given"),
        "a joint hinges where": ("|e| ≥ 0.45", "given"),
        "mechanism by count": ("4 joints of rings and piers that fail at once", "default"),
    }
    assert {name: marks[name] for name in expected} == expected
    # what is marked as a default is what all other results name
    defaults = {each.words for each in list_defaults(af.Case.of(tables))}
    assert {"weight 20 kN/m³", "μ 0.6", "mechanism of 4 joints"} <= defaults
    assert "E 5 GPa" not in defaults


@pytest.mark.parametrize(
    ("key", "value", "row"),
    [
        ("structure.gravity", 9.81, ("gravity", "9.81 m/s²")),
        ("structure.width", 1.0, ("width", "1 m")),
        ("model.tolerance", 0.005, ("time step", "by an error of 0.005 in |e|")),
        ("model.quadrature", "exact", ("quadrature", "exact")),
        ("model.max_cell_size", 0.2, ("max cell size", "0.2 m")),
        ("analysis.scheme", "conserving", ("scheme", "conserving")),
        ("criteria.duration", 0.001, ("failure lasts for", "1 ms")),
        ("suite.scale", 1.0, ("scale of the motions", "1.0")),
        ("suite.reversed", False, ("motions are reversed", "False")),
    ],
)
def test_a_value_that_equals_its_default_is_given_where_the_case_states_it(
    key, value, row, tmp_path
):
    """A drawing too, of which results have the blocks in place of its file."""
    drawn = {"shape": "outlines", "file": "pier.geojson"}
    af.masonry.write_outlines(af.column(breadth=1.0, heights=[1.0]), tmp_path / drawn["file"])
    for tables in (tomllib.loads(CASE), tomllib.loads(CASE) | {"structure": drawn}):
        for stated in (False, True):
            section, name = key.split(".")
            if stated:
                tables.setdefault(section, {})[name] = value
            text = af.Case.of(tables, tmp_path).text()
            data = report_data.ReportData(af.Case.of(tomllib.loads(text)), {})
            rows = [each for each in tabulate_inputs(data).rows if each[:2] == row]
            without = [] if name in ("max_cell_size", "reversed") else [(*row, "default")]
            assert rows == ([(*row, "given")] if stated else without)


@pytest.mark.parametrize("young", [30e9, 28e9])
def test_a_value_is_given_by_the_table_of_its_material_whatever_its_name(young, tmp_path):
    """`write` gives a table another key than the name where it leaves out a key of a preset."""
    stone = af.Material(young, 0.2, 24034.5, None, "stone")
    pier = af.column(breadth=1.0, heights=[1.0], material=stone)
    case = af.Case.read(af.Analysis(pier, fidelity="rigid").write(tmp_path / "pier.toml"))
    assert case.settings["materials"].keys() == {"stone 2"}
    assert case.structure.blocks[1].material.name == "stone"
    rows = {row[0]: row[1:] for row in tabulate_inputs(report_data.ReportData(case, {})).rows}
    unused = " (unused: blocks are rigid)"
    assert rows["stone: E"] == (f"{young / 1e9:g} GPa{unused}", "given")
    assert rows["stone: weight"] == ("24.03 kN/m³", "given")
    assert "materials" not in "".join(each.key for each in list_defaults(case))
    # a strength under that key counts in limit analyses, too
    case.settings["materials"]["stone 2"]["strength"] = "2 MPa"
    assert af.Case.of(case.settings).limit.strength == 2e6


def test_the_paper_is_cited_where_a_value_is_its_own_alone():
    """The friction of a jointed fill follows from its angle, and no table has it."""
    tables = tomllib.loads(BRIDGE)
    tables["structure"]["fill"] = {"law": "jointed", "piece_size": 0.8, "friction_angle": 35}
    case = af.Case.of(tables)
    rows = tabulate_inputs(report_data.ReportData(case, {})).rows
    marks = {name: (value, mark) for name, value, mark in rows}
    source = "table 2 of Demirel and Aldemir (2021); unused where blocks are rigid"
    assert marks["stone: E"] == (f"30 GPa ({source})", "default")
    assert marks["fill: μ"] == (f"{np.tan(np.radians(35)):.4g}", "inferred")
    # stones have a contact with the fill for each size of its pieces, in one row for each value
    own = {x.contact for x in case.structure.joints if x.contact.name == "soil to stone"}
    ends = [f"{f(x.normal_stiffness for x in own) / 1e9:.4g} MPa/mm" for f in (min, max)]
    found = [(name, value) for name, value, _ in rows if name.startswith("soil to stone")]
    name = f"soil to stone and {len(own) - 1} more"
    assert len(own) > 5
    # of the joint and of the fill up to the centres of its pieces
    series = "(1/k: that of the joint, plus d/E of the fill up to the centres of its pieces)"
    assert found[0] == (f"{name}: k_n", f"{' to '.join(ends)} {series}")
    assert [x for x, _ in found] == [f"{name}: {word}" for word in ("k_n", "k_s", "μ")]
    # a given k_n is that of the joint alone, and in series with that of the fill it is less
    tables["contacts"] = {"soil to stone": {"normal_stiffness": "2 MPa/mm"}}
    case = af.Case.of(tables)
    own = {x.contact for x in case.structure.joints if x.contact.name == "soil to stone"}
    ends = [f"{f(x.normal_stiffness for x in own) / 1e9:.4g} MPa/mm" for f in (min, max)]
    assert max(x.normal_stiffness for x in own) < 2e9
    rows = tabulate_inputs(report_data.ReportData(case, {})).rows
    assert [row for row in rows if row[0].startswith(f"{name}: k_n")] == [
        (f"{name}: k_n", "2 MPa/mm", "given"),
        (f"{name}: k_n with its pieces of fill", f"{' to '.join(ends)} {series}", "inferred"),
    ]


def test_the_lengths_of_a_wall_are_named_by_its_plane(undrawn):
    """A wall of 2 m, 0.4 m thick, and a metre of it across: its thickness is in the plane then."""
    wall = {"shape": "wall", "breadth": 2.0, "height": 1.0, "course": 0.25, "stone": 0.5}
    structure = af.Case.of({"structure": {**wall, "width": 0.4}}).structure
    strip = af.masonry.columns_across(structure)["strip"]
    arch = af.circular_arch(span=2.0, rise=1.0, thickness=0.4, voussoirs=9, width=3.0)
    for made, words in (
        (structure, "2 m long, 1 m high and 0.4 m thick; "),
        (strip, "0.4 m thick, 1 m high and 1 m long; "),
        (arch, " high and 3 m wide; "),
    ):
        case = af.Case.of(write_structure(made))
        text = build_structure_section(report_data.ReportData(case, {})).pieces[0].text
        assert words in text


def test_a_wall_that_leans_is_as_thick_as_its_beds_are_deep(undrawn):
    outlines = [
        [[0.1 * y + x, y] for x, y in ((0.0, low), (0.5, low), (0.5, low + 1.0), (0.0, low + 1.0))]
        for low in (-1.0, 0.0, 1.0)
    ]
    named = [{"name": f"{k}", "outline": each} for k, each in enumerate(outlines)]
    blocks = [{**named[0], "fixed": True}, *named[1:]]
    settings = {"structure": {"shape": "blocks", "blocks": blocks, "above": 0.0, "width": 3.0}}
    data = report_data.ReportData(af.Case.of(settings), {})
    text = build_structure_section(data).pieces[0].text
    assert text.startswith("0.5 m thick, 2 m high and 3 m long; ")


def test_materials_that_differ_in_weight_alone_stand_once(unlike_weights, unplotted):
    tables = {**unlike_weights, "model": {"fidelity": "rigid"}}
    data, weights = report_data.ReportData(af.Case.of(tables), {}), tables["materials"]
    rows = [row for row in tabulate_inputs(data).rows if row[0].startswith("m")]
    assert rows[:3] == [
        ("m1 and 2 more: stands also for", "the wall above", "given"),
        ("m1 and 2 more: E", "30 GPa (unused: blocks are rigid)", "given"),
        ("m1 and 2 more: weight", "20 kN/m³ to 60 kN/m³", "given"),
    ]
    assert not [row for row in rows if row[0].startswith("m2")]
    extent = build_structure_section(data).pieces[0].text
    assert "3 blocks also stand for 'the wall above', which counts by its weight" in extent
    # one that differs in another value has rows of its own
    weights["m2"]["young"] = 1e10
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(data.case.settings), {})).rows
    assert {name for name, *_ in rows} > {"m2: weight", "m1 and 1 more: weight"}


def test_of_outlines_the_inputs_have_lengths_that_are_measured():
    """A ring of 17 stones by its corners, chords of 159/17 degrees, and a portal."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    half, stone, inner = np.radians(79.5), np.radians(159.0 / 34.0), 2.95 - 0.55 / 2.0
    span, rise = 2.0 * inner * np.sin(half), inner * (np.cos(stone) - np.cos(half))
    areas = 0.5 * np.sin(2.0 * stone) * (3.225**2 - inner**2)
    lengths = {
        replace(ring, origin=None): [
            ("arch", f"clear span {span:.3g} m, rise {rise:.3g} m, thickness 0.55 m"),
            ("stones", f"17 that can move, of {areas:.2g} m²"),
            ("blocks", "17 and 2 fixed, by their corners"),
        ],
        portal("ring"): [
            ("lintel", "clear span 2 m, bearings 0.5 m"),
            ("left pier", "0.5 m broad and 2 m high to the ring"),
            ("right pier", "0.5 m broad and 2 m high to the ring"),
            ("stones", "3 that can move, of 1 to 1.7 m²"),
        ],
    }
    for structure, expected in lengths.items():
        data = report_data.ReportData(af.Case.of(write_structure(structure)), {})
        rows = {row[0]: row[1] for row in tabulate_inputs(data).rows}
        assert {*expected} <= {*rows.items()}


def test_the_rise_of_a_pointed_arch_is_that_of_its_apex_within_the_key_stone():
    """Two arcs of 2 m about centres 0.8 m beside the middle; the key has the apex in its face."""
    apex, spread = np.arccos(-0.4), np.radians(8.0)

    def points(angles, radius, sense):
        x, y = 0.8 + radius * np.cos(angles), radius * np.sin(angles)
        return np.column_stack([sense * x, y])

    half, stones = np.linspace(np.pi, apex + spread, 6), []
    for sense in (1, -1):
        inner, outer = (points(half, radius, sense) for radius in (2.0, 2.35))
        stones += [[inner[k], outer[k], outer[k + 1], inner[k + 1]][::-sense] for k in range(5)]
    sides = [[points(half[-1:], r, s)[0] for s in (1, -1)] for r in (2.0, 2.35)]
    tops = [[0.0, np.sqrt(r**2 - 0.64)] for r in (2.0, 2.35)]
    stones.append([sides[0][0], tops[0], sides[0][1], sides[1][1], tops[1], sides[1][0]])
    blocks = [
        {"name": f"{k}", "outline": np.array(x).tolist(), "part": "arch", "role": "ring"}
        for k, x in enumerate(stones)
    ]
    blocks += [
        {"name": f"f{x}", "outline": [[x, -1], [x + 1, -1], [x + 1, 0], [x, 0]], "fixed": True}
        for x in (-1.8, 0.8)
    ]
    case = af.Case.of({"structure": {"shape": "blocks", "blocks": blocks}})
    rows = {row[0]: row[1] for row in tabulate_inputs(report_data.ReportData(case, {})).rows}
    rise = np.sqrt(4.0 - 0.64)
    assert rows["arch"].startswith(f"clear span 2.4 m, rise {rise:.3g} m, thickness 0.35 ")


def test_a_verdict_that_was_broken_off_is_a_doubt(kept):
    """Until all of its runs are finished; so is that of a pair, and a study in the folder."""
    found = af.cases.open_results(kept)
    of_pair = "variations/second", "verdict --pair second"
    for place, command in (("variations", "verdict"), of_pair, ("", "study")):
        path = kept / place / "progress.json"
        path.parent.mkdir(exist_ok=True)
        for done in (23, 40):
            write_sealed_json(path, {"total": 40, "done": done})
            data = report_data.ReportData(found.case, found.runs, found.folder)
            texts = [getattr(each, "text", "") for each in build_conclusion(data).pieces]
            words = f"Unfinished: {done} of 40 runs; run `archfem {command}` again."
            assert (f"In doubt, variations: {words}" in texts) == (done < 40)
            assert ("variations" in dict(list_facts(data)).get("in doubt", "")) == (done < 40)


def test_stiffness_by_a_finish_is_inferred_and_numbers_have_their_units():
    tables = {
        "structure": {"shape": "column", "breadth": 1.0, "heights": [1.0, 1.0]},
        "contacts": {"stone to stone": {"finish": "dressed", "friction": 0.6}},
        "model": {"fidelity": "rigid"},
        "motion": {"synthetic": {"seed": 3, "duration": 6.0, "pga": "2 m/s**2"}},
    }
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(tables), {})).rows
    marks = {name: (value, mark) for name, value, mark in rows}
    assert marks["stone to stone: finish"] == ("dressed", "given")
    # the ranges are those of the softest and the stiffest faces of the finish
    law = af.joint_stiffness(30e9, 1.0, "dressed")
    low, usual, high = (f"{each / 1e9:.2g}" for each in law.initial)
    said = f"{usual} ({low} to {high}) MPa/mm at first"
    value, mark = marks["stone to stone: k_n"]
    assert (value.partition(" (k_i")[0], mark) == (said, "inferred")
    # each with the sources of its relations
    assert "k_i and δ_m: Bandis, Lumsden and Barton (1983)" in value
    assert "usual: 0.2 k_n, Demirel and Aldemir (2021)" in marks["stone to stone: k_s"][0]
    assert "k_s, low: Barton and Choubey (1977)" not in value
    low, usual, high = (f"{each * 1e3:.2g}" for each in sorted(law.closure))
    value, mark = marks["stone to stone: closing"]
    assert value.startswith(f"{usual} ({low} to {high}) mm at most (as k_n)")
    assert mark == "inferred"
    assert marks["stone to stone: k_s"][1] == "inferred"
    # also of a structure from Python, whose stiffnesses are those of the finish
    made = write_structure(af.masonry.with_finish(af.Case.of(tables).structure, "dressed"))
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(made), {})).rows
    assert [row for row in rows if row[0] == "stone to stone: k_n"] == [
        ("stone to stone: k_n", *marks["stone to stone: k_n"])
    ]
    tables["contacts"]["stone to stone"]["finish"] = "weathered"
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(tables), {})).rows
    (words,) = (value for name, value, _ in rows if name == "stone to stone: finish")
    assert "they may move less" in words
    tables["contacts"]["stone to stone"]["finish"] = "dressed"
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(tables), {})).rows
    assert marks["stone to stone: μ"] == ("0.6", "given")
    peak = ("peak 0.667 of the horizontal", "default")
    assert marks["vertical motion, synthetic"] == peak
    assert [row[1:] for row in rows if row[0] == "motion, synthetic"] == [
        ("duration 6 s; pga 2 m/s²; seed 3", "given"),
        ("dt 0.005 s", "default"),
    ]
    held = af.Case.of({**tables, "motion": {"held": {"push": "3 m/s**2"}}})
    rows = tabulate_inputs(report_data.ReportData(held, {})).rows
    assert [row for row in rows if row[0] == "motion, held"] == [
        ("motion, held", "push 3 m/s²", "given"),
        ("motion, held", "rise 1 s; duration 10 s; dt 0.005 s", "default"),
    ]


def test_sources_of_a_suite_are_inputs_each_with_its_mark():
    tables = tomllib.loads(CASE)
    tables["suite"]["pairs"]["third"] = {
        "synthetic": {"seed": 7, "duration": "1 s"},
        "vertical": {"synthetic": {"seed": 9}},
        "reversed": True,
    }
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(tables), {})).rows
    found = {(name, mark): value for name, value, mark in rows}
    given, default = "given", "default"
    made = "duration 1 s; pga 1 m/s² (of 2 motions); seed 1, 2, 7"
    assert found["motion, synthetic", given] == made
    rest = "pga 2.94 m/s² (of 1 motion); dt 0.005 s"
    assert sorted(found["motion, synthetic", default].split("; ")) == sorted(rest.split("; "))
    assert found["motion", given] == "reversed True (of 1 motion)"
    # the vertical of the first is a default, of the second none, of the third one of its own
    upright = found["vertical motion, synthetic", default]
    assert "peak 0.667 of the horizontal (of 1 motion)" in upright
    assert "dt 0.005 s (of 1 motion)" in upright
    upright = found["vertical motion, synthetic", given]
    assert upright == "peak 0 of the horizontal (of 1 motion); seed 9 (of 1 motion)"


BRIDGE = """
title = "a small bridge"
[structure]
shape = "bridge"
width = 3.0
[structure.arches]
"arch" = { span = "4 m", rise = "1.5 m", thickness = "0.5 m", voussoirs = 9 }
[structure.sidewalls]
length = "1.5 m"
height = "1 m"
above = "1 m"
course = "0.5 m"
"left" = { state = "fixed" }
"right" = { state = "fixed" }
[structure.backfill]
cover = "0.4 m"
[model]
fidelity = "rigid"
[limit]
fill = { friction_angle = "35 degree" }
[assessment]
spectrum = { code = "NTC-2018", ag = 0.25, f0 = 2.4, tc_star = 0.32, site = "B" }
[suite.pairs]
first = { synthetic = { seed = 1 } }
"""


PIER = """
"east" = { span = "4 m", rise = "1.5 m", thickness = "0.5 m", voussoirs = 9 }
[structure.piers]
pier = { breadth = "1.2 m", height = "2 m", course = "1 m" }
"""


@pytest.mark.parametrize(
    ("command", "given", "found"),
    [
        pytest.param(
            *("rate", ["--vehicle", "LM1"], "Rating for LM1: factor"), marks=pytest.mark.slow
        ),
        (
            "limit",
            ["--set", "limit.horizontal=1.0"],
            "Limit analysis: four-hinge mechanism (of the least), at 0.507 to 0.8787 g",
        ),
    ],
)
def test_a_result_without_a_time_history_has_a_report(
    command, given, found, tmp_path, capsys, undrawn, monkeypatch
):
    monkeypatch.setattr(rating, "_places_along", lambda *_: (3.0, 4.0))
    monkeypatch.setattr(cut_road, "__defaults__", (8,))
    path, folder = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(f'{BRIDGE}[rating]\nvehicle = "LM2"\nlive = 1.2\n', encoding="utf-8")
    # joints slide under the vehicle, and at the favourable end of the range of the push alone
    code, mark = (3, "in doubt") if command == "rate" else (0, "note")
    assert af.commands.main([command, str(path), "--out", str(folder), *given]) == code
    said = capsys.readouterr().out
    assert re.search(rf"\n{mark}: .*joints slide \(arch, joint", said)
    assert af.commands.main(["report", str(folder)]) == 0
    words = words_of(folder / "report.html")
    concluded = words.split("Inputs and assumptions")[1]  # between the contents and the heading
    assert found in concluded
    if command == "rate":
        assert "In doubt, rating: Joints slide (arch, joint" in concluded
    else:
        assert "note: with the fill as given, joints slide (arch, joint" in words
        assert "oints slide" not in concluded
    assert ("Over the pressure of the fill, each at its worst place: " in concluded) == (
        command == "rate"
    )
    noted = "note: values from memory were not compared with the text of their code"
    assert (f"\n{noted}: look" in said) == (command == "rate")
    assert ("Note, rating: Values from memory were not compared" in concluded) == (
        command == "rate"
    )
    factor = re.search(r"factor (?:of )?([\d.]+)", said)[1]
    assert f"{factor}" in words
    listed = " ".join(words.split())
    assert "limit: fill, friction angle 35 degree given" in listed
    for value in ("law pressure", "cohesion 0 kPa", "mobilisation 0.333", "active 1"):
        assert f"limit: fill, {value} default" in listed
    # what rigid blocks do not use is no input; a strength that is a default neither
    inputs = words.split("Inputs and assumptions")[2].partition("Assumptions, units")[0]
    assert "stone: weight" in inputs
    assert not re.search(r": (E|strength|k_n|k_s|ν)\b", inputs)
    assert "Response" not in words
    assert "runs of first" not in words
    # a run takes the folder over
    assert "case.toml" in read_file_list(folder)[command].files
    with replace_run(af.Case.read(path), folder):
        pass
    listed = read_file_list(folder)
    assert "case.toml" in listed["run"].files
    assert "case.toml" not in listed[command].files
    if command == "rate":  # by the vehicle of the command line, also beside the case of a run
        assert af.commands.main(["report", str(folder)]) == 0
        words = " ".join(words_of(folder / "report.html").split())
        assert "rating: vehicle LM1 given rating: live 1.2 given rating: area load, dead" in words


@pytest.mark.parametrize(("changed", "author"), [("1.0", "B. Wright"), ("2.0", "A. Mason")])
def test_a_command_renews_who_signs_the_case_of_a_run(changed, author, undrawn, tmp_path, capsys):
    """That of the same case: another load makes it another case, of which it warns."""
    path, folder = tmp_path / "case.toml", tmp_path / "out"
    limit = CASE + '[limit]\nhorizontal = 1.0\n[report]\nauthor = "A. Mason"\n'
    path.write_text(limit, encoding="utf-8")
    with replace_run(af.Case.read(path), folder):
        pass
    path.write_text(limit.replace("A. Mason", "B. Wright").replace("= 1.0\n[r", f"= {changed}\n[r"))
    assert af.commands.main(["limit", str(path), "--out", str(folder)]) == 0
    listed = read_file_list(folder)
    assert "case.toml" in listed["run"].files
    assert "case.toml" not in listed["limit"].files
    assert af.cases.open_results(folder).case.report == {"author": author}
    said = capsys.readouterr().out
    assert (f"note: {folder} has results of another case" in said) == (changed == "2.0")
    assert ("give all the same `--set`, or name another" in said) == (changed == "2.0")


def test_results_that_a_command_replaces_are_not_of_another_case_beside_it(
    undrawn, tmp_path, capsys
):
    path, folder = tmp_path / "case.toml", tmp_path / "out"
    spectrum = BRIDGE.partition("[assessment]")[2].partition("[suite")[0]
    path.write_text(f"{CASE.partition('[suite]')[0]}[assessment]{spectrum}", encoding="utf-8")

    def is_noted(command, load):
        given = [command, str(path), "--out", str(folder), "--set", f"limit.horizontal={load}"]
        assert af.commands.main(given) in (0, 3)
        return "has results of another case" in capsys.readouterr().out

    assert [is_noted("limit", load) for load in (1.0, 2.0)] == [False, False]
    assert [is_noted("assess", load) for load in (2.0, 3.0)] == [False, True]
    # beside those of the assessment, whether the case is of one or the other
    assert [is_noted("limit", load) for load in (4.0, 3.0)] == [True, False]


def test_a_kinematic_assessment_alone_has_a_report(unplotted, tmp_path, capsys):
    path, folder = tmp_path / "case.toml", tmp_path / "out"
    spectrum = BRIDGE.partition("[assessment]")[2].partition("[suite")[0]
    path.write_text(f"{CASE.partition('[suite]')[0]}[assessment]{spectrum}", encoding="utf-8")
    assert af.commands.main(["assess", str(path), "--out", str(folder)]) == 0
    assert af.commands.main(["report", str(folder)]) == 0
    concluded = words_of(folder / "report.html").split("Inputs and assumptions")[1]
    least = re.search(r"The least margin is ([^,]+), on the NTC-2018 spectrum of PGA", concluded)[1]
    assert f"least margin {least}, by NTC-2018 SLV: " in capsys.readouterr().out
    own, apart = map(float, re.fullmatch(r"(\S+) \((\S+) with the weights apart\)", least).groups())
    assert own < apart
    assert "assessment: NTC-2018 SLV, right and left" in concluded
    words = words_of(folder / "report.html")
    assert "ag 0.25" in words.split("Norms and methods")[2]
    inputs = " ".join(words.split("Assumptions, units")[0].split())
    assert "assessment: direction right and left default" in inputs
    assert "assessment: limit state NTC-2018 SLV default assessment: q 2 (Circ" in inputs
    assert "player" not in words  # of a run that there is not


def test_a_report_of_several_folders_has_the_worst_verdict_and_the_inputs_once(
    unplotted, tmp_path, capsys
):
    """A column of 0.3 m fails a check that one of 0.9 m passes."""
    folders, ratios = [str(tmp_path / name) for name in ("broad", "slender")], []
    for folder, breadth in zip(folders, (0.9, 0.3), strict=True):
        path = tmp_path / "column.toml"
        spectrum = 'spectrum = { code = "EC8", ag = 0.3, ground = "A" }'
        lengths = f'shape = "column"\nbreadth = {breadth}\nheights = [1.0, 1.0]'
        text = f'title = "A stack"\n[structure]\n{lengths}\n[assessment]\n{spectrum}\n'
        path.write_text(f'{text}[report]\nauthor = "A. Mason"\n', encoding="utf-8")
        assert af.commands.main(["assess", str(path), "--out", folder]) in (0, 3)
        ratios.append(re.search(r"least margin ([\d.]+)", capsys.readouterr().out)[1])
    assert float(ratios[0]) > 1.0 > float(ratios[1])
    page = tmp_path / "joint.html"
    assert af.commands.main(["report", *folders, "--out", str(page)]) == 0
    broad, slender = (f"{key}: A stack ({x})" for key, x in zip("AB", folders, strict=True))
    words = " ".join(words_of(page).split())
    assert f"cases {broad}; {slender} verdict" in words
    worst = "verdict The worst of 2 cases is B: "
    assert f"{worst}By the kinematic assessment it does not withstand" in words
    of = [rf"{x} times the earthquake by [^;]+" for x in ratios]
    assert re.search(f"margin The least margins are of B {of[1]}; of A {of[0]}\\. ", words)
    assert " A By the kinematic assessment it withstands" in words
    assert "A B breadth 0.9 m (given) 0.3 m (given)" in words
    assert words.count("heights 1, 1 given") == words.count("place, date signature") == 1
    figures = [int(number) for number in re.findall(r"Figure (\d+)\.", words)]
    assert figures == [*range(1, len(figures) + 1)]
    for label, figure in zip("AB", (1, 2), strict=True):  # once, before the inputs
        drawn = f"Figure {figure}. {label}: the structure, with its assessed joints"
        assert words.index("place, date signature") < words.index(drawn)
        assert words.index(drawn) < words.index("Inputs. Given")
    assert words.count("with its assessed joints") == 2
    # cases of one structure have one drawing, and the project is the title of all
    given = ["report", *folders, folders[0], "--set", "report.project=A tower"]
    assert af.commands.main([*given, "--out", str(page)]) == 0
    assert words_of(page).split("project")[0].split()[-2:] == ["A", "tower"]
    words = " ".join(words_of(page).split())
    assert "Figure 1. A and C: the structure" in words
    assert words.count("with its assessed joints") == 2
    # a study of one case, that of the file, is shown with that
    study, shown = tmp_path / "study.toml", tmp_path / "study"
    text = 'title = "Heights"\ncase = "column.toml"\ncompute = "assessment"\n'
    study.write_text(f"{text}[vary]\nstructure.breadth = [0.25, 0.3]\n", encoding="utf-8")
    assert af.commands.main(["study", str(study), "--out", str(shown), "--workers", "1"]) in (0, 3)
    given = ["report", *folders, "--study", str(shown), "--out", str(page)]
    assert af.commands.main(given) == 0
    words = " ".join(words_of(page).split())
    assert words.count("Study of many cases") == 1
    assert words.index(f" {slender} verdict") < words.index("Study of many cases")
    least = re.search(r"In the study 'Heights' the least margin is ([\d.]+)", words)[1]
    assert float(least) < float(ratios[1])
    # beside a case of its structure with a tie, its least margin is of the case that it changes
    tie = '{ block = "block 2", point = [0.0, 2.0], force = [-100.0, 0.0], passive = true }'
    tied, given = str(tmp_path / "tied"), ["--set", f"assessment.loads=[{tie}]"]
    assert af.commands.main(["assess", str(path), *given, "--out", tied]) in (0, 3)
    compared, both = tmp_path / "both.toml", tmp_path / "both"
    changes = f"""[cases]\nfree = {{}}\ntied = {{ set = ['{given[1]}'] }}\n"""
    compared.write_text(f"{text}{changes}", encoding="utf-8")
    margin = re.findall(r"least margin ([\d.]+)", capsys.readouterr().out)[-1]
    arguments = ["study", str(compared), "--out", str(both), "--workers", "1"]
    assert af.commands.main(arguments) in (0, 3)
    for place in (shown, both):  # whatever a study varies
        given = ["report", folders[1], tied, "--study", str(place), "--out", str(page)]
        assert af.commands.main(given) == 0
        words = " ".join(words_of(page).split())
        says = [f"of {x} {y} times the earthquake" for x, y in (("A", ratios[1]), ("B", margin))]
        assert re.search(f"The least margins are {' by [^;]+; '.join(says)}", words)
    capsys.readouterr()
    given = ["report", folders[0], folders[0], "--study", str(shown)]
    assert af.commands.main(given) == 1
    assert f"{shown} is a study of none of the cases: none has its" in capsys.readouterr().err


@pytest.mark.slow
def test_an_assessment_takes_the_fill_of_the_limit_analysis(undrawn, tmp_path, capsys):
    path, folder = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(BRIDGE, encoding="utf-8")
    assert af.commands.main(["assess", str(path), "--out", str(folder)]) == 0
    pressed = capsys.readouterr().out
    assert "of the passive pressure, friction angle 35°" in pressed
    margin = r"least margin with one weight a body (\S+) \(the fill's inertia at its columns' \w+,"
    margin += r" (?:no|its active) pressure\) to (\S+) \(the fill's"
    least, most = re.search(margin, pressed).groups()
    assert float(least) < float(most)
    assert af.commands.main(["report", str(folder)]) == 0
    inputs = " ".join(words_of(folder / "report.html").split())
    assert "assessment: fill that of the limit analysis inferred" in inputs
    assert "limit: fill, mobilisation 0.333 default" in inputs
    code = "by the code horizontal: PGA 0.29 g = 1.16 ag, plateau 0.696 g, T_B 0.147 s, T_C 0.442 s"
    assert f"assessment: spectrum, {code}, T_D 2.6 s inferred" in inputs  # pushes are horizontal
    assert "assessment: spectrum topography 1.0 default" in inputs
    assert "\nspectrum, by default: topography 1.0\n" in pressed
    path.write_text(BRIDGE.replace('fill = { friction_angle = "35 degree" }', ""))
    capsys.readouterr()
    assert af.commands.main(["assess", str(path)]) == 3
    alone = capsys.readouterr().out
    assert alone.count("in doubt: the fill counts as weight") == 1  # of both directions
    assert "without its pressure on them; give fill for it" in alone
    # the bridge is symmetric, and is drawn once
    pages = words_of(folder / "report.html")
    assert pages.count("the mirror image, with the same numbers") == 1
    assert "pushed to the right" in pages
    assert "pushed to the left" not in pages
    assert len([name for name in read_file_list(folder)["assess"].files if "png" in name]) == 2
    stated = " ".join(pages.split())
    said = rf"The least margin is {least} to {most} \((\S+) with the weights apart\),"
    assert float(re.search(said, stated)[1]) > float(least)
    assert "NTC-2018 SLV capacity 0.4 d_0*; demand the displacement spectrum, 8 % damped" in stated
    assert "T 1.68 π √(d / a*(d)) at d = 0.4 d_0*, with a* divided by FC" in stated
    factors = [float(re.search(r"alpha_0 = ([\d.]+)", text)[1]) for text in (pressed, alone)]
    assert factors[0] > 1.01 * factors[1]  # by its active pressure alone


def test_a_fill_is_stated_as_elastic_and_not_varied(kept):
    tables = {key: value for key, value in tomllib.loads(BRIDGE).items() if key != "assessment"}
    tables["model"] = {"fidelity": {"backfill": "full", "rest": "rigid"}}
    tables["suite"] |= {"matched": True, "target": {"code": "EC8", "ag": 0.2, "ground": "B"}}
    case = af.Case.of(tables)
    data = report_data.ReportData(case, af.cases.open_results(kept).runs)
    vars(data)["fidelity"] = "backfill: full, rest: rigid"
    inputs, assumed = build_input_section(data).pieces
    assert "carries tension" in dict(assumed.rows)["fill"]
    words = {(name, mark): value for name, value, mark in inputs.rows}
    assert words["backfill: E", "default"].startswith("6.25 MPa (table 2 of")
    assert "pga 2.94 m/s²" in words["motion, synthetic, before matching", "default"]
    stated = ", ".join(conclusion.list_unvaried(data))
    assert "friction, damping, stiffness and strength of the fill, " in stated
    concluded = " ".join(getattr(x, "text", "") for x in build_conclusion(data).pieces)
    assert " is elastic in the runs and carries tension, which soil does not. " in concluded
    assert "of the template" not in concluded
    vars(data)["fidelity"] = "rigid"
    assert "fill" not in ", ".join(conclusion.list_unvaried(data))
    texts = [getattr(piece, "text", "") for piece in build_conclusion(data).pieces]
    assert "carries tension" not in " ".join(texts)
    template = (Path(af.cases.__file__).parent / "new" / "bridge.toml").read_text(encoding="utf-8")
    named = {"report": {"project": re.search(r'project = "(.+)"', template)[1]}}
    data = report_data.ReportData(af.Case.of(tables | named), data.runs)
    words = [getattr(piece, "text", "") for piece in build_conclusion(data).pieces]
    assert any(text.startswith("The name of the project is that of the template") for text in words)


def test_of_several_vehicles_a_table_has_the_factors(small, undrawn):
    case, folder = af.Case.of(tomllib.loads(BRIDGE)), small.parent / "out"
    with replace_run(case, folder) as draft:
        rows = ["vehicle,factor", "LM71,1.5", "LM1,1.9"]
        texts = "vehicle  factor", "Rating of 'it'", "Rating of other"
        files = {"rating.txt": "\n\n".join(texts), "vehicles.csv": "\n".join(rows)}
        files["rating.toml"] = '[rating]\nvehicle = "LM71"'
        files["rating_variations.csv"] = "LM71 with,factor\nrings a tenth thinner,1.3"
        write_files(files, draft)
        for name in ("vehicles", "places", "rating"):
            (draft / f"{name}.png").write_bytes(b"\x89PNG" + bytes(20))
    data = report_data.ReportData(case, {}, folder)
    grid, every, places, *found, varied, figure = _build_rating(data)
    assert every.caption == "Factor of each vehicle over its place."
    assert places.caption == "Each vehicle at its worst place."
    assert varied.rows == [["rings a tenth thinner", "1.3"]]
    alone = ", alone, as its factor is nearest to 1"
    assert varied.caption == f"Factor of LM71 with one property changed at a time{alone}"
    assert varied.head == ["LM71 with", "factor"]
    assert figure.caption.endswith("mechanism at the worst place, LM71")
    assert data.read_table("rating") == {"vehicle": "LM71, LM1"}
    assert (grid.head, grid.rows) == (["vehicle", "factor"], [["LM71", "1.5"], ["LM1", "1.9"]])
    assert [each.text for each in found] == [*texts[1:]]  # without the same table


def test_factors_of_a_vehicle_are_not_those_of_the_code(kept, undrawn):
    axle = {"name": "axle", "axles": [1e5], "live": 1.35, "impact": 1.4}
    case = af.Case.of(tomllib.loads(BRIDGE) | {"rating": {"vehicle": axle}})
    with replace_results(kept, "rate", read_file_list(kept)["run"].inputs) as draft:
        write_files({"rating.txt": "it"}, draft)
    rows = {row[0]: row[1:] for row in tabulate_inputs(report_data.ReportData(case, {}, kept)).rows}
    assert "live 1.35; impact 1.4" in rows["rating: vehicle"][0]
    stated = "1, none or by rule, see below"
    assert rows["rating: area load, dead, width"] == (stated, "default")


def test_points_of_a_spectrum_and_attached_loads_are_stated(kept, undrawn):
    """Of more points than are listed elsewhere; a floor, a tie and a bar between two blocks."""
    periods = [0.0, "100 ms", 0.2, 0.3, 0.4, 0.5, 1.0, 2.0]
    spectrum = {"code": "table", "periods": periods, "values": [0.2, *[0.5] * 5, 0.25, 0.125]}
    bar = {"anchor": "block 1", "anchor_point": ["0 m", "0.5 m"], "force": ["0 kN", "-2 kN"]}
    loads = [
        {"block": "block 2", "point": ["0.2 m", 1.5], "weight": "12 kN"},
        {"block": "block 2", "point": [0.0, 1.5], "force": ["-3 kN", 0.0], "passive": True},
        {"block": "block 2", "point": [0.0, 1.5], "passive": True, "free_length": "90 cm", **bar},
        {"block": "block 1", "point": [0.0, 0.5], "force": [1500.0, 0.0]},
    ]
    tables = tomllib.loads(CASE) | {"assessment": {"spectrum": spectrum, "loads": loads}}
    with replace_results(kept, "assess", read_file_list(kept)["run"].inputs) as draft:
        write_files({"assessment.txt": "it"}, draft)
    data = report_data.ReportData(af.Case.of(tables), {}, kept)
    rows = {row[0]: row[1:] for row in tabulate_inputs(data).rows}
    pairs = "0 0.2; 100 ms 0.5; 0.2 0.5; 0.3 0.5; 0.4 0.5; 0.5 0.5; 1 0.25; 2 0.125"
    table = f"table of period [s] and accelerations [g]: {pairs}"
    assert rows["assessment: spectrum"] == (table, "given")
    law = "coulomb, as none without dilatancy is searched with loads"
    assert rows["assessment: friction"] == (law, "default")
    assert [rows[f"assessment: load {k}"] for k in range(1, 5)] == [
        (text, "given")
        for text in (
            "on block 2 at (0.2, 1.5) m; weight 12 kN",
            "on block 2 at (0, 1.5) m; tie of at most (-3, 0) kN; held by the ground",
            "on block 2 at (0, 1.5) m; tie of at most (0, -2) kN; held by block 1 at (0, 0.5) m; "
            "0.9 m of it free",
            "on block 1 at (0, 0.5) m; constant force (1.5, 0) kN",
        )
    ]


@pytest.mark.parametrize("spandrels", ["0 m", "0.6 m"])
def test_the_weight_of_a_fill_is_stated_as_given_and_with_spandrels(spandrels):
    """A fifth of 3 m in stone of 23 kN/m³, the rest in fill of 18."""
    text = BRIDGE.replace('cover = "0.4 m"', f'cover = "0.4 m"\nspandrels = "{spandrels}"')
    text += '[materials]\nbackfill = { unit_weight = "18 kN/m³" }\nstone.unit_weight = 23e3\n'
    data = report_data.ReportData(af.Case.of(tomllib.loads(text)), {})
    rows = {row[0]: row[1:] for row in tabulate_inputs(data).rows}
    mixed = ", 19 kN/m³ with the spandrels" * (spandrels != "0 m")
    assert rows["backfill: weight"] == (f"18 kN/m³{mixed}", "given")


def test_the_modulus_of_a_fill_in_pieces_is_stated_as_given():
    """Pieces are a thousand times stiffer, and their joints have the compliance."""
    text = BRIDGE + '[structure.fill]\nlaw = "jointed"\nfriction_angle = 35.0\npiece_size = 1.0\n'
    text += '[materials]\nbackfill = { young = "20 MPa" }\n'
    text = text.replace("= 1.0\n", '= 1.0\ncohesion = "5 kPa"\n')
    own = f"{af.masonry.BACKFILL.young / 1e6:g} MPa", "default"
    for given, young in ((text, ("20 MPa", "given")), (text.replace("young", "poisson"), own)):
        given = given.replace('poisson = "20 MPa"', "poisson = 0.2")
        data = report_data.ReportData(af.Case.of(tomllib.loads(given)), {})
        rows = {row[0]: row[1:] for row in tabulate_inputs(data).rows}
        assert rows["backfill: E"] == young
        pieces = young[0].replace("MPa", "GPa")
        why = "practically rigid, as their joints have the E of the fill"
        assert rows["backfill: E of its pieces"] == (f"{pieces}, {why}", "inferred")
        assert rows["fill: cohesion"] == ("5 kPa", "inferred")


def test_of_a_pier_the_foundation_is_fixed():
    text = BRIDGE.replace("[structure.sidewalls]", PIER + "[structure.sidewalls]")
    data = report_data.ReportData(af.Case.of(tomllib.loads(text)), {})
    rows = {row[0]: row[1] for row in build_input_section(data).pieces[1].rows}
    assert rows["ground"].endswith("fixed to it: 'left', 'pier, foundation', 'right'")


def test_long_tables_of_joints_stand_in_two_halves(kept, monkeypatch):
    found = af.cases.open_results(kept)
    data = report_data.ReportData(found.case, found.runs)
    rows = [[f"joint {k}", "0.1", "0.1", "0.1", "0.1", "-"] for k in range(13)]
    table = ResultTable(["joint", "e dead", "e min", "e max", "max V/N", "open from"], rows)
    monkeypatch.setattr(result_text, "tabulate_joints", lambda *_: table)
    first = _tabulate_joints(data, data.runs["first"])
    assert first.head == [*table.head[:5], *table.head[:5]]
    assert [row[0] for row in first.rows] == [f"joint {k}" for k in range(7)]
    assert [row[5] for row in first.rows] == [*(f"joint {k}" for k in range(7, 13)), ""]


def test_a_table_of_very_many_joints_has_those_that_failed_longest(kept, monkeypatch):
    """Joint 70 hinged; of the others the largest |e| are those of the last."""
    found = af.cases.open_results(kept)
    data = report_data.ReportData(found.case, found.runs)
    head = ["joint", "e dead", "e min", "e max", "max V/N", "hinge from", "hinge for"]
    numbers = [
        [f"joint {k}", "0.0", f"-{k / 500:.3f}", "open", "0.1", "-", "-"] for k in range(176)
    ]
    numbers[70][5:] = "1.000 s", "0.010 s"
    monkeypatch.setattr(result_text, "tabulate_joints", lambda *_: ResultTable(head, numbers))
    table = _tabulate_joints(data, data.runs["first"])
    assert [row[0] for row in table.rows] == [f"joint {k}" for k in (70, *range(117, 176))]
    assert table.caption.endswith("The 60 of 176 that failed longest, then by largest |e|.")


def test_a_history_alone_has_a_report_and_a_film_by_the_command_line(
    kept, unplotted, tmp_path, capsys
):
    path = Path(shutil.move(kept / "first" / "history.nc", tmp_path / "moved.nc"))
    assert af.commands.main(["report", str(path)]) == 0
    words = words_of(tmp_path / "moved.html")
    assert "It survives: it forms no mechanism under the motion 'first' of PGA 0.05 g" in words
    # no folder is beside it
    assert "attribute 'case' of the history" in words
    assert "case.toml" not in words
    given = ["--out", str(tmp_path / "film.gif"), "--size", "480x320", "--fps", "5"]
    assert af.commands.main(["animate", str(path), *given]) == 0
    assert (tmp_path / "film.gif").is_file()


def test_the_conclusion_states_outcomes_falls_and_the_range(kept, unplotted):
    found = af.cases.open_results(kept)
    data = report_data.ReportData(found.case, found.runs, found.folder)
    verdicts = {name: run.verdict for name, run in found.runs.items()}
    vars(found.runs["second"])["verdict"] = replace(
        verdicts["second"], outcome="fallen", doubts=(af.models.model.Doubt("it leaks", "mend it"),)
    )
    text = " ".join(piece.text for piece in build_conclusion(data).pieces if piece.kind == "words")
    under = "under 1 of 2 motions: second (PGA 0.05 g)"
    answer = f"It does not survive (in doubt, as below): it falls {under}. It forms no mech"
    assert head_of(list_facts(data)).startswith(answer)
    # the remedy is not for the client
    assert "In doubt, time histories: 1 of 2 runs: it leaks." in text
    assert "raise no doubt" not in text


def test_results_that_were_begun_alone_are_named(kept):
    (kept / "risk_samples.nc").touch()
    found = af.cases.open_results(kept)
    pieces = build_conclusion(report_data.ReportData(found.case, found.runs, kept)).pieces
    texts = [each.text for each in pieces if each.kind == "words"]
    begun = "The annual rate of collapse was begun and has no answer: runs are left to compute."
    assert [text for text in texts if "begun" in text] == [begun]


def test_an_attempt_without_an_answer_states_its_reason(kept, unplotted, capsys, monkeypatch):
    def fail(*_, **__):
        raise af.DidNotConverge("no sample falls; raise the scales")

    monkeypatch.setattr("archfem.studies.variations.verdict_range", fail)
    given = ["verdict", str(kept / "case.toml"), "--pair", "first", "--out", str(kept)]
    assert af.commands.main(given) == 1
    assert "no answer: no sample falls; raise the scales" in capsys.readouterr().out
    assert af.commands.main(["report", str(kept)]) == 0
    words = words_of(kept / "report.html")
    row = "range of the verdict over uncertain properties 'first' no answer: no sample falls; raise"
    assert row in " ".join(words.replace("–", "-").split())


def test_motions_are_measured_by_themselves_without_their_files(tmp_path, unplotted):
    """A peak between two steps of the run, of a record that is gone."""
    record, path = tmp_path / "record.txt", tmp_path / "case.toml"
    np.savetxt(record, [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    text = CASE.partition("[suite]")[0]
    given = f'file = "{record}"\ndt = "5 ms"\nunits = "m/s2"'
    path.write_text(f'{text}[analysis]\ndt = "10 ms"\n[motion]\n{given}\n', encoding="utf-8")
    case, folder = af.Case.read(path), tmp_path / "out"
    with replace_run(case, folder) as draft:
        list(carry_out(case, draft))
    record.unlink()
    found = af.cases.open_results(folder)
    (motion,) = report_data.ReportData(found.case, found.runs, folder).motions.values()
    assert (motion.pga, motion.dt, motion.components) == (2.0, 0.005, ("horizontal",))
    words = words_of(found.report())
    assert "0.2039 g" in words
    assert "Steps of runs miss peaks: of 'record' 0 of 0.204 g." in words


@pytest.mark.slow
def test_a_motion_is_measured_to_its_end_where_the_structure_falls_before(tmp_path, unplotted):
    """A pulse that overturns a stone, and a stronger one after the fall."""
    step, path = 0.005, tmp_path / "pulse.csv"
    samples = np.zeros(1600)
    samples[20:140] = 4.0
    samples[-40:-20] = 6.0
    np.savetxt(path, samples)
    tables = {
        "structure": {"shape": "column", "breadth": 0.2, "heights": [1.0]},
        "model": {"fidelity": "rigid", "displacements": "large"},
        "motion": {"file": str(path), "dt": step, "units": "m/s2"},
    }
    case = af.Case.of(tables)
    (run,) = (each for each in af.cases.run_case(case) if isinstance(each, af.cases.Run))
    assert run.history.verdict.outcome == "fallen"
    assert run.history.time[-1] < step * 1500
    data = report_data.ReportData(case, {"pulse": run.history})
    grid, *_ = build_ground_section(data).pieces
    row = dict(zip(grid.head, grid.rows[0], strict=True))
    whole = case.ground_motion()
    assert np.array_equal(data.motions["pulse"].horizontal, whole.horizontal)
    assert list(row.values()) == result_text.tabulate_motions([whole]).rows[0]


@pytest.mark.slow
def test_a_study_stands_in_a_report(kept, unplotted, tmp_path, capsys, monkeypatch):
    table = tomllib.loads(CASE)["suite"]["pairs"]["first"]["synthetic"]
    study, folder = tmp_path / "study.toml", tmp_path / "study"
    (tmp_path / "one.toml").write_text(
        CASE.partition("[suite]")[0]
        + f"[motion]\nsynthetic = {{ seed = 1, pga = {table['pga']} }}\n"
    )
    study.write_text(
        'title = "Breadths"\ncase = "one.toml"\ncompute = "limit"\nset = ["limit.horizontal=1"]\n'
        "[vary]\nstructure.breadth = [0.5, 1.0]\n"
    )
    drawn = Mock(side_effect=af.errors.InvalidInput("not drawn"))
    monkeypatch.setattr("archfem.view.studies.draw_findings", drawn)
    assert af.commands.main(["study", str(study), "--out", str(folder), "--workers", "1"]) == 0
    (shown,) = drawn.call_args.args
    assert shown["push"].attrs["units"] == "g"
    assert "factor" not in shown
    assert af.commands.main(["report", str(kept), "--study", str(folder)]) == 0
    shown = " ".join(words_of(kept / "report.html").split("Study of many cases")[2].split())
    assert "Study: Breadths." in shown
    assert "breadth [m] push [g] 0.5 0.25 1 0.5" in shown
    conclusion = " ".join(words_of(kept / "report.html").split())
    assert "In the study 'Breadths' the push is least, 0.25 g, at breadth = 0.5 m." in conclusion
    unvaried = conclusion.partition("were not varied")[0].rpartition(". ")[2]
    assert "engths (varied in statics alone), stiffness, friction, damp" in unvaried
    assert af.commands.main(["report", str(kept), "--study", str(tmp_path)]) == 1
    assert "has no study.txt: run `archfem study`" in capsys.readouterr().err
    (tmp_path / "progress.json").write_text("{}", encoding="utf-8")
    assert af.commands.main(["report", str(kept), "--study", str(tmp_path)]) == 1
    assert "has no study.txt: its study is not finished" in capsys.readouterr().err


@pytest.mark.slow
def test_studies_have_names_and_their_doubts_stand_in_a_report(kept, unplotted, tmp_path, capsys):
    """Long steps are a doubt of a stone that slides, and none of one that cannot."""
    large = CASE.replace("[record]", '[contacts."stone to stone"]\nfriction = 0.2\n[record]')
    large = large.replace('"rigid"\n', '"rigid"\ndisplacements = "large"\n[analysis]\ndt = 0.01\n')
    (tmp_path / "column.toml").write_text(large.replace("pga = 1.0", "pga = 4.0"))
    rough = "[\"contacts.'stone to stone'.friction=2\"]"
    for title, compute in (("Slides", "history"), ("Pushes", "limit")):
        (tmp_path / f"{title}.toml").write_text(
            f'title = "{title}"\ncase = "column.toml"\nset = ["limit.horizontal=1"]\n'
            f'compute = "{compute}"\n[cases]\n"as given" = {{}}\n"rough" = {{ set = {rough} }}\n'
            f'"as reported" = {{ set = {rough.replace("=2", "=0.6")} }}\n'
        )
    folders = {name: str(tmp_path / name) for name in ("Slides", "Pushes")}
    studies = {name: ["study", f"{place}.toml", "--out", place] for name, place in folders.items()}
    assert af.commands.main([*studies["Slides"], "--workers", "1"]) == 3
    doubts = [x for x in capsys.readouterr().out.splitlines() if x.startswith("in doubt: ")]
    words = "'as given' under 'first', 'as given' under 'second': steps of 10 ms are long for"
    assert all("'rough'" not in doubt for doubt in doubts if "for sliding" in doubt)
    assert any(doubt.startswith(f"in doubt: {words} sliding") for doubt in doubts)
    assert af.commands.main([*studies["Pushes"], "--workers", "1"]) == 3
    assert "in doubt: 'as given': joints slide (joint 0)" in capsys.readouterr().out
    shown = [each for place in folders.values() for each in ("--study", place)]
    assert af.commands.main(["report", str(kept), *shown]) == 0
    text = " ".join(words_of(kept / "report.html").split())
    head, _, rest = text.partition("What would change the answer?")
    said = "In the study 'Slides' under 'first' and 'second' none of 3 cases falls"
    for part in (head, rest):
        assert said in part
        assert "In the study 'Pushes' none lowers the push of 'as given'" in part
    assert "o property was varied" not in head
    assert f"In doubt, study: {words[0].upper()}{words[1:]}" in text
    assert "In doubt, study" in rest
    assert rest.count(words) == 2


def test_parts_of_a_bridge_state_the_lengths_that_are_left_out():
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(tomllib.loads(BRIDGE)), {})).rows
    left = {name: value for name, value, mark in rows if mark == "default"}
    assert left["sidewalls"] == "setback 0.4 m"
    assert left["backfill"].startswith("erosion 0 m; length without erosion to either")


def test_inputs_name_the_shape_and_what_is_measured_in_words():
    shape = {"shape": "buttressed_arch", "span": 3.0, "rise": 1.0, "thickness": 0.4}
    tables = {"structure": {**shape, "voussoirs": 7, "breadth": 0.9, "height": 0.8}}
    rows = tabulate_inputs(report_data.ReportData(af.Case.of(tables), {})).rows
    assert ("shape", "buttressed arch", "given") in rows
    (left,) = (value for name, value, _ in rows if name == "structure")
    assert "span and rise are those of the intrados" in left
