"""A whole time history: from dead load to the end of the motion, recorded as asked."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version

import numpy as np
from tqdm import tqdm

from archfem.contact import LARGEST, ContactStepper, applies
from archfem.criteria import FAILURES, HINGE, counted_mechanism
from archfem.dynamics import Batch, State, Stepper
from archfem.errors import DidNotConverge, InvalidInput
from archfem.history import SIGNS, History
from archfem.models import Model
from archfem.motion import Motion
from archfem.newton import Newton
from archfem.resultants import joint_dataset
from archfem.schemes import Rayleigh, Scheme
from archfem.statics import Equilibrium, dead_load
from archfem.structure import Array, Structure

logger = logging.getLogger("archfem")

Event = Callable[[Structure, Array], str | None]
"""Looks at N, V, M (n_joints, 3) of a step; words that say why the run ends, or None."""

METHODS = ("auto", "contact", "snes")


@dataclass(frozen=True, kw_only=True)
class Record:
    """What of a run is kept.

    Attributes:
        every: keep the joints' resultants at every n-th step.
        fields_every: keep the coordinates q at every n-th step, for pictures of the whole
            structure and for stress; None keeps none.
    """

    every: int = 1
    fields_every: int | None = None

    def __post_init__(self) -> None:
        """Refuse steps below one."""
        for key in ("every", "fields_every"):
            value = getattr(self, key)
            if value is not None and value < 1:
                raise InvalidInput(f"record {key} = {value}: keep every 1st, 2nd, … step")


@dataclass(frozen=True, kw_only=True)
class CountedMechanism:
    """Event: so many joints of one part hinge, slide or have come apart at once.

    Attributes:
        limit: of |e| for a hinge [-].
        failures: how many make a mechanism.
    """

    limit: float = HINGE
    failures: int = FAILURES

    def __call__(self, structure: Structure, resultants: Array) -> str | None:
        """Say which joints have failed, or None."""
        normal, shear, moment = np.abs(resultants.T)
        depth = np.array([joint.depth for joint in structure.joints])
        friction = np.array([joint.contact.friction for joint in structure.joints])
        down = (moment >= self.limit * normal * depth) | (shear > friction * normal)
        if down.sum() < self.failures:
            return None
        joints = joint_dataset(structure, resultants)
        found = counted_mechanism(joints, self.limit, self.failures)
        return f"a mechanism: joints {found.joints} of the {found.part}" if found else None


@dataclass
class _Tape:
    """What has been recorded so far."""

    model: Model
    record: Record
    method: str
    times: list[float] = field(default_factory=list)
    resultants: list[Array] = field(default_factory=list)
    effort: list[tuple[int, float]] = field(default_factory=list)
    frames: list[float] = field(default_factory=list)
    fields: list[Array] = field(default_factory=list)

    def add(self, first: int, batch: Batch) -> None:
        """Keep of a batch, whose steps count from `first`, what was asked for."""
        for k, number in enumerate(range(first, first + len(batch.times))):
            if number % self.record.every == 0:
                self.times.append(batch.times[k])
                self.resultants.append(batch.resultants[k])
                self.effort.append((batch.iterations[k], batch.smallest[k]))
            if self.record.fields_every and number % self.record.fields_every == 0:
                self.frames.append(batch.times[k])
                self.fields.append(batch.state(k).q)

    def history(self, motion: Motion, state: State, outcome: str) -> History:
        """Everything as one dataset."""
        times = np.array(self.times)
        dataset = joint_dataset(self.model.structure, np.array(self.resultants), times)
        ground = motion.at(times)
        dataset["ground"] = (
            ("time", "axis"),
            ground,
            {"units": "m/s2", "long_name": "acceleration of the ground"},
        )
        dataset.coords["axis"] = ["x", "y"]
        iterations, smallest = zip(*self.effort, strict=True)
        dataset["iterations"] = ("time", list(iterations), {"long_name": "Newton iterations"})
        dataset["smallest_step"] = ("time", list(smallest), {"units": "s"})
        if self.fields:
            dataset.coords["frame_time"] = ("frame", self.frames, {"units": "s"})
            dataset["q"] = (("frame", "coordinate"), np.array(self.fields))
        for name in ("q", "velocity", "acceleration"):
            dataset[f"last_{name}"] = ("coordinate", getattr(state, name))
        dataset.attrs = {
            "title": f"time history of {self.model.structure.name} under {motion.name or 'motion'}",
            "outcome": outcome,
            "fidelity": self.model.fidelity,
            "method": self.method,
            "last_time": state.time,
            "signs": SIGNS,
            "versions": versions(),
        }
        return History(dataset)


def time_history(  # noqa: PLR0913  (one call, one object for each thing that may vary)
    model: Model,
    motion: Motion,
    *,
    dt: float = 0.005,
    start: Equilibrium | State | None = None,
    damping: Rayleigh | None = None,
    scheme: Scheme | None = None,
    record: Record | None = None,
    until: Event | None = None,
    newton: Newton | None = None,
    method: str = "auto",
) -> History:
    """Shake a structure and record what its joints do.

    Horizontal and vertical ground acceleration act together, on top of the dead load, from time
    zero to the end of the motion. Displacements are small and relative to the ground. On a
    terminal a bar shows progress; Ctrl-C ends the run and keeps what was computed.

    Args:
        model: any rung of the ladder.
        motion: of the ground.
        dt: time step [s]; ground accelerations between samples are interpolated.
        start: the dead load, found first where it is not given, or the `last_state` of an
            earlier run, which is then continued.
        damping: None is undamped.
        scheme: `Newmark` (average acceleration, the default) or `HHT`.
        record: what is kept; by default the resultants of every step.
        until: event that ends the run; by default only the end of the motion does.
        newton: settings of the solves.
        method: "snes" solves each step through PETSc; "contact" works in the modes of the closed
            structure and gives the same history many times faster, where it applies; "auto"
            takes that where it applies.

    Returns:
        The history; its `outcome` says how the run ended.

    Raises:
        InvalidInput: dt cannot be meant.
        DidNotConverge: a step failed; `history` is the record up to it, `last` the state.
    """
    if not 0.0 < dt <= 0.1:
        raise InvalidInput(f"dt {dt!r} s is not between 0 and 0.1 s")
    stepper = _stepper(method, model, motion, damping, scheme, newton)
    if not isinstance(start, State):
        start = stepper.at_rest((start or dead_load(model, newton)).q)
    tape = _Tape(model, record or Record(), stepper.name)
    lag = damping.stiffness if damping and damping.joints == "closed" else 0.0
    contact = start.q + lag * start.velocity
    tape.add(0, _first(start, model.resultants(contact), dt))
    number, state, outcome = 0, start, "reached the end of the motion"
    try:
        with _bar(start, motion, dt) as bar:
            for batch in stepper.batches(start, dt, motion.duration):
                reason, size = _reason(until, model, batch)
                batch = batch.cut(size)
                tape.add(number + 1, batch)
                number += size
                state = batch.state(size - 1)
                bar.update(size)
                if reason:
                    outcome = f"ended at {state.time:.4g} s by {reason}"
                    break
    except KeyboardInterrupt:
        outcome = f"interrupted at {state.time:.4g} s"
        logger.warning("%s: what was computed is kept", outcome)
    except DidNotConverge as error:
        error.history = tape.history(motion, state, f"failed at {state.time:.4g} s: {error}")
        raise
    return tape.history(motion, state, outcome)


def _stepper(
    method: str,
    model: Model,
    motion: Motion,
    damping: Rayleigh | None,
    scheme: Scheme | None,
    newton: Newton | None,
) -> Stepper | ContactStepper:
    """The stepper that was asked for; "auto" takes the contact stepper where it applies."""
    if method not in METHODS:
        raise InvalidInput(f"method '{method}' is not known: use one of {METHODS}")
    fits = applies(model, damping)
    if method == "contact" and not fits:
        raise InvalidInput(
            f"the contact stepper needs blocks between joints, at most {LARGEST} coordinates "
            f"(here {model.size}), and damping on closed or initial joints: use method='snes'"
        )
    if method == "snes" or not fits:
        return Stepper(model, motion, damping=damping, scheme=scheme, newton=newton)
    return ContactStepper(model, motion, damping=damping, scheme=scheme, newton=newton)


def _first(start: State, resultants: Array, dt: float) -> Batch:
    """The start, as a batch of one."""
    return Batch(
        np.array([start.time]),
        resultants[None],
        np.zeros(1, dtype=np.int64),
        np.array([dt]),
        lambda _: start,
    )


def _bar(start: State, motion: Motion, dt: float) -> tqdm:
    steps = max(0, round((motion.duration - start.time) / dt))
    return tqdm(total=steps, unit="step", disable=None, leave=False)


def _reason(until: Event | None, model: Model, batch: Batch) -> tuple[str | None, int]:
    """Why the run ends within a batch, if it does, and after how many of its steps."""
    if until is not None:
        for k, resultants in enumerate(batch.resultants):
            if reason := until(model.structure, resultants):
                return reason, k + 1
    return None, len(batch.times)


def versions() -> str:
    """Versions of the libraries that results depend on."""
    found = []
    for name in ("archfem", "numpy", "scipy", "petsc4py", "fenics-dolfinx", "gmsh"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(found)


def last_state(history: History) -> State:
    """The state in which a run ended, from which another can go on."""
    dataset = history.dataset
    return State(
        float(dataset.attrs["last_time"]),
        *(dataset[f"last_{name}"].values for name in ("q", "velocity", "acceleration")),
    )
