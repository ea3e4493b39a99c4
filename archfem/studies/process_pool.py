"""Evaluation of points on processes of this machine, one point at a time on one thread.

Workers are forked by the fork server of `multiprocessing`, which has loaded once what all of them
need (`fork_server`). A free worker takes the next point of the model that it has built, and after
these a model that no other worker has, so that each model is built once. A worker that dies is
replaced.
"""

import atexit
import os
import pickle
import re
import signal
import sys
import threading
from collections import Counter, deque
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from itertools import islice
from multiprocessing import (
    Pipe,
    current_process,
    forkserver,
    get_all_start_methods,
    get_context,
    parent_process,
)
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from archfem import _display, _numba
from archfem._display import Reached
from archfem._files import temporary_folder
from archfem._validation import check_integer
from archfem.cases.provenance import describe_version
from archfem.errors import ArchfemError, InvalidInput, StudyStopped, keep_warnings, logger
from archfem.studies.evaluators import Evaluator
from archfem.studies.parameter_space import PAIR_KEY, StudyPoint, describe_changes
from archfem.studies.shared_results import share_results

# Evaluated point: `found`, a flat table; `error`, its text or ""; `ours`, whether the error is one
# of archfem's, which the same case would raise again
Row = dict[str, Any]

# A point is reported as failed when so many workers have died while they computed it.
MAX_DEATHS_PER_POINT = 3

# Windows starts each worker anew
START_METHOD = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"

_evaluation_lock = threading.Lock()

# How far workers are, by the number of their points
reached: dict[int, Reached] = {}


def make_row(found: dict[str, Any], error: str = "", *, ours: bool = True) -> Row:
    """Return the row of a point."""
    return {"found": found, "error": error, "ours": ours}


def evaluate_point(point: StudyPoint, evaluator: Evaluator) -> Row:
    """Return the row of a point, also if its evaluation raises an error."""
    try:
        return make_row(evaluator.evaluate(point.case))
    except ArchfemError as error:
        return make_row({}, f"{type(error).__name__}: {error}")
    except Exception as error:  # of a user's function or a library: the other points go on
        return make_row({}, f"{type(error).__name__}: {error}", ours=False)


def evaluate_batch(
    points: Sequence[tuple[int, StudyPoint]], evaluator: Evaluator, version: str, shared: Path
) -> tuple[str, list[tuple[int, Row]]]:
    """Evaluate points in a process that may have threads; no rows if its version differs."""
    own_version = describe_version()
    if own_version != version:
        return own_version, []
    # the cache between points is not thread-safe
    with _evaluation_lock, threadpool_limits(limits=1), share_results(shared):
        return own_version, list(evaluate_serially(points, evaluator))


def evaluate_points(
    points: Sequence[tuple[int, StudyPoint]],
    evaluator: Evaluator,
    workers: int | None = None,
    log: Path | None = None,
    shared: Path | None = None,
) -> Iterator[tuple[int, Row]]:
    """Evaluate points on a number of processes, by default one a core; on this one if it is 1."""
    workers = count_cores() if workers is None else workers
    if check_integer(workers, "workers") == 1 or len(points) < 2:
        with threadpool_limits(limits=1), share_results(shared):
            yield from evaluate_serially(points, evaluator)
        return
    pool = WorkerPool(TaskQueue(points, evaluator), workers, str(log or os.devnull), shared)
    try:
        yield from pool.rows()
    finally:
        pool.close()


def count_cores() -> int:
    """Return the number of cores that this process may use; macOS and Windows know all cores."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def evaluate_serially(
    points: Sequence[tuple[int, StudyPoint]], evaluator: Evaluator
) -> Iterator[tuple[int, Row]]:
    """Evaluate points in this process, one after another; a repeated warning is logged once."""
    repeated = RepeatedWarnings()
    for number, point in points:
        with keep_warnings() as warnings:
            row = evaluate_point(point, evaluator)
        repeated.log(warnings)
        yield number, row
    repeated.log_count()


class RepeatedWarnings:
    """Warnings of many runs, of which each kind is logged once."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()

    def log(self, messages: Sequence[str]) -> None:
        """Log the warnings that are the first of their kind."""
        for message in messages:
            kind = re.sub(r"[\d.]+(e[-+]\d+)?", "#", message)  # numbers differ by the run
            self._counts[kind] += 1
            if self._counts[kind] == 1:
                logger.warning("%s", message)

    def log_count(self) -> None:
        """Log how many warnings were not repeated."""
        if repeated := self._counts.total() - len(self._counts):
            said = "1 more warning" if repeated == 1 else f"{repeated} more warnings"
            verb = "is" if repeated == 1 else "are"
            logger.warning("%s as above, of other runs, %s not repeated", said, verb)


class Task(NamedTuple):
    """A point to be evaluated by a worker."""

    number: int  # of the point
    message: bytes  # the pickled point and evaluator
    model: str  # key of the model
    changes: str  # of the point, in words
    pair: Any  # of the suite, or None


