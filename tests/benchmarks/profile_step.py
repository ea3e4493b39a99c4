"""Profile whole time histories, from set-up to recording.

    python tests/benchmarks/profile_step.py [--fidelity full --quadrature nodal --method snes]

Functions are listed by their own time, divided by the number of steps, as Python's profiler
measures it. The profiler's own cost is included, so shares matter more than sums. A compiled loop
is one line.
"""

import argparse
import cProfile
import pstats
from collections.abc import Sequence
from pathlib import Path

from scenes import DT, ring
from setting import DAMPING, ground_motion, options
from stepping import SteppedRun
from timing import table

import archfem as af

CASES = [("full", "nodal", "snes"), ("full", "nodal", "auto"), ("faces", "exact", "auto")]
"""Fidelity, quadrature and method that are profiled by default."""


def profile_table(run: SteppedRun, lines: int = 12) -> str:
    """Profile a whole call and list the functions that take most time of their own."""
    profile = cProfile.Profile()
    profile.runcall(run.call)
    stats = pstats.Stats(profile)
    functions = sorted(stats.stats.items(), key=lambda item: -item[1][2])[:lines]
    rows = [
        [
            _short_name(*where),
            f"{calls / run.steps:.2f}",
            f"{1e3 * own / run.steps:.4f}",
            f"{100 * own / stats.total_tt:.0f} %",
        ]
        for where, (_, calls, own, _, _) in functions
    ]
    return table(["function", "calls/step", "own ms/step", "share"], rows)


def _short_name(path: str, line: int, function: str) -> str:
    """Return the short name of a profiled function."""
    return f"{Path(path).name}:{line} {function}" if line else function


def report(cases: list[tuple[str, str, str]], motion: af.Motion, repeat: int) -> str:
    """Profile each case."""
    parts = []
    for fidelity, rule, method in cases:
        model = af.build(ring(), fidelity=fidelity, cells=(4, 4), quadrature=rule)
        settings = {"start": af.dead_load(model), "damping": DAMPING, "dt": DT, "method": method}
        run = SteppedRun(lambda m=model, s=settings: af.time_history(m, motion, **s))
        times = f"{run.time_steps(repeat).cpu:.4f} ms of processor time a step"
        parts += [f"{fidelity}, {rule}, {run.method}: {times}", profile_table(run)]
    return "\n\n".join(parts)


def parser() -> argparse.ArgumentParser:
    """Make the parser of the command line."""
    made = options(__doc__)
    made.add_argument("--fidelity", help="profile this one case in place of the default ones")
    made.add_argument("--quadrature", default="exact")
    made.add_argument("--method", default="auto")
    return made


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table a case."""
    chosen = parser().parse_args(arguments)
    cases = [(chosen.fidelity, chosen.quadrature, chosen.method)] if chosen.fidelity else CASES
    if chosen.quick:
        cases, chosen.repeat = [("rigid", "exact", "auto")], 1
    print(report(cases, ground_motion(chosen), chosen.repeat))


if __name__ == "__main__":
    main()
