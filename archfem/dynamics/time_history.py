"""Time history of a structure under ground motion, from dead load to the end of the record.

The equation of motion is stepped by a solver in batches; every batch is checked, scanned for events
and recorded. Where displacements are large and blocks separate, the run continues with loose rigid
blocks until they rest (`dynamics.fall`).
"""

from collections.abc import Iterable, Iterator
from math import floor, log10
from time import monotonic
from typing import Any

import numpy as np

from archfem._display import ProgressReport
from archfem._threads import single_threaded
from archfem._validation import check_between, check_type, validate_arguments
from archfem.dynamics import events
from archfem.dynamics.analysis import Analysis, takes_analysis
from archfem.dynamics.damping import resolve_effective_damping
from archfem.dynamics.error_estimation import RunPeaks, follow_peaks
from archfem.dynamics.fall import follow_fall, mark_interrupted
from archfem.dynamics.history import Ending, History
from archfem.dynamics.monitor import RunMonitor
from archfem.dynamics.recorder import Record, Recorder, start_batch
from archfem.dynamics.schemes import (
    HHT,
    Conserving,
    EffectiveDamping,
    Scheme,
    Viscous,
    check_large_displacement_scheme,
    check_time_step,
)
from archfem.dynamics.separation import LooseningMonitor
from archfem.dynamics.slip_error import SlipError
from archfem.dynamics.solvers.adaptive import AdaptiveStepper
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.solvers.selection import stepper_for
from archfem.dynamics.state import Batch, State
from archfem.errors import DidNotConverge, InvalidInput, keep_warnings, logger
from archfem.joints.criteria import Criteria, assessed_joints, eccentricity_magnitude
from archfem.models.model import Doubt, Model, check_model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load
from archfem.statics.fill_checks import fill_doubts
from archfem.statics.newton import Newton

# Remedies of steps that a case gives
LEAVE_OUT = "leave dt out, and each step is as long as its error allows"
OR_LEAVE_OUT = ", or leave dt out"

# Models whose runs are repeated with shorter steps, up to 100 rigid blocks: their size, and endings
MAX_REPEATED_SIZE, REPEATED_ENDINGS = 300, (Ending.FINISHED, Ending.EVENT)

# Largest changes by a fifth of the steps without a doubt: of the displacement over the larger one,
# and of the largest |e| [-]. In 74 runs of blocks all that changed by more erred by over half of it
MAX_CHANGE, MAX_ECCENTRICITY_CHANGE = 0.1, 0.02


