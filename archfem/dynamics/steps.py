"""What passes between steppers and those who run them: a state, a step, some steps."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from archfem.arguments import unmasked
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.models.gauges import Readings
from archfem.models.model import Model


@dataclass(frozen=True, eq=False)
class State:
    """Where a structure is and how it moves, relative to the ground.

    Attributes:
        time: since the motion began [s].
        q: coordinates (n,).
        velocity: their rates (n,).
        acceleration: the rates of those (n,).
        memory: how far each joint point has slid for good (p,) [m], then which bonds are broken
            where any joint has one (2 p,), as `Model.memory`; None where nothing has.
        structure: `fingerprint` of the structure whose state it is; None where nobody knows.
    """

    time: float
    q: Array
    velocity: Array
    acceleration: Array
    memory: Array | None = None
    structure: str | None = None

    def check(self, model: Model) -> None:
        """Refuse a state that cannot be one of a model.

        Args:
            model: that is to go on from it.

        Raises:
            InvalidInput: it is of another structure or size, or has values masked.
        """
        for name in ("q", "velocity", "acceleration"):
            unmasked(getattr(self, name), f"{name} of the state")
            shape = np.shape(getattr(self, name))
            if shape != (model.size,):
                raise InvalidInput(
                    f"{name} of the state has shape {shape}, and the model {model.size} "
                    "coordinates: give a state of the same model"
                )
        if self.structure not in (None, model.structure.fingerprint):
            raise InvalidInput(
                "the state is of another structure, whose blocks are elsewhere than those of "
                f"'{model.structure.name}': give the last_state of a run of the same model"
            )


@dataclass(frozen=True, eq=False)
class Batch:
    """Some steps of a run, one after another.

    Attributes:
        times: at their ends (steps,) [s].
        resultants: N, V, M of every joint (steps, n_joints, 3) [N, N, N m].
        iterations: of Newton's method, or passes over the open points (steps,).
        smallest: the smallest step that was needed to get there (steps,) [s].
        energy: kinetic, potential, work and loss of each step, as by `Meter.step` (steps, 4) [J].
        state: gives the state at the end of step k.
        fallback: whether these steps were given up by a strategy, and taken by SNES.
        readings: of the model's gauges at their ends (steps, r); None where they are to be read
            off the states.
    """

    times: Array
    resultants: Array
    iterations: NDArray[np.int64]
    smallest: Array
    energy: Array
    state: Callable[[int], State]
    fallback: bool = False
    readings: Array | None = None

    def read(self, gauges: Readings) -> Array:
        """Return the readings of gauges at the ends of the steps (steps, r).

        Args:
            gauges: of the model that moves.
        """
        if self.readings is not None:
            return self.readings
        return np.array([gauges.read(self.state(k).q) for k in range(len(self.times))])

    def cut(self, steps: int) -> "Batch":
        """Return the first steps of the batch.

        Args:
            steps: how many.
        """
        if steps == len(self.times):
            return self
        return replace(
            self,
            times=self.times[:steps],
            resultants=self.resultants[:steps],
            iterations=self.iterations[:steps],
            smallest=self.smallest[:steps],
            energy=self.energy[:steps],
            readings=None if self.readings is None else self.readings[:steps],
        )


@dataclass(frozen=True, eq=False)
class Step:
    """One step of a run.

    Attributes:
        state: at its end.
        resultants: N, V, M of every joint (n_joints, 3) [N, N, N m].
        iterations: of Newton's method.
        smallest: the smallest step that was needed to get there [s].
        energy: kinetic, potential, work and loss, as by `Meter.step` (4,) [J].
    """

    state: State
    resultants: Array
    iterations: int
    smallest: float
    energy: Array

    @property
    def batch(self) -> "Batch":
        """The step as a batch of one."""
        return Batch(
            np.array([self.state.time]),
            self.resultants[None],
            np.array([self.iterations]),
            np.array([self.smallest]),
            self.energy[None],
            lambda _: self.state,
        )

    def after(self, first: "Step", *, mean: bool) -> "Step":
        """Return this step as the second half of a longer one.

        Args:
            first: its first half, whose effort, work and loss count too.
            mean: whether resultants are means over a step, as of the conserving scheme; else they
                are those at its end.
        """
        resultants = 0.5 * (first.resultants + self.resultants) if mean else self.resultants
        return replace(
            self,
            resultants=resultants,
            iterations=first.iterations + self.iterations,
            smallest=min(first.smallest, self.smallest),
            energy=self.energy + np.append(np.zeros(2), first.energy[2:]),
        )
