"""Points on a cluster, by Dask distributed: all that knows it."""

from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from typing import Any

from distributed import Client, KilledWorker, as_completed
from distributed.comm import CommClosedError

from archfem.cases.inputs import package_version
from archfem.errors import InvalidInput, StudyStopped
from archfem.studies.asking import Asked
from archfem.studies.points import Point
from archfem.studies.worker import Row, answers, row

PATIENCE = 10.0
"""How long a scheduler may take to answer [s]."""

SHARE = 40
"""Tasks that each worker gets at least, where there are points enough: many for an even load."""

LARGEST = 200
"""Most points of one task."""

LOST = (CommClosedError, OSError, TimeoutError, CancelledError)


def on_cluster(
    points: Sequence[tuple[int, Point]], asked: Asked, client: Any
) -> Iterator[tuple[int, Row]]:
    """Answer points on the workers of a scheduler.

    Args:
        points: with their numbers.
        asked: what is to be found.
        client: of Dask distributed, or the address of its scheduler, "tcp://host:8786".

    Yields:
        Number and row of each, as they are finished.

    Raises:
        InvalidInput: no scheduler answers there, it has no workers, or they run another version.
        StudyStopped: the scheduler was lost.
    """
    own = isinstance(client, str)
    client = _connected(client) if own else client
    try:
        yield from _answered(points, asked, client)
    finally:
        if own:
            client.close(timeout=PATIENCE)


def _connected(address: str) -> Client:
    """A client of the scheduler at an address."""
    try:
        client = Client(address, timeout=PATIENCE)
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as error:
        raise InvalidInput(
            f"no scheduler with a worker answers at {address}: start 'dask scheduler' and 'dask "
            "worker', and give the address that the scheduler prints"
        ) from error
    except (OSError, ValueError) as error:
        raise InvalidInput(
            f"no scheduler answers at {address!r} ({error}): start 'dask scheduler' and give the "
            "address that it prints, such as tcp://host:8786"
        ) from error
    return client


def _answered(
    points: Sequence[tuple[int, Point]], asked: Asked, client: Client
) -> Iterator[tuple[int, Row]]:
    """Hand points out in batches and give rows as they come back."""
    version = package_version()
    try:
        size = _batch(len(points), sum(client.nthreads().values()))
        batches = [points[first : first + size] for first in range(0, len(points), size)]
        futures = {
            client.submit(answers, batch, asked, version, pure=False): batch for batch in batches
        }
        for future in as_completed(futures):
            batch = futures.pop(future)
            yield from _rows(future, batch, version)
    except LOST as error:
        raise StudyStopped(
            f"the scheduler was lost ({type(error).__name__}): what was finished is kept; start it "
            "again and run the same study to go on"
        ) from error


def _rows(
    future: Any, batch: Sequence[tuple[int, Point]], version: str
) -> Iterator[tuple[int, Row]]:
    """Rows of one batch."""
    try:
        own, rows = future.result()
    except KilledWorker as error:
        yield from ((number, row({}, f"WorkerDied: {error}", ours=False)) for number, _ in batch)
        return
    except (ImportError, AttributeError) as error:
        raise InvalidInput(
            f"a worker does not know what it is to do ({error}): install archfem {version}, and "
            "the module of find, where workers run"
        ) from error
    if own != version:
        raise InvalidInput(
            f"a worker runs archfem {own}, this is {version}: install the same where workers run"
        )
    yield from rows


def _batch(points: int, workers: int) -> int:
    """Points of one task: one, or more where there are very many."""
    return min(max(1, points // (SHARE * max(workers, 1))), LARGEST)
