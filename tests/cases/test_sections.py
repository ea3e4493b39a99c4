"""Numbers of a report and of its tables: those of structure, dead load and runs."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from pages import head_of

import archfem as af
from archfem._files import replace_results
from archfem.cases import answers
from archfem.cases.analysis_keys import LimitAnalysis
from archfem.cases.case import case_of
from archfem.cases.report import (
    capacities,
    conclusion,
    inputs,
    outcomes,
    report_data,
    response,
    sections,
)
from archfem.cases.report.response import _check_row, supported_weight_ratio
from archfem.cases.result_text import tabulate_joints, tabulate_motions, tabulate_runs
from archfem.cases.run import MOTION_VARIABLE
from archfem.dynamics import VerdictRange
from archfem.models.model import Doubt
from archfem.view import style


def made_case(structure, **values):
    """A made-up case of a report, without demands."""
    none = {
        "limit": LimitAnalysis((), "coulomb"),
        "assessment": SimpleNamespace(spectrum=None, options={}),
    }
    own = {"title": "piers", "structure": structure, "report": {}, "suite": None, "target": None}
    return SimpleNamespace(**own | none | {"settings": {"structure": {}}} | values)


@pytest.fixture(scope="module")
def piers():
    """An arch on two piers, 2 m wide."""
    return af.arch_on_piers(
        **{"radius": 3.0, "thickness": 0.6, "voussoirs": 3, "pier_breadth": 1.2, "width": 2.0},
        courses=[0.5, 0.7],
    )


@pytest.fixture(scope="module")
def runs(piers):
    """Two runs of a tenth of a second, pushed to either side and up."""
    model, found = af.build(piers, fidelity="rigid"), {}
    shape = np.sin(np.linspace(0.0, 2.0 * np.pi, 21))
    for name, size in (("first", -0.6), ("second", 0.3)):
        motion = af.Motion(size * shape, 0.005, 0.5 * size * shape)
        found[name] = run = af.time_history(model, motion, dt=0.005)
        samples = np.column_stack([motion.horizontal, motion.vertical])
        run.dataset[MOTION_VARIABLE] = ("sample", "axis"), samples, {"dt": motion.dt}
    return found


def test_parts_are_listed_with_the_weight_that_moves(piers):
    grid = sections._tabulate_parts(piers)
    rows = {row[0]: dict(zip(grid.head, row, strict=True)) for row in grid.rows}
    for part, row in rows.items():
        blocks = [block for block in piers.blocks if block.part == part]
        free = [block for block in blocks if not block.fixed]
        assert row["blocks"] == str(len(blocks))
        assert row["of them fixed"] == str(len(blocks) - len(free))
        assert float(row["weight [kN]"]) == pytest.approx(
            2.0 * 20.0 * sum(block.area for block in free), rel=1e-3
        )
        assert row["role"] == blocks[0].role
    assert grid.caption == "Parts that can move"  # of a part that moves a block may be fixed
    pier = next(row for part, row in rows.items() if "pier" in part)
    assert pier["weight [kN]"] == f"{2.0 * 20.0 * 1.2 * 1.2:.4g}"
    assert pier["of them fixed"] == "1"


def test_the_names_of_a_wall_do_not_fill_pages(undrawn):
    """Stones are numbered in the picture; of 30 joints the caption would list each."""
    blocks = [af.Block(((0, -1), (6, -1), (6, 0), (0, 0)), af.STONE, "ground", fixed=True)]
    for level in range(4):
        cuts = [0, *(k + 0.5 * (level % 2) for k in range(1, 6)), 6]
        for k, (a, b) in enumerate(pairwise(cuts)):
            outline = ((a, level), (b, level), (b, level + 1), (a, level + 1))
            name = f"course {level}, stone {k}"
            blocks.append(af.Block(outline, af.STONE, name, part="wall", role="pier"))
    wall = af.masonry.assembled(blocks, af.Contact(1e9, 4e8))
    assert wall.heads.any()
    case = case_of(af.Analysis(wall, fidelity="rigid"))
    pieces = sections.build_structure_section(report_data.ReportData(case, {})).pieces
    (caption,) = (piece.caption for piece in pieces if piece.kind == "plate")
    begin = "The structure, 1 m thick, with numbers"
    assert caption == f"{begin} of stones in the order of the case, from 0 on."


def test_lost_blocks_are_listed_by_their_parts(piers):
    names = [piers.blocks[number].name for number in piers.free]
    ring = [block.name for block in piers.blocks if block.part == "arch"]
    left = next(b.name for b in piers.blocks if b.part == "left pier" and not b.fixed)
    assert outcomes.list_lost(piers, names[:2]) == ", ".join(names[:2])
    assert len(ring) == 3
    assert outcomes.list_lost(piers, [left, *ring, names[-1]]) == (
        "all of arch; 1 of 2 of left pier; 1 of 2 of right pier"
    )
    assert outcomes.list_lost(piers, names) == "all of left pier, arch and right pier"


def test_the_doubts_of_several_runs_stand_in_one_table(piers, runs, monkeypatch):
    """Those of one kind once, with the ends of their numbers; none with each run."""
    monkeypatch.setattr(response, "_build_envelopes", lambda *_: [])
    stated = {
        "first": [Doubt("steps of {:g} ms are long", "", (5.0,))],
        "second": [Doubt("steps of {:g} ms are long", "", (2.0,)), Doubt("it slips")],
    }
    made = {name: run.with_doubts(stated[name]) for name, run in runs.items()}
    case = SimpleNamespace(structure=piers, suite={}, title="piers", report={})
    data = report_data.ReportData(case, made)
    grid = response._build_suite_response(data)[-1]
    assert grid.caption == "Doubts of the runs"
    rows = dict(grid.rows)
    assert rows["steps of 2 to 5 ms are long"] == "first and second"
    assert rows["it slips"] == "second"
    monkeypatch.setattr(response, "summarise_outcome", lambda *_: "stands")
    (line, *_) = response._build_mechanism(data, made["second"])
    assert "it slips" not in line.text.lower()
    alone = report_data.ReportData(case, {"second": made["second"]})
    (line, *_) = response._build_mechanism(alone, made["second"])
    assert "It slips" in line.text or "it slips" in line.text


def test_falls_by_property_are_a_table_whose_cells_wrap(piers, tmp_path):
    """As text their lines were wider than a page, and broke before the last word."""
    rows = {
        "outcome": ["fallen"] * 8 + ["stands"] * 8,
        "displacement": np.zeros(16),
        "residual": np.zeros(16),
        "error": [""] * 16,
        "sampled": [True] * 16,
        "k_n": np.linspace(0.3, 3.0, 16),
    }
    columns = {name: ("run", np.asarray(values)) for name, values in rows.items()}
    attrs = {"properties": ["k_n"], "k_n": 2e9, "k_s": 1e9, "motion": "a"}
    found = VerdictRange(xr.Dataset(columns, attrs=attrs))
    path = tmp_path / "verdict_range.txt"
    path.write_text(str(found), encoding="utf-8")
    settings = dict[str, object]()
    case = SimpleNamespace(structure=piers, suite=None, settings=settings)
    data = report_data.ReportData(case, {})
    vars(data).update(files={path.name: path, "verdict_range.nc": path}, verdict_ranges=(found,))
    text, varied, table = response.build_range(data)[:3]
    assert varied.rows == [("k_n", "0.6 to 6 MPa/mm (default)")]  # of 2 MPa/mm
    settings["verdict"] = {"vary": {"k_n": [0.3, 3.0]}}
    assert response.build_range(data)[1].rows == [("k_n", "0.6 to 6 MPa/mm (given)")]
    assert found.sentence in f"f{text.text[1:]}"
    assert "explains" not in text.text
    assert table.caption.startswith("Falls by the value of each property")
    ((name, cell),) = table.rows
    assert cell.startswith("78%: ")  # all 7 of the lower two thirds, 1 of 9: 0.1944 / 0.25
    assert name == "k_n"
    assert cell.count(" of ") == 3
    assert table.manner == "words"


def range_of_steps(motion, size):
    """Variations of a run and half its step, and one sample, displaced by a size [m]."""
    rows = {
        **{"outcome": ["stands"] * 3, "displacement": [size] * 3, "residual": [size] * 3},
        **{"error": [""] * 3, "sampled": [False, False, True], "dt": ["as given", "half", "half"]},
    }
    columns = {name: ("run", np.asarray(values)) for name, values in rows.items()}
    attrs = {"properties": ["dt"], "k_n": 2e9, "k_s": 1e9, "motion": motion}
    return VerdictRange(xr.Dataset(columns, attrs=attrs))


@pytest.mark.parametrize(("given", "tables"), [({}, 1), ({"dt": "half"}, 2)])
def test_properties_that_all_motions_vary_alike_are_one_table(piers, tmp_path, given, tables):
    """No ratio of time steps is said of motions that move it by less than a millimetre."""
    made = [range_of_steps("a", 0.0002), range_of_steps("b", 0.02)]
    made[1].dataset["dt"][:] = [given.get("dt", x) for x in made[1].dataset["dt"].values]
    files = dict[str, Path]()
    for found in made:
        place = f"{found.dataset.attrs['motion']}/verdict_range"
        (tmp_path / place).parent.mkdir()
        files |= {f"{place}.{kind}": tmp_path / f"{place}.{kind}" for kind in ("txt", "nc")}
        files[f"{place}.txt"].write_text(str(found), encoding="utf-8")
    case = SimpleNamespace(structure=piers, suite={"pairs": {"a": {}, "b": {}}}, settings={})
    data = report_data.ReportData(case, {})
    vars(data).update(files=files, verdict_ranges=tuple(made))
    grids = [x for x in response.build_range(data) if x.kind == "grid"]
    varied = [x.caption for x in grids if x.caption.startswith("Varied properties")]
    assert len(varied) == 1
    assert varied[0].endswith("each alone, under each of 2 motions" if tables == 1 else "alone")
    heads = [x.head for x in grids if x.caption.startswith("Varied")]
    assert heads == [("property", "")] if tables == 1 else [("property", "'a'", "'b'")]
    (single,) = (x for x in grids if x.caption.startswith("Single"))
    ratio = "other time steps alone may change displacements 1.5 times"
    assert (ratio in single.caption) is not given
    vars(data)["verdict_ranges"] = (made[0],) * 2
    assert not any(ratio in x.caption for x in response.build_range(data) if x.kind == "grid")


@pytest.mark.parametrize(
    ("runs", "drawn"),
    [
        (["stands", "no answer"], True),
        (["dislocated (block 1)"], True),
        (["no answer", "no answer"], False),
        ([], False),
        (None, False),  # a folder without a table of runs
    ],
)
def test_a_search_without_an_answered_run_has_no_figure(runs, drawn, tmp_path, piers):
    """Its figure has the limit alone."""
    with replace_results(tmp_path, "scale", "inputs") as draft:
        (draft / "case.toml").touch()
        (draft / "scale.txt").write_text("a: stands\n\nstep  scale")
        style.new_axes(1.0, 1.0, "", "")[0].savefig(draft / "scale.png")
        if runs is not None:
            rows = [f"5 ms,{1.0 + k},as given,{run},-,-" for k, run in enumerate(runs)]
            (draft / "scale.csv").write_text("\n".join(["step,scale,properties,is,at,by", *rows]))
    data = report_data.ReportData(made_case(piers), {}, tmp_path)
    text, *others = sections._build_scale(data)
    assert text.text.startswith("a: stands")
    assert ("plate" in [piece.kind for piece in others]) is drawn


def test_a_part_without_a_name_has_a_dash(unplotted):
    """A block of no part, which is a ring, and its foundation."""
    stack = af.column(breadth=1.0, heights=[1.0])
    bare = [
        af.Block(block.outline, block.material, block.name, block.fixed) for block in stack.blocks
    ]
    structure = af.masonry.assembled(bare, stack.joints[0].contact)
    (row,) = sections._tabulate_parts(structure).rows
    assert row[:4] == ["–", "ring", "2", "1"]
    assert row[-1] == "1"  # one depth is no range
    case = case_of(af.Analysis(structure, fidelity="rigid"))
    text, *_ = sections.build_structure_section(report_data.ReportData(case, {})).pieces
    # without the foundation, which does not move
    points = np.concatenate([structure.blocks[number].points for number in structure.free])
    length, height = np.ptp(points, axis=0)
    assert f"{length:.3g} m long, {height:.3g} m high and 1 m wide; 1 blocks" in text.text
    (row,) = sections._tabulate_dead_load(
        af.dead_load(af.build(structure, fidelity="rigid")).joints
    ).rows
    assert row[0] == "–"


def test_the_extremes_of_each_part_are_those_of_its_joints(piers):
    """The second joint of a part has the largest |e|; another part is open all over."""
    parts = [joint.part for joint in piers.joints]
    first, other, *_ = dict.fromkeys(parts)
    resultants = np.zeros((len(parts), 3))
    for number, (part, depth) in enumerate(zip(parts, piers.depths, strict=True)):
        place = parts[:number].count(part)
        if part != other:
            normal = 1e3 * (place + 1.0)
            e = -0.3 if place == 1 else 0.1
            resultants[number] = normal, 0.2 * normal / (place + 1.0), e * normal * depth
    grid = sections._tabulate_dead_load(af.joints.joint_dataset(piers, resultants))
    rows = {row[0]: row[1:] for row in grid.rows}
    count = parts.count(first)
    names = [joint.name for joint in piers.joints if joint.part == first]
    assert rows[first] == ["0.300", names[1], "0.200", "1", f"{count}", "0"]
    where = next(joint.name for joint in piers.joints if joint.part == other)
    assert rows[other] == ["0.000", where, "0.000", "0", "0", str(parts.count(other))]


def test_the_first_lines_of_a_report_have_the_largest_of_all_runs(piers, runs):
    data = report_data.ReportData(made_case(piers), runs)
    facts = dict(conclusion.list_facts(data))
    counts = f"{len(piers.free)} blocks, {len(piers.joints)} joints"
    assert facts["structure"] == f"{counts}, 2 m wide"
    assert re.fullmatch(r"Does it withstand motions of PGA 0.03\d to 0.0\d+ g\?", facts["question"])
    doubtful = any(run.verdict.doubts for run in runs.values())
    assert facts.get("in doubt") == ("time histories" if doubtful else None)
    assert head_of(facts.items()).startswith(
        "It survives: it forms no mechanism under all 2 motions of"
    )
    one = report_data.ReportData(data.case, {"first": runs["first"]})
    said = head_of(conclusion.list_facts(one))
    assert said.startswith("It survives: it forms no mechanism under the motion 'first' of PGA")
    broken = af.History(runs["first"].dataset.assign_attrs(ended="interrupted"), piers)
    unknown = report_data.ReportData(data.case, {"first": broken})
    assert head_of(conclusion.list_facts(unknown)).startswith("It may or may not survive")
    none = report_data.ReportData(data.case, {})
    assert "verdict" not in dict(conclusion.list_facts(none))


def test_the_assumptions_name_the_law_of_the_joints(piers):
    limit = SimpleNamespace(strength=None)
    data = report_data.ReportData(
        SimpleNamespace(structure=piers, limit=limit, suite=None), {"first": None}
    )
    words = sections._describe_joints(data)
    assert "; joints close linearly with 1.48 MPa/mm, which was not varied; no cru" in words
    for properties, varied in ((("damping_ratio",), "not varied"), (("finish",), "varied")):
        vars(data)["verdict_ranges"] = (SimpleNamespace(properties=properties),)
        assert f", which was {varied}; " in sections._describe_joints(data)


def test_the_pga_of_a_report_is_that_of_the_motion_and_not_of_the_steps(piers):
    motion = af.Motion(np.array([0.0, 2.0, -1.0, 0.0]), 0.005)
    run = af.time_history(af.build(piers, fidelity="rigid"), motion, dt=0.003)
    assert np.abs(run.dataset["ground"]).max() < 1.9
    data = report_data.ReportData(made_case(piers), {"only": run})
    vars(data)["motions"] = {"only": motion}
    assert (
        dict(conclusion.list_facts(data))["question"] == "Does it withstand motions of PGA 0.2 g?"
    )


def test_a_report_of_several_runs_has_a_section_for_each(runs, piers, monkeypatch):
    """A single run has the only player, and no sections below its own."""
    for name in ("draw_motion", "draw_spectra", "draw_suite"):
        monkeypatch.setattr(response, name, lambda *_: None)
    monkeypatch.setattr(response.FigureBlock, "of", lambda figure, caption: caption)
    monkeypatch.setattr(response, "draw_envelopes", lambda *_: [])
    monkeypatch.setattr(response, "build_player", lambda *given: f"one of {given[-1]} players")
    case = made_case(piers)
    monkeypatch.setattr(response, "replace", lambda figure, **_: figure)
    one = report_data.ReportData(case, {"first": runs["first"]})
    assert one.dead["N"].values.tolist() == runs["first"].joints["N"].values[0].tolist()
    assert response.build_ground_section(one).title == "Ground motion"
    (section,) = response.build_run_sections(one)
    assert section.pieces[-1] == "one of 1 players"
    assert section.level == 2
    several = vars(case) | {"suite": {}, "report": {"pairs": "all"}}
    pairs = report_data.ReportData(SimpleNamespace(**several), runs)
    assert response.build_ground_section(pairs).title == "Ground motions"
    *_, first, second = response.build_run_sections(pairs)
    assert (first.pieces[-1], second.pieces[-1]) == ("one of 2 players",) * 2
    assert (first.level, second.level) == (3, 3)


def test_a_report_of_several_runs_shows_the_worst_of_them(runs, piers, undrawn, monkeypatch):
    """The first is pushed twice as hard as the second; an outcome counts before a displacement."""
    monkeypatch.setattr(response, "build_player", lambda *given: f"one of {given[-1]} players")
    case = SimpleNamespace(**vars(made_case(piers)) | {"suite": {}})
    data = report_data.ReportData(case, runs)
    every, worst = response.build_run_sections(data)
    assert (worst.title, worst.level) == (
        *("The worst as given, by outcome and then displacement: first", 3),
    )
    assert worst.pieces[-1] == "one of 1 players"
    assert every.pieces[1].caption == "First mechanisms at 1.00 × each motion"
    vars(data)["statements"] = {"scale": None}  # which may find some at less
    every, _ = response.build_run_sections(data)
    assert every.pieces[1].caption.endswith("; scaled ones form others at other scales")
    for table in every.pieces[:2]:  # outcomes and mechanisms
        assert [row[0] for row in table.rows] == ["first", "second"]
    worse = SimpleNamespace(verdict=replace(runs["second"].verdict, outcome="fallen"))
    data = report_data.ReportData(case, runs | {"second": worse})
    assert outcomes.find_worst_run(data) == "second"


def test_a_report_of_many_runs_draws_the_worst_beside_the_others(runs, piers, undrawn):
    """There are fewer line styles than runs."""
    many = {"first": runs["first"], **{f"{k}": runs["second"] for k in range(6)}}
    case = SimpleNamespace(structure=piers, suite={}, report={})
    assert len(response._build_envelopes(report_data.ReportData(case, many))) == 1
    case.report["pairs"] = "all"
    assert len(response._build_envelopes(report_data.ReportData(case, many))) == 2


def test_tables_and_figures_of_all_pairs_say_what_they_show(runs, piers, monkeypatch):
    """Each of two figures has its part named."""
    monkeypatch.setattr(response.FigureBlock, "of", lambda figure, caption: caption)
    monkeypatch.setattr(response, "draw_envelopes", lambda *_: [Figure(), Figure()])
    data = report_data.ReportData(SimpleNamespace(structure=piers, report={"pairs": "all"}), runs)
    _, *captions = response._build_suite_response(data)
    assert [text.rpartition("; ")[2] for text in captions] == [
        "part 1 of 2 of the motions",
        "part 2 of 2 of the motions",
    ]


def test_a_mechanism_is_stated_once(runs, piers):
    """That which moves, or else one by count; a fall has no size."""
    hit = af.limit.Mechanism("local", "arch", (1,), 1.0, names=("joint 1",), duration=0.1)
    found = {}
    for name, mechanisms in (
        ("first", {"any joints at once": hit, "verified": replace(hit, time=2.0)}),
        ("second", {"any joints at once": None, "verified": None}),
    ):
        verdict = replace(runs[name].verdict, mechanisms=mechanisms, outcome="fallen")
        dataset, joints = runs[name].dataset, runs[name].joints
        found[name] = SimpleNamespace(verdict=verdict, dataset=dataset, joints=joints, fall=None)
    data = report_data.ReportData(made_case(piers), found)
    (text,) = response._build_mechanism(data, found["first"])
    assert "Mechanism: verified, local mechanism of arch at 2.000 s by joint 1" in text.text
    other = SimpleNamespace(mechanisms={"verified": None, "any joints at once": hit})
    assert response.describe_mechanism(other).startswith("by any joints at once, local mech")
    (row, *_) = (row for _, row in capacities._capacity_rows(data))
    assert row[2] == "fallen in 2 of 2 runs"


def test_a_run_that_was_broken_off_is_reported_as_such(runs, piers, monkeypatch):
    monkeypatch.setattr(response, "draw_envelopes", lambda *_: [])
    monkeypatch.setattr(response, "build_player", lambda *_: "player")
    whole, case = runs["first"], SimpleNamespace(title="piers", structure=piers, suite=None)
    broken = af.History(whole.dataset.assign_attrs(ended="interrupted"), piers)
    for run, said in ((whole, 0), (broken, 1)):
        blocks = response.build_run_sections(report_data.ReportData(case, {"run": run}))[0].pieces
        assert blocks[-1] == "player"
        texts = [getattr(block, "text", "") for block in blocks]
        assert (f"The run is not complete: {broken.outcome}." in texts) == bool(said)


def test_a_folder_without_a_run_has_no_files_to_report(tmp_path):
    with replace_results(tmp_path, "modes", "some inputs") as draft:
        (draft / "modes.txt").write_text("mode 1 at 3.14 Hz")
    assert report_data.ReportData(None, {}, tmp_path).files == {}


@pytest.mark.parametrize(
    ("fidelity", "expected"),
    [
        ("faces", "faces"),
        ("pier: left: full, rest: faces", {"pier: left": "full", "rest": "faces"}),
    ],
)
def test_a_player_takes_the_model_that_was_selected(fidelity, expected, monkeypatch):
    """By name, or by part as `Discretisation.name` writes it; a model of the case stays its own."""
    seen = []

    def built(structure, discretisation):
        seen.append(discretisation)
        return SimpleNamespace(size=3)

    monkeypatch.setattr(report_data, "build", built)
    monkeypatch.setattr(report_data, "Scene", lambda *given: given)
    monkeypatch.setattr(report_data, "Player", lambda scene: scene)
    own = af.models.Discretisation("rigid")
    run = SimpleNamespace(dataset=xr.Dataset({"q": ("coordinate", np.zeros(3))}))
    run.dataset.attrs["fidelity"] = fidelity
    for selects in (True, False):
        analysis = SimpleNamespace(discretisation=own, selects_model=selects)
        case = SimpleNamespace(structure=None, analysis=analysis)
        assert report_data.build_player(case, run, "a title")[2].size == 3
    assert seen == [af.models.Discretisation(expected), own]


def test_a_table_of_runs_has_the_largest_of_each(runs):
    table = tabulate_runs(runs)
    assert {len(row) for row in table.rows} == {len(table.head)}
    rows = [dict(zip(table.head, row, strict=True)) for row in table.rows]
    for row, (name, run), size in zip(rows, runs.items(), (0.6, 0.3), strict=False):
        e = np.abs(run.joints["eccentricity"].values)
        assert row["pair"] == name
        assert row["doubts"] == (str(len(run.verdict.doubts)) if run.verdict.doubts else "none")
        assert (row["max |ax|"], row["max |ay|"]) == (f"{size:.2f} m/s²", f"{size / 2:.2f} m/s²")
        assert row["max |e|"] == f"{e.max():.3f}"
        assert row["joint"] == str(run.joints["name"].values[e.max(axis=0).argmax()])
        assert row["max V/N"] == f"{float(run.joints['friction'].max()):.3f}"
        assert row["opened"] == "-"
        assert row["end"] == "reached 0.10 s"
    assert rows[-1]["pair"] == "all"
    assert rows[-1]["residual"] == "-"


@pytest.mark.parametrize("ended", ["finished", "met", "parted"])
def test_numbers_of_joints_say_until_when_where_loose_blocks_followed(ended, runs):
    run = runs["first"]
    run = replace(run, dataset=run.dataset.assign_attrs(ended=ended))
    table, until = tabulate_runs({"first": run}), " until 0.10 s" * (ended != "finished")
    row = dict(zip(table.head, table.rows[0], strict=True))
    for key, values in ("max |e|", run.joints["eccentricity"]), ("max V/N", run.joints["friction"]):
        assert row[key] == f"{float(abs(values).max()):.3f}{until}"
    assert row["any joints at once"] == f"none{until}"
    assert table.rows[-1][table.head.index("any joints at once")] == (
        "unknown" if until else "0 of 1"
    )
    assert response.describe_mechanism(run.verdict) == f"none by any definition{until}"
    data = SimpleNamespace(dead=run.joints.isel(time=0))
    assert ("until 0.10 s, before" in response._tabulate_joints(data, run).caption) is bool(until)


def test_an_open_joint_is_the_most_eccentric_unless_another_exceeds_its_edge(runs):
    """|e| of 0.5 stands for it."""
    run = runs["first"]
    for e, expected in ((0.499, 2), (0.51, 4)):
        joints = run.joints.copy(deep=True)
        joints["eccentricity"][:, 4] = e
        joints["eccentricity"][3, 2] = np.nan
        joints["open"][3, 2] = True
        shaken = SimpleNamespace(
            joints=joints,
            verdict=run.verdict,
            dataset=run.dataset,
            ending=run.ending,
            time=run.time,
        )
        table = tabulate_runs({"one": shaken})
        row = dict(zip(table.head, table.rows[0], strict=True))
        assert row["joint"] == str(joints["name"].values[expected])
        assert row["opened"] == "1 joints"


def test_a_table_of_joints_has_when_they_hinged_first_and_how_long_at_most(runs):
    """Steps of 5 ms: from 10 ms on for three of them, and again for one."""
    joints = runs["first"].joints.copy(deep=True)
    time = joints["time"].values
    joints["hinge"][:] = 0
    joints["slide"][:] = False
    joints["hinge"][2:5, 1] = -1
    joints["hinge"][9, 1] = 1
    joints["slide"][7, 2] = True
    table = tabulate_joints(joints)
    rows = [dict(zip(table.head, row, strict=True)) for row in table.rows]
    assert rows[1]["hinge from"] == f"{time[2]:.3f} s"
    assert rows[1]["hinge for"] == "0.015 s"
    assert (rows[1]["slide from"], rows[1]["slide for"]) == ("-", "-")
    assert (rows[2]["slide from"], rows[2]["slide for"]) == (f"{time[7]:.3f} s", "0.005 s")
    assert rows[1]["e dead"] == "open"
    e = joints["eccentricity"].values[:, 1]
    assert (rows[1]["e min"], rows[1]["e max"]) == (f"{e.min():.3f}", f"{e.max():.3f}")


def test_components_of_a_motion_are_named_where_there_are_several():
    shape = np.sin(np.linspace(0.0, 6.0, 200))
    one, two = af.Motion(shape, 0.01, name="one"), af.Motion(shape, 0.01, 0.5 * shape, name="two")
    rows = tabulate_motions([one, two]).rows
    assert [row[:3] for row in rows] == [
        ["one", "only one", "200"],
        ["two", "horizontal", "200"],
        ["two", "vertical", "200"],
    ]


def test_ground_that_drifts_on_is_marked_at_its_displacement():
    """A sine of 1 m/s², whose velocity ends at zero after a period, and at 2 / ω after a half."""
    for end, mark in ((2.0 * np.pi, ""), (np.pi, " (drifts: ends at 2 m/s)")):
        times = np.arange(0.0, end, 1e-3)
        row = tabulate_motions([af.Motion(np.sin(times), 1e-3)]).rows[0]
        assert row[6].partition(" m")[2] == mark


@pytest.mark.parametrize(
    ("value", "text"), [(0.1234, "0.123"), (99.9, "99.900"), (101.0, "> 100"), (np.nan, "open")]
)
def test_a_ratio_near_opening_is_only_said_to_be_large(value, text, runs):
    run = runs["first"]
    joints = run.joints.copy(deep=True)
    joints["friction"][:] = value
    shaken = SimpleNamespace(
        joints=joints, verdict=run.verdict, dataset=run.dataset, ending=run.ending, time=run.time
    )
    table = tabulate_runs({"one": shaken})
    assert dict(zip(table.head, table.rows[0], strict=True))["max V/N"] == text


def test_motions_of_a_suite_are_shown_before_they_were_scaled_and_reduced(monkeypatch):
    seen = []

    def draw(suite, target):
        seen.append(suite)
        return SimpleNamespace()

    monkeypatch.setattr(response, "draw_suite", draw)
    monkeypatch.setattr(response.FigureBlock, "of", lambda figure, caption: caption)
    motion = af.Motion(np.array([0.0, 1.0, -0.5]), 0.01)
    for given, factor in (({}, 1.0), ({"scale": 1.5, "reduction": 4.0}, 4.0 / 1.5)):
        data = SimpleNamespace(case=made_case(None, suite=given))
        (caption,) = response._build_spectra(data, [motion])
        assert seen[-1].pairs[0].horizontal == pytest.approx(factor * motion.horizontal)
        assert (seen[-1].scale, seen[-1].reduction) == (
            given.get("scale", 1.0),
            given.get("reduction", 1.0),
        )
        assert ("R = 4;" in caption) == ("reduction" in given)
    for matched in (True, False):
        case = made_case(None, suite={"matched": matched}, target="some")
        (caption,) = response._build_spectra(SimpleNamespace(case=case), [motion])
        assert caption.endswith("; they were not matched to the target") != matched
    case.assessment.spectrum, case.target = "another", None
    (caption,) = response._build_spectra(SimpleNamespace(case=case), [motion])
    assert caption.endswith(", which is the spectrum of [assessment]")


def test_sentences_begin_with_a_capital_and_end_with_one_stop():
    assert outcomes.sentence(" it stands ") == "It stands."
    assert outcomes.sentence("it stands.") == "It stands."


@pytest.mark.parametrize(("players", "megabytes"), [(1, 8.0), (4, 2.0), (100, 0.8)])
def test_players_of_a_page_share_its_size_but_stay_legible(players, megabytes, monkeypatch):
    seen = []
    monkeypatch.setattr("archfem.cases.report.report_data.MAX_PACKED_BYTES", 8_000_000)
    monkeypatch.setattr("archfem.cases.report.report_data.Scene", lambda *given: seen.append(given))
    monkeypatch.setattr("archfem.cases.report.report_data.Player", lambda scene: scene)
    case, run = SimpleNamespace(structure=None), SimpleNamespace(dataset={})
    report_data.build_player(case, run, "a title", players)
    assert seen[0][4] == 1e6 * megabytes
    report_data.build_player(case, run, "the only one")
    assert seen[1][4] == 8e6


def test_supports_are_judged_by_the_first_record_and_iterations_by_the_largest(piers, runs):
    """That of the dead load, which supports bear whole; later they bear inertia too."""
    run = runs["first"]
    small = SimpleNamespace(structure=piers, analysis=SimpleNamespace(displacements="small"))
    row = _check_row(small, "first", run)
    later = supported_weight_ratio(piers, run.joints.isel(time=1, drop=True))
    assert row[2] == "1.0000 of the weight"
    assert f"{later:.4f}" != "1.0000"
    assert row[3] == f"≤ {int(run.dataset['iterations'].max())}"
    assert (row[0], row[-1]) == ("first", run.outcome)


@pytest.mark.parametrize("moves", [True, False])
def test_caption_and_definitions_of_an_assessment_are_of_what_was_computed(moves):
    """To the left it has no finite motion, and to the right only where it moves."""
    checks = [answers.Ratios("linear", ("right", "left"), 1.5, 1.5, linear=True)]
    checks += [answers.Ratios("NTC-2018 SLV", ("right",), 1.2, 1.2)] * moves
    rows = [answers.Row("assessment", "-", "-", "-", each._asdict()) for each in checks]
    texts = [f"{way}: kinematic assessment of a wall\nlinear: passes" for way in ("right", "left")]
    texts[0] += "\nNTC-2018 SLV: capacity 0.1 m" * moves
    files = ["assessment_0.png", "assessment_1.png"]
    data = SimpleNamespace(
        read_text=lambda _: "\n\n".join(["least margin 1.2", *texts]),
        files=[*files, "assessment.txt"],
        statements={"assessment": answers.Statement([], rows)},
        case=SimpleNamespace(assessment=SimpleNamespace(options={})),
        read_figure=lambda name, caption: [(name, caption)],
    )
    _, table, *figures = sections._build_assessment(data)
    begins = "Mechanism as it begins, {}; it has no curve, as it has no displacement check."
    curve = "(a) Mechanism at the displacement capacity, and (b) capacity curve with demand, right."
    drawn = [(files[0], curve), (files[1], begins.format("left"))]
    assert figures == (drawn if moves else [(files[0], begins.format("right"))])
    names = {name for name, _ in table.rows}
    assert ({"d_0*", "T", "NTC-2018 SLV"} <= names) is moves
    assert "T_s" not in names
    words = str(table.rows)
    assert ("displacement" in words) is moves
    assert "e* = g M* / Σ P, with the weights P that move alone" in words


def test_openings_of_a_wall_given_by_its_blocks_are_measured():
    opening = af.shapes.Opening(left=-0.7, breadth=1.4, head=2.0, name="door")
    wall = af.shapes.wall(breadth=4.0, height=3.0, width=0.5, course=0.5, openings=[opening])
    words = "1.4 m wide and 2 m high, from x = -0.7 m, y = 0 m"
    assert ("opening", words, "inferred") in [*inputs._measure_rows(wall)]


def test_the_rise_of_a_ring_is_that_of_its_whole_corners():
    """The keystone's neighbour has lost 60 × 60 mm at the intrados, near the crown."""
    ring = af.circular_arch(radius=2.0, embrace=140.0, thickness=0.3, voussoirs=11)
    stones = [
        af.Block(tuple(map(tuple, x.points)), x.material, x.name, x.fixed, part=x.part, role=x.role)
        for x in ring.blocks
    ]
    key = max(range(len(stones)), key=lambda n: stones[n].points[:, 1].mean())
    low = stones[key].points[stones[key].points[:, 1].argsort()[:2]]  # ends of its intrados
    right = low[low[:, 0].argmax()]
    others = [n for n in range(len(stones)) if n != key]
    chipped = min(others, key=lambda n: np.linalg.norm(stones[n].points - right, axis=1).min())
    points = stones[chipped].points
    corner = int(np.linalg.norm(points - right, axis=1).argmin())
    ends = points[corner - 1], points[(corner + 1) % len(points)]
    away = [end - points[corner] for end in ends]
    cut = [points[corner] + 0.06 * step / np.linalg.norm(step) for step in away]
    outline = tuple(map(tuple, [*points[:corner], *cut, *points[corner + 1 :]]))
    whole, stones[chipped] = [*stones], replace(stones[chipped], outline=outline)
    rises = []
    for blocks in (whole, stones):
        structure = af.masonry.assembled(blocks, ring.joints[0].contact)
        ((_, words, _), *_) = inputs._measure_rows(structure)
        rises.append(re.search(r"rise (\S+) m", words)[1])
    assert rises[0] == rises[1]


@pytest.mark.parametrize("norm", ["EN 1998-1", "NTC 2018"])
def test_a_norm_without_an_assessment_is_named_as_such(piers, norm, tmp_path):
    data = report_data.ReportData(made_case(piers, settings={}), {})
    data.case.report["norm"] = norm
    vars(data)["files"] = {"assessment.txt": tmp_path}
    (grid,) = sections.build_method_section(data).pieces
    clause = "; EN 1998-1 itself has no such check" * (norm == "EN 1998-1")
    said = f"assessment: NTC 2018, with its Circolare 7/2019, C8.7.1.2{clause}"
    assert said in dict(grid.rows)["methods"]
