"""Video files."""

from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem._files import atomic_write
from archfem._optional import require_package
from archfem.errors import InvalidInput

with require_package("imageio"):
    import imageio.v2 as imageio

Image = NDArray[np.uint8]


def write_film(path: Path, images: Iterable[Image], fps: float) -> Path:
    """Write a film atomically: an interrupted one does not replace an older file."""
    is_gif = path.suffix == ".gif"
    options: dict[str, Any] = {
        "fps": fps,
        "codec": "libx264",
        "quality": None,
        "macro_block_size": 2,
        # for flat colours and thin lines: files as small as by slower presets in half the time
        "output_params": [
            *("-preset", "veryfast", "-crf", "13", "-x264-params", "subme=1:weightp=0"),
            # images keep their size: the filter affects the averages of two colours only
            *("-sws_flags", "fast_bilinear"),
        ],
    }
    if is_gif:  # repeats for ever
        options = {"duration": 1000.0 / fps, "loop": 0}
    with (
        atomic_write(path) as draft,
        closing(imageio.get_writer(draft, mode="I", **options)) as film,
    ):
        for image in images:
            film.append_data(image[..., :3] if is_gif else image)
    return path


def film_path(path: str | Path) -> Path:
    """Return the path of a film after a check of its suffix."""
    suffixes = (".mp4", ".gif")
    if Path(path).suffix not in suffixes:
        raise InvalidInput(f"{path} has suffix '{Path(path).suffix}': use one of {suffixes}")
    return Path(path)
