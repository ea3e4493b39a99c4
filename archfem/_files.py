"""Text and binary files: checked before reading, written atomically; folders of results.

Results of a command replace earlier ones together. They are written to a draft folder, which is
renamed when all of them exist, and then moved. A list in the folder has the SHA-256 of each file
and that of the command's inputs. By this list a file of another run is recognised when it is read.

A result folder may come from a stranger. Paths in it are made by `path_inside`, which refuses
links; `SECURITY.md` says what is promised.
"""

import errno
import hashlib
import json
import os
import platform
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from importlib import import_module
from numbers import Real
from pathlib import Path, PurePath
from time import monotonic, sleep
from typing import IO, Any, NamedTuple

from archfem._validation import short_repr
from archfem.errors import DiskFull, InvalidInput, logger

# Errors of the operating system for a full disk, an exceeded quota, a file too large
DISK_FULL_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

# List of the files of a result folder
LIST_FILE = "archfem.json"

# Folders in a result folder: drafts of commands, and the draft whose files are being moved
DRAFT_PREFIX = ".unfinished-"
FINISHED_FOLDER = ".finished"

# How long finished results wait for a command that writes to their folder, as several end at once
WRITING_PATIENCE = 60.0  # s

# Flags by which a system opens no link and waits for no pipe; where it has none, only the check of
# `path_inside` remains
SAFE_FLAGS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)

# Links of Windows to folders, which Python recognises since 3.12
_is_junction = getattr(os.path, "isjunction", lambda _: False)

# Number of the format of result files: raise it where a key, column or attribute of them changes
# name or meaning. A file of another number is refused when it is read.
FORMAT = 8

# What computes a file of another format again, by its kind
REMEDIES = {
    "history file": "run `archfem run` again",
    "file of a verdict's range": "run `archfem verdict` again",
    "file of a risk": "delete it and run `archfem risk` again",
    "table": "run `archfem study` again",
    "study": "run `archfem study` again",
    "list of results": "run the commands of its folder again",
}

# Results that are written from those of another command, and vanish when these are replaced
DERIVED = {"run": ("report", "page"), "study": ("study summary",)}


def check_file(path: str | os.PathLike[str], what: str, max_bytes: int = 2**28) -> Path:
    """Refuse a path that is no regular file, or one that is too large."""
    # by default larger than a record of 10⁷ samples
    try:
        place = Path(path)
        status = place.stat()
    except FileNotFoundError:
        raise InvalidInput(
            f"there is no {what} {path}: check its name and the folder of its path"
        ) from None
    except (OSError, ValueError, TypeError) as error:
        raise InvalidInput(_read_error(path, what, error)) from None
    if not stat.S_ISREG(status.st_mode):
        raise InvalidInput(f"{place} is a folder, a device or a pipe: give a {what}, a file")
    if status.st_size > max_bytes:
        raise InvalidInput(
            f"{place} has {status.st_size} bytes, and a {what} at most {max_bytes}: give that file"
        )
    return place


def path_inside(folder: Path, name: str | PurePath) -> Path:
    """Return the path of a name in a result folder; refuse links there, and names outside it."""
    path, parts = folder, PurePath(name).parts
    if PurePath(name).anchor or ".." in parts:
        raise InvalidInput(f"{folder} names {short_repr(str(name))}, outside of it: delete it")
    for part in parts:
        path /= part
        try:
            mode = os.lstat(path).st_mode
        except (OSError, ValueError):  # there is none, and none below it
            return folder / name
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)) or _is_junction(path):
            raise InvalidInput(
                f"{path} is a link, a pipe or a device, and archfem writes none: it may lead to "
                "files elsewhere; delete it, or name another folder"
            )
    return path


def list_files(folder: Path) -> Iterator[Path]:
    """Yield the files below a folder of results, in which links are refused."""
    for name in sorted(os.listdir(folder)):
        path = path_inside(folder, name)
        yield from list_files(path) if path.is_dir() else [path]


def read_bytes(path: str | os.PathLike[str], what: str, max_bytes: int = 2**28) -> bytes:
    """Read a file."""
    try:
        return check_file(path, what, max_bytes).read_bytes()
    except OSError as error:
        raise InvalidInput(_read_error(path, what, error)) from None


