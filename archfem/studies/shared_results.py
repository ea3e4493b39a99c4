"""Results that all workers of a study share: matched motions and runs of searches, computed once.

Each is a file in a folder of the study, named by the digest of its inputs. A worker that needs one
computes it under a lock, and another one that needs it meanwhile waits and reads it.
"""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from archfem._files import lock_file, read_sealed_json, write_sealed_json
from archfem.cases.provenance import describe_version
from archfem.errors import InvalidInput

_folders: list[Path | None] = []  # the last one is in use


@contextmanager
def share_results(folder: Path | None) -> Iterator[None]:
    """Share results through a folder while the block runs; None shares none."""
    _folders.append(folder)
    try:
        yield
    finally:
        _folders.pop()


def compute_once(kind: str, key: str, compute: Callable[[], Any]) -> Any:
    """Return the shared result of a key as JSON represents it, or compute and share it."""
    folder = _folders[-1] if _folders else None
    # this machine of a cluster may not have the folder of the study
    if folder is None or not folder.parent.is_dir():
        return compute()
    digest = hashlib.sha256(f"{describe_version()} {key}".encode()).hexdigest()[:32]
    path = folder / kind / f"{digest}.json"
    if (content := _read(path)) is not None:
        return content
    with _lock(path):
        # another worker may have finished it meanwhile
        if (content := _read(path)) is None:
            content = compute()
            # where the disk is full it is not shared
            with suppress(OSError, InvalidInput):
                write_sealed_json(path, {"key": digest, "result": content}, flush=False)
    return content


def count_results(folder: Path, kind: str) -> int:
    """Return the number of shared results of a kind."""
    return sum(1 for _ in (folder / kind).glob("*.json"))


def _read(path: Path) -> Any:
    """Read a result; None if there is none, or it is damaged or of another key."""
    try:
        content = read_sealed_json(path, "shared result")
    except InvalidInput:
        return None
    is_own = isinstance(content, dict) and content.get("key") == path.stem
    return content.get("result") if is_own else None


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Wait until no other worker computes a result; without a lock if there can be none."""
    lock = path.with_name(f".{path.stem}.lock")
    with ExitStack() as stack:
        with suppress(OSError):
            lock.parent.mkdir(parents=True, exist_ok=True)
            file = stack.enter_context(lock.open("ab"))
            lock_file(file, wait=True)
            stack.push(suppress(PermissionError))  # Windows deletes no open file
            stack.callback(lock.unlink, missing_ok=True)
        yield
