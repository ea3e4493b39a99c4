"""pyvista's viewer of a run: blocks are where the history has them, at any time."""

import re

import numpy as np
import pytest
from PIL import Image, ImageSequence

import archfem as af
from archfem._optional import can_draw

pytestmark = pytest.mark.skipif(not can_draw(), reason="no library to draw with")


@pytest.fixture(scope="module")
def shaken():
    model = af.build(af.column(breadth=0.6, heights=[1.2, 1.2]), fidelity="rigid")
    motion = af.Motion.synthetic(seed=1, duration=0.4, pga=4.0)
    return model, af.time_history(model, motion, dt=0.01, record=af.Record(fields_every=4))


def test_the_slider_moves_the_blocks(shaken):
    model, run = shaken
    shown = af.view.viewer(run, model, magnification=3.0)
    blocks = shown._scene.blocks
    for frame in (0, -1):
        shown.at(float(run.dataset["frame_time"][frame]))
        moved = model.cells.displacement(run.dataset["q"].values[frame])
        places = model.cells.places + 3.0 * moved
        assert blocks.points[:, :2].min(axis=0) == pytest.approx(places.min(axis=0), abs=1e-6)
        assert blocks.points[:, :2].max(axis=0) == pytest.approx(places.max(axis=0), abs=1e-6)
        assert np.ptp(blocks.points[:, 2]) == 0.0
        assert blocks["shade"].max() == pytest.approx(1e3 * np.hypot(*moved.T).max(), rel=1e-6)
    shown.plotter.close()


def test_a_run_without_fields_is_refused(shaken):
    model, _ = shaken
    run = af.time_history(model, af.Motion(np.array([0.0, 0.1, 0.0]), 0.01), dt=0.01)
    with pytest.raises(af.InvalidInput, match="no fields"):
        af.view.viewer(run, model)


def test_pyvista_draws_the_films_of_matplotlib(shaken, tmp_path):
    model, run = shaken
    films = {
        name: read_film(
            af.view.film(
                model, run, tmp_path / f"{name}.gif", renderer=name, fps=10, size=(640, 480)
            )
        )
        for name in ("matplotlib", "pyvista")
    }
    # A mean over 8 × 8 pixels is independent of how edges are smoothed. Of the range of a colour,
    # 10 % is far below the contrast of a block with the white beside it, and the frames of a film
    # differ among each other by more.
    ours, theirs = (np.array(images, dtype=float) for images in films.values())
    assert ours.shape == theirs.shape
    ours, theirs = (
        each.reshape(len(each), 60, 8, 80, 8, 3).mean(axis=(2, 4)) for each in (ours, theirs)
    )
    assert np.quantile(abs(ours - theirs), 0.999) < 25.0
    assert np.quantile(abs(ours[0] - theirs[-1]), 0.999) > 25.0


def read_film(path):
    with Image.open(path) as film:
        return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(film)]


def test_pyvista_writes_a_page_without_links(shaken, tmp_path):
    pytest.importorskip("trame", reason="the extra for notebooks is not installed")
    model, run = shaken
    path = af.view.film(model, run, tmp_path / "run.html", renderer="pyvista")
    page = path.read_text("utf-8")
    assert f"<title>{run.dataset.attrs['title']}: {run.verdict.outcome}, t = " in page
    assert re.search(r"<(script|link)[^>]*(src|href)=", page) is None


@pytest.mark.parametrize(("renderer", "suffix"), [("vtk", ".mp4"), ("matplotlib", ".html")])
def test_what_no_renderer_writes_is_refused(shaken, tmp_path, renderer, suffix):
    model, run = shaken
    with pytest.raises(af.InvalidInput, match="use"):
        af.view.film(model, run, tmp_path / f"film{suffix}", renderer=renderer)
