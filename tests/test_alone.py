"""Installed by pip into an environment of its own, without FEniCSx and files of a checkout."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

STUDY = """
case = "ring.toml"
compute = "history"
[vary]
motion.scale = [0.1, 0.2]
"""

SHORT = ("model.fidelity=rigid", "motion.end=0.5", "output.animation=false")


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """A function that runs a command in a folder, in an environment with archfem's wheel alone."""
    folder = tmp_path_factory.mktemp("alone")
    python, clean = folder / "venv" / "bin" / "python", dict(os.environ)
    clean.pop("PYTHONPATH", None)

    def run(*words, **given):
        return subprocess.run(words, cwd=folder, env=clean, text=True, capture_output=True, **given)

    run(sys.executable, "-m", "venv", folder / "venv", check=True)
    fetched = run(python, "-m", "pip", "install", "-q", ROOT)
    if fetched.returncode:
        pytest.skip(f"pip could not fetch what archfem needs: {fetched.stderr[-500:]}")
    return lambda *words: run(python, "-m", "archfem", *words)


@pytest.mark.slow
def test_rigid_stones_are_shaken_drawn_and_studied(alone, tmp_path):
    listed = alone("examples")
    assert "ring_falls" in listed.stdout
    for name in ("ring", "ring_falls", "survey"):
        (tmp_path / f"{name}.toml").write_text(alone("example", name).stdout)
    changes = [word for change in SHORT for word in ("--set", change)]
    out = tmp_path / "out"
    ran = alone("run", str(tmp_path / "ring.toml"), "--out", str(out), *changes)
    assert ran.returncode == 0, ran.stderr
    assert "compiling the time steps" in ran.stderr
    assert {"history.nc", "dead.png", "envelope.png"} <= {path.name for path in out.iterdir()}
    again = alone("run", str(tmp_path / "ring.toml"), "--out", str(tmp_path / "again"), *changes)
    assert "compiling" not in again.stderr
    (tmp_path / "study.toml").write_text(STUDY)
    study = ("study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "study"))
    assert "2 of 2" in (ran := alone(*study, "--workers", "1", *changes)).stdout, ran.stderr


@pytest.mark.slow
def test_functions_that_need_fenicsx_state_it_in_one_line(alone, tmp_path):
    (tmp_path / "ring_paper.toml").write_text(alone("example", "ring_paper").stdout)
    for words in (("check",), ("modes", "--out", "modes"), ("mesh", "--out", "ring.msh")):
        ran = alone(*words[:1], str(tmp_path / "ring_paper.toml"), *words[1:])
        assert ran.returncode == 1
        assert "Traceback" not in ran.stderr
        assert "apt-get install python3-dolfinx" in ran.stderr.splitlines()[-1]
    well = alone("doctor")
    assert "limit analysis, and statics, histories and falls of rigid stones work" in well.stdout
    assert "apt-get install python3-dolfinx" in well.stdout
    assert "FEniCSx" not in well.stderr
