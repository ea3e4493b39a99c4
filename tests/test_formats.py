"""Files of another version of archfem, or of another kind, are refused by one message."""

import hashlib
import shutil

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem import _files
from archfem._netcdf import write_dataset
from archfem.cases.answers import Ratios, Row, Scales, Statement
from archfem.cases.push_factors import PushFactors
from archfem.cases.run import HISTORY_FILE, carry_out, replace_run
from archfem.dynamics import CollapseState, VerdictRange
from archfem.studies.collapse_risk import CollapseRisk

STACK = {
    "structure": {"shape": "column", "breadth": 0.5, "heights": [1.0, 1.0]},
    "model": {"fidelity": "rigid", "displacements": "large"},
    "motion": {"synthetic": {"duration": 0.5, "pga": 1.0}},
    "record": {"fields_every": 4},
}

MESSAGE = r"{} was written by another version of archfem \(format '.*', not '.* 8'\): "
"""Begin of the message, behind the name of the file."""

READERS = {
    "history file": (af.History.read, "run `archfem run` again"),
    "file of a verdict's range": (VerdictRange.read, "run `archfem verdict` again"),
    "file of a risk": (CollapseRisk.read, "delete it and run `archfem risk` again"),
    "table": (af.studies.read_table, "run `archfem study` again"),
}
"""Readers of datasets, and the remedy, by the kind of file."""

LAYOUTS = {8: "a639a0f5948577b3"}
"""Digests of the names in result files, by the number of their format."""


@pytest.fixture
def older(monkeypatch):
    """Until it is undone, what is written is of an older version."""
    monkeypatch.setattr(_files, "FORMAT", 0)
    return monkeypatch


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Folder of a run."""
    case, folder = af.Case.of(STACK), tmp_path_factory.mktemp("results")
    with replace_run(case, folder) as draft:
        list(carry_out(case, draft))
    return folder


@pytest.mark.parametrize("what", READERS)
def test_tables_of_another_version_or_kind_are_refused(what, tmp_path, older):
    read, remedy = READERS[what]
    numbers = xr.Dataset({"N": ("time", [1.0, 2.0])}, attrs={"title": "it was"})
    path = write_dataset(numbers, tmp_path / "old.nc", what)
    older.undo()
    refused = f"{MESSAGE.format('old.nc')}{remedy}"
    with pytest.raises(af.InvalidInput, match=refused):
        read(path)
    other = next(name for name in READERS if name != what)
    write_dataset(numbers, path, other)
    with pytest.raises(af.InvalidInput, match=refused):
        read(path)
    numbers.assign_attrs(sealed=1).to_netcdf(path, engine="netcdf4")  # without a format
    with pytest.raises(af.InvalidInput, match=r"old\.nc (was written by another|is damaged)"):
        read(path)


def test_commands_refuse_results_of_another_version(
    results, tmp_path, unplotted, undoubted, monkeypatch, capsys
):
    """A folder by its list, a history that was moved alone by its own format."""
    folder, alone = shutil.copytree(results, tmp_path / "out"), tmp_path / "alone.nc"
    groups = {name: group._asdict() for name, group in _files.read_file_list(folder).items()}
    run = af.History.read(folder / HISTORY_FILE)
    with monkeypatch.context() as older:
        older.setattr(_files, "FORMAT", 0)
        _files.write_sealed_json(folder / "archfem.json", groups)
        _files.write_sealed_json(tmp_path / "study.json", {"points": []})
        run.save(alone)
    for command, name in (
        (["report", str(folder)], "archfem.json"),
        (["page", str(folder)], "archfem.json"),
        (["report", str(alone)], "alone.nc"),
        (["animate", str(alone)], "alone.nc"),
        (["study", "--status", str(tmp_path)], "study.json"),
    ):
        assert af.commands.main(command) == 1
        said = capsys.readouterr().err
        assert f"{name} was written by another version of archfem (format '" in said
        assert "Traceback" not in said
    # the remedy
    case = tmp_path / "case.toml"
    case.write_text(af.Case.of(STACK).text())
    assert af.commands.main(["run", str(case), "--out", str(folder)]) == 0
    assert af.cases.open_results(folder).runs


def test_samples_of_another_version_are_not_continued(tmp_path, older):
    path = write_dataset(xr.Dataset({"runs": ("sample", [1])}), tmp_path / "a.nc", "file of a risk")
    older.undo()
    block = af.column(breadth=0.25, heights=[1.5])
    motions = [af.Motion.synthetic(duration=1.0, pga=1.0, seed=seed) for seed in range(2)]
    with pytest.raises(af.InvalidInput, match=r"another version of archfem .*: delete it and run"):
        af.collapse_risk(block, motions, af.Hazard.power(2e-3, 2.5), samples=8, out=path)


def _layout_of(dataset):
    """Names and dimensions of variables, whether they are texts, and names of attributes."""
    variables = dataset.variables.items()
    shapes = sorted((name, each.dims, each.dtype.kind in "OUT") for name, each in variables)
    return [shapes, sorted(dataset.attrs)]


def test_a_change_of_names_in_files_changes_the_number_of_the_format(results, monkeypatch):
    """Of all kinds of files, in which names are read again."""
    stands = CollapseState("stands", None, (), 0.0, 0.0, True)
    for module in (af.studies.variations, af.studies.collapse_risk):
        monkeypatch.setattr(module, "prepare_runs", lambda *_: lambda _: stands)
    block = af.column(breadth=0.25, heights=[1.5])
    motions = [af.Motion(np.array([0.0, 1.0, 0.0]), 0.01, name=name) for name in "ab"]
    falls = af.collapse_risk(block, motions, af.Hazard.power(2e-3, 2.5), samples=8)
    found = [
        _layout_of(af.History.read(results / HISTORY_FILE).dataset),
        _layout_of(af.verdict_range(block, motions[0], samples=1).dataset),
        _layout_of(falls.dataset),
        [each._fields for each in (Statement, Row, Ratios, Scales, PushFactors, _files.FileGroup)],
    ]
    digest = hashlib.sha256(repr(found).encode()).hexdigest()[:16]
    remedy = f"names in files have changed: raise FORMAT, with {digest!r} in LAYOUTS\n{found}"
    assert LAYOUTS[_files.FORMAT] == digest, remedy
