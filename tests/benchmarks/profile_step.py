"""Where the time of a step goes.

    python tests/benchmarks/profile_step.py [--fidelity full --quadrature nodal --method snes]

Functions by their own time, per step, as Python's profiler sees them: its own cost counts too, so
shares matter rather than sums. A compiled loop is one line; its parts are timed by themselves when
the method is "contact".
"""

import argparse
import cProfile
import pstats
from pathlib import Path

import numpy as np
from setting import DT, ground_motion, options, ring
from stepping import Run, warm_up
from timing import least, table, watched

import archfem as af
from archfem.compiled import kernel
from archfem.steppers import METHODS

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


def parts(run: Run, repeat: int) -> str:
    """Time the parts of the contact stepper's compiled loop, each by itself, on the dead load.

    Each call from Python costs about a microsecond, which the loop is spared.
    """
    method = run.stepper.method
    modes, (numbers, compliance) = method._modes, method._prepared(DT)
    size, law = len(modes.squares), method._law
    state, new = np.zeros((3, size)), np.zeros((3, size))
    state[0] = modes.shapes.T @ (run.model.mass @ run.dead.q)
    change, contact = np.zeros(size), np.zeros(size)
    points = len(modes.opening)
    jacobian, other, force = np.zeros((points, 2)), np.zeros((points, 2)), np.zeros(points)
    rests = np.zeros((len(modes.shear), 3))
    kernel._free(state, modes.weight, numbers, change, contact)
    gap, slips = modes.opening @ contact, modes.shear @ contact
    actions = {
        "all closed, in modes": lambda: kernel._free(state, modes.weight, numbers, change, contact),
        "openings from modes": lambda: modes.opening @ contact,
        "open points": lambda: kernel._settle(gap, compliance, law, jacobian, other, force),
        "Newmark's formulas": lambda: kernel.finish(
            state, new, change, (numbers.beta, numbers.gamma, DT, numbers.lag), contact
        ),
        "shear from modes": lambda: modes.shear @ contact,
        "resultants": lambda: kernel.joint_resultants(rests, gap, slips, law),
    }
    times = 2000
    rows = []
    for name, action in actions.items():
        action()

        def many(action=action):
            for _ in range(times):
                action()

        rows.append([name, f"{least(watched(many), times, repeat).cpu:.4f}"])
    open_points = int(np.count_nonzero(force))
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
        if method == "contact":
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
