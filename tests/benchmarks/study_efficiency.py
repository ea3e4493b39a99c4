"""Gain by two workers: histories of 20 s of the ring, or the bridge, on one process and two.

    python tests/benchmarks/study_efficiency.py --points 64 --repeat 5
    python tests/benchmarks/study_efficiency.py --bridge
    python tests/benchmarks/study_efficiency.py --suite

The bridge's are those of its sensitivity study, of which 25 cases are taken under one made pair at
R = 3: the search for scales, which would take longer still, is left out.

One worker is a process of its own too, so that both begin one, store rows and write tables; they
run by turns, and efficiency is that of the sums, for the machine is not the same from minute to
minute. Wall time says what it gave, processor time of driver and workers what the study took:
where other programs share the cores, the second alone tells of the study. With
PYTHONDONTWRITEBYTECODE each run compiles our modules anew, which no installed copy does: leave it
unset, and let a first run write them.
"""

import os
import resource
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import closing
from itertools import islice, product
from multiprocessing import forkserver
from pathlib import Path
from unittest.mock import patch

import numpy as np
from setting import plain_options

import archfem as af
from archfem.cases.toml_file import format_tables
from archfem.studies import process_pool
from archfem.studies.evaluators import Evaluator
from archfem.studies.parameter_space import Point
from archfem.studies.process_pool import Row

MESHES = Path(__file__).parents[2] / "meshes"
RING, BRIDGE = MESHES / "ring_paper.toml", MESHES / "prusias_sensitivity.toml"

CASES = 25
"""Of the bridge's sensitivity study."""


def processor() -> float:
    """Processor time of this process and of all that it has begun and that have ended [s]."""
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return sum(use.ru_utime + use.ru_stime for use in map(resource.getrusage, kinds))


def bridge() -> af.Study:
    """Return the first cases of the bridge's sensitivity study, as histories of one pair."""
    table = tomllib.loads(BRIDGE.read_text())
    del table["scales"]
    table["cases"] = {
        name: each | {"case": str(MESHES / each["case"])}
        for name, each in islice(table["cases"].items(), CASES)
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(format_tables(table | {"pairs": ["pair-1"]}))
        return af.Study.read(path)


def suite() -> af.Study:
    """Return two rings on one suite of six pairs, which are matched to a spectrum."""
    case = f'case = "{MESHES / "ring_suite.toml"}"'
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        thin = 'set = ["structure.thickness=0.50"]'
        path.write_text(f"[cases]\nthick = {{ {case} }}\nthin = {{ {case}, {thin} }}\n")
        return af.Study.read(path)


def alone(points: Sequence[tuple[int, Point]], evaluator: Evaluator) -> Iterator[tuple[int, Row]]:
    """Evaluate points on one process that is not this one."""
    tasks = process_pool.TaskQueue(points, evaluator)
    with closing(process_pool.WorkerPool(tasks, 1, os.devnull)) as pool:
        yield from pool.rows()


def timed(study: af.Study, workers: int) -> tuple[float, float, int]:
    """Wall and processor time of a study [s], and how many points failed."""
    serially = "archfem.studies.process_pool.evaluate_serially"
    with tempfile.TemporaryDirectory() as folder, patch(serially, alone):
        begun, spent = time.monotonic(), processor()
        failed = int((study.run(folder, workers=workers)["error"] != "").sum())
        # The time of workers counts once their fork server has ended: it would serve later studies.
        forkserver._forkserver._stop()
        return time.monotonic() - begun, processor() - spent, failed


def main(arguments: Sequence[str] | None = None) -> None:
    """Print wall and processor time by the number of workers."""
    parser = plain_options(__doc__)
    parser.add_argument("--points", type=int, default=64)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--fidelity", default="rigid")
    parser.add_argument("--bridge", action="store_true", help="the bridge in place of the ring")
    parser.add_argument("--suite", action="store_true", help="two rings on one matched suite")
    given = parser.parse_args(arguments)
    if given.bridge or given.suite:
        study = bridge() if given.bridge else suite()
    else:
        changes = [f"model.fidelity={given.fidelity}", "output.animation=false"]
        if given.quick:
            given.points, given.workers = 1, [1]
            changes += ["motion.end=0.5"]
        case = af.Case.read(RING, changes)
        scales = [0.2 + 0.6 * k / given.points for k in range(given.points)]
        study = af.Study(case, {"motion.scale": scales})
    sums = {workers: np.zeros(2) for workers in given.workers}
    for _, workers in product(range(given.repeat), given.workers):
        wall, cpu, failed = timed(study, workers)
        sums[workers] += wall, cpu
        print(
            f"{workers} workers: {len(study.points)} points, {failed} failed, wall {wall:.1f} s, "
            f"processor {cpu:.1f} s, {cpu / len(study.points):.3f} s a point",
            flush=True,
        )
    first, *others = given.workers
    for workers in others:
        wall, cpu = sums[first] / sums[workers]
        print(f"efficiency of {workers}: wall {wall * first / workers:.2f}, processor {cpu:.2f}")


if __name__ == "__main__":
    main()