def _read_error(path: Any, what: str, error: Exception) -> str:
    """Return the message of a file that cannot be read."""
    return f"cannot read the {what} {short_repr(path)}: {describe_os_error(error)}"


def read_text(path: str | os.PathLike[str], what: str, max_bytes: int = 2**28) -> str:
    """Read a text file in UTF-8, with or without a byte order mark."""
    try:
        return read_bytes(path, what, max_bytes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(f"{path} is no {what}, for it is not UTF-8: {error}") from None


@contextmanager
def atomic_write(path: Path, *, flush: bool = True) -> Iterator[Path]:
    """Yield a draft file that replaces the target when the block ends without error.

    An error or a kill leaves the old file or the new one, never a part of it. Without `flush`, a
    failure of the machine within seconds may damage the file.
    """
    _refuse_null(path)
    if not path.name:
        raise InvalidInput(f"{path} is a folder: name a file in it")
    begin, end = f".{path.stem}.{platform.node()}.", f".part{path.suffix}"
    draft = path.with_name(f"{begin}{os.getpid()}{end}")
    try:
        with _explain_write_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            for name in os.listdir(path.parent):
                is_draft = name.startswith(begin) and name.endswith(end)
                if is_draft and not _is_running(name[len(begin) : -len(end)]):
                    path.with_name(name).unlink(missing_ok=True)
            draft.unlink(missing_ok=True)  # a link that another has made
            yield draft
            if flush:
                with draft.open("rb+") as file:
                    os.fsync(file.fileno())
            os.replace(draft, path)
    finally:
        with suppress(OSError):  # the folder may be none, which was said above
            draft.unlink(missing_ok=True)


@contextmanager
def _explain_write_errors(path: Path) -> Iterator[None]:
    """Turn errors of the operating system into those of archfem."""
    try:
        yield
    except DiskFull:
        raise
    except OSError as error:
        if error.errno in DISK_FULL_ERRORS:
            raise DiskFull(
                error.errno, f"{path} could not be written, for the disk is full: make room there"
            ) from error
        raise InvalidInput(_write_error(path, error)) from error


def _is_running(process: str) -> bool:
    """Return whether there is a process of this number."""
    if sys.platform == "win32":  # where os.kill ends processes, whatever the signal
        return True
    try:
        os.kill(int(process), 0)
    except PermissionError:  # of another user
        return True
    except (OSError, ValueError, OverflowError):
        return False
    return True


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yield a folder that is deleted when the block ends, or if killed, by the next call."""
    prefix = "archfem-temporary-"
    for left in Path(tempfile.gettempdir()).glob(f"{prefix}*"):
        with suppress(OSError, InvalidInput):
            if (left / ".lock").exists() and not is_locked(left):
                shutil.rmtree(left)
    made = tempfile.TemporaryDirectory(prefix=prefix, ignore_cleanup_errors=True)
    with made as name, lock_folder(Path(name)):
        yield Path(name)


def _refuse_null(path: Path) -> None:
    """Refuse a path with a null character, for which Python raises an error of another class."""
    if "\0" in str(path):
        raise InvalidInput(
            f"{short_repr(str(path))} is no path, for it has a null character: remove it"
        )


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
    _refuse_null(folder)
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


class FileGroup(NamedTuple):
    """Files of a result folder that one command has written."""

    inputs: str  # SHA-256 of case, input files and program
    files: Mapping[str, str]  # SHA-256 by path relative to the folder


def lock_file(file: IO[bytes], *, wait: bool) -> None:
    """Lock a file until it is closed, or its process ends; a BlockingIOError without waiting."""
    try:
        import fcntl
    except ImportError:  # Windows
        _lock_byte(file, wait)
    else:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))


def _lock_byte(file: IO[bytes], wait: bool) -> None:
    """Lock a byte of a file far beyond its content, which others may read meanwhile."""
    msvcrt: Any = import_module("msvcrt")
    while True:
        file.seek(2**30)
        try:
            return msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError as error:
            if not wait:
                raise BlockingIOError(*error.args) from error
        finally:
            file.seek(0, os.SEEK_END)
        sleep(0.1)


@contextmanager
def lock_folder(folder: Path, patience: float = 0.0) -> Iterator[None]:
    """Refuse other commands that write to a folder while this one does; wait for them first [s]."""
    refusal = monotonic() + patience
    path = create_result_folder(folder) / ".lock"
    while True:
        try:
            lock = _open_lock(folder, "ab+")
        except OSError as error:
            raise InvalidInput(
                f"{folder} cannot be written to ({error.strerror}): name another folder"
            ) from error
        try:
            lock_file(lock, wait=False)
        except BlockingIOError as error:
            with lock:
                if monotonic() < refusal:
                    sleep(0.1)
                    continue
                lock.seek(0)
                raise InvalidInput(
                    f"another command runs in {folder} ({lock.read().decode()}): wait for it to "
                    "end, or name another folder"
                ) from error
        # the previous owner may have deleted the file after it was opened here
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(lock.fileno()), path.stat()):
                break
        lock.close()
    with lock:
        with suppress(OSError):  # a full disk; the lock needs no content
            lock.truncate(0)
            lock.write(f"process {os.getpid()} on {platform.node()}".encode())
        try:
            yield
        finally:
            with suppress(PermissionError):  # Windows deletes no open file
                path.unlink(missing_ok=True)


def _open_lock(folder: Path, mode: str) -> IO[bytes]:
    """Open the lock of a folder, which must be a file of its own."""
    path = path_inside(folder, ".lock")
    lock: IO[bytes] = open(  # noqa: SIM115
        path, mode, buffering=0, opener=lambda name, flags: os.open(name, flags | SAFE_FLAGS, 0o666)
    )
    status = os.fstat(lock.fileno())
    if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1:
        lock.close()
        raise InvalidInput(f"{path} has another name elsewhere: delete it, or name another folder")
    return lock


def is_locked(folder: Path) -> bool:
    """Return whether a command writes to a folder."""
    try:
        with _open_lock(folder, "rb") as lock:
            lock_file(lock, wait=False)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    return False


def check_format(path: str | Path, what: str, found: str) -> None:
    """Refuse a result file of another kind, or of another version of archfem."""
    if found != (own := f"{what} {FORMAT}"):
        raise InvalidInput(
            f"{path} was written by another version of archfem (format '{found}', not '{own}'): "
            f"{REMEDIES.get(what, 'run again')}"
        )


def write_sealed_json(path: Path, content: Any, *, flush: bool = True) -> None:
    """Write a JSON file with the SHA-256 of its content, by which a damaged file is noticed."""
    with atomic_write(path, flush=flush) as draft:
        sealed = {"format": FORMAT, "content": content, "sha256": hash_json(content)}
        draft.write_text(json.dumps(sealed), encoding="utf-8")


def read_sealed_json(path: Path, what: str) -> Any:
    """Read the content of a JSON file that `write_sealed_json` has written."""
    text = read_text(path, what)
    try:
        sealed = json.loads(text)
        content, digest = sealed["content"], sealed["sha256"]
    except (ValueError, KeyError, TypeError, RecursionError):
        content, digest = None, ""
    if digest != hash_json(content):
        raise InvalidInput(f"{path} is damaged: it is not what was written there; run again")
    check_format(path, what, f"{what} {sealed.get('format')}")
    return content


def hash_json(content: Any) -> str:
    """Return the SHA-256 of a value that JSON can represent."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def hash_value(value: Any) -> str:
    """Return the SHA-256 of dataclasses, tables, rows, numbers and texts within each other."""
    return hash_json(_reduce_to_json(value))


def _reduce_to_json(value: Any) -> Any:
    """Return a value as JSON: numbers as floats, files by content, functions by name."""
    if is_dataclass(value) and not isinstance(value, type):
        own = {each.name: getattr(value, each.name) for each in fields(value) if each.compare}
        return {type(value).__qualname__: _reduce_to_json(own)}
    if isinstance(value, Mapping):
        return {str(key): _reduce_to_json(each) for key, each in value.items()}
    if isinstance(value, Path):
        return hash_content(value) if value.is_file() else "missing"
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, Real):
        return float(value)
    if isinstance(value, Iterable):
        return [_reduce_to_json(each) for each in value]
    return f"{getattr(value, '__module__', '')}:{getattr(value, '__qualname__', repr(value))}"


