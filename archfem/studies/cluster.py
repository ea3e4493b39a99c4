"""Points on a cluster, by Dask distributed: all that knows it.

The file of a job for SLURM: a scheduler, a worker a core, and the study that they carry out.
"""

import shlex
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

from distributed import Client, KilledWorker, as_completed
from distributed.comm import CommClosedError

from archfem._files import atomic_write
from archfem._validation import check_integer
from archfem.cases.provenance import describe_version
from archfem.errors import InvalidInput, StudyStopped
from archfem.studies.evaluators import Evaluator
from archfem.studies.parameter_space import Point
from archfem.studies.process_pool import Row, evaluate_batch, make_row

# How long a scheduler may take to answer [s]
PATIENCE = 10.0

# Tasks that each worker gets at least, where there are points enough: many for an even load
SHARE = 40

# Most points of one task
LARGEST = 200

LOST = (CommClosedError, OSError, TimeoutError, CancelledError)


def evaluate_on_cluster(
    points: Sequence[tuple[int, Point]], asked: Evaluator, client: Any
) -> Iterator[tuple[int, Row]]:
    """Answer points on the workers of a scheduler."""
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
            f"no scheduler with a worker evaluate_batch at {address}: start 'dask scheduler' and 'dask "
            "worker', and give the address that the scheduler prints"
        ) from error
    except (OSError, ValueError) as error:
        raise InvalidInput(
            f"no scheduler evaluate_batch at {address!r} ({error}): start 'dask scheduler' and give the "
            "address that it prints, such as tcp://host:8786"
        ) from error
    return client


def _answered(
    points: Sequence[tuple[int, Point]], asked: Evaluator, client: Client
) -> Iterator[tuple[int, Row]]:
    """Hand points out in batches and give rows as they come back."""
    version = describe_version()
    try:
        size = _batch(len(points), sum(client.nthreads().values()))
        batches = [points[first : first + size] for first in range(0, len(points), size)]
        futures = {
            client.submit(evaluate_batch, batch, asked, version, pure=False): batch for batch in batches
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
        yield from ((number, make_row({}, f"WorkerDied: {error}", ours=False)) for number, _ in batch)
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


JOB = """#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --ntasks={tasks}
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu={memory}
#SBATCH --time={time}
# One task is the scheduler, the driver runs beside it, all others are workers: one analysis a
# process, on one thread. Submit this file again to go on where a job was ended.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1
{setup}
mkdir -p {folder}
address={folder}/scheduler-$SLURM_JOB_ID.json
srun --exact --ntasks=1 dask scheduler --scheduler-file "$address" &
srun --exact --ntasks={workers} dask worker --scheduler-file "$address" \\
    --nthreads 1 --nworkers 1 --no-dashboard --death-timeout 120 &
until [ -s "$address" ]; do sleep 1; done
read_address='import json, sys; print(json.load(open(sys.argv[1]))["address"])'
archfem study {study} --out {folder} --scheduler "$(python -c "$read_address" "$address")"
ended=$?
kill $(jobs -p)
rm -f "$address"
exit $ended
"""


def slurm_job(
    study: str | Path,
    folder: str | Path,
    path: str | Path,
    *,
    workers: int,
    time: str = "24:00:00",
    memory: str = "2G",
    setup: str = "",
) -> Path:
    """Write a file for `sbatch` that carries out a study on many cores of a cluster.

    The node of the driver must see the folder; workers need the records and drawings that cases
    name, under the same paths. With dask-jobqueue a driver that lives as long as the study does the
    same without a file: `cluster = SLURMCluster(cores=1, processes=1,
    memory="2GB"); cluster.scale(200); study.run(folder, client=Client(cluster))`.

    Args:
        study: the study's file.
        folder: for the results.
        path: of the file to write.
        workers: how many processes compute, on one core each.
        time: after which the job is ended, as SLURM has it.
        memory: of each core, as SLURM has it.
        setup: lines that make `archfem` and `dask` known, such as "source ~/archfem/bin/activate".

    Returns:
        The file's path.

    Raises:
        InvalidInput: there are no workers, or the study is not there.
    """
    check_integer(workers, "workers")
    if not Path(study).is_file():
        raise InvalidInput(f"there is no study {study}")
    text = JOB.format(
        name=Path(study).stem,
        tasks=workers + 1,
        workers=workers,
        memory=memory,
        time=time,
        setup=setup,
        folder=shlex.quote(str(folder)),
        study=shlex.quote(str(study)),
    )
    with atomic_write(Path(path)) as draft:
        draft.write_text(text, encoding="utf-8")
    return Path(path)