@takes_analysis
@single_threaded
def time_history(  # noqa: PLR0913  (one call, one object for each thing that may vary)
    model: Model | Analysis,
    motion: Motion,
    *,
    dt: float | None = None,
    tolerance: float | None = None,
    start: Equilibrium | State | None = None,
    damping: Viscous | EffectiveDamping | str | None = None,
    scheme: Scheme | None = None,
    record: Record | None = None,
    until: events.StopCondition | None = None,
    criteria: Criteria | None = None,
    newton: Newton | None = None,
    method: str | Stepper = "auto",
) -> History:
    """Compute the response of a structure to ground motion and record its joints.

    Horizontal and vertical ground acceleration act together, on top of the dead load, from time
    zero to the end of the motion. Displacements are small and relative to the ground, unless the
    model was built with `displacements="large"`. On a terminal a bar shows progress; Ctrl-C ends
    the run and returns the steps computed so far.

    Args:
        model: model of any fidelity, or an `Analysis`: any of its settings that is given as a
            keyword replaces its own.
        motion: ground acceleration.
        dt: time step [s]; by default the step for which the model was selected, or else steps of
            varying length by `tolerance`. Accelerations between samples are interpolated.
        tolerance: admissible error in one step of |e| of the joints of rings and piers [-], without
            `dt`; by default 0.005. It bounds no error of the result: rocking multiplies errors of
            steps, and the run is repeated with shorter ones (`Record.repeat`). The slip of a joint
            may err in one step by 4e-4 of its depth times this tolerance. Steps are from 0.1 to 20
            ms long; `tolerance_unmet` of the history is the share of the shortest steps in which an
            error was larger. Its `slip_error` is the sum of the errors of the slip of the worst
            joint [m].
        start: dead load, computed if not given, or the `last_state` of an earlier run, which is
            then continued.
        damping: "effective", 5 % at the first mode effective along x about the dead load, or
            `EffectiveDamping` with other values; `StiffnessDamping`, also from
            `restitution_damping`; `Rayleigh`, whose mass part also drags loose blocks; None is
            undamped.
        scheme: `Conserving` (the default), `Newmark` (average acceleration) or `HHT`; the last two
            for joints that never slide.
        record: which steps are recorded; by default the resultants of every step.
        until: event that ends the run, or a function that returns a reason to end it. The function
            has the structure and N, V, M of its joints (n_joints, 3) [N, N, N m] as arguments. By
            default only the end of the motion ends the run.
        criteria: failure criteria of joints and number of failures of a mechanism, stored in the
            history. By default those of the event, or else the default `Criteria`.
        newton: settings of Newton's method.
        method: "snes" solves each step through PETSc. Two compiled solvers give the same history
            many times faster. "newton" applies Newton's method to all coordinates: for large
            displacements, and for chains of rigid, or of many, blocks, whose tangent has a narrow
            band. "compliance" uses one sparse factor and solves for the open and sliding joint
            points alone. "auto" selects by the size of displacements, the width of the band and
            the number of points; where joints dilate or resist tension only "snes" applies. A
            `Stepper` is used as it is, with its own damping, scheme and solves.

    Returns:
        The history; its `ending` and, in words, its `outcome` say how the run ended.

    Raises:
        InvalidInput: an argument is out of range, or run and event have different criteria.
        DidNotConverge: a step failed; `history` is the record up to it, `last` the state.
    """
    _check_motion(motion)
    _check_types(start=start, scheme=scheme, record=record, criteria=criteria, newton=newton)
    assert not isinstance(model, Analysis)  # by the decorator
    check_model(model)
    dt, tolerance = _resolve_steps(model, dt, tolerance)
    criteria = events.resolve_criteria(criteria, until)
    event = None if until is None else events.start_monitor(until, model.structure, criteria)
    if model.large_displacements and scheme is not None:
        check_large_displacement_scheme(scheme)
    model, start, viscous = _resolve_start(model, start, damping, newton)
    equation = Equation(model, motion, viscous, scheme or Conserving())
    if isinstance(start, Equilibrium):
        start = equation.at_rest(start.q, memory=start.model.memory)
    start.check(model)
    stepper = stepper_for(method, equation, newton)
    first = start_batch(stepper, start, dt or 0.005)  # typical where steps vary in length
    recorder = _make_recorder(stepper, first, dt, record or Record(), criteria)
    adaptive = AdaptiveStepper(stepper, tolerance, first, SlipError(model.structure, motion, first))
    try:
        recorder.add(first)
        monitors = event, LooseningMonitor.of(model, start) if model.large_displacements else None
        batches = _take_steps(adaptive, start, dt, motion.duration)
        ending, outcome = _run_steps(batches, recorder, monitors, motion)
    except KeyboardInterrupt:
        ending, outcome = Ending.INTERRUPTED, f"interrupted at {recorder.state.time:.4g} s"
        logger.warning("%s: what was computed is kept", outcome, extra={"of_run": True})
    except DidNotConverge as error:
        words = f"failed at {recorder.state.time:.4g} s: {error}"
        error.history = recorder.build_history(motion, Ending.FAILED, words)
        raise
    history = recorder.build_history(motion, ending, outcome)
    history = _state_step_errors(history, adaptive, dt, tolerance)
    history = _repeat_with_shorter_steps(history, stepper, start, dt, recorder.record)
    if not model.large_displacements or ending is Ending.INTERRUPTED:
        return history
    whole = recorder.record.whole_fall
    with ProgressReport(motion.name, None, rarely=True):  # of all passes, which may be short
        return follow_fall(history, model, (start, recorder.state), motion, viscous, whole)


def run_analysis(analysis: Analysis, motion: Motion) -> History:
    """Compute the time history of an analysis, with the doubts of its fill."""
    history = time_history(analysis, motion)
    return history.with_doubts((*history.doubts, *fill_doubts(analysis.structure)))


def _resolve_start(
    model: Model,
    start: Equilibrium | State | None,
    damping: Viscous | EffectiveDamping | str | None,
    newton: Newton | None,
) -> tuple[Model, Equilibrium | State, Viscous | None]:
    """Return the model with the joints of its start, the start, and the damping about it."""
    if isinstance(start, State):
        return model, start, resolve_effective_damping(damping, model, None)[0]
    rest = start or dead_load(model, newton)
    return rest.transfer_memory(model), rest, resolve_effective_damping(damping, model, rest)[0]


