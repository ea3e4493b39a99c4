"""Events that end a time history: enough joints have failed, or the failed joints permit a motion.

An event is a condition without state, so that one event serves any number of runs. At the start of
a run it creates a monitor, which evaluates the condition at every step.

Most steps repeat a pattern of failed joints. Monitors therefore scan N, V, M for the pattern, and
evaluate the costly condition (mechanism count, rigid-block motion) once per distinct pattern.
"""

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial, wraps
from typing import Any, Protocol, runtime_checkable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._typing import Array
from archfem._validation import check_choice, report_user_errors, validate_arguments
from archfem.errors import InvalidInput
from archfem.joints.criteria import (
    Criteria,
    DurationCounter,
    check_criteria,
    judge_joints,
    sliding_ratio,
    tension_margin,
)
from archfem.joints.resultants import eccentricity_and_friction, joint_dataset
from archfem.limit.mechanism_count import (
    MECHANISM_KINDS,
    OVER_RECORD,
    counted_mechanism,
    counted_mechanisms,
    matching_definitions,
)
from archfem.limit.mechanism_kinematics import VerifiedMechanism, get_verifier
from archfem.masonry.parts import select_assessed_parts
from archfem.masonry.structure import Structure, join_joint_names


@dataclass(frozen=True, eq=False)
class FailureState:
    """Failures of the scanned joints at a step."""

    failed: NDArray[np.bool_]  # whether each joint has failed; head joints never count (n,)
    joint_states: Callable[[], xr.Dataset]  # labels and flags of all joints, by `joint_dataset`


@dataclass(eq=False)
class FailureScan:
    """Scan of joints for failures at every step; it evaluates each distinct failure pattern once.

    The query maps a pattern to the names of the conditions that hold; results are cached.
    """

    structure: Structure
    criteria: Criteria
    numbers: Sequence[int]  # of the scanned joints
    query: Callable[[FailureState], frozenset[str]]

    def __post_init__(self) -> None:
        structure, numbers = self.structure, np.array(self.numbers, dtype=np.intp)
        self._numbers, self._depth = numbers, structure.depths[numbers]
        self._laws = (
            self.criteria.coefficients(structure.friction[numbers]),
            self.criteria.cohesions(structure.cohesion[numbers]),
        )
        self._tension = structure.tension[numbers]
        self._cache: dict[bytes, frozenset[str]] = {}

    def __call__(self, resultants: Array, min_failures: int) -> Iterator[frozenset[str]]:
        """Yield the set of named conditions that hold at each step; empty below `min_failures`."""
        forces = resultants[:, self._numbers]
        e, friction = eccentricity_and_friction(forces, self._depth)
        limits = sliding_ratio(forces[..., 0], e, *self._laws)
        hinges, slides = judge_joints(e, friction, limits, self.criteria.hinge)
        apart = tension_margin(forces[..., 0], self._tension) <= 0.0
        failing = hinges | slides | apart
        senses = np.where(hinges, np.sign(e), 0.0), np.where(slides, np.sign(forces[..., 1]), 0.0)
        states = np.stack([*senses, slides, apart], axis=1).astype(np.int8)
        is_counted = ~self.structure.heads[self._numbers]
        for step, count in enumerate(np.count_nonzero(failing, axis=1).tolist()):
            if count < min_failures:
                yield frozenset()
                continue
            key = states[step].tobytes()
            if key not in self._cache:
                joints = partial(self.joint_states, resultants[step])
                self._cache[key] = self.query(FailureState(failing[step] & is_counted, joints))
            yield self._cache[key]

    def joint_states(self, resultants: Array) -> xr.Dataset:
        """Return the resultants and failure flags of all joints at a step, as a dataset."""
        return joint_dataset(self.structure, resultants, criteria=self.criteria)


@dataclass(frozen=True, eq=False)
class FailureMonitor:
    """Monitor that evaluates many steps at once."""

    scan: FailureScan
    min_failures: int  # number of failed joints below which no condition can hold
    # from the conditions that hold at a step, its N, V, M and its length [s] to the reason to end
    reason: Callable[[frozenset[str], Array, float], str | None]

    def __call__(self, resultants: Array, step: float) -> str | None:
        """Return the reason to end the run at a step, or None."""
        event = self.find_first(resultants[None], [step])
        return None if event is None else event[1]

    def find_first(self, resultants: Array, steps: Iterable[float]) -> tuple[int, str] | None:
        """Return the first step that ends the run and the reason, or None."""
        states = zip(self.scan(resultants, self.min_failures), resultants, steps, strict=True)
        for number, (conditions, forces, step) in enumerate(states):
            if reason := self.reason(conditions, forces, step):
                return number, reason
        return None


