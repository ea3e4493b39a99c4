"""The fidelity "monolithic" beside the compiled path: time of a step, ratio and difference.

    python tests/benchmarks/monolithic.py [--repeat 12]

The ring of meshes/ring_fenicsx.toml on the strongest 0.3 s of its motion: by the paper's own law
and Newmark's method, then with joints that slide and the conserving scheme. Runs take turns, and
the least processor time of each counts. Differences are those of N, V and M, over the largest.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from setting import plain_options
from stepping import SteppedRun
from timing import table

import archfem as af
from archfem.cases.examples import list_examples

SLIDING = ['contacts."stone to stone".friction=0.6', "analysis.scheme=conserving"]
"""Changes of the case to joints that slide."""

CASES = {
    "Newmark, no sliding": [],
    "conserving, friction 0.6": SLIDING,
    "the same, strong": [*SLIDING, "motion.scale=2", "model.quadrature=lobatto"],
}
"""Changes of the case by name of the row."""

PATHS = {
    "compiled": ("full", "auto"),
    "NumPy and SNES": ("full", "snes"),
    "monolithic": ("monolithic", "snes"),
}
"""Fidelity and method by name."""


def start_runs(changes: list[str], duration: float) -> dict[str, SteppedRun]:
    """Start the run of each path on the strongest part of the motion."""
    case = af.Case.read(list_examples()["ring_fenicsx"], changes)
    whole, runs = case.ground_motion(), {}
    peak = whole.dt * int(np.argmax(np.abs(whole.horizontal)))
    motion = whole.cut(peak - 0.5 * duration, peak + 0.5 * duration)
    for name, (fidelity, method) in PATHS.items():
        analysis = replace(case.analysis, fidelity=fidelity, method=method)
        runs[name] = SteppedRun(lambda analysis=analysis: analysis.run(motion))
    return runs


def difference(run: SteppedRun, other: SteppedRun) -> float:
    """Return the largest difference of N, V and M, each over its largest value."""
    pairs = [(run.history.joints[key], other.history.joints[key]) for key in "NVM"]
    return max(float(abs(one - two).max() / abs(two).max()) for one, two in pairs)


def rows(name: str, runs: dict[str, SteppedRun], repeat: int) -> list[list[object]]:
    """Time the runs by turns, and return a row for each."""
    times = dict.fromkeys(runs, float("inf"))
    for _ in range(repeat):
        for path, run in runs.items():
            times[path] = min(times[path], run.time_steps(1).cpu)
    compiled = runs["compiled"]
    return [
        [
            *(name, path, f"{times[path]:.3f}", f"{times[path] / times['compiled']:.1f}"),
            *(f"{run.iterations:.1f}", f"{difference(run, compiled):.0e}"),
        ]
        for path, run in runs.items()
    ]


def parser() -> argparse.ArgumentParser:
    """Make the parser of the command line."""
    made = plain_options(__doc__)
    made.add_argument("--repeat", type=int, default=12, help="turns, of which the least counts")
    return made


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    chosen = parser().parse_args(arguments)
    cases = dict([*CASES.items()][:1]) if chosen.quick else CASES
    duration, repeat = (0.05, 1) if chosen.quick else (0.3, chosen.repeat)
    head = ["case", "path", "ms a step", "ratio", "iterations", "difference"]
    found: list[list[object]] = []
    for name, changes in cases.items():
        found += rows(name, start_runs(changes, duration), repeat)
    print(table([*head], found))


if __name__ == "__main__":
    main()
