"""Studies: several cases side by side, kept pair by pair."""

import json
from pathlib import Path

import numpy as np
import pytest

import archfem.dynamics.time_history
from archfem.cases.case import Case
from archfem.cases.cli import main
from archfem.cases.findings import Finding, kept, study_table, write
from archfem.cases.run import at_rest, shaken
from archfem.cases.study import Study, carried_out
from archfem.dynamics.verdicts import DEFINITIONS
from archfem.errors import DidNotConverge, InvalidInput

MESHES = Path(__file__).parents[2] / "meshes"
QUICK = [
    "suite.matched=false",
    "suite.reduction=2",
    "suite.pairs.pair-1.synthetic.duration=4",
    "suite.pairs.pair-1.synthetic.pga=3.0",
]


CASE = f'[cases."a b"]\ncase = "{MESHES}/ring_suite.toml"'


@pytest.fixture
def study(tmp_path):
    """Two rings, one of them thin, under one short motion."""
    path = tmp_path / "study.toml"
    path.write_text(
        'title = "two rings"\nscales = { precision = 0.2, between = [0.3, 2.0] }\n'
        'pairs = ["pair-1"]\n[cases]\n'
        f'"thick" = {{ case = "{MESHES}/ring_suite.toml" }}\n'
        f'"thin" = {{ case = "{MESHES}/ring_suite.toml", set = ["structure.thickness=0.4"] }}\n'
    )
    return path


def test_a_study_finds_what_its_cases_do_alone(study, tmp_path):
    asked = Study.read(study, QUICK)
    found = dict(carried_out(asked, tmp_path / "out"))
    case = Case.read(MESHES / "ring_suite.toml", QUICK)
    dead = at_rest(case)
    (motion,) = (m for m in case.ground_suite().motions if m.name == "pair-1")
    run = shaken(case, motion, dead)
    largest = float(abs(run.joints["eccentricity"]).max())
    assert found["thick"].runs["pair-1"]["eccentricity"]["arch"] == pytest.approx(largest)
    assert found["thick"].dead["arch"] == pytest.approx(
        float(abs(dead.joints["eccentricity"]).max())
    )
    assert found["thin"].frequency < found["thick"].frequency
    for definition in ("any four joints", "verified"):
        thin, thick = (float(found[name].least(definition)[0]) for name in ("thin", "thick"))
        assert 0.05 < thin < thick  # the thinner ring fails first
    assert np.isinf(found["thin"].least("ring and pier")).all()  # it has no piers
    table = study_table(found)
    assert all(word in table for word in ("thick", "thin", *DEFINITIONS, "of 1"))


def test_a_study_goes_on_where_it_was_ended(study, tmp_path, monkeypatch, capsys):
    folder = tmp_path / "out"
    command = ["study", str(study), "--out", str(folder)]
    command += [word for text in QUICK for word in ("--set", text)]
    assert main(command) == 0
    table = (folder / "study.txt").read_text()
    assert (folder / "study.png").is_file()

    def never(*_):
        raise AssertionError("a case was run again")

    monkeypatch.setattr("archfem.cases.study.at_rest", never)
    assert main(command) == 0
    assert (folder / "study.txt").read_text() == table

    found = json.loads((folder / "thin.json").read_text())
    found["case"] += " "  # of another case
    (folder / "thin.json").write_text(json.dumps(found))
    with pytest.raises(AssertionError, match="run again"):
        main(command)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[cases]", "has no cases"),
        ('[cases."a"]\nset = []', "names no case file"),
        ('[cases."a"]\ncase = "nothing.toml"', "there is no case file"),
        (f'[cases."a"]\ncase = "{MESHES}/ring.toml"', "no \\[suite\\] to compare under"),
        ("pears = 1", "unknown key 'pears'"),
        ("title =", "is not TOML"),
        ("cases = 3", "study.cases = 3 is not a table"),
        ('pairs = "pair-1"', "study.pairs = 'pair-1' is not a list"),
        ('set = "analysis.dt=0.01"', "study.set = .* is not a list"),
        ('[cases."a"]\ncase = "a.toml"\nsets = []', "unknown key 'cases.a.sets'"),
        (f'pairs = ["pair-1", "pair-9"]\n{CASE}', r"no case has the pairs \['pair-9'\]"),
        (f"scales = {{ between = [1.0] }}\n{CASE}", "scales.between = .* least and the largest"),
        (f"scales = {{ precisions = 0.1 }}\n{CASE}", "unknown key 'scales.precisions'"),
        (f"{CASE}\n{CASE.replace('a b', 'a/b')}", "'a b' names a file of results too"),
    ],
)
def test_studies_that_cannot_be_meant(text, says, tmp_path):
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(InvalidInput, match=says):
        Study.read(tmp_path / "study.toml")
    with pytest.raises(InvalidInput, match="there is no study"):
        Study.read(tmp_path / "other.toml")


