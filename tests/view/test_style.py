"""Pictures are saved whole."""

from dataclasses import replace
from html import escape

import matplotlib
import pytest
from matplotlib.text import Text
from pictures import history

import archfem as af
from archfem.view import save
from archfem.view.style import Page, new_figure, set_title, structure_figure


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".pdf", b"%PDF")])
def test_a_figure_is_saved_whole(ring, low_resolution, tmp_path, suffix, start):
    path = save(af.view.draw_structure(ring), tmp_path / "new" / f"ring{suffix}")
    assert path.read_bytes().startswith(start)
    assert [each.name for each in path.parent.iterdir()] == [path.name]


def test_an_unknown_suffix_is_refused(ring, tmp_path):
    with pytest.raises(af.InvalidInput, match=r"suffix '\.xyz': use one of .*'png'"):
        save(af.view.draw_structure(ring), tmp_path / "ring.xyz")
    assert list(tmp_path.iterdir()) == []


def test_a_title_is_words_and_no_formula(tmp_path):
    figure = structure_figure(af.column(breadth=1.0, heights=[1.0]))
    figure.subplots().set_title("$$ a bridge worth $5 {")
    assert save(figure, tmp_path / "dear.png").stat().st_size > 1000


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("worth $5 or $6", marks=pytest.mark.slow),
        "a $\\frac{ bridge",
        "back\\slash_{x}",
    ],
)
def test_names_are_words_wherever_they_are_drawn(name, tmp_path):
    """Also where matplotlib writes the page itself, as notebooks do."""
    stones = replace(af.column(breadth=1.0, heights=[1.0]), name=name)
    page = af.view.draw_structure(stones)
    page.savefig(tmp_path / "page.svg")
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        page.savefig(tmp_path / "page.svg")
    assert escape(name) in (tmp_path / "page.svg").read_text(encoding="utf-8")


def test_powers_of_ten_at_an_axis_stay_powers(tmp_path):
    page = Page()
    axes = page.subplots()
    axes.set(yscale="log", ylim=(1e-3, 1e3), title="worth $5 or $6")
    page.savefig(tmp_path / "page.png")
    assert {label.get_parse_math() for label in axes.get_yticklabels()} == {True}
    assert not axes.title.get_parse_math()


def test_long_titles_take_several_lines():
    page = structure_figure(af.column(breadth=0.2, heights=[1.0, 1.0]))
    axes = page.subplots()
    set_title(axes, "a column with a title that is by far too long for a page as slim as its own")
    assert axes.get_title().count("\n") >= 1
    page.draw_without_rendering()
    wide = axes.title.get_window_extent().width
    assert wide < page.bbox.width


def test_no_type_is_printed_smaller_than_seven_points(bridge):
    """Figures are at most 170 mm wide, so that a page prints their type as it is."""
    assert new_figure(20.0, 3.0).get_figwidth() == 6.7
    run = af.History(history(bridge, 0.3).dataset, bridge)
    joints = run.joints.isel(time=0)
    for figure in (
        af.view.draw_names(bridge),
        af.view.draw_structure(bridge, joints),
        af.view.draw_envelope({"run": run}),
        af.view.draw_backbones(run, dead=joints),
    ):
        assert figure.get_figwidth() <= 6.7
        texts = [text for text in figure.findobj(Text) if text.get_text()]
        assert min(text.get_fontsize() for text in texts) >= 7.0
