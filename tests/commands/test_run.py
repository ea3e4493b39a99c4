"""Commands on cases: printed results and written files."""

import io
import json
import re
import tomllib
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from backfilled import slender_bridge
from pages import read_page

import archfem as af
from archfem.cases import run as run_module
from archfem.cases.report.doubts import HISTORIES, list_notes
from archfem.cases.report.report_data import ReportData
from archfem.cases.result_text import ResultTable, record_doubts
from archfem.cases.run import carry_out, run_time_history
from archfem.commands import margin
from archfem.commands.run import print_results
from archfem.dynamics import fall, motion_scaling, time_history
from archfem.dynamics.motion_scaling import CollapseScale
from archfem.dynamics.scale_search import MechanismScales, ScaledRun
from archfem.errors import logger
from archfem.models.model import Doubt
from archfem.studies import study, variations
from archfem.studies.evaluators import evaluate_limit

RING = Path(__file__).parents[2] / "meshes" / "ring_paper.toml"


def test_run_command(tmp_path, undrawn, capsys):
    changes = ["model.fidelity=rigid", "motion.end=0.5", "output.animation=false"]
    changes += ["structure.voussoirs=7"]
    given = [part for change in changes for part in ("--set", change)]
    assert af.commands.main(["run", str(RING), "--out", str(tmp_path / "out"), *given]) == 0
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert made == {
        "archfem.json",
        "case.toml",
        "dead.png",
        "names.png",
        "modes.txt",
        "modes.csv",
        "modes.png",
        "history.nc",
        "summary.txt",
        "critical_instant.png",
        "envelope.png",
        "joints.png",
    }
    run = af.History.read(tmp_path / "out" / "history.nc")
    assert run.time[-1] == pytest.approx(0.5)
    assert af.Case.of(tomllib.loads(run.dataset.attrs["case"])).analysis.fidelity == "rigid"
    said = capsys.readouterr().out
    assert "joint 7" in said
    assert "dead load: stands under its own weight: |e| ≤ " in said
    assert (tmp_path / "out" / "modes.txt").read_text(encoding="utf-8") in said
    assert "damping: 5 % at 8.00 and 16.00 Hz" in said


def test_a_case_without_modes_is_shaken_with_usual_damping(
    tmp_path, unplotted, monkeypatch, capsys
):
    def none(model, count, start):
        raise af.DidNotConverge(f"none of {count}")

    monkeypatch.setattr("archfem.statics.modes.modes", none)
    changes = ["model.fidelity=rigid", "motion.end=0.1", "output.animation=false"]
    given = [part for change in changes for part in ("--set", change)]
    assert af.commands.main(["run", str(RING), "--out", str(tmp_path), *given]) == 0
    assert "no modes about dead load: none of 4\ndamping: 5 %" in capsys.readouterr().out


@pytest.mark.parametrize("count", [1, 2, 3])
def test_modes_are_tabulated_and_the_first_two_filmed(count, tmp_path, unplotted, monkeypatch):
    filmed = []

    def film(modes, path, numbers):
        filmed.extend(numbers)
        path.touch()
        return path

    monkeypatch.setattr("archfem.view.films.film.film_modes", film)
    given = ["--count", str(count), "--set", "model.fidelity=rigid", "--out", str(tmp_path)]
    assert af.commands.main(["modes", str(RING), *given]) == 0
    assert filmed == [1, 2][:count]
    table = (tmp_path / "modes.txt").read_text(encoding="utf-8")
    assert len(re.findall(r"^\d+ +[\d.]+ Hz", table, re.MULTILINE)) == count


@pytest.mark.slow
def test_criteria_of_a_case_are_obeyed(tmp_path, unplotted, capsys):
    """Four joints reach |e| = 0.38 at once, and never 0.46."""
    changes = ["model.fidelity=rigid", "motion.end=3.5", "analysis.until=counted mechanism"]
    changes += ["motion.scale=0.8", "output.animation=false"]
    changes += ["analysis.damping={ratio=0.05, frequency=8.0}"]
    given = [part for change in changes for part in ("--set", change)]
    assert af.commands.main(["run", str(RING), "--out", str(tmp_path / "usual"), *given]) == 0
    assert (
        "no mechanism; one motion, one set of properties: range not computed"
        in capsys.readouterr().out
    )
    loose = ["--set", "criteria.hinge=0.38"]
    assert (
        af.commands.main(["run", str(RING), "--out", str(tmp_path / "loose"), *given, *loose]) == 0
    )
    run = af.History.read(tmp_path / "loose" / "history.nc")
    assert run.criteria == af.Criteria(hinge=0.38)
    assert run.ending is af.dynamics.Ending.EVENT
    assert run.mechanism.time == run.time[-1]
    assert (
        f"Demirel and Aldemir: local mechanism of arch at {run.mechanism.time:.3f}"
        in capsys.readouterr().out
    )
    assert af.Case.read(tmp_path / "loose" / "case.toml").analysis.criteria == run.criteria
    assert af.Case.read(RING).analysis.failure_criteria == af.Criteria()


def test_mesh_command(tmp_path):
    path = tmp_path / "ring.msh"
    assert (
        af.commands.main(["mesh", str(RING), "--out", str(path), "--set", "model.cells=[2, 2]"])
        == 0
    )
    assert np.any(["voussoir 3" in line for line in path.read_text().splitlines()])


def run(small, *changes):
    given = [part for change in changes for part in ("--set", change)]
    return af.commands.main(["run", str(small), "--out", str(small.parent / "out"), *given])


def test_one_command_runs_all_and_again_keeps_finished_runs(small, undrawn, request, capsys):
    out = small.parent / "out"
    assert run(small) == 0
    made = {path.name for path in out.iterdir()}
    assert made >= {"first", "second", "spectra.png", "envelope.png", "suite.txt"}
    assert {path.name for path in (out / "first").iterdir()} == {
        "history.nc",
        "summary.txt",
        "motion.png",
        "critical_instant.png",
        "envelope.png",
        "joints.png",
    }
    table = (out / "suite.txt").read_text()
    # 1 m/s² by R = 2
    assert re.search(r"^first .* 0\.50 m/s² +0\.33 m/s² ", table, re.MULTILINE)
    assert re.search(r"^second +no mechanism +none .* none +reached 1\.00 s$", table, re.MULTILINE)
    said = capsys.readouterr()
    assert "finished before" not in said.out
    # before anything else is printed
    blocks = len(af.Case.read(small).structure.free)
    assert re.match(rf".*: dead load of {blocks} blocks\n.*: modes and motions\n", said.err)

    for name in ("unplotted", "undoubted"):  # the first command has drawn and compared
        request.getfixturevalue(name)
    before = (out / "second" / "history.nc").stat().st_mtime_ns
    (out / "first" / "history.nc").unlink()
    assert run(small) == 0
    said = capsys.readouterr().out
    assert "second: finished before" in said
    assert "first: finished before" not in said
    assert (out / "second" / "history.nc").stat().st_mtime_ns == before
    assert (out / "suite.txt").read_text() == table

    assert run(small, "suite.scale=2") == 0
    assert "finished before" not in capsys.readouterr().out
    table = (out / "suite.txt").read_text()
    assert re.search(r"^first .* 1\.00 m/s² +0\.67 m/s² ", table, re.MULTILINE)


@pytest.mark.slow
def test_pairs_that_workers_have_run_were_not_finished_before(
    small, undrawn, unplotted, undoubted, monkeypatch, capsys
):
    def compute(case, draft, workers):
        """Run the pairs that are missing, as workers do."""
        for pair in case.suite["pairs"]:
            if not (draft / pair / "history.nc").exists():
                study.save_pair(case.alone(pair), str(draft))

    monkeypatch.setattr(study, "compute_pairs", compute)
    out = str(small.parent / "out")
    command = ["run", str(small), "--out", out, "--workers", "2"]
    assert af.commands.main(command) == 0
    said = capsys.readouterr().out
    assert "time history: first, " in said
    assert "finished before" not in said
    (small.parent / "out" / "first" / "history.nc").unlink()
    assert af.commands.main(command) == 0
    said = capsys.readouterr().out
    assert "second: finished before" in said
    assert "first: finished before" not in said


