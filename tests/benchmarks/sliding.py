"""Time of a step with joints that slide, beside that of joints that never do.

    python tests/benchmarks/sliding.py [--repeat 5 --fidelity rigid]

The validation ring, damped, under a synthetic motion of 0.5 g, by the compiled strategies and the
conserving scheme; the least of some runs by turns; how far joints slid, and how many steps SNES had
to take.
"""

import argparse
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


class Case:
    """A ring ready to be shaken, and what its runs so far have shown.

    Attributes:
        spent: least milliseconds a step of CPU time.
        far: the most that a point slid [m].
        left: steps taken by SNES.
    """

    def __init__(self, fidelity: str, rule: str, method: str, friction: float | None) -> None:
        model = af.build(rubbing(friction), fidelity=fidelity, quadrature=rule)
        equation = af.dynamics.Equation(model, MOTION, DAMPING)
        dead = af.dead_load(model)
        self._start = equation.at_rest(dead.q, memory=dead.model.memory)
        self._stepper = stepper_for(method, equation, self._start, DT)
        for _ in self._stepper.batches(self._start, DT, 0.1):  # compiled, and loaded
            pass
        self.spent, self.far, self.left = np.inf, 0.0, 0

    def run(self) -> None:
        """Take all steps once more."""
        watch = stopwatch()
        batches = list(self._stepper.batches(self._start, DT, MOTION.duration))
        spent = watch()[1]
        count = sum(len(batch.times) for batch in batches)
        self.spent = min(self.spent, 1e3 * spent / count)
        self.left = sum(len(batch.times) for batch in batches if batch.fallback)
        memory = batches[-1].state(len(batches[-1].times) - 1).memory
        self.far = 0.0 if memory is None else float(np.abs(memory).max(initial=0.0))


def main() -> None:
    """Print a line a case; those of one rung, rule and method run by turns."""
    made = argparse.ArgumentParser(description=__doc__)
    made.add_argument("--repeat", type=int, default=5, help="times that each run is timed")
    made.add_argument("--fidelity", help="only this rung")
    asked = made.parse_args()
    print(
        f"{'rung':10} {'rule':8} {'method':10} {'friction':>8} {'ms/step':>8} {'ratio':>6} "
        f"{'slid mm':>8} SNES"
    )
    for fidelity in [asked.fidelity] if asked.fidelity else ["rigid", "faces", "condensed"]:
        for rule in ("lobatto", "exact"):
            for method in ("contact", "compliance"):
                cases = {mu: Case(fidelity, rule, method, mu) for mu in (None, 0.6, 0.3)}
                for _ in range(asked.repeat):
                    for case in cases.values():
                        case.run()
                for friction, case in cases.items():
                    print(
                        f"{fidelity:10} {rule:8} {method:10} {friction!s:>8} {case.spent:8.4f} "
                        f"{case.spent / cases[None].spent:6.2f} {1e3 * case.far:8.2f} "
                        f"{case.left:4d}",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
