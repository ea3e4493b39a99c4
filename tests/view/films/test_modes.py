"""Films of vibration shapes: there and back."""

from types import SimpleNamespace

import imageio.v2 as imageio
import numpy as np
import pytest
from matplotlib.figure import Figure

import archfem as af
from archfem.view import film_modes, films


@pytest.mark.slow
def test_film_of_shapes(tmp_path):
    model = af.build(af.column(breadth=1.0, heights=[1.0, 1.0]), fidelity="rigid")
    path = film_modes(af.modes(model, 2), tmp_path / "film.gif", [1])
    frames = imageio.mimread(path)
    assert len(frames) == 32
    moved = [np.mean(frames[0] != frame) for frame in frames]
    assert moved[8] > 0.005  # at the end of its swing
    assert moved[16] < 0.2 * moved[8]  # back at rest
    with pytest.raises(af.InvalidInput, match=r"film\.avi has suffix"):
        film_modes(af.modes(model, 2), tmp_path / "film.avi")


def test_a_swing_is_a_sine_of_32_frames():
    """Cropped to even numbers of pixels, of which there are a hundred an inch."""
    phases = []
    panel = SimpleNamespace(show_phase=phases.append)
    images = list(films.film._draw_swings(Figure(figsize=(1.01, 0.55)), [panel], 2))
    assert {image.shape for image in images} == {(54, 100, 3)}
    assert phases == pytest.approx(np.sin(np.linspace(0.0, 4.0 * np.pi, 65)[:-1]), abs=1e-12)
    assert len(images) == len(phases)


def test_shapes_are_filmed_at_twenty_frames_a_second(monkeypatch, tmp_path):
    monkeypatch.setattr(films.film, "write_film", lambda path, images, fps: fps)
    monkeypatch.setattr(films.film, "mode_panels", lambda modes, numbers: (None, ()))
    modes = af.modes(af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid"), 1)
    assert film_modes(modes, tmp_path / "film.gif") == 20.0
