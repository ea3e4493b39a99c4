"""Time of a step and peak memory against the number of voussoirs.

    python tests/benchmarks/scaling.py [--sizes 17 34 68 125 250 500]

Radius and thickness stay constant; the joint stiffness grows with the number of voussoirs. Each
size runs in a process of its own. Memory is the growth of its peak beyond that with a small model.
The last line of each table is the slope of a straight fit in logarithms. A method that does not
apply has a dash.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scenes import DT, ring
from setting import DAMPING, plain_options
from stepping import SteppedRun, peak_memory
from timing import table

import archfem as af

SIZES = [17, 34, 68, 125, 250, 500]

CASES = [
    *(
        (fidelity, method, "small")
        for fidelity in ("rigid", "faces")
        for method in ("newton", "compliance", "snes")
    ),
    ("condensed", "auto", "small"),
    ("rigid", "auto", "large"),
]
"""Fidelity, method and displacements."""


def stepped_ring(
    fidelity: str, method: str, displacements: str, voussoirs: int, duration: float
) -> SteppedRun:
    """Run a ring from dead load."""
    model = af.build(ring(voussoirs), fidelity=fidelity, cells=(4, 4), displacements=displacements)
    motion = af.Motion.synthetic(duration=1.0, pga=2.0, seed=3, vertical_ratio=0.0)
    motion, dead = motion.cut(0.0, duration), af.dead_load(model)
    # Damping on the initial stiffness does not apply to large displacements.
    damping = DAMPING if displacements == "small" else af.Rayleigh(0.05, (8.0, 16.0))
    return SteppedRun(
        lambda: af.time_history(model, motion, dt=DT, start=dead, damping=damping, method=method)
    )


def measure(
    fidelity: str, method: str, displacements: str, voussoirs: int, repeat: int, duration: float
) -> dict | None:
    """Time a step and find the memory in this process; None where the method does not apply."""
    try:
        # A small ring first, so that compiled code is not counted as memory of the large one.
        stepped_ring(fidelity, method, displacements, 3, 0.1).time_steps(1)
        before = peak_memory()
        run = stepped_ring(fidelity, method, displacements, voussoirs, duration)
    except af.InvalidInput:
        return None
    step = run.time_steps(repeat).cpu
    return {"step": step, "setup": run.setup, "memory": peak_memory() - before}


def measure_in_process(*case: object) -> dict | None:
    """Measure in a process of its own."""
    command = [sys.executable, str(Path(__file__)), "--one", json.dumps(case)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"failure": done.stderr.strip().splitlines()[-1][:90]}
    return json.loads(done.stdout.splitlines()[-1])


def slope(sizes: list[int], values: list[float]) -> str:
    """Return the slope of a straight fit in logarithms; "" with fewer than three points."""
    points = [(n, value) for n, value in zip(sizes, values, strict=True) if value > 0.0]
    if len(points) < 3:
        return ""
    return f"{np.polyfit(*np.log(np.array(points)).T, 1)[0]:.2f}"


def report(sizes: list[int], repeat: int, *, quick: bool = False) -> str:
    """Run every case at every size and write tables of time, set-up and memory."""
    cases = [("rigid", "auto", "small"), ("rigid", "auto", "large")] if quick else CASES
    run, duration = (measure, 0.1) if quick else (measure_in_process, 1.0)
    results = {case: [run(*case, n, repeat, duration) for n in sizes] for case in cases}
    head = ["voussoirs", *(", ".join(case) for case in cases)]
    parts = []
    for key, title, form in (
        ("step", "Processor time of a step [ms]", ".4f"),
        ("setup", "Wall time of set-up [s]", ".3f"),
        ("memory", "Growth of memory [MB]", ".1f"),
    ):
        columns = [[(each or {}).get(key, 0.0) for each in results[case]] for case in cases]
        lines = [
            [n, *(format(column[k], form) if column[k] else "-" for column in columns)]
            for k, n in enumerate(sizes)
        ]
        lines.append(["slope", *(slope(sizes, column) for column in columns)])
        parts += [title, table(head, lines)]
    failures = {
        f"{', '.join(case)}, {n} voussoirs: {each['failure']}"
        for case in cases
        for n, each in zip(sizes, results[case], strict=True)
        if each and "failure" in each
    }
    return "\n\n".join([*parts, *sorted(failures)])


def parser() -> argparse.ArgumentParser:
    """Make the parser of the command line."""
    made = plain_options(__doc__)
    made.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    made.add_argument("--repeat", type=int, default=3)
    made.add_argument("--one", help=argparse.SUPPRESS)
    return made


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables, or measure one case."""
    chosen = parser().parse_args(arguments)
    if chosen.one:
        print(json.dumps(measure(*json.loads(chosen.one))))
    elif chosen.quick:
        print(report([5], 1, quick=True))
    else:
        print(report(chosen.sizes, chosen.repeat))


if __name__ == "__main__":
    main()
