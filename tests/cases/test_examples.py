"""Example cases: titles, text and copies."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.cases.defaults import list_defaults
from archfem.cases.examples import (
    copy_example,
    list_example_titles,
    list_examples,
    list_new_cases,
    read_example,
)
from archfem.masonry.structure import find_clear_spans


def test_each_has_a_title():
    titles = list_example_titles()
    assert (
        titles.keys()
        == list_examples().keys()
        >= {"ring", "ring_falls", "ring_fenicsx", "ring_paper", "prusias", "survey"}
    )
    assert all(titles.values())


@pytest.mark.parametrize(
    "name",
    [
        "ring",
        "ring_falls",
        "ring_paper",
        "survey",
        pytest.param("prusias_restored", marks=pytest.mark.slow),
    ],
)
def test_a_case_that_is_printed_can_be_run_from_anywhere(name, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(read_example(name)[0], encoding="utf-8")
    assert af.Case.read(path).structure.joints
    assert af.Case.read(path).title == list_example_titles()[name]


def test_a_copy_includes_the_files_it_refers_to(tmp_path):
    copies = copy_example("prusias_retrofit.toml", tmp_path / "new")
    names = {copy.name for copy in copies}
    assert names >= {"prusias_retrofit.toml", "prusias.toml", "prusias_wall.toml"}
    assert names == {path.name for path in (tmp_path / "new").iterdir()}
    assert copies[0].read_text() == list_examples()["prusias_retrofit"].read_text()
    with pytest.raises(af.InvalidInput, match="there already"):
        copy_example("prusias", tmp_path / "new")


def test_an_unknown_example_is_refused():
    with pytest.raises(af.InvalidInput, match=r"no case 'rign', but these: .*ring"):
        read_example("rign")


@pytest.mark.parametrize("kind", ["ring", "bridge", "wall", "portal"])
def test_a_new_case_gives_all_that_decides_and_runs(kind, tmp_path, capsys):
    path = tmp_path / "mine.toml"
    assert af.commands.main(["new", kind, "--out", str(path)]) == 0
    assert path.read_text().startswith("#:schema file:///")
    case = af.Case.read(path)
    assert list_defaults(case) == []
    assert case.report["project"]
    if kind != "bridge":  # which takes half a minute
        verdict = case.analysis.run(case.ground_motion().cut(2.0, 2.5)).verdict
        assert (verdict.outcome.split(",")[0], verdict.doubts) == ("stands", ())
    capsys.readouterr()
    assert af.commands.main(["new", kind, "--out", str(path)]) == 1
    assert "is there already: name another file with --out" in capsys.readouterr().err


def test_the_new_cases_are_those_of_the_command():
    assert list_new_cases().keys() == {"ring", "bridge", "wall", "portal"}


def test_a_portal_falls_when_its_posts_overturn():
    case = af.Case.read(list_new_cases()["portal"])
    # 0.5 m of each post bear the lintel
    assert find_clear_spans(case.structure)["lintel"] == pytest.approx((0.5, 2.5))
    assert case.limit.strength == pytest.approx(20e6)
    # posts of 0.5 m by 2 m turn about their toes, and the lintel translates: b / h
    assert replace(case.limit, strength=np.inf).solve(case.structure).factor == pytest.approx(
        0.25, rel=1e-6
    )


def test_the_shipped_ring_stands_without_doubt_and_slides():
    case = af.Case.read(list_examples()["ring"])
    dead = af.cases.dead_load_of_case(case)
    damping, _ = af.cases.damping_of(case, dead)
    run = af.cases.run_time_history(case, case.ground_motion(), dead, damping)
    assert (run.verdict.outcome, run.verdict.doubts) == ("stands", ())
    assert 0.1 < run.verdict.displacement < 0.15
    assert float(abs(run.joints["slip"]).max()) > 0.01
    assert isinstance(damping, af.StiffnessDamping)


def test_the_ring_of_the_paper_has_its_geometry_and_rayleigh_damping():
    case = af.Case.read(list_examples()["ring_paper"])
    ring = af.Case.read(list_examples()["ring"]).structure
    assert (case.structure.blocks, case.structure.joints) == (ring.blocks, ring.joints)
    assert case.analysis.damping == af.Rayleigh(0.05, (8.0, 16.0))
    assert (case.analysis.fidelity, case.analysis.discretisation.displacements) == ("full", "small")


@pytest.mark.slow
def test_the_ring_by_fenicsx_alone_has_the_history_of_the_compiled_path():
    case = af.Case.read(list_examples()["ring_fenicsx"], ["model.cells=[2, 2]"])
    slow, motion = case.analysis, case.ground_motion().cut(2.0, 2.3)
    assert (slow.fidelity, slow.method, slow.scheme) == (
        *("monolithic", "snes"),
        af.dynamics.Newmark(),
    )
    assert slow.newton.petsc["pc_factor_mat_ordering_type"] == "rcm"
    runs = [each.run(motion) for each in (slow, replace(slow, fidelity="full", method="auto"))]
    assert runs[0].joints["opening"].max() > 1e-4  # joints open on the way
    for key in "NVM":
        found, known = (run.joints[key].values for run in runs)
        assert abs(found - known).max() < 1e-8 * abs(known).max()  # tolerances of the solves
