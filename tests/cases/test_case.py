"""Case files and the command line: what is understood, what is refused and how."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from archfem.cases.case import Case
from archfem.cases.cli import main
from archfem.dynamics.history import Ending, History
from archfem.dynamics.schemes import HHT
from archfem.errors import InvalidInput, InvalidStructure
from archfem.joints.criteria import Criteria
from archfem.units import in_unit

RING = Path(__file__).parents[2] / "meshes" / "ring.toml"


def test_quantities():
    assert in_unit("1.48 MPa/mm", "Pa/m", "k") == pytest.approx(1.48e9)
    assert in_unit("20 kN/m^3", "N/m**3", "weight") == pytest.approx(20e3)
    assert in_unit(159, "degree", "embrace") == 159.0
    assert in_unit("0.5 g_0", "m/s**2", "pga") == pytest.approx(0.5 * 9.80665)


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ("2 kg", "not in a unit like m"),
        ("two", "not a quantity"),
        ("2 furlonks", "not a quantity"),
        ("(", "not a quantity"),
        (float("nan"), "not finite"),
        ("nan m", "not finite"),
        (True, "not a number"),
        ([1.0], "not a number"),
    ],
)
def test_what_is_no_quantity(value, says):
    with pytest.raises(InvalidInput, match=f"key = .*{says}"):
        in_unit(value, "m", "key")


def test_shipped_case():
    case = Case.read(RING)
    assert case.structure.joints[8].depth == pytest.approx(0.55)
    assert case.structure.joints[0].contact.normal_stiffness == pytest.approx(1.48e9)
    assert case.damping.frequencies == (8.0, 16.0)
    assert case.ground_motion().pga == pytest.approx(5.5)
    assert Case.of(tomllib.loads(case.text())).structure == case.structure


def test_changes_from_the_command_line():
    changes = ["structure.thickness=0.6", "analysis.scheme=hht", "motion.scale=0.5", "title=x y"]
    case = Case.read(RING, changes)
    assert case.structure.joints[0].depth == pytest.approx(0.6)
    assert case.scheme == HHT()
    assert case.title == "x y"
    assert case.ground_motion().pga == pytest.approx(2.75)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("structure.radus=3", "unknown key 'structure.radus': did you mean 'radius'"),
        ("structre.radius=3", "unknown key 'structre': did you mean 'structure'"),
        ("structure.radius='3 s'", r"structure.radius = '3 s' is not in a unit like m"),
        ("structure.voussoirs=1.5", "structure.voussoirs = 1.5 is not a whole number"),
        ("structure.shape=cone", "structure.shape = 'cone' is not known"),
        ("structure.material=jelly", "'jelly' is not among the materials"),
        ("structure.material=['stone']", r"structure.material = \['stone'\] is not a word"),
        ("structure.shape=['column']", r"structure.shape = \['column'\] is not known"),
        ("materials.stne={young=1e9}", "materials.stne: .*missing .*'poisson'"),
        ("contacts.x={normal_stifness=1e9}", "'contacts.x.normal_stifness': did you mean"),
        ("analysis.dt=-1", "analysis.dt = -1 s is not between 0 and 0.1 s"),
        ("analysis.dt='5 s'", "analysis.dt = 5 s is not between"),
        ("output.free_body='vousoir 3'", "no block 'vousoir 3': .*'voussoir 3'"),
        ("model.cells=4", r"model.cells = 4 is not a list"),
        ("model.cells=[0, 4]", "ring.toml: cells through = 0 is not a whole number"),
        ("model.fidelity=modal", "'modal' is no longer known, for 'faces' is faster"),
        ("analysis.damping={ratio=0.05}", "give a ratio and two frequencies"),
        ("analysis.scheme=euler", "use 'newmark', or 'hht'"),
        ("analysis.halt=maybe", "not true or false"),
        ("criteria.hinge=0.7", "criteria hinge = 0.7: .* at most 0.5"),
        ("criteria.limit=0.4", "unknown key 'criteria.limit'"),
        ("criteria.failures=4.0", "criteria.failures = 4.0 is not a whole number"),
        ("criteria=0.4", r"criteria = 0.4 is not a table: write \[criteria\]"),
        ("structure=3", "structure = 3 is not a table"),
        ("nonsense", "write section.key=value"),
        ("title.x=3", "title is not a table"),
    ],
)
def test_refusals_name_the_key(change, says):
    with pytest.raises((InvalidInput, InvalidStructure), match=says):
        Case.read(RING, [change])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("structure.width=0", "do not fit into a width of 0 m"),
        ("structure.arches.main arch.spn=3", "structure.arches.main arch.spn': did you mean"),
        ("structure.piers.gapp=3", "'structure.piers.gapp': did you mean 'gap'"),
        ("structure.backfill.hmp=3", "'structure.backfill.hmp': did you mean 'hump'"),
        ("structure.paving={thickness=0.2,lenght=1}", "structure.paving.lenght': did you mean"),
        ("suite.pairs.pair-1.synthetic.sed=1", "'suite.pairs.pair-1.synthetic.sed': did you mean"),
        ("suite.target.code=['EC8']", r"suite.target.code = \['EC8'\] is not known"),
        ("analysis.damping.jonts='closed'", "'analysis.damping.jonts': did you mean"),
    ],
)
def test_refusals_name_the_key_in_tables_of_a_bridge(change, says):
    with pytest.raises((InvalidInput, InvalidStructure), match=says):
        Case.read(RING.with_name("prusias.toml"), [change])


def test_an_output_that_is_no_folder_is_an_error_of_one_line(tmp_path, capsys):
    (tmp_path / "out").write_text("a file")
    given = ["run", str(RING), "--set", "model.fidelity=rigid", "--out", str(tmp_path / "out")]
    assert main(given) == 1
    assert "File exists" in capsys.readouterr().err


def test_geometry_errors_name_the_file():
    with pytest.raises(InvalidStructure, match=r"ring.toml: thickness 9 m"):
        Case.read(RING, ["structure.thickness=9"])


def test_motion_must_be_one_thing():
    with pytest.raises(InvalidInput, match="either a file, or synthetic"):
        Case.read(RING, ["motion.file=x.AT2"]).ground_motion()
    with pytest.raises(InvalidInput, match=r"x\.AT2"):
        Case.of({**Case.read(RING).settings, "motion": {"file": "x.AT2"}}).ground_motion()


def test_files_that_are_no_case(tmp_path):
    with pytest.raises(InvalidInput, match="no case file"):
        Case.read(tmp_path / "none.toml")
    bad = tmp_path / "bad.toml"
    bad.write_text("= 3")
    with pytest.raises(InvalidInput, match="is not TOML"):
        Case.read(bad)


def test_check_command(capsys):
    assert main(["check", str(RING), "--set", "model.fidelity=rigid"]) == 0
    assert "ready" in capsys.readouterr().out
    assert main(["check", str(RING), "--set", "structure.radus=3"]) == 1
    assert "did you mean 'radius'" in capsys.readouterr().err


def test_run_command(tmp_path, capsys):
    changes = ["model.fidelity=rigid", "motion.end=2", "output.animation=false"]
    given = [part for change in changes for part in ("--set", change)]
    assert main(["run", str(RING), "--out", str(tmp_path / "out"), *given]) == 0
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert made == {
        "case.toml",
        "dead.png",
        "history.nc",
        "summary.txt",
        "gravest.png",
        "envelope.png",
        "joints.png",
    }
    run = History.read(tmp_path / "out" / "history.nc")
    assert run.time[-1] == pytest.approx(2.0)
    assert Case.of(tomllib.loads(run.dataset.attrs["case"])).model["fidelity"] == "rigid"
    assert "joint 17" in capsys.readouterr().out


def test_criteria_of_a_case_are_obeyed(tmp_path, capsys):
    """Four joints reach |e| = 0.38 at once, and never 0.46."""
    changes = ["model.fidelity=rigid", "motion.end=4", "analysis.halt=true"]
    changes += ["output.animation=false"]
    given = [part for change in changes for part in ("--set", change)]
    assert main(["run", str(RING), "--out", str(tmp_path / "usual"), *given]) == 0
    assert "no mechanism by count: never 4 failed joints" in capsys.readouterr().out
    loose = ["--set", "criteria.hinge=0.38"]
    assert main(["run", str(RING), "--out", str(tmp_path / "loose"), *given, *loose]) == 0
    run = History.read(tmp_path / "loose" / "history.nc")
    assert run.criteria == Criteria(hinge=0.38)
    assert run.ended is Ending.EVENT
    assert run.mechanism.time == run.time[-1]
    assert (
        f"by count: local mechanism of arch at {run.mechanism.time:.3f}" in capsys.readouterr().out
    )
    assert Case.read(tmp_path / "loose" / "case.toml").criteria == run.criteria
    assert Case.read(RING).criteria == Criteria()


def test_run_of_a_ring_that_falls(tmp_path, capsys):
    given = ["--set", "structure.thickness=0.15", "--set", "model.fidelity=rigid"]
    assert main(["run", str(RING), "--out", str(tmp_path), *given]) == 1
    assert "no equilibrium" in capsys.readouterr().err


def test_mesh_command(tmp_path):
    path = tmp_path / "ring.msh"
    assert main(["mesh", str(RING), "--out", str(path), "--set", "model.cells=[2, 2]"]) == 0
    assert np.any(["voussoir 3" in line for line in path.read_text().splitlines()])


BASE = """
[structure]
shape = "circular_arch"
radius = 2.95
thickness = "0.55 m"
embrace = 159.0
voussoirs = 17

