"""A whole time history: from dead load to the end of the motion, recorded as asked."""

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np
from tqdm import tqdm

from archfem.arguments import instance, real, whole
from archfem.dynamics.collapse import Parting, fallen, left_standing, tilting
from archfem.dynamics.events import Until, Watch, agreed, begun, first_told
from archfem.dynamics.guard import Guard
from archfem.dynamics.history import Ending, History, with_fall
from archfem.dynamics.recorder import Recorder
from archfem.dynamics.schemes import (
    HHT,
    Conserving,
    Newmark,
    Rayleigh,
    Scheme,
    StiffnessDamping,
    Viscous,
    check_turning,
)
from archfem.dynamics.stepping.choice import stepper_for
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.pace import Pace
from archfem.dynamics.stepping.stepper import Stepper
from archfem.dynamics.steps import Batch, State
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.models.model import Model, check_model
from archfem.models.moving import Moving
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load
from archfem.statics.newton import Newton
from archfem.threads import on_one_thread

logger = logging.getLogger("archfem")

LEAST_STEP = 1e-6
"""Shortest time step that can be meant [s]: a second has a million of them."""

STEP = 0.005
"""Time step by which strategies are compared where steps have lengths of their own [s]."""

TOLERANCE = 0.005
"""Error of |e| that steps in time may cause where none is given [-]."""


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
            if key == "every" or value is not None:
                whole(value, f"record {key}")


_KINDS: dict[str, tuple[tuple[type, ...], str, str]] = {
    "start": ((Equilibrium, State), "start", "give dead_load(model), or last_state(run)"),
    "damping": (
        (Rayleigh, StiffnessDamping),
        "damping",
        "give Rayleigh(0.05, (8.0, 16.0)), StiffnessDamping(0.05, 8.0), or None",
    ),
    "scheme": ((Conserving, Newmark, HHT), "scheme", "give Conserving(), Newmark() or HHT()"),
    "record": ((Record,), "record", "give Record(every=…, fields_every=…)"),
    "criteria": ((Criteria,), "criteria", "give Criteria(hinge=…, failures=…)"),
    "newton": ((Newton,), "newton", "give Newton(tolerance=…)"),
}
"""Classes of arguments, what to call them, and what to give."""


