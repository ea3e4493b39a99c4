"""Recording of a run: joint resultants, block displacements, solver effort and energy drift."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._typing import Array
from archfem._validation import check_integer
from archfem.dynamics.history import SIGN_CONVENTION, Ending, History
from archfem.dynamics.loose_fill import doubt_fallen_fill
from archfem.dynamics.monitor import RunMonitor
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.state import Batch, State, Step
from archfem.joints.criteria import Criteria
from archfem.joints.resultants import joint_variables
from archfem.models.model import Doubt, Model
from archfem.motion.motion import Motion, find_drift


@dataclass(frozen=True, kw_only=True)
class Record:
    """Which steps of a run are recorded.

    Attributes:
        every: interval of steps at which joint resultants are recorded.
        fields_every: interval of steps at which coordinates q are recorded, for pictures of the
            whole structure and for stress; None for none.
        whole_fall: whether loose blocks are followed until they rest, and their fall is doubted as
            it must; else a run ends once a block is lost for good.
        repeat: whether a run whose joints open is repeated with a fifth of its steps, and doubted
            where these change its largest displacement by a tenth or |e| by 0.02. By default single
            runs are, and not those of studies, ranges and searches. Models of over 300 coordinates,
            as of 100 rigid blocks, never are.
    """

    every: int = 1
    fields_every: int | None = None
    whole_fall: bool = True
    repeat: bool | None = None

    def __post_init__(self) -> None:
        """Refuse intervals below one."""
        check_integer(self.every, "record every")
        if self.fields_every is not None:
            check_integer(self.fields_every, "record fields_every")


def start_batch(stepper: Stepper, start: State, dt: float) -> Batch:
    """Return the start of a run as a batch of one step."""
    equation = stepper.equation
    resultants = equation.with_memory(start).resultants(equation.contact(start))
    return Step(start, resultants, 0, dt, equation.energy(start)).batch


class GrowingArray:
    """Rows that are added batch by batch, in one piece of memory."""

    def __init__(self) -> None:
        self._memory: NDArray[Any] | None = None
        self._count = 0

    def add(self, rows: NDArray[Any]) -> None:
        """Add rows at the end."""
        end = self._count + len(rows)
        if self._memory is None or end > len(self._memory):
            # the system provides memory once it is written to: what is not used costs nothing
            grown = np.empty((max(2 * end, 8192), *rows.shape[1:]), rows.dtype)
            if self._count:
                grown[: self._count] = self.rows
            self._memory = grown
        self._memory[self._count : end] = rows
        self._count = end  # last, for Ctrl-C

    @property
    def rows(self) -> NDArray[Any]:
        """All rows."""
        assert self._memory is not None
        return self._memory[: self._count]


@dataclass
class Recorder:
    """Record of a run from its start, with its validity checks."""

    monitor: RunMonitor
    state: State  # at the end of the steps added last
    method: str  # name of the solver
    dt: float | None  # constant time step [s]; None for steps of varying length
    record: Record  # which steps are recorded
    criteria: Criteria  # for the failure flags of joints
    fallback: int = 0  # number of steps at which a compiled solver fell back to SNES
    count: int = 0  # number of steps added, the start of the run among them
    _rows: dict[str, "GrowingArray"] = field(default_factory=lambda: defaultdict(GrowingArray))

    def __post_init__(self) -> None:
        self.model = self.monitor.model
        self._observer = self.model.observer()

    def add(self, batch: Batch, *, last: bool = False) -> None:
        """Record the steps of a batch that are due, and check all of them."""
        self.state = batch.state(len(batch.times) - 1)
        readings = batch.read(self._observer)
        drift = self.monitor.add(batch, readings)
        numbers = self.count + np.arange(len(batch.times))
        due: Any = slice(None)  # of all steps, which needs no copy
        if self.record.every > 1:
            due = numbers % self.record.every == 0
            due[-1] |= last
        # Ctrl-C may come between any two: the number of resultants, filled last, counts
        rows = {
            "iterations": batch.iterations,
            "smallest_step": batch.smallest_step,
            "drift": drift,
            "numbers": numbers[due],
            "times": batch.times[due],
            "faces": self._observer.faces(readings[due]),
            "resultants": batch.resultants[due],
        }
        for name, values in rows.items():
            self._rows[name].add(values)
        self.count += len(batch.times)
        self.fallback += batch.fallback * len(batch.times)
        if fields_every := self.record.fields_every:
            for k in np.flatnonzero(numbers % fields_every == 0).tolist():
                self._rows["frames"].add(batch.times[k : k + 1])
                self._rows["fields"].add(batch.state(k).q[None])
        self.monitor.check_run()

    def _rows_of(self, name: str) -> NDArray[Any]:
        """Return all rows of a quantity, in order of the steps."""
        return self._rows[name].rows

    def build_history(self, motion: Motion, ending: Ending, outcome: str) -> History:
        """Return the record as a history."""
        structure, resultants = self.model.structure, self._rows_of("resultants")
        times, faces = (self._rows_of(name)[: len(resultants)] for name in ("times", "faces"))
        moved = self.model.large_displacements
        variables, coordinates, attributes = joint_variables(
            structure, resultants, times, self.criteria, faces, moved
        )
        variables |= self._block_displacements()
        of_ground: dict[str, Any] = {"units": "m/s2", "long_name": "acceleration of the ground"}
        # long steps take the mean of the ground's acceleration, and end beside its peaks
        passed = np.append(np.arange(times[0], times[-1], motion.dt), times)
        of_ground["peaks"] = np.abs(motion.at(passed)).max(axis=0)
        variables["ground"] = ("time", "axis"), motion.at(times), of_ground
        variables |= self._effort(len(resultants))
        coordinates["block"] = [block.name for block in structure.blocks]
        coordinates["axis"] = ["x", "y"]
        self._add_coordinates(variables, coordinates)
        attributes |= self._attributes(motion, ending, outcome)
        dataset = xr.Dataset(variables, coordinates, attributes)
        history = History(dataset, structure)
        doubts = *self.monitor.doubts, *self._doubt_mass_damping(dataset), *doubt_drift(motion)
        fallen = doubt_fallen_fill(structure, dataset["residual_displacement"].values)
        return history.with_doubts((*doubts, *fallen))

    def _block_displacements(self) -> dict[str, Any]:
        """Return displacements of all blocks as variables of a dataset; zero for fixed blocks."""
        moved, subject = self.monitor.displacements, "displacement of its farthest corner"
        variables = dict[str, Any]()
        for name, values, units, text in (
            ("largest_displacement", moved.largest, "m", f"largest {subject}"),
            ("largest_displacement_time", moved.time, "s", f"time of the largest {subject}"),
            ("residual_displacement", moved.residual, "m", f"{subject} at the end"),
        ):
            of_all = np.zeros(len(self.model.structure.blocks))
            of_all[moved.blocks] = values
            variables[name] = "block", of_all, {"units": units, "long_name": text}
        time, corners = moved.peak
        subject = "displacement of the corners of free blocks, when that of a stone is largest"
        attributes = {"units": "m", "long_name": subject, "time": time}
        return variables | {"peak_displacement": (("corner", "axis"), corners, attributes)}

    def _doubt_mass_damping(self, dataset: xr.Dataset) -> list[Doubt]:
        """Return a doubt where joints opened and damping drags loose blocks."""
        share = self.monitor.mass_damping_share
        if not share or not (dataset["open"].values.any() or dataset["hinge"].values.any()):
            return []
        words = (
            "damping has a part proportional to mass, which also drags loose blocks, and joints "
            "opened: that part took {:.0%} of the energy lost"
        )
        return [Doubt(words, "use effective_damping(model, ratio) or StiffnessDamping", (share,))]

    def _attributes(self, motion: Motion, ending: Ending, outcome: str) -> dict[str, Any]:
        """Return the scalar results and settings of the run."""
        structure, monitor = self.model.structure, self.monitor
        smallest = self._rows_of("smallest_step")
        moved = monitor.displacements
        attributes = {
            "title": f"{structure.name}: {motion.name or 'time history'}",
            "motion": motion.name,
            "pga": motion.pga,  # [m/s²], which steps between its samples miss
            "outcome": outcome,
            "ended": str(ending),
            "fidelity": self.model.fidelity,
            "structure": structure.fingerprint,
            "method": self.method,
            "last_time": self.state.time,
            "energy_drift": monitor.worst_drift,
            "displacements": "large" if self.model.large_displacements else "small",
            "displacement": float(moved.largest[moved.stones].max()),
            "residual": float(moved.residual[moved.stones].max()),
            "largest_turn": monitor.largest_turn,
            # halved steps are dt/2 or shorter; 0.75 lies clear of round-off
            "halved_steps": int(np.sum(smallest < 0.75 * self.dt)) if self.dt else 0,
            "shortest_step": float(smallest[1:].min(initial=np.inf)),
            "steps": self.count - 1,
            "fallback_steps": self.fallback,
            "signs": SIGN_CONVENTION,
            "versions": library_versions(),
        }
        if monitor.fill_tension[0] > 0.0:
            attributes["fill_tension"], attributes["fill_tension_time"] = monitor.fill_tension
        if self.model.prediction:
            attributes["predicted_error"] = self.model.prediction.error
        return attributes

    def _effort(self, records: int) -> dict[str, Any]:
        """Return iterations and smallest step since the previous record, and drift, by record."""
        ends = self._rows_of("numbers")[:records]
        starts, recorded = np.append(0, ends[:-1] + 1), ends[-1] + 1
        iterations = np.add.reduceat(self._rows_of("iterations")[:recorded], starts)
        smallest = np.minimum.reduceat(self._rows_of("smallest_step")[:recorded], starts)
        since = "since the last record"
        passes = {"long_name": f"Newton iterations, or passes, {since}"}
        shortest = {"units": "s", "long_name": f"smallest step taken {since}"}
        energy = {"units": "J", "long_name": "energy drift since the start: gained without work"}
        return {
            "iterations": ("time", iterations, passes),
            "smallest_step": ("time", smallest, shortest),
            "energy_drift": ("time", self._rows_of("drift")[ends], energy),
        }

    def _add_coordinates(self, variables: dict[str, Any], coordinates: dict[str, Any]) -> None:
        """Add the recorded coordinates of the model and the state at the end to variables."""
        if "fields" in self._rows:
            fields = self._rows_of("fields")
            times = self._rows_of("frames")[: len(fields)]
            coordinates["frame_time"] = "frame", times, {"units": "s"}
            variables["q"] = ("frame", "coordinate"), fields
            corners = corner_displacements(self.model, fields)
            coordinates |= {str(name): each for name, each in corners.coords.variables.items()}
            variables["displacement"] = corners["displacement"].variable
        for name in ("q", "velocity", "acceleration"):
            variables[f"last_{name}"] = "coordinate", getattr(self.state, name)
        if self.state.memory is not None:
            variables["last_memory"] = "point", self.state.memory


def doubt_drift(motion: Motion) -> Iterator[Doubt]:
    """Yield a doubt of each component of a record that drifts as if pushed all the time."""
    for component in ("horizontal", "vertical") if motion.recorded else ():
        # 1.3 % of the peak changed the displacement of a column by 5 %; synthetic motions cut to
        # their significant duration have 0.8 % at most
        if component in motion.components and (share := find_drift(motion, component)[1]) > 0.01:
            yield Doubt(
                "the {} motion drifts: it ends with a velocity as of {:.0%} of its peak "
                "acceleration held throughout, which pushes the structure",
                "correct it by `baseline_corrected = true` under [motion], in Python by "
                ".baseline_corrected(), unless the ground is to move on",
                (component, float(f"{share:.3g}")),  # the same of every scale
            )


def corner_displacements(model: Model, fields: Array) -> xr.Dataset:
    """Return the displacements of the corners of the free blocks, for each row of coordinates."""
    structure, cells = model.structure, model.cells
    points = cells.corners(structure)
    names = [structure.blocks[number].name for number in cells.block[points]]
    displacements = np.array([cells.displacement(q)[points] for q in fields])
    x, y = cells.places[points].T
    return xr.Dataset(
        {"displacement": (("frame", "corner", "axis"), displacements, {"units": "m"})},
        {
            "corner_block": ("corner", names),
            "corner_x": ("corner", x, {"units": "m"}),
            "corner_y": ("corner", y, {"units": "m"}),
            "axis": ["x", "y"],
        },
    )


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
