"""Commands animate, doctor and examples."""

import json
import sys
from importlib import metadata

import imageio.v2 as imageio
import numpy as np
import pytest
from backfilled import arch_bridge
from drawn import draw_portal

import archfem as af
from archfem import _optional
from archfem.commands import tools


def test_installed_libraries_have_their_version():
    found = {each.item: each.state for each in tools.diagnose_installation()}
    assert found["numpy"] == metadata.version("numpy")
    assert found["archfem"].startswith(metadata.version("archfem"))
    assert "compiled code" in found


def test_a_sound_installation_ends_with_zero(monkeypatch, capsys):
    monkeypatch.setattr(tools, "diagnose_installation", lambda: [tools.Diagnosis("archfem", "1.0")])
    assert af.commands.main(["doctor"]) == 0
    assert capsys.readouterr().out.split() == ["archfem", "1.0", "all", "is", "well"]


def test_missing_libraries_are_reported_with_their_remedy(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "archfem.models.fem", None)
    monkeypatch.setattr(_optional, "OFFSCREEN_LIBRARIES", ("libNone.so",))
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(metadata, "requires", lambda name: ["numpy>=99.1", "nonesuch>=1", "a; b"])
    assert af.commands.main(["doctor"]) == 1
    captured = capsys.readouterr()
    for remedy in ("apt-get install python3-dolfinx", "apt-get install libegl1", "numpy>=99.1"):
        assert remedy in captured.out
    assert "nonesuch" in captured.err
    # one that is there and does not load is a fault
    assert "FEniCSx" in captured.err


def test_an_installation_without_fenicsx_is_sound_and_names_what_works(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "archfem.models.fem", None)
    found = tools.find_spec
    monkeypatch.setattr(tools, "find_spec", lambda name: None if name == "dolfinx" else found(name))
    (fenicsx,) = tools._diagnose_fenicsx()
    assert fenicsx.remedy == ""
    assert "falls of rigid stones work" in fenicsx.state
    assert "apt-get install python3-dolfinx" in fenicsx.state


