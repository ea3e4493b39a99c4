"""Suites in case files: what is declared, what is run, kept, gone on with, and summed up."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from archfem.cases import report as results
from archfem.cases import run as analysis
from archfem.cases.case import Case
from archfem.cases.cli import INTERRUPTED, main
from archfem.cases.motions import ground_suite, suite_settings
from archfem.dynamics.history import Ending, History
from archfem.errors import DidNotConverge, InvalidInput
from archfem.motion.design_spectra import Eurocode8, TableSpectrum, Tbec2018

SHIPPED = Path(__file__).parents[2] / "meshes" / "ring_suite.toml"
TABLES = """
title = "a column under two pairs"
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
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TABLES)
    return path


def pair(**keys):
    return {"synthetic": {"seed": 1, "duration": 5.0}, **keys}


def at2(path, samples, dt):
    rows = "\n".join(f"{sample:.6f}" for sample in samples)
    head = "RECORD OF A TEST\nTEST, STATION, 180\nACCELERATION IN UNITS OF G\n"
    path.write_text(f"{head}NPTS= {len(samples)}, DT= {dt:.4f} SEC\n{rows}\n")


def test_shipped_suite_is_six_horizontals_and_three_verticals():
    case = Case.read(SHIPPED, ["suite.matched=false"])
    suite = case.ground_suite()
    assert len(suite.pairs) == 6
    assert len({motion.horizontal.tobytes() for motion in suite.pairs}) == 6
    assert len({motion.vertical.tobytes() for motion in suite.pairs}) == 3
    assert suite.reduction == 3.0
    assert case.target == Tbec2018(ss=1.140, s1=0.315, site="ZD")
    assert suite.motions[0].name == "pair-1"
    assert suite.motions[0].pga == pytest.approx(suite.pairs[0].pga / 3.0)


def test_a_suite_is_matched_where_the_case_says_so():
    target = {"code": "TBEC-2018", "ss": 1.140, "s1": 0.315, "site": "ZD"}
    settings = {"matched": True, "target": target, "pairs": {"one": pair()}}
    (match,) = ground_suite(suite_settings(settings)).matches
    # What the matching promises over its band, for each component.
    assert max(match.misfit.values()) < 0.05
    assert match.motion.name == "one"


@pytest.mark.parametrize(
    ("target", "expected"),
    [
        ({"code": "EC8", "ag": 0.25, "ground": "C"}, Eurocode8(0.25, "C")),
        ({"code": "EC8", "ag": 0.25, "ground": "C", "type": 2}, Eurocode8(0.25, "C", 2)),
        (
            {"code": "table", "periods": ["0 s", "200 ms"], "values": [0.4, 1.0]},
            TableSpectrum([0.0, 0.2], [0.4, 1.0]),
        ),
    ],
)
def test_targets_are_those_of_the_codes(small, target, expected):
    tables = tomllib.loads(TABLES)
    tables["suite"]["target"] = target
    periods = np.linspace(0.0, 0.2, 9)
    assert Case.of(tables).target.horizontal(periods) == pytest.approx(expected.horizontal(periods))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("suite.reductoin=3", "unknown key 'suite.reductoin': did you mean 'reduction'"),
        ("suite.pairs={}", "suite.pairs is empty"),
        ("suite.pairs.a/b={synthetic={seed=1}}", "'a/b' names a folder"),
        ("suite.pairs.third={}", "suite.pairs.third needs either a file, or synthetic"),
        ("suite.pairs.third={synthetic={sed=1}}", "unknown key 'suite.pairs.third.synthetic.sed'"),
        ("suite.pairs.third={synthetic={}, units='g'}", "units belongs to a file"),
        ("suite.pairs.first.vertical=3", "vertical = 3 is not a word or a table"),
        ("suite.pairs.first.vertical={}", "suite.pairs.first.vertical needs either a file"),
        ("suite.matched=true", "suite.matched = true needs a target"),
        ("suite.target={code='UBC'}", "suite.target.code = 'UBC' is not known"),
        ("suite.target={code='EC8', ag=0.2}", "suite.target of EC8: .*'ground'"),
        ("suite.target={code='EC8', ag=0.2, ground='Z'}", "ground 'Z'"),
        ("motion={synthetic={seed=1}}", "either one motion or a suite"),
        ("suite.scale=0", "scale 0"),
    ],
)
def test_refusals_name_the_key(small, change, says):
    with pytest.raises(InvalidInput, match=says):
        Case.read(small, [change]).ground_suite()


def test_files_of_a_pair_have_their_own_units_and_steps(tmp_path):
    level, upright = tmp_path / "level.AT2", tmp_path / "up.txt"
    at2(level, [0.0, 0.1, -0.1, 0.0], 0.01)
    upright.write_text("0 0\n0 49.05\n0 0\n")
    given = {"file": "level.AT2", "vertical": {"file": "up.txt", "column": 2, "units": "gal"}}
    given["vertical"]["dt"] = 0.005
    settings = suite_settings({"pairs": {"one": {**given, "resample": "5 ms"}}})
    (motion,) = ground_suite(settings, tmp_path).motions
    assert motion.dt == 0.005
    assert motion.vertical == pytest.approx([0.0, 0.4905, 0.0])
    assert motion.pga == pytest.approx(0.980665)
    with pytest.raises(InvalidInput, match=r'suite\.pairs\.one\.resample = "0\.01 s"'):
        ground_suite(suite_settings({"pairs": {"one": given}}), tmp_path)


