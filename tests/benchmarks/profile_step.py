"""Where the time of a step goes.

    python tests/benchmarks/profile_step.py [--fidelity full --quadrature nodal --method snes]

Functions by their own time, per step, as Python's profiler sees them: its own cost counts too, so
shares matter rather than sums. A compiled loop is one line; its parts are timed by themselves.
"""

import argparse
import cProfile
import pstats
from pathlib import Path

import numba
import numpy as np
from setting import DT, ground_motion, options, ring
from stepping import Run, warm_up
from timing import least, table, watched

import archfem as af
from archfem.dynamics.stepping import linear, loop
from archfem.dynamics.stepping.choice import METHODS

LINES = 12
"""Functions shown."""

CASES = [("full", "nodal", "snes"), ("full", "nodal", "contact"), ("faces", "exact", "contact")]
"""Fidelity, quadrature and method profiled where none is chosen."""


def functions(run: Run) -> str:
    """Profile all steps of a run and list the functions that take most time of their own."""
    profile = cProfile.Profile()
    profile.runcall(run.step)
    stats = pstats.Stats(profile)
    whole = stats.total_tt
    found = sorted(stats.stats.items(), key=lambda item: -item[1][2])[:LINES]
    rows = [
        [
            _name(*where),
            f"{calls / run.steps:.2f}",
            f"{1e3 * own / run.steps:.4f}",
            f"{100 * own / whole:.0f} %",
        ]
        for where, (_, calls, own, _, _) in found
    ]
    return table(["function", "calls/step", "own ms/step", "share"], rows)


def _name(path: str, line: int, function: str) -> str:
    """Short name of a profiled function."""
    return f"{Path(path).name}:{line} {function}" if line else function


@numba.njit
def _begun(system, state):
    """What is carried from step to step."""
    return loop.begin(system, state)


@numba.njit
def _settled(system, kept, states, ground, times):
    """Take the first step again and again."""
    for _ in range(times):
        loop.settle(system, kept, 0, states, ground)


@numba.njit
def _solved(system, kept, contact, times):
    """Find the contact of a step again and again."""
    for _ in range(times):
        contact[:] = kept.right
        linear.solve(system, contact, kept.gap, kept.before, kept.force)


@numba.njit
def _measured(system, kept, states, ground, room, times):
    """Take resultants and energies of the first step again and again."""
    for _ in range(times):
        loop.measure(system, kept, 0, states, ground, room[0], room[1])


def parts(run: Run, repeat: int) -> str:
    """Time the parts of a strategy's compiled loop, each by itself, on the dead load."""
    times = 2000
    ends = run.start.time + DT * np.arange(1, 3)
    series, results, _, system = run.stepper.prepared(run.start, DT, ends)
    kept = _begun(system, series[0])
    room, still = (results[0][0], results[2][0]), np.zeros(2)
    actions = {
        "settle": lambda: _settled(system, kept, series[:2], still, times),
        "  of that, solve": lambda: _solved(system, kept, np.empty_like(kept.right), times),
        "measure": lambda: _measured(system, kept, series[:2], still, room, times),
    }
    rows = []
    for name, action in actions.items():
        action()
        rows.append([name, f"{least(watched(action), times, repeat).cpu:.4f}"])
    open_points = int(np.count_nonzero(kept.force))
    return table([f"part (dead load, {open_points} open points)", "ms/step"], rows)


def report(cases: list[tuple[str, str, str]], motion: af.Motion, repeat: int) -> str:
    """Profile each case."""
    warm_up(motion)
    found = []
    for fidelity, rule, method in cases:
        model = af.build(ring(), fidelity=fidelity, cells=(4, 4), quadrature=rule)
        run = Run(model, motion, method)
        found += [f"{fidelity}, {rule}, {method}: {run.clock(repeat).cpu:.4f} ms/step"]
        found += [functions(run)]
        if method != "snes":
            found += [parts(run, repeat)]
    return "\n\n".join(found)


def parser() -> argparse.ArgumentParser:
    """Options of this benchmark."""
    made = options(__doc__.splitlines()[0])
    made.add_argument("--fidelity")
    made.add_argument("--quadrature", default="nodal")
    made.add_argument("--method", default="contact", choices=METHODS)
    return made


if __name__ == "__main__":
    chosen = parser().parse_args()
    one = [(chosen.fidelity, chosen.quadrature, chosen.method)]
    print(report(one if chosen.fidelity else CASES, ground_motion(chosen), chosen.repeat))
