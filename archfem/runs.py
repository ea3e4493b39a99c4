"""A whole time history: from dead load to the end of the motion, recorded as asked."""

import logging
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from archfem.errors import DidNotConverge, InvalidInput
from archfem.events import CountedMechanism as CountedMechanism
from archfem.events import Event
from archfem.guard import Guard
from archfem.history import History
from archfem.models import Model
from archfem.motion import Motion
from archfem.newton import Newton
from archfem.schemes import Newmark, Rayleigh, Scheme
from archfem.states import Batch, State
from archfem.statics import Equilibrium, dead_load
from archfem.stepping.choice import stepper_for
from archfem.stepping.equation import Equation
from archfem.stepping.stepper import Stepper
from archfem.tape import Tape

logger = logging.getLogger("archfem")

STEP = 0.005
"""Time step where none is given [s]."""


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


def time_history(  # noqa: PLR0913  (one call, one object for each thing that may vary)
    model: Model,
    motion: Motion,
    *,
    dt: float | None = None,
    start: Equilibrium | State | None = None,
    damping: Rayleigh | None = None,
    scheme: Scheme | None = None,
    record: Record | None = None,
    until: Event | None = None,
    newton: Newton | None = None,
    method: str | Stepper = "auto",
) -> History:
    """Shake a structure and record what its joints do.

    Horizontal and vertical ground acceleration act together, on top of the dead load, from time
    zero to the end of the motion. Displacements are small and relative to the ground. On a
    terminal a bar shows progress; Ctrl-C ends the run and keeps what was computed.

    Args:
        model: any rung of the ladder.
        motion: of the ground.
        dt: time step [s], by default 0.005, or that for which the model was chosen; ground
            accelerations between samples are interpolated.
        start: the dead load, found first where it is not given, or the `last_state` of an
            earlier run, which is then continued.
        damping: None is undamped.
        scheme: `Newmark` (average acceleration, the default) or `HHT`.
        record: what is kept; by default the resultants of every step.
        until: event that ends the run; by default only the end of the motion does.
        newton: settings of the solves.
        method: "snes" solves each step through PETSc. Three compiled methods give the same history
            many times faster: "contact" works in the modes of the closed structure, "chain" on
            banded matrices, and "compliance", for large structures, with one sparse factor and
            the open joint points alone. "auto" takes the fastest that applies. A `Stepper` is
            taken as it is, with its own damping, scheme and solves.

    Returns:
        The history; its `outcome` says how the run ended.

    Raises:
        InvalidInput: dt cannot be meant.
        DidNotConverge: a step failed; `history` is the record up to it, `last` the state.
    """
    predicted = getattr(model, "prediction", None)
    if dt is None:
        dt = STEP if predicted is None else predicted.dt
    if not 0.0 < dt <= 0.1:
        raise InvalidInput(f"dt {dt!r} s is not between 0 and 0.1 s")
    equation = Equation(model, motion, damping, scheme or Newmark())
    if not isinstance(start, State):
        start = equation.at_rest((start or dead_load(model, newton)).q)
    stepper = stepper_for(method, equation, start, dt, newton)
    first = _first(stepper, start, dt)
    tape = _tape(stepper, first, dt, record or Record())
    number, state, outcome = 0, start, "reached the end of the motion"
    try:
        tape.add(0, first)
        # Steps are too small for threads, which only get in each other's way.
        with _bar(start, motion, dt) as bar, threadpool_limits(limits=1, user_api="blas"):
            for batch in stepper.batches(start, dt, motion.duration):
                reason, size = _reason(until, model, batch)
                batch = batch.cut(size)
                state = batch.state(size - 1)
                tape.add(number + 1, batch)
                number += size
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


def _first(stepper: Stepper, start: State, dt: float) -> Batch:
    """The start, as a batch of one."""
    equation = stepper.equation
    return Batch(
        np.array([start.time]),
        equation.model.resultants(equation.contact(start))[None],
        np.zeros(1, dtype=np.int64),
        np.array([dt]),
        equation.energy(start)[None],
        lambda _: start,
    )


def _tape(stepper: Stepper, first: Batch, dt: float, record: Record) -> Tape:
    """An empty tape, and a guard over it."""
    model = stepper.equation.model
    return Tape(model, stepper.name, dt, record.every, record.fields_every, Guard(model, first))


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


def last_state(history: History) -> State:
    """The state in which a run ended, from which another can go on."""
    dataset = history.dataset
    return State(
        float(dataset.attrs["last_time"]),
        *(dataset[f"last_{name}"].values for name in ("q", "velocity", "acceleration")),
    )
