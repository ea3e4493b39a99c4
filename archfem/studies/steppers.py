"""Steppers that runs under many motions share: their matrices are ordered and factorised once.

What a run leaves in its matrices, such as which rows of a compliance it has found, is its own: each
run is given a copy of them as they were made, so that it does not depend on those before it.
"""

from copy import deepcopy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.stepping.choice import stepper_for
from archfem.dynamics.stepping.compliance import Compliance
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.sparse import SparseSystem
from archfem.dynamics.stepping.stepper import Stepper
from archfem.dynamics.stepping.strategy import Strategy
from archfem.dynamics.steps import State
from archfem.errors import InvalidInput
from archfem.motion.motion import Motion

KEPT = 8
"""How many lengths of steps there are kept matrices of: as many as a run of its own pace has."""

METHODS = ("compliance", "turning", "contact", "tangent", "snes")
"""Ways to step, of which the first that applies is taken: a choice by timing may differ."""


@dataclass(frozen=True, eq=False)
class Ready:
    """A way to step a model with some damping and scheme, ready for any motion.

    Attributes:
        equation: of motion, under any motion.
        strategy: takes the steps; None where SNES takes them all.
    """

    equation: Equation
    strategy: Strategy | None
    _systems: dict[float, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, equation: Equation, start: State, dt: float) -> "Ready":
        """Return the first way to step that applies, whatever else the machine does.

        Args:
            equation: of motion.
            start: state from which runs go.
            dt: a time step [s].
        """
        for method in METHODS:
            try:
                return cls(equation, stepper_for(method, equation, start, dt).strategy)
            except InvalidInput:
                continue
        return cls(equation, None)

    def under(self, motion: Motion) -> Stepper:
        """Return a fresh stepper for a run.

        Args:
            motion: of the ground.
        """
        return Shared(replace(self.equation, motion=motion), self.strategy, self._systems)


class Shared(Stepper):
    """A stepper whose matrices are copies of those that others have made.

    Args:
        equation: of motion.
        strategy: takes the steps; its matrices do not depend on the motion.
        systems: by time step, its matrices as they were made, to which this one adds.
    """

    def __init__(
        self, equation: Equation, strategy: Strategy | None, systems: dict[float, Any]
    ) -> None:
        super().__init__(equation, strategy)
        self._made = systems

    def prepared(self, state: State, dt: float, times: Array) -> tuple[Any, ...]:
        """Return what `loop.advance` takes, as `Stepper.prepared` does.

        Args:
            state: from which to go.
            dt: time step [s].
            times: ends of the steps (steps,) [s].
        """
        if dt not in self._systems:
            assert self.strategy is not None
            if dt not in self._made:
                self._made[dt] = self.strategy.system(dt)
                while len(self._made) > KEPT:
                    del self._made[next(iter(self._made))]
            self._systems[dt] = _copied(self._made[dt])
        return super().prepared(state, dt, times)


def _copied(system: Any) -> Any:
    """A copy of matrices with which no step has been made yet."""
    if not isinstance(system, SparseSystem):
        return deepcopy(system)
    empty = Compliance.of(np.empty_like(system.compliance.whole))  # as it is where no step was made
    return deepcopy(system, {id(system.compliance): empty})
