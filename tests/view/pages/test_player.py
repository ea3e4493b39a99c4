"""The player as a page and in a notebook."""

from html import unescape

import pytest
from pages import read_page

import archfem as af


def test_a_player_is_one_page_that_loads_nothing(rocked, tmp_path):
    model, run = rocked
    title = "</script><b>A & B</b>"
    made = af.view.player(run, model, title=title)
    path = made.save(tmp_path / "new" / "player.html")
    read = read_page(path.read_text(encoding="utf-8"))
    (scene,) = read.scenes
    assert scene["title"] == title
    assert title in "".join(read.words)
    assert "http" not in path.read_text().replace("http://www.w3.org/2000/svg", "")


def test_a_notebook_shows_it_in_a_frame(rocked):
    model, run = rocked
    made = af.view.player(run, model)
    frame = made._repr_html_()
    assert frame.startswith('<iframe srcdoc="')
    inside = unescape(frame.removeprefix('<iframe srcdoc="').rpartition('" style=')[0])
    assert inside == made.page


def test_a_player_needs_the_structure_and_the_model(rocked, tmp_path):
    model, run = rocked
    with pytest.raises(af.InvalidInput, match="does not contain its structure"):
        af.view.player(af.History(run.dataset))
    with pytest.raises(af.InvalidInput, match="the blocks follows from its model"):
        af.view.player(run)
    with pytest.raises(af.InvalidInput, match=r"has suffix '.png': a page is .html"):
        af.view.player(run, model).save(tmp_path / "player.png")
