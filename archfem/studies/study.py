"""`Study`: evaluates one function at all points, on processes of this machine or a cluster.

All study files have the same parts: one case or several, the values that vary, and the results to
compute for each. `Comparison` is the study of cases under the pairs of their suites.
"""

import json
from collections.abc import Generator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import xarray as xr

from archfem._files import temporary_folder
from archfem._validation import validate_arguments, validate_methods
from archfem.cases.case import Case, case_of
from archfem.cases.provenance import describe_version
from archfem.cases.run import Run, carry_out, replace_run
from archfem.cases.toml_file import check_table, read_tables, refuse_unknown
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.history import Ending
from archfem.errors import ArchfemError, Interrupted, InvalidInput, logger
from archfem.motion.motion import Motion
from archfem.studies.comparison import (
    Finding,
    build_findings,
    file_name,
    parse_search,
    rows_by_label,
)
from archfem.studies.evaluators import Evaluator, Findings, refuse_code
from archfem.studies.parameter_space import (
    PAIR_KEY,
    Axis,
    Point,
    changes_along,
    check_points,
    describe_changes,
    find_nearest_cases,
    group_by_model,
    list_structures,
    list_varied_keys,
    parameter_axes,
)
from archfem.studies.process_pool import Row, evaluate_points, make_row
from archfem.studies.result_store import Progress, Store, build_table, status
from archfem.studies.statements import Statement, column_label, read_statements, statement_table

STUDY_KEYS: Mapping[str, Any] = {
    **{"title": str, "case": str, "cases": dict, "set": [str], "pairs": [str]},
    **{"vary": (dict, list), "samples": dict, "compute": (str, dict), "scales": (bool, dict)},
    **{"columns": dict, "statements": [dict]},
}
STUDIED_CASE_KEYS: Mapping[str, Any] = {"case": str, "set": [str]}

# Error of points that Ctrl-C left
NOT_COMPUTED = "an interruption of the study"


