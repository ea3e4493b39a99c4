"""`Study`: evaluates one function at all points, on processes of this machine or a cluster."""

import logging
import os
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr
from threadpoolctl import threadpool_limits

from archfem._files import hash_json
from archfem._validation import check_integer, validate_methods
from archfem.cases.case import Case
from archfem.cases.provenance import describe_version
from archfem.cases.toml_file import check_table, refuse_unknown
from archfem.errors import ArchfemError, InvalidInput
from archfem.studies.comparison import Comparison, read_study_tables
from archfem.studies.evaluators import Evaluator, refuse_code
from archfem.studies.parameter_space import (
    Axis,
    Point,
    changes_along,
    check_points,
    group_by_model,
    parameter_axes,
)
from archfem.studies.process_pool import Row, evaluate_on_processes, evaluate_serially
from archfem.studies.result_store import (
    Progress,
    Store,
    build_table,
    load_table_libraries,
    status,
    write_table,
)

logger = logging.getLogger("archfem")


@validate_methods
@dataclass(frozen=True, eq=False)
class Study:
    """Points, each a case, and the function that is evaluated at each.

    Attributes:
        title: title.
        asked: evaluator, a function from a case to findings with its options.
        axes: axes of the table of findings.
        points: points in the order of the table; the last axis varies fastest.
        samples: settings of the sampling, with the seed; None without distributions.
    """

    title: str
    asked: Evaluator
    axes: tuple[Axis, ...]
    points: tuple[Point, ...]
    samples: Mapping[str, Any] | None = None

    @classmethod
    def of(
        cls,
        case: Case,
        over: Any,
        find: Any = "history",
        *,
        samples: Mapping[str, Any] | None = None,
        title: str | None = None,
    ) -> "Study":
        """Return a study of one case and variations of it.

        Args:
            case: case that is varied.
            over: keys of the case, "section.key", each with a list of values (all combinations) or
                a frozen distribution of SciPy; or a list of such tables, one for each point.
                "suite.pair" varies the pair of the suite.
            find: "history", "scales", "dead load", "limit", a function of a case that returns a
                flat table of numbers and texts, or a table of `name` and options.
            samples: settings of the sampling, { "count": 64, "method": "sobol", "seed": 1 }.
            title: title; by default that of the case.

        Returns:
            The study. The first case, and those at the ends of each axis, have been checked.

        Raises:
            InvalidInput: there are no points, or the case of a point is invalid.
        """
        axes = parameter_axes(over, samples)
        points = tuple(
            Point(case.settings, case.folder, changes) for changes in changes_along(axes)
        )
        study = cls(title or case.title, Evaluator.of(find), axes, points, samples)
        study._check()
        return study

    @classmethod
    def read(
        cls, path: str | Path, changes: Sequence[str] = (), *, own_code: bool = False
    ) -> "Study":
        """Read a study from a TOML file, which varies one case or compares several.

        Args:
            path: path of a file with `case`, the file of a case; `vary`, `samples` and `compute`,
                as `over`, `samples` and `find` of `Study.of`; and `set`, a list of
                "section.key=value". Or with tables [cases."name"], as for `Comparison.read`.
            changes: changes to every case, "section.key=value".
            own_code: whether `compute` may name a function of a module of the user. By default it
                may not, since the file may come from anywhere and the module would run.

        Returns:
            The study.

        Raises:
            InvalidInput: the file or one of its cases is invalid.
        """
        path = Path(path)
        settings = read_study_tables(path)
        if "cases" in settings or not {"case", "vary"} & set(settings):
            cases = Comparison.read(path, changes)
            return cls(cases.title, cases.evaluator, (cases.axis,), cases.points)
        kinds = {"title": str, "case": str, "set": [str], "vary": (dict, list)}
        kinds |= {"samples": dict, "compute": (str, dict)}
        refuse_unknown(settings, kinds)
        settings = check_table(settings, kinds, "study")
        if missing := [key for key in ("case", "vary") if key not in settings]:
            raise InvalidInput(
                f'{path} says nothing of {missing[0]}: write case = "file.toml", and vary, keys of '
                "the case with lists of values or distributions"
            )
        find = settings.get("compute", "history")
        if not own_code:
            refuse_code(find)
        case = Case.read(path.parent / settings["case"], [*settings.get("set", []), *changes])
        title, samples = settings.get("title", path.stem), settings.get("samples")
        return cls.of(case, settings["vary"], find, samples=samples, title=title)

    def run(
        self, folder: str | Path | None = None, *, workers: int | None = None, client: Any = None
    ) -> xr.Dataset:
        """Evaluate all points that are not stored in the folder yet.

        Args:
            folder: folder for the row of each finished point, and for the table as NetCDF, CSV, and
                Parquet if pyarrow is installed. A stored row is used again for the same case,
                files, function and version of archfem. None stores nothing.
            workers: number of processes on this machine, one thread each; by default the number of
                cores; 1 computes in this process.
            client: client of Dask distributed, or the address of a scheduler, instead of processes.

        Returns:
            Table of the findings over the axes of the study, and `error`, the text of the error of
            a point, or "".

        Raises:
            InvalidInput: another driver runs in the folder, `workers` is invalid, or no scheduler
                answers.
            StudyStopped: the disk is full, the scheduler was lost, or no worker starts; finished
                points are kept.
            KeyboardInterrupt: on Ctrl-C; finished points are kept.
        """
        store = None if folder is None else Store(Path(folder))
        with nullcontext() if store is None else store.lock():
            rows = self._collect_rows(store, workers, client)
            table = build_table(self.axes, rows, self._attributes)
            if store is not None:
                write_table(table, store.folder, hash_json(store.read_plan()["points"]))
        return table

    status = staticmethod(status)

    @property
    def _attributes(self) -> dict[str, Any]:
        """Attributes of the table."""
        attributes = {"title": self.title, "archfem": describe_version()}
        return attributes | {f"samples {key}": value for key, value in (self.samples or {}).items()}

    def _collect_rows(self, store: Store | None, workers: int | None, client: Any) -> list[Row]:
        """Rows of all points, from the store if they are there."""
        rows: dict[str, Row] = {}
        digests = [str(number) for number in range(len(self.points))]
        if store is not None:
            digests = [point.digest(self.asked.text) for point in self.points]
            store.write_plan({**self._attributes, "points": digests})
            rows = store.load_rows(digests)
            _log_stored(store, digests, rows)
        # points of the same digest are evaluated once
        numbers = {digest: number for number, digest in reversed(list(enumerate(digests)))}
        missing = sorted(number for digest, number in numbers.items() if digest not in rows)
        points = group_by_model([(number, self.points[number]) for number in missing])
        progress = Progress(
            len(numbers), len(rows), sum(bool(row["error"]) for row in rows.values()), store
        )
        log = None if store is None else store.folder / "workers.log"
        # closed on Ctrl-C too, which ends the workers
        with closing(progress), closing(self._evaluate(points, log, workers, client)) as finished:
            for number, row in finished:
                rows[digests[number]] = row
                if store is not None:
                    self._store(store, number, digests[number], row)
                progress.add(failed=bool(row["error"]))
        return [rows[digest] for digest in digests]

    def _store(self, store: Store, number: int, digest: str, row: Row) -> None:
        """Write the row of a point, unless one of its files has changed during the study."""
        if self.points[number].digest(self.asked.text) == digest:
            store.write_row(digest, row)
        else:
            logger.warning("point %d: a file it reads was changed meanwhile: not kept", number)

    def _evaluate(
        self, points: list[tuple[int, Point]], log: Path | None, workers: int | None, client: Any
    ) -> Generator[tuple[int, Row], None, None]:
        """Yield the rows of points as they finish."""
        if not points:
            return
        if client is not None:
            try:
                from archfem.studies.cluster import evaluate_on_cluster
            except ModuleNotFoundError as error:
                raise InvalidInput(
                    f"a scheduler needs {error.name}: pip install 'archfem[cluster]'"
                ) from error
            yield from evaluate_on_cluster(points, self.asked, client)
            return
        workers = len(os.sched_getaffinity(0)) if workers is None else workers
        if check_integer(workers, "workers") > 1 and len(points) > 1:
            load = load_table_libraries
            yield from evaluate_on_processes(points, self.asked, workers, log, load)
            return
        with threadpool_limits(limits=1):
            yield from evaluate_serially(points, self.asked)

    def _check(self) -> None:
        """Make the cases at the ends of each axis, so that errors are raised before the study."""
        for number in check_points(self.axes):
            point = self.points[number]
            try:
                _ = point.case
            except ArchfemError as error:
                changes = ", ".join(f"{key} = {value!r}" for key, value in point.changes)
                raise InvalidInput(f"the point of {changes} is no case: {error}") from error


def _log_stored(store: Store, digests: Sequence[str], rows: Mapping[str, Row]) -> None:
    """Log the number of stored points, of this study and of others."""
    if rows:
        logger.info("%d of %d points were finished before", len(rows), len(digests))
    if others := len(store.digests() - set(digests)):
        logger.warning(
            "%s has %d points of other cases, findings or versions: they are left alone",
            store.folder,
            others,
        )
