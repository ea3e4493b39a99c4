"""Results of a study on disk: a file for each point, the progress, and the table of all findings.

The table is an `xarray.Dataset`, written as NetCDF, CSV and Parquet.
"""

import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib import import_module
from math import inf, isfinite, isnan
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np
import pandas as pd
import xarray as xr
from tqdm import tqdm

from archfem import _files
from archfem._display import PROGRESS_INTERVAL, write_progress_line
from archfem._netcdf import name_flags, read_dataset, write_dataset
from archfem._validation import validate_arguments
from archfem.cases.provenance import describe_version
from archfem.cases.result_text import STATED_DOUBTS, UPPER_BOUNDS, mark_bound
from archfem.dynamics.history import Ending
from archfem.errors import InvalidInput, StudyStopped, logger
from archfem.studies.evaluators import Evaluator
from archfem.studies.parameter_space import PAIR_KEY, Axis, StudyPoint
from archfem.studies.process_pool import Row, evaluate_points, reached
from archfem.studies.shared_results import count_results
from archfem.units import in_si_unit

# Files of the table as NetCDF, CSV and for Excel
RESULT_FILES = "results.nc", "results.csv", "results.xlsx", "results.parquet"


class Store:
    """A folder with a file for each finished point, named by the digest of the point."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        names = "points", "study.json", "progress.json", "shared", "workers.log"
        paths = (_files.path_inside(folder, name) for name in names)
        # `shared` has the results that workers share
        self._points, self._plan, self._progress, self.shared, self.log = paths

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Refuse other drivers while this one runs, and remove the remains of a killed one."""
        with _files.lock_folder(self.folder):
            for place in filter(Path.is_dir, (self._points, self.shared)):
                for path in _files.list_files(place):
                    if path.name.startswith("."):
                        path.unlink()
            _files.remove_leftovers(self.folder)
            yield

    @property
    def busy(self) -> bool:
        """Whether a driver is running."""
        return _files.is_locked(self.folder)

    def read_plan(self) -> dict[str, Any]:
        """Read the title, version and points of the study in the folder."""
        if not self._plan.is_file():
            raise InvalidInput(f"there is no study in {self.folder}: it has no {self._plan.name}")
        plan: dict[str, Any] = _files.read_sealed_json(self._plan, "study")
        if not isinstance(plan, dict) or "points" not in plan:
            raise InvalidInput(f"{self._plan} is no study, but another file: run the study again")
        return plan

    def write_plan(self, plan: dict[str, Any]) -> None:
        """Write the title, version and points of the study."""
        self._write(self._plan, plan)

    def load_rows(self, digests: Iterable[str]) -> dict[str, Row]:
        """Return the stored rows, without those of errors that may not occur again."""
        stored = self.digests()
        rows = {digest: self._read_row(digest) for digest in digests if digest in stored}
        if damaged := [digest for digest, row in rows.items() if row is None]:
            logger.warning(
                "%d of the stored points in %s are damaged or were changed: computed again; %s",
                *(len(damaged), self.folder, self._row_path(damaged[0])),
            )
        return {d: row for d, row in rows.items() if row and (row["ours"] or not row["error"])}

    def digests(self) -> set[str]:
        """Return the digests of the stored points."""
        return {path.stem for path in self._points.glob("??/*.json")}

    def write_row(self, digest: str, row: Row) -> None:
        """Write the row of a point, with the digest of the point."""
        self._write(self._row_path(digest), {"point": digest, **row})

    def write_progress(self, status: "Status") -> None:
        """Write the progress, for another process to read."""
        self._write(self._progress, asdict(status))

    def write_table(self, table: xr.Dataset) -> None:
        """Write a table as NetCDF, CSV, and, if their packages are installed, Parquet and Excel."""
        folder, inputs = self.folder, _files.hash_json(self.read_plan()["points"])
        frame = _flatten(table)
        quoted = frame.map(_quote_formula).rename(columns=_quote_formula)
        with explain_full_disk(folder), _files.stage_results(folder, "study", inputs) as draft:
            netcdf, csv, excel, parquet = (draft / name for name in RESULT_FILES)
            write_dataset(table, netcdf, "table")
            # Some versions of HDF5 write the time into a file: a table of the same content stays,
            # and with it what was derived from it.
            if _holds_same(folder / netcdf.name, netcdf):
                shutil.copyfile(folder / netcdf.name, netcdf)
            with _files.atomic_write(csv) as part:
                quoted.to_csv(part, index=False)
            with suppress(ImportError), _files.atomic_write(parquet) as part:
                frame.to_parquet(part, index=False)
            if len(frame) <= 1_048_575:  # rows of a sheet of Excel below the header
                with suppress(ImportError), _files.atomic_write(excel) as part:
                    _write_sheet(quoted, part)

    def read_rates(self) -> dict[str, float]:
        """Read the speed that the latest driver measured; nothing if unknown."""
        try:
            progress = _files.read_sealed_json(self._progress, "progress")
        except InvalidInput:  # missing, damaged or another file
            return {}
        names = ("rate", "run_rate", "runs_left")
        return {name: float(progress[name]) for name in names if name in progress}

    def _read_row(self, digest: str) -> Row | None:
        """Read a row; None if its file is damaged or of another point."""
        try:
            row: Row = _files.read_sealed_json(self._row_path(digest), "row of a study")
        except InvalidInput:
            return None
        return row if isinstance(row, dict) and row.pop("point", "") == digest else None

    def _row_path(self, digest: str) -> Path:
        """Path of a row; subfolders keep the number of files in a folder small."""
        return self._points / digest[:2] / f"{digest}.json"

    def _write(self, path: Path, content: dict[str, Any]) -> None:
        """Write a JSON file whole or not at all."""
        with explain_full_disk(self.folder):
            # thousands of rows would wait for the disk, and a damaged one is computed again
            _files.write_sealed_json(path, content, flush=False)


