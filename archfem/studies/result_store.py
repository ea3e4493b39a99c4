"""Rows of finished points in files, one each: nothing is lost, and nothing is found twice.

How far a study has come: on a terminal, and in a file that another process reads.

The findings of a study as one table: an `xarray.Dataset`, and files that others read too.
"""

import fcntl
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from math import inf
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import xarray as xr
from tqdm import tqdm

from archfem._files import DISK_FULL_ERRORS, atomic_write
from archfem._netcdf import read_dataset, write_dataset
from archfem.errors import InvalidInput, StudyStopped
from archfem.studies.parameter_space import Axis
from archfem.studies.process_pool import Row

# Folder of the rows; what the study is; file that tells that a driver is at work
POINTS, PLAN, LOCK = "points", "study.json", ".lock"


class Store:
    """A folder with a file for each finished point, under what tells the point from all others."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep any other driver out for as long as this one is at work, also if it is killed."""
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
        """Return what the study in the folder is."""
        try:
            plan: dict[str, Any] = json.loads((self.folder / PLAN).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InvalidInput(f"there is no study in {self.folder}: {error}") from error
        return plan

    def keep_plan(self, plan: dict[str, Any]) -> None:
        """Keep what the study is."""
        self._write(self.folder / PLAN, plan)

    def finished(self, digests: Iterable[str]) -> dict[str, Row]:
        """Return the rows that are there, without those that failed for no reason of their own."""
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
        """Keep the row of a point in one stroke."""
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
        with told_when_full(self.folder), atomic_write(path) as draft:
            draft.write_text(json.dumps(content), encoding="utf-8")


@contextmanager
def told_when_full(folder: Path) -> Iterator[None]:
    """Turn the error of a full disk into one that says what to do."""
    try:
        yield
    except OSError as error:
        if error.errno not in DISK_FULL_ERRORS:
            raise
        raise StudyStopped(
            f"the disk of {folder} is full: what was finished is kept, whole; make room there and "
            "run the same study to go on"
        ) from error


PROGRESS = "progress.json"

# Seconds between two writings of the file
EVERY = 1.0


@dataclass(frozen=True)
class Status:
    """How far a study has come.

    Attributes:
        total: how many points it has.
        done: points that are finished, failed ones among them.
        failed: points that ended in an error.
        rate: points a second, of the latest driver; 0 where it has finished none.
        running: whether a driver is at work.
    """

    total: int
    done: int
    failed: int
    rate: float = 0.0
    running: bool = False

    @property
    def remaining(self) -> float:
        """Time that the other points take at this rate [s]; infinite where none is known."""
        left = self.total - self.done
        return 0.0 if not left else left / self.rate if self.rate > 0.0 else inf

    def __str__(self) -> str:
        """The same in words."""
        words = [f"{self.done} of {self.total} points done", f"{self.failed} failed"]
        if self.done < self.total:
            words.append(f"{self.rate:.3g} a second")
            words.append(f"{self.remaining:.0f} s remaining" if self.rate else "time unknown")
        words.append("running" if self.running else "not running")
        return ", ".join(words)


class Progress:
    """Counts points as they are finished."""

    def __init__(self, total: int, done: int, failed: int, folder: Path | None) -> None:
        self._total, self._before, self._failed, self._folder = total, done, failed, folder
        self._done, self._begun, self._written = 0, monotonic(), -inf
        self._bar = tqdm(
            total=total, initial=done, unit="point", disable=None, leave=False, desc="study"
        )

    def add(self, *, failed: bool) -> None:
        """Count one point more."""
        self._done += 1
        self._failed += failed
        self._bar.set_postfix(failed=self._failed, refresh=False)
        self._bar.update()
        if monotonic() - self._written >= EVERY:
            self._write()

    def close(self) -> None:
        """Say for the last time how far it has come."""
        self._bar.close()
        self._write()

    def _write(self) -> None:
        self._written = monotonic()
        spent = self._written - self._begun
        now = Status(
            self._total,
            self._before + self._done,
            self._failed,
            self._done / spent if spent > 0.0 else 0.0,
        )
        if self._folder is not None:
            with told_when_full(self._folder), atomic_write(self._folder / PROGRESS) as draft:
                draft.write_text(json.dumps(asdict(now)), encoding="utf-8")


def status(folder: str | Path) -> Status:
    """Return how far the study in a folder has come, whether a driver is at work or not.

    Args:
        folder: of the study.

    Raises:
        InvalidInput: there is no study in it.
    """
    store = Store(Path(folder))
    digests = list(dict.fromkeys(store.plan()["points"]))
    rows = store.finished(digests)
    try:
        rate = float(json.loads((store.folder / PROGRESS).read_text(encoding="utf-8"))["rate"])
    except (OSError, ValueError, KeyError):
        rate = 0.0
    failed = sum(bool(row["error"]) for row in rows.values())
    return Status(len(digests), len(rows), failed, rate, store.busy)


# How cells begin that a spreadsheet computes
FORMULA = ("=", "+", "-", "@", "\t", "\r")

NETCDF, CSV, PARQUET = "results.nc", "results.csv", "results.parquet"

# Dimension of findings that are rows of numbers; shorter rows end in NaN
ALONG = "entry"


def table(axes: Sequence[Axis], rows: Sequence[Row], attributes: Mapping[str, Any]) -> xr.Dataset:
    """Return the rows of a study as a dataset."""
    shape = {axis.name: len(axis.rows) for axis in axes}
    found = xr.Dataset(attrs=dict(attributes))
    for axis in axes:
        for k, key in enumerate(axis.keys):
            found.coords[_place(key)] = _place(axis.name), _column([row[k] for row in axis.rows])
        if axis.name not in axis.keys:
            found.coords[axis.name] = axis.name, np.arange(len(axis.rows))
    dims, sizes = tuple(_place(name) for name in shape), tuple(shape.values())
    for name in dict.fromkeys(name for row in rows for name in row["found"]):
        values = [row["found"].get(name) for row in rows]
        key = _safe(name) if _safe(name) not in found.coords else f"{_safe(name)} found"
        if any(isinstance(value, list) for value in values):
            found[key] = (*dims, ALONG), _padded(values, rows).reshape(*sizes, -1)
        else:
            found[key] = dims, _column(values).reshape(sizes)
    found["error"] = dims, np.array([row["error"] for row in rows], dtype=object).reshape(sizes)
    return found


def load_tables() -> None:
    """Load what tables take, which is otherwise loaded when the first is made and written."""
    frame = xr.Dataset({"number": ("point", [0.0])}).to_dataframe()
    frame.to_csv()
    with suppress(ImportError):
        frame.to_parquet()


def write_table(found: xr.Dataset, folder: Path) -> list[Path]:
    """Write a table as NetCDF and CSV, and as Parquet where pyarrow is there.

    Rows of numbers are in the NetCDF file alone.
    """
    files = [folder / NETCDF, folder / CSV]
    flat = found.drop_dims(ALONG, errors="ignore")
    frame = flat.to_dataframe(dim_order=list(flat.dims) or None).reset_index()
    with told_when_full(folder):
        write_dataset(found, files[0])
        with atomic_write(files[1]) as draft:
            frame.map(_harmless).rename(columns=_harmless).to_csv(draft, index=False)
        with suppress(ImportError), atomic_write(folder / PARQUET) as draft:
            frame.to_parquet(draft, index=False)
            files.append(folder / PARQUET)
    return files


def _harmless(value: Any) -> Any:
    """A value that no spreadsheet takes for a formula: words that look like one are quoted."""
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value


def read_table(path: str | Path) -> xr.Dataset:
    """Return a table that `write_table` has written, loaded.

    Args:
        path: the NetCDF file.

    Raises:
        InvalidInput: there is none, or it is damaged.
    """
    return read_dataset(path, "table")


def _column(values: Sequence[Any]) -> Any:
    """Values as numbers where all are, else as words."""
    if all(value is None or isinstance(value, int | float) for value in values):
        return np.array([np.nan if value is None else float(value) for value in values])
    return np.array(["" if value is None else _words(value) for value in values], dtype=object)


def _words(value: Any) -> str:
    return value if isinstance(value, str) else repr(value)


def _padded(values: Sequence[Any], rows: Sequence[Row]) -> Any:
    """Rows of numbers (points, longest of the study); NaN beyond the end of each."""
    longest = max(len(v) for row in rows for v in row["found"].values() if isinstance(v, list))
    padded = np.full((len(values), longest), np.nan)
    for k, value in enumerate(values):
        if isinstance(value, list):
            padded[k, : len(value)] = value
    return padded


def _place(name: str) -> str:
    """A key as the name of a coordinate, in which NetCDF has no spaces."""
    return _safe(name).replace(" ", "_")


def _safe(name: str) -> str:
    """A name as NetCDF takes it."""
    return name.replace("/", "|")