def read_file_list(folder: Path) -> dict[str, FileGroup]:
    """Return the files of a result folder by command; none if it has no list."""
    path = path_inside(folder, LIST_FILE)
    if not path.is_file():
        return {}
    content = read_sealed_json(path, "list of results")
    try:
        return {
            command: FileGroup(str(group["inputs"]), dict(group["files"]))
            for command, group in content.items()
        }
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InvalidInput(f"{path} is no list of results, but another file: run again") from error


def group_of(groups: Mapping[str, FileGroup], name: str) -> FileGroup | None:
    """Return the group that has a file, or None."""
    return next((group for group in groups.values() if name in group.files), None)


def read_listed(folder: Path, name: str) -> bytes:
    """Read a file of a result folder, which must be the one that archfem wrote there."""
    path = path_inside(folder, name)
    content = read_bytes(path, "result", max_bytes=2**40)
    check_listed(path, content)
    return content


def check_listed(path: Path, content: bytes) -> None:
    """Refuse a file of a result folder that is not the one which archfem wrote there."""
    for listed in _find_digests(path):
        if listed != hashlib.sha256(content).hexdigest():
            raise InvalidInput(
                f"{path} is not the file that archfem wrote there, by the digest in "
                f"{LIST_FILE}: it was changed, or is of another run; run again"
            )


