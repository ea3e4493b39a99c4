"""Points on processes of this machine: who is free takes the next; one that dies is replaced.

Who is free goes on with points of the model that it knows, as long as there are any, and then takes
up a model that nobody is at: so each is built once, not once a process. All are forked from one
that has imported what they need.

Workers, forked from one process that has imported and loaded once what all of them need.

The driver begins this process, the nursery, and sends it the socket of each worker that it wants;
the nursery forks one, which answers through that socket, and is asked later how it ended. Nothing
in it may have threads, or have begun MPI, which no fork outlives: PETSc is left to who needs it.
Once its driver is gone, the nursery ends its workers and then itself; should it be killed, the
kernel ends them.

What a worker does: one point at a time, on one thread, and a row even where it fails.
"""

import contextlib
import ctypes
import gc
import logging
import os
import pickle
import random
import signal
import socket
import subprocess
import sys
import threading
import traceback
from array import array
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from archfem.cases.provenance import describe_version
from archfem.errors import ArchfemError, InvalidInput
from archfem.studies.cache import preload
from archfem.studies.evaluators import Evaluator
from archfem.studies.parameter_space import Point, model_of

# What came of a point: `found`, a flat table; `error`, empty where there is none; `ours`, whether
# such an error is told of the case itself, so that it would be the same again
Row = dict[str, Any]

# Libraries that are told by NAME_NUM_THREADS how many threads to use
THREADS = ("OMP", "OPENBLAS", "MKL", "NUMBA", "NUMEXPR")

# Environment of a worker
SINGLE = {
    **{f"{name}_NUM_THREADS": "1" for name in THREADS},
    "OMPI_MCA_ess_singleton_isolated": "1",  # no daemon of Open MPI beside each worker
}

_one_at_a_time = threading.Lock()


def answer(point: Point, asked: Evaluator) -> Row:
    """Return what came of a point, whatever happens."""
    try:
        return row(asked.of_case(point.case))
    except ArchfemError as error:
        return row({}, f"{type(error).__name__}: {error}")
    except Exception as error:  # of a user's function, of a library: the others go on
        return row({}, f"{type(error).__name__}: {error}", ours=False)


def row(found: dict[str, Any], error: str = "", *, ours: bool = True) -> Row:
    """Return the row of a point."""
    return {"found": found, "error": error, "ours": ours}


def answers(
    points: Sequence[tuple[int, Point]], asked: Evaluator, version: str
) -> tuple[str, list[tuple[int, Row]]]:
    """Return what came of some points, one at a time in a process that may have threads."""
    own = describe_version()
    if own != version:
        return own, []
    with _one_at_a_time, threadpool_limits(limits=1):
        return own, [(number, answer(point, asked)) for number, point in points]


def serve(handle: int) -> None:
    """Answer points that come through a pipe until it is closed."""
    logging.getLogger("archfem").setLevel(logging.ERROR)  # what is said of one run of thousands
    with (
        contextlib.suppress(EOFError, OSError),
        socket.socket(fileno=handle) as pipe,
        pipe.makefile("rwb") as line,
        threadpool_limits(1),
    ):
        while True:
            number, task = pickle.load(line)
            try:
                point, asked = pickle.loads(task)
            except Exception as error:  # a function that is in no module of the worker's
                came = row({}, f"{type(error).__name__}: {error}", ours=False)
            else:
                came = answer(point, asked)
            pickle.dump((number, came), line)
            line.flush()


TEND = "import gc; gc.disable(); from archfem.studies.process_pool import tend; tend({})"

# Environment in which importing begins no threads: pyarrow's allocator would
THREADLESS = {"JE_ARROW_MALLOC_CONF": "background_thread:false"}

# Option of Linux's prctl: the signal that a process gets when its parent ends
DIE_WITH_PARENT = 1

# Sends to who is gone without SIGPIPE, which ends a process where gmsh has been at work
QUIETLY = getattr(socket, "MSG_NOSIGNAL", 0)

# Bytes of a message: a whole number
SIZE = 8


class Nursery:
    """A process from which workers are forked, seen by its driver."""

    def __init__(self, words: IO[Any]) -> None:
        self._control, theirs = socket.socketpair()
        path = os.pathsep.join(each or os.getcwd() for each in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-c", TEND.format(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            env={**os.environ, **SINGLE, **THREADLESS, "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=words,
            stderr=words,
            start_new_session=True,  # Ctrl-C is for the driver, which ends its workers
        )
        theirs.close()
        self._workers = 0

    def worker(self) -> tuple[int, socket.socket]:
        """Ask for a worker, without waiting for it."""
        ours, theirs = socket.socketpair()
        self._workers += 1
        handle = socket.SOL_SOCKET, socket.SCM_RIGHTS, array("i", [theirs.fileno()])
        with theirs, suppress(OSError):
            self._control.sendmsg([_message(self._workers)], [handle], QUIETLY)
        return self._workers, ours

    def buried(self, worker: int) -> int | None:
        """End a worker that has not ended, and return its exit code, less than 0 for a signal."""
        with suppress(OSError):
            self._control.sendall(_message(worker), QUIETLY)
            if told := self._control.recv(SIZE):
                return _number(told)
        return None

    def end(self) -> int:
        """End all workers and the process, and return its exit code."""
        self._control.close()  # by which one that forks already ends
        self._process.terminate()  # by which one does that imports still
        return self._process.wait()


