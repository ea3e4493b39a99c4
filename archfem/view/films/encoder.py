"""Films, written in one stroke."""

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

SUFFIXES = (".mp4", ".gif")

# Of flat colours and thin lines: as small as slower presets make it, in less than half their time
ENCODING = ["-preset", "veryfast", "-crf", "13", "-x264-params", "subme=1:weightp=0"]


def write_film(path: Path, shots: Iterable[Image], fps: float) -> Path:
    """Write a film; a killed one leaves the old file or none."""
    write = _write_gif if path.suffix == ".gif" else _write_mp4
    with atomic_write(path) as draft:
        write(draft, shots, fps)
    return path


def film_path(path: str | Path) -> Path:
    """Return the file, if its suffix is one of a film."""
    if Path(path).suffix not in SUFFIXES:
        raise InvalidInput(f"{path} has suffix '{Path(path).suffix}': use one of {SUFFIXES}")
    return Path(path)


def _write_gif(path: Path, shots: Iterable[Image], fps: float) -> None:
    """Write a film that repeats itself for ever."""
    with closing(imageio.get_writer(path, mode="I", duration=1000.0 / fps, loop=0)) as film:
        for shot in shots:
            film.append_data(shot[..., :3])


def _write_mp4(path: Path, shots: Iterable[Image], fps: float) -> None:
    """Pipe pictures as they are to an encoder in a process of its own."""
    film = None
    try:
        for shot in shots:
            film = film or _encoder(path, shot.shape, fps)
            film.send(np.ascontiguousarray(shot))
    finally:
        if film is not None:
            film.close()


def _encoder(path: Path, shape: tuple[int, ...], fps: float) -> Generator[None, Any, None]:
    """Start an encoder of pictures of a shape, to which they are sent."""
    encoder: Generator[None, Any, None] = write_frames(
        str(path),
        (shape[1], shape[0]),
        pix_fmt_in="rgba" if shape[2] == 4 else "rgb24",
        fps=fps,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        output_params=ENCODING,
    )
    encoder.send(None)
    return encoder
