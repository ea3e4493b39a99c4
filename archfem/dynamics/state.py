"""States, steps and batches of steps, exchanged between solvers and the recorder of a run."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem._typing import Array
from archfem._validation import check_unmasked
from archfem.errors import InvalidInput
from archfem.models.model import Model, Observer


@dataclass(frozen=True, eq=False)
class State:
    """Displacements, velocities and joint memory at one time, relative to the ground.

    Attributes:
        time: time since the start of the motion [s].
        q: coordinates (n,).
        velocity: rates of the coordinates (n,).
        acceleration: rates of the velocities (n,).
        memory: irreversible slip of each joint point (p,) [m], followed by damage and openings of
            bonds where joints have any, as `Model.memory`; None for no slip.
        structure: `fingerprint` of the structure; None if unknown.
    """

    time: float
    q: Array
    velocity: Array
    acceleration: Array
    memory: Array | None = None
    structure: str | None = None

    def check(self, model: Model) -> None:
        """Refuse a state that does not fit a model.

        Args:
            model: model of the run to start from this state.

        Raises:
            InvalidInput: it is of another structure or size, or has values masked.
        """
        for name in ("q", "velocity", "acceleration"):
            check_unmasked(getattr(self, name), f"{name} of the state")
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
    """Consecutive steps of a run.

    Attributes:
        times: times at the ends of the steps (steps,) [s].
        resultants: N, V, M of every joint (steps, n_joints, 3) [N, N, N m].
        iterations: Newton iterations of each step (steps,).
        smallest_step: shortest substep taken in each step (steps,) [s].
        energy: kinetic and potential energy, work and loss of each step, as by
            `Equation.step_energy` (steps, 4) [J].
        state: function from the number of a step to the state at its end.
        fallback: whether a compiled solver failed and SNES took these steps.
        q: coordinates at the ends (steps, n); None to take them from the states.
        faces: gaps, sines of rotations and slips of joints at the ends, as for `Observer.read_many`
            (steps, 3, n_joints), if the solver measures them.
        readings: readings of the model's observer at the ends (steps, r), if they are stored.
    """

    times: Array
    resultants: Array
    iterations: NDArray[np.int64]
    smallest_step: Array
    energy: Array
    state: Callable[[int], State]
    fallback: bool = False
    q: Array | None = None
    faces: Array | None = None
    readings: Array | None = None

    def read(self, observer: Observer) -> Array:
        """Return the readings of an observer at the ends of the steps (steps, r).

        Args:
            observer: observer of the model of the run.
        """
        if self.readings is not None:
            return self.readings
        if self.q is not None:
            return observer.read_many(self.q, self.faces)
        return np.array([observer.read(self.state(k).q) for k in range(len(self.times))])

    def with_readings(self, observer: Observer) -> "Batch":
        """Return the batch with stored readings, which several monitors need.

        Args:
            observer: observer of the model of the run.
        """
        return replace(self, readings=self.read(observer))

    def cut(self, steps: int) -> "Batch":
        """Return the first steps of the batch.

        Args:
            steps: number of steps.
        """
        if steps == len(self.times):
            return self
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        arrays: Any = {key: v[:steps] for key, v in values.items() if isinstance(v, np.ndarray)}
        return replace(self, **arrays)


@dataclass(frozen=True, eq=False)
class Step:
    """One step of a run."""

    state: State  # at its end
    resultants: Array  # N, V, M of every joint (n_joints, 3) [N, N, N m]
    iterations: int  # of Newton's method
    smallest_step: float  # shortest substep taken [s]
    energy: Array  # kinetic, potential, work and loss, as by `Equation.step_energy` (4,) [J]

    @property
    def batch(self) -> "Batch":
        """Batch of this one step."""
        return Batch(
            np.array([self.state.time]),
            self.resultants[None],
            np.array([self.iterations]),
            np.array([self.smallest_step]),
            self.energy[None],
            lambda _: self.state,
        )

    def appended_to(self, first: "Step", *, mean: bool) -> "Step":
        """Return one step made of a first half and this second half."""
        # resultants of the conserving scheme are means over a step, those of others end values
        resultants = 0.5 * (first.resultants + self.resultants) if mean else self.resultants
        return replace(
            self,
            resultants=resultants,
            iterations=first.iterations + self.iterations,
            smallest_step=min(first.smallest_step, self.smallest_step),
            # kinetic and potential energy are those at the end, work and loss add up
            energy=self.energy + np.append(np.zeros(2), first.energy[2:]),
        )
