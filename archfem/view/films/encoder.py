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
    options: dict[str, Any] = {"mode": "I", "duration": 1000.0 / fps, "loop": 0}  # for ever
    if not is_gif:
        # for flat colours and thin lines: files as small as by slower presets in half the time
        encoding = ["-preset", "veryfast", "-crf", "13", "-x264-params", "subme=1:weightp=0"]
        # images keep their size: the filter affects the averages of two colours only
        encoding += ["-sws_flags", "fast_bilinear"]
        options = {"mode": "I", "fps": fps, "codec": "libx264", "quality": None}
        options |= {"macro_block_size": 2, "output_params": encoding}
    with atomic_write(path) as draft, closing(imageio.get_writer(draft, **options)) as film:
        for image in images:
            film.append_data(image[..., :3] if is_gif else image)
    return path


def film_path(path: str | Path) -> Path:
    """Return the path of a film after a check of its suffix."""
    suffixes = (".mp4", ".gif")
    if Path(path).suffix not in suffixes:
        raise InvalidInput(f"{path} has suffix '{Path(path).suffix}': use one of {suffixes}")
    return Path(path)
