"""Modules of the user: the examples of the page work, need permission, and are checked."""

import os
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest

import archfem as af
from archfem.cases.motion_keys import build_spectrum
from archfem.cases.provenance import hash_inputs
from archfem.dynamics.events import registered_criteria
from archfem.motion.records import reader

ROOT = Path(__file__).parents[2]

CASE = """
extensions = ["mine.py"]

[structure]
shape = "column"
breadth = "0.6 m"
heights = ["1.2 m", "1.2 m"]

[model]
fidelity = "rigid"

[motion]
file = "record.txt"

[analysis]
dt = "10 ms"
until = "overloaded"

[assessment]
spectrum = { code = "plateau", level = 0.9, corner = 0.5 }
"""


@pytest.fixture
def folder(tmp_path):
    page = (ROOT / "docs/howto/extend.md").read_text("utf-8")
    code = "\n\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL))
    # the column's joints carry some 20 kN under dead load
    (tmp_path / "mine.py").write_text(code.replace("40e3", "10e3"), "utf-8")
    (tmp_path / "case.toml").write_text(CASE)
    rows = "\n".join(f"{value:.2f}" for value in 100.0 * np.sin(np.arange(40.0)))
    (tmp_path / "record.txt").write_text(f"OUR STATION, RATE 100 HZ\n{rows}\n")
    return tmp_path


# Modules of a process have distinct names, so that the page's is loaded by a process of its own.
def call(folder, *words):
    paths = {"PYTHONPATH": str(ROOT), "PATH": os.environ["PATH"], "HOME": str(folder)}
    command = [sys.executable, *words]
    return subprocess.run(command, cwd=folder, env=paths, text=True, capture_output=True)


SCRIPT = """
import archfem as af
from archfem.cases.provenance import hash_inputs, hash_sections
def digests():
    digest = hash_inputs(case.settings, case.folder)
    return {digest, hash_sections(case.settings, case.folder, ["motion"])}
af.cases.load_extension("mine.py")
case = af.Case.read("case.toml")
motion = case.ground_motion()
print(motion.dt, abs(motion.horizontal).max())
spectrum = case.assessment.spectrum
print(*spectrum.horizontal([0.25, 1.0]), *spectrum.vertical([0.25]))
before = digests()
history = af.cases.run_time_history(case, motion, af.cases.dead_load_of_case(case))
print(len(history.time) - 1, history.dataset.attrs["outcome"])
study = af.Study(case, {"structure.breadth": [0.5, 0.6]}, "slenderness")
print(*study.run(workers=2)["least depth"].values)
open("mine.py", "a").write("# changed\\n")
print(not before & digests())
"""


@pytest.mark.slow
def test_the_examples_of_the_page_work_together(folder):
    ran = call(folder, "-c", SCRIPT)
    assert ran.returncode == 0, ran.stderr
    sampled, spectra, ended, found, changed = ran.stdout.splitlines()
    assert sampled == "0.01 1.0"  # 100 Hz, and a sine in cm/s² whose printed peak is 100
    # 0.9 g up to 0.5 s, then as 1 / T; the vertical is 0.7 of it
    assert [float(word) for word in spectra.split()] == pytest.approx([0.9, 0.45, 0.63])
    # two blocks of 0.6 m × 1.2 m × 1 m and 2000 kg/m³ weigh 28 kN
    assert ended.startswith("1 ended at 0.01 s by N = 28")
    assert found == "0.5 0.6"  # breadth of the column, from two worker processes
    assert changed == "True"


@pytest.fixture
def permitted(monkeypatch, tmp_path):
    monkeypatch.setenv("ARCHFEM_OWN_CODE", "")  # which commands of other tests may have set
    monkeypatch.setattr(sys, "path", list(sys.path))
    return tmp_path


def test_no_case_runs_code_by_itself(permitted, monkeypatch):
    monkeypatch.chdir(permitted)
    (permitted / "case.toml").write_text(CASE.replace("mine.py", "module_that_leaves_a_file.py"))
    (permitted / "record.txt").write_text("OUR STATION\n")
    (permitted / "module_that_leaves_a_file.py").write_text("open('it ran', 'w').close()")
    with pytest.raises(af.InvalidInput, match="is code, which no file runs by itself"):
        af.Case.read(permitted / "case.toml")
    # the only default test of `python -m archfem`, and so a process
    refused = call(permitted, "-m", "archfem", "check", "case.toml")
    assert refused.returncode == 1
    assert "--own-code" in refused.stderr
    assert not (permitted / "it ran").exists()
    af.commands.main(["check", "case.toml", "--own-code"])
    assert (permitted / "it ran").exists()


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("x = 1\ny = 1 / 0", "failed at wrong_{}.py, line 2: ZeroDivisionError"),
        ("x = (", "SyntaxError"),
        ("import archfem as af\naf.motion.register_spectrum('s', int)", "no dataclass"),
    ],
)
def test_errors_of_a_module_name_its_file_and_line(permitted, code, said, request):
    number = abs(hash(code))
    path = permitted / f"wrong_{number}.py"
    path.write_text(code)
    with pytest.raises(af.InvalidInput, match=re.escape(said.format(number))):
        af.cases.load_extension(path)