class TaskQueue:
    """Points to be evaluated, in their order, grouped by model."""

    def __init__(self, points: Sequence[tuple[int, StudyPoint]], evaluator: Evaluator) -> None:
        self._tasks: dict[str, deque[Task]] = {}
        for number, point in points:
            message, pair = _pickle_task(point, evaluator), dict(point.changes).get(PAIR_KEY)
            task = Task(number, message, point.model_key, describe_changes(point), pair)
            self._tasks.setdefault(task.model, deque()).append(task)

    def __bool__(self) -> bool:
        """Whether tasks are left."""
        return bool(self._tasks)

    def pop(
        self, model: str | None, other_models: Collection[str], other_pairs: Collection[Any] = ()
    ) -> Task:
        """Remove and return the next task: of this model, else of one that no other worker has."""
        # pairs that others compute are left for later, when their matched motions are shared
        if model not in self._tasks:
            unused = (key for key in self._tasks if key not in other_models)
            model = next(unused, next(iter(self._tasks)))
        tasks = self._tasks[model]
        first = islice(tasks, 100)  # a study of a million points may have a single pair
        place = next((k for k, task in enumerate(first) if task.pair not in other_pairs), 0)
        task = tasks[place]
        del tasks[place]
        if not tasks:
            del self._tasks[model]
        return task

    def put_back(self, task: Task) -> None:
        """Put a task back in front of the others of its model."""
        self._tasks.setdefault(task.model, deque()).appendleft(task)


class Worker:
    """A process that evaluates points, and the pipe to it."""

    def __init__(self, log: str, shared: Path | None) -> None:
        self.pipe, remote = Pipe()
        arguments = remote, log, shared
        context: Any = get_context(START_METHOD)
        self._process = context.Process(target=_serve, args=arguments)
        with remote:  # the end of the worker then closes the pipe
            _start(self._process)
        self.task: Task | None = None
        self.model: str | None = None
        self.warnings: list[str] = []  # of the last task

    def send(self, task: Task) -> None:
        """Send a task; `receive` notices a worker that has died."""
        self.task, self.model = task, task.model
        with suppress(OSError):
            self.pipe.send_bytes(task.message)

    def receive(self) -> Row | _numba.CompilationNotice | Reached | None:
        """Receive the row of the task, or a notice before; None if the worker has died."""
        try:
            received: Any = self.pipe.recv()
        except (EOFError, OSError, pickle.UnpicklingError):
            return None
        if isinstance(received, _numba.CompilationNotice | Reached):
            return received
        row, self.warnings = received
        self.task = None
        return row

    def kill(self) -> None:
        """Kill the process without waiting for its end."""
        with suppress(ValueError):  # it has ended
            self._process.kill()

    def end(self) -> str:
        """Kill the process unless it has ended, and describe its exit code."""
        self.pipe.close()
        self._process.kill()
        self._process.join()
        code = self._process.exitcode or 0
        self._process.close()  # at which a worker ends even if its fork server was killed
        return f"signal {-code}" if code < 0 else f"exit code {code}"


