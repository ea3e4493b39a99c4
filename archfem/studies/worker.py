"""What a worker does: one point at a time, on one thread, and a row even where it fails."""

import contextlib
import fcntl
import hashlib
import json
import logging
import os
import pickle
import tempfile
import threading
import tomllib
from collections.abc import Iterator, Sequence
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from archfem.errors import ArchfemError
from archfem.studies.asking import Asked
from archfem.studies.points import Point, package_version

Row = dict[str, Any]
"""What came of a point: `found`, a flat table; `error`, empty where there is none; `ours`, whether
such an error is told of the case itself, so that it would be the same again."""

THREADS = ("OMP", "OPENBLAS", "MKL", "NUMBA", "NUMEXPR")
"""Libraries that are told by NAME_NUM_THREADS how many threads to use."""

SINGLE = {f"{name}_NUM_THREADS": "1" for name in THREADS}
"""Environment of a worker."""

WARM = """
title = "what compiled code is warmed on"
[structure]
shape = "circular_arch"
radius = 3.0
thickness = 0.5
embrace = 150.0
voussoirs = 3
[model]
fidelity = "rigid"
[analysis]
dt = 0.005
damping = { ratio = 0.05, frequency = 8.0 }
[motion]
synthetic = { seed = 1, duration = 0.1, pga = 1.0 }
"""

_one_at_a_time = threading.Lock()


def answer(point: Point, asked: Asked) -> Row:
    """Return what came of a point, whatever happens.

    Args:
        point: of a study.
        asked: what is to be found.
    """
    try:
        return row(asked.of_case(point.case))
    except ArchfemError as error:
        return row({}, f"{type(error).__name__}: {error}")
    except Exception as error:  # of a user's function, of a library: the others go on
        return row({}, f"{type(error).__name__}: {error}", ours=False)


def row(found: dict[str, Any], error: str = "", *, ours: bool = True) -> Row:
    """Return the row of a point.

    Args:
        found: of the case.
        error: that ended it, in words.
        ours: whether that is told of the case itself.
    """
    return {"found": found, "error": error, "ours": ours}


def answers(
    points: Sequence[tuple[int, Point]], asked: Asked, version: str
) -> tuple[str, list[tuple[int, Row]]]:
    """Return what came of some points, one at a time in a process that may have threads.

    Args:
        points: with their numbers.
        asked: what is to be found.
        version: of archfem where the study was begun.

    Returns:
        The version that runs here, and rows by number; none where the versions differ.
    """
    own = package_version()
    if own != version:
        return own, []
    with _one_at_a_time, threadpool_limits(limits=1):
        warmed()
        return own, [(number, answer(point, asked)) for number, point in points]


def serve(handle: int) -> None:
    """Answer points that come through a pipe until it is closed.

    Args:
        handle: of the pipe.
    """
    logging.getLogger("archfem").setLevel(logging.ERROR)  # what is said of one run of thousands
    with Connection(handle) as pipe, contextlib.suppress(EOFError, OSError), threadpool_limits(1):
        warmed()
        while True:
            number, task = pipe.recv()
            try:
                point, asked = pickle.loads(task)
            except Exception as error:  # a function that is in no module of the worker's
                pipe.send((number, row({}, f"{type(error).__name__}: {error}", ours=False)))
                continue
            pipe.send((number, answer(point, asked)))


@cache
def warmed() -> None:
    """Load compiled code once a process, and compile it once a machine, not once a worker."""
    settings = tomllib.loads(WARM)
    with _alone():
        answer(Point(settings, Path()), Asked.of("history"))


@contextlib.contextmanager
def _alone() -> Iterator[None]:
    """Let one process go first, unless one has before since the sources were last changed."""
    done = Path(tempfile.gettempdir()) / f"archfem-{os.getuid()}-{_sources()}.warm"
    if done.exists():
        yield
        return
    with done.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
        done.touch()


def _sources() -> str:
    """What tells this state of the compiled modules from any other."""
    rooms = Path(__file__).parents[1]
    times = [
        (str(path), path.stat().st_mtime_ns)
        for room in ("dynamics", "joints")
        for path in sorted((rooms / room).rglob("*.py"))
    ]
    return hashlib.sha256(json.dumps(times).encode()).hexdigest()[:16]