def test_a_module_does_not_hide_another(permitted):
    (permitted / "json.py").write_text("")
    with pytest.raises(af.InvalidInput, match="another module 'json'"):
        af.cases.load_extension(permitted / "json.py")
    with pytest.raises(af.InvalidInput, match="no file of a Python module"):
        af.cases.load_extension(permitted / "missing.py")


def test_a_module_that_has_changed_is_refused(permitted):
    path = permitted / "changing_module.py"
    path.write_text("")
    assert af.cases.load_extension(path) is af.cases.load_extension(path)
    path.write_text("# changed")
    with pytest.raises(af.InvalidInput, match="has changed since it was loaded"):
        af.cases.load_extension(path)


def test_a_module_is_found_before_others_of_its_name(permitted, monkeypatch):
    elsewhere = permitted / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.syspath_prepend(str(elsewhere))
    for folder in (permitted, elsewhere):
        (folder / "twice_there.py").write_text(f"place = {folder.name!r}")
    assert af.cases.load_extension(permitted / "twice_there.py").place == permitted.name


def test_a_case_takes_a_module_as_it_was_loaded(permitted):
    """Permitted and unchanged, or deleted since: a report reads its case without the file."""
    path = permitted / "module_of_a_case.py"
    path.write_text("")
    column = {"shape": "column", "breadth": 1.0, "heights": [1.0]}
    settings = {"extensions": [path.name], "structure": column}
    for names in ([path.name], ["never_there.py"]):
        with pytest.raises(af.InvalidInput, match="is code, which no file runs by itself"):
            af.Case.of({**settings, "extensions": names}, permitted)
    af.cases.load_extension(path)
    assert len(af.Case.of(settings, permitted).structure.free) == 1
    digest = hash_inputs(settings, permitted)
    path.write_text("# changed")
    assert hash_inputs(settings, permitted) != digest
    with pytest.raises(af.InvalidInput, match="has changed since it was loaded"):
        af.Case.of(settings, permitted)
    path.unlink()
    assert len(af.Case.of(settings, permitted).structure.free) == 1


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A distribution on the path, as pip leaves it, whose module registers a joint law."""
    made = tmp_path / "site"
    about = made / "ourlab-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: ourlab\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[archfem.extensions]\nourlab = ourlab_additions\nbroken = ourlab_missing\n"
    )
    (made / "ourlab_additions.py").write_text(
        "import archfem as af\naf.joints.register_joint_law('ours', af.joints.DryJoint)\n"
    )
    monkeypatch.syspath_prepend(str(made))
    return about


PACKAGED = """
extensions = ["ourlab"]

[structure]
shape = "column"
breadth = "0.6 m"
heights = ["1.2 m"]