[analysis]
damping = { ratio = 0.05, frequencies = ["8 Hz", "16 Hz"] }
"""


def test_a_case_says_only_what_differs_from_its_base(tmp_path):
    (tmp_path / "ring.toml").write_text(BASE)
    (tmp_path / "by_span.toml").write_text(
        'base = "ring.toml"\nwithout = ["structure.radius", "structure.embrace"]\n'
        "[structure]\nspan = 4.0\nrise = 1.5\n[analysis.damping]\nratio = 0.02\n"
    )
    case = Case.read(tmp_path / "by_span.toml", ["structure.voussoirs=9"])
    settings = tomllib.loads(case.text())
    assert settings["structure"] == {
        "shape": "circular_arch",
        "thickness": "0.55 m",
        "voussoirs": 9,
        "span": 4.0,
        "rise": 1.5,
    }
    assert case.damping.ratio == 0.02
    assert case.damping.frequencies == (8.0, 16.0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('base = "nothing.toml"', "there is no case file"),
        ('base = "case.toml"', "is its own base"),
        ("base = 3", "not the name of a file"),
        ('base = "ring.toml"\nwithout = ["structure.rise"]', "the base has no such key"),
        ('base = "ring.toml"\n[structure]\nradios = 3.0', "did you mean 'radius'"),
    ],
)
def test_bases_that_cannot_be_meant(text, says, tmp_path):
    (tmp_path / "ring.toml").write_text(BASE)
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(InvalidInput, match=says):
        Case.read(tmp_path / "case.toml")


BRIDGES = [
    path
    for path in sorted(RING.parent.glob("prusias*.toml"))
    if path.stem not in ("prusias_retrofit", "prusias_sensitivity")  # studies of them
]


@pytest.mark.parametrize("path", BRIDGES, ids=lambda p: p.stem)
def test_shipped_bridges(path):
    structure = Case.read(path).structure
    parts = {block.part for block in structure.blocks}
    assert {"north arch", "main arch", "south arch", "north pier", "south pier"} <= parts
    assert ("paving" in parts) == (path.stem in ("prusias_paving", "prusias_restored"))
    assert structure.joints[structure.joint_number("main arch, joint 5")].part == "main arch"


def test_a_table_of_parts_says_what_holds_for_all_of_them():
    case = Case.read(
        RING.with_name("prusias.toml"),
        ["structure.piers.height=2.8", "structure.piers.south pier.height=2.4"],
    )
    lowest = {
        part: min(
            y for block in case.structure.blocks if block.part == part for _, y in block.outline
        )
        for part in ("north pier", "south pier")
    }
    assert lowest["north pier"] - lowest["south pier"] == pytest.approx(-0.4)
