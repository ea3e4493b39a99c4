"""Text and binary files: checked before reading, written atomically; columns of text."""

import errno
import os
import stat
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from archfem._validation import short_repr
from archfem.errors import DiskFull, InvalidInput

# Errors of the operating system for a full disk, an exceeded quota, a file too large
DISK_FULL_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

# Limit for files that are read at once: a record of 10⁷ samples is smaller.
MAX_FILE_BYTES = 2**28


def check_file(path: str | os.PathLike[str], what: str, max_bytes: int = MAX_FILE_BYTES) -> Path:
    """Refuse a path that is no regular file, or one that is too large."""
    try:
        place = Path(path)
        status = place.stat()
        if not stat.S_ISREG(status.st_mode):
            raise InvalidInput(f"{place} is a folder, a device or a pipe: give a {what}, a file")
        if status.st_size > max_bytes:
            raise InvalidInput(
                f"{place} has {status.st_size} bytes, and a {what} at most {max_bytes}: give that "
                "file"
            )
    except FileNotFoundError as error:
        raise InvalidInput(
            f"there is no {what} {path}: check its name and the folder of its path"
        ) from error
    except InvalidInput:
        raise
    except (OSError, ValueError, TypeError) as error:
        raise InvalidInput(_read_error(path, what, error)) from error
    return place


def read_bytes(path: str | os.PathLike[str], what: str, max_bytes: int = MAX_FILE_BYTES) -> bytes:
    """Read a file."""
    try:
        return check_file(path, what, max_bytes).read_bytes()
    except OSError as error:
        raise InvalidInput(_read_error(path, what, error)) from error


def _read_error(path: Any, what: str, error: Exception) -> str:
    """Return the message of a file that cannot be read."""
    return f"cannot read the {what} {short_repr(path)}: {describe_os_error(error)}"


def read_text(path: str | os.PathLike[str], what: str, max_bytes: int = MAX_FILE_BYTES) -> str:
    """Read a text file in UTF-8, with or without a byte order mark."""
    try:
        return read_bytes(path, what, max_bytes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(f"{path} is no {what}, for it is not UTF-8: {error}") from error


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a draft file that replaces the target when the block ends without error.

    An error or a kill leaves the old file or the new one, never a part of it.
    """
    if "\0" in str(path):
        raise InvalidInput(f"{short_repr(str(path))} is no path, for it has a null character")
    draft = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield draft
        with draft.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(draft, path)
    except DiskFull:
        raise
    except OSError as error:
        if error.errno in DISK_FULL_ERRORS:
            raise DiskFull(
                error.errno, f"{path} could not be written, for the disk is full: make room there"
            ) from error
        raise InvalidInput(_write_error(path, error)) from error
    finally:
        with suppress(OSError):  # the folder may be none, which was said above
            draft.unlink(missing_ok=True)


def _write_error(path: Path, error: Exception) -> str:
    """Return the message of a file or folder that cannot be written."""
    reason = describe_os_error(error)
    if isinstance(error, FileExistsError | NotADirectoryError):
        reason = "a folder of its path is a file, or a link to nowhere"
    return f"{short_repr(str(path))} cannot be written: {reason}; name another place"


def describe_os_error(error: Exception) -> str:
    """Describe why the operating system refused a file, without its number."""
    reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return f"{reason[:1].lower()}{reason[1:]}"


def create_result_folder(path: str | Path) -> Path:
    """Return a folder for results, created if it is missing."""
    folder = Path(path)
    if "\0" in str(folder):
        raise InvalidInput(f"{short_repr(str(folder))} is no path, for it has a null character")
    try:
        for place in (folder, *folder.parents):
            if place.is_symlink() and not place.exists():
                raise InvalidInput(
                    f"--out {folder}: {place} is a link to {os.readlink(place)}, which does not "
                    "exist: make that folder, or name another"
                )
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise InvalidInput(
            f"--out {folder} is a file, and results go into a folder: name another"
        ) from error
    except OSError as error:
        raise InvalidInput(
            f"the folder {folder} cannot be made ({error.strerror}): name another with --out"
        ) from error
    try:
        # tried before a run of hours; permissions do not say what a file system allows
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        if error.errno not in DISK_FULL_ERRORS:  # said where a file does not fit
            raise InvalidInput(_write_error(folder, error)) from error
    return folder


def align_columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a text table, its first column aligned left, the others right."""
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in [head, *rows]
    )