[contacts."stone to stone".law]
name = "ours"
normal_stiffness = "2 MPa/mm"
shear_stiffness = "1e9 Pa/m"
"""


def test_a_field_without_its_unit_is_refused(installed, permitted):
    @dataclass(frozen=True)
    class Plain(af.joints.DryJoint):
        softening: float = 0.0

    af.joints.register_joint_law("plain", Plain)
    path = permitted / "case.toml"
    path.write_text(PACKAGED.replace('"ours"', '"plain"\nsoftening = "1 Pa"'))
    with pytest.raises(af.InvalidInput, match=r"law\.softening = '1 Pa' has a unit, and the field"):
        af.Case.read(path)


def test_an_installed_package_adds_to_archfem(installed, permitted):
    path = permitted / "case.toml"
    path.write_text(PACKAGED)
    case = af.Case.read(path)
    law = af.joints.DryJoint(2e9, 1e9)
    assert case.structure.joints[0].contact.law == law
    digests = {hash_inputs(case.settings, case.folder)}
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: ourlab\nVersion: 1.1\n")
    digests.add(hash_inputs(case.settings, case.folder))
    assert len(digests) == 2
    assert af.cases.load_extension("ourlab").__name__ == "ourlab_additions"
    with pytest.raises(af.InvalidInput, match="extension 'broken' failed: ModuleNotFoundError"):
        af.cases.load_extension("broken")
    path.write_text(PACKAGED.replace("ourlab", "theirlab"))
    with pytest.raises(af.InvalidInput, match=r"'theirlab' is that of 0 installed.*'ourlab'"):
        af.Case.read(path)


class Flat:
    level: float

    def horizontal(self, periods):
        return self.level - np.asarray(periods)

    def vertical(self, periods):
        return np.zeros(3)


@pytest.mark.parametrize(
    ("level", "said"),
    [
        (1.0, "horizontal: -0.05 g at 1.05 s"),
        (20.0, "20 g at 0 s"),
        (5.0, r"vertical: \(3,\) values"),
    ],
)
def test_a_spectrum_is_checked(level, said):
    af.motion.register_spectrum("flat", dataclass(Flat))
    with pytest.raises(af.InvalidInput, match=said):
        build_spectrum({"code": "flat", "level": level}, "suite.target")


@dataclass(frozen=True)
class Corner:
    level: float
    corner: Annotated[float, "s"] = 1.0
    long: float = field(default=2.0, metadata={"unit": "s"})
    fixed: float = field(default=3.0, init=False)

    def horizontal(self, periods):
        return self.level * np.minimum(1.0, self.corner / np.maximum(periods, 1e-9))

    def vertical(self, periods):
        return self.level * (np.asarray(periods) < self.long)


def test_units_of_fields_are_annotated_or_in_metadata():
    af.motion.register_spectrum("corner", Corner)
    table = {"code": "corner", "level": 0.5, "corner": "500 ms", "long": "4000 ms"}
    assert build_spectrum(table, "suite.target") == Corner(0.5, 0.5, 4.0)
    for wrong in ({"level": "0.5 s"}, {"corner": "1 m"}, {"fixed": 1.0}):
        with pytest.raises(af.InvalidInput, match=rf"suite\.target\.{next(iter(wrong))}"):
            build_spectrum({**table, **wrong}, "suite.target")


def test_no_spectrum_replaces_one_of_a_code():
    with pytest.raises(af.InvalidInput, match="'EC8' is one of archfem's"):
        af.motion.register_spectrum("EC8", Corner)
    assert build_spectrum({"code": "EC8", "ag": 0.3, "ground": "A"}, "x") == af.Eurocode8(0.3, "A")
    # those of a case are for 5 % damping, as the motions that they are compared with
    with pytest.raises(af.InvalidInput, match=r"unknown key 'x\.damping'"):
        build_spectrum({"code": "EC8", "ag": 0.3, "ground": "A", "damping": 0.08}, "x")


def test_fields_of_a_spectrum_are_keys_of_a_case():
    listed = type("Listed", (Flat,), {"__annotations__": {"values": list}})
    with pytest.raises(af.InvalidInput, match="none of float, int and str"):
        af.motion.register_spectrum("listed", dataclass(listed))
    with pytest.raises(af.InvalidInput, match="no method horizontal"):
        af.motion.register_spectrum("empty", dataclass(type("Empty", (), {})))
    af.motion.register_spectrum("flat", dataclass(Flat))
    with pytest.raises(af.InvalidInput, match="level"):
        build_spectrum({"code": "flat", "levle": 1.0}, "suite.target")


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (lambda text: 1.0 / 0.0, "test_extensions.py, line"),
        (lambda text: None, r"returned None: return \[Channel"),
        (lambda text: [np.zeros(3)], "another thing than a Channel"),
        (lambda text: [af.motion.Channel(np.ones(9), 2.0)], "sampling interval 2 s"),
    ],
)
def test_a_reader_is_checked(tmp_path, monkeypatch, read, said):
    monkeypatch.setattr(reader, "_registered_formats", {})
    af.motion.register_record_format("mine", {"^MINE$": 1}, read)
    (tmp_path / "record.txt").write_text("MINE\n1\n2\n")
    with pytest.raises(af.InvalidInput, match=said):
        af.Motion.read(tmp_path / "record.txt")


def test_marks_of_a_format_are_patterns():
    for marks, said in (({}, "no marks"), ({"(": 1}, "missing \\)")):
        with pytest.raises(af.InvalidInput, match=said):
            af.motion.register_record_format("mine", marks, list)


def test_a_criterion_is_checked():
    column = af.column(breadth=0.6, heights=[1.0])
    with pytest.raises(af.InvalidInput, match="takes the structure, and N, V, M"):
        af.dynamics.register_criterion("mine", lambda structure: None)
    for criterion, said in (
        (lambda structure, resultants: 1, "returned 1: return a text, or None"),
        (lambda structure, resultants: resultants[99], "test_extensions.py, line .* IndexError"),
    ):
        af.dynamics.register_criterion("mine", criterion)
        with pytest.raises(af.InvalidInput, match=said):
            registered_criteria["mine"](column, np.zeros((1, 3)))


def test_a_finding_is_checked():
    with pytest.raises(af.InvalidInput, match="one of archfem's"):
        af.studies.register_finding("history", lambda case: {})
    with pytest.raises(af.InvalidInput, match="does not take"):
        af.studies.register_finding("mine", lambda: {})
