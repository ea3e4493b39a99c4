"""Runs of archfem's steppers without recording, for timing."""

import numpy as np
from setting import DAMPING, DT
from timing import Clock, least, stopwatch, watched

import archfem as af
from archfem.dynamics.stepping.choice import stepper_for
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.steps import State
from archfem.models.jointed import Jointed


class Run:
    """A model ready to be shaken by one of the steppers, from its dead load.

    Attributes:
        setup: time it took to prepare the stepper [s].
    """

    def __init__(self, model: Jointed, motion: af.Motion, method: str) -> None:
        self.model = model
        self.motion = motion
        self.dead = af.dead_load(model)
        watch = stopwatch()
        equation = Equation(model, motion, DAMPING)
        self.start: State = equation.at_rest(self.dead.q)
        self.stepper = stepper_for(method, equation, self.start, DT)
        next(iter(self.stepper.batches(self.start, DT, DT)))
        self.setup = watch()[0]

    @property
    def steps(self) -> int:
        """How many there are."""
        return round(self.motion.duration / DT)

    def step(self) -> None:
        """Take all steps and keep nothing."""
        for _ in self.stepper.batches(self.start, DT, self.motion.duration):
            pass

    def clock(self, repeat: int) -> Clock:
        """Time a step."""
        return least(watched(self.step), self.steps, repeat)

    def resultants(self) -> np.ndarray:
        """N, V, M of every joint at every step, the start first (steps + 1, n_joints, 3)."""
        batches = self.stepper.batches(self.start, DT, self.motion.duration)
        first = self.model.resultants(self.dead.q)[None]
        return np.concatenate([first, *(batch.resultants for batch in batches)])


def warm_up(motion: af.Motion) -> None:
    """Compile what is compiled, on a small model."""
    small = af.build(
        af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=3, width=1.0),
        fidelity="rigid",
    )
    for method in ("contact", "chain", "compliance"):
        Run(small, motion.cut(0.0, 0.1), method).step()