def test_examples_are_listed_and_printed(tmp_path, capsys):
    assert af.commands.main(["examples"]) == 0
    assert "ring_falls" in capsys.readouterr().out
    assert af.commands.main(["example", "ring_falls"]) == 0
    captured = capsys.readouterr()
    assert 'ring.toml"\ntitle = "A ring that falls' in captured.out
    assert "it refers to ring.toml" in captured.err
    assert af.commands.main(["example", "ring", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "ring.toml").is_file()


CASE = """
title = "A $5 column"
[structure]
shape = "column"
breadth = "0.4 m"
heights = ["0.8 m", "0.8 m"]
[model]
fidelity = "rigid"
"""


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A folder with the history of a short run of a column, and its case."""
    folder = tmp_path_factory.mktemp("column")
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    case = af.Case.read(folder / "case.toml")
    motion = af.Motion(2.0 * np.sin(np.linspace(0.0, 6.0, 41)), 0.005, name="swing")
    model = af.build(case.structure, fidelity="rigid")
    run = af.time_history(model, motion, dt=0.005, record=af.Record(fields_every=10))
    run.save(folder / "pair" / "history.nc")
    return folder


@pytest.mark.slow
def test_a_history_is_filmed_beside_its_case(kept, capsys):
    film = kept / "film.gif"
    given = ["--out", str(film), "--size", "480x320", "--window", "0.1,0.15", "--fps", "10"]
    assert af.commands.main(["animate", str(kept / "pair"), *given]) == 0  # the folder of one
    assert str(film) in capsys.readouterr().out
    frames = imageio.mimread(film)
    assert frames[0].shape[:2] == (320, 480)
    assert len(frames) >= 2


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["pair/history.nc", "--window", "soon"], "--window soon: give 'auto', or two times"),
        (["pair/history.nc", "--size", "big"], "--size big: give width and height"),
        (["none.nc"], "there is no history file"),
        (["."], "there is no history file"),
    ],
)
def test_invalid_input_is_reported(kept, capsys, given, said):
    assert af.commands.main(["animate", str(kept / given[0]), *given[1:]]) == 1
    assert said in capsys.readouterr().err


def test_a_history_without_a_case_is_refused_with_the_option_that_gives_one(kept, tmp_path, capsys):
    alone = tmp_path / "a" / "b" / "history.nc"
    alone.parent.mkdir(parents=True)
    alone.write_bytes((kept / "pair" / "history.nc").read_bytes())
    assert af.commands.main(["animate", str(alone)]) == 1
    assert "--case CASE.toml" in capsys.readouterr().err
    # the drawing of a case lies beside the case that was run, not beside its results
    drawn = '[structure]\nshape = "outlines"\nfile = "drawing.dxf"\n'
    (alone.parent / "case.toml").write_text(drawn)
    assert af.commands.main(["animate", str(alone)]) == 1
    assert "or give that case, --case CASE.toml" in capsys.readouterr().err


def test_a_case_gives_its_title_to_its_structure(kept):
    assert af.Case.read(kept / "case.toml").structure.name == "A $5 column"
    untitled = CASE.replace('title = "A $5 column"', "")
    (kept / "untitled.toml").write_text(untitled, encoding="utf-8")
    assert af.Case.read(kept / "untitled.toml").structure.name == "column"


def test_damaged_code_is_reported(monkeypatch, tmp_path):
    monkeypatch.setattr(tools._numba, "count_cached_functions", lambda: 1)
    monkeypatch.setattr(tools._numba, "cache_folders", lambda: [tmp_path])
    (tmp_path / "a.nbi").write_bytes(b"cut off")
    diagnosis = tools._diagnose_compiled_code()
    assert "1 damaged files" in diagnosis.state
    assert "archfem compile" in diagnosis.remedy


@pytest.mark.slow
def test_the_least_thickness_of_a_ring_is_printed(tmp_path, capsys):
    path = tmp_path / "arch.toml"
    shape = '[structure]\nshape = "circular_arch"\nradius = 1.0\nthickness = 0.2\n'
    path.write_text(f"{shape}embrace = 180.0\nvoussoirs = 66\n")
    assert af.commands.main(["thickness", str(path)]) == 0
    said = capsys.readouterr().out
    assert "least thickness at rest: 107 mm of 200 mm" in said  # Milankovitch: 0.1075 R
    assert "geometric factor of safety of the ring, without crushing: 1.86, with the weight" in said
    assert " thinner stones (1.86 of less deep joints under the same weight); joints do" in said
    assert said.count("geometric factor") == 1  # that of all joints is of the same stones
    assert af.commands.main(["thickness", str(path), "--part", "dome"]) == 1
    assert "'dome' is no ring" in capsys.readouterr().err


HORSESHOE = """[structure]
shape = "circular_arch"
radius = 1.0
thickness = 0.24
embrace = 200.0
voussoirs = 15
[model]
fidelity = "rigid"
"""


@pytest.mark.slow
@pytest.mark.parametrize("friction", [None, 0.45])
def test_the_friction_from_which_it_stands_is_said(friction, tmp_path, capsys):
    """By checks, thicknesses and reports, with a note where the case leaves it open."""
    given = "" if friction is None else f'[contacts."stone to stone"]\nfriction = {friction}\n'
    (path := tmp_path / "arch.toml").write_text(HORSESHOE + given)
    out = tmp_path / "out"
    for command in (["check"], ["thickness", "--out", str(out)]):
        assert af.commands.main([command[0], str(path), *command[1:]]) in (0, 3)
        said = capsys.readouterr().out
        assert "it stands from a coefficient of friction of 0.441\n" in said
        note = "note: friction decides whether it stands: dry stone has 0.4 to 0.8"
        assert (note in said) == (friction is None)
    moving = "hinge (joints 0, 3, 7, 12 and 15)" if friction is None else "slide (joints 0 and 15)"
    assert f"if thinner, joints {moving}; without sliding 159 mm are enough" in said
    assert af.commands.main(["report", str(out)]) == 0
    page = (out / "report.html").read_text()
    for words in (
        ">least thickness<",
        "stands from a coefficient of friction of 0.441",
        "without sliding 159 mm",
        "fixed to it: &#39;left abutment&#39;, &#39;right abutment&#39;<",
        *["Friction decides"][: friction is None],
    ):
        assert words in page


@pytest.mark.slow
def test_a_thickness_of_an_arch_on_piers_is_said_to_be_of_the_ring_alone(tmp_path):
    """Beside it is the least depth of all joints, of which the factor is another one."""
    shape = 'shape = "arch_on_piers"\nradius = 2.0\nthickness = 0.5\nvoussoirs = 9\n'
    path = tmp_path / "arch.toml"
    path.write_text(f"[structure]\n{shape}pier_breadth = 0.6\ncourses = [0.5]\n")
    assert af.commands.main(["thickness", str(path), "--out", str(tmp_path)]) in (0, 3)
    ring, every = json.loads((tmp_path / "thickness.json").read_text())["rows"]
    assert "of 500 mm, of the ring alone with the weight of thinner stones" in ring[2]
    assert every[0] == "least depth of all joints"
    assert 1.0 / float(every[2].split()[0]) == pytest.approx(
        float(every[3]), rel=5e-3
    )  # of 3 digits
    assert 1.0 < float(every[3]) < 0.8 * float(ring[3])
    text = (tmp_path / "thickness.txt").read_text()
    assert (
        f"geometric factor of safety at rest, without crushing: {float(every[3]):.3g}, as" in text
    )


def test_a_bridge_with_fill_has_the_least_depth_of_all_joints(tmp_path, capsys):
    """Beside that without and with all pressure; the bare ring is said to be another structure."""
    bridge, path = arch_bridge(thickness=0.3, voussoirs=9), tmp_path / "bridge.toml"
    af.Analysis(bridge, fidelity="rigid").write(path)
    assert af.commands.main(["thickness", str(path)]) == 1
    assert "or give the strength of a fill in [limit]" in capsys.readouterr().err
    strength = ["--set", 'limit.fill={ friction_angle = "35 degree" }']
    out = tmp_path / "out"
    assert af.commands.main(["thickness", str(path), *strength, "--out", str(out)]) == 0
    fills = [
        af.limit.Fill(friction_angle=35.0, **given)
        for given in (
            {},
            {"mobilisation": 0.0, "active": 0.0},
            {"mobilisation": 1.0},
            {"mobilisation": 0.0},
        )
    ]
    own, none, full, active = (af.limit.geometric_factor(bridge, fill=fill) for fill in fills)
    words = "geometric factor of safety at rest with the fill, without crushing: "
    words += f"{own:.3g}, as it stands with all"
    said = capsys.readouterr().out
    assert words in said
    assert f"; {none:.3g} without its pressure, {full:.3g} with all of its passive pressure" in said
    assert f" pressure, {active:.3g} with its active pressure alone" in said
    assert "of a ring without fill, which is another structure" in said
    (row,) = json.loads((out / "thickness.json").read_text())["rows"]
    assert row[0] == "least depth of all joints with the fill"
    ends = min(own, none, full, active), max(own, none, full, active)
    assert [float(x) for x in row[3].split(" to ")] == pytest.approx(ends, rel=5e-3)  # 3 digits
    push = [*strength, "--set", "limit.horizontal=1.0"]
    assert af.commands.main(["limit", str(path), *push]) in (0, 3)
    assert words in capsys.readouterr().out
    assert af.commands.main(["thickness", str(path), *strength, "--part", "arch"]) == 1


@pytest.mark.parametrize(
    ("moved", "code"), [("WEST 1", 1), pytest.param("WEST 3", 3, marks=pytest.mark.slow)]
)
def test_a_thickness_names_a_stone_on_a_wrong_layer(moved, code, tmp_path, capsys):
    """A course that prolongs the ring is in doubt, and one apart from it is an error."""
    path = draw_portal(tmp_path, {moved: "RING"})
    assert af.commands.main(["thickness", str(path)]) == code
    said = "".join(capsys.readouterr())
    assert "'RING 1' at (-1.600, " in said
    assert "may be one of 'west pier'" in said
    assert ("least thickness" in said) == (code == 3)


_TWO_STRENGTHS = "note: joints crush at 12 MPa of [limit], and stones of [materials] at 60 MPa"


def test_a_strength_in_another_unit_is_refused_by_a_check(tmp_path, capsys):
    """As by a rating, though the case has no load of a limit analysis."""
    path = tmp_path / "ring.toml"
    ring = "shape = 'circular_arch'\nradius = 3.0\nthickness = 0.5\nembrace = '150 degree'"
    path.write_text(
        f"[structure]\n{ring}\nvoussoirs = 9\n[model]\nfidelity = 'rigid'\n[limit]\nstrength = 12\n"
    )
    assert af.commands.main(["check", str(path)]) == 1
    assert "strength [Pa], of which 5 MPa are 5e6, = 12.0 is below" in capsys.readouterr().err
    command = ["check", str(path), "--set", "limit.strength=12 MPa"]
    stones = "--set", 'materials.stone.strength="60 {}"'
    for given, code, words in (
        ([], (0, 3), ""),
        ([stones[0], stones[1].format("GPa")], (1,), "= 60000000000.0 is above 5e+08"),
        (["--set", "limit.strength=12 GPa"], (1,), "= 12000000000.0 is above 5e+08"),
        ([stones[0], stones[1].format("MPa")], (0, 3), _TWO_STRENGTHS),
    ):
        assert af.commands.main([*command, *given]) in code
        said = capsys.readouterr()
        assert words in said.out + said.err
        assert (_TWO_STRENGTHS in said.out) == (words == _TWO_STRENGTHS)


def test_a_check_doubts_a_record_that_drifts(tmp_path, capsys):
    """With the correction that it advises the case is ready."""
    times = np.arange(1001) * 0.01
    rows = np.column_stack([times, np.sin(2.0 * np.pi * times) + 0.2])
    np.savetxt(tmp_path / "drifts.csv", rows, delimiter=",", header="Time (s),Acc (m/s2)")
    (tmp_path / "case.toml").write_text(
        '[structure]\nshape = "column"\nbreadth = 0.6\nheights = [1.2]\n'
        '[contacts."stone to stone"]\nnormal_stiffness = "10 MPa/mm"\n'
        'shear_stiffness = "4 MPa/mm"\n[model]\nfidelity = "rigid"\n'
        '[motion]\nfile = "drifts.csv"\n'
    )
    command = ["check", str(tmp_path / "case.toml")]
    assert af.commands.main(command) == 3  # doubtful
    said = capsys.readouterr().out
    assert "in doubt: the horizontal motion drifts: it ends with a velocity as of 17% of" in said
    assert af.commands.main([*command, "--set", "motion.baseline_corrected=true"]) == 0
