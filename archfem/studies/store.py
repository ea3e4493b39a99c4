"""Rows of finished points in files, one each: nothing is lost, and nothing is found twice."""

import fcntl
import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from archfem.errors import InvalidInput, StudyStopped
from archfem.files import FULL, in_one_stroke
from archfem.studies.worker import Row

POINTS, PLAN, LOCK = "points", "study.json", ".lock"
"""Folder of the rows; what the study is; file that tells that a driver is at work."""


class Store:
    """A folder with a file for each finished point, under what tells the point from all others.

    Args:
        folder: of the study.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep any other driver out for as long as this one is at work, also if it is killed.

        Raises:
            InvalidInput: another driver is at work in this folder.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / LOCK).open("a+") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                lock.seek(0)
                raise InvalidInput(
                    f"another driver is at work in {self.folder} ({lock.read().strip()}): wait for "
                    "it to end, or give this study a folder of its own"
                ) from error
            lock.truncate(0)
            lock.write(f"process {os.getpid()} on {os.uname().nodename}")
            lock.flush()
            for draft in self.folder.rglob(".*.part*"):  # of a driver that was killed
                draft.unlink()
            yield

    @property
    def busy(self) -> bool:
        """Whether a driver is at work."""
        if not (self.folder / LOCK).is_file():
            return False
        with (self.folder / LOCK).open() as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
        return False

    def plan(self) -> dict[str, Any]:
        """Return what the study in the folder is.

        Raises:
            InvalidInput: there is none.
        """
        try:
            plan: dict[str, Any] = json.loads((self.folder / PLAN).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InvalidInput(f"there is no study in {self.folder}: {error}") from error
        return plan

    def keep_plan(self, plan: dict[str, Any]) -> None:
        """Keep what the study is.

        Args:
            plan: as by `plan`.

        Raises:
            StudyStopped: the disk is full.
        """
        self._write(self.folder / PLAN, plan)

    def finished(self, digests: Iterable[str]) -> dict[str, Row]:
        """Return the rows that are there, without those that failed for no reason of their own.

        Args:
            digests: of the points that are wanted.
        """
        there = self.digests()
        found = {digest: self._row(digest) for digest in digests if digest in there}
        return {
            digest: row
            for digest, row in found.items()
            if row and (row["ours"] or not row["error"])
        }

    def digests(self) -> set[str]:
        """Return what tells the points apart that are there."""
        return {path.stem for path in (self.folder / POINTS).glob("??/*.json")}

    def keep(self, digest: str, row: Row) -> None:
        """Keep the row of a point in one stroke.

        Args:
            digest: what tells the point from all others.
            row: what came of it.

        Raises:
            StudyStopped: the disk is full.
        """
        self._write(self._path(digest), row)

    def _row(self, digest: str) -> Row | None:
        """A row; None where its file cannot be read."""
        try:
            found: Row = json.loads(self._path(digest).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return found

    def _path(self, digest: str) -> Path:
        return self.folder / POINTS / digest[:2] / f"{digest}.json"

    def _write(self, path: Path, content: dict[str, Any]) -> None:
        with told_when_full(self.folder), in_one_stroke(path) as draft:
            draft.write_text(json.dumps(content), encoding="utf-8")


@contextmanager
def told_when_full(folder: Path) -> Iterator[None]:
    """Turn the error of a full disk into one that says what to do.

    Args:
        folder: that is written to.

    Raises:
        StudyStopped: the disk is full.
        OSError: anything else is wrong.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in FULL:
            raise
        raise StudyStopped(
            f"the disk of {folder} is full: what was finished is kept, whole; make room there and "
            "run the same study to go on"
        ) from error