@pytest.fixture
def undrawn(monkeypatch):
    """Figures are made, but their files stay empty: printing them takes most of the time."""

    def save(figure, path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        return path

    monkeypatch.setattr(results, "save", save)


def run(small, *changes):
    given = [part for change in changes for part in ("--set", change)]
    return main(["run", str(small), "--out", str(small.parent / "out"), *given])


def test_one_line_runs_all_and_the_same_line_keeps_what_is_finished(small, undrawn, capsys):
    out = small.parent / "out"
    assert run(small) == 0
    made = {path.name for path in out.iterdir()}
    assert made >= {"first", "second", "spectra.png", "envelope.png", "suite.txt"}
    assert {path.name for path in (out / "first").iterdir()} == {
        "history.nc",
        "summary.txt",
        "motion.png",
        "gravest.png",
        "envelope.png",
        "joints.png",
    }
    table = (out / "suite.txt").read_text()
    assert re.search(r"^first +0\.50 m/s² +0\.33 m/s² ", table, re.MULTILINE)  # 1 m/s² by R = 2
    assert re.search(r"^second .* none +- +- +none +- +reached 1\.00 s$", table, re.MULTILINE)
    assert "finished before" not in capsys.readouterr().out

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
    assert re.search(r"^first +1\.00 m/s² +0\.67 m/s² ", table, re.MULTILINE)


def test_pairs_are_run_again_where_their_files_have_changed(tmp_path):
    tables = tomllib.loads(TABLES)
    tables["suite"]["pairs"] = {"one": {"file": "level.AT2"}}
    at2(tmp_path / "level.AT2", [0.0, 0.01, -0.01, 0.0], 0.01)
    case = Case.of(tables, tmp_path)
    (motion,) = case.ground_suite().motions
    shaken = analysis.shaken(case, motion, analysis.at_rest(case))
    path = shaken.save(tmp_path / "history.nc")
    assert analysis.finished(path, case, motion).outcome == shaken.outcome
    assert analysis.finished(path, case, motion.scaled(1.01)) is None


def test_an_interrupted_suite_goes_on_with_what_is_left(small, undrawn, capsys, monkeypatch):
    whole = analysis.shaken

    def broken_off(case, motion, *given):
        history = whole(case, motion, *given)
        if motion.name == "second":
            history.dataset.attrs["ended"] = "interrupted"
        return history

    monkeypatch.setattr(analysis, "shaken", broken_off)
    assert run(small) == INTERRUPTED
    assert "run the same command again" in capsys.readouterr().err
    monkeypatch.setattr(analysis, "shaken", whole)
    assert run(small) == 0
    said = capsys.readouterr().out
    assert "first: finished before" in said
    assert "second: finished before" not in said


def test_a_pair_that_fails_does_not_end_the_suite(small, undrawn, capsys, monkeypatch):
    whole = analysis.shaken

    def failing(case, motion, *given):
        history = whole(case, motion, *given)
        if motion.name == "first":
            history.dataset.attrs["ended"] = "failed"
            raise DidNotConverge("no equilibrium", history=history)
        return history

    monkeypatch.setattr(analysis, "shaken", failing)
    assert run(small) == 1
    assert "1 of 2 pairs have no equilibrium at some step: first" in capsys.readouterr().err
    table = (small.parent / "out" / "suite.txt").read_text()
    assert re.search(r"^first .* failed ", table, re.MULTILINE)
    assert re.search(r"^second .* reached ", table, re.MULTILINE)
    path = small.parent / "out" / "first" / "history.nc"
    case = Case.read(small).alone("first")
    assert History.read(path).ended is Ending.FAILED
    assert analysis.finished(path, case, case.ground_suite().motions[0]) is None


def test_more_pairs_than_colours_share_several_pictures(small, tmp_path):
    case = Case.read(small)
    dead = analysis.at_rest(case)
    history = analysis.shaken(case, case.ground_suite().motions[0], dead)
    files = results.write_envelopes({str(number): history for number in range(7)}, dead, tmp_path)
    assert [path.name for path in files] == ["envelope.png", "envelope_2.png"]


def test_check_tells_how_strong_the_pairs_are(small, capsys):
    assert main(["check", str(small)]) == 0
    said = capsys.readouterr().out
    assert re.search(r"first +horizontal .* 0\.0510 g", said)  # 1 m/s² by R = 2
    assert "ready" in said


def test_motion_command_measures_and_draws(tmp_path, capsys):
    for folder, peak in (("a", 0.2), ("b", 0.4)):
        (tmp_path / folder).mkdir()
        at2(tmp_path / folder / "x.AT2", [0.0, peak, -0.1, *np.zeros(50)], 0.01)
    files = [str(tmp_path / folder / "x.AT2") for folder in "ab"]
    assert main(["motion", *files, "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert re.search(r"^x\.AT2 +only one +53 +0\.01 s +0\.2000 g", said, re.MULTILINE)
    assert re.search(r"^x\.AT2 \(2\) +only one +53 +0\.01 s +0\.4000 g", said, re.MULTILINE)
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert made == {"x.AT2.png", "x.AT2 (2).png", "spectra.png"}


def test_motion_command_reads_plain_columns(tmp_path, capsys):
    path = tmp_path / "plain.txt"
    path.write_text("0 0\n1 98.0665\n0 0\n0 0\n")
    keywords = ["--column", "2", "--units", "cm/s2", "--dt", "0.02"]
    assert main(["motion", str(path), *keywords, "--out", str(tmp_path)]) == 0
    assert re.search(r"only one +4 +0\.02 s +0\.1000 g", capsys.readouterr().out)
    assert main(["motion", str(path), "--out", str(tmp_path)]) == 1
    assert "plain.txt" in capsys.readouterr().err