def run_with(small, shake, monkeypatch):
    """Carry out a case as `archfem run` does, with another function that runs a motion."""
    case, out = af.Case.read(small), small.parent / "out"
    with monkeypatch.context() as patch:
        patch.setattr(run_module, "run_time_history", shake)
        print_results(case, carry_out(case, out), out)


@pytest.mark.slow
def test_a_range_in_doubt_has_the_exit_code_of_doubts(small, unplotted, monkeypatch, capsys):
    compute = variations.verdict_range

    def doubted(*arguments, **options):
        found = compute(*arguments, **options)
        found.dataset.attrs["doubts"] = json.dumps([("fill is rigid", "cut it")])
        return found

    monkeypatch.setattr(variations, "verdict_range", doubted)
    out = small.parent / "out"
    given = ["verdict", str(small), "--samples", "1", "--pair", "first", "--out", str(out)]
    assert af.commands.main(given) == 3
    assert "fill is rigid; cut it" in (out / "first" / "verdict_range.txt").read_text(
        encoding="utf-8"
    )


TIED = """
[structure]
shape = "column"
breadth = 0.5
heights = [2.0, 2.0]
[assessment]
direction = 1
spectrum = { code = "EC8", ag = 0.25, ground = "B" }
[[assessment.loads]]
block = "block 1"
point = [0.0, 2.0]
force = ["-3 kN", "0 kN"]
passive = true
"""


def test_the_note_on_forces_of_ties_is_printed_once(tmp_path, capsys):
    """Of a wall and what is above its tie, each with its own stretch."""
    (path := tmp_path / "tied.toml").write_text(TIED, encoding="utf-8")
    assert af.commands.main(["assess", str(path)]) == 3
    text = capsys.readouterr().out
    assert text.count("note: pushed to the right, alpha_0 needs ") == 2
    assert len({*re.findall(r"to the capacity stretched by (\S+) mm", text)}) == 2
    assert text.count("forces of ties are in all for 1 m of width") == 1


WHOLE = """
base = "whole.toml"
[assessment]
direction = 1
spectrum = { code = "EC8", ag = 0.13, ground = "A", type = 1 }
limit_state = "NTC-2018 SLC"
"""


def test_a_whole_gable_with_its_roof_in_the_stones_is_in_doubt(tmp_path, capsys):
    """Its strip is not known; without the roof it is assessed, and the least margin is its own."""
    wall = {"shape": "wall", "breadth": 5.0, "height": 4.0, "eaves": 2.0, "width": 0.5}
    wall |= {"course": 0.5, "stone": 1.0}
    for floors in ({}, {"floors": {"roof": {"level": 4.0, "load": "4 kN/m"}}}):
        made = af.Case.of({"structure": wall | floors}).structure
        whole = af.masonry.columns_across(made)["whole"]
        af.Analysis(whole, fidelity="rigid", displacements="large").write(tmp_path / "whole.toml")
        (path := tmp_path / "assessed.toml").write_text(WHOLE, encoding="utf-8")
        code, text = af.commands.main(["assess", str(path)]), capsys.readouterr().out
        least = 2.0 / 1.35 * 0.5 / 4.0 / 0.13 * 9.81 / af.units.STANDARD_GRAVITY
        strip = f"least margin {least:.3g} (" in text and "right, strip through the highest" in text
        doubted = "in doubt: the weights of its upper courses are with 'roof'" in text
        assert (strip, doubted) == (not floors, bool(floors))
        assert code == 3


LEFT_OUT = """
[assessment]
spectrum = { code = "EC8", ag = 0.1, ground = "A" }
[[assessment.loads]]
block = "block 2"
point = [0.0, 2.0]
weight = "12 kN"
force = ["1 kN", "0 kN"]
[[assessment.loads]]
block = "block 2"
point = [0.0, 2.0]
force = ["-5 kN", "0 kN"]
passive = true
"""


@pytest.mark.slow
def test_loads_of_the_assessment_that_a_motion_leaves_out_are_noted(small, unplotted, monkeypatch):
    """In the results of runs, ranges and scales, and in the conclusion of their report."""

    class Range:
        doubts, save, plot = (), None, None

        def __str__(self):
            return "falls in none of 1 variations"

    written = {}

    def keep(command, case, out, text, files, pair=None):
        written[command] = text

    monkeypatch.setattr(variations, "verdict_range", lambda *given, **options: Range())
    monkeypatch.setattr(margin, "write_results", keep)
    small.write_text(small.read_text(encoding="utf-8") + LEFT_OUT, encoding="utf-8")
    out = small.parent / "out"
    note = "without the 12 kN of weights, constant forces and ties of [assessment], which limits"
    run(small)
    for pair in ("first", "second"):
        assert note in (out / pair / "summary.txt").read_text(encoding="utf-8")
    for command in ("verdict", "scale"):
        af.commands.main([command, str(small), "--pair", "first", "--out", str(out)])
        assert note in written[command]
    found = af.cases.open_results(out)
    said = list_notes(ReportData(found.case, found.runs))[HISTORIES][-1]
    assert said.startswith(note)
    assert said.endswith("or as bodies, [structure.standing]")


@pytest.mark.slow
def test_a_range_is_that_of_the_case_and_marked_as_given(small, unplotted):
    """Ranges of a survey in [verdict]; 1 is the run as given, and a single value is held."""
    out, ranges = small.parent / "out", '[verdict.vary]\nk_n = [0.1, 20]\nsign = "as given"\n'
    small.write_text(f"{small.read_text(encoding='utf-8')}{ranges}", encoding="utf-8")
    assert run(small) == 0
    given = ["verdict", str(small), "--samples", "1", "--pair", "first", "--out", str(out)]
    assert af.commands.main(given) == 0
    found = xr.load_dataset(out / "first" / "verdict_range.nc")
    alone = found.isel(run=slice(-1))
    assert {*alone["k_n"].values.tolist()} == {0.1, 1.0, 20.0}
    assert {*alone["k_s"].values.tolist()} == {1.0 / 3.0, 1.0, 3.0}
    assert {*found["sign"].values.tolist()} == {"as given"}
    assert af.commands.main(["report", str(out)]) == 0
    words = " ".join(read_page((out / "report.html").read_text(encoding="utf-8")).words)
    stiff = found.attrs["k_n"] / 1e9
    assert f"k_n {0.1 * stiff:.3g} to {20.0 * stiff:.3g} MPa/mm given" in words
    assert "sign as given given" in words
    assert re.search(r"k_s \S+ to \S+ MPa/mm default", words)


@pytest.mark.parametrize("out", [[], ["--out", "out"]])
def test_a_range_keeps_its_runs_in_its_folder(small, monkeypatch, capsys, out):
    def interrupted(analysis, motion, *, folder, **options):
        assert folder == (Path("out/variations/first") if out else None)
        raise KeyboardInterrupt

    monkeypatch.setattr(variations, "verdict_range", interrupted)
    monkeypatch.chdir(small.parent)
    assert af.commands.main(["verdict", str(small), "--pair", "first", *out]) == 130


@pytest.mark.slow
def test_a_range_is_of_each_motion_of_a_suite_and_replaces_none_of_another(
    small, unplotted, capsys
):
    out = small.parent / "out"
    given = ["verdict", str(small), "--samples", "1", "--out", str(out)]
    assert af.commands.main([*given, "--pair", "second"]) == 0
    assert not (out / "first").exists()
    assert run(small) == 0
    capsys.readouterr()
    assert af.commands.main(given) == 0
    said = capsys.readouterr().err
    assert "verdict: pair 1 of 2, 'first'\n" in said
    assert "verdict: pair 2 of 2, 'second'\n" in said
    for pair in ("first", "second"):
        assert xr.load_dataset(out / pair / "verdict_range.nc").attrs["motion"] == pair
        assert (out / pair / "history.nc").is_file()
    assert not (out / "verdict_range.nc").exists()
    assert af.commands.main(["report", str(out)]) == 0
    words = " ".join(read_page((out / "report.html").read_text(encoding="utf-8")).words)
    for pair in ("first", "second"):
        assert re.search(rf"nder '{pair}' it falls in none of \d+ variations", words)
        assert f"variations under '{pair}'" in words
        assert f"Single changes under '{pair}'; the worst first" in words


