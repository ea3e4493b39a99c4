"""Points on processes of this machine: who is free takes the next; one that dies is replaced."""

import os
import pickle
import socket
import subprocess
import sys
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from archfem.errors import InvalidInput
from archfem.studies.asking import Asked
from archfem.studies.points import Point
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
    tasks = deque((number, _pickled(point, asked)) for number, point in points)
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
                    died[task[0]] += 1
                    if died[task[0]] < ATTEMPTS:
                        tasks.appendleft(task)
                    else:
                        yield task[0], row({}, _fatal(worker), ours=False)
        finally:
            for worker in staff:
                worker.end()


def _hand_out(
    tasks: "deque[tuple[int, bytes]]", staff: "list[_Worker]", most: int, words: Any
) -> None:
    """Give a task to each process that has none, and to new ones where there may be more."""
    idle = [worker for worker in staff if worker.task is None]
    while tasks and (idle or len(staff) < most):
        if not idle:
            idle.append(_Worker(words))
            staff.append(idle[0])
        idle.pop().begin(tasks.popleft())


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
        self.task: tuple[int, bytes] | None = None

    def begin(self, task: tuple[int, bytes]) -> None:
        """Hand over a point; a process that is gone is noticed when its answer is waited for."""
        self.task = task
        try:
            self.pipe.send(task)
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
