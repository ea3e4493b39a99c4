"""Studies: several cases side by side, kept pair by pair."""

import json
from pathlib import Path

import numpy as np
import pytest

from archfem.analysis import at_rest, shaken
from archfem.case import Case
from archfem.cli import main
from archfem.errors import InvalidInput
from archfem.studies import Study, carried_out, study_table
from archfem.verdicts import DEFINITIONS

MESHES = Path(__file__).parents[2] / "meshes"
QUICK = [
    "suite.matched=false",
    "suite.reduction=2",
    "suite.pairs.pair-1.synthetic.duration=4",
    "suite.pairs.pair-1.synthetic.pga=3.0",
]


@pytest.fixture
def study(tmp_path):
    """Two rings, one of them thin, under one short motion."""
    path = tmp_path / "study.toml"
    path.write_text(
        f'title = "two rings"\nscales = true\npairs = ["pair-1"]\n[cases]\n'
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

    monkeypatch.setattr("archfem.studies.at_rest", never)
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
    ],
)
def test_studies_that_cannot_be_meant(text, says, tmp_path):
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(InvalidInput, match=says):
        Study.read(tmp_path / "study.toml")
    with pytest.raises(InvalidInput, match="there is no study"):
        Study.read(tmp_path / "other.toml")


def test_pairs_that_no_case_has(study, tmp_path):
    study.write_text(study.read_text().replace("pair-1", "pair-9"))
    with pytest.raises(InvalidInput, match="none of the pairs"):
        dict(carried_out(Study.read(study), tmp_path))