def tend(handle: int) -> None:
    """Fork workers for as long as somebody may ask for them: what the process does."""
    ready()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    workers: dict[int, int] = {}
    with socket.socket(fileno=handle) as control, suppress(OSError):
        while told := socket.recv_fds(control, SIZE, 1):
            message, handles, *_ = told
            if not message:
                break
            if handles:
                workers[_number(message)] = _forked(control, handles[0])
            else:
                control.sendall(_message(_buried(workers.pop(_number(message)))))
    for process in workers.values():
        _buried(process)
    _leave(0)


def ready() -> None:
    """Load what points need, on one thread, and leave it out of all collecting of garbage."""
    tqdm.monitor_interval = 0  # no thread that looks after bars
    tqdm.set_lock(threading.RLock())  # none that siblings share
    preload()
    gc.freeze()
    gc.enable()


def _forked(control: socket.socket, handle: int) -> int:
    """Fork a worker that serves a socket, and return its process."""
    sys.stdout.flush()
    sys.stderr.flush()
    nursery = os.getpid()
    process = os.fork()
    if process:
        os.close(handle)
        return process
    code = 1
    try:
        control.close()
        os.dup(handle)  # so that the driver sees its end when the process has ended, not before
        _begin(nursery)
        serve(handle)
        code = 0
    except SystemExit as error:  # of a user's function
        code = error.code if isinstance(error.code, int) else int(error.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        _leave(code)
    return 0


def _begin(nursery: int) -> None:
    """Make a forked process one of its own: chance, signals, and no life without its parent."""
    random.seed()
    np.random.seed()  # noqa: NPY002  (of users' functions, which else draw the same everywhere)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != nursery:  # which ended meanwhile
            os._exit(0)


def _leave(code: int) -> None:
    """End this process at once, without what its parent has registered for its own end."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(code & 0xFF)


def _buried(process: int) -> int:
    """End a process unless it has ended, and return its exit code, less than 0 for a signal."""
    os.kill(process, signal.SIGKILL)  # it is waited for here alone: its number is still its own
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def _message(number: int) -> bytes:
    return number.to_bytes(SIZE, "little", signed=True)


def _number(message: bytes) -> int:
    return int.from_bytes(message, "little", signed=True)


# How often a point may end the process that computes it before it counts as failed
ATTEMPTS = 3

# How many processes that fork workers may end, one after another, before a point was answered
NURSERIES = 10


def serially(points: Sequence[tuple[int, Point]], asked: Evaluator) -> Iterator[tuple[int, Row]]:
    """Answer points in this process, one after another."""
    for number, point in points:
        yield number, answer(point, asked)


def on_processes(
    points: Sequence[tuple[int, Point]],
    asked: Evaluator,
    workers: int,
    log: Path | None = None,
    meanwhile: Callable[[], object] | None = None,
) -> Iterator[tuple[int, Row]]:
    """Answer points on processes of this machine, each on one thread."""
    tasks = TaskQueue(points, asked)
    with Path(os.devnull if log is None else log).open("a") as words:
        staff = WorkerPool(workers, words)
        try:
            staff.take(tasks)
            if meanwhile is not None:
                meanwhile()
            while staff.busy:
                for worker in staff.ready():
                    done = staff.result(worker, tasks)
                    staff.take(tasks)  # before this row is kept, for which nobody has to wait
                    if done is not None:
                        yield done
        finally:
            staff.end()


class Task(NamedTuple):
    """A point to be handed out."""

    number: int  # of the point
    told: bytes  # the point and what is asked, as bytes
    model: str  # what points of one model share


class TaskQueue:
    """Points to be handed out, in their order, but those of one model together."""

    def __init__(self, points: Sequence[tuple[int, Point]], asked: Evaluator) -> None:
        self._left: dict[str, deque[Task]] = {}
        for number, point in points:
            task = Task(number, _pickled(point, asked), model_of(point))
            self._left.setdefault(task.model, deque()).append(task)

    def __bool__(self) -> bool:
        """Whether there are any left."""
        return bool(self._left)

    def next(self, known: str | None, others: Collection[str]) -> Task:
        """Return the next: of a model that is known, else of one that others are not at."""
        if known not in self._left:
            fresh = (model for model in self._left if model not in others)
            known = next(fresh, next(iter(self._left)))
        found = self._left[known].popleft()
        if not self._left[known]:
            del self._left[known]
        return found

    def again(self, task: Task) -> None:
        """Put a task back."""
        self._left.setdefault(task.model, deque()).appendleft(task)


class WorkerPool:
    """The processes that answer points, and the one from which they are forked."""

    def __init__(self, most: int, words: IO[Any]) -> None:
        self._most, self._words = most, words
        self._workers: list[_Worker] = []
        self._nursery: Nursery | None = None
        self._died: Counter[int] = Counter()
        self._in_vain = 0

    @property
    def busy(self) -> bool:
        """Whether any is at work."""
        return any(worker.task is not None for worker in self._workers)

    def take(self, tasks: TaskQueue) -> None:
        """Give a task to each process that has none, and to new ones where there may be more."""
        idle = [worker for worker in self._workers if worker.task is None]
        while tasks and (idle or len(self._workers) < self._most):
            if not idle:
                idle.append(self._another())
            free = idle.pop()
            others = {each.model for each in self._workers if each is not free and each.model}
            free.begin(tasks.next(free.model, others))

    def ready(self) -> "list[_Worker]":
        """Wait for a process that has an answer, or has ended, and return all that have."""
        busy = {worker.pipe: worker for worker in self._workers if worker.task is not None}
        return [busy[pipe] for pipe in wait(list(busy))]  # type: ignore[index]

    def result(self, worker: "_Worker", tasks: TaskQueue) -> tuple[int, Row] | None:
        """Return number and row of a point; None where it was put back, its process having ended."""
        task = worker.task
        assert task is not None
        done = worker.result()
        if done is not None:
            self._in_vain = 0
            return done
        self._workers.remove(worker)
        code = worker.nursery.buried(worker.number)
        words = self._last(worker.nursery) if code is None else self._died_of(task, code)
        if words:
            return task.number, row({}, f"WorkerDied: {words}", ours=False)
        tasks.again(task)
        return None

    def end(self) -> None:
        """End all processes."""
        for worker in self._workers:
            worker.close()
        if self._nursery is not None:
            self._nursery.end()

    def _another(self) -> "_Worker":
        """One more process."""
        if self._nursery is None:
            self._nursery = Nursery(self._words)
        self._workers.append(_Worker(self._nursery))
        return self._workers[-1]

    def _died_of(self, task: Task, code: int) -> str:
        """Why a point has ended as many processes as it may; "" where it has not."""
        self._died[task.number] += 1
        if self._died[task.number] < ATTEMPTS:
            return ""
        return f"{ATTEMPTS} processes that computed this point ended, the last with {_how(code)}"

    def _last(self, nursery: Nursery) -> str:
        """Why there will be no process for a point any more; "" where there will."""
        code = nursery.end()
        if nursery is self._nursery:
            self._nursery = None
            self._in_vain += 1
        if self._in_vain < NURSERIES:
            return ""
        return f"{NURSERIES} processes that were to fork workers ended, the last with {_how(code)}"


class _Worker:
    """A process that answers points, and the pipe to it."""

    def __init__(self, nursery: Nursery) -> None:
        self.nursery = nursery
        self.number, self.pipe = nursery.worker()
        self._answers = self.pipe.makefile("rb")
        self.task: Task | None = None
        self.model: str | None = None

    def begin(self, task: Task) -> None:
        """Hand over a point; a process that is gone is noticed when its answer is waited for."""
        self.task, self.model = task, task.model
        with suppress(OSError):
            self.pipe.sendall(pickle.dumps((task.number, task.told)), QUIETLY)

    def result(self) -> tuple[int, Row] | None:
        """Number and row of the point that was handed over; None where the process is gone."""
        try:
            done: tuple[int, Row] = pickle.load(self._answers)
        except (EOFError, OSError, pickle.UnpicklingError):  # ended, or in the midst of an answer
            self.close()
            return None
        self.task = None
        return done

    def close(self) -> None:
        """Close the pipe, at which a process that waits for a point ends."""
        self._answers.close()
        self.pipe.close()


def _how(code: int) -> str:
    return f"signal {-code}" if code < 0 else f"exit code {code}"


def _pickled(point: Point, asked: Evaluator) -> bytes:
    """A point and what is asked as bytes that another process understands."""
    name = getattr(asked.find, "__qualname__", repr(asked.find))
    try:
        if asked.find.__module__ == "__main__":
            raise pickle.PicklingError("it is defined in the script that runs")
        return pickle.dumps((point, asked))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise InvalidInput(
            f"{name} cannot be handed to another process: {error}; define it in a module of "
            "its own, or run with workers = 1"
        ) from error
