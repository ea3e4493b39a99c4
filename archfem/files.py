"""Files written in one stroke, and compiled code that is out of date."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from archfem.errors import InvalidInput


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


def result_folder(path: str | Path) -> Path:
    """Return a folder for results, made if it is not there.

    Args:
        path: of the folder.

    Raises:
        InvalidInput: a file stands in its place, or it cannot be made.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise InvalidInput(
            f"--out {folder} is a file, and results go into a folder: name another"
        ) from error
    except OSError as error:
        raise InvalidInput(
            f"the folder {folder} cannot be made ({error.strerror}): name another with --out"
        ) from error
    return folder


def forget_stale(folder: Path, *others: Path) -> None:
    """Delete compiled code of a folder that is older than any of its sources.

    Numba looks at the source of each function alone, not at that of what it calls: without this a
    compiled function would go on calling others as they were when it was compiled.

    Args:
        folder: of modules, whose `__pycache__` holds what numba compiled.
        others: folders of modules that those of this one call.
    """
    sources = [path for each in (folder, *others) for path in each.glob("*.py")]
    newest = max(path.stat().st_mtime for path in sources)
    for path in (folder / "__pycache__").glob("*.nb[ic]"):
        with suppress(OSError):  # another process was first, or may not
            if path.stat().st_mtime < newest:
                path.unlink()