def _state_step_errors(
    history: History, adaptive: AdaptiveStepper, dt: float | None, tolerance: float
) -> History:
    """Return the history with the errors of its steps, and the doubts that follow."""
    attrs, share = history.dataset.attrs, adaptive.unmet_share
    attrs["slip_error"] = float(adaptive.slip_error.total.max(initial=0.0))
    doubts = _doubt_slips(history, adaptive.slip_error, dt)
    if dt is None:
        attrs |= {"tolerance": tolerance, "tolerance_unmet": share}
        doubts += _doubt_shortest_steps(tolerance, share)
    else:
        doubts += _doubt_constant_steps(tolerance, share, dt)
    return history.with_doubts((*history.doubts, *doubts)) if doubts else history


def _doubt_shortest_steps(tolerance: float, share: float) -> list[Doubt]:
    """Return a doubt where over 2 % of the shortest steps missed the tolerance."""
    words = f"the shortest steps erred by more than {tolerance:g} in |e| in {{:.0%}} of the run"
    remedy = "compare with constant steps of 0.1 ms or less (`--set analysis.dt=1e-4`), "
    return [Doubt(words, f"{remedy}or with more damping", (share,))] if share > 0.02 else []


def _doubt_constant_steps(tolerance: float, share: float, dt: float) -> list[Doubt]:
    """Return a doubt of a constant step [s] where three quarters of them missed the tolerance."""
    # displacements of rings and stacks then differed by 6 % and more from those of short steps
    words = f"steps of {1e3 * dt:g} ms are long: in {{:.0%}} of them |e| may err by more than "
    return [Doubt(f"{words}{tolerance:g}", LEAVE_OUT, (share,))] if share > 0.75 else []


def _repeat_with_shorter_steps(
    history: History, stepper: Stepper, start: State, dt: float | None, record: Record
) -> History:
    """Return a history, doubted where shorter steps change its largest displacement or |e|.

    The error of a step is local, and rocking multiplies it. Of 74 runs of blocks by default steps
    10 erred by over a fifth of their displacement or 0.02 of |e|: a fifth of the steps showed all
    of them, and half the steps 8.
    """
    attrs = history.dataset.attrs
    joints = eccentricity_magnitude(assessed_joints(history.joints)).values
    largest = float(joints.max(initial=0.0))
    end, mean = float(attrs["last_time"]), dt or 0.0
    if (taken := attrs["steps"]) and not dt:
        mean = (end - start.time) / taken
    asked = record.whole_fall if record.repeat is None else record.repeat
    asked = asked and stepper.equation.model.size <= MAX_REPEATED_SIZE
    # closed joints multiply no error, and loose blocks have no joints
    if not asked or largest <= 1.0 / 6.0 or not taken or history.ending not in REPEATED_ENDINGS:
        return history
    step = float(f"{min(0.5 * mean, max(0.2 * mean, 1e-4)):.2g}")
    try:
        with keep_warnings():  # which are those of the run
            run = follow_peaks(stepper, step, [(start, end)])
    except KeyboardInterrupt:
        return mark_interrupted(history, "its comparison with shorter steps, at the end")
    peaks = (largest, attrs["displacement"]), run, record.every == 1
    return history.with_doubts((*history.doubts, *_doubt_longer_steps((mean, step), *peaks)))


def _doubt_longer_steps(
    steps: tuple[float, float], found: tuple[float, float], shorter: RunPeaks, compares_e: bool
) -> Iterator[Doubt]:
    """Yield a doubt of the largest |e| and displacement of a run, which shorter steps change."""
    lengths = tuple(1e3 * step for step in reversed(steps))
    remedy = f"take shorter steps, `--set analysis.dt={steps[1]:g}`, until this doubt ends"
    if shorter.peaks is None:
        words = "with steps of {:.2g} ms in place of {:.2g} ms the run fails, or blocks come loose"
        yield Doubt(words, remedy, lengths)
        return
    (e, moved), largest = found, float(shorter.peaks.max(initial=0.0))
    differs = abs(shorter.displacement - moved) > MAX_CHANGE * max(shorter.displacement, moved)
    if differs or (compares_e and abs(largest - e) > MAX_ECCENTRICITY_CHANGE):
        words = (
            "steps of {:.2g} ms in place of {:.2g} ms change the largest displacement from {:mm} "
            "to {:mm}, and the largest |e| from {:.3f} to {:.3f}"
        )
        remedy += "; where it stays, rocking multiplies any small error, and no one number holds"
        yield Doubt(words, remedy, (*lengths, moved, shorter.displacement, e, largest))


