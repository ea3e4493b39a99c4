"""What two workers are worth: histories of 20 s of the ring, or the bridge, on one process and two.

    python tests/benchmarks/study_efficiency.py --points 64
    python tests/benchmarks/study_efficiency.py --bridge

The bridge's are those of its sensitivity study, of which 25 cases are taken under one made pair at
R = 3: the search for scales, which would take longer still, is left out.

Wall time says what the machine gave, processor time of driver and workers what the study took:
where other programs share the cores, the second alone tells of the study. With
PYTHONDONTWRITEBYTECODE each run compiles our modules anew, which no installed copy does: leave it
unset, and let a first run write them.
"""

import argparse
import resource
import tempfile
import time
import tomllib
from itertools import islice
from pathlib import Path

import tomli_w

import archfem as af

MESHES = Path(__file__).parents[2] / "meshes"
RING, BRIDGE = MESHES / "ring.toml", MESHES / "prusias_sensitivity.toml"

CASES = 25
"""Of the bridge's sensitivity study."""


def processor() -> float:
    """Processor time of this process and of all that it has begun and that have ended [s]."""
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return sum(use.ru_utime + use.ru_stime for use in map(resource.getrusage, kinds))


def bridge() -> af.Study:
    """Return the first cases of the bridge's sensitivity study, as histories of one pair."""
    told = tomllib.loads(BRIDGE.read_text())
    del told["scales"]
    told["cases"] = {
        name: each | {"case": str(MESHES / each["case"])}
        for name, each in islice(told["cases"].items(), CASES)
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(tomli_w.dumps(told | {"pairs": ["pair-1"]}))
        return af.Study.read(path)


def main() -> None:
    """Print wall and processor time by the number of workers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=64)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--fidelity", default="rigid")
    parser.add_argument("--bridge", action="store_true", help="the bridge in place of the ring")
    given = parser.parse_args()
    if given.bridge:
        study = bridge()
    else:
        case = af.Case.read(RING, [f"model.fidelity={given.fidelity}", "output.animation=false"])
        scales = [0.2 + 0.6 * k / given.points for k in range(given.points)]
        study = af.Study.of(case, {"motion.scale": scales})
    times = {}
    for workers in given.workers:
        with tempfile.TemporaryDirectory() as folder:
            begun, spent = time.monotonic(), processor()
            if workers == 1:  # on a process of its own too, so that both pay for its start
                from archfem.studies import processes

                points = list(enumerate(study.points))
                failed = sum(
                    bool(row["error"]) for _, row in processes.on_processes(points, study.asked, 1)
                )
            else:
                failed = int((study.run(folder, workers=workers)["error"] != "").sum())
            times[workers] = time.monotonic() - begun, processor() - spent
        wall, cpu = times[workers]
        each = cpu / len(study.points)
        print(
            f"{workers} workers: {len(study.points)} points, {failed} failed, wall {wall:.1f} s, "
            f"processor {cpu:.1f} s, {each:.3f} s a point",
            flush=True,
        )
    first, *others = given.workers
    for workers in others:
        share = first / workers
        wall, cpu = (times[first][k] / times[workers][k] for k in (0, 1))
        print(f"efficiency of {workers}: wall {wall * share:.2f}, processor {cpu:.2f}")


if __name__ == "__main__":
    main()