def finding(**given):
    brackets = dict.fromkeys(DEFINITIONS, (1.0, 0.9))
    run = {
        "eccentricity": {"arch": 0.4},
        "friction": {"arch": float("inf")},
        "mechanisms": dict.fromkeys(DEFINITIONS),
        "ended": "finished",
        "outcome": "reached the end of the motion",
    }
    every = {
        "case": "text",
        "frequency": 9.0,
        "mass": 0.7,
        "roles": {"arch": "ring"},
        "dead": {"arch": 0.2},
        "runs": {"a": run, "b": run},
        "scales": {"a": brackets, "b": brackets},
    }
    return Finding(**every | given)


def test_a_study_tells_rings_from_piers_by_their_roles():
    named = {"runs": {}, "scales": {}, "dead": {"vault": 0.2, "stem": 0.1}}
    found = finding(roles={"vault": "ring", "stem": "pier"}, **named)
    run = finding().runs["a"] | {"eccentricity": {"vault": 0.41, "stem": 0.32}}
    found.runs = {"a": run}
    head, row = study_table({"bridge": found}).splitlines()[:2]
    assert row[head.index("|e| rings") :].split()[:2] == ["0.410", "0.320"]


def test_findings_are_kept_with_how_they_were_searched_for(tmp_path):
    path = tmp_path / "case.json"
    write(finding(search={"precision": 0.1, "between": [0.2, 2.0]}), path)
    same = kept(path, "text", {"precision": 0.1, "between": [0.2, 2.0]})
    assert set(same.scales) == {"a", "b"}
    assert same.runs["a"]["friction"]["arch"] == float("inf")
    finer = kept(path, "text", {"precision": 0.05, "between": [0.2, 2.0]})
    assert (set(finer.runs), finer.scales) == ({"a", "b"}, {})
    assert kept(path, "another text", None) is None
    found = json.loads(path.read_text())
    del found["runs"]["a"]["ended"]  # as an earlier version wrote it
    path.write_text(json.dumps(found))
    assert kept(path, "text", None) is None
    assert kept(tmp_path / "none.json", "text", None) is None


def test_a_table_counts_the_pairs_asked_for_and_runs_that_broke_off():
    broken = finding().runs["a"] | {"ended": "failed", "outcome": "failed at 0.4 s: …"}
    found = finding(runs={"a": finding().runs["a"], "b": broken})
    assert "ring: 1 of 2 runs broke off" in study_table({"ring": found})
    assert "broke off" not in study_table({"ring": found.of_pairs(["a"])})
    assert "0 of 1" in study_table({"ring": found.of_pairs(["a"])})


@pytest.mark.parametrize("during", ["run", "search"])
def test_ctrl_c_leaves_no_half_of_a_pair(study, tmp_path, monkeypatch, during):
    whole = archfem.dynamics.time_history.time_history

    def interrupted(*given, until=None, **more):
        history = whole(*given, until=until, **more)
        if (until is None) == (during == "run"):
            history.dataset.attrs["ended"] = "interrupted"
        return history

    place = {"run": "archfem.cases.run", "search": "archfem.dynamics.scales"}[during]
    monkeypatch.setattr(f"{place}.time_history", interrupted)
    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        dict(carried_out(Study.read(study, QUICK), folder))
    assert list(folder.iterdir()) == []


def test_a_case_that_does_not_stand_is_named(study, tmp_path):
    study.write_text(study.read_text().replace("thickness=0.4", "thickness=0.1"))
    with pytest.raises(DidNotConverge, match=r"^'thin': no equilibrium"):
        dict(carried_out(Study.read(study, QUICK), tmp_path))
    assert (tmp_path / "thick.json").is_file()
