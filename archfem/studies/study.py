"""`Study`: points, and one function from a case to findings, on what there is to compute with."""

import logging
import os
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr
from threadpoolctl import threadpool_limits

from archfem._validation import check_integer
from archfem.cases.case import Case
from archfem.cases.provenance import describe_version
from archfem.cases.toml_file import check_table, refuse_unknown
from archfem.errors import ArchfemError, InvalidInput
from archfem.studies.comparison import Comparison, study_tables
from archfem.studies.evaluators import Evaluator, refuse_code
from archfem.studies.parameter_space import (
    Axis,
    Point,
    group_by_model,
    changes_along,
    check_points,
    parameter_axes,
)
from archfem.studies.process_pool import Row, evaluate_on_processes, evaluate_serially
from archfem.studies.result_store import Progress, Store, load_tables, status, table, write_table

logger = logging.getLogger("archfem")

STUDY = {
    "title": str,
    "case": str,
    "set": [str],
    "vary": (dict, list),
    "samples": dict,
    "compute": (str, dict),
}

LOG = "workers.log"


@dataclass(frozen=True, eq=False)
class Study:
    """Points, each a case, and what is asked of each.

    Attributes:
        title: in words.
        asked: a function from a case to findings, with its options.
        axes: of the table of findings.
        points: in the order of the table, the last axis fastest.
        samples: how distributions were sampled, seed included; None where there are none.
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
        """Return a study of one case and what is to differ from it.

        Args:
            case: from which points differ.
            over: keys of the case, "section.key", each with a list of values (all combinations) or
                a frozen distribution of SciPy; or a list of such tables, one for each point.
                "suite.pair" goes over pairs of the suite.
            find: "history", "scales", "dead load", "limit", a function of a case that gives a flat
                table of numbers and words, or a table of `name` and options.
            samples: how distributions are sampled, { "count": 64, "method": "sobol", "seed": 1 }.
            title: in words; by default that of the case.

        Returns:
            The study, of whose cases the first, and those at the end of each axis, have been made.

        Raises:
            InvalidInput: there are no points, or a point's case cannot be meant.
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
        """Read a study: a TOML file with a case and what it goes over, or with cases side by side.

        Args:
            path: with `case`, a file; `vary`, `samples` and `compute`, as `over`, `samples`
                and `find` of `of`; and `set`, a list
                of "section.key=value". Or with a table [cases."name"] for each of some cases, as
                for `Comparison.read`.
            changes: made to every case.
            own_code: whether `compute` may name a function of a module, which is code that runs;
                without it only our own are taken, since a file may come from anywhere.

        Returns:
            The study.

        Raises:
            InvalidInput: the file or one of its cases cannot be meant.
        """
        path = Path(path)
        given = study_tables(path)
        if "cases" in given or not {"case", "vary"} & set(given):
            compared = Comparison.read(path, changes)
            return cls(compared.title, compared.asked, (compared.axis,), compared.points)
        refuse_unknown(given, STUDY)
        given = check_table(given, STUDY, "study")
        if missing := [key for key in ("case", "vary") if key not in given]:
            raise InvalidInput(
                f'{path} says nothing of {missing[0]}: write case = "file.toml", and vary, keys of '
                "the case with lists of values or distributions"
            )
        find = given.get("compute", "history")
        if not own_code:
            refuse_code(find)
        case = Case.read(path.parent / given["case"], [*given.get("set", []), *changes])
        return cls.of(
            case,
            given["vary"],
            find,
            samples=given.get("samples"),
            title=given.get("title", path.stem),
        )

    def run(
        self, folder: str | Path | None = None, *, workers: int | None = None, client: Any = None
    ) -> xr.Dataset:
        """Find what is asked of every point of which it is not known yet.

        Args:
            folder: in which each finished point is kept, under what tells its case, the files it
                reads, the version of archfem and what is asked from all others; and the table of
                all, as NetCDF, CSV, and Parquet where pyarrow is there. None keeps nothing.
            workers: processes of this machine, one thread each; by default one a core; 1 computes
                in this process.
            client: of Dask distributed, or the address of its scheduler, in place of processes.

        Returns:
            The table: a variable for each finding over the study's axes, and `error`, the words of
            what ended a point, empty where nothing did.

        Raises:
            InvalidInput: another driver is at work in the folder, or workers or scheduler cannot be
                meant.
            StudyStopped: the disk is full or the scheduler was lost; what was finished is kept.
            KeyboardInterrupt: on Ctrl-C; likewise.
        """
        store = None if folder is None else Store(Path(folder))
        with nullcontext() if store is None else store.locked():
            rows = self._rows(store, workers, client)
            found = table(self.axes, rows, self._attributes)
            if store is not None:
                write_table(found, store.folder)
        return found

    status = staticmethod(status)

    @property
    def _attributes(self) -> dict[str, Any]:
        told = {"title": self.title, "archfem": describe_version()}
        return told | {f"samples {key}": value for key, value in (self.samples or {}).items()}

    def _rows(self, store: Store | None, workers: int | None, client: Any) -> list[Row]:
        """Rows of all points, those that are known taken from the store."""
        if store is None:
            digests = [str(number) for number in range(len(self.points))]
            rows: dict[str, Row] = {}
        else:
            digests = self._digests()
            store.keep_plan({**self._attributes, "points": digests})
            rows = store.finished(digests)
            self._tell(store, digests, rows)
        wanted = dict(zip(reversed(digests), reversed(range(len(digests))), strict=True))
        left = [number for digest, number in wanted.items() if digest not in rows]
        missing = group_by_model([(number, self.points[number]) for number in reversed(left)])
        failed = sum(bool(row["error"]) for row in rows.values())
        folder = None if store is None else store.folder
        progress = Progress(len(wanted), len(rows), failed, folder)
        with closing(progress), closing(self._answers(missing, folder, workers, client)) as found:
            for number, row in found:
                rows[digests[number]] = row
                if store is not None:
                    self._keep(store, number, digests[number], row)
                progress.add(failed=bool(row["error"]))
        return [rows[digest] for digest in digests]

    def _keep(self, store: Store, number: int, digest: str, row: Row) -> None:
        """Keep the row of a point, unless a file was changed since the study was begun."""
        if self.points[number].digest(self.asked.text) == digest:
            store.keep(digest, row)
        else:
            logger.warning("point %d: a file it reads was changed meanwhile: not kept", number)

    def _answers(
        self,
        points: list[tuple[int, Point]],
        folder: Path | None,
        workers: int | None,
        client: Any,
    ) -> Generator[tuple[int, Row], None, None]:
        """Rows of some points by number, as they are finished."""
        if not points:
            return
        if client is not None:
            yield from _on_cluster(points, self.asked, client)
            return
        count = check_integer(
            len(os.sched_getaffinity(0)) if workers is None else workers, "workers"
        )
        if count > 1 and len(points) > 1:
            log = None if folder is None else folder / LOG
            yield from evaluate_on_processes(points, self.asked, count, log, load_tables)
            return
        with threadpool_limits(limits=1):
            yield from evaluate_serially(points, self.asked)

    def _digests(self) -> list[str]:
        """What tells each point from all others."""
        asked = self.asked.text
        return [point.digest(asked) for point in self.points]

    def _tell(self, store: Store, digests: Sequence[str], rows: Mapping[str, Row]) -> None:
        """Say what is in the folder already."""
        if rows:
            logger.info("%d of %d points were finished before", len(rows), len(digests))
        if others := len(store.digests() - set(digests)):
            logger.warning(
                "%s has %d points of other cases, findings or versions: they are left alone",
                store.folder,
                others,
            )

    def _check(self) -> None:
        """Make the cases at the ends of each axis: what cannot be meant is found now."""
        for number in check_points(self.axes):
            point = self.points[number]
            try:
                _ = point.case
            except ArchfemError as error:
                told = ", ".join(f"{key} = {value!r}" for key, value in point.changes)
                raise InvalidInput(f"the point of {told} is no case: {error}") from error


def _on_cluster(
    points: list[tuple[int, Point]], asked: Evaluator, client: Any
) -> Iterator[tuple[int, Row]]:
    """Answer points on a cluster, which few have installed what it takes for."""
    try:
        from archfem.studies.cluster import evaluate_on_cluster
    except ModuleNotFoundError as error:
        raise InvalidInput(
            f"a scheduler needs {error.name}: pip install 'archfem[cluster]'"
        ) from error
    yield from evaluate_on_cluster(points, asked, client)
