"""Time of a step with joints that slide, beside that of joints that never do.

    python tests/benchmarks/sliding.py

The validation ring, damped, under a synthetic motion of 0.5 g, by the compiled strategies and the
conserving scheme; how far joints slid, and how many steps SNES had to take.
"""

from dataclasses import replace

import numpy as np
from setting import ring
from timing import stopwatch

import archfem as af
from archfem.dynamics.stepping.choice import stepper_for

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))

MOTION = af.Motion.synthetic(duration=5.0, pga=5.0, seed=1)

DT = 0.005


def rubbing(friction: float | None) -> af.Structure:
    """Return the ring with one coefficient of friction in all joints."""
    bare = ring()
    joints = [replace(j, contact=replace(j.contact, friction=friction)) for j in bare.joints]
    return replace(bare, joints=tuple(joints))


def timed(model, method: str) -> tuple[float, float, int]:
    """Milliseconds a step of CPU time, the most a point slid [m], and steps taken by SNES."""
    equation = af.dynamics.Equation(model, MOTION, DAMPING)
    dead = af.dead_load(model)
    start = equation.at_rest(dead.q, memory=dead.model.memory)
    stepper = stepper_for(method, equation, start, DT)
    for _ in stepper.batches(start, DT, 0.1):  # compiled, and loaded
        pass
    watch = stopwatch()
    batches = list(stepper.batches(start, DT, MOTION.duration))
    spent = watch()[0]
    count = sum(len(batch.times) for batch in batches)
    left = sum(len(batch.times) for batch in batches if batch.fallback)
    memory = batches[-1].state(len(batches[-1].times) - 1).memory
    far = 0.0 if memory is None else float(np.abs(memory).max(initial=0.0))
    return 1e3 * spent / count, far, left


def main() -> None:
    """Print a line a case."""
    print(
        f"{'rung':10} {'rule':8} {'method':10} {'friction':>8} {'ms/step':>8} {'slid mm':>8} SNES"
    )
    for fidelity in ("rigid", "faces", "condensed"):
        for rule in ("lobatto", "exact"):
            for method in ("contact", "compliance"):
                for friction in (None, 0.6, 0.3):
                    model = af.build(rubbing(friction), fidelity=fidelity, quadrature=rule)
                    spent, far, left = timed(model, method)
                    print(
                        f"{fidelity:10} {rule:8} {method:10} {friction!s:>8} {spent:8.3f} "
                        f"{1e3 * far:8.2f} {left:4d}",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