@contextmanager
def explain_full_disk(folder: Path) -> Iterator[None]:
    """Replace the error of a full disk by one with a remedy."""
    try:
        yield
    except OSError as error:
        if error.errno not in _files.DISK_FULL_ERRORS:
            raise
        raise StudyStopped(
            f"the disk of {folder} is full: finished points are kept; make room there and run the "
            "same study to go on"
        ) from error


@dataclass(frozen=True)
class Status:
    """Progress of a study.

    Attributes:
        total: number of points.
        done: number of finished points, failed ones included.
        failed: number of points that ended in an error.
        rate: points per second of the latest driver; 0 if it has finished none.
        running: whether a driver is running.
        runs: number of finished runs of searches, of unfinished points too.
        run_rate: runs of searches per second of the latest driver; 0 if there are none.
        runs_left: runs that are left, if each search takes as many as the finished ones; 0 if
            none has finished.
    """

    total: int
    done: int
    failed: int
    rate: float = 0.0
    running: bool = False
    runs: int = 0
    run_rate: float = 0.0
    runs_left: float = 0.0

    @property
    def remaining(self) -> float:
        """Remaining time at this rate [s], of runs if points are searches; infinite if unknown."""
        left, rate = float(self.total - self.done), self.rate
        if self.run_rate:  # points of an IDA take minutes
            left, rate = (self.runs_left, self.run_rate) if self.runs_left else (left, 0.0)
        return 0.0 if self.done == self.total else left / rate if rate > 0.0 else inf

    def __str__(self) -> str:
        """One line of text."""
        words = [f"{self.done} of {self.total} points done", f"{self.failed} failed"]
        words += [f"{self.runs} runs kept"] if self.runs else []
        if self.done < self.total:
            rate = f"{self.run_rate:.3g} runs" if self.run_rate else f"{self.rate:.3g}"
            words += [f"{rate} a second"] if self.run_rate or self.rate else []
            known, first = self.remaining < inf, "time known when the first has ended"
            words.append(f"{self.remaining:.0f} s remaining" if known else first)
        words.append("running" if self.running else "not running")
        return ", ".join(words)


