"""Recording of a run: joint resultants, block displacements, solver effort and energy drift."""

from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.dynamics.fall import list_stones
from archfem.dynamics.history import SIGN_CONVENTION, Ending, History, corner_displacements
from archfem.dynamics.monitor import RunMonitor
from archfem.dynamics.state import Batch, State
from archfem.joints.criteria import Criteria
from archfem.joints.resultants import joint_dataset
from archfem.models.model import Doubt, Model
from archfem.motion.motion import Motion


class GrowingArray:
    """Array filled row by row, reallocated at twice the size when full."""

    def __init__(self, capacity: int, shape: tuple[int, ...] = (), dtype: type = float) -> None:
        self._array: NDArray[Any] = np.empty((capacity, *shape), dtype)
        self.count = 0

    def add(self, rows: NDArray[Any]) -> None:
        """Fill the next rows."""
        if self.count + len(rows) > len(self._array):
            capacity = 2 * self.count + len(rows)
            longer = np.empty((capacity, *self._array.shape[1:]), self._array.dtype)
            longer[: self.count] = self.values
            self._array = longer
        self._array[self.count : self.count + len(rows)] = rows
        self.count += len(rows)

    @property
    def values(self) -> NDArray[Any]:
        """Rows filled so far (count, …)."""
        return self._array[: self.count]


