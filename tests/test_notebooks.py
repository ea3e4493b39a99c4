"""Every notebook runs, and arrives at its number."""

import json
import os
import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "notebooks"

EXPECTED = {
    "01_an_arch_stands": {
        "crown": (0.2855, 1e-4),  # converged; 8 cells are within 5e-5
        "checked": (1.0, 1e-3),  # centroids of sectors move by 2e-4
    },
    "02_how_thin_can_it_be": {
        "least": (0.1075, 1e-4),  # Milankovitch (1907), four digits
        "checked": (1.0, 5e-3),  # pushover by limit analysis
    },
    "03_a_roman_bridge": {"carried": (1.0, 1e-9)},  # equilibrium, to the tolerance of its solve
    "04_from_first_hinge_to_the_ground": {"checked": (1.0, 3e-3)},  # HybriDFEM, five springs
    "05_the_papers_system_by_fenicsx_alone": {"checked": (1.0, 1e-8)},  # the compiled path
    "06_how_a_joint_closes": {"checked": (1.0, 1e-2)},  # an explicit code, to half a per cent
}
"""Variables of a notebook, their values, and how far off they may be."""


def test_every_notebook_has_a_number():
    assert {path.stem for path in FOLDER.glob("*.py")} == set(EXPECTED)


def cells_of(notebook):
    """Text and code of a notebook, cell by cell, without the note on how it was shipped."""
    return [
        (cell.cell_type, cell.source)
        for cell in notebook.cells
        if not cell.source.startswith("```{note}")
    ]


@pytest.mark.parametrize("name", EXPECTED)
def test_notebooks_are_shipped_as_their_scripts_ran(name):
    """`make notebooks` brings shipped notebooks up to date; all of it is below 6 MB."""
    jupytext = pytest.importorskip("jupytext")
    script, shipped = (jupytext.read(FOLDER / f"{name}.{end}") for end in ("py", "ipynb"))
    assert cells_of(shipped) == cells_of(script)
    outputs = [output for cell in shipped.cells for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert not any(output.output_type == "error" for output in outputs)
    assert sum(path.stat().st_size for path in FOLDER.glob("*.ipynb")) < 6e6


CLAIMS = {
    "03_a_roman_bridge": [
        *(("3.205 s", "3.205 s, global"), ("15 ms, open by 1.6 mm", "15 ms, opens by 1.6 mm")),
        *(("3.505 s for 15 ms", "3.505 s, global"), ("for 5 ms", "for 5 ms")),
        *(("Hinges open by 5.9 mm", "opens by 5.9 mm"), ("25 mm are left", ": 25.2 mm left")),
        ("19 mm are left", ": 19.5 mm left"),
    ],
    "06_how_a_joint_closes": [
        ("by 0.8 % at most", "by up to 0.8%"),
        ("3.4 % less than dressed", "3.4% less than dressed"),
        ("0.95 of the measured force", "dressed joints at the measured place: 0.95 of"),
        ("0.92, which is outside", "weathered joints at the measured place: 0.92 of"),
        ("4.16 Hz with the paper's joints", "paper: 4.16 Hz, 23%"),
        ("4.74 Hz with dressed", "dressed: 4.74 Hz, 5%"),
        ("4.63 Hz with weathered", "weathered: 4.63 Hz, 8%"),
    ],
}
"""Words of the text, and of the output that they describe."""


@pytest.mark.parametrize(("name", "words"), [(n, each) for n in CLAIMS for each in CLAIMS[n]])
def test_the_text_of_a_notebook_describes_its_output(name, words):
    jupytext = pytest.importorskip("jupytext")
    cells = jupytext.read(FOLDER / f"{name}.ipynb").cells
    text = " ".join(" ".join(each.source for each in cells if each.cell_type == "markdown").split())
    outputs = [output for cell in cells for output in cell.get("outputs", [])]
    printed = "".join(output.get("text", "") for output in outputs)
    assert words[0] in text
    assert words[1] in printed


def test_pictures_on_pages_are_those_of_the_notebooks():
    """`make notebooks` writes both: a picture that differs is of an earlier run."""
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("nbclient")
    execute = runpy.run_path(str(FOLDER.parent / "docs" / "execute.py"))
    for name in execute["PICTURES"]:
        notebook = nbformat.read(FOLDER / f"{name}.ipynb", 4)
        for file, png in execute["pictures"](notebook, name).items():
            assert (FOLDER / "figures" / f"{file}.png").read_bytes() == png, file


def test_other_pictures_on_pages_are_as_new_as_the_code_that_draws_them():
    """`make pictures` draws them."""
    pictures = runpy.run_path(str(FOLDER.parent / "docs" / "pictures.py"))
    known = json.loads(pictures["DIGESTS"].read_text(encoding="utf-8"))
    assert set(known) == set(pictures["SOURCES"])
    for name in known:
        assert known[name] == pictures["digest"](name), name


QUICK = ("thrust_line", "collapse", "programs")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(path.stem, marks=() if path.stem in QUICK else pytest.mark.slow)
        for path in sorted((FOLDER.parent / "docs" / "gallery").glob("*.py"))
    ],
)
def test_a_script_of_the_gallery_draws_its_figure(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    figure = runpy.run_path(str(FOLDER.parent / "docs" / "gallery" / f"{name}.py"))["figure"]
    assert figure.get_axes()
    assert f"gallery/{name}.png" in (FOLDER.parent / "docs" / "gallery.md").read_text("utf-8")
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPECTED)
def test_notebook_arrives_at_its_number(name, monkeypatch, tmp_path):
    """The default tests check results of them as well."""
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.setenv("ARCHFEM_QUICK", "1")
    monkeypatch.chdir(tmp_path)
    found = runpy.run_path(str(FOLDER / f"{name}.py"))
    for variable, (value, tolerance) in EXPECTED[name].items():
        assert found[variable] == pytest.approx(value, abs=tolerance), variable
    assert os.listdir(tmp_path) == []
