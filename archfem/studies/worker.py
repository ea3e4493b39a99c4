"""What a worker does: one point at a time, on one thread, and a row even where it fails."""

import contextlib
import logging
import pickle
import socket
import threading
from collections.abc import Sequence
from typing import Any

from threadpoolctl import threadpool_limits

from archfem.cases.inputs import package_version
from archfem.errors import ArchfemError
from archfem.studies.asking import Asked
from archfem.studies.points import Point

Row = dict[str, Any]
"""What came of a point: `found`, a flat table; `error`, empty where there is none; `ours`, whether
such an error is told of the case itself, so that it would be the same again."""

THREADS = ("OMP", "OPENBLAS", "MKL", "NUMBA", "NUMEXPR")
"""Libraries that are told by NAME_NUM_THREADS how many threads to use."""

SINGLE = {
    **{f"{name}_NUM_THREADS": "1" for name in THREADS},
    "OMPI_MCA_ess_singleton_isolated": "1",  # no daemon of Open MPI beside each worker
}
"""Environment of a worker."""

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
        return own, [(number, answer(point, asked)) for number, point in points]


def serve(handle: int) -> None:
    """Answer points that come through a pipe until it is closed.

    Args:
        handle: of the pipe, a socket.
    """
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