@on_one_thread
def time_history(  # noqa: PLR0913  (one call, one object for each thing that may vary)
    model: Model,
    motion: Motion,
    *,
    dt: float | None = None,
    tolerance: float | None = None,
    start: Equilibrium | State | None = None,
    damping: Viscous | None = None,
    scheme: Scheme | None = None,
    record: Record | None = None,
    until: Until | None = None,
    criteria: Criteria | None = None,
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
        dt: time step [s]; by default the steps for which the model was chosen, or else steps of
            different lengths, as the tolerance asks for. Accelerations between samples are
            interpolated.
        tolerance: error of |e| of the joints of rings and piers that steps in time may cause [-],
            without `dt`; by default that for which the model was chosen, or 0.005. Steps are from
            0.1 to 20 ms long; `tolerance_unmet` of the history says for which part of the shortest
            the error was larger.
        start: the dead load, found first where it is not given, or the `last_state` of an
            earlier run, which is then continued.
        damping: `StiffnessDamping`, also as by `effective_damping` or `restitution_damping`;
            `Rayleigh`, whose mass part also drags blocks that are loose; None is undamped.
        scheme: `Conserving` (the default), `Newmark` (average acceleration) or `HHT`; the last two
            for joints that never slide.
        record: what is kept; by default the resultants of every step.
        until: event that ends the run, or a function of the structure and N, V, M of its joints
            (n_joints, 3) [N, N, N m] that gives words to end it; by default only the end of the
            motion does.
        criteria: what makes a joint fail, and how many failed joints make a mechanism; the history
            carries them. By default those of the event, or else the usual ones.
        newton: settings of the solves.
        method: "snes" solves each step through PETSc. Compiled methods give the same history many
            times faster: "contact" works in the modes of the closed structure, "chain" on banded
            matrices, "compliance", for large structures, with one sparse factor and the open
            joint points alone, and "tangent", where many of those slide, with a sparse tangent.
            "auto" takes the fastest that applies; none does where joints dilate or resist tension,
            and "snes" takes the run. A `Stepper` is taken as it is, with its own damping, scheme
            and solves.

    Returns:
        The history; its `ended` and, in words, its `outcome` say how the run ended.

    Raises:
        InvalidInput: an argument cannot be meant, or run and event have different criteria.
        DidNotConverge: a step failed; `history` is the record up to it, `last` the state.
    """
    check_model(model)
    instance(motion, Motion, "motion", "give a Motion, e.g. Motion.read(path)")
    _check_kinds(start=start, damping=damping, scheme=scheme, record=record)
    _check_kinds(criteria=criteria, newton=newton)
    dt, tolerance = _steps(model, dt, tolerance)
    criteria = agreed(criteria, until)
    watch = None if until is None else begun(until, model.structure, criteria)
    if isinstance(start, Equilibrium):
        model = start.continued(model)
    if isinstance(model, Moving) and scheme is not None:
        check_turning(scheme)
    equation = Equation(model, motion, damping, scheme or Conserving())
    if not isinstance(start, State):
        rest = start or dead_load(model, newton)
        start = equation.at_rest(rest.q, memory=rest.model.memory)
    start.check(model)
    stepper = stepper_for(method, equation, start, dt or STEP, newton)
    first = _first(stepper, start, dt or STEP)
    recorder = _recorder(stepper, first, dt, motion.duration, record or Record(), criteria)
    pace = None if dt else Pace(stepper, tolerance, first)
    try:
        recorder.add(first)
        parting = Parting(model) if isinstance(model, Moving) else None
        ended, outcome = _stepped(pace or stepper, recorder, (watch, parting), motion.duration)
    except KeyboardInterrupt:
        ended, outcome = Ending.INTERRUPTED, f"interrupted at {recorder.state.time:.4g} s"
        logger.warning("%s: what was computed is kept", outcome)
    except DidNotConverge as error:
        words = f"failed at {recorder.state.time:.4g} s: {error}"
        error.history = recorder.history(motion, Ending.FAILED, words)
        raise
    history = recorder.history(motion, ended, outcome)
    if pace is not None:
        history.dataset.attrs |= {"tolerance": tolerance, "tolerance_unmet": pace.unmet_share}
    return _judged(history, model, recorder.state, motion) if isinstance(model, Moving) else history


def _judged(history: History, model: Moving, state: State, motion: Motion) -> History:
    """A run of a structure that may fall, with what it has left of it, unless broken off."""
    if history.ended is Ending.INTERRUPTED:
        return history
    tilts = history.ended is Ending.FINISHED and tilting(model, state)
    if history.ended is not Ending.PARTED and not tilts:
        return with_fall(history, left_standing(model, state))
    try:
        frames, fall = fallen(model, state, motion)
    except DidNotConverge as error:
        error.history = history
        raise
    dataset = history.dataset.merge(frames).assign_attrs(history.dataset.attrs | frames.attrs)
    return with_fall(History(dataset, history.structure), fall)


def _steps(model: Model, dt: float | None, tolerance: float | None) -> tuple[float | None, float]:
    """The time step [s], None where steps have lengths of their own, and the tolerance [-]."""
    if tolerance is not None:
        if dt is not None:
            raise InvalidInput(f"dt = {dt!r} s and tolerance = {tolerance!r}: give one of both")
        if not 0.0 < real(tolerance, "tolerance on |e| [-]") < 1.0:
            raise InvalidInput(f"tolerance {tolerance!r} on |e| is not between 0 and 1: try 0.005")
        return None, tolerance
    if dt is None and model.prediction:
        return model.prediction.dt, model.prediction.pace or TOLERANCE
    if dt is None:
        return None, TOLERANCE
    if not LEAST_STEP <= real(dt, "dt [s]") <= 0.1:
        raise InvalidInput(f"dt {dt!r} s is not between {LEAST_STEP:g} and 0.1 s")
    return dt, TOLERANCE


def _check_kinds(**given: Any) -> None:
    """Refuse arguments of the wrong class; None leaves each to its default."""
    for name, value in given.items():
        if value is not None:
            instance(value, *_KINDS[name])


def _first(stepper: Stepper, start: State, dt: float) -> Batch:
    """The start, as a batch of one."""
    equation = stepper.equation
    return Batch(
        np.array([start.time]),
        equation.remembering(start).resultants(equation.contact(start))[None],
        np.zeros(1, dtype=np.int64),
        np.array([dt]),
        equation.energy(start)[None],
        lambda _: start,
    )


def _recorder(
    stepper: Stepper, first: Batch, dt: float | None, end: float, record: Record, criteria: Criteria
) -> Recorder:
    """A recorder of a run yet to begin, with a guard over it."""
    model, start = stepper.equation.model, first.state(0)
    return Recorder(
        model=model,
        method=stepper.name,
        dt=dt,
        steps=max(0, round((end - start.time) / (dt or STEP))),
        every=record.every,
        fields_every=record.fields_every,
        criteria=criteria,
        guard=Guard(model, first, damps=isinstance(stepper.equation.scheme, HHT)),
        state=start,
    )


def _stepped(
    stepper: Stepper | Pace,
    recorder: Recorder,
    watches: tuple[Watch | None, Parting | None],
    end: float,
) -> tuple[Ending, str]:
    """Record steps to the end of the motion, or up to an event; which of both, also in words."""
    start = recorder.state
    batches = (
        stepper.batches(start, end)
        if isinstance(stepper, Pace)
        else stepper.batches(start, recorder.dt or STEP, end)
    )
    with _bar(end - start.time) as bar:
        for batch in batches:
            ended, reason, size = _reason(watches, batch, recorder.state.time)
            recorder.add(batch.cut(size), last=reason is not None)
            bar.update(round(recorder.state.time - start.time - bar.n, 4))
            if reason is not None:
                time = recorder.state.time
                return ended, f"ended at {time:.4g} s by {reason}"
    return Ending.FINISHED, "reached the end of the motion"


def _bar(duration: float) -> tqdm:
    return tqdm(total=round(duration, 4), unit="s", disable=None, leave=False)


def _reason(
    watches: tuple[Watch | None, Parting | None], batch: Batch, before: float
) -> tuple[Ending, str | None, int]:
    """How and why the run ends within a batch, if it does, and after how many of its steps."""
    watch, parting = watches
    loose = parting.step(batch) if parting is not None else None
    last = len(batch.times) if loose is None else loose[0] + 1
    if watch is not None:
        steps = np.diff(batch.times[:last], prepend=before).tolist()
        if met := first_told(watch, batch.resultants[:last], steps):
            return Ending.EVENT, met[1], met[0] + 1
    if loose is not None:
        return Ending.PARTED, f"the blocks coming loose: {loose[1]}", last
    return Ending.FINISHED, None, last


def last_state(history: History) -> State:
    """Return the state in which a run ended, from which another can go on.

    Args:
        history: of that run, also as read from its file; the coordinates of the other run's model
            must be the same.

    Raises:
        InvalidInput: the history does not hold it.
    """
    dataset = history.dataset
    q, velocity, acceleration, memory = (
        dataset[f"last_{name}"].values if f"last_{name}" in dataset else None
        for name in ("q", "velocity", "acceleration", "memory")
    )
    if q is None or velocity is None or acceleration is None:
        raise InvalidInput("this history does not hold the state in which its run ended")
    told = dataset.attrs
    return State(float(told["last_time"]), q, velocity, acceleration, memory, told.get("structure"))
