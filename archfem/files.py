"""Files read with care and written in one stroke, and compiled code that is out of date."""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from archfem.arguments import said
from archfem.errors import DiskFull, InvalidInput

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What goes wrong where there is no room for a file."""

LARGEST = 2**28
"""Most bytes that are read of a file unless told otherwise: a record of 10⁷ samples has fewer."""


def check_file(path: str | os.PathLike[str], what: str, most: int = LARGEST) -> Path:
    """Refuse what is no file that can be meant: a folder, a device, a pipe, or one too large.

    Args:
        path: the file.
        what: it should be, for errors: "case file", "record".
        most: bytes.

    Returns:
        The file.

    Raises:
        InvalidInput: there is no such file, or it cannot be meant.
    """
    try:
        place = Path(path)
        found = place.stat()
        if not stat.S_ISREG(found.st_mode):
            raise InvalidInput(f"{place} is a folder, a device or a pipe: give a {what}, a file")
        if found.st_size > most:
            raise InvalidInput(
                f"{place} has {found.st_size} bytes, and a {what} at most {most}: give that file"
            )
    except FileNotFoundError as error:
        raise InvalidInput(
            f"there is no {what} {path}: look at its name, and at the folder where it starts"
        ) from error
    except InvalidInput:
        raise
    except (OSError, ValueError, TypeError) as error:
        raise InvalidInput(_unread(path, what, error)) from error
    return place


def content_of(path: str | os.PathLike[str], what: str, most: int = LARGEST) -> bytes:
    """Return what is in a file.

    Args:
        path: the file.
        what: it should be, for errors.
        most: bytes.

    Raises:
        InvalidInput: as `check_file`, or it cannot be read.
    """
    try:
        return check_file(path, what, most).read_bytes()
    except OSError as error:
        raise InvalidInput(_unread(path, what, error)) from error


def _unread(path: Any, what: str, error: Exception) -> str:
    reason = getattr(error, "strerror", None) or str(error)
    return f"cannot read the {what} {said(path)}: {reason}"


def text_of(path: str | os.PathLike[str], what: str, most: int = LARGEST) -> str:
    """Return the text of a file in UTF-8, with or without its mark.

    Args:
        path: the file.
        what: it should be, for errors.
        most: bytes.

    Raises:
        InvalidInput: as `content_of`, or it is not UTF-8.
    """
    try:
        return content_of(path, what, most).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(f"{path} is no {what}, for it is not UTF-8: {error}") from error


@contextmanager
def in_one_stroke(path: Path) -> Iterator[Path]:
    """Give a draft to write to, which takes the file's place when all is written.

    Whatever goes wrong, or ends the process, leaves the old file or the new one, never half of it.

    Args:
        path: the file; folders are made.

    Yields:
        Path of the draft, in the same folder and with the same suffix.

    Raises:
        DiskFull: there is no room for it.
        OSError: anything else is wrong with it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield draft
        with draft.open("rb+") as written:
            os.fsync(written.fileno())
        os.replace(draft, path)
    except OSError as error:
        if error.errno not in FULL:
            raise
        raise DiskFull(
            error.errno, f"{path} could not be written, for the disk is full: make room there"
        ) from error
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
