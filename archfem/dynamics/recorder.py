"""What a run leaves behind: records of its steps, the effort they took, and its energy balance."""

from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.dynamics.corners import corner_displacements
from archfem.dynamics.guard import Guard
from archfem.dynamics.history import SIGNS, Ending, History
from archfem.dynamics.steps import Batch, State
from archfem.joints.criteria import Criteria
from archfem.joints.resultants import joint_dataset
from archfem.models.gauges import Gauges, Readings
from archfem.models.model import Model
from archfem.models.moving import Moving
from archfem.motion.motion import Motion

_EFFORT = {
    "iterations": {"long_name": "Newton iterations, or passes, since the last record"},
    "smallest_step": {"units": "s", "long_name": "smallest step taken since the last record"},
    "energy_drift": {"units": "J", "long_name": "energy from nowhere since the start"},
}


class Rows:
    """Rows of one array, filled step by step; it is made anew, twice as long, where it is full.

    Args:
        most: rows that there may be.
        shape: of each row.
        kind: of the numbers.
    """

    def __init__(self, most: int, shape: tuple[int, ...] = (), kind: type = float) -> None:
        self._array: NDArray[Any] = np.empty((most, *shape), kind)
        self.count = 0

    def add(self, rows: NDArray[Any]) -> None:
        """Fill the next rows.

        Args:
            rows: (some, …), with the shape of the others.
        """
        if self.count + len(rows) > len(self._array):
            longer = np.empty(
                (2 * self.count + len(rows), *self._array.shape[1:]), self._array.dtype
            )
            longer[: self.count] = self.values
            self._array = longer
        self._array[self.count : self.count + len(rows)] = rows
        self.count += len(rows)

    @property
    def values(self) -> NDArray[Any]:
        """The rows filled so far (count, …)."""
        return self._array[: self.count]


class Reach:
    """How far each block has moved from where it was at the start of a run.

    Args:
        gauges: of the model that moves.
    """

    def __init__(self, gauges: Readings) -> None:
        self._gauges = gauges
        self._start: Array | None = None

    def add(self, times: Array, readings: Array) -> None:
        """Look at some steps.

        Args:
            times: at their ends (steps,) [s]; the first step of all is the start.
            readings: of the gauges (steps, r).
        """
        middles = self._gauges.middles(readings)
        if self._start is None:
            blocks = middles.shape[1]
            self._start, self._when = middles[0], np.full(blocks, times[0])
            self._square = np.zeros(blocks)
        squares = np.square(middles - self._start).sum(axis=-1)
        farthest = squares.argmax(axis=0)
        found = squares[farthest, np.arange(len(farthest))]
        self._when = np.where(found > self._square, times[farthest], self._when)
        self._square, self._last = np.maximum(found, self._square), squares[-1]

    def variables(self) -> dict[str, tuple[str, Array, dict[str, str]]]:
        """What was found, as variables of a dataset over block."""
        about = "displacement of its middle"
        words = {
            "largest_displacement": (np.sqrt(self._square), "m", f"largest {about}"),
            "largest_displacement_time": (self._when, "s", f"time of the largest {about}"),
            "residual_displacement": (np.sqrt(self._last), "m", f"{about} at the end"),
        }
        return {
            name: ("block", values, {"units": units, "long_name": text})
            for name, (values, units, text) in words.items()
        }