def _doubt_slips(history: History, slip_error: SlipError, dt: float | None) -> list[Doubt]:
    """Return a doubt where the slip errs by much, by constant or, without dt [s], varying steps.

    In sliding blocks and rings the error was up to 1.5 times its sum over the steps, a third on
    average.
    """
    if not len(slip_error.joints):
        return []
    dataset, joints = history.dataset, slip_error.joints
    worst, error = int(joints[slip_error.total.argmax()]), float(slip_error.total.max())
    # a thousandth of the depth, by which |e| errs by a fifth of the default tolerance
    limit = 1e-3 * float(dataset["depth"].values[worst])
    if error <= limit:
        return []
    name, slips = str(dataset["name"].values[worst]), dataset["slip"].transpose("time", "joint")
    if dt is None:  # these follow where sliding begins and ends, and not where it turns
        left = abs(float(slips[-1, worst] - slips[0, worst]))
        words = "where slides turn without rest the slip of '{}' may err by {:mm}; {:mm} remain"
        remedy = "compare with constant steps, `--set analysis.dt=5e-4`"
        return [Doubt(words, remedy, (name, error, left))] if error > 0.2 * left else []
    # a tenth of the largest slip on average
    largest = float(np.abs(slips.values - slips.values[0])[:, joints].max())
    limit = max(limit, 0.3 * largest)
    return _doubt_steps_of_sliding(history, (name, error, limit, largest), dt)


def _doubt_steps_of_sliding(
    history: History, slips: tuple[str, float, float, float], dt: float
) -> list[Doubt]:
    """Return a doubt of a constant step [s] where the slip errs by much; state a shorter one.

    Given are the joint, the error of its slip, its limit and the largest slip of all joints [m].
    """
    name, error, limit, largest = slips
    if error <= limit:
        return []
    sizes: tuple[float, ...] = error, largest
    said = "{:mm}, where the largest slip is {:mm}"
    remedy = OR_LEAVE_OUT
    if error > max(largest, limit / 0.3):  # a sum of bounds, which says nothing of the step
        said, sizes = "as much as it is, {:mm} at most", (largest,)
        remedy = f", and compare{OR_LEAVE_OUT}"
        error = max(largest, limit / 0.3)
    # the error varies with the square of the step, and faster where steps miss peaks
    shorter = dt * (limit / error) ** 0.5
    unit = 10.0 ** floor(log10(shorter))
    shorter = floor(shorter / unit) * unit
    history.dataset.attrs["admissible_step"] = shorter
    words = f"steps of {1e3 * dt:g} ms are long for sliding: of '{{}}' the slip may be wrong by"
    remedy = f"take {1e3 * shorter:g} ms or less, `--set analysis.dt={shorter:g}`{remedy}"
    return [Doubt(f"{words} {said}", remedy, (name, *sizes))]


def _resolve_steps(
    model: Model, dt: float | None, tolerance: float | None, default: float = 0.005
) -> tuple[float | None, float]:
    """Return the time step [s], None for steps of varying length, and the tolerance on |e| [-]."""
    if tolerance is not None:
        if dt is not None:
            raise InvalidInput(f"dt = {dt!r} s and tolerance = {tolerance!r}: give one of both")
        check_between(tolerance, "tolerance on |e| [-]", 0.0, 1.0, remedy="try 0.005")
        return None, tolerance
    if dt is None and model.prediction:
        return model.prediction.dt, default
    return None if dt is None else check_time_step(dt), default


def _check_motion(motion: Motion) -> None:
    """Refuse all but a motion that lasts."""
    check_type(
        motion, Motion, "motion", "give a Motion, e.g. Motion.read(path), or .motion of a Match"
    )
    if motion.duration == 0.0:
        words = f"motion '{motion.name}' is one sample, of which no history can be computed"
        raise InvalidInput(f"{words}: give two or more, or add rest by .with_rest(…)")


def _check_types(**arguments: Any) -> None:
    """Refuse arguments of the wrong class; None stands for the default."""
    # classes of optional arguments, and valid examples
    kinds: dict[str, tuple[Any, str]] = {
        "start": (Equilibrium | State, "dead_load(model), or last_state(run)"),
        "scheme": (Scheme, "Conserving(), Newmark() or HHT()"),
        "record": (Record, "Record(every=…, fields_every=…)"),
        "criteria": (Criteria, "Criteria(hinge=…, failures=…)"),
        "newton": (Newton, "Newton(tolerance=…)"),
    }
    for name, value in arguments.items():
        if value is not None:
            check_type(value, kinds[name][0], name, f"give {kinds[name][1]}")


