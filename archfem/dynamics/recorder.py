"""What a run leaves behind: records of its steps, the effort they took, and its energy balance."""

from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.guard import Guard
from archfem.dynamics.history import SIGNS, Ending, History
from archfem.dynamics.steps import Batch, State
from archfem.joints.criteria import Criteria
from archfem.joints.resultants import joint_dataset
from archfem.models.model import Model
from archfem.motion.motion import Motion

_EFFORT = {
    "iterations": {"long_name": "Newton iterations, or passes, since the last record"},
    "smallest_step": {"units": "s", "long_name": "smallest step taken since the last record"},
    "energy_drift": {"units": "J", "long_name": "energy from nowhere since the start"},
}


@dataclass
class Recorder:
    """What has been recorded so far.

    Attributes:
        model: that moves.
        method: name of its stepper.
        dt: time step that was asked for [s].
        every: the joints' resultants are kept at every n-th step.
        fields_every: coordinates are kept at every n-th step; None keeps none.
        criteria: by which joints are judged.
        guard: watches over what is recorded.
        halved: steps that had to be halved.
        fallback: steps that a compiled stepper left to SNES.
    """

    model: Model
    method: str
    dt: float
    every: int
    fields_every: int | None
    criteria: Criteria
    guard: Guard
    times: list[float] = field(default_factory=list)
    resultants: list[Array] = field(default_factory=list)
    effort: list[tuple[int, float, float]] = field(default_factory=list)
    frames: list[float] = field(default_factory=list)
    fields: list[Array] = field(default_factory=list)
    halved: int = 0
    fallback: int = 0
    _iterations: int = 0
    _smallest: float = np.inf

    def add(self, first: int, batch: Batch, *, last: bool = False) -> None:
        """Keep of a batch, whose steps count from `first`, what was asked for.

        Args:
            first: number of its first step.
            batch: steps that follow those kept so far.
            last: whether an event ends the run with it; its last resultants are then kept anyhow,
                since they are what ended it.

        Raises:
            DidNotConverge: the guard is certain that what was kept is wrong.
        """
        drift = self.guard.add(batch)
        self.halved += int(np.sum(batch.smallest < 0.75 * self.dt))
        self.fallback += batch.fallback * len(batch.times)
        for k, number in enumerate(range(first, first + len(batch.times))):
            self._iterations += int(batch.iterations[k])
            self._smallest = min(self._smallest, float(batch.smallest[k]))
            if number % self.every == 0 or (last and k == len(batch.times) - 1):
                self.times.append(batch.times[k])
                self.resultants.append(batch.resultants[k])
                self.effort.append((self._iterations, self._smallest, float(drift[k])))
                self._iterations, self._smallest = 0, np.inf
            if self.fields_every and number % self.fields_every == 0:
                self.frames.append(batch.times[k])
                self.fields.append(batch.state(k).q)
        self.guard.judge()

    def history(self, motion: Motion, state: State, ended: Ending, outcome: str) -> History:
        """Everything as one dataset.

        Args:
            motion: of the ground.
            state: in which the run ended.
            ended: how it did.
            outcome: the same in words.
        """
        times, resultants = np.array(self.times), np.array(self.resultants)
        dataset = joint_dataset(self.model.structure, resultants, times, self.criteria)
        ground = motion.at(times)
        dataset["ground"] = (
            ("time", "axis"),
            ground,
            {"units": "m/s2", "long_name": "acceleration of the ground"},
        )
        dataset.coords["axis"] = ["x", "y"]
        for (name, about), values in zip(
            _EFFORT.items(), zip(*self.effort, strict=True), strict=True
        ):
            dataset[name] = ("time", np.array(values), about)
        if self.fields:
            dataset.coords["frame_time"] = ("frame", self.frames, {"units": "s"})
            dataset["q"] = (("frame", "coordinate"), np.array(self.fields))
        for name in ("q", "velocity", "acceleration"):
            dataset[f"last_{name}"] = ("coordinate", getattr(state, name))
        dataset.attrs |= {
            "title": f"time history of {self.model.structure.name} under {motion.name or 'motion'}",
            "outcome": outcome,
            "ended": str(ended),
            "fidelity": self.model.fidelity,
            "method": self.method,
            "last_time": state.time,
            "energy_drift": self.guard.worst,
            "largest_displacement": self.guard.largest_displacement,
            "halved_steps": self.halved,
            "fallback_steps": self.fallback,
            "signs": SIGNS,
            "versions": versions(),
        }
        if self.model.prediction:
            dataset.attrs["predicted_error"] = self.model.prediction.error
        return History(dataset, self.model.structure)


def versions() -> str:
    """Versions of the libraries that results depend on."""
    found = []
    for name in ("archfem", "numpy", "scipy", "petsc4py", "fenics-dolfinx", "gmsh"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(found)