@pytest.mark.parametrize(
    ("displacements", "head", "says"),
    [
        pytest.param(
            "large",
            "step",
            r"tap: stands at \S+ g \(.*\), a mechanism at 0.976 ×, dislocated at "
            r"\S+ × \(block 1\), falls",
            marks=pytest.mark.slow,
        ),
        ("small", "mechanism", r"tap: no mechanism at \S+ g \(.*, first mechanism at .*, by "),
    ],
)
def test_scale_command(tmp_path, undrawn, capsys, displacements, head, says):
    """A slender block under half a sine of 0.4 s, which does not topple below b / h = 0.25 g."""
    pulse = 2.5 * np.sin(np.pi * np.linspace(0.0, 1.0, 41))
    np.savetxt(tmp_path / "tap.txt", [*pulse, *np.zeros(60)])
    (tmp_path / "block.toml").write_text(
        f"""
title = "Block"
structure = {{ shape = "column", breadth = 0.25, heights = [1.0] }}
model = {{ fidelity = "rigid", displacements = "{displacements}" }}
motion = {{ file = "tap.txt", dt = 0.01, units = "m/s2" }}
"""
    )
    given = ["scale", str(tmp_path / "block.toml"), "--out", str(tmp_path / "out")]
    code = af.commands.main(given)
    said = capsys.readouterr().out
    text = (tmp_path / "out" / "scale.txt").read_text(encoding="utf-8")
    assert code == (3 if "in doubt: " in text else 0)
    assert said.startswith("Block\n" + text.rstrip())
    assert re.match(says.replace("tap", "tap.*"), text), text
    assert f"\n\n{head} " in text
    runs = {"scale.csv", "scale.png"} if displacements == "large" else set()
    assert {path.name for path in (tmp_path / "out").iterdir()} == runs | {
        *("archfem.json", "case.toml", "scale.json", "scale.txt")
    }
    assert 0.9 * 0.25 < float(re.search(r"(?:falls|first mechanism) at (\S+) g", text)[1]) < 0.8
    assert af.commands.main([*given, "--set", "motion.scale=2"]) == code
    again = (tmp_path / "out" / "scale.txt").read_text(encoding="utf-8")
    factor = [float(re.search(r"\((\S+) × ", each)[1]) for each in (text, again)]
    assert factor[0] / factor[1] == pytest.approx(2.0, rel=0.1)
    assert af.commands.main(["report", str(tmp_path / "out")]) == 0
    words = " ".join(read_page((tmp_path / "out" / "report.html").read_text()).words)
    said = again.splitlines()[0].partition(": ")[2].partition(";")[0]
    assert f"Scale of the motion: {said}" in words  # the conclusion
    margin = rf"is {factor[1]} on 'tap', at a PGA of [\d.]+ g(, beyond which it fails)?, under one "
    assert re.search(f"{margin}motion", words)
    shown = words.split("Scale of the motion")[-1]  # the section
    assert ("each run is a row of scale.csv" if runs else head) in shown
    if runs:  # the file and the figure have each step and outcome
        rows = (tmp_path / "out" / "scale.csv").read_text(encoding="utf-8")
        assert all(state in rows for state in ("stands", "fallen"))


def test_a_search_without_an_answer_is_not_drawn(tmp_path, undrawn, monkeypatch):
    """A figure of its runs would have the limit alone."""
    column = 'structure = { shape = "column", breadth = 0.25, heights = [1.0] }\n'
    column += 'model = { fidelity = "rigid", displacements = "large" }\n'
    column += "motion = { synthetic = { seed = 1, duration = 0.5 } }\n"
    (tmp_path / "block.toml").write_text(column, encoding="utf-8")
    stands = af.dynamics.CollapseState("stands", None, (), 0.0, 0.0, True)
    for state in (None, stands):
        run = ScaledRun(1.0, {}, af.dynamics.Ending.FINISHED, "broken off", state)
        found = CollapseScale({0.005: MechanismScales(("collapse",), (run,))}, pga=1.0)
        monkeypatch.setattr(motion_scaling, "collapse_scale", lambda *_, found=found, **__: found)
        af.commands.main(["scale", str(tmp_path / "block.toml"), "--out", str(tmp_path / "out")])
        assert (tmp_path / "out" / "scale.png").exists() is (state is not None)


PAIRS = """
title = "Block"
structure = { shape = "column", breadth = 0.25, heights = [1.0] }
model = { fidelity = "rigid", displacements = "large" }
suite.pairs.weak = { file = "tap.txt", dt = 0.01, units = "m/s2" }
suite.pairs.strong = { file = "tap.txt", dt = 0.01, units = "m/s2", scale = 2.0 }
suite.pairs.middle = { file = "tap.txt", dt = 0.01, units = "m/s2", scale = 1.5 }
"""


@pytest.fixture
def searched(tmp_path, undrawn, monkeypatch):
    """A slender block under three motions, whose searches are counted, and its result folder."""
    pulse = 2.5 * np.sin(np.pi * np.linspace(0.0, 1.0, 41))
    np.savetxt(tmp_path / "tap.txt", [*pulse, *np.zeros(60)])
    (tmp_path / "block.toml").write_text(PAIRS, encoding="utf-8")
    names, compute = [], motion_scaling.collapse_scale

    def search(analysis, motion, made=None):
        names.append(motion.name)
        return compute(analysis, motion, precision=1.0, made=made)

    monkeypatch.setattr(motion_scaling, "collapse_scale", search)
    return ["scale", str(tmp_path / "block.toml"), "--out", str(tmp_path / "out")], names


@pytest.mark.slow
def test_scales_of_the_pairs_of_a_suite_stand_side_by_side(searched, tmp_path, capsys):
    """The report has the least of all, and names those that were not scaled."""
    given, made = searched
    out = tmp_path / "out"
    for pair in ("strong", "weak"):
        assert af.commands.main([*given, "--pair", pair]) in (0, 3)
    factors = {}
    for pair in ("strong", "weak"):
        (row,) = json.loads((out / pair / "scale.json").read_text(encoding="utf-8"))["rows"]
        assert row[1].startswith(f"'{pair}', PGA ")
        factors[pair] = row[3]
    assert float(factors["strong"]) < 0.7 * float(factors["weak"])
    assert not (out / "scale.json").exists()
    by = r"\nat [\d.]+ × it falls by hinges \(joint 0\) at [\d.]+ s, when blocks come loose\n"
    assert re.search(by, (out / "weak" / "scale.txt").read_text(encoding="utf-8"))
    assert af.commands.main(["report", str(out)]) == 0
    words = " ".join(read_page((out / "report.html").read_text(encoding="utf-8")).words)
    least = f"The least margin is {factors['strong']} on 'strong', at a PGA of "
    assert least in words
    assert ", of 2 motions. Of the scales that were run " in words.partition(least)[2]
    assert " 'middle' was not scaled." in words
    for pair in ("strong", "weak"):
        assert f"Residual displacement under '{pair}' over the scale" in words
        assert f"at the top; each run is a row of {pair}/scale.csv." in words
    # without a pair each is searched that has no result of the same case
    capsys.readouterr()
    assert af.commands.main(given) in (0, 3)
    assert made == ["strong", "weak", "middle"]
    said = capsys.readouterr()
    assert [said.out.count(f"\n{pair}: ") for pair in ("weak", "strong", "middle")] == [1, 1, 1]
    assert "scale: pair 3 of 3, 'middle'\n" in said.err
    assert af.commands.main(["report", str(out)]) == 0
    words = " ".join(read_page((out / "report.html").read_text(encoding="utf-8")).words)
    assert least in words
    assert ", of 3 motions. Of the scales that were run " in words
    assert "not scaled" not in words
    assert af.commands.main([*given, "--set", "materials.stone.unit_weight=21e3"]) in (0, 3)
    assert made[3:] == ["weak", "strong", "middle"]


