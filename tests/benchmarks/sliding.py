"""Time of a step with joints that slide, beside that of joints that never do.

    python tests/benchmarks/sliding.py [--repeat 5 --fidelity rigid]
    python tests/benchmarks/sliding.py --fidelity bridge [--repeat 2 --scene]

The validation ring, damped, under a synthetic motion of 0.5 g, by the compiled strategies and the
conserving scheme; or the bridge, its stones with faces and all of its soil, likewise, or under the
first pair of its own scene, as strong as there and three times so. The least of some runs by turns;
passes a step, how far joints slid, and how many steps SNES had to take.
"""

import argparse
import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
from setting import ring
from timing import stopwatch

import archfem as af
from archfem.dynamics.stepping.choice import stepper_for

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))

MOTION = af.Motion.synthetic(duration=5.0, pga=5.0, seed=1)

DT = 0.005

SCENE = Path(__file__).parents[2] / "meshes" / "prusias.toml"

BRIDGE = af.Motion.synthetic(duration=2.0, pga=4.9, seed=3, vertical_ratio=0.5)

BRIDGE_DAMPING = af.Rayleigh(0.05, (3.0, 12.0))


def rubbing(friction: float | None, bridge: bool) -> af.Structure:
    """Return the ring, or the bridge, with one coefficient of friction in all joints."""
    bare = af.Case.read(SCENE).structure if bridge else ring()
    joints = [replace(j, contact=replace(j.contact, friction=friction)) for j in bare.joints]
    return replace(bare, joints=tuple(joints))


class Case:
    """A ring ready to be shaken, and what its runs so far have shown.

    Attributes:
        spent: least milliseconds a step of CPU time.
        passes: a step.
        far: the most that a point slid [m].
        left: steps taken by SNES.
    """

    def __init__(
        self, fidelity: str, rule: str, method: str, friction: float | None, motion: af.Motion
    ) -> None:
        bridge = fidelity == "bridge"
        rung = {"backfill": "full", "rest": "faces"} if bridge else fidelity
        model = af.build(rubbing(friction, bridge), fidelity=rung, quadrature=rule)
        self._motion = motion
        damping = BRIDGE_DAMPING if bridge else DAMPING
        equation = af.dynamics.Equation(model, self._motion, damping)
        dead = af.dead_load(model)
        self._start = equation.at_rest(dead.q, memory=dead.model.memory)
        self._stepper = stepper_for(method, equation, self._start, DT)
        for _ in self._stepper.batches(self._start, DT, 0.1):  # compiled, and loaded
            pass
        self.method = self._stepper.name
        self.spent, self.passes, self.far, self.left = np.inf, 0.0, 0.0, 0

    def run(self) -> None:
        """Take all steps once more."""
        watch = stopwatch()
        batches = list(self._stepper.batches(self._start, DT, self._motion.duration))
        spent = watch()[1]
        count = sum(len(batch.times) for batch in batches)
        self.spent = min(self.spent, 1e3 * spent / count)
        self.passes = sum(float(batch.iterations.sum()) for batch in batches) / count
        self.left = sum(len(batch.times) for batch in batches if batch.fallback)
        memory = batches[-1].state(len(batches[-1].times) - 1).memory
        self.far = 0.0 if memory is None else float(np.abs(memory).max(initial=0.0))


def compared(
    fidelity: str,
    rule: str,
    methods: dict[float | None, str],
    repeat: int,
    motion: af.Motion = MOTION,
) -> None:
    """Print a line for each coefficient of friction and its method; they run by turns."""
    cases = {mu: Case(fidelity, rule, method, mu, motion) for mu, method in methods.items()}
    for _ in range(repeat):
        for case in cases.values():
            case.run()
    for friction, case in cases.items():
        print(
            f"{fidelity:10} {rule:8} {case.method:10} {friction!s:>8} {case.spent:8.4f} "
            f"{case.spent / cases[None].spent:6.2f} {case.passes:6.2f} {1e3 * case.far:8.2f} "
            f"{case.left:4d}",
            flush=True,
        )


def main() -> None:
    """Print a line a case; those of one rung, rule and method run by turns."""
    made = argparse.ArgumentParser(description=__doc__)
    made.add_argument("--repeat", type=int, default=5, help="times that each run is timed")
    made.add_argument("--fidelity", help="only this rung, or 'bridge'")
    made.add_argument("--scene", action="store_true", help="the bridge under its own first pair")
    asked = made.parse_args()
    print(
        f"{'rung':10} {'rule':8} {'method':10} {'friction':>8} {'ms/step':>8} {'ratio':>6} "
        f"{'passes':>6} {'slid mm':>8} SNES"
    )
    if asked.fidelity == "bridge":
        own = af.Case.read(SCENE).ground_suite().motions[0]
        motions = [own, own.scaled(3.0)] if asked.scene else [BRIDGE]
        for motion, method in itertools.product(motions, ("compliance", "tangent")):
            methods = {None: "compliance", 0.6: method, 0.3: method}
            compared("bridge", "exact", methods, asked.repeat, motion)
        return
    for fidelity in [asked.fidelity] if asked.fidelity else ["rigid", "faces", "condensed"]:
        for rule in ("lobatto", "exact"):
            for method in ("contact", "compliance"):
                compared(fidelity, rule, dict.fromkeys((None, 0.6, 0.3), method), asked.repeat)


if __name__ == "__main__":
    main()