# From N, V, M (n_joints, 3) of a step and its length [s] to the reason to end the run, or None
EventMonitor = Callable[[Array, float], str | None]


@runtime_checkable
class Event(Protocol):
    """Condition that ends a run.

    Attributes:
        criteria: failure criteria of joints, or None for those of the run.
    """

    @property
    def criteria(self) -> Criteria | None:
        """Failure criteria of joints, or None for those of the run."""

    def start_monitor(self, structure: Structure, criteria: Criteria) -> EventMonitor:
        """Create the monitor of one run.

        Args:
            structure: structure of the run.
            criteria: failure criteria of the run.

        Returns:
            Function of N, V, M (n_joints, 3) [N, N, N m] of a step and the length of the step [s];
            it returns the reason to end the run, or None.
        """


# An event, or a function of the structure and N, V, M of a step that returns a reason or None
StopCondition = Event | Callable[[Structure, Array], str | None]

# Criteria of the user by name
registered_criteria: dict[str, Callable[[Structure, Array], str | None]] = {}


@validate_arguments
def register_criterion(name: str, criterion: Callable[[Structure, Array], str | None]) -> None:
    """Add a criterion that ends a run, which case files can name in `analysis.until`.

    In Python `time_history(…, until=criterion)` needs no registration.

    Args:
        name: name of the criterion.
        criterion: function of the structure and of N, V, M of all joints at a step (n_joints, 3)
            [N, N, N m]; it returns the reason to end the run, or None.

    Raises:
        InvalidInput: the function does not take two arguments; in a run, its error with its line,
            or that it returned another thing than a text or None.
    """
    try:
        inspect.signature(criterion).bind(None, None)
    except TypeError as error:
        raise InvalidInput(
            f"criterion '{name}' takes the structure, and N, V, M of its joints: {error}"
        ) from error

    @wraps(criterion)
    def check(structure: Structure, resultants: Array) -> str | None:
        with report_user_errors(f"criterion '{name}'"):
            reason = criterion(structure, resultants)
        if not (reason is None or isinstance(reason, str)):
            raise InvalidInput(f"criterion '{name}' returned {reason!r}: return a text, or None")
        return reason

    registered_criteria[name] = check


@dataclass(frozen=True, kw_only=True)
class CountedMechanism:
    """Event: enough joints of a part, or of several parts, have failed to make a mechanism.

    A joint fails by a hinge, by sliding or by loss of contact. The condition must last for the
    duration of the criteria. The reason says whether the blocks can also move.

    Attributes:
        criteria: failure criteria of joints and number of failures of a mechanism; None for those
            of the run. Criteria given here alone become those of the run.
        kinds: classes that end the run, of "local", "semi-global" and "global"; "local" alone with
            over="record".
        over: "instant" counts joints that have failed at once; "record" counts each joint from its
            first failure on, within one ring or one pier, see `limit.mechanism_over_record`.

    Raises:
        InvalidInput: unknown class, or a value out of range.
    """

    criteria: Criteria | None = None
    kinds: tuple[str, ...] = MECHANISM_KINDS
    over: str = "instant"

    def __post_init__(self) -> None:
        check_criteria(self.criteria)
        _check_kinds(self.kinds)
        check_choice(self.over, "over", ("instant", "record"))
        if self.over == "record" and "local" not in self.kinds:
            raise InvalidInput(
                f"kinds = {self.kinds!r}: over='record' counts in one ring or pier, and its "
                "mechanism is 'local'; leave kinds out"
            )

    def start_monitor(self, structure: Structure, criteria: Criteria) -> EventMonitor:
        """Create the monitor of one run; its reason names the failed joints.

        Args:
            structure: structure of the run.
            criteria: failure criteria of the run.
        """
        if self.over == "record":
            return _monitor_record(structure, criteria)
        verifier, count = get_verifier(structure), partial(counted_mechanism, kinds=self.kinds)

        def describe(joints: xr.Dataset) -> str:
            counted, motion = count(joints), verifier.verify(joints)
            assert counted is not None
            return f"a mechanism of {counted.part} by {join_joint_names(counted.names)}; {motion}"

        assessed = np.flatnonzero(structure.judged).tolist()
        return _monitor_lasting(structure, criteria, assessed, criteria.failures, count, describe)