class Progress:
    """Counts finished points, on a progress bar or in lines, and in a file of the store."""

    def __init__(
        self,
        total: int,
        done: int,
        failed: int,
        store: Store | None = None,
        shared: Path | None = None,
        name: str = "study",
    ) -> None:
        self._total, self._done_before, self._failed = total, done, failed
        self._store, self._shared, self._name = store, shared, name
        self._done, self._start, self._written = 0, monotonic(), -inf
        self._runs_before, self._point_runs = self._count_runs(), 0
        options = {"disable": None, "leave": False, "desc": name}
        # without the remaining time of tqdm, which does not count runs
        layout = "{desc}: {percentage:3.0f}% |{bar}| {n_fmt} of {total_fmt}{postfix}"
        self._bar = tqdm(total=total, initial=done, bar_format=layout, **options)
        self._closed = Event()
        # a point may take minutes, in which the number of its runs shows how far it is
        self._reporter = Thread(target=self._report, daemon=True)
        self._reporter.start()

    def add(self, *, failed: bool, runs: int = 0) -> None:
        """Count a finished point, and the runs of its search."""
        self._done += 1
        self._point_runs += runs
        self._failed += failed
        self._bar.update()
        if monotonic() - self._written >= 1.0:  # points may take milliseconds
            self._write()

    def close(self) -> None:
        """Remove the bar and write the final progress."""
        self._closed.set()
        self._reporter.join()
        self._bar.close()
        self._write()

    def _write(self) -> None:
        """Write the progress to the store."""
        self._written = monotonic()
        if self._store is not None:
            self._store.write_progress(self._status)

    def _count_runs(self) -> int:
        """Return the number of runs of searches, finished or under way."""
        return 0 if self._shared is None else count_results(self._shared, "runs")

    @property
    def _status(self) -> Status:
        """The progress at this instant."""
        seconds = max(monotonic() - self._start, 1e-9)
        runs = self._count_runs()
        new, done = runs - self._runs_before, self._done_before + self._done
        # of the searches that are under way some runs are done
        left = self._point_runs / max(self._done, 1) * (self._total - done)
        left = max(left - max(new - self._point_runs, 0), 0.0)
        rates = {"rate": self._done / seconds, "run_rate": new / seconds, "runs_left": left}
        return Status(self._total, done, self._failed, running=True, runs=runs, **rates)

    def _report(self) -> None:
        """Show the progress until it is closed, on the bar or in lines, each of some progress."""
        shown: Any = None
        while not self._closed.wait(PROGRESS_INTERVAL if self._bar.disable else 1.0):
            status, slowest = self._status, [each.text for each in sorted(reached.values())[:1]]
            words = "; ".join([str(status), *slowest])
            if not self._bar.disable:
                self._bar.set_postfix_str(words.partition(", ")[2])
            elif (state := (status.done, status.runs, slowest)) != shown:
                write_progress_line(self._name, words)
                shown = state


def evaluate_with_progress(
    points: Sequence[tuple[int, StudyPoint]],
    find: Callable[..., Mapping[str, Any]],
    workers: int,
    name: str,
    folder: str | Path | None = None,
) -> Iterator[tuple[int, Row]]:
    """Evaluate points by a function as `evaluate_points` does, and show the progress.

    Rows are stored in the folder, if there is one, and those stored before are not computed again.
    """
    with ExitStack() as stack:
        store, digests, kept = None, dict[int, str](), dict[str, Row]()
        if folder is not None:
            store, function = Store(Path(folder)), [describe_version(), find]
            stack.enter_context(store.lock())
            digests = {number: _files.hash_value([function, point]) for number, point in points}
            kept = store.load_rows(digests.values())
            yield from ((k, kept[digest]) for k, digest in digests.items() if digest in kept)
        left = [each for each in points if digests.get(each[0]) not in kept]
        done, failed = len(points) - len(left), sum(bool(row["error"]) for row in kept.values())
        progress = Progress(len(points), done, failed, store, name=name)
        stack.enter_context(closing(progress))
        try:
            for number, row in evaluate_points(left, Evaluator(find), workers):
                if store is not None:
                    store.write_row(digests[number], row)
                progress.add(failed=bool(row["error"]))
                yield number, row
        except KeyboardInterrupt:
            if store is not None:
                logger.warning("finished runs are kept in %s: run the same again", folder)
            raise


