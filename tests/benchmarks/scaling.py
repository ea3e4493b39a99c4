"""Time of a step and peak memory against the number of stones.

    python tests/benchmarks/scaling.py [--sizes 17 34 68 125 250 500]

Radius and thickness stay; only the number of stones varies, and the stiffness of a joint with it.
Each size runs in a process of its own; memory is what that process grew by, at its peak, beyond
what it held after a small model. The last line is the slope of a straight fit, log over log.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from setting import DAMPING, ring
from stepping import Run, warm_up
from timing import table

import archfem as af
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.modal import Modal

SIZES = [17, 34, 68, 125, 250, 500]
CASES = [
    *((rung, method) for rung in ("rigid", "faces") for method in ("contact", "chain", "snes")),
    ("condensed", "chain"),
]
"""Fidelity and method."""

DURATION = 1.0
"""Of the motion [s]."""


def peak() -> float:
    """Largest memory this process has held [MB]; `getrusage` would count its parent's as well."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(status.split("VmHWM:")[1].split()[0]) / 1024.0


def measured(fidelity: str, method: str, voussoirs: int, repeat: int) -> dict | None:
    """Time a step and find the memory, in this process; None where the method does not apply."""
    motion = af.Motion.synthetic(duration=DURATION, pga=2.0, seed=3, vertical_ratio=0.0)
    warm_up(motion)
    small = af.build(ring(3), fidelity=fidelity, cells=(4, 4), quadrature="nodal")
    Run(small, motion.cut(0.0, 0.1), method).clock(1)
    before = peak()
    model = af.build(ring(voussoirs), fidelity=fidelity, cells=(4, 4), quadrature="nodal")
    if method == "contact" and Modal.of(Equation(model, motion, DAMPING)) is None:
        return None
    run = Run(model, motion, method)
    clock = run.clock(repeat)
    return {"step": clock.cpu, "setup": run.setup, "memory": peak() - before}


def in_own_process(fidelity: str, method: str, voussoirs: int, repeat: int) -> dict | None:
    """Measure in a process of its own."""
    case = json.dumps([fidelity, method, voussoirs, repeat])
    command = [sys.executable, str(Path(__file__)), "--one", case]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"failed": done.stderr.strip().splitlines()[-1][:60]}
    return json.loads(done.stdout.splitlines()[-1])


def slope(sizes: list[int], values: list[float]) -> str:
    """Slope of the straight line through the logarithms; "" of fewer than three points."""
    kept = [(n, value) for n, value in zip(sizes, values, strict=True) if value > 0.0]
    if len(kept) < 3:
        return ""
    return f"{np.polyfit(*np.log(np.array(kept)).T, 1)[0]:.2f}"


def report(sizes: list[int], repeat: int) -> str:
    """Run every case at every size and write a table of time, set-up and memory."""
    found = {case: [in_own_process(*case, n, repeat) for n in sizes] for case in CASES}
    head = ["stones", *(f"{fidelity}, {method}" for fidelity, method in CASES)]
    parts = []
    for key, title, form in (
        ("step", "Processor time of a step [ms]", ".4f"),
        ("setup", "Set-up of the stepper [s]", ".3f"),
        ("memory", "Growth of memory [MB]", ".1f"),
    ):
        columns = [[(each or {}).get(key, 0.0) for each in found[case]] for case in CASES]
        lines = [
            [n, *(format(column[k], form) if column[k] else "-" for column in columns)]
            for k, n in enumerate(sizes)
        ]
        lines.append(["slope", *(slope(sizes, column) for column in columns)])
        parts += [title, table(head, lines)]
    failed = {
        f"{case}, {n} stones: {each['failed']}"
        for case in CASES
        for n, each in zip(sizes, found[case], strict=True)
        if each and "failed" in each
    }
    return "\n\n".join([*parts, *sorted(failed)])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one:
        print(json.dumps(measured(*json.loads(chosen.one))))
    else:
        print(report(chosen.sizes, chosen.repeat))