@validate_methods
class Study:
    """Variations of an analysis or a case, and the function that is evaluated at each.

    Args:
        subject: analysis or case that is varied.
        vary: paths of values, each with a list of values (all combinations) or a frozen
            distribution of SciPy; or a list of such tables, one for each point. A path is that of a
            key in a case file, "motion.scale"; a keyword of `archfem.Analysis` stands for itself,
            "dt" for "analysis.dt". "suite.pair" varies the pair of the suite.
        compute: "history", "scales", "dead load", "limit", "assessment" or "rating"; a function of
            a case that returns a flat table of numbers and texts; or a table of `name` and options.
            By default "history", or "dead load" without a motion.
        motion: motion of an analysis, or in place of that of a case.
        samples: settings of the sampling, { "count": 64, "method": "sobol", "seed": 1 }.
        title: title; by default that of the case.

    Attributes:
        title: title.
        evaluator: function from a case to findings, with its options.
        axes: axes of the table of findings.
        points: points in the order of the table; the last axis varies fastest.
        samples: settings of the sampling, with the seed; None without distributions.

    Raises:
        InvalidInput: there are no points, or the first case, or one at the end of an axis, is
            invalid.

    Example:
        >>> column = af.Analysis(af.column(breadth=0.6, heights=[2.4]), fidelity="rigid")
        >>> motion = af.Motion.synthetic(duration=1.0, pga=1.0)
        >>> study = af.Study(column, vary={"dt": [0.005, 0.0025]}, motion=motion)
        >>> study.run(workers=1)["outcome"].values.tolist()
        ['no mechanism', 'no mechanism']
    """

    title: str
    evaluator: Evaluator
    axes: tuple[Axis, ...]
    points: tuple[Point, ...]
    samples: Mapping[str, Any] | None

    @validate_arguments
    def __init__(
        self,
        subject: Case | Analysis,
        vary: Any,
        compute: Any = None,
        *,
        motion: Motion | str | Path | Mapping[str, Any] | None = None,
        samples: Mapping[str, Any] | None = None,
        title: str | None = None,
    ) -> None:
        case, axes = case_of(subject, motion), parameter_axes(vary, samples)
        if compute is None:
            compute = "history" if case.has_motion else "dead load"
        self.title, self.evaluator, self.axes = title or case.title, Evaluator.of(compute), axes
        self.points = tuple(Point.of(case, each) for each in changes_along(axes))
        self.samples = samples
        self._check()

    @classmethod
    def of_points(
        cls,
        title: str,
        evaluator: Evaluator,
        axes: tuple[Axis, ...],
        points: tuple[Point, ...],
        samples: Mapping[str, Any] | None = None,
    ) -> Self:
        """Return a study of points that need not be variations of one case.

        Args:
            title: title.
            evaluator: function from a case to findings, with its options.
            axes: axes of the table of findings.
            points: points in the order of the table; the last axis varies fastest.
            samples: settings of the sampling, with the seed; None without distributions.
        """
        study = cls.__new__(cls)
        study.title, study.evaluator, study.axes = title, evaluator, axes
        study.points, study.samples = points, samples
        return study

    @classmethod
    def read(cls, path: str | Path, changes: Sequence[str] = (), *, own_code: bool = False) -> Self:
        """Read a study from a TOML file: its cases, varied values and computed results.

        Args:
            path: path of a file with `case`, the file of a case, or with tables [cases."name"] of
                `case`, a file, and `set`, a list of "section.key=value"; above the tables `case` is
                that of tables without one, and `set` changes all cases, before their own. `vary`,
                `samples` and `compute` are as for a `Study`; with [cases] nothing need vary, and
                `compute` is "comparison" by default. Histories, scales and comparisons of cases
                with a suite are computed under each of its pairs, or those that `pairs` names.
                `scales` is the search for scales in a comparison: true, or a table of `precision`
                and `range`.
            changes: changes to every case, "section.key=value".
            own_code: whether `compute` may name a function of a module of the user. By default it
                may not, since the file may come from anywhere and the module would run.

        Returns:
            The study; a `Comparison` if the file computes one.

        Raises:
            InvalidInput: the file or one of its cases is invalid; the message names the file.
        """
        path = Path(path)
        tables = read_tables(path, "study")
        try:
            study = _read_study(tables, path, changes, own_code)
            if not isinstance(study, cls):
                raise InvalidInput(f"it computes no {cls.__name__.lower()}: read it by Study.read")
            study._check()
        except ArchfemError as error:
            raise type(error)(f"{path}: {error}") from error
        return study

    def run(
        self, folder: str | Path | None = None, *, workers: int | None = None, client: Any = None
    ) -> xr.Dataset:
        """Evaluate all points that are not stored in the folder yet.

        Args:
            folder: folder for the row of each finished point, and for the table as NetCDF and CSV,
                and as Parquet and Excel if `archfem[tables]` is installed. A stored row is used
                again for the same case, files, function and version of archfem; title and
                pictures of the case do not count. None stores nothing.
            workers: number of processes on this machine, one thread each; by default the number of
                cores; 1 computes in this process.
            client: client of Dask distributed, or the address of a scheduler, instead of processes.

        Returns:
            Table of the findings over the axes of the study, and `error`, the text of the error of
            a point, or "".

        Raises:
            InvalidInput: another command runs in the folder, `workers` is invalid, or no scheduler
                answers.
            StudyStopped: the disk is full, the scheduler was lost, or no worker starts; finished
                points are kept.
            KeyboardInterrupt: on Ctrl-C; finished points are kept, and their table. `last` of an
                `Interrupted` is that table, once a point has finished.
        """
        store = None if folder is None else Store(Path(folder))
        with ExitStack() as stack:
            if store is None:
                shared = stack.enter_context(temporary_folder()) / "shared"
            else:
                stack.enter_context(store.lock())
                shared = store.shared.resolve()
            rows, interruption = self._collect_rows(store, shared, workers, client)
            table = build_table(self.axes, rows, self.evaluator.units, self._attributes)
            if store is not None:
                store.write_table(table)
        if interruption is not None:
            raise Interrupted(table) from interruption
        return table

    status = staticmethod(status)

    @property
    def _attributes(self) -> dict[str, Any]:
        """Attributes of the table."""
        attributes = {"title": self.title, "archfem": describe_version()}
        attributes["varied"] = "; ".join(list_varied_keys(self.points))
        if [axis.keys[0] for axis in self.axes] == ["case"]:
            cases = (name for name, *_ in self.axes[0].rows)
            attributes["nearest"] = json.dumps(find_nearest_cases(cases, self.points))
        return attributes | {f"samples {key}": value for key, value in (self.samples or {}).items()}

    def _collect_rows(
        self, store: Store | None, shared: Path, workers: int | None, client: Any
    ) -> tuple[list[Row], KeyboardInterrupt | None]:
        """Return the rows of all points, from the store if they are there, and Ctrl-C if it came.

        `shared` is for their parts.
        """
        rows, interruption = dict[str, Row](), None
        digests = [str(number) for number in range(len(self.points))]
        if store is not None:
            digests = [self.evaluator.digest(point) for point in self.points]
            plan = {**self._attributes, "points": digests}
            store.write_plan({**plan, "structures": list_structures(self.points)})
            rows = store.load_rows(digests)
            _log_stored(store, digests, rows)
        # points of the same digest are evaluated once
        numbers = {digest: number for number, digest in reversed(list(enumerate(digests)))}
        missing = sorted(number for digest, number in numbers.items() if digest not in rows)
        points = group_by_model([(number, self.points[number]) for number in missing])
        failed = sum(bool(row["error"]) for row in rows.values())
        progress = Progress(len(numbers), len(rows), failed, store, shared, self.title)
        log = None if store is None else store.log
        evaluation = self._evaluate(points, shared, client, workers=workers, log=log)
        # closed on Ctrl-C too, which ends the workers
        try:
            with closing(progress), closing(evaluation) as finished:
                for number, row in finished:
                    rows[digests[number]] = row
                    if store is not None:
                        self._store(store, number, digests[number], row)
                    scales = row["found"].get("scale")  # of the runs of an IDA
                    runs = len(scales) if isinstance(scales, list) else 0
                    progress.add(failed=bool(row["error"]), runs=runs)
        except KeyboardInterrupt as error:
            if not rows:
                raise
            interruption, left = error, make_row({}, NOT_COMPUTED)
            rows = {digest: rows.get(digest, left) for digest in digests}
        return [rows[digest] for digest in digests], interruption

    def _store(self, store: Store, number: int, digest: str, row: Row) -> None:
        """Write the row of a point, unless one of its files has changed during the study."""
        if self.evaluator.digest(self.points[number]) == digest:
            store.write_row(digest, row)
        else:
            logger.warning("point %d: a file it reads was changed meanwhile: not kept", number)

    def _evaluate(
        self, points: list[tuple[int, Point]], shared: Path, client: Any, **options: Any
    ) -> Generator[tuple[int, Row], None, None]:
        """Yield the rows of points as they finish; options are those of `evaluate_points`."""
        if not points:
            return
        if client is not None:
            try:
                from archfem.studies.cluster import evaluate_on_cluster
            except ModuleNotFoundError as error:
                raise InvalidInput(
                    f"a scheduler needs {error.name}: pip install 'archfem[cluster]'"
                ) from error
            yield from evaluate_on_cluster(points, self.evaluator, client, shared)
            return
        yield from evaluate_points(points, self.evaluator, shared=shared, **options)

    def _check(self) -> None:
        """Make the cases at the ends of each axis, so that errors are raised before the study."""
        for number in check_points(self.axes):
            point = self.points[number]
            try:
                _ = point.case
            except ArchfemError as error:
                raise InvalidInput(
                    f"the point of {describe_changes(point)} is no case: {error}"
                ) from error


