"""Video files."""

from collections.abc import Generator, Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
from imageio_ffmpeg import write_frames
from numpy.typing import NDArray

from archfem._files import atomic_write
from archfem.errors import InvalidInput

Image = NDArray[np.uint8]


def write_film(path: Path, images: Iterable[Image], fps: float) -> Path:
    """Write a film atomically: an interrupted one does not replace an older file."""
    write = _write_gif if path.suffix == ".gif" else _write_mp4
    with atomic_write(path) as draft:
        write(draft, images, fps)
    return path


def film_path(path: str | Path) -> Path:
    """Return the path of a film after a check of its suffix."""
    suffixes = (".mp4", ".gif")
    if Path(path).suffix not in suffixes:
        raise InvalidInput(f"{path} has suffix '{Path(path).suffix}': use one of {suffixes}")
    return Path(path)


def _write_gif(path: Path, images: Iterable[Image], fps: float) -> None:
    """Write a film that repeats for ever."""
    with closing(imageio.get_writer(path, mode="I", duration=1000.0 / fps, loop=0)) as film:
        for image in images:
            film.append_data(image[..., :3])


def _write_mp4(path: Path, images: Iterable[Image], fps: float) -> None:
    """Pipe the raw images to an encoder process."""
    film = None
    try:
        for image in images:
            film = film or _start_encoder(path, image.shape, fps)
            film.send(np.ascontiguousarray(image))
    finally:
        if film is not None:
            film.close()


def _start_encoder(path: Path, shape: tuple[int, ...], fps: float) -> Generator[None, Any, None]:
    """Start an encoder for images of a shape."""
    encoder: Generator[None, Any, None] = write_frames(
        str(path),
        (shape[1], shape[0]),
        pix_fmt_in="rgba" if shape[2] == 4 else "rgb24",
        fps=fps,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        # for flat colours and thin lines: files as small as by slower presets in half the time
        output_params=[
            *("-preset", "veryfast", "-crf", "13", "-x264-params", "subme=1:weightp=0"),
            # images keep their size: the filter affects the averages of two colours only
            *("-sws_flags", "fast_bilinear"),
        ],
    )
    encoder.send(None)
    return encoder