@validate_arguments
def status(folder: str | Path) -> Status:
    """Return the progress of the study in a folder, whether a driver is running or not.

    Args:
        folder: folder of the study.

    Raises:
        InvalidInput: there is no study in it.
    """
    store = Store(Path(folder))
    digests = list(dict.fromkeys(store.read_plan()["points"]))
    rows = store.load_rows(digests)
    failed = sum(bool(row["error"]) for row in rows.values())
    runs = count_results(store.shared, "runs")
    rates: dict[str, Any] = store.read_rates()
    return Status(len(digests), len(rows), failed, running=store.busy, runs=runs, **rates)


def build_table(
    axes: Sequence[Axis],
    rows: Sequence[Row],
    units: Mapping[str, str],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Return the rows of a study as a dataset over its axes, findings with their units."""
    table = xr.Dataset(attrs=dict(attributes))
    for axis in axes:
        for k, key in enumerate(axis.keys):
            values, unit = [row[k] for row in axis.rows], ""
            if "." in key and key != PAIR_KEY:  # of the case; others are names
                values, unit = in_si_unit(values)
            attributes = {"units": unit} if unit else {}
            if all(isinstance(value, bool) for value in values):
                attributes = {"flag_values": [0.0, 1.0], "flag_meanings": "no yes"}
            table.coords[_coordinate(key)] = _coordinate(axis.name), _to_array(values), attributes
        if axis.name not in axis.keys:
            table.coords[axis.name] = axis.name, np.arange(len(axis.rows))
    dims = tuple(_coordinate(axis.name) for axis in axes)
    sizes = tuple(len(axis.rows) for axis in axes)
    for name in dict.fromkeys(name for row in rows for name in row["found"]):
        values = [row["found"].get(name) for row in rows]
        key = _variable(name)
        key = f"{key} found" if key in table.coords else key
        if any(isinstance(value, list) for value in values):
            table[key] = (*dims, "entry"), _pad(values, rows).reshape(*sizes, -1)
        else:
            attributes = {"units": units[name]} if name in units else {}
            table[key] = dims, _to_array(values).reshape(sizes), attributes
    table["error"] = dims, np.array([row["error"] for row in rows], dtype=object).reshape(sizes)
    return table


def _holds_same(stored: Path, table: Path) -> bool:
    """Return whether a stored file is intact and has the table of another."""
    with suppress(InvalidInput):
        return read_table(stored).identical(read_table(table))
    return False


def _flatten(table: xr.Dataset) -> pd.DataFrame:
    """Return a row for each point; rows of numbers are in NetCDF alone."""
    flat = table.drop_dims("entry", errors="ignore")
    return flat.to_dataframe(dim_order=list(flat.dims)).reset_index()


def _write_sheet(frame: pd.DataFrame, path: Path) -> None:
    """Write a sheet of Excel without the time of day, so that equal tables are equal files."""
    # row by row, in half the time of pandas
    book = import_module("openpyxl").Workbook(write_only=True)
    sheet = book.create_sheet("results")
    sheet.append(list(frame.columns))
    for row in frame.itertuples(index=False, name=None):
        sheet.append([_to_cell(value) for value in row])
    book.save(path)
    with ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            timeless = re.sub(rb"\d{4}-\d\d-\d\dT[\d:]+Z", b"1980-01-01T00:00:00Z", content)
            is_core = name == "docProps/core.xml"
            archive.writestr(ZipInfo(name), timeless if is_core else content, ZIP_DEFLATED)


def _to_cell(value: Any) -> Any:
    """Return a value of a cell, which has no NaN and no infinity."""
    if isinstance(value, float) and not isfinite(value):
        return None if isnan(value) else str(value)
    return value


def format_table(table: xr.Dataset, max_rows: int = 50) -> str:
    """Return the table of a study as text: keys, and the findings in which points differ."""
    frame = _flatten(name_flags(table)).drop(columns=["error", STATED_DOUBTS], errors="ignore")
    points, shown = frame.to_dict("records"), frame.drop(columns=UPPER_BOUNDS, errors="ignore")
    cells = {x: [mark_bound(each, x, _format_cell(each[x])) for each in points] for x in shown}
    same = {x: each[0] for x, each in cells.items() if x not in table.coords and len({*each}) == 1}
    names = sorted((x for x in cells if x not in same), key=lambda name: name not in table.coords)
    units = {name: table[name].attrs.get("units") if name in table else None for name in names}
    head = [f"{name} [{units[name]}]" if units[name] else str(name) for name in names]
    rows = zip(*(cells[name][:max_rows] for name in names), strict=True)
    text = [_files.align_columns(head, [*rows])]
    if len(frame) > max_rows:
        least = frame[max_rows:].get("least_push", pd.Series(dtype=float)).min()
        pushed = f", with a least push of {least:.5g}" * bool(least == least)
        text += [f"… {len(frame) - max_rows} more points{pushed}"]
    shared = "; ".join(f"{name} = {text}" for name, text in same.items() if text)
    text += [f"the same at all points: {shared}"] * bool(shared)
    if "ended" in frame and frame["ended"].isin([x for x in Ending if x.is_loose]).any():
        words = "of a point that ended 'parted' or 'met', joints are those before its blocks were"
        text.append(f"{words} loose, displacements those to its end")
    return "\n".join(text)


def _format_cell(value: Any) -> str:
    """Return a number or text for a table of text."""
    if not isinstance(value, float):
        return str(value)
    return "-" if value != value else f"{value:.5g}"


def _quote_formula(value: Any) -> Any:
    """Quote a text that a spreadsheet would compute as a formula."""
    is_formula = isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r"))
    return f"'{value}" if is_formula else value


@validate_arguments
def read_table(path: str | Path) -> xr.Dataset:
    """Read the table of a study.

    Args:
        path: path of the NetCDF file.

    Raises:
        InvalidInput: the file is missing, damaged, or of another study than its folder.
    """
    return read_dataset(path, "table")


def _to_array(values: Sequence[Any]) -> Any:
    """Convert values to an array of numbers, or of texts if one of them is no number."""
    if all(value is None or isinstance(value, int | float) for value in values):
        return np.array([np.nan if value is None else float(value) for value in values])
    texts = ("" if value is None else value for value in values)
    return np.array([t if isinstance(t, str) else repr(t) for t in texts], dtype=object)


def _pad(values: Sequence[Any], rows: Sequence[Row]) -> Any:
    """Pad rows of numbers by NaN to the longest row of the study (points, longest)."""
    longest = max(len(v) for row in rows for v in row["found"].values() if isinstance(v, list))
    padded = np.full((len(values), longest), np.nan)
    for k, value in enumerate(values):
        if isinstance(value, list):
            padded[k, : len(value)] = value
    return padded


def _coordinate(key: str) -> str:
    """Name of the coordinate of a key; NetCDF permits no spaces in it."""
    return _variable(key).replace(" ", "_")


def _variable(name: str) -> str:
    """Name of the variable of a finding; NetCDF permits no slash in it."""
    return name.replace("/", "|")