@dataclass(frozen=True, kw_only=True)
class MovingMechanism:
    """Event: the failed joints, with all others rigid, permit a motion of the blocks.

    The condition must last for the duration of the criteria. The reason says whether the number of
    failures agrees.

    Attributes:
        criteria: failure criteria of joints; None for those of the run. Criteria given here alone
            become those of the run.
        kinds: classes that end the run, of "local", "semi-global" and "global".

    Raises:
        InvalidInput: unknown class, or a value out of range.
    """

    criteria: Criteria | None = None
    kinds: tuple[str, ...] = MECHANISM_KINDS

    def __post_init__(self) -> None:
        check_criteria(self.criteria)
        _check_kinds(self.kinds)

    def start_monitor(self, structure: Structure, criteria: Criteria) -> EventMonitor:
        """Create the monitor of one run; its reason names the joints that permit the motion.

        Args:
            structure: structure of the run.
            criteria: failure criteria of the run.
        """
        verifier = get_verifier(structure)

        def find(joints: xr.Dataset) -> VerifiedMechanism | None:
            motion = verifier.verify_if_moving(joints)
            return motion if motion and motion.kind in self.kinds else None

        def describe(joints: xr.Dataset) -> str:
            motion = verifier.verify(joints)
            return f"a mechanism that moves, by {join_joint_names(motion.moved.names)}; {motion}"

        scanned = verifier.rigid_regions.joints
        return _monitor_lasting(structure, criteria, scanned, 1, find, describe)


@dataclass(frozen=True, kw_only=True)
class EveryMechanism:
    """Event: mechanisms by all definitions have occurred, each at some time of the run.

    Each must last for the duration of the criteria. Definitions for which the structure has too few
    joints are left out.

    Attributes:
        criteria: failure criteria of joints and number of failures of a mechanism; None for those
            of the run. Criteria given here alone become those of the run.

    Raises:
        InvalidInput: a value is out of range.
    """

    criteria: Criteria | None = None

    def __post_init__(self) -> None:
        check_criteria(self.criteria)

    def start_monitor(self, structure: Structure, criteria: Criteria) -> EventMonitor:
        """Create the monitor of one run, which stores the definitions met so far.

        Args:
            structure: structure of the run.
            criteria: failure criteria of the run.
        """
        verifier = get_verifier(structure)
        scanned = sorted({*np.flatnonzero(structure.judged), *verifier.rigid_regions.joints})
        roles = {joint.part: joint.role for joint in structure.joints}
        assessed = select_assessed_parts(roles)
        parts = np.array([structure.joints[number].part for number in scanned])
        required = {"verified", *applicable_definitions(structure, criteria)}
        timers = {name: DurationCounter(criteria.duration) for name in required - {OVER_RECORD}}
        met: set[str] = set()
        ever_failed = RecordCounter(structure, criteria)

        def conditions_of(state: FailureState) -> frozenset[str]:
            count = {part: int(state.failed[parts == part].sum()) for part in assessed}
            counted = matching_definitions(count, roles, criteria.failures)
            failed = {_joint_condition(scanned[k]) for k in np.flatnonzero(state.failed).tolist()}
            # once there was a motion, no further one is searched for
            moves = "verified" not in met and verifier.verify_if_moving(state.joint_states())
            return counted | failed | ({"verified"} if moves else set())

        def reason(conditions: frozenset[str], _: Array, step: float) -> str | None:
            if ever_failed.add_step(conditions, step):
                met.add(OVER_RECORD)
            # every timer takes every step: one that does not hold starts again
            met.update(n for n, timer in timers.items() if timer.add_step(n in conditions, step))
            return "a mechanism by each definition" if met >= required else None

        return FailureMonitor(FailureScan(structure, criteria, scanned, conditions_of), 1, reason)


# Events by their words in a case
EVENTS: Mapping[str, type] = {
    "counted mechanism": CountedMechanism,
    "moving mechanism": MovingMechanism,
    "every mechanism": EveryMechanism,
}


class RecordCounter:
    """Counts the joints of each ring and pier that have failed at any time of a run."""

    def __init__(self, structure: Structure, criteria: Criteria) -> None:
        assessed = np.flatnonzero(structure.judged).tolist()
        self._waiting = {_joint_condition(number): structure.joints[number] for number in assessed}
        self._timers: dict[str, DurationCounter] = {}  # of joints that fail at present
        self._criteria = criteria
        self.failed: dict[str, list[str]] = {}  # names of joints, by part

    def add_step(self, conditions: frozenset[str], step: float) -> str | None:
        """Add the failed joints of a step; return the part in which enough have failed, or None."""
        duration, failures = self._criteria.duration, self._criteria.failures
        self._timers = {
            name: self._timers.get(name) or DurationCounter(duration)
            for name in self._waiting  # in the order of the structure
            if name in conditions
        }
        for name, timer in self._timers.items():
            if timer.add_step(True, step):
                joint = self._waiting.pop(name)
                self.failed.setdefault(joint.part, []).append(joint.name)
        return next((part for part, names in self.failed.items() if len(names) >= failures), None)