class WorkerPool:
    """Workers that evaluate the tasks of a queue."""

    def __init__(
        self, tasks: TaskQueue, max_workers: int, log: str, shared: Path | None = None
    ) -> None:
        # gmsh restores the default action of SIGPIPE, by which a send to a dead worker would end
        # this process; signals can be set in the main thread alone.
        with suppress(ValueError, AttributeError):  # which Windows has not
            signal.signal(signal.SIGPIPE, signal.SIG_IGN)
        if START_METHOD == "forkserver":
            forkserver.set_forkserver_preload(["archfem.studies.fork_server"])
            _make_socket_folder()
        self._tasks, self._max_workers, self._log, self._shared = tasks, max_workers, log, shared
        self._workers: list[Worker] = []
        self._deaths: Counter[int] = Counter()
        self._warnings = RepeatedWarnings()
        self._compiled: set[str] = set()  # parts of which workers have said that they compile them
        # A second Ctrl-C may end `close` early, and Python waits at its end for all processes that
        # are left, until their points are computed
        atexit.register(self._kill)

    def rows(self) -> Iterator[tuple[int, Row]]:
        """Yield number and row of points as they finish."""
        self._assign()
        while busy := {worker.pipe: worker for worker in self._workers if worker.task}:
            for pipe in wait(list(busy)):
                finished = self._receive(busy[pipe])  # type: ignore[index]
                self._assign()  # before the caller stores this row: no worker waits for that
                if finished is not None:
                    yield finished
        self._warnings.log_count()

    def close(self) -> None:
        """End all workers."""
        self._kill()
        for worker in self._workers:
            worker.end()
        reached.clear()
        atexit.unregister(self._kill)

    def _kill(self) -> None:
        """Kill all workers before any is waited for."""
        for worker in self._workers:
            worker.kill()

    def _assign(self) -> None:
        """Give a task to each free worker, and to new workers up to the largest number."""
        free = [worker for worker in self._workers if worker.task is None]
        while self._tasks and (free or len(self._workers) < self._max_workers):
            if not free:
                free.append(Worker(self._log, self._shared))
                self._workers += free
            worker = free.pop()
            others = [other for other in self._workers if other is not worker]
            models = {other.model for other in others if other.model}
            pairs = {other.task.pair for other in others if other.task} - {None}
            worker.send(self._tasks.pop(worker.model, models, pairs))

    def _receive(self, worker: Worker) -> tuple[int, Row] | None:
        """Return number and row of a point; None if it is not finished."""
        task = worker.task
        assert task is not None
        row = worker.receive()
        if isinstance(row, Reached):
            reached[task.number] = row
            return None
        if isinstance(row, _numba.CompilationNotice):
            if row.part not in self._compiled:  # one worker compiles, and the others wait
                row.write()
            self._compiled.add(row.part)
            return None
        reached.pop(task.number, None)
        self._warnings.log(worker.warnings)
        worker.warnings = []
        if row is not None:
            return task.number, row
        self._workers.remove(worker)
        reason = worker.end()
        self._deaths[task.number] += 1
        final = self._deaths[task.number] == MAX_DEATHS_PER_POINT
        logger.warning(
            "a worker ended with %s while it computed point %d (%s): the point is %s; a process "
            "ends so if memory runs out, or a library fails",
            *(reason, task.number, task.changes),
            f"lost, after {MAX_DEATHS_PER_POINT} workers" if final else "computed again",
        )
        if not final:
            self._tasks.put_back(task)
            return None
        text = f"{MAX_DEATHS_PER_POINT} processes that computed this point ended"
        return task.number, make_row({}, f"WorkerDied: {text}, the last with {reason}", ours=False)


@cache
def _make_socket_folder() -> None:
    """Give multiprocessing a folder for the fork server's socket that no kill leaves for good."""
    stack = ExitStack()
    folder = stack.enter_context(temporary_folder())
    current_process()._config["tempdir"] = str(folder)  # type: ignore[attr-defined]
    atexit.register(stack.close)


def _start(process: BaseProcess, attempts: int = 10) -> None:
    """Start a process; if the fork server has died, by another one."""
    with _isolate_start():
        for _ in range(attempts):
            with suppress(EOFError, OSError):
                return process.start()
    raise StudyStopped(
        f"no worker could be started in {attempts} attempts: finished points are kept; free some "
        "memory and run the same study again, or run it with workers = 1"
    )


@contextmanager
def _isolate_start() -> Iterator[None]:
    """Start processes with the search path of this one, but without its script."""
    main, path = sys.modules["__main__"], os.environ.get("PYTHONPATH")
    # multiprocessing would import the user's script in each worker, which would run the study anew
    sys.modules["__main__"] = ModuleType("__main__")
    # the fork server must load this archfem, not one installed elsewhere
    os.environ["PYTHONPATH"] = os.pathsep.join(folder or os.getcwd() for folder in sys.path)
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        del os.environ["PYTHONPATH"]
        os.environ |= {} if path is None else {"PYTHONPATH": path}


def _serve(pipe: Connection, log: str, shared: Path | None) -> None:
    """Evaluate points that come through a pipe until it is closed: a worker."""
    threading.Thread(target=_end_with_driver, daemon=True).start()
    with open(log, "a") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)
    _numba.send_notice = _display.send_progress = pipe.send  # the driver says it for all workers
    np.random.seed()  # noqa: NPY002  (for users' functions: all workers would draw the same)
    with suppress(EOFError, OSError), threadpool_limits(1), share_results(shared):
        while True:
            message = pipe.recv_bytes()
            with keep_warnings() as warnings:
                try:
                    point, evaluator = pickle.loads(message)
                except Exception as error:  # a function of a module that the worker cannot import
                    row = make_row({}, f"{type(error).__name__}: {error}", ours=False)
                else:
                    row = evaluate_point(point, evaluator)
            pipe.send((row, warnings))  # the driver logs the warnings, each kind once


def _end_with_driver() -> None:
    """End this worker when its driver has ended, in the midst of a point if need be."""
    driver = parent_process()
    assert driver is not None
    driver.join()
    os._exit(1)


def _pickle_task(point: StudyPoint, evaluator: Evaluator) -> bytes:
    """Pickle a point and its evaluator for another process."""
    name = getattr(evaluator.find, "__qualname__", repr(evaluator.find))
    try:
        if evaluator.find.__module__ == "__main__":
            raise pickle.PicklingError("it is defined in the script that runs")
        return pickle.dumps((point, evaluator))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise InvalidInput(
            f"{name} cannot be handed to another process: {error}; define it in a module of "
            "its own, or run with workers = 1"
        ) from error
