"""What the doctor says of an installation, and of examples."""

import sys
from importlib import metadata

from archfem import packages
from archfem.commands import doctor
from archfem.commands.line import main


def test_what_is_there_has_its_version():
    found = {each.what: each.state for each in doctor.findings()}
    assert found["numpy"] == metadata.version("numpy")
    assert found["archfem"].startswith(metadata.version("archfem"))
    assert "compiled code" in found


def test_all_is_well_ends_with_zero(monkeypatch, capsys):
    monkeypatch.setattr(doctor, "findings", lambda: [doctor.Finding("archfem", "1.0")])
    assert main(["doctor"]) == 0
    assert capsys.readouterr().out.split() == ["archfem", "1.0", "all", "is", "well"]


def test_what_is_missing_is_told_with_its_remedy(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "archfem.models.fem", None)
    monkeypatch.setattr(packages, "DISPLAYS", ("libNone.so",))
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(metadata, "requires", lambda name: ["numpy>=99.1", "nonesuch>=1", "a; b"])
    assert main(["doctor"]) == 1
    told = capsys.readouterr()
    for remedy in ("apt-get install python3-dolfinx", "apt-get install libegl1", "numpy>=99.1"):
        assert remedy in told.out
    assert "nonesuch" in told.err
    assert "FEniCSx" in told.err


def test_examples_are_listed_and_printed(tmp_path, capsys):
    assert main(["examples"]) == 0
    assert "ring_falls" in capsys.readouterr().out
    assert main(["example", "ring_falls"]) == 0
    told = capsys.readouterr()
    assert 'ring.toml"\ntitle = "A ring that falls' in told.out
    assert "it refers to ring.toml" in told.err
    assert main(["example", "ring", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "ring.toml").is_file()