def _joint_condition(number: int) -> str:
    """Return the condition that a joint has failed."""
    return f"joint {number}"


def _monitor_lasting(
    structure: Structure,
    criteria: Criteria,
    numbers: Sequence[int],
    min_failures: int,
    find: Callable[[xr.Dataset], object | None],
    describe: Callable[[xr.Dataset], str],
) -> FailureMonitor:
    """Return a monitor that ends a run, in words, once a mechanism that is found has lasted."""
    unbroken = DurationCounter(criteria.duration)

    def query(state: FailureState) -> frozenset[str]:
        return frozenset() if find(state.joint_states()) is None else frozenset({"mechanism"})

    scan = FailureScan(structure, criteria, numbers, query)

    def reason(conditions: frozenset[str], resultants: Array, step: float) -> str | None:
        lasts = unbroken.add_step(bool(conditions), step)
        return describe(scan.joint_states(resultants)) if lasts else None

    return FailureMonitor(scan, min_failures, reason)


def _monitor_record(structure: Structure, criteria: Criteria) -> FailureMonitor:
    """Return a monitor that ends a run once enough joints of a part have failed during the run."""
    assessed, ever_failed = np.flatnonzero(structure.judged), RecordCounter(structure, criteria)

    def failed(state: FailureState) -> frozenset[str]:
        return frozenset(_joint_condition(number) for number in assessed[state.failed].tolist())

    def reason(conditions: frozenset[str], _: Array, step: float) -> str | None:
        part = ever_failed.add_step(conditions, step)
        if part is None:
            return None
        names = join_joint_names(ever_failed.failed[part])
        return f"a mechanism of {part} over the record, by {names}"

    scan = FailureScan(structure, criteria, assessed.tolist(), failed)
    return FailureMonitor(scan, 1, reason)


def resolve_criteria(criteria: Criteria | None, until: StopCondition | None) -> Criteria:
    """Return the criteria shared by a run and the event that may end it."""
    of_event = until.criteria if isinstance(until, Event) else None
    if criteria is not None and of_event is not None and criteria != of_event:
        raise InvalidInput(
            f"the run is judged by {criteria}, and its event by {of_event}: give criteria to the "
            "run alone, which its event then obeys"
        )
    return criteria or of_event or Criteria()


def start_monitor(until: StopCondition, structure: Structure, criteria: Criteria) -> EventMonitor:
    """Create the monitor of one run from an event or a function."""
    if isinstance(until, type) or not (isinstance(until, Event) or callable(until)):
        raise InvalidInput(
            f"until = {until!r} is no event: give one, e.g. CountedMechanism(), or a function of "
            "the structure and of N, V, M of its joints"
        )
    if isinstance(until, Event):
        return until.start_monitor(structure, criteria)
    return lambda resultants, step: until(structure, resultants)


def first_event(
    monitor: EventMonitor, resultants: Array, steps: Sequence[float]
) -> tuple[int, str] | None:
    """Return the first step at which a monitor ends the run and the reason, or None."""
    if isinstance(monitor, FailureMonitor):
        return monitor.find_first(resultants, steps)
    for number, step in enumerate(steps):
        if reason := monitor(resultants[number], step):
            return number, reason
    return None


def applicable_definitions(
    structure: Structure, criteria: Criteria | None = None
) -> tuple[str, ...]:
    """Return the definitions of `counted_mechanisms` for which the structure has enough joints."""
    # without forces all joints are apart, so that all definitions that can be met are
    joints = joint_dataset(structure, np.zeros((len(structure.joints), 3)), criteria=criteria)
    return tuple(name for name, mechanism in counted_mechanisms(joints).items() if mechanism)


def _check_kinds(kinds: Any) -> None:
    """Refuse unknown classes of mechanisms."""
    known = isinstance(kinds, list | tuple) and all(kind in MECHANISM_KINDS for kind in kinds)
    if not known or not kinds:
        raise InvalidInput(f"kinds = {kinds!r}: give some of {MECHANISM_KINDS}, as a tuple")
