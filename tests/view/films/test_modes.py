"""Films of vibration shapes: there and back."""

import imageio.v2 as imageio
import numpy as np
import pytest

import archfem as af
from archfem.view import film_modes


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
