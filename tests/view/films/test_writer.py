"""Films are written in one stroke."""

from time import sleep

import numpy as np
import pytest
from PIL import Image
from repeats import each_once

import archfem as af
from archfem.view.films.encoder import film_path, write_film


def cut_short(count):
    """Some pictures, then Ctrl-C."""
    yield from np.zeros((count, 320, 480, 3), dtype=np.uint8)
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("count", "suffix"),
    [
        *each_once((0, 1), (".mp4", ".gif")),
        *(pytest.param(5, suffix, marks=pytest.mark.slow) for suffix in (".mp4", ".gif")),
    ],
)
def test_a_killed_film_leaves_the_old_one(tmp_path, count, suffix):
    """Also once the encoder has ended, which may begin its file late."""
    path = tmp_path / f"film{suffix}"
    path.write_bytes(b"old")
    with pytest.raises(KeyboardInterrupt):
        write_film(path, cut_short(count), fps=10.0)
    sleep(0.2 if count else 0.0)  # no encoder begins without a frame
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == b"old"


def test_a_film_has_one_of_two_suffixes(tmp_path):
    for name in ("film.mp4", "film.gif"):
        assert film_path(tmp_path / name) == tmp_path / name
    with pytest.raises(af.InvalidInput, match=r"suffix '\.avi': use one of \('\.mp4', '\.gif'\)"):
        film_path(tmp_path / "film.avi")


def test_a_gif_lasts_as_long_as_its_frames_and_repeats_for_ever(tmp_path):
    images = np.zeros((3, 32, 48, 3), dtype=np.uint8)
    images[1, :16], images[2, 16:] = 255, 255
    with Image.open(write_film(tmp_path / "film.gif", images, fps=5.0)) as read:
        assert read.n_frames == 3
        assert read.info["duration"] == 200.0
        assert read.info["loop"] == 0