@dataclass(kw_only=True)
class Recorder:
    """Record of a run from its start, with its validity checks."""

    model: Model
    method: str  # name of the solver
    dt: float | None  # constant time step [s]; None for steps of varying length
    steps: int  # largest number of steps of the run, its start not counted
    every: int  # interval of steps at which joint resultants are recorded
    fields_every: int | None  # interval at which coordinates are recorded; None for none
    criteria: Criteria  # for the failure flags of joints
    monitor: RunMonitor
    state: State  # at the end of the steps added last
    fallback: int = 0  # number of steps at which a compiled solver fell back to SNES

    def __post_init__(self) -> None:
        capacity = self.steps + 1
        frames = self.steps // (self.fields_every or self.steps + 1) + 1
        # two more: the start, and the last step if an event ends the run
        records = self.steps // self.every + 2
        self._iterations = GrowingArray(capacity, dtype=np.int64)
        self._smallest, self._drift = GrowingArray(capacity), GrowingArray(capacity)
        self._numbers, self._times = GrowingArray(records, dtype=np.intp), GrowingArray(records)
        joints = len(self.model.structure.joints)
        self._observer = self.model.observer()
        self._faces = GrowingArray(records, (3, joints))
        self._resultants = GrowingArray(records, (joints, 3))
        self._frames, self._fields = GrowingArray(frames), GrowingArray(frames, (self.model.size,))

    def add(self, batch: Batch, *, last: bool = False) -> None:
        """Record the steps of a batch that are due, and check all of them."""
        self.state = batch.state(len(batch.times) - 1)
        readings = batch.read(self._observer)
        drift = self.monitor.add(batch, readings)
        numbers = self._drift.count + np.arange(len(batch.times))
        due = numbers % self.every == 0
        due[-1] |= last
        # Ctrl-C may come between any two: the number of resultants, filled last, counts
        for rows, values in (
            (self._iterations, batch.iterations),
            (self._smallest, batch.smallest_step),
            (self._drift, drift),
            (self._numbers, numbers[due]),
            (self._times, batch.times[due]),
            (self._faces, self._observer.faces(readings[due])),
            (self._resultants, batch.resultants[due]),
        ):
            rows.add(values)
        self.fallback += batch.fallback * len(batch.times)
        if self.fields_every:
            for k in np.flatnonzero(numbers % self.fields_every == 0).tolist():
                self._frames.add(batch.times[k : k + 1])
                self._fields.add(batch.state(k).q[None])
        self.monitor.check_run()

    def build_history(self, motion: Motion, ending: Ending, outcome: str) -> History:
        """Return the record as a history."""
        effort_attributes = {
            "iterations": {"long_name": "Newton iterations, or passes, since the last record"},
            "smallest_step": {
                "units": "s",
                "long_name": "smallest step taken since the last record",
            },
            "energy_drift": {"units": "J", "long_name": "energy from nowhere since the start"},
        }
        structure, resultants = self.model.structure, self._resultants.values
        times, faces = (rows.values[: len(resultants)] for rows in (self._times, self._faces))
        moved = self.model.large_displacements
        dataset = joint_dataset(
            structure, resultants, times, self.criteria, faces=faces, moved=moved
        )
        attributes = {"units": "m/s2", "long_name": "acceleration of the ground"}
        variables: dict[str, Any] = self._block_displacements()
        variables["ground"] = ("time", "axis"), motion.at(times), attributes
        for (name, attrs), values in zip(effort_attributes.items(), self._effort(), strict=True):
            variables[name] = "time", values, attrs
        dataset = dataset.assign_coords(
            block=[block.name for block in structure.blocks], axis=["x", "y"]
        ).assign(variables)
        dataset = self._with_coordinates(dataset)
        dataset.attrs |= self._attributes(motion, ending, outcome)
        history = History(dataset, structure)
        return history.with_doubts((*self.monitor.doubts, *self._doubt_mass_damping(dataset)))

    def _block_displacements(self) -> dict[str, tuple[str, Array, dict[str, str]]]:
        """Return displacements of all blocks as variables of a dataset; zero for fixed blocks."""
        displacements = self.monitor.displacements
        subject = "displacement of its farthest corner"
        columns = {
            "largest_displacement": (displacements.largest, "m", f"largest {subject}"),
            "largest_displacement_time": (
                displacements.time,
                "s",
                f"time of the largest {subject}",
            ),
            "residual_displacement": (displacements.residual, "m", f"{subject} at the end"),
        }
        variables = {}
        for name, (values, units, text) in columns.items():
            of_all = np.zeros(len(self.model.structure.blocks))
            of_all[displacements.blocks] = values
            variables[name] = "block", of_all, {"units": units, "long_name": text}
        return variables

    def _doubt_mass_damping(self, dataset: xr.Dataset) -> list[Doubt]:
        """Return a doubt where joints opened and damping drags loose blocks."""
        share = self.monitor.mass_damping_share
        opens = bool((dataset["open"] | (dataset["hinge"] != 0)).any())
        if not share or not opens:
            return []
        cause = (
            "damping has a part proportional to mass, which also drags loose blocks, and joints "
            f"opened: that part took {share:.0%} of the energy lost"
        )
        return [Doubt(cause, "use effective_damping(model, ratio) or StiffnessDamping")]

    def _attributes(self, motion: Motion, ending: Ending, outcome: str) -> dict[str, Any]:
        """Return the scalar results and settings of the run."""
        structure, monitor, smallest = self.model.structure, self.monitor, self._smallest.values
        stones = np.isin(monitor.displacements.blocks, list_stones(structure))
        attributes = {
            "title": f"{structure.name}: {motion.name or 'time history'}",
            "motion": motion.name,
            "outcome": outcome,
            "ended": str(ending),
            "fidelity": self.model.fidelity,
            "structure": structure.fingerprint,
            "method": self.method,
            "last_time": self.state.time,
            "energy_drift": monitor.worst_drift,
            "displacements": "large" if self.model.large_displacements else "small",
            "displacement": float(monitor.displacements.largest[stones].max()),
            "residual": float(monitor.displacements.residual[stones].max()),
            "largest_turn": monitor.largest_turn,
            # halved steps are dt/2 or shorter; 0.75 lies clear of round-off
            "halved_steps": int(np.sum(smallest < 0.75 * self.dt)) if self.dt else 0,
            "shortest_step": float(smallest[1:].min(initial=np.inf)),
            "steps": self._drift.count - 1,
            "fallback_steps": self.fallback,
            "signs": SIGN_CONVENTION,
            "versions": library_versions(),
        }
        if self.model.prediction:
            attributes["predicted_error"] = self.model.prediction.error
        return attributes

    def _effort(self) -> tuple[NDArray[np.int64], Array, Array]:
        """Return iterations and smallest step since the previous record, and drift, by record."""
        ends = self._numbers.values[: self._resultants.count]
        starts, recorded = np.append(0, ends[:-1] + 1), ends[-1] + 1
        return (
            np.add.reduceat(self._iterations.values[:recorded], starts),
            np.minimum.reduceat(self._smallest.values[:recorded], starts),
            self._drift.values[ends],
        )

    def _with_coordinates(self, dataset: xr.Dataset) -> xr.Dataset:
        """Return the dataset with the recorded coordinates and the state at the end."""
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
def library_versions() -> str:
    """Return the versions of the libraries that results depend on."""
    versions = []
    for name in ("archfem", "numpy", "scipy", "petsc4py", "fenics-dolfinx", "gmsh"):
        try:
            versions.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(versions)
