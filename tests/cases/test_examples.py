"""Example cases: titles, text and copies."""

import pytest

import archfem as af
from archfem.cases.examples import copy_example, list_example_titles, list_examples, read_example


def test_each_has_a_title():
    titles = list_example_titles()
    assert (
        titles.keys()
        == list_examples().keys()
        >= {"ring", "ring_falls", "ring_paper", "prusias", "survey"}
    )
    assert all(titles.values())


@pytest.mark.parametrize("name", ["ring", "ring_falls", "ring_paper", "survey", "prusias_restored"])
def test_a_case_that_is_printed_can_be_run_from_anywhere(name, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(read_example(name)[0], encoding="utf-8")
    assert af.Case.read(path).structure.joints
    assert af.Case.read(path).title == list_example_titles()[name]


def test_a_copy_takes_along_what_it_refers_to(tmp_path):
    copies = copy_example("prusias_retrofit.toml", tmp_path / "new")
    names = {copy.name for copy in copies}
    assert names >= {"prusias_retrofit.toml", "prusias.toml", "prusias_wall.toml"}
    assert names == {path.name for path in (tmp_path / "new").iterdir()}
    assert copies[0].read_text() == list_examples()["prusias_retrofit"].read_text()
    with pytest.raises(af.InvalidInput, match="there already"):
        copy_example("prusias", tmp_path / "new")


def test_a_name_that_is_none():
    with pytest.raises(af.InvalidInput, match=r"no case 'rign', but these: .*ring"):
        read_example("rign")
