"""The command that films a history."""

import imageio.v2 as imageio
import numpy as np
import pytest

import archfem as af

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


def test_a_history_is_filmed_beside_its_case(kept, capsys):
    film = kept / "film.gif"
    given = ["--out", str(film), "--size", "480x320", "--window", "0.1,0.15", "--fps", "10"]
    assert af.commands.main(["animate", str(kept / "pair" / "history.nc"), *given]) == 0
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
    ],
)
def test_what_cannot_be_meant_is_told(kept, capsys, given, said):
    assert af.commands.main(["animate", str(kept / given[0]), *given[1:]]) == 1
    assert said in capsys.readouterr().err


def test_a_history_without_a_case_says_how_to_give_one(kept, tmp_path, capsys):
    alone = tmp_path / "a" / "b" / "history.nc"
    alone.parent.mkdir(parents=True)
    alone.write_bytes((kept / "pair" / "history.nc").read_bytes())
    assert af.commands.main(["animate", str(alone)]) == 1
    assert "--case CASE.toml" in capsys.readouterr().err


def test_a_case_gives_its_title_to_its_structure(kept):
    assert af.Case.read(kept / "case.toml").structure.name == "A $5 column"
    untitled = CASE.replace('title = "A $5 column"', "")
    (kept / "untitled.toml").write_text(untitled, encoding="utf-8")
    assert af.Case.read(kept / "untitled.toml").structure.name == "column"
