"""Cost of a history in a study on Dask beside a bare loop, with a worker and the driver killed.

    python tests/benchmarks/study_cluster.py --points 10000

Histories of 2 s of the ring of the README, each at another scale. A scheduler and two workers are
processes of this machine. At a quarter of the points one worker is killed, and another one started;
at half of them the driver is killed, and the study is continued in its folder. Two processes with a
bare loop over some of the same histories run before, at the half, and after; their start does not
count. Of the study all counts but the first start of scheduler and workers: both drivers, the
worker that was started later, lost points, and the tables. Both ways find the same bits.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil
from setting import plain_options
from timing import stopwatch, table

import archfem as af

QUIET = {"WORKER__PROFILE__ENABLED": "False", "ADMIN__TICK__INTERVAL": "1s"}
"""Settings of Dask without its profiler: idle processes take 0.7 to 0.9 % of a core, not 2 %."""

SCALES = 0.2, 0.8
"""Smallest and largest factor on the motion; the ring cracks and stands."""


def setting() -> tuple[af.Analysis, af.Motion]:
    """Return the analysis and the unscaled motion."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    damping = af.StiffnessDamping(0.05, 8.0)
    settings = {"fidelity": "rigid", "displacements": "large", "damping": damping, "dt": 0.002}
    return af.Analysis(ring, **settings), af.Motion.synthetic(duration=2.0, pga=6.0, seed=1)


def drive(folder: str, address: str, points: str) -> None:
    """Run the study on a scheduler, or what is left of it."""
    analysis, motion = setting()
    scales = np.linspace(*SCALES, int(points)).tolist()
    af.Study(analysis, {"motion.scale": scales}, motion=motion).run(folder, client=address)


def loop(points: str, numbers: str) -> None:
    """Print seconds of the processor and of the clock of a bare loop, and its displacements."""
    analysis, motion = setting()
    scales = np.linspace(*SCALES, int(points))
    evaluate(analysis, motion, 1.0)  # loads compiled code
    watch = stopwatch()
    moved = [evaluate(analysis, motion, scales[k]) for k in json.loads(numbers)]
    print(json.dumps([*watch(), moved]))


def evaluate(analysis: af.Analysis, motion: af.Motion, scale: float) -> float:
    """Return the largest displacement of a history, of which all findings are computed [m]."""
    findings = af.studies.of_history(analysis.run(motion.scaled(float(scale))))
    return float(findings["largest_displacement"])


def started(*words: str, **options: object) -> "subprocess.Popen[str]":
    """Start a process of Python with one thread."""
    environment = os.environ | {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "NUMBA")}
    environment |= {f"DASK_DISTRIBUTED__{name}": value for name, value in QUIET.items()}
    environment["PYTHONPATH"] = os.pathsep.join(each or os.getcwd() for each in sys.path)
    return subprocess.Popen([sys.executable, *words], env=environment, text=True, **options)


class Cluster:
    """A scheduler and workers, and the processor time of all processes that were started."""

    def __init__(self, folder: Path, workers: int) -> None:
        self.folder, self.file = folder, folder / "scheduler.json"
        self._ended, self._idle, self._live = 0.0, 0.0, []
        self.scheduler = self.start(*self._dask("scheduler"), "--host", "127.0.0.1", "--port", "0")
        while not (self.file.exists() and self.file.stat().st_size):
            time.sleep(0.1)
        self.workers = [self.add_worker() for _ in range(workers)]
        self.run(folder / "first", 8 * workers)  # until both have loaded all that they need
        self.leave_out(self.spent())

    @property
    def address(self) -> str:
        """Address of the scheduler."""
        return str(json.loads(self.file.read_text())["address"])

    def add_worker(self) -> "subprocess.Popen[str]":
        """Start a worker of one thread."""
        return self.start(*self._dask("worker"), "--nthreads", "1", "--no-nanny")

    def start(self, *words: str) -> "subprocess.Popen[str]":
        """Start a process, whose time counts."""
        with (self.folder / "log.txt").open("a") as log:
            process = started(*words, stdout=log, stderr=log)
        self._live.append(process)
        return process

    def kill(self, process: "subprocess.Popen[str]") -> None:
        """Kill a process."""
        self._ended += _processor_time(process)
        self._live.remove(process)
        process.kill()
        process.wait()

    def wait(self, process: "subprocess.Popen[str]") -> None:
        """Wait for the end of a process."""
        spent = 0.0
        while process.poll() is None:
            spent = _processor_time(process)
            time.sleep(0.02)
        if process.returncode:
            raise SystemExit((self.folder / "log.txt").read_text()[-3000:])
        self._ended += spent
        self._live.remove(process)

    def spent(self) -> float:
        """Processor time of all processes [s] that counts."""
        return self._ended + sum(map(_processor_time, self._live)) - self._idle

    def leave_out(self, seconds: float) -> None:
        """Leave out a time that does not count [s]."""
        self._idle += seconds

    def run(self, folder: Path, points: int, until: float = 1.0) -> float:
        """Drive the study until a share of its points is done; return the time [s]."""
        watch = stopwatch()
        driver = self.start(__file__, "drive", str(folder), self.address, str(points))
        if until == 1.0:
            self.wait(driver)
            return watch()[0]
        wait_for(folder, int(0.5 * until * points))
        self.kill(self.workers.pop())
        self.workers.append(self.add_worker())
        wait_for(folder, int(until * points))
        self.kill(driver)
        return watch()[0]

    def close(self) -> None:
        """End all processes."""
        for process in [*self._live]:
            self.kill(process)

    def _dask(self, what: str) -> tuple[str, ...]:
        return "-m", "dask", what, "--scheduler-file", str(self.file), "--no-dashboard"