@pytest.mark.parametrize(
    ("pair", "kind", "says"),
    [
        ("weak", "fallen", "it falls in the run of this folder, but not by steps of 5 ms"),
        pytest.param("weak", "dislocated", "", marks=pytest.mark.slow),
        pytest.param(
            *("strong", "stands", "it falls by steps of 5 ms, but not in the run of this folder"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_search_and_a_run_of_which_one_alone_falls_are_in_doubt(
    pair, kind, says, searched, tmp_path, monkeypatch, capsys
):
    """Steps of a search are fixed, and the run of the folder varies its own."""
    run = SimpleNamespace(fall=SimpleNamespace(kind=kind))
    monkeypatch.setattr(margin, "load_finished_run", lambda *_: run)
    code = af.commands.main([*searched[0], "--pair", pair])
    stated = json.loads((tmp_path / "out" / pair / "scale.json").read_text(encoding="utf-8"))
    found = [cause for cause, *_ in stated["doubts"] if "the run of this folder" in cause]
    assert found == [f"at 1.00 × {says}"] * bool(says)
    said = f"in doubt: at 1.00 × {says}; give both the same, `--set analysis.dt=0.005`\n"
    assert (said in capsys.readouterr().out) == bool(says)
    assert code == 3 or not says


def test_a_search_without_a_run_states_and_draws_nothing(searched, tmp_path, monkeypatch, capsys):
    def shake(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(motion_scaling, "time_history", shake)
    assert af.commands.main(searched[0]) == 130
    assert searched[1] == ["weak"]
    assert not [*(tmp_path / "out").rglob("scale*")]
    assert "stands" not in capsys.readouterr().out


@pytest.mark.slow
def test_an_interrupted_search_of_a_pair_continues(searched, tmp_path, monkeypatch, capsys):
    """The second search ends at its third scale; that of the first, which is finished, is kept.

    Its second scale is run twice, up to a lost block and, as none is, to the end.
    """
    given, searches = searched
    runs, compute, out = [], motion_scaling.time_history, tmp_path / "out"

    def shake(*args, **options):
        if searches[-1] == "strong":
            runs.append((options["dt"], args[1].pga, "record" in options))
        history = compute(*args, **options)
        if searches == ["weak", "strong"] and len(runs) == 4:  # as Ctrl-C does
            history.dataset.attrs["ended"] = "interrupted"
            fall.mark_interrupted(history, "0.5 s")
        return history

    monkeypatch.setattr(motion_scaling, "time_history", shake)
    assert af.commands.main(given) == 130
    assert searches == ["weak", "strong"]
    text = (out / "strong" / "scale.txt").read_text(encoding="utf-8")
    assert " (0.707 × the motion), search unfinished, " in text
    assert text.count("in doubt: ") == 1
    (row,) = json.loads((out / "strong" / "scale.json").read_text(encoding="utf-8"))["rows"]
    assert ", search unfinished, " in row[2]
    assert row[3].endswith(" so far")
    assert len(json.loads((out / "strong" / "scale_runs.json").read_text())) == 2
    (out / "weak" / "scale.txt").unlink()
    capsys.readouterr()
    assert af.commands.main(given) in (0, 3)
    assert "scale: 2 runs of the interrupted search are kept\n" in capsys.readouterr().err
    assert searches[2:] == ["weak", "strong", "middle"]
    text = (out / "strong" / "scale.txt").read_text(encoding="utf-8")
    assert text.count(" as given ") == len({(dt, pga) for dt, pga, _ in runs})
    assert len(runs) == 1 + len(set(runs))  # that which was interrupted is run again
    assert not (out / "strong" / "scale_runs.json").exists()
    # from the beginning it finds the same
    (out / "strong" / "scale.txt").unlink()
    assert af.commands.main([*given, "--pair", "strong"]) in (0, 3)
    assert (out / "strong" / "scale.txt").read_text(encoding="utf-8") == text


def test_kept_runs_keep_the_larger_mechanism():
    larger = af.limit.Mechanism("local", "arch", (0, 6), 2.0)
    met = {"verified": replace(larger, part="pier", below=4e-4, larger=larger), "none": None}
    run = ScaledRun(1.0, met, af.dynamics.Ending.FINISHED, "")
    made = margin._unpack_runs(json.dumps([(0.01, asdict(run))]))
    kept = made[0.01, 1.0].mechanisms
    assert (kept["verified"].decisive, kept["none"]) == (larger, None)


@pytest.mark.slow
def test_an_interrupted_suite_continues_with_the_motions_left(small, undrawn, capsys, monkeypatch):
    def broken_off(case, motion, *given):
        history = run_time_history(case, motion, *given)
        history = history.with_doubts([Doubt("energy drifts")])
        if motion.name == "second":
            history.dataset.attrs["ended"] = "interrupted"
        return history

    with pytest.raises(KeyboardInterrupt):
        run_with(small, broken_off, monkeypatch)
    assert "run the same command again" in capsys.readouterr().err
    assert run(small) == 3  # kept results keep their doubts
    summary = (small.parent / "out" / "first" / "summary.txt").read_text()
    assert summary.startswith("no mechanism; 1 doubt\nin doubt: energy drifts\n")
    table = (small.parent / "out" / "suite.txt").read_text()
    assert "in doubt, as their summaries say: first\n" in table
    said = capsys.readouterr().out
    assert "first: finished before" in said
    assert "second: finished before" not in said


def test_a_pair_that_fails_does_not_end_the_suite(small, unplotted, undoubted, capsys, monkeypatch):
    def failing(case, motion, *given):
        history = run_time_history(case, motion, *given)
        if motion.name == "first":
            history.dataset.attrs["ended"] = "failed"
            raise af.DidNotConverge("no equilibrium", history=history)
        return history

    with pytest.raises(
        af.DidNotConverge, match="1 of 2 pairs have no equilibrium at some step: first"
    ):
        run_with(small, failing, monkeypatch)
    path = small.parent / "out" / "first" / "history.nc"
    said = capsys.readouterr().err
    assert "archfem: first: no equilibrium" in said
    table = (small.parent / "out" / "suite.txt").read_text()
    assert re.search(r"^first .* failed ", table, re.MULTILINE)
    assert re.search(r"^second .* reached ", table, re.MULTILINE)
    assert af.History.read(path).ending is af.dynamics.Ending.FAILED


def test_a_motion_that_fails_is_kept_and_ends_the_command(
    small, unplotted, undoubted, capsys, monkeypatch
):
    small.write_text(small.read_text().split("[suite]")[0] + "[motion]\nsynthetic = { seed = 1 }")

    def failing(case, motion, *given):
        history = run_time_history(case, motion.cut(0.0, 0.5), *given)
        raise af.DidNotConverge("no equilibrium at 0.5 s", history=history)

    with pytest.raises(af.DidNotConverge, match=r"no equilibrium at 0.5 s"):
        run_with(small, failing, monkeypatch)
    path = small.parent / "out" / "history.nc"
    assert af.History.read(path).time[-1] == pytest.approx(0.5)
    assert not path.with_name("summary.txt").exists()


def test_check_states_the_strength_of_pairs(small, capsys):
    assert af.commands.main(["check", str(small)]) == 0
    said = capsys.readouterr().out
    assert re.search(r"first +horizontal .* 0\.0510 g", said)  # 1 m/s² by R = 2
    assert "ready" in said


def test_motion_command_measures_and_draws(tmp_path, undrawn, capsys, at2):
    for folder, peak in (("a", 0.2), ("b", 0.4)):
        (tmp_path / folder).mkdir()
        at2(tmp_path / folder / "x.AT2", [0.0, peak, -0.1, *np.zeros(50)], 0.01)
    files = [str(tmp_path / folder / "x.AT2") for folder in "ab"]
    assert af.commands.main(["motion", *files, "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert re.search(r"^x\.AT2 +only one +53 +0\.01 s +0\.2000 g", said, re.MULTILINE)
    assert re.search(r"^x\.AT2 \(2\) +only one +53 +0\.01 s +0\.4000 g", said, re.MULTILINE)
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert made == {"x.AT2.png", "x.AT2 (2).png", "spectra.png"}


def test_motion_command_reads_plain_columns(tmp_path, undrawn, capsys):
    path = tmp_path / "plain.txt"
    path.write_text("0 0\n1 98.0665\n0 0\n0 0\n")
    keywords = ["--column", "2", "--units", "cm/s2", "--dt", "0.02"]
    assert af.commands.main(["motion", str(path), *keywords, "--out", str(tmp_path)]) == 0
    assert re.search(r"only one +4 +0\.02 s +0\.1000 g", capsys.readouterr().out)
    assert af.commands.main(["motion", str(path), "--out", str(tmp_path)]) == 1
    assert "plain.txt" in capsys.readouterr().err


RECORDS = {
    "no unit": ("0\n1\n0\n", ["--dt", "0.02"], "no unit: give --units as g, m/s2"),
    "no step": ("0\n1\n0\n", ["--units", "g"], "give --dt in seconds"),
    "contradiction": ("# in g\n0\n1\n0\n", ["--units", "cm/s2"], "--units 'cm/s2' contradicts"),
    "columns": ("0 0 0\n.1 1 1\n.2 0 0\n", ["--units", "g"], "choose with --column, from 1"),
}


@pytest.mark.parametrize("kind", RECORDS)
def test_errors_of_records_name_options_of_the_command(tmp_path, capsys, kind):
    content, words, remedy = RECORDS[kind]
    (tmp_path / "plain.txt").write_text(content)
    command = ["motion", str(tmp_path / "plain.txt"), *words, "--out", str(tmp_path)]
    assert af.commands.main(command) == 1
    assert remedy in capsys.readouterr().err


def test_too_few_records_name_the_option_of_the_command(tmp_path, capsys):
    spectrum = "{ code = 'TBEC-2018', ss = 1.0, s1 = 0.3, site = 'ZD' }"
    words = ["--spectrum", spectrum, "--period", "0.2", "--count", "3"]
    assert af.commands.main(["select", str(tmp_path), *words]) == 1
    assert "name events that were taken for one by --event" in capsys.readouterr().err


LIMIT = """
title = "a ring pushed over"
[structure]
shape = "circular_arch"
radius = 2.95
thickness = 0.55
embrace = 159.0
voussoirs = 17
[model]
fidelity = "rigid"
[limit]
horizontal = 1.0
"""


def test_selected_records_become_a_suite(tmp_path, at2, undrawn, capsys, monkeypatch):
    records, out = tmp_path / "records", tmp_path / "out"
    records.mkdir()
    for day in range(1, 5):
        motion = af.Motion.synthetic(duration=2.0, seed=day, dt=0.01, vertical_ratio=0.0)
        at2(records / f"1990010{day}.AT2", motion.horizontal / af.units.STANDARD_GRAVITY, 0.01)
    # two components in one file, of which the second is nearer to the spectrum
    rows = "\n".join(f"{0.1 * a:.5f} {a:.5f}" for a in motion.horizontal)
    (records / "19900109.txt").write_text(f"# N-S E-W m/s2, dt = 0.01\n{rows}\n")
    spectrum = '{ code = "EC8", ag = 0.25, ground = "B" }'
    monkeypatch.chdir(tmp_path)  # a folder as it is usually typed
    given = ["select", "records", "--spectrum", spectrum, "--period", "0.2", "--out", str(out)]
    assert af.commands.main([*given, "--count", "5", "--scales", "0.1", "9"]) == 0
    said = capsys.readouterr().out
    code = af.Eurocode8(0.25, "B")
    found = af.select_records(records, code, 0.2, count=5, scales=(0.1, 9.0))
    assert str(found) in said
    assert (out / "selection.csv").read_text().strip() == found.table()
    assert f"wrote {out / 'selection.png'}" in said
    column = {"structure": {"shape": "column", "breadth": 1.0, "heights": [1.0]}}
    case = af.Case.of({**column, **tomllib.loads((out / "selection.toml").read_text())})
    assert case.target == code
    for made, motion in zip(case.ground_suite().motions, found.suite().motions, strict=True):
        assert made.horizontal == pytest.approx(motion.horizontal)
    joined = ["--event", "19900101*=one", "--event", "19900102*=one"]
    assert af.commands.main([*given, "--count", "5", *joined]) == 1
    assert "6 candidates of 4 events, fewer than 5 to select" in capsys.readouterr().err
    # the nearest set is written, and the command fails
    assert af.commands.main([*given, "--count", "3", "--scales", "0.01", "0.1"]) == 1
    said = capsys.readouterr()
    assert "EC8 is missed by" in said.out
    assert "no set was found that meets the rule: above is the nearest" in said.err


def test_limit_analysis_of_a_case(tmp_path, ring, unplotted, capsys):
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    path.write_text(LIMIT)
    assert af.commands.main(["run", str(path), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    found = af.collapse_factor(ring, live=af.BodyForce(1.0, 0.0))
    assert f"at {found.factor:.4g} g, pushed to the right" in said
    assert all(f"joint {number} at the {side}" in said for number, side in found.hinges)
    assert (out / "limit.txt").read_text() in said
    assert (out / "collapse.png").is_file()
    assert (out / "dead.png").is_file()
    assert "in the other sense: " in said
    assert af.commands.main(["check", str(path)]) == 0
    said = capsys.readouterr().out
    assert f"at {found.factor:.4g} g, pushed to the right" in said
    assert "in the other sense: " in said
    # the case alone, in the same folder: its files replace those of the run
    assert af.commands.main(["limit", str(path), "--out", str(out)]) == 0
    assert (out / "limit.txt").read_text() in capsys.readouterr().out
    joints = pd.read_csv(out / "limit.csv")
    assert joints["N"].to_numpy() == pytest.approx(found.joints["N"].values, rel=1e-9)
    assert af.commands.main(["limit", str(path), "--set", "limit.horizontal=0.5"]) == 0
    said = capsys.readouterr().out
    assert f"at {found.factor:.4g} g, pushed to the right" in said
    other = f"four-hinge mechanism, at {found.factor:.4g} g, pushed to the left"
    assert f"in the other sense: {other}" in said
    assert "(the same)" in said
    assert af.commands.main(["limit", str(path), "--set", "limit.vertical=-1"]) == 0
    assert "in the other sense" not in capsys.readouterr().out


def test_a_push_that_the_fill_decides_is_in_doubt(tmp_path, unplotted, capsys):
    """The demand is within the range over what is assumed of the fill, or below all of it."""
    path, words = tmp_path / "bridge.toml", "what is assumed of the fill decides whether the ground"
    af.Analysis(slender_bridge(arch=(5.0, 1.5)), fidelity="rigid").write(path)
    fill = af.limit.Fill(friction_angle=45.0)
    found = af.collapse_factor(slender_bridge(arch=(5.0, 1.5)), live=af.BodyForce(1.0), fill=fill)
    low, high = found.range
    assert low < 0.9 * high
    for demand, decides in ((0.5 * (low + high), True), (0.5 * low, False)):
        given = f'limit={{horizontal=1, demand="{demand} g", fill={{friction_angle="45 degree"}}}}'
        assert af.commands.main(["limit", str(path), "--set", given]) == 3 * decides
        said = f"in doubt: {words} sets it in motion"
        assert (said in capsys.readouterr().out) == decides
        case = af.Case.read(path, [given])
        assert evaluate_limit(case)["doubts"] == decides
    given = given.replace(str(demand), str(0.5 * (low + high)))
    assert af.commands.main(["check", str(path), "--set", given]) == 3
    said = capsys.readouterr().out  # beside that on soft blocks
    assert f"in doubt: {words}" in said
    assert f"{path}: in doubt, 2 times, as above" in said
    case = af.Case.read(path, [given])
    _, doubts = print_results(case, carry_out(case, tmp_path), tmp_path)
    assert [str(doubt).startswith(words) for doubt in doubts] == [True, False]


@pytest.mark.parametrize("push", [1.0, -1.0])
def test_sliding_is_in_doubt_once_with_the_factor_that_is_shown(push, tmp_path, capsys):
    """Of 6 kN at a friction of 0.1, 500 N to the right leave 100 N, whichever sense is first."""
    stack = af.column(breadth=0.6, heights=[0.5, 0.5], contact=af.Contact(1e9, 4e8, 0.1))
    path = tmp_path / "stack.toml"
    af.Analysis(stack, fidelity="rigid").write(path)
    load = f'limit={{horizontal={push}, dead=[{{x=0.0, force=["500 N", "0 N"]}}]}}'
    assert af.commands.main(["limit", str(path), "--set", load]) == 3
    said = capsys.readouterr().out
    assert "at 0.01667 g, pushed to the right\n" in said
    assert re.findall(r"in doubt: joints slide .* the factor (\S+) is", said) == ["0.01667"]


@pytest.mark.parametrize("command", ["limit", pytest.param("run", marks=pytest.mark.slow)])
def test_limit_analysis_cut_short_keeps_the_first_sense(
    command, tmp_path, unplotted, monkeypatch, capsys
):
    def solve(structure, *, live, **options):
        if live[0].horizontal < 0.0:
            raise KeyboardInterrupt
        return af.collapse_factor(structure, live=live, **options)

    monkeypatch.setattr("archfem.cases.analysis_keys.collapse_factor", solve)
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    path.write_text(LIMIT.replace("voussoirs = 17", "voussoirs = 7"))
    assert af.commands.main([command, str(path), "--out", str(out)]) == 130
    text, said = (out / "limit.txt").read_text(), capsys.readouterr()
    assert text in said.out
    assert text.startswith("limit analysis: four-hinge mechanism, at ")
    assert "\nin the other sense: not computed" in text
    assert "pushed to the right; the other sense follows" in said.err


def test_an_assessment_takes_the_strength_of_a_fill():
    tables = tomllib.loads(LIMIT + '[assessment]\nfill = { friction_angle = "35 degree" }\n')
    fill = af.Case.of(tables).assessment.options["fill"]
    assert fill == af.limit.Fill(friction_angle=35.0)
    tables["assessment"]["fill"] = {}
    with pytest.raises(af.InvalidInput, match="lacks its angle"):
        af.Case.of(tables)


PUSHOVER = """
title = "a pier under a press, pushed over"
[structure]
shape = "column"
breadth = 0.6
heights = [0.8, 0.8]
[model]
fidelity = "rigid"
[pushover]
point = { x = "-0.3 m", y = "1.6 m", force = ["1 kN", "0 kN"] }
dead = [{ x = "0 m", force = ["0 kN", "-50 kN"] }]
stop = { displacement = 0.005 }
"""


def test_pushover_of_a_case(tmp_path, unplotted, capsys):
    """That of the Python call, as text, table, picture and part of the report."""
    path, out = tmp_path / "pier.toml", tmp_path / "out"
    path.write_text(PUSHOVER)
    assert af.commands.main(["check", str(path)]) == 0
    said = capsys.readouterr().out
    assert "pushover: loads that grow together: 1; loads that stay: 1; control by displ" in said
    assert af.commands.main(["run", str(path), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    model = af.build(af.column(breadth=0.6, heights=[0.8, 0.8]), fidelity="rigid")
    live, dead = af.PointLoad(-0.3, (1e3, 0.0), y=1.6), [af.PointLoad(0.0, (0.0, -50e3))]
    push = af.pushover(model, live, dead=dead, stop=af.statics.Stop(displacement=0.005))
    assert f"pushover: factor {push.factor:.4g} after" in said
    assert (out / "pushover.txt").read_text().strip() in said
    curve = pd.read_csv(out / "pushover.csv")
    assert curve["factor"].to_numpy() == pytest.approx(push.curve["factor"].values, rel=1e-9)
    assert (out / "pushover.png").is_file()
    assert af.commands.main(["report", str(out)]) == 0
    assert "Riks" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "loads", ["", "horizontal = 1.0\nsettlement = { block = 0, motion = [0, -1, 0] }"]
)
def test_a_pushover_has_loads_or_a_settlement(loads, tmp_path, capsys):
    path = tmp_path / "pier.toml"
    path.write_text(PUSHOVER.partition("point")[0] + loads)
    assert af.commands.main(["run", str(path), "--out", str(tmp_path / "out")]) == 1
    assert "pushover has no load, or a load and a settlement" in capsys.readouterr().err
    moved = PUSHOVER.partition("point")[0] + "settlement = { block = 0, motion = [0.01, 0, 0] }"
    case = af.Case.of(tomllib.loads(moved))
    assert case.pushover.live == af.Settlement(0, (0.01, 0.0, 0.0))


def test_limit_analysis_needs_a_load(tmp_path, capsys):
    path = tmp_path / "ring.toml"
    path.write_text(LIMIT.replace("horizontal = 1.0", 'friction = "none"'))
    assert af.commands.main(["limit", str(path)]) == 1
    assert "limit has no load" in capsys.readouterr().err
    path.write_text(LIMIT.partition("[limit]")[0])
    assert af.commands.main(["limit", str(path)]) == 1
    assert "limit has no load" in capsys.readouterr().err


ASSESSMENT = """
[assessment]
spectrum = { code = "NTC-2018", ag = 0.25, f0 = 2.4, tc_star = "0.32 s", site = "B" }
limit_state = "NTC-2018 SLC"
q = 1.5
"""


@pytest.mark.slow
def test_assessment_of_a_case_and_its_page(tmp_path, ring, capsys):
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    path.write_text(LIMIT + ASSESSMENT)
    left = ["--set", "assessment.direction=-1"]
    assert af.commands.main(["assess", str(path), "--out", str(out), *left]) == 3
    said = capsys.readouterr().out
    spectrum = af.motion.Ntc2018(ag=0.25, f0=2.4, tc_star=0.32, site="B")
    options = {"direction": -1, "limit_state": "NTC-2018 SLC", "q": 1.5}
    found = af.kinematic_assessment(ring, spectrum, **options)
    assert str(found.displacement) in said
    assert str(found.linear) in said
    assert "pushed to the left" in said
    assert found.doubts
    assert all(f"in doubt: {doubt}" in said for doubt in found.doubts)
    assert (out / "assessment.txt").read_text().strip() in said
    assert [file.name for file in out.glob("*.png")] == ["assessment_0.png"]
    assert af.commands.main(["run", str(path), "--out", str(out), *left]) == 0
    assert af.commands.main(["report", str(out)]) == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Kinematic assessment" in page
    assert "NTC-2018 SLC: capacity" in page
    capsys.readouterr()
    # without a spectrum, and by parts
    path.write_text(LIMIT)
    assert af.commands.main(["assess", str(path)]) == 1
    assert "an assessment needs a spectrum: write [assessment]" in capsys.readouterr().err
    given = ["--parts", "--set", "assessment.direction=1"]
    path.write_text(LIMIT + ASSESSMENT)
    assert af.commands.main(["assess", str(path), *given]) == 3
    said = capsys.readouterr().out
    assert "arch, right:" in said
    left_out = "note: pushed to the left nothing was assessed, as the case gives direction = 1"
    assert said.splitlines().count(left_out) == said.count("pushed to the left") == 1


@pytest.mark.slow
def test_rating_of_a_case(tmp_path, ring, capsys):
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    path.write_text(LIMIT)
    given = ["--vehicle", "CS454-single", "--live", "0.1", "--width"]
    command = ["rate", str(path), *given, f"{ring.width}"]
    assert af.commands.main([*command, "--out", str(out)]) == 3  # without a strength
    said = capsys.readouterr().out
    named = replace(ring, name="a ring pushed over")
    found = af.rate(named, "CS454-single", live=0.1)
    assert str(found) in said
    assert f"as no strength of the stones is given: {found.crushing_text}; give" in said
    assert af.commands.main([*command[:-1], f"{100.0 * ring.width} cm"]) == 3
    assert str(found) in capsys.readouterr().out
    assert af.commands.main([*command[:-1], "wide"]) == 1
    assert "rating.width = 'wide'" in capsys.readouterr().err
    assert (out / "rating.txt").read_text().startswith(str(found))
    assert (out / "rating.csv").read_text().strip() == found.table()
    assert f"wrote {out / 'rating.png'}" in said
    assert af.commands.main([*command[:3], "LM9"]) == 1
    assert "vehicle 'LM9' is not known" in capsys.readouterr().err
    # the report of the same case shows both
    assert af.commands.main(["run", str(path), "--out", str(out)]) == 0
    assert af.commands.main(["report", str(out)]) == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Rating for a vehicle" in page
    assert f"for CS454-single: factor {found.factor:.4g}" in page
    assert "Factor along the bridge" in page
    assert "Thrust line at collapse" in page


@pytest.mark.slow
def test_a_rating_that_is_stopped_keeps_the_vehicles_before(tmp_path, unplotted, monkeypatch):
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    path.write_text(LIMIT.replace("= 17", "= 7"))
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (0.9,))
    whole = af.cases.analysis_keys.rate_case

    def stop(structure, rating, limit):
        if rating["vehicle"] == "LM1":
            raise KeyboardInterrupt
        return whole(structure, rating, limit)

    monkeypatch.setattr("archfem.commands.run.rate_case", stop)
    given = [part for name in ("CS454-single", "LM2", "LM1") for part in ("--vehicle", name)]
    assert af.commands.main(["rate", str(path), "--out", str(out), *given]) == 130
    assert set(pd.read_csv(out / "vehicles.csv")["vehicle"]) == {"CS454-single", "LM2"}
    assert (
        "in doubt: interrupted: 1 of 3 vehicles were not rated" in (out / "rating.txt").read_text()
    )


def test_a_rating_that_is_stopped_at_once_keeps_nothing(tmp_path, monkeypatch, capfd):
    """It says so; lines of progress name the vehicle and the place."""
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    path.write_text(LIMIT.replace("= 17", "= 7"))
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (0.9, 1.2))
    monkeypatch.setattr("archfem._display.PROGRESS_INTERVAL", 0.0)

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("archfem.limit.rating.find_geometric_factors", stop)
    with open(tmp_path / "errors", "w") as errors:
        monkeypatch.setattr("sys.stderr", errors)
        command = ["rate", str(path), "--out", str(out), "--vehicle", "LM2", "--vehicle", "LM1"]
        assert af.commands.main(command) == 130
    lines = (tmp_path / "errors").read_text().splitlines()
    assert "rating: vehicle 1 of 2; places: 2 of 2" in lines
    assert lines[-2:] == [
        "rating: no vehicle was rated, and nothing is kept",
        "archfem: interrupted",
    ]
    assert not out.exists()


@pytest.mark.slow
def test_vehicles_are_rated_together(tmp_path, unplotted, capsys, monkeypatch):
    """The case's own by name; the worst is first, of the picture and the table too."""
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    own = '{ name = "cart", axles = ["3 kN"] }, { name = "van", axles = ["9 kN"] }'
    strong = LIMIT + 'strength = "none"\n'
    path.write_text(f"{strong.replace('= 17', '= 7')}[rating]\nvehicle = [{own}]\n")
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (0.9, 1.2))
    given = [part for name in ("Cart", "LM1", "hl93") for part in ("--vehicle", name)]
    assert af.commands.main(["rate", str(path), "--out", str(out), *given]) == 0
    said = capsys.readouterr().out
    rows = pd.read_csv(out / "vehicles.csv")
    assert (out / "vehicles.png").exists()
    assert {*rows["vehicle"]} == {"cart", "LM1", "HL93-tandem", "HL93-truck"}
    assert (np.diff(rows["factor"]) >= 0.0).all()
    assert rows["vehicle"][0] == "LM1"
    case, stated, factors = af.Case.read(path), [], {}
    for _, (name, _, factor, *_) in rows.iterrows():
        vehicle = case.rating["vehicle"] if name == "cart" else name
        found = af.rate(case.structure, vehicle, strength=np.inf)
        assert factor == float(f"{found.factor:.4g}")
        # what all vehicles have stands once
        lines = str(found).splitlines()
        assert {*lines} <= {*said.splitlines()}
        shared = "every x is that of the case and the picture; "
        assert said.count(shared) == 1
        factors |= {name: found.factor}
        factors |= {f"{name} {code}": each.factor for code, each in found.by_codes.items()}
        if name == "LM1":
            outcome, *others = found.clauses
            stated += [
                f"rating for {name}: factor {found.factor:.4g}, {outcome}",
                *others,
            ]
            stated += [f"worst {found.place}", "of 4 vehicles it has the least factor"]
            stated += found.describe_codes()
            assert (out / "rating.csv").read_text().strip() == found.table()
            table = tomllib.loads((out / "rating.toml").read_text())["rating"]
            assert table["vehicle"] == name
    # a conclusion has sentences of the first, by codes too, and rows of all, the worst first
    kept = json.loads((out / "rating.json").read_text())
    assert kept["sentences"] == stated
    assert [row[1] for row in kept["rows"]] == sorted(factors, key=factors.get)
    assert len(factors) == 4 + 4
    assert "left out: a second lorry that meets the vehicle" in str(kept["notes"])
    text = (out / "rating.txt").read_text().strip()
    assert text in said
    table = text.splitlines()[:5]
    assert [line.split()[0] for line in table[1:]] == [*rows["vehicle"]]
    # without places, ranges and conditions, which files and texts have
    assert max(map(len, table)) < 140
    assert table[4].startswith("cart ")
    assert table[4].endswith(" passes, without partial factors")
    assert af.commands.main(["rate", str(path), "--out", str(out)]) == 0
    assert [*pd.read_csv(out / "vehicles.csv")["vehicle"]] == ["van", "cart"]
    # a code's vehicle is no one's own, though the case names it first
    path.write_text(path.read_text().replace(own, f'"LM1", {own}'))
    assert af.commands.main(["rate", str(path), "--out", str(out)]) == 0
    assert [*pd.read_csv(out / "vehicles.csv")["vehicle"]] == ["LM1", "van", "cart"]
    path.write_text(path.read_text().replace('"LM1", ', ""))
    assert af.commands.main(["rate", str(path), "--vehicle", "van", "--out", str(out)]) == 0
    assert not {"vehicles.csv", "vehicles.png", "places.png"} & {
        each.name for each in out.iterdir()
    }
    assert "van" in (out / "rating.toml").read_text()


def test_a_vehicle_that_is_not_known_is_refused_with_those_of_the_case(tmp_path, capsys):
    path = tmp_path / "ring.toml"
    own = '{ name = "cart", axles = ["3 kN"] }, { name = "van", axles = ["9 kN"] }'
    path.write_text(f"{LIMIT}[rating]\nvehicle = [{own}]\n")
    assert af.commands.main(["rate", str(path), "--vehicle", "bus"]) == 1
    said = capsys.readouterr().err
    assert "'bus' is not known: use one of 'cart' of the case, 'van' of the case, LM1, " in said
    assert said.endswith("HL93-truck; or Eurocode, CS454, HL93, each for all of a code\n")


@pytest.mark.slow
def test_a_vehicle_without_factors_has_the_rank_of_the_worst_code(tmp_path, unplotted, monkeypatch):
    """One axle of 50 kN is 171 kN by CS 454, more than 126 kN of 60 kN with 1.5 × 1.4.

    By codes 60 kN are 205 kN, whether factors are given or not.
    """
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    own = '{ name = "given", axles = ["60 kN"], live = 1.5, impact = 1.4 }, '
    own += '{ name = "bare", axles = ["50 kN"] }'
    path.write_text(f"{LIMIT.replace('= 17', '= 7')}[rating]\nvehicle = [{own}]\n")
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (0.9,))
    assert af.commands.main(["rate", str(path), "--out", str(out)]) in (0, 3)
    rows = pd.read_csv(out / "vehicles.csv").set_index("vehicle")
    assert [*rows.index] == ["bare", "given"]
    assert rows["factor"]["bare"] > 2.5 * rows["factor"]["given"]
    least, by = rows["least by codes"]["bare"].split(" ", 1)
    assert float(least) == pytest.approx(rows["factor"]["bare"] / (1.9 * 1.8), rel=1e-3)
    assert by == "by CS 454"
    heavier = rows["least by codes"]["given"].split(" ", 1)
    assert float(heavier[0]) == pytest.approx(float(least) * 50.0 / 60.0, rel=1e-3)
    assert heavier[1] == by
    kept = json.loads((out / "rating.json").read_text())["sentences"]
    words = f"it has the least factor, {least} by CS 454 (1.9, and 1.8 on the worst axle, "
    assert any(words in each for each in kept)


@pytest.mark.slow
def test_the_vehicle_that_decides_is_varied(tmp_path, unplotted, monkeypatch):
    """Its factor is the nearest to 1: of a worse one other properties would change no outcome."""
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    loads = {"lighter": 25, "light": 50, "heavy": 180}
    own = [f'{{ name = "{name}", axles = ["{load} kN"] }}' for name, load in loads.items()]
    path.write_text(f"{LIMIT.replace('= 17', '= 7')}[rating]\nvehicle = [{', '.join(own)}]\n")
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (0.9,))
    seen = []

    def vary(case, table, found, folder):
        seen.append((table["vehicle"]["name"], found.vehicle.name))
        return ResultTable(["light with", "factor"], [["it", "1"]]), ["measure first: it"], 0

    monkeypatch.setattr("archfem.studies.variations.vary_rating", vary)
    assert af.commands.main(["rate", str(path), "--vary", "--out", str(out)]) == 3
    rows = pd.read_csv(out / "vehicles.csv").set_index("vehicle")["factor"]
    assert [*rows.index] == ["heavy", "light", "lighter"]
    decides = (rows.apply(np.log)).abs().idxmin()
    assert seen == [(decides, decides)] == [("light", "light")]
    texts = (out / "rating.txt").read_text().split("\n\n")
    (varied,) = (text for text in texts if "measure first" in text)
    assert varied.startswith("Rating of 'a ring pushed over' for light: ")
    only = "only light was varied, whose factor is nearest to 1: others by --vehicle, each alone"
    assert only in varied.splitlines()
    assert only in json.loads((out / "rating.json").read_text())["sentences"]
    assert af.commands.main(["report", str(out)]) == 0
    title = (
        "Factor of light with one property changed at a time, alone, as its factor is nearest to 1"
    )
    assert title in (out / "report.html").read_text()


@pytest.mark.slow
def test_a_bridge_that_does_not_stand_is_rated_for_no_vehicle(tmp_path, unplotted, capsys):
    """A ring of a tenth of the least thickness of a semicircle by Heyman."""
    path, out = tmp_path / "ring.toml", tmp_path / "out"
    path.write_text(LIMIT.replace("= 159", "= 180").replace("= 0.55", "= 0.03"))
    given = ["--vehicle", "LM1", "--vehicle", "LM2", "--out", str(out)]
    assert af.commands.main(["rate", str(path), *given]) == 3
    _, first, *_ = capsys.readouterr().out.splitlines()
    words = "does not stand under its own weight, and carries no vehicle"
    assert first == f"Rating of 'a ring pushed over': {words}"
    stated = json.loads((out / "rating.json").read_text())
    assert stated["rows"] == [["rating", "LM1", words, "-", {"passes": False, "least": 0.0}]]
    thin, doubt = stated["doubts"]
    assert "could hinge inside: the inner face rises by 0.42 of the depth" in thin[0]
    assert doubt[0] == "limit analysis finds no equilibrium of the bridge under its own weight"
    assert "nan" not in (out / "rating.txt").read_text()


@pytest.mark.parametrize("command", ["limit", pytest.param("rate", marks=pytest.mark.slow)])
def test_results_are_written_before_they_are_printed(tmp_path, unplotted, monkeypatch, command):
    """`head` may close the pipe after a line."""

    class ClosedPipe(io.StringIO):
        def write(self, text):
            raise BrokenPipeError

    path, out = tmp_path / "ring.toml", tmp_path / "out"
    path.write_text(LIMIT.replace("voussoirs = 17", "voussoirs = 7"))
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (0.9,))
    monkeypatch.setattr("sys.stdout", ClosedPipe())
    options = ["--out", str(out)] + (["--vehicle", "LM2"] if command == "rate" else [])
    with suppress(BrokenPipeError, io.UnsupportedOperation):
        af.commands.main([command, str(path), *options])
    name = {"limit": "limit", "rate": "rating"}[command]
    assert (out / f"{name}.txt").is_file()
    assert (out / "archfem.json").is_file()


@pytest.mark.slow
def test_limit_analysis_refuses_soil_before_all_else(tmp_path, capsys):
    options = ["--set", "limit.horizontal=1", "--out", str(tmp_path)]
    assert af.commands.main(["run", str(RING.with_name("prusias.toml")), *options]) == 1
    assert "'backfill'] are softer than the joints around them" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["motion", "suite"])
def test_each_file_of_a_folder_swapped_is_refused_and_made_anew(kind, small, tmp_path, capsys):
    """By the commands themselves, with all the files that they write."""
    motion = "synthetic = { seed = 1, duration = 1.0, pga = 1.0 }\n"
    if kind == "motion":
        small.write_text(small.read_text().split("[suite]")[0] + "[motion]\n" + motion)
    folders, command = {}, {}
    for scale in (1, 2):
        out = folders[scale] = tmp_path / f"out {scale}"
        changes = [f"{kind}.scale={scale}", "limit.horizontal=1", f"structure.breadth=1.{scale}"]
        changes += ["record.fields_every=10", "output.animation=false"]
        given = [part for change in changes for part in ("--set", change)]
        for name in ("run", "verdict"):
            more = ["--samples", "2"] if name == "verdict" else []
            if name == "run" or kind == "motion":
                command[name, scale] = [name, str(small), "--out", str(out), *given, *more]
                assert af.commands.main(command[name, scale]) in (0, 3)

    def files(folder):
        # finished variations have a seal each: a changed one is computed again
        paths = (path for path in folder.rglob("*") if path.is_file())
        kept = (path for path in paths if "variations" not in path.parts)
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in kept}

    first, second = map(files, folders.values())
    differing = [name for name in first if first[name] != second[name]]
    assert len(differing) > 8
    capsys.readouterr()
    for name in differing:
        path = folders[1] / name
        path.write_bytes(second[name])
        assert af.commands.main(["report", str(folders[1])]) == 1, name
        assert "is not the file that archfem wrote there" in capsys.readouterr().err
        path.write_bytes(first[name])
    for name in differing:
        (folders[1] / name).write_bytes(second[name])
    for made in command:
        if made[1] == 1:
            assert af.commands.main(command[made]) in (0, 3)
    # figures and tables have the same bytes as before
    assert files(folders[1]) == first
    assert af.commands.main(["report", str(folders[1])]) == 0


@pytest.mark.slow
def test_an_assessment_slides_as_the_limit_analysis_without_a_warning_of_dilatancy(
    tmp_path, unplotted, caplog
):
    path, out = tmp_path / "gate.toml", tmp_path / "out"
    path.write_text(
        """
title = "Gate"
structure = { shape = "circular_arch", span = 2.6, embrace = 160, thickness = 0.35, voussoirs = 9 }
contacts."stone to stone".friction = 0.65
materials.stone.strength = "20 MPa"
limit = { horizontal = 1.0, friction = "nonassociated" }
assessment = { spectrum = { code = "EC8", ag = 0.22, ground = "C" }, direction = 1 }
""",
        encoding="utf-8",
    )
    assert af.commands.main(["limit", str(path), "--out", str(out)]) == 0
    assert af.commands.main(["assess", str(path), "--out", str(out)]) == 3
    assert not caplog.records
    assert af.commands.main(["report", str(out)]) == 0
    words = " ".join(read_page((out / "report.html").read_text(encoding="utf-8")).words)
    assert "assessment: friction that of the limit analysis inferred" in words
    assert "assessment: friction coulomb" not in words
    # it is proved the least, so that nothing lower stands beside it
    assert re.search(r"begins to move at 2\.32 times ", words)
    assert "proved to stand up to" not in words


def test_warnings_of_runs_are_no_lines_of_an_answer(caplog):
    """Runs keep their doubts, and the pace is that of the machine."""
    with record_doubts(af.column(breadth=1.0, heights=[1.0])) as doubts:
        logger.warning("%s", Doubt("energy drifts by {:.2g}", "", (0.1,)))
        for dt in (None, 0.005):
            time_history._announce_long_run(6.0, 0.01, 5.0, dt)
        logger.warning("joints slide")
    assert doubts == [Doubt("joints slide")]
    said = [each.message.rpartition(": ")[2] for each in caplog.records if each.args][1:]
    kept = "Ctrl-C ends it with what was computed"
    assert said == [f"{kept}, and a given dt skips the comparison of steps", kept]
