"""A pen draws at the given place and in the given size."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import RendererAgg

from archfem.view.films.renderer import Canvas

SEEN = np.array([-2.0, -1.0]), np.array([2.0, 1.0])


@pytest.fixture
def sheet():
    """Pixels, and a pen to whose window of 400 by 300 a metre is 100 pixels."""
    renderer = RendererAgg(500, 400, 100.0)
    renderer.clear()
    return renderer, Canvas(renderer, (50, 50, 450, 350), *SEEN)


def ink(renderer):
    """Opacity of the pixels, from the lowest row up."""
    return np.asarray(renderer.buffer_rgba())[::-1, :, 3] / 255.0


def test_areas_and_places_are_true_to_scale(sheet):
    renderer, pen = sheet
    turn = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    pen.fill(0.5 * np.stack([np.cos(turn), np.sin(turn)], axis=1)[None] + [1.0, 0.5], "red")
    found = ink(renderer)
    assert found.sum() == pytest.approx(np.pi * 50.0**2, rel=0.01)
    rows, columns = np.indices(found.shape)
    assert (columns * found).sum() / found.sum() == pytest.approx(250.0 + 100.0, abs=0.6)
    assert (rows * found).sum() / found.sum() == pytest.approx(200.0 + 50.0, abs=0.6)


def test_nothing_is_drawn_outside_the_window(sheet):
    renderer, pen = sheet
    pen.lines(np.array([[[-9.0, 0.0], [9.0, 0.0]]]), "black", 10.0)
    pen.shade(np.array([[[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]]]), np.ones((1, 3, 4)))
    found = ink(renderer)
    assert found[50:350, 50:450].sum() > 1000.0
    found[50:350, 50:450] = 0.0
    assert found.sum() == 0.0