def _make_recorder(
    stepper: Stepper, first: Batch, dt: float | None, record: Record, criteria: Criteria
) -> Recorder:
    """Return the recorder of a run, with its validity checks."""
    equation = stepper.equation
    damps, drag = isinstance(equation.scheme, HHT), equation.drag
    monitor = RunMonitor(equation.model, first, damps=damps, mass_damping=drag)
    return Recorder(monitor, first.state(0), stepper.name, dt, record, criteria)


# What may end a run: an event, and blocks that become loose where displacements are large
Monitors = tuple[events.EventMonitor | None, LooseningMonitor | None]


def _take_steps(
    adaptive: AdaptiveStepper, start: State, dt: float | None, end: float
) -> Iterator[Batch]:
    """Yield steps up to a time, of one length or, without one, of adaptive length."""
    if dt is None:
        yield from adaptive.batches(start, end)
        return
    for batch in adaptive.stepper.batches(start, dt, end):
        adaptive.judge(batch)
        yield batch


def _run_steps(
    batches: Iterable[Batch], recorder: Recorder, monitors: Monitors, motion: Motion
) -> tuple[Ending, str]:
    """Record steps up to an event or the end of the motion; return how and why the run ended."""
    start = recorder.state
    duration, is_announced = round(motion.duration - start.time, 4), False
    # the pace is that after the first batch, which may wait for compilation
    begun = since = 0.0
    with ProgressReport(motion.name, duration, rarely=True) as progress:
        for batch in batches:
            ending, reason, size = _find_end(monitors, batch, before := recorder.state.time)
            if size:
                recorder.add(batch.cut(size), last=reason is not None)
            time = recorder.state.time
            progress.show(f"{time:.3g} of {motion.duration:.3g} s", round(time - before, 6))
            if reason is not None:
                when = f"{recorder.state.time:.4g} s"
                if ending.is_loose:
                    return ending, f"went on with loose blocks from {when} on, due to {reason}"
                return ending, f"ended at {when} by {reason}"
            if not begun:
                begun, since = monotonic(), recorder.state.time
            spent, done = monotonic() - begun, recorder.state.time - since
            # first steps, whose length is sought, are no pace
            if not is_announced and spent > 5.0 and done > 0.01 * duration:
                is_announced = True
                _announce_long_run(spent, done, duration, recorder.dt)
    return Ending.FINISHED, "reached the end of the motion"


def _announce_long_run(
    spent: float, done: float, duration: float, dt: float | None, long: float = 60.0
) -> None:
    """Warn of a run that takes long, estimated from its pace [s]."""
    if (whole := spent * duration / done) > long:
        logger.warning(
            "the run takes about %.3g minutes at its pace (%.3g of %g s in %.3g s): Ctrl-C ends it "
            "with what was computed%s",
            *(whole / 60.0, done, duration, spent),
            "" if dt else ", and a given dt skips the comparison of steps",
            extra={"of_run": True},  # of the machine: no doubt about the answer
        )


def _find_end(monitors: Monitors, batch: Batch, before: float) -> tuple[Ending, str | None, int]:
    """Return how and why a run ends within a batch, if it does, and after how many steps."""
    event, loosening = monitors
    ending, reason, last = Ending.FINISHED, None, len(batch.times)
    if loosening is not None:
        ending, reason, last = loosening.find_end(batch)
    # an event at that step or before has precedence
    if event is not None and last:
        steps = np.diff(batch.times[:last], prepend=before).tolist()
        if met := events.first_event(event, batch.resultants[:last], steps):
            return Ending.EVENT, met[1], met[0] + 1
    return ending, reason, last


@validate_arguments
def last_state(history: History) -> State:
    """Return the state at the end of a run, from which another run can start.

    Args:
        history: history of the run, also as read from its file; the model of the other run must
            have the same coordinates.

    Raises:
        InvalidInput: the history does not contain it.
    """
    dataset, names = history.dataset, ("q", "velocity", "acceleration", "memory")
    kept = {x: dataset[f"last_{x}"].values for x in names if f"last_{x}" in dataset}
    if not {*names[:3]} <= kept.keys():
        raise InvalidInput("this history does not hold the state in which its run ended")
    attrs = dataset.attrs
    return State(float(attrs["last_time"]), **kept, structure=attrs.get("structure"))