@dataclass(kw_only=True)
class Recorder:
    """What has been recorded so far, from the start of a run.

    Attributes:
        model: that moves.
        method: name of its stepper.
        dt: time step that was asked for [s]; None where steps have lengths of their own.
        steps: that the run may take, its start not counted.
        every: the joints' resultants are kept at every n-th step.
        fields_every: coordinates are kept at every n-th step; None keeps none.
        criteria: by which joints are judged.
        guard: watches over what is recorded.
        state: at the end of the steps added last.
        fallback: steps that a strategy left to SNES.
    """

    model: Model
    method: str
    dt: float | None
    steps: int
    every: int
    fields_every: int | None
    criteria: Criteria
    guard: Guard
    state: State
    fallback: int = 0

    def __post_init__(self) -> None:
        most, frames = self.steps + 1, self.steps // (self.fields_every or self.steps + 1) + 1
        records = self.steps // self.every + 2  # the start, and a last one that an event asks for
        self._iterations = Rows(most, kind=np.int64)
        self._smallest, self._drift = Rows(most), Rows(most)
        self._numbers, self._times = Rows(records, kind=np.intp), Rows(records)
        joints = len(self.model.structure.joints)
        self._gauges = Gauges.on(self.model)
        self._faces = Rows(records, (3, joints))
        self._reach = Reach(self._gauges)
        self._resultants = Rows(records, (joints, 3))
        self._frames, self._fields = Rows(frames), Rows(frames, (self.model.size,))

    def add(self, batch: Batch, *, last: bool = False) -> None:
        """Keep of a batch what was asked for.

        Args:
            batch: steps that follow those kept so far; the first is the start, alone.
            last: whether an event ends the run with it; its last resultants are then kept anyhow,
                since they are what ended it.

        Raises:
            DidNotConverge: the guard is certain that what was kept is wrong.
        """
        self.state = batch.state(len(batch.times) - 1)
        readings = batch.read(self._gauges)
        drift = self.guard.add(batch, readings)
        self._reach.add(batch.times, readings)
        numbers = self._drift.count + np.arange(len(batch.times))
        kept = numbers % self.every == 0
        kept[-1] |= last
        for rows, values in (  # Ctrl-C may come between any two: what is filled last counts
            (self._iterations, batch.iterations),
            (self._smallest, batch.smallest),
            (self._drift, drift),
            (self._numbers, numbers[kept]),
            (self._times, batch.times[kept]),
            (self._faces, self._gauges.faces(readings[kept])),
            (self._resultants, batch.resultants[kept]),
        ):
            rows.add(values)
        self.fallback += batch.fallback * len(batch.times)
        if self.fields_every:
            for k in np.flatnonzero(numbers % self.fields_every == 0).tolist():
                self._frames.add(batch.times[k : k + 1])
                self._fields.add(batch.state(k).q[None])
        self.guard.judge()

    def history(self, motion: Motion, ended: Ending, outcome: str) -> History:
        """Return everything as one dataset.

        Args:
            motion: of the ground.
            ended: how the run ended.
            outcome: the same in words.
        """
        structure, resultants = self.model.structure, self._resultants.values
        times, faces = (rows.values[: len(resultants)] for rows in (self._times, self._faces))
        moved = isinstance(self.model, Moving)
        dataset = joint_dataset(
            structure, resultants, times, self.criteria, faces=faces, moved=moved
        )
        about = {"units": "m/s2", "long_name": "acceleration of the ground"}
        variables: dict[str, Any] = self._reach.variables()
        variables["ground"] = ("time", "axis"), motion.at(times), about
        for (name, words), values in zip(_EFFORT.items(), self._effort(), strict=True):
            variables[name] = "time", values, words
        dataset = dataset.assign_coords(
            block=[block.name for block in structure.blocks], axis=["x", "y"]
        ).assign(variables)
        dataset = self._with_coordinates(dataset)
        dataset.attrs |= {
            "title": f"{structure.name}: {motion.name or 'time history'}",
            "motion": motion.name,
            "outcome": outcome,
            "ended": str(ended),
            "fidelity": self.model.fidelity,
            "structure": structure.fingerprint,
            "method": self.method,
            "last_time": self.state.time,
            "energy_drift": self.guard.worst,
            "largest_displacement": self.guard.largest_displacement,
            "largest_turn": self.guard.largest_turn,
            "doubts": "\n".join(self.guard.doubts),
            "halved_steps": int(np.sum(self._smallest.values < 0.75 * self.dt)) if self.dt else 0,
            "shortest_step": float(self._smallest.values[1:].min(initial=np.inf)),
            "steps": self._drift.count - 1,
            "fallback_steps": self.fallback,
            "signs": SIGNS,
            "versions": versions(),
        }
        if self.model.prediction:
            dataset.attrs["predicted_error"] = self.model.prediction.error
        return History(dataset, structure)

    def _effort(self) -> tuple[NDArray[np.int64], Array, Array]:
        """Iterations and smallest step since the record before, and drift, at each record."""
        ends = self._numbers.values[: self._resultants.count]
        starts, recorded = np.append(0, ends[:-1] + 1), ends[-1] + 1
        return (
            np.add.reduceat(self._iterations.values[:recorded], starts),
            np.minimum.reduceat(self._smallest.values[:recorded], starts),
            self._drift.values[ends],
        )

    def _with_coordinates(self, dataset: xr.Dataset) -> xr.Dataset:
        """Return the dataset with the coordinates that were kept, and the state at the end."""
        if frames := self._fields.count:
            dataset.coords["frame_time"] = "frame", self._frames.values[:frames], {"units": "s"}
            dataset["q"] = ("frame", "coordinate"), self._fields.values
            dataset.update(corner_displacements(self.model, self._fields.values))
        last: dict[str, Any] = {
            f"last_{name}": ("coordinate", getattr(self.state, name))
            for name in ("q", "velocity", "acceleration")
        }
        if self.state.memory is not None:
            last["last_memory"] = "point", self.state.memory
        return dataset.assign(last)


@cache
def versions() -> str:
    """Versions of the libraries that results depend on."""
    found = []
    for name in ("archfem", "numpy", "scipy", "petsc4py", "fenics-dolfinx", "gmsh"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(found)