def refuse_listed(path: Path) -> None:
    """Refuse to replace a file of a result folder, which belongs to the others there."""
    if path.is_file() and list(_find_digests(path)):
        raise InvalidInput(
            f"{path} is a result of `archfem run` or a study, with others of the same folder: "
            "give another name, or delete that folder"
        )


def refuse_unlisted(folder: Path, names: Iterable[str]) -> None:
    """Refuse to replace files of a result folder that no command has written there."""
    try:
        groups = read_file_list(folder)
    except InvalidInput:  # which files are results is not known, and a new run is the remedy
        return
    for path in (folder / name for name in names if group_of(groups, name) is None):
        if path.is_file():
            raise InvalidInput(
                f"{path} is no result of archfem, by {LIST_FILE}, and a run would replace it: "
                "name another folder, or move that file"
            )


def _find_digests(path: Path) -> Iterator[str]:
    """Yield the digests that a file has in the lists of its folders."""
    path = path.absolute()
    # the history of a pair is in a folder within the result folder
    for folder in (path.parent, path.parent.parent):
        name = path.relative_to(folder).as_posix()
        # a draft is in no list, and that beside it may be what a new run replaces
        groups = [] if name.startswith(DRAFT_PREFIX) else read_file_list(folder).values()
        yield from (group.files[name] for group in groups if name in group.files)


@contextmanager
def replace_results(folder: Path, command: str, inputs: str) -> Iterator[Path]:
    """Yield a draft folder whose files replace those of a command when the block ends."""
    with lock_folder(folder, WRITING_PATIENCE), stage_results(folder, command, inputs) as draft:
        yield draft


@contextmanager
def stage_results(folder: Path, command: str, inputs: str) -> Iterator[Path]:
    """Yield a draft folder as `replace_results` does, in a folder that is locked already."""
    draft = start_draft(folder, command)
    try:
        yield draft
        publish_draft(folder, command, inputs)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def start_draft(folder: Path, command: str) -> Path:
    """Return the draft folder of a command, which is locked.

    Only a draft of "run" may have files: the pairs of a suite that was interrupted.
    """
    remove_leftovers(folder)
    draft = folder / f"{DRAFT_PREFIX}{command}"
    with _explain_write_errors(draft):
        draft.mkdir(exist_ok=True)
    return draft


