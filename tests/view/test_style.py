"""Pictures are saved whole."""

import pytest

import archfem as af
from archfem.view.style import canvas, save


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".pdf", b"%PDF")])
def test_a_figure_is_saved_whole(ring, tmp_path, suffix, start):
    path = save(af.view.draw_structure(ring), tmp_path / "new" / f"ring{suffix}")
    assert path.read_bytes().startswith(start)
    assert [each.name for each in path.parent.iterdir()] == [path.name]


def test_an_unknown_suffix_is_refused(ring, tmp_path):
    with pytest.raises(af.InvalidInput, match=r"suffix '\.xyz': use one of .*'png'"):
        save(af.view.draw_structure(ring), tmp_path / "ring.xyz")
    assert list(tmp_path.iterdir()) == []


def test_a_title_is_words_and_no_formula(tmp_path):
    figure = canvas(af.column(breadth=1.0, heights=[1.0]))
    figure.subplots().set_title("$$ a bridge worth $5 {")
    assert save(figure, tmp_path / "dear.png").stat().st_size > 1000
