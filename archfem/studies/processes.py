"""Points on processes of this machine: who is free takes the next; one that dies is replaced.

Who is free goes on with points of the model that it knows, as long as there are any, and then takes
up a model that nobody is at: so each is built once, not once a process.
"""

import os
import pickle
import socket
import subprocess
import sys
from collections import Counter, deque
from collections.abc import Collection, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

from archfem.errors import InvalidInput
from archfem.studies.asking import Asked
from archfem.studies.points import Point, model_of
from archfem.studies.worker import SINGLE, Row, answer, row

ATTEMPTS = 3
"""How often a point may end the process that computes it before it counts as failed."""

SERVE = "from archfem.studies.worker import serve; serve({})"


def serially(points: Sequence[tuple[int, Point]], asked: Asked) -> Iterator[tuple[int, Row]]:
    """Answer points in this process, one after another.

    Args:
        points: with their numbers.
        asked: what is to be found.

    Yields:
        Number and row of each.
    """
    for number, point in points:
        yield number, answer(point, asked)


def on_processes(
    points: Sequence[tuple[int, Point]], asked: Asked, workers: int, log: Path | None = None
) -> Iterator[tuple[int, Row]]:
    """Answer points on processes of this machine, each on one thread.

    Args:
        points: with their numbers.
        asked: what is to be found.
        workers: how many processes.
        log: file to which they write what they have to say; None throws it away.

    Yields:
        Number and row of each, as they are finished.

    Raises:
        InvalidInput: the function that finds cannot be handed to another process.
    """
    tasks = Tasks(points, asked)
    died: Counter[int] = Counter()
    with Path(os.devnull if log is None else log).open("a") as words:
        staff: list[_Worker] = []
        try:
            while tasks or any(worker.task for worker in staff):
                _hand_out(tasks, staff, workers, words)
                busy = {worker.pipe: worker for worker in staff if worker.task is not None}
                for pipe in wait(list(busy)):
                    worker = busy[pipe]  # type: ignore[index]
                    task, done = worker.task, worker.result()
                    if done is not None:
                        yield done
                        continue
                    staff.remove(worker)
                    assert task is not None
                    died[task.number] += 1
                    if died[task.number] < ATTEMPTS:
                        tasks.again(task)
                    else:
                        yield task.number, row({}, _fatal(worker), ours=False)
        finally:
            for worker in staff:
                worker.end()


class Task(NamedTuple):
    """A point to be handed out.

    Attributes:
        number: of the point.
        told: the point and what is asked, as bytes.
        model: what points of one model share.
    """

    number: int
    told: bytes
    model: str


class Tasks:
    """Points to be handed out, in their order, but those of one model together.

    Args:
        points: with their numbers.
        asked: what is to be found.
    """

    def __init__(self, points: Sequence[tuple[int, Point]], asked: Asked) -> None:
        self._left: dict[str, deque[Task]] = {}
        for number, point in points:
            task = Task(number, _pickled(point, asked), model_of(point))
            self._left.setdefault(task.model, deque()).append(task)

    def __bool__(self) -> bool:
        """Whether there are any left."""
        return bool(self._left)

    def next(self, known: str | None, others: Collection[str]) -> Task:
        """Return the next: of a model that is known, else of one that others are not at.

        Args:
            known: model that was worked at before, or None.
            others: models that are worked at elsewhere.
        """
        if known not in self._left:
            fresh = (model for model in self._left if model not in others)
            known = next(fresh, next(iter(self._left)))
        found = self._left[known].popleft()
        if not self._left[known]:
            del self._left[known]
        return found

    def again(self, task: Task) -> None:
        """Put a task back.

        Args:
            task: that was handed out.
        """
        self._left.setdefault(task.model, deque()).appendleft(task)


def _hand_out(tasks: Tasks, staff: "list[_Worker]", most: int, words: Any) -> None:
    """Give a task to each process that has none, and to new ones where there may be more."""
    idle = [worker for worker in staff if worker.task is None]
    while tasks and (idle or len(staff) < most):
        if not idle:
            idle.append(_Worker(words))
            staff.append(idle[0])
        free = idle.pop()
        others = {other.model for other in staff if other is not free and other.model is not None}
        free.begin(tasks.next(free.model, others))


class _Worker:
    """A process that answers points, and the pipe to it."""

    def __init__(self, words: Any) -> None:
        ours, theirs = socket.socketpair()
        path = os.pathsep.join(each or os.getcwd() for each in sys.path)
        self.process = subprocess.Popen(
            [sys.executable, "-c", SERVE.format(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            env={**os.environ, **SINGLE, "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=words,
            stderr=words,
            start_new_session=True,  # Ctrl-C is for the driver, which ends its workers
        )
        theirs.close()
        self.pipe = Connection(ours.detach())
        self.task: Task | None = None
        self.model: str | None = None

    def begin(self, task: Task) -> None:
        """Hand over a point; a process that is gone is noticed when its answer is waited for."""
        self.task, self.model = task, task.model
        try:
            self.pipe.send((task.number, task.told))
        except OSError:
            self.process.kill()

    def result(self) -> tuple[int, Row] | None:
        """Number and row of the point that was handed over; None where the process is gone."""
        try:
            done: tuple[int, Row] = self.pipe.recv()
        except (EOFError, OSError):
            self.end()
            return None
        self.task = None
        return done

    def end(self) -> None:
        """End the process."""
        self.pipe.close()
        self.process.kill()
        self.process.wait()


def _fatal(worker: _Worker) -> str:
    code = worker.process.returncode
    how = f"signal {-code}" if code < 0 else f"exit code {code}"
    return f"WorkerDied: {ATTEMPTS} processes that computed this point ended, the last with {how}"


def _pickled(point: Point, asked: Asked) -> bytes:
    """A point and what is asked as bytes that another process understands."""
    name = getattr(asked.find, "__qualname__", repr(asked.find))
    try:
        if asked.find.__module__ == "__main__":
            raise pickle.PicklingError("it is defined in the script that runs")
        return pickle.dumps((point, asked))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise InvalidInput(
            f"find = {name} cannot be handed to another process: {error}; define it in a module of "
            "its own, or run with workers = 1"
        ) from error
