"""The file of a job for SLURM: a scheduler, a worker a core, and the study that they carry out."""

import shlex
from pathlib import Path

from archfem.arguments import whole
from archfem.errors import InvalidInput
from archfem.files import in_one_stroke

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
    whole(workers, "workers")
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
    with in_one_stroke(Path(path)) as draft:
        draft.write_text(text, encoding="utf-8")
    return Path(path)
