"""pyvista's viewer of a run: blocks are where the history has them, at any time."""

import base64
import json
import re
from io import BytesIO
from zipfile import ZipFile

import numpy as np
import pytest
from chromium import browser, complaints
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


@pytest.mark.slow
def test_pyvista_draws_the_films_of_matplotlib(shaken, tmp_path):
    model, run = shaken
    films = {
        name: read_film(
            af.view.film(
                model, run, tmp_path / f"{name}.gif", renderer=name, fps=5, size=(640, 480)
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


@pytest.mark.slow
def test_pyvista_writes_a_page_without_links(shaken, tmp_path):
    pytest.importorskip("trame", reason="the extra for notebooks is not installed")
    model, run = shaken
    path = af.view.film(model, run, tmp_path / "run.html", renderer="pyvista")
    page = path.read_text("utf-8")
    assert f"<title>{run.dataset.attrs['title']}: {run.verdict.outcome}</title>" in page
    assert re.search(r"<(script|link)[^>]*(src|href)=", page) is None
    assert "vtk-js/icon" not in page  # which its script would download


def colour_ranges(page):
    """The ranges of the colours of all meshes in the scene of a page."""
    packed = re.search(r'const base64Str = "([^"]+)"', page)[1]
    with ZipFile(BytesIO(base64.b64decode(packed))) as files:
        text = files.read("index.json").decode()
    found = re.findall(r'"scalarRange": (\[[^]]*\])', text)
    return {tuple(json.loads(each)) for each in found}


@pytest.mark.slow
def test_a_page_has_its_instants_in_one_scene_with_one_scale(shaken, tmp_path):
    pytest.importorskip("trame", reason="the extra for notebooks is not installed")
    model, run = shaken
    page = af.view.film(model, run, tmp_path / "run.html", renderer="pyvista").read_text("utf-8")
    known = json.loads(re.search(r"const known = (.*);", page)[1])
    times = run.dataset["frame_time"].values
    assert len(known["counts"]) == len(known["times"]) <= len(times)
    assert [known["times"][0], known["times"][-1]] == pytest.approx([times[0], times[-1]])
    # blocks, edges and the thrust line with its halo and joints, at least
    assert min(known["counts"]) >= 5
    largest = 1e3 * np.hypot(*model.cells.displacement(run.dataset["q"].values[-1]).T).max()
    low, high = max(colour_ranges(page))
    assert colour_ranges(page) <= {(0.0, 1.0), (low, high)}
    assert low == 0.0
    assert high >= 0.99 * largest


@pytest.mark.slow
@pytest.mark.parametrize("wide", [390, 1280])
def test_the_slider_of_a_page_shows_one_instant(shaken, tmp_path, wide):
    pytest.importorskip("trame", reason="the extra for notebooks is not installed")
    model, run = shaken
    path = af.view.film(model, run, tmp_path / "run.html", renderer="pyvista")
    known = json.loads(re.search(r"const known = (.*);", path.read_text("utf-8"))[1])
    shown = (
        "return [document.querySelector('#instants input').value, global.renderWindow"
        ".getRenderers().flatMap(each => each.getViewProps())"
        ".filter(prop => prop.getClassName() === 'vtkActor' && prop.getVisibility()).length]"
    )
    with browser(wide, 700) as driver:
        from selenium.webdriver.support.ui import WebDriverWait

        driver.get(path.resolve().as_uri())
        find = "return document.querySelector('#instants input')"
        slider = WebDriverWait(driver, 30).until(lambda d: d.execute_script(find))
        for key, number in (("\ue011", 0), ("\ue014", 1), ("\ue010", len(known["times"]) - 1)):
            slider.send_keys(key)  # home, right, end
            visible = known["static"] + known["counts"][number]
            assert driver.execute_script(shown) == [str(number), visible]
        width = "return [document.documentElement.scrollWidth, innerWidth]"
        scrolled, inner = driver.execute_script(width)
        assert scrolled <= inner
        # the region fills the height or the width of the window
        camera = (
            "return [global.renderWindow.getRenderers().map(each => each.getActiveCamera()"
            ".getPosition()[2] / known.distance), "
            "Math.max(1, known.aspect * innerHeight / innerWidth)]"
        )
        farther, needed = driver.execute_script(camera)
        assert min(abs(each - needed) for each in farther) < 1e-6 * needed
        assert (needed > 1.0) is (wide == 390)
        said = [each["message"] for each in complaints(driver)]
    # of a machine without graphics
    assert not [text for text in said if "WebGL" not in text]


@pytest.mark.parametrize(("renderer", "suffix"), [("vtk", ".mp4"), ("matplotlib", ".html")])
def test_formats_that_a_renderer_does_not_write_are_refused(shaken, tmp_path, renderer, suffix):
    model, run = shaken
    with pytest.raises(af.InvalidInput, match="use"):
        af.view.film(model, run, tmp_path / f"film{suffix}", renderer=renderer)
