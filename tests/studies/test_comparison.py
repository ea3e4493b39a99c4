"""Studies: several cases side by side, kept pair by pair."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem._netcdf import write_dataset

MESHES = Path(__file__).parents[2] / "meshes"
QUICK = [
    "suite.matched=false",
    "suite.reduction=2",
    "suite.pairs.pair-1.synthetic.duration=2",
    "suite.pairs.pair-1.vertical.synthetic.duration=2",
    "suite.pairs.pair-1.synthetic.pga=3.0",
]
CASE = f'[cases."a b"]\ncase = "{MESHES}/ring_suite.toml"'
DEFINITIONS = af.dynamics.MECHANISM_DEFINITIONS


@pytest.fixture
def study(tmp_path):
    """Two rings, one of them thin, under one short motion."""
    path = tmp_path / "study.toml"
    path.write_text(
        'title = "two rings"\nscales = { precision = 0.2, range = [0.3, 2.0] }\n'
        'pairs = ["pair-1"]\n[cases]\n'
        f'"thick" = {{ case = "{MESHES}/ring_suite.toml" }}\n'
        f'"thin" = {{ case = "{MESHES}/ring_suite.toml", set = ["structure.thickness=0.4"] }}\n'
    )
    return path


def compared(comparison, folder):
    """Findings of a comparison by the name of the case."""
    return comparison.findings(comparison.run(folder, workers=1))


def unscaled(study):
    """Let a study run each motion unscaled: the search for factors is not tested here."""
    study.write_text(study.read_text().replace("[0.3, 2.0]", "[1.0, 1.0]"))


@pytest.mark.slow
def test_a_study_has_the_results_of_its_cases_alone(study, tmp_path):
    comparison = af.studies.Comparison.read(study, QUICK)
    found = compared(comparison, tmp_path / "out")
    case = af.Case.read(MESHES / "ring_suite.toml", QUICK)
    dead = af.cases.dead_load_of_case(case)
    (motion,) = (m for m in case.ground_suite().motions if m.name == "pair-1")
    run = af.cases.run_time_history(case, motion, dead)
    largest = float(abs(run.joints["eccentricity"]).max())
    assert found["thick"].runs["pair-1"]["eccentricity"]["arch"] == pytest.approx(largest)
    assert found["thick"].dead["arch"] == pytest.approx(
        float(abs(dead.joints["eccentricity"]).max())
    )
    assert found["thin"].frequency < found["thick"].frequency
    for definition in ("any joints at once", "verified"):
        thin, thick = (float(found[name].least(definition)[0]) for name in ("thin", "thick"))
        assert 0.05 < thin < thick  # the thinner ring fails first
    assert np.isinf(found["thin"].least("ring and pier at once")).all()  # it has no piers
    table = af.studies.study_table(found)
    assert all(word in table for word in ("thick", "thin", *DEFINITIONS, "of 1"))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[cases]", "has no cases"),
        ('[cases."a"]\nset = []', "names no case file"),
        ('[cases."a"]\ncase = "nothing.toml"', "there is no case file"),
        (f'[cases."a"]\ncase = "{MESHES}/ring.toml"', "no \\[suite\\] to compare under, and no"),
        ("pears = 1", "unknown key 'pears'"),
        ("title =", "is not TOML"),
        ("cases = 3", "study.cases = 3 is not a table"),
        ('pairs = "pair-1"', "study.pairs = 'pair-1' is not a list"),
        ('set = "analysis.dt=0.01"', "study.set = .* is not a list"),
        ('[cases."a"]\ncase = "a.toml"\nsets = []', "unknown key 'cases.a.sets'"),
        (f'pairs = ["pair-1", "pair-9"]\n{CASE}', r"no case has the pairs \['pair-9'\]"),
        (f"scales = {{ range = [1.0] }}\n{CASE}", "scales.range = .* least and the largest"),
        (f"scales = {{ precisions = 0.1 }}\n{CASE}", "unknown key 'scales.precisions'"),
        (f"{CASE}\n{CASE.replace('a b', 'a/b')}", "'a/b' names a file of results too"),
    ],
)
def test_invalid_studies_are_refused(text, says, tmp_path):
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(af.InvalidInput, match=says):
        af.studies.Comparison.read(tmp_path / "study.toml")
    with pytest.raises(af.InvalidInput, match="there is no study"):
        af.studies.Comparison.read(tmp_path / "other.toml")


def interrupted_run(*given, **options):
    history = af.time_history(*given, **options)
    history.dataset.attrs["ended"] = "interrupted"
    return history


def interrupted_search(*given, **options):
    one = {**options, "between": (1.0, 1.0)}
    return replace(af.mechanism_scales(*given, **one), interrupted=True)


@pytest.mark.parametrize(
    ("name", "instead"),
    [("time_history", interrupted_run), ("mechanism_scales", interrupted_search)],
)
def test_ctrl_c_leaves_no_half_of_a_pair(study, tmp_path, monkeypatch, name, instead):
    monkeypatch.setattr(f"archfem.studies.evaluators.{name}", instead)
    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        compared(af.studies.Comparison.read(study, QUICK), folder)
    assert not [*folder.glob("*/*/*.json"), *folder.glob("thi*.json")]


@pytest.mark.slow
def test_a_case_that_does_not_stand_is_named_and_the_others_are_compared(study, tmp_path, capsys):
    unscaled(study)
    study.write_text(study.read_text().replace("thickness=0.4", "thickness=0.1"))
    command = ["study", str(study), "--out", str(tmp_path), "--workers", "1"]
    assert af.commands.main([*command, *(w for text in QUICK for w in ("--set", text))]) == 3
    said = capsys.readouterr().out
    assert "in doubt: 1 of 2 points ended in DidNotConverge" in said
    assert "joints hinge" in said
    assert (tmp_path / "thick.json").is_file()
    assert not (tmp_path / "thin.json").exists()


def never(*_, **__):
    raise AssertionError("a case was run again")


@pytest.mark.slow
def test_a_study_continues_where_it_was_ended(study, undrawn, tmp_path, monkeypatch):
    unscaled(study)
    folder = tmp_path / "out"
    command = ["study", str(study), "--out", str(folder), "--workers", "1"]
    command += [word for text in QUICK for word in ("--set", text)]
    assert af.commands.main(command) == 0
    table = (folder / "study.txt").read_text()
    assert (folder / "study.png").is_file()

    monkeypatch.setattr("archfem.studies.process_pool.evaluate_serially", never)

    def write_otherwise(dataset, path, what):
        encoding = {name: {"zlib": True} for name in dataset if dataset[name].dtype == float}
        return write_dataset(dataset, path, what, encoding)

    # other bytes of the same table, as where HDF5 writes the time into a file
    monkeypatch.setattr("archfem.studies.result_store.write_dataset", write_otherwise)
    comparison = af.studies.Comparison.read(study, QUICK)
    found = compared(comparison, folder)
    assert af.studies.study_table(found) in table
    assert json.loads((folder / "thin.json").read_text())["case"] == comparison.cases["thin"].text()
    assert af.commands.main(command) == 0
    assert (folder / "study.txt").read_text() == table
    assert set(af.studies.read_table(folder / "results.nc")["case"].values) == {"thick", "thin"}

    other = af.studies.Comparison.read(study, [*QUICK, "analysis.dt=4 ms"])
    with pytest.raises(AssertionError, match="run again"):
        compared(other, folder)


def test_findings_state_the_falls_and_the_first_mechanisms_of_runs(study):
    """Blocks of the first case fall after a mechanism; the second stands, at all scales."""
    comparison = af.studies.Comparison.read(study, QUICK)
    columns = {
        **{"error": ["", ""], "frequency": [20.0, 9.0], "mass": [0.7, 0.8]},
        **{"role: arch": ["ring", "ring"], "dead: arch": [0.1, 0.2]},
        **{"eccentricity: arch": [0.3, 0.4], "friction: arch": [0.5, np.inf]},
        **{"mechanism: verified": ["global", ""], "time: verified": [1.5, np.inf]},
        **{"fall": ["fallen", ""], "ended": ["collapsed", "finished"], "outcome": ["fell", "ran"]},
    }
    for name in DEFINITIONS:
        columns |= {f"scale: {name}": [1.2, np.inf], f"survives: {name}": [1.1, 2.0]}
    table = xr.Dataset({name: ("point", values) for name, values in columns.items()})
    found = comparison.findings(table)
    assert list(found) == ["thick", "thin"]
    thick, thin = (finding.runs["pair-1"] for finding in found.values())
    assert (thick["fall"], thin["fall"]) == ("fallen", None)
    assert thick["mechanisms"]["verified"] == {"kind": "global", "time": 1.5}
    assert thin["mechanisms"]["verified"] is None
    assert (thick["friction"], thin["friction"]) == ({"arch": 0.5}, {"arch": np.inf})
    assert found["thick"].scales == {"pair-1": dict.fromkeys(DEFINITIONS, (1.2, 1.1))}
    assert np.isinf(found["thin"].least("verified")).all()


@pytest.mark.parametrize(
    ("suite", "factor"),
    [(None, 1.0), ({}, 1.0), ({"reduction": 3.0}, 3.0), ({"reduction": 3.0, "scale": 1.5}, 2.0)],
)
def test_motions_are_reduced_by_the_factor_over_the_scale(suite, factor):
    cases = {"first": SimpleNamespace(suite=suite), "second": SimpleNamespace(suite={"scale": 7.0})}
    assert af.studies.Comparison.reduction.fget(SimpleNamespace(cases=cases)) == factor