def remove_leftovers(folder: Path) -> None:
    """Remove the remains of killed commands from a folder, which is locked."""
    complete_publication(folder)
    for leftover in folder.glob(f"{DRAFT_PREFIX}*"):
        path_inside(folder, leftover.name)
        if leftover.name != f"{DRAFT_PREFIX}run":
            shutil.rmtree(leftover, ignore_errors=True)
    for part in folder.glob(".*.part*"):
        with suppress(OSError):  # a folder
            part.unlink()


def publish_draft(folder: Path, command: str, inputs: str) -> None:
    """Replace the files that a command has written earlier by those of its draft."""
    draft = folder / f"{DRAFT_PREFIX}{command}"
    files = {p.relative_to(draft).as_posix(): hash_content(p) for p in list_files(draft)}
    listed = intact_file_list(folder)
    same = command in listed and listed[command].files == files
    replaced = {command} if same else {command, *DERIVED.get(command, ())}
    groups: dict[str, Any] = {command: {"inputs": inputs, "files": files}}
    for name, group in listed.items():
        if name not in replaced:
            others = {file: digest for file, digest in group.files.items() if file not in files}
            if name == "run" and group.inputs == inputs:  # its case, signed by others
                others |= {file: files.pop(file) for file in group.files if file in files}
            groups[name] = {"inputs": group.inputs, "files": others}
    write_sealed_json(draft / LIST_FILE, groups)
    with _explain_write_errors(folder):
        # from here on the new results are those that count
        os.rename(draft, path_inside(folder, FINISHED_FOLDER))
    complete_publication(folder)


def complete_publication(folder: Path) -> None:
    """Move finished results to their places; an interrupted call can be repeated."""
    finished = path_inside(folder, FINISHED_FOLDER)
    if not finished.is_dir():
        return
    with _explain_write_errors(folder):
        if (finished / LIST_FILE).is_file():
            _move_finished(finished, folder)
        shutil.rmtree(finished)


def _move_finished(finished: Path, folder: Path) -> None:
    """Move finished results to their places, and delete the earlier ones."""
    listed = {name for group in read_file_list(finished).values() for name in group.files}
    earlier = {name for group in intact_file_list(folder).values() for name in group.files}
    # all places are checked before the first change
    moves = [(p, path_inside(folder, p.relative_to(finished))) for p in list_files(finished)]
    for name in earlier - listed:
        _delete_within(folder, name)
    moves.sort(key=lambda move: move[1] == folder / LIST_FILE)  # last: it says that all are there
    for path, target in moves:
        target.parent.mkdir(parents=True, exist_ok=True)
        name = target.relative_to(folder).as_posix()
        if name not in earlier and name != LIST_FILE and target.is_file():
            kept = target.with_name(f"{target.name}.kept")  # of the user, or of a lost list
            logger.warning("%s is in no list of results: it is kept as %s", target, kept.name)
            os.replace(target, kept)
        os.replace(path, target)


def describe_deleted(folder: Path) -> str:
    """Say which listed files of a result folder are missing; "" if none is."""
    # an earlier report may have been deleted, for it is written anew
    listed = read_file_list(folder).items()
    groups = (group for name, group in listed if name not in DERIVED["run"])
    names = [n for group in groups for n in group.files if not path_inside(folder, n).is_file()]
    if not names:
        return ""
    return f"a listed file is missing: {', '.join(names)}; put it back, or run the case again"


def intact_file_list(folder: Path) -> dict[str, FileGroup]:
    """Return the files of a result folder by command; none if its list is damaged."""
    try:
        return read_file_list(folder)
    except InvalidInput:
        return {}


def _delete_within(folder: Path, name: str) -> None:
    """Delete a file of a result folder, and its own folder if that is empty then."""
    with suppress(InvalidInput, OSError):  # a list that was made up
        path = path_inside(folder, name)
        path.unlink(missing_ok=True)
        if path.parent != folder:
            path.parent.rmdir()


def hash_content(path: Path) -> str:
    """Return the SHA-256 of a file, read in parts."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def align_columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a text table, its first column aligned left, the others right."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    lines = []
    for first, *others in (head, *rows):
        cells = [first.ljust(widths[0]), *map(str.rjust, others, widths[1:])]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)
