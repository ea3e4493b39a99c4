"""Files written in one stroke."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def in_one_stroke(path: Path) -> Iterator[Path]:
    """Give a draft to write to, which takes the file's place when all is written.

    Whatever goes wrong, or ends the process, leaves the old file or the new one, never half of it.

    Args:
        path: the file; folders are made.

    Yields:
        Path of the draft, in the same folder and with the same suffix.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield draft
        with draft.open("rb+") as written:
            os.fsync(written.fileno())
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)