def _processor_time(process: "subprocess.Popen[str]") -> float:
    """Processor time of a process [s]; nothing if it has ended."""
    try:
        times = psutil.Process(process.pid).cpu_times()
    except psutil.NoSuchProcess:
        return 0.0
    return float(times.user + times.system)


@contextmanager
def cluster(workers: int) -> Iterator[Cluster]:
    """Yield a cluster, with a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        running = Cluster(Path(folder), workers)
        try:
            yield running
        finally:
            running.close()


def wait_for(folder: Path, done: int) -> None:
    """Wait until a number of points is done."""
    while True:
        try:
            progress = json.loads((folder / "progress.json").read_text())["content"]
            if progress["done"] >= done:
                return
        except (OSError, ValueError):  # not yet written
            pass
        time.sleep(0.2)


def run_loops(points: int, count: int, workers: int) -> tuple[float, float, dict[int, float]]:
    """Run bare loops side by side: processor and wall time of a history [s], displacements."""
    chosen = np.linspace(0, points - 1, count * workers).astype(int)
    shares = [chosen[k::workers].tolist() for k in range(workers)]
    processes = [
        started(__file__, "loop", str(points), json.dumps(share), stdout=subprocess.PIPE)
        for share in shares
    ]
    answers = [json.loads(process.communicate()[0]) for process in processes]
    wall, spent = (np.mean([each[k] for each in answers]) / count for k in range(2))
    moved = {}
    for share, answer in zip(shares, answers, strict=True):
        moved |= dict(zip(share, answer[2], strict=True))
    return float(spent), float(wall), moved


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the cost of a history by both ways, and their ratio."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    if given[:1] in (["drive"], ["loop"]):
        {"drive": drive, "loop": loop}[given[0]](*given[1:])
        return
    parser = plain_options(__doc__)
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--count", type=int, default=300, help="histories of each bare loop")
    chosen = parser.parse_args(given)
    points, count = (400, 4) if chosen.quick else (chosen.points, chosen.count)
    workers = 2
    loops = [run_loops(points, count, workers)]
    with cluster(workers) as running:
        folder = running.folder / "study"
        wall = running.run(folder, points, until=0.5)
        kept = af.studies.status(folder).done
        time.sleep(5.0)  # batches that workers had begun
        spent = running.spent()
        loops.append(run_loops(points, count, workers))
        running.leave_out(running.spent() - spent)
        wall += running.run(folder, points)
        spent = running.spent()
        dataset = af.studies.read_table(folder / "results.nc")
    loops.append(run_loops(points, count, workers))
    moved = dataset["largest_displacement"].values
    assert not (dataset["error"].values != "").any()
    for _, _, own in loops:
        assert all(moved[k] == each for k, each in own.items()), "findings differ"
    bare, bare_wall = (np.mean([each[k] for each in loops]) for k in range(2))
    study, study_wall = spent / points, workers * wall / points
    rows = [
        ["bare loop", 1e3 * bare, 1e3 * bare_wall],
        ["study on Dask", 1e3 * study, 1e3 * study_wall],
        ["ratio", study / bare, study_wall / bare_wall],
    ]
    print(f"{points} histories, {kept} kept when the driver was killed")
    print(table(["way", "processor [ms]", "wall x workers [ms]"], rows))
    print("bare loops [ms]:", ", ".join(f"{1e3 * each[0]:.2f}" for each in loops))


if __name__ == "__main__":
    main()
