"""Films, written in one stroke."""

from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
from numpy.typing import NDArray

from archfem.errors import InvalidInput
from archfem.files import in_one_stroke

Image = NDArray[np.uint8]

SUFFIXES = (".mp4", ".gif")


def write_film(path: Path, shots: Iterable[Image], fps: float) -> Path:
    """Write a film; a killed one leaves the old file or none.

    Args:
        path: the film, as checked by `film_path`; folders are made.
        shots: pictures (height, width, 3), of even numbers of pixels.
        fps: pictures a second.

    Returns:
        The film's path.
    """
    with in_one_stroke(path) as draft, closing(_writer(draft, fps)) as film:
        for shot in shots:
            film.append_data(shot)
    return path


def film_path(path: str | Path) -> Path:
    """Return the file, if its suffix is one of a film.

    Args:
        path: as given by a user.

    Raises:
        InvalidInput: it is not.
    """
    if Path(path).suffix not in SUFFIXES:
        raise InvalidInput(f"{path} has suffix '{Path(path).suffix}': use one of {SUFFIXES}")
    return Path(path)


def _writer(path: Path, fps: float) -> Any:
    """Something that frames can be appended to."""
    if path.suffix == ".gif":
        return imageio.get_writer(path, mode="I", duration=1000.0 / fps, loop=0)
    return imageio.get_writer(path, fps=fps, codec="libx264", quality=8, macro_block_size=2)
