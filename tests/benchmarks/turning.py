"""Time of a step where displacements are large, beside the same with small ones.

    python tests/benchmarks/turning.py [--record FILE --scale 0.33] [--repeat 5]

The validation ring, damped, by each rule of the joints, with and without friction: both models take
turns in one process, and of each the least time counts. Then rings of 10 to 500 stones, and the
slope of a straight fit, log over log.
"""

from dataclasses import replace

import numpy as np
from setting import DT, ground_motion, options, ring
from timing import stopwatch, table

import archfem as af
from archfem.dynamics.stepping.choice import stepper_for

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))

RULES = {"exact": (1, 1), "nodal": (4, 1)}
"""Rules of the joints, and cells: one facet a joint, or five springs."""

BOUNDS = {"exact": 2.0, "nodal": 3.0}
"""What a step may cost, over one of small displacements."""

SIZES = (10, 17, 34, 68, 125, 250, 500)


def rubbing(voussoirs: int, friction: float | None) -> af.Structure:
    """The ring with one coefficient of friction in all joints."""
    bare = ring(voussoirs)
    joints = [replace(j, contact=replace(j.contact, friction=friction)) for j in bare.joints]
    return replace(bare, joints=tuple(joints))


class Stepped:
    """A model ready to be shaken, again and again.

    Attributes:
        least: shortest CPU time of a step so far [ms].
        passes: of Newton's method, or over the joints, a step.
        left: steps that a strategy left to SNES.
    """

    def __init__(
        self,
        motion: af.Motion,
        displacements: str,
        friction: float | None,
        rule: str = "exact",
        fidelity: str = "rigid",
        voussoirs: int = 17,
    ) -> None:
        model = af.build(
            rubbing(voussoirs, friction),
            fidelity=fidelity,
            cells=RULES[rule],
            quadrature=rule,
            displacements=displacements,
        )
        equation = af.dynamics.Equation(model, motion, DAMPING)
        dead = af.dead_load(model)
        self._start = equation.at_rest(dead.q, memory=dead.model.memory)
        self._stepper = stepper_for("auto", equation, self._start, DT)
        self._end = motion.duration
        self.least, self.passes, self.left = np.inf, 0.0, 0
        list(self._stepper.batches(self._start, DT, 4.0 * DT))  # compiled, and loaded

    @property
    def method(self) -> str:
        """Strategy that takes the steps."""
        return self._stepper.name

    def run(self) -> None:
        """Take all steps, and keep the time."""
        watch = stopwatch()
        batches = list(self._stepper.batches(self._start, DT, self._end))
        spent, count = watch()[1], sum(len(batch.times) for batch in batches)
        self.least = min(self.least, 1e3 * spent / count)
        self.passes = sum(float(batch.iterations.sum()) for batch in batches) / count
        self.left = sum(batch.fallback * len(batch.times) for batch in batches)


def beside(motion: af.Motion, repeat: int) -> str:
    """Small and large displacements in turn, by rule and friction."""
    rows = []
    for fidelity in ("rigid", "faces"):
        for rule, bound in BOUNDS.items():
            for friction in (None, 0.6):
                pair = [
                    Stepped(motion, each, friction, rule, fidelity) for each in ("small", "large")
                ]
                for _ in range(repeat):
                    for each in pair:
                        each.run()
                small, large = pair
                rows.append(
                    [
                        f"{fidelity}, {rule}, {friction}",
                        small.method,
                        *(f"{each.least:.4f}" for each in pair),
                        f"{large.least / small.least:.2f}",
                        bound if fidelity == "rigid" else "0.1 ms",
                        f"{small.passes:.2f}",
                        f"{large.passes:.2f}",
                        large.left,
                    ]
                )
    head = ["rung, rule, μ", "method", "small ms", "large ms", "ratio", "bound"]
    return table([*head, "passes", "passes, large", "SNES"], rows)


def growth(motion: af.Motion, repeat: int) -> str:
    """Time of a step over the number of stones, in turn."""
    runs = [Stepped(motion, "large", 0.6, voussoirs=count) for count in SIZES]
    for _ in range(repeat):
        for each in runs:
            each.run()
    rows = [
        [
            count,
            f"{each.least:.4f}",
            f"{each.passes:.2f}",
            f"{1e3 * each.least / count / each.passes:.2f}",
            each.left,
        ]
        for count, each in zip(SIZES, runs, strict=True)
    ]
    times = [each.least for each in runs]
    slope = np.polyfit(np.log(SIZES), np.log(times), 1)[0]
    head = ["stones", "ms a step", "passes", "µs a stone and pass", "SNES"]
    return f"{table(head, rows)}\nslope {slope:.2f}"


if __name__ == "__main__":
    chosen = options(__doc__.splitlines()[0]).parse_args()
    shaking = ground_motion(chosen)
    print(beside(shaking, chosen.repeat), flush=True)
    print(f"\n{growth(shaking.cut(0.0, 2.0), chosen.repeat)}")