@validate_methods
class Comparison(Study):
    """Study of cases under each pair of their suites; `study_table` is its table.

    Attributes:
        cases: cases by name.
        pairs: pairs of the suites that are run; None for all.
        columns: names of the changes that all cases get in turn.
        statements: statements of a publication that the findings answer.
    """

    cases: Mapping[str, Case]
    pairs: tuple[str, ...] | None
    columns: tuple[str, ...]
    statements: tuple[Statement, ...]

    @property
    def scales(self) -> dict[str, Any] | None:
        """Options of `mechanism_scales`, which searches scales of whole motions; None for none."""
        return self.evaluator.options["scales"]

    @property
    def reduction(self) -> float:
        """Factor R of the first case's suite [-]."""
        suite = next(iter(self.cases.values())).suite or {}
        return float(suite.get("reduction", 1.0) / suite.get("scale", 1.0))

    def findings(self, table: xr.Dataset) -> dict[str, Finding]:
        """Return the findings of each case, and of each of its variations.

        Args:
            table: table that `run` returned.

        Returns:
            Findings by name; without cases of which a point ended in an error.
        """
        return build_findings(self._labels, self.points, table, self.scales)

    def answers(self, table: xr.Dataset) -> str:
        """Return the table of the statements, each beside the finding of every column.

        Args:
            table: table that `run` returned.
        """
        rows = rows_by_label(self._labels, self.points, table)
        return statement_table(self.statements, self.columns, rows)

    @property
    def _labels(self) -> list[str]:
        """Name of the case of each point, with its changes."""
        cases = self.axes[0].rows if self.axes[0].keys[0] == "case" else ((),)
        variations = len(self.points) // len(cases)
        labels = []
        for number, point in enumerate(self.points):
            own = replace(point, changes=tuple(c for c in point.changes if c[0] != PAIR_KEY))
            changes = [describe_changes(own)] if own.changes else []
            labels.append(", ".join([*cases[number // variations][:1], *changes]) or self.title)
        return labels

    def _check(self) -> None:
        """Check as of any study, and refuse names that would share a file of findings."""
        names: dict[str, str] = {}
        for name in dict.fromkeys(self._labels):
            file = file_name(name)
            if not file or names.setdefault(file, name) != name:
                raise InvalidInput(
                    f"'{name}' names a file of results too, and '{file}.json' is not its own: let "
                    "names differ in letters and digits"
                )
        super()._check()


def _read_study(
    tables: Mapping[str, Any], path: Path, changes: Sequence[str], own_code: bool
) -> Study:
    """Return the study of the tables of a file."""
    if {"structure", "base"} & set(tables):
        raise InvalidInput('this is a case: name it in the file of a study, case = "CASE.toml"')
    refuse_unknown(tables, STUDY_KEYS)
    settings = check_table(tables, STUDY_KEYS, "study")
    missing = [] if {"case", "cases"} & set(settings) else ["case"]
    missing += [] if {"cases", "vary"} & set(settings) else ["vary"]
    if missing:
        raise InvalidInput(
            f'it says nothing of {missing[0]}: write case = "file.toml" and vary, keys of the case '
            'with lists of values or distributions; or tables [cases."name"] of several cases'
        )
    asked = _parse_evaluator(settings, own_code)
    cases = _read_cases(settings, path.parent, changes)
    vary, samples = settings.get("vary"), settings.get("samples")
    varied = () if vary is None else parameter_axes(vary, samples)
    # findings of one motion: a case with a suite is evaluated under each of its pairs
    of_motions = asked.name in ("history", "scales", "comparison")
    by_pair = of_motions and all(PAIR_KEY not in axis.keys for axis in varied)
    rows = _pair_cases(cases, settings.get("pairs"), asked, by_pair)
    if any(axis.name == "point" for axis in varied):  # the name of the cases with their pairs
        varied = tuple(replace(axis, name="variation") for axis in varied) if rows[1:] else varied
    points = tuple(
        Point.of(cases[name], [*((PAIR_KEY, p) for p in pair), *changed])
        for name, *pair in rows
        for changed in changes_along(varied)
    )
    title, axes = settings.get("title", path.stem), (*_case_axes(rows, settings), *varied)
    if asked.name != "comparison":
        return Study.of_points(title, asked, axes, points, samples)
    comparison = Comparison.of_points(title, asked, axes, points, samples)
    comparison.cases = cases
    comparison.columns = tuple(settings.get("columns", ("",)))
    comparison.statements = read_statements(settings)
    comparison.pairs = tuple(settings["pairs"]) if "pairs" in settings else None
    return comparison


def _parse_evaluator(settings: Mapping[str, Any], own_code: bool) -> Evaluator:
    """Return the function that a study file computes."""
    find = settings.get("compute", "comparison" if "cases" in settings else "history")
    if not own_code:
        refuse_code(find)
    asked = Evaluator.of(find)
    if asked.name == "comparison":
        scales = settings.get("scales", asked.options.get("scales") or False)
        stated = bool(settings.get("statements"))
        return Evaluator(asked.find, {"scales": parse_search(scales), "statements": stated})
    if "scales" in settings:
        raise InvalidInput(
            "scales is the search of a comparison: take it out, or compute = { name = 'scales', "
            "precision = 0.1, between = [0.2, 2.0] }"
        )
    if "pairs" in settings and asked.name in ("dead load", "limit", "assessment", "rating"):
        raise InvalidInput(f"pairs are motions, and compute = {find!r} needs none: take pairs out")
    return asked


def _read_cases(
    settings: Mapping[str, Any], folder: Path, changes: Sequence[str]
) -> dict[str, Case]:
    """Read the cases of a study file by name; a single case has none."""
    common = {key: settings[key] for key in ("case",) if key in settings}
    tables = settings.get("cases", {"": common})
    columns = settings.get("columns", {"": []})
    columns = check_table(columns, {key: [str] for key in columns}, "columns")
    cases = {}
    for name, table in tables.items():
        case = common | check_table(table, STUDIED_CASE_KEYS, f"cases.{name}")
        if "case" not in case:
            raise InvalidInput(f"cases.{name} names no case file")
        for column, own in columns.items():
            all_changes = [*settings.get("set", []), *own, *case.get("set", []), *changes]
            label = column_label(name, column)
            cases[label] = Case.read(folder / case["case"], all_changes)
    if not cases:
        raise InvalidInput('it has no cases: write [cases."name"] with case = "file.toml"')
    return cases


def _pair_cases(
    cases: Mapping[str, Case], pairs: Sequence[str] | None, asked: Evaluator, by_pair: bool
) -> list[tuple[str, ...]]:
    """Return name and pair of each case and motion; names alone if no pairs are run."""
    available = {name: list((case.suite or {}).get("pairs", ())) for name, case in cases.items()}
    known = sorted({pair for own in available.values() for pair in own})
    if unknown := [pair for pair in pairs or () if pair not in known]:
        raise InvalidInput(f"no case has the pairs {unknown}, but {known}")
    rows: list[tuple[str, ...]] = []
    for name, own in available.items():
        chosen = [pair for pair in own if pairs is None or pair in pairs]
        if asked.name == "comparison" and not own and not cases[name].limit.live:
            raise InvalidInput(
                f"the case of '{name}' has no [suite] to compare under, and no [limit]: "
                'give it one, or say what to compute, such as compute = "limit"'
            )
        if own and not chosen:
            raise InvalidInput(f"'{name}' has none of the pairs {pairs}, but {own}")
        by_own = by_pair or pairs is not None
        rows += [(name, pair) for pair in chosen] if by_own and chosen else [(name,)]
    return rows


def _case_axes(rows: Sequence[tuple[str, ...]], settings: Mapping[str, Any]) -> tuple[Axis, ...]:
    """Return the axis of the cases and pairs of a study file; none for a single motion."""
    paired = any(len(row) == 2 for row in rows)
    if "cases" in settings:
        if not paired:
            return (Axis("case", ("case",), tuple(rows)),)
        # a case without a suite has the motion of its own
        return (Axis("point", ("case", "pair"), tuple((*row, None)[:2] for row in rows)),)
    if len(rows) == 1 and "pairs" not in settings:
        return ()
    return (Axis(PAIR_KEY, (PAIR_KEY,), tuple((pair,) for _, pair in rows)),)


def _log_stored(store: Store, digests: Sequence[str], rows: Mapping[str, Row]) -> None:
    """Log the number of stored points, of this study and of others."""
    if rows:
        logger.info("%d of %d points were finished before", len(rows), len(digests))
    if others := len(store.digests() - set(digests)):
        text = "%s has %d points of other cases, findings or versions: they are left alone"
        logger.warning(text, store.folder, others)


@validate_arguments
def run_pairs(case: Case, folder: str | Path, *, workers: int | None = None) -> list[str]:
    """Run the pairs of a suite whose histories are not in the folder yet.

    `run_case(case, folder)` then loads them, and runs again those that are incomplete.

    Args:
        case: case with a suite.
        folder: folder of the histories.
        workers: number of processes, as for `Study.run`.

    Returns:
        How the run of each pair ended; the text of an error if there is no history.

    Raises:
        InvalidInput: the case has no suite, or selects its model by one pair for all.
    """
    with replace_run(case, Path(folder)) as draft:
        return compute_pairs(case, draft, workers)


def compute_pairs(case: Case, draft: Path, workers: int | None = None) -> list[str]:
    """Run the pairs of a suite as `run_pairs` does, into the draft of a result folder."""
    if case.suite is None or case.analysis.selects_model:
        raise InvalidInput(
            "pairs run in parallel only if a case has a [suite] and names its model: "
            "model.fidelity = 'auto' selects one by the first pair for all"
        )
    pairs = list(case.suite["pairs"])
    find = {"name": save_pair, "folder": str(draft.resolve())}
    study = Study(case, {PAIR_KEY: pairs}, find, title="pairs of the suite")
    table = study.run(workers=workers)
    endings = table["ended"].values if "ended" in table else [""] * len(pairs)
    return [a or b for a, b in zip(table["error"].values.tolist(), endings, strict=True)]


def save_pair(case: Case, folder: str) -> Findings:
    """Run the only pair of a case, and save its history."""
    (run,) = (result for result in carry_out(case, Path(folder)) if isinstance(result, Run))
    if run.history.ending is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    return {"ended": str(run.history.ending)}
