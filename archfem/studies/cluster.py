"""Evaluation of points on a cluster, by the scheduler of Dask distributed."""

from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from distributed import Client, KilledWorker, as_completed
from distributed.comm import CommClosedError

from archfem.cases.provenance import describe_version
from archfem.errors import InvalidInput, StudyStopped, logger
from archfem.studies.evaluators import Evaluator
from archfem.studies.parameter_space import Point
from archfem.studies.process_pool import Row, evaluate_batch, make_row

# A scheduler must answer within this time [s].
SCHEDULER_TIMEOUT = 10.0


def evaluate_on_cluster(
    points: Sequence[tuple[int, Point]], evaluator: Evaluator, client: Any, shared: Path
) -> Iterator[tuple[int, Row]]:
    """Evaluate points on the workers of a scheduler, given by its client or address."""
    with ExitStack() as stack:
        if isinstance(client, str):
            client = _connect(client)
            stack.callback(client.close, timeout=SCHEDULER_TIMEOUT)
        yield from _evaluate(points, evaluator, client, shared)


def _connect(address: str) -> Client:
    """Return a client of the scheduler at an address."""
    try:
        client = Client(address, timeout=SCHEDULER_TIMEOUT)
        client.wait_for_workers(1, timeout=SCHEDULER_TIMEOUT)
    except (OSError, ValueError) as error:  # a timeout is an OSError
        raise InvalidInput(
            f"no scheduler with a worker answers at {address!r} ({error}): start 'dask scheduler' "
            "and 'dask worker', and give the address that the scheduler prints, such as "
            "tcp://host:8786"
        ) from error
    return client


def _evaluate(
    points: Sequence[tuple[int, Point]], evaluator: Evaluator, client: Client, shared: Path
) -> Iterator[tuple[int, Row]]:
    """Submit points in batches and yield their rows as batches finish."""
    version = describe_version()
    try:
        # 40 batches a worker for an even load; at most 200 points, which are lost with their worker
        size = len(points) // (40 * max(sum(client.nthreads().values()), 1))
        size = min(max(1, size), 200)
        batches = [points[first : first + size] for first in range(0, len(points), size)]
        # not pure: a batch that was evaluated before, and has failed, is to be evaluated again
        futures = {
            client.submit(evaluate_batch, batch, evaluator, version, shared, pure=False): batch
            for batch in batches
        }
        workers = set(client.nthreads())
        for future in as_completed(futures):
            if lost := workers - (present := set(client.nthreads())):
                logger.warning(
                    "%d workers of the scheduler ended (%s): others compute their points again",
                    *(len(lost), ", ".join(sorted(lost))),
                )
            workers = present
            yield from _receive(future, futures.pop(future), version)
    except (CommClosedError, OSError, TimeoutError, CancelledError) as error:
        raise StudyStopped(
            f"the scheduler was lost ({type(error).__name__}): finished points are kept; start it "
            "again and run the same study to go on"
        ) from error


def _receive(
    future: Any, batch: Sequence[tuple[int, Point]], version: str
) -> Iterator[tuple[int, Row]]:
    """Yield the rows of a finished batch."""
    try:
        worker_version, rows = future.result()
    except KilledWorker as error:
        logger.warning(
            "workers ended while they computed points %s, which are lost: %s",
            *([number for number, _ in batch], error),
        )
        row = make_row({}, f"WorkerDied: {error}", ours=False)
        yield from ((number, row) for number, _ in batch)
        return
    except (ImportError, AttributeError) as error:
        raise InvalidInput(
            f"a worker cannot import the function to compute ({error}): install archfem {version}, "
            "and the module of the function, where workers run"
        ) from error
    if worker_version != version:
        raise InvalidInput(
            f"a worker runs archfem {worker_version}, this is {version}: install the same where "
            "workers run"
        )
    yield from rows
