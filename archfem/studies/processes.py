"""Points on processes of this machine: who is free takes the next; one that dies is replaced.

Who is free goes on with points of the model that it knows, as long as there are any, and then takes
up a model that nobody is at: so each is built once, not once a process. All are forked from one
that has imported what they need.
"""

import os
import pickle
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path
from typing import IO, Any, NamedTuple

from archfem.errors import InvalidInput
from archfem.studies.asking import Asked
from archfem.studies.nursery import QUIETLY, Nursery
from archfem.studies.points import Point, model_of
from archfem.studies.worker import Row, answer, row

ATTEMPTS = 3
"""How often a point may end the process that computes it before it counts as failed."""

NURSERIES = 10
"""How many processes that fork workers may end, one after another, before a point was answered."""


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
    points: Sequence[tuple[int, Point]],
    asked: Asked,
    workers: int,
    log: Path | None = None,
    meanwhile: Callable[[], object] | None = None,
) -> Iterator[tuple[int, Row]]:
    """Answer points on processes of this machine, each on one thread.

    Args:
        points: with their numbers.
        asked: what is to be found.
        workers: how many processes.
        log: file to which they write what they have to say; None throws it away.
        meanwhile: what this process does while the others begin.

    Yields:
        Number and row of each, as they are finished.

    Raises:
        InvalidInput: the function that finds cannot be handed to another process.
    """
    tasks = Tasks(points, asked)
    with Path(os.devnull if log is None else log).open("a") as words:
        staff = Staff(workers, words)
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


class Staff:
    """The processes that answer points, and the one from which they are forked.

    Args:
        most: processes.
        words: file to which they write what they have to say.
    """

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

    def take(self, tasks: Tasks) -> None:
        """Give a task to each process that has none, and to new ones where there may be more.

        Args:
            tasks: left.
        """
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

    def result(self, worker: "_Worker", tasks: Tasks) -> tuple[int, Row] | None:
        """Return number and row of a point; None where it was put back, its process having ended.

        Args:
            worker: that has an answer, or has ended.
            tasks: left.
        """
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
